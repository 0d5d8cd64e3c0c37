//! Tangential contact with Coulomb friction over one step, of given displacement or given force on each axis, with or without
//! a rotation about z.
//!
//! A step moves the bodies against each other by Δδ and turns them by Δθ about the centre of the grid. With q₀ the shear
//! before it, find the shear q such that the slip
//!
//! s = Δδ + Δθ ẑ×r + g − K(q − q₀)
//!
//! obeys, on every cell, |q| ≤ µp, and q = µp s/|s| wherever s ≠ 0; g is a given field, if any. The shear q points along the
//! slip of the moved body, so that q·s ≥ 0 is dissipated. This is the minimum of the convex
//!
//! F(q) = ½ (q − q₀)ᵀK(q − q₀) − (Δδ + Δθ ẑ×r + g)ᵀ(q − q₀) over the discs |q| ≤ µp,
//!
//! and where a force or a moment is given instead, over the shears in them that have this resultant; the displacement is then
//! its multiplier. Unknown are both components of q on stick cells and its *angle* on slip cells, in the subspace of constant
//! resultants. A step is projected into the discs (and onto the resultants), and if it does not lower F enough it is shortened to
//! the minimum on its chord: the set is convex, so the chord stays inside. The first steps are those of projected conjugate
//! gradients, at one convolution each; where they do not get on, or nearly all slides in the plane, those of a semi-smooth Newton
//! method follow. Where the chord does not descend, or the steps do not settle, projected gradient steps are taken, along which F
//! always falls.
//!
//! The certificate is the relative duality gap Σ(µp|s| − q·s)/Σ µp|s|: it bounds the error of F and of the dissipation, as
//! neither a small change of q nor of the force does. It is taken of a slip that is computed anew from the shear returned.
//!
//! ```
//! use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
//! use fretwear::contact::tangential::{self, Drive, TangentialOptions, TangentialProblem};
//! use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
//! use fretwear::grid::{Grid, Patch};
//! use fretwear::reference::CattaneoMindlin;
//!
//! // A sphere on a flat, moved along x by half of what it takes to slide.
//! let steel = Pair::same(Elastic { youngs_modulus: 198.4e9, poisson_ratio: 0.0 });
//! let exact = CattaneoMindlin { radius: 0.1, load: 100.0, friction_coefficient: 0.6, pair: steel };
//! let displacement = 0.5 * exact.sliding_displacement();
//!
//! let patch = Patch::full(Grid::over([1.1e-3, 1.0e-3], [80, 64]));
//! let grid = patch.grid;
//! let height = |c| {
//!     let (i, j) = grid.cell(c);
//!     let (x, y) = grid.centre(i, j);
//!     -(x * x + y * y) / (2.0 * exact.radius)
//! };
//! let heights: Vec<f64> = (0..grid.len()).map(height).collect();
//! let mut half_space = HalfSpace::new(grid, steel, Boundary::Free);
//! let problem = NormalProblem::new(&patch, &heights, exact.load);
//! let contact = normal::solve(&mut half_space, &problem, None, NormalOptions::default())?;
//! let limit: Vec<f64> = contact.pressure.iter().map(|p| exact.friction_coefficient * p).collect();
//!
//! let problem = TangentialProblem {
//!     patch: &patch,
//!     limit: &limit,
//!     previous: None,
//!     drive: &vec![Drive::Displacement(displacement)],
//!     rotation: None,
//!     offset: None,
//! };
//! let step = tangential::solve(&mut half_space, &problem, None, TangentialOptions::default())?;
//! assert!((step.force[0] / exact.force(displacement) - 1.0).abs() < 0.01);
//! # Ok::<(), fretwear::contact::ContactError>(())
//! ```

mod coarse;
mod conjugate;
mod direction;
mod newton;
mod operator;
mod resultants;
mod vector;

use super::error::{ContactError, check_field, check_length};
use super::half_space::HalfSpace;
use crate::grid::{ByAxis, Patch};
use newton::Solver;
use operator::Operator;
use resultants::{MOTIONS, Motions, Resultants};

/// What is given of a rigid motion in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Its increment in this step: Δδ \[m\] along an axis, Δθ \[rad\] of the rotation.
    Displacement(f64),
    /// Its resultant at the end of the step: the total tangential force \[N\] along an axis, the total moment Mz about the
    /// grid's centre \[N·m\] of the rotation.
    Force(f64),
}

/// One step.
#[derive(Debug, Clone, Copy)]
pub struct TangentialProblem<'a> {
    /// Grid and kept cells.
    pub patch: &'a Patch,
    /// µp ≥ 0, 0 outside the contact \[Pa\].
    pub limit: &'a [f64],
    /// Shear q₀ before the step, one field an axis; `None` is none anywhere \[Pa\].
    pub previous: Option<&'a ByAxis<Vec<f64>>>,
    /// Motion of the upper body against the lower, one entry an axis (x, or x and y). A free axis is `Force(0.0)`.
    pub drive: &'a ByAxis<Drive>,
    /// Rotation of the upper body against the lower about z through the grid's centre, counter-clockwise seen from above; `None`
    /// is none, without storage. Needs both axes.
    pub rotation: Option<Drive>,
    /// Displacement increment g of each cell on top of the rigid motion, one field an axis; `None` is none \[m\].
    pub offset: Option<&'a ByAxis<Vec<f64>>>,
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
    /// Displacement increment Δδ, given or found, one entry an axis \[m\].
    pub displacement: ByAxis<f64>,
    /// Rotation increment Δθ, given or found; 0 without a rotation \[rad\].
    pub rotation: f64,
    /// Tangential force Σ q dA at the end of the step, one entry an axis \[N\].
    pub force: ByAxis<f64>,
    /// Moment Mz = Σ (x q_y − y q_x) dA about the grid's centre at the end of the step \[N·m\].
    pub moment: f64,
    /// Dissipated energy Σ q·s dA \[J\].
    pub dissipation: f64,
    /// Newton steps.
    pub steps: usize,
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Relative duality gap, with all that stick cells would still dissipate counted as error.
    pub error: f64,
    /// Duality gap, with all that stick cells would still dissipate counted as error, which bounds the error of the dissipation \[J\].
    pub dissipation_error: f64,
    /// Largest difference between a force asked for and found, as a part of Σ µp dA (of a moment: times half the grid's
    /// diagonal); 0 where none was asked for.
    pub force_error: f64,
}

/// Solves one step. `start` is a shear to begin from, used for speed alone.
///
/// # Errors
/// [`ContactError::FrictionExceeded`] for a force or moment that friction does not carry, [`ContactError::NotConverged`], and
/// [`ContactError::Length`], [`ContactError::NotFinite`] or [`ContactError::OutOfRange`] for input without sense.
pub fn solve(
    half_space: &mut HalfSpace,
    problem: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
    options: TangentialOptions,
) -> Result<TangentialSolution, ContactError> {
    check(half_space, problem, start)?;
    match problem.drive.len() {
        1 => solve_axes::<1>(half_space, problem, start, Some(options)),
        _ => solve_axes::<2>(half_space, problem, start, Some(options)),
    }
}

/// A given shear as if it were the solution: cut back to the limits, moved to the forces asked for, with the slip that belongs to
/// it and, in [`TangentialSolution::error`], how far it is from one. One convolution.
///
/// # Errors
/// As [`solve`], but for [`ContactError::NotConverged`].
pub fn evaluate(
    half_space: &mut HalfSpace,
    problem: &TangentialProblem,
    shear: &ByAxis<Vec<f64>>,
) -> Result<TangentialSolution, ContactError> {
    check(half_space, problem, Some(shear))?;
    match problem.drive.len() {
        1 => solve_axes::<1>(half_space, problem, Some(shear), None),
        _ => solve_axes::<2>(half_space, problem, Some(shear), None),
    }
}

fn solve_axes<const A: usize>(
    half_space: &mut HalfSpace,
    problem: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
    options: Option<TangentialOptions>,
) -> Result<TangentialSolution, ContactError> {
    let grid = problem.patch.grid;
    let contact: Vec<usize> = (0..grid.len())
        .filter(|&c| problem.patch.kept[c] && problem.limit[c] > 0.0)
        .collect();
    let [lx, ly] = grid.size();
    let length = 0.5 * lx.hypot(ly);
    let turned = |c: usize| -> [f64; A] {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        std::array::from_fn(|axis| [-y, x][axis] / length)
    };
    let mut displacement: Motions = [0.0; MOTIONS];
    let mut asked = Vec::new();
    let rotation = problem.rotation.map(|drive| (MOTIONS - 1, drive, length));
    let axes = problem.drive.iter().enumerate();
    for (motion, drive, unit) in axes
        .map(|(axis, drive)| (axis, *drive, 1.0))
        .chain(rotation)
    {
        match drive {
            Drive::Displacement(increment) => displacement[motion] = increment * unit,
            Drive::Force(force) => asked.push((motion, force / (grid.cell_area() * unit))),
        }
    }
    let limits = || contact.iter().map(|&c| problem.limit[c]);
    let resultants = Resultants {
        limit_sum: limits().sum(),
        limit_peak: limits().fold(0.0, f64::max),
        rotation: rotation.map(|_| contact.iter().map(|&c| turned(c)).collect()),
        length,
        asked,
    };
    let nothing_asked = resultants.asked.iter().all(|(_, sum)| *sum == 0.0);
    let nothing_carried = contact.is_empty();
    let operator = Operator::<A>::new(half_space, contact);
    let mut solver = Solver::new(
        operator,
        problem,
        resultants,
        displacement,
        options.unwrap_or_default(),
    );
    if nothing_carried && !nothing_asked {
        return Err(solver.beyond());
    }
    let (gap, force_error) = match options {
        Some(_) => solver.run(start)?,
        None => solver.evaluate(start)?,
    };

    let mut state = vec![CellState::Open; grid.len()];
    let mut shear = vec![vec![0.0; grid.len()]; A];
    for (cell, &c) in solver.operator.cells().iter().enumerate() {
        state[c] = if solver.slips(cell) {
            CellState::Slip
        } else {
            CellState::Stick
        };
        for axis in 0..A {
            shear[axis][c] = solver.shear[cell][axis];
        }
    }
    let amounts = solver.displacement;
    let mut slip = solver.operator.into_field();
    for c in 0..grid.len() {
        let moves = problem.patch.kept[c] && state[c] != CellState::Stick;
        let turned = if problem.rotation.is_some() {
            turned(c)
        } else {
            [0.0; A]
        };
        for axis in 0..A {
            let given = amounts[axis]
                + amounts[MOTIONS - 1] * turned[axis]
                + problem.offset.map_or(0.0, |offset| offset[axis][c]);
            let s = &mut slip[axis][c];
            *s = if moves { given - *s } else { 0.0 };
        }
    }
    let total = |values: &mut dyn Iterator<Item = f64>| grid.cell_area() * values.sum::<f64>();
    let dissipated = |c: usize| {
        (0..A)
            .map(|axis| shear[axis][c] * slip[axis][c])
            .sum::<f64>()
    };
    let moment = |c: usize| {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        x * shear.get(1).map_or(0.0, |q| q[c]) - y * shear[0][c]
    };
    Ok(TangentialSolution {
        displacement: amounts[..A].to_vec(),
        rotation: amounts[MOTIONS - 1] / length,
        force: shear
            .iter()
            .map(|q| total(&mut q.iter().copied()))
            .collect(),
        moment: total(&mut (0..grid.len()).map(moment)),
        dissipation: total(
            &mut (0..grid.len())
                .filter(|&c| state[c] != CellState::Open)
                .map(dissipated),
        ),
        shear,
        slip,
        state,
        steps: solver.steps,
        iterations: solver.iterations,
        error: gap.error,
        dissipation_error: gap.error * gap.scale * grid.cell_area(),
        force_error,
    })
}

fn check(
    half_space: &HalfSpace,
    problem: &TangentialProblem,
    start: Option<&ByAxis<Vec<f64>>>,
) -> Result<(), ContactError> {
    let grid = problem.patch.grid;
    let cells = grid.len();
    let axes = problem.drive.len();
    check_length("half space", half_space.grid().len(), cells)?;
    if !(1..=2).contains(&axes) {
        return Err(ContactError::OutOfRange {
            name: "number of axes",
            value: axes as f64,
            expected: "1 or 2",
        });
    }
    if problem.rotation.is_some() && axes != 2 {
        return Err(ContactError::OutOfRange {
            name: "number of axes under a rotation",
            value: axes as f64,
            expected: "2",
        });
    }
    let check_values = |field, values: &[f64]| check_field(field, values, grid, |_| true);
    check_values("friction limit", problem.limit)?;
    for (name, shear) in [
        ("shear before the step", problem.previous),
        ("starting shear", start),
        ("offset", problem.offset),
    ] {
        if let Some(shear) = shear {
            check_length(name, shear.len() * cells, axes * cells)?;
            for field in shear {
                check_values(name, field)?;
            }
        }
    }
    if let Some(c) = (0..cells).find(|&c| problem.limit[c] < 0.0) {
        return Err(ContactError::OutOfRange {
            name: "friction limit",
            value: problem.limit[c],
            expected: "≥ 0 Pa on every cell",
        });
    }
    for drive in problem.drive.iter().chain(&problem.rotation) {
        let (name, value) = match *drive {
            Drive::Displacement(value) => ("displacement", value),
            Drive::Force(value) => ("tangential force or moment", value),
        };
        if !value.is_finite() {
            return Err(ContactError::OutOfRange {
                name,
                value,
                expected: "finite",
            });
        }
    }
    Ok(())
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
