//! Fourier transforms along one axis, for lines whose second half is zero padding.
//!
//! Take a line x_j of 2h points whose second half is zero. The even waves of the line are the transform of its first
//! half. The odd waves of the line are the transform of x_j e^(−iπj/h) in the first half. Two transforms of length h,
//! one for the even and one for the odd waves, replace one transform of length 2h. The short transforms fit in the
//! cache and do no work on zeros. The inverse transform computes only the first half of the line, with the inverses of
//! the two short transforms.

use std::sync::Arc;

use rustfft::{Fft, FftPlanner};

use super::Complex64;

/// Transforms between lines of `cells` values, zero beyond the cells, and `points` waves.
///
/// A line is stored in the order of transformed space. A full line contains the waves in the order of the transform. A
/// halved line contains all even waves and then all odd waves.
pub(super) struct Axis {
    pub(super) cells: usize,
    pub(super) points: usize,
    /// Length of one transform. A full line has transforms over all points, and a halved line has transforms over half
    /// of the points.
    length: usize,
    forward: Arc<dyn Fft<f64>>,
    inverse: Arc<dyn Fft<f64>>,
    /// e^(−iπj/h) at the cells of a halved line; empty for a full line.
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

    /// Returns the number of complex scratch values that the transforms need.
    pub(super) fn scratch(&self) -> usize {
        let forward = self.forward.get_inplace_scratch_len();
        forward.max(self.inverse.get_inplace_scratch_len())
    }

    /// Returns the position at which a wave is stored, 0 ≤ `wave` < points.
    pub(super) fn position(&self, wave: usize) -> usize {
        if self.twiddles.is_empty() {
            wave
        } else {
            wave % 2 * self.length + wave / 2
        }
    }

    /// Writes the values of the cells into a line, ready for [`Axis::forward`].
    #[inline(always)]
    pub(super) fn fill_line(
        &self,
        line: &mut [Complex64],
        values: impl Iterator<Item = Complex64>,
    ) {
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

    /// Transforms consecutive lines that [`Axis::fill_line`] has filled.
    pub(super) fn forward(&self, lines: &mut [Complex64], scratch: &mut [Complex64]) {
        if self.cells < self.length {
            for part in lines.chunks_exact_mut(self.length) {
                part[self.cells..].fill(Complex64::ZERO);
            }
        }
        self.forward.process_with_scratch(lines, scratch);
    }

    /// Transforms lines back. [`Axis::read_line`] then completes the values of the cells.
    pub(super) fn inverse(&self, lines: &mut [Complex64], scratch: &mut [Complex64]) {
        self.inverse.process_with_scratch(lines, scratch);
    }

    /// Passes the value of each cell of a line to the target of the cell.
    #[inline(always)]
    pub(super) fn read_line<T>(
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
