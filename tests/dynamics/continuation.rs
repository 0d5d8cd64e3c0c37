//! Tests of the continuation of branches through turning points.

use fretwear::dynamics::{
    BalanceSettings, ContactElement, Continuation, ContinuationSettings, DynamicsError,
    FrictionLaw, HarmonicBalance, Oscillator, Response,
};
use fretwear::reference::Duffing;

use super::{BOTH, balance, balance_of, cubic, drive, oscillator, samples, springs};

pub fn collect(
    balance: &HarmonicBalance<ContactElement>,
    settings: ContinuationSettings,
) -> Vec<Response> {
    Continuation::new(balance, settings)
        .and_then(Iterator::collect)
        .unwrap_or_else(|error: DynamicsError| panic!("{error}"))
}

#[test]
fn duffing_is_followed_through_both_turning_points() {
    let duffing = Duffing {
        mass: 1.5,
        damping: 300.0,
        stiffness: 4.0e7,
        cubic: 1.2e16,
    };
    let model = oscillator(FrictionLaw::Cone).model().expect("valid");
    let force = duffing.resonant_force(4e-5);
    let hard = springs(vec![cubic(0, 1.2e16)]);
    let balance = balance_of(
        &model,
        &[hard],
        1,
        &drive(force),
        BalanceSettings::default(),
    );
    for (from, to) in [(4500.0, 7500.0), (7500.0, 4500.0)] {
        let branch = collect(&balance, ContinuationSettings::over(from, to, 0));
        let direction = f64::signum(to - from);
        let backwards = branch
            .windows(2)
            .filter(|p| direction * (p[1].omega - p[0].omega) < 0.0)
            .count();
        println!(
            "Duffing {from} to {to}: {} points, {backwards} backwards",
            branch.len()
        );
        assert!(
            backwards > 3 && branch.len() < 300,
            "{backwards} of {}",
            branch.len()
        );
        assert_eq!(branch.last().map(|r| r.omega), Some(to));
        for response in &branch {
            let (amplitude, _) = balance.amplitude(response, 0).expect("port 0");
            let held = duffing.force(amplitude, response.omega);
            assert!(
                (held / force - 1.0).abs() < 1e-7,
                "{held} {force} at {}",
                response.omega
            );
        }
        let largest = branch
            .iter()
            .map(|r| balance.amplitude(r, 0).expect("port 0").0)
            .fold(0.0, f64::max);
        assert!((largest / 4e-5 - 1.0).abs() < 0.01, "{largest}");
    }
}

#[test]
fn friction_branch_is_the_response_at_its_frequencies() {
    for law in BOTH {
        let loads = [
            Oscillator::load(0, 120.0, 0.0),
            Oscillator::load(2, 60.0, 0.5),
        ];
        let balance = balance(&oscillator(law), 3, &loads, BalanceSettings::default());
        let branch = collect(&balance, ContinuationSettings::over(4500.0, 7000.0, 0));
        assert!(branch.len() > 40 && branch.len() < 300, "{}", branch.len());
        assert_eq!(branch.first().map(|r| r.omega), Some(4500.0));
        for response in branch.iter().step_by(5) {
            assert!(response.energy.imbalance() < 1e-6, "{:?}", response.energy);
            let direct = balance
                .solve(response.omega, None)
                .unwrap_or_else(|e| panic!("{e}"));
            let (a, b) = (
                balance.amplitude(response, 0),
                balance.amplitude(&direct, 0),
            );
            let (a, b) = (a.expect("port 0").0, b.expect("port 0").0);
            assert!(
                (a / b - 1.0).abs() < 1e-7,
                "{} rad/s: {a} {b}",
                response.omega
            );
        }
    }
}

#[test]
fn a_gap_bends_the_resonance_over() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    (
        oscillator.element.sliders[0].normal_load,
        oscillator.element.sliders[0].gap,
    ) = (0.0, 2e-6);
    oscillator.damping = [150.0; 3];
    let balance = balance(
        &oscillator,
        5,
        &[Oscillator::load(2, 20.0, 0.0)],
        samples(256),
    );
    let branch = collect(&balance, ContinuationSettings::over(5900.0, 8000.0, 2));
    let backwards = branch
        .windows(2)
        .filter(|p| p[1].omega < p[0].omega)
        .count();
    assert!(backwards > 0, "{} points, none backwards", branch.len());
    assert!(
        branch.iter().any(|r| r.active_elements() == 0)
            && branch.iter().any(|r| r.active_elements() == 1)
    );
    assert!(branch.iter().all(|r| r.energy.imbalance() < 1e-6));
}

#[test]
fn settings_out_of_range_are_named() {
    let balance = balance(
        &oscillator(FrictionLaw::Cone),
        1,
        &drive(1.0),
        BalanceSettings::default(),
    );
    for settings in [
        ContinuationSettings::over(5000.0, 5000.0, 0),
        ContinuationSettings::over(0.0, 5000.0, 0),
        ContinuationSettings::over(4000.0, 5000.0, 3),
    ] {
        assert!(matches!(
            Continuation::new(&balance, settings),
            Err(DynamicsError::OutOfRange { .. })
        ));
    }
}
