//! A driven structure whose contact elements change: what the response to them is made from, and its figures.

use super::contact_element::ContactElement;
use super::peak_bound::{DampingRates, velocity};
use super::{
    DynamicsError, HarmonicBalance, Harmonics, Load, Response, SecondOrder, Settings, Start,
};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::threads::Threads;

/// A structure, how it is driven and what of its response is wanted: all but the contact elements, which change as they wear.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// The damped structure with its ports.
    pub model: SecondOrder,
    /// The loads; the first of harmonic 1 on the response port is the drive, or the first where none is there.
    pub loads: Vec<Load>,
    /// Loads that grow with the square of frequency, as [`HarmonicBalance::with_inertial_loads`] has them.
    pub inertial_loads: Vec<Load>,
    /// The port whose first harmonic is the response.
    pub response_port: usize,
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Accuracy and effort.
    pub settings: Settings,
    /// Angular frequency of the response that moves the joint \[rad/s\]; `None` for that of the phase resonance.
    pub at_omega: Option<f64>,
    /// Angular frequencies between which the resonance lies, and those of the forced response \[rad/s\].
    pub range: (f64, f64),
    /// Equidistant points of the forced response over it; none: as continuation places them.
    pub points: Option<usize>,
    /// Where its iterations and points are counted for who watches.
    pub gauge: Gauge,
    /// What an earlier start has solved, and a place for what this one solves.
    pub journal: Journal,
    /// The threads that share its work.
    pub threads: Threads,
}

/// Which response a peak, or the one that moves the joint, is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ResonanceKind {
    /// A displacement 90° behind the drive.
    PhaseResonance,
    /// A largest first harmonic at the response port.
    Peak,
    /// A first harmonic that is largest at an end of the range or of a branch.
    End,
    /// The response at the given frequency, [`Vibration::at_omega`].
    Forced,
}

impl ResonanceKind {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            ResonanceKind::PhaseResonance => "phase_resonance",
            ResonanceKind::Peak => "peak",
            ResonanceKind::End => "end",
            ResonanceKind::Forced => "forced",
        }
    }
}

/// The resonance of a structure with its contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    /// The response whose displacement at the drive lags it by 90°. `None` where the range has no such response, and at a given frequency.
    pub phase: Option<Response>,
    /// The response port.
    pub port: usize,
    /// Half range of the first harmonic at the response port there, at the peak without it \[m\].
    pub amplitude: f64,
    /// Frequency of the largest first harmonic at the response port that was found \[Hz\].
    pub peak_frequency: f64,
    /// That harmonic \[m\].
    pub peak_amplitude: f64,
    /// The response there; that at the given frequency, if there is one.
    pub peak: Response,
    /// Whether it is a peak, an end of the range or of a branch, or the response at the given frequency.
    pub peak_kind: ResonanceKind,
    /// Whether the peak is the one beside the phase resonance.
    pub is_beside: bool,
    /// Number of its branch of the forced response; none of a peak that was found apart from that.
    pub branch: Option<usize>,
    /// Newton iterations of both.
    pub iterations: usize,
    /// Whether nothing moves at the response port, but for rounding.
    pub is_still: bool,
}

impl Resonance {
    /// The response that moves the joint: that of the phase resonance, or the peak where there is none.
    pub fn in_force(&self) -> &Response {
        self.phase.as_ref().unwrap_or(&self.peak)
    }
}

/// Samples per period of the highest harmonic. The error of a force that slips, opens or touches a stop falls with their square.
const SAMPLES_PER_PERIOD: usize = 10;

/// Samples of a cycle that resolve harmonics up to the highest.
pub fn samples_of(highest: u32) -> usize {
    SAMPLES_PER_PERIOD * highest as usize
}

/// Relative difference of two frequencies that is rounding.
const SAME_FREQUENCY: f64 = 1e-9;

impl Vibration {
    /// The structure with these contact elements.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn balance(
        &self,
        elements: Vec<ContactElement>,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        self.balance_of(elements, self.harmonics.clone())
    }

    /// The structure with these contact elements in other harmonics, with the samples that more of them need.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn balance_of(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let settings = self.settings_for(&harmonics);
        let loads = self.loads.clone();
        self.driven(HarmonicBalance::new(
            &self.model,
            elements,
            harmonics,
            loads,
            settings,
        )?)
    }

    /// The settings with the samples that harmonics need which go beyond those of the vibration.
    fn settings_for(&self, harmonics: &Harmonics) -> Settings {
        let mut settings = self.settings;
        if harmonics.highest() > self.harmonics.highest() {
            settings.samples = settings.samples.max(samples_of(harmonics.highest()));
        }
        settings
    }

    /// A balance with all loads and who watches.
    fn driven(
        &self,
        balance: HarmonicBalance<ContactElement>,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let balance = balance.with_inertial_loads(&self.inertial_loads)?;
        Ok(HarmonicBalance {
            gauge: self.gauge.clone(),
            journal: self.journal.clone(),
            threads: self.threads.clone(),
            ..balance.driven_at(self.response_port)
        })
    }

    /// Whether an angular frequency is an end of the range.
    pub fn is_at_end(&self, omega: f64) -> bool {
        let ends = [self.range.0, self.range.1];
        let is_at = |end: &f64| (omega / end - 1.0).abs() <= SAME_FREQUENCY;
        ends.iter().any(is_at)
    }

    /// The angular frequencies of the forced response; none where continuation places them.
    pub(super) fn omegas(&self) -> Option<Vec<f64>> {
        let (from, to) = self.range;
        self.points.map(|points| {
            let last = points.saturating_sub(1).max(1) as f64;
            let places = (0..points).map(|k| from + (to - from) * k as f64 / last);
            places.collect()
        })
    }

    /// A balance with more harmonics than another, or with so many `times` its samples, to tell the errors of that.
    pub(super) fn finer(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        harmonics: Harmonics,
        times: usize,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings_for(&harmonics);
        settings.samples = settings.samples.max(times * balance.settings.samples);
        let (model, elements) = (balance.model.clone(), balance.elements.clone());
        let loads = self.loads.clone();
        self.driven(HarmonicBalance::of_closed(
            model, elements, harmonics, loads, settings,
        )?)
    }

    /// The response in force, from `start` if there is one: that at the given frequency, or else that of the phase resonance.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::solve`] and [`HarmonicBalance::phase_resonance`].
    pub(super) fn response_in_force(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Response, DynamicsError> {
        match self.at_omega {
            Some(omega) => balance
                .solve(omega, start)
                .or_else(|error| self.by_easing(balance, omega).ok_or(error)),
            None => balance.phase_resonance(self.range, start),
        }
    }

    /// A response in force as it is before a peak was looked for.
    pub(super) fn without_peak(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: Response,
    ) -> Result<Resonance, DynamicsError> {
        let iterations = response.iterations;
        let phase = self.at_omega.is_none().then(|| response.clone());
        self.resonance_of(balance, phase, response, iterations)
    }

    /// Phase resonance, from `start` if there is one, and the peak beside it; the response at the given frequency, if there is one.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance`], [`HarmonicBalance::peak`] and [`HarmonicBalance::solve`].
    pub fn resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Resonance, DynamicsError> {
        let response = self.response_in_force(balance, start)?;
        match self.at_omega {
            Some(_) => self.without_peak(balance, response),
            None => self.beside(balance, response),
        }
    }

    /// A phase resonance and the peak beside it.
    pub(super) fn beside(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Response,
    ) -> Result<Resonance, DynamicsError> {
        let peak = self.peak_beside(balance, &phase)?;
        let iterations = phase.iterations + peak.iterations;
        self.resonance_of(balance, Some(phase), peak, iterations)
    }

    /// The peak beside a phase resonance; where the amplitude rises to an end of the range, the larger end.
    fn peak_beside(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: &Response,
    ) -> Result<Response, DynamicsError> {
        let port = self.response_port;
        let mut largest = match balance.peak_from(port, self.range, phase.clone()) {
            Ok(peak) => peak,
            // It rises to an end of the range, or was not found: of these the largest.
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

    /// The resonance near `start` alone, whatever else the range has.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance_near`] and [`HarmonicBalance::peak`].
    pub fn resonance_near(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Option<&Start>,
        peak: &Start,
    ) -> Result<Resonance, DynamicsError> {
        if let Some(omega) = self.at_omega {
            return self.without_peak(balance, balance.solve_near(omega, peak)?);
        }
        let near = |phase: &Start| balance.phase_resonance_near(self.range, phase);
        let phase = phase.map(near).transpose()?;
        let peak = match balance.peak(self.response_port, self.range, peak) {
            // That of an end of the range stays there.
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
        // Each was looked for by itself.
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
            is_beside: phase.is_some() && !self.is_at_end(peak.omega),
            branch: None,
            iterations,
            phase,
            is_still: balance.is_still(&peak, self.response_port),
            peak,
        })
    }
}

// The way from a vibration that is easily found to the one that is asked for: more damping and more preload, taken away step by step.
//
// Raising the load alone leads nowhere without a preload: the problem is then homogeneous in the load, and as hard at the smallest.

/// Damping ratio that the easiest vibration has more, in its mass.
const DAMPING: f64 = 0.5;
/// Preload that it has more, over the largest force.
const PRELOAD: f64 = 4.0;
/// First and least part of the way that a step takes.
const FIRST: f64 = 0.25;
const LEAST: f64 = 1.0 / 256.0;

impl Vibration {
    /// The response at `omega` by way of easier ones; none where that does not lead there.
    pub(super) fn by_easing(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
    ) -> Option<Response> {
        let mut last = self.eased(balance, omega, 1.0)?.solve(omega, None).ok()?;
        let (mut left, mut step) = (1.0, FIRST);
        while left > 0.0 {
            let next = (left - step).max(0.0);
            let there = match next {
                0.0 => balance.solve_near(omega, &last.start()),
                _ => self
                    .eased(balance, omega, next)?
                    .solve_near(omega, &last.start()),
            };
            match there {
                Ok(response) => {
                    (last, left) = (response, next);
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

    /// The vibration with a share of all that eases it.
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
            // An open slider has none.
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
    /// Bound on the amplitude of the first harmonic at the response port \[m\], at the given frequency or over the range. No motion with the period of
    /// the drive exceeds it. `None` where a load or the response is along what is not damped, and for a model with a residual or hysteretic damping.
    pub(super) fn peak_bound(&self) -> Option<f64> {
        let damping = DampingRates::of(&self.model)?;
        let port = damping.scaled(self.response_port)?;
        let shares = self.model.sharing(self.response_port);
        let of = |loads: &[Load], power: i32| -> Option<f64> {
            Some(velocity(&port, &damping.forces(loads, power, &shares)?))
        };
        let (low, high) = self.at_omega.map_or(self.range, |omega| (omega, omega));
        // What both kinds of loads move is no more than what each moves by itself; the second grows with the square of frequency.
        Some(of(&self.loads, 0)? / low + of(&self.inertial_loads, 2)? * high)
    }
}
