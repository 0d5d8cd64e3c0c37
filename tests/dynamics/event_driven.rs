//! Forces by the instants at which a slider changes its state, against samples so many that their error is known.

use std::f64::consts::TAU;

use fretwear::dynamics::{ContactElement, FrictionLaw, Harmonics, Sampling};
use proptest::prelude::*;

use super::{changed, element};

/// Harmonics of the motions.
const HIGHEST: u32 = 3;
const WIDTH: usize = 2 * HIGHEST as usize + 1;
/// Samples whose forces are right to about (2π k / samples)², k up to the order of the force's corners.
const SAMPLES: usize = 4096;
/// Largest difference to them, relative to the largest force: a grazing contact has corners within a sample.
const SAMPLED: f64 = 1e-4;
/// Largest difference of a Jacobian to central differences, relative to its largest entry.
const DIFFERENCES: f64 = 2e-5;

fn by_events() -> Sampling {
    let sampling = Sampling::new(Harmonics::up_to(HIGHEST), 32).expect("enough samples");
    sampling.with_events()
}

fn force(sampling: &Sampling, element: &ContactElement, at: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let (mut force, mut jacobian) = (vec![0.0; at.len()], vec![0.0; at.len() * at.len()]);
    let mut work = sampling.workspace();
    sampling.evaluate(element, at, &mut force, Some(&mut jacobian), &mut work);
    (force, jacobian)
}

fn size(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |most, value| most.max(value.abs()))
}

fn apart(a: &[f64], b: &[f64]) -> f64 {
    a.iter()
        .zip(b)
        .fold(0.0, |most, (a, b)| most.max((a - b).abs()))
}

/// Elements preloaded, without load, with a gap, and a bank.
fn elements(law: FrictionLaw) -> [ContactElement; 4] {
    let loaded = element(law);
    let unloaded = changed(&loaded, |slider| slider.normal_load = 0.0);
    let open = changed(&unloaded, |slider| slider.gap = 6e-7);
    let mut bank = loaded.clone();
    let mut second = bank.sliders[0];
    (second.normal_load, second.tangential_stiffness) = (25.0, 4e7);
    bank.sliders.push(second);
    [loaded, unloaded, open, bank]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn force_is_that_of_many_samples(
        shape in prop::collection::vec(-1.0f64..1.0, 3 * WIDTH),
        size_of in -7.0f64..-5.0,
        kind in 0usize..4,
        lines in any::<bool>(),
    ) {
        let law = if lines { FrictionLaw::Cone } else { FrictionLaw::Box };
        let mut at: Vec<f64> = shape.iter().map(|v| v * 10f64.powf(size_of)).collect();
        if lines {
            at[WIDTH..2 * WIDTH].fill(0.0);
        }
        let element = &elements(law)[kind];
        let exact = by_events();
        let fine = Sampling::new(Harmonics::up_to(HIGHEST), SAMPLES).expect("enough samples");
        let (by_events, jacobian) = force(&exact, element, &at);
        let (sampled, _) = force(&fine, element, &at);
        let scale = size(&sampled).max(1e-3 * element.normal_load());
        prop_assert!(
            apart(&by_events, &sampled) <= SAMPLED * scale,
            "{:?} against {:?}", by_events, sampled
        );
        // Friction takes energy.
        let harmonics = Harmonics::up_to(HIGHEST);
        let work = harmonics.work(&by_events[..2 * WIDTH], &at[..2 * WIDTH]);
        prop_assert!(work >= -1e-13 * scale * size(&at), "{work:e}");
        // The derivative of what it is.
        let step = 1e-6 * size(&at);
        let largest = size(&jacobian);
        for column in 0..at.len() {
            if lines && (WIDTH..2 * WIDTH).contains(&column) {
                continue;
            }
            let shifted = |sign: f64| {
                let mut there = at.clone();
                there[column] += sign * step;
                force(&exact, element, &there).0
            };
            let (above, below, here) = (shifted(1.0), shifted(-1.0), &by_events);
            for row in 0..at.len() {
                let exact = jacobian[row * at.len() + column];
                let [left, right] = [
                    (here[row] - below[row]) / step,
                    (above[row] - here[row]) / step,
                ];
                // Where a grazing contact begins or ends within the step, the two sides differ.
                let kink = (right - left).abs();
                let difference = 0.5 * (left + right);
                prop_assert!(
                    (difference - exact).abs() <= DIFFERENCES * largest + 2.0 * kink,
                    "entry ({row}, {column}): {exact:e} against {difference:e}, of {largest:e}"
                );
            }
        }
    }
}

/// Contact for less than a sample: samples miss it, and give a force that does work.
#[test]
fn grazing_contact_is_not_missed() {
    let graze = changed(&element(FrictionLaw::Cone), |slider| {
        slider.normal_load = 0.0
    });
    let n = Harmonics::up_to(HIGHEST).coefficients();
    let mut at = vec![0.0; 3 * n];
    // It slides to and fro, and is pressed for a hundredth of the cycle.
    at[1] = 1e-6;
    let (depth, contact) = (1e-7, 0.01 * TAU / 2.0);
    at[2 * n] = -depth * f64::cos(contact);
    at[2 * n + 2] = depth;
    let (by_events, _) = force(&by_events(), &graze, &at);
    // Load at its middle, where the slider moves at the full speed: it slips throughout and brakes.
    let kn = graze.sliders[0].normal_stiffness;
    let load = |c: f64| kn * depth * (f64::sin(c) - c * f64::cos(c)) / (TAU / 2.0);
    let mean = load(contact);
    assert!((by_events[2 * n] - mean).abs() < 1e-12 * mean.max(1.0) + 1e-9 * mean);
    let harmonics = Harmonics::up_to(HIGHEST);
    let work = harmonics.work(&by_events[..n], &at[..n]);
    assert!(work > 0.0, "{work:e}");
    let few = Sampling::new(harmonics, 64).expect("enough samples");
    let (sampled, _) = force(&few, &graze, &at);
    assert!(
        (sampled[2 * n] / mean - 1.0).abs() > 0.05,
        "64 samples resolve it: {sampled:?}"
    );
}
