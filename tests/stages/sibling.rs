//! Tests of sibling runs, which start from an iteration of another run.

use std::path::Path;

use fretwear::tables::TableName;

use super::Start;
use crate::support::{
    Bench, assert_same, content, content_from, latest, reader, summary, table, verified,
};

/// Runs some iterations in the folder `a`. Returns the last iteration.
fn source(bench: &Bench, sets: &[&str]) -> u64 {
    let root = bench.path("a");
    Start::new(bench.scene("small.toml", sets), &root).done();
    assert!(latest(&root) >= 3, "{} iterations", latest(&root));
    latest(&root)
}

const SHORT: &str = "wear.cycles=200_000";

#[test]
fn from_any_iteration_in_the_same_bits() {
    let bench = Bench::new();
    for sets in [
        &[SHORT][..],
        &[
            SHORT,
            "fidelity.cycle=stepped",
            "fidelity.steps_per_cycle=8",
        ],
    ] {
        let last = source(&bench, sets);
        let a = bench.path("a");
        let expected = content(&a);
        for k in 0..=last {
            let root = bench.path(&format!("from-{k}"));
            Start::new(bench.scene("small.toml", sets), &root)
                .from(&a, k)
                .done();
            assert_same(&content(&root), &expected, &format!("from {k}"));
            let origin = reader(&root).record().origin.clone().expect("an origin");
            assert_eq!((origin.run.as_str(), origin.wear_iteration), ("a", k));
            verified(&root);
            std::fs::remove_dir_all(&root).expect("removed");
        }
        assert_same(&content(&a), &expected, "the source");
        std::fs::remove_dir_all(&a).expect("removed");
    }
}

#[test]
fn with_a_changed_tolerance_it_is_a_run_of_its_own() {
    let bench = Bench::new();
    let last = source(&bench, &[SHORT]);
    let before = content(&bench.path("a"));
    let did = bench.done(&[
        "run",
        "--from",
        "a@1",
        "--set",
        "wear.tolerance=0.02",
        "--json",
    ]);
    let root = bench.path("a-from-1");
    assert_eq!(did.json()["cycles"], 200_000);
    verified(&root);
    assert!(latest(&root) < last, "the steps must be longer");
    let inherited = content(&root);
    for (name, bytes) in before
        .files
        .iter()
        .filter(|(name, _)| !name.starts_with("once"))
    {
        let k: u64 = name.to_string_lossy()["iterations/wear_iteration=".len()..]
            .split('/')
            .next()
            .and_then(|k| k.parse().ok())
            .expect("a number");
        assert_eq!(
            inherited.files.get(name) == Some(bytes),
            k <= 1,
            "{}",
            name.display()
        );
    }
    assert_same(&content(&bench.path("a")), &before, "the source");
    // The same command again continues the sibling, also without the source.
    std::fs::remove_dir_all(bench.path("a")).expect("removed");
    bench.done(&["run", "--run", "a-from-1"]);
    assert_same(&content(&root), &inherited, "the sibling");
}

/// Relative difference of volumes of one iteration, computed in two ways with the same numerics.
const SAME: f64 = 1e-12;

/// The first step of the sibling wears at the rates of the sibling's parameters, not at the rates of the source.
#[test]
fn with_changed_physics_it_starts_from_its_own_contact() {
    let bench = Bench::new();
    let explicit = [
        "wear.cycles=60_000",
        "wear.scheme=explicit",
        "wear.depth_step=\"0.01 um\"",
    ];
    source(&bench, &explicit);
    let a = bench.path("a");
    let changed = |set: &'static str| [explicit[0], explicit[1], explicit[2], set];
    for set in [
        "contact.friction_coefficient=0.3",
        "motion.amplitude=\"2 um\"",
        "contact.normal_load=\"300 N\"",
        "contact.transverse=absent",
    ] {
        let scene = bench.scene("small.toml", &changed(set));
        // From the unworn state, a new run with these parameters gives the expected result.
        let own = bench.path("own");
        Start::new(scene.clone(), &own).done();
        let sibling = bench.path("sibling");
        Start::new(scene, &sibling).from(&a, 0).done();
        verified(&sibling);
        for column in ["n_cycles", "wear_volume"] {
            let (found, expected) = (summary(&sibling, 1, column), summary(&own, 1, column));
            assert!(
                (found / expected - 1.0).abs() < 1e-3,
                "{set}: {column} {found:e} instead of {expected:e}"
            );
        }
        let columns = |root: &Path| -> Vec<String> {
            let table = table(root, 1, TableName::ContactField);
            table
                .columns()
                .map(|(schema, _)| schema.name.clone())
                .collect()
        };
        assert_eq!(columns(&sibling), columns(&own), "{set}");
        for root in [own, sibling] {
            std::fs::remove_dir_all(root).expect("removed");
        }
    }
}

#[test]
fn a_changed_wear_coefficient_changes_no_energy_that_is_spent() {
    let bench = Bench::new();
    source(&bench, &[SHORT]);
    let root = bench.path("b");
    let twice = [SHORT, "wear.coefficient=\"4e3 um^3/J\""];
    Start::new(bench.scene("small.toml", &twice), &root)
        .from(&bench.path("a"), 2)
        .done();
    let spent = |k| summary(&root, k, "dissipated_energy_total");
    let worn = |k| summary(&root, k, "wear_volume");
    for k in 3..=latest(&root) {
        let ratio = (worn(k) - worn(k - 1)) / (spent(k) - spent(k - 1));
        assert!((ratio / 4e-15 - 1.0).abs() < 1e3 * SAME, "{ratio:e} at {k}");
    }
}

#[test]
fn another_joint_or_surface_is_refused() {
    let bench = Bench::new();
    source(&bench, &[SHORT]);
    for (set, said) in [
        (
            "joint.grid=[24, 22]",
            "`joint.grid` was [26,22], is [24,22]",
        ),
        ("surface.seed=4", "`surface.seed` was 3, is 4"),
        (
            "joint.hole.diameter=\"1 mm\"",
            "`joint.hole.diameter` was absent, is 0.001",
        ),
    ] {
        let did = bench.fretwear(&["run", "--from", "a@1", "--run", "b", "--set", set]);
        assert_eq!(did.code(), 4, "{}", did.stderr());
        assert!(did.stderr().contains(said), "{}", did.stderr());
        assert!(!bench.path("b").exists(), "a refused run left a folder");
    }
}

#[test]
fn a_pruned_iteration_is_refused_with_those_that_remain() {
    let bench = Bench::new();
    let last = source(
        &bench,
        &["wear.cycles=400_000", "output.keep={ every = 3, last = 2 }"],
    );
    assert!(last >= 6, "{last}");
    let kept: Vec<u64> = reader(&bench.path("a")).iterations().collect();
    let expected: Vec<u64> = (0..=last).filter(|k| k % 3 == 0 || k + 2 > last).collect();
    assert_eq!(kept, expected);
    let report = verified(&bench.path("a"));
    assert_eq!(report.pruned.len() as u64, last + 1 - kept.len() as u64);

    let did = bench.fretwear(&["run", "--from", "a@1", "--run", "b"]);
    assert_eq!(did.code(), 2);
    assert!(
        did.stderr().contains("a has no iteration 1; it has 0, 3, "),
        "{}",
        did.stderr()
    );
    assert!(!bench.path("b").exists(), "a refused run left a folder");
    // A sibling from a remaining iteration equals a sibling from a run without pruning.
    bench.done(&["run", "--from", "a@3", "--run", "b"]);
    let all = bench.path("all");
    let everything = bench.scene("small.toml", &["wear.cycles=400_000"]);
    Start::new(everything.clone(), &all).done();
    let c = bench.path("c");
    Start::new(everything, &c).from(&bench.path("a"), 3).done();
    assert_same(
        &content_from(&c, 3),
        &content_from(&all, 3),
        "past the pruned",
    );
    verified(&c);
}

#[test]
fn a_source_that_is_not_there_or_the_run_itself() {
    let bench = Bench::new();
    source(&bench, &[SHORT]);
    let a = bench.path("a");
    let scene = || bench.scene("small.toml", &[SHORT]);
    let message = Start::new(scene(), &a).from(&a, 1).refused();
    assert!(message.contains("began unworn, not from a@1"), "{message}");
    let message = Start::new(scene(), &bench.path("b")).from(&a, 99).refused();
    assert!(
        message.contains("has no iteration 99; it has 0-"),
        "{message}"
    );
    let did = bench.fretwear(&["run", "--from", "none@1"]);
    assert_eq!(did.code(), 2);
    assert!(
        did.stderr().contains("there is no run at none"),
        "{}",
        did.stderr()
    );
}

/// A sibling inherits the uncertainty of the inherited wear. Its changed keys do not reduce it.
#[test]
fn it_inherits_what_its_parent_is_uncertain_of() {
    let bench = Bench::new();
    let sets = [
        "wear.cycles=600_000",
        "wear.tolerance=0.01",
        "motion.amplitude=[\"1 um\", \"0.6 um\"]",
        "motion.phase=[\"0 deg\", \"70 deg\"]",
        "fidelity.steps_per_cycle=16",
    ];
    let a = bench.path("a");
    Start::new(bench.scene("small.toml", &sets), &a).done();
    // The coarse trajectory has a step to each even iteration. Both runs therefore continue from the same coarse trajectory.
    let (at, last) = (2, latest(&a));
    assert!(last > at, "{last} iterations");
    let sets = [&sets[..], &["output.curves_every=3"]].concat();
    let b = bench.path("b");
    Start::new(bench.scene("small.toml", &sets), &b)
        .from(&a, at)
        .done();
    let field = |root: &Path| summary(root, last, "error_wear_field");
    let steps = |root: &Path| table(root, at + 1, TableName::CoarseStep);
    let differs = |root: &Path| {
        let step = steps(root);
        step.f64("difference_wear_field").expect("a column")[0]
    };
    assert!(differs(&a) > 0.0, "the trajectories must differ");
    assert_eq!(differs(&b), differs(&a), "after one more step");
    assert_eq!(latest(&b), last);
    let part = field(&b) / field(&a);
    assert!((part - 1.0).abs() < 0.1, "{part} of the parent's bar");
}
