//! Backbone of a Jenkins oscillator, compared with the force over a cycle and with its limits.

use std::f64::consts::{PI, TAU};

use fretwear::reference::{Jenkins, JenkinsOscillator};

use super::QUADRATURE;

const OSCILLATOR: JenkinsOscillator = JenkinsOscillator {
    mass: 1.5,
    damping: 300.0,
    stiffness: 4.0e7,
    contact: Jenkins {
        stiffness: 2.5e7,
        limit: 54.0,
    },
};

/// Force components in phase with the displacement and with the velocity, integrated over one cycle.
/// The force is smooth between its corners: Gauss quadrature on four parts of each interval.
fn balance(amplitude: f64) -> [f64; 2] {
    let Jenkins { stiffness, limit } = OSCILLATOR.contact;
    let slip = OSCILLATOR.contact.slip_phase(amplitude);
    let mut sums = [0.0; 2];
    let corners = [0.0, slip, PI, PI + slip, TAU];
    let nodes = [
        -0.960_289_856_497_536_2,
        -0.796_666_477_413_626_7,
        -0.525_532_409_916_329,
        -0.183_434_642_495_649_8,
    ];
    let weights = [
        0.101_228_536_290_376_26,
        0.222_381_034_453_374_47,
        0.313_706_645_877_887_3,
        0.362_683_783_378_362,
    ];
    for pair in corners.windows(2) {
        for quarter in 0..4 {
            let width = (pair[1] - pair[0]) / 4.0;
            let middle = pair[0] + (f64::from(quarter) + 0.5) * width;
            for (node, weight) in nodes.iter().zip(weights) {
                for node in [*node, -node] {
                    let theta = middle + 0.5 * width * node;
                    let force = OSCILLATOR.contact.force(amplitude, theta);
                    assert!(force.abs() <= limit.max(stiffness * amplitude) * (1.0 + 1e-12));
                    sums[0] += 0.5 * width * weight * force * theta.cos() / PI;
                    sums[1] -= 0.5 * width * weight * force * theta.sin() / PI;
                }
            }
        }
    }
    sums
}

#[test]
fn it_balances_the_force_of_the_element_over_a_cycle() {
    for amplitude in [1e-6, 2.2e-6, 5e-6, 1e-4] {
        let [in_phase, behind] = balance(amplitude);
        let omega = OSCILLATOR.backbone(amplitude);
        let inertia = 1.5 * omega * omega;
        assert!((inertia / (4e7 + in_phase / amplitude) - 1.0).abs() < QUADRATURE);
        let force = 300.0 * omega * amplitude + behind;
        assert!((OSCILLATOR.resonant_force(amplitude) / force - 1.0).abs() < QUADRATURE);
        // Damping ratio: energy per cycle over 4π times the kinetic energy.
        let ratio = PI * force * amplitude / (4.0 * PI * 0.5 * inertia * amplitude * amplitude);
        assert!((OSCILLATOR.damping_ratio(amplitude) / ratio - 1.0).abs() < QUADRATURE);
    }
}

#[test]
fn stuck_it_is_linear_and_sliding_it_takes_four_over_pi_of_the_limit() {
    let stuck = (6.5e7_f64 / 1.5).sqrt();
    assert!((OSCILLATOR.backbone(1e-7) / stuck - 1.0).abs() < 1e-14);
    assert!((OSCILLATOR.damping_ratio(1e-7) / (300.0 / (3.0 * stuck)) - 1.0).abs() < 1e-14);
    let dry = JenkinsOscillator {
        damping: 0.0,
        ..OSCILLATOR
    };
    assert!((dry.resonant_force(1.0) / (4.0 / PI * 54.0) - 1.0).abs() < 1e-5);
    assert!((dry.backbone(1.0) / (4e7_f64 / 1.5).sqrt() - 1.0).abs() < 1e-5);
    // The loss per squared amplitude of a Jenkins element has its maximum at twice the displacement of first sliding.
    let largest =
        dry.contact.dissipated_energy(2.0 * 54.0 / 2.5e7) / (2.0 * 54.0 / 2.5e7_f64).powi(2);
    for amplitude in [1.8, 1.95, 2.05, 2.2] {
        let amplitude = amplitude * 54.0 / 2.5e7;
        assert!(dry.contact.dissipated_energy(amplitude) / (amplitude * amplitude) < largest);
    }
}
