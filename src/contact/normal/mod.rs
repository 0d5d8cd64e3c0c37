//! Frictionless normal contact, elastic or elastic–perfectly plastic.
//!
//! Find the pressure p and the rigid motion of the bodies, an approach δ and a rotation θ, with the gap g = (K + D) p −
//! h − δ − θ_x y + θ_y x, such that every kept cell is in one of three states [A eq. 4.3]:
//!
//! - An open cell has p = 0 and g ≥ 0.
//! - An elastic cell has 0 < p < p_max and g = 0.
//! - A capped cell has p = p_max and g ≤ 0.
//!
//! Either δ is given or Σ p dA = N. Either θ is given or Σ p y dA = M_x and −Σ p x dA = M_y. Alternatively the bodies
//! can move along prescribed motions (δ, θ). Each motion has a prescribed resultant Σ p (δ + θ_x y − θ_y x) dA. K is
//! the compliance of the half spaces, and h are the heights. D is an optional diagonal compliance, which the implicit
//! wear step uses. x and y are measured from the grid's centre. The solution minimises ½ pᵀ(K + D)p − (h + given
//! motions)ᵀp over the admissible pressures. The solver uses projected conjugate gradients.

mod projection;
mod rigid;
mod settle;
mod solver;

use super::error::{ContactError, check_field, check_length};
use super::half_space::HalfSpace;
use crate::grid::Patch;
use solver::Solver;

/// Normal contact problem.
#[derive(Debug, Clone, Copy)]
pub struct NormalProblem<'a> {
    /// Grid, and the cells that belong to the joint.
    pub patch: &'a Patch,
    /// Composite height: sum of the heights of both surfaces, each positive towards the other body \[m\]. The solver
    /// reads the height of kept cells only.
    pub height: &'a [f64],
    /// Diagonal compliance D, added to that of the half spaces, ≥ 0 \[m/Pa\].
    pub compliance: Option<&'a [f64]>,
    /// Control of the approach.
    pub control: Control,
    /// Control of the rotation.
    pub rotation: Rotation,
    /// Largest pressure p_max \[Pa\].
    pub pressure_cap: Option<f64>,
}

/// Control of the approach of the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Given load N ≥ 0; the solver finds the approach \[N\].
    Load(f64),
    /// Given approach δ from first touch of height 0; the solver finds the load \[m\].
    Approach(f64),
    /// Given motions along which the bodies are free. [`NormalProblem::rotation`] is then [`Rotation::FIXED`].
    Free(Freedom),
}

/// Rigid motions along which two bodies may move freely against each other: up to three independent ones.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Freedom {
    motions: [[f64; 3]; 3],
    resultants: [f64; 3],
    count: usize,
}

impl Freedom {
    /// Adds a motion and the resultant of the motion. The motion is an approach δ \[m\] with rotations θ_x and θ_y
    /// \[rad\]. The resultant is Σ p (δ + θ_x y − θ_y x) dA \[N m\].
    ///
    /// # Panics
    /// Panics on a fourth motion.
    pub fn add(&mut self, motion: [f64; 3], resultant: f64) {
        self.motions[self.count] = motion;
        self.resultants[self.count] = resultant;
        self.count += 1;
    }

    /// Returns the motions.
    pub fn motions(&self) -> &[[f64; 3]] {
        &self.motions[..self.count]
    }

    /// Returns the resultants of the motions.
    pub fn resultants(&self) -> &[f64] {
        &self.resultants[..self.count]
    }
}

/// Control of the rotation of the bodies.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rotation {
    /// Given rotations θ_x and θ_y, which add θ_x y − θ_y x to the approach; the solver finds the moments \[rad\].
    Given([f64; 2]),
    /// The bodies rotate until the pressure has the given moments.
    Free {
        /// M_x = Σ p y dA and M_y = −Σ p x dA about the grid's centre \[N m\].
        moment: [f64; 2],
    },
}

impl Rotation {
    /// No rotation.
    pub const FIXED: Rotation = Rotation::Given([0.0; 2]);
}

impl<'a> NormalProblem<'a> {
    /// Returns an elastic contact under a load, without rotation.
    pub fn new(patch: &'a Patch, height: &'a [f64], load: f64) -> Self {
        NormalProblem {
            patch,
            height,
            compliance: None,
            control: Control::Load(load),
            rotation: Rotation::FIXED,
            pressure_cap: None,
        }
    }
}

/// Stopping criteria.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NormalOptions {
    /// Bound on [`NormalSolution::error`].
    pub tolerance: f64,
    /// Bound on the conjugate gradient iterations.
    pub max_iterations: usize,
}

impl Default for NormalOptions {
    fn default() -> Self {
        NormalOptions {
            tolerance: 1e-6,
            max_iterations: 4000,
        }
    }
}

/// Converged normal contact.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalSolution {
    /// Pressure \[Pa\]: exactly 0 on open and masked cells, and exactly the cap on capped cells.
    pub pressure: Vec<f64>,
    /// Gap g \[m\]: 0 on masked cells, the residual on elastic cells, and ≤ 0 (the overlap) on capped cells.
    pub gap: Vec<f64>,
    /// Approach δ of the bodies from first touch of height 0 \[m\].
    pub approach: f64,
    /// Rotations θ_x and θ_y \[rad\].
    pub rotation: [f64; 2],
    /// Load Σ p dA \[N\].
    pub load: f64,
    /// Moments M_x = Σ p y dA and M_y = −Σ p x dA about the grid's centre \[N m\].
    pub moment: [f64; 2],
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Largest violation of the conditions on any cell. The violation is a displacement, divided by the displacement of
    /// one cell under the peak pressure.
    pub error: f64,
}

/// Largest error of the pressure or the gap of a single cell, divided by the tolerance. The error is measured as in
/// [`NormalSolution::error`].
const UNDECIDED_FACTOR: f64 = 10.0;

impl NormalSolution {
    /// Counts the undecided cells of `patch`. A solve to `tolerance` cannot decide whether an undecided cell touches.
    /// The pressure or the gap of an undecided cell is within ten times the tolerance. Undecided cells have typically
    /// worn until the cells bear no load. A linearised stiffness counts an undecided cell like any other cell.
    pub fn undecided_count(&self, patch: &Patch, self_compliance: f64, tolerance: f64) -> usize {
        let peak = self.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
        let pressure = UNDECIDED_FACTOR * tolerance * peak;
        let gap = pressure * self_compliance;
        let cells = (0..self.pressure.len()).filter(|&c| patch.is_in_joint[c]);
        let undecided = cells.filter(|&c| match self.pressure[c] > 0.0 {
            true => self.pressure[c] <= pressure,
            false => self.gap[c] <= gap,
        });
        undecided.count()
    }
}

/// Solves for pressure and gap. `start` is an initial guess of the pressure and affects speed only.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
    options: NormalOptions,
) -> Result<NormalSolution, ContactError> {
    check(half_space, problem, start)?;
    if problem.control == Control::Load(0.0) {
        if let Rotation::Free { moment } = problem.rotation
            && moment != [0.0; 2]
        {
            return Err(ContactError::MomentNotCarried { moment, load: 0.0 });
        }
        return Ok(untouched(problem));
    }
    Solver::new(half_space, problem, options).run(start)
}

fn check(
    half_space: &HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
) -> Result<(), ContactError> {
    let grid = problem.patch.grid;
    let cells = grid.len();
    check_length("half space", half_space.grid().len(), cells)?;
    check_length("mask", problem.patch.is_in_joint.len(), cells)?;
    let fields = [
        ("height", Some(problem.height)),
        ("compliance", problem.compliance),
        ("starting pressure", start),
    ];
    for (field, values) in fields.into_iter().filter_map(|(name, v)| Some((name, v?))) {
        check_field(field, values, grid, |c| problem.patch.is_in_joint[c])?;
    }
    match problem.control {
        Control::Load(load) if !(load.is_finite() && load >= 0.0) => {
            return Err(ContactError::OutOfRange {
                name: "load",
                value: load,
                expected: "finite and ≥ 0 N",
            });
        }
        Control::Approach(value) if !value.is_finite() => {
            return Err(ContactError::OutOfRange {
                name: "approach",
                value,
                expected: "finite",
            });
        }
        Control::Free(freedom) => {
            let values = freedom.motions().iter().flatten();
            if let Some(&value) = values.chain(freedom.resultants()).find(|v| !v.is_finite()) {
                return Err(ContactError::OutOfRange {
                    name: "a free motion or its resultant",
                    value,
                    expected: "finite",
                });
            }
        }
        _ => (),
    }
    let (name, values) = match problem.rotation {
        Rotation::Given(rotation) => ("rotation", rotation),
        Rotation::Free { moment } => ("moment", moment),
    };
    if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
        return Err(ContactError::OutOfRange {
            name,
            value,
            expected: "finite",
        });
    }
    let kept = problem.patch.cells();
    if kept == 0 {
        return Err(ContactError::OutOfRange {
            name: "number of kept cells",
            value: 0.0,
            expected: "at least 1",
        });
    }
    if let Some(cap) = problem.pressure_cap {
        if !(cap.is_finite() && cap > 0.0) {
            return Err(ContactError::OutOfRange {
                name: "pressure cap",
                value: cap,
                expected: "finite and > 0 Pa",
            });
        }
        let capacity = cap * problem.patch.area();
        if let Control::Load(load) = problem.control
            && load > capacity
        {
            let cell_area = grid.cell_area();
            return Err(ContactError::CapExceeded {
                load,
                capacity,
                cells: kept,
                cell_area,
                cap,
            });
        }
    }
    Ok(())
}

/// Returns the solution without load: the highest point just touches.
fn untouched(problem: &NormalProblem) -> NormalSolution {
    let grid = problem.patch.grid;
    let rotation = match problem.rotation {
        Rotation::Given(rotation) => rotation,
        Rotation::Free { .. } => [0.0; 2],
    };
    let kept = || (0..grid.len()).filter(|&c| problem.patch.is_in_joint[c]);
    let top = |c: usize| {
        problem.height[c] + rigid::displacement(grid, [0.0, rotation[0], rotation[1]], c)
    };
    let approach = -kept().map(top).fold(f64::NEG_INFINITY, f64::max);
    let mut gap = vec![0.0; grid.len()];
    for c in kept() {
        gap[c] = -top(c) - approach;
    }
    NormalSolution {
        pressure: vec![0.0; grid.len()],
        gap,
        approach,
        rotation,
        load: 0.0,
        moment: [0.0; 2],
        iterations: 0,
        error: 0.0,
    }
}
