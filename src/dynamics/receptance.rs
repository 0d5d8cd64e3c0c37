//! Structure given by its receptance matrix.

use num_complex::Complex64;

use super::DynamicsError;
use super::closed_model::{ClosedModel, Core, DampingLoss};
use super::linear_model::LinearModel;
use crate::linalg::RowMatrix as Matrix;

/// Structure that the user describes by a receptance matrix, for example from a measurement or a direct solution.
pub struct Receptance<F> {
    /// Receptance of the ports without contact springs at an angular frequency \[m/N\], `ports × ports`, symmetric. The
    /// harmonic balance evaluates the receptance at all its frequencies, including 0.
    pub receptance: F,
    /// Number of ports.
    pub ports: usize,
    /// Number of contact degrees of freedom, which are the first ports.
    pub contact_dofs: usize,
}

impl<F> LinearModel for Receptance<F>
where
    F: Fn(f64) -> Matrix<Complex64> + Clone + Send + Sync + 'static,
{
    fn contact_dofs(&self) -> usize {
        self.contact_dofs
    }

    fn ports(&self) -> usize {
        self.ports
    }

    fn with_closed_contact(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError> {
        if springs.len() != self.contact_dofs {
            return Err(DynamicsError::Length {
                what: "contact springs",
                found: springs.len(),
                expected: self.contact_dofs,
            });
        }
        Ok(ClosedModel {
            leading_coordinates: self.ports,
            element_flexibility: None,
            basis: None,
            residual: None,
            core: Box::new(ReceptanceCore {
                matrix: self.receptance.clone(),
                ports: self.ports,
                springs: springs.to_vec(),
            }),
            rigid_motions: None,
        })
    }
}

struct ReceptanceCore<F> {
    matrix: F,
    ports: usize,
    springs: Vec<f64>,
}

impl<F: Fn(f64) -> Matrix<Complex64> + Send + Sync> Core for ReceptanceCore<F> {
    fn coordinates(&self) -> usize {
        self.ports
    }

    fn receptance(&self, omega: f64) -> Result<Matrix<Complex64>, DynamicsError> {
        let mut free = (self.matrix)(omega);
        if free.rows() != self.ports || free.columns() != self.ports {
            return Err(DynamicsError::Length {
                what: "receptance matrix",
                found: free.rows() * free.columns(),
                expected: self.ports * self.ports,
            });
        }
        let mut system = Matrix::identity(self.ports);
        for i in 0..self.ports {
            for (j, &spring) in self.springs.iter().enumerate() {
                system.set(i, j, system.at(i, j) + free.at(i, j) * spring);
            }
        }
        system
            .factorize()
            .map_err(DynamicsError::matrix_error(
                "receptance with closed contact",
            ))?
            .solve_columns(&mut free);
        Ok(free)
    }

    fn loss(&self, _omega: f64, displacement: &[Complex64], force: &[Complex64]) -> DampingLoss {
        // Springs dissipate nothing, so the loss of the structure equals the work of the forces on the closed
        // structure.
        let pairs = force.iter().zip(displacement);
        DampingLoss {
            viscous: std::f64::consts::PI * pairs.map(|(f, u)| (f * u.conj()).im).sum::<f64>(),
            hysteretic: 0.0,
        }
    }
}
