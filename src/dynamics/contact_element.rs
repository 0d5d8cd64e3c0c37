//! The three-dimensional contact element [A §2b, fig. 3]: two coupled Jenkins elements in the plane, a unilateral spring along
//! the normal.
//!
//! Normal load `N(t) = max(0, N₀ + k_n (u_n − g₀))`; the tangential force `T = k_t (u_t − w)` follows the slider w, which moves
//! when `T` would leave the friction limit of `N(t)`. Without load the slider goes with the displacement and `T = 0`.
//!
//! *Start of the slider.* A mean tangential force can be locked in by friction, so the mean is unique only together with a
//! history. It is this one: at the preloaded state u = 0 and w = 0; from there to the first sample in one step, then cycle after
//! cycle to the steady one. Between samples the displacement goes straight and the load changes linearly, for which the law is
//! integrated exactly. Where the march closes slowly, the steady cycle is the fixed point of the force over one cycle, found by
//! Newton's method; it is that of the march as long as the element slips in it.

use super::DynamicsError;
use super::aft::{Closure, Derivative, InterfaceElement};
use super::slider::{self, Dual, INPUTS, Number, Step};

/// Cycles marched one after the other. The memory of most motions is gone after one; an element that slips by much less than it
/// stretches forgets a force across its motion over hundreds, and from here on its steady cycle is looked for.
const PLAIN_CYCLES: usize = 4;
/// Cycles at most until the steady one is found.
const MOST_CYCLES: usize = 2000;
/// A guess of the steady force is taken if it changes over a cycle by less than this share of the change before.
const BETTER: f64 = 0.8;
/// Change of the force over a cycle, relative to its largest value, at which the cycle is steady: rounding over its samples.
const STEADY: f64 = 1e-12;

/// Determinant of 1 − A below which a cycle forgets nothing; that of a force which decays over 1e5 cycles is larger.
const FORGETS: f64 = 1e-6;

/// How friction limits the two tangential forces of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize)]
#[serde(rename_all = "snake_case")]
pub enum FrictionLaw {
    /// `|T| ≤ µN`: isotropic, slip along the force.
    #[default]
    Cone,
    /// `|T_x| ≤ µN` and `|T_y| ≤ µN`, independent of each other.
    Box,
}

/// What an element does over a cycle at its worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ElementState {
    /// Loaded and without slip throughout.
    Stick,
    /// Loaded throughout, slips somewhere.
    Slip,
    /// Without load somewhere.
    Open,
}

/// Parameters of a contact element.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactElement {
    /// Area A \[m²\]; enters sums over elements, not the law.
    pub area: f64,
    /// Friction coefficient µ.
    pub friction_coefficient: f64,
    /// Normal load N₀ at u = 0 \[N\].
    pub normal_load: f64,
    /// Gap g₀ at u = 0 \[m\]; only an unloaded element has one.
    pub gap: f64,
    /// Tangential stiffness k_t \[N/m\].
    pub tangential_stiffness: f64,
    /// Normal stiffness k_n \[N/m\].
    pub normal_stiffness: f64,
    /// Friction law.
    pub law: FrictionLaw,
}

/// Forces and slip of one element over its steady cycle, at the samples of the displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementCycle {
    /// `[T_x, T_y, N]` \[N\]; N is the whole normal load, not its change.
    pub force: Vec<[f64; 3]>,
    /// Position of the slider, (x, y) \[m\].
    pub slider: Vec<[f64; 2]>,
    /// Energy dissipated in one cycle, Σ T·Δw \[J\].
    pub dissipated_energy: f64,
    /// Path of the slider in one cycle, Σ |Δw| \[m\].
    pub slip_path: f64,
    /// The worst state.
    pub state: ElementState,
    /// How well it closes.
    pub closure: Closure,
}

impl ContactElement {
    /// Normal load at the normal displacement `u` without the limit at zero \[N\].
    fn bilateral_load(&self, u: f64) -> f64 {
        self.normal_load + self.normal_stiffness * (u - self.gap)
    }

    /// Tangential stiffness, or none if there is no friction to hold it.
    fn gripping_stiffness(&self) -> f64 {
        if self.friction_coefficient > 0.0 {
            self.tangential_stiffness
        } else {
            0.0
        }
    }

    /// Forces and slip over the steady cycle of `displacement` (`[x, y, n]` at equidistant samples).
    pub fn cycle(&self, displacement: &[[f64; 3]]) -> ElementCycle {
        let mut force = vec![[0.0; 3]; displacement.len()];
        let closure = self.sample(displacement, &mut force, None);
        let kt = self.gripping_stiffness();
        let mut cycle = ElementCycle {
            force,
            slider: Vec::with_capacity(displacement.len()),
            dissipated_energy: 0.0,
            slip_path: 0.0,
            state: ElementState::Stick,
            closure,
        };
        for (u, force) in displacement.iter().zip(&mut cycle.force) {
            let load = self.bilateral_load(u[2]);
            force[2] = load.max(0.0);
            let lag = |d: usize| if kt > 0.0 { force[d] / kt } else { 0.0 };
            cycle.slider.push([u[0] - lag(0), u[1] - lag(1)]);
            if load <= 0.0 {
                cycle.state = ElementState::Open;
            }
        }
        let Some(&last) = cycle.slider.last() else {
            return cycle;
        };
        let scale = displacement
            .iter()
            .fold(0.0_f64, |s, u| s.max(u[0].abs()).max(u[1].abs()));
        let mut before = last;
        for (slider, force) in cycle.slider.iter().zip(&cycle.force) {
            let moved = [slider[0] - before[0], slider[1] - before[1]];
            before = *slider;
            let path = moved[0].hypot(moved[1]);
            // Rounding of u − T/k_t is not slip.
            if path > 8.0 * f64::EPSILON * scale {
                cycle.dissipated_energy += force[0] * moved[0] + force[1] * moved[1];
                cycle.slip_path += path;
                cycle.state = cycle.state.max(ElementState::Slip);
            }
        }
        cycle
    }
}

impl InterfaceElement for ContactElement {
    fn check(&self, element: usize) -> Result<(), DynamicsError> {
        let numbers = [
            ("the area", self.area),
            ("the friction coefficient", self.friction_coefficient),
            ("the normal load", self.normal_load),
            ("the gap", self.gap),
            ("the tangential stiffness", self.tangential_stiffness),
            ("the normal stiffness", self.normal_stiffness),
        ];
        for (name, value) in numbers {
            if !(value >= 0.0 && value.is_finite()) {
                return Err(DynamicsError::Element {
                    element,
                    name,
                    value,
                    expected: "a finite number, zero or more",
                });
            }
        }
        if self.gap > 0.0 && self.normal_load > 0.0 {
            return Err(DynamicsError::Element {
                element,
                name: "the gap",
                value: self.gap,
                expected: "zero where there is a normal load: an element that is open at rest bears none",
            });
        }
        Ok(())
    }

    fn reference_stiffness(&self) -> [f64; 3] {
        let bears = self.normal_load > 0.0 || (self.gap == 0.0 && self.normal_stiffness > 0.0);
        if bears {
            let kt = self.gripping_stiffness();
            [kt, kt, self.normal_stiffness]
        } else {
            [0.0; 3]
        }
    }

    fn follows_reference(&self, displacement: &[[f64; 3]]) -> bool {
        let [kt, _, kn] = self.reference_stiffness();
        let bears = self.normal_load > 0.0 || kn > 0.0;
        displacement.iter().all(|u| {
            let load = self.bilateral_load(u[2]);
            if !bears {
                return load <= 0.0;
            }
            let limit = self.friction_coefficient * load;
            let inside = match self.law {
                FrictionLaw::Cone => slider::magnitude([kt * u[0], kt * u[1]]) <= limit,
                FrictionLaw::Box => (kt * u[0]).abs() <= limit && (kt * u[1]).abs() <= limit,
            };
            load >= 0.0 && inside
        })
    }

    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut Derivative<'_>>,
    ) -> Closure {
        if let Some(derivative) = derivative.as_deref_mut() {
            derivative.values.fill(0.0);
        }
        self.normal_forces(displacement, force, derivative.as_deref_mut());
        if self.gripping_stiffness() == 0.0 {
            return Closure::EXACT;
        }
        let march = March {
            element: self,
            displacement,
        };
        march.run(force, derivative)
    }
}

impl ContactElement {
    fn normal_forces(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut Derivative<'_>>,
    ) {
        for (j, (u, force)) in displacement.iter().zip(force).enumerate() {
            let load = self.bilateral_load(u[2]);
            *force = [0.0, 0.0, load.max(0.0) - self.normal_load];
            if load > 0.0
                && let Some(derivative) = derivative.as_deref_mut()
            {
                let n = derivative.coefficients;
                for c in 0..n {
                    let slope = self.normal_stiffness * derivative.basis_at(j)[c];
                    derivative.row_mut(j, 2)[2 * n + c] = slope;
                }
            }
        }
    }
}

/// The slider over the samples of a cycle.
struct March<'a> {
    element: &'a ContactElement,
    displacement: &'a [[f64; 3]],
}

/// One cycle of the slider.
struct Lap {
    /// Force at its end.
    end: [f64; 2],
    /// Largest force.
    largest: f64,
    /// Whether it neither slipped nor opened.
    stuck: bool,
}

/// Derivatives of a step: of both forces with respect to its inputs.
type Slopes = [[f64; INPUTS]; 2];

impl March<'_> {
    /// From the preload to the steady cycle, with derivatives.
    fn run(&self, force: &mut [[f64; 3]], mut derivative: Option<&mut Derivative<'_>>) -> Closure {
        let Some(&last) = self.displacement.last() else {
            return Closure::EXACT;
        };
        let mut tangent = vec![0.0; derivative.as_ref().map_or(0, |d| 6 * d.coefficients)];
        let mut slopes = Vec::new();
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        for cycle in 1..=PLAIN_CYCLES {
            let lap = match derivative.as_deref_mut() {
                None => self.lap(start, from, force),
                Some(derivative) => {
                    let lap = self.lap_with_slopes(start, from, force, &mut slopes);
                    self.propagate(&slopes, cycle > 1, &mut tangent, derivative);
                    lap
                }
            };
            // Without slip the next cycle is this one; after the first, the start was the preload rather than a cycle.
            let closure = lap.closure(cycle, start);
            if closure.change == 0.0 || cycle > 1 && closure.change <= STEADY {
                return closure;
            }
            (start, from) = (lap.end, last);
        }
        self.settle(start, last, force, &mut slopes, derivative, tangent)
    }

    /// The steady cycle near the force `start` at its beginning; `tangent` is the derivative of that force.
    fn settle(
        &self,
        mut start: [f64; 2],
        last: [f64; 3],
        force: &mut [[f64; 3]],
        slopes: &mut Vec<Slopes>,
        derivative: Option<&mut Derivative<'_>>,
        mut tangent: Vec<f64>,
    ) -> Closure {
        let mut cycle = PLAIN_CYCLES;
        // After a guess that was none, so many cycles are marched before the next.
        let (mut wait, mut patience) = (0_usize, 1_usize);
        let (lap, closure) = loop {
            let lap = if wait > 0 {
                self.lap(start, last, force)
            } else {
                self.lap_with_slopes(start, last, force, slopes)
            };
            cycle += 1;
            let closure = lap.closure(cycle, start);
            if closure.change <= STEADY || cycle >= MOST_CYCLES {
                break (lap, closure);
            }
            let change = [lap.end[0] - start[0], lap.end[1] - start[1]];
            start = lap.end;
            if wait > 0 {
                wait -= 1;
                continue;
            }
            let before = [lap.end[0] - change[0], lap.end[1] - change[1]];
            let guess = unforgotten(slopes).and_then(|map| {
                let jump = map.map(|row| row[0] * change[0] + row[1] * change[1]);
                // Where slip is about to end, the whole way leads to where there is none: any force is steady there, but it is not
                // the one that the march leads to.
                [1.0, 0.5, 0.25].into_iter().find_map(|share| {
                    let guess = [before[0] + share * jump[0], before[1] + share * jump[1]];
                    let there = self.lap(guess, last, force);
                    cycle += 1;
                    let left = [there.end[0] - guess[0], there.end[1] - guess[1]];
                    let better = slider::magnitude(left) <= BETTER * slider::magnitude(change);
                    (!there.stuck && better).then_some(there.end)
                })
            });
            match guess {
                Some(end) => (start, patience) = (end, 1),
                None => (wait, patience) = (patience, 2 * patience),
            }
        };
        if let Some(derivative) = derivative {
            self.lap_with_slopes(start, last, force, slopes);
            // The derivative of a fixed point forgets how it was found. Where it remembers, that of the march is the best there is.
            if !lap.stuck
                && let Some(map) = unforgotten(slopes)
            {
                tangent.fill(0.0);
                self.propagate(slopes, true, &mut tangent, derivative);
                let (first, second) = tangent.split_at_mut(3 * derivative.coefficients);
                for (a, b) in first.iter_mut().zip(second) {
                    let ends = [*a, *b];
                    [*a, *b] = map.map(|row| row[0] * ends[0] + row[1] * ends[1]);
                }
            }
            self.propagate(slopes, true, &mut tangent, derivative);
        }
        closure
    }

    /// Displacement increment and normal loads of the step to sample `j` of a cycle that starts at the displacement `from`.
    fn inputs(&self, j: usize, from: [f64; 3]) -> ([f64; 2], [f64; 2]) {
        let before = if j == 0 {
            from
        } else {
            self.displacement[j - 1]
        };
        let now = self.displacement[j];
        (
            [now[0] - before[0], now[1] - before[1]],
            [before, now].map(|u| self.element.bilateral_load(u[2])),
        )
    }

    fn lap(&self, start: [f64; 2], from: [f64; 3], force: &mut [[f64; 3]]) -> Lap {
        let element = self.element;
        let (kt, mu) = (element.tangential_stiffness, element.friction_coefficient);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(element.law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            (force[0], force[1]) = (next[0], next[1]);
        }
        lap
    }

    fn lap_with_slopes(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 3]],
        slopes: &mut Vec<Slopes>,
    ) -> Lap {
        let element = self.element;
        let (kt, mu) = (element.tangential_stiffness, element.friction_coefficient);
        let mut lap = Lap::new(start);
        slopes.clear();
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (plain, step) = slider::step(element.law, kt, mu, lap.end, delta, loads);
            // Most steps are sticking ones, whose derivatives are constants.
            let (next, step) = match step {
                Step::Open => ([Dual::constant(0.0); 2], step),
                Step::Stick if loads[0] >= 0.0 => {
                    let stuck = |d: usize| {
                        let mut slope = [0.0; INPUTS];
                        (slope[d], slope[2 + d]) = (1.0, kt);
                        let value = plain[d];
                        Dual { value, slope }
                    };
                    ([stuck(0), stuck(1)], step)
                }
                _ => {
                    let pair = |values: [f64; 2], index: usize| {
                        [
                            Dual::input(values[0], index),
                            Dual::input(values[1], index + 1),
                        ]
                    };
                    let (force, delta, loads) = (pair(lap.end, 0), pair(delta, 2), pair(loads, 4));
                    slider::step(element.law, kt, mu, force, delta, loads)
                }
            };
            slopes.push(next.map(|n| n.slope));
            let next = next.map(|n| n.value);
            lap.advance(next, step);
            (force[0], force[1]) = (next[0], next[1]);
        }
        lap
    }

    /// Carries the derivative of the force over a cycle and stores it at every sample; `follows`: the cycle follows another.
    fn propagate(
        &self,
        slopes: &[Slopes],
        follows: bool,
        tangent: &mut [f64],
        derivative: &mut Derivative<'_>,
    ) {
        let n = derivative.coefficients;
        let width = 3 * n;
        let kn = self.element.normal_stiffness;
        let nothing = vec![0.0; n];
        for (j, [x, y]) in slopes.iter().enumerate() {
            let (first, second) = tangent.split_at_mut(width);
            for (a, b) in first.iter_mut().zip(second.iter_mut()) {
                (*a, *b) = (x[0] * *a + x[1] * *b, y[0] * *a + y[1] * *b);
            }
            let now = derivative.basis_at(j);
            let before = match j {
                0 if follows => derivative.basis_at(slopes.len() - 1),
                0 => &nothing,
                _ => derivative.basis_at(j - 1),
            };
            // Before the first sample there is the preload, on which no coefficient acts.
            for c in 0..n {
                let change = now[c] - before[c];
                for (row, slope) in [(&mut *first, x), (&mut *second, y)] {
                    row[c] += slope[2] * change;
                    row[n + c] += slope[3] * change;
                    row[2 * n + c] += kn * (slope[4] * before[c] + slope[5] * now[c]);
                }
            }
            derivative.row_mut(j, 0).copy_from_slice(&tangent[..width]);
            derivative.row_mut(j, 1).copy_from_slice(&tangent[width..]);
        }
    }
}

/// (1 − A)⁻¹, with A the derivative of the force at the end of a cycle with respect to that at its beginning; none if a cycle
/// forgets nothing of it.
fn unforgotten(slopes: &[Slopes]) -> Option<[[f64; 2]; 2]> {
    let mut a = [[1.0, 0.0], [0.0, 1.0]];
    for [x, y] in slopes {
        a = [x, y].map(|row| [0, 1].map(|c| row[0] * a[0][c] + row[1] * a[1][c]));
    }
    let m = [[1.0 - a[0][0], -a[0][1]], [-a[1][0], 1.0 - a[1][1]]];
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (determinant.abs() > FORGETS).then(|| {
        [
            [m[1][1] / determinant, -m[0][1] / determinant],
            [-m[1][0] / determinant, m[0][0] / determinant],
        ]
    })
}

impl Lap {
    /// How well a lap from the force `start` closes.
    fn closure(&self, cycles: usize, start: [f64; 2]) -> Closure {
        let change = slider::magnitude([self.end[0] - start[0], self.end[1] - start[1]]);
        Closure {
            cycles,
            change: if self.stuck || self.largest == 0.0 {
                0.0
            } else {
                change / self.largest
            },
            largest: self.largest,
        }
    }

    fn new(start: [f64; 2]) -> Lap {
        Lap {
            end: start,
            largest: 0.0,
            stuck: true,
        }
    }

    fn advance(&mut self, next: [f64; 2], step: Step) {
        self.end = next;
        self.largest = self.largest.max(slider::magnitude(next));
        self.stuck &= step == Step::Stick;
    }
}
