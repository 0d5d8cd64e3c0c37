//! Steps in time from event to event by the method of Dormand and Prince of order 5 with an error estimate of order 4 (1980); events are
//! roots of the length of a step.

use std::f64::consts::TAU;

use super::series::{Turns, basis};
use super::slider::{FrictionLaw, Slider};
use super::time_integration::{Mode, TimeModel, along, direction};
use super::{ContactElement, DynamicsError, Harmonics};

/// Error of a step relative to the size of the motion.
const TOLERANCE: f64 = 1e-10;
/// Factor of the error of a step of half the length: the estimate is of order 5 in it.
const ORDER_FACTOR: f64 = 1.0 / 32.0;
/// The longest step, in parts of a period: a shorter contact is found by where the load is least within a step.
const LONGEST: f64 = 1.0 / 40.0;
/// Part of that where there are springs beside the sliders.
const OF_SPRINGS: f64 = 1.0 / 8.0;
/// The shortest, in parts of a period: an event that follows another within it is taken with it.
const SHORTEST: f64 = 1e-11;
/// Steps in a period at most.
const MOST_STEPS: usize = 400_000;
/// Nodes, weights of the stages, of the step and of its error (Dormand and Prince 1980, table 2).
const NODES: [f64; 7] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0, 1.0];
const STAGES: [[f64; 6]; 7] = [
    [0.0; 6],
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [
        19372.0 / 6561.0,
        -25360.0 / 2187.0,
        64448.0 / 6561.0,
        -212.0 / 729.0,
        0.0,
        0.0,
    ],
    [
        9017.0 / 3168.0,
        -355.0 / 33.0,
        46732.0 / 5247.0,
        49.0 / 176.0,
        -5103.0 / 18656.0,
        0.0,
    ],
    [
        35.0 / 384.0,
        0.0,
        500.0 / 1113.0,
        125.0 / 192.0,
        -2187.0 / 6784.0,
        11.0 / 84.0,
    ],
];
const ERROR: [f64; 7] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// A period that is being integrated.
pub(super) struct Run<'a> {
    pub(super) model: &'a TimeModel<'a>,
    omega: f64,
    pub(super) scales: &'a [f64],
    /// Of each slider, the scales of its normal displacement \[m\] and of its speed in the plane \[m/s\].
    pub(super) of_sliders: Vec<[f64; 2]>,
    harmonics: Option<&'a Harmonics>,
    pub(super) modes: Vec<[Mode; 2]>,
    stages: Vec<Vec<f64>>,
    pub(super) trial: Vec<f64>,
    /// Whether the first stage has the rates of the state from which a step is made: it has them after a step that is taken again with
    /// another length.
    has_first: bool,
    /// Forces on the coordinates, to work in.
    force: Vec<f64>,
    /// The angle at which rates were last asked for, and its cosine and sine: the last two stages of a step share one.
    turned: (f64, Turns),
}

impl<'a> Run<'a> {
    /// A period of a motion whose state, with what it is measured by, has so many values.
    pub(super) fn new(
        model: &'a TimeModel<'a>,
        omega: f64,
        scales: &'a [f64],
        harmonics: Option<&'a Harmonics>,
        modes: Vec<[Mode; 2]>,
        values: usize,
    ) -> Run<'a> {
        let n = model.coordinates();
        let of_slider = |(element, _): &(usize, &Slider)| {
            let [_, normal] = model.contact_scales(*element, &scales[..n]);
            let [speed, _] = model.contact_scales(*element, &scales[n..2 * n]);
            [normal, speed]
        };
        Run {
            model,
            omega,
            scales,
            of_sliders: model.sliders.iter().map(of_slider).collect(),
            harmonics,
            modes,
            stages: vec![vec![0.0; values]; 7],
            trial: vec![0.0; values],
            has_first: false,
            force: vec![0.0; n],
            turned: (0.0, Turns::of(0.0)),
        }
    }

    pub(super) fn march(&mut self, state: &mut Vec<f64>) -> Result<(), DynamicsError> {
        let period = TAU / self.omega;
        // No event marks where a stop touches.
        let mut springs = self.model.elements.iter().map(|e| e.springs.is_empty());
        let part = if springs.all(|none| none) {
            1.0
        } else {
            OF_SPRINGS
        };
        let longest = part * LONGEST * period * 0.5_f64.powi(self.model.halvings);
        let shortest = SHORTEST * period;
        let (mut time, mut step) = (0.0, longest);
        // Events that follow each other without a step between them are passed over together.
        let mut at_once = 0;
        for _ in 0..MOST_STEPS {
            if period - time <= shortest {
                return Ok(());
            }
            if self.model.steps.get() >= self.model.bound.get() {
                break;
            }
            let mut h = step.min(period - time).min(longest);
            let error = self.step(time, state, h);
            if !error.is_finite() {
                break;
            }
            let factor = (0.9 * error.max(1e-10).powf(-0.2)).clamp(0.2, 4.0);
            if error > 1.0 && h > shortest {
                step = (h * factor.min(0.9)).max(shortest);
                continue;
            }
            step = h * factor;
            let before = self.events(state);
            let mut end = self.trial.clone();
            // Where a load is least within the step, it may be less than nothing.
            if let Some(dip) = self.dip(&before, &self.events(&end), h) {
                h = dip;
                self.step(time, state, h);
                end.copy_from_slice(&self.trial);
            }
            let fired = self.first_event(time, state, &before, h, &mut end, at_once < 4);
            let Some((at, mut which)) = fired else {
                (time, *state, at_once) = (time + h, end, 0);
                // The last stage of a step is the first of the next, unless forces are brought back to their limits.
                let slips = self.modes.iter().flatten().any(|mode| *mode == Mode::Slip);
                self.has_first = !slips;
                match slips {
                    true => self.hold(state),
                    false => self.stages.swap(0, 6),
                }
                continue;
            };
            self.has_first = false;
            time += at;
            *state = end;
            at_once = if at <= shortest { at_once + 1 } else { 0 };
            // All events of that instant.
            which.sort_unstable();
            which.dedup();
            for (slider, axis, is_normal) in which {
                self.switch(slider, axis, is_normal, state);
            }
            step = step.min(longest).max(1e-4 * period);
        }
        Err(DynamicsError::NotConverged {
            frequency: self.omega / TAU,
            load_factor: 1.0,
            iterations: MOST_STEPS,
            correction: f64::INFINITY,
            tolerance: TOLERANCE,
            active: self.model.elements.len(),
            elements: self.model.elements.len(),
        })
    }

    /// The state after a step in `trial`, and its error relative to what is allowed.
    pub(super) fn step(&mut self, time: f64, state: &[f64], h: f64) -> f64 {
        self.model.steps.set(self.model.steps.get() + 1);
        let mut stages = std::mem::take(&mut self.stages);
        let mut trial = std::mem::take(&mut self.trial);
        let first = usize::from(self.has_first);
        self.has_first = true;
        for k in first..7 {
            trial.copy_from_slice(state);
            for (weight, stage) in STAGES[k].iter().zip(&stages).take(k) {
                if *weight != 0.0 {
                    for (y, dy) in trial.iter_mut().zip(stage) {
                        *y += h * weight * dy;
                    }
                }
            }
            self.rates(time + NODES[k] * h, &trial, &mut stages[k]);
        }
        let tolerance = TOLERANCE * ORDER_FACTOR.powi(self.model.halvings);
        let mut worst = 0.0_f64;
        for (i, scale) in self.scales.iter().enumerate() {
            let error: f64 = (0..7).map(|k| ERROR[k] * stages[k][i]).sum::<f64>() * h;
            let ratio = error.abs() / (tolerance * scale);
            worst = if ratio.is_nan() {
                f64::NAN
            } else {
                worst.max(ratio)
            };
            if worst.is_nan() {
                break;
            }
        }
        (self.stages, self.trial) = (stages, trial);
        worst
    }

    /// Time derivative of a state, whose sliders keep their modes.
    fn rates(&mut self, time: f64, state: &[f64], out: &mut [f64]) {
        let model = self.model;
        let n = model.coordinates();
        let first = 2 * n;
        let theta = self.omega * time;
        let mut force = std::mem::take(&mut self.force);
        force.fill(0.0);
        let mut input = 0.0;
        let constant = model.loads.iter().map(|load| (load, 1.0));
        let inertial = model.inertial_loads.iter();
        let inertial = inertial.map(|load| {
            let rate = f64::from(load.harmonic) * self.omega;
            (load, rate * rate)
        });
        if theta != self.turned.0 {
            self.turned = (theta, Turns::of(theta));
        }
        let turns = self.turned.1;
        let mut wave = (0, [1.0, 0.0]);
        for (load, size) in constant.chain(inertial) {
            if load.harmonic != wave.0 {
                wave = (load.harmonic, { turns }.to(load.harmonic as usize));
            }
            let [cos, sin] = wave.1;
            let value = size * (load.cosine * cos + load.sine * sin);
            let row = model.model.basis.row(load.port);
            for (a, b) in row.iter().enumerate() {
                force[a] += b * value;
                input += value * b * state[n + a];
            }
        }
        let mut friction_loss = 0.0;
        for (k, (e, slider)) in model.sliders.iter().enumerate() {
            let element = &model.elements[*e];
            let (u, du) = model.at(3 * e, state);
            let kt = slider.gripping_stiffness(element.friction_coefficient);
            let tangential = [state[first + 2 * k], state[first + 2 * k + 1]];
            let load = slider.bilateral_load(u[2]);
            let is_closed = self.modes[k][0] != Mode::Open;
            let normal = if is_closed { load } else { 0.0 };
            let rise = slider.normal_stiffness * du[2];
            let rate = self.friction_rate(k, element, kt, tangential, du, rise);
            out[first + 2 * k..][..2].copy_from_slice(&rate);
            if kt > 0.0 {
                for d in 0..2 {
                    friction_loss += tangential[d] * (du[d] - rate[d] / kt);
                }
            }
            let on = [tangential[0], tangential[1], normal - slider.normal_load];
            for (d, on) in on.iter().enumerate() {
                let row = model.model.basis.row(3 * e + d);
                for (force, b) in force.iter_mut().zip(row) {
                    *force -= b * on;
                }
            }
        }
        for (e, element) in model.elements.iter().enumerate() {
            if element.springs.is_empty() {
                continue;
            }
            let (u, _) = model.at(3 * e, state);
            for spring in &element.springs {
                let d = spring.direction();
                let [on, _] = spring.force(u[d]);
                let row = model.model.basis.row(3 * e + d);
                for (force, b) in force.iter_mut().zip(row) {
                    *force -= b * on;
                }
            }
        }
        let (q, v) = (&state[..n], &state[n..2 * n]);
        let mut viscous = 0.0;
        for a in 0..n {
            let elastic = product(model.model.stiffness.row(a), q);
            let damping = product(model.model.damping.row(a), v);
            viscous += v[a] * damping;
            force[a] -= elastic + damping;
        }
        for a in 0..n {
            out[a] = v[a];
            out[n + a] = product(model.inverse_mass.row(a), &force);
        }
        self.force = force;
        if let Some(harmonics) = self.harmonics {
            let rest = &mut out[self.scales.len()..];
            let scale = self.omega / TAU;
            rest[..3].copy_from_slice(&[input, friction_loss, viscous]);
            let basis = basis(harmonics, turns);
            let count = basis.len();
            for port in 0..model.model.basis.rows() {
                let u = product(model.model.basis.row(port), q);
                for (c, b) in basis.iter().enumerate() {
                    rest[3 + port * count + c] = Harmonics::weight(c) * scale * u * b;
                }
            }
        }
    }

    fn friction_rate(
        &self,
        k: usize,
        element: &ContactElement,
        kt: f64,
        force: [f64; 2],
        du: [f64; 3],
        rise: f64,
    ) -> [f64; 2] {
        let modes = self.modes[k];
        if modes[0] == Mode::Open || kt == 0.0 {
            return [0.0; 2];
        }
        let mu = element.friction_coefficient;
        match element.law {
            FrictionLaw::Box => [0, 1].map(|d| match modes[d] {
                Mode::Slip => direction(force[d], du[d]) * mu * rise,
                _ => kt * du[d],
            }),
            FrictionLaw::Cone if modes[0] == Mode::Slip => {
                let along = along(force, du);
                let part = along[0] * du[0] + along[1] * du[1];
                [0, 1].map(|d| kt * (du[d] - part * along[d]) + mu * rise * along[d])
            }
            FrictionLaw::Cone => [kt * du[0], kt * du[1]],
        }
    }
}

fn product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
