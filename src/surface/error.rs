//! What can be wrong with a surface that was asked for, or with heights that were given.

/// A surface that cannot be generated or described.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A number out of its range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// What the number is, as the scene calls it.
        name: &'static str,
        /// The value found.
        value: f64,
        /// What would be right.
        expected: &'static str,
    },
    /// A height that is not a finite number.
    #[error("the height of cell ({i}, {j}) is {value}; it must be a finite number")]
    NotFinite {
        /// Cell along x.
        i: usize,
        /// Cell along y.
        j: usize,
        /// The value found.
        value: f64,
    },
    /// A field whose length is not that of the grid.
    #[error("there are {found} heights; the grid has {expected} cells")]
    Length {
        /// Heights given.
        found: usize,
        /// Cells of the grid.
        expected: usize,
    },
    /// Too few cells to speak of a surface.
    #[error("{kept} cells belong to the joint; {purpose} needs at least {needed}")]
    TooFewCells {
        /// Cells kept.
        kept: usize,
        /// Cells needed.
        needed: usize,
        /// What they are needed for.
        purpose: &'static str,
    },
    /// No wave of the wanted surface fits the joint and is resolved by its grid.
    #[error(
        "no wave of the surface is both resolved by the grid and shorter than the joint: {nx} x {ny} cells of {dx:.4e} x {dy:.4e} m; make the correlation length (or the wavelengths) smaller than the joint and larger than two cells"
    )]
    NoPower {
        /// Cells along x.
        nx: usize,
        /// Cells along y.
        ny: usize,
        /// Cell width along x \[m\].
        dx: f64,
        /// Cell width along y \[m\].
        dy: f64,
    },
}
