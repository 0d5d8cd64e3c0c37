//! Tests of sweeps, peaks and resonances where several responses exist.

use fretwear::dynamics::{
    BalanceSettings, ContactElement, ContinuationSettings, DynamicsError, FrictionLaw,
    HarmonicBalance, Oscillator, RangeResponse, Response, Vibration,
};

use super::continuation::collect;
use super::{balance, changed, one_slider, oscillator, samples, swept, vibration};

const TURN: f64 = 2.0 * std::f64::consts::PI;
/// Two solutions of the same equations, each to a relative correction of 1e-10.
const SAME: f64 = 1e-7;
/// Relative difference between a maximum and the highest point of a branch whose points are at most 1/20 apart.
const BETWEEN_POINTS: f64 = 5e-3;

/// 1 kg on a soft spring above a contact along the normal: preloaded by 10 N, or with a gap of 1 mm.
fn bouncing(is_pressed: bool) -> Oscillator {
    let pressed = one_slider(FrictionLaw::Cone, 0.3, 10.0, [1e4, 3e4]);
    Oscillator {
        mass: [1.0, 1.1, 1.0],
        damping: [4.0; 3],
        stiffness: [5e4; 3],
        element: match is_pressed {
            true => pressed,
            false => changed(&pressed, |slider| {
                (slider.normal_load, slider.gap) = (0.0, 1e-3);
            }),
        },
    }
}

fn along_the_normal(is_pressed: bool, force: f64) -> HarmonicBalance<ContactElement> {
    let load = Oscillator::load(2, force, 0.0);
    balance(&bouncing(is_pressed), 3, &[load], samples(256))
}

fn size(balance: &HarmonicBalance<ContactElement>, response: &Response) -> f64 {
    balance.amplitude(response, 2).expect("port 2").0
}

#[test]
fn sweeps_jump_at_the_folds() {
    let balance = along_the_normal(true, 6.0);
    let (from, to) = (TURN * 30.0, TURN * 60.0);
    let mut omegas: Vec<f64> = (0..61)
        .map(|k| from + (to - from) * k as f64 / 60.0)
        .collect();
    let up = swept(&balance, &omegas);
    omegas.reverse();
    let down = swept(&balance, &omegas);
    let branch = collect(&balance, ContinuationSettings::over(from, to, 2));
    // The branch passes each frequency several times. A sweep up follows its first pass, a sweep down its last pass.
    let between = |pair: &&[Response], omega: f64| {
        let (a, b) = (pair[0].omega, pair[1].omega);
        (a < omega) != (b < omega)
    };
    let near = |pair: &[Response], response: &Response| {
        let (a, b) = (size(&balance, &pair[0]), size(&balance, &pair[1]));
        let found = size(&balance, response);
        let room = 0.5 * (a - b).abs() + 1e-2 * a;
        found > a.min(b) - room && found < a.max(b) + room
    };
    let mut differ = 0;
    for (up, down) in up.iter().zip(down.iter().rev()).skip(1) {
        assert_eq!(up.omega.to_bits(), down.omega.to_bits());
        let (first, last) = (
            branch.windows(2).find(|p| between(p, up.omega)),
            branch.windows(2).rfind(|p| between(p, up.omega)),
        );
        assert!(
            first.is_none_or(|p| near(p, up)) && last.is_none_or(|p| near(p, down)),
            "{} Hz: up {}, down {}",
            up.frequency(),
            size(&balance, up),
            size(&balance, down)
        );
        let change = size(&balance, up) / size(&balance, down) - 1.0;
        if change.abs() > SAME {
            differ += 1;
        }
        assert!(up.energy.imbalance() < 1e-6 && down.energy.imbalance() < 1e-6);
    }
    let backwards = branch.windows(2).filter(|p| p[1].omega < p[0].omega);
    assert!(backwards.count() > 3 && differ < 10, "{differ}");
}

#[test]
fn peaks_of_overhanging_branches() {
    for (is_pressed, forces) in [(true, [1.0, 6.0, 15.0]), (false, [1.0, 4.0, 8.0])] {
        for force in forces {
            let balance = along_the_normal(is_pressed, force);
            let range = (TURN * 25.0, TURN * 60.0);
            let resonance = balance
                .phase_resonance(range, None)
                .unwrap_or_else(|error| panic!("{force} N: {error}"));
            let peak = balance
                .peak(2, range, &resonance.start())
                .unwrap_or_else(|error| panic!("{force} N: {error}"));
            let branch = collect(&balance, ContinuationSettings::over(range.0, range.1, 2));
            let top = branch.iter().map(|r| size(&balance, r)).fold(0.0, f64::max);
            let found = size(&balance, &peak);
            println!("{force} N, pressed {is_pressed}: {found:.6e}, of the branch {top:.6e}");
            assert!(
                (found / top - 1.0).abs() < BETWEEN_POINTS,
                "{force} N, pressed {is_pressed}: {found} {top}"
            );
            // Only the dashpot dissipates energy: the input of the force is at most π F |u|, and the dissipation is at least π c ω |u|².
            let bound = force / (4.0 * peak.omega);
            assert!(found < bound * (1.0 + 1e-2), "{found} {bound}");
        }
    }
}

#[test]
fn the_highest_of_several_peaks() {
    // The response along x peaks at its resonance, and again where the normal load varies most.
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.mass = [1.0; 3];
    oscillator.damping = [60.0; 3];
    oscillator.stiffness = [4e6; 3];
    oscillator.element = one_slider(FrictionLaw::Cone, 0.3, 1000.0, [6e6, 8e6]);
    let loads = vec![
        Oscillator::load(0, 200.0, 0.0),
        Oscillator::load(2, 3000.0, 0.5 * std::f64::consts::PI),
    ];
    let vibration = Vibration {
        settings: samples(256),
        points: Some(61),
        ..vibration(&oscillator, 5, loads, (TURN * 160.0, TURN * 750.0))
    };
    let found = vibration.resolve_over_range(vec![oscillator.element.clone()], None);
    let RangeResponse { resolved, points } = found.unwrap_or_else(|error| panic!("{error}"));
    let points = points.expect("a forced response");
    let responses = points.iter().filter_map(|p| p.response.as_ref());
    let top = responses.map(|r| r.amplitude).fold(0.0, f64::max);
    let peak = resolved.resonance.peak_amplitude;
    assert!(peak >= top * (1.0 - 2e-5), "{peak} {top}");
}

#[test]
fn a_resonance_that_nothing_bounds_is_none() {
    // Friction bounds a resonance up to 4/π of its limit, 68.75 N; without contact the resonance is unbounded.
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping = [0.0; 3];
    let range = (TURN * 600.0, TURN * 1200.0);
    for (friction, force) in [(0.6, 100.0), (0.0, 10.0)] {
        oscillator.element.friction_coefficient = friction;
        let load = Oscillator::load(0, force, 0.0);
        let balance = balance(&oscillator, 3, &[load], BalanceSettings::default());
        let error = balance.phase_resonance(range, None).expect_err("unbounded");
        assert!(
            matches!(
                error,
                DynamicsError::NoResonance { .. } | DynamicsError::ResonanceNotTracked { .. }
            ),
            "{friction}: {error}"
        );
    }
}

#[test]
fn a_branch_with_a_corner_has_all_frequencies() {
    // Stiff in the plane, box law: the branch ends in a corner where the normal load first reaches zero, at 118.29 Hz.
    let corner = Oscillator {
        mass: [2.513, 2.52, 1.788],
        damping: [38.401, 7.755, 11.796],
        stiffness: [268350.0, 120475.0, 375884.0],
        element: one_slider(FrictionLaw::Box, 0.31, 836.7, [3150302.0, 637879.0]),
    };
    let loads = [
        Oscillator::load(0, 7.99, (-3.0_f64).to_radians()),
        Oscillator::load(2, 36.01, (-158.0_f64).to_radians()),
        Oscillator::load(1, 18.96, (-82.0_f64).to_radians()),
    ];
    let range = (TURN * 31.21, TURN * 241.32);
    let followed = |count: usize| {
        let balance = balance(&corner, 5, &loads, samples(count));
        let branch = balance
            .branch(ContinuationSettings::over(range.0, range.1, 0))
            .unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(branch.first().map(|r| r.omega), Some(range.0));
        assert_eq!(branch.last().map(|r| r.omega), Some(range.1));
        (balance, branch)
    };
    // With few samples, the part of the branch from above turns back at a corner of its own sampling.
    followed(256);
    let (balance, branch) = followed(1024);
    let widest = branch
        .windows(2)
        .map(|p| p[1].omega - p[0].omega)
        .fold(0.0, f64::max);
    assert!(widest <= 0.06 * (range.1 - range.0), "{widest}");
    // Reference amplitudes along x, y and the normal by time integration (Newmark, 512 steps per cycle, 800 cycles), all harmonics.
    let near = branch
        .iter()
        .filter(|r| (r.frequency() - 119.0).abs() < 5.0 && size(&balance, r) > 1.4e-3)
        .min_by(|a, b| {
            let off = |r: &Response| (r.frequency() - 119.0).abs();
            off(a).total_cmp(&off(b))
        })
        .expect("the lifted branch");
    let there = balance
        .solve(TURN * 119.0, Some(&near.start()))
        .unwrap_or_else(|error| panic!("{error}"));
    for (port, expected) in [(0, 3.7652e-6), (1, 1.2840e-5), (2, 1.63204e-3)] {
        let found = balance.amplitude(&there, port).expect("a port").0;
        assert!(
            (found / expected - 1.0).abs() < 5e-3,
            "{port}: {found} {expected}"
        );
    }
}
