//! `fretwear trade`.

use std::path::{Path, PathBuf};

use fretwear::recipe::Counted;
use fretwear::recipe::MotionKind;
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

/// A variant with what its run needs.
struct Job {
    variant: Variant,
    plan: Plan,
}

/// Runs the variants of a scene, or the presets of several, each in its own folder, and compares them.
pub fn trade(arguments: &TradeArguments, out: &mut Results) -> Result<Exit, CliError> {
    match &arguments.scenes[..] {
        [path] if !path.is_dir() => one(arguments, path, out),
        _ => several(arguments, out),
    }
}

/// Runs the variants of a scene.
fn one(arguments: &TradeArguments, path: &Path, out: &mut Results) -> Result<Exit, CliError> {
    let sets = &arguments.sets;
    let written = scene::load(path, sets)?;
    let balanced = variants::load(path, sets, &variants::balanced())?;
    let recipe = Plan::of(&balanced)?.inputs.recipe;
    let choice = Choice {
        knobs: arguments.knobs.clone(),
        paper: arguments.paper,
        largest_grid: arguments.largest_grid,
    };
    let mut made = variants::variants(&written, &balanced, &recipe, &choice)?;
    // Last, so that all other runs lie between the two that are to tell the noise.
    made.variants.push(variants::again());
    let jobs = jobs(path, sets, &mut made)?;
    let folder = match &arguments.dir {
        Some(folder) => folder.clone(),
        None => Path::new(FOLDER).join(&written.name),
    };
    let named = jobs.iter().map(|job| {
        let name = job.variant.name.clone();
        (name.clone(), folder.join(name), job)
    });
    let (trials, stopped) = run_all(arguments, "variant", &named.collect::<Vec<_>>())?;
    let (trials, failures) = parted(trials);
    let motion = MotionKind::of(&recipe);
    let trade = trade::trade(&written.name, motion, trials, made.base)?;
    let left_out: Vec<(String, String)> = made
        .left_out
        .into_iter()
        .map(|left| (left.what, left.reason))
        .collect();
    // Without the reference there are no errors to show.
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
            "scene": written.name,
            "rows": report::rows(&trade::table(std::slice::from_ref(&trade))?),
            "findings": trade::findings(&trade),
            "left_out": left_out.collect::<Vec<Value>>(),
        }));
    } else {
        write!(out, "{}", page.plain(terminal::width()));
    }
    end(arguments, has_reference.then_some(&folder), failures)
}

/// Where runs go.
const FOLDER: &str = "trade";

fn stopped_after(done: usize, of: usize, what: &str) -> Exit {
    say(&format!(
        "stopped after {done} of {of} {what}; run the same command again to continue"
    ));
    Exit::Stopped
}

/// Says what was written, and ends with why a reference failed: nothing can be said against one that did.
fn end(
    arguments: &TradeArguments,
    written: Option<&PathBuf>,
    failures: Vec<RunError>,
) -> Result<Exit, CliError> {
    if let Some(folder) = written.filter(|_| !arguments.execution.quiet) {
        let page = folder.join("trade.html");
        say(&format!(
            "written: {}, and beside it trade.parquet, .svg and .md",
            page.display()
        ));
    }
    match failures.into_iter().next() {
        Some(error) => Err(error.into()),
        None => Ok(Exit::Done),
    }
}

/// A scene of several with the runs of its presets.
struct OfScene {
    name: String,
    path: PathBuf,
    motion: MotionKind,
    jobs: Vec<Job>,
}

/// Runs the presets of several scenes.
fn several(arguments: &TradeArguments, out: &mut Results) -> Result<Exit, CliError> {
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
        return Err(CliError::OfOneScene { option, scenes });
    }
    let mut scenes: Vec<OfScene> = Vec::new();
    for path in paths {
        let scene = of_scene(path, &arguments.sets)?;
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
    let named = scenes.iter().flat_map(|scene| {
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
    let (trials, stopped) = run_all(arguments, "run", &named.collect::<Vec<_>>())?;
    let (mut trades, mut failures) = (Vec::new(), Vec::new());
    let mut trials = trials.into_iter();
    for scene in &scenes {
        let of_scene: Vec<_> = trials.by_ref().take(scene.jobs.len()).collect();
        // A scene is compared once its reference, the last of its runs, has ended.
        if of_scene.len() == scene.jobs.len() {
            let (of_scene, failed) = parted(of_scene);
            failures.extend(failed);
            trades.push(trade::trade(
                &scene.name,
                scene.motion,
                of_scene,
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
    end(arguments, Some(&folder), failures)
}

fn of_scene(path: PathBuf, sets: &[String]) -> Result<OfScene, CliError> {
    let mut jobs = Vec::new();
    let mut known = None;
    for variant in variants::presets() {
        let scene = variants::load(&path, sets, &variant)?;
        let plan = Plan::of(&scene)?;
        known = Some((scene.name, MotionKind::of(&plan.inputs.recipe)));
        jobs.push(Job { variant, plan });
    }
    let (name, motion) = known.unwrap_or((String::new(), MotionKind::Rest));
    Ok(OfScene {
        name,
        path,
        motion,
        jobs,
    })
}

fn plan(path: &Path, sets: &[String], variant: &Variant) -> Result<Plan, CliError> {
    Ok(Plan::of(&variants::load(path, sets, variant)?)?)
}

/// The variants that the scene allows; the others are left out.
fn jobs(path: &Path, sets: &[String], made: &mut Variants) -> Result<Vec<Job>, CliError> {
    let mut jobs: Vec<Job> = Vec::new();
    for variant in std::mem::take(&mut made.variants) {
        let what = format!("{} = {}", variant.knob, variant.value);
        match plan(path, sets, &variant) {
            Ok(plan) => {
                let known_by = |plan: &Plan| plan.inputs.identity.scene.clone();
                let same = |job: &&Job| known_by(&job.plan) == known_by(&plan);
                let same = jobs.iter().find(same);
                match same.filter(|_| variant.kind != KnobKind::Repeat) {
                    // A scene that says nothing but `preset = "fast"` is that preset.
                    Some(job) => made.left_out.push(SkippedVariant {
                        what,
                        reason: format!("it is the same as {}", job.variant.name),
                    }),
                    None => jobs.push(Job { variant, plan }),
                }
            }
            Err(error) if [BALANCED, REFERENCE].contains(&variant.name.as_str()) => {
                return Err(error);
            }
            Err(error) => made.left_out.push(SkippedVariant {
                what,
                reason: error.to_string(),
            }),
        }
    }
    Ok(jobs)
}

/// What became of a run, and why it failed if it did and is a reference.
type RunOutcomes = (Trial, Option<RunError>);

/// The trials, and why references failed.
fn parted(ran: Vec<RunOutcomes>) -> (Vec<Trial>, Vec<RunError>) {
    let (trials, failures): (Vec<_>, Vec<_>) = ran.into_iter().unzip();
    (trials, failures.into_iter().flatten().collect())
}

/// What was run, each by its name and folder, and whether it was asked to stop before the end.
fn run_all(
    arguments: &TradeArguments,
    what: &str,
    jobs: &[(String, PathBuf, &Job)],
) -> Result<(Vec<RunOutcomes>, bool), CliError> {
    let runs: Vec<many::Job> = jobs
        .iter()
        .map(|(name, root, job)| many::Job {
            name,
            root: root.clone(),
            inputs: &job.plan.inputs,
        })
        .collect();
    let ran = many::run_all(&arguments.execution, what, &runs)?;
    let ended = jobs.iter().zip(ran.ended);
    let trials = ended.map(|((_, root, job), failure)| {
        // Runs share the structure.
        let trial = Trial {
            variant: job.variant.clone(),
            root: root.clone(),
            memory: Counted::least_memory(&job.plan.inputs),
            failure: failure.as_ref().map(ToString::to_string),
        };
        let of_reference = job.variant.name == REFERENCE;
        (trial, failure.filter(|_| of_reference))
    });
    Ok((trials.collect(), ran.stopped))
}
