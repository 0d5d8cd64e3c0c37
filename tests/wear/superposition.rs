//! Shear by the superposition of Ciavarella and Jäger, against closed forms and the exact cycle.

use fretwear::contact::normal::Rotation;
use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::CattaneoMindlin;
use fretwear::wear::cycle::{CycleSolution, March};
use fretwear::wear::{FrettingJoint, Motion, WearError};

use super::{EXACT, FRICTION, LOAD, difference, difference_l1, driven, harmonic, joint, unworn};
use crate::contact::STEEL;

/// Amplitude of partial slip of the rough joint \[m\]: the force is 2/5 of the sliding force.
const PARTIAL: f64 = 0.35e-6;

/// Relative errors of force and energy of the sphere with 16 cells per radius.
const SPHERE_FORCE: f64 = 5e-4;
const SPHERE_ENERGY: f64 = 5e-3;

/// Relative error of forces and energies from the tolerance of the reduced pressure, where the superposition is exact.
const REDUCED: f64 = 2e-3;

/// Largest relative errors of force, energy and wear (L1) of the rough joint for ν = 0.3, with a margin.
const ROUGH_FORCE: f64 = 5e-3;
const ROUGH_ENERGY: f64 = 0.03;
const ROUGH_WEAR: f64 = 0.06;

fn along_x(amplitude: f64, phase: f64) -> Motion {
    Motion::harmonic(&[(amplitude, phase)], LOAD, 0.0, 16)
}

fn rough(motion: Motion, march: March, poisson_ratio: f64) -> CycleSolution {
    let mut joint = joint(motion, march);
    let body = Elastic {
        poisson_ratio,
        ..STEEL
    };
    joint.half_space = HalfSpace::new(joint.patch.grid, Pair::same(body), Boundary::Free);
    unworn(&mut joint).cycle
}

#[test]
fn a_sphere_frets_as_cattaneo_and_mindlin_have_it() {
    for poisson_ratio in [0.0, 0.3] {
        let body = Elastic {
            poisson_ratio,
            ..STEEL
        };
        let exact = CattaneoMindlin {
            radius: 0.05,
            load: 320.0,
            friction_coefficient: FRICTION,
            pair: Pair::same(body),
        };
        let a = exact.hertz().contact_radius();
        let grid = Grid::over([2.5 * a, 2.6 * a], [40, 33]);
        let mut joint = FrettingJoint {
            half_space: HalfSpace::new(grid, exact.pair, Boundary::Free),
            patch: Patch::full(grid),
            height: crate::contact::paraboloid(grid, exact.radius, (0.07 * a, -0.11 * a)),
            pressing: None,
            rotation: Rotation::FIXED,
            pressure_cap: None,
            friction_coefficient: FRICTION,
            motion: Motion::at_rest(exact.load),
            evolving_motion: None,
            march: March::Superposition,
            options: EXACT,
        };
        for share in [0.3, 0.6, 0.9] {
            let amplitude = share * exact.sliding_displacement();
            joint.motion = Motion::harmonic(&[(amplitude, 0.0)], exact.load, 0.0, 16);
            let cycle = unworn(&mut joint).cycle;
            let force = cycle.instants[0].force[0] / exact.force(amplitude);
            let energy = cycle.dissipation / exact.energy_per_cycle(amplitude);
            assert!((force - 1.0).abs() < SPHERE_FORCE, "{share}: {force}");
            assert!((energy - 1.0).abs() < SPHERE_ENERGY, "{share}: {energy}");
        }
    }
}

#[test]
fn without_poissons_ratio_it_is_exact_on_a_rough_joint() {
    for axes in [
        vec![(PARTIAL, 0.0)],
        vec![(0.8 * PARTIAL, 0.0), (-0.6 * PARTIAL, 0.0)],
    ] {
        let motion = Motion::harmonic(&axes, LOAD, 0.0, 16);
        let exact = rough(motion.clone(), March::Reversal, 0.0);
        let found = rough(motion, March::Superposition, 0.0);
        for (found, exact) in found.shear.iter().zip(&exact.shear) {
            let off = difference(found, exact);
            assert!(off < 10.0 * REDUCED, "shear off by {off}");
        }
        let energy = found.dissipation / exact.dissipation;
        assert!((energy - 1.0).abs() < REDUCED, "{energy}");
        let wear = difference_l1(&found.energy, &exact.energy);
        assert!(wear < REDUCED, "{wear}");
    }
}

#[test]
fn its_error_says_that_it_is_an_approximation() {
    for (amplitude, sliding) in [(PARTIAL, false), (3e-6, true)] {
        let exact = rough(along_x(amplitude, 0.0), March::Reversal, 0.3);
        let found = rough(along_x(amplitude, 0.0), March::Superposition, 0.3);
        let force = found.instants[0].force[0] / exact.instants[0].force[0] - 1.0;
        let energy = found.dissipation / exact.dissipation - 1.0;
        let wear = difference_l1(&found.energy, &exact.energy);
        if sliding {
            // All cells slip, so the superposition is exact.
            assert!(found.error < EXACT.tangential.tolerance);
            assert!(force.abs() < REDUCED && energy.abs() < REDUCED && wear < REDUCED);
        } else {
            assert!(found.error > 10.0 * EXACT.tangential.tolerance);
            assert!(force.abs() < ROUGH_FORCE, "force {force}");
            assert!(
                energy.abs() < ROUGH_ENERGY && energy.abs() < found.error,
                "energy {energy}"
            );
            assert!(wear < ROUGH_WEAR && wear < found.error, "wear {wear}");
        }
    }
}

#[test]
fn a_given_force_is_met() {
    let force = 0.4 * FRICTION * LOAD;
    let motion = driven(&[harmonic(force, true)], None);
    let found = rough(motion.clone(), March::Superposition, 0.3);
    let exact = rough(motion, March::Reversal, 0.3);
    assert!((found.instants[0].force[0] / force - 1.0).abs() < 1e-9);
    let displacement = found.instants[0].displacement[0] / exact.instants[0].displacement[0];
    assert!((displacement - 1.0).abs() < ROUGH_FORCE, "{displacement}");
}

#[test]
fn the_phase_moves_the_start_and_nothing_else() {
    let reference = rough(along_x(PARTIAL, 0.0), March::Superposition, 0.0);
    for phase in [0.9, -1.3] {
        let found = rough(along_x(PARTIAL, phase), March::Superposition, 0.0);
        let exact = rough(along_x(PARTIAL, phase), March::Reversal, 0.0);
        assert_eq!(found.dissipation, reference.dissipation);
        let (found, exact) = (&found.instants[0], &exact.instants[0]);
        assert_eq!(found.displacement, exact.displacement);
        let force = found.force[0] / exact.force[0];
        assert!(
            (force - 1.0).abs() < 5.0 * REDUCED,
            "phase {phase}: {force}"
        );
    }
}

#[test]
fn what_it_cannot_superpose_is_refused() {
    let refused = |motion: Motion| {
        let mut joint = joint(motion, March::Superposition);
        let wear = vec![0.0; joint.patch.grid.len()];
        let contact = joint.static_contact(&wear, None).expect("static contact");
        joint.cycle(&wear, &contact, None).map(|_| ())
    };
    let mixed = [harmonic(PARTIAL, false), harmonic(10.0, true)];
    assert_eq!(refused(driven(&mixed, None)), Err(WearError::NotSuperposed));
    let along = [harmonic(PARTIAL, false), harmonic(0.0, false)];
    let turning = Some(harmonic(1e-5, false));
    assert_eq!(
        refused(driven(&along, turning)),
        Err(WearError::NotSuperposed)
    );
    let orbit = Motion::harmonic(&[(PARTIAL, 0.0), (PARTIAL, 1.0)], LOAD, 0.0, 16);
    assert_eq!(refused(orbit), Err(WearError::NotStraight));
    // A fixed or free transverse axis is not a motion.
    for is_force in [false, true] {
        let axes = [harmonic(PARTIAL, false), harmonic(0.0, is_force)];
        assert_eq!(refused(driven(&axes, None)), Ok(()));
    }
    assert!(matches!(
        refused(driven(&[harmonic(1.01 * FRICTION * LOAD, true)], None)),
        Err(WearError::Contact(_))
    ));
}
