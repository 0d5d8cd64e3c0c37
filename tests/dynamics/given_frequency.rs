//! Tests of the response in force at a given frequency, below and above the resonance, against the describing function of one slider.

use fretwear::dynamics::{
    DynamicsError, FrictionLaw, Harmonics, ResolvedResonance, ResonanceKind, Vibration,
};
use fretwear::reference::Jenkins;

use super::{drive, oscillator, samples};

const MASS: f64 = 1.5;
const DAMPING: f64 = 300.0;
const STIFFNESS: f64 = 4.0e7;
/// Friction along x: a limit µN of 54 N on a spring of 2.5e7 N/m.
const JENKINS: Jenkins = Jenkins {
    stiffness: 2.5e7,
    limit: 54.0,
};
/// The resonance is at about 5.2e3 rad/s with a sliding slider, and at 6.6e3 rad/s with a sticking one.
const OMEGAS: [f64; 4] = [6.0, 2e3, 4.9e3, 9e3];
/// Amplitudes with a slider that sticks, slips, and slides for most of the cycle \[m\].
const AMPLITUDES: [f64; 3] = [1e-6, 4e-6, 4e-5];

/// Force that moves the oscillator with this amplitude in the first harmonic.
fn force(omega: f64, amplitude: f64) -> f64 {
    let (cosine, sine) = JENKINS.coefficients(amplitude, 1);
    let spring = (STIFFNESS - MASS * omega * omega) * amplitude + cosine;
    spring.hypot(sine - DAMPING * omega * amplitude)
}

fn vibration(omega: f64, force: f64, orders: &[u32]) -> Vibration {
    Vibration {
        at_omega: Some(omega),
        harmonics: Harmonics::new(orders).expect("harmonics"),
        settings: samples(512),
        ..super::vibration(
            &oscillator(FrictionLaw::Cone),
            1,
            drive(force),
            (omega, omega),
        )
    }
}

fn resolved<'a>(vibration: &'a Vibration, tolerance: Option<f64>) -> ResolvedResonance<'a> {
    let element = oscillator(FrictionLaw::Cone).element;
    let found = vibration.resolve(vec![element], None, tolerance);
    found.unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn the_response_is_that_of_the_describing_function() {
    for omega in OMEGAS {
        for amplitude in AMPLITUDES {
            let vibration = vibration(omega, force(omega, amplitude), &[0, 1]);
            let ResolvedResonance { resonance, .. } = resolved(&vibration, None);
            assert!(resonance.phase.is_none());
            assert_eq!(resonance.peak_kind, ResonanceKind::Forced);
            let response = resonance.governing();
            assert_eq!(response.omega, omega);
            let off = (resonance.amplitude / amplitude - 1.0).abs();
            assert!(off < 1e-4, "{omega} rad/s, {amplitude} m: off by {off:e}");
            let dissipated = JENKINS.dissipated_energy(amplitude);
            let left = (response.energy.friction - dissipated).abs();
            assert!(
                left <= 1e-3 * dissipated + 1e-9 * response.energy.load_work,
                "{left:e} J"
            );
            assert!(response.energy.imbalance() < 1e-6);
        }
    }
}

/// The response is continued to another joint, and extended by as many harmonics as the tolerance requires. The frequency stays the same,
/// and the error bar covers the truncation error.
#[test]
fn it_is_continued_and_extended() {
    let element = oscillator(FrictionLaw::Cone).element;
    for omega in OMEGAS {
        let vibration = vibration(omega, force(omega, 4e-6), &[0, 1]);
        let first = resolved(&vibration, None);
        let stiffer = super::changed(&element, |slider| slider.tangential_stiffness *= 1.1);
        let start = first.resonance.governing().start();
        let start = Some((first.balance.harmonics(), &start));
        let next = vibration.resolve(vec![stiffer], start, None);
        let next = next.unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(next.resonance.governing().omega, omega);
        let again = next.resonance.governing().start();
        let back = Some((next.balance.harmonics(), &again));
        let back = vibration.resolve(vec![element.clone()], back, None);
        let back = back.unwrap_or_else(|error| panic!("{error}"));
        let off = (back.resonance.amplitude / first.resonance.amplitude - 1.0).abs();
        assert!(off < 1e-9, "{off:e}");

        let fine = resolved(&vibration, Some(1e-3));
        assert_eq!(fine.resonance.governing().omega, omega);
        // Far above the resonance, inertia prevents motion in higher harmonics.
        assert!(fine.balance.harmonics().highest() > 1 || omega > 8e3);
        let off = (first.resonance.amplitude / fine.resonance.amplitude - 1.0).abs();
        let bars = first.truncation.amplitude + fine.truncation.amplitude;
        assert!(
            off <= bars && fine.truncation.amplitude < 1e-2,
            "{off:e} of {bars:e}"
        );
    }
}

#[test]
fn what_nothing_damps_has_no_response_at_its_resonance() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    let stuck = ((STIFFNESS + JENKINS.stiffness) / MASS).sqrt();
    let vibration = Vibration {
        model: oscillator.model().expect("valid"),
        ..vibration(stuck, 1.0, &[0, 1])
    };
    let found = vibration.resolve(vec![oscillator.element], None, None);
    let Err(DynamicsError::Undamped { .. }) = found else {
        panic!("it has a response");
    };
}
