//! Copies between fields and lists of cells. Few cells carry load, and contiguous values are faster to work on.

/// Copies the values of a field on some cells into `values`.
pub(super) fn gather(field: &[f64], cells: &[usize], values: &mut Vec<f64>) {
    values.clear();
    values.extend(cells.iter().map(|&c| field[c]));
}

/// Writes `values` into a field on some cells.
pub(super) fn scatter(values: &[f64], cells: &[usize], field: &mut [f64]) {
    for (&c, value) in cells.iter().zip(values) {
        field[c] = *value;
    }
}
