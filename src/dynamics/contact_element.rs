//! Three-dimensional contact element [A §2b, fig. 3] as a bank of parallel sliders.
//!
//! All sliders of an element have the displacement of the element, and their forces add up. A slider is two coupled
//! Jenkins elements in the plane and a unilateral spring along the normal. The normal load is `N(t) = max(0, N₀ + k_n
//! (u_n − g₀))`. The tangential force is `T = k_t (u_t − w)`, where w is the position of the slider. The slider moves
//! when `T` would exceed the friction limit of `N(t)`. Without load the slider follows the displacement and `T = 0`.
//! The element of [A §2b] is a bank of one slider.
//!
//! Under a steady load, a bank that is pulled along a line has a piecewise linear, concave force (Iwan 1966). The
//! normal load of each slider sets the friction limit of the slider. The stiffness and the strength of the bank change
//! with the normal load. The bank never creates energy. The bank implements the method of dimensionality reduction
//! (Popov and Heß 2015).
//!
//! *Start of the sliders.* Friction can lock in a mean tangential force. The mean tangential force is unique only for a
//! known history of the motion. The history begins at the preloaded state u = 0 and w = 0, with one step to the first
//! sample. Full cycles follow until the cycle is steady. Between two samples, the displacement moves along a straight
//! line and the normal load changes linearly. The march integrates the friction law exactly for a linear change of
//! displacement and load.

use super::aft::{ForceDerivatives, InterfaceElement, PeriodicityError, Scratch};
use super::march::March;
use super::slider::{FrictionLaw, Slider};
use super::spring::Spring;
use super::{DynamicsError, Harmonics};
use crate::linalg::add_scaled;

/// Worst state of an element over a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum ElementState {
    /// Always loaded, and no slider slips.
    Stick,
    /// The element is always loaded. Some loaded sliders slip, but no step between two samples has all loaded sliders
    /// slipping. A bank of one slider is never partial.
    Partial,
    /// The element is always loaded. In some step between two samples all loaded sliders slip.
    Slip,
    /// In some step no slider is loaded.
    Open,
}

/// Parameters of a contact element.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactElement {
    /// Area A \[m²\], used in sums over elements, not in the law.
    pub area: f64,
    /// Friction coefficient µ of all sliders.
    pub friction_coefficient: f64,
    /// Friction law.
    pub law: FrictionLaw,
    /// The sliders of the element. An element needs at least one slider, unless it has springs.
    pub sliders: Vec<Slider>,
    /// Parallel springs to the ground. The springs are not contact, and sums over the joint exclude the springs.
    pub springs: Vec<Spring>,
}

/// Forces and slip of one element over its steady cycle, at the samples of the displacement.
#[derive(Debug, Clone, PartialEq)]
pub struct ElementCycle {
    /// Tangential forces and normal load `[T_x, T_y, N]` \[N\]. N is the total normal load, not the change of the
    /// normal load.
    pub force: Vec<[f64; 3]>,
    /// Energy dissipated in one cycle, Σ T·Δw of all sliders \[J\].
    pub dissipated_energy: f64,
    /// Slip path in one cycle, Σ |Δw|, the mean of the sliders weighted by their static strength \[m\].
    pub slip_path: f64,
    /// The worst state.
    pub state: ElementState,
    /// Periodicity error of the cycle.
    pub closure: PeriodicityError,
}

impl ContactElement {
    /// Multiplies the friction coefficient and the tangential stiffness of all sliders by `factor`. For the same
    /// displacement, the sliders slip as before and dissipate `factor` times the energy.
    pub fn multiply_friction(&mut self, factor: f64) {
        self.friction_coefficient *= factor;
        let sliders = self.sliders.iter_mut();
        sliders.for_each(|slider| slider.tangential_stiffness *= factor);
    }

    /// Returns the normal load at u = 0 \[N\].
    pub fn normal_load(&self) -> f64 {
        self.sum(|slider| slider.normal_load)
    }

    /// Returns the normal stiffness of all sliders together \[N/m\].
    pub fn normal_stiffness(&self) -> f64 {
        self.sum(|slider| slider.normal_stiffness)
    }

    /// Returns the tangential stiffness of all sliders together, before any slider slips \[N/m\].
    pub fn tangential_stiffness(&self) -> f64 {
        self.sum(|slider| slider.tangential_stiffness)
    }

    fn sum(&self, quantity: impl Fn(&Slider) -> f64) -> f64 {
        self.sliders.iter().map(quantity).sum()
    }

    /// Computes forces and slip over the steady cycle of `displacement` (`[x, y, n]` at equidistant samples).
    pub fn cycle(&self, displacement: &[[f64; 3]]) -> ElementCycle {
        let mut cycle = ElementCycle {
            force: vec![[0.0; 3]; displacement.len()],
            dissipated_energy: 0.0,
            slip_path: 0.0,
            state: ElementState::Stick,
            closure: PeriodicityError::EXACT,
        };
        let scale = displacement
            .iter()
            .fold(0.0_f64, |s, u| s.max(u[0].abs()).max(u[1].abs()));
        let mut scratch = Scratch::default();
        // For each step: the number of loaded sliders, and the number of loaded sliders that slip.
        let mut count = vec![(0_usize, 0_usize); displacement.len()];
        let strength = self.normal_load();
        for slider in &self.sliders {
            let share = if strength > 0.0 {
                slider.normal_load / strength
            } else {
                1.0 / self.sliders.len() as f64
            };
            let kt = slider.effective_tangential_stiffness(self.friction_coefficient);
            if self.is_linear(slider, displacement) {
                let kt = if slider.bears_load_at_rest() { kt } else { 0.0 };
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
            let position_at = |j: usize| {
                let (u, force) = (displacement[j], scratch.force[j]);
                let lag = |d: usize| if kt > 0.0 { force[d] / kt } else { 0.0 };
                [u[0] - lag(0), u[1] - lag(1)]
            };
            let mut previous_position = match displacement.len() {
                0 => [0.0; 2],
                samples => position_at(samples - 1),
            };
            for (j, (u, sum)) in displacement.iter().zip(&mut cycle.force).enumerate() {
                let (load, force) = (slider.bilateral_load(u[2]), scratch.force[j]);
                sum[0] += force[0];
                sum[1] += force[1];
                sum[2] += load.max(0.0);
                let position = position_at(j);
                let slip_increment = [
                    position[0] - previous_position[0],
                    position[1] - previous_position[1],
                ];
                previous_position = position;
                let path = slip_increment[0].hypot(slip_increment[1]);
                // Rounding of u − T/k_t is not slip.
                let slips = path > 8.0 * f64::EPSILON * scale;
                if slips {
                    cycle.dissipated_energy +=
                        force[0] * slip_increment[0] + force[1] * slip_increment[1];
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

    /// Returns true if a slider of a bank follows its reference, so that no march is needed. A single slider always
    /// needs the march, because the solver rarely evaluates its element while the element follows the reference.
    fn is_linear(&self, slider: &Slider, displacement: &[[f64; 3]]) -> bool {
        self.sliders.len() > 1
            && slider.follows_reference(self.law, self.friction_coefficient, displacement)
    }

    /// Computes the tangential forces of a slider in `scratch`. Adds the derivatives of the forces to `derivative`, in
    /// the form of [`March::run`].
    fn march(
        &self,
        slider: &Slider,
        displacement: &[[f64; 3]],
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> PeriodicityError {
        if slider.effective_tangential_stiffness(self.friction_coefficient) == 0.0 {
            scratch.force.clear();
            scratch.force.resize(displacement.len(), [0.0; 2]);
            return PeriodicityError::EXACT;
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
        let reject = |name, value, expected| {
            Err(DynamicsError::Element {
                element,
                name,
                value,
                expected,
            })
        };
        if let Some((name, value, expected)) = self.springs.iter().find_map(Spring::fault) {
            return reject(name, value, expected);
        }
        if self.sliders.is_empty() && self.springs.is_empty() {
            return reject("the number of sliders", 0.0, "one or more");
        }
        let element_parameters = [
            ("the area", self.area),
            ("the friction coefficient", self.friction_coefficient),
        ];
        let slider_parameters = self.sliders.iter().flat_map(|slider| {
            [
                ("the normal load", slider.normal_load),
                ("the gap", slider.gap),
                ("the tangential stiffness", slider.tangential_stiffness),
                ("the normal stiffness", slider.normal_stiffness),
            ]
        });
        for (name, value) in element_parameters.into_iter().chain(slider_parameters) {
            if !(value >= 0.0 && value.is_finite()) {
                return reject(name, value, "a finite number, zero or more");
            }
        }
        for slider in &self.sliders {
            if slider.gap > 0.0 && slider.normal_load > 0.0 {
                return reject(
                    "the gap",
                    slider.gap,
                    "zero if there is a normal load: a slider that is open at rest has no normal load",
                );
            }
        }
        Ok(())
    }

    fn reference_stiffness(&self) -> [f64; 3] {
        let bearing = self
            .sliders
            .iter()
            .filter(|slider| slider.bears_load_at_rest());
        bearing.fold([0.0; 3], |[x, y, n], slider| {
            let kt = slider.effective_tangential_stiffness(self.friction_coefficient);
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

    fn reference_share(&self, displacement: &[[f64; 3]]) -> f64 {
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
                    let target = &mut jacobian[((d * n + c) * 3 + d) * n..][..n];
                    add_scaled(target, 1.0, slope);
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
    ) -> PeriodicityError {
        self.normal_forces(displacement, force, derivative.as_deref_mut());
        self.stop_forces(displacement, force, derivative.as_deref_mut());
        let mut closure = PeriodicityError::EXACT;
        let (mut linear_stiffness, mut marched_stiffness) = (0.0, 0.0);
        for slider in &self.sliders {
            let kt = slider.effective_tangential_stiffness(self.friction_coefficient);
            if self.is_linear(slider, displacement) {
                if slider.bears_load_at_rest() {
                    linear_stiffness += kt;
                }
                continue;
            }
            marched_stiffness += kt;
            let slider_closure =
                self.march(slider, displacement, derivative.as_deref_mut(), scratch);
            closure = closure.and(slider_closure);
            for (sum, slider_force) in force.iter_mut().zip(&scratch.force) {
                sum[0] += slider_force[0];
                sum[1] += slider_force[1];
            }
        }
        if let Some(derivative) = derivative {
            for direction in [0, 1] {
                derivative.add_stiffness(direction, linear_stiffness + marched_stiffness);
            }
        }
        if linear_stiffness > 0.0 {
            for (force, u) in force.iter_mut().zip(displacement) {
                force[0] += linear_stiffness * u[0];
                force[1] += linear_stiffness * u[1];
            }
            closure = closure.and(linear(linear_stiffness, displacement));
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
        let mut common = None;
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
                // Most sliders never open, so the normal stiffness of a slider is usually constant over the cycle.
                let common = *common.get_or_insert_with(|| {
                    derivative.add_stiffness(2, stiffness);
                    stiffness
                });
                if stiffness != common {
                    derivative.add_stiffness_at(j, 2, stiffness - common);
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

/// Returns the closure of a force `kt` times the displacement.
fn linear(kt: f64, displacement: &[[f64; 3]]) -> PeriodicityError {
    let squares = displacement.iter().map(|u| u[0] * u[0] + u[1] * u[1]);
    PeriodicityError {
        largest: kt * squares.fold(0.0_f64, f64::max).sqrt(),
        ..PeriodicityError::EXACT
    }
}
