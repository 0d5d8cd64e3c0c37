//! `fretwear trade`.

use std::path::{Path, PathBuf};

use fretwear::recipe::MotionKind;
use fretwear::recipe::ResourceEstimate;
use fretwear::report::trade::{self, Trial};
use fretwear::scene::variants::{
    self, BALANCED, Choice, KnobKind, REFERENCE, SkippedVariant, Variant, Variants,
};
use fretwear::scene::{self, Plan};
use fretwear::stages::RunError;
use serde_json::{Value, json};

use super::arguments::TradeArguments;
use super::many;
use super::{CliError, Exit, report};
use crate::terminal::{self, Results, say};

/// A variant and the plan of its run.
struct Job {
    variant: Variant,
    plan: Plan,
}

/// Runs the variants of a scene, or the presets of several scenes, and compares the results. Each variant runs in a
/// separate folder.
pub fn trade(arguments: &TradeArguments, out: &mut Results) -> Result<Exit, CliError> {
    match &arguments.scenes[..] {
        [path] if !path.is_dir() => trade_one_scene(arguments, path, out),
        _ => trade_scenes(arguments, out),
    }
}

/// Runs the variants of a scene.
fn trade_one_scene(
    arguments: &TradeArguments,
    path: &Path,
    out: &mut Results,
) -> Result<Exit, CliError> {
    let sets = &arguments.sets;
    let base_scene = scene::load(path, sets)?;
    let balanced = variants::load(path, sets, &variants::balanced())?;
    let recipe = Plan::of(&balanced)?.inputs.recipe;
    let choice = Choice {
        knobs: arguments.knobs.clone(),
        paper: arguments.paper,
        largest_grid: arguments.largest_grid,
    };
    let mut candidates = variants::variants(&base_scene, &balanced, &recipe, &choice)?;
    // The noise is the difference between the first run and its repetition. Run the repetition last, so that all other
    // runs lie between the first run and the repetition.
    candidates.variants.push(variants::again());
    let jobs = jobs(path, sets, &mut candidates)?;
    let folder = match &arguments.dir {
        Some(folder) => folder.clone(),
        None => Path::new(FOLDER).join(&base_scene.name),
    };
    let named_jobs = jobs.iter().map(|job| {
        let name = job.variant.name.clone();
        (name.clone(), folder.join(name), job)
    });
    let (trials, stopped) = run_all(arguments, "variant", &named_jobs.collect::<Vec<_>>())?;
    let (trials, failures) = split_failures(trials);
    let motion = MotionKind::of(&recipe);
    let trade = trade::compare_variants(&base_scene.name, motion, trials, candidates.base)?;
    let left_out: Vec<(String, String)> = candidates
        .skipped
        .into_iter()
        .map(|skipped| (skipped.what, skipped.reason))
        .collect();
    // Without the reference, no error can be computed.
    let has_reference = trade.row(REFERENCE).is_some();
    let page = trade::page(&trade, &left_out);
    if has_reference {
        trade::write(&folder, std::slice::from_ref(&trade), &page)?;
    }
    if stopped {
        return Ok(stopped_after(trade.rows.len(), jobs.len(), "variants"));
    }
    if arguments.json {
        let left_out = left_out.iter();
        let left_out = left_out.map(|(what, reason)| json!({ "what": what, "reason": reason }));
        out.json(&json!({
            "scene": base_scene.name,
            "rows": report::rows(&trade::table(std::slice::from_ref(&trade))?),
            "findings": trade::findings(&trade),
            "left_out": left_out.collect::<Vec<Value>>(),
        }));
    } else {
        write!(out, "{}", page.plain(terminal::width()));
    }
    finish(arguments, has_reference.then_some(&folder), failures)
}

/// Default folder of the runs.
const FOLDER: &str = "trade";

fn stopped_after(done: usize, total: usize, what: &str) -> Exit {
    say(&format!(
        "stopped after {done} of {total} {what}; run the same command again to continue"
    ));
    Exit::Stopped
}

/// Prints the written files. Returns the error of a failed reference run, without which nothing can be compared.
fn finish(
    arguments: &TradeArguments,
    written: Option<&PathBuf>,
    failures: Vec<RunError>,
) -> Result<Exit, CliError> {
    if let Some(folder) = written.filter(|_| !arguments.execution.quiet) {
        let page = folder.join("trade.html");
        say(&format!(
            "written: {}, with trade.parquet, .svg and .md in the same folder",
            page.display()
        ));
    }
    match failures.into_iter().next() {
        Some(error) => Err(error.into()),
        None => Ok(Exit::Done),
    }
}

/// One of several scenes, with the runs of its presets.
struct SceneJobs {
    name: String,
    path: PathBuf,
    motion: MotionKind,
    jobs: Vec<Job>,
}

/// Runs the presets of several scenes.
fn trade_scenes(arguments: &TradeArguments, out: &mut Results) -> Result<Exit, CliError> {
    let mut paths = Vec::new();
    for path in &arguments.scenes {
        match path.is_dir() {
            true => paths.extend(many::scenes_in(path)?),
            false => paths.push(path.clone()),
        }
    }
    let options = [
        ("--knob", !arguments.knobs.is_empty()),
        ("--paper", arguments.paper),
        ("--largest-grid", arguments.largest_grid.is_some()),
    ];
    if let Some((option, _)) = options.into_iter().find(|(_, is_given)| *is_given) {
        let scenes = paths.len();
        return Err(CliError::SingleSceneOption { option, scenes });
    }
    let mut scenes: Vec<SceneJobs> = Vec::new();
    for path in paths {
        let scene = scene_jobs(path, &arguments.sets)?;
        if let Some(other) = scenes.iter().find(|other| other.name == scene.name) {
            let paths = [other.path.clone(), scene.path];
            let name = scene.name;
            return Err(CliError::SameName { name, paths });
        }
        scenes.push(scene);
    }
    let folder = match &arguments.dir {
        Some(folder) => folder.clone(),
        None => PathBuf::from(FOLDER),
    };
    let named_jobs = scenes.iter().flat_map(|scene| {
        let root = folder.join(&scene.name);
        scene.jobs.iter().map(move |job| {
            let variant = &job.variant.name;
            (
                format!("{}, {variant}", scene.name),
                root.join(variant),
                job,
            )
        })
    });
    let (trials, stopped) = run_all(arguments, "run", &named_jobs.collect::<Vec<_>>())?;
    let (mut trades, mut failures) = (Vec::new(), Vec::new());
    let mut trials = trials.into_iter();
    for scene in &scenes {
        let scene_trials: Vec<_> = trials.by_ref().take(scene.jobs.len()).collect();
        // The last run of a scene is the reference. Compare the presets of a scene only after all runs of the scene
        // have ended.
        if scene_trials.len() == scene.jobs.len() {
            let (scene_trials, failed) = split_failures(scene_trials);
            failures.extend(failed);
            trades.push(trade::compare_variants(
                &scene.name,
                scene.motion,
                scene_trials,
                Vec::new(),
            )?);
        }
    }
    let name = match &arguments.scenes[..] {
        [folder] => folder
            .file_name()
            .map(|name| name.to_string_lossy().into_owned()),
        _ => None,
    };
    let name = name.unwrap_or_else(|| "scenes".to_owned());
    let page = trade::page_of_scenes(&name, &trades);
    if !trades.is_empty() {
        trade::write(&folder, &trades, &page)?;
    }
    if stopped {
        return Ok(stopped_after(trades.len(), scenes.len(), "scenes"));
    }
    if arguments.json {
        let [promises, bars] = trade::misses(&trades);
        out.json(&json!({
            "scenes": scenes.iter().map(|scene| &scene.name).collect::<Vec<_>>(),
            "rows": report::rows(&trade::table(&trades)?),
            "tallies": trade::tallies(&trades),
            "promises_broken": promises,
            "outside_bars": bars,
        }));
    } else {
        write!(out, "{}", page.plain(terminal::width()));
    }
    finish(arguments, Some(&folder), failures)
}

fn scene_jobs(path: PathBuf, sets: &[String]) -> Result<SceneJobs, CliError> {
    let mut jobs = Vec::new();
    let mut name_and_motion = None;
    for variant in variants::presets() {
        let scene = variants::load(&path, sets, &variant)?;
        let plan = Plan::of(&scene)?;
        name_and_motion = Some((scene.name, MotionKind::of(&plan.inputs.recipe)));
        jobs.push(Job { variant, plan });
    }
    let (name, motion) = name_and_motion.unwrap_or((String::new(), MotionKind::Rest));
    Ok(SceneJobs {
        name,
        path,
        motion,
        jobs,
    })
}

fn plan(path: &Path, sets: &[String], variant: &Variant) -> Result<Plan, CliError> {
    Ok(Plan::of(&variants::load(path, sets, variant)?)?)
}

/// Plans the variants that the scene allows, and moves all other variants to the list of skipped variants.
fn jobs(path: &Path, sets: &[String], candidates: &mut Variants) -> Result<Vec<Job>, CliError> {
    let mut jobs: Vec<Job> = Vec::new();
    for variant in std::mem::take(&mut candidates.variants) {
        let what = format!("{} = {}", variant.knob, variant.value);
        match plan(path, sets, &variant) {
            Ok(plan) => {
                let identity = |plan: &Plan| plan.inputs.identity.scene.clone();
                let same = |job: &&Job| identity(&job.plan) == identity(&plan);
                let same = jobs.iter().find(same);
                match same.filter(|_| variant.kind != KnobKind::Repeat) {
                    // For example, a scene with only `preset = "fast"` equals that preset.
                    Some(job) => candidates.skipped.push(SkippedVariant {
                        what,
                        reason: format!("it is the same as {}", job.variant.name),
                    }),
                    None => jobs.push(Job { variant, plan }),
                }
            }
            Err(error) if [BALANCED, REFERENCE].contains(&variant.name.as_str()) => {
                return Err(error);
            }
            Err(error) => candidates.skipped.push(SkippedVariant {
                what,
                reason: error.to_string(),
            }),
        }
    }
    Ok(jobs)
}

/// A trial, and the error if it is a failed reference run.
type TrialOutcome = (Trial, Option<RunError>);

/// Separates the trials from the errors of reference runs.
fn split_failures(outcomes: Vec<TrialOutcome>) -> (Vec<Trial>, Vec<RunError>) {
    let (trials, failures): (Vec<_>, Vec<_>) = outcomes.into_iter().unzip();
    (trials, failures.into_iter().flatten().collect())
}

/// Runs each job under the name and in the folder of the job. Returns the outcomes, and true if the command was stopped
/// before all runs ended.
fn run_all(
    arguments: &TradeArguments,
    what: &str,
    jobs: &[(String, PathBuf, &Job)],
) -> Result<(Vec<TrialOutcome>, bool), CliError> {
    let runs: Vec<many::Job> = jobs
        .iter()
        .map(|(name, root, job)| many::Job {
            name,
            root: root.clone(),
            inputs: &job.plan.inputs,
        })
        .collect();
    let outcomes = many::run_all(&arguments.execution, what, &runs)?;
    let ended = jobs.iter().zip(outcomes.failures);
    let trials = ended.map(|((_, root, job), failure)| {
        // Memory with the structure in the cache, because the runs share it.
        let trial = Trial {
            variant: job.variant.clone(),
            root: root.clone(),
            memory: ResourceEstimate::least_memory(&job.plan.inputs),
            failure: failure.as_ref().map(ToString::to_string),
        };
        let is_reference = job.variant.name == REFERENCE;
        (trial, failure.filter(|_| is_reference))
    });
    Ok((trials.collect(), outcomes.stopped))
}
