use fretwear::contact::normal::{self, Control, NormalOptions, NormalProblem, Rotation};
use fretwear::contact::{Boundary, HalfSpace, Shear, stiffness};
use fretwear::grid::{Grid, Patch};

use super::{PAIR, half_space, paraboloid};

/// On a coarse grid the set changes cell by cell, so the indentation curve is a chain of chords, of which kn is one.
const CHORD: f64 = 0.04;

#[test]
fn kn_is_the_slope_of_the_indentation_curve() {
    let grid = Grid::over([2e-3, 1.5e-3], [50, 42]);
    let patch = Patch::full(grid);
    let height = paraboloid(grid, 0.02, (0.0, 0.0));
    let mut half_space = half_space(&patch);
    let options = NormalOptions {
        tolerance: 1e-10,
        ..NormalOptions::default()
    };
    let mut solve = |load: f64| {
        let problem = NormalProblem {
            patch: &patch,
            height: &height,
            compliance: None,
            control: Control::Load(load),
            rotation: Rotation::FIXED,
            pressure_cap: None,
        };
        normal::solve(&mut half_space, &problem, None, options).expect("normal contact")
    };
    let load = 60.0;
    // Short enough to stay near the tangent, long enough for cells to enter and leave on both sides.
    let step = 0.03 * load;
    let slope = 2.0 * step / (solve(load + step).approach - solve(load - step).approach);
    let set: Vec<bool> = solve(load).pressure.iter().map(|&p| p > 0.0).collect();
    let kn = stiffness::normal(&mut half_space, &set).expect("kn").total;
    assert!(
        (kn / slope - 1.0).abs() < CHORD,
        "kn {kn:e}, slope {slope:e}"
    );
}

#[test]
fn kn_is_exact_where_the_set_does_not_change() {
    let grid = Grid::over([2e-3, 1.5e-3], [23, 19]);
    let patch = Patch::with_hole(grid, 0.6e-3);
    let flat = vec![0.0; grid.len()];
    let mut half_space = half_space(&patch);
    let problem = NormalProblem {
        patch: &patch,
        height: &flat,
        compliance: None,
        control: Control::Load(100.0),
        rotation: Rotation::FIXED,
        pressure_cap: None,
    };
    let options = NormalOptions {
        tolerance: 1e-10,
        ..NormalOptions::default()
    };
    let solution = normal::solve(&mut half_space, &problem, None, options).expect("normal contact");
    let kn = stiffness::normal(&mut half_space, &patch.kept)
        .expect("kn")
        .total;
    assert!((kn * solution.approach / 100.0 - 1.0).abs() < 1e-8);
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
