//! What the responses before foretell of the next.

use num_complex::Complex64;

use super::Start;
use super::krylov::norm;
use crate::linalg::add_scaled;

/// Highest order of the polynomial by which a response is foretold from those before.
const HIGHEST_ORDER: usize = 3;
/// Responses from which it is: those of the polynomial, and one that tells which order does best.
pub(super) const REMEMBERED: usize = HIGHEST_ORDER + 2;

/// Start at `place`, from responses that lie at `places` along a curve or a sweep, in their order: on the polynomial through the last
/// of them, of the order that would have foretold the last one best. None of fewer than two.
pub(super) fn extrapolated_start(responses: &[Start], places: &[f64], place: f64) -> Option<Start> {
    extrapolated(responses, places, order(responses, places)?, place)
}

/// Complex numbers at places, foretold as [`extrapolated_start`] does responses: the highest order of the polynomial is that of the numbers.
pub(super) fn extrapolated_number(
    numbers: &[Complex64],
    places: &[f64],
) -> Option<impl Fn(f64) -> Option<Complex64>> {
    let at = |numbers: &[Complex64], places: &[f64], order: usize, place: f64| {
        let first = numbers.len().checked_sub(order + 1)?;
        let weights = weights(&places[first..], place)?;
        let terms = numbers[first..].iter().zip(weights);
        Some(terms.map(|(number, weight)| number * weight).sum())
    };
    let (last, before) = numbers.split_last()?;
    let miss = |order: &usize| -> Option<f64> {
        let place = places[before.len()];
        let found: Complex64 = at(before, &places[..before.len()], *order, place)?;
        Some((found - last).norm())
    };
    let best = (1..=HIGHEST_ORDER)
        .filter_map(|order| Some((order, miss(&order)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let order = best.map_or(1, |(order, _)| order);
    let (numbers, places) = (numbers.to_vec(), places.to_vec());
    Some(move |place| at(&numbers, &places, order, place))
}

/// The order of the polynomial that would have foretold the last response best; none of fewer than two responses.
fn order(responses: &[Start], places: &[f64]) -> Option<usize> {
    let (last, before) = responses.split_last()?;
    let miss = |order: &usize| {
        let place = places[before.len()];
        let mut miss = extrapolated(before, &places[..before.len()], *order, place)?;
        add_scaled(&mut miss.displacement, -1.0, &last.displacement);
        Some(norm(&miss.displacement))
    };
    let best = (1..=HIGHEST_ORDER)
        .filter_map(|order| Some((order, miss(&order)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    let order = best.map_or(1, |(order, _)| order);
    (responses.len() > order).then_some(order)
}

/// Weights of values at `places` on the polynomial through all of them; none where two places are one.
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

/// On the polynomial of an order through the last responses; none of too few, or of two at one place.
fn extrapolated(responses: &[Start], places: &[f64], order: usize, place: f64) -> Option<Start> {
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
