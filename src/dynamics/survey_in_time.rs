//! Motions in time beside the branches of a survey: the peak that no branch has, what an error bar is held against, and what is in gaps.

use std::f64::consts::TAU;

use super::contact_element::ContactElement;
use super::periodic::{Periodic, Settled};
use super::survey::{BESIDE, EFFORT, IN_GAPS, SAME, Survey, USUAL, first_harmonic, near};
use super::time_integration::{Motion, TimeModel};
use super::vibration::Vibration;
use super::{DynamicsError, HarmonicBalance, Response};

/// First and least step of frequency to the peak of motions in time, relative, and integration steps for it.
const CLIMB: f64 = 0.02;
const LEAST_CLIMB: f64 = 1e-5;
const CLIMBING: usize = 240_000;
/// First and least step from a response of the balance to the peak of the motions in time near it, relative.
const NEARBY: f64 = 1e-3;
const LEAST_NEARBY: f64 = 1e-6;
/// Where else the peak may be in time that the balance has with few harmonics, relative to its frequency and to those of the structure.
const ASIDE: [f64; 8] = [0.02, -0.02, 0.05, -0.05, 0.1, -0.1, 0.2, -0.2];
/// Half-power bandwidths between frequencies of a gap at which motions in time are looked for, so that no peak lies between; most
/// frequencies, and integration steps for all gaps, or for all places beside a peak.
const APART: f64 = 2.0;
const MOST_IN_GAP: usize = 60;
const IN_TIME: usize = 200_000;

impl Vibration {
    /// The peak of the motions in time that are larger than all branches, and whether it was reached; none without such a motion. It is
    /// climbed to in frequency, as the balance has no branch there.
    pub(super) fn top_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
    ) -> Option<(Periodic, bool)> {
        let size = |periodic: &Periodic| self.size(balance, periodic);
        let all = survey.motions.iter();
        let start = all.max_by(|a, b| size(a).total_cmp(&size(b)))?;
        if size(start) <= survey.largest(balance, self.response_port) {
            return None;
        }
        if survey.is_top(start.omega, size(start)) {
            return Some((start.clone(), true));
        }
        let time = self.in_time(balance)?;
        let next = |omega: f64, top: &Periodic| {
            let (start, size, harmonics) = (&top.motion, size(top), balance.harmonics());
            let effort = || BESIDE.min(CLIMBING.saturating_sub(time.steps()));
            let near = time.near(omega, start, size, harmonics, effort());
            if let Ok(Some(near)) = near {
                return Some(near);
            }
            match time.settle(omega, start, size, harmonics, effort()) {
                Ok(Settled::Periodic(next)) => Some(next),
                _ => None,
            }
        };
        let steps = [CLIMB, LEAST_CLIMB];
        let climbed = self.climbed(balance, &time, start.clone(), steps, next);
        balance.effort.add_steps(time.steps());
        Some(climbed)
    }

    /// From `top` up to where the amplitude is largest, along the motions that `next` finds at a frequency from one beside it, by steps
    /// of frequency from the first of `steps` down to the last; and whether it got there.
    pub(super) fn climbed(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        time: &TimeModel<'_>,
        mut top: Periodic,
        steps: [f64; 2],
        next: impl Fn(f64, &Periodic) -> Option<Periodic>,
    ) -> (Periodic, bool) {
        let size = |periodic: &Periodic| self.size(balance, periodic);
        let begun = time.steps();
        let [mut step, least] = steps;
        let mut direction = 1.0;
        // Whether it is seen what is beside the top.
        let mut is_seen = true;
        while step > least {
            if time.steps() - begun >= CLIMBING {
                return (top, false);
            }
            let mut rose = false;
            is_seen = false;
            for way in [direction, -direction] {
                let omega = top.omega * (1.0 + way * step);
                if !(self.range.0..=self.range.1).contains(&omega) {
                    continue;
                }
                let Some(next) = next(omega, &top) else {
                    continue;
                };
                is_seen = true;
                if size(&next) > size(&top) {
                    (top, direction, rose) = (next, way, true);
                    break;
                }
            }
            step *= if rose { 1.5 } else { 0.4 };
        }
        (top, is_seen)
    }

    /// The amplitude of the peak of the motions in time near a response \[m\], stable or not; none where they do not lead to one. Unless
    /// it `is_sure` that this is the peak in time too, the largest is climbed from of what is found aside.
    pub(super) fn peak_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: &Response,
        is_sure: bool,
    ) -> Option<f64> {
        let time = self.in_time(balance)?;
        let harmonics = balance.harmonics();
        let amplitude = first_harmonic(balance, &response.displacement, self.response_port);
        let size = |periodic: &Periodic| self.size(balance, periodic);
        let first = match self.near_in_time(balance, &time, response) {
            Some(near) if is_sure => near,
            near => {
                let beside = self.beside_in_time(balance, &time, response);
                let all = near.into_iter().chain(beside);
                all.max_by(|a, b| size(a).total_cmp(&size(b)))?
            }
        };
        let next = |omega: f64, top: &Periodic| {
            let near = time.near(omega, &top.motion, amplitude, harmonics, BESIDE);
            near.ok().flatten()
        };
        let steps = [NEARBY, LEAST_NEARBY];
        let (top, is_there) = self.climbed(balance, &time, first, steps, next);
        is_there.then_some(size(&top))
    }

    /// The motions to which the structure settles beside a response and near its natural frequencies, with the contact closed and open.
    fn beside_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        time: &TimeModel<'_>,
        response: &Response,
    ) -> Vec<Periodic> {
        let amplitude = first_harmonic(balance, &response.displacement, self.response_port);
        let rest = time.rest();
        let motion = balance.motion(response);
        let there = motion.as_ref().unwrap_or(&rest);
        // Where it is itself none of the motions, a branch that it belongs to may go on beside it.
        let beside = ASIDE
            .iter()
            .map(|aside| (response.omega * (1.0 + aside), there));
        let own = self.own_frequencies(balance);
        let own = own.into_iter().map(|omega| (omega, &rest));
        let inside = |omega: f64| (self.range.0..=self.range.1).contains(&omega);
        let places = beside.chain(own).filter(|(omega, _)| inside(*omega));
        let begun = time.steps();
        let places = places.take_while(|_| time.steps() - begun < IN_TIME);
        let found = places.filter_map(|(omega, start)| {
            match time.settle(omega, start, amplitude, balance.harmonics(), BESIDE) {
                Ok(Settled::Periodic(periodic)) => Some(periodic),
                _ => None,
            }
        });
        found.collect()
    }

    /// Natural angular frequencies with the contact open, of each coordinate by itself, and closed, each once, rising.
    pub(super) fn own_frequencies(&self, balance: &HarmonicBalance<ContactElement>) -> Vec<f64> {
        let model = &self.model;
        let open =
            (0..model.mass.rows()).map(|k| (model.stiffness.at(k, k) / model.mass.at(k, k)).sqrt());
        let closed = balance.model.core.natural_frequencies().iter().copied();
        let mut all: Vec<f64> = open.chain(closed).collect();
        all.sort_by(f64::total_cmp);
        all.dedup_by(|b, a| *b <= *a * (1.0 + SAME));
        all
    }

    /// The dissipation of the motion in time near a response, and the work that its loads do \[J\]; none where there is no such motion.
    pub(super) fn energy_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        response: &Response,
    ) -> Option<[f64; 2]> {
        let time = self.in_time(balance)?;
        let near = self.near_in_time(balance, &time, response)?;
        Some([near.energy.friction, near.energy.input])
    }

    /// The motion in time near a response: the periodic one that Newton's method leads to, or that to which it settles.
    fn near_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        time: &TimeModel<'_>,
        response: &Response,
    ) -> Option<Periodic> {
        let amplitude = first_harmonic(balance, &response.displacement, self.response_port);
        if let Some(near) = near(time, balance, response, amplitude, 2 * BESIDE) {
            return Some(near);
        }
        let (motion, harmonics) = (balance.motion(response)?, balance.harmonics());
        match time.settle(response.omega, &motion, amplitude, harmonics, 2 * BESIDE) {
            Ok(Settled::Periodic(periodic)) => Some(periodic),
            _ => None,
        }
    }

    /// Motions in time over the gaps of a survey, each from that at the frequency below, so near each other that no peak lies between;
    /// where that costs too much, or one does not settle, the gap stays unseen.
    pub(super) fn look_into_gaps(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
    ) {
        let time = self.in_time(balance);
        let guess = survey.largest(balance, self.response_port);
        for [low, high] in survey.gaps.clone() {
            let seen = time.as_ref().and_then(|time| {
                let bandwidth = self.bandwidth(TAU * (low * high).sqrt());
                let points = ((high / low).ln() / (APART * bandwidth)).ceil();
                // A resonance as high as the peak would set the ends of the branches beside it further apart: by its height times the
                // bandwidth over the gap, at least.
                let flanks = survey.flanks(balance, self.response_port, [low, high]);
                let share = (bandwidth / (high / low).ln()).min(1.0);
                if flanks.is_some_and(|[apart, larger]| {
                    larger <= 0.5 * guess && apart < 0.5 * share * guess
                }) {
                    return Some(Vec::new());
                }
                let points = (points <= MOST_IN_GAP as f64).then_some(points as usize)?;
                let points = points.max(IN_GAPS);
                let mut start = time.rest();
                let mut found = Vec::new();
                for k in 0..points {
                    let left = IN_TIME.saturating_sub(time.steps());
                    let omega = TAU * low * (high / low).powf((k as f64 + 0.5) / points as f64);
                    let effort = left.min(BESIDE);
                    match time.settle(omega, &start, guess, balance.harmonics(), effort) {
                        Ok(Settled::Periodic(periodic)) => {
                            start = periodic.motion.clone();
                            found.push(periodic);
                        }
                        Ok(Settled::Turns(_)) => {}
                        _ => return None,
                    }
                }
                Some(found)
            });
            match seen {
                Some(found) => {
                    let larger = |periodic: &Periodic| self.size(balance, periodic) > guess;
                    survey.motions.extend(found.into_iter().filter(larger));
                }
                None => survey.unseen.push([low, high]),
            }
        }
        if let Some(time) = time {
            balance.effort.add_steps(time.steps());
        }
    }

    /// Amplitude of a motion in time at the response point \[m\].
    pub(super) fn size(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        periodic: &Periodic,
    ) -> f64 {
        first_harmonic(balance, &periodic.displacement, self.response_port)
    }

    /// The least half-power bandwidth of a coordinate near an angular frequency, relative to it.
    pub(super) fn bandwidth(&self, omega: f64) -> f64 {
        let of = |k: usize| self.model.damping.at(k, k) / (omega * self.model.mass.at(k, k));
        (0..self.model.mass.rows())
            .map(of)
            .fold(f64::INFINITY, f64::min)
    }

    /// What the motion in time at `omega` settles to, from `start` if there is one, else from rest, in about as many integration steps as
    /// `effort` says, and how many it took; none of a structure that cannot be integrated.
    pub(super) fn settle(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        start: Option<&Motion>,
        effort: usize,
    ) -> Option<(Result<Settled, DynamicsError>, usize)> {
        let time = self.in_time(balance)?;
        let rest = time.rest();
        let start = start.unwrap_or(&rest);
        let settled = time.settle(omega, start, USUAL, balance.harmonics(), effort);
        Some((settled, time.steps()))
    }

    /// Largest moduli of the multipliers of the motions in time near some responses, of the amplitudes that stand beside them: of every
    /// eighth first, then of the others, as far as the effort goes.
    pub(super) fn multipliers(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        responses: &[(&Response, f64)],
    ) -> Vec<Option<f64>> {
        let mut out = vec![None; responses.len()];
        let Some(time) = self.in_time(balance) else {
            return out;
        };
        let all = 0..responses.len();
        let (first, rest): (Vec<usize>, Vec<usize>) = all.partition(|k| k % 8 == 0);
        for k in first.into_iter().chain(rest) {
            let left = EFFORT.saturating_sub(time.steps());
            if left == 0 {
                break;
            }
            let (response, amplitude) = responses[k];
            let near = near(&time, balance, response, amplitude, left.min(BESIDE));
            out[k] = near.and_then(|near| near.multiplier);
        }
        out
    }
}
