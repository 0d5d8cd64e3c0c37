//! Tests of the energy balance, the limits and the symmetries of converged responses.

use std::f64::consts::PI;

use fretwear::dynamics::{
    BalanceSettings, FrictionLaw, HarmonicBalance, Harmonics, Oscillator, Receptance,
};
use fretwear::linalg::RowMatrix as Matrix;
use num_complex::Complex64;

use super::{BOTH, balance, drive, oscillator, samples};

/// Angular frequencies that include the stuck (6583 rad/s) and the sliding resonance (5164 rad/s) along x.
fn sweep() -> Vec<f64> {
    (0..49).map(|k| 4600.0 + 50.0 * k as f64).collect()
}

#[test]
fn input_is_pi_force_amplitude_sine_of_the_lag() {
    let balance = balance(
        &oscillator(FrictionLaw::Cone),
        5,
        &drive(250.0),
        BalanceSettings::default(),
    );
    let response = balance
        .solve(5700.0, None)
        .unwrap_or_else(|e| panic!("{e}"));
    let (amplitude, lag) = balance.amplitude(&response, 0).expect("port 0");
    let input = PI * 250.0 * amplitude * lag.sin();
    assert!((input / response.energy.load_work - 1.0).abs() < 1e-12);
    let lost = response.energy.friction + response.energy.viscous;
    assert!((input / lost - 1.0).abs() < 1e-9, "{input} {lost}");
    // Dissipation from samples and from harmonics agree within the resolution of both.
    let sampled = balance.element_cycles(&response, balance.sampling())[0].dissipated_energy;
    assert!(
        (sampled / response.energy.friction - 1.0).abs() < 0.02,
        "{sampled}"
    );
}

/// Linear response of an axis with its stiffness increased by `extra`.
fn linear(force: f64, omega: f64, axis: usize, extra: f64) -> Complex64 {
    let oscillator = oscillator(FrictionLaw::Cone);
    let stiffness = oscillator.stiffness[axis] + extra - oscillator.mass[axis] * omega * omega;
    force / Complex64::new(stiffness, omega * oscillator.damping[axis])
}

#[test]
fn small_loads_are_linear_and_stuck() {
    let balance = balance(
        &oscillator(FrictionLaw::Cone),
        3,
        &drive(2.0),
        BalanceSettings::default(),
    );
    for omega in sweep() {
        let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!((response.active_elements(), response.iterations), (0, 0));
        let expected = linear(2.0, omega, 0, 2.5e7);
        let (a, b) = (response.displacement[1], response.displacement[2]);
        assert!((Complex64::new(a, -b) - expected).norm() < 1e-12 * expected.norm());
    }
}

#[test]
fn large_loads_slide_with_the_amplitude_of_a_constant_friction_force() {
    // F ≫ µN: at the resonance of the mass without contact, cωU = F − 4µN/π.
    let balance = balance(&oscillator(FrictionLaw::Cone), 1, &drive(1e5), samples(512));
    let omega = (4.0e7_f64 / 1.5).sqrt();
    let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
    let (amplitude, _) = balance.amplitude(&response, 0).expect("port 0");
    let expected = (1e5 - 4.0 / PI * 54.0) / (300.0 * omega);
    assert!(
        (amplitude / expected - 1.0).abs() < 1e-5,
        "{amplitude} {expected}"
    );
}

#[test]
fn without_friction_the_contact_is_not_there_along_the_plane() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.element.friction_coefficient = 0.0;
    let balance = balance(&oscillator, 3, &drive(500.0), BalanceSettings::default());
    for omega in sweep() {
        let response = balance.solve(omega, None).unwrap_or_else(|e| panic!("{e}"));
        let expected = linear(500.0, omega, 0, 0.0);
        let (amplitude, _) = balance.amplitude(&response, 0).expect("port 0");
        assert!((amplitude / expected.norm() - 1.0).abs() < 1e-12);
        assert_eq!(response.energy.friction, 0.0);
    }
}

#[test]
fn axes_of_the_plane_may_be_exchanged() {
    for law in BOTH {
        let along_x = oscillator(law);
        let mut along_y = along_x.clone();
        for values in [
            &mut along_y.mass,
            &mut along_y.damping,
            &mut along_y.stiffness,
        ] {
            values.swap(0, 1);
        }
        let x = balance(&along_x, 5, &drive(250.0), BalanceSettings::default());
        let y = balance(
            &along_y,
            5,
            &[Oscillator::load(1, 250.0, 0.0)],
            BalanceSettings::default(),
        );
        let (x, y) = (
            x.solve(5700.0, None).expect("x"),
            y.solve(5700.0, None).expect("y"),
        );
        for c in 1..11 {
            let (a, b) = (x.displacement[c], y.displacement[11 + c]);
            assert!(
                (a - b).abs() < 1e-12 * x.displacement[1].abs(),
                "{c}: {a} {b}"
            );
        }
    }
}

#[test]
fn a_shifted_phase_of_the_load_shifts_the_response() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let settings = samples(64);
    // A quarter of a cycle is an integer number of samples.
    let plain = balance(&oscillator, 3, &drive(260.0), settings);
    let shifted = balance(
        &oscillator,
        3,
        &[Oscillator::load(0, 260.0, 0.5 * PI)],
        settings,
    );
    let (a, b) = (
        plain.solve(5700.0, None).expect("a"),
        shifted.solve(5700.0, None).expect("b"),
    );
    let (a, b) = (
        plain.amplitude(&a, 0).expect("a"),
        shifted.amplitude(&b, 0).expect("b"),
    );
    assert!(
        (a.0 / b.0 - 1.0).abs() < 1e-9 && (a.1 - b.1).abs() < 1e-9,
        "{a:?} {b:?}"
    );
}

#[test]
fn matrices_and_receptance_are_the_same_structure() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let model = Receptance {
        receptance: move |omega: f64| {
            let entries = [0, 1, 2].map(|d| {
                let elastic = oscillator.stiffness[d] - omega * omega * oscillator.mass[d];
                1.0 / Complex64::new(elastic, omega * oscillator.damping[d])
            });
            Matrix::diagonal(&entries)
        },
        ports: 3,
        contact_dofs: 3,
    };
    let loads = [
        Oscillator::load(0, 260.0, 0.0),
        Oscillator::load(2, 50.0, 1.0),
    ];
    let settings = BalanceSettings::default();
    let by_receptance = HarmonicBalance::new(
        &model,
        vec![oscillator.element.clone()],
        Harmonics::up_to(3),
        loads.to_vec(),
        settings,
    )
    .expect("valid");
    let by_matrices = balance(&oscillator, 3, &loads, settings);
    for omega in [5000.0, 5600.0, 6400.0] {
        let a = by_receptance
            .solve(omega, None)
            .unwrap_or_else(|e| panic!("{e}"));
        let b = by_matrices
            .solve(omega, None)
            .unwrap_or_else(|e| panic!("{e}"));
        let scale = b.displacement.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        for (a, b) in a.displacement.iter().zip(&b.displacement) {
            assert!((a - b).abs() < 1e-9 * scale, "{a} {b}");
        }
        assert!((a.energy.viscous / b.energy.viscous - 1.0).abs() < 1e-9);
        assert!(a.energy.imbalance() < 1e-6);
    }
}
