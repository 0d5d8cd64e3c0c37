//! Tables of a report on how the results were computed.

use maud::{Markup, html};

use super::quantity::{self, four_digits};
use super::run_tables::{numeric_column, text_column};
use super::table::table;
use super::template::Section;
use super::{ReportError, RunTables};
use crate::recipe;
use crate::store::StageCost;
use crate::tables::TableName;

/// Builds the sections on how the results were computed.
pub fn sections(runs: &[RunTables]) -> Result<Vec<Section>, ReportError> {
    let mut sections = Vec::new();
    sections.extend(ledger(runs)?);
    sections.push(decisions(runs));
    sections.push(cost(runs)?);
    sections.push(provenance(runs));
    sections.push(scenes(runs));
    Ok(sections)
}

/// Builds one part per run, with the name of the run if there are several.
fn each(runs: &[RunTables], part: impl Fn(&RunTables) -> Markup) -> Markup {
    html! {
        @for run in runs {
            @if runs.len() > 1 { h3 { (run.name()) } "\n" }
            (part(run))
        }
    }
}

/// Smallest shown difference \[%\].
const LEAST: f64 = 1e-4;

fn ledger(runs: &[RunTables]) -> Result<Option<Section>, ReportError> {
    let mut parts = Vec::new();
    for run in runs {
        let mut rows: Vec<Vec<String>> = Vec::new();
        let first = run.iteration_table(run.iterations()[0], TableName::Ledger)?;
        let last = run.iteration_table(run.latest(), TableName::Ledger)?;
        for (state, frame) in [("unworn", first), ("last", last)] {
            let Some(frame) = frame else { continue };
            let columns = text_column(&frame, "quantity").zip(numeric_column(&frame, "fine"));
            let Some(((names, fine), dynamic)) = columns.zip(numeric_column(&frame, "dynamic"))
            else {
                continue;
            };
            for ((name, fine), dynamic) in names.iter().zip(fine).zip(dynamic) {
                let difference = 100.0 * (dynamic / fine - 1.0);
                // A difference below `LEAST` is a rounding error.
                let difference = if difference.abs() < LEAST {
                    0.0
                } else {
                    difference
                };
                rows.push(vec![
                    format!("{}, {state}", name.replace('_', " ")),
                    four_digits(fine),
                    four_digits(dynamic),
                    format!("{}\u{a0}%", quantity::significant_digits(difference, 3)),
                ]);
            }
        }
        parts.push(rows);
    }
    if parts.iter().all(Vec::is_empty) {
        return Ok(None);
    }
    let heads = [
        "quantity",
        "rough contact",
        "contact elements",
        "difference",
    ];
    let parts = runs.iter().zip(&parts);
    Ok(Some(Section {
        id: "ledger",
        title: "Rough contact against contact elements".to_owned(),
        html: html! {
            p { "The table compares quantities of the rough contact, computed cell by cell, with those of the contact elements of the structure." } "\n"
            @for (run, rows) in parts.filter(|(_, rows)| !rows.is_empty()) {
                @if runs.len() > 1 { h3 { (run.name()) } "\n" }
                (table(&heads, rows, true))
            }
        },
    }))
}

fn decisions(runs: &[RunTables]) -> Section {
    let html = each(runs, |run| {
        let rows = recipe::decisions(run.recipe()).into_iter();
        let rows: Vec<Vec<String>> = rows.map(|d| vec![d.what, d.choice, d.why]).collect();
        let table = table(&["what", "decision", "why"], &rows, false);
        match runs.len() {
            1 => table,
            _ => html! { details { summary { "Decisions" } "\n" (table) } "\n" },
        }
    });
    Section {
        id: "plan",
        title: "Decisions of the computation".to_owned(),
        html,
    }
}

/// Titles of the costs of a run.
const COSTS: [&str; 4] = ["wear iterations", "FFT pairs", "disk / MB", "time / s"];

fn cost(runs: &[RunTables]) -> Result<Section, ReportError> {
    let (mut costs, mut by_stage) = (Vec::new(), Vec::new());
    for run in runs {
        let mut disk = 0;
        for k in run.iterations() {
            let commit = run.reader().commit_of(*k);
            disk += commit.map_or(0, |commit| commit.bytes());
        }
        let spent = run.history()?.cost();
        let sum = |value: fn(&StageCost) -> f64| -> f64 { spent.values().map(value).sum() };
        costs.push([
            run.latest().to_string(),
            four_digits(sum(|cost| cost.fft_pairs)),
            four_digits(disk as f64 / 1e6),
            four_digits(sum(|cost| cost.seconds)),
        ]);
        let stages: Vec<Vec<String>> = spent
            .iter()
            .map(|(stage, cost)| {
                vec![
                    stage.clone(),
                    four_digits(cost.seconds),
                    four_digits(cost.fft_pairs),
                ]
            })
            .collect();
        if !stages.is_empty() {
            let name = match runs.len() {
                1 => "By stage".to_owned(),
                _ => format!("{}, by stage", run.name()),
            };
            by_stage.push((name, stages));
        }
    }
    let sums = match &costs[..] {
        [cost] => {
            let rows = COSTS.iter().zip(cost);
            let rows: Vec<_> = rows.map(|(name, spent)| vec![*name, spent]).collect();
            table(&["cost", ""], &rows, true)
        }
        costs => {
            let rows = runs.iter().zip(costs).map(|(run, cost)| {
                let name = std::iter::once(run.name());
                name.chain(cost.iter().map(String::as_str)).collect()
            });
            let heads: Vec<&str> = std::iter::once("").chain(COSTS).collect();
            table(&heads, &rows.collect::<Vec<_>>(), true)
        }
    };
    Ok(Section {
        id: "cost",
        title: "Cost".to_owned(),
        html: html! {
            (sums)
            @for (name, stages) in &by_stage {
                details {
                    summary { (name) } "\n"
                    (table(&["stage", "time / s", "FFT pairs"], stages, true))
                } "\n"
            }
        },
    })
}

fn provenance(runs: &[RunTables]) -> Section {
    let html = each(runs, |run| {
        let record = run.record();
        let machine = &record.machine;
        let mut rows = vec![
            vec![
                "program".to_owned(),
                program(&record.program_version, record.program_commit.as_deref()),
            ],
            vec!["scene hash".to_owned(), record.scene_hash.clone()],
            vec![
                "machine".to_owned(),
                format!(
                    "{} {}, {} processors ({})",
                    machine.os,
                    machine.architecture,
                    machine.processors,
                    machine.cpu_features.join(", ")
                ),
            ],
            vec!["threads".to_owned(), record.threads.to_string()],
        ];
        rows.push(vec!["begun".to_owned(), record.began.clone()]);
        let seed = record
            .seed
            .map(|seed| vec!["seed".to_owned(), seed.to_string()]);
        rows.extend(seed);
        rows.extend(record.origin.as_ref().map(|origin| {
            let from = format!("iteration {} of {}", origin.wear_iteration, origin.run);
            vec!["begun from".to_owned(), from]
        }));
        for start in &record.continued {
            let from = match start.wear_iteration {
                Some(k) => format!("from iteration {k}"),
                None => "from the beginning".to_owned(),
            };
            let how = format!(
                "{}, {from}, {}, {} threads {}",
                start.began,
                program(&start.program_version, start.program_commit.as_deref()),
                start.threads,
                start.changed_keys.join(", ")
            );
            rows.push(vec!["continued".to_owned(), how]);
        }
        table(&["what", "value"], &rows, false)
    });
    Section {
        id: "provenance",
        title: "Provenance".to_owned(),
        html,
    }
}

/// Returns the version of the program and the commit that it was built from.
fn program(version: &str, commit: Option<&str>) -> String {
    match commit {
        Some(commit) => format!("fretwear {version}, commit {commit}"),
        None => format!("fretwear {version}"),
    }
}

/// Shows the scenes as the users wrote them, or scene.toml if a run does not have the original file.
fn scenes(runs: &[RunTables]) -> Section {
    Section {
        id: "scene",
        title: "Scene".to_owned(),
        html: html! {
            @for run in runs {
                @let (file, text) = match &run.record().scene_written {
                    Some(text) => ("the scene as it was written", text.as_str()),
                    None => ("scene.toml as kept in the run", run.scene_toml()),
                };
                details { summary { (run.name()) ": " (file) } "\n" pre { (text) } } "\n"
            }
        },
    }
}
