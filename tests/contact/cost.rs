//! The tests compare the FFT pairs of each solve with an expected number. A slower solver fails, and a faster solver needs new expected
//! numbers.

use fretwear::contact::normal::{self, NormalOptions, NormalProblem, NormalSolution};
use fretwear::contact::tangential::{self, Drive, TangentialOptions};
use fretwear::contact::{Boundary, HalfSpace, Pair, Shear, stiffness};
use fretwear::grid::{Grid, Patch};
use fretwear::surface::generate::{RandomSurface, Spectrum, random};

use super::{STEEL, limit_of, sheared};

/// Mean pressure of 30 kN on 40 x 30 mm.
const MEAN: f64 = 25e6;

/// Number of surfaces per mean, because the number of FFT pairs for one surface depends on rounding.
const SURFACES: u64 = 5;

/// A corner of the joint of the benchmarks, with the same number of cells per correlation length and a sixteenth of the area.
struct Corner {
    patch: Patch,
    height: Vec<f64>,
    boundary: Boundary,
}

impl Corner {
    fn new(seed: u64, rq: f64, boundary: Boundary) -> Corner {
        let patch = Patch::full(Grid::over([10.5e-3, 7.5e-3], [68, 64]));
        let surface = RandomSurface {
            rq,
            spectrum: Spectrum::Gaussian {
                correlation_length: [0.5e-3, 0.5e-3],
            },
            seed,
        };
        let height = random(&patch, &surface).expect("a surface").heights;
        Corner {
            patch,
            height,
            boundary,
        }
    }

    fn half_space(&self) -> HalfSpace {
        HalfSpace::new(self.patch.grid, Pair::same(STEEL), self.boundary)
    }

    fn problem(&self) -> NormalProblem<'_> {
        NormalProblem::new(&self.patch, &self.height, MEAN * self.patch.area())
    }
}

/// FFT pairs of a solve, and its solution.
fn press(
    half_space: &mut HalfSpace,
    problem: &NormalProblem,
    start: Option<&[f64]>,
) -> (f64, NormalSolution) {
    half_space.take_pairs();
    let options = NormalOptions::default();
    let found = normal::solve(half_space, problem, start, options).expect("a converged contact");
    (half_space.take_pairs(), found)
}

/// The mean over the surfaces must be between 75 % and 125 % of `expected`.
fn costs(what: &str, expected: f64, pairs: impl Fn(u64) -> f64) {
    let mean = (0..SURFACES).map(pairs).sum::<f64>() / SURFACES as f64;
    println!("{what}: {mean:.1} FFT pairs");
    assert!(
        (0.75 * expected..=1.25 * expected).contains(&mean),
        "{what}: {mean:.1} FFT pairs, {expected} expected"
    );
}

const CASES: [(f64, Boundary); 4] = [
    (5e-6, Boundary::Free),
    (0.5e-6, Boundary::Free),
    (5e-6, Boundary::Periodic),
    (0.5e-6, Boundary::Periodic),
];

/// Problem and starting values of a normal solve.
#[derive(Debug, Clone, Copy)]
enum Kind {
    Cold,
    /// Contact under a pressure cap: the hardness of the published case, and a lower cap for smooth joints.
    Capped,
    /// Worn contact, which starts from the former pressure. The wear is proportional to this pressure.
    Worn,
    /// Implicit wear step, which starts from the former pressure. Slipping cells with less pressure have a larger compliance.
    Compliant,
}

impl Kind {
    fn pairs(self, mut corner: Corner, rq: f64) -> f64 {
        let is_rough = rq > 1e-6;
        let worn = if is_rough { 1e-7 } else { 1e-8 };
        let mut half_space = corner.half_space();
        if let Kind::Cold | Kind::Capped = self {
            let cap = if is_rough { 600e6 } else { 100e6 };
            let problem = NormalProblem {
                pressure_cap: matches!(self, Kind::Capped).then_some(cap),
                ..corner.problem()
            };
            return press(&mut half_space, &problem, None).0;
        }
        let (_, before) = press(&mut half_space, &corner.problem(), None);
        let peak = before.pressure.iter().copied().fold(0.0, f64::max);
        let shares = before.pressure.iter().map(|p| p / peak);
        if let Kind::Worn = self {
            let pairs = corner.height.iter_mut().zip(shares);
            pairs.for_each(|(h, share)| *h -= worn * share);
            return press(&mut half_space, &corner.problem(), Some(&before.pressure)).0;
        }
        let compliance: Vec<f64> = shares.map(|share| worn / peak * (1.0 - share)).collect();
        let problem = NormalProblem {
            compliance: Some(&compliance),
            ..corner.problem()
        };
        press(&mut half_space, &problem, Some(&before.pressure)).0
    }
}

#[test]
fn normal_contacts() {
    for (kind, expected) in [
        (Kind::Cold, [15.0, 20.5, 29.0, 31.0]),
        (Kind::Capped, [17.0, 20.0, 28.5, 33.0]),
        (Kind::Worn, [8.5, 9.5, 13.0, 15.0]),
        (Kind::Compliant, [7.5, 9.0, 11.5, 14.0]),
    ] {
        for ((rq, boundary), expected) in CASES.into_iter().zip(expected) {
            let what = format!("{kind:?}, Rq {rq:e} m, {boundary:?}");
            let pairs = |seed| kind.pairs(Corner::new(seed, rq, boundary), rq);
            costs(&what, expected, pairs);
        }
    }
}

/// A step from rest to 60 % of the sliding force.
#[test]
fn a_tangential_step() {
    for ((rq, boundary), expected) in
        CASES
            .into_iter()
            .zip([[9.5, 24.0], [12.5, 32.5], [16.0, 46.0], [19.5, 51.0]])
    {
        for (axes, expected) in [1, 2].into_iter().zip(expected) {
            let what = format!("tangential, {axes} axes, Rq {rq:e} m, {boundary:?}");
            costs(&what, expected, |seed| {
                let corner = Corner::new(seed, rq, boundary);
                let mut half_space = corner.half_space();
                let (_, found) = press(&mut half_space, &corner.problem(), None);
                let limit = limit_of(0.6, &found.pressure);
                let force = 0.6 * 0.6 * found.load;
                let drive = [0.8, 0.6][..axes]
                    .iter()
                    .map(|part| Drive::Force(part * force))
                    .collect();
                let problem = sheared(&corner.patch, &limit, None, &drive);
                half_space.take_pairs();
                let options = TangentialOptions::default();
                let step = tangential::solve(&mut half_space, &problem, None, options);
                step.expect("a converged step");
                half_space.take_pairs()
            });
        }
    }
}

/// A bolt changes the load by less than the load of one cell. A uniform change of the pressure would load every open cell.
#[test]
fn a_warm_start_for_a_load_that_is_hardly_larger() {
    for (rq, boundary) in CASES {
        for seed in 0..SURFACES {
            let corner = Corner::new(seed, rq, boundary);
            let mut half_space = corner.half_space();
            let (cold, before) = press(&mut half_space, &corner.problem(), None);
            let compliance = vec![half_space.self_compliance(); before.pressure.len()];
            for more in [1e-9, 5e-6, 1e-3] {
                let problem = NormalProblem {
                    compliance: (more < 1e-3).then_some(&compliance[..]),
                    ..NormalProblem::new(&corner.patch, &corner.height, (1.0 + more) * before.load)
                };
                let (warm, _) = press(&mut half_space, &problem, Some(&before.pressure));
                assert!(
                    warm <= 1.2 * cold,
                    "{warm} FFT pairs, {cold} from a cold start, load increase {more:e}, Rq {rq:e} m, {boundary:?}"
                );
            }
        }
    }
}

/// The cost of kn, and of kt with kn as starting values, for shear along x and in the plane.
#[test]
fn stiffness_of_a_contact() {
    for ((rq, boundary), expected) in
        CASES
            .into_iter()
            .zip([[9.0, 12.5], [11.0, 16.0], [13.5, 20.5], [16.5, 25.5]])
    {
        for (shear, expected) in [Shear::AlongX, Shear::InPlane].into_iter().zip(expected) {
            let what = format!("stiffness, {shear:?}, Rq {rq:e} m, {boundary:?}");
            costs(&what, expected, |seed| {
                let corner = Corner::new(seed, rq, boundary);
                let mut half_space = corner.half_space();
                let (_, found) = press(&mut half_space, &corner.problem(), None);
                let set: Vec<bool> = found.pressure.iter().map(|p| *p > 0.0).collect();
                let tolerance = stiffness::FIGURE_TOLERANCE;
                half_space.take_pairs();
                let kn = stiffness::normal_to(&mut half_space, &set, tolerance).expect("kn");
                let start = Some(&kn);
                stiffness::tangential_from(&mut half_space, &set, shear, tolerance, start)
                    .expect("kt");
                half_space.take_pairs()
            });
        }
    }
}
