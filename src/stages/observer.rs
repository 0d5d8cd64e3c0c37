//! Interface for observers of a run.

use super::stage::Stage;
use crate::gauge::Gauge;
use crate::store::Opening;

/// Observer of a run.
pub trait Observer {
    /// Called when the run is open, with the point where it continues and the findings about its files.
    fn opened(&self, opening: &Opening);
    /// Reports a notice for the user.
    fn notice(&self, text: &str);
    /// A stage begins.
    fn stage(&self, stage: Stage, wear_iteration: u64);
    /// Returns true to end the run before a stage that would be computed now. The results of earlier stages are kept.
    fn ends_before(&self, _stage: Stage) -> bool {
        false
    }
    /// Returns the gauge in which the solvers count their work within a stage.
    fn gauge(&self) -> Gauge {
        Gauge::default()
    }
    /// An iteration is committed.
    fn committed(&self, progress: &Progress);
}

/// Progress of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The iteration.
    pub wear_iteration: u64,
    /// Number of cycles from the unworn joint to the iteration; 0 without wear.
    pub cycles: u64,
    /// Worn volume \[m³\].
    pub volume: f64,
    /// Estimated relative error of the wear field.
    pub error: f64,
}
