use std::f64::consts::PI;

use fretwear::contact::normal::{self, NormalOptions, NormalProblem};
use fretwear::contact::{Boundary, HalfSpace};
use fretwear::grid::{Grid, Patch};
use fretwear::reference::{Westergaard, elastic};

use super::{PAIR, relative_l2};

/// Direction of the wave. Two waves fit on the grid, and their crests lie outside its centre.
#[derive(Clone, Copy, Debug)]
enum Along {
    X,
    Y,
}

fn wave(share: f64) -> Westergaard {
    let mut wave = Westergaard {
        wavelength: 1.3e-3,
        amplitude: 0.8e-6,
        mean_pressure: 0.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    wave.mean_pressure = share * wave.full_contact_pressure();
    wave
}

fn compare(
    share: f64,
    along: Along,
    check: impl Fn(&Westergaard, &normal::NormalSolution, Vec<f64>, Vec<f64>),
) {
    let wave = wave(share);
    let grid = match along {
        Along::X => Grid::over([2.0 * wave.wavelength, 0.4e-3], [254, 6]),
        Along::Y => Grid::over([0.4e-3, 2.0 * wave.wavelength], [5, 254]),
    };
    let patch = Patch::full(grid);
    let places: Vec<f64> = (0..grid.len())
        .map(|index| {
            let (i, j) = grid.cell(index);
            let (x, y) = grid.centre(i, j);
            0.37e-4 + if matches!(along, Along::X) { x } else { y }
        })
        .collect();
    let height: Vec<f64> = places
        .iter()
        .map(|x| wave.amplitude * ((2.0 * PI * x / wave.wavelength).cos() - 1.0))
        .collect();
    let load = wave.mean_pressure * patch.area();
    let problem = NormalProblem::new(&patch, &height, load);
    let mut half_space = HalfSpace::new(grid, PAIR, Boundary::Periodic);
    let options = NormalOptions {
        tolerance: 1e-8,
        ..NormalOptions::default()
    };
    let solution = normal::solve(&mut half_space, &problem, None, options).unwrap();
    let pressure = places.iter().map(|x| wave.pressure(*x)).collect();
    let gap = places.iter().map(|x| wave.gap(*x)).collect();
    check(&wave, &solution, pressure, gap);
}

#[test]
fn partial_contact_is_westergaards() {
    for along in [Along::X, Along::Y] {
        for share in [0.05, 0.3, 0.6, 0.9] {
            compare(share, along, |wave, solution, pressure, gap| {
                let cells = pressure.len() as f64;
                let touching =
                    solution.pressure.iter().filter(|p| **p > 0.0).count() as f64 / cells;
                // The grid resolves each of the four edges to one of 254 cells.
                assert!(
                    (touching - wave.area_fraction()).abs() < 4.0 / 254.0,
                    "{share}: {touching}"
                );
                // The pressure error is of first order at the edges, and the gap error is of second order. A wave has 127 cells, and the
                // narrowest strip has 18 cells.
                let error = relative_l2(&solution.pressure, &pressure);
                assert!(error < 2.5e-2, "{along:?} {share}: pressure {error:e}");
                let worst = solution
                    .gap
                    .iter()
                    .zip(&gap)
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(
                    worst < 2e-3 * wave.amplitude,
                    "{along:?} {share}: gap {worst:e}"
                );
                let mean = solution.gap.iter().sum::<f64>() / cells;
                assert!(
                    (mean - wave.mean_gap()).abs() < 1e-3 * wave.amplitude,
                    "{along:?} {share}: {mean:e}"
                );
            });
        }
    }
}

#[test]
fn full_contact_is_exact() {
    // The periodic kernel is exact for a single harmonic, so only the tolerance of the solver remains.
    for along in [Along::X, Along::Y] {
        for share in [1.02, 1.7] {
            compare(share, along, |wave, solution, pressure, _| {
                assert!(relative_l2(&solution.pressure, &pressure) < 1e-6);
                assert!(solution.gap.iter().all(|g| g.abs() < 1e-6 * wave.amplitude));
            });
        }
    }
}
