//! Cost of a contact solve: run `cargo bench`, or `cargo bench -- cold pair` for the cases with one of these words in their name.
//!
//! Published times of other programs refer to the joint of these cases: 40 x 30 mm, steel (198.4 GPa), 30 kN, correlation length 0.5 mm.
//! After the table of times by divan, a second table lists the FFT pairs of each solve and the ratio of its time to the time of its pairs.
//! A ratio of 1 means that the solver computes only FFT pairs.

use std::collections::BTreeMap;
use std::hint::black_box;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use divan::Bencher;
use fretwear::contact::normal::{self, NormalOptions, NormalProblem, NormalSolution};
use fretwear::contact::tangential::{self, Drive, TangentialOptions, TangentialProblem};
use fretwear::contact::{Boundary, Elastic, HalfSpace, Pair};
use fretwear::grid::{Grid, Patch};
use fretwear::surface::generate::{RandomSurface, Spectrum, random};

const SIZE: [f64; 2] = [40e-3, 30e-3];
const LOAD: f64 = 30e3;
const CAP: f64 = 600e6;
const FRICTION: f64 = 0.6;
const SEED: u64 = 1;

/// Force of the tangential cases relative to the force of full sliding.
const PARTIAL_SLIP: f64 = 0.6;

/// Number of surfaces of the battery.
const SURFACES: u64 = 20;

/// Deepest wear of the step before the warm solve \[m\].
const WORN: f64 = 1e-7;

const STEEL: Pair = Pair {
    lower: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
    upper: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
};

/// Samples of every case.
static MEASURED: Mutex<BTreeMap<String, Vec<Sample>>> = Mutex::new(BTreeMap::new());

fn main() {
    divan::main();
    let measured = MEASURED.lock().expect("no benchmark panicked");
    // Other processes on the machine only increase a time, so the ratio uses the fastest samples.
    let sorted = |name: &str| {
        let mut samples = measured.get(name)?.clone();
        samples.sort_by_key(|sample| sample.time);
        Some(samples)
    };
    println!(
        "\n{:34} {:>11} {:>11} {:>7} {:>7} {:>17}",
        "case", "fastest", "median", "pairs", "worst", "over pairs alone"
    );
    for name in measured.keys() {
        let Some(samples) = sorted(name) else {
            continue;
        };
        let [fastest, median] = [0, samples.len() / 2].map(|k| 1e3 * samples[k].time.as_secs_f64());
        let mut pairs: Vec<f64> = samples.iter().map(|sample| sample.pairs).collect();
        pairs.sort_by(f64::total_cmp);
        let (usual, worst) = (pairs[pairs.len() / 2], pairs[pairs.len() - 1]);
        // The last word of a name is its grid. The unit of the pairs is a scalar pair.
        let grid = name.rsplit(' ').next().unwrap_or_default();
        let ratio = sorted(&format!("pair {grid}")).map_or("-".to_owned(), |pair| {
            let alone = pair[0].time.as_secs_f64();
            let over = samples
                .iter()
                .map(|s| s.time.as_secs_f64() / (s.pairs * alone));
            format!("{:.2}", over.fold(f64::INFINITY, f64::min))
        });
        println!("{name:34} {fastest:8.2} ms {median:8.2} ms {usual:7.1} {worst:7.1} {ratio:>17}");
    }
}

/// Cost of one solve.
#[derive(Debug, Clone, Copy)]
struct Sample {
    time: Duration,
    pairs: f64,
}

/// Runs `work` once per sample and stores its cost.
fn measure(bencher: Bencher, name: &str, joint: &mut Joint, mut work: impl FnMut(&mut Joint)) {
    let mut samples = Vec::new();
    joint.half_space.take_pairs();
    bencher.bench_local(|| {
        let begin = Instant::now();
        work(joint);
        let time = begin.elapsed();
        let pairs = joint.half_space.take_pairs();
        samples.push(Sample { time, pairs });
    });
    // A case that the command line does not select has no samples.
    if !samples.is_empty() {
        MEASURED
            .lock()
            .expect("no benchmark panicked")
            .insert(name.to_owned(), samples);
    }
}

/// Rough joint under its load.
struct Joint {
    patch: Patch,
    height: Vec<f64>,
    half_space: HalfSpace,
}

impl Joint {
    fn new(cells: usize, rq: f64) -> Joint {
        let patch = Patch::full(Grid::over(SIZE, [cells, cells]));
        let height = heights(&patch, rq, SEED);
        let half_space = HalfSpace::new(patch.grid, STEEL, Boundary::Free);
        Joint {
            patch,
            height,
            half_space,
        }
    }

    fn press(&mut self, cap: Option<f64>, start: Option<&[f64]>) -> NormalSolution {
        let problem = NormalProblem {
            pressure_cap: cap,
            ..NormalProblem::new(&self.patch, &self.height, LOAD)
        };
        normal::solve(
            &mut self.half_space,
            &problem,
            start,
            NormalOptions::default(),
        )
        .expect("a converged contact")
    }

    /// Solves a step along one axis or both by `stroke` \[m\]; returns the force relative to the force of full sliding.
    fn slide(&mut self, limit: &[f64], axes: usize, stroke: f64) -> f64 {
        let problem = TangentialProblem {
            patch: &self.patch,
            limit,
            previous: None,
            // The direction is neither an axis nor a diagonal.
            drive: &[0.8, 0.6][..axes]
                .iter()
                .map(|part| Drive::Displacement(stroke * part))
                .collect(),
            rotation: None,
            offset: None,
        };
        let found = tangential::solve(
            &mut self.half_space,
            &problem,
            None,
            TangentialOptions::default(),
        )
        .expect("a converged step");
        found.force.iter().fold(0.0, |a: f64, b| a.hypot(*b)) / (FRICTION * LOAD)
    }
}

fn heights(patch: &Patch, rq: f64, seed: u64) -> Vec<f64> {
    let surface = RandomSurface {
        rq,
        spectrum: Spectrum::Gaussian {
            correlation_length: [0.5e-3, 0.5e-3],
        },
        seed,
    };
    random(patch, &surface).expect("a surface").heights
}

/// Zero-padded convolution: 512 x 512 points for 256 x 256 cells.
#[divan::bench(args = [256, 1024], max_time = 1)]
fn pair(bencher: Bencher, cells: usize) {
    let mut joint = Joint::new(cells, 5e-6);
    let mut displacement = vec![0.0; joint.height.len()];
    measure(bencher, &format!("pair {cells}"), &mut joint, |joint| {
        joint
            .half_space
            .normal(black_box(&joint.height), &mut displacement);
    });
}

/// Two input components and two output components.
#[divan::bench(args = [256], max_time = 1)]
fn vector_pair(bencher: Bencher, cells: usize) {
    let mut joint = Joint::new(cells, 5e-6);
    let mut displacement = [vec![0.0; joint.height.len()], vec![0.0; joint.height.len()]];
    let name = format!("vector pair {cells}");
    measure(bencher, &name, &mut joint, |joint| {
        let [x, y] = &mut displacement;
        joint
            .half_space
            .shear([black_box(&joint.height), &joint.height], [x, y]);
    });
}

#[divan::bench(args = [5.0, 0.5], sample_count = 7, sample_size = 1)]
fn cold(bencher: Bencher, rq: f64) {
    let mut joint = Joint::new(256, rq * 1e-6);
    measure(
        bencher,
        &format!("cold, Rq {rq} um, 256"),
        &mut joint,
        |joint| {
            black_box(joint.press(None, None));
        },
    );
}

#[divan::bench(sample_count = 7, sample_size = 1)]
fn capped(bencher: Bencher) {
    let mut joint = Joint::new(256, 5e-6);
    measure(bencher, "capped, Rq 5 um, 256", &mut joint, |joint| {
        black_box(joint.press(Some(CAP), None));
    });
}

/// Solve after wear in proportion to the pressure, with the pressure before the wear as the start.
#[divan::bench(args = [5.0, 0.5], sample_count = 7, sample_size = 1)]
fn warm(bencher: Bencher, rq: f64) {
    let mut joint = Joint::new(256, rq * 1e-6);
    let before = joint.press(None, None).pressure;
    let peak = before.iter().copied().fold(0.0, f64::max);
    for (h, p) in joint.height.iter_mut().zip(&before) {
        *h -= WORN * p / peak;
    }
    measure(
        bencher,
        &format!("warm, Rq {rq} um, 256"),
        &mut joint,
        |joint| {
            black_box(joint.press(None, Some(&before)));
        },
    );
}

#[divan::bench(sample_count = 2, sample_size = 1)]
fn large(bencher: Bencher) {
    let mut joint = Joint::new(1024, 5e-6);
    measure(bencher, "cold, Rq 5 um, 1024", &mut joint, |joint| {
        black_box(joint.press(None, None));
    });
}

/// Each sample has another surface; the values of Rq are evenly spaced (logarithmic) over the decade.
#[divan::bench(sample_count = SURFACES as u32, sample_size = 1)]
fn battery(bencher: Bencher) {
    let mut joint = Joint::new(256, 5e-6);
    let surfaces: Vec<Vec<f64>> = (0..SURFACES)
        .map(|k| {
            let rq = 0.5e-6 * 10f64.powf(k as f64 / (SURFACES - 1) as f64);
            heights(&joint.patch, rq, SEED + 1 + k)
        })
        .collect();
    let mut next = 0..;
    let name = "battery, Rq 0.5 to 5 um, 256";
    measure(bencher, name, &mut joint, |joint| {
        let next = next.next().unwrap_or_default() % surfaces.len();
        joint.height.clone_from(&surfaces[next]);
        black_box(joint.press(None, None));
    });
}

/// Step from rest to partial slip.
#[divan::bench(args = [(5.0, 1), (5.0, 2), (0.5, 1), (0.5, 2)], sample_count = 5, sample_size = 1)]
fn tangential_step(bencher: Bencher, (rq, axes): (f64, usize)) {
    let mut joint = Joint::new(256, rq * 1e-6);
    let pressure = joint.press(None, None).pressure;
    let limit: Vec<f64> = pressure.iter().map(|p| FRICTION * p).collect();
    // The force increases with the stroke up to the force of full sliding, so the bisection always converges.
    let (mut low, mut high) = (0.0, 1e-7);
    while joint.slide(&limit, axes, high) < PARTIAL_SLIP {
        (low, high) = (high, 2.0 * high);
    }
    for _ in 0..3 {
        let middle = 0.5 * (low + high);
        if joint.slide(&limit, axes, middle) < PARTIAL_SLIP {
            low = middle;
        } else {
            high = middle;
        }
    }
    let stroke = 0.5 * (low + high);
    let directions = if axes == 1 { "x" } else { "x and y" };
    let name = format!("tangential {directions}, Rq {rq} um, 256");
    measure(bencher, &name, &mut joint, |joint| {
        black_box(joint.slide(&limit, axes, stroke));
    });
}
