//! Straight line that approximates the motion of a joint over a cycle, and the deviation of the motion from the line.

use super::Sampling;

/// Line between the two samples of a cycle that are farthest apart, in the x and y displacements of all elements.
///
/// Distances are root mean squares over the area of the elements. A joint that only turns about its normal has such a
/// line, although the mean displacement of the joint is constant.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Samples at both ends.
    pub ends: [usize; 2],
    /// Half of the distance between the ends \[m\].
    pub half_length: f64,
    /// Displacement of each element from the middle of the line to the first end, along x and y, divided by the reach.
    /// The direction is 0 without motion.
    pub direction: Vec<[f64; 2]>,
    /// Largest distance of the motion from the line, or largest reversal between the ends of the line, divided by the
    /// reach. The deviation is 0 without motion.
    pub largest_deviation: f64,
}

impl Line {
    /// Computes the line of the motion of elements. `share` contains the share of each element in the area of the
    /// joint.
    ///
    /// `displacement` has three rows of coefficients per element \[m\]. The function ignores any rows after the rows of
    /// the elements.
    pub fn of(share: &[f64], displacement: &[f64], sampling: &Sampling) -> Self {
        let count = sampling.harmonics().coefficients();
        let samples = sampling.samples();
        // Scalar products of displacements follow from the basis functions: all elements together define a metric for
        // the coefficients.
        let mut metric = vec![0.0; count * count];
        for (share, rows) in share.iter().zip(displacement.chunks(3 * count)) {
            for row in rows[..2 * count].chunks(count) {
                for (a, metric_row) in row.iter().zip(metric.chunks_mut(count)) {
                    let scaled = share * a;
                    metric_row
                        .iter_mut()
                        .zip(row)
                        .for_each(|(sum, b)| *sum += scaled * b);
                }
            }
        }
        let turn = std::f64::consts::TAU;
        let at = |k: usize| {
            let theta = turn * k as f64 / samples as f64;
            sampling.harmonics().basis(theta)
        };
        let basis: Vec<Vec<f64>> = (0..samples).map(at).collect();
        let image = |v: &[f64]| -> Vec<f64> { metric.chunks(count).map(|m| dot(m, v)).collect() };
        let images: Vec<Vec<f64>> = basis.iter().map(|v| image(v)).collect();
        let square: Vec<f64> = (0..samples).map(|k| dot(&basis[k], &images[k])).collect();
        let (mut largest, mut ends) = (0.0, [0, 0]);
        for a in 0..samples {
            for b in a + 1..samples {
                let square_distance = square[a] + square[b] - 2.0 * dot(&basis[a], &images[b]);
                if square_distance > largest {
                    (largest, ends) = (square_distance, [a, b]);
                }
            }
        }
        let reach = 0.5 * largest.sqrt();
        if reach == 0.0 {
            return Line {
                ends,
                half_length: reach,
                direction: vec![[0.0; 2]; share.len()],
                largest_deviation: 0.0,
            };
        }
        let halves = |sign: f64| -> Vec<f64> {
            let pairs = basis[ends[0]].iter().zip(&basis[ends[1]]);
            pairs.map(|(a, b)| 0.5 * (a + sign * b)).collect()
        };
        let (middle, end) = (halves(1.0), halves(-1.0));
        let end_image = image(&end);
        let mut along = Vec::with_capacity(samples);
        let mut departure = 0.0_f64;
        for v in &basis {
            let offset: Vec<f64> = v.iter().zip(&middle).map(|(v, m)| v - m).collect();
            let a = dot(&offset, &end_image) / (reach * reach);
            let transverse: Vec<f64> = offset.iter().zip(&end).map(|(f, e)| f - a * e).collect();
            let deviation = dot(&transverse, &image(&transverse)).max(0.0).sqrt() / reach;
            departure = departure.max(deviation);
            along.push(a);
        }
        for ([from, to], sign) in [(ends, -1.0), ([ends[1], ends[0]], 1.0)] {
            let mut farthest = f64::NEG_INFINITY;
            for step in 0..=(to + samples - from) % samples {
                let a = sign * along[(from + step) % samples];
                farthest = farthest.max(a);
                departure = departure.max(farthest - a);
            }
        }
        let rows = displacement.chunks(3 * count).take(share.len());
        let direction =
            rows.map(|rows| [0, 1].map(|d| dot(&rows[d * count..][..count], &end) / reach));
        Line {
            ends,
            half_length: reach,
            direction: direction.collect(),
            largest_deviation: departure,
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
