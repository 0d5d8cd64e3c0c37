//! `fretwear trade`.

use std::path::Path;

use fretwear::rehearsal;
use fretwear::report::trade::{self, Trade, Trial};
use fretwear::scene::variants::{self, BALANCED, Choice, LeftOut, REFERENCE, Variant, Variants};
use fretwear::scene::{self, Plan, Scene};
use fretwear::stages::RunError;
use serde_json::{Value, json};

use super::arguments::TradeArguments;
use super::many;
use super::{CliError, Exit, report};
use crate::terminal::{Results, say};

/// A variant with what its run needs.
struct Job {
    variant: Variant,
    plan: Plan,
}

/// Runs the variants of a scene, each in its own folder, and compares them.
pub fn trade(arguments: &TradeArguments, out: &mut Results) -> Result<Exit, CliError> {
    let (path, sets) = (&arguments.scene.scene, &arguments.scene.sets);
    let written = scene::load(path, sets)?;
    let balanced = variants::load(path, sets, &variants::balanced())?;
    let recipe = Plan::of(&balanced)?.inputs.recipe;
    let choice = Choice {
        knobs: arguments.knobs.clone(),
        paper: arguments.paper,
        largest_grid: arguments.largest_grid,
    };
    let mut made = variants::variants(&written, &balanced, &recipe, &choice)?;
    let jobs = jobs(path, sets, &mut made)?;
    let folder = match &arguments.dir {
        Some(folder) => folder.clone(),
        None => Path::new("trade").join(&written.name),
    };
    let (trials, failure, stopped) = run_all(arguments, &jobs, &folder)?;
    let trade = trade::trade(&written.name, trials, made.base)?;
    let left_out: Vec<(String, String)> = made
        .left_out
        .into_iter()
        .map(|left| (left.what, left.reason))
        .collect();
    // Without the reference there are no errors to show.
    let has_reference = trade.row(REFERENCE).is_some();
    if has_reference {
        trade.write(&folder, &left_out)?;
    }
    if stopped {
        say(&format!(
            "stopped after {} of {} variants; the same command goes on",
            trade.rows.len(),
            jobs.len()
        ));
        return Ok(Exit::Stopped);
    }
    print(&written, &trade, &left_out, arguments.json, out)?;
    if !arguments.execution.quiet && has_reference {
        let page = folder.join("trade.html");
        say(&format!(
            "written: {}, and beside it trade.parquet, .svg and .md",
            page.display()
        ));
    }
    match failure {
        // Nothing can be said against a reference that failed.
        Some(error) => Err(error.into()),
        None => Ok(Exit::Done),
    }
}

fn plan(path: &Path, sets: &[String], variant: &Variant) -> Result<Plan, CliError> {
    Ok(Plan::of(&variants::load(path, sets, variant)?)?)
}

/// The variants that the scene allows; the others are left out.
fn jobs(path: &Path, sets: &[String], made: &mut Variants) -> Result<Vec<Job>, CliError> {
    let mut jobs: Vec<Job> = Vec::new();
    for variant in std::mem::take(&mut made.variants) {
        let what = format!("{} = {}", variant.knob, variant.value);
        match plan(path, sets, &variant) {
            Ok(plan) => {
                let known_by = |plan: &Plan| plan.inputs.identity.scene.clone();
                let same = |job: &&Job| known_by(&job.plan) == known_by(&plan);
                match jobs.iter().find(same) {
                    // A scene that says nothing but `preset = "fast"` is that preset.
                    Some(job) => made.left_out.push(LeftOut {
                        what,
                        reason: format!("it is the same as {}", job.variant.name),
                    }),
                    None => jobs.push(Job { variant, plan }),
                }
            }
            Err(error) if [BALANCED, REFERENCE].contains(&variant.name.as_str()) => {
                return Err(error);
            }
            Err(error) => made.left_out.push(LeftOut {
                what,
                reason: error.to_string(),
            }),
        }
    }
    Ok(jobs)
}

/// What was run, why the reference failed if it did, and whether it was asked to stop before the end.
fn run_all(
    arguments: &TradeArguments,
    jobs: &[Job],
    folder: &Path,
) -> Result<(Vec<Trial>, Option<RunError>, bool), CliError> {
    let runs: Vec<many::Job> = jobs
        .iter()
        .map(|Job { variant, plan }| many::Job {
            name: &variant.name,
            root: folder.join(&variant.name),
            inputs: &plan.inputs,
        })
        .collect();
    let ran = many::run_all(&arguments.execution, "variant", &runs)?;
    let mut reference = None;
    let mut trials = Vec::new();
    for ((job, run), failure) in jobs.iter().zip(&runs).zip(ran.ended) {
        // Runs share the structure.
        let (cold, cached) = rehearsal::memory(&job.plan.inputs);
        trials.push(Trial {
            variant: job.variant.clone(),
            root: run.root.clone(),
            memory: cached.unwrap_or(cold),
            failure: failure.as_ref().map(ToString::to_string),
        });
        if job.variant.name == REFERENCE {
            reference = failure;
        }
    }
    Ok((trials, reference, ran.stopped))
}

fn print(
    scene: &Scene,
    trade: &Trade,
    left_out: &[(String, String)],
    as_json: bool,
    out: &mut Results,
) -> Result<(), CliError> {
    let found = trade::findings(trade);
    if as_json {
        let left_out: Vec<Value> = left_out
            .iter()
            .map(|(what, reason)| json!({ "what": what, "reason": reason }))
            .collect();
        out.json(&json!({
            "scene": scene.name,
            "rows": report::rows(&trade.table()?),
            "findings": found,
            "left_out": left_out,
        }));
    } else {
        write!(out, "{}", trade::markdown(trade, &found, left_out));
    }
    Ok(())
}
