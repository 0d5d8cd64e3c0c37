//! Statistics of samples: quantiles, ranks, and the influence of a key on a figure.

use statrs::statistics::{Data, OrderStatistics, RankTieBreaker};

/// Statistics of a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleStatistics {
    /// Number of values.
    pub count: usize,
    /// Mean.
    pub mean: f64,
    /// Standard deviation with divisor n - 1; 0 for a single value.
    pub sd: f64,
    /// Quantiles of the sample at the probabilities [`QUANTILES`].
    pub quantiles: [f64; QUANTILES.len()],
    /// Least value.
    pub least: f64,
    /// Largest value.
    pub most: f64,
}

/// Probabilities of the quantiles of a [`SampleStatistics`].
pub const QUANTILES: [f64; 5] = [0.05, 0.25, 0.5, 0.75, 0.95];

/// Computes the statistics of the finite values. Returns `None` without a finite value. Quantiles follow Hyndman and
/// Fan's eighth definition.
pub fn sample_statistics(values: &[f64]) -> Option<SampleStatistics> {
    let mut values: Vec<f64> = values.iter().copied().filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    let (&least, &most) = (values.first()?, values.last()?);
    let count = values.len();
    let mean = values.iter().sum::<f64>() / count as f64;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    let sd = match count {
        1 => 0.0,
        _ => (squares / (count - 1) as f64).sqrt(),
    };
    let mut data = Data::new(values);
    Some(SampleStatistics {
        count,
        mean,
        sd,
        quantiles: QUANTILES.map(|part| data.quantile(part).clamp(least, most)),
        least,
        most,
    })
}

/// Computes Spearman's rank correlation, from -1 to 1. Equal values get the mean of their ranks. Returns `None` if `x`
/// or `y` does not vary.
pub fn rank_correlation(x: &[f64], y: &[f64]) -> Option<f64> {
    let ranks = |values: &[f64]| Data::new(values.to_vec()).ranks(RankTieBreaker::Average);
    let (x, y) = (ranks(x), ranks(y));
    // Mean of the ranks 1 to n.
    let mean = 0.5 * (x.len() as f64 + 1.0);
    let product = |a: &[f64], b: &[f64]| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - mean) * (b - mean)).sum()
    };
    let scale = (product(&x, &x) * product(&y, &y)).sqrt();
    (scale > 0.0).then(|| product(&x, &y) / scale)
}

/// Smallest sample whose variance is divided among classes.
const LEAST_SAMPLE: usize = 8;

/// Estimates the first-order Sobol index of a key, from 0 to 1. The index is the share of the variance of `y` that the
/// key explains alone.
///
/// The estimate is 1 - (S_w/(n - k)) / (S/(n - 1)) with k classes (Kelley's ε²), and not below 0. The estimate is the
/// variance between the class means divided by the variance of `y`, corrected for chance. The function returns `None`
/// if `y` has too few values for the number of classes, or if `y` does not vary.
pub fn first_order_index(classes: &[usize], y: &[f64]) -> Option<f64> {
    let n = y.len();
    let k = classes.iter().max().map_or(0, |most| most + 1);
    if n < LEAST_SAMPLE || k < 2 || n < k + 2 {
        return None;
    }
    let mean = y.iter().sum::<f64>() / n as f64;
    let mut sums = vec![(0.0, 0.0); k];
    for (class, y) in classes.iter().zip(y) {
        // Subtract the mean before the sum, because a sum of nearly equal values loses digits.
        let sum = &mut sums[*class];
        *sum = (sum.0 + (y - mean), sum.1 + 1.0);
    }
    let about = |class: usize| sums[class].0 / f64::max(sums[class].1, 1.0);
    let within: f64 = (classes.iter().zip(y))
        .map(|(class, y)| (y - mean - about(*class)).powi(2))
        .sum();
    let whole: f64 = y.iter().map(|y| (y - mean).powi(2)).sum();
    let filled = sums.iter().filter(|(_, count)| *count > 0.0).count();
    if whole <= 0.0 || n <= filled {
        return None;
    }
    let share = 1.0 - (within / (n - filled) as f64) / (whole / (n - 1) as f64);
    Some(share.clamp(0.0, 1.0))
}

/// Computes the population variance (divisor n).
pub fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
    squares / values.len().max(1) as f64
}

/// Estimates the first-order Sobol index of a key of a grid or a list. One section of the campaign has the key.
/// `y[p][q]` is the figure at the point p of the section and the point q of the other keys. `classes[p]` is the class
/// of the key. `whole` is the variance of all runs. All classes have the same points q. The estimate subtracts the
/// interaction, because the interaction changes the class means by chance.
///
/// Returns `None` for a single class, for a single point q, or if `whole` is 0.
pub fn crossed_share(classes: &[usize], y: &[Vec<f64>], whole: f64) -> Option<f64> {
    let others = y.first()?.len();
    let k = classes.iter().max()? + 1;
    if others < 2 || k < 2 || whole <= 0.0 {
        return None;
    }
    let mut counts = vec![0.0; k];
    let mut means = vec![vec![0.0; others]; k];
    for (class, of_point) in classes.iter().zip(y) {
        counts[*class] += 1.0;
        for (mean, y) in means[*class].iter_mut().zip(of_point) {
            *mean += y;
        }
    }
    for (mean, count) in means.iter_mut().zip(&counts) {
        mean.iter_mut()
            .for_each(|mean| *mean /= f64::max(*count, 1.0));
    }
    let weights: Vec<f64> = counts.iter().map(|count| count / y.len() as f64).collect();
    let of_class: Vec<f64> = (means.iter())
        .map(|mean| mean.iter().sum::<f64>() / others as f64)
        .collect();
    let of_other: Vec<f64> = (0..others)
        .map(|q| {
            weights
                .iter()
                .zip(&means)
                .map(|(w, mean)| w * mean[q])
                .sum()
        })
        .collect();
    let grand: f64 = weights.iter().zip(&of_class).map(|(w, m)| w * m).sum();
    let (mut between, mut interaction) = (0.0, 0.0);
    for ((weight, mean), own) in weights.iter().zip(&means).zip(&of_class) {
        between += weight * (own - grand).powi(2);
        for (value, of_other) in mean.iter().zip(&of_other) {
            interaction += weight * (value - own - of_other + grand).powi(2);
        }
    }
    let chance = interaction / (others - 1) as f64 / others as f64;
    Some(((between - chance) / whole).clamp(0.0, 1.0))
}

/// Estimates the first-order Sobol index of a key that is drawn. Every point q of a grid or a list repeats each random
/// draw p. One sample is the mean of a draw over all points q. The function has the same arguments as
/// [`crossed_share`].
pub fn drawn_share(classes: &[usize], y: &[Vec<f64>], whole: f64) -> Option<f64> {
    let means: Vec<f64> = (y.iter())
        .map(|of_point| of_point.iter().sum::<f64>() / of_point.len().max(1) as f64)
        .collect();
    let share = first_order_index(classes, &means)?;
    (whole > 0.0).then(|| (share * variance(&means) / whole).clamp(0.0, 1.0))
}

/// Returns the absolute rank correlation that `count` independent samples exceed in only 5 of 100 cases.
pub fn rank_threshold(count: usize) -> f64 {
    1.96 / (count.max(2) as f64 - 1.0).sqrt()
}

/// Returns the share that a key without influence exceeds in only 5 of 100 samples. With k = √n classes, the standard
/// deviation of the share is √(2k)/n.
pub fn share_threshold(count: usize) -> f64 {
    1.645 * 2.0_f64.sqrt() * (count.max(1) as f64).powf(-0.75)
}

/// Assigns classes to the values of a numerical key. Few distinct values become one class each; more are divided into
/// √n classes of equally many distinct values.
pub fn classes(x: &[f64]) -> Vec<usize> {
    let mut sorted = x.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.dedup();
    let wanted = (x.len() as f64).sqrt().ceil() as usize;
    let place = |x: &f64| sorted.partition_point(|other| other.total_cmp(x).is_lt());
    if sorted.len() <= wanted {
        return x.iter().map(place).collect();
    }
    // Divide the distinct values, so that equal values share a class.
    x.iter().map(|x| place(x) * wanted / sorted.len()).collect()
}

/// Interpolates a curve linearly at `x`. The abscissae ascend. Returns `None` outside of the curve.
pub fn interpolate(course: &[[f64; 2]], x: f64) -> Option<f64> {
    let after = course.partition_point(|point| point[0] < x);
    let &[x1, y1] = course.get(after)?;
    if x1 == x {
        return Some(y1);
    }
    let &[x0, y0] = course.get(after.checked_sub(1)?)?;
    Some(y0 + (y1 - y0) * (x - x0) / (x1 - x0))
}
