//! `fretwear schema`.

use fretwear::scene::explain;
use fretwear::tables::{ColumnSchema, ColumnType, Place, Schema, TableName};
use serde_json::{Map, Value, json};

use super::{
    CliError, Exit,
    explain::{write_heading, write_section},
};
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
    /// For an editor.
    JsonSchema,
}

impl Form {
    /// That of the flags.
    pub fn of(markdown: bool, json: bool, json_schema: bool) -> Form {
        let flags = [
            (markdown, Form::Markdown),
            (json, Form::Json),
            (json_schema, Form::JsonSchema),
        ];
        let given = flags.into_iter().find(|flag| flag.0);
        given.map_or(Form::Text, |flag| flag.1)
    }
}

/// Prints what a table, or every table, is: its file, when it is written, and its columns.
pub fn schema(table: Option<&str>, form: Form, out: &mut Results) -> Result<Exit, CliError> {
    if table == Some("scene") {
        write_scene(form, out);
        return Ok(Exit::Done);
    }
    if form == Form::JsonSchema {
        return Err(CliError::NoJsonSchema);
    }
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

/// The keys of a scene by sections.
fn write_scene(form: Form, out: &mut Results) {
    let sections = explain::sections();
    match form {
        Form::Text => {
            write_heading(out);
            for section in &sections {
                write_section(section, out);
                writeln!(out);
            }
        }
        Form::Markdown => {
            for section in &sections {
                let name = match section.section.as_str() {
                    "" => "top",
                    name => name,
                };
                writeln!(out, "## `{name}`\n\n{}\n", section.meaning);
                writeln!(out, "| key | type | default | meaning |\n|---|---|---|---|");
                for key in &section.keys {
                    let cells = [&key.kind, &key.default, &key.meaning].map(|text| cell(text));
                    writeln!(out, "| `{}` | {} |", key.key, cells.join(" | "));
                }
                writeln!(out);
            }
        }
        Form::Json => {
            let keys = sections.iter().flat_map(|section| &section.keys);
            let object: Map<String, Value> =
                keys.map(|key| (key.key.to_owned(), json!(key))).collect();
            out.json(&Value::Object(object));
        }
        Form::JsonSchema => writeln!(out, "{:#}", explain::json_schema()),
    }
}

/// Text in a cell of Markdown, which a bar would end.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
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
