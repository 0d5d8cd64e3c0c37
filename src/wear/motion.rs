//! Motion of one vibration cycle: the in-plane drive of the bodies and the total normal load, against time.

use super::nodal_motion::NodalMotion;
use crate::contact::tangential::Drive;
use crate::grid::ByAxis;

/// Relative tolerance at which two loads or displacements count as equal, to allow for the rounding of
/// cosines.
pub(super) const EQUALITY_TOLERANCE: f64 = 1e-12;

/// One closed cycle in samples. Sample 0 is at t = 0, and the cycle returns to it at t = T.
///
/// A joint that does not move has no axis and one sample of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Time of each sample as a fraction of the period, increasing from 0 and below 1.
    pub time: Vec<f64>,
    /// True if only the order of the samples counts, whatever their times, as in a history. False if the motion is
    /// smooth in time.
    pub by_order: bool,
    /// Drive of the upper body along each axis.
    pub drive: ByAxis<Channel>,
    /// Rotation of the upper body about z through the grid's centre. It needs both axes. `None` takes no
    /// storage.
    pub rotation: Option<Channel>,
    /// Total normal load \[N\].
    pub normal_load: Vec<f64>,
    /// Static load about which `normal_load` varies \[N\]: the load of the contact. The static load of a history with a
    /// varying load is the mean over the samples. The static load of a computed motion is also the mean over the
    /// samples. A motion that is derived from another motion, for example with more samples, has the `mean_load` of the
    /// original motion.
    pub mean_load: f64,
    /// Motion of the cells along the axes in addition to the rigid drive. `None` (all cells move alike) takes
    /// no storage.
    pub nodal_motion: Option<NodalMotion>,
}

/// Prescribed component of a rigid motion, at every sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Channel {
    /// Relative displacement \[m\], or rotation \[rad\].
    Displacement(Vec<f64>),
    /// Force on the joint \[N\], or moment \[N m\]. If all samples are zero, the direction is free.
    Force(Vec<f64>),
}

impl Channel {
    /// Returns the samples.
    pub fn values(&self) -> &Vec<f64> {
        match self {
            Channel::Displacement(values) | Channel::Force(values) => values,
        }
    }

    fn values_mut(&mut self) -> &mut Vec<f64> {
        match self {
            Channel::Displacement(values) | Channel::Force(values) => values,
        }
    }

    fn map(&self, change: impl FnOnce(&Vec<f64>) -> Vec<f64>) -> Channel {
        match self {
            Channel::Displacement(values) => Channel::Displacement(change(values)),
            Channel::Force(values) => Channel::Force(change(values)),
        }
    }

    /// Returns true if the force or moment is prescribed.
    pub fn is_force(&self) -> bool {
        matches!(self, Channel::Force(_))
    }

    /// Returns true unless all samples are zero.
    pub fn moves(&self) -> bool {
        self.values().iter().any(|v| *v != 0.0)
    }

    /// Returns the drive of a step in which the channel changes from the value `from` to the value `to`.
    fn between(&self, from: f64, to: f64) -> Drive {
        match self {
            Channel::Displacement(_) => Drive::Displacement(to - from),
            Channel::Force(_) => Drive::Force(to),
        }
    }
}

/// Drive of one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Drive along each axis.
    pub drive: ByAxis<Drive>,
    /// Drive about z.
    pub rotation: Option<Drive>,
    /// Additional displacement of the cells, one field per axis \[m\].
    pub offset: Option<ByAxis<Vec<f64>>>,
}

impl Step {
    /// Adds a displacement of the cells \[m\].
    pub(super) fn displace(&mut self, by: ByAxis<Vec<f64>>) {
        match &mut self.offset {
            None => self.offset = Some(by),
            Some(offset) => {
                let values = offset.iter_mut().flatten().zip(by.iter().flatten());
                values.for_each(|(value, by)| *value += by);
            }
        }
    }
}

/// Motion along a straight line about zero that turns only at its two ends, under constant load.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightMotion {
    /// State of the motion at sample `top`, one of the two ends, as in [`Motion::state_at`]. At sample `bottom`, the
    /// opposite end, the state of the motion is the negative of `end`.
    pub end: Vec<f64>,
    /// Sample at which the motion reaches the end with the state `end`.
    pub top: usize,
    /// Sample at which the motion reaches the end with the state −`end`.
    pub bottom: usize,
}

/// Returns the mean of at least one sample. The mean is exact for equal samples.
pub(crate) fn mean_of(samples: &[f64]) -> f64 {
    let first = samples[0];
    first + samples.iter().map(|sample| sample - first).sum::<f64>() / samples.len() as f64
}

impl Motion {
    /// Returns the motion of a joint that only bears a load.
    pub fn at_rest(load: f64) -> Self {
        Motion {
            time: vec![0.0],
            by_order: false,
            drive: Vec::new(),
            rotation: None,
            normal_load: vec![load],
            mean_load: load,
            nodal_motion: None,
        }
    }

    /// Shifts the normal load so that its mean is `load`. The variation of the load stays.
    pub fn with_mean_load(mut self, load: f64) -> Motion {
        let shift = load - self.mean_load;
        self.normal_load.iter_mut().for_each(|n| *n += shift);
        self.mean_load = load;
        self
    }

    /// Returns the motion with additional samples: a linearly interpolated sample midway between any two neighbouring
    /// samples.
    pub fn with_midpoints(&self) -> Motion {
        let halve = |series: &Vec<f64>| with_middles(series, series[0]);
        Motion {
            time: with_middles(&self.time, 1.0),
            by_order: self.by_order,
            drive: self.drive.iter().map(|c| c.map(halve)).collect(),
            rotation: self.rotation.as_ref().map(|c| c.map(halve)),
            normal_load: halve(&self.normal_load),
            mean_load: self.mean_load,
            nodal_motion: self.nodal_motion.as_ref().map(NodalMotion::halved),
        }
    }

    /// Halves the sample spacing of the motion until the motion has at least `samples` samples.
    pub fn refined(self, samples: usize) -> Motion {
        let mut motion = self;
        while motion.samples() < samples {
            motion = motion.with_midpoints();
        }
        motion
    }

    /// Returns every `step`-th sample, starting with the first.
    pub fn thinned(&self, step: usize) -> Motion {
        let thin = |series: &Vec<f64>| series.iter().copied().step_by(step).collect();
        Motion {
            time: thin(&self.time),
            by_order: self.by_order,
            drive: self.drive.iter().map(|channel| channel.map(thin)).collect(),
            rotation: self.rotation.as_ref().map(|channel| channel.map(thin)),
            normal_load: thin(&self.normal_load),
            mean_load: self.mean_load,
            nodal_motion: self.nodal_motion.as_ref().map(|own| own.every(step)),
        }
    }

    /// Shifts the middle of each axis' range to zero. The steady state does not depend on the middle, except
    /// for shear that the way to the cycle locks in.
    pub fn about_its_middle(mut self) -> Motion {
        let displaced = self.drive.iter_mut().filter(|channel| !channel.is_force());
        for series in displaced.map(Channel::values_mut) {
            let (least, most) = range(series);
            let middle = 0.5 * (least + most);
            series.iter_mut().for_each(|d| *d -= middle);
        }
        self.nodal_motion = self
            .nodal_motion
            .as_ref()
            .map(NodalMotion::about_its_middle);
        self
    }

    /// Returns the straight motion between the two reversals of the motion under the mean load. The middle between the
    /// reversals is zero. The reach is half the distance between the reversals. `reversals` returns `None` if the
    /// distance of a sample from the line between the reversals exceeds `tolerance` times the reach. `reversals`
    /// returns `None` if the motion turns back between the reversals by more than `tolerance` times the reach.
    /// `reversals` returns `None` if the load deviates from the mean load by more than the fraction `load_tolerance`.
    /// `reversals` returns `None` for a motion with a rotation or a prescribed force.
    pub fn reversals(&self, tolerance: f64, load_tolerance: f64) -> Option<Motion> {
        if self.rotation.is_some() || self.drive.iter().any(Channel::is_force) {
            return None;
        }
        let n = self.samples();
        let mean = self.mean_load;
        if self
            .normal_load
            .iter()
            .any(|load| (load - mean).abs() > load_tolerance * mean.abs())
        {
            return None;
        }
        let [top, bottom] = self.widest_ends()?;
        let end = self.end([top, bottom]);
        let middle: ByAxis<f64> = self
            .drive
            .iter()
            .map(Channel::values)
            .map(|s| 0.5 * (s[top] + s[bottom]))
            .collect();
        let reach = end.iter().map(|e| e * e).sum::<f64>().sqrt();
        if reach > 0.0 {
            let mut along = Vec::with_capacity(n);
            for k in 0..n {
                let from: Vec<f64> = self
                    .state_at(k)
                    .iter()
                    .zip(&middle)
                    .map(|(d, m)| d - m)
                    .collect();
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
            // Returns true if the motion from the sample `from` to the sample `to` never turns back by more than the
            // tolerance.
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
        Some(self.between_ends([top, bottom]))
    }

    /// Returns the straight motion between the samples `top` and `bottom` under the mean load. The middle between the
    /// two samples is zero. `between_ends` needs a motion that prescribes displacements along the axes.
    #[must_use]
    pub fn between_ends(&self, [top, bottom]: [usize; 2]) -> Motion {
        let end = self.end([top, bottom]);
        Motion {
            time: vec![0.0, 0.5],
            by_order: self.by_order,
            drive: end
                .iter()
                .map(|e| Channel::Displacement(vec![*e, -e]))
                .collect(),
            rotation: None,
            normal_load: vec![self.mean_load; 2],
            mean_load: self.mean_load,
            nodal_motion: self.nodal_motion.as_ref().map(|own| own.ends(top, bottom)),
        }
    }

    /// Returns the two samples that are farthest apart along the axis with the larger range; `None` without
    /// axes.
    fn widest_ends(&self) -> Option<[usize; 2]> {
        let axes = self.drive.iter().map(Channel::values);
        let series = axes.max_by(|a, b| extent(a).total_cmp(&extent(b)))?;
        let by_value = |a: &usize, b: &usize| series[*a].total_cmp(&series[*b]);
        let top = (0..series.len()).max_by(by_value)?;
        let bottom = (0..series.len()).min_by(by_value)?;
        Some([top, bottom])
    }

    /// Returns half the difference between two samples, along the axes.
    fn end(&self, [top, bottom]: [usize; 2]) -> ByAxis<f64> {
        let axes = self.drive.iter().map(Channel::values);
        axes.map(|s| 0.5 * (s[top] - s[bottom])).collect()
    }

    /// Returns the force that the joint carries along its motion under `shear` \[Pa\] on cells of area
    /// `cell_area` \[m²\], in newtons. If nodes move individually, `force_along` sums the forces along each node's
    /// direction. If all nodes move alike, the force is along the line between the ends of the motion.
    pub fn force_along(&self, shear: &ByAxis<Vec<f64>>, cell_area: f64) -> f64 {
        if let Some(own) = &self.nodal_motion {
            return own.force_along(shear, cell_area);
        }
        let end = self.widest_ends().map(|ends| self.end(ends));
        let end = end.unwrap_or_default();
        let way = end.iter().map(|e| e * e).sum::<f64>().sqrt();
        let forces = end.iter().zip(shear);
        let work = forces.map(|(e, q)| e * q.iter().sum::<f64>() * cell_area);
        match way > 0.0 {
            true => work.sum::<f64>() / way,
            false => 0.0,
        }
    }

    /// Returns the relative error of the work of friction in gross slip if reversals under the mean load replace the
    /// motion. The variation of the load causes the error. The error is of first order if the load varies at twice the
    /// frequency of the motion.
    pub fn reversal_energy_error(&self) -> f64 {
        let (mean, samples) = (self.mean_load, self.samples());
        let (mut work, mut varied) = (0.0, 0.0);
        for k in 0..samples {
            let next = (k + 1) % samples;
            let axes = self.drive.iter().map(Channel::values);
            let path = axes.map(|s| (s[next] - s[k]).powi(2)).sum::<f64>().sqrt();
            work += mean * path;
            varied += (0.5 * (self.normal_load[k] + self.normal_load[next]) - mean) * path;
        }
        if work > 0.0 {
            (varied / work).abs()
        } else {
            0.0
        }
    }

    /// Returns the number of samples of the cycle.
    pub fn samples(&self) -> usize {
        self.normal_load.len()
    }

    /// Returns the time of a sample as a fraction of the period. Sample n is at 1.
    pub fn time_of(&self, sample: usize) -> f64 {
        self.time.get(sample).copied().unwrap_or(1.0)
    }

    /// Returns the channels: along the axes, then the rotation if there is one.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.drive.iter().chain(&self.rotation)
    }

    /// Returns the state of the motion at a sample: values of the channels, then the individual motion of the
    /// nodes. Sample n is sample 0.
    pub fn state_at(&self, sample: usize) -> Vec<f64> {
        let k = sample % self.samples();
        let channels = self.channels().map(|channel| channel.values()[k]);
        let own = self
            .nodal_motion
            .iter()
            .flat_map(|own| &own.displacement[k]);
        channels.chain(own.copied()).collect()
    }

    /// Returns the drive of a step between two states of the motion. The drive consists of the motion along the axes,
    /// the rotation about z and the additional displacement of the cells.
    pub fn between(&self, from: &[f64], to: &[f64]) -> Step {
        let axes = self.drive.len();
        let drive = |(k, channel): (usize, &Channel)| channel.between(from[k], to[k]);
        let channels = self.channels().count();
        let own = self.nodal_motion.as_ref();
        Step {
            drive: self.drive.iter().enumerate().map(drive).collect(),
            rotation: self.rotation.as_ref().map(|channel| drive((axes, channel))),
            offset: own.map(|own| own.between(&from[channels..], &to[channels..])),
        }
    }

    /// Returns true if the second half of the cycle is the negative of the first half and the load is constant.
    /// `is_antiperiodic` compares every `stride`-th sample.
    pub fn is_antiperiodic(&self, stride: usize) -> bool {
        let n = self.samples();
        let constant = self.constant_load()
            && self
                .nodal_motion
                .as_ref()
                .is_none_or(NodalMotion::has_constant_load);
        let whole = self.state_at(0).len();
        let reach = (0..n).map(|k| self.state_at(k));
        let reach = reach.fold(vec![0.0f64; whole], |reach, at| {
            let both = reach.iter().zip(&at);
            both.map(|(r, v)| r.max(v.abs())).collect()
        });
        constant
            && n.is_multiple_of(2 * stride)
            && (0..n / 2).all(|k| {
                let [now, then] = [k, k + n / 2].map(|k| self.state_at(k));
                let mut opposite = now.iter().zip(&then).zip(&reach);
                (self.time[k + n / 2] - self.time[k] - 0.5).abs() <= EQUALITY_TOLERANCE
                    && opposite.all(|((a, b), reach)| (a + b).abs() <= EQUALITY_TOLERANCE * reach)
            })
    }

    /// Returns the largest normal load of the cycle \[N\]; the mean load if it never changes.
    pub fn largest_load(&self) -> f64 {
        match self.constant_load() {
            true => self.mean_load,
            false => self.normal_load.iter().fold(0.0, |m: f64, n| m.max(*n)),
        }
    }

    /// Returns true if the normal load never changes.
    pub fn constant_load(&self) -> bool {
        let mean = self.mean_load;
        self.normal_load
            .iter()
            .all(|n| (n - mean).abs() <= EQUALITY_TOLERANCE * mean.abs())
    }

    /// Returns the ends of a straight motion: about zero, turning only at its ends, under constant load.
    /// Otherwise `None`.
    pub fn straight(&self) -> Option<StraightMotion> {
        if !self.constant_load()
            || self
                .nodal_motion
                .as_ref()
                .is_some_and(|own| !own.is_straight())
        {
            return None;
        }
        let scales = self.scales();
        let scaled = |k: usize| -> Vec<f64> {
            let values = self.state_at(k).into_iter().zip(&scales);
            values.map(|(value, scale)| value * scale).collect()
        };
        let size = |k: usize| scaled(k).iter().map(|d| d * d).sum::<f64>().sqrt();
        let top =
            (0..self.samples()).fold(0, |best, k| if size(k) > size(best) { k } else { best });
        let end = scaled(top);
        let reach = size(top);
        if reach == 0.0 {
            return Some(StraightMotion {
                end: self.state_at(top),
                top: 0,
                bottom: self.samples() / 2,
            });
        }
        let along = |k: usize| scaled(k).iter().zip(&end).map(|(d, e)| d * e).sum::<f64>() / reach;
        let straight = (0..self.samples()).all(|k| {
            let across: f64 = scaled(k)
                .iter()
                .zip(&end)
                .map(|(d, e)| (d - along(k) * e / reach).powi(2))
                .sum();
            across.sqrt() <= EQUALITY_TOLERANCE * reach
        });
        let bottom =
            (0..self.samples()).fold(top, |best, k| if along(k) < along(best) { k } else { best });
        let centred = (along(bottom) + reach).abs() <= EQUALITY_TOLERANCE * reach;
        let n = self.samples();
        let is_monotonic = |from: usize, to: usize, sign: f64| {
            let steps = (to + n - from) % n;
            (0..steps).all(|s| {
                sign * (along((from + s + 1) % n) - along((from + s) % n))
                    <= EQUALITY_TOLERANCE * reach
            })
        };
        let turns_at_ends = is_monotonic(top, bottom, 1.0) && is_monotonic(bottom, top, -1.0);
        (straight && centred && turns_at_ends).then(|| StraightMotion {
            end: self.state_at(top),
            top,
            bottom,
        })
    }
    /// Returns factors that make a rotation comparable with displacements. Each is 1, except for a rotation
    /// together with a moving axis.
    fn scales(&self) -> Vec<f64> {
        let largest =
            |channel: &Channel| channel.values().iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let axes = self.drive.iter().map(largest).fold(0.0f64, f64::max);
        let mut scales = vec![1.0; self.drive.len()];
        if let Some(rotation) = self.rotation.as_ref().map(largest) {
            scales.push(if axes > 0.0 && rotation > 0.0 {
                axes / rotation
            } else {
                1.0
            });
        }
        scales
    }
}

/// Returns the smallest and the largest value of a series.
fn range(series: &[f64]) -> (f64, f64) {
    series
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), &d| {
            (least.min(d), most.max(d))
        })
}

pub(super) fn extent(series: &[f64]) -> f64 {
    let (least, most) = range(series);
    most - least
}

/// Inserts the middle between any two values of a series. The last middle is between the last value and
/// `next`.
pub(super) fn with_middles(series: &[f64], next: f64) -> Vec<f64> {
    let after = series.iter().skip(1).chain([&next]);
    series
        .iter()
        .zip(after)
        .flat_map(|(a, b)| [*a, 0.5 * (a + b)])
        .collect()
}
