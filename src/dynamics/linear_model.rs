//! Linear structure as seen by the contact: displacements of *ports* due to forces at ports.
//!
//! The first ports are the contact degrees of freedom (x, y, n of every element). All ports after the contact degrees
//! of freedom are driven or observed. A port can be a combination of nodes (a point between nodes, a resultant).

use std::f64::consts::TAU;

use num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::DynamicsError;
use super::closed_model::{ClosedModel, Core, DampingLoss};
use crate::linalg::{RowMatrix as Matrix, add_scaled, generalised_eigen};

/// Share of the largest eigenvalue below which a coordinate is a rigid body motion; modes of one structure span 1e8.
const RIGID: f64 = 1e-11;
/// Ratio of the dynamic stiffness to the sum of its elastic and inertial parts. Below this ratio, the frequency counts
/// as an undamped resonance.
const RESONANT: f64 = 1e-13;

/// Linear structure with contact ports.
pub trait LinearModel {
    /// Returns the number of contact degrees of freedom, three per element. The contact degrees of freedom are the
    /// first ports.
    fn contact_dofs(&self) -> usize;

    /// Returns the number of all ports.
    fn ports(&self) -> usize;

    /// Closes the contact by a linear spring of `springs[i]` \[N/m\] in every contact degree of freedom.
    ///
    /// # Errors
    /// [`DynamicsError`] if the numbers do not match or a matrix is singular.
    fn with_closed_contact(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError>;
}

/// Rayleigh damping C = αM + βK. A mode of angular frequency ω has the damping ratio ζ = α/(2ω) + βω/2.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
pub struct Rayleigh {
    /// Damping coefficient α of the mass matrix \[1/s\], zero or more. The coefficient α damps rigid body motions as
    /// well as vibrations.
    pub mass: f64,
    /// Damping coefficient β of the stiffness matrix \[s\], zero or more.
    pub stiffness: f64,
}

/// Second-order system `M q̈ + C q̇ + K q = Bᵀ f`. The ports have the displacements `u = B q + R f`.
///
/// Hysteretic damping has the matrix H. For each harmonic q̂ = c − i s of order 1 or more, hysteretic damping adds the
/// force i H q̂. The hysteretic force is H s in the cosine row and −H c in the sine row, at any frequency.
///
/// For physical coordinates, B is the identity. For modal coordinates (M = 1, K = diag ω²), B contains the mode shapes
/// at the ports, and R is the static residual of the omitted modes. Matrices are symmetric.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrder {
    /// M, `n × n`, positive definite \[kg\].
    pub mass: Matrix,
    /// C, `n × n` \[N s/m\].
    pub damping: Matrix,
    /// H, hysteretic damping, `n × n` \[N/m\].
    pub hysteretic: Matrix,
    /// K without contact springs, `n × n` \[N/m\].
    pub stiffness: Matrix,
    /// B, `ports × n`.
    pub basis: Matrix,
    /// R, `ports × ports` \[m/N\].
    pub residual: Option<Matrix>,
    /// Number of ports that are contact degrees of freedom.
    pub contact_dofs: usize,
    /// Number of the last coordinates that respond nearly statically to the harmonics of a response, as
    /// [`pseudo_modes`](super::pseudo_modes) do. The number of static coordinates changes the results of the solver
    /// only by rounding.
    pub static_coordinates: usize,
}

impl SecondOrder {
    /// Creates an undamped system from modes. The angular frequencies \[rad/s\] are 0 for rigid body motions. The
    /// shapes at the ports are mass-normalised (`ports × modes`, \[kg^-1/2\]). The residual represents the omitted
    /// modes.
    ///
    /// # Errors
    /// [`DynamicsError::Length`] if the numbers of shapes and frequencies differ.
    pub fn from_modes(
        frequencies: &[f64],
        shapes: Matrix,
        residual: Option<Matrix>,
        contact_dofs: usize,
    ) -> Result<SecondOrder, DynamicsError> {
        let n = frequencies.len();
        let squares: Vec<f64> = frequencies.iter().map(|f| f * f).collect();
        let model = SecondOrder {
            mass: Matrix::identity(n),
            damping: Matrix::zeros(n, n),
            hysteretic: Matrix::zeros(n, n),
            stiffness: Matrix::diagonal(&squares),
            basis: shapes,
            residual,
            contact_dofs,
            static_coordinates: 0,
        };
        model.check(&vec![0.0; contact_dofs])?;
        Ok(model)
    }

    /// Reverses the direction of some ports, for a structure whose normal displacement is positive when the bodies
    /// part.
    pub fn with_reversed_ports(mut self, ports: &[usize]) -> SecondOrder {
        for &port in ports {
            self.basis.row_mut(port).iter_mut().for_each(|b| *b = -*b);
            if let Some(residual) = &mut self.residual {
                for other in 0..residual.rows() {
                    residual.set(port, other, -residual.at(port, other));
                    residual.set(other, port, -residual.at(other, port));
                }
            }
        }
        self
    }

    /// Requires that all pseudo-modes lie above the angular frequency `omega` \[rad/s\]. The argument `key` names the
    /// key of the scene that sets `omega`. The frequency of a pseudo-mode is an upper bound for the frequency of an
    /// omitted mode.
    ///
    /// # Errors
    /// [`DynamicsError::CutOff`].
    pub fn require_modes_up_to(&self, omega: f64, key: &'static str) -> Result<(), DynamicsError> {
        let n = self.mass.rows();
        let squares =
            (n - self.static_coordinates..n).map(|r| self.stiffness.at(r, r) / self.mass.at(r, r));
        let lowest = squares.fold(f64::INFINITY, f64::min).sqrt();
        match lowest <= omega {
            true => Err(DynamicsError::CutOff {
                key,
                frequency: lowest / TAU,
                to: omega / TAU,
            }),
            false => Ok(()),
        }
    }

    fn check(&self, springs: &[f64]) -> Result<(), DynamicsError> {
        let n = self.mass.rows();
        let ports = self.basis.rows();
        let lengths = [
            ("columns of the mass matrix", self.mass.columns(), n),
            ("rows of the damping matrix", self.damping.rows(), n),
            ("columns of the damping matrix", self.damping.columns(), n),
            ("rows of the hysteretic damping", self.hysteretic.rows(), n),
            (
                "columns of the hysteretic damping",
                self.hysteretic.columns(),
                n,
            ),
            ("rows of the stiffness matrix", self.stiffness.rows(), n),
            (
                "columns of the stiffness matrix",
                self.stiffness.columns(),
                n,
            ),
            ("columns of the port matrix", self.basis.columns(), n),
            ("contact springs", springs.len(), self.contact_dofs),
            (
                "static coordinates",
                self.static_coordinates.min(n),
                self.static_coordinates,
            ),
            (
                "contact ports",
                self.contact_dofs.min(ports),
                self.contact_dofs,
            ),
        ];
        for (what, found, expected) in lengths {
            if found != expected {
                return Err(DynamicsError::Length {
                    what,
                    found,
                    expected,
                });
            }
        }
        if let Some(residual) = &self.residual {
            for (what, found) in [
                ("rows of the residual", residual.rows()),
                ("columns of the residual", residual.columns()),
            ] {
                if found != ports {
                    return Err(DynamicsError::Length {
                        what,
                        found,
                        expected: ports,
                    });
                }
            }
        }
        if let Some(&value) = springs.iter().find(|k| !(**k >= 0.0 && k.is_finite())) {
            return Err(DynamicsError::OutOfRange {
                name: "a contact spring",
                value,
                expected: "a finite number, zero or more",
            });
        }
        Ok(())
    }

    /// Computes B̃ = (1 + R K_s)⁻¹ B, R̃ = (1 + R K_s)⁻¹ R and K̃ = K + B_cᵀ K_s B̃_c. The springs K_s are in series
    /// with the residual R.
    fn closed_parts(
        &self,
        springs: &[f64],
    ) -> Result<(Matrix, Option<Matrix>, Matrix), DynamicsError> {
        self.check(springs)?;
        let (basis, residual) = match &self.residual {
            None => (self.basis.clone(), None),
            Some(residual) => {
                let mut system = Matrix::identity(residual.rows());
                for i in 0..residual.rows() {
                    for (j, &spring) in springs.iter().enumerate() {
                        let value = system.at(i, j) + residual.at(i, j) * spring;
                        system.set(i, j, value);
                    }
                }
                let factors = system
                    .factorize()
                    .map_err(DynamicsError::matrix_error("residual with closed contact"))?;
                let (mut basis, mut closed) = (self.basis.clone(), residual.clone());
                factors.solve_columns(&mut basis);
                factors.solve_columns(&mut closed);
                symmetrise(&mut closed);
                (basis, Some(closed))
            }
        };
        let mut spring_rows = Matrix::zeros(springs.len(), basis.columns());
        let mut open_rows = Matrix::zeros(springs.len(), basis.columns());
        for (i, &spring) in springs.iter().enumerate() {
            open_rows.row_mut(i).copy_from_slice(self.basis.row(i));
            add_scaled(spring_rows.row_mut(i), spring, basis.row(i));
        }
        let mut stiffness = self.stiffness.clone();
        stiffness.add_transposed_product(&open_rows, &spring_rows);
        symmetrise(&mut stiffness);
        Ok((basis, residual, stiffness))
    }

    /// Returns the number of coordinates that are not static.
    fn leading(&self) -> usize {
        self.mass.rows() - self.static_coordinates
    }

    /// Returns rows and columns of a matrix that belong to the static coordinates.
    fn static_block(&self, stiffness: &Matrix) -> Matrix {
        let first = self.leading();
        let mut out = Matrix::zeros(self.static_coordinates, self.static_coordinates);
        for i in 0..self.static_coordinates {
            out.row_mut(i)
                .copy_from_slice(&stiffness.row(first + i)[first..]);
        }
        out
    }

    /// Returns the matrix T of q = T r that decouples the static coordinates from the leading coordinates in the
    /// stiffness. In r, the static coordinates are the motion beyond the static response to the leading coordinates.
    fn static_transform(&self, stiffness: &Matrix) -> Result<Matrix, DynamicsError> {
        let (n, first) = (self.mass.rows(), self.leading());
        let mut transform = Matrix::identity(n);
        if self.static_coordinates > 0 {
            let mut coupling = Matrix::zeros(self.static_coordinates, first);
            for i in 0..self.static_coordinates {
                let row = &stiffness.row(first + i)[..first];
                coupling.row_mut(i).copy_from_slice(row);
            }
            self.static_block(stiffness)
                .factorize()
                .map_err(DynamicsError::matrix_error(
                    "stiffness of static coordinates",
                ))?
                .solve_columns(&mut coupling);
            for i in 0..self.static_coordinates {
                add_scaled(
                    &mut transform.row_mut(first + i)[..first],
                    -1.0,
                    coupling.row(i),
                );
            }
        }
        Ok(transform)
    }

    /// Computes the own flexibility of each element \[m/N\], as in [`ClosedModel::element_flexibility`], or `None` without a
    /// residual.
    fn local_flexibility(
        &self,
        basis: &Matrix,
        residual: Option<&Matrix>,
        stiffness: &Matrix,
    ) -> Result<Option<Matrix>, DynamicsError> {
        let Some(residual) = residual else {
            return Ok(None);
        };
        let inverse = match self.static_coordinates {
            0 => Matrix::zeros(0, 0),
            _ => self
                .static_block(stiffness)
                .factorize()
                .map_err(DynamicsError::matrix_error(
                    "stiffness of static coordinates",
                ))?
                .inverse(),
        };
        let first = self.leading();
        let mut local = Matrix::zeros(self.contact_dofs, 3);
        for dof in 0..self.contact_dofs {
            let flexibility_row = inverse.apply(&basis.row(dof)[first..]);
            for (d, value) in local.row_mut(dof).iter_mut().enumerate() {
                let other = dof - dof % 3 + d;
                let along = flexibility_row.iter().zip(&basis.row(other)[first..]);
                *value = residual.at(dof, other) + along.map(|(a, b)| a * b).sum::<f64>();
            }
        }
        Ok(Some(local))
    }

    /// Computes natural frequencies \[rad/s\], ascending, and mass-normalised modes (column r) with the contact closed
    /// by `springs`.
    ///
    /// # Errors
    /// As [`LinearModel::with_closed_contact`].
    pub fn modes(&self, springs: &[f64]) -> Result<(Vec<f64>, Matrix), DynamicsError> {
        let (_, _, stiffness) = self.closed_parts(springs)?;
        let (squares, modes) = generalised_eigen(&stiffness, &self.mass)
            .map_err(DynamicsError::matrix_error("mass and stiffness"))?;
        Ok((squares.iter().map(|s| s.max(0.0).sqrt()).collect(), modes))
    }

    /// Sets the damping matrix C = M Φ diag(2ζω_r) Φᵀ M. Every mode of the structure closed by `springs` then has the
    /// damping ratio `ratio`. Springs of zero stiffness correspond to the basis `free`.
    ///
    /// # Errors
    /// As [`LinearModel::with_closed_contact`].
    pub fn with_damping_ratio(
        mut self,
        ratio: f64,
        springs: &[f64],
    ) -> Result<SecondOrder, DynamicsError> {
        if !(ratio >= 0.0 && ratio.is_finite()) {
            return Err(DynamicsError::OutOfRange {
                name: "the damping ratio",
                value: ratio,
                expected: "a finite number, zero or more",
            });
        }
        let (frequencies, modes) = self.modes(springs)?;
        let weighted = self.mass.times(&modes);
        let rates: Vec<f64> = frequencies.iter().map(|f| 2.0 * ratio * f).collect();
        self.damping = weighted
            .times(&Matrix::diagonal(&rates))
            .times(&weighted.transposed());
        Ok(self)
    }

    /// Adds hysteretic damping ηK, with K the stiffness without contact springs. The residual is not damped.
    pub fn with_loss_factor(mut self, factor: f64) -> SecondOrder {
        let hysteretic_values = self.hysteretic.values_mut().iter_mut();
        for (hysteretic, stiffness) in hysteretic_values.zip(self.stiffness.values()) {
            *hysteretic += factor * stiffness;
        }
        self
    }

    /// Adds Rayleigh damping αM + βK. K is the stiffness of the structure closed by `springs` \[N/m\], with one spring
    /// per contact degree of freedom. Rayleigh damping keeps the shapes of the modes, and increases the damping ratio
    /// of each mode by α/(2ω) + βω/2. The residual is not damped.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] for a coefficient that is negative or not finite, otherwise as
    /// [`LinearModel::with_closed_contact`].
    pub fn with_rayleigh_damping(
        mut self,
        rayleigh: Rayleigh,
        springs: &[f64],
    ) -> Result<SecondOrder, DynamicsError> {
        for (name, value) in [
            ("the damping coefficient of the mass", rayleigh.mass),
            (
                "the damping coefficient of the stiffness",
                rayleigh.stiffness,
            ),
        ] {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(DynamicsError::OutOfRange {
                    name,
                    value,
                    expected: "a finite number, zero or more",
                });
            }
        }
        let (_, _, stiffness) = self.closed_parts(springs)?;
        let mass = self.mass.values();
        for ((damping, mass), stiffness) in self
            .damping
            .values_mut()
            .iter_mut()
            .zip(mass)
            .zip(stiffness.values())
        {
            *damping += rayleigh.mass * mass + rayleigh.stiffness * stiffness;
        }
        Ok(self)
    }
}

/// Removes the asymmetry by rounding from a matrix.
pub(super) fn symmetrise(matrix: &mut Matrix) {
    for i in 0..matrix.rows() {
        for j in 0..i {
            let mean = 0.5 * (matrix.at(i, j) + matrix.at(j, i));
            matrix.set(i, j, mean);
            matrix.set(j, i, mean);
        }
    }
}

impl LinearModel for SecondOrder {
    fn contact_dofs(&self) -> usize {
        self.contact_dofs
    }

    fn ports(&self) -> usize {
        self.basis.rows()
    }

    fn with_closed_contact(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError> {
        let (basis, residual, stiffness) = self.closed_parts(springs)?;
        let follow = self.static_transform(&stiffness)?;
        let transformed = |matrix: &Matrix| follow.transposed().times(&matrix.times(&follow));
        let (mass, stiffness) = (transformed(&self.mass), transformed(&stiffness));
        let (damping, hysteretic) = (transformed(&self.damping), transformed(&self.hysteretic));
        let basis = basis.times(&follow);
        let (squares, modes) = generalised_eigen(&stiffness, &mass)
            .map_err(DynamicsError::matrix_error("mass and stiffness"))?;
        let largest = squares.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let (mut inverse, mut floating) = (Vec::new(), Vec::new());
        for (r, &square) in squares.iter().enumerate() {
            if square < -RIGID * largest {
                return Err(DynamicsError::OutOfRange {
                    name: "an eigenvalue of the stiffness",
                    value: square,
                    expected: "zero or more",
                });
            }
            if square.abs() <= RIGID * largest {
                inverse.push(0.0);
                floating.push(r);
            } else {
                inverse.push(1.0 / square);
            }
        }
        let flexibility = modes
            .times(&Matrix::diagonal(&inverse))
            .times(&modes.transposed());
        let motions = (!floating.is_empty()).then(|| {
            let mut motions = Matrix::zeros(basis.rows(), floating.len());
            for (column, &r) in floating.iter().enumerate() {
                let shape: Vec<f64> = (0..modes.rows()).map(|a| modes.at(a, r)).collect();
                let ports = basis.apply(&shape);
                let size = ports.iter().fold(0.0_f64, |m, p| m.max(p.abs()));
                for (i, value) in ports.iter().enumerate() {
                    motions.set(i, column, if size > 0.0 { value / size } else { 0.0 });
                }
            }
            motions
        });
        Ok(ClosedModel {
            leading_coordinates: self.leading(),
            element_flexibility: self.local_flexibility(&basis, residual.as_ref(), &stiffness)?,
            basis: Some(basis),
            residual,
            core: Box::new(SecondOrderCore {
                mass,
                damping,
                hysteretic,
                stiffness,
                flexibility,
                natural_frequencies: squares.iter().map(|s| s.max(0.0).sqrt()).collect(),
            }),
            rigid_motions: motions,
        })
    }
}

struct SecondOrderCore {
    mass: Matrix,
    damping: Matrix,
    hysteretic: Matrix,
    stiffness: Matrix,
    /// Static receptance without rigid body motions.
    flexibility: Matrix,
    natural_frequencies: Vec<f64>,
}

impl Core for SecondOrderCore {
    fn coordinates(&self) -> usize {
        self.mass.rows()
    }

    fn natural_frequencies(&self) -> &[f64] {
        &self.natural_frequencies
    }

    fn receptance(&self, omega: f64) -> Result<Matrix<Complex64>, DynamicsError> {
        let n = self.mass.rows();
        let mut out = Matrix::zeros(n, n);
        if omega == 0.0 {
            for i in 0..n {
                for j in 0..n {
                    out.set(i, j, self.flexibility.at(i, j).into());
                }
            }
            return Ok(out);
        }
        for i in 0..n {
            let mut cancels = true;
            for j in 0..n {
                let (elastic, inertial) =
                    (self.stiffness.at(i, j), omega * omega * self.mass.at(i, j));
                let damped = omega * self.damping.at(i, j) + self.hysteretic.at(i, j);
                let value = Complex64::new(elastic - inertial, damped);
                cancels &= value.norm() <= RESONANT * (elastic.abs() + inertial.abs());
                out.set(i, j, value);
            }
            if cancels {
                return Err(DynamicsError::Undamped {
                    frequency: omega / (2.0 * std::f64::consts::PI),
                });
            }
        }
        Ok(out
            .factorize()
            .map_err(DynamicsError::matrix_error("dynamic stiffness"))?
            .inverse())
    }

    fn loss(&self, omega: f64, displacement: &[Complex64], _force: &[Complex64]) -> DampingLoss {
        let work = |matrix: &Matrix| -> f64 {
            let rows = displacement.iter().enumerate();
            let row = |(i, a): (usize, &Complex64)| -> f64 {
                let terms = matrix.row(i).iter().zip(displacement);
                terms.map(|(c, b)| c * (a.conj() * b).re).sum()
            };
            std::f64::consts::PI * rows.map(row).sum::<f64>()
        };
        DampingLoss {
            viscous: omega * work(&self.damping),
            hysteretic: work(&self.hysteretic),
        }
    }
}
