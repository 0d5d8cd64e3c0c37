//! March from sample to sample until the cycle is periodic.
//!
//! In a step of second order, the shear at the end of the step has the direction of the slip rate at the end of the
//! step. In a step of first order, the shear has the direction of the slip Δv over the step. The backward difference of
//! two steps gives the slip rate at the end as Δv − β Δv'. The slip Δv' is the slip in the step before. The factor β is
//! w²/(1 + 2w), where w is the ratio of the durations of both steps (BDF2, [Curtiss and Hirschfelder 1952]). If only
//! the order of the samples counts, w is the ratio of the paths of both steps. The term −β Δv' is an offset of the
//! tangential problem. The offset −β Δv' applies only to cells that also slipped in the step before. A cell that begins
//! to slip has no earlier slip rate. Where the motion bends, the program multiplies β by the cosine of the bend. On a
//! smooth path, the effect of the cosine on the result is of second order. Where the motion turns back, β is zero. The
//! energy per area of a cell in a step is |Δv| times a mean friction limit. The mean is over the friction limits at
//! both ends of the step.
//!
//! A cell that closes within a step sticks at its position at closure. The position at closure differs from the
//! position at the beginning of the step. The motion of the cell until closure, at the rate of the step before, is a
//! second offset. Without an offset for the motion until closure, the error under a varying load is of first order. A
//! cell that closes or opens is in contact for a fraction of the step, and dissipates energy only in this fraction.

use std::collections::{BTreeMap, BTreeSet};

use super::cycle::{CycleAccumulator, Instant, step_displacements};
use super::joint::{FrettingJoint, WearError};
use super::limits::{FrictionLimits, tolerance_factor};
use super::motion::Channel;
use crate::contact::tangential::CellState;
use crate::grid::ByAxis;

/// Largest number of cycles before the march fails.
const MAX_CYCLES: usize = 60;

/// Bounds on the ratio of the changes of shear in successive spans, for the estimate of the remaining change.
/// A cycle may converge more slowly than two spans show, and errors of the solves keep changing it.
const CONVERGENCE_RATIO_BOUNDS: [f64; 2] = [0.5, 0.9];

/// Ranges of the ratio of a cell's changes of shear in two successive spans, in which the march extrapolates the shear.
/// If a march covers half a cycle, a constant residual shear of a stuck cell gives the ratio −1 (`ALTERNATING_RATIOS`).
/// Slowly converging cells have positive ratios (`SLOW_RATIOS`). Ratios above 0.9 are too inaccurate to extrapolate,
/// and positive ratios before the span `FIRST_EXTRAPOLATED_SPAN` are too inaccurate as well.
const ALTERNATING_RATIOS: [f64; 2] = [-1.05, -0.6];
const SLOW_RATIOS: [f64; 2] = [0.6, 0.9];
const FIRST_EXTRAPOLATED_SPAN: usize = 4;

/// Fraction of the friction limit from which on a shear counts as being at its limit.
const AT_LIMIT: f64 = 1.0 - 1e-9;

/// Closed cycle.
pub(super) struct ClosedCycle {
    pub(super) tally: CycleAccumulator,
    /// Shear at t = 0 \[Pa\].
    pub(super) shear: ByAxis<Vec<f64>>,
    /// Instants from t = 0 to t = T.
    pub(super) instants: Vec<Instant>,
    /// Shear at the requested samples \[Pa\].
    pub(super) kept: BTreeMap<usize, ByAxis<Vec<f64>>>,
}

/// State of the march.
pub(super) struct SteadyStateMarch<'a> {
    joint: &'a mut FrettingJoint,
    limits: &'a FrictionLimits,
    /// Samples from one step to the next.
    stride: usize,
    /// Steps per cycle.
    steps: usize,
    /// Steps after which the march repeats itself, up to the factor `sign`. The span is half a cycle if the second half
    /// of the cycle is the negative of the first.
    span: usize,
    sign: f64,
    second_order: bool,
    /// Current shear, and the shear at the ends of the two steps before \[Pa\].
    shear: ByAxis<Vec<f64>>,
    earlier: Vec<ByAxis<Vec<f64>>>,
    last: Option<LastStep>,
    /// Current displacements and rotation. Under a prescribed force or moment they are sums of the computed
    /// steps.
    place: Vec<f64>,
    /// Samples whose shear is stored.
    keeps: BTreeSet<usize>,
}

/// Results of the last step that the next one needs.
struct LastStep {
    /// Motion of the cells in the step \[m\].
    moved: ByAxis<Vec<f64>>,
    state: Vec<CellState>,
    /// β of the step.
    beta: f64,
}

/// Part of a span.
struct Segment {
    tally: CycleAccumulator,
    instants: Vec<Instant>,
    /// Number of the step at the end of the segment, counted from the beginning of the march. `shear` and `place` are
    /// the shear and the position at the end of the segment.
    end: usize,
    shear: ByAxis<Vec<f64>>,
    place: Vec<f64>,
    /// Shear at the stored samples, or half a cycle away from them \[Pa\].
    kept: Vec<(usize, ByAxis<Vec<f64>>)>,
    /// Energy that the change of shear in a span would dissipate, summed over the cells \[J/m²\]. `unsteady` is `None`
    /// in the first span.
    unsteady: Option<f64>,
}

impl<'a> SteadyStateMarch<'a> {
    /// Starts the march at sample 0. The march starts with the shear `start`, reduced to the friction limits. If
    /// `start` is `None`, the march starts with the shear of a first loading from rest.
    pub(super) fn new(
        joint: &'a mut FrettingJoint,
        limits: &'a FrictionLimits,
        stride: usize,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<Self, WearError> {
        let shear = match start {
            Some(shear) => cut_to_limits(shear, limits.at(0)),
            None => {
                let first = joint.motion.state_at(0);
                let zero = vec![0.0; first.len()];
                joint.step(limits.at(0), None, [&zero, &first], None)?.shear
            }
        };
        let steps = joint.motion.samples() / stride;
        let second_order = joint.options.extrapolate;
        let halves = second_order && joint.motion.is_antiperiodic(stride);
        let channels = joint.motion.channels().zip(joint.motion.state_at(0));
        Ok(SteadyStateMarch {
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

    /// Makes the march store the shear at `instants`, which are numbers of samples.
    pub(super) fn storing_shear_at(mut self, instants: &[usize]) -> Self {
        let samples = self.joint.motion.samples();
        self.keeps = instants.iter().map(|instant| instant % samples).collect();
        self
    }

    /// Returns the sample half a cycle later, if the march covers half a cycle.
    fn opposite(&self, sample: usize) -> Option<usize> {
        let samples = self.joint.motion.samples();
        (self.sign < 0.0).then_some((sample + samples / 2) % samples)
    }

    /// Marches until the remaining change of the shear would dissipate no more than the tolerance of the
    /// cycle. The remaining change is extrapolated as a geometric series.
    pub(super) fn close(mut self) -> Result<ClosedCycle, WearError> {
        let checks = self.joint.options.checks_per_span.min(self.span);
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
                    .for_each(|segment| tally.add_accumulator(&segment.tally));
                let limit = self.limits.at(to % self.steps * self.stride);
                let changed = change([&self.shear, &old.shear], self.sign, limit);
                let unsteady: f64 = changed
                    .iter()
                    .zip(&tally.slip_path)
                    .map(|(q, s)| q * s)
                    .sum();
                let ratio = old.unsteady.map_or(0.0, |before| unsteady / before);
                let ratio = ratio.clamp(CONVERGENCE_RATIO_BOUNDS[0], CONVERGENCE_RATIO_BOUNDS[1]);
                let remaining = unsteady * ratio / (1.0 - ratio);
                if remaining <= tolerance * tally.energy.iter().sum::<f64>() {
                    tally.dissipation_error += remaining * self.joint.patch.grid.cell_area();
                    return Ok(self.assemble(tally, &old.place, segments));
                }
                if let Some(new) = &mut segments[check] {
                    new.unsteady = Some(unsteady);
                }
            }
            let before_extrapolation = self.shear.clone();
            if self.sign < 0.0 {
                self.unlock(&begin, &segments);
            }
            drift = self.extrapolate(span, &begin, drift);
            self.carry_back(&before_extrapolation, segments.iter_mut().flatten());
        }
        Err(WearError::NotSteady {
            cycles: MAX_CYCLES,
            tolerance,
        })
    }

    /// Marches from one step to another, both counted from the beginning of the march.
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

    /// Marches from the sample `k` to the next, and adds its slip and dissipation.
    fn step(&mut self, k: usize, tally: &mut CycleAccumulator) -> Result<Instant, WearError> {
        let (joint, stride) = (&mut *self.joint, self.stride);
        let next = k + stride;
        let samples = joint.motion.samples();
        let ratio = joint.motion.step_ratio(k, stride);
        let (from, to) = (joint.motion.state_at(k), joint.motion.state_at(next));
        let limits = [k, next].map(|sample| self.limits.at(sample));
        let mut part_in_contact = vec![1.0; limits[0].len()];
        let mut offset: Option<ByAxis<Vec<f64>>> = None;
        let mut beta = 0.0;
        if self.second_order {
            let changes = self.limits.changes(&joint.motion, k, stride);
            for change in &changes {
                part_in_contact[change.cell] = 1.0 - change.open;
            }
            if let Some(last) = &self.last {
                // Along one axis the slip has a sign but no direction, so the motion of a cell is exact.
                let bend = match last.moved.len() {
                    1 => 0.0,
                    _ => joint.motion.turn_cosine(k, stride).max(0.0),
                };
                // The product of two successive β must not exceed 1, or errors would grow. For equal steps the product
                // of two β is 1/9.
                let memory = bend * ratio * ratio / (1.0 + 2.0 * ratio);
                let memory = memory.min(1.0 / last.beta);
                beta = memory;
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
        let start = self
            .second_order
            .then(|| next_shear(&self.shear, &self.earlier));
        let mut driven = joint.motion.between(&from, &to);
        if let Some(offset) = &offset {
            driven.displace(offset.clone());
        }
        let mut options = joint.options.tangential_in_sequence();
        options.tolerance *= tolerance_factor(&driven, limits[1], joint.patch.grid.cell_area());
        let solution = joint.solve_driven_step(
            options,
            limits[1],
            Some(&self.shear),
            &driven,
            start.as_ref(),
        )?;
        let mut moved = solution.slip.clone();
        for (moved, offset) in moved.iter_mut().zip(offset.iter().flatten()) {
            moved.iter_mut().zip(offset).for_each(|(m, o)| *m -= o);
        }
        tally.add_displaced_step(&solution, &moved, limits, &part_in_contact);
        let moves = to
            .iter()
            .zip(step_displacements(&solution))
            .zip(joint.motion.channels());
        for (place, ((to, change), channel)) in self.place.iter_mut().zip(moves) {
            *place = match channel {
                Channel::Displacement(_) => *to,
                Channel::Force(_) => *place + change,
            };
        }
        let axes = solution.force.len();
        let rotated = joint.motion.rotation.as_ref();
        let cell_area = joint.patch.grid.cell_area();
        let instant = Instant {
            time: joint.motion.time_of(next),
            displacement: self.place[..axes].to_vec(),
            normal_load: joint.motion.normal_load[next % samples],
            torsion: rotated.map(|_| [self.place[axes], solution.moment]),
            force_along: joint.motion.force_along(&solution.shear, cell_area),
            force: solution.force,
        };
        self.last = Some(LastStep {
            moved,
            state: solution.state,
            beta,
        });
        self.earlier
            .insert(0, std::mem::replace(&mut self.shear, solution.shear));
        self.earlier.truncate(2);
        Ok(instant)
    }

    /// Subtracts the mean shear of each cell that stuck in the last half cycle. The mean shear is the mean of the
    /// current shear and the shear `begin` half a cycle earlier. The mean shear of a stuck cell depends only on the
    /// loading before the steady cycle. Further cycles do not change the mean shear.
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

    /// Extrapolates the shear of a cell by a geometric series (Aitken). The extrapolation needs a suitable ratio of the
    /// changes of the shear in two successive spans. `begin` is the shear before the current span, and `drift` is the
    /// change of shear in the span before. Returns the change of shear in the current span, or `None` after an
    /// extrapolation.
    fn extrapolate(
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
            if within(ALTERNATING_RATIOS) || span >= FIRST_EXTRAPOLATED_SPAN && within(SLOW_RATIOS)
            {
                for (q, now) in self.shear.iter_mut().zip(&now) {
                    q[c] += now[c] * ratio / (1.0 - ratio);
                }
            }
        }
        self.shear = cut_to_limits(&self.shear, self.limits.at(0));
        None
    }

    /// Adds the extrapolation of the shear `before_extrapolation` to the stored segments. The cycle is
    /// assembled from the last segment of each part, and they would not match otherwise. Changes nothing if a
    /// force or moment is prescribed.
    fn carry_back<'s>(
        &self,
        before_extrapolation: &ByAxis<Vec<f64>>,
        segments: impl Iterator<Item = &'s mut Segment>,
    ) {
        let motion = &self.joint.motion;
        if motion.channels().any(Channel::is_force) {
            return;
        }
        let grid = self.joint.patch.grid;
        let pairs = self.shear.iter().zip(before_extrapolation);
        let added: ByAxis<Vec<f64>> = pairs
            .map(|(now, before)| now.iter().zip(before).map(|(a, b)| a - b).collect())
            .collect();
        let force: ByAxis<f64> = added
            .iter()
            .map(|field| field.iter().sum::<f64>() * grid.cell_area())
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
                if let Some([_, instant_moment]) = &mut instant.torsion {
                    *instant_moment += moment;
                }
            }
        }
    }

    /// Assembles the whole cycle. `old` is the position one span ago.
    fn assemble(
        mut self,
        mut tally: CycleAccumulator,
        old: &[f64],
        segments: Vec<Option<Segment>>,
    ) -> ClosedCycle {
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
            // The last segment ends at the beginning of a cycle, or in its middle.
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
        ClosedCycle {
            tally,
            shear,
            instants,
            kept,
        }
    }
}

/// Extrapolates the shear from the last steps by a parabola or a straight line.
fn next_shear(shear: &ByAxis<Vec<f64>>, earlier: &[ByAxis<Vec<f64>>]) -> ByAxis<Vec<f64>> {
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

/// Returns the part of the change between two shears that affects the dissipation, on every cell \[Pa\]. `sign`
/// multiplies the second shear. If both shears of a cell are at the friction limit, the shears differ only in
/// direction. A shear at right angles to the slip does not dissipate energy.
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

/// Reduces shears above the friction limit to the limit, without a change of direction.
fn cut_to_limits(shear: &ByAxis<Vec<f64>>, limit: &[f64]) -> ByAxis<Vec<f64>> {
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
