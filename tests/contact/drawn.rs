//! The test draws random normal contacts over the admissible range of scenes, and bounds their FFT pairs.

use fretwear::contact::normal::{self, NormalOptions, NormalProblem, Rotation};
use fretwear::contact::{Boundary, HalfSpace};
use fretwear::grid::{Grid, Patch};
use fretwear::surface::generate::{RandomSurface, Spectrum, random};

use super::PAIR;
use super::random::Random;

/// Number of random contacts.
const COUNT: u64 = 400;

/// Largest number of FFT pairs per contact; the measured maximum is 84.
const MOST_PAIRS: f64 = 100.0;

/// Upper bounds of the median and of the ninth decile of the FFT pairs; the measured values are 19 and 39.
const MEDIAN: f64 = 23.0;
const NINE_TENTHS: f64 = 46.0;

/// Prime lengths, whose transforms are slow. A periodic contact cannot extend its grid to avoid such a length.
const PRIMES: [usize; 9] = [23, 29, 37, 53, 61, 83, 97, 127, 149];

/// Geometric mean of the side lengths of a cell \[m\].
const CELL: f64 = 5e-5;

struct Drawn {
    patch: Patch,
    height: Vec<f64>,
    boundary: Boundary,
    load: f64,
    rotation: Rotation,
    pressure_cap: Option<f64>,
}

impl Drawn {
    fn new(seed: u64) -> Drawn {
        let mut r = Random::new(1000 + seed);
        let mut cells = [0, 1].map(|_| r.decades(20.0, 160.0) as usize);
        if r.chance(0.25) {
            let axis = r.between(0.0, 2.0) as usize;
            cells[axis] = PRIMES[r.between(0.0, PRIMES.len() as f64) as usize];
        }
        // The aspect ratio of the cells is up to 20; a quarter of the contacts have exactly 20.
        let aspect = match (r.uniform(), r.decades(1.0 / 20.0, 20.0)) {
            (kind, any) if kind < 0.5 => any,
            (kind, _) if kind < 0.75 => 20.0,
            (_, any) => any.powf(0.1),
        };
        let sides = [CELL * aspect.sqrt(), CELL / aspect.sqrt()];
        let grid = Grid::over([0, 1].map(|k| sides[k] * cells[k] as f64), cells);
        let size = grid.size();
        let patch = match r.chance(0.3) {
            true => Patch::with_hole(grid, 0.4 * size[0].min(size[1])),
            false => Patch::full(grid),
        };
        let boundary = match r.chance(0.5) {
            true => Boundary::Periodic,
            false => Boundary::Free,
        };
        let rq = r.decades(1e-8, 1e-5);
        let length = [0, 1].map(|k| {
            let least = 2.5 * sides[k];
            r.decades(least, (0.5 * size[k]).max(1.2 * least))
        });
        let surface = RandomSurface {
            rq,
            spectrum: Spectrum::Gaussian {
                correlation_length: length,
            },
            seed,
        };
        let height = random(&patch, &surface).expect("a surface").heights;
        // The load ranges from a few cells in contact to full contact.
        let flattens =
            0.5 * PAIR.effective_modulus() * rq * (1.0 / length[0]).hypot(1.0 / length[1]);
        let mean = flattens * r.decades(3e-4, 10.0);
        // Half of the contacts have a pressure cap, which up to 99.98 % of the cells reach.
        let pressure_cap = match r.uniform() {
            kind if kind < 0.5 => None,
            kind if kind < 0.75 => Some(mean * r.decades(1.001, 30.0)),
            _ => Some(mean / (1.0 - r.decades(2e-4, 0.3))),
        };
        let load = mean * patch.area();
        let room = pressure_cap.map_or(1.0, |cap| 0.5 * (1.0 - mean / cap));
        let rotation = match r.chance(0.35) {
            true => Rotation::Free {
                // If nearly all cells are at the cap, the contact can hardly carry a moment.
                moment: [0, 1].map(|k| 0.1 * room * load * size[1 - k] * r.between(-1.0, 1.0)),
            },
            false => Rotation::FIXED,
        };
        Drawn {
            patch,
            height,
            boundary,
            load,
            rotation,
            pressure_cap,
        }
    }

    /// FFT pairs, and shares of the cells in contact and at the cap.
    fn solve(&self) -> (f64, [f64; 2]) {
        let mut half_space = HalfSpace::new(self.patch.grid, PAIR, self.boundary);
        let problem = NormalProblem {
            rotation: self.rotation,
            pressure_cap: self.pressure_cap,
            ..NormalProblem::new(&self.patch, &self.height, self.load)
        };
        let found = normal::solve(&mut half_space, &problem, None, NormalOptions::default());
        let pressure = found.expect("a converged contact").pressure;
        let share = |of: &dyn Fn(f64) -> bool| {
            let count = pressure.iter().filter(|p| of(**p)).count();
            count as f64 / self.patch.cells() as f64
        };
        let cap = self.pressure_cap.unwrap_or(f64::INFINITY);
        (
            half_space.take_pairs(),
            [share(&|p| p > 0.0), share(&|p| p >= cap)],
        )
    }
}

#[test]
fn no_contact_takes_more_than_a_hundred_pairs() {
    let (mut pairs, mut shares) = (Vec::new(), Vec::new());
    for seed in 0..COUNT {
        let drawn = Drawn::new(seed);
        let (took, share) = drawn.solve();
        let Grid { nx, ny, dx, dy } = drawn.patch.grid;
        assert!(
            took <= MOST_PAIRS,
            "seed {seed}, {nx} x {ny} cells of {:.2}, {:?}, {:?}, contact and cap {share:?}: {took} FFT pairs",
            dx / dy,
            drawn.boundary,
            drawn.rotation,
        );
        pairs.push(took);
        shares.push(share);
    }
    // The random contacts include nearly open contacts, full contacts and contacts with nearly all cells at the cap.
    let of = |k: usize| shares.iter().map(move |share| share[k]);
    assert!(of(0).fold(1.0, f64::min) < 0.003 && of(0).fold(0.0, f64::max) == 1.0);
    assert!(of(1).fold(0.0, f64::max) > 0.99);
    pairs.sort_by(f64::total_cmp);
    let at = |part: f64| pairs[(part * (pairs.len() - 1) as f64) as usize];
    println!(
        "FFT pairs: median {}, ninth decile {}, maximum {}",
        at(0.5),
        at(0.9),
        at(1.0)
    );
    assert!(
        at(0.5) <= MEDIAN && at(0.9) <= NINE_TENTHS,
        "{} and {}",
        at(0.5),
        at(0.9)
    );
}
