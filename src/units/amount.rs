//! Numbers with the unit in which they are written.

use std::fmt;

use super::Decimal;

/// Number and unit, as in `"5 um"`. The unit is not interpreted.
#[derive(Debug, Clone, PartialEq)]
pub struct Amount {
    /// Number, in `unit`.
    pub number: f64,
    /// Unit; empty for a plain number.
    pub unit: String,
}

impl Amount {
    /// Parses a finite number with or without a unit. Returns `None` for any other text.
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
