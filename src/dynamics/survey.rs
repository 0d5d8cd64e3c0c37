//! All responses of a small model over a range: its branches, what of the range they leave out, and motions in time beside them. The
//! peaks and phase resonances on them are found in `candidates.rs`, motions in time in
//! `survey_in_time.rs`.

use std::f64::consts::TAU;

use super::candidates::gives_energy;
use super::contact_element::ContactElement;
use super::effort::{BESIDE_BRANCHES, BRANCHES, FINER_SURVEY, SURVEY};
use super::forced_response::FoundBy;
use super::periodic::{Periodic, Settled};
use super::time_integration::{Motion, TimeModel};
use super::vibration::Vibration;
use super::{ContinuationSettings, DynamicsError, HarmonicBalance, Response, Start};

/// Frequencies at which a motion in time is looked for beside the branches, apart from those in gaps.
pub(super) const PROBES: usize = 8;
/// Integration steps for a motion in time where no branch is, and beside one: some seventh of a second, and a quarter of it. All multipliers of a forced response
/// have the first.
pub(super) const EFFORT: usize = 120_000;
pub(super) const BESIDE: usize = 30_000;
/// An amplitude below this share of the largest displacement is what Newton's method and rounding leave: nothing moves there.
const STILL: f64 = 1e-9;
/// Frequencies in each gap.
pub(super) const IN_GAPS: usize = 5;
/// Amplitudes that differ by more than this share are those of different responses.
pub(super) const OTHER: f64 = 0.02;
/// Motions in time whose frequencies differ by less are beside one peak.
const BESIDE_TOP: f64 = 1e-3;
/// Two responses whose frequency and amplitude differ by less are one.
pub(super) const SAME: f64 = 1e-6;
/// Share by which amplitudes of the balance and of the motion in time that it began from differ where they are one response: of few
/// harmonics.
const SAME_RESPONSE: f64 = 0.1;
/// Size that a motion is first thought to have \[m\].
pub(super) const USUAL: f64 = 1e-6;
/// Relative difference of frequencies that is rounding.
const ROUNDING: f64 = 1e-12;
/// Most points of a branch.
const MOST_POINTS: usize = 1500;

/// The responses over a range.
#[derive(Debug, Clone, PartialEq)]
pub struct Survey {
    /// Branches, each in the order of the range; where they turn back in frequency, so do they.
    pub branches: Vec<Vec<Response>>,
    /// Frequencies that no branch covers, from and to \[Hz\].
    pub gaps: Vec<[f64; 2]>,
    /// Those of them of which motions in time do not tell either how large responses are.
    pub unseen: Vec<[f64; 2]>,
    /// Why the first branch could not be followed.
    pub stopped: Option<DynamicsError>,
    /// Motions in time that no branch has.
    pub motions: Vec<Periodic>,
    /// Angular frequencies and amplitudes of motions in time that are the highest in the range on their path, which is known whole.
    pub tops: Vec<[f64; 2]>,
    /// Angular frequencies within gaps at which nothing was found, and how that ended.
    pub missed: Vec<(f64, FoundBy)>,
    /// Whether the search was given up as it had cost enough.
    pub is_cut: bool,
    /// Amplitude at the response port that no motion exceeds of those beside the branches that could not be followed \[m\]: 0 without any, infinite where nothing
    /// bounds it.
    pub unfollowed: f64,
}

impl Survey {
    /// Of branches alone, of which nothing else is known yet.
    pub(super) fn of(branches: Vec<Vec<Response>>) -> Survey {
        Survey {
            branches,
            gaps: Vec::new(),
            unseen: Vec::new(),
            stopped: None,
            motions: Vec::new(),
            tops: Vec::new(),
            missed: Vec::new(),
            is_cut: false,
            unfollowed: 0.0,
        }
    }

    /// Says that there are motions that could not be followed, up to an amplitude \[m\].
    pub(super) fn leave(&mut self, reach: f64) {
        self.unfollowed = self.unfollowed.max(reach);
    }
}

/// What a probe finds.
enum Probed {
    /// With the motion in time that led to it, where they differ.
    Response(Box<Response>, Option<Periodic>),
    Motion(Periodic),
    /// What a branch has.
    Known,
    Missed(FoundBy),
}

impl Vibration {
    /// The model in time; none of a structure whose contact follows forces without delay.
    pub(super) fn in_time<'a>(
        &'a self,
        balance: &'a HarmonicBalance<ContactElement>,
    ) -> Option<TimeModel<'a>> {
        self.time_model(balance).ok()
    }

    /// The model in time, or why there is none.
    pub(super) fn time_model<'a>(
        &'a self,
        balance: &'a HarmonicBalance<ContactElement>,
    ) -> Result<TimeModel<'a>, DynamicsError> {
        let time = TimeModel::new(&self.model, balance.elements(), &self.loads)?;
        Ok(time.with_inertial_loads(&self.inertial_loads))
    }

    /// The branches of a small model over the range: from both ends, and through motions in time that no branch leads to. A balance
    /// that was surveyed before is not surveyed again.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::parts`].
    pub fn survey(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<Survey, DynamicsError> {
        if let Some(kept) = self.kept_survey(balance) {
            return Ok(kept);
        }
        let before = balance.effort.spent();
        let is_finer = balance.harmonics().highest() > self.harmonics.highest();
        balance
            .effort
            .limit(if is_finer { FINER_SURVEY } else { SURVEY });
        let survey = self.survey_anew(balance);
        balance.effort.unbound();
        let survey = survey?;
        let spent = balance.effort.spent() - before;
        self.keep_survey(balance, &survey, spent);
        Ok(survey)
    }

    fn survey_anew(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<Survey, DynamicsError> {
        let settings = self.along();
        balance.effort.allow(BRANCHES);
        let (branches, stopped) = balance.parts(settings)?;
        let mut survey = Survey {
            stopped,
            is_cut: balance.effort.is_spent(),
            ..Survey::of(branches)
        };
        // One that returns over an end of the range ends there.
        for branch in &mut survey.branches {
            branch.retain(|response| self.is_inside(response));
        }
        survey.branches.retain(|branch| !branch.is_empty());
        if survey.is_still(balance, self.response_port) {
            balance.effort.unbound();
            survey.gaps = survey.left_out(self.range);
            return Ok(survey);
        }
        // Without a branch all hangs on what is found here.
        balance.effort.allow(match survey.branches.is_empty() {
            true => BRANCHES,
            false => BESIDE_BRANCHES,
        });
        for omega in self.probes(balance, &survey) {
            if balance.effort.is_spent() {
                survey.is_cut = true;
                break;
            }
            match self.probe(balance, &survey, omega) {
                Probed::Response(response, motion) => {
                    survey
                        .branches
                        .push(self.branch_through(balance, &response)?);
                    survey.motions.extend(motion);
                }
                Probed::Motion(periodic) => survey.motions.push(periodic),
                Probed::Missed(how) => survey.missed.push((omega, how)),
                Probed::Known => {}
            }
        }
        self.look_for_bouncing(balance, &mut survey)?;
        balance.effort.allow(BESIDE_BRANCHES);
        // No point of the forced response is above all branches.
        for response in balance
            .sweep(&self.omegas().unwrap_or_default())
            .into_iter()
            .flatten()
        {
            let rows = &response.displacement;
            let above = first_harmonic(balance, rows, self.response_port);
            if !gives_energy(&response) && above > survey.largest(balance, self.response_port) {
                survey
                    .branches
                    .push(self.branch_through(balance, &response)?);
            }
        }
        survey.is_cut |= balance.effort.is_spent();
        balance.effort.unbound();
        survey.gaps = survey.left_out(self.range);
        self.look_into_gaps(balance, &mut survey);
        // Of a gap that nothing is known of, a row says so: at an end of the range that it reaches to, where no branch begins, or in its middle.
        for [low, high] in survey.unseen.clone() {
            let ends = [self.range.0, self.range.1];
            let end = ends
                .into_iter()
                .find(|end| [low, high].contains(&(end / TAU)));
            let middle = TAU * 0.5 * (low + high);
            survey
                .missed
                .push((end.unwrap_or(middle), FoundBy::Nothing));
        }
        if let Some((top, is_reached)) = self.top_in_time(balance, &survey) {
            // What it was climbed from is no peak of its own.
            let is_apart = |motion: &Periodic| (motion.omega / top.omega - 1.0).abs() > BESIDE_TOP;
            survey.motions.retain(is_apart);
            survey.motions.push(top);
            if !is_reached {
                survey.leave(self.reach_within(balance, self.range));
            }
        }
        survey.missed.retain(|(omega, _)| {
            let mut gaps = survey.gaps.iter();
            gaps.any(|[low, high]| (*low..=*high).contains(&(omega / TAU)))
        });
        Ok(survey)
    }

    /// Whether a response lies in the range, but for rounding.
    fn is_inside(&self, response: &Response) -> bool {
        let (from, to) = self.range;
        (from * (1.0 - ROUNDING)..=to * (1.0 + ROUNDING)).contains(&response.omega)
    }

    /// The branch through a response, as far as it lies in the range.
    pub(super) fn branch_through(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: &Response,
    ) -> Result<Vec<Response>, DynamicsError> {
        let mut branch = balance.through(response, self.along())?;
        branch.retain(|response| self.is_inside(response));
        Ok(branch)
    }

    /// How branches are followed over the range.
    pub(super) fn along(&self) -> ContinuationSettings {
        let (from, to) = self.range;
        ContinuationSettings {
            most_points: MOST_POINTS,
            ..ContinuationSettings::over(from, to, self.response_port)
        }
    }

    /// Angular frequencies to look at: within gaps, at natural frequencies and over the range.
    pub(super) fn probes(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
    ) -> Vec<f64> {
        let (from, to) = self.range;
        let gaps = survey.left_out((from, to));
        let within = gaps.iter().flat_map(|[a, b]| {
            (0..IN_GAPS).map(move |k| TAU * (a + (b - a) * (k as f64 + 0.5) / IN_GAPS as f64))
        });
        let over = over((from, to), PROBES);
        let own = self.own_frequencies(balance);
        let own = own.into_iter().filter(|omega| (from..=to).contains(omega));
        within.chain(own).chain(over).collect()
    }

    /// What is there at `omega` that no branch of the survey has: of the balance from the linear response, or where the motion from rest
    /// settles.
    fn probe(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
        omega: f64,
    ) -> Probed {
        let amplitude = |rows: &[f64]| first_harmonic(balance, rows, self.response_port);
        let known = survey.amplitudes(balance, self.response_port, omega);
        let is_new = |rows: &[f64]| {
            let found = amplitude(rows);
            known
                .iter()
                .all(|known| (found / known - 1.0).abs() > OTHER)
        };
        if known.is_empty() {
            let found = balance.solve(omega, None).ok();
            let found = found.or_else(|| self.by_easing(balance, omega));
            if let Some(response) = found {
                return Probed::Response(Box::new(response), None);
            }
        }
        let missed = |how| match known.is_empty() {
            true => Probed::Missed(how),
            false => Probed::Known,
        };
        let Some(time) = self.in_time(balance) else {
            return missed(FoundBy::Nothing);
        };
        let guess = survey.largest(balance, self.response_port);
        let effort = if known.is_empty() { EFFORT } else { BESIDE };
        let settled = time.settle(omega, &time.rest(), guess, balance.harmonics(), effort);
        balance.effort.add_steps(time.steps());
        let periodic = match settled {
            Ok(Settled::Periodic(periodic)) => periodic,
            Ok(Settled::Turns(turns)) => return missed(FoundBy::NotPeriodic(turns)),
            Ok(Settled::Unsettled(_)) => return missed(FoundBy::NotSettled),
            Err(_) => return missed(FoundBy::Nothing),
        };
        if !is_new(&periodic.displacement) {
            return Probed::Known;
        }
        let size = amplitude(&periodic.displacement);
        match balance.solve(omega, Some(&start_of(&periodic))) {
            Ok(response) if is_new(&response.displacement) => {
                let differs = !is_near(amplitude(&response.displacement), size);
                Probed::Response(Box::new(response), differs.then_some(periodic))
            }
            // With few harmonics the balance may have no such response.
            _ => Probed::Motion(periodic),
        }
    }
}

/// Frequencies in the middle of equal parts of a range, in logarithms.
pub(super) fn over((from, to): (f64, f64), parts: usize) -> impl Iterator<Item = f64> {
    (0..parts).map(move |k| from * (to / from).powf((k as f64 + 0.5) / parts as f64))
}

/// Whether two amplitudes are those of one response, but for harmonics left out.
pub(super) fn is_near(a: f64, b: f64) -> bool {
    (a / b - 1.0).abs() <= SAME_RESPONSE
}

/// The motion in time near a response.
pub(super) fn near(
    time: &TimeModel<'_>,
    balance: &HarmonicBalance<ContactElement>,
    response: &Response,
    amplitude: f64,
    effort: usize,
) -> Option<Periodic> {
    let motion = balance.motion(response)?;
    let harmonics = balance.harmonics();
    let near = time.near(response.omega, &motion, amplitude, harmonics, effort);
    near.ok().flatten()
}

/// Half range of the first harmonic at a port, of rows of coefficients \[m\]; 0 without that harmonic.
pub(super) fn first_harmonic(
    balance: &HarmonicBalance<ContactElement>,
    rows: &[f64],
    port: usize,
) -> f64 {
    let harmonics = balance.harmonics();
    let row = &rows[port * harmonics.coefficients()..];
    harmonics
        .slot_of(1)
        .map_or(0.0, |slot| row[slot].hypot(row[slot + 1]))
}

/// A motion in time as a start of the balance in its harmonics.
pub fn start_of(periodic: &Periodic) -> Start {
    Start {
        omega: periodic.omega,
        load_factor: 1.0,
        displacement: periodic.displacement.clone(),
    }
}

impl HarmonicBalance<ContactElement> {
    /// Whether a response does not move at a port, but for rounding.
    pub(super) fn is_still(&self, response: &Response, port: usize) -> bool {
        let rows = &response.displacement;
        let largest = rows.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        first_harmonic(self, rows, port) <= STILL * largest
    }

    /// Where a response is at the phase 0, of a structure whose coordinates are its ports; none of another.
    pub fn motion(&self, response: &Response) -> Option<Motion> {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let coordinates = self.model.core.coordinates();
        if self.model.residual.is_some() || coordinates * n != response.displacement.len() {
            return None;
        }
        let rates = harmonics.derivative(&response.displacement, response.omega);
        let at_start = |rows: &[f64]| -> Vec<f64> {
            let basis = harmonics.basis(0.0);
            rows.chunks(n)
                .map(|row| row.iter().zip(&basis).map(|(a, b)| a * b).sum())
                .collect()
        };
        let mut values = at_start(&response.displacement);
        values.extend(at_start(&rates));
        let rows = response.displacement.chunks(3 * n);
        for (element, row) in self.elements.iter().zip(rows) {
            match element.sliders.len() {
                0 => continue,
                1 => {}
                _ => return None,
            }
            let cycle = element.cycle(&self.sampling.synthesise(row));
            values.extend(&cycle.force[0][..2]);
        }
        Some(Motion { values })
    }
}
