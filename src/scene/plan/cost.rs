//! What the decided things are expected to cost: solves times iterations, each from what drives it.

use std::collections::BTreeMap;

use super::before::{Before, Texture};
use super::course::Course;
use super::disk::Files;
use super::memory::{self, Sizes};
use super::solves::{Marched, Solves};
use super::stability::Wearing;
use super::vibration_cost::{Vibrations, updates, vibrations};
use super::{Cost, rough};
use crate::contact::Shear;
use crate::dynamics::Harmonics;
use crate::recipe::{Coupling, Recipe};
use crate::scene::{CycleMode, Keep, Rotation, RoughJoint, Scene, Scheme, Update};
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Digits of an estimate.
const DIGITS: i32 = 3;
/// By which factor the pairs of known iterations may be more or fewer.
const SOLVES_WITHIN: f64 = 1.2;
/// The same of iterations that hang on a motion which is not known yet.
const MOTION_WITHIN: f64 = 1.2;
/// Other lengths that a step is tried with which ends at an update of the model, and the steps that each of those is more.
const TRIES: f64 = 2.0;
/// See [`TRIES`].
const MORE_STEPS: f64 = 0.5;
/// A run of one iteration.
const SINGLE: f64 = 1.0;

/// What was decided, as far as it costs.
struct Decided {
    shear: Shear,
    coupling: Coupling,
    march: Option<March>,
}

impl Decided {
    fn of(recipe: &Recipe) -> Decided {
        let contact = recipe.contact();
        Decided {
            shear: contact.map_or(Shear::AlongX, |contact| contact.shear),
            coupling: contact.map_or(Coupling::None, |contact| contact.coupling),
            march: recipe.cycle().and_then(|cycle| cycle.march),
        }
    }
}

/// What a scene is expected to cost, and how it is expected to wear, if it does.
pub(super) fn cost<'a>(
    scene: &'a Scene,
    motion: &Motion,
    texture: Option<Texture>,
    recipe: &Recipe,
) -> (Cost, Option<Wearing<'a>>) {
    let motion = Some(motion);
    let decided = &Decided::of(recipe);
    let contact_elements = super::vibration::contact_elements(scene);
    let unknowns = scene.dynamics.as_ref().map_or(0, |dynamics| {
        3 * contact_elements * (2 * dynamics.harmonics.len() - 1)
    });
    let rough = scene.rough();
    let (memory, memory_cached) = memory::peak(&sizes(
        scene,
        rough.as_ref(),
        motion,
        decided,
        contact_elements,
    ));
    let mut cost = Cost {
        contact_elements,
        unknowns,
        cells: 0,
        plane: [0; 2],
        memory,
        memory_cached,
        disk: 0,
        disk_per_iteration: 0,
        iterations: 0.0,
        iterations_range: [0.0; 2],
        fft_pairs: 0.0,
        fft_pairs_range: [0.0; 2],
        fft_pairs_by_stage: BTreeMap::new(),
        pairs_per_iteration: 0.0,
        updates: 0.0,
        structure_operations: 0.0,
        response_operations: 0.0,
    };
    let mut files = Files {
        cells: 0.0,
        axes: None,
        smooth: false,
        worn: scene.wear.is_some(),
        contact_elements: contact_elements as f64,
    };
    let mut area = 0.0;
    let (mut known, mut wearing) = (None, None);
    if let Some(rough) = &rough {
        let patch = rough.patch();
        let before = Before::of(scene, rough, &patch, motion, texture);
        let marched = marched(scene, motion, decided.march);
        let course = scene.wear.as_ref().map(|wear| {
            let end = wear.cycles.unwrap_or(u64::MAX);
            let asked = scene.output.response_at.iter();
            let landings = asked.filter(|&&at| at > 0 && at < end).count();
            let varies = matches!(marched, Marched::Stepped { varies: true, .. });
            Course::of(&before, rough.contact, wear, patch.area(), landings, varies)
        });
        files.cells = patch.cells() as f64;
        files.axes = (motion.is_some_and(|m| !m.drive.is_empty()) || scene.dynamics.is_some())
            .then(|| axes(decided.shear));
        files.smooth = before.is_sphere();
        cost.cells = patch.cells();
        cost.plane = rough::plane(patch.grid, rough.contact.boundary);
        area = course.map_or(before.area, |course| course.area);
        solves(&mut cost, scene, rough, motion, decided, &before, course);
        known = Some(before);
        wearing = match (&scene.wear, course, &scene.surface) {
            (Some(wear), Some(course), Some(surface)) => Some(Wearing {
                wear,
                surface,
                cap: rough.contact.pressure_cap,
                before,
                course,
            }),
            _ => None,
        };
    }
    let vibration = vibrations(
        scene,
        known.as_ref(),
        cost.iterations,
        area,
        unknowns,
        contact_elements,
    );
    cost.updates = vibration.updates;
    cost.structure_operations = digits(vibration.structure_operations);
    cost.response_operations = digits(vibration.response_operations);
    disk(&mut cost, scene, &files, known.as_ref(), area, &vibration);
    (cost, wearing)
}

fn axes(shear: Shear) -> f64 {
    match shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    }
}

/// Pairs of all solves, by stage.
fn solves(
    cost: &mut Cost,
    scene: &Scene,
    rough: &RoughJoint,
    motion: Option<&Motion>,
    decided: &Decided,
    before: &Before,
    course: Option<Course>,
) {
    let contact = rough.contact;
    let solves = Solves {
        before,
        fidelity: &scene.fidelity,
        in_plane: decided.shear == Shear::InPlane,
        marched: marched(scene, motion, decided.march),
        turning: contact.rotation == Rotation::Free,
        bolt: contact.bolt_stiffness.is_some(),
        load_steps: match decided.coupling {
            Coupling::Indented { load_steps } => Some(load_steps),
            Coupling::None | Coupling::Frictionless => None,
        },
    };
    let steps = course.map_or(0.0, |course| course.iterations);
    let end = course.map_or(before.area, |course| course.area);
    // Steps that end at an update, and whether those are seen by a stiffness.
    let scheme = scene.wear.as_ref().map(|wear| wear.scheme);
    let (cut, watched) = match (scheme, scene.update) {
        (Some(Scheme::Implicit), Some(Update::StiffnessChange(_))) => {
            (updates(scene, Some(before), steps, end), true)
        }
        (Some(Scheme::Implicit), Some(Update::WearVolume(_))) => {
            (updates(scene, Some(before), steps, end), false)
        }
        _ => (0.0, false),
    };
    let iterations = steps + MORE_STEPS * cut;
    // Contact grows by about the same factor in every step: the middle one stands for all.
    let middle = (before.area * end).sqrt();
    let every = scene.output.curves_every as f64;
    let curves = if every > 0.0 {
        let at_every = (iterations / every).floor();
        let last = if at_every * every < iterations {
            1.0
        } else {
            0.0
        };
        1.0 + at_every + last
    } else {
        0.0
    };
    let slides_along_x = motion
        .and_then(|motion| motion.drive.first())
        .is_none_or(|x| x.moves())
        || scene.dynamics.is_some();
    let hysteresis = if slides_along_x { curves } else { 0.0 };
    let predicted = matches!(scheme, Some(Scheme::Implicit | Scheme::SemiImplicit));
    // The first iteration and the last have their own area, and curves.
    let worn_curves = (curves - 1.0).max(0.0);
    let worn_loops = (hysteresis - 1.0).max(0.0);
    let by_stage = &mut cost.fft_pairs_by_stage;
    let mut add = |stage: &str, pairs: f64| {
        if pairs > 0.0 {
            by_stage.insert(stage.to_owned(), digits(pairs));
        }
    };
    add(
        "static_contact",
        solves.first() + iterations * solves.next(middle, predicted),
    );
    add(
        "static_contact.stiffness",
        solves.stiffness(before.area) + iterations * solves.stiffness(middle),
    );
    add(
        "static_contact.indentation",
        curves.min(1.0) * solves.indentation(before.area) + worn_curves * solves.indentation(end),
    );
    let first_loop = hysteresis.min(1.0);
    add(
        "fretting_cycle",
        solves.cycle(before.area, first_loop > 0.0)
            + worn_loops * solves.cycle(end, true)
            + (iterations - worn_loops).max(0.0) * solves.cycle(middle, false),
    );
    match scheme {
        Some(Scheme::Implicit) => {
            let seen = if watched {
                solves.stiffness(middle)
            } else {
                0.0
            };
            let tried = iterations + TRIES * cut;
            add("wear", tried * (solves.step(middle) + seen));
        }
        Some(Scheme::SemiImplicit) => add("wear", iterations * solves.single_step(middle)),
        Some(Scheme::Explicit) | None => {}
    }
    let pairs: f64 = by_stage.values().sum();
    let (motion_within, within) = match (&scene.dynamics, course) {
        (_, None) => (1.0, 1.0),
        (Some(_), Some(course)) => (MOTION_WITHIN, course.within),
        (None, Some(course)) => (1.0, course.within),
    };
    let within = within * motion_within;
    cost.iterations = iterations;
    cost.iterations_range = [
        (iterations / within).floor().max(iterations.min(1.0)),
        (iterations * within).ceil(),
    ];
    cost.fft_pairs = digits(pairs);
    let both = SOLVES_WITHIN.max(within);
    cost.fft_pairs_range = [digits(pairs / both), digits(pairs * both)];
    cost.pairs_per_iteration = digits(pairs / (SINGLE + iterations));
}

/// How cycles are marched; a motion that is computed is straight and steady, as the joint's mostly is.
fn marched(scene: &Scene, motion: Option<&Motion>, march: Option<March>) -> Marched {
    match (march, &scene.dynamics, scene.fidelity.cycle) {
        (Some(March::Stepped), ..) => motion.map_or(Marched::Not, |motion| Marched::Stepped {
            samples: motion.samples() as f64,
            varies: !motion.constant_load(),
        }),
        (None, Some(_), Some(CycleMode::Stepped)) => Marched::Stepped {
            samples: scene.fidelity.steps_per_cycle as f64,
            varies: true,
        },
        (Some(March::Superposition), ..) | (None, Some(_), Some(CycleMode::Superposition)) => {
            Marched::Superposition
        }
        (Some(March::Reversal), ..) | (None, Some(_), _) => Marched::Reversal,
        (None, None, _) => Marched::Not,
    }
}

fn disk(
    cost: &mut Cost,
    scene: &Scene,
    files: &Files,
    before: Option<&Before>,
    end: f64,
    vibration: &Vibrations,
) {
    let states = SINGLE + cost.iterations;
    // The mean of a part that grows by the same factor in every step.
    let begin = before.map_or(0.0, |before| before.area);
    let mean = if (end / begin - 1.0).abs() > 1e-6 && begin > 0.0 {
        (end - begin) / (end / begin).ln()
    } else {
        begin
    };
    let kept = match scene.output.keep {
        Keep::All => states,
        Keep::Some {
            every,
            last,
            updates,
        } => {
            // The unworn state always.
            let regular = every.map_or(1.0, |every| (states / every as f64).ceil());
            let updated = if updates {
                vibration.updates + 1.0
            } else {
                0.0
            };
            (regular + last as f64 + updated).min(states)
        }
    };
    let one = files.iteration(scene, mean);
    let every = scene.output.curves_every as f64;
    let with_curves = if every > 0.0 && files.cells > 0.0 {
        (states / every + 1.0).min(states)
    } else {
        0.0
    };
    let forced = match vibration.forced {
        0.0 => 0.0,
        forced => files.forced(false) + (forced - 1.0) * files.forced(true),
    };
    let bytes = kept * one + with_curves * files.curves() + forced;
    cost.disk = digits(bytes) as u64;
    cost.disk_per_iteration = digits(bytes / kept.max(1.0)) as u64;
}

/// What the peak of memory depends on.
fn sizes<'a>(
    scene: &'a Scene,
    rough: Option<&RoughJoint>,
    motion: Option<&Motion>,
    decided: &Decided,
    contact_elements: usize,
) -> Sizes<'a> {
    let mut sizes = Sizes {
        cells: 0.0,
        padding: 1.0,
        shear: decided.shear,
        limits: None,
        implicit: false,
        structure: scene.structure.as_ref(),
        contact_elements,
        coefficients: scene.dynamics.as_ref().map_or(0, |dynamics| {
            Harmonics::new(&dynamics.harmonics).map_or(0, |own| own.beyond().coefficients())
        }),
    };
    let Some(rough) = rough else {
        return sizes;
    };
    let plane = rough::plane(rough.grid, rough.contact.boundary);
    sizes.cells = rough.grid.len() as f64;
    sizes.padding = (plane[0] * plane[1]) as f64 / sizes.cells;
    sizes.implicit = scene
        .wear
        .as_ref()
        .is_some_and(|wear| wear.scheme == Scheme::Implicit);
    let asks_stepped = scene.fidelity.cycle == Some(CycleMode::Stepped);
    sizes.limits = match (decided.march, &scene.dynamics) {
        (Some(March::Stepped), _) => motion
            .filter(|motion| !motion.constant_load())
            .map(Motion::samples)
            .or(Some(1)),
        (None, Some(_)) if asks_stepped => Some(scene.fidelity.steps_per_cycle),
        (None, None) => None,
        _ => Some(1),
    };
    sizes
}

/// A number to the digits that it may have, the same on every machine.
fn digits(value: f64) -> f64 {
    if value == 0.0 || !value.is_finite() {
        return 0.0;
    }
    let place = DIGITS - 1 - value.abs().log10().floor() as i32;
    let scale = 10f64.powi(place.abs());
    if place >= 0 {
        (value * scale).round() / scale
    } else {
        (value / scale).round() * scale
    }
}
