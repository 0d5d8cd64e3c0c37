//! What can be wrong with a scene.

use std::fmt;
use std::path::PathBuf;

use crate::units::UnitError;

/// Where a key was given.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In a file.
    File {
        /// The file.
        path: PathBuf,
        /// The line of the key, counted from 1; none if the place is the file as a whole.
        line: Option<usize>,
    },
    /// On the command line; the text after `--set`.
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

/// A scene that cannot be used: where its first fault is and what it is, and the other ones.
#[derive(Debug, thiserror::Error)]
#[error("{place}: {problem}{}", others(.also))]
pub struct SceneError {
    /// Where it was written.
    pub place: Place,
    /// What is wrong, boxed to keep results small.
    pub problem: Box<Problem>,
    /// What else is wrong with the scene, in the order of its lines; these have none themselves.
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

    /// All faults, each alone.
    pub fn into_each(mut self) -> impl Iterator<Item = SceneError> {
        let also = std::mem::take(&mut self.also);
        std::iter::once(self).chain(also)
    }
}

/// A fault of a scene. Keys are dotted, from the top of the document; values are as written.
#[derive(Debug, thiserror::Error)]
pub enum Problem {
    /// The file cannot be read.
    #[error("cannot be read: {0}")]
    Read(#[source] std::io::Error),
    /// The file named by `base` cannot be read.
    #[error("base = \"{base}\": {} cannot be read: {source}; base is a path relative to this file", path.display())]
    Base {
        /// As written.
        base: String,
        /// As resolved.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file is not TOML.
    #[error("is not valid TOML: {0}")]
    Syntax(String),
    /// `base` leads back to a file of the chain.
    #[error("base goes round in a circle: {}", chain.join(" -> "))]
    BaseCycle {
        /// The files, the first one repeated at the end.
        chain: Vec<String>,
    },
    /// A `--set` that is not `key=value`.
    #[error("is not key=value with a dotted key, such as --set wear.cycles=1e6")]
    SetSyntax,
    /// A `--set` whose key is longer than any.
    #[error(
        "has a key of {names} names; a key has at most {limit}, such as --set joint.hole.diameter=\"11 mm\""
    )]
    SetDepth {
        /// Names in the key.
        names: usize,
        /// Most names.
        limit: usize,
    },
    /// `base` in the scene that a run keeps.
    #[error(
        "a scene that a run keeps is complete and has no base; remove the line, or run the scene from its own file"
    )]
    KeptBase,
    /// `base` from the command line.
    #[error("base cannot be set; write it in a file: base = \"other.toml\"")]
    SetBase,
    /// A path that TOML cannot hold.
    #[error("{key} = {value}: the path {} is not valid UTF-8; move the file", path.display())]
    PathEncoding {
        /// The key.
        key: String,
        /// As written.
        value: String,
        /// As resolved.
        path: PathBuf,
    },
    /// A key that no scene has.
    #[error("{key} = {value}: there is no such key{}", suggestion(.nearest, .siblings))]
    UnknownKey {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// The known key most like it.
        nearest: Option<String>,
        /// The keys that its section has.
        siblings: Vec<String>,
    },
    /// A key that scenes once had.
    #[error("{key} = {value}: there is no such key any more: {instead}")]
    FormerKey {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What to do without it.
        instead: &'static str,
    },
    /// A key of another kind of section.
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
        /// The kind chosen.
        kind: String,
        /// The keys of that kind.
        keys: Vec<String>,
    },
    /// A key or a value that the full program will know and this version does not.
    #[error("{key} is not available in this version: {instead}")]
    Unavailable {
        /// The key, with its value if only the value is not available.
        key: String,
        /// What to do.
        instead: &'static str,
    },
    /// A required key that is not there.
    #[error("{key} is missing; add to [{section}]: {example}")]
    Missing {
        /// The key.
        key: String,
        /// The section it belongs to.
        section: String,
        /// A line that would do.
        example: String,
    },
    /// A required section that is not there.
    #[error("section [{section}] is missing ({purpose}); add for example:\n{example}")]
    MissingSection {
        /// The section.
        section: &'static str,
        /// What it says.
        purpose: &'static str,
        /// Lines that would do.
        example: String,
    },
    /// A value of the wrong type.
    #[error("{key} = {value}: must be {expected}")]
    Type {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// A text that is not the quantity it should be.
    #[error("{key}: {source}")]
    Quantity {
        /// The key.
        key: String,
        /// What is wrong with the text, which it quotes.
        source: UnitError,
    },
    /// A text that is not the unit it should be.
    #[error("{key} = \"{value}\": must be the unit of {} alone, such as \"{}\" ({})", .source.expected, .source.expected.units().first().unwrap_or(&"m"), .source.problem)]
    Unit {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What is wrong with it.
        source: UnitError,
    },
    /// A value out of its range.
    #[error("{key} = {value}: must be {expected}")]
    Range {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What would be right.
        expected: String,
    },
    /// A word that is none of those to choose from.
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
        /// The words to choose from.
        choices: Vec<&'static str>,
        /// The one most like it.
        nearest: Option<&'static str>,
    },
    /// A section that contradicts another one.
    #[error("section [{section}]: {reason}")]
    Misplaced {
        /// The section.
        section: &'static str,
        /// What it contradicts and what would be right.
        reason: String,
    },
    /// Two keys that contradict each other.
    #[error("{key} = {value}: {reason}")]
    Conflict {
        /// The key.
        key: String,
        /// Its value.
        value: String,
        /// What it contradicts and what would be right.
        reason: String,
    },
}

impl Problem {
    /// The key that it is about, and the value as it was written; none of a file as a whole, or of a key that is not there.
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
