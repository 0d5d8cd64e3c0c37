//! Tangential contact with Coulomb friction over one step. Each axis has a given displacement or a given force, with or
//! without a rotation about z.
//!
//! A step moves the bodies against each other by Δδ and rotates them by Δθ about the centre of the grid. Let q₀ be the
//! shear before the step. Find the shear q such that the slip
//!
//! s = Δδ + Δθ ẑ×r + g − K(q − q₀)
//!
//! satisfies two conditions on every cell: |q| ≤ µp, and q = µp s/|s| if s ≠ 0. g is an optional field of offsets. The
//! shear q points along the slip of the moved body, so that q·s ≥ 0 is dissipated. The solution minimises the convex
//! function
//!
//! F(q) = ½ (q − q₀)ᵀK(q − q₀) − (Δδ + Δθ ẑ×r + g)ᵀ(q − q₀) over the discs |q| ≤ µp,
//!
//! For a prescribed force or moment, the minimum is over the shears in the discs that have the prescribed resultant.
//! The displacement is the Lagrange multiplier of the resultant. On a stick cell, both components of q are unknown. On
//! a slip cell, the *angle* of q is unknown. The unknowns change only in the subspace of constant resultants. The
//! solver projects a step into the discs, and onto the prescribed resultants. If the projected step does not lower F
//! enough, the solver shortens the step to the minimum of F on the chord. The set of admissible shears is convex, so
//! the chord stays inside the set. The solver begins with projected conjugate gradient steps, which cost one
//! convolution each. If the conjugate gradient steps stagnate, the solver changes to a semi-smooth Newton method. If
//! the shear has two components and nearly all cells slide, the solver changes to the semi-smooth Newton method without
//! waiting for stagnation. If the chord does not descend or the Newton steps stagnate, the solver takes projected
//! gradient steps. F always decreases along a projected gradient step.
//!
//! The certificate is the relative duality gap Σ(µp|s| − q·s)/Σ µp|s|. The duality gap bounds the error of F and of the
//! dissipation. A small change of q or of the force would not bound the two errors. The duality gap uses a slip that is
//! computed anew from the returned shear.
//!
//! ```
//! use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
//! use fretwear::contact::tangential::{self, Drive, TangentialOptions, TangentialProblem};
//! use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
//! use fretwear::grid::{Grid, Patch};
//! use fretwear::reference::CattaneoMindlin;
//!
//! // A sphere on a flat, moved along x by half the displacement at which it slides.
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

/// Control of a rigid motion in a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drive {
    /// Prescribed increment during the step: Δδ \[m\] along an axis, or the rotation Δθ \[rad\].
    Displacement(f64),
    /// Prescribed resultant at the end of the step. The resultant is the total tangential force \[N\] along an axis, or
    /// the total moment Mz \[N·m\] about the grid's centre.
    Force(f64),
}

/// One step of the tangential contact.
#[derive(Debug, Clone, Copy)]
pub struct TangentialProblem<'a> {
    /// Grid, and the cells that belong to the joint.
    pub patch: &'a Patch,
    /// Friction limit µp ≥ 0, and 0 outside the contact \[Pa\].
    pub limit: &'a [f64],
    /// Shear q₀ before the step, one field per axis; `None` for zero shear \[Pa\].
    pub previous: Option<&'a ByAxis<Vec<f64>>>,
    /// Motion of the upper body against the lower, one entry per axis (x, or x and y). A free axis is `Force(0.0)`.
    pub drive: &'a ByAxis<Drive>,
    /// Rotation of the upper body against the lower about z through the grid's centre, counter-clockwise seen from
    /// above. `None` for no rotation. Needs both axes.
    pub rotation: Option<Drive>,
    /// Displacement increment g of each cell in addition to the rigid motion, one field per axis; `None` for zero
    /// \[m\].
    pub offset: Option<&'a ByAxis<Vec<f64>>>,
}

/// Stopping criteria.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TangentialOptions {
    /// Bound on [`TangentialSolution::error`].
    pub tolerance: f64,
    /// Bound on Newton steps.
    pub max_steps: usize,
    /// Bound on the total number of conjugate gradient iterations.
    pub max_iterations: usize,
    /// Fraction of the cells that must change between stick and slip before the preconditioner's correction is reset.
    pub max_changed_fraction: f64,
    /// Length of a trial step divided by the predicted length, for a shear with two components. The shear of a slip
    /// cell lies on the circle |q| = µp at both ends of a chord, and inside the circle between the ends. A short chord
    /// is closer to the circle, so a short trial is better than a long trial.
    pub chord_fraction: f64,
    /// Largest relative distance from the friction limit at which a shear can slip in a Newton step. A shear within
    /// `circle_width` of the friction limit slips if the slip drives the shear beyond the limit. After a shortened
    /// chord, the shears of all slip cells lie just inside the circle |q| = µp. With a width of zero, all slip cells
    /// would stick in the next step.
    pub circle_width: f64,
    /// Largest error of an inner solve on sticking cells, as a fraction of the tolerance of the tangential solve.
    pub inner_share: f64,
}

impl TangentialOptions {
    /// Default options as a constant, so that other constants can include the default options.
    pub const DEFAULT: TangentialOptions = TangentialOptions {
        tolerance: 1e-4,
        max_steps: 400,
        max_iterations: 20_000,
        max_changed_fraction: 0.1,
        chord_fraction: 0.9,
        circle_width: 0.05,
        inner_share: 0.25,
    };
}

impl Default for TangentialOptions {
    fn default() -> Self {
        TangentialOptions::DEFAULT
    }
}

/// State of a cell in the step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CellState {
    /// No pressure, or not part of the joint.
    Open,
    /// In contact without slip.
    Stick,
    /// In contact and slipping.
    Slip,
}

/// Converged step.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentialSolution {
    /// Shear q at the end of the step, one field per axis \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Slip s in the step, one field per axis \[m\]. The slip is exactly 0 on stick cells, and is the kinematic Δδ − Δu
    /// on open kept cells.
    pub slip: ByAxis<Vec<f64>>,
    /// State of each cell.
    pub state: Vec<CellState>,
    /// Displacement increment Δδ, given or computed, one entry per axis \[m\].
    pub displacement: ByAxis<f64>,
    /// Rotation increment Δθ, given or computed; 0 without a rotation \[rad\].
    pub rotation: f64,
    /// Tangential force Σ q dA at the end of the step, one entry per axis \[N\].
    pub force: ByAxis<f64>,
    /// Moment Mz = Σ (x q_y − y q_x) dA about the grid's centre at the end of the step \[N·m\].
    pub moment: f64,
    /// Dissipated energy Σ q·s dA \[J\].
    pub dissipation: f64,
    /// Newton steps.
    pub steps: usize,
    /// Conjugate gradient iterations.
    pub iterations: usize,
    /// Relative duality gap. The dissipation by the remaining slip of stick cells counts as error.
    pub error: f64,
    /// Bound on the error of the dissipation \[J\], equal to the duality gap. The dissipation by the remaining slip of
    /// stick cells counts as error.
    pub dissipation_error: f64,
    /// Largest difference between a prescribed and a computed force, divided by Σ µp dA. A moment is first divided by
    /// half the grid's diagonal. Without a prescribed force or moment, the error is 0.
    pub force_error: f64,
}

/// Solves one step. `start` is an initial guess of the shear and affects speed only.
///
/// # Errors
/// Returns [`ContactError::FrictionExceeded`] if friction does not carry a prescribed force or moment. Returns
/// [`ContactError::NotConverged`] if the solver does not converge. Returns [`ContactError::Length`],
/// [`ContactError::NotFinite`] or [`ContactError::OutOfRange`] if the input is invalid.
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

/// Evaluates a given shear as if it were the solution. `evaluate` clips the shear to the limits, moves the shear to the
/// given forces and computes the slip of the shear. [`TangentialSolution::error`] is the relative duality gap of the
/// evaluated shear. An evaluation costs one convolution.
///
/// # Errors
/// Returns the errors of [`solve`], except [`ContactError::NotConverged`].
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
        .filter(|&c| problem.patch.is_in_joint[c] && problem.limit[c] > 0.0)
        .collect();
    let [lx, ly] = grid.size();
    let length = 0.5 * lx.hypot(ly);
    let rotation_at = |c: usize| -> [f64; A] {
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
        rotation: rotation.map(|_| contact.iter().map(|&c| rotation_at(c)).collect()),
        length,
        required: asked,
    };
    let nothing_asked = resultants.required.iter().all(|(_, sum)| *sum == 0.0);
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
        return Err(solver.friction_exceeded());
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
        let moves = problem.patch.is_in_joint[c] && state[c] != CellState::Stick;
        let unit_rotation = if problem.rotation.is_some() {
            rotation_at(c)
        } else {
            [0.0; A]
        };
        for axis in 0..A {
            let imposed = amounts[axis]
                + amounts[MOTIONS - 1] * unit_rotation[axis]
                + problem.offset.map_or(0.0, |offset| offset[axis][c]);
            let s = &mut slip[axis][c];
            *s = if moves { imposed - *s } else { 0.0 };
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
