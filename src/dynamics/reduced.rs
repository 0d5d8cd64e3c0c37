//! The reduced finite-element structure as the harmonic balance sees it.
//!
//! [`Reduced`] has for every contact element the displacement of the upper body *minus*
//! that of the lower one, so its normal port is positive where the joint opens; here a normal displacement is positive where
//! the bodies approach. x and y are the same in both.
//!
//! The slope of the residual over ω² is in [`pseudo_modes`](super::pseudo_modes): without them the resonance of the 30-mode resonator
//! at 979 Hz would lie 0.060 Hz too high and its flanks be off by 1.5 %; with six it is within 0.001 Hz and 0.02 %.

use super::linear_model::SecondOrder;
use super::pseudo_modes::pseudo_modes;
use super::{DynamicsError, InterfaceElement};
use crate::linalg;
use crate::linalg::RowMatrix as Matrix;
use crate::structure::reduction::{Reduced, remove};

/// Pseudo-modes beside the modes of a reduced structure. Of the 30-mode resonator at 979 Hz, six leave 0.001 Hz of what the slope of
/// the residual moves the resonance by, twelve no less: the rest is that of the slope itself. Each costs as much as a mode.
const PSEUDO_MODES: usize = 6;

/// Modal damping: every mode of the structure, closed by springs or free, has the same damping ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping<'a> {
    /// Damping ratio ζ of every elastic mode.
    pub ratio: f64,
    /// The springs \[N/m\] of the joint whose modes are meant, one per contact degree of freedom: [`reference_springs`] of the
    /// *unworn* elements for the basis `stuck`, whatever the elements are by now. None: the basis `free`, without springs.
    pub springs: Option<&'a [f64]>,
}

/// The springs of the stuck state of `elements` \[N/m\], x, y, n of each in turn.
pub fn reference_springs<E: InterfaceElement>(elements: &[E]) -> Vec<f64> {
    let each = elements.iter().map(E::reference_stiffness);
    each.flatten().collect()
}

/// The linear model of a reduced structure, at its contact ports and at the other `ports` asked for.
///
/// Ports of the model: the contact degrees of freedom in the order of the elements (x, y, n each), then `ports[k]` (a port of the
/// reduced structure, see [`Ports::of_point`](crate::structure::reduction::Ports::of_point); the same one may occur twice) as
/// number `contact_dofs + k`. Coordinates are the rigid modes, then the elastic ones, then pseudo-modes. A tied joint has no contact degrees of
/// freedom, and its model is linear.
///
/// # Errors
/// [`DynamicsError::OutOfRange`] for a port that is a contact port or none, or a negative ratio; [`DynamicsError::Length`] if
/// there are not as many springs as contact degrees of freedom; [`DynamicsError::Matrix`] for a residual that is no flexibility.
pub fn reduced_model(
    reduced: &Reduced,
    ports: &[usize],
    damping: Damping<'_>,
) -> Result<SecondOrder, DynamicsError> {
    let contact = reduced.ports.contact_ports();
    for &port in ports {
        if port < contact || port >= reduced.ports.len() {
            return Err(DynamicsError::OutOfRange {
                name: "a port beside those of the contact",
                value: port as f64,
                expected: "the index of a point's port in the reduced structure",
            });
        }
    }
    let kept: Vec<usize> = (0..contact).chain(ports.iter().copied()).collect();
    // Of the ports in use alone: others would change what the few pseudo-modes stand for.
    let mut used = kept.clone();
    used.sort_unstable();
    used.dedup();
    let of_used = |matrix: &linalg::Matrix| -> Matrix {
        let mut out = Matrix::zeros(used.len(), used.len());
        for (i, &port) in used.iter().enumerate() {
            for (value, &other) in out.row_mut(i).iter_mut().zip(&used) {
                *value = matrix[(port, other)];
            }
        }
        out
    };
    let (residual, slope) = (of_used(&reduced.residual), of_used(&reduced.residual_slope));
    let pseudo = pseudo_modes(&residual, &slope, PSEUDO_MODES)?;
    drop((residual, slope));
    let place = |port: usize| used.binary_search(&port).expect("a port in use");
    let held = reduced.rigid.columns();
    let mut frequencies = vec![0.0; held];
    frequencies.extend(reduced.omega.iter().chain(&pseudo.omega));
    let elastic = held + reduced.omega.len();
    let mut shapes = Matrix::zeros(kept.len(), frequencies.len());
    let mut residual = Matrix::zeros(kept.len(), kept.len());
    for (i, &port) in kept.iter().enumerate() {
        for (r, value) in shapes.row_mut(i).iter_mut().enumerate() {
            *value = if r < held {
                reduced.rigid[(port, r)]
            } else if r < elastic {
                reduced.shapes[(port, r - held)]
            } else {
                pseudo.shapes.at(place(port), r - elastic)
            };
        }
        for (value, &other) in residual.row_mut(i).iter_mut().zip(&kept) {
            *value = pseudo.residual.at(place(port), place(other));
        }
    }
    let normal: Vec<usize> = (2..contact).step_by(3).collect();
    let free = vec![0.0; contact];
    let mut model = SecondOrder::from_modes(&frequencies, shapes, Some(residual), contact)?;
    model.static_coordinates = pseudo.omega.len();
    let mut model = model
        .with_reversed_ports(&normal)
        .with_damping_ratio(damping.ratio, damping.springs.unwrap_or(&free))?;
    // Those of the structure itself, between its modes; pseudo-modes come after them.
    let own = [
        (&mut model.damping, &reduced.damping),
        (&mut model.hysteretic, &reduced.hysteretic),
    ];
    for (all, own) in own {
        let Some(own) = own else {
            continue;
        };
        for i in 0..own.rows() {
            for j in 0..own.columns() {
                all.set(i, j, all.at(i, j) + own[(i, j)]);
            }
        }
    }
    Ok(model)
}

/// What the reduced model is off the structure at the ports, at an imaginary frequency where the structure's flexibility (K + sM)⁻¹ is known: the
/// largest difference over the largest entry; none without it. It grows with the square of frequency, by the inertia that pseudo-modes leave out, or
/// faster. Terms of the series that are left out alternate there and add up at a real frequency, so that it tells their size and not their sum.
///
/// # Errors
/// [`DynamicsError::Matrix`] for a residual that is no flexibility.
pub fn reduction_error(reduced: &Reduced) -> Result<Option<f64>, DynamicsError> {
    let Some(checked) = &reduced.checked else {
        return Ok(None);
    };
    let slope = by_rows(&reduced.residual_slope);
    let pseudo = pseudo_modes(&by_rows(&reduced.residual), &slope, PSEUDO_MODES)?;
    let ports = reduced.ports.len();
    let shapes = linalg::Matrix::from_fn(ports, pseudo.omega.len(), |port, r| {
        pseudo.shapes.at(port, r)
    });
    let mut left = checked.flexibility.clone();
    let part = |omega: f64| 1.0 / (omega * omega + checked.shift);
    remove(&mut left, &reduced.rigid, |_| part(0.0));
    remove(&mut left, &reduced.shapes, |r| part(reduced.omega[r]));
    remove(&mut left, &shapes, |r| part(pseudo.omega[r]));
    // What is no number is the largest, and told.
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).max_by(f64::total_cmp);
    let places = || (0..ports).flat_map(|i| (0..ports).map(move |j| (i, j)));
    let off = largest(&mut places().map(|(i, j)| left[(i, j)] - pseudo.residual.at(i, j)));
    let size = largest(&mut checked.flexibility.as_slice().iter().copied());
    Ok(off.zip(size).map(|(off, size)| off / size))
}

/// A symmetric matrix by rows.
fn by_rows(matrix: &linalg::Matrix) -> Matrix {
    let mut out = Matrix::zeros(matrix.rows(), matrix.columns());
    out.values_mut().copy_from_slice(matrix.as_slice());
    out
}
