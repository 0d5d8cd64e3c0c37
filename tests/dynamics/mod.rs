//! Tests of steady vibration: harmonics, contact elements, harmonic balance against time integration, continuation, resonance.

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
mod given_frequency;
mod harmonics;
mod kept;
mod line;
mod linear;
mod linear_resonance;
mod over_range;
mod pseudo_modes;
mod resonance;
mod resonator;
mod spring;
mod through_resonance;
mod time_integration;
mod truncation;
mod unreduced;
mod work_between_ends;

use fretwear::dynamics::{
    BalanceSettings, ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Harmonics, Load,
    Oscillator, Response, SecondOrder, Slider, Spring, Vibration,
};

pub const BOTH: [FrictionLaw; 2] = [FrictionLaw::Cone, FrictionLaw::Box];

/// Contact element with one loaded slider without a gap.
pub fn one_slider(
    law: FrictionLaw,
    friction_coefficient: f64,
    normal_load: f64,
    [tangential_stiffness, normal_stiffness]: [f64; 2],
) -> ContactElement {
    ContactElement {
        springs: Vec::new(),
        area: 4.2e-6,
        friction_coefficient,
        law,
        sliders: vec![Slider {
            normal_load,
            gap: 0.0,
            tangential_stiffness,
            normal_stiffness,
        }],
    }
}

/// Preloaded contact element with typical stiffnesses of a joint and µ = 0.6.
pub fn element(law: FrictionLaw) -> ContactElement {
    one_slider(law, 0.6, 90.0, [2.5e7, 3.5e7])
}

/// Contact element that consists of springs only.
pub fn springs(springs: Vec<Spring>) -> ContactElement {
    ContactElement {
        springs,
        sliders: Vec::new(),
        ..element(FrictionLaw::Cone)
    }
}

pub fn cubic(direction: usize, stiffness: f64) -> Spring {
    Spring::Cubic {
        direction,
        stiffness,
    }
}

/// Copy of the element with changed sliders.
pub fn changed(element: &ContactElement, change: impl FnMut(&mut Slider)) -> ContactElement {
    let mut element = element.clone();
    element.sliders.iter_mut().for_each(change);
    element
}

/// Mass with a different natural frequency along each axis; the damping is low enough for friction to matter.
pub fn oscillator(law: FrictionLaw) -> Oscillator {
    Oscillator {
        mass: [1.5, 1.5, 1.5],
        damping: [300.0, 350.0, 400.0],
        stiffness: [4.0e7, 3.1e7, 6.3e7],
        element: element(law),
    }
}

/// Harmonic balance of an oscillator with harmonics 0 to `highest`.
pub fn balance(
    oscillator: &Oscillator,
    highest: u32,
    loads: &[Load],
    settings: BalanceSettings,
) -> HarmonicBalance<ContactElement> {
    let model = oscillator.model().expect("a valid oscillator");
    let elements = std::slice::from_ref(&oscillator.element);
    balance_of(&model, elements, highest, loads, settings)
}

/// Harmonic balance of a structure with harmonics 0 to `highest`.
pub fn balance_of(
    model: &SecondOrder,
    elements: &[ContactElement],
    highest: u32,
    loads: &[Load],
    settings: BalanceSettings,
) -> HarmonicBalance<ContactElement> {
    let (elements, loads) = (elements.to_vec(), loads.to_vec());
    HarmonicBalance::new(model, elements, Harmonics::up_to(highest), loads, settings)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Vibration of an oscillator along x between two angular frequencies, with harmonics 0 to `highest`.
pub fn vibration(
    oscillator: &Oscillator,
    highest: u32,
    loads: Vec<Load>,
    range: (f64, f64),
) -> Vibration {
    Vibration {
        model: oscillator.model().expect("a valid oscillator"),
        loads,
        response_port: 0,
        harmonics: Harmonics::up_to(highest),
        settings: BalanceSettings::default(),
        at_omega: None,
        range,
        points: None,
        gauge: Default::default(),
        journal: Default::default(),
        threads: Default::default(),
        inertial_loads: Vec::new(),
    }
}

/// Default settings with this number of samples per cycle.
pub fn samples(samples: usize) -> BalanceSettings {
    BalanceSettings {
        samples,
        ..BalanceSettings::default()
    }
}

/// A load along x only.
pub fn drive(amplitude: f64) -> Vec<Load> {
    vec![Oscillator::load(0, amplitude, 0.0)]
}

/// Responses at these angular frequencies; panics if one of them has no response.
pub fn swept(balance: &HarmonicBalance<ContactElement>, omegas: &[f64]) -> Vec<Response> {
    let found: Result<_, DynamicsError> = balance.sweep(omegas).into_iter().collect();
    found.unwrap_or_else(|error| panic!("{error}"))
}
