//! Findings of a trade: kept promises of the presets, the most effective knobs, and convergence.

use serde::{Serialize, Serializer};

use super::figures::{FIELD, FIGURES, Values, deviation, field_error};
use super::{Cost, Row, Trade};
use crate::scene::variants::{BALANCED, FAST, KnobKind, promise};

/// Largest relative change between two meshes of a converged result.
pub(super) const CONVERGED: f64 = 0.01;

/// Smallest relative saving that a finding reports.
const WORTH: f64 = 0.05;

/// Largest ratio of new to old error of a knob that a finding reports for accuracy.
const GAIN: f64 = 0.5;

/// Promise of a preset about one figure, with its outcome.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PresetPromise {
    /// The preset.
    pub preset: String,
    /// The figure.
    pub figure: &'static str,
    /// Largest promised error.
    pub promise: f64,
    /// Error of the figure with the preset. `None` if the error is unknown.
    pub error: Option<f64>,
    /// True if the error is known and within the promise.
    pub passed: bool,
}

/// Knob that saves most within an error bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Saving {
    /// Largest error of the promised figures.
    pub within: f64,
    /// The knob, or `None` if no knob saves more than noise or than 5 % of the cost.
    pub buy: Option<KnobEffect>,
}

/// Effect of a single knob on `balanced`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnobEffect {
    /// The variant.
    pub variant: String,
    /// The knob.
    pub knob: &'static str,
    /// Value of the knob.
    pub value: String,
    /// Saved cost against `balanced`, in the measure of the trade. The saved cost is negative if the variant costs
    /// more.
    pub saved: f64,
    /// Saved cost, relative to the cost of `balanced`.
    pub saved_part: f64,
    /// Largest error of the promised figures.
    pub error: f64,
    /// Largest error of the promised figures of `balanced`.
    pub error_before: f64,
}

/// Change of the figures from one discretisation to the next finer one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// Coarser value of the knob.
    pub from: String,
    /// Finer value of the knob.
    pub to: String,
    /// Change of each figure relative to the finer discretisation, in the order of [`FIGURES`]. `None` if one of the
    /// runs lacks the figure.
    #[serde(serialize_with = "by_name")]
    pub change: Values,
}

/// Serializes values under the names of their figures. `None` is skipped.
fn by_name<S: Serializer>(values: &Values, serializer: S) -> Result<S::Ok, S::Error> {
    let named_values = FIGURES.iter().zip(values);
    serializer
        .collect_map(named_values.filter_map(|(figure, value)| Some((figure.name, (*value)?))))
}

/// Convergence of the figures with one discretisation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// The knob.
    pub knob: &'static str,
    /// Steps from the coarsest to the finest.
    pub steps: Vec<Step>,
}

impl Step {
    /// Returns the figures that change by more than 1 %: their titles and changes.
    pub fn not_converged(&self) -> Vec<(&'static str, f64)> {
        let figures = FIGURES.iter().zip(&self.change);
        figures
            .filter_map(|(figure, change)| Some((figure.title, (*change)?)))
            .filter(|(_, change)| change.abs() > CONVERGED)
            .collect()
    }
}

/// Findings of a trade.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// Measure by which costs are compared.
    pub by: Cost,
    /// Relative difference of the seconds of two equal runs. `None` if the difference is unknown.
    pub noise: Option<f64>,
    /// All promises of the presets.
    pub promises: Vec<PresetPromise>,
    /// Savings within the promise of `balanced`, then within the promise of `fast`.
    pub savings: Vec<Saving>,
    /// Solver knob with the best gain of accuracy for its cost. `None` if no knob halves the error.
    pub accuracy: Option<KnobEffect>,
    /// One entry per tested discretisation.
    pub convergence: Vec<Convergence>,
    /// Knobs that do not change any digit of any figure.
    pub without_effect: Vec<&'static str>,
}

/// Evaluates a trade.
pub fn findings(trade: &Trade) -> Findings {
    let bounds = [BALANCED, FAST].into_iter().filter_map(promise);
    Findings {
        by: trade.cost_measure,
        noise: trade.noise,
        promises: promises(trade),
        savings: bounds
            .map(|within| Saving {
                within,
                buy: saving(trade, within),
            })
            .collect(),
        accuracy: accuracy(trade),
        convergence: trade
            .base
            .iter()
            .filter_map(|(knob, value, size)| convergence(trade, knob, value, *size))
            .collect(),
        without_effect: without_effect(trade),
    }
}

fn promises(trade: &Trade) -> Vec<PresetPromise> {
    let mut promises = Vec::new();
    let reference = trade.reference();
    for row in &trade.rows {
        let Some(promise) = promise(&row.variant.name) else {
            continue;
        };
        for (k, figure) in FIGURES.iter().enumerate() {
            let is_relevant = trade.has(k) && reference.is_none_or(|row| row.values[k].is_some());
            if !figure.promised || !is_relevant {
                continue;
            }
            promises.push(PresetPromise {
                preset: row.variant.name.clone(),
                figure: figure.title,
                promise,
                error: row.errors[k],
                passed: row.errors[k].is_some_and(|error| error.abs() <= promise),
            });
        }
    }
    promises
}

fn effect_of(row: &Row, balanced: &Row) -> Option<KnobEffect> {
    let saved = balanced.cost - row.cost;
    Some(KnobEffect {
        variant: row.variant.name.clone(),
        knob: row.variant.knob,
        value: row.variant.value.clone(),
        saved,
        saved_part: saved / balanced.cost,
        error: row.largest_promised_error?,
        error_before: balanced.largest_promised_error?,
    })
}

/// Returns the variants that change one knob of `balanced`, but not the model, with their effects.
fn knob_effects(trade: &Trade) -> impl Iterator<Item = (&Row, KnobEffect)> {
    let balanced = trade.row(BALANCED);
    trade
        .rows
        .iter()
        .filter(|row| {
            matches!(
                row.variant.kind,
                KnobKind::Solver | KnobKind::Discretisation
            )
        })
        .filter_map(move |row| Some((row, effect_of(row, balanced?)?)))
}

/// Returns true for a knob that is finer than in `balanced`. If a finer knob is faster than `balanced`, the gain is
/// random. If a coarser knob is more accurate than `balanced`, the gain is random.
fn is_finer(trade: &Trade, row: &Row) -> bool {
    let base = trade
        .base
        .iter()
        .find(|(knob, ..)| *knob == row.variant.knob);
    base.is_some_and(|(_, _, size)| row.variant.size > *size)
}

/// Returns the smallest significant difference of costs, relative to the cost of `balanced`. Returns `None` for costs
/// in seconds if the noise of the seconds is unknown.
fn cost_resolution(trade: &Trade) -> Option<f64> {
    match trade.cost_measure {
        Cost::FftPairs => Some(0.0),
        Cost::Seconds => trade.noise,
    }
}

/// Returns false if another mesh changes a figure, promised or not, by more than the bound. A mesh that changes a
/// figure by more than the bound describes another joint. A lower cost with another joint is not a saving.
fn is_same_joint(row: &Row, bound: f64) -> bool {
    let is_within = |error: &Option<f64>| error.is_none_or(|error| error.abs() <= bound);
    row.variant.kind != KnobKind::Discretisation || row.errors.iter().all(is_within)
}

fn saving(trade: &Trade, bound: f64) -> Option<KnobEffect> {
    let least = cost_resolution(trade)?.max(WORTH);
    knob_effects(trade)
        .filter(|(row, _)| !is_finer(trade, row) && is_same_joint(row, bound))
        .map(|(_, effect)| effect)
        .filter(|effect| effect.error <= bound && effect.saved_part > least)
        .max_by(|a, b| a.saved.total_cmp(&b.saved))
}

/// Considers only solver knobs. A mesh that is finer than the mesh of the reference differs from the reference. The
/// difference does not measure the error of the finer mesh.
fn accuracy(trade: &Trade) -> Option<KnobEffect> {
    let least = cost_resolution(trade)?;
    // An extra cost within the noise counts as the noise.
    let rate = |effect: &KnobEffect| {
        (effect.error_before - effect.error) / (-effect.saved_part).max(least)
    };
    knob_effects(trade)
        .filter(|(row, _)| row.variant.kind == KnobKind::Solver && is_finer(trade, row))
        .map(|(_, effect)| effect)
        .filter(|effect| effect.error <= GAIN * effect.error_before)
        .max_by(|a, b| (rate(a).total_cmp(&rate(b))).then(b.error.total_cmp(&a.error)))
}

fn convergence(trade: &Trade, knob: &'static str, value: &str, size: f64) -> Option<Convergence> {
    let balanced = trade.row(BALANCED)?;
    let mut rows: Vec<(f64, &str, &Row)> = trade
        .rows
        .iter()
        .filter(|row| row.variant.knob == knob && row.variant.kind == KnobKind::Discretisation)
        .map(|row| (row.variant.size, row.variant.value.as_str(), row))
        .chain([(size, value, balanced)])
        .filter(|(_, _, row)| row.failure.is_none())
        .collect();
    rows.sort_by(|a, b| a.0.total_cmp(&b.0));
    let steps: Vec<Step> = rows
        .windows(2)
        .map(|pair| Step {
            from: pair[0].1.to_owned(),
            to: pair[1].1.to_owned(),
            change: changes(pair[0].2, pair[1].2),
        })
        .collect();
    (!steps.is_empty()).then_some(Convergence { knob, steps })
}

fn without_effect(trade: &Trade) -> Vec<&'static str> {
    let mut knobs: Vec<&'static str> = Vec::new();
    let Some(balanced) = trade.row(BALANCED).filter(|row| row.failure.is_none()) else {
        return knobs;
    };
    let same = |row: &Row| row.values == balanced.values && row.field == balanced.field;
    for row in &trade.rows {
        let knob = row.variant.knob;
        let mut rows_of_knob = trade.rows.iter().filter(|row| row.variant.knob == knob);
        let is_knob = !matches!(row.variant.kind, KnobKind::Preset | KnobKind::Repeat);
        if is_knob && !knobs.contains(&knob) && rows_of_knob.all(same) {
            knobs.push(knob);
        }
    }
    knobs
}

fn changes(coarse: &Row, fine: &Row) -> Values {
    let mut changes: Values =
        std::array::from_fn(|k| deviation(coarse.values[k]?, fine.values[k]?));
    if let (Some(coarse), Some(fine)) = (&coarse.field, &fine.field) {
        changes[FIELD] = field_error(coarse, fine);
    }
    changes
}
