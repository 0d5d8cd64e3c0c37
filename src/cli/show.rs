//! The commands `plan` and `verify`, which do not change a run.

use std::path::Path;
use std::sync::Arc;

use fretwear::rehearsal;
use fretwear::scene::{self, Plan};
use fretwear::stages::{self, ReducedTables};
use fretwear::store::{RealFileSystem, RunReader};
use serde_json::json;

use super::{CliError, Exit, cost, resonances};
use crate::progress::lines_of;
use crate::terminal::Results;

/// Prints the plan of a scene, and its expected cost if `rehearse` is true.
pub fn plan(
    path: &Path,
    sets: &[String],
    rehearse: bool,
    as_json: bool,
    out: &mut Results,
) -> Result<Exit, CliError> {
    let scene = scene::load(path, sets)?;
    let mut plan = Plan::of(&scene)?;
    plan.warnings.extend(cost::memory_warning(&plan.inputs));
    let mut printed =
        json!({ "recipe": plan.inputs.recipe, "decisions": plan.decisions, "checks": plan.checks });
    let (mut rehearsal, mut resonance_results) = (None, None);
    if as_json {
        if rehearse {
            let estimate = rehearsal::rehearse(&plan.inputs, rehearsal::TIME_LIMIT);
            add_warnings_once(&mut plan.warnings, estimate.warnings);
            printed["cost"] = json!(estimate.cost);
            // Times depend on the machine; all other values depend only on the scene.
            printed["seconds"] =
                json!({ "run": estimate.seconds, "rehearsal": estimate.seconds_taken });
            if let Some(resonances) = resonances::resonances(&plan.inputs, path, true) {
                printed["resonances"] = resonances::json(&resonances);
            }
        }
        printed["warnings"] = json!(plan.warnings);
        printed["notices"] = json!(plan.notices().collect::<Vec<String>>());
        out.json(&printed);
        return Ok(Exit::Done);
    }
    if let Some(title) = &scene.recipe.title {
        writeln!(out, "{title}\n");
    }
    for decision in &plan.decisions {
        writeln!(out, "{}: {}", decision.what, decision.choice);
        writeln!(out, "    {}", decision.why);
    }
    if rehearse {
        let estimate = rehearsal::rehearse(&plan.inputs, rehearsal::TIME_LIMIT);
        add_warnings_once(&mut plan.warnings, estimate.warnings.clone());
        rehearsal = Some(estimate);
        resonance_results = resonances::resonances(&plan.inputs, path, false);
    }
    writeln!(out);
    for line in lines_of(&plan.checks) {
        writeln!(out, "{line}");
    }
    for notice in plan.notices() {
        writeln!(out, "note: {notice}");
    }
    for warning in &plan.warnings {
        writeln!(out, "\nwarning: {warning}");
    }
    if let Some(resonances) = &resonance_results {
        resonances::write(out, &plan.inputs.recipe, resonances);
    }
    if let Some(rehearsal) = &rehearsal {
        writeln!(out, "\nexpected cost");
        cost::write_expected(out, rehearsal);
    }
    Ok(Exit::Done)
}

/// Prints the stages of a scene and the tables between them.
pub fn graph(path: &Path, sets: &[String], out: &mut Results) -> Result<Exit, CliError> {
    let scene = scene::load(path, sets)?;
    let recipe = Plan::of(&scene)?.inputs.recipe;
    write!(out, "{}", stages::graph(&recipe));
    Ok(Exit::Done)
}

/// Adds warnings of the rehearsal, except a second warning on the depth step.
fn add_warnings_once(warnings: &mut Vec<String>, new_warnings: Vec<String>) {
    const OF_STEP: &str = "wear.depth_step = ";
    let has_step_warning = warnings.iter().any(|warning| warning.starts_with(OF_STEP));
    warnings.extend(
        new_warnings
            .into_iter()
            .filter(|warning| !(has_step_warning && warning.starts_with(OF_STEP))),
    );
}

/// Prints the state of every file of a run.
pub fn verify(root: &Path, out: &mut Results) -> Result<Exit, CliError> {
    let run = RunReader::open(Arc::new(RealFileSystem), root)?;
    let mut report = run.verify()?;
    if report.once.iter().all(|once| once.damage.is_none()) {
        report.metadata.extend(ReducedTables::damage(&run)?);
    }
    for commit in &report.commits {
        let damage: Vec<String> = commit
            .damage
            .iter()
            .chain(&commit.unchained_damage)
            .map(ToString::to_string)
            .collect();
        let state = if damage.is_empty() {
            "ok".to_owned()
        } else {
            damage.join("; ")
        };
        writeln!(out, "iteration {}: {state}", commit.wear_iteration);
    }
    for damage in &report.metadata {
        writeln!(out, "{damage}");
    }
    if report.metadata.is_empty() {
        writeln!(out, "run.json and the other files outside tables: ok");
    }
    for once in &report.once {
        let state = once
            .damage
            .as_ref()
            .map_or("ok".to_owned(), ToString::to_string);
        writeln!(out, "once/{}: {state}", once.table);
    }
    if !report.pruned.is_empty() {
        writeln!(
            out,
            "pruned by output.keep: {} iterations",
            report.pruned.len()
        );
    }
    let damaged = report.damage().count();
    if damaged == 0 {
        writeln!(out, "all {} iterations verify", report.commits.len());
        return Ok(Exit::Done);
    }
    let mut commits = report.commits.iter();
    let next = match commits.any(|commit| !commit.damage.is_empty()) {
        true => "`run` continues from the last iteration before them",
        false => "`run` repairs them and loses no iteration",
    };
    writeln!(out, "{damaged} files do not verify; {next}");
    Ok(Exit::Damaged)
}
