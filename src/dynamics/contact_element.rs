//! The three-dimensional contact element [A §2b, fig. 3] as a bank of parallel sliders.
//!
//! All sliders of an element see its displacement, and their forces add up. Each is two coupled Jenkins elements in the plane and a
//! unilateral spring along the normal: the normal load is `N(t) = max(0, N₀ + k_n (u_n − g₀))`; the tangential force
//! `T = k_t (u_t − w)` follows the slider's position w, which moves when `T` would leave the friction limit of `N(t)`. Without load
//! the slider goes with the displacement and `T = 0`. The element of [A §2b] is the bank of one.
//!
//! Under a steady load a bank that is pulled along a line has a piecewise linear, concave force (Iwan 1966); as its sliders have
//! limits of their own normal loads, its stiffness and strength follow the load, and no history makes it give energy: the idea
//! of reduced dimensionality (Popov and Heß 2015).
//!
//! *Start of the sliders.* A mean tangential force can be locked in by friction, so the mean is unique only together with a
//! history. It is this one: at the preloaded state u = 0 and w = 0; from there to the first sample in one step, then cycle after
//! cycle to the steady one. Between samples the displacement goes straight and the load changes linearly, for which the law is
//! integrated exactly.

use super::aft::{Closure, ForceDerivatives, InterfaceElement, Scratch};
use super::march::March;
use super::slider::{FrictionLaw, Slider};
use super::spring::Spring;
use super::{DynamicsError, Harmonics};
use crate::linalg::add_scaled;

/// What an element does over a cycle at its worst.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ElementState {
    /// Loaded throughout, and no slider slips.
    Stick,
    /// Loaded throughout; sliders slip, but in no step between samples all that are loaded. A bank of one never does.
    Partial,
    /// Loaded throughout; somewhere all sliders that are loaded slip.
    Slip,
    /// No slider is loaded somewhere.
    Open,
}

/// Parameters of a contact element.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactElement {
    /// Area A \[m²\]; enters sums over elements, not the law.
    pub area: f64,
    /// Friction coefficient µ of all sliders.
    pub friction_coefficient: f64,
    /// Friction law.
    pub law: FrictionLaw,
    /// The sliders, one or more; none only where there are springs.
    pub sliders: Vec<Slider>,
    /// Springs to the ground beside them, which are no contact: sums over the joint leave them out.
    pub springs: Vec<Spring>,
}

/// Forces and slip of one element over its steady cycle, at the samples of the displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementCycle {
    /// `[T_x, T_y, N]` \[N\]; N is the whole normal load, not its change.
    pub force: Vec<[f64; 3]>,
    /// Energy dissipated in one cycle, Σ T·Δw of all sliders \[J\].
    pub dissipated_energy: f64,
    /// Path in one cycle, Σ |Δw|, the mean of the sliders weighted by their static strength \[m\].
    pub slip_path: f64,
    /// The worst state.
    pub state: ElementState,
    /// How well it closes.
    pub closure: Closure,
}

impl ContactElement {
    /// Multiplies the friction of all sliders, and their stiffness along the joint: they slip as they did, and dissipate so many times as much.
    pub fn multiply_friction(&mut self, factor: f64) {
        self.friction_coefficient *= factor;
        let sliders = self.sliders.iter_mut();
        sliders.for_each(|slider| slider.tangential_stiffness *= factor);
    }

    /// Normal load at u = 0 \[N\].
    pub fn normal_load(&self) -> f64 {
        self.sum(|slider| slider.normal_load)
    }

    /// Normal stiffness of all sliders together \[N/m\].
    pub fn normal_stiffness(&self) -> f64 {
        self.sum(|slider| slider.normal_stiffness)
    }

    /// Tangential stiffness of all sliders together, before any of them slips \[N/m\].
    pub fn tangential_stiffness(&self) -> f64 {
        self.sum(|slider| slider.tangential_stiffness)
    }

    fn sum(&self, of: impl Fn(&Slider) -> f64) -> f64 {
        self.sliders.iter().map(of).sum()
    }

    /// Forces and slip over the steady cycle of `displacement` (`[x, y, n]` at equidistant samples).
    pub fn cycle(&self, displacement: &[[f64; 3]]) -> ElementCycle {
        let mut cycle = ElementCycle {
            force: vec![[0.0; 3]; displacement.len()],
            dissipated_energy: 0.0,
            slip_path: 0.0,
            state: ElementState::Stick,
            closure: Closure::EXACT,
        };
        let scale = displacement
            .iter()
            .fold(0.0_f64, |s, u| s.max(u[0].abs()).max(u[1].abs()));
        let mut scratch = Scratch::default();
        // Of every step, the sliders that are loaded, and those of them that slip.
        let mut count = vec![(0_usize, 0_usize); displacement.len()];
        let strength = self.normal_load();
        for slider in &self.sliders {
            let share = if strength > 0.0 {
                slider.normal_load / strength
            } else {
                1.0 / self.sliders.len() as f64
            };
            let kt = slider.gripping_stiffness(self.friction_coefficient);
            if self.is_linear(slider, displacement) {
                let kt = if slider.bears() { kt } else { 0.0 };
                cycle.closure = cycle.closure.and(linear(kt, displacement));
                for ((u, sum), count) in displacement.iter().zip(&mut cycle.force).zip(&mut count) {
                    let load = slider.bilateral_load(u[2]);
                    sum[0] += kt * u[0];
                    sum[1] += kt * u[1];
                    sum[2] += load.max(0.0);
                    count.0 += usize::from(load > 0.0);
                }
                continue;
            }
            let closure = self.march(slider, displacement, None, &mut scratch);
            cycle.closure = cycle.closure.and(closure);
            let position = |j: usize| {
                let (u, force) = (displacement[j], scratch.force[j]);
                let lag = |d: usize| if kt > 0.0 { force[d] / kt } else { 0.0 };
                [u[0] - lag(0), u[1] - lag(1)]
            };
            let mut before = match displacement.len() {
                0 => [0.0; 2],
                samples => position(samples - 1),
            };
            for (j, (u, sum)) in displacement.iter().zip(&mut cycle.force).enumerate() {
                let (load, force) = (slider.bilateral_load(u[2]), scratch.force[j]);
                sum[0] += force[0];
                sum[1] += force[1];
                sum[2] += load.max(0.0);
                let now = position(j);
                let moved = [now[0] - before[0], now[1] - before[1]];
                before = now;
                let path = moved[0].hypot(moved[1]);
                // Rounding of u − T/k_t is not slip.
                let slips = path > 8.0 * f64::EPSILON * scale;
                if slips {
                    cycle.dissipated_energy += force[0] * moved[0] + force[1] * moved[1];
                    cycle.slip_path += share * path;
                }
                if load > 0.0 {
                    count[j].0 += 1;
                    count[j].1 += usize::from(slips);
                }
            }
        }
        for (loaded, slipping) in count {
            cycle.state = cycle.state.max(match slipping {
                _ if loaded == 0 => ElementState::Open,
                0 => ElementState::Stick,
                _ if slipping == loaded => ElementState::Slip,
                _ => ElementState::Partial,
            });
        }
        cycle
    }

    /// Whether a slider of a bank need not march, as it follows its reference. A slider alone marches: its element, if it follows, is
    /// hardly ever asked.
    fn is_linear(&self, slider: &Slider, displacement: &[[f64; 3]]) -> bool {
        self.sliders.len() > 1
            && slider.follows_reference(self.law, self.friction_coefficient, displacement)
    }

    /// Tangential forces of a slider in `scratch`; their derivatives are added in the form of [`March::run`].
    fn march(
        &self,
        slider: &Slider,
        displacement: &[[f64; 3]],
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> Closure {
        if slider.gripping_stiffness(self.friction_coefficient) == 0.0 {
            scratch.force.clear();
            scratch.force.resize(displacement.len(), [0.0; 2]);
            return Closure::EXACT;
        }
        let march = March {
            slider,
            friction: self.friction_coefficient,
            law: self.law,
            displacement,
        };
        march.run(derivative, scratch)
    }
}

impl InterfaceElement for ContactElement {
    fn check(&self, element: usize) -> Result<(), DynamicsError> {
        let refused = |name, value, expected| {
            Err(DynamicsError::Element {
                element,
                name,
                value,
                expected,
            })
        };
        if let Some((name, value, expected)) = self.springs.iter().find_map(Spring::fault) {
            return refused(name, value, expected);
        }
        if self.sliders.is_empty() && self.springs.is_empty() {
            return refused("the number of sliders", 0.0, "one or more");
        }
        let own = [
            ("the area", self.area),
            ("the friction coefficient", self.friction_coefficient),
        ];
        let of_sliders = self.sliders.iter().flat_map(|slider| {
            [
                ("the normal load", slider.normal_load),
                ("the gap", slider.gap),
                ("the tangential stiffness", slider.tangential_stiffness),
                ("the normal stiffness", slider.normal_stiffness),
            ]
        });
        for (name, value) in own.into_iter().chain(of_sliders) {
            if !(value >= 0.0 && value.is_finite()) {
                return refused(name, value, "a finite number, zero or more");
            }
        }
        for slider in &self.sliders {
            if slider.gap > 0.0 && slider.normal_load > 0.0 {
                return refused(
                    "the gap",
                    slider.gap,
                    "zero where there is a normal load: an element that is open at rest bears none",
                );
            }
        }
        Ok(())
    }

    fn reference_stiffness(&self) -> [f64; 3] {
        let bearing = self.sliders.iter().filter(|slider| slider.bears());
        bearing.fold([0.0; 3], |[x, y, n], slider| {
            let kt = slider.gripping_stiffness(self.friction_coefficient);
            [x + kt, y + kt, n + slider.normal_stiffness]
        })
    }

    fn follows_reference(&self, displacement: &[[f64; 3]]) -> bool {
        let (law, friction) = (self.law, self.friction_coefficient);
        let mut sliders = self.sliders.iter();
        sliders.all(|slider| slider.follows_reference(law, friction, displacement))
            && self.springs.iter().all(|spring| {
                let mut along = displacement.iter().map(|u| u[spring.direction()]);
                along.all(|u| spring.force(u)[0] == 0.0)
            })
    }

    fn following_share(&self, displacement: &[[f64; 3]]) -> f64 {
        let (law, friction) = (self.law, self.friction_coefficient);
        let follows = |slider: &&Slider| slider.follows_reference(law, friction, displacement);
        let following = self.sliders.iter().filter(follows).count();
        following as f64 / self.sliders.len().max(1) as f64
    }

    fn is_costly(&self) -> bool {
        self.sliders.len() > 1
    }

    fn add_exactly(
        &self,
        harmonics: &Harmonics,
        displacement: &[f64],
        force: &mut [f64],
        mut jacobian: Option<&mut [f64]>,
    ) {
        let n = harmonics.coefficients();
        for spring in self.springs.iter().filter(|spring| !spring.is_sampled()) {
            let d = spring.direction();
            let mut slope = vec![0.0; n * n];
            let row = d * n..(d + 1) * n;
            let along = &displacement[row.clone()];
            spring.add(harmonics, along, &mut force[row], &mut slope);
            if let Some(jacobian) = jacobian.as_deref_mut() {
                for (c, slope) in slope.chunks_exact(n).enumerate() {
                    let own = &mut jacobian[((d * n + c) * 3 + d) * n..][..n];
                    add_scaled(own, 1.0, slope);
                }
            }
        }
    }

    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> Closure {
        self.normal_forces(displacement, force, derivative.as_deref_mut());
        self.stop_forces(displacement, force, derivative.as_deref_mut());
        let mut closure = Closure::EXACT;
        let (mut stuck, mut gripping) = (0.0, 0.0);
        for slider in &self.sliders {
            let kt = slider.gripping_stiffness(self.friction_coefficient);
            if self.is_linear(slider, displacement) {
                if slider.bears() {
                    stuck += kt;
                }
                continue;
            }
            gripping += kt;
            let own = self.march(slider, displacement, derivative.as_deref_mut(), scratch);
            closure = closure.and(own);
            for (sum, own) in force.iter_mut().zip(&scratch.force) {
                sum[0] += own[0];
                sum[1] += own[1];
            }
        }
        if let Some(derivative) = derivative {
            for direction in [0, 1] {
                derivative.add_stiffness(direction, stuck + gripping);
            }
        }
        if stuck > 0.0 {
            for (force, u) in force.iter_mut().zip(displacement) {
                force[0] += stuck * u[0];
                force[1] += stuck * u[1];
            }
            closure = closure.and(linear(stuck, displacement));
        }
        closure
    }
}

impl ContactElement {
    fn normal_forces(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut ForceDerivatives<'_>>,
    ) {
        let mut usual = None;
        for (j, (u, force)) in displacement.iter().zip(force).enumerate() {
            let (mut change, mut stiffness) = (0.0, 0.0);
            for slider in &self.sliders {
                let load = slider.bilateral_load(u[2]);
                change += load.max(0.0) - slider.normal_load;
                if load > 0.0 {
                    stiffness += slider.normal_stiffness;
                }
            }
            *force = [0.0, 0.0, change];
            if let Some(derivative) = derivative.as_deref_mut() {
                // Most loads are never lost: one stiffness for all of the cycle.
                let usual = *usual.get_or_insert_with(|| {
                    derivative.add_stiffness(2, stiffness);
                    stiffness
                });
                if stiffness != usual {
                    derivative.add_stiffness_at(j, 2, stiffness - usual);
                }
            }
        }
    }
}

impl ContactElement {
    /// Adds the forces of the stops.
    fn stop_forces(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut ForceDerivatives<'_>>,
    ) {
        for stop in self.springs.iter().filter(|spring| spring.is_sampled()) {
            let d = stop.direction();
            for (j, (u, force)) in displacement.iter().zip(&mut *force).enumerate() {
                let [value, stiffness] = stop.force(u[d]);
                force[d] += value;
                if let Some(derivative) = derivative.as_deref_mut()
                    && stiffness > 0.0
                {
                    derivative.add_stiffness_at(j, d, stiffness);
                }
            }
        }
    }
}

/// That of a force `kt` times the displacement.
fn linear(kt: f64, displacement: &[[f64; 3]]) -> Closure {
    let squares = displacement.iter().map(|u| u[0] * u[0] + u[1] * u[1]);
    Closure {
        largest: kt * squares.fold(0.0_f64, f64::max).sqrt(),
        ..Closure::EXACT
    }
}
