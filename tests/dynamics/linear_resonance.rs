//! Tests of the resonances of a stuck, a free and a tied joint, and of the loads up to which the joint sticks, against closed forms.

use fretwear::dynamics::{
    ContactElement, FrictionLaw, LinearResonances, Load, SecondOrder, Slider, Start, Vibration,
};
use fretwear::linalg::RowMatrix as Matrix;

use super::{balance_of, drive, element, oscillator, samples};

/// The range begins below the sliding resonance along x and ends above the stuck one.
const RANGE: (f64, f64) = (4000.0, 7500.0);
/// Relative accuracy of a phase resonance.
const FOUND: f64 = 1e-8;

const MASSES: [f64; 2] = [1.5, 0.4];
const GROUNDED: [f64; 2] = [4e7, 0.9e7];
const DAMPED: [f64; 2] = [300.0, 20.0];

/// Two masses on springs to the ground, with a contact element between them; the last port is the first mass along x.
fn two_masses() -> SecondOrder {
    let of = |values: [f64; 2]| Matrix::diagonal(&values.map(|v| [v; 3]).concat());
    // Stiffer along y and z, so that the lowest mode is along x.
    let stiffness = GROUNDED.map(|k| [k, 2.0 * k, 3.0 * k]).concat();
    let mut basis = Matrix::zeros(4, 6);
    for d in 0..3 {
        basis.set(d, d, -1.0);
        basis.set(d, d + 3, 1.0);
    }
    basis.set(3, 0, 1.0);
    SecondOrder {
        mass: of(MASSES),
        damping: of(DAMPED),
        hysteretic: Matrix::zeros(6, 6),
        stiffness: Matrix::diagonal(&stiffness),
        basis,
        residual: None,
        contact_dofs: 3,
        static_coordinates: 0,
    }
}

fn driven(model: SecondOrder, loads: Vec<Load>, response_port: usize) -> Vibration {
    Vibration {
        model,
        response_port,
        settings: samples(256),
        ..super::vibration(&oscillator(FrictionLaw::Cone), 1, loads, RANGE)
    }
}

fn found(vibration: &Vibration, element: &ContactElement) -> LinearResonances {
    let found = vibration.linear_resonances(std::slice::from_ref(element), &[[0.02, 0.01]]);
    found.expect("a solution").expect("a resonance")
}

fn is_near(found: f64, expected: f64, within: f64) {
    assert!(
        (found / expected - 1.0).abs() < within,
        "{found} {expected}"
    );
}

/// A mass on the ground: the tied joint has no highest frequency, and the friction limit is 54 N.
#[test]
fn a_mass_on_the_ground() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let vibration = driven(oscillator.model().expect("a model"), drive(2.0), 0);
    let found = found(&vibration, &oscillator.element);
    let omega = (6.5e7_f64 / 1.5).sqrt();
    is_near(found.stuck.frequency * std::f64::consts::TAU, omega, FOUND);
    is_near(found.stuck.damping_ratio, 300.0 / (3.0 * omega), 1e-6);
    let response = found.stuck.response.expect("damped");
    let displacement = 2.0 / (300.0 * omega);
    is_near(response.displacement, displacement, 1e-6);
    is_near(response.force, 2.5e7 * displacement, 1e-4);
    // Moment of a force along x at y = 10 mm.
    is_near(response.moment, 0.01 * response.force, 1e-12);
    assert!(response.load_lost < 1e-12, "{response:?}");
    let free = found.free.expect("a contact");
    is_near(
        free.frequency * std::f64::consts::TAU,
        (4.0e7_f64 / 1.5).sqrt(),
        FOUND,
    );
    assert!(found.tied.is_none(), "{found:?}");
    let limits = found.limits.expect("damped");
    let slips = 0.6 * 90.0 / (2.5e7 * displacement);
    is_near(limits.may_slip, slips, 1e-4);
    is_near(limits.joint_may_slip, slips, 1e-4);
    is_near(limits.sticks, 0.95 * slips, 1e-4);
    assert!(limits.may_open.is_infinite(), "{limits:?}");
    // The limits are correct: the joint sticks below them and no longer above them.
    for (factor, is_stuck) in [(limits.sticks, true), (1.1 * limits.may_slip, false)] {
        let loads = drive(2.0 * factor);
        let vibration = driven(oscillator.model().expect("a model"), loads, 0);
        let resolved = vibration.resolve(vec![oscillator.element.clone()], None, None);
        let resolved = resolved.expect("a resonance");
        let off = resolved.resonance.governing().omega / omega - 1.0;
        assert_eq!(off.abs() < 1e-6, is_stuck, "{factor}: {off}");
    }
}

/// Along the normal, a load of 90 N is lost at 90/kn; the friction limit follows the remaining load.
#[test]
fn a_mass_that_lifts_off() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let load = Load {
        port: 2,
        ..drive(1.0)[0]
    };
    let range = (6000.0, 11000.0);
    let vibration = Vibration {
        range,
        ..driven(oscillator.model().expect("a model"), vec![load], 2)
    };
    let found = found(&vibration, &oscillator.element);
    let omega = ((6.3e7_f64 + 3.5e7) / 1.5).sqrt();
    is_near(found.stuck.frequency * std::f64::consts::TAU, omega, FOUND);
    let displacement = 1.0 / (400.0 * omega);
    let limits = found.limits.expect("damped");
    let opens = 90.0 / (3.5e7 * displacement);
    is_near(limits.may_open, opens, 1e-3);
    is_near(limits.sticks, 0.95 * opens, 1e-3);
    let lost = found.stuck.response.expect("damped").load_lost;
    is_near(lost, 1.0 / opens, 1e-3);
}

/// A joint between two masses: a tied joint makes them one body, and a free joint allows each its own motion along the joint.
#[test]
fn two_masses_between_which_the_joint_is() {
    let loads = vec![Load {
        port: 3,
        ..drive(1.0)[0]
    }];
    let vibration = driven(two_masses(), loads, 3);
    let found = found(&vibration, &element(FrictionLaw::Cone));
    let of = |k: f64, m: f64| (k / m).sqrt() / std::f64::consts::TAU;
    let tied = found.tied.expect("both move").frequency;
    let together = of(GROUNDED[0] + GROUNDED[1], MASSES[0] + MASSES[1]);
    is_near(tied, together, 1e-4);
    // Mode 1 is the mode of the second mass at 4743 rad/s; the first mass has 5164 rad/s.
    let free = found.free.expect("a contact");
    assert_eq!([free.mode, found.stuck.mode], [1, 1]);
    is_near(free.frequency, of(GROUNDED[1], MASSES[1]), 1e-3);
    assert!(free.frequency < found.stuck.frequency && found.stuck.frequency < tied);
}

/// A bank whose weaker slider slips early sticks up to half of the load at which the whole element slips. An element with a negligible load
/// does not count.
#[test]
fn a_bank_of_sliders() {
    let whole = element(FrictionLaw::Cone);
    let parts = [(0.3, 0.5), (0.7, 0.5)];
    let sliders = parts.map(|(load, stiffness)| Slider {
        normal_load: load * whole.sliders[0].normal_load,
        tangential_stiffness: stiffness * whole.sliders[0].tangential_stiffness,
        normal_stiffness: stiffness * whole.sliders[0].normal_stiffness,
        gap: 0.0,
    });
    let bank = ContactElement {
        sliders: sliders.to_vec(),
        ..whole.clone()
    };
    let loads = vec![Load {
        port: 3,
        ..drive(1.0)[0]
    }];
    let vibration = driven(two_masses(), loads, 3);
    let [one, two] = [whole, bank].map(|element| found(&vibration, &element).limits.expect("both"));
    is_near(two.may_slip, one.may_slip, 1e-12);
    is_near(two.sticks, 0.5 * one.may_slip, 1e-12);
}

#[test]
fn frequencies_outside_are_named() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let vibration = Vibration {
        range: (100.0, 900.0),
        ..driven(oscillator.model().expect("a model"), drive(1.0), 0)
    };
    let elements = std::slice::from_ref(&oscillator.element);
    let found = vibration.linear_resonances(elements, &[[0.0; 2]]);
    let outside = found
        .expect("a solution")
        .expect_err("no resonance in the range");
    is_near(
        outside[0],
        (6.5e7_f64 / 1.5).sqrt() / std::f64::consts::TAU,
        FOUND,
    );
}

/// Newton's method finds a resonance from every start, although the phase condition also holds at the antiresonance between two resonances.
#[test]
fn an_antiresonance_is_none() {
    let model = two_masses();
    let load = Load {
        port: 3,
        ..drive(1.0)[0]
    };
    let springs = [2.5e7, 2.5e7, 3.5e7];
    let (modes, _) = model.modes(&springs).expect("modes");
    let balance = balance_of(
        &model,
        &[element(FrictionLaw::Cone)],
        1,
        &[load],
        samples(64),
    );
    let range = (0.5 * modes[0], 2.0 * modes[5]);
    // Frequency at which the second mass on its springs and the stuck joint would resonate.
    let antiresonance = ((GROUNDED[1] + 2.5e7) / MASSES[1]).sqrt();
    for step in 0..60 {
        let omega = range.0 * (range.1 / range.0).powf(f64::from(step) / 59.0);
        let displacement = balance.solve(omega, None).expect("linear").start();
        let start = Start {
            omega,
            ..displacement
        };
        let resonance = balance.phase_resonance(range, Some(&start));
        let resonance = resonance.expect("a resonance");
        let nearest = modes.iter().map(|w| (resonance.omega / w - 1.0).abs());
        let off = nearest.fold(f64::INFINITY, f64::min);
        assert!(
            off < 5e-3,
            "from {omega}: {} rad/s of {modes:?}, with an antiresonance at {antiresonance}",
            resonance.omega
        );
    }
    assert!(range.0 < antiresonance && antiresonance < range.1);
}
