//! The way along a branch of phase resonances, from level to level of the force or of another parameter.

use std::f64::consts::PI;

use super::backbone::{Backbone, BackboneEnd, BackbonePoint, DrivenStructure};
use super::contact_element::ElementState;
use super::{DynamicsError, Response, Start};

/// The largest step of the level, as its logarithm, and the first: some three points a decade of a straight line.
const LARGEST_STEP: f64 = 0.8;
/// Most that one step grows over the one before.
const GROWTH: f64 = 2.0;
/// What a step is reduced to where Newton's method fails, or where it has led too far.
const REDUCTION: f64 = 0.3;
/// Step of the level, relative, below which the phase resonance has ceased: at a saturating friction limit the amplitude is some 1e4 times
/// that at which sliding begins.
const LEAST_STEP: f64 = 1e-5;
/// Steps this small are not reduced for the look of the curve.
const FINE_STEP: f64 = 0.03;
/// Most by which the amplitude may grow faster than the level in a step, or fall, as a logarithm; beyond, the step may have left the branch.
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

    /// How much further than `before` the level is, as a logarithm.
    fn beyond(&self, before: &Place) -> f64 {
        (self.point.level / before.point.level).ln()
    }

    /// Growth of the shape over that of the level.
    fn slope(&self, before: &Place) -> [f64; 3] {
        let (old, new) = (before.shape(), self.shape());
        [0, 1, 2].map(|k| (new[k] - old[k]) / self.beyond(before))
    }
}

/// What the levels are of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LevelParameter {
    /// The force: an amplitude that friction holds does not grow with it, one that nothing but damping holds grows as it does.
    Force,
    /// Another parameter, over which the amplitude may rise or fall.
    Parameter,
}

/// The way along a backbone, from level to level. `set` brings the structure to a level.
pub struct Branch<S> {
    driven: DrivenStructure,
    set: S,
    over: LevelParameter,
    /// 1 where levels rise, −1 where they fall.
    direction: f64,
    solves: usize,
    iterations: usize,
}

/// A phase resonance, or why there is none.
type Found = Result<Place, DynamicsError>;

impl<S> Branch<S> {
    pub fn new(driven: DrivenStructure, set: S, over: LevelParameter) -> Branch<S> {
        Branch {
            driven,
            set,
            over,
            direction: 1.0,
            solves: 0,
            iterations: 0,
        }
    }

    /// Through all targets; with `is_free` every phase resonance that is solved for is a point, and they lie as near as the curve bends.
    /// An error of `set` behind the first point ends the backbone and stands beside it.
    ///
    /// # Errors
    /// That of `set` before the first point, and that of the solver at the first level if there is no phase resonance at a later one
    /// either.
    pub fn along<E>(&mut self, targets: &[f64], is_free: bool) -> Result<(Backbone, Option<E>), E>
    where
        E: From<DynamicsError>,
        S: FnMut(&mut DrivenStructure, f64) -> Result<(), E>,
    {
        self.direction = (targets[targets.len() - 1] - targets[0]).signum();
        let (mut last, begin) = self.first(targets)?;
        let mut before: Option<Place> = None;
        // What a step that was too long has led to.
        let mut beyond: Option<Place> = None;
        let (mut points, mut folds) = (Vec::new(), Vec::new());
        if is_free || begin.is_none() {
            points.push(last.point);
        }
        let mut step = LARGEST_STEP;
        let mut end = BackboneEnd::Reached;
        let mut broken = None;
        'targets: for &target in &targets[1..] {
            while self.is_before(last.point.level, target) {
                // No crumb is left before a target.
                let far = (target / last.point.level).ln().abs();
                let level = match far <= 1.2 * step {
                    true => target,
                    false => last.point.level * (self.direction * step).exp(),
                };
                let distance = (level / last.point.level).ln().abs();
                let found = match self.step(before.as_ref(), &last, level) {
                    Ok(found) => found,
                    Err(error) => {
                        end = BackboneEnd::Broken { level };
                        broken = Some(error);
                        break 'targets;
                    }
                };
                if let Ok(next) = &found
                    && !self.over.is_leap(&last, next)
                {
                    let bend = self.over.bend(before.as_ref(), &last, next);
                    if is_free && bend > SHARP && distance > FINE_STEP {
                        step = distance * (1.0 / bend).sqrt().max(REDUCTION);
                        continue;
                    }
                    beyond = None;
                    step = self.over.next_step(distance, bend, next.slope(&last)[0]);
                } else if distance > LEAST_STEP {
                    beyond = found.ok().or(beyond);
                    step = REDUCTION * distance;
                    continue;
                }
                let leap = found.as_ref();
                let leap = leap.is_ok_and(|next| self.over.is_leap(&last, next));
                let (mut next, leap) = match (found, beyond.take()) {
                    (Ok(next), _) if !leap => (next, false),
                    (Ok(next), _) | (Err(_), Some(next)) if is_same_mode(&last, &next) => {
                        (next, true)
                    }
                    (found, _) => {
                        end = self.over.ended(before.as_ref(), &last, level, found.err());
                        break 'targets;
                    }
                };
                if leap {
                    let end_here = self.over.ended(before.as_ref(), &last, level, None);
                    if let BackboneEnd::Unbounded { .. } = end_here {
                        end = end_here;
                        break 'targets;
                    }
                    folds.push(last.point.level);
                    next.point.branch += 1;
                    step = LARGEST_STEP;
                }
                before = (!leap).then_some(last);
                last = next;
                if is_free || !self.is_before(last.point.level, target) {
                    points.push(last.point);
                }
            }
        }
        let backbone = Backbone {
            points,
            begin,
            folds,
            end,
            solves: self.solves,
            iterations: self.iterations,
        };
        Ok((backbone, broken))
    }

    /// True if a level lies before another on the way.
    fn is_before(&self, level: f64, other: f64) -> bool {
        self.direction * (other - level) > 0.0
    }

    /// The phase resonance of the first level, or the first that there is, and why it is not the other. Where nothing but friction bounds
    /// it, it hangs at the onset of sliding, is reached from a higher force more easily, and is not seen by samples at a force far below.
    fn first<E>(&mut self, targets: &[f64]) -> Result<(Place, Option<DynamicsError>), E>
    where
        E: From<DynamicsError>,
        S: FnMut(&mut DrivenStructure, f64) -> Result<(), E>,
    {
        let (least, most) = (targets[0], targets[targets.len() - 1]);
        let mut level = least;
        let mut failure = None;
        let mut last = loop {
            (self.set)(&mut self.driven, level)?;
            self.solves += 1;
            let DrivenStructure { balance, range, .. } = &self.driven;
            match balance.phase_resonance(*range, None) {
                Ok(response) => break self.place(level, &response)?,
                Err(error) => failure = failure.or(Some(error)),
            }
            level *= ASCENT.powf(self.direction);
            if let (Some(error), true) = (&failure, self.is_before(most, level)) {
                return Err(error.clone().into());
            }
        };
        let Some(failure) = failure else {
            return Ok((last, None));
        };
        let mut step = LARGEST_STEP;
        while self.is_before(least, last.point.level) {
            let level = last.point.level * (-self.direction * step).exp();
            let level = match self.is_before(level, least) {
                true => least,
                false => level,
            };
            match self.step(None, &last, level)? {
                Ok(next) if !self.over.is_leap(&last, &next) => last = next,
                _ if step > FINE_STEP => step *= REDUCTION,
                _ => return Ok((last, Some(failure))),
            }
        }
        Ok((last, None))
    }

    /// The phase resonance at a level, from where the last two lead.
    fn step<E>(&mut self, before: Option<&Place>, last: &Place, level: f64) -> Result<Found, E>
    where
        S: FnMut(&mut DrivenStructure, f64) -> Result<(), E>,
    {
        (self.set)(&mut self.driven, level)?;
        Ok(self.solve(before, last, level))
    }

    fn solve(&mut self, before: Option<&Place>, last: &Place, level: f64) -> Found {
        let mut start = last.start.clone();
        match before {
            Some(before) => {
                let share = (level - last.point.level) / (last.point.level - before.point.level);
                start.omega += share * (last.start.omega - before.start.omega);
                let pairs = start
                    .displacement
                    .iter_mut()
                    .zip(&before.start.displacement);
                pairs.for_each(|(u, old)| *u += share * (*u - old));
            }
            None if self.over == LevelParameter::Force => {
                let ratio = level / last.point.level;
                start.displacement.iter_mut().for_each(|u| *u *= ratio);
            }
            None => {}
        }
        self.solves += 1;
        let DrivenStructure { balance, range, .. } = &self.driven;
        // Where the curve bends, what is straight ahead may be farther than where it comes from.
        let response = match balance.phase_resonance_near(*range, &start) {
            Ok(response) => response,
            Err(_) => balance.phase_resonance_near(*range, &last.start)?,
        };
        let mut place = self.place(level, &response)?;
        place.point.branch = last.point.branch;
        Ok(place)
    }

    fn place(&mut self, level: f64, response: &Response) -> Found {
        self.iterations += response.iterations;
        let DrivenStructure { balance, mass, .. } = &self.driven;
        let kinetic_energy = balance.kinetic_energy(mass, response)?;
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
                level,
                force: match self.over {
                    LevelParameter::Force => level,
                    LevelParameter::Parameter => self.driven.drive(),
                },
                frequency: response.frequency(),
                damping_ratio: (energy.friction + energy.viscous + energy.hysteretic)
                    / (4.0 * PI * kinetic_energy),
                amplitude: balance.amplitude(response, self.driven.response_port)?.0,
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

impl LevelParameter {
    /// Least and largest growth of the amplitude over a step of the level along a branch, all as logarithms.
    fn growths(self, step: f64) -> [f64; 2] {
        match self {
            LevelParameter::Force => [step.min(0.0), step.max(0.0)],
            LevelParameter::Parameter => [-step.abs(), step.abs()],
        }
    }

    /// True where amplitude or frequency change by more than a step along a branch should change them.
    fn is_leap(self, last: &Place, next: &Place) -> bool {
        let (old, new) = (last.shape(), next.shape());
        let [least, most] = self.growths(next.beyond(last));
        let along = least - LEAP..=most + LEAP;
        !(along.contains(&(new[0] - old[0])) && (new[2] - old[2]).abs() <= OTHER_MODE)
    }

    /// Deviation of `next` from the line through the two before, in parts of [`BEND`]; through the last alone, amplitude grows as a force.
    fn bend(self, before: Option<&Place>, last: &Place, next: &Place) -> f64 {
        let slope = before.map_or(
            [f64::from(self == LevelParameter::Force), 0.0, 0.0],
            |before| last.slope(before),
        );
        let (old, new, step) = (last.shape(), next.shape(), next.beyond(last));
        let deviations = [0, 1, 2].map(|k| (new[k] - old[k] - slope[k] * step).abs() / BEND[k]);
        // What is not damped at all has no logarithm, and no bend.
        deviations
            .into_iter()
            .filter(|d| d.is_finite())
            .fold(0.0, f64::max)
    }

    /// The step after one of `distance` with this bend and growth of the amplitude: as long as bend and growth allow.
    fn next_step(self, distance: f64, bend: f64, growth: f64) -> f64 {
        let by_bend = distance * (1.0 / bend.max(1e-3)).sqrt().clamp(REDUCTION, GROWTH);
        let [least, most] = self.growths(1.0);
        let by_growth = 0.7 * LEAP / (growth - most).max(least - growth).max(1e-3);
        by_bend.min(by_growth).clamp(2.0 * LEAST_STEP, LARGEST_STEP)
    }

    /// Why the backbone ends before `level`.
    fn ended(
        self,
        before: Option<&Place>,
        last: &Place,
        level: f64,
        source: Option<DynamicsError>,
    ) -> BackboneEnd {
        let growth = before.map_or(1.0, |before| last.slope(before)[0]);
        match source {
            _ if growth.abs() > UNBOUNDED => BackboneEnd::Unbounded { level, growth },
            Some(source) => BackboneEnd::Ceased { level, source },
            None => BackboneEnd::OtherMode { level },
        }
    }
}

/// False where the frequency leaps: that is the resonance of another mode.
fn is_same_mode(last: &Place, next: &Place) -> bool {
    (next.shape()[2] - last.shape()[2]).abs() <= OTHER_MODE
}
