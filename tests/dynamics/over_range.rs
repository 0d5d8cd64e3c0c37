//! Tests of resonances together with their forced response: no point of the forced response is above the peak.

use std::f64::consts::{PI, TAU};

use fretwear::dynamics::forced_response::SolutionMethod;
use fretwear::dynamics::{
    ContactElement, DynamicsError, FrictionLaw, Harmonics, Load, Oscillator, RangeResponse,
    ResonanceKind, Spring, Vibration,
};

use super::{one_slider, samples, springs};

fn vibration(
    oscillator: &Oscillator,
    loads: Vec<Load>,
    response_port: usize,
    range: (f64, f64),
) -> Vibration {
    Vibration {
        response_port,
        settings: samples(256),
        ..super::vibration(oscillator, 5, loads, (TAU * range.0, TAU * range.1))
    }
}

fn element(normal_load: f64, kt: f64, kn: f64) -> ContactElement {
    one_slider(FrictionLaw::Cone, 0.3, normal_load, [kt, kn])
}

fn light(element: ContactElement) -> Oscillator {
    Oscillator {
        mass: [1.0, 1.0, 1.0],
        damping: [2.0, 2.0, 2.0],
        stiffness: [4e4, 4e4, 4e4],
        element,
    }
}

fn over_range<'a>(vibration: &'a Vibration, element: &ContactElement) -> RangeResponse<'a> {
    let found = vibration.resolve_over_range(vec![element.clone()], None);
    found.expect("a resonance")
}

/// Returns the amplitude of the peak, after a check that no point is above it.
fn top(vibration: &Vibration, oscillator: &Oscillator) -> f64 {
    /// Relative amount by which a peak may be below a neighbouring point.
    const FLAT: f64 = 2e-5;
    let RangeResponse { resolved, points } = over_range(vibration, &oscillator.element);
    let peak = resolved.resonance.peak_amplitude;
    for point in points.expect("a forced response") {
        let Some(response) = point.response else {
            continue;
        };
        assert!(
            response.amplitude <= peak * (1.0 + FLAT),
            "{} Hz",
            point.frequency
        );
    }
    peak
}

/// Loads on one port in one harmonic add up in amplitude and phase; the drive is their sum.
#[test]
fn loads_on_a_port_are_one() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    let range = (20.0, 60.0);
    let both = vec![
        Oscillator::load(0, 4.0, 0.0),
        Oscillator::load(0, 4.0, PI / 2.0),
    ];
    let one = vec![Oscillator::load(0, 4.0 * f64::sqrt(2.0), PI / 4.0)];
    let peaks = [both, one].map(|loads| {
        let vibration = vibration(&oscillator, loads, 0, range);
        let resonance = over_range(&vibration, &oscillator.element)
            .resolved
            .resonance;
        (resonance.peak_amplitude, resonance.governing().omega)
    });
    let same = |a: f64, b: f64| (a / b - 1.0).abs() < 1e-9;
    assert!(same(peaks[0].0, peaks[1].0), "{peaks:?}");
    assert!(same(peaks[0].1, peaks[1].1), "{peaks:?}");

    let against = vec![Oscillator::load(0, 4.0, 0.0), Oscillator::load(0, 8.0, PI)];
    let vibration_against = vibration(&oscillator, against, 0, range);
    let alone = vibration(&oscillator, vec![Oscillator::load(0, 4.0, 0.0)], 0, range);
    let peaks = [vibration_against, alone].map(|vibration| top(&vibration, &oscillator));
    assert!(same(peaks[0], peaks[1]), "{peaks:?}");
}

#[test]
fn loads_that_cancel_are_no_drive() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    let loads = vec![
        Oscillator::load(0, 4.0, 0.3),
        Oscillator::load(0, 4.0, 0.3 + PI),
    ];
    let vibration = vibration(&oscillator, loads, 0, (20.0, 60.0));
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    assert!(balance.drive().is_none());
    assert!(matches!(
        balance.phase_resonance(vibration.range, None),
        Err(DynamicsError::OutOfRange { .. })
    ));
}

/// A mass that bounces on its contact has a main resonance, and further resonances where a harmonic is resonant.
#[test]
fn the_highest_point_is_the_peak() {
    let oscillator = Oscillator {
        damping: [0.6; 3],
        ..light(element(1.0, 3e4, 9e4))
    };
    let loads = vec![Oscillator::load(2, 6.0, 0.0), Oscillator::load(0, 1.0, 0.5)];
    let vibration = vibration(&oscillator, loads, 2, (8.0, 90.0));
    top(&vibration, &oscillator);
    let at_points = Vibration {
        points: Some(40),
        ..vibration.clone()
    };
    top(&at_points, &oscillator);
}

/// Without preload the problem is homogeneous in the load, but it has responses.
#[test]
fn no_preload_has_a_response() {
    let oscillator = light(element(0.0, 3e4, 5e4));
    let loads = vec![Oscillator::load(0, 4.0, 0.0), Oscillator::load(2, 6.0, 1.0)];
    let vibration = Vibration {
        points: Some(31),
        ..vibration(&oscillator, loads, 0, (15.0, 60.0))
    };
    let balance = vibration
        .balance(vec![oscillator.element.clone()])
        .expect("a balance");
    let points = vibration.forced_response(&balance).expect("points");
    assert_eq!(points.len(), 31);
    let found = points
        .iter()
        .filter(|point| point.response.is_some())
        .count();
    assert!(found >= 29, "{found} of 31");
    for point in points {
        match point.found_by {
            SolutionMethod::Balance => assert!(point.residual <= 1e-6, "{point:?}"),
            SolutionMethod::Unphysical | SolutionMethod::NotFound => {
                assert!(point.response.is_none())
            }
        }
    }
}

#[test]
fn a_load_across_the_response_is_not_the_drive() {
    let mut oscillator = light(element(100.0, 1e5, 1e5));
    oscillator.stiffness = [1e6, 1e6, 1e8];
    let (across, along) = (
        Oscillator::load(2, 1.0, 0.0),
        Oscillator::load(0, 20.0, 0.0),
    );
    let of = |loads| {
        let vibration = vibration(&oscillator, loads, 0, (100.0, 250.0));
        let resonance = over_range(&vibration, &oscillator.element)
            .resolved
            .resonance;
        assert!(resonance.phase.is_some());
        (resonance.peak_frequency, resonance.peak_amplitude)
    };
    let (first, second) = (of(vec![across, along]), of(vec![along, across]));
    assert!(
        (first.0 / second.0 - 1.0).abs() < 1e-9,
        "{first:?} {second:?}"
    );
    assert!(
        (first.1 / second.1 - 1.0).abs() < 1e-9,
        "{first:?} {second:?}"
    );
}

#[test]
fn without_a_phase_resonance_the_peak_stays() {
    // Above the resonance all displacements lag the drive by more than a quarter of a cycle.
    let oscillator = light(element(100.0, 1e5, 1e5));
    let vibration = vibration(
        &oscillator,
        vec![Oscillator::load(0, 1.0, 0.0)],
        0,
        (90.0, 120.0),
    );
    let resonance = over_range(&vibration, &oscillator.element)
        .resolved
        .resonance;
    assert!(resonance.phase.is_none());
    assert_eq!(resonance.peak_kind, ResonanceKind::End);
    assert!((resonance.peak_frequency / 90.0 - 1.0).abs() < 1e-9);
    assert_eq!(resonance.governing(), &resonance.peak);
}

/// The peak of a response point without motion is rounding; the result marks it as still.
#[test]
fn what_nothing_moves_is_still() {
    let oscillator = light(element(20.0, 3e4, 5e4));
    for (port, is_still) in [(2, true), (0, false)] {
        let loads = vec![Oscillator::load(0, 4.0, 0.3)];
        let vibration = vibration(&oscillator, loads, port, (20.0, 60.0));
        let resolved = over_range(&vibration, &oscillator.element).resolved;
        assert_eq!(resolved.resonance.is_still, is_still, "along {port}");
        assert_eq!(
            resolved.truncation.amplitude >= 1.0,
            is_still,
            "along {port}"
        );
    }
}

/// The number of samples grows with the harmonics: a mass between a stop and its spring has the same response with more samples.
#[test]
fn harmonics_bring_their_samples() {
    /// Tolerance for the sampling error.
    const LEFT: f64 = 0.01;
    let oscillator = light(springs(vec![Spring::Stop {
        direction: 0,
        stiffness: 8e4,
        gap: 1e-4,
    }]));
    let loads = vec![Oscillator::load(0, 4.0, 0.0)];
    let mut vibration = vibration(&oscillator, loads, 0, (20.0, 60.0));
    vibration.settings.samples = 64;
    let few = Harmonics::up_to(5);
    let amplitude = |samples: usize| {
        let mut vibration = Vibration {
            harmonics: few.clone(),
            ..vibration.clone()
        };
        vibration.settings.samples = samples;
        let balance = vibration
            .balance_of(vec![oscillator.element.clone()], Harmonics::up_to(31))
            .expect("a balance");
        let response = balance.solve(TAU * 38.0, None).expect("a response");
        balance.amplitude(&response, 0).expect("a port").0
    };
    let apart = amplitude(64) / amplitude(4096) - 1.0;
    assert!(apart.abs() < LEFT, "{apart}");
}
