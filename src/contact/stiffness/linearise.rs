//! Preconditioned conjugate gradients for the tractions under a unit motion of a set of cells.

use super::super::cells::{gather, scatter};
use super::super::coarse::FarFieldCorrection;
use super::super::error::ContactError;
use super::super::half_space::{Boundary, HalfSpace, Shear};
use super::MotionSolution;
use crate::grid::ByAxis;

/// Bound on the convergence rate in the estimate of the energy that further iterations would add.
const MAX_RATE: f64 = 0.9;

/// Largest energy of the preconditioned residual at which the solve stops, as a fraction of the allowed energy error.
const NEGLIGIBLE_ENERGY: f64 = 1e-3;

/// Bound on conjugate gradient iterations. A contact set of any shape takes a few dozen.
const MAX_ITERATIONS: usize = 2000;

pub(super) type Field = ByAxis<Vec<f64>>;

/// Traction that a field represents.
#[derive(Debug, Clone, Copy)]
pub(super) enum Traction {
    Pressure,
    AlongX,
    AlongY,
}

impl Shear {
    pub(super) fn tractions(self) -> &'static [Traction] {
        match self {
            Shear::AlongX => &[Traction::AlongX],
            Shear::InPlane => &[Traction::AlongX, Traction::AlongY],
        }
    }
}

/// Creates the far-field correction for a traction. The correction neglects the small displacement from tractions of
/// the other directions.
fn far_field(half_space: &HalfSpace, traction: Traction) -> FarFieldCorrection {
    let pair = half_space.pair();
    let (a, b) = (pair.compliance(), pair.lateral_compliance());
    FarFieldCorrection::new(half_space, |cell| match traction {
        Traction::Pressure => a * cell.inverse,
        Traction::AlongX => a * cell.inverse + b * cell.xx,
        Traction::AlongY => a * cell.inverse + b * cell.yy,
    })
}

/// Solves K x = `motion` by preconditioned conjugate gradients. `motion` takes an axis and a cell; each of the `fields`
/// lives on its own set of cells. The iteration begins with the best multiple of `start`, a shear along x.
///
/// In each iteration the energy xᵀ K x grows towards the energy of the solution. The increments of the energy fall like
/// a geometric series. The remainder of the geometric series estimates the error of the energy. The residual estimates
/// the error of the energy poorly. On scattered cells, soft and far-reaching motions have a small residual but a large
/// error [Hestenes and Stiefel 1952; Strakoš and Tichý 2002].
#[allow(clippy::too_many_arguments)]
pub(super) fn linearise(
    half_space: &mut HalfSpace,
    sets: &[&[bool]],
    tolerance: f64,
    start: Option<&[f64]>,
    fields: &[Traction],
    motion: impl Fn(usize, usize) -> f64,
    mut apply: impl FnMut(&mut HalfSpace, &Field, &mut Field),
    mut precondition: impl FnMut(&mut HalfSpace, &Field, &mut Field),
) -> Result<MotionSolution, ContactError> {
    let (grid, axes) = (half_space.grid(), fields.len());
    if let Some(set) = sets.iter().find(|set| set.len() != grid.len()) {
        return Err(ContactError::Length {
            field: "contact set",
            found: set.len(),
            expected: grid.len(),
        });
    }
    let cells: Vec<Vec<usize>> = sets
        .iter()
        .map(|set| (0..set.len()).filter(|&c| set[c]).collect())
        .collect();
    let zeros = || vec![vec![0.0; grid.len()]; axes];
    let (mut density, mut residual, mut direction, mut image) =
        (zeros(), zeros(), zeros(), zeros());
    for axis in 0..axes {
        for &c in &cells[axis] {
            residual[axis][c] = motion(axis, c);
        }
    }
    let moves = |axis: usize| cells[axis].iter().any(|&c| motion(axis, c) != 0.0);
    let full = |axis: usize| moves(axis) && cells[axis].len() == grid.len();
    if half_space.boundary() == Boundary::Periodic && (0..axes).any(full) {
        return Ok(MotionSolution {
            density,
            residual,
            energy: f64::INFINITY,
            iterations: 0,
        });
    }
    let dot = |a: &Field, b: &Field| -> f64 {
        (0..axes)
            .map(|axis| {
                let cells = cells[axis].iter();
                cells.map(|&c| a[axis][c] * b[axis][c]).sum::<f64>()
            })
            .sum()
    };
    let mut coarse: Vec<FarFieldCorrection> = fields
        .iter()
        .map(|&traction| far_field(half_space, traction))
        .filter(FarFieldCorrection::has_correction)
        .collect();
    for (axis, coarse) in coarse.iter_mut().enumerate() {
        cells[axis].iter().for_each(|&c| direction[axis][c] = 1.0);
        match fields[axis] {
            Traction::Pressure => half_space.normal_inverse(&direction[axis], &mut image[axis]),
            Traction::AlongX if axes == 1 => {
                half_space.shear_x_inverse(&direction[axis], &mut image[axis])
            }
            Traction::AlongX => {
                half_space.single_axis_shear_inverse(0, &direction[axis], &mut image[axis])
            }
            Traction::AlongY => {
                half_space.single_axis_shear_inverse(1, &direction[axis], &mut image[axis])
            }
        }
        cells[axis].iter().for_each(|&c| direction[axis][c] = 0.0);
        coarse.prepare(&cells[axis], |c| image[axis][c], |_| 1.0);
    }
    // Setting the springs of a single field has already preconditioned a unit displacement.
    let mut is_preconditioned = axes == 1
        && start.is_none()
        && !coarse.is_empty()
        && cells[0].iter().all(|&c| motion(0, c) == 1.0);
    let mut energy = 0.0;
    // Energy that each of the last three iterations added. The start counts as one.
    let mut increments = [f64::INFINITY; 3];
    if let Some(start) = start {
        for &c in &cells[0] {
            density[0][c] = start[c];
        }
        let work = dot(&density, &residual);
        if work != 0.0 {
            half_space.shear_of_x(&density[0], &mut image);
            let factor = work / dot(&density, &image);
            energy = factor * work;
            increments[0] = energy;
            for axis in 0..axes {
                for &c in &cells[axis] {
                    density[axis][c] *= factor;
                    residual[axis][c] -= factor * image[axis][c];
                }
            }
        }
    }
    let (mut source, mut target) = (Vec::new(), Vec::new());
    let mut product = f64::INFINITY;
    let mut iterations = 0;
    while (0..axes).any(moves) {
        if !std::mem::take(&mut is_preconditioned) {
            precondition(half_space, &residual, &mut image);
        }
        for (axis, coarse) in coarse.iter_mut().enumerate() {
            gather(&residual[axis], &cells[axis], &mut source);
            gather(&image[axis], &cells[axis], &mut target);
            coarse.correct(&cells[axis], &source, &mut target);
            scatter(&target, &cells[axis], &mut image[axis]);
        }
        let new_product = dot(&residual, &image);
        let allowed_error = tolerance * tolerance * energy;
        if new_product.abs() <= NEGLIGIBLE_ENERGY * allowed_error {
            break;
        }
        if iterations == MAX_ITERATIONS {
            return Err(ContactError::NotConverged {
                problem: "stiffness",
                iterations,
                error: (remaining_energy(&increments) / energy).sqrt(),
                tolerance,
            });
        }
        if new_product <= 0.0 && !coarse.is_empty() {
            // The far-field correction is not positive on the given cells, so continue without the correction.
            coarse.clear();
            product = f64::INFINITY;
            continue;
        }
        let beta = new_product / product;
        product = new_product;
        for axis in 0..axes {
            for &c in &cells[axis] {
                direction[axis][c] = image[axis][c] + beta * direction[axis][c];
            }
        }
        apply(half_space, &direction, &mut image);
        let length = product / dot(&direction, &image);
        for axis in 0..axes {
            for &c in &cells[axis] {
                density[axis][c] += length * direction[axis][c];
                residual[axis][c] -= length * image[axis][c];
            }
        }
        iterations += 1;
        let increment = length * product;
        energy += increment;
        increments = [increment, increments[0], increments[1]];
        let remaining = remaining_energy(&increments);
        if increments[2].is_finite() && remaining <= tolerance * tolerance * energy {
            energy += remaining;
            break;
        }
    }
    Ok(MotionSolution {
        density,
        residual,
        energy,
        iterations,
    })
}

/// Estimates the energy that all further iterations would add, from the increments of the last three, latest first.
fn remaining_energy([last, before, earlier]: &[f64; 3]) -> f64 {
    let rate = (last / before).max(before / earlier).min(MAX_RATE);
    last * rate / (1.0 - rate)
}
