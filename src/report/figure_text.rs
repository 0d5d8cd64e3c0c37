//! Text of a figure. The text is a value with an error bar, an upper bound, or "not known".
//!
//! All messages and reports format figures with the functions of this module.

use super::percent;
use crate::recipe::Recipe;

/// Bound of the rounding error of a figure, relative to the characteristic size of the figure.
const FLOOR: f64 = 1e-9;

/// Returns the bound of rounding errors for values of the given size.
pub fn rounding_bound(size: f64) -> f64 {
    FLOOR * size.abs()
}

/// Characteristic sizes of a joint, which bound the rounding errors.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CharacteristicSizes {
    /// Longer side of the joint \[m\].
    side: f64,
    /// Normal load \[N\].
    load: f64,
    /// Rms roughness \[m\].
    rq: f64,
}

impl CharacteristicSizes {
    /// Returns the sizes of a run. Normal load \[N\] and rms roughness \[m\] default to 0.
    pub fn new(recipe: &Recipe, normal_load: Option<f64>, rq: Option<f64>) -> CharacteristicSizes {
        let surface = recipe.surface();
        CharacteristicSizes {
            side: surface.map_or(1.0, |surface| surface.size[0].max(surface.size[1])),
            load: normal_load.unwrap_or(0.0).abs(),
            rq: rq.unwrap_or(0.0),
        }
    }

    /// Returns the bound of rounding errors of a column of the summary, in its unit. The bound is 0 for columns without
    /// cancellation.
    pub fn resolution(&self, column: &str, unit: &str) -> f64 {
        rounding_bound(match (column, unit) {
            (_, "N m") => self.load * self.side,
            (_, "rad") => self.rq / self.side,
            ("mean_height", _) => self.rq,
            ("sk", _) => 1.0,
            _ => 0.0,
        })
    }
}

/// Range of relative error bars of unknown figures. For example, the amplitude of a peak is unknown if another peak can
/// be larger.
///
/// The solver sets the error bar of an unknown figure to 1. The solver adds the residual of Newton's method or the
/// time-step error, at most 1e-3.
const NOTHING: std::ops::Range<f64> = 1.0..1.002;

/// Returns an upper bound of the magnitude of a figure if only an upper bound is known.
///
/// Only an upper bound is known if the figure is smaller than its rounding error. Only an upper bound is known as well
/// if the relative error bar exceeds 1. Returns `None` for 0, for a known figure, and for an unknown figure. The error
/// bar of an unknown figure is 1. `bar` is the relative error bar, and `resolution` is the rounding error in the unit
/// of the figure.
pub fn upper_bound(value: f64, bar: f64, resolution: f64) -> Option<f64> {
    let size = value.abs();
    if size == 0.0 {
        None
    } else if bar >= NOTHING.end {
        Some(resolution.max((1.0 + bar) * size))
    } else {
        (size < resolution).then_some(resolution)
    }
}

/// Formats a figure with the error bar of the figure. The function `number` formats a value with the unit of the value.
pub fn figure_with_bar(
    value: f64,
    bar: f64,
    resolution: f64,
    number: impl Fn(f64) -> String,
) -> String {
    match upper_bound(value, bar, resolution) {
        Some(limit) => format!("below {}", number(limit)),
        None if NOTHING.contains(&bar) && value != 0.0 => {
            format!("not known ({} was found)", number(value))
        }
        None if bar > 0.0 && value != 0.0 => format!("{} ± {}", number(value), percent(bar)),
        None => number(value),
    }
}

#[cfg(test)]
mod tests {
    use super::{CharacteristicSizes, figure_with_bar, upper_bound};

    #[test]
    fn a_figure_is_a_value_with_its_bar_or_what_it_is_below() {
        let number = |value: f64| format!("{value} N");
        assert_eq!(figure_with_bar(2.0, 0.0, 0.0, number), "2 N");
        assert_eq!(figure_with_bar(-2.0, 0.25, 1e-9, number), "-2 N ± 25 %");
        assert_eq!(figure_with_bar(2.0, 1.5, 0.0, number), "below 5 N");
        assert_eq!(
            figure_with_bar(2.0, 1.0, 0.0, number),
            "not known (2 N was found)"
        );
        assert_eq!(figure_with_bar(1e-19, 0.0, 0.5, number), "below 0.5 N");
        assert_eq!(figure_with_bar(-1e-19, 2.0, 0.5, number), "below 0.5 N");
        // Zero is exact.
        assert_eq!(figure_with_bar(0.0, 1.0, 0.5, number), "0 N");
        assert_eq!(upper_bound(0.5, 0.0, 0.5), None);
    }

    #[test]
    fn moments_are_judged_by_load_and_size() {
        let sizes = CharacteristicSizes {
            side: 0.04,
            load: 30e3,
            rq: 5e-6,
        };
        assert!((sizes.resolution("moment_x", "N m") / 1.2e-6 - 1.0).abs() < 1e-12);
        assert_eq!(sizes.resolution("kn", "N/m"), 0.0);
    }
}
