//! `fretwear reproduce`.

use std::path::{Path, PathBuf};

use fretwear::recipe::Inputs;
use fretwear::report::{Report, RunTables};
use fretwear::scene::{self, Plan};
use fretwear::store::{FileSystem, RealFileSystem};
use fretwear::study::SCENES;
use fretwear::study::claims::{self, Finding};
use serde_json::json;

use super::arguments::ReproduceArguments;
use super::many::{self, Job};
use super::{CliError, Exit};
use crate::terminal::{Results, say};

/// Runs the paper's study, or the scenes of a folder, and holds the paper's claims against it.
pub fn reproduce(arguments: &ReproduceArguments, out: &mut Results) -> Result<Exit, CliError> {
    let folder = &arguments.dir;
    let scenes = match &arguments.scenes {
        Some(scenes) => many::scenes_in(scenes)?,
        None => shipped(&folder.join("scenes"))?,
    };
    let planned = scenes.iter().map(|path| {
        let scene = scene::load(path, &arguments.sets)?;
        let plan = Plan::of(&scene)?;
        Ok((scene.name, plan.inputs))
    });
    let planned: Vec<(String, Inputs)> = planned.collect::<Result<_, CliError>>()?;
    let jobs: Vec<Job> = planned
        .iter()
        .map(|(name, inputs)| Job {
            name,
            root: folder.join(name),
            inputs,
        })
        .collect();
    let ran = many::run_all(&arguments.execution, "scene", &jobs)?;
    if ran.stopped {
        say(&format!(
            "stopped after {} of {} scenes; the same command goes on",
            ran.ended.len(),
            jobs.len()
        ));
        return Ok(Exit::Stopped);
    }
    let runs = jobs
        .iter()
        .zip(&ran.ended)
        .filter(|(_, failure)| failure.is_none())
        .map(|(job, _)| RunTables::open(&job.root))
        .collect::<Result<Vec<_>, _>>()?;
    let findings = claims::evaluate(&runs)?;
    claims::write(&findings, &runs, folder)?;
    let page = folder.join("report.html");
    let mut report = Report::of(&runs)?;
    report.add(claims::section(&findings));
    report.replace(&page)?;
    print(&findings, arguments.json, out);
    if !arguments.execution.quiet {
        let page = page.display();
        say(&format!(
            "written: {page}, and beside it claims.md and claims.parquet"
        ));
    }
    match ran.ended.into_iter().flatten().next() {
        Some(error) => Err(error.into()),
        None => Ok(Exit::Done),
    }
}

fn print(findings: &[Finding], as_json: bool, out: &mut Results) {
    if as_json {
        out.json(&json!({ "claims": claims::CLAIMS.to_vec(), "findings": findings }));
    } else {
        write!(out, "{}", claims::markdown(findings));
    }
}

/// The shipped scenes, put where they can be read and changed. Those that are there already stay as they are.
fn shipped(folder: &Path) -> Result<Vec<PathBuf>, CliError> {
    let fs = RealFileSystem;
    fs.create_dir_all(folder).map_err(failed(folder))?;
    SCENES
        .iter()
        .map(|(name, text)| {
            let path = folder.join(format!("{name}.toml"));
            if fs.metadata(&path).map_err(failed(&path))?.is_none() {
                // A file that is there is whole.
                let draft = folder.join(format!("{name}.toml.{}", std::process::id()));
                fs.write_new(&draft, text.as_bytes())
                    .map_err(failed(&draft))?;
                fs.rename(&draft, &path).map_err(failed(&path))?;
            }
            Ok(path)
        })
        .collect()
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> CliError {
    let path = path.to_owned();
    move |source| CliError::Scenes { path, source }
}
