//! GMRES with a preconditioner that knows the element and the modes, for when nearly all elements are active.

use num_complex::Complex64;

use super::closed_model::ClosedModel;
use super::{DynamicsError, Harmonics};
use crate::linalg::{Factors, RowMatrix as Matrix, add_scaled};

/// Basis vectors before giving up; the preconditioned operator needs one to four dozen.
const MOST_ITERATIONS: usize = 150;

/// Solves `operator(x) = right` from `start`, to `tolerance` relative to `right`: x and the iterations.
///
/// # Errors
/// [`DynamicsError::Krylov`].
pub(super) fn solve_from(
    start: &[f64],
    operator: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    right: &[f64],
    tolerance: f64,
) -> Result<(Vec<f64>, usize), DynamicsError> {
    let mut left = right.to_vec();
    add_scaled(&mut left, -1.0, &operator(start));
    let (all, rest) = (norm(right), norm(&left));
    if rest <= tolerance * all {
        return Ok((start.to_vec(), 0));
    }
    let (mut x, iterations) = solve(operator, precondition, &left, tolerance * all / rest)?;
    add_scaled(&mut x, 1.0, start);
    Ok((x, iterations))
}

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
    /// Rows of B of the elements, `3 · elements × coordinates`.
    shapes: Matrix,
    /// W, ordered by coefficient, then coordinate.
    coupling: Matrix,
}

struct ElementBlock {
    /// P⁻¹.
    inverse: Matrix,
    /// G P⁻¹.
    transfer: Matrix,
}

impl ElementPart {
    /// For the elements `active`, with Jacobians `beyond` (each `3n × 3n`).
    pub(super) fn new(
        residual: Option<&Matrix>,
        basis: &Matrix,
        harmonics: &Harmonics,
        active: &[usize],
        beyond: &[Matrix],
    ) -> Result<ElementPart, DynamicsError> {
        let n = harmonics.coefficients();
        let m = basis.columns();
        let width = 3 * n;
        let mut shapes = Matrix::zeros(3 * active.len(), m);
        let mut elements = Vec::with_capacity(active.len());
        for (place, (&element, jacobian)) in active.iter().zip(beyond).enumerate() {
            let mut local = Matrix::identity(width);
            if let Some(residual) = residual {
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
            let of_matrix = DynamicsError::of_matrix("element with its own flexibility");
            let inverse = local.factorize().map_err(of_matrix)?.inverse();
            for d in 0..3 {
                let row = shapes.row_mut(3 * place + d);
                row.copy_from_slice(basis.row(3 * element + d));
            }
            elements.push(ElementBlock {
                transfer: jacobian.times(&inverse),
                inverse,
            });
        }
        // For every pair of coefficients a product over all elements.
        let mut coupling = Matrix::zeros(m * n, m * n);
        for c in 0..n {
            for f in 0..n {
                let mut moved = Matrix::zeros(3 * active.len(), m);
                for (place, block) in elements.iter().enumerate() {
                    for d in 0..3 {
                        for e in 0..3 {
                            let factor = block.transfer.at(d * n + c, e * n + f);
                            let source = shapes.row(3 * place + e);
                            add_scaled(moved.row_mut(3 * place + d), factor, source);
                        }
                    }
                }
                let mut product = Matrix::zeros(m, m);
                product.add_transposed_product(&shapes, &moved);
                for a in 0..m {
                    coupling.row_mut(c * m + a)[f * m..][..m].copy_from_slice(product.row(a));
                }
            }
        }
        Ok(ElementPart {
            elements,
            shapes,
            coupling,
        })
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
        let m = part.shapes.columns();
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
        let n = self.harmonics.coefficients();
        let (width, m) = (3 * n, self.part.shapes.columns());
        let shapes = &self.part.shapes;
        let mut force = Matrix::zeros(shapes.rows(), n);
        let elements = self.part.elements.iter();
        let targets = force.values_mut().chunks_mut(width);
        for ((block, right), target) in elements.zip(right.chunks(width)).zip(targets) {
            for (i, target) in target.iter_mut().enumerate() {
                *target = dot(block.transfer.row(i), right);
            }
        }
        let mut modal = Matrix::zeros(n, m);
        modal.add_transposed_product(&force, shapes);
        self.modal.solve(modal.values_mut());
        let generalised = modal.transposed();
        let coordinates = ClosedModel::coordinates(self.harmonics, self.cores, &generalised);
        let mut out = shapes.times(&coordinates).into_values();
        let elements = self.part.elements.iter();
        let rows = out.chunks_mut(width).zip(right.chunks(width));
        for (block, (out, right)) in elements.zip(rows) {
            let left: Vec<f64> = right.iter().zip(&*out).map(|(r, o)| r - o).collect();
            for (i, out) in out.iter_mut().enumerate() {
                *out = dot(block.inverse.row(i), &left);
            }
        }
        out
    }
}
