//! Methods for cycles on small scenes. Valid methods agree, and each method preserves the symmetries of friction.

use std::path::PathBuf;

use fretwear::scene::{InputError, Plan};
use fretwear::tables::TableName;

use super::Start;
use crate::support::{Bench, latest, summary, table, verified};

/// Tolerance of energies per cycle, with the scene's tolerances of 1e-4 for friction and 1e-3 for a wear step.
const SAME: f64 = 2e-3;
/// Under a rotation, the slip direction turns slightly between two reversals. A cycle of 64 steps includes this effect; one step does not.
/// The dense solution of `tests/drawn` shows a difference of up to 3.5e-3.
const TURNED: f64 = 4e-3;
/// Tolerance for superposition, whose reduced pressure has the tolerance 1e-3.
const SUPERPOSED: f64 = 1e-2;
/// Rounding error between mirror images.
const MIRRORED: f64 = 1e-6;
/// Friction coefficient times load of the small joint \[N\].
const FRICTION: f64 = 120.0;

fn run(bench: &Bench, name: &str, sets: &[&str]) -> PathBuf {
    let root = bench.path(name);
    let mut all = vec!["wear.cycles=60_000"];
    all.extend(sets);
    Start::new(bench.scene("small.toml", &all), &root).done();
    verified(&root);
    root
}

fn last(root: &std::path::Path, column: &str) -> f64 {
    summary(root, latest(root), column)
}

#[test]
fn reversal_and_stepped_agree_on_a_straight_motion() {
    for more in [
        &[][..],
        &["contact.transverse=absent"],
        &["motion.amplitude=[\"0.8 um\", \"0.6 um\"]"],
        &["motion.force=60 N"],
        &["motion.amplitude=0 um", "motion.rotation=0.3 mrad"],
    ] {
        let bench = Bench::new();
        let turned = more.iter().any(|set| set.contains("rotation"));
        let same = if turned { TURNED } else { SAME };
        let reversal = run(&bench, "a", &[more, &["fidelity.cycle=reversal"]].concat());
        let stepped = run(&bench, "b", &[more, &["fidelity.cycle=stepped"]].concat());
        for name in ["dissipated_energy", "wear_volume", "kn", "kt"] {
            let (found, expected) = (last(&stepped, name), last(&reversal, name));
            assert!(
                (found / expected - 1.0).abs() < same,
                "{name} with {more:?}: {found:e} for {expected:e}"
            );
        }
    }
}

/// Without Poisson's effect, shear and pressure displace alike and superposition is exact. Otherwise, superposition reports its error.
#[test]
fn superposition_is_exact_without_poissons_effect() {
    let bench = Bench::new();
    let both = |name: &str, more: &[&str]| {
        ["reversal", "superposition"].map(|mode| {
            let cycle = format!("fidelity.cycle={mode}");
            run(
                &bench,
                &format!("{name}_{mode}"),
                &[more, &[&cycle]].concat(),
            )
        })
    };
    for more in [
        &["material.poisson_ratio=0"][..],
        &["material.poisson_ratio=0", "motion.force=60 N"],
        &[
            "material.poisson_ratio=0",
            "motion.amplitude=[\"0.8 um\", \"0.6 um\"]",
        ],
    ] {
        let [exact, superposed] = both(&format!("{}", more.len() + more.concat().len()), more);
        let (found, expected) = (
            last(&superposed, "wear_volume"),
            last(&exact, "wear_volume"),
        );
        assert!(
            (found / expected - 1.0).abs() < SUPERPOSED,
            "{more:?}: {found:e} for {expected:e}"
        );
    }
    let [exact, superposed] = both("steel", &[]);
    let error = last(&superposed, "error_tangential");
    assert!(error > 10.0 * last(&exact, "error_tangential"), "{error:e}");
    let off = last(&superposed, "dissipated_energy") / last(&exact, "dissipated_energy") - 1.0;
    assert!(off.abs() < 0.3, "{off}");
    for (sets, said) in [
        (
            &["motion.normal_load_amplitude=1 N"][..],
            "needs a straight motion",
        ),
        (&["motion.rotation=0.1 mrad"], "no rotation about z"),
    ] {
        let sets = [sets, &["fidelity.cycle=superposition"]].concat();
        let error = Plan::of(&bench.scene("small.toml", &sets)).expect_err("refused");
        assert!(error.to_string().contains(said), "{error}");
    }
}

/// Under the same load, the opposite motion has the opposite shear and the same energy.
#[test]
fn a_load_in_phase_and_out_of_it() {
    let bench = Bench::new();
    let energy = |phase: f64| {
        let root = run(
            &bench,
            &format!("{phase}"),
            &[
                "motion.normal_load_amplitude=80 N",
                &format!("motion.phase=\"{phase} deg\""),
                "fidelity.steps_per_cycle=16",
            ],
        );
        let cycle = table(&root, 0, TableName::Cycle);
        let [load, place] =
            ["normal_load", "displacement_x"].map(|name| cycle.f64(name).expect("one"));
        assert!(
            (load[0] - 280.0).abs() < 1e-9,
            "the load must be largest at t = 0"
        );
        assert!((place[0] - 1e-6 * phase.to_radians().cos()).abs() < 1e-15);
        last(&root, "dissipated_energy")
    };
    let [in_phase, quarter, opposite, three_quarters] = [0.0, 90.0, 180.0, 270.0].map(energy);
    assert!(
        (opposite / in_phase - 1.0).abs() < MIRRORED,
        "{opposite:e} for {in_phase:e}"
    );
    assert!((three_quarters / quarter - 1.0).abs() < MIRRORED);
    assert!(
        (quarter / in_phase - 1.0).abs() > 0.01,
        "the phase must matter"
    );
}

/// In gross slip far beyond the elastic displacement, friction does the work of its mean force: 4 µNA for a straight line and 2π µNA for
/// a circle. The elastic displacement at the two reversals reduces the work.
#[test]
fn gross_sliding_does_the_work_of_its_path() {
    for (sets, path) in [
        (&["motion.amplitude=60 um"][..], 4.0 * 60e-6),
        (
            &[
                "motion.amplitude=60 um",
                "motion.normal_load_amplitude=50 N",
            ],
            4.0 * 60e-6,
        ),
        (
            &[
                "motion.amplitude=[\"60 um\", \"60 um\"]",
                "motion.phase=[\"0 deg\", \"90 deg\"]",
            ],
            std::f64::consts::TAU * 60e-6,
        ),
    ] {
        let bench = Bench::new();
        let root = run(&bench, "run", &[sets, &["wear.cycles=1"]].concat());
        let work = summary(&root, 0, "dissipated_energy") / (FRICTION * path);
        // The elastic displacement is some percent of the amplitude. The sampling error of the circle is 0.1 %.
        assert!((0.9..1.001).contains(&work), "{sets:?}: {work}");
    }
}

/// Without friction, dissipation and wear are zero. With much friction, the slip is small.
#[test]
fn friction_from_none_to_much() {
    for more in [
        &[][..],
        &["fidelity.cycle=stepped"],
        &["contact.transverse=free"],
        &["motion.normal_load_amplitude=50 N"],
        &["wear.scheme=explicit", "wear.depth_step=0.1 um"],
    ] {
        let bench = Bench::new();
        let none = run(
            &bench,
            "none",
            &[more, &["contact.friction_coefficient=0"]].concat(),
        );
        assert_eq!(last(&none, "dissipated_energy"), 0.0, "{more:?}");
        assert_eq!(last(&none, "wear_volume"), 0.0, "{more:?}");
        assert_eq!(last(&none, "cycles"), 60_000.0, "{more:?}");
        assert!(last(&none, "kt") > 0.0, "kt must belong to full stick");
        let some = run(&bench, "some", more);
        let much = run(
            &bench,
            "much",
            &[more, &["contact.friction_coefficient=5"]].concat(),
        );
        let energy = |root| summary(root, 0, "dissipated_energy");
        assert!(energy(&much) < energy(&some), "{more:?}");
    }
    let bench = Bench::new();
    let sets = ["contact.friction_coefficient=0", "motion.force=1 N"];
    let error = Plan::of(&bench.scene("small.toml", &sets)).expect_err("refused");
    assert!(matches!(error, InputError::Plan(_)), "{error}");
    // Without a limit of cycles, a joint that does not wear would never end.
    let (text, sets) = (crate::support::SMALL, ["contact.friction_coefficient=0"]);
    bench.write(
        "small.toml",
        text.replace("cycles = 600_000", "volume = \"1 mm^3\""),
    );
    let said = Start::new(bench.scene("small.toml", &sets), &bench.path("run")).refused();
    assert!(said.contains("volume"), "{said}");
}
