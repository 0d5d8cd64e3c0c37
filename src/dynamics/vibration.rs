//! A driven structure whose contact elements change: what the response to them is made from, and its figures.

use std::f64::consts::TAU;

use super::candidates::{Candidate, CandidateKind};
use super::contact_element::ContactElement;
use super::effort::{BESIDE_BRANCHES, BRANCHES};
use super::reach::Unseen;
use super::survey::Survey;
use super::surveyed::Surveyed;
use super::{
    DynamicsError, HarmonicBalance, Harmonics, Load, Response, SecondOrder, Settings, Start,
};
use crate::gauge::Gauge;
use crate::journal::Journal;

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
    /// Angular frequencies between which the resonance lies \[rad/s\].
    pub range: (f64, f64),
    /// Equidistant points of the forced response over it; none: as continuation places them.
    pub points: Option<usize>,
    /// Where its iterations and points are counted for who watches.
    pub gauge: Gauge,
    /// What an earlier start has solved, and a place for what this one solves.
    pub journal: Journal,
    /// Surveys that were made.
    pub surveyed: Surveyed,
}

/// The resonance of a structure with its contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    /// The response whose displacement at the drive is 90° behind it; none where the range has none.
    pub phase: Option<Response>,
    /// The response port.
    pub port: usize,
    /// Half range of the first harmonic at the response port there, at the peak without it \[m\].
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
    /// Those of them of which motions in time do not tell either how large responses are.
    pub unseen: Vec<Unseen>,
    /// Whether nothing moves at the response port, but for rounding.
    pub is_still: bool,
    /// The largest amplitude of a motion in time that no branch has, or that is the highest on its path \[m\]; 0 without one.
    pub largest_in_time: f64,
    /// Whether the peak is a motion in time that is the highest on its path, which is known whole.
    pub is_top: bool,
    /// Whether branches were given up as they had cost enough.
    pub is_cut: bool,
    /// Amplitude that no motion exceeds of those beside the branches that could not be followed \[m\]: 0 without any, infinite where nothing bounds
    /// it.
    pub unfollowed: f64,
}

impl Resonance {
    /// The response that moves the joint: that of the phase resonance, or the peak where there is none.
    pub fn in_force(&self) -> &Response {
        self.phase.as_ref().unwrap_or(&self.peak)
    }

    /// The candidate that is the peak; none where only the two were looked for.
    pub fn peak_candidate(&self) -> Option<&Candidate> {
        let mut peaks = self.candidates.iter();
        peaks.find(|candidate| candidate.response == self.peak)
    }

    /// One with more harmonics that was found from this one alone: what the range has beside it, and in time, stays as it is known here.
    pub(super) fn extended(&self, more: Resonance) -> Resonance {
        Resonance {
            gaps: self.gaps.clone(),
            unseen: self.unseen.clone(),
            largest_in_time: self.largest_in_time,
            is_cut: self.is_cut,
            unfollowed: self.unfollowed,
            ..more
        }
    }

    /// Whether the peak is that of a motion in time, which the balance does not have.
    pub fn is_in_time(&self) -> bool {
        let candidate = self.peak_candidate();
        candidate.is_some_and(|candidate| candidate.branch.is_none())
    }
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

    /// The structure with these contact elements in other harmonics, with the samples that more of them need.
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
        let loads = self.loads.clone();
        self.driven(HarmonicBalance::new(
            &self.model,
            elements,
            harmonics,
            loads,
            settings,
        )?)
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
            ..balance.driven_at(self.response_port)
        })
    }

    /// The angular frequencies of the forced response; none where continuation places them.
    pub(super) fn omegas(&self) -> Option<Vec<f64>> {
        self.points.map(|points| self.omegas_or(points))
    }

    /// The angular frequencies of the forced response, `usual` of them where continuation would place them.
    pub(super) fn omegas_or(&self, usual: usize) -> Vec<f64> {
        let (from, to) = self.range;
        let points = self.points.unwrap_or(usual);
        let last = points.saturating_sub(1).max(1) as f64;
        let places = (0..points).map(|k| from + (to - from) * k as f64 / last);
        places.collect()
    }

    /// The balance that the errors of another are seen by: in more harmonics, with twice the samples that they would have.
    pub(super) fn finer(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings;
        let enough = 4 * harmonics.highest() as usize + 2;
        settings.samples = 2 * settings.samples.max(enough);
        let (model, elements) = (balance.model.clone(), balance.elements.clone());
        let loads = self.loads.clone();
        self.driven(HarmonicBalance::of_closed(
            model, elements, harmonics, loads, settings,
        )?)
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
            let strongest = self.strongest(balance, start, survey);
            balance.effort.unbound();
            return strongest;
        }
        let phase = balance.phase_resonance(self.range, start)?;
        self.beside(balance, phase)
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
            Err(DynamicsError::NoResonance { .. }) => {
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
            Err(error) => return Err(error),
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
        let near = |phase: &Start| balance.phase_resonance_near(self.range, phase);
        let phase = phase.map(near).transpose()?;
        let peak = match balance.peak(self.response_port, self.range, peak) {
            // That of an end of the range stays there.
            Err(DynamicsError::NoResonance { .. })
                if [self.range.0, self.range.1].contains(&peak.omega) =>
            {
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
            iterations,
            phase,
            candidates: Vec::new(),
            gaps: Vec::new(),
            unseen: Vec::new(),
            is_still: balance.is_still(&peak, self.response_port),
            largest_in_time: 0.0,
            is_top: false,
            is_cut: false,
            unfollowed: 0.0,
            peak,
        })
    }

    /// The strongest of a survey. Where its branches have no phase resonance, one is looked for apart from them.
    fn strongest(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
        mut survey: Survey,
    ) -> Result<Resonance, DynamicsError> {
        balance.effort.allow(BESIDE_BRANCHES);
        let mut candidates = self.candidates(balance, &survey)?;
        let is_phase = |c: &Candidate| c.kind == CandidateKind::PhaseResonance;
        let mut missing = None;
        if !candidates.iter().any(is_phase) {
            balance.effort.allow(match candidates.is_empty() {
                // The only other way.
                true => BRANCHES,
                false => BESIDE_BRANCHES,
            });
            match balance.phase_resonance(self.range, start) {
                Ok(phase) => {
                    let through = self.branch_through(balance, &phase)?;
                    survey.branches.push(through);
                    survey.gaps = survey.left_out(self.range);
                    let gaps = &survey.gaps;
                    let is_left =
                        |[low, high]: &[f64; 2]| gaps.iter().any(|[a, b]| a < high && low < b);
                    survey.unseen.retain(is_left);
                    candidates = self.candidates(balance, &survey)?;
                }
                Err(error) => missing = Some(error),
            }
        }
        // They are sorted.
        let first = |is_wanted: &dyn Fn(&Candidate) -> bool| {
            let wanted = candidates.iter().find(|c| is_wanted(c));
            wanted.map(|candidate| candidate.response.clone())
        };
        let phase = first(&is_phase);
        // A phase resonance stands for a peak that could not be refined to above it.
        let Some(peak) = first(&|_| true) else {
            let error = missing.unwrap_or(DynamicsError::NoResonance {
                what: "peak",
                from: self.range.0 / TAU,
                to: self.range.1 / TAU,
            });
            return Err(survey.stopped.unwrap_or(error));
        };
        let iterations = survey.branches.iter().flatten().map(|r| r.iterations).sum();
        Ok(Resonance {
            candidates,
            largest_in_time: survey.largest_in_time(balance, self.response_port),
            is_top: survey.is_top(peak.omega, balance.amplitude(&peak, self.response_port)?.0),
            is_cut: survey.is_cut,
            unfollowed: survey.unfollowed,
            unseen: self.unseen(balance, &survey.unseen),
            gaps: survey.gaps,
            ..self.resonance_of(balance, phase, peak, iterations)?
        })
    }
}
