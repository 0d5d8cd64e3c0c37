//! Tests of the reduced model with its pseudo-modes against the structure before the reduction.
//!
//! The springs of the stuck joint are elements of the whole mesh. The modes and the residual of this mesh, which the tests of the reduction
//! compare with direct solves, are the reference for the reduced model with the same springs.

use std::f64::consts::TAU;

use fretwear::dynamics::{
    BalanceSettings, Damping, HarmonicBalance, Harmonics, Load, reduced_model, reference_springs,
};
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::modes::ModeOptions;
use fretwear::structure::reduction::{ContactPorts, Ports, ReducedStructure, reduce};
use fretwear::structure::resonator::Resonator;

use super::resonator::{coarse, elements};

const RATIO: f64 = 0.002;
/// Modes of the structure with springs: the modes above them move by less than 1e-5 of the residual up to 7 kHz.
const MODES: usize = 60;
/// Load under which all elements stick \[N\].
const STUCK: f64 = 1e-3;

/// Error of a reduced model against the whole structure.
struct Off {
    /// Error of the phase resonance \[Hz\].
    resonance: f64,
    /// Relative error of the amplitude at the drive within 15 Hz of the phase resonance.
    flanks: f64,
    /// Relative error of the displacement of the contact ports under a force on one of them, at 3, 5 and 7 times the resonance.
    harmonics: [f64; 3],
}

/// Angular frequency at which the displacement of the drive lags by 90° \[rad/s\].
fn phase_resonance(whole: &ReducedStructure, drive: usize, near: f64) -> f64 {
    let real = |omega: f64| whole.receptance(omega, RATIO).0[(drive, drive)];
    let (mut low, mut high) = (0.998 * near, 1.002 * near);
    assert!(real(low) > 0.0 && real(high) < 0.0);
    while high - low > 1e-12 * near {
        let middle = 0.5 * (low + high);
        match real(middle) > 0.0 {
            true => low = middle,
            false => high = middle,
        }
    }
    0.5 * (low + high)
}

fn off(resonator: &Resonator, range: [f64; 2]) -> Off {
    let mesh = resonator.mesh().unwrap();
    let ports = Ports::new(&mesh.contacts, &mesh.points, ContactPorts::Faces);
    let elements = elements(&mesh);
    let stiffness = reference_springs(&elements);
    let system = |springs: &[Spring]| {
        System::assemble(&mesh.mesh, Formulation::IncompatibleModes, springs).unwrap()
    };
    let reduced = reduce(&system(&[]), ports.clone(), &ModeOptions::new(30)).unwrap();
    let springs: Vec<Spring> = ports
        .combinations
        .iter()
        .zip(&stiffness)
        .map(|(on, &stiffness)| Spring {
            on: on.clone(),
            stiffness,
        })
        .collect();
    let whole = reduce(&system(&springs), ports.clone(), &ModeOptions::new(MODES)).unwrap();

    let drive = ports.of_point("far_wall", 0).unwrap();
    let damping = Damping {
        ratio: RATIO,
        springs: Some(&stiffness),
    };
    let model = reduced_model(&reduced, &[drive], damping).unwrap();
    let contact = ports.contact_ports();
    let balance = |port: usize, harmonic: u32, harmonics: &[u32]| {
        let load = |port, harmonic| Load {
            port,
            harmonic,
            cosine: STUCK,
            sine: 0.0,
        };
        let harmonics = Harmonics::new(harmonics).unwrap();
        let loads = vec![load(port, harmonic)];
        HarmonicBalance::new(
            &model,
            elements.clone(),
            harmonics,
            loads,
            BalanceSettings::default(),
        )
        .unwrap()
    };
    let driven = balance(contact, 1, &[0, 1]);
    let range = (TAU * range[0], TAU * range[1]);
    let found = driven.phase_resonance(range, None).unwrap();
    let expected = phase_resonance(&whole, drive, found.omega);
    let mut flanks = 0.0_f64;
    for step in -30..=30 {
        let omega = expected + TAU * 0.5 * f64::from(step);
        let response = driven.solve(omega, None).unwrap();
        let (real, imaginary) = whole.receptance(omega, RATIO);
        let expected = STUCK * real[(drive, drive)].hypot(imaginary[(drive, drive)]);
        let amplitude = driven.amplitude(&response, contact).unwrap().0;
        flanks = flanks.max((amplitude / expected - 1.0).abs());
    }
    // Port along x away from the middle of the joint.
    let port = 3 * (ports.contacts / 3);
    let harmonics = [3, 5, 7].map(|k| {
        let loaded = balance(port, k, &[0, 1, k]);
        let response = loaded.solve(found.omega, None).unwrap();
        assert_eq!(response.active_elements(), 0, "stuck");
        let (real, imaginary) = whole.receptance(f64::from(k) * found.omega, RATIO);
        let (mut missed, mut size) = (0.0, 0.0);
        for other in 0..contact {
            // Normal displacement is positive where the bodies approach.
            let sign = if other % 3 == 2 { -1.0 } else { 1.0 };
            let expected = [
                sign * STUCK * real[(other, port)],
                -sign * STUCK * imaginary[(other, port)],
            ];
            let row = &response.displacement[5 * other..][..5];
            missed += (row[3] - expected[0]).powi(2) + (row[4] - expected[1]).powi(2);
            size += expected[0].powi(2) + expected[1].powi(2);
        }
        (missed / size).sqrt()
    });
    let off = Off {
        resonance: (found.omega - expected) / TAU,
        flanks,
        harmonics,
    };
    println!(
        "{:.3} Hz: resonance off by {:+.5} Hz, flanks by {:.1e}; contact at 3, 5, 7 times that by {:.1e}",
        expected / TAU,
        off.resonance,
        off.flanks,
        off.harmonics.into_iter().fold(0.0, f64::max)
    );
    println!(
        "{:.1e} {:.1e} {:.1e}",
        harmonics[0], harmonics[1], harmonics[2]
    );
    off
}

fn hold(resonator: &Resonator, range: [f64; 2]) {
    let off = off(resonator, range);
    assert!(off.resonance.abs() < 0.005, "{} Hz", off.resonance);
    assert!(off.flanks < 2e-3, "{:e}", off.flanks);
    // Pseudo-modes are Ritz vectors of static shapes: their accuracy decreases towards the first omitted mode.
    for (found, most) in off.harmonics.into_iter().zip([1e-3, 3e-3, 1e-2]) {
        assert!(found < most, "{found:e}");
    }
}

#[test]
fn a_coarse_resonator_and_its_harmonics() {
    hold(&coarse(), [850.0, 1100.0]);
}

#[test]
#[ignore = "long: two reductions of the published resonator: a minute"]
fn the_published_resonator_and_its_harmonics() {
    hold(&Resonator::default(), [900.0, 1050.0]);
}
