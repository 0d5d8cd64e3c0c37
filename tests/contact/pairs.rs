//! The test bounds the number of FFT pairs per tangential step of one rough joint. A change of the bounds needs a reason in the solver.

use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::tangential::{self, Drive, TangentialOptions, TangentialSolution};
use fretwear::contact::{Boundary, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};

use super::battery::waves;
use super::random::Random;
use super::{STEEL, limit_of, moved_by, sheared};

const LOAD: f64 = 3e3;
const FRICTION: f64 = 0.6;

struct Joint {
    patch: Patch,
    half_space: HalfSpace,
    limit: Vec<f64>,
}

/// Rough joint with a quarter of its cells in contact, in spots of a few cells.
fn joint() -> Joint {
    let patch = Patch::full(Grid::over([10e-3, 7.5e-3], [60, 48]));
    let height = waves(patch.grid, &mut Random::new(7), 0.7e-6, [0.5e-3; 2]);
    let mut half_space = HalfSpace::new(patch.grid, Pair::same(STEEL), Boundary::Free);
    let problem = NormalProblem::new(&patch, &height, LOAD);
    let contact = normal::solve(&mut half_space, &problem, None, NormalOptions::default());
    let pressure = contact.expect("a contact").pressure;
    let limit = limit_of(FRICTION, &pressure);
    let share = limit.iter().filter(|l| **l > 0.0).count() as f64 / limit.len() as f64;
    assert!((0.15..0.5).contains(&share), "{share} in contact");
    Joint {
        patch,
        half_space,
        limit,
    }
}

impl Joint {
    /// Solves a step from `previous`, and returns the solution and the number of FFT pairs.
    fn step(
        &mut self,
        previous: Option<&ByAxis<Vec<f64>>>,
        drive: ByAxis<Drive>,
    ) -> (TangentialSolution, f64) {
        let problem = sheared(&self.patch, &self.limit, previous, &drive);
        let options = TangentialOptions::default();
        self.half_space.take_pairs();
        let found = tangential::solve(&mut self.half_space, &problem, None, options);
        let found = found.expect("a certified step");
        assert!(found.error <= options.tolerance);
        (found, self.half_space.take_pairs())
    }
}

/// Name of the case, share of the sliding force, and upper bounds of the FFT pairs, 20 % above the measurements. The order of the bounds
/// is: given displacement along one axis and along two axes, given force along one axis and along two axes.
const BANDS: [(&str, f64, [f64; 4]); 3] = [
    ("near stick", 0.1, [25.0, 62.0, 23.0, 58.0]),
    ("partial slip", 0.6, [19.0, 50.0, 18.0, 48.0]),
    ("near sliding", 0.97, [14.0, 50.0, 12.0, 46.0]),
];

/// Bounds for gross slip along one axis and along two axes.
const SLIDING: [f64; 2] = [4.0, 26.0];

/// Bounds for a return from partial slip, along one axis and along two axes.
const REVERSAL: [f64; 2] = [20.0, 65.0];

/// Direction that is parallel neither to an axis nor to a diagonal.
fn along(axes: usize, amount: f64) -> ByAxis<f64> {
    match axes {
        1 => vec![amount],
        _ => vec![0.8 * amount, -0.6 * amount],
    }
}

#[test]
fn steps_stay_within_their_pairs() {
    let mut joint = joint();
    let sliding = FRICTION * LOAD;
    let mut over = Vec::new();
    let mut hold = |case: String, pairs: f64, band: f64| {
        println!("{case}: {pairs} FFT pairs, bound {band}");
        if pairs > band {
            over.push(format!("{case}: {pairs} FFT pairs, bound {band}"));
        }
    };
    for axes in [1, 2] {
        for (case, share, bands) in BANDS {
            let force = along(axes, share * sliding);
            let forces = force.iter().map(|f| Drive::Force(*f)).collect();
            let (by_force, pairs) = joint.step(None, forces);
            hold(
                format!("{case}, {axes} axes, force"),
                pairs,
                bands[axes + 1],
            );
            let displacement = moved_by(&by_force.displacement);
            let (found, pairs) = joint.step(None, displacement);
            hold(format!("{case}, {axes} axes"), pairs, bands[axes - 1]);
            assert!((found.force[0] / force[0] - 1.0).abs() < 1e-3, "{case}");
            if share == 0.6 {
                let back: Vec<f64> = by_force.displacement.iter().map(|d| -1.2 * d).collect();
                let (_, pairs) = joint.step(Some(&by_force.shear), moved_by(&back));
                hold(format!("reversal, {axes} axes"), pairs, REVERSAL[axes - 1]);
            }
        }
        let far = moved_by(&along(axes, 50e-6));
        let (found, pairs) = joint.step(None, far);
        hold(format!("sliding, {axes} axes"), pairs, SLIDING[axes - 1]);
        let force = found.force.iter().map(|f| f * f).sum::<f64>().sqrt();
        assert!((force / sliding - 1.0).abs() < 1e-3);
    }
    assert!(over.is_empty(), "{}", over.join("\n"));
}
