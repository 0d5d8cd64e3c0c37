//! `fretwear check`: errors and warnings of scenes.

use std::path::Path;

use fretwear::scene::{self, MOST_FAULTS, Place, Plan, SceneError};
use serde_json::{Value, json};

use super::Exit;
use super::cost::memory_warning;
use crate::terminal::Results;

/// Errors, warnings and notes on a scene.
struct SceneReport {
    /// Errors that keep the scene from running: each as a text, and as JSON.
    errors: Vec<(String, Value)>,
    /// Doubtful values, for the user to check.
    warnings: Vec<String>,
    /// Unusual values that may be intended.
    notes: Vec<String>,
}

/// Prints the errors, warnings and notes on each scene. Nothing is computed.
pub fn check(
    scenes: &[impl AsRef<Path>],
    sets: &[String],
    as_json: bool,
    out: &mut Results,
) -> Exit {
    let mut exit = Exit::Done;
    for path in scenes.iter().map(AsRef::as_ref) {
        let report = check_scene(path, sets);
        if !report.errors.is_empty() {
            exit = Exit::Scene;
        }
        if as_json {
            let errors = report.errors.into_iter().map(|(_, error)| error);
            out.json(&json!({
                "scene": path.display().to_string(),
                "errors": errors.collect::<Vec<Value>>(),
                "warnings": report.warnings,
                "notes": report.notes,
            }));
            continue;
        }
        for (error, _) in &report.errors {
            writeln!(out, "error: {error}");
        }
        if report.errors.len() >= MOST_FAULTS {
            writeln!(
                out,
                "the first {MOST_FAULTS} errors are shown; there may be more"
            );
        }
        for warning in &report.warnings {
            writeln!(out, "warning: {}: {warning}", path.display());
        }
        for note in &report.notes {
            writeln!(out, "note: {}: {note}", path.display());
        }
        let verdict = match (report.errors.len(), report.warnings.len()) {
            (0, 0) => "can be run".to_owned(),
            (0, warnings) => format!("can be run; warnings to check: {warnings}"),
            (1, _) => "1 error".to_owned(),
            (errors, _) => format!("{errors} errors"),
        };
        writeln!(out, "{}: {verdict}", path.display());
    }
    exit
}

fn check_scene(path: &Path, sets: &[String]) -> SceneReport {
    let single_error = |text: String| {
        let error = json!({ "file": null, "line": null, "set": null, "key": null, "value": null, "message": text });
        SceneReport {
            errors: vec![(text, error)],
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    };
    let scene = match scene::load(path, sets) {
        Ok(scene) => scene,
        Err(error) => {
            return SceneReport {
                errors: error
                    .into_each()
                    .map(|e| (e.to_string(), error_json(&e)))
                    .collect(),
                warnings: Vec::new(),
                notes: Vec::new(),
            };
        }
    };
    match Plan::of(&scene) {
        Ok(mut plan) => {
            plan.warnings.extend(memory_warning(&plan.inputs));
            let remarks = plan.checks.iter().filter_map(|c| c.remark.clone());
            SceneReport {
                errors: Vec::new(),
                notes: remarks.chain(plan.notices()).collect(),
                warnings: plan.warnings,
            }
        }
        Err(error) => single_error(format!("{}: {error}", path.display())),
    }
}

/// Converts a scene error to JSON.
fn error_json(fault: &SceneError) -> Value {
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
