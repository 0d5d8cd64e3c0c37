//! `fretwear campaign status` and `campaign collect`.

use std::collections::BTreeMap;
use std::path::Path;

use fretwear::campaign::State;
use fretwear::report::shell_word;
use serde_json::json;

use super::{CliError, Exit, folder};
use crate::progress::duration;
use crate::terminal::{Results, say};

/// Largest number of rows or reasons that are listed.
const NAMED: usize = 8;

pub fn status(root: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let folder = folder(root);
    let (about, campaign) = folder.open()?;
    let states = folder.states(campaign.rows.len())?;
    let rows_in_state = |state: State| -> Vec<usize> {
        let all = states.iter().enumerate();
        all.filter(|(_, state_of_row)| **state_of_row == state)
            .map(|(index, _)| index)
            .collect()
    };
    let incomplete = rows_in_state(State::Incomplete);
    let (running, stopped): (Vec<usize>, Vec<usize>) = incomplete
        .into_iter()
        .partition(|index| folder.holder(*index).is_some());
    let (done, waiting) = (
        rows_in_state(State::Complete),
        rows_in_state(State::Waiting),
    );
    let failures = folder.failures(&states)?;
    let collected = folder.collected(&campaign)?.len();
    // The remaining time is known only if every open row has an estimate.
    let open = running.iter().chain(&stopped).chain(&waiting);
    let mut seconds = Some(0.0);
    for index in open {
        seconds = seconds
            .zip(campaign.rows[*index].seconds)
            .map(|(sum, state_of_row)| sum + state_of_row);
    }
    if as_json {
        out.json(&json!({
            "title": about.title,
            "rows": campaign.rows.len(),
            "done": done.len(),
            "running": running,
            "stopped": stopped,
            "failed": failures.iter().map(|(index, failure)| json!({
                "index": index,
                "settings": campaign.rows[*index].settings,
                "when": failure.when,
                "reason": failure.message,
                "tried_again": failure.again,
            })).collect::<Vec<_>>(),
            "waiting": waiting.len(),
            "collected": collected,
            "seconds_left": seconds,
        }));
        return Ok(Exit::Done);
    }
    writeln!(
        out,
        "{}: {}, {} rows",
        root.display(),
        about.title,
        campaign.rows.len()
    );
    let mut line = |name: &str, rows: &[usize]| {
        if !rows.is_empty() {
            writeln!(out, "  {name:<10} {}: {}", rows.len(), named(rows));
        }
    };
    line("running", &running);
    line("stopped", &stopped);
    writeln!(
        out,
        "  {:<10} {}, {collected} of them collected",
        "done",
        done.len()
    );
    if !waiting.is_empty() {
        writeln!(out, "  {:<10} {}", "waiting", waiting.len());
    }
    if let Some(seconds) = seconds.filter(|seconds| *seconds > 0.0) {
        writeln!(
            out,
            "  {:<10} about {} on one core, by the plan",
            "to go",
            duration(seconds)
        );
    }
    if !failures.is_empty() {
        writeln!(out, "  {:<10} {}", "failed", failures.len());
    }
    // Print each reason once, with all its rows.
    let mut reasons: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (index, failure) in &failures {
        reasons.entry(&failure.message).or_default().push(*index);
    }
    let more = reasons.len().saturating_sub(NAMED);
    for (reason, rows) in reasons.into_iter().take(NAMED) {
        writeln!(out, "    {}: {reason}", named(&rows));
    }
    if more > 0 {
        writeln!(out, "    and {more} more reasons: --json lists all");
    }
    Ok(Exit::Done)
}

/// Lists the indices of the first rows.
fn named(rows: &[usize]) -> String {
    let shown: Vec<String> = rows.iter().take(NAMED).map(ToString::to_string).collect();
    let ellipsis = if rows.len() > NAMED { ", …" } else { "" };
    format!("row {}{ellipsis}", shown.join(", "))
}

pub fn collect(root: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let folder = folder(root);
    let (_, campaign) = folder.open()?;
    let collected = folder.collect(&campaign)?;
    let shards: Vec<String> = collected
        .shards
        .iter()
        .map(|path| path.display().to_string())
        .collect();
    if as_json {
        out.json(&json!({
            "runs": collected.runs,
            "collected": collected.total,
            "rows": campaign.rows.len(),
            "shards": shards,
            "unread": collected.unread.iter().map(ToString::to_string).collect::<Vec<_>>(),
            "damaged": collected.damaged.iter().map(|(path, reason)| json!({
                "path": path.display().to_string(),
                "reason": reason,
            })).collect::<Vec<_>>(),
        }));
    } else {
        writeln!(
            out,
            "{}: {} runs collected, {} of {} in all",
            root.display(),
            collected.runs,
            collected.total,
            campaign.rows.len()
        );
        for shard in shards {
            writeln!(out, "  {shard}");
        }
        let states = folder.states(campaign.rows.len())?;
        let failed = states
            .iter()
            .filter(|state| **state == State::Failed)
            .count();
        if failed > 0 {
            writeln!(
                out,
                "  {failed} rows failed and are in no shard: fretwear campaign status shows why"
            );
        }
        if collected.total > 0 {
            writeln!(
                out,
                "look at them:  fretwear campaign report --dir {}",
                shell_word(root)
            );
        }
    }
    for (path, reason) in &collected.damaged {
        say(&format!(
            "damaged: {}: {reason}; it is left out: remove it and run its row again, which gives the same result",
            path.display()
        ));
    }
    for error in &collected.unread {
        say(&error.to_string());
    }
    Ok(
        match (collected.damaged.is_empty(), collected.unread.is_empty()) {
            (true, true) => Exit::Done,
            (true, false) => Exit::Failure,
            (false, _) => Exit::Damaged,
        },
    )
}
