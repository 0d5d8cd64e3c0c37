//! The error bars of a run against the truth, which is the run with the tolerances of `reference`; and what a scheme that has no
//! error to set its step by makes wrong.

use std::path::PathBuf;

use super::Start;
use crate::support::{Bench, SMALL, latest, summary};

/// Figures and their bars.
const FIGURES: [(&str, &str); 6] = [
    ("wear_volume", "error_wear_volume"),
    ("dissipated_energy_total", "error_wear_volume"),
    ("dissipated_energy", "error_dissipated_energy"),
    ("loaded_area_fraction", "error_loaded_area"),
    ("kn", "error_kn"),
    ("kt", "error_kt"),
];

/// Partial slip and gross slip, rough, smooth and capped.
const JOINTS: [&[&str]; 5] = [
    &[],
    &["motion.amplitude=\"5 um\""],
    &["surface.rq=\"0.3 um\""],
    &["surface.rq=\"3 um\"", "contact.pressure_cap=\"600 MPa\""],
    &[
        "contact.transverse=\"absent\"",
        "motion.amplitude=\"0.5 um\"",
    ],
];

/// What the truth itself may be off by, and a few cells of some hundred that cross a threshold.
const OWN: f64 = 2e-3;

fn worn(bench: &Bench, name: &str, joint: &[&str], sets: &[&str]) -> PathBuf {
    let root = bench.path(name);
    let all: Vec<&str> = [
        &["joint.grid=[50, 38]", "wear.cycles=3_000_000"],
        joint,
        sets,
    ]
    .concat();
    Start::new(bench.scene("small.toml", &all), &root).done();
    root
}

fn last(root: &std::path::Path, column: &str) -> f64 {
    summary(root, latest(root), column)
}

#[test]
fn error_bars_hold_the_truth() {
    let bench = Bench::new();
    for (k, joint) in JOINTS.iter().enumerate() {
        let tight = ["fidelity.preset=\"reference\"", "wear.tolerance=3e-4"];
        let truth = worn(&bench, &format!("truth-{k}"), joint, &tight);
        for (preset, tolerance) in [("balanced", 0.01), ("fast", 0.05)] {
            let sets = [
                format!("fidelity.preset=\"{preset}\""),
                format!("wear.tolerance={tolerance}"),
            ];
            let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
            let root = worn(&bench, &format!("{preset}-{k}"), joint, &sets);
            for (figure, bar) in FIGURES {
                let error = (last(&root, figure) / last(&truth, figure) - 1.0).abs();
                let bar = last(&root, bar);
                println!("{joint:?} {preset} {figure}: {error:.1e} of {bar:.1e}");
                assert!(
                    error <= bar + OWN,
                    "{joint:?}, {preset}: {figure} is off by {error:e}, its bar {bar:e}"
                );
            }
            // A bar that holds anything says nothing.
            let volume = last(&root, "error_wear_volume");
            assert!(volume < 5.0 * tolerance, "{joint:?}, {preset}: {volume}");
        }
    }
}

/// Beyond its limit the explicit scheme lets cells of little pressure overshoot, lift off and come back: its contact area is
/// wrong while its volume is nearly right. The bar of its volume says that something is.
#[test]
fn the_explicit_scheme_makes_a_false_area_and_the_implicit_one_the_right_one() {
    let bench = Bench::new();
    let joint = ["motion.amplitude=\"5 um\""];
    let run = |name: &str, sets: &[&str]| worn(&bench, name, &joint, sets);
    let truth = run(
        "truth",
        &["fidelity.preset=\"reference\"", "wear.tolerance=3e-4"],
    );
    let depth = "wear.depth_step=\"0.5 um\"";
    let explicit = run("explicit", &["wear.scheme=\"explicit\"", depth]);
    let semi = run("semi", &["wear.scheme=\"semi_implicit\"", depth]);
    let implicit = run("implicit", &["wear.tolerance=0.01"]);
    let off = |root: &std::path::Path, column: &str| {
        (last(root, column) / last(&truth, column) - 1.0).abs()
    };
    const AREA: &str = "contact_area_fraction";
    for root in [&explicit, &semi, &implicit] {
        println!(
            "{} steps: area off by {:.3}, volume by {:.4}, bar {:.3}",
            latest(root),
            off(root, AREA),
            off(root, "wear_volume"),
            last(root, "error_wear_volume")
        );
    }
    assert!(off(&explicit, AREA) > 0.1, "{}", off(&explicit, AREA));
    assert!(off(&explicit, "wear_volume") < 0.05);
    assert!(last(&explicit, "error_wear_volume") > 0.1);
    assert!(off(&semi, AREA) < 0.02, "{}", off(&semi, AREA));
    assert!(off(&implicit, AREA) < 0.01, "{}", off(&implicit, AREA));
    assert!(off(&implicit, "wear_volume") < 0.01);
}

/// The knobs that a tolerance chooses leave an error bar within it, and the truth within that.
#[test]
fn a_tolerance_is_kept() {
    let bench = Bench::new();
    bench.write("own.toml", SMALL.replace("tolerance = 1e-3\n", ""));
    let run = |name: &str, sets: &[&str]| {
        let root = bench.path(name);
        let all = [&["wear.cycles=3_000_000"], sets].concat();
        Start::new(bench.scene("own.toml", &all), &root).done();
        root
    };
    for (k, joint) in JOINTS.iter().enumerate() {
        let tight = [*joint, &["fidelity.tolerance=1e-3"]].concat();
        let truth = run(&format!("truth-{k}"), &tight);
        for tolerance in [0.1, 0.01] {
            let set = format!("fidelity.tolerance={tolerance}");
            let root = run(&format!("run-{k}-{tolerance}"), &[*joint, &[&set]].concat());
            let bar = last(&root, "error_wear_volume");
            assert!(bar <= tolerance, "{joint:?}: {bar:e} of {tolerance:e}");
            let error = (last(&root, "wear_volume") / last(&truth, "wear_volume") - 1.0).abs();
            assert!(
                error <= tolerance,
                "{joint:?}: off by {error:e}, {tolerance:e} asked"
            );
        }
    }
}
