//! Peaks and phase resonances on the branches of a survey, and which of them a motion in time keeps.

use super::contact_element::ContactElement;
use super::periodic::{Periodic, UNSTABLE};
use super::survey::{BESIDE, SAME, Survey, first_harmonic, near};
use super::vibration::Vibration;
use super::{DynamicsError, HarmonicBalance, Response};

/// Candidates whose motion in time is looked for, the strongest: more would cost more than the branches.
const JUDGED: usize = 6;
/// Share of the work of the loads and dampers that friction may give and not take: more is no motion, but samples or harmonics that are
/// too few.
const GIVEN: f64 = 0.01;

/// What a candidate is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum CandidateKind {
    /// A displacement 90° behind the drive.
    PhaseResonance,
    /// A largest first harmonic at the response port.
    Peak,
    /// A first harmonic that is largest at an end of the range or of a branch.
    End,
}

impl CandidateKind {
    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            CandidateKind::PhaseResonance => "phase_resonance",
            CandidateKind::Peak => "peak",
            CandidateKind::End => "end",
        }
    }
}

/// A peak or phase resonance of a branch.
#[derive(Debug, Clone, PartialEq)]
pub struct Candidate {
    pub kind: CandidateKind,
    pub response: Response,
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Number of its branch; none where branches were not followed.
    pub branch: Option<usize>,
    /// Largest modulus of the multipliers by which small disturbances grow over a period, from the motion in time near it; none where
    /// that is not known.
    pub multiplier: Option<f64>,
    /// The amplitude of that motion \[m\].
    pub amplitude_in_time: Option<f64>,
}

impl Candidate {
    /// Whether small disturbances of it are known to grow.
    pub fn is_unstable(&self) -> bool {
        self.multiplier
            .is_some_and(|multiplier| multiplier > UNSTABLE)
    }
}

impl Vibration {
    /// All peaks and phase resonances of a survey, the strongest first, each once.
    ///
    /// # Errors
    /// [`DynamicsError::HarmonicMissing`].
    pub fn candidates(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
    ) -> Result<Vec<Candidate>, DynamicsError> {
        let mut found: Vec<Candidate> = Vec::new();
        let port = self.response_port;
        // Where friction would give energy a branch ends: what is highest beside that is an end too.
        let parts = survey
            .branches
            .iter()
            .enumerate()
            .flat_map(|(number, branch)| {
                let parts = branch.split(gives_energy);
                parts.map(move |part| (number, part))
            });
        for (number, branch) in parts.filter(|(_, part)| !part.is_empty()) {
            let ends = [branch.first(), branch.last()].map(|end| end.map_or(0.0, |end| end.omega));
            let mut add = |kind, response: Response| {
                let amplitude = first_harmonic(balance, &response.displacement, port);
                let known = found.iter().any(|known| {
                    let same = |a: f64, b: f64| (a - b).abs() <= SAME * b.abs();
                    known.kind == kind
                        && same(known.response.omega, response.omega)
                        && same(known.amplitude, amplitude)
                });
                if !known {
                    found.push(Candidate {
                        kind,
                        amplitude,
                        response,
                        branch: Some(number),
                        multiplier: None,
                        amplitude_in_time: None,
                    });
                }
            };
            let physical = |response: &Response| !gives_energy(response);
            for response in balance
                .peaks(branch, port, self.range)?
                .into_iter()
                .filter(physical)
            {
                let kind = match ends.contains(&response.omega) {
                    true => CandidateKind::End,
                    false => CandidateKind::Peak,
                };
                add(kind, response);
            }
            if balance.drive().is_some() {
                let found = balance.phase_resonances(branch, self.range)?;
                for response in found.into_iter().filter(physical) {
                    add(CandidateKind::PhaseResonance, response);
                }
            }
        }
        found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        for candidate in found.iter_mut().take(JUDGED) {
            self.judge(balance, candidate);
        }
        let branches = found.first().map_or(0.0, |first| first.amplitude);
        let above = survey
            .motions
            .iter()
            .map(|motion| self.of_time(balance, motion));
        found.extend(above.filter(|candidate| candidate.amplitude > branches));
        found.sort_by(|a, b| b.amplitude.total_cmp(&a.amplitude));
        Ok(found)
    }

    /// A motion in time as a candidate.
    fn of_time(&self, balance: &HarmonicBalance<ContactElement>, periodic: &Periodic) -> Candidate {
        let rows = &periodic.displacement;
        let amplitude = first_harmonic(balance, rows, self.response_port);
        Candidate {
            kind: CandidateKind::Peak,
            response: balance.response_of(periodic),
            amplitude,
            branch: None,
            multiplier: periodic.multiplier,
            amplitude_in_time: Some(amplitude),
        }
    }

    /// Says what the motion in time near a candidate is.
    fn judge(&self, balance: &HarmonicBalance<ContactElement>, candidate: &mut Candidate) {
        let Some(time) = self.in_time(balance) else {
            return;
        };
        let (response, amplitude) = (&candidate.response, candidate.amplitude);
        if let Some(periodic) = near(&time, balance, response, amplitude, BESIDE) {
            let rows = &periodic.displacement;
            candidate.amplitude_in_time = Some(first_harmonic(balance, rows, self.response_port));
            candidate.multiplier = periodic.multiplier;
        }
        balance.effort.add_steps(time.steps());
    }
}

/// Whether friction does work in a response, which it cannot.
pub(super) fn gives_energy(response: &Response) -> bool {
    let energy = response.energy;
    energy.friction < -GIVEN * (energy.input.abs() + energy.viscous)
}

impl HarmonicBalance<ContactElement> {
    /// A motion in time in the form of a response, with the forces of its elements.
    fn response_of(&self, periodic: &Periodic) -> Response {
        let contact = self.elements.len() * self.width();
        let rows = periodic.displacement[..contact].chunks(self.width());
        let mut force = vec![0.0; contact];
        let mut work = self.sampling.workspace();
        let forces = force.chunks_mut(self.width());
        for ((element, row), force) in self.elements.iter().zip(rows).zip(forces) {
            self.sampling.evaluate(element, row, force, None, &mut work);
        }
        Response {
            omega: periodic.omega,
            load_factor: 1.0,
            displacement: periodic.displacement.clone(),
            force,
            active: vec![true; self.elements.len()],
            iterations: 0,
            correction: periodic.change,
            closure: periodic.change,
            energy: periodic.energy,
        }
    }
}
