//! Tests of `fretwear when`: number of cycles at which a run reaches milestones.

use serde_json::Value;

use crate::support::{Bench, latest, summary};

const BOLT: &str = "contact.bolt_stiffness=100 N/um";

fn milestone(found: &Value, at: usize) -> (f64, f64, f64) {
    let of = |name: &str| found["milestones"][at][name].as_f64();
    let cycles = |name| of(name).unwrap_or_else(|| panic!("{name}: {found}"));
    (cycles("earliest"), cycles("nominal"), cycles("latest"))
}

#[test]
fn a_run_says_when_it_has_lost_load() {
    let bench = Bench::new();
    bench.done(&["run", "small.toml", "--run", "a", "--set", BOLT]);
    let root = bench.path("a");
    let last = latest(&root);
    let load = |k| summary(&root, k, "normal_load");
    let middle = last / 2;
    // The preload of an iteration is a milestone at the cycles of this iteration.
    let wanted = format!("--preload={} N", load(middle));
    let part = format!("--preload={}%", 100.0 * load(middle) / load(0));
    let found = bench
        .done(&["when", "a", &wanted, &part, "--volume=1m^3", "--json"])
        .json();
    let cycles = summary(&root, middle, "cycles");
    for at in [0, 1] {
        let (earliest, nominal, latest) = milestone(&found, at);
        assert!(
            (nominal / cycles - 1.0).abs() < 1e-6,
            "{nominal}, not {cycles}"
        );
        assert!(earliest < nominal && nominal < latest, "{found}");
        assert_eq!(found["milestones"][at]["known"], "reached");
    }
    assert_eq!(found["milestones"][2]["known"], "not within");
    assert_eq!(found["milestones"][2]["earliest"], Value::Null);
    assert_eq!(found["done"], true);
    let said = bench
        .done(&["when", "a", "--preload=50%", "--depth", "0.01um"])
        .stdout();
    assert!(
        said.contains("preload 50%              not within 600 000 cycles: 200.0 N became"),
        "{said}"
    );
    assert!(said.contains("largest depth 0.01um"), "{said}");
    assert!(
        said.contains("embedding under head, nut and thread"),
        "{said}"
    );
}

#[test]
fn of_an_unfinished_run_what_is_known_is_said() {
    let bench = Bench::new();
    let stopped = bench.fretwear(&["run", "small.toml", "--run", "a", "--max-wall", "1 ms"]);
    assert_eq!(stopped.code(), 75);
    let did = bench.fretwear(&["when", "a", "--volume", "1mm^3"]);
    assert_eq!(did.code(), 75);
    let said = did.stdout();
    assert!(
        said.contains(" % done") && said.contains("continue "),
        "{said}"
    );
}

#[test]
fn what_a_run_has_no_history_of_is_an_error() {
    let bench = Bench::new();
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=1000",
    ]);
    let cases: [(&[&str], &str); 4] = [
        (
            &["--preload=90%"],
            "its load is constant: give contact.bolt_stiffness",
        ),
        (&["--resonance=+1Hz"], "its scene has no vibration"),
        (&[], "--preload <LOAD>"),
        (&["--depth=10"], "write 10um"),
    ];
    for (arguments, says) in cases {
        let did = bench.fretwear(&[&["when", "a"], arguments].concat());
        assert_eq!(did.code(), 2, "{}", did.stderr());
        assert!(did.stderr().contains(says), "{}", did.stderr());
    }
}

#[test]
fn a_run_ends_when_a_part_of_its_load_is_lost() {
    let bench = Bench::new();
    bench.done(&["run", "small.toml", "--run", "a", "--set", BOLT]);
    let root = bench.path("a");
    let load = |root: &std::path::Path, k| summary(root, k, "normal_load");
    let last = latest(&root);
    let part = load(&root, last / 2) / load(&root, 0);
    let until = format!("wear.until.preload={part}");
    let said = bench.done(&[
        "run",
        "small.toml",
        "--run",
        "b",
        "--set",
        BOLT,
        "--set",
        &until,
    ]);
    assert!(said.stdout().contains("bolt load"), "{}", said.stdout());
    let other = bench.path("b");
    let end = latest(&other);
    assert!(end < last, "{end} of {last}");
    let bar = |k| summary(&other, k, "error_normal_load");
    let is_lost = |k| load(&other, k) * (1.0 + bar(k)) <= part * load(&other, 0);
    assert!(is_lost(end - 1) && !is_lost(end - 2));
    let found = bench.done(&["status", "b", "--json"]).json();
    assert_eq!(found["state"], "done");
    assert_eq!(found["has_lost_preload"], true);
    let told = bench.done(&["status", "b"]).stdout();
    assert!(told.contains("ended by wear.until.preload"), "{told}");
    // With a lower limit of the preload, the run continues like any other finished run.
    bench.done(&["run", "--run", "b", "--set", "wear.until.preload=0.01"]);
    assert_eq!(latest(&other), last);
    let stays = bench.fretwear(&["plan", "small.toml", "--set", &until, "--no-rehearsal"]);
    assert_eq!(stays.code(), 2);
    assert!(
        stays
            .stderr()
            .contains("`wear.until.preload` ends a run when its bolt load falls"),
        "{}",
        stays.stderr()
    );
}

/// Dimensions of a bolt give the same run as the bolt stiffness from these dimensions without the compliance of the half spaces.
#[test]
fn a_bolt_by_its_dimensions_is_one_of_its_stiffness() {
    let bench = Bench::new();
    let bolt = r#"contact.bolt={ size = "M4", clamp_length = "20 mm", bearing_diameter = "7 mm", hole = "4.3 mm", outer_diameter = "20 mm" }"#;
    let plan = bench
        .done(&["plan", "small.toml", "--set", bolt, "--no-rehearsal"])
        .stdout();
    let line = plan
        .lines()
        .find(|line| line.starts_with("bolt: "))
        .expect("the line on the bolt");
    let after = |name: &str| {
        let rest = line.split_once(name).expect(name).1;
        let number = rest.split([',', ' ', ';']).find(|word| !word.is_empty());
        number.expect("a number").parse::<f64>().expect("a number")
    };
    let (of_bolt, plates, half_spaces) =
        (after("delta_S "), after("delta_P "), after("give way by "));
    // Units of the compliances and of the stiffness: um/kN and N/um.
    let stiffness = after("k_b ");
    assert!(
        (stiffness * (of_bolt + plates - half_spaces) / 1e3 - 1.0).abs() < 1e-3,
        "{line}"
    );
    bench.done(&["run", "small.toml", "--run", "a", "--set", bolt]);
    let given = format!("contact.bolt_stiffness={stiffness} N/um");
    bench.done(&["run", "small.toml", "--run", "b", "--set", &given]);
    let lost = |run: &str| {
        let root = bench.path(run);
        summary(&root, 0, "normal_load") - summary(&root, latest(&root), "normal_load")
    };
    let (a, b) = (lost("a"), lost("b"));
    assert!(a > 1.0 && (a / b - 1.0).abs() < 1e-3, "{a} N, {b} N");
    for (sets, says) in [
        (
            vec![bolt, "contact.bolt_stiffness=5 N/um"],
            "contact.bolt determines the stiffness of the bolt already; give one or the other",
        ),
        (
            vec![bolt, "contact.bolt.size=M4.5"],
            "must be a metric thread, such as M10",
        ),
        (
            vec![bolt, "contact.bolt.hole=3 mm"],
            "`contact.bolt`: hole is 3e-3; it must be at least as wide as the bolt",
        ),
        (
            vec![bolt, "contact.boundary=periodic"],
            "the joint has no edge, so no parts can be clamped",
        ),
        (
            vec![
                bolt,
                "contact.bolt.clamp_length=0.25 mm",
                "contact.bolt.shank_length=0 mm",
                "contact.bolt.modulus=9000 GPa",
            ],
            "give contact.bolt_stiffness instead",
        ),
    ] {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let arguments: Vec<&str> = ["check", "small.toml"].into_iter().chain(sets).collect();
        let did = bench.fretwear(&arguments);
        let said = did.stdout() + &did.stderr();
        assert_eq!(did.code(), 2, "{said}");
        assert!(said.contains(says), "{said}");
    }
}
