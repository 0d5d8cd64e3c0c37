//! Tests of `fretwear export RUN@K --contact csv`, and of scenes that read the exported table.

use std::fs;

use fretwear::tables::TableName;

use crate::support::{Bench, latest, table};

/// Settings of the small resonator: several sliders per contact element, two more harmonics and no wear.
const BANKS: [&str; 5] = [
    "contact.stiffness=sliders",
    "dynamics.harmonics=[0, 1, 3]",
    "dynamics.points=5",
    "wear.cycles=1",
    "fidelity.preset=fast",
];

fn set(sets: &[&str]) -> Vec<String> {
    sets.iter()
        .flat_map(|set| ["--set".to_owned(), (*set).to_owned()])
        .collect()
}

fn run(bench: &Bench, scene: &str, folder: &str, sets: &[&str]) {
    let mut arguments = vec![
        "run".to_owned(),
        scene.to_owned(),
        "--run".to_owned(),
        folder.to_owned(),
    ];
    arguments.extend(set(sets));
    bench.done(&arguments);
}

/// Scene with the sections for structure, vibration and accuracy of another scene, and with the contact elements from a CSV table.
fn by_table(scene: &str) -> String {
    let mut kept = String::new();
    let mut section = "";
    for line in scene.lines() {
        if let Some(rest) = line.strip_prefix('[') {
            section = rest.split(']').next().unwrap_or_default();
        }
        let of_joint = section == "joint" && line.starts_with("grid");
        if !["surface", "contact", "wear", "update"].contains(&section) && !of_joint {
            kept += &format!("{line}\n");
        }
    }
    kept + "[contact]\nelements = \"x/contact.csv\"\n"
}

#[test]
fn the_table_of_a_run_has_its_response() {
    let bench = Bench::new();
    run(&bench, "resonator.toml", "a", &BANKS);
    bench.done(&["export", "a@0", "--contact", "csv", "-o", "x"]);
    let scene = by_table(&fs::read_to_string(bench.path("resonator.toml")).expect("a scene"));
    bench.write("table.toml", scene);
    run(
        &bench,
        "table.toml",
        "b",
        &[
            "dynamics.harmonics=[0, 1, 3]",
            "dynamics.points=5",
            "fidelity.preset=fast",
        ],
    );
    let of = |run: &str, name| table(&bench.path(run), 0, name);
    for column in [
        "resonance_frequency",
        "resonance_amplitude",
        "friction_energy",
        "viscous_energy",
    ] {
        let value = |run| {
            of(run, TableName::DynamicResponse)
                .f64(column)
                .expect("a column")[0]
        };
        let (a, b) = (value("a"), value("b"));
        assert!((b / a - 1.0).abs() < 1e-9, "{column}: {a:e}, {b:e}");
    }
    let sliders = |run| of(run, TableName::ContactSlider);
    for column in ["normal_load", "gap", "kn", "kt"] {
        let (a, b) = (sliders("a"), sliders("b"));
        assert_eq!(
            a.f64(column).expect("a column"),
            b.f64(column).expect("a column"),
            "{column}"
        );
    }
    // A second export from the scene with the table writes the same table in every format.
    for (form, own) in [
        ("csv", "vibration.json"),
        ("pyharm", "pyharm_joint.py"),
        ("nlvib", "nlvib_joint.m"),
    ] {
        bench.done(&["export", "b", "--contact", form, "-o", "y"]);
        assert!(bench.path("y").join(own).is_file(), "{own}");
    }
    let text =
        |folder: &str| fs::read_to_string(bench.path(folder).join("contact.csv")).expect("a table");
    assert_eq!(text("x"), text("y"));
}

#[test]
fn one_slider_keeps_strength_and_energy() {
    let bench = Bench::new();
    run(&bench, "resonator.toml", "a", &BANKS);
    let k = latest(&bench.path("a"));
    let said = bench
        .done(&[
            "export",
            &format!("a@{k}"),
            "--contact",
            "csv",
            "-o",
            "x",
            "--one-slider",
        ])
        .stdout();
    assert!(said.contains("with one slider each"), "{said}");
    let text = fs::read_to_string(bench.path("x/one_slider.csv")).expect("a table");
    let mut lines = text.lines();
    let columns: Vec<&str> = lines.next().expect("a head").split(',').collect();
    let place = |name: &str| {
        columns
            .iter()
            .position(|column| *column == name)
            .expect(name)
    };
    let (bank, one) = (place("energy_bank"), place("energy_one"));
    let rows: Vec<Vec<f64>> = lines
        .map(|line| {
            line.split(',')
                .map(|v| v.parse().expect("a number"))
                .collect()
        })
        .collect();
    let sum = |column: usize| rows.iter().map(|row| row[column]).sum::<f64>();
    assert!(
        (sum(one) / sum(bank) - 1.0).abs() < 0.05,
        "{} J of {} J",
        sum(one),
        sum(bank)
    );
    let table = fs::read_to_string(bench.path("x/contact.csv")).expect("a table");
    let sliders = table.lines().filter(|line| !line.starts_with('#')).count() - 1;
    assert_eq!(sliders, rows.len());
}

#[test]
fn a_table_that_does_not_fit_is_an_error() {
    let bench = Bench::new();
    run(&bench, "resonator.toml", "a", &BANKS);
    bench.done(&["export", "a@0", "--contact", "csv", "-o", "x"]);
    let scene = by_table(&fs::read_to_string(bench.path("resonator.toml")).expect("a scene"));
    bench.write("table.toml", scene);
    let good = fs::read_to_string(bench.path("x/contact.csv")).expect("a table");
    let first = good
        .lines()
        .find(|line| line.starts_with("0,"))
        .expect("a row")
        .to_owned();
    let shifted = first.replacen("0,-", "0,-1", 1);
    for (text, says) in [
        (
            good.replace("normal_load,gap", "load,gap"),
            "there is no column `normal_load`",
        ),
        (
            good.replace(&first, &first.replacen("0,", "0,x", 1)),
            "is not a finite number",
        ),
        (good.replacen(&first, &shifted, 1), "of element 0"),
        (
            good.lines()
                .filter(|line| !line.starts_with("3,"))
                .map(|line| format!("{line}\n"))
                .collect(),
            "element 4 follows element 2",
        ),
        (
            good.lines()
                .take_while(|line| !line.starts_with("7,"))
                .map(|line| format!("{line}\n"))
                .collect(),
            "the table has 7 contact elements, but the structure of the scene has 88",
        ),
        (String::new(), "there is no column `element`"),
    ] {
        bench.write("x/contact.csv", text);
        let did = bench.fretwear(&["check", "table.toml"]);
        let said = did.stdout() + &did.stderr();
        assert_eq!(did.code(), 2, "{said}");
        assert!(said.contains(says), "{says}: {said}");
    }
    for (sets, says) in [
        (
            ["contact.kn=1 N/um"],
            "contact.elements gives it for each contact element",
        ),
        (
            ["contact.friction_coefficient=0.5"],
            "contact.elements gives it for each contact element",
        ),
    ] {
        let did = bench.fretwear(&["check", "table.toml", "--set", sets[0]]);
        let said = did.stdout() + &did.stderr();
        assert!(said.contains(says), "{said}");
    }
    let did = bench.fretwear(&["export", "small.toml", "--contact", "csv"]);
    assert_eq!(did.code(), 2);
}
