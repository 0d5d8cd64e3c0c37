//! Contact stiffness by exact linearisation on the contact set: no cell enters, leaves or slips.
//!
//! kn is the slope dN/dδ of the indentation curve, kt the slope dT/dδ at full stick. Capped cells carry a fixed pressure, so
//! they count in kt and not in kn.
//!
//! [`normal`] and [`tangential`] take the blocks of K by themselves: kn where the surfaces slide freely, kt at given pressures.
//! [`coupled`] takes both together, for bodies that differ elastically and cells that stick: normal motion then shears them
//! and tangential motion presses them, which makes both stiffer, by a part of the order β².

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
        &[set],
        &unit,
        |axis, _| unit[axis],
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
    linearise(
        half_space,
        &vec![set; unit.len()],
        &unit,
        |axis, _| unit[axis],
        compliance,
        stiffness,
    )
}

/// What follows freely, without a force or moment, while the bodies move along x by a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Following {
    /// The displacement along y.
    pub transverse: bool,
    /// The rotation about z through the grid's centre.
    pub rotation: bool,
}

/// kt along x over the cells of `set`, under shear in the plane, with what follows: one more solve for each.
pub fn tangential_following(
    half_space: &mut HalfSpace,
    set: &[bool],
    following: Following,
) -> Result<Stiffness, ContactError> {
    let grid = half_space.grid();
    // The displacement field of each motion: along x, along y, and a turn that moves the corners by about a unit.
    let arm = 0.5 * grid.size()[0].hypot(grid.size()[1]);
    let field = |motion: usize, axis: usize, c: usize| {
        let (i, j) = grid.cell(c);
        let (x, y) = grid.centre(i, j);
        match motion {
            2 => [-y, x][axis] / arm,
            _ => f64::from(u8::from(motion == axis)),
        }
    };
    let mut moved = [
        Some(0),
        following.transverse.then_some(1),
        following.rotation.then_some(2),
    ]
    .into_iter()
    .flatten()
    .map(|motion| {
        let unit = vec![1.0; 2];
        let given = |axis: usize, c: usize| field(motion, axis, c);
        let sets = vec![set; 2];
        linearise(half_space, &sets, &unit, given, compliance, stiffness)
            .map(|solution| (motion, solution))
    })
    .collect::<Result<Vec<_>, _>>()?;
    if moved
        .iter()
        .any(|(_, solution)| solution.total.is_infinite())
    {
        return tangential(half_space, set, Shear::InPlane);
    }
    // Each follower in turn moves such that its resultant vanishes, for x and for those after it.
    let resultant = |density: &Field, motion: usize| -> f64 {
        let on_axis = |axis: usize| {
            let density = density[axis].iter().enumerate();
            density
                .map(|(c, q)| q * field(motion, axis, c))
                .sum::<f64>()
        };
        on_axis(0) + on_axis(1)
    };
    while moved.len() > 1
        && let Some((motion, follower)) = moved.pop()
    {
        let own = resultant(&follower.density, motion);
        for (_, other) in &mut moved {
            let part = if own > 0.0 {
                resultant(&other.density, motion) / own
            } else {
                0.0
            };
            for (density, less) in other.density.iter_mut().zip(&follower.density) {
                for (density, less) in density.iter_mut().zip(less) {
                    *density -= part * less;
                }
            }
            other.iterations += follower.iterations;
        }
    }
    let (_, mut found) = moved.remove(0);
    found.total = resultant(&found.density, 0) * grid.cell_area();
    Ok(found)
}

/// What moves by a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// The approach, with no tangential motion.
    Normal,
    /// The displacement along x, at a constant approach and with no motion along y.
    AlongX,
}

/// kn or kt of the whole K. Elastic cells of `pressed` keep their gap closed, cells of `stuck` do not slip; cells of one set alone
/// keep the traction of the other kind. Densities are those of the pressure, then of the shear along each axis.
pub fn coupled(
    half_space: &mut HalfSpace,
    direction: Direction,
    pressed: &[bool],
    stuck: &[bool],
    shear: Shear,
) -> Result<Stiffness, ContactError> {
    let mut unit = match shear {
        Shear::AlongX => vec![0.0; 2],
        Shear::InPlane => vec![0.0; 3],
    };
    unit[usize::from(direction == Direction::AlongX)] = 1.0;
    let mut sets = vec![stuck; unit.len()];
    sets[0] = pressed;
    let cells = half_space.grid().len();
    let mut lag = vec![vec![0.0; cells]; unit.len() - 1];
    let mut opening = vec![0.0; cells];
    linearise(
        half_space,
        &sets,
        &unit,
        |axis, _| unit[axis],
        |half_space, traction, displacement| {
            let shear = traction[1..].to_vec();
            let mut along = displacement.split_off(1);
            half_space.normal(&traction[0], &mut displacement[0]);
            compliance(half_space, &shear, &mut along);
            displacement.extend(along);
            half_space.normal_of_shear(&shear, &mut opening);
            half_space.shear_of_normal(&traction[0], &mut lag);
            for (u, w) in displacement
                .iter_mut()
                .zip([&opening].into_iter().chain(&lag))
            {
                u.iter_mut().zip(w).for_each(|(u, w)| *u += w);
            }
        },
        |half_space, displacement, traction| {
            let mut shear = traction.split_off(1);
            half_space.normal_inverse(&displacement[0], &mut traction[0]);
            stiffness(half_space, &displacement[1..].to_vec(), &mut shear);
            traction.extend(shear);
        },
    )
}

type Field = ByAxis<Vec<f64>>;

/// Preconditioned conjugate gradients for K x = `given`, a displacement of the order of `unit` along each axis, each field on its
/// set.
fn linearise(
    half_space: &mut HalfSpace,
    sets: &[&[bool]],
    unit: &ByAxis<f64>,
    given: impl Fn(usize, usize) -> f64,
    mut apply: impl FnMut(&mut HalfSpace, &Field, &mut Field),
    mut precondition: impl FnMut(&mut HalfSpace, &Field, &mut Field),
) -> Result<Stiffness, ContactError> {
    let (axes, grid) = (unit.len(), half_space.grid());
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
            residual[axis][c] = given(axis, c);
        }
    }
    let full = |axis: usize| unit[axis] != 0.0 && cells[axis].len() == grid.len();
    if half_space.boundary() == Boundary::Periodic && (0..axes).any(full) {
        return Ok(Stiffness {
            density,
            total: f64::INFINITY,
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
    let (mut first, mut product) = (0.0, 0.0);
    let mut iterations = 0;
    while (0..axes).any(|axis| unit[axis] != 0.0 && !cells[axis].is_empty()) {
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
    }
    let resultant = |axis: usize| {
        let on_cells = cells[axis]
            .iter()
            .map(|&c| density[axis][c] * given(axis, c));
        on_cells.sum::<f64>() * grid.cell_area()
    };
    let total = (0..axes).map(resultant).sum();
    Ok(Stiffness {
        density,
        total,
        iterations,
    })
}
