//! Comparison of the solvers with closed forms, on a coarse grid. A comparison takes milliseconds. The error of a
//! comparison is the discretisation error.
//!
//! The cells are not square and the two bodies differ, so that exchanged axes or bodies are detected. The error of a
//! field is ‖computed − exact‖₂/‖exact‖₂. `tests/doctor/orders.rs` solves the same cases on finer grids and fits the
//! orders of convergence.

use std::f64::consts::{PI, TAU};

use super::Check;
use super::machine::{REBUILD, with_tolerance};
use crate::contact::normal::{self, NormalOptions, NormalProblem, NormalSolution};
use crate::contact::tangential::{self, CellState, Drive, TangentialOptions, TangentialProblem};
use crate::contact::{Boundary, ContactError, Elastic, HalfSpace, Pair, Shear, stiffness};
use crate::dynamics::oscillator::mass_on_springs;
use crate::dynamics::{
    BalanceSettings, ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Harmonics,
    Oscillator, Slider,
};
use crate::grid::{Grid, Patch};
use crate::reference::{
    CappedHertz, CattaneoMindlin, CircularPunch, Jenkins, JenkinsOscillator, Westergaard, elastic,
};

/// Resolution of a case.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Refinement factor n: a contact has 26 n × 20 n cells, and a vibration has 32 n samples per cycle.
    pub refinement: usize,
    /// Offset of the contact's centre from a corner of the cells, in cells along x and y.
    pub placement: (f64, f64),
}

/// Resolution of the doctor: 52 × 40 cells, 64 samples.
pub const RESOLUTION: Resolution = Resolution {
    refinement: 2,
    placement: (0.26, 0.71),
};

/// A computed quantity and its exact value, in SI units. For a field, the computed and the exact value are root mean
/// squares.
#[derive(Debug, Clone, PartialEq)]
pub struct Measure {
    /// Names of the closed form and the quantity.
    pub name: &'static str,
    /// Computed value.
    pub computed: f64,
    /// Exact value.
    pub exact: f64,
    /// Relative error.
    pub error: f64,
    /// Largest accepted error at [`RESOLUTION`]: twice the root mean square over placements. `None` if the doctor does
    /// not report the quantity.
    pub tolerance: Option<f64>,
}

impl Measure {
    /// Compares one number.
    pub fn value(name: &'static str, computed: f64, exact: f64) -> Measure {
        Measure::field(name, &[computed], &[exact])
    }

    fn field(name: &'static str, computed: &[f64], exact: &[f64]) -> Measure {
        let norm = |value: &dyn Fn(usize) -> f64| {
            let squares: f64 = (0..exact.len()).map(|c| value(c).powi(2)).sum();
            (squares / exact.len() as f64).sqrt()
        };
        let scale = norm(&|c| exact[c]);
        Measure {
            name,
            computed: norm(&|c| computed[c]),
            exact: scale,
            error: norm(&|c| computed[c] - exact[c]) / scale,
            tolerance: None,
        }
    }

    /// Sets the tolerance, with which the doctor reports the measure.
    pub fn within(self, tolerance: f64) -> Measure {
        let tolerance = Some(tolerance);
        Measure { tolerance, ..self }
    }

    /// Checks that the error is within the tolerance. Returns `None` without a tolerance.
    pub fn check(&self) -> Option<Check> {
        let (tolerance, error) = (self.tolerance?, self.error);
        let (computed, exact) = (self.computed, self.exact);
        let description = format!(
            "computed {computed:.5e}, exact {exact:.5e}: relative error {error:.1e}, tolerance {tolerance:.1e}"
        );
        let check = Check::ok(self.name, description)
            .number("computed", computed)
            .number("exact", exact)
            .number("relative_error", error)
            .number("tolerance", tolerance);
        Some(with_tolerance(check, error, tolerance))
    }
}

/// Error of a solve that did not converge.
#[derive(Debug, thiserror::Error)]
pub enum CaseError {
    /// Error of a contact solve.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// Error of a vibration solve.
    #[error(transparent)]
    Dynamics(#[from] DynamicsError),
}

type Measures = Result<Vec<Measure>, CaseError>;

/// Name of a closed form, and the function that compares a solve with it.
pub type Case = (&'static str, fn(Resolution) -> Measures);

/// All closed forms.
pub const CASES: [Case; 6] = [
    ("Hertz", hertz),
    ("circular punch", circular_punch),
    ("capped Hertz", capped_hertz),
    ("Westergaard", westergaard),
    ("Cattaneo-Mindlin", cattaneo_mindlin),
    ("Jenkins oscillator", jenkins_oscillator),
];

/// Returns a check for each measure with a tolerance, and for each failed solve.
pub(super) fn checks() -> Vec<Check> {
    let checks_of = |(name, measure): Case| match measure(RESOLUTION) {
        Ok(measures) => measures.iter().filter_map(Measure::check).collect(),
        Err(error) => vec![Check::failed(name, error.to_string(), REBUILD)],
    };
    CASES.into_iter().flat_map(checks_of).collect()
}

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

const SPHERE: CattaneoMindlin = CattaneoMindlin {
    radius: 0.05,
    load: 320.0,
    friction_coefficient: 0.6,
    pair: PAIR,
};

/// Tolerance of the normal solves. The tolerances of the normal and tangential solves are below the error of the finest
/// grid of the tests.
const NORMAL_TOLERANCE: f64 = 1e-8;
const TANGENTIAL_TOLERANCE: f64 = 1e-6;

/// A grid, and the centre of the closed form relative to the centre of the grid \[m\].
#[derive(Clone, Copy)]
struct Plane {
    grid: Grid,
    centre: (f64, f64),
}

impl Plane {
    fn new(at: Resolution, size: [f64; 2]) -> Plane {
        let grid = Grid::over(size, [26 * at.refinement, 20 * at.refinement]);
        let (x, y) = at.placement;
        let centre = (x * grid.dx, y * grid.dy);
        Plane { grid, centre }
    }

    /// Evaluates a field at x and y relative to the centre \[m\].
    fn field<T>(self, value: impl Fn(f64, f64) -> T) -> Vec<T> {
        let of_cell = |index| {
            let (i, j) = self.grid.cell(index);
            let (x, y) = self.grid.centre(i, j);
            value(x - self.centre.0, y - self.centre.1)
        };
        (0..self.grid.len()).map(of_cell).collect()
    }

    fn radial(self, value: impl Fn(f64) -> f64) -> Vec<f64> {
        self.field(|x, y| value(x.hypot(y)))
    }

    /// Returns the radius of the circle with the same area as the cells that satisfy `condition` \[m\].
    fn radius<T: Copy>(self, field: &[T], condition: impl Fn(T) -> bool) -> f64 {
        let cells = field.iter().filter(|value| condition(**value)).count();
        (cells as f64 * self.grid.cell_area() / PI).sqrt()
    }
}

fn normal_options() -> NormalOptions {
    NormalOptions {
        tolerance: NORMAL_TOLERANCE,
        ..NormalOptions::default()
    }
}

/// Presses the sphere on a plane that is large enough for a contact of radius `contact_radius`.
fn press_sphere(
    at: Resolution,
    contact_radius: f64,
    pressure_cap: Option<f64>,
) -> Result<(Plane, HalfSpace, NormalSolution), ContactError> {
    let plane = Plane::new(at, [2.8 * contact_radius, 2.5 * contact_radius]);
    let patch = Patch::full(plane.grid);
    let height = plane.radial(|r| -0.5 * r * r / SPHERE.radius);
    let problem = NormalProblem {
        pressure_cap,
        ..NormalProblem::new(&patch, &height, SPHERE.load)
    };
    let mut half_space = HalfSpace::new(plane.grid, PAIR, Boundary::Free);
    let solution = normal::solve(&mut half_space, &problem, None, normal_options())?;
    Ok((plane, half_space, solution))
}

fn hertz(at: Resolution) -> Measures {
    let exact = SPHERE.hertz();
    let a = exact.contact_radius();
    let (plane, mut half_space, solution) = press_sphere(at, a, None)?;
    let contact_cells: Vec<bool> = solution.pressure.iter().map(|p| *p > 0.0).collect();
    let kn = stiffness::normal(&mut half_space, &contact_cells)?.total;
    let peak = solution.pressure.iter().copied().fold(0.0, f64::max);
    let pressure = plane.radial(|r| exact.pressure(r));
    let gap = plane.radial(|r| exact.gap(r));
    Ok(vec![
        Measure::value(
            "Hertz: contact radius",
            plane.radius(&contact_cells, |is_in| is_in),
            a,
        ),
        Measure::value("Hertz: approach", solution.approach, exact.approach()).within(2.6e-4),
        Measure::value("Hertz: peak pressure", peak, exact.peak_pressure()).within(6.6e-4),
        Measure::field("Hertz: pressure field", &solution.pressure, &pressure),
        Measure::field("Hertz: gap field", &solution.gap, &gap),
        Measure::value("Hertz: normal stiffness", kn, exact.normal_stiffness()).within(2.4e-3),
    ])
}

/// Compares a flat circular region that sticks, with transverse motion absent or free.
fn circular_punch(at: Resolution) -> Measures {
    let exact = CircularPunch {
        radius: 2.0e-3,
        pair: PAIR,
    };
    let plane = Plane::new(at, [4.4e-3, 4.1e-3]);
    let set = plane.field(|x, y| x.hypot(y) < exact.radius);
    let mut half_space = HalfSpace::new(plane.grid, PAIR, Boundary::Free);
    let kn = stiffness::normal(&mut half_space, &set)?.total;
    let along_x = stiffness::tangential(&mut half_space, &set, Shear::AlongX)?.total;
    let in_plane = stiffness::tangential(&mut half_space, &set, Shear::InPlane)?.total;
    let (exact_kn, kt) = (exact.normal_stiffness(), exact.tangential_stiffness());
    Ok(vec![
        Measure::value("circular punch: normal stiffness", kn, exact_kn).within(1.1e-2),
        Measure::value("circular punch: stiffness along x", along_x, kt).within(1.1e-2),
        Measure::value("circular punch: stiffness in plane", in_plane, kt),
    ])
}

/// Compares the pressed sphere with the reference, both with pressures of at most 0.7 times the elastic peak. The
/// reference is an axisymmetric solution on rings that are 16 times finer.
fn capped_hertz(at: Resolution) -> Measures {
    let sphere = SPHERE.hertz();
    let cap = 0.7 * sphere.peak_pressure();
    let exact = CappedHertz {
        radius: sphere.radius,
        load: sphere.load,
        effective_modulus: sphere.effective_modulus,
        cap,
    }
    .solve(150 * at.refinement)?;
    let (a, b) = (exact.contact_radius, exact.plateau_radius);
    let (plane, _, solution) = press_sphere(at, a, Some(cap))?;
    let contact = plane.radius(&solution.pressure, |p| p > 0.0);
    let plateau = plane.radius(&solution.pressure, |p| p >= cap);
    let pressure = plane.radial(|r| exact.pressure_at(r));
    Ok(vec![
        Measure::value("capped Hertz: contact radius", contact, a),
        Measure::value("capped Hertz: plateau radius", plateau, b).within(1.9e-2),
        Measure::value("capped Hertz: approach", solution.approach, exact.approach).within(2.7e-4),
        Measure::field(
            "capped Hertz: pressure field",
            &solution.pressure,
            &pressure,
        ),
    ])
}

/// Compares a periodic wavy surface under 0.3 of the pressure that closes it.
fn westergaard(at: Resolution) -> Measures {
    let mut exact = Westergaard {
        wavelength: 1.3e-3,
        amplitude: 0.8e-6,
        mean_pressure: 0.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    exact.mean_pressure = 0.3 * exact.full_contact_pressure();
    let mut plane = Plane::new(at, [exact.wavelength, 0.31e-3]);
    // The waves run along x, so few cells along y are enough.
    plane.grid = Grid::over(plane.grid.size(), [plane.grid.nx, 3]);
    let patch = Patch::full(plane.grid);
    let wave = |x: f64| exact.amplitude * ((TAU * x / exact.wavelength).cos() - 1.0);
    let height = plane.field(|x, _| wave(x));
    let problem = NormalProblem::new(&patch, &height, exact.mean_pressure * patch.area());
    let mut half_space = HalfSpace::new(plane.grid, PAIR, Boundary::Periodic);
    let solution = normal::solve(&mut half_space, &problem, None, normal_options())?;
    let cells = height.len() as f64;
    let area = solution.pressure.iter().filter(|p| **p > 0.0).count() as f64 / cells;
    let mean_gap = solution.gap.iter().sum::<f64>() / cells;
    let pressure = plane.field(|x, _| exact.pressure(x));
    let gap = plane.field(|x, _| exact.gap(x));
    Ok(vec![
        Measure::value("Westergaard: area fraction", area, exact.area_fraction()),
        Measure::value("Westergaard: mean gap", mean_gap, exact.mean_gap()).within(8.2e-4),
        Measure::field("Westergaard: pressure field", &solution.pressure, &pressure),
        Measure::field("Westergaard: gap field", &solution.gap, &gap),
    ])
}

/// Compares the sphere moved by 0.6 of the displacement of full sliding, then through a full cycle, without transverse
/// traction.
fn cattaneo_mindlin(at: Resolution) -> Measures {
    let (plane, mut half_space, pressed) = press_sphere(at, SPHERE.hertz().contact_radius(), None)?;
    let patch = Patch::full(plane.grid);
    let limit: Vec<f64> = pressed
        .pressure
        .iter()
        .map(|p| SPHERE.friction_coefficient * p)
        .collect();
    let mut step = |previous: Option<&Vec<Vec<f64>>>, stroke: f64| {
        let problem = TangentialProblem {
            patch: &patch,
            limit: &limit,
            previous,
            drive: &vec![Drive::Displacement(stroke)],
            rotation: None,
            offset: None,
        };
        let options = TangentialOptions {
            tolerance: TANGENTIAL_TOLERANCE,
            ..TangentialOptions::default()
        };
        tangential::solve(&mut half_space, &problem, None, options)
    };
    let amplitude = 0.6 * SPHERE.sliding_displacement();
    let loaded = step(None, amplitude)?;
    let back = step(Some(&loaded.shear), -2.0 * amplitude)?;
    let forth = step(Some(&back.shear), 2.0 * amplitude)?;
    let force = SPHERE.force(amplitude);
    let stick = plane.radius(&loaded.state, |state| state == CellState::Stick);
    let exact_stick = SPHERE.stick_radius(force);
    let energy = back.dissipation + forth.dissipation;
    let exact_energy = SPHERE.energy_per_cycle(amplitude);
    let shear = plane.radial(|r| SPHERE.traction(force, r));
    let slip = plane.field(|x, y| SPHERE.slip(force, x, y));
    Ok(vec![
        Measure::value("Cattaneo-Mindlin: force", loaded.force[0], force).within(4e-5),
        Measure::value("Cattaneo-Mindlin: stick radius", stick, exact_stick),
        Measure::field("Cattaneo-Mindlin: shear field", &loaded.shear[0], &shear),
        Measure::field("Cattaneo-Mindlin: slip field", &loaded.slip[0], &slip),
        Measure::value("Cattaneo-Mindlin: energy per cycle", energy, exact_energy).within(2.2e-3),
    ])
}

/// Compares the computed phase resonance of a mass on a Jenkins element with the exact one. The mass vibrates at about
/// six times the displacement at which the Jenkins element begins to slide.
fn jenkins_oscillator(at: Resolution) -> Measures {
    const FORCE: f64 = 80.0;
    let exact = JenkinsOscillator {
        mass: 1.5,
        damping: 300.0,
        stiffness: 4.0e7,
        contact: Jenkins {
            stiffness: 2.5e7,
            limit: 54.0,
        },
    };
    let element = ContactElement {
        springs: Vec::new(),
        area: 1e-6,
        friction_coefficient: 0.6,
        law: FrictionLaw::default(),
        sliders: vec![Slider {
            normal_load: exact.contact.limit / 0.6,
            gap: 0.0,
            tangential_stiffness: exact.contact.stiffness,
            normal_stiffness: 3.5e7,
        }],
    };
    let [mass, damping, stiffness] = [exact.mass, exact.damping, exact.stiffness].map(|k| [k; 3]);
    let balance = HarmonicBalance::new(
        &mass_on_springs(mass, damping, stiffness, 3)?,
        vec![element],
        Harmonics::up_to(1),
        vec![Oscillator::load(0, FORCE, 0.0)],
        BalanceSettings {
            samples: 32 * at.refinement,
            ..BalanceSettings::default()
        },
    )?;
    let resonance = balance.phase_resonance((4000.0, 7500.0), None)?;
    let (amplitude, _) = balance.amplitude(&resonance, 0)?;
    let (force, omega) = (exact.resonant_force(amplitude), exact.backbone(amplitude));
    // Tolerances are twice the errors with 64 samples, which cut the corners of the loop.
    Ok(vec![
        Measure::value("Jenkins oscillator: force", FORCE, force).within(6e-4),
        Measure::value(
            "Jenkins oscillator: angular frequency",
            resonance.omega,
            omega,
        )
        .within(3.2e-5),
    ])
}
