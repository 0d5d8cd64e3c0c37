//! The build script: Rust types of the tables, from the schemas in `schemas/`, and the commit that is built.
//!
//! A schema is the one declaration of a table. What follows from it is written to `typed.rs` in the build's own folder: the names of
//! the tables, and a type for each whose fields are its columns. A table of one row has plain values, another one a vector a column;
//! an optional column is an `Option`. `src/tables/typed.rs` takes it in.

use std::fmt::Write;
use std::path::Path;
use std::process::Command;
use std::{env, fs};

/// The tables in the order in which they are told: as a run writes them, then those beside runs.
const TABLES: [&str; 41] = [
    "surface",
    "reference",
    "reference_element",
    "grid_twin",
    "contact_field",
    "static_contact",
    "wear_field",
    "wear_step",
    "coarse_field",
    "coarse_step",
    "indentation",
    "hysteresis",
    "cycle",
    "cycle_field",
    "fretting_cycle",
    "structure",
    "structure_port",
    "structure_mode",
    "structure_residual",
    "structure_damping",
    "structure_outline",
    "structure_outline_mode",
    "contact_element",
    "contact_slider",
    "model_update",
    "response",
    "dynamic_response",
    "resonance",
    "joint_cycle",
    "worn_response",
    "frf",
    "frf_harmonic",
    "ledger",
    "timing",
    "summary",
    "backbone",
    "trade",
    "claims",
    "campaign_figure",
    "campaign_band",
    "campaign_sensitivity",
];

fn main() {
    let root = env::var("CARGO_MANIFEST_DIR").expect("cargo says where the project is");
    let folder = Path::new(&root).join("schemas");
    println!("cargo::rerun-if-changed={}", folder.display());
    let schemas: Vec<Schema> = TABLES
        .iter()
        .map(|table| Schema::read(&folder.join(format!("{table}.toml"))))
        .collect();
    let mut code = names(&schemas);
    for schema in &schemas {
        code += &schema.typed();
    }
    let out = env::var("OUT_DIR").expect("cargo says where a build script writes");
    fs::write(Path::new(&out).join("typed.rs"), code).expect("the build's folder can be written");
    let mut version = env::var("CARGO_PKG_VERSION").expect("cargo says which version this is");
    if let Some(commit) = commit(Path::new(&root)) {
        println!("cargo::rustc-env=FRETWEAR_COMMIT={commit}");
        version += &format!(" ({commit})");
    }
    println!("cargo::rustc-env=FRETWEAR_VERSION={version}");
}

/// What the program is made of: with changes in them it is not the one of its commit.
const SOURCES: [&str; 4] = ["src", "schemas", "Cargo.toml", "Cargo.lock"];

/// The commit of the checkout that is built, with `-dirty` where its sources are changed; none of a package, or where there is no git.
/// Cargo calls again after a commit and after a change of the sources, which build the program anew in any case.
fn commit(root: &Path) -> Option<String> {
    let git = |arguments: &[&str]| {
        let done = Command::new("git")
            .args(arguments)
            .current_dir(root)
            .output()
            .ok()?;
        let text = String::from_utf8(done.stdout).ok()?;
        done.status.success().then(|| text.trim().to_owned())
    };
    // The sources of a package may lie within the checkout of something else.
    let top = fs::canonicalize(git(&["rev-parse", "--show-toplevel"])?).ok()?;
    if top != fs::canonicalize(root).ok()? {
        return None;
    }
    // A file that is not there would be a change at every build.
    for name in ["HEAD", "logs/HEAD"] {
        let path = root.join(git(&["rev-parse", "--git-path", name])?);
        if path.exists() {
            println!("cargo::rerun-if-changed={}", path.display());
        }
    }
    for source in SOURCES {
        println!("cargo::rerun-if-changed={}", root.join(source).display());
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"])?;
    let mut status = vec!["status", "--porcelain", "--"];
    status.extend(SOURCES);
    Some(match git(&status)?.is_empty() {
        true => commit,
        false => commit + "-dirty",
    })
}

struct Schema {
    path: String,
    name: String,
    description: String,
    one_row: bool,
    columns: Vec<Column>,
}

struct Column {
    name: String,
    kind: String,
    unit: String,
    description: String,
    optional: bool,
}

impl Schema {
    fn read(path: &Path) -> Schema {
        let text = fs::read_to_string(path)
            .unwrap_or_else(|error| panic!("{} cannot be read: {error}", path.display()));
        let parsed: toml::Table = text
            .parse()
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        let text = |table: &toml::Table, key: &str| match table.get(key).and_then(|v| v.as_str()) {
            Some(text) => text.to_owned(),
            None => panic!("{}: `{key}` must be a text", path.display()),
        };
        let columns = parsed["column"].as_array().into_iter().flatten();
        Schema {
            path: path.display().to_string(),
            name: text(&parsed, "name"),
            description: text(&parsed, "description"),
            one_row: parsed.get("rows").and_then(|rows| rows.as_integer()) == Some(1),
            columns: columns
                .filter_map(toml::Value::as_table)
                .map(|column| Column {
                    name: text(column, "name"),
                    kind: text(column, "type"),
                    unit: text(column, "unit"),
                    description: text(column, "description"),
                    optional: column.get("optional").and_then(|v| v.as_bool()) == Some(true),
                })
                .collect(),
        }
    }

    /// `contact_field` as `ContactField`.
    fn type_name(&self) -> String {
        let words = self.name.split('_');
        words
            .map(|word| word[..1].to_uppercase() + &word[1..])
            .collect()
    }

    /// The type with its way to a table and back.
    fn typed(&self) -> String {
        let (mut fields, mut to, mut from) = (String::new(), String::new(), String::new());
        for column in &self.columns {
            let Column { name, unit, .. } = column;
            let (value, get) = column.value();
            let of_type = match (self.one_row, column.optional) {
                (true, false) => value.to_owned(),
                (true, true) => format!("Option<{value}>"),
                (false, false) => format!("Vec<{value}>"),
                (false, true) => format!("Option<Vec<{value}>>"),
            };
            let description = doc(&column.description);
            let unit = match unit.as_str() {
                "1" => String::new(),
                unit => format!(" \\[{}\\]", doc(unit)),
            };
            writeln!(
                fields,
                "    /// {description}{unit}\n    pub {name}: {of_type},"
            )
            .unwrap();
            let (put, read) = match (self.one_row, column.optional) {
                (true, false) => (
                    format!(".column({name:?}, vec![self.{name}.clone()])"),
                    format!("table.{get}({name:?})?[0].clone()"),
                ),
                (true, true) => (
                    format!(
                        ".optional_column({name:?}, self.{name}.clone().map(|value| vec![value]))"
                    ),
                    format!(
                        "match table.has({name:?}) {{ true => Some(table.{get}({name:?})?[0].clone()), false => None }}"
                    ),
                ),
                (false, false) => (
                    format!(".column({name:?}, self.{name}.clone())"),
                    format!("table.{get}({name:?})?.to_vec()"),
                ),
                (false, true) => (
                    format!(".optional_column({name:?}, self.{name}.clone())"),
                    format!(
                        "match table.has({name:?}) {{ true => Some(table.{get}({name:?})?.to_vec()), false => None }}"
                    ),
                ),
            };
            writeln!(to, "            {put}").unwrap();
            writeln!(from, "            {name}: {read},").unwrap();
        }
        let (type_name, description) = (self.type_name(), doc(&self.description));
        format!(
            "/// {description}\n#[derive(Debug, Clone, PartialEq, Default)]\npub struct {type_name} {{\n{fields}}}\n\n\
             #[allow(clippy::clone_on_copy)]\nimpl TypedTable for {type_name} {{\n    \
             const TABLE: TableName = TableName::{type_name};\n\n    \
             fn to_table(&self) -> Result<Table, TableError> {{\n        Table::builder(Self::TABLE)\n{to}            .build()\n    }}\n\n    \
             fn of(table: &Table) -> Result<Self, TableError> {{\n        table.require(Self::TABLE)?;\n        Ok({type_name} {{\n{from}        }})\n    }}\n}}\n\n"
        )
    }
}

impl Column {
    /// The type of a value, and the method of a table that gives a column of them.
    fn value(&self) -> (&'static str, &'static str) {
        match self.kind.as_str() {
            "f64" => ("f64", "f64"),
            "f64?" => ("Option<f64>", "maybe_f64"),
            "i32" => ("i32", "i32"),
            "i64" => ("i64", "i64"),
            "bool" => ("bool", "bool"),
            "text" => ("String", "text"),
            other => panic!("column {}: there is no type {other:?}", self.name),
        }
    }
}

/// The enumeration of the tables, with the text of each schema.
fn names(schemas: &[Schema]) -> String {
    let (mut variants, mut all, mut sources) = (String::new(), String::new(), String::new());
    for schema in schemas {
        let name = schema.type_name();
        writeln!(
            variants,
            "    /// {}\n    {name},",
            doc(&schema.description)
        )
        .unwrap();
        writeln!(all, "        TableName::{name},").unwrap();
        writeln!(
            sources,
            "            TableName::{name} => include_str!({:?}),",
            schema.path
        )
        .unwrap();
    }
    let count = schemas.len();
    format!(
        "/// The tables of this version of the program.\n\
         #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]\npub enum TableName {{\n{variants}}}\n\n\
         impl TableName {{\n    /// All tables.\n    pub const ALL: [TableName; {count}] = [\n{all}    ];\n\n    \
         /// The text of the table's schema file.\n    pub fn source(self) -> &'static str {{\n        match self {{\n{sources}        }}\n    }}\n}}\n\n"
    )
}

/// A text as the line of a doc comment: brackets and angle brackets would be links and tags.
fn doc(text: &str) -> String {
    let mut line = String::new();
    for c in text.trim().chars() {
        if matches!(c, '[' | ']' | '<' | '>' | '*' | '_') {
            line.push('\\');
        }
        line.push(if c == '\n' { ' ' } else { c });
    }
    line
}
