//! When the contact elements are due for an update [A §2e, §4d(i)].

use serde::{Deserialize, Serialize};

use super::{Compliance, ModelUpdateError};

/// How far the growth of the volume may pass its limit, in parts of it.
const PASSED: f64 = 0.15;

/// What makes an update due, measured from the last update.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UpdateCriterion {
    /// Nothing.
    #[default]
    Never,
    /// kn or kt of the joint has changed by the part `change`, |k/k_ref − 1| ≥ v; so have force or energy of a cycle against those of the elements
    /// under the same motion, where elements have these of the rough contact ([`super::Laws`]). Also where the worn volume has grown by the part
    /// `volume_growth`, once the joint has run in.
    StiffnessChange {
        /// Of kn, kt, force or energy.
        change: f64,
        /// Of the worn volume; none: it does not count.
        volume_growth: Option<f64>,
    },
    /// So many wear iterations.
    Iterations(u64),
    /// So much worn volume \[m³\].
    WearVolume(f64),
}

/// A state of the joint as criteria see it: at the last update, or now.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct UpdateState {
    /// Wear iteration.
    pub iteration: u64,
    /// Compliance of the springs together, [`super::Springs::compliance`].
    pub compliance: Compliance,
    /// Cumulative worn volume \[m³\].
    pub wear_volume: f64,
    /// Worn volume up to which the joint runs in \[m³\]: growth counts from there.
    pub running_in: f64,
    /// A cycle of the fine contact under the elements in force, where it counts.
    pub cycle: Option<CycleFigures>,
}

/// What a cycle of the fine contact does under a given vibration: the stiffness and damping that the structure has of it. Where the motion follows
/// the wear, in parts of what the elements do under the same motion, times what they do in the response in force.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct CycleFigures {
    /// Half range of the force along the motion \[N\].
    pub force: f64,
    /// Dissipated energy \[J\].
    pub energy: f64,
}

impl CycleFigures {
    /// Those of a cycle in parts of itself.
    pub const SAME: CycleFigures = CycleFigures {
        force: 1.0,
        energy: 1.0,
    };

    /// In parts of another cycle; 1 of what that has nothing of.
    #[must_use]
    pub fn over(self, other: CycleFigures) -> CycleFigures {
        let part = |value: f64, of: f64| if of > 0.0 { value / of } else { 1.0 };
        CycleFigures {
            force: part(self.force, other.force),
            energy: part(self.energy, other.energy),
        }
    }

    /// At the end of a step, from its beginning (`self`) and its middle.
    #[must_use]
    pub fn at_end(self, middle: CycleFigures) -> CycleFigures {
        let end = |begin: f64, middle: f64| (2.0 * middle - begin).max(0.0);
        CycleFigures {
            force: end(self.force, middle.force),
            energy: end(self.energy, middle.energy),
        }
    }
}

/// What made an update due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum UpdateCause {
    /// Change of kn.
    Kn,
    /// Change of kt.
    Kt,
    /// Change of the force of a cycle.
    Force,
    /// Change of the energy of a cycle.
    Energy,
    /// Wear iterations.
    Iterations,
    /// Worn volume.
    WearVolume,
    /// Growth of the worn volume.
    VolumeGrowth,
}

/// An update that is due, to be recorded with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DueUpdate {
    /// Which quantity; of several, the one that changed most.
    pub to: UpdateCause,
    /// Its value since the last update: k/k_ref − 1 (and so of force and energy) with its sign (∞ if the joint has become rigid), iterations, or volume
    /// \[m³\].
    pub value: f64,
    /// The limit that it has reached.
    pub limit: f64,
}

impl UpdateCriterion {
    /// When an update is due, in words.
    pub fn describe(&self) -> String {
        match self {
            UpdateCriterion::Never => "never".to_owned(),
            UpdateCriterion::StiffnessChange {
                change,
                volume_growth,
            } => {
                let growth = match volume_growth {
                    Some(growth) => format!("; where the worn volume has grown by {growth}"),
                    None => String::new(),
                };
                format!(
                    "after static_contact: where kn or kt has changed by {change} since the last, and with sliders force or energy of a \
                     cycle{growth}"
                )
            }
            UpdateCriterion::Iterations(every) => format!("every {every} wear iterations"),
            UpdateCriterion::WearVolume(volume) => format!("after wear: at every {volume:e} m^3"),
        }
    }

    /// The key of a scene that it comes from; none if nothing makes an update due.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            UpdateCriterion::Never => None,
            UpdateCriterion::StiffnessChange { .. } => Some("update.stiffness_change"),
            UpdateCriterion::Iterations(_) => Some("update.iterations"),
            UpdateCriterion::WearVolume(_) => Some("update.wear_volume"),
        }
    }

    /// Checks the limit.
    ///
    /// # Errors
    /// [`ModelUpdateError::OutOfRange`] with the scene's key.
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
                    "positive, a part of the volume: 0.5",
                ),
                _ => (
                    "update.stiffness_change",
                    change,
                    "positive, a part of k: 0.10",
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

    /// Whether an update is due, and why; `reference` is the state at the last update.
    pub fn due(&self, reference: &UpdateState, now: &UpdateState) -> Option<DueUpdate> {
        let change = self.change(reference, now)?;
        (change.value.abs() >= change.limit).then_some(change)
    }

    /// How far a state is on its way from the last update to the next, which is due at 1; 0 if none ever is. The growth of the volume has come there as long as
    /// it has not passed it by more than a little: it is no event, but keeps updates from being too far apart.
    pub fn progress(&self, reference: &UpdateState, now: &UpdateState) -> f64 {
        self.change(reference, now).map_or(0.0, |change| {
            let progress = change.value.abs() / change.limit;
            match change.to {
                UpdateCause::VolumeGrowth if progress > 1.0 => (progress - PASSED).max(1.0),
                _ => progress,
            }
        })
    }

    /// Volume at which an update is due for its growth \[m³\]; none where that does not count.
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
                let mut most = (UpdateCause::Kn, change(old.normal, new.normal));
                let mut also = |to, value: f64| {
                    if value.abs() > most.1.abs() {
                        most = (to, value);
                    }
                };
                also(UpdateCause::Kt, change(old.tangential, new.tangential));
                if let (Some(old), Some(new)) = (reference.cycle, now.cycle) {
                    also(UpdateCause::Force, change(new.force, old.force));
                    also(UpdateCause::Energy, change(new.energy, old.energy));
                }
                let growth = volume_growth.map(|limit| (grown(reference, now), limit));
                // Each in parts of its own limit.
                match growth {
                    Some((grown, of)) if grown / of > most.1.abs() / limit => {
                        (UpdateCause::VolumeGrowth, grown, of)
                    }
                    _ => (most.0, most.1, limit),
                }
            }
            UpdateCriterion::Iterations(limit) => {
                let passed = now.iteration.saturating_sub(reference.iteration);
                (UpdateCause::Iterations, passed as f64, limit as f64)
            }
            UpdateCriterion::WearVolume(limit) => (
                UpdateCause::WearVolume,
                now.wear_volume - reference.wear_volume,
                limit,
            ),
        };
        Some(DueUpdate { to, value, limit })
    }

    /// [`UpdateCriterion::due`] without the reason.
    pub fn is_due(&self, reference: &UpdateState, now: &UpdateState) -> bool {
        self.due(reference, now).is_some()
    }
}

/// What the worn volume has grown by since the last update, or since the joint has run in.
fn grown(reference: &UpdateState, now: &UpdateState) -> f64 {
    let from = reference.wear_volume.max(now.running_in);
    let grown = now.wear_volume / from - 1.0;
    if grown > 0.0 { grown } else { 0.0 }
}

/// k/k_ref − 1 = c_ref/c − 1 of compliances `reference` and `now`. A joint that was rigid and is, or open and is, has not changed.
fn change(reference: f64, now: f64) -> f64 {
    if reference == now {
        0.0
    } else {
        reference / now - 1.0
    }
}
