//! The cycle that a rough contact goes through, and what moves it.

use serde::{Deserialize, Serialize};

use super::decision::Decisions;
use super::{Contact, Reasons, Recipe};
use crate::dynamics::cycle::WorkBetweenEnds;
use crate::wear::cycle::March;
use crate::wear::{HarmonicMotion, Motion};

/// What the decisions on a cycle are called.
pub(super) const CYCLE: &str = "fretting cycle";

/// A computed motion that varies the load by less than this share of it, and leaves its line by less than this share of its
/// reach, is marched between its two reversals: the error of wear is of second order in both.
pub const STRAIGHT: f64 = 0.01;
/// Where contact elements have laws of their own, a computed motion that leaves its line by less than this share of its reach may be
/// marched between its two reversals: what the elements do beside the line, and where they turn once more next to an end, is in what they say of
/// the work of friction ([`WorkBetweenEnds`]). The line is that of all elements, not of their mean.
/// Laps of bars that leave it by a quarter dissipate between two ends within some percent of what stepped cycles do; an orbit leaves it by all. Where the joint
/// wears, stepped cycles on half the grid tell what is missed. The published joint of Rq 1 µm comes to 0.33, and stepped cycles took it half an hour.
pub const STRAIGHT_WITH_LAWS: f64 = 0.4;
/// Where contact elements have laws of their own, these say what the variation of their loads makes of the work of friction, and a cycle between
/// two reversals is corrected by it ([`WorkBetweenEnds`]). Below this part of all friction, the correction is taken for it.
pub const CORRECTED: f64 = 0.5;
/// What the correction leaves, in parts of it. Against cycles that are stepped under the load of each place it left at most 0.34 of the
/// correction in five unworn joints or little worn ones, and 0.36 and 0.26 in two worn flat.
const LEFT: f64 = 0.4;

/// A motion that the cycle of a recipe cannot march.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CycleError {
    /// `reversal` or `superposition` for another motion than they can march.
    #[error(
        "`fidelity.cycle` is \"{mode}\", which needs a straight motion about zero that turns at its ends only, under constant normal load; use \"stepped\""
    )]
    NotStraight {
        /// The value of `fidelity.cycle`.
        mode: &'static str,
    },
    /// The load lifts off within the cycle.
    #[error(
        "the normal load falls to {load:.6e} N within the cycle; it must stay above zero: make `motion.normal_load_amplitude` smaller than `contact.normal_load`, or raise `normal_load` of `motion.history`"
    )]
    LiftsOff {
        /// The least load \[N\].
        load: f64,
    },
    /// A vibration opens the whole joint within the cycle.
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

/// The cycle of a rough contact.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cycle {
    /// What moves the joint.
    pub motion: MotionSource,
    /// How the cycle is marched; none: decided from the motion that is computed, unless `asked` says so.
    pub march: Option<March>,
    /// How a computed motion is to be marched, if it allows it; none: between its reversals where it is straight and steady enough.
    pub asked: Option<March>,
    /// Time steps of a stepped cycle.
    pub steps: usize,
    /// Whether a stepped cycle has steps of second order, and is extrapolated to steps of no length from its samples and half of them.
    pub extrapolate: bool,
    /// The reasons.
    pub why: Reasons,
}

/// Where the motion of a joint comes from.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum MotionSource {
    /// It is harmonic.
    Harmonic(HarmonicMotion),
    /// One cycle as a table in a file.
    History {
        /// Hash of its content.
        content: String,
        /// Samples of the cycle.
        samples: usize,
        /// Whether every other of them is there to extrapolate the cycle.
        halved: bool,
    },
    /// What the response of the structure gives the joint.
    Computed,
}

/// What kind of motion a joint is put through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum MotionKind {
    /// To and fro along a line, under constant load.
    Line,
    /// Along a closed curve, under constant load.
    Orbit,
    /// Under a load that varies.
    VaryingLoad,
    /// Driven by a force, under constant load.
    Force,
    /// With a rotation about the normal.
    Torsion,
    /// A table in a file.
    History,
    /// What a structure gives it.
    Vibration,
    /// None.
    Rest,
}

impl MotionKind {
    /// All of them, in the order in which they are told.
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

    /// The kind of a recipe; of several that it is, the one that stands last.
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

    /// What a person calls it.
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
    /// The motion that the numbers of the recipe give; that of a file, and one that is computed, are none.
    pub fn harmonic_motion(&self, normal_load: f64) -> Option<Motion> {
        match &self.motion {
            MotionSource::Harmonic(motion) => Some(motion.sampled(normal_load, self.steps)),
            _ => None,
        }
    }

    /// The motion that is marched for a computed one, and how: between its reversals where it is straight and steady enough, else at
    /// `steps` of its samples. Also what a march between reversals leaves out of the work of friction, relative to it.
    ///
    /// `fine` has many samples, a multiple of `steps`. Where contact elements have laws of their own, `work` is what they say of theirs.
    ///
    /// # Errors
    /// [`CycleError::NotStraight`] where `reversal` is asked for and not possible, [`CycleError::Opens`].
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
            let motion = fine.every(every.max(1)).about_its_middle();
            (motion, March::Stepped, 0.0)
        };
        if self.asked == Some(March::Stepped) {
            return Ok(stepped());
        }
        let to_and_fro = match work {
            None => {
                let motion = fine.reversals(STRAIGHT, STRAIGHT);
                motion.map(|motion| (motion, fine.reversal_energy_error()))
            }
            Some(work) => {
                let corrects = self.asked.is_some() || work.changed <= CORRECTED;
                let follows = corrects && work.line.departure <= STRAIGHT_WITH_LAWS;
                let left_out = LEFT * work.changed + work.untold;
                follows.then(|| (fine.between_ends(work.line.ends), left_out))
            }
        };
        match (to_and_fro, self.asked) {
            (Some((motion, left_out)), asked) => {
                Ok((motion, asked.unwrap_or(March::Reversal), left_out))
            }
            (None, Some(march)) => Err(CycleError::NotStraight { mode: march.word() }),
            (None, None) => Ok(stepped()),
        }
    }

    /// Says what was decided about the cycle.
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
    /// The word for it in a scene.
    pub fn word(self) -> &'static str {
        match self {
            March::Superposition => "superposition",
            March::Reversal => "reversal",
            March::Stepped => "stepped",
        }
    }
}

/// Why a motion that is computed is marched as it is.
pub(crate) fn why_computed(asked: Option<March>) -> String {
    let straight = format!(
        "the motion may leave its line by {STRAIGHT} of its reach and the joint's load vary by {STRAIGHT} of it; with sliders it may leave its line by {STRAIGHT_WITH_LAWS}, and loads vary by what changes their friction by {CORRECTED}, which corrects the cycle"
    );
    match asked {
        Some(March::Stepped) => "fidelity.cycle or the preset asks for it".to_owned(),
        Some(_) => format!("fidelity.cycle asks for it; {straight}"),
        None => format!("reversal where it is straight: {straight}; else stepped"),
    }
}
