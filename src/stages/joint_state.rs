//! States of a joint for a comparison: unworn and now.

use crate::store::{History, RunReader, StoreError};
use crate::tables::TypedTable;
use crate::tables::typed::{Summary, WornResponse};

/// A state of wear.
#[derive(Debug, Clone, PartialEq)]
pub struct JointState {
    /// Number of wear steps up to this state.
    pub wear_iteration: u64,
    /// Summary of the state. The resonance and the largest amplitude in the summary belong to the vibration that drives
    /// the wear.
    pub summary: Summary,
    /// Forced response with the contact elements of this state.
    pub response: Option<WornResponse>,
}

impl JointState {
    /// Returns the resonance \[Hz\] with the contact elements of this state if it has such a response, otherwise the
    /// resonance of the vibration that drives the wear.
    pub fn resonance(&self) -> Option<f64> {
        let response = self.response.as_ref();
        response.map_or(self.summary.resonance_frequency, |response| {
            response.resonance_frequency
        })
    }

    /// Returns the amplitude at a given frequency with the contact elements of this state \[m\]; `None` if the state
    /// has no such response.
    pub fn forced_amplitude(&self) -> Option<f64> {
        let response = self.response.as_ref();
        let response = response.filter(|response| response.resonance_frequency.is_none());
        response.map(|response| response.peak_amplitude)
    }

    /// Returns the largest amplitude of the vibration that drives the wear \[m\]; `None` if the state has its own
    /// response.
    pub fn driving_amplitude(&self) -> Option<f64> {
        let amplitude = self.summary.peak_amplitude;
        amplitude.filter(|_| self.response.is_none())
    }

    /// Reads all states of a run, including pruned ones, without their own responses, which only some states have.
    ///
    /// # Errors
    /// Errors of reading the run.
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

/// Reads the row of an iteration in a one-row table.
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

/// The unworn and the last state of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct RunEnds {
    /// The unworn joint; `None` if the unworn joint is the last state.
    pub unworn: Option<JointState>,
    /// The last state.
    pub now: JointState,
}

impl RunEnds {
    /// Reads the unworn and the last state. The two states contain their forced responses only if each state has one,
    /// so that a user can compare the responses. Returns `None` for a run without an iteration.
    ///
    /// # Errors
    /// Errors of reading the run.
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
