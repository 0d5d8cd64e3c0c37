//! `fretwear new`: where a scene of one's own begins.

use std::collections::BTreeSet;
use std::fs::{self, OpenOptions};
use std::io::{self, Write};
use std::path::Path;

use fretwear::report::word;
use fretwear::scene::{self, SceneError};
use serde_json::json;

use super::{CliError, Exit, edit};
use crate::terminal::{Results, is_asking};

/// A scene to begin from: its name, what it is, and its text with all comments.
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

/// Scenes that need no file beside them, the quickest first.
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
        "a sphere in partial slip, with closed forms beside it; seconds"
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

/// What one begins from who does not say.
const FIRST: &str = "prescribed_fretting";

/// Writes a commented scene that runs, with what is asked for in place of its own values. Nothing is written where one of them is wrong.
pub fn new(
    path: &Path,
    like: Option<&str>,
    sets: &[String],
    out: &mut Results,
) -> Result<Exit, CliError> {
    let is_asked = like.is_none() && sets.is_empty() && is_asking();
    let like = like.unwrap_or(FIRST);
    let Some(example) = EXAMPLES.iter().find(|example| example.name == like) else {
        let known: Vec<&str> = EXAMPLES.iter().map(|example| example.name).collect();
        return Err(CliError::UnknownExample {
            like: like.to_owned(),
            known: known.join(", "),
        });
    };
    let path = match path.extension() {
        Some(_) => path.to_owned(),
        None => path.with_extension("toml"),
    };
    let failed = |source: io::Error| match source.kind() {
        io::ErrorKind::AlreadyExists => CliError::SceneIsThere { path: path.clone() },
        _ => CliError::NewScene {
            path: path.clone(),
            source,
        },
    };
    // Before anything is asked.
    if path.exists() {
        return Err(failed(io::ErrorKind::AlreadyExists.into()));
    }
    let said = |set: &String| match set.split_once('=') {
        Some((key, value)) => format!("{key}={}", edit::meant(key.trim(), value)),
        None => set.clone(),
    };
    let mut sets: Vec<String> = sets.iter().map(said).collect();
    if is_asked {
        sets = edit::asked(example.text, |sets| fault(example, &path, sets));
    }
    let text = changed(example, &path, &sets)?;
    if let Some(folder) = path
        .parent()
        .filter(|folder| !folder.as_os_str().is_empty())
    {
        fs::create_dir_all(folder).map_err(failed)?;
    }
    // What somebody has written is never replaced.
    let file = OpenOptions::new().write(true).create_new(true).open(&path);
    let written = file.and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(failed)?;
    let name = word(&path);
    writeln!(out, "{name}: {}", example.about);
    writeln!(
        out,
        "  change it:        its comments say what each key is; fretwear schema KEY says more"
    );
    writeln!(out, "  what it will do:  fretwear plan {name}");
    writeln!(out, "  run it:           fretwear run {name}");
    Ok(Exit::Done)
}

/// The text of a scene with other values, each of which is one that its key can have.
fn changed(example: &Example, path: &Path, sets: &[String]) -> Result<String, CliError> {
    let (shipped, sets) = without_hole(example, sets);
    let has_no_hole = shipped != example.text;
    if has_no_hole && example.text.contains("kind = \"resonator\"") {
        return Err(CliError::HoleStays {
            like: example.name.to_owned(),
        });
    }
    scene::load_kept(path, &shipped, &sets)?;
    let mut text = shipped;
    for set in &sets {
        // One without `=` is refused above.
        let (key, value) = set.split_once('=').unwrap_or((set, ""));
        let edited = edit::with(&text, key.trim(), value.trim());
        text = edited.ok_or_else(|| CliError::NoLine {
            key: key.trim().to_owned(),
            like: example.name.to_owned(),
        })?;
    }
    let keys = sets.iter().filter_map(|set| set.split_once('='));
    let mut keys: Vec<&str> = keys.map(|(key, _)| key.trim()).collect();
    keys.extend(has_no_hole.then_some("joint.hole"));
    let mut named = BTreeSet::new();
    keys.retain(|key| named.insert(*key));
    let resizes = ["joint.size", "surface.correlation_length"];
    if keys.iter().any(|key| resizes.contains(key))
        && !keys.contains(&"joint.grid")
        && let Some([x, y]) = edit::fitting_grid(example.text, &text)
    {
        text = edit::with(&text, "joint.grid", &format!("[{x}, {y}]")).unwrap_or(text);
        scene::load_kept(path, &text, &[])?;
    }
    if let (false, Some(stem)) = (keys.is_empty() || keys.contains(&"title"), path.file_stem()) {
        let title = json!(stem.to_string_lossy()).to_string();
        text = edit::with(&text, "title", &title).unwrap_or(text);
    }
    Ok(headed(example, path, &text, &keys))
}

/// The text of a scene without its hole, where that is asked for, and what else is.
fn without_hole(example: &Example, sets: &[String]) -> (String, Vec<String>) {
    let is_no_hole = |set: &&String| set.as_str() == "joint.hole=";
    let text = match sets.iter().any(|set| is_no_hole(&set)) {
        true => edit::without(example.text, "joint.hole"),
        false => example.text.to_owned(),
    };
    let others = sets.iter().filter(|set| !is_no_hole(set)).cloned();
    (text, others.collect())
}

/// The text under a head that says what it is: of a scene as it is shipped all of its own head, of one with other values what these are, with the
/// command that runs it.
fn headed(example: &Example, path: &Path, text: &str, changed: &[&str]) -> String {
    let name = example.name;
    let own = format!("fretwear run {}", word(path));
    if changed.is_empty() {
        let shipped = format!("fretwear run pipelines/{name}.toml");
        let text = text.replacen(&shipped, &own, 1);
        return format!(
            "# The scene {name} that is shipped with fretwear. What is said below of sources and results is said of\n# the shipped one.\n#\n{text}"
        );
    }
    let body = edit::without_head(text);
    format!(
        "# A joint of its own, begun from the scene {name} that is shipped with fretwear.\n#\n#     {own}\n#\n\
         # Its own are {}. Every other value is that of the shipped scene: look whether it is that of your joint.\n\n{body}",
        changed.join(", ")
    )
}

/// What is wrong with the last of these values; none where that shows only with others that are still to come.
fn fault(example: &Example, path: &Path, sets: &[String]) -> Option<String> {
    let (text, sets) = without_hole(example, sets);
    let error = scene::load_kept(path, &text, &sets).err()?;
    let last = sets.last()?;
    let key = last.split('=').next().unwrap_or(last);
    let is_of_last = |error: &SceneError| {
        let (of, _) = error.problem.key_and_value();
        of.is_none_or(|of| of.starts_with(key))
    };
    error
        .into_each()
        .find(is_of_last)
        .map(|error| error.problem.to_string())
}

/// What `fretwear new` can begin from.
pub fn examples() -> String {
    let lines = EXAMPLES
        .iter()
        .map(|example| format!("  {:<20} {}", example.name, example.about));
    format!(
        "Scenes to begin from:\n{}",
        lines.collect::<Vec<String>>().join("\n")
    )
}
