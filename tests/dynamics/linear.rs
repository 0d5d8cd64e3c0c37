//! Tests of linear oscillators and structures against closed forms: Rayleigh damping, hysteretic damping, and a moving ground.

use std::f64::consts::{PI, TAU};

use fretwear::dynamics::oscillator::mass_on_springs;
use fretwear::dynamics::{
    BalanceSettings, ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Load, Oscillator,
    Rayleigh, SecondOrder,
};
use fretwear::linalg::RowMatrix as Matrix;

use super::{balance_of, drive, oscillator};

/// Rounding of a linear solve.
const ROUNDING: f64 = 1e-10;

const MASS: [f64; 3] = [1.5, 2.5, 0.7];
const DAMPING: [f64; 3] = [80.0, 20.0, 50.0];
const STIFFNESS: [f64; 3] = [4e7, 3.1e7, 6.3e7];

fn linear() -> SecondOrder {
    mass_on_springs(MASS, DAMPING, STIFFNESS, 0).unwrap()
}

/// Chain of five masses that is fixed at one end, with three contact degrees of freedom.
fn chain() -> SecondOrder {
    let mass = [1.0, 2.0, 1.5, 0.5, 1.2];
    let mut stiffness = Matrix::zeros(5, 5);
    for (i, k) in [3e6, 2e6, 4e6, 1e6, 2.5e6].into_iter().enumerate() {
        stiffness.set(i, i, stiffness.at(i, i) + k);
        if i > 0 {
            stiffness.set(i - 1, i - 1, stiffness.at(i - 1, i - 1) + k);
            stiffness.set(i, i - 1, -k);
            stiffness.set(i - 1, i, -k);
        }
    }
    SecondOrder {
        mass: Matrix::diagonal(&mass),
        damping: Matrix::zeros(5, 5),
        hysteretic: Matrix::zeros(5, 5),
        stiffness,
        basis: Matrix::identity(5),
        residual: None,
        contact_dofs: 3,
        static_coordinates: 0,
    }
}

fn balance(model: &SecondOrder, loads: &[Load]) -> HarmonicBalance<ContactElement> {
    balance_of(model, &[], 2, loads, BalanceSettings::default())
}

/// Cosine and sine of the displacement of a linear oscillator along an axis under a force F cos(ωt).
fn closed_form(axis: usize, force: f64, omega: f64) -> [f64; 2] {
    let stiff = STIFFNESS[axis] - MASS[axis] * omega * omega;
    let damped = DAMPING[axis] * omega;
    let square = stiff * stiff + damped * damped;
    [force * stiff / square, force * damped / square]
}

/// Every mode of the structure, free or with springs, has ζ = α/2ω + βω/2 in addition to its other damping.
#[test]
fn rayleigh_damping_of_every_mode() {
    let rayleigh = Rayleigh {
        mass: 7.0,
        stiffness: 3e-6,
    };
    for springs in [[0.0; 3], [5e5, 2e6, 9e5]] {
        let ratio = 0.01;
        let model = chain().with_damping_ratio(ratio, &springs).unwrap();
        let model = model.with_rayleigh_damping(rayleigh, &springs).unwrap();
        let (omega, modes) = model.modes(&springs).unwrap();
        let modal = modes.transposed().times(&model.damping.times(&modes));
        for (r, w) in omega.iter().enumerate() {
            let expected = ratio + rayleigh.mass / (2.0 * w) + rayleigh.stiffness * w / 2.0;
            for s in 0..omega.len() {
                let expected = if r == s { 2.0 * expected * w } else { 0.0 };
                let found = modal.at(r, s);
                assert!(
                    (found - expected).abs() < ROUNDING * 2.0 * w,
                    "{r} {s} {found}"
                );
            }
        }
    }
}

/// At the natural frequency of an oscillator, only damping balances the force.
#[test]
fn rayleigh_damping_of_an_oscillator() {
    let rayleigh = Rayleigh {
        mass: 12.0,
        stiffness: 2e-6,
    };
    let model = linear().with_rayleigh_damping(rayleigh, &[]).unwrap();
    for axis in 0..3 {
        let omega = (STIFFNESS[axis] / MASS[axis]).sqrt();
        let damping =
            DAMPING[axis] + rayleigh.mass * MASS[axis] + rayleigh.stiffness * STIFFNESS[axis];
        let balance = balance(&model, &[Oscillator::load(axis, 30.0, 0.0)]);
        let response = balance.solve(omega, None).unwrap();
        let (amplitude, lag) = balance.amplitude(&response, axis).unwrap();
        let expected = 30.0 / (damping * omega);
        assert!(
            (amplitude / expected - 1.0).abs() < ROUNDING,
            "{amplitude:e}"
        );
        assert!((lag - TAU / 4.0).abs() < ROUNDING, "{lag}");
        assert!(response.energy.imbalance() < ROUNDING);
    }
    for wrong in [
        Rayleigh {
            mass: -1.0,
            stiffness: 0.0,
        },
        Rayleigh {
            mass: 0.0,
            stiffness: f64::NAN,
        },
    ] {
        let error = linear().with_rayleigh_damping(wrong, &[]).unwrap_err();
        assert!(matches!(error, DynamicsError::OutOfRange { .. }), "{error}");
    }
}

/// A loss factor η gives F/√((k − mω²)² + (ηk)²) at any frequency and harmonic. It dissipates πηk|u|² in each period of the harmonic and
/// does not affect a constant load.
#[test]
fn hysteretic_damping_knows_no_frequency() {
    let (factor, force, axis) = (0.03, 40.0, 1);
    let model = mass_on_springs(MASS, [0.0; 3], STIFFNESS, 0).unwrap();
    let model = model.with_loss_factor(factor);
    let (k, m) = (STIFFNESS[axis], MASS[axis]);
    let natural = (k / m).sqrt();
    for (harmonic, share) in [(1, 0.4), (1, 1.0), (1, 1.7), (3, 0.4), (3, 1.0), (3, 1.7)] {
        let load = Load {
            harmonic,
            ..Oscillator::load(axis, force, 0.0)
        };
        let balance = balance_of(&model, &[], 4, &[load], BalanceSettings::default());
        let order = f64::from(harmonic);
        let response = balance.solve(share * natural / order, None).unwrap();
        let slot = 2 * harmonic as usize - 1;
        let row = &response.displacement[axis * balance.harmonics().coefficients()..];
        let (cosine, sine) = (row[slot], row[slot + 1]);
        let (stiff, damped) = (k * (1.0 - share * share), factor * k);
        let square = stiff * stiff + damped * damped;
        assert!((cosine - force * stiff / square).abs() < ROUNDING * force / damped);
        assert!((sine - force * damped / square).abs() < ROUNDING * force / damped);
        let expected = order * PI * damped * (cosine * cosine + sine * sine);
        let energy = response.energy;
        assert!((energy.hysteretic / expected - 1.0).abs() < ROUNDING);
        assert_eq!((energy.viscous, energy.friction), (0.0, 0.0));
        assert!(energy.imbalance() < ROUNDING);
    }
    let constant = Load {
        harmonic: 0,
        ..Oscillator::load(axis, force, 0.0)
    };
    let moving = Oscillator::load(0, force, 0.0);
    let balance = balance(&model, &[constant, moving]);
    let response = balance.solve(0.7 * natural, None).unwrap();
    let row = &response.displacement[axis * balance.harmonics().coefficients()..];
    assert!((row[0] / (force / k) - 1.0).abs() < ROUNDING);
}

/// A ground motion u cos(ωt + φ) is equivalent to a force m ω²u on the mass, in coordinates relative to the ground.
#[test]
fn a_ground_that_moves_by_a_given_displacement() {
    let (ground, phase) = (3e-6_f64, 0.4_f64);
    for axis in 0..3 {
        let factor = MASS[axis] * ground;
        let load = Oscillator::load(axis, factor, phase);
        let balance = balance(&linear(), &[])
            .with_inertial_loads(&[load])
            .unwrap();
        let natural = (STIFFNESS[axis] / MASS[axis]).sqrt();
        for share in [0.3, 0.99, 1.0, 1.02, 3.0] {
            let omega = share * natural;
            let response = balance.solve(omega, None).unwrap();
            let [cosine, sine] = closed_form(axis, factor * omega * omega, omega);
            let (amplitude, lag) = balance.amplitude(&response, axis).unwrap();
            assert!((amplitude / cosine.hypot(sine) - 1.0).abs() < ROUNDING);
            assert!((lag - sine.atan2(cosine)).abs() < ROUNDING, "{lag}");
            assert!(response.energy.imbalance() < ROUNDING);
        }
        // The relative displacement lags by 90° at the natural frequency and is largest where r² = 1/(1 − 2ζ²). Both searches use
        // derivatives along frequency, which include the derivative of the load.
        let range = (0.7 * natural, 1.4 * natural);
        let phase = balance.phase_resonance(range, None).unwrap();
        assert!((phase.omega / natural - 1.0).abs() < ROUNDING);
        let ratio = DAMPING[axis] / (2.0 * MASS[axis] * natural);
        let peak = balance.peak(axis, range, &phase.start()).unwrap();
        let expected = natural / (1.0 - 2.0 * ratio * ratio).sqrt();
        // The peak is flat: its frequency is accurate to the square root of rounding, and lies ζ² from the phase resonance.
        assert!(
            (peak.omega / expected - 1.0).abs() < 0.01 * ratio * ratio,
            "{} {}",
            peak.omega / natural,
            expected / natural
        );
    }
}

/// With a slipping contact, the response to the moving ground equals the response to the force m ω²u at several frequencies of the branch.
#[test]
fn a_moving_ground_under_a_slipping_contact() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let ground = 2.2e-6;
    let new = |loads: &[Load]| super::balance(&oscillator, 3, loads, BalanceSettings::default());
    let factor = drive(oscillator.mass[0] * ground);
    let moving = new(&[]).with_inertial_loads(&factor).unwrap();
    let range = (TAU * 800.0, TAU * 1150.0);
    let resonance = moving.phase_resonance(range, None).unwrap();
    assert!(resonance.energy.friction > 0.0 && resonance.energy.imbalance() < 1e-6);
    for omega in [
        0.97 * resonance.omega,
        resonance.omega,
        1.03 * resonance.omega,
    ] {
        let force = oscillator.mass[0] * omega * omega * ground;
        let driven = new(&drive(force));
        let start = resonance.start();
        let found = moving.solve(omega, Some(&start)).unwrap();
        let expected = driven.solve(omega, Some(&start)).unwrap();
        let largest = expected
            .displacement
            .iter()
            .fold(0.0_f64, |m, u| m.max(u.abs()));
        for (found, expected) in found.displacement.iter().zip(&expected.displacement) {
            // Newton's tolerance is 1e-10 of all displacements.
            assert!(
                (found - expected).abs() < 1e-8 * largest,
                "{found:e} {expected:e}"
            );
        }
    }
}

#[test]
fn inertial_loads_that_do_not_fit_are_refused() {
    let load = |port, harmonic, cosine| Load {
        port,
        harmonic,
        cosine,
        sine: 0.0,
    };
    for wrong in [load(3, 1, 1.0), load(0, 7, 1.0), load(0, 1, f64::INFINITY)] {
        assert!(
            balance(&linear(), &[])
                .with_inertial_loads(&[wrong])
                .is_err()
        );
    }
}
