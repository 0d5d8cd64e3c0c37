//! `fretwear when`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use fretwear::milestones::{Crossing, Figure, History, Milestone, MilestoneError, Missing, States};
use fretwear::recipe::KeptPlan;
use fretwear::report::quantity::{self, Units};
use fretwear::report::{continuation, told};
use fretwear::stages::RunStatus;
use fretwear::store::{RealFileSystem, RunReader};
use serde_json::{Value, json};

use super::figures::in_unit;
use super::{CliError, Exit};
use crate::progress::grouped;
use crate::terminal::Results;

#[derive(Args)]
#[command(
    override_usage = "fretwear when [OPTIONS] <RUN> <MILESTONE>...",
    group = clap::ArgGroup::new("milestones").required(true).multiple(true)
)]
pub struct WhenArguments {
    /// Folder of the run
    run: PathBuf,
    /// Load that is left: 90%, -3kN, 27kN
    #[arg(long, value_name = "LOAD", group = "milestones", allow_hyphen_values = true,
        value_parser = |text: &str| Milestone::parse(Figure::Preload, text))]
    preload: Vec<Milestone>,
    /// Resonance: +1Hz, -0.5%, 970Hz
    #[arg(long, value_name = "FREQUENCY", group = "milestones", allow_hyphen_values = true,
        value_parser = |text: &str| Milestone::parse(Figure::Resonance, text))]
    resonance: Vec<Milestone>,
    /// Stiffness of the contact: kn+10%, kt-5%, "kn 250 N/um"
    #[arg(long, value_name = "STIFFNESS", group = "milestones", value_parser = Milestone::parse_stiffness)]
    stiffness: Vec<Milestone>,
    /// Largest depth of both faces together: 10um
    #[arg(long, value_name = "DEPTH", group = "milestones",
        value_parser = |text: &str| Milestone::parse(Figure::Depth, text))]
    depth: Vec<Milestone>,
    /// Depth that a hundredth of the cells exceed: 10um
    #[arg(long, value_name = "DEPTH", group = "milestones",
        value_parser = |text: &str| Milestone::parse(Figure::Depth99, text))]
    depth_99: Vec<Milestone>,
    /// Worn volume: 1mm3
    #[arg(long, value_name = "VOLUME", group = "milestones",
        value_parser = |text: &str| Milestone::parse(Figure::Volume, text))]
    volume: Vec<Milestone>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What a preload does not count.
pub const OF_THIS_JOINT: &str = "the load is lost by wear of this joint alone; embedding under head, nut and thread, and the scatter of tightening, are in no bar";

/// A milestone, and what a run says of it.
struct Answer<'a> {
    milestone: &'a Milestone,
    history: History,
    level: f64,
    crossing: Crossing,
}

/// Prints when a run reaches milestones, each between an earliest and a latest number of cycles.
pub fn when(arguments: &WhenArguments, out: &mut Results) -> Result<Exit, CliError> {
    let root = &arguments.run;
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let recipe = reader.plan(KeptPlan::of)?.recipe;
    if recipe.wear.is_none() {
        return Err(CliError::NothingWears { path: root.clone() });
    }
    let standing = RunStatus::of(&reader, &recipe)?;
    let states = States::of(&reader)?;
    let answers = arguments
        .milestones()
        .map(|milestone| answer(root, milestone, &states));
    let answers: Vec<Answer> = answers.collect::<Result<_, CliError>>()?;
    if arguments.json {
        out.json(&json!({
            "run": root,
            "cycles": states.cycles(),
            "done": standing.done,
            "part_done": standing.part,
            "milestones": answers.iter().map(Answer::json).collect::<Vec<Value>>(),
        }));
    } else {
        let cycles = grouped(states.cycles().unwrap_or(0));
        let far = match standing.done {
            true => String::new(),
            false => format!(", {:.0} % done", 100.0 * standing.part),
        };
        writeln!(out, "{}: {cycles} cycles{far}", root.display());
        for answer in &answers {
            out.item(&answer.milestone.words(), &answer.words());
        }
        if !arguments.preload.is_empty() {
            out.beside("", OF_THIS_JOINT);
        }
        if !standing.done && reader.holder()?.is_none() {
            writeln!(out, "  {:<24} {}", "continue", continuation(root));
        }
    }
    Ok(match standing.done {
        true => Exit::Done,
        false => Exit::Stopped,
    })
}

impl WhenArguments {
    fn milestones(&self) -> impl Iterator<Item = &Milestone> {
        let of_load = self.preload.iter().chain(&self.resonance);
        let of_wear = self.depth.iter().chain(&self.depth_99).chain(&self.volume);
        of_load.chain(&self.stiffness).chain(of_wear)
    }
}

fn answer<'a>(
    root: &Path,
    milestone: &'a Milestone,
    states: &States,
) -> Result<Answer<'a>, CliError> {
    let history = states.history(milestone.figure).map_err(|missing| {
        let figure = milestone.figure;
        let reason = match (missing, figure) {
            (Missing::LoadStays, _) => {
                "its load stays: give contact.bolt_stiffness or contact.preload.in_mesh"
            }
            (_, Figure::Kn | Figure::Kt) => {
                "its scene has output.stiffness = false, or no rough contact"
            }
            (_, Figure::Resonance) => "its scene has no vibration, or a given frequency",
            _ => "it has no state yet",
        };
        CliError::NoMilestone {
            path: root.to_owned(),
            figure: figure.name(),
            reason,
        }
    })?;
    let level = milestone.level(history.values[0]);
    let crossing = history.crossing(level).ok_or_else(|| {
        let error = MilestoneError::NoChange {
            text: milestone.text.clone(),
            example: "another value: the joint had this one unworn",
        };
        CliError::Milestone(error)
    })?;
    Ok(Answer {
        milestone,
        history,
        level,
        crossing,
    })
}

/// What is known of a milestone.
#[derive(Clone, Copy, PartialEq)]
enum Known {
    /// It is passed.
    Reached,
    /// It may be passed.
    Perhaps,
    /// The bar is larger than the change.
    Unknown,
    /// It is not passed.
    NotWithin,
}

impl Answer<'_> {
    fn known(&self) -> Known {
        match self.crossing {
            Crossing { earliest: None, .. } => Known::NotWithin,
            Crossing {
                latest: Some(_), ..
            } => Known::Reached,
            Crossing { is_known: true, .. } => Known::Perhaps,
            _ => Known::Unknown,
        }
    }

    /// The last value and its bar, in its unit.
    fn now(&self) -> (f64, f64) {
        let last = self.history.values.len() - 1;
        (self.history.values[last], self.history.bars[last])
    }

    fn words(&self) -> String {
        let Crossing {
            earliest,
            nominal,
            latest,
            returns,
            ..
        } = self.crossing;
        let end = cycles(self.history.end());
        let at = |found: Option<f64>| found.map_or(format!("beyond {end}"), cycles);
        let between = format!("earliest {}, latest {}", at(earliest), at(latest));
        let mut words = match (self.known(), nominal) {
            (Known::NotWithin, _) => format!("not within {end} cycles: {}", self.by_then()),
            (Known::Unknown, _) => format!(
                "not known: the bar is larger than the change within {end} cycles, {}",
                self.by_then()
            ),
            (_, Some(nominal)) => format!("{} cycles ({between})", cycles(nominal)),
            (_, None) => format!(
                "perhaps within {end} cycles ({between}): {}",
                self.by_then()
            ),
        };
        if let Some(back) = returns {
            words += &format!("; it is back at {} cycles", cycles(back));
        }
        words
    }

    /// Where the figure has come to.
    fn by_then(&self) -> String {
        let (value, bar) = self.now();
        let first = self.history.values[0];
        let unit = quantity::unit_of(units_of(self.milestone.figure), value.abs().max(first));
        match first == 0.0 {
            true => told(value, bar / value, 0.0, |value| in_unit(value, unit)),
            false => format!(
                "{} became {}, ± {}",
                in_unit(first, unit),
                in_unit(value, unit),
                in_unit(bar, unit)
            ),
        }
    }

    fn json(&self) -> Value {
        let (value, bar) = self.now();
        let known = match self.known() {
            Known::Reached => "reached",
            Known::Perhaps => "perhaps",
            Known::Unknown => "not known",
            Known::NotWithin => "not within",
        };
        json!({
            "figure": self.milestone.figure.column(),
            "milestone": self.milestone.text,
            "level": self.level,
            "known": known,
            "earliest": self.crossing.earliest,
            "nominal": self.crossing.nominal,
            "latest": self.crossing.latest,
            "returns": self.crossing.returns,
            "beyond": self.history.end(),
            "unworn": self.history.values[0],
            "last": value,
            "last_bar": bar,
        })
    }
}

fn units_of(figure: Figure) -> Units {
    match figure {
        Figure::Preload => quantity::FORCE,
        Figure::Resonance => quantity::FREQUENCY,
        Figure::Kn | Figure::Kt => quantity::STIFFNESS,
        Figure::Depth | Figure::Depth99 => quantity::LENGTH,
        Figure::Volume => quantity::VOLUME,
    }
}

/// Cycles with as many digits as a bar leaves of them.
fn cycles(cycles: f64) -> String {
    const DIGITS: i32 = 4;
    let exponent = cycles.max(1.0).log10().floor() as i32;
    let step = 10f64.powi((exponent - DIGITS + 1).max(0));
    grouped(((cycles / step).round() * step) as u64)
}
