//! Comparison of error bars with the true error. The reference is a run with the tolerances of `reference`.
//! Another test shows the errors of a scheme without control of the step length.

use std::path::PathBuf;

use fretwear::stages::{Ending, Stage};
use fretwear::tables::TableName;

use super::Start;
use crate::support::{Bench, RESONATOR, SMALL, assert_same, content, latest, summary, table};

/// Figures and the columns of their error bars.
const FIGURES: [(&str, &str); 6] = [
    ("wear_volume", "error_wear_volume"),
    ("dissipated_energy_total", "error_wear_volume"),
    ("dissipated_energy", "error_dissipated_energy"),
    ("loaded_area_fraction", "error_loaded_area"),
    ("kn", "error_kn"),
    ("kt", "error_kt"),
];

/// Joints in partial slip and in gross slip: rough, smooth, and with a pressure cap.
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

/// Orbit and varying load, both stepped. The grid is small and the cycles are few, since the reference run is slow.
const STEPPED: [&[&str]; 2] = [
    &[
        "joint.grid=[26, 22]",
        "wear.cycles=150_000",
        "motion.amplitude=[\"1 um\", \"0.6 um\"]",
        "motion.phase=[\"0 deg\", \"70 deg\"]",
    ],
    &[
        "joint.grid=[26, 22]",
        "wear.cycles=150_000",
        "motion.amplitude=\"2 um\"",
        "motion.normal_load_amplitude=\"100 N\"",
    ],
];

/// Error of the reference run, including a few cells of some hundred that cross a threshold.
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

fn hold_the_truth(joints: &[&[&str]]) {
    let bench = Bench::new();
    for (k, joint) in joints.iter().enumerate() {
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
            // The bar must not be arbitrarily large.
            let volume = last(&root, "error_wear_volume");
            assert!(volume < 5.0 * tolerance, "{joint:?}, {preset}: {volume}");
        }
    }
}

#[test]
fn error_bars_hold_the_truth() {
    hold_the_truth(&[STEPPED[1]]);
}

#[test]
#[ignore = "long: a minute"]
fn error_bars_of_many_joints_hold_the_truth() {
    hold_the_truth(&[&JOINTS[..], &STEPPED].concat());
}

/// With too long steps, cells of low pressure overshoot in the explicit scheme, lift off and return. The contact area is then wrong,
/// while the volume is nearly right. The large error bar of the volume reveals the problem.
#[test]
#[ignore = "long: 20 seconds"]
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

/// With `fidelity.tolerance`, the error bar lies within the tolerance, and so does the true error.
fn keep_a_tolerance(joints: &[&[&str]]) {
    let bench = Bench::new();
    bench.write("own.toml", SMALL.replace("tolerance = 1e-3\n", ""));
    let run = |name: &str, sets: &[&str]| {
        let root = bench.path(name);
        let all = [&["wear.cycles=3_000_000"], sets].concat();
        Start::new(bench.scene("own.toml", &all), &root).done();
        root
    };
    for (k, joint) in joints.iter().enumerate() {
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
                "{joint:?}: off by {error:e}, tolerance {tolerance:e}"
            );
        }
    }
}

#[test]
fn a_tolerance_is_kept() {
    keep_a_tolerance(&JOINTS[..1]);
}

#[test]
#[ignore = "long: half a minute"]
fn a_tolerance_is_kept_by_many_joints() {
    keep_a_tolerance(&JOINTS);
}

/// The parts of the error bar of a vibrating joint accumulate over the steps. Each step wears under the vibration of the state before.
#[test]
fn what_the_vibration_makes_wrong_adds_up() {
    let bench = Bench::new();
    let root = bench.path("run");
    Start::new(bench.scene("resonator.toml", &[]), &root).done();
    let [mut harmonics, mut closure] = [0.0; 2];
    for k in 1..=latest(&root) {
        let before = table(&root, k - 1, TableName::DynamicResponse);
        let of = |column: &str| before.f64(column).expect("a number")[0];
        let figure = |column: &str| summary(&root, k, column);
        let volume = figure("wear_volume");
        let worn = volume - summary(&root, k - 1, "wear_volume");
        harmonics += worn * of("error_friction_energy");
        let update = table(&root, k - 1, TableName::ModelUpdate);
        let last = update.f64("wear_volume").expect("a volume")[0];
        let of_cycle = |k: u64, column: &str| {
            let cycle = table(&root, k, TableName::FrettingCycle);
            cycle.f64(column).expect("a number")[0]
        };
        let at_update = |k: u64| of_cycle(k, "update_jump").abs() + of_cycle(k, "update_gap").abs();
        let between_scales = |k: u64| {
            let energy = of_cycle(k, "dissipated_energy");
            (of_cycle(k, "elements_energy") / energy - 1.0).abs()
        };
        let pending = |k: u64| at_update(k).max(between_scales(k));
        // The wear since the last update has a relative error: the change at an update or the difference between both scales.
        closure -= pending(k - 1) * (summary(&root, k - 1, "wear_volume") - last);
        let updated = table(&root, k, TableName::Summary);
        let updated = updated.bool("updated").expect("a flag")[0];
        let worn_response = (k == latest(&root) && !updated).then(|| {
            let fine = table(&root, k, TableName::WornResponse);
            let fine = fine.f64("fine_energy").expect("an energy")[0];
            let jump = (fine / of_cycle(k, "dissipated_energy") - 1.0).abs();
            jump + of_cycle(k, "update_gap").abs()
        });
        let rate = match worn_response {
            Some(rate) => rate,
            None if updated => at_update(k),
            None => pending(k),
        };
        closure = closure.max(0.0) + rate * (volume - last);
        for (column, expected) in [("error_harmonics", harmonics), ("error_closure", closure)] {
            let found = figure(column) * volume;
            assert!(
                (found - expected).abs() <= 1e-6 * expected,
                "{column} of {k}: {found:e} m^3 instead of {expected:e} m^3"
            );
        }
        let steps =
            figure("error_wear_volume") - figure("error_harmonics") - figure("error_closure");
        assert!(steps > 0.0 && steps < 0.1, "{steps}");
        // The error bars of figures of the vibration include the errors of the vibration.
        let now = table(&root, k, TableName::DynamicResponse);
        for (bar, own) in [
            ("error_resonance_frequency", "error_resonance_frequency"),
            ("error_peak_amplitude", "error_peak_amplitude"),
            ("error_dissipated_energy", "error_friction_energy"),
        ] {
            assert!(figure(bar) >= now.f64(own).expect("a number")[0], "{bar}");
        }
    }
    assert!(harmonics > 0.0 && closure > 0.0);
}

/// Without `dynamics.harmonics`, the program adds harmonics in each iteration until the truncation error is below the tolerance.
/// A run that restarts at any stage has the same harmonics.
#[test]
#[ignore = "long: a minute"]
fn harmonics_that_suffice() {
    const ASKED: f64 = 2e-3;
    let bench = Bench::new();
    bench.write("grown.toml", RESONATOR.replace("harmonics = [0, 1]\n", ""));
    let set = format!("fidelity.harmonic_tolerance={ASKED}");
    let scene = || bench.scene("grown.toml", &[&set, "wear.cycles=300_000"]);
    let root = bench.path("whole");
    Start::new(scene(), &root).done();
    let mut highest = 3;
    for k in 0..=latest(&root) {
        let row = table(&root, k, TableName::DynamicResponse);
        let now = row.i64("highest_harmonic").expect("an order")[0];
        assert!(now >= highest, "{now} after {highest}");
        highest = now;
        for column in ["error_peak_amplitude", "error_friction_energy"] {
            let error = row.f64(column).expect("an error")[0];
            assert!(error <= ASKED, "{column} of {k}: {error:e}");
        }
        let response = table(&root, k, TableName::Response);
        let orders = response.i32("harmonic").expect("orders");
        assert_eq!(orders.iter().max().map(|o| i64::from(*o)), Some(highest));
    }
    assert!(highest > 3, "no harmonic was added");
    let parts = bench.path("parts");
    let stages = Stage::ALL.into_iter();
    // The coarse trajectory needs a prescribed motion, and the grid twin needs fidelity.grid_check.
    let stages = stages.filter(|stage| ![Stage::CoarseTrajectory, Stage::GridTwin].contains(stage));
    for stage in stages.cycle() {
        let (outcome, _) = Start::new(scene(), &parts).until(stage).done();
        if outcome.ending == Ending::Done {
            break;
        }
    }
    assert_same(&content(&parts), &content(&root), "stage by stage");
}

/// A cycle without wear has the error bars of the unworn state of a run with wear. The bar bounds the difference from an exact solution.
#[test]
fn a_cycle_without_wear_has_a_bar_of_its_energy() {
    let bench = Bench::new();
    let stepped = [
        "motion.amplitude=[\"1 um\", \"0.6 um\"]",
        "motion.phase=[\"0 deg\", \"70 deg\"]",
    ];
    for (k, (text, end, sets)) in [
        (SMALL, "[output]", &[][..]),
        (SMALL, "[output]", &stepped),
        (RESONATOR, "[fidelity]", &[]),
    ]
    .into_iter()
    .enumerate()
    {
        let (head, rest) = text.split_once("[wear]").expect("wear");
        let (_, tail) = rest.split_once(end).expect("a section behind it");
        let name = format!("still-{k}.toml");
        bench.write(&name, format!("{head}{end}{tail}"));
        bench.write("worn.toml", text);
        let run = |name: &str, folder: &str, more: &[&str]| {
            let root = bench.path(&format!("{folder}-{k}"));
            let sets = [sets, more].concat();
            Start::new(bench.scene(name, &sets), &root).done();
            root
        };
        let still = run(&name, "still", &[]);
        let of = |column: &str| last(&still, column);
        let (energy, bar) = (of("dissipated_energy"), of("error_dissipated_energy"));
        assert_eq!(of("error_dissipated_energy_absolute"), bar * energy);
        assert!(bar >= of("error_cycle"), "{bar}");
        let worn = run("worn.toml", "worn", &["wear.cycles=1000"]);
        assert!(summary(&worn, 0, "error_dissipated_energy") >= bar);
        if text == RESONATOR {
            for column in [
                "error_dissipated_energy",
                "error_peak_amplitude",
                "error_resonance_frequency",
            ] {
                assert_eq!(of(column), summary(&worn, 0, column), "{column}");
            }
            continue;
        }
        let exact = run(&name, "exact", &["fidelity.preset=\"reference\""]);
        let off = (energy / last(&exact, "dissipated_energy") - 1.0).abs();
        println!("{k}: off by {off:.1e}, bar {bar:.1e}");
        assert!(off <= bar && bar < 0.05, "off by {off:e}, bar {bar:e}");
    }
}
