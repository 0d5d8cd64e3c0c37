//! The harmonics that are left out: what they would change, and as many as leave little.

use super::bouncing::NORMAL;
use super::contact_element::ContactElement;
use super::effort::{AGAIN, BRANCHES, FINER};
use super::newton::FREQUENCY_WEIGHT;
use super::reach::Unseen;
use super::survey::is_near;
use super::vibration::{Resonance, Vibration};
use super::{DynamicsError, HarmonicBalance, Harmonics, Response, Start};

/// The change from the harmonics of a balance to about twice as many, times this, is taken for their error: at least a third of it
/// is left out by these, too, as what friction leaves out falls about like the square of the first order that is missing.
pub(super) const TAIL: f64 = 2.0;
/// Where a response is dear, the correction that is left to that with more harmonics, and counts as if it were made: harmonics that are
/// few leave out several times as much. Banks that lift off and land again may leave Newton's method no less.
const ESTIMATED: f64 = 1e-2;
/// The correction that is left where a response has many unknowns but is not dear; it is small against what harmonics leave out.
const ROUGHLY: f64 = 1e-5;
/// Error where no response was found with more harmonics: nothing is known.
pub(super) const UNKNOWN: f64 = 1.0;
/// The highest order to which harmonics are extended: 340 elements have 64 000 unknowns then.
const HIGHEST: u32 = 31;
/// The highest from which all of the range is looked at again with more harmonics, where those do not have the resonance.
const MOST_SURVEYED: u32 = 15;
/// A search with more harmonics is begun if it is expected to cost up to so many times what the first branches of one may: it is ended where it
/// costs more than a survey may, and counts then if it has found more.
const MOST_EXPECTED: f64 = 4.0;
/// Share of the input below which a dissipation is faint: what is rounding of the input is no error of it.
pub(super) const FAINT: f64 = 1e-6;
/// Error of a peak that is that of a motion in time: what climbing to it leaves.
pub(super) const OF_TIME: f64 = 1e-3;
/// Of one along another axis than that of a path of what bounces, where the climb may end beside a fold: measured, 0.4 %.
const ACROSS: f64 = 0.01;
/// Error from which, where it can be, a response is held against the motion in time near it.
pub(super) const LARGE: f64 = 0.02;
/// Share of a peak of which more harmonics know nothing from which the motions in time near it say that it is one.
pub(super) const CONFIRMED: f64 = 0.9;
/// Highest order of the harmonics with which a response of many is looked for first.
const FEW: u32 = 3;

/// Estimated errors of a resonance by the harmonics that are left out, relative.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Truncation {
    /// Of the frequency of the phase resonance.
    pub frequency: f64,
    /// Of the amplitude there, and of the peak beside it; of the peak alone where it was held against motions in time.
    pub amplitude: f64,
    /// Of the energy that friction dissipates in a cycle.
    pub friction_energy: f64,
}

impl Truncation {
    /// Where no response was found with more harmonics.
    const UNKNOWN: Truncation = Truncation {
        frequency: UNKNOWN,
        amplitude: UNKNOWN,
        friction_energy: UNKNOWN,
    };

    /// Adds what Newton's method has left of a resonance beyond its `tolerance`, and makes the bar of its amplitude hold a larger one of the motion in time near it.
    fn widen(&mut self, resonance: &Resonance, tolerance: f64) {
        let left = resonance
            .in_force()
            .correction
            .max(resonance.peak.correction);
        let left = if left > tolerance { left } else { 0.0 };
        let chosen = resonance.candidates.iter().filter(|candidate| {
            [resonance.in_force().omega, resonance.peak.omega].contains(&candidate.response.omega)
        });
        let above = resonance.largest_in_time / resonance.peak_amplitude - 1.0;
        self.amplitude = self.amplitude.max(above);
        for candidate in chosen {
            // One that is smaller may be beside a sharp peak that is elsewhere.
            if let Some(amplitude) = candidate.amplitude_in_time {
                let above = amplitude / candidate.amplitude - 1.0;
                self.amplitude = self.amplitude.max(above);
            }
        }
        for error in [
            &mut self.frequency,
            &mut self.amplitude,
            &mut self.friction_energy,
        ] {
            *error += left;
        }
    }

    /// Makes the bar of a peak hold what motions may have that could not be followed, up to an amplitude \[m\].
    fn leave(&mut self, reach: f64, resonance: &Resonance) {
        let above = reach / resonance.peak_amplitude - 1.0;
        let above = match above.is_finite() && !resonance.is_still {
            true => above,
            false if reach > 0.0 => UNKNOWN,
            false => 0.0,
        };
        self.amplitude = self.amplitude.max(above);
    }

    /// The larger of the errors of amplitude and dissipation, to which harmonics are extended.
    pub fn largest(&self) -> f64 {
        self.amplitude.max(self.friction_energy)
    }
}

/// A resonance, the balance that it solves, and what that leaves out.
pub struct Resolved<'a> {
    pub balance: HarmonicBalance<ContactElement>,
    pub resonance: Resonance,
    pub truncation: Truncation,
    pub(super) vibration: &'a Vibration,
    /// What looking over the whole range has cost so far.
    spent: u64,
    /// Whether its peak and its errors are still to be found.
    is_open: bool,
}

impl Vibration {
    /// The resonance with these contact elements, from a response in some harmonics if there is one; with the harmonics of the
    /// vibration, or those of the start if they are more. With a `tolerance` they are extended until the estimated errors of
    /// amplitude and dissipation are within it, up to order 31.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn resolve(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
        tolerance: Option<f64>,
    ) -> Result<Resolved<'_>, DynamicsError> {
        self.resolve_in_force(elements, start, tolerance)?
            .completed()
    }

    /// The resonance of [`Vibration::resolve`], but for the peak and the errors where the response in force is known without them: for whoever
    /// may look for another response with other elements before [`Resolved::completed`].
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn resolve_in_force(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
        tolerance: Option<f64>,
    ) -> Result<Resolved<'_>, DynamicsError> {
        let harmonics = match start {
            Some((of_start, _)) if of_start.highest() > self.harmonics.highest() => of_start,
            _ => &self.harmonics,
        };
        let balance = self.balance_of(elements, harmonics.clone())?;
        let start = match start {
            Some((of_start, start)) => Some(start.transferred(of_start, harmonics)),
            None => self.start_in_few(&balance),
        };
        let is_open = tolerance.is_none() && !balance.is_small();
        let resonance = match is_open {
            true => {
                let phase = balance.phase_resonance(self.range, start.as_ref())?;
                let iterations = phase.iterations;
                self.resonance_of(&balance, Some(phase.clone()), phase, iterations)?
            }
            false => self.resonance(&balance, start.as_ref())?,
        };
        let mut resolved = Resolved {
            resonance,
            balance,
            truncation: Truncation::UNKNOWN,
            vibration: self,
            spent: 0,
            is_open,
        };
        if is_open {
            return Ok(resolved);
        }
        let cost = resolved.balance.effort.spent();
        resolved.spent = cost;
        let surveyed = resolved.balance.harmonics().coefficients();
        let mut extended = false;
        loop {
            let highest = resolved.balance.harmonics().highest();
            let elements = resolved.balance.elements().to_vec();
            let Some((finer, resonance)) = resolved.estimate() else {
                // More harmonics do not have this resonance: which they have is looked for in all of the range.
                let searches = resolved.truncation.largest() >= UNKNOWN
                    && tolerance.is_some()
                    && resolved.balance.is_small()
                    && highest < MOST_SURVEYED;
                let beyond = resolved.balance.harmonics().beyond();
                if !searches || !resolved.survey_again(self.balance_of(elements, beyond)?) {
                    break;
                }
                extended = false;
                continue;
            };
            let within = |tolerance| resolved.truncation.largest() <= tolerance;
            if tolerance.is_none_or(within) || highest >= HIGHEST {
                break;
            }
            let balance = self.balance_of(elements, finer.clone())?;
            // A peak that more harmonics move out of the range leaves what there is.
            let phase = resonance.phase.as_ref().map(Response::start);
            let peak = resonance.peak.start();
            let Ok(resonance) = self.resonance_near(&balance, phase.as_ref(), &peak) else {
                break;
            };
            // Far from it is another one, and the strongest is looked for anew.
            if balance.is_small()
                && !is_near(resonance.peak_amplitude, resolved.resonance.peak_amplitude)
            {
                if !resolved.survey_again(balance) {
                    break;
                }
                extended = false;
                continue;
            }
            let resonance = resolved.resonance.extended(resonance);
            (resolved.resonance, resolved.balance, extended) = (resonance, balance, true);
        }
        // With more harmonics another resonance may be the strongest.
        if extended && resolved.balance.is_small() {
            let growth = resolved.balance.harmonics().coefficients() as f64 / surveyed as f64;
            if cost as f64 * growth * growth <= MOST_EXPECTED * BRANCHES as f64 {
                let harmonics = resolved.balance.harmonics().clone();
                let balance = self.balance_of(resolved.balance.elements().to_vec(), harmonics)?;
                if resolved.survey_again(balance) {
                    resolved.estimate();
                }
            }
        }
        let mut unseen = 0.0;
        if resolved.balance.is_small() {
            let mut above;
            (above, unseen) = resolved.above_with_more_harmonics();
            while above > LARGE
                && tolerance.is_some()
                && resolved.balance.harmonics().highest() < MOST_SURVEYED
            {
                let beyond = resolved.balance.harmonics().beyond();
                let elements = resolved.balance.elements().to_vec();
                if !resolved.survey_again(self.balance_of(elements, beyond)?) {
                    break;
                }
                resolved.estimate();
                (above, unseen) = resolved.above_with_more_harmonics();
            }
            resolved.hold_against_time();
            let amplitude = &mut resolved.truncation.amplitude;
            *amplitude = amplitude.max(TAIL * above);
        }
        resolved.hold_by_damping();
        let unfollowed = resolved.unfollowed().max(unseen);
        resolved.truncation.leave(unfollowed, &resolved.resonance);
        let tolerance = resolved.balance.settings.tolerance;
        resolved.truncation.widen(&resolved.resonance, tolerance);
        Ok(resolved)
    }

    /// A start for many harmonics: the phase resonance in the lowest, which is found at a small part of the cost. None where all
    /// cost little, and several vibrations at one frequency are told apart by searching among all of them.
    fn start_in_few(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Start> {
        let orders = balance.harmonics().orders();
        let driven = |order: &u32| self.loads.iter().any(|load| load.harmonic == *order);
        let few = orders.iter().filter(|o| **o <= FEW || driven(o)).copied();
        let few = Harmonics::new(&few.collect::<Vec<u32>>()).ok()?;
        if few.orders() == orders || balance.is_small() {
            return None;
        }
        let first = self.balance_of(balance.elements().to_vec(), few).ok()?;
        let response = first.phase_resonance(self.range, None).ok()?;
        Some(
            response
                .start()
                .transferred(first.harmonics(), balance.harmonics()),
        )
    }
}

impl Resolved<'_> {
    /// Amplitude that no motion exceeds of those that could not be followed, in gaps or beside the branches \[m\].
    fn unfollowed(&self) -> f64 {
        let in_gaps = Unseen::reach(&self.resonance.unseen);
        in_gaps.max(self.resonance.unfollowed)
    }

    /// With the peak and the errors, where they have not been found yet.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn completed(mut self) -> Result<Self, DynamicsError> {
        if let (true, Some(phase)) = (self.is_open, &self.resonance.phase) {
            self.resonance = self.vibration.beside(&self.balance, phase.clone())?;
            self.estimate();
            let tolerance = self.balance.settings.tolerance;
            self.truncation.widen(&self.resonance, tolerance);
            self.is_open = false;
        }
        Ok(self)
    }

    /// Takes the resonance of another balance in place of its own, found over the whole range; false, with nothing taken, where it has
    /// none, or where looking for it was given up before a larger one was found.
    fn survey_again(&mut self, balance: HarmonicBalance<ContactElement>) -> bool {
        if self.spent > AGAIN {
            return false;
        }
        let found = self.vibration.resonance(&balance, None);
        self.spent += balance.effort.spent();
        match found {
            Ok(resonance)
                if !resonance.is_cut
                    || resonance.peak_amplitude > self.resonance.peak_amplitude =>
            {
                (self.resonance, self.balance) = (resonance, balance);
                // What was known is of another one.
                self.truncation = Truncation::UNKNOWN;
                true
            }
            _ => false,
        }
    }

    /// What the way to a peak in time leaves of it.
    pub(super) fn left_in_time(&self) -> f64 {
        let is_across = self.resonance.is_top && self.vibration.response_port != NORMAL;
        if is_across { ACROSS } else { OF_TIME }
    }

    /// Estimates the errors by solving the resonance again, from itself, with the harmonics [`Harmonics::beyond`] and twice the samples;
    /// those harmonics and that resonance. None where the response is linear, as harmonics other than those of the loads stay 0, or
    /// where none is found from there; the errors are then those known before.
    ///
    /// One figure may change by little only because two larger changes of it cancel. That of the amplitude is therefore taken to be at
    /// least what the coefficients of the contact displacements change by on the whole, and that of the dissipation is the sum of the
    /// changes of all elements.
    fn estimate(&mut self) -> Option<(Harmonics, Resonance)> {
        let coarse = self.resonance.in_force();
        let is_linear = coarse.active_elements() == 0 && self.resonance.peak.active_elements() == 0;
        if is_linear {
            self.truncation = Truncation::default();
            return None;
        }
        let is_in_time = self.resonance.is_in_time();
        if is_in_time && self.resonance.phase.is_none() {
            // Harmonics have no part in it.
            self.truncation = Truncation {
                frequency: OF_TIME,
                amplitude: self.left_in_time(),
                friction_energy: OF_TIME,
            };
            return None;
        }
        let harmonics = self.balance.harmonics();
        let is_small = self.balance.is_small();
        let solve = || -> Result<_, DynamicsError> {
            let mut finer = self.vibration.finer(&self.balance, harmonics.beyond())?;
            if !is_small {
                let enough = if finer.is_costly { ESTIMATED } else { ROUGHLY };
                finer.settings.tolerance = finer.settings.tolerance.max(enough);
            }
            if is_small {
                finer.effort.allow(FINER);
            }
            let to_finer = |response: &Response| {
                let start = response.start();
                start.transferred(harmonics, finer.harmonics())
            };
            let start = to_finer(coarse);
            let fine = if is_in_time {
                let phase = finer.phase_resonance_near(self.vibration.range, &start)?;
                let peak = Response {
                    displacement: to_finer(&self.resonance.peak).displacement,
                    ..self.resonance.peak.clone()
                };
                self.vibration.resonance_of(&finer, Some(phase), peak, 0)?
            } else if is_small {
                let peak = to_finer(&self.resonance.peak);
                let phase = self.resonance.phase.is_some().then_some(&start);
                self.vibration.resonance_near(&finer, phase, &peak)?
            } else {
                let range = self.vibration.range;
                let phase = finer.phase_resonance_near(range, &start)?;
                // Of many unknowns the peak is that of the phase resonance, and is not looked for again.
                self.vibration
                    .resonance_of(&finer, Some(phase.clone()), phase, 0)?
            };
            Ok((finer, start, fine))
        };
        let (finer, start, fine) = solve().ok()?;
        let contact = 3 * finer.elements().len() * finer.harmonics().coefficients();
        let left = fine.in_force().correction.max(fine.peak.correction);
        let whole = distance(
            &start.displacement[..contact],
            &fine.in_force().displacement[..contact],
            harmonics,
            finer.harmonics(),
        ) + left;
        // Of a figure that is 0 with more harmonics nothing is known, and nothing where both are.
        let change = |coarse: f64, fine: f64| match (coarse / fine - 1.0).abs() {
            change if change <= UNKNOWN => change,
            _ if coarse == fine => 0.0,
            _ => UNKNOWN,
        };
        // Of the sliders: the work of the contact forces is sampling error where there is no friction. What one element dissipates more
        // and another less adds up: it wears elsewhere.
        let dissipated = |balance: &HarmonicBalance<ContactElement>, response: &Response| {
            if balance.settings.by_events {
                let width = 3 * balance.harmonics().coefficients();
                let rows = response.force.chunks(width);
                let pairs = rows.zip(response.displacement.chunks(width));
                return pairs.map(|(f, u)| balance.harmonics().work(f, u)).collect();
            }
            let cycles = balance.element_cycles(response, balance.sampling());
            let energies = cycles.iter().map(|cycle| cycle.dissipated_energy);
            energies.collect::<Vec<f64>>()
        };
        let [before, after] = [
            dissipated(&self.balance, coarse),
            dissipated(&finer, fine.in_force()),
        ];
        let moved: f64 = before.iter().zip(&after).map(|(b, a)| (b - a).abs()).sum();
        let all: f64 = after.iter().map(|energy| energy.abs()).sum();
        let all = all.max(FAINT * fine.in_force().energy.input.abs());
        let energy = match moved / all + left {
            change if change <= UNKNOWN => change,
            _ if moved == 0.0 => 0.0,
            _ => UNKNOWN,
        };
        // Of an amplitude that is rounding there is no error but that of what moves elsewhere.
        let is_still = self.resonance.is_still;
        let peak = match is_small {
            _ if is_still => 0.0,
            _ if is_in_time => OF_TIME,
            true => change(self.resonance.peak_amplitude, fine.peak_amplitude),
            false => 0.0,
        };
        let amplitude = match is_still {
            true => 0.0,
            false => change(self.resonance.amplitude, fine.amplitude),
        };
        self.truncation = Truncation {
            frequency: TAIL
                * (change(coarse.omega, fine.in_force().omega) + left / FREQUENCY_WEIGHT),
            amplitude: TAIL * amplitude.max(whole).max(peak),
            friction_energy: TAIL * energy,
        };
        Some((finer.harmonics().clone(), fine))
    }
}

/// Euclidean distance of two rows of coefficients in the orders of `kept` but the mean, relative to the second; rows of those of
/// `all`.
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
