//! Declarations of all keys of a scene. A declaration contains the name, type, range, example, default and meaning of
//! the key. A declaration also contains the kinds of section that have the key. The program uses the declarations of
//! keys to read and check scenes, for help and for editor support.

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
pub use value::{EvenInteger, Form, GivenValue, List, Quantity, Value, as_toml, parse_set_value};
pub use word::{Choice, ListOrPath, Point, Tables};

/// Key of a scene, with the type of its value.
pub struct Key<V: ?Sized> {
    /// Dotted name of the key, from the top of the document.
    pub name: &'static str,
    /// Meaning of the key; the first sentence is a summary.
    doc: &'static str,
    pub default: Default,
    /// Kinds of the key's section that have the key, or forms of a section without `kind`; empty for all.
    pub kinds: &'static [&'static str],
    /// Sections that must all be present for the key to have an effect, even if the scene has its default.
    pub with: &'static [&'static str],
    pub value: V,
}

/// Key with a value of any type.
pub type AnyKey = Key<dyn HasForm>;

/// Value type that describes itself and checks values.
pub trait HasForm {
    fn value_form(&self) -> Form;

    /// Rejects a value of the wrong type or out of range.
    fn check(&self, given: &GivenValue<'_>) -> Result<(), SceneError>;

    /// True if the given value is the path of a file.
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
    /// Returns an example line for the section of the key.
    pub fn line(&self) -> String {
        format!(
            "{} = {}",
            self.last(),
            as_toml(self.value.value_form().example)
        )
    }
}

impl<V: ?Sized> Key<V> {
    /// Returns the last part of the name.
    pub fn last(&self) -> &'static str {
        self.name.rsplit('.').next().unwrap_or(self.name)
    }

    /// Returns the meaning as a single line.
    pub fn doc(&self) -> String {
        let lines: Vec<&str> = self.doc.lines().map(str::trim).collect();
        lines.join(" ")
    }
}

/// Default of a key. Values are written as after `--set`.
#[derive(Clone, Copy)]
pub enum Default {
    /// No default: the section of the key requires the key.
    Required,
    /// No default: the key is optional.
    Absent,
    /// The same default value for all presets.
    Is(&'static str),
    /// One default value per `fidelity.preset`: paper, fast, balanced, reference.
    ByPreset([&'static str; 4]),
    /// Default that follows from other keys, as the text says.
    Rule(&'static str),
}

impl Default {
    /// Returns the default value, if the default depends on no other key than the preset.
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

/// Declarations of a file: pairs of section and meaning, then the declared keys. The pairs omit sections that are
/// themselves keys.
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

/// All declarations, in the order of display. A scene may write a key such as `update` as a table or as a plain value.
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

/// Example lines for several keys of a section.
pub fn lines(keys: &[&AnyKey]) -> String {
    let lines: Vec<String> = keys.iter().map(|key| key.line()).collect();
    lines.join("\n")
}

/// Every key of a scene.
pub fn all() -> impl Iterator<Item = &'static AnyKey> {
    DECLARED.iter().flat_map(|declared| declared.1).copied()
}

/// Every key of a scene file, including keys that belong to the file alone.
pub fn structure_from_files() -> impl Iterator<Item = &'static AnyKey> {
    joint::file::DECLARED.1.iter().copied().chain(all())
}

/// Finds the key with a name.
pub fn find(name: &str) -> Option<&'static AnyKey> {
    all().find(|key| key.name == name)
}

/// Keys that have the name of a declared key and a wider range of values, for another form of the section. Help pages
/// do not list the keys in `WIDER`.
const WIDER: [&AnyKey; 1] = [&contact::LOAD_AT_REST];

/// Returns an error if no declared key with the name `given.key` accepts the value.
pub fn check(given: &GivenValue<'_>) -> Result<(), SceneError> {
    let declared = all().chain(WIDER).filter(|key| key.name == given.key);
    let mut checks = declared.map(|key| key.value.check(given));
    let first = checks.next().unwrap_or(Ok(()));
    match first.is_err() && checks.any(|check| check.is_ok()) {
        true => Ok(()),
        false => first,
    }
}

/// Returns the meaning of a section that is not itself a key.
pub fn about_section(name: &str) -> Option<&'static str> {
    let mut sections = DECLARED.iter().flat_map(|declared| declared.0);
    sections
        .find(|section| section.0 == name)
        .map(|section| section.1)
}

/// Forms of sections that have no `kind`: section, form, condition.
pub const FORMS: &[(&str, &str, &str)] = &[
    ("contact", "rough", "with a [surface]"),
    ("contact", "given", "with kn and kt in place of a [surface]"),
    ("motion", "harmonic", "without history"),
];

/// Lists the sections that have a `kind`.
pub fn sections_with_kind() -> impl Iterator<Item = &'static str> {
    all().filter_map(|key| key.name.strip_suffix(".kind"))
}

/// Lists the kinds of a section; empty for a section without `kind`.
pub fn kinds(section: &str) -> Vec<&'static str> {
    let key = find(&join(section, "kind"));
    let choices = key.map_or_else(Vec::new, |key| key.value.value_form().choices);
    choices.into_iter().map(|choice| choice.0).collect()
}

/// Lists the keys and subsections that belong only to the given kind or form of a section.
pub fn keys_of_kind(section: &str, kind: &str) -> Vec<&'static str> {
    let of_kind = all().filter(|key| key.kinds.contains(&kind));
    let mut names: Vec<&str> = of_kind
        .filter_map(|key| key.name.strip_prefix(section)?.strip_prefix('.'))
        .filter_map(|rest| rest.split('.').next())
        .collect();
    names.dedup();
    names
}

/// Returns the section of a key.
pub fn section_of(key: &str) -> &str {
    key.rsplit_once('.').map_or("", |split| split.0)
}

/// Alternative keys of a section. A scene gives one alternative of a section. A `--set` option that gives one
/// alternative removes the other alternatives.
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

/// Tuples of section, key, word and dropped key. Setting the key to the word removes the dropped key, because the word
/// makes the dropped key meaningless.
pub const DROPPED_BY: &[(&str, &str, &str, &str)] = &[
    ("contact", "stiffness", "tangent", "distribution"),
    ("contact", "stiffness", "sliders", "distribution"),
    ("contact", "rotation", "fixed", "moment"),
];

/// Likely names and the keys that they mean: names in the drawing of the resonator and usual abbreviations.
const SYNONYMS: &[(&str, &str)] = &[
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

/// Smallest similarity of a suggestion: at 0.6 `frq` still finds `rq`, and `bolt` finds nothing.
const LIKENESS: f64 = 0.6;

/// Finds the known word that is most similar to `word`, if one is similar enough.
pub fn nearest<'a>(word: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let word = word.to_lowercase();
    let length = word.chars().count();
    known
        .into_iter()
        // Words of very different length cannot be similar enough; skip the comparison letter by letter.
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

/// Lists the keys and subsections directly in a section (`""`: at the top), in the order of the keys.
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

/// Pairs of a key of former versions and the advice that replaces the key.
const FORMER: [(&str, &str); 2] = [
    (
        "dynamics.method",
        "every forced response is computed by harmonic balance; remove the key",
    ),
    (
        "fidelity.aft_events",
        "contact elements are sampled over the cycle; remove the key, or set the number of samples with fidelity.aft_samples",
    ),
];

/// Returns the replacement of a key of former versions, `None` for any other key.
pub fn replacement_of_former(key: &str) -> Option<&'static str> {
    let mut former = FORMER.iter();
    former.find(|entry| entry.0 == key).map(|entry| entry.1)
}

/// Returns the known key that is most similar to an unknown key. The function first searches the section of the unknown
/// key for a similar name. Then the function searches other sections for the same name, and at last for a similar name.
pub fn nearest_key(key: &str) -> Option<String> {
    if let Some((_, given)) = SYNONYMS.iter().find(|entry| entry.0 == key) {
        return Some((*given).to_owned());
    }
    let (section, name) = key.rsplit_once('.').unwrap_or(("", key));
    if let Some(sibling) = nearest(name, children(section)) {
        return Some(join(section, sibling));
    }
    // `friction` is not similar to friction_coefficient, but is the beginning of friction_coefficient.
    let mut longer = children(section)
        .into_iter()
        .filter(|candidate| candidate.starts_with(name));
    if let (Some(sibling), None) = (longer.next(), longer.next()) {
        return Some(join(section, sibling));
    }
    // A nested section such as joint.hole has few keys. If a key in a nested section is unknown, the program does not
    // suggest a key of the same name in another section.
    if section.contains('.') {
        return None;
    }
    let named = |name: &str| all().find(|known| known.last() == name);
    named(name)
        .or_else(|| named(nearest(name, all().map(Key::last))?))
        .map(|known| known.name.to_owned())
}

/// Joins a section and a name to a dotted key.
pub fn join(section: &str, name: &str) -> String {
    if section.is_empty() {
        name.to_owned()
    } else {
        format!("{section}.{name}")
    }
}
