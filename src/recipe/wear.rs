//! Wear over many cycles.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use crate::wear::{Scheme, WearLaw};

/// Wear over many cycles. At least one of `cycles` and `volume` is given. The run ends at the first limit that it
/// reaches.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Wear {
    /// Worn volume per dissipated energy \[m³/J\], [A eq. 2.5].
    pub coefficient: f64,
    /// Number of cycles to reach.
    pub cycles: Option<u64>,
    /// Worn volume to reach \[m³\].
    pub volume: Option<f64>,
    /// Fraction of the unworn load at which the run ends. The comparison includes the full error bar of the load.
    /// `None` if the load does not end the run.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until_preload: Option<f64>,
    /// Time integration scheme of the wear steps.
    pub scheme: Scheme,
    /// Largest local wear depth per step \[m\]; always given for an explicit scheme.
    pub depth_step: Option<f64>,
    /// Tolerance of the relative error of a wear step.
    pub tolerance: f64,
}

impl Wear {
    /// Returns true if the run ends at the given number of `cycles` or at the given worn `volume` \[m³\].
    pub fn is_reached(&self, cycles: u64, volume: f64) -> bool {
        self.cycles.is_some_and(|end| cycles >= end) || self.volume.is_some_and(|end| volume >= end)
    }

    /// Returns true if a load \[N\] has certainly fallen to the fraction of the `unworn` load that ends the run.
    /// `bar` is the relative error bar of the load.
    pub fn has_lost(&self, load: f64, bar: f64, unworn: f64) -> bool {
        let end = self.until_preload.map(|part| part * unworn);
        end.is_some_and(|end| load * (1.0 + bar) <= end)
    }

    /// Returns the completed part of the run, from 0 to 1. The part is the larger of two ratios. One ratio is `cycles`
    /// divided by the cycles at the end. The other ratio is the worn `volume` \[m³\] divided by the volume at the end.
    pub fn part(&self, cycles: u64, volume: f64) -> f64 {
        let cycle_part = self.cycles.map_or(0.0, |end| cycles as f64 / end as f64);
        let volume_part = self.volume.map_or(0.0, |end| volume / end);
        cycle_part.max(volume_part).min(1.0)
    }

    /// Returns the wear law.
    pub fn law(&self) -> WearLaw {
        WearLaw {
            coefficient: self.coefficient,
        }
    }

    /// Explains the wear steps.
    pub(super) fn explain(&self, decisions: &mut Decisions) {
        let depth_step = self.depth_step.unwrap_or(f64::NAN);
        let (choice, why) = self.scheme.describe(self.tolerance, depth_step);
        decisions.add("wear", choice, why);
    }
}
