//! Unit expressions: products and quotients of powers of prefixed units.

use std::f64::consts::PI;

use super::{Dimension, UnitProblem};

/// SI value of a unit: `factor * 10^power`, with its dimension.
#[derive(Clone, Copy)]
pub(super) struct Scale {
    pub dimension: Dimension,
    pub power: i32,
    pub factor: f64,
}

const PREFIXES: [(&str, i32); 15] = [
    ("f", -15),
    ("p", -12),
    ("n", -9),
    ("u", -6),
    // The micro sign and the Greek letter mu look alike, and keyboards produce both.
    ("\u{b5}", -6),
    ("\u{3bc}", -6),
    ("m", -3),
    ("c", -2),
    ("d", -1),
    ("da", 1),
    ("h", 2),
    ("k", 3),
    ("M", 6),
    ("G", 9),
    ("T", 12),
];

/// Units that accept a prefix, with the power of ten to SI.
const PREFIXED: [(&str, Dimension, i32); 9] = [
    ("m", Dimension::LENGTH, 0),
    ("g", Dimension::of(0, 1, 0), -3),
    ("s", Dimension::of(0, 0, 1), 0),
    ("N", Dimension::FORCE, 0),
    ("Pa", Dimension::PRESSURE, 0),
    ("J", Dimension::of(2, 1, -2), 0),
    ("W", Dimension::of(2, 1, -3), 0),
    ("Hz", Dimension::of(0, 0, -1), 0),
    ("rad", Dimension::ANGLE, 0),
];

/// Units that accept no prefix, with the power of ten and the factor to SI. `Nm` is not SI spelling, but wear rates are
/// often reported in `mm^3/Nm`.
const PLAIN: [(&str, Dimension, i32, f64); 9] = [
    ("deg", Dimension::ANGLE, 0, PI / 180.0),
    ("\u{b0}", Dimension::ANGLE, 0, PI / 180.0),
    ("t", Dimension::of(0, 1, 0), 3, 1.0),
    ("bar", Dimension::PRESSURE, 5, 1.0),
    ("%", Dimension::NONE, -2, 1.0),
    ("Nm", Dimension::of(2, 1, -2), 0, 1.0),
    ("min", Dimension::of(0, 0, 1), 0, 60.0),
    ("h", Dimension::of(0, 0, 1), 0, 3600.0),
    ("d", Dimension::of(0, 0, 1), 0, 86400.0),
];

/// Customary units that the parser rejects, each with a value in SI units. The error message suggests the value in SI
/// units.
const CUSTOMARY: [(&str, &str); 17] = [
    ("in", "25.4 mm"),
    ("inch", "25.4 mm"),
    ("ft", "304.8 mm"),
    ("mil", "25.4 um"),
    ("thou", "25.4 um"),
    ("lbf", "4.44822 N"),
    ("lb", "4.44822 N as a force, 0.453592 kg as a mass"),
    ("lbm", "0.453592 kg"),
    ("kip", "4.44822 kN"),
    ("kgf", "9.80665 N"),
    ("uin", "25.4 nm"),
    ("Msi", "6.89476 GPa"),
    ("oz", "28.3495 g"),
    ("psi", "6.89476 kPa"),
    ("ksi", "6.89476 MPa"),
    ("Mpsi", "6.89476 GPa"),
    ("msi", "6.89476 GPa"),
];

/// Largest accepted power of one unit: far above any physical power, far below an overflow.
const LARGEST_POWER: i32 = 99;

impl Scale {
    /// Scale of a pure number.
    pub const ONE: Self = Scale {
        dimension: Dimension::NONE,
        power: 0,
        factor: 1.0,
    };

    /// Parses a whole unit expression. `expected` affects only the unit that an error suggests.
    pub fn parse(text: &str, expected: Dimension) -> Result<Self, UnitProblem> {
        let mut reader = UnitReader {
            rest: text,
            expected,
        };
        let scale = reader.product(false)?;
        if reader.rest.is_empty() {
            Ok(scale)
        } else {
            Err(reader.malformed())
        }
    }

    fn parse_unit(name: &str, expected: Dimension) -> Result<Self, UnitProblem> {
        let customary = CUSTOMARY.iter().find(|entry| entry.0 == name);
        Self::of_known_unit(name).ok_or_else(|| match customary {
            Some(&(unit, worth)) => UnitProblem::Customary { unit, worth },
            None => UnitProblem::UnknownUnit {
                unit: name.to_owned(),
                nearest: nearest_unit(name, expected),
            },
        })
    }

    fn of_known_unit(name: &str) -> Option<Self> {
        if let Some(&(_, dimension, power, factor)) = PLAIN.iter().find(|unit| unit.0 == name) {
            return Some(Scale {
                dimension,
                power,
                factor,
            });
        }
        std::iter::once(("", 0))
            .chain(PREFIXES)
            .find_map(|(prefix, power)| {
                let base = name.strip_prefix(prefix)?;
                let unit = PREFIXED.iter().find(|unit| unit.0 == base)?;
                Some(Scale {
                    dimension: unit.1,
                    power: unit.2 + power,
                    factor: 1.0,
                })
            })
    }

    fn times(self, other: Self, exponent: i32) -> Self {
        Scale {
            dimension: self.dimension.plus(other.dimension, exponent),
            power: self.power + exponent * other.power,
            factor: self.factor * other.factor.powi(exponent),
        }
    }
}

/// Returns the known unit most similar to `name`. `nearest_unit` ranks units by the number of edits (ignoring case),
/// then by dimension, length and edits with case. Returns `None` if more than half of the name would change.
fn nearest_unit(name: &str, expected: Dimension) -> Option<String> {
    let prefixed = std::iter::once("")
        .chain(PREFIXES.map(|prefix| prefix.0))
        .flat_map(|prefix| PREFIXED.map(|unit| format!("{prefix}{}", unit.0)));
    let plain = PLAIN.iter().map(|unit| unit.0.to_owned());
    let folded = name.to_lowercase();
    // Suggesting a unit of time for a quantity without time would only confuse.
    let is_plausible = |unit: &String| {
        expected.s != 0 || Scale::of_known_unit(unit).is_none_or(|scale| scale.dimension.s == 0)
    };
    prefixed
        .chain(plain)
        .filter(is_plausible)
        .map(|unit| {
            let edits = strsim::damerau_levenshtein(&folded, &unit.to_lowercase());
            let has_other_dimension =
                Scale::of_known_unit(&unit).is_none_or(|scale| scale.dimension != expected);
            let length = unit.chars().count().abs_diff(name.chars().count());
            let capitals = strsim::damerau_levenshtein(name, &unit);
            (edits, has_other_dimension, length, capitals, unit)
        })
        .min()
        .filter(|(edits, ..)| 2 * edits <= name.chars().count())
        .map(|(.., unit)| unit)
}

/// Parser of a unit from left to right.
struct UnitReader<'a> {
    rest: &'a str,
    expected: Dimension,
}

impl UnitReader<'_> {
    fn malformed(&self) -> UnitProblem {
        UnitProblem::Malformed {
            rest: self.rest.to_owned(),
        }
    }

    fn eat(&mut self, symbols: &[char]) -> bool {
        match self.rest.strip_prefix(symbols) {
            Some(rest) => {
                self.rest = rest.trim_start();
                true
            }
            None => false,
        }
    }

    /// Parses units that `*`, `·`, a blank or `/` joins. The product ends at the end of the text or at the closing
    /// parenthesis.
    fn product(&mut self, inside: bool) -> Result<Scale, UnitProblem> {
        let mut total = Scale::ONE;
        let mut divided = false;
        let mut first = true;
        loop {
            let sign = if self.eat(&['/']) {
                divided = true;
                -1
            } else {
                let explicit = !first && self.eat(&['*', '\u{b7}', '\u{22c5}']);
                let ends = self.rest.is_empty() || (inside && self.rest.starts_with(')'));
                if ends && !explicit && !first {
                    return Ok(total);
                }
                if divided {
                    return Err(UnitProblem::Ambiguous);
                }
                1
            };
            let factor = self.factor(inside)?;
            total = total.times(factor, sign);
            first = false;
        }
    }

    fn factor(&mut self, inside: bool) -> Result<Scale, UnitProblem> {
        if !inside && self.eat(&['(']) {
            let product = self.product(true)?;
            return if self.eat(&[')']) {
                Ok(product)
            } else {
                Err(self.malformed())
            };
        }
        if self.eat(&['1']) {
            return Ok(Scale::ONE);
        }
        let is_letter = |c: char| c.is_alphabetic() || matches!(c, '\u{b0}' | '%');
        let end = self.rest.find(|c| !is_letter(c)).unwrap_or(self.rest.len());
        if end == 0 {
            return Err(self.malformed());
        }
        let (name, rest) = self.rest.split_at(end);
        let unit = Scale::parse_unit(name, self.expected)?;
        self.rest = rest;
        let exponent = self.exponent()?;
        self.rest = self.rest.trim_start();
        Ok(Scale::ONE.times(unit, exponent))
    }

    /// Parses an exponent such as `^3`, `^-2`, `**3`, `³` or `⁻²`. A digit directly after the unit is also an exponent,
    /// as in `kg/m3`. A unit without an exponent in the text has the exponent 1.
    fn exponent(&mut self) -> Result<i32, UnitProblem> {
        let start = self
            .rest
            .strip_prefix('^')
            .or_else(|| self.rest.strip_prefix("**"));
        let body = start.unwrap_or(self.rest);
        let mut digits = String::new();
        let mut length = 0;
        for c in body.chars() {
            let Some(plain) = plain_exponent(c) else {
                break;
            };
            let is_sign = matches!(plain, '+' | '-');
            if is_sign && (!digits.is_empty() || (start.is_none() && c == plain)) {
                break;
            }
            digits.push(plain);
            length += c.len_utf8();
        }
        if digits.is_empty() && start.is_none() {
            return Ok(1);
        }
        let exponent = digits
            .parse()
            .ok()
            .filter(|e: &i32| e.abs() <= LARGEST_POWER)
            .ok_or_else(|| self.malformed())?;
        self.rest = &body[length..];
        Ok(exponent)
    }
}

/// Returns the plain character of a digit or sign, which may be superscript.
fn plain_exponent(c: char) -> Option<char> {
    const SUPERSCRIPTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹";
    match c {
        '0'..='9' | '+' | '-' => Some(c),
        '⁻' => Some('-'),
        '⁺' => Some('+'),
        _ => SUPERSCRIPTS
            .chars()
            .zip('0'..='9')
            .find(|pair| pair.0 == c)
            .map(|pair| pair.1),
    }
}
