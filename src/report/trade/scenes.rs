//! The presets over many scenes: what each is off by, by kind of motion, and how often it says so itself.

use serde::{Serialize, Serializer};

use super::{FIGURES, Row, Trade};
use crate::recipe::MotionKind;
use crate::scene::variants::{BALANCED, FAST, promise};

/// A preset over the scenes of a kind of motion, or over all scenes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Tally {
    /// The preset.
    pub preset: &'static str,
    /// The kind of motion; none of all scenes.
    #[serde(serialize_with = "by_word")]
    pub motion: Option<MotionKind>,
    /// Scenes that are compared.
    pub scenes: usize,
    /// Scenes that are not: this preset or the reference failed, or there is nothing to compare with.
    pub failed: usize,
    /// Median of the FFT pairs, in parts of those of the reference; none without pairs.
    pub pairs_part: Option<f64>,
    /// Median over scenes of the largest error among the promised figures; none without scenes.
    pub median: Option<f64>,
    /// The largest of them.
    pub worst: Option<f64>,
    /// The scene of the largest.
    pub worst_scene: Option<String>,
    /// What is promised.
    pub promise: f64,
    /// How many scenes keep that.
    pub kept: usize,
    /// Figure by figure; those that no scene has are left out.
    pub figures: Vec<FigureCount>,
}

/// A figure over these scenes.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FigureCount {
    /// The figure.
    pub figure: &'static str,
    /// Scenes in which it has an error bar of its own.
    pub scenes: usize,
    /// Median of its errors, where the reference is not zero; none if it is in all scenes.
    pub median: Option<f64>,
    /// The largest of them.
    pub worst: Option<f64>,
    /// How many of these scenes have the reference within the bar.
    pub within: usize,
}

/// A figure that is farther off than something says.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Miss {
    /// Name of the scene.
    pub scene: String,
    /// What kind of motion wears it.
    #[serde(serialize_with = "by_word")]
    pub motion: Option<MotionKind>,
    /// The preset.
    pub preset: String,
    /// The figure.
    pub figure: &'static str,
    /// Its error against the reference, in parts of the reference for a promise and of itself for a bar; none where that is zero, and the
    /// other is not.
    pub error: Option<f64>,
    /// The promise, or its own error bar, in parts of itself.
    pub limit: f64,
}

fn by_word<S: Serializer>(motion: &Option<MotionKind>, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(motion.map_or("all", MotionKind::word))
}

/// The middle of values, or the mean of the two in the middle.
fn median(mut values: Vec<f64>) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let middle = values.len().checked_sub(1)? / 2;
    let other = values.len() / 2;
    Some(0.5 * (values[middle] + values[other]))
}

/// The rows of presets with a promise that can be held against their reference, with it.
fn compared(trade: &Trade) -> impl Iterator<Item = (&Row, f64)> {
    let rows = trade.rows.iter();
    rows.filter(|row| row.failure.is_none() && row.worst.is_some())
        .filter_map(|row| Some((row, promise(&row.variant.name)?)))
}

/// Both presets over all scenes, then over those of each kind of motion that there is.
pub fn tallies(trades: &[Trade]) -> Vec<Tally> {
    let there = |kind: &MotionKind| trades.iter().any(|trade| trade.motion == *kind);
    let kinds = MotionKind::ALL.into_iter().filter(there).map(Some);
    let kinds: Vec<Option<MotionKind>> = [None].into_iter().chain(kinds).collect();
    let presets = [BALANCED, FAST].into_iter();
    presets
        .filter_map(|preset| Some((preset, promise(preset)?)))
        .flat_map(|(preset, promise)| {
            let of = move |kind: &Option<MotionKind>| tally(trades, preset, promise, *kind);
            kinds.iter().map(of).collect::<Vec<_>>()
        })
        .collect()
}

fn tally(
    trades: &[Trade],
    preset: &'static str,
    promise: f64,
    motion: Option<MotionKind>,
) -> Tally {
    let asked = || (trades.iter()).filter(|t| motion.is_none_or(|motion| t.motion == motion));
    let found: Vec<(&Trade, &Row)> = asked()
        .filter_map(|trade| {
            let mut rows = compared(trade);
            let (row, _) = rows.find(|(row, _)| row.variant.name == preset)?;
            Some((trade, row))
        })
        .collect();
    let worst_of = |row: &Row| row.worst.unwrap_or(0.0);
    let errors: Vec<f64> = found.iter().map(|(_, row)| worst_of(row)).collect();
    let worst = (found.iter()).max_by(|a, b| worst_of(a.1).total_cmp(&worst_of(b.1)));
    let pairs = found.iter().filter_map(|(trade, row)| {
        let part = row.fft_pairs / trade.reference()?.fft_pairs;
        Some(part).filter(|part| part.is_finite())
    });
    Tally {
        preset,
        motion,
        scenes: found.len(),
        failed: asked().count() - found.len(),
        pairs_part: median(pairs.collect()),
        worst: worst.map(|(_, row)| worst_of(row)),
        worst_scene: worst.map(|(trade, _)| trade.name.clone()),
        promise,
        kept: errors.iter().filter(|error| **error <= promise).count(),
        median: median(errors),
        figures: (0..FIGURES.len())
            .filter_map(|k| in_bar(&found, k))
            .collect(),
    }
}

fn in_bar(found: &[(&Trade, &Row)], k: usize) -> Option<FigureCount> {
    let within = found.iter().filter_map(|(trade, row)| trade.within(row, k));
    let within: Vec<bool> = within.collect();
    let errors = found
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

/// Figures that are farther off than their preset promises, and those that are farther off than their own error bar.
pub fn misses(trades: &[Trade]) -> [Vec<Miss>; 2] {
    let (mut promised, mut barred) = (Vec::new(), Vec::new());
    for trade in trades {
        for (row, promise) in compared(trade) {
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
                    barred.push(Miss {
                        error: of_itself(trade, row, k),
                        ..miss(row.bars[k].unwrap_or(0.0))
                    });
                }
            }
        }
    }
    [promised, barred]
}

/// The error of a figure in parts of itself, as its bar is.
fn of_itself(trade: &Trade, row: &Row, k: usize) -> Option<f64> {
    let exact = trade.reference()?.values[k]?;
    let value = row.values[k].filter(|value| *value != 0.0)?;
    Some((value - exact) / value.abs())
}
