//! Values on listed cells: few cells carry load, and values side by side are quicker to work on than those of a field.

/// The values of a field on some cells.
pub(super) fn gather(field: &[f64], cells: &[usize], values: &mut Vec<f64>) {
    values.clear();
    values.extend(cells.iter().map(|&c| field[c]));
}

/// Sets a field on some cells.
pub(super) fn scatter(values: &[f64], cells: &[usize], field: &mut [f64]) {
    for (&c, value) in cells.iter().zip(values) {
        field[c] = *value;
    }
}
