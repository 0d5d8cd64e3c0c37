//! GMRES that reuses directions of earlier solutions.

use std::collections::VecDeque;

use super::DynamicsError;
use crate::linalg::{Matrix, Scalar, add_scaled, single, vectorised};

/// Largest number of basis vectors; the preconditioned operator needs one to four dozen.
pub(super) const MOST_ITERATIONS: usize = 150;

/// Smallest number of iterations of a solution whose slow directions are stored. A solution with fewer iterations costs
/// less than the storage of its directions.
const WORTH_LEARNING: usize = 16;
/// Largest number of stored directions.
const MOST_LEARNED: usize = 48;
/// Singular value below which a direction is stored.
const SHRUNK: f64 = 0.5;

/// Direction u and its image B u under the operator B. The image B u has the length 1. Single precision halves the
/// memory traffic and is exact enough for a preconditioner.
pub(super) struct Pair {
    direction: Vec<f32>,
    image: Vec<f32>,
}

/// Directions that a preconditioned operator B shrinks most. These directions cost GMRES the most iterations.
///
/// For an operator near B the slow directions are solved directly. The slow directions act as a preconditioner, so
/// solutions do not lose accuracy.
#[derive(Default)]
pub(super) struct SlowDirections {
    /// Newest pair first.
    pairs: VecDeque<Pair>,
}

impl SlowDirections {
    /// Returns B⁻¹ `right` within the stored directions, plus the rest of `right` unchanged.
    pub(super) fn apply(&self, right: &[f64]) -> Vec<f64> {
        vectorised(
            #[inline(always)]
            || self.split(right),
        )
    }

    #[inline(always)]
    fn split(&self, right: &[f64]) -> Vec<f64> {
        let mut rest = single(right);
        let mut out = vec![0.0; right.len()];
        for Pair { direction, image } in &self.pairs {
            let share = dot(image, &rest);
            add_scaled(&mut out, share, direction);
            add_scaled(&mut rest, -share, image);
        }
        let sums = out.iter().zip(&rest);
        sums.map(|(out, rest)| f64::from(out + rest)).collect()
    }

    /// Adds the directions of a new solution, and removes the oldest.
    pub(super) fn add(&mut self, pairs: Vec<Pair>) {
        for pair in pairs {
            self.pairs.push_front(pair);
        }
        self.pairs.truncate(MOST_LEARNED);
    }
}

/// Solution by GMRES.
pub(super) struct Solution {
    pub(super) x: Vec<f64>,
    pub(super) iterations: usize,
    /// The directions that took many iterations.
    pub(super) slow_directions: Vec<Pair>,
}

/// Smallest ratio of the norms of a vector after and before a projection. Below this ratio, a second projection removes
/// rounding errors. Without a second projection, a basis of vectors above this ratio is orthogonal to about 1e-13.
/// GMRES with sequential projections needs less orthogonality (Paige, Rozložník and Strakoš 2006).
const CANCELLED: f64 = 1e-3;

/// Arnoldi relation `operator(Z) = V H`, with H stored as rotations Q and the triangle R.
#[derive(Default)]
struct Arnoldi {
    /// V, orthonormal.
    basis: Vec<Vec<f64>>,
    /// Z, the preconditioned vectors of V without the last.
    moved: Vec<Vec<f64>>,
    /// Columns of R.
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
}

impl Arnoldi {
    /// Subtracts from the vector `next` its projection on each basis vector, one basis vector after the other. Adds the
    /// projections to `column`, and returns the norm of the remaining vector.
    fn project(&self, next: &mut [f64], column: &mut [f64]) -> f64 {
        vectorised(
            #[inline(always)]
            || {
                for (vector, sum) in self.basis.iter().zip(column) {
                    let projection = dot(vector, next);
                    *sum += projection;
                    add_scaled(next, -projection, vector);
                }
                norm(next)
            },
        )
    }

    /// Returns the solution for the rotated right-hand side `target`.
    fn solution(&self, target: &[f64]) -> Vec<f64> {
        let mut weights = target[..self.columns.len()].to_vec();
        for i in (0..weights.len()).rev() {
            for j in i + 1..weights.len() {
                weights[i] -= self.columns[j][i] * weights[j];
            }
            weights[i] /= self.columns[i][i];
        }
        combined(&self.moved, &weights)
    }

    /// Returns the directions of the smallest singular values of R.
    fn slow_directions(&self) -> Vec<Pair> {
        let k = self.columns.len();
        let entry = |i: usize, j: usize| if i <= j { self.columns[j][i] } else { 0.0 };
        let triangle = Matrix::from_fn(k, k, entry);
        let Ok((squares, directions)) = triangle.transpose_times(&triangle).symmetric_eigen()
        else {
            return Vec::new();
        };
        let images = triangle.times(&directions);
        let rotated = self.rotated();
        let small_squares = squares
            .iter()
            .take_while(|square| **square < SHRUNK.powi(2));
        let pair = |(j, square): (usize, &f64)| {
            let scaled = |weights: &[f64]| weights.iter().map(|w| w / square.sqrt()).collect();
            let (direction, image): (Vec<f64>, Vec<f64>) =
                (scaled(directions.column(j)), scaled(images.column(j)));
            Pair {
                direction: single(&combined(&self.moved, &direction)),
                image: single(&combined(&rotated, &image)),
            }
        };
        small_squares
            .take(MOST_LEARNED)
            .enumerate()
            .map(pair)
            .collect()
    }

    /// Returns V Q, so that `operator(Z) = V Q R`.
    fn rotated(&self) -> Vec<Vec<f64>> {
        let mut last = self.basis[0].clone();
        let pairs = self.rotations.iter().zip(&self.basis[1..]);
        let rotate = |((c, s), next): (&(f64, f64), &Vec<f64>)| {
            let mut out = next.clone();
            for (last, out) in last.iter_mut().zip(&mut out) {
                (*last, *out) = (c * *out - s * *last, c * *last + s * *out);
            }
            out
        };
        pairs.map(rotate).collect()
    }
}

fn combined(vectors: &[Vec<f64>], weights: &[f64]) -> Vec<f64> {
    let mut sum = vec![0.0; vectors.first().map_or(0, Vec::len)];
    for (vector, weight) in vectors.iter().zip(weights) {
        add_scaled(&mut sum, *weight, vector);
    }
    sum
}

/// Solves `operator(precondition(y)) = right` by GMRES from zero, and returns `x = precondition(y)`.
///
/// # Errors
/// [`DynamicsError::Krylov`].
pub(super) fn solve(
    operator: impl Fn(&[f64]) -> Vec<f64>,
    precondition: impl Fn(&[f64]) -> Vec<f64>,
    right: &[f64],
    tolerance: f64,
) -> Result<Solution, DynamicsError> {
    let norm = norm(right);
    if norm == 0.0 {
        return Ok(Solution {
            x: vec![0.0; right.len()],
            iterations: 0,
            slow_directions: Vec::new(),
        });
    }
    let mut arnoldi = Arnoldi::default();
    arnoldi.basis.push(right.iter().map(|v| v / norm).collect());
    let mut target = vec![norm];
    for k in 0..MOST_ITERATIONS {
        let preconditioned = precondition(&arnoldi.basis[k]);
        let mut next = operator(&preconditioned);
        arnoldi.moved.push(preconditioned);
        let mut column = vec![0.0; k + 2];
        let norm_before = self::norm(&next);
        let mut size = arnoldi.project(&mut next, &mut column);
        if size < CANCELLED * norm_before {
            size = arnoldi.project(&mut next, &mut column);
        }
        column[k + 1] = size;
        for (i, &(c, s)) in arnoldi.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let radius = column[k].hypot(column[k + 1]);
        let (c, s) = (column[k] / radius, column[k + 1] / radius);
        arnoldi.rotations.push((c, s));
        column[k] = radius;
        target.push(-s * target[k]);
        target[k] *= c;
        arnoldi.columns.push(column);
        let relative_residual = target[k + 1].abs() / norm;
        let is_exact = size == 0.0;
        if !is_exact {
            arnoldi.basis.push(next.iter().map(|v| v / size).collect());
        }
        if relative_residual <= tolerance || is_exact {
            let iterations = k + 1;
            let is_worth_learning = iterations >= WORTH_LEARNING && !is_exact;
            return Ok(Solution {
                x: arnoldi.solution(&target),
                iterations,
                slow_directions: if is_worth_learning {
                    arnoldi.slow_directions()
                } else {
                    Vec::new()
                },
            });
        }
        if !relative_residual.is_finite() {
            break;
        }
    }
    Err(DynamicsError::Krylov {
        iterations: arnoldi.columns.len(),
        residual: target.last().map_or(f64::NAN, |t| t.abs() / norm),
        tolerance,
    })
}

#[inline(always)]
pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// Number of partial sums, so that additions do not wait for each other.
const STRANDS: usize = 16;

/// Computes a scalar product in partial sums of fixed order, so the result is reproducible.
#[inline(always)]
pub(super) fn dot<T: Scalar>(a: &[T], b: &[T]) -> T {
    let mut strands = [T::default(); STRANDS];
    let whole = a.chunks_exact(STRANDS);
    let rest = whole.remainder();
    let split = a.len() - rest.len();
    for (x, y) in whole.zip(b.chunks_exact(STRANDS)) {
        for s in 0..STRANDS {
            strands[s] += x[s] * y[s];
        }
    }
    let mut sum = T::default();
    strands.iter().for_each(|strand| sum += *strand);
    let tail = rest.iter().zip(&b[split..]);
    tail.for_each(|(x, y)| sum += *x * *y);
    sum
}
