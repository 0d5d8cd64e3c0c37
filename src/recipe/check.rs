//! A figure that an engineer would look at, before a run or after it.

use serde::Serialize;

/// A figure of a scene or of a run.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Check {
    /// What it is.
    pub what: &'static str,
    /// The figure in words, with its unit.
    pub value: String,
    /// The key to look at, and why, if the figure is out of bounds.
    pub warning: Option<String>,
    /// What the figure means, if it is in bounds and rare.
    pub remark: Option<String>,
}
