//! `fretwear doctor`.

use std::path::Path;

use fretwear::doctor::{self, State};
use fretwear::store::RealFileSystem;
use serde_json::json;

use super::run::cache_folder;
use super::{CliError, Exit};
use crate::terminal::Results;

/// Checks the machine and the given folder for runs, and prints the results of the checks.
pub fn doctor(folder: &Path, as_json: bool, out: &mut Results) -> Result<Exit, CliError> {
    let checks = doctor::examine(&RealFileSystem, folder, cache_folder().as_deref());
    let failed = checks.iter().any(|check| check.state == State::Failed);
    if as_json {
        out.json(&json!({ "folder": folder, "sound": !failed, "checks": checks }));
    } else {
        let width = checks.iter().map(|check| check.name.len()).max();
        let width = width.unwrap_or_default();
        for check in &checks {
            let state = match check.state {
                State::Ok => "ok",
                State::Warning => "warning",
                State::Failed => "failed",
            };
            let advice = check
                .advice
                .as_ref()
                .map_or_else(String::new, |advice| format!(" – {advice}"));
            writeln!(
                out,
                "{state:<8} {:<width$} {}{advice}",
                check.name, check.found
            );
        }
    }
    Ok(if failed { Exit::Failure } else { Exit::Done })
}
