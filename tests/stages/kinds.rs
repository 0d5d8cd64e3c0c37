//! Each kind of scene runs and verifies. The tables have exactly the columns of its physics.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::Arc;

use fretwear::scene::Plan;
use fretwear::stages::{RunOptions, Stage};
use fretwear::tables::TableName;

use super::{Seen, Start};
use crate::support::faulty::FaultyFileSystem;
use crate::support::{Bench, SMALL, latest, reader, summary, table, verified};

const SHORT: &str = "wear.cycles=60_000";

fn run(bench: &Bench, scene: &str, sets: &[&str]) -> std::path::PathBuf {
    let root = bench.path("run");
    Start::new(bench.scene(scene, sets), &root).done();
    verified(&root);
    root
}

/// Columns of a table of the last iteration.
fn columns(root: &Path, name: TableName) -> BTreeSet<String> {
    let table = table(root, latest(root), name);
    table
        .columns()
        .map(|(schema, _)| schema.name.clone())
        .collect()
}

/// Names of the tables of an iteration.
fn tables(root: &Path, k: u64) -> BTreeSet<String> {
    let commit = reader(root).commit_of(k).expect("committed").clone();
    commit.tables.into_keys().collect()
}

fn set(names: &[&str]) -> BTreeSet<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Asserts that each iteration has the columns of the last one.
fn assert_same_columns(root: &Path) {
    for name in [
        TableName::Summary,
        TableName::ContactField,
        TableName::Cycle,
    ] {
        let last = columns(root, name);
        for k in 0..latest(root) {
            let found = table(root, k, name);
            let found: BTreeSet<_> = found.columns().map(|(s, _)| s.name.clone()).collect();
            assert_eq!(found, last, "{name} of iteration {k}");
        }
    }
}

const STATIC_SUMMARY: [&str; 19] = [
    "contact_area",
    "corrected_area_fraction",
    "error_corrected_area",
    "normal_load",
    "contact_area_fraction",
    "loaded_area_fraction",
    "max_pressure",
    "approach",
    "moment_x",
    "moment_y",
    "kn",
    "kt",
    "mean_height",
    "rq",
    "sk",
    "ku",
    "normal_iterations",
    "error_normal",
    "fft_pairs",
];
const CYCLE_SUMMARY: [&str; 6] = [
    "dissipated_energy",
    "error_dissipated_energy",
    "error_dissipated_energy_absolute",
    "error_cycle",
    "tangential_iterations",
    "error_tangential",
];
const WEAR_SUMMARY: [&str; 18] = [
    "cycles",
    "n_cycles",
    "wear_volume",
    "largest_depth",
    "depth_99",
    "error_largest_depth",
    "error_depth_99",
    "wear_rate",
    "dissipated_energy_total",
    "error_cycles",
    "error_wear",
    "error_wear_volume",
    "error_wear_field",
    "error_propagation",
    "error_loaded_area",
    "error_max_pressure",
    "error_kn",
    "error_kt",
];

#[test]
fn a_static_contact() {
    let bench = Bench::new();
    let (head, _) = SMALL.split_once("[motion]").expect("a motion");
    bench.write("static.toml", head);
    let root = run(&bench, "static.toml", &[]);
    assert_eq!(latest(&root), 0);
    let expected = ["contact_field", "static_contact", "indentation", "summary"];
    assert_eq!(tables(&root, 0), set(&expected));
    assert_eq!(
        columns(&root, TableName::ContactField),
        set(&["i", "j", "gap", "pressure"])
    );
    assert_eq!(columns(&root, TableName::Summary), set(&STATIC_SUMMARY));
    // A second start finds a finished run.
    let (_, seen) = Start::new(bench.scene("static.toml", &[]), &root).done();
    assert_eq!(seen.stages.take(), []);
}

#[test]
fn a_single_pass_without_wear() {
    let bench = Bench::new();
    let (head, tail) = SMALL.split_once("[wear]").expect("wear");
    let (_, output) = tail.split_once("[output]").expect("an output");
    bench.write("pass.toml", format!("{head}[output]{output}"));
    let root = run(&bench, "pass.toml", &[]);
    assert_eq!(latest(&root), 0);
    assert!(!tables(&root, 0).iter().any(|name| name.starts_with("wear")));
    let expected = [&STATIC_SUMMARY[..], &CYCLE_SUMMARY].concat();
    assert_eq!(columns(&root, TableName::Summary), set(&expected));
}

#[test]
fn a_worn_joint_without_y() {
    let bench = Bench::new();
    let root = run(&bench, "small.toml", &[SHORT, "contact.transverse=absent"]);
    let expected = [
        "i",
        "j",
        "gap",
        "pressure",
        "shear_x",
        "slip_path",
        "dissipation",
    ];
    assert_eq!(columns(&root, TableName::ContactField), set(&expected));
    let expected = ["time", "displacement_x", "normal_load", "force_x"];
    assert_eq!(columns(&root, TableName::Cycle), set(&expected));
    let expected = [&STATIC_SUMMARY[..], &CYCLE_SUMMARY, &WEAR_SUMMARY].concat();
    assert_eq!(columns(&root, TableName::Summary), set(&expected));
    assert_same_columns(&root);
    // The scene writes curves at every second iteration and at the last one.
    let last = latest(&root);
    for k in 0..=last {
        let due = k % 2 == 0 || k == last;
        assert_eq!(
            tables(&root, k).contains("hysteresis"),
            due,
            "iteration {k}"
        );
        assert_eq!(
            tables(&root, k).contains("indentation"),
            due,
            "iteration {k}"
        );
    }
}

#[test]
fn an_orbit() {
    let bench = Bench::new();
    let orbit = [
        SHORT,
        "motion.amplitude=[\"1 um\", \"0.7 um\"]",
        "motion.phase=[\"0 deg\", \"90 deg\"]",
        "fidelity.steps_per_cycle=40",
    ];
    let root = run(&bench, "small.toml", &orbit);
    let cycle = table(&root, latest(&root), TableName::Cycle);
    let (x, y) = (
        cycle.f64("displacement_x").expect("x"),
        cycle.f64("displacement_y").expect("y"),
    );
    for (x, y) in x.iter().zip(y) {
        let circle = (x / 1e-6).powi(2) + (y / 0.7e-6).powi(2);
        assert!((circle - 1.0).abs() < 1e-12, "{circle} is not on the orbit");
    }
    let force = cycle.f64("force_y").expect("a force");
    assert!(force.iter().any(|f| f.abs() > 1.0));
    // The error bars include the error of the samples.
    let at_end = |column| summary(&root, latest(&root), column);
    let of_cycle = at_end("error_cycle");
    assert!((1e-3..0.1).contains(&of_cycle), "{of_cycle:e}");
    assert!(at_end("error_dissipated_energy") > of_cycle);
    assert!(at_end("error_wear_volume") > 0.5 * of_cycle);
    assert_same_columns(&root);
    // The work of the forces over the steady cycle equals the friction energy, within the error of the step length.
    let fx = cycle.f64("force_x").expect("a force");
    let work: f64 = (1..x.len())
        .map(|k| {
            0.5 * (fx[k] + fx[k - 1]) * (x[k] - x[k - 1])
                + 0.5 * (force[k] + force[k - 1]) * (y[k] - y[k - 1])
        })
        .sum();
    let energy = summary(&root, latest(&root), "dissipated_energy");
    assert!(
        (work / energy - 1.0).abs() < 0.2,
        "{work:e} against {energy:e}"
    );
}

#[test]
fn a_load_that_varies() {
    let bench = Bench::new();
    let varying = [
        SHORT,
        "motion.normal_load_amplitude=\"50 N\"",
        // Half of the steps is not a multiple of a quarter cycle. The samples are therefore not evenly spaced.
        "fidelity.steps_per_cycle=14",
    ];
    let root = run(&bench, "small.toml", &varying);
    let given = bench.scene("small.toml", &varying);
    let given = given.contact.expect("a contact").normal_load();
    assert_eq!(summary(&root, 0, "normal_load"), given);
    let cycle = table(&root, latest(&root), TableName::Cycle);
    let load = cycle.f64("normal_load").expect("a load");
    let (least, most) = load
        .iter()
        .fold((f64::INFINITY, 0.0f64), |(a, b), n| (a.min(*n), b.max(*n)));
    assert!(
        (least - 150.0).abs() < 1e-9 && (most - 250.0).abs() < 1e-9,
        "{least} to {most}"
    );
}

#[test]
fn a_history_from_csv_and_from_another_run() {
    let bench = Bench::new();
    let mut csv = String::from("# by hand\ntime, displacement_x, displacement_y, normal_load\n");
    for k in 0..=12 {
        let t = f64::from(k) / 12.0;
        let turn = std::f64::consts::TAU * t;
        csv += &format!(
            "{t}, {}, {}, {}\n",
            1e-6 * turn.cos(),
            4e-7 * turn.sin(),
            200.0 + 20.0 * turn.cos()
        );
    }
    bench.write("history.csv", csv);
    let (head, tail) = SMALL
        .split_once("amplitude = \"1 um\"")
        .expect("an amplitude");
    bench.write(
        "history.toml",
        format!("{head}history = \"history.csv\"{tail}"),
    );
    let root = run(&bench, "history.toml", &[SHORT]);
    let first = table(&root, 1, TableName::Cycle);
    // The loads of the history press the joint. The key contact.normal_load has no effect.
    let is_own = |load: f64| assert!((load - 200.0).abs() < 1e-9, "{load}");
    let recipe = bench.scene("history.toml", &["contact.normal_load=1 kN"]);
    let recipe = Plan::of(&recipe).expect("a plan").inputs.recipe;
    is_own(recipe.contact().expect("a contact").conditions.normal_load);
    is_own(summary(&root, 0, "normal_load"));
    let capped = [
        SHORT,
        "contact.normal_load=1e6 N",
        "contact.pressure_cap=600 MPa",
    ];
    assert!(Plan::of(&bench.scene("history.toml", &capped)).is_ok());
    let bolt = [
        SHORT,
        "contact.normal_load=1 kN",
        "contact.bolt_stiffness=1 N/um",
    ];
    let bolted = bench.path("bolted");
    Start::new(bench.scene("history.toml", &bolt), &bolted).done();
    is_own(summary(&bolted, 0, "normal_load"));

    // The cycle of a run is a valid history with the same steady state.
    fs::copy(
        root.join("iterations/wear_iteration=1/cycle.parquet"),
        bench.path("cycle.parquet"),
    )
    .expect("copied");
    let again = bench.path("again");
    let sets = [SHORT, "motion.history=\"cycle.parquet\""];
    let text = fs::read_to_string(bench.path("history.toml")).expect("a scene");
    bench.write("again.toml", text.replace("history.csv", "cycle.parquet"));
    Start::new(bench.scene("again.toml", &sets[..1]), &again).done();
    verified(&again);
    let second = table(&again, 1, TableName::Cycle);
    for column in ["time", "displacement_x", "displacement_y", "normal_load"] {
        let (a, b) = (
            first.f64(column).expect("a column"),
            second.f64(column).expect("a column"),
        );
        assert_eq!(a, b, "{column}");
    }
    for k in 0..=latest(&root) {
        assert_eq!(
            summary(&root, k, "wear_volume"),
            summary(&again, k, "wear_volume")
        );
    }
    // The content of the history decides, not its path.
    let did = bench.fretwear(&["run", "again.toml", "--run", "again", "--set", SHORT]);
    assert_eq!(did.code(), 0, "{}", did.stderr());
    let did = bench.fretwear(&["run", "again.toml", "--run", "run", "--set", SHORT]);
    assert_eq!(did.code(), 4);
    assert!(
        did.stderr().contains("`motion.content` was"),
        "{}",
        did.stderr()
    );
}

/// Promised accuracy of the dissipated energy with `balanced`.
const PROMISED: f64 = 0.01;

/// A history is linear between its rows. Additional rows on these lines change only the time steps.
#[test]
fn rows_on_the_lines_of_a_history_change_nothing_beyond_the_error_bars() {
    const CORNERS: [(f64, [f64; 2]); 4] = [
        (0.0, [2e-6, 0.0]),
        (0.25, [-1e-6, 1.5e-6]),
        (0.6, [0.0, -1.5e-6]),
        (1.0, [2e-6, 0.0]),
    ];
    let bench = Bench::new();
    let energy = |pieces: u32| {
        let mut csv = String::from("time,displacement_x,displacement_y\n");
        for pair in CORNERS.windows(2) {
            for k in 0..pieces {
                let part = f64::from(k) / f64::from(pieces);
                let at = |a: f64, b: f64| a + part * (b - a);
                let [(t, u), (next, v)] = [pair[0], pair[1]];
                let (x, y) = (at(u[0], v[0]), at(u[1], v[1]));
                csv += &format!("{},{x},{y}\n", at(t, next));
            }
        }
        let name = format!("{pieces}.csv");
        bench.write(&name, csv);
        let (head, tail) = SMALL
            .split_once("amplitude = \"1 um\"")
            .expect("an amplitude");
        let scene = format!("{pieces}.toml");
        bench.write(&scene, format!("{head}history = \"{name}\"{tail}"));
        let root = bench.path(&format!("of_{pieces}"));
        Start::new(bench.scene(&scene, &["wear.cycles=1000"]), &root).done();
        let of = |column| summary(&root, 0, column);
        (of("dissipated_energy"), of("error_cycle"))
    };
    let (exact, own) = energy(40);
    for pieces in [1, 3] {
        let (found, bar) = energy(pieces);
        let off = (found / exact - 1.0).abs();
        assert!(
            off < bar + own,
            "{pieces} a side: off by {off:.2e}, bar {bar:.2e}"
        );
        assert!(off < PROMISED, "{pieces} a side: off by {off:.2e}");
    }
}

#[test]
fn a_measured_surface() {
    let bench = Bench::new();
    let mut text = String::new();
    for i in 0..26 {
        let row: Vec<String> = (0..22)
            .map(|j| format!("{:.6}", 0.4 * f64::from(7 * i + 3 * j).sin()))
            .collect();
        text += &(row.join(",") + "\n");
    }
    bench.write("map.csv", text);
    bench.write("measured.toml", measured("map.csv"));
    let root = run(&bench, "measured.toml", &[SHORT]);
    let surface = reader(&root)
        .read_once(TableName::Surface)
        .expect("readable")
        .expect("there");
    let height = surface.f64("height").expect("a height");
    assert!(
        (height[23] - 0.4e-6 * 10f64.sin()).abs() < 1e-12,
        "{:e}",
        height[23]
    );
    assert!(latest(&root) >= 1);
}

/// The program reads the file once, for its hash and for its heights. A file that changes at the start of a run is not confused.
#[test]
fn a_measured_surface_is_read_once() {
    let bench = Bench::new();
    let map = |height: f64| -> String {
        let row = |i: u32| {
            let heights: Vec<String> = (0..22)
                .map(|j| format!("{}", height * f64::from(7 * i + 3 * j).sin()))
                .collect();
            heights.join(",") + "\n"
        };
        (0..26).map(row).collect()
    };
    bench.write("map.csv", map(0.4));
    bench.write("measured.toml", measured("map.csv"));
    let scene = bench.scene("measured.toml", &[SHORT]);
    let inputs = Plan::of(&scene).expect("a map").inputs;
    let content = inputs.identity.scene["surface"]["content"].clone();
    bench.write("map.csv", map(0.7));
    let other = Plan::of(&scene).expect("a map").inputs;
    assert_ne!(other.identity.scene["surface"]["content"], content);
    std::fs::remove_file(bench.path("map.csv")).expect("removed");
    for (name, inputs, height) in [("a", inputs, 0.4e-6), ("b", other, 0.7e-6)] {
        let root = bench.path(name);
        let options = RunOptions {
            inputs: &inputs,
            root: root.clone(),
            source: None,
            until: Some(Stage::Surface),
            threads: 1,
            cache: None,
            file_system: Arc::new(FaultyFileSystem::sound()),
            stop: &|_| false,
        };
        fretwear::stages::run(&options, &Seen::default()).expect("a surface");
        let surface = reader(&root)
            .read_once(TableName::Surface)
            .expect("readable")
            .expect("there");
        let found = surface.f64("height").expect("a height")[23];
        assert!((found - height * 10f64.sin()).abs() < 1e-12, "{found:e}");
    }
}

#[test]
fn a_measured_surface_that_is_none() {
    let bench = Bench::new();
    bench.write("measured.toml", measured("map.csv"));
    for (map, said) in [
        ("1,2\n3,x\n", "map.csv: line 2, value 2: found \"x\""),
        (
            "nan,nan\nnan,nan\n",
            "map.csv: none of the 2 x 2 points has a height",
        ),
    ] {
        bench.write("map.csv", map);
        for command in ["plan", "run"] {
            let did = bench.fretwear(&[command, "measured.toml"]);
            assert_eq!(did.code(), 2, "{}", did.stderr());
            let stderr = did.stderr();
            assert!(
                stderr.contains(said) && stderr.contains("surface.path"),
                "{stderr}"
            );
        }
    }
    // The program created no run.
    assert!(!bench.path("runs").exists());
}

/// Small scene with a surface from a file.
fn measured(path: &str) -> String {
    let (head, tail) = SMALL.split_once("kind = \"gaussian\"").expect("a kind");
    let (_, tail) = tail.split_once("[contact]").expect("a contact");
    format!(
        "{head}kind = \"file\"\npath = \"{path}\"\nunit = \"um\"\ndetrend = \"none\"\n[contact]{tail}"
    )
}

#[test]
fn a_periodic_boundary_and_a_cap() {
    let bench = Bench::new();
    let sets = [
        SHORT,
        "contact.boundary=periodic",
        "contact.pressure_cap=\"300 MPa\"",
    ];
    let root = run(&bench, "small.toml", &sets);
    for k in 0..=latest(&root) {
        let field = table(&root, k, TableName::ContactField);
        let pressure = field.f64("pressure").expect("a pressure");
        assert!(
            pressure.iter().all(|p| *p <= 300e6 * (1.0 + 1e-12)),
            "iteration {k}"
        );
    }
    let unworn = table(&root, 0, TableName::ContactField);
    let pressure = unworn.f64("pressure").expect("a pressure");
    assert!(
        pressure.iter().any(|p| (*p / 300e6 - 1.0).abs() < 1e-9),
        "no cell yields"
    );
}

#[test]
fn a_hole_is_in_no_table() {
    let bench = Bench::new();
    let root = run(
        &bench,
        "small.toml",
        &[SHORT, "joint.hole.diameter=\"1 mm\""],
    );
    let surface = reader(&root)
        .read_once(TableName::Surface)
        .expect("readable")
        .expect("there");
    let kept = surface
        .bool("kept")
        .expect("a flag")
        .iter()
        .filter(|k| **k)
        .count();
    assert!(kept < 26 * 22);
    let field = table(&root, latest(&root), TableName::WearField);
    assert_eq!(field.rows(), kept);
}

/// The stored cycle of a straight history contains only the reversals. Rows between them are omitted.
#[test]
fn a_history_that_is_straight_is_written_with_its_reversals() {
    let bench = Bench::new();
    let rows = "time, displacement_x\n0, 1e-6\n0.25, 0\n0.5, -1e-6\n0.75, 0\n";
    bench.write("straight.csv", rows);
    let (head, tail) = SMALL
        .split_once("amplitude = \"1 um\"")
        .expect("an amplitude");
    let scene = format!("{head}history = \"straight.csv\"{tail}");
    bench.write("straight.toml", scene);
    let root = run(&bench, "straight.toml", &[SHORT]);
    let cycle = table(&root, 0, TableName::Cycle);
    assert_eq!(cycle.f64("time").expect("a column"), [0.0, 0.5, 1.0]);
    let place = cycle.f64("displacement_x").expect("a column");
    assert_eq!(place, [1e-6, -1e-6, 1e-6]);
}

/// With `output.stiffness=false`, kn, kt and their error bars are missing in all iterations. All other columns are unchanged.
#[test]
fn a_run_without_stiffness_has_all_but_that() {
    let [with, without] = ["true", "false"].map(|choice| {
        let bench = Bench::new();
        let asked = format!("output.stiffness={choice}");
        let root = run(&bench, "small.toml", &[SHORT, &asked]);
        assert_same_columns(&root);
        (bench, root)
    });
    let lost = |name| -> BTreeSet<String> {
        let kept = columns(&without.1, name);
        let all = columns(&with.1, name);
        assert!(kept.is_subset(&all));
        all.difference(&kept).cloned().collect()
    };
    assert_eq!(lost(TableName::StaticContact), set(&["kn", "kt"]));
    let bars = ["kn", "kt", "error_kn", "error_kt"];
    assert_eq!(lost(TableName::Summary), set(&bars));
    let figure = |root: &Path, column| summary(root, latest(root), column);
    let of_both = |column| [&with.1, &without.1].map(|root| figure(root, column));
    let [worn, same] = of_both("wear_volume");
    assert_eq!(worn.to_bits(), same.to_bits());
    let [pairs, fewer] = of_both("fft_pairs");
    assert!(fewer < pairs, "{fewer} of {pairs}");
}
