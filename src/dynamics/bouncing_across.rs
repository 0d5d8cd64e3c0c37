//! What bounces along the normal lets go of what slides, and takes it along again. Where the response is along another axis, that is largest
//! anywhere along a path: at a resonance of its own, say, which is as narrow as its damping. So it is followed along the path, and climbed to in
//! frequency from each place that is higher than those beside it.

use super::HarmonicBalance;
use super::bouncing::{NORMAL, alone_on_the_normal};
use super::bouncing_path::{Bounce, Path};
use super::contact_element::ContactElement;
use super::effort::{ALONG, LEAST_ALONG};
use super::periodic::{Asked, Periodic};
use super::survey::{EFFORT, Survey};
use super::truncation::OF_TIME;
use super::two_springs::TwoSprings;
use super::vibration::Vibration;

/// Places along a path, one after the other.
const PLACES: usize = 12;
/// Shares of the highest response that is known from which they are climbed from: where both beside are nearly as large, and where one is smaller by
/// a factor. Halfway between two places, a resonance is at least twice as far from the next.
const SMOOTH: f64 = 0.5;
const STEEP: f64 = 0.1;
const FALLS: f64 = 1.5;
/// First step of frequency, relative, and the last in half-power bandwidths: the amplitude is the highest to a thousandth then.
const STEP: f64 = 0.005;
const LAST: f64 = 0.04;

impl Vibration {
    /// Adds to a survey the motions on paths of what bounces that are largest along the axis of the response, where that is not the normal and no branch
    /// has as large a response. Given how a contact is pressed over a period, damped motions along other axes come nearer to each other: each
    /// motion of a path has one of them. Where none can be as large as what is known, none is looked for.
    pub(super) fn look_across(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
        bouncer: &TwoSprings,
        paths: &[Path],
    ) {
        if self.response_port == NORMAL || paths.is_empty() {
            return;
        }
        let size = |motion: &Periodic| self.size(balance, motion);
        let known = survey.highest(balance, self.response_port);
        let mut tops: Vec<(Periodic, f64)> = Vec::new();
        let mut is_whole = true;
        let begun = balance.effort.spent();
        let share = (ALONG / paths.len() as u64).max(LEAST_ALONG);
        for path in paths {
            is_whole &= path.is_whole;
            let left = ALONG.saturating_sub(balance.effort.spent() - begun);
            balance.effort.allow(share.min(left));
            let inside = path.inside(self.range);
            let reaches = self.reaches(balance, bouncer, &inside);
            let all: Vec<(&Bounce, f64)> = inside.into_iter().zip(reaches).collect();
            let is_above = |(_, reach): &(&Bounce, f64)| *reach > known;
            let above = all.iter().filter(|place| is_above(place)).count();
            for part in all.chunk_by(|a, b| is_above(a) == is_above(b)) {
                if !is_above(&part[0]) {
                    continue;
                }
                let reach = part
                    .iter()
                    .fold(0.0_f64, |most, (_, reach)| most.max(*reach));
                let places = part.iter().step_by(above.div_ceil(PLACES));
                let (motions, are_all) =
                    self.along_path(balance, survey, places.map(|(motion, _)| *motion));
                if !are_all {
                    is_whole = false;
                    survey.leave(reach);
                }
                let size = |k: usize| motions.get(k).map_or(0.0, size);
                for k in 0..motions.len() {
                    let beside = [k.checked_sub(1).map_or(0.0, size), size(k + 1)];
                    let [lower, higher] = [beside[0].min(beside[1]), beside[0].max(beside[1])];
                    let share = if size(k) > FALLS * lower {
                        STEEP
                    } else {
                        SMOOTH
                    };
                    if size(k) >= higher.max(share * known) {
                        tops.push((motions[k].clone(), reach));
                    }
                }
            }
        }
        tops.sort_by(|a, b| size(&b.0).total_cmp(&size(&a.0)));
        balance.effort.allow(ALONG);
        for (top, reach) in tops {
            if balance.effort.is_spent() {
                is_whole = false;
                survey.leave(reach);
                continue;
            }
            let (top, is_reached) = self.climbed_across(balance, top);
            let is_cut = balance.effort.steps_left() < EFFORT;
            if !is_reached && (is_cut || size(&top) >= SMOOTH * known) {
                is_whole = false;
                survey.leave(reach);
            }
            if size(&top) > known * (1.0 + OF_TIME) {
                survey
                    .tops
                    .extend(is_whole.then_some([top.omega, size(&top)]));
                survey.motions.push(top);
            }
        }
    }

    /// What motions along a path have at most at the response port \[m\], each with the way to those beside it, on which the structure may resonate
    /// without contact.
    fn reaches(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        bouncer: &TwoSprings,
        path: &[&Bounce],
    ) -> Vec<f64> {
        let own = self.own_frequencies(balance);
        let damped = self.damped_bound();
        let load = |motion: &Bounce| bouncer.mean_load(&motion.shape);
        let mut reaches: Vec<f64> = path
            .iter()
            .map(|motion| self.reach_at(balance, &damped, motion.omega, load(motion)))
            .collect();
        for (k, ends) in path.windows(2).enumerate() {
            let [a, b] = [ends[0], ends[1]];
            let within = a.omega.min(b.omega)..a.omega.max(b.omega);
            for omega in own.iter().filter(|omega| within.contains(omega)) {
                let reach = self.reach_at(balance, &damped, *omega, load(a).max(load(b)));
                for end in &mut reaches[k..=k + 1] {
                    *end = end.max(reach);
                }
            }
        }
        reaches
    }

    /// Motions of all coordinates at places along a path; and whether one was found at each.
    fn along_path<'a>(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &Survey,
        places: impl Iterator<Item = &'a Bounce>,
    ) -> (Vec<Periodic>, bool) {
        let mut motions: Vec<Periodic> = Vec::new();
        let mut are_all = true;
        for bounce in places {
            if balance.effort.is_spent() {
                are_all = false;
                break;
            }
            // Where it resonates along another axis, a motion from rest is far away.
            let before = motions.last().map(|before| before.motion.clone());
            let before = before.or_else(|| {
                let highest = survey.highest_at(balance, self.response_port, bounce.omega)?;
                balance.motion(&highest)
            });
            let from = |others| self.with_all_axes(balance, bounce, others, Asked::Motion);
            let found = from(before.as_ref());
            let found = found.or_else(|| before.as_ref().and_then(|_| from(None)));
            are_all &= found.is_some();
            motions.extend(found);
        }
        (motions, are_all)
    }

    /// The top of the motions in time beside one of them, and whether it was reached.
    fn climbed_across(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        top: Periodic,
    ) -> (Periodic, bool) {
        let Some(time) = self.in_time(balance) else {
            return (top, false);
        };
        let Some(coordinate) = alone_on_the_normal(&self.model) else {
            return (top, false);
        };
        let harmonics = balance.harmonics();
        let n = harmonics.coefficients();
        let along = |top: &Periodic| -> f64 {
            let row = &top.displacement[NORMAL * n..][..n];
            row[1..].chunks(2).map(|pair| pair[0].hypot(pair[1])).sum()
        };
        let near = |omega: f64, top: &Periodic, asked: Asked| {
            let sizes = self.coordinate_sizes(balance, omega, (coordinate, along(top)));
            let scales = time.scales_by(omega, &sizes);
            let left = balance.effort.steps_left().saturating_sub(time.steps());
            let effort = EFFORT.min(left);
            let near = time.near_by(omega, &top.motion, &scales, harmonics, asked, effort);
            near.ok().flatten()
        };
        let next = |omega: f64, top: &Periodic| near(omega, top, Asked::Motion);
        let steps = [STEP, (LAST * self.bandwidth(top.omega)).min(0.5 * STEP)];
        let (top, is_reached) = self.climbed(balance, &time, top, steps, next);
        let found = near(top.omega, &top, Asked::Stability);
        balance.effort.add_steps(time.steps());
        match found {
            Some(found) => (found, is_reached),
            None => (top, false),
        }
    }
}
