//! Resampling of maps whose shape differs from the joint.

use fretwear::grid::{Grid, Patch};
use fretwear::surface::prepare::{Detrend, Fill, PrepareOptions, onto_joint};
use fretwear::surface::topography::Topography;
use proptest::prelude::*;

use super::{difference, field, joint};

/// Rounding of sums of about a hundred terms of order one.
const ROUNDING: f64 = 1e-12;

fn resampled(from: [usize; 2], heights: Vec<f64>, to: &Grid) -> Vec<f64> {
    let map = Topography {
        nx: from[0],
        ny: from[1],
        spacing: None,
        heights,
    };
    let options = PrepareOptions {
        detrend: Detrend::None,
        fill: Fill::Mask,
        shift: [0.0; 2],
    };
    onto_joint(&map, &Patch::full(*to), options)
        .unwrap()
        .heights
}

fn mean(heights: &[f64]) -> f64 {
    heights.iter().sum::<f64>() / heights.len() as f64
}

#[test]
fn planes_are_exact_up_to_the_edge_finer_and_coarser() {
    let plane = |x: f64, y: f64| 0.3 + 50.0 * x - 80.0 * y;
    for (from, to) in [
        ([40, 30], [64, 48]),
        ([64, 50], [17, 30]),
        ([31, 29], [30, 31]),
        ([2, 3], [7, 5]),
        ([1, 4], [3, 3]),
    ] {
        let (from, to) = (joint(from), joint(to));
        let found = resampled([from.nx, from.ny], field(&from, plane), &to);
        let mut expected = field(&to, plane);
        if from.nx == 1 {
            // A single point along x has no slope.
            expected = field(&to, |_, y| plane(0.0, y));
        }
        assert!(difference(&found, &expected) < ROUNDING, "{from:?} {to:?}");
    }
}

#[test]
fn whole_ratios_are_block_means() {
    let (fine, coarse) = (joint([36, 24]), joint([12, 12]));
    let heights = field(&fine, |x, y| (x * 9e3).sin() + (x * y * 1e7).cos());
    let found = resampled([36, 24], heights.clone(), &coarse);
    for (index, h) in found.iter().enumerate() {
        let (i, j) = coarse.cell(index);
        let block = (0..6).map(|k| heights[fine.index(3 * i + k / 2, 2 * j + k % 2)]);
        assert!((h - block.sum::<f64>() / 6.0).abs() < ROUNDING);
    }
}

#[test]
fn coarsening_does_not_alias() {
    // A wave with a length of three fine points would alias to a long wave if the program sampled single points.
    let (fine, coarse) = (joint([96, 40]), joint([23, 11]));
    let heights = field(&fine, |x, _| {
        (2.0 * std::f64::consts::PI * 32.0 * x / 8e-3).sin()
    });
    let found = resampled([96, 40], heights, &coarse);
    let largest = found.iter().fold(0.0, |m: f64, h| m.max(h.abs()));
    // A mean over 4.2 points of a wave with 3 points: at most the sum over the incomplete third of a wave, divided by 4.2.
    assert!(largest < 0.3, "{largest}");
}

#[test]
fn refining_a_smooth_surface_is_of_third_order() {
    // Waves with a length of some millimetres. The test compares the cell means of the target with the exact means.
    let to = joint([160, 120]);
    let height = |x: f64, y: f64| (x * 1.5e3).sin() * (y * 2e3 + 0.4).cos();
    // The cell mean of a wave is its value at the centre times sinc.
    let sinc = |a: f64| a.sin() / a;
    let mean_of = |grid: &Grid| {
        let factor = sinc(0.5 * 1.5e3 * grid.dx) * sinc(0.5 * 2e3 * grid.dy);
        field(grid, |x, y| factor * height(x, y))
    };
    let error = |cells: [usize; 2]| {
        difference(
            &resampled(cells, mean_of(&joint(cells)), &to),
            &mean_of(&to),
        )
    };
    let (coarse, fine) = (error([36, 28]), error([72, 56]));
    let order = (coarse / fine).log2();
    // Parabolas have third order, or slightly less before the limit. The one-sided edges determine the largest error.
    assert!(order > 2.7, "order {order}, errors {coarse:e} {fine:e}");
}

proptest! {
    /// The mean over the map equals the mean over the joint, on any pair of grids.
    #[test]
    fn the_mean_is_preserved(nx in 1usize..13, ny in 1usize..13, mx in 1usize..13, my in 1usize..13, seed in prop::collection::vec(-1.0f64..1.0, 144)) {
        let heights = seed[..nx * ny].to_vec();
        let before = mean(&heights);
        let after = mean(&resampled([nx, ny], heights, &joint([mx, my])));
        prop_assert!((before - after).abs() < ROUNDING, "{} {}", before, after);
    }
}
