//! What the responses before foretell of the next.

use super::krylov::norm;
use super::{Response, Start};
use crate::linalg::add_scaled;

/// Highest order of the polynomial by which a response is foretold from those before.
const HIGHEST_ORDER: usize = 3;
/// Responses from which it is: those of the polynomial, and one that tells which order does best.
pub(super) const REMEMBERED: usize = HIGHEST_ORDER + 2;

/// Start at `place`, from responses that lie at `places` along a curve or a sweep, in their order: on the polynomial through the last
/// of them, of the order that would have foretold the last one best. None of fewer than two.
pub(super) fn foretold(responses: &[&Response], places: &[f64], place: f64) -> Option<Start> {
    let (last, before) = responses.split_last()?;
    let miss = |order: &usize| {
        let mut miss = extrapolated(
            before,
            &places[..before.len()],
            *order,
            places[before.len()],
        )?;
        add_scaled(&mut miss.displacement, -1.0, &last.displacement);
        Some(norm(&miss.displacement))
    };
    let best = (1..=HIGHEST_ORDER)
        .filter_map(|order| Some((order, miss(&order)?)))
        .min_by(|a, b| a.1.total_cmp(&b.1));
    extrapolated(responses, places, best.map_or(1, |(order, _)| order), place)
}

/// On the polynomial of an order through the last responses; none of too few, or of two at one place.
fn extrapolated(
    responses: &[&Response],
    places: &[f64],
    order: usize,
    place: f64,
) -> Option<Start> {
    let first = responses.len().checked_sub(order + 1)?;
    let (responses, places) = (&responses[first..], &places[first..]);
    let mut sum = Start {
        omega: 0.0,
        load_factor: responses[order].load_factor,
        displacement: vec![0.0; responses[order].displacement.len()],
    };
    for (i, response) in responses.iter().enumerate() {
        let others = places.iter().enumerate().filter(|(j, _)| *j != i);
        let weight: f64 = others
            .map(|(_, other)| (place - other) / (places[i] - other))
            .product();
        if !weight.is_finite() {
            return None;
        }
        sum.omega += weight * response.omega;
        add_scaled(&mut sum.displacement, weight, &response.displacement);
    }
    Some(sum)
}
