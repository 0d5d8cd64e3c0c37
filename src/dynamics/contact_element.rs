//! The three-dimensional contact element [A §2b, fig. 3]: two coupled Jenkins elements in the plane, a unilateral spring along
//! the normal.
//!
//! Normal load `N(t) = max(0, N₀ + k_n (u_n − g₀))`; the tangential force `T = k_t (u_t − w)` follows the slider w, which moves
//! when `T` would leave the friction limit of `N(t)`. Without load the slider goes with the displacement and `T = 0`.
//!
//! *Start of the slider.* A mean tangential force can be locked in by friction, so the mean is unique only together with a
//! history. It is this one: at the preloaded state u = 0 and w = 0; from there to the first sample in one step, then cycle after
//! cycle to the steady one.

use super::DynamicsError;
use super::aft::{Closure, Derivative, InterfaceElement};

/// Cycles after which marching gives up; the memory of most motions is gone after one.
const MOST_CYCLES: usize = 400;
/// Change of the force over a cycle, relative to its largest value, at which the cycle is steady: rounding.
const STEADY: f64 = 1e-13;

/// How friction limits the two tangential forces of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
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

#[derive(Clone, Copy, PartialEq)]
enum Step {
    Stick,
    Slip,
    Open,
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

    /// Tangential force after a step from `force` by the displacement `delta`, at the friction limit `limit`.
    fn step(&self, force: [f64; 2], delta: [f64; 2], load: f64) -> ([f64; 2], Step) {
        if load <= 0.0 {
            return ([0.0; 2], Step::Open);
        }
        let (kt, limit) = (self.gripping_stiffness(), self.friction_coefficient * load);
        let trial = [force[0] + kt * delta[0], force[1] + kt * delta[1]];
        match self.law {
            FrictionLaw::Cone => {
                let size = trial[0].hypot(trial[1]);
                if size <= limit {
                    (trial, Step::Stick)
                } else {
                    let scale = limit / size;
                    ([scale * trial[0], scale * trial[1]], Step::Slip)
                }
            }
            FrictionLaw::Box => {
                let clamped = trial.map(|t| t.clamp(-limit, limit));
                let step = if clamped == trial {
                    Step::Stick
                } else {
                    Step::Slip
                };
                (clamped, step)
            }
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
                FrictionLaw::Cone => (kt * u[0]).hypot(kt * u[1]) <= limit,
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
        let mut march = March {
            element: self,
            tangent: vec![0.0; derivative.as_ref().map_or(0, |d| 6 * d.coefficients)],
            force: [0.0; 2],
            displacement: [0.0; 2],
            largest: 0.0,
            previous_sample: None,
        };
        let mut end = [f64::NAN; 2];
        let mut closure = Closure::EXACT;
        for cycle in 1..=MOST_CYCLES {
            let stuck = march.cycle(displacement, force, derivative.as_deref_mut());
            let change = (march.force[0] - end[0]).hypot(march.force[1] - end[1]);
            end = march.force;
            closure = Closure {
                cycles: cycle,
                change: change / march.largest,
            };
            // Without slip the second cycle is the first; without force there is nothing to close.
            if (cycle == 1 && stuck) || march.largest == 0.0 || change <= STEADY * march.largest {
                return Closure {
                    change: 0.0,
                    ..closure
                };
            }
        }
        closure
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

/// The slider on its way: force, and its derivative with respect to all coefficients (two rows of `3 × coefficients`).
struct March<'a> {
    element: &'a ContactElement,
    tangent: Vec<f64>,
    force: [f64; 2],
    displacement: [f64; 2],
    largest: f64,
    previous_sample: Option<usize>,
}

impl March<'_> {
    /// One cycle; returns whether it neither slipped nor opened.
    fn cycle(
        &mut self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut Derivative<'_>>,
    ) -> bool {
        let mut stuck = true;
        self.largest = 0.0;
        for (j, u) in displacement.iter().enumerate() {
            let load = self.element.bilateral_load(u[2]);
            let delta = [u[0] - self.displacement[0], u[1] - self.displacement[1]];
            let (next, step) = self.element.step(self.force, delta, load);
            if let Some(derivative) = derivative.as_deref_mut() {
                self.advance_tangent(j, delta, load, step, next, derivative);
            }
            self.force = next;
            self.displacement = [u[0], u[1]];
            self.previous_sample = Some(j);
            force[j][0] = next[0];
            force[j][1] = next[1];
            self.largest = self.largest.max(next[0].hypot(next[1]));
            stuck &= step == Step::Stick;
        }
        stuck
    }

    fn advance_tangent(
        &mut self,
        j: usize,
        delta: [f64; 2],
        load: f64,
        step: Step,
        next: [f64; 2],
        derivative: &mut Derivative<'_>,
    ) {
        let n = derivative.coefficients;
        let element = self.element;
        let (kt, mu) = (element.gripping_stiffness(), element.friction_coefficient);
        let limit = mu * load;
        if step == Step::Open {
            self.tangent.fill(0.0);
        } else {
            // Of the trial force.
            for c in 0..n {
                let before = self
                    .previous_sample
                    .map_or(0.0, |before| derivative.basis_at(before)[c]);
                let slope = kt * (derivative.basis_at(j)[c] - before);
                self.tangent[c] += slope;
                self.tangent[4 * n + c] += slope;
            }
        }
        if step == Step::Slip {
            let trial = [self.force[0] + kt * delta[0], self.force[1] + kt * delta[1]];
            let (first, second) = self.tangent.split_at_mut(3 * n);
            match element.law {
                FrictionLaw::Cone => {
                    let size = trial[0].hypot(trial[1]);
                    let (x, y) = (trial[0] / size, trial[1] / size);
                    let shrink = limit / size;
                    for (a, b) in first.iter_mut().zip(second.iter_mut()) {
                        // What is across the force stays, turned; what is along it is set by the load.
                        let across = shrink * (x * *b - y * *a);
                        (*a, *b) = (-y * across, x * across);
                    }
                    for c in 0..n {
                        let slope = mu * element.normal_stiffness * derivative.basis_at(j)[c];
                        first[2 * n + c] += x * slope;
                        second[2 * n + c] += y * slope;
                    }
                }
                FrictionLaw::Box => {
                    for (d, row) in [first, second].into_iter().enumerate() {
                        if next[d] != trial[d] {
                            row.fill(0.0);
                            for c in 0..n {
                                let basis = derivative.basis_at(j)[c];
                                row[2 * n + c] =
                                    next[d].signum() * mu * element.normal_stiffness * basis;
                            }
                        }
                    }
                }
            }
        }
        derivative
            .row_mut(j, 0)
            .copy_from_slice(&self.tangent[..3 * n]);
        derivative
            .row_mut(j, 1)
            .copy_from_slice(&self.tangent[3 * n..]);
    }
}
