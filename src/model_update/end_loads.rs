//! The normal law of contact elements from the loads that they have at both ends of a motion.
//!
//! At rest an element has the normal stiffness that the fine contact has there if all cells come closer alike. In a vibration one place
//! comes closer while the next one opens, by a good part of what the static load pressed them together, and a rough contact gets stiffer
//! as it closes. So, once a response is found, the fine contact is displaced at its nodes as the elements are at both ends of the motion,
//! and each element gets the secants: one stiffness where it opens, and beyond that the stiffness of sliders that close.

use super::ElementParameters;
use super::sliders::Sliders;

/// Bounds of a secant over the stiffness at rest. In a lap that twists, a corner was seven times too stiff by it.
const SECANTS: [f64; 2] = [0.1, 10.0];
/// Elements whose load varies by less than this part of the mean load of an element keep their law: a difference of two solves tells
/// nothing of it.
const LEAST_VARIATION: f64 = 1e-3;
/// Halvings of the logarithm of [`SECANTS`]: to 1e-6 of it.
const HALVINGS: usize = 22;

/// How close contact elements come at both ends of a motion, and what the fine contact bears there.
#[derive(Debug, Clone, PartialEq)]
pub struct EndLoads {
    /// By how much each element is closer than at rest, for both ends \[m\].
    pub approach: [Vec<f64>; 2],
    /// Load of the fine contact at each element, for both ends \[N\].
    pub load: [Vec<f64>; 2],
    /// The work of friction of each element between the ends, under the loads at rest \[J\].
    pub energy: Vec<f64>,
}

impl EndLoads {
    /// What elements of these `laws` bear differently, each in parts of its load and by its part in the work of friction: a place that slips far
    /// may decide with a hundredth of all load. Elements without load at rest count in parts of all load, and so does each where nothing slips.
    /// That of the end where it is more; 0 without sliders.
    pub fn difference(&self, laws: &ElementParameters) -> f64 {
        let Some(sliders) = &laws.sliders else {
            return 0.0;
        };
        let all: f64 = laws.normal_load.iter().sum();
        let work: f64 = self.energy.iter().sum();
        let weight = |element: usize| match (work > 0.0, laws.normal_load[element]) {
            (true, load) if load > 0.0 => self.energy[element] / (work * load),
            _ => 1.0 / all.max(f64::MIN_POSITIVE),
        };
        let ends = self.approach.iter().zip(&self.load);
        let of_end = |(approach, load): (&Vec<f64>, &Vec<f64>)| {
            let mut borne = vec![0.0; load.len()];
            for slider in 0..sliders.element.len() {
                let element = sliders.element[slider];
                borne[element] += borne_by(sliders, slider, [1.0; 2], approach[element]);
            }
            let off = borne.iter().zip(load).map(|(b, l)| (b - l).abs());
            off.enumerate().map(|(e, off)| weight(e) * off).sum::<f64>()
        };
        ends.map(of_end).fold(0.0, f64::max)
    }

    /// Elements of these `laws` with the normal stiffness by which they bear what the fine contact does. Loads at rest, tangential
    /// stiffness and strength at rest remain.
    pub fn laws(&self, laws: &ElementParameters) -> ElementParameters {
        let mut laws = laws.clone();
        let Some(mut sliders) = laws.sliders.take() else {
            return laws;
        };
        let loads = &laws.normal_load;
        let mean = loads.iter().sum::<f64>() / loads.len().max(1) as f64;
        let mut first = 0;
        for (element, load) in loads.iter().enumerate() {
            let own = sliders.element[first..].iter();
            let own = first..first + own.take_while(|e| **e == element).count();
            first = own.end;
            let at = |end: usize| [self.approach[end][element], self.load[end][element]];
            let ends = [at(0), at(1)];
            let varies = ends.iter().map(|[_, l]| (l - load).abs());
            if varies.fold(0.0, f64::max) <= LEAST_VARIATION * mean {
                continue;
            }
            match *load > 0.0 {
                true => {
                    let off = |factors: [f64; 2]| -> f64 {
                        let of_end = |[approach, load]: [f64; 2]| {
                            let own = own.clone();
                            let borne = own.map(|s| borne_by(&sliders, s, factors, approach));
                            (borne.sum::<f64>() - load).abs()
                        };
                        ends.into_iter().map(of_end).sum()
                    };
                    let factors = secants(&sliders, own.clone(), ends);
                    if off(factors) >= off([1.0; 2]) {
                        continue;
                    }
                    laws.kn[element] *= factors[0];
                    for slider in own {
                        sliders.kn[slider] *= factors[0];
                        if sliders.normal_load[slider] == 0.0 {
                            sliders.kn[slider] *= factors[1];
                            sliders.gap[slider] /= factors[0];
                        }
                    }
                }
                false => own.for_each(|slider| closing(&mut sliders, slider, ends)),
            }
        }
        laws.sliders = Some(sliders);
        laws
    }
}

/// Load of a slider at this approach \[N\], its stiffness multiplied by the first of the factors, and that of one that closes by both.
fn borne_by(sliders: &Sliders, slider: usize, [all, closing]: [f64; 2], approach: f64) -> f64 {
    let (load, kn) = (sliders.normal_load[slider], all * sliders.kn[slider]);
    match load > 0.0 {
        true => (load + kn * approach).max(0.0),
        false => closing * kn * (approach - sliders.gap[slider] / all).max(0.0),
    }
}

/// The factors by which a loaded element with the sliders `own` bears what is asked at these `ends`, each an approach and a load: that of
/// all normal stiffness by the end that opens more, and that of its closing sliders by the end that closes more.
fn secants(sliders: &Sliders, own: std::ops::Range<usize>, mut ends: [[f64; 2]; 2]) -> [f64; 2] {
    if ends[0][0] > ends[1][0] {
        ends.swap(0, 1);
    }
    let [[opens, less], [closes, more]] = ends;
    let borne = |factors: [f64; 2], approach: f64| -> f64 {
        own.clone()
            .map(|s| borne_by(sliders, s, factors, approach))
            .sum()
    };
    // Of an element that only closes, or only opens, both ends ask the same of one stiffness.
    let (approach, load) = if opens < 0.0 {
        (opens, less)
    } else {
        (closes, more)
    };
    let all = bisected(|factor| (borne([factor, 1.0], approach) - load) * approach.signum());
    if opens >= 0.0 || closes <= 0.0 {
        return [all, 1.0];
    }
    let gained = borne([all, 1.0], closes) - borne([all, 0.0], closes);
    let asked = more - borne([all, 0.0], closes);
    let closing = match gained > 0.0 {
        true => (asked / gained).clamp(0.0, SECANTS[1]),
        false => 1.0,
    };
    [all, closing]
}

/// The factor within [`SECANTS`] at which a rising function is zero, or next to zero.
fn bisected(function: impl Fn(f64) -> f64) -> f64 {
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

/// Lets an element without load at rest close where the fine contact says it does.
fn closing(sliders: &mut Sliders, slider: usize, ends: [[f64; 2]; 2]) {
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
