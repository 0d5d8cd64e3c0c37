//! Tests of the stiffness of contact elements from the energy of a cycle, for sliders on a circle, whose energy has a closed form.

use std::f64::consts::TAU;

use fretwear::model_update::{ElementParameters, match_dissipation};

use super::sliders;

const FRICTION: f64 = 0.5;
/// Radius of the circle \[m\].
const RADIUS: f64 = 5e-6;
/// Twelve bisections of a range of 4 to 1 end within a factor of 4^(1/4096).
const FACTOR: f64 = 4e-4;
/// Tolerance of the sum: the error of the iteration is a thousandth, and the relative error of an energy is at most three times the error
/// of its factor in these cases.
const SUM: f64 = 2.5e-3;
/// Factors on the stiffness of the elements whose dissipation is requested.
const FACTORS: [f64; 3] = [1.4, 0.7, 1.0];
/// Load \[N\] and tangential stiffness \[N/m\] of the slider in each element. The last slider but one sticks on the circle, the last slides
/// at once.
const SLIDERS: [[f64; 2]; 5] = [
    [100.0, 2e7],
    [60.0, 1.5e7],
    [80.0, 1e7],
    [200.0, 1.9e7],
    [10.0, 1e8],
];

fn laws() -> ElementParameters {
    let of = SLIDERS.map(|[load, kt]| [load, 0.0, 3e7, kt]);
    let numbered: Vec<_> = of.into_iter().enumerate().collect();
    ElementParameters {
        normal_load: SLIDERS.map(|[load, _]| load).to_vec(),
        gap: vec![0.0; SLIDERS.len()],
        kn: vec![3e7; SLIDERS.len()],
        kt: SLIDERS.map(|[_, kt]| kt).to_vec(),
        sliders: Some(sliders(&numbered)),
    }
}

/// Dissipation of a slider on the circle \[J\]. The slider slips along its force, so its position moves on a circle to which the force is
/// tangent, and T²/k² + s² = R².
fn on_the_circle(load: f64, kt: f64) -> f64 {
    let limit = FRICTION * load;
    let slip = RADIUS * RADIUS - (limit / kt).powi(2);
    TAU * limit * slip.max(0.0).sqrt()
}

fn dissipated(parameters: &ElementParameters) -> Vec<f64> {
    let sliders = parameters.sliders.as_ref().expect("sliders");
    let pairs = sliders.normal_load.iter().zip(&sliders.kt);
    pairs.map(|(load, kt)| on_the_circle(*load, *kt)).collect()
}

/// Factors on the stiffness from the fit, by element.
fn factors(found: &ElementParameters) -> Vec<f64> {
    let begin = laws();
    let pairs = found.kt.iter().zip(&begin.kt);
    pairs.map(|(found, begin)| found / begin).collect()
}

#[test]
fn elements_get_the_stiffness_that_dissipates_what_is_asked() {
    let begin = laws();
    let mut asked = dissipated(&begin);
    for (element, factor) in FACTORS.into_iter().enumerate() {
        let [load, kt] = SLIDERS[element];
        asked[element] = on_the_circle(load, factor * kt);
    }
    assert_eq!(asked[3], 0.0, "it sticks");
    let found = match_dissipation(&asked, &begin, dissipated);
    let factors = factors(&found);
    for (element, expected) in FACTORS.into_iter().chain([1.0]).enumerate() {
        let factor = factors[element];
        assert!(
            (factor / expected - 1.0).abs() <= FACTOR,
            "element {element}: {factor} for {expected}"
        );
    }
    // Strengths, loads and normal stiffnesses do not change.
    let [of_found, of_begin] = [&found, &begin].map(|laws| laws.sliders.as_ref().expect("sliders"));
    assert_eq!(of_found.kt, found.kt);
    assert_eq!(of_found.normal_load, of_begin.normal_load);
    assert_eq!(of_found.kn, of_begin.kn);
    assert_eq!(found.kn, begin.kn);
}

/// The dissipation of an element that slides all the way does not depend on its stiffness: the other elements dissipate the remainder, in
/// proportion.
#[test]
fn what_an_element_cannot_dissipate_the_others_do() {
    let begin = laws();
    let mut asked = dissipated(&begin);
    asked[4] *= 2.0;
    let found = match_dissipation(&asked, &begin, dissipated);
    let energies = dissipated(&found);
    let [of_all, expected] = [&energies, &asked].map(|of| of.iter().sum::<f64>());
    assert!(
        (of_all / expected - 1.0).abs() <= SUM,
        "{of_all:e} {expected:e}"
    );
    let more: Vec<f64> = (0..3).map(|e| energies[e] / asked[e]).collect();
    assert!(more[0] > 1.0, "{more:?}");
    for other in &more[1..] {
        assert!((other / more[0] - 1.0).abs() <= SUM, "{more:?}");
    }
    assert_eq!(factors(&found)[3], 1.0, "it sticks");
}
