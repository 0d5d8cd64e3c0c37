use fretwear::contact::normal::{self, NormalOptions, NormalProblem, NormalSolution};
use fretwear::contact::{Boundary, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::{CappedHertz, Hertz, elastic};

use super::{STEEL, distance, paraboloid, relative_l2};

/// The contact of a sphere with an elastic peak pressure of 760 MPa.
const PAIR: Pair = Pair {
    lower: STEEL,
    upper: STEEL,
};
const RADIUS: f64 = 0.04;
const LOAD: f64 = 300.0;
const APEX: (f64, f64) = (1.1e-5, -2.7e-5);

/// A grid with about 20 cells per contact radius.
fn patch() -> Patch {
    Patch::full(Grid::over([1.24e-3, 1.12e-3], [70, 55]))
}

fn oracle(cap: f64) -> CappedHertz {
    CappedHertz {
        radius: RADIUS,
        load: LOAD,
        effective_modulus: elastic::effective_modulus(&PAIR),
        cap,
    }
}

fn solve(patch: &Patch, cap: Option<f64>) -> NormalSolution {
    solve_to(NormalOptions::default(), patch, cap)
}

fn solve_to(options: NormalOptions, patch: &Patch, cap: Option<f64>) -> NormalSolution {
    let height = paraboloid(patch.grid, RADIUS, APEX);
    let problem = NormalProblem {
        pressure_cap: cap,
        ..NormalProblem::new(patch, &height, LOAD)
    };
    let mut half_space = HalfSpace::new(patch.grid, PAIR, Boundary::Free);
    normal::solve(&mut half_space, &problem, None, options).unwrap()
}

fn area(patch: &Patch, pressure: &[f64]) -> f64 {
    pressure.iter().filter(|p| **p > 0.0).count() as f64 * patch.grid.cell_area()
}

#[test]
fn caps_of_the_paper_make_a_plateau_and_keep_the_load() {
    let patch = patch();
    let peak = Hertz {
        radius: RADIUS,
        load: LOAD,
        effective_modulus: elastic::effective_modulus(&PAIR),
    }
    .peak_pressure();
    assert!(
        peak > 7.0e8,
        "the elastic peak must exceed the cap: {peak:e}"
    );
    let mut last = area(&patch, &solve(&patch, None).pressure);
    for cap in [6.0e8, 5.0e8, 4.5e8] {
        let solution = solve(&patch, Some(cap));
        let expected = oracle(cap).solve(600).unwrap();
        let load = solution.pressure.iter().sum::<f64>() * patch.grid.cell_area();
        assert!((load / LOAD - 1.0).abs() < 1e-12, "{load:e}");
        assert_eq!(solution.pressure.iter().copied().fold(0.0, f64::max), cap);
        let contact = area(&patch, &solution.pressure);
        assert!(contact > last, "{contact:e} after {last:e} at {cap:e}");
        last = contact;

        for (index, p) in solution.pressure.iter().enumerate() {
            let r = distance(patch.grid, index, APEX);
            if r < expected.plateau_radius - patch.grid.dy {
                assert_eq!(*p, cap, "r = {r:e}");
                // The gap on the plateau is negative, or within the tolerance in a cell just inside its edge.
                assert!(solution.gap[index] < 1e-6 * expected.approach);
            } else if r > expected.plateau_radius + patch.grid.dy {
                assert!(*p < cap);
            }
        }
        let exact: Vec<f64> = (0..patch.grid.len())
            .map(|k| expected.pressure_at(distance(patch.grid, k, APEX)))
            .collect();
        // The grid resolves the rim to a cell of a/20. The measured pressure error is 0.8 to 1.6 %, and the approach converges with second
        // order.
        let error = relative_l2(&solution.pressure, &exact);
        assert!(error < 2.5e-2, "{cap:e}: {error:e}");
        assert!((solution.approach / expected.approach - 1.0).abs() < 2e-4);
        let radius = (contact / std::f64::consts::PI).sqrt();
        assert!((radius - expected.contact_radius).abs() < 0.5 * patch.grid.dy);
    }
}

#[test]
fn a_cap_above_the_peak_changes_nothing() {
    let patch = patch();
    let options = NormalOptions {
        tolerance: 1e-11,
        ..NormalOptions::default()
    };
    let [free, capped] = [None, Some(9.0e8)].map(|cap| solve_to(options, &patch, cap));
    assert!(relative_l2(&capped.pressure, &free.pressure) < 1e-9);
}
