//! Converts texts of quantities, such as `"30 kN"` or `"2e3 um^3/J"`, to numbers in SI units.
//!
//! A unit is a product or quotient of powers of prefixed units. The parser rejects a unit whose dimension differs from
//! the expected dimension, for example a pressure instead of a force. The scaling by powers of ten is exact. The parser
//! shifts the decimal exponent of the text and then rounds the number to `f64`. Because the scaling is exact, `"5 um"`
//! and `"0.005 mm"` give the same number, bit for bit.
//!
//! ```
//! use fretwear::units::{Dimension, parse};
//!
//! assert_eq!(parse("0.12 kN", Dimension::FORCE)?, 120.0);
//! // The error for a wrong unit names the expected quantity.
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
/// SI counts the radian as 1. `Dimension` has an exponent for the radian. The exponent of the radian distinguishes
/// angles from numbers without a unit. The parser rejects the angle `90`, because the angle can be in degrees or
/// radians. The parser rejects the friction coefficient `"0.6 deg"`.
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

/// Dimension with a name, and with the example number and units that an error message suggests.
struct NamedDimension {
    dimension: Dimension,
    name: &'static str,
    number: &'static str,
    units: &'static [&'static str],
}

const NAMED: [NamedDimension; 16] = [
    NamedDimension {
        dimension: Dimension::NONE,
        name: "a plain number",
        number: "0.6",
        units: &[],
    },
    NamedDimension {
        dimension: Dimension::LENGTH,
        name: "a length",
        number: "5",
        units: &["um", "mm"],
    },
    NamedDimension {
        dimension: Dimension::VOLUME,
        name: "a volume",
        number: "1",
        units: &["um^3", "mm^3"],
    },
    NamedDimension {
        dimension: Dimension::FORCE,
        name: "a force",
        number: "30",
        units: &["N", "kN"],
    },
    NamedDimension {
        dimension: Dimension::MOMENT,
        name: "a moment",
        number: "2",
        units: &["N m"],
    },
    NamedDimension {
        dimension: Dimension::PRESSURE,
        name: "a pressure",
        number: "600",
        units: &["MPa", "GPa"],
    },
    NamedDimension {
        dimension: Dimension::DENSITY,
        name: "a density",
        number: "7949",
        units: &["kg/m^3"],
    },
    NamedDimension {
        dimension: Dimension::STIFFNESS,
        name: "a stiffness",
        number: "1e4",
        units: &["N/um"],
    },
    NamedDimension {
        dimension: Dimension::CUBIC_STIFFNESS,
        name: "a cubic stiffness (force per cube of displacement)",
        number: "1e9",
        units: &["N/m^3"],
    },
    NamedDimension {
        dimension: Dimension::MASS,
        name: "a mass",
        number: "2",
        units: &["g", "kg"],
    },
    NamedDimension {
        dimension: Dimension::DAMPING,
        name: "a damping (force per velocity)",
        number: "5",
        units: &["N s/m"],
    },
    NamedDimension {
        dimension: Dimension::FREQUENCY,
        name: "a frequency",
        number: "900",
        units: &["Hz"],
    },
    NamedDimension {
        dimension: Dimension::TIME,
        name: "a time",
        number: "1",
        units: &["us", "s", "h"],
    },
    NamedDimension {
        dimension: Dimension::ACCELERATION,
        name: "an acceleration",
        number: "5",
        units: &["m/s^2"],
    },
    NamedDimension {
        dimension: Dimension::WEAR_COEFFICIENT,
        name: "a wear coefficient (volume per energy, or per load and slip)",
        number: "2e3",
        units: &["um^3/J"],
    },
    NamedDimension {
        dimension: Dimension::ANGLE,
        name: "an angle",
        number: "90",
        units: &["deg", "rad"],
    },
];

impl Dimension {
    /// Pure number.
    pub const NONE: Self = Self::of(0, 0, 0);
    /// Length \[m\].
    pub const LENGTH: Self = Self::of(1, 0, 0);
    /// Volume \[m³\].
    pub const VOLUME: Self = Self::of(3, 0, 0);
    /// Force \[N\].
    pub const FORCE: Self = Self::of(1, 1, -2);
    /// Moment: force times lever arm \[N m\].
    pub const MOMENT: Self = Self::of(2, 1, -2);
    /// Pressure or modulus \[Pa\].
    pub const PRESSURE: Self = Self::of(-1, 1, -2);
    /// Density \[kg/m³\].
    pub const DENSITY: Self = Self::of(-3, 1, 0);
    /// Force per cube of displacement \[N/m³\].
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

    fn named(self) -> Option<&'static NamedDimension> {
        NAMED.iter().find(|named| named.dimension == self)
    }

    /// Returns the units that error messages suggest for the dimension, such as `N` for a force. The list of units is
    /// empty for a plain number and for a dimension without a name.
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

    /// Returns a text with the expected quantity and examples. If `number` is given, the examples contain `number`, so
    /// that the user can copy an example.
    fn expectation(self, number: Option<&str>) -> String {
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

/// Writes the name of the dimension, for example `a force`. For a dimension without a name, `fmt` writes the base
/// units, for example `a quantity in m^2 s^-1`.
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

/// Error for a text that is not the expected quantity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UnitError {
    /// Text of the rejected quantity, as the user wrote the text.
    pub text: String,
    /// Expected dimension.
    pub expected: Dimension,
    /// Reason for the rejection.
    pub problem: UnitProblem,
}

/// Reason to reject the text of a quantity.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum UnitProblem {
    /// The text is empty or blank.
    #[error("is empty")]
    Empty,
    /// The text does not begin with a number.
    #[error("does not start with a number")]
    NoNumber,
    /// The number of the quantity is NaN, infinite, or too large for `f64`.
    #[error("is not a finite number")]
    NotFinite,
    /// The number has a decimal comma.
    #[error("has a comma where the decimal point should be")]
    DecimalComma,
    /// A unit, or a multiple of one, has a value of zero or less.
    #[error("is not greater than zero")]
    NotPositive,
    /// The number lacks a unit, and the quantity has a dimension.
    #[error("has no unit")]
    MissingUnit,
    /// The unit does not exist.
    #[error("has the unknown unit \"{unit}\"{}", did_you_mean(.nearest))]
    UnknownUnit {
        /// The unit as written.
        unit: String,
        /// Most similar known unit.
        nearest: Option<String>,
    },
    /// The unit is customary (inches, pounds, kilograms-force) or has another name that SI does not know.
    #[error(
        "has the unit \"{unit}\", which is not supported: write it in SI, with 1 {unit} = {worth}"
    )]
    Customary {
        /// The unit as written.
        unit: &'static str,
        /// Value of one customary unit in SI units.
        worth: &'static str,
    },
    /// The quantity has another dimension.
    #[error("is {found}")]
    WrongDimension {
        /// Dimension of the text.
        found: Dimension,
    },
    /// The unit multiplies after a division. Some read `a/b c` as (a/b) c, others as a/(b c).
    #[error("multiplies after a division: put the divisor in parentheses, as in \"mm^3/(N m)\"")]
    Ambiguous,
    /// The text contains something that is not part of a unit.
    #[error("cannot be read from \"{rest}\" on")]
    Malformed {
        /// Rest of the text, from the first character that the parser rejects.
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
        let number = (self.problem == UnitProblem::MissingUnit).then_some(self.text.trim());
        write!(
            f,
            "\"{}\" {}; {}",
            self.text,
            self.problem,
            self.expected.expectation(number)
        )
    }
}

/// Range of absolute values that the program computes with, in SI units. If a number lies outside `COMPUTABLE_RANGE`,
/// the cube of the number and differences of such cubes may overflow or vanish.
pub const COMPUTABLE_RANGE: std::ops::RangeInclusive<f64> = 1e-60..=1e60;

/// Parses a quantity such as `"30 kN"` and returns the value of the quantity in SI units. The quantity must have the
/// dimension `expected`.
///
/// # Errors
/// Returns a [`UnitError`] that states the error in the text and the expected quantity.
pub fn parse(text: &str, expected: Dimension) -> Result<f64, UnitError> {
    let unit_error = |problem| UnitError {
        text: text.to_owned(),
        expected,
        problem,
    };
    let (number, unit) = Decimal::split(text.trim()).map_err(unit_error)?;
    let scale = if unit.is_empty() {
        if expected != Dimension::NONE {
            return Err(unit_error(UnitProblem::MissingUnit));
        }
        Scale::ONE
    } else {
        Scale::parse(unit, expected).map_err(unit_error)?
    };
    if scale.dimension != expected {
        return Err(unit_error(UnitProblem::WrongDimension {
            found: scale.dimension,
        }));
    }
    let value = number.scaled(scale.power) * scale.factor;
    if !value.is_finite() {
        return Err(unit_error(UnitProblem::NotFinite));
    }
    // Adding 0.0 removes the sign of a negative zero. With the sign, equal quantities could differ in a hash of their
    // digits.
    Ok(value + 0.0)
}

/// Parses a text of any dimension and returns its SI value and its dimension.
///
/// # Errors
/// Returns the [`UnitProblem`] of the text.
pub fn parse_any(text: &str) -> Result<(f64, Dimension), UnitProblem> {
    let (_, unit) = Decimal::split(text.trim())?;
    let dimension = match unit.is_empty() {
        true => Dimension::NONE,
        false => Scale::parse(unit, Dimension::NONE)?.dimension,
    };
    let value = parse(text, dimension).map_err(|error| error.problem)?;
    Ok((value, dimension))
}

/// Converts a unit or a multiple of a unit to a number in SI units. The text `"um"` gives 1e-6, and `"25.4 mm"` gives
/// 0.0254.
///
/// # Errors
/// `parse_unit` returns the same errors as [`parse`], and an error for a value that is not positive.
pub fn parse_unit(text: &str, expected: Dimension) -> Result<f64, UnitError> {
    let quantity = match text
        .trim()
        .starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c))
    {
        true => text.to_owned(),
        false => format!("1 {}", text.trim()),
    };
    let unit_error = |problem| UnitError {
        text: text.to_owned(),
        expected,
        problem,
    };
    match parse(&quantity, expected) {
        Ok(value) if value > 0.0 => Ok(value),
        Ok(_) => Err(unit_error(UnitProblem::NotPositive)),
        Err(error) => Err(unit_error(error.problem)),
    }
}

/// Returns whether the unit of a text contains a force or a pressure, as in `"2e-8 mm^3/(N mm)"`. The wear law of a
/// wear coefficient is ambiguous if the unit of the coefficient contains a force or a pressure.
pub fn has_force(text: &str) -> bool {
    let is_force_unit = |name: &str| {
        ["N", "Nm", "Pa", "bar"]
            .iter()
            .any(|unit| name.ends_with(unit))
    };
    text.split(|c: char| !c.is_alphabetic()).any(is_force_unit)
}

/// Checks a number without a unit. Returns the number if `expected` is the dimension of a pure number, and an error
/// otherwise.
///
/// # Errors
/// `from_number` returns the same errors as [`parse`].
pub fn from_number(number: f64, expected: Dimension) -> Result<f64, UnitError> {
    let problem = if !number.is_finite() {
        UnitProblem::NotFinite
    } else if expected != Dimension::NONE {
        UnitProblem::MissingUnit
    } else {
        return Ok(number + 0.0);
    };
    Err(UnitError {
        text: number.to_string(),
        expected,
        problem,
    })
}

/// Decimal number whose exponent is not applied yet.
struct Decimal {
    /// Sign, digits and at most one decimal point.
    mantissa: String,
    exponent: i64,
}

/// Largest exponent that the parser keeps. The parser reduces larger exponents to `LARGEST_EXPONENT` to avoid overflow.
/// The reduced exponent gives the same number as the original exponent: 0 or infinity. Only a mantissa of about a
/// million digits gives a different number.
const LARGEST_EXPONENT: i64 = 1_000_000;

impl Decimal {
    /// Splits a text into the number at the beginning and the rest of the text.
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

    /// Returns the number times 10^power, rounded once.
    fn scaled(&self, power: i32) -> f64 {
        let text = format!("{}e{}", self.mantissa, self.exponent + i64::from(power));
        text.parse().unwrap_or(f64::NAN)
    }
}
