//! What can go wrong between the fine contact and the structure's elements.

/// A map, a spring or a preload that does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelUpdateError {
    /// Contact elements finer than the grid that is to give their parameters.
    #[error(
        "joint.grid has {cells} cells along {axis} for joint.elements = {elements}: the grid must be at least as fine as the contact elements, or some have no cell of their own"
    )]
    GridTooCoarse {
        /// `"x"` or `"y"`.
        axis: &'static str,
        /// Cells of the fine grid along it.
        cells: usize,
        /// Contact elements along it.
        elements: usize,
    },
    /// A joint without a contact element.
    #[error("the joint has no contact element; it must have at least one")]
    NoElements,
    /// A contact element that is not in the array of elements.
    #[error(
        "contact element {element} is cell ({}, {}) of joint.elements = [{}, {}]; cells are counted from 0",
        .cell[0], .cell[1], .counts[0], .counts[1]
    )]
    Outside {
        /// Number of the element, from 0.
        element: usize,
        /// Its cell.
        cell: [usize; 2],
        /// Cells of the array along x and y.
        counts: [usize; 2],
    },
    /// Two contact elements at one place.
    #[error(
        "contact elements {first} and {second} are both cell ({}, {}); a cell is one element",
        .cell[0], .cell[1]
    )]
    Twice {
        /// Number of the one, from 0.
        first: usize,
        /// Number of the other.
        second: usize,
        /// Their cell.
        cell: [usize; 2],
    },
    /// A joint that does not give way at all, for which there is no finite spring.
    #[error(
        "{name} of the joint is infinite: a full contact with contact.boundary = \"periodic\" does not give way; contact elements need \"free\""
    )]
    Rigid {
        /// `"kn"` or `"kt"`.
        name: &'static str,
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
    /// The faces have worn by more than the bolt was stretched.
    #[error(
        "the joint has come loose: the faces have come {settlement:.4e} m closer by the time they bear nothing, and contact.bolt_stiffness = {bolt_stiffness:.4e} N/m holds them with {load:.4e} N no further than {stretch:.4e} m"
    )]
    Loose {
        /// Preload N₀ of the unworn joint \[N\].
        load: f64,
        /// Stiffness of the bolt \[N/m\].
        bolt_stiffness: f64,
        /// δ(0) − δ₀ \[m\].
        settlement: f64,
        /// N₀/k_b \[m\].
        stretch: f64,
    },
    /// The preload was not found.
    #[error(
        "the preload did not converge: {load:.6e} N is uncertain by {error:.3e} N after {calls} contact solutions, {tolerance:.1e} N asked"
    )]
    NotConverged {
        /// Load reached \[N\].
        load: f64,
        /// Size of the next correction \[N\].
        error: f64,
        /// The size asked for \[N\].
        tolerance: f64,
        /// Contact solutions spent.
        calls: usize,
    },
}
