//! Values with error bars, and verdicts that respect the bars.
//!
//! A verdict concerns the model of a study, with its contact elements and harmonics. An error bar of a verdict only
//! includes the errors of the wear steps and of the solves. Claim 27 covers the truncation of the harmonics. Claim 47
//! covers the difference between contact elements and fine contact.

use super::{Evidence, Verdict};

/// * Smallest relative error of a rate, divided by the relative error of the worn volume from wear steps and solves.
///   `error_dissipated_energy` uses the same fraction.
const RATE: f64 = 0.4;
/// Relative errors of a peak from the search for the peak. `PEAK` is the error of the amplitude, and `FREQUENCY` is the
/// error of the frequency.
const PEAK: f64 = 2e-5;
const FREQUENCY: f64 = 1e-6;

/// Value with an error bar, both in the unit of the value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ValueWithBar {
    /// The value.
    pub value: f64,
    /// Bound of the error.
    pub error: f64,
}

impl ValueWithBar {
    /// Creates an exact value.
    pub fn exact(value: f64) -> ValueWithBar {
        ValueWithBar { value, error: 0.0 }
    }

    /// Creates a value with a relative error bar.
    pub fn relative(value: f64, error: f64) -> ValueWithBar {
        let error = if error.is_nan() { 0.0 } else { error };
        ValueWithBar {
            value,
            error: (value * error).abs(),
        }
    }

    /// Returns the difference.
    pub fn difference(self, other: ValueWithBar) -> ValueWithBar {
        ValueWithBar {
            value: self.value - other.value,
            error: self.error + other.error,
        }
    }

    /// Returns the ratio.
    pub fn ratio(self, other: ValueWithBar) -> ValueWithBar {
        let value = self.value / other.value;
        let relative = (self.error / self.value).abs() + (other.error / other.value).abs();
        ValueWithBar::relative(value, relative)
    }

    /// Returns the magnitude.
    pub fn magnitude(self) -> ValueWithBar {
        ValueWithBar {
            value: self.value.abs(),
            error: self.error,
        }
    }

    /// Judges if the value is above a bound.
    pub fn above(self, bound: f64) -> Verdict {
        let is_within = self.error > 0.0 && (self.value - bound).abs() <= self.error;
        if self.value.is_nan() || is_within {
            Verdict::Undecided
        } else {
            Verdict::of(self.value > bound)
        }
    }

    /// Judges if the value is below a bound.
    pub fn below(self, bound: f64) -> Verdict {
        ValueWithBar {
            value: -self.value,
            error: self.error,
        }
        .above(-bound)
    }
}

/// Returns (largest − smallest) / mean. Each value may be off by its bar.
pub fn spread(values: &[ValueWithBar]) -> ValueWithBar {
    let bare_values: Vec<f64> = values.iter().map(|bar| bar.value).collect();
    let extreme = |better: fn(&f64, &f64) -> bool| {
        let first = values[0];
        let pick = |best: ValueWithBar, bar: &ValueWithBar| {
            if better(&bar.value, &best.value) {
                *bar
            } else {
                best
            }
        };
        values.iter().fold(first, pick)
    };
    let (largest, smallest) = (extreme(|a, b| a > b), extreme(|a, b| a < b));
    let mean = bare_values.iter().sum::<f64>() / bare_values.len() as f64;
    ValueWithBar {
        value: (largest.value - smallest.value) / mean,
        error: (largest.error + smallest.error) / mean.abs(),
    }
}

/// Judges if each value is above its predecessor.
pub fn rises(values: &[ValueWithBar]) -> Verdict {
    let steps = values
        .windows(2)
        .map(|pair| pair[1].difference(pair[0]).above(0.0));
    Verdict::all(steps)
}

/// Returns the error of a value if the volume is off by a relative `error`. The error extrapolates the change of the
/// value over the last step.
fn last_step_error(values: &[f64], volumes: &[f64], place: usize, error: f64) -> f64 {
    if place == 0 {
        return 0.0;
    }
    let step_volume = volumes[place] - volumes[place - 1];
    let deviation =
        (values[place] - values[place - 1]).abs() * error * volumes[place] / step_volume;
    if deviation.is_finite() {
        deviation
    } else {
        0.0
    }
}

/// Returns the error of a value that depends on the worn volume. The relative error of the worn volume is `error`. The
/// error of the value is at least `error` times the change of the value since the unworn state.
fn state_error(values: &[f64], volumes: &[f64], place: usize, error: f64) -> f64 {
    let so_far = (values[place] - values[0]).abs() * error;
    last_step_error(values, volumes, place, error).max(so_far)
}

impl Evidence {
    /// Returns the relative error that wear steps and solves cause in the worn volume of an iteration.
    fn steps_error(&self, place: usize) -> f64 {
        let at = |name: &str| {
            let value = self
                .column(name)
                .and_then(|values| values.get(place).copied());
            value.filter(|value| value.is_finite()).unwrap_or(0.0)
        };
        (at("error_wear_volume") - at("error_closure") - at("error_harmonics")).max(0.0)
    }

    /// Returns the deepest wear at the end \[m\].
    pub fn deepest_wear(&self) -> Option<ValueWithBar> {
        let last = self.cycles()?.len() - 1;
        Some(ValueWithBar::relative(
            self.worn.as_ref()?.deepest,
            self.steps_error(last),
        ))
    }

    /// Returns a value of a column of the summary with its bar. `place` is the index of the iteration.
    pub fn bar(&self, name: &str, place: usize) -> Option<ValueWithBar> {
        let values = self.column(name)?;
        let value = *values.get(place)?;
        let relative_error =
            |error: &str, place: usize| self.column(error).and_then(|e| e.get(place).copied());
        let volumes = || self.column("wear_volume");
        let error = self.steps_error(place);
        let by_wear = match name {
            "dissipated_energy" | "wear_rate" => {
                let solves = relative_error("error_cycle", place).unwrap_or(0.0);
                let least = (RATE * error * value).abs();
                last_step_error(values, volumes()?, place, error).max(least)
                    + (solves * value).abs()
            }
            "kn" | "kt" => {
                let solves = relative_error(&format!("error_{name}"), 0).unwrap_or(0.0);
                let worn =
                    volumes().map_or(0.0, |volumes| state_error(values, volumes, place, error));
                worn + (solves * value).abs()
            }
            _ => 0.0,
        };
        let error = if by_wear.is_finite() { by_wear } else { 0.0 };
        Some(ValueWithBar { value, error })
    }

    /// Returns the first and the last value of a column of the summary.
    pub fn end_bars(&self, name: &str) -> Option<[ValueWithBar; 2]> {
        let last = self.column(name)?.len().checked_sub(1)?;
        Some([self.bar(name, 0)?, self.bar(name, last)?])
    }

    /// Returns the value of a column of the summary after `at_cycles` cycles. The value is interpolated between
    /// iterations. The relative error bar is the error bar of the next iteration.
    pub fn bar_at(&self, name: &str, at_cycles: f64) -> Option<ValueWithBar> {
        let (cycles, values) = (self.cycles()?, self.column(name)?);
        let next = cycles
            .partition_point(|n| *n < at_cycles)
            .min(cycles.len() - 1);
        let value = super::words::interpolated(cycles, values, at_cycles);
        let next_bar = self.bar(name, next)?;
        Some(ValueWithBar::relative(
            value,
            next_bar.error / next_bar.value.abs(),
        ))
    }

    /// Returns a column of the responses of worn states, each value with its bar.
    pub fn worn_bars(&self, name: &str) -> Option<Vec<ValueWithBar>> {
        let values = self.worn_response.get(name)?;
        let (volumes, places) = (
            self.worn_response.get("wear_volume"),
            self.worn_response.get("place"),
        );
        let search_error = match name.ends_with("frequency") {
            true => FREQUENCY,
            false => PEAK,
        };
        let bar = |k: usize| {
            let step_error = volumes.zip(places).map_or(0.0, |(volumes, places)| {
                state_error(values, volumes, k, self.steps_error(places[k] as usize))
            });
            ValueWithBar {
                value: values[k],
                error: search_error * values[k].abs() + step_error,
            }
        };
        Some((0..values.len()).map(bar).collect())
    }

    /// Returns the first and the last value of a column of the responses of worn states.
    pub fn worn_end_bars(&self, name: &str) -> Option<[ValueWithBar; 2]> {
        let bars = self.worn_bars(name)?;
        Some([*bars.first()?, *bars.last()?])
    }
}
