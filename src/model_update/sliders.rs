//! The law of contact elements from the fine contact: each a bank of parallel sliders.
//!
//! The fine contact is pushed along x, from next to nothing to full sliding, by up to a dozen levels of one displacement of all cells. What the cells of
//! an element carry at each level is its *backbone* T(u). The nearest concave broken line through the levels is a bank of
//! sliders that all see u: slider j has the stiffness by which the slope falls at level u_j, and slides from there on at k_j u_j
//! (Masing 1926, Iwan 1967). Their strengths add up to µN of the element.
//!
//! A slider bears what its strength takes, N_j = k_j u_j/µ, and has its part of the element's normal stiffness. So a slider of a low
//! level, that of the edges of spots, opens first when the element is relieved, and takes its stiffness with it. That is how a
//! rough contact loses stiffness and strength on the way to lift-off: for one spot it is the theorem of Ciavarella and Jäger,
//! T(u) = µ (N(δ) − N(δ − u/µκ)), with κ the ratio of normal to tangential compliance.

use super::{ContactElements, ElementParameters};
use crate::contact::stiffness;
use crate::contact::tangential::{self, Drive, TangentialOptions, TangentialProblem};
use crate::contact::{ContactError, HalfSpace, Shear};

/// The least level of displacement, in parts of that at which the contact would slide if nothing slid before, and the largest ratio
/// from one level to the next.
pub(super) const LEAST_LEVEL: f64 = 0.1;
const RATIO: f64 = 1.8;
/// Levels at most: over a range of 600 to 1 the ratio keeps its bound.
const MOST_LEVELS: usize = 12;
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

/// What each element carries when all cells are displaced alike.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbones {
    /// The levels, ascending \[m\].
    pub displacement: Vec<f64>,
    /// For each level the force of each element along it \[N\].
    pub force: Vec<Vec<f64>>,
}

/// The laws of all elements, and what they leave.
#[derive(Debug, Clone, PartialEq)]
pub struct Laws {
    /// Loads, gaps, the stiffness that the elements begin with, and their sliders.
    pub parameters: ElementParameters,
    /// What the backbones are off the banks at worst, element by element, in parts of µN of all: rising slopes, and corners that are
    /// lifted to keep the energy of loops.
    pub remainder: f64,
}

impl Backbones {
    /// Of the contact under friction `limit`s µp \[Pa\]; none where nothing holds it.
    ///
    /// # Errors
    /// Those of [`tangential::solve`].
    pub fn new(
        half_space: &mut HalfSpace,
        elements: &ContactElements,
        limit: &[f64],
        shear: Shear,
    ) -> Result<Option<Self>, ContactError> {
        let full = full_sliding(half_space, limit, shear);
        if full <= 0.0 {
            return Ok(None);
        }
        let contact: Vec<bool> = limit.iter().map(|limit| *limit > 0.0).collect();
        let stuck = stiffness::tangential(half_space, &contact, shear)?.total;
        let strength = limit.iter().sum::<f64>() * half_space.grid().cell_area();
        let displacement = levels(LEAST_LEVEL * strength / stuck, full);
        let options = TangentialOptions {
            tolerance: TOLERANCE,
            ..TangentialOptions::default()
        };
        let mut force = Vec::with_capacity(displacement.len());
        let (mut previous, mut reached) = (None, 0.0);
        for &level in &displacement {
            let along = Drive::Displacement(level - reached);
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
            reached = level;
        }
        Ok(Some(Backbones {
            displacement,
            force,
        }))
    }
}

/// Displacements from about `least` to `most`, each larger than the one before by the same factor.
pub(super) fn levels(least: f64, most: f64) -> Vec<f64> {
    let range = (most / least).max(RATIO);
    let steps = (range.ln() / RATIO.ln())
        .ceil()
        .min((MOST_LEVELS - 1) as f64);
    (0..=steps as usize)
        .map(|j| most * range.powf(j as f64 / steps - 1.0))
        .collect()
}

/// The displacement from which on every cell slides: where shear at its limit everywhere displaces the cells in contact most \[m\].
fn full_sliding(half_space: &mut HalfSpace, limit: &[f64], shear: Shear) -> f64 {
    let mut displaced = vec![0.0; limit.len()];
    match shear {
        Shear::AlongX => half_space.shear_x(limit, &mut displaced),
        Shear::InPlane => {
            let (none, mut across) = (vec![0.0; limit.len()], vec![0.0; limit.len()]);
            half_space.shear([limit, &none], [&mut displaced, &mut across]);
        }
    }
    let sliding = limit
        .iter()
        .zip(&displaced)
        .filter(|(limit, _)| **limit > 0.0);
    sliding.fold(0.0, |most, (_, u)| most.max(*u))
}

impl Laws {
    /// Of the fine contact under `pressure` \[Pa\] with the `gap` \[m\] of each cell. `half_space` is what the structure's own model
    /// leaves of the bodies' compliance: [`crate::contact::nodes`].
    ///
    /// # Errors
    /// Those of the contact solves.
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
            remainder: 0.0,
        };
        let mut sliders = Sliders::default();
        let strength: f64 = laws.parameters.normal_load.iter().sum();
        let mut banks = Vec::with_capacity(elements.len());
        for element in 0..elements.len() {
            let (bank, off) = laws.bank(element, friction_coefficient, backbones.as_ref());
            banks.push(bank);
            laws.remainder += off / (friction_coefficient * strength).max(f64::MIN_POSITIVE);
        }
        for (element, bank) in banks.into_iter().enumerate() {
            match laws.parameters.normal_load[element] > 0.0 {
                true => bank
                    .into_iter()
                    .for_each(|slider| sliders.push(element, slider)),
                false => sliders.push(element, laws.closing(elements, element)),
            }
        }
        laws.parameters.sliders = Some(sliders);
        Ok(laws)
    }

    /// The sliders of a loaded element, and what its backbone is off them at worst \[N\]; sets its stiffness.
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
        let bank = bank_of(&backbones.displacement, &slopes, kn, mu);
        let (mut reached, mut before, mut off) = (0.0, 0.0, 0.0_f64);
        for ((u, force), slope) in backbones.displacement.iter().zip(&force).zip(&slopes) {
            reached += slope * (u - before);
            before = *u;
            off = off.max((force - reached).abs());
        }
        (bank, off)
    }

    /// An element without load has no stiffness until it closes, and then that of its area in the mean of the others.
    fn closing(&self, elements: &ContactElements, element: usize) -> Slider {
        let of = &self.parameters;
        let sum = |values: &[f64]| -> f64 {
            let pairs = values.iter().zip(&of.normal_load);
            pairs.filter(|(_, load)| **load > 0.0).map(|(v, _)| v).sum()
        };
        let area = sum(elements.areas());
        let part = if area > 0.0 {
            elements.areas()[element] / area
        } else {
            0.0
        };
        [0.0, of.gap[element], part * sum(&of.kn), part * sum(&of.kt)]
    }
}

/// Normal load, gap, kn, kt.
pub(super) type Slider = [f64; 4];

/// The sliders of a loaded element with the normal stiffness `kn`, whose force has these falling `slopes` up to each level and none beyond
/// the last; and those that close under more load than at rest: the contact gains beyond its edge what it loses there as load falls.
pub(super) fn bank_of(levels: &[f64], slopes: &[f64], kn: f64, mu: f64) -> Vec<Slider> {
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
        .filter(|[own, _, own_kn, _]| *own_kn > 0.0 && own / own_kn < SHALLOW * load / kn)
        .map(|&[own, _, own_kn, own_kt]| [0.0, own / own_kn, own_kn, own_kt])
        .collect();
    bank.extend(closing);
    bank
}

/// Depth of the sliders that have their like beyond the edge of the contact, in parts of that of the element, load over stiffness.
const SHALLOW: f64 = 1.0;

impl Sliders {
    pub(super) fn push(&mut self, element: usize, [normal_load, gap, kn, kt]: Slider) {
        self.element.push(element);
        self.normal_load.push(normal_load);
        self.gap.push(gap);
        self.kn.push(kn);
        self.kt.push(kt);
    }
}

/// Falling slopes between the levels of the concave line from zero that ends at `strength`, nearest to `force` in its slopes (by the
/// pooling of neighbours that rise, weighted by their lengths). The motion turns at the level `turn`, if that is known.
pub(super) fn concave_slopes(
    levels: &[f64],
    force: &[f64],
    strength: f64,
    turn: Option<usize>,
) -> Vec<f64> {
    let force = lifted(levels, force, strength, turn);
    // Slope, length and number of levels of each pool.
    let mut pools: Vec<(f64, f64, usize)> = Vec::with_capacity(levels.len());
    let (mut before, mut reached) = (0.0, 0.0);
    for (&u, &t) in levels.iter().zip(&force) {
        pools.push(((t - reached) / (u - before), u - before, 1));
        (before, reached) = (u, t);
        while let [.., (slope, length, count), (next, more, others)] = pools[..]
            && next > slope
        {
            let both = (slope * length + next * more) / (length + more);
            pools.truncate(pools.len() - 2);
            pools.push((both, length + more, count + others));
        }
    }
    let levels = pools.iter();
    levels
        .flat_map(|&(slope, _, count)| vec![slope; count])
        .collect()
}

/// The corners of a broken line that has the area of a smooth curve through `force` under it, and so the energy of its loops: chords lie
/// below a curve of curvature c by c h³/12 of area over a length h, which two thirds of their sag make good. It ends at `strength`, and
/// keeps the force where the motion turns and beyond: a corner lifted there would pull up, with the slope that leads to it, all before.
fn lifted(levels: &[f64], force: &[f64], strength: f64, turn: Option<usize>) -> Vec<f64> {
    let last = levels.len() - 1;
    let within = |t: f64| t.clamp(0.0, strength);
    let at = |j: usize| match j {
        0 => [0.0, 0.0],
        j if j > last => [levels[last], strength],
        j => [levels[j - 1], within(force[j - 1])],
    };
    let lift = |j: usize| {
        let [[u0, t0], [u, t], [u1, t1]] = [at(j), at(j + 1), at(j + 2)];
        let (before, after) = (u - u0, u1 - u);
        let bend = (t - t0) / before - (t1 - t) / after;
        bend * (before * before + after * after) / (12.0 * (before + after))
    };
    (0..=last)
        .map(|j| match j == last {
            true => strength,
            false if turn.is_some_and(|turn| j >= turn) => within(force[j]),
            false => within(force[j] + lift(j)),
        })
        .collect()
}
