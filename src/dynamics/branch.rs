//! Continuation of a branch of phase resonances over the force level or over another parameter.

use std::f64::consts::PI;

use super::backbone::{Backbone, BackboneEnd, BackbonePoint, DrivenStructure};
use super::contact_element::ElementState;
use super::{DynamicsError, Response, Start};

/// Largest and first step of the level, as its logarithm: about three points per decade of a straight line.
const LARGEST_STEP: f64 = 0.8;
/// Largest growth of a step over the previous step.
const GROWTH: f64 = 2.0;
/// Reduction of a step after Newton's method failed, or after the step left the branch.
const REDUCTION: f64 = 0.3;
/// Relative step of the level below which the phase resonance ceases. At a saturating friction limit the amplitude is
/// about 1e4 times the amplitude at which sliding begins.
const LEAST_STEP: f64 = 1e-5;
/// Step up to which a large bend of the curve does not reduce the step.
const FINE_STEP: f64 = 0.03;
/// Largest logarithmic growth of the amplitude beyond the growth of the level in a step, and largest decrease. Beyond
/// this limit, the step has possibly left the branch.
const LEAP: f64 = 0.4;
/// Largest relative change of the frequency in a step. Beyond this limit, the resonance can belong to another mode.
const OTHER_MODE: f64 = 0.05;
/// Allowed deviations from the line through the two previous points: of the logarithms of amplitude, damping ratio and
/// frequency. A line between two points is eight times closer to the curve than the line beyond them.
const BEND: [f64; 3] = [0.05, 0.05, 2e-3];
/// Multiple of the allowed deviation above which a step is repeated with a smaller length.
const SHARP: f64 = 4.0;
/// Factor to the next level in the search for a first phase resonance.
const ASCENT: f64 = 4.0;
/// Largest ratio of the logarithmic growth of the amplitude to the logarithmic growth of the level. Above this ratio,
/// friction at its limit no longer bounds the amplitude.
const UNBOUNDED: f64 = 100.0;

/// Point of the backbone with the start for the next point.
#[derive(Clone)]
struct LocatedPoint {
    point: BackbonePoint,
    start: Start,
}

impl LocatedPoint {
    /// Returns the logarithms of amplitude, damping ratio and frequency.
    fn shape(&self) -> [f64; 3] {
        let point = &self.point;
        [point.amplitude, point.damping_ratio, point.frequency].map(f64::ln)
    }

    /// Returns the logarithmic change of the level from `before`.
    fn level_change(&self, before: &LocatedPoint) -> f64 {
        (self.point.level / before.point.level).ln()
    }

    /// Returns the slope of the shape over the logarithm of the level.
    fn slope(&self, before: &LocatedPoint) -> [f64; 3] {
        let (old, new) = (before.shape(), self.shape());
        [0, 1, 2].map(|k| (new[k] - old[k]) / self.level_change(before))
    }
}

/// Kind of the levels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LevelParameter {
    /// The level is the force. The amplitude hardly grows while friction bounds the amplitude, and grows in proportion
    /// to the force if only damping bounds the amplitude.
    Force,
    /// The level is a parameter other than the force. The amplitude can rise or fall with this parameter.
    OtherParameter,
}

/// Continuation along a backbone, from level to level. `set` brings the structure to a level.
pub struct Branch<S> {
    driven: DrivenStructure,
    set: S,
    over: LevelParameter,
    /// 1 for rising levels, −1 for falling levels.
    direction: f64,
    solves: usize,
    iterations: usize,
}

/// Phase resonance, or the error of the search for the phase resonance.
type SearchResult = Result<LocatedPoint, DynamicsError>;

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

    /// Computes the backbone through all targets. With `is_free`, every computed phase resonance is a point, and the
    /// curvature determines the distance between points. An error of `set` after the first point ends the backbone; the
    /// function returns the backbone and the error.
    ///
    /// # Errors
    /// The error of `set` before the first point. The error of the solver at the first level if no later level has a
    /// phase resonance either.
    pub fn follow<E>(&mut self, targets: &[f64], is_free: bool) -> Result<(Backbone, Option<E>), E>
    where
        E: From<DynamicsError>,
        S: FnMut(&mut DrivenStructure, f64) -> Result<(), E>,
    {
        self.direction = (targets[targets.len() - 1] - targets[0]).signum();
        let (mut last, begin) = self.first_resonance(targets)?;
        let mut before: Option<LocatedPoint> = None;
        // Last phase resonance of a rejected step.
        let mut rejected: Option<LocatedPoint> = None;
        let (mut points, mut folds) = (Vec::new(), Vec::new());
        if is_free || begin.is_none() {
            points.push(last.point);
        }
        let mut step = LARGEST_STEP;
        let mut end = BackboneEnd::Reached;
        let mut broken = None;
        'targets: for &target in &targets[1..] {
            while self.is_before(last.point.level, target) {
                // Avoids a very short last step before a target.
                let distance_to_target = (target / last.point.level).ln().abs();
                let level = match distance_to_target <= 1.2 * step {
                    true => target,
                    false => last.point.level * (self.direction * step).exp(),
                };
                let distance = (level / last.point.level).ln().abs();
                let result = match self.step(before.as_ref(), &last, level) {
                    Ok(result) => result,
                    Err(error) => {
                        end = BackboneEnd::StructureError { level };
                        broken = Some(error);
                        break 'targets;
                    }
                };
                if let Ok(next) = &result
                    && !self.over.is_leap(&last, next)
                {
                    let bend = self.over.bend(before.as_ref(), &last, next);
                    if is_free && bend > SHARP && distance > FINE_STEP {
                        step = distance * (1.0 / bend).sqrt().max(REDUCTION);
                        continue;
                    }
                    rejected = None;
                    step = self.over.next_step(distance, bend, next.slope(&last)[0]);
                } else if distance > LEAST_STEP {
                    rejected = result.ok().or(rejected);
                    step = REDUCTION * distance;
                    continue;
                }
                let is_leap = result.as_ref();
                let is_leap = is_leap.is_ok_and(|next| self.over.is_leap(&last, next));
                let (mut next, is_leap) = match (result, rejected.take()) {
                    (Ok(next), _) if !is_leap => (next, false),
                    (Ok(next), _) | (Err(_), Some(next)) if is_same_mode(&last, &next) => {
                        (next, true)
                    }
                    (result, _) => {
                        end = self
                            .over
                            .end_reason(before.as_ref(), &last, level, result.err());
                        break 'targets;
                    }
                };
                if is_leap {
                    let end_here = self.over.end_reason(before.as_ref(), &last, level, None);
                    if let BackboneEnd::Unbounded { .. } = end_here {
                        end = end_here;
                        break 'targets;
                    }
                    folds.push(last.point.level);
                    next.point.branch += 1;
                    step = LARGEST_STEP;
                }
                before = (!is_leap).then_some(last);
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

    /// Returns true if a level precedes another in the direction of the levels.
    fn is_before(&self, level: f64, other: f64) -> bool {
        self.direction * (other - level) > 0.0
    }

    /// Computes the phase resonance of the first level. If that fails, returns the phase resonance nearest to the first
    /// level, and the error.
    ///
    /// If only friction bounds the resonance, the resonance lies at the onset of sliding. Newton's method reaches a
    /// resonance at the onset of sliding more easily from a larger force. At a much smaller force the samples do not
    /// resolve the resonance.
    fn first_resonance<E>(
        &mut self,
        targets: &[f64],
    ) -> Result<(LocatedPoint, Option<DynamicsError>), E>
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
                Ok(response) => break self.locate(level, &response)?,
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

    /// Computes the phase resonance at a level, extrapolated from the last two.
    fn step<E>(
        &mut self,
        before: Option<&LocatedPoint>,
        last: &LocatedPoint,
        level: f64,
    ) -> Result<SearchResult, E>
    where
        S: FnMut(&mut DrivenStructure, f64) -> Result<(), E>,
    {
        (self.set)(&mut self.driven, level)?;
        Ok(self.solve_from(before, last, level))
    }

    fn solve_from(
        &mut self,
        before: Option<&LocatedPoint>,
        last: &LocatedPoint,
        level: f64,
    ) -> SearchResult {
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
        // If the branch bends, the extrapolation can be farther from the solution than the last point.
        let response = match balance.phase_resonance_near(*range, &start) {
            Ok(response) => response,
            Err(_) => balance.phase_resonance_near(*range, &last.start)?,
        };
        let mut located = self.locate(level, &response)?;
        located.point.branch = last.point.branch;
        Ok(located)
    }

    fn locate(&mut self, level: f64, response: &Response) -> SearchResult {
        self.iterations += response.iterations;
        let DrivenStructure { balance, mass, .. } = &self.driven;
        let kinetic_energy = balance.kinetic_energy(mass, response)?;
        let states = balance.joint_summary(response).states;
        // Passive elements stick, even if rounding of their samples suggests slip.
        let active = || states.iter().zip(&response.active);
        let count = |of: &[ElementState]| {
            let matching = active().filter(|(state, active)| **active && of.contains(state));
            matching.count()
        };
        let mut energy = response.energy;
        if response.active_elements() == 0 {
            // Springs dissipate nothing, so the remaining work is rounding.
            energy.friction = 0.0;
        }
        Ok(LocatedPoint {
            point: BackbonePoint {
                branch: 0,
                level,
                force: match self.over {
                    LevelParameter::Force => level,
                    LevelParameter::OtherParameter => self.driven.drive(),
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
    /// Returns the smallest and largest expected growth of the amplitude over a step of the level, all as logarithms.
    fn growths(self, step: f64) -> [f64; 2] {
        match self {
            LevelParameter::Force => [step.min(0.0), step.max(0.0)],
            LevelParameter::OtherParameter => [-step.abs(), step.abs()],
        }
    }

    /// Returns true if amplitude or frequency change by more than a step along a branch should change them.
    fn is_leap(self, last: &LocatedPoint, next: &LocatedPoint) -> bool {
        let (old, new) = (last.shape(), next.shape());
        let [least, most] = self.growths(next.level_change(last));
        let along = least - LEAP..=most + LEAP;
        !(along.contains(&(new[0] - old[0])) && (new[2] - old[2]).abs() <= OTHER_MODE)
    }

    /// Returns the deviation of `next` from the line through the two previous points, over [`BEND`]. With one previous
    /// point, the amplitude is expected to grow like a force.
    fn bend(self, before: Option<&LocatedPoint>, last: &LocatedPoint, next: &LocatedPoint) -> f64 {
        let slope = before.map_or(
            [f64::from(self == LevelParameter::Force), 0.0, 0.0],
            |before| last.slope(before),
        );
        let (old, new, step) = (last.shape(), next.shape(), next.level_change(last));
        let deviations = [0, 1, 2].map(|k| (new[k] - old[k] - slope[k] * step).abs() / BEND[k]);
        // The logarithm of a zero damping ratio is not finite, so the function ignores the logarithm.
        deviations
            .into_iter()
            .filter(|d| d.is_finite())
            .fold(0.0, f64::max)
    }

    /// Returns the length of the next step, as large as the last step allows. The last step has the length `distance`,
    /// the bend `bend` and the growth `growth` of the amplitude.
    fn next_step(self, distance: f64, bend: f64, growth: f64) -> f64 {
        let by_bend = distance * (1.0 / bend.max(1e-3)).sqrt().clamp(REDUCTION, GROWTH);
        let [least, most] = self.growths(1.0);
        let by_growth = 0.7 * LEAP / (growth - most).max(least - growth).max(1e-3);
        by_bend.min(by_growth).clamp(2.0 * LEAST_STEP, LARGEST_STEP)
    }

    /// Returns the reason why the backbone ends before `level`.
    fn end_reason(
        self,
        before: Option<&LocatedPoint>,
        last: &LocatedPoint,
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

/// Returns false if the frequency leaps, so that the resonance belongs to another mode.
fn is_same_mode(last: &LocatedPoint, next: &LocatedPoint) -> bool {
    (next.shape()[2] - last.shape()[2]).abs() <= OTHER_MODE
}
