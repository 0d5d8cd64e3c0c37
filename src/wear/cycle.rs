//! The steady fretting cycle: shear, slip and dissipated energy under a closed motion.
//!
//! Slip is the kinematic δ − u everywhere, also on cells just outside the contact, so that cells which wear brings into
//! contact begin to slip as their neighbours do. On stick cells it is zero. The energy of a step is q·s with the shear at
//! its end, and wear depth per cycle is α times the sum of it over the cycle [A eq. 2.6]; where the load varies it is |s| times the
//! mean of the limits at both ends, on cells that come into contact or leave it too.

use super::fields::{InstantFields, Kept};
use super::joint::{FrettingJoint, WearError};
use super::motion::{Channel, Step, StraightMotion};
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::{
    CellState, TangentialOptions, TangentialProblem, TangentialSolution,
};
use crate::grid::{ByAxis, Grid};

/// How the cycle is marched.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum March {
    /// One exact solve a branch between the two reversals of a straight motion at constant load.
    Reversal,
    /// One exact solve at every sample of the motion, see [`super::sampled`].
    Stepped,
    /// As `Reversal`, with the shear of Ciavarella and Jäger in place of the exact one: a fast mode and an approximation, see
    /// [`super::superposition`]. [`CycleSolution::error`] says how good.
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
pub(super) struct Tally {
    pub(super) slip_path: Vec<f64>,
    pub(super) energy: Vec<f64>,
    pub(super) steps: usize,
    pub(super) error: f64,
    /// Error of the dissipation \[J\].
    pub(super) dissipation_error: f64,
}

impl Tally {
    pub(super) fn new(cells: usize) -> Self {
        Tally {
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
    pub(super) fn join(&mut self, other: &Tally) {
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
        let Tally {
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
        let mut tally = Tally::new(limit.len());
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
                .map(|(instant, (sample, sign))| Kept {
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
            .map(|(instant, sample)| Kept {
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
