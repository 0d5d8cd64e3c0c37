//! Driven structure whose contact elements change: parts, responses and results of the structure.

use super::contact_element::ContactElement;
use super::peak_bound::{DampingRates, velocity_bound};
use super::{
    BalanceSettings, DynamicsError, HarmonicBalance, Harmonics, Load, Response, SecondOrder, Start,
};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::threads::Threads;

/// Driven structure without contact elements. The contact elements change during wear.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// The damped linear structure and the ports of the structure.
    pub model: SecondOrder,
    /// The loads. The drive is the first load of harmonic 1 on the response port. Without such a load, the drive is the
    /// first load of harmonic 1 on any port.
    pub loads: Vec<Load>,
    /// Loads that grow with the square of frequency, as in [`HarmonicBalance::with_inertial_loads`].
    pub inertial_loads: Vec<Load>,
    /// Port whose first harmonic is the response.
    pub response_port: usize,
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Settings of accuracy and effort.
    pub settings: BalanceSettings,
    /// Given angular frequency of the response that moves the joint \[rad/s\]; `None` to use the phase resonance.
    pub at_omega: Option<f64>,
    /// Range of angular frequencies of the resonance and of the forced response \[rad/s\].
    pub range: (f64, f64),
    /// Number of equidistant points of the forced response over the range. `None` if continuation places the points.
    pub points: Option<usize>,
    /// Gauge that counts iterations and points for progress reports.
    pub gauge: Gauge,
    /// Journal of solutions: reads solutions of an interrupted run and stores new ones.
    pub journal: Journal,
    /// Threads for the computation.
    pub threads: Threads,
}

/// Kind of a peak, or of the response that moves the joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResonanceKind {
    /// The displacement lags the drive by 90°.
    PhaseResonance,
    /// The first harmonic at the response port has a maximum.
    Peak,
    /// The first harmonic is largest at an end of the range or of a branch.
    End,
    /// The response is at the single frequency [`Vibration::at_omega`].
    Forced,
}

impl ResonanceKind {
    /// Returns the name of the kind in tables.
    pub fn name(self) -> &'static str {
        match self {
            ResonanceKind::PhaseResonance => "phase_resonance",
            ResonanceKind::Peak => "peak",
            ResonanceKind::End => "end",
            ResonanceKind::Forced => "forced",
        }
    }
}

/// Resonance of a structure with contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    /// The phase resonance: the response whose displacement at the drive lags the drive by 90°. `None` if the range has
    /// no phase resonance, or for a response at a single frequency.
    pub phase: Option<Response>,
    /// The response port.
    pub port: usize,
    /// Half range of the first harmonic at the response port \[m\]: at the phase resonance, or at the peak without one.
    pub amplitude: f64,
    /// Frequency of the largest first harmonic at the response port that was found \[Hz\].
    pub peak_frequency: f64,
    /// Half range of the largest first harmonic at the response port \[m\].
    pub peak_amplitude: f64,
    /// The response at the peak, or at the single frequency of the vibration.
    pub peak: Response,
    /// Kind of the response `peak`: a peak, an end of the range, an end of a branch, or the response at the single
    /// frequency of the vibration.
    pub peak_kind: ResonanceKind,
    /// Whether the peak is the peak next to the phase resonance.
    pub is_peak_near_phase_resonance: bool,
    /// Number of the peak's branch of the forced response; `None` if the peak was found without the forced response.
    pub branch: Option<usize>,
    /// Number of Newton iterations of phase resonance and peak.
    pub iterations: usize,
    /// Whether the response port does not move, except for rounding.
    pub is_still: bool,
}

impl Resonance {
    /// Returns the governing response, which moves the joint: the phase resonance, or the peak if the range has no
    /// phase resonance.
    pub fn governing(&self) -> &Response {
        self.phase.as_ref().unwrap_or(&self.peak)
    }
}

/// Number of samples per period of the highest harmonic. For an element that slips, opens or touches a stop, the
/// contact force has a sampling error. The sampling error falls with the square of the number of samples.
const SAMPLES_PER_PERIOD: usize = 10;

/// Returns the number of samples per cycle that resolve harmonics up to `highest`.
pub fn samples_of(highest: u32) -> usize {
    SAMPLES_PER_PERIOD * highest as usize
}

/// Relative difference of two frequencies up to which the difference is rounding.
const SAME_FREQUENCY: f64 = 1e-9;

impl Vibration {
    /// Creates the harmonic balance of the structure with the contact elements `elements`.
    ///
    /// # Errors
    /// As [`HarmonicBalance::new`].
    pub fn balance(
        &self,
        elements: Vec<ContactElement>,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        self.balance_of(elements, self.harmonics.clone())
    }

    /// Creates the harmonic balance of the structure with the contact elements `elements` in the harmonics `harmonics`.
    /// The balance has enough samples for all these harmonics.
    ///
    /// # Errors
    /// As [`HarmonicBalance::new`].
    pub fn balance_of(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let settings = self.settings_for(&harmonics);
        let loads = self.loads.clone();
        self.configured(HarmonicBalance::new(
            &self.model,
            elements,
            harmonics,
            loads,
            settings,
        )?)
    }

    /// Returns the settings of the balance, with enough samples for `harmonics`. The set `harmonics` can exceed the
    /// harmonics of the vibration.
    fn settings_for(&self, harmonics: &Harmonics) -> BalanceSettings {
        let mut settings = self.settings;
        if harmonics.highest() > self.harmonics.highest() {
            settings.samples = settings.samples.max(samples_of(harmonics.highest()));
        }
        settings
    }

    /// Adds inertial loads, drive, gauge, journal and threads to a balance.
    fn configured(
        &self,
        balance: HarmonicBalance<ContactElement>,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let balance = balance.with_inertial_loads(&self.inertial_loads)?;
        Ok(HarmonicBalance {
            gauge: self.gauge.clone(),
            journal: self.journal.clone(),
            threads: self.threads.clone(),
            ..balance.with_drive_at(self.response_port)
        })
    }

    /// Returns true if an angular frequency is an end of the range.
    pub fn is_at_end(&self, omega: f64) -> bool {
        let ends = [self.range.0, self.range.1];
        let is_at = |end: &f64| (omega / end - 1.0).abs() <= SAME_FREQUENCY;
        ends.iter().any(is_at)
    }

    /// Returns the angular frequencies of the points of the forced response, or `None` if continuation places the
    /// points.
    pub(super) fn omegas(&self) -> Option<Vec<f64>> {
        let (from, to) = self.range;
        self.points.map(|points| {
            let last = points.saturating_sub(1).max(1) as f64;
            let places = (0..points).map(|k| from + (to - from) * k as f64 / last);
            places.collect()
        })
    }

    /// Creates a balance with other harmonics than `balance`, and at least `times` its samples, to estimate the errors
    /// of `balance`.
    pub(super) fn refined_balance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        harmonics: Harmonics,
        times: usize,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings_for(&harmonics);
        settings.samples = settings.samples.max(times * balance.settings.samples);
        let (model, elements) = (balance.model.clone(), balance.elements.clone());
        let loads = self.loads.clone();
        self.configured(HarmonicBalance::from_closed_model(
            model, elements, harmonics, loads, settings,
        )?)
    }

    /// Computes the governing response: the response at the single frequency of the vibration, or otherwise the phase
    /// resonance. If `start` is `Some`, the solver starts from `start`.
    ///
    /// # Errors
    /// As [`HarmonicBalance::solve`] and [`HarmonicBalance::phase_resonance`].
    pub(super) fn governing_response(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Response, DynamicsError> {
        match self.at_omega {
            Some(omega) => balance
                .solve(omega, start)
                .or_else(|error| self.solve_by_homotopy(balance, omega).ok_or(error)),
            None => balance.phase_resonance(self.range, start),
        }
    }

    /// Creates the resonance of a governing response without a search for the peak.
    pub(super) fn without_peak(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: Response,
    ) -> Result<Resonance, DynamicsError> {
        let iterations = response.iterations;
        let phase = self.at_omega.is_none().then(|| response.clone());
        self.resonance_of(balance, phase, response, iterations)
    }

    /// Computes the phase resonance and the peak next to the phase resonance. If `start` is `Some`, the solver starts
    /// from `start`. If the vibration has a single frequency, the function computes only the response at this
    /// frequency.
    ///
    /// # Errors
    /// As [`HarmonicBalance::phase_resonance`], [`HarmonicBalance::peak`] and [`HarmonicBalance::solve`].
    pub fn resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Resonance, DynamicsError> {
        let response = self.governing_response(balance, start)?;
        match self.at_omega {
            Some(_) => self.without_peak(balance, response),
            None => self.with_nearby_peak(balance, response),
        }
    }

    /// Computes the peak next to a phase resonance, and returns the peak and the phase resonance.
    pub(super) fn with_nearby_peak(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Response,
    ) -> Result<Resonance, DynamicsError> {
        let peak = self.peak_beside(balance, &phase)?;
        let iterations = phase.iterations + peak.iterations;
        self.resonance_of(balance, Some(phase), peak, iterations)
    }

    /// Computes the peak next to a phase resonance. If the amplitude rises to an end of the range, returns the larger
    /// end.
    fn peak_beside(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: &Response,
    ) -> Result<Response, DynamicsError> {
        let port = self.response_port;
        let mut largest = match balance.peak_near(port, self.range, phase.clone()) {
            Ok(peak) => peak,
            // The amplitude rises to an end of the range, or the peak was not found: the largest response counts.
            Err(_) => {
                let ends = [self.range.0, self.range.1];
                let ends = ends.map(|end| balance.solve(end, Some(&phase.start())));
                let mut largest = phase.clone();
                for end in ends.into_iter().flatten() {
                    if balance.amplitude(&end, port)?.0 > balance.amplitude(&largest, port)?.0 {
                        largest = end;
                    }
                }
                largest
            }
        };
        if balance.amplitude(phase, port)?.0 > balance.amplitude(&largest, port)?.0 {
            largest = phase.clone();
        }
        Ok(largest)
    }

    /// Computes only the resonance near the starts `phase` and `peak`, whatever else the range contains.
    ///
    /// # Errors
    /// As [`HarmonicBalance::phase_resonance_near`] and [`HarmonicBalance::peak`].
    pub fn resonance_near(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Option<&Start>,
        peak: &Start,
    ) -> Result<Resonance, DynamicsError> {
        if let Some(omega) = self.at_omega {
            return self.without_peak(balance, balance.solve_near(omega, peak)?);
        }
        let solve_near = |phase: &Start| balance.phase_resonance_near(self.range, phase);
        let phase = phase.map(solve_near).transpose()?;
        let peak = match balance.peak(self.response_port, self.range, peak) {
            // A peak at an end of the range stays there.
            Err(DynamicsError::NoResonance { .. }) if self.is_at_end(peak.omega) => {
                balance.solve(peak.omega, Some(peak))?
            }
            peak => peak?,
        };
        let iterations = phase.as_ref().map_or(0, |phase| phase.iterations) + peak.iterations;
        self.resonance_of(balance, phase, peak, iterations)
    }

    pub(super) fn resonance_of(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Option<Response>,
        peak: Response,
        iterations: usize,
    ) -> Result<Resonance, DynamicsError> {
        let size = |response: &Response| balance.amplitude(response, self.response_port);
        let amplitude = size(phase.as_ref().unwrap_or(&peak))?.0;
        // Phase resonance and peak come from separate searches.
        let peak = match &phase {
            Some(phase) if amplitude > size(&peak)?.0 => phase.clone(),
            _ => peak,
        };
        Ok(Resonance {
            port: self.response_port,
            amplitude,
            peak_frequency: peak.frequency(),
            peak_amplitude: size(&peak)?.0,
            peak_kind: match (self.at_omega, self.is_at_end(peak.omega)) {
                (Some(_), _) => ResonanceKind::Forced,
                (None, true) => ResonanceKind::End,
                (None, false) => ResonanceKind::Peak,
            },
            is_peak_near_phase_resonance: phase.is_some() && !self.is_at_end(peak.omega),
            branch: None,
            iterations,
            phase,
            is_still: balance.is_still(&peak, self.response_port),
            peak,
        })
    }
}

// Homotopy from an easier vibration to the requested vibration. The solver removes the additional damping and preload
// step by step.
//
// Without a preload, the problem is homogeneous in the load. The problem is then as hard at the smallest load as at the
// full load, so raising the load in steps does not help.

/// Additional damping ratio of the easiest vibration, proportional to mass.
const DAMPING: f64 = 0.5;
/// Additional preload of the easiest vibration, divided by the largest force.
const PRELOAD: f64 = 4.0;
/// First step, as a share of the additional damping and preload.
const FIRST: f64 = 0.25;
/// Smallest step.
const LEAST: f64 = 1.0 / 256.0;

impl Vibration {
    /// Computes the response at `omega` by way of easier vibrations, or returns `None` if the easier vibrations do not
    /// lead to a response at `omega`.
    pub(super) fn solve_by_homotopy(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
    ) -> Option<Response> {
        let mut last = self.eased(balance, omega, 1.0)?.solve(omega, None).ok()?;
        let (mut share, mut step) = (1.0, FIRST);
        while share > 0.0 {
            let next = (share - step).max(0.0);
            let result = match next {
                0.0 => balance.solve_near(omega, &last.start()),
                _ => self
                    .eased(balance, omega, next)?
                    .solve_near(omega, &last.start()),
            };
            match result {
                Ok(response) => {
                    (last, share) = (response, next);
                    step *= 1.5;
                }
                Err(_) => {
                    step *= 0.5;
                    if step < LEAST {
                        return None;
                    }
                }
            }
        }
        Some(last)
    }

    /// Creates the balance with a share of the additional damping and preload.
    fn eased(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        share: f64,
    ) -> Option<HarmonicBalance<ContactElement>> {
        let mut easier = self.clone();
        let rate = 2.0 * DAMPING * share * omega;
        for (c, m) in easier
            .model
            .damping
            .values_mut()
            .iter_mut()
            .zip(self.model.mass.values())
        {
            *c += rate * m;
        }
        let loads = balance.loads_at(omega, 1.0);
        let force = loads.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let mut elements = balance.elements().to_vec();
        let count = elements.iter().map(|e| e.sliders.len()).sum::<usize>() as f64;
        for slider in elements.iter_mut().flat_map(|e| &mut e.sliders) {
            // An open slider has no preload.
            if slider.gap == 0.0 {
                slider.normal_load += share * PRELOAD * force / count;
            }
        }
        easier
            .balance_of(elements, balance.harmonics().clone())
            .ok()
    }
}

impl Vibration {
    /// Returns an upper bound of the amplitude of the first harmonic at the response port \[m\]. The bound applies at
    /// the single frequency of the vibration, or over the frequency range.
    ///
    /// No motion with the period of the drive exceeds the bound. Returns `None` if a load or the response is along an
    /// undamped direction. The function also returns `None` if the model has a residual or hysteretic damping.
    pub(super) fn peak_bound(&self) -> Option<f64> {
        let damping = DampingRates::of(&self.model)?;
        let port = damping.scaled(self.response_port)?;
        let shares = self.model.exchanges_energy_with_port(self.response_port);
        let velocity_bound = |loads: &[Load], power: i32| -> Option<f64> {
            Some(velocity_bound(
                &port,
                &damping.forces(loads, power, &shares)?,
            ))
        };
        let (low, high) = self.at_omega.map_or(self.range, |omega| (omega, omega));
        // The bound is the sum of two bounds: one for the loads of constant amplitude, one for the inertial loads.
        // Inertial loads grow with the square of frequency.
        Some(
            velocity_bound(&self.loads, 0)? / low + velocity_bound(&self.inertial_loads, 2)? * high,
        )
    }
}
