//! Truncation error of the harmonic series and of the samples, and extension of the harmonics to a tolerance.

use super::contact_element::ContactElement;
use super::newton::FREQUENCY_WEIGHT;
use super::response::Energy;
use super::vibration::{Resonance, ResonanceKind, Vibration};
use super::{DynamicsError, HarmonicBalance, Harmonics, Response, Start};
use crate::journal::Journal;
use crate::linalg::add_scaled;

/// Ratio of the estimated error to the change of the response when the harmonics are about doubled. The truncation
/// error of friction falls about with the square of the first missing order. At least a third of the error remains when
/// the harmonics are doubled.
pub(super) const TAIL: f64 = 2.0;
/// Ratio of the estimated error to the change of the response if the response with doubled harmonics is the result.
/// Only the error of the response with doubled harmonics then counts. An error that falls with the square of the order
/// would give a ratio of a quarter.
const LEFT_OUT: f64 = 1.0 / 3.0;
/// Tolerance of a response with doubled harmonics that becomes the result.
const TAKEN: f64 = 1e-3;
/// Largest ratio of the error after a doubling of the harmonics to the error before the doubling. Above this ratio,
/// another doubling is not worth its cost.
const GAIN: f64 = 0.7;
/// Tolerance of an expensive response with doubled harmonics. The last correction of Newton's method is a part of the
/// error. The truncation error of few harmonics is several times as large as this correction. If banks lift off and
/// land again, Newton's method sometimes does not reach a smaller correction.
const ESTIMATED: f64 = 1e-2;
/// Tolerance of a cheap response with doubled harmonics. The tolerance is small against the truncation error.
const ROUGHLY: f64 = 1e-5;
/// Error if the solver finds no response with more harmonics, so that the error is unknown.
pub(super) const UNKNOWN: f64 = 1.0;
/// Highest order of the harmonics that the search adds. With this order, 340 elements have 64 000 unknowns.
const HIGHEST: u32 = 31;
/// Share of the input below which a dissipation is faint: rounding of the input does not count as its error.
pub(super) const FAINT_DISSIPATION: f64 = 1e-6;
/// Highest order of the first solve for a response in many harmonics.
const FEW: u32 = 3;

/// Estimated relative errors of a resonance. Missing harmonics and too few samples cause the errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TruncationError {
    /// Error of the frequency of the phase resonance.
    pub frequency: f64,
    /// Error of the amplitude there, and of the peak.
    pub amplitude: f64,
    /// Error of the energy that friction dissipates per cycle.
    pub friction_energy: f64,
    /// Estimated relative change of the frequency with all harmonics, with its sign. `None` if unknown.
    pub expected_frequency_change: Option<f64>,
}

impl TruncationError {
    /// Errors if no response was found with more harmonics.
    const UNKNOWN: TruncationError = TruncationError {
        frequency: UNKNOWN,
        amplitude: UNKNOWN,
        friction_energy: UNKNOWN,
        expected_frequency_change: None,
    };

    /// Errors of a response without truncation.
    pub const NONE: TruncationError = TruncationError {
        frequency: 0.0,
        amplitude: 0.0,
        friction_energy: 0.0,
        expected_frequency_change: Some(0.0),
    };

    fn plus(self, other: TruncationError) -> TruncationError {
        TruncationError {
            frequency: self.frequency + other.frequency,
            amplitude: self.amplitude + other.amplitude,
            friction_energy: self.friction_energy + other.friction_energy,
            expected_frequency_change: self
                .expected_frequency_change
                .zip(other.expected_frequency_change)
                .map(|(a, b)| a + b),
        }
    }

    /// Adds the Newton correction of a resonance if it exceeds the `tolerance`. An unknown error, or the error of an
    /// amplitude that is rounding, is 1.
    fn with_newton_error(self, resonance: &Resonance, tolerance: f64) -> TruncationError {
        let left = resonance
            .governing()
            .correction
            .max(resonance.peak.correction);
        let left = if left > tolerance { left } else { 0.0 };
        let amplitude = match resonance.is_still {
            true => UNKNOWN,
            false => self.amplitude,
        };
        TruncationError {
            frequency: self.frequency.min(UNKNOWN) + left,
            amplitude: amplitude.min(UNKNOWN) + left,
            friction_energy: self.friction_energy.min(UNKNOWN) + left,
            ..self
        }
    }

    fn scaled(self, factor: f64) -> TruncationError {
        TruncationError {
            frequency: factor * self.frequency,
            amplitude: factor * self.amplitude,
            friction_energy: factor * self.friction_energy,
            expected_frequency_change: self.expected_frequency_change,
        }
    }

    /// Returns the larger of the errors of amplitude and dissipation, which controls the extension of the harmonics.
    pub fn largest(&self) -> f64 {
        self.amplitude.max(self.friction_energy)
    }
}

/// Resonance, the harmonic balance that computed the resonance, and the truncation error of the resonance.
pub struct ResolvedResonance<'a> {
    pub balance: HarmonicBalance<ContactElement>,
    pub resonance: Resonance,
    pub truncation: TruncationError,
    pub(super) vibration: &'a Vibration,
    /// Whether the peak and the errors are still missing.
    is_open: bool,
    /// Difference of the response with more harmonics, if a caller requested the response with more harmonics.
    pub correction: Option<Correction>,
    /// Extensions of the harmonics, in order.
    pub extensions: Vec<Extension>,
}

/// Request to use the response with more harmonics as the result.
#[derive(Debug, Clone, Copy)]
pub struct CorrectionRequest<'a> {
    /// The correction of a nearby response, if known. The solve starts from the known correction.
    pub near: Option<&'a Correction>,
}

/// Result of an extension of the harmonics, and the cost of the extension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extension {
    /// The highest order.
    pub highest: u32,
    /// The larger of the errors of amplitude and dissipation that the extension estimates.
    pub error: f64,
    /// Number of Newton iterations.
    pub iterations: usize,
    /// Number of coefficients of the contact displacements.
    pub unknowns: usize,
}

/// Difference between a response and the response with about twice the harmonics. The difference changes little from
/// one response to the next.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Change of the displacement of the ports, `ports × coefficients` \[m\].
    pub displacement: Vec<f64>,
    /// Relative change of the frequency.
    pub frequency: f64,
    /// Relative changes of the energies: input, friction, viscous and hysteretic damping.
    pub energy: [f64; 4],
}

impl Correction {
    /// Creates the correction that changes nothing.
    fn zero(coarse: &HarmonicBalance<ContactElement>, response: &Response) -> Correction {
        Correction {
            harmonics: coarse.harmonics().clone(),
            displacement: vec![0.0; response.displacement.len()],
            frequency: 0.0,
            energy: [0.0; 4],
        }
    }

    /// Computes the correction from the response of a balance to the response of a finer one.
    fn between(
        coarse: &HarmonicBalance<ContactElement>,
        response: &Response,
        finer: &HarmonicBalance<ContactElement>,
        fine: &Response,
    ) -> Correction {
        let coarse_rows = coarse
            .harmonics()
            .transfer(&response.displacement, finer.harmonics());
        let change = |from: f64, to: f64| if from == 0.0 { 0.0 } else { to / from - 1.0 };
        let pairs = energies(response).into_iter().zip(energies(fine));
        let mut energy = [0.0; 4];
        energy
            .iter_mut()
            .zip(pairs)
            .for_each(|(e, (from, to))| *e = change(from, to));
        Correction {
            harmonics: finer.harmonics().clone(),
            displacement: fine
                .displacement
                .iter()
                .zip(&coarse_rows)
                .map(|(to, from)| to - from)
                .collect(),
            frequency: change(response.omega, fine.omega),
            energy,
        }
    }

    /// Applies the correction to a response of a balance. `refined_balance` is the balance with the harmonics of the correction.
    fn apply(
        &self,
        coarse: &HarmonicBalance<ContactElement>,
        response: &Response,
        finer: &HarmonicBalance<ContactElement>,
    ) -> Response {
        let mut displacement = coarse
            .harmonics()
            .transfer(&response.displacement, &self.harmonics);
        add_scaled(&mut displacement, 1.0, &self.displacement);
        let [input, friction, viscous, hysteretic] = {
            let mut energies = energies(response);
            energies
                .iter_mut()
                .zip(self.energy)
                .for_each(|(e, change)| *e *= 1.0 + change);
            energies
        };
        Response {
            omega: response.omega * (1.0 + self.frequency),
            force: finer.contact_forces(&displacement),
            displacement,
            energy: Energy {
                load_work: input,
                friction,
                viscous,
                hysteretic,
            },
            ..response.clone()
        }
    }
}

fn energies(response: &Response) -> [f64; 4] {
    let energy = response.energy;
    [
        energy.load_work,
        energy.friction,
        energy.viscous,
        energy.hysteretic,
    ]
}

impl Vibration {
    /// Computes the resonance of the structure with the contact elements `elements`. If the vibration has a single
    /// frequency, the function computes the response at this frequency.
    ///
    /// The search can start from a response. The search uses the harmonics of the vibration, or the harmonics of the
    /// start response if these are more. With a `tolerance`, the search adds harmonics up to order 31. The search stops
    /// when the estimated errors of amplitude and dissipation are within the tolerance.
    ///
    /// # Errors
    /// Returns the errors of [`Vibration::resonance`].
    pub fn resolve(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
        tolerance: Option<f64>,
    ) -> Result<ResolvedResonance<'_>, DynamicsError> {
        self.resolve_governing_response(elements, start)?
            .with_peak_and_errors(tolerance, None)
    }

    /// Computes the resonance of [`Vibration::resolve`] without the peak, the errors and the extension of the
    /// harmonics. A caller can try other elements before [`ResolvedResonance::with_peak_and_errors`].
    ///
    /// # Errors
    /// Returns the errors of [`Vibration::resonance`].
    pub fn resolve_governing_response(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
    ) -> Result<ResolvedResonance<'_>, DynamicsError> {
        let harmonics = match start {
            Some((of_start, _)) if of_start.highest() > self.harmonics.highest() => of_start,
            _ => &self.harmonics,
        };
        let balance = self.balance_of(elements, harmonics.clone())?;
        let start = match start {
            Some((of_start, start)) => Some(start.in_harmonics(of_start, harmonics)),
            None => self.start_in_few_harmonics(&balance),
        };
        let response = self.governing_response(&balance, start.as_ref())?;
        Ok(ResolvedResonance {
            resonance: self.without_peak(&balance, response)?,
            balance,
            truncation: TruncationError::UNKNOWN,
            vibration: self,
            is_open: true,
            correction: None,
            extensions: Vec::new(),
        })
    }

    /// Estimates the errors of a resonance. With a `tolerance`, extends the harmonics until the errors are within the
    /// tolerance.
    ///
    /// With a `request`, the response with more harmonics is the result, and the errors belong to that response. With a
    /// `request`, the function extends the harmonics only as long as each extension reduces the errors.
    ///
    /// # Errors
    /// Returns the errors of [`HarmonicBalance::new`].
    pub(super) fn extended(
        &self,
        balance: HarmonicBalance<ContactElement>,
        resonance: Resonance,
        tolerance: Option<f64>,
        request: Option<CorrectionRequest>,
    ) -> Result<ResolvedResonance<'_>, DynamicsError> {
        let mut resolved = ResolvedResonance {
            resonance,
            balance,
            truncation: TruncationError::UNKNOWN,
            vibration: self,
            is_open: false,
            correction: None,
            extensions: Vec::new(),
        };
        let mut before = f64::INFINITY;
        // Without a tolerance, the errors of harmonics and the errors of samples belong to the same resonance. The
        // function estimates the two errors in parallel.
        let mut sample_errors = None;
        let mut estimate = match tolerance {
            Some(_) => resolved.estimate(request),
            None => {
                let threads = &resolved.balance.threads;
                let (estimate, errors) = threads.both(
                    || resolved.estimate(request),
                    || resolved.errors_of_samples(),
                );
                sample_errors = Some(errors);
                estimate
            }
        };
        while let Some((truncation, found)) = estimate {
            resolved.truncation = truncation;
            let Some((finer, resonance)) = found else {
                break;
            };
            let largest_error = resolved.truncation.largest();
            let gains = request.is_none() || largest_error <= GAIN * before;
            let is_within = tolerance.is_none_or(|tolerance| largest_error <= tolerance);
            let coefficients = finer.harmonics().coefficients();
            resolved.extensions.push(Extension {
                highest: finer.harmonics().highest(),
                error: largest_error,
                iterations: resonance.governing().iterations,
                unknowns: 3 * finer.elements().len() * coefficients,
            });
            if request.is_some() {
                resolved.correction = Some(Correction::between(
                    &resolved.balance,
                    resolved.resonance.governing(),
                    &finer,
                    resonance.governing(),
                ));
            }
            let finer = finer.harmonics().clone();
            if is_within || !gains || finer.highest() > HIGHEST {
                break;
            }
            before = largest_error;
            let balance = self.balance_of(resolved.balance.elements().to_vec(), finer)?;
            // If more harmonics move the peak out of the range, the previous resonance remains.
            let phase = resonance.phase.as_ref().map(Response::start);
            let peak = resonance.peak.start();
            let Ok(resonance) = self.resonance_near(&balance, phase.as_ref(), &peak) else {
                break;
            };
            let before = &resolved.resonance;
            let is_end = before.peak_kind == ResonanceKind::End;
            resolved.resonance = Resonance {
                is_peak_near_phase_resonance: before.is_peak_near_phase_resonance,
                peak_kind: match is_end {
                    true => ResonanceKind::End,
                    false => resonance.peak_kind,
                },
                ..resonance
            };
            resolved.balance = balance;
            resolved.correction = None;
            estimate = resolved.estimate(request);
        }
        let tolerance = resolved.balance.settings.tolerance;
        let sample_errors = sample_errors.unwrap_or_else(|| resolved.errors_of_samples());
        let all = resolved.truncation.plus(sample_errors);
        resolved.truncation = all.with_newton_error(&resolved.resonance, tolerance);
        Ok(resolved)
    }

    /// Computes a start for many harmonics: the governing response in the lowest harmonics, at a small part of the
    /// cost.
    fn start_in_few_harmonics(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Start> {
        let orders = balance.harmonics().orders();
        let loads = || self.loads.iter().chain(&self.inertial_loads);
        let driven = |order: &u32| loads().any(|load| load.harmonic == *order);
        let few_harmonics = orders.iter().filter(|o| **o <= FEW || driven(o)).copied();
        let few_harmonics = Harmonics::new(&few_harmonics.collect::<Vec<u32>>()).ok()?;
        if few_harmonics.orders() == orders {
            return None;
        }
        let few_balance = self
            .balance_of(balance.elements().to_vec(), few_harmonics)
            .ok()?;
        let response = self.governing_response(&few_balance, None).ok()?;
        Some(
            response
                .start()
                .in_harmonics(few_balance.harmonics(), balance.harmonics()),
        )
    }
}

impl ResolvedResonance<'_> {
    /// Returns an upper bound of the peak \[m\] for any contact. `None` if damping does not limit the peak, or if the
    /// structure has a residual flexibility.
    pub fn peak_bound(&self) -> Option<f64> {
        self.vibration.peak_bound()
    }

    /// Adds the peak and the errors to the resonance, if the peak and the errors are missing.
    ///
    /// # Errors
    /// Returns the errors of [`Vibration::resonance`].
    pub fn with_peak_and_errors(
        mut self,
        tolerance: Option<f64>,
        request: Option<CorrectionRequest>,
    ) -> Result<Self, DynamicsError> {
        self = self.with_peak()?;
        let mut extended =
            self.vibration
                .extended(self.balance, self.resonance, tolerance, request)?;
        if request.is_some() && extended.correction.is_none() {
            let (balance, response) = (&extended.balance, extended.resonance.governing());
            extended.correction = Some(Correction::zero(balance, response));
        }
        Ok(extended)
    }

    /// Adds the peak, with the errors and the correction of a nearby response.
    ///
    /// # Errors
    /// Returns the errors of [`Vibration::resonance`].
    pub fn with_peak_and_known_errors(
        self,
        truncation: TruncationError,
        correction: Correction,
    ) -> Result<Self, DynamicsError> {
        Ok(ResolvedResonance {
            truncation,
            correction: Some(correction),
            is_open: false,
            ..self.with_peak()?
        })
    }

    /// Adds the peak to the resonance, if the resonance has no peak.
    ///
    /// # Errors
    /// Returns the errors of [`Vibration::resonance`].
    pub fn with_peak(mut self) -> Result<Self, DynamicsError> {
        if let Some(phase) = self.resonance.phase.take_if(|_| self.is_open) {
            self.resonance = self.vibration.with_nearby_peak(&self.balance, phase)?;
        }
        Ok(self)
    }

    /// Applies the correction of the resonance, if any, and returns the response with more harmonics.
    ///
    /// # Errors
    /// Returns the errors of [`HarmonicBalance::new`].
    pub fn corrected(&self) -> Result<Self, DynamicsError> {
        let unchanged = ResolvedResonance {
            balance: self.balance.clone(),
            resonance: self.resonance.clone(),
            correction: self.correction.clone(),
            extensions: self.extensions.clone(),
            ..*self
        };
        let Some(correction) = &self.correction else {
            return Ok(unchanged);
        };
        let vibration = self.vibration;
        let finer = vibration.refined_balance(&self.balance, correction.harmonics.clone(), 1)?;
        let correct = |response: &Response| correction.apply(&self.balance, response, &finer);
        let before = &self.resonance;
        let phase = before.phase.as_ref().map(correct);
        let resonance =
            vibration.resonance_of(&finer, phase, correct(&before.peak), before.iterations)?;
        let resonance = Resonance {
            peak_kind: before.peak_kind,
            is_peak_near_phase_resonance: before.is_peak_near_phase_resonance,
            branch: before.branch,
            ..resonance
        };
        Ok(ResolvedResonance {
            balance: finer,
            resonance,
            ..unchanged
        })
    }

    /// Estimates the errors due to missing harmonics, from the resonance with the harmonics [`Harmonics::beyond`].
    ///
    /// Returns the errors of the resonance, the balance with more harmonics, and the resonance of that balance. A
    /// linear response needs no further harmonics, because harmonics without load stay 0. With a `request`, the
    /// response with more harmonics is the result, and the errors belong to the response with more harmonics. Returns
    /// `None` if the solver finds no resonance with more harmonics; the errors of the resonance then remain as before.
    #[allow(clippy::type_complexity)]
    fn estimate(
        &self,
        request: Option<CorrectionRequest>,
    ) -> Option<(
        TruncationError,
        Option<(HarmonicBalance<ContactElement>, Resonance)>,
    )> {
        if self.is_linear() {
            return Some((TruncationError::NONE, None));
        }
        let harmonics = self.balance.harmonics().beyond();
        let finer = self
            .vibration
            .refined_balance(&self.balance, harmonics, 1)
            .ok()?;
        let (truncation, resonance) = self.errors_by(&finer, request)?;
        let truncation = match request {
            Some(_) => TruncationError {
                expected_frequency_change: truncation
                    .expected_frequency_change
                    .map(|change| LEFT_OUT * change),
                ..truncation.scaled(LEFT_OUT / TAIL)
            },
            None => truncation,
        };
        Some((truncation, Some((finer, resonance))))
    }

    /// Estimates the errors due to too few samples, from the difference to the resonance with twice the samples. Too
    /// few samples and missing harmonics cause errors that can cancel. Separate functions estimate the errors due to
    /// samples and the errors due to harmonics.
    fn errors_of_samples(&self) -> TruncationError {
        if self.is_linear() {
            return TruncationError::NONE;
        }
        let harmonics = self.balance.harmonics().clone();
        let more_samples = self.vibration.refined_balance(&self.balance, harmonics, 2);
        // The solve with more samples can run in parallel with another solve, so the order of journal entries would be
        // random.
        let more_samples = more_samples.map(|more_samples| HarmonicBalance {
            journal: Journal::default(),
            ..more_samples
        });
        let errors_found = more_samples
            .ok()
            .and_then(|more_samples| self.errors_by(&more_samples, None));
        let mut errors = errors_found.map_or(TruncationError::UNKNOWN, |(errors, _)| errors);
        let work_error = self.balance.work_error(self.resonance.governing());
        errors.friction_energy = errors.friction_energy.max(work_error);
        errors
    }

    fn is_linear(&self) -> bool {
        let Resonance { peak, .. } = &self.resonance;
        let responses = [self.resonance.governing(), peak];
        responses
            .iter()
            .all(|response| response.active_elements() == 0)
    }

    /// Estimates the errors from the difference to the resonance of another balance, and returns that resonance.
    /// Returns `None` if the solver finds no resonance with the other balance.
    ///
    /// A single value can change little because two larger changes cancel. Because changes can cancel, the estimated
    /// error of the amplitude has a lower bound. The lower bound is the overall change of all coefficients of the
    /// contact displacements. The error of the dissipation is the sum of the changes of all elements.
    fn errors_by(
        &self,
        finer: &HarmonicBalance<ContactElement>,
        request: Option<CorrectionRequest>,
    ) -> Option<(TruncationError, Resonance)> {
        let coarse = self.resonance.governing();
        let harmonics = self.balance.harmonics();
        let Resonance {
            phase,
            is_peak_near_phase_resonance: is_beside,
            ..
        } = &self.resonance;
        let mut finer = finer.clone();
        let tolerance = match finer.has_expensive_jacobian {
            true if request.is_some() => TAKEN,
            true => ESTIMATED,
            false => ROUGHLY,
        };
        finer.settings.tolerance = finer.settings.tolerance.max(tolerance);
        let solve = || -> Result<_, DynamicsError> {
            let to_finer = |response: &Response| {
                let start = response.start();
                start.in_harmonics(harmonics, finer.harmonics())
            };
            let start = to_finer(coarse);
            let near = request.and_then(|request| request.near);
            let near = near.filter(|near| near.harmonics == *finer.harmonics());
            let corrected_start = |start: &Start| {
                let mut start = start.clone();
                if let Some(near) = near {
                    add_scaled(&mut start.displacement, 1.0, &near.displacement);
                    start.omega *= 1.0 + near.frequency;
                }
                start
            };
            let fine = match is_beside {
                // A peak near the phase resonance is computed from the phase resonance, so the peak needs no new
                // search.
                true => {
                    let range = self.vibration.range;
                    let phase = finer.phase_resonance_near(range, &corrected_start(&start))?;
                    self.vibration
                        .resonance_of(&finer, Some(phase.clone()), phase, 0)?
                }
                false => {
                    let peak = corrected_start(&to_finer(&self.resonance.peak));
                    let phase = phase.as_ref().map(|_| corrected_start(&start));
                    self.vibration
                        .resonance_near(&finer, phase.as_ref(), &peak)?
                }
            };
            Ok((start, fine))
        };
        let (start, fine) = solve().ok()?;
        let contact = 3 * finer.elements().len() * finer.harmonics().coefficients();
        let newton_error = fine.governing().correction.max(fine.peak.correction);
        let overall_change = distance(
            &start.displacement[..contact],
            &fine.governing().displacement[..contact],
            harmonics,
            finer.harmonics(),
        ) + newton_error;
        // The change of a value to 0 is unknown, unless the value was 0 before.
        let change = |coarse: f64, fine: f64| match (coarse / fine - 1.0).abs() {
            change if change <= UNKNOWN => change,
            _ if coarse == fine => 0.0,
            _ => UNKNOWN,
        };
        // Changes of opposite sign in two elements add up: the joint wears elsewhere.
        let [before, after] = [
            self.balance.dissipated_energies(coarse),
            finer.dissipated_energies(fine.governing()),
        ];
        let moved_energy: f64 = before.iter().zip(&after).map(|(b, a)| (b - a).abs()).sum();
        let total_energy: f64 = after.iter().map(|energy| energy.abs()).sum();
        let total_energy =
            total_energy.max(FAINT_DISSIPATION * fine.governing().energy.load_work.abs());
        let energy = match moved_energy / total_energy + newton_error {
            change if change <= UNKNOWN => change,
            _ if moved_energy == 0.0 => 0.0,
            _ => UNKNOWN,
        };
        // An amplitude that is rounding has no error of its own; only motion elsewhere counts.
        let is_still = self.resonance.is_still;
        let peak = match is_beside {
            _ if is_still => 0.0,
            false => change(self.resonance.peak_amplitude, fine.peak_amplitude),
            true => 0.0,
        };
        let amplitude = match is_still {
            true => 0.0,
            false => change(self.resonance.amplitude, fine.amplitude),
        };
        let truncation = TruncationError {
            frequency: TAIL
                * (change(coarse.omega, fine.governing().omega) + newton_error / FREQUENCY_WEIGHT),
            amplitude: TAIL * amplitude.max(overall_change).max(peak),
            friction_energy: TAIL * energy,
            expected_frequency_change: Some(fine.governing().omega / coarse.omega - 1.0),
        };
        Some((truncation, fine))
    }
}

/// Returns the Euclidean distance of two rows of coefficients, relative to the second. The rows `a` and `b` have the
/// harmonics `all`. The distance includes only the orders of `kept`, without the mean.
fn distance(a: &[f64], b: &[f64], kept: &Harmonics, all: &Harmonics) -> f64 {
    let n = all.coefficients();
    let slots: Vec<usize> = kept.orders()[1..]
        .iter()
        .filter_map(|order| all.slot_of(*order))
        .flat_map(|slot| [slot, slot + 1])
        .collect();
    let (mut change, mut size) = (0.0, 0.0);
    for (a, b) in a.chunks(n).zip(b.chunks(n)) {
        for &slot in &slots {
            change += (a[slot] - b[slot]).powi(2);
            size += b[slot].powi(2);
        }
    }
    if size > 0.0 {
        (change / size).sqrt()
    } else {
        0.0
    }
}
