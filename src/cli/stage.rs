//! `fretwear stage`: computes a stage of a committed iteration again.

use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use fretwear::scene::Plan;
use fretwear::stages::{FREE_KEYS, RunError, recompute};
use fretwear::store::{Layout, RealFileSystem, RunReader, StoreError};
use fretwear::tables::{Provenance, to_parquet};
use serde_json::json;

use super::arguments::{StageArguments, threads_or_cores};
use super::run::scene_of_run;
use super::{CliError, Exit};
use crate::progress::Watcher;
use crate::terminal::Results;

pub fn stage(arguments: &StageArguments, out: &mut Results) -> Result<Exit, CliError> {
    let run = &arguments.run.run;
    let wear_iteration = arguments.run.wear_iteration;
    let reader = RunReader::open(Arc::new(RealFileSystem), run)?;
    let Some(scene) = scene_of_run(run, &[])? else {
        return Err(StoreError::NoRun { path: run.clone() }.into());
    };
    let inputs = Plan::of(&scene)?.inputs;
    reader.require_scene(&inputs.identity.scene, &FREE_KEYS)?;
    // Report a damaged or missing iteration, and an output folder inside a run, before computing.
    let damage = reader
        .reports()
        .iter()
        .filter(|r| r.wear_iteration == wear_iteration);
    if let Some(damage) = damage.flat_map(|report| &report.damage).next() {
        return Err(StoreError::Damaged(damage.clone()).into());
    }
    reader.commit_of(wear_iteration)?;
    if let Some(folder) = &arguments.output {
        require_outside_runs(folder)?;
    }
    let watcher = Watcher::new(&inputs.recipe, run, arguments.json);
    let begin = Instant::now();
    let stage = arguments.name;
    let threads = threads_or_cores(arguments.threads);
    let result = recompute(&reader, &inputs, stage, wear_iteration, threads, &watcher);
    watcher.finish();
    let recomputed = result?;
    let seconds = begin.elapsed().as_secs_f64();
    if let Some(folder) = &arguments.output {
        let provenance = Provenance {
            scene_hash: reader.record().scene_hash.clone(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        for (name, table) in &recomputed.tables {
            let bytes = to_parquet(table, &provenance).map_err(RunError::from)?;
            write(folder, &name.file_name(), &bytes)?;
        }
    }
    let differs: Vec<&str> = recomputed
        .same
        .iter()
        .filter(|(_, same)| !**same)
        .map(|(name, _)| name.as_str())
        .collect();
    if arguments.json {
        out.json(&json!({
            "stage": stage.name(),
            "wear_iteration": wear_iteration,
            "seconds": seconds,
            "tables": recomputed.tables.keys().map(|n| n.as_str()).collect::<Vec<_>>(),
            "same": recomputed.same.iter().map(|(n, same)| (n.as_str().to_owned(), json!(same))).collect::<serde_json::Map<_, _>>(),
        }));
    } else {
        let run = run.display();
        writeln!(
            out,
            "{stage} of iteration {wear_iteration} of {run}, computed again in {seconds:.2} s"
        );
        for name in recomputed.tables.keys() {
            let verdict = match recomputed.same.get(name) {
                Some(true) => "the same bits as in the run",
                Some(false) => "NOT the same as in the run",
                None => "not in the run: it was not due, or a later stage overwrote it",
            };
            writeln!(out, "  {:<20} {verdict}", name.as_str());
        }
    }
    match differs.is_empty() {
        true => Ok(Exit::Done),
        false => Err(CliError::StageDiffers {
            stage,
            wear_iteration,
            tables: differs.join(", "),
        }),
    }
}

/// Creates the output folder, and rejects a folder inside a run, whose files are committed.
fn require_outside_runs(folder: &Path) -> Result<(), CliError> {
    let export_error = |source| CliError::Export {
        path: folder.to_owned(),
        source,
    };
    fs::create_dir_all(folder).map_err(export_error)?;
    let resolved = fs::canonicalize(folder).map_err(export_error)?;
    match resolved
        .ancestors()
        .find(|above| Layout::at(above).has_record())
    {
        Some(run) => Err(CliError::WithinARun {
            path: folder.to_owned(),
            run: run.to_owned(),
        }),
        None => Ok(()),
    }
}

/// Writes a file that must not exist yet.
fn write(folder: &Path, file: &str, bytes: &[u8]) -> Result<(), CliError> {
    let path = folder.join(file);
    let written = fs::File::create_new(&path).and_then(|mut file| file.write_all(bytes));
    written.map_err(|source| CliError::Export { path, source })
}
