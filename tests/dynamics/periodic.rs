//! Periodic motions in time, and harmonic balance by events against them.

use std::f64::consts::TAU;

use fretwear::dynamics::{
    ContactElement, FrictionLaw, HarmonicBalance, Harmonics, Load, Oscillator, Settings, Settled,
    TimeModel,
};

use super::{changed, drive, oscillator};

/// Harmonics of a balance that is as good as the motion in time.
const MANY: u32 = 31;

fn by_events(
    oscillator: &Oscillator,
    loads: &[Load],
    highest: u32,
) -> HarmonicBalance<ContactElement> {
    let settings = Settings {
        by_events: true,
        ..Settings::default()
    };
    super::balance(oscillator, highest, loads, settings)
}

fn settled(oscillator: &Oscillator, loads: &[Load], omega: f64, harmonics: &Harmonics) -> Settled {
    let model = oscillator.model().expect("an oscillator");
    let elements = [oscillator.element.clone()];
    let time = TimeModel::new(&model, &elements, loads).expect("an oscillator has no residual");
    time.settle(omega, &time.rest(), 1e-6, harmonics, 10_000_000)
        .expect("a steady motion")
}

/// Against the exact answer of a linear oscillator, whose contact sticks.
#[test]
fn linear_motion_is_that_of_the_closed_form() {
    let oscillator = oscillator(FrictionLaw::Cone);
    let harmonics = Harmonics::up_to(3);
    let omega = 700.0 * TAU;
    let loads = drive(1.0);
    let Settled::Periodic(periodic) = settled(&oscillator, &loads, omega, &harmonics) else {
        panic!("a linear motion settles");
    };
    let stiffness = oscillator.stiffness[0] + oscillator.element.tangential_stiffness();
    let (mass, damping) = (oscillator.mass[0], oscillator.damping[0]);
    let amplitude = 1.0 / (stiffness - mass * omega * omega).hypot(damping * omega);
    let found = periodic.displacement[1].hypot(periodic.displacement[2]);
    assert!(
        (found / amplitude - 1.0).abs() < 1e-7,
        "{found:e} {amplitude:e}"
    );
    assert!(periodic.energy.friction.abs() < 1e-9 * periodic.energy.input);
    let viscous = std::f64::consts::PI * damping * omega * amplitude * amplitude;
    assert!((periodic.energy.viscous / viscous - 1.0).abs() < 1e-7);
}

/// A period of a contact that is ten thousand times as stiff as the structure may take hundreds of thousands of steps: a search ends within it.
#[test]
fn a_search_ends_within_a_period() {
    const EFFORT: usize = 300;
    let gripped = oscillator(FrictionLaw::Cone);
    let stiff = Oscillator {
        element: changed(&gripped.element, |slider| {
            slider.tangential_stiffness = 1e4 * gripped.stiffness[0];
        }),
        ..gripped
    };
    let model = stiff.model().expect("an oscillator");
    let elements = [stiff.element.clone()];
    let loads = drive(1.0);
    let time = TimeModel::new(&model, &elements, &loads).expect("an oscillator has no residual");
    let omega = 0.1 * (stiff.stiffness[0] / stiff.mass[0]).sqrt();
    let (rest, harmonics) = (time.rest(), Harmonics::up_to(3));
    let settled = time.settle(omega, &rest, 1e-6, &harmonics, EFFORT);
    assert!(matches!(settled, Ok(Settled::Unsettled(_))), "{settled:?}");
    assert_eq!(time.steps(), 2 * EFFORT);
    let near = time.near(omega, &rest, 1e-6, &harmonics, EFFORT);
    assert!(!matches!(near, Ok(Some(_))), "{near:?}");
    assert!(time.steps() <= 4 * EFFORT);
}

/// Sliding, lifting off and closing a gap, along a line and in orbits: a balance of many harmonics has the amplitude of the motion.
#[test]
fn balance_is_the_motion_in_time() {
    let cone = oscillator(FrictionLaw::Cone);
    let boxed = oscillator(FrictionLaw::Box);
    let gap = Oscillator {
        element: changed(&cone.element, |slider| {
            (slider.normal_load, slider.gap) = (0.0, 1e-6)
        }),
        ..cone.clone()
    };
    let orbit = vec![
        Oscillator::load(0, 100.0, 0.0),
        Oscillator::load(1, 60.0, 1.2),
    ];
    let lift = vec![
        Oscillator::load(0, 60.0, 0.0),
        Oscillator::load(2, 150.0, 0.7),
    ];
    for (what, oscillator, loads, hertz, tolerance) in [
        ("sliding", &cone, drive(120.0), 850.0, 1e-5),
        ("orbit in a box", &boxed, orbit, 800.0, 1e-5),
        ("lift-off", &cone, lift.clone(), 900.0, 2e-4),
        ("lift-off in a box", &boxed, lift.clone(), 900.0, 2e-4),
        ("gap", &gap, lift, 1100.0, 2e-4),
    ] {
        let omega = hertz * TAU;
        let balance = by_events(oscillator, &loads, MANY);
        let response = balance
            .solve(omega, None)
            .unwrap_or_else(|error| panic!("{what}: {error}"));
        let Settled::Periodic(periodic) = settled(oscillator, &loads, omega, balance.harmonics())
        else {
            panic!("{what}: does not settle");
        };
        for port in 0..3 {
            let of = |rows: &[f64]| {
                let row = &rows[port * balance.harmonics().coefficients()..];
                row[1].hypot(row[2])
            };
            let (ours, theirs) = (of(&response.displacement), of(&periodic.displacement));
            let size = of(&periodic.displacement).max(1e-8);
            assert!(
                (ours - theirs).abs() < tolerance * size,
                "{what} {port}: {ours:e} {theirs:e}"
            );
        }
        let (ours, theirs) = (response.energy.friction, periodic.energy.friction);
        let input = periodic.energy.input;
        assert!(
            (ours - theirs).abs() < 10.0 * tolerance * input,
            "{what}: {ours:e} {theirs:e}"
        );
        assert!(
            periodic.energy.imbalance() < 1e-7,
            "{what}: {:?}",
            periodic.energy
        );
    }
}
