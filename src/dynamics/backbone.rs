//! Backbone of a resonance: frequency, damping ratio and amplitude of the phase resonance over the level of the force, or over another
//! parameter.
//!
//! The damping ratio is one of energy: ζ = E_d / (4π T), with the energy E_d that friction and damping take from the structure in a
//! cycle, in all harmonics, and the peak kinetic energy T = ½ ω² q̂ᴴ M q̂ of the fundamental q̂ of all coordinates. At the phase
//! resonance of a linear oscillator E_d = π c ω U² and T = ½ m ω² U², so that ζ = c / 2mω to rounding. For a motion in one mode it is
//! the modal damping ratio of the extended periodic motion concept (M. Krack, Computers & Structures 154, 2015, 59), whose
//! fundamental dissipates 2π ζ ω² a² at the modal amplitude a = √(q̂ᴴ M q̂).

use super::branch::{Branch, LevelParameter};
use super::contact_element::ContactElement;
use super::{DynamicsError, Energy, HarmonicBalance, Vibration};
use crate::linalg::RowMatrix as Matrix;

/// Levels at which the backbone is wanted: half ranges of the drive \[N\], or values of another parameter, in whatever unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadLevels {
    /// That to begin at, above 0.
    pub from: f64,
    /// That to end at; above the first where it is a force, another one where it is another parameter.
    pub to: f64,
    /// Levels between them, both ends included, of equal ratio; none: as many as the curve needs to be drawn with lines.
    pub count: Option<usize>,
}

/// One phase resonance of a backbone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BackbonePoint {
    /// Counted from 0, one more after each level at which the amplitude leaps.
    pub branch: usize,
    /// The level, as in [`LoadLevels`].
    pub level: f64,
    /// Half range of the drive \[N\].
    pub force: f64,
    /// Frequency \[Hz\].
    pub frequency: f64,
    /// Damping ratio: what is dissipated over 4π times `kinetic_energy`.
    pub damping_ratio: f64,
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Peak kinetic energy of the first harmonic: that of all coordinates, twice its mean over the cycle \[J\].
    pub kinetic_energy: f64,
    /// Energy per cycle, in all harmonics.
    pub energy: Energy,
    /// Contact elements that slide somewhere in the cycle, and do not open.
    pub sliding: usize,
    /// Contact elements that open somewhere in the cycle.
    pub open: usize,
    /// All contact elements.
    pub elements: usize,
}

impl BackbonePoint {
    /// Share of the contact elements that slide; 0 without elements.
    pub fn sliding_fraction(&self) -> f64 {
        self.share(self.sliding)
    }

    /// Share of the contact elements that open; 0 without elements.
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

/// Where a backbone ends.
#[derive(Debug, Clone, PartialEq)]
pub enum BackboneEnd {
    /// At the last level.
    Reached,
    /// Below the last level: friction at its limit takes no more energy, and nothing else bounds the amplitude.
    Unbounded {
        /// The level at which there is no phase resonance any more.
        level: f64,
        /// Growth of the amplitude over that of the level before it, both as logarithms.
        growth: f64,
    },
    /// Before the last level, for another reason.
    Ceased {
        /// The level at which no phase resonance was found.
        level: f64,
        /// What the solver says.
        source: DynamicsError,
    },
    /// Before the last level: the next phase resonance is that of another mode.
    OtherMode {
        /// The level at which it is found.
        level: f64,
    },
    /// Before the last level: there is no structure of the next one.
    Broken {
        /// The level at which it was wanted.
        level: f64,
    },
}

/// Phase resonances over the level.
#[derive(Debug, Clone, PartialEq)]
pub struct Backbone {
    /// In the order of the levels.
    pub points: Vec<BackbonePoint>,
    /// Why there is none at the first level, where the backbone begins behind it.
    pub begin: Option<DynamicsError>,
    /// Levels at which the branch folds back: beyond each the amplitude leaps to another branch.
    pub folds: Vec<f64>,
    /// Where and why it ends.
    pub end: BackboneEnd,
    /// Phase resonances that were solved for, those included that are no point.
    pub solves: usize,
    /// Newton iterations of them.
    pub iterations: usize,
}

/// A driven structure whose phase resonance is wanted.
pub struct DrivenStructure {
    /// Its balance.
    pub balance: HarmonicBalance<ContactElement>,
    /// Mass matrix of the reduced structure.
    pub(super) mass: Matrix,
    /// Range of the resonance \[Hz\].
    pub(super) range: (f64, f64),
    /// Port of the response.
    pub(super) response_port: usize,
}

impl DrivenStructure {
    /// Half range of the drive \[N\]; 0 without one.
    pub(super) fn drive(&self) -> f64 {
        let drive = self.balance.drive();
        drive.map_or(0.0, |load| load.cosine.hypot(load.sine))
    }
}

impl Vibration {
    /// This vibration by a balance of it.
    pub fn with_balance(&self, balance: HarmonicBalance<ContactElement>) -> DrivenStructure {
        DrivenStructure {
            balance,
            mass: self.model.mass.clone(),
            range: self.range,
            response_port: self.response_port,
        }
    }

    /// The backbone of the phase resonance of `balance`, upwards from the least level. The level scales all loads but constant ones. It
    /// begins with the strongest phase resonance of the least level in the range of the vibration and stays on its branch; where the
    /// amplitude leaps at a force, and the frequency hardly, it goes on behind the leap as another branch.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] for levels that are no range, or a balance without a drive; that of
    /// [`HarmonicBalance::phase_resonance`] at the least level if there is none at a higher one either. Where the resonance ceases on the
    /// way up, the backbone ends.
    pub fn backbone(
        &self,
        balance: HarmonicBalance<ContactElement>,
        levels: LoadLevels,
    ) -> Result<Backbone, DynamicsError> {
        let targets = levels.targets(LevelParameter::Force)?;
        let rows = balance.load_rows.clone();
        let mean = balance.harmonics().slot_of(0);
        let n = balance.harmonics().coefficients();
        let driven = self.with_balance(balance);
        let drive = driven.drive();
        // All loads but the constant ones are scaled.
        let scale = |driven: &mut DrivenStructure, force: f64| {
            let factor = force / drive;
            let scaled = driven.balance.load_rows.iter_mut().zip(&rows);
            for (index, (load, given)) in scaled.enumerate() {
                *load = match Some(index % n) == mean {
                    true => *given,
                    false => factor * given,
                };
            }
            Ok(())
        };
        let mut branch = Branch::new(driven, scale, LevelParameter::Force);
        let (backbone, _) = branch.along::<DynamicsError>(&targets, levels.count.is_none())?;
        Ok(backbone)
    }
}

/// The phase resonance over a parameter, from its value `levels.from` to that of `levels.to`, up or down; `at` makes the structure of a
/// value. It begins with the strongest phase resonance of the first value in its range and stays on its branch, as [`Vibration::backbone`].
/// An error of `at` behind the first phase resonance ends the backbone and stands beside it.
///
/// # Errors
/// Those of `at` before the first phase resonance; [`DynamicsError::OutOfRange`] for levels that are no range; that of
/// [`HarmonicBalance::phase_resonance`] at the first value if there is none at a later one either. Where the resonance ceases on the way, the backbone ends.
pub fn resonance_over<E: From<DynamicsError>>(
    levels: LoadLevels,
    mut at: impl FnMut(f64) -> Result<DrivenStructure, E>,
) -> Result<(Backbone, Option<E>), E> {
    let targets = levels.targets(LevelParameter::Parameter)?;
    let mut now = targets[0];
    let driven = at(now)?;
    // What leads to a resonance may cost far more than the resonance: no value is made twice in a row.
    let make = |driven: &mut DrivenStructure, value: f64| {
        if value != now {
            *driven = at(value)?;
            now = value;
        }
        Ok(())
    };
    Branch::new(driven, make, LevelParameter::Parameter).along(&targets, levels.count.is_none())
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
                LevelParameter::Parameter => (
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
                LevelParameter::Parameter => (
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
