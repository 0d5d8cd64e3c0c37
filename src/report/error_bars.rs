//! Error bars of the summary and the figures that they belong to.

/// Columns with relative error bars, each with the columns of the summary that it applies to.
pub const ERROR_BARS: [(&str, &[&str]); 12] = [
    (
        "error_wear_volume",
        &["wear_volume", "dissipated_energy_total"],
    ),
    (
        "error_dissipated_energy",
        &["dissipated_energy", "wear_rate"],
    ),
    ("error_corrected_area", &["corrected_area_fraction"]),
    ("error_loaded_area", &["loaded_area_fraction"]),
    ("error_max_pressure", &["max_pressure"]),
    ("error_largest_depth", &["largest_depth"]),
    ("error_depth_99", &["depth_99"]),
    ("error_normal_load", &["normal_load"]),
    ("error_kn", &["kn"]),
    ("error_kt", &["kt"]),
    ("error_resonance_frequency", &["resonance_frequency"]),
    ("error_peak_amplitude", &["peak_amplitude"]),
];

/// Returns the column with the error bar of a column of the summary.
pub fn error_bar_of(column: &str) -> Option<&'static str> {
    let mut bars = ERROR_BARS.iter();
    bars.find(|(_, figures)| figures.contains(&column))
        .map(|(bar, _)| *bar)
}

/// Percentage below which [`percent`] writes the percentage as a power of ten \[%\].
const LEAST_DECIMAL: f64 = 1e-4;

/// Formats a relative error in percent, with two digits, or with one digit below `LEAST_DECIMAL`.
pub fn percent(error: f64) -> String {
    let percent = 100.0 * error;
    if percent > 0.0 && percent < LEAST_DECIMAL {
        return format!("{percent:.0e} %");
    }
    let decimals = (1 - percent.log10().floor() as i32).clamp(0, 6);
    format!("{percent:.*} %", decimals as usize)
}
