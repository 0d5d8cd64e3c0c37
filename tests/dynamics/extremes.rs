//! The ends of every parameter: a right answer or a typed refusal.

use fretwear::dynamics::{
    ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Harmonics, Load, Oscillator,
    Settings,
};
use fretwear::linalg::RowMatrix as Matrix;

use super::{balance, drive, oscillator};

/// A load in the plane and along the normal.
fn loads(force: f64) -> [Load; 2] {
    [
        Oscillator::load(0, force, 0.0),
        Oscillator::load(2, 0.4 * force, 0.7),
    ]
}

/// Responses over the resonances of stuck, sliding and open contact, all of which keep the balance of energy.
fn respond(oscillator: &Oscillator, force: f64, what: &str) {
    let balance = balance(oscillator, 5, &loads(force), Settings::default());
    let omegas: Vec<f64> = (0..25).map(|k| 4500.0 + 140.0 * k as f64).collect();
    for response in balance
        .forced_response(&omegas)
        .unwrap_or_else(|e| panic!("{what}: {e}"))
    {
        let energy = response.energy;
        assert!(
            energy.imbalance() < 1e-6,
            "{what}, {} rad/s: {energy:?}",
            response.omega
        );
        assert!(response.displacement.iter().all(|u| u.is_finite()));
        for cycle in balance.element_cycles(&response, balance.sampling()) {
            for [x, _, n] in cycle.force {
                assert!(
                    n >= 0.0
                        && x.abs() <= oscillator.element.friction_coefficient * n * (1.0 + 1e-9)
                );
            }
        }
    }
}

#[test]
fn friction_coefficients_from_none_to_ten() {
    for law in [FrictionLaw::Cone, FrictionLaw::Box] {
        for mu in [0.0, 1e-4, 0.6, 10.0] {
            let mut oscillator = oscillator(law);
            oscillator.element.friction_coefficient = mu;
            respond(&oscillator, 100.0, &format!("{law:?}, µ {mu}"));
        }
    }
}

#[test]
fn without_load_and_with_gaps() {
    for (load, gap) in [
        (0.0, 0.0),
        (0.0, 1e-7),
        (0.0, 1e-6),
        (0.0, 1.0),
        (1e-6, 0.0),
    ] {
        let mut oscillator = oscillator(FrictionLaw::Cone);
        (
            oscillator.element.sliders[0].normal_load,
            oscillator.element.sliders[0].gap,
        ) = (load, gap);
        respond(&oscillator, 50.0, &format!("N₀ {load}, gap {gap}"));
    }
}

#[test]
fn normal_stiffness_over_eight_decades() {
    for decade in 4..=12 {
        let mut oscillator = oscillator(FrictionLaw::Cone);
        oscillator.element.sliders[0].normal_stiffness = 10_f64.powi(decade);
        respond(&oscillator, 100.0, &format!("k_n 1e{decade}, loaded"));
        oscillator.element.sliders[0].normal_load = 0.0;
        oscillator.element.sliders[0].gap = 1e-6;
        respond(&oscillator, 30.0, &format!("k_n 1e{decade}, with a gap"));
    }
    for zero in [0, 1] {
        let mut oscillator = oscillator(FrictionLaw::Box);
        if zero == 0 {
            oscillator.element.sliders[0].normal_stiffness = 0.0;
        } else {
            oscillator.element.sliders[0].tangential_stiffness = 0.0;
        }
        respond(&oscillator, 100.0, "a stiffness of zero");
    }
}

#[test]
fn forces_over_six_decades_to_separation() {
    for law in [FrictionLaw::Cone, FrictionLaw::Box] {
        for decade in 0..=6 {
            respond(
                &oscillator(law),
                10_f64.powi(decade),
                &format!("{law:?}, 1e{decade} N"),
            );
        }
    }
}

#[test]
fn without_damping() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    respond(&oscillator, 100.0, "no damping");
    // The stuck resonance itself has no linear response. 1.5·6000² = 5.4e7 exactly.
    oscillator.stiffness[0] = 5.4e7 - 2.5e7;
    let balance = balance(&oscillator, 1, &drive(1e-3), Settings::default());
    let error = balance.solve(6000.0, None).expect_err("unbounded");
    assert!(matches!(error, DynamicsError::Undamped { .. }), "{error}");
    // Friction bounds the response of an undamped structure only below F = 4µN/π; above, a resonance has no finite amplitude.
}

#[test]
fn an_undamped_resonance_is_bounded_by_friction() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    // 4µN/π = 68.8 N.
    let held = balance(&oscillator, 3, &drive(60.0), Settings::default());
    let response = held
        .phase_resonance((4000.0, 7500.0), None)
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(
        response.energy.imbalance() < 1e-6 && response.energy.viscous == 0.0,
        "{:?}",
        response.energy
    );
    let carried = balance(&oscillator, 3, &drive(80.0), Settings::default());
    match carried.phase_resonance((4000.0, 7500.0), None) {
        Ok(response) => panic!("{} rad/s, {:?}", response.omega, response.energy),
        Err(error) => println!("80 N: {error}"),
    }
}

#[test]
fn a_structure_without_contact() {
    let mut model = oscillator(FrictionLaw::Cone).model().expect("right");
    model.contact_dofs = 0;
    let none: Vec<ContactElement> = Vec::new();
    let balance = HarmonicBalance::new(
        &model,
        none,
        Harmonics::up_to(1),
        drive(3.0),
        Settings::default(),
    )
    .expect("right");
    let resonance = balance
        .phase_resonance((4000.0, 6000.0), None)
        .unwrap_or_else(|e| panic!("{e}"));
    assert!((resonance.omega / (4.0e7_f64 / 1.5).sqrt() - 1.0).abs() < 1e-9);
    let (amplitude, _) = balance.amplitude(&resonance, 0).expect("port 0");
    assert!((amplitude * 300.0 * resonance.omega / 3.0 - 1.0).abs() < 1e-9);
}

#[test]
fn a_mass_held_by_its_joint_alone() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.stiffness = [0.0; 3];
    for force in [1.0, 40.0, 200.0] {
        let balance = balance(&oscillator, 3, &drive(force), Settings::default());
        for omega in [2000.0, 3900.0, 4300.0] {
            let response = balance
                .solve(omega, None)
                .unwrap_or_else(|e| panic!("{force} N, {omega}: {e}"));
            assert!(response.energy.imbalance() < 1e-6, "{:?}", response.energy);
        }
    }
}

#[test]
fn a_static_load_that_nothing_holds_is_refused() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.stiffness[0] = 0.0;
    oscillator.element.friction_coefficient = 0.0;
    let mut loads = drive(10.0);
    let free = balance(&oscillator, 1, &loads, Settings::default());
    let response = free.solve(5000.0, None).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(response.displacement[0], 0.0);
    loads.push(Load {
        port: 0,
        harmonic: 0,
        cosine: 5.0,
        sine: 0.0,
    });
    let pushed = balance(&oscillator, 1, &loads, Settings::default());
    let error = pushed.solve(5000.0, None).expect_err("runs away");
    assert!(
        matches!(error, DynamicsError::Unsupported { .. }),
        "{error}"
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let model = oscillator.model().expect("right");
    let new = |elements: usize, loads: Vec<Load>, settings| {
        HarmonicBalance::new(
            &model,
            vec![oscillator.element.clone(); elements],
            Harmonics::up_to(2),
            loads,
            settings,
        )
        .map(|_| ())
        .expect_err("wrong")
    };
    let usual = Settings::default();
    assert!(matches!(
        new(2, drive(1.0), usual),
        DynamicsError::Length {
            found: 3,
            expected: 6,
            ..
        }
    ));
    let load = |port, harmonic, cosine| {
        vec![Load {
            port,
            harmonic,
            cosine,
            sine: 0.0,
        }]
    };
    assert!(matches!(
        new(1, load(3, 1, 1.0), usual),
        DynamicsError::OutOfRange { .. }
    ));
    assert!(matches!(
        new(1, load(0, 5, 1.0), usual),
        DynamicsError::HarmonicMissing { order: 5, .. }
    ));
    assert!(matches!(
        new(1, load(0, 1, f64::NAN), usual),
        DynamicsError::OutOfRange { .. }
    ));
    let few = Settings {
        samples: 4,
        ..usual
    };
    assert!(matches!(
        new(1, drive(1.0), few),
        DynamicsError::Samples { .. }
    ));
    let mut short = model.clone();
    short.damping = Matrix::zeros(2, 2);
    let error = HarmonicBalance::new(
        &short,
        vec![oscillator.element.clone()],
        Harmonics::up_to(1),
        drive(1.0),
        usual,
    )
    .map(|_| ())
    .expect_err("wrong");
    assert!(
        matches!(
            error,
            DynamicsError::Length {
                found: 2,
                expected: 3,
                ..
            }
        ),
        "{error}"
    );
    for mass in [0.0, -1.0, f64::NAN] {
        let mut wrong = oscillator.clone();
        wrong.mass[1] = mass;
        assert!(matches!(
            wrong.model(),
            Err(DynamicsError::OutOfRange { .. })
        ));
    }
    for omega in [0.0, -3.0, f64::INFINITY] {
        let error = balance(&oscillator, 1, &drive(1.0), usual)
            .solve(omega, None)
            .expect_err("wrong");
        assert!(matches!(error, DynamicsError::OutOfRange { .. }));
    }
}
