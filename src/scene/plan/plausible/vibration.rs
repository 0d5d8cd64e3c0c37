//! The vibration: damping, force, contact springs and frequencies.

use std::f64::consts::TAU;

use super::{Bounded, PLAIN, limit, short};
use crate::recipe::{Recipe, Response, Structure};
use crate::structure::resonator::Resonator;

/// Damping ratios of a structure: of the best resonators in vacuum (a quality of 1e5), and of what hardly swings.
const DAMPING: [f64; 2] = [5e-6, 0.2];
/// Damping ratios of dashpots, which may be dampers.
const DASHPOT: [f64; 2] = [5e-6, 0.7];
/// Amplitude of all harmonic forces over the friction limit: nothing slips at any more than a resonance multiplies.
const FORCE: [f64; 2] = [1e-6, 10.0];
/// Least amplitude at resonance of all harmonic forces over the friction limit: below it contact elements that share one stiffness and
/// load do not slip at any frequency. Of a rough face some asperities always do.
const NO_SLIP: f64 = 0.1;
const NO_SLIP_OF_FACE: f64 = 1e-3;
/// Stiffness of a contact, tangential over normal.
const TANGENTIAL: [f64; 2] = [1e-2, 1e2];
/// Tangential stiffness of a contact over that of the springs of an oscillator.
const CONTACT: [f64; 2] = [2e-3, 500.0];
/// Stiffness of a contact over that of a body as wide as the joint: of one that hardly touches, and of one that is glued.
const OVER_BODY: [f64; 2] = [0.01, 1e3];
/// Range of frequency over the first of a bar, by rule of thumb, and over the resonances of an oscillator.
const FREQUENCY: [f64; 2] = [1e-3, 30.0];
const OF_OSCILLATOR: [f64; 2] = [0.125, 8.0];
/// Direction of the normal among those of an oscillator.
const NORMAL: usize = 2;
/// Masses of a structure \[kg\].
const MASS: [f64; 2] = [1e-6, 1e6];

/// What vibrates, and how.
pub fn vibration(recipe: &Recipe) -> Vec<Bounded> {
    let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
        return Vec::new();
    };
    let swinging = Swinging::of(recipe, structure, response);
    let mut found = vec![ratio(
        "damping ratio",
        response.damping_ratio,
        DAMPING,
        "dynamics.damping_ratio",
        "a part, or percent?",
    )];
    // Without a spring there is none.
    let of_dashpots = swinging.as_ref().map(Swinging::dashpot_ratio);
    if let Some(of_dashpots) = of_dashpots.filter(|ratio| ratio.is_finite()) {
        found.push(ratio(
            "damping ratio of the dashpots",
            of_dashpots,
            DASHPOT,
            "structure.damping, structure.stiffness, structure.mass",
            "N s/m or N s/mm?",
        ));
    }
    found.extend(forces(recipe, structure, response, swinging.as_ref()));
    found.extend(springs(recipe, structure, swinging.as_ref()));
    let range = response.frequency;
    match (&swinging, structure.source.resonator()) {
        (Some(axis), _) => found.extend(axis.frequency(range)),
        (None, Some(resonator)) => found.push(of_bar(resonator, range)),
        (None, None) => (),
    }
    let resonator = structure.source.resonator();
    let mass = swinging
        .map(|axis| axis.mass)
        .or(resonator.map(Resonator::rough_mass));
    found.extend(mass.map(|mass| Bounded {
        what: "mass",
        value: mass,
        words: format!("{} kg", short(mass)),
        bounds: MASS,
        unit: ("kg", 1.0),
        key: "structure, material.density",
        hint: "kg or g, mm or m?",
        ..PLAIN
    }));
    found
}

/// A damping ratio, of which none is one.
fn ratio(
    what: &'static str,
    value: f64,
    [least, most]: [f64; 2],
    key: &'static str,
    hint: &'static str,
) -> Bounded {
    Bounded {
        what,
        value,
        words: short(value),
        bounds: [if value == 0.0 { 0.0 } else { least }, most],
        key,
        hint,
        ..PLAIN
    }
}

/// An oscillator along the axis in which it is driven.
struct Swinging {
    mass: f64,
    damping: f64,
    /// Of its springs, and of its contact if that sticks \[N/m\].
    stiffness: f64,
    contact: f64,
}

impl Swinging {
    fn of(recipe: &Recipe, structure: &Structure, response: &Response) -> Option<Self> {
        let drive = response.forces.iter().find(|force| force.harmonic == 1);
        let ground = response.base.map(|base| base.axis);
        let axis = drive.map(|force| force.port.axis).or(ground)?;
        let [mass, damping, stiffness] = structure.source.oscillator_along(axis)?;
        let given = recipe.elements().and_then(|found| found.stiffness.given());
        let contact = given.map_or(0.0, |[kn, kt, _]| if axis == NORMAL { kn } else { kt });
        Some(Swinging {
            mass,
            damping,
            stiffness,
            contact,
        })
    }

    fn dashpot_ratio(&self) -> f64 {
        0.5 * self.damping / (self.mass * (self.stiffness + self.contact)).sqrt()
    }

    fn frequency(&self, [low, high]: [f64; 2]) -> Option<Bounded> {
        let of = |stiffness: f64| (stiffness / self.mass).sqrt() / TAU;
        let (free, stuck) = (of(self.stiffness), of(self.stiffness + self.contact));
        let beside = match (high < free, low > stuck) {
            (true, _) => high / free,
            (_, true) => low / stuck,
            _ => 1.0,
        };
        (stuck > 0.0).then(|| Bounded {
            what: "frequency over the resonances of the oscillator",
            value: beside,
            words: format!(
                "{} ({} to {} Hz; {} Hz free of the contact, {} Hz stuck)",
                short(beside),
                short(low),
                short(high),
                short(free),
                short(stuck)
            ),
            bounds: OF_OSCILLATOR,
            key: "dynamics.frequency, structure.mass, structure.stiffness",
            hint: "no resonance is near: Hz or kHz, kg or g, N/m or N/um?",
            ..PLAIN
        })
    }
}

/// The range of frequency against the first of a bar as long as a resonator.
fn of_bar(resonator: &Resonator, [low, high]: [f64; 2]) -> Bounded {
    let first = resonator.bar_frequency();
    // A range that reaches to below the first frequency is judged by its upper end.
    let ratio = if high < first {
        high / first
    } else {
        low / first
    };
    Bounded {
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
        ..PLAIN
    }
}

/// The forces against what friction holds.
fn forces(
    recipe: &Recipe,
    structure: &Structure,
    response: &Response,
    swinging: Option<&Swinging>,
) -> Vec<Bounded> {
    let Some((_, limit)) = limit(recipe).filter(|(_, limit)| *limit > 0.0) else {
        return Vec::new();
    };
    // A mass that moves along the normal by itself loads no friction.
    let rubs = |axis: usize| swinging.is_none() || axis != NORMAL;
    let harmonic = response.forces.iter();
    let harmonic = harmonic.filter(|force| force.harmonic > 0 && rubs(force.port.axis));
    let ground = response.base.filter(|base| rubs(base.axis));
    let ground = ground.and_then(|base| {
        let [mass, _, _] = structure.source.oscillator_along(base.axis)?;
        Some(base.force(mass, response.frequency[1]))
    });
    let force = harmonic.map(|f| f.amplitude.abs()).sum::<f64>() + ground.unwrap_or(0.0);
    if force == 0.0 && swinging.is_some() {
        return Vec::new();
    }
    let figure = Bounded {
        what: "force over what friction holds",
        value: force / limit,
        words: format!(
            "{} ({} N over {} N)",
            short(force / limit),
            short(force),
            short(limit)
        ),
        bounds: FORCE,
        key: "dynamics.force, dynamics.base, contact.normal_load",
        hint: "N, kN or mN?",
        ..PLAIN
    };
    let damping = response.damping_ratio + swinging.map_or(0.0, Swinging::dashpot_ratio);
    if damping == 0.0 || response.rayleigh.is_some() {
        return vec![figure];
    }
    // A resonance multiplies the force by 1 / 2ζ, and the springs take their share of it.
    let share = swinging.map_or(1.0, |axis| axis.contact / (axis.contact + axis.stiffness));
    let there = force / limit * share * (0.5 / damping).max(1.0);
    let least = match recipe.surface() {
        Some(_) => NO_SLIP_OF_FACE,
        None => NO_SLIP,
    };
    let at_resonance = Bounded {
        what: "force at resonance over what friction holds",
        value: there,
        words: short(there),
        bounds: [least, f64::INFINITY],
        key: "dynamics.force, dynamics.base, contact.normal_load",
        hint: "the joint does not slip at any frequency: N, kN or mN?",
        usual: Some((
            [NO_SLIP, f64::INFINITY],
            "the joint hardly slips and hardly wears; N, kN or mN?",
        )),
        ..PLAIN
    };
    vec![figure, at_resonance]
}

/// Given stiffness of a contact.
fn springs(recipe: &Recipe, structure: &Structure, swinging: Option<&Swinging>) -> Vec<Bounded> {
    let given = recipe.elements().and_then(|found| found.stiffness.given());
    let Some([kn, kt, _]) = given.filter(|[kn, kt, _]| *kn > 0.0 && *kt > 0.0) else {
        return Vec::new();
    };
    let hint = "N/um, N/nm or N/m?";
    let over = |what, stiffness: f64, other: f64, bounds, key| Bounded {
        what,
        value: stiffness / other,
        words: format!(
            "{} ({} N/µm over {} N/µm)",
            short(stiffness / other),
            short(stiffness * 1e-6),
            short(other * 1e-6)
        ),
        bounds,
        key,
        hint,
        ..PLAIN
    };
    let mut found = vec![over(
        "tangential over normal stiffness of the contact",
        kt,
        kn,
        TANGENTIAL,
        "contact.kt, contact.kn",
    )];
    if let Some(axis) = swinging.filter(|axis| axis.stiffness > 0.0) {
        found.push(over(
            "stiffness of the contact over that of the springs",
            axis.contact,
            axis.stiffness,
            CONTACT,
            "contact.kt, contact.kn, structure.stiffness",
        ));
    }
    if let Some(resonator) = structure.source.resonator() {
        let side = (resonator.lap_length * resonator.arm_height).sqrt();
        let body = resonator.material.elastic.youngs_modulus * side;
        found.push(over(
            "normal stiffness of the contact over that of a body as wide",
            kn,
            body,
            OVER_BODY,
            "contact.kn",
        ));
        found.push(over(
            "tangential stiffness of the contact over that of a body as wide",
            kt,
            body,
            OVER_BODY,
            "contact.kt",
        ));
    }
    found
}
