//! The solvers against closed forms at several resolutions: errors and orders of convergence.
//!
//! Every case has cells that are not square. Errors are relative; that of a field is ‖found − exact‖₂/‖exact‖₂ over the cells.
//! Where an edge of contact cuts the cells decides much of the error on one grid, so every grid is tried with the centre of the
//! closed form at several places within a cell, and the root mean square error over these has a clean order.

mod backbone;

use std::f64::consts::PI;

use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::tangential::{self, CellState, Drive, TangentialOptions, TangentialProblem};
use crate::contact::{Boundary, ContactError, Elastic, HalfSpace, Pair, Shear, stiffness};
use crate::dynamics::DynamicsError;
use crate::grid::{Grid, Patch};
use crate::reference::{CappedHertz, CattaneoMindlin, CircularPunch, Hertz, Westergaard, elastic};

/// One quantity on one grid.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Row {
    /// The closed form.
    pub case: &'static str,
    /// What is compared.
    pub quantity: &'static str,
    /// Unit of `computed` and `exact`.
    pub unit: &'static str,
    /// Cells along x and y; of a vibration samples of a cycle, and levels of the force.
    pub grid: [usize; 2],
    /// Computed value; of a field, its root mean square. The mean over the placements.
    pub computed: f64,
    /// Exact value; of a field, its root mean square. The mean over the placements.
    pub exact: f64,
    /// Relative error: the root mean square over the placements.
    pub relative_error: f64,
    /// [`fitted_order`] over all grids of this case and quantity, the same on each of its rows; none where the error is rounding.
    pub order: Option<f64>,
}

/// Errors below this are the solvers' tolerances rather than the grid's: no order is fitted to them.
const TOLERANCE_FLOOR: f64 = 1e-6;

/// Normal solves are converged beyond the discretisation error of the finest grid.
const NORMAL: f64 = 1e-8;

/// Relative duality gap of the tangential solves: the energy of a cycle is good to about this.
const TANGENTIAL: f64 = 1e-6;

/// The coarsest grid and the factors by which it is refined.
const CELLS: [usize; 2] = [26, 20];
const REFINEMENTS: [usize; 4] = [1, 2, 4, 8];

/// Where the centre of the closed form lies from a corner of the cells, in cells: an additive recurrence, evenly spread.
const PLACEMENTS: [(f64, f64); 6] = [
    (0.0, 0.0),
    (0.75, 0.57),
    (0.51, 0.14),
    (0.26, 0.71),
    (0.02, 0.28),
    (0.77, 0.85),
];

/// Two different bodies, so that both count.
const PAIR: Pair = Pair {
    lower: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
    upper: Elastic {
        youngs_modulus: 71.0e9,
        poisson_ratio: 0.34,
    },
};

const RADIUS: f64 = 0.05;
const LOAD: f64 = 320.0;
const FRICTION_COEFFICIENT: f64 = 0.6;

/// Runs every case. Rows come case by case, quantity by quantity, from the coarsest grid to the finest.
///
/// # Errors
/// [`ValidateError`] of a solve that did not converge.
pub fn run() -> Result<Vec<Row>, ValidateError> {
    let cases = [hertz, punch, capped_hertz, westergaard, cattaneo_mindlin];
    let mut rows = Vec::new();
    for case in cases {
        rows.extend(case()?);
    }
    rows.extend(backbone::jenkins_oscillator()?);
    Ok(rows)
}

/// A solve that did not converge.
#[derive(Debug, thiserror::Error)]
pub enum ValidateError {
    /// Of the contact.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Of the vibration.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
}

/// Least-squares slope of log error over log cell width: the order of convergence. None for fewer than two points, or with an
/// error that is not positive.
pub fn fitted_order(widths: &[f64], errors: &[f64]) -> Option<f64> {
    let count = widths.len().min(errors.len());
    let positive = errors.iter().all(|e| *e > 0.0);
    if count < 2 || !positive {
        return None;
    }
    let logs: Vec<(f64, f64)> = widths
        .iter()
        .zip(errors)
        .map(|(h, e)| (h.ln(), e.ln()))
        .collect();
    let mean = |pick: fn(&(f64, f64)) -> f64| logs.iter().map(pick).sum::<f64>() / count as f64;
    let (mean_h, mean_e) = (mean(|l| l.0), mean(|l| l.1));
    let above: f64 = logs.iter().map(|(h, e)| (h - mean_h) * (e - mean_e)).sum();
    let below: f64 = logs.iter().map(|(h, _)| (h - mean_h).powi(2)).sum();
    (below > 0.0).then(|| above / below)
}

/// Hertz: contact radius, approach, peak pressure, pressure and gap fields, normal stiffness.
pub fn hertz() -> Result<Vec<Row>, ContactError> {
    let exact = Hertz {
        radius: RADIUS,
        load: LOAD,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    let a = exact.contact_radius();
    refine("Hertz", [2.8 * a, 2.5 * a], |grid, apex| {
        let (mut half_space, solution) = sphere(grid, apex, None)?;
        let (set, radius) = contact(grid, &solution.pressure);
        let kn = stiffness::normal(&mut half_space, &set)?.total;
        let peak = solution.pressure.iter().copied().fold(0.0, f64::max);
        Ok(vec![
            Measure::value("contact radius", "m", radius, a),
            Measure::value("approach", "m", solution.approach, exact.approach()),
            Measure::value("peak pressure", "Pa", peak, exact.peak_pressure()),
            Measure::field(
                "pressure field",
                "Pa",
                &solution.pressure,
                &radial(grid, apex, |r| exact.pressure(r)),
            ),
            Measure::field(
                "gap field",
                "m",
                &solution.gap,
                &radial(grid, apex, |r| exact.gap(r)),
            ),
            Measure::value("normal stiffness", "N/m", kn, exact.normal_stiffness()),
        ])
    })
}

/// A flat circular region that sticks: normal and tangential stiffness, transverse motion held or absent.
pub fn punch() -> Result<Vec<Row>, ContactError> {
    let exact = CircularPunch {
        radius: 2.0e-3,
        pair: PAIR,
    };
    refine("circular punch", [4.4e-3, 4.1e-3], |grid, centre| {
        let set: Vec<bool> = (0..grid.len())
            .map(|index| distance(grid, centre, index) < exact.radius)
            .collect();
        let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Free);
        let kn = stiffness::normal(&mut half_space, &set)?.total;
        let along_x = stiffness::tangential(&mut half_space, &set, Shear::AlongX)?.total;
        let in_plane = stiffness::tangential(&mut half_space, &set, Shear::InPlane)?.total;
        Ok(vec![
            Measure::value("normal stiffness", "N/m", kn, exact.normal_stiffness()),
            Measure::value(
                "tangential stiffness, along x",
                "N/m",
                along_x,
                exact.tangential_stiffness(),
            ),
            Measure::value(
                "tangential stiffness, in plane",
                "N/m",
                in_plane,
                exact.tangential_stiffness(),
            ),
        ])
    })
}

/// The Hertz contact with its pressure capped at 0.7 of the elastic peak, against the axisymmetric solution on fine rings.
pub fn capped_hertz() -> Result<Vec<Row>, ContactError> {
    /// Rings over the contact: an order of magnitude finer than the finest grid, where their own error is below 1e-5.
    const RINGS: usize = 1200;
    let effective_modulus = elastic::effective_modulus(&PAIR);
    let cap = 0.7
        * Hertz {
            radius: RADIUS,
            load: LOAD,
            effective_modulus,
        }
        .peak_pressure();
    let exact = CappedHertz {
        radius: RADIUS,
        load: LOAD,
        effective_modulus,
        cap,
    }
    .solve(RINGS)?;
    let a = exact.contact_radius;
    refine("capped Hertz", [2.8 * a, 2.5 * a], |grid, apex| {
        let (_, solution) = sphere(grid, apex, Some(cap))?;
        let (_, radius) = contact(grid, &solution.pressure);
        let plateau: Vec<f64> = solution
            .pressure
            .iter()
            .map(|&p| if p >= cap { 1.0 } else { 0.0 })
            .collect();
        let load = solution.pressure.iter().sum::<f64>() * grid.cell_area();
        Ok(vec![
            Measure::value("contact radius", "m", radius, a),
            Measure::value(
                "plateau radius",
                "m",
                contact(grid, &plateau).1,
                exact.plateau_radius,
            ),
            Measure::value("approach", "m", solution.approach, exact.approach),
            Measure::field(
                "pressure field",
                "Pa",
                &solution.pressure,
                &radial(grid, apex, |r| exact.pressure_at(r)),
            ),
            Measure::value("load", "N", load, LOAD),
        ])
    })
}

/// A wavy surface under 0.3 of the pressure that closes it, periodic.
pub fn westergaard() -> Result<Vec<Row>, ContactError> {
    let mut exact = Westergaard {
        wavelength: 1.3e-3,
        amplitude: 0.8e-6,
        mean_pressure: 0.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    exact.mean_pressure = 0.3 * exact.full_contact_pressure();
    // The waves run along x: few cells along y are enough.
    refine("Westergaard", [exact.wavelength, 0.31e-3], |fine, crest| {
        let grid = Grid::over(fine.size(), [fine.nx, 3]);
        let patch = Patch::full(grid);
        let along = |profile: &dyn Fn(f64) -> f64| -> Vec<f64> {
            (0..grid.len())
                .map(|index| profile(from(grid, crest, index).0))
                .collect()
        };
        let height = along(&|x| exact.amplitude * ((2.0 * PI * x / exact.wavelength).cos() - 1.0));
        let load = exact.mean_pressure * patch.area();
        let problem = NormalProblem {
            patch: &patch,
            height: &height,
            compliance: None,
            control: Control::Load(load),
            rotation: Rotation::FIXED,
            pressure_cap: None,
        };
        let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Periodic);
        let solution = normal::solve(&mut half_space, &problem, None, normal_options())?;
        let cells = grid.len() as f64;
        let touching = solution.pressure.iter().filter(|p| **p > 0.0).count() as f64 / cells;
        let mean_gap = solution.gap.iter().sum::<f64>() / cells;
        Ok(vec![
            Measure::value("area fraction", "1", touching, exact.area_fraction()),
            Measure::value("mean gap", "m", mean_gap, exact.mean_gap()),
            Measure::field(
                "pressure field",
                "Pa",
                &solution.pressure,
                &along(&|x| exact.pressure(x)),
            ),
            Measure::field("gap field", "m", &solution.gap, &along(&|x| exact.gap(x))),
        ])
    })
}

/// Cattaneo and Mindlin: loading to 0.6 of the displacement of full sliding, then a full cycle; transverse traction absent.
pub fn cattaneo_mindlin() -> Result<Vec<Row>, ContactError> {
    let exact = CattaneoMindlin {
        radius: RADIUS,
        load: LOAD,
        friction_coefficient: FRICTION_COEFFICIENT,
        pair: PAIR,
    };
    let amplitude = 0.6 * exact.sliding_displacement();
    let force = exact.force(amplitude);
    let a = exact.hertz().contact_radius();
    refine("Cattaneo-Mindlin", [2.8 * a, 2.5 * a], |grid, apex| {
        let (mut half_space, solution) = sphere(grid, apex, None)?;
        let patch = Patch::full(grid);
        let limit: Vec<f64> = solution
            .pressure
            .iter()
            .map(|p| FRICTION_COEFFICIENT * p)
            .collect();
        let mut branch = |previous: Option<&Vec<Vec<f64>>>, stroke: f64| {
            let drive = vec![Drive::Displacement(stroke)];
            let problem = TangentialProblem {
                patch: &patch,
                limit: &limit,
                previous,
                drive: &drive,
                rotation: None,
                offset: None,
            };
            let options = TangentialOptions {
                tolerance: TANGENTIAL,
                ..TangentialOptions::default()
            };
            tangential::solve(&mut half_space, &problem, None, options)
        };
        let loaded = branch(None, amplitude)?;
        let back = branch(Some(&loaded.shear), -2.0 * amplitude)?;
        let forth = branch(Some(&back.shear), 2.0 * amplitude)?;
        let stuck: Vec<f64> = loaded
            .state
            .iter()
            .map(|s| if *s == CellState::Stick { 1.0 } else { 0.0 })
            .collect();
        let slip = |grid: Grid| -> Vec<f64> {
            (0..grid.len())
                .map(|index| {
                    let (x, y) = from(grid, apex, index);
                    exact.slip(force, x, y)
                })
                .collect()
        };
        Ok(vec![
            Measure::value("force", "N", loaded.force[0], force),
            Measure::value(
                "stick radius",
                "m",
                contact(grid, &stuck).1,
                exact.stick_radius(force),
            ),
            Measure::field(
                "shear field",
                "Pa",
                &loaded.shear[0],
                &radial(grid, apex, |r| exact.traction(force, r)),
            ),
            Measure::field("slip field", "m", &loaded.slip[0], &slip(grid)),
            Measure::value(
                "energy per cycle",
                "J",
                back.dissipation + forth.dissipation,
                exact.energy_per_cycle(amplitude),
            ),
        ])
    })
}

/// A quantity on one grid, before an order is known.
#[derive(Clone, Copy)]
struct Measure {
    quantity: &'static str,
    unit: &'static str,
    computed: f64,
    exact: f64,
    error: f64,
}

impl Measure {
    fn value(quantity: &'static str, unit: &'static str, computed: f64, exact: f64) -> Self {
        Measure {
            quantity,
            unit,
            computed,
            exact,
            error: (computed / exact - 1.0).abs(),
        }
    }

    fn field(quantity: &'static str, unit: &'static str, computed: &[f64], exact: &[f64]) -> Self {
        let square = |f: &dyn Fn(usize) -> f64| (0..exact.len()).map(|c| f(c) * f(c)).sum::<f64>();
        let scale = (square(&|c| exact[c]) / exact.len() as f64).sqrt();
        let error = (square(&|c| computed[c] - exact[c]) / exact.len() as f64).sqrt() / scale;
        let computed = (square(&|c| computed[c]) / exact.len() as f64).sqrt();
        Measure {
            quantity,
            unit,
            computed,
            exact: scale,
            error,
        }
    }
}

/// Measures on every refinement of a rectangle of `size` and at every placement, and fits the orders.
fn refine(
    case: &'static str,
    size: [f64; 2],
    measure: impl Fn(Grid, (f64, f64)) -> Result<Vec<Measure>, ContactError>,
) -> Result<Vec<Row>, ContactError> {
    let grids: Vec<Grid> = REFINEMENTS
        .iter()
        .map(|k| Grid::over(size, CELLS.map(|n| n * k)))
        .collect();
    let mut measures = Vec::new();
    for grid in &grids {
        let placed = PLACEMENTS
            .iter()
            .map(|(x, y)| measure(*grid, (x * grid.dx, y * grid.dy)));
        measures.push(mean_over_placements(placed.collect::<Result<Vec<_>, _>>()?));
    }
    let widths: Vec<f64> = grids.iter().map(|grid| grid.dx).collect();
    let cells: Vec<[usize; 2]> = grids.iter().map(|grid| [grid.nx, grid.ny]).collect();
    Ok(rows_of(case, &cells, &widths, &measures))
}

/// The rows of a case, with the orders over its grids.
fn rows_of(
    case: &'static str,
    grids: &[[usize; 2]],
    widths: &[f64],
    measures: &[Vec<Measure>],
) -> Vec<Row> {
    let mut rows = Vec::new();
    for quantity in 0..measures[0].len() {
        let errors: Vec<f64> = measures.iter().map(|m| m[quantity].error).collect();
        let resolved = errors.iter().all(|e| *e > TOLERANCE_FLOOR);
        let order = if resolved {
            fitted_order(widths, &errors)
        } else {
            None
        };
        for (grid, on_grid) in grids.iter().zip(measures) {
            let Measure {
                quantity,
                unit,
                computed,
                exact,
                error,
            } = on_grid[quantity];
            rows.push(Row {
                case,
                quantity,
                unit,
                grid: *grid,
                computed,
                exact,
                relative_error: error,
                order,
            });
        }
    }
    rows
}

fn mean_over_placements(placed: Vec<Vec<Measure>>) -> Vec<Measure> {
    let mean = |quantity: usize, pick: fn(&Measure) -> f64| {
        placed
            .iter()
            .map(|measures| pick(&measures[quantity]))
            .sum::<f64>()
            / placed.len() as f64
    };
    placed[0]
        .iter()
        .enumerate()
        .map(|(quantity, first)| Measure {
            computed: mean(quantity, |m| m.computed),
            exact: mean(quantity, |m| m.exact),
            error: mean(quantity, |m| m.error * m.error).sqrt(),
            ..*first
        })
        .collect()
}

fn normal_options() -> NormalOptions {
    NormalOptions {
        tolerance: NORMAL,
        ..NormalOptions::default()
    }
}

/// The sphere pressed with its apex at `apex`.
fn sphere(
    grid: Grid,
    apex: (f64, f64),
    pressure_cap: Option<f64>,
) -> Result<(HalfSpace, NormalSolution), ContactError> {
    let patch = Patch::full(grid);
    let height = radial(grid, apex, |r| -0.5 * r * r / RADIUS);
    let problem = NormalProblem {
        patch: &patch,
        height: &height,
        compliance: None,
        control: Control::Load(LOAD),
        rotation: Rotation::FIXED,
        pressure_cap,
    };
    let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Free);
    let solution = normal::solve(&mut half_space, &problem, None, normal_options())?;
    Ok((half_space, solution))
}

/// The cells where a field is positive, and the radius of the circle of their area.
fn contact(grid: Grid, field: &[f64]) -> (Vec<bool>, f64) {
    let set: Vec<bool> = field.iter().map(|f| *f > 0.0).collect();
    let area = set.iter().filter(|&&s| s).count() as f64 * grid.cell_area();
    (set, (area / PI).sqrt())
}

/// Where a cell lies from `origin`, itself measured from the grid's centre \[m\].
fn from(grid: Grid, origin: (f64, f64), index: usize) -> (f64, f64) {
    let (i, j) = grid.cell(index);
    let (x, y) = grid.centre(i, j);
    (x - origin.0, y - origin.1)
}

fn distance(grid: Grid, origin: (f64, f64), index: usize) -> f64 {
    let (x, y) = from(grid, origin, index);
    x.hypot(y)
}

fn radial(grid: Grid, origin: (f64, f64), profile: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..grid.len())
        .map(|index| profile(distance(grid, origin, index)))
        .collect()
}
