//! `fretwear reproduce`.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

use fretwear::recipe::Inputs;
use fretwear::report::{Report, RunTables};
use fretwear::scene::{self, Plan};
use fretwear::store::{FileSystem, RealFileSystem};
use fretwear::study::claims::{self, Evidence, Finding};
use fretwear::study::{BASE, JOINT_SCENES, LAW_INDEPENDENT_SCENES, Law, ShippedScene};
use serde_json::json;

use super::arguments::{Execution, ReproduceArguments};
use super::at_once::{Command, run_at_once};
use super::many::{self, Job};
use super::{CliError, Exit};
use crate::terminal::{Results, say};

/// Scene of the study: name of its run, and path of its file.
struct Scene {
    name: String,
    path: PathBuf,
    /// True if `--set` applies to the scene. `--set` changes keys of the joint. Scenes of another contact lack the keys
    /// of the joint, so `--set` does not apply to such scenes.
    is_set: bool,
}

/// Runs the paper's study, or the scenes of a folder, and checks the paper's claims.
pub fn reproduce(arguments: &ReproduceArguments, out: &mut Results) -> Result<Exit, CliError> {
    let folder = &arguments.dir;
    let scenes = match &arguments.scenes {
        Some(scenes) => scenes_named_by_file(many::scenes_in(scenes)?),
        None => write_shipped(&folder.join("scenes"), arguments.law.laws())?,
    };
    let planned = scenes.iter().map(|scene| {
        let sets = if scene.is_set {
            &arguments.sets[..]
        } else {
            &[]
        };
        let loaded = scene::load(&scene.path, sets)?;
        Ok(Plan::of(&loaded)?.inputs)
    });
    let planned: Vec<Inputs> = planned.collect::<Result<_, CliError>>()?;
    let jobs: Vec<Job> = scenes
        .iter()
        .zip(&planned)
        .map(|(scene, inputs)| Job {
            name: &scene.name,
            root: folder.join(&scene.name),
            inputs,
        })
        .collect();
    let mut execution = Execution {
        ..arguments.execution
    };
    if arguments.jobs > 1 {
        let commands: Vec<Command> = (scenes.iter().zip(&jobs))
            .map(|(scene, job)| command(scene, job, &arguments.sets))
            .collect();
        if run_at_once(&execution, "scene", &commands, arguments.jobs)? {
            say("stopped; run the same command again to continue");
            return Ok(Exit::Stopped);
        }
        // The runs are complete or failed now. Run the runs again without messages, to collect the errors of the failed
        // runs.
        execution.quiet = true;
    }
    let outcomes = many::run_all(&execution, "scene", &jobs)?;
    for (job, error) in jobs.iter().zip(&outcomes.failures) {
        if let (Some(error), true) = (error, execution.quiet && !arguments.execution.quiet) {
            say(&format!("{} failed: {error}", job.name));
        }
    }
    if outcomes.stopped {
        say(&format!(
            "stopped after {} of {} scenes; run the same command again to continue",
            outcomes.failures.len(),
            jobs.len()
        ));
        return Ok(Exit::Stopped);
    }
    let runs = jobs
        .iter()
        .zip(&outcomes.failures)
        .filter(|(_, failure)| failure.is_none())
        .map(|(job, _)| RunTables::open(&job.root))
        .collect::<Result<Vec<_>, _>>()?;
    let (evidence, findings) = claims::evaluate(&runs)?;
    claims::write(&findings, &evidence, &runs, folder)?;
    let page = folder.join("report.html");
    let mut report = Report::new(&runs)?;
    report.set_title_and_first_section(
        "The claims of the paper",
        claims::section(&findings, &evidence),
    );
    report.add_comparisons(&claims::FIGURES, "[A]");
    report.replace(&page)?;
    print(&findings, &evidence, arguments.json, out);
    if !arguments.execution.quiet {
        let page = page.display();
        say(&format!(
            "written: {page}, with claims.md and claims.parquet in the same folder"
        ));
    }
    match outcomes.failures.into_iter().flatten().next() {
        Some(error) => Err(error.into()),
        None => Ok(Exit::Done),
    }
}

/// Returns the command that runs a scene.
fn command(scene: &Scene, job: &Job, sets: &[String]) -> Command {
    let mut arguments: Vec<OsString> = vec![scene.path.clone().into(), "--run".into()];
    arguments.push(job.root.clone().into());
    for set in sets.iter().filter(|_| scene.is_set) {
        arguments.extend(["--set".into(), set.into()]);
    }
    Command {
        name: scene.name.clone(),
        arguments,
    }
}

fn print(findings: &[Finding], evidence: &[Evidence], as_json: bool, out: &mut Results) {
    if as_json {
        let studies = claims::studies(evidence);
        let numbers: Vec<_> = studies.iter().flat_map(claims::compare_numbers).collect();
        out.json(
            &json!({ "claims": claims::CLAIMS.to_vec(), "findings": findings, "numbers": numbers }),
        );
    } else {
        write!(out, "{}", claims::markdown(findings, evidence));
    }
}

/// Returns scenes whose runs have the names of their files.
fn scenes_named_by_file(paths: Vec<PathBuf>) -> Vec<Scene> {
    let name = |path: &Path| {
        path.file_stem()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned()
    };
    let scenes = paths.into_iter().map(|path| Scene {
        name: name(&path),
        path,
        is_set: true,
    });
    scenes.collect()
}

/// Writes the shipped scenes to a folder, where they can be changed. Existing files stay unchanged.
fn write_shipped(folder: &Path, laws: &[Law]) -> Result<Vec<Scene>, CliError> {
    write_if_missing(folder, BASE)?;
    let mut scenes = Vec::new();
    let mut add = |law: Law, shipped: ShippedScene, is_of_law: bool| {
        let path = write_if_missing(&folder.join(law.word()), shipped)?;
        let name = match (law, is_of_law) {
            (Law::Sliders, true) => format!("{}_{}", law.word(), shipped.0),
            _ => shipped.0.to_owned(),
        };
        let is_set = !shipped.0.starts_with("sphere");
        scenes.push(Scene { name, path, is_set });
        Ok::<(), CliError>(())
    };
    for &law in laws {
        write_if_missing(&folder.join(law.word()), ("joint", law.joint()))?;
        for joint in JOINT_SCENES {
            add(law, joint, true)?;
        }
    }
    for other in LAW_INDEPENDENT_SCENES {
        add(laws[0], other, false)?;
    }
    Ok(scenes)
}

/// Writes a shipped scene to `folder`, unless the file of the scene exists.
fn write_if_missing(folder: &Path, (name, text): ShippedScene) -> Result<PathBuf, CliError> {
    let fs = RealFileSystem;
    fs.create_dir_all(folder).map_err(scene_error(folder))?;
    let path = folder.join(format!("{name}.toml"));
    if fs.metadata(&path).map_err(scene_error(&path))?.is_none() {
        let draft = folder.join(format!("{name}.toml.{}", std::process::id()));
        fs.replace(&draft, &path, text.as_bytes())
            .map_err(scene_error(&path))?;
    }
    Ok(path)
}

fn scene_error(path: &Path) -> impl FnOnce(std::io::Error) -> CliError {
    let path = path.to_owned();
    move |source| CliError::Scenes { path, source }
}
