//! The keys of a scene, each declared once: name, type, range, example, default, meaning, and the kinds of its section that have
//! it. What is read and refused, what people are told of a key, and what an editor knows come from here.

pub mod contact;
pub mod cycles;
pub mod dynamics;
pub mod fidelity;
pub mod joint;
pub mod output;
pub mod structure;
pub mod surface;
mod value;
mod word;

use std::fmt;

use super::Preset;
use super::error::SceneError;
pub use value::{EvenInteger, Form, GivenValue, List, Quantity, Value, as_toml, meant};
pub use word::{Choice, ListOrPath, Point, Tables};

/// A key, and the type of its value.
pub struct Key<V: ?Sized> {
    /// Dotted, from the top of the document.
    pub name: &'static str,
    /// What it means; the first sentence alone says it in short.
    doc: &'static str,
    pub default: Default,
    /// The kinds of its section, or forms of it that have no key for their kind, that have it; none: all.
    pub kinds: &'static [&'static str],
    /// Sections without all of which it means nothing, also where a scene has its default.
    pub with: &'static [&'static str],
    pub value: V,
}

/// A key whose value may be of any type.
pub type AnyKey = Key<dyn HasForm>;

/// Whatever has a form.
pub trait HasForm {
    fn value_form(&self) -> Form;

    /// Refuses what is not of its type or out of its range.
    fn check(&self, given: &GivenValue<'_>) -> Result<(), SceneError>;

    /// Whether what is given is the path of a file.
    fn names_file(&self, given: &GivenValue<'_>) -> bool;
}

impl<V: Value> HasForm for V {
    fn value_form(&self) -> Form {
        self.form()
    }

    fn check(&self, given: &GivenValue<'_>) -> Result<(), SceneError> {
        self.read(given).map(drop)
    }

    fn names_file(&self, given: &GivenValue<'_>) -> bool {
        Value::names_file(self, given)
    }
}

impl<V: HasForm + ?Sized> Key<V> {
    /// A line of its section that would do.
    pub fn line(&self) -> String {
        format!(
            "{} = {}",
            self.last(),
            as_toml(self.value.value_form().example)
        )
    }
}

impl<V: ?Sized> Key<V> {
    /// The last part of the name.
    pub fn last(&self) -> &'static str {
        self.name.rsplit('.').next().unwrap_or(self.name)
    }

    /// The lines of the declaration as one.
    pub fn doc(&self) -> String {
        let lines: Vec<&str> = self.doc.lines().map(str::trim).collect();
        lines.join(" ")
    }
}

/// What a key is where a scene does not give it. Values are as after `--set`.
#[derive(Clone, Copy)]
pub enum Default {
    /// Nothing: its section needs it.
    Required,
    /// Nothing: it is not there.
    Absent,
    /// This.
    Is(&'static str),
    /// This, by `fidelity.preset`: paper, fast, balanced, reference.
    ByPreset([&'static str; 4]),
    /// What follows from other keys.
    Rule(&'static str),
}

impl Default {
    /// The value, if it does not depend on other keys than the preset.
    pub fn of(&self, preset: Preset) -> Option<&'static str> {
        match self {
            Default::Is(value) => Some(value),
            Default::ByPreset(values) => {
                Some(values[preset as usize]).filter(|value| *value != "none")
            }
            _ => None,
        }
    }
}

impl fmt::Display for Default {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Default::Required => f.write_str("must be given"),
            Default::Absent => f.write_str("none"),
            Default::Is(value) => f.write_str(&as_toml(value)),
            Default::ByPreset(values) => {
                f.write_str("by preset")?;
                let named = ["paper", "fast", "balanced", "reference"];
                let pairs: Vec<(&str, &str)> = named.into_iter().zip(*values).collect();
                for (at, group) in pairs.chunk_by(|a, b| a.1 == b.1).enumerate() {
                    let names: Vec<&str> = group.iter().map(|pair| pair.0).collect();
                    let value = match group[0].1 {
                        "none" => "none".to_owned(),
                        value => as_toml(value),
                    };
                    let mark = if at == 0 { ":" } else { ";" };
                    write!(f, "{mark} {} {value}", names.join(", "))?;
                }
                Ok(())
            }
            Default::Rule(rule) => f.write_str(rule),
        }
    }
}

/// Sections that are no keys themselves with what they say, and keys.
type Declared = (
    &'static [(&'static str, &'static str)],
    &'static [&'static AnyKey],
);

/// Declares sections and keys, and lists them as `DECLARED`.
macro_rules! keys {
    (
        $(section $section:literal: $about:literal;)*
        $($(#[doc = $doc:literal])+ $name:ident: $type:ty = $key:literal, $default:expr, $value:expr $(, of [$($kind:literal),+])? $(, with [$($with:literal),+])?;)+
    ) => {
        $($(#[doc = $doc])+ pub const $name: $crate::scene::keys::Key<$type> = $crate::scene::keys::Key {
            name: $key,
            doc: concat!($($doc, "\n"),+),
            default: $default,
            kinds: &[$($($kind),+)?],
            with: &[$($($with),+)?],
            value: $value,
        };)+

        pub const DECLARED: $crate::scene::keys::Declared = (&[$(($section, $about)),*], &[$(&$name),+]);
    };
}
use keys;

/// All of them, in the order in which people are told of them. A table that is itself a key may also be written as a plain value.
const DECLARED: [Declared; 8] = [
    joint::DECLARED,
    surface::DECLARED,
    contact::DECLARED,
    structure::DECLARED,
    dynamics::DECLARED,
    cycles::DECLARED,
    fidelity::DECLARED,
    output::DECLARED,
];

/// Lines of a section that would do.
pub fn lines(keys: &[&AnyKey]) -> String {
    let lines: Vec<String> = keys.iter().map(|key| key.line()).collect();
    lines.join("\n")
}

/// Every key of a scene.
pub fn all() -> impl Iterator<Item = &'static AnyKey> {
    DECLARED.iter().flat_map(|declared| declared.1).copied()
}

/// Every key of a file that holds a scene, or a part of one.
pub fn of_files() -> impl Iterator<Item = &'static AnyKey> {
    joint::file::DECLARED.1.iter().copied().chain(all())
}

/// The key of a name.
pub fn find(name: &str) -> Option<&'static AnyKey> {
    all().find(|key| key.name == name)
}

/// Keys that another form of their section has with a wider range, which people are not told of apart.
const WIDER: [&AnyKey; 1] = [&contact::LOAD_AT_REST];

/// Refuses what no key of this name can be.
pub fn check(given: &GivenValue<'_>) -> Result<(), SceneError> {
    let declared = all().chain(WIDER).filter(|key| key.name == given.key);
    let mut checks = declared.map(|key| key.value.check(given));
    let first = checks.next().unwrap_or(Ok(()));
    match first.is_err() && checks.any(|check| check.is_ok()) {
        true => Ok(()),
        false => first,
    }
}

/// What a section says that is no key itself.
pub fn about_section(name: &str) -> Option<&'static str> {
    let mut sections = DECLARED.iter().flat_map(|declared| declared.0);
    sections
        .find(|section| section.0 == name)
        .map(|section| section.1)
}

/// The forms of sections that have no key for their kind.
pub const FORMS: &[(&str, &str, &str)] = &[
    ("contact", "rough", "where there is a [surface]"),
    (
        "contact",
        "given",
        "where kn and kt take the place of a [surface]",
    ),
    ("motion", "harmonic", "without history"),
];

/// The sections that have a `kind`.
pub fn with_kinds() -> impl Iterator<Item = &'static str> {
    all().filter_map(|key| key.name.strip_suffix(".kind"))
}

/// The kinds of a section; none of one without `kind`.
pub fn kinds(section: &str) -> Vec<&'static str> {
    let key = find(&join(section, "kind"));
    let choices = key.map_or_else(Vec::new, |key| key.value.value_form().choices);
    choices.into_iter().map(|choice| choice.0).collect()
}

/// The names of the keys, and of the sections below, that a kind of a section, or a form of it, has for itself.
pub fn keys_of_kind(section: &str, kind: &str) -> Vec<&'static str> {
    let of_kind = all().filter(|key| key.kinds.contains(&kind));
    let mut names: Vec<&str> = of_kind
        .filter_map(|key| key.name.strip_prefix(section)?.strip_prefix('.'))
        .filter_map(|rest| rest.split('.').next())
        .collect();
    names.dedup();
    names
}

/// The section of a key.
pub fn section_of(key: &str) -> &str {
    key.rsplit_once('.').map_or("", |split| split.0)
}

/// Keys of one section of which a scene gives one: setting one drops the others.
pub const ALTERNATIVES: &[(&str, &[&[&str]])] = &[
    (
        "motion",
        &[
            &["history"],
            &[
                "amplitude",
                "phase",
                "normal_load_amplitude",
                "force",
                "rotation",
                "moment",
            ],
        ],
    ),
    ("contact", &[&["normal_load"], &["approach"]]),
    ("motion", &[&["force"], &["amplitude"], &["history"]]),
    ("motion", &[&["rotation"], &["moment"], &["history"]]),
    ("dynamics.base", &[&["acceleration"], &["displacement"]]),
    ("structure", &[&["file"], &["stiffness"]]),
    ("structure", &[&["file"], &["mass"]]),
    (
        "update",
        &[&["stiffness_change"], &["iterations"], &["wear_volume"]],
    ),
];

/// A section, a key of it, and the word that makes another key of it meaningless: setting the word drops the other key.
pub const DROPPED_BY: &[(&str, &str, &str, &str)] = &[
    ("contact", "stiffness", "tangent", "distribution"),
    ("contact", "stiffness", "sliders", "distribution"),
    ("contact", "rotation", "fixed", "moment"),
];

/// Names that a resonator's drawing has, and the keys that give them.
const ELSEWHERE: &[(&str, &str)] = &[
    ("structure.lap_length", "joint.size"),
    ("structure.arm_height", "joint.size"),
    ("structure.lap_cells", "joint.elements"),
    ("structure.material", "material"),
    ("contact.mu", "contact.friction_coefficient"),
    ("contact.load", "contact.normal_load"),
    ("contact.cof", "contact.friction_coefficient"),
    ("friction", "contact.friction_coefficient"),
    ("surface.roughness", "surface.rq"),
    ("wear.alpha", "wear.coefficient"),
    ("wear.k", "wear.coefficient"),
    ("dynamics.amplitude", "dynamics.force.amplitude"),
];

/// Words less alike than this are not suggested: at 0.6 `frq` still finds `rq` and `bolt` finds nothing.
const LIKENESS: f64 = 0.6;

/// The word most like `word`, if any is like it at all.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let length = word.chars().count();
    known
        .into_iter()
        // Two words are at least as unlike as their lengths: a long one is not compared letter by letter.
        .filter(|candidate| {
            let other = candidate.chars().count();
            length.min(other) as f64 >= LIKENESS * length.max(other) as f64
        })
        .map(|candidate| {
            let likeness = strsim::normalized_damerau_levenshtein(&word, &candidate.to_lowercase());
            (likeness, candidate)
        })
        .filter(|(likeness, _)| *likeness >= LIKENESS)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// What stands directly under a section (`""`: at the top), in the order of the keys.
pub fn children(section: &str) -> Vec<&'static str> {
    let mut names: Vec<&str> = Vec::new();
    for key in all() {
        let below = match section {
            "" => Some(key.name),
            _ => key
                .name
                .strip_prefix(section)
                .and_then(|rest| rest.strip_prefix('.')),
        };
        if let Some(name) = below.and_then(|rest| rest.split('.').next())
            && !names.contains(&name)
        {
            names.push(name);
        }
    }
    names
}

/// Keys that scenes once had, and what to do without them.
const FORMER: [(&str, &str); 2] = [
    (
        "dynamics.method",
        "every forced response is computed by harmonic balance; leave it out",
    ),
    (
        "fidelity.aft_events",
        "contact elements are sampled over the cycle; leave it out, or say with fidelity.aft_samples how often",
    ),
];

/// What to do without a key that scenes once had; none of another one.
pub fn replacement_of_former(key: &str) -> Option<&'static str> {
    let mut former = FORMER.iter();
    former.find(|entry| entry.0 == key).map(|entry| entry.1)
}

/// The known key that an unknown one was probably meant to be: in its own section, else of the same name elsewhere, else alike elsewhere.
pub fn nearest_key(key: &str) -> Option<String> {
    if let Some((_, given)) = ELSEWHERE.iter().find(|entry| entry.0 == key) {
        return Some((*given).to_owned());
    }
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    if let Some(sibling) = nearest(name, children(section)) {
        return Some(join(section, sibling));
    }
    // `friction` is not spelt like friction_coefficient, but begins it.
    let mut longer = children(section)
        .into_iter()
        .filter(|of| of.starts_with(name));
    if let (Some(sibling), None) = (longer.next(), longer.next()) {
        return Some(join(section, sibling));
    }
    // A table such as joint.hole has a few keys of its own: one of that name elsewhere is not what was meant.
    if section.contains('.') {
        return None;
    }
    let named = |name: &str| all().find(|known| known.last() == name);
    named(name)
        .or_else(|| named(nearest(name, all().map(Key::last))?))
        .map(|known| known.name.to_owned())
}

/// A dotted key from its section and its name.
pub fn join(section: &str, name: &str) -> String {
    if section.is_empty() {
        name.to_owned()
    } else {
        format!("{section}.{name}")
    }
}
