//! Numbers with how much the computation may be off by, and what they decide.
//!
//! A verdict is of the model that a study names, with its contact elements and harmonics. Bars here are therefore those of steps and solves
//! alone: what harmonics leave out is claim 27, what contact elements and fine contact differ by is claim 47.

use super::{Evidence, Verdict};

/// * Of what steps and solves make wrong in the volume, the least that they make wrong in a rate, as in `error_dissipated_energy`.
const RATE: f64 = 0.4;
/// What the search of a peak leaves open: of its amplitude, of its frequency.
const PEAK: f64 = 2e-5;
const FREQUENCY: f64 = 1e-6;

/// A value and its error bar, both in its unit.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bar {
    /// The value.
    pub value: f64,
    /// How far it may be off.
    pub error: f64,
}

impl Bar {
    /// A value that is known.
    pub fn exact(value: f64) -> Bar {
        Bar { value, error: 0.0 }
    }

    /// A value with a relative bar.
    pub fn relative(value: f64, error: f64) -> Bar {
        let error = if error.is_nan() { 0.0 } else { error };
        Bar {
            value,
            error: (value * error).abs(),
        }
    }

    /// The difference.
    pub fn less(self, other: Bar) -> Bar {
        Bar {
            value: self.value - other.value,
            error: self.error + other.error,
        }
    }

    /// In parts of another.
    pub fn over(self, other: Bar) -> Bar {
        let value = self.value / other.value;
        let relative = (self.error / self.value).abs() + (other.error / other.value).abs();
        Bar::relative(value, relative)
    }

    /// The size.
    pub fn size(self) -> Bar {
        Bar {
            value: self.value.abs(),
            error: self.error,
        }
    }

    /// Whether it is above a bound.
    pub fn above(self, bound: f64) -> Verdict {
        let is_within = self.error > 0.0 && (self.value - bound).abs() <= self.error;
        if self.value.is_nan() || is_within {
            Verdict::Undecided
        } else {
            Verdict::of(self.value > bound)
        }
    }

    /// Whether it is below a bound.
    pub fn below(self, bound: f64) -> Verdict {
        Bar {
            value: -self.value,
            error: self.error,
        }
        .above(-bound)
    }
}

/// (largest − smallest) / mean, of which each may be off by its bar.
pub fn spread(values: &[Bar]) -> Bar {
    let bare: Vec<f64> = values.iter().map(|bar| bar.value).collect();
    let at = |better: fn(&f64, &f64) -> bool| {
        let first = values[0];
        let pick = |best: Bar, bar: &Bar| {
            if better(&bar.value, &best.value) {
                *bar
            } else {
                best
            }
        };
        values.iter().fold(first, pick)
    };
    let (largest, smallest) = (at(|a, b| a > b), at(|a, b| a < b));
    let mean = bare.iter().sum::<f64>() / bare.len() as f64;
    Bar {
        value: (largest.value - smallest.value) / mean,
        error: (largest.error + smallest.error) / mean.abs(),
    }
}

/// Whether each is above the one before.
pub fn rises(values: &[Bar]) -> Verdict {
    let steps = values
        .windows(2)
        .map(|pair| pair[1].less(pair[0]).above(0.0));
    Verdict::all(steps)
}

/// What a value is off by where the volume is off by a part `error`, if it goes on as over the last step.
fn followed(values: &[f64], volumes: &[f64], place: usize, error: f64) -> f64 {
    if place == 0 {
        return 0.0;
    }
    let worn = volumes[place] - volumes[place - 1];
    let off = (values[place] - values[place - 1]).abs() * error * volumes[place] / worn;
    if off.is_finite() { off } else { 0.0 }
}

/// What a value that follows the state of wear is off by where the volume is off by a part `error`: at least that part of what wear has
/// changed so far.
fn state(values: &[f64], volumes: &[f64], place: usize, error: f64) -> f64 {
    let so_far = (values[place] - values[0]).abs() * error;
    followed(values, volumes, place, error).max(so_far)
}

impl Evidence {
    /// What steps and solves make wrong in the worn volume of an iteration, relative.
    fn steps_error(&self, place: usize) -> f64 {
        let at = |name: &str| {
            let value = self
                .column(name)
                .and_then(|values| values.get(place).copied());
            value.filter(|value| value.is_finite()).unwrap_or(0.0)
        };
        (at("error_wear_volume") - at("error_closure") - at("error_harmonics")).max(0.0)
    }

    /// Deepest wear at the end \[m\].
    pub fn deepest_wear(&self) -> Option<Bar> {
        let last = self.cycles()?.len() - 1;
        Some(Bar::relative(
            self.worn.as_ref()?.deepest,
            self.steps_error(last),
        ))
    }

    /// A column of the summary at the place of an iteration, with its bar.
    pub fn bar(&self, name: &str, place: usize) -> Option<Bar> {
        let values = self.column(name)?;
        let value = *values.get(place)?;
        let own =
            |error: &str, place: usize| self.column(error).and_then(|e| e.get(place).copied());
        let volumes = || self.column("wear_volume");
        let error = self.steps_error(place);
        let by_wear = match name {
            "dissipated_energy" | "wear_rate" => {
                let solves = own("error_cycle", place).unwrap_or(0.0);
                let least = (RATE * error * value).abs();
                followed(values, volumes()?, place, error).max(least) + (solves * value).abs()
            }
            "kn" | "kt" => {
                let solves = own(&format!("error_{name}"), 0).unwrap_or(0.0);
                let worn = volumes().map_or(0.0, |volumes| state(values, volumes, place, error));
                worn + (solves * value).abs()
            }
            _ => 0.0,
        };
        let error = if by_wear.is_finite() { by_wear } else { 0.0 };
        Some(Bar { value, error })
    }

    /// The first and the last.
    pub fn end_bars(&self, name: &str) -> Option<[Bar; 2]> {
        let last = self.column(name)?.len().checked_sub(1)?;
        Some([self.bar(name, 0)?, self.bar(name, last)?])
    }

    /// The value at some cycles, between iterations, with the bar of the next.
    pub fn bar_at(&self, name: &str, at: f64) -> Option<Bar> {
        let (cycles, values) = (self.cycles()?, self.column(name)?);
        let next = cycles.partition_point(|n| *n < at).min(cycles.len() - 1);
        let value = super::words::interpolated(cycles, values, at);
        let near = self.bar(name, next)?;
        Some(Bar::relative(value, near.error / near.value.abs()))
    }

    /// A column of the responses of worn states, each with its bar.
    pub fn worn_bars(&self, name: &str) -> Option<Vec<Bar>> {
        let values = self.worn_response.get(name)?;
        let (volumes, places) = (
            self.worn_response.get("wear_volume"),
            self.worn_response.get("place"),
        );
        let found = match name.ends_with("frequency") {
            true => FREQUENCY,
            false => PEAK,
        };
        let bar = |k: usize| {
            let of_steps = volumes.zip(places).map_or(0.0, |(volumes, places)| {
                state(values, volumes, k, self.steps_error(places[k] as usize))
            });
            Bar {
                value: values[k],
                error: found * values[k].abs() + of_steps,
            }
        };
        Some((0..values.len()).map(bar).collect())
    }

    /// The first and the last.
    pub fn worn_end_bars(&self, name: &str) -> Option<[Bar; 2]> {
        let bars = self.worn_bars(name)?;
        Some([*bars.first()?, *bars.last()?])
    }
}
