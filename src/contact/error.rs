//! What can go wrong in a contact solve, and the checks of its fields.

use crate::grid::Grid;

/// A contact solve that has no trustworthy result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// The solver used up its iterations.
    #[error(
        "the {problem} contact did not converge: error {error:.3e} after {iterations} iterations, {tolerance:.1e} asked"
    )]
    NotConverged {
        /// `"normal"`, `"tangential"`, `"coupled"` or `"stiffness"`.
        problem: &'static str,
        /// Iterations spent.
        iterations: usize,
        /// The error reached, in the measure of the solver.
        error: f64,
        /// The error asked for.
        tolerance: f64,
    },
    /// More load than the pressure cap can carry on every kept cell.
    #[error(
        "the load of {load:.6e} N cannot be carried: {capacity:.6e} N is all that {cells} cells of {cell_area:.4e} m² bear at the pressure cap of {cap:.4e} Pa"
    )]
    CapExceeded {
        /// The load asked for \[N\].
        load: f64,
        /// Cap times area \[N\].
        capacity: f64,
        /// Kept cells.
        cells: usize,
        /// Area of a cell \[m²\].
        cell_area: f64,
        /// The cap \[Pa\].
        cap: f64,
    },
    /// Moments that no pressure of the given load has.
    #[error(
        "the moments of {moment:?} N m about x and y cannot be carried by a load of {load:.6e} N: its resultant would lie outside the joint"
    )]
    MomentNotCarried {
        /// M_x and M_y about the grid's centre \[N m\].
        moment: [f64; 2],
        /// The load \[N\].
        load: f64,
    },
    /// A force or moment beyond what friction carries.
    #[error(
        "the {name} of {asked:.6e} cannot be carried: friction bears less than {limit:.6e} (N or N·m) of it in this proportion to the other given ones"
    )]
    FrictionExceeded {
        /// Which resultant.
        name: &'static str,
        /// What was asked for \[N or N·m\].
        asked: f64,
        /// The magnitude that friction carries at most \[N or N·m\].
        limit: f64,
    },
    /// A value that is not a finite number.
    #[error("the {field} of cell ({i}, {j}) is {value}; it must be a finite number")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// Cell along x.
        i: usize,
        /// Cell along y.
        j: usize,
        /// The value found.
        value: f64,
    },
    /// A number out of its range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// What the number is.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A field whose length is not that of the grid.
    #[error("the {field} has {found} values; the grid has {expected} cells")]
    Length {
        /// Name of the field.
        field: &'static str,
        /// Its length.
        found: usize,
        /// Cells of the grid.
        expected: usize,
    },
}

/// [`ContactError::Length`] where a field has not a value a cell.
pub(super) fn check_length(
    field: &'static str,
    found: usize,
    expected: usize,
) -> Result<(), ContactError> {
    if found == expected {
        Ok(())
    } else {
        Err(ContactError::Length {
            field,
            found,
            expected,
        })
    }
}

/// [`ContactError::Length`], or [`ContactError::NotFinite`] for the first of the cells looked at that is not a number.
pub(super) fn check_field(
    field: &'static str,
    values: &[f64],
    grid: Grid,
    counts: impl Fn(usize) -> bool,
) -> Result<(), ContactError> {
    check_length(field, values.len(), grid.len())?;
    match (0..values.len()).find(|&c| counts(c) && !values[c].is_finite()) {
        None => Ok(()),
        Some(index) => {
            let (i, j) = grid.cell(index);
            Err(ContactError::NotFinite {
                field,
                i,
                j,
                value: values[index],
            })
        }
    }
}
