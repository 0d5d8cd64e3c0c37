//! What a rehearsal says of a run, against what the run has cost.
//!
//! The scenes here have a few thousand cells and a handful of asperities. `rehearsed.py` beside this file draws scenes of all kinds of
//! motion, and is run by `.ci/long`.

use std::collections::BTreeSet;
use std::path::Path;
use std::time::Duration;

use fretwear::rehearsal::{self, Options, Rehearsal};
use fretwear::scene::{self, Plan};
use serde_json::{Value, json};

use crate::support::Bench;

/// A factor within which a number is as good as known.
const FACTOR: f64 = 1.5;
/// Room for two coarser grids on the joint of the bench.
const ROOM: &str = "joint.grid=[64, 54]";

fn with_sets<'a>(words: &[&'a str], sets: &[&'a str]) -> Vec<&'a str> {
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    words.iter().copied().chain(sets).collect()
}

/// What a rehearsal says, as `plan --json` prints it. It is bounded by counts: the machine may be busy.
fn rehearsed(bench: &Bench, scene: &str, sets: &[&str]) -> Rehearsal {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let scene = scene::load(&bench.path(scene), &sets).expect("a scene");
    let options = Options {
        most: Duration::from_secs(600),
        ..Options::default()
    };
    rehearsal::rehearse(&Plan::of(&scene).expect("a plan").inputs, &options)
}

fn planned(bench: &Bench, scene: &str, sets: &[&str]) -> Value {
    json!(rehearsed(bench, scene, sets).cost)
}

fn ran(bench: &Bench, scene: &str, sets: &[&str]) -> Value {
    let arguments = with_sets(&["run", scene, "--json", "--run", "run"], sets);
    bench.done(&arguments).json()["cost"].clone()
}

fn pipeline(name: &str) -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let path = folder.join(format!("{name}.toml"));
    path.to_str().expect("text").to_owned()
}

/// The expected number is near the actual one, or the range holds it.
fn hold(case: &str, expected: &Value, actual: &Value) {
    let actual = actual.as_f64().expect("a number");
    let of = |name: &str| expected[name].as_f64().expect("a number");
    let near = actual <= FACTOR * of("expected") && of("expected") <= FACTOR * actual;
    let held = (of("least")..=of("most")).contains(&actual);
    assert!(near || held, "{case}: {expected} expected, {actual} actual");
}

fn hold_all(case: &str, plan: &Value, run: &Value) {
    hold(
        &format!("{case}, pairs"),
        &plan["fft_pairs"],
        &run["fft_pairs"],
    );
    hold(&format!("{case}, disk"), &plan["disk"], &run["disk_bytes"]);
    hold(
        &format!("{case}, iterations"),
        &plan["iterations"],
        &run["wear_iterations"],
    );
}

fn whole(plan: &Value) -> Vec<(u64, bool)> {
    let grids = plan["rehearsed"].as_array().expect("grids");
    grids
        .iter()
        .map(|grid| (grid["cells"][0].as_u64(), grid["whole"].as_bool()))
        .map(|(cells, whole)| (cells.expect("cells"), whole.expect("whole or not")))
        .collect()
}

/// Kinds of scenes and of motion.
#[test]
#[ignore = "long: 15 seconds"]
fn two_coarser_grids_say_what_a_run_costs() {
    let small = "small.toml".to_owned();
    let torsion = [ROOM, "motion={ rotation = \"0.4 mrad\" }"];
    for (scene, sets) in [
        (small.clone(), vec![ROOM]),
        (small.clone(), vec![ROOM, "contact.transverse=absent"]),
        (small.clone(), vec![ROOM, "contact.boundary=periodic"]),
        (small.clone(), vec![ROOM, "contact.pressure_cap=1 GPa"]),
        (small.clone(), vec![ROOM, "motion={ force = \"20 N\" }"]),
        (small.clone(), torsion.to_vec()),
        (
            small.clone(),
            vec![
                ROOM,
                "motion.normal_load_amplitude=40 N",
                "fidelity.preset=fast",
                "wear.cycles=20_000",
            ],
        ),
        (
            small,
            vec![ROOM, "wear.scheme=explicit", "wear.depth_step=50 nm"],
        ),
        (pipeline("hertz_fretting"), vec![]),
        (pipeline("static_contact"), vec!["joint.grid=[200, 200]"]),
    ] {
        let bench = Bench::new();
        let case = format!("{scene} {sets:?}");
        let (plan, run) = (planned(&bench, &scene, &sets), ran(&bench, &scene, &sets));
        hold_all(&case, &plan, &run);
        let grids = whole(&plan);
        assert!(grids.len() >= 2, "{case}: {grids:?}");
        // The stages that cost pairs are those that the plan names.
        let stages = |pairs: &Value| -> BTreeSet<String> {
            let pairs = pairs.as_object().expect("stages").iter();
            let some = pairs.filter(|(_, v)| v.as_f64() > Some(0.0));
            some.map(|(stage, _)| stage.clone()).collect()
        };
        let by_stage = "fft_pairs_by_stage";
        assert_eq!(stages(&plan[by_stage]), stages(&run[by_stage]), "{case}");
    }
}

/// Where there is no room for a coarser grid the scene itself is rehearsed, to the pair.
#[test]
fn a_scene_of_few_cells_is_rehearsed_itself() {
    let bench = Bench::new();
    let plan = planned(&bench, "small.toml", &[]);
    let run = ran(&bench, "small.toml", &[]);
    assert_eq!(whole(&plan), [(26, true)]);
    assert_eq!(
        plan["iterations"]["most"],
        run["wear_iterations"].as_f64().expect("a count")
    );
    let expected = plan["fft_pairs"]["expected"].as_f64().expect("pairs");
    let actual = run["fft_pairs"].as_f64().expect("pairs");
    assert!(
        (expected / actual - 1.0).abs() < 5e-3,
        "{expected} {actual}"
    );
}

/// A vibration is that of all contact elements, also on a coarser grid.
#[test]
fn a_vibrating_joint_is_rehearsed_with_its_vibration() {
    let bench = Bench::new();
    let sets = ["joint.grid=[90, 72]"];
    let plan = planned(&bench, "resonator.toml", &sets);
    let run = ran(&bench, "resonator.toml", &sets);
    assert!(plan["vibrations"].as_f64() >= Some(1.0), "{plan}");
    assert_eq!(plan["not_rehearsed"], json!([]));
    hold_all("resonator", &plan, &run);
}

/// No rehearsal spends more operations of transforms than it may, and an iteration on each of its grids.
#[test]
#[ignore = "long: half a minute"]
fn a_rehearsal_of_each_kind_of_pipeline_ends() {
    const MOST: f64 = 6e10;
    for name in [
        "hertz_fretting",
        "lap_joint",
        "measured_surface",
        "oscillator",
        "prescribed_fretting",
        "prescribed_fretting_plastic",
        "resonator_springs",
        "static_contact",
    ] {
        let cost = rehearsed(&Bench::new(), &pipeline(name), &[]).cost;
        let operations: f64 = cost.rehearsed.iter().map(|grid| grid.operations).sum();
        assert!(operations < MOST, "{name}: {operations:e}");
        assert!(cost.memory > 20_000_000, "{name}");
        // The published structure is too large, and is told to be.
        let large = ["lap_joint", "resonator_springs"].contains(&name);
        assert_eq!(cost.not_rehearsed.is_empty(), !large, "{name}: {cost:?}");
        assert_eq!(cost.disk.is_none(), name == "resonator_springs", "{name}");
        for grid in &cost.rehearsed {
            assert!(
                grid.cells.iter().all(|n| *n >= 24 || *n == 0),
                "{name}: {grid:?}"
            );
        }
    }
}

/// A load that varies makes cycles of many samples, which a rehearsal has no time for on a joint of many asperities.
#[test]
fn a_course_that_is_broken_off_has_a_range() {
    let sets = [
        "joint.grid=[110, 100]",
        "surface.correlation_length=0.1 mm",
        "motion.normal_load_amplitude=60 N",
    ];
    let cost = rehearsed(&Bench::new(), "small.toml", &sets).cost;
    assert!(cost.rehearsed.iter().any(|grid| !grid.whole), "{cost:?}");
    for range in [cost.iterations, cost.fft_pairs, cost.disk] {
        let range = range.expect("said");
        assert!(range.least < range.expected && range.expected < range.most);
        assert!(range.most < 30.0 * range.least, "{range:?}");
    }
}

/// What takes longer than a rehearsal may is refused in time, with the reason, and what is counted is said.
#[test]
fn a_rehearsal_ends_in_time() {
    let scene = scene::load(Path::new(&pipeline("lap_joint")), &[]).expect("a scene");
    let most = Duration::from_millis(50);
    let options = Options { cache: None, most };
    let found = rehearsal::rehearse(&Plan::of(&scene).expect("a plan").inputs, &options);
    assert!(found.cost.memory > 100_000_000 && found.cost.disk.is_none());
    assert_eq!(found.cost.not_rehearsed.len(), 1, "{:?}", found.cost);
}

/// A run is the same whether it was planned or not, and what it keeps of its plan is nothing that was rehearsed.
#[test]
fn nothing_that_is_rehearsed_enters_a_recipe() {
    let bench = Bench::new();
    let at_once = bench
        .done(&["plan", "small.toml", "--json", "--no-rehearsal"])
        .json();
    let rehearsed = bench.done(&["plan", "small.toml", "--json"]).json();
    assert_eq!(at_once["recipe"], rehearsed["recipe"]);
    assert_eq!(at_once["decisions"], rehearsed["decisions"]);
    assert!(at_once["cost"].is_null() && at_once["seconds"].is_null());
    bench.done(&["run", "small.toml", "--run", "run", "--quiet"]);
    let text = std::fs::read_to_string(bench.path("run/plan.json")).expect("a plan");
    let kept: Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(kept["recipe"], rehearsed["recipe"]);
    let keys: BTreeSet<&str> = kept
        .as_object()
        .expect("an object")
        .keys()
        .map(|k| &**k)
        .collect();
    assert!(!keys.contains("cost"), "{keys:?}");
}

/// Runs of before have a cost in their plan, which nobody reads.
#[test]
fn a_plan_with_a_cost_is_read() {
    let bench = Bench::new();
    let scene = bench.scene("small.toml", &[]);
    let recipe = Plan::of(&scene).expect("a plan").inputs.recipe;
    let plan = json!({ "recipe": recipe, "warnings": [], "cost": { "iterations": 12.0 } });
    let read = scene::recipe_of_run(&bench.path("run"), Some(&plan), &scene.to_toml());
    assert_eq!(read.expect("a recipe"), recipe);
}

/// The truth is that of all starts, whatever the last of them did.
#[test]
fn a_run_in_pieces_has_cost_what_one_in_one_piece_has() {
    let whole = ran(&Bench::new(), "small.toml", &[]);
    let bench = Bench::new();
    let stopped = ["run", "small.toml", "--run", "run", "--max-wall", "1 us"];
    while bench.fretwear(&stopped).code() == 75 {}
    let pieces = ran(&bench, "small.toml", &[]);
    for name in ["wear_iterations", "pruned_iterations", "fft_pairs_by_stage"] {
        assert_eq!(pieces[name], whole[name], "{name}");
    }
    // What a run with other iterations kept does not know, it says.
    let sparse = ran(&Bench::new(), "small.toml", &["output.keep={ last = 1 }"]);
    assert_eq!(
        sparse["pruned_iterations"].as_u64(),
        // The unworn state and the last stay.
        whole["wear_iterations"].as_u64().map(|n| n - 1)
    );
}

/// A person sees at the end what a run has cost, and before it what it will.
#[test]
fn both_are_told() {
    let bench = Bench::new();
    let told = bench.done(&["run", "small.toml", "--run", "run"]).stderr();
    let line = told
        .lines()
        .find(|line| line.trim_start().starts_with("cost"))
        .expect("a line on cost");
    for word in ["iterations", "FFT pairs", " s, ", "of disk"] {
        assert!(line.contains(word), "{line}");
    }
    let planned = bench.done(&["plan", "small.toml", "--set", ROOM]).stdout();
    for word in [
        "iterations    about",
        "FFT pairs     about",
        "disk          about",
        "time          about",
        "rehearsed     in",
    ] {
        assert!(planned.contains(word), "{word}: {planned}");
    }
    let at_once = bench
        .done(&["plan", "small.toml", "--no-rehearsal"])
        .stdout();
    assert!(!at_once.contains("cost"), "{at_once}");
}

/// Where the vibration is too large to be rehearsed, the whole time is said as the run itself says it, and not that of its contact alone.
#[test]
#[ignore = "long: 10 seconds"]
fn the_time_of_a_run_is_that_of_its_vibration_too() {
    let bench = Bench::new();
    let scene = format!("{}/pipelines/lap_joint.toml", env!("CARGO_MANIFEST_DIR"));
    let plan = bench.done(&["plan", &scene, "--json"]).json();
    let seconds = &plan["seconds"];
    assert!(plan["cost"]["vibrations"].is_null(), "it is rehearsed");
    let whole = seconds["whole"].as_f64().expect("seconds");
    let contact = seconds["run"]["contact"].as_f64().unwrap_or(0.0);
    assert!(whole > contact, "{seconds}");
    let told = bench.done(&["plan", &scene]).stdout();
    assert!(
        told.contains("with the vibration, by what such runs take"),
        "{told}"
    );
    assert!(!told.contains("here, one thread"), "{told}");
    // What is rehearsed is told by its rehearsal.
    let small = bench.done(&["plan", "small.toml", "--json"]).json();
    assert!(small["seconds"]["whole"].is_null());
}
