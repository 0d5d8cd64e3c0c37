//! Tests of the corrected contact area and its grid error, by Hertz's solution and by fine grids.

use std::f64::consts::PI;

use fretwear::contact::area::ContactArea;
use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::{Boundary, HalfSpace};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::{Hertz, elastic};
use fretwear::surface::generate::{self, RandomSurface, Spectrum};
use fretwear::wear::slip_band::SlipBand;

use super::{PAIR, half_space, paraboloid};
use crate::support::Chance;

/// Excess area per edge of a contact spot, relative to a cell, as published.
const OF_EDGE: f64 = (PI - 1.0 + std::f64::consts::LN_2) / 24.0;

fn patch() -> Patch {
    Patch::full(Grid::over([3e-3, 1e-3], [6, 5]))
}

#[test]
fn edges_of_the_joint_and_of_its_holes_are_no_rim() {
    let mut patch = patch();
    let cell = patch.grid.cell_area();
    // Two cells in a corner have three edges to other cells of the joint. Edges on the border of the joint do not count.
    let corner = |cell: usize| cell == 0 || cell == 1;
    let area = ContactArea::new(&patch, false, corner);
    assert!((area.corrected / cell - (2.0 - 3.0 * OF_EDGE)).abs() < 1e-12);
    assert!((area.grid_error / cell - 2.0 * 2f64.sqrt()).abs() < 1e-12);
    // In a periodic contact, the same cells have three more edges.
    let wrapped = ContactArea::new(&patch, true, corner);
    assert!((wrapped.corrected / cell - (2.0 - 6.0 * OF_EDGE)).abs() < 1e-12);
    // An edge to a cell in the hole does not count.
    patch.is_in_joint[2] = false;
    let holed = ContactArea::new(&patch, false, corner);
    assert!((holed.corrected / cell - (2.0 - 2.0 * OF_EDGE)).abs() < 1e-12);
    // In full contact, the corrected area equals the area of the joint.
    let whole = ContactArea::new(&patch, true, |_| true);
    assert!((whole.corrected - patch.area()).abs() < 1e-12 * cell);
    assert_eq!(
        ContactArea::new(&patch, true, |_| false).relative_error(),
        0.0
    );
}

#[test]
fn a_sphere_of_few_cells_is_within_its_grid_error() {
    let exact = Hertz {
        radius: 0.05,
        load: 320.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    let a = exact.contact_radius();
    let mut chance = Chance::new(7);
    for cells in [1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0] {
        for _ in 0..4 {
            let skew = 1.0 + chance.next();
            let shape = [1.4 * cells, 1.4 * cells * skew].map(|half| 2 * half.ceil() as usize + 1);
            let size = [
                shape[0] as f64 / cells * a,
                shape[1] as f64 / (cells * skew) * a,
            ];
            let patch = Patch::full(Grid::over(size, shape));
            let off = [0, 1].map(|_| (chance.next() - 0.5) * 0.9);
            let apex = (off[0] * patch.grid.dx, off[1] * patch.grid.dy);
            let height = paraboloid(patch.grid, exact.radius, apex);
            let problem = NormalProblem::new(&patch, &height, exact.load);
            let options = NormalOptions::default();
            let found = normal::solve(&mut half_space(&patch), &problem, None, options).unwrap();
            let area = ContactArea::new(&patch, false, |cell| found.pressure[cell] > 0.0);
            let off = area.corrected - PI * a * a;
            let said = format!("{cells} x {skew}: {off:e} of {:e}", PI * a * a);
            assert!(off.abs() <= area.grid_error, "{said}, {area:?}");
            if cells >= 8.0 {
                assert!(off.abs() < 0.03 * PI * a * a, "{said}");
            }
        }
    }
}

/// Contact area of a rough face on a grid with `cells` cells per shortest wave along x and y: area of the cells in contact, and corrected
/// area.
fn rough(hurst: f64, cells: [usize; 2], load: f64) -> (f64, ContactArea) {
    let shortest = 31;
    let patch = Patch::full(Grid::over(
        [4e-3, 3.9e-3],
        [shortest * cells[0], shortest * cells[1]],
    ));
    let surface = RandomSurface {
        rq: 0.5e-6,
        spectrum: Spectrum::SelfAffine {
            hurst,
            rolloff_wavelength: 4e-3 / 16.0,
            cutoff_wavelength: Some(4e-3 / shortest as f64),
        },
        seed: 3,
    };
    let height = generate::random(&patch, &surface).unwrap().heights;
    let mut half_space = HalfSpace::new(patch.grid, PAIR, Boundary::Periodic);
    let problem = NormalProblem::new(&patch, &height, load);
    let options = NormalOptions::default();
    let found = normal::solve(&mut half_space, &problem, None, options).unwrap();
    let count = found.pressure.iter().filter(|p| **p > 0.0).count();
    let area = ContactArea::new(&patch, true, |cell| found.pressure[cell] > 0.0);
    (count as f64 * patch.grid.cell_area(), area)
}

/// Between 1 and 30 % of the face is in contact.
#[test]
fn a_rough_face_of_few_cells_is_within_its_grid_error() {
    for hurst in [0.3, 0.8] {
        for load in [60.0, 500.0, 2000.0] {
            let (_, limit) = rough(hurst, [16, 16], load);
            let limit = limit.corrected;
            for cells in [[2, 2], [2, 4], [4, 4], [4, 8], [8, 8]] {
                let (plain, found) = rough(hurst, cells, load);
                let off = found.corrected - limit;
                let said = format!("H {hurst}, {load} N, {cells:?}: {found:?}, limit {limit:e}");
                assert!(off.abs() <= found.grid_error, "{said}");
                assert!(off.abs() < 0.3 * (plain - limit), "{said}");
                // A contact area of 1 % consists of about 20 contact spots.
                let least = if load < 100.0 { 0.06 } else { 0.03 };
                if cells[0] >= 4 {
                    assert!(off.abs() < least * limit, "{said}");
                }
            }
        }
    }
}

#[test]
fn a_slip_band_is_counted_spot_by_spot() {
    let patch = patch();
    // The contact has a spot of 2 x 3 cells with two slipping cells, and one spot of a single slipping cell.
    let mut pressure = vec![0.0; patch.grid.len()];
    let mut energy = pressure.clone();
    for (i, j) in [(1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2), (5, 4)] {
        pressure[patch.grid.index(i, j)] = 1e6;
    }
    for ((i, j), dissipated) in [((1, 2), 1.0), ((2, 2), 2.0), ((5, 4), 4.0)] {
        energy[patch.grid.index(i, j)] = dissipated;
    }
    let band = SlipBand::measure(&patch, false, &pressure, &energy);
    // The rim has 8 edges, without the edges on the border of the joint.
    assert!((band.cells - 2.0 / 8.0).abs() < 1e-12, "{band:?}");
    assert!((band.spread - 5.0 / 7.0).abs() < 1e-12, "{band:?}");
    assert!((band.relative_error() - 1.2 * 5.0 / 7.0).abs() < 1e-12);
    // If every spot slips completely, the error is zero.
    let all: Vec<f64> = pressure.iter().map(|p| p * 1e-6).collect();
    let whole = SlipBand::measure(&patch, false, &pressure, &all);
    assert_eq!((whole.cells, whole.relative_error()), (7.0 / 10.0, 0.0));
}
