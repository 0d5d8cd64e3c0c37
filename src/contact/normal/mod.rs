//! Frictionless normal contact, elastic or elastic–perfectly plastic.
//!
//! Find the pressure p and the rigid motion of the bodies, approach δ and rotation θ, with the gap
//! g = (K + D) p − h − δ − θ_x y + θ_y x, such that on every kept cell
//!
//! - p = 0 and g ≥ 0 (open), or 0 < p < p_max and g = 0 (elastic), or p = p_max and g ≤ 0 (capped) [A eq. 4.3],
//!
//! and either δ is given or Σ p dA = N, either θ is given or Σ p y dA = M_x and −Σ p x dA = M_y; or the bodies are free to move along some motions
//! (δ, θ), each with its own resultant Σ p (δ + θ_x y − θ_y x) dA. K is the half spaces'
//! compliance, D an optional diagonal one (the implicit wear step's), h the heights; x and y are measured from the grid's
//! centre. This is the minimum of ½ pᵀ(K + D)p − (h + given motions)ᵀp over the admissible pressures, found by projected conjugate
//! gradients.

mod projection;
mod rigid;
mod settle;
mod solver;

use super::error::{ContactError, check_field, check_length};
use super::half_space::HalfSpace;
use crate::grid::Patch;
use solver::Solver;

/// What is pressed on what.
#[derive(Debug, Clone, Copy)]
pub struct NormalProblem<'a> {
    /// Grid and kept cells.
    pub patch: &'a Patch,
    /// Composite height, positive towards the other body \[m\]; read on kept cells only.
    pub height: &'a [f64],
    /// Diagonal compliance D in addition to the half spaces', ≥ 0 \[m/Pa\].
    pub compliance: Option<&'a [f64]>,
    /// Load or approach.
    pub control: Control,
    /// Rotation or moments.
    pub rotation: Rotation,
    /// Largest pressure p_max \[Pa\].
    pub pressure_cap: Option<f64>,
}

/// What presses the bodies together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Control {
    /// Load N ≥ 0; the approach is found \[N\].
    Load(f64),
    /// Approach δ from first touch of height 0; the load is found \[m\].
    Approach(f64),
    /// Motions along which the bodies are free; [`NormalProblem::rotation`] is none.
    Free(Freedom),
}

/// Rigid motions along which two bodies are free to move against each other, up to three that are independent.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Freedom {
    motions: [[f64; 3]; 3],
    resultants: [f64; 3],
    count: usize,
}

impl Freedom {
    /// Adds a motion, an approach δ \[m\] and rotations θ_x and θ_y \[rad\], with Σ p (δ + θ_x y − θ_y x) dA of the pressure \[N m\].
    ///
    /// # Panics
    /// On a fourth motion.
    pub fn add(&mut self, motion: [f64; 3], resultant: f64) {
        self.motions[self.count] = motion;
        self.resultants[self.count] = resultant;
        self.count += 1;
    }

    /// The motions.
    pub fn motions(&self) -> &[[f64; 3]] {
        &self.motions[..self.count]
    }

    /// Their resultants.
    pub fn resultants(&self) -> &[f64] {
        &self.resultants[..self.count]
    }
}

/// What holds the bodies parallel.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Rotation {
    /// Given rotations θ_x and θ_y, by which the bodies approach θ_x y − θ_y x more; the moments are found \[rad\].
    Given([f64; 2]),
    /// The bodies turn until the pressure has these moments.
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
    /// Elastic contact under a load, without rotation.
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

/// When to stop.
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

/// A converged normal contact.
#[derive(Debug, Clone, PartialEq)]
pub struct NormalSolution {
    /// Pressure, exactly 0 on open and masked cells and exactly the cap on capped ones \[Pa\].
    pub pressure: Vec<f64>,
    /// Gap g, 0 on masked cells; on contact cells the residual, on capped cells ≤ 0 (the overlap) \[m\].
    pub gap: Vec<f64>,
    /// Approach δ of the bodies, from first touch of height 0 \[m\].
    pub approach: f64,
    /// Rotations θ_x and θ_y \[rad\].
    pub rotation: [f64; 2],
    /// Load Σ p dA \[N\].
    pub load: f64,
    /// Moments M_x = Σ p y dA and M_y = −Σ p x dA about the grid's centre \[N m\].
    pub moment: [f64; 2],
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Largest violation of the conditions on any cell, as a displacement over that of one cell under the peak pressure.
    pub error: f64,
}

/// Times its tolerance that a solve may be off in the pressure or gap of a single cell, in the measure of [`NormalSolution::error`].
const DECIDED: f64 = 10.0;

impl NormalSolution {
    /// Cells of a `patch` of which a solve to a `tolerance` does not tell whether they touch: their pressure or gap is within ten times of it.
    /// Such are cells that have worn until they bear nothing. They count in a linearised stiffness as much as any other.
    pub fn undecided(&self, patch: &Patch, self_compliance: f64, tolerance: f64) -> usize {
        let peak = self.pressure.iter().fold(0.0f64, |m, p| m.max(*p));
        let pressure = DECIDED * tolerance * peak;
        let gap = pressure * self_compliance;
        let kept = (0..self.pressure.len()).filter(|&c| patch.kept[c]);
        let undecided = kept.filter(|&c| match self.pressure[c] > 0.0 {
            true => self.pressure[c] <= pressure,
            false => self.gap[c] <= gap,
        });
        undecided.count()
    }
}

/// Solves for pressure and gap. `start` is a pressure to begin from (a similar problem's), used for speed alone.
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
    check_length("mask", problem.patch.kept.len(), cells)?;
    let fields = [
        ("height", Some(problem.height)),
        ("compliance", problem.compliance),
        ("starting pressure", start),
    ];
    for (field, values) in fields.into_iter().filter_map(|(name, v)| Some((name, v?))) {
        check_field(field, values, grid, |c| problem.patch.kept[c])?;
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
    let (name, given) = match problem.rotation {
        Rotation::Given(rotation) => ("rotation", rotation),
        Rotation::Free { moment } => ("moment", moment),
    };
    if let Some(&value) = given.iter().find(|v| !v.is_finite()) {
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

/// No load: the highest point just touches.
fn untouched(problem: &NormalProblem) -> NormalSolution {
    let grid = problem.patch.grid;
    let rotation = match problem.rotation {
        Rotation::Given(rotation) => rotation,
        Rotation::Free { .. } => [0.0; 2],
    };
    let kept = || (0..grid.len()).filter(|&c| problem.patch.kept[c]);
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
