//! Criteria for an update of the contact elements [A §2e, §4d(i)].

use super::UpdateSettings;
use serde::{Deserialize, Serialize};

use super::{Compliance, ModelUpdateError};

/// Change since the last update that makes the next one due.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UpdateCriterion {
    /// No change makes an update due.
    #[default]
    Never,
    /// kn or kt of the joint has changed by the fraction `change`: |k/k_ref − 1| ≥ `change`. With individual element
    /// laws ([`super::Laws`]), the criterion in addition compares the rough contact with the elements under the same
    /// motion. An update is due if the force or the energy per cycle of the contact and of the elements differ by the
    /// fraction `change`. For all laws, an update is due if the worn volume has grown by the fraction `volume_growth`.
    /// The growth counts from the last update or from the end of running-in, whichever is later.
    StiffnessChange {
        /// Limit of the relative change of kn, kt, force or energy.
        change: f64,
        /// Limit of the relative growth of the worn volume; `None` if it does not count.
        volume_growth: Option<f64>,
    },
    /// Number of wear iterations.
    Iterations(u64),
    /// Increase of the worn volume \[m³\].
    WearVolume(f64),
}

/// State of the joint for the criteria, at the last update or now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UpdateState {
    /// Wear iteration.
    pub iteration: u64,
    /// Compliance of all springs together, [`super::Springs::compliance`].
    pub compliance: Compliance,
    /// Cumulative worn volume \[m³\].
    pub wear_volume: f64,
    /// Worn volume at the end of running-in \[m³\]. Growth counts from there.
    pub running_in: f64,
    /// Cycle of the fine contact with the current elements, if the criterion uses it.
    pub cycle: Option<CycleFigures>,
}

/// Force and energy of a cycle of the fine contact under a vibration. The force and the energy determine the stiffness
/// and the damping of the joint. If the motion is extrapolated between updates, the fine contact and the elements have
/// the same motion. The values are then the ratio of contact to elements, multiplied by the values of the elements in
/// the current response.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CycleFigures {
    /// Half range of the force along the motion \[N\].
    pub force: f64,
    /// Dissipated energy \[J\].
    pub energy: f64,
}

impl CycleFigures {
    /// Figures of a cycle relative to itself.
    pub const SAME: CycleFigures = CycleFigures {
        force: 1.0,
        energy: 1.0,
    };

    /// Returns the figures relative to `other`; 1 where `other` is zero.
    #[must_use]
    pub fn relative_to(self, other: CycleFigures) -> CycleFigures {
        let ratio = |value: f64, other: f64| if other > 0.0 { value / other } else { 1.0 };
        CycleFigures {
            force: ratio(self.force, other.force),
            energy: ratio(self.energy, other.energy),
        }
    }

    /// Extrapolates the figures to the end of a step, from its beginning (`self`) and its middle.
    #[must_use]
    pub fn at_end(self, middle: CycleFigures) -> CycleFigures {
        let end = |begin: f64, middle: f64| (2.0 * middle - begin).max(0.0);
        CycleFigures {
            force: end(self.force, middle.force),
            energy: end(self.energy, middle.energy),
        }
    }
}

/// Quantity that made an update due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UpdateCause {
    /// Relative change of kn.
    Kn,
    /// Relative change of kt.
    Kt,
    /// Relative change of the force of a cycle.
    Force,
    /// Relative change of the energy of a cycle.
    Energy,
    /// Number of wear iterations.
    Iterations,
    /// Increase of the worn volume.
    WearVolume,
    /// Relative growth of the worn volume.
    VolumeGrowth,
}

/// Due update, as a run records it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DueUpdate {
    /// Quantity that has reached its limit. If several quantities have reached their limits, the quantity with the
    /// largest change.
    pub to: UpdateCause,
    /// Change since the last update. For the causes kn, kt, force and energy, the change is k/k_ref − 1, with its sign.
    /// The change is ∞ if the joint has become rigid. For the cause iterations, the change is the number of iterations.
    /// For the cause volume, the change is the additional worn volume \[m³\]. For the cause volume growth, the change
    /// is the relative growth of the worn volume.
    pub value: f64,
    /// Limit that the value has reached.
    pub limit: f64,
}

impl UpdateCriterion {
    /// Describes in words when an update is due.
    pub fn describe(&self) -> String {
        match self {
            UpdateCriterion::Never => "never".to_owned(),
            UpdateCriterion::StiffnessChange {
                change,
                volume_growth,
            } => {
                let growth = match volume_growth {
                    Some(growth) => format!(", or when the worn volume has grown by {growth}"),
                    None => String::new(),
                };
                format!(
                    "after static_contact, when kn or kt has changed by {change} since the last update (with sliders also the force or energy \
                     of a cycle){growth}"
                )
            }
            UpdateCriterion::Iterations(every) => format!("every {every} wear iterations"),
            UpdateCriterion::WearVolume(volume) => {
                format!("after wear, at every {volume:e} m^3 of worn volume")
            }
        }
    }

    /// Returns the scene key of the criterion; `None` if no update is ever due.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            UpdateCriterion::Never => None,
            UpdateCriterion::StiffnessChange { .. } => Some("update.stiffness_change"),
            UpdateCriterion::Iterations(_) => Some("update.iterations"),
            UpdateCriterion::WearVolume(_) => Some("update.wear_volume"),
        }
    }

    /// Checks that the limits are positive and finite.
    ///
    /// # Errors
    /// Returns [`ModelUpdateError::OutOfRange`] with the key of the scene.
    pub fn check(&self) -> Result<(), ModelUpdateError> {
        let (name, value, expected) = match *self {
            UpdateCriterion::Never => return Ok(()),
            UpdateCriterion::StiffnessChange {
                change,
                volume_growth,
            } => match volume_growth {
                Some(growth) if !(growth > 0.0 && growth.is_finite()) => (
                    "update.volume_growth",
                    growth,
                    "positive, a fraction of the volume such as 0.5",
                ),
                _ => (
                    "update.stiffness_change",
                    change,
                    "positive, a fraction of k such as 0.10",
                ),
            },
            UpdateCriterion::Iterations(n) => ("update.iterations", n as f64, "at least 1"),
            UpdateCriterion::WearVolume(v) => ("update.wear_volume", v, "positive"),
        };
        if value > 0.0 && value.is_finite() {
            return Ok(());
        }
        Err(ModelUpdateError::OutOfRange {
            name,
            value,
            expected,
        })
    }

    /// Returns the due update, if there is one. `reference` is the state at the last update.
    pub fn due(&self, reference: &UpdateState, now: &UpdateState) -> Option<DueUpdate> {
        let change = self.change(reference, now)?;
        (change.value.abs() >= change.limit).then_some(change)
    }

    /// Returns the progress from the last update (0) to the next (1); 0 if no update is ever due. The progress is 1 if
    /// the volume growth slightly exceeds the limit `volume_growth`. Volume growth is not an event, and only limits the
    /// distance between updates.
    pub fn progress(&self, reference: &UpdateState, now: &UpdateState) -> f64 {
        self.change(reference, now).map_or(0.0, |change| {
            let progress = change.value.abs() / change.limit;
            match change.to {
                UpdateCause::VolumeGrowth if progress > 1.0 => {
                    (progress - UpdateSettings::DEFAULT.volume_growth_margin).max(1.0)
                }
                _ => progress,
            }
        })
    }

    /// Returns the worn volume whose growth makes an update due \[m³\]; `None` if growth does not count.
    pub fn due_volume(&self, reference: &UpdateState, running_in: f64) -> Option<f64> {
        match *self {
            UpdateCriterion::StiffnessChange {
                volume_growth: Some(growth),
                ..
            } => Some(reference.wear_volume.max(running_in) * (1.0 + growth)),
            _ => None,
        }
    }

    fn change(&self, reference: &UpdateState, now: &UpdateState) -> Option<DueUpdate> {
        let (to, value, limit) = match *self {
            UpdateCriterion::Never => return None,
            UpdateCriterion::StiffnessChange {
                change: limit,
                volume_growth,
            } => {
                let (old, new) = (reference.compliance, now.compliance);
                let mut largest = (UpdateCause::Kn, change(old.normal, new.normal));
                let mut consider = |to, value: f64| {
                    if value.abs() > largest.1.abs() {
                        largest = (to, value);
                    }
                };
                consider(UpdateCause::Kt, change(old.tangential, new.tangential));
                if let (Some(old), Some(new)) = (reference.cycle, now.cycle) {
                    consider(UpdateCause::Force, change(new.force, old.force));
                    consider(UpdateCause::Energy, change(new.energy, old.energy));
                }
                let growth = volume_growth.map(|limit| (relative_growth(reference, now), limit));
                // Select the change with the largest ratio of change to limit.
                match growth {
                    Some((growth, growth_limit))
                        if growth / growth_limit > largest.1.abs() / limit =>
                    {
                        (UpdateCause::VolumeGrowth, growth, growth_limit)
                    }
                    _ => (largest.0, largest.1, limit),
                }
            }
            UpdateCriterion::Iterations(limit) => {
                let elapsed = now.iteration.saturating_sub(reference.iteration);
                (UpdateCause::Iterations, elapsed as f64, limit as f64)
            }
            UpdateCriterion::WearVolume(limit) => (
                UpdateCause::WearVolume,
                now.wear_volume - reference.wear_volume,
                limit,
            ),
        };
        Some(DueUpdate { to, value, limit })
    }

    /// Returns whether an update is due.
    pub fn is_due(&self, reference: &UpdateState, now: &UpdateState) -> bool {
        self.due(reference, now).is_some()
    }
}

/// Returns the relative growth of the worn volume since the last update, or since running-in if that was later.
fn relative_growth(reference: &UpdateState, now: &UpdateState) -> f64 {
    let from = reference.wear_volume.max(now.running_in);
    let growth = now.wear_volume / from - 1.0;
    if growth > 0.0 { growth } else { 0.0 }
}

/// Returns k/k_ref − 1 = c_ref/c − 1 of the compliances `reference` and `now`. A joint that stays rigid, or stays open,
/// has not changed.
fn change(reference: f64, now: f64) -> f64 {
    if reference == now {
        0.0
    } else {
        reference / now - 1.0
    }
}
