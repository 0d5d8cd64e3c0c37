//! The response over a range of frequencies, point by point: each with how it was found, or why it was not.

use std::f64::consts::TAU;

use super::contact_element::ContactElement;
use super::cycle::half_range;
use super::effort::Effort;
use super::truncation::{TAIL, UNKNOWN};
use super::vibration::{ResonanceKind, Vibration};
use super::{
    ContinuationSettings, DynamicsError, HarmonicBalance, Harmonics, Resolved, Resonance, Response,
    Start,
};

/// Newton correction that a point of a forced response is left with at most; its energies are then in balance to 1e-10.
const TOLERANCE: f64 = 1e-7;
/// That of banks of sliders, whose every Newton step is dear: far below the width of a line of a plot.
const DEAR_TOLERANCE: f64 = 1e-5;
/// The largest step of their continuation: lines between points of a linear resonance are within 0.2 % of its peak.
const DEAR_STEP: f64 = 1.0 / 12.0;
/// That from a phase resonance, which is a point; curvature makes it shorter.
const STEP_FROM_RESONANCE: f64 = 0.17;
/// Newton correction of the finer response that tells the error of a point: an error has two digits.
const ERROR_TOLERANCE: f64 = 1e-5;
/// Newton iterations to it: what takes more is not near.
const ERROR_ITERATIONS: usize = 8;
/// Evaluations by which errors of points may be found at least, of so many unknowns and samples; of more they are fewer, by the square of the unknowns.
const ERROR_EVALUATIONS: f64 = 2000.0;
const FEW_UNKNOWNS: f64 = 45.0;
const FEW_SAMPLES: f64 = 1024.0;
/// Instants at which the range of a displacement over a cycle is looked for.
const INSTANTS: usize = 512;
/// Relative difference of two frequencies that is rounding.
const ROUNDING: f64 = 1e-12;
/// Share by which a peak may lie below a point of the forced response: its search ends within an angle of some 5e-3 of the top, and the amplitude falls
/// by half the square of that angle.
const FLAT: f64 = 2e-5;
/// Share of the work of the loads and dampers that friction may give and not take: more is no motion, but samples or harmonics that are
/// too few.
const GIVEN: f64 = 0.01;

/// How a point of a forced response was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SolutionMethod {
    /// As a solution of the harmonic balance.
    Balance,
    /// As a solution of the harmonic balance in which friction gives energy: with these samples or harmonics, and none in truth.
    Unphysical,
    /// Not, and it is not known whether there is one.
    Nothing,
}

impl SolutionMethod {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            SolutionMethod::Balance => "harmonic_balance",
            SolutionMethod::Unphysical => "unphysical",
            SolutionMethod::Nothing => "not_found",
        }
    }
}

/// What a point of a forced response is.
#[derive(Debug, Clone, PartialEq)]
pub struct PointResponse {
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Its lag behind the drive \[rad\].
    pub phase_lag: f64,
    /// Difference of the largest and the least displacement at the response port over a cycle \[m\].
    pub peak_to_peak: f64,
    /// Coefficients of the displacement at the response port \[m\].
    pub displacement: Vec<f64>,
    /// Relative error of the amplitude due to too few harmonics and samples. None where it was not estimated, 1 where no finer response was found.
    pub error: Option<f64>,
    /// That of the energy of friction.
    pub friction_error: Option<f64>,
    /// The response of the whole structure.
    pub solution: Response,
}

/// One point of a forced response.
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedPoint {
    /// Frequency of the fundamental \[Hz\].
    pub frequency: f64,
    /// How it was found.
    pub found_by: SolutionMethod,
    /// The correction that Newton's method left, relative to the displacements; where nothing was found, what the last attempt had left.
    pub residual: f64,
    /// Number of the branch that it is on; none of a point by itself.
    pub branch: Option<usize>,
    /// Whether its branch turns back in frequency here.
    pub is_fold: bool,
    /// The response; none where nothing was found.
    pub response: Option<PointResponse>,
}

impl ForcedPoint {
    /// One at which nothing was found, as attempts ended in `error`.
    fn missing(omega: f64, error: &DynamicsError) -> ForcedPoint {
        ForcedPoint {
            frequency: omega / TAU,
            found_by: SolutionMethod::Nothing,
            residual: match error {
                // As large as the displacements: nothing is known.
                DynamicsError::NotConverged { correction, .. } => correction.min(1.0),
                _ => 1.0,
            },
            branch: None,
            is_fold: false,
            response: None,
        }
    }
}

/// Contact elements that stay as they are: their resonance and their response over the range.
pub struct RangeResponse<'a> {
    /// The resonance, whose peak is no lower than the points.
    pub resolved: Resolved<'a>,
    /// The points, in the harmonics of the resonance. None if no point was found with these harmonics.
    pub points: Option<Vec<ForcedPoint>>,
}

impl Vibration {
    /// The resonance of contact elements that stay as they are, and the forced response, whose highest point is the peak where there is no phase
    /// resonance or where it is above the peak beside that. Harmonics are extended as by [`Vibration::resolve`]. At a given frequency there is no peak, and
    /// the points are not computed.
    ///
    /// # Errors
    /// That of the resonance where the forced response has no point.
    pub fn resolve_over_range(
        &self,
        elements: Vec<ContactElement>,
        tolerance: Option<f64>,
    ) -> Result<RangeResponse<'_>, DynamicsError> {
        let mut known = self.resolve(elements.clone(), None, tolerance);
        if self.at_omega.is_some() {
            let points = None;
            return known.map(|resolved| RangeResponse { resolved, points });
        }
        loop {
            let harmonics = match &known {
                Ok(resolved) => resolved.balance.harmonics().clone(),
                Err(_) => self.harmonics.clone(),
            };
            let balance = self.balance_of(elements.clone(), harmonics.clone())?;
            let phase = known
                .as_ref()
                .ok()
                .and_then(|of| of.resonance.phase.as_ref());
            // As it is read back from a table of its frequency.
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
                    return known.map(|resolved| RangeResponse {
                        resolved,
                        points: None,
                    });
                }
            };
            let Some((highest, top)) = highest(&points) else {
                return known.map(|resolved| RangeResponse {
                    resolved,
                    points: Some(points),
                });
            };
            let phase = match known {
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
            known = Ok(resolved);
        }
    }

    /// The resonance whose peak is the highest point of a forced response, refined unless it is an end.
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
        resonance.is_beside = false;
        if is_end && !is_refined {
            resonance.peak_kind = ResonanceKind::End;
        }
        Ok(resonance)
    }

    /// The response over the range: at its `points`, on the branches on which a sweep upwards arrives ([`HarmonicBalance::sweep`]), or as continuation
    /// places its points, overhanging parts of the branches included. Points are solved to 1e-7 of the displacements if not as exactly as the
    /// balance says: they are looked at, and nothing goes on from them.
    ///
    /// A response that Newton's method reaches neither from another point nor from the linear response is approached from more damping and preload.
    ///
    /// # Errors
    /// Where no point at all was found, that of the first.
    pub fn forced_response(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        self.forced_response_through(balance, None)
    }

    /// As [`Self::forced_response`]; where responses are dear and continuation places the points, from a phase resonance to both ends of the
    /// range, if it is known and leads there.
    ///
    /// # Errors
    /// As [`Self::forced_response`].
    pub fn forced_response_through(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        resonance: Option<&Start>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        let enough = match balance.is_costly {
            true => DEAR_TOLERANCE,
            false => TOLERANCE,
        };
        let mut roughly = HarmonicBalance {
            effort: Effort::default(),
            ..balance.clone()
        };
        roughly.settings.tolerance = balance.settings.tolerance.max(enough);
        let found = match self.omegas() {
            Some(omegas) => self.at_points(&roughly, &omegas),
            None => self.of_branches(&roughly, resonance),
        };
        balance.effort.add(roughly.effort.spent());
        let (points, failure) = found?;
        match failure {
            Some(error) if points.iter().all(|point| point.response.is_none()) => Err(error),
            _ => Ok(points),
        }
    }

    fn at_points(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omegas: &[f64],
    ) -> Result<(Vec<ForcedPoint>, Option<DynamicsError>), DynamicsError> {
        let mut failure = None;
        let mut points = Vec::with_capacity(omegas.len());
        for (response, &omega) in balance.sweep(omegas).into_iter().zip(omegas) {
            let response = response.or_else(|error| self.by_easing(balance, omega).ok_or(error));
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

    fn of_branches(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        resonance: Option<&Start>,
    ) -> Result<(Vec<ForcedPoint>, Option<DynamicsError>), DynamicsError> {
        let mut settings =
            ContinuationSettings::over(self.range.0, self.range.1, self.response_port);
        if balance.is_costly {
            settings.largest_step = DEAR_STEP;
        }
        let easily = |omega| self.by_easing(balance, omega);
        let (branches, failure) = match self.through_resonance(balance, settings, resonance) {
            Some(branch) => (vec![branch], None),
            None => balance.parts(settings, &easily)?,
        };
        let (from, to) = self.range;
        let range = from * (1.0 - ROUNDING)..=to * (1.0 + ROUNDING);
        let mut points = Vec::new();
        for (number, branch) in branches.iter().enumerate() {
            for (k, response) in branch.iter().enumerate() {
                // A branch that returns ends beyond where it began.
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
        if let (Some(error), [there, rest]) = (&failure, &branches[..]) {
            // What the two parts leave out.
            let end = there.last().map_or(from, |response| response.omega);
            let start = rest.first().map_or(to, |response| response.omega);
            if start <= end {
                return Ok((points, failure));
            }
            let omega = 0.5 * (end + start);
            points.push(match self.by_easing(balance, omega) {
                Some(response) => self.point(balance, &response, None)?,
                None => ForcedPoint::missing(omega, error),
            });
        }
        Ok((points, failure))
    }

    /// The branch through the phase resonance at `start`, where responses are dear and it leads to both ends of the range.
    fn through_resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        settings: ContinuationSettings,
        start: Option<&Start>,
    ) -> Option<Vec<Response>> {
        let start = start.filter(|_| balance.is_costly)?;
        let resonance = balance.phase_resonance_near(self.range, start).ok()?;
        let settings = ContinuationSettings {
            largest_step: STEP_FROM_RESONANCE,
            ..settings
        };
        balance.through(settings, &resonance)
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
        let is_physical = !gives_energy(response);
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

    /// Finds the errors of points: what the response at its frequency changes by, doubled, with about twice the harmonics, and with twice the samples.
    /// Points in which no element slips or opens are linear, and have none. The largest come first; what comes after about the cost of the points
    /// themselves has none that is known.
    pub fn estimate_errors(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        points: &mut [ForcedPoint],
    ) {
        let harmonics = balance.harmonics();
        let more = self.finer(balance, harmonics.beyond(), 1);
        let twice = self.finer(balance, harmonics.clone(), 2);
        let (Ok(mut more), Ok(mut twice)) = (more, twice) else {
            return;
        };
        for finer in [&mut more, &mut twice] {
            finer.settings.tolerance = finer.settings.tolerance.max(ERROR_TOLERANCE);
            finer.settings.most_iterations = ERROR_ITERATIONS;
            finer.effort.allow(error_effort(balance, finer));
        }
        let found = points
            .iter_mut()
            .filter_map(|point| point.response.as_mut());
        let mut found: Vec<&mut PointResponse> = found.collect();
        found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        for point in found {
            let coarse = &point.solution;
            if coarse.active_elements() == 0 {
                (point.error, point.friction_error) = (Some(0.0), Some(0.0));
                continue;
            }
            // Friction cannot give energy: all of it is error.
            let sampled = balance.work_error(coarse);
            if coarse.energy.friction < 0.0 {
                point.friction_error = Some(sampled.max(UNKNOWN));
            }
            if more.effort.is_spent() || twice.effort.is_spent() {
                continue;
            }
            let [by_harmonics, by_samples] =
                [&more, &twice].map(|finer| self.errors_by(balance, point, finer));
            if more.effort.is_spent() || twice.effort.is_spent() {
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

    /// What amplitude and energy of friction of a point differ by, relative to them, from those of another balance that is solved from it; none where
    /// that has none near.
    fn errors_by(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        point: &PointResponse,
        finer: &HarmonicBalance<ContactElement>,
    ) -> Option<[f64; 2]> {
        let coarse = &point.solution;
        let start = coarse.start();
        let start = start.transferred(balance.harmonics(), finer.harmonics());
        let fine = finer.solve_near(coarse.omega, &start).ok()?;
        let amplitude = finer.amplitude(&fine, self.response_port).ok()?.0;
        Some([
            error(point.amplitude, amplitude),
            error(coarse.energy.friction, fine.energy.friction),
        ])
    }
}

/// Evaluations by which errors of points are found: they may cost as much as the points did, where an evaluation goes with the samples and the cube of
/// the unknowns, or as much as [`ERROR_EVALUATIONS`] of few unknowns.
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

/// The point with the largest amplitude, and its place; none where none has a response.
fn highest(points: &[ForcedPoint]) -> Option<(usize, &PointResponse)> {
    let found = points.iter().enumerate();
    let found = found.filter_map(|(place, point)| Some((place, point.response.as_ref()?)));
    found.max_by(|(_, a), (_, b)| a.amplitude.total_cmp(&b.amplitude))
}

/// Whether a point has no other one of its branch beside it on one side.
fn is_end(points: &[ForcedPoint], place: usize) -> bool {
    let beside = [place.checked_sub(1), Some(place + 1)];
    beside.into_iter().any(|k| {
        let other = k.and_then(|k| points.get(k));
        other.is_none_or(|other| other.branch != points[place].branch || other.response.is_none())
    })
}

/// Whether friction does work in a response, which it cannot.
pub(super) fn gives_energy(response: &Response) -> bool {
    let energy = response.energy;
    energy.friction < -GIVEN * (energy.input.abs() + energy.viscous + energy.hysteretic)
}

/// Error of a figure, relative to it, from that with more harmonics or samples: all of it where it is zero, or rounding, and that is not.
fn error(figure: f64, finer: f64) -> f64 {
    if figure == finer {
        return 0.0;
    }
    let error = TAIL * (figure - finer).abs() / figure.abs();
    match error.is_finite() {
        true => error,
        false => UNKNOWN,
    }
}

/// Difference of the largest and the least value over a cycle.
fn peak_to_peak(harmonics: &Harmonics, row: &[f64]) -> f64 {
    let values = (0..INSTANTS).map(|k| {
        let basis = harmonics.basis(TAU * k as f64 / INSTANTS as f64);
        row.iter().zip(&basis).map(|(a, b)| a * b).sum::<f64>()
    });
    2.0 * half_range(values)
}
