//! Formatting of quantities in engineering units.

/// Unit of a shown quantity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Symbol of the unit, empty for a pure number.
    pub symbol: &'static str,
    /// Size of the unit in SI.
    pub size: f64,
}

impl Unit {
    /// Formats a value in the unit `self` with `significant` digits and keeps trailing zeros, such as 3.50.
    ///
    /// Frequencies have one decimal, because a resonance shifts by less than its third digit.
    pub fn rounded(&self, value: f64, significant: usize) -> String {
        let value = value / self.size;
        if self.symbol == "Hz" {
            return format!("{value:.1}");
        }
        if value == 0.0 || !value.is_finite() {
            return four_digits(value);
        }
        // The exponent is taken from the rounded value, because 9.996 rounds to 10.0 with one digit more.
        let text = format!("{:.*e}", significant - 1, value.abs());
        let exponent = text
            .split_once('e')
            .and_then(|(_, e)| e.parse::<i32>().ok());
        match exponent {
            Some(exponent @ -3..6) => {
                let short: f64 = text.parse().unwrap_or(value);
                let decimals = (significant as i32 - 1 - exponent).max(0) as usize;
                format!("{}{short:.decimals$}", if value < 0.0 { "−" } else { "" })
            }
            _ => significant_digits(value, significant as i32),
        }
    }
}

/// Units of a quantity, ascending.
pub type Units = &'static [Unit];

const fn unit(symbol: &'static str, size: f64) -> Unit {
    Unit { symbol, size }
}

/// Heights, depths, amplitudes.
pub const LENGTH: Units = &[unit("nm", 1e-9), unit("µm", 1e-6), unit("mm", 1e-3)];
/// Pressure.
pub const PRESSURE: Units = &[unit("Pa", 1.0), unit("kPa", 1e3), unit("MPa", 1e6)];
/// Force.
pub const FORCE: Units = &[unit("N", 1.0), unit("kN", 1e3)];
/// Contact stiffness.
pub const STIFFNESS: Units = &[unit("N/m", 1.0), unit("N/µm", 1e6)];
/// Energy.
pub const ENERGY: Units = &[
    unit("µJ", 1e-6),
    unit("mJ", 1e-3),
    unit("J", 1.0),
    unit("kJ", 1e3),
];
/// Area.
pub const AREA: Units = &[unit("mm²", 1e-6)];
/// Worn volume. Every worn volume is shown in mm³, because a reader cannot compare numbers in µm³ and mm³ by eye.
pub const VOLUME: Units = &[unit("mm³", 1e-9)];
/// Worn volume per cycle.
pub const VOLUME_RATE: Units = &[unit("µm³ per cycle", 1e-18), unit("mm³ per cycle", 1e-9)];
/// Frequency.
pub const FREQUENCY: Units = &[unit("Hz", 1.0)];
/// Vibration cycles.
pub const CYCLES: Units = &[
    unit("cycles", 1.0),
    unit("10³ cycles", 1e3),
    unit("10⁶ cycles", 1e6),
];
/// Shares.
pub const SHARE: Units = &[unit("%", 0.01)];
/// Pure numbers.
pub const NUMBER: Units = &[unit("", 1.0)];
/// Angles.
pub const ANGLE: Units = &[unit("°", std::f64::consts::PI / 180.0)];

/// Smallest value shown in a unit that is more than 1000 times the next smaller unit. The smallest value shown in other
/// units is 1.
const LEAST: f64 = 0.1;

/// Selects the unit for values up to `largest`.
pub fn unit_of(units: Units, largest: f64) -> Unit {
    let fits = |k: &usize| {
        let wide = *k > 0 && units[*k].size > 2e3 * units[*k - 1].size;
        let least = if wide { LEAST } else { 1.0 };
        largest.is_finite() && largest.abs() >= least * units[*k].size
    };
    let best = (0..units.len()).rev().find(fits).unwrap_or(0);
    units[best]
}

/// Returns the largest finite magnitude.
pub fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    let finite = values.into_iter().filter(|value| value.is_finite());
    finite.fold(0.0, |most: f64, value| most.max(value.abs()))
}

/// Formats a value with four significant digits.
pub fn four_digits(value: f64) -> String {
    significant_digits(value, 4)
}

/// Formats a value with the given number of significant digits, without trailing zeros.
pub fn significant_digits(value: f64, significant: i32) -> String {
    if value.is_nan() {
        return "–".to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    // The exponent is taken from the rounded value, because 9.9996 rounds to 10.00 with one digit more.
    let text = format!("{:.*e}", (significant - 1) as usize, value.abs());
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let sign = if value < 0.0 { "−" } else { "" };
    let bare = |text: &str| match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_owned(),
        false => text.to_owned(),
    };
    if (-3..6).contains(&exponent) {
        let decimals = (significant - 1 - exponent).max(0) as usize;
        let rounded: f64 = text.parse().unwrap_or(0.0);
        format!("{sign}{}", bare(&format!("{rounded:.decimals$}")))
    } else {
        let mantissa = bare(mantissa);
        let power = format!("10{}", raised(exponent));
        match mantissa.as_str() {
            "1" => format!("{sign}{power}"),
            _ => format!("{sign}{mantissa}·{power}"),
        }
    }
}

/// Formats a whole number as a superscript.
fn raised(exponent: i32) -> String {
    let raise = |digit: char| match digit {
        '-' => '⁻',
        '1' => '¹',
        '2' => '²',
        '3' => '³',
        digit => char::from_u32('⁰' as u32 + digit as u32 - '0' as u32).unwrap_or(digit),
    };
    exponent.to_string().chars().map(raise).collect()
}

/// Formats a value in the unit that suits it.
pub fn with_best_unit(value: f64, units: Units) -> String {
    with_unit(value, unit_of(units, value.abs()))
}

/// Formats a value in the given unit.
pub fn with_unit(value: f64, unit: Unit) -> String {
    let space = if unit.symbol.is_empty() || unit.symbol == "°" {
        ""
    } else {
        "\u{a0}"
    };
    // A resonance shifts by less than its fourth digit.
    let significant = if unit.symbol == "Hz" { 5 } else { 4 };
    let number = significant_digits(value / unit.size, significant);
    if value == 0.0
        && let Some(("10³" | "10⁶", plain)) = unit.symbol.split_once(' ')
    {
        return format!("0\u{a0}{plain}");
    }
    // "2.5·10⁶ cycles", not "2.5 10⁶ cycles"; "10⁷ cycles", not "10·10⁶ cycles".
    let space = if let Some((_, plain)) = unit.symbol.split_once(' ')
        && unit.symbol.starts_with("10")
    {
        let power = value.abs().log10().round();
        if value == 10f64.powf(power) {
            return format!("10{}\u{a0}{plain}", raised(power as i32));
        }
        "·"
    } else {
        space
    };
    format!("{number}{space}{}", unit.symbol)
}
