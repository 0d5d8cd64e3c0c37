//! Single mass on one contact element: the smallest structure that can slip, twist and lift off.

use super::contact_element::ContactElement;
use super::linear_model::SecondOrder;
use super::{DynamicsError, Load};
use crate::linalg::RowMatrix as Matrix;

/// Mass with one contact element to the ground. A spring and a damper along each axis connect the mass to the ground.
///
/// The axes are x, y (in the plane of the contact) and n (positive when the mass approaches the ground). The ports of
/// the oscillator are the displacements of the mass along x, y and n.
#[derive(Debug, Clone, PartialEq)]
pub struct Oscillator {
    /// Mass per axis \[kg\].
    pub mass: [f64; 3],
    /// Viscous damping per axis \[N s/m\].
    pub damping: [f64; 3],
    /// Stiffness per axis, without the contact \[N/m\].
    pub stiffness: [f64; 3],
    /// The contact element.
    pub element: ContactElement,
}

impl Oscillator {
    /// Creates the linear part of the oscillator.
    ///
    /// # Errors
    /// As [`mass_on_springs`].
    pub fn model(&self) -> Result<SecondOrder, DynamicsError> {
        mass_on_springs(self.mass, self.damping, self.stiffness, 3)
    }

    /// Creates a load `amplitude · cos(ωt + phase)` along `axis` (0 is x, 1 is y, 2 is n). The unit of `amplitude` is
    /// N, and the unit of `phase` is rad.
    pub fn load(axis: usize, amplitude: f64, phase: f64) -> Load {
        Load {
            port: axis,
            harmonic: 1,
            cosine: amplitude * phase.cos(),
            sine: -amplitude * phase.sin(),
        }
    }
}

/// Creates a mass with a spring and a damper to the ground along each axis. The displacements of the mass are the
/// ports, and the first `contact_dofs` (0 or 3) ports belong to a contact.
///
/// # Errors
/// Returns [`DynamicsError::OutOfRange`] if a mass is not positive, or if a damping or a stiffness is negative.
pub fn mass_on_springs(
    mass: [f64; 3],
    damping: [f64; 3],
    stiffness: [f64; 3],
    contact_dofs: usize,
) -> Result<SecondOrder, DynamicsError> {
    for (name, values, least) in [
        ("the mass along an axis", mass, f64::MIN_POSITIVE),
        ("the damping along an axis", damping, 0.0),
        ("the stiffness along an axis", stiffness, 0.0),
    ] {
        for value in values {
            if !(value >= least && value.is_finite()) {
                return Err(DynamicsError::OutOfRange {
                    name,
                    value,
                    expected: if least > 0.0 {
                        "a positive finite number"
                    } else {
                        "a finite number, zero or more"
                    },
                });
            }
        }
    }
    Ok(SecondOrder {
        mass: Matrix::diagonal(&mass),
        damping: Matrix::diagonal(&damping),
        hysteretic: Matrix::zeros(3, 3),
        stiffness: Matrix::diagonal(&stiffness),
        basis: Matrix::identity(3),
        residual: None,
        contact_dofs,
        static_coordinates: 0,
    })
}
