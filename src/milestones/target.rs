//! Milestones, and the text that a user writes for a milestone.

use crate::units::{self, Dimension, UnitError};

/// Figure that has milestones.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Figure {
    Preload,
    Resonance,
    Kn,
    Kt,
    Depth,
    Depth99,
    Volume,
}

/// Target of a figure.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// The milestone is a value of the figure, in the SI unit of the figure.
    Value(f64),
    /// The milestone is a change of the figure since the unworn state, in the SI unit of the figure.
    Change(f64),
    /// Fraction of the unworn value.
    Part(f64),
    /// Change since the unworn state, as a fraction of the unworn value.
    PartChange(f64),
}

impl Target {
    /// Returns true if the target is relative to the unworn state.
    pub fn is_relative_to_unworn(self) -> bool {
        !matches!(self, Target::Value(_))
    }
}

/// Figure and its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Milestone {
    pub figure: Figure,
    pub target: Target,
    /// Text of the target, as the user wrote the text.
    pub text: String,
}

/// Errors of a milestone's text.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum MilestoneError {
    #[error("{0}; write {1}")]
    Unit(UnitError, &'static str),
    #[error(
        "the {figure} of an unworn joint is zero, so that \"{text}\" is not defined; write {example}"
    )]
    OfNothing {
        figure: &'static str,
        text: String,
        example: &'static str,
    },
    #[error("\"{text}\" does not say which stiffness: write {example}")]
    NoStiffness { text: String, example: &'static str },
    #[error("\"{text}\" is no change; write {example}")]
    NoChange { text: String, example: &'static str },
}

impl Figure {
    /// Returns the name for users.
    pub fn name(self) -> &'static str {
        match self {
            Figure::Preload => "preload",
            Figure::Resonance => "resonance",
            Figure::Kn => "stiffness kn",
            Figure::Kt => "stiffness kt",
            Figure::Depth => "largest depth",
            Figure::Depth99 => "depth of 1 %",
            Figure::Volume => "worn volume",
        }
    }

    /// Returns the column in `summary`.
    pub fn column(self) -> &'static str {
        match self {
            Figure::Preload => "normal_load",
            Figure::Resonance => "resonance_frequency",
            Figure::Kn => "kn",
            Figure::Kt => "kt",
            Figure::Depth => "largest_depth",
            Figure::Depth99 => "depth_99",
            Figure::Volume => "wear_volume",
        }
    }

    /// Returns the largest deviation from a cubic between the first two states, as a fraction of the change.
    /// Measured on random joints: the stiffness rises in steps of single cells, and fast at first; a volume
    /// hardly bends.
    pub(super) fn bend(self) -> f64 {
        match self {
            Figure::Resonance | Figure::Kn | Figure::Kt => 0.15,
            Figure::Preload | Figure::Depth | Figure::Depth99 => 0.05,
            Figure::Volume => 0.005,
        }
    }

    fn dimension(self) -> Dimension {
        match self {
            Figure::Preload => Dimension::FORCE,
            Figure::Resonance => Dimension::FREQUENCY,
            Figure::Kn | Figure::Kt => Dimension::STIFFNESS,
            Figure::Depth | Figure::Depth99 => Dimension::LENGTH,
            Figure::Volume => Dimension::VOLUME,
        }
    }

    fn example(self) -> &'static str {
        match self {
            Figure::Preload => "90%, -3kN or 27kN",
            Figure::Resonance => "+1Hz, -0.5% or 970Hz",
            Figure::Kn | Figure::Kt => "kn+10%, kt-5% or \"kn 250 N/um\"",
            Figure::Depth | Figure::Depth99 => "10um",
            Figure::Volume => "1mm3",
        }
    }

    /// Returns true if the value of the figure is zero for an unworn joint.
    fn is_zero_unworn(self) -> bool {
        matches!(self, Figure::Depth | Figure::Depth99 | Figure::Volume)
    }
}

impl Milestone {
    /// Parses the target of a figure. A text without a sign is a value (`27kN`) or a fraction of the unworn value
    /// (`90%`). A text with a sign is a change of the figure (`+1Hz`, `-5%`).
    ///
    /// # Errors
    /// Returns [`MilestoneError`].
    pub fn parse(figure: Figure, text: &str) -> Result<Milestone, MilestoneError> {
        let written = text.trim();
        // A minus sign may be typed as the character or as a hyphen.
        let value = written.replace('\u{2212}', "-");
        let (example, text) = (figure.example(), written.to_owned());
        let wrong = |error| MilestoneError::Unit(error, example);
        let has_sign = value.starts_with(['+', '-']);
        let no_change = || MilestoneError::NoChange {
            text: text.clone(),
            example,
        };
        let target = match value.strip_suffix('%') {
            Some(_) if figure.is_zero_unworn() => {
                let figure = figure.name();
                return Err(MilestoneError::OfNothing {
                    figure,
                    text,
                    example,
                });
            }
            Some(percent) => {
                let part = units::parse(percent, Dimension::NONE).map_err(wrong)? / 100.0;
                match has_sign {
                    true => Target::PartChange(part),
                    false => Target::Part(part),
                }
            }
            None => {
                let value = units::parse(&value, figure.dimension()).map_err(wrong)?;
                match has_sign {
                    true => Target::Change(value),
                    false => Target::Value(value),
                }
            }
        };
        match target {
            Target::Change(0.0) | Target::PartChange(0.0) | Target::Part(1.0) => Err(no_change()),
            Target::Value(value) if value <= 0.0 => Err(no_change()),
            Target::Change(change) if change < 0.0 && figure.is_zero_unworn() => Err(no_change()),
            _ => Ok(Milestone {
                figure,
                target,
                text,
            }),
        }
    }

    /// Parses a milestone of a stiffness, whose text begins with `kn` or `kt`.
    ///
    /// # Errors
    /// Returns [`MilestoneError`].
    pub fn parse_stiffness(text: &str) -> Result<Milestone, MilestoneError> {
        let written = text.trim();
        let named = |name: &str, figure| Some((figure, written.strip_prefix(name)?));
        let Some((figure, rest)) = named("kn", Figure::Kn).or_else(|| named("kt", Figure::Kt))
        else {
            return Err(MilestoneError::NoStiffness {
                text: written.to_owned(),
                example: Figure::Kn.example(),
            });
        };
        Milestone::parse(figure, rest.trim_start_matches([' ', '=']))
    }

    /// Returns the level of the figure at the milestone, in its SI unit. `unworn` is the value of the figure before
    /// wear.
    pub fn level(&self, unworn: f64) -> f64 {
        match self.target {
            Target::Value(value) => value,
            Target::Change(change) => unworn + change,
            Target::Part(part) => part * unworn,
            Target::PartChange(change) => (1.0 + change) * unworn,
        }
    }

    /// Returns the name and target of the milestone as text, without the cycles at which the joint reaches the
    /// milestone.
    pub fn words(&self) -> String {
        format!("{} {}", self.figure.name(), self.text)
    }
}
