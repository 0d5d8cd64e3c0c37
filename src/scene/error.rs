//! Errors in a scene.

use std::fmt;
use std::path::PathBuf;

use crate::units::UnitError;

/// Place where a key was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a file.
    File {
        /// The file.
        path: PathBuf,
        /// Line of the key, counted from 1; `None` for the file as a whole.
        line: Option<usize>,
    },
    /// On the command line, with the text after `--set`.
    Set(String),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::File { path, line: None } => write!(f, "{}", path.display()),
            Place::File {
                path,
                line: Some(line),
            } => write!(f, "{}, line {line}", path.display()),
            Place::Set(text) => write!(f, "--set {text}"),
        }
    }
}

/// Error of an unusable scene: the first fault of the scene, the place of the first fault, and all further faults.
#[derive(Debug, thiserror::Error)]
#[error("{place}: {problem}{}", others(.also))]
pub struct SceneError {
    /// Place of the fault.
    pub place: Place,
    /// The fault, boxed to keep results small.
    pub problem: Box<Problem>,
    /// Further faults of the scene, in the order of their lines. The field `also` of each further fault is empty.
    pub also: Vec<SceneError>,
}

impl SceneError {
    pub(super) fn new(place: &Place, problem: Problem) -> Self {
        SceneError {
            place: place.clone(),
            problem: Box::new(problem),
            also: Vec::new(),
        }
    }

    /// Returns all faults separately.
    pub fn into_each(mut self) -> impl Iterator<Item = SceneError> {
        let also = std::mem::take(&mut self.also);
        std::iter::once(self).chain(also)
    }
}

/// Fault of a scene. Keys are dotted, from the top of the document. Values are shown as written.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file named by `base` cannot be read.
    #[error("base = \"{base}\": {} cannot be read: {source}; base is a path relative to this file", path.display())]
    Base {
        /// Path as written.
        base: String,
        /// Path as resolved.
        path: PathBuf,
        /// The error of the system.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("is not valid TOML: {0}")]
    Syntax(String),
    /// The chain of `base` files contains a cycle.
    #[error("the base files form a cycle: {}", chain.join(" -> "))]
    BaseCycle {
        /// The files, the first one repeated at the end.
        chain: Vec<String>,
    },
    /// A `--set` that is not `key=value`.
    #[error("is not key=value with a dotted key, such as --set wear.cycles=1e6")]
    SetSyntax,
    /// A `--set` whose dotted key has more names than the limit.
    #[error(
        "has a key of {names} names; use at most {limit}, as in --set joint.hole.diameter=\"11 mm\""
    )]
    SetDepth {
        /// Number of names in the key.
        names: usize,
        /// Largest allowed number of names.
        limit: usize,
    },
    /// `base` in the scene that a run stores.
    #[error(
        "the scene.toml of a run is complete and must not have a base; remove the line, or run the original scene file"
    )]
    KeptBase,
    /// `base` on the command line.
    #[error("base cannot be set; write it in a file: base = \"other.toml\"")]
    SetBase,
    /// A path that TOML cannot represent.
    #[error("{key} = {value}: the path {} is not valid UTF-8; move the file", path.display())]
    PathEncoding {
        /// The key.
        key: String,
        /// Path as written.
        value: String,
        /// Path as resolved.
        path: PathBuf,
    },
    /// An unknown key.
    #[error("{key} = {value}: there is no such key{}", suggestion(.nearest, .siblings))]
    UnknownKey {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The most similar known key.
        nearest: Option<String>,
        /// The known keys of the section that contains the unknown key.
        siblings: Vec<String>,
    },
    /// A key of former versions.
    #[error("{key} = {value}: there is no such key any more: {instead}")]
    FormerKey {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The replacement.
        instead: &'static str,
    },
    /// A key that belongs to another kind of its section.
    #[error(
        "{key} = {value} does not belong to {kind_key} = \"{kind}\", whose keys are: {}",
        listed(.keys)
    )]
    OtherKind {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The key that gives the kind.
        kind_key: String,
        /// The chosen kind.
        kind: String,
        /// The keys of that kind.
        keys: Vec<String>,
    },
    /// A key or value that the program does not support yet.
    #[error("{key} is not available in this version: {instead}")]
    Unavailable {
        /// The unsupported key. If only a value of the key is unsupported, the text contains key and value.
        key: String,
        /// The alternative.
        instead: &'static str,
    },
    /// A missing required key.
    #[error("{key} is missing; add to [{section}]: {example}")]
    Missing {
        /// The key.
        key: String,
        /// The section of the missing key.
        section: String,
        /// An example line that gives the missing key.
        example: String,
    },
    /// A missing required section.
    #[error("section [{section}] is missing ({purpose}); add for example:\n{example}")]
    MissingSection {
        /// The section.
        section: &'static str,
        /// The purpose of the section.
        purpose: &'static str,
        /// Example lines that give the missing section.
        example: String,
    },
    /// A value of the wrong type.
    #[error("{key} = {value}: must be {expected}")]
    Type {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The expected type.
        expected: String,
    },
    /// A text that is not a valid quantity.
    #[error("{key}: {source}")]
    Quantity {
        /// The key.
        key: String,
        /// The error of the text, which it quotes.
        source: UnitError,
    },
    /// A text that is not a valid unit.
    #[error("{key} = \"{value}\": must be the unit of {} alone, such as \"{}\" ({})", .source.expected, .source.expected.units().first().unwrap_or(&"m"), .source.problem)]
    Unit {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The error of the unit.
        source: UnitError,
    },
    /// A value outside the range of the key.
    #[error("{key} = {value}: must be {expected}")]
    Range {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The expected range.
        expected: String,
    },
    /// A word that is not one of the choices.
    #[error(
        "{key} = {value}: must be one of {}{}",
        quoted(.choices),
        did_you_mean(.nearest)
    )]
    Choice {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The choices.
        choices: Vec<&'static str>,
        /// The most similar choice.
        nearest: Option<&'static str>,
    },
    /// A section that contradicts another one.
    #[error("section [{section}]: {reason}")]
    Misplaced {
        /// The section.
        section: &'static str,
        /// The contradiction, and a correct alternative.
        reason: String,
    },
    /// Two keys that contradict each other.
    #[error("{key} = {value}: {reason}")]
    Conflict {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The contradiction, and a correct alternative.
        reason: String,
    },
}

impl Problem {
    /// Returns the key of the fault, and its value as written. The key is `None` if the fault concerns a whole file;
    /// the value is `None` if the key is missing.
    pub fn key_and_value(&self) -> (Option<&str>, Option<&str>) {
        match self {
            Problem::Read(_)
            | Problem::Syntax(_)
            | Problem::BaseCycle { .. }
            | Problem::SetSyntax
            | Problem::SetDepth { .. } => (None, None),
            Problem::KeptBase | Problem::SetBase => (Some("base"), None),
            Problem::Base { base, .. } => (Some("base"), Some(base)),
            Problem::MissingSection { section, .. } | Problem::Misplaced { section, .. } => {
                (Some(section), None)
            }
            Problem::Unavailable { key, .. } | Problem::Missing { key, .. } => (Some(key), None),
            Problem::Quantity { key, source } => (Some(key), Some(&source.text)),
            Problem::PathEncoding { key, value, .. }
            | Problem::UnknownKey { key, value, .. }
            | Problem::FormerKey { key, value, .. }
            | Problem::OtherKind { key, value, .. }
            | Problem::Type { key, value, .. }
            | Problem::Unit { key, value, .. }
            | Problem::Range { key, value, .. }
            | Problem::Choice { key, value, .. }
            | Problem::Conflict { key, value, .. } => (Some(key), Some(value)),
        }
    }
}

fn others(also: &[SceneError]) -> String {
    also.iter().map(|fault| format!("\n{fault}")).collect()
}

fn listed(keys: &[String]) -> String {
    if keys.is_empty() {
        "(none)".to_owned()
    } else {
        keys.join(", ")
    }
}

pub(super) fn suggestion(nearest: &Option<String>, siblings: &[String]) -> String {
    match nearest {
        Some(key) => format!("; did you mean {key}?"),
        None => format!("; known here: {}", listed(siblings)),
    }
}

fn quoted(choices: &[&str]) -> String {
    let words: Vec<String> = choices.iter().map(|word| format!("\"{word}\"")).collect();
    words.join(", ")
}

fn did_you_mean(nearest: &Option<&str>) -> String {
    nearest.map_or_else(String::new, |word| format!("; did you mean \"{word}\"?"))
}
