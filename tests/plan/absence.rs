//! Tests that the program does not build unnecessary parts of a scene, and spends no memory, time or transforms on them. The tests of the
//! stages check that the columns and tables of these parts are absent.

use std::collections::BTreeSet;

use serde_json::Value;

use crate::support::{Bench, SMALL};

fn keys(value: &Value) -> BTreeSet<&str> {
    value
        .as_object()
        .expect("an object")
        .keys()
        .map(String::as_str)
        .collect()
}

#[test]
fn without_wear_no_wear_is_computed() {
    let bench = Bench::new();
    let (head, _) = SMALL.split_once("[wear]").expect("wear");
    bench.write("pass.toml", head);
    let plan = bench.done(&["plan", "pass.toml", "--json"]).json();
    assert_eq!(plan["cost"]["iterations"]["most"], 0.0);
    let run = bench
        .done(&["run", "pass.toml", "--json", "--run", "run"])
        .json();
    for stages in [
        &plan["cost"]["fft_pairs_by_stage"],
        &run["timing"],
        &run["timing_fft_pairs"],
    ] {
        assert!(!keys(stages).contains("wear"), "{stages}");
        assert!(keys(stages).contains("fretting_cycle"), "{stages}");
    }
}

#[test]
fn without_motion_no_cycle_is_computed() {
    let bench = Bench::new();
    let (head, _) = SMALL.split_once("[motion]").expect("a motion");
    bench.write("static.toml", head);
    let plan = bench.done(&["plan", "static.toml", "--json"]).json();
    let run = bench
        .done(&["run", "static.toml", "--json", "--run", "run"])
        .json();
    for stages in [&plan["cost"]["fft_pairs_by_stage"], &run["timing"]] {
        let mut computed = keys(stages);
        computed.remove("surface");
        computed.remove("summary");
        assert!(!computed.is_empty());
        let contact = |stage: &&str| stage.starts_with("static_contact");
        assert!(computed.iter().all(contact), "{stages}");
    }
}

/// Without y, the plan and the run have one kernel, one field of shear and one direction of each solve less.
#[test]
fn without_y_there_is_less_of_everything() {
    let bench = Bench::new();
    let cost = |command: &[&str], sets: &[&str]| {
        let mut arguments = command.to_vec();
        arguments.extend(["small.toml", "--json"]);
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        bench.done(&arguments).json()["cost"].clone()
    };
    for (command, other) in [
        (["run", "--run", "both"], ["run", "--run", "alone"]),
        (
            ["plan", "--set", "wear.cycles=600_000"],
            ["plan", "--set", "wear.cycles=600_000"],
        ),
    ] {
        let both = cost(&command, &[]);
        let alone = cost(&other, &["contact.transverse=absent"]);
        let pairs = |cost: &Value, stage: &str| {
            let by_stage = &cost["fft_pairs_by_stage"];
            by_stage[stage].as_f64().expect("pairs")
        };
        for stage in ["fretting_cycle", "static_contact.stiffness", "wear"] {
            let part = pairs(&alone, stage) / pairs(&both, stage);
            assert!(part < 0.85, "{command:?} {stage}: {part}");
        }
    }
}

/// Memory of the second axis, from the plan and from the operating system.
#[test]
#[cfg(target_os = "linux")]
fn without_y_its_memory_is_not_allocated() {
    let grid = [
        "--set",
        "joint.grid=[384, 320]",
        "--set",
        "output.curves_every=0",
    ];
    let grid = [&grid[..], &["--set", "wear.cycles=100"]].concat();
    let both = super::memory::planned_and_measured("small.toml", &grid);
    let absent = [&grid[..], &["--set", "contact.transverse=absent"]].concat();
    let alone = super::memory::planned_and_measured("small.toml", &absent);
    let [planned, measured] = [both.0 - alone.0, both.1 - alone.1];
    // The second axis needs two kernels of half the plane of complex numbers, and fields.
    let cells = 384.0 * 320.0 * 8.0;
    assert!(measured > 5.0 * cells, "only {measured:e} B less");
    assert!(
        planned < 1.5 * measured && measured < 1.5 * planned,
        "{planned:e} B planned, {measured:e} B measured"
    );
}
