//! The steady cycle of a rough contact, and its motion.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::{Contact, Reasons, Recipe};
use crate::dynamics::cycle::WorkBetweenEnds;
use crate::wear::cycle::March;
use crate::wear::{HarmonicMotion, Motion};

/// Name of the decisions about a cycle.
pub(super) const CYCLE: &str = "fretting cycle";

/// Limit for marching a computed motion between the two reversals of the motion. `STRAIGHT` bounds the variation of the
/// load, relative to the load. `STRAIGHT` also bounds the deviation of the motion from a straight line, relative to the
/// amplitude. The error of wear is of second order in the variation and in the deviation.
pub const STRAIGHT: f64 = 0.01;
/// Limit of the deviation of the motion from a straight line, divided by the amplitude. The limit applies to contact
/// elements with their own friction laws. For elements with their own laws, [`WorkBetweenEnds`] corrects the work for
/// the motion beside the line and for additional reversals near an end of the motion. The straight line is fitted to
/// the motion of all elements, not to the mean motion of the elements.
///
/// If the motion of a bar deviates from the line by a quarter of the amplitude, the dissipation agrees with stepped
/// cycles within some percent. A circular orbit deviates from every line by the full amplitude. If the joint wears,
/// stepped cycles on half the grid measure the remaining error. The deviation of the published joint with Rq 1 µm is
/// 0.33. Stepped cycles of the published joint took half an hour.
pub const STRAIGHT_WITH_LAWS: f64 = 0.4;
/// Limit for the correction by [`WorkBetweenEnds`], for contact elements with their own friction laws. The limit
/// applies to the relative effect of the load variation on the friction work in a cycle between two reversals.
pub const LARGEST_CORRECTION: f64 = 0.5;
/// Remaining error of the correction, divided by the correction. Stepped cycles with local loads measured this ratio.
/// The ratio was at most 0.34 in five joints with little or no wear, and at most 0.36 in two joints that were worn
/// flat.
const CORRECTION_ERROR: f64 = 0.4;

/// Error for a motion that the cycle of a recipe cannot follow.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CycleError {
    /// The cycle mode `reversal` or `superposition` does not support the motion of the joint.
    #[error(
        "`fidelity.cycle` is \"{mode}\", which needs a straight motion about zero that turns at its ends only, under constant normal load; use \"stepped\""
    )]
    NotStraight {
        /// The value of `fidelity.cycle`.
        mode: &'static str,
    },
    /// The normal load falls to zero within the cycle.
    #[error(
        "the normal load falls to {load:.6e} N within the cycle; it must stay above zero: make `motion.normal_load_amplitude` smaller than `contact.normal_load`, or raise `normal_load` of `motion.history`"
    )]
    LiftsOff {
        /// The least load \[N\].
        load: f64,
    },
    /// The vibration opens the whole joint within the cycle.
    #[error(
        "the vibration opens the joint: between samples of the cycle its normal load falls to {load:.4e} N, of {mean:.4e} N on average, and a fine contact without load has no steady cycle; raise `contact.normal_load`, or lower `dynamics.force`"
    )]
    Opens {
        /// The least load \[N\].
        load: f64,
        /// The mean load \[N\].
        mean: f64,
    },
}

/// The steady cycle of a rough contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// Source of the motion.
    pub motion: MotionSource,
    /// Scheme for marching the cycle; `None` to choose it from the computed motion, unless `ask_for_values` requests one.
    pub march: Option<March>,
    /// Requested scheme for a computed motion, if the motion allows it. `None` to march between the reversals if the
    /// motion is straight and steady enough.
    pub asked: Option<March>,
    /// Number of time steps of a stepped cycle.
    pub steps: usize,
    /// True if a stepped cycle uses steps of second order and is extrapolated to a step of zero length. The
    /// extrapolation uses all samples and every other sample.
    pub extrapolate: bool,
    /// Reasons for the choices.
    pub why: Reasons,
}

/// Source of the motion of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum MotionSource {
    /// Harmonic motion.
    Harmonic(HarmonicMotion),
    /// One cycle, tabulated in a file.
    History {
        /// Hash of the content.
        content: String,
        /// Number of samples in the cycle.
        samples: usize,
        /// True if every other sample serves only to extrapolate the cycle.
        halved: bool,
    },
    /// Response of the structure.
    Computed,
}

/// Kind of the motion of a joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MotionKind {
    /// Straight motion under constant load.
    Line,
    /// Closed curve under constant load.
    Orbit,
    /// Motion under varying load.
    VaryingLoad,
    /// Motion driven by a force, under constant load.
    Force,
    /// Motion with a rotation about the normal.
    Torsion,
    /// Tabulated motion from a file.
    History,
    /// Motion from the response of a structure.
    Vibration,
    /// No motion.
    Rest,
}

impl MotionKind {
    /// All kinds, in the order of reports.
    pub const ALL: [MotionKind; 8] = [
        MotionKind::Line,
        MotionKind::Orbit,
        MotionKind::VaryingLoad,
        MotionKind::Force,
        MotionKind::Torsion,
        MotionKind::History,
        MotionKind::Vibration,
        MotionKind::Rest,
    ];

    /// Returns the kind of motion of a recipe. If several kinds apply, returns the last of them in
    /// [`MotionKind::ALL`].
    pub fn of(recipe: &Recipe) -> MotionKind {
        if recipe.response.is_some() {
            return MotionKind::Vibration;
        }
        match recipe.cycle().map(|cycle| &cycle.motion) {
            None => MotionKind::Rest,
            Some(MotionSource::Computed) => MotionKind::Vibration,
            Some(MotionSource::History { .. }) => MotionKind::History,
            Some(MotionSource::Harmonic(motion)) => {
                let moving = || motion.axes.iter().filter(|axis| axis.amplitude != 0.0);
                if motion.rotation.as_ref().is_some_and(|r| r.amplitude != 0.0) {
                    MotionKind::Torsion
                } else if moving().any(|axis| axis.is_force) {
                    MotionKind::Force
                } else if motion.normal_load_amplitude != 0.0 {
                    MotionKind::VaryingLoad
                } else if motion.is_straight() {
                    MotionKind::Line
                } else {
                    MotionKind::Orbit
                }
            }
        }
    }

    /// Returns the word for reports.
    pub fn word(self) -> &'static str {
        match self {
            MotionKind::Line => "line",
            MotionKind::Orbit => "orbit",
            MotionKind::VaryingLoad => "varying load",
            MotionKind::Force => "force",
            MotionKind::Torsion => "torsion",
            MotionKind::History => "history",
            MotionKind::Vibration => "vibration",
            MotionKind::Rest => "rest",
        }
    }
}

impl Cycle {
    /// Returns the motion from the numbers of the recipe; `None` for a motion from a file and for a computed motion.
    pub fn harmonic_motion(&self, normal_load: f64) -> Option<Motion> {
        match &self.motion {
            MotionSource::Harmonic(motion) => Some(motion.sampled(normal_load, self.steps)),
            _ => None,
        }
    }

    /// Returns the motion to march for a computed motion, the scheme, and the relative error of the work of friction.
    /// A motion that is straight and steady enough is marched between its reversals, other motions at `steps` of the
    /// samples. The error is the part of the work that a march between reversals omits.
    ///
    /// `fine` has many samples, a multiple of `steps`. `work` is the work of contact elements that have their own
    /// friction laws.
    ///
    /// # Errors
    /// Returns [`CycleError::NotStraight`] if `reversal` is requested but not possible, and [`CycleError::Opens`].
    pub fn of_computed(
        &self,
        fine: &Motion,
        work: Option<&WorkBetweenEnds>,
    ) -> Result<(Motion, March, f64), CycleError> {
        let loads = fine.normal_load.iter().copied();
        let least = loads.fold(f64::INFINITY, f64::min);
        if least <= 0.0 {
            let mean = fine.mean_load;
            return Err(CycleError::Opens { load: least, mean });
        }
        let stepped = || {
            let every = fine.samples() / self.steps;
            let motion = fine.thinned(every.max(1)).about_its_middle();
            (motion, March::Stepped, 0.0)
        };
        if self.asked == Some(March::Stepped) {
            return Ok(stepped());
        }
        let between_reversals = match work {
            None => {
                let motion = fine.reversals(STRAIGHT, STRAIGHT);
                motion.map(|motion| (motion, fine.reversal_energy_error()))
            }
            Some(work) => {
                let corrects = self.asked.is_some() || work.changed_share <= LARGEST_CORRECTION;
                let follows = corrects && work.line.largest_deviation <= STRAIGHT_WITH_LAWS;
                let left_out = CORRECTION_ERROR * work.changed_share + work.unrepresented_share;
                follows.then(|| (fine.between_ends(work.line.ends), left_out))
            }
        };
        match (between_reversals, self.asked) {
            (Some((motion, left_out)), asked) => {
                Ok((motion, asked.unwrap_or(March::Reversal), left_out))
            }
            (None, Some(march)) => Err(CycleError::NotStraight { mode: march.word() }),
            (None, None) => Ok(stepped()),
        }
    }

    /// Explains the choices about the cycle.
    pub(super) fn explain(&self, contact: &Contact, decisions: &mut Decisions) {
        if let MotionSource::Harmonic(HarmonicMotion { axes, rotation, .. }) = &self.motion {
            if axes
                .iter()
                .any(|axis| axis.is_force && axis.amplitude != 0.0)
            {
                decisions.add(
                    "force in the plane",
                    "given; the displacement is found and reported",
                    "motion.force",
                );
            }
            match rotation.map(|rotation| rotation.is_force) {
                Some(false) => decisions.add(
                    "rotation about z",
                    "given; its moment is reported",
                    "motion.rotation",
                ),
                Some(true) => decisions.add(
                    "rotation about z",
                    "found from the moment given, and reported",
                    "motion.moment",
                ),
                None => {}
            }
        }
        let samples = match &self.motion {
            MotionSource::History { samples, .. } => *samples,
            _ => self
                .harmonic_motion(contact.conditions.normal_load)
                .map_or(self.steps, |motion| motion.samples()),
        };
        let extrapolated = if self.extrapolate {
            "; steps of second order, half as many too, extrapolated"
        } else {
            ""
        };
        let stepped =
            || format!("stepped: {samples} exact solves a cycle, until it closes{extrapolated}");
        let choice = match (self.march, self.asked) {
            (Some(March::Reversal), _) => "reversal: one exact solve a cycle".to_owned(),
            (Some(March::Superposition), _) => {
                "superposition: two pressures in place of a tangential solve, an approximation"
                    .to_owned()
            }
            (Some(March::Stepped), _) | (None, Some(March::Stepped)) => stepped(),
            (None, Some(march)) => format!(
                "{}, if the motion that dynamic_response finds allows it",
                march.word()
            ),
            (None, None) => "after dynamic_response: reversal or stepped".to_owned(),
        };
        decisions.add(CYCLE, choice, self.why.of("march"));
    }
}

impl March {
    /// Returns the name of the scheme in a scene.
    pub fn word(self) -> &'static str {
        match self {
            March::Superposition => "superposition",
            March::Reversal => "reversal",
            March::Stepped => "stepped",
        }
    }
}

/// Returns the reason for the scheme of a computed motion.
pub(crate) fn why_computed(asked: Option<March>) -> String {
    let straight = format!(
        "the motion may leave its line by {STRAIGHT} of its reach and the joint's load vary by {STRAIGHT} of it; with sliders it may leave its line by {STRAIGHT_WITH_LAWS}, and loads vary by what changes their friction by {LARGEST_CORRECTION}, which corrects the cycle"
    );
    match asked {
        Some(March::Stepped) => "fidelity.cycle or the preset asks for it".to_owned(),
        Some(_) => format!("fidelity.cycle asks for it; {straight}"),
        None => format!("reversal where it is straight: {straight}; else stepped"),
    }
}
