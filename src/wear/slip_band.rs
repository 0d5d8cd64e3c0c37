//! Width of the slip bands at the rims of the contact spots, in cells. A band thinner than a cell takes its
//! energy from a few cells.
//!
//! Under a steady tangential force T, the cells that slip are the cells that lose contact if the normal load is reduced
//! by T/µ (Jäger 1998; Ciavarella 1998). The area of the slipping cells over the rim of the contact is the width of the
//! band.

use crate::grid::Patch;

/// Smallest relative error that is reported. A smaller one is an ordinary grid error, which no error bar
/// includes.
const LEAST_REPORTED_ERROR: f64 = 0.2;

/// Relative error of the energy of one contact spot of several, for slip bands narrower than each width in cells. The
/// errors of the spots are independent. A test compared the energies of 96 rough faces on a grid and on a finer grid.
/// The finer grids had 2 to 8 times as many cells along a side. For n spots, the bound of the difference was the listed
/// error divided by √n, plus 1 %. Two of the 96 energies exceeded the bound.
const ERRORS_OF_SEVERAL_SPOTS: [(f64, f64); 2] = [(0.4, 1.2), (1.5, 0.25)];
/// Relative error of the energy of a single contact spot, whose cells may lie alike on all sides. The energies of 416
/// round spots of 3 to 20 cells were compared with Mindlin's energy. For bands below 0.15 cells, the errors of the
/// energies were up to 470 %. For bands up to 0.6 cells, the errors of the energies were 41 to 70 %.
const ERRORS_OF_ONE_SPOT: [(f64, f64); 4] = [(0.15, 5.0), (0.4, 1.5), (0.8, 0.75), (1.5, 0.25)];
/// Smallest spread at which the contact counts as one spot.
const SINGLE_SPOT_SPREAD: f64 = 0.9;

/// Slip bands of the contact spots that partly stick throughout the cycle. The energy of a spot that slips as a whole
/// does not depend on the width of a slip band.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipBand {
    /// Mean width, in cells.
    pub cells: f64,
    /// Ratio √Σe² / Σe of the energies e of all spots. For n equal spots, the ratio is 1/√n.
    pub spread: f64,
}

/// Cells in contact that share edges.
#[derive(Default)]
struct Spot {
    cells: usize,
    slipping: usize,
    /// Edges to kept cells that are not in contact.
    edges: usize,
    /// Energy per area and cycle, summed over the cells \[J/m²\].
    energy: f64,
}

impl SlipBand {
    /// Measures the slip band from the pressures \[Pa\] and the energies per area and cycle \[J/m²\] on the
    /// grid. If no spot partly sticks, all spots count and the spread is 0.
    pub fn measure(patch: &Patch, wraps: bool, pressure: &[f64], energy: &[f64]) -> SlipBand {
        let spots = spots(patch, wraps, pressure, energy);
        let sticks = |spot: &Spot| spot.slipping < spot.cells;
        let is_partial = spots.iter().any(sticks);
        let counted = || {
            let all = spots.iter();
            all.filter(|spot| sticks(spot) || !is_partial)
        };
        let edges: usize = counted().map(|spot| spot.edges).sum();
        let slipping: usize = counted().map(|spot| spot.slipping).sum();
        let whole: f64 = spots.iter().map(|spot| spot.energy).sum();
        let squares: f64 = spots.iter().map(|spot| spot.energy.powi(2)).sum();
        let spread = match is_partial && edges > 0 {
            true if squares > 0.0 => squares.sqrt() / whole,
            // No cell slips on the current grid, so that the slip on a finer grid is unknown.
            true => 1.0,
            false => 0.0,
        };
        SlipBand {
            cells: slipping as f64 / edges.max(1) as f64,
            spread,
        }
    }

    /// Returns the relative error of the energy per cycle due to the grid; 0 if the band is resolved.
    pub fn relative_error(&self) -> f64 {
        let table = match self.spread > SINGLE_SPOT_SPREAD {
            true => &ERRORS_OF_ONE_SPOT[..],
            false => &ERRORS_OF_SEVERAL_SPOTS[..],
        };
        let entry = table.iter().find(|(below, _)| self.cells < *below);
        entry
            .map(|(_, error)| error * self.spread)
            .filter(|error| *error > LEAST_REPORTED_ERROR)
            .unwrap_or(0.0)
    }
}

fn spots(patch: &Patch, wraps: bool, pressure: &[f64], energy: &[f64]) -> Vec<Spot> {
    let touches = |cell: usize| pressure[cell] > 0.0;
    let mut is_counted = vec![false; patch.grid.len()];
    let mut spots = Vec::new();
    let mut next = Vec::new();
    for first in (0..patch.grid.len()).filter(|&cell| touches(cell)) {
        if std::mem::replace(&mut is_counted[first], true) {
            continue;
        }
        let mut spot = Spot::default();
        next.push(first);
        while let Some(cell) = next.pop() {
            spot.cells += 1;
            spot.slipping += usize::from(energy[cell] > 0.0);
            spot.energy += energy[cell];
            for other in patch.neighbours(cell, wraps).into_iter().flatten() {
                if !touches(other) {
                    spot.edges += 1;
                } else if !std::mem::replace(&mut is_counted[other], true) {
                    next.push(other);
                }
            }
        }
        spots.push(spot);
    }
    spots
}
