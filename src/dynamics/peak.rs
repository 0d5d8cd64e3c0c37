//! The peak of a resonance along its branch, with the phase of the response as the coordinate: also where the branch overhangs.

use std::f64::consts::PI;

use super::aft::InterfaceElement;
use super::newton_step::{Condition, Term};
use super::{DynamicsError, HarmonicBalance, Response, Start};

/// First and largest step of phase \[rad\].
const FIRST_STEP: f64 = 0.02;
const LARGEST_STEP: f64 = 0.2;
/// Least step of phase before the coordinate is given up \[rad\].
const LEAST_STEP: f64 = 1e-4;
/// A step that changes the amplitude by more than this factor has left the branch.
const LEFT: f64 = 1.5;
/// Phase from the start within which the peak is that of the same resonance \[rad\].
const FARTHEST: f64 = 0.5 * PI;
/// The angle to the peak of the resonance curve that ends the search where responses cost much, and where each is dear \[rad\]: the
/// amplitude is right to half its square.
const FLAT: f64 = 5e-3;
const DEAR: f64 = 1e-2;
/// Correction that is left to the responses that lead there: less than what the angle leaves.
const ROUGHLY: f64 = 1e-6;
/// Share of the amplitude that a peak which cost little may still rise by.
const RISE: f64 = 1e-6;
/// Steps to it.
const SLOPES: usize = 5;

/// A response on the branch and the derivative of its amplitude's logarithm by phase.
struct Place {
    response: Response,
    phase: f64,
    slope: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// The local peak near `start`, along the branch.
    pub(super) fn peak_by_phase(
        &self,
        port: usize,
        range: (f64, f64),
        start: &Response,
    ) -> Result<Response, DynamicsError> {
        let slot = self.harmonics().require(1, "peak")?;
        let lost = || {
            let turn = 2.0 * PI;
            DynamicsError::NoResonance {
                what: "peak",
                from: range.0 / turn,
                to: range.1 / turn,
            }
        };
        let origin = self.first_harmonic(start, port, slot)[1];
        let mut near = self.place(start.clone(), port, slot, origin)?;
        let flat = self.flat();
        if near.slope == 0.0 || self.is_costly && near.slope.abs() <= flat {
            return Ok(near.response);
        }
        if let Some(peak) = self.peak_by_slopes(&near, port, slot)
            && (range.0..=range.1).contains(&peak.omega)
        {
            return Ok(peak);
        }
        let uphill = near.slope.signum();
        let mut step = FIRST_STEP;
        let mut far = loop {
            let phase = near.phase + step * uphill;
            if (phase - origin).abs() > FARTHEST {
                return Err(lost());
            }
            match self.at_phase(&near, phase, port, slot) {
                Ok(next) if next.slope * uphill <= 0.0 => break next,
                Ok(next) => {
                    near = next;
                    step = (1.6 * step).min(LARGEST_STEP);
                }
                Err(error) => {
                    step *= 0.25;
                    if step < LEAST_STEP {
                        return Err(error);
                    }
                }
            }
        };
        // Regula falsi with halved weights (Illinois), and bisection now and then: the slope may jump.
        let (mut near_weight, mut far_weight) = (near.slope, far.slope);
        let narrow = flat;
        for iteration in 0..60 {
            let width = far.phase - near.phase;
            if width.abs() <= narrow || far.slope == 0.0 {
                break;
            }
            let share = if iteration % 4 == 3 {
                0.5
            } else {
                (near_weight / (near_weight - far_weight)).clamp(0.01, 0.99)
            };
            let next = self.at_phase(&near, near.phase + share * width, port, slot)?;
            if next.slope * uphill > 0.0 {
                near = next;
                near_weight = near.slope;
                far_weight *= 0.5;
            } else {
                far = next;
                far_weight = far.slope;
                near_weight *= 0.5;
            }
        }
        let size = |place: &Place| self.first_harmonic(&place.response, port, slot)[0];
        let peak = if size(&far) > size(&near) { far } else { near }.response;
        if peak.omega < range.0 || peak.omega > range.1 {
            return Err(lost());
        }
        Ok(peak)
    }

    /// The peak in few steps: where the resonance curve is a circle, as that of a linear resonance is, its amplitude is the cosine of the
    /// angle to the peak, so that one slope tells that angle; from then on where the line through two slopes says. None unless they lead
    /// there.
    fn peak_by_slopes(&self, start: &Place, port: usize, slot: usize) -> Option<Response> {
        let mut angle = start.slope.atan();
        let mut near: Option<Place> = None;
        for _ in 0..SLOPES {
            let from = near.as_ref().unwrap_or(start);
            let phase = from.phase + angle.clamp(-LARGEST_STEP, LARGEST_STEP);
            if (phase - start.phase).abs() > FARTHEST {
                return None;
            }
            let next = self.at_phase(from, phase, port, slot).ok()?;
            if next.slope == 0.0 || self.is_costly && next.slope.abs() <= self.flat() {
                return Some(next.response);
            }
            angle = -next.slope * (next.phase - from.phase) / (next.slope - from.slope);
            // Friction may make a peak so flat that a small slope is far from it: what it still rises by decides.
            if (0.5 * angle * next.slope).abs() <= RISE {
                return Some(next.response);
            }
            // Away from a peak the slope rises along the phase: no line leads there.
            if !angle.is_finite() || angle * next.slope <= 0.0 {
                return None;
            }
            near = Some(next);
        }
        None
    }

    /// The angle to a peak that ends the search for it \[rad\].
    fn flat(&self) -> f64 {
        match self.is_costly {
            true => DEAR,
            false => FLAT,
        }
    }

    /// Amplitude and angle of (cosine, sine).
    fn first_harmonic(&self, response: &Response, port: usize, slot: usize) -> [f64; 2] {
        let row = &response.displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        [a.hypot(b), b.atan2(a)]
    }

    /// `response` with its phase, the turn of it next to `near`.
    fn place(
        &self,
        response: Response,
        port: usize,
        slot: usize,
        near: f64,
    ) -> Result<Place, DynamicsError> {
        let row = &response.displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        let change = self.port_slope(&response, port, slot)?;
        let angle = b.atan2(a);
        let phase = angle + 2.0 * PI * ((near - angle) / (2.0 * PI)).round();
        let slope = (a * change[0] + b * change[1]) / (a * change[1] - b * change[0]);
        if !slope.is_finite() {
            return Err(DynamicsError::OutOfRange {
                name: "the change of amplitude with phase",
                value: slope,
                expected: "finite: the phase changes along the branch",
            });
        }
        Ok(Place {
            response,
            phase,
            slope,
        })
    }

    /// The response of the branch through `near` whose phase is `phase`.
    fn at_phase(
        &self,
        near: &Place,
        phase: f64,
        port: usize,
        slot: usize,
    ) -> Result<Place, DynamicsError> {
        let condition = Condition::zero(Term {
            port,
            slot,
            weights: [-phase.sin(), phase.cos()],
        });
        let start: Start = near.response.start();
        let start = self.start_from(&start, near.response.omega, 1.0)?;
        let response = self.newton_to(ROUGHLY, start, 1.0, &condition)?;
        let place = self.place(response, port, slot, phase)?;
        let size = |place: &Place| self.first_harmonic(&place.response, port, slot)[0];
        let ratio = size(&place) / size(near);
        if (place.phase - phase).abs() > 0.1 || !(1.0 / LEFT..LEFT).contains(&ratio) {
            return Err(DynamicsError::NoResonance {
                what: "continuous branch",
                from: near.response.frequency(),
                to: place.response.frequency(),
            });
        }
        Ok(place)
    }
}
