//! Fast Fourier transforms of fields. No other module uses `rustfft` or `rayon`.

mod axis;
mod convolution;

use rustfft::FftPlanner;

pub use convolution::{Convolution, VectorKernel, Workspace};
pub use rustfft::FftDirection;
pub use rustfft::num_complex::Complex64;

/// Returns the smallest even number of the form 2^a 3^b 5^c that is at least `least`.
pub fn fast_length(least: usize) -> usize {
    let cofactor = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n
    };
    let mut n = least.max(2).next_multiple_of(2);
    while cofactor(n) != 1 {
        n += 2;
    }
    n
}

/// Transforms a complex field of any shape in place, without normalisation.
///
/// The exponent has the sign −i forward and +i inverse. The function suits fields that a run transforms a few times,
/// such as a surface. Use [`Convolution`] for repeated transforms.
pub fn transform(values: &mut Vec<Complex64>, nx: usize, ny: usize, direction: FftDirection) {
    let mut planner = FftPlanner::new();
    planner.plan_fft(ny, direction).process(values);
    let mut columns = transposed(values, nx, ny);
    planner.plan_fft(nx, direction).process(&mut columns);
    *values = transposed(&columns, ny, nx);
}

/// Returns the `cols * rows` array whose entry (c, r) is the entry (r, c) of `values`.
fn transposed(values: &[Complex64], rows: usize, cols: usize) -> Vec<Complex64> {
    (0..rows * cols)
        .map(|k| values[(k % rows) * cols + k / rows])
        .collect()
}

/// Returns the signed wave number of position `k` in a transform of length `n`. The Nyquist position of an even length
/// is negative.
pub fn wave_number(k: usize, n: usize) -> i64 {
    if 2 * k < n {
        k as i64
    } else {
        k as i64 - n as i64
    }
}
