//! Tests of banks of parallel sliders: a bank of equal parts equals one slider, and its loops follow from its backbone by Masing's rule.

use std::f64::consts::TAU;

use fretwear::dynamics::aft::Workspace;
use fretwear::dynamics::{
    BalanceSettings, ContactElement, ElementState, FrictionLaw, Harmonics, Sampling, Slider,
};
use proptest::prelude::*;

use super::condensation::{Joint, active_elements_are_enough};
use super::element::motion;
use super::{BOTH, balance, changed, drive, element, oscillator};

/// Relative excess of a force over its limit that is attributed to rounding.
const ROUNDING: f64 = 1e-12;

/// Bank of `count` sliders with the stiffness and strength of an element. The first slider yields at 0.03 of the displacement at which the
/// last one yields, and the last one yields at three times the displacement of the element. Normal stiffness is proportional to load.
pub fn bank(one: &ContactElement, count: usize) -> ContactElement {
    let (kt, load) = (one.tangential_stiffness(), one.normal_load());
    let strength = one.friction_coefficient * load;
    let last = 3.0 * strength / kt;
    let levels: Vec<f64> = (0..count)
        .map(|k| 0.03_f64.powf(1.0 - k as f64 / (count - 1) as f64))
        .collect();
    // Stiffness decreases with a power of the level; the power is chosen to give the strength.
    let stiffness = |power: f64| -> Vec<f64> {
        let weights: Vec<f64> = levels.iter().map(|level| level.powf(-power)).collect();
        let sum: f64 = weights.iter().sum();
        weights.iter().map(|weight| kt * weight / sum).collect()
    };
    let total = |power: f64| -> f64 {
        let pairs = stiffness(power).into_iter().zip(&levels);
        pairs.map(|(kt, level)| kt * level * last).sum()
    };
    let (mut low, mut high) = (-3.0, 5.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if total(middle) > strength {
            low = middle;
        } else {
            high = middle;
        }
    }
    let pairs = stiffness(low).into_iter().zip(&levels);
    let sliders = pairs.map(|(tangential_stiffness, level)| {
        let share = tangential_stiffness * level * last / strength;
        Slider {
            normal_load: share * load,
            gap: 0.0,
            tangential_stiffness,
            normal_stiffness: share * one.normal_stiffness(),
        }
    });
    ContactElement {
        springs: Vec::new(),
        sliders: sliders.collect(),
        ..one.clone()
    }
}

/// Random bank of loaded sliders and of some sliders with gaps, µ 0.6.
fn drawn() -> impl Strategy<Value = ContactElement> {
    let slider = (
        5.0..60.0_f64,
        0.0..2e-6_f64,
        1e6..2e7_f64,
        1e6..2e7_f64,
        0..4,
    );
    let sliders = prop::collection::vec(slider, 1..7);
    (sliders, prop::bool::ANY).prop_map(|(sliders, is_cone)| ContactElement {
        springs: Vec::new(),
        area: 1e-6,
        friction_coefficient: 0.6,
        law: BOTH[usize::from(is_cone)],
        sliders: sliders
            .into_iter()
            .map(|(load, gap, kt, kn, kind)| Slider {
                normal_load: if kind == 0 { 0.0 } else { load },
                gap: if kind == 0 { gap } else { 0.0 },
                tangential_stiffness: kt,
                normal_stiffness: kn,
            })
            .collect(),
    })
}

/// Coefficients of a random motion with harmonics 0 to 3.
fn drawn_motion() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0_f64, 21).prop_flat_map(|shape| {
        (-7.0..-5.0_f64).prop_map(move |size| {
            let size = 10_f64.powf(size);
            shape.iter().map(|value| size * value).collect()
        })
    })
}

fn sampling(samples: usize) -> Sampling {
    Sampling::new(Harmonics::up_to(3), samples).expect("enough samples")
}

fn evaluate(
    element: &ContactElement,
    at: &[f64],
    sampling: &Sampling,
    work: &mut Workspace,
) -> (Vec<f64>, Vec<f64>) {
    let (mut force, mut jacobian) = (vec![0.0; 21], vec![0.0; 441]);
    sampling.evaluate(element, at, &mut force, Some(&mut jacobian), work);
    (force, jacobian)
}

#[test]
fn equal_parts_are_the_whole() {
    let sampling = sampling(64);
    let mut work = sampling.workspace();
    for law in BOTH {
        let one = element(law);
        let mut parts = changed(&one, |slider| {
            slider.normal_load /= 4.0;
            slider.tangential_stiffness /= 4.0;
            slider.normal_stiffness /= 4.0;
        });
        parts.sliders = vec![parts.sliders[0]; 4];
        for size in [2e-7, 1e-6, 2.3e-6, 6e-6] {
            let (force, jacobian) = evaluate(&one, &motion(size), &sampling, &mut work);
            let (sum, slopes) = evaluate(&parts, &motion(size), &sampling, &mut work);
            for (a, b) in [(force, sum), (jacobian, slopes)] {
                let largest = a.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
                for (a, b) in a.iter().zip(&b) {
                    assert!((a - b).abs() < ROUNDING * largest, "{size}: {a} {b}");
                }
            }
            let displacement = sampling.synthesise(&motion(size));
            let (a, b) = (one.cycle(&displacement), parts.cycle(&displacement));
            assert_eq!(a.state, b.state);
            assert!((a.slip_path - b.slip_path).abs() <= 1e-12 * a.slip_path);
            let difference = (a.dissipated_energy - b.dissipated_energy).abs();
            assert!(difference <= 1e-12 * a.dissipated_energy);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Each slider dissipates the work T·Δw of its slip and never returns energy. Its force stays within the friction limit of its load,
    /// also over a whole cycle of the closed path.
    #[test]
    fn friction_only_takes(element in drawn(), motion in drawn_motion()) {
        let displacement = sampling(96).synthesise(&motion);
        let cycle = element.cycle(&displacement);
        prop_assert!(cycle.dissipated_energy >= 0.0);
        for [x, y, n] in &cycle.force {
            let limit = 0.6 * n * (1.0 + ROUNDING);
            let size = match element.law {
                FrictionLaw::Cone => x.hypot(*y),
                FrictionLaw::Box => x.abs().max(y.abs()),
            };
            prop_assert!(size <= limit + 1e-12, "{} {}", size, limit);
        }
        // Energy, state and force from the sliders, each evaluated as an element with one slider.
        let (mut energy, mut worst) = (0.0, ElementState::Stick);
        let mut force = vec![[0.0; 3]; displacement.len()];
        for slider in &element.sliders {
            let alone = ContactElement { sliders: vec![*slider], ..element.clone() }.cycle(&displacement);
            energy += alone.dissipated_energy;
            worst = worst.max(alone.state);
            for (sum, own) in force.iter_mut().zip(&alone.force) {
                (0..3).for_each(|d| sum[d] += own[d]);
            }
        }
        prop_assert!((energy - cycle.dissipated_energy).abs() <= 1e-9 * energy);
        prop_assert!(cycle.state <= worst.max(ElementState::Slip));
        for (a, b) in force.iter().zip(&cycle.force) {
            for d in 0..3 {
                prop_assert!((a[d] - b[d]).abs() <= 1e-9 * (1.0 + a[d].abs()));
            }
        }
    }

    /// At constant load, the work of the forces over a closed cycle is positive except for the quadrature error and equals the dissipation
    /// of the sliders. A varying load would exchange work with friction.
    #[test]
    fn work_of_closed_paths(element in drawn(), motion in drawn_motion()) {
        let mut motion = motion;
        motion[14..].fill(0.0);
        let sampling = sampling(512);
        let displacement = sampling.synthesise(&motion);
        let cycle = element.cycle(&displacement);
        let work: f64 = (0..512)
            .map(|j| {
                let (now, before) = (j, (j + 511) % 512);
                (0..2)
                    .map(|d| {
                        let mean = 0.5 * (cycle.force[now][d] + cycle.force[before][d]);
                        mean * (displacement[now][d] - displacement[before][d])
                    })
                    .sum::<f64>()
            })
            .sum();
        let size: f64 = element.tangential_stiffness() * motion.iter().map(|v| v * v).sum::<f64>();
        prop_assert!(work >= -1e-9 * size, "{work} of {size}");
        prop_assert!((work - cycle.dissipated_energy).abs() <= 2e-2 * cycle.dissipated_energy + 1e-9 * size);
    }
}

#[test]
fn branches_are_twice_the_backbone() {
    let samples = 2048;
    let sampling = sampling(samples);
    for law in BOTH {
        let element = bank(&element(law), 8);
        let mu = element.friction_coefficient;
        // Force of the first loading from rest.
        let backbone = |u: f64| -> f64 {
            let force = |s: &Slider| (s.tangential_stiffness * u).min(mu * s.normal_load);
            element.sliders.iter().map(force).sum()
        };
        let last = 3.0 * mu * 90.0 / 2.5e7;
        for axis in [0, 1] {
            for amplitude in [0.02, 0.1, 0.3, 0.8, 1.3, 20.0].map(|share| share * last) {
                let mut motion = vec![0.0; 21];
                motion[7 * axis + 1] = amplitude;
                let displacement = sampling.synthesise(&motion);
                let cycle = element.cycle(&displacement);
                let top = backbone(amplitude);
                for (j, force) in cycle.force.iter().enumerate() {
                    // Branches from the turning points at cos θ = ±1.
                    let u = amplitude * (TAU * j as f64 / samples as f64).cos();
                    let expected = match 2 * j < samples {
                        true => top - 2.0 * backbone(0.5 * (amplitude - u)),
                        false => -top + 2.0 * backbone(0.5 * (amplitude + u)),
                    };
                    assert!((force[axis] - expected).abs() < 1e-9, "{j}: {expected}");
                }
                // A slider dissipates 4 R (U − u_j) beyond its level u_j = R/k.
                let energy: f64 = element
                    .sliders
                    .iter()
                    .map(|s| {
                        let level = mu * s.normal_load / s.tangential_stiffness;
                        4.0 * mu * s.normal_load * (amplitude - level).max(0.0)
                    })
                    .sum();
                let found = cycle.dissipated_energy;
                assert!(
                    (found - energy).abs() <= 1e-15 + 1e-9 * energy,
                    "{found:e} {energy:e}"
                );
                let expected = match amplitude / last {
                    share if share < 0.03 => ElementState::Stick,
                    share if share < 1.0 => ElementState::Partial,
                    _ => ElementState::Slip,
                };
                assert_eq!(cycle.state, expected, "{}", amplitude / last);
            }
        }
    }
}

/// Sliders open one after the other; the element is open only when its last slider is open.
#[test]
fn states_of_sliders_that_open() {
    let sampling = sampling(64);
    let one = element(FrictionLaw::Cone);
    let mut element = bank(&one, 8);
    // The first two sliders have no load and a gap that the motion does not close.
    for slider in &mut element.sliders[..2] {
        (slider.normal_load, slider.gap) = (0.0, 1e-3);
    }
    let state = |x: f64, n: f64| {
        let mut motion = vec![0.0; 21];
        (motion[1], motion[15]) = (x, n);
        element.cycle(&sampling.synthesise(&motion)).state
    };
    assert_eq!(state(1e-9, 1e-9), ElementState::Stick);
    assert_eq!(state(1e-6, 1e-9), ElementState::Partial);
    assert_eq!(state(4e-4, 1e-9), ElementState::Slip);
    // All sliders lift off at N₀/k_n = 2.57 µm.
    assert_eq!(state(1e-9, 3e-6), ElementState::Open);
    for slider in &mut element.sliders[2..5] {
        slider.normal_stiffness *= 10.0;
    }
    let mut motion = vec![0.0; 21];
    (motion[1], motion[15]) = (1e-9, 5e-7);
    let cycle = element.cycle(&sampling.synthesise(&motion));
    assert_eq!(cycle.state, ElementState::Partial);
    assert!(cycle.force.iter().all(|f| f[2] > 0.0));
}

/// When the element opens, its friction loses all history of the preload. So the result does not depend on the sample at which the cycle
/// begins, even if the element is open at this sample.
#[test]
fn a_cycle_that_opens_does_not_know_where_it_begins() {
    const SAMPLES: usize = 64;
    let sampling = sampling(SAMPLES);
    for law in BOTH {
        let one = element(law);
        for element in [bank(&one, 8), one] {
            let mut motion = vec![0.0; 21];
            (motion[1], motion[2], motion[15]) = (2e-6, 3e-6, -3e-6);
            let here = element.cycle(&sampling.synthesise(&motion));
            assert_eq!(here.state, ElementState::Open);
            motion.iter_mut().for_each(|u| *u = -*u);
            let half_later = element.cycle(&sampling.synthesise(&motion));
            let most = here.force.iter().map(|f| f[0].abs()).fold(0.0, f64::max);
            assert!(most > 0.0);
            for (j, force) in here.force.iter().enumerate() {
                let same = half_later.force[(j + SAMPLES / 2) % SAMPLES];
                for d in 0..3 {
                    let apart = (force[d] - same[d]).abs();
                    assert!(apart <= 1e-9 * most, "{law:?}, {j}: {force:?} and {same:?}");
                }
            }
        }
    }
}

/// A bank slips from the smallest force on: its resonance frequency decreases monotonically with the force.
#[test]
fn a_bank_softens_from_the_start() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.element = bank(&oscillator.element, 8);
    let ratios = [2.0, 8.0, 30.0, 90.0].map(|force| {
        let balance = balance(&oscillator, 3, &drive(force), BalanceSettings::default());
        let response = balance.phase_resonance((3000.0, 8000.0), None);
        let response = response.unwrap_or_else(|e| panic!("{force} N: {e}"));
        assert!(response.energy.imbalance() < 1e-6);
        response.omega
    });
    assert!(
        ratios.windows(2).all(|pair| pair[1] < pair[0]),
        "{ratios:?}"
    );
}

#[test]
fn active_elements_alone_give_what_all_give() {
    for law in BOTH {
        let mut joint = Joint::new(7, 5, law, 0.003);
        joint.elements.iter_mut().for_each(|e| *e = bank(e, 8));
        active_elements_are_enough(&joint, &[2.0, 20.0, 90.0, 400.0]);
    }
}
