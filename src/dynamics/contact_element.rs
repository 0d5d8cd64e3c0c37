//! The three-dimensional contact element [A §2b, fig. 3]: two coupled Jenkins elements in the plane, a unilateral spring along
//! the normal.
//!
//! Normal load `N(t) = max(0, N₀ + k_n (u_n − g₀))`; the tangential force `T = k_t (u_t − w)` follows the slider w, which moves
//! when `T` would leave the friction limit of `N(t)`. Without load the slider goes with the displacement and `T = 0`.
//!
//! *Start of the slider.* A mean tangential force can be locked in by friction, so the mean is unique only together with a
//! history. It is this one: at the preloaded state u = 0 and w = 0; from there to the first sample in one step, then cycle after
//! cycle to the steady one. Between samples the displacement goes straight and the load changes linearly, for which the law is
//! integrated exactly.

use super::DynamicsError;
use super::aft::{Closure, Derivative, InterfaceElement};
use super::march::March;
use super::slider::FrictionLaw;

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
    pub(super) fn bilateral_load(&self, u: f64) -> f64 {
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
            load >= 0.0 && self.law.holds([kt * u[0], kt * u[1]], limit)
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
