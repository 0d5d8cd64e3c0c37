//! The motion of one vibration cycle: relative displacement of the bodies and total normal load against time.

use std::f64::consts::TAU;

use crate::grid::ByAxis;

/// Two loads or displacements this close, relative to the largest, are the same: rounding of cosines.
const SAME: f64 = 1e-12;

/// One closed cycle, by samples: sample 0 is at t = 0, and the cycle returns to it at t = T.
///
/// A joint that does not move has no axis and one sample of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Time of each sample as a part of the period, increasing from 0 and below 1.
    pub time: Vec<f64>,
    /// Relative displacement of the upper body, one series an axis \[m\].
    pub displacement: ByAxis<Vec<f64>>,
    /// Total normal load \[N\].
    pub normal_load: Vec<f64>,
}

/// A motion along a straight line that only turns at its two ends, under constant load and about zero.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightMotion {
    /// Displacement at the end that is reached at `top` \[m\]; the other end is its negative.
    pub end: ByAxis<f64>,
    /// Sample of that end.
    pub top: usize,
    /// Sample of the other end.
    pub bottom: usize,
}

impl Motion {
    /// Harmonic motion `amplitude · cos(2πt/T + phase)` along each axis, under `load + load_amplitude · cos(2πt/T)`: equally
    /// spaced samples, and the two ends of a motion whose axes turn together.
    pub fn harmonic(axes: &[(f64, f64)], load: f64, load_amplitude: f64, samples: usize) -> Self {
        let mut time: Vec<f64> = (0..samples).map(|k| k as f64 / samples as f64).collect();
        let moving: Vec<f64> = axes
            .iter()
            .filter(|axis| axis.0 != 0.0)
            .map(|axis| axis.1 / TAU)
            .collect();
        if let Some(&first) = moving.first()
            && moving
                .iter()
                .all(|phase| (2.0 * (phase - first)).rem_euclid(1.0) <= SAME)
        {
            for end in [-first, 0.5 - first] {
                let end = end.rem_euclid(1.0);
                if end < 1.0 - SAME && time.iter().all(|t| (t - end).abs() > SAME) {
                    time.push(end);
                }
            }
            time.sort_by(f64::total_cmp);
        }
        let series = |amplitude: f64, phase: f64| {
            time.iter()
                .map(|t| amplitude * (TAU * t + phase).cos())
                .collect()
        };
        Motion {
            displacement: axes
                .iter()
                .map(|&(amplitude, phase)| series(amplitude, phase))
                .collect(),
            normal_load: time
                .iter()
                .map(|t| load + load_amplitude * (TAU * t).cos())
                .collect(),
            time,
        }
    }

    /// A joint that only bears a load.
    pub fn none(load: f64) -> Self {
        Motion {
            time: vec![0.0],
            displacement: Vec::new(),
            normal_load: vec![load],
        }
    }

    /// Every `step`-th sample, from the first on.
    pub fn every(&self, step: usize) -> Motion {
        let thin = |series: &Vec<f64>| series.iter().copied().step_by(step).collect();
        Motion {
            time: thin(&self.time),
            displacement: self.displacement.iter().map(thin).collect(),
            normal_load: thin(&self.normal_load),
        }
    }

    /// The same motion with the middle of its range at zero, axis by axis: where a cycle is about is lost in the steady state but
    /// for shear that is locked in by the way there.
    pub fn about_its_middle(mut self) -> Motion {
        for series in &mut self.displacement {
            let (least, most) = range(series);
            let middle = 0.5 * (least + most);
            series.iter_mut().for_each(|d| *d -= middle);
        }
        self
    }

    /// The two reversals of this motion about their middle, under its mean load, if that is what it amounts to: every sample lies
    /// within `tolerance` of the reach from the line between the ends, the motion turns by no more than that anywhere else, and
    /// the load stays within `tolerance` of its mean.
    pub fn reversals(&self, tolerance: f64) -> Option<Motion> {
        let n = self.samples();
        let mean = self.mean_load();
        if self
            .normal_load
            .iter()
            .any(|load| (load - mean).abs() > tolerance * mean.abs())
        {
            return None;
        }
        // The ends: the two samples farthest apart along the axis of the larger range.
        let ranges: Vec<(f64, f64)> = self
            .displacement
            .iter()
            .map(|series| range(series))
            .collect();
        let widest = (0..ranges.len()).max_by(|&a, &b| {
            let width = |axis: usize| ranges[axis].1 - ranges[axis].0;
            width(a).total_cmp(&width(b))
        })?;
        let series = &self.displacement[widest];
        let top = (0..n).max_by(|&a, &b| series[a].total_cmp(&series[b]))?;
        let bottom = (0..n).min_by(|&a, &b| series[a].total_cmp(&series[b]))?;
        let end: ByAxis<f64> = self
            .displacement
            .iter()
            .map(|s| 0.5 * (s[top] - s[bottom]))
            .collect();
        let middle: ByAxis<f64> = self
            .displacement
            .iter()
            .map(|s| 0.5 * (s[top] + s[bottom]))
            .collect();
        let reach = end.iter().map(|e| e * e).sum::<f64>().sqrt();
        if reach > 0.0 {
            let mut along = Vec::with_capacity(n);
            for k in 0..n {
                let from: Vec<f64> = self.at(k).iter().zip(&middle).map(|(d, m)| d - m).collect();
                let a = from.iter().zip(&end).map(|(d, e)| d * e).sum::<f64>() / reach;
                let across = from
                    .iter()
                    .zip(&end)
                    .map(|(d, e)| (d - a * e / reach).powi(2))
                    .sum::<f64>();
                if across.sqrt() > tolerance * reach {
                    return None;
                }
                along.push(a);
            }
            // Walking from one end to the other, nowhere back by more than the tolerance.
            let one_way = |from: usize, to: usize, sign: f64| {
                let mut farthest = f64::NEG_INFINITY;
                (0..=(to + n - from) % n).all(|step| {
                    let a = sign * along[(from + step) % n];
                    farthest = farthest.max(a);
                    farthest - a <= tolerance * reach
                })
            };
            if !(one_way(bottom, top, 1.0) && one_way(top, bottom, -1.0)) {
                return None;
            }
        }
        Some(Motion {
            time: vec![0.0, 0.5],
            displacement: end.iter().map(|e| vec![*e, -e]).collect(),
            normal_load: vec![mean; 2],
        })
    }

    /// Number of samples of the cycle.
    pub fn samples(&self) -> usize {
        self.normal_load.len()
    }

    /// Time of a sample as a part of the period; sample n is at 1.
    pub fn time_of(&self, sample: usize) -> f64 {
        self.time.get(sample).copied().unwrap_or(1.0)
    }

    /// Displacement at a sample; sample n is sample 0 again.
    pub fn at(&self, sample: usize) -> ByAxis<f64> {
        let k = sample % self.samples();
        self.displacement.iter().map(|series| series[k]).collect()
    }

    /// Mean normal load over the cycle \[N\].
    pub fn mean_load(&self) -> f64 {
        self.normal_load.iter().sum::<f64>() / self.samples() as f64
    }

    /// True if the normal load never changes.
    pub fn constant_load(&self) -> bool {
        let mean = self.mean_load();
        self.normal_load
            .iter()
            .all(|n| (n - mean).abs() <= SAME * mean.abs())
    }

    /// The ends of the motion, if it is straight, about zero, turns at its ends only, and the load is constant.
    pub fn straight(&self) -> Option<StraightMotion> {
        if !self.constant_load() {
            return None;
        }
        let size = |k: usize| self.at(k).iter().map(|d| d * d).sum::<f64>().sqrt();
        let top =
            (0..self.samples()).fold(0, |best, k| if size(k) > size(best) { k } else { best });
        let end = self.at(top);
        let reach = size(top);
        if reach == 0.0 {
            return Some(StraightMotion {
                end,
                top: 0,
                bottom: self.samples() / 2,
            });
        }
        let along = |k: usize| self.at(k).iter().zip(&end).map(|(d, e)| d * e).sum::<f64>() / reach;
        let straight = (0..self.samples()).all(|k| {
            let across: f64 = self
                .at(k)
                .iter()
                .zip(&end)
                .map(|(d, e)| (d - along(k) * e / reach).powi(2))
                .sum();
            across.sqrt() <= SAME * reach
        });
        let bottom =
            (0..self.samples()).fold(top, |best, k| if along(k) < along(best) { k } else { best });
        let centred = (along(bottom) + reach).abs() <= SAME * reach;
        let n = self.samples();
        let falls = |from: usize, to: usize, sign: f64| {
            let steps = (to + n - from) % n;
            (0..steps)
                .all(|s| sign * (along((from + s + 1) % n) - along((from + s) % n)) <= SAME * reach)
        };
        let turns_at_ends = falls(top, bottom, 1.0) && falls(bottom, top, -1.0);
        (straight && centred && turns_at_ends).then_some(StraightMotion { end, top, bottom })
    }
}

/// Least and largest of a series.
fn range(series: &[f64]) -> (f64, f64) {
    series
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &d| {
            (least.min(d), most.max(d))
        })
}
