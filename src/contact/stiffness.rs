//! Contact stiffness by exact linearisation on the contact set: no cell enters, leaves or slips.
//!
//! kn is the slope dN/dδ of the indentation curve, kt the slope dT/dδ at full stick. Capped cells carry a fixed pressure, so
//! they count in kt and not in kn.

use super::error::ContactError;
use super::half_space::{Boundary, HalfSpace, Shear};
use super::tangential::{compliance, stiffness};
use crate::grid::ByAxis;

/// Part of the first residual (in the preconditioner's norm) at which a solve stops. The stiffness is an energy, so its
/// relative error is about the square of this.
const RESIDUAL: f64 = 1e-6;

/// Bound on conjugate gradient iterations; a contact set of any shape takes a few dozen.
const MAX_ITERATIONS: usize = 2000;

/// Pressures (or shears) under a unit displacement of a set of cells, and their resultant.
#[derive(Debug, Clone, PartialEq)]
pub struct Stiffness {
    /// Traction per displacement on each cell, 0 off the set; one field an axis \[Pa/m\].
    pub density: ByAxis<Vec<f64>>,
    /// Resultant along the displacement \[N/m\]; infinite for a full periodic contact, which no load displaces against the
    /// mean.
    pub total: f64,
    /// Conjugate gradient iterations.
    pub iterations: usize,
}

/// kn = 1ᵀ K_CC⁻¹ 1 dA over the cells of `set`.
pub fn normal(half_space: &mut HalfSpace, set: &[bool]) -> Result<Stiffness, ContactError> {
    let unit = vec![1.0];
    linearise(
        half_space,
        set,
        &unit,
        |h, p, u| h.normal(&p[0], &mut u[0]),
        |h, u, p| h.normal_inverse(&u[0], &mut p[0]),
    )
}

/// kt along x over the cells of `set`; with [`Shear::InPlane`] the transverse displacement is held at zero.
pub fn tangential(
    half_space: &mut HalfSpace,
    set: &[bool],
    shear: Shear,
) -> Result<Stiffness, ContactError> {
    let unit = match shear {
        Shear::AlongX => vec![1.0],
        Shear::InPlane => vec![1.0, 0.0],
    };
    linearise(half_space, set, &unit, compliance, stiffness)
}

type Field = ByAxis<Vec<f64>>;

/// Preconditioned conjugate gradients for K x = `unit` on the set.
fn linearise(
    half_space: &mut HalfSpace,
    set: &[bool],
    unit: &ByAxis<f64>,
    mut apply: impl FnMut(&mut HalfSpace, &Field, &mut Field),
    mut precondition: impl FnMut(&mut HalfSpace, &Field, &mut Field),
) -> Result<Stiffness, ContactError> {
    let (axes, grid) = (unit.len(), half_space.grid());
    if set.len() != grid.len() {
        return Err(ContactError::Length {
            field: "contact set",
            found: set.len(),
            expected: grid.len(),
        });
    }
    let cells: Vec<usize> = (0..set.len()).filter(|&c| set[c]).collect();
    let zeros = || vec![vec![0.0; set.len()]; axes];
    let (mut density, mut residual, mut direction, mut image) =
        (zeros(), zeros(), zeros(), zeros());
    for axis in 0..axes {
        for &c in &cells {
            residual[axis][c] = unit[axis];
        }
    }
    if half_space.boundary() == Boundary::Periodic && cells.len() == grid.len() {
        return Ok(Stiffness {
            density,
            total: f64::INFINITY,
            iterations: 0,
        });
    }
    let dot = |a: &Field, b: &Field| -> f64 {
        (0..axes)
            .map(|axis| cells.iter().map(|&c| a[axis][c] * b[axis][c]).sum::<f64>())
            .sum()
    };
    let (mut first, mut product) = (0.0, 0.0);
    let mut iterations = 0;
    while !cells.is_empty() {
        precondition(half_space, &residual, &mut image);
        let new_product = dot(&residual, &image);
        if iterations == 0 {
            first = new_product;
        }
        if new_product <= RESIDUAL * RESIDUAL * first {
            break;
        }
        if iterations == MAX_ITERATIONS {
            let error = (new_product / first).sqrt();
            return Err(ContactError::NotConverged {
                problem: "stiffness",
                iterations,
                error,
                tolerance: RESIDUAL,
            });
        }
        let beta = if iterations == 0 {
            0.0
        } else {
            new_product / product
        };
        product = new_product;
        for axis in 0..axes {
            for &c in &cells {
                direction[axis][c] = image[axis][c] + beta * direction[axis][c];
            }
        }
        apply(half_space, &direction, &mut image);
        let length = product / dot(&direction, &image);
        for axis in 0..axes {
            for &c in &cells {
                density[axis][c] += length * direction[axis][c];
                residual[axis][c] -= length * image[axis][c];
            }
        }
        iterations += 1;
    }
    let resultant = |axis: usize| density[axis].iter().sum::<f64>() * unit[axis] * grid.cell_area();
    let total = (0..axes).map(resultant).sum();
    Ok(Stiffness {
        density,
        total,
        iterations,
    })
}
