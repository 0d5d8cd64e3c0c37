//! The straight line that the elements of a joint all but follow in a cycle, and how far they leave it.

use super::Sampling;

/// The line between the two samples of a cycle that are farthest apart, in the displacements of all elements along x and y: distances are root
/// mean squares over the area of the elements. A joint that only turns about its normal moves along such a line, although its mean displacement
/// stands still.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Samples of both ends.
    pub ends: [usize; 2],
    /// Half of the way between the ends \[m\].
    pub reach: f64,
    /// What each element is displaced by at the first end from the middle of the line, along x and y, over the reach; 0 if nothing moves.
    pub direction: Vec<[f64; 2]>,
    /// How far the motion leaves the line, or goes back on its way from one end to the other, in parts of the reach; 0 if nothing moves.
    pub departure: f64,
}

impl Line {
    /// Of elements with these shares of the area and this `displacement`: three rows of coefficients an element, of which those along x
    /// and y are read, and nothing after those of the elements \[m\].
    pub fn of(share: &[f64], displacement: &[f64], sampling: &Sampling) -> Self {
        let count = sampling.harmonics().coefficients();
        let samples = sampling.samples();
        // The motion lies in the space of its coefficients: products of displacements are those of the basis in the metric of all elements.
        let mut metric = vec![0.0; count * count];
        for (share, rows) in share.iter().zip(displacement.chunks(3 * count)) {
            for row in rows[..2 * count].chunks(count) {
                for (a, of_row) in row.iter().zip(metric.chunks_mut(count)) {
                    let scaled = share * a;
                    of_row
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
        let (mut most, mut ends) = (0.0, [0, 0]);
        for a in 0..samples {
            for b in a + 1..samples {
                let apart = square[a] + square[b] - 2.0 * dot(&basis[a], &images[b]);
                if apart > most {
                    (most, ends) = (apart, [a, b]);
                }
            }
        }
        let reach = 0.5 * most.sqrt();
        if reach == 0.0 {
            return Line {
                ends,
                reach,
                direction: vec![[0.0; 2]; share.len()],
                departure: 0.0,
            };
        }
        let halves = |sign: f64| -> Vec<f64> {
            let pairs = basis[ends[0]].iter().zip(&basis[ends[1]]);
            pairs.map(|(a, b)| 0.5 * (a + sign * b)).collect()
        };
        let (middle, end) = (halves(1.0), halves(-1.0));
        let across_image = image(&end);
        let mut along = Vec::with_capacity(samples);
        let mut departure = 0.0_f64;
        for v in &basis {
            let from: Vec<f64> = v.iter().zip(&middle).map(|(v, m)| v - m).collect();
            let a = dot(&from, &across_image) / (reach * reach);
            let beside: Vec<f64> = from.iter().zip(&end).map(|(f, e)| f - a * e).collect();
            let across = dot(&beside, &image(&beside)).max(0.0).sqrt() / reach;
            departure = departure.max(across);
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
            reach,
            direction: direction.collect(),
            departure,
        }
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
