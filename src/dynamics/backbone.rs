//! Backbone of a resonance: frequency, damping ratio and amplitude of the phase resonance as functions of the force
//! level. Another parameter can replace the force level.
//!
//! The damping ratio is defined by energy: ζ = E_d / (4π T). E_d is the energy that friction and damping dissipate per
//! cycle, in all harmonics. T = ½ ω² q̂ᴴ M q̂ is the peak kinetic energy of the fundamental q̂ of all coordinates. A
//! linear oscillator has E_d = π c ω U² and T = ½ m ω² U² at the phase resonance. The damping ratio of the oscillator
//! is then ζ = c / 2mω, except for rounding. For a motion in one mode, the damping ratio ζ equals the modal damping
//! ratio of the extended periodic motion concept (M. Krack, Computers & Structures 154, 2015, 59). The fundamental of
//! this motion dissipates 2π ζ ω² a² at the modal amplitude a = √(q̂ᴴ M q̂).

use super::branch::{Branch, LevelParameter};
use super::contact_element::ContactElement;
use super::{DynamicsError, Energy, HarmonicBalance, Vibration};
use crate::linalg::RowMatrix as Matrix;

/// Levels of a backbone: half ranges of the drive \[N\], or values of another parameter in any unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadLevels {
    /// First level, above 0.
    pub from: f64,
    /// Last level; above the first for a force, different from the first for another parameter.
    pub to: f64,
    /// Number of levels, including both ends, at equal ratios. `None`: as many as the curve needs to be drawn with
    /// lines.
    pub count: Option<usize>,
}

/// Phase resonance on a backbone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BackbonePoint {
    /// Number of the branch, from 0. The number increases by one after each level at which the amplitude leaps.
    pub branch: usize,
    /// The level, as in [`LoadLevels`].
    pub level: f64,
    /// Half range of the drive \[N\].
    pub force: f64,
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Damping ratio: dissipated energy over 4π times `kinetic_energy`.
    pub damping_ratio: f64,
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Peak kinetic energy of the first harmonic, summed over all coordinates \[J\]. The peak is twice the mean kinetic
    /// energy of the cycle.
    pub kinetic_energy: f64,
    /// Energy per cycle, in all harmonics.
    pub energy: Energy,
    /// Number of contact elements that slide in the cycle and never open.
    pub sliding: usize,
    /// Number of contact elements that open in the cycle.
    pub open: usize,
    /// Number of all contact elements.
    pub elements: usize,
}

impl BackbonePoint {
    /// Returns the share of the contact elements that slide; 0 without elements.
    pub fn sliding_fraction(&self) -> f64 {
        self.share(self.sliding)
    }

    /// Returns the share of the contact elements that open; 0 without elements.
    pub fn open_fraction(&self) -> f64 {
        self.share(self.open)
    }

    fn share(&self, elements: usize) -> f64 {
        match self.elements {
            0 => 0.0,
            all => elements as f64 / all as f64,
        }
    }
}

/// Reason for the end of a backbone.
#[derive(Debug, Clone, PartialEq)]
pub enum BackboneEnd {
    /// The backbone reaches the last level.
    Reached,
    /// The backbone ends before the last level, because nothing bounds the amplitude at the next level. Friction at its
    /// limit takes no more energy from the vibration.
    Unbounded {
        /// The first level without a phase resonance.
        level: f64,
        /// Growth of the amplitude over the growth of the level before the end, both as logarithms.
        growth: f64,
    },
    /// The backbone ends before the last level because the solver returned an error.
    Ceased {
        /// The level at which no phase resonance was found.
        level: f64,
        /// The error of the solver.
        source: DynamicsError,
    },
    /// The backbone ends before the last level, because the next phase resonance belongs to another mode.
    OtherMode {
        /// The level at which the solver found a resonance of another mode.
        level: f64,
    },
    /// The backbone ends before the last level, because the structure of the next level could not be built.
    StructureError {
        /// The level of the structure that could not be built.
        level: f64,
    },
}

/// Backbone: phase resonances over the level.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbone {
    /// The phase resonances, in the order of the levels.
    pub points: Vec<BackbonePoint>,
    /// Error at the first level, if the backbone begins at a later level.
    pub begin: Option<DynamicsError>,
    /// Levels at which the branch folds back; beyond each fold the amplitude leaps to another branch.
    pub folds: Vec<f64>,
    /// Reason for the end of the backbone.
    pub end: BackboneEnd,
    /// Number of solves for a phase resonance, including solves that gave no point.
    pub solves: usize,
    /// Number of Newton iterations of all solves for a phase resonance.
    pub iterations: usize,
}

/// Driven structure for the search of a phase resonance.
pub struct DrivenStructure {
    /// Harmonic balance of the driven structure.
    pub balance: HarmonicBalance<ContactElement>,
    /// Mass matrix of the reduced structure.
    pub(super) mass: Matrix,
    /// Range of the resonance \[Hz\].
    pub(super) range: (f64, f64),
    /// Port of the response.
    pub(super) response_port: usize,
}

impl DrivenStructure {
    /// Returns the half range of the drive \[N\]; 0 without a drive.
    pub(super) fn drive(&self) -> f64 {
        let drive = self.balance.drive();
        drive.map_or(0.0, |load| load.cosine.hypot(load.sine))
    }
}

impl Vibration {
    /// Creates the driven structure of the vibration from a harmonic balance of the vibration.
    pub fn driven_structure(&self, balance: HarmonicBalance<ContactElement>) -> DrivenStructure {
        DrivenStructure {
            balance,
            mass: self.model.mass.clone(),
            range: self.range,
            response_port: self.response_port,
        }
    }

    /// Computes the backbone of the phase resonance of `balance`, upwards from the smallest level.
    ///
    /// The level scales all loads except constant loads. The backbone begins at the smallest level, with the strongest
    /// phase resonance in the frequency range of the vibration. The backbone stays on the branch of this phase
    /// resonance. If the amplitude leaps at a force but the frequency hardly changes, the backbone continues after the
    /// leap as another branch.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] for levels that form no range, or a balance without a drive. The error of
    /// [`HarmonicBalance::phase_resonance`] at the smallest level if no larger level has a phase resonance either. If
    /// the resonance ceases on the way up, the backbone ends.
    pub fn backbone(
        &self,
        balance: HarmonicBalance<ContactElement>,
        levels: LoadLevels,
    ) -> Result<Backbone, DynamicsError> {
        let targets = levels.targets(LevelParameter::Force)?;
        let rows = balance.load_rows.clone();
        let mean = balance.harmonics().slot_of(0);
        let n = balance.harmonics().coefficients();
        let driven = self.driven_structure(balance);
        let drive = driven.drive();
        let scale = |driven: &mut DrivenStructure, force: f64| {
            let factor = force / drive;
            let scaled = driven.balance.load_rows.iter_mut().zip(&rows);
            for (index, (load, unscaled)) in scaled.enumerate() {
                *load = match Some(index % n) == mean {
                    true => *unscaled,
                    false => factor * unscaled,
                };
            }
            Ok(())
        };
        let mut branch = Branch::new(driven, scale, LevelParameter::Force);
        let (backbone, _) = branch.follow::<DynamicsError>(&targets, levels.count.is_none())?;
        Ok(backbone)
    }
}

/// Computes the phase resonance over a parameter, from its value `levels.from` to `levels.to`, up or down. `build`
/// builds the structure for a value.
///
/// The backbone begins at the first value of the parameter, with the strongest phase resonance in the frequency range.
/// The backbone stays on the branch of this phase resonance, as in [`Vibration::backbone`]. An error of `build` after
/// the first phase resonance ends the backbone and is returned with it.
///
/// # Errors
/// The errors of `build` before the first phase resonance. [`DynamicsError::OutOfRange`] for levels that form no range.
/// The error of [`HarmonicBalance::phase_resonance`] at the first value if no later value has a phase resonance either.
/// If the resonance ceases on the way, the backbone ends.
pub fn resonance_over_parameter<E: From<DynamicsError>>(
    levels: LoadLevels,
    mut build: impl FnMut(f64) -> Result<DrivenStructure, E>,
) -> Result<(Backbone, Option<E>), E> {
    let targets = levels.targets(LevelParameter::OtherParameter)?;
    let mut current_value = targets[0];
    let driven = build(current_value)?;
    // Building a structure can cost far more than the resonance of the structure. No structure is built twice in a row
    // for the same value.
    let set_level = |driven: &mut DrivenStructure, value: f64| {
        if value != current_value {
            *driven = build(value)?;
            current_value = value;
        }
        Ok(())
    };
    Branch::new(driven, set_level, LevelParameter::OtherParameter)
        .follow(&targets, levels.count.is_none())
}

impl LoadLevels {
    fn targets(&self, over: LevelParameter) -> Result<Vec<f64>, DynamicsError> {
        let LoadLevels { from, to, count } = *self;
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        for (name, value, expected, is_right) in [
            match over {
                LevelParameter::Force => (
                    "the least force of the backbone",
                    from,
                    "a positive finite number of newtons",
                    is_positive(from),
                ),
                LevelParameter::OtherParameter => (
                    "the first level of the backbone",
                    from,
                    "a positive finite number",
                    is_positive(from),
                ),
            },
            match over {
                LevelParameter::Force => (
                    "the largest force of the backbone",
                    to,
                    "a finite number of newtons above the least force",
                    to > from && to.is_finite(),
                ),
                LevelParameter::OtherParameter => (
                    "the last level of the backbone",
                    to,
                    "a positive finite number other than the first",
                    to != from && is_positive(to),
                ),
            },
            (
                "the number of levels of the backbone",
                count.unwrap_or(2) as f64,
                "2 or more",
                count.is_none_or(|count| count >= 2),
            ),
        ] {
            if !is_right {
                return Err(DynamicsError::OutOfRange {
                    name,
                    value,
                    expected,
                });
            }
        }
        let last = count.unwrap_or(2) - 1;
        let level = |k: usize| match k {
            0 => from,
            k if k == last => to,
            k => from * (to / from).powf(k as f64 / last as f64),
        };
        Ok((0..=last).map(level).collect())
    }
}
