//! What an engineer would look at before a run: a few figures of a scene by rules of thumb, and where one is out of all bounds.
//!
//! A mistaken unit is wrong by a thousand or more. Bounds are so wide that a joint of any metal, ceramic or polymer passes; they judge
//! nothing. Rules of thumb are of the order of what they estimate, not better.

use serde::Serialize;

use crate::material::Elastic;
use crate::recipe::{Recipe, YIELDS};
use crate::surface::prepare::Prepared;
use crate::wear::{Channel, Motion};

/// A figure of a scene.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What it is.
    pub what: &'static str,
    /// The figure in words, with its unit.
    pub value: String,
    /// The key to look at, and why, if the figure is out of bounds.
    pub warning: Option<String>,
}

/// Young's moduli \[Pa\] of gels and of diamond.
const MODULUS: [f64; 2] = [1e4, 1.3e12];
/// Densities \[kg/m³\] of foam and of osmium.
const DENSITY: [f64; 2] = [20.0, 2.3e4];
/// Longitudinal wave speeds √(E/ρ) \[m/s\] of rubber and of diamond.
const WAVE_SPEED: [f64; 2] = [20.0, 2e4];
/// Mean pressure over the contact modulus: a joint strained by more than a hundredth is no joint under a bolt, and with less than the
/// lower bound the bodies hardly touch.
const STRAIN: [f64; 2] = [1e-10, 1e-2];
/// Root mean square slope of heights: half spaces take slopes as small, and machined faces have some 0.01 to 0.2.
const SLOPE: f64 = 0.5;
/// Least Rq \[m\]: an atom.
const ATOM: f64 = 1e-10;
/// Fewer cells along a correlation length do not resolve an asperity; fewer correlation lengths along a side are no statistics.
const CELLS: f64 = 2.0;
const ASPERITIES: f64 = 3.0;
/// Sides of a joint \[m\].
const SIDE: [f64; 2] = [1e-6, 2.0];
/// Half range of a motion over what makes the joint slide.
const MOTION: [f64; 2] = [1e-4, 1e3];
/// Amplitude of all harmonic forces over the friction limit: more than a resonance multiplies, or nothing slips at any.
const FORCE: [f64; 2] = [1e-6, 10.0];
/// Largest coefficient of friction of dry metals in vacuum, and more.
const FRICTION: f64 = 2.0;
/// Largest damping ratio of a structure.
const DAMPING: f64 = 0.2;
/// Worn volume per energy \[m³/J\] of diamond against itself, and of what crumbles.
const WEAR: [f64; 2] = [1e-21, 1e-12];
/// Mean worn depth in the end over Rq, if the joint slid by its whole motion: more is not wear of a joint.
const WORN: f64 = 1e4;
/// Range of frequency over the first of the structure, by rule of thumb.
const FREQUENCY: [f64; 2] = [1e-3, 30.0];
/// Masses of a structure \[kg\].
const MASS: [f64; 2] = [1e-6, 1e6];
/// What a bolt loses of its load for an approach of Rq.
const BOLT: [f64; 2] = [1e-7, 1e2];

/// A figure and its bounds; `hint` says which unit to look at where it is out of them.
struct Bounded<'a> {
    what: &'static str,
    value: f64,
    words: String,
    bounds: [f64; 2],
    key: &'a str,
    hint: &'a str,
}

impl Bounded<'_> {
    fn check(self) -> Check {
        let [least, most] = self.bounds;
        let beyond = match self.value {
            v if v < least => Some(format!("at least {}", short(least))),
            v if v > most => Some(format!("at most {}", short(most))),
            _ => None,
        };
        let (key, hint) = (self.key, self.hint);
        Check {
            what: self.what,
            warning: beyond.map(|beyond| {
                format!(
                    "{key}: the {} is {}, and should be {beyond}: {hint}",
                    self.what, self.words
                )
            }),
            value: self.words,
        }
    }
}

/// The figures of a scene, in the order in which a person would ask for them.
pub(super) fn checks(recipe: &Recipe, motion: &Motion, measured: Option<&Prepared>) -> Vec<Check> {
    let mut found = Vec::new();
    found.extend(bodies(recipe));
    found.extend(heights(recipe, measured));
    found.extend(pressures(recipe));
    found.extend(friction(recipe));
    found.extend(moved(recipe, motion));
    found.extend(vibration(recipe));
    found.extend(wear(recipe, motion));
    found.into_iter().map(Bounded::check).collect()
}

fn bodies(recipe: &Recipe) -> Vec<Bounded<'static>> {
    let modulus = |body: Elastic, key| Bounded {
        what: "Young's modulus",
        value: body.youngs_modulus,
        words: format!("{} GPa", short(body.youngs_modulus * 1e-9)),
        bounds: MODULUS,
        key,
        hint: "GPa, MPa or Pa?",
    };
    let mut found = Vec::new();
    match recipe.contact().map(|contact| contact.bodies) {
        Some(pair) if pair.lower == pair.upper => {
            found.push(modulus(pair.lower, "material.youngs_modulus"));
        }
        Some(pair) => {
            found.push(modulus(pair.lower, "material.lower.youngs_modulus"));
            found.push(modulus(pair.upper, "material.upper.youngs_modulus"));
        }
        None => (),
    }
    let resonator = recipe.structure.as_ref().and_then(|s| s.source.resonator());
    if let Some(resonator) = resonator {
        let material = resonator.material;
        if recipe.contact().is_none() {
            found.push(modulus(material.elastic, "material.youngs_modulus"));
        }
        let speed = (material.elastic.youngs_modulus / material.density).sqrt();
        found.push(Bounded {
            what: "density",
            value: material.density,
            words: format!("{} kg/m³", short(material.density)),
            bounds: DENSITY,
            key: "material.density",
            hint: "kg/m^3 or g/cm^3?",
        });
        found.push(Bounded {
            what: "speed of sound",
            value: speed,
            words: format!("{} m/s", short(speed)),
            bounds: WAVE_SPEED,
            key: "material.youngs_modulus, material.density",
            hint: "it is the root of E over density",
        });
    }
    found
}

fn heights(recipe: &Recipe, measured: Option<&Prepared>) -> Vec<Bounded<'static>> {
    let Some(surface) = recipe.surface() else {
        return Vec::new();
    };
    let grid = surface.grid();
    let longest = surface.size[0].max(surface.size[1]);
    let shortest = surface.size[0].min(surface.size[1]);
    let mut found = vec![Bounded {
        what: "side of the joint",
        value: if longest > SIDE[1] { longest } else { shortest },
        words: format!(
            "{} × {} mm",
            short(surface.size[0] * 1e3),
            short(surface.size[1] * 1e3)
        ),
        bounds: SIDE,
        key: "joint.size",
        hint: "mm, um or m?",
    }];
    let lengths = surface.heights.correlation_length();
    let rolloff = surface.heights.rolloff_wavelength();
    let rq = match measured {
        Some(measured) => {
            let heights = &measured.heights;
            let mean = heights.iter().sum::<f64>() / heights.len() as f64;
            let square: f64 = heights.iter().map(|h| (h - mean).powi(2)).sum();
            Some((square / heights.len() as f64).sqrt())
        }
        None => surface.heights.rq(),
    };
    let key = if measured.is_some() {
        "surface.unit"
    } else {
        "surface.rq"
    };
    if let Some(rq) = rq {
        found.push(Bounded {
            what: "Rq",
            value: rq,
            words: format!("{} µm", short(rq * 1e6)),
            // A face that is flat by its file says nothing of a unit.
            bounds: [if rq == 0.0 { 0.0 } else { ATOM }, shortest],
            key,
            hint: "um, nm or mm?",
        });
    }
    let slope = match (measured, rq) {
        (Some(measured), _) => Some(slope_of(measured)),
        // The least of the two axes is the steepest.
        (None, Some(rq)) => lengths
            .map(|lengths| lengths[0].min(lengths[1]))
            .or(rolloff.map(|rolloff| rolloff / std::f64::consts::TAU))
            .map(|length| std::f64::consts::SQRT_2 * rq / length),
        (None, None) => None,
    };
    if let Some(slope) = slope {
        found.push(Bounded {
            what: "slope of the heights (root mean square)",
            value: slope,
            words: short(slope),
            bounds: [0.0, SLOPE],
            key: if measured.is_some() {
                "surface.unit, surface.spacing"
            } else {
                "surface.rq, surface.correlation_length"
            },
            hint: "heights are small against lengths: um and mm exchanged?",
        });
    }
    if let Some(lengths) = lengths {
        let cells = (lengths[0] / grid.dx).min(lengths[1] / grid.dy);
        let many = (surface.size[0] / lengths[0]).min(surface.size[1] / lengths[1]);
        found.push(Bounded {
            what: "cells of a correlation length",
            value: cells,
            words: short(cells),
            bounds: [CELLS, f64::INFINITY],
            key: "surface.correlation_length, joint.grid",
            hint: "an asperity is not resolved; a finer grid, or um in place of mm?",
        });
        found.push(Bounded {
            what: "correlation lengths along a side",
            value: many,
            words: short(many),
            bounds: [ASPERITIES, f64::INFINITY],
            key: "surface.correlation_length",
            hint: "the face has no more than a few asperities; m in place of mm?",
        });
    }
    found
}

/// Root mean square slope along the steeper axis.
fn slope_of(measured: &Prepared) -> f64 {
    let grid = measured.patch.grid;
    let mut sums = [(0.0, 0u32); 2];
    for cell in 0..grid.len() {
        let (i, j) = grid.cell(cell);
        let next = [(i + 1, j, grid.dx), (i, j + 1, grid.dy)];
        for (sum, (i, j, side)) in sums.iter_mut().zip(next) {
            if i < grid.nx && j < grid.ny {
                let rise = measured.heights[grid.index(i, j)] - measured.heights[cell];
                sum.0 += (rise / side).powi(2);
                sum.1 += 1;
            }
        }
    }
    sums.map(|(sum, count)| (sum / f64::from(count.max(1))).sqrt())
        .into_iter()
        .fold(0.0, f64::max)
}

/// Mean pressure of a rough joint under its load \[Pa\].
fn mean_pressure(recipe: &Recipe) -> Option<f64> {
    let (surface, contact) = (recipe.surface()?, recipe.contact()?);
    let area = surface.kept as f64 * surface.grid().cell_area();
    Some(contact.normal_load / area).filter(|_| contact.approach.is_none())
}

fn pressures(recipe: &Recipe) -> Vec<Bounded<'static>> {
    let Some(contact) = recipe.contact() else {
        return Vec::new();
    };
    let modulus = contact.bodies.effective_modulus();
    let mut found = Vec::new();
    if let Some(mean) = mean_pressure(recipe) {
        found.push(Bounded {
            what: "mean pressure over the contact modulus",
            value: mean / modulus,
            words: format!("{:.2e} ({} MPa)", mean / modulus, short(mean * 1e-6)),
            bounds: STRAIN,
            key: "contact.normal_load, joint.size, material.youngs_modulus",
            hint: "kN or N, mm or m, GPa or MPa?",
        });
        let radius = recipe.surface().and_then(|s| s.heights.sphere_radius());
        if let Some(radius) = radius {
            let cube = 6.0 * contact.normal_load * modulus.powi(2)
                / (std::f64::consts::PI.powi(3) * radius.powi(2));
            let peak = cube.cbrt();
            found.push(Bounded {
                what: "peak pressure of Hertz over the contact modulus",
                value: peak / modulus,
                words: format!("{} ({} GPa)", short(peak / modulus), short(peak * 1e-9)),
                bounds: [0.0, 2.0 * YIELDS],
                key: "contact.normal_load, surface.radius, material.youngs_modulus",
                hint: "kN or N, mm or m, GPa or MPa?",
            });
        }
    }
    if let Some(cap) = contact.pressure_cap {
        found.push(Bounded {
            what: "cap of the pressure over the contact modulus",
            value: cap / modulus,
            words: format!("{:.2e} ({} MPa)", cap / modulus, short(cap * 1e-6)),
            bounds: [STRAIN[0], 0.5],
            key: "contact.pressure_cap",
            hint: "MPa or GPa? no pressure comes near it",
        });
    }
    let rq = recipe.surface().and_then(|surface| surface.heights.rq());
    if let (Some(bolt), Some(rq)) = (contact.bolt_stiffness, rq) {
        let lost = bolt * rq / contact.normal_load;
        found.push(Bounded {
            what: "load that the bolt loses for an approach of Rq",
            value: lost,
            words: format!("{lost:.2e} of contact.normal_load"),
            bounds: BOLT,
            key: "contact.bolt_stiffness",
            hint: "N/um or N/m?",
        });
    }
    found
}

/// Coefficient of friction of the joint, and its friction limit \[N\].
fn limit(recipe: &Recipe) -> Option<(f64, f64)> {
    if let Some(contact) = recipe.contact() {
        let mu = contact.friction_coefficient?;
        return Some((mu, mu * contact.normal_load));
    }
    let elements = recipe.elements()?;
    let mu = elements.friction_coefficient;
    let [_, _, normal_load] = elements.stiffness.given()?;
    Some((mu, mu * normal_load))
}

fn friction(recipe: &Recipe) -> Vec<Bounded<'static>> {
    let Some((mu, limit)) = limit(recipe) else {
        return Vec::new();
    };
    vec![Bounded {
        what: "coefficient of friction",
        value: mu,
        words: format!("{mu} (friction holds {} N)", short(limit)),
        bounds: [0.0, FRICTION],
        key: "contact.friction_coefficient",
        hint: "a part, or percent?",
    }]
}

/// Half range of the displacement along x \[m\], where that is given.
fn half_range(motion: &Motion) -> Option<f64> {
    let Some(Channel::Displacement(values)) = motion.drive.first() else {
        return None;
    };
    let most = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let least = values.iter().copied().fold(f64::INFINITY, f64::min);
    Some(0.5 * (most - least)).filter(|half| *half > 0.0)
}

fn moved(recipe: &Recipe, motion: &Motion) -> Vec<Bounded<'static>> {
    let parts = (recipe.surface(), recipe.contact(), limit(recipe));
    let (Some(surface), Some(contact), Some((mu, limit))) = parts else {
        return Vec::new();
    };
    let Some(half_range) = half_range(motion).filter(|_| recipe.structure.is_none() && mu > 0.0)
    else {
        return Vec::new();
    };
    // Asperities give way by µ Rq / 2, and the bodies under them by that of a punch as wide as the joint.
    let width = (surface.size[0] * surface.size[1]).sqrt();
    let onset = mu * surface.heights.rq().unwrap_or(0.0) / 2.0
        + limit / (contact.bodies.effective_modulus() * width);
    vec![Bounded {
        what: "motion over what makes the joint slide",
        value: half_range / onset,
        words: format!(
            "{} ({} µm over some {} µm; a cell has {} µm)",
            short(half_range / onset),
            short(half_range * 1e6),
            short(onset * 1e6),
            short(surface.grid().dx * 1e6)
        ),
        bounds: MOTION,
        key: "motion.amplitude",
        hint: "um, mm or nm? heights do not travel with the bodies",
    }]
}

fn vibration(recipe: &Recipe) -> Vec<Bounded<'static>> {
    let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
        return Vec::new();
    };
    let mut found = vec![Bounded {
        what: "damping ratio",
        value: response.damping_ratio,
        words: format!("{}", response.damping_ratio),
        bounds: [0.0, DAMPING],
        key: "dynamics.damping_ratio",
        hint: "a part, or percent?",
    }];
    if let Some((_, limit)) = limit(recipe).filter(|(_, limit)| *limit > 0.0) {
        let force: f64 = response
            .forces
            .iter()
            .filter(|f| f.harmonic > 0)
            .map(|f| f.amplitude.abs())
            .sum();
        let ground = response.base.and_then(|base| {
            let [mass, _] = structure.source.mass_and_stiffness(base.axis)?;
            Some(base.force(mass, response.frequency[1]))
        });
        let force = force + ground.unwrap_or(0.0);
        found.push(Bounded {
            what: "force over what friction holds",
            value: force / limit,
            words: format!("{:.2e} ({} N)", force / limit, short(force)),
            bounds: FORCE,
            key: "dynamics.force, dynamics.base, contact.normal_load",
            hint: "N, kN or mN?",
        });
    }
    let given = recipe
        .elements()
        .and_then(|elements| elements.stiffness.given());
    let stiffness = given.map_or(0.0, |[kn, kt, _]| kn.max(kt));
    let (first, mass) = structure.source.first_frequency_and_mass(stiffness);
    let [low, high] = response.frequency;
    // A range that reaches to below the first frequency is judged by its upper end.
    let ratio = if high < first {
        high / first
    } else {
        low / first
    };
    found.push(Bounded {
        what: "frequency over the first of a bar as long",
        value: ratio,
        words: format!(
            "{} ({} to {} Hz over some {} Hz)",
            short(ratio),
            short(low),
            short(high),
            short(first)
        ),
        bounds: FREQUENCY,
        key: "dynamics.frequency, structure, material",
        hint: "Hz or kHz, mm or m, kg or g?",
    });
    found.push(Bounded {
        what: "mass",
        value: mass,
        words: format!("{} kg", short(mass)),
        bounds: MASS,
        key: "structure, material.density",
        hint: "kg or g, mm or m?",
    });
    found
}

fn wear(recipe: &Recipe, motion: &Motion) -> Vec<Bounded<'static>> {
    let Some(wear) = &recipe.wear else {
        return Vec::new();
    };
    let mut found = Vec::new();
    if wear.coefficient > 0.0 {
        found.push(Bounded {
            what: "wear coefficient",
            value: wear.coefficient,
            words: format!(
                "{:.3e} m³/J ({} µm³/J)",
                wear.coefficient,
                short(wear.coefficient * 1e18)
            ),
            bounds: WEAR,
            key: "wear.coefficient",
            hint: "um^3/J, mm^3/J or m^3/J? steels have some 1e3 to 1e5 um^3/J",
        });
    }
    let rq = recipe.surface().and_then(|surface| surface.heights.rq());
    if let (Some(step), Some(rq), true) = (
        wear.depth_step,
        rq.filter(|rq| *rq > 0.0),
        wear.scheme.is_explicit(),
    ) {
        found.push(Bounded {
            what: "depth of a wear step over Rq",
            value: step / rq,
            words: format!("{:.2e} ({} µm)", step / rq, short(step * 1e6)),
            bounds: [1e-6, 100.0],
            key: "wear.depth_step",
            hint: "um or mm?",
        });
    }
    let slid = half_range(motion).zip(limit(recipe)).zip(wear.cycles);
    if let (Some(((half_range, (_, limit)), cycles)), Some(surface), None) =
        (slid, recipe.surface(), &recipe.structure)
    {
        let area = surface.kept as f64 * surface.grid().cell_area();
        let depth = wear.coefficient * 4.0 * limit * half_range * cycles as f64 / area;
        let rq = rq.unwrap_or(0.0).max(1e-6);
        found.push(Bounded {
            what: "worn depth at most, over Rq",
            value: depth / rq,
            words: format!("{} ({} µm)", short(depth / rq), short(depth * 1e6)),
            bounds: [0.0, WORN],
            key: "wear.coefficient, wear.cycles, motion.amplitude",
            hint: "um^3/J, mm^3/J or m^3/J?",
        });
    }
    found
}

/// Four significant digits.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        size if size == 0.0 || (1e-3..1e6).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
