//! A structure with its contact closed by springs, as the harmonic balance uses it.

use num_complex::Complex64;

use super::dense::{self, Matrix};
use super::{DynamicsError, Harmonics};

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
                        dense::add_scaled(target, force[k * n + c], rows(k));
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
            Some(basis) => dense::add_scaled(target, factor, basis.row(port)),
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
                dense::add_scaled(&mut left, factor.into(), core.row(r));
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
