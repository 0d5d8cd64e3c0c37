//! GMRES with a preconditioner that knows the element and the modes, for when nearly all elements are active.

use num_complex::Complex64;

use super::closed_model::ClosedModel;
use super::dense::{Factors, Matrix, add_scaled};
use super::{DynamicsError, Harmonics};

/// Basis vectors before giving up; the preconditioned operator needs one to four dozen.
const MOST_ITERATIONS: usize = 150;

/// Solves `operator(precondition(y)) = right` by GMRES from zero and returns `precondition(y)` and the iterations.
///
/// # Errors
/// [`DynamicsError::Krylov`].
pub(super) fn solve(
    operator: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    right: &[f64],
    tolerance: f64,
) -> Result<(Vec<f64>, usize), DynamicsError> {
    let norm = norm(right);
    if norm == 0.0 {
        return Ok((vec![0.0; right.len()], 0));
    }
    let mut basis = vec![right.iter().map(|v| v / norm).collect::<Vec<f64>>()];
    let mut columns: Vec<Vec<f64>> = Vec::new();
    let mut rotations: Vec<(f64, f64)> = Vec::new();
    let mut target = vec![norm];
    for k in 0..MOST_ITERATIONS {
        let mut next = operator(&precondition(&basis[k]));
        let mut column = vec![0.0; k + 2];
        // Twice is enough.
        for _ in 0..2 {
            for (i, vector) in basis.iter().enumerate() {
                let projection = dot(vector, &next);
                column[i] += projection;
                add_scaled(&mut next, -projection, vector);
            }
        }
        let size = self::norm(&next);
        column[k + 1] = size;
        for (i, &(c, s)) in rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let radius = column[k].hypot(column[k + 1]);
        let (c, s) = (column[k] / radius, column[k + 1] / radius);
        rotations.push((c, s));
        column[k] = radius;
        target.push(-s * target[k]);
        target[k] *= c;
        columns.push(column);
        let left = target[k + 1].abs() / norm;
        if left <= tolerance || size == 0.0 {
            let mut weights = target[..=k].to_vec();
            for i in (0..=k).rev() {
                for j in i + 1..=k {
                    weights[i] -= columns[j][i] * weights[j];
                }
                weights[i] /= columns[i][i];
            }
            let mut sum = vec![0.0; right.len()];
            for (weight, vector) in weights.iter().zip(&basis) {
                add_scaled(&mut sum, *weight, vector);
            }
            return Ok((precondition(&sum), k + 1));
        }
        if !left.is_finite() {
            break;
        }
        basis.push(next.iter().map(|v| v / size).collect());
    }
    Err(DynamicsError::Krylov {
        iterations: columns.len(),
        residual: target.last().map_or(f64::NAN, |t| t.abs() / norm),
        tolerance,
    })
}

pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// Sums in four strands, always the same ones.
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut strands = [0.0; 4];
    let (fours, rest) = (a.chunks_exact(4), a.chunks_exact(4).remainder());
    let split = a.len() - rest.len();
    for (x, y) in fours.zip(b.chunks_exact(4)) {
        for s in 0..4 {
            strands[s] += x[s] * y[s];
        }
    }
    let tail: f64 = rest.iter().zip(&b[split..]).map(|(x, y)| x * y).sum();
    (strands[0] + strands[1]) + (strands[2] + strands[3]) + tail
}

/// What does not depend on frequency in the inverse of `1 + (D + B Z Bᵀ) G`, where D keeps of the residual only the 3×3 blocks of
/// the elements and G is the contact Jacobian beyond the reference: per element `P = 1 + D G`, and `W = Bᵀ G P⁻¹ B`.
pub(super) struct ElementPart {
    elements: Vec<ElementBlock>,
    coupling: Matrix,
}

struct ElementBlock {
    /// P.
    local: Factors,
    /// G P⁻¹.
    transfer: Matrix,
    /// Rows of B, `3 × coordinates`.
    shapes: Matrix,
}

impl ElementPart {
    /// For the elements `active`, with Jacobians `beyond` (each `3n × 3n`).
    pub(super) fn new(
        model: &ClosedModel,
        basis: &Matrix,
        harmonics: &Harmonics,
        active: &[usize],
        beyond: &[Vec<f64>],
    ) -> Result<ElementPart, DynamicsError> {
        let n = harmonics.coefficients();
        let m = model.core.coordinates();
        let width = 3 * n;
        let mut coupling = Matrix::zeros(m * n, m * n);
        let mut elements = Vec::with_capacity(active.len());
        for (&element, beyond) in active.iter().zip(beyond) {
            let jacobian = Matrix::from_rows(width, width, beyond.clone())?;
            let mut local = Matrix::identity(width);
            if let Some(residual) = &model.residual {
                for d in 0..3 {
                    for e in 0..3 {
                        let flexibility = residual.at(3 * element + d, 3 * element + e);
                        for c in 0..n {
                            let source = jacobian.row(e * n + c);
                            add_scaled(local.row_mut(d * n + c), flexibility, source);
                        }
                    }
                }
            }
            let local = Factors::new(local, "element with its own flexibility")?;
            let transfer = jacobian.times(&local.inverse());
            let mut shapes = Matrix::zeros(3, m);
            for d in 0..3 {
                shapes
                    .row_mut(d)
                    .copy_from_slice(basis.row(3 * element + d));
            }
            // Transfer times shapes, then shapes transposed times that.
            for d in 0..3 {
                for c in 0..n {
                    let mut right = vec![0.0; n * m];
                    for e in 0..3 {
                        for f in 0..n {
                            let factor = transfer.at(d * n + c, e * n + f);
                            if factor != 0.0 {
                                add_scaled(&mut right[f * m..][..m], factor, shapes.row(e));
                            }
                        }
                    }
                    for a in 0..m {
                        let factor = shapes.at(d, a);
                        if factor != 0.0 {
                            add_scaled(coupling.row_mut(c * m + a), factor, &right);
                        }
                    }
                }
            }
            elements.push(ElementBlock {
                local,
                transfer,
                shapes,
            });
        }
        Ok(ElementPart { elements, coupling })
    }
}

/// The preconditioner at one frequency.
pub(super) struct Preconditioner<'a> {
    part: &'a ElementPart,
    harmonics: &'a Harmonics,
    cores: &'a [Matrix<Complex64>],
    /// Of `1 + W Z`.
    modal: Factors,
}

impl<'a> Preconditioner<'a> {
    pub(super) fn new(
        part: &'a ElementPart,
        harmonics: &'a Harmonics,
        cores: &'a [Matrix<Complex64>],
    ) -> Result<Preconditioner<'a>, DynamicsError> {
        let order = part.coupling.rows();
        let m = order / harmonics.coefficients();
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
        let mut modal = part.coupling.times(&receptance);
        for i in 0..order {
            modal.set(i, i, modal.at(i, i) + 1.0);
        }
        Ok(Preconditioner {
            part,
            harmonics,
            cores,
            modal: Factors::new(modal, "modal part of the preconditioner")?,
        })
    }

    /// The approximate inverse applied to `right` (active unknowns).
    pub(super) fn apply(&self, right: &[f64]) -> Vec<f64> {
        let n = self.harmonics.coefficients();
        let width = 3 * n;
        let m = self.modal_order() / n;
        let mut modal = vec![0.0; n * m];
        for (block, right) in self.part.elements.iter().zip(right.chunks(width)) {
            let force = block.transfer.apply(right);
            for d in 0..3 {
                for c in 0..n {
                    let target = &mut modal[c * m..][..m];
                    add_scaled(target, force[d * n + c], block.shapes.row(d));
                }
            }
        }
        self.modal.solve(&mut modal);
        let mut generalised = Matrix::zeros(n, m);
        for (c, row) in modal.chunks(m).enumerate() {
            generalised.row_mut(c).copy_from_slice(row);
        }
        let mut coordinates = Matrix::zeros(n, m);
        for (index, core) in self.cores.iter().enumerate() {
            let slot = self.harmonics.slot(index);
            let (amplitude, _) = ClosedModel::amplitudes(self.harmonics, index, core, &generalised);
            for (a, value) in amplitude.iter().enumerate() {
                coordinates.set(slot, a, value.re);
                if index > 0 {
                    coordinates.set(slot + 1, a, -value.im);
                }
            }
        }
        let mut out = right.to_vec();
        for (block, out) in self.part.elements.iter().zip(out.chunks_mut(width)) {
            for d in 0..3 {
                for c in 0..n {
                    out[d * n + c] -= dot(block.shapes.row(d), coordinates.row(c));
                }
            }
            block.local.solve(out);
        }
        out
    }

    fn modal_order(&self) -> usize {
        self.part.coupling.rows()
    }
}
