//! Variants of a scene that differ in accuracy and cost: the presets, and the preset `balanced` with one knob changed.
//!
//! A variant consists only of `--set` options: [`Variant::sets`] are laid over the scene, so any run can reproduce it.
//! The function [`load`] replaces the accuracy settings of the scene by the accuracy settings of the variant. The
//! variant [`AS_WRITTEN`] keeps the accuracy settings of the scene.

mod values;

use std::path::Path;

use super::keys::{self, Key, contact, cycles, dynamics, fidelity, joint};
use super::{Scene, SceneError, document, resolve};
use crate::recipe::Recipe;

/// The variant from which single knobs are changed.
pub const BALANCED: &str = "balanced";

/// The fast preset.
pub const FAST: &str = "fast";

/// The variant with which the others are compared.
pub const REFERENCE: &str = "reference";

/// Name of the variant that keeps the accuracy settings of the scene.
pub const AS_WRITTEN: &str = "as_written";

/// A repetition of `balanced`: the difference in run time is noise.
pub const AGAIN: &str = "balanced_again";

/// Kind of a knob, which decides the meaning of its errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum KnobKind {
    /// A set of defaults, or the scene's own settings.
    Preset,
    /// Accuracy of solving the equations of the scene.
    Solver,
    /// Discretisation of the continuous equations: results that depend on it are not converged.
    Discretisation,
    /// Choice of the model: differences between the results of two models are not errors.
    Model,
    /// No knob: the same run again.
    Repeat,
}

/// Setting that variants change.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Knob {
    /// Short name: the last part of the key.
    pub name: &'static str,
    /// The key of a scene.
    pub key: &'static str,
    /// The kind.
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

/// The knob that changes the model. The variants include the knob `contact.stiffness`, although the contact stiffness
/// is not an accuracy setting.
pub const STIFFNESS: Knob = knob(&contact::STIFFNESS, KnobKind::Model);

/// One run of a scene with changed settings.
#[derive(Debug, Clone, PartialEq)]
pub struct Variant {
    /// Name, usable as a folder name.
    pub name: String,
    /// Short name of the knob; `scene` for [`AS_WRITTEN`].
    pub knob: &'static str,
    /// Kind of the knob.
    pub kind: KnobKind,
    /// Value of the knob.
    pub value: String,
    /// Measure of fineness: a number of cells, harmonics, modes, steps or samples, or 1 divided by a tolerance. The
    /// measure is 0 if the values have no order.
    pub size: f64,
    /// Options of the variant as `key=value`, in the form after `--set`.
    pub sets: Vec<String>,
}

/// Variant that is skipped, with the reason.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SkippedVariant {
    /// Knob, or knob and value.
    pub what: String,
    /// The reason.
    pub reason: String,
}

/// Selection of variants.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Choice {
    /// Knobs, by short name or key; empty for all.
    pub knobs: Vec<String>,
    /// True to include the preset `paper`.
    pub paper: bool,
    /// Most cells along the longer side of a grid; `None` for twice the cells of the scene.
    pub largest_grid: Option<usize>,
}

/// Error for an unknown knob.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("\"{name}\" is no knob; the knobs are {known}")]
pub struct UnknownKnob {
    /// The name.
    pub name: String,
    /// The known knobs.
    pub known: String,
}

/// The variants of a scene.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Variants {
    /// The variants to run, presets first.
    pub variants: Vec<Variant>,
    /// Values of `balanced` for the knobs that can be finer or coarser: knob, value, size.
    pub base: Vec<(&'static str, String, f64)>,
    /// Variants that do not apply.
    pub skipped: Vec<SkippedVariant>,
}

/// Lists the keys of accuracy, as section and name. The list omits the keys of spatial grids and the key of the number
/// of time steps.
fn accuracy_keys() -> impl Iterator<Item = (&'static str, &'static str)> {
    let own = keys::children("fidelity")
        .into_iter()
        .filter(|name| *name != fidelity::STEPS_PER_CYCLE.last())
        .map(|name| ("fidelity", name));
    own.chain(["scheme", "depth_step", "tolerance"].map(|name| ("wear", name)))
}

/// Reads a scene like [`super::load`], with the settings of a variant.
///
/// # Errors
/// Returns the errors of [`super::load`], and an error if the scene does not allow the variant.
pub fn load(path: &Path, sets: &[String], variant: &Variant) -> Result<Scene, SceneError> {
    let all: Vec<String> = sets.iter().chain(&variant.sets).cloned().collect();
    let mut tree = document::read(path, &all)?;
    if variant.name != AS_WRITTEN {
        let is_set = |key: &str| {
            let own = |is_set: &String| is_set.split('=').next().unwrap_or_default().trim() == key;
            variant.sets.iter().any(own)
        };
        for (section, name) in accuracy_keys() {
            if !is_set(&keys::join(section, name)) {
                tree.remove(section, name);
            }
        }
    }
    resolve::scene(&tree, super::name_of(path))
}

/// Returns the preset from which single knobs are changed.
pub fn balanced() -> Variant {
    preset(BALANCED)
}

/// Returns a repetition of `balanced`, with the same results and another run time.
pub fn again() -> Variant {
    Variant {
        name: AGAIN.to_owned(),
        knob: "repeat",
        kind: KnobKind::Repeat,
        value: "balanced, again".to_owned(),
        ..balanced()
    }
}

/// Returns the presets for the comparison over many scenes.
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

/// The run time of an iteration is stored in its own tables, so all iterations are kept.
const KEEP: &str = "output.keep=all";

/// Lists the variants of a scene. `source_text` is the scene as written; `scene` and `recipe` belong to [`balanced`].
///
/// The scene or the plan may still reject a variant.
///
/// # Errors
/// [`UnknownKnob`] for an unknown name.
pub fn variants(
    written: &Scene,
    scene: &Scene,
    recipe: &Recipe,
    choice: &Choice,
) -> Result<Variants, UnknownKnob> {
    let knobs = chosen(&choice.knobs)?;
    let mut variants = Variants {
        variants: vec![balanced(), preset(REFERENCE)],
        ..Variants::default()
    };
    for knob in knobs {
        let values = match knob.name {
            "preset" => {
                variants.presets(written, scene, choice);
                continue;
            }
            _ => values::values(knob, written, scene, recipe, choice),
        };
        match values {
            Err(reason) => variants.skipped.push(SkippedVariant {
                what: knob.name.to_owned(),
                reason: reason.to_owned(),
            }),
            Ok(values) => {
                if let Some((value, size)) = values.base {
                    variants.base.push((knob.name, value, size));
                }
                for (value, size, more) in values.tried {
                    variants.add(knob, value, size, more);
                }
            }
        }
    }
    Ok(variants)
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
            // The tolerance replaces the preset.
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
            self.skipped.push(SkippedVariant {
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

/// Returns a folder name that is valid on every file system. The name does not look like `name=value`, because readers
/// of tables read a column from a name like `name=value`.
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

/// Returns the error that a preset promises for the figures of merit against `reference`, if it promises one.
pub fn promise(preset: &str) -> Option<f64> {
    match preset {
        BALANCED => Some(0.01),
        FAST => Some(0.05),
        _ => None,
    }
}
