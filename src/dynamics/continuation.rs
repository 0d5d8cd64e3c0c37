//! Pseudo-arclength continuation of a branch of responses over a range of frequencies, through turning points.
//!
//! The continuation follows a curve in scaled coordinates. Two coordinates are the cosine and the sine of the first
//! harmonic at one port, divided by the largest amplitude so far. Another coordinate is ω, divided by the width of the
//! range. The curve does not depend on which elements are active. Every loaded port adds the cosine and the sine of its
//! loaded harmonics to the curve. The displacement of the response port alone can miss a resonance along another axis.
//! Such a resonance can bend over and open the contact.
//!
//! Steps go along the secant; `predictor.rs` predicts the response at the end of the step. From a phase resonance, the
//! first step follows the change of the phase.

use std::collections::VecDeque;

use num_complex::Complex64;

use super::aft::InterfaceElement;
use super::effort::EvaluationBudget;
use super::forced_response::friction_gives_energy;
use super::newton::{Condition, SolverCache, Term};
use super::predictor::{PREDICTOR_POINTS, extrapolated_number, extrapolated_start};
use super::{DynamicsError, HarmonicBalance, Response, Start};
use crate::journal::Journal;

/// Largest step that the continuation accepts at any angle, divided by the smallest step. The curve has kinks where
/// slip begins.
const KINK: f64 = 32.0;
/// Largest number of Newton iterations of an easy step, in place of `easy_iterations`, if some iterations reuse a
/// Jacobian.
const EASY_CHORDS: usize = 7;
/// Smallest distance of two different responses at one frequency, divided by the largest coefficient of both responses.
const DIFFERENT: f64 = 1e-3;
/// First step from a phase resonance over the largest step.
const FIRST_FROM_RESONANCE: f64 = 0.85;
/// Largest step on a branch from a phase resonance, times the square root of the curvature of the curve. Monotone
/// cubics between the points are then within about 0.2 % of the peak.
const BEND: f64 = 0.19;
/// Number of scan steps per distance of the last two frequencies, in the search for the next frequency.
const STRIDES: usize = 8;
/// Largest distance of the next frequency from the last frequency, in distances of the last two frequencies.
const FARTHEST: usize = 3;
/// Number of bisections in the search for the next frequency.
const HALVINGS: usize = 30;
/// Largest number of points from a phase resonance to an end of the range: a closed branch has no end.
const MOST_OF_HALF: usize = 300;
/// A branch ends after this number of consecutive points at which friction supplies energy. If friction supplies as
/// much energy as the dampers dissipate, the amplitude grows along the branch without bound.
const UNPHYSICAL: usize = 50;

/// Settings of the continuation. Lengths are in units of the scaled curve, whose frequency axis has length 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContinuationSettings {
    /// Angular frequency of the first point \[rad/s\].
    pub from: f64,
    /// Angular frequency at the end of the branch \[rad/s\]. In a downward sweep, `to` is less than `from`.
    pub to: f64,
    /// Port whose first harmonic the continuation follows.
    pub port: usize,
    /// Length of the first step; 1/60 of the range is a usual resolution.
    pub step: f64,
    /// Smallest length of a step; the continuation stops if a step must be shorter.
    pub least_step: f64,
    /// Largest length: the resolution on straight parts of the curve.
    pub largest_step: f64,
    /// Largest number of points, including the first.
    pub most_points: usize,
    /// Cosine of the angle between secants below which a step is repeated at half its length.
    pub sharpest_turn: f64,
    /// Number of Newton iterations up to which the step grows.
    pub easy_iterations: usize,
}

impl ContinuationSettings {
    /// Creates settings with usual steps for a range and a `port`.
    pub fn over(from: f64, to: f64, port: usize) -> ContinuationSettings {
        ContinuationSettings {
            from,
            to,
            port,
            step: 1.0 / 60.0,
            least_step: 1e-7,
            largest_step: 1.0 / 20.0,
            most_points: 2000,
            sharpest_turn: 0.85,
            easy_iterations: 4,
        }
    }
}

/// Iterator over the points of a branch.
///
/// The iterator ends at `to`, or where the branch returns beyond `from`. The iterator also ends if friction supplies
/// energy at many points, or after `most_points`. The iterator yields no point after an error.
pub struct Continuation<'a, E> {
    balance: &'a HarmonicBalance<E>,
    settings: ContinuationSettings,
    /// Port and slot of each pair of coefficients on the curve; the first pair belongs to the port of the settings.
    watched: Vec<(usize, usize)>,
    /// Range of angular frequency that has length 1 on the scaled curve \[rad/s\].
    width: f64,
    state: Progress,
    /// Whether a step reuses the solver frame of the previous step.
    keeps_frame: bool,
}

enum Progress {
    Start,
    Underway(Box<Branch>),
    Done,
}

struct Branch {
    now: Response,
    /// The previous points, the latest last, as many as the predictor uses.
    past: VecDeque<Response>,
    step: f64,
    /// Largest amplitude of each pair so far \[m\].
    largest: Vec<f64>,
    points: usize,
    /// Number of consecutive points at the end of the branch at which friction supplies energy. A point at which
    /// friction supplies energy is not physical.
    unphysical: usize,
    /// Direction of the first step, and the phase shift of the motion for a step of length 1 \[rad\]. Without a
    /// direction, the first step of the branch changes only the frequency.
    heading: Option<(Vec<f64>, f64)>,
    /// Solver frame of the last step, for reuse in the next.
    frame: Option<SolverCache>,
}

impl<'a, E: InterfaceElement> Continuation<'a, E> {
    /// Creates the continuation of `balance` with `settings`.
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
            watched: balance.followed_pairs(settings.port)?,
            width: (settings.to - settings.from).abs(),
            state: Progress::Start,
            keeps_frame: false,
        })
    }

    /// Follows the branch through `now` to the point at `settings.to`, over turning points if necessary. `before` is an
    /// earlier point of the branch.
    ///
    /// # Errors
    /// [`DynamicsError::NoResonance`] if the branch returns beyond `settings.from`, the errors of [`Self::new`] and of
    /// a step.
    pub(super) fn response_at_end(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        before: Option<&Response>,
        now: &Response,
        width: f64,
    ) -> Result<Response, DynamicsError> {
        let mut path = Continuation::from_response(balance, settings, before, now)?;
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

    /// Creates the continuation of [`Self::new`] from `now`, which is not repeated as a point. `before` is an earlier
    /// point of the branch.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn from_response(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        before: Option<&Response>,
        now: &Response,
    ) -> Result<Continuation<'a, E>, DynamicsError> {
        let mut path = Continuation::new(balance, settings)?;
        let largest = path.amplitudes(now);
        let largest = before.map_or(largest.clone(), |before| {
            path.larger_amplitudes(&largest, before)
        });
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

    /// Creates the continuation of [`Self::new`] from a phase resonance, which is not repeated as a point. The
    /// continuation begins along the change of the phase at the drive.
    fn from_resonance(
        balance: &'a HarmonicBalance<E>,
        settings: ContinuationSettings,
        resonance: &Response,
    ) -> Option<Continuation<'a, E>> {
        let mut path = Continuation::from_response(balance, settings, None, resonance).ok()?;
        path.keeps_frame = true;
        let place = path.drive_place()?;
        let Progress::Underway(branch) = &mut path.state else {
            return None;
        };
        let width = 2 * path.watched.len() + 1;
        let n = balance.harmonics().coefficients();
        let (port, slot) = path.watched[place];
        let row = &resonance.displacement[port * n..];
        let (a, b) = (row[slot], row[slot + 1]);
        let size = a.hypot(b);
        // The phase lag grows with frequency.
        let direction = (settings.to - settings.from).signum();
        let mut along = vec![0.0; width];
        along[2 * place] = -direction * b / size;
        along[2 * place + 1] = direction * a / size;
        branch.heading = (size > 0.0).then_some((along, direction));
        branch.heading.is_some().then_some(path)
    }

    /// Returns the place of the drive among the pairs.
    fn drive_place(&self) -> Option<usize> {
        let drive = self.balance.drive()?;
        let slot = self.balance.harmonics().slot_of(1)?;
        self.watched
            .iter()
            .position(|pair| *pair == (drive.port, slot))
    }

    /// Returns the scaled point of the curve: the pairs, then the frequency.
    fn point(&self, response: &Response, largest: &[f64]) -> Vec<f64> {
        let pairs = self.pairs(response).zip(largest);
        let scaled = pairs.flat_map(|(pair, &largest)| {
            let scale = if largest > 0.0 { largest } else { 1.0 };
            pair.map(|value| value / scale)
        });
        scaled.chain([response.omega / self.width]).collect()
    }

    /// Returns the arc lengths of the curve up to each of the responses on it.
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

    /// Returns the amplitudes of the pairs \[m\].
    fn amplitudes(&self, response: &Response) -> Vec<f64> {
        self.pairs(response).map(|[a, b]| a.hypot(b)).collect()
    }

    /// Returns for each pair the larger of two amplitudes: the largest amplitude of the pair so far, and the amplitude
    /// of the pair in a response.
    fn larger_amplitudes(&self, largest: &[f64], response: &Response) -> Vec<f64> {
        let sizes = self.amplitudes(response).into_iter().zip(largest);
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
                let previous_point = self.point(before, &branch.largest);
                unit_vector(&here, &previous_point)
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
                    let largest = self.larger_amplitudes(&branch.largest, &next);
                    let next_point = self.point(&next, &largest);
                    let this_point = self.point(&branch.now, &largest);
                    let secant = unit_vector(&next_point, &this_point);
                    let cosine = match branch.past.back() {
                        None => 1.0,
                        Some(before) => {
                            let previous_secant =
                                unit_vector(&this_point, &self.point(before, &largest));
                            previous_secant
                                .iter()
                                .zip(&secant)
                                .map(|(a, b)| a * b)
                                .sum()
                        }
                    };
                    let is_long =
                        distance(&next_point, &this_point) > 4.0 * step.max(settings.least_step);
                    if (cosine >= settings.sharpest_turn && !is_long)
                        || step <= KINK * settings.least_step
                    {
                        let most_iterations = if self.balance.has_expensive_jacobian {
                            EASY_CHORDS
                        } else {
                            settings.easy_iterations
                        };
                        let is_easy = next.iterations <= most_iterations
                            && cosine > 0.5 * (1.0 + settings.sharpest_turn);
                        let growth = if is_easy { 1.4 } else { 1.0 };
                        let mut longest = settings.largest_step;
                        if let (true, Some(before)) = (self.keeps_frame, branch.past.back()) {
                            let before = self.point(before, &largest);
                            let length =
                                distance(&next_point, &this_point) + distance(&this_point, &before);
                            let curvature = 2.0 * f64::min(cosine, 1.0).acos() / length;
                            longest = longest.min(BEND / curvature.sqrt());
                        }
                        let unphysical = match friction_gives_energy(&next) {
                            true => branch.unphysical + 1,
                            false => 0,
                        };
                        let mut past = branch.past;
                        past.push_back(branch.now);
                        if past.len() >= PREDICTOR_POINTS {
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

    /// Solves for the point of the branch in the plane normal to `tangent` at the distance `step`.
    fn correct(
        &self,
        branch: &Branch,
        here: &[f64],
        tangent: &[f64],
        step: f64,
        frame: &mut Option<SolverCache>,
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
            true => self.predict_in_plane(branch, here, tangent, step),
            false => None,
        };
        let ahead = ahead.or_else(|| self.predict(branch, step));
        let guess = ahead.unwrap_or_else(|| {
            let now = branch.now.start();
            let mut guess = match &branch.heading {
                Some((_, angle)) => {
                    now.delayed_and_scaled(self.balance.harmonics(), angle * step, 1.0)
                }
                None => now,
            };
            guess.omega = branch.now.omega + step * by_omega * width;
            guess
        });
        let start = self.balance.start_from(&guess, guess.omega, 1.0)?;
        if !self.keeps_frame {
            return self.balance.solve_or_read(start, 1.0, &condition);
        }
        let tolerance = self.balance.settings.tolerance;
        self.balance
            .solve_with_frame(frame, tolerance, start, 1.0, &condition)
    }

    /// Predicts the response at a distance along the branch, or returns `None` if there is a single point.
    fn predict(&self, branch: &Branch, step: f64) -> Option<Start> {
        let points: Vec<&Response> = branch.past.iter().chain([&branch.now]).collect();
        let places = self.lengths(&points, &branch.largest);
        let starts: Vec<Start> = points.iter().map(|response| response.start()).collect();
        let predicted = extrapolated_start(&starts, &places, places[places.len() - 1] + step);
        predicted.filter(|start| start.omega > 0.0)
    }

    /// Predicts a response at an angular frequency by extrapolation of the dynamic stiffness at the port. Near a
    /// resonance, the stiffness is nearly a straight line over frequency. Near a linear resonance, the stiffness is a
    /// straight line.
    ///
    /// `find` chooses the frequency from the last frequency, the last change of frequency, and the predicted
    /// displacement over frequency. The function scales each response to amplitude 1 and phase 0 at the port, and
    /// extrapolates the scaled responses. Returns `None` if the frequency turns back, or if the curve has more than one
    /// pair of coefficients.
    fn predict_by_stiffness(
        &self,
        branch: &Branch,
        find: impl FnOnce(f64, f64, &dyn Fn(f64) -> Option<Complex64>) -> Option<f64>,
    ) -> Option<Start> {
        let harmonics = self.balance.harmonics();
        let n = harmonics.coefficients();
        let [(port, slot)] = self.watched[..] else {
            return None;
        };
        let points: Vec<&Response> = branch.past.iter().chain([&branch.now]).collect();
        let (now, before) = (branch.now.omega, branch.past.back()?.omega);
        let is_same_direction =
            |pair: &&[&Response]| (pair[1].omega - pair[0].omega) * (now - before) > 0.0;
        let same_direction_count = points
            .windows(2)
            .rev()
            .take_while(is_same_direction)
            .count();
        let points = &points[points.len() - 1 - same_direction_count..];
        let omegas: Vec<f64> = points.iter().map(|response| response.omega).collect();
        let displacement = |response: &&Response| {
            let row = &response.displacement[port * n..];
            Complex64::new(row[slot], row[slot + 1])
        };
        let displacements: Vec<Complex64> = points.iter().map(displacement).collect();
        let stiffness: Vec<Complex64> = displacements.iter().map(Complex64::inv).collect();
        let stiffness = extrapolated_number(&stiffness, &omegas)?;
        let displacement_at = |omega: f64| Some(stiffness(omega)?.inv());
        let omega = find(now, now - before, &displacement_at)?;
        let normalised = points.iter().zip(&displacements);
        let normalised: Vec<Start> = normalised
            .map(|(response, u)| {
                response
                    .start()
                    .delayed_and_scaled(harmonics, -u.arg(), 1.0 / u.norm())
            })
            .collect();
        let u = displacement_at(omega)?;
        let mut ahead = extrapolated_start(&normalised, &omegas, omega)?;
        ahead = ahead.delayed_and_scaled(harmonics, u.arg(), u.norm());
        // Friction locks in mean displacements. A mean that extrapolation did not predict better than the last value
        // keeps the last value.
        let (last, earlier) = normalised.split_last()?;
        let predicted = extrapolated_start(earlier, &omegas[..earlier.len()], now);
        let previous = earlier.last()?;
        for (place, row) in ahead.displacement.chunks_mut(n).enumerate() {
            let mean = |start: &Start| start.displacement[place * n];
            let prediction_error = |start: &Start| (mean(start) - mean(last)).abs();
            if predicted
                .as_ref()
                .is_none_or(|predicted| prediction_error(predicted) >= prediction_error(previous))
            {
                row[0] = mean(last);
            }
        }
        ahead.omega = omega;
        let is_number = ahead.displacement.iter().all(|u| u.is_finite());
        (is_number && omega > 0.0).then_some(ahead)
    }

    /// Predicts a response as [`Self::predict_by_stiffness`], in the plane normal to `tangent` at the distance `step`.
    fn predict_in_plane(
        &self,
        branch: &Branch,
        here: &[f64],
        tangent: &[f64],
        step: f64,
    ) -> Option<Start> {
        let (&[c, s, w], &[along_c, along_s, along_w]) = (here, tangent) else {
            return None;
        };
        self.predict_by_stiffness(branch, |now, stride, displacement| {
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

    /// Solves for the point at the end of the range. `beyond` is a point of the branch beyond the end, if known.
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
            None if self.keeps_frame => self.predict_by_stiffness(branch, |_, _, _| Some(end)),
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
    /// Returns port and slot of the pairs on the curve: the first harmonic at `port`, and all loaded harmonics.
    fn followed_pairs(&self, port: usize) -> Result<Vec<(usize, usize)>, DynamicsError> {
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

    /// Computes the responses over the range of frequencies in `settings`, from one end of the range to the other end.
    /// The responses include the turning points of the branch.
    ///
    /// A branch can have a corner, where lift-off begins or a slider becomes free. Beyond the corner, the branch can
    /// continue in a direction that no step finds. If the continuation stops at a corner, it computes a second part of
    /// the branch from the other end of the range. If both parts stop, the function joins both parts without the
    /// missing piece between them. Every frequency of the range still has a response.
    ///
    /// # Errors
    /// Returns the error of [`Continuation`] if the parts of the branch do not cover every frequency of the range.
    pub fn branch(&self, settings: ContinuationSettings) -> Result<Vec<Response>, DynamicsError> {
        let (mut parts, stopped) = self.branch_or_parts(settings, &|_| None)?;
        let Some(error) = stopped else {
            return Ok(parts.swap_remove(0));
        };
        let direction = (settings.to - settings.from).signum();
        let [first_part, second_part] = &mut parts[..] else {
            return Err(error);
        };
        match (first_part.last(), second_part.first()) {
            (Some(end), Some(start)) if direction * (end.omega - start.omega) >= 0.0 => {
                first_part.append(second_part);
                Ok(std::mem::take(first_part))
            }
            _ => Err(error),
        }
    }

    /// Computes the branch over the range of `settings`. If the continuation stops inside the range, the function
    /// returns two parts of the branch, one from each end. The function also returns the error that stopped the first
    /// part.
    ///
    /// The points of all parts are in order from one end of the range to the other end. The first part comes second if
    /// the part from the other end covers the whole range, but ends at another response than the first response of the
    /// first part. If Newton's method does not find the first response of a part, `fallback` can find this response.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`], [`DynamicsError::HarmonicMissing`].
    #[allow(clippy::type_complexity)]
    pub fn branch_or_parts(
        &self,
        settings: ContinuationSettings,
        fallback: &dyn Fn(f64) -> Option<Response>,
    ) -> Result<(Vec<Vec<Response>>, Option<DynamicsError>), DynamicsError> {
        let (first_part, stopped) = self.follow_part(settings, fallback)?;
        let Some(error) = stopped else {
            return Ok((vec![first_part], None));
        };
        let backward = ContinuationSettings {
            from: settings.to,
            to: settings.from,
            ..settings
        };
        let (mut second_part, stopped) = self.follow_part(backward, fallback)?;
        second_part.reverse();
        match stopped {
            // At the start of the range, the first part can be another branch that turns back.
            None => match (first_part.first(), second_part.first()) {
                (Some(a), Some(b)) if differ(a, b) => Ok((vec![second_part, first_part], None)),
                _ => Ok((vec![second_part], None)),
            },
            Some(_) => Ok((vec![first_part, second_part], Some(error))),
        }
    }

    /// Follows a branch as far as possible, and returns the error that stopped the continuation. If a branch turns back
    /// and leaves the range at its beginning, the function cuts the branch at the turning point.
    fn follow_part(
        &self,
        settings: ContinuationSettings,
        fallback: &dyn Fn(f64) -> Option<Response>,
    ) -> Result<(Vec<Response>, Option<DynamicsError>), DynamicsError> {
        let first = match self.solve(settings.from, None) {
            Ok(first) => first,
            Err(error) => match fallback(settings.from) {
                Some(first) => first,
                None => return Ok((Vec::new(), Some(error))),
            },
        };
        self.gauge.add_point(first.omega);
        let path = Continuation::from_response(self, settings, None, &first)?;
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
    /// Computes the branch over the range of `settings` through a phase resonance, from the lower end to the upper.
    ///
    /// The continuation follows the branch from the resonance in both directions, in parallel if there are threads.
    /// Returns `None` if the continuation does not reach both ends of the range.
    pub(super) fn branch_through_resonance(
        &self,
        settings: ContinuationSettings,
        resonance: &Response,
    ) -> Option<Vec<Response>> {
        let (low, high) = (
            settings.from.min(settings.to),
            settings.from.max(settings.to),
        );
        let directions = [(high, low), (low, high)].map(|(from, to)| ContinuationSettings {
            from,
            to,
            step: FIRST_FROM_RESONANCE * settings.largest_step,
            most_points: MOST_OF_HALF,
            ..settings
        });
        let follow = || {
            let parts = self.threads.map(directions, |settings| {
                let branch_balance = HarmonicBalance {
                    effort: EvaluationBudget::default(),
                    journal: Journal::default(),
                    ..self.clone()
                };
                let part = branch_balance.follow_half(settings, resonance);
                (part, branch_balance.effort.spent())
            });
            self.effort.add(parts.iter().map(|(_, spent)| spent).sum());
            let mut parts = parts.into_iter();
            let mut next = || parts.next()?.0;
            Some([next()?, next()?])
        };
        let inputs = [low, high, settings.largest_step, resonance.omega];
        let inputs: Vec<f64> = inputs
            .iter()
            .chain(&resonance.displacement)
            .copied()
            .collect();
        let [mut branch, above] = self.stored_or_computed_branches(&inputs, follow)?;
        branch.reverse();
        branch.push(resonance.clone());
        branch.extend(above);
        Some(branch)
    }

    /// Computes the points of the branch from a phase resonance to the end of the range. Returns `None` if the
    /// continuation does not reach the end of the range.
    fn follow_half(
        &self,
        settings: ContinuationSettings,
        resonance: &Response,
    ) -> Option<Vec<Response>> {
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

/// Returns true if two responses at one frequency differ.
fn differ(a: &Response, b: &Response) -> bool {
    let [a, b] = [a, b].map(|response| &response.displacement);
    let size = a.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
    distance(a, b) > DIFFERENT * size
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
    squares.sum::<f64>().sqrt()
}

fn unit_vector(to: &[f64], from: &[f64]) -> Vec<f64> {
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
                    largest: self.amplitudes(&first),
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
