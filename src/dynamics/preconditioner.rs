//! The preconditioner of a Newton step, which knows the elements and the modes, for when nearly all elements are active.

use num_complex::Complex64;

use super::closed_model::ClosedModel;
use super::{DynamicsError, Harmonics};
use crate::linalg::{Blocks, Factors, RowMatrix as Matrix, add_scaled};

/// What does not depend on frequency in the inverse of `1 + (D + B Z Bᵀ) G`, where B and Z have the leading coordinates only, D keeps
/// of the residual and the static answer of the other coordinates the 3×3 blocks of the elements, and G is the contact Jacobian beyond the reference: per element `P = 1 + D G`, and `W = Bᵀ G P⁻¹ B`.
pub(super) struct ElementPart {
    /// P⁻¹.
    inverses: Blocks,
    /// G P⁻¹.
    transfers: Blocks,
    /// Rows of B of the elements, `3 · elements × coordinates`.
    shapes: Matrix,
    /// Bᵀ, by whose rows products are several times as fast.
    transposed_shapes: Matrix,
    /// W, ordered by coefficient, then coordinate.
    coupling: Matrix,
}

impl ElementPart {
    /// For the elements `active` of a model with this `basis`, with Jacobians `beyond` (each `3n × 3n`).
    pub(super) fn new(
        model: &ClosedModel,
        basis: &Matrix,
        harmonics: &Harmonics,
        active: &[usize],
        beyond: &[Matrix],
    ) -> Result<ElementPart, DynamicsError> {
        let n = harmonics.coefficients();
        let m = model.leading;
        let width = 3 * n;
        let mut shapes = Matrix::zeros(3 * active.len(), m);
        let (mut inverses, mut transfers) = (Vec::new(), Vec::new());
        for (place, (&element, jacobian)) in active.iter().zip(beyond).enumerate() {
            let mut local = Matrix::identity(width);
            if let Some(blocks) = &model.local {
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
            let of_matrix = DynamicsError::of_matrix("element with its own flexibility");
            let inverse = local.factorize().map_err(of_matrix)?.inverse();
            for d in 0..3 {
                let row = shapes.row_mut(3 * place + d);
                row.copy_from_slice(&basis.row(3 * element + d)[..m]);
            }
            transfers.push(jacobian.times(&inverse));
            inverses.push(inverse);
        }
        let transposed_shapes = shapes.transposed();
        // For every pair of coefficients a product over all elements.
        let mut coupling = Matrix::zeros(m * n, m * n);
        for c in 0..n {
            for f in 0..n {
                let mut moved = Matrix::zeros(3 * active.len(), m);
                for (place, transfer) in transfers.iter().enumerate() {
                    for d in 0..3 {
                        for e in 0..3 {
                            let factor = transfer.at(d * n + c, e * n + f);
                            let source = shapes.row(3 * place + e);
                            add_scaled(moved.row_mut(3 * place + d), factor, source);
                        }
                    }
                }
                let product = transposed_shapes.times(&moved);
                for a in 0..m {
                    coupling.row_mut(c * m + a)[f * m..][..m].copy_from_slice(product.row(a));
                }
            }
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

/// The preconditioner at one frequency.
pub(super) struct Preconditioner<'a> {
    part: &'a ElementPart,
    harmonics: &'a Harmonics,
    /// Z of the leading coordinates, of each harmonic.
    cores: Vec<Matrix<Complex64>>,
    /// Of `1 + W Z`.
    modal: Factors,
}

impl<'a> Preconditioner<'a> {
    pub(super) fn new(
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
        let mut receptance = Matrix::zeros(order, order);
        for (index, core) in cores.iter().enumerate() {
            let slot = harmonics.slot(index);
            for a in 0..m {
                for b in 0..m {
                    let value = core.at(a, b);
                    receptance.set(slot * m + a, slot * m + b, value.re);
                    if index > 0 {
                        receptance.set(slot * m + a, (slot + 1) * m + b, value.im);
                        receptance.set((slot + 1) * m + a, slot * m + b, -value.im);
                        receptance.set((slot + 1) * m + a, (slot + 1) * m + b, value.re);
                    }
                }
            }
        }
        let mut modal = Matrix::identity(order);
        modal.add_product(&part.coupling, &receptance);
        let of_matrix = DynamicsError::of_matrix("modal part of the preconditioner");
        Ok(Preconditioner {
            part,
            harmonics,
            cores,
            modal: modal.factorize().map_err(of_matrix)?,
        })
    }

    /// The approximate inverse applied to `right` (active unknowns).
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
        let moved = part.shapes.times(&coordinates).into_values();
        let left: Vec<f64> = right.iter().zip(moved).map(|(r, m)| r - m).collect();
        part.inverses.apply(&left)
    }
}
