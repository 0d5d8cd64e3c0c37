//! Tests of the normal law of contact elements from their loads at both ends of a motion.

use fretwear::model_update::{ElementParameters, EndLoads};

use super::sliders;

/// Bisection of a range of 9 to 1 ends within a millionth of its logarithm.
const SECANT: f64 = 2e-6;

/// Load, gap, kn and kt of the sliders of two loaded elements and one unloaded element.
const SLIDERS: [(usize, [f64; 4]); 6] = [
    (0, [30.0, 0.0, 2e7, 1e7]),
    (0, [70.0, 0.0, 1e7, 3e7]),
    (0, [0.0, 1.5e-6, 2e7, 1e7]),
    (1, [50.0, 0.0, 5e7, 4e7]),
    (1, [0.0, 1e-6, 5e7, 4e7]),
    (2, [0.0, 2e-6, 3e7, 2e7]),
];

fn laws() -> ElementParameters {
    ElementParameters {
        normal_load: vec![100.0, 50.0, 0.0],
        gap: vec![0.0, 0.0, 2e-6],
        kn: vec![3e7, 5e7, 0.0],
        kt: vec![4e7, 4e7, 0.0],
        sliders: Some(sliders(&SLIDERS)),
    }
}

/// Load of an element at an approach, by the law of a unilateral spring.
fn borne(laws: &ElementParameters, element: usize, approach: f64) -> f64 {
    let sliders = laws.sliders.as_ref().expect("sliders");
    (0..sliders.element.len())
        .filter(|&s| sliders.element[s] == element)
        .map(|s| (sliders.normal_load[s] + sliders.kn[s] * (approach - sliders.gap[s])).max(0.0))
        .sum()
}

/// From the loads of a law at both ends, the fit recovers this law, whatever its start.
#[test]
fn elements_get_the_stiffness_of_what_they_bear() {
    let begin = laws();
    let mut truth = laws();
    let sliders = truth.sliders.as_mut().expect("sliders");
    // All sliders of the first element are stiffer, and its closing slider less so. The second element is softer. The third closes later.
    for (s, factor, closing) in [
        (0, 1.6, 1.0),
        (1, 1.6, 1.0),
        (2, 1.6, 0.7),
        (3, 0.6, 1.0),
        (4, 0.6, 1.0),
    ] {
        sliders.kn[s] *= factor * closing;
        sliders.gap[s] /= factor;
    }
    sliders.gap[5] = 2.6e-6;
    let approach = [vec![3e-6, -0.7e-6, 3e-6], vec![-2e-6, 2.4e-6, -1e-6]];
    let load = approach
        .each_ref()
        .map(|end| (0..3).map(|e| borne(&truth, e, end[e])).collect());
    let ends = EndLoads {
        approach,
        load,
        energy: vec![0.0; 3],
    };
    assert!(ends.difference(&begin) > 0.1, "{}", ends.difference(&begin));
    let found = ends.laws(&begin);
    assert!(
        ends.difference(&found) < SECANT,
        "{}",
        ends.difference(&found)
    );
    let (found_sliders, expected) = (
        found.sliders.as_ref().expect("s"),
        truth.sliders.as_ref().expect("s"),
    );
    for s in 0..SLIDERS.len() {
        for (found, expected) in [
            (found_sliders.kn[s], expected.kn[s]),
            (found_sliders.gap[s], expected.gap[s]),
        ] {
            assert!(
                (found - expected).abs() <= 20.0 * SECANT * expected,
                "slider {s}: {found:e}, {expected:e}"
            );
        }
    }
    // The loads at rest, which determine the friction limit, do not change.
    assert_eq!(found.normal_load, begin.normal_load);
    assert_eq!(
        found_sliders.normal_load,
        begin.sliders.as_ref().expect("s").normal_load
    );
    assert_eq!(found_sliders.kt, begin.sliders.as_ref().expect("s").kt);
    // A second fit does not change the law.
    let again = ends.laws(&found);
    assert!(ends.difference(&again) <= ends.difference(&found));
}

/// If no stiffness explains the loads, for example because of the influence of neighbours, the fit does not increase the difference to the
/// loads. All parameters stay within their bounds.
#[test]
fn loads_that_no_stiffness_explains_make_no_law_worse() {
    let begin = laws();
    for (approach, load) in [
        // The element opens and carries more, closes and carries less, or does not move.
        ([-1e-6, 1e-6], [130.0, 60.0]),
        ([0.0, 0.0], [160.0, 20.0]),
        ([1e-9, -1e-9], [400.0, 0.0]),
        ([2e-6, 1e-6], [100.0, 300.0]),
        ([-2e-6, -1e-6], [0.0, 250.0]),
        ([1e-3, -1e-3], [1e6, 0.0]),
    ] {
        let of_all = |values: [f64; 2]| values.map(|v| vec![v; 3]);
        let ends = EndLoads {
            approach: of_all(approach),
            load: of_all(load),
            energy: vec![1e-3; 3],
        };
        let found = ends.laws(&begin);
        let off = |laws: &ElementParameters| -> f64 {
            let at = |end: usize, e: usize| (borne(laws, e, approach[end]) - load[end]).abs();
            (0..2).map(|e| at(0, e) + at(1, e)).sum()
        };
        assert!(off(&found) <= off(&begin), "{approach:?} {load:?}");
        let sliders = found.sliders.expect("sliders");
        for values in [&sliders.kn, &sliders.gap, &found.kn] {
            assert!(
                values.iter().all(|v| v.is_finite() && *v >= 0.0),
                "{values:?}"
            );
        }
    }
}

/// An element that slips far contributes with the difference of its load relative to its load, even if its share of the total load is
/// small. Without slip, all loads contribute.
#[test]
fn loads_count_by_the_work_of_friction() {
    let laws = laws();
    let at_rest = |e: usize| borne(&laws, e, 0.0);
    let all: f64 = (0..3).map(at_rest).sum();
    let ends = |energy: [f64; 3]| {
        let mut load: Vec<f64> = (0..3).map(at_rest).collect();
        load[1] *= 0.6;
        EndLoads {
            approach: [vec![0.0; 3], vec![0.0; 3]],
            load: [load.clone(), load],
            energy: energy.to_vec(),
        }
    };
    for (energy, expected) in [
        ([0.0, 1e-6, 0.0], 0.4),
        ([3e-6, 1e-6, 0.0], 0.1),
        ([3e-6, 0.0, 0.0], 0.0),
        ([0.0; 3], 0.4 * at_rest(1) / all),
    ] {
        let found = ends(energy).difference(&laws);
        assert!((found - expected).abs() < 1e-12, "{energy:?}: {found}");
    }
}
