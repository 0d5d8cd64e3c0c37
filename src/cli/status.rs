//! `fretwear status`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

use fretwear::recipe::{Recipe, StoredPlan};
use fretwear::report::{continue_command, one_line_name, shell_word};
use fretwear::stages::{RunCost, RunEnds, RunStatus, plausibility_checks};
use fretwear::store::{Layout, LockHolder, RealFileSystem, RunReader};
use fretwear::tables::TableName;
use fretwear::tables::typed::Summary;
use serde_json::{Map, Value, json};

use super::figures::{figures_json, worn_volume_text, write_figures};
use super::report::{row, write_checks};
use super::{CliError, Exit, cost};
use crate::progress::{duration, grouped};
use crate::terminal::{Results, say};

/// Prints the progress of a run, even while another process computes the run. For a folder of runs, `status` prints one
/// line per run.
pub fn status(folder: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    // A run folder without its record is a damaged run. Do not treat the damaged run as a folder of runs.
    let is_run = folder.is_file() || Layout::at(folder).is_of_run();
    match is_run {
        true => print_run(folder, as_json, out),
        false => list(folder, as_json, out),
    }
}

fn print_run(root: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let StoredPlan { recipe, warnings } = reader.plan(StoredPlan::of)?;
    let run_status = RunStatus::of(&reader, &recipe)?;
    let ends = RunEnds::of(&reader)?;
    let spent = RunCost::of(&reader)?;
    let holder = reader.holder()?;
    let failure = reader.failure()?.map(|failure| failure.message);
    let damaged: Vec<String> = reader
        .reports()
        .iter()
        .flat_map(|report| &report.damage)
        .map(ToString::to_string)
        .collect();
    if as_json {
        let last = run_status.wear_iteration;
        let summary = last
            .map(|k| reader.read(k, TableName::Summary))
            .transpose()?;
        let mut object = summary.as_ref().map(row).unwrap_or_default();
        describe(&mut object, root, &run_status, holder);
        object.insert("failure".to_owned(), json!(failure));
        if run_status.wear_iteration.is_some() {
            object.insert("cost".to_owned(), cost::cost_json(&spent));
        }
        let figures = ends.as_ref().map(figures_json);
        object.insert("figures".to_owned(), json!(figures.unwrap_or(json!([]))));
        object.insert("warnings".to_owned(), json!(warnings));
        object.insert("damage".to_owned(), json!(damaged));
        out.json(&Value::Object(object));
    } else {
        write(out, root, &run_status, holder, title(&recipe));
        if let (Some(ends), Some(cycles)) = (&ends, run_status.cycles)
            && !run_status.done
        {
            out.item(
                "progress",
                &progress(&run_status, cycles, &ends.now.summary),
            );
        }
        write_pace(out, &run_status);
        if let Some(failure) = failure {
            out.item("failed", &failure);
        }
        if let Some(ends) = &ends {
            write_figures(out, ends);
            out.item("cost", &cost::cost_text(&spent));
        }
        if damaged.is_empty() {
            write_checks(out, &plausibility_checks(&reader, &recipe)?);
        }
        for warning in &warnings {
            out.aligned("warning: ", warning);
        }
        for damage in &damaged {
            out.aligned("damaged: ", damage);
        }
        // Do not wrap commands, because users paste them.
        let mut command = |name: &str, text: String| writeln!(out, "  {name:<24} {text}");
        if holder.is_none() && !run_status.done {
            command("continue", continue_command(root));
        }
        if ends.is_some() {
            let root = shell_word(root);
            command("look at it", format!("fretwear report {root}"));
            command("all figures", format!("fretwear status {root} --json"));
        }
    }
    Ok(if damaged.is_empty() {
        Exit::Done
    } else {
        Exit::Damaged
    })
}

/// Returns the state of a run: "running", "done" or "stopped".
fn state(run_status: &RunStatus, holder: Option<LockHolder>) -> &'static str {
    match (holder, run_status.done) {
        (Some(_), _) => "running",
        (None, true) => "done",
        (None, false) => "stopped",
    }
}

fn describe(
    object: &mut Map<String, Value>,
    root: &Path,
    run_status: &RunStatus,
    holder: Option<LockHolder>,
) {
    let state = state(run_status, holder);
    let update = run_status.last_update.map(|update| {
        json!({
            "wear_iteration": update.wear_iteration,
            "cycles": update.cycles,
            "updates": update.updates,
        })
    });
    let drafted: Vec<&str> = run_status.draft.iter().map(|stage| stage.name()).collect();
    let values = [
        ("wear_iteration", json!(run_status.wear_iteration)),
        ("state", json!(state)),
        ("running", json!(holder.is_some())),
        ("process", json!(holder.and_then(|holder| holder.pid))),
        ("stage", json!(run_status.stage.map(|stage| stage.name()))),
        ("drafted", json!(drafted)),
        ("cycles_goal", json!(run_status.cycles_goal)),
        ("cycles_left", json!(run_status.cycles_left())),
        ("wear_volume_goal", json!(run_status.volume_goal)),
        ("part_done", json!(run_status.part)),
        ("has_lost_preload", json!(run_status.has_lost_preload)),
        ("last_update", json!(update)),
        ("cycles_per_second", json!(run_status.cycles_per_second)),
        ("seconds_left", json!(run_status.seconds_left)),
        (
            "continue",
            json!((state == "stopped").then(|| continue_command(root))),
        ),
    ];
    object.extend(values.map(|(name, value)| (name.to_owned(), value)));
}

fn write(
    out: &mut Results,
    root: &Path,
    run_status: &RunStatus,
    holder: Option<LockHolder>,
    title: String,
) {
    let mut heading = match run_status.wear_iteration {
        Some(latest) => format!("{}: iteration {latest}, ", root.display()),
        None => format!("{}: nothing committed yet, ", root.display()),
    };
    heading += state(run_status, holder);
    if run_status.has_lost_preload {
        heading += ", ended by wear.until.preload";
    }
    if let Some(pid) = holder.and_then(|holder| holder.pid) {
        heading += &format!(" (process {pid})");
    }
    let next = run_status.wear_iteration.map_or(0, |k| k + 1);
    match run_status.stage {
        Some(stage) if holder.is_some() => heading += &format!(", {stage} of iteration {next}"),
        Some(stage) if !run_status.draft.is_empty() => {
            // If all stages are complete, only the commit is missing.
            let next_step = match run_status.draft.contains(&stage) {
                true => "its commit",
                false => stage.name(),
            };
            heading += &format!(" within iteration {next}, before {next_step}");
        }
        _ => (),
    }
    writeln!(out, "{heading}");
    if !title.is_empty() {
        out.item("title", &title);
    }
}

/// Describes the progress of a run.
fn progress(run_status: &RunStatus, cycles: u64, summary: &Summary) -> String {
    let goal = run_status.cycles_goal;
    let goal = goal.map_or_else(String::new, |goal| format!(" of {}", grouped(goal)));
    let worn = worn_volume_text(
        summary.wear_volume.unwrap_or(0.0),
        summary.error_wear_volume,
    );
    let part = 100.0 * run_status.part;
    format!("{}{goal} cycles, {worn}, {part:.0} % done", grouped(cycles))
}

/// Prints the last update of the contact elements, the speed of the run, and the remaining time.
fn write_pace(out: &mut Results, run_status: &RunStatus) {
    if let Some(update) = run_status.last_update {
        let at_cycles = update.cycles.map_or_else(String::new, |cycles| {
            format!(", at {} cycles", grouped(cycles))
        });
        let (iteration, updates) = (update.wear_iteration, update.updates);
        let text = format!("iteration {iteration}{at_cycles}; {updates} so far");
        out.item("last update", &text);
    }
    if let (false, Some(rate)) = (run_status.done, run_status.cycles_per_second) {
        let remaining = run_status.cycles_left().map_or_else(String::new, |cycles| {
            format!(", {} cycles to go", grouped(cycles))
        });
        let time = run_status.seconds_left.map_or_else(String::new, |seconds| {
            format!(", about {}", duration(seconds))
        });
        let rate = grouped(rate as u64);
        out.item(
            "pace",
            &format!("{rate} cycles/s recently{remaining}{time}"),
        );
    }
}

/// Returns the title on one line.
fn title(recipe: &Recipe) -> String {
    let title = recipe.title.iter();
    let words = title.flat_map(|title| title.split_whitespace());
    words.collect::<Vec<&str>>().join(" ")
}

/// Prints one line per run of a folder.
fn list(folder: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let folder_error = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => CliError::NoFolder {
            path: folder.to_owned(),
        },
        _ => CliError::Folder {
            path: folder.to_owned(),
            source,
        },
    };
    let mut roots: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(folder_error)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| Layout::at(path).has_record())
        .collect();
    roots.sort();
    if !as_json && roots.is_empty() {
        say(&format!("no run in {}", folder.display()));
    }
    for root in roots {
        let name = one_line_name(&shell_word(&root));
        match line(&root) {
            Ok(entry) if as_json => out.json(&entry),
            Ok(entry) => writeln!(
                out,
                "{name:<32} {:<8} {:>9}  {}",
                entry["state"].as_str().unwrap_or_default(),
                entry["wear_iteration"]
                    .as_u64()
                    .map_or("–".to_owned(), |k| format!("#{k}")),
                entry["words"].as_str().unwrap_or_default()
            ),
            Err(error) if as_json => {
                out.json(&json!({ "run": root.display().to_string(), "error": error.to_string() }));
            }
            Err(error) => writeln!(out, "{name:<32} {}", one_line_name(&error.to_string())),
        }
    }
    Ok(Exit::Done)
}

/// Shortens a message to the first words of the message, on one line.
fn short(message: &str) -> String {
    const LONGEST: usize = 80;
    let message = message.split_whitespace().collect::<Vec<&str>>().join(" ");
    match message.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{} …", message[..end].trim_end()),
        None => message,
    }
}

fn line(root: &Path) -> Result<serde_json::Value, CliError> {
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let recipe = reader.plan(StoredPlan::of)?.recipe;
    let run_status = RunStatus::of(&reader, &recipe)?;
    let summary = run_status
        .wear_iteration
        .map(|k| reader.typed::<Summary>(k));
    let summary = summary.transpose()?.unwrap_or_default();
    let mut words = Vec::new();
    if let Some(cycles) = run_status.cycles {
        words.push(format!(
            "{} cycles, {:.0} %",
            grouped(cycles),
            100.0 * run_status.part
        ));
    }
    if let Some(volume) = summary.wear_volume {
        words.push(worn_volume_text(volume, summary.error_wear_volume));
    }
    words.push(title(&recipe));
    words.retain(|word| !word.is_empty());
    let failure = reader.failure()?.map(|failure| failure.message);
    words.extend(
        failure
            .as_ref()
            .map(|failure| format!("failed: {}", short(failure))),
    );
    Ok(json!({
        "run": root.display().to_string(),
        "state": state(&run_status, reader.holder()?),
        "wear_iteration": run_status.wear_iteration,
        "cycles": run_status.cycles,
        "part_done": run_status.part,
        "wear_volume": summary.wear_volume,
        "error_wear_volume": summary.error_wear_volume,
        "failure": failure,
        "words": words.join(", "),
    }))
}
