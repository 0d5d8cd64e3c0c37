//! Milestones of a joint, with error bars. An example of a milestone is the number of cycles after which the joint has
//! lost 10 % of its preload.

mod crossing;
mod target;

pub use crossing::{Crossing, History};
pub use target::{Figure, Milestone, MilestoneError, Target};

use crate::store::{RunReader, StoreError};
use crate::tables::typed::{Summary, WornResponse};
use crate::tables::{TableError, TypedTable};

/// States of a run from which milestones follow, including pruned states.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct States {
    rows: Vec<(Summary, Option<WornResponse>)>,
    /// Whether the first state is already worn, because the states before it belong to another scene.
    pub begins_worn: bool,
}

/// Resonance column of a worn state in a history.
const WORN_RESONANCE: &str = "worn_response_resonance_frequency";

/// Reason why a run has no history of a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Missing {
    /// The run has no figure of that kind.
    Figure,
    /// The load of the scene is constant.
    LoadStays,
}

impl States {
    /// Reads the states of a run.
    ///
    /// # Errors
    /// Returns errors of reading the run.
    pub fn read(reader: &RunReader) -> Result<States, StoreError> {
        let history = reader.history()?;
        let wrong = |source: TableError| StoreError::Table {
            path: reader.path().to_owned(),
            source: Box::new(source),
        };
        let mut rows = Vec::new();
        let origin = reader.record().origin.as_ref();
        let first = match origin.map(|origin| origin.wear_iteration) {
            Some(last) if reader.scene_hash_of(last)? != reader.record().scene_hash => last + 1,
            _ => 0,
        };
        for wear_iteration in first..history.len() as u64 {
            let summary = history.row::<Summary>(wear_iteration).map_err(wrong)?;
            let worn = match history.columns_of(WornResponse::TABLE).next() {
                Some(_) => history.row(wear_iteration).map_err(wrong)?,
                None => None,
            };
            rows.extend(summary.map(|summary| (summary, worn)));
        }
        Ok(States {
            rows,
            begins_worn: first > 0,
        })
    }

    /// Returns true if there is no state.
    pub fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Columns of a history that [`States::add`] reads.
    pub const COLUMNS: [&str; 17] = [
        "cycles",
        "updated",
        "normal_load",
        "error_normal_load",
        "resonance_frequency",
        "error_resonance_change",
        WORN_RESONANCE,
        "kn",
        "error_kn",
        "kt",
        "error_kt",
        "largest_depth",
        "error_largest_depth",
        "depth_99",
        "error_depth_99",
        "wear_volume",
        "error_wear_volume",
    ];

    /// Appends a state. `number` returns the values of the columns, a flag as 0 or 1.
    pub fn add(&mut self, number: impl Fn(&str) -> Option<f64>) {
        let summary = Summary {
            cycles: number("cycles").map(|cycles| cycles as i64),
            updated: number("updated").map(|updated| updated > 0.0),
            normal_load: number("normal_load"),
            error_normal_load: number("error_normal_load"),
            resonance_frequency: number("resonance_frequency"),
            error_resonance_change: number("error_resonance_change"),
            kn: number("kn"),
            error_kn: number("error_kn"),
            kt: number("kt"),
            error_kt: number("error_kt"),
            largest_depth: number("largest_depth"),
            error_largest_depth: number("error_largest_depth"),
            depth_99: number("depth_99"),
            error_depth_99: number("error_depth_99"),
            wear_volume: number("wear_volume"),
            error_wear_volume: number("error_wear_volume"),
            ..Summary::default()
        };
        let worn = number(WORN_RESONANCE).map(|frequency| WornResponse {
            resonance_frequency: Some(frequency),
            ..WornResponse::default()
        });
        self.rows.push((summary, worn));
    }

    /// Returns the number of cycles after the last state.
    pub fn cycles(&self) -> Option<u64> {
        Some(self.rows.last()?.0.cycles?.unsigned_abs())
    }

    /// Returns the history of a figure.
    ///
    /// # Errors
    /// Returns [`Missing`] if the run has no history of the figure.
    pub fn history(&self, figure: Figure) -> Result<History, Missing> {
        let mut history = History {
            bend: figure.bend(),
            ..History::default()
        };
        // Worn volume at the last row with a resonance. The error bar of a separately computed resonance depends on
        // this worn volume.
        let mut worn_before = 0.0;
        for (summary, worn) in &self.rows {
            let value_and_bar = match figure {
                Figure::Resonance => resonance(summary, worn.as_ref(), &history, worn_before),
                _ => contact_figure(summary, figure),
            };
            let value_and_bar = value_and_bar
                .filter(|value_and_bar| value_and_bar.iter().all(|value| value.is_finite()));
            let Some(([value, bar], cycles)) = value_and_bar.zip(summary.cycles) else {
                continue;
            };
            history.cycles.push(cycles as f64);
            history.values.push(value);
            history.bars.push(bar);
            worn_before = summary.wear_volume.unwrap_or(0.0);
        }
        if !history.values.is_empty() {
            return Ok(history);
        }
        let has_load = self.rows.iter().any(|(row, _)| row.normal_load.is_some());
        Err(match figure {
            Figure::Preload if has_load => Missing::LoadStays,
            _ => Missing::Figure,
        })
    }
}

/// Returns a figure of the contact and its bar.
fn contact_figure(summary: &Summary, figure: Figure) -> Option<[f64; 2]> {
    let (value, bar) = match figure {
        // A constant load has no bar.
        Figure::Preload => (summary.normal_load, Some(summary.error_normal_load?)),
        Figure::Kn => (summary.kn, summary.error_kn),
        Figure::Kt => (summary.kt, summary.error_kt),
        Figure::Depth => (summary.largest_depth, summary.error_largest_depth),
        Figure::Depth99 => (summary.depth_99, summary.error_depth_99),
        Figure::Volume => (summary.wear_volume, summary.error_wear_volume),
        Figure::Resonance => return None,
    };
    let value = value?;
    Some([value, bar.unwrap_or(0.0) * value.abs()])
}

/// Returns the resonance of a state and the error bar of the resonance change. Returns `None` if the run did not
/// compute a resonance at this state. The run computes a resonance at each update, and at each state with a separate
/// resonance of the worn joint. Between updates, the stored resonance is the resonance of an earlier state.
fn resonance(
    summary: &Summary,
    worn: Option<&WornResponse>,
    history: &History,
    worn_before: f64,
) -> Option<[f64; 2]> {
    let bar = summary.error_resonance_change.unwrap_or(0.0);
    if summary.updated == Some(true) {
        return Some([summary.resonance_frequency?, bar]);
    }
    let frequency = worn?.resonance_frequency?;
    // The resonance is assumed to change in proportion to the volume worn since the last computed resonance.
    let volume = summary.wear_volume?;
    let part = summary.error_wear_volume.unwrap_or(0.0) * volume / (volume - worn_before);
    let change = frequency - history.values.last().copied().unwrap_or(frequency);
    let by_wear = if part.is_finite() {
        part * change.abs()
    } else {
        0.0
    };
    Some([frequency, bar.max(by_wear)])
}
