use fretwear::grid::Patch;
use fretwear::surface::correlation::{autocorrelation, power_spectral_density};
use fretwear::surface::generate::{RandomSurface, Spectrum, random};
use fretwear::surface::statistics::roughness;

use super::{bored, field, joint};

#[test]
fn the_autocorrelation_is_the_naive_mean_of_products() {
    let patch = bored([13, 10]);
    let grid = patch.grid;
    let heights = field(&grid, |x, y| (x * 2e3).sin() + (y * 1.7e3).cos() * x);
    let about = roughness(&patch, &heights).unwrap();
    let acf = autocorrelation(&patch, &heights).unwrap();
    for (a, b) in [(0isize, 0isize), (3, 0), (0, 4), (2, -5), (-12, 9), (6, 1)] {
        let (mut sum, mut pairs) = (0.0, 0.0);
        for index in 0..grid.len() {
            let (i, j) = grid.cell(index);
            let (p, q) = (i as isize + a, j as isize + b);
            if (0..13).contains(&p) && (0..10).contains(&q) {
                let other = grid.index(p as usize, q as usize);
                if patch.is_in_joint[index] && patch.is_in_joint[other] {
                    sum += (heights[index] - about.mean) * (heights[other] - about.mean);
                    pairs += 1.0;
                }
            }
        }
        let naive = sum / pairs / (about.rq * about.rq);
        let found = acf.at(a, b).unwrap();
        assert!((found - naive).abs() < 1e-11, "({a}, {b}): {found} {naive}");
    }
    assert_eq!(acf.at(13, 0), None, "this distance exceeds the patch");
    assert!(autocorrelation(&patch, &vec![1.0; grid.len()]).is_err());
}

#[test]
fn the_correlation_length_is_found_on_both_axes() {
    let patch = Patch::full(joint([256, 200]));
    let surface = RandomSurface {
        rq: 1e-6,
        spectrum: Spectrum::Gaussian {
            correlation_length: [0.3e-3, 0.15e-3],
        },
        seed: 4,
    };
    let heights = random(&patch, &surface).unwrap().heights;
    let [x, y] = autocorrelation(&patch, &heights)
        .unwrap()
        .correlation_length();
    // One seed has about 280 independent patches. The autocorrelation, and therefore the length, scatters by at most 6 %.
    assert!((x.unwrap() / 0.3e-3 - 1.0).abs() < 0.15, "{x:?}");
    assert!((y.unwrap() / 0.15e-3 - 1.0).abs() < 0.15, "{y:?}");
}

#[test]
fn the_spectrum_sums_to_the_square_of_rq() {
    for patch in [Patch::full(joint([32, 27])), bored([32, 27])] {
        let heights = field(&patch.grid, |x, y| {
            (x * 4e3).sin() * (y * 3e3).cos() + 20.0 * x
        });
        let rq = roughness(&patch, &heights).unwrap().rq;
        let [lx, ly] = patch.grid.size();
        let rings = power_spectral_density(&patch, &heights).unwrap();
        let sum: f64 = rings
            .iter()
            .map(|r| r.density * r.waves as f64)
            .sum::<f64>()
            / (lx * ly);
        assert!((sum / (rq * rq) - 1.0).abs() < 1e-12, "{sum} {}", rq * rq);
    }
}
