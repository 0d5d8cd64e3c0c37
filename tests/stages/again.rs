//! The program computes each stage of a committed iteration again from the tables of the run. The tables have the same bits.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use fretwear::scene::{Plan, Scene, load};
use fretwear::stages::{Stage, recompute, stages_of};

use super::{Seen, Start};
use crate::support::{Bench, OSCILLATOR, SLIDER, latest, reader};

/// Computes each stage of each iteration of a run again and compares the tables. Returns the stages of the run.
fn again(scene: &Scene, root: &Path) -> BTreeSet<Stage> {
    let inputs = Plan::of(scene).expect("a plan").inputs;
    let reader = reader(root);
    let mut stages = BTreeSet::new();
    for k in reader.iterations() {
        for stage in stages_of(&inputs.recipe).filter(|stage| k == 0 || stage.when.is_in(k)) {
            if k == 0 && stage.when == fretwear::stages::When::Worn {
                continue;
            }
            let at = format!("{} of iteration {k} of {}", stage.stage, root.display());
            let found = recompute(&reader, &inputs, stage.stage, k, 1, &Seen::default())
                .unwrap_or_else(|error| panic!("{at}: {error}"));
            for (table, same) in &found.same {
                assert!(same, "{at}: {table} has other bits");
            }
            stages.insert(stage.stage);
        }
    }
    stages
}

fn computed_again(bench: &Bench, file: &str, sets: &[&str]) -> BTreeSet<Stage> {
    let scene = bench.scene(file, sets);
    let root = bench.path("run");
    Start::new(scene.clone(), &root).done();
    let stages = again(&scene, &root);
    fs::remove_dir_all(root).expect("removed");
    stages
}

#[test]
fn of_prescribed_motion() {
    let bench = Bench::new();
    let kinds: [&[&str]; 7] = [
        &[],
        &["output.cycle_fields={ samples = [1], every = 2 }"],
        &["fidelity.cycle=stepped", "fidelity.steps_per_cycle=8"],
        &["wear.scheme=explicit", "wear.depth_step=\"10 nm\""],
        &["wear.scheme=semi_implicit", "wear.depth_step=\"20 nm\""],
        &["contact.bolt_stiffness=\"1 N/um\""],
        &["contact.rotation=free", "contact.pressure_cap=\"2 GPa\""],
    ];
    for sets in kinds {
        let sets = [&["wear.cycles=60_000"], sets].concat();
        let stages = computed_again(&bench, "small.toml", &sets);
        assert!(stages.contains(&Stage::Wear) && stages.contains(&Stage::Summary));
    }
}

fn of_vibrating(kinds: &[&[&str]]) {
    let bench = Bench::new();
    for sets in kinds {
        let sets = [&["wear.cycles=150_000"], *sets].concat();
        let stages = computed_again(&bench, "resonator.toml", &sets);
        // A vibrating joint has all stages except the coarse trajectory, which needs a prescribed motion, and the twin, which is a separate
        // run.
        assert_eq!(stages.len(), Stage::ALL.len() - 2);
    }
}

#[test]
fn of_a_vibrating_joint() {
    of_vibrating(&[&["output.response_at=[60_000]"]]);
}

#[test]
#[ignore = "long: three minutes"]
fn of_vibrating_joints_that_take_long() {
    of_vibrating(&[
        &[
            "contact.stiffness=roughness",
            "contact.bolt_stiffness=\"100 N/um\"",
        ],
        &["contact.stiffness=sliders", "update.stiffness_change=0.05"],
        &["contact.stiffness=tangent", "update.stiffness_change=0.05"],
    ]);
}

#[test]
fn of_what_does_not_wear() {
    let bench = Bench::new();
    bench.write("oscillator.toml", OSCILLATOR);
    bench.write("slider.toml", format!("{OSCILLATOR}{SLIDER}"));
    for (file, sets) in [
        ("oscillator.toml", &[][..]),
        ("slider.toml", &[]),
        (
            "slider.toml",
            &["dynamics.frequency=[\"700 Hz\", \"750 Hz\"]"],
        ),
    ] {
        let stages = computed_again(&bench, file, sets);
        let expected = [
            Stage::DynamicResponse,
            Stage::ForcedResponse,
            Stage::Summary,
        ];
        assert_eq!(stages, BTreeSet::from(expected));
    }
}

/// Arguments that reduce the shipped scenes to the size of a test: cells, elements, modes and cycles.
const SMALLER: [(&str, &[&str]); 5] = [
    ("hertz", &["joint.grid=[40, 36]", "wear.cycles=20_000"]),
    (
        "prescribed",
        &[
            "joint.grid=[40, 36]",
            "surface.correlation_length=[\"3 mm\", \"3 mm\"]",
            "wear.cycles=100_000",
        ],
    ),
    (
        "lap_of_bars",
        &[
            "joint.grid=[50, 36]",
            "surface.correlation_length=[\"3 mm\", \"3 mm\"]",
            "dynamics.harmonics=[0, 1, 2, 3]",
            "dynamics.points=3",
            "wear.cycles=100_000",
        ],
    ),
    (
        "lap_joint",
        &[
            "joint.grid=[45, 36]",
            "joint.elements=[9, 9]",
            "joint.hole.diameter=\"23 mm\"",
            "surface.correlation_length=[\"5 mm\", \"5 mm\"]",
            "structure.half_depth_cells=2",
            "structure.block_cells=3",
            "structure.stub_cells=1",
            "structure.gap_cells=1",
            "structure.leaf_cells=1",
            "structure.window_cells=3",
            "structure.wall_cells=2",
            "structure.inner_cells=2",
            "structure.rim_cells=1",
            "structure.head_cells=1",
            "dynamics.modes=10",
            "dynamics.harmonics=[0, 1]",
            "dynamics.points=3",
            "dynamics.force.amplitude=\"300 N\"",
            "dynamics.frequency=[\"900 Hz\", \"1150 Hz\"]",
            "fidelity.steps_per_cycle=16",
            "wear.cycles=60_000",
        ],
    ),
    ("", &[]),
];

#[test]
#[ignore = "long: a run of each, and all its stages again"]
fn of_every_scene_that_is_shipped() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let bench = Bench::new();
    let mut count = 0;
    for entry in fs::read_dir(folder).expect("the pipelines") {
        let path = entry.expect("an entry").path();
        let name = path
            .file_name()
            .expect("a name")
            .to_string_lossy()
            .into_owned();
        if !name.ends_with(".toml") || name == "resonator_springs.toml" {
            // The structure of this scene takes longer than all other scenes together.
            continue;
        }
        let smaller = SMALLER.iter().find(|(prefix, _)| name.starts_with(prefix));
        let sets: Vec<String> = smaller
            .map_or(&[][..], |(_, sets)| sets)
            .iter()
            .map(|set| (*set).to_owned())
            .collect();
        let scene = load(&path, &sets).unwrap_or_else(|error| panic!("{name}: {error}"));
        let root = bench.path(&name);
        Start::new(scene.clone(), &root).done();
        assert!(!again(&scene, &root).is_empty());
        count += 1;
    }
    assert!(count >= 15, "{count} scenes");
}

/// A sibling under another load begins with inherited tables. The program recomputes only the sibling's own iterations.
#[test]
fn of_a_sibling_under_another_load() {
    let bench = Bench::new();
    let a = bench.path("a");
    Start::new(bench.scene("small.toml", &["wear.cycles=60_000"]), &a).done();
    let scene = bench.scene(
        "small.toml",
        &["wear.cycles=120_000", "contact.normal_load=\"250 N\""],
    );
    let root = bench.path("b");
    Start::new(scene.clone(), &root).from(&a, 1).done();
    let inputs = Plan::of(&scene).expect("a plan").inputs;
    for stage in [Stage::Wear, Stage::StaticContact, Stage::FrettingCycle] {
        let of = |k| recompute(&reader(&root), &inputs, stage, k, 1, &Seen::default());
        let found = of(2).unwrap_or_else(|error| panic!("{error}"));
        assert!(found.same.values().all(|same| *same), "{stage}");
        // Iteration 1 belongs to the scene of the source run.
        let refused = of(1).err().expect("it is of another scene").to_string();
        assert!(refused.contains("was computed in the run a"), "{refused}");
    }
}

#[test]
fn of_a_pruned_or_damaged_iteration() {
    let bench = Bench::new();
    let sets = [
        "--set",
        "wear.tolerance=1e-4",
        "--set",
        "output.keep={ every = 2, last = 1 }",
    ];
    bench.done(&[&["run", "small.toml", "--run", "a"][..], &sets].concat());
    let did = bench.fretwear(&["stage", "wear", "--run", "a@2"]);
    let said = "iteration 2 is computed from iteration 1, which is pruned or damaged";
    assert!(did.stderr().contains(said), "{}", did.stderr());
    assert_eq!(did.code(), 2);
    fs::write(
        bench.path("a/iterations/wear_iteration=2/wear_field.parquet"),
        "x",
    )
    .expect("written");
    let did = bench.fretwear(&["stage", "wear", "--run", "a@2"]);
    assert!(
        did.stderr().contains("wear_field.parquet"),
        "{}",
        did.stderr()
    );
    assert_eq!(did.code(), 4);
}

#[test]
fn by_the_command() {
    let bench = Bench::new();
    bench.done(&[
        "run",
        "small.toml",
        "--run",
        "a",
        "--set",
        "wear.cycles=60_000",
    ]);
    let last = latest(&bench.path("a"));
    let at = format!("a@{last}");
    let did = bench.done(&["stage", "fretting_cycle", "--run", &at, "-o", "tables"]);
    let same = "the same bits as in the run";
    assert_eq!(did.stdout().matches(same).count(), 4, "{}", did.stdout());
    for table in ["contact_field", "cycle", "fretting_cycle"] {
        assert!(bench.path(&format!("tables/{table}.parquet")).is_file());
    }
    let did = bench.done(&["stage", "wear", "--run", &at, "--json"]);
    assert_eq!(did.json()["same"]["wear_field"], true);
    // The command never overwrites existing files and never writes into a run.
    for (folder, said) in [
        ("tables", "File exists"),
        ("a", "lies within the run"),
        ("a/iterations/wear_iteration=1", "lies within the run"),
        ("a/staging/../new", "lies within the run"),
    ] {
        let did = bench.fretwear(&["stage", "fretting_cycle", "--run", &at, "-o", folder]);
        assert_eq!(did.code(), 1, "{folder}");
        assert!(did.stderr().contains(said), "{}", did.stderr());
    }
    bench.done(&["verify", "a"]);
    for (arguments, code, said) in [
        (["stage", "wear", "--run", "a@99"], 2, "has no iteration 99"),
        (
            ["stage", "wear", "--run", "a@0"],
            2,
            "iteration 0 has no stage wear; it has surface, unworn,",
        ),
        (
            ["stage", "ledger", "--run", "a@1"],
            2,
            "has no stage ledger",
        ),
        (["stage", "wear", "--run", "b@1"], 2, "there is no run"),
    ] {
        let did = bench.fretwear(&arguments);
        assert!(did.stderr().contains(said), "{}", did.stderr());
        assert_eq!(did.code(), code, "{arguments:?}");
    }
}

/// A restart of a finished run computes a missing table of the folder `once` again, and no other table.
#[test]
fn a_lost_table_of_a_finished_run_is_computed_again() {
    let bench = Bench::new();
    let run = ["run", "small.toml", "--run", "a", "-q"];
    bench.done(&run);
    let once = |end: &str| bench.path(&format!("a/once/surface.{end}"));
    let [table, key] = ["parquet", "json"].map(|end| fs::read(once(end)).expect("a file"));
    for end in ["parquet", "json"] {
        fs::remove_file(once(end)).expect("removed");
    }
    let stage = ["stage", "static_contact", "--run", "a@0"];
    let failed = bench.fretwear(&stage);
    assert!(
        failed.stderr().contains("restart the run to compute it"),
        "{}",
        failed.stderr()
    );
    let commits = || fs::read(bench.path("a/history.parquet")).expect("a history");
    let before = commits();
    bench.done(&run);
    assert_eq!(fs::read(once("parquet")).expect("a table"), table);
    assert_eq!(fs::read(once("json")).expect("its key"), key);
    assert_eq!(commits(), before);
    bench.done(&stage);
}
