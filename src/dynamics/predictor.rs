//! Extrapolation of the next response from the previous ones.

use num_complex::Complex64;

use super::Start;
use super::krylov::norm;
use crate::linalg::add_scaled;

/// Highest order of the extrapolating polynomial.
const HIGHEST_ORDER: usize = 3;
/// Number of responses used: the nodes of the polynomial, and one more to choose the order.
pub(super) const PREDICTOR_POINTS: usize = HIGHEST_ORDER + 2;

/// Extrapolates responses at `places` along a curve or a sweep to a start at `place`.
///
/// The polynomial goes through the last responses. The order of the polynomial is the order that would have predicted
/// the last response best. Returns `None` for fewer than two responses.
pub(super) fn extrapolated_start(responses: &[Start], places: &[f64], place: f64) -> Option<Start> {
    extrapolate(responses, places, order(responses, places)?, place)
}

/// Extrapolates complex numbers at places as [`extrapolated_start`] extrapolates responses. The numbers choose the
/// order of the polynomial.
pub(super) fn extrapolated_number(
    numbers: &[Complex64],
    places: &[f64],
) -> Option<impl Fn(f64) -> Option<Complex64>> {
    let evaluate = |numbers: &[Complex64], places: &[f64], order: usize, place: f64| {
        let first = numbers.len().checked_sub(order + 1)?;
        let weights = weights(&places[first..], place)?;
        let terms = numbers[first..].iter().zip(weights);
        Some(terms.map(|(number, weight)| number * weight).sum())
    };
    let (last, before) = numbers.split_last()?;
    let prediction_error = |order: &usize| -> Option<f64> {
        let place = places[before.len()];
        let predicted: Complex64 = evaluate(before, &places[..before.len()], *order, place)?;
        Some((predicted - last).norm())
    };
    let best = (1..=HIGHEST_ORDER)
        .filter_map(|order| Some((order, prediction_error(&order)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let order = best.map_or(1, |(order, _)| order);
    let (numbers, places) = (numbers.to_vec(), places.to_vec());
    Some(move |place| evaluate(&numbers, &places, order, place))
}

/// Returns the order of the polynomial that would have predicted the last response best, or `None` for fewer than two
/// responses.
fn order(responses: &[Start], places: &[f64]) -> Option<usize> {
    let (last, before) = responses.split_last()?;
    let prediction_error = |order: &usize| {
        let place = places[before.len()];
        let mut prediction_error = extrapolate(before, &places[..before.len()], *order, place)?;
        add_scaled(&mut prediction_error.displacement, -1.0, &last.displacement);
        Some(norm(&prediction_error.displacement))
    };
    let best = (1..=HIGHEST_ORDER)
        .filter_map(|order| Some((order, prediction_error(&order)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let order = best.map_or(1, |(order, _)| order);
    (responses.len() > order).then_some(order)
}

/// Returns the weights of values at `places` in the polynomial through all places, or `None` if two places are equal.
fn weights(places: &[f64], place: f64) -> Option<Vec<f64>> {
    let weight = |i: usize| {
        let others = places.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others
            .map(|(_, other)| (place - other) / (places[i] - other))
            .product();
        weight.is_finite().then_some(weight)
    };
    (0..places.len()).map(weight).collect()
}

/// Evaluates at `place` the polynomial of the degree `order` through the last responses. Returns `None` if `responses`
/// has fewer than `order + 1` responses, or if two responses have the same place.
fn extrapolate(responses: &[Start], places: &[f64], order: usize, place: f64) -> Option<Start> {
    let first = responses.len().checked_sub(order + 1)?;
    let (responses, places) = (&responses[first..], &places[first..]);
    let mut sum = Start {
        omega: 0.0,
        load_factor: responses[order].load_factor,
        displacement: vec![0.0; responses[order].displacement.len()],
    };
    for (response, weight) in responses.iter().zip(weights(places, place)?) {
        sum.omega += weight * response.omega;
        add_scaled(&mut sum.displacement, weight, &response.displacement);
    }
    Some(sum)
}
