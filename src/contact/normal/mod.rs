//! Frictionless normal contact under a given load, elastic or elastic–perfectly plastic.
//!
//! Find the pressure p and the approach δ with gap g = (K + D) p − h − δ such that, on every kept cell,
//!
//! - p = 0 and g ≥ 0 (open), or 0 < p < p_max and g = 0 (elastic), or p = p_max and g ≤ 0 (capped) [A eq. 4.3],
//!
//! and Σ p dA = N. K is the half spaces' compliance, D an optional diagonal one (the implicit wear step's), h the heights.
//! This is a convex problem; it is solved by a primal–dual active set: solve for p on the elastic cells in the subspace of
//! constant load by preconditioned conjugate gradients, then exchange the cells of the wrong sign. Where the exchange cycles,
//! the sets come from projected gradient steps, along which the energy falls.

mod active_set;
mod descent;

use super::error::ContactError;
use super::half_space::HalfSpace;
use crate::grid::Patch;
use active_set::Solver;

/// What is pressed on what.
#[derive(Debug, Clone, Copy)]
pub struct NormalProblem<'a> {
    /// Grid and kept cells.
    pub patch: &'a Patch,
    /// Composite height, positive towards the other body \[m\]; read on kept cells only.
    pub height: &'a [f64],
    /// Diagonal compliance D in addition to the half spaces', ≥ 0 \[m/Pa\].
    pub compliance: Option<&'a [f64]>,
    /// Total load N ≥ 0 \[N\].
    pub load: f64,
    /// Largest pressure p_max \[Pa\].
    pub pressure_cap: Option<f64>,
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
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Exchanges of the active set.
    pub exchanges: usize,
    /// Largest violation of the conditions on any cell, as a displacement over that of one cell under the peak pressure.
    pub error: f64,
}

/// Solves for pressure and gap. `start` is a pressure to begin from (a similar problem's), used for speed alone.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
    options: NormalOptions,
) -> Result<NormalSolution, ContactError> {
    check(half_space, problem, start)?;
    if problem.load == 0.0 {
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
    let length = |field: &'static str, found: usize| {
        if found == cells {
            Ok(())
        } else {
            Err(ContactError::Length {
                field,
                found,
                expected: cells,
            })
        }
    };
    length("half space", half_space.grid().len())?;
    length("mask", problem.patch.kept.len())?;
    length("height", problem.height.len())?;
    length("compliance", problem.compliance.map_or(cells, <[f64]>::len))?;
    length("starting pressure", start.map_or(cells, <[f64]>::len))?;
    let fields = [
        ("height", Some(problem.height)),
        ("compliance", problem.compliance),
        ("starting pressure", start),
    ];
    for (field, values) in fields.into_iter().filter_map(|(name, v)| Some((name, v?))) {
        let wrong = (0..cells).find(|&c| problem.patch.kept[c] && !values[c].is_finite());
        if let Some(index) = wrong {
            let (i, j) = grid.cell(index);
            return Err(ContactError::NotFinite {
                field,
                i,
                j,
                value: values[index],
            });
        }
    }
    if !(problem.load.is_finite() && problem.load >= 0.0) {
        return Err(ContactError::OutOfRange {
            name: "load",
            value: problem.load,
            expected: "finite and ≥ 0 N",
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
        if problem.load > capacity {
            let cell_area = grid.cell_area();
            return Err(ContactError::CapExceeded {
                load: problem.load,
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
    let kept = &problem.patch.kept;
    let top = (0..kept.len())
        .filter(|&c| kept[c])
        .map(|c| problem.height[c])
        .fold(f64::NEG_INFINITY, f64::max);
    let gap = (0..kept.len())
        .map(|c| {
            if kept[c] {
                top - problem.height[c]
            } else {
                0.0
            }
        })
        .collect();
    let pressure = vec![0.0; kept.len()];
    NormalSolution {
        pressure,
        gap,
        approach: -top,
        iterations: 0,
        exchanges: 0,
        error: 0.0,
    }
}
