//! Tests of normal contact under given approach, rotation and moments, by closed forms and a dense solution.

use std::f64::consts::PI;

use fretwear::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use fretwear::contact::{Boundary, ContactError, HalfSpace};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::{Hertz, elastic};

use super::certificate::{Direct, certify};
use super::extremes::{apart, rough};
use super::{PAIR, distance, paraboloid, relative_l2};

/// A grid that is small enough for a dense matrix.
const GRID: Grid = Grid {
    nx: 11,
    ny: 8,
    dx: 1.1e-4,
    dy: 1.6e-4,
};

/// Agreement of two solutions with a gap error of 1e-10 of a cell's displacement. A problem with some hundred cells amplifies this error.
const SAME: f64 = 1e-6;
const EXACT: NormalOptions = NormalOptions {
    tolerance: 1e-10,
    max_iterations: 4000,
};
/// Allowed gap error at the default tolerance, as in `certificate`.
const GAP: f64 = 2e-6;

fn solve(problem: &NormalProblem) -> Result<NormalSolution, ContactError> {
    let mut half_space = HalfSpace::new(problem.patch.grid, PAIR, Boundary::Free);
    normal::solve(&mut half_space, problem, None, EXACT)
}

/// Pressures under a given motion by a projected Gauss–Seidel method, without transforms, without unknown rigid motions and without line
/// search.
fn relax(patch: &Patch, height: &[f64], cap: f64, motion: [f64; 3]) -> Vec<f64> {
    let grid = patch.grid;
    let direct = Direct::new(grid, PAIR, Boundary::Free);
    let columns: Vec<Vec<f64>> = (0..grid.len())
        .map(|c| {
            let mut unit = vec![0.0; grid.len()];
            unit[c] = 1.0;
            direct.displacement(&unit)
        })
        .collect();
    let mut pressure = vec![0.0; grid.len()];
    for _ in 0..20_000 {
        let (mut moved, mut peak) = (0.0f64, 0.0f64);
        for c in (0..grid.len()).filter(|&c| patch.is_in_joint[c]) {
            let (i, j) = grid.cell(c);
            let (x, y) = grid.centre(i, j);
            // The influence matrix is symmetric.
            let displacement: f64 = columns[c].iter().zip(&pressure).map(|(k, p)| k * p).sum();
            let gap = displacement - height[c] - motion[0] - motion[1] * y + motion[2] * x;
            let next = (pressure[c] - gap / columns[c][c]).clamp(0.0, cap);
            moved = moved.max((next - pressure[c]).abs());
            peak = peak.max(next);
            pressure[c] = next;
        }
        if moved <= 1e-13 * peak {
            break;
        }
    }
    pressure
}

/// Load and moments of a pressure field.
fn resultants(grid: Grid, pressure: &[f64]) -> (f64, [f64; 2]) {
    let (mut load, mut moment) = (0.0, [0.0; 2]);
    for (c, p) in pressure.iter().enumerate() {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        load += p * grid.cell_area();
        moment[0] += p * y * grid.cell_area();
        moment[1] -= p * x * grid.cell_area();
    }
    (load, moment)
}

#[test]
fn an_approach_presses_with_hertz_load() {
    let exact = Hertz {
        radius: 0.05,
        load: 320.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    let a = exact.contact_radius();
    let patch = Patch::full(Grid::over([3.6 * a, 2.9 * a], [45, 31]));
    let apex = (0.31 * a, -0.23 * a);
    let height = paraboloid(patch.grid, exact.radius, apex);
    let problem = NormalProblem {
        control: Control::Approach(exact.approach()),
        ..NormalProblem::new(&patch, &height, 0.0)
    };
    let found = solve(&problem).unwrap();
    // The load is proportional to the approach to the power of 3/2; `hertz` tests the approach.
    assert!((found.load / exact.load - 1.0).abs() < 1e-3);
    assert_eq!(
        (found.approach, found.rotation),
        (exact.approach(), [0.0; 2])
    );
    let load = found.load;
    assert!((found.moment[0] / (load * apex.1) - 1.0).abs() < 1e-3);
    assert!((found.moment[1] / (-load * apex.0) - 1.0).abs() < 1e-3);
    // A paraboloid with radius R that rotates by θ is a paraboloid with its apex shifted by Rθ; the load acts at the new apex.
    let tilt = 0.2 * a / exact.radius;
    let tilted = NormalProblem {
        control: Control::Load(exact.load),
        rotation: Rotation::Given([tilt, tilt]),
        ..problem
    };
    let found = solve(&tilted).unwrap();
    let moved = (apex.0 - exact.radius * tilt, apex.1 + exact.radius * tilt);
    assert!((found.moment[0] / exact.load - moved.1).abs() < 1e-3 * a);
    assert!((-found.moment[1] / exact.load - moved.0).abs() < 1e-3 * a);
    // Each rotation raises the apex by θ² R/2, and the rotations also lift the former apex.
    let lifted = exact.radius * tilt * tilt + tilt * apex.1 - tilt * apex.0;
    assert!((found.approach + lifted - exact.approach()).abs() < 1e-3 * exact.approach());
}

#[test]
fn given_motions_are_those_of_a_dense_solution_and_their_resultants_bring_them_back() {
    let patch = Patch::with_hole(GRID, 3.4e-4);
    for (seed, rq, cap) in [
        (1, 1e-7, f64::INFINITY),
        (2, 2e-6, f64::INFINITY),
        (3, 3e-7, 2e8),
    ] {
        let height = rough(GRID, seed, rq);
        for motion in [
            [0.0; 3],
            [0.3 * rq, 0.0, 0.0],
            [rq, 500.0 * rq, -900.0 * rq],
        ] {
            let expected = relax(&patch, &height, cap, motion);
            let (load, moment) = resultants(GRID, &expected);
            let [approach, turned_x, turned_y] = motion;
            let given = Rotation::Given([turned_x, turned_y]);
            let free = Rotation::Free { moment };
            for (control, rotation) in [
                (Control::Approach(approach), given),
                (Control::Load(load), given),
                (Control::Approach(approach), free),
                (Control::Load(load), free),
            ] {
                let problem = NormalProblem {
                    control,
                    rotation,
                    pressure_cap: cap.is_finite().then_some(cap),
                    ..NormalProblem::new(&patch, &height, 0.0)
                };
                let about = format!("seed {seed} {control:?} {rotation:?}");
                let found = solve(&problem).unwrap_or_else(|error| panic!("{error}: {about}"));
                let off = apart(&found.pressure, expected.iter().copied());
                assert!(off < SAME, "{off:e}: {about}");
                assert!((found.load / load - 1.0).abs() < SAME, "{about}");
                let size = rq.max(1e-7);
                assert!((found.approach - approach).abs() < SAME * size, "{about}");
                for axis in 0..2 {
                    let lever = GRID.size()[1 - axis];
                    let turned = found.rotation[axis] - motion[1 + axis];
                    assert!((turned * lever).abs() < SAME * size, "{about}: {turned:e}");
                    let off = found.moment[axis] - moment[axis];
                    assert!(off.abs() < SAME * load * lever, "{about}: {off:e}");
                }
            }
        }
    }
}

/// A disc under the load and moment of a rotated flat punch: p = (N/2πa + (2E*/π)(θ_x y − θ_y x))/√(a² − r²), so that M = 4E*a³θ/3 [K. L.
/// Johnson, Contact Mechanics, eq. 3.36 and its first moment].
#[test]
fn a_flat_punch_turns_as_its_moment_says() {
    // Error of a circle of cells, whose radius follows from its area. The rim is a staircase, and the moment depends on a³.
    const STAIRCASE: f64 = 2e-2;
    let grid = Grid::over([2.2e-3, 2.3e-3], [64, 57]);
    let mut patch = Patch::full(grid);
    for c in 0..grid.len() {
        patch.is_in_joint[c] = distance(grid, c, (0.0, 0.0)) < 1e-3;
    }
    let a = (patch.area() / PI).sqrt();
    let modulus = elastic::effective_modulus(&PAIR);
    let height = vec![0.0; grid.len()];
    let (load, turned) = (1e3, [0.3, -0.2]);
    // The rotations are given as parts of the rotation that would lift the rim.
    let full = load / (4.0 * modulus * a * a);
    let expected = turned.map(|part| part * full);
    let moment = expected.map(|angle| 4.0 / 3.0 * modulus * a.powi(3) * angle);
    let free = NormalProblem {
        rotation: Rotation::Free { moment },
        ..NormalProblem::new(&patch, &height, load)
    };
    let found = solve(&free).unwrap();
    assert!((found.approach / (load / (2.0 * modulus * a)) - 1.0).abs() < STAIRCASE);
    for axis in 0..2 {
        assert!((found.rotation[axis] / expected[axis] - 1.0).abs() < STAIRCASE);
    }
    let given = NormalProblem {
        rotation: Rotation::Given(found.rotation),
        control: Control::Approach(found.approach),
        ..free
    };
    let held = solve(&given).unwrap();
    assert!((held.load / load - 1.0).abs() < SAME);
    assert!(relative_l2(&held.pressure, &found.pressure) < SAME);
    for c in (0..grid.len()).filter(|&c| distance(grid, c, (0.0, 0.0)) < 0.8 * a) {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        let tilted = 2.0 * modulus / PI * (expected[0] * y - expected[1] * x);
        let root = (a * a - x * x - y * y).sqrt();
        let pressure = (load / (2.0 * PI * a) + tilted) / root;
        assert!((found.pressure[c] / pressure - 1.0).abs() < 2.0 * STAIRCASE);
    }
}

#[test]
fn a_joint_balances_on_one_cell_and_on_two() {
    // The numbers of cells are odd, so the load acts at the centre of a cell.
    let grid = Grid {
        nx: 13,
        ny: 9,
        ..GRID
    };
    let patch = Patch::full(grid);
    let cell = |i: usize, j: usize| grid.index(i, j);
    let mut opposite = vec![0.0; grid.len()];
    opposite[cell(1, 2)] = 1e-5;
    opposite[cell(11, 6)] = 1e-5;
    let mut beside = vec![0.0; grid.len()];
    beside[cell(5, 4)] = 1e-5;
    beside[cell(8, 4)] = 1e-5;
    for (height, expected) in [
        (paraboloid(grid, 1e-3, (0.0, 0.0)), vec![(cell(6, 4), 1.0)]),
        (opposite, vec![(cell(1, 2), 0.5), (cell(11, 6), 0.5)]),
        (
            beside,
            vec![(cell(5, 4), 2.0 / 3.0), (cell(8, 4), 1.0 / 3.0)],
        ),
    ] {
        let load = 1e-3;
        let problem = NormalProblem {
            rotation: Rotation::Free { moment: [0.0; 2] },
            ..NormalProblem::new(&patch, &height, load)
        };
        let found = solve(&problem).unwrap();
        let direct = Direct::new(grid, PAIR, Boundary::Free);
        let displacement = direct.displacement(&found.pressure);
        certify(&problem, &found, &displacement, direct.own(), GAP).unwrap();
        let mut pressure = vec![0.0; grid.len()];
        for (c, share) in expected {
            pressure[c] = share * load / grid.cell_area();
        }
        assert!(apart(&found.pressure, pressure.into_iter()) < SAME);
    }
}

#[test]
fn moments_beyond_the_joint_are_refused() {
    let patch = Patch::full(GRID);
    let height = rough(GRID, 4, 1e-6);
    let load = 100.0;
    let [lx, ly] = GRID.size();
    // The load can only act between the centres of the outermost cells.
    let reach = [0.5 * (ly - GRID.dy), 0.5 * (lx - GRID.dx)];
    let turned = |moment: [f64; 2]| NormalProblem {
        rotation: Rotation::Free { moment },
        ..NormalProblem::new(&patch, &height, load)
    };
    for moment in [
        [1.001 * load * reach[0], 0.0],
        [0.0, -1.001 * load * reach[1]],
        [1e3, 1e3],
    ] {
        match solve(&turned(moment)) {
            Err(ContactError::MomentNotCarried {
                moment: asked,
                load: carried,
            }) => {
                assert_eq!(asked, moment);
                assert!((carried / load - 1.0).abs() < 1e-12);
            }
            other => panic!("{moment:?}: {other:?}"),
        }
    }
    // With a moment just below the limit, nearly the complete load acts on one row of cells.
    let found = solve(&turned([0.99 * load * reach[0], 0.0])).unwrap();
    assert!((found.moment[0] / (0.99 * load * reach[0]) - 1.0).abs() < 1e-10);
    // A pressure cap bounds the moment, too.
    let capped = NormalProblem {
        pressure_cap: Some(1.1 * load / patch.area()),
        ..turned([0.5 * load * reach[0], 0.0])
    };
    assert!(matches!(
        solve(&capped),
        Err(ContactError::MomentNotCarried { .. })
    ));
    // A joint without load cannot carry a moment.
    let unloaded = NormalProblem {
        control: Control::Load(0.0),
        ..turned([1e-9, 0.0])
    };
    assert!(matches!(
        solve(&unloaded),
        Err(ContactError::MomentNotCarried { load: 0.0, .. })
    ));
}

/// Without a given load or moment, the tolerance of the resultants follows from the pressures.
#[test]
fn a_given_approach_of_bodies_that_turn_without_moments() {
    let grid = Grid::over([4e-3, 3e-3], [61, 47]);
    let patch = Patch::full(grid);
    let height = rough(grid, 3, 2e-6);
    let pressed = solve(&NormalProblem {
        rotation: Rotation::Free { moment: [0.0; 2] },
        ..NormalProblem::new(&patch, &height, 300.0)
    });
    let pressed = pressed.expect("a contact under a load");
    let found = solve(&NormalProblem {
        control: Control::Approach(pressed.approach),
        rotation: Rotation::Free { moment: [0.0; 2] },
        ..NormalProblem::new(&patch, &height, 0.0)
    });
    let found = found.expect("a contact at an approach");
    assert!((found.load / 300.0 - 1.0).abs() < SAME, "{} N", found.load);
    assert!(relative_l2(&found.pressure, &pressed.pressure) < SAME);
}
