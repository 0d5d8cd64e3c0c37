//! Variants of a scene that differ in accuracy and cost: the presets, and the preset `balanced` with one knob changed.
//!
//! A variant is nothing but `--set`: its [`Variant::sets`] are laid over the scene, so that whatever it measures can be had by
//! any run. What the scene itself says about accuracy is left out of them, since that is what is measured; it is measured too,
//! as the variant [`AS_WRITTEN`].

mod values;

use std::path::Path;

use super::keys::{self, Key, contact, cycles, dynamics, fidelity, joint};
use super::{Scene, SceneError, document, resolve};
use crate::recipe::Recipe;

/// The variant that all knobs are turned from.
pub const BALANCED: &str = "balanced";

/// The preset that is to be fast.
pub const FAST: &str = "fast";

/// The variant that the others are held against.
pub const REFERENCE: &str = "reference";

/// The scene with what it says about accuracy itself.
pub const AS_WRITTEN: &str = "as_written";

/// `balanced` once more: what its seconds differ by is noise.
pub const AGAIN: &str = "balanced_again";

/// What a knob is about, which decides what its errors mean.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KnobKind {
    /// A set of defaults, or the scene's own.
    Preset,
    /// How exactly the equations of the scene are solved.
    Solver,
    /// Which equations stand for the continuous ones: results that depend on it are not converged.
    Discretisation,
    /// What is modelled: its differences are no errors.
    Model,
    /// None: the same run once more.
    Repeat,
}

/// One knob.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knob {
    /// Short name: the last part of the key.
    pub name: &'static str,
    /// The key of a scene.
    pub key: &'static str,
    /// What it is about.
    pub kind: KnobKind,
}

const fn knob<V>(key: &Key<V>, kind: KnobKind) -> Knob {
    let (key, mut dot) = (key.name, 0);
    while key.as_bytes()[dot] != b'.' {
        dot += 1;
    }
    let name = key.split_at(dot + 1).1;
    Knob { name, key, kind }
}

/// All knobs, in the order in which they are tried.
pub const KNOBS: [Knob; 16] = [
    knob(&fidelity::PRESET, KnobKind::Preset),
    knob(&fidelity::ASKED, KnobKind::Solver),
    knob(&fidelity::NORMAL_TOLERANCE, KnobKind::Solver),
    knob(&fidelity::TANGENTIAL_TOLERANCE, KnobKind::Solver),
    knob(&fidelity::CYCLE_TOLERANCE, KnobKind::Solver),
    knob(&fidelity::CYCLE, KnobKind::Solver),
    knob(&fidelity::STEPS_PER_CYCLE, KnobKind::Discretisation),
    knob(&fidelity::LOAD_STEPS, KnobKind::Solver),
    knob(&fidelity::WEAR_TOLERANCE, KnobKind::Solver),
    knob(&cycles::SCHEME, KnobKind::Solver),
    knob(&fidelity::AFT_SAMPLES, KnobKind::Solver),
    knob(&fidelity::HARMONIC_TOLERANCE, KnobKind::Solver),
    knob(&dynamics::HARMONICS, KnobKind::Discretisation),
    knob(&dynamics::MODES, KnobKind::Discretisation),
    knob(&joint::ELEMENTS, KnobKind::Discretisation),
    knob(&joint::GRID, KnobKind::Discretisation),
];

/// The knob that changes the model; not an accuracy, and tried all the same.
pub const STIFFNESS: Knob = knob(&contact::STIFFNESS, KnobKind::Model);

/// A scene as it is run once.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Name, which is fit for a folder.
    pub name: String,
    /// Short name of the knob; `scene` for [`AS_WRITTEN`].
    pub knob: &'static str,
    /// What the knob is about.
    pub kind: KnobKind,
    /// What it is set to.
    pub value: String,
    /// How fine it is: cells, harmonics, modes, steps, samples, or 1 over a tolerance; 0 where nothing is finer than another.
    pub size: f64,
    /// `key=value`, as after `--set`.
    pub sets: Vec<String>,
}

/// What is not tried, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedVariant {
    /// Knob, or knob and value.
    pub what: String,
    /// The reason.
    pub reason: String,
}

/// What is wanted of the variants.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Choice {
    /// Knobs, by short name or key; empty: all of them.
    pub knobs: Vec<String>,
    /// The preset `paper` too.
    pub paper: bool,
    /// Most cells along the longer side of a grid; none: twice those of the scene.
    pub largest_grid: Option<usize>,
}

/// A name that is no knob.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{name}\" is no knob; the knobs are {known}")]
pub struct UnknownKnob {
    /// The name.
    pub name: String,
    /// Those there are.
    pub known: String,
}

/// The variants of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Variants {
    /// What is to be run: the presets first.
    pub variants: Vec<Variant>,
    /// What `balanced` has in place of each knob that is finer or coarser: knob, value, size.
    pub base: Vec<(&'static str, String, f64)>,
    /// What does not apply.
    pub left_out: Vec<SkippedVariant>,
}

/// Keys of a scene that say how exact it is, beside those of the preset; grids of space stay as they are, and a
/// grid of time that the scene gives.
fn accuracy_keys() -> impl Iterator<Item = (&'static str, &'static str)> {
    let own = keys::children("fidelity")
        .into_iter()
        .filter(|name| *name != fidelity::STEPS_PER_CYCLE.last())
        .map(|name| ("fidelity", name));
    own.chain(["scheme", "depth_step", "tolerance"].map(|name| ("wear", name)))
}

/// Reads a scene as [`super::load`] does, as one of its variants.
///
/// # Errors
/// As for [`super::load`], where the scene does not allow the variant.
pub fn load(path: &Path, sets: &[String], variant: &Variant) -> Result<Scene, SceneError> {
    let all: Vec<String> = sets.iter().chain(&variant.sets).cloned().collect();
    let mut tree = document::read(path, &all)?;
    if variant.name != AS_WRITTEN {
        let set = |key: &str| {
            let own = |set: &String| set.split('=').next().unwrap_or_default().trim() == key;
            variant.sets.iter().any(own)
        };
        for (section, name) in accuracy_keys() {
            if !set(&keys::join(section, name)) {
                tree.remove(section, name);
            }
        }
    }
    resolve::scene(&tree, super::name_of(path))
}

/// The preset that all knobs are turned from.
pub fn balanced() -> Variant {
    preset(BALANCED)
}

/// The preset `balanced` once more, with the same results in other seconds.
pub fn again() -> Variant {
    Variant {
        name: AGAIN.to_owned(),
        knob: "repeat",
        kind: KnobKind::Repeat,
        value: "balanced, again".to_owned(),
        ..balanced()
    }
}

/// The presets that are held against each other over many scenes.
pub fn presets() -> [Variant; 3] {
    [FAST, BALANCED, REFERENCE].map(preset)
}

fn preset(name: &str) -> Variant {
    Variant {
        name: name.to_owned(),
        knob: KNOBS[0].name,
        kind: KnobKind::Preset,
        value: name.to_owned(),
        size: 0.0,
        sets: vec![format!("{}={name}", KNOBS[0].key), KEEP.to_owned()],
    }
}

/// The seconds of an iteration lie in its own tables.
const KEEP: &str = "output.keep=all";

/// The variants of a scene: `written` as it is written, `scene` and its `recipe` as [`balanced`].
///
/// A variant of them may still be refused by the scene or by the plan.
///
/// # Errors
/// [`UnknownKnob`]
pub fn variants(
    written: &Scene,
    scene: &Scene,
    recipe: &Recipe,
    choice: &Choice,
) -> Result<Variants, UnknownKnob> {
    let knobs = chosen(&choice.knobs)?;
    let mut made = Variants {
        variants: vec![balanced(), preset(REFERENCE)],
        ..Variants::default()
    };
    for knob in knobs {
        let values = match knob.name {
            "preset" => {
                made.presets(written, scene, choice);
                continue;
            }
            _ => values::values(knob, written, scene, recipe, choice),
        };
        match values {
            Err(reason) => made.left_out.push(SkippedVariant {
                what: knob.name.to_owned(),
                reason: reason.to_owned(),
            }),
            Ok(values) => {
                if let Some((value, size)) = values.base {
                    made.base.push((knob.name, value, size));
                }
                for (value, size, more) in values.tried {
                    made.add(knob, value, size, more);
                }
            }
        }
    }
    Ok(made)
}

fn chosen(names: &[String]) -> Result<Vec<Knob>, UnknownKnob> {
    let all = KNOBS.into_iter().chain([STIFFNESS]);
    if names.is_empty() {
        return Ok(all.collect());
    }
    let is = |knob: &Knob, name: &str| knob.name == name || knob.key == name;
    for name in names {
        if !all.clone().any(|knob| is(&knob, name)) {
            return Err(UnknownKnob {
                name: name.clone(),
                known: all.map(|knob| knob.name).collect::<Vec<_>>().join(", "),
            });
        }
    }
    Ok(all
        .filter(|knob| names.iter().any(|name| is(knob, name)))
        .collect())
}

impl Variants {
    fn add(&mut self, knob: Knob, value: String, size: f64, more: Vec<String>) {
        let mut variant = preset(BALANCED);
        variant.name = folder(knob.name, &value);
        variant.knob = knob.name;
        variant.kind = knob.kind;
        if knob.key == fidelity::ASKED.name {
            // It takes the place of the preset.
            variant.sets.retain(|set| !set.starts_with(KNOBS[0].key));
        }
        variant.sets.extend(if more.is_empty() {
            vec![format!("{}={value}", knob.key)]
        } else {
            more
        });
        variant.value = value;
        variant.size = size;
        self.variants.push(variant);
    }

    fn presets(&mut self, written: &Scene, scene: &Scene, choice: &Choice) {
        self.variants.push(preset(FAST));
        if choice.paper {
            let mut paper = preset("paper");
            paper
                .sets
                .extend(values::own_depth(written).map(values::depth));
            self.variants.push(paper);
        } else {
            self.left_out.push(SkippedVariant {
                what: "preset = paper".to_owned(),
                reason: "it is slow; --paper runs it too".to_owned(),
            });
        }
        let accuracy =
            |scene: &Scene| ["fidelity", "wear"].map(|part| scene.canonical[part].clone());
        if accuracy(written) != accuracy(scene) {
            self.variants.push(Variant {
                name: AS_WRITTEN.to_owned(),
                knob: "scene",
                kind: KnobKind::Preset,
                value: "as written".to_owned(),
                size: 0.0,
                sets: vec![KEEP.to_owned()],
            });
        }
    }
}

/// A name that is one on every file system, and no `name=value` that readers take for a column.
fn folder(knob: &str, value: &str) -> String {
    let mut name = knob.to_owned();
    let mut gap = true;
    for c in value.chars() {
        if c.is_ascii_alphanumeric() || "._".contains(c) || (c == '-' && !gap) {
            if gap {
                name.push('-');
            }
            name.push(c);
            gap = false;
        } else {
            gap = true;
        }
    }
    name
}

/// What a preset promises of the figures of merit against `reference`, if it promises anything.
pub fn promise(preset: &str) -> Option<f64> {
    match preset {
        BALANCED => Some(0.01),
        FAST => Some(0.05),
        _ => None,
    }
}
