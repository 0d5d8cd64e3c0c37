//! The rows of matrices: what they stand for, and which take part.

use super::ImportError;
use crate::structure::frequencies::bodies;
use crate::structure::matrices::{Dof, Matrices, Triplets};

/// Says what the rows are of matrices whose files do not: x, y, z of each of these nodes in turn, and rotations about them where there are six.
///
/// # Errors
/// [`ImportError::NoDofs`] where there are neither three nor six rows for each node.
pub fn name_rows(matrices: &mut Matrices, order: &[i64]) -> Result<(), ImportError> {
    if matrices.dofs.is_some() {
        return Ok(());
    }
    let (rows, nodes) = (matrices.size, order.len());
    let each = [3, 6]
        .into_iter()
        .find(|each| nodes > 0 && rows == each * nodes);
    let each = each.ok_or(ImportError::NoDofs { rows, nodes })?;
    let of_node = |&node: &i64| (1..=each as u32).map(move |direction| Dof { node, direction });
    matrices.dofs = Some(order.iter().flat_map(of_node).collect());
    Ok(())
}

/// The number of each row that takes part, and how many do: those held and those without any entry do not.
pub(super) fn places(
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

/// Takes rows that no stiffness joins to any mass for held: they move with nothing. How many there are.
pub(super) fn leave_out_massless(
    matrices: &Matrices,
    [stiffness, mass]: [&Triplets; 2],
    is_held: &mut [bool],
) -> usize {
    let (place, rows) = places(matrices, [stiffness, mass], is_held);
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
    // A structure without any mass has an error of its own.
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
