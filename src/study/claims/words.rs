//! Formatting of numbers in findings, and arithmetic of curves.

use crate::report::quantity::{SHARE, four_digits, with_best_unit};

/// Formats a share in percent.
pub fn percent(share: f64) -> String {
    with_best_unit(share, SHARE)
}

/// Formats a length in µm.
pub fn micrometres(metres: f64) -> String {
    format!("{} µm", four_digits(1e6 * metres))
}

/// Formats a list of values.
pub fn number_list(values: impl IntoIterator<Item = f64>) -> String {
    let texts: Vec<String> = values.into_iter().map(four_digits).collect();
    texts.join(", ")
}

/// Interpolates a curve through points with rising `x` linearly at `at`. The interpolated curve is constant
/// beyond its ends.
pub fn interpolated(x: &[f64], y: &[f64], at: f64) -> f64 {
    let next = x.partition_point(|x| *x <= at);
    if next == 0 {
        return y.first().copied().unwrap_or(f64::NAN);
    }
    if next == x.len() {
        return y[y.len() - 1];
    }
    let part = (at - x[next - 1]) / (x[next] - x[next - 1]);
    y[next - 1] + part * (y[next] - y[next - 1])
}

/// Returns true if each value is above its predecessor.
pub fn rises(values: &[f64]) -> bool {
    values.windows(2).all(|pair| pair[1] > pair[0])
}

/// Returns true if no value is below its predecessor by more than `tolerance`.
pub fn never_falls(values: &[f64], tolerance: f64) -> bool {
    values.windows(2).all(|pair| pair[1] >= pair[0] - tolerance)
}
