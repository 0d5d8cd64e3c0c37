//! Value types of numbers: description, reading and JSON Schema. `word.rs` has words, texts and tables.

use std::marker::PhantomData;
use std::ops::{
    Bound::{self, Excluded, Included, Unbounded},
    RangeBounds,
};

use serde::Serialize;
use serde_json::{Value as Json, json};
use toml::Value as Toml;

use crate::scene::document::{Content, Node};
use crate::scene::error::{Problem, SceneError};
use crate::units::{self, Dimension};

type Result<T> = std::result::Result<T, SceneError>;

/// Description of a value type, for users and programs.
pub struct Form {
    /// An example value, as after `--set`: TOML, or a text without quotes.
    pub example: &'static str,
    /// The expected value in words.
    pub words: String,
    /// The JSON Schema of a value, for editors.
    pub schema: Json,
    /// The words to choose from, with their meanings.
    pub choices: Vec<(&'static str, &'static str)>,
    /// True for the path of a file, relative to the scene file.
    pub is_path: bool,
}

impl Form {
    pub fn new(example: &'static str, words: impl Into<String>, schema: Json) -> Form {
        Form {
            example,
            words: words.into(),
            schema,
            choices: Vec::new(),
            is_path: false,
        }
    }
}

/// Value type of a key.
pub trait Value {
    /// The type of the value after reading.
    type Read: Serialize;

    fn form(&self) -> Form;

    /// Reads the value, if it has this type and is within its range.
    fn read(&self, given: &GivenValue<'_>) -> Result<Self::Read>;

    /// Converts a read value to the JSON value that the canonical scene records.
    fn recorded(&self, read: &Self::Read) -> Json {
        json!(read)
    }

    /// True if the given value is the path of a file.
    fn names_file(&self, _: &GivenValue<'_>) -> bool {
        self.form().is_path
    }
}

/// Value given for a key, and the name of the key in error messages.
pub struct GivenValue<'a> {
    pub key: String,
    pub node: &'a Node,
}

impl GivenValue<'_> {
    pub fn fault(&self, problem: impl FnOnce(String) -> Problem) -> SceneError {
        SceneError::new(&self.node.place, problem(self.key.clone()))
    }

    pub fn wrong_type(&self, expected: impl Into<String>) -> SceneError {
        self.fault(|key| Problem::Type {
            key,
            value: self.node.shown(),
            expected: expected.into(),
        })
    }

    pub fn out_of_range(&self, expected: impl Into<String>) -> SceneError {
        self.fault(|key| Problem::Range {
            key,
            value: self.node.shown(),
            expected: expected.into(),
        })
    }

    /// The given value, `None` for a section.
    pub fn value(&self) -> Option<&Toml> {
        match &self.node.content {
            Content::Value(value) => Some(value),
            Content::Section(_) => None,
        }
    }
}

/// Parses the text after `--set`: as TOML if possible, else as a string.
pub fn parse_set_value(text: &str) -> Toml {
    text.parse()
        .unwrap_or_else(|_| Toml::String(text.to_owned()))
}

/// Returns the text after `--set` as a TOML value. Valid TOML stays unchanged, and other text becomes a TOML string.
pub fn as_toml(text: &str) -> String {
    match text.parse::<Toml>() {
        Ok(_) => text.to_owned(),
        Err(_) => Toml::from(text).to_string(),
    }
}

/// Range of numbers, and the description of the range.
#[derive(Clone, Copy)]
pub struct Check {
    range: (Bound<f64>, Bound<f64>),
    expected: &'static str,
}

const fn check(low: Bound<f64>, high: Bound<f64>, expected: &'static str) -> Check {
    let range = (low, high);
    Check { range, expected }
}

pub const POSITIVE: Check = check(Excluded(0.0), Unbounded, "greater than zero");
pub const NOT_NEGATIVE: Check = check(Included(0.0), Unbounded, "zero or greater");
pub const ANY: Check = check(Unbounded, Unbounded, "");
pub const POISSON: Check = check(
    Excluded(-1.0),
    Included(0.5),
    "greater than -1 and at most 0.5",
);
pub const HURST: Check = check(Excluded(0.0), Included(1.0), "greater than 0 and at most 1");
pub const RATIO: Check = check(
    Included(0.0),
    Excluded(1.0),
    "zero or greater, and less than 1",
);
pub const CHANGE: Check = check(
    Excluded(0.0),
    Excluded(1.0),
    "greater than 0 and less than 1, such as 0.1",
);
pub const TOLERANCE: Check = check(
    Excluded(0.0),
    Excluded(1.0),
    "greater than 0 and less than 1, such as 1e-4",
);

/// Removes the example from a description.
fn without_example(text: &'static str) -> &'static str {
    text.split(", such as").next().unwrap_or(text)
}

/// Quantity with a unit: dimension, range and example, as `30 kN`.
pub struct Quantity(pub Dimension, pub Check, pub &'static str);

/// A text that begins with a number.
const NUMBER: &str = r"^\s*[-+]?\.?[0-9]";

/// A text that begins with a number and has a unit.
const WITH_UNIT: &str = r"^\s*[-+]?\.?[0-9].*[A-Za-z%°µμ]";

impl Quantity {
    fn number(&self, given: &GivenValue<'_>, value: Option<&Toml>) -> Result<f64> {
        let Quantity(dimension, check, example) = self;
        let parsed = match value {
            Some(Toml::String(text)) => units::parse(text, *dimension),
            Some(Toml::Integer(number)) => units::from_number(*number as f64, *dimension),
            Some(Toml::Float(number)) => units::from_number(*number, *dimension),
            _ => {
                let example = as_toml(example);
                return Err(given.wrong_type(format!("{dimension}, such as {example}")));
            }
        };
        let number =
            parsed.map_err(|source| given.fault(|key| Problem::Quantity { key, source }))?;
        if !check.range.contains(&number) {
            return Err(given.out_of_range(check.expected));
        }
        if number != 0.0 && !units::COMPUTABLE_RANGE.contains(&number.abs()) {
            return Err(given.out_of_range("zero, or from 1e-60 to 1e60 in SI units"));
        }
        Ok(number)
    }

    /// Returns the schema of the quantity. Only a plain number has a range in the schema; a text is checked when it is
    /// read.
    fn schema(&self) -> Json {
        if self.0 != Dimension::NONE {
            return json!({ "type": "string", "pattern": WITH_UNIT });
        }
        let mut schema = json!({ "type": ["number", "string"], "pattern": NUMBER });
        let (low, high) = self.1.range;
        for (bound, included, excluded) in [
            (low, "minimum", "exclusiveMinimum"),
            (high, "maximum", "exclusiveMaximum"),
        ] {
            match bound {
                Included(end) => schema[included] = json!(end),
                Excluded(end) => schema[excluded] = json!(end),
                Unbounded => {}
            }
        }
        schema
    }
}

impl Value for Quantity {
    type Read = f64;

    fn form(&self) -> Form {
        let mut words = self.0.to_string();
        if !self.0.units().is_empty() {
            words += &format!(" ({})", self.0.units().join(", "));
        }
        if !self.1.expected.is_empty() {
            words += &format!(", {}", without_example(self.1.expected));
        }
        Form::new(self.2, words, self.schema())
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<f64> {
        self.number(given, given.value())
    }
}

/// Meaning of a single value in place of a list, and its description.
pub struct ScalarForm<const N: usize>(fn(f64) -> [f64; N], &'static str);

pub const FOR_X: ScalarForm<2> = ScalarForm(|x| [x, 0.0], "; one alone is for x");
pub const FOR_BOTH: ScalarForm<2> = ScalarForm(|both| [both; 2], "; one alone is for both");
pub const FOR_ALL: ScalarForm<3> = ScalarForm(|all| [all; 3], "");

/// List of quantities: description, type of the items, and meaning of a single value.
pub struct List<const N: usize>(pub &'static str, pub Quantity, pub Option<ScalarForm<N>>);

/// Description of most lists.
pub const XY: &str = "a list of two values, for x and y";

impl<const N: usize> Value for List<N>
where
    [f64; N]: Serialize,
{
    type Read = [f64; N];

    fn form(&self) -> Form {
        let each = self.1.form();
        let single_form = self.2.as_ref().map_or("", |alone| alone.1);
        let words = format!("{}: {}{single_form}", self.0, each.words);
        let list = json!({ "type": "array", "items": each.schema, "minItems": N, "maxItems": N });
        let schema = match self.2 {
            Some(_) => json!({ "anyOf": [list, each.schema] }),
            None => list,
        };
        Form::new(each.example, words, schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<[f64; N]> {
        let number = |value| self.1.number(given, Some(value));
        match (given.value(), &self.2) {
            (Some(Toml::Array(items)), _) => {
                let numbers: Result<Vec<f64>> = items.iter().map(number).collect();
                if items.len() == N
                    && let Ok(list) = <[f64; N]>::try_from(numbers?)
                {
                    return Ok(list);
                }
            }
            (Some(value), Some(alone)) => return Ok(alone.0(number(value)?)),
            _ => {}
        }
        let example = as_toml(self.1.2);
        Err(given.wrong_type(format!("{}, such as {example}", self.0)))
    }
}

/// Bound of integers, 2^63. A float below 2^63 without a fraction, such as `1e6`, counts as an integer.
const INTEGER_END: f64 = 9_223_372_036_854_775_808.0;

/// Largest integer that TOML can represent. Help pages do not show `LARGEST_INTEGER` as an upper bound.
pub const LARGEST_INTEGER: u64 = i64::MAX as u64;

/// Returns the integer in a TOML integer, or in a TOML float without a fraction such as `1e6`.
fn as_integer(value: &Toml) -> Option<i64> {
    match value {
        Toml::Integer(number) => Some(*number),
        Toml::Float(number) if number.fract() == 0.0 && number.abs() < INTEGER_END => {
            Some(*number as i64)
        }
        _ => None,
    }
}

/// Integer type: smallest and largest value, and an example.
pub struct Integer<T = u64>(u64, u64, &'static str, PhantomData<T>);

pub const fn integer<T>(smallest: u64, largest: u64, example: &'static str) -> Integer<T> {
    Integer(smallest, largest, example, PhantomData)
}

impl<T: TryFrom<u64> + Serialize> Value for Integer<T> {
    type Read = T;

    fn form(&self) -> Form {
        let Integer(smallest, largest, example, _) = self;
        let words = match *largest {
            LARGEST_INTEGER => format!("an integer of {smallest} or more"),
            _ => format!("an integer of {smallest} to {largest}"),
        };
        let schema = json!({ "type": "integer", "minimum": smallest, "maximum": largest });
        Form::new(example, words, schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<T> {
        let Some(number) = given.value().and_then(as_integer) else {
            return Err(given.wrong_type(self.form().words));
        };
        u64::try_from(number)
            .ok()
            .filter(|number| (self.0..=self.1).contains(number))
            .and_then(|number| T::try_from(number).ok())
            .ok_or_else(|| given.out_of_range(self.form().words))
    }
}

/// Even integer: smallest and largest value, and an example.
pub struct EvenInteger(pub u64, pub u64, pub &'static str);

impl EvenInteger {
    /// Reads the number with another lower bound. `reason` explains the bound in the error message.
    pub fn read_from(&self, given: &GivenValue<'_>, least: u64, reason: &str) -> Result<usize> {
        let number = integer(0, LARGEST_INTEGER, self.2).read(given)?;
        Some(number)
            .filter(|n| n % 2 == 0 && (least..=self.1).contains(n))
            .map(|n| n as usize)
            .ok_or_else(|| {
                given.out_of_range(format!("an even integer of {least} to {}{reason}", self.1))
            })
    }
}

impl Value for EvenInteger {
    type Read = usize;

    fn form(&self) -> Form {
        let EvenInteger(smallest, largest, example) = self;
        let schema =
            json!({ "type": "integer", "minimum": smallest, "maximum": largest, "multipleOf": 2 });
        let words = format!("an even integer of {smallest} to {largest}");
        Form::new(example, words, schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<usize> {
        self.read_from(given, self.0, "")
    }
}

/// List of two integers from 1 to the given maximum, for x and y, with an example.
pub struct Counts(pub u64, pub &'static str);

impl Value for Counts {
    type Read = [usize; 2];

    fn form(&self) -> Form {
        let each = json!({ "type": "integer", "minimum": 1, "maximum": self.0 });
        let schema = json!({ "type": "array", "items": each, "minItems": 2, "maxItems": 2 });
        let words = format!("a list of two integers of 1 to {}", self.0);
        Form::new(self.1, words, schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<[usize; 2]> {
        let expected = || format!("{}, such as {}", self.form().words, self.1);
        let items = given.value().and_then(Toml::as_array);
        let numbers: Option<Vec<i64>> =
            items.and_then(|items| items.iter().map(as_integer).collect());
        let Some(&[x, y]) = numbers.as_deref() else {
            return Err(given.wrong_type(expected()));
        };
        let within = |number: i64| {
            usize::try_from(number)
                .ok()
                .filter(|n| (1..=self.0).contains(&(*n as u64)))
        };
        match (within(x), within(y)) {
            (Some(x), Some(y)) => Ok([x, y]),
            _ => Err(given.out_of_range(expected())),
        }
    }
}

/// First and last value of a range of integers, 0 or more, with an example.
pub struct IntegerRange(pub &'static str);

impl Value for IntegerRange {
    type Read = [u64; 2];

    fn form(&self) -> Form {
        let each = json!({ "type": "integer", "minimum": 0 });
        let schema = json!({ "type": "array", "items": each, "minItems": 2, "maxItems": 2 });
        Form::new(
            self.0,
            "a list of two integers of 0 or more, the first and the last",
            schema,
        )
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<[u64; 2]> {
        let expected = || format!("{}, such as {}", self.form().words, self.0);
        let items = given.value().and_then(Toml::as_array);
        let numbers: Option<Vec<i64>> =
            items.and_then(|items| items.iter().map(as_integer).collect());
        let Some(&[first, last]) = numbers.as_deref() else {
            return Err(given.wrong_type(expected()));
        };
        match (u64::try_from(first), u64::try_from(last)) {
            (Ok(first), Ok(last)) if first <= last => Ok([first, last]),
            _ => Err(given.out_of_range(expected())),
        }
    }
}

/// List of different integers, 0 or more: its greatest length, and a description that ends with an example.
pub struct Integers(pub usize, pub &'static str);

impl Value for Integers {
    type Read = Vec<u64>;

    fn form(&self) -> Form {
        let example = self.1.rsplit("such as ").next().unwrap_or(self.1);
        let each = json!({ "type": "integer", "minimum": 0 });
        let schema =
            json!({ "type": "array", "items": each, "maxItems": self.0, "uniqueItems": true });
        Form::new(example, without_example(self.1), schema)
    }

    fn read(&self, given: &GivenValue<'_>) -> Result<Vec<u64>> {
        let &Integers(longest, expected) = self;
        let Some(items) = given.value().and_then(Toml::as_array) else {
            return Err(given.wrong_type(expected));
        };
        if items.len() > longest {
            return Err(given.fault(|key| Problem::Range {
                key,
                value: format!("(a list with {} items)", items.len()),
                expected: format!("a list of at most {longest} items"),
            }));
        }
        let number = |item| as_integer(item).and_then(|n| u64::try_from(n).ok());
        let numbers: Option<Vec<u64>> = items.iter().map(number).collect();
        let numbers = numbers.ok_or_else(|| given.wrong_type(expected))?;
        let mut sorted = numbers.clone();
        sorted.sort_unstable();
        sorted.dedup();
        if sorted.len() < numbers.len() {
            return Err(given.out_of_range(expected));
        }
        Ok(numbers)
    }
}
