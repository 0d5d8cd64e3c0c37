//! How many cells wide the slipping rims of the contact spots are: a rim thinner than a cell has its energy from a few cells.
//!
//! Under a steady tangential force T the cells that slip are those that a normal load less by T/µ would leave out of contact (Jäger 1998; Ciavarella 1998),
//! on a grid as between smooth bodies. Their area over the rim of the contact is the width of the band.

use crate::grid::Patch;

/// Less than this is an error of the grid as other figures have it, which no bar holds.
const LEAST: f64 = 0.2;

/// Widths of the band in cells, and the relative error of the energy of one of several spots below them: their errors are independent. Of 96 energies of rough
/// faces, held against grids of 2 to 8 times as many cells along a side, 2 were off by more than this over the root of the number of spots and 1 %.
const OF_SEVERAL: [(f64, f64); 2] = [(0.4, 1.2), (1.5, 0.25)];
/// The same of one spot alone, whose cells may lie alike on all sides: against Mindlin's energy 416 round spots of 3 to 20 cells were off by up to 470 % below
/// 0.15 cells, and by 41 to 70 % up to 0.6.
const OF_ONE: [(f64, f64); 4] = [(0.15, 5.0), (0.4, 1.5), (0.8, 0.75), (1.5, 0.25)];
/// Spread from which on a contact is one spot.
const ALONE: f64 = 0.9;

/// The slipping rims of the contact spots of which a part sticks throughout the cycle. The energy of a spot that slips as a whole depends on no rim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SlipBand {
    /// Mean width, in cells.
    pub cells: f64,
    /// √Σe² over Σe of the energies of all spots: one over the root of their number, if they are alike.
    pub spread: f64,
}

/// Cells in contact that share an edge.
#[derive(Default)]
struct Spot {
    cells: usize,
    slipping: usize,
    /// Edges to kept cells that are not in contact.
    edges: usize,
    /// Energy per area of the cycle, summed over the cells \[J/m²\].
    energy: f64,
}

impl SlipBand {
    /// That of a contact of these pressures \[Pa\] and these energies of a cycle per area \[J/m²\], on the grid. Where no spot sticks in a part it is that of
    /// all spots, and there is no spread.
    pub fn of(patch: &Patch, wraps: bool, pressure: &[f64], energy: &[f64]) -> SlipBand {
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
            // Nothing slips on this grid, and nothing is known of what does on a finer one.
            true => 1.0,
            false => 0.0,
        };
        SlipBand {
            cells: slipping as f64 / edges.max(1) as f64,
            spread,
        }
    }

    /// Relative error of the energy of the cycle that the grid leaves; 0 where the band is resolved.
    pub fn relative_error(&self) -> f64 {
        let table = match self.spread > ALONE {
            true => &OF_ONE[..],
            false => &OF_SEVERAL[..],
        };
        let of_one = table.iter().find(|(below, _)| self.cells < *below);
        of_one
            .map(|(_, error)| error * self.spread)
            .filter(|error| *error > LEAST)
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
