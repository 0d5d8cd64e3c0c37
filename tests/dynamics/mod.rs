//! Steady vibration: harmonics, contact elements, harmonic balance against time integration, continuation, resonance.

mod backbone;
mod balance;
mod bank;
mod brake_reuss;
mod cases;
mod condensation;
mod continuation;
mod element;
mod extremes;
mod folds;
mod harmonics;
mod kept;
mod line;
mod linear;
mod over_range;
mod pseudo_modes;
mod resonance;
mod resonator;
mod spring;
mod time_integration;
mod truncation;
mod unreduced;
mod work_between_ends;

use fretwear::dynamics::aft::{Closure, Derivative, Scratch};
use fretwear::dynamics::{
    ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Harmonics, InterfaceElement, Load,
    Oscillator, Settings, Slider,
};

/// An element with stiffnesses of a joint, µ 0.6, preloaded.
pub fn element(law: FrictionLaw) -> ContactElement {
    ContactElement {
        springs: Vec::new(),
        area: 4.2e-6,
        friction_coefficient: 0.6,
        law,
        sliders: vec![Slider {
            normal_load: 90.0,
            gap: 0.0,
            tangential_stiffness: 2.5e7,
            normal_stiffness: 3.5e7,
        }],
    }
}

/// The same element with other sliders.
pub fn changed(element: &ContactElement, change: impl FnMut(&mut Slider)) -> ContactElement {
    let mut element = element.clone();
    element.sliders.iter_mut().for_each(change);
    element
}

/// A mass of different frequency along each axis; damping is low enough for friction to matter.
pub fn oscillator(law: FrictionLaw) -> Oscillator {
    Oscillator {
        mass: [1.5, 1.5, 1.5],
        damping: [300.0, 350.0, 400.0],
        stiffness: [4.0e7, 3.1e7, 6.3e7],
        element: element(law),
    }
}

/// The balance of an oscillator with harmonics 0 to `highest`.
pub fn balance(
    oscillator: &Oscillator,
    highest: u32,
    loads: &[Load],
    settings: Settings,
) -> HarmonicBalance<ContactElement> {
    let model = oscillator.model().expect("a right oscillator");
    HarmonicBalance::new(
        &model,
        vec![oscillator.element.clone()],
        Harmonics::up_to(highest),
        loads.to_vec(),
        settings,
    )
    .unwrap_or_else(|error| panic!("{error}"))
}

/// A load along x alone.
pub fn drive(amplitude: f64) -> Vec<Load> {
    vec![Oscillator::load(0, amplitude, 0.0)]
}

/// A cubic spring along x: an element without memory, to have a Duffing oscillator.
pub struct CubicSpring(pub f64);

impl InterfaceElement for CubicSpring {
    fn check(&self, _: usize) -> Result<(), DynamicsError> {
        Ok(())
    }

    fn reference_stiffness(&self) -> [f64; 3] {
        [0.0; 3]
    }

    fn follows_reference(&self, displacement: &[[f64; 3]]) -> bool {
        displacement.iter().all(|u| u[0] == 0.0)
    }

    fn sample(
        &self,
        displacement: &[[f64; 3]],
        force: &mut [[f64; 3]],
        derivative: Option<&mut Derivative<'_>>,
        _: &mut Scratch,
    ) -> Closure {
        for (f, u) in force.iter_mut().zip(displacement) {
            *f = [self.0 * u[0].powi(3), 0.0, 0.0];
        }
        if let Some(derivative) = derivative {
            for (j, u) in displacement.iter().enumerate() {
                derivative.add_stiffness_at(j, 0, 3.0 * self.0 * u[0].powi(2));
            }
        }
        Closure::EXACT
    }
}
