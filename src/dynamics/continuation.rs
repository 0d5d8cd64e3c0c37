//! A branch of responses over a range of frequencies, through turning points: pseudo-arclength continuation.
//!
//! The curve that is followed is (cosine, sine) of the first harmonic at one port, scaled by the largest amplitude so far, and ω, scaled by
//! the width of the range; it does not depend on which elements are active. It has (cosine, sine) of every harmonic that is loaded at a port
//! too: a resonance along another axis may bend over and lift the contact off, of which the response alone shows nothing. Steps go along the secant;
//! `predictor.rs` predicts the response there. From a phase resonance the first step follows the change of its phase.

use std::collections::VecDeque;

use num_complex::Complex64;

use super::aft::InterfaceElement;
use super::effort::Effort;
use super::forced_response::gives_energy;
use super::newton::{Condition, Frame, Term};
use super::predictor::{REMEMBERED, extrapolated_number, extrapolated_start};
use super::{DynamicsError, HarmonicBalance, Response, Start};
use crate::journal::Journal;

/// Cosine of the angle between secants beyond which a step is taken again at half its length.
const SHARPEST: f64 = 0.85;
/// Steps below this multiple of the least are accepted whatever their angle: the curve has kinks where slip begins.
const KINK: f64 = 32.0;
/// Newton iterations up to which the step grows.
const EASY: usize = 4;
/// Newton iterations up to which the step grows where some of them keep a Jacobian.
const EASY_CHORDS: usize = 7;
/// Distance of two responses at one frequency, relative to their largest coefficient, from which on they are not the same.
const DIFFERENT: f64 = 1e-3;
/// The first step from a phase resonance, in parts of the largest.
const FIRST_FROM_RESONANCE: f64 = 0.85;
/// Length of a step from a phase resonance, times the root of the curvature of the curve: monotone cubics between the points are within some
/// 0.2 % of the peak, as the two cubes of a flank and the square of a top are.
const BEND: f64 = 0.19;
/// Parts of the way between the last two frequencies in which the next is looked for, how many such ways at most, and halvings of the part.
const STRIDES: usize = 8;
const FARTHEST: usize = 3;
const HALVINGS: usize = 30;
/// Most points of the branch from a phase resonance to an end of the range: one that turns in itself has no end.
const MOST_OF_HALF: usize = 300;
/// Points in a row at which friction gives energy, after which a branch ends: where it gives what dampers take, the amplitude grows along
/// the branch without bound.
const UNPHYSICAL: usize = 50;

/// How a branch is followed. Lengths are in units of the scaled curve, whose frequency axis has length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuationSettings {
    /// Angular frequency of the first point \[rad/s\].
    pub from: f64,
    /// Angular frequency that ends the branch \[rad/s\]; below `from` for a sweep downwards.
    pub to: f64,
    /// Port whose first harmonic is followed.
    pub port: usize,
    /// Length of the first step; 1/60 of the range is a usual resolution.
    pub step: f64,
    /// Least length before giving up.
    pub least_step: f64,
    /// Largest length: resolution where the curve is straight.
    pub largest_step: f64,
    /// Most points, the first included.
    pub most_points: usize,
}

impl ContinuationSettings {
    /// Over a range, looking at `port`, with usual steps.
    pub fn over(from: f64, to: f64, port: usize) -> ContinuationSettings {
        ContinuationSettings {
            from,
            to,
            port,
            step: 1.0 / 60.0,
            least_step: 1e-7,
            largest_step: 1.0 / 20.0,
            most_points: 2000,
        }
    }
}

/// Iterator over the points of a branch. It ends at `to`, at its return beyond `from`, where friction gives energy throughout, or after
/// `most_points`; after an error it yields nothing more.
pub struct Continuation<'a, E> {
    balance: &'a HarmonicBalance<E>,
    settings: ContinuationSettings,
    /// Port and slot of each pair of coefficients on the curve; the first is that of the settings' port.
    watched: Vec<(usize, usize)>,
    /// Angular frequencies that make the length 1 of the scaled curve \[rad/s\].
    width: f64,
    state: Progress,
    /// Whether the solver of a step goes on from that of the step before.
    keeps_frame: bool,
}

enum Progress {
    Start,
    Underway(Box<Branch>),
    Done,
}

struct Branch {
    now: Response,
    /// The points before, the last of them last, as many as foretell the next.
    past: VecDeque<Response>,
    step: f64,
    /// Largest amplitude so far of each pair \[m\].
    largest: Vec<f64>,
    points: usize,
    /// How many of the last points in a row are no motion, as friction gives energy there.
    unphysical: usize,
    /// Where the first step goes, and the angle by which its motion is later, for a step of length 1 \[rad\]; along the frequency if none.
    heading: Option<(Vec<f64>, f64)>,
    /// The solver of the last step, from which that of the next goes on.
    frame: Option<Frame>,
}

impl<'a, E: InterfaceElement> Continuation<'a, E> {
    /// The branch of `balance` that `settings` describe.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`], [`DynamicsError::HarmonicMissing`].
    pub fn new(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
    ) -> Result<Continuation<'a, E>, DynamicsError> {
        for (name, value) in [
            ("the first angular frequency", settings.from),
            ("the last angular frequency", settings.to),
            ("the least step of the continuation", settings.least_step),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(DynamicsError::OutOfRange {
                    name,
                    value,
                    expected: "a positive finite number",
                });
            }
        }
        if settings.from == settings.to {
            return Err(DynamicsError::OutOfRange {
                name: "the last angular frequency",
                value: settings.to,
                expected: "different from the first",
            });
        }
        if settings.port >= balance.model.ports() {
            return Err(DynamicsError::OutOfRange {
                name: "the port that is followed",
                value: settings.port as f64,
                expected: "the index of a port of the structure",
            });
        }
        Ok(Continuation {
            balance,
            settings,
            watched: balance.watched(settings.port)?,
            width: (settings.to - settings.from).abs(),
            state: Progress::Start,
            keeps_frame: false,
        })
    }

    /// The point of the branch through `now` at `settings.to`, reached over turning points if need be; `before` is an earlier
    /// point of it.
    ///
    /// # Errors
    /// [`DynamicsError::NoResonance`] if the branch returns beyond `settings.from`, those of [`Self::new`] and of a step.
    pub(super) fn reach(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        before: Option<&Response>,
        now: &Response,
        width: f64,
    ) -> Result<Response, DynamicsError> {
        let mut path = Continuation::onwards(balance, settings, before, now)?;
        path.width = width;
        for response in path {
            let response = response?;
            if response.omega == settings.to {
                return Ok(response);
            }
        }
        let turn = 2.0 * std::f64::consts::PI;
        Err(DynamicsError::NoResonance {
            what: "continuous branch",
            from: now.frequency(),
            to: settings.to / turn,
        })
    }

    /// The branch of [`Self::new`] from `now` on; `before` is an earlier point of it. `now` is none of its points.
    ///
    /// # Errors
    /// Those of [`Self::new`].
    pub(super) fn onwards(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        before: Option<&Response>,
        now: &Response,
    ) -> Result<Continuation<'a, E>, DynamicsError> {
        let mut path = Continuation::new(balance, settings)?;
        let largest = path.sizes(now);
        let largest = before.map_or(largest.clone(), |before| path.larger(&largest, before));
        path.state = Progress::Underway(Box::new(Branch {
            now: now.clone(),
            past: before.cloned().into_iter().collect(),
            step: settings.step,
            largest,
            points: 1,
            unphysical: 0,
            heading: None,
            frame: None,
        }));
        Ok(path)
    }

    /// The branch of [`Self::new`] from a phase resonance on, which is none of its points; it begins along the turn of the phase of the drive.
    fn from_resonance(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        resonance: &Response,
    ) -> Option<Continuation<'a, E>> {
        let mut path = Continuation::onwards(balance, settings, None, resonance).ok()?;
        path.keeps_frame = true;
        let place = path.driven()?;
        let Progress::Underway(branch) = &mut path.state else {
            return None;
        };
        let width = 2 * path.watched.len() + 1;
        let n = balance.harmonics().coefficients();
        let (port, slot) = path.watched[place];
        let row = &resonance.displacement[port * n..];
        let (a, b) = (row[slot], row[slot + 1]);
        let size = a.hypot(b);
        // The lag grows with frequency.
        let direction = (settings.to - settings.from).signum();
        let mut along = vec![0.0; width];
        along[2 * place] = -direction * b / size;
        along[2 * place + 1] = direction * a / size;
        branch.heading = (size > 0.0).then_some((along, direction));
        branch.heading.is_some().then_some(path)
    }

    /// Which of the pairs is that of the drive.
    fn driven(&self) -> Option<usize> {
        let drive = self.balance.drive()?;
        let slot = self.balance.harmonics().slot_of(1)?;
        self.watched.iter().position(|of| *of == (drive.port, slot))
    }

    /// The point of the curve, scaled: the pairs, then the frequency.
    fn point(&self, response: &Response, largest: &[f64]) -> Vec<f64> {
        let pairs = self.pairs(response).zip(largest);
        let scaled = pairs.flat_map(|(pair, &largest)| {
            let scale = if largest > 0.0 { largest } else { 1.0 };
            pair.map(|value| value / scale)
        });
        scaled.chain([response.omega / self.width]).collect()
    }

    /// Lengths of the curve up to each of some responses on it.
    fn lengths(&self, responses: &[&Response], largest: &[f64]) -> Vec<f64> {
        let points: Vec<Vec<f64>> = responses.iter().map(|r| self.point(r, largest)).collect();
        let steps = points.windows(2).map(|pair| distance(&pair[1], &pair[0]));
        let sums = steps.scan(0.0, |length, step| {
            *length += step;
            Some(*length)
        });
        [0.0].into_iter().chain(sums).collect()
    }

    fn pairs(&self, response: &Response) -> impl Iterator<Item = [f64; 2]> {
        let n = self.balance.harmonics().coefficients();
        let watched = self.watched.iter();
        watched.map(move |&(port, slot)| {
            let row = &response.displacement[port * n..];
            [row[slot], row[slot + 1]]
        })
    }

    /// Amplitudes of the pairs \[m\].
    fn sizes(&self, response: &Response) -> Vec<f64> {
        self.pairs(response).map(|[a, b]| a.hypot(b)).collect()
    }

    /// The larger of each amplitude and that of a response.
    fn larger(&self, largest: &[f64], response: &Response) -> Vec<f64> {
        let sizes = self.sizes(response).into_iter().zip(largest);
        sizes.map(|(size, largest)| size.max(*largest)).collect()
    }

    fn advance(&self, mut branch: Branch) -> Result<Branch, DynamicsError> {
        let settings = &self.settings;
        let direction = (settings.to - settings.from).signum();
        let width = self.width;
        let here = self.point(&branch.now, &branch.largest);
        let tangent = match (branch.past.back(), &branch.heading) {
            (None, Some((along, _))) => along.clone(),
            (None, None) => {
                let mut along = vec![0.0; here.len()];
                along[here.len() - 1] = direction;
                along
            }
            (Some(before), _) => {
                let there = self.point(before, &branch.largest);
                unit(&here, &there)
            }
        };
        let by_omega = tangent[tangent.len() - 1];
        let mut step = branch.step;
        let mut frame = branch.frame.take();
        loop {
            let target = branch.now.omega + step * by_omega * width;
            let ends = direction * (target - settings.to) >= 0.0;
            let attempt = if ends {
                self.at_end(&branch, None)
            } else {
                self.correct(&branch, &here, &tangent, step, &mut frame)
            };
            let attempt = match attempt {
                Ok(next) if self.keeps_frame && direction * (next.omega - settings.to) > 0.0 => {
                    self.at_end(&branch, Some(&next))
                }
                attempt => attempt,
            };
            let last = match attempt {
                Ok(next) => {
                    let largest = self.larger(&branch.largest, &next);
                    let there = self.point(&next, &largest);
                    let from = self.point(&branch.now, &largest);
                    let secant = unit(&there, &from);
                    let straight = match branch.past.back() {
                        None => 1.0,
                        Some(before) => {
                            let old = unit(&from, &self.point(before, &largest));
                            old.iter().zip(&secant).map(|(a, b)| a * b).sum()
                        }
                    };
                    let long = distance(&there, &from) > 4.0 * step.max(settings.least_step);
                    if (straight >= SHARPEST && !long) || step <= KINK * settings.least_step {
                        let most = if self.balance.is_costly {
                            EASY_CHORDS
                        } else {
                            EASY
                        };
                        let easy = next.iterations <= most && straight > 0.5 * (1.0 + SHARPEST);
                        let growth = if easy { 1.4 } else { 1.0 };
                        let mut longest = settings.largest_step;
                        if let (true, Some(before)) = (self.keeps_frame, branch.past.back()) {
                            let before = self.point(before, &largest);
                            let length = distance(&there, &from) + distance(&from, &before);
                            let curvature = 2.0 * f64::min(straight, 1.0).acos() / length;
                            longest = longest.min(BEND / curvature.sqrt());
                        }
                        let unphysical = match gives_energy(&next) {
                            true => branch.unphysical + 1,
                            false => 0,
                        };
                        let mut past = branch.past;
                        past.push_back(branch.now);
                        if past.len() >= REMEMBERED {
                            past.pop_front();
                        }
                        return Ok(Branch {
                            now: next,
                            past,
                            step: (step * growth).min(longest),
                            largest,
                            points: branch.points + 1,
                            unphysical,
                            heading: None,
                            frame: frame.filter(|_| self.keeps_frame),
                        });
                    }
                    None
                }
                Err(error) => Some(error),
            };
            step *= 0.5;
            if step < settings.least_step {
                let frequency = branch.now.frequency();
                return Err(DynamicsError::StepTooSmall {
                    frequency,
                    step,
                    least: settings.least_step,
                    last: Box::new(last.unwrap_or(DynamicsError::NoResonance {
                        what: "continuous branch",
                        from: frequency,
                        to: settings.to / (2.0 * std::f64::consts::PI),
                    })),
                });
            }
        }
    }

    /// The point of the branch in the plane across `tangent` at the distance `step`.
    fn correct(
        &self,
        branch: &Branch,
        here: &[f64],
        tangent: &[f64],
        step: f64,
        frame: &mut Option<Frame>,
    ) -> Result<Response, DynamicsError> {
        let width = self.width;
        let by_omega = tangent[tangent.len() - 1];
        let ahead = here.iter().zip(tangent);
        let value: f64 = ahead.map(|(here, t)| t * (here + step * t)).sum();
        let watched = self.watched.iter().zip(&branch.largest);
        let terms = watched.zip(tangent.chunks_exact(2));
        let terms = terms.map(|((&(port, slot), &largest), along)| {
            let scale = if largest > 0.0 { largest } else { 1.0 };
            Term {
                port,
                slot,
                weights: [along[0] / scale, along[1] / scale],
            }
        });
        let condition = Condition::Linear {
            terms: terms.collect(),
            by_omega: by_omega / width,
            value,
        };
        let ahead = match self.keeps_frame {
            true => self.ahead_in_plane(branch, here, tangent, step),
            false => None,
        };
        let ahead = ahead.or_else(|| self.ahead(branch, step));
        let guess = ahead.unwrap_or_else(|| {
            let now = branch.now.start();
            let mut guess = match &branch.heading {
                Some((_, angle)) => now.turned(self.balance.harmonics(), angle * step, 1.0),
                None => now,
            };
            guess.omega = branch.now.omega + step * by_omega * width;
            guess
        });
        let start = self.balance.start_from(&guess, guess.omega, 1.0)?;
        if !self.keeps_frame {
            return self.balance.newton(start, 1.0, &condition);
        }
        let tolerance = self.balance.settings.tolerance;
        self.balance
            .newton_from(frame, tolerance, start, 1.0, &condition)
    }

    /// The response that the points so far predict at a distance along the branch; none from a single point.
    fn ahead(&self, branch: &Branch, step: f64) -> Option<Start> {
        let known: Vec<&Response> = branch.past.iter().chain([&branch.now]).collect();
        let places = self.lengths(&known, &branch.largest);
        let starts: Vec<Start> = known.iter().map(|response| response.start()).collect();
        let ahead = extrapolated_start(&starts, &places, places[places.len() - 1] + step);
        ahead.filter(|start| start.omega > 0.0)
    }

    /// What the points so far foretell of that at the angular frequency that `find` makes of the one of the last point, a stride towards the next,
    /// and the displacement over frequency. It is the inverse of the dynamic stiffness at the port, which over a resonance bends by little: that of
    /// a linear one is a straight line. Displacements are seen from the phase and the amplitude there. None
    /// where the frequency turns back, or where more than one pair of coefficients is followed.
    fn ahead_by_stiffness(
        &self,
        branch: &Branch,
        find: impl FnOnce(f64, f64, &dyn Fn(f64) -> Option<Complex64>) -> Option<f64>,
    ) -> Option<Start> {
        let harmonics = self.balance.harmonics();
        let n = harmonics.coefficients();
        let [(port, slot)] = self.watched[..] else {
            return None;
        };
        let known: Vec<&Response> = branch.past.iter().chain([&branch.now]).collect();
        let (now, before) = (branch.now.omega, branch.past.back()?.omega);
        let is_onwards =
            |pair: &&[&Response]| (pair[1].omega - pair[0].omega) * (now - before) > 0.0;
        let onwards = known.windows(2).rev().take_while(is_onwards).count();
        let known = &known[known.len() - 1 - onwards..];
        let omegas: Vec<f64> = known.iter().map(|response| response.omega).collect();
        let displacement = |response: &&Response| {
            let row = &response.displacement[port * n..];
            Complex64::new(row[slot], row[slot + 1])
        };
        let displacements: Vec<Complex64> = known.iter().map(displacement).collect();
        let stiffness: Vec<Complex64> = displacements.iter().map(Complex64::inv).collect();
        let stiffness = extrapolated_number(&stiffness, &omegas)?;
        let over_frequency = |omega: f64| Some(stiffness(omega)?.inv());
        let omega = find(now, now - before, &over_frequency)?;
        let seen = known.iter().zip(&displacements);
        let seen: Vec<Start> = seen
            .map(|(response, u)| response.start().turned(harmonics, -u.arg(), 1.0 / u.norm()))
            .collect();
        let u = over_frequency(omega)?;
        let mut ahead = extrapolated_start(&seen, &omegas, omega)?;
        ahead = ahead.turned(harmonics, u.arg(), u.norm());
        // Friction locks means in: one that was not foretold better than it stayed stays.
        let (last, earlier) = seen.split_last()?;
        let told = extrapolated_start(earlier, &omegas[..earlier.len()], now);
        let stayed = earlier.last()?;
        for (place, row) in ahead.displacement.chunks_mut(n).enumerate() {
            let mean = |start: &Start| start.displacement[place * n];
            let missed = |start: &Start| (mean(start) - mean(last)).abs();
            if told
                .as_ref()
                .is_none_or(|told| missed(told) >= missed(stayed))
            {
                row[0] = mean(last);
            }
        }
        ahead.omega = omega;
        let is_number = ahead.displacement.iter().all(|u| u.is_finite());
        (is_number && omega > 0.0).then_some(ahead)
    }

    /// As [`Self::ahead_by_stiffness`], in the plane across `tangent` at the distance `step`.
    fn ahead_in_plane(
        &self,
        branch: &Branch,
        here: &[f64],
        tangent: &[f64],
        step: f64,
    ) -> Option<Start> {
        let (&[c, s, w], &[along_c, along_s, along_w]) = (here, tangent) else {
            return None;
        };
        self.ahead_by_stiffness(branch, |now, stride, displacement| {
            let beyond = |omega: f64| {
                let u = displacement(omega)? / branch.largest[0];
                let w = omega / self.width - w;
                Some(along_c * (u.re - c) + along_s * (u.im - s) + along_w * w - step)
            };
            let stride = stride / STRIDES as f64;
            let mut ends = [now, now];
            for k in 1..=FARTHEST * STRIDES {
                ends = [ends[1], now + k as f64 * stride];
                if beyond(ends[1])? >= 0.0 {
                    break;
                }
            }
            for _ in 0..HALVINGS {
                let middle = 0.5 * (ends[0] + ends[1]);
                let place = usize::from(beyond(middle)? >= 0.0);
                ends[place] = middle;
            }
            (beyond(ends[1])? >= 0.0).then_some(ends[1])
        })
    }

    /// The point at the end of the range; `beyond` is one of the branch behind it, if there is one.
    fn at_end(
        &self,
        branch: &Branch,
        beyond: Option<&Response>,
    ) -> Result<Response, DynamicsError> {
        let end = self.settings.to;
        let ahead = match beyond {
            Some(beyond) => {
                let starts = [branch.now.start(), beyond.start()];
                extrapolated_start(&starts, &[branch.now.omega, beyond.omega], end)
            }
            None if self.keeps_frame => self.ahead_by_stiffness(branch, |_, _, _| Some(end)),
            None => None,
        };
        let near = ahead.and_then(|ahead| self.balance.solve_near(end, &ahead).ok());
        match near {
            Some(response) => Ok(response),
            None => self.balance.solve(end, Some(&branch.now.start())),
        }
    }
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Port and slot of what a branch is followed by: the first harmonic at `port`, and what is loaded beside it.
    fn watched(&self, port: usize) -> Result<Vec<(usize, usize)>, DynamicsError> {
        let mut watched = vec![(port, self.harmonics().require(1, "continuation")?)];
        let n = self.harmonics().coefficients();
        let inertial = self
            .inertial_rows
            .chunks(n)
            .map(Some)
            .chain(std::iter::repeat(None));
        let rows = self.load_rows.chunks(n).zip(inertial);
        for (&port, (row, inertial)) in self.load_ports.iter().zip(rows) {
            for slot in (1..n).step_by(2) {
                let loaded = |row: &[f64]| row[slot] != 0.0 || row[slot + 1] != 0.0;
                if (loaded(row) || inertial.is_some_and(loaded)) && !watched.contains(&(port, slot))
                {
                    watched.push((port, slot));
                }
            }
        }
        Ok(watched)
    }

    /// The responses over the range of `settings`, from its one end to the other, turning points included.
    ///
    /// A branch may have a corner, where lift-off begins or a slider is set free, from which it goes on in a direction that no
    /// step from there finds. It is then followed from the other end, and where that stops too, the two parts stand one after
    /// the other: what connects them is left out, but every frequency of the range has a response.
    ///
    /// # Errors
    /// That of [`Continuation`] where the parts leave out a frequency.
    pub fn branch(&self, settings: ContinuationSettings) -> Result<Vec<Response>, DynamicsError> {
        let (mut parts, stopped) = self.parts(settings, &|_| None)?;
        let Some(error) = stopped else {
            return Ok(parts.swap_remove(0));
        };
        let direction = (settings.to - settings.from).signum();
        let [there, rest] = &mut parts[..] else {
            return Err(error);
        };
        match (there.last(), rest.first()) {
            (Some(end), Some(start)) if direction * (end.omega - start.omega) >= 0.0 => {
                there.append(rest);
                Ok(std::mem::take(there))
            }
            _ => Err(error),
        }
    }

    /// The branch over the range of `settings`, or, where it cannot be followed throughout, its parts from both ends and why the first
    /// goes no further. All points are in the order from the one end to the other. Where the branch from the other end goes all the way, but
    /// arrives at another response than the first part begins with, that part comes second. Where Newton's method does not find the first response
    /// of a part, `easily` may.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`], [`DynamicsError::HarmonicMissing`].
    #[allow(clippy::type_complexity)]
    pub fn parts(
        &self,
        settings: ContinuationSettings,
        easily: &dyn Fn(f64) -> Option<Response>,
    ) -> Result<(Vec<Vec<Response>>, Option<DynamicsError>), DynamicsError> {
        let (there, stopped) = self.part(settings, easily)?;
        let Some(error) = stopped else {
            return Ok((vec![there], None));
        };
        let back = ContinuationSettings {
            from: settings.to,
            to: settings.from,
            ..settings
        };
        let (mut rest, stopped) = self.part(back, easily)?;
        rest.reverse();
        match stopped {
            // Where the range begins, the part from there may be another branch, which turns back.
            None => match (there.first(), rest.first()) {
                (Some(a), Some(b)) if differ(a, b) => Ok((vec![rest, there], None)),
                _ => Ok((vec![rest], None)),
            },
            Some(_) => Ok((vec![there, rest], Some(error))),
        }
    }

    /// A branch as far as it can be followed, and why no further. Of one that returns, the part up to where it turns.
    fn part(
        &self,
        settings: ContinuationSettings,
        easily: &dyn Fn(f64) -> Option<Response>,
    ) -> Result<(Vec<Response>, Option<DynamicsError>), DynamicsError> {
        let first = match self.solve(settings.from, None) {
            Ok(first) => first,
            Err(error) => match easily(settings.from) {
                Some(first) => first,
                None => return Ok((Vec::new(), Some(error))),
            },
        };
        self.gauge.add_point(first.omega);
        let path = Continuation::onwards(self, settings, None, &first)?;
        let mut points = vec![first];
        for response in path {
            match response {
                Ok(response) => {
                    self.gauge.add_point(response.omega);
                    points.push(response);
                }
                Err(error) => return Ok((points, Some(error))),
            }
        }
        if points.last().is_some_and(|last| last.omega == settings.to) {
            return Ok((points, None));
        }
        let direction = (settings.to - settings.from).signum();
        let reached = |response: &Response| direction * response.omega;
        let returned = points.last().map(reached) < Some(direction * settings.from);
        if returned {
            let farthest = points.iter().map(reached).fold(f64::NEG_INFINITY, f64::max);
            let turn = points.iter().position(|r| reached(r) >= farthest);
            points.truncate(turn.map_or(0, |turn| turn + 1));
        }
        let hertz = 2.0 * std::f64::consts::PI;
        let error = DynamicsError::NoResonance {
            what: "continuous branch",
            from: settings.from / hertz,
            to: settings.to / hertz,
        };
        Ok((points, Some(error)))
    }
}

impl<E: InterfaceElement + Clone> HarmonicBalance<E> {
    /// The branch over the range of `settings` through a phase resonance, from the lower end to the upper: followed from there both ways, at
    /// the same time where there are threads. None where one of the ways does not reach its end, or is not known to.
    pub(super) fn through(
        &self,
        settings: ContinuationSettings,
        resonance: &Response,
    ) -> Option<Vec<Response>> {
        let (low, high) = (
            settings.from.min(settings.to),
            settings.from.max(settings.to),
        );
        let ways = [(high, low), (low, high)].map(|(from, to)| ContinuationSettings {
            from,
            to,
            step: FIRST_FROM_RESONANCE * settings.largest_step,
            most_points: MOST_OF_HALF,
            ..settings
        });
        let follow = || {
            let parts = self.threads.map(ways, |settings| {
                let own = HarmonicBalance {
                    effort: Effort::default(),
                    journal: Journal::default(),
                    ..self.clone()
                };
                let part = own.half(settings, resonance);
                (part, own.effort.spent())
            });
            self.effort.add(parts.iter().map(|(_, spent)| spent).sum());
            let mut parts = parts.into_iter();
            let mut next = || parts.next()?.0;
            Some([next()?, next()?])
        };
        let by = [low, high, settings.largest_step, resonance.omega];
        let by: Vec<f64> = by.iter().chain(&resonance.displacement).copied().collect();
        let [mut branch, above] = self.kept_branches(&by, follow)?;
        branch.reverse();
        branch.push(resonance.clone());
        branch.extend(above);
        Some(branch)
    }

    /// The points from a phase resonance to the end of the range, if it is reached.
    fn half(&self, settings: ContinuationSettings, resonance: &Response) -> Option<Vec<Response>> {
        let path = Continuation::from_resonance(self, settings, resonance)?;
        let mut points = Vec::new();
        for response in path {
            let response = response.ok()?;
            self.gauge.add_point(response.omega);
            points.push(response);
        }
        let reached = points.last().is_some_and(|last| last.omega == settings.to);
        reached.then_some(points)
    }
}

/// Whether two responses at one frequency are not the same.
fn differ(a: &Response, b: &Response) -> bool {
    let [a, b] = [a, b].map(|response| &response.displacement);
    let size = a.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    distance(a, b) > DIFFERENT * size
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

fn unit(to: &[f64], from: &[f64]) -> Vec<f64> {
    let length = distance(to, from);
    let along = to.iter().zip(from);
    along.map(|(to, from)| (to - from) / length).collect()
}

impl<E: InterfaceElement> Iterator for Continuation<'_, E> {
    type Item = Result<Response, DynamicsError>;

    fn next(&mut self) -> Option<Self::Item> {
        let branch = match std::mem::replace(&mut self.state, Progress::Done) {
            Progress::Done => return None,
            Progress::Start => self
                .balance
                .solve(self.settings.from, None)
                .map(|first| Branch {
                    largest: self.sizes(&first),
                    now: first,
                    past: VecDeque::new(),
                    step: self.settings.step,
                    points: 1,
                    unphysical: 0,
                    heading: None,
                    frame: None,
                }),
            Progress::Underway(branch) => self.advance(*branch),
        };
        let branch = match branch {
            Ok(branch) => branch,
            Err(error) => return Some(Err(error)),
        };
        let response = branch.now.clone();
        let direction = (self.settings.to - self.settings.from).signum();
        let ended = direction * (response.omega - self.settings.to) >= 0.0;
        let returned = direction * (response.omega - self.settings.from) < 0.0;
        let no_motion = branch.unphysical >= UNPHYSICAL;
        if !(ended || returned || no_motion || branch.points >= self.settings.most_points) {
            self.state = Progress::Underway(Box::new(branch));
        }
        Some(Ok(response))
    }
}
