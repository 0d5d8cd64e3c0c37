//! `fretwear check`: all that is wrong with scenes, at once.

use std::path::Path;

use fretwear::scene::{self, MOST_FAULTS, Place, Plan, SceneError};
use serde_json::{Value, json};

use super::Exit;
use super::cost::too_large;
use crate::terminal::Results;

/// What is said of a scene.
struct Found {
    /// What keeps it from running: each in words, and for programs.
    errors: Vec<(String, Value)>,
    /// What its user should look at.
    warnings: Vec<String>,
    /// What is rare and may be meant.
    notes: Vec<String>,
}

/// Says of each scene what keeps it from running, and what is doubtful. Nothing is computed.
pub fn check(
    scenes: &[impl AsRef<Path>],
    sets: &[String],
    as_json: bool,
    out: &mut Results,
) -> Exit {
    let mut exit = Exit::Done;
    for path in scenes.iter().map(AsRef::as_ref) {
        let found = of_scene(path, sets);
        if !found.errors.is_empty() {
            exit = Exit::Scene;
        }
        if as_json {
            let errors = found.errors.into_iter().map(|(_, error)| error);
            out.json(&json!({
                "scene": path.display().to_string(),
                "errors": errors.collect::<Vec<Value>>(),
                "warnings": found.warnings,
                "notes": found.notes,
            }));
            continue;
        }
        for (error, _) in &found.errors {
            writeln!(out, "error: {error}");
        }
        if found.errors.len() >= MOST_FAULTS {
            writeln!(
                out,
                "the first {MOST_FAULTS} errors are shown; there may be more"
            );
        }
        for warning in &found.warnings {
            writeln!(out, "warning: {}: {warning}", path.display());
        }
        for note in &found.notes {
            writeln!(out, "note: {}: {note}", path.display());
        }
        let verdict = match (found.errors.len(), found.warnings.len()) {
            (0, 0) => "can be run".to_owned(),
            (0, warnings) => format!("can be run; {warnings} to look at"),
            (1, _) => "1 error".to_owned(),
            (errors, _) => format!("{errors} errors"),
        };
        writeln!(out, "{}: {verdict}", path.display());
    }
    exit
}

fn of_scene(path: &Path, sets: &[String]) -> Found {
    let alone = |text: String| {
        let error = json!({ "file": null, "line": null, "set": null, "key": null, "value": null, "message": text });
        Found {
            errors: vec![(text, error)],
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    };
    let scene = match scene::load(path, sets) {
        Ok(scene) => scene,
        Err(error) => {
            return Found {
                errors: error
                    .into_each()
                    .map(|e| (e.to_string(), told(&e)))
                    .collect(),
                warnings: Vec::new(),
                notes: Vec::new(),
            };
        }
    };
    match Plan::of(&scene) {
        Ok(mut plan) => {
            plan.warnings.extend(too_large(&plan.inputs));
            let remarks = plan.checks.iter().filter_map(|c| c.remark.clone());
            Found {
                errors: Vec::new(),
                notes: remarks.chain(plan.notices()).collect(),
                warnings: plan.warnings,
            }
        }
        Err(error) => alone(format!("{}: {error}", path.display())),
    }
}

/// A fault for programs.
fn told(fault: &SceneError) -> Value {
    let (key, value) = fault.problem.key_and_value();
    let (file, line, set) = match &fault.place {
        Place::File { path, line } => (Some(path.display().to_string()), *line, None),
        Place::Set(text) => (None, None, Some(text)),
    };
    json!({
        "file": file,
        "line": line,
        "set": set,
        "key": key,
        "value": value,
        "message": fault.problem.to_string(),
    })
}
