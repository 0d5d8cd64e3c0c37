//! `fretwear schema`.

use fretwear::scene::explain::{self, About, KeyDescription, SectionAbout};
use fretwear::store::table_file;
use fretwear::tables::{ColumnSchema, ColumnType, Schema, TableName};
use serde_json::{Map, Value, json};

use super::{CliError, Exit};
use crate::terminal::Results;

/// Output form of schemas.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Form {
    /// Text for a terminal.
    Text,
    /// Markdown for documentation.
    Markdown,
    /// JSON for a program.
    Json,
    /// JSON Schema for an editor.
    JsonSchema,
}

impl Form {
    /// Returns the form that the flags select.
    pub fn of(markdown: bool, json: bool, json_schema: bool) -> Form {
        let flags = [
            (markdown, Form::Markdown),
            (json, Form::Json),
            (json_schema, Form::JsonSchema),
        ];
        let selected_flag = flags.into_iter().find(|flag| flag.0);
        selected_flag.map_or(Form::Text, |flag| flag.1)
    }
}

/// Prints a table, a key or a section; for any other word, the keys and columns that mention it.
pub fn schema(word: Option<&str>, form: Form, out: &mut Results) -> Result<Exit, CliError> {
    let Some(word) = word.filter(|word| *word != "scene") else {
        match (word, form) {
            (Some(_), _) => write_scene(form, out),
            (None, Form::JsonSchema) => return Err(CliError::NoJsonSchema),
            (None, Form::Json) => out.json(&Value::Object(tables_json(&TableName::ALL))),
            (None, _) => TableName::ALL
                .iter()
                .for_each(|table| write_table(*table, form, out)),
        }
        return Ok(Exit::Done);
    };
    if form == Form::JsonSchema {
        return Err(CliError::NoJsonSchema);
    }
    let table = TableName::from_name(word);
    let about = explain::explain(word);
    if let (None, Err(unknown)) = (table, &about) {
        let results = SearchResult::column(word).unwrap_or_else(|| SearchResult::of(word));
        if unknown.is_former || results.is_empty() {
            return Err(CliError::UnknownWord(unknown.clone()));
        }
        results.write(word, form, out);
        return Ok(Exit::Done);
    }
    let about = about.ok();
    if form == Form::Json {
        let mut object = table.map_or_else(Map::new, |table| tables_json(&[table]));
        object.extend(about.as_ref().map_or_else(Map::new, about_json));
        out.json(&Value::Object(object));
        return Ok(Exit::Done);
    }
    if let Some(table) = table {
        write_table(table, form, out);
    }
    match about {
        None => (),
        Some(About::Section(section)) if form == Form::Markdown => section_markdown(&section, out),
        Some(About::Section(section)) => {
            write_heading(out);
            write_section(&section, out);
        }
        Some(About::Key(key)) => write_key(&key, out),
    }
    Ok(Exit::Done)
}

/// Keys and columns that mention a word.
struct SearchResult {
    keys: Vec<KeyDescription>,
    columns: Vec<(TableName, &'static ColumnSchema)>,
}

impl SearchResult {
    /// Entries whose name or text contains every part of the words, ignoring case.
    fn of(words: &str) -> SearchResult {
        let words = words.to_lowercase();
        let mentions = |texts: &[&str]| {
            let text = texts.join(" ").to_lowercase();
            words.split_whitespace().all(|word| text.contains(word))
        };
        let sections = explain::sections().into_iter();
        let keys = sections.flat_map(|section| section.keys);
        let columns = TableName::ALL.into_iter().flat_map(|table| {
            let columns = table.schema().columns.iter();
            columns.map(move |column| (table, column))
        });
        SearchResult {
            keys: keys
                .filter(|key| mentions(&[key.key, &key.meaning]))
                .collect(),
            columns: columns
                .filter(|(_, column)| mentions(&[&column.name, &column.description]))
                .collect(),
        }
    }

    /// Finds the column of a name `TABLE.COLUMN`, as the search prints it.
    fn column(name: &str) -> Option<SearchResult> {
        let (table, column) = name.split_once('.')?;
        let table = TableName::from_name(table)?;
        let mut columns = table.schema().columns.iter();
        let column_schema = columns.find(|candidate| candidate.name == column)?;
        Some(SearchResult {
            keys: Vec::new(),
            columns: vec![(table, column_schema)],
        })
    }

    fn is_empty(&self) -> bool {
        self.keys.is_empty() && self.columns.is_empty()
    }

    fn write(&self, word: &str, form: Form, out: &mut Results) {
        let name =
            |(table, column): &(TableName, &ColumnSchema)| format!("{table}.{}", column.name);
        if form == Form::Json {
            let keys = self.keys.iter().map(|key| (key.key.to_owned(), json!(key)));
            let columns = self
                .columns
                .iter()
                .map(|entry| (name(entry), json!(entry.1)));
            let [keys, columns] = [keys.collect(), columns.collect()].map(Value::Object);
            out.json(&json!({ "word": word, "keys": keys, "columns": columns }));
            return;
        }
        if !self.keys.is_empty() {
            writeln!(
                out,
                "keys that mention {word} (details: fretwear schema KEY)"
            );
        }
        for key in &self.keys {
            writeln!(out, "    {:<32} {}", key.key, key.summary());
        }
        if !self.columns.is_empty() {
            writeln!(
                out,
                "columns that mention {word} (details: fretwear schema TABLE)"
            );
        }
        for entry in &self.columns {
            let (unit, description) = (&entry.1.unit, &entry.1.description);
            writeln!(out, "    {:<32} [{unit}] {description}", name(entry));
        }
    }
}

fn tables_json(tables: &[TableName]) -> Map<String, Value> {
    let object = |table: &TableName| {
        let mut value = json!(table.schema());
        value["file"] = json!(table_file(*table, "K"));
        (table.as_str().to_owned(), value)
    };
    tables.iter().map(object).collect()
}

fn about_json(about: &About) -> Map<String, Value> {
    let object = match about {
        About::Key(key) => {
            let mut object = json!(key);
            object["key"] = json!(key.key);
            object
        }
        About::Section(section) => {
            let keys = section.keys.iter();
            let keys: Map<String, Value> =
                keys.map(|key| (key.key.to_owned(), json!(key))).collect();
            json!({ "section": section.section, "meaning": section.meaning, "keys": keys })
        }
    };
    object.as_object().cloned().unwrap_or_default()
}

fn write_table(table: TableName, form: Form, out: &mut Results) {
    match form {
        Form::Markdown => write_markdown(out, table),
        _ => write_text(out, table),
    }
}

/// Prints the keys of a scene by sections.
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
                section_markdown(section, out);
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

fn section_markdown(section: &SectionAbout, out: &mut Results) {
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

fn write_key(key: &KeyDescription, out: &mut Results) {
    writeln!(out, "{}\n\n{}\n", key.key, key.meaning);
    for (what, text) in [
        ("type", key.kind.clone()),
        ("default", key.default.clone()),
        ("example", key.example.clone()),
        ("only", key.only.join(", ")),
        ("instead of", key.instead.join(", ")),
    ] {
        if !text.is_empty() {
            writeln!(out, "    {what:<12}{text}");
        }
    }
    let words = key.choices.iter().map(|choice| choice.word.len());
    let width = words.max().unwrap_or(0) + 4;
    for choice in &key.choices {
        writeln!(
            out,
            "    {:<12}{:<width$}{}",
            "",
            format!("\"{}\"", choice.word),
            choice.meaning
        );
    }
}

/// Prints the heading of [`write_section`].
fn write_heading(out: &mut Results) {
    writeln!(out, "    {:<24}type; default", "key");
    writeln!(
        out,
        "        short meaning (full text: fretwear schema KEY)\n"
    );
}

/// Prints two lines per key: type and default, then the short meaning.
fn write_section(section: &SectionAbout, out: &mut Results) {
    match section.section.as_str() {
        "" => writeln!(out, "{}", section.meaning),
        name => writeln!(out, "[{name}] {}", section.meaning),
    }
    for key in &section.keys {
        let below = key.key.strip_prefix(&section.section);
        let name = match below.map(|name| name.trim_start_matches('.')) {
            None | Some("") => key.key,
            Some(name) => name,
        };
        writeln!(out, "    {name:<23} {}; {}", key.kind, key.default);
        if key.meaning != section.meaning {
            writeln!(out, "        {}", key.summary());
        }
    }
}

/// Escapes bars, which would end a Markdown cell.
fn cell(text: &str) -> String {
    text.replace('|', "\\|")
}

fn write_text(out: &mut Results, table: TableName) {
    let schema = table.schema();
    writeln!(out, "{}: {}", schema.name, schema.description);
    writeln!(out, "    file     {}", table_file(table, "K"));
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
    writeln!(out, "{}\n", schema.description);
    writeln!(out, "- file: `{}`", table_file(table, "K"));
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

/// Returns the dimension of a column in words.
fn quantity(column: &ColumnSchema) -> String {
    column.dimension.replace('_', " ")
}

/// Returns further notes on a column.
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
    .filter_map(|(applies, note)| applies.then_some(note))
    .collect()
}
