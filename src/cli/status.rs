//! `fretwear status`.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::{fs, io};

use fretwear::recipe::{Recipe, StoredPlan};
use fretwear::report::{continuation, one_line_name, word};
use fretwear::stages::{RunCost, RunEnds, RunStatus, plausibility_checks};
use fretwear::store::{Layout, LockHolder, RealFileSystem, RunReader};
use fretwear::tables::TableName;
use fretwear::tables::typed::Summary;
use serde_json::{Map, Value, json};

use super::figures::{worn, write_figures};
use super::report::{row, write_judged};
use super::{CliError, Exit, cost};
use crate::progress::{duration, grouped};
use crate::terminal::{Results, say};

/// Prints how far a run is, also while another process computes it, or a line per run of a folder of runs.
pub fn status(folder: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    // A run that has lost its record is damaged, not a folder of runs.
    let is_run = folder.is_file() || Layout::at(folder).is_of_run();
    match is_run {
        true => of_run(folder, as_json, out),
        false => list(folder, as_json, out),
    }
}

fn of_run(root: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let reader = RunReader::open(Arc::new(RealFileSystem), root)?;
    let StoredPlan { recipe, warnings } = reader.plan(StoredPlan::of)?;
    let standing = RunStatus::of(&reader, &recipe)?;
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
        let last = standing.wear_iteration;
        let summary = last
            .map(|k| reader.read(k, TableName::Summary))
            .transpose()?;
        let mut object = summary.as_ref().map(row).unwrap_or_default();
        describe(&mut object, root, &standing, holder);
        object.insert("failure".to_owned(), json!(failure));
        if standing.wear_iteration.is_some() {
            object.insert("cost".to_owned(), cost::spent(&spent));
        }
        object.insert("warnings".to_owned(), json!(warnings));
        object.insert("damage".to_owned(), json!(damaged));
        out.json(&Value::Object(object));
    } else {
        write(out, root, &standing, holder, title(&recipe));
        if let (Some(ends), Some(cycles)) = (&ends, standing.cycles)
            && !standing.done
        {
            out.item("progress", &progress(&standing, cycles, &ends.now.summary));
        }
        write_pace(out, &standing);
        if let Some(failure) = failure {
            out.item("failed", &failure);
        }
        if let Some(ends) = &ends {
            write_figures(out, ends);
            out.item("cost", &cost::in_words(&spent));
        }
        if damaged.is_empty() {
            write_judged(out, &plausibility_checks(&reader, &recipe)?);
        }
        for warning in &warnings {
            out.beside("warning: ", warning);
        }
        for damage in &damaged {
            out.beside("damaged: ", damage);
        }
        // Commands are pasted: no line of theirs is broken.
        let mut command = |name: &str, text: String| writeln!(out, "  {name:<24} {text}");
        if holder.is_none() && !standing.done {
            command("continue", continuation(root));
        }
        if ends.is_some() {
            let root = word(root);
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

/// Whether a run is being computed, is at its end, or waits to be continued.
fn state(standing: &RunStatus, holder: Option<LockHolder>) -> &'static str {
    match (holder, standing.done) {
        (Some(_), _) => "running",
        (None, true) => "done",
        (None, false) => "stopped",
    }
}

fn describe(
    object: &mut Map<String, Value>,
    root: &Path,
    standing: &RunStatus,
    holder: Option<LockHolder>,
) {
    let state = state(standing, holder);
    let update = standing.last_update.map(|update| {
        json!({
            "wear_iteration": update.wear_iteration,
            "cycles": update.cycles,
            "updates": update.updates,
        })
    });
    let drafted: Vec<&str> = standing.draft.iter().map(|stage| stage.name()).collect();
    let values = [
        ("wear_iteration", json!(standing.wear_iteration)),
        ("state", json!(state)),
        ("running", json!(holder.is_some())),
        ("process", json!(holder.and_then(|holder| holder.pid))),
        ("stage", json!(standing.stage.map(|stage| stage.name()))),
        ("drafted", json!(drafted)),
        ("cycles_goal", json!(standing.cycles_goal)),
        ("cycles_left", json!(standing.cycles_left())),
        ("wear_volume_goal", json!(standing.volume_goal)),
        ("part_done", json!(standing.part)),
        ("has_lost_preload", json!(standing.has_lost_preload)),
        ("last_update", json!(update)),
        ("cycles_per_second", json!(standing.cycles_per_second)),
        ("seconds_left", json!(standing.seconds_left)),
        (
            "continue",
            json!((state == "stopped").then(|| continuation(root))),
        ),
    ];
    object.extend(values.map(|(name, value)| (name.to_owned(), value)));
}

fn write(
    out: &mut Results,
    root: &Path,
    standing: &RunStatus,
    holder: Option<LockHolder>,
    title: String,
) {
    let mut first = match standing.wear_iteration {
        Some(latest) => format!("{}: iteration {latest}, ", root.display()),
        None => format!("{}: nothing committed yet, ", root.display()),
    };
    first += state(standing, holder);
    if standing.has_lost_preload {
        first += ", ended by wear.until.preload";
    }
    if let Some(pid) = holder.and_then(|holder| holder.pid) {
        first += &format!(" (process {pid})");
    }
    let next = standing.wear_iteration.map_or(0, |k| k + 1);
    match standing.stage {
        Some(stage) if holder.is_some() => first += &format!(", {stage} of iteration {next}"),
        Some(stage) if !standing.draft.is_empty() => {
            // All of its stages may be passed, and the commit alone left.
            let ahead = match standing.draft.contains(&stage) {
                true => "its commit",
                false => stage.name(),
            };
            first += &format!(" within iteration {next}, before {ahead}");
        }
        _ => (),
    }
    writeln!(out, "{first}");
    if !title.is_empty() {
        out.item("title", &title);
    }
}

/// How far a run is.
fn progress(standing: &RunStatus, cycles: u64, summary: &Summary) -> String {
    let goal = standing.cycles_goal;
    let goal = goal.map_or_else(String::new, |goal| format!(" of {}", grouped(goal)));
    let worn = worn(
        summary.wear_volume.unwrap_or(0.0),
        summary.error_wear_volume,
    );
    let part = 100.0 * standing.part;
    format!("{}{goal} cycles, {worn}, {part:.0} % done", grouped(cycles))
}

/// When the contact elements were updated last, how fast the run is, and how long it will take.
fn write_pace(out: &mut Results, standing: &RunStatus) {
    if let Some(update) = standing.last_update {
        let at = update.cycles.map_or_else(String::new, |cycles| {
            format!(", at {} cycles", grouped(cycles))
        });
        let (iteration, updates) = (update.wear_iteration, update.updates);
        let text = format!("iteration {iteration}{at}; {updates} so far");
        out.item("last update", &text);
    }
    if let (false, Some(rate)) = (standing.done, standing.cycles_per_second) {
        let left = standing.cycles_left().map_or_else(String::new, |cycles| {
            format!(", {} cycles to go", grouped(cycles))
        });
        let time = standing.seconds_left.map_or_else(String::new, |seconds| {
            format!(", about {}", duration(seconds))
        });
        let rate = grouped(rate as u64);
        out.item("pace", &format!("{rate} cycles/s of late{left}{time}"));
    }
}

/// The title on one line.
fn title(recipe: &Recipe) -> String {
    let title = recipe.title.iter();
    let words = title.flat_map(|title| title.split_whitespace());
    words.collect::<Vec<&str>>().join(" ")
}

/// Prints a line per run of a folder.
fn list(folder: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let unreadable = |source: io::Error| match source.kind() {
        io::ErrorKind::NotFound => CliError::NoFolder {
            path: folder.to_owned(),
        },
        _ => CliError::Folder {
            path: folder.to_owned(),
            source,
        },
    };
    let mut roots: Vec<PathBuf> = fs::read_dir(folder)
        .map_err(unreadable)?
        .filter_map(|entry| entry.ok().map(|entry| entry.path()))
        .filter(|path| Layout::at(path).has_record())
        .collect();
    roots.sort();
    if !as_json && roots.is_empty() {
        say(&format!("no run in {}", folder.display()));
    }
    for root in roots {
        let name = one_line_name(&word(&root));
        match line(&root) {
            Ok(found) if as_json => out.json(&found),
            Ok(found) => writeln!(
                out,
                "{name:<32} {:<8} {:>9}  {}",
                found["state"].as_str().unwrap_or_default(),
                found["wear_iteration"]
                    .as_u64()
                    .map_or("–".to_owned(), |k| format!("#{k}")),
                found["words"].as_str().unwrap_or_default()
            ),
            Err(error) if as_json => {
                out.json(&json!({ "run": root.display().to_string(), "error": error.to_string() }));
            }
            Err(error) => writeln!(out, "{name:<32} {}", one_line_name(&error.to_string())),
        }
    }
    Ok(Exit::Done)
}

/// The first words of a message, on one line.
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
    let standing = RunStatus::of(&reader, &recipe)?;
    let summary = standing.wear_iteration.map(|k| reader.typed::<Summary>(k));
    let summary = summary.transpose()?.unwrap_or_default();
    let mut words = Vec::new();
    if let Some(cycles) = standing.cycles {
        words.push(format!(
            "{} cycles, {:.0} %",
            grouped(cycles),
            100.0 * standing.part
        ));
    }
    if let Some(volume) = summary.wear_volume {
        words.push(worn(volume, summary.error_wear_volume));
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
        "state": state(&standing, reader.holder()?),
        "wear_iteration": standing.wear_iteration,
        "cycles": standing.cycles,
        "part_done": standing.part,
        "wear_volume": summary.wear_volume,
        "error_wear_volume": summary.error_wear_volume,
        "failure": failure,
        "words": words.join(", "),
    }))
}
