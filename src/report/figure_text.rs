//! What is known of a figure: its value with its error bar, no more than what it is below, or nothing. One rule, wherever a person reads it.

use super::percent;
use crate::recipe::Recipe;

/// What is smaller than this part of what the joint has is what rounding left.
const FLOOR: f64 = 1e-9;

/// What rounding leaves of zero where values are of a size.
pub fn rounding(size: f64) -> f64 {
    FLOOR * size.abs()
}

/// What a state of a joint has, by which rounding is judged.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Sizes {
    /// Longer side of the joint \[m\].
    side: f64,
    /// Normal load \[N\].
    load: f64,
    /// Rms roughness \[m\].
    rq: f64,
}

impl Sizes {
    /// Those of a run with a normal load \[N\] and an rms roughness \[m\], zeros where it has none.
    pub fn of(recipe: &Recipe, normal_load: Option<f64>, rq: Option<f64>) -> Sizes {
        let surface = recipe.surface();
        Sizes {
            side: surface.map_or(1.0, |surface| surface.size[0].max(surface.size[1])),
            load: normal_load.unwrap_or(0.0).abs(),
            rq: rq.unwrap_or(0.0),
        }
    }

    /// Below this a column of the summary is what rounding left of zero, in its unit; 0 for one that is never so small by rounding.
    pub fn resolution(&self, column: &str, unit: &str) -> f64 {
        rounding(match (column, unit) {
            (_, "N m") => self.load * self.side,
            (_, "rad") => self.rq / self.side,
            ("mean_height", _) => self.rq,
            ("sk", _) => 1.0,
            _ => 0.0,
        })
    }
}

/// The bar of a figure of which a solver knows nothing, as of a peak where there may be larger ones: 1, and what Newton's method or
/// the steps of an integration in time have left, 1e-3 at most.
const NOTHING: std::ops::Range<f64> = 1.0..1.002;

/// What a figure is below, where no more is known of it: what rounding may have left of zero, and what may be off by all of itself.
/// None of zero, of a figure that is known, and of one whose bar is 1, of which nothing is known. `bar` is relative, `resolution` in
/// the unit of the figure.
pub fn below(value: f64, bar: f64, resolution: f64) -> Option<f64> {
    let size = value.abs();
    if size == 0.0 {
        None
    } else if bar >= NOTHING.end {
        Some(resolution.max((1.0 + bar) * size))
    } else {
        (size < resolution).then_some(resolution)
    }
}

/// A figure in words, with what `number` makes of a value and its unit.
pub fn figure_with_bar(
    value: f64,
    bar: f64,
    resolution: f64,
    number: impl Fn(f64) -> String,
) -> String {
    match below(value, bar, resolution) {
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
    use super::{Sizes, below, figure_with_bar};

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
        // Nothing is known exactly.
        assert_eq!(figure_with_bar(0.0, 1.0, 0.5, number), "0 N");
        assert_eq!(below(0.5, 0.0, 0.5), None);
    }

    #[test]
    fn moments_are_judged_by_load_and_size() {
        let sizes = Sizes {
            side: 0.04,
            load: 30e3,
            rq: 5e-6,
        };
        assert!((sizes.resolution("moment_x", "N m") / 1.2e-6 - 1.0).abs() < 1e-12);
        assert_eq!(sizes.resolution("kn", "N/m"), 0.0);
    }
}
