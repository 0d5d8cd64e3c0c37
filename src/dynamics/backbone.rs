//! Backbone of a resonance: frequency, damping ratio and amplitude of the phase resonance over the level of the force.
//!
//! The damping ratio is one of energy: ζ = E_d / (4π T), with the energy E_d that friction and damping take from the structure in a
//! cycle, in all harmonics, and the peak kinetic energy T = ½ ω² q̂ᴴ M q̂ of the fundamental q̂ of all coordinates. At the phase
//! resonance of a linear oscillator E_d = π c ω U² and T = ½ m ω² U², so that ζ = c / 2mω to rounding. For a motion in one mode it is
//! the modal damping ratio of the extended periodic motion concept (M. Krack, Computers & Structures 154, 2015, 59), whose
//! fundamental dissipates 2π ζ ω² a² at the modal amplitude a = √(q̂ᴴ M q̂).

use std::f64::consts::PI;

use num_complex::Complex64;

use super::closed_model::ClosedModel;
use super::contact_element::{ContactElement, ElementState};
use super::{DynamicsError, Energy, HarmonicBalance, Response, Start, Vibration};
use crate::linalg::RowMatrix as Matrix;

/// The largest step of the force, as its logarithm, and the first: some three points a decade of a straight line.
const LARGEST_STEP: f64 = 0.8;
/// Most that one step grows over the one before.
const GROWTH: f64 = 2.0;
/// What a step is reduced to where Newton's method fails, or where it has led too far.
const REDUCTION: f64 = 0.3;
/// Step of the force, relative, below which the phase resonance has ceased: at a saturating friction limit the amplitude is some 1e4 times
/// that at which sliding begins.
const LEAST_STEP: f64 = 1e-5;
/// Steps this small are not reduced for the look of the curve.
const FINE_STEP: f64 = 0.03;
/// Most by which the amplitude may grow faster than the force in a step, or fall, as a logarithm; beyond, the step may have left the branch.
const LEAP: f64 = 0.4;
/// Most by which the frequency may change in a step, relative; beyond, it may be the resonance of another mode.
const OTHER_MODE: f64 = 0.05;
/// Deviation from the line through the two points before: of the logarithms of amplitude and damping ratio, and of that of frequency. The
/// line between two points is eight times nearer to the curve than the line beyond them.
const BEND: [f64; 3] = [0.05, 0.05, 2e-3];
/// A step that bends by more than this many times as much is taken again with a smaller one.
const SHARP: f64 = 4.0;
/// Factor to the next level at which a first phase resonance is looked for.
const ASCENT: f64 = 4.0;
/// Growth of the amplitude over that of the force, both as logarithms, from which nothing but friction at its limit is the reason.
const UNBOUNDED: f64 = 100.0;

/// Levels of the force at which the backbone is wanted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Levels {
    /// Half range of the drive to begin at \[N\].
    pub from: f64,
    /// The one to end at \[N\].
    pub to: f64,
    /// Levels between them, both ends included, of equal ratio; none: as many as the curve needs to be drawn with lines.
    pub count: Option<usize>,
}

/// One phase resonance of a backbone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BackbonePoint {
    /// Counted from 0, one more after each force at which the amplitude leaps.
    pub branch: usize,
    /// Half range of the drive \[N\].
    pub force: f64,
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Damping ratio: what is dissipated over 4π times `kinetic_energy`.
    pub damping_ratio: f64,
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Peak kinetic energy of the first harmonic: that of all coordinates, twice its mean over the cycle \[J\].
    pub kinetic_energy: f64,
    /// Energy per cycle, in all harmonics.
    pub energy: Energy,
    /// Contact elements that slide somewhere in the cycle, and do not open.
    pub sliding: usize,
    /// Contact elements that open somewhere in the cycle.
    pub open: usize,
    /// All contact elements.
    pub elements: usize,
}

impl BackbonePoint {
    /// Share of the contact elements that slide; 0 without elements.
    pub fn sliding_fraction(&self) -> f64 {
        self.share(self.sliding)
    }

    /// Share of the contact elements that open; 0 without elements.
    pub fn open_fraction(&self) -> f64 {
        self.share(self.open)
    }

    fn share(&self, elements: usize) -> f64 {
        match self.elements {
            0 => 0.0,
            all => elements as f64 / all as f64,
        }
    }
}

/// Where a backbone ends.
#[derive(Debug, Clone, PartialEq)]
pub enum BackboneEnd {
    /// At the last level.
    Reached,
    /// Below the last level: friction at its limit takes no more energy, and nothing else bounds the amplitude.
    Unbounded {
        /// The force at which there is no phase resonance any more \[N\].
        force: f64,
        /// Growth of the amplitude over that of the force before it, both as logarithms.
        growth: f64,
    },
    /// Below the last level, for another reason.
    Ceased {
        /// The force at which no phase resonance was found \[N\].
        force: f64,
        /// What the solver says.
        source: DynamicsError,
    },
    /// Below the last level: the next phase resonance is that of another mode.
    OtherMode {
        /// The force at which it is found \[N\].
        force: f64,
    },
}

/// Phase resonances over the level of the force.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbone {
    /// In the order of the force.
    pub points: Vec<BackbonePoint>,
    /// Why there is none at the least level, where the backbone begins above it.
    pub begin: Option<DynamicsError>,
    /// Where and why it ends.
    pub end: BackboneEnd,
    /// Phase resonances that were solved for, those included that are no point.
    pub solves: usize,
    /// Newton iterations of them.
    pub iterations: usize,
}

/// A point with what the next one starts from.
#[derive(Clone)]
struct Place {
    point: BackbonePoint,
    start: Start,
}

impl Place {
    /// Logarithms of amplitude, damping ratio and frequency.
    fn shape(&self) -> [f64; 3] {
        let point = &self.point;
        [point.amplitude, point.damping_ratio, point.frequency].map(f64::ln)
    }

    /// How much further than `before` the force is, as a logarithm.
    fn beyond(&self, before: &Place) -> f64 {
        (self.point.force / before.point.force).ln()
    }

    /// Growth of the shape over that of the force.
    fn slope(&self, before: &Place) -> [f64; 3] {
        let (old, new) = (before.shape(), self.shape());
        [0, 1, 2].map(|k| (new[k] - old[k]) / self.beyond(before))
    }
}

impl Vibration {
    /// The backbone of the phase resonance of `balance`, upwards from the least level. The level scales all loads but constant ones. It
    /// begins with the strongest phase resonance of the least level in the range of the vibration and stays on its branch; where the
    /// amplitude leaps at a force, and the frequency hardly, it goes on behind the leap as another branch.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] for levels that are no range, or a balance without a drive; that of
    /// [`HarmonicBalance::phase_resonance`] at the least level if there is none at a higher one either. Where the resonance ceases on the
    /// way up, the backbone ends.
    pub fn backbone(
        &self,
        balance: HarmonicBalance<ContactElement>,
        levels: Levels,
    ) -> Result<Backbone, DynamicsError> {
        let targets = levels.targets()?;
        let drive = balance.drive();
        let drive = drive.map_or(0.0, |load| load.cosine.hypot(load.sine));
        let mut climb = Climb {
            vibration: self,
            rows: balance.load_rows.clone(),
            balance,
            drive,
            solves: 0,
            iterations: 0,
        };
        climb.along(&targets, levels.count.is_none())
    }
}

impl Levels {
    fn targets(&self) -> Result<Vec<f64>, DynamicsError> {
        let Levels { from, to, count } = *self;
        for (name, value, expected, is_right) in [
            (
                "the least force of the backbone",
                from,
                "a positive finite number of newtons",
                from > 0.0 && from.is_finite(),
            ),
            (
                "the largest force of the backbone",
                to,
                "a finite number of newtons above the least force",
                to > from && to.is_finite(),
            ),
            (
                "the number of levels of the backbone",
                count.unwrap_or(2) as f64,
                "2 or more",
                count.is_none_or(|count| count >= 2),
            ),
        ] {
            if !is_right {
                return Err(DynamicsError::OutOfRange {
                    name,
                    value,
                    expected,
                });
            }
        }
        let last = count.unwrap_or(2) - 1;
        let level = |k: usize| match k {
            0 => from,
            k if k == last => to,
            k => from * (to / from).powf(k as f64 / last as f64),
        };
        Ok((0..=last).map(level).collect())
    }
}

/// The way up a backbone.
struct Climb<'a> {
    vibration: &'a Vibration,
    balance: HarmonicBalance<ContactElement>,
    /// Rows of coefficients of the loads as they are given \[N\].
    rows: Vec<f64>,
    /// Half range of the drive among them \[N\].
    drive: f64,
    solves: usize,
    iterations: usize,
}

impl Climb<'_> {
    /// Through all targets; with `is_free` every phase resonance that is solved for is a point, and they lie as near as the curve bends.
    fn along(&mut self, targets: &[f64], is_free: bool) -> Result<Backbone, DynamicsError> {
        let (mut last, begin) = self.first(targets)?;
        let mut before: Option<Place> = None;
        // What a step that was too long has led to.
        let mut beyond: Option<Place> = None;
        let mut points = Vec::new();
        if is_free || begin.is_none() {
            points.push(last.point);
        }
        let mut step = LARGEST_STEP;
        let mut end = BackboneEnd::Reached;
        'targets: for &target in &targets[1..] {
            while last.point.force < target {
                // No crumb is left before a target.
                let far = (target / last.point.force).ln();
                let force = match far <= 1.2 * step {
                    true => target,
                    false => last.point.force * step.exp(),
                };
                let distance = (force / last.point.force).ln();
                let found = self.step(before.as_ref(), &last, force);
                if let Ok(next) = &found
                    && !is_leap(&last, next)
                {
                    let bend = bend(before.as_ref(), &last, next);
                    if is_free && bend > SHARP && distance > FINE_STEP {
                        step = distance * (1.0 / bend).sqrt().max(REDUCTION);
                        continue;
                    }
                    beyond = None;
                    step = next_step(distance, bend, next.slope(&last)[0]);
                } else if distance > LEAST_STEP {
                    beyond = found.ok().or(beyond);
                    step = REDUCTION * distance;
                    continue;
                }
                let leap = found.as_ref().is_ok_and(|next| is_leap(&last, next));
                let (mut next, leap) = match (found, beyond.take()) {
                    (Ok(next), _) if !leap => (next, false),
                    (Ok(next), _) | (Err(_), Some(next)) if is_same_mode(&last, &next) => {
                        (next, true)
                    }
                    (found, _) => {
                        end = ended(before.as_ref(), &last, force, found.err());
                        break 'targets;
                    }
                };
                if leap {
                    let end_here = ended(before.as_ref(), &last, force, None);
                    if let BackboneEnd::Unbounded { .. } = end_here {
                        end = end_here;
                        break 'targets;
                    }
                    next.point.branch += 1;
                    step = LARGEST_STEP;
                }
                before = (!leap).then_some(last);
                last = next;
                if is_free || last.point.force >= target {
                    points.push(last.point);
                }
            }
        }
        Ok(Backbone {
            points,
            begin,
            end,
            solves: self.solves,
            iterations: self.iterations,
        })
    }

    /// The phase resonance of the least level, or the least that there is, and why it is not the other. Where nothing but friction bounds
    /// it, it hangs at the onset of sliding, is reached from a higher level more easily, and is not seen by samples at a level far below.
    fn first(&mut self, targets: &[f64]) -> Result<(Place, Option<DynamicsError>), DynamicsError> {
        let (least, most) = (targets[0], targets[targets.len() - 1]);
        let mut force = least;
        let mut failure = None;
        let mut last = loop {
            self.load(force);
            self.solves += 1;
            match self.balance.phase_resonance(self.vibration.range, None) {
                Ok(response) => break self.place(force, &response)?,
                Err(error) => failure = failure.or(Some(error)),
            }
            force *= ASCENT;
            if let (Some(error), true) = (&failure, force > most) {
                return Err(error.clone());
            }
        };
        let Some(failure) = failure else {
            return Ok((last, None));
        };
        let mut step = LARGEST_STEP;
        while last.point.force > least {
            let force = (last.point.force * (-step).exp()).max(least);
            match self.step(None, &last, force) {
                Ok(next) if !is_leap(&last, &next) => last = next,
                _ if step > FINE_STEP => step *= REDUCTION,
                _ => return Ok((last, Some(failure))),
            }
        }
        Ok((last, None))
    }

    /// Sets the loads to a level: all but the constant ones are scaled.
    fn load(&mut self, force: f64) {
        let n = self.balance.harmonics().coefficients();
        let mean = self.balance.harmonics().slot_of(0);
        let factor = force / self.drive;
        let rows = self.balance.load_rows.iter_mut().zip(&self.rows);
        for (index, (load, given)) in rows.enumerate() {
            *load = match Some(index % n) == mean {
                true => *given,
                false => factor * given,
            };
        }
    }

    /// The phase resonance at a force, from where the last two lead.
    fn step(
        &mut self,
        before: Option<&Place>,
        last: &Place,
        force: f64,
    ) -> Result<Place, DynamicsError> {
        self.load(force);
        let mut start = last.start.clone();
        match before {
            Some(before) => {
                let share = (force - last.point.force) / (last.point.force - before.point.force);
                start.omega += share * (last.start.omega - before.start.omega);
                let pairs = start
                    .displacement
                    .iter_mut()
                    .zip(&before.start.displacement);
                pairs.for_each(|(u, old)| *u += share * (*u - old));
            }
            None => {
                let ratio = force / last.point.force;
                start.displacement.iter_mut().for_each(|u| *u *= ratio);
            }
        }
        let range = self.vibration.range;
        self.solves += 1;
        // Where the curve bends, what is straight ahead may be farther than where it comes from.
        let response = match self.balance.phase_resonance_near(range, &start) {
            Ok(response) => response,
            Err(_) => self.balance.phase_resonance_near(range, &last.start)?,
        };
        let mut place = self.place(force, &response)?;
        place.point.branch = last.point.branch;
        Ok(place)
    }

    fn place(&mut self, force: f64, response: &Response) -> Result<Place, DynamicsError> {
        self.iterations += response.iterations;
        let balance = &self.balance;
        let kinetic_energy = balance.kinetic_energy(&self.vibration.model.mass, response)?;
        let states = balance.joint_summary(response).states;
        // Elements without unknowns stick, whatever rounding makes of their samples.
        let active = || states.iter().zip(&response.active);
        let count = |of: &[ElementState]| {
            let are = active().filter(|(state, active)| **active && of.contains(state));
            are.count()
        };
        let mut energy = response.energy;
        if response.active_elements() == 0 {
            // Springs take nothing: what is left of their work is rounding.
            energy.friction = 0.0;
        }
        Ok(Place {
            point: BackbonePoint {
                branch: 0,
                force,
                frequency: response.frequency(),
                damping_ratio: (energy.friction + energy.viscous) / (4.0 * PI * kinetic_energy),
                amplitude: balance.amplitude(response, self.vibration.response_port)?.0,
                kinetic_energy,
                energy,
                sliding: count(&[ElementState::Partial, ElementState::Slip]),
                open: count(&[ElementState::Open]),
                elements: states.len(),
            },
            start: response.start(),
        })
    }
}

impl HarmonicBalance<ContactElement> {
    /// Peak kinetic energy of the first harmonic, ½ ω² q̂ᴴ M q̂, in the coordinates of the structure with the mass matrix `mass`. What
    /// moves by the static residual of modes left out has no mass.
    fn kinetic_energy(&self, mass: &Matrix, response: &Response) -> Result<f64, DynamicsError> {
        let harmonics = self.harmonics();
        let slot = harmonics.require(1, "kinetic energy of the first harmonic")?;
        let n = harmonics.coefficients();
        // All forces on the structure closed by its reference springs: loads, and contact forces beyond the reference.
        let mut ports = self.load_ports.clone();
        let mut rows = self.load_rows.clone();
        rows.iter_mut().for_each(|f| *f *= response.load_factor);
        let displacement = response.displacement.chunks(n);
        for (dof, (force, u)) in response.force.chunks(n).zip(displacement).enumerate() {
            if response.active[dof / 3] {
                let stiffness = self.reference[dof / 3][dof % 3];
                ports.push(dof);
                rows.extend(force.iter().zip(u).map(|(f, u)| stiffness * u - f));
            }
        }
        let generalised = self.model.generalised(harmonics, &ports, &rows);
        let index = harmonics.orders().iter().position(|order| *order == 1);
        let (core, index) = (
            self.model.core.receptance(response.omega)?,
            index.unwrap_or(1),
        );
        debug_assert_eq!(harmonics.slot(index), slot);
        let (q, _) = ClosedModel::amplitudes(harmonics, index, &core, &generalised);
        let inertia: f64 = (0..mass.rows())
            .map(|i| {
                let row = mass.row(i).iter().zip(&q);
                let momentum: Complex64 = row.map(|(m, q)| *q * *m).sum();
                (q[i].conj() * momentum).re
            })
            .sum();
        Ok(0.5 * response.omega.powi(2) * inertia)
    }
}

/// True where amplitude or frequency change by more than a step along a branch should change them: an amplitude that friction holds does
/// not grow, one that nothing but damping holds grows as the force.
fn is_leap(last: &Place, next: &Place) -> bool {
    let (old, new, step) = (last.shape(), next.shape(), next.beyond(last));
    let along = step.min(0.0) - LEAP..=step.max(0.0) + LEAP;
    !(along.contains(&(new[0] - old[0])) && (new[2] - old[2]).abs() <= OTHER_MODE)
}

/// False where the frequency leaps: that is the resonance of another mode.
fn is_same_mode(last: &Place, next: &Place) -> bool {
    (next.shape()[2] - last.shape()[2]).abs() <= OTHER_MODE
}

/// Deviation of `next` from the line through the two before, in parts of [`BEND`]; through the last alone, amplitude grows as the force.
fn bend(before: Option<&Place>, last: &Place, next: &Place) -> f64 {
    let slope = before.map_or([1.0, 0.0, 0.0], |before| last.slope(before));
    let (old, new, step) = (last.shape(), next.shape(), next.beyond(last));
    let deviations = [0, 1, 2].map(|k| (new[k] - old[k] - slope[k] * step).abs() / BEND[k]);
    // What is not damped at all has no logarithm, and no bend.
    deviations
        .into_iter()
        .filter(|d| d.is_finite())
        .fold(0.0, f64::max)
}

/// The step after one of `distance` with this bend and growth of the amplitude: as long as bend and growth allow.
fn next_step(distance: f64, bend: f64, growth: f64) -> f64 {
    let by_bend = distance * (1.0 / bend.max(1e-3)).sqrt().clamp(REDUCTION, GROWTH);
    let by_growth = 0.7 * LEAP / (growth - 1.0).max(-growth).max(1e-3);
    by_bend.min(by_growth).clamp(2.0 * LEAST_STEP, LARGEST_STEP)
}

/// Why the backbone ends before `force`.
fn ended(
    before: Option<&Place>,
    last: &Place,
    force: f64,
    source: Option<DynamicsError>,
) -> BackboneEnd {
    let growth = before.map_or(1.0, |before| last.slope(before)[0]);
    match source {
        _ if growth > UNBOUNDED => BackboneEnd::Unbounded { force, growth },
        Some(source) => BackboneEnd::Ceased { force, source },
        None => BackboneEnd::OtherMode { force },
    }
}
