//! GMRES, and what one solution by it tells the next.

use std::collections::VecDeque;

use super::DynamicsError;
use crate::linalg::{Matrix, Scalar, add_scaled, single, vectorised};

/// Basis vectors before giving up; the preconditioned operator needs one to four dozen.
pub(super) const MOST_ITERATIONS: usize = 150;

/// Iterations from which a solution is learned from: fewer cost less than learning.
const WORTH_LEARNING: usize = 16;
/// Most directions that are kept, and the share that is left of each of them in its image, at most.
const MOST_LEARNED: usize = 48;
const SHRUNK: f64 = 0.5;

/// A direction u and its image B u of length 1, in single precision: half as much to read, and exact enough for a preconditioner.
pub(super) struct Pair {
    direction: Vec<f32>,
    image: Vec<f32>,
}

/// What GMRES learned of a preconditioned operator B: the directions that it shrinks most, which iterations are spent on. For an
/// operator near B they are solved for at once. It is a preconditioner, so that no solution is less exact for it.
#[derive(Default)]
pub(super) struct Learned {
    /// The newest first.
    pairs: VecDeque<Pair>,
}

impl Learned {
    /// What B makes `right` of as far as that is known, and the rest of `right` as it is.
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

    /// Adds what a solution preconditioned with this learned, and forgets the oldest.
    pub(super) fn add(&mut self, pairs: Vec<Pair>) {
        for pair in pairs {
            self.pairs.push_front(pair);
        }
        self.pairs.truncate(MOST_LEARNED);
    }
}

/// A solution by GMRES.
pub(super) struct Solution {
    pub(super) x: Vec<f64>,
    pub(super) iterations: usize,
    /// What it took many for.
    pub(super) learned: Vec<Pair>,
}

/// Part of a vector that is left beside the basis, below which rounding of the projections is taken away too: above it the basis is
/// orthogonal to some 1e-13, and less does for GMRES with projections one after the other (Paige, Rozložník and Strakoš 2006).
const CANCELLED: f64 = 1e-3;

/// The Arnoldi relation `operator(Z) = V H`, H by its factors: rotations Q and the triangle R.
#[derive(Default)]
struct Arnoldi {
    /// V, orthonormal.
    basis: Vec<Vec<f64>>,
    /// Z, `precondition` of all but the last of V.
    moved: Vec<Vec<f64>>,
    /// Columns of R.
    columns: Vec<Vec<f64>>,
    rotations: Vec<(f64, f64)>,
}

impl Arnoldi {
    /// Takes from `next` its parts along the basis, one after the other, and adds these to `column`; the norm of what is left.
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

    /// The solution for the rotated right-hand side `target`.
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

    /// The directions of the smallest singular values of R.
    fn learned(&self) -> Vec<Pair> {
        let k = self.columns.len();
        let entry = |i: usize, j: usize| if i <= j { self.columns[j][i] } else { 0.0 };
        let triangle = Matrix::from_fn(k, k, entry);
        let Ok((squares, directions)) = triangle.transpose_times(&triangle).symmetric_eigen()
        else {
            return Vec::new();
        };
        let images = triangle.times(&directions);
        let rotated = self.rotated();
        let shrunk = squares
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
        shrunk.take(MOST_LEARNED).enumerate().map(pair).collect()
    }

    /// V Q, so that `operator(Z)` is that times R.
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

/// Solves `operator(precondition(y)) = right` by GMRES from zero for `x = precondition(y)`.
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
            learned: Vec::new(),
        });
    }
    let mut space = Arnoldi::default();
    space.basis.push(right.iter().map(|v| v / norm).collect());
    let mut target = vec![norm];
    for k in 0..MOST_ITERATIONS {
        let moved = precondition(&space.basis[k]);
        let mut next = operator(&moved);
        space.moved.push(moved);
        let mut column = vec![0.0; k + 2];
        let whole = self::norm(&next);
        let mut size = space.project(&mut next, &mut column);
        if size < CANCELLED * whole {
            size = space.project(&mut next, &mut column);
        }
        column[k + 1] = size;
        for (i, &(c, s)) in space.rotations.iter().enumerate() {
            let (a, b) = (column[i], column[i + 1]);
            column[i] = c * a + s * b;
            column[i + 1] = c * b - s * a;
        }
        let radius = column[k].hypot(column[k + 1]);
        let (c, s) = (column[k] / radius, column[k + 1] / radius);
        space.rotations.push((c, s));
        column[k] = radius;
        target.push(-s * target[k]);
        target[k] *= c;
        space.columns.push(column);
        let left = target[k + 1].abs() / norm;
        let is_whole = size == 0.0;
        if !is_whole {
            space.basis.push(next.iter().map(|v| v / size).collect());
        }
        if left <= tolerance || is_whole {
            let iterations = k + 1;
            let is_worth = iterations >= WORTH_LEARNING && !is_whole;
            return Ok(Solution {
                x: space.solution(&target),
                iterations,
                learned: if is_worth {
                    space.learned()
                } else {
                    Vec::new()
                },
            });
        }
        if !left.is_finite() {
            break;
        }
    }
    Err(DynamicsError::Krylov {
        iterations: space.columns.len(),
        residual: target.last().map_or(f64::NAN, |t| t.abs() / norm),
        tolerance,
    })
}

#[inline(always)]
pub(super) fn norm(vector: &[f64]) -> f64 {
    dot(vector, vector).sqrt()
}

/// Strands of a sum: so many that additions do not wait for each other.
const STRANDS: usize = 16;

/// Sums in strands, always the same ones.
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
