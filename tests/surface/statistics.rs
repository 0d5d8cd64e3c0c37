use fretwear::grid::{Grid, Patch};
use fretwear::surface::SurfaceError;
use fretwear::surface::statistics::{histogram, roughness};
use proptest::prelude::*;

use super::{bored, field, joint};

#[test]
fn closed_forms() {
    // Whole periods of a sine give exactly Rq = A/√2 and Ku = 3/2 at equidistant points. Two levels with a share q of the cells give Sk =
    // (1 - 2q)/√(q(1 - q)) and Ku = 1 + Sk².
    let patch = Patch::full(joint([64, 48]));
    let sine = field(&patch.grid, |x, _| {
        2e-6 * (2.0 * std::f64::consts::PI * 3.0 * x / 8e-3).sin()
    });
    let found = roughness(&patch, &sine).unwrap();
    assert!((found.rq / (2e-6 / 2f64.sqrt()) - 1.0).abs() < 1e-13);
    assert!(found.mean.abs() < 1e-20 && found.sk.abs() < 1e-12);
    assert!((found.ku - 1.5).abs() < 1e-12);

    let levels = field(
        &patch.grid,
        |x, y| if x > 0.0 && y > 0.0 { 1e-6 } else { 0.0 },
    );
    let found = roughness(&patch, &levels).unwrap();
    let q: f64 = 0.25;
    let sk = (1.0 - 2.0 * q) / (q * (1.0 - q)).sqrt();
    assert!((found.mean - 0.25e-6).abs() < 1e-20);
    assert!((found.sk - sk).abs() < 1e-12 && (found.ku - 1.0 - sk * sk).abs() < 1e-12);
}

/// Standard normal heights at equal steps of probability.
fn normal_quantiles(n: usize) -> Vec<f64> {
    // Distribution function by Simpson's rule from -8, inverted step by step.
    let density = |z: f64| (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    const STEP: f64 = 1e-5;
    let (mut z, mut sum) = (-8.0, 0.0);
    let mut found = Vec::with_capacity(n);
    for k in 0..n {
        let target = (k as f64 + 0.5) / n as f64;
        loop {
            let part =
                STEP / 6.0 * (density(z) + 4.0 * density(z + 0.5 * STEP) + density(z + STEP));
            if sum + part > target {
                break;
            }
            sum += part;
            z += STEP;
        }
        found.push(z + (target - sum) / density(z));
    }
    found
}

#[test]
fn a_normal_surface_clipped_flat_first_loses_kurtosis() {
    // Claim 12: the change of the height distribution by wear. Equal steps of probability omit the tails beyond 1/(2n), which contain 0.003
    // of the fourth moment here.
    const TAILS: f64 = 0.006;
    let grid = joint([250, 120]);
    let patch = Patch::full(grid);
    let normal = normal_quantiles(grid.len());
    let clipped = |c: f64| {
        let heights: Vec<f64> = normal.iter().map(|z| z.min(c)).collect();
        roughness(&patch, &heights).unwrap()
    };
    let whole = clipped(f64::INFINITY);
    assert!(
        (whole.ku - 3.0).abs() < TAILS && whole.sk.abs() < 1e-9,
        "{whole:?}"
    );
    assert!((clipped(1.42).ku - 2.64).abs() < TAILS);
    for c in [1.2, 1.7] {
        assert!(clipped(c).ku > clipped(1.42).ku, "the minimum is at 1.42");
    }
    let back = clipped(0.756);
    assert!((back.ku - 3.0).abs() < TAILS, "{back:?}");
    assert!(
        (back.rq - 0.812).abs() < 1e-3 && (back.sk + 0.77).abs() < 5e-3,
        "{back:?}"
    );
    assert!((back.mean + 0.130).abs() < 1e-3);
    let half = clipped(0.0);
    assert!(
        (half.ku - 5.41).abs() < 2.0 * TAILS && (half.sk + 1.64).abs() < 5e-3,
        "{half:?}"
    );
    assert!((half.mean + 0.40).abs() < 2e-3);
}

#[test]
fn nanometres_on_a_metre_keep_their_digits() {
    let patch = bored([37, 26]);
    // Steps of 2^-33 m, about 0.1 nm, are exact next to a metre.
    let step = 2f64.powi(-33);
    let small = field(&patch.grid, |x, y| {
        step * ((x * 3e4).sin() * 40.0 + (y * 2e4).cos() * 30.0).round()
    });
    let high: Vec<f64> = small.iter().map(|h| h + 1.0).collect();
    let (a, b) = (
        roughness(&patch, &small).unwrap(),
        roughness(&patch, &high).unwrap(),
    );
    // The heights are equal numbers, so only the rounding of sums of a thousand terms differs.
    const ROUNDING: f64 = 1e-12;
    assert!((a.rq / b.rq - 1.0).abs() < ROUNDING, "{a:?} {b:?}");
    assert!((a.sk - b.sk).abs() < ROUNDING && (a.ku - b.ku).abs() < ROUNDING);
}

#[test]
fn a_flat_surface_has_no_shape_and_no_nan() {
    let patch = bored([9, 7]);
    for height in [0.0, 0.1, -3.7e-6] {
        let found = roughness(&patch, &vec![height; patch.grid.len()]).unwrap();
        assert_eq!(
            (found.mean, found.rq, found.sk, found.ku),
            (height, 0.0, 0.0, 0.0)
        );
    }
}

#[test]
fn cells_outside_the_joint_do_not_count_but_bad_ones_inside_are_named() {
    let patch = bored([16, 10]);
    let hole = patch.is_in_joint.iter().position(|k| !k).unwrap();
    let mut heights = field(&patch.grid, |x, y| x - 2.0 * y);
    let before = roughness(&patch, &heights).unwrap();
    heights[hole] = f64::NAN;
    assert_eq!(roughness(&patch, &heights).unwrap(), before);
    heights[patch.grid.index(2, 9)] = f64::INFINITY;
    assert_eq!(
        roughness(&patch, &heights),
        Err(SurfaceError::NotFinite {
            i: 2,
            j: 9,
            value: f64::INFINITY
        })
    );
    assert_eq!(
        roughness(&patch, &heights[1..]),
        Err(SurfaceError::Length {
            found: 159,
            expected: 160
        })
    );
    let nothing = Patch {
        grid: patch.grid,
        is_in_joint: vec![false; 160],
    };
    assert!(matches!(
        roughness(&nothing, &heights),
        Err(SurfaceError::TooFewCells { kept: 0, .. })
    ));
}

#[test]
fn the_histogram_counts_every_kept_cell_once() {
    let patch = bored([30, 20]);
    let heights = field(&patch.grid, |x, y| x * x + y);
    let found = histogram(&patch, &heights, 7).unwrap();
    assert_eq!(found.edges.len(), 8);
    assert_eq!(found.counts.iter().sum::<usize>(), patch.cells());
    let third = heights
        .iter()
        .zip(&patch.is_in_joint)
        .filter(|(h, k)| **k && **h >= found.edges[2] && **h < found.edges[3]);
    assert_eq!(found.counts[2], third.count());
    let flat = histogram(&patch, &vec![1.0; 600], 3).unwrap();
    assert_eq!(flat.counts, [patch.cells(), 0, 0]);
    assert!(histogram(&patch, &heights, 0).is_err());
}

proptest! {
    /// Ku ≥ 1 + Sk² for every distribution (Pearson). Scale and sign have the expected effect.
    #[test]
    fn kurtosis_bounds_skewness(heights in prop::collection::vec(-1e-5f64..1e-5, 12), scale in 1e-12f64..1e12) {
        let patch = Patch::full(Grid::over([4.0, 1.0], [4, 3]));
        let found = roughness(&patch, &heights).unwrap();
        prop_assume!(found.rq > 0.0);
        prop_assert!(found.ku >= 1.0 + found.sk * found.sk - 1e-9 * found.ku);
        let mirrored: Vec<f64> = heights.iter().map(|h| -scale * h).collect();
        let other = roughness(&patch, &mirrored).unwrap();
        prop_assert!((other.rq / (scale * found.rq) - 1.0).abs() < 1e-12);
        prop_assert!((other.sk + found.sk).abs() < 1e-9 && (other.ku - found.ku).abs() < 1e-9 * found.ku);
    }
}
