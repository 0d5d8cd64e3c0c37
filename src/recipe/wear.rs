//! Wear over many cycles.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use crate::wear::{Scheme, WearLaw};

/// Wear over many cycles. At least one of `cycles` and `volume` is there; the run ends at the first that is reached.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    /// Worn volume per dissipated energy \[m³/J\], [A eq. 2.5].
    pub coefficient: f64,
    /// Number of cycles to reach.
    pub cycles: Option<u64>,
    /// Worn volume to reach \[m³\].
    pub volume: Option<f64>,
    /// Part of the load that is left when the run ends, with all of its error bar; none: the load ends nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_preload: Option<f64>,
    /// How a wear step is taken.
    pub scheme: Scheme,
    /// Largest local wear depth of a step \[m\]; always there for an explicit scheme.
    pub depth_step: Option<f64>,
    /// Relative error that a wear step may make.
    pub tolerance: f64,
}

impl Wear {
    /// True if these cycles, or this worn volume \[m³\], end the run.
    pub fn is_reached(&self, cycles: u64, volume: f64) -> bool {
        self.cycles.is_some_and(|end| cycles >= end) || self.volume.is_some_and(|end| volume >= end)
    }

    /// True if a load \[N\] is for certain, being wrong by its relative bar at most, no more than the part of the `unworn` one that ends the run.
    pub fn has_lost(&self, load: f64, bar: f64, unworn: f64) -> bool {
        let end = self.until_preload.map(|part| part * unworn);
        end.is_some_and(|end| load * (1.0 + bar) <= end)
    }

    /// Part of the run that these cycles, or this worn volume \[m³\], are, whichever is further.
    pub fn part(&self, cycles: u64, volume: f64) -> f64 {
        let of_cycles = self.cycles.map_or(0.0, |end| cycles as f64 / end as f64);
        let of_volume = self.volume.map_or(0.0, |end| volume / end);
        of_cycles.max(of_volume).min(1.0)
    }

    /// The wear law.
    pub fn law(&self) -> WearLaw {
        WearLaw {
            coefficient: self.coefficient,
        }
    }

    /// Says how a wear step is taken.
    pub(super) fn explain(&self, decisions: &mut Decisions) {
        let depth_step = self.depth_step.unwrap_or(f64::NAN);
        let (choice, why) = self.scheme.describe(self.tolerance, depth_step);
        decisions.add("wear", choice, why);
    }
}
