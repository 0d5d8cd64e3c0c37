//! Typed, checked access to the tree of a scene.

use std::path::PathBuf;

use toml::Value;

use super::document::{Content, Node};
use super::error::{Problem, SceneError};
use super::keys::{self, join};
use crate::units::{self, Dimension};

/// A condition on a number, and how to say it.
#[derive(Clone, Copy)]
pub(super) struct Check {
    pub holds: fn(f64) -> bool,
    pub expected: &'static str,
}

pub(super) const POSITIVE: Check = Check {
    holds: |x| x > 0.0,
    expected: "greater than zero",
};
pub(super) const NOT_NEGATIVE: Check = Check {
    holds: |x| x >= 0.0,
    expected: "zero or greater",
};
pub(super) const ANY: Check = Check {
    holds: |_| true,
    expected: "a number",
};
pub(super) const POISSON: Check = Check {
    holds: |x| x > -1.0 && x <= 0.5,
    expected: "greater than -1 and at most 0.5",
};
pub(super) const HURST: Check = Check {
    holds: |x| x > 0.0 && x <= 1.0,
    expected: "greater than 0 and at most 1",
};
pub(super) const RATIO: Check = Check {
    holds: |x| (0.0..1.0).contains(&x),
    expected: "zero or greater, and less than 1",
};
pub(super) const CHANGE: Check = Check {
    holds: |x| x > 0.0 && x < 1.0,
    expected: "greater than 0 and less than 1, such as 0.1",
};
pub(super) const TOLERANCE: Check = Check {
    holds: |x| x > 0.0 && x < 1.0,
    expected: "greater than 0 and less than 1, such as 1e-4",
};

/// 2^63: floats without a fraction below it, such as `1e6`, are integers.
const INTEGER_END: f64 = 9_223_372_036_854_775_808.0;

/// The largest integer that a scene can spell: where no other bound is, this one is not worth telling.
pub(super) const LARGEST_INTEGER: u64 = i64::MAX as u64;

/// 2^53: cycles are counted on in floating-point numbers, which hold every integer up to here.
pub(super) const MOST_CYCLES: u64 = 1 << 53;

/// More wear iterations than any run makes, each of which leaves files.
pub(super) const MOST_ITERATIONS: u64 = 1_000_000_000;

/// Reads the values of a tree by their dotted keys. Every method gives `None` for a key that is absent.
pub(super) struct Reader<'a> {
    pub root: &'a Node,
}

impl<'a> Reader<'a> {
    pub fn node(&self, key: &str) -> Option<&'a Node> {
        self.root.get(key)
    }

    pub fn has(&self, key: &str) -> bool {
        self.node(key).is_some()
    }

    /// The error of a required key that is absent; `example` is a line that would do.
    pub fn missing(&self, key: &str, example: &'static str) -> SceneError {
        let section = key.rsplit_once('.').map_or("", |split| split.0);
        SceneError::new(
            &self.root.place,
            Problem::Missing {
                key: key.to_owned(),
                section: section.to_owned(),
                example,
            },
        )
    }

    /// The error of a required section that is absent.
    pub fn missing_section(
        &self,
        section: &'static str,
        purpose: &'static str,
        example: &'static str,
    ) -> SceneError {
        SceneError::new(
            &self.root.place,
            Problem::MissingSection {
                section,
                purpose,
                example,
            },
        )
    }

    /// The error of a section that contradicts another one.
    pub fn misplaced(&self, section: &'static str, reason: impl Into<String>) -> SceneError {
        let node = self.node(section).unwrap_or(self.root);
        let reason = reason.into();
        SceneError::new(&node.place, Problem::Misplaced { section, reason })
    }

    /// The error of a key that contradicts another one.
    pub fn conflict(&self, key: &str, reason: impl Into<String>) -> SceneError {
        let node = self.node(key).unwrap_or(self.root);
        SceneError::new(
            &node.place,
            Problem::Conflict {
                key: key.to_owned(),
                value: node.shown(),
                reason: reason.into(),
            },
        )
    }

    /// The error of a key whose value is out of its range.
    pub fn out_of_range(&self, key: &str, expected: impl Into<String>) -> SceneError {
        let node = self.node(key).unwrap_or(self.root);
        SceneError::new(
            &node.place,
            Problem::Range {
                key: key.to_owned(),
                value: node.shown(),
                expected: expected.into(),
            },
        )
    }

    /// The error of a key whose value is of another type.
    pub fn wrong_type(&self, key: &str, node: &Node, expected: impl Into<String>) -> SceneError {
        SceneError::new(
            &node.place,
            Problem::Type {
                key: key.to_owned(),
                value: node.shown(),
                expected: expected.into(),
            },
        )
    }

    fn number(
        &self,
        key: &str,
        node: &Node,
        value: &Value,
        dimension: Dimension,
        check: Check,
        example: &str,
    ) -> Result<f64, SceneError> {
        let parsed = match value {
            Value::String(text) => units::parse(text, dimension),
            Value::Integer(number) => units::from_number(*number as f64, dimension),
            Value::Float(number) => units::from_number(*number, dimension),
            _ => {
                return Err(self.wrong_type(key, node, format!("{dimension}, such as {example}")));
            }
        };
        let number = parsed.map_err(|source| {
            SceneError::new(
                &node.place,
                Problem::Quantity {
                    key: key.to_owned(),
                    source,
                },
            )
        })?;
        if (check.holds)(number) {
            Ok(number)
        } else {
            Err(self.out_of_range(key, check.expected))
        }
    }

    /// A quantity in SI. `example` is a value that would do, as TOML.
    pub fn quantity(
        &self,
        key: &str,
        dimension: Dimension,
        check: Check,
        example: &str,
    ) -> Result<Option<f64>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        match &node.content {
            Content::Value(value) => self
                .number(key, node, value, dimension, check, example)
                .map(Some),
            Content::Section(_) => {
                Err(self.wrong_type(key, node, format!("{dimension}, such as {example}")))
            }
        }
    }

    /// A list of two quantities, for x and y. `single` makes two of a value that stands alone, where that is allowed.
    pub fn pair(
        &self,
        key: &str,
        dimension: Dimension,
        check: Check,
        single: Option<fn(f64) -> [f64; 2]>,
        example: &str,
    ) -> Result<Option<[f64; 2]>, SceneError> {
        let expected = format!("a list of two values, for x and y, such as {example}");
        self.list(key, dimension, check, single, &expected)
    }

    /// A list of `N` quantities. `single` makes a list of a value that stands alone, where that is allowed; `expected` says what
    /// would be right.
    pub fn list<const N: usize>(
        &self,
        key: &str,
        dimension: Dimension,
        check: Check,
        single: Option<fn(f64) -> [f64; N]>,
        expected: &str,
    ) -> Result<Option<[f64; N]>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        let example = expected.rsplit("such as ").next().unwrap_or(expected);
        let number = |value| self.number(key, node, value, dimension, check, example);
        match (&node.content, single) {
            (Content::Value(Value::Array(items)), _) => {
                let numbers: Result<Vec<f64>, SceneError> = items.iter().map(number).collect();
                if items.len() == N
                    && let Ok(list) = <[f64; N]>::try_from(numbers?)
                {
                    return Ok(Some(list));
                }
            }
            (Content::Value(value), Some(all)) => return Ok(Some(all(number(value)?))),
            _ => {}
        }
        Err(self.wrong_type(key, node, expected))
    }

    /// A list of at most `longest` integers of 0 or more that differ from one another.
    pub fn integers(
        &self,
        key: &str,
        longest: usize,
        expected: &str,
    ) -> Result<Option<Vec<u64>>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        let Content::Value(Value::Array(items)) = &node.content else {
            return Err(self.wrong_type(key, node, expected));
        };
        if items.len() > longest {
            let count = items.len();
            return Err(SceneError::new(
                &node.place,
                Problem::Range {
                    key: key.to_owned(),
                    value: format!("(a list of {count})"),
                    expected: format!("a list of at most {longest}"),
                },
            ));
        }
        let numbers: Option<Vec<u64>> = items
            .iter()
            .map(|item| as_integer(item).and_then(|n| u64::try_from(n).ok()))
            .collect();
        let Some(numbers) = numbers else {
            return Err(self.wrong_type(key, node, expected));
        };
        let mut sorted = numbers.clone();
        sorted.sort_unstable();
        if sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(self.out_of_range(key, expected));
        }
        Ok(Some(numbers))
    }

    /// A list of two integers, for x and y, of 1 to `largest`.
    pub fn integer_pair(
        &self,
        key: &str,
        largest: u64,
        example: &str,
    ) -> Result<Option<[usize; 2]>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        let expected = format!("a list of two integers of 1 to {largest}, such as {example}");
        let Content::Value(Value::Array(items)) = &node.content else {
            return Err(self.wrong_type(key, node, expected));
        };
        let numbers: Option<Vec<i64>> = items.iter().map(as_integer).collect();
        let Some(&[x, y]) = numbers.as_deref() else {
            return Err(self.wrong_type(key, node, expected));
        };
        let within = |number: i64| {
            u64::try_from(number)
                .ok()
                .filter(|n| (1..=largest).contains(n))
                .and_then(|n| usize::try_from(n).ok())
        };
        match (within(x), within(y)) {
            (Some(x), Some(y)) => Ok(Some([x, y])),
            _ => Err(self.out_of_range(key, expected)),
        }
    }

    /// An integer of `smallest` to `largest`.
    pub fn integer(
        &self,
        key: &str,
        smallest: u64,
        largest: u64,
    ) -> Result<Option<u64>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        let expected = if largest == LARGEST_INTEGER {
            format!("an integer of {smallest} or more")
        } else {
            format!("an integer of {smallest} to {largest}")
        };
        let number = match &node.content {
            Content::Value(value) => as_integer(value),
            Content::Section(_) => None,
        };
        let Some(number) = number else {
            return Err(self.wrong_type(key, node, expected));
        };
        match u64::try_from(number) {
            Ok(number) if (smallest..=largest).contains(&number) => Ok(Some(number)),
            _ => Err(self.out_of_range(key, expected)),
        }
    }

    /// The same of what there are so many of in memory.
    pub fn count(
        &self,
        key: &str,
        smallest: usize,
        largest: usize,
    ) -> Result<Option<usize>, SceneError> {
        let number = self.integer(key, smallest as u64, largest as u64)?;
        Ok(number.map(|number| number as usize))
    }

    /// True or false.
    pub fn boolean(&self, key: &str) -> Result<Option<bool>, SceneError> {
        match self.node(key).map(|node| (node, &node.content)) {
            None => Ok(None),
            Some((_, Content::Value(Value::Boolean(value)))) => Ok(Some(*value)),
            Some((node, _)) => Err(self.wrong_type(key, node, "true or false")),
        }
    }

    /// A text that is not empty.
    pub fn text(&self, key: &str, example: &str) -> Result<Option<&'a str>, SceneError> {
        match self.node(key).map(|node| (node, &node.content)) {
            None => Ok(None),
            Some((_, Content::Value(Value::String(text)))) if !text.trim().is_empty() => {
                Ok(Some(text))
            }
            Some((node, _)) => {
                Err(self.wrong_type(key, node, format!("a text, such as {example}")))
            }
        }
    }

    /// The path of a file, already absolute.
    pub fn path(&self, key: &str, example: &str) -> Result<Option<PathBuf>, SceneError> {
        Ok(self.text(key, example)?.map(PathBuf::from))
    }

    /// One of a few words, and what it stands for.
    pub fn choice<T: Copy>(
        &self,
        key: &str,
        choices: &[(&'static str, T)],
    ) -> Result<Option<T>, SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(None);
        };
        let word = match &node.content {
            Content::Value(Value::String(word)) => word.as_str(),
            _ => "",
        };
        if let Some(choice) = choices.iter().find(|choice| choice.0 == word) {
            return Ok(Some(choice.1));
        }
        let words: Vec<&'static str> = choices.iter().map(|choice| choice.0).collect();
        Err(SceneError::new(
            &node.place,
            Problem::Choice {
                key: key.to_owned(),
                value: node.shown(),
                nearest: keys::nearest(word, words.iter().copied()),
                choices: words,
            },
        ))
    }

    /// The kind of a section, once it is there: a word of [`keys::KINDS`]. Keys of another kind are refused.
    pub fn kind(&self, section: &str, example: &'static str) -> Result<&'static str, SceneError> {
        let key = join(section, "kind");
        let kinds: Vec<(&'static str, &'static str)> = keys::kinds(section)
            .iter()
            .map(|entry| (entry.0, entry.0))
            .collect();
        let kind = self
            .choice(&key, &kinds)?
            .ok_or_else(|| self.missing(&key, example))?;
        let own = keys::keys_of_kind(section, kind).unwrap_or(&[]);
        for name in keys::children(section) {
            let other = join(section, name);
            if let Some(node) = self.node(&other)
                && name != "kind"
                && !own.contains(&name)
            {
                return Err(SceneError::new(
                    &node.place,
                    Problem::OtherKind {
                        key: other,
                        value: node.shown(),
                        kind_key: key,
                        kind: kind.to_owned(),
                        keys: own.iter().map(|name| (*name).to_owned()).collect(),
                    },
                ));
            }
        }
        Ok(kind)
    }

    /// Refuses words that the whole program knows and this version does not.
    pub fn refuse_words(
        &self,
        key: &str,
        words: &[&str],
        instead: &'static str,
    ) -> Result<(), SceneError> {
        let Some(node) = self.node(key) else {
            return Ok(());
        };
        let shown = node.shown();
        if words.iter().any(|word| shown == format!("\"{word}\"")) {
            return Err(SceneError::new(
                &node.place,
                Problem::Unavailable {
                    key: format!("{key} = {shown}"),
                    instead,
                },
            ));
        }
        Ok(())
    }

    /// Refuses every key that no scene has.
    pub fn check_keys(&self) -> Result<(), SceneError> {
        self.check_section("", self.root)
    }

    /// Refuses every key of a section that no such section has.
    pub fn check_section(&self, section: &str, node: &Node) -> Result<(), SceneError> {
        let Content::Section(entries) = &node.content else {
            let names = keys::children(section).join(", ");
            let expected = format!("a section, [{section}], with keys: {names}");
            return Err(self.wrong_type(section, node, expected));
        };
        for (name, entry) in entries {
            let key = join(section, name);
            let is_value = keys::KEYS.contains(&key.as_str());
            let has_keys = !keys::children(&key).is_empty();
            let is_section = matches!(entry.content, Content::Section(_));
            if has_keys && (is_section || !is_value) {
                self.check_section(&key, entry)?;
            } else if !is_value {
                return Err(SceneError::new(
                    &entry.place,
                    Problem::UnknownKey {
                        nearest: keys::nearest_key(&key),
                        value: entry.shown(),
                        siblings: keys::children(section)
                            .into_iter()
                            .map(str::to_owned)
                            .collect(),
                        key,
                    },
                ));
            }
        }
        Ok(())
    }
}

/// An integer, also if written as `1e6`.
fn as_integer(value: &Value) -> Option<i64> {
    match value {
        Value::Integer(number) => Some(*number),
        Value::Float(number) if number.fract() == 0.0 && number.abs() < INTEGER_END => {
            Some(*number as i64)
        }
        _ => None,
    }
}
