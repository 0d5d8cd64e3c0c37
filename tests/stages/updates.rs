//! Updates of the contact elements: time of an update, new elements, and unchanged quantities between updates.

use std::path::{Path, PathBuf};

use fretwear::tables::TableName;

use super::Start;
use super::vibrating::{IN_FORCE, updates};
use crate::support::{
    Bench, RESONATOR, assert_same, content, latest, reader, summary, table, verified,
};

const LOAD: f64 = 30e3;
/// Number of cells of the small lap without its hole.
const ELEMENTS: usize = 81 - 21;
/// Largest relative overshoot of an update criterion. A single cell that comes into contact increases the stiffness of this small joint
/// by 0.1 %.
const LANDING: f64 = 0.15;
/// Rounding of sums over some dozens of elements.
const ROUNDING: f64 = 1e-12;

/// Runs the resonator with another update criterion.
fn run(bench: &Bench, criterion: &str, sets: &[&str]) -> PathBuf {
    let text = RESONATOR.replace(
        "stiffness_change = 0.01\nvolume_growth = \"never\"",
        criterion,
    );
    bench.write("criterion.toml", text);
    let root = bench.path("run");
    Start::new(bench.scene("criterion.toml", sets), &root).done();
    verified(&root);
    assert!(latest(&root) >= 4, "{} iterations", latest(&root));
    root
}

fn columns(root: &Path, k: u64, name: TableName, columns: &[&str]) -> Vec<Vec<f64>> {
    let table = table(root, k, name);
    let column = |name: &&str| table.f64(name).expect("a column").to_vec();
    columns.iter().map(column).collect()
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found - expected).abs() <= tolerance * expected.abs(),
        "{what}: {found:e} instead of {expected:e}"
    );
}

/// Checks the tables for any criterion. The function `due(reference, k)` returns true if iteration k is due since the iteration
/// `reference`.
/// Returns the updates.
fn check(root: &Path, due: impl Fn(u64, u64) -> bool) -> Vec<u64> {
    let (mut reference, mut count) = (0, 0);
    for k in 0..=latest(root) {
        let expected = k == 0 || due(reference, k);
        if expected && k > 0 {
            count += 1;
        }
        if expected {
            reference = k;
        }
        let row = table(root, k, TableName::ModelUpdate);
        assert_eq!(
            row.bool("updated").expect("a flag")[0],
            expected,
            "iteration {k}"
        );
        let flag = table(root, k, TableName::Summary);
        assert_eq!(
            flag.bool("updated").expect("a flag")[0],
            expected,
            "summary of {k}"
        );
        let reason = &row.text("reason").expect("a reason")[0];
        assert_eq!(
            reason.is_empty(),
            !expected || k == 0,
            "reason of {k}: {reason}"
        );
        assert_eq!(
            row.i64("updates").expect("a count")[0],
            count,
            "iteration {k}"
        );
        let at = row.i64("update_iteration").expect("an iteration")[0] as u64;
        assert_eq!(at, reference, "iteration {k}");
        let number = |column| row.f64(column).expect("a number")[0];
        assert_eq!(number("compliance_normal"), 1.0 / summary(root, at, "kn"));
        assert_eq!(
            number("compliance_tangential"),
            1.0 / summary(root, at, "kt")
        );
        assert_eq!(number("wear_volume"), summary(root, at, "wear_volume"));

        let [load, kn, kt] = &columns(
            root,
            k,
            TableName::ContactElement,
            &["normal_load", "kn", "kt"],
        )[..] else {
            unreachable!();
        };
        assert_eq!(load.len(), ELEMENTS);
        assert_close(load.iter().sum(), LOAD, ROUNDING, "sum of the loads");
        assert_close(kn.iter().sum(), summary(root, at, "kn"), ROUNDING, "kn");
        assert_close(kt.iter().sum(), summary(root, at, "kt"), ROUNDING, "kt");
        for name in IN_FORCE {
            let same = table(root, k, name) == table(root, at, name);
            assert!(same, "{name} of {k} differs from {at}");
        }
        if expected && k > 0 {
            let before = table(root, k - 1, TableName::ContactElement);
            assert_ne!(
                before,
                table(root, k, TableName::ContactElement),
                "iteration {k}"
            );
        }
    }
    updates(root)
}

#[test]
fn a_change_of_stiffness() {
    const CHANGE: f64 = 0.01;
    let bench = Bench::new();
    let root = run(
        &bench,
        "stiffness_change = 0.01\nvolume_growth = \"never\"",
        &[],
    );
    let changed = |from, k, column| summary(&root, k, column) / summary(&root, from, column) - 1.0;
    let renewed = check(&root, |from, k| {
        ["kn", "kt"]
            .iter()
            .any(|column| f64::abs(changed(from, k, column)) >= CHANGE)
    });
    assert!(
        renewed.len() >= 2 && (renewed.len() as u64) < latest(&root),
        "{renewed:?} of {}",
        latest(&root)
    );
    let mut from = 0;
    for &k in &renewed[1..] {
        // The step ends at the criterion and not far beyond.
        let reached = ["kn", "kt"].map(|column| f64::abs(changed(from, k, column)));
        let reached = f64::max(reached[0], reached[1]);
        assert!(reached <= CHANGE * (1.0 + LANDING), "{k}: {reached}");
        let row = table(&root, k, TableName::ModelUpdate);
        let more = f64::abs(changed(from, k, "kn")) >= f64::abs(changed(from, k, "kt"));
        let reason = if more { "kn" } else { "kt" };
        assert_eq!(row.text("reason").expect("a reason")[0], reason);
        from = k;
    }
}

#[test]
fn every_second_iteration() {
    let bench = Bench::new();
    let root = run(&bench, "iterations = 2", &["wear.cycles=300_000"]);
    let renewed = check(&root, |from, k| k - from >= 2);
    let expected: Vec<u64> = (0..=latest(&root)).step_by(2).collect();
    assert_eq!(renewed, expected);
    let row = table(&root, 2, TableName::ModelUpdate);
    assert_eq!(row.text("reason").expect("a reason")[0], "iterations");
}

#[test]
fn a_worn_volume() {
    const VOLUME: f64 = 4e-11;
    let bench = Bench::new();
    let root = run(&bench, "wear_volume = \"0.04 mm^3\"", &[]);
    let worn = |k| summary(&root, k, "wear_volume");
    let renewed = check(&root, |from, k| worn(k) - worn(from) >= VOLUME);
    assert!(
        renewed.len() >= 2,
        "{renewed:?}, {:e} m³",
        worn(latest(&root))
    );
    for step in renewed.windows(2) {
        let volume = worn(step[1]) - worn(step[0]);
        assert!(volume <= VOLUME * (1.0 + LANDING), "{step:?}: {volume:e}");
    }
}

/// The times of updates depend on the state of the joint and not on the length of its steps.
#[test]
fn updates_come_when_the_joint_has_changed_and_not_when_a_step_ends() {
    /// Largest relative difference of the cycles at an update, and of the last wear rate. The tolerance of the steps determines both.
    const CYCLES: f64 = 0.03;
    const RATE: f64 = 0.03;
    let bench = Bench::new();
    let due = |name: &str, tolerance: &str| {
        let root = bench.path(name);
        let sets = ["wear.cycles=300_000", tolerance];
        Start::new(bench.scene("resonator.toml", &sets), &root).done();
        let cycles = updates(&root)
            .into_iter()
            .map(|k| summary(&root, k, "cycles"))
            .collect::<Vec<f64>>();
        (
            cycles,
            summary(&root, latest(&root), "wear_rate"),
            latest(&root),
        )
    };
    let (coarse, coarse_rate, few) = due("coarse", "wear.tolerance=0.02");
    let (fine, fine_rate, many) = due("fine", "wear.tolerance=0.002");
    assert!(many > 2 * few, "{few} and {many} steps");
    assert_eq!(coarse.len(), fine.len(), "{coarse:?} and {fine:?}");
    assert!(fine.len() > 2, "{fine:?}");
    for (coarse, fine) in coarse.iter().zip(&fine) {
        assert_close(*coarse, *fine, CYCLES, "cycles at an update");
    }
    assert_close(coarse_rate, fine_rate, RATE, "wear rate in the end");
}

/// Without a criterion, the joint moves like the unworn joint. Its motion and the structure remain the same during the wear.
/// The run computes the structure once.
#[test]
fn never() {
    let bench = Bench::new();
    let text = RESONATOR.replace(
        "[update]\nstiffness_change = 0.01\nvolume_growth = \"never\"\nextrapolate = false\n",
        "",
    );
    bench.write("never.toml", text);
    let root = bench.path("never");
    Start::new(bench.scene("never.toml", &[]), &root).done();
    assert_eq!(check(&root, |_, _| false), [0]);
    let cycle = |k| {
        columns(
            &root,
            k,
            TableName::Cycle,
            &["displacement_x", "normal_load"],
        )
    };
    for k in 1..=latest(&root) {
        // Iteration 0 has the same motion, although no table has been read back yet.
        assert_eq!(cycle(k), cycle(0), "iteration {k}");
    }
    for name in [
        TableName::Structure,
        TableName::StructurePort,
        TableName::StructureMode,
        TableName::StructureResidual,
        TableName::StructureOutline,
        TableName::StructureOutlineMode,
    ] {
        assert!(reader(&root).read_once(name).expect("readable").is_some());
        for k in 0..=latest(&root) {
            let reader = reader(&root);
            let tables = &reader.commit_of(k).expect("committed").tables;
            assert!(!tables.contains_key(name.as_str()), "{name} in {k}");
        }
    }
}

/// Between updates, the motion is constant and the wear rate follows the running-in of one joint. At an update, the wear rate jumps.
#[test]
fn the_wear_rate_jumps_at_updates_only() {
    let bench = Bench::new();
    let stiff = bench.path("stiff");
    let text = RESONATOR.replace(
        "[update]\nstiffness_change = 0.01\nvolume_growth = \"never\"\nextrapolate = false\n",
        "",
    );
    bench.write("never.toml", text);
    let never = bench.path("never");
    let sets = ["wear.cycles=300_000"];
    Start::new(bench.scene("never.toml", &sets), &never).done();
    // With a criterion of 0.01, the update would coincide with the end of a regular step.
    let sets = ["wear.cycles=300_000", "update.stiffness_change=0.009"];
    Start::new(bench.scene("resonator.toml", &sets), &stiff).done();
    let renewed = updates(&stiff);
    let first = *renewed.get(1).expect("an update");
    let rate = |root: &Path, k| summary(root, k, "wear_rate");
    // Before the first update, both runs are equal. Only one of them ends its step there.
    for k in 0..first {
        assert_eq!(rate(&stiff, k), rate(&never, k), "iteration {k}");
    }
    let cycles = |root: &Path, k| summary(root, k, "cycles");
    assert!(cycles(&stiff, first) < cycles(&never, first));
    let volume =
        |root: &Path, k| summary(root, k, "wear_volume") - summary(root, k - 1, "wear_volume");
    let speed = |root: &Path, k| volume(root, k) / (cycles(root, k) - cycles(root, k - 1));
    assert_close(
        speed(&stiff, first),
        speed(&never, first),
        0.01,
        "the step to the update is made at the old rate",
    );
    let jump = rate(&stiff, first) / rate(&never, first);
    assert!((jump - 1.0).abs() > 0.01, "no jump: {jump}");
}

#[test]
#[ignore = "long: half a minute"]
fn roughness_alone_is_stiffer_than_the_whole() {
    let bench = Bench::new();
    let sets = ["contact.stiffness=roughness", "wear.cycles=100_000"];
    let root = bench.path("rough");
    Start::new(bench.scene("resonator.toml", &sets), &root).done();
    verified(&root);
    // The relation is 1/k = 1/k_total - 1/k_smooth, with one value of k_smooth for all updates.
    let mut smooth = Vec::new();
    for k in updates(&root) {
        for column in ["kn", "kt"] {
            let elements = columns(&root, k, TableName::ContactElement, &[column]);
            let own: f64 = elements[0].iter().sum();
            let total = summary(&root, k, column);
            assert!(own > total, "{column} of {k}: {own:e} within {total:e}");
            smooth.push((column, 1.0 / total - 1.0 / own));
        }
        let row = table(&root, k, TableName::ModelUpdate);
        let elements = columns(&root, k, TableName::ContactElement, &["kn"]);
        let compliance = row.f64("compliance_normal").expect("a compliance")[0];
        assert_close(
            1.0 / compliance,
            elements[0].iter().sum(),
            1e-9,
            "compliance of the springs",
        );
    }
    for (column, compliance) in &smooth {
        let (_, first) = smooth.iter().find(|(name, _)| name == column).expect("one");
        assert_close(*compliance, *first, 1e-9, column);
    }
}

#[test]
fn tangents_of_the_elements() {
    let bench = Bench::new();
    let sets = ["contact.stiffness=tangent", "wear.cycles=100_000"];
    let root = bench.path("tangent");
    Start::new(bench.scene("resonator.toml", &sets), &root).done();
    verified(&root);
    for k in updates(&root) {
        let of = columns(
            &root,
            k,
            TableName::ContactElement,
            &["normal_load", "kn", "kt"],
        );
        for (column, values) in [("kn", &of[1]), ("kt", &of[2])] {
            assert_close(values.iter().sum(), summary(&root, k, column), 1e-6, column);
            let (least, most) = values
                .iter()
                .fold((f64::INFINITY, 0.0f64), |(a, b), v| (a.min(*v), b.max(*v)));
            assert!(
                least >= 0.0 && most > 2.0 * least,
                "{column}: {least:e} to {most:e}"
            );
        }
        for (load, kn) in of[0].iter().zip(&of[1]) {
            assert_eq!(*load > 0.0, *kn > 0.0, "load {load:e} and kn {kn:e}");
        }
    }
}

#[test]
fn stiffness_by_load() {
    let bench = Bench::new();
    let sets = [
        "contact.stiffness=total",
        "contact.distribution=by_load",
        "wear.cycles=100_000",
    ];
    let root = bench.path("by-load");
    Start::new(bench.scene("resonator.toml", &sets), &root).done();
    verified(&root);
    for k in updates(&root) {
        let of = columns(
            &root,
            k,
            TableName::ContactElement,
            &["normal_load", "kn", "kt"],
        );
        for (column, values) in [("kn", &of[1]), ("kt", &of[2])] {
            let whole = summary(&root, k, column);
            for (load, stiffness) in of[0].iter().zip(values) {
                let expected = whole * load / LOAD;
                assert!((stiffness - expected).abs() <= 1e-9 * whole, "{column}");
            }
        }
    }
}

/// The bolt load falls as wear brings the bodies closer.
#[test]
fn a_bolt_load_that_falls() {
    const BOLT: f64 = 500e6;
    let bench = Bench::new();
    let scene = bench.scene("resonator.toml", &["contact.bolt_stiffness=\"500 N/um\""]);
    let root = bench.path("bolt");
    Start::new(scene.clone(), &root).done();
    verified(&root);
    let at = |k, column| summary(&root, k, column);
    assert_close(at(0, "normal_load"), LOAD, 1e-6, "unworn");
    let last = latest(&root);
    for k in 1..=last {
        let expected = LOAD - BOLT * (at(k, "approach") - at(0, "approach"));
        // The search of the load ends at 1e-6 of the unworn load. The tolerance of the contact adds the same amount.
        assert_close(at(k, "normal_load"), expected, 2e-6, "bolt");
        assert!(
            at(k, "normal_load") <= at(k - 1, "normal_load") + 2e-6 * LOAD,
            "iteration {k}"
        );
        let fields = columns(&root, k, TableName::ContactField, &["pressure"]);
        let cell = (40e-3 / 45.0) * (36e-3 / 36.0);
        let borne = fields[0].iter().sum::<f64>() * cell;
        assert_close(borne, at(k, "normal_load"), 1e-9, "pressure");
        let cycle = columns(&root, k, TableName::Cycle, &["normal_load"]);
        let mean = cycle[0].iter().sum::<f64>() / cycle[0].len() as f64;
        assert_close(mean, at(k, "normal_load"), 1e-3, "load of the cycle");
    }
    assert!(
        at(last, "normal_load") < LOAD * (1.0 - 1e-3),
        "{}",
        at(last, "normal_load")
    );
    for &k in &updates(&root) {
        let elements = columns(&root, k, TableName::ContactElement, &["normal_load"]);
        assert_close(
            elements[0].iter().sum(),
            at(k, "normal_load"),
            ROUNDING,
            "elements",
        );
    }
    // A sibling from any iteration equals the run.
    let expected = content(&root);
    for k in [0, last / 2, last - 1] {
        let again = bench.path(&format!("from-{k}"));
        Start::new(scene.clone(), &again).from(&root, k).done();
        assert_same(&content(&again), &expected, &format!("from {k}"));
    }
}

/// The bolt load falls also under a prescribed motion with a varying load.
#[test]
fn a_bolt_load_that_falls_under_a_prescribed_motion() {
    let bench = Bench::new();
    let sets = [
        "contact.bolt_stiffness=\"200 N/um\"",
        "motion.normal_load_amplitude=\"13 N\"",
        "fidelity.steps_per_cycle=12",
        "wear.cycles=150_000",
        "output.curves_every=1",
    ];
    let scene = bench.scene("small.toml", &sets);
    let root = bench.path("bolt");
    Start::new(scene.clone(), &root).done();
    let last = latest(&root);
    assert!(last >= 3);
    let load = |k| summary(&root, k, "normal_load");
    assert!(
        load(last) < 0.99 * load(0),
        "{} N of {} N",
        load(last),
        load(0)
    );
    for k in 0..=last {
        let curve = table(&root, k, TableName::Indentation);
        let (loads, approach) = (
            curve.f64("load").expect("a load"),
            curve.f64("displacement").expect("an approach"),
        );
        let at = loads.iter().position(|l| *l == load(k));
        let at = at.unwrap_or_else(|| panic!("{} N is not among {loads:?}", load(k)));
        assert_eq!(approach[at], summary(&root, k, "approach"), "iteration {k}");
    }
    let expected = content(&root);
    for k in 0..last {
        let again = bench.path(&format!("from-{k}"));
        Start::new(scene.clone(), &again).from(&root, k).done();
        assert_same(&content(&again), &expected, &format!("from {k}"));
    }
}

#[test]
fn a_joint_that_comes_loose_says_so() {
    let bench = Bench::new();
    // The steps are very long: the surfaces are worn away before the load is zero.
    let sets = [
        "contact.bolt_stiffness=\"1e6 N/um\"",
        "motion.amplitude=\"5 um\"",
        "wear.scheme=explicit",
        "wear.depth_step=\"5 um\"",
        "wear.cycles=50_000_000",
    ];
    let root = bench.path("loose");
    let message = Start::new(bench.scene("small.toml", &sets), &root).refused();
    assert!(message.contains("come loose"), "{message}");
    verified(&root);
}
