//! Transforms along one axis of a field that fills at most the first half of its points.
//!
//! Of a line x_j whose second half is zero, the even waves are the transform of the first half, and the odd ones that of
//! x_j e^(−iπj/h), h points long each: two transforms in the cache for one of twice the length, and nothing is done for zeros. Back
//! again only the first half is asked for, from the same two.

use std::sync::Arc;

use rustfft::{Fft, FftPlanner};

use super::Complex64;

/// Transforms of lines of `cells` values, zero beyond them, to `points` waves.
///
/// A line is stored as it is in transformed space: all waves in their order, or, where the line is halved, the even ones and
/// then the odd ones.
pub(super) struct Axis {
    pub(super) cells: usize,
    pub(super) points: usize,
    /// Length of a transform: all points, or half of them.
    length: usize,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// e^(−iπj/h) at the cells where the line is halved, or nothing.
    twiddles: Vec<Complex64>,
}

impl Axis {
    pub(super) fn new(cells: usize, points: usize) -> Self {
        let halved = points.is_multiple_of(2) && points / 2 >= cells;
        let length = if halved { points / 2 } else { points };
        let twiddle =
            |j: usize| Complex64::from_polar(1.0, -std::f64::consts::PI * j as f64 / length as f64);
        let mut planner = FftPlanner::new();
        Axis {
            cells,
            points,
            length,
            forward: planner.plan_fft_forward(length),
            inverse: planner.plan_fft_inverse(length),
            twiddles: (0..cells).filter(|_| halved).map(twiddle).collect(),
        }
    }

    /// Complex numbers of scratch that the transforms want.
    pub(super) fn scratch(&self) -> usize {
        let forward = self.forward.get_inplace_scratch_len();
        forward.max(self.inverse.get_inplace_scratch_len())
    }

    /// Where a wave is stored, 0 ≤ `wave` < points.
    pub(super) fn position(&self, wave: usize) -> usize {
        if self.twiddles.is_empty() {
            wave
        } else {
            wave % 2 * self.length + wave / 2
        }
    }

    /// Puts the cells' values into a line.
    #[inline(always)]
    pub(super) fn put(&self, line: &mut [Complex64], values: impl Iterator<Item = Complex64>) {
        if self.twiddles.is_empty() {
            for (x, value) in line.iter_mut().zip(values) {
                *x = value;
            }
            return;
        }
        let (even, odd) = line.split_at_mut(self.length);
        for (((e, o), t), value) in even.iter_mut().zip(odd).zip(&self.twiddles).zip(values) {
            *e = value;
            *o = value * t;
        }
    }

    /// Transforms lines, one after the other, into which all cells have been put.
    pub(super) fn forward(&self, lines: &mut [Complex64], scratch: &mut [Complex64]) {
        if self.cells < self.length {
            for part in lines.chunks_exact_mut(self.length) {
                part[self.cells..].fill(Complex64::ZERO);
            }
        }
        self.forward.process_with_scratch(lines, scratch);
    }

    /// Transforms lines back, up to what [`Axis::take`] does.
    pub(super) fn inverse(&self, lines: &mut [Complex64], scratch: &mut [Complex64]) {
        self.inverse.process_with_scratch(lines, scratch);
    }

    /// Hands the cells' values in a line on to as many targets.
    #[inline(always)]
    pub(super) fn take<T>(
        &self,
        line: &[Complex64],
        targets: impl Iterator<Item = T>,
        mut set: impl FnMut(T, Complex64),
    ) {
        if self.twiddles.is_empty() {
            for (x, target) in line.iter().zip(targets) {
                set(target, *x);
            }
            return;
        }
        let (even, odd) = line.split_at(self.length);
        for (((e, o), t), target) in even.iter().zip(odd).zip(&self.twiddles).zip(targets) {
            set(target, e + o * t.conj());
        }
    }
}
