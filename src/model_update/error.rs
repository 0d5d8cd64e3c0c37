//! Errors of the exchange between the fine contact and the structure's elements.

/// Error for a map, a spring or a preload that does not exist.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ModelUpdateError {
    /// The contact elements are finer than the grid that provides their parameters.
    #[error(
        "joint.grid has {cells} cells along {axis} for joint.elements = {elements}: the grid must be at least as fine as the contact elements, or some have no cell of their own"
    )]
    GridTooCoarse {
        /// `"x"` or `"y"`.
        axis: &'static str,
        /// Number of cells of the fine grid along `axis`.
        cells: usize,
        /// Number of contact elements along `axis`.
        elements: usize,
    },
    /// The joint has no contact element.
    #[error("the joint has no contact element; it must have at least one")]
    NoElements,
    /// A contact element lies outside the array of elements.
    #[error(
        "contact element {element} is cell ({}, {}) of joint.elements = [{}, {}]; cells are counted from 0",
        .cell[0], .cell[1], .counts[0], .counts[1]
    )]
    Outside {
        /// Number of the element, from 0.
        element: usize,
        /// Cell of the element.
        cell: [usize; 2],
        /// Cells of the array along x and y.
        counts: [usize; 2],
    },
    /// Two contact elements share a cell.
    #[error(
        "contact elements {first} and {second} are both cell ({}, {}); a cell may hold only one element",
        .cell[0], .cell[1]
    )]
    DuplicateCell {
        /// Number of the first element, from 0.
        first: usize,
        /// Number of the second element.
        second: usize,
        /// Shared cell.
        cell: [usize; 2],
    },
    /// The joint is rigid, so no finite spring represents it.
    #[error(
        "{name} of the joint is infinite: a full contact with contact.boundary = \"periodic\" is rigid; contact elements need contact.boundary = \"free\""
    )]
    Rigid {
        /// `"kn"` or `"kt"`.
        name: &'static str,
    },
    /// The value of the parameter `name` is outside the permitted range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// Name of the number.
        name: &'static str,
        /// Rejected value.
        value: f64,
        /// Accepted values.
        expected: &'static str,
    },
    /// The faces have worn by more than the stretch of the bolt.
    #[error(
        "the joint has come loose: the unloaded worn faces are {settlement:.4e} m closer than the unworn faces under preload, but the bolt (contact.bolt_stiffness = {bolt_stiffness:.4e} N/m, preload {load:.4e} N) was stretched by only {stretch:.4e} m"
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
    /// The search for the preload did not converge.
    #[error(
        "the preload did not converge: {load:.6e} N is uncertain by {error:.3e} N after {calls} contact solutions; the tolerance is {tolerance:.1e} N"
    )]
    NotConverged {
        /// Load reached \[N\].
        load: f64,
        /// Size of the next correction \[N\].
        error: f64,
        /// Tolerance of that size \[N\].
        tolerance: f64,
        /// Number of contact solutions.
        calls: usize,
    },
}
