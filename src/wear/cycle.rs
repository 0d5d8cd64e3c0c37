//! The steady fretting cycle: shear, slip and dissipated energy under a closed motion.
//!
//! Slip is the kinematic δ − u everywhere, also on cells just outside the contact, so that cells which wear brings into
//! contact begin to slip as their neighbours do. On stick cells it is zero. The energy of a step is q·s with the shear at
//! its end, and wear depth per cycle is α times the sum of it over the cycle [A eq. 2.6]; where the load varies it is |s| times the
//! mean of the limits at both ends, on cells that come into contact or leave it too.

use super::fields::{InstantFields, InstantShear};
use super::joint::{FrettingJoint, WearError};
use super::motion::{Channel, Step, StraightMotion};
use super::sequence::{Closed, Sequence};

use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::tangential::{
    self, CellState, TangentialOptions, TangentialProblem, TangentialSolution,
};
use crate::grid::{ByAxis, Grid, Patch};

/// How the cycle is marched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum March {
    /// One exact solve a branch between the two reversals of a straight motion at constant load.
    Reversal,
    /// One exact solve at every sample of the motion.
    Stepped,
    /// As `Reversal`, with the shear of Ciavarella and Jäger in place of the exact one: a fast approximation
    /// (Ciavarella 1998; Jäger 1998). [`CycleSolution::error`] says how good.
    Superposition,
}

/// Part of what the work of all places together corrects in that of single ones, which remains as an error: as much as remains of the correction
/// itself. In laps of bars held against stepped cycles it was mostly less, where corners open more.
const MOVED: f64 = 0.4;

/// One instant of the cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Time as a part of the period.
    pub time: f64,
    /// Relative displacement \[m\]. Where the force is given, what it leaves open, a constant, is chosen such that the middle
    /// of the range is zero.
    pub displacement: ByAxis<f64>,
    /// Normal load \[N\].
    pub normal_load: f64,
    /// Tangential force \[N\].
    pub force: ByAxis<f64>,
    /// Force along the motion, [`Motion::force_along`](super::Motion::force_along) \[N\].
    pub force_along: f64,
    /// Rotation about z \[rad\] and its moment \[N m\]; none of a motion without.
    pub torsion: Option<[f64; 2]>,
}

impl Instant {
    /// Takes the `middle` of the displacements, and of the rotation after them, for zero.
    pub(super) fn shift(&mut self, middle: &[f64]) {
        let rotation = self.torsion.iter_mut().map(|[rotation, _]| rotation);
        let place = self.displacement.iter_mut().chain(rotation);
        place.zip(middle).for_each(|(place, m)| *place -= m);
    }

    /// The instant half a period later, or earlier, of a cycle whose halves are opposite.
    pub(super) fn opposite(&self) -> Instant {
        let negative = |values: &ByAxis<f64>| values.iter().map(|v| -v).collect();
        Instant {
            time: self.time + if self.time > 0.5 { -0.5 } else { 0.5 },
            displacement: negative(&self.displacement),
            normal_load: self.normal_load,
            force: negative(&self.force),
            force_along: -self.force_along,
            torsion: self.torsion.map(|pair| pair.map(|v| -v)),
        }
    }
}

/// The steady cycle of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleSolution {
    /// Shear at t = 0: what a later cycle starts from \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Path of the slip over a cycle, ∮|dv|: 0 on cells that stick throughout \[m\].
    pub slip_path: Vec<f64>,
    /// Dissipated energy per area and cycle, ∮|q||dv|; 0 off the cells that slipped in contact \[J/m²\].
    pub energy: Vec<f64>,
    /// Dissipated energy per cycle, Σ `energy` dA \[J\].
    pub dissipation: f64,
    /// The computed instants, the first at t = 0 and the last at t = T.
    pub instants: Vec<Instant>,
    /// Newton steps of all tangential solves.
    pub steps: usize,
    /// Largest relative duality gap of all tangential solves.
    pub error: f64,
    /// Estimated error of `dissipation`: the duality gaps of the solves, what the closing of a cycle of samples leaves, and, if
    /// half of them were marched too, what the samples do \[J\].
    pub dissipation_error: f64,
}

impl CycleSolution {
    /// Half range of the force along the motion \[N\].
    pub fn force_along(&self) -> f64 {
        let forces = self.instants.iter().map(|instant| instant.force_along);
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (least, most) = forces.fold(ends, |(least, most), f| (least.min(f), most.max(f)));
        0.5 * (most - least).max(0.0)
    }

    /// Estimated relative error of `dissipation`, at most 1; 0 where nothing is dissipated.
    pub fn relative_error(&self) -> f64 {
        if self.dissipation > 0.0 {
            (self.dissipation_error / self.dissipation).min(1.0)
        } else {
            0.0
        }
    }
}

/// Slip and energy gathered over a cycle.
pub(super) struct CycleAccumulator {
    pub(super) slip_path: Vec<f64>,
    pub(super) energy: Vec<f64>,
    pub(super) steps: usize,
    pub(super) error: f64,
    /// Error of the dissipation \[J\].
    pub(super) dissipation_error: f64,
}

impl CycleAccumulator {
    pub(super) fn new(cells: usize) -> Self {
        CycleAccumulator {
            slip_path: vec![0.0; cells],
            energy: vec![0.0; cells],
            steps: 0,
            error: 0.0,
            dissipation_error: 0.0,
        }
    }

    /// Adds a step from rest, `times` over.
    fn add(&mut self, step: &TangentialSolution, times: f64) {
        for c in 0..self.energy.len() {
            let axes = step.slip.iter().map(|s| s[c] * s[c]);
            self.slip_path[c] += times * axes.sum::<f64>().sqrt();
            if step.state[c] == CellState::Slip {
                let axes = step.shear.iter().zip(&step.slip);
                self.energy[c] += times * axes.map(|(q, s)| q[c] * s[c]).sum::<f64>();
            }
        }
        self.dissipation_error += times * step.dissipation_error;
        self.count(step);
    }

    /// Adds a step in which the cells moved by `moved` \[m\], between limits at its ends \[Pa\], each for a part of it in contact. Cells that
    /// stick do not slip: what they moved by is what a step of second order leaves of a slip that has just ended.
    pub(super) fn add_moved(
        &mut self,
        step: &TangentialSolution,
        moved: &ByAxis<Vec<f64>>,
        limits: [&[f64]; 2],
        part_in_contact: &[f64],
    ) {
        for c in 0..self.energy.len() {
            if step.state[c] != CellState::Stick {
                let slip = moved.iter().map(|m| m[c] * m[c]).sum::<f64>().sqrt();
                let limit = 0.5 * (limits[0][c] + limits[1][c]);
                self.slip_path[c] += slip;
                self.energy[c] += part_in_contact[c] * limit * slip;
            }
        }
        self.dissipation_error += step.dissipation_error;
        self.count(step);
    }

    /// Adds what another has gathered.
    pub(super) fn join(&mut self, other: &CycleAccumulator) {
        for (all, new) in [
            (&mut self.slip_path, &other.slip_path),
            (&mut self.energy, &other.energy),
        ] {
            all.iter_mut().zip(new).for_each(|(all, new)| *all += new);
        }
        self.dissipation_error += other.dissipation_error;
        self.steps += other.steps;
        self.error = self.error.max(other.error);
    }

    /// Makes a whole cycle of half of one, whose steps were solved once.
    pub(super) fn double(&mut self) {
        let fields = [&mut self.slip_path, &mut self.energy];
        fields.into_iter().flatten().for_each(|v| *v *= 2.0);
        self.dissipation_error *= 2.0;
    }

    fn count(&mut self, step: &TangentialSolution) {
        self.steps += step.steps;
        self.error = self.error.max(step.error);
    }

    /// Slip path and energy in these parts, one a cell, and by one factor, so that all energy is this part of what it was. Parts were told of
    /// places that may slip otherwise here; only that of all together is sure, and some of what it moves remains as an error. Where no cell
    /// that slips has a part, all have that of all.
    fn scale(&mut self, parts: &[f64], of_all: f64, cell_area: f64) {
        let before = self.energy.iter().sum::<f64>();
        let energies = self.energy.iter().zip(parts);
        let in_parts = energies.map(|(energy, part)| energy * part).sum::<f64>();
        let of_cell = |part: &f64| match in_parts > 0.0 {
            true => part * of_all * before / in_parts,
            false => of_all,
        };
        for values in [&mut self.slip_path, &mut self.energy] {
            let pairs = values.iter_mut().zip(parts);
            pairs.for_each(|(value, part)| *value *= of_cell(part));
        }
        self.dissipation_error += MOVED * (of_all * before - in_parts).abs() * cell_area;
    }

    pub(super) fn finish(
        self,
        cell_area: f64,
        shear: ByAxis<Vec<f64>>,
        instants: Vec<Instant>,
    ) -> CycleSolution {
        let dissipation = self.energy.iter().sum::<f64>() * cell_area;
        let CycleAccumulator {
            slip_path,
            energy,
            steps,
            error,
            dissipation_error,
        } = self;
        CycleSolution {
            shear,
            slip_path,
            energy,
            dissipation,
            instants,
            steps,
            error,
            dissipation_error,
        }
    }
}

impl FrettingJoint {
    /// The steady cycle on a surface of which `wear` is gone, with its static contact at the mean load.
    ///
    /// `start` is the shear at t = 0 of an earlier cycle. With [`March::Stepped`] it is the state that the joint
    /// starts from, cut back to the new friction limits; with [`March::Reversal`] it only saves time.
    pub fn cycle(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<CycleSolution, WearError> {
        let (solution, _) = self.cycle_with_fields(wear, contact, start, &|_| false)?;
        Ok(solution)
    }

    /// The steady cycle of [`FrettingJoint::cycle`], with the fields of those of its instants, by their number, that are `wanted`. With
    /// [`March::Reversal`] and [`March::Superposition`] the instants are the reversals, and t = 0.
    ///
    /// # Errors
    /// As for [`FrettingJoint::cycle`].
    pub fn cycle_with_fields(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<(CycleSolution, Vec<InstantFields>), WearError> {
        match (self.march, self.motion.straight()) {
            (March::Reversal | March::Superposition, Some(motion)) => {
                self.by_reversals(&motion, contact, start, wanted)
            }
            (March::Reversal | March::Superposition, None) => Err(WearError::NotStraight),
            (March::Stepped, _) => self.by_samples(wear, contact, start, wanted),
        }
    }

    /// The steady cycle of a straight motion is antisymmetric, q(T/2) = −q(0), so that a branch changes the shear by
    /// −2q(0) while the bodies move by −2δ: half of it is the first loading from zero shear, to the displacement δ.
    fn by_reversals(
        &mut self,
        motion: &StraightMotion,
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<(CycleSolution, Vec<InstantFields>), WearError> {
        let limit = self.limit(&contact.pressure);
        let zero = vec![0.0; motion.end.len()];
        let superposed = self.march == March::Superposition;
        let half = if superposed {
            self.superposed(contact, &motion.end, start)?
        } else {
            self.step(&limit, None, [&zero, &motion.end], start)?
        };
        let mut tally = CycleAccumulator::new(limit.len());
        tally.add(&half, 4.0);
        if let Some(own) = &self.motion.own
            && let Some(work) = own.work_of_cells()
        {
            tally.scale(&work, own.work_part, self.patch.grid.cell_area());
        }
        let load = self.motion.mean_load;
        let torsion = |place: &[f64], step: &TangentialSolution, sign: f64| {
            self.motion
                .rotation
                .as_ref()
                .map(|_| [place[step.displacement.len()], sign * step.moment])
        };
        let reached = found(&half);
        let cell_area = self.patch.grid.cell_area();
        let force_part = self.motion.own.as_ref().map_or(1.0, |own| own.force_part);
        let force_along = force_part * self.motion.force_along(&half.shear, cell_area);
        let instant = |time: f64, sign: f64| {
            let place: Vec<f64> = reached.iter().map(|d| sign * d).collect();
            Instant {
                time,
                displacement: place[..half.force.len()].to_vec(),
                normal_load: load,
                force: half.force.iter().map(|f| sign * f).collect(),
                force_along: sign * force_along,
                torsion: torsion(&place, &half, sign),
            }
        };
        if motion.top == 0 {
            let middle = self.motion.time_of(motion.bottom);
            let instants = vec![instant(0.0, 1.0), instant(middle, -1.0), instant(1.0, 1.0)];
            let ends = [(0, 1.0), (motion.bottom, -1.0), (0, 1.0)]
                .into_iter()
                .enumerate();
            let kept = ends
                .filter(|(k, _)| wanted(*k))
                .map(|(instant, (sample, sign))| InstantShear {
                    instant,
                    sample,
                    shear: times(&half.shear, sign),
                })
                .collect();
            let solution = tally.finish(cell_area, half.shear, instants);
            let fields = self.fields(contact, None, &solution, kept);
            return Ok((solution, fields));
        }
        // t = 0 lies on a branch: one more step from the end that precedes it.
        let (from, sign) = if motion.bottom > motion.top {
            (motion.bottom, -1.0)
        } else {
            (motion.top, 1.0)
        };
        let mut instants = vec![
            instant(0.0, 1.0),
            instant(
                self.motion.time_of(motion.top + motion.bottom - from),
                -sign,
            ),
            instant(self.motion.time_of(from), sign),
            instant(1.0, 1.0),
        ];
        let before = times(&half.shear, sign);
        let now = self.motion.at(0);
        let ahead: Vec<f64> = motion.end.iter().map(|end| sign * end).collect();
        let first = if superposed {
            // From an end on, shear and motion change by twice those of a first loading to half the change.
            let change: Vec<f64> = now.iter().zip(&ahead).map(|(n, a)| 0.5 * (n - a)).collect();
            let branch = self.superposed(contact, &change, None)?;
            twice(branch, &before, self.patch.grid)
        } else {
            self.step(&limit, Some(&before), [&ahead, &now], None)?
        };
        tally.count(&first);
        let place: Vec<f64> = self
            .motion
            .channels()
            .zip(&now)
            .zip(reached.iter().zip(found(&first)))
            .map(|((channel, now), (end, change))| match channel {
                Channel::Displacement(_) => *now,
                Channel::Force(_) => sign * end + change,
            })
            .collect();
        let turned = self
            .motion
            .rotation
            .as_ref()
            .map(|_| [place[first.force.len()], first.moment]);
        for at in [0, 3] {
            instants[at].displacement = place[..first.force.len()].to_vec();
            instants[at].force = first.force.clone();
            instants[at].force_along = self.motion.force_along(&first.shear, cell_area);
            instants[at].torsion = turned;
        }
        let to = motion.top + motion.bottom - from;
        let samples = [0, to, from, 0].into_iter().enumerate();
        let kept = samples
            .filter(|(k, _)| wanted(*k))
            .map(|(instant, sample)| InstantShear {
                instant,
                sample,
                shear: match instant {
                    1 => times(&before, -1.0),
                    2 => before.clone(),
                    _ => first.shear.clone(),
                },
            })
            .collect();
        let solution = tally.finish(cell_area, first.shear, instants);
        let fields = self.fields(contact, None, &solution, kept);
        Ok((solution, fields))
    }

    /// µp on every cell \[Pa\].
    pub fn limit(&self, pressure: &[f64]) -> Vec<f64> {
        pressure
            .iter()
            .map(|p| self.friction_coefficient * p)
            .collect()
    }

    /// One tangential step, between two states of the motion.
    pub fn step(
        &mut self,
        limit: &[f64],
        previous: Option<&ByAxis<Vec<f64>>>,
        [from, to]: [&[f64]; 2],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let options = match self.march {
            March::Stepped => self.options.tangential_in_sequence(),
            March::Reversal | March::Superposition => self.options.tangential,
        };
        self.step_within(options, limit, previous, [from, to], start)
    }

    /// A tangential step with other options than the cycle's.
    pub fn step_within(
        &mut self,
        options: TangentialOptions,
        limit: &[f64],
        previous: Option<&ByAxis<Vec<f64>>>,
        [from, to]: [&[f64]; 2],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let driven = self.motion.between(from, to);
        self.driven(options, limit, previous, &driven, start)
    }

    /// A tangential step that something drives.
    pub(super) fn driven(
        &mut self,
        options: TangentialOptions,
        limit: &[f64],
        previous: Option<&ByAxis<Vec<f64>>>,
        driven: &Step,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let problem = TangentialProblem {
            patch: &self.patch,
            limit,
            previous,
            drive: &driven.drive,
            rotation: driven.rotation,
            offset: driven.offset.as_ref(),
        };
        Ok(crate::contact::tangential::solve(
            &mut self.half_space,
            &problem,
            start,
            options,
        )?)
    }
}

/// What the channels moved by in a step: along the axes, then about z.
pub(super) fn found(step: &TangentialSolution) -> Vec<f64> {
    let axes = step.displacement.iter().copied();
    axes.chain([step.rotation]).collect()
}

/// Shear times a number.
fn times(shear: &ByAxis<Vec<f64>>, factor: f64) -> ByAxis<Vec<f64>> {
    let field = |q: &Vec<f64>| q.iter().map(|v| factor * v).collect();
    shear.iter().map(field).collect()
}

/// The step from the shear `before` that is twice a first loading.
fn twice(
    mut step: TangentialSolution,
    before: &ByAxis<Vec<f64>>,
    grid: Grid,
) -> TangentialSolution {
    step.displacement.iter_mut().for_each(|d| *d *= 2.0);
    for ((q, before), force) in step.shear.iter_mut().zip(before).zip(&mut step.force) {
        for (q, before) in q.iter_mut().zip(before) {
            *q = before + 2.0 * *q;
        }
        *force = q.iter().sum::<f64>() * grid.cell_area();
    }
    step
}

// The steady cycle of any motion, sample by sample.
//
// The cycle is marched twice, over every other sample until it closes and from there over all of them (`sequence`). The steps are
// of second order, so that a third of the change between the two takes slip path and energy of each cell to steps of no length, and the
// change says what is left.

/// What extrapolation leaves of the energy, in parts of what half of the samples change on all cells. Measured on rough joints, it is 0.1 most often
/// and 0.8 at most in 70 drawn ones, where the motion turns between samples.
const LEFT: f64 = 0.8;

/// What it leaves where the motion is a history: a table of places has corners, at which steps are of first order. Measured, it is 1.33 at most.
const LEFT_OF_HISTORY: f64 = 1.6;

/// The least of that change, in parts of the energy of a cell times the square of the samples: of a single cell half of them may change nothing by
/// chance.
const LEAST_CHANGE: f64 = 16.0;

/// Part of what a cell slips and dissipates that extrapolation leaves it at least: where half of the samples change it by more, it is
/// not yet of second order, and to take all of it would be to say that the cell sticks.
const LEAST_EXTRAPOLATED: f64 = 0.5;

/// Half of fewer samples has no inside.
pub(super) const FEWEST: usize = 8;

impl FrettingJoint {
    /// Marches sample by sample until the cycle closes. An odd number of samples, fewer than 8, and any without
    /// [`FrettingOptions::extrapolate`](super::joint::FrettingOptions::extrapolate) are marched once.
    ///
    /// The fields are those of the march over all samples: extrapolated are slip path and energy alone.
    pub(super) fn by_samples(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<(CycleSolution, Vec<InstantFields>), WearError> {
        let samples = self.motion.samples();
        // The last instant is the first one again.
        let instants: Vec<usize> = (0..=samples).filter(|k| wanted(*k)).collect();
        let limits = self.limits_over_cycle(wear, contact, !instants.is_empty())?;
        let halved = self.options.extrapolate && samples.is_multiple_of(2) && samples >= FEWEST;
        let cell_area = self.patch.grid.cell_area();
        let coarse = match halved {
            true => Some(Sequence::new(self, &limits, 2, start)?.close()?),
            false => None,
        };
        let start = coarse.as_ref().map_or(start, |coarse| Some(&coarse.shear));
        let Closed {
            mut tally,
            shear,
            instants: mut marched,
            mut kept,
        } = Sequence::new(self, &limits, 1, start)?
            .keeping(&instants)
            .close()?;
        let left = match self.motion.by_order {
            true => LEFT_OF_HISTORY,
            false => LEFT,
        };
        match &coarse {
            Some(coarse) => extrapolate(&mut tally, &coarse.tally, samples, left, cell_area),
            // So few samples say nothing of what they leave.
            None if self.options.extrapolate && samples < FEWEST => {
                let part = LEAST_CHANGE / (samples * samples) as f64;
                tally.dissipation_error += part * tally.energy.iter().sum::<f64>() * cell_area;
            }
            None => {}
        }
        self.about_their_middle(&mut marched);
        let solution = tally.finish(cell_area, shear, marched);
        let mut shear_of = |instant: usize| match instant {
            0 => kept.get(&0).cloned(),
            _ => kept.remove(&(instant % samples)),
        };
        let kept = instants.into_iter().map(|instant| InstantShear {
            instant,
            sample: instant % samples,
            shear: shear_of(instant).expect("every sample of a cycle is marched"),
        });
        let kept = kept.collect();
        let fields = self.fields(contact, Some(&limits), &solution, kept);
        Ok((solution, fields))
    }

    /// Shifts displacements that were found, and are known up to a constant, to the middle of their range.
    fn about_their_middle(&self, instants: &mut [Instant]) {
        let shift = |instants: &mut [Instant], value: fn(&mut Instant, usize) -> &mut f64, k| {
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for instant in instants.iter_mut() {
                let value = *value(instant, k);
                (least, most) = (least.min(value), most.max(value));
            }
            for instant in instants.iter_mut() {
                *value(instant, k) -= 0.5 * (least + most);
            }
        };
        for (axis, channel) in self.motion.drive.iter().enumerate() {
            if channel.is_force() {
                shift(
                    instants,
                    |instant, axis| &mut instant.displacement[axis],
                    axis,
                );
            }
        }
        if self.motion.rotation.as_ref().is_some_and(Channel::is_force) {
            let rotation: fn(&mut Instant, usize) -> &mut f64 =
                |instant, _| &mut instant.torsion.as_mut().expect("a rotation is driven")[0];
            shift(instants, rotation, 0);
        }
    }
}

/// Takes slip path and energy to steps of no length, and estimates what that leaves: the part `left` of what half of the samples change.
fn extrapolate(
    tally: &mut CycleAccumulator,
    coarse: &CycleAccumulator,
    samples: usize,
    left: f64,
    cell_area: f64,
) {
    let least = LEAST_CHANGE / (samples * samples) as f64;
    let changes = tally.energy.iter().zip(&coarse.energy);
    let change: f64 = changes
        .map(|(fine, coarse)| (fine - coarse).abs().max(least * fine))
        .sum();
    tally.steps += coarse.steps;
    tally.error = tally.error.max(coarse.error);
    let extrapolated = |fine: f64, coarse: f64| fine + (fine - coarse) / 3.0;
    for (fine, coarse) in [
        (&mut tally.energy, &coarse.energy),
        (&mut tally.slip_path, &coarse.slip_path),
    ] {
        for (fine, coarse) in fine.iter_mut().zip(coarse) {
            *fine = extrapolated(*fine, *coarse).max(LEAST_EXTRAPOLATED * *fine);
        }
    }
    // The errors of the solves are amplified as the energies are.
    let of_solves = [tally.dissipation_error, -coarse.dissipation_error];
    tally.dissipation_error = extrapolated(of_solves[0], of_solves[1]) + left * change * cell_area;
}

// The shear of Ciavarella and Jäger: two pressures superposed, in place of a tangential solve.
//
// Under constant load and a motion along a line d from rest, q = µ (p − p*) d, where p* is a pressure of the same surfaces at a
// reduced load, N* = N − T/µ, or a reduced approach, δ* = δ − u/(µκ), with κ the tangential over the normal compliance
// (Ciavarella 1998; Jäger 1998). Cells with p* > 0 stick. Between half spaces of one material this is exact where shear displaces
// as pressure does, κ times as far and along itself alone: for ν = 0. Otherwise it is an approximation: the stick cells
// slip a little and the displacement is not the one asked for. Both count in [`TangentialSolution::error`], the relative duality
// gap of this shear as the exact solve has it, for the true kernels.
//
// On the cells in contact p* is the pressure of heights K p against a flat, so that cells at the pressure's cap and bodies that
// turned are taken as they are.

/// Tolerance of the reduced pressure. What it leaves is far below the error of the superposition itself.
const SUPERPOSITION_TOLERANCE: f64 = 1e-3;

impl FrettingJoint {
    /// The first loading from rest to `end`, a state of the motion's channels, under the static `contact`. `start` is a shear of
    /// an earlier one, used for speed alone.
    ///
    /// # Errors
    /// [`WearError::NotSuperposed`] unless what moves is displaced, or loaded, along all its axes, and does not turn.
    pub(super) fn superposed(
        &mut self,
        contact: &NormalSolution,
        end: &[f64],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let axes = self.motion.drive.len();
        let (along, turned) = end.split_at(axes);
        let amount = along.iter().map(|e| e * e).sum::<f64>().sqrt();
        let moving = || {
            self.motion
                .drive
                .iter()
                .zip(along)
                .filter(|(_, e)| **e != 0.0)
        };
        let by_force = moving().any(|(channel, _)| channel.is_force());
        if turned.iter().any(|e| *e != 0.0) || moving().any(|(c, _)| c.is_force() != by_force) {
            return Err(WearError::NotSuperposed);
        }
        let limit = self.limit(&contact.pressure);
        let mut shear = vec![vec![0.0; limit.len()]; axes];
        if amount > 0.0 {
            let direction: Vec<f64> = along.iter().map(|e| e / amount).collect();
            let reduced = self.reduced(contact, &direction, amount, by_force, start)?;
            for (q, direction) in shear.iter_mut().zip(&direction) {
                let pressures = contact.pressure.iter().zip(&reduced);
                for (q, (p, reduced)) in q.iter_mut().zip(pressures) {
                    *q = self.friction_coefficient * (p - reduced.min(*p)) * direction;
                }
            }
        }
        let driven = self.motion.between(&vec![0.0; end.len()], end);
        let problem = TangentialProblem {
            patch: &self.patch,
            limit: &limit,
            previous: None,
            drive: &driven.drive,
            rotation: driven.rotation,
            offset: None,
        };
        Ok(tangential::evaluate(
            &mut self.half_space,
            &problem,
            &shear,
        )?)
    }

    /// The pressure p* on the cells in contact, 0 elsewhere.
    fn reduced(
        &mut self,
        contact: &NormalSolution,
        direction: &[f64],
        amount: f64,
        by_force: bool,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<Vec<f64>, WearError> {
        let pressure = &contact.pressure;
        let mut height = vec![0.0; pressure.len()];
        self.half_space.normal(pressure, &mut height);
        let control = if by_force {
            Control::Load((contact.load - amount / self.friction_coefficient).max(0.0))
        } else {
            let ratio = self.compliance_ratio(pressure, &height, direction);
            Control::Approach(-amount / (self.friction_coefficient * ratio))
        };
        let patch = Patch {
            grid: self.patch.grid,
            kept: pressure.iter().map(|p| *p > 0.0).collect(),
        };
        let first: Vec<f64> = match start {
            Some(shear) => (0..pressure.len())
                .map(|c| {
                    let q = shear.iter().map(|q| q[c] * q[c]).sum::<f64>().sqrt();
                    (pressure[c] - q / self.friction_coefficient).max(0.0)
                })
                .collect(),
            None => pressure.clone(),
        };
        let problem = NormalProblem {
            patch: &patch,
            height: &height,
            compliance: None,
            control,
            rotation: Rotation::FIXED,
            pressure_cap: None,
        };
        let options = NormalOptions {
            tolerance: self.options.normal.tolerance.max(SUPERPOSITION_TOLERANCE),
            ..self.options.normal
        };
        Ok(normal::solve(&mut self.half_space, &problem, Some(&first), options)?.pressure)
    }

    /// κ: the energy of shear in proportion to the pressure over that of the pressure.
    fn compliance_ratio(&mut self, pressure: &[f64], normal: &[f64], direction: &[f64]) -> f64 {
        let energy = |u: &[f64]| pressure.iter().zip(u).map(|(p, u)| p * u).sum::<f64>();
        let mut displacement = vec![0.0; pressure.len()];
        let tangential = match direction {
            [_] => {
                self.half_space.shear_x(pressure, &mut displacement);
                energy(&displacement)
            }
            _ => {
                let shear = [0, 1].map(|axis| {
                    let part = direction[axis];
                    pressure.iter().map(|p| part * p).collect::<Vec<f64>>()
                });
                let mut along_y = displacement.clone();
                self.half_space
                    .shear([&shear[0], &shear[1]], [&mut displacement, &mut along_y]);
                direction[0] * energy(&displacement) + direction[1] * energy(&along_y)
            }
        };
        tangential / energy(normal)
    }
}

// Cycles in which each place of a joint has a load of its own: its nodes come closer to each other at one end of the motion than at the
// other, although the load of the joint hardly varies.
//
// The static contact is found under the load of the joint, by the half spaces alone. From there on the nodes are displaced as the
// structure says, and what the cells between them answer with is the half spaces less what the mesh has of them
// ([`crate::contact::nodes`]), as it is in the plane.

impl FrettingJoint {
    /// The contacts at every sample, one after the other; none where every place has the load of the static contact.
    pub(super) fn contacts_by_place(
        &mut self,
        contact: &NormalSolution,
        mut each: impl FnMut(&Self, &NormalSolution),
    ) -> Result<bool, WearError> {
        let own = self.motion.own.as_ref();
        let Some(own) = own.filter(|own| !own.approach.is_empty()) else {
            return Ok(false);
        };
        let approaches = (0..self.motion.samples()).map(|k| own.approach_of_cells(k));
        let approaches: Vec<Vec<f64>> = approaches.collect();
        self.closer(contact, approaches, self.options.normal, &mut each)?;
        Ok(true)
    }

    /// Pressures where cells come closer than in a static contact by each of these \[m\], one field after the other \[Pa\].
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn pressures_by_place(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
    ) -> Result<Vec<Vec<f64>>, WearError> {
        let mut pressures = Vec::with_capacity(approaches.len());
        self.closer(contact, approaches, options, &mut |_, found| {
            pressures.push(found.pressure.clone());
        })?;
        Ok(pressures)
    }

    fn closer(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
        each: &mut impl FnMut(&Self, &NormalSolution),
    ) -> Result<(), WearError> {
        // The height under which the static contact is one of the kernel that answers the nodes.
        let mut rest = vec![0.0; self.patch.grid.len()];
        self.half_space.normal(&contact.pressure, &mut rest);
        rest.iter_mut().zip(&contact.gap).for_each(|(u, g)| *u -= g);
        let mut start = contact.pressure.clone();
        for mut height in approaches {
            height.iter_mut().zip(&rest).for_each(|(h, u)| *h += u);
            let problem = NormalProblem {
                patch: &self.patch,
                height: &height,
                compliance: None,
                control: Control::Approach(0.0),
                rotation: Rotation::Given([0.0; 2]),
                pressure_cap: self.pressure_cap,
            };
            let found = normal::solve(&mut self.half_space, &problem, Some(&start), options)?;
            each(self, &found);
            start = found.pressure;
        }
        Ok(())
    }
}

// The first loading of a joint along its motion, from rest to an end of it and beyond.

/// Relative duality gap of a point on the way: its force is in error by some thousandths of the largest. Half of the loop of a straight
/// motion is twice this loading (Masing), so that points are no more exact than what is made of the loop.
const TOLERANCE: f64 = 1e-5;

impl FrettingJoint {
    /// Shear of the cells at `parts` of the way from the middle of a straight motion to its end, ascending; 1 is the end \[Pa\].
    ///
    /// # Errors
    /// [`WearError::NotStraight`], and [`WearError::Contact`].
    pub fn loading(
        &mut self,
        contact: &NormalSolution,
        parts: &[f64],
    ) -> Result<Vec<ByAxis<Vec<f64>>>, WearError> {
        let motion = self.motion.straight().ok_or(WearError::NotStraight)?;
        let limit = self.limit(&contact.pressure);
        let rest = vec![0.0; motion.end.len()];
        let options = TangentialOptions {
            tolerance: TOLERANCE.max(self.options.tangential.tolerance),
            ..self.options.tangential
        };
        let mut shears: Vec<ByAxis<Vec<f64>>> = Vec::with_capacity(parts.len());
        for part in parts {
            let place: Vec<f64> = motion.end.iter().map(|d| part * d).collect();
            let step = self.step_within(options, &limit, None, [&rest, &place], shears.last())?;
            shears.push(step.shear);
        }
        Ok(shears)
    }
}
