//! `fretwear when`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use fretwear::campaign::survival::Quantile;
use fretwear::campaign::{self, Lifetimes, State};
use fretwear::milestones::{Crossing, Figure, History, Milestone, MilestoneError, Missing, States};
use fretwear::recipe::StoredPlan;
use fretwear::report::quantity::{self, Units};
use fretwear::report::{continue_command, figure_with_bar, one_line_name, shell_word};
use fretwear::stages::RunStatus;
use fretwear::store::{RealFileSystem, RunReader};
use serde_json::{Value, json};

use super::figures::format_with_unit;
use super::{CliError, Exit};
use crate::progress::grouped;
use crate::terminal::{Results, say};

#[derive(Args)]
#[command(
    override_usage = "fretwear when [OPTIONS] <RUN> <MILESTONE>...",
    group = clap::ArgGroup::new("milestones").required(true).multiple(true)
)]
pub struct WhenArguments {
    /// Folder of the run, or of a campaign
    run: PathBuf,
    /// Remaining load: 90%, -3kN, 27kN
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
    #[arg(long, value_name = "DEPTH", group = "milestones", allow_hyphen_values = true,
        value_parser = |text: &str| Milestone::parse(Figure::Depth, text))]
    depth: Vec<Milestone>,
    /// Depth that 1 % of the cells exceed: 10um
    #[arg(long, value_name = "DEPTH", group = "milestones", allow_hyphen_values = true,
        value_parser = |text: &str| Milestone::parse(Figure::Depth99, text))]
    depth_99: Vec<Milestone>,
    /// Worn volume: 1mm3
    #[arg(long, value_name = "VOLUME", group = "milestones", allow_hyphen_values = true,
        value_parser = |text: &str| Milestone::parse(Figure::Volume, text))]
    volume: Vec<Milestone>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Note on the effects that the lost preload does not include.
pub const PRELOAD_NOTE: &str = "only the wear of this joint reduces the load here; the bars exclude embedding under head, nut and thread, and the scatter of tightening";

/// Milestone, and the crossing of the milestone in the history of a run.
struct Answer<'a> {
    milestone: &'a Milestone,
    history: History,
    level: f64,
    crossing: Crossing,
}

/// Prints after how many cycles a run reaches milestones, each with its earliest and its latest number of cycles.
pub fn when(arguments: &WhenArguments, out: &mut Results) -> Result<Exit, CliError> {
    let root = &arguments.run;
    if root.join("campaign.json").is_file() {
        return when_campaign(arguments, out);
    }
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let recipe = reader.plan(StoredPlan::of)?.recipe;
    if recipe.wear.is_none() {
        return Err(CliError::NothingWears { path: root.clone() });
    }
    let standing = RunStatus::of(&reader, &recipe)?;
    let states = States::read(&reader)?;
    if states.is_empty() {
        say(&format!("{}: no state is committed yet", root.display()));
        return Ok(Exit::Stopped);
    }
    let load = recipe
        .contact()
        .map(|contact| contact.conditions.normal_load);
    let answers = arguments
        .milestones()
        .map(|milestone| answer(root, milestone, &states, load));
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
        let progress = match standing.done {
            true => String::new(),
            false => format!(", {:.0} % done", 100.0 * standing.part),
        };
        writeln!(out, "{}: {cycles} cycles{progress}", root.display());
        for answer in &answers {
            out.item(&answer.milestone.words(), &answer.words());
        }
        if !arguments.preload.is_empty() {
            out.aligned("", PRELOAD_NOTE);
        }
        if !standing.done && reader.holder()?.is_none() {
            writeln!(out, "  {:<24} {}", "continue", continue_command(root));
        }
    }
    Ok(match standing.done {
        true => Exit::Done,
        false => Exit::Stopped,
    })
}

/// Prints after how many cycles the runs of a campaign reach milestones.
fn when_campaign(arguments: &WhenArguments, out: &mut Results) -> Result<Exit, CliError> {
    let folder = campaign::CampaignFolder::at(Arc::new(RealFileSystem), &arguments.run);
    let (about, campaign) = folder.open()?;
    let histories = campaign::Histories::of(&folder, &campaign)?;
    if histories.is_empty() {
        say(&format!(
            "{}: no run is collected yet; run `fretwear campaign collect` when some runs are complete",
            arguments.run.display()
        ));
        return Ok(Exit::Stopped);
    }
    let states = folder.states(campaign.rows.len())?;
    let count = |state: State| {
        states
            .iter()
            .filter(|state_of_row| **state_of_row == state)
            .count()
    };
    let (failed, open) = (
        count(State::Failed),
        count(State::Waiting) + count(State::Incomplete),
    );
    let mut lifetimes = Vec::new();
    for milestone in arguments.milestones() {
        if !histories.has(milestone.figure) {
            return Err(CliError::NoMilestone {
                path: arguments.run.clone(),
                figure: milestone.figure.name(),
                reason: "no collected run has it; run `fretwear campaign collect` to add completed runs",
            });
        }
        lifetimes.push((milestone, histories.lifetimes(&about, &campaign, milestone)));
    }
    if arguments.json {
        let milestones = lifetimes.iter().map(|(milestone, points)| {
            json!({
                "figure": milestone.figure.column(),
                "milestone": milestone.text,
                "points": points.iter().map(lifetimes_json).collect::<Vec<Value>>(),
            })
        });
        out.json(&json!({
            "campaign": arguments.run,
            "rows": campaign.rows.len(),
            "runs": histories.len(),
            "failed": failed,
            "open": open,
            "uncollected": histories.uncollected,
            "without_a_state": histories.without_state,
            "milestones": milestones.collect::<Vec<Value>>(),
        }));
    } else {
        let title = one_line_name(&about.title);
        let runs = histories.len();
        writeln!(
            out,
            "{}: {title}, {runs} runs of {} rows, {failed} failed, {open} not done",
            arguments.run.display(),
            campaign.rows.len()
        );
        for (milestone, points) in &lifetimes {
            writeln!(out, "  {}", milestone.words());
            points.iter().for_each(|point| write_point(point, out));
        }
        if !arguments.preload.is_empty() {
            out.aligned("", PRELOAD_NOTE);
        }
        if !histories.uncollected.is_empty() {
            let rows = histories.uncollected.len();
            out.aligned("note: ", &format!("{rows} completed rows are not collected and do not count: run `fretwear campaign collect --dir {}`", shell_word(&arguments.run)));
        }
        if !histories.without_state.is_empty() {
            let rows = histories.without_state.len();
            out.aligned(
                "note: ",
                &format!(
                    "{rows} rows failed or were stopped before their first state, and do not count"
                ),
            );
        }
    }
    Ok(match open + histories.uncollected.len() {
        0 => Exit::Done,
        _ => Exit::Stopped,
    })
}

fn lifetimes_json(point: &Lifetimes) -> Value {
    let quantiles = |quantile_list: &[Quantile]| -> Vec<Value> {
        let objects = quantile_list.iter().map(
            |q| json!({ "part": q.probability, "cycles": q.cycles, "low": q.low, "high": q.high }),
        );
        objects.collect()
    };
    let keys = point
        .keys
        .iter()
        .map(|(key, value)| (key.clone(), json!(value)));
    json!({
        "point": keys.collect::<serde_json::Map<String, Value>>(),
        "runs": point.runs,
        "passed": point.passed,
        "end": point.end,
        "within": { "latest": point.share_within[0], "nominal": point.share_within[1], "earliest": point.share_within[2] },
        "earliest": quantiles(&point.earliest),
        "latest": quantiles(&point.latest),
    })
}

/// Prints the share of runs that pass and the quantiles, at a point of the grid and the list.
fn write_point(point: &Lifetimes, out: &mut Results) {
    let keys: Vec<String> = point
        .keys
        .iter()
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    if !keys.is_empty() {
        writeln!(out, "    {}", keys.join(", "));
    }
    let [late, nominal, early] = point
        .share_within
        .map(|part| format!("{:.0} %", 100.0 * part));
    let end = grouped(point.end as u64);
    let (runs, not_passed) = (point.runs, point.runs - point.passed);
    writeln!(
        out,
        "    {nominal} of {runs} runs pass within {end} cycles ({late} at the late ends of the bars, {early} at the early ends); {not_passed} ended without passing"
    );
    writeln!(
        out,
        "    the brackets are 95 % confidence bounds of the quantile, as far as the draws determine them"
    );
    writeln!(out, "    {:>8}  {:<44} latest", "part", "earliest");
    for (earliest, latest) in point.earliest.iter().zip(&point.latest) {
        let quantile_text = |quantile: &Quantile| {
            let cycles_or_beyond =
                |value: Option<f64>| value.map_or(format!("beyond {end}"), cycles);
            match (quantile.cycles, quantile.low) {
                (None, None) => format!("beyond {end}"),
                _ => format!(
                    "{} ({} to {})",
                    cycles_or_beyond(quantile.cycles),
                    cycles_or_beyond(quantile.low),
                    cycles_or_beyond(quantile.high)
                ),
            }
        };
        writeln!(
            out,
            "    {:>6.0} %  {:<44} {}",
            100.0 * earliest.probability,
            quantile_text(earliest),
            quantile_text(latest)
        );
    }
}

impl WhenArguments {
    fn milestones(&self) -> impl Iterator<Item = &Milestone> {
        let load_milestones = self.preload.iter().chain(&self.resonance);
        let wear_milestones = self.depth.iter().chain(&self.depth_99).chain(&self.volume);
        load_milestones
            .chain(&self.stiffness)
            .chain(wear_milestones)
    }
}

fn answer<'a>(
    root: &Path,
    milestone: &'a Milestone,
    states: &States,
    load: Option<f64>,
) -> Result<Answer<'a>, CliError> {
    let history = states.history(milestone.figure).map_err(|missing| {
        let figure = milestone.figure;
        let reason = match (missing, figure) {
            (Missing::LoadStays, _) => {
                "its load is constant: give contact.bolt_stiffness, contact.bolt or contact.preload.in_mesh"
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
    let first = history.values[0];
    let unworn = match (states.begins_worn, milestone.figure, load) {
        (false, ..) => first,
        (true, Figure::Preload, Some(load)) => load,
        (true, ..) if milestone.target.is_relative_to_unworn() => {
            return Err(CliError::NoMilestone {
                path: root.to_owned(),
                figure: milestone.figure.name(),
                reason: "it continues a run of another scene with another unworn joint; give an absolute value",
            });
        }
        (true, ..) => first,
    };
    let level = milestone.level(unworn);
    if level <= 0.0 {
        let error = MilestoneError::NoChange {
            text: milestone.text.clone(),
            example: "another value: this one is below zero",
        };
        return Err(CliError::Milestone(error));
    }
    let is_passed = (level - unworn) * (level - first) <= 0.0 && unworn != first;
    let crossing = is_passed.then(|| history.crossed_before_start());
    let crossing = crossing
        .or_else(|| history.crossing(level))
        .ok_or_else(|| {
            let error = MilestoneError::NoChange {
                text: milestone.text.clone(),
                example: "another value: the unworn joint already has this one",
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

/// Certainty that a milestone is reached.
#[derive(Clone, Copy, PartialEq)]
enum Certainty {
    /// The milestone is passed.
    Reached,
    /// The milestone may be passed.
    Perhaps,
    /// Unknown: the error bar is larger than the change.
    Unknown,
    /// The milestone is not passed.
    NotWithin,
}

impl Answer<'_> {
    fn certainty(&self) -> Certainty {
        match self.crossing {
            Crossing { earliest: None, .. } => Certainty::NotWithin,
            Crossing {
                latest: Some(_), ..
            } => Certainty::Reached,
            Crossing { is_known: true, .. } => Certainty::Perhaps,
            _ => Certainty::Unknown,
        }
    }

    /// Returns the last value of the figure and the absolute error bar of the value, in SI units.
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
        let end = grouped(self.history.end() as u64);
        let cycles_or_beyond = |value: Option<f64>| value.map_or(format!("beyond {end}"), cycles);
        let between = format!(
            "earliest {}, latest {}",
            cycles_or_beyond(earliest),
            cycles_or_beyond(latest)
        );
        let mut words = match (self.certainty(), nominal) {
            (Certainty::NotWithin, _) => {
                format!("not within {end} cycles: {}", self.last_value_text())
            }
            (Certainty::Unknown, _) => format!(
                "not known: the bar is larger than the change within {end} cycles, {}",
                self.last_value_text()
            ),
            (_, Some(nominal)) => format!("{} cycles ({between})", cycles(nominal)),
            (_, None) => format!(
                "perhaps within {end} cycles ({between}): {}",
                self.last_value_text()
            ),
        };
        if let Some(back) = returns {
            words += &format!("; it returns at {} cycles", cycles(back));
        }
        words
    }

    /// Describes the last value of the figure.
    fn last_value_text(&self) -> String {
        let (value, bar) = self.now();
        let first = self.history.values[0];
        let unit = quantity::unit_of(units_of(self.milestone.figure), value.abs().max(first));
        match first == 0.0 {
            true => figure_with_bar(value, bar / value, 0.0, |value| {
                format_with_unit(value, unit)
            }),
            false => format!(
                "{} became {}, ± {}",
                format_with_unit(first, unit),
                format_with_unit(value, unit),
                format_with_unit(bar, unit)
            ),
        }
    }

    fn json(&self) -> Value {
        let (value, bar) = self.now();
        let certainty = match self.certainty() {
            Certainty::Reached => "reached",
            Certainty::Perhaps => "perhaps",
            Certainty::Unknown => "not known",
            Certainty::NotWithin => "not within",
        };
        json!({
            "figure": self.milestone.figure.column(),
            "milestone": self.milestone.text,
            "level": self.level,
            "known": certainty,
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

/// Formats cycles with four significant digits.
fn cycles(cycles: f64) -> String {
    const DIGITS: i32 = 4;
    let exponent = cycles.max(1.0).log10().floor() as i32;
    let step = 10f64.powi((exponent - DIGITS + 1).max(0));
    grouped(((cycles / step).round() * step) as u64)
}
