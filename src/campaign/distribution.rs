//! Distributions of a key. Each maps a number between 0 and 1 to a value.
//!
//! The inverse distribution function maps the numbers of a Sobol sequence to values. The values keep the even spread of
//! the Sobol sequence.

use statrs::distribution::{ContinuousCDF, Normal, Triangular};
use toml::{Table, Value};

use crate::units::Amount;

/// Distribution of the values of a key.
#[derive(Debug, Clone, PartialEq)]
pub struct Distribution {
    kind: Kind,
    /// Unit of the bounds and of the values; empty for plain numbers.
    unit: String,
}

#[derive(Debug, Clone, PartialEq)]
enum Kind {
    Uniform {
        low: f64,
        high: f64,
    },
    LogUniform {
        low: f64,
        high: f64,
    },
    /// Normal distribution, truncated to `within` (infinite without bounds).
    Normal {
        normal: Normal,
        within: [f64; 2],
    },
    /// `normal` is the distribution of the logarithm; `within` bounds the value itself.
    LogNormal {
        normal: Normal,
        within: [f64; 2],
    },
    Triangular(Triangular),
    Integers {
        low: i64,
        high: i64,
    },
    Choice(Vec<Value>),
}

/// Names of the kinds, each with its required and its optional keys.
const KINDS: [(&str, &[&str], &[&str]); 7] = [
    ("uniform", &["low", "high"], &[]),
    ("log_uniform", &["low", "high"], &[]),
    ("normal", &["mean", "sd"], &["low", "high"]),
    ("log_normal", &["median", "factor"], &["low", "high"]),
    ("triangular", &["low", "mode", "high"], &[]),
    ("integers", &["low", "high"], &[]),
    ("choice", &["values"], &[]),
];

/// Smallest probability that a drawn value lies between the bounds. With a smaller probability, the inverse would lose most digits.
const LEAST_MASS: f64 = 1e-9;

/// Largest whole number up to which a floating-point value represents every whole number exactly.
const MOST_INTEGER: i64 = 1 << 53;

impl Distribution {
    /// Reads a distribution from `{ distribution = "normal", mean = 0.6, sd = 0.1 }`.
    ///
    /// # Errors
    /// A sentence that says what would be right.
    pub fn parse(table: &Table) -> Result<Distribution, String> {
        let names = KINDS.map(|(name, ..)| name).join(", ");
        let word = table.get("distribution").and_then(Value::as_str);
        let kind_entry = KINDS.iter().find(|(name, ..)| Some(*name) == word);
        let Some((name, required, optional)) = kind_entry else {
            return Err(format!("distribution must be one of {names}"));
        };
        let accepted = || required.iter().chain(*optional).copied();
        if let Some(key) = table
            .keys()
            .find(|key| *key != "distribution" && !accepted().any(|name| name == *key))
        {
            let accepted = accepted().collect::<Vec<_>>().join(", ");
            return Err(format!("{name} has no `{key}`; it has {accepted}"));
        }
        if let Some(key) = required.iter().find(|key| !table.contains_key(**key)) {
            return Err(format!(
                "{name} needs {}; `{key}` is missing",
                required.join(", ")
            ));
        }
        let kind = match *name {
            "choice" => {
                let values = table["values"].as_array().filter(|v| !v.is_empty());
                let values = values.ok_or("values must be a list of at least one value")?;
                return Ok(Distribution {
                    kind: Kind::Choice(values.clone()),
                    unit: String::new(),
                });
            }
            "integers" => {
                let whole = |key: &str| {
                    let number = table[key].as_integer();
                    let number = number.filter(|n| n.abs() <= MOST_INTEGER);
                    number.ok_or(format!("{key} must be a whole number up to {MOST_INTEGER}"))
                };
                let [low, high] = [whole("low")?, whole("high")?];
                if low > high {
                    return Err(format!("low = {low} must not be above high = {high}"));
                }
                Kind::Integers { low, high }
            }
            _ => return continuous(name, table),
        };
        Ok(Distribution {
            kind,
            unit: String::new(),
        })
    }

    /// Returns the value at the probability `u`, between 0 and 1 (both excluded).
    pub fn at(&self, u: f64) -> Value {
        let number = match &self.kind {
            Kind::Uniform { low, high } => low + (high - low) * u,
            Kind::LogUniform { low, high } => low * (high / low).powf(u),
            Kind::Normal { normal, within } => between(normal, *within, u),
            Kind::LogNormal { normal, within } => between(normal, within.map(f64::ln), u).exp(),
            Kind::Triangular(triangular) => triangular.inverse_cdf(u),
            Kind::Integers { low, high } => {
                let count = (high - low + 1) as f64;
                return Value::Integer((low + (u * count) as i64).min(*high));
            }
            Kind::Choice(values) => {
                let at = (u * values.len() as f64) as usize;
                return values[at.min(values.len() - 1)].clone();
            }
        };
        let unit = self.unit.clone();
        match unit.is_empty() {
            true => Value::Float(number),
            false => Value::String(Amount { number, unit }.to_string()),
        }
    }
}

/// Returns the value of a normal distribution, truncated to two bounds, at the probability `u`.
fn between(normal: &Normal, [low, high]: [f64; 2], u: f64) -> f64 {
    let (from, to) = (normal.cdf(low), normal.cdf(high));
    normal.inverse_cdf(from + (to - from) * u).clamp(low, high)
}

fn continuous(name: &str, table: &Table) -> Result<Distribution, String> {
    let amount = |key: &str| table.get(key).map(|value| amount(key, value)).transpose();
    let required_amount =
        |key: &str| amount(key).map(|parsed| parsed.expect("`parse` requires this key"));
    let plain_number = |key: &str| {
        let parsed = required_amount(key)?;
        match parsed.unit.as_str() {
            "" => Ok(parsed.number),
            _ => Err(format!("{key} must be a plain number")),
        }
    };
    let mut unit: Option<(String, String)> = None;
    let mut in_common_unit = |key: &str, parsed: Amount| match &unit {
        Some((first, unit)) if *unit != parsed.unit => Err(format!(
            "{key} is in \"{}\" and {first} in \"{unit}\"; write both in the same unit",
            parsed.unit
        )),
        _ => {
            unit.get_or_insert((key.to_owned(), parsed.unit));
            Ok(parsed.number)
        }
    };
    let mut bounds = |least: f64| -> Result<[f64; 2], String> {
        let low = amount("low")?
            .map(|parsed| in_common_unit("low", parsed))
            .transpose()?;
        let high = amount("high")?
            .map(|parsed| in_common_unit("high", parsed))
            .transpose()?;
        let [low, high] = [low.unwrap_or(least), high.unwrap_or(f64::INFINITY)];
        match low < high {
            true => Ok([low, high]),
            false => Err(format!("low = {low} must be below high = {high}")),
        }
    };
    let kind = match name {
        "uniform" => {
            let [low, high] = bounds(f64::NEG_INFINITY)?;
            Kind::Uniform { low, high }
        }
        "log_uniform" => {
            let [low, high] = bounds(0.0)?;
            if low <= 0.0 {
                return Err(format!("low = {low} must be above zero"));
            }
            Kind::LogUniform { low, high }
        }
        "triangular" => {
            let [low, high] = bounds(f64::NEG_INFINITY)?;
            let mode = in_common_unit("mode", required_amount("mode")?)?;
            let triangular = Triangular::new(low, high, mode)
                .map_err(|_| format!("mode = {mode} must lie from low = {low} to high = {high}"))?;
            Kind::Triangular(triangular)
        }
        "normal" => {
            let within = bounds(f64::NEG_INFINITY)?;
            let (mean, sd) = (
                in_common_unit("mean", required_amount("mean")?)?,
                in_common_unit("sd", required_amount("sd")?)?,
            );
            let normal = Normal::new(mean, sd)
                .ok()
                .filter(|_| sd > 0.0)
                .ok_or(format!("sd = {sd} must be above zero"))?;
            check_mass(&normal, within)?;
            Kind::Normal { normal, within }
        }
        _ => {
            let within = bounds(0.0)?;
            let median = in_common_unit("median", required_amount("median")?)?;
            let factor = plain_number("factor")?;
            if median <= 0.0 || within[0] < 0.0 {
                return Err(format!(
                    "median = {median} and low = {} must be above zero",
                    within[0]
                ));
            }
            if factor <= 1.0 {
                return Err(format!(
                    "factor = {factor} must be above 1: two thirds of the draws lie from median / factor to median · factor"
                ));
            }
            let normal = Normal::new(median.ln(), factor.ln()).map_err(|e| e.to_string())?;
            check_mass(&normal, within.map(f64::ln))?;
            Kind::LogNormal { normal, within }
        }
    };
    Ok(Distribution {
        kind,
        unit: unit.map_or(String::new(), |(_, unit)| unit),
    })
}

fn check_mass(normal: &Normal, [low, high]: [f64; 2]) -> Result<(), String> {
    match normal.cdf(high) - normal.cdf(low) {
        mass if mass >= LEAST_MASS => Ok(()),
        mass => Err(format!(
            "low and high contain {mass:.1e} of the distribution; they must contain at least {LEAST_MASS:.0e}"
        )),
    }
}

/// Reads a number, or a text with a number and a unit.
fn amount(key: &str, value: &Value) -> Result<Amount, String> {
    let error = || format!("{key} must be a finite number, or a number with a unit as in \"5 um\"");
    let text = match value {
        Value::Integer(number) => number.to_string(),
        Value::Float(number) => number.to_string(),
        Value::String(text) => text.clone(),
        _ => return Err(error()),
    };
    Amount::parse(&text).ok_or_else(error)
}
