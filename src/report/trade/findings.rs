//! What a trade says: whether the presets keep their promises, which knob buys most, and what is not converged.

use serde::{Serialize, Serializer};

use super::figures::{FIELD, FIGURES, Values, deviation, field_error};
use super::{Cost, Row, Trade};
use crate::scene::variants::{BALANCED, FAST, KnobKind, promise};

/// A result that changes by more than this from one mesh to the next is not converged at the coarser one.
pub(super) const CONVERGED: f64 = 0.01;

/// A smaller part of the cost than this is not worth a knob.
const WORTH: f64 = 0.05;

/// An error that does not fall to this part of what it was is not worth a knob.
const GAIN: f64 = 0.5;

/// A promise of a preset about one figure, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PresetPromise {
    /// The preset.
    pub preset: String,
    /// The figure.
    pub figure: &'static str,
    /// Largest error promised.
    pub promise: f64,
    /// The error; none where it is not known.
    pub error: Option<f64>,
    /// True if it is known and within the promise.
    pub passed: bool,
}

/// The knob that saves most within a bound.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Saving {
    /// Largest error of the promised figures.
    pub within: f64,
    /// The knob; none if none saves more than noise, or than is worth it.
    pub buy: Option<KnobEffect>,
}

/// What one knob alone makes of `balanced`.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct KnobEffect {
    /// The variant.
    pub variant: String,
    /// The knob.
    pub knob: &'static str,
    /// What it is set to.
    pub value: String,
    /// Cost below that of `balanced`, in what the trade is by; negative if it costs more.
    pub saved: f64,
    /// Cost below that of `balanced`, as a part of that of `balanced`.
    pub saved_part: f64,
    /// Largest error of the promised figures.
    pub error: f64,
    /// Largest error of the promised figures of `balanced`.
    pub error_before: f64,
}

/// The change of the figures from one discretisation to the next finer one.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Step {
    /// The coarser one.
    pub from: String,
    /// The finer one.
    pub to: String,
    /// Change of each figure, in the order of [`FIGURES`], relative to the finer one; none where one of them has no such figure.
    #[serde(serialize_with = "by_name")]
    pub change: Values,
}

/// Values under the names of their figures; those that are none are left out.
fn by_name<S: Serializer>(values: &Values, serializer: S) -> Result<S::Ok, S::Error> {
    let named = FIGURES.iter().zip(values);
    serializer.collect_map(named.filter_map(|(figure, value)| Some((figure.name, (*value)?))))
}

/// How the figures follow one discretisation.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Convergence {
    /// The knob.
    pub knob: &'static str,
    /// From the coarsest to the finest.
    pub steps: Vec<Step>,
}

impl Step {
    /// Figures that change by more than 1 %: their titles and changes.
    pub fn not_converged(&self) -> Vec<(&'static str, f64)> {
        let titled = FIGURES.iter().zip(&self.change);
        titled
            .filter_map(|(figure, change)| Some((figure.title, (*change)?)))
            .filter(|(_, change)| change.abs() > CONVERGED)
            .collect()
    }
}

/// What a trade says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Findings {
    /// What costs are compared by.
    pub by: Cost,
    /// How far the seconds of two equal runs are apart, in parts of them; none where that is not known.
    pub noise: Option<f64>,
    /// Promise by promise.
    pub promises: Vec<PresetPromise>,
    /// Within the promise of `balanced`, then within that of `fast`.
    pub savings: Vec<Saving>,
    /// The solver's knob that gives most accuracy for its cost; none if none halves the error.
    pub accuracy: Option<KnobEffect>,
    /// One entry a discretisation tried.
    pub convergence: Vec<Convergence>,
    /// Knobs that change no digit of any figure, whatever they are set to.
    pub without_effect: Vec<&'static str>,
}

/// Draws the conclusions.
pub fn findings(trade: &Trade) -> Findings {
    let bounds = [BALANCED, FAST].into_iter().filter_map(promise);
    Findings {
        by: trade.by,
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
            let concerned = trade.has(k) && reference.is_none_or(|row| row.values[k].is_some());
            if !figure.promised || !concerned {
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

fn buy(row: &Row, balanced: &Row) -> Option<KnobEffect> {
    let saved = balanced.cost - row.cost;
    Some(KnobEffect {
        variant: row.variant.name.clone(),
        knob: row.variant.knob,
        value: row.variant.value.clone(),
        saved,
        saved_part: saved / balanced.cost,
        error: row.worst?,
        error_before: balanced.worst?,
    })
}

/// The variants that change one knob of `balanced`, and no model.
fn turned(trade: &Trade) -> impl Iterator<Item = (&Row, KnobEffect)> {
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
        .filter_map(move |row| Some((row, buy(row, balanced?)?)))
}

/// True for a knob that is set finer than in `balanced`: where that is faster, or the opposite more exact, it is by chance.
fn is_finer(trade: &Trade, row: &Row) -> bool {
    let base = trade
        .base
        .iter()
        .find(|(knob, ..)| *knob == row.variant.knob);
    base.is_some_and(|(_, _, size)| row.variant.size > *size)
}

/// Differences of costs below this part of that of `balanced` are none; not known of seconds whose noise is not.
fn resolved(trade: &Trade) -> Option<f64> {
    match trade.by {
        Cost::FftPairs => Some(0.0),
        Cost::Seconds => trade.noise,
    }
}

/// True unless it is another mesh that changes some figure by more than the bound, promised or not: it is then another joint that is cheap.
fn is_same_joint(row: &Row, bound: f64) -> bool {
    let holds = |error: &Option<f64>| error.is_none_or(|error| error.abs() <= bound);
    row.variant.kind != KnobKind::Discretisation || row.errors.iter().all(holds)
}

fn saving(trade: &Trade, bound: f64) -> Option<KnobEffect> {
    let least = resolved(trade)?.max(WORTH);
    turned(trade)
        .filter(|(row, _)| !is_finer(trade, row) && is_same_joint(row, bound))
        .map(|(_, buy)| buy)
        .filter(|buy| buy.error <= bound && buy.saved_part > least)
        .max_by(|a, b| a.saved.total_cmp(&b.saved))
}

/// A finer mesh than the reference's does not come closer to it, which says nothing about the mesh: only solvers count.
fn accuracy(trade: &Trade) -> Option<KnobEffect> {
    let least = resolved(trade)?;
    // What costs no more than noise tells costs as much as noise.
    let rate = |buy: &KnobEffect| (buy.error_before - buy.error) / (-buy.saved_part).max(least);
    turned(trade)
        .filter(|(row, _)| row.variant.kind == KnobKind::Solver && is_finer(trade, row))
        .map(|(_, buy)| buy)
        .filter(|buy| buy.error <= GAIN * buy.error_before)
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
        let mut own = trade.rows.iter().filter(|row| row.variant.knob == knob);
        let is_knob = !matches!(row.variant.kind, KnobKind::Preset | KnobKind::Repeat);
        if is_knob && !knobs.contains(&knob) && own.all(same) {
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
