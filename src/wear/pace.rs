//! How the steps of a motion compare with the steps before them.

use super::motion::{Motion, extent};

/// Ratio of a way to the one before at most: after equal steps (β = 1/3) what a step remembers may be 3, which BDF2 has at a ratio of 6.5.
const LARGEST_PACE: f64 = 6.0;

impl Motion {
    /// Duration of the step between two samples that are `stride` apart, as a part of the period.
    fn duration(&self, sample: usize, stride: usize) -> f64 {
        let k = sample % self.samples();
        self.time_of(k + stride) - self.time[k]
    }

    /// How much faster the bodies move from the sample `k` to the next than in the step before it, between samples that are `stride` apart,
    /// if each step takes as long: the ratio of durations, where the motion is smooth in time, else that of the ways, up to a bound. 0 after
    /// a step in which they rest.
    pub(super) fn pace(&self, k: usize, stride: usize) -> f64 {
        if !self.by_order {
            let before = k + self.samples() - stride;
            return self.duration(k, stride) / self.duration(before, stride);
        }
        let [_, before, after] = self.turn(k, stride);
        if before > 0.0 {
            (after / before).sqrt().min(LARGEST_PACE)
        } else {
            0.0
        }
    }

    /// What the load changes by from a sample to that `stride` later: by its time, where it is smooth in that.
    pub(super) fn load_change(&self, sample: usize, stride: usize) -> f64 {
        if !self.by_order {
            return self.duration(sample, stride);
        }
        let load = |k: usize| self.normal_load[k % self.samples()];
        (load(sample + stride) - load(sample)).abs()
    }

    /// The cosine of the angle between the step that follows sample `k` and the one before it, each between samples that are `stride`
    /// apart: 1 along a line, negative where the motion turns back, 0 where it stands still. Displacements count over the largest of
    /// their ranges, and so do forces, and a rotation over its own.
    pub fn ahead(&self, k: usize, stride: usize) -> f64 {
        let [along, before, after] = self.turn(k, stride);
        if before * after > 0.0 {
            along / (before * after).sqrt()
        } else {
            0.0
        }
    }

    /// Product of the step before sample `k` and the one that follows, and their squares, as [`Self::ahead`] counts them.
    fn turn(&self, k: usize, stride: usize) -> [f64; 3] {
        let n = self.samples();
        let widest = |force: bool| {
            let axes = self.drive.iter().filter(|axis| axis.is_force() == force);
            axes.map(|axis| extent(axis.values())).fold(0.0, f64::max)
        };
        let widths = [widest(false), widest(true)];
        let axes = self.drive.iter();
        let sizes = axes.map(|axis| widths[usize::from(axis.is_force())]);
        let sizes = sizes.chain(self.rotation.iter().map(|r| extent(r.values())));
        let [mut along, mut before, mut after] = [0.0; 3];
        for (channel, size) in self.channels().zip(sizes).filter(|(_, size)| *size > 0.0) {
            let at = |sample: usize| channel.values()[sample % n] / size;
            let (a, b) = (at(k) - at(k + n - stride), at(k + stride) - at(k));
            along += a * b;
            before += a * a;
            after += b * b;
        }
        [along, before, after]
    }
}
