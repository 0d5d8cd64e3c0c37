//! The complex two-dimensional Fourier transform of a field of any shape.
//!
//! Surfaces are transformed a few times in a run, so this is written for shape and clarity; the transforms of the contact
//! solver are elsewhere.

use rustfft::num_complex::Complex;
use rustfft::{FftDirection, FftPlanner};

/// Transforms `nx * ny` values in place, without normalisation: forward has the sign -i in the exponent, inverse +i.
pub(super) fn transform(
    values: &mut Vec<Complex<f64>>,
    nx: usize,
    ny: usize,
    direction: FftDirection,
) {
    let mut planner = FftPlanner::new();
    planner.plan_fft(ny, direction).process(values);
    let mut columns = transposed(values, nx, ny);
    planner.plan_fft(nx, direction).process(&mut columns);
    *values = transposed(&columns, ny, nx);
}

/// The `cols * rows` array whose entry (c, r) is the entry (r, c) of `values`.
fn transposed(values: &[Complex<f64>], rows: usize, cols: usize) -> Vec<Complex<f64>> {
    (0..rows * cols)
        .map(|k| values[(k % rows) * cols + k / rows])
        .collect()
}

/// The signed wave number of position `k` in a transform of length `n`; the Nyquist position of an even length is negative.
pub(super) fn wave_number(k: usize, n: usize) -> i64 {
    if 2 * k < n {
        k as i64
    } else {
        k as i64 - n as i64
    }
}
