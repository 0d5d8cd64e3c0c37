//! Laws of contact elements from the fine contact: each element is a bank of parallel sliders.
//!
//! The model update pushes the fine contact along x, from almost no slip to full sliding. The push has up to a dozen
//! displacement levels. At each level, all cells have the same displacement. The *backbone* T(u) of an element is the
//! force of its cells at each level. The nearest concave polyline through the levels is a bank of sliders with the
//! common displacement u. Slider j has the stiffness k_j by which the slope falls at level u_j. Beyond level u_j, the
//! slider slides at k_j u_j (Masing 1926, Iwan 1967). The strengths of the sliders sum to µN of the element.
//!
//! Slider j carries the normal load N_j = k_j u_j/µ, so the friction limit µN_j equals the strength k_j u_j. Each
//! slider has a share of the normal stiffness of the element. A slider of a low level represents the edges of spots.
//! When the load of the element falls, a slider of a low level opens before the other sliders. An open slider has no
//! stiffness. Like a rough contact, a bank of sliders loses stiffness and strength as the load of the bank falls to
//! zero. For one contact spot, the theorem of Ciavarella and Jäger relates the tangential force to the normal load:
//! T(u) = µ (N(δ) − N(δ − u/µκ)). κ is the normal compliance divided by the tangential compliance.

use super::{ContactElements, ElementParameters, UpdateSettings};
use crate::contact::stiffness;
use crate::contact::tangential::{self, Drive, TangentialOptions, TangentialProblem};
use crate::contact::{ContactError, HalfSpace, Shear};

/// Largest ratio between successive levels.
const RATIO: f64 = 1.8;
/// Relative duality gap of a level.
const TOLERANCE: f64 = 1e-3;

/// Parameters of the sliders of all elements, element by element.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Sliders {
    /// Element of each slider, ascending.
    pub element: Vec<usize>,
    /// Static normal load \[N\].
    pub normal_load: Vec<f64>,
    /// Gap \[m\]; 0 where there is load.
    pub gap: Vec<f64>,
    /// Normal stiffness \[N/m\].
    pub kn: Vec<f64>,
    /// Tangential stiffness \[N/m\].
    pub kt: Vec<f64>,
}

/// Force of each element under an equal displacement of all cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbones {
    /// Levels of the displacement, ascending \[m\].
    pub displacement: Vec<f64>,
    /// For each level, the force of each element along the displacement \[N\].
    pub force: Vec<Vec<f64>>,
}

/// Laws of all elements, and the remaining difference from the fine contact.
#[derive(Debug, Clone, PartialEq)]
pub struct Laws {
    /// Loads, gaps, initial stiffness and sliders of the elements.
    pub parameters: ElementParameters,
    /// Largest difference between each backbone and its bank, summed over the elements, relative to µN of the joint.
    /// The difference comes from rising slopes, and from corners that are lifted to preserve the energy of loops.
    pub backbone_error: f64,
}

impl Backbones {
    /// Computes the backbones of the contact under friction `limit`s µp \[Pa\]; `None` if friction carries nothing.
    ///
    /// # Errors
    /// Returns the errors of [`tangential::solve`].
    pub fn new(
        half_space: &mut HalfSpace,
        elements: &ContactElements,
        limit: &[f64],
        shear: Shear,
    ) -> Result<Option<Self>, ContactError> {
        let full_displacement = full_sliding_displacement(half_space, limit, shear);
        if full_displacement <= 0.0 {
            return Ok(None);
        }
        let contact: Vec<bool> = limit.iter().map(|limit| *limit > 0.0).collect();
        let stuck_stiffness = stiffness::tangential(half_space, &contact, shear)?.total;
        let strength = limit.iter().sum::<f64>() * half_space.grid().cell_area();
        let displacement = levels(
            UpdateSettings::DEFAULT.least_level * strength / stuck_stiffness,
            full_displacement,
        );
        let options = TangentialOptions {
            tolerance: TOLERANCE,
            ..TangentialOptions::default()
        };
        let mut force = Vec::with_capacity(displacement.len());
        let (mut previous, mut last_level) = (None, 0.0);
        for &level in &displacement {
            let along = Drive::Displacement(level - last_level);
            let drive = match shear {
                Shear::AlongX => vec![along],
                Shear::InPlane => vec![along, Drive::Displacement(0.0)],
            };
            let problem = TangentialProblem {
                patch: elements.patch(),
                limit,
                previous: previous.as_ref(),
                drive: &drive,
                rotation: None,
                offset: None,
            };
            let step = tangential::solve(half_space, &problem, previous.as_ref(), options)?;
            force.push(elements.integrals(&step.shear[0]));
            previous = Some(step.shear);
            last_level = level;
        }
        Ok(Some(Backbones {
            displacement,
            force,
        }))
    }
}

/// Returns displacements from about `least` to `most`, each larger than the one before by the same factor.
pub(super) fn levels(least: f64, most: f64) -> Vec<f64> {
    let range = (most / least).max(RATIO);
    let steps = (range.ln() / RATIO.ln())
        .ceil()
        .min((UpdateSettings::DEFAULT.max_levels - 1) as f64);
    (0..=steps as usize)
        .map(|j| most * range.powf(j as f64 / steps - 1.0))
        .collect()
}

/// Returns the smallest displacement at which all cells slide \[m\]. The displacement is the maximum over the cells in
/// contact under the limit shear in all cells.
fn full_sliding_displacement(half_space: &mut HalfSpace, limit: &[f64], shear: Shear) -> f64 {
    let mut displacement = vec![0.0; limit.len()];
    match shear {
        Shear::AlongX => half_space.shear_x(limit, &mut displacement),
        Shear::InPlane => {
            let (zeros, mut across) = (vec![0.0; limit.len()], vec![0.0; limit.len()]);
            half_space.shear([limit, &zeros], [&mut displacement, &mut across]);
        }
    }
    let sliding = limit
        .iter()
        .zip(&displacement)
        .filter(|(limit, _)| **limit > 0.0);
    sliding.fold(0.0, |most, (_, u)| most.max(*u))
}

impl Laws {
    /// Computes the laws from the fine contact under `pressure` \[Pa\] with the `gap` \[m\] of each cell. `half_space`
    /// contains the compliance of the bodies that the model of the structure does not include: see
    /// [`crate::contact::nodes`].
    ///
    /// # Errors
    /// Returns the errors of the contact solves.
    pub fn new(
        half_space: &mut HalfSpace,
        elements: &ContactElements,
        [pressure, gap]: [&[f64]; 2],
        friction_coefficient: f64,
        pressure_cap: Option<f64>,
        shear: Shear,
    ) -> Result<Self, ContactError> {
        let limit: Vec<f64> = pressure.iter().map(|p| friction_coefficient * p).collect();
        let elastic = stiffness::elastic_cells(pressure, pressure_cap);
        let normal = stiffness::local_normal(half_space, &elastic)?;
        let kn: Vec<f64> = elements.integrals(&normal.density[0]);
        let backbones = Backbones::new(half_space, elements, &limit, shear)?;
        let normal_load = elements.loads(pressure);
        let mut laws = Laws {
            parameters: ElementParameters {
                gap: elements.static_gaps(gap, &normal_load),
                normal_load,
                kn: kn.into_iter().map(|k| k.max(0.0)).collect(),
                kt: vec![0.0; elements.len()],
                sliders: None,
            },
            backbone_error: 0.0,
        };
        let mut sliders = Sliders::default();
        let strength: f64 = laws.parameters.normal_load.iter().sum();
        let mut banks = Vec::with_capacity(elements.len());
        for element in 0..elements.len() {
            let (bank, deviation) = laws.bank(element, friction_coefficient, backbones.as_ref());
            banks.push(bank);
            laws.backbone_error +=
                deviation / (friction_coefficient * strength).max(f64::MIN_POSITIVE);
        }
        for (element, bank) in banks.into_iter().enumerate() {
            match laws.parameters.normal_load[element] > 0.0 {
                true => bank
                    .into_iter()
                    .for_each(|slider| sliders.push(element, slider)),
                false => sliders.push(element, laws.closing_slider(elements, element)),
            }
        }
        laws.parameters.sliders = Some(sliders);
        Ok(laws)
    }

    /// Returns the sliders of a loaded element and the largest difference of its backbone from them \[N\]. Sets its kt.
    fn bank(
        &mut self,
        element: usize,
        mu: f64,
        backbones: Option<&Backbones>,
    ) -> (Vec<Slider>, f64) {
        let (load, kn) = (
            self.parameters.normal_load[element],
            self.parameters.kn[element],
        );
        let Some(backbones) = backbones.filter(|_| load > 0.0) else {
            return (vec![[load, 0.0, kn, 0.0]], 0.0);
        };
        let force: Vec<f64> = backbones.force.iter().map(|level| level[element]).collect();
        let slopes = concave_slopes(&backbones.displacement, &force, mu * load, None);
        self.parameters.kt[element] = slopes[0];
        let bank = slider_bank(&backbones.displacement, &slopes, kn, mu);
        let (mut bank_force, mut before, mut deviation) = (0.0, 0.0, 0.0_f64);
        for ((u, force), slope) in backbones.displacement.iter().zip(&force).zip(&slopes) {
            bank_force += slope * (u - before);
            before = *u;
            deviation = deviation.max((force - bank_force).abs());
        }
        (bank, deviation)
    }

    /// Returns the slider of an element without load. The slider has no stiffness until it closes. A closed slider has
    /// the mean stiffness per area of the loaded elements.
    fn closing_slider(&self, elements: &ContactElements, element: usize) -> Slider {
        let parameters = &self.parameters;
        let sum = |values: &[f64]| -> f64 {
            let pairs = values.iter().zip(&parameters.normal_load);
            pairs.filter(|(_, load)| **load > 0.0).map(|(v, _)| v).sum()
        };
        let area = sum(elements.areas());
        let area_share = if area > 0.0 {
            elements.areas()[element] / area
        } else {
            0.0
        };
        [
            0.0,
            parameters.gap[element],
            area_share * sum(&parameters.kn),
            area_share * sum(&parameters.kt),
        ]
    }
}

/// Normal load, gap, kn and kt of a slider.
pub(super) type Slider = [f64; 4];

/// Returns the sliders of a loaded element with the normal stiffness `kn`. Up to each level, the force of the element
/// has the slope in `slopes`; the slopes fall from level to level. Beyond the last level, the slope is 0. The function
/// adds sliders that close if the load exceeds the load at rest. A higher load adds as much contact at the edge as an
/// equally lower load removes.
pub(super) fn slider_bank(levels: &[f64], slopes: &[f64], kn: f64, mu: f64) -> Vec<Slider> {
    let next = slopes[1..].iter().chain([&0.0]);
    let steps = slopes.iter().zip(next).map(|(slope, next)| slope - next);
    let mut bank: Vec<Slider> = steps
        .zip(levels)
        .filter(|(k, _)| *k > 0.0)
        .map(|(k, u)| [k * u / mu, 0.0, kn * k / slopes[0], k])
        .collect();
    let load: f64 = bank.iter().map(|[load, ..]| load).sum();
    let closing: Vec<Slider> = bank
        .iter()
        .filter(|[own, _, own_kn, _]| {
            *own_kn > 0.0 && own / own_kn < UpdateSettings::DEFAULT.closing_depth * load / kn
        })
        .map(|&[own, _, own_kn, own_kt]| [0.0, own / own_kn, own_kn, own_kt])
        .collect();
    bank.extend(closing);
    bank
}

impl Sliders {
    pub(super) fn push(&mut self, element: usize, [normal_load, gap, kn, kt]: Slider) {
        self.element.push(element);
        self.normal_load.push(normal_load);
        self.gap.push(gap);
        self.kn.push(kn);
        self.kt.push(kt);
    }
}

/// Returns the falling slopes, between the levels, of a concave polyline from zero to `strength`. The slopes of the
/// polyline are nearest to the slopes of `force`. If a slope exceeds the previous slope, the function replaces both
/// slopes by their weighted mean. The weights are the lengths of the intervals. The motion turns at the level `turn`,
/// if there is one.
pub(super) fn concave_slopes(
    levels: &[f64],
    force: &[f64],
    strength: f64,
    turn: Option<usize>,
) -> Vec<f64> {
    let force = lift_corners(levels, force, strength, turn);
    // Slope, length and number of levels of each pool.
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(levels.len());
    let (mut last_level, mut last_force) = (0.0, 0.0);
    for (&u, &t) in levels.iter().zip(&force) {
        pools.push(((t - last_force) / (u - last_level), u - last_level, 1));
        (last_level, last_force) = (u, t);
        while let [.., (slope, length, count), (next, next_length, next_count)] = pools[..]
            && next > slope
        {
            let pooled_slope = (slope * length + next * next_length) / (length + next_length);
            pools.truncate(pools.len() - 2);
            pools.push((pooled_slope, length + next_length, count + next_count));
        }
    }
    let levels = pools.iter();
    levels
        .flat_map(|&(slope, _, count)| vec![slope; count])
        .collect()
}

/// Returns the corners of a polyline with the same area as a smooth curve through `force`. Hysteresis loops from the
/// polyline and from the curve then dissipate the same energy. Over a length h, a chord lies below a curve of curvature
/// c by an area of c h³/12. The corners rise by two thirds of the sag of the chord, which restores most of the area
/// below the curve. The polyline ends at `strength`. The polyline keeps the force from the level `turn` on, where the
/// motion turns. The function does not lift corners from `turn` on. A lifted corner would raise the slope before the
/// corner, and the concave fit would then raise all earlier forces.
fn lift_corners(levels: &[f64], force: &[f64], strength: f64, turn: Option<usize>) -> Vec<f64> {
    let last = levels.len() - 1;
    let clamped = |t: f64| t.clamp(0.0, strength);
    let corner = |j: usize| match j {
        0 => [0.0, 0.0],
        j if j > last => [levels[last], strength],
        j => [levels[j - 1], clamped(force[j - 1])],
    };
    let lift = |j: usize| {
        let [[u0, t0], [u, t], [u1, t1]] = [corner(j), corner(j + 1), corner(j + 2)];
        let (before, after) = (u - u0, u1 - u);
        let bend = (t - t0) / before - (t1 - t) / after;
        bend * (before * before + after * after) / (12.0 * (before + after))
    };
    (0..=last)
        .map(|j| match j == last {
            true => strength,
            false if turn.is_some_and(|turn| j >= turn) => clamped(force[j]),
            false => clamped(force[j] + lift(j)),
        })
        .collect()
}
