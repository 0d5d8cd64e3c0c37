//! Quantities as a user writes them, `"30 kN"` or `"2e3 um^3/J"`, to SI numbers.
//!
//! A unit is a product or quotient of powers of prefixed units. Its dimension is checked against the one that is expected, so
//! that a pressure is never taken for a force. Scaling by powers of ten is exact: it moves the decimal exponent of the text
//! before the one rounding to `f64`, so `"5 um"` and `"0.005 mm"` are the same number, bit for bit.
//!
//! ```
//! use fretwear::units::{Dimension, parse};
//!
//! assert_eq!(parse("0.12 kN", Dimension::FORCE)?, 120.0);
//! // A wrong unit is an error that says what would be right.
//! let error = parse("120 MPa", Dimension::FORCE).unwrap_err();
//! assert!(error.to_string().contains("N"));
//! # Ok::<(), fretwear::units::UnitError>(())
//! ```

mod amount;
mod expression;

use std::fmt;

pub use amount::Amount;
use expression::Scale;

/// Exponents of the base units of a quantity.
///
/// SI counts the radian as 1. It has an exponent here so that a bare `90` is refused where an angle is wanted (degrees or
/// radians?), and `"0.6 deg"` where a friction coefficient is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Dimension {
    /// Exponent of the metre.
    pub m: i32,
    /// Exponent of the kilogram.
    pub kg: i32,
    /// Exponent of the second.
    pub s: i32,
    /// Exponent of the radian.
    pub rad: i32,
}

/// A dimension that has a name: how to speak of it and what to suggest.
struct Named {
    dimension: Dimension,
    name: &'static str,
    number: &'static str,
    units: &'static [&'static str],
}

const NAMED: [Named; 16] = [
    Named {
        dimension: Dimension::NONE,
        name: "a plain number",
        number: "0.6",
        units: &[],
    },
    Named {
        dimension: Dimension::LENGTH,
        name: "a length",
        number: "5",
        units: &["um", "mm"],
    },
    Named {
        dimension: Dimension::VOLUME,
        name: "a volume",
        number: "1",
        units: &["um^3", "mm^3"],
    },
    Named {
        dimension: Dimension::FORCE,
        name: "a force",
        number: "30",
        units: &["N", "kN"],
    },
    Named {
        dimension: Dimension::MOMENT,
        name: "a moment",
        number: "2",
        units: &["N m"],
    },
    Named {
        dimension: Dimension::PRESSURE,
        name: "a pressure",
        number: "600",
        units: &["MPa", "GPa"],
    },
    Named {
        dimension: Dimension::DENSITY,
        name: "a density",
        number: "7949",
        units: &["kg/m^3"],
    },
    Named {
        dimension: Dimension::STIFFNESS,
        name: "a stiffness",
        number: "1e4",
        units: &["N/um"],
    },
    Named {
        dimension: Dimension::CUBIC_STIFFNESS,
        name: "a cubic stiffness (force per cube of displacement)",
        number: "1e9",
        units: &["N/m^3"],
    },
    Named {
        dimension: Dimension::MASS,
        name: "a mass",
        number: "2",
        units: &["g", "kg"],
    },
    Named {
        dimension: Dimension::DAMPING,
        name: "a damping (force per velocity)",
        number: "5",
        units: &["N s/m"],
    },
    Named {
        dimension: Dimension::FREQUENCY,
        name: "a frequency",
        number: "900",
        units: &["Hz"],
    },
    Named {
        dimension: Dimension::TIME,
        name: "a time",
        number: "1",
        units: &["us", "s", "h"],
    },
    Named {
        dimension: Dimension::ACCELERATION,
        name: "an acceleration",
        number: "5",
        units: &["m/s^2"],
    },
    Named {
        dimension: Dimension::WEAR_COEFFICIENT,
        name: "a wear coefficient (volume per energy, or per load and slip)",
        number: "2e3",
        units: &["um^3/J"],
    },
    Named {
        dimension: Dimension::ANGLE,
        name: "an angle",
        number: "90",
        units: &["deg", "rad"],
    },
];

impl Dimension {
    /// A pure number.
    pub const NONE: Self = Self::of(0, 0, 0);
    /// Length \[m\].
    pub const LENGTH: Self = Self::of(1, 0, 0);
    /// Volume \[m³\].
    pub const VOLUME: Self = Self::of(3, 0, 0);
    /// Force \[N\].
    pub const FORCE: Self = Self::of(1, 1, -2);
    /// kg m²/s² of a force and its lever
    pub const MOMENT: Self = Self::of(2, 1, -2);
    /// Pressure or modulus \[Pa\].
    pub const PRESSURE: Self = Self::of(-1, 1, -2);
    /// Density \[kg/m³\].
    pub const DENSITY: Self = Self::of(-3, 1, 0);
    /// \[N/m³\]: of a force that grows with the cube of displacement.
    pub const CUBIC_STIFFNESS: Self = Self::of(-2, 1, -2);
    /// Force per length \[N/m\].
    pub const STIFFNESS: Self = Self::of(0, 1, -2);
    /// Mass \[kg\].
    pub const MASS: Self = Self::of(0, 1, 0);
    /// Force per velocity \[N s/m\].
    pub const DAMPING: Self = Self::of(0, 1, -1);
    /// Frequency \[Hz\].
    pub const FREQUENCY: Self = Self::of(0, 0, -1);
    /// Time \[s\].
    pub const TIME: Self = Self::of(0, 0, 1);
    /// Acceleration \[m/s²\].
    pub const ACCELERATION: Self = Self::of(1, 0, -2);
    /// Wear volume per dissipated energy \[m³/J\], [A eq. 2.5].
    pub const WEAR_COEFFICIENT: Self = Self::of(1, -1, 2);
    /// Angle \[rad\].
    pub const ANGLE: Self = Self {
        m: 0,
        kg: 0,
        s: 0,
        rad: 1,
    };

    const fn of(m: i32, kg: i32, s: i32) -> Self {
        Self { m, kg, s, rad: 0 }
    }

    fn named(self) -> Option<&'static Named> {
        NAMED.iter().find(|named| named.dimension == self)
    }

    /// The units that are suggested for it; none for a plain number, and for what has no name.
    pub fn units(self) -> &'static [&'static str] {
        self.named().map_or(&[], |named| named.units)
    }

    fn plus(self, other: Self, times: i32) -> Self {
        Self {
            m: self.m + times * other.m,
            kg: self.kg + times * other.kg,
            s: self.s + times * other.s,
            rad: self.rad + times * other.rad,
        }
    }

    /// What is wanted, with examples: of the given number if there is one, so that a missing unit can be filled in.
    fn wanted(self, number: Option<&str>) -> String {
        let Some(named) = self.named() else {
            return format!("{self} is wanted");
        };
        let number = number.unwrap_or(named.number);
        if named.units.is_empty() {
            return format!("{} is wanted, such as {}", named.name, named.number);
        }
        let examples: Vec<String> = named
            .units
            .iter()
            .map(|unit| format!("\"{number} {unit}\""))
            .collect();
        format!(
            "{} is wanted, such as {}",
            named.name,
            examples.join(" or ")
        )
    }
}

/// The name of the dimension where it has one (`a force`), else its base units (`a quantity in m^2 s^-1`).
impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(named) = self.named() {
            return f.write_str(named.name);
        }
        f.write_str("a quantity in")?;
        for (symbol, exponent) in [
            ("kg", self.kg),
            ("m", self.m),
            ("s", self.s),
            ("rad", self.rad),
        ] {
            match exponent {
                0 => {}
                1 => write!(f, " {symbol}")?,
                _ => write!(f, " {symbol}^{exponent}")?,
            }
        }
        Ok(())
    }
}

/// A text that is not the quantity it should be.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitError {
    /// The text as written.
    pub text: String,
    /// The dimension it should have.
    pub expected: Dimension,
    /// What is wrong.
    pub problem: UnitProblem,
}

/// What is wrong with a quantity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnitProblem {
    /// Nothing but blanks.
    #[error("is empty")]
    Empty,
    /// The text does not begin with a number.
    #[error("does not start with a number")]
    NoNumber,
    /// NaN, infinite, or beyond what `f64` holds.
    #[error("is not a finite number")]
    NotFinite,
    /// A decimal comma.
    #[error("has a comma where the decimal point should be")]
    DecimalComma,
    /// A unit that is worth nothing, or less.
    #[error("is not worth more than zero")]
    NoWorth,
    /// A bare number for a dimensional quantity.
    #[error("has no unit")]
    NoUnit,
    /// A unit that does not exist.
    #[error("has the unknown unit \"{unit}\"{}", did_you_mean(.nearest))]
    UnknownUnit {
        /// The unit as written.
        unit: String,
        /// The known unit that looks most like it.
        nearest: Option<String>,
    },
    /// A unit of inches, pounds or kilograms-force, or a name that is none of SI.
    #[error("has the unit \"{unit}\", which is not read: write it in SI, with 1 {unit} = {worth}")]
    Customary {
        /// The unit as written.
        unit: &'static str,
        /// What one of it is worth.
        worth: &'static str,
    },
    /// A quantity of another dimension.
    #[error("is {found}")]
    WrongDimension {
        /// The dimension of the text.
        found: Dimension,
    },
    /// `a/b c`, which some read as (a/b) c and others as a/(b c).
    #[error("multiplies after a division: put the divisor in parentheses, as in \"mm^3/(N m)\"")]
    Ambiguous,
    /// Something that is no part of a unit.
    #[error("cannot be read from \"{rest}\" on")]
    Malformed {
        /// The part that was not understood.
        rest: String,
    },
}

fn did_you_mean(nearest: &Option<String>) -> String {
    nearest
        .as_ref()
        .map_or_else(String::new, |unit| format!(" (did you mean \"{unit}\"?)"))
}

impl std::error::Error for UnitError {}

impl fmt::Display for UnitError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let number = (self.problem == UnitProblem::NoUnit).then_some(self.text.trim());
        write!(
            f,
            "\"{}\" {}; {}",
            self.text,
            self.problem,
            self.expected.wanted(number)
        )
    }
}

/// Sizes of the numbers that are computed with, in SI units: cubes of others, and what is left of their differences, are no numbers any more.
pub const SIZES: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// The SI value of a text such as `"30 kN"`, whose dimension must be `expected`.
///
/// # Errors
/// [`UnitError`] says what is wrong with the text, and what would be right.
pub fn parse(text: &str, expected: Dimension) -> Result<f64, UnitError> {
    let wrong = |problem| UnitError {
        text: text.to_owned(),
        expected,
        problem,
    };
    let (number, unit) = Decimal::split(text.trim()).map_err(wrong)?;
    let scale = if unit.is_empty() {
        if expected != Dimension::NONE {
            return Err(wrong(UnitProblem::NoUnit));
        }
        Scale::ONE
    } else {
        Scale::parse(unit, expected).map_err(wrong)?
    };
    if scale.dimension != expected {
        return Err(wrong(UnitProblem::WrongDimension {
            found: scale.dimension,
        }));
    }
    let value = number.scaled(scale.power) * scale.factor;
    if !value.is_finite() {
        return Err(wrong(UnitProblem::NotFinite));
    }
    // A negative zero would make equal quantities differ in a hash of their digits.
    Ok(value + 0.0)
}

/// The SI value of a text whatever its dimension is, and that.
///
/// # Errors
/// What is wrong with the text.
pub fn parse_any(text: &str) -> Result<(f64, Dimension), UnitProblem> {
    let (_, unit) = Decimal::split(text.trim())?;
    let dimension = match unit.is_empty() {
        true => Dimension::NONE,
        false => Scale::parse(unit, Dimension::NONE)?.dimension,
    };
    let value = parse(text, dimension).map_err(|error| error.problem)?;
    Ok((value, dimension))
}

/// The SI value of one unit, such as 1e-6 for `"um"`, or of a number of them, such as 0.0254 for `"25.4 mm"`.
///
/// # Errors
/// As [`parse`].
pub fn parse_unit(text: &str, expected: Dimension) -> Result<f64, UnitError> {
    let one = match text
        .trim()
        .starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    {
        true => text.to_owned(),
        false => format!("1 {}", text.trim()),
    };
    let wrong = |problem| UnitError {
        text: text.to_owned(),
        expected,
        problem,
    };
    match parse(&one, expected) {
        Ok(worth) if worth > 0.0 => Ok(worth),
        Ok(_) => Err(wrong(UnitProblem::NoWorth)),
        Err(error) => Err(wrong(error.problem)),
    }
}

/// Whether a force or a pressure is in the unit of a text, as in `"2e-8 mm^3/(N mm)"`: of a wear coefficient that unit does not say
/// which law it belongs to.
pub fn has_force(text: &str) -> bool {
    let is_one = |name: &str| {
        ["N", "Nm", "Pa", "bar"]
            .iter()
            .any(|unit| name.ends_with(unit))
    };
    text.split(|c: char| !c.is_alphabetic()).any(is_one)
}

/// The value of a number without unit: itself for a pure number, an error for everything else.
///
/// # Errors
/// As [`parse`].
pub fn from_number(number: f64, expected: Dimension) -> Result<f64, UnitError> {
    let problem = if !number.is_finite() {
        UnitProblem::NotFinite
    } else if expected != Dimension::NONE {
        UnitProblem::NoUnit
    } else {
        return Ok(number + 0.0);
    };
    Err(UnitError {
        text: number.to_string(),
        expected,
        problem,
    })
}

/// A decimal number whose exponent has not been applied yet.
struct Decimal {
    /// Sign, digits and at most one point.
    mantissa: String,
    exponent: i64,
}

/// Exponents beyond this are 0 or infinite whatever the mantissa of a text of sane length; they are cut so as not to overflow.
const LARGEST_EXPONENT: i64 = 1_000_000;

impl Decimal {
    /// Splits a text into its leading number and what follows it.
    fn split(text: &str) -> Result<(Self, &str), UnitProblem> {
        if text.is_empty() {
            return Err(UnitProblem::Empty);
        }
        let bytes = text.as_bytes();
        let digits_from = |start: usize| {
            bytes[start..]
                .iter()
                .take_while(|b| b.is_ascii_digit() || **b == b'_')
                .count()
                + start
        };
        let sign = usize::from(matches!(bytes[0], b'+' | b'-'));
        let mut end = digits_from(sign);
        if bytes.get(end) == Some(&b'.') {
            end = digits_from(end + 1);
        }
        let mantissa = text[..end].replace('_', "");
        if !mantissa.contains(|c: char| c.is_ascii_digit()) {
            let word = text[sign..].to_lowercase();
            return Err(
                if ["nan", "inf"]
                    .iter()
                    .any(|special| word.starts_with(special))
                {
                    UnitProblem::NotFinite
                } else {
                    UnitProblem::NoNumber
                },
            );
        }
        if bytes.get(end) == Some(&b',') {
            return Err(UnitProblem::DecimalComma);
        }
        let mut exponent = 0;
        if matches!(bytes.get(end), Some(b'e' | b'E')) {
            let negative = bytes.get(end + 1) == Some(&b'-');
            let start = end + 1 + usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
            let stop = digits_from(start.min(bytes.len()));
            let digits = text.get(start..stop).unwrap_or("").replace('_', "");
            if !digits.is_empty() {
                let size = digits
                    .parse()
                    .unwrap_or(LARGEST_EXPONENT)
                    .min(LARGEST_EXPONENT);
                exponent = if negative { -size } else { size };
                end = stop;
            }
        }
        Ok((Decimal { mantissa, exponent }, text[end..].trim_start()))
    }

    /// The number times 10^power, rounded once.
    fn scaled(&self, power: i32) -> f64 {
        let text = format!("{}e{}", self.mantissa, self.exponent + i64::from(power));
        text.parse().unwrap_or(f64::NAN)
    }
}
