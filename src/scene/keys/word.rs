//! Value types of words, texts and tables.

use std::path::{Path, PathBuf};

use serde::Serialize;
use serde_json::{Value as Json, json};
use toml::Value as Toml;

use super::value::{Form, GivenValue, List, POSITIVE, Quantity, Value, as_toml};
use crate::scene::document::{Content, Node};
use crate::scene::error::{Problem, SceneError};
use crate::units::{self, Dimension};

type Result<T> = std::result::Result<T, SceneError>;

/// True or false.
pub struct Boolean;

impl Value for Boolean {
    type Read = bool;

    fn form(&self) -> Form {
        Form::new("true", "true or false", json!({ "type": "boolean" }))
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<bool> {
        let value = given.value().and_then(Toml::as_bool);
        value.ok_or_else(|| given.wrong_type("true or false"))
    }
}

/// Non-empty text, with an example.
pub struct Text(pub &'static str);

impl Value for Text {
    type Read = String;

    fn form(&self) -> Form {
        let schema = json!({ "type": "string", "pattern": "\\S" });
        Form::new(self.0, "a text", schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<String> {
        let text = given.value().and_then(Toml::as_str);
        let text = text.filter(|text| !text.trim().is_empty());
        let wrong = || given.wrong_type(format!("a text, such as {}", as_toml(self.0)));
        text.map(str::to_owned).ok_or_else(wrong)
    }
}

/// Path of a file, with an example. Reading returns an absolute path.
pub struct FilePath(pub &'static str);

impl Value for FilePath {
    type Read = PathBuf;

    fn form(&self) -> Form {
        Form {
            words: "the path of a file, from the folder of the scene".to_owned(),
            is_path: true,
            ..Text(self.0).form()
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<PathBuf> {
        Text(self.0).read(given).map(PathBuf::from)
    }
}

/// Unit without a number, with an example. Reading returns the value of the unit in SI.
pub struct Unit(pub Dimension, pub &'static str);

impl Value for Unit {
    type Read = f64;

    fn form(&self) -> Form {
        Form {
            words: format!(
                "the unit of {}, or a multiple of a unit, such as \"25.4 mm\" for inches",
                self.0
            ),
            ..Text(self.1).form()
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<f64> {
        let value = Text(self.1).read(given)?;
        units::parse_unit(&value, self.0)
            .map_err(|source| given.fault(|key| Problem::Unit { key, value, source }))
    }
}

/// Choice of words, with the value and the meaning of each word.
pub struct Choice<T: 'static>(pub &'static [(&'static str, T, &'static str)]);

impl<T: Copy + PartialEq> Choice<T> {
    /// Reads the choice, limited to the allowed words.
    pub fn among(&self, given: &GivenValue<'_>, allowed: impl Fn(&str) -> bool) -> Result<T> {
        let choices = || self.0.iter().filter(|choice| allowed(choice.0));
        let word = given.value().and_then(Toml::as_str).unwrap_or_default();
        let chosen = choices().find(|choice| choice.0 == word);
        chosen.map(|choice| choice.1).ok_or_else(|| {
            let words: Vec<&'static str> = choices().map(|choice| choice.0).collect();
            given.fault(|key| Problem::Choice {
                key,
                value: given.node.shown(),
                nearest: super::nearest(word, words.iter().copied()),
                choices: words,
            })
        })
    }
}

impl<T: Copy + PartialEq + Serialize> Value for Choice<T> {
    type Read = T;

    fn form(&self) -> Form {
        let words: Vec<String> = self.0.iter().map(|choice| as_toml(choice.0)).collect();
        let schema: Vec<&str> = self.0.iter().map(|choice| choice.0).collect();
        Form {
            choices: self.0.iter().map(|choice| (choice.0, choice.2)).collect(),
            ..Form::new(self.0[0].0, words.join(", "), json!({ "enum": schema }))
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<T> {
        self.among(given, |_| true)
    }

    /// Returns the word of the choice.
    fn recorded(&self, read: &T) -> Json {
        let word = self.0.iter().find(|choice| choice.1 == *read);
        json!(word.map(|choice| choice.0))
    }
}

/// A single word or a table of keys, with an example of the table.
pub struct WordOrTable(pub &'static str, pub &'static str);

impl Value for WordOrTable {
    type Read = ();

    fn form(&self) -> Form {
        let words = format!("\"{}\" or a table", self.0);
        Form::new(self.1, words, json!({ "const": self.0 }))
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<()> {
        if given.value().and_then(Toml::as_str) == Some(self.0) {
            return Ok(());
        }
        let expected = format!("\"{}\" or a table such as {}", self.0, self.1);
        Err(given.out_of_range(expected))
    }
}

/// Fraction of a quantity, or `never`, with an example.
pub struct PartOrNever(pub &'static str);

/// Word that a key accepts in place of a fraction.
const NEVER: &str = "never";

impl PartOrNever {
    fn part(&self) -> Quantity {
        Quantity(Dimension::NONE, POSITIVE, self.0)
    }
}

impl Value for PartOrNever {
    type Read = Option<f64>;

    fn form(&self) -> Form {
        let part = self.part().form();
        let schema = json!({ "anyOf": [part.schema, { "const": NEVER }] });
        Form::new(self.0, format!("{}, or \"{NEVER}\"", part.words), schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<Option<f64>> {
        if given.value().and_then(Toml::as_str) == Some(NEVER) {
            return Ok(None);
        }
        self.part().read(given).map(Some)
    }

    fn recorded(&self, read: &Option<f64>) -> Json {
        read.map_or_else(|| json!(NEVER), |part| json!(part))
    }
}

/// True, false or a table of keys, with an example of the table.
pub struct BooleanOrTable(pub &'static str);

impl Value for BooleanOrTable {
    type Read = bool;

    fn form(&self) -> Form {
        let words = "true, false or a table";
        Form::new(self.0, words, json!({ "type": "boolean" }))
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<bool> {
        let value = given.value().and_then(Toml::as_bool);
        let expected = || format!("true, false or a table such as {}", self.0);
        value.ok_or_else(|| given.out_of_range(expected()))
    }
}

/// Path of a file or a table of keys, with an example of each. Reading returns the path, or `None` for a table.
pub struct PathOrTable(pub &'static str, pub &'static str);

impl Value for PathOrTable {
    type Read = Option<PathBuf>;

    fn form(&self) -> Form {
        let words = "the path of a file, or a table".to_owned();
        Form {
            words,
            ..FilePath(self.0).form()
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<Option<PathBuf>> {
        if matches!(given.node.content, Content::Section(_)) {
            return Ok(None);
        }
        let expected = || format!("the path of a file, or a table such as {}", self.1);
        FilePath(self.0)
            .read(given)
            .map(Some)
            .map_err(|_| given.wrong_type(expected()))
    }
}

/// Numbers with units for one kind of a section, or the path of a file for another kind. Reading only checks that the
/// value may be numbers or a path.
pub struct ListOrPath<const N: usize>(pub List<N>, pub FilePath);

impl<const N: usize> Value for ListOrPath<N>
where
    [f64; N]: Serialize,
{
    type Read = ();

    fn form(&self) -> Form {
        let (list, path) = (self.0.form(), self.1.form());
        Form {
            words: format!("{}; for matrices {}", list.words, path.words),
            schema: json!({ "anyOf": [list.schema, path.schema] }),
            is_path: true,
            ..list
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<()> {
        // Invalid numbers have an error of their own. Any text may be a path.
        match self.1.read(given) {
            Ok(_) => Ok(()),
            Err(_) => self.0.read(given).map(drop),
        }
    }

    fn names_file(&self, given: &GivenValue<'_>) -> bool {
        let text = given.value().and_then(Toml::as_str).unwrap_or_default();
        self.0.read(given).is_err() && is_like_path(text)
    }
}

/// Returns true if the text does not begin like a number. Also returns true if the text ends like a file name. A number
/// with a wrong unit must be reported as a number.
fn is_like_path(text: &str) -> bool {
    let trimmed = text.trim_start();
    let is_number = trimmed.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && !trimmed.starts_with("./")
        && !trimmed.starts_with("..");
    let extension = Path::new(text).extension().and_then(|e| e.to_str());
    let is_file = |e: &str| {
        e.chars().all(|c| c.is_ascii_alphanumeric()) && e.chars().any(|c| c.is_ascii_alphabetic())
    };
    !is_number || extension.is_some_and(is_file)
}

/// Point of a structure: one of a few words with their meanings, or a node or set of nodes.
pub struct Point(pub &'static [(&'static str, &'static str)]);

impl Point {
    /// Reads one of the allowed words, or any node or set if none are listed.
    pub fn among(&self, given: &GivenValue<'_>, allowed: &[&'static str]) -> Result<String> {
        let point = self.read(given)?;
        if allowed.is_empty() || allowed.contains(&point.as_str()) {
            return Ok(point);
        }
        Err(given.fault(|key| Problem::Choice {
            key,
            value: given.node.shown(),
            nearest: super::nearest(&point, allowed.iter().copied()),
            choices: allowed.to_vec(),
        }))
    }
}

impl Value for Point {
    type Read = String;

    fn form(&self) -> Form {
        let words: Vec<String> = self.0.iter().map(|choice| as_toml(choice.0)).collect();
        let schema = json!({ "type": ["string", "integer"] });
        let words = format!("{}, or a node or a set of nodes", words.join(", "));
        Form {
            choices: self.0.to_vec(),
            ..Form::new(self.0[0].0, words, schema)
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<String> {
        match given.value() {
            Some(Toml::String(text)) if !text.trim().is_empty() => Ok(text.trim().to_owned()),
            Some(Toml::Integer(node)) => Ok(node.to_string()),
            _ => Err(given.wrong_type(self.form().words)),
        }
    }
}

/// Value that is a table of keys or a list of tables. The field is an example of the value. Reading only checks that
/// the value may be a table or a list.
pub struct Tables(pub &'static str);

impl Tables {
    /// Returns the list, or `None` for a single table.
    pub fn list(&self, given: &GivenValue<'_>) -> Result<Option<Vec<Node>>> {
        if matches!(given.node.content, Content::Section(_)) {
            return Ok(None);
        }
        let expected = format!("a table such as {}, or a list of such tables", self.0);
        let tables = given.node.tables();
        tables.ok_or_else(|| given.wrong_type(expected)).map(Some)
    }
}

impl Value for Tables {
    type Read = ();

    fn form(&self) -> Form {
        let words = "a table, or a list of such tables";
        Form::new(self.0, words, json!({ "type": "array", "minItems": 1 }))
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<()> {
        self.list(given).map(drop)
    }
}
