use fretwear::reference::elastic;
use std::f64::consts::PI;

use fretwear::reference::Westergaard;

use super::{PAIR, QUADRATURE};
use crate::quadrature::integrate;

fn wave(share: f64) -> Westergaard {
    let mut wave = Westergaard {
        wavelength: 1.3e-3,
        amplitude: 0.8e-6,
        mean_pressure: 0.0,
        effective_modulus: elastic::effective_modulus(&PAIR),
    };
    wave.mean_pressure = share * wave.full_contact_pressure();
    wave
}

#[test]
fn pressure_has_the_mean_it_should() {
    for share in [0.01, 0.3, 0.9, 1.0, 1.7] {
        let wave = wave(share);
        let a = wave.half_width();
        // The substitution x = a sin φ removes the root at the edge of the strip.
        let mean = integrate(-0.5 * PI, 0.5 * PI, 4, |phi| {
            wave.pressure(a * phi.sin()) * a * phi.cos()
        }) / wave.wavelength;
        assert!(
            (mean / wave.mean_pressure - 1.0).abs() < QUADRATURE,
            "{share}: {mean:e}"
        );
    }
}

#[test]
fn mean_gap_is_the_mean_of_the_gap() {
    for share in [0.0, 0.01, 0.3, 0.9] {
        let wave = wave(share);
        let (a, end) = (wave.half_width(), 0.5 * wave.wavelength);
        let mean = 2.0 / wave.wavelength
            * integrate(0.0, 1.0, 16, |t| {
                wave.gap(a + (end - a) * t * t) * 2.0 * t * (end - a)
            });
        assert!(
            (wave.mean_gap() - mean).abs() < QUADRATURE * wave.amplitude,
            "{share}: {mean:e}"
        );
    }
    assert_eq!(wave(1.0).mean_gap(), 0.0);
}

#[test]
fn pressure_opens_exactly_the_gap() {
    // The displacement of harmonic k is 2 p_k / (E* 2πk/λ). The gap is the undeformed gap plus u, with u = mean + undulation.
    for share in [0.2, 0.7] {
        let wave = wave(share);
        let (a, length) = (wave.half_width(), wave.wavelength);
        let harmonic = |k: f64| {
            2.0 / length
                * integrate(-0.5 * PI, 0.5 * PI, 120, |phi| {
                    let x = a * phi.sin();
                    wave.pressure(x) * (2.0 * PI * k * x / length).cos() * a * phi.cos()
                })
        };
        let amplitudes: Vec<f64> = (1..600).map(|k| harmonic(k as f64)).collect();
        for x in [0.0, 0.5 * a, 0.5 * (a + 0.5 * length), 0.5 * length] {
            let undulation: f64 = amplitudes
                .iter()
                .enumerate()
                .map(|(index, p)| {
                    let wavenumber = 2.0 * PI * (index + 1) as f64 / length;
                    2.0 * p / (wave.effective_modulus * wavenumber) * (wavenumber * x).cos()
                })
                .sum();
            let undeformed = -wave.amplitude * (2.0 * PI * x / length).cos();
            let gap = wave.mean_gap() + undeformed + undulation;
            // The edge is a square root: its harmonics fall like k^-3/2 in the pressure and k^-5/2 in the displacement. The error of 600 is
            // 1e-4.
            assert!(
                (gap - wave.gap(x)).abs() < 2e-4 * wave.amplitude,
                "{share}, x = {x:e}: {gap:e}, {:e}",
                wave.gap(x)
            );
        }
    }
}

#[test]
fn limits_are_no_contact_and_full_contact() {
    let (light, full) = (wave(1e-8), wave(1.0));
    assert!(light.area_fraction() < 1e-3);
    assert!((light.gap(0.5 * light.wavelength) / (2.0 * light.amplitude) - 1.0).abs() < 1e-6);
    assert_eq!(full.area_fraction(), 1.0);
    assert!(full.pressure(0.5 * full.wavelength).abs() < 1e-9 * full.mean_pressure);
    let nearly = wave(1.0 - 1e-12);
    assert!(
        (nearly.pressure(0.0) / full.pressure(0.0) - 1.0).abs() < 1e-9,
        "the branches must meet"
    );
}
