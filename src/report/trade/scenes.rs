//! Statistics of the presets over many scenes: errors by kind of motion, and how often the error bars include them.

use serde::{Serialize, Serializer};

use super::{FIGURES, Row, Trade};
use crate::recipe::MotionKind;
use crate::scene::variants::{BALANCED, FAST, promise};

/// Statistics of a preset over all scenes, or over the scenes with one kind of motion.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PresetStatistics {
    /// The preset.
    pub preset: &'static str,
    /// Kind of motion, or `None` for all scenes.
    #[serde(serialize_with = "by_word")]
    pub motion: Option<MotionKind>,
    /// Number of compared scenes.
    pub scenes: usize,
    /// Number of other scenes: the preset or the reference failed, or the reference has nothing to compare with.
    pub failed: usize,
    /// Median over scenes of the FFT pairs of the preset, relative to the FFT pairs of the reference. `None` without
    /// pairs.
    pub pairs_part: Option<f64>,
    /// Median over scenes of the largest error of the promised figures. `None` without scenes.
    pub median: Option<f64>,
    /// Largest error of the promised figures over all scenes. `None` without scenes.
    pub worst: Option<f64>,
    /// Scene of the largest error.
    pub worst_scene: Option<String>,
    /// Promised bound of the errors.
    pub promise: f64,
    /// Number of scenes that keep the promise.
    pub kept: usize,
    /// Statistics of each figure that a scene has.
    pub figures: Vec<FigureCount>,
}

/// Statistics of a figure over the scenes of a [`PresetStatistics`].
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FigureCount {
    /// The figure.
    pub figure: &'static str,
    /// Number of scenes in which the figure has an error bar.
    pub scenes: usize,
    /// Median error of the figure over all scenes with a nonzero reference. `None` if every reference is zero.
    pub median: Option<f64>,
    /// Largest error of the figure over all scenes with a nonzero reference.
    pub worst: Option<f64>,
    /// Number of scenes in which the reference is within the error bar of the figure.
    pub within: usize,
}

/// Figure whose error exceeds a promise or its own error bar.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// Name of the scene.
    pub scene: String,
    /// Kind of the motion that wears the joint.
    #[serde(serialize_with = "by_word")]
    pub motion: Option<MotionKind>,
    /// The preset.
    pub preset: String,
    /// The figure.
    pub figure: &'static str,
    /// Deviation from the reference: relative to the reference for a promise, relative to the figure itself for an
    /// error bar. `None` if the divisor is zero and the deviation is not zero.
    pub error: Option<f64>,
    /// Promised error, or relative error bar.
    pub limit: f64,
}

fn by_word<S: Serializer>(motion: &Option<MotionKind>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(motion.map_or("all", MotionKind::word))
}

/// Returns the median of values.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    let other = values.len() / 2;
    Some(0.5 * (values[middle] + values[other]))
}

/// Returns the rows of presets with a promise that can be compared with the reference, with the promise.
fn promised_rows(trade: &Trade) -> impl Iterator<Item = (&Row, f64)> {
    let rows = trade.rows.iter();
    rows.filter(|row| row.failure.is_none() && row.largest_promised_error.is_some())
        .filter_map(|row| Some((row, promise(&row.variant.name)?)))
}

/// Returns the statistics of both presets over all scenes, and over the scenes of each kind of motion.
pub fn tallies(trades: &[Trade]) -> Vec<PresetStatistics> {
    let exists = |kind: &MotionKind| trades.iter().any(|trade| trade.motion == *kind);
    let kinds = MotionKind::ALL.into_iter().filter(exists).map(Some);
    let kinds: Vec<Option<MotionKind>> = [None].into_iter().chain(kinds).collect();
    let presets = [BALANCED, FAST].into_iter();
    presets
        .filter_map(|preset| Some((preset, promise(preset)?)))
        .flat_map(|(preset, promise)| {
            let tally_of = move |kind: &Option<MotionKind>| tally(trades, preset, promise, *kind);
            kinds.iter().map(tally_of).collect::<Vec<_>>()
        })
        .collect()
}

fn tally(
    trades: &[Trade],
    preset: &'static str,
    promise: f64,
    motion: Option<MotionKind>,
) -> PresetStatistics {
    let selected = || (trades.iter()).filter(|t| motion.is_none_or(|motion| t.motion == motion));
    let preset_rows: Vec<(&Trade, &Row)> = selected()
        .filter_map(|trade| {
            let mut rows = promised_rows(trade);
            let (row, _) = rows.find(|(row, _)| row.variant.name == preset)?;
            Some((trade, row))
        })
        .collect();
    let worst_of = |row: &Row| row.largest_promised_error.unwrap_or(0.0);
    let errors: Vec<f64> = preset_rows.iter().map(|(_, row)| worst_of(row)).collect();
    let worst = (preset_rows.iter()).max_by(|a, b| worst_of(a.1).total_cmp(&worst_of(b.1)));
    let pairs = preset_rows.iter().filter_map(|(trade, row)| {
        let part = row.fft_pairs / trade.reference()?.fft_pairs;
        Some(part).filter(|part| part.is_finite())
    });
    PresetStatistics {
        preset,
        motion,
        scenes: preset_rows.len(),
        failed: selected().count() - preset_rows.len(),
        pairs_part: median(pairs.collect()),
        worst: worst.map(|(_, row)| worst_of(row)),
        worst_scene: worst.map(|(trade, _)| trade.name.clone()),
        promise,
        kept: errors.iter().filter(|error| **error <= promise).count(),
        median: median(errors),
        figures: (0..FIGURES.len())
            .filter_map(|k| figure_count(&preset_rows, k))
            .collect(),
    }
}

fn figure_count(preset_rows: &[(&Trade, &Row)], k: usize) -> Option<FigureCount> {
    let within = preset_rows
        .iter()
        .filter_map(|(trade, row)| trade.within(row, k));
    let within: Vec<bool> = within.collect();
    let errors = preset_rows
        .iter()
        .filter_map(|(_, row)| Some(row.errors[k]?.abs()));
    let errors: Vec<f64> = errors.collect();
    (!within.is_empty()).then(|| FigureCount {
        figure: FIGURES[k].title,
        scenes: within.len(),
        worst: errors.iter().copied().max_by(f64::total_cmp),
        median: median(errors),
        within: within.iter().filter(|within| **within).count(),
    })
}

/// Returns two lists of figures. The errors in the first list exceed the promise. The errors in the second list exceed
/// the error bars of the figures.
pub fn misses(trades: &[Trade]) -> [Vec<Miss>; 2] {
    let (mut promised, mut outside_bar) = (Vec::new(), Vec::new());
    for trade in trades {
        for (row, promise) in promised_rows(trade) {
            for (k, figure) in FIGURES.iter().enumerate() {
                let error = row.errors[k];
                let miss = |limit| Miss {
                    scene: trade.name.clone(),
                    motion: Some(trade.motion),
                    preset: row.variant.name.clone(),
                    figure: figure.title,
                    error,
                    limit,
                };
                if figure.promised && error.is_some_and(|error| error.abs() > promise) {
                    promised.push(miss(promise));
                }
                if trade.within(row, k) == Some(false) {
                    outside_bar.push(Miss {
                        error: error_relative_to_itself(trade, row, k),
                        ..miss(row.bars[k].unwrap_or(0.0))
                    });
                }
            }
        }
    }
    [promised, outside_bar]
}

/// Returns the error of a figure relative to the figure itself, like its error bar.
fn error_relative_to_itself(trade: &Trade, row: &Row, k: usize) -> Option<f64> {
    let exact = trade.reference()?.values[k]?;
    let value = row.values[k].filter(|value| *value != 0.0)?;
    Some((value - exact) / value.abs())
}
