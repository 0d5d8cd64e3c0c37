//! Values that are words, texts and tables.

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

/// A text that is not empty; the example.
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

/// The path of a file, absolute by the time that it is read; the example.
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

/// A unit alone; the example. What is read is its worth in SI.
pub struct Unit(pub Dimension, pub &'static str);

impl Value for Unit {
    type Read = f64;

    fn form(&self) -> Form {
        Form {
            words: format!(
                "the unit of {}, or a number of them as \"25.4 mm\" for inches",
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

/// One of a few words, what it stands for, and what it means.
pub struct Choice<T: 'static>(pub &'static [(&'static str, T, &'static str)]);

impl<T: Copy + PartialEq> Choice<T> {
    /// The choice among those of the words that are allowed.
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

    /// Its word.
    fn noted(&self, read: &T) -> Json {
        let word = self.0.iter().find(|choice| choice.1 == *read);
        json!(word.map(|choice| choice.0))
    }
}

/// One word where there is no table of keys; the table as an example.
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

/// A part of something, or never; a part as an example.
pub struct PartOrNever(pub &'static str);

/// The word that stands in place of a part.
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

    fn noted(&self, read: &Option<f64>) -> Json {
        read.map_or_else(|| json!(NEVER), |part| json!(part))
    }
}

/// True or false where there is no table of keys; the table as an example.
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

/// The path of a file where there is no table of keys; a path and a table as examples. What is read is the path, if it is one.
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

/// Numbers with units of one kind of a section, the path of a file of another. What is read is whether it may be either.
pub struct ListOrPath<const N: usize>(pub List<N>, pub FilePath);

impl<const N: usize> Value for ListOrPath<N>
where
    [f64; N]: Serialize,
{
    type Read = ();

    fn form(&self) -> Form {
        let (list, path) = (self.0.form(), self.1.form());
        Form {
            words: format!("{}; of matrices {}", list.words, path.words),
            schema: json!({ "anyOf": [list.schema, path.schema] }),
            is_path: true,
            ..list
        }
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<()> {
        // Numbers that are none have an error of their own; a text may be a path.
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

/// True of what begins like no number, or ends like a file: a number with a wrong unit is to be told as such.
fn is_like_path(text: &str) -> bool {
    let begins = text.trim_start();
    let is_number = begins.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
        && !begins.starts_with("./")
        && !begins.starts_with("..");
    let extension = Path::new(text).extension().and_then(|e| e.to_str());
    let is_file = |e: &str| {
        e.chars().all(|c| c.is_ascii_alphanumeric()) && e.chars().any(|c| c.is_ascii_alphabetic())
    };
    !is_number || extension.is_some_and(is_file)
}

/// A point of a structure: one of a few words, or a node or a set of nodes; the words and what each means.
pub struct Point(pub &'static [(&'static str, &'static str)]);

impl Point {
    /// One of the words that are allowed; any node or set where none are.
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

/// A table of keys, or a list of such tables; the example. What is read is whether it may be either.
pub struct Tables(pub &'static str);

impl Tables {
    /// The list, if it is one.
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
