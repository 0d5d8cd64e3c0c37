//! Errors of a contact solve, and checks of its input fields.

use crate::grid::Grid;

/// Error of a contact solve without a trustworthy result.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ContactError {
    /// The solver has reached the limit of iterations without convergence.
    #[error(
        "the {problem} contact did not converge: error {error:.3e} after {iterations} iterations; the tolerance is {tolerance:.1e}"
    )]
    NotConverged {
        /// `"normal"`, `"tangential"`, `"coupled"` or `"stiffness"`.
        problem: &'static str,
        /// Iterations used.
        iterations: usize,
        /// Error reached, in the solver's own measure.
        error: f64,
        /// Tolerance of the error.
        tolerance: f64,
    },
    /// The load exceeds what all kept cells carry at the pressure cap.
    #[error(
        "the load of {load:.6e} N exceeds the capacity of {capacity:.6e} N: {cells} cells of {cell_area:.4e} m² at the pressure cap of {cap:.4e} Pa"
    )]
    CapExceeded {
        /// Requested load \[N\].
        load: f64,
        /// Pressure cap times area \[N\].
        capacity: f64,
        /// Number of kept cells.
        cells: usize,
        /// Area of one cell \[m²\].
        cell_area: f64,
        /// Pressure cap \[Pa\].
        cap: f64,
    },
    /// No pressure with the given load has the requested moments.
    #[error(
        "the moments of {moment:?} N m about x and y cannot be carried by a load of {load:.6e} N: its resultant would lie outside the joint"
    )]
    MomentNotCarried {
        /// Moments M_x and M_y about the grid's centre \[N m\].
        moment: [f64; 2],
        /// Load \[N\].
        load: f64,
    },
    /// A force or moment exceeds what friction carries.
    #[error(
        "the {name} of {asked:.6e} exceeds friction: the joint carries less than {limit:.6e} (N or N·m) in this proportion to the other given forces and moments"
    )]
    FrictionExceeded {
        /// Name of the force or moment.
        name: &'static str,
        /// Requested value \[N or N·m\].
        asked: f64,
        /// Largest magnitude that friction carries \[N or N·m\].
        limit: f64,
    },
    /// A value is not a finite number.
    #[error("the {field} of cell ({i}, {j}) is {value}; it must be a finite number")]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// Index of the cell along x.
        i: usize,
        /// Index of the cell along y.
        j: usize,
        /// Rejected value.
        value: f64,
    },
    /// A given number is outside the range that the solver accepts.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// Name of the number.
        name: &'static str,
        /// Rejected value.
        value: f64,
        /// Accepted values.
        expected: &'static str,
    },
    /// The length of a field differs from the number of cells of the grid.
    #[error("the {field} has {found} values; the grid has {expected} cells")]
    Length {
        /// Name of the field.
        field: &'static str,
        /// Length of the field.
        found: usize,
        /// Number of cells of the grid.
        expected: usize,
    },
}

/// Returns [`ContactError::Length`] if a field does not have one value per cell.
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

/// Returns [`ContactError::Length`] if the number of values differs from the number of cells. Returns
/// [`ContactError::NotFinite`] for the first cell whose value is not finite. `counts` selects the cells to check.
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
