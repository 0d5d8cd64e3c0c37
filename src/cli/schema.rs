//! `fretwear schema`.

use fretwear::tables::{ColumnSchema, ColumnType, Place, Schema, TableName};
use serde_json::{Map, Value, json};

use super::{CliError, Exit};
use crate::terminal::Results;

/// In which form the schemas are printed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// For a terminal.
    Text,
    /// For a documentation.
    Markdown,
    /// For a program.
    Json,
}

impl Form {
    /// That of the flags.
    pub fn of(markdown: bool, json: bool) -> Form {
        match (markdown, json) {
            (_, true) => Form::Json,
            (true, false) => Form::Markdown,
            (false, false) => Form::Text,
        }
    }
}

/// Prints what a table, or every table, is: its file, when it is written, and its columns.
pub fn schema(table: Option<&str>, form: Form, out: &mut Results) -> Result<Exit, CliError> {
    let known = || TableName::ALL.map(TableName::as_str).join(", ");
    let tables = match table {
        None => TableName::ALL.to_vec(),
        Some(name) => vec![
            TableName::from_name(name).ok_or_else(|| CliError::UnknownTable {
                table: name.to_owned(),
                known: known(),
            })?,
        ],
    };
    if form == Form::Json {
        let object: Map<String, Value> = tables
            .iter()
            .map(|table| {
                let mut value = json!(table.schema());
                value["file"] = json!(file(*table));
                (table.as_str().to_owned(), value)
            })
            .collect();
        out.json(&Value::Object(object));
        return Ok(Exit::Done);
    }
    for table in tables {
        match form {
            Form::Markdown => write_markdown(out, table),
            _ => write_text(out, table),
        }
    }
    Ok(Exit::Done)
}

/// Where the file of a table is, below the folder of the run.
fn file(table: TableName) -> String {
    match table.schema().place {
        Place::Once => format!("once/{}", table.file_name()),
        Place::Iteration => format!("iterations/wear_iteration=K/{}", table.file_name()),
        Place::Beside => table.file_name(),
    }
}

fn write_text(out: &mut Results, table: TableName) {
    let schema = table.schema();
    let (name, version) = (&schema.name, schema.version);
    writeln!(out, "{name} (version {version}): {}", schema.description);
    writeln!(out, "    file     {}", file(table));
    writeln!(out, "    written  {}", schema.written);
    for column in &schema.columns {
        let notes = notes(column);
        let notes = if notes.is_empty() {
            String::new()
        } else {
            format!(" ({})", notes.join("; "))
        };
        writeln!(
            out,
            "    {:<24} [{}] {}, {}: {}{notes}",
            column.name,
            column.unit,
            column.kind,
            quantity(column),
            column.description
        );
    }
    writeln!(out);
}

fn write_markdown(out: &mut Results, table: TableName) {
    let schema: &Schema = table.schema();
    // A bar would end the cell.
    let cell = |text: &str| text.replace('|', "\\|");
    writeln!(out, "## `{}`\n", schema.name);
    writeln!(out, "{} Version {}.\n", schema.description, schema.version);
    writeln!(out, "- file: `{}`", file(table));
    writeln!(out, "- written: {}\n", schema.written);
    writeln!(out, "| column | unit | type | quantity | meaning | |");
    writeln!(out, "|---|---|---|---|---|---|");
    for column in &schema.columns {
        writeln!(
            out,
            "| `{}` | {} | {} | {} | {} | {} |",
            column.name,
            cell(&column.unit),
            column.kind,
            quantity(column),
            cell(&column.description),
            notes(column).join("; ")
        );
    }
    writeln!(out);
}

/// The dimension in words.
fn quantity(column: &ColumnSchema) -> String {
    column.dimension.replace('_', " ")
}

/// What else a reader has to know of a column.
fn notes(column: &ColumnSchema) -> Vec<&'static str> {
    [
        (column.optional, "where the scene has it"),
        (
            column.kind == ColumnType::MaybeF64,
            "null where there is none",
        ),
        (column.infinite, "may be infinite"),
        (column.sparse, "mostly 0"),
    ]
    .into_iter()
    .filter_map(|(holds, note)| holds.then_some(note))
    .collect()
}
