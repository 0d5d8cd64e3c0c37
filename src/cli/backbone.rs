//! `fretwear backbone`: frequency, damping ratio and amplitude over the level of the force, or over a key of the scene.

use std::cell::Cell;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use fretwear::dynamics::{Backbone, BackboneEnd, LoadLevels};
use fretwear::recipe::{Inputs, Recipe};
use fretwear::report::{output, word};
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
    /// Scenes (TOML), of which the unworn joint is meant, and iterations of runs, as in `runs/lap@37`
    #[arg(required = true, value_name = "SCENE|RUN@K", value_parser = State::parse)]
    states: Vec<State>,
    /// Change a key of the scenes, as in `--set contact.normal_load="20 kN"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Follow the resonance over this key of the scenes in place of the force, from `--from` to `--to`, up or down, as in
    /// `--over contact.normal_load --from "2 kN" --to "500 N"`
    #[arg(long, value_name = "KEY", requires = "from", requires = "to")]
    over: Option<String>,
    /// Force to begin at, half range of the drive, as in `--from "1 N"` [default: a thousandth of that of the scene]; with `--over` a value of
    /// its key
    #[arg(long, value_name = "FORCE|VALUE", value_parser = parse_amount, allow_hyphen_values = true)]
    from: Option<Amount>,
    /// Force or value to end at [default: twice the force of the scene]
    #[arg(long, value_name = "FORCE|VALUE", value_parser = parse_amount, allow_hyphen_values = true)]
    to: Option<Amount>,
    /// Levels of equal ratio, both ends included, from 2 to 10 000 [default: where the curve needs them]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..=10_000))]
    levels: Option<u64>,
    /// Write the table to this Parquet file
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Draw all of them in one picture: frequency and damping ratio over amplitude, amplitude over force
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
    /// Threads; results do not depend on it [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    threads: Option<usize>,
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
        match (parse_source(text), Path::new(text)) {
            (Ok(source), path) if !path.is_file() => Ok(State::Run(source)),
            (Err(_), path) if path.is_dir() => Err(format!(
                "a folder: of a run say which iteration is meant, as in {text}@0 (`fretwear status {text}` tells the last)"
            )),
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

impl BackboneArguments {
    /// Nothing that is written takes the place of a scene, or of what else is written.
    fn check_outputs(&self) -> Result<(), CliError> {
        let place = |path: &PathBuf| path.canonicalize().unwrap_or_else(|_| path.clone());
        let mut taken: Vec<PathBuf> = Vec::new();
        taken.extend(self.states.iter().filter_map(|state| match state {
            State::Scene(path) => Some(place(path)),
            State::Run(_) => None,
        }));
        let outputs = self.output.iter().chain(&self.svg);
        for path in outputs {
            if taken.contains(&place(path)) {
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
            taken.push(place(path));
        }
        Ok(())
    }
}

/// Share of the way between two values, in ratios, that hardly leads from integers to an integer.
const BETWEEN: f64 = 0.382;

/// True for a setting, `KEY=VALUE`, of a key.
fn is_of(set: &str, key: &str) -> bool {
    set.split_once('=')
        .is_some_and(|(name, _)| name.trim() == key)
}

/// A state with its backbone.
struct Found {
    name: String,
    wear_iteration: u64,
    cycles: u64,
    scene_hash: String,
    backbone: Backbone,
    over: Option<LevelParameter>,
    /// Why it ends where it is not for the resonance.
    broken: Option<CliError>,
}

/// What varies in place of the force.
struct LevelParameter {
    key: String,
    /// That of the levels.
    unit: String,
    /// Of each point, in SI units.
    values: Vec<f64>,
}

fn parse_amount(text: &str) -> Result<Amount, String> {
    match Amount::parse(text) {
        Some(amount) if units::SIZES.contains(&amount.number) => Ok(amount),
        Some(amount) if amount.number > 0.0 => Err("must be from 1e-60 to 1e60".to_owned()),
        Some(amount) => Err(format!("must be more than 0 {}", amount.unit)
            .trim_end()
            .to_owned()),
        None => Err("must be a number, or one with a unit as in \"20 kN\"".to_owned()),
    }
}

/// A force, half range of the drive \[N\].
fn force(end: &'static str, amount: &Amount) -> Result<f64, CliError> {
    let wrong = |reason| CliError::Level { end, reason };
    match units::parse(&amount.to_string(), Dimension::FORCE) {
        Ok(force) if units::SIZES.contains(&force) => Ok(force),
        Ok(_) => Err(wrong("must be from 1e-60 N to 1e60 N".to_owned())),
        Err(error) => Err(wrong(error.to_string())),
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
        && let Some(set) = arguments.sets.iter().find(|set| is_of(set, key))
    {
        let (key, set) = (key.clone(), set.clone());
        return Err(CliError::OverASet { key, set });
    }
    #[cfg(not(feature = "polars"))]
    if arguments.svg.is_some() {
        return Err(CliError::NoPolars);
    }
    arguments.check_outputs()?;
    let mut all: Vec<Found> = Vec::new();
    let mut failed = None;
    for state in &arguments.states {
        let found = match (state, &arguments.over) {
            (State::Scene(path), Some(key)) => over_key(arguments, path, key),
            (State::Scene(path), None) => of_scene(arguments, path),
            (State::Run(source), _) => of_run(arguments, source),
        };
        match found {
            Ok(found) => all.push(Found {
                name: state.name(),
                ..found
            }),
            Err(error) if all.is_empty() => return Err(error),
            Err(error) => failed = Some(error),
        }
        if failed.is_some() || all.last().is_some_and(|found| found.broken.is_some()) {
            break;
        }
    }
    let mut table = typed::Backbone::default();
    for found in &all {
        let wear = (found.wear_iteration, found.cycles);
        let over = found.over.as_ref();
        let over = over.map(|over| (over.key.as_str(), over.values.as_slice()));
        stages::add_backbone(&mut table, &found.name, wear, &found.backbone, over);
    }
    // What cannot be written is not lost either.
    match arguments.json {
        true => out.json(&json!({ "states": all.iter().map(object).collect::<Vec<_>>() })),
        false => all.iter().for_each(|found| print(found, out)),
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
        let svg = fretwear::report::backbone_svg(&table);
        write(path, svg.as_bytes())?;
    }
    // What was found before an error is not lost with it.
    let failed = failed.or_else(|| all.pop()?.broken);
    failed.map_or(Ok(Exit::Done), Err)
}

fn of_scene(arguments: &BackboneArguments, path: &Path) -> Result<Found, CliError> {
    let inputs = Plan::of(&scene::load(path, &arguments.sets)?)?.inputs;
    let levels = levels(arguments, &inputs.recipe, path)?;
    let cache = cache_folder().map(|folder| Cache::new(Arc::new(RealFileSystem), &folder));
    let watcher = Watcher::new(&inputs.recipe, path, arguments.quiet || arguments.json);
    let cache = cache.as_ref();
    let threads = threads_or_cores(arguments.threads);
    let backbone = stages::backbone_of_scene(&inputs, cache, levels, threads, &watcher);
    watcher.finish();
    Ok(found(&inputs, 0, 0, backbone?))
}

/// The resonance of a scene over one of its keys.
fn over_key(arguments: &BackboneArguments, path: &Path, key: &str) -> Result<Found, CliError> {
    let ends = [&arguments.from, &arguments.to].map(|end| end.clone().expect("--over wants both"));
    let at = |value: &Amount, source: CliError| CliError::OverAt {
        key: key.to_owned(),
        value: value.to_string(),
        source: Box::new(source),
    };
    let inputs_of = |value: &Amount| -> Result<Inputs, CliError> {
        let mut sets = arguments.sets.clone();
        sets.push(format!("{key}={value}"));
        let plan = || -> Result<Plan, CliError> { Ok(Plan::of(&scene::load(path, &sets)?)?) };
        Ok(plan().map_err(|error| at(value, error))?.inputs)
    };
    let first = inputs_of(&ends[0])?;
    inputs_of(&ends[1])?;
    let in_si = |amount: &Amount| {
        let found = units::parse_any(&amount.to_string());
        found.map_err(|problem| CliError::Level {
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
    // A value ends before a stop does: what it has cost is not lost.
    let asked = ForwardedSignals::listen_once(i32::from(Exit::Stopped.code()))
        .map_err(CliError::Signals)?;
    let reached = Cell::new(from);
    let amount = |number: f64| Amount {
        number,
        unit: unit.clone(),
    };
    let inputs_at = |number: f64| {
        reached.set(number);
        match asked.is_asked() {
            true => Err(CliError::AskedToStop),
            false => inputs_of(&amount(number)),
        }
    };
    // The curve takes any number between the ends: a key of integers is refused before anything is computed.
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
    let told = |error| match error {
        CliError::OverAt { .. } => error,
        _ => at(&amount(reached.get()), error),
    };
    let (backbone, broken) = backbone.map_err(told)?;
    let broken = broken.map(told);
    let points = backbone.points.iter();
    let values = points.map(|point| Ok(in_si(&amount(point.level))?.0));
    let values = values.collect::<Result<_, CliError>>()?;
    let key = key.to_owned();
    Ok(Found {
        over: Some(LevelParameter { key, unit, values }),
        broken,
        ..found(&first, 0, 0, backbone)
    })
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
    let threads = threads_or_cores(arguments.threads);
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
        over: None,
        broken: None,
    }
}

/// Half range of the drive of a scene \[N\], which has a range for resonances.
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

/// The levels asked for; what is not said follows from the drive of the scene.
fn levels(
    arguments: &BackboneArguments,
    recipe: &Recipe,
    path: &Path,
) -> Result<LoadLevels, CliError> {
    let drive = drive_of(recipe, path)?;
    let given = |end, amount: &Option<Amount>| -> Result<Option<f64>, CliError> {
        amount.as_ref().map(|amount| force(end, amount)).transpose()
    };
    let from = given("--from", &arguments.from)?.unwrap_or(drive / 1000.0);
    let to = given("--to", &arguments.to)?.unwrap_or(2.0 * drive);
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

impl Found {
    /// A level in words.
    fn level(&self, level: f64) -> String {
        match &self.over {
            Some(over) => {
                let value = format!("{} = {level:.6} {}", over.key, over.unit);
                value.trim_end().to_owned()
            }
            None => format!("{level:.6} N"),
        }
    }

    /// Where the backbone begins behind the first level, in words.
    fn begin(&self) -> Option<String> {
        let backbone = &self.backbone;
        let (point, error) = (backbone.points.first()?, backbone.begin.as_ref()?);
        Some(format!(
            "it begins at {}: before, no phase resonance was found ({error})",
            self.level(point.level)
        ))
    }

    /// Where the backbone folds back, in words.
    fn folds(&self) -> Option<String> {
        let folds = self.backbone.folds.iter();
        let folds: Vec<String> = folds.map(|level| self.level(*level)).collect();
        (!folds.is_empty()).then(|| {
            format!(
                "it folds back at {} and leaps: what lies between the branches is not computed",
                folds.join(", at ")
            )
        })
    }

    /// Where the backbone ends before the last level, in words.
    fn end(&self) -> Option<String> {
        match &self.backbone.end {
            BackboneEnd::Reached => None,
            BackboneEnd::Unbounded { level, growth } if self.over.is_some() => Some(format!(
                "it ends before {}: the amplitude grows without bound (by {:.0} % a percent of {} at last), as friction at its limit or no \
                 damping makes it",
                self.level(*level),
                growth.abs(),
                self.over.as_ref().map_or("", |over| over.key.as_str())
            )),
            BackboneEnd::Unbounded { level, growth } => Some(format!(
                "it ends below {}: friction at its limit bounds no amplitude above, and nothing else does (before, the amplitude has grown by \
                 {growth:.0} % a percent of force); damping (dynamics.damping_ratio, structure.damping) would",
                self.level(*level)
            )),
            BackboneEnd::Ceased { level, source } => Some(format!(
                "it ends before {}, where no phase resonance was found: {source}",
                self.level(*level)
            )),
            BackboneEnd::Broken { level } => Some(match &self.broken {
                Some(error) => format!("an error ends it: {error}"),
                None => format!("it ends before {}", self.level(*level)),
            }),
            BackboneEnd::OtherMode { level } => Some(format!(
                "it ends before {}: the next phase resonance is that of another mode, more than 5 % away in frequency",
                self.level(*level)
            )),
        }
    }
}

fn print(found: &Found, out: &mut Results) {
    let Found { name, backbone, .. } = found;
    let wear = match found.cycles {
        0 => "unworn".to_owned(),
        cycles => format!("after {} cycles", grouped(cycles)),
    };
    writeln!(out, "{name}, {wear}");
    let value = |text: &str| {
        let of_key = found.over.as_ref();
        of_key.map_or(String::new(), |_| format!("{text:>12} "))
    };
    if let Some(over) = &found.over {
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
        "J a cycle",
        "J a cycle",
        "%"
    );
    let mut branch = 0;
    for point in &backbone.points {
        if point.branch != branch {
            branch = point.branch;
            writeln!(out, "{:>12}", "a leap");
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
    for remark in [found.begin(), found.folds(), found.end()]
        .into_iter()
        .flatten()
    {
        writeln!(out, "{remark}");
    }
}

fn object(found: &Found) -> Value {
    let backbone = &found.backbone;
    let of_key = |k: usize| found.over.as_ref().map(|over| over.values[k]);
    let points = backbone.points.iter().enumerate().map(|(k, point)| {
        json!({
            "value": of_key(k),
            "branch": point.branch,
            "force": point.force,
            "frequency": point.frequency,
            "damping_ratio": point.damping_ratio,
            "amplitude": point.amplitude,
            "kinetic_energy": point.kinetic_energy,
            "input_energy": point.energy.input,
            "friction_energy": point.energy.friction,
            "viscous_energy": point.energy.viscous,
            "hysteretic_energy": point.energy.hysteretic,
            "sliding_fraction": point.sliding_fraction(),
            "open_fraction": point.open_fraction(),
        })
    });
    json!({
        "state": found.name,
        "wear_iteration": found.wear_iteration,
        "cycles": found.cycles,
        "over": found.over.as_ref().map(|over| over.key.as_str()),
        "begin": found.begin(),
        "folds": found.folds(),
        "end": found.end(),
        "solves": backbone.solves,
        "iterations": backbone.iterations,
        "points": points.collect::<Vec<_>>(),
    })
}
