//! The linear structure as the contact sees it: displacements of *ports* due to forces at ports.
//!
//! Ports are numbered: first the contact degrees of freedom (x, y, n of every element), then whatever else is driven or looked
//! at. A port may stand for a combination of nodes (a point between nodes, a resultant).

use num_complex::Complex64;

use super::dense::{Factors, Matrix, eigen};
use super::{DynamicsError, Harmonics};

/// Share of the largest eigenvalue below which a coordinate is a rigid body motion; modes of one structure span 1e8.
const RIGID: f64 = 1e-11;
/// Dynamic stiffness, relative to its parts, below which an undamped resonance is hit exactly.
const RESONANT: f64 = 1e-13;

/// A linear structure with contact ports.
pub trait LinearModel {
    /// Contact degrees of freedom, three per element; they are the first ports.
    fn contact_dofs(&self) -> usize;

    /// All ports.
    fn ports(&self) -> usize;

    /// The structure with a linear spring of `springs[i]` \[N/m\] in every contact degree of freedom.
    ///
    /// # Errors
    /// [`DynamicsError`] if the numbers do not fit together or a matrix is singular.
    fn close(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError>;
}

/// What answers at one frequency: coordinates due to forces on coordinates.
pub trait Core {
    /// Number of coordinates.
    fn coordinates(&self) -> usize;

    /// Complex receptance matrix of the coordinates at the angular frequency `omega` \[m/N\].
    ///
    /// # Errors
    /// [`DynamicsError::Singular`] at an undamped resonance.
    fn receptance(&self, omega: f64) -> Result<Matrix<Complex64>, DynamicsError>;

    /// Energy that damping takes over one cycle of `omega` at the amplitudes `displacement` caused by `force` \[J\].
    fn loss(&self, omega: f64, displacement: &[Complex64], force: &[Complex64]) -> f64;
}

/// A structure whose contact is closed by springs: H(ω) = B Z(ω) Bᵀ + R, with receptance Z of few coordinates and a residual R
/// that does not depend on frequency.
pub struct ClosedModel {
    /// B, `ports × coordinates`; none: ports are the coordinates.
    pub basis: Option<Matrix>,
    /// R, `ports × ports`, symmetric \[m/N\].
    pub residual: Option<Matrix>,
    /// Z.
    pub core: Box<dyn Core>,
    /// Rigid body motions that no spring holds, `ports × motions`, scaled to a largest entry of 1.
    pub floating: Option<Matrix>,
}

/// A second-order system `M q̈ + C q̇ + K q = Bᵀ f`, ports `u = B q + R f`.
///
/// Physical coordinates with the identity for B, or modes (M = 1, K = diag ω²) with mode shapes at the ports for B and the static
/// residual of the modes left out for R. Matrices are symmetric.
#[derive(Debug, Clone, PartialEq)]
pub struct SecondOrder {
    /// M, `n × n`, positive definite \[kg\].
    pub mass: Matrix,
    /// C, `n × n` \[N s/m\].
    pub damping: Matrix,
    /// K without contact springs, `n × n` \[N/m\].
    pub stiffness: Matrix,
    /// B, `ports × n`.
    pub basis: Matrix,
    /// R, `ports × ports` \[m/N\].
    pub residual: Option<Matrix>,
    /// How many of the ports are contact degrees of freedom.
    pub contact_dofs: usize,
}

impl SecondOrder {
    fn check(&self, springs: &[f64]) -> Result<(), DynamicsError> {
        let n = self.mass.rows();
        let ports = self.basis.rows();
        let lengths = [
            ("columns of the mass matrix", self.mass.columns(), n),
            ("rows of the damping matrix", self.damping.rows(), n),
            ("columns of the damping matrix", self.damping.columns(), n),
            ("rows of the stiffness matrix", self.stiffness.rows(), n),
            (
                "columns of the stiffness matrix",
                self.stiffness.columns(),
                n,
            ),
            ("columns of the port matrix", self.basis.columns(), n),
            ("contact springs", springs.len(), self.contact_dofs),
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

    /// B̃ = (1 + R K_s)⁻¹ B, R̃ = (1 + R K_s)⁻¹ R, K̃ = K + B_cᵀ K_s B̃_c: springs K_s behind the residual.
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
                let factors = Factors::new(system, "residual with closed contact")?;
                let (mut basis, mut closed) = (self.basis.clone(), residual.clone());
                factors.solve_columns(&mut basis);
                factors.solve_columns(&mut closed);
                symmetrise(&mut closed);
                (basis, Some(closed))
            }
        };
        let n = self.stiffness.rows();
        let mut stiffness = self.stiffness.clone();
        for (i, &spring) in springs.iter().enumerate() {
            if spring == 0.0 {
                continue;
            }
            for a in 0..n {
                let factor = spring * self.basis.at(i, a);
                for (entry, b) in stiffness.row_mut(a).iter_mut().zip(basis.row(i)) {
                    *entry += factor * b;
                }
            }
        }
        symmetrise(&mut stiffness);
        Ok((basis, residual, stiffness))
    }

    /// Natural frequencies \[rad/s\], ascending, and mass-normalised modes (column r) with the contact closed by `springs`.
    ///
    /// # Errors
    /// As [`LinearModel::close`].
    pub fn modes(&self, springs: &[f64]) -> Result<(Vec<f64>, Matrix), DynamicsError> {
        let (_, _, stiffness) = self.closed_parts(springs)?;
        let (squares, modes) = eigen(&stiffness, &self.mass)?;
        Ok((squares.iter().map(|s| s.max(0.0).sqrt()).collect(), modes))
    }

    /// The same with a damping matrix that gives every mode of the structure closed by `springs` the damping ratio `ratio`:
    /// C = M Φ diag(2ζω_r) Φᵀ M. With zero springs it is the basis `free`.
    ///
    /// # Errors
    /// As [`LinearModel::close`].
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
}

fn symmetrise(matrix: &mut Matrix) {
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

    fn close(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError> {
        let (basis, residual, stiffness) = self.closed_parts(springs)?;
        let (squares, modes) = eigen(&stiffness, &self.mass)?;
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
            basis: Some(basis),
            residual,
            core: Box::new(SecondOrderCore {
                mass: self.mass.clone(),
                damping: self.damping.clone(),
                stiffness,
                flexibility,
            }),
            floating: motions,
        })
    }
}

struct SecondOrderCore {
    mass: Matrix,
    damping: Matrix,
    stiffness: Matrix,
    /// Static receptance without rigid body motions.
    flexibility: Matrix,
}

impl Core for SecondOrderCore {
    fn coordinates(&self) -> usize {
        self.mass.rows()
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
                let value = Complex64::new(elastic - inertial, omega * self.damping.at(i, j));
                cancels &= value.norm() <= RESONANT * (elastic.abs() + inertial.abs());
                out.set(i, j, value);
            }
            if cancels {
                return Err(DynamicsError::Singular {
                    what: "dynamic stiffness at an undamped resonance",
                    order: n,
                    pivot: i,
                    size: 0.0,
                });
            }
        }
        Ok(Factors::new(out, "dynamic stiffness")?.inverse())
    }

    fn loss(&self, omega: f64, displacement: &[Complex64], _force: &[Complex64]) -> f64 {
        let mut sum = 0.0;
        for (i, a) in displacement.iter().enumerate() {
            for (c, b) in self.damping.row(i).iter().zip(displacement) {
                sum += c * (a.conj() * b).re;
            }
        }
        std::f64::consts::PI * omega * sum
    }
}

/// A structure known by its receptance matrix alone: from a measurement or a direct solution.
pub struct Receptance<F> {
    /// Receptance of the ports without contact springs at an angular frequency \[m/N\], `ports × ports`, symmetric. It is
    /// asked for at 0 too.
    pub matrix: F,
    /// Number of ports.
    pub ports: usize,
    /// How many of them are contact degrees of freedom.
    pub contact_dofs: usize,
}

impl<F> LinearModel for Receptance<F>
where
    F: Fn(f64) -> Matrix<Complex64> + Clone + 'static,
{
    fn contact_dofs(&self) -> usize {
        self.contact_dofs
    }

    fn ports(&self) -> usize {
        self.ports
    }

    fn close(&self, springs: &[f64]) -> Result<ClosedModel, DynamicsError> {
        if springs.len() != self.contact_dofs {
            return Err(DynamicsError::Length {
                what: "contact springs",
                found: springs.len(),
                expected: self.contact_dofs,
            });
        }
        Ok(ClosedModel {
            basis: None,
            residual: None,
            core: Box::new(ReceptanceCore {
                matrix: self.matrix.clone(),
                ports: self.ports,
                springs: springs.to_vec(),
            }),
            floating: None,
        })
    }
}

struct ReceptanceCore<F> {
    matrix: F,
    ports: usize,
    springs: Vec<f64>,
}

impl<F: Fn(f64) -> Matrix<Complex64>> Core for ReceptanceCore<F> {
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
        Factors::new(system, "receptance with closed contact")?.solve_columns(&mut free);
        Ok(free)
    }

    fn loss(&self, _omega: f64, displacement: &[Complex64], force: &[Complex64]) -> f64 {
        // Springs take nothing: what the forces on the closed structure put in is what it loses.
        let pairs = force.iter().zip(displacement);
        std::f64::consts::PI * pairs.map(|(f, u)| (f * u.conj()).im).sum::<f64>()
    }
}

/// Adds R f to `target`, `coefficients × ports`; by symmetry a sum of rows of R, four at a time over columns that stay in cache.
fn add_residual(residual: &Matrix, ports: &[usize], force: &[f64], target: &mut Matrix) {
    const COLUMNS: usize = 256;
    let n = target.rows();
    let all = residual.columns();
    for start in (0..all).step_by(COLUMNS) {
        let columns = start..(start + COLUMNS).min(all);
        for (ports, force) in ports.chunks(4).zip(force.chunks(4 * n)) {
            let rows = |k: usize| &residual.row(ports[k])[columns.clone()];
            for c in 0..n {
                let target = &mut target.row_mut(c)[columns.clone()];
                if let [_, _, _, _] = ports {
                    let factors = [0, 1, 2, 3].map(|k| force[k * n + c]);
                    let pairs = rows(0).iter().zip(rows(1)).zip(rows(2).iter().zip(rows(3)));
                    for (target, ((r0, r1), (r2, r3))) in target.iter_mut().zip(pairs) {
                        *target += (factors[0] * r0 + factors[1] * r1)
                            + (factors[2] * r2 + factors[3] * r3);
                    }
                } else {
                    for k in 0..ports.len() {
                        super::dense::add_scaled(target, force[k * n + c], rows(k));
                    }
                }
            }
        }
    }
}

impl ClosedModel {
    /// Number of ports.
    pub fn ports(&self) -> usize {
        self.basis
            .as_ref()
            .map_or_else(|| self.core.coordinates(), Matrix::rows)
    }

    /// Row of B of a port times `factor`, added to `target`.
    fn spread(&self, port: usize, factor: f64, target: &mut [f64]) {
        match &self.basis {
            Some(basis) => super::dense::add_scaled(target, factor, basis.row(port)),
            None => target[port] += factor,
        }
    }

    /// Cores of every harmonic at the angular frequency `omega` of the fundamental.
    pub(crate) fn cores(
        &self,
        harmonics: &Harmonics,
        omega: f64,
    ) -> Result<Vec<Matrix<Complex64>>, DynamicsError> {
        let orders = harmonics.orders().iter();
        orders
            .map(|&order| self.core.receptance(f64::from(order) * omega))
            .collect()
    }

    /// Forces on the coordinates, coefficient by coefficient: `coefficients × coordinates`.
    pub(crate) fn generalised(
        &self,
        harmonics: &Harmonics,
        ports: &[usize],
        force: &[f64],
    ) -> Matrix {
        let n = harmonics.coefficients();
        let mut out = Matrix::zeros(n, self.core.coordinates());
        for (row, &port) in force.chunks(n).zip(ports) {
            for (c, &value) in row.iter().enumerate() {
                if value != 0.0 {
                    self.spread(port, value, out.row_mut(c));
                }
            }
        }
        out
    }

    /// Complex amplitudes of the coordinates of one harmonic.
    pub(crate) fn amplitudes(
        harmonics: &Harmonics,
        index: usize,
        core: &Matrix<Complex64>,
        generalised: &Matrix,
    ) -> (Vec<Complex64>, Vec<Complex64>) {
        let slot = harmonics.slot(index);
        let force: Vec<Complex64> = if index == 0 {
            generalised.row(0).iter().map(|&f| f.into()).collect()
        } else {
            let pairs = generalised.row(slot).iter().zip(generalised.row(slot + 1));
            pairs.map(|(&a, &b)| Complex64::new(a, -b)).collect()
        };
        (core.apply(&force), force)
    }

    /// Coefficients of the displacement of all ports due to forces at `ports` (rows of coefficients), dof by dof.
    ///
    /// `with_residual` leaves R out, for differences between frequencies.
    pub(crate) fn respond(
        &self,
        harmonics: &Harmonics,
        cores: &[Matrix<Complex64>],
        ports: &[usize],
        force: &[f64],
        with_residual: bool,
    ) -> Vec<f64> {
        let n = harmonics.coefficients();
        let all = self.ports();
        let generalised = self.generalised(harmonics, ports, force);
        // Coefficient by coefficient, so that the residual is a sum of whole rows.
        let mut by_coefficient = Matrix::zeros(n, all);
        let mut coordinates = Matrix::zeros(n, self.core.coordinates());
        for (index, core) in cores.iter().enumerate() {
            let slot = harmonics.slot(index);
            let (amplitude, _) = Self::amplitudes(harmonics, index, core, &generalised);
            for (a, value) in amplitude.iter().enumerate() {
                coordinates.set(slot, a, value.re);
                if index > 0 {
                    coordinates.set(slot + 1, a, -value.im);
                }
            }
        }
        for c in 0..n {
            match &self.basis {
                Some(basis) => {
                    let values = basis.apply(coordinates.row(c));
                    by_coefficient.row_mut(c).copy_from_slice(&values);
                }
                None => by_coefficient
                    .row_mut(c)
                    .copy_from_slice(coordinates.row(c)),
            }
        }
        if with_residual && let Some(residual) = &self.residual {
            add_residual(residual, ports, force, &mut by_coefficient);
        }
        by_coefficient.transposed().values().to_vec()
    }

    /// Receptances among `ports` for one core, `ports × ports`.
    pub(crate) fn block(&self, core: &Matrix<Complex64>, ports: &[usize]) -> Matrix<Complex64> {
        let m = ports.len();
        let mut out = Matrix::zeros(m, m);
        let Some(basis) = &self.basis else {
            for (i, &a) in ports.iter().enumerate() {
                for (j, &b) in ports.iter().enumerate() {
                    out.set(i, j, core.at(a, b));
                }
            }
            return out;
        };
        for (i, &a) in ports.iter().enumerate() {
            let mut left = vec![Complex64::default(); core.columns()];
            for (r, &factor) in basis.row(a).iter().enumerate() {
                super::dense::add_scaled(&mut left, factor.into(), core.row(r));
            }
            for (j, &b) in ports.iter().enumerate() {
                let mut sum: Complex64 = basis.row(b).iter().zip(&left).map(|(x, y)| y * x).sum();
                if let Some(residual) = &self.residual {
                    sum += residual.at(a, b);
                }
                out.set(i, j, sum);
            }
        }
        out
    }
}
