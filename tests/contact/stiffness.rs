use fretwear::contact::normal::{self, NormalOptions, NormalProblem, Rotation};
use fretwear::contact::tangential::{self, TangentialOptions};
use fretwear::contact::{Boundary, HalfSpace, Shear, stiffness};
use fretwear::grid::{Grid, Patch};

use super::random::Random;
use super::{PAIR, half_space, influence, moved_by, paraboloid, sheared};

/// On a coarse grid, the contact grows by single cells. The indentation curve is a polygon, and kn is the slope of one side.
const CHORD: f64 = 0.04;

/// Accuracy of a stiffness. A stiffness is an energy, so its error is the square of the residual.
const ENERGY: f64 = 1e-7;

#[test]
fn kn_is_exact_where_the_set_does_not_change() {
    let grid = Grid::over([2e-3, 1.5e-3], [23, 19]);
    let patch = Patch::with_hole(grid, 0.6e-3);
    let flat = vec![0.0; grid.len()];
    let mut half_space = half_space(&patch);
    let problem = NormalProblem::new(&patch, &flat, 100.0);
    let options = NormalOptions {
        tolerance: 1e-10,
        ..NormalOptions::default()
    };
    let solution = normal::solve(&mut half_space, &problem, None, options).expect("normal contact");
    let kn = stiffness::normal(&mut half_space, &patch.is_in_joint)
        .expect("kn")
        .total;
    assert!((kn * solution.approach / 100.0 - 1.0).abs() < 1e-8);
}

/// kn of rotating bodies with a fixed set of cells, by a dense solution with the integrals of the kernel.
fn dense_kn_of_turning_bodies(grid: Grid, cells: &[usize]) -> f64 {
    let at = |c: usize| grid.centre(grid.cell(c).0, grid.cell(c).1);
    let matrix = block(grid, cells, [0, 0]);
    // The resultants S belong to unit motions. The load at unit approach with zero moments is 1/(S⁻¹)₀₀.
    let fields: Vec<[f64; 3]> = cells.iter().map(|&c| [1.0, at(c).1, -at(c).0]).collect();
    let pressures = [0, 1, 2].map(|k| eliminate(&matrix, fields.iter().map(|f| f[k]).collect()));
    let resultants: Vec<Vec<f64>> = (0..3)
        .map(|k| {
            let row = (0..3).map(|l| {
                let sum: f64 = fields
                    .iter()
                    .zip(&pressures[l])
                    .map(|(f, p)| f[k] * p)
                    .sum();
                sum * grid.cell_area()
            });
            row.collect()
        })
        .collect();
    1.0 / eliminate(&resultants, vec![1.0, 0.0, 0.0])[0]
}

/// Matrix of one entry of the influence between all these cells.
fn block(grid: Grid, cells: &[usize], [row, column]: [usize; 2]) -> Vec<Vec<f64>> {
    let on = |&at: &usize| {
        let of = |&from: &usize| influence(PAIR, grid, at, from)[row][column];
        cells.iter().map(of).collect()
    };
    cells.iter().map(on).collect()
}

/// Gaussian elimination with column pivoting.
fn eliminate(matrix: &[Vec<f64>], mut right: Vec<f64>) -> Vec<f64> {
    let (mut a, n) = (matrix.to_vec(), right.len());
    for k in 0..n {
        let pivot = (k..n).max_by(|&p, &q| a[p][k].abs().total_cmp(&a[q][k].abs()));
        let pivot = pivot.expect("a pivot row");
        a.swap(k, pivot);
        right.swap(k, pivot);
        for r in k + 1..n {
            let factor = a[r][k] / a[k][k];
            for c in k..n {
                a[r][c] -= factor * a[k][c];
            }
            right[r] -= factor * right[k];
        }
    }
    for k in (0..n).rev() {
        let known: f64 = (k + 1..n).map(|c| a[k][c] * right[c]).sum();
        right[k] = (right[k] - known) / a[k][k];
    }
    right
}

#[test]
fn kn_of_turning_bodies_is_that_of_a_dense_solution() {
    let grid = Grid::over([2e-3, 1.5e-3], [13, 11]);
    let mut half_space = half_space(&Patch::full(grid));
    // The set is asymmetric, so approach and rotations are coupled.
    let cells: Vec<usize> = (0..grid.len())
        .filter(|&c| {
            let (i, j) = grid.cell(c);
            i + 2 * j < 17 && (i * j) % 3 != 1
        })
        .collect();
    let mut set = vec![false; grid.len()];
    cells.iter().for_each(|&c| set[c] = true);
    let expected = dense_kn_of_turning_bodies(grid, &cells);
    let turning = stiffness::normal_with_rotation(&mut half_space, &set).expect("kn");
    assert!(
        (turning.total / expected - 1.0).abs() < ENERGY,
        "{:e} for {expected:e}",
        turning.total
    );
    let held = stiffness::normal(&mut half_space, &set).expect("kn").total;
    assert!(
        turning.total < 0.9 * held,
        "{:e} and {held:e}",
        turning.total
    );
}

#[test]
fn kn_of_turning_bodies_is_the_slope_of_the_indentation_curve() {
    let grid = Grid::over([2e-3, 1.5e-3], [50, 42]);
    let patch = Patch::full(grid);
    // The contact on two paraboloids carries moments about the centre.
    let (left, right) = (
        paraboloid(grid, 0.02, (-0.5e-3, 0.1e-3)),
        paraboloid(grid, 0.03, (0.6e-3, 0.0)),
    );
    let height: Vec<f64> = left.iter().zip(&right).map(|(a, b)| a.max(*b)).collect();
    let mut half_space = half_space(&patch);
    let options = NormalOptions {
        tolerance: 1e-10,
        ..NormalOptions::default()
    };
    let load = 60.0;
    let moment = [0.002 * load * 1e-3, 0.05 * load * 1e-3];
    let mut solve = |load: f64| {
        let problem = NormalProblem {
            rotation: Rotation::Free { moment },
            ..NormalProblem::new(&patch, &height, load)
        };
        normal::solve(&mut half_space, &problem, None, options).expect("normal contact")
    };
    let step = 0.03 * load;
    let slope = 2.0 * step / (solve(load + step).approach - solve(load - step).approach);
    let set: Vec<bool> = solve(load).pressure.iter().map(|&p| p > 0.0).collect();
    let kn = stiffness::normal_with_rotation(&mut half_space, &set)
        .expect("kn")
        .total;
    assert!(
        (kn / slope - 1.0).abs() < CHORD,
        "kn {kn:e}, slope {slope:e}"
    );
}

#[test]
fn bodies_on_one_cell_turn_without_resistance() {
    let grid = Grid::over([2e-3, 1.5e-3], [9, 7]);
    let mut half_space = half_space(&Patch::full(grid));
    let mut set = vec![false; grid.len()];
    set[grid.index(1, 5)] = true;
    let [turning, held] = [stiffness::normal_with_rotation, stiffness::normal]
        .map(|kn| kn(&mut half_space, &set).expect("kn").total);
    assert!(turning.abs() < ENERGY * held, "{turning:e} of {held:e}");
    // A single cell at the centre has the same stiffness with and without rotation.
    set[grid.index(1, 5)] = false;
    set[grid.index(4, 3)] = true;
    let [turning, held] = [stiffness::normal_with_rotation, stiffness::normal]
        .map(|kn| kn(&mut half_space, &set).expect("kn").total);
    assert!(
        (turning / held - 1.0).abs() < ENERGY,
        "{turning:e} of {held:e}"
    );
}

#[test]
fn an_empty_set_has_no_stiffness() {
    let patch = Patch::full(Grid::over([2e-3, 1.5e-3], [9, 7]));
    let mut half_space = half_space(&patch);
    assert_eq!(
        stiffness::normal(&mut half_space, &[false; 63])
            .expect("kn")
            .total,
        0.0
    );
    assert_eq!(
        stiffness::tangential(&mut half_space, &[false; 63], Shear::InPlane)
            .expect("kt")
            .total,
        0.0
    );
}

#[test]
fn a_full_periodic_contact_is_rigid() {
    let grid = Grid::over([2e-3, 1.5e-3], [12, 10]);
    let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Periodic);
    let full = vec![true; grid.len()];
    assert_eq!(
        stiffness::normal(&mut half_space, &full).expect("kn").total,
        f64::INFINITY
    );
    assert_eq!(
        stiffness::tangential(&mut half_space, &full, Shear::AlongX)
            .expect("kt")
            .total,
        f64::INFINITY
    );
}

/// Agreement of two stiffnesses, from the tolerances of both solvers.
const SOLVERS: f64 = 1e-6;

/// Force along x over displacement along x of a step without slip.
fn stuck(half_space: &mut HalfSpace, patch: &Patch, axes: usize) -> f64 {
    let set = ragged(patch);
    let displacement = 1e-7;
    let drive = moved_by(&[displacement, 0.0][..axes]);
    // The limit far exceeds the shear under this displacement, also in the corners of the set.
    let limit: Vec<f64> = set.iter().map(|&c| if c { 1e12 } else { 0.0 }).collect();
    let problem = sheared(patch, &limit, None, &drive);
    let options = TangentialOptions {
        tolerance: 1e-12,
        ..TangentialOptions::default()
    };
    let found = tangential::solve(half_space, &problem, None, options).expect("a stuck step");
    found.force[0] / displacement
}

/// Contact spots without symmetry, so a force along x also causes a motion along y and a rotation.
fn ragged(patch: &Patch) -> Vec<bool> {
    let (nx, ny) = (patch.grid.nx, patch.grid.ny);
    (0..patch.grid.len())
        .map(|c| {
            let (i, j) = patch.grid.cell(c);
            let on_a_diagonal = (i * ny).abs_diff(j * nx) < nx * ny / 4;
            patch.is_in_joint[c] && (on_a_diagonal || (i < nx / 3 && (i + 2 * j) % 5 < 2))
        })
        .collect()
}

#[test]
fn kt_is_the_first_slope_of_a_tangential_step() {
    let patch = Patch::with_hole(Grid::over([2e-3, 1.5e-3], [26, 23]), 0.5e-3);
    let set = ragged(&patch);
    let mut half_space = half_space(&patch);
    for (axes, shear) in [(1, Shear::AlongX), (2, Shear::InPlane)] {
        let kt = stiffness::tangential(&mut half_space, &set, shear)
            .expect("kt")
            .total;
        let slope = stuck(&mut half_space, &patch, axes);
        assert!(
            (kt / slope - 1.0).abs() < SOLVERS,
            "kt {kt:e}, slope {slope:e}"
        );
    }
}

/// For sets from single cells to nearly all cells, the computed pressures displace every cell of the set by one unit, independently of the
/// preconditioner.
#[test]
fn densities_displace_sets_of_any_share_by_a_unit() {
    /// Root mean square error, from a residual of 3e-6 in the norm of the preconditioner.
    const OFF: f64 = 1e-5;
    let grid = Grid::over([5e-3, 3e-3], [53, 40]);
    let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Free);
    let mut random = Random::new(5);
    for share in [0.002, 0.02, 0.1, 0.3, 0.6, 0.83, 0.95, 0.999] {
        let set: Vec<bool> = (0..grid.len()).map(|_| random.chance(share)).collect();
        let cells = set.iter().filter(|s| **s).count() as f64;
        assert!(cells > 0.0);
        let kn = stiffness::local_normal(&mut half_space, &set).expect("kn");
        let mut displacement = vec![0.0; grid.len()];
        half_space.normal(&kn.density[0], &mut displacement);
        let on_set = displacement.iter().zip(&set).filter(|(_, s)| **s);
        let square: f64 = on_set.map(|(u, _)| (u - 1.0).powi(2)).sum();
        let off = (square / cells).sqrt();
        println!(
            "{share}: {} iterations, root mean square error {off:.1e}",
            kn.iterations
        );
        assert!(off < OFF, "{share}: {off:e}");
        // The energy agrees with the energy of the faster solve.
        let total = stiffness::normal(&mut half_space, &set).expect("kn").total;
        assert!((total / kn.total - 1.0).abs() < ENERGY, "{share}");
    }
}

/// kn, kt for shear along x, and kt with a fixed motion along y, by dense solutions with the integrals of the kernel.
fn dense(grid: Grid, cells: &[usize]) -> [f64; 3] {
    let n = cells.len();
    let total = |matrix: &[Vec<f64>]| {
        let right = (0..matrix.len()).map(|k| if k < n { 1.0 } else { 0.0 });
        let traction = eliminate(matrix, right.collect());
        traction[..n].iter().sum::<f64>() * grid.cell_area()
    };
    let [normal, xx, yy, xy] =
        [[0, 0], [1, 1], [2, 2], [1, 2]].map(|entry| block(grid, cells, entry));
    let both: Vec<Vec<f64>> = (0..n)
        .map(|p| [&xx[p][..], &xy[p]].concat())
        .chain((0..n).map(|p| [&xy[p][..], &yy[p]].concat()))
        .collect();
    [total(&normal), total(&xx), total(&both)]
}

/// On scattered cells, the residual of a solve is a poor estimate of the error, because the error consists of compliant motions of long
/// range.
#[test]
fn kn_and_kt_are_those_of_a_dense_solution_on_cells_of_any_pattern() {
    /// Accuracy in the documentation of [`stiffness::TOLERANCE`].
    const SAID: f64 = 1e-7;
    let grid = Grid::over([5e-3, 3e-3], [23, 16]);
    let mut half_space = half_space(&Patch::full(grid));
    type Pattern = fn(usize, usize) -> bool;
    let patterns: [(&str, Pattern); 9] = [
        ("a checkerboard", |i, j| (i + j) % 2 == 0),
        ("a checkerboard of blocks", |i, j| (i / 4 + j / 4) % 2 == 0),
        ("stripes along y", |i, _| i % 2 == 0),
        ("stripes along x", |_, j| j % 4 == 0),
        ("single cells", |i, j| i % 5 == 2 && j % 4 == 1),
        ("two cells", |i, j| (i, j) == (5, 7) || (i, j) == (20, 11)),
        ("one cell", |i, j| (i, j) == (5, 7)),
        ("all cells but one", |i, j| (i, j) != (5, 7)),
        ("all cells", |_, _| true),
    ];
    for (name, pattern) in patterns {
        let set: Vec<bool> = (0..grid.len())
            .map(|c| pattern(grid.cell(c).0, grid.cell(c).1))
            .collect();
        let cells: Vec<usize> = (0..grid.len()).filter(|&c| set[c]).collect();
        let [kn, along_x, in_plane] = dense(grid, &cells);
        let normal = stiffness::normal(&mut half_space, &set).expect("kn");
        let mut shear = |shear, start| {
            let tolerance = stiffness::TOLERANCE;
            let kt = stiffness::tangential_from(&mut half_space, &set, shear, tolerance, start);
            kt.expect("kt").total
        };
        let found = [
            ("kn", normal.total, kn),
            ("kt along x", shear(Shear::AlongX, None), along_x),
            (
                "kt along x, from kn",
                shear(Shear::AlongX, Some(&normal)),
                along_x,
            ),
            ("kt in the plane", shear(Shear::InPlane, None), in_plane),
            (
                "kt in the plane, from kn",
                shear(Shear::InPlane, Some(&normal)),
                in_plane,
            ),
        ];
        for (what, found, expected) in found {
            let off = found / expected - 1.0;
            println!("{name}: {what}, relative error {off:.1e}");
            assert!(off.abs() < SAID, "{name}: {what} {found:e}, {expected:e}");
        }
    }
}
