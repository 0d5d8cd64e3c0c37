//! How figures are said: units, ratios, and four significant digits.

/// Name, size in SI units, and how many make an SI unit. A figure is multiplied by the one, a bound divided by the other.
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
    fn say(self, value: f64) -> String {
        let said = format!("{} {}", short(value * self.2), self.0);
        said.trim_end().to_owned()
    }

    /// What a value should be, where it is not.
    pub fn beyond(self, value: f64, [least, most]: [f64; 2]) -> Option<String> {
        let (side, bound) = match value {
            v if v < least => ("least", least),
            v if v > most => ("most", most),
            _ => return None,
        };
        let said = format!("at {side} {} {}", short(bound / self.1), self.0);
        Some(said.trim_end().to_owned())
    }
}

/// A figure and its text.
pub struct Figure {
    pub value: f64,
    /// None if the text is the value in the unit of the row.
    pub words: Option<String>,
    /// The key to look at, where the figure names it and not its row.
    pub key: Option<&'static str>,
}

impl Figure {
    pub fn words(self, unit: Unit) -> String {
        self.words.unwrap_or_else(|| unit.say(self.value))
    }
}

/// A figure that is said in the unit of its row.
pub fn number(value: f64) -> Option<Figure> {
    Some(Figure {
        value,
        words: None,
        key: None,
    })
}

/// A figure that has a text of its own.
pub fn worded(value: f64, words: String) -> Option<Figure> {
    let words = Some(words);
    number(value).map(|figure| Figure { words, ..figure })
}

/// A ratio, said with its first part.
pub fn part(value: f64, whole: f64, unit: Unit) -> Option<Figure> {
    let ratio = value / whole;
    worded(ratio, format!("{} ({})", short(ratio), unit.say(value)))
}

/// A ratio, said with both parts.
pub fn over(value: f64, other: f64, unit: Unit) -> Option<Figure> {
    over_words(value, other, unit, "over")
}

/// A ratio to an estimate, said with both parts.
pub fn over_some(value: f64, other: f64, unit: Unit) -> Option<Figure> {
    over_words(value, other, unit, "over some")
}

fn over_words(value: f64, other: f64, unit: Unit, over: &str) -> Option<Figure> {
    let (ratio, parts) = (value / other, [unit.say(value), unit.say(other)]);
    let words = format!("{} ({} {over} {})", short(ratio), parts[0], parts[1]);
    worded(ratio, words)
}

/// A pressure over the contact modulus.
pub fn strain(pressure: f64, modulus: f64) -> Option<Figure> {
    let ratio = pressure / modulus;
    worded(ratio, format!("{ratio:.2e} ({})", MPA.say(pressure)))
}

/// Four significant digits.
pub fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    match rounded.abs() {
        size if size == 0.0 || (1e-3..1e6).contains(&size) => format!("{rounded}"),
        _ => format!("{rounded:e}"),
    }
}
