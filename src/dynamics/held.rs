//! What the error bars of a resonance of few unknowns are held against: motions in time, the branches of more harmonics, and what damping lets
//! be.

use std::f64::consts::TAU;

use super::bouncing::NORMAL;
use super::candidates::gives_energy;
use super::contact_element::ContactElement;
use super::effort::{FINER, NEAR_FINER};
use super::reach::Unseen;
use super::survey::{IN_GAPS, SAME, Survey, first_harmonic, is_near, over};
use super::truncation::{CONFIRMED, FAINT, LARGE, OF_TIME, Resolved, UNKNOWN};
use super::{HarmonicBalance, Response};

/// Share of the peak from which another may be higher with more harmonics.
const RIVAL: f64 = 0.3;

/// Share of its frequency beside a peak without damping at which an amplitude is still at least half of it. Of a peak that is narrower its height
/// is where the search happened to stop.
const NARROWEST: f64 = 1e-5;

impl Resolved<'_> {
    /// Where more harmonics say that an error is large, or nothing of it, the difference from the motions in time takes its place: of the
    /// peak from their peak, of the dissipation from theirs at its frequency. Of a peak that is the top of a path in time, what the top leaves does.
    pub(super) fn hold_against_time(&mut self) {
        let (vibration, balance) = (self.vibration, &self.balance);
        let resonance = &self.resonance;
        if resonance.is_still {
            return;
        }
        if resonance.is_in_time() {
            // Harmonics have a part in the phase resonance beside it alone. A path that is not whole may go higher; how high the motions of other
            // axes are along it then is known apart.
            let is_highest = resonance.is_top || vibration.response_port != NORMAL;
            if is_highest && self.truncation.amplitude > LARGE {
                self.truncation.amplitude = self.left_in_time();
            }
            return;
        }
        let is_sure = self.truncation.amplitude < UNKNOWN;
        let in_time = resonance.largest_in_time;
        // The paths of what bounces by itself are found in closed form: the highest motion of all of them, if it is near the peak, is what the
        // branch of few harmonics stands for.
        let stands_for_it = vibration.response_port == NORMAL
            && is_near(in_time, resonance.peak_amplitude)
            && vibration.bouncer(balance).is_some();
        if self.truncation.amplitude > LARGE && stands_for_it {
            self.truncation.amplitude = (in_time / resonance.peak_amplitude - 1.0).abs() + OF_TIME;
        } else if self.truncation.amplitude > LARGE
            && let Some(size) = vibration.peak_in_time(balance, &resonance.peak, is_sure)
        {
            let ratio = size / resonance.peak_amplitude;
            // Where nothing is known, a larger motion says that the peak is elsewhere, and a smaller one that it may be, unless that is the
            // highest of all that is known in time.
            let is_highest = (size / resonance.largest_in_time - 1.0).abs() <= OF_TIME;
            let is_one = is_sure || is_highest || (CONFIRMED..=1.0 + LARGE).contains(&ratio);
            self.truncation.amplitude = match is_one {
                true => (ratio.recip() - 1.0).abs() + OF_TIME,
                false => self.truncation.amplitude,
            };
        }
        let in_force = resonance.in_force();
        if self.truncation.friction_energy > LARGE
            && let Some([friction, input]) = vibration.energy_in_time(balance, in_force)
        {
            let size = friction.abs().max(FAINT * input.abs());
            let change = (in_force.energy.friction - friction).abs() / size;
            self.truncation.friction_energy = change.min(UNKNOWN) + OF_TIME;
        }
    }

    /// Where nothing is known of a figure, what damping lets it be is all that its bar can hold.
    pub(super) fn hold_by_damping(&mut self) {
        if self.resonance.is_still {
            // Rounding has no digit that is known.
            self.truncation.amplitude = self.truncation.amplitude.max(UNKNOWN);
            return;
        }
        let damped = self.vibration.damped_bound();
        if self.balance.is_small() && damped.is_none() && self.is_without_top() {
            self.truncation.amplitude = UNKNOWN;
            self.truncation.friction_energy = UNKNOWN;
            return;
        }
        let errors = [self.truncation.amplitude, self.truncation.friction_energy];
        if errors.iter().all(|error| *error < UNKNOWN) {
            return;
        }
        let Some(bound) = damped else {
            // Where nothing bounds it, a figure of which nothing is known is below nothing either.
            for error in [
                &mut self.truncation.amplitude,
                &mut self.truncation.friction_energy,
            ] {
                *error = error.min(UNKNOWN);
            }
            return;
        };
        // Of a figure that is rounding no part is known.
        let held = |error: f64, most: f64, figure: f64| match most / figure - 1.0 {
            above if error >= UNKNOWN && figure > 0.0 && above.is_finite() => error.max(above),
            _ => error,
        };
        let range = self.vibration.range;
        let [most, most_friction] = [bound.amplitude(range), bound.friction_energy(range)];
        let [amplitude, friction_energy] = errors;
        let (peak, in_force) = (self.resonance.peak_amplitude, self.resonance.in_force());
        let friction = in_force.energy.friction;
        self.truncation.amplitude = held(amplitude, most, peak);
        self.truncation.friction_energy = held(friction_energy, most_friction, friction);
    }

    /// Whether the amplitude falls to less than half of the peak next to it on both sides: where loads supply more than friction takes, and nothing else
    /// damps, it grows up to the resonance without bound.
    fn is_without_top(&self) -> bool {
        let (vibration, peak) = (self.vibration, &self.resonance.peak);
        let start = peak.start();
        [1.0 - NARROWEST, 1.0 + NARROWEST].iter().all(|side| {
            let beside = self.balance.solve(side * peak.omega, Some(&start));
            beside.is_ok_and(|response| {
                let port = vibration.response_port;
                let size = first_harmonic(&self.balance, &response.displacement, port);
                size < 0.5 * self.resonance.peak_amplitude
            })
        })
    }

    /// By how much the branch of more harmonics, and motions in time where it has gaps in which these harmonics differ from them, are above the peak,
    /// anywhere in the range, relative to it: with too few of them another peak may be the strongest. 0 where they are not, or cannot be followed;
    /// rounding of the same peak is none. And the amplitude that a peak has at most in a gap of which nothing is known \[m\], 0 without one. Where that branch costs too much to follow, the peaks
    /// from a share of the highest on are solved with more harmonics, and those that are not found do not count.
    pub(super) fn above_with_more_harmonics(&self) -> (f64, f64) {
        let (vibration, resonance) = (self.vibration, &self.resonance);
        if resonance.is_in_time() || resonance.is_still {
            return (0.0, 0.0);
        }
        let beyond = self.balance.harmonics().beyond();
        let Ok(finer) = vibration.finer(&self.balance, beyond) else {
            return (0.0, 0.0);
        };
        finer.effort.allow(FINER);
        let Ok((branches, _)) = finer.parts(vibration.along()) else {
            return (0.0, 0.0);
        };
        let of = |response: &Response| {
            first_harmonic(&finer, &response.displacement, vibration.response_port)
        };
        let moves = branches.iter().flatten().filter(|r| !gives_energy(r));
        let mut largest = moves.map(of).fold(0.0, f64::max);
        if finer.effort.is_spent() {
            // The known peaks at least, as far as they may be higher.
            let all = resonance.candidates.iter();
            for candidate in all.filter(|peak| peak.amplitude >= RIVAL * resonance.peak_amplitude) {
                let start = candidate.response.start();
                let start = start.transferred(self.balance.harmonics(), finer.harmonics());
                finer.effort.allow(NEAR_FINER);
                let there = finer.solve_near(candidate.response.omega, &start);
                let near = vibration.resonance_near(&finer, None, &start);
                let found = there.into_iter().chain(near.map(|near| near.peak));
                let found = found.filter(|response| !gives_energy(response));
                largest = found.map(|response| of(&response)).fold(largest, f64::max);
            }
        }
        let begun = branches.into_iter().filter(|branch| !branch.is_empty());
        let mut survey = Survey::of(begun.collect());
        if !survey.branches.is_empty() {
            survey.gaps = survey.left_out(vibration.range);
            survey.gaps.retain(|gap| !self.is_alike(&finer, *gap));
            finer.effort.unbound();
            vibration.look_into_gaps(&finer, &mut survey);
        }
        largest = largest.max(survey.largest_in_time(&finer, vibration.response_port));
        let above = largest / resonance.peak_amplitude - 1.0;
        let above = if above > SAME { above } else { 0.0 };
        (
            above,
            Unseen::reach(&vibration.unseen(&finer, &survey.unseen)),
        )
    }

    /// Whether a gap \[Hz\] is one of these harmonics too, or more of them have responses near these there all the same; those of a survey that is
    /// no longer known count as alike.
    fn is_alike(&self, finer: &HarmonicBalance<ContactElement>, [low, high]: [f64; 2]) -> bool {
        let (vibration, resonance, balance) = (self.vibration, &self.resonance, &self.balance);
        let is_own = |[from, to]: &[f64; 2]| *from < high && low < *to;
        if resonance.gaps.iter().any(is_own) {
            return true;
        }
        let Some(survey) = vibration.kept_survey(balance) else {
            return true;
        };
        let port = vibration.response_port;
        let mut places = over((TAU * low, TAU * high), IN_GAPS);
        finer.effort.allow(FINER);
        places.all(|omega| {
            let Some(here) = survey.highest_at(balance, port, omega) else {
                return false;
            };
            let start = here.start();
            let start = start.transferred(balance.harmonics(), finer.harmonics());
            let size = |balance, response: &Response| {
                first_harmonic(balance, &response.displacement, port)
            };
            let there = finer.solve_near(omega, &start);
            there.is_ok_and(|there| is_near(size(finer, &there), size(balance, &here)))
        })
    }
}
