//! Tangential contact with Coulomb friction over one step of prescribed displacement.
//!
//! A step moves the bodies by Δδ against each other. With q₀ the shear before it, find the shear q such that the slip
//! s = Δδ − K(q − q₀) obeys, on every cell, |q| ≤ µp, and q = µp s/|s| wherever s ≠ 0. The shear q points along the slip of
//! the moved body, so that q·s ≥ 0 is dissipated. This is the minimum of the convex
//!
//! F(q) = ½ (q − q₀)ᵀK(q − q₀) − Δδᵀ(q − q₀) over the discs |q| ≤ µp,
//!
//! found by a semi-smooth Newton method: unknown are both components of q on stick cells and its *angle* on slip cells. A
//! step that does not lower F is shortened to the minimum on its chord (the discs are convex, so the chord stays inside);
//! where the chord does not descend, a projected gradient step is taken, which always does.
//!
//! The certificate is the relative duality gap Σ(µp|s| − q·s)/Σ µp|s|: it bounds the error of F and of the dissipation, as
//! neither a small change of q nor of the force does.

mod newton;

use super::error::ContactError;
use super::half_space::HalfSpace;
use crate::grid::{ByAxis, Patch};
use newton::Solver;

/// One step.
#[derive(Debug, Clone, Copy)]
pub struct TangentialProblem<'a> {
    /// Grid and kept cells.
    pub patch: &'a Patch,
    /// µp ≥ 0, 0 outside the contact \[Pa\].
    pub limit: &'a [f64],
    /// Shear q₀ before the step, one field an axis; `None` is none anywhere \[Pa\].
    pub previous: Option<&'a ByAxis<Vec<f64>>>,
    /// Displacement Δδ of the upper body against the lower in this step, one entry an axis (x, or x and y) \[m\].
    pub displacement: &'a ByAxis<f64>,
}

/// When to stop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentialOptions {
    /// Bound on [`TangentialSolution::error`].
    pub tolerance: f64,
    /// Bound on Newton steps.
    pub max_steps: usize,
    /// Bound on conjugate gradient iterations in all.
    pub max_iterations: usize,
}

impl Default for TangentialOptions {
    fn default() -> Self {
        TangentialOptions {
            tolerance: 1e-4,
            max_steps: 400,
            max_iterations: 20_000,
        }
    }
}

/// What a cell does in the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellState {
    /// No pressure, or not part of the joint.
    Open,
    /// In contact without slip.
    Stick,
    /// In contact and slipping.
    Slip,
}

/// A converged step.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentialSolution {
    /// Shear q at the end of the step, one field an axis \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Slip s in the step \[m\]: exactly 0 on stick cells; on open kept cells the kinematic Δδ − Δu.
    pub slip: ByAxis<Vec<f64>>,
    /// State of each cell.
    pub state: Vec<CellState>,
    /// Tangential force Σ q dA at the end of the step, one entry an axis \[N\].
    pub force: ByAxis<f64>,
    /// Dissipated energy Σ q·s dA \[J\].
    pub dissipation: f64,
    /// Newton steps.
    pub steps: usize,
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Relative duality gap, with all that stick cells would still dissipate counted as error.
    pub error: f64,
}

/// Solves one step. `start` is a shear to begin from, used for speed alone.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
    options: TangentialOptions,
) -> Result<TangentialSolution, ContactError> {
    check(half_space, problem, start)?;
    Solver::new(half_space, problem, options).run(start)
}

fn check(
    half_space: &HalfSpace,
    problem: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
) -> Result<(), ContactError> {
    let cells = problem.patch.grid.len();
    let axes = problem.displacement.len();
    let length = |field: &'static str, found: usize, expected: usize| {
        if found == expected {
            Ok(())
        } else {
            Err(ContactError::Length {
                field,
                found,
                expected,
            })
        }
    };
    length("half space", half_space.grid().len(), cells)?;
    length("friction limit", problem.limit.len(), cells)?;
    if !(1..=2).contains(&axes) {
        return Err(ContactError::OutOfRange {
            name: "number of axes",
            value: axes as f64,
            expected: "1 or 2",
        });
    }
    let mut fields = vec![("friction limit", problem.limit)];
    for (name, shear) in [
        ("shear before the step", problem.previous),
        ("starting shear", start),
    ] {
        if let Some(shear) = shear {
            length(name, shear.len() * cells, axes * cells)?;
            for field in shear {
                length(name, field.len(), cells)?;
                fields.push((name, field));
            }
        }
    }
    for (field, values) in fields {
        if let Some(index) = (0..cells).find(|&c| !values[c].is_finite()) {
            let (i, j) = problem.patch.grid.cell(index);
            return Err(ContactError::NotFinite {
                field,
                i,
                j,
                value: values[index],
            });
        }
    }
    match problem.displacement.iter().find(|d| !d.is_finite()) {
        Some(&value) => Err(ContactError::OutOfRange {
            name: "displacement",
            value,
            expected: "finite",
        }),
        None => Ok(()),
    }
}

/// Applies the tangential compliance for one axis or two.
pub(in crate::contact) fn compliance(
    half_space: &mut HalfSpace,
    shear: &ByAxis<Vec<f64>>,
    out: &mut ByAxis<Vec<f64>>,
) {
    match (&shear[..], &mut out[..]) {
        ([x], [ux]) => half_space.shear_x(x, ux),
        ([x, y], [ux, uy]) => half_space.shear([x, y], [ux, uy]),
        _ => unreachable!("shear and displacement have the same one or two axes"),
    }
}

/// Applies the tangential preconditioner for one axis or two.
pub(in crate::contact) fn stiffness(
    half_space: &mut HalfSpace,
    displacement: &ByAxis<Vec<f64>>,
    out: &mut ByAxis<Vec<f64>>,
) {
    match (&displacement[..], &mut out[..]) {
        ([x], [qx]) => half_space.shear_x_inverse(x, qx),
        ([x, y], [qx, qy]) => half_space.shear_inverse([x, y], [qx, qy]),
        _ => unreachable!("shear and displacement have the same one or two axes"),
    }
}
