//! Real area of contact, corrected for the finite size of cells.
//!
//! A touching cell counts with its whole area. The sum of the touching cells therefore overestimates the area along the
//! rim of the contact. The correction of Yastrebov, Anciaux and Molinari (Tribol. Int. 114, 2017; arXiv 1701.02727)
//! subtracts (π − 1 + ln 2)/24 of a cell area for each edge at the rim. An edge at the rim separates a cell in contact
//! from a cell that is not in contact.

use std::f64::consts::{LN_2, PI};

use crate::grid::Patch;

/// Excess area per edge of the rim, as a fraction of a cell.
const EXCESS_PER_EDGE: f64 = (PI - 1.0 + LN_2) / 24.0;

/// Largest number n of cells in contact at which the estimated grid error is 2√n cells instead of √n cells.
const SMALL_CELL_COUNT: usize = 16;

/// Real area of contact of a patch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactArea {
    /// Area after subtraction of the excess along the rim \[m²\].
    pub corrected: f64,
    /// Estimated distance of the corrected area from its limit on an infinitely fine grid \[m²\]. The estimate is the
    /// larger of the correction and √n cells for n cells in contact (2√n for up to 16).
    pub grid_error: f64,
}

impl ContactArea {
    /// Computes the area of the kept cells where `touches` is true. Edges of the joint and of its holes are not part of
    /// the rim. `wraps` joins opposite sides of the grid of a periodic contact.
    pub fn new(patch: &Patch, wraps: bool, touches: impl Fn(usize) -> bool) -> ContactArea {
        let in_contact =
            (0..patch.grid.len()).filter(|&cell| patch.is_in_joint[cell] && touches(cell));
        let (mut cells, mut edges) = (0usize, 0);
        for cell in in_contact {
            cells += 1;
            let others = patch.neighbours(cell, wraps).into_iter().flatten();
            edges += others.filter(|&other| !touches(other)).count();
        }
        let cell_area = patch.grid.cell_area();
        let statistical_cells =
            (cells as f64).sqrt() * if cells <= SMALL_CELL_COUNT { 2.0 } else { 1.0 };
        let excess = EXCESS_PER_EDGE * edges as f64 * cell_area;
        ContactArea {
            corrected: cells as f64 * cell_area - excess,
            grid_error: excess.max(statistical_cells * cell_area),
        }
    }

    /// Returns the grid error divided by the corrected area. The function returns 0 if the corrected area is 0.
    pub fn relative_error(&self) -> f64 {
        match self.corrected > 0.0 {
            true => self.grid_error / self.corrected,
            false => 0.0,
        }
    }
}
