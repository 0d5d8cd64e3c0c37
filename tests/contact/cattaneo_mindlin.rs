use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::tangential::{
    self, CellState, Drive, TangentialOptions, TangentialSolution,
};
use fretwear::contact::{Boundary, ContactError, HalfSpace, Pair};
use fretwear::grid::{ByAxis, Grid, Patch};
use fretwear::reference::CattaneoMindlin;

use super::{PAIR, distance, limit_of, moved_by, paraboloid, relative_l2, sheared};

/// The sphere on a grid with about 16 cells per contact radius and an apex outside the centre.
struct Sphere {
    exact: CattaneoMindlin,
    patch: Patch,
    half_space: HalfSpace,
    apex: (f64, f64),
    limit: Vec<f64>,
}

impl Sphere {
    fn pressed(pair: Pair) -> Self {
        let exact = CattaneoMindlin {
            radius: 0.05,
            load: 320.0,
            friction_coefficient: 0.6,
            pair,
        };
        let a = exact.hertz().contact_radius();
        let apex = (0.07 * a, -0.11 * a);
        let patch = Patch::full(Grid::over([2.5 * a, 2.6 * a], [40, 33]));
        let mut half_space = HalfSpace::new(patch.grid, pair, Boundary::Free);
        let height = paraboloid(patch.grid, exact.radius, apex);
        let problem = NormalProblem::new(&patch, &height, exact.load);
        let solution =
            normal::solve(&mut half_space, &problem, None, NormalOptions::default()).unwrap();
        let limit = limit_of(exact.friction_coefficient, &solution.pressure);
        Sphere {
            exact,
            patch,
            half_space,
            apex,
            limit,
        }
    }

    fn step(
        &mut self,
        previous: Option<&ByAxis<Vec<f64>>>,
        displacement: ByAxis<f64>,
    ) -> TangentialSolution {
        self.driven(previous, moved_by(&displacement)).unwrap()
    }

    fn driven(
        &mut self,
        previous: Option<&ByAxis<Vec<f64>>>,
        drive: ByAxis<Drive>,
    ) -> Result<TangentialSolution, ContactError> {
        let problem = sheared(&self.patch, &self.limit, previous, &drive);
        let options = TangentialOptions {
            tolerance: 1e-6,
            ..TangentialOptions::default()
        };
        tangential::solve(&mut self.half_space, &problem, None, options)
    }
}

/// Tolerances of force and energy at a/h = 16; `doctor::orders` measures errors of 1e-4 and 3e-3 at this grid.
const FORCE: f64 = 5e-4;
const ENERGY: f64 = 1e-2;

/// Tolerance of the displacement under a given force. Up to 95 % of the sliding force, the displacement is more sensitive to the rim than
/// the force.
const DISPLACEMENT: f64 = 5e-3;
/// Rounding error of a given force, relative to the force.
const ASKED: f64 = 1e-9;

#[test]
fn first_loading_has_the_stick_circle_and_the_traction() {
    let mut sphere = Sphere::pressed(PAIR);
    let exact = sphere.exact;
    let grid = sphere.patch.grid;
    for share in [0.2, 0.5, 0.8, 0.95] {
        let displacement = share * exact.sliding_displacement();
        let found = sphere.step(None, vec![displacement]);
        let force = exact.force(displacement);
        assert!(
            (found.force[0] / force - 1.0).abs() < FORCE,
            "{share}: {:e} against {force:e}",
            found.force[0]
        );
        let (c, a) = (exact.stick_radius(force), exact.hertz().contact_radius());
        for (index, state) in found.state.iter().enumerate() {
            let r = distance(grid, index, sphere.apex);
            if r < c - 1.5 * grid.dy {
                assert_eq!(*state, CellState::Stick, "{share}, r = {r:e}");
                assert_eq!(found.slip[0][index], 0.0);
            } else if r > c + 1.5 * grid.dy && r < a - 1.5 * grid.dy {
                assert_eq!(*state, CellState::Slip, "{share}, r = {r:e}");
                assert!(found.slip[0][index] > 0.0);
            }
        }
        let expected: Vec<f64> = (0..grid.len())
            .map(|k| exact.traction(force, distance(grid, k, sphere.apex)))
            .collect();
        let error = relative_l2(&found.shear[0], &expected);
        assert!(error < 6e-2, "{share}: {error:e}");
    }
}

#[test]
fn a_cycle_dissipates_the_area_of_masings_loop() {
    let mut sphere = Sphere::pressed(PAIR);
    let exact = sphere.exact;
    // Above a share of 1, the complete contact slides at the end of each stroke.
    for (share, tolerance) in [
        (0.4, 2.0 * ENERGY),
        (0.8, ENERGY),
        (1.0, ENERGY),
        (1.6, ENERGY),
    ] {
        let amplitude = share * exact.sliding_displacement();
        let loaded = sphere.step(None, vec![amplitude]);
        let back = sphere.step(Some(&loaded.shear), vec![-2.0 * amplitude]);
        let forth = sphere.step(Some(&back.shear), vec![2.0 * amplitude]);
        let expected = exact.energy_per_cycle(amplitude);
        let found = back.dissipation + forth.dissipation;
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "{share}: {found:e} against {expected:e}"
        );
        assert!(
            (back.dissipation / forth.dissipation - 1.0).abs() < 1e-4,
            "both strokes have the same dissipation"
        );
        assert!(
            relative_l2(&forth.shear[0], &loaded.shear[0]) < 1e-3,
            "the shear after a cycle differs from the shear before the cycle"
        );
        // During the return, the force is on Masing's unloading curve.
        let half_way = sphere.step(Some(&loaded.shear), vec![-0.7 * amplitude]);
        let branch = exact.unloading_force(amplitude, 0.3 * amplitude);
        assert!(
            (half_way.force[0] - branch).abs() < FORCE * exact.sliding_force(),
            "{share}"
        );
    }
}

#[test]
fn a_stroke_in_parts_ends_where_the_whole_one_does() {
    let mut sphere = Sphere::pressed(PAIR);
    let amplitude = 0.85 * sphere.exact.sliding_displacement();
    let whole = sphere.step(None, vec![amplitude]);
    let mut shear = None;
    let mut dissipation = 0.0;
    for part in [0.1, 0.25, 0.4, 0.25] {
        let next = sphere.step(shear.as_ref(), vec![part * amplitude]);
        dissipation += next.dissipation;
        shear = Some(next.shear);
    }
    assert!(relative_l2(&shear.unwrap()[0], &whole.shear[0]) < 1e-3);
    // A step computes the dissipation from the shear at its end. Cells that stick during a part of the stroke slip only at their friction
    // limit, so subdivision changes the dissipation only within the tolerance.
    assert!(
        (dissipation / whole.dissipation - 1.0).abs() < 1e-3,
        "{dissipation:e} {:e}",
        whole.dissipation
    );
}

#[test]
fn without_poissons_ratio_both_axes_give_the_one_axis_solution_in_any_direction() {
    let mut pair = PAIR;
    (pair.lower.poisson_ratio, pair.upper.poisson_ratio) = (0.0, 0.0);
    let mut sphere = Sphere::pressed(pair);
    let amplitude = 0.7 * sphere.exact.sliding_displacement();
    let alone = sphere.step(None, vec![amplitude]);
    for angle in [0.0, 0.6, 2.2_f64] {
        let (sin, cos) = angle.sin_cos();
        let turned = sphere.step(None, vec![amplitude * cos, amplitude * sin]);
        let along: Vec<f64> = turned.shear[0]
            .iter()
            .zip(&turned.shear[1])
            .map(|(x, y)| x * cos + y * sin)
            .collect();
        assert!(relative_l2(&along, &alone.shear[0]) < 1e-3, "{angle}");
        assert!(
            (turned.dissipation / alone.dissipation - 1.0).abs() < 1e-4,
            "{angle}"
        );
    }
}

#[test]
fn gross_sliding_puts_every_cell_on_its_limit() {
    let mut sphere = Sphere::pressed(PAIR);
    let amplitude = 3.0 * sphere.exact.sliding_displacement();
    let found = sphere.step(None, vec![amplitude]);
    assert!((found.force[0] / sphere.exact.sliding_force() - 1.0).abs() < 1e-6);
    assert!(found.state.iter().all(|s| *s != CellState::Stick));
    for (q, limit) in found.shear[0].iter().zip(&sphere.limit) {
        assert!((q - limit).abs() <= 1e-9 * limit);
    }
}

#[test]
fn a_given_force_moves_the_sphere_by_mindlins_displacement() {
    let mut sphere = Sphere::pressed(PAIR);
    let exact = sphere.exact;
    let pushed = |share: f64| vec![Drive::Force(share * exact.sliding_force())];
    for share in [0.02, 0.3, 0.7, 0.95] {
        let found = sphere.driven(None, pushed(share)).unwrap();
        let force = share * exact.sliding_force();
        assert!((found.force[0] / force - 1.0).abs() < ASKED, "{share}");
        assert!(found.force_error < ASKED);
        let error = found.displacement[0] / exact.displacement(force) - 1.0;
        assert!(error.abs() < DISPLACEMENT, "{share}: {error:e}");
    }
    // After a reversal, the force follows Masing's unloading curve, which is scaled by two.
    let loaded = sphere.driven(None, pushed(0.7)).unwrap();
    let back = sphere.driven(Some(&loaded.shear), pushed(-0.7)).unwrap();
    assert!((back.displacement[0] / (-2.0 * loaded.displacement[0]) - 1.0).abs() < 1e-3);
    // A force just below the friction limit has a solution; a larger force is an error.
    let nearly = sphere.driven(None, pushed(1.0 - 1e-6)).unwrap();
    assert!(nearly.displacement[0] > 0.9 * exact.sliding_displacement());
    let ContactError::FrictionExceeded { asked, limit, .. } =
        sphere.driven(None, pushed(-1.01)).unwrap_err()
    else {
        panic!("a force beyond friction");
    };
    assert!((asked / (-1.01 * exact.sliding_force()) - 1.0).abs() < ASKED);
    assert!((limit / exact.sliding_force() - 1.0).abs() < ASKED);
}
