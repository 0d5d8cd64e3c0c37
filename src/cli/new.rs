//! `fretwear new`: writes a new scene based on a shipped scene.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use fretwear::report::shell_word;
use fretwear::scene::{self, SceneError};
use serde_json::json;

use super::{CliError, Exit, edit};
use crate::terminal::{Results, is_asking};

/// Name, description and text of a shipped scene; the text includes all comments.
struct Example {
    name: &'static str,
    about: &'static str,
    text: &'static str,
}

macro_rules! example {
    ($name:literal, $about:literal) => {
        Example {
            name: $name,
            about: $about,
            text: include_str!(concat!("../../pipelines/", $name, ".toml")),
        }
    };
}

/// Scenes that need no other file, the quickest first.
const EXAMPLES: [Example; 6] = [
    example!(
        "static_contact",
        "pressure, area and stiffness of a rough joint; seconds"
    ),
    example!(
        "prescribed_fretting",
        "wear of a rough joint under a given motion; seconds"
    ),
    example!(
        "hertz_fretting",
        "a sphere in partial slip, for comparison with closed forms; seconds"
    ),
    example!(
        "oscillator",
        "one mass on one contact element, no wear; seconds"
    ),
    example!(
        "resonator_springs",
        "the bolted resonator with given contact stiffness, no wear; a minute"
    ),
    example!(
        "lap_joint",
        "vibration and wear of the bolted resonator, coupled; minutes"
    ),
];

/// Scene that is used without `--like`.
const FIRST: &str = "prescribed_fretting";

/// Writes a commented scene that runs, with the requested values. Writes nothing if a value is wrong.
pub fn new(
    path: &Path,
    like: Option<&str>,
    sets: &[String],
    out: &mut Results,
) -> Result<Exit, CliError> {
    let is_asked = like.is_none() && sets.is_empty() && is_asking();
    let like = like.unwrap_or(FIRST);
    let Some(example) = EXAMPLES.iter().find(|example| example.name == like) else {
        let names: Vec<&str> = EXAMPLES.iter().map(|example| example.name).collect();
        return Err(CliError::UnknownExample {
            like: like.to_owned(),
            known: names.join(", "),
        });
    };
    let path = match path.extension() {
        Some(_) => path.to_owned(),
        None => path.with_extension("toml"),
    };
    let write_error = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => CliError::SceneExists { path: path.clone() },
        _ => CliError::NewScene {
            path: path.clone(),
            source,
        },
    };
    // Check whether the file exists before the program asks for values.
    if path.exists() {
        return Err(write_error(io::ErrorKind::AlreadyExists.into()));
    }
    let setting = |set: &String| match set.split_once('=') {
        Some((key, value)) => format!("{key}={}", edit::normalize_answer(key.trim(), value)),
        None => set.clone(),
    };
    let mut sets: Vec<String> = sets.iter().map(setting).collect();
    if is_asked {
        sets = edit::ask_for_values(example.text, |sets| fault(example, &path, sets));
    }
    let text = edited_text(example, &path, &sets)?;
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        fs::create_dir_all(folder).map_err(write_error)?;
    }
    // Never replace an existing file.
    let file = OpenOptions::new().write(true).create_new(true).open(&path);
    let written = file.and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(write_error)?;
    let name = shell_word(&path);
    writeln!(out, "{name}: {}", example.about);
    writeln!(
        out,
        "  change it:        its comments explain each key; fretwear schema KEY has details"
    );
    writeln!(out, "  what it will do:  fretwear plan {name}");
    writeln!(out, "  run it:           fretwear run {name}");
    Ok(Exit::Done)
}

/// Returns the text of a scene with other values, and checks each value.
fn edited_text(example: &Example, path: &Path, sets: &[String]) -> Result<String, CliError> {
    let (shipped, sets) = without_hole(example, sets);
    let has_no_hole = shipped != example.text;
    if has_no_hole && example.text.contains("kind = \"resonator\"") {
        return Err(CliError::HoleRequired {
            like: example.name.to_owned(),
        });
    }
    scene::load_kept(path, &shipped, &sets)?;
    let mut text = shipped;
    for set in &sets {
        // Loading has rejected settings without `=`.
        let (key, value) = set.split_once('=').unwrap_or((set, ""));
        let edited = edit::replace_value(&text, key.trim(), value.trim());
        text = edited.ok_or_else(|| CliError::NoLine {
            key: key.trim().to_owned(),
            like: example.name.to_owned(),
        })?;
    }
    let keys = sets.iter().filter_map(|set| set.split_once('='));
    let mut keys: Vec<&str> = keys.map(|(key, _)| key.trim()).collect();
    keys.extend(has_no_hole.then_some("joint.hole"));
    let mut seen_keys = BTreeSet::new();
    keys.retain(|key| seen_keys.insert(*key));
    let resizes = ["joint.size", "surface.correlation_length"];
    if keys.iter().any(|key| resizes.contains(key))
        && !keys.contains(&"joint.grid")
        && let Some([x, y]) = edit::fitting_grid(example.text, &text)
    {
        text = edit::replace_value(&text, "joint.grid", &format!("[{x}, {y}]")).unwrap_or(text);
        scene::load_kept(path, &text, &[])?;
    }
    if let (false, Some(stem)) = (keys.is_empty() || keys.contains(&"title"), path.file_stem()) {
        let title = json!(stem.to_string_lossy()).to_string();
        text = edit::replace_value(&text, "title", &title).unwrap_or(text);
    }
    Ok(with_heading(example, path, &text, &keys))
}

/// Removes the hole from the text of a scene if a setting requests it. Returns the text and all other settings.
fn without_hole(example: &Example, sets: &[String]) -> (String, Vec<String>) {
    let is_no_hole = |set: &&String| set.as_str() == "joint.hole=";
    let text = match sets.iter().any(|set| is_no_hole(&set)) {
        true => edit::remove_key(example.text, "joint.hole"),
        false => example.text.to_owned(),
    };
    let others = sets.iter().filter(|set| !is_no_hole(set)).cloned();
    (text, others.collect())
}

/// Adds a heading to the text. If no key has changed, the text keeps the heading of the shipped scene. If keys have
/// changed, the heading lists the changed keys. The heading of every scene shows the command that runs the scene.
fn with_heading(example: &Example, path: &Path, text: &str, changed: &[&str]) -> String {
    let name = example.name;
    let command = format!("fretwear run {}", shell_word(path));
    if changed.is_empty() {
        let shipped = format!("fretwear run pipelines/{name}.toml");
        let text = text.replacen(&shipped, &command, 1);
        return format!(
            "# The scene {name} that is shipped with fretwear. The sources and results below refer to the\n# shipped scene.\n#\n{text}"
        );
    }
    let body = edit::remove_heading(text);
    format!(
        "# A new joint, based on the scene {name} that is shipped with fretwear.\n#\n#     {command}\n#\n\
         # Changed keys: {}. Every other value is from the shipped scene: check that it suits your joint.\n\n{body}",
        changed.join(", ")
    )
}

/// Returns the error of the last value. Returns `None` if the error concerns values that are still to come.
fn fault(example: &Example, path: &Path, sets: &[String]) -> Option<String> {
    let (text, sets) = without_hole(example, sets);
    let error = scene::load_kept(path, &text, &sets).err()?;
    let last = sets.last()?;
    let key = last.split('=').next().unwrap_or(last);
    let concerns_last = |error: &SceneError| {
        let (fault_key, _) = error.problem.key_and_value();
        fault_key.is_none_or(|fault_key| fault_key.starts_with(key))
    };
    error
        .into_each()
        .find(concerns_last)
        .map(|error| error.problem.to_string())
}

/// Lists the shipped scenes, for the help.
pub fn examples() -> String {
    let lines = EXAMPLES
        .iter()
        .map(|example| format!("  {:<20} {}", example.name, example.about));
    format!(
        "Scenes to start from:\n{}",
        lines.collect::<Vec<String>>().join("\n")
    )
}
