//! Errors of a requested surface or of its heights.

/// A surface that cannot be generated or described.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SurfaceError {
    /// A number of the scene is out of the valid range.
    #[error("{name} is {value:e}; it must be {expected}")]
    OutOfRange {
        /// Name of the number, as in the scene.
        name: &'static str,
        /// Value found.
        value: f64,
        /// Valid range.
        expected: &'static str,
    },
    /// A height is not a finite number.
    #[error("the height of cell ({i}, {j}) is {value}; it must be a finite number")]
    NotFinite {
        /// Cell along x.
        i: usize,
        /// Cell along y.
        j: usize,
        /// Value found.
        value: f64,
    },
    /// The length of a field differs from the grid's.
    #[error("there are {found} heights; the grid has {expected} cells")]
    Length {
        /// Number of heights.
        found: usize,
        /// Number of cells of the grid.
        expected: usize,
    },
    /// The joint has too few cells for a surface.
    #[error("{kept} cells belong to the joint; {purpose} needs at least {needed}")]
    TooFewCells {
        /// Cells kept.
        kept: usize,
        /// Cells needed.
        needed: usize,
        /// Purpose that needs them.
        purpose: &'static str,
    },
    /// No wave of the requested surface fits the joint and is resolved by its grid.
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
