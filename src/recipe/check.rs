//! A plausibility check, before or after a run.

use serde::Serialize;

/// A quantity of a scene or of a run that an engineer would check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Name of the quantity.
    pub what: &'static str,
    /// Value with its unit, as text.
    pub value: String,
    /// The key to check, with the reason, if the value is out of bounds.
    pub warning: Option<String>,
    /// Meaning of the value, if it is within bounds but unusual.
    pub remark: Option<String>,
}
