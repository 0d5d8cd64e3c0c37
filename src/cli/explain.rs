//! `fretwear explain`.

use fretwear::scene::explain::{self, About, KeyAbout, SectionAbout};
use serde_json::{Map, Value, json};

use super::{CliError, Exit};
use crate::terminal::Results;

/// Prints all that there is to say on a key, or the keys of a section.
pub fn explain(name: &str, json: bool, out: &mut Results) -> Result<Exit, CliError> {
    match explain::explain(name)? {
        About::Key(key) if json => out.json(&with_name(&key)),
        About::Key(key) => write_key(&key, out),
        About::Section(section) if json => {
            let keys = section.keys.iter();
            let keys: Map<String, Value> =
                keys.map(|key| (key.key.to_owned(), json!(key))).collect();
            out.json(
                &json!({ "section": section.section, "meaning": section.meaning, "keys": keys }),
            );
        }
        About::Section(section) => {
            write_heading(out);
            write_section(&section, out);
        }
    }
    Ok(Exit::Done)
}

fn with_name(key: &KeyAbout) -> Value {
    let mut object = json!(key);
    object["key"] = json!(key.key);
    object
}

fn write_key(key: &KeyAbout, out: &mut Results) {
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

/// The columns of [`write_section`].
pub fn write_heading(out: &mut Results) {
    writeln!(out, "    {:<24}type; default", "key");
    writeln!(
        out,
        "        meaning, in short; the whole of it: fretwear explain KEY\n"
    );
}

/// One line a key with its type and default, and one with its meaning in short.
pub fn write_section(section: &SectionAbout, out: &mut Results) {
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
