//! `fretwear backbone`: frequency, damping ratio and amplitude over the level of the force.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use fretwear::dynamics::{Backbone, BackboneEnd, Levels};
use fretwear::recipe::{Inputs, Recipe};
use fretwear::report::word;
use fretwear::scene::{self, Plan};
use fretwear::stages::{self, FREE_KEYS, RunError, Source};
use fretwear::store::{Cache, RealFileSystem, RunReader, StoreError};
use fretwear::tables::{Provenance, TypedTable, to_parquet, typed};
use fretwear::units::{self, Dimension};
use serde_json::{Value, json};

use super::arguments::parse_threads;
use super::run::{cache_folder, parse_source, scene_of_run};
use super::{CliError, Exit};
use crate::progress::{Watcher, grouped};
use crate::terminal::Results;

#[derive(Args)]
pub struct BackboneArguments {
    /// Scenes (TOML), of which the unworn joint is meant, and iterations of runs, as in `runs/lap@37`
    #[arg(required = true, value_name = "SCENE|RUN@K", value_parser = State::parse)]
    states: Vec<State>,
    /// Change a key of the scenes, as in `--set contact.normal_load="20 kN"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Force to begin at, half range of the drive, as in `--from "1 N"` [default: a thousandth of that of the scene]
    #[arg(long, value_name = "FORCE", value_parser = parse_force)]
    from: Option<f64>,
    /// Force to end at [default: twice that of the scene]
    #[arg(long, value_name = "FORCE", value_parser = parse_force)]
    to: Option<f64>,
    /// Levels of equal ratio, both ends included, from 2 to 10 000 [default: where the curve needs them]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=10_000))]
    levels: Option<u64>,
    /// Write the table to this Parquet file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Draw all of them in one picture: frequency and damping ratio over amplitude, amplitude over force
    #[cfg(feature = "polars")]
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Threads for the contact solvers' transforms; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_threads)]
    threads: usize,
    /// No progress
    #[arg(long, short)]
    quiet: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// What vibrates.
#[derive(Clone)]
enum State {
    Scene(PathBuf),
    Run(Source),
}

impl State {
    /// `RUN@K`, unless there is a file of that name.
    fn parse(text: &str) -> Result<State, String> {
        match parse_source(text) {
            Ok(source) if !Path::new(text).is_file() => Ok(State::Run(source)),
            _ => Ok(State::Scene(PathBuf::from(text))),
        }
    }

    fn name(&self) -> String {
        match self {
            State::Scene(path) => word(path),
            State::Run(source) => format!("{}@{}", word(&source.run), source.wear_iteration),
        }
    }
}

/// A state with its backbone.
struct Found {
    name: String,
    wear_iteration: u64,
    cycles: u64,
    scene_hash: String,
    backbone: Backbone,
}

fn parse_force(text: &str) -> Result<f64, String> {
    match units::parse(text, Dimension::FORCE) {
        Ok(force) if units::SIZES.contains(&force) => Ok(force),
        Ok(force) if force > 0.0 => Err("must be from 1e-60 N to 1e60 N".to_owned()),
        Ok(_) => Err("must be more than 0 N".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

pub fn backbone(arguments: &BackboneArguments, out: &mut Results) -> Result<Exit, CliError> {
    let is_run = |state: &State| matches!(state, State::Run(_));
    if !arguments.sets.is_empty() && arguments.states.iter().all(is_run) {
        return Err(CliError::SetOfARun);
    }
    let mut all = Vec::new();
    for state in &arguments.states {
        let found = match state {
            State::Scene(path) => of_scene(arguments, path)?,
            State::Run(source) => of_run(arguments, source)?,
        };
        all.push(Found {
            name: state.name(),
            ..found
        });
    }
    let mut table = typed::Backbone::default();
    for found in &all {
        let wear = (found.wear_iteration, found.cycles);
        stages::add_backbone(&mut table, &found.name, wear, &found.backbone);
    }
    if let Some(path) = &arguments.output {
        let provenance = Provenance {
            scene_hash: all[0].scene_hash.clone(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let table = table.to_table().map_err(RunError::from)?;
        let bytes = to_parquet(&table, &provenance).map_err(RunError::from)?;
        write(path, &bytes)?;
    }
    #[cfg(feature = "polars")]
    if let Some(path) = &arguments.svg {
        let svg = fretwear::report::backbone_svg(&table).map_err(CliError::Drawing)?;
        write(path, svg.as_bytes())?;
    }
    match arguments.json {
        true => out.json(&json!({ "states": all.iter().map(object).collect::<Vec<_>>() })),
        false => all.iter().for_each(|found| print(found, out)),
    }
    Ok(Exit::Done)
}

fn of_scene(arguments: &BackboneArguments, path: &Path) -> Result<Found, CliError> {
    let inputs = Plan::of(&scene::load(path, &arguments.sets)?)?.inputs;
    let levels = levels(arguments, &inputs.recipe, path)?;
    let cache = cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder));
    let watcher = Watcher::new(&inputs.recipe, path, arguments.quiet || arguments.json);
    let cache = cache.as_ref();
    let backbone = stages::backbone_of_scene(&inputs, cache, levels, arguments.threads, &watcher);
    watcher.finish();
    Ok(found(&inputs, 0, 0, backbone?))
}

fn of_run(arguments: &BackboneArguments, source: &Source) -> Result<Found, CliError> {
    let (run, wear_iteration) = (&source.run, source.wear_iteration);
    let reader = RunReader::open(Arc::new(RealFileSystem), run)?;
    let Some(scene) = scene_of_run(run, &[])? else {
        return Err(StoreError::NoRun { path: run.clone() }.into());
    };
    let inputs = Plan::of(&scene)?.inputs;
    reader.require_scene(&inputs.identity.scene, &FREE_KEYS)?;
    let levels = levels(arguments, &inputs.recipe, run)?;
    let summary: typed::Summary = reader.typed(wear_iteration)?;
    let watcher = Watcher::new(&inputs.recipe, run, arguments.quiet || arguments.json);
    let threads = arguments.threads;
    let backbone =
        stages::backbone_of_run(&reader, &inputs, wear_iteration, levels, threads, &watcher);
    watcher.finish();
    let cycles = summary.cycles.unwrap_or(0) as u64;
    Ok(found(&inputs, wear_iteration, cycles, backbone?))
}

fn found(inputs: &Inputs, wear_iteration: u64, cycles: u64, backbone: Backbone) -> Found {
    Found {
        name: String::new(),
        wear_iteration,
        cycles,
        scene_hash: stages::identity_of(inputs).scene_hash(),
        backbone,
    }
}

/// The levels asked for; what is not said follows from the drive of the scene.
fn levels(arguments: &BackboneArguments, recipe: &Recipe, path: &Path) -> Result<Levels, CliError> {
    let response = recipe.response.as_ref();
    let forces = response.map_or(&[][..], |response| &response.forces);
    let drive = forces
        .iter()
        .find(|force| force.harmonic == 1 && force.amplitude > 0.0);
    let Some(drive) = drive else {
        return Err(CliError::NothingVibrates {
            path: path.to_owned(),
        });
    };
    let from = arguments.from.unwrap_or(drive.amplitude / 1000.0);
    let to = arguments.to.unwrap_or(2.0 * drive.amplitude);
    match from < to {
        true => Ok(Levels {
            from,
            to,
            count: arguments.levels.map(|count| count as usize),
        }),
        false => Err(CliError::Levels { from, to }),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    fs::write(path, bytes).map_err(|source| CliError::Export {
        path: path.to_owned(),
        source,
    })
}

/// Where the backbone begins above the first level, in words.
fn begin(backbone: &Backbone) -> Option<String> {
    let (point, error) = (backbone.points.first()?, backbone.begin.as_ref()?);
    let force = point.force;
    Some(format!(
        "it begins at {force:.6} N: below, no phase resonance was found ({error})"
    ))
}

/// Where the backbone ends before the last level, in words.
fn end(backbone: &Backbone) -> Option<String> {
    match &backbone.end {
        BackboneEnd::Reached => None,
        BackboneEnd::Unbounded { force, growth } => Some(format!(
            "it ends below {force:.6} N: friction at its limit bounds no amplitude above, and nothing else does (before, the amplitude has \
             grown by {growth:.0} % a percent of force); damping (dynamics.damping_ratio, structure.damping) would"
        )),
        BackboneEnd::Ceased { force, source } => Some(format!(
            "it ends below {force:.6} N, where no phase resonance was found: {source}"
        )),
        BackboneEnd::OtherMode { force } => Some(format!(
            "it ends below {force:.6} N: the next phase resonance is that of another mode, more than 5 % away in frequency"
        )),
    }
}

fn print(found: &Found, out: &mut Results) {
    let Found { name, backbone, .. } = found;
    let wear = match found.cycles {
        0 => "unworn".to_owned(),
        cycles => format!("after {} cycles", grouped(cycles)),
    };
    writeln!(out, "{name}, {wear}");
    writeln!(
        out,
        "{:>12} {:>12} {:>12} {:>10} {:>12} {:>12} {:>8}",
        "force", "amplitude", "frequency", "damping", "friction", "viscous", "sliding"
    );
    writeln!(
        out,
        "{:>12} {:>12} {:>12} {:>10} {:>12} {:>12} {:>8}",
        "N", "m", "Hz", "ratio", "J a cycle", "J a cycle", "%"
    );
    let mut branch = 0;
    for point in &backbone.points {
        if point.branch != branch {
            branch = point.branch;
            writeln!(out, "{:>12}", "a leap");
        }
        writeln!(
            out,
            "{:>12.5e} {:>12.5e} {:>12.4} {:>10.3e} {:>12.4e} {:>12.4e} {:>8.1}",
            point.force,
            point.amplitude,
            point.frequency,
            point.damping_ratio,
            point.energy.friction,
            point.energy.viscous,
            100.0 * point.sliding_fraction()
        );
    }
    if let Some(begin) = begin(backbone) {
        writeln!(out, "{begin}");
    }
    if let Some(end) = end(backbone) {
        writeln!(out, "{end}");
    }
}

fn object(found: &Found) -> Value {
    let backbone = &found.backbone;
    let points = backbone.points.iter().map(|point| {
        json!({
            "branch": point.branch,
            "force": point.force,
            "frequency": point.frequency,
            "damping_ratio": point.damping_ratio,
            "amplitude": point.amplitude,
            "kinetic_energy": point.kinetic_energy,
            "input_energy": point.energy.input,
            "friction_energy": point.energy.friction,
            "viscous_energy": point.energy.viscous,
            "sliding_fraction": point.sliding_fraction(),
            "open_fraction": point.open_fraction(),
        })
    });
    json!({
        "state": found.name,
        "wear_iteration": found.wear_iteration,
        "cycles": found.cycles,
        "begin": begin(backbone),
        "end": end(backbone),
        "solves": backbone.solves,
        "iterations": backbone.iterations,
        "points": points.collect::<Vec<_>>(),
    })
}
