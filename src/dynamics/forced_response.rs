//! The response over a range of frequencies, point by point: each with how it was found, or why it was not.

use std::f64::consts::TAU;

use super::candidates::gives_energy;
use super::contact_element::ContactElement;
use super::cycle::half_range;
use super::effort::POINTS;
use super::periodic::{Periodic, Settled};
use super::survey::{EFFORT, first_harmonic, is_near, start_of};
use super::time_integration::Motion;
use super::vibration::Vibration;
use super::{ContinuationSettings, DynamicsError, Energy, HarmonicBalance, Harmonics, Response};

/// Newton correction that a point of a forced response is left with at most; its energies are then in balance to 1e-10.
const TOLERANCE: f64 = 1e-7;
/// That of banks of sliders, whose every Newton step is dear: far below the width of a line of a plot.
const DEAR_TOLERANCE: f64 = 1e-5;
/// The largest step of their continuation: lines between points of a linear resonance are within 0.2 % of its peak.
const DEAR_STEP: f64 = 1.0 / 12.0;
/// Points at most whose stability is found.
const MULTIPLIERS: usize = 60;
/// Integration steps for all points at which the balance of a small model has no response: some third of a second. Each may take its share of what
/// is left.
const IN_TIME: usize = 300_000;
/// Instants at which the range of a displacement over a cycle is looked for.
const INSTANTS: usize = 512;

/// How a point of a forced response was found.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FoundBy {
    /// As a solution of the harmonic balance.
    Balance,
    /// As a motion in time that repeats after every period of the drive, which the balance did not find.
    Time,
    /// As a solution of the harmonic balance in which friction gives energy: with these samples or harmonics, and none in truth.
    Unphysical,
    /// Not: in time the motion repeats after so many periods of the drive.
    NotPeriodic(usize),
    /// Not: in time the motion does not settle within what was waited for.
    NotSettled,
    /// Not, and it is not known whether there is one.
    Nothing,
}

impl FoundBy {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            FoundBy::Balance => "harmonic_balance",
            FoundBy::Time => "time_integration",
            FoundBy::Unphysical => "unphysical",
            FoundBy::NotPeriodic(_) => "not_periodic",
            FoundBy::NotSettled => "not_settled",
            FoundBy::Nothing => "not_found",
        }
    }

    /// Periods of the drive after which the motion in time repeats; none where that is not known.
    pub fn periods(self) -> Option<usize> {
        match self {
            FoundBy::Time => Some(1),
            FoundBy::NotPeriodic(turns) => Some(turns),
            _ => None,
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
    /// Energy per cycle.
    pub energy: Energy,
    /// Relative error of the amplitude: of a motion in time by the length of steps and by what had not settled, of the balance by harmonics and
    /// samples that are too few. None where it is not known, 1 where nothing is.
    pub error: Option<f64>,
    /// Relative error of the energy of friction by harmonics and samples that are too few; none where it is not known.
    pub friction_error: Option<f64>,
    /// Elements that had unknowns; none of a motion in time.
    pub active_elements: usize,
    /// Largest modulus of the multipliers by which small disturbances grow over a period; none where it is not known. Of many points it is
    /// found for some.
    pub multiplier: Option<f64>,
}

/// Points of a forced response, and of which of them the balance has responses that slip or open.
#[derive(Default)]
struct Points {
    points: Vec<ForcedPoint>,
    solved: Vec<(usize, Response)>,
}

impl Points {
    fn add(&mut self, point: ForcedPoint, response: Option<Response>) {
        let active = response.filter(|response| response.active_elements() > 0);
        self.solved
            .extend(active.map(|response| (self.points.len(), response)));
        self.points.push(point);
    }

    fn append(&mut self, (point, response): (ForcedPoint, Option<Response>)) {
        self.add(point, response);
    }
}

/// One point of a forced response.
#[derive(Debug, Clone, PartialEq)]
pub struct ForcedPoint {
    /// Frequency of the fundamental \[Hz\].
    pub frequency: f64,
    /// How it was found.
    pub found_by: FoundBy,
    /// The correction that Newton's method left, relative to the displacements; of a motion in time its change over a period. Where nothing
    /// was found, what the last attempt had left.
    pub residual: f64,
    /// Number of the branch that it is on; none of a point by itself.
    pub branch: Option<usize>,
    /// Whether its branch turns back in frequency here.
    pub is_fold: bool,
    /// The response; none where nothing was found.
    pub response: Option<PointResponse>,
}

impl Vibration {
    /// The response over the range: at its `points`, on the branches on which a sweep upwards arrives
    /// ([`HarmonicBalance::sweep`]) and of a small model the largest of its survey where none does, or as continuation places its points, overhanging parts of the branches included. Points of a large
    /// model are solved to 1e-7 of the displacements if not as exactly as the balance says: they are looked at, and nothing goes on
    /// from them.
    ///
    /// What the balance does not find is looked for in time, where the structure can be integrated.
    ///
    /// # Errors
    /// Where no point at all was found, that of the first.
    pub fn forced_response(
        &self,
        mut balance: HarmonicBalance<ContactElement>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        if !balance.is_small() {
            let enough = match balance.is_costly {
                true => DEAR_TOLERANCE,
                false => TOLERANCE,
            };
            balance.settings.tolerance = balance.settings.tolerance.max(enough);
        }
        let (found, failure) = match self.omegas() {
            Some(omegas) => self.at_points(&balance, &omegas)?,
            None if balance.is_small() => self.of_survey(&balance)?,
            None => self.of_branch(&balance)?,
        };
        let Points { mut points, solved } = found;
        match failure {
            Some(error) if points.iter().all(|point| point.response.is_none()) => {
                return Err(error);
            }
            _ => {}
        }
        if balance.is_small() {
            self.estimate_errors(&balance, &solved, &mut points);
        }
        let every = solved.len().div_ceil(MULTIPLIERS).max(1);
        let some: Vec<(usize, Response)> = solved.into_iter().step_by(every).collect();
        let amplitude = |k: usize| points[k].response.as_ref().map_or(0.0, |r| r.amplitude);
        let each: Vec<(&Response, f64)> = some.iter().map(|(k, r)| (r, amplitude(*k))).collect();
        let multipliers = self.multipliers(&balance, &each);
        for ((k, _), multiplier) in some.iter().zip(multipliers) {
            if let Some(found) = &mut points[*k].response {
                found.multiplier = multiplier;
            }
        }
        Ok(points)
    }

    fn at_points(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omegas: &[f64],
    ) -> Result<(Points, Option<DynamicsError>), DynamicsError> {
        let mut failure = None;
        let mut found = Points::default();
        let mut motion: Option<Motion> = None;
        if balance.is_small() {
            balance.effort.allow(POINTS);
        }
        let mut responses = balance.sweep(omegas);
        if balance.is_small()
            && responses.iter().any(Result::is_err)
            && let Ok(survey) = self.survey(balance)
        {
            // What a sweep does not arrive at may be on a branch of the survey.
            balance.effort.allow(POINTS / 2);
            for (response, &omega) in responses.iter_mut().zip(omegas) {
                if response.is_err()
                    && let Some(found) = survey.highest_at(balance, self.response_port, omega)
                {
                    *response = Ok(found);
                }
            }
        }
        let mut failed = responses.iter().filter(|r| r.is_err()).count();
        let mut left = IN_TIME;
        for (response, &omega) in responses.into_iter().zip(omegas) {
            match response {
                Ok(response) => {
                    motion = balance.motion(&response);
                    found.add(self.point(balance, &response, None)?, Some(response));
                }
                Err(error) => {
                    let share = EFFORT.min(left / failed);
                    failed -= 1;
                    if let Some(response) = self.by_easing(balance, omega) {
                        found.add(self.point(balance, &response, None)?, Some(response));
                        continue;
                    }
                    let start = motion.as_ref();
                    let (point, steps) =
                        self.point_in_time(balance, omega, start, &error, share)?;
                    left = left.saturating_sub(steps);
                    found.append(point);
                    failure.get_or_insert(error);
                }
            }
        }
        Ok((found, failure))
    }

    fn of_survey(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<(Points, Option<DynamicsError>), DynamicsError> {
        let survey = self.survey(balance)?;
        let mut found = Points::default();
        for (number, branch) in survey.branches.iter().enumerate() {
            self.add_branch(balance, branch, number, &mut found)?;
        }
        for periodic in &survey.motions {
            let point = ForcedPoint {
                frequency: periodic.frequency(),
                found_by: FoundBy::Time,
                residual: periodic.change,
                branch: None,
                is_fold: false,
                response: Some(self.of_motion(balance, periodic)),
            };
            found.add(point, None);
        }
        for &(omega, found_by) in &survey.missed {
            let point = ForcedPoint {
                frequency: omega / TAU,
                found_by,
                residual: 1.0,
                branch: None,
                is_fold: false,
                response: None,
            };
            found.add(point, None);
        }
        Ok((found, survey.stopped))
    }

    fn of_branch(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<(Points, Option<DynamicsError>), DynamicsError> {
        let mut settings =
            ContinuationSettings::over(self.range.0, self.range.1, self.response_port);
        if balance.is_costly {
            settings.largest_step = DEAR_STEP;
        }
        let (branches, failure) = balance.parts(settings)?;
        let mut found = Points::default();
        for (number, branch) in branches.iter().enumerate() {
            self.add_branch(balance, branch, number, &mut found)?;
        }
        if let (Some(error), [there, rest]) = (&failure, &branches[..])
            && let (Some(end), Some(start)) = (there.last(), rest.first())
            && start.omega > end.omega
        {
            // What the two parts leave out.
            let omega = 0.5 * (end.omega + start.omega);
            let (point, _) = self.point_in_time(balance, omega, None, error, EFFORT)?;
            found.append(point);
        }
        Ok((found, failure))
    }

    fn add_branch(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        branch: &[Response],
        number: usize,
        found: &mut Points,
    ) -> Result<(), DynamicsError> {
        for (k, response) in branch.iter().enumerate() {
            let mut point = self.point(balance, response, Some(number))?;
            if let (Some(before), Some(after)) = (k.checked_sub(1), branch.get(k + 1)) {
                let before = response.omega - branch[before].omega;
                point.is_fold = before * (after.omega - response.omega) < 0.0;
            }
            found.add(point, Some(response.clone()));
        }
        Ok(())
    }

    fn point(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: &Response,
        branch: Option<usize>,
    ) -> Result<ForcedPoint, DynamicsError> {
        let (amplitude, phase_lag) = balance.amplitude(response, self.response_port)?;
        let displacement = self.at_response(balance, &response.displacement);
        if balance.is_small() && gives_energy(response) {
            return Ok(ForcedPoint {
                frequency: response.frequency(),
                found_by: FoundBy::Unphysical,
                residual: response.correction,
                branch,
                is_fold: false,
                response: None,
            });
        }
        Ok(ForcedPoint {
            frequency: response.frequency(),
            found_by: FoundBy::Balance,
            residual: response.correction,
            branch,
            is_fold: false,
            response: Some(PointResponse {
                amplitude,
                phase_lag,
                peak_to_peak: peak_to_peak(balance.harmonics(), &displacement),
                displacement,
                energy: response.energy,
                error: None,
                friction_error: None,
                active_elements: response.active_elements(),
                multiplier: None,
            }),
        })
    }

    /// The point at `omega` where the balance ends in `error`, by about as many integration steps as `effort` says, and how many.
    fn point_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        start: Option<&Motion>,
        error: &DynamicsError,
        effort: usize,
    ) -> Result<((ForcedPoint, Option<Response>), usize), DynamicsError> {
        let left = match error {
            // As large as the displacements: nothing is known.
            DynamicsError::NotConverged { correction, .. } => correction.min(1.0),
            _ => 1.0,
        };
        let mut point = ForcedPoint {
            frequency: omega / TAU,
            found_by: FoundBy::Nothing,
            residual: left,
            branch: None,
            is_fold: false,
            response: None,
        };
        let (settled, steps) = match self.settle(balance, omega, start, effort) {
            Some((settled, steps)) => (Some(settled), steps),
            None => (None, 0),
        };
        match settled {
            Some(Ok(Settled::Periodic(periodic))) => {
                if let Ok(response) = balance.solve(omega, Some(&start_of(&periodic))) {
                    let amplitude =
                        |rows: &[f64]| first_harmonic(balance, rows, self.response_port);
                    let (ours, theirs) = (
                        amplitude(&response.displacement),
                        amplitude(&periodic.displacement),
                    );
                    // Else the balance has led to another response.
                    if is_near(ours, theirs) {
                        let point = self.point(balance, &response, None)?;
                        return Ok(((point, Some(response)), steps));
                    }
                }
                point.found_by = FoundBy::Time;
                point.residual = periodic.change;
                point.response = Some(self.of_motion(balance, &periodic));
            }
            Some(Ok(Settled::Turns(turns))) => point.found_by = FoundBy::NotPeriodic(turns),
            Some(Ok(Settled::Unsettled(_))) => point.found_by = FoundBy::NotSettled,
            Some(Err(_)) | None => {}
        }
        Ok(((point, None), steps))
    }

    pub(super) fn of_motion(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        periodic: &Periodic,
    ) -> PointResponse {
        let displacement = self.at_response(balance, &periodic.displacement);
        let (amplitude, phase_lag) = balance.amplitude_of(&displacement);
        PointResponse {
            amplitude,
            phase_lag,
            peak_to_peak: peak_to_peak(balance.harmonics(), &displacement),
            displacement,
            energy: periodic.energy,
            error: None,
            friction_error: None,
            active_elements: 0,
            multiplier: periodic.multiplier,
        }
    }

    fn at_response(&self, balance: &HarmonicBalance<ContactElement>, rows: &[f64]) -> Vec<f64> {
        let n = balance.harmonics().coefficients();
        rows[self.response_port * n..][..n].to_vec()
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
