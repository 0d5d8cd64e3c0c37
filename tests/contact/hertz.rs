use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::{HalfSpace, Shear, stiffness};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::{Hertz, elastic};

use super::{PAIR, distance, half_space, paraboloid};

fn exact() -> Hertz {
    Hertz {
        radius: 0.05,
        load: 320.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    }
}

/// A grid of 45 × 31 cells. The contact lies outside the centre and reaches no edge.
fn grid() -> Grid {
    let a = exact().contact_radius();
    Grid::over([3.6 * a, 2.9 * a], [45, 31])
}

fn apex() -> (f64, f64) {
    let a = exact().contact_radius();
    (0.31 * a, -0.23 * a)
}

fn solve_load(
    half_space: &mut HalfSpace,
    patch: &Patch,
    height: &[f64],
    load: f64,
) -> normal::NormalSolution {
    let problem = NormalProblem::new(patch, height, load);
    normal::solve(half_space, &problem, None, NormalOptions::default()).unwrap()
}

#[test]
fn off_centre_contact_is_hertz_within_the_grid() {
    let (exact, grid) = (exact(), grid());
    let patch = Patch::full(grid);
    let height = paraboloid(grid, exact.radius, apex());
    let solution = solve_load(&mut half_space(&patch), &patch, &height, exact.load);
    // With a/dx = 12.5, the error of the approach is about 0.03 (dx/a)², and the pressure error away from the rim is about 0.3 (dx/a)².
    assert!((solution.approach / exact.approach() - 1.0).abs() < 5e-4);
    for (index, p) in solution.pressure.iter().enumerate() {
        let r = distance(grid, index, apex());
        if r < exact.contact_radius() - 2.0 * grid.dx {
            assert!((p / exact.pressure(r) - 1.0).abs() < 2e-2, "{p:e} at {r:e}");
            assert!(solution.gap[index].abs() < 1e-5 * exact.approach());
        }
        if r > exact.contact_radius() + grid.dx {
            assert_eq!(*p, 0.0);
            let error = (solution.gap[index] - exact.gap(r)).abs() / exact.approach();
            assert!(error < 2.5e-3, "r = {r:e}: {error:e}");
        }
    }
}

#[test]
fn approach_is_measured_from_height_zero() {
    let (exact, grid) = (exact(), grid());
    let patch = Patch::full(grid);
    let mut half_space = half_space(&patch);
    let height = paraboloid(grid, exact.radius, apex());
    let lifted: Vec<f64> = height.iter().map(|h| h + 3.0e-6).collect();
    let (low, high) = (
        solve_load(&mut half_space, &patch, &height, exact.load),
        solve_load(&mut half_space, &patch, &lifted, exact.load),
    );
    assert!((low.approach - high.approach - 3.0e-6).abs() < 1e-6 * exact.approach());
}

#[test]
fn stiffness_is_the_slope_of_the_indentation_curve() {
    let (exact, grid) = (exact(), grid());
    let patch = Patch::full(grid);
    let mut half_space = half_space(&patch);
    let height = paraboloid(grid, exact.radius, apex());
    let solution = solve_load(&mut half_space, &patch, &height, exact.load);
    let set: Vec<bool> = solution.pressure.iter().map(|p| *p > 0.0).collect();
    let kn = stiffness::normal(&mut half_space, &set).unwrap().total;
    // The load steps are so small that the set of cells in contact does not change, and the load is linear in the approach. The error is
    // the tolerance of a solve, 1e-6 of the displacement, over the step of 3e-5.
    let step = 1e-5 * exact.load;
    let up = solve_load(&mut half_space, &patch, &height, exact.load + step);
    let down = solve_load(&mut half_space, &patch, &height, exact.load - step);
    let slope = 2.0 * step / (up.approach - down.approach);
    assert!((slope / kn - 1.0).abs() < 1e-2);
}

#[test]
fn a_start_changes_the_speed_and_not_the_result() {
    let (exact, grid) = (exact(), grid());
    let patch = Patch::full(grid);
    let mut half_space = half_space(&patch);
    let height = paraboloid(grid, exact.radius, apex());
    let problem = NormalProblem::new(&patch, &height, exact.load);
    let options = NormalOptions {
        tolerance: 1e-9,
        ..NormalOptions::default()
    };
    let cold = normal::solve(&mut half_space, &problem, None, options).unwrap();
    let elsewhere: Vec<f64> = (0..grid.len())
        .map(|k| ((k * 7919) % 13) as f64 * 1e7)
        .collect();
    for start in [&cold.pressure, &elsewhere] {
        let warm = normal::solve(&mut half_space, &problem, Some(start), options).unwrap();
        assert!((warm.approach / cold.approach - 1.0).abs() < 1e-8);
        assert!(super::relative_l2(&warm.pressure, &cold.pressure) < 1e-7);
    }
    let warm = normal::solve(&mut half_space, &problem, Some(&cold.pressure), options).unwrap();
    assert!(
        warm.iterations < cold.iterations / 4,
        "{} against {}",
        warm.iterations,
        cold.iterations
    );
}

#[test]
fn tangential_stiffness_of_the_contact_is_mindlins() {
    let (exact, grid) = (exact(), grid());
    let patch = Patch::full(grid);
    let mut half_space = half_space(&patch);
    let height = paraboloid(grid, exact.radius, apex());
    let solution = solve_load(&mut half_space, &patch, &height, exact.load);
    let set: Vec<bool> = solution.pressure.iter().map(|p| *p > 0.0).collect();
    let kn = stiffness::normal(&mut half_space, &set).unwrap().total;
    let expected = 4.0 * elastic::tangential_modulus(&PAIR) / elastic::effective_modulus(&PAIR);
    for shear in [Shear::AlongX, Shear::InPlane] {
        let kt = stiffness::tangential(&mut half_space, &set, shear)
            .unwrap()
            .total;
        // Both stiffnesses have the same staircase rim, so the ratio is more accurate than either stiffness.
        assert!(
            (kt / kn / expected - 1.0).abs() < 1e-3,
            "{shear:?} {}",
            kt / kn / expected
        );
    }
}
