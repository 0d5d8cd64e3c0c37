//! Ratios of successive steps of a motion.

use super::motion::{Motion, extent};

/// Largest ratio of a step's path to the path of the step before. After equal steps (β = 1/3) the next β is
/// at most 3, which BDF2 reaches at a ratio of 6.5.
const LARGEST_STEP_RATIO: f64 = 6.0;

impl Motion {
    /// Returns the duration of the step from one sample to the sample `stride` later, as a fraction of the
    /// period.
    fn duration(&self, sample: usize, stride: usize) -> f64 {
        let k = sample % self.samples();
        self.time_of(k + stride) - self.time[k]
    }

    /// Returns the ratio of the step from sample `k` to the step before it, between samples `stride` apart. If the
    /// motion is smooth in time, `step_ratio` is the ratio of the durations. If only the order of the samples counts,
    /// `step_ratio` is the ratio of the paths, up to a bound. After a step without motion, `step_ratio` is 0.
    pub(super) fn step_ratio(&self, k: usize, stride: usize) -> f64 {
        if !self.by_order {
            let before = k + self.samples() - stride;
            return self.duration(k, stride) / self.duration(before, stride);
        }
        let [_, before, after] = self.turn(k, stride);
        if before > 0.0 {
            (after / before).sqrt().min(LARGEST_STEP_RATIO)
        } else {
            0.0
        }
    }

    /// Returns a measure of the change of the load between `sample` and the sample `sample + stride`. For a motion that
    /// is smooth in time, `load_change` returns the duration between the two samples. For any other motion,
    /// `load_change` returns the change of the load.
    pub(super) fn load_change(&self, sample: usize, stride: usize) -> f64 {
        if !self.by_order {
            return self.duration(sample, stride);
        }
        let load = |k: usize| self.normal_load[k % self.samples()];
        (load(sample + stride) - load(sample)).abs()
    }

    /// Returns the cosine of the angle between the steps before and after sample `k`, between samples
    /// `stride` apart. The cosine is 1 along a line, negative where the motion turns back, and 0 at rest. Displacements
    /// and forces are divided by the largest of their ranges, a rotation by its own.
    pub fn turn_cosine(&self, k: usize, stride: usize) -> f64 {
        let [along, before, after] = self.turn(k, stride);
        if before * after > 0.0 {
            along / (before * after).sqrt()
        } else {
            0.0
        }
    }

    /// Returns the product of the steps before and after sample `k`, and their squares, scaled as in
    /// [`Self::ahead`].
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
