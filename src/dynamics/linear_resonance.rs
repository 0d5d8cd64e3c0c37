//! Resonance of a joint whose contact elements are linear springs. The linear resonance bounds the resonance of the
//! joint with friction, and is exact at small loads.
//!
//! Stiffer springs raise every natural frequency of a structure (Courant and Fischer). A slipping joint is stiffer than
//! a joint without tangential springs, and softer than a joint with tied bodies. If no element opens or closes, the
//! frequency of mode r of the slipping joint has two bounds. The lower bound is the frequency of mode r without
//! tangential springs, and the upper bound is the frequency of mode r with tied bodies.

use std::f64::consts::TAU;

use super::aft::InterfaceElement;
use super::cycle::half_range;
use super::slider::Slider;
use super::{ContactElement, DynamicsError, SecondOrder, Vibration, reference_springs};
use crate::linalg::RowMatrix;

/// Stiffness of a tied joint over the stiffness of its contact elements.
const TIED_STIFFNESS_RATIO: f64 = 1e4;
/// The bodies count as tied if contact springs of ten times the stiffness multiply the frequency by at most this ratio.
const TIED_FREQUENCY_RATIO: f64 = 1.05;
/// Normal load \[N\] of a slider that neither slips nor opens.
const UNREACHABLE_LOAD: f64 = 1e30;
/// Safety factor of the sticking limit for elements of one slider. The factor covers the tolerance of the resonance
/// search.
const STICKING_MARGIN: f64 = 0.95;
/// Safety factor of the sticking limit for banks, whose weaker sliders slip earlier (`tests/drawn/resonances.py`).
const STICKING_MARGIN_OF_BANKS: f64 = 0.5;
/// Largest share of the joint's load that the least loaded elements of banks carry together and that the load limits
/// ignore.
const NEGLECTED_LOAD_SHARE: f64 = 1e-3;
/// Largest ratio of frequency between a mode and its phase resonance.
const PHASE_RESONANCE_RATIO: f64 = 1.05;
/// Lowest searched frequency over the frequency of the highest mode.
const LOWEST_FREQUENCY_RATIO: f64 = 1e-4;
/// Largest ratio of the frequency of a rigid mode to the frequency of the highest mode. The frequency of a rigid mode
/// differs from zero only by rounding.
const RIGID_FREQUENCY_RATIO: f64 = 1e-6;
/// Bisections of a limit.
const BISECTIONS: usize = 40;

/// Factors of the tangential and the normal springs of all contact elements.
type Factors = [f64; 2];
const STUCK: Factors = [1.0, 1.0];

/// Mode of the linear structure, with its response at resonance to the loads of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearResonance {
    /// Number of the mode, from 1, by ascending frequency.
    pub mode: usize,
    /// Frequency of the phase resonance of the mode \[Hz\], or the natural frequency of a mode without a phase
    /// resonance.
    pub frequency: f64,
    /// Modal damping ratio of all linear damping.
    pub damping_ratio: f64,
    /// Response of the structure to the loads at `frequency`. `None` without damping.
    pub response: Option<LinearResponse>,
}

/// Half ranges over a cycle of a linear response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearResponse {
    /// Displacement of the response point \[m\].
    pub displacement: f64,
    /// Tangential force of the joint \[N\].
    pub force: f64,
    /// Moment of the tangential force about the normal through the origin of the joint \[N m\].
    pub moment: f64,
    /// Largest share of the normal load at rest that any element loses during the cycle.
    pub load_lost: f64,
}

/// Load limits of the linear response of a stuck joint. Each limit is a multiple of the loads of the scene.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearLimits {
    /// Largest load at which no element slips as a whole and no element opens. With one slider per element, the linear
    /// response is exact up to the load `sticks`. In a bank, some sliders slip under any load. For banks, `sticks` is a
    /// share of `may_slip`. Only the elements that carry 99.9 % of the normal load count.
    pub sticks: f64,
    /// Smallest load at which an element slips as a whole in the linear response. Infinite if no element slips.
    pub may_slip: f64,
    /// Smallest load at which an element opens in the linear response. Infinite if no element opens.
    pub may_open: f64,
    /// Smallest load at which the tangential force of the joint exceeds the friction limit of the joint. Infinite
    /// without tangential force.
    pub joint_may_slip: f64,
}

/// Resonances of the linear structure with a stuck, a free and a tied joint.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearResonances {
    /// With all springs of the contact elements, or without contact elements.
    pub stuck: LinearResonance,
    /// Frequencies of all phase resonances of the stuck joint in the range \[Hz\].
    pub in_range: Vec<f64>,
    /// With normal springs only. `None` without contact elements.
    pub free: Option<LinearResonance>,
    /// With tied bodies. `None` without contact elements, or if the joint connects the structure to the ground: its
    /// frequency then has no upper bound.
    pub tied: Option<LinearResonance>,
    /// Limits of the stuck response. `None` without contact elements or damping.
    pub limits: Option<LinearLimits>,
}

/// Coefficients of the displacement of contact elements, three rows each.
type Coefficients = Vec<f64>;

impl Vibration {
    /// Computes the linear resonances of the mode that the drive excites most in the range. `centres` contains the
    /// positions of the contact elements \[m\]. If the range has no phase resonance, returns the frequencies of the
    /// phase resonances outside of the range \[Hz\].
    ///
    /// # Errors
    /// As [`SecondOrder::modes`] and a linear solve.
    pub fn linear_resonances(
        &self,
        elements: &[ContactElement],
        centres: &[[f64; 2]],
    ) -> Result<Result<LinearResonances, Vec<f64>>, DynamicsError> {
        let (frequencies, _) = self.model.modes(&reference_springs(elements))?;
        let (omega, in_range) = match self.stuck_resonance(elements, &frequencies)? {
            (Some(omega), in_range) => (omega, in_range),
            (None, outside) => return Ok(Err(outside)),
        };
        let distance = |mode: usize| (frequencies[mode] / omega - 1.0).abs();
        let nearest = (0..frequencies.len()).min_by(|a, b| distance(*a).total_cmp(&distance(*b)));
        let mode = nearest.unwrap_or(0);
        let resonance_with = |factors| self.linear_resonance(elements, centres, factors, mode);
        let (stuck, displacement) = resonance_with(STUCK)?;
        let has_contact = elements.iter().any(|element| !element.sliders.is_empty());
        let mut found = LinearResonances {
            stuck,
            in_range,
            free: None,
            tied: None,
            limits: None,
        };
        if !has_contact {
            return Ok(Ok(found));
        }
        found.free = Some(resonance_with([0.0, 1.0])?.0);
        let tied = resonance_with([TIED_STIFFNESS_RATIO; 2])?.0;
        let softer = resonance_with([0.1 * TIED_STIFFNESS_RATIO; 2])?.0;
        found.tied =
            Some(tied).filter(|tied| tied.frequency <= TIED_FREQUENCY_RATIO * softer.frequency);
        if let (Some(displacement), Some(response)) = (displacement, stuck.response) {
            found.limits = Some(self.linear_limits(elements, &displacement, response.force)?);
        }
        Ok(Ok(found))
    }

    /// Returns the phase resonance of the response \[rad/s\] and all phase resonances in the range \[Hz\], with a stuck
    /// joint. At a single frequency, the function chooses the nearest of all resonances. If the range has no phase
    /// resonance, the function returns the phase resonances outside the range \[Hz\].
    fn stuck_resonance(
        &self,
        elements: &[ContactElement],
        frequencies: &[f64],
    ) -> Result<(Option<f64>, Vec<f64>), DynamicsError> {
        let linear = elements
            .iter()
            .map(|element| springs_of(element, STUCK))
            .collect();
        let balance = self.balance_of(linear, self.harmonics.clone())?;
        let highest = frequencies.last().copied().unwrap_or(0.0);
        let everywhere = (LOWEST_FREQUENCY_RATIO * highest, highest);
        let in_hertz = |found: &[(f64, f64)]| -> Vec<f64> {
            found.iter().map(|(omega, _)| omega / TAU).collect()
        };
        let range = match self.at_omega {
            Some(_) => everywhere,
            None => self.range,
        };
        let resonances = balance.reference_phase_resonances(range)?;
        let rank = |(omega, amplitude): &(f64, f64)| match self.at_omega {
            Some(at) => -(omega / at - 1.0).abs(),
            None => *amplitude,
        };
        match resonances.iter().max_by(|a, b| rank(a).total_cmp(&rank(b))) {
            Some((omega, _)) => Ok((Some(*omega), in_hertz(&resonances))),
            None => {
                let outside = balance.reference_phase_resonances(everywhere)?;
                Ok((None, in_hertz(&outside)))
            }
        }
    }

    /// Computes the resonance with scaled contact springs, and the displacement of the contact elements.
    fn linear_resonance(
        &self,
        elements: &[ContactElement],
        centres: &[[f64; 2]],
        factors: Factors,
        mode: usize,
    ) -> Result<(LinearResonance, Option<Coefficients>), DynamicsError> {
        let linear: Vec<ContactElement> = elements
            .iter()
            .map(|element| springs_of(element, factors))
            .collect();
        let springs = reference_springs(&linear);
        let (frequencies, modes) = self.model.modes(&springs)?;
        let natural = frequencies[mode];
        let highest = frequencies[frequencies.len() - 1];
        if natural <= RIGID_FREQUENCY_RATIO * highest {
            let rigid = LinearResonance {
                mode: mode + 1,
                frequency: 0.0,
                damping_ratio: 0.0,
                response: None,
            };
            return Ok((rigid, None));
        }
        let shape: Vec<f64> = (0..modes.rows()).map(|q| modes.at(q, mode)).collect();
        let damping_ratio = damping_ratio(&self.model, &shape, natural);
        let balance = self.balance_of(linear, self.harmonics.clone())?;
        let near = (
            natural / PHASE_RESONANCE_RATIO,
            natural * PHASE_RESONANCE_RATIO,
        );
        let resonances = balance.reference_phase_resonances(near)?;
        let strongest = resonances
            .into_iter()
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        let phase_resonance = strongest.map_or(natural, |(omega, _)| omega);
        let mut resonance = LinearResonance {
            mode: mode + 1,
            frequency: phase_resonance / TAU,
            damping_ratio,
            response: None,
        };
        let omega = match self.at_omega {
            Some(omega) if factors == STUCK => omega,
            _ => phase_resonance,
        };
        if !(omega > 0.0 && damping_ratio > 0.0) {
            return Ok((resonance, None));
        }
        let response = balance.solve(omega, None)?;
        let sampling = balance.sampling();
        let width = 3 * sampling.harmonics().coefficients();
        let samples = sampling.samples();
        let (mut force, mut moment) = (vec![[0.0; 2]; samples], vec![0.0; samples]);
        let mut load_lost = 0.0_f64;
        let each = elements.iter().zip(response.displacement.chunks(width));
        for (e, (element, rows)) in each.enumerate() {
            let [kt, _, kn] = [0, 1, 2].map(|d| springs[3 * e + d]);
            let [x, y] = centres.get(e).copied().unwrap_or([0.0; 2]);
            let motion = sampling.synthesise(rows);
            for ((u, force), moment) in motion.iter().zip(&mut force).zip(&mut moment) {
                force[0] += kt * u[0];
                force[1] += kt * u[1];
                *moment += kt * (x * u[1] - y * u[0]);
            }
            let rest = element.normal_load();
            if rest > 0.0 {
                let least = motion.iter().map(|u| kn * u[2]).fold(0.0, f64::min);
                load_lost = load_lost.max(-least / rest);
            }
        }
        let along = |d: usize| half_range(force.iter().map(|f| f[d]));
        resonance.response = Some(LinearResponse {
            displacement: balance.amplitude(&response, self.response_port)?.0,
            force: along(0).hypot(along(1)),
            moment: half_range(moment),
            load_lost,
        });
        let mut displacement = response.displacement;
        displacement.truncate(width * elements.len());
        Ok((resonance, Some(displacement)))
    }

    /// Computes the limits of the stuck response, with its tangential `force` \[N\]. The limits multiply all loads
    /// except the loads of harmonic 0, which keep their size.
    fn linear_limits(
        &self,
        elements: &[ContactElement],
        displacement: &[f64],
        force: f64,
    ) -> Result<LinearLimits, DynamicsError> {
        let balance = self.balance_of(elements.to_vec(), self.harmonics.clone())?;
        let sampling = balance.sampling();
        let n = sampling.harmonics().coefficients();
        let constant = sampling.harmonics().slot_of(0);
        let mut limits = LinearLimits {
            sticks: f64::INFINITY,
            may_slip: f64::INFINITY,
            may_open: f64::INFINITY,
            joint_may_slip: f64::INFINITY,
        };
        let friction_limits = elements
            .iter()
            .map(|e| e.friction_coefficient * e.normal_load());
        if force > 0.0 {
            limits.joint_may_slip = friction_limits.sum::<f64>() / force;
        }
        let is_bank = elements.iter().any(|element| element.sliders.len() > 1);
        let neglected_load = least_loaded(elements);
        for (element, rows) in elements.iter().zip(displacement.chunks(3 * n)) {
            let motion = |factor: f64| {
                let scaled = rows.iter().enumerate();
                let scaled = scaled.map(|(c, u)| match constant == Some(c % n) {
                    true => *u,
                    false => factor * u,
                });
                sampling.synthesise(&scaled.collect::<Vec<f64>>())
            };
            let lower = |limit: &mut f64, holds: &dyn Fn(&[[f64; 3]]) -> bool| {
                *limit = limit.min(largest(*limit, |factor| holds(&motion(factor))));
            };
            if is_bank && element.normal_load() <= neglected_load {
                continue;
            }
            if !is_bank {
                lower(&mut limits.sticks, &|u| element.follows_reference(u));
            }
            if element.normal_load() > 0.0 {
                let whole = one_slider(element);
                lower(&mut limits.may_slip, &|u| whole.follows_reference(u));
                let [slider, ..] = whole.sliders[..] else {
                    continue;
                };
                lower(&mut limits.may_open, &|u| {
                    u.iter().all(|u| slider.bilateral_load(u[2]) >= 0.0)
                });
            }
        }
        limits.sticks *= STICKING_MARGIN;
        if is_bank {
            limits.sticks = limits
                .sticks
                .min(STICKING_MARGIN_OF_BANKS * limits.may_slip);
        }
        Ok(limits)
    }
}

/// Replaces a contact element by linear springs.
fn springs_of(element: &ContactElement, [along, normal]: Factors) -> ContactElement {
    let [kt, _, kn] = element.reference_stiffness();
    ContactElement {
        friction_coefficient: 1.0,
        sliders: vec![Slider {
            normal_load: UNREACHABLE_LOAD,
            gap: 0.0,
            tangential_stiffness: along * kt,
            normal_stiffness: normal * kn,
        }],
        springs: Vec::new(),
        ..element.clone()
    }
}

/// Replaces a bank by one slider, which slips when all sliders of the bank do.
fn one_slider(element: &ContactElement) -> ContactElement {
    let [kt, _, kn] = element.reference_stiffness();
    ContactElement {
        sliders: vec![Slider {
            normal_load: element.normal_load(),
            gap: 0.0,
            tangential_stiffness: kt,
            normal_stiffness: kn,
        }],
        springs: Vec::new(),
        ..element.clone()
    }
}

/// Returns the largest load of the elements that together carry no more than [`NEGLECTED_LOAD_SHARE`] of the joint's
/// load \[N\].
fn least_loaded(elements: &[ContactElement]) -> f64 {
    let mut loads: Vec<f64> = elements.iter().map(ContactElement::normal_load).collect();
    loads.sort_by(f64::total_cmp);
    let all: f64 = loads.iter().sum();
    let (mut load_sum, mut largest) = (0.0, 0.0);
    for load in loads {
        load_sum += load;
        if load_sum > NEGLECTED_LOAD_SHARE * all {
            break;
        }
        largest = load;
    }
    largest
}

/// Returns the largest factor up to `most` at which `holds` returns true. `holds` must be true below some factor and
/// false above the same factor.
fn largest(most: f64, holds: impl Fn(f64) -> bool) -> f64 {
    if !holds(0.0) {
        return 0.0;
    }
    let mut high = if most.is_finite() { most } else { 1.0 };
    if most.is_finite() && holds(most) {
        return most;
    }
    while holds(high) {
        high *= 16.0;
        if high > 1e12 {
            return f64::INFINITY;
        }
    }
    let mut low = 0.0;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        match holds(middle) {
            true => low = middle,
            false => high = middle,
        }
    }
    low
}

/// Returns the damping ratio φᵀCφ/(2ω) + φᵀHφ/(2ω²) of a mode of unit modal mass.
fn damping_ratio(model: &SecondOrder, shape: &[f64], omega: f64) -> f64 {
    let work = |matrix: &RowMatrix| {
        let moved = matrix.apply(shape);
        moved.iter().zip(shape).map(|(a, b)| a * b).sum::<f64>()
    };
    match omega > 0.0 {
        true => 0.5 * (work(&model.damping) / omega + work(&model.hysteretic) / (omega * omega)),
        false => 0.0,
    }
}
