//! A number in the unit that it is written in, whatever that is.

use std::fmt;

use super::Decimal;

/// A number and its unit, as in `"5 um"`; what the unit means is not looked at.
#[derive(Debug, Clone, PartialEq)]
pub struct Amount {
    /// The number, in the unit.
    pub number: f64,
    /// The unit; empty for a plain number.
    pub unit: String,
}

impl Amount {
    /// Reads a finite number, or one with a unit; none if the text is neither.
    pub fn parse(text: &str) -> Option<Amount> {
        let text = text.trim();
        let (_, unit) = Decimal::split(text).ok()?;
        let number = text.strip_suffix(unit)?.trim().replace('_', "");
        let number: f64 = number.parse().ok()?;
        number.is_finite().then(|| Amount {
            number,
            unit: unit.trim().to_owned(),
        })
    }
}

impl fmt::Display for Amount {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Amount { number, unit } = self;
        match unit.as_str() {
            "" => write!(f, "{number:?}"),
            unit => write!(f, "{number:?} {unit}"),
        }
    }
}
