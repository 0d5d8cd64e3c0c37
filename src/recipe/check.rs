//! A plausibility check, before or after a run.

use serde::Serialize;

/// A quantity of a scene or of a run that an engineer would check.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// Name of the quantity.
    pub what: &'static str,
    /// Value of the quantity with the unit, as text.
    pub value: String,
    /// The key of the scene to check, with the reason, if the value is out of bounds.
    pub warning: Option<String>,
    /// Explanation of a value that is unusual but within bounds.
    pub remark: Option<String>,
}
