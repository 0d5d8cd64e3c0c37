//! Diagram of the stages of a scene and of the tables between them.

use std::collections::BTreeMap;
use std::fmt::Write;

use super::declaration::{Declaration, is_in};
use super::list::stages_of;
use super::runner::writer_before;
use super::stage::{Stage, When};
use crate::recipe::Recipe;
use crate::tables::TableName;

/// An iteration with all stages except the stage of the unworn state.
const ANY: u64 = 1;

/// Returns the stages of a recipe and the tables between them as a Mermaid flowchart. Solid arrows stay within an
/// iteration, and dashed arrows lead into the next iteration.
pub fn graph(recipe: &Recipe) -> String {
    let mut text = "flowchart TB\n".to_owned();
    let wears = recipe.wear.is_some();
    let groups = [
        ("once", "once a run", When::Once),
        ("unworn_state", "the unworn state", When::Unworn),
    ];
    for (name, title, when) in groups {
        group(&mut text, recipe, name, title, |stage| stage.when == when);
    }
    let title = match wears {
        true => "every wear iteration",
        false => "the only iteration",
    };
    group(&mut text, recipe, "iteration", title, |stage| {
        matches!(stage.when, When::Worn | When::Always)
    });
    for stage in stages_of(recipe) {
        let reads = stage.reads.iter().filter(|table| is_in(recipe, **table));
        let mut tables_by_writer: BTreeMap<Stage, Vec<TableName>> = BTreeMap::new();
        for &table in reads {
            let wear_iteration = u64::from(stage.when != When::Unworn);
            if let Some(writer) = writer_before(recipe, wear_iteration, stage.stage, table) {
                tables_by_writer
                    .entry(writer.stage)
                    .or_default()
                    .push(table);
            }
        }
        arrows(&mut text, &tables_by_writer, stage, "-->");
        if wears {
            let before = stage.before.iter().filter(|table| is_in(recipe, **table));
            let mut tables_by_writer: BTreeMap<Stage, Vec<TableName>> = BTreeMap::new();
            for &table in before {
                // The previous iteration is complete, so each table is the version of its last writer.
                let writers = stages_of(recipe).filter(|s| s.when.is_in(ANY));
                let mut writers = writers.filter(|s| s.writes.contains(&table));
                if let Some(writer) = writers.by_ref().last() {
                    tables_by_writer
                        .entry(writer.stage)
                        .or_default()
                        .push(table);
                }
            }
            arrows(&mut text, &tables_by_writer, stage, "-.->");
        }
    }
    text
}

fn group(
    text: &mut String,
    recipe: &Recipe,
    name: &str,
    title: &str,
    belongs: impl Fn(&Declaration) -> bool,
) {
    let stages: Vec<&Declaration> = stages_of(recipe).filter(|s| belongs(s)).collect();
    if stages.is_empty() {
        return;
    }
    writeln!(text, "  subgraph {name} [\"{title}\"]").expect("a text takes all");
    for stage in stages {
        let parts: Vec<&str> = stage.recipe.iter().map(|part| part.name()).collect();
        let parts_text = match parts.is_empty() {
            true => String::new(),
            false => format!("<br/><i>{}</i>", parts.join(", ")),
        };
        let unread: Vec<&str> = stage
            .writes_in(recipe)
            .filter(|table| !is_read(recipe, *table))
            .map(TableName::as_str)
            .collect();
        let unread = match unread.is_empty() {
            true => String::new(),
            false => format!("<br/>writes {}", unread.join(", ")),
        };
        let name = stage.stage;
        writeln!(text, "    {name}[\"<b>{name}</b>{parts_text}{unread}\"]")
            .expect("a text takes all");
    }
    text.push_str("  end\n");
}

/// Returns true if an arrow of the diagram carries the table.
fn is_read(recipe: &Recipe, table: TableName) -> bool {
    let wears = recipe.wear.is_some();
    let mut readers = stages_of(recipe);
    readers.any(|stage| stage.reads.contains(&table) || wears && stage.before.contains(&table))
}

fn arrows(
    text: &mut String,
    tables_by_writer: &BTreeMap<Stage, Vec<TableName>>,
    to: &Declaration,
    arrow: &str,
) {
    for (writer, tables) in tables_by_writer {
        let names: Vec<&str> = tables.iter().map(|table| table.as_str()).collect();
        let names = names.join("<br/>");
        writeln!(text, "  {writer} {arrow}|{names}| {}", to.stage).expect("a text takes all");
    }
}
