//! Tests of tangential steps under a given force, moment or displacement field, by closed forms and a dense solver.

use std::f64::consts::PI;

use fretwear::contact::tangential::{
    self, CellState, Drive, TangentialOptions, TangentialProblem, TangentialSolution,
};
use fretwear::contact::{Boundary, ContactError, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};
use fretwear::reference::CircularPunch;

use super::extremes::in_units_of;
use super::{PAIR, distance, influence, moved_by, relative_l2, sheared};

/// Error of a circle of cells, whose radius follows from its area. The rim is a staircase, and the moment depends on a³.
const STAIRCASE: f64 = 1.5e-2;
/// Tolerances of the tests. Errors of forces, shears and displacements are proportional to the square root of the duality gap.
const EXACT: TangentialOptions = TangentialOptions {
    tolerance: 1e-9,
    max_steps: 400,
    max_iterations: 20_000,
    ..TangentialOptions::DEFAULT
};
/// Agreement of two solvers at this duality gap.
const SAME: f64 = 1e-3;
/// Rounding error of a given force, relative to the force.
const FORCE: f64 = 1e-9;

type Field = ByAxis<Vec<f64>>;

fn solve(
    half_space: &mut HalfSpace,
    problem: &TangentialProblem,
) -> Result<TangentialSolution, ContactError> {
    tangential::solve(half_space, problem, None, EXACT)
}

/// A joint with a grid that is small enough for a dense matrix, with uneven friction limits and with some cells without contact.
fn uneven(pair: Pair, size: f64) -> (Patch, HalfSpace, Vec<f64>) {
    let patch = Patch::full(Grid::over([9.0 * size, 8.4 * size], [9, 7]));
    let limit = (0..patch.grid.len())
        .map(|c| {
            if c % 5 == 3 {
                0.0
            } else {
                1e8 * (1.0 + 0.5 * (1.7 * c as f64).sin())
            }
        })
        .collect();
    (
        patch.clone(),
        HalfSpace::new(patch.grid, pair, Boundary::Free),
        limit,
    )
}

/// Shear of a step whose cells move by `motion`, by block relaxation without Newton steps.
fn relax(patch: &Patch, pair: Pair, limit: &[f64], previous: &Field, motion: &Field) -> Field {
    let n = limit.len();
    let block = |c: usize, k: usize| {
        let [_, [_, xx, xy], [_, yx, yy]] = influence(pair, patch.grid, c, k);
        [[xx, xy], [yx, yy]]
    };
    let row = |c: usize| (0..n).map(|k| block(c, k)).collect();
    let matrix: Vec<Vec<[[f64; 2]; 2]>> = (0..n).map(row).collect();
    let mut shear: Field = vec![vec![0.0; limit.len()]; 2];
    for _ in 0..6000 {
        let mut moved = 0.0f64;
        for c in (0..limit.len()).filter(|&c| limit[c] > 0.0) {
            let mut slip = [motion[0][c], motion[1][c]];
            for (k, block) in matrix[c].iter().enumerate() {
                let change = [shear[0][k] - previous[0][k], shear[1][k] - previous[1][k]];
                for axis in 0..2 {
                    slip[axis] -= block[axis][0] * change[0] + block[axis][1] * change[1];
                }
            }
            let stiffest = matrix[c][c][0][0].max(matrix[c][c][1][1]);
            let target = [
                shear[0][c] + slip[0] / stiffest,
                shear[1][c] + slip[1] / stiffest,
            ];
            let factor = (limit[c] / target[0].hypot(target[1])).min(1.0);
            for axis in 0..2 {
                let next = factor * target[axis];
                moved = moved.max((next - shear[axis][c]).abs() / limit[c]);
                shear[axis][c] = next;
            }
        }
        if moved < 1e-11 {
            break;
        }
    }
    shear
}

fn rigid(grid: Grid, x: f64, y: f64, rotation: f64) -> Field {
    let at = |c: usize| {
        let (i, j) = grid.cell(c);
        grid.centre(i, j)
    };
    vec![
        (0..grid.len()).map(|c| x - rotation * at(c).1).collect(),
        (0..grid.len()).map(|c| y + rotation * at(c).0).collect(),
    ]
}

fn resultants(grid: Grid, shear: &Field) -> [f64; 3] {
    let mut sums = [0.0; 3];
    for c in 0..grid.len() {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        sums[0] += shear[0][c] * grid.cell_area();
        sums[1] += shear[1][c] * grid.cell_area();
        sums[2] += (x * shear[1][c] - y * shear[0][c]) * grid.cell_area();
    }
    sums
}

#[test]
fn a_stuck_circle_twists_as_reissner_and_sagoci_have_it() {
    for pair in [PAIR, Pair::same(PAIR.lower)] {
        let patch = Patch::full(Grid::over([2.2e-3, 2.3e-3], [64, 57]));
        let grid = patch.grid;
        let mut half_space = HalfSpace::new(grid, pair, Boundary::Free);
        let limit: Vec<f64> = (0..grid.len())
            .map(|c| {
                if distance(grid, c, (0.0, 0.0)) < 1e-3 {
                    1e12
                } else {
                    0.0
                }
            })
            .collect();
        let area = limit.iter().filter(|l| **l > 0.0).count() as f64 * grid.cell_area();
        let punch = CircularPunch {
            radius: (area / PI).sqrt(),
            pair,
        };
        let still = moved_by(&[0.0, 0.0]);
        let step = TangentialProblem {
            rotation: Some(Drive::Displacement(1e-6)),
            ..sheared(&patch, &limit, None, &still)
        };
        let turned = solve(&mut half_space, &step).unwrap();
        let expected = 1e-6 * punch.torsional_stiffness();
        assert!(
            (turned.moment / expected - 1.0).abs() < STAIRCASE,
            "{:e} {expected:e}",
            turned.moment
        );
        assert!(
            turned
                .force
                .iter()
                .all(|f| f.abs() < 1e-6 * expected / punch.radius)
        );
        // A given moment causes the same rotation, with a fixed or a free centre.
        for held in [still.clone(), vec![Drive::Force(0.0); 2]] {
            let by_moment = TangentialProblem {
                drive: &held,
                rotation: Some(Drive::Force(expected)),
                ..step
            };
            let found = solve(&mut half_space, &by_moment).unwrap();
            assert!((found.rotation * turned.moment / (1e-6 * expected) - 1.0).abs() < SAME);
            assert!((found.moment / expected - 1.0).abs() < FORCE);
        }
    }
}

#[test]
fn partial_slip_under_force_and_moment_is_that_of_a_dense_solver() {
    let (patch, mut half_space, limit) = uneven(PAIR, 1e-4);
    let grid = patch.grid;
    let first = relax(
        &patch,
        PAIR,
        &limit,
        &vec![vec![0.0; grid.len()]; 2],
        &rigid(grid, 3e-7, -1e-7, 2e-4),
    );
    let (x, y, rotation) = (-4e-7, 2.2e-7, 5e-4);
    let field = rigid(grid, x, y, rotation);
    let expected = relax(&patch, PAIR, &limit, &first, &field);
    let [fx, fy, moment] = resultants(grid, &expected);
    let scale = limit.iter().sum::<f64>() * grid.cell_area();
    let drives = [
        (moved_by(&[x, y]), Drive::Displacement(rotation)),
        (
            vec![Drive::Force(fx), Drive::Displacement(y)],
            Drive::Displacement(rotation),
        ),
        (moved_by(&[x, y]), Drive::Force(moment)),
        (
            vec![Drive::Force(fx), Drive::Force(fy)],
            Drive::Force(moment),
        ),
    ];
    for (drive, turn) in drives {
        let step = TangentialProblem {
            rotation: Some(turn),
            ..sheared(&patch, &limit, Some(&first), &drive)
        };
        let found = solve(&mut half_space, &step).unwrap();
        for axis in 0..2 {
            let error = relative_l2(&found.shear[axis], &expected[axis]);
            assert!(error < SAME, "{drive:?} {turn:?}: {error:e}");
        }
        assert!(
            (found.rotation / rotation - 1.0).abs() < SAME,
            "{drive:?} {turn:?}"
        );
        assert!((found.displacement[0] / x - 1.0).abs() < SAME);
        assert!((found.displacement[1] / y - 1.0).abs() < SAME);
        assert!((found.force[0] - fx).abs() < SAME * scale);
        assert!(found.state.contains(&CellState::Slip) && found.state.contains(&CellState::Stick));
    }
    // A displacement field on the cells with the same motion gives the same shear.
    let still = moved_by(&[0.0, 0.0]);
    let with_offset = TangentialProblem {
        offset: Some(&field),
        ..sheared(&patch, &limit, Some(&first), &still)
    };
    let found = solve(&mut half_space, &with_offset).unwrap();
    assert!(relative_l2(&found.shear[0], &expected[0]) < SAME);
    assert!((found.rotation, &found.displacement) == (0.0, &vec![0.0, 0.0]));
}

#[test]
fn a_free_transverse_axis_carries_no_force() {
    let (patch, mut half_space, limit) = uneven(PAIR, 1e-4);
    let grid = patch.grid;
    let drive = vec![Drive::Displacement(4e-7), Drive::Force(0.0)];
    let step = sheared(&patch, &limit, None, &drive);
    let found = solve(&mut half_space, &step).unwrap();
    assert!(found.force[1].abs() < FORCE * found.force[0]);
    assert!(
        found.displacement[1].abs() > 1e-12,
        "the motion of an uneven contact has a transverse component"
    );
    let zero = vec![vec![0.0; grid.len()]; 2];
    let motion = rigid(grid, 4e-7, found.displacement[1], 0.0);
    let expected = relax(&patch, PAIR, &limit, &zero, &motion);
    assert!(relative_l2(&found.shear[0], &expected[0]) < SAME);
    assert!(resultants(grid, &expected)[1].abs() < SAME * found.force[0]);
}

#[test]
fn units_do_not_matter() {
    // Lengths are multiplied by 1000, and tractions and moduli by 1e-6; forces do not change.
    let scaled = in_units_of(1e-6);
    let (patch, mut half_space, limit) = uneven(PAIR, 1e-4);
    let (large_patch, mut large_half_space, _) = uneven(scaled, 1e-1);
    let large_limit: Vec<f64> = limit.iter().map(|l| l * 1e-6).collect();
    let carried = limit.iter().sum::<f64>() * patch.grid.cell_area();
    let drive = vec![Drive::Force(0.5 * carried), Drive::Force(-0.2 * carried)];
    let moment = 0.2 * carried * 1e-4;
    let small = TangentialProblem {
        rotation: Some(Drive::Force(moment)),
        ..sheared(&patch, &limit, None, &drive)
    };
    let large = TangentialProblem {
        rotation: Some(Drive::Force(1e3 * moment)),
        ..sheared(&large_patch, &large_limit, None, &drive)
    };
    let one = solve(&mut half_space, &small).unwrap();
    let other = solve(&mut large_half_space, &large).unwrap();
    assert_eq!((one.steps, one.iterations), (other.steps, other.iterations));
    assert!((1e3 * one.displacement[0] / other.displacement[0] - 1.0).abs() < 1e-6);
    assert!((one.rotation / other.rotation - 1.0).abs() < 1e-6);
    assert!((1e3 * one.dissipation / other.dissipation - 1.0).abs() < 1e-6);
}

#[test]
fn what_friction_cannot_carry_is_refused_with_numbers() {
    let (patch, mut half_space, limit) = uneven(PAIR, 1e-4);
    let carried = limit.iter().sum::<f64>() * patch.grid.cell_area();
    let mut solve = |limit: &[f64], drive: ByAxis<Drive>, rotation| {
        let problem = TangentialProblem {
            rotation,
            ..sheared(&patch, limit, None, &drive)
        };
        solve(&mut half_space, &problem)
    };
    // The joint carries the force along one axis, but neither along two axes nor together with a moment.
    let share = 0.9 * carried;
    assert!(solve(&limit, vec![Drive::Force(share), Drive::Force(0.0)], None).is_ok());
    for (drive, rotation) in [
        (vec![Drive::Force(share), Drive::Force(share)], None),
        (
            vec![Drive::Force(share), Drive::Force(0.0)],
            Some(Drive::Force(share * 3e-4)),
        ),
    ] {
        match solve(&limit, drive, rotation).unwrap_err() {
            ContactError::FrictionExceeded { name, asked, limit } => {
                assert_eq!(
                    (name, asked),
                    ("tangential force along x", share * (asked / share))
                );
                assert!(limit < asked && limit > 0.3 * asked, "{limit:e} {asked:e}");
            }
            other => panic!("{other}"),
        }
    }
    let frictionless = vec![0.0; limit.len()];
    let slid = solve(
        &frictionless,
        moved_by(&[1e-6, 0.0]),
        Some(Drive::Displacement(1e-3)),
    )
    .unwrap();
    assert!(slid.shear.iter().flatten().all(|q| *q == 0.0) && slid.dissipation == 0.0);
    assert!(slid.state.iter().all(|s| *s == CellState::Open) && slid.slip[0][0] != 0.0);
    assert!(solve(&frictionless, vec![Drive::Force(0.0); 2], None).is_ok());
    let refused = solve(
        &frictionless,
        vec![Drive::Force(1.0), Drive::Displacement(0.0)],
        None,
    );
    assert!(matches!(
        refused,
        Err(ContactError::FrictionExceeded {
            asked: 1.0,
            limit: 0.0,
            ..
        })
    ));
    let lame = solve(&limit, moved_by(&[1e-6]), Some(Drive::Displacement(1e-3))).unwrap_err();
    assert!(lame.to_string().contains("rotation"), "{lame}");
    let endless = solve(
        &limit,
        vec![Drive::Force(f64::NAN), Drive::Displacement(0.0)],
        None,
    );
    assert!(endless.unwrap_err().to_string().contains("NaN"));
}
