//! Formatting of figures: units, ratios, and four significant digits.

/// Unit: name, size in SI units, and the inverse of the size. Figures are multiplied by the inverse, bounds divided by
/// the size.
#[derive(Clone, Copy)]
pub struct Unit(&'static str, f64, f64);

pub const NONE: Unit = Unit("", 1.0, 1.0);
pub const N: Unit = Unit("N", 1.0, 1.0);
pub const KG: Unit = Unit("kg", 1.0, 1.0);
pub const KG_PER_M3: Unit = Unit("kg/m³", 1.0, 1.0);
pub const M_PER_S: Unit = Unit("m/s", 1.0, 1.0);
pub const MM: Unit = Unit("mm", 1e-3, 1e3);
pub const UM: Unit = Unit("µm", 1e-6, 1e6);
pub const MPA: Unit = Unit("MPa", 1e6, 1e-6);
pub const GPA: Unit = Unit("GPa", 1e9, 1e-9);
pub const N_PER_UM: Unit = Unit("N/µm", 1e6, 1e-6);
pub const UM3_PER_J: Unit = Unit("µm³/J", 1e-18, 1e18);

impl Unit {
    fn format(self, value: f64) -> String {
        let text = format!("{} {}", short(value * self.2), self.0);
        text.trim_end().to_owned()
    }

    /// Returns the bound that a value violates, in words; `None` if it lies within its bounds.
    pub fn violated_bound(self, value: f64, [least, most]: [f64; 2]) -> Option<String> {
        let (side, bound) = match value {
            v if v < least => ("least", least),
            v if v > most => ("most", most),
            _ => return None,
        };
        let text = format!("at {side} {} {}", short(bound / self.1), self.0);
        Some(text.trim_end().to_owned())
    }
}

/// Figure with its text.
pub struct Figure {
    pub value: f64,
    /// `None` if the text is the value in the unit of the row.
    pub words: Option<String>,
    /// Key to check, if the figure determines it and not the row.
    pub key: Option<&'static str>,
}

impl Figure {
    pub fn words(self, unit: Unit) -> String {
        self.words.unwrap_or_else(|| unit.format(self.value))
    }
}

/// Returns a figure whose text is the value in the unit of the row.
pub fn number(value: f64) -> Option<Figure> {
    Some(Figure {
        value,
        words: None,
        key: None,
    })
}

/// Returns a figure with the text `words` in place of a number in the unit of the row.
pub fn worded(value: f64, words: String) -> Option<Figure> {
    let words = Some(words);
    number(value).map(|figure| Figure { words, ..figure })
}

/// Returns the ratio of `value` to `whole`. The text of the figure contains the ratio and `value`.
pub fn part(value: f64, whole: f64, unit: Unit) -> Option<Figure> {
    let ratio = value / whole;
    worded(ratio, format!("{} ({})", short(ratio), unit.format(value)))
}

/// Returns the ratio of `value` to `other`. The text of the figure contains the ratio, `value` and `other`.
pub fn over(value: f64, other: f64, unit: Unit) -> Option<Figure> {
    over_words(value, other, unit, "over")
}

/// A ratio to an estimate, with numerator and denominator in the text.
pub fn over_estimate(value: f64, other: f64, unit: Unit) -> Option<Figure> {
    over_words(value, other, unit, "over some")
}

fn over_words(value: f64, other: f64, unit: Unit, over: &str) -> Option<Figure> {
    let (ratio, parts) = (value / other, [unit.format(value), unit.format(other)]);
    let words = format!("{} ({} {over} {})", short(ratio), parts[0], parts[1]);
    worded(ratio, words)
}

/// A pressure over the contact modulus.
pub fn strain(pressure: f64, modulus: f64) -> Option<Figure> {
    let ratio = pressure / modulus;
    worded(ratio, format!("{ratio:.2e} ({})", MPA.format(pressure)))
}

/// Formats a number with four significant digits.
pub fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        size if size == 0.0 || (1e-3..1e6).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
