//! `fretwear backbone` computes the frequency, the damping ratio and the amplitude of a resonance. The command computes
//! a point of the backbone per force level, or per value of a key of the scene.

use std::cell::Cell;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use fretwear::dynamics::{Backbone, BackboneEnd, LoadLevels};
use fretwear::recipe::{Inputs, Recipe};
use fretwear::report::{output, shell_word};
use fretwear::scene::{self, Plan};
use fretwear::stages::{self, FREE_KEYS, RunError, Source};
use fretwear::store::{Cache, RealFileSystem, RunReader, StoreError};
use fretwear::tables::{Provenance, TypedTable, to_parquet, typed};
use fretwear::units::{self, Amount, Dimension};
use serde_json::{Value, json};

use super::arguments::{parse_threads, threads_or_cores};
use super::run::{cache_folder, parse_source, scene_of_run};
use super::{CliError, Exit};
use crate::progress::{ForwardedSignals, Watcher, grouped};
use crate::terminal::Results;

#[derive(Args)]
pub struct BackboneArguments {
    /// Scenes (TOML), for the unworn joint, and iterations of runs, as in `runs/lap@37`
    #[arg(required = true, value_name = "SCENE|RUN@K", value_parser = State::parse)]
    states: Vec<State>,
    /// Change a key of the scenes, as in `--set contact.normal_load="20 kN"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Follow the resonance over this key of the scenes instead of the force, from `--from` to `--to`, up or down, as
    /// in `--over contact.normal_load --from "2 kN" --to "500 N"`
    #[arg(long, value_name = "KEY", requires = "from", requires = "to")]
    over: Option<String>,
    /// First force, half range of the drive, as in `--from "1 N"` [default: a thousandth of the scene's force]; with
    /// `--over`, first value of the key
    #[arg(long, value_name = "FORCE|VALUE", value_parser = parse_amount, allow_hyphen_values = true)]
    from: Option<Amount>,
    /// Last force or value [default: twice the force of the scene]
    #[arg(long, value_name = "FORCE|VALUE", value_parser = parse_amount, allow_hyphen_values = true)]
    to: Option<Amount>,
    /// Number of levels at equal ratios, including both ends, from 2 to 10 000 [default: chosen by the curve]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=10_000))]
    levels: Option<u64>,
    /// Write the table to this Parquet file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Draw all joints in one picture: frequency and damping ratio over amplitude, amplitude over force
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Threads, without effect on the results [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
    /// Show no progress
    #[arg(long, short)]
    quiet: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Joint that vibrates: unworn, or worn at an iteration of a run.
#[derive(Clone)]
enum State {
    Scene(PathBuf),
    Run(Source),
}

impl State {
    /// Parses `RUN@K`, unless a file has that name.
    fn parse(text: &str) -> Result<State, String> {
        match (parse_source(text), Path::new(text)) {
            (Ok(source), path) if !path.is_file() => Ok(State::Run(source)),
            (Err(_), path) if path.is_dir() => Err(format!(
                "it is a folder: give an iteration of its run, as in {text}@0 (`fretwear status {text}` shows the last)"
            )),
            _ => Ok(State::Scene(PathBuf::from(text))),
        }
    }

    fn name(&self) -> String {
        match self {
            State::Scene(path) => shell_word(path),
            State::Run(source) => format!("{}@{}", shell_word(&source.run), source.wear_iteration),
        }
    }
}

impl BackboneArguments {
    /// Checks that no output overwrites a scene or another output.
    fn check_outputs(&self) -> Result<(), CliError> {
        let canonical = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
        let mut used_paths: Vec<PathBuf> = Vec::new();
        used_paths.extend(self.states.iter().filter_map(|state| match state {
            State::Scene(path) => Some(canonical(path)),
            State::Run(_) => None,
        }));
        let outputs = self.output.iter().chain(&self.svg);
        for path in outputs {
            if used_paths.contains(&canonical(path)) {
                return Err(CliError::OutputIsTaken { path: path.clone() });
            }
            let folder = path
                .parent()
                .filter(|parent| !parent.as_os_str().is_empty());
            if folder.is_some_and(|folder| !folder.is_dir()) {
                let reason = "there is no such folder";
                return Err(CliError::Export {
                    path: path.clone(),
                    source: io::Error::new(io::ErrorKind::NotFound, reason),
                });
            }
            used_paths.push(canonical(path));
        }
        Ok(())
    }
}

/// Share of the logarithmic distance between two values for a trial. With the share 0.382, a trial between two integers
/// is hardly ever an integer.
const BETWEEN: f64 = 0.382;

/// Returns true if the setting `KEY=VALUE` in `set` sets the key `key`.
fn sets_key(set: &str, key: &str) -> bool {
    set.split_once('=')
        .is_some_and(|(name, _)| name.trim() == key)
}

/// Backbone of a joint.
struct StateBackbone {
    name: String,
    wear_iteration: u64,
    cycles: u64,
    scene_hash: String,
    backbone: Backbone,
    over: Option<LevelParameter>,
    /// Error that ended the curve, other than a lost resonance.
    broken: Option<CliError>,
}

/// Key of the scene that varies along the backbone if the force does not vary.
struct LevelParameter {
    key: String,
    /// Unit of the levels.
    unit: String,
    /// Value at each point, in SI units.
    values: Vec<f64>,
}

fn parse_amount(text: &str) -> Result<Amount, String> {
    match Amount::parse(text) {
        Some(amount) if units::COMPUTABLE_RANGE.contains(&amount.number) => Ok(amount),
        Some(amount) if amount.number > 0.0 => Err("must be from 1e-60 to 1e60".to_owned()),
        Some(amount) => Err(format!("must be more than 0 {}", amount.unit)
            .trim_end()
            .to_owned()),
        None => Err("must be a number, or a number with a unit as in \"20 kN\"".to_owned()),
    }
}

/// Parses a force, half range of the drive \[N\].
fn force(end: &'static str, amount: &Amount) -> Result<f64, CliError> {
    let level_error = |reason| CliError::Level { end, reason };
    match units::parse(&amount.to_string(), Dimension::FORCE) {
        Ok(force) if units::COMPUTABLE_RANGE.contains(&force) => Ok(force),
        Ok(_) => Err(level_error("must be from 1e-60 N to 1e60 N".to_owned())),
        Err(error) => Err(level_error(error.to_string())),
    }
}

pub fn backbone(arguments: &BackboneArguments, out: &mut Results) -> Result<Exit, CliError> {
    let is_run = |state: &State| matches!(state, State::Run(_));
    if !arguments.sets.is_empty() && arguments.states.iter().all(is_run) {
        return Err(CliError::SetOfARun);
    }
    if let (Some(key), Some(run)) = (&arguments.over, arguments.states.iter().find(|s| is_run(s))) {
        let (key, run) = (key.clone(), run.name());
        return Err(CliError::OverOfARun { key, run });
    }
    if let Some(key) = &arguments.over
        && let Some(set) = arguments.sets.iter().find(|set| sets_key(set, key))
    {
        let (key, set) = (key.clone(), set.clone());
        return Err(CliError::OverAndSet { key, set });
    }
    #[cfg(not(feature = "polars"))]
    if arguments.svg.is_some() {
        return Err(CliError::NoPolars);
    }
    arguments.check_outputs()?;
    let mut backbones: Vec<StateBackbone> = Vec::new();
    let mut failure = None;
    for state in &arguments.states {
        let state_backbone = match (state, &arguments.over) {
            (State::Scene(path), Some(key)) => backbone_over_key(arguments, path, key),
            (State::Scene(path), None) => scene_backbone(arguments, path),
            (State::Run(source), _) => run_backbone(arguments, source),
        };
        match state_backbone {
            Ok(state_backbone) => backbones.push(StateBackbone {
                name: state.name(),
                ..state_backbone
            }),
            Err(error) if backbones.is_empty() => return Err(error),
            Err(error) => failure = Some(error),
        }
        if failure.is_some()
            || backbones
                .last()
                .is_some_and(|state_backbone| state_backbone.broken.is_some())
        {
            break;
        }
    }
    let mut table = typed::Backbone::default();
    for state_backbone in &backbones {
        let wear = (state_backbone.wear_iteration, state_backbone.cycles);
        let over = state_backbone.over.as_ref();
        let over = over.map(|over| (over.key.as_str(), over.values.as_slice()));
        stages::add_backbone(
            &mut table,
            &state_backbone.name,
            wear,
            &state_backbone.backbone,
            over,
        );
    }
    // Print before writing files, so that a failed write loses nothing.
    match arguments.json {
        true => {
            out.json(&json!({ "states": backbones.iter().map(json_object).collect::<Vec<_>>() }))
        }
        false => backbones
            .iter()
            .for_each(|state_backbone| print(state_backbone, out)),
    }
    if let Some(path) = &arguments.output {
        let provenance = Provenance {
            scene_hash: backbones[0].scene_hash.clone(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let table = table.to_table().map_err(RunError::from)?;
        let bytes = to_parquet(&table, &provenance).map_err(RunError::from)?;
        write(path, &bytes)?;
    }
    #[cfg(feature = "polars")]
    if let Some(path) = &arguments.svg {
        let svg = fretwear::report::backbone_svg(&table);
        write(path, svg.as_bytes())?;
    }
    // Report an error after the results, so that the results are not lost.
    let failure = failure.or_else(|| backbones.pop()?.broken);
    failure.map_or(Ok(Exit::Done), Err)
}

fn scene_backbone(arguments: &BackboneArguments, path: &Path) -> Result<StateBackbone, CliError> {
    let inputs = Plan::of(&scene::load(path, &arguments.sets)?)?.inputs;
    let levels = levels(arguments, &inputs.recipe, path)?;
    let cache = cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder));
    let watcher = Watcher::new(&inputs.recipe, path, arguments.quiet || arguments.json);
    let cache = cache.as_ref();
    let threads = threads_or_cores(arguments.threads);
    let backbone = stages::backbone_of_scene(&inputs, cache, levels, threads, &watcher);
    watcher.finish();
    Ok(state_backbone(&inputs, 0, 0, backbone?))
}

/// Follows the resonance of a scene over one of its keys.
fn backbone_over_key(
    arguments: &BackboneArguments,
    path: &Path,
    key: &str,
) -> Result<StateBackbone, CliError> {
    let ends = [&arguments.from, &arguments.to]
        .map(|end| end.clone().expect("--over requires --from and --to"));
    let error_at = |value: &Amount, source: CliError| CliError::OverAt {
        key: key.to_owned(),
        value: value.to_string(),
        source: Box::new(source),
    };
    let inputs_of = |value: &Amount| -> Result<Inputs, CliError> {
        let mut sets = arguments.sets.clone();
        sets.push(format!("{key}={value}"));
        let plan = || -> Result<Plan, CliError> { Ok(Plan::of(&scene::load(path, &sets)?)?) };
        Ok(plan().map_err(|error| error_at(value, error))?.inputs)
    };
    let first = inputs_of(&ends[0])?;
    inputs_of(&ends[1])?;
    let in_si = |amount: &Amount| {
        let parsed = units::parse_any(&amount.to_string());
        parsed.map_err(|problem| CliError::Level {
            end: "--over",
            reason: format!("\"{amount}\" {problem}"),
        })
    };
    let [from, to] = &ends;
    let to = match (in_si(from)?, in_si(to)?) {
        _ if from.unit == to.unit => Some(to.number),
        ((first, dimension), (last, other)) => {
            (dimension == other).then_some(from.number * last / first)
        }
    };
    let Some(to) = to.filter(|to| *to != from.number) else {
        let [from, to] = ends.map(|end| end.to_string());
        let key = key.to_owned();
        return Err(CliError::OverLevels { key, from, to });
    };
    let Amount { number: from, unit } = from.clone();
    // A request to stop takes effect after the present value, so that its result is not lost.
    let signals = ForwardedSignals::listen_once(i32::from(Exit::Stopped.code()))
        .map_err(CliError::Signals)?;
    let last_number = Cell::new(from);
    let amount = |number: f64| Amount {
        number,
        unit: unit.clone(),
    };
    let inputs_at = |number: f64| {
        last_number.set(number);
        match signals.is_asked() {
            true => Err(CliError::AskedToStop),
            false => inputs_of(&amount(number)),
        }
    };
    // The curve uses any number between the ends. Try one now, so that a key of integers is rejected before the
    // computation.
    inputs_at(from * (to / from).powf(BETWEEN))?;
    drive_of(&first.recipe, path)?;
    let levels = LoadLevels {
        from,
        to,
        count: arguments.levels.map(|count| count as usize),
    };
    let cache = cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder));
    let watcher = Watcher::new(&first.recipe, path, arguments.quiet || arguments.json);
    let (cache, threads) = (cache.as_ref(), threads_or_cores(arguments.threads));
    let backbone = stages::resonance_of_scenes(inputs_at, cache, levels, threads, &watcher);
    watcher.finish();
    let with_value = |error| match error {
        CliError::OverAt { .. } => error,
        _ => error_at(&amount(last_number.get()), error),
    };
    let (backbone, broken) = backbone.map_err(with_value)?;
    let broken = broken.map(with_value);
    let points = backbone.points.iter();
    let values = points.map(|point| Ok(in_si(&amount(point.level))?.0));
    let values = values.collect::<Result<_, CliError>>()?;
    let key = key.to_owned();
    Ok(StateBackbone {
        over: Some(LevelParameter { key, unit, values }),
        broken,
        ..state_backbone(&first, 0, 0, backbone)
    })
}

fn run_backbone(arguments: &BackboneArguments, source: &Source) -> Result<StateBackbone, CliError> {
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
    let threads = threads_or_cores(arguments.threads);
    let backbone =
        stages::backbone_of_run(&reader, &inputs, wear_iteration, levels, threads, &watcher);
    watcher.finish();
    let cycles = summary.cycles.unwrap_or(0) as u64;
    Ok(state_backbone(&inputs, wear_iteration, cycles, backbone?))
}

fn state_backbone(
    inputs: &Inputs,
    wear_iteration: u64,
    cycles: u64,
    backbone: Backbone,
) -> StateBackbone {
    StateBackbone {
        name: String::new(),
        wear_iteration,
        cycles,
        scene_hash: stages::identity_of(inputs).scene_hash(),
        backbone,
        over: None,
        broken: None,
    }
}

/// Returns the half range of the drive of a scene \[N\]. Reports an error if the scene has no drive, or no frequency
/// range.
fn drive_of(recipe: &Recipe, path: &Path) -> Result<f64, CliError> {
    let response = recipe.response.as_ref();
    let forces = response.map_or(&[][..], |response| &response.forces);
    let drive = forces
        .iter()
        .find(|force| force.harmonic == 1 && force.amplitude > 0.0);
    let path = path.to_owned();
    match (drive, response.and_then(|response| response.frequency)) {
        (None, _) => Err(CliError::NothingVibrates { path }),
        (Some(_), None) => Err(CliError::NoRange { path }),
        (Some(drive), Some(_)) => Ok(drive.amplitude),
    }
}

/// Returns the requested levels. Missing ends follow from the drive of the scene.
fn levels(
    arguments: &BackboneArguments,
    recipe: &Recipe,
    path: &Path,
) -> Result<LoadLevels, CliError> {
    let drive = drive_of(recipe, path)?;
    let force_of = |end, amount: &Option<Amount>| -> Result<Option<f64>, CliError> {
        amount.as_ref().map(|amount| force(end, amount)).transpose()
    };
    let from = force_of("--from", &arguments.from)?.unwrap_or(drive / 1000.0);
    let to = force_of("--to", &arguments.to)?.unwrap_or(2.0 * drive);
    match from < to {
        true => Ok(LoadLevels {
            from,
            to,
            count: arguments.levels.map(|count| count as usize),
        }),
        false => Err(CliError::Levels { from, to }),
    }
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    output::write(path, bytes)
        .map(drop)
        .map_err(|source| CliError::Export {
            path: path.to_owned(),
            source,
        })
}

impl StateBackbone {
    /// Describes a level.
    fn level(&self, level: f64) -> String {
        match &self.over {
            Some(over) => {
                let value = format!("{} = {level:.6} {}", over.key, over.unit);
                value.trim_end().to_owned()
            }
            None => format!("{level:.6} N"),
        }
    }

    /// Describes where the backbone begins, if the backbone begins after the first level.
    fn begin(&self) -> Option<String> {
        let backbone = &self.backbone;
        let (point, error) = (backbone.points.first()?, backbone.begin.as_ref()?);
        Some(format!(
            "it begins at {}: no phase resonance was found before ({error})",
            self.level(point.level)
        ))
    }

    /// Describes where the backbone folds back.
    fn folds(&self) -> Option<String> {
        let folds = self.backbone.folds.iter();
        let folds: Vec<String> = folds.map(|level| self.level(*level)).collect();
        (!folds.is_empty()).then(|| {
            format!(
                "it folds back at {} and jumps: the part between the branches is not computed",
                folds.join(", at ")
            )
        })
    }

    /// Describes where and why the backbone ends, if the backbone ends before the last level.
    fn end(&self) -> Option<String> {
        match &self.backbone.end {
            BackboneEnd::Reached => None,
            BackboneEnd::Unbounded { level, growth } if self.over.is_some() => Some(format!(
                "it ends before {}: the amplitude grows without bound (at last by {:.0} % per percent of {}), because friction is at its limit \
                 or there is no damping",
                self.level(*level),
                growth.abs(),
                self.over.as_ref().map_or("", |over| over.key.as_str())
            )),
            BackboneEnd::Unbounded { level, growth } => Some(format!(
                "it ends below {}: friction is at its limit and nothing else bounds the amplitude (it last grew by \
                 {growth:.0} % per percent of force); add damping (dynamics.damping_ratio, structure.damping)",
                self.level(*level)
            )),
            BackboneEnd::Ceased { level, source } => Some(format!(
                "it ends before {}, where no phase resonance was found: {source}",
                self.level(*level)
            )),
            BackboneEnd::StructureError { level } => Some(match &self.broken {
                Some(error) => format!("it ends with an error: {error}"),
                None => format!("it ends before {}", self.level(*level)),
            }),
            BackboneEnd::OtherMode { level } => Some(format!(
                "it ends before {}: the next phase resonance belongs to another mode, more than 5 % away in frequency",
                self.level(*level)
            )),
        }
    }
}

fn print(state_backbone: &StateBackbone, out: &mut Results) {
    let StateBackbone { name, backbone, .. } = state_backbone;
    let wear = match state_backbone.cycles {
        0 => "unworn".to_owned(),
        cycles => format!("after {} cycles", grouped(cycles)),
    };
    writeln!(out, "{name}, {wear}");
    let value = |text: &str| {
        let parameter = state_backbone.over.as_ref();
        parameter.map_or(String::new(), |_| format!("{text:>12} "))
    };
    if let Some(over) = &state_backbone.over {
        let unit = match over.unit.as_str() {
            "" => String::new(),
            unit => format!(" in {unit}"),
        };
        writeln!(out, "over {}{unit}", over.key);
    }
    writeln!(
        out,
        "{}{:>12} {:>12} {:>12} {:>10} {:>12} {:>12} {:>8}",
        value("value"),
        "force",
        "amplitude",
        "frequency",
        "damping",
        "friction",
        "damped",
        "sliding"
    );
    writeln!(
        out,
        "{}{:>12} {:>12} {:>12} {:>10} {:>12} {:>12} {:>8}",
        value(""),
        "N",
        "m",
        "Hz",
        "ratio",
        "J per cycle",
        "J per cycle",
        "%"
    );
    let mut branch = 0;
    for point in &backbone.points {
        if point.branch != branch {
            branch = point.branch;
            writeln!(out, "{:>12}", "a jump");
        }
        writeln!(
            out,
            "{}{:>12.5e} {:>12.5e} {:>12.4} {:>10.3e} {:>12.4e} {:>12.4e} {:>8.1}",
            value(&format!("{:.5e}", point.level)),
            point.force,
            point.amplitude,
            point.frequency,
            point.damping_ratio,
            point.energy.friction,
            point.energy.viscous + point.energy.hysteretic,
            100.0 * point.sliding_fraction()
        );
    }
    for remark in [
        state_backbone.begin(),
        state_backbone.folds(),
        state_backbone.end(),
    ]
    .into_iter()
    .flatten()
    {
        writeln!(out, "{remark}");
    }
}

fn json_object(state_backbone: &StateBackbone) -> Value {
    let backbone = &state_backbone.backbone;
    let value_at = |k: usize| state_backbone.over.as_ref().map(|over| over.values[k]);
    let points = backbone.points.iter().enumerate().map(|(k, point)| {
        json!({
            "value": value_at(k),
            "branch": point.branch,
            "force": point.force,
            "frequency": point.frequency,
            "damping_ratio": point.damping_ratio,
            "amplitude": point.amplitude,
            "kinetic_energy": point.kinetic_energy,
            "input_energy": point.energy.load_work,
            "friction_energy": point.energy.friction,
            "viscous_energy": point.energy.viscous,
            "hysteretic_energy": point.energy.hysteretic,
            "sliding_fraction": point.sliding_fraction(),
            "open_fraction": point.open_fraction(),
        })
    });
    json!({
        "state": state_backbone.name,
        "wear_iteration": state_backbone.wear_iteration,
        "cycles": state_backbone.cycles,
        "over": state_backbone.over.as_ref().map(|over| over.key.as_str()),
        "begin": state_backbone.begin(),
        "folds": state_backbone.folds(),
        "end": state_backbone.end(),
        "solves": backbone.solves,
        "iterations": backbone.iterations,
        "points": points.collect::<Vec<_>>(),
    })
}
