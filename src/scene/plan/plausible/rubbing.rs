//! Friction, motion and wear.

use std::f64::consts::PI;

use super::face::Face;
use super::{Bounded, PLAIN, half, half_range, limit, short};
use crate::recipe::Recipe;
use crate::wear::{Channel, Motion};

/// The mean load of a history over that of the bolt: it is the same load.
const OF_HISTORY: [f64; 2] = [0.02, 50.0];
/// Mean worn depth of a volume that is asked for over the side of the joint, and over Rq: wear alters faces, not bodies.
const DEPTH: f64 = 1e-2;
const MANY_RQ: f64 = 1e2;

/// Coefficients of friction of dry solids: of ice, and of metals in vacuum and more.
const FRICTION: [f64; 2] = [0.01, 2.0];
/// Half range of a motion over what makes the joint slide: more is no fretting.
const MOST_MOTION: f64 = 1e3;
/// Below that nothing slips. What a partial slip dissipates goes as the cube of the motion, so that a joint that is to wear
/// wears nothing from a larger bound on.
const STICKS: f64 = 1e-4;
const WEARS_NOTHING: f64 = 8e-3;
/// Of a motion that is told: heights stay opposite to the same heights as long as it is less than a cell.
const CELL: f64 = 1.0;
/// Worn volume per energy \[m³/J\] of the hardest coatings, and of what crumbles.
const WEAR: [f64; 2] = [5e-18, 1e-12];
/// Most cycles of a machine: a hundred years of 300 a second.
const CYCLES: f64 = 1e12;
/// Depth of an explicit wear step over Rq.
const STEP: [f64; 2] = [1e-4, 5.0];
/// Mean worn depth in the end over Rq, if the joint slid by its whole motion: more is not wear of a joint, and less is hardly any.
const WORN: f64 = 1e4;
const HARDLY_WORN: f64 = 2e-3;
/// Rq of a face whose heights are a form \[m\].
const OF_FORM: f64 = 1e-6;

/// What friction carries.
pub fn friction(recipe: &Recipe) -> Option<Bounded> {
    let (mu, limit) = limit(recipe)?;
    Some(Bounded {
        what: "coefficient of friction",
        value: mu,
        words: format!("{mu} (friction holds {} N)", short(limit)),
        bounds: [if mu == 0.0 { 0.0 } else { FRICTION[0] }, FRICTION[1]],
        key: "contact.friction_coefficient",
        hint: "a part, or percent?",
        ..PLAIN
    })
}

/// A given motion, or what pulls and turns the joint.
pub fn moved(face: &Face, motion: &Motion, wears: bool) -> Vec<Bounded> {
    let mut found: Vec<Bounded> = pulled(face, motion, wears).into_iter().collect();
    found.extend(of_history(face, motion));
    if let Some(slid) = half_range(motion) {
        found.extend(slid_by(face, slid, &ALONG, wears));
    }
    // The corners move by the rotation.
    let arm = 0.5 * face.surface.size[0].hypot(face.surface.size[1]);
    if let Some(angle) = motion.rotation.as_ref().and_then(half)
        && angle > 0.0
    {
        found.extend(slid_by(face, angle * arm, &ABOUT, wears));
    }
    found
}

/// Forces and moments over what friction holds.
fn pulled(face: &Face, motion: &Motion, wears: bool) -> Option<Bounded> {
    let limit = face.contact.friction_coefficient? * face.contact.normal_load;
    let largest = |channel: &Channel| match channel {
        Channel::Force(values) => values.iter().fold(0.0f64, |m, v| m.max(v.abs())),
        Channel::Displacement(_) => 0.0,
    };
    let force = motion.drive.iter().map(largest).fold(0.0, f64::max);
    let moment = motion.rotation.as_ref().map_or(0.0, largest);
    // Friction of a disc as wide as the joint holds two thirds of its radius.
    let arm = face.width() / 3.0;
    let (key, hint, share) = match force > 0.0 {
        true => ("motion.force", "N, mN or kN?", force / limit),
        false => ("motion.moment", "N m or N mm?", moment / (limit * arm)),
    };
    (share > 0.0 && limit > 0.0).then(|| Bounded {
        what: "pull over what friction holds",
        value: share,
        words: short(share),
        bounds: [if wears { WEARS_NOTHING } else { STICKS }, f64::INFINITY],
        key,
        hint,
        ..PLAIN
    })
}

/// The loads of a history over that of the bolt.
fn of_history(face: &Face, motion: &Motion) -> Option<Bounded> {
    let load = face.contact.normal_load;
    let mean = motion.mean_load();
    let is_own = (mean / load - 1.0).abs() > 1e-6;
    (load > 0.0 && is_own).then(|| Bounded {
        what: "mean load of the motion over that of the contact",
        value: mean / load,
        words: format!(
            "{} ({} N over {} N)",
            short(mean / load),
            short(mean),
            short(load)
        ),
        bounds: OF_HISTORY,
        key: "motion.history, contact.normal_load",
        hint: "N or kN?",
        ..PLAIN
    })
}

/// The keys that give a motion, and what to look at where it is too large for the cells, and where it is out of proportion.
struct Moving {
    keys: [&'static str; 2],
    hints: [&'static str; 2],
}

const ALONG: Moving = Moving {
    keys: ["motion.amplitude, joint.grid", "motion.amplitude"],
    hints: [
        "slip is taken to be small: cells do not travel with it, and all wear is of the places that face each other at rest; um or mm?",
        "far less moves nothing and wears nothing, far more is no fretting: um, mm or nm?",
    ],
};

const ABOUT: Moving = Moving {
    keys: ["motion.rotation, joint.grid", "motion.rotation"],
    hints: [
        "slip is taken to be small: cells do not travel with it, and all wear is of the places that face each other at rest; rad, mrad or deg?",
        "far less turns nothing and wears nothing, far more is no fretting: rad, mrad or urad?",
    ],
};

/// A motion by this half range, of the corners where it is a rotation.
fn slid_by(face: &Face, half_range: f64, moving: &Moving, wears: bool) -> Vec<Bounded> {
    let (grid, contact) = (face.surface.grid(), face.contact);
    let cell = grid.dx.min(grid.dy);
    let mut found = vec![Bounded {
        what: "motion over a cell",
        value: half_range / cell,
        words: format!(
            "{} ({} µm over {} µm)",
            short(half_range / cell),
            short(half_range * 1e6),
            short(cell * 1e6)
        ),
        bounds: [0.0, CELL],
        key: moving.keys[0],
        hint: moving.hints[0],
        ..PLAIN
    }];
    let mu = contact.friction_coefficient.unwrap_or(0.0);
    if mu > 0.0 {
        // Asperities give way by µ Rq / 2, and the bodies under them by that of a punch as wide as the contact.
        let onset = mu * face.rq.unwrap_or(0.0) / 2.0
            + mu * contact.normal_load / (contact.bodies.effective_modulus() * face.width());
        found.push(Bounded {
            what: "motion over what makes the joint slide",
            value: half_range / onset,
            words: format!(
                "{} ({} µm over some {} µm)",
                short(half_range / onset),
                short(half_range * 1e6),
                short(onset * 1e6)
            ),
            bounds: [if wears { WEARS_NOTHING } else { STICKS }, MOST_MOTION],
            key: moving.keys[1],
            hint: moving.hints[1],
            ..PLAIN
        });
    }
    found
}

/// How much is to wear.
pub fn wear(recipe: &Recipe, face: Option<&Face>, motion: &Motion) -> Vec<Bounded> {
    let Some(wear) = &recipe.wear else {
        return Vec::new();
    };
    let mut found = Vec::new();
    if wear.coefficient > 0.0 {
        found.push(Bounded {
            what: "wear coefficient",
            value: wear.coefficient,
            words: format!("{} µm³/J", short(wear.coefficient * 1e18)),
            bounds: WEAR,
            unit: ("µm³/J", 1e-18),
            key: "wear.coefficient",
            hint: "um^3/J, mm^3/J or m^3/J? steels have some 1e3 to 1e5 um^3/J; with wear.law = \"archard\" it is k/mu",
            ..PLAIN
        });
    }
    if let Some(cycles) = wear.cycles {
        found.push(Bounded {
            what: "number of cycles",
            value: cycles as f64,
            words: short(cycles as f64),
            bounds: [0.0, CYCLES],
            key: "wear.cycles",
            hint: "no machine makes as many",
            ..PLAIN
        });
    }
    let rq = face.and_then(|face| face.rq).filter(|rq| *rq > 0.0);
    if let (Some(step), Some(rq), true) = (wear.depth_step, rq, wear.scheme.is_explicit()) {
        found.push(Bounded {
            what: "depth of a wear step over Rq",
            value: step / rq,
            words: format!("{} ({} µm)", short(step / rq), short(step * 1e6)),
            bounds: STEP,
            key: "wear.depth_step",
            hint: "um, nm or mm?",
            ..PLAIN
        });
    }
    found.extend(face.and_then(|face| worn(face, wear.coefficient, wear.cycles?, motion)));
    found.extend(face.and_then(|face| asked_for(face, wear.volume?)));
    found
}

/// What wears at most, if the joint slides by its whole motion.
fn worn(face: &Face, coefficient: f64, cycles: u64, motion: &Motion) -> Option<Bounded> {
    let slid = half_range(motion)?;
    let limit = face.contact.friction_coefficient? * face.contact.normal_load;
    let area = face.contact_radius().map_or(face.area(), |a| PI * a * a);
    let depth = coefficient * 4.0 * limit * slid * cycles as f64 / area;
    let rq = face.rq.filter(|rq| *rq > 0.0).unwrap_or(OF_FORM);
    Some(Bounded {
        what: "worn depth at most, over Rq",
        value: depth / rq,
        words: format!("{} ({} µm)", short(depth / rq), short(depth * 1e6)),
        bounds: [0.0, WORN],
        key: "wear.coefficient, wear.cycles, motion.amplitude",
        hint: "um^3/J, mm^3/J or m^3/J?",
        usual: (coefficient > 0.0).then_some((
            [HARDLY_WORN, WORN],
            "wear will hardly be seen; more cycles, um or nm?",
        )),
        ..PLAIN
    })
}

/// The volume at which wear is to end.
fn asked_for(face: &Face, volume: f64) -> Option<Bounded> {
    let side = face.surface.size[0].min(face.surface.size[1]);
    let depth = volume / face.area();
    let rq = face.rq.filter(|rq| *rq > 0.0).unwrap_or(OF_FORM);
    Some(Bounded {
        what: "depth of the volume asked for, over the side of the joint",
        value: depth / side,
        words: format!(
            "{} ({} µm, {} Rq)",
            short(depth / side),
            short(depth * 1e6),
            short(depth / rq)
        ),
        bounds: [0.0, DEPTH],
        key: "wear.volume, joint.size",
        hint: "mm^3, um^3 or m^3?",
        usual: Some((
            [0.0, DEPTH.min(MANY_RQ * rq / side)],
            "far more than the roughness is gone then; mm^3 or um^3?",
        )),
        ..PLAIN
    })
}
