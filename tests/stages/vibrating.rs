//! Runs of a structure that vibrates and wears: stage by stage, with requested responses, as siblings, and pruned.

use std::fs;
use std::path::Path;

use fretwear::stages::{Ending, RunError, Stage};
use fretwear::tables::TableName;

use super::Start;
use crate::support::{
    Bench, OSCILLATOR, assert_same, content, content_from, latest, reader, summary, table, verified,
};

/// A few iterations with one update of the contact elements.
const SHORT: &str = "wear.cycles=200_000";

/// Tables of the response that drives the wear. They stay the same until the next update of the elements.
pub const IN_FORCE: [TableName; 4] = [
    TableName::Response,
    TableName::DynamicResponse,
    TableName::JointCycle,
    TableName::ContactElement,
];

fn has(root: &Path, k: u64, name: TableName) -> bool {
    let reader = reader(root);
    let commit = reader.commit_of(k).expect("committed");
    commit.tables.contains_key(name.as_str())
}

/// Iterations with an update, whose contact elements come from their own fine contact.
pub fn updates(root: &Path) -> Vec<u64> {
    (0..=latest(root))
        .filter(|&k| {
            let row = table(root, k, TableName::ModelUpdate);
            row.bool("updated").expect("a flag")[0]
        })
        .collect()
}

#[test]
fn a_run_made_stage_by_stage_is_the_same() {
    let bench = Bench::new();
    let stepped = [
        SHORT,
        "fidelity.cycle=stepped",
        "fidelity.steps_per_cycle=8",
    ];
    for sets in [&[SHORT][..], &stepped] {
        let scene = bench.scene("resonator.toml", sets);
        let (whole, parts) = (bench.path("whole"), bench.path("parts"));
        Start::new(scene.clone(), &whole).done();
        let mut computed = Vec::new();
        let order = [
            Stage::Structure,
            Stage::Surface,
            Stage::Reference,
            Stage::Unworn,
            Stage::Wear,
            Stage::StaticContact,
            Stage::ModelUpdate,
            Stage::DynamicResponse,
            Stage::ForcedResponse,
            Stage::FrettingCycle,
            Stage::Ledger,
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

/// Stops after any stage, then runs without a stop.
#[test]
fn until_any_stage_and_then_on_is_the_same() {
    let bench = Bench::new();
    let scene = bench.scene("resonator.toml", &[SHORT]);
    let whole = bench.path("whole");
    Start::new(scene.clone(), &whole).done();
    let expected = content(&whole);
    let has = |stage: &Stage| !matches!(stage, Stage::CoarseTrajectory | Stage::GridTwin);
    for stage in Stage::ALL.into_iter().filter(has) {
        let root = bench.path(stage.name());
        for _ in 0..3 {
            let (outcome, _) = Start::new(scene.clone(), &root).until(stage).done();
            assert_eq!(outcome.ending, Ending::Until(stage));
        }
        Start::new(scene.clone(), &root).done();
        assert_same(&content(&root), &expected, stage.name());
        verified(&root);
    }
}

#[test]
fn a_stage_that_the_scene_does_not_have_is_refused() {
    let bench = Bench::new();
    bench.write("oscillator.toml", OSCILLATOR);
    let cases = [
        ("small.toml", Stage::Structure),
        ("small.toml", Stage::ModelUpdate),
        ("small.toml", Stage::DynamicResponse),
        ("oscillator.toml", Stage::Surface),
        ("oscillator.toml", Stage::Wear),
        ("oscillator.toml", Stage::StaticContact),
        ("oscillator.toml", Stage::ModelUpdate),
        ("oscillator.toml", Stage::FrettingCycle),
        ("oscillator.toml", Stage::Structure),
    ];
    for (scene, stage) in cases {
        let root = bench.path("refused");
        let (result, _) = Start::new(bench.scene(scene, &[]), &root)
            .until(stage)
            .run();
        let Err(RunError::NoSuchStage { stage: at, stages }) = result else {
            panic!("{scene} ran until {stage}");
        };
        assert_eq!(at, stage);
        assert!(!stages.contains(&stage));
        assert!(!root.exists(), "a refused run left a folder");
    }
    let did = bench.fretwear(&["run", "oscillator.toml", "--until", "wear"]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    let said =
        "this scene has no stage wear; its stages are dynamic_response, forced_response, summary";
    assert!(did.stderr().contains(said), "{}", did.stderr());
}

/// The run lands at a requested response and writes it there. The request changes nothing else: the drive of the wear equals that of
/// a run that lands there for another reason.
#[test]
fn a_response_asked_for_is_not_fed_back() {
    const AT: u64 = 130_000;
    let bench = Bench::new();
    let asked = bench.path("asked");
    let at = format!("output.response_at=[0, {AT}]");
    Start::new(bench.scene("resonator.toml", &[SHORT, &at]), &asked).done();
    verified(&asked);
    let last = latest(&asked);
    let landed: Vec<u64> = (0..=last)
        .filter(|&k| summary(&asked, k, "cycles") == AT as f64)
        .collect();
    let [landed] = landed[..] else {
        panic!("landed at {landed:?}");
    };
    for k in 0..=last {
        let due = [0, landed, last].contains(&k);
        assert_eq!(has(&asked, k, TableName::Frf), due, "frf of {k}");
        assert_eq!(
            has(&asked, k, TableName::WornResponse),
            due,
            "worn_response of {k}"
        );
    }

    // The other run ends at this cycle and then continues. Its response, wear and contact are equal bit for bit.
    // Only keys may differ: they contain the request, but not the end.
    let ended = bench.path("ended");
    let until = format!("wear.cycles={AT}");
    Start::new(bench.scene("resonator.toml", &[&until]), &ended).done();
    assert_eq!(latest(&ended), landed);
    Start::new(bench.scene("resonator.toml", &[SHORT]), &ended).done();
    assert_eq!(latest(&ended), last);
    let state = [
        TableName::Summary,
        TableName::ContactField,
        TableName::WearField,
        TableName::WearStep,
        TableName::Cycle,
        TableName::ModelUpdate,
        TableName::Ledger,
    ];
    for k in 0..=last {
        for name in IN_FORCE.into_iter().chain(state) {
            assert_eq!(
                table(&asked, k, name),
                table(&ended, k, name),
                "{name} of {k}"
            );
        }
    }
    // Without a request, the run has a forced response at its start and at its end.
    let plain = bench.path("plain");
    Start::new(bench.scene("resonator.toml", &[SHORT]), &plain).done();
    for k in 0..=latest(&plain) {
        let due = k == 0 || k == latest(&plain);
        assert_eq!(has(&plain, k, TableName::Frf), due, "frf of {k}");
    }
}

/// The worn response uses contact elements from the present fine contact. At an update, the worn response equals the response that drives
/// the wear. At other iterations, it differs.
#[test]
fn a_worn_response_is_that_of_the_worn_joint() {
    let bench = Bench::new();
    let root = bench.path("a");
    let at = "output.response_at=[60_000, 120_000]";
    Start::new(bench.scene("resonator.toml", &[SHORT, at]), &root).done();
    let renewed = updates(&root);
    let mut differing = 0;
    for k in (0..=latest(&root)).filter(|&k| has(&root, k, TableName::WornResponse)) {
        let (worn, force) = (
            table(&root, k, TableName::WornResponse),
            table(&root, k, TableName::DynamicResponse),
        );
        for column in [
            "resonance_frequency",
            "resonance_amplitude",
            "friction_energy",
        ] {
            let (worn, force) = (
                worn.f64(column).expect("a column")[0],
                force.f64(column).expect("a column")[0],
            );
            if renewed.contains(&k) {
                // The two Newton iterations start from different responses: one from this result, one from an earlier response.
                assert!((worn / force - 1.0).abs() < 1e-6, "{column} of {k}");
            } else {
                differing += usize::from((worn / force - 1.0).abs() > 1e-6);
            }
        }
    }
    assert!(
        differing >= 2,
        "no worn response differs from that in force"
    );
}

#[test]
fn from_any_iteration_in_the_same_bits() {
    let bench = Bench::new();
    let scene = bench.scene("resonator.toml", &[SHORT]);
    let a = bench.path("a");
    Start::new(scene.clone(), &a).done();
    let expected = content(&a);
    for k in 0..=latest(&a) {
        let root = bench.path(&format!("from-{k}"));
        Start::new(scene.clone(), &root).from(&a, k).done();
        assert_same(&content(&root), &expected, &format!("from {k}"));
        verified(&root);
    }
}

/// The first step of the sibling wears at the rate of the sibling's response, not at the rate of the source.
#[test]
fn a_sibling_under_another_force_moves_as_its_own_response_says() {
    const FORCE: &str = "dynamics.force.amplitude=\"240 N\"";
    /// Tolerance of the contact solutions, since response and cycle start from different states.
    const SAME: f64 = 1e-3;
    let bench = Bench::new();
    let a = bench.path("a");
    Start::new(bench.scene("resonator.toml", &[SHORT]), &a).done();
    let scene = bench.scene("resonator.toml", &[SHORT, FORCE]);
    let own = bench.path("own");
    Start::new(scene.clone(), &own).done();
    let root = bench.path("b");
    Start::new(scene.clone(), &root).from(&a, 0).done();
    verified(&root);
    // From the unworn state, a new run with these parameters gives the expected result.
    for (column, at) in [
        ("n_cycles", 1),
        ("wear_volume", 1),
        ("resonance_frequency", 1),
    ] {
        let (found, expected) = (summary(&root, at, column), summary(&own, at, column));
        assert!(
            (found / expected - 1.0).abs() < SAME,
            "{column}: {found:e} instead of {expected:e}"
        );
    }
    let other = summary(&a, 1, "resonance_frequency");
    let own_one = summary(&own, 1, "resonance_frequency");
    assert!(
        (other / own_one - 1.0).abs() > 1e-6,
        "the force has no effect"
    );
    assert!(
        !updates(&root)[1..].contains(&1),
        "the elements are those of iteration 0"
    );

    // The sibling starts from a worn iteration and is interrupted.
    let k = latest(&a) - 1;
    let (whole, parts) = (bench.path("whole"), bench.path("parts"));
    Start::new(scene.clone(), &whole).from(&a, k).done();
    for stage in [Stage::Wear, Stage::ModelUpdate, Stage::DynamicResponse] {
        Start::new(scene.clone(), &parts)
            .from(&a, k)
            .until(stage)
            .done();
    }
    Start::new(scene, &parts).from(&a, k).done();
    assert_same(
        &content_from(&parts, k),
        &content_from(&whole, k),
        "interrupted",
    );
}

#[test]
fn a_sibling_with_another_criterion() {
    let bench = Bench::new();
    let a = bench.path("a");
    let never = "update.stiffness_change=0.9";
    Start::new(bench.scene("resonator.toml", &[SHORT, never]), &a).done();
    assert_eq!(updates(&a), [0]);
    let k = latest(&a) - 2;
    let root = bench.path("b");
    let scene = bench.scene("resonator.toml", &[SHORT, "update.stiffness_change=1e-9"]);
    Start::new(scene, &root).from(&a, k).done();
    verified(&root);
    let expected: Vec<u64> = std::iter::once(0).chain(k + 1..=latest(&root)).collect();
    assert_eq!(updates(&root), expected);
    // The change is relative to the first contact elements of the sibling.
    let row = table(&root, k + 1, TableName::ModelUpdate);
    assert_eq!(row.i64("updates").expect("a count")[0], 1);
}

#[test]
fn a_sibling_with_another_structure_is_refused() {
    let bench = Bench::new();
    Start::new(
        bench.scene("small.toml", &["wear.cycles=60_000"]),
        &bench.path("a"),
    )
    .done();
    let (head, _) = crate::support::SMALL
        .split_once("[joint]")
        .expect("a joint");
    let (_, vibrating) = crate::support::RESONATOR
        .split_once("[joint]")
        .expect("a joint");
    bench.write("other.toml", format!("{head}[joint]{vibrating}"));
    let message = Start::new(bench.scene("other.toml", &[]), &bench.path("b"))
        .from(&bench.path("a"), 1)
        .refused();
    assert!(
        message.contains("`structure.kind` was absent, is \"resonator\""),
        "{message}"
    );
    // A thicker leaf is a changed parameter of the sibling.
    let c = bench.path("c");
    Start::new(bench.scene("resonator.toml", &[SHORT]), &c).done();
    let thick = bench.scene(
        "resonator.toml",
        &[SHORT, "structure.leaf_thickness=\"10.5 mm\""],
    );
    let d = bench.path("d");
    Start::new(thick, &d).from(&c, 1).done();
    verified(&d);
    let (old, new) = (
        summary(&c, 2, "resonance_frequency"),
        summary(&d, 2, "resonance_frequency"),
    );
    assert!((new / old - 1.0).abs() > 1e-4, "{new} Hz with another leaf");
}

/// Values that follow from a key of the joint are also in the section `structure`. Their names there are not keys.
#[test]
fn a_changed_joint_is_refused_by_its_own_key() {
    let bench = Bench::new();
    let a = bench.path("a");
    Start::new(bench.scene("resonator.toml", &[SHORT]), &a).done();
    for (set, told) in [
        (
            "joint.size=[\"40 mm\", \"37 mm\"]",
            "`joint.size` was [0.04,0.036], is [0.04,0.037]",
        ),
        (
            "joint.elements=[11, 11]",
            "`joint.elements` was [9,9], is [11,11]",
        ),
        (
            "material.density=7950 kg/m^3",
            "`material.lower.density` was 7949.0, is 7950.0; `material.upper.density` was 7949.0, is 7950.0",
        ),
    ] {
        let message = Start::new(bench.scene("resonator.toml", &[SHORT, set]), &a).refused();
        let expected = format!("was computed from another scene: {told}; start a new run");
        assert!(message.contains(&expected), "{message}");
    }
}

#[test]
fn updates_are_kept() {
    let bench = Bench::new();
    let root = bench.path("a");
    Start::new(bench.scene("resonator.toml", &[]), &root).done();
    let renewed = updates(&root);
    let last = latest(&root);
    assert!(
        renewed.len() >= 2 && (renewed.len() as u64) < last,
        "{renewed:?} of {last}"
    );
    for (flag, kept) in [("true", renewed.clone()), ("false", vec![])] {
        let keep = format!("output.keep={{ every = 5, last = 1, updates = {flag} }}");
        let few = bench.path(flag);
        Start::new(bench.scene("resonator.toml", &[&keep]), &few).done();
        let expected: Vec<u64> = (0..=last)
            .filter(|k| k % 5 == 0 || *k == last || kept.contains(k))
            .collect();
        let found: Vec<u64> = reader(&few).iterations().collect();
        assert_eq!(found, expected, "updates = {flag}");
        verified(&few);
        assert_eq!(
            table(&few, last, TableName::WearField),
            table(&root, last, TableName::WearField)
        );
    }
}

/// In one step of this cycle, all shears start just within limits that rose a little, and the joint slides.
#[test]
fn a_step_into_sliding_from_just_inside_the_limits_is_solved() {
    let bench = Bench::new();
    let sets = [
        "dynamics.force.amplitude=1000 N",
        "dynamics.harmonics=[0, 1, 2, 3]",
        "dynamics.damping_ratio=0.002",
        r#"dynamics.frequency=["800 Hz", "1200 Hz"]"#,
        "wear.coefficient=2e3 um^3/J",
        "wear.cycles=1",
        "fidelity.aft_samples=128",
        "fidelity.cycle=stepped",
    ];
    let run = bench.path("run");
    Start::new(bench.scene("resonator.toml", &sets), &run)
        .until(Stage::Summary)
        .done();
    let error = summary(&run, 0, "error_tangential");
    assert!(error <= 1e-4, "{error}");
}

/// With extrapolated motion and corrected harmonics, the tables contain the full state. Restarts after each stage give the same bits.
#[test]
fn a_motion_that_is_carried_on_goes_on_after_an_interruption() {
    let bench = Bench::new();
    let sets = [
        SHORT,
        "update.extrapolate=true",
        "update.volume_growth=0.3",
        "fidelity.harmonic_correction=true",
    ];
    let scene = bench.scene("resonator.toml", &sets);
    let (whole, parts) = (bench.path("whole"), bench.path("parts"));
    Start::new(scene.clone(), &whole).done();
    let is_carried_on = |k: u64| {
        let flag = |name, column| table(&whole, k, name).bool(column).expect("a flag")[0];
        flag(TableName::DynamicResponse, "is_steady") && !flag(TableName::Summary, "updated")
    };
    assert!((0..=latest(&whole)).any(is_carried_on));
    for stage in [Stage::Summary, Stage::Summary, Stage::Summary, Stage::Wear]
        .into_iter()
        .chain([Stage::FrettingCycle, Stage::Summary, Stage::DynamicResponse])
    {
        Start::new(scene.clone(), &parts).until(stage).done();
    }
    Start::new(scene, &parts).done();
    assert_same(&content(&parts), &content(&whole), "interrupted");
}
