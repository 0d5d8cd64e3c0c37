//! Degrees of freedom of the rows of imported matrices, and the list of the rows that are used.

use super::ImportError;
use crate::structure::frequencies::bodies;
use crate::structure::matrices::{Dof, Matrices, Triplets};

/// Assigns degrees of freedom to the rows if the files do not assign them. The nodes are in the order `order`. Each
/// node has three displacements along x, y and z. If a node has six rows, the rotations about x, y and z follow the
/// displacements.
///
/// # Errors
/// [`ImportError::NoDofs`] unless there are three or six rows for each node.
pub fn name_rows(matrices: &mut Matrices, order: &[i64]) -> Result<(), ImportError> {
    if matrices.dofs.is_some() {
        return Ok(());
    }
    let (rows, nodes) = (matrices.size, order.len());
    let rows_per_node = [3, 6]
        .into_iter()
        .find(|rows_per_node| nodes > 0 && rows == rows_per_node * nodes);
    let rows_per_node = rows_per_node.ok_or(ImportError::NoDofs { rows, nodes })?;
    let node_dofs =
        |&node: &i64| (1..=rows_per_node as u32).map(move |direction| Dof { node, direction });
    matrices.dofs = Some(order.iter().flat_map(node_dofs).collect());
    Ok(())
}

/// Numbers the rows that are used, and counts them. Fixed rows and rows without entries are not used.
pub(super) fn number_rows(
    matrices: &Matrices,
    both: [&Triplets; 2],
    is_held: &[bool],
) -> (Vec<Option<u32>>, usize) {
    let mut has_entry = vec![false; matrices.size];
    for &(i, j, v) in both.into_iter().flat_map(|matrix| &matrix.entries) {
        if v != 0.0 {
            has_entry[i as usize] = true;
            has_entry[j as usize] = true;
        }
    }
    let mut rows = 0;
    let place = (0..matrices.size).map(|row| {
        (has_entry[row] && !is_held[row]).then(|| {
            rows += 1;
            rows as u32 - 1
        })
    });
    let place = place.collect();
    (place, rows)
}

/// Marks rows as fixed if no entry connects them to a mass, and returns their number.
pub(super) fn fix_massless_rows(
    matrices: &Matrices,
    [stiffness, mass]: [&Triplets; 2],
    is_held: &mut [bool],
) -> usize {
    let (place, rows) = number_rows(matrices, [stiffness, mass], is_held);
    let mut masses = place.iter().zip(mass.diagonal());
    if masses.all(|(place, mass)| place.is_none() || mass > 0.0) {
        return 0;
    }
    let (k, m) = (stiffness.lower(&place), mass.lower(&place));
    let (body, bodies) = bodies(rows, &k, &m);
    let mut has_mass = vec![false; bodies];
    for &(i, _, value) in &m {
        has_mass[body[i as usize] as usize] |= value != 0.0;
    }
    // [`ImportError::Massless`] reports a structure without any mass.
    if !has_mass.contains(&true) {
        return 0;
    }
    let mut left_out = 0;
    for (row, place) in place.iter().enumerate() {
        if place.is_some_and(|place| !has_mass[body[place as usize] as usize]) {
            is_held[row] = true;
            left_out += 1;
        }
    }
    left_out
}
