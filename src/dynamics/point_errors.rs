//! What the harmonics and samples of a balance of few unknowns leave out of the points of its forced response.

use super::contact_element::ContactElement;
use super::effort::ERRORS;
use super::forced_response::{ForcedPoint, FoundBy};
use super::truncation::{TAIL, UNKNOWN};
use super::vibration::Vibration;
use super::{HarmonicBalance, Response};

/// Newton correction of the finer response: an error has two digits.
const TOLERANCE: f64 = 1e-5;
/// Newton iterations to it: what takes more is not near.
const ITERATIONS: usize = 8;

impl Vibration {
    /// Errors of points, each from the response at its frequency that Newton's method finds from it with about twice the harmonics and
    /// samples. `solved` are points in which elements slip or open, with their responses: others are linear, and have no such error. The
    /// largest come first, and what comes after the effort is spent has none that is known, but that an energy below zero is error as a whole:
    /// friction gives none.
    pub(super) fn estimate_errors(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        solved: &[(usize, Response)],
        points: &mut [ForcedPoint],
    ) {
        for point in points.iter_mut() {
            if let (FoundBy::Balance, Some(response)) = (point.found_by, &mut point.response) {
                if response.active_elements == 0 {
                    (response.error, response.friction_error) = (Some(0.0), Some(0.0));
                } else if response.energy.friction < 0.0 {
                    response.friction_error = Some(UNKNOWN);
                }
            }
        }
        let harmonics = balance.harmonics();
        let Ok(mut finer) = self.finer(balance, harmonics.beyond()) else {
            return;
        };
        finer.settings.tolerance = finer.settings.tolerance.max(TOLERANCE);
        finer.settings.most_iterations = ITERATIONS;
        finer.effort.allow(ERRORS);
        let amplitude = |k: usize| points[k].response.as_ref().map_or(0.0, |r| r.amplitude);
        let mut order: Vec<&(usize, Response)> = solved.iter().collect();
        order.sort_by(|a, b| amplitude(b.0).total_cmp(&amplitude(a.0)));
        for (k, response) in order {
            let Some(point) = &mut points[*k].response else {
                continue;
            };
            let start = response.start().transferred(harmonics, finer.harmonics());
            let errors = finer.solve_near(response.omega, &start).and_then(|fine| {
                let amplitude = finer.amplitude(&fine, self.response_port)?.0;
                let energy = fine.energy.friction;
                Ok([
                    (point.amplitude, amplitude),
                    (point.energy.friction, energy),
                ]
                .map(|(figure, finer)| error(figure, finer)))
            });
            if finer.effort.is_spent() {
                return;
            }
            let [mut amplitude, friction] = errors.unwrap_or([UNKNOWN; 2]);
            if balance.is_still(response, self.response_port) {
                amplitude = UNKNOWN;
            }
            let least = point.friction_error.unwrap_or(0.0);
            (point.error, point.friction_error) = (Some(amplitude), Some(friction.max(least)));
        }
    }
}

/// Error of a figure, relative to it, from that with more harmonics and samples: all of it where it is zero, or rounding, and that is not.
fn error(figure: f64, finer: f64) -> f64 {
    if figure == finer {
        return 0.0;
    }
    let error = TAIL * (figure - finer).abs() / figure.abs();
    match error.is_finite() {
        true => error,
        false => UNKNOWN,
    }
}
