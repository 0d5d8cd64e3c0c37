//! Reduced finite-element structure as a model for the harmonic balance.
//!
//! For every contact element, [`ReducedStructure`] stores the displacement of the upper body *minus* the displacement
//! of the lower body. The normal port of an element in the reduced structure is positive when the joint opens. In the
//! harmonic balance, a normal displacement is positive when the bodies approach. The displacements along x and y have
//! the same signs in the reduced structure and in the harmonic balance.
//!
//! [`pseudo_modes`](super::pseudo_modes) represent the slope of the residual over ω². An example is the 30-mode
//! resonator with a resonance at 979 Hz. Without pseudo-modes, the resonance frequency of the resonator is 0.060 Hz too
//! high, and the flanks of the resonance have an error of 1.5 %. With six pseudo-modes, the error of the resonance
//! frequency is 0.001 Hz, and the error of the flanks is 0.02 %.

use super::linear_model::SecondOrder;
use super::pseudo_modes::{PseudoModeSettings, pseudo_modes};
use super::{DynamicsError, InterfaceElement};
use crate::linalg;
use crate::linalg::RowMatrix as Matrix;
use crate::structure::reduction::{ReducedStructure, subtract_modes};

/// Modal damping: every mode of the structure, closed by springs or free, has the same damping ratio.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping<'a> {
    /// Damping ratio ζ of every elastic mode.
    pub ratio: f64,
    /// Springs \[N/m\] of the joint that define the modes, one per contact degree of freedom. The basis `stuck` uses
    /// [`reference_springs`] of the *unworn* elements, whatever the present elements. `None` is the basis `free`,
    /// without springs.
    pub springs: Option<&'a [f64]>,
}

/// Returns the spring stiffnesses of `elements` in the stuck state \[N/m\]. The vector contains the stiffnesses along
/// x, y and n of each element in turn.
pub fn reference_springs<E: InterfaceElement>(elements: &[E]) -> Vec<f64> {
    let each = elements.iter().map(E::reference_stiffness);
    each.flatten().collect()
}

/// Creates the linear model of a reduced structure, with its contact ports and the additional `ports`.
///
/// The first ports of the model are the contact degrees of freedom in the order of the elements (x, y, n each). The
/// additional port `ports[k]` follows as port number `contact_dofs + k`. `ports[k]` is a port of the reduced structure,
/// see [`Ports::of_point`](crate::structure::reduction::Ports::of_point); a port can occur twice. Coordinates are the
/// rigid modes, then the elastic modes, then the pseudo-modes. A tied joint has no contact degrees of freedom, and its
/// model is linear.
///
/// # Errors
/// Returns [`DynamicsError::OutOfRange`] if an additional port is a contact port or does not exist, or if a damping
/// ratio is negative. Returns [`DynamicsError::Length`] if the numbers of springs and contact degrees of freedom
/// differ. Returns [`DynamicsError::Matrix`] if the residual is not a flexibility.
pub fn reduced_model(
    reduced: &ReducedStructure,
    ports: &[usize],
    damping: Damping<'_>,
) -> Result<SecondOrder, DynamicsError> {
    let contact = reduced.ports.contact_ports();
    for &port in ports {
        if port < contact || port >= reduced.ports.len() {
            return Err(DynamicsError::OutOfRange {
                name: "an additional port of the structure",
                value: port as f64,
                expected: "the index of a point's port in the reduced structure",
            });
        }
    }
    let model_ports: Vec<usize> = (0..contact).chain(ports.iter().copied()).collect();
    // The pseudo-modes represent only the ports in use, because other ports would change the few pseudo-modes.
    let mut used_ports = model_ports.clone();
    used_ports.sort_unstable();
    used_ports.dedup();
    let restricted = |matrix: &linalg::Matrix| -> Matrix {
        let mut out = Matrix::zeros(used_ports.len(), used_ports.len());
        for (i, &port) in used_ports.iter().enumerate() {
            for (value, &other) in out.row_mut(i).iter_mut().zip(&used_ports) {
                *value = matrix[(port, other)];
            }
        }
        out
    };
    let (residual, slope) = (
        restricted(&reduced.residual),
        restricted(&reduced.residual_slope),
    );
    let pseudo = pseudo_modes(&residual, &slope, PseudoModeSettings::default())?;
    drop((residual, slope));
    let place = |port: usize| used_ports.binary_search(&port).expect("a port in use");
    let rigid_count = reduced.rigid.columns();
    let mut frequencies = vec![0.0; rigid_count];
    frequencies.extend(reduced.omega.iter().chain(&pseudo.omega));
    let elastic = rigid_count + reduced.omega.len();
    let mut shapes = Matrix::zeros(model_ports.len(), frequencies.len());
    let mut residual = Matrix::zeros(model_ports.len(), model_ports.len());
    for (i, &port) in model_ports.iter().enumerate() {
        for (r, value) in shapes.row_mut(i).iter_mut().enumerate() {
            *value = if r < rigid_count {
                reduced.rigid[(port, r)]
            } else if r < elastic {
                reduced.shapes[(port, r - rigid_count)]
            } else {
                pseudo.shapes.at(place(port), r - elastic)
            };
        }
        for (value, &other) in residual.row_mut(i).iter_mut().zip(&model_ports) {
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
    // Damping of the structure itself, between its modes. The pseudo-modes follow the modes in the matrices, and get no
    // damping of the structure itself.
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

/// Computes the relative error of the flexibility of the reduced model at the ports. The error is the largest
/// difference of an entry, divided by the largest entry. The comparison uses an imaginary frequency where the
/// flexibility (K + sM)⁻¹ of the structure is known. Returns `None` if the flexibility (K + sM)⁻¹ of the structure is
/// unknown.
///
/// The error of the reduced model grows at least with the square of the frequency, because the pseudo-modes omit some
/// inertia. The omitted terms of the series alternate in sign at the imaginary frequency, and add up at a real
/// frequency. Because the signs alternate, the error at the imaginary frequency shows only the size of the omitted
/// terms. The error at a real frequency is the sum of the omitted terms, and can be larger.
///
/// # Errors
/// Returns [`DynamicsError::Matrix`] for a residual that is not a flexibility.
pub fn reduction_error(reduced: &ReducedStructure) -> Result<Option<f64>, DynamicsError> {
    let Some(checked) = &reduced.reference else {
        return Ok(None);
    };
    let slope = by_rows(&reduced.residual_slope);
    let pseudo = pseudo_modes(
        &by_rows(&reduced.residual),
        &slope,
        PseudoModeSettings::default(),
    )?;
    let ports = reduced.ports.len();
    let shapes = linalg::Matrix::from_fn(ports, pseudo.omega.len(), |port, r| {
        pseudo.shapes.at(port, r)
    });
    let mut remaining = checked.flexibility.clone();
    let receptance = |omega: f64| 1.0 / (omega * omega + checked.shift);
    subtract_modes(&mut remaining, &reduced.rigid, |_| receptance(0.0));
    subtract_modes(&mut remaining, &reduced.shapes, |r| {
        receptance(reduced.omega[r])
    });
    subtract_modes(&mut remaining, &shapes, |r| receptance(pseudo.omega[r]));
    // NaN sorts last and is reported.
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).max_by(f64::total_cmp);
    let places = || (0..ports).flat_map(|i| (0..ports).map(move |j| (i, j)));
    let difference =
        largest(&mut places().map(|(i, j)| remaining[(i, j)] - pseudo.residual.at(i, j)));
    let size = largest(&mut checked.flexibility.as_slice().iter().copied());
    Ok(difference
        .zip(size)
        .map(|(difference, size)| difference / size))
}

/// Converts a symmetric matrix to storage by rows.
fn by_rows(matrix: &linalg::Matrix) -> Matrix {
    let mut out = Matrix::zeros(matrix.rows(), matrix.columns());
    out.values_mut().copy_from_slice(matrix.as_slice());
    out
}
