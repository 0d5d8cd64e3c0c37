//! A march from sample to sample until the cycle repeats itself.
//!
//! A step of second order takes the slip along the shear at its end not as what a cell moves by in the step, Δv, but as its rate there by
//! the backward difference of two steps: Δv − β Δv', with Δv' of the step before, β = w²/(1 + 2w) and w the ratio of their durations, or
//! of their ways where only the order of places counts (BDF2, [Curtiss and Hirschfelder 1952]). That is an offset of the tangential
//! problem, and is so only where a cell slid in the step before as well: a cell that begins to slip has no rate before it. Where the
//! motion bends, β is reduced by the cosine of the bend, which is of second order where it is smooth, and is zero where it turns back.
//! What a cell dissipates is its |Δv| times the mean of the limits at both ends.
//!
//! A cell that closes within a step is stuck to where it was when it closed, not where it was when the step began: what it moved by until
//! then is an offset too, with the rate of the step before. Without it the error of a varying load is of first order. It dissipates only
//! while it is in contact.

use std::collections::{BTreeMap, BTreeSet};

use super::cycle::{CycleAccumulator, Instant, found};
use super::joint::{FrettingJoint, WearError};
use super::limits::{FrictionLimits, exactness};
use super::motion::Channel;
use crate::contact::tangential::CellState;
use crate::grid::ByAxis;

/// Cycles after which a motion that has not closed is given up.
const MAX_CYCLES: usize = 60;

/// How often in a span it is looked at whether the cycle has closed.
const CHECKS: usize = 4;

/// Ratios of the change of shear from one span to the next: the least and the largest that are believed. A cycle may settle more slowly than
/// two spans say, and the errors of the solves go on changing it.
const RATIOS: [f64; 2] = [0.5, 0.9];

/// Ratios of a cell's change of shear from one span to the next at which the march goes on to where it leads: what is locked in over half a
/// cycle has the ratio −1. Of those of the other sign, which slow cells have, the largest are not known well enough, nor are the first.
const ALTERNATING: [f64; 2] = [-1.05, -0.6];
const SLOW: [f64; 2] = [0.6, 0.9];
const FIRST: usize = 4;

/// A shear this near to its limit is on it.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// A cycle that closed.
pub(super) struct Closed {
    pub(super) tally: CycleAccumulator,
    /// Shear at t = 0 \[Pa\].
    pub(super) shear: ByAxis<Vec<f64>>,
    /// From t = 0 to t = T.
    pub(super) instants: Vec<Instant>,
    /// The shear at the samples that are kept \[Pa\].
    pub(super) kept: BTreeMap<usize, ByAxis<Vec<f64>>>,
}

/// The march.
pub(super) struct Sequence<'a> {
    joint: &'a mut FrettingJoint,
    limits: &'a FrictionLimits,
    /// Samples from one step to the next.
    stride: usize,
    /// Steps of a cycle.
    steps: usize,
    /// Steps after which the march repeats itself, with the sign of `sign`: those of half a cycle whose second half is the first with all
    /// signs turned.
    span: usize,
    sign: f64,
    second_order: bool,
    /// Shear now, and at the ends of the two steps before \[Pa\].
    shear: ByAxis<Vec<f64>>,
    earlier: Vec<ByAxis<Vec<f64>>>,
    last: Option<Last>,
    /// Displacements and rotation now. Where force or moment is given, they are the sums of what was found.
    place: Vec<f64>,
    /// Samples whose shear is kept.
    keeps: BTreeSet<usize>,
}

/// What a step needs of the one before.
struct Last {
    /// What the cells moved by \[m\].
    moved: ByAxis<Vec<f64>>,
    state: Vec<CellState>,
    /// Its β.
    memory: f64,
}

/// A part of a span.
struct Segment {
    tally: CycleAccumulator,
    instants: Vec<Instant>,
    /// Steps from the beginning of the march to its end, and the shear and the place there.
    end: usize,
    shear: ByAxis<Vec<f64>>,
    place: Vec<f64>,
    /// The shear at samples that are kept, or half a cycle away from such \[Pa\].
    kept: Vec<(usize, ByAxis<Vec<f64>>)>,
    /// What its shear had changed by over a span would dissipate \[J/m²\], summed over the cells; none in the first span.
    unsteady: Option<f64>,
}

impl<'a> Sequence<'a> {
    /// Begins at sample 0 with the shear `start`, cut back to the limits, or with that of a first loading from rest.
    pub(super) fn new(
        joint: &'a mut FrettingJoint,
        limits: &'a FrictionLimits,
        stride: usize,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<Self, WearError> {
        let shear = match start {
            Some(shear) => within(shear, limits.at(0)),
            None => {
                let first = joint.motion.at(0);
                let zero = vec![0.0; first.len()];
                joint.step(limits.at(0), None, [&zero, &first], None)?.shear
            }
        };
        let steps = joint.motion.samples() / stride;
        let second_order = joint.options.extrapolate;
        let halves = second_order && joint.motion.is_antiperiodic(stride);
        let channels = joint.motion.channels().zip(joint.motion.at(0));
        Ok(Sequence {
            limits,
            stride,
            steps,
            span: if halves { steps / 2 } else { steps },
            sign: if halves { -1.0 } else { 1.0 },
            second_order,
            shear,
            earlier: Vec::new(),
            last: None,
            place: channels
                .map(|(channel, v)| if channel.is_force() { 0.0 } else { v })
                .collect(),
            keeps: BTreeSet::new(),
            joint,
        })
    }

    /// Keeps the shear at these instants, counted in samples of the motion.
    pub(super) fn keeping(mut self, instants: &[usize]) -> Self {
        let samples = self.joint.motion.samples();
        self.keeps = instants.iter().map(|instant| instant % samples).collect();
        self
    }

    /// The sample half a cycle later, where the march is over half of it.
    fn opposite(&self, sample: usize) -> Option<usize> {
        let samples = self.joint.motion.samples();
        (self.sign < 0.0).then_some((sample + samples / 2) % samples)
    }

    /// Marches until what the shear still changes by over a span would dissipate no more than the tolerance of the cycle, should it go on
    /// to change as a geometric series does.
    pub(super) fn close(mut self) -> Result<Closed, WearError> {
        let checks = CHECKS.min(self.span);
        let mut segments: Vec<Option<Segment>> = (0..checks).map(|_| None).collect();
        let tolerance = self.joint.options.cycle_tolerance;
        let mut drift = None;
        for span in 0..MAX_CYCLES * self.steps / self.span {
            let begin = self.shear.clone();
            for check in 0..checks {
                let [from, to] =
                    [check, check + 1].map(|c| span * self.span + c * self.span / checks);
                let new = self.segment(from, to)?;
                let old = segments[check].replace(new);
                let Some(old) = old else {
                    continue;
                };
                let mut tally = CycleAccumulator::new(self.joint.patch.grid.len());
                segments
                    .iter()
                    .flatten()
                    .for_each(|segment| tally.join(&segment.tally));
                let limit = self.limits.at(to % self.steps * self.stride);
                let changed = change([&self.shear, &old.shear], self.sign, limit);
                let unsteady: f64 = changed
                    .iter()
                    .zip(&tally.slip_path)
                    .map(|(q, s)| q * s)
                    .sum();
                let ratio = old.unsteady.map_or(0.0, |before| unsteady / before);
                let ratio = ratio.clamp(RATIOS[0], RATIOS[1]);
                let left = unsteady * ratio / (1.0 - ratio);
                if left <= tolerance * tally.energy.iter().sum::<f64>() {
                    tally.dissipation_error += left * self.joint.patch.grid.cell_area();
                    return Ok(self.whole(tally, &old.place, segments));
                }
                if let Some(new) = &mut segments[check] {
                    new.unsteady = Some(unsteady);
                }
            }
            let arrived = self.shear.clone();
            if self.sign < 0.0 {
                self.unlock(&begin, &segments);
            }
            drift = self.hasten(span, &begin, drift);
            self.carry_back(&arrived, segments.iter_mut().flatten());
        }
        Err(WearError::NotSteady {
            cycles: MAX_CYCLES,
            tolerance,
        })
    }

    /// Marches from one step to another, counted from the beginning.
    fn segment(&mut self, from: usize, to: usize) -> Result<Segment, WearError> {
        let mut tally = CycleAccumulator::new(self.joint.patch.grid.len());
        let mut instants = Vec::with_capacity(to - from);
        let mut kept = Vec::new();
        for step in from..to {
            instants.push(self.step(step % self.steps * self.stride, &mut tally)?);
            let sample = (step + 1) % self.steps * self.stride;
            let opposite = self.opposite(sample);
            if self.keeps.contains(&sample) || opposite.is_some_and(|s| self.keeps.contains(&s)) {
                kept.push((sample, self.shear.clone()));
            }
        }
        Ok(Segment {
            tally,
            instants,
            end: to,
            shear: self.shear.clone(),
            place: self.place.clone(),
            kept,
            unsteady: None,
        })
    }

    /// Marches from the sample `k` to the next, and adds what is slipped and dissipated.
    fn step(&mut self, k: usize, tally: &mut CycleAccumulator) -> Result<Instant, WearError> {
        let (joint, stride) = (&mut *self.joint, self.stride);
        let next = k + stride;
        let samples = joint.motion.samples();
        let ratio = joint.motion.pace(k, stride);
        let (from, to) = (joint.motion.at(k), joint.motion.at(next));
        let limits = [k, next].map(|sample| self.limits.at(sample));
        let mut part_in_contact = vec![1.0; limits[0].len()];
        let mut offset: Option<ByAxis<Vec<f64>>> = None;
        let mut remembered = 0.0;
        if self.second_order {
            let changes = self.limits.changes(&joint.motion, k, stride);
            for change in &changes {
                part_in_contact[change.cell] = 1.0 - change.open;
            }
            if let Some(last) = &self.last {
                // Along one axis slip has a sign and no direction: what a cell moved by is exact.
                let bend = match last.moved.len() {
                    1 => 0.0,
                    _ => joint.motion.ahead(k, stride).max(0.0),
                };
                // What β takes over of an error twice may not grow: of equal steps that is a ninth.
                let memory = bend * ratio * ratio / (1.0 + 2.0 * ratio);
                let memory = memory.min(1.0 / last.memory);
                remembered = memory;
                let slid = last.state.iter().map(|state| match state {
                    CellState::Slip => memory,
                    CellState::Stick | CellState::Open => 0.0,
                });
                let mut factor: Vec<f64> = slid.collect();
                for change in changes.iter().filter(|change| change.closes) {
                    factor[change.cell] = ratio * change.open;
                }
                let scaled =
                    |moved: &Vec<f64>| moved.iter().zip(&factor).map(|(m, f)| -f * m).collect();
                offset = Some(last.moved.iter().map(scaled).collect());
            }
        }
        let start = self.second_order.then(|| ahead(&self.shear, &self.earlier));
        let mut driven = joint.motion.between(&from, &to);
        if let Some(offset) = &offset {
            driven.displace(offset.clone());
        }
        let mut options = joint.options.tangential_in_sequence();
        options.tolerance *= exactness(&driven, limits[1], joint.patch.grid.cell_area());
        let found_step = joint.driven(
            options,
            limits[1],
            Some(&self.shear),
            &driven,
            start.as_ref(),
        )?;
        let mut moved = found_step.slip.clone();
        for (moved, offset) in moved.iter_mut().zip(offset.iter().flatten()) {
            moved.iter_mut().zip(offset).for_each(|(m, o)| *m -= o);
        }
        tally.add_moved(&found_step, &moved, limits, &part_in_contact);
        let moves = to
            .iter()
            .zip(found(&found_step))
            .zip(joint.motion.channels());
        for (place, ((to, change), channel)) in self.place.iter_mut().zip(moves) {
            *place = match channel {
                Channel::Displacement(_) => *to,
                Channel::Force(_) => *place + change,
            };
        }
        let axes = found_step.force.len();
        let rotated = joint.motion.rotation.as_ref();
        let cell_area = joint.patch.grid.cell_area();
        let instant = Instant {
            time: joint.motion.time_of(next),
            displacement: self.place[..axes].to_vec(),
            normal_load: joint.motion.normal_load[next % samples],
            torsion: rotated.map(|_| [self.place[axes], found_step.moment]),
            force_along: joint.motion.force_along(&found_step.shear, cell_area),
            force: found_step.force,
        };
        self.last = Some(Last {
            moved,
            state: found_step.state,
            memory: remembered,
        });
        self.earlier
            .insert(0, std::mem::replace(&mut self.shear, found_step.shear));
        self.earlier.truncate(2);
        Ok(instant)
    }

    /// Takes the mean out of the shear of cells that stuck since it was `begin`, half a cycle ago: it hangs on the way to the cycle alone, and
    /// no cycle would ever change it.
    fn unlock(&mut self, begin: &ByAxis<Vec<f64>>, segments: &[Option<Segment>]) {
        let stuck = |c: usize| {
            let mut all = segments.iter().flatten();
            all.all(|segment| segment.tally.slip_path[c] == 0.0)
        };
        for c in (0..self.joint.patch.grid.len()).filter(|&c| stuck(c)) {
            for (axis, begin) in begin.iter().enumerate() {
                let mean = 0.5 * (self.shear[axis][c] + begin[c]);
                self.shear[axis][c] -= mean;
                for earlier in &mut self.earlier {
                    earlier[axis][c] -= mean;
                }
            }
        }
    }

    /// Goes on to where the shear of a cell leads that a span changes in proportion to what the span before changed it by, and hardly less. `begin`
    /// is the shear before the span, `drift` what the span before changed. Returns what this one changed; none where it went on.
    fn hasten(
        &mut self,
        span: usize,
        begin: &ByAxis<Vec<f64>>,
        drift: Option<ByAxis<Vec<f64>>>,
    ) -> Option<ByAxis<Vec<f64>>> {
        let sign = self.sign;
        let pairs = self.shear.iter().zip(begin);
        let now: ByAxis<Vec<f64>> = pairs
            .map(|(q, q0)| q.iter().zip(q0).map(|(q, q0)| q - sign * q0).collect())
            .collect();
        let Some(before) = drift else {
            return Some(now);
        };
        for c in 0..self.joint.patch.grid.len() {
            let axes = now.iter().zip(&before);
            let [along, size] = axes.fold([0.0; 2], |[along, size], (now, before)| {
                [along + now[c] * before[c], size + before[c] * before[c]]
            });
            let ratio = sign * along / size;
            let within = |[least, most]: [f64; 2]| (least..=most).contains(&ratio);
            if within(ALTERNATING) || span >= FIRST && within(SLOW) {
                for (q, now) in self.shear.iter_mut().zip(&now) {
                    q[c] += now[c] * ratio / (1.0 - ratio);
                }
            }
        }
        self.shear = within(&self.shear, self.limits.at(0));
        None
    }

    /// Takes what was added to the shear since it `arrived` at the end of a span for having been there all along. The cycle is put together of
    /// the last of each of its parts, which would not fit else. Forces that are given stay as they are.
    fn carry_back<'s>(
        &self,
        arrived: &ByAxis<Vec<f64>>,
        segments: impl Iterator<Item = &'s mut Segment>,
    ) {
        let motion = &self.joint.motion;
        if motion.channels().any(Channel::is_force) {
            return;
        }
        let grid = self.joint.patch.grid;
        let pairs = self.shear.iter().zip(arrived);
        let added: ByAxis<Vec<f64>> = pairs
            .map(|(now, before)| now.iter().zip(before).map(|(a, b)| a - b).collect())
            .collect();
        let force: ByAxis<f64> = added
            .iter()
            .map(|of| of.iter().sum::<f64>() * grid.cell_area())
            .collect();
        let about_z = |c: usize| {
            let (i, j) = grid.cell(c);
            let (x, y) = grid.centre(i, j);
            x * added.get(1).map_or(0.0, |q| q[c]) - y * added[0][c]
        };
        let moment = (0..grid.len()).map(about_z).sum::<f64>() * grid.cell_area();
        let add = |shear: &mut ByAxis<Vec<f64>>| {
            let values = shear.iter_mut().flatten().zip(added.iter().flatten());
            values.for_each(|(q, by)| *q += by);
        };
        for segment in segments {
            add(&mut segment.shear);
            segment.kept.iter_mut().for_each(|(_, shear)| add(shear));
            for instant in &mut segment.instants {
                let values = instant.force.iter_mut().zip(&force);
                values.for_each(|(value, by)| *value += by);
                if let Some([_, of_instant]) = &mut instant.torsion {
                    *of_instant += moment;
                }
            }
        }
    }

    /// The whole cycle, whose place was `old` a span ago.
    fn whole(
        mut self,
        mut tally: CycleAccumulator,
        old: &[f64],
        segments: Vec<Option<Segment>>,
    ) -> Closed {
        let mut shear = std::mem::take(&mut self.shear);
        let mut instants = Vec::with_capacity(self.steps + 1);
        let mut kept = BTreeMap::new();
        for mut segment in segments.into_iter().flatten() {
            for (sample, shear) in segment.kept.drain(..) {
                if let Some(opposite) = self.opposite(sample).filter(|s| self.keeps.contains(s)) {
                    let negative = |q: &Vec<f64>| q.iter().map(|v| -v).collect();
                    kept.insert(opposite, shear.iter().map(negative).collect());
                }
                if self.keeps.contains(&sample) {
                    kept.insert(sample, shear);
                }
            }
            // The last one ends where a cycle begins, or in its middle.
            shear = segment.shear;
            if segment.end % self.steps != 0 {
                shear.iter_mut().flatten().for_each(|q| *q *= self.sign);
            }
            instants.extend(segment.instants);
        }
        if self.sign < 0.0 {
            tally.double();
            let middle: Vec<f64> = self
                .place
                .iter()
                .zip(old)
                .map(|(a, b)| 0.5 * (a + b))
                .collect();
            for k in 0..instants.len() {
                let instant = &mut instants[k];
                instant.shift(&middle);
                let opposite = instant.opposite();
                instants.push(opposite);
            }
        }
        instants.sort_by(|a, b| a.time.total_cmp(&b.time));
        let last = instants.last().cloned();
        instants.splice(0..0, last.map(|last| Instant { time: 0.0, ..last }));
        Closed {
            tally,
            shear,
            instants,
            kept,
        }
    }
}

/// The shear that the last ones lead to, as a parabola or a straight line.
fn ahead(shear: &ByAxis<Vec<f64>>, earlier: &[ByAxis<Vec<f64>>]) -> ByAxis<Vec<f64>> {
    let mut next = shear.clone();
    for (axis, next) in next.iter_mut().enumerate() {
        for (c, q) in next.iter_mut().enumerate() {
            *q = match earlier {
                [before, first] => 3.0 * (*q - before[axis][c]) + first[axis][c],
                [before] => 2.0 * *q - before[axis][c],
                _ => *q,
            };
        }
    }
    next
}

/// By how much two shears differ for what dissipates, `sign` times the second, on every cell \[Pa\]: shears at their limit only turn against
/// each other, and what is across the slip does not dissipate.
fn change([shear, before]: [&ByAxis<Vec<f64>>; 2], sign: f64, limit: &[f64]) -> Vec<f64> {
    let square = |c: usize| -> f64 {
        let axes = shear.iter().zip(before);
        axes.map(|(a, b)| (a[c] - sign * b[c]).powi(2)).sum()
    };
    let slides = |shear: &ByAxis<Vec<f64>>, c: usize| {
        let size = shear.iter().map(|q| q[c] * q[c]).sum::<f64>();
        limit[c] > 0.0 && size >= (AT_LIMIT * limit[c]).powi(2)
    };
    let cells = 0..limit.len();
    cells
        .map(|c| match slides(shear, c) && slides(before, c) {
            true => square(c) / (2.0 * limit[c]),
            false => square(c).sqrt(),
        })
        .collect()
}

/// Shears cut back to their limits, direction kept.
fn within(shear: &ByAxis<Vec<f64>>, limit: &[f64]) -> ByAxis<Vec<f64>> {
    let mut cut = shear.clone();
    for (c, &limit) in limit.iter().enumerate() {
        let size = cut.iter().map(|q| q[c] * q[c]).sum::<f64>().sqrt();
        if size > limit {
            for q in &mut cut {
                q[c] *= limit / size;
            }
        }
    }
    cut
}
