//! A driven structure whose contact elements change: what the response to them is made from, and its figures.

use super::contact_element::ContactElement;
use super::survey::{Candidate, CandidateKind, Survey};
use super::{
    DynamicsError, HarmonicBalance, Harmonics, Load, Response, SecondOrder, Settings, Start,
};
use crate::gauge::Gauge;

/// A structure, how it is driven and what of its response is wanted: all but the contact elements, which change as they wear.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// The damped structure with its ports.
    pub model: SecondOrder,
    /// The loads; the first of harmonic 1 is the drive.
    pub loads: Vec<Load>,
    /// Loads that grow with the square of frequency, as [`HarmonicBalance::with_inertial_loads`] has them.
    pub inertial_loads: Vec<Load>,
    /// The port whose first harmonic is the response.
    pub response_port: usize,
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Accuracy and effort.
    pub settings: Settings,
    /// Angular frequencies between which the resonance lies \[rad/s\].
    pub range: (f64, f64),
    /// Equidistant points of the forced response over it; none: as continuation places them.
    pub points: Option<usize>,
    /// Where its iterations and points are counted for who watches.
    pub gauge: Gauge,
}

/// The resonance of a structure with its contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    /// The response whose displacement at the drive is 90° behind it.
    pub phase: Response,
    /// The response port.
    pub port: usize,
    /// Half range of the first harmonic at the response port there \[m\].
    pub amplitude: f64,
    /// Frequency of the largest first harmonic at the response port (see [`Vibration::resonance`]) \[Hz\].
    pub peak_frequency: f64,
    /// That harmonic \[m\].
    pub peak_amplitude: f64,
    /// The response there.
    pub peak: Response,
    /// Newton iterations of both; of a model of few unknowns, those of all its branches.
    pub iterations: usize,
    /// All peaks and phase resonances that were found, the strongest first; none where only these two were looked for.
    pub candidates: Vec<Candidate>,
    /// Frequencies that no branch covers, from and to \[Hz\]; none where branches were not followed.
    pub gaps: Vec<[f64; 2]>,
    /// The largest amplitude of a motion in time that no branch has \[m\]; 0 without one.
    pub largest_in_time: f64,
}

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

    /// The same in other harmonics, with the samples that more of them need.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn balance_of(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings;
        if harmonics.highest() > self.harmonics.highest() {
            settings.samples = settings.samples.max(4 * harmonics.highest() as usize + 2);
        }
        self.joined(elements, harmonics, settings)
    }

    fn joined(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
        settings: Settings,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let loads = self.loads.clone();
        let balance = HarmonicBalance::new(&self.model, elements, harmonics, loads, settings)?
            .with_inertial_loads(&self.inertial_loads)?;
        Ok(HarmonicBalance {
            gauge: self.gauge.clone(),
            ..balance
        })
    }

    /// The angular frequencies of the forced response; none where continuation places them.
    pub(super) fn omegas(&self) -> Option<Vec<f64>> {
        let (from, to) = self.range;
        let points = self.points?;
        let last = points.saturating_sub(1).max(1) as f64;
        let places = (0..points).map(|k| from + (to - from) * k as f64 / last);
        Some(places.collect())
    }

    /// The balance that the errors of another are seen by: in more harmonics, with twice the samples that they would have.
    pub(super) fn finer(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings;
        let enough = 4 * harmonics.highest() as usize + 2;
        settings.samples = 2 * settings.samples.max(enough);
        self.joined(elements, harmonics, settings)
    }

    /// Phase resonance and peak, from `start` if there is one. Of a model of few unknowns, whose branches cost little, the strongest of
    /// all in the range; of another the peak is that of the phase resonance.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance`] and [`HarmonicBalance::peak`].
    pub fn resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Resonance, DynamicsError> {
        if balance.is_small() {
            let survey = self.survey(balance)?;
            let candidates = self.candidates(balance, &survey)?;
            return self.strongest(balance, start, survey, candidates);
        }
        let phase = balance.phase_resonance(self.range, start)?;
        let peak = balance.peak(self.response_port, self.range, &phase.start())?;
        let iterations = phase.iterations + peak.iterations;
        self.resonance_of(balance, phase, peak, iterations)
    }

    /// The resonance near `start` alone, whatever else the range has.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance_near`] and [`HarmonicBalance::peak`].
    pub fn resonance_near(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: &Start,
        peak: &Start,
    ) -> Result<Resonance, DynamicsError> {
        let phase = balance.phase_resonance_near(self.range, phase)?;
        let peak = balance.peak(self.response_port, self.range, peak)?;
        let iterations = phase.iterations + peak.iterations;
        self.resonance_of(balance, phase, peak, iterations)
    }

    pub(super) fn resonance_of(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        phase: Response,
        peak: Response,
        iterations: usize,
    ) -> Result<Resonance, DynamicsError> {
        Ok(Resonance {
            port: self.response_port,
            amplitude: balance.amplitude(&phase, self.response_port)?.0,
            peak_frequency: peak.frequency(),
            peak_amplitude: balance.amplitude(&peak, self.response_port)?.0,
            iterations,
            phase,
            peak,
            candidates: Vec::new(),
            gaps: Vec::new(),
            largest_in_time: 0.0,
        })
    }

    /// The strongest of the candidates of a survey.
    fn strongest(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
        survey: Survey,
        candidates: Vec<Candidate>,
    ) -> Result<Resonance, DynamicsError> {
        // They are sorted.
        let first = |is_wanted: fn(CandidateKind) -> bool| {
            let mut wanted = candidates.iter().filter(|c| is_wanted(c.kind));
            wanted.next().map(|candidate| candidate.response.clone())
        };
        let phase = match first(|kind| kind == CandidateKind::PhaseResonance) {
            Some(phase) => phase,
            None => balance.phase_resonance(self.range, start)?,
        };
        let peak = match first(|kind| kind != CandidateKind::PhaseResonance) {
            Some(peak) => peak,
            None => balance.peak(self.response_port, self.range, &phase.start())?,
        };
        let iterations = survey.branches.iter().flatten().map(|r| r.iterations).sum();
        Ok(Resonance {
            candidates,
            largest_in_time: survey.largest_in_time(balance, self.response_port),
            gaps: survey.gaps,
            ..self.resonance_of(balance, phase, peak, iterations)?
        })
    }
}
