//! Tests of difficult tangential steps. The tests certify each solution and bound its cost.

use fretwear::contact::tangential::{
    self, Drive, TangentialOptions, TangentialProblem, TangentialSolution,
};
use fretwear::contact::{Boundary, ContactError, Elastic, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};
use proptest::prelude::*;

use super::{PAIR, moved_by, sheared};

/// Largest number of FFT pairs per axis and step, at a duality gap of 1e-4 or 1e-6. In 13 000 cases with other seeds, the largest number
/// was 249; one case in 600 needed more than 160.
const WORST: f64 = 300.0;
/// Largest number of FFT pairs per axis and step with free motions, at a duality gap of 1e-4 or 1e-6. For each free motion, a Newton step
/// applies the preconditioner once more.
const WORST_DRIVEN: f64 = 400.0;
/// Upper bound of the median number of FFT pairs per axis and step.
const MEDIAN: f64 = 40.0;

/// Allowed error of given forces, relative to the largest friction force.
const FORCE: f64 = 1e-9;

const GRID: Grid = Grid {
    nx: 27,
    ny: 22,
    dx: 1.1e-3,
    dy: 1.3e-3,
};

/// Friction limits from waves of a few cells and longer. A plateau replaces the tops above the share `cut` of the cells, as after wear.
fn limits(seed: u64, sharpness: f64, cut: f64, peak: f64, mask: bool) -> (Patch, Vec<f64>) {
    let patch = if mask {
        Patch::with_hole(GRID, 8e-3)
    } else {
        Patch::full(GRID)
    };
    let phase = (seed % 1000) as f64;
    let wave = |i: usize, j: usize| {
        let (x, y) = (i as f64, j as f64);
        (0.9 * x + 0.3 * y + phase).sin()
            + (0.4 * x - 1.1 * y + 2.0 * phase).sin()
            + 0.7 * (2.1 * x + 1.7 * y - phase).cos()
            + 0.5 * (0.2 * x + 0.1 * y + 3.0 * phase).sin()
    };
    let limit = (0..GRID.len())
        .map(|c| {
            let (i, j) = GRID.cell(c);
            if patch.is_in_joint[c] {
                peak * (wave(i, j) - sharpness).clamp(0.0, cut)
            } else {
                0.0
            }
        })
        .collect();
    (patch, limit)
}

#[derive(Debug, Clone)]
struct Step {
    /// Factor of the friction limits.
    load: f64,
    /// Displacement or share of the largest friction force, along both axes and for the rotation.
    amount: [f64; 3],
}

#[derive(Debug, Clone)]
struct Case {
    seed: u64,
    sharpness: f64,
    cut: f64,
    friction: f64,
    mask: bool,
    periodic: bool,
    tolerance: f64,
    steps: Vec<Step>,
}

fn cases(amounts: impl Strategy<Value = [f64; 3]> + Clone) -> impl Strategy<Value = Case> {
    let step = (-3.0..0.0f64, amounts).prop_map(|(load, amount)| Step {
        load: 10f64.powf(load),
        amount,
    });
    (
        any::<u64>(),
        -2.5..2.2f64,
        -3.0..0.5f64,
        prop::sample::select(vec![0.0, 0.01, 0.6, 0.6, 5.0]),
        any::<bool>(),
        prop::bool::weighted(0.2),
        prop::sample::select(vec![1e-4, 1e-6]),
        prop::collection::vec(step, 1..6),
    )
        .prop_map(
            |(seed, sharpness, cut, friction, mask, periodic, tolerance, steps)| Case {
                seed,
                sharpness,
                cut: 10f64.powf(cut),
                friction,
                mask,
                periodic,
                tolerance,
                steps,
            },
        )
}

/// Solves a case step by step, and returns the FFT pairs per axis for each step.
fn march(
    case: &Case,
    axes: usize,
    drive: impl Fn(&Step, &Patch, &[f64]) -> (ByAxis<Drive>, Option<Drive>),
) -> Result<Vec<f64>, TestCaseError> {
    let (patch, shape) = limits(
        case.seed,
        case.sharpness,
        case.cut,
        3e8 * case.friction,
        case.mask,
    );
    let soft = Elastic {
        youngs_modulus: 71e9,
        poisson_ratio: 0.47,
    };
    let pair = if case.seed.is_multiple_of(2) {
        PAIR
    } else {
        Pair {
            upper: soft,
            ..PAIR
        }
    };
    let boundary = if case.periodic {
        Boundary::Periodic
    } else {
        Boundary::Free
    };
    let mut half_space = HalfSpace::new(GRID, pair, boundary);
    let mut shear: Option<ByAxis<Vec<f64>>> = None;
    let mut pairs = Vec::new();
    for step in &case.steps {
        let limit: Vec<f64> = shape.iter().map(|l| l * step.load).collect();
        let (drive, rotation) = drive(step, &patch, &limit);
        let problem = TangentialProblem {
            rotation,
            ..sheared(&patch, &limit, shear.as_ref(), &drive)
        };
        let options = TangentialOptions {
            tolerance: case.tolerance,
            ..TangentialOptions::default()
        };
        half_space.take_pairs();
        let found = tangential::solve(&mut half_space, &problem, None, options);
        let found: TangentialSolution = match found {
            Err(ContactError::FrictionExceeded { asked, limit, .. }) => {
                // The reported limit and the rejection come from two different minimisations.
                prop_assert!(asked != 0.0 && limit <= asked.abs() * (1.0 + 1e-6));
                continue;
            }
            found => found.map_err(|error| TestCaseError::fail(format!("{error} {step:?}")))?,
        };
        prop_assert!(found.error <= case.tolerance && found.force_error <= FORCE);
        pairs.push(half_space.take_pairs() / axes as f64);
        shear = Some(found.shear);
    }
    Ok(pairs)
}

/// Displacement of gross slip, as for a punch of the same contact area.
fn sliding(limit: &[f64]) -> f64 {
    let area = limit.iter().filter(|l| **l > 0.0).count() as f64 * GRID.cell_area();
    let force = limit.iter().sum::<f64>() * GRID.cell_area();
    force / (1e11 * area.sqrt()).max(f64::MIN_POSITIVE)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, failure_persistence: None, ..ProptestConfig::default() })]

    /// Displacements range from 1e-6 to 100 times the displacement of gross slip, and friction limits vary by a factor of 1000.
    #[test]
    fn every_displacement_is_solved(
        case in cases((-6.0..2.0f64, 0.0..6.3f64).prop_map(|(size, angle)| [size, angle, 0.0])),
        axes in 1..=2usize,
    ) {
        let pairs = march(&case, axes, |step, _, limit| {
            let [size, angle, _] = step.amount;
            let reach = 10f64.powf(size) * sliding(limit);
            let motion = [reach * f64::cos(angle), reach * f64::sin(angle)];
            (moved_by(&motion[..axes]), None)
        })?;
        for cost in pairs {
            prop_assert!(cost <= WORST, "{cost} FFT pairs");
        }
    }

    /// Forces and moments range up to the friction limit and beyond.
    #[test]
    fn every_force_is_met_or_refused(
        case in cases([-1.1..1.1f64, -0.9..0.9f64, -0.6..0.6f64]),
        with in 0..4usize,
    ) {
        let axes = if with == 0 { 1 } else { 2 };
        let pairs = march(&case, axes, |step, _, limit| {
            let carried = limit.iter().sum::<f64>() * GRID.cell_area();
            let [x, y, z] = step.amount;
            let force = |share: f64| Drive::Force(share * carried);
            match with {
                0 => (vec![force(x)], None),
                1 => (vec![Drive::Displacement(x * sliding(limit)), Drive::Force(0.0)], None),
                2 => (vec![force(0.8 * x), force(0.8 * y)], Some(Drive::Displacement(0.0))),
                _ => (vec![force(0.8 * x), Drive::Displacement(0.0)], Some(force(8e-3 * z))),
            }
        })?;
        for cost in pairs {
            prop_assert!(cost <= WORST_DRIVEN, "{cost} FFT pairs");
        }
    }
}

/// All shears are just below friction limits that rose slightly, and the motion far exceeds gross slip with a small component aside. A
/// chord between two such shears lies inside the friction circle, so a solver must not require shears on the circle before slip.
#[test]
fn shears_just_inside_their_limits_come_to_slip() {
    let mut costs = Vec::new();
    for seed in 0..12 {
        let (patch, limit) = limits(seed, -2.0, 1.0, 1e8, seed % 2 == 0);
        let mut half_space = HalfSpace::new(GRID, PAIR, Boundary::Free);
        let just = 1.0 - 10f64.powi(-1 - (seed as i32) % 8);
        let before: ByAxis<Vec<f64>> = [0.05 * seed as f64, 0.3]
            .iter()
            .map(|angle: &f64| limit.iter().map(|l| just * l * angle.sin()).collect())
            .collect();
        let reach = sliding(&limit) * [0.3, 1.0, 30.0][seed as usize % 3];
        let drive = moved_by(&[reach, 1e-3 * reach]);
        let problem = sheared(&patch, &limit, Some(&before), &drive);
        tangential::solve(
            &mut half_space,
            &problem,
            None,
            TangentialOptions::default(),
        )
        .unwrap();
        costs.push(0.5 * half_space.take_pairs());
    }
    costs.sort_by(f64::total_cmp);
    assert!(
        costs[costs.len() / 2] <= MEDIAN && costs[costs.len() - 1] <= WORST,
        "{costs:?}"
    );
}
