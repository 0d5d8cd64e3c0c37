//! States of a joint for a comparison: unworn and now.

use crate::store::{History, RunReader, StoreError};
use crate::tables::TypedTable;
use crate::tables::typed::{Summary, WornResponse};

/// A state of wear.
#[derive(Debug, Clone, PartialEq)]
pub struct JointState {
    /// Number of wear steps from the unworn state to the state.
    pub wear_iteration: u64,
    /// Summary of the state. The resonance and the largest amplitude in the summary belong to the vibration that drives
    /// the wear.
    pub summary: Summary,
    /// Forced response of the worn joint, computed with the contact elements of the state.
    pub response: Option<WornResponse>,
}

impl JointState {
    /// Returns the resonance of the forced response with the contact elements of the state \[Hz\]. If the state has no
    /// forced response, returns the resonance of the vibration that drives the wear.
    pub fn resonance(&self) -> Option<f64> {
        let response = self.response.as_ref();
        response.map_or(self.summary.resonance_frequency, |response| {
            response.resonance_frequency
        })
    }

    /// Returns the amplitude at a given frequency with the contact elements of the state \[m\]. Returns `None` if the
    /// state has no forced response at a given frequency.
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

    /// Reads all states of a run, including pruned states. The function omits the forced responses of the states,
    /// because only some states have a forced response.
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
    /// Reads the unworn state and the last state. If only one of the two states has a forced response, the function
    /// omits the forced response. A comparison needs the forced responses of both states. Returns `None` for a run
    /// without an iteration.
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
