//! `fretwear run`.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::report::{continue_command, shell_word};
use fretwear::scene::{self, Plan, Scene, SceneError};
use fretwear::stages::{self, Ending, RunOptions, Source};
use fretwear::store::{Cache, Layout, RealFileSystem, RunReader, SceneOfRun, StoreError};

use super::arguments::{RunArguments, threads_or_cores};
use super::report::Form;
use super::{CliError, Exit, cost, report};
use crate::progress::{Stopping, Watcher, stop_with_parent};
use crate::terminal::{Results, note, say};

/// Parses `RUN@N`.
pub fn parse_source(text: &str) -> Result<Source, String> {
    let (run, iteration) = text
        .rsplit_once('@')
        .ok_or("write the run and the iteration as RUN@N, as in runs/lap@37")?;
    let wear_iteration = iteration.parse().map_err(|_| {
        format!("\"{iteration}\" is not an iteration; write RUN@N with N = 0, 1, 2, …")
    })?;
    Ok(Source {
        run: PathBuf::from(run),
        wear_iteration,
    })
}

pub fn run(mut arguments: RunArguments, out: &mut Results) -> Result<Exit, CliError> {
    if arguments.attached {
        stop_with_parent();
    }
    let (mut scene, root) = scene_and_root(&arguments)?;
    if let Some(path) = &arguments.scene {
        (scene, arguments.sets) = with_recorded_accuracy(scene, &root, &arguments.sets, |sets| {
            scene::load(path, sets)
        });
    }
    let stopping = Stopping::listen(
        arguments.execution.max_wall,
        i32::from(Exit::Stopped.code()),
    );
    let stopping = stopping.map_err(CliError::Signals)?;
    let mut plan = Plan::of(&scene)?;
    if let Some(scene) = &arguments.scene {
        plan.inputs.identity.scene_written = Some(scene::source_text(scene, &arguments.sets)?);
    }
    let command: Vec<String> = std::env::args().skip(1).collect();
    note(&format!(
        "fretwear {}: {}",
        fretwear::VERSION,
        command.join(" ")
    ));
    let watcher = Watcher::new(&plan.inputs.recipe, &root, arguments.execution.quiet);
    let watcher = watcher
        .with_stopping(&stopping, &continue_command(&root))
        .with_checks(&plan.checks);
    plan.warnings.extend(cost::memory_warning(&plan.inputs));
    for warning in &plan.warnings {
        say(&format!("warning: {warning}"));
    }
    let options = RunOptions {
        inputs: &plan.inputs,
        root: root.clone(),
        source: arguments.from.clone(),
        until: arguments.until,
        threads: threads_or_cores(arguments.execution.threads),
        cache: cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder)),
        file_system: Arc::new(RealFileSystem),
        // Compute at least one iteration per start, so that repeated starts with little time make progress.
        stop: &|commits| stopping.is_asked() || (commits > 0 && stopping.is_late()),
    };
    let result = stages::run(&options, &watcher);
    stopping.close();
    watcher.finish();
    let outcome = match result {
        Ok(outcome) => outcome,
        Err(error) => {
            if error.is_not_converged() {
                say(&format!(
                    "the committed iterations in {} are kept",
                    root.display()
                ));
            }
            return Err(error.into());
        }
    };
    let form = match (arguments.json, arguments.verbose) {
        (true, _) => Form::Json,
        (false, true) => Form::Verbose,
        (false, false) => Form::Short,
    };
    let notices = watcher.notices();
    report::print_outcome(&outcome, &plan, &root, form, &notices, out);
    if !arguments.json && outcome.summary.is_some() {
        let reader = RunReader::open(Arc::new(RealFileSystem), &root)?;
        report::write_checks(
            out,
            &stages::plausibility_checks(&reader, &plan.inputs.recipe)?,
        );
    }
    if outcome.ending == Ending::Done && !arguments.json && !arguments.execution.quiet {
        // Memory and time depend on the machine and are not results, so print them to stderr.
        let memory = cost::memory_in_words();
        let memory = memory.map_or_else(String::new, |memory| format!(", {memory}"));
        let spent = cost::cost_text(&outcome.spent);
        say(&format!("  {:<24} {spent}{memory}", "cost"));
        if outcome.ends.is_some_and(|ends| ends.unworn.is_some()) {
            let root = shell_word(&root);
            say(&format!(
                "look at it:  fretwear report {root}\nall figures: fretwear status {root} --json"
            ));
        }
    }
    if outcome.ending == Ending::Stopped {
        say(&format!(
            "stopped; continue with: {}",
            continue_command(&root)
        ));
        return Ok(Exit::Stopped);
    }
    Ok(Exit::Done)
}

/// Returns the folder of the cache that runs share: the value of `FRETWEAR_CACHE`. If `FRETWEAR_CACHE` is empty, runs
/// use no cache. If `FRETWEAR_CACHE` is not set, the folder is `fretwear` in the user's cache folder.
pub fn cache_folder() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("FRETWEAR_CACHE") {
        return (!folder.is_empty()).then(|| PathBuf::from(folder));
    }
    let user = std::env::var_os("XDG_CACHE_HOME").filter(|folder| !folder.is_empty());
    let home = || Some(PathBuf::from(std::env::var_os("HOME")?).join(".cache"));
    Some(user.map(PathBuf::from).or_else(home)?.join("fretwear"))
}

/// Returns the scene and the folder of its run.
fn scene_and_root(arguments: &RunArguments) -> Result<(Scene, PathBuf), CliError> {
    let source = arguments.from.as_ref().map(|source| &source.run);
    let mut run_scene = None;
    for run in [arguments.run.as_ref(), source].into_iter().flatten() {
        if arguments.scene.is_none() && run_scene.is_none() {
            run_scene = scene_of_run(run, &arguments.sets)?;
        }
    }
    let scene = match (&arguments.scene, run_scene, source, &arguments.run) {
        (Some(scene), ..) => scene::load(scene, &arguments.sets)?,
        (None, Some(run_scene), ..) => run_scene,
        (None, None, Some(run), _) => return Err(StoreError::NoRun { path: run.clone() }.into()),
        (None, None, None, Some(run)) => {
            return Err(CliError::NothingToRun { path: run.clone() });
        }
        (None, None, None, None) => {
            unreachable!("the arguments require a scene, a run or a source")
        }
    };
    let root = match (&arguments.run, &arguments.from) {
        (Some(root), _) => root.clone(),
        (None, Some(source)) => {
            let name = source.run.file_name().unwrap_or_default().to_string_lossy();
            source
                .run
                .with_file_name(format!("{name}-from-{}", source.wear_iteration))
        }
        (None, None) => Path::new("runs").join(&scene.name),
    };
    Ok((scene, root))
}

/// If a scene has no accuracy, the function adds the accuracy of the first start of the run to the scene and to `sets`.
/// The function then prints a note. The scene stays unchanged if the folder cannot be read as a run, or if `load`
/// rejects the accuracy. The program reports the error of the folder or of `load` when the program opens the run.
fn with_recorded_accuracy(
    scene: Scene,
    root: &Path,
    sets: &[String],
    load: impl Fn(&[String]) -> Result<Scene, SceneError>,
) -> (Scene, Vec<String>) {
    let reader = RunReader::open(Arc::new(RealFileSystem), root);
    let recorded_keys = reader.map_or_else(
        |_| Vec::new(),
        |reader| scene.accuracy_changed_since(&reader.record().scene),
    );
    if recorded_keys.is_empty() {
        return (scene, sets.to_vec());
    }
    let all_sets = [sets, &recorded_keys].concat();
    match load(&all_sets) {
        Ok(adjusted_scene) => {
            let (recorded_keys, root) = (recorded_keys.join(", "), root.display());
            say(&format!(
                "note: {recorded_keys}, as at the start of {root}: the scene does not give it"
            ));
            (adjusted_scene, all_sets)
        }
        Err(_) => (scene, sets.to_vec()),
    }
}

/// Returns the scene with which a run continues. The user may have edited or removed `scene.toml`.
pub fn scene_of_run(run: &Path, sets: &[String]) -> Result<Option<Scene>, CliError> {
    let path = Layout::at(run).scene();
    let Some(stored_scene) = SceneOfRun::read(Arc::new(RealFileSystem), run)? else {
        return Ok(None);
    };
    let load = |sets: &[String]| scene::load_kept(&path, &stored_scene.text, sets);
    match load(sets) {
        Ok(scene) => Ok(Some(with_recorded_accuracy(scene, run, sets, load).0)),
        Err(source) if stored_scene.edited => Err(CliError::EditedScene { path, source }),
        Err(error) => Err(error.into()),
    }
}
