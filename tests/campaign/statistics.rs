//! Tests of statistics against samples with known figures.

use std::f64::consts::PI;

use fretwear::campaign::statistics::{
    classes, crossed_share, drawn_share, first_order_index, interpolate, rank_correlation,
    sample_statistics, variance,
};

use crate::support::Chance;

/// Rounding of floating-point sums.
const ROUNDING: f64 = 1e-12;

#[test]
fn the_spread_of_a_sample() {
    let values: Vec<f64> = (0..=100)
        .map(f64::from)
        .chain([f64::NAN, f64::INFINITY])
        .collect();
    let found = sample_statistics(&values).expect("values");
    assert_eq!((found.count, found.least, found.most), (101, 0.0, 100.0));
    assert!((found.mean - 50.0).abs() < ROUNDING);
    // n(n + 1)/12 for n + 1 equidistant values.
    assert!((found.sd - (101.0_f64 * 102.0 / 12.0).sqrt()).abs() < ROUNDING);
    // h = (n + 1/3) p + 1/3 of Hyndman and Fan, counted from 1.
    for (part, quantile) in [0.05, 0.25, 0.5, 0.75, 0.95]
        .into_iter()
        .zip(found.quantiles)
    {
        let expected = (101.0 + 1.0 / 3.0) * part + 1.0 / 3.0 - 1.0;
        assert!(
            (quantile - expected).abs() < 1e-9,
            "{part}: {quantile}, not {expected}"
        );
    }
    let one = sample_statistics(&[3.0]).expect("a value");
    assert_eq!((one.sd, one.quantiles), (0.0, [3.0; 5]));
    assert_eq!(sample_statistics(&[f64::NAN]), None);
}

#[test]
fn ranks_agree_whatever_the_form() {
    let x: Vec<f64> = (0..30).map(f64::from).collect();
    let of =
        |f: &dyn Fn(f64) -> f64| rank_correlation(&x, &x.iter().map(|x| f(*x)).collect::<Vec<_>>());
    assert!((of(&f64::exp).expect("a number") - 1.0).abs() < ROUNDING);
    assert!((of(&|x| -x.powi(3)).expect("a number") + 1.0).abs() < ROUNDING);
    assert_eq!(of(&|_| 2.0), None);
    // Ties: 1, 2.5, 2.5, 4 against 1 to 4.
    let tied = rank_correlation(&[1.0, 2.0, 3.0, 4.0], &[1.0, 5.0, 5.0, 9.0]).expect("a number");
    assert!(
        (tied - 4.5 / (5.0_f64 * 4.5).sqrt()).abs() < ROUNDING,
        "{tied}"
    );
}

/// y = 3a + b with independent a and b of the same variance: their shares are nine tenths and one tenth.
#[test]
fn parts_of_the_variance() {
    let (mut a, mut b, mut y) = (Vec::new(), Vec::new(), Vec::new());
    for i in 0..12 {
        for j in 0..12 {
            a.push(f64::from(i));
            b.push(f64::from(j));
            y.push(f64::from(3 * i + j));
        }
    }
    let share = |x: &[f64]| first_order_index(&classes(x), &y).expect("a number");
    // 144 runs with 12 values; chance explains (k - 1)/(n - k) of the remainder.
    for (x, part) in [(&a, 0.9), (&b, 0.1)] {
        let expected = 1.0 - (1.0 - part) * 143.0 / 132.0;
        assert!(
            (share(x) - expected).abs() < ROUNDING,
            "{}, not {expected}",
            share(x)
        );
    }
    assert_eq!(first_order_index(&classes(&a), &vec![1.0; 144]), None);
    assert_eq!(first_order_index(&[0, 1, 2], &[1.0, 2.0, 3.0]), None);
}

/// The function of Ishigami and Homma, whose indices are known (a = 7, b = 0.1): the second key has no rank correlation, and the
/// first-order index of the third key is zero.
#[test]
fn a_function_whose_indices_are_known() {
    const N: u32 = 8192;
    // Classes of 91 values, whose means have an error of a tenth of the standard deviation within them.
    const OFF: f64 = 0.02;
    let points: Vec<[f64; 3]> = (0..N)
        .map(|k| [0, 1, 2].map(|d| PI * (2.0 * f64::from(sobol_burley::sample(k, d, 3)) - 1.0)))
        .collect();
    let y: Vec<f64> = points
        .iter()
        .map(|[a, b, c]| a.sin() + 7.0 * b.sin().powi(2) + 0.1 * c.powi(4) * a.sin())
        .collect();
    for (k, expected) in [0.313_905, 0.442_411, 0.0].into_iter().enumerate() {
        let x: Vec<f64> = points.iter().map(|point| point[k]).collect();
        let found = first_order_index(&classes(&x), &y).expect("a number");
        assert!(
            (found - expected).abs() < OFF,
            "key {k}: {found}, not {expected}"
        );
        let rank = rank_correlation(&x, &y).expect("a number");
        match k {
            0 => assert!(rank > 0.3, "{rank}"),
            _ => assert!(rank.abs() < OFF, "key {k}: {rank}"),
        }
    }
}

/// A key without influence explains almost nothing, because the share of chance is subtracted.
#[test]
fn chance_explains_nothing() {
    let mut chance = Chance::new(5);
    let mut shares = Vec::new();
    for _ in 0..50 {
        let x: Vec<f64> = (0..200).map(|_| chance.next()).collect();
        let y: Vec<f64> = (0..200).map(|_| chance.next()).collect();
        shares.push(first_order_index(&classes(&x), &y).expect("a number"));
    }
    let mean = shares.iter().sum::<f64>() / 50.0;
    // By chance 15 classes would explain 7 %; negative values are set to zero, so about 2 % remain.
    assert!(mean < 0.03, "{mean}");
}

#[test]
fn equal_values_are_in_one_class() {
    let x: Vec<f64> = (0..400).map(|k| f64::from(k / 8)).collect();
    let found = classes(&x);
    for k in 0..400 {
        assert_eq!(found[k], found[8 * (k / 8)]);
    }
    assert_eq!(found.iter().max(), Some(&19));
    assert!(found.is_sorted());
}

#[test]
fn a_course_between_its_points() {
    let course = [[0.0, 1.0], [2.0, 5.0], [10.0, 5.5]];
    assert_eq!(interpolate(&course, 0.0), Some(1.0));
    assert_eq!(interpolate(&course, 0.5), Some(2.0));
    assert_eq!(interpolate(&course, 2.0), Some(5.0));
    assert_eq!(interpolate(&course, 10.0), Some(5.5));
    assert_eq!(interpolate(&course, 10.1), None);
    assert_eq!(interpolate(&course, -0.1), None);
}

/// y = 2 g + x + 3 e, where every point of the grid has the same draws of x and e: the shares follow from the variances of the terms.
#[test]
fn draws_that_cross_a_grid_count_once() {
    const DRAWS: usize = 300;
    let mut chance = Chance::new(11);
    let draws: Vec<[f64; 3]> = (0..DRAWS).map(|_| [0; 3].map(|_| chance.next())).collect();
    let grid = [0.0, 1.0, 2.0, 5.0];
    let y = |g: f64, [x, e, _]: [f64; 3]| 2.0 * g + 8.0 * x + 3.0 * e;
    let by_grid: Vec<Vec<f64>> = grid
        .iter()
        .map(|g| draws.iter().map(|d| y(*g, *d)).collect())
        .collect();
    let by_draw: Vec<Vec<f64>> = draws
        .iter()
        .map(|d| grid.iter().map(|g| y(*g, *d)).collect())
        .collect();
    let whole = variance(&by_grid.concat());
    // The grid does not interact with the draws, so its share is exact.
    let share = crossed_share(&[0, 1, 2, 3], &by_grid, whole).expect("a share");
    let exact = variance(&grid.map(|g| 2.0 * g)) / whole;
    assert!((share - exact).abs() < 1e-12, "{share} {exact}");
    let of_key = |key: usize| -> Vec<f64> { draws.iter().map(|d| d[key]).collect() };
    for (key, factor) in [(0, 8.0), (1, 3.0), (2, 0.0)] {
        let x = of_key(key);
        let share = drawn_share(&classes(&x), &by_draw, whole).expect("a share");
        let exact = factor * factor * variance(&x) / whole;
        // Tolerance for 300 draws in 18 classes.
        assert!((share - exact).abs() < 0.04, "key {key}: {share} {exact}");
    }
    // A grid without effect: each draw appears four times but counts as one sample.
    let repeated: Vec<Vec<f64>> = draws.iter().map(|d| vec![y(1.0, *d); 4]).collect();
    let inert: Vec<f64> = of_key(2);
    let share =
        drawn_share(&classes(&inert), &repeated, variance(&repeated.concat())).expect("a share");
    assert!(share < 0.05, "{share}");
    let same: Vec<Vec<f64>> = (0..4)
        .map(|_| draws.iter().map(|d| y(1.0, *d)).collect())
        .collect();
    assert_eq!(
        crossed_share(&[0, 1, 2, 3], &same, variance(&same.concat())),
        Some(0.0)
    );
    // A drawn name, such as a seed: with as many classes as samples there is no share.
    let names: Vec<usize> = (0..DRAWS).collect();
    assert_eq!(drawn_share(&names, &by_draw, whole), None);
}

/// The points of a grid scatter only by chance, each draw differently: the share of chance in their means is subtracted.
#[test]
fn an_inert_grid_has_no_share_of_what_scatters() {
    let mut chance = Chance::new(3);
    let mut shares = Vec::new();
    for _ in 0..60 {
        let y: Vec<Vec<f64>> = (0..3)
            .map(|_| (0..12).map(|_| chance.next()).collect())
            .collect();
        shares.push(crossed_share(&[0, 1, 2], &y, variance(&y.concat())).expect("a share"));
    }
    let mean = shares.iter().sum::<f64>() / 60.0;
    // By chance three means of twelve values would explain 6 %; negative values are set to zero.
    assert!(mean < 0.035, "{mean}");
}
