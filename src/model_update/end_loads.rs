//! Normal laws of contact elements from the loads of the elements at both ends of a motion.
//!
//! At rest, an element has the normal stiffness of the fine contact under an equal approach of all cells. In a
//! vibration, one place closes while another opens, by a good part of the static approach. A rough contact becomes
//! stiffer as the contact closes. After each computed response, the model update solves the fine contact at both ends
//! of the motion. The displacements of the elements are prescribed at the nodes. Each element gets two secant
//! stiffnesses: the stiffness of all sliders for opening, and the stiffness of the closing sliders.

use super::ElementParameters;
use super::sliders::Sliders;

/// Bounds of a secant, relative to the stiffness at rest. In a twisting lap joint, the secant stiffness of one corner
/// element was seven times too large.
const SECANTS: [f64; 2] = [0.1, 10.0];
/// Smallest load variation of an element for new secants, as a fraction of the mean element load. Below this variation,
/// the element keeps its normal law, because the solver errors exceed the load variation.
const LEAST_VARIATION: f64 = 1e-3;
/// Number of bisections of the logarithm of a secant between the bounds [`SECANTS`]. The bisections reduce the interval
/// to 1e-6 of its length.
const HALVINGS: usize = 22;

/// Approach of the contact elements at both ends of a motion, and the load of the fine contact there.
#[derive(Debug, Clone, PartialEq)]
pub struct EndLoads {
    /// Approach of each element relative to rest, for both ends \[m\].
    pub approach: [Vec<f64>; 2],
    /// Load of the fine contact on each element, for both ends \[N\].
    pub load: [Vec<f64>; 2],
    /// Friction work of each element between the ends, under the loads at rest \[J\].
    pub energy: Vec<f64>,
}

impl EndLoads {
    /// Returns the difference between the element loads under `laws` and the loads that the fine contact puts on the
    /// elements. The difference of each element is relative to the element's load, and weighted by the element's share
    /// of the friction work. An element with a hundredth of the load may matter if the element slips far. The
    /// difference is relative to the total load for elements without load at rest, and for all elements if nothing
    /// slips. Returns the larger value of both ends; 0 without sliders.
    pub fn difference(&self, laws: &ElementParameters) -> f64 {
        let Some(sliders) = &laws.sliders else {
            return 0.0;
        };
        let total_load: f64 = laws.normal_load.iter().sum();
        let work: f64 = self.energy.iter().sum();
        let weight = |element: usize| match (work > 0.0, laws.normal_load[element]) {
            (true, load) if load > 0.0 => self.energy[element] / (work * load),
            _ => 1.0 / total_load.max(f64::MIN_POSITIVE),
        };
        let ends = self.approach.iter().zip(&self.load);
        let end_difference = |(approach, load): (&Vec<f64>, &Vec<f64>)| {
            let mut model_load = vec![0.0; load.len()];
            for slider in 0..sliders.element.len() {
                let element = sliders.element[slider];
                model_load[element] += slider_load(sliders, slider, [1.0; 2], approach[element]);
            }
            let error = model_load.iter().zip(load).map(|(b, l)| (b - l).abs());
            error
                .enumerate()
                .map(|(e, error)| weight(e) * error)
                .sum::<f64>()
        };
        ends.map(end_difference).fold(0.0, f64::max)
    }

    /// Returns elements with the normal stiffness for which they carry the loads of the fine contact. Loads at rest,
    /// tangential stiffness and strength at rest stay the same.
    pub fn laws(&self, laws: &ElementParameters) -> ElementParameters {
        let mut laws = laws.clone();
        let Some(mut sliders) = laws.sliders.take() else {
            return laws;
        };
        let loads = &laws.normal_load;
        let mean = loads.iter().sum::<f64>() / loads.len().max(1) as f64;
        let mut first = 0;
        for (element, load) in loads.iter().enumerate() {
            let own_sliders = sliders.element[first..].iter();
            let own_sliders = first..first + own_sliders.take_while(|e| **e == element).count();
            first = own_sliders.end;
            let end_state = |end: usize| [self.approach[end][element], self.load[end][element]];
            let ends = [end_state(0), end_state(1)];
            let variations = ends.iter().map(|[_, l]| (l - load).abs());
            if variations.fold(0.0, f64::max) <= LEAST_VARIATION * mean {
                continue;
            }
            match *load > 0.0 {
                true => {
                    let load_error = |factors: [f64; 2]| -> f64 {
                        let end_error = |[approach, load]: [f64; 2]| {
                            let own_sliders = own_sliders.clone();
                            let model_loads =
                                own_sliders.map(|s| slider_load(&sliders, s, factors, approach));
                            (model_loads.sum::<f64>() - load).abs()
                        };
                        ends.into_iter().map(end_error).sum()
                    };
                    let factors = secants(&sliders, own_sliders.clone(), ends);
                    if load_error(factors) >= load_error([1.0; 2]) {
                        continue;
                    }
                    laws.kn[element] *= factors[0];
                    for slider in own_sliders {
                        sliders.kn[slider] *= factors[0];
                        if sliders.normal_load[slider] == 0.0 {
                            sliders.kn[slider] *= factors[1];
                            sliders.gap[slider] /= factors[0];
                        }
                    }
                }
                false => {
                    own_sliders.for_each(|slider| fit_closing_slider(&mut sliders, slider, ends))
                }
            }
        }
        laws.sliders = Some(sliders);
        laws
    }
}

/// Returns the load of a slider at an approach \[N\]. The first factor scales every stiffness, the second in addition
/// the stiffness of sliders that close.
fn slider_load(
    sliders: &Sliders,
    slider: usize,
    [all_factor, closing_factor]: [f64; 2],
    approach: f64,
) -> f64 {
    let (load, kn) = (sliders.normal_load[slider], all_factor * sliders.kn[slider]);
    match load > 0.0 {
        true => (load + kn * approach).max(0.0),
        false => closing_factor * kn * (approach - sliders.gap[slider] / all_factor).max(0.0),
    }
}

/// Fits two stiffness factors, so that a loaded element carries the loads at both ends of the motion. `own_sliders`
/// lists the sliders of the element, and `ends` contains the approach and the load at each end. The end that opens more
/// determines the factor of the stiffness of all sliders. The end that closes more determines the factor of the
/// stiffness of the closing sliders.
fn secants(
    sliders: &Sliders,
    own_sliders: std::ops::Range<usize>,
    mut ends: [[f64; 2]; 2],
) -> [f64; 2] {
    if ends[0][0] > ends[1][0] {
        ends.swap(0, 1);
    }
    let [
        [opening_approach, opening_load],
        [closing_approach, closing_load],
    ] = ends;
    let model_load = |factors: [f64; 2], approach: f64| -> f64 {
        own_sliders
            .clone()
            .map(|s| slider_load(sliders, s, factors, approach))
            .sum()
    };
    // An element that only closes, or only opens, needs a single stiffness.
    let (approach, load) = if opening_approach < 0.0 {
        (opening_approach, opening_load)
    } else {
        (closing_approach, closing_load)
    };
    let all_factor =
        bisect(|factor| (model_load([factor, 1.0], approach) - load) * approach.signum());
    if opening_approach >= 0.0 || closing_approach <= 0.0 {
        return [all_factor, 1.0];
    }
    let unit_gain = model_load([all_factor, 1.0], closing_approach)
        - model_load([all_factor, 0.0], closing_approach);
    let required = closing_load - model_load([all_factor, 0.0], closing_approach);
    let closing_factor = match unit_gain > 0.0 {
        true => (required / unit_gain).clamp(0.0, SECANTS[1]),
        false => 1.0,
    };
    [all_factor, closing_factor]
}

/// Returns the factor within [`SECANTS`] at which a rising function is zero, or nearest to zero.
fn bisect(function: impl Fn(f64) -> f64) -> f64 {
    let [mut low, mut high] = SECANTS;
    for _ in 0..HALVINGS {
        let middle = (low * high).sqrt();
        match function(middle) > 0.0 {
            true => high = middle,
            false => low = middle,
        }
    }
    (low * high).sqrt()
}

/// Adjusts the slider of an element without load at rest. The adjusted slider closes at the same approach as the fine
/// contact.
fn fit_closing_slider(sliders: &mut Sliders, slider: usize, ends: [[f64; 2]; 2]) {
    let [_, [approach, load]] = match ends[0][0] > ends[1][0] {
        true => [ends[1], ends[0]],
        false => ends,
    };
    if load <= 0.0 {
        sliders.gap[slider] = sliders.gap[slider].max(approach);
    } else if approach > 0.0 && sliders.kn[slider] > 0.0 {
        sliders.gap[slider] = (approach - load / sliders.kn[slider]).max(0.0);
        sliders.kn[slider] = load / (approach - sliders.gap[slider]);
    }
}
