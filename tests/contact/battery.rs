//! Tests of normal contacts of many random joints. The tests certify each solution, and bound the median and the largest cost.
//!
//! Small grids are part of the normal tests. The following command runs the full size of 256 x 256 cells:
//! `cargo test --release --test main -- --ignored --nocapture contact::battery`

use fretwear::contact::normal::{self, NormalOptions, NormalProblem, Rotation};
use fretwear::contact::{Boundary, HalfSpace};
use fretwear::grid::{Grid, Patch};
use fretwear::surface::generate::{RandomSurface, Spectrum, random};

use super::PAIR;
use super::certificate::{Direct, certify};
use super::random::Random;

/// Bound of the gap error, as in `extremes`.
const GAP: f64 = 2e-6;

/// Gaussian heights with the given correlation lengths \[m\].
pub fn waves(
    grid: Grid,
    random_numbers: &mut Random,
    rq: f64,
    correlation_length: [f64; 2],
) -> Vec<f64> {
    let surface = RandomSurface {
        rq,
        spectrum: Spectrum::Gaussian { correlation_length },
        seed: random_numbers.uniform().to_bits(),
    };
    random(&Patch::full(grid), &surface)
        .expect("a surface of positive Rq")
        .heights
}

pub struct Joint {
    pub about: String,
    pub patch: Patch,
    height: Vec<f64>,
    load: f64,
    cap: Option<f64>,
    turning: bool,
    boundary: Boundary,
}

impl Joint {
    /// A random joint of about `cells` cells per side. Some joints are worn, have a pressure cap, a hole or free rotation, or are periodic.
    pub fn random(seed: u64, cells: f64) -> Joint {
        let mut random = Random::new(seed);
        let mut side = || (cells * random.between(0.8, 1.2)) as usize;
        let (nx, ny) = (side(), side());
        let grid = Grid::over([40e-3, 30e-3], [nx, ny]);
        let rq = random.decades(1e-8, 1e-4);
        // The correlation length ranges from one cell to a few hills per side.
        let length = random.decades(1.0, 0.2 * cells);
        let stretch = random.decades(0.5, 2.0);
        let mut height = waves(
            grid,
            &mut random,
            rq,
            [length * grid.dx * stretch, length * grid.dy],
        );
        let bored = random.chance(0.3);
        let worn = random.chance(0.4);
        if worn {
            // Wear removes the tops, down to a plateau on up to 90 % of the face.
            let mut sorted = height.clone();
            sorted.sort_by(f64::total_cmp);
            let level = sorted[(sorted.len() as f64 * random.between(0.1, 0.99)) as usize];
            height.iter_mut().for_each(|h| *h = h.min(level));
        }
        let patch = if bored {
            Patch::with_hole(grid, 11e-3)
        } else {
            Patch::full(grid)
        };
        let mean = random.decades(1e4, 1e9);
        // The pressure cap ranges from just above the mean pressure to a hundred times the mean pressure.
        let cap = random
            .chance(0.35)
            .then(|| mean * (1.0 + random.decades(1e-3, 100.0)));
        let periodic = random.chance(0.25);
        let turning = !periodic && cap.is_none() && random.chance(0.25);
        Joint {
            about: format!(
                "seed {seed}: {nx} x {ny}, Rq {rq:.2e} m, {length:.1} cells, {mean:.2e} Pa, cap {cap:?}, worn {worn}, \
                 bored {bored}, turning {turning}, periodic {periodic}"
            ),
            load: mean * patch.area(),
            patch,
            height,
            cap,
            turning,
            boundary: if periodic {
                Boundary::Periodic
            } else {
                Boundary::Free
            },
        }
    }

    /// Half spaces and pressure of the solved normal contact.
    pub fn pressed(&self) -> Result<(HalfSpace, Vec<f64>), String> {
        let mut half_space = HalfSpace::new(self.patch.grid, PAIR, self.boundary);
        let options = NormalOptions::default();
        let found = normal::solve(&mut half_space, &self.problem(), None, options)
            .map_err(|error| format!("{}: {error}", self.about))?;
        Ok((half_space, found.pressure))
    }

    fn problem(&self) -> NormalProblem<'_> {
        NormalProblem {
            pressure_cap: self.cap,
            rotation: if self.turning {
                Rotation::Free { moment: [0.0; 2] }
            } else {
                Rotation::FIXED
            },
            ..NormalProblem::new(&self.patch, &self.height, self.load)
        }
    }

    /// FFT pairs of a certified solve; `direct` selects direct sums for the certificate.
    fn pairs(&self, direct: bool) -> Result<f64, String> {
        let grid = self.patch.grid;
        let mut half_space = HalfSpace::new(grid, PAIR, self.boundary);
        let problem = self.problem();
        half_space.take_pairs();
        let found = normal::solve(&mut half_space, &problem, None, NormalOptions::default())
            .map_err(|error| format!("{}: {error}", self.about))?;
        let pairs = half_space.take_pairs();
        let displacement = if direct {
            Direct::new(grid, PAIR, self.boundary).displacement(&found.pressure)
        } else {
            let mut displacement = vec![0.0; grid.len()];
            half_space.normal(&found.pressure, &mut displacement);
            displacement
        };
        let own = half_space.self_compliance();
        certify(&problem, &found, &displacement, own, GAP)
            .map_err(|fault| format!("{}: {fault}", self.about))?;
        Ok(pairs)
    }
}

/// Solves and certifies all joints; returns the median and the largest number of FFT pairs.
fn battery(joints: u64, cells: f64, direct: bool) -> (f64, f64) {
    let mut faults = Vec::new();
    let mut pairs = Vec::new();
    for seed in 0..joints {
        let joint = Joint::random(seed, cells);
        match joint.pairs(direct) {
            Ok(count) => pairs.push((count, joint.about)),
            Err(fault) => faults.push(fault),
        }
    }
    assert!(
        faults.is_empty(),
        "{} joints:\n{}",
        faults.len(),
        faults.join("\n")
    );
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (median, worst) = (pairs[pairs.len() / 2].0, &pairs[pairs.len() - 1]);
    println!("{joints} joints of about {cells} cells per side: {median:.1} FFT pairs, median");
    for (count, about) in pairs.iter().rev().take(5) {
        println!("{count:7.1}  {about}");
    }
    (median, worst.0)
}

/// The bounds have a margin for different rounding. A solver that needs twice as many FFT pairs fails.
#[test]
fn small_joints() {
    let (median, worst) = battery(300, 30.0, true);
    assert!(median < 40.0, "{median}");
    assert!(worst < 200.0, "{worst}");
}

#[test]
#[ignore = "long: a minute"]
fn joints_of_full_size() {
    let (median, worst) = battery(200, 256.0, false);
    assert!(median < 70.0, "{median}");
    assert!(worst < 900.0, "{worst}");
}
