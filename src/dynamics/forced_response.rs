//! Response over a range of frequencies, point by point, with the method of each solution, or the error of the search
//! for a solution.

use std::f64::consts::TAU;

use super::contact_element::ContactElement;
use super::cycle::half_range;
use super::effort::EvaluationBudget;
use super::truncation::{TAIL, UNKNOWN};
use super::vibration::{ResonanceKind, Vibration};
use super::{
    ContinuationSettings, DynamicsError, HarmonicBalance, Harmonics, ResolvedResonance, Resonance,
    Response, Start,
};

/// Largest Newton correction of a point of a forced response. A point with a correction of 1e-7 has an energy balance
/// with an error of 1e-10.
const TOLERANCE: f64 = 1e-7;
/// Largest Newton correction of a point for banks of sliders, whose Newton steps are expensive. The correction is far
/// below the line width of a plot.
const DEAR_TOLERANCE: f64 = 1e-5;
/// Largest step of a continuation for banks of sliders. Lines between points of a linear resonance are within 0.2 % of
/// the peak.
const DEAR_STEP: f64 = 1.0 / 12.0;
/// Largest step of a continuation from a phase resonance, which is a point; curvature reduces the step.
const STEP_FROM_RESONANCE: f64 = 0.17;
/// Newton correction of the finer response that estimates the error of a point: two digits of an error are sufficient.
const ERROR_TOLERANCE: f64 = 1e-5;
/// Largest number of Newton iterations of the finer response: a nearby response needs fewer.
const ERROR_ITERATIONS: usize = 8;
/// Minimum budget of evaluations for the errors of points, at few unknowns and samples. The budget falls with the
/// square of the number of unknowns, and inversely with the number of samples.
const ERROR_EVALUATIONS: f64 = 2000.0;
/// Number of unknowns up to which the solver does not reduce [`ERROR_EVALUATIONS`].
const FEW_UNKNOWNS: f64 = 45.0;
/// Number of samples up to which the solver does not reduce [`ERROR_EVALUATIONS`].
const FEW_SAMPLES: f64 = 1024.0;
/// Number of instants per cycle at which the code samples a displacement to find its range.
const INSTANTS: usize = 512;
/// Relative difference of two frequencies up to which the difference is rounding.
const ROUNDING: f64 = 1e-12;
/// Largest permitted share by which a peak lies below a point of the forced response. The search for the peak ends at a
/// phase angle of at most about 5e-3 from the peak. The amplitude at this angle is below the peak by half the square of
/// the angle.
const FLAT: f64 = 2e-5;
/// Largest permitted energy that friction supplies to a solution, divided by the work of the loads and dampers. A
/// solution with a larger share is not physical, because the samples or harmonics are too few.
const GIVEN: f64 = 0.01;

/// Method by which a point of a forced response was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolutionMethod {
    /// Solution of the harmonic balance.
    Balance,
    /// Solution of the harmonic balance in which friction supplies energy. A solution in which friction supplies energy
    /// exists only because the samples or harmonics are too few.
    Unphysical,
    /// No solution was found; whether one exists is unknown.
    NotFound,
}

impl SolutionMethod {
    /// Returns the name of the solution method in tables.
    pub fn name(self) -> &'static str {
        match self {
            SolutionMethod::Balance => "harmonic_balance",
            SolutionMethod::Unphysical => "unphysical",
            SolutionMethod::NotFound => "not_found",
        }
    }
}

/// Response at a point of a forced response.
#[derive(Debug, Clone, PartialEq)]
pub struct PointResponse {
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Phase lag of the first harmonic behind the drive \[rad\].
    pub phase_lag: f64,
    /// Difference of the largest and the smallest displacement at the response port over a cycle \[m\].
    pub peak_to_peak: f64,
    /// Coefficients of the displacement at the response port \[m\].
    pub displacement: Vec<f64>,
    /// Estimated relative error of `amplitude` due to missing harmonics and too few samples. `None` without an
    /// estimate, 1 if the solver found no response with more harmonics or samples.
    pub error: Option<f64>,
    /// Estimated relative error of the friction energy, as `error` of the amplitude.
    pub friction_error: Option<f64>,
    /// The response of the whole structure.
    pub solution: Response,
}

/// Point of a forced response.
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedPoint {
    /// Frequency of the fundamental \[Hz\].
    pub frequency: f64,
    /// Method by which the solver found the point.
    pub found_by: SolutionMethod,
    /// Remaining Newton correction, relative to the displacements; without a solution, the correction of the last
    /// attempt.
    pub residual: f64,
    /// Number of the branch that contains the point. `None` for a point without a branch.
    pub branch: Option<usize>,
    /// Whether the branch that contains the point turns back in frequency at the point.
    pub is_fold: bool,
    /// The response. `None` if no solution was found, or if friction gives energy.
    pub response: Option<PointResponse>,
}

impl ForcedPoint {
    /// Creates a point without a solution, whose attempts ended in `error`.
    fn missing(omega: f64, error: &DynamicsError) -> ForcedPoint {
        ForcedPoint {
            frequency: omega / TAU,
            found_by: SolutionMethod::NotFound,
            residual: match error {
                // A correction of 1 is as large as the displacements: nothing is known.
                DynamicsError::NotConverged { correction, .. } => correction.min(1.0),
                _ => 1.0,
            },
            branch: None,
            is_fold: false,
            response: None,
        }
    }
}

/// Resonance and forced response of constant contact elements.
pub struct RangeResponse<'a> {
    /// The resonance. The peak of the resonance is at least as high as all points.
    pub resolved: ResolvedResonance<'a>,
    /// The points, in the harmonics of the resonance. `points` is `None` if no points were computed or no point was
    /// found.
    pub points: Option<Vec<ForcedPoint>>,
}

impl Vibration {
    /// Computes the resonance and the forced response of constant contact elements.
    ///
    /// The highest point of the forced response becomes the peak if there is no phase resonance, or if the highest
    /// point is above the peak next to the phase resonance. The function adds harmonics as [`Vibration::resolve`] does.
    /// If the vibration has a single frequency, there is no peak, and the function computes no points.
    ///
    /// # Errors
    /// The error of the resonance if the forced response has no point.
    pub fn resolve_over_range(
        &self,
        elements: Vec<ContactElement>,
        tolerance: Option<f64>,
    ) -> Result<RangeResponse<'_>, DynamicsError> {
        let mut current = self.resolve(elements.clone(), None, tolerance);
        if self.at_omega.is_some() {
            let points = None;
            return current.map(|resolved| RangeResponse { resolved, points });
        }
        loop {
            let harmonics = match &current {
                Ok(resolved) => resolved.balance.harmonics().clone(),
                Err(_) => self.harmonics.clone(),
            };
            let balance = self.balance_of(elements.clone(), harmonics.clone())?;
            let phase = current
                .as_ref()
                .ok()
                .and_then(|resolved| resolved.resonance.phase.as_ref());
            // The frequency of the start is rounded like a frequency that is read from a table.
            let phase = phase.map(|phase| Start {
                omega: TAU * phase.frequency(),
                ..phase.start()
            });
            let points = match self.forced_response_through(&balance, phase.as_ref()) {
                Ok(mut points) => {
                    self.estimate_errors(&balance, &mut points);
                    points
                }
                Err(_) => {
                    return current.map(|resolved| RangeResponse {
                        resolved,
                        points: None,
                    });
                }
            };
            let Some((highest, top)) = highest(&points) else {
                return current.map(|resolved| RangeResponse {
                    resolved,
                    points: Some(points),
                });
            };
            let phase = match current {
                Ok(resolved) => {
                    let peak = resolved.resonance.peak_amplitude;
                    if top.amplitude <= peak * (1.0 + FLAT) {
                        return Ok(RangeResponse {
                            resolved,
                            points: Some(points),
                        });
                    }
                    resolved.resonance.phase
                }
                Err(_) => None,
            };
            let is_end = is_end(&points, highest);
            let mut resonance = self.resonance_at(&balance, top, is_end, phase)?;
            resonance.branch = points[highest].branch;
            let resolved = self.extended(balance, resonance, tolerance, None)?;
            if *resolved.balance.harmonics() == harmonics {
                return Ok(RangeResponse {
                    resolved,
                    points: Some(points),
                });
            }
            current = Ok(resolved);
        }
    }

    /// Creates the resonance whose peak is the highest point of a forced response. The peak is refined if possible.
    fn resonance_at(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        top: &PointResponse,
        is_end: bool,
        phase: Option<Response>,
    ) -> Result<Resonance, DynamicsError> {
        let start = top.solution.start();
        let is_above = |refined: &Response| {
            let amplitude = balance.amplitude(refined, self.response_port);
            amplitude.is_ok_and(|(amplitude, _)| amplitude >= top.amplitude)
        };
        let refined = balance.peak(self.response_port, self.range, &start);
        let refined = refined.ok().filter(is_above);
        let is_refined = refined.is_some();
        let peak = match refined {
            Some(peak) => peak,
            None => balance
                .solve_near(top.solution.omega, &start)
                .unwrap_or_else(|_| top.solution.clone()),
        };
        let iterations = phase.as_ref().map_or(0, |phase| phase.iterations) + peak.iterations;
        let mut resonance = self.resonance_of(balance, phase, peak, iterations)?;
        resonance.is_peak_near_phase_resonance = false;
        if is_end && !is_refined {
            resonance.peak_kind = ResonanceKind::End;
        }
        Ok(resonance)
    }

    /// Computes the response over the range.
    ///
    /// With a number of `points`, the points lie on the branches of an upward sweep ([`HarmonicBalance::sweep`]).
    /// Without a number of `points`, continuation places the points, including points on overhanging parts of the
    /// branches. The relative tolerance of a point is 1e-7 or the tolerance of the balance, whichever is larger. The
    /// run only displays the points, and no computation continues from a point.
    ///
    /// Newton's method starts from another point or from the linear response. If both starts fail, the solver computes
    /// responses with more damping and preload, and removes both step by step.
    ///
    /// # Errors
    /// The error of the first point, if no point was found.
    pub fn forced_response(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        self.forced_response_through(balance, None)
    }

    /// Computes the response as [`Self::forced_response`]. If responses are expensive and continuation places the
    /// points, the branch starts from a known phase resonance. The start from a phase resonance requires that the
    /// branch reaches both ends of the range.
    ///
    /// # Errors
    /// As [`Self::forced_response`].
    pub fn forced_response_through(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        resonance: Option<&Start>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        let tolerance = match balance.has_expensive_jacobian {
            true => DEAR_TOLERANCE,
            false => TOLERANCE,
        };
        let mut loose_balance = HarmonicBalance {
            effort: EvaluationBudget::default(),
            ..balance.clone()
        };
        loose_balance.settings.tolerance = balance.settings.tolerance.max(tolerance);
        let result = match self.omegas() {
            Some(omegas) => self.on_given_points(&loose_balance, &omegas),
            None => self.on_branches(&loose_balance, resonance),
        };
        balance.effort.add(loose_balance.effort.spent());
        let (points, failure) = result?;
        match failure {
            Some(error) if points.iter().all(|point| point.response.is_none()) => Err(error),
            _ => Ok(points),
        }
    }

    fn on_given_points(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omegas: &[f64],
    ) -> Result<(Vec<ForcedPoint>, Option<DynamicsError>), DynamicsError> {
        let mut failure = None;
        let mut points = Vec::with_capacity(omegas.len());
        for (response, &omega) in balance.sweep(omegas).into_iter().zip(omegas) {
            let response =
                response.or_else(|error| self.solve_by_homotopy(balance, omega).ok_or(error));
            points.push(match response {
                Ok(response) => self.point(balance, &response, None)?,
                Err(error) => {
                    let point = ForcedPoint::missing(omega, &error);
                    failure.get_or_insert(error);
                    point
                }
            });
        }
        Ok((points, failure))
    }

    fn on_branches(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        resonance: Option<&Start>,
    ) -> Result<(Vec<ForcedPoint>, Option<DynamicsError>), DynamicsError> {
        let mut settings =
            ContinuationSettings::over(self.range.0, self.range.1, self.response_port);
        if balance.has_expensive_jacobian {
            settings.largest_step = DEAR_STEP;
        }
        let fallback = |omega| self.solve_by_homotopy(balance, omega);
        let (branches, failure) = match self.through_resonance(balance, settings, resonance) {
            Some(branch) => (vec![branch], None),
            None => balance.branch_or_parts(settings, &fallback)?,
        };
        let (from, to) = self.range;
        let range = from * (1.0 - ROUNDING)..=to * (1.0 + ROUNDING);
        let mut points = Vec::new();
        for (number, branch) in branches.iter().enumerate() {
            for (k, response) in branch.iter().enumerate() {
                // A branch that returns ends outside of the range.
                if !range.contains(&response.omega) {
                    continue;
                }
                let mut point = self.point(balance, response, Some(number))?;
                if let (Some(before), Some(after)) = (k.checked_sub(1), branch.get(k + 1)) {
                    let before = response.omega - branch[before].omega;
                    point.is_fold = before * (after.omega - response.omega) < 0.0;
                }
                points.push(point);
            }
        }
        if let (Some(error), [first_part, second_part]) = (&failure, &branches[..]) {
            // The gap between the two parts.
            let end = first_part.last().map_or(from, |response| response.omega);
            let start = second_part.first().map_or(to, |response| response.omega);
            if start <= end {
                return Ok((points, failure));
            }
            let omega = 0.5 * (end + start);
            points.push(match self.solve_by_homotopy(balance, omega) {
                Some(response) => self.point(balance, &response, None)?,
                None => ForcedPoint::missing(omega, error),
            });
        }
        Ok((points, failure))
    }

    /// Computes the branch through the phase resonance at `start`. Returns `None` if responses are cheap, or if the
    /// branch does not reach both ends of the range.
    fn through_resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        settings: ContinuationSettings,
        start: Option<&Start>,
    ) -> Option<Vec<Response>> {
        let start = start.filter(|_| balance.has_expensive_jacobian)?;
        let resonance = balance.phase_resonance_near(self.range, start).ok()?;
        let settings = ContinuationSettings {
            largest_step: STEP_FROM_RESONANCE,
            ..settings
        };
        balance.branch_through_resonance(settings, &resonance)
    }

    fn point(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: &Response,
        branch: Option<usize>,
    ) -> Result<ForcedPoint, DynamicsError> {
        let (amplitude, phase_lag) = balance.amplitude(response, self.response_port)?;
        let n = balance.harmonics().coefficients();
        let displacement = response.displacement[self.response_port * n..][..n].to_vec();
        let is_physical = !friction_gives_energy(response);
        Ok(ForcedPoint {
            frequency: response.frequency(),
            found_by: match is_physical {
                true => SolutionMethod::Balance,
                false => SolutionMethod::Unphysical,
            },
            residual: response.correction,
            branch,
            is_fold: false,
            response: is_physical.then(|| PointResponse {
                amplitude,
                phase_lag,
                peak_to_peak: peak_to_peak(balance.harmonics(), &displacement),
                displacement,
                error: None,
                friction_error: None,
                solution: response.clone(),
            }),
        })
    }

    /// Estimates the errors of points: the doubled change of the response with about twice the harmonics, and with
    /// twice the samples.
    ///
    /// Points in which no element slips or opens are linear and have no error. The points with the largest amplitude
    /// come first. The estimate stops at about the cost of the points themselves; the remaining points have no
    /// estimate.
    pub fn estimate_errors(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        points: &mut [ForcedPoint],
    ) {
        let harmonics = balance.harmonics();
        let more_harmonics = self.refined_balance(balance, harmonics.beyond(), 1);
        let more_samples = self.refined_balance(balance, harmonics.clone(), 2);
        let (Ok(mut more_harmonics), Ok(mut more_samples)) = (more_harmonics, more_samples) else {
            return;
        };
        for finer in [&mut more_harmonics, &mut more_samples] {
            finer.settings.tolerance = finer.settings.tolerance.max(ERROR_TOLERANCE);
            finer.settings.max_iterations = ERROR_ITERATIONS;
            finer.effort.allow(error_effort(balance, finer));
        }
        let responses = points
            .iter_mut()
            .filter_map(|point| point.response.as_mut());
        let mut responses: Vec<&mut PointResponse> = responses.collect();
        responses.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        for point in responses {
            let coarse = &point.solution;
            if coarse.active_elements() == 0 {
                (point.error, point.friction_error) = (Some(0.0), Some(0.0));
                continue;
            }
            // Friction cannot supply energy, so any energy that friction supplies is an error of the response.
            let sampled = balance.work_error(coarse);
            if coarse.energy.friction < 0.0 {
                point.friction_error = Some(sampled.max(UNKNOWN));
            }
            if more_harmonics.effort.is_spent() || more_samples.effort.is_spent() {
                continue;
            }
            let [by_harmonics, by_samples] =
                [&more_harmonics, &more_samples].map(|finer| self.errors_by(balance, point, finer));
            if more_harmonics.effort.is_spent() || more_samples.effort.is_spent() {
                continue;
            }
            let is_still = balance.is_still(coarse, self.response_port);
            let [amplitude, friction] = match (by_harmonics, by_samples) {
                (Some(harmonics), Some(samples)) => [0, 1].map(|k| harmonics[k] + samples[k]),
                _ => [UNKNOWN; 2],
            };
            point.error = Some(if is_still { UNKNOWN } else { amplitude });
            let friction = friction.max(sampled);
            point.friction_error = Some(point.friction_error.unwrap_or(0.0).max(friction));
        }
    }

    /// Returns the relative errors of the amplitude and of the friction energy of a point. The errors come from the
    /// response of `refined_balance`, whose solution starts at the point. Returns `None` if `refined_balance` has no
    /// response near the point.
    fn errors_by(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        point: &PointResponse,
        finer: &HarmonicBalance<ContactElement>,
    ) -> Option<[f64; 2]> {
        let coarse = &point.solution;
        let start = coarse.start();
        let start = start.in_harmonics(balance.harmonics(), finer.harmonics());
        let fine = finer.solve_near(coarse.omega, &start).ok()?;
        let amplitude = finer.amplitude(&fine, self.response_port).ok()?.0;
        Some([
            relative_error(point.amplitude, amplitude),
            relative_error(coarse.energy.friction, fine.energy.friction),
        ])
    }
}

/// Returns the budget of evaluations for the errors of points. The budget is the cost of the points, or the cost of
/// [`ERROR_EVALUATIONS`] evaluations with few unknowns if that cost is larger. The cost of an evaluation is
/// proportional to the samples and to the cube of the unknowns.
fn error_effort(
    balance: &HarmonicBalance<ContactElement>,
    finer: &HarmonicBalance<ContactElement>,
) -> u64 {
    let samples = [balance, finer].map(|b| b.settings.samples as f64);
    let [own, finer] = [balance, finer].map(|b| (b.elements().len() * b.width()) as f64);
    let as_points = balance.effort.spent() as f64 * (own / finer).powi(3) * samples[0] / samples[1];
    let few = (FEW_UNKNOWNS / finer).powi(2) * FEW_SAMPLES / samples[1];
    let least = ERROR_EVALUATIONS * few.min(1.0);
    as_points.max(least) as u64
}

/// Returns the point with the largest amplitude and the place of the point, or `None` if no point has a response.
fn highest(points: &[ForcedPoint]) -> Option<(usize, &PointResponse)> {
    let responses = points.iter().enumerate();
    let responses = responses.filter_map(|(place, point)| Some((place, point.response.as_ref()?)));
    responses.max_by(|(_, a), (_, b)| a.amplitude.total_cmp(&b.amplitude))
}

/// Returns true if a point lacks a neighbour of its branch on at least one side.
fn is_end(points: &[ForcedPoint], place: usize) -> bool {
    let neighbours = [place.checked_sub(1), Some(place + 1)];
    neighbours.into_iter().any(|k| {
        let other = k.and_then(|k| points.get(k));
        other.is_none_or(|other| other.branch != points[place].branch || other.response.is_none())
    })
}

/// Returns true if friction gives energy in a response, which is not physical.
pub(super) fn friction_gives_energy(response: &Response) -> bool {
    let energy = response.energy;
    energy.friction < -GIVEN * (energy.load_work.abs() + energy.viscous + energy.hysteretic)
}

/// Returns the relative error of the value `figure`. The reference `finer` is the value with more harmonics or samples.
/// Returns 1 if the relative error is not finite.
fn relative_error(figure: f64, finer: f64) -> f64 {
    if figure == finer {
        return 0.0;
    }
    let error = TAIL * (figure - finer).abs() / figure.abs();
    match error.is_finite() {
        true => error,
        false => UNKNOWN,
    }
}

/// Returns the difference of the largest and the smallest value over a cycle.
fn peak_to_peak(harmonics: &Harmonics, row: &[f64]) -> f64 {
    let values = (0..INSTANTS).map(|k| {
        let basis = harmonics.basis(TAU * k as f64 / INSTANTS as f64);
        row.iter().zip(&basis).map(|(a, b)| a * b).sum::<f64>()
    });
    2.0 * half_range(values)
}
