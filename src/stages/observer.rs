//! Who watches a run.

use super::stage::Stage;
use crate::gauge::Gauge;
use crate::store::Opening;

/// Who watches a run.
pub trait Observer {
    /// The run is open: where it continues, and what was found.
    fn opened(&self, opening: &Opening);
    /// Something the user should know.
    fn notice(&self, text: &str);
    /// A stage begins.
    fn stage(&self, stage: Stage, wear_iteration: u64);
    /// True to end the run before a stage that would be computed now. What the stages before it have found is kept.
    fn ends_before(&self, _stage: Stage) -> bool {
        false
    }
    /// Where the solvers are to count what they do within a stage.
    fn gauge(&self) -> Gauge {
        Gauge::default()
    }
    /// An iteration is committed.
    fn committed(&self, progress: &Progress);
}

/// How far a run is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Progress {
    /// The iteration.
    pub wear_iteration: u64,
    /// Cycles behind it; 0 without wear.
    pub cycles: u64,
    /// Worn volume \[m³\].
    pub volume: f64,
    /// Estimated relative error of the wear field.
    pub error: f64,
}
