use std::f64::consts::PI;

use fretwear::grid::{Grid, Patch};
use fretwear::surface::SurfaceError;
use fretwear::surface::correlation::{autocorrelation, power_spectral_density};
use fretwear::surface::generate::{RandomSurface, Spectrum, Warning, flat, random, sphere};
use fretwear::surface::statistics::roughness;

use super::{bored, difference, joint};

/// Rounding of sums of about ten thousand numbers of order one in double precision.
const ROUNDING: f64 = 1e-12;

const RQ: f64 = 5e-6;

fn gaussian(seed: u64) -> RandomSurface {
    RandomSurface {
        rq: RQ,
        spectrum: Spectrum::Gaussian {
            correlation_length: [0.5e-3, 0.4e-3],
        },
        seed,
    }
}

fn all_spectra(seed: u64) -> [RandomSurface; 3] {
    let of = |spectrum| RandomSurface {
        rq: RQ,
        spectrum,
        seed,
    };
    [
        gaussian(seed),
        of(Spectrum::Exponential {
            correlation_length: [0.5e-3, 0.4e-3],
        }),
        of(Spectrum::SelfAffine {
            hurst: 0.8,
            rolloff_wavelength: 1e-3,
            cutoff_wavelength: Some(0.3e-3),
        }),
    ]
}

#[test]
fn rq_and_mean_are_exact_over_the_kept_cells() {
    for patch in [Patch::full(joint([64, 48])), bored([63, 50])] {
        for surface in all_spectra(3) {
            let heights = random(&patch, &surface).unwrap().heights;
            let found = roughness(&patch, &heights).unwrap();
            assert!((found.rq / RQ - 1.0).abs() < ROUNDING, "{found:?}");
            assert!((found.mean / RQ).abs() < ROUNDING, "{found:?}");
            let outside = heights.iter().zip(&patch.is_in_joint).filter(|(_, k)| !**k);
            assert!(outside.clone().all(|(h, _)| *h == 0.0));
        }
    }
}

/// Sum of the waves of a field at a position, with amplitudes by plain summation. The sum interpolates the field between the cell centres.
fn by_waves(grid: &Grid, heights: &[f64], at: (f64, f64)) -> f64 {
    let mut sum = 0.0;
    let [lx, ly] = grid.size();
    let half = |n: usize| ((n - 1) / 2) as i64;
    for m in -half(grid.nx)..=half(grid.nx) {
        for n in -half(grid.ny)..=half(grid.ny) {
            let (kx, ky) = (2.0 * PI * m as f64 / lx, 2.0 * PI * n as f64 / ly);
            for (index, h) in heights.iter().enumerate() {
                let (i, j) = grid.cell(index);
                let (x, y) = grid.centre(i, j);
                sum += h * (kx * (at.0 - x) + ky * (at.1 - y)).cos();
            }
        }
    }
    sum / grid.len() as f64
}

#[test]
fn one_seed_is_one_surface_on_every_grid() {
    // Waves that neither grid resolves carry at most exp(-(π nx clx / (2 Lx))²) of the power, which is below rounding here. The grids have
    // odd and even numbers of cells with whole and fractional ratios.
    let surface = RandomSurface {
        spectrum: Spectrum::Gaussian {
            correlation_length: [2e-3, 1.4e-3],
        },
        ..gaussian(11)
    };
    let (coarse, fine) = (joint([32, 30]), joint([45, 37]));
    let patch = |grid| random(&Patch::full(grid), &surface).unwrap().heights;
    let (on_coarse, on_fine) = (patch(coarse), patch(fine));
    for (i, j) in [(0, 0), (44, 36), (20, 5), (7, 30), (33, 18)] {
        let there = by_waves(&coarse, &on_coarse, fine.centre(i, j));
        let here = on_fine[fine.index(i, j)];
        assert!(
            (there - here).abs() < 1e-9 * RQ,
            "({i}, {j}): {there:e} {here:e}"
        );
    }
}

#[test]
fn a_finer_grid_adds_waves_and_keeps_the_others() {
    // An exponential autocorrelation has waves of all lengths. The fine grid has more waves than the coarse grid. The common waves differ
    // only by the factor of the exact Rq.
    let surface = all_spectra(5)[1];
    let (coarse, fine) = (joint([16, 12]), joint([40, 30]));
    let amplitude = |grid: &Grid, heights: &[f64], m: i64, n: i64| {
        let [lx, ly] = grid.size();
        let mut sum = (0.0, 0.0);
        for (index, h) in heights.iter().enumerate() {
            let (i, j) = grid.cell(index);
            let (x, y) = grid.centre(i, j);
            let phase = 2.0 * PI * (m as f64 * x / lx + n as f64 * y / ly);
            sum.0 += h * phase.cos();
            sum.1 -= h * phase.sin();
        }
        (sum.0 / grid.len() as f64, sum.1 / grid.len() as f64)
    };
    let of = |grid: Grid| random(&Patch::full(grid), &surface).unwrap().heights;
    let (a, b) = (of(coarse), of(fine));
    let factor = amplitude(&coarse, &a, 1, 0).0 / amplitude(&fine, &b, 1, 0).0;
    assert!(
        factor > 1.0,
        "the coarse grid has fewer waves for the same Rq: {factor}"
    );
    for (m, n) in [(0, 1), (3, -2), (7, 5), (5, 0), (2, -5)] {
        let (p, q) = (amplitude(&coarse, &a, m, n), amplitude(&fine, &b, m, n));
        let error = (p.0 - factor * q.0).hypot(p.1 - factor * q.1);
        assert!(error < ROUNDING * RQ, "wave ({m}, {n}): {p:?} {q:?}");
    }
    // The coarse even grid has no Nyquist waves. The fine grid has waves at this wave number.
    let nyquist = amplitude(&coarse, &a, 8, 1);
    assert!(nyquist.0.hypot(nyquist.1) < ROUNDING * RQ);
    assert!(amplitude(&fine, &b, 8, 1).0.abs() > 1e-6 * RQ);
}

#[test]
fn seeds_differ_and_threads_do_not() {
    let patch = bored([64, 48]);
    let here = random(&patch, &gaussian(1)).unwrap().heights;
    let again = patch.clone();
    let there = std::thread::spawn(move || random(&again, &gaussian(1)).unwrap().heights);
    assert_eq!(here, there.join().unwrap());
    let other = random(&patch, &gaussian(2)).unwrap().heights;
    assert!(difference(&here, &other) > RQ);
    // Seeds that differ only in high bits give different surfaces.
    let high = random(&patch, &gaussian(1 | 1 << 40)).unwrap().heights;
    assert!(difference(&here, &high) > RQ);
}

#[test]
fn the_stream_is_pinned() {
    // A newer version continues a run of an older version on the same surface, so these numbers must never change.
    let heights = random(&Patch::full(joint([24, 18])), &gaussian(1))
        .unwrap()
        .heights;
    let found: Vec<f64> = [0, 17, 200, 431].iter().map(|&k| heights[k] / RQ).collect();
    const PINNED: [f64; 4] = [
        1.0992546694286454,
        1.1502933920362075,
        0.4444823418198524,
        -0.6170923832067813,
    ];
    // The last digits depend on the sine and logarithm of the machine.
    assert!(difference(&found, &PINNED) < ROUNDING, "{found:?}");
}

/// Mean over seeds of the measured autocorrelation at some lags, and its standard error.
fn measured_acf(surface: impl Fn(u64) -> RandomSurface, lags: &[[isize; 2]]) -> Vec<(f64, f64)> {
    const SEEDS: u64 = 40;
    let patch = Patch::full(joint([96, 72]));
    let mut sums = vec![(0.0, 0.0); lags.len()];
    for seed in 0..SEEDS {
        let heights = random(&patch, &surface(seed)).unwrap().heights;
        let acf = autocorrelation(&patch, &heights).unwrap();
        for (sum, lag) in sums.iter_mut().zip(lags) {
            let value = acf.at(lag[0], lag[1]).unwrap();
            sum.0 += value;
            sum.1 += value * value;
        }
    }
    let n = SEEDS as f64;
    sums.iter()
        .map(|(s, q)| (s / n, ((q / n - (s / n).powi(2)) / n).sqrt()))
        .collect()
}

const LAGS: [[isize; 2]; 6] = [[2, 0], [6, 0], [0, 6], [4, 4], [4, -4], [12, 0]];

/// Four standard errors. One test in ten thousand would fail by chance, and the seeds are fixed.
const STANDARD_ERRORS: f64 = 4.0;

/// A patch with few correlation lengths loses its mean. The subtraction lowers the autocorrelation everywhere by about π clx cly / (Lx Ly)
/// = 1.6 % of the power.
const MEAN_REMOVED: f64 = 0.02;

#[test]
fn the_gaussian_autocorrelation_is_the_one_asked_for() {
    let grid = joint([96, 72]);
    for (found, lag) in measured_acf(gaussian, &LAGS).into_iter().zip(LAGS) {
        let (x, y) = (lag[0] as f64 * grid.dx, lag[1] as f64 * grid.dy);
        let asked = (-(x / 0.5e-3).powi(2) - (y / 0.4e-3).powi(2)).exp();
        let error = (found.0 - asked).abs();
        assert!(
            error < STANDARD_ERRORS * found.1 + MEAN_REMOVED,
            "{lag:?}: {found:?} {asked}"
        );
    }
}

#[test]
fn the_exponential_autocorrelation_is_the_one_asked_for() {
    let grid = joint([96, 72]);
    // The unresolved waves would carry 1/√(1 + (π cl / cell)²) = 5 % of the power, all within one or two cells of lag zero. The exact Rq
    // distributes this power over the other lags.
    const UNRESOLVED: f64 = 0.06;
    for (found, lag) in measured_acf(|s| all_spectra(s)[1], &LAGS)
        .into_iter()
        .zip(LAGS)
    {
        let (x, y) = (lag[0] as f64 * grid.dx, lag[1] as f64 * grid.dy);
        let asked = (-(x / 0.5e-3).hypot(y / 0.4e-3)).exp();
        let error = (found.0 - asked).abs();
        assert!(
            error < STANDARD_ERRORS * found.1 + MEAN_REMOVED + UNRESOLVED * asked,
            "{lag:?}: {found:?} {asked}"
        );
    }
}

#[test]
fn the_self_affine_spectrum_has_its_slope_plateau_and_cut() {
    let patch = Patch::full(joint([192, 160]));
    let surface = RandomSurface {
        rq: RQ,
        spectrum: Spectrum::SelfAffine {
            hurst: 0.7,
            rolloff_wavelength: 1e-3,
            cutoff_wavelength: Some(0.12e-3),
        },
        seed: 9,
    };
    let heights = random(&patch, &surface).unwrap().heights;
    let rings = power_spectral_density(&patch, &heights).unwrap();
    let mean = |from: f64, to: f64| {
        let inside = rings
            .iter()
            .filter(|r| r.wave_number > from && r.wave_number < to);
        let (sum, n) = inside.fold((0.0, 0), |s, r| {
            (s.0 + r.density.ln() * r.waves as f64, s.1 + r.waves)
        });
        (sum / n as f64, n)
    };
    let rolloff = 2.0 * PI / 1e-3;
    let cutoff = 2.0 * PI / 0.12e-3;
    // Log densities of two bands in the power law, at a factor of two. Their difference is the slope.
    let ((low, _), (high, n)) = (
        mean(1.5 * rolloff, 2.0 * rolloff),
        mean(3.0 * rolloff, 4.0 * rolloff),
    );
    // A periodogram scatters by its own value. The mean over n waves, half of them independent, scatters by √(2/n). The lower band has a
    // quarter of the waves.
    let scatter = 4.0 * (2.0 / n as f64 * 5.0).sqrt();
    let slope = (high - low) / 2.0f64.ln();
    assert!(
        (slope + 2.0 + 2.0 * 0.7).abs() < scatter,
        "slope {slope}, scatter {scatter}"
    );
    assert!(scatter < 0.6, "the scatter is too large for this test");
    let highest = rings.iter().filter(|r| r.wave_number > 1.05 * cutoff);
    let peak = rings.iter().fold(0.0, |m: f64, r| m.max(r.density));
    assert!(highest.clone().count() > 5);
    assert!(
        highest.clone().all(|r| r.density < 1e-20 * peak),
        "no power beyond the cut-off"
    );
    let (plateau, _) = mean(0.0, rolloff);
    let (below, _) = mean(rolloff, 1.5 * rolloff);
    assert!(plateau > below, "{plateau} {below}");
}

#[test]
fn normally_distributed_heights() {
    let patch = Patch::full(joint([128, 96]));
    let (mut sk, mut ku) = (0.0, 0.0);
    const SEEDS: u64 = 40;
    for seed in 0..SEEDS {
        let heights = random(&patch, &gaussian(seed)).unwrap().heights;
        let found = roughness(&patch, &heights).unwrap();
        sk += found.sk / SEEDS as f64;
        ku += found.ku / SEEDS as f64;
    }
    // One seed has about 60 independent patches (area over π clx cly / 2 …). The standard errors are √(6/60/40) = 0.05 and √(24/60/40) =
    // 0.1.
    assert!(sk.abs() < 0.2, "{sk}");
    assert!((ku - 3.0).abs() < 0.4, "{ku}");
}

#[test]
fn a_sphere_is_its_paraboloid() {
    let patch = bored([21, 15]);
    let heights = sphere(&patch, 0.25).unwrap();
    let (x, y) = patch.grid.centre(3, 2);
    let expected = -(x * x + y * y) / 0.5;
    assert!((heights[patch.grid.index(3, 2)] - expected).abs() < 1e-18);
    let whole = sphere(&Patch::full(joint([21, 15])), 0.25).unwrap();
    assert_eq!(
        whole[patch.grid.index(10, 7)],
        0.0,
        "the apex of an odd grid"
    );
    assert!(flat(&patch).iter().all(|&h| h == 0.0));
    assert!(matches!(
        sphere(&patch, -1.0),
        Err(SurfaceError::OutOfRange { name: "radius", .. })
    ));
}

#[test]
fn doubtful_lengths_are_warned_of_and_senseless_ones_refused() {
    let patch = Patch::full(joint([64, 48]));
    let with = |clx: f64, cly: f64| {
        let spectrum = Spectrum::Gaussian {
            correlation_length: [clx, cly],
        };
        random(
            &patch,
            &RandomSurface {
                spectrum,
                ..gaussian(1)
            },
        )
    };
    assert_eq!(with(0.5e-3, 0.4e-3).unwrap().warnings, []);
    let warnings = with(0.2e-3, 2e-3).unwrap().warnings;
    assert!(
        matches!(
            warnings[..],
            [
                Warning::UnderResolved { axis: 'x', .. },
                Warning::FewLengths { axis: 'y', .. }
            ]
        ),
        "{warnings:?}"
    );
    assert!(
        warnings[0].to_string().contains("1.60 cells"),
        "{}",
        warnings[0]
    );
    for bad in [with(0.0, 1e-3), with(1e-3, f64::NAN), with(1e-3, -1e-3)] {
        assert!(
            matches!(bad, Err(SurfaceError::OutOfRange { .. })),
            "{bad:?}"
        );
    }
    // The correlation length exceeds the joint, so no wave fits into the joint.
    assert!(matches!(
        with(1.0, 1.0),
        Err(SurfaceError::NoPower { nx: 64, .. })
    ));
    let rq = |rq| random(&patch, &RandomSurface { rq, ..gaussian(1) });
    assert!(matches!(
        rq(0.0),
        Err(SurfaceError::OutOfRange { name: "rq", .. })
    ));
    let mut one = patch.clone();
    one.is_in_joint = (0..one.grid.len()).map(|k| k == 5).collect();
    assert!(matches!(
        random(&one, &gaussian(1)),
        Err(SurfaceError::TooFewCells { kept: 1, .. })
    ));
}

#[test]
fn a_self_affine_surface_without_a_cut_off_is_rough_down_to_the_grid() {
    let patch = Patch::full(joint([192, 160]));
    let surface = |cutoff_wavelength| RandomSurface {
        rq: RQ,
        spectrum: Spectrum::SelfAffine {
            hurst: 0.7,
            rolloff_wavelength: 1e-3,
            cutoff_wavelength,
        },
        seed: 9,
    };
    let cut = 0.12e-3;
    let beyond = |cutoff_wavelength| {
        let heights = random(&patch, &surface(cutoff_wavelength)).unwrap().heights;
        let rings = power_spectral_density(&patch, &heights).unwrap();
        let largest = |from: f64| {
            let shorter = rings.iter().filter(|ring| ring.wave_number > from);
            shorter.fold(0.0, |m: f64, ring| m.max(ring.density))
        };
        largest(1.05 * 2.0 * PI / cut) / largest(0.0)
    };
    assert!(beyond(Some(cut)) < 1e-20);
    let without = beyond(None);
    assert!(1e-8 < without && without < 1e-1, "{without:e}");
}
