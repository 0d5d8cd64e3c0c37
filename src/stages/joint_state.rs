//! The states of a joint between which a person compares: unworn, and as it is now.

use crate::store::{History, RunReader, StoreError};
use crate::tables::TypedTable;
use crate::tables::typed::{Summary, WornResponse};

/// One state of wear.
#[derive(Debug, Clone, PartialEq)]
pub struct JointState {
    /// Wear steps behind it.
    pub wear_iteration: u64,
    /// Its summary. Resonance and largest amplitude in it are those of the vibration that drives the wear.
    pub summary: Summary,
    /// The forced response with the state's own contact elements.
    pub response: Option<WornResponse>,
}

impl JointState {
    /// Its resonance \[Hz\]: with its own contact elements where it has such a response, else that of the vibration that drives the wear.
    pub fn resonance(&self) -> Option<f64> {
        let own = self.response.as_ref();
        own.map_or(self.summary.resonance_frequency, |own| {
            own.resonance_frequency
        })
    }

    /// The amplitude at a given frequency with its own contact elements \[m\]; `None` where the state has no such response.
    pub fn forced_amplitude(&self) -> Option<f64> {
        let own = self.response.as_ref();
        let own = own.filter(|own| own.resonance_frequency.is_none());
        own.map(|own| own.peak_amplitude)
    }

    /// The largest amplitude of the vibration that drives the wear \[m\]; `None` where the state has its own response.
    pub fn driving_amplitude(&self) -> Option<f64> {
        let amplitude = self.summary.peak_amplitude;
        amplitude.filter(|_| self.response.is_none())
    }

    /// Reads all states of a run, pruned ones too, without their own responses, which only some states have.
    ///
    /// # Errors
    /// Those of reading the run.
    pub fn all(reader: &RunReader) -> Result<Vec<JointState>, StoreError> {
        let history = reader.history()?;
        let mut states = Vec::new();
        for wear_iteration in 0..history.len() as u64 {
            let summary = row(reader, &history, wear_iteration)?;
            states.extend(summary.map(|summary| JointState {
                wear_iteration,
                summary,
                response: None,
            }));
        }
        Ok(states)
    }
}

/// The row of an iteration in a one-row table.
fn row<T: TypedTable>(
    reader: &RunReader,
    history: &History,
    wear_iteration: u64,
) -> Result<Option<T>, StoreError> {
    let row = history.row(wear_iteration);
    row.map_err(|source| StoreError::Table {
        path: reader.path().to_owned(),
        source: Box::new(source),
    })
}

/// The first and the last state of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEnds {
    /// The unworn joint, where there was wear since.
    pub unworn: Option<JointState>,
    /// The last iteration.
    pub now: JointState,
}

impl RunEnds {
    /// Reads the unworn state and that of the last iteration. They have their own responses where both of them do, so that the two can be
    /// compared. `None` for a run without an iteration.
    ///
    /// # Errors
    /// Those of reading the run.
    pub fn of(reader: &RunReader) -> Result<Option<RunEnds>, StoreError> {
        let history = reader.history()?;
        let state = |wear_iteration: u64| -> Result<Option<JointState>, StoreError> {
            let summary = row(reader, &history, wear_iteration)?;
            let response = row(reader, &history, wear_iteration)?;
            Ok(summary.map(|summary| JointState {
                wear_iteration,
                summary,
                response,
            }))
        };
        let Some(last) = reader.latest() else {
            return Ok(None);
        };
        let Some(mut now) = state(last)? else {
            return Ok(None);
        };
        let mut unworn = if last > 0 { state(0)? } else { None };
        if let Some(unworn) = &mut unworn
            && (unworn.response.is_none() || now.response.is_none())
        {
            (unworn.response, now.response) = (None, None);
        }
        Ok(Some(RunEnds { unworn, now }))
    }
}
