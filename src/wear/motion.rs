//! The motion of one vibration cycle: what drives the bodies in the plane, and the total normal load, against time.

use super::nodal_motion::NodalMotion;
use crate::contact::tangential::Drive;
use crate::grid::ByAxis;

/// Two loads or displacements this close, relative to the largest, are the same: rounding of cosines.
pub(super) const SAME: f64 = 1e-12;

/// One closed cycle, by samples: sample 0 is at t = 0, and the cycle returns to it at t = T.
///
/// A joint that does not move has no axis and one sample of the load.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    /// Time of each sample as a part of the period, increasing from 0 and below 1.
    pub time: Vec<f64>,
    /// Whether the samples are places on a way of which only the order counts, as those of a history, whatever their times; else the motion
    /// is smooth in time.
    pub by_order: bool,
    /// What moves the upper body along each axis.
    pub drive: ByAxis<Channel>,
    /// What turns it about z through the grid's centre; none: nothing, without storage. Needs both axes.
    pub rotation: Option<Channel>,
    /// Total normal load \[N\].
    pub normal_load: Vec<f64>,
    /// Static load, about which `normal_load` varies \[N\]: that of the contact, or the mean of the samples of a history with loads of its own or of a
    /// computed motion. What is made of a motion keeps it.
    pub mean_load: f64,
    /// What cells move along the axes on top of that; none: all move alike, without storage.
    pub own: Option<NodalMotion>,
}

/// What is given of a rigid motion, at every sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Channel {
    /// Relative displacement \[m\], or rotation \[rad\].
    Displacement(Vec<f64>),
    /// Force on the joint \[N\], or moment \[N m\]. Zero throughout leaves the direction free.
    Force(Vec<f64>),
}

impl Channel {
    /// The samples.
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

    /// True if the force or moment is given.
    pub fn is_force(&self) -> bool {
        matches!(self, Channel::Force(_))
    }

    /// True unless all samples are zero.
    pub fn moves(&self) -> bool {
        self.values().iter().any(|v| *v != 0.0)
    }

    /// The drive of a step between two of its values.
    fn between(&self, from: f64, to: f64) -> Drive {
        match self {
            Channel::Displacement(_) => Drive::Displacement(to - from),
            Channel::Force(_) => Drive::Force(to),
        }
    }
}

/// What drives one step.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Along each axis.
    pub drive: ByAxis<Drive>,
    /// About z.
    pub rotation: Option<Drive>,
    /// What cells are displaced by on top, one field an axis \[m\].
    pub offset: Option<ByAxis<Vec<f64>>>,
}

impl Step {
    /// Displaces cells by this, on top \[m\].
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

/// A motion along a straight line that only turns at its two ends, under constant load and about zero.
#[derive(Debug, Clone, PartialEq)]
pub struct StraightMotion {
    /// The state of the motion at the end that is reached at `top`, as [`Motion::at`] has it; the other end is its negative.
    pub end: Vec<f64>,
    /// Sample of that end.
    pub top: usize,
    /// Sample of the other end.
    pub bottom: usize,
}

/// The mean of samples, of which there is one at least: exactly that of samples that are all the same.
pub(crate) fn mean_of(samples: &[f64]) -> f64 {
    let first = samples[0];
    first + samples.iter().map(|sample| sample - first).sum::<f64>() / samples.len() as f64
}

impl Motion {
    /// A joint that only bears a load.
    pub fn none(load: f64) -> Self {
        Motion {
            time: vec![0.0],
            by_order: false,
            drive: Vec::new(),
            rotation: None,
            normal_load: vec![load],
            mean_load: load,
            own: None,
        }
    }

    /// This motion under a load whose mean is `load`: the rest of it stays as it is.
    pub fn with_mean_load(mut self, load: f64) -> Motion {
        let shift = load - self.mean_load;
        self.normal_load.iter_mut().for_each(|n| *n += shift);
        self.mean_load = load;
        self
    }

    /// This motion with a sample in the middle between any two, on the straight line between them.
    pub fn halved(&self) -> Motion {
        let halve = |series: &Vec<f64>| with_middles(series, series[0]);
        Motion {
            time: with_middles(&self.time, 1.0),
            by_order: self.by_order,
            drive: self.drive.iter().map(|c| c.map(halve)).collect(),
            rotation: self.rotation.as_ref().map(|c| c.map(halve)),
            normal_load: halve(&self.normal_load),
            mean_load: self.mean_load,
            own: self.own.as_ref().map(NodalMotion::halved),
        }
    }

    /// This motion with the middles of its samples, of those, and so on, until it has at least `samples`.
    pub fn refined(self, samples: usize) -> Motion {
        let mut motion = self;
        while motion.samples() < samples {
            motion = motion.halved();
        }
        motion
    }

    /// Every `step`-th sample, from the first on.
    pub fn every(&self, step: usize) -> Motion {
        let thin = |series: &Vec<f64>| series.iter().copied().step_by(step).collect();
        Motion {
            time: thin(&self.time),
            by_order: self.by_order,
            drive: self.drive.iter().map(|channel| channel.map(thin)).collect(),
            rotation: self.rotation.as_ref().map(|channel| channel.map(thin)),
            normal_load: thin(&self.normal_load),
            mean_load: self.mean_load,
            own: self.own.as_ref().map(|own| own.every(step)),
        }
    }

    /// This motion with the middle of its range at zero, axis by axis: where a cycle is about is lost in the steady state but
    /// for shear that is locked in by the way there.
    pub fn about_its_middle(mut self) -> Motion {
        let displaced = self.drive.iter_mut().filter(|channel| !channel.is_force());
        for series in displaced.map(Channel::values_mut) {
            let (least, most) = range(series);
            let middle = 0.5 * (least + most);
            series.iter_mut().for_each(|d| *d -= middle);
        }
        self.own = self.own.as_ref().map(NodalMotion::about_its_middle);
        self
    }

    /// The two reversals of this motion about their middle, under its mean load, if that is what it amounts to: every sample lies
    /// within `tolerance` of the reach from the line between the ends, the motion turns by no more than that anywhere else, and
    /// the load stays within `of_load` of its mean. Of displacements along the axes alone.
    pub fn reversals(&self, tolerance: f64, of_load: f64) -> Option<Motion> {
        if self.rotation.is_some() || self.drive.iter().any(Channel::is_force) {
            return None;
        }
        let n = self.samples();
        let mean = self.mean_load;
        if self
            .normal_load
            .iter()
            .any(|load| (load - mean).abs() > of_load * mean.abs())
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
        Some(self.between_ends([top, bottom]))
    }

    /// The motion to and fro between these samples about their middle, under the mean load of this one. Of displacements along the axes
    /// alone.
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
            own: self.own.as_ref().map(|own| own.ends(top, bottom)),
        }
    }

    /// The two samples that are farthest apart along the axis of the larger range; none of a motion without axes.
    fn widest_ends(&self) -> Option<[usize; 2]> {
        let axes = self.drive.iter().map(Channel::values);
        let series = axes.max_by(|a, b| extent(a).total_cmp(&extent(b)))?;
        let by_value = |a: &usize, b: &usize| series[*a].total_cmp(&series[*b]);
        let top = (0..series.len()).max_by(by_value)?;
        let bottom = (0..series.len()).min_by(by_value)?;
        Some([top, bottom])
    }

    /// Half of what lies between two samples, along the axes.
    fn end(&self, [top, bottom]: [usize; 2]) -> ByAxis<f64> {
        let axes = self.drive.iter().map(Channel::values);
        axes.map(|s| 0.5 * (s[top] - s[bottom])).collect()
    }

    /// What the joint carries along its motion under this `shear` \[Pa\], of cells of this area \[m²\]: along the direction of each node where
    /// nodes move on their own, else along the line between the ends of the motion \[N\].
    pub fn force_along(&self, shear: &ByAxis<Vec<f64>>, cell_area: f64) -> f64 {
        if let Some(own) = &self.own {
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

    /// What a cycle between two reversals under the mean load leaves out of the work of friction by the variation of the load, relative to
    /// it, if all slid all the way: of first order where the load has twice the frequency.
    pub fn reversal_energy_error(&self) -> f64 {
        let (mean, samples) = (self.mean_load, self.samples());
        let (mut work, mut varied) = (0.0, 0.0);
        for k in 0..samples {
            let next = (k + 1) % samples;
            let moved = self.drive.iter().map(Channel::values);
            let path = moved.map(|s| (s[next] - s[k]).powi(2)).sum::<f64>().sqrt();
            work += mean * path;
            varied += (0.5 * (self.normal_load[k] + self.normal_load[next]) - mean) * path;
        }
        if work > 0.0 {
            (varied / work).abs()
        } else {
            0.0
        }
    }

    /// Number of samples of the cycle.
    pub fn samples(&self) -> usize {
        self.normal_load.len()
    }

    /// Time of a sample as a part of the period; sample n is at 1.
    pub fn time_of(&self, sample: usize) -> f64 {
        self.time.get(sample).copied().unwrap_or(1.0)
    }

    /// The channels: along the axes, then that of the rotation if there is one.
    pub fn channels(&self) -> impl Iterator<Item = &Channel> {
        self.drive.iter().chain(&self.rotation)
    }

    /// The state of the motion at a sample: values of the channels, then what the nodes move on their own. Sample n is sample 0
    /// again.
    pub fn at(&self, sample: usize) -> Vec<f64> {
        let k = sample % self.samples();
        let channels = self.channels().map(|channel| channel.values()[k]);
        let own = self.own.iter().flat_map(|own| &own.displacement[k]);
        channels.chain(own.copied()).collect()
    }

    /// What drives a step between two states of the motion: along the axes, about z, and what cells are displaced by on top.
    pub fn between(&self, from: &[f64], to: &[f64]) -> Step {
        let axes = self.drive.len();
        let drive = |(k, channel): (usize, &Channel)| channel.between(from[k], to[k]);
        let channels = self.channels().count();
        let own = self.own.as_ref();
        Step {
            drive: self.drive.iter().enumerate().map(drive).collect(),
            rotation: self.rotation.as_ref().map(|channel| drive((axes, channel))),
            offset: own.map(|own| own.between(&from[channels..], &to[channels..])),
        }
    }

    /// True if the second half of the cycle, of every `stride`-th sample, is the first with all signs turned, under constant load.
    pub fn is_antiperiodic(&self, stride: usize) -> bool {
        let n = self.samples();
        let constant =
            self.constant_load() && self.own.as_ref().is_none_or(NodalMotion::has_constant_load);
        let whole = self.at(0).len();
        let reach = (0..n).map(|k| self.at(k));
        let reach = reach.fold(vec![0.0f64; whole], |reach, at| {
            let both = reach.iter().zip(&at);
            both.map(|(r, v)| r.max(v.abs())).collect()
        });
        constant
            && n.is_multiple_of(2 * stride)
            && (0..n / 2).all(|k| {
                let [now, then] = [k, k + n / 2].map(|k| self.at(k));
                let mut opposite = now.iter().zip(&then).zip(&reach);
                (self.time[k + n / 2] - self.time[k] - 0.5).abs() <= SAME
                    && opposite.all(|((a, b), reach)| (a + b).abs() <= SAME * reach)
            })
    }

    /// Largest normal load of the cycle \[N\]; the mean one where it never changes.
    pub fn largest_load(&self) -> f64 {
        match self.constant_load() {
            true => self.mean_load,
            false => self.normal_load.iter().fold(0.0, |m: f64, n| m.max(*n)),
        }
    }

    /// True if the normal load never changes.
    pub fn constant_load(&self) -> bool {
        let mean = self.mean_load;
        self.normal_load
            .iter()
            .all(|n| (n - mean).abs() <= SAME * mean.abs())
    }

    /// The ends of the motion, if it is straight, about zero, turns at its ends only, and the load is constant.
    pub fn straight(&self) -> Option<StraightMotion> {
        if !self.constant_load() || self.own.as_ref().is_some_and(|own| !own.is_straight()) {
            return None;
        }
        let scales = self.scales();
        let scaled = |k: usize| -> Vec<f64> {
            let values = self.at(k).into_iter().zip(&scales);
            values.map(|(value, scale)| value * scale).collect()
        };
        let size = |k: usize| scaled(k).iter().map(|d| d * d).sum::<f64>().sqrt();
        let top =
            (0..self.samples()).fold(0, |best, k| if size(k) > size(best) { k } else { best });
        let end = scaled(top);
        let reach = size(top);
        if reach == 0.0 {
            return Some(StraightMotion {
                end: self.at(top),
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
        (straight && centred && turns_at_ends).then(|| StraightMotion {
            end: self.at(top),
            top,
            bottom,
        })
    }
    /// Factors that make a rotation comparable with displacements: 1 but for that of a rotation beside something that moves.
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

/// Least and largest of a series.
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

/// A series with the middle of any two of its values between them; that of the last is towards `next`.
pub(super) fn with_middles(series: &[f64], next: f64) -> Vec<f64> {
    let after = series.iter().skip(1).chain([&next]);
    series
        .iter()
        .zip(after)
        .flat_map(|(a, b)| [*a, 0.5 * (a + b)])
        .collect()
}
