//! How long a run will still take: before it has worn by what runs take, then from what it has done since this start.

use std::collections::VecDeque;
use std::time::Instant;

use fretwear::stages::Stage;

use super::prior::{self, Prior, STEPS, WORN};

/// Steps from which the growth of steps and what one takes are known: an even number, of which each half is one length.
const OF_LATE: usize = 4;
/// By how much one step of the wear is longer than the one before, until steps have shown it: what the shipped scenes have.
const GROWTH: f64 = 1.35;
/// More than that is an exception and does not go on.
const MOST_GROWTH: f64 = 1.6;
/// What takes longer than expected has at least this part left of what it took so far.
const LAST: f64 = 0.05;
/// Points from which on the pace of a forced response tells when it ends.
const TELLING: u64 = 3;
/// A forced response whose points say this part of what the one before makes expect is a quick one.
const QUICK: f64 = 0.25;
/// Steps after which a run is known by its own alone: before, what runs take counts too.
const KNOWN: usize = 4;
/// A vibration that takes this part of the first one is a new one.
const NEW: f64 = 0.1;
/// What runs take of vibrations at updates counts like so many of the first one beside what this run took.
const EXPECTED: f64 = 2.0;

/// The pace of a run.
#[derive(Debug, Default)]
pub struct Pace {
    /// What is known before the run has shown it.
    prior: Option<Prior>,
    /// Curves are computed at every so many iterations and at the last; 0: never.
    curves_every: u64,
    /// Whether contact elements are updated.
    updates: bool,
    /// The last iterations: what part of the run was behind each.
    parts: VecDeque<f64>,
    /// The stage that is computed, and since when.
    stage: Option<(Stage, Instant)>,
    /// Seconds and points of the longest forced response: they are computed at the first iteration and at the last, and where they are
    /// asked for.
    response: (f64, u64),
    /// Seconds of the first vibration, and of all later ones.
    vibrations: [f64; 2],
    /// Part of the run behind the last update.
    updated: f64,
    /// The unworn joint, the last iterations that wear, and the one being computed.
    unworn: Took,
    late: VecDeque<Took>,
    current: Took,
    /// How many iterations have worn.
    iterations: usize,
    /// Whether a state is committed.
    begun: bool,
    /// What was said last, and is said again where no update is due.
    said: Option<Left>,
    /// Cycles behind the first iteration of this start, and of the last.
    cycles: Option<[u64; 2]>,
    /// When the first iteration of this start was committed.
    first: Option<Instant>,
}

/// Seconds of an iteration, but for its forced response.
#[derive(Debug, Clone, Copy, Default)]
struct Took {
    /// Of all but vibrations.
    step: f64,
    /// Of its contact and cycle among these, which curves make longer.
    contact: f64,
    vibration: f64,
}

/// Seconds to go, counted down from an instant.
#[derive(Debug, Clone, Copy)]
pub struct Left {
    since: Instant,
    /// Of what is being computed.
    seconds: f64,
    /// Of the run after it.
    after: f64,
    /// By what runs take, not yet by what this one took.
    pub rough: bool,
    /// Points of the forced response before; 0 of what is none, or is not known.
    points: u64,
}

impl Pace {
    /// The pace of a run of which nothing is known but what runs take, that computes curves at every so many iterations, and may update
    /// its contact elements.
    pub fn new(prior: Option<Prior>, curves_every: u64, updates: bool) -> Pace {
        Pace {
            prior,
            curves_every,
            updates,
            ..Pace::default()
        }
    }

    /// What earlier starts have recorded: the seconds of each iteration by stage, and the part of the run behind it. The last one is
    /// committed again as this start begins.
    pub fn recorded(&mut self, iterations: &[(Vec<(Stage, f64)>, f64)]) {
        for (k, (stages, part)) in iterations.iter().enumerate() {
            for (stage, seconds) in stages {
                self.took(*stage, *seconds, 0);
            }
            if k + 1 < iterations.len() {
                self.closes(*part);
            }
        }
    }

    /// A stage begins, in a run that may have `more` forced responses; that before had so many points. What is left, where this
    /// says it anew.
    pub fn enters(&mut self, stage: Stage, points: u64, more: bool) -> Option<Left> {
        let after_update = self.leaves(points);
        self.stage = Some((stage, Instant::now()));
        if !self.begun {
            let prior = self.prior.as_ref()?;
            return Some(Left {
                rough: true,
                ..Left::new(prior.stage(stage), prior.after(stage))
            });
        }
        match stage {
            Stage::ForcedResponse if self.response.0 > 0.0 => {
                let (seconds, points) = self.response;
                // One of the steps is being made, and after the last nothing is left.
                let steps = match more {
                    true => (self.steps().unwrap_or(1.0) - 1.0).round(),
                    false => 0.0,
                };
                let last = if steps > 0.0 { WORN * seconds } else { 0.0 };
                Some(Left {
                    points,
                    ..Left::new(WORN * seconds, steps * self.step() + last)
                })
            }
            Stage::DynamicResponse => self.at_update(),
            _ => after_update,
        }
    }

    /// What is left if a vibration that begins is an update.
    fn at_update(&self) -> Option<Left> {
        let [first, _] = self.vibrations;
        if !self.updates || first == 0.0 {
            return None;
        }
        let part = GROWTH * self.parts.back()?;
        let said = self.said?;
        let others = said.seconds - self.updates_to_come(self.updated);
        let after = others.max(0.0) + self.updates_to_come(part) + said.after;
        Some(Left {
            rough: said.rough,
            ..Left::new(first * prior::update(part), after)
        })
    }

    /// Ends the stage that is computed; what is left after a vibration.
    fn leaves(&mut self, points: u64) -> Option<Left> {
        let (stage, since) = self.stage.take()?;
        let seconds = since.elapsed().as_secs_f64();
        let update = self.at_update();
        self.took(stage, seconds, points);
        if stage != Stage::DynamicResponse {
            return None;
        }
        match update {
            Some(left) if self.is_new(seconds) => Some(Left {
                rough: left.rough,
                ..Left::new(0.0, left.after)
            }),
            _ => self.said,
        }
    }

    fn is_new(&self, vibration: f64) -> bool {
        vibration > NEW * self.vibrations[0]
    }

    /// A stage took so long, with so many points of a forced response.
    fn took(&mut self, stage: Stage, seconds: f64, points: u64) {
        if let (Some(prior), false) = (&mut self.prior, self.begun) {
            prior.took(stage, seconds);
        }
        // Without a first one none is told apart.
        let is_told = !self.begun || self.vibrations[0] > 0.0;
        let current = &mut self.current;
        match stage {
            Stage::ForcedResponse if seconds > self.response.0 => self.response = (seconds, points),
            Stage::ForcedResponse => (),
            Stage::DynamicResponse if is_told => current.vibration += seconds,
            Stage::StaticContact | Stage::FrettingCycle => {
                current.step += seconds;
                current.contact += seconds;
            }
            _ => current.step += seconds,
        }
    }

    /// An iteration ends with such a part of the run behind it.
    fn closes(&mut self, part: f64) {
        let took = std::mem::take(&mut self.current);
        if !self.begun {
            // Also that of a run which begins from another: nothing of it is known.
            (self.begun, self.unworn) = (true, took);
            self.vibrations[0] = took.vibration;
        } else {
            self.iterations += 1;
            self.vibrations[1] += took.vibration;
            if self.is_new(took.vibration) {
                self.updated = part;
            }
            self.late.push_back(took);
            if self.late.len() > OF_LATE {
                self.late.pop_front();
            }
        }
        self.parts.push_back(part);
        if self.parts.len() > OF_LATE + 1 {
            self.parts.pop_front();
        }
    }

    /// An iteration is committed: the part of the run, and the cycles, that are behind it.
    pub fn committed(&mut self, part: f64, cycles: u64, points: u64) {
        self.leaves(points);
        self.closes(part);
        self.first.get_or_insert_with(Instant::now);
        self.cycles = Some([self.cycles.map_or(cycles, |[first, _]| first), cycles]);
    }

    /// Cycles a second since the first commit of this start; none before a step is done.
    pub fn rate(&self) -> Option<f64> {
        let [from, to] = self.cycles.filter(|[from, to]| to > from)?;
        Some((to - from) as f64 / self.first?.elapsed().as_secs_f64())
    }

    /// What is left after the commit of an iteration; none where nothing is known.
    pub fn left(&mut self, wear_iteration: u64) -> Option<Left> {
        let own = self.steps();
        // Of a run that goes on the prior knows no part.
        let begun = self.parts.front().is_some_and(|part| *part == 0.0);
        let prior = self.prior.as_ref().filter(|_| begun);
        let expected = prior.map(|prior| {
            let steps = (STEPS - self.iterations as f64).max(1.0);
            [steps, prior.step]
        });
        let [steps, step] = match (own.map(|steps| [steps, self.step()]), expected) {
            (Some(own), Some(expected)) if self.iterations < KNOWN => {
                // The logarithms of both, by how many steps have shown it.
                let weight = self.iterations as f64 / KNOWN as f64;
                let mean = |k: usize| own[k].powf(weight) * expected[k].powf(1.0 - weight);
                [mean(0), mean(1)]
            }
            (Some(own), _) => own,
            (None, expected) => expected?,
        };
        let curves = curves_ahead(wear_iteration, steps, self.curves_every);
        let contact = median(self.late.iter().map(|took| took.contact));
        let curve = (self.unworn.contact - contact).max(0.0);
        let seconds = steps * step + curves * curve + self.updates_to_come(self.updated);
        let last = WORN * self.response.0;
        self.said = Some(Left {
            rough: own.is_none(),
            ..Left::new(seconds, last)
        });
        self.said
    }

    fn steps(&self) -> Option<f64> {
        steps_left(self.parts.iter().copied().collect::<Vec<f64>>().as_slice())
    }

    /// Seconds of an iteration of late, without its vibration and forced response: not the mean, since few have curves.
    fn step(&self) -> f64 {
        median(self.late.iter().map(|took| took.step))
    }

    /// Seconds of the vibrations at updates to come, of which the last had such a part of the run behind it.
    fn updates_to_come(&self, last: f64) -> f64 {
        let part = self.parts.back().copied().unwrap_or(0.0);
        let [first, later] = self.vibrations;
        if !self.updates || first == 0.0 {
            return 0.0;
        }
        let expected = first * (prior::updates_between(0.0, part) + EXPECTED);
        let ratio = (later + EXPECTED * first) / expected;
        ratio * first * prior::updates_to_come(part, last)
    }
}

/// Iterations with curves among so many steps behind an iteration: every so many, and the last.
fn curves_ahead(wear_iteration: u64, steps: f64, every: u64) -> f64 {
    if every == 0 {
        return 0.0;
    }
    let last = wear_iteration + steps.round() as u64;
    (last.div_ceil(every) - wear_iteration / every) as f64
}

/// 0 of nothing.
fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    match (values.len(), values.len() / 2) {
        (0, _) => 0.0,
        (all, half) if all % 2 == 0 => 0.5 * (values[half - 1] + values[half]),
        (_, half) => values[half],
    }
}

impl Left {
    fn new(seconds: f64, after: f64) -> Left {
        Left {
            since: Instant::now(),
            seconds,
            after,
            rough: false,
            points: 0,
        }
    }

    /// Seconds to the end of the run, with as many points of a forced response done.
    pub fn now(&self, points: u64) -> f64 {
        self.at(self.since.elapsed().as_secs_f64(), points)
    }

    fn at(&self, elapsed: f64, points: u64) -> f64 {
        let least = LAST * elapsed;
        let by_time = (self.seconds - elapsed).max(least);
        if self.points == 0 {
            return by_time + self.after;
        }
        let part = self.points as f64 / points.max(1) as f64 - 1.0;
        let by_points = (elapsed * part).max(least);
        let (is_quick, is_late) = (by_points < QUICK * by_time, by_time == least);
        let own = match points >= TELLING && (is_quick || is_late) {
            true => by_points,
            // The nearer the end, the more its points tell.
            false => {
                let done = (points as f64 / self.points as f64).min(1.0).powi(2);
                by_time + done * (by_points - by_time)
            }
        };
        own + self.after
    }
}

/// Steps to 1 from the last of `parts`, if their lengths go on growing as they do; none if there is no step, or none that is any.
fn steps_left(parts: &[f64]) -> Option<f64> {
    let steps = parts.len().checked_sub(1).filter(|steps| *steps > 0)?;
    let [first, last] = [parts[0], parts[steps]];
    let half = steps / 2;
    let growth = match half {
        // Of two steps the second may be short for an update of the model.
        0 | 1 => GROWTH,
        _ => {
            let middle = parts[steps - half];
            let before = parts[steps - 2 * half];
            ((last - middle) / (middle - before)).powf(1.0 / half as f64)
        }
    };
    // No wear in the first half: nothing is known of growth.
    let growth = if growth.is_finite() {
        growth.clamp(1.0, MOST_GROWTH)
    } else {
        GROWTH
    };
    let next = (last - first) / steps as f64 * growth.powf((steps + 1) as f64 / 2.0);
    let ratio = Some((1.0 - last) / next).filter(|ratio| ratio.is_finite() && *ratio >= 0.0)?;
    Some(if growth - 1.0 < 1e-3 {
        ratio.max(1.0)
    } else {
        ((1.0 + ratio * (growth - 1.0)).ln() / growth.ln()).max(1.0)
    })
}

#[cfg(test)]
mod tests {
    use fretwear::stages::Stage;

    use super::{KNOWN, Left, Pace, curves_ahead, median, steps_left};

    /// By which factor the time to go may be off.
    const OFF: f64 = 1.5;

    /// Iterations of a run: the part behind each, and seconds of wear, contact, vibration and forced response.
    type Course = &'static [[f64; 5]];
    /// A prescribed motion on 512 x 512 cells: contacts with curves are few, at every tenth iteration and the last.
    const CURVES: Course = &[
        [0.0, 0.04, 2.19, 0.0, 0.0],
        [0.0058, 0.60, 0.43, 0.0, 0.0],
        [0.0151, 0.38, 0.30, 0.0, 0.0],
        [0.0269, 0.64, 0.39, 0.0, 0.0],
        [0.0414, 0.57, 0.38, 0.0, 0.0],
        [0.0596, 0.53, 0.49, 0.0, 0.0],
        [0.0831, 0.63, 0.56, 0.0, 0.0],
        [0.1145, 0.58, 0.49, 0.0, 0.0],
        [0.1589, 0.65, 0.52, 0.0, 0.0],
        [0.2248, 0.66, 0.53, 0.0, 0.0],
        [0.3330, 0.61, 1.81, 0.0, 0.0],
        [0.5359, 0.84, 0.72, 0.0, 0.0],
        [0.7679, 0.79, 0.70, 0.0, 0.0],
        [1.0, 0.66, 1.85, 0.0, 0.0],
    ];
    /// A lap joint with the preset fast: vibrations are few, and longer the more is worn.
    const UPDATES: Course = &[
        [0.0, 0.53, 0.51, 8.1, 9.6],
        [0.0025, 0.34, 0.35, 0.0, 0.0],
        [0.0066, 1.21, 0.33, 4.0, 0.0],
        [0.0163, 0.42, 0.36, 0.0, 0.0],
        [0.0184, 0.86, 0.28, 7.6, 0.0],
        [0.0360, 0.43, 0.35, 0.0, 0.0],
        [0.0632, 0.94, 0.26, 8.5, 0.0],
        [0.1204, 0.44, 0.34, 0.0, 0.0],
        [0.2510, 0.35, 0.25, 0.0, 0.0],
        [0.3300, 1.00, 0.25, 15.4, 0.0],
        [0.5533, 0.46, 0.46, 0.0, 0.0],
        [0.8576, 1.29, 0.27, 17.1, 0.0],
        [1.0, 0.32, 0.45, 0.0, 22.2],
    ];

    fn stages_of(iteration: &[f64; 5]) -> (Vec<(Stage, f64)>, f64) {
        let [part, wear, contact, vibration, response] = *iteration;
        let stages = vec![
            (Stage::Wear, wear),
            (Stage::StaticContact, contact),
            (Stage::DynamicResponse, vibration),
            (Stage::ForcedResponse, response),
        ];
        (stages, part)
    }

    /// Where one long stage is left, or two, no mean of many says it.
    #[test]
    fn what_is_left_of_runs_is_known_within_a_factor() {
        for (course, updates) in [(CURVES, false), (UPDATES, true)] {
            let all: Vec<_> = course.iter().map(stages_of).collect();
            for k in KNOWN..course.len() - 1 {
                let mut pace = Pace::new(None, 10, updates);
                pace.recorded(&all[..=k]);
                pace.committed(course[k][0], 0, 0);
                let said = pace.left(k as u64).expect("steps").at(0.0, 0);
                let ahead = course[k + 1..].iter().flat_map(|i| &i[1..]);
                let rest: f64 = ahead.sum();
                assert!(
                    (rest / OFF..rest * OFF).contains(&said),
                    "{said} s said of {rest} s behind iteration {k}"
                );
            }
        }
    }

    /// A vibration that is computed anew is counted down from what it takes, and one that is not changes nothing.
    #[test]
    fn an_update_is_counted_down() {
        let all: Vec<_> = UPDATES[..10].iter().map(stages_of).collect();
        let mut pace = Pace::new(None, 10, true);
        pace.recorded(&all);
        pace.committed(UPDATES[9][0], 0, 0);
        let said = pace.left(9).expect("steps");
        let update = pace.enters(Stage::DynamicResponse, 0, false);
        let update = update.expect("a vibration");
        assert!(
            update.at(10.0, 0) < update.at(0.0, 0) - 9.9,
            "it is under way"
        );
        let after = pace.enters(Stage::FrettingCycle, 0, false);
        let after = after.expect("said again");
        assert_eq!(after.at(0.0, 0), said.at(0.0, 0), "it took no time");
    }

    #[test]
    fn curves_are_counted_once() {
        assert_eq!(curves_ahead(8, 5.0, 10), 2.0);
        assert_eq!(curves_ahead(10, 4.0, 10), 1.0);
        assert_eq!(curves_ahead(15, 5.0, 10), 1.0);
        assert_eq!(curves_ahead(3, 5.0, 0), 0.0);
        assert_eq!(median([3.0, 1.0, 9.0].into_iter()), 3.0);
        assert_eq!(median([3.0, 1.0].into_iter()), 2.0);
    }

    #[test]
    fn a_forced_response_is_timed_by_its_points_and_never_over() {
        let response = Left {
            points: 50,
            ..Left::new(30.0, 2.0)
        };
        let close = |elapsed, points, expected: f64| {
            let left = response.at(elapsed, points);
            assert!((left - expected).abs() < 1e-9, "{left} of {expected}");
        };
        close(0.0, 0, 32.0);
        // Between the 10 s of the time and the 20 s of the points.
        close(20.0, 25, 14.5);
        // Half of the points after more than was expected: as long again.
        close(40.0, 25, 42.0);
        // Half of the points in a tenth of the time.
        close(3.0, 25, 5.0);
        // More points than the one before had.
        close(40.0, 60, 4.0);
    }

    #[test]
    fn what_is_no_forced_response_is_counted_down_and_never_over() {
        let left = Left::new(10.0, 5.0);
        assert_eq!(left.at(4.0, 0), 11.0);
        assert_eq!(left.at(20.0, 0), 6.0);
    }

    #[test]
    fn steps_that_grow_by_a_ratio_are_counted_to_the_end() {
        // 0.01 (1 + 1.3 + …): the sum of n is 0.01 (1.3ⁿ − 1) / 0.3.
        let part = |n: i32| 0.01 * (1.3f64.powi(n) - 1.0) / 0.3;
        let parts: Vec<f64> = (3..8).map(part).collect();
        let all = (1.0f64 + 0.3 / 0.01).ln() / 1.3f64.ln();
        let left = steps_left(&parts).expect("steps");
        assert!((left - (all - 7.0)).abs() < 0.5, "{left} of {}", all - 7.0);
    }

    #[test]
    fn equal_steps_are_counted_and_none_are_unknown() {
        let left = steps_left(&[0.1, 0.2, 0.3, 0.4, 0.5]).expect("steps");
        assert!((left - 5.0).abs() < 1e-9, "{left}");
        assert_eq!(steps_left(&[0.1]), None);
        assert_eq!(steps_left(&[0.1, 0.1]), None);
        assert_eq!(steps_left(&[]), None);
    }
}
