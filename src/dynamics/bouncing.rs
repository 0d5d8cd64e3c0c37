//! Bouncing: periodic motions along the normal of a mass that moves there by itself, in and out of contact. No branch over frequency need
//! lead to them, nor a motion from rest: they are what is left of the bouncing under a larger load when that is lowered again.
//!
//! The mass hangs on one spring while the contact is open and on two while it is closed. Between the two its motion is the steady one of
//! that spring and a decaying one of its natural frequency, so that only the instants of opening and closing are to be found.

use std::cell::Cell;
use std::f64::consts::TAU;

use num_complex::Complex64;

use super::contact_element::ContactElement;
use super::periodic::Periodic;
use super::survey::{EFFORT, OTHER, PROBES, Survey, first_harmonic, is_near, over, start_of};
use super::vibration::Vibration;
use super::{DynamicsError, HarmonicBalance, Load, SecondOrder};

/// Direction of the normal among the ports of a contact element.
const NORMAL: usize = 2;
/// Least factor of the loads from which they are lowered, what they do to the load of the closed contact there, relative to its rest, and
/// steps down to their own size.
const LEAST_FACTOR: f64 = 2.5;
const OPENS: f64 = 2.0;
const LEVELS: usize = 11;
/// Newton's steps to a periodic motion, its change over a period, relative to its size, and periods that are waited where it is not found.
const STEPS: usize = 12;
const PERIODIC: f64 = 1e-10;
const WAITED: usize = 300;
/// Difference by which the map over a period is derived, relative to the size of a motion.
const DIFFERENCE: f64 = 1e-6;
/// Steps in the period of what is faster, of the loads and of the mass on its spring, between which opening and closing are looked for, and
/// steps to the instant of one.
const LOOKS: f64 = 16.0;
const CROSSING: usize = 20;
/// Events in a period at most.
const MOST_EVENTS: usize = 2_000;
/// Share of the contact's stiffness that the spring of an open mass has at least.
const SOFT: f64 = 1e-9;
/// Evaluations of a motion that cost as much as a step of the integration in time.
const EVALUATIONS: usize = 40;
/// Samples from which the first harmonic of a motion is found.
const SAMPLES: usize = 256;

/// A mass on its normal, whose contact opens.
struct Bouncer {
    mass: f64,
    damping: f64,
    /// Stiffness with the contact open and closed \[N/m\], and the steady force on each \[N\].
    stiffness: [f64; 2],
    steady: [f64; 2],
    /// Where the contact opens \[m\].
    edge: f64,
    /// Harmonics of the loads and their complex amplitudes, and of those that grow with the square of their frequency.
    loads: Vec<(u32, Complex64)>,
    inertial_loads: Vec<(u32, Complex64)>,
}

/// Where the mass is \[m\], and how fast \[m/s\].
type State = [f64; 2];

/// The mass at an angular frequency, under loads so many times as large.
struct Drive<'a> {
    bouncer: &'a Bouncer,
    omega: f64,
    /// Complex amplitudes of the steady motion, open and closed, by their harmonics.
    waves: [Vec<(f64, Complex64)>; 2],
    /// Decay rate and natural angular frequency of what decays, open and closed \[1/s\].
    decay: f64,
    natural: [f64; 2],
    /// Longest step between looks \[s\].
    look: [f64; 2],
    evaluations: Cell<usize>,
}

impl Vibration {
    /// Adds to a survey the responses that bounce and that no branch of it leads to; none of a structure whose normal motion depends on
    /// others.
    ///
    /// # Errors
    /// Those of [`Self::branch_through`].
    pub(super) fn look_for_bouncing(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        survey: &mut Survey,
    ) -> Result<(), DynamicsError> {
        let Some(bouncer) = self.bouncer(balance) else {
            return Ok(());
        };
        for omega in over(self.range, PROBES) {
            if balance.effort.is_spent() {
                survey.is_cut = true;
                break;
            }
            let (found, evaluations) = bouncer.lowered(omega);
            balance.effort.add_steps(evaluations / EVALUATIONS);
            let Some((state, size)) = found else { continue };
            let known = survey.amplitudes(balance, NORMAL, omega);
            if known
                .iter()
                .any(|known| (size / known - 1.0).abs() <= OTHER)
            {
                continue;
            }
            let Some(bouncing) = self.with_all_axes(balance, omega, state, size) else {
                continue;
            };
            let is_it = |rows: &[f64]| is_near(first_harmonic(balance, rows, NORMAL), size);
            match balance.solve(omega, Some(&start_of(&bouncing))) {
                Ok(response) if is_it(&response.displacement) => {
                    let branch = self.branch_through(balance, &response)?;
                    survey.branches.push(branch);
                }
                // With few harmonics the balance may have no such response.
                _ => survey.motions.push(bouncing),
            }
        }
        Ok(())
    }

    /// The motion of all coordinates of which the normal one bounces; none where it is not found.
    fn with_all_axes(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        state: State,
        size: f64,
    ) -> Option<Periodic> {
        let time = self.in_time(balance)?;
        let coordinate = alone_on_the_normal(&self.model)?;
        let n = self.model.mass.rows();
        let mut start = time.rest();
        (start.values[coordinate], start.values[n + coordinate]) = (state[0], state[1]);
        let near = time.near(omega, &start, size, balance.harmonics(), EFFORT);
        balance.effort.add_steps(time.steps());
        let near = near.ok().flatten()?;
        is_near(first_harmonic(balance, &near.displacement, NORMAL), size).then_some(near)
    }

    /// The mass on its normal; none where the normal motion depends on others, its contact is not one spring, no load moves it, or damping
    /// lets nothing swing.
    fn bouncer(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Bouncer> {
        let k = alone_on_the_normal(&self.model)?;
        let [element] = balance.elements() else {
            return None;
        };
        let [slider] = element.sliders[..] else {
            return None;
        };
        let kn = slider.normal_stiffness;
        if kn == 0.0 || !element.springs.is_empty() {
            return None;
        }
        let share = |load: &Load| self.model.basis.at(load.port, k);
        let steady = self.loads.iter().filter(|load| load.harmonic == 0);
        let steady: f64 = steady.map(|load| share(load) * load.cosine).sum();
        let waves = |loads: &[Load]| -> Vec<(u32, Complex64)> {
            let moving = loads
                .iter()
                .filter(|load| load.harmonic > 0 && share(load) != 0.0);
            moving
                .map(|load| {
                    let force = Complex64::new(load.cosine, -load.sine);
                    (load.harmonic, share(load) * force)
                })
                .collect()
        };
        let (mass, damping) = (self.model.mass.at(k, k), self.model.damping.at(k, k));
        let open = self.model.stiffness.at(k, k).max(SOFT * kn);
        let bouncer = Bouncer {
            mass,
            damping,
            stiffness: [open, open + kn],
            steady: [steady + slider.normal_load, steady + kn * slider.gap],
            edge: slider.gap - slider.normal_load / kn,
            loads: waves(&self.loads),
            inertial_loads: waves(&self.inertial_loads),
        };
        let moves = !(bouncer.loads.is_empty() && bouncer.inertial_loads.is_empty());
        let swings = damping * damping < 4.0 * mass * open;
        (moves && swings).then_some(bouncer)
    }
}

/// The coordinate that the normal displacement of the first contact element is, where no other coordinate depends on it or shares in it.
fn alone_on_the_normal(model: &SecondOrder) -> Option<usize> {
    if model.residual.is_some() || model.contact_dofs <= NORMAL {
        return None;
    }
    let n = model.mass.rows();
    let row = model.basis.row(NORMAL);
    let k = row.iter().position(|share| *share != 0.0)?;
    let only = |row: &[f64]| row.iter().enumerate().all(|(i, v)| i == k || *v == 0.0);
    let is_alone = (0..NORMAL).all(|port| model.basis.at(port, k) == 0.0)
        && only(row)
        && row[k] == 1.0
        && [&model.mass, &model.damping, &model.stiffness]
            .iter()
            .all(|matrix| only(matrix.row(k)) && (0..n).all(|i| i == k || matrix.at(i, k) == 0.0));
    is_alone.then_some(k)
}

impl Bouncer {
    /// The state at the phase 0 of the periodic motion that is left when larger loads are lowered to their own size, and its first harmonic
    /// \[m\], if there is one; and the evaluations that it took.
    fn lowered(&self, omega: f64) -> (Option<(State, f64)>, usize) {
        let closed = 1;
        let still = (self.steady[closed] / self.stiffness[closed] - self.edge).abs();
        let own = Drive::new(self, omega, 1.0);
        let moved: f64 = own.waves[closed].iter().map(|(_, wave)| wave.norm()).sum();
        let most = (OPENS * still / moved).max(LEAST_FACTOR);
        let (mut state, mut evaluations) = ([0.0; 2], 0);
        let mut is_periodic = false;
        for level in 0..=LEVELS {
            let factor = most.powf(1.0 - level as f64 / LEVELS as f64);
            let drive = Drive::new(self, omega, factor);
            let found = match level {
                0 => None,
                _ => drive.periodic(state),
            };
            let found = found.or_else(|| {
                state = (0..WAITED).try_fold(state, |state, _| drive.period(state))?;
                drive.periodic(state)
            });
            is_periodic = found.is_some();
            state = found.unwrap_or(state);
            evaluations += drive.evaluations.get();
        }
        let size = is_periodic.then(|| own.first_harmonic(state)).flatten();
        (size.map(|size| (state, size)), evaluations)
    }
}

impl<'a> Drive<'a> {
    fn new(bouncer: &'a Bouncer, omega: f64, factor: f64) -> Drive<'a> {
        let Bouncer { mass, damping, .. } = *bouncer;
        let inertial = bouncer.inertial_loads.iter();
        let inertial =
            inertial.map(|(order, force)| (*order, force * (f64::from(*order) * omega).powi(2)));
        let loads: Vec<(u32, Complex64)> = bouncer.loads.iter().copied().chain(inertial).collect();
        let waves = bouncer.stiffness.map(|stiffness| {
            let waves = loads.iter().map(|(order, force)| {
                let rate = f64::from(*order) * omega;
                let impedance = Complex64::new(stiffness - mass * rate * rate, damping * rate);
                (rate, factor * force / impedance)
            });
            waves.collect()
        });
        let decay = damping / (2.0 * mass);
        let natural = bouncer
            .stiffness
            .map(|stiffness| (stiffness / mass - decay * decay).sqrt());
        let fastest = loads.iter().map(|(order, _)| *order).max().unwrap_or(1);
        let fastest = f64::from(fastest) * omega;
        Drive {
            bouncer,
            omega,
            waves,
            decay,
            natural,
            look: natural.map(|natural| TAU / (LOOKS * natural.max(fastest))),
            evaluations: Default::default(),
        }
    }

    /// The steady motion of a spring at a time.
    fn steady(&self, spring: usize, time: f64) -> State {
        let rest = self.bouncer.steady[spring] / self.bouncer.stiffness[spring];
        let waves = self.waves[spring].iter();
        waves.fold([rest, 0.0], |[z, v], (rate, wave)| {
            let now = wave * Complex64::cis(rate * time);
            [z + now.re, v - rate * now.im]
        })
    }

    /// The state `after` a time at which it was `state`, on a spring throughout.
    fn on_spring(&self, spring: usize, time: f64, state: State, after: f64) -> State {
        self.evaluations.set(self.evaluations.get() + 1);
        let (from, to) = (self.steady(spring, time), self.steady(spring, time + after));
        let (z, v) = (state[0] - from[0], state[1] - from[1]);
        let (natural, decay) = (self.natural[spring], self.decay);
        let (sin, cos) = (natural * after).sin_cos();
        let left = (-decay * after).exp();
        let slope = (v + decay * z) / natural;
        [
            to[0] + left * (z * cos + slope * sin),
            to[1] + left * (v * cos - (natural * z + decay * slope) * sin),
        ]
    }

    /// The state a period after that at the phase 0.
    fn period(&self, state: State) -> Option<State> {
        self.over(0.0, TAU / self.omega, state)
    }

    /// The state `after` a time at which it was `state`; none where events do not come to an end.
    fn over(&self, mut time: f64, after: f64, mut state: State) -> Option<State> {
        let (edge, end) = (self.bouncer.edge, time + after);
        let mut spring = usize::from(state[0] > edge || state[0] == edge && state[1] > 0.0);
        for _ in 0..MOST_EVENTS {
            let is_over = |z: f64| match spring {
                0 => z > edge,
                _ => z < edge,
            };
            loop {
                let step = self.look[spring].min(end - time);
                let next = self.on_spring(spring, time, state, step);
                if !is_over(next[0]) {
                    (time, state) = (time + step, next);
                    if time >= end {
                        return next[0].is_finite().then_some(next);
                    }
                    continue;
                }
                let after = self.crossing(spring, time, state, [step, next[0]]);
                state = self.on_spring(spring, time, state, after);
                (time, spring) = (time + after, 1 - spring);
                break;
            }
            if time >= end {
                return Some(state);
            }
        }
        None
    }

    /// When the edge is crossed that is passed in a step of which the length and the end are known: by false position, where the end that
    /// stays counts half (Illinois).
    fn crossing(&self, spring: usize, time: f64, state: State, end: [f64; 2]) -> f64 {
        let edge = self.bouncer.edge;
        let (mut low, mut high) = ([0.0, state[0] - edge], [end[0], end[1] - edge]);
        for _ in 0..CROSSING {
            let middle = match low[1] - high[1] {
                0.0 => 0.5 * (low[0] + high[0]),
                rise => low[0] + (high[0] - low[0]) * low[1] / rise,
            };
            let there = self.on_spring(spring, time, state, middle)[0] - edge;
            if there * high[1] > 0.0 {
                high = [middle, there];
                low[1] *= 0.5;
            } else {
                low = [middle, there];
                high[1] *= 0.5;
            }
            if high[0] - low[0] <= f64::EPSILON * end[0] || there == 0.0 {
                break;
            }
        }
        high[0]
    }

    /// The periodic motion near a state, by Newton's method on the map over a period.
    fn periodic(&self, mut state: State) -> Option<State> {
        let mut image = self.period(state)?;
        for _ in 0..STEPS {
            let size = [0, 1].map(|i| state[i].abs().max(image[i].abs()));
            let size = size[0].max(size[1] / self.natural[1]);
            let scales = [size, size * self.natural[1]];
            let apart = |from: State, to: State| {
                let each = [0, 1].map(|i| ((to[i] - from[i]) / scales[i]).abs());
                each[0].max(each[1])
            };
            let change = apart(state, image);
            if change <= PERIODIC {
                return Some(state);
            }
            let mut slope = [[0.0; 2]; 2];
            for column in 0..2 {
                let mut shifted = state;
                shifted[column] += DIFFERENCE * scales[column];
                let moved = self.period(shifted)?;
                for row in 0..2 {
                    slope[row][column] = (moved[row] - image[row]) / (DIFFERENCE * scales[column]);
                }
            }
            let [[a, b], [c, d]] = slope;
            let (a, d) = (a - 1.0, d - 1.0);
            let (p, q) = (state[0] - image[0], state[1] - image[1]);
            let determinant = a * d - b * c;
            let step = [(d * p - b * q) / determinant, (a * q - c * p) / determinant];
            let closer = [1.0, 0.5, 0.25, 0.125].into_iter().find_map(|length| {
                let trial = [state[0] + length * step[0], state[1] + length * step[1]];
                let there = self.period(trial)?;
                (apart(trial, there) < (1.0 - 0.2 * length) * change).then_some((trial, there))
            });
            (state, image) = closer?;
        }
        None
    }

    /// Half range of the first harmonic of the periodic motion from a state \[m\].
    fn first_harmonic(&self, state: State) -> Option<f64> {
        let step = TAU / self.omega / SAMPLES as f64;
        let (mut sum, mut now) = (Complex64::ZERO, state);
        for k in 0..SAMPLES {
            sum += now[0] * Complex64::cis(-TAU * k as f64 / SAMPLES as f64);
            now = self.over(k as f64 * step, step, now)?;
        }
        Some(2.0 / SAMPLES as f64 * sum.norm())
    }
}

#[cfg(test)]
mod tests {
    use super::super::time_integration::TimeModel;
    use super::super::{Oscillator, Slider};
    use super::*;

    /// Over a period in which the contact opens and closes, the motion from spring to spring is that of the integration in time.
    #[test]
    fn a_period_from_spring_to_spring_is_that_in_time() {
        const RANGE: (f64, f64) = (200.0, 400.0);
        // What integration in time leaves.
        const INTEGRATED: f64 = 1e-6;
        let oscillator = Oscillator {
            mass: [1.0, 1.0, 0.7],
            damping: [2.0, 2.0, 3.0],
            stiffness: [1e5, 1e5, 4e4],
            element: ContactElement {
                springs: Vec::new(),
                area: 0.0,
                friction_coefficient: 0.0,
                law: Default::default(),
                sliders: vec![Slider {
                    normal_load: 30.0,
                    gap: 0.0,
                    tangential_stiffness: 1e5,
                    normal_stiffness: 9e5,
                }],
            },
        };
        let third = Load {
            harmonic: 3,
            ..Oscillator::load(NORMAL, 9.0, 0.4)
        };
        let loads = vec![Oscillator::load(NORMAL, 80.0, 0.9), third];
        let vibration = Vibration {
            model: oscillator.model().expect("an oscillator"),
            loads: loads.clone(),
            inertial_loads: Vec::new(),
            response_port: NORMAL,
            harmonics: super::super::Harmonics::up_to(3),
            settings: Default::default(),
            range: RANGE,
            points: None,
            gauge: Default::default(),
            journal: Default::default(),
            surveyed: Default::default(),
        };
        let balance = vibration
            .balance(vec![oscillator.element.clone()])
            .expect("a balance");
        let bouncer = vibration.bouncer(&balance).expect("it moves by itself");
        let time = TimeModel::new(&vibration.model, balance.elements(), &loads).expect("in time");
        let (mut opens, n) = (false, 3);
        for state in [[1e-5, 0.02], [-3e-4, 0.1], [-2e-3, -0.5]] {
            let drive = Drive::new(&bouncer, RANGE.0, 1.0);
            let there = drive.period(state).expect("few events");
            let mut motion = time.rest();
            (motion.values[NORMAL], motion.values[n + NORMAL]) = (state[0], state[1]);
            let scales = time.scales(RANGE.0, 1e-3);
            time.period(RANGE.0, &mut motion, &scales, None)
                .expect("few steps");
            let in_time = [motion.values[NORMAL], motion.values[n + NORMAL]];
            for (k, size) in [1e-3, 1e-3 * RANGE.0].into_iter().enumerate() {
                let off = (there[k] - in_time[k]).abs() / size;
                assert!(off < INTEGRATED, "{there:?} {in_time:?}");
            }
            opens |= there[0] < bouncer.edge || state[0] < bouncer.edge;
        }
        assert!(opens);
    }
}
