//! Preconditioner of a Newton step with nearly all elements active, built from the elements and the modes.

use num_complex::Complex64;

use super::closed_model::ClosedModel;
use super::{DynamicsError, Harmonics};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};
use crate::threads::Threads;

/// Number of elements whose blocks a thread inverts at a time.
const AT_ONCE: usize = 32;

/// Frequency-independent part of the inverse of `1 + (D + B Z Bᵀ) G`.
///
/// The matrices B and Z contain only the leading coordinates of the model. The matrix D is block diagonal with a 3×3
/// block per element. Each block of D is the residual plus the static response of all coordinates that are not leading.
/// G is the contact Jacobian beyond the reference. Each element has `P = 1 + D G`, and `W = Bᵀ G P⁻¹ B`.
pub(super) struct ElementPart {
    /// P⁻¹.
    inverses: Blocks,
    /// G P⁻¹.
    transfers: Blocks,
    /// Rows of B of the elements, `3 · elements × coordinates`.
    shapes: Matrix,
    /// Bᵀ, stored because products by rows are several times as fast.
    transposed_shapes: Matrix,
    /// W, ordered by coefficient, then coordinate.
    coupling: Matrix,
}

impl ElementPart {
    /// Computes the element part of the preconditioner for the elements `active` of `model`. `basis` is the basis of
    /// the model, and `beyond` contains the contact Jacobian of each active element, `3n × 3n`.
    pub(super) fn new(
        threads: &Threads,
        model: &ClosedModel,
        basis: &Matrix,
        harmonics: &Harmonics,
        active: &[usize],
        beyond: &[Matrix],
    ) -> Result<ElementPart, DynamicsError> {
        let n = harmonics.coefficients();
        let m = model.leading_coordinates;
        let width = 3 * n;
        let mut shapes = Matrix::zeros(3 * active.len(), m);
        for (place, &element) in active.iter().enumerate() {
            for d in 0..3 {
                let row = shapes.row_mut(3 * place + d);
                row.copy_from_slice(&basis.row(3 * element + d)[..m]);
            }
        }
        let element_blocks = |(&element, jacobian): (&usize, &Matrix)| {
            let mut local = Matrix::identity(width);
            if let Some(blocks) = &model.element_flexibility {
                for d in 0..3 {
                    for e in 0..3 {
                        let flexibility = blocks.at(3 * element + d, e);
                        for c in 0..n {
                            let source = jacobian.row(e * n + c);
                            add_scaled(local.row_mut(d * n + c), flexibility, source);
                        }
                    }
                }
            }
            let of_matrix = DynamicsError::matrix_error("element with its own flexibility");
            let inverse = local.factorize().map_err(of_matrix)?.inverse();
            let transfer = jacobian.times(&inverse);
            Ok((inverse, transfer))
        };
        let chunks = active.chunks(AT_ONCE).zip(beyond.chunks(AT_ONCE));
        let parts = threads.map(chunks, |(active, beyond)| {
            let elements = active.iter().zip(beyond);
            elements
                .map(element_blocks)
                .collect::<Result<Vec<_>, DynamicsError>>()
        });
        let (mut inverses, mut transfers) = (Vec::new(), Vec::new());
        for part in parts {
            for (inverse, transfer) in part? {
                inverses.push(inverse);
                transfers.push(transfer);
            }
        }
        let transposed_shapes = shapes.transposed();
        // Each pair of coefficients needs one product over all elements.
        let rows = threads.map(0..n, |c| {
            let mut rows = Matrix::zeros(m, m * n);
            for f in 0..n {
                let mut transferred = Matrix::zeros(3 * active.len(), m);
                for (place, transfer) in transfers.iter().enumerate() {
                    for d in 0..3 {
                        for e in 0..3 {
                            let factor = transfer.at(d * n + c, e * n + f);
                            let source = shapes.row(3 * place + e);
                            add_scaled(transferred.row_mut(3 * place + d), factor, source);
                        }
                    }
                }
                let product = transposed_shapes.times(&transferred);
                for a in 0..m {
                    rows.row_mut(a)[f * m..][..m].copy_from_slice(product.row(a));
                }
            }
            rows
        });
        let mut coupling = Matrix::zeros(m * n, m * n);
        for (target, rows) in coupling.values_mut().chunks_mut(m * m * n).zip(&rows) {
            target.copy_from_slice(rows.values());
        }
        Ok(ElementPart {
            inverses: Blocks::new(width, inverses.iter()),
            transfers: Blocks::new(width, transfers.iter()),
            shapes,
            transposed_shapes,
            coupling,
        })
    }
}

/// Preconditioner at one frequency.
pub(super) struct Preconditioner<'a> {
    part: &'a ElementPart,
    harmonics: &'a Harmonics,
    /// Z of the leading coordinates at each harmonic.
    cores: Vec<Matrix<Complex64>>,
    /// Factors of `1 + W Z`.
    modal: Factors,
}

impl<'a> Preconditioner<'a> {
    pub(super) fn new(
        threads: &Threads,
        part: &'a ElementPart,
        harmonics: &'a Harmonics,
        cores: &[Matrix<Complex64>],
    ) -> Result<Preconditioner<'a>, DynamicsError> {
        let order = part.coupling.rows();
        let m = part.shapes.columns();
        let leading = |core: &Matrix<Complex64>| {
            let mut out = Matrix::zeros(m, m);
            for a in 0..m {
                out.row_mut(a).copy_from_slice(&core.row(a)[..m]);
            }
            out
        };
        let cores: Vec<Matrix<Complex64>> = cores.iter().map(leading).collect();
        // Z is block diagonal by harmonic, so W Z uses only the columns of the block.
        let products = threads.map(cores.iter().enumerate(), |(index, core)| {
            let slots = if index == 0 { 1 } else { 2 };
            let first = harmonics.slot(index) * m;
            let mut columns = Matrix::zeros(order, slots * m);
            for i in 0..order {
                let source = &part.coupling.row(i)[first..][..slots * m];
                columns.row_mut(i).copy_from_slice(source);
            }
            let mut block = Matrix::zeros(slots * m, slots * m);
            for a in 0..m {
                for b in 0..m {
                    let value = core.at(a, b);
                    block.set(a, b, value.re);
                    if index > 0 {
                        block.set(a, m + b, value.im);
                        block.set(m + a, b, -value.im);
                        block.set(m + a, m + b, value.re);
                    }
                }
            }
            (first, columns.times(&block))
        });
        let mut modal = Matrix::identity(order);
        for (first, product) in &products {
            for i in 0..order {
                let target = &mut modal.row_mut(i)[*first..][..product.columns()];
                add_scaled(target, 1.0, product.row(i));
            }
        }
        let of_matrix = DynamicsError::matrix_error("modal part of the preconditioner");
        Ok(Preconditioner {
            part,
            harmonics,
            cores,
            modal: modal.factorize().map_err(of_matrix)?,
        })
    }

    /// Applies the approximate inverse to `right` (active unknowns).
    pub(super) fn apply(&self, right: &[f64]) -> Vec<f64> {
        let part = self.part;
        let n = self.harmonics.coefficients();
        let mut force = Matrix::zeros(part.shapes.rows(), n);
        force
            .values_mut()
            .copy_from_slice(&part.transfers.apply(right));
        let mut modal = part.transposed_shapes.times(&force).transposed();
        self.modal.solve(modal.values_mut());
        let generalised = modal.transposed();
        let coordinates = ClosedModel::coordinates(self.harmonics, &self.cores, &generalised);
        let modal_response = part.shapes.times(&coordinates).into_values();
        let remaining: Vec<f64> = right
            .iter()
            .zip(modal_response)
            .map(|(r, m)| r - m)
            .collect();
        part.inverses.apply(&remaining)
    }
}
