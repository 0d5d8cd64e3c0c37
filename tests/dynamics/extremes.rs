//! Tests of every parameter at its extremes: the program returns a correct response or a typed error.

use fretwear::dynamics::{
    BalanceSettings, ContactElement, DynamicsError, FrictionLaw, HarmonicBalance, Harmonics, Load,
    Oscillator, Response, Slider,
};
use fretwear::linalg::RowMatrix as Matrix;

use super::{BOTH, balance, balance_of, drive, oscillator, swept};

/// Responses over the resonances of stuck, sliding and open contact; checks the energy balance and the friction law of each.
fn respond(oscillator: &Oscillator, loads: &[Load], what: &str) -> Vec<Response> {
    let balance = balance(oscillator, 5, loads, BalanceSettings::default());
    let omegas: Vec<f64> = (0..25).map(|k| 4500.0 + 140.0 * k as f64).collect();
    let responses = swept(&balance, &omegas);
    for response in &responses {
        let energy = response.energy;
        assert!(
            energy.imbalance() < 1e-6,
            "{what}, {} rad/s: {energy:?}",
            response.omega
        );
        let is_damped = oscillator.damping[0] > 0.0;
        assert_eq!(energy.viscous > 0.0, is_damped, "{what}: {energy:?}");
        assert!(response.displacement.iter().all(|u| u.is_finite()));
        let element = &oscillator.element;
        for cycle in balance.element_cycles(response, balance.sampling()) {
            assert!(cycle.dissipated_energy >= 0.0, "{what}");
            for [x, y, n] in cycle.force {
                let size = match element.law {
                    FrictionLaw::Cone => x.hypot(y),
                    FrictionLaw::Box => x.abs().max(y.abs()),
                };
                let limit = element.friction_coefficient * n * (1.0 + 1e-9);
                assert!(n >= 0.0 && size <= limit, "{what}: {x} {y} {n}");
            }
        }
    }
    responses
}

/// Load along x and along the normal.
fn oblique(force: f64) -> Vec<Load> {
    vec![
        Oscillator::load(0, force, 0.0),
        Oscillator::load(2, 0.4 * force, 0.7),
    ]
}

/// Load along each axis; the normal component does not lift off the mass.
fn spatial(force: f64) -> Vec<Load> {
    vec![
        Oscillator::load(0, force, 0.4),
        Oscillator::load(1, 0.3 * force, -0.9),
        Oscillator::load(2, (0.1 * force).min(40.0), 0.2),
    ]
}

#[test]
fn responses_keep_the_balance_of_energy_and_the_law_of_friction() {
    let with = |law: FrictionLaw, change: &dyn Fn(&mut ContactElement)| {
        let mut oscillator = oscillator(law);
        change(&mut oscillator.element);
        oscillator
    };
    for law in BOTH {
        for mu in [0.0, 1e-4, 0.6, 10.0] {
            let changed = with(law, &|element| element.friction_coefficient = mu);
            respond(&changed, &oblique(100.0), &format!("{law:?}, µ {mu}"));
        }
        // The forces cover linear response, sliding and separation.
        for force in [1.0, 10.0, 30.0, 100.0, 300.0, 1e3, 1e4, 1e5, 1e6] {
            let what = format!("{law:?}, {force} N");
            respond(&oscillator(law), &oblique(force), &what);
            for response in respond(&oscillator(law), &spatial(force), &what) {
                // Without opening, sampling adds no work of the normal force.
                let energy = response.energy;
                assert!(
                    energy.friction >= -1e-9 * energy.load_work,
                    "{what}: {energy:?}"
                );
            }
        }
    }
    let slider = |change: &dyn Fn(&mut Slider)| {
        with(FrictionLaw::Cone, &|element| {
            change(&mut element.sliders[0])
        })
    };
    for (load, gap) in [
        (0.0, 0.0),
        (0.0, 1e-7),
        (0.0, 1e-6),
        (0.0, 1.0),
        (1e-6, 0.0),
    ] {
        let changed = slider(&|slider| (slider.normal_load, slider.gap) = (load, gap));
        respond(&changed, &oblique(50.0), &format!("N₀ {load}, gap {gap}"));
    }
    for decade in 4..=12 {
        let kn = 10_f64.powi(decade);
        let stiff = slider(&|slider| slider.normal_stiffness = kn);
        respond(&stiff, &oblique(100.0), &format!("k_n {kn:e}, loaded"));
        let open = slider(&|slider| {
            slider.normal_stiffness = kn;
            (slider.normal_load, slider.gap) = (0.0, 1e-6);
        });
        respond(&open, &oblique(30.0), &format!("k_n {kn:e}, with a gap"));
    }
    let changes: [fn(&mut Slider); 2] = [
        |slider| slider.normal_stiffness = 0.0,
        |slider| slider.tangential_stiffness = 0.0,
    ];
    for change in changes {
        let changed = with(FrictionLaw::Box, &|element| change(&mut element.sliders[0]));
        respond(&changed, &oblique(100.0), "a stiffness of zero");
    }
    let mut undamped = oscillator(FrictionLaw::Cone);
    undamped.damping = [0.0; 3];
    respond(&undamped, &oblique(100.0), "no damping");
}

#[test]
fn an_undamped_stuck_resonance_has_no_linear_response() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    // 1.5·6000² = 5.4e7 exactly.
    oscillator.stiffness[0] = 5.4e7 - 2.5e7;
    let balance = balance(&oscillator, 1, &drive(1e-3), BalanceSettings::default());
    let error = balance.solve(6000.0, None).expect_err("unbounded");
    assert!(matches!(error, DynamicsError::Undamped { .. }), "{error}");
}

#[test]
fn an_undamped_resonance_is_bounded_by_friction() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    // 4µN/π = 68.8 N.
    let held = balance(&oscillator, 3, &drive(60.0), BalanceSettings::default());
    let response = held
        .phase_resonance((4000.0, 7500.0), None)
        .unwrap_or_else(|e| panic!("{e}"));
    assert!(
        response.energy.imbalance() < 1e-6 && response.energy.viscous == 0.0,
        "{:?}",
        response.energy
    );
}

#[test]
fn a_structure_without_contact() {
    let mut model = oscillator(FrictionLaw::Cone).model().expect("valid");
    model.contact_dofs = 0;
    let balance = balance_of(&model, &[], 1, &drive(3.0), BalanceSettings::default());
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
        let balance = balance(&oscillator, 3, &drive(force), BalanceSettings::default());
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
    let free = balance(&oscillator, 1, &loads, BalanceSettings::default());
    let response = free.solve(5000.0, None).unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(response.displacement[0], 0.0);
    loads.push(Load {
        port: 0,
        harmonic: 0,
        cosine: 5.0,
        sine: 0.0,
    });
    let pushed = balance(&oscillator, 1, &loads, BalanceSettings::default());
    let error = pushed.solve(5000.0, None).expect_err("runs away");
    assert!(
        matches!(error, DynamicsError::Unsupported { .. }),
        "{error}"
    );
}

#[test]
fn what_does_not_fit_is_refused() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let model = oscillator.model().expect("valid");
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
    let usual = BalanceSettings::default();
    let load = |port, harmonic, cosine| {
        vec![Load {
            port,
            harmonic,
            cosine,
            sine: 0.0,
        }]
    };
    let few = BalanceSettings {
        samples: 4,
        ..usual
    };
    type Expected = fn(&DynamicsError) -> bool;
    let length: Expected = |e| {
        matches!(
            e,
            DynamicsError::Length {
                found: 3,
                expected: 6,
                ..
            }
        )
    };
    let range: Expected = |e| matches!(e, DynamicsError::OutOfRange { .. });
    let missing: Expected = |e| matches!(e, DynamicsError::HarmonicMissing { order: 5, .. });
    let samples: Expected = |e| matches!(e, DynamicsError::Samples { .. });
    for (what, error, is_expected) in [
        ("elements", new(2, drive(1.0), usual), length),
        ("a port", new(1, load(3, 1, 1.0), usual), range),
        ("a harmonic", new(1, load(0, 5, 1.0), usual), missing),
        ("an amplitude", new(1, load(0, 1, f64::NAN), usual), range),
        ("samples", new(1, drive(1.0), few), samples),
    ] {
        assert!(is_expected(&error), "{what}: {error}");
    }
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
