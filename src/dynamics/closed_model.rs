//! Model of a structure whose contact is closed by springs, for the harmonic balance.

use num_complex::Complex64;

use super::{DynamicsError, Harmonics};
use crate::linalg::{RowMatrix, RowMatrix as Matrix, Scalar, add_scaled};

/// Largest ratio of all ports to loaded ports for a product with the whole matrix R. Above this ratio, a product with
/// gathered rows of R costs less.
const MANY: usize = 8;

/// Frequency response of the coordinates to forces on the coordinates.
pub trait Core: Send + Sync {
    /// Returns the number of coordinates.
    fn coordinates(&self) -> usize;

    /// Computes the complex receptance matrix of the coordinates at the angular frequency `omega` \[m/N\].
    ///
    /// # Errors
    /// [`DynamicsError::Undamped`] at an undamped resonance, [`DynamicsError::Matrix`].
    fn receptance(&self, omega: f64) -> Result<Matrix<Complex64>, DynamicsError>;

    /// Returns the natural angular frequencies \[rad/s\], ascending; empty if the model does not know them. A search
    /// uses the natural frequencies so that no step skips a resonance.
    fn natural_frequencies(&self) -> &[f64] {
        &[]
    }

    /// Computes the energy that damping dissipates per cycle at the angular frequency `omega`. The amplitudes `force`
    /// cause the amplitudes `displacement`.
    fn loss(&self, omega: f64, displacement: &[Complex64], force: &[Complex64]) -> DampingLoss;
}

/// Energy that damping dissipates per cycle \[J\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DampingLoss {
    /// π ω ûᴴ C û.
    pub viscous: f64,
    /// π ûᴴ H û.
    pub hysteretic: f64,
}

/// Structure whose contact is closed by springs: H(ω) = B Z(ω) Bᵀ + R. Z is the receptance of few coordinates. The
/// residual R does not depend on frequency.
pub struct ClosedModel {
    /// B, `ports × coordinates`. `None`: the ports are the coordinates.
    pub basis: Option<Matrix>,
    /// R, `ports × ports`, symmetric \[m/N\].
    pub residual: Option<Matrix>,
    /// Z.
    pub core: Box<dyn Core>,
    /// Number of the first coordinates that matter to a preconditioner; the others respond nearly statically.
    pub leading_coordinates: usize,
    /// Flexibility of each element under its own force \[m/N\], `contact_dofs × 3`, three rows per element. The
    /// flexibility is the element's block of R plus the static response of the coordinates that are not leading.
    pub element_flexibility: Option<Matrix>,
    /// Rigid body motions without support, `ports × motions`, each scaled to a largest entry of 1.
    pub rigid_motions: Option<Matrix>,
}

impl ClosedModel {
    /// Returns the number of ports.
    pub fn ports(&self) -> usize {
        self.basis
            .as_ref()
            .map_or_else(|| self.core.coordinates(), Matrix::rows)
    }

    /// Computes the forces on the coordinates, `coordinates × coefficients`, from rows of coefficients at `ports`.
    pub(crate) fn generalised(
        &self,
        harmonics: &Harmonics,
        ports: &[usize],
        force: &[f64],
    ) -> Matrix {
        let n = harmonics.coefficients();
        let mut out = Matrix::zeros(self.core.coordinates(), n);
        match &self.basis {
            Some(basis) => {
                out.add_transposed_product(&rows_of(basis, ports), &matrix(ports.len(), n, force))
            }
            None => {
                for (&port, row) in ports.iter().zip(force.chunks(n)) {
                    add_scaled(out.row_mut(port), 1.0, row);
                }
            }
        }
        out
    }

    /// Computes for one harmonic the complex amplitudes of the coordinates and of the forces on the coordinates.
    pub(crate) fn amplitudes(
        harmonics: &Harmonics,
        index: usize,
        core: &Matrix<Complex64>,
        generalised: &Matrix,
    ) -> (Vec<Complex64>, Vec<Complex64>) {
        let slot = harmonics.slot(index);
        let rows = (0..generalised.rows()).map(|a| generalised.row(a));
        let force: Vec<Complex64> = if index == 0 {
            rows.map(|row| row[0].into()).collect()
        } else {
            rows.map(|row| Complex64::new(row[slot], -row[slot + 1]))
                .collect()
        };
        (core.apply(&force), force)
    }

    /// Computes the coordinates due to forces on the coordinates. Coordinates and forces are `coordinates ×
    /// coefficients`.
    pub(crate) fn coordinates(
        harmonics: &Harmonics,
        cores: &[Matrix<Complex64>],
        generalised: &Matrix,
    ) -> Matrix {
        let mut out = Matrix::zeros(generalised.rows(), generalised.columns());
        for (index, core) in cores.iter().enumerate() {
            let slot = harmonics.slot(index);
            let (amplitude, _) = Self::amplitudes(harmonics, index, core, generalised);
            for (a, value) in amplitude.iter().enumerate() {
                out.set(a, slot, value.re);
                if index > 0 {
                    out.set(a, slot + 1, -value.im);
                }
            }
        }
        out
    }

    /// Computes the coefficients of the displacement of all ports due to forces at `ports` (rows of coefficients), dof
    /// by dof.
    ///
    /// Without `with_residual`, R is omitted, for differences between frequencies.
    pub(crate) fn respond(
        &self,
        harmonics: &Harmonics,
        cores: &[Matrix<Complex64>],
        ports: &[usize],
        force: &[f64],
        with_residual: bool,
    ) -> Vec<f64> {
        let n = harmonics.coefficients();
        let generalised = self.generalised(harmonics, ports, force);
        let coordinates = Self::coordinates(harmonics, cores, &generalised);
        let mut out = match &self.basis {
            Some(basis) => basis.times(&coordinates),
            None => coordinates,
        };
        if with_residual && let Some(residual) = &self.residual {
            if MANY * ports.len() < residual.rows() {
                // The matrix R is symmetric, so the rows of R are the columns of R.
                let force = matrix(ports.len(), n, force);
                out.add_transposed_product(&rows_of(residual, ports), &force);
            } else {
                let mut all = Matrix::zeros(residual.rows(), n);
                for (&port, row) in ports.iter().zip(force.chunks(n)) {
                    add_scaled(all.row_mut(port), 1.0, row);
                }
                out.add_product(residual, &all);
            }
        }
        out.into_values()
    }

    /// Returns the model restricted to `ports`, with matrices in `precision`.
    pub(crate) fn restricted_to(&self, ports: &[usize], precision: Precision) -> PortModel {
        let basis = self.basis.as_ref().map(|basis| rows_of(basis, ports));
        let residual = self.residual.as_ref();
        let residual = residual.map(|residual| square_of(residual, ports));
        PortModel {
            ports: ports.to_vec(),
            parts: match precision {
                Precision::Double => Parts::Double(PortMatrices::new(basis, residual)),
                Precision::Single => Parts::Single(PortMatrices::new(
                    basis.map(|basis| basis.single()),
                    residual.map(|residual| residual.single()),
                )),
            },
        }
    }
}

/// Precision of the stored B and R.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Precision {
    /// Double precision.
    Double,
    /// Single precision, for Krylov iterations, whose cost is the reading of B and R. A Newton step changes by about
    /// 1e-7 of itself, and the response does not change.
    Single,
}

enum Parts {
    Double(PortMatrices<f64>),
    Single(PortMatrices<f32>),
}

/// Rows of B, and rows and columns of R, for some ports.
struct PortMatrices<T> {
    /// Bᵀ and B, as products by rows are several times as fast as products by columns.
    basis: Option<(RowMatrix<T>, RowMatrix<T>)>,
    residual: Option<RowMatrix<T>>,
}

impl<T: Scalar> PortMatrices<T> {
    fn new(basis: Option<RowMatrix<T>>, residual: Option<RowMatrix<T>>) -> PortMatrices<T> {
        PortMatrices {
            basis: basis.map(|basis| (basis.transposed(), basis)),
            residual,
        }
    }

    /// Computes rows of displacements due to rows of `force`. `coordinates` converts generalised forces to generalised
    /// coordinates. For a model without B, only R contributes.
    fn respond(
        &self,
        force: &RowMatrix<T>,
        coordinates: impl FnOnce(RowMatrix<T>) -> RowMatrix<T>,
    ) -> RowMatrix<T> {
        let mut out = match &self.basis {
            Some((transposed, basis)) => basis.times(&coordinates(transposed.times(force))),
            None => RowMatrix::zeros(force.rows(), force.columns()),
        };
        if let Some(residual) = &self.residual {
            out.add_product(residual, force);
        }
        out
    }
}

/// Closed model restricted to some ports of the structure.
pub(crate) struct PortModel {
    pub(crate) ports: Vec<usize>,
    parts: Parts,
}

impl PortModel {
    /// Computes the displacement of the ports of the restricted model due to forces at the same ports. Forces and
    /// displacements are rows of coefficients, one row per port.
    pub(crate) fn respond(
        &self,
        harmonics: &Harmonics,
        cores: &[Matrix<Complex64>],
        force: &[f64],
    ) -> Vec<f64> {
        let n = harmonics.coefficients();
        let force = matrix(self.ports.len(), n, force);
        let coordinates =
            |generalised: &Matrix| ClosedModel::coordinates(harmonics, cores, generalised);
        let (mut out, has_basis) = match &self.parts {
            Parts::Double(own) => {
                let out = own.respond(&force, |generalised| coordinates(&generalised));
                (out, own.basis.is_some())
            }
            Parts::Single(own) => {
                let out = own.respond(&force.single(), |generalised| {
                    coordinates(&generalised.double()).single()
                });
                (out.double(), own.basis.is_some())
            }
        };
        if !has_basis {
            let order = cores.first().map_or(0, Matrix::rows);
            let mut generalised = Matrix::zeros(order, n);
            for (i, &port) in self.ports.iter().enumerate() {
                // A port can occur twice.
                add_scaled(generalised.row_mut(port), 1.0, force.row(i));
            }
            let own = rows_of(&coordinates(&generalised), &self.ports);
            add_scaled(out.values_mut(), 1.0, own.values());
        }
        out.into_values()
    }

    /// Computes the receptance matrix of the ports of the restricted model for one `core`, `ports × ports`.
    pub(crate) fn receptance(&self, core: &Matrix<Complex64>) -> Matrix<Complex64> {
        match &self.parts {
            Parts::Double(own) => own.receptance(&self.ports, core),
            Parts::Single(own) => own.double().receptance(&self.ports, core),
        }
    }
}

impl PortMatrices<f32> {
    fn double(&self) -> PortMatrices<f64> {
        let basis = self.basis.as_ref().map(|(_, basis)| basis.double());
        PortMatrices::new(basis, self.residual.as_ref().map(RowMatrix::double))
    }
}

impl PortMatrices<f64> {
    fn receptance(&self, ports: &[usize], core: &Matrix<Complex64>) -> Matrix<Complex64> {
        let m = ports.len();
        let mut out = Matrix::zeros(m, m);
        match &self.basis {
            Some((_, basis)) => {
                let mut complex = Matrix::zeros(m, basis.columns());
                let pairs = complex.values_mut().iter_mut().zip(basis.values());
                pairs.for_each(|(c, b)| *c = (*b).into());
                out.add_product_transposed(&complex.times(core), &complex);
            }
            None => {
                for (i, &a) in ports.iter().enumerate() {
                    for (j, &b) in ports.iter().enumerate() {
                        out.set(i, j, core.at(a, b));
                    }
                }
            }
        }
        if let Some(residual) = &self.residual {
            let sums = out.values_mut().iter_mut();
            sums.zip(residual.values()).for_each(|(h, r)| *h += r);
        }
        out
    }
}

fn rows_of(matrix: &Matrix, rows: &[usize]) -> Matrix {
    let mut out = Matrix::zeros(rows.len(), matrix.columns());
    for (i, &row) in rows.iter().enumerate() {
        out.row_mut(i).copy_from_slice(matrix.row(row));
    }
    out
}

/// Returns rows and columns of some ports.
fn square_of(matrix: &Matrix, ports: &[usize]) -> Matrix {
    let mut out = Matrix::zeros(ports.len(), ports.len());
    for (i, &a) in ports.iter().enumerate() {
        let row = matrix.row(a);
        for (value, &b) in out.row_mut(i).iter_mut().zip(ports) {
            *value = row[b];
        }
    }
    out
}

fn matrix(rows: usize, columns: usize, values: &[f64]) -> Matrix {
    let mut out = Matrix::zeros(rows, columns);
    out.values_mut().copy_from_slice(values);
    out
}
