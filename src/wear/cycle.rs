//! Steady fretting cycle: shear, slip and dissipated energy under a closed motion.
//!
//! The slip of a cell is δ − u. The displacement of the bodies is δ, and the elastic displacement of the cell is u.
//! Cells just outside the contact also have a slip, so that a cell that comes into contact has the slip of its
//! neighbours. The slip of stick cells is zero. The energy per area of a step is q·s, where s is the slip in the step
//! and q is the shear at the end of the step. The wear depth per cycle is α times the energy per area of the cycle [A
//! eq. 2.6]. If the load varies, the energy per area of a step is |s| times a mean friction limit. The mean is over the
//! friction limits at both ends of the step. The mean friction limit also gives the energy of cells that come into
//! contact or leave the contact.

use super::fields::{InstantFields, InstantShear};
use super::joint::{FrettingJoint, WearError};
use super::motion::{Channel, Step, StraightMotion};
use super::sequence::{ClosedCycle, SteadyStateMarch};

use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::tangential::{
    self, CellState, TangentialOptions, TangentialProblem, TangentialSolution,
};
use crate::grid::{ByAxis, Grid, Patch};

/// Method that computes the cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum March {
    /// One exact solve per branch between the two reversals of a straight motion at constant load.
    Reversal,
    /// One exact solve at every sample of the motion.
    Stepped,
    /// Fast approximation of `Reversal`. The approximate shear of Ciavarella and Jäger replaces the exact shear
    /// (Ciavarella 1998; Jäger 1998). [`CycleSolution::error`] reports the error of the approximate shear.
    Superposition,
}

/// Error of the energy after `CycleAccumulator::scale`, as a fraction of the correction by the total work. The energies
/// of lap joints of bars were compared with stepped cycles. The error was mostly below 0.4 of the correction, but the
/// error was larger in joints whose corners open.
const REDISTRIBUTION_ERROR: f64 = 0.4;

/// One instant of the cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Instant {
    /// Time as a fraction of the period.
    pub time: f64,
    /// Relative displacement \[m\]. Under a prescribed force, the displacement is known up to a constant. The program
    /// chooses the constant that puts the middle of the displacement's range at zero.
    pub displacement: ByAxis<f64>,
    /// Normal load \[N\].
    pub normal_load: f64,
    /// Tangential force \[N\].
    pub force: ByAxis<f64>,
    /// Force along the motion, [`Motion::force_along`](super::Motion::force_along) \[N\].
    pub force_along: f64,
    /// Rotation about z \[rad\] and moment about z \[N m\]; `None` if the motion has no rotation.
    pub torsion: Option<[f64; 2]>,
}

impl Instant {
    /// Subtracts `middle` from the displacements and, after them, from the rotation.
    pub(super) fn shift(&mut self, middle: &[f64]) {
        let rotation = self.torsion.iter_mut().map(|[rotation, _]| rotation);
        let place = self.displacement.iter_mut().chain(rotation);
        place.zip(middle).for_each(|(place, m)| *place -= m);
    }

    /// Returns the instant half a period later or earlier, for a cycle with opposite halves.
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

/// Steady cycle of a joint.
#[derive(Debug, Clone, PartialEq)]
pub struct CycleSolution {
    /// Shear at t = 0 \[Pa\], from which a later cycle starts.
    pub shear: ByAxis<Vec<f64>>,
    /// Slip path of each cell over a cycle, ∮|dv| \[m\]. The slip path is 0 on cells that stick throughout the cycle.
    pub slip_path: Vec<f64>,
    /// Dissipated energy per area and cycle, ∮|q||dv|; 0 on cells that never slip in contact \[J/m²\].
    pub energy: Vec<f64>,
    /// Dissipated energy per cycle, Σ `energy` dA \[J\].
    pub dissipation: f64,
    /// Computed instants, the first at t = 0 and the last at t = T.
    pub instants: Vec<Instant>,
    /// Newton steps of all tangential solves.
    pub steps: usize,
    /// Largest relative duality gap of all tangential solves.
    pub error: f64,
    /// Estimated error of `dissipation` \[J\]. The estimate sums the duality gaps of the solves and the remaining
    /// closure error of a stepped cycle. If the cycle was also computed over every other sample, the estimate of the
    /// error includes the sampling error.
    pub dissipation_error: f64,
}

impl CycleSolution {
    /// Returns half the range of the force along the motion \[N\].
    pub fn force_along(&self) -> f64 {
        let forces = self.instants.iter().map(|instant| instant.force_along);
        let ends = (f64::INFINITY, f64::NEG_INFINITY);
        let (least, most) = forces.fold(ends, |(least, most), f| (least.min(f), most.max(f)));
        0.5 * (most - least).max(0.0)
    }

    /// Returns the estimated relative error of `dissipation`, at most 1; 0 if nothing is dissipated.
    pub fn relative_error(&self) -> f64 {
        if self.dissipation > 0.0 {
            (self.dissipation_error / self.dissipation).min(1.0)
        } else {
            0.0
        }
    }
}

/// Sums of slip and energy over a cycle.
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

    /// Adds a step from rest, counted `times` times.
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

    /// Adds a step in which the cells moved by `moved` \[m\]. The arguments include the friction limits at both ends of
    /// the step \[Pa\]. For each cell, the arguments also include the fraction of the step in which the cell is in
    /// contact. A stick cell does not slip. The `moved` of a stick cell is an artefact of the second-order step after a
    /// slip that has just ended.
    pub(super) fn add_displaced_step(
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

    /// Adds the sums of another accumulator.
    pub(super) fn add_accumulator(&mut self, other: &CycleAccumulator) {
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

    /// Turns half a cycle into a whole one. The number of solves does not change.
    pub(super) fn double(&mut self) {
        let fields = [&mut self.slip_path, &mut self.energy];
        fields.into_iter().flatten().for_each(|v| *v *= 2.0);
        self.dissipation_error *= 2.0;
    }

    fn count(&mut self, step: &TangentialSolution) {
        self.steps += step.steps;
        self.error = self.error.max(step.error);
    }

    /// Multiplies slip path and energy of each cell by the cell's entry of `parts`, and all cells by one common factor.
    /// The total energy becomes `total_part` times the energy before. The entries of `parts` come from the nodal
    /// motion, in which a single cell may slip differently than in the cycle. Only `total_part` is reliable, so that
    /// `scale` adds a fraction of the correction to the error of the energy. If no slipping cell has a positive entry,
    /// all cells are multiplied by `total_part`.
    fn scale(&mut self, parts: &[f64], total_part: f64, cell_area: f64) {
        let before = self.energy.iter().sum::<f64>();
        let energies = self.energy.iter().zip(parts);
        let weighted = energies.map(|(energy, part)| energy * part).sum::<f64>();
        let cell_factor = |part: &f64| match weighted > 0.0 {
            true => part * total_part * before / weighted,
            false => total_part,
        };
        for values in [&mut self.slip_path, &mut self.energy] {
            let pairs = values.iter_mut().zip(parts);
            pairs.for_each(|(value, part)| *value *= cell_factor(part));
        }
        self.dissipation_error +=
            REDISTRIBUTION_ERROR * (total_part * before - weighted).abs() * cell_area;
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
    /// Computes the steady cycle on a surface worn by `wear`, whose static contact at the mean load is `contact`.
    ///
    /// `start` is the shear at t = 0 of an earlier cycle. With [`March::Stepped`], `start` is the initial shear of the
    /// joint, reduced to the new friction limits. With [`March::Reversal`], `start` only saves computing time.
    pub fn cycle(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<CycleSolution, WearError> {
        let (solution, _) = self.cycle_with_fields(wear, contact, start, &|_| false)?;
        Ok(solution)
    }

    /// Computes the steady cycle like [`FrettingJoint::cycle`], and the fields at the instants whose numbers
    /// are `wanted`. With [`March::Reversal`] and [`March::Superposition`] the instants are the reversals and
    /// t = 0.
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
                self.cycle_from_reversals(&motion, contact, start, wanted)
            }
            (March::Reversal | March::Superposition, None) => Err(WearError::NotStraight),
            (March::Stepped, _) => self.cycle_from_samples(wear, contact, start, wanted),
        }
    }

    /// The steady cycle of a straight motion is antisymmetric, q(T/2) = −q(0). A branch changes the shear by
    /// −2q(0) while the bodies move by −2δ. Half of that change is the first loading from zero shear to the
    /// displacement δ.
    fn cycle_from_reversals(
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
            self.superposed_shear(contact, &motion.end, start)?
        } else {
            self.step(&limit, None, [&zero, &motion.end], start)?
        };
        let mut tally = CycleAccumulator::new(limit.len());
        tally.add(&half, 4.0);
        if let Some(own) = &self.motion.nodal_motion
            && let Some(work) = own.work_of_cells()
        {
            tally.scale(&work, own.total_work_ratio, self.patch.grid.cell_area());
        }
        let load = self.motion.mean_load;
        let torsion = |place: &[f64], step: &TangentialSolution, sign: f64| {
            self.motion
                .rotation
                .as_ref()
                .map(|_| [place[step.displacement.len()], sign * step.moment])
        };
        let reached = step_displacements(&half);
        let cell_area = self.patch.grid.cell_area();
        let force_part = self
            .motion
            .nodal_motion
            .as_ref()
            .map_or(1.0, |own| own.force_ratio);
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
            let shears = ends
                .filter(|(k, _)| wanted(*k))
                .map(|(instant, (sample, sign))| InstantShear {
                    instant,
                    sample,
                    shear: times(&half.shear, sign),
                })
                .collect();
            let solution = tally.finish(cell_area, half.shear, instants);
            let fields = self.fields(contact, None, &solution, shears);
            return Ok((solution, fields));
        }
        // t = 0 lies on a branch: solve one more step from the preceding end.
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
        let now = self.motion.state_at(0);
        let ahead: Vec<f64> = motion.end.iter().map(|end| sign * end).collect();
        let first = if superposed {
            // From an end on, shear and motion change by twice the first loading to half the displacement.
            let change: Vec<f64> = now.iter().zip(&ahead).map(|(n, a)| 0.5 * (n - a)).collect();
            let branch = self.superposed_shear(contact, &change, None)?;
            twice(branch, &before, self.patch.grid)
        } else {
            self.step(&limit, Some(&before), [&ahead, &now], None)?
        };
        tally.count(&first);
        let place: Vec<f64> = self
            .motion
            .channels()
            .zip(&now)
            .zip(reached.iter().zip(step_displacements(&first)))
            .map(|((channel, now), (end, change))| match channel {
                Channel::Displacement(_) => *now,
                Channel::Force(_) => sign * end + change,
            })
            .collect();
        let torsion_at_start = self
            .motion
            .rotation
            .as_ref()
            .map(|_| [place[first.force.len()], first.moment]);
        for at in [0, 3] {
            instants[at].displacement = place[..first.force.len()].to_vec();
            instants[at].force = first.force.clone();
            instants[at].force_along = self.motion.force_along(&first.shear, cell_area);
            instants[at].torsion = torsion_at_start;
        }
        let to = motion.top + motion.bottom - from;
        let samples = [0, to, from, 0].into_iter().enumerate();
        let shears = samples
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
        let fields = self.fields(contact, None, &solution, shears);
        Ok((solution, fields))
    }

    /// Returns the friction limit µp of every cell \[Pa\].
    pub fn limit(&self, pressure: &[f64]) -> Vec<f64> {
        pressure
            .iter()
            .map(|p| self.friction_coefficient * p)
            .collect()
    }

    /// Solves one tangential step between two states of the motion.
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
        self.step_with_options(options, limit, previous, [from, to], start)
    }

    /// Solves a tangential step with options other than the cycle's.
    pub fn step_with_options(
        &mut self,
        options: TangentialOptions,
        limit: &[f64],
        previous: Option<&ByAxis<Vec<f64>>>,
        [from, to]: [&[f64]; 2],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let driven = self.motion.between(from, to);
        self.solve_driven_step(options, limit, previous, &driven, start)
    }

    /// Solves a tangential step with a given drive.
    pub(super) fn solve_driven_step(
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

/// Returns the displacements of a step along the axes, then the rotation about z.
pub(super) fn step_displacements(step: &TangentialSolution) -> Vec<f64> {
    let axes = step.displacement.iter().copied();
    axes.chain([step.rotation]).collect()
}

/// Returns the shear times a factor.
fn times(shear: &ByAxis<Vec<f64>>, factor: f64) -> ByAxis<Vec<f64>> {
    let field = |q: &Vec<f64>| q.iter().map(|v| factor * v).collect();
    shear.iter().map(field).collect()
}

/// Returns the step that starts from the shear `before` and is twice a first loading.
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

// Steady cycle of any motion, sample by sample.
//
// The program computes the cycle over every other sample until the cycle closes (`sequence`). The program then computes
// the cycle again over all samples. Because the steps are of second order, a third of the change between the two
// results is the remaining error. Adding a third of the change to the slip path and the energy of each cell
// extrapolates both to steps of zero length. The change between the two results also gives an error estimate.

/// Error of the energy after extrapolation, as a fraction of the change due to halving the steps, summed over
/// all cells. Measured on 70 random rough joints, the fraction is mostly 0.1. The fraction reaches 0.8 where the motion
/// turns between samples.
const EXTRAPOLATION_ERROR: f64 = 0.8;

/// Error of the energy after extrapolation as in [`EXTRAPOLATION_ERROR`], but if the motion is a history. The corners
/// of a history make the steps of first order. The measured fraction is at most 1.33.
const EXTRAPOLATION_ERROR_OF_HISTORY: f64 = 1.6;

/// Factor in the smallest change of energy that the error estimate assumes for a cell. The smallest change is the
/// energy of the cell times `LEAST_CHANGE`, divided by the square of the number of samples. Without a smallest change,
/// a cell whose energy happens not to change when the steps are halved would have no error.
const LEAST_CHANGE: f64 = 16.0;

/// Smallest number of samples that can be halved.
pub(super) const FEWEST_SAMPLES: usize = 8;

impl FrettingJoint {
    /// Computes the cycle sample by sample until it closes. If the number of samples is odd or below 8, the program
    /// computes the cycle once and does not extrapolate. The program also does not extrapolate if
    /// [`FrettingOptions::extrapolate`](super::joint::FrettingOptions::extrapolate) is false.
    ///
    /// The fields come from the cycle over all samples: only slip path and energy are extrapolated.
    pub(super) fn cycle_from_samples(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
        wanted: &dyn Fn(usize) -> bool,
    ) -> Result<(CycleSolution, Vec<InstantFields>), WearError> {
        let samples = self.motion.samples();
        // The last instant equals the first.
        let instants: Vec<usize> = (0..=samples).filter(|k| wanted(*k)).collect();
        let limits = self.limits_over_cycle(wear, contact, !instants.is_empty())?;
        let halved =
            self.options.extrapolate && samples.is_multiple_of(2) && samples >= FEWEST_SAMPLES;
        let cell_area = self.patch.grid.cell_area();
        let coarse = match halved {
            true => Some(SteadyStateMarch::new(self, &limits, 2, start)?.close()?),
            false => None,
        };
        let start = coarse.as_ref().map_or(start, |coarse| Some(&coarse.shear));
        let ClosedCycle {
            mut tally,
            shear,
            instants: mut marched,
            mut kept,
        } = SteadyStateMarch::new(self, &limits, 1, start)?
            .storing_shear_at(&instants)
            .close()?;
        let error_part = match self.motion.by_order {
            true => EXTRAPOLATION_ERROR_OF_HISTORY,
            false => EXTRAPOLATION_ERROR,
        };
        match &coarse {
            Some(coarse) => {
                let parts = (error_part, self.options.least_extrapolated);
                extrapolate(&mut tally, &coarse.tally, samples, parts, cell_area)
            }
            // Fewer samples than `FEWEST_SAMPLES` give no estimate of the sampling error.
            None if self.options.extrapolate && samples < FEWEST_SAMPLES => {
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
        let shears = instants.into_iter().map(|instant| InstantShear {
            instant,
            sample: instant % samples,
            shear: shear_of(instant).expect("every sample of a cycle is marched"),
        });
        let shears = shears.collect();
        let fields = self.fields(contact, Some(&limits), &solution, shears);
        Ok((solution, fields))
    }

    /// Shifts the displacements along axes with a prescribed force, which are known except for a constant. The middle
    /// of the range of the shifted displacements is zero.
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

/// Extrapolates slip path and energy to steps of zero length. Estimates the remaining error as `error_part`
/// times the change due to halving the steps.
fn extrapolate(
    tally: &mut CycleAccumulator,
    coarse: &CycleAccumulator,
    samples: usize,
    (error_part, least_extrapolated): (f64, f64),
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
            *fine = extrapolated(*fine, *coarse).max(least_extrapolated * *fine);
        }
    }
    // The extrapolation amplifies the errors of the solves like the energies.
    let solve_errors = [tally.dissipation_error, -coarse.dissipation_error];
    tally.dissipation_error =
        extrapolated(solve_errors[0], solve_errors[1]) + error_part * change * cell_area;
}

// Shear of Ciavarella and Jäger: the superposition of two pressures replaces a tangential solve.
//
// Under constant load and a motion along a line d from rest, q = µ (p − p*) d. The reduced pressure p* is the pressure
// between the same surfaces under the reduced load N* = N − T/µ. If the motion is prescribed, p* is the pressure at the
// reduced approach δ* = δ − u/(µκ). The ratio of the tangential to the normal compliance is κ (Ciavarella 1998; Jäger
// 1998). Cells with p* > 0 stick. Between half spaces of one material with ν = 0, the superposition of the two
// pressures is exact. For ν = 0, a shear displaces the surface only along the shear. The displacement by the shear is κ
// times the displacement by an equal pressure. For ν > 0 or two different materials, the superposition is an
// approximation. In the approximation, the stick cells slip a little, and the displacement differs from the prescribed
// displacement. [`TangentialSolution::error`] is the relative duality gap of the superposed shear for the true kernels.
// The duality gap includes the error of the slip and the error of the displacement.
//
// On the cells in contact, p* is the pressure of heights K p against a flat. The superposition uses only the pressure
// p, which already includes the effects of the pressure cap and of rotations. Capped cells and rotated bodies need no
// special treatment in the superposition.

/// Tolerance of the reduced pressure. The resulting error is far below the error of the superposition itself.
const SUPERPOSITION_TOLERANCE: f64 = 1e-3;

impl FrettingJoint {
    /// Computes the first loading from rest to `end`, a state of the motion's channels, under the static
    /// `contact`. `start` is the shear of an earlier loading, which only saves time.
    ///
    /// # Errors
    /// [`WearError::NotSuperposed`] unless all moving axes have a prescribed displacement, or all a
    /// prescribed force, and the motion has no rotation.
    pub(super) fn superposed_shear(
        &mut self,
        contact: &NormalSolution,
        end: &[f64],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let axes = self.motion.drive.len();
        let (along, rotation) = end.split_at(axes);
        let amount = along.iter().map(|e| e * e).sum::<f64>().sqrt();
        let moving = || {
            self.motion
                .drive
                .iter()
                .zip(along)
                .filter(|(_, e)| **e != 0.0)
        };
        let by_force = moving().any(|(channel, _)| channel.is_force());
        if rotation.iter().any(|e| *e != 0.0) || moving().any(|(c, _)| c.is_force() != by_force) {
            return Err(WearError::NotSuperposed);
        }
        let limit = self.limit(&contact.pressure);
        let mut shear = vec![vec![0.0; limit.len()]; axes];
        if amount > 0.0 {
            let direction: Vec<f64> = along.iter().map(|e| e / amount).collect();
            let reduced = self.reduced_pressure(contact, &direction, amount, by_force, start)?;
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

    /// Returns the pressure p* on the cells in contact, and 0 elsewhere.
    fn reduced_pressure(
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
            is_in_joint: pressure.iter().map(|p| *p > 0.0).collect(),
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

    /// Returns κ: the energy of a shear proportional to the pressure, over the energy of the pressure.
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

// Cycles in which the load of each node of a joint varies, although the total load hardly varies. The nodes of both
// bodies are closer together at one end of the motion than at the opposite end.
//
// The static contact under the total load uses the half spaces alone. During the cycle, the structure prescribes the
// nodal displacements. The compliance of the cells between the nodes is the compliance of the half spaces minus the
// compliance of the mesh ([`crate::contact::nodes`]). Displacements in the contact plane use the same difference of
// compliances.

impl FrettingJoint {
    /// Computes the contacts at all samples in order, and passes each to `each`. Returns false, without any
    /// contact, if every place keeps the load of the static contact.
    pub(super) fn local_contacts(
        &mut self,
        contact: &NormalSolution,
        mut each: impl FnMut(&Self, &NormalSolution),
    ) -> Result<bool, WearError> {
        let own = self.motion.nodal_motion.as_ref();
        let Some(own) = own.filter(|own| !own.approach.is_empty()) else {
            return Ok(false);
        };
        let approaches = (0..self.motion.samples()).map(|k| own.approach_of_cells(k));
        let approaches: Vec<Vec<f64>> = approaches.collect();
        self.solve_approaches(contact, approaches, self.options.normal, &mut each)?;
        Ok(true)
    }

    /// Computes the pressures if cells come closer than in the static contact by each field of `approaches`
    /// \[m\], in order \[Pa\].
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn local_pressures(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
    ) -> Result<Vec<Vec<f64>>, WearError> {
        let mut pressures = Vec::with_capacity(approaches.len());
        self.solve_approaches(contact, approaches, options, &mut |_, solution| {
            pressures.push(solution.pressure.clone());
        })?;
        Ok(pressures)
    }

    fn solve_approaches(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
        on_contact: &mut impl FnMut(&Self, &NormalSolution),
    ) -> Result<(), WearError> {
        // Heights `rest`, for which the pressure of the static contact also solves the contact problem with the nodal
        // kernel.
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
            let solution = normal::solve(&mut self.half_space, &problem, Some(&start), options)?;
            on_contact(self, &solution);
            start = solution.pressure;
        }
        Ok(())
    }
}

// First loading of a joint along its motion, from rest to an end of the motion and beyond.

/// Relative duality gap of a point of the first loading. The force at a point of the first loading has an error of some
/// thousandths of the largest force. The first loading needs no higher accuracy than the loop, because each half of the
/// loop is the first loading times two (Masing).
const TOLERANCE: f64 = 1e-5;

impl FrettingJoint {
    /// Computes the shear at points of the first loading of a straight motion \[Pa\]. Each value of `parts` is a
    /// fraction of the way from the middle of the motion to the end of the motion. The values of `parts` ascend, and 1
    /// is the end of the motion.
    ///
    /// # Errors
    /// [`WearError::NotStraight`], and [`WearError::Contact`].
    pub fn first_loading_shear(
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
            let step =
                self.step_with_options(options, &limit, None, [&rest, &place], shears.last())?;
            shears.push(step.shear);
        }
        Ok(shears)
    }
}
