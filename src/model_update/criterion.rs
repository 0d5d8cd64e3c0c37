//! When the contact elements are due for an update [A §2e, §4d(i)].

use serde::{Deserialize, Serialize};

use super::{Compliance, ModelUpdateError};

/// What makes an update due, measured from the last update.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Criterion {
    /// Nothing.
    #[default]
    Never,
    /// kn or kt of the joint has changed by this part: |k/k_ref − 1| ≥ v.
    StiffnessChange(f64),
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
}

/// What made an update due.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DueTo {
    /// Change of kn.
    Kn,
    /// Change of kt.
    Kt,
    /// Wear iterations.
    Iterations,
    /// Worn volume.
    WearVolume,
}

/// An update that is due, to be recorded with it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Due {
    /// Which quantity; of kn and kt, the one that changed more.
    pub to: DueTo,
    /// Its value since the last update: k/k_ref − 1 with its sign (∞ if the joint has become rigid), iterations, or volume
    /// \[m³\].
    pub value: f64,
    /// The limit that it has reached.
    pub limit: f64,
}

impl Criterion {
    /// When an update is due, in words.
    pub fn told(&self) -> String {
        match self {
            Criterion::Never => "never".to_owned(),
            Criterion::StiffnessChange(change) => {
                format!(
                    "after static_contact: where kn or kt has changed by {change} since the last"
                )
            }
            Criterion::Iterations(every) => format!("every {every} wear iterations"),
            Criterion::WearVolume(volume) => format!("after wear: at every {volume:e} m^3"),
        }
    }

    /// The key of a scene that it comes from; none if nothing makes an update due.
    pub fn key(&self) -> Option<&'static str> {
        match self {
            Criterion::Never => None,
            Criterion::StiffnessChange(_) => Some("update.stiffness_change"),
            Criterion::Iterations(_) => Some("update.iterations"),
            Criterion::WearVolume(_) => Some("update.wear_volume"),
        }
    }

    /// Checks the limit.
    ///
    /// # Errors
    /// [`ModelUpdateError::OutOfRange`] with the scene's key.
    pub fn check(&self) -> Result<(), ModelUpdateError> {
        let (name, value, expected) = match *self {
            Criterion::Never => return Ok(()),
            Criterion::StiffnessChange(v) => {
                ("update.stiffness_change", v, "positive, a part of k: 0.10")
            }
            Criterion::Iterations(n) => ("update.iterations", n as f64, "at least 1"),
            Criterion::WearVolume(v) => ("update.wear_volume", v, "positive"),
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
    pub fn due(&self, reference: &UpdateState, now: &UpdateState) -> Option<Due> {
        let change = self.change(reference, now)?;
        (change.value.abs() >= change.limit).then_some(change)
    }

    /// How far a state is on its way from the last update to the next, which is due at 1; 0 if none ever is.
    pub fn progress(&self, reference: &UpdateState, now: &UpdateState) -> f64 {
        self.change(reference, now)
            .map_or(0.0, |change| change.value.abs() / change.limit)
    }

    fn change(&self, reference: &UpdateState, now: &UpdateState) -> Option<Due> {
        let (to, value, limit) = match *self {
            Criterion::Never => return None,
            Criterion::StiffnessChange(limit) => {
                let (old, new) = (reference.compliance, now.compliance);
                let kn = change(old.normal, new.normal);
                let kt = change(old.tangential, new.tangential);
                if kn.abs() >= kt.abs() {
                    (DueTo::Kn, kn, limit)
                } else {
                    (DueTo::Kt, kt, limit)
                }
            }
            Criterion::Iterations(limit) => {
                let passed = now.iteration.saturating_sub(reference.iteration);
                (DueTo::Iterations, passed as f64, limit as f64)
            }
            Criterion::WearVolume(limit) => (
                DueTo::WearVolume,
                now.wear_volume - reference.wear_volume,
                limit,
            ),
        };
        Some(Due { to, value, limit })
    }

    /// [`Criterion::due`] without the reason.
    pub fn is_due(&self, reference: &UpdateState, now: &UpdateState) -> bool {
        self.due(reference, now).is_some()
    }
}

/// k/k_ref − 1 = c_ref/c − 1. A joint that was rigid and is, or open and is, has not changed.
fn change(reference: f64, now: f64) -> f64 {
    if reference == now {
        0.0
    } else {
        reference / now - 1.0
    }
}
