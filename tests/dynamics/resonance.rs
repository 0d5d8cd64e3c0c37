//! Tests of the phase resonance, tracked directly, and of the peak.

use std::f64::consts::PI;

use fretwear::dynamics::{BalanceSettings, DynamicsError, FrictionLaw, Response, Start};

use super::{balance, drive, oscillator, samples};

/// The range begins below the sliding resonance along x and ends above the stuck one.
const RANGE: (f64, f64) = (4000.0, 7500.0);

#[test]
fn phase_resonance_lags_by_a_quarter_at_every_load() {
    let mut before: Option<Response> = None;
    let mut last = f64::INFINITY;
    for force in [0.5, 20.0, 60.0, 150.0, 400.0, 1e4, 1e6] {
        let balance = balance(
            &oscillator(FrictionLaw::Cone),
            5,
            &drive(force),
            BalanceSettings::default(),
        );
        let cold = balance
            .phase_resonance(RANGE, None)
            .unwrap_or_else(|e| panic!("{force} N: {e}"));
        let (_, lag) = balance.amplitude(&cold, 0).expect("port 0");
        assert!((lag - 0.5 * PI).abs() < 1e-8, "{force} N: {lag}");
        assert!(cold.energy.imbalance() < 1e-6, "{:?}", cold.energy);
        // Friction only reduces the frequency.
        assert!(
            cold.omega <= last * (1.0 + 1e-9),
            "{force} N: {}",
            cold.omega
        );
        last = cold.omega;
        if let Some(before) = &before {
            let warm = balance
                .phase_resonance(RANGE, Some(&before.start()))
                .unwrap_or_else(|e| panic!("{e}"));
            assert!((warm.omega / cold.omega - 1.0).abs() < 1e-7, "{force} N");
        }
        before = Some(cold);
    }
    // The frequencies range from stuck to sliding.
    assert!((last - (4.0e7_f64 / 1.5).sqrt()).abs() < 1.0, "{last}");
}

/// The solver rejects a guess of the wrong length, and does not return another resonance instead.
#[test]
fn a_guess_in_other_harmonics_is_refused() {
    let [few, many] = [3, 5].map(|highest| {
        balance(
            &oscillator(FrictionLaw::Cone),
            highest,
            &drive(150.0),
            BalanceSettings::default(),
        )
    });
    let found = few.phase_resonance(RANGE, None).expect("a resonance");
    let refused = many.phase_resonance(RANGE, Some(&found.start()));
    assert!(
        matches!(refused, Err(DynamicsError::Length { .. })),
        "{refused:?}"
    );
    let start = found
        .start()
        .in_harmonics(few.harmonics(), many.harmonics());
    assert!(many.phase_resonance(RANGE, Some(&start)).is_ok());
}

#[test]
fn warm_tracking_needs_few_iterations() {
    let track = |load: f64, guess: Option<Start>| {
        let mut oscillator = oscillator(FrictionLaw::Cone);
        oscillator.element.sliders[0].normal_load = load;
        balance(&oscillator, 5, &drive(150.0), BalanceSettings::default())
            .phase_resonance(RANGE, guess.as_ref())
            .unwrap_or_else(|e| panic!("{e}"))
    };
    let first = track(90.0, None);
    let second = track(90.9, Some(first.start()));
    assert!(second.iterations <= 6, "{}", second.iterations);
}

#[test]
fn peak_is_higher_than_its_neighbours() {
    for force in [0.5, 60.0, 150.0, 400.0] {
        // With 64 samples the amplitude has ripples of 4e-4, each with a maximum.
        let balance = balance(
            &oscillator(FrictionLaw::Cone),
            3,
            &drive(force),
            samples(2048),
        );
        let resonance = balance
            .phase_resonance(RANGE, None)
            .unwrap_or_else(|e| panic!("{e}"));
        let peak = balance
            .peak(0, RANGE, &resonance.start())
            .unwrap_or_else(|e| panic!("{force} N: {e}"));
        let size = |omega: f64| {
            let response = balance
                .solve(omega, Some(&peak.start()))
                .unwrap_or_else(|e| panic!("{e}"));
            balance.amplitude(&response, 0).expect("port 0").0
        };
        let top = balance.amplitude(&peak, 0).expect("port 0").0;
        for offset in [-1e-2, -1e-3, -1e-4, 1e-4, 1e-3, 1e-2] {
            let there = size(peak.omega * (1.0 + offset));
            assert!(
                there <= top * (1.0 + 2e-6),
                "{force} N, {offset}: {there} {top}"
            );
        }
        if force == 0.5 {
            // Linear response: ω_p² = ω₀² − c²/2m².
            let expected = ((6.5e7_f64 / 1.5) - 0.5 * (300.0_f64 / 1.5).powi(2)).sqrt();
            assert!(
                (peak.omega / expected - 1.0).abs() < 1e-7,
                "{} {expected}",
                peak.omega
            );
        }
    }
}

#[test]
fn a_range_without_resonance_says_so() {
    let balance = balance(
        &oscillator(FrictionLaw::Cone),
        1,
        &drive(1.0),
        BalanceSettings::default(),
    );
    let error = balance
        .phase_resonance((1000.0, 1500.0), None)
        .expect_err("no resonance in the range");
    assert!(
        matches!(error, DynamicsError::NoResonance { .. }),
        "{error}"
    );
    let resonance = balance.phase_resonance(RANGE, None).expect("a resonance");
    let error = balance
        .peak(0, (4000.0, 6000.0), &resonance.start())
        .expect_err("the peak is outside");
    assert!(
        matches!(error, DynamicsError::NoResonance { what: "peak", .. }),
        "{error}"
    );
    let still = super::balance(
        &oscillator(FrictionLaw::Cone),
        1,
        &[],
        BalanceSettings::default(),
    );
    let error = still.phase_resonance(RANGE, None).expect_err("no load");
    assert!(matches!(error, DynamicsError::OutOfRange { .. }), "{error}");
}
