//! Where a slider that is integrated in time changes what it does: roots of the length of a step.

use super::slider::{FrictionLaw, magnitude};
use super::time_integration::{Mode, ROUNDING, along, direction};
use super::time_steps::Run;

/// A function that is positive as long as a mode lasts, with its slope if that is known.
pub(super) struct Event {
    slider: usize,
    axis: usize,
    value: f64,
    slope: Option<f64>,
    scale: f64,
    /// The normal load rather than friction.
    is_normal: bool,
}

impl Run<'_> {
    /// The functions whose sign ends the modes of a state.
    pub(super) fn events(&self, state: &[f64]) -> Vec<Event> {
        let model = self.model;
        let first = 2 * model.coordinates();
        let mut out = Vec::new();
        for (k, (e, slider)) in model.sliders.iter().enumerate() {
            let element = &model.elements[*e];
            let (mu, kt) = (
                element.friction_coefficient,
                slider.gripping_stiffness(element.friction_coefficient),
            );
            let (u, du) = model.at(3 * e, state);
            let (load, rise) = (slider.bilateral_load(u[2]), slider.normal_stiffness * du[2]);
            let [normal, speed] = self.of_sliders[k];
            let size = slider.normal_load + slider.normal_stiffness * normal;
            let sign = if self.modes[k][0] == Mode::Open {
                -1.0
            } else {
                1.0
            };
            out.push(Event {
                slider: k,
                axis: 0,
                value: sign * load,
                slope: Some(sign * rise),
                scale: size,
                is_normal: true,
            });
            if self.modes[k][0] == Mode::Open || kt == 0.0 {
                continue;
            }
            let force = [state[first + 2 * k], state[first + 2 * k + 1]];
            let axes = match element.law {
                FrictionLaw::Cone => 0..1,
                FrictionLaw::Box => 0..2,
            };
            for axis in axes {
                let (along, size) = match element.law {
                    FrictionLaw::Cone => (along(force, du), magnitude(force)),
                    FrictionLaw::Box => {
                        let mut one = [0.0; 2];
                        one[axis] = direction(force[axis], du[axis]);
                        (one, force[axis].abs())
                    }
                };
                let part = along[0] * du[0] + along[1] * du[1];
                let (value, slope, scale) = match self.modes[k][axis] {
                    Mode::Stick => (
                        mu * load - size,
                        Some(mu * rise - kt * part),
                        self.scales[first + 2 * k],
                    ),
                    _ => (kt * part - mu * rise, None, kt * speed),
                };
                out.push(Event {
                    slider: k,
                    axis,
                    value,
                    slope,
                    scale,
                    is_normal: false,
                });
            }
        }
        out
    }

    /// Where within a step of length `h` the cubic through values and slopes of an event's function is least, if it is negative there
    /// though it is not at the end.
    pub(super) fn dip(&self, before: &[Event], after: &[Event], h: f64) -> Option<f64> {
        let pairs = before.iter().zip(after);
        let dips = pairs.filter_map(|(a, b)| {
            let (da, db) = (a.slope? * h, b.slope? * h);
            if !(a.value >= 0.0 && b.value >= 0.0 && da < 0.0 && db > 0.0) {
                return None;
            }
            // Derivative of the Hermite cubic: three coefficients.
            let d = b.value - a.value;
            let (c1, c2, c3) = (da, 3.0 * d - 2.0 * da - db, da + db - 2.0 * d);
            let disc = (c2 * c2 - 3.0 * c1 * c3).max(0.0).sqrt();
            let s = -c1 / (c2 + disc);
            let least = a.value + s * (c1 + s * (c2 + s * c3));
            (s > 0.0 && s < 1.0 && least < -ROUNDING * a.scale).then_some(s * h)
        });
        dips.min_by(f64::total_cmp)
    }

    /// The first event within the step of length `h` that ends in `end`, which is moved to there: its instant, and which they are. Events
    /// that are due at the start count if `at_start`.
    #[allow(clippy::type_complexity)]
    pub(super) fn first_event(
        &mut self,
        time: f64,
        state: &[f64],
        before: &[Event],
        h: f64,
        end: &mut [f64],
        at_start: bool,
    ) -> Option<(f64, Vec<(usize, usize, bool)>)> {
        let after = self.events(end);
        let named = |event: &Event| (event.slider, event.axis, event.is_normal);
        let mut due: Vec<usize> = Vec::new();
        for (i, (a, b)) in before.iter().zip(&after).enumerate() {
            if b.value >= 0.0 {
                continue;
            }
            // It starts from zero and falls at once.
            if a.value <= ROUNDING * a.scale {
                if at_start && b.value < -ROUNDING * b.scale {
                    end.copy_from_slice(state);
                    return Some((0.0, vec![named(a)]));
                }
                continue;
            }
            due.push(i);
        }
        if due.is_empty() {
            return None;
        }
        let least = |events: &[Event]| {
            due.iter()
                .map(|&i| events[i].value / events[i].scale)
                .fold(f64::INFINITY, f64::min)
        };
        // Regula falsi with halved weights (Illinois) on the length of the step.
        let (mut a, mut b) = (0.0, h);
        let (mut fa, mut fb) = (least(before), least(&after));
        let mut last = 0;
        for iteration in 0..60 {
            if b - a <= 1e-14 * h.max(time) {
                break;
            }
            let share = if iteration % 8 == 7 {
                0.5
            } else {
                fa / (fa - fb)
            };
            let middle = (a + share * (b - a)).clamp(a, b);
            self.step(time, state, middle);
            let value = least(&self.events(&self.trial));
            if value.abs() <= ROUNDING {
                b = middle;
                break;
            }
            if value > 0.0 {
                if last == 1 {
                    fb *= 0.5;
                }
                (a, fa, last) = (middle, value, 1);
            } else {
                if last == -1 {
                    fa *= 0.5;
                }
                (b, fb, last) = (middle, value, -1);
            }
        }
        self.step(time, state, b);
        end.copy_from_slice(&self.trial);
        let there = self.events(end);
        let fired: Vec<_> = due
            .iter()
            .filter(|&&i| there[i].value <= 1e-9 * there[i].scale)
            .map(|&i| named(&there[i]))
            .collect();
        Some((b, fired))
    }

    pub(super) fn switch(&mut self, k: usize, axis: usize, is_normal: bool, state: &mut [f64]) {
        let model = self.model;
        let first = 2 * model.coordinates();
        let (e, slider) = model.sliders[k];
        let element = &model.elements[e];
        let (_, du) = model.at(3 * e, state);
        let rise = slider.normal_stiffness * du[2];
        if is_normal {
            state[first + 2 * k..][..2].fill(0.0);
            if self.modes[k][0] != Mode::Open {
                self.modes[k] = [Mode::Open; 2];
                return;
            }
            let kt = slider.gripping_stiffness(element.friction_coefficient);
            let mu = element.friction_coefficient;
            let slips = |speed: f64| match kt * speed > mu * rise {
                true => Mode::Slip,
                false => Mode::Stick,
            };
            self.modes[k] = match element.law {
                FrictionLaw::Cone => [slips(magnitude([du[0], du[1]])); 2],
                FrictionLaw::Box => [slips(du[0].abs()), slips(du[1].abs())],
            };
            return;
        }
        if self.modes[k][0] == Mode::Open {
            return;
        }
        let other = match self.modes[k][axis] {
            Mode::Stick => Mode::Slip,
            _ => Mode::Stick,
        };
        match element.law {
            FrictionLaw::Cone => self.modes[k] = [other; 2],
            FrictionLaw::Box => self.modes[k][axis] = other,
        }
    }

    /// Brings forces of sliders that slip back to their limits, from which rounding and the error of a step lead away.
    pub(super) fn hold(&self, state: &mut [f64]) {
        let model = self.model;
        let first = 2 * model.coordinates();
        for (k, (e, slider)) in model.sliders.iter().enumerate() {
            let element = &model.elements[*e];
            let (u, _) = model.at(3 * e, state);
            let limit = element.friction_coefficient * slider.bilateral_load(u[2]).max(0.0);
            let force = &mut state[first + 2 * k..][..2];
            match element.law {
                FrictionLaw::Cone if self.modes[k][0] == Mode::Slip => {
                    let size = magnitude([force[0], force[1]]);
                    if size > 0.0 {
                        force.iter_mut().for_each(|f| *f *= limit / size);
                    }
                }
                FrictionLaw::Box => {
                    for d in 0..2 {
                        if self.modes[k][d] == Mode::Slip && force[d] != 0.0 {
                            force[d] = force[d].signum() * limit;
                        }
                    }
                }
                FrictionLaw::Cone => {}
            }
        }
    }
}
