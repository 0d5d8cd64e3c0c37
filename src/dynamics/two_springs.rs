//! A mass that hangs on one spring while its contact is open and on two while it is closed, under harmonic loads. Between opening and closing
//! its motion is the steady one of that spring and a decaying one of its natural frequency, so that only the instants of both are to
//! be found.

use std::cell::Cell;
use std::f64::consts::{PI, TAU};

use num_complex::Complex64;

/// Newton's steps to a periodic motion, and its change over a period, relative to its size.
const STEPS: usize = 12;
const PERIODIC: f64 = 1e-10;
/// Difference by which the map over a period is derived, relative to the size of a motion.
const DIFFERENCE: f64 = 1e-6;
/// Steps in the period of what is faster, of the loads and of the mass on its spring, between which opening and closing are looked for, and
/// steps to the instant of one.
const LOOKS: f64 = 16.0;
const CROSSING: usize = 20;
/// Events in a period at most.
const MOST_EVENTS: usize = 2_000;
/// Samples from which the first harmonic of a motion is found.
const SAMPLES: usize = 256;
/// Speeds between which a resonance is looked for, in parts of that which takes the mass from the rest of the closed contact to its edge, how
/// many are looked at, and bisections between two of them.
const SPEEDS: [f64; 2] = [1e-3, 1e6];
const LOOKED_AT: usize = 36;
const BISECTIONS: usize = 24;
/// The mass, its springs and its loads.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct TwoSprings {
    pub(super) mass: f64,
    pub(super) damping: f64,
    /// Stiffness with the contact open and closed \[N/m\], and the steady force on each \[N\].
    pub(super) stiffness: [f64; 2],
    pub(super) steady: [f64; 2],
    /// Where the contact opens \[m\].
    pub(super) edge: f64,
    /// Harmonics of the loads and their complex amplitudes, and of those that grow with the square of their frequency.
    pub(super) loads: Vec<(u32, Complex64)>,
    pub(super) inertial_loads: Vec<(u32, Complex64)>,
}

/// Where the mass is \[m\], and how fast \[m/s\].
pub(super) type State = [f64; 2];

/// How large a periodic motion is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Shape {
    /// Half ranges of its first harmonic and of the displacement \[m\].
    pub(super) first_harmonic: f64,
    pub(super) half_range: f64,
    /// Mean displacement \[m\].
    pub(super) mean: f64,
    /// How far beyond the edge it goes at least, of both sides, in parts of its half range; below 0 where it stays on one.
    pub(super) beyond: f64,
}

impl Shape {
    /// Whether the contact opens and closes.
    pub(super) fn bounces(&self) -> bool {
        self.beyond > 0.0
    }
}

/// The mass at an angular frequency, under loads so many times as large.
pub(super) struct Drive<'a> {
    model: &'a TwoSprings,
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

impl TwoSprings {
    /// Whether a load moves the mass.
    pub(super) fn is_loaded(&self) -> bool {
        !(self.loads.is_empty() && self.inertial_loads.is_empty())
    }

    /// Whether damping lets it swing on each spring.
    pub(super) fn swings(&self) -> bool {
        self.damping.powi(2) < 4.0 * self.mass * self.stiffness[0]
    }
}

/// A motion without loads and damping in which the contact opens and closes once.
struct Swing {
    /// Angular frequency \[rad/s\].
    omega: f64,
    /// Where it turns back, open and closed \[m\].
    apexes: [f64; 2],
    /// Half range of its first harmonic \[m\], and what the damping takes of it in its period \[J\].
    first_harmonic: f64,
    loss: f64,
}

impl TwoSprings {
    /// States at the phase 0 that resonate with a harmonic of the loads, with the angular frequencies of the drive: motions without loads and
    /// damping, of speeds at the edge in `parts` of the largest of which the loads supply what the damping takes, at the two phases at
    /// which they do.
    pub(super) fn resonant(&self, parts: &[f64]) -> Vec<(f64, State)> {
        // What nothing damps may resonate without bound.
        if self.damping == 0.0 {
            return Vec::new();
        }
        let free = self.free();
        let swing = |speed: f64| self.swing(&free, speed);
        let mut out = Vec::new();
        for order in self.orders() {
            let force = |swing: &Swing| self.force(order, swing.omega / f64::from(order));
            // Damping takes no more than the loads supply at the best phase.
            let needed =
                |swing: &Swing| swing.loss / (PI * force(swing).norm() * swing.first_harmonic);
            let Some(largest) = largest_speed(self.unit_speed(), |speed| {
                swing(speed).is_some_and(|swing| needed(&swing) < 1.0)
            }) else {
                continue;
            };
            for part in parts {
                let Some(swing) = swing(part * largest) else {
                    continue;
                };
                let behind = needed(&swing).min(1.0).asin();
                let omega = swing.omega / f64::from(order);
                let drive = Drive::new(self, omega, 1.0);
                let period = TAU / omega;
                for phase in [-behind, behind - PI] {
                    let at = (phase - force(&swing).arg()) / swing.omega;
                    let at = at.rem_euclid(period);
                    let start = drive.over(at, period - at, [swing.apexes[0], 0.0]);
                    out.extend(start.map(|state| (omega, state)));
                }
            }
        }
        out
    }

    /// Mean of the normal load over a motion \[N\]: what the spring of the open mass leaves of the steady force.
    pub(super) fn mean_load(&self, shape: &Shape) -> f64 {
        self.steady[0] - self.stiffness[0] * shape.mean
    }

    /// What the mean of the normal load does not exceed in any motion with the period of the drive \[N\]. Damping takes no more than the loads supply,
    /// which bounds the speed, and so how far the mean of a motion is from the edge that it touches. One that stays closed has less.
    pub(super) fn most_mean_load(&self, omega: f64) -> f64 {
        if self.damping == 0.0 {
            return f64::INFINITY;
        }
        let squares = self
            .orders()
            .into_iter()
            .map(|order| self.force(order, omega).norm_sqr());
        let speed = (0.5 * squares.sum::<f64>()).sqrt() / self.damping;
        let range = PI * speed / omega;
        (self.steady[0] - self.stiffness[0] * (self.edge - range)).max(0.0)
    }

    /// The mass without loads that move it, and without damping.
    fn free(&self) -> TwoSprings {
        TwoSprings {
            damping: 0.0,
            loads: Vec::new(),
            inertial_loads: Vec::new(),
            ..self.clone()
        }
    }

    /// What damping takes of a motion in its period \[J\].
    fn loss(&self, states: &[State], period: f64) -> f64 {
        let squares = states.iter().map(|state| state[1] * state[1]);
        self.damping * period * squares.sum::<f64>() / states.len() as f64
    }

    /// Whether damping takes no more of a motion, in each period of the drive, than the load of an order supplies at the best phase.
    pub(super) fn may_last(&self, drive: &Drive<'_>, order: u32, state: State) -> bool {
        let Some(states) = drive.sampled(state) else {
            return false;
        };
        let supplied = PI * f64::from(order) * self.force(order, drive.omega).norm();
        self.loss(&states, TAU / drive.omega) <= supplied * harmonic(&states, order)
    }

    /// Harmonics of the loads, each once.
    pub(super) fn orders(&self) -> Vec<u32> {
        let all = self.loads.iter().chain(&self.inertial_loads);
        let mut orders: Vec<u32> = all.map(|load| load.0).collect();
        orders.sort_unstable();
        orders.dedup();
        orders
    }

    /// Complex amplitude of the loads of a harmonic of the drive \[N\].
    pub(super) fn force(&self, order: u32, omega: f64) -> Complex64 {
        let rate = f64::from(order) * omega;
        let of = |loads: &[(u32, Complex64)]| -> Complex64 {
            let all = loads.iter().filter(|load| load.0 == order);
            all.map(|load| load.1).sum()
        };
        of(&self.loads) + of(&self.inertial_loads) * rate * rate
    }

    /// The speed with which the mass on its closed contact swings between its rest and the edge \[m/s\].
    fn unit_speed(&self) -> f64 {
        let closed = self.stiffness[1];
        (self.steady[1] / closed - self.edge).abs() * (closed / self.mass).sqrt()
    }

    /// The motion of the mass without loads and damping (`free`) that crosses the edge at a speed.
    fn swing(&self, free: &TwoSprings, speed: f64) -> Option<Swing> {
        let natural = self
            .stiffness
            .map(|stiffness| (stiffness / self.mass).sqrt());
        let beyond = [0, 1].map(|spring| self.steady[spring] / self.stiffness[spring] - self.edge);
        // Out of contact to the left of the edge, in it to the right: each a part of the turn about the rest of its spring.
        let out = 2.0 / natural[0] * (speed / natural[0]).atan2(beyond[0]);
        let within = 2.0 / natural[1] * (speed / natural[1]).atan2(-beyond[1]);
        let period = out + within;
        let reach = [0, 1].map(|spring| beyond[spring].hypot(speed / natural[spring]));
        let apexes = [beyond[0] - reach[0], beyond[1] + reach[1]].map(|apart| self.edge + apart);
        let drive = Drive::new(free, TAU / period, 1.0);
        let states = drive.sampled([apexes[0], 0.0])?;
        Some(Swing {
            omega: TAU / period,
            apexes,
            first_harmonic: harmonic(&states, 1),
            loss: self.loss(&states, period),
        })
    }
}

/// The largest speed that damping allows, in units of one; none where it allows none. Small motions may take more than larger ones, which are
/// slower.
fn largest_speed(unit: f64, is_allowed: impl Fn(f64) -> bool) -> Option<f64> {
    let [least, most] = SPEEDS;
    let parts = LOOKED_AT as f64;
    let at = |k: usize| unit * least * (most / least).powf(k as f64 / parts);
    let largest = (0..LOOKED_AT).rev().find(|k| is_allowed(at(*k)))?;
    let (mut low, mut high) = (at(largest), at(largest + 1));
    for _ in 0..BISECTIONS {
        let middle = (low * high).sqrt();
        match is_allowed(middle) {
            true => low = middle,
            false => high = middle,
        }
    }
    Some(low)
}

impl<'a> Drive<'a> {
    pub(super) fn new(model: &'a TwoSprings, omega: f64, factor: f64) -> Drive<'a> {
        let TwoSprings { mass, damping, .. } = *model;
        let orders = model.orders();
        let waves = model.stiffness.map(|stiffness| {
            let waves = orders.iter().map(|order| {
                let rate = f64::from(*order) * omega;
                let impedance = Complex64::new(stiffness - mass * rate * rate, damping * rate);
                (rate, factor * model.force(*order, omega) / impedance)
            });
            waves.collect()
        });
        let decay = damping / (2.0 * mass);
        let natural = model
            .stiffness
            .map(|stiffness| (stiffness / mass - decay * decay).sqrt());
        let fastest = f64::from(orders.last().copied().unwrap_or(1)) * omega;
        Drive {
            model,
            omega,
            waves,
            decay,
            natural,
            look: natural.map(|natural| TAU / (LOOKS * natural.max(fastest))),
            evaluations: Default::default(),
        }
    }

    /// How far the closed contact is pressed at rest, and what the loads move it by at most \[m\].
    pub(super) fn of_closed(&self) -> [f64; 2] {
        let (steady, stiffness) = (self.model.steady[1], self.model.stiffness[1]);
        let moved = self.waves[1].iter().map(|(_, wave)| wave.norm()).sum();
        [(steady / stiffness - self.model.edge).abs(), moved]
    }

    /// How often a motion was evaluated so far: what has been spent.
    pub(super) fn evaluations(&self) -> usize {
        self.evaluations.get()
    }

    /// The steady motion of a spring at a time.
    fn steady(&self, spring: usize, time: f64) -> State {
        let rest = self.model.steady[spring] / self.model.stiffness[spring];
        let waves = self.waves[spring].iter();
        waves.fold([rest, 0.0], |[z, v], (rate, wave)| {
            let now = wave * Complex64::cis(rate * time);
            [z + now.re, v - rate * now.im]
        })
    }

    /// What a state is apart from the steady motion of a spring at a time.
    fn apart(&self, spring: usize, time: f64, state: State) -> State {
        let steady = self.steady(spring, time);
        [state[0] - steady[0], state[1] - steady[1]]
    }

    /// The state `after` a time at which it was so far `apart` from the steady motion, on a spring throughout; and how far it is then.
    fn on_spring(&self, spring: usize, time: f64, [z, v]: State, after: f64) -> [State; 2] {
        self.evaluations.set(self.evaluations.get() + 1);
        let steady = self.steady(spring, time + after);
        let (natural, decay) = (self.natural[spring], self.decay);
        let (sin, cos) = (natural * after).sin_cos();
        let left = (-decay * after).exp();
        let slope = (v + decay * z) / natural;
        let apart = [
            left * (z * cos + slope * sin),
            left * (v * cos - (natural * z + decay * slope) * sin),
        ];
        [[steady[0] + apart[0], steady[1] + apart[1]], apart]
    }

    /// The state a period after that at the phase 0.
    pub(super) fn period(&self, state: State) -> Option<State> {
        self.over(0.0, TAU / self.omega, state)
    }

    /// The state `after` a time at which it was `state`; none where events do not come to an end.
    pub(super) fn over(&self, mut time: f64, after: f64, mut state: State) -> Option<State> {
        let (edge, end) = (self.model.edge, time + after);
        let mut spring = usize::from(state[0] > edge || state[0] == edge && state[1] > 0.0);
        for _ in 0..MOST_EVENTS {
            let is_over = |z: f64| match spring {
                0 => z > edge,
                _ => z < edge,
            };
            let mut apart = self.apart(spring, time, state);
            loop {
                let step = self.look[spring].min(end - time);
                let [next, left] = self.on_spring(spring, time, apart, step);
                if !is_over(next[0]) {
                    (time, state, apart) = (time + step, next, left);
                    if time >= end {
                        return next[0].is_finite().then_some(next);
                    }
                    continue;
                }
                let there = |after: f64| self.on_spring(spring, time, apart, after)[0];
                let beyond = |after: f64| there(after)[0] - edge;
                let after = crossing(beyond, [state[0] - edge, next[0] - edge], step);
                state = there(after);
                (time, spring) = (time + after, 1 - spring);
                break;
            }
            if time >= end {
                return Some(state);
            }
        }
        None
    }

    /// The periodic motion near a state, by Newton's method on the map over a period.
    pub(super) fn periodic(&self, mut state: State) -> Option<State> {
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

    pub(super) fn omega(&self) -> f64 {
        self.omega
    }

    /// How large the periodic motion from a state is.
    pub(super) fn shape(&self, state: State) -> Option<Shape> {
        let states = self.sampled(state)?;
        let displacements = states.iter().map(|state| state[0]);
        let mean = displacements.clone().sum::<f64>() / states.len() as f64;
        let least = displacements.clone().fold(f64::INFINITY, f64::min);
        let most = displacements.fold(f64::NEG_INFINITY, f64::max);
        let (half_range, edge) = (0.5 * (most - least), self.model.edge);
        Some(Shape {
            first_harmonic: harmonic(&states, 1),
            half_range,
            mean,
            beyond: (edge - least).min(most - edge) / half_range,
        })
    }

    /// The states of the motion from one at the phase 0, over a period.
    fn sampled(&self, mut state: State) -> Option<Vec<State>> {
        let step = TAU / self.omega / SAMPLES as f64;
        let mut states = Vec::with_capacity(SAMPLES);
        for k in 0..SAMPLES {
            states.push(state);
            state = self.over(k as f64 * step, step, state)?;
        }
        Some(states)
    }
}

/// When a function crosses zero between 0 and `step`, at which it has the values `ends`: by false position, where the end that stays counts half
/// (Illinois). The instant is not before the crossing.
fn crossing(function: impl Fn(f64) -> f64, ends: [f64; 2], step: f64) -> f64 {
    let (mut low, mut high) = ([0.0, ends[0]], [step, ends[1]]);
    for _ in 0..CROSSING {
        let middle = match low[1] - high[1] {
            0.0 => 0.5 * (low[0] + high[0]),
            rise => low[0] + (high[0] - low[0]) * low[1] / rise,
        };
        let there = function(middle);
        if there * high[1] > 0.0 {
            high = [middle, there];
            low[1] *= 0.5;
        } else {
            low = [middle, there];
            high[1] *= 0.5;
        }
        if high[0] - low[0] <= f64::EPSILON * step || there == 0.0 {
            break;
        }
    }
    high[0]
}

/// Half range of a harmonic of the displacement over a period \[m\].
fn harmonic(states: &[State], order: u32) -> f64 {
    let waves = states.iter().enumerate().map(|(k, state)| {
        let phase = TAU * f64::from(order) * k as f64 / states.len() as f64;
        state[0] * Complex64::cis(-phase)
    });
    2.0 / states.len() as f64 * waves.sum::<Complex64>().norm()
}
