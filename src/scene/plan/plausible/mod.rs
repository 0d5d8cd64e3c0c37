//! Plausibility checks before a run. Rules of thumb estimate a few figures of the scene. The program warns if a figure
//! is out of its bounds.
//!
//! A wrong unit in a scene changes a figure by a factor of a thousand or more. The bounds are so wide that a joint of
//! any metal, ceramic or polymer passes. Rules of thumb give only the order of magnitude. A figure with an unusual
//! value gets a remark instead of a warning, because the user may intend the value.
//!
//! [`table::TABLE`] contains a row for each figure. [`formulas`] contains the formulas that are too long for a row of
//! the table.

mod face;
mod formulas;
mod say;
mod setup;
mod table;

use crate::recipe::{Check, Inputs, Surface};
use say::{Figure, Unit};
use setup::Setup;

/// Rule for one figure: formula and bounds of the figure, and the texts for a figure out of bounds.
#[derive(Clone, Copy)]
struct Row {
    what: &'static str,
    /// Returns the figure. Returns `None` if the figure does not exist in the scene.
    formula: fn(&Setup) -> Option<Figure>,
    /// Keys to check.
    keys: &'static str,
    /// Keys to check if the heights are a map.
    keys_of_map: Option<&'static str>,
    /// Unit of the bounds, and of the figure if it has no text of its own.
    unit: Unit,
    bounds: Bounds,
    /// Units to check if the figure is out of its bounds.
    hint: &'static str,
    usual: Option<Bounds>,
    /// Consequence of an unusual value.
    remark: &'static str,
    /// True if the figure is listed only when it is out of its bounds.
    only_beyond: bool,
}

/// Bounds of a figure.
#[derive(Clone, Copy)]
enum Bounds {
    AtLeast(f64),
    AtMost(f64),
    Between(f64, f64),
    /// Smallest and largest value of a figure that is not zero. The figure is zero if the scene lacks the quantity.
    ZeroOr(f64, f64),
    /// Smallest and largest value, computed from the scene.
    Of(fn(&Setup) -> Option<[f64; 2]>),
}

/// Checks the figures of a scene, in the order of the table. `given_load` is the load in the scene, if there is one
/// \[N\].
pub(super) fn checks(inputs: &Inputs, given_load: Option<f64>) -> Vec<Check> {
    let setup = Setup::of(inputs, given_load);
    let rows = table::TABLE.iter();
    let correction = inputs.recipe.surface().and_then(correction);
    rows.filter_map(|row| row.check(&setup))
        .chain(correction)
        .collect()
}

/// Returns the warning that `surface.correct` overrides the file.
fn correction(surface: &Surface) -> Option<Check> {
    let correct = surface.heights.file()?.correct;
    let unit = correct
        .unit
        .map(|unit| format!("heights in units of {unit:e} m"));
    let spacing = correct.spacing;
    let spacing = spacing.map(|[x, y]| format!("points {x:e} x {y:e} m apart"));
    let both: Vec<String> = unit.into_iter().chain(spacing).collect();
    let value = both.join(", ");
    (!both.is_empty()).then(|| Check {
        what: "correction of the map's file",
        warning: Some(format!(
            "surface.correct: {value} overrides the file; the run keeps this value"
        )),
        value,
        remark: None,
    })
}

/// Returns a row with the name `what`. The methods of [`Row`] set the other fields of the row.
const fn row(what: &'static str) -> Row {
    Row {
        what,
        formula: |_| None,
        keys: "",
        keys_of_map: None,
        unit: say::NONE,
        bounds: Bounds::Of(|_| None),
        hint: "",
        usual: None,
        remark: "",
        only_beyond: false,
    }
}

impl Row {
    const fn of(self, formula: fn(&Setup) -> Option<Figure>) -> Row {
        Row { formula, ..self }
    }

    const fn keys(self, keys: &'static str) -> Row {
        Row { keys, ..self }
    }

    const fn keys_of_map(self, keys: &'static str) -> Row {
        let keys_of_map = Some(keys);
        Row {
            keys_of_map,
            ..self
        }
    }

    const fn unit(self, unit: Unit) -> Row {
        Row { unit, ..self }
    }

    const fn bounds(self, bounds: Bounds) -> Row {
        Row { bounds, ..self }
    }

    const fn hint(self, hint: &'static str) -> Row {
        Row { hint, ..self }
    }

    const fn usual(self, bounds: Bounds) -> Row {
        let usual = Some(bounds);
        Row { usual, ..self }
    }

    const fn remark(self, remark: &'static str) -> Row {
        Row { remark, ..self }
    }

    const fn only_beyond(self) -> Row {
        let only_beyond = true;
        Row {
            only_beyond,
            ..self
        }
    }
}

impl Row {
    fn check(&self, setup: &Setup) -> Option<Check> {
        let figure = (self.formula)(setup)?;
        let number = figure.value;
        let beyond = |bounds: Bounds| self.unit.violated_bound(number, bounds.of(setup, number));
        let keys_of_map = self.keys_of_map.filter(|_| setup.map.is_some());
        let keys = figure.key.or(keys_of_map).unwrap_or(self.keys);
        let value = figure.words(self.unit);
        let found = format!("{keys}: the {} is {value}, and", self.what);
        let warning =
            beyond(self.bounds).map(|beyond| format!("{found} should be {beyond}: {}", self.hint));
        let usual = self.usual.filter(|_| warning.is_none());
        let remark = usual
            .and_then(beyond)
            .map(|beyond| format!("{found} mostly {beyond}: {}", self.remark));
        (warning.is_some() || remark.is_some() || !self.only_beyond).then_some(Check {
            what: self.what,
            value,
            warning,
            remark,
        })
    }
}

impl Bounds {
    fn of(self, setup: &Setup, value: f64) -> [f64; 2] {
        match self {
            Bounds::AtLeast(least) => [least, f64::INFINITY],
            Bounds::AtMost(most) => [f64::NEG_INFINITY, most],
            Bounds::ZeroOr(_, most) if value == 0.0 => [0.0, most],
            Bounds::Between(least, most) | Bounds::ZeroOr(least, most) => [least, most],
            Bounds::Of(bounds) => bounds(setup).unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
        }
    }
}
