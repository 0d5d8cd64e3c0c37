//! Restarts of a run: stage by stage, and of a finished, extended, changed, damaged or pruned run.

use std::fs;

use fretwear::stages::{Ending, RunCost, Stage};
use fretwear::store::StageCost;
use fretwear::tables::TableName;

use super::Start;
use crate::support::{
    Bench, assert_same, content, content_from, flip, latest, reader, summary, verified,
};

/// The draft of a run of this scene stores the shear at the start of the cycle.
const STEPPED: [&str; 3] = [
    "fidelity.cycle=stepped",
    "fidelity.steps_per_cycle=8",
    "wear.cycles=150_000",
];

#[test]
fn a_run_made_stage_by_stage_is_the_same() {
    let bench = Bench::new();
    for sets in [&STEPPED[..], &["wear.cycles=150_000"]] {
        let scene = bench.scene("small.toml", sets);
        let (whole, parts) = (bench.path("whole"), bench.path("parts"));
        Start::new(scene.clone(), &whole).done();
        let mut computed = Vec::new();
        let order = [
            Stage::Surface,
            Stage::Unworn,
            Stage::Wear,
            Stage::StaticContact,
            Stage::FrettingCycle,
            Stage::CoarseTrajectory,
            Stage::Summary,
        ];
        for stage in order.into_iter().cycle() {
            let (outcome, seen) = Start::new(scene.clone(), &parts).until(stage).done();
            computed.extend(seen.stages.take());
            if outcome.ending == Ending::Done {
                break;
            }
            assert_eq!(outcome.ending, Ending::Until(stage));
        }
        assert_same(&content(&parts), &content(&whole), "stage by stage");
        // The run computes and counts each stage once.
        let costs = [&whole, &parts].map(|root| {
            let spent = RunCost::of(&reader(root)).expect("readable");
            let staged = fs::read_dir(root.join("staging")).expect("a folder");
            assert_eq!(staged.count(), 0, "{}", root.display());
            assert!(spent.seconds.keys().eq(spent.fft_pairs.keys()));
            // The store keeps the processor time of a stage from an earlier start.
            let cost = reader(root).history().expect("readable").cost();
            let told = |cost: &StageCost| cost.cpu_seconds.is_some();
            assert!(!cfg!(unix) || cost.values().all(told), "{cost:?}");
            spent.fft_pairs
        });
        assert!(costs[0].contains_key("surface") && costs[0].contains_key("unworn"));
        assert_eq!(costs[1], costs[0]);
        let mut once = computed.clone();
        once.sort();
        once.dedup();
        assert_eq!(
            once.len(),
            computed.len(),
            "a stage was computed twice: {computed:?}"
        );
        fs::remove_dir_all(whole).expect("removed");
        fs::remove_dir_all(parts).expect("removed");
    }
}

#[test]
fn until_ends_with_what_it_names() {
    let bench = Bench::new();
    let until = |stage| bench.done(&["run", "small.toml", "--run", "a", "--until", stage]);
    let root = bench.path("a");
    let did = until("surface");
    assert!(
        did.stdout().contains("ended after surface, as requested"),
        "{}",
        did.stdout()
    );
    assert!(root.join("once/surface.parquet").is_file());
    assert_eq!(reader(&root).latest(), None);
    until("static_contact");
    assert_eq!(reader(&root).latest(), None);
    assert!(
        root.join("staging/wear_iteration=0/static_contact.parquet")
            .is_file()
    );
    until("fretting_cycle");
    assert_eq!(reader(&root).latest(), None);
    until("summary");
    assert_eq!(latest(&root), 0);
    until("wear");
    assert_eq!(latest(&root), 0);
    assert!(
        root.join("staging/wear_iteration=1/wear_field.parquet")
            .is_file()
    );
    until("summary");
    assert_eq!(latest(&root), 1);
}

#[test]
fn a_finished_run_computes_nothing_and_says_its_summary() {
    let bench = Bench::new();
    let first = bench.done(&["run", "small.toml", "--run", "a"]);
    let before = content(&bench.path("a"));
    let second = bench.done(&["run", "small.toml", "--run", "a"]);
    assert_eq!(first.stdout(), second.stdout());
    let last = latest(&bench.path("a"));
    assert!(
        second
            .stderr()
            .starts_with(&format!("continues a after iteration {last}\n"))
    );
    let (_, seen) = Start::new(bench.scene("small.toml", &[]), &bench.path("a")).done();
    assert_eq!(seen.stages.take(), []);
    assert_same(&content(&bench.path("a")), &before, "a finished run");
}

#[test]
fn a_changed_scene_is_refused_with_the_keys_that_differ() {
    let bench = Bench::new();
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=50_000",
    ]);
    let before = content(&bench.path("a"));
    let did = bench.fretwear(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "contact.friction_coefficient=0.5",
        "--set",
        "wear.depth_step=\"1 um\"",
    ]);
    assert_eq!(did.code(), 4);
    let said = did.stderr();
    assert!(
        said.contains("`contact.friction_coefficient` was 0.6, is 0.5"),
        "{said}"
    );
    assert!(
        said.contains("`wear.depth_step` was absent, is 1e-6"),
        "{said}"
    );
    assert!(
        !said.contains("wear.cycles"),
        "the message names a free key: {said}"
    );
    assert_same(&content(&bench.path("a")), &before, "a refused run");
}

#[test]
fn free_keys_may_change_and_a_finished_run_goes_on() {
    let bench = Bench::new();
    let root = bench.path("a");
    let begin = |sets: &[&str]| {
        let mut arguments = vec!["run", "small.toml", "--run", "a"];
        arguments.extend(sets.iter().flat_map(|set| ["--set", set]));
        bench.done(&arguments)
    };
    begin(&["wear.cycles=100_000"]);
    assert_eq!(summary(&root, latest(&root), "cycles"), 1e5);
    let short = content(&root);
    let did = begin(&["wear.cycles=250_000"]);
    assert!(
        did.stderr()
            .contains("note: changed since the last start: `wear.cycles` was 100000, is 250000"),
        "{}",
        did.stderr()
    );
    let last = latest(&root);
    assert_eq!(summary(&root, last, "cycles"), 2.5e5);
    let long = content(&root);
    for (name, bytes) in &short.files {
        assert_eq!(
            long.files.get(name),
            Some(bytes),
            "{} changed",
            name.display()
        );
    }
    // The scene in the folder of the run is the present scene.
    let did = bench.done(&["run", "--run", "a", "--json"]);
    assert_eq!(did.json()["cycles"], 250_000);

    // A finished run can be pruned further.
    assert!(last >= 4);
    begin(&["wear.cycles=250_000", "output.keep={ every = 3, last = 1 }"]);
    let kept: Vec<u64> = reader(&root).iterations().collect();
    let expected: Vec<u64> = (0..=last).filter(|k| k % 3 == 0 || *k == last).collect();
    assert_eq!(kept, expected);
    verified(&root);
    // The run ends if the wear volume is already reached.
    begin(&["wear.cycles=900_000", "wear.volume=\"1 um^3\""]);
    assert_eq!(latest(&root), last);
}

/// The damaged tables are inputs of the next iteration or of a summary.
#[test]
fn a_flipped_bit_is_named_and_computed_again() {
    let bench = Bench::new();
    let root = bench.path("a");
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=150_000",
    ]);
    let expected = content(&root);
    let last = latest(&root);
    assert!(last >= 3);
    for (k, file) in [
        (1, "contact_field.parquet"),
        (last, "summary.parquet"),
        (2, "commit.json"),
        (0, "wear_step.parquet"),
    ] {
        let name = format!("iterations/wear_iteration={k}/{file}");
        flip(&root.join(&name));
        let verify = bench.fretwear(&["verify", "a"]);
        assert_eq!(verify.code(), 4);
        assert!(
            verify.stdout().contains(&format!("a/{name}")),
            "{}",
            verify.stdout()
        );
        assert_eq!(bench.fretwear(&["status", "a"]).code(), 4);
        let did = bench.done(&["run", "--run", "a"]);
        let said = did.stderr();
        assert!(
            said.contains(&format!("iteration {k} is damaged (a/{name}")),
            "{said}"
        );
        let goes_on = match k {
            0 => "which has no committed iteration yet".to_owned(),
            k => format!("continues a after iteration {}\n", k - 1),
        };
        assert!(said.contains(&goes_on), "{said}");
        verified(&root);
        assert_same(&content(&root), &expected, &name);
    }
}

#[test]
fn a_damaged_surface_is_computed_again() {
    let bench = Bench::new();
    let root = bench.path("a");
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=50_000",
    ]);
    let path = root.join("once/surface.parquet");
    let before = fs::read(&path).expect("a file");
    flip(&path);
    assert_eq!(bench.fretwear(&["verify", "a"]).code(), 4);
    bench.done(&["run", "--run", "a", "--set", "wear.cycles=60_000"]);
    assert_eq!(fs::read(&path).expect("a file"), before);
    verified(&root);
    // The restart also repairs a finished run, which has no next iteration.
    flip(&path);
    bench.done(&["run", "--run", "a", "--set", "wear.cycles=60_000"]);
    assert_eq!(fs::read(&path).expect("a file"), before);
    let staged = fs::read_dir(root.join("staging")).expect("a folder");
    assert_eq!(staged.count(), 0);
}

/// A lost timing table does not stop the run.
#[test]
fn a_damaged_timing_stops_nothing() {
    let bench = Bench::new();
    let root = bench.path("a");
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=50_000",
    ]);
    flip(&root.join("iterations/wear_iteration=0/timing.parquet"));
    let did = bench.done(&["run", "--run", "a", "--set", "wear.cycles=60_000"]);
    assert!(
        did.stderr()
            .contains("repaired damage that affects no result"),
        "{}",
        did.stderr()
    );
    fs::remove_file(root.join("iterations/wear_iteration=1/timing.parquet")).expect("removed");
    bench.done(&["run", "--run", "a"]);
    bench.done(&["run", "--from", "a@1", "--set", "wear.cycles=60_000"]);
}

#[test]
fn a_lost_record_is_not_taken_for_a_new_run() {
    let bench = Bench::new();
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=50_000",
    ]);
    for record in ["a/run.json", "a/run.copy.json"] {
        fs::remove_file(bench.path(record)).expect("removed");
    }
    let did = bench.fretwear(&["run", "small.toml", "--run", "a"]);
    assert_eq!(did.code(), 4);
    assert!(
        did.stderr().contains("a/run.json: missing"),
        "{}",
        did.stderr()
    );
    assert!(
        bench
            .path("a/iterations/wear_iteration=0/commit.json")
            .is_file()
    );
}

#[test]
fn what_is_there_of_a_draft_is_used_only_for_the_same_inputs() {
    let bench = Bench::new();
    let root = bench.path("a");
    let at = |cycles: &str| bench.scene("small.toml", &[&format!("wear.cycles={cycles}")]);
    Start::new(at("100_000"), &root)
        .until(Stage::Summary)
        .done();
    Start::new(at("100_000"), &root)
        .until(Stage::StaticContact)
        .done();
    assert!(
        root.join("staging/wear_iteration=1/static_contact.parquet")
            .is_file()
    );
    // Another last cycle changes the first step. The draft does not contain this step.
    Start::new(at("7_000"), &root).done();
    let direct = bench.path("b");
    Start::new(at("7_000"), &direct).done();
    assert_same(
        &content_from(&root, 0),
        &content_from(&direct, 0),
        "a draft of another end",
    );
    assert_eq!(summary(&root, latest(&root), "cycles"), 7e3);
    let field = reader(&root)
        .read(1, TableName::WearField)
        .expect("a field");
    assert!(
        field
            .f64("wear_depth")
            .expect("a column")
            .iter()
            .any(|w| *w > 0.0)
    );
}
