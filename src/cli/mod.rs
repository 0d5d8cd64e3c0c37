//! The command line: arguments in, exit codes out. Results go to stdout, everything else to stderr.

mod backbone;
mod check;
#[cfg(feature = "polars")]
mod compare;
mod cost;
mod doctor;
mod edit;
mod explain;
mod export;
mod many;
mod new;
mod report;
#[cfg(feature = "polars")]
mod report_command;
#[cfg(feature = "polars")]
mod reproduce;
mod run;
mod schema;
mod show;
mod stage;
mod status;
mod trade;

use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use fretwear::report::trade::TradeError;
use fretwear::scene::{InputError, KeptError, SceneError};
use fretwear::stages::RunError;
use fretwear::store::StoreError;
use fretwear::structure::StructureError;
use fretwear::units::{self, Dimension};

use crate::terminal::{Results, say};

/// How a command ends, as its exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Exit {
    Done = 0,
    Failure = 1,
    Scene = 2,
    NotConverged = 3,
    Damaged = 4,
    Stopped = 75,
}

impl From<Exit> for ExitCode {
    fn from(exit: Exit) -> ExitCode {
        ExitCode::from(exit as u8)
    }
}

/// Fretting wear of rough bolted joints over millions of vibration cycles.
#[derive(Parser)]
#[command(version, long_version = fretwear::VERSION, after_help = EXIT_CODES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXIT_CODES: &str = "Exit codes: 0 done, 1 failure, 2 usage or scene, 3 not converged (the last commit is kept), \
                          4 damaged or mismatched run, 75 stopped and resumable";

#[derive(Subcommand)]
enum Command {
    /// Run a scene, or continue its run
    ///
    /// The same command twice is right: a run continues from its last commit, and a finished one prints its summary again.
    Run(RunArguments),
    /// Say what a scene will compute, why, and what it costs
    ///
    /// The cost is rehearsed on coarser grids, in some seconds. A run that was planned computes the same as one that was not.
    Plan {
        #[command(flatten)]
        scene: SceneArguments,
        /// Everything but the cost, at once
        #[arg(long)]
        no_rehearsal: bool,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
        /// Print the stages and the tables between them, as a Mermaid flowchart
        #[arg(long, conflicts_with = "json")]
        graph: bool,
    },
    /// Say all that is wrong with scenes, and what is doubtful, at once
    ///
    /// Each error has its file and line, the key, its value, and what would be right. Nothing is computed. Ends with 2 if a scene has an
    /// error.
    Check {
        /// The scenes (TOML)
        #[arg(required = true, value_name = "SCENE")]
        scenes: Vec<PathBuf>,
        /// Change a key in all of them, as in `--set wear.cycles=1e6`
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<String>,
        /// Print one JSON object a scene
        #[arg(long)]
        json: bool,
    },
    /// Compute a stage of a committed iteration again, from the tables of the run and the files that its scene names
    ///
    /// Says whether the tables are the same to the last bit. A table that a later stage writes again is computed on the way, by the
    /// stage that wrote it first. The run is not changed.
    Stage(StageArguments),
    /// Frequency, damping ratio and amplitude of the resonance over the level of the force
    ///
    /// Of the unworn joint of a scene, which is computed in memory, or of the joint as it is worn at an iteration of a run, which is not
    /// changed; of several in one table and one picture. Where friction cannot bound the amplitude any more, the curve ends and says so.
    Backbone(backbone::BackboneArguments),
    /// Say how far a run is
    Status {
        /// Folder of the run
        run: PathBuf,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Write a commented scene of your own that runs
    ///
    /// At a terminal, without --like and --set, it asks for what differs from joint to joint.
    #[command(after_help = new::examples())]
    New {
        /// File to write; it must not be there yet
        #[arg(value_name = "FILE")]
        path: PathBuf,
        /// The scene to begin from [default: prescribed_fretting]
        #[arg(long, value_name = "NAME")]
        like: Option<String>,
        /// Change a value of it, as in `--set contact.normal_load="20 kN"`; its comments stay
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<String>,
    },
    /// List the runs of a folder: state, progress, worn volume
    Ls {
        /// The folder
        #[arg(value_name = "FOLDER", default_value = "runs")]
        folder: PathBuf,
        /// Print one JSON object a run
        #[arg(long)]
        json: bool,
    },
    /// Check every file of a run against its hash
    Verify {
        /// Folder of the run
        run: PathBuf,
    },
    /// Run the closed forms: error and order of convergence
    Validate {
        /// Print one JSON object a row
        #[arg(long)]
        json: bool,
    },
    /// Measure what accuracy costs: run a scene's presets and single knobs, and compare them
    ///
    /// Every variant is a run of its own under the folder, against the preset `reference`. The same command goes on where it was
    /// stopped. Writes trade.parquet, trade.md, trade.svg and trade.html, and prints the table.
    Trade(TradeArguments),
    /// Run the paper's study, and hold its claims against it
    ///
    /// The lap joint at four roughnesses, with a hardness limit, and with the dynamic model updated more often, less often, never:
    /// eight runs in the folder, their scenes in its `scenes`. The same command goes on where it was stopped. Writes claims.md and
    /// claims.parquet, and prints the claims with what was measured.
    #[cfg(feature = "polars")]
    Reproduce(ReproduceArguments),
    /// Explain a key of a scene: what it means, what it may be, its default, an example
    Explain {
        /// A key, as `contact.normal_load`, or a section, as `contact`
        key: String,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Explain the tables of a run and their columns, or the keys of a scene
    Schema {
        /// Name of a table, or `scene` for the keys of a scene; all tables without
        table: Option<String>,
        /// As Markdown, for a documentation
        #[arg(long)]
        markdown: bool,
        /// Print one JSON object, by the names of tables or keys
        #[arg(long, conflicts_with = "markdown")]
        json: bool,
        /// Print the JSON Schema of scenes, for an editor
        #[arg(long, conflicts_with_all = ["markdown", "json"])]
        json_schema: bool,
    },
    /// Check whether this machine can compute runs and keep them
    ///
    /// Space, commits, locks and tables in the folder; processor, transforms and factors; the cache of structures. Nothing is left
    /// behind. Ends with 1 if something fails.
    Doctor {
        /// Where runs go
        #[arg(default_value = "runs")]
        dir: PathBuf,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Print the completions of the command line for a shell
    ///
    /// As in `fretwear completions bash > ~/.local/share/bash-completion/completions/fretwear`.
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Write the resonator as an input deck of CalculiX and Abaqus
    ///
    /// Its free vibration, in SI units: nodes, hexahedra with incompatible modes, materials, sets, and a frequency step.
    Export(ExportArguments),
    /// Put the summaries of several runs into one table
    ///
    /// One row a run: its last iteration, with the FFT pairs of all its iterations. Values are in SI units.
    #[cfg(feature = "polars")]
    Compare(CompareArguments),
    /// Write one HTML page on a run, or on several side by side
    ///
    /// Figures with their numbers, results with error bars, what was computed and why, cost, and the scene: one file that needs no
    /// other. Also of a run that goes on.
    #[cfg(feature = "polars")]
    Report(ReportArguments),
}

#[derive(Args)]
struct SceneArguments {
    /// The scene (TOML)
    scene: PathBuf,
    /// Change a key, as in `--set wear.cycles=1e6` or `--set surface.rq="1 um"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
}

/// How runs are made.
#[derive(Args)]
struct Execution {
    /// Stop after this time, within the stage if its iteration takes longer, as in `--max-wall "8 h"`; a start has 5 s in any case
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    max_wall: Option<f64>,
    /// Threads for the contact solvers' transforms, worth it from some 128 x 128 cells; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_threads)]
    threads: usize,
    /// No progress
    #[arg(long, short)]
    quiet: bool,
}

#[derive(Args)]
struct RunArguments {
    /// The scene (TOML); without it, that of the run given by --run or --from
    #[arg(required_unless_present_any = ["run", "from"])]
    scene: Option<PathBuf>,
    /// Change a key, as in `--set wear.cycles=1e6` or `--set surface.rq="1 um"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    /// Folder of the run [default: runs/<name of the scene>]
    #[arg(long, value_name = "DIR")]
    run: Option<PathBuf>,
    /// Begin from iteration N of another run, also with changed keys
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    from: Option<fretwear::stages::Source>,
    /// End after this stage, as in `--until static_contact`; a wrong one is refused with their list
    #[arg(long, value_name = "STAGE")]
    until: Option<fretwear::stages::Stage>,
    #[command(flatten)]
    execution: Execution,
    /// Print one JSON object: the last summary, and the seconds of each stage
    #[arg(long)]
    json: bool,
    /// Print all figures of the last summary at the end, not only what wear has changed
    #[arg(long, short, conflicts_with = "json")]
    verbose: bool,
}

#[derive(Args)]
struct StageArguments {
    /// Name of the stage; a wrong one is refused with their list
    #[arg(value_name = "NAME")]
    name: fretwear::stages::Stage,
    /// The run and the iteration
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    run: fretwear::stages::Source,
    /// Write the tables into this folder, outside of runs; no file is replaced
    #[arg(long, short, value_name = "FOLDER")]
    output: Option<PathBuf>,
    /// Threads for the contact solvers' transforms; results do not depend on it
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = parse_threads)]
    threads: usize,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct TradeArguments {
    #[command(flatten)]
    scene: SceneArguments,
    /// Folder of the runs and of what is written [default: trade/<name of the scene>]
    #[arg(long, value_name = "DIR")]
    dir: Option<PathBuf>,
    /// Turn this knob only, as in `--knob wear_tolerance`; may be repeated, and `--knob preset` is the presets [default: all]
    #[arg(long = "knob", value_name = "NAME")]
    knobs: Vec<String>,
    /// The preset `paper` too, which is slow
    #[arg(long)]
    paper: bool,
    /// Most cells along the longer side of a grid, up to 1024 [default: twice those of the scene]
    #[arg(long, value_name = "N")]
    largest_grid: Option<usize>,
    #[command(flatten)]
    execution: Execution,
    /// Print one JSON object: the rows of the table, and what follows from them
    #[arg(long)]
    json: bool,
}

#[cfg(feature = "polars")]
#[derive(Args)]
struct ReproduceArguments {
    /// Folder of the runs and of what is written
    #[arg(long, value_name = "DIR", default_value = "runs/reproduce")]
    dir: PathBuf,
    /// Every scene of this folder, in place of the paper's
    #[arg(long, value_name = "FOLDER")]
    scenes: Option<PathBuf>,
    /// Change a key in all scenes, as in `--set dynamics.damping_ratio=0.01`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    sets: Vec<String>,
    #[command(flatten)]
    execution: Execution,
    /// Print one JSON object: the claims, and what was found
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
struct ExportArguments {
    /// The scene (TOML); without it, the shipped resonator
    scene: Option<PathBuf>,
    /// Change a key, as in `--set structure.leaf_thickness="12 mm"`
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    sets: Vec<String>,
    /// Where the deck goes
    #[arg(long, short, value_name = "FILE")]
    output: PathBuf,
    /// Both bodies share the nodes of the contact, as they do where there is no contact stiffness
    #[arg(long, conflicts_with = "kt")]
    tied: bool,
    /// Tangential stiffness of the whole joint, as in `--kt "1e4 N/um"`, in place of the scene's
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kn")]
    kt: Option<f64>,
    /// Normal stiffness of the whole joint, in place of the scene's
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kt")]
    kn: Option<f64>,
    /// Elastic modes to ask for
    #[arg(long, value_name = "N", default_value_t = 8)]
    modes: usize,
    /// Compute the same modes here too, and print one JSON object
    #[arg(long)]
    frequencies: bool,
}

#[cfg(feature = "polars")]
#[derive(Args)]
struct CompareArguments {
    /// Folders of the runs; among several, what is no run is passed over
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// One row for every iteration of every run
    #[arg(long)]
    all: bool,
    /// Write the table to a Parquet file too
    #[arg(long, value_name = "FILE")]
    parquet: Option<PathBuf>,
    /// Write the table to a CSV file too
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
}

#[cfg(feature = "polars")]
#[derive(Args)]
struct ReportArguments {
    /// Folders of the runs; among several, what is no run is passed over
    #[arg(required = true, value_name = "RUN")]
    runs: Vec<PathBuf>,
    /// Where the page goes [default: report.html in the run's folder; of several runs, here]
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Hold the paper's claims against the runs too, as `fretwear reproduce` does
    #[arg(long)]
    claims: bool,
    /// Write each figure to a file of its own in this folder too
    #[arg(long, value_name = "DIR")]
    svg: Option<PathBuf>,
}

/// Time is no quantity of a scene, but of the command line alone.
const TIME: Dimension = Dimension {
    m: 0,
    kg: 0,
    s: 1,
    rad: 0,
};

fn parse_time(text: &str) -> Result<f64, String> {
    match units::parse(text, TIME) {
        Ok(seconds) if seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("must be longer than 0 s".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Threads for one matrix of rows; beyond a few hundred each has nothing to do.
const MAX_THREADS: usize = 256;

fn parse_threads(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(threads) if (1..=MAX_THREADS).contains(&threads) => Ok(threads),
        _ => Err(format!("must be a number from 1 to {MAX_THREADS}")),
    }
}

fn parse_stiffness(text: &str) -> Result<f64, String> {
    match units::parse(text, Dimension::STIFFNESS) {
        Ok(stiffness) if stiffness >= 0.0 => Ok(stiffness),
        Ok(_) => Err("must not be negative".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// What a command can fail with.
#[derive(Debug, thiserror::Error)]
enum CliError {
    #[error(transparent)]
    Run(#[from] RunError),
    #[error(transparent)]
    Scene(#[from] SceneError),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error(transparent)]
    Kept(#[from] KeptError),
    #[error(
        "{source}\n{} is not as the run wrote it: remove it, and the run goes on with the scene that run.json keeps",
        path.display()
    )]
    EditedScene { path: PathBuf, source: SceneError },
    #[error("there is no run at {}; name the scene to begin it with", path.display())]
    NothingToRun { path: PathBuf },
    #[error("{table} is no table; the tables are {known}; `scene` is for the keys of a scene")]
    UnknownTable { table: String, known: String },
    #[error("tables have no JSON Schema, but scenes: fretwear schema scene --json-schema")]
    NoJsonSchema,
    #[error(transparent)]
    UnknownKey(#[from] fretwear::scene::explain::UnknownKey),
    #[error("{like} is no scene to begin from; there are {known}")]
    UnknownExample { like: String, known: String },
    #[error("cannot write {}: {source}", path.display())]
    NewScene {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} is there already, and is not replaced: give another name, or remove it", path.display())]
    SceneIsThere { path: PathBuf },
    #[error(
        "{key} stands on no line of its own in the scene {like}; change it in the file that is written"
    )]
    NoLine { key: String, like: String },
    #[error("cannot list {}: {source}", path.display())]
    Folder {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("cannot watch for signals: {0}")]
    Signals(std::io::Error),
    #[error("{} has no [structure] of kind \"resonator\" to export", path.display())]
    NothingToExport { path: PathBuf },
    #[error(
        "the stiffness of this joint follows from its surface, in a run; give --kt and --kn (a run's summary has them), or --tied"
    )]
    UnknownStiffness,
    #[error("cannot write {}: {source}", path.display())]
    Export {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error(transparent)]
    Structure(#[from] StructureError),
    #[cfg(feature = "polars")]
    #[error("there is no scene (*.toml) in {}", path.display())]
    NoScenes { path: PathBuf },
    #[cfg(feature = "polars")]
    #[error("{}: {source}", path.display())]
    Scenes {
        path: PathBuf,
        source: std::io::Error,
    },
    #[error("{} lies within the run {}; give a folder outside of it", path.display(), run.display())]
    WithinARun { path: PathBuf, run: PathBuf },
    #[error(
        "{stage} of iteration {wear_iteration} is not the same: {tables}; the run was computed by another version or on another processor, or its end, or the responses asked for, were others then"
    )]
    NotTheSame {
        stage: fretwear::stages::Stage,
        wear_iteration: u64,
        tables: String,
    },
    #[error("validation: {0}")]
    Validate(#[from] fretwear::validate::ValidateError),
    #[error(
        "{} has no harmonic force in [dynamics]: nothing vibrates whose backbone could be followed",
        path.display()
    )]
    NothingVibrates { path: PathBuf },
    #[error(
        "the backbone is to begin at {from} N and to end at {to} N; --from must be less than --to (without them: a thousandth of the scene's force, and twice it)"
    )]
    Levels { from: f64, to: f64 },
    #[error(
        "--set changes the keys of scenes, and a run has its own: name a scene too, or begin a run with `fretwear run --from RUN@K --set …`"
    )]
    SetOfARun,
    #[cfg(feature = "polars")]
    #[error("cannot draw the backbone: {0}")]
    Drawing(fretwear::report::PlotError),
    #[error(transparent)]
    Knob(#[from] fretwear::scene::variants::UnknownKnob),
    #[error(transparent)]
    Trade(#[from] TradeError),
    #[cfg(feature = "polars")]
    #[error(transparent)]
    Report(#[from] fretwear::report::ReportError),
}

impl From<StoreError> for CliError {
    fn from(error: StoreError) -> Self {
        CliError::Run(error.into())
    }
}

impl CliError {
    fn exit(&self) -> Exit {
        match self {
            CliError::Run(error) if error.is_scene() => Exit::Scene,
            CliError::NotTheSame { .. } => Exit::Damaged,
            CliError::Scene(_) | CliError::Input(_) | CliError::Kept(_) => Exit::Scene,
            CliError::Run(error) if error.is_not_converged() => Exit::NotConverged,
            CliError::Run(RunError::Store(error)) if error.is_damage_or_mismatch() => Exit::Damaged,
            CliError::Run(RunError::Store(
                StoreError::NoRun { .. } | StoreError::NoIteration { .. },
            ))
            | CliError::EditedScene { .. }
            | CliError::NothingToRun { .. }
            | CliError::UnknownTable { .. }
            | CliError::UnknownExample { .. }
            | CliError::NoLine { .. }
            | CliError::NoJsonSchema
            | CliError::UnknownKey(_)
            | CliError::NothingToExport { .. }
            | CliError::NothingVibrates { .. }
            | CliError::Levels { .. }
            | CliError::SetOfARun
            | CliError::Knob(_)
            | CliError::UnknownStiffness
            | CliError::Structure(
                StructureError::OutOfRange { .. } | StructureError::DoNotFit { .. },
            ) => Exit::Scene,
            CliError::Structure(StructureError::NotConverged { .. }) => Exit::NotConverged,
            CliError::Trade(TradeError::Store(error)) if error.is_damage_or_mismatch() => {
                Exit::Damaged
            }
            #[cfg(feature = "polars")]
            CliError::Report(error) if error.is_nothing_to_read() => Exit::Scene,
            #[cfg(feature = "polars")]
            CliError::NoScenes { .. } => Exit::Scene,
            #[cfg(feature = "polars")]
            CliError::Report(error) if error.is_damage_or_mismatch() => Exit::Damaged,
            _ => Exit::Failure,
        }
    }
}

/// Prints the completions for a shell.
fn completions(shell: Shell, out: &mut Results) -> Exit {
    // The generator panics where it cannot write, so that it writes into memory.
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "fretwear", &mut script);
    write!(out, "{}", String::from_utf8_lossy(&script));
    Exit::Done
}

/// Runs the command that the arguments name.
pub fn main() -> ExitCode {
    let command = match Cli::try_parse() {
        Ok(cli) => cli.command,
        Err(answer) => return answered(&answer),
    };
    let mut out = Results::default();
    let exit = perform(command, &mut out).unwrap_or_else(|error| {
        // Of a scene all that is wrong is said, a line each.
        let exit = error.exit();
        match error {
            CliError::Scene(error) => error.into_each().for_each(|e| say(&format!("error: {e}"))),
            error => say(&format!("error: {error}")),
        }
        exit
    });
    match out.end() {
        Ok(()) => exit.into(),
        Err(error) => unprinted(&error, exit).into(),
    }
}

fn perform(command: Command, out: &mut Results) -> Result<Exit, CliError> {
    match command {
        Command::Run(arguments) => run::run(arguments, out),
        Command::Plan { scene, graph, .. } if graph => show::graph(&scene.scene, &scene.sets, out),
        Command::Plan {
            scene,
            no_rehearsal,
            json,
            ..
        } => show::plan(&scene.scene, &scene.sets, !no_rehearsal, json, out),
        Command::Check { scenes, sets, json } => Ok(check::check(&scenes, &sets, json, out)),
        Command::Stage(arguments) => stage::stage(&arguments, out),
        Command::Backbone(arguments) => backbone::backbone(&arguments, out),
        Command::Status { run, json } => status::status(&run, json, out),
        Command::New { path, like, sets } => new::new(&path, like.as_deref(), &sets, out),
        Command::Ls { folder, json } => new::list(&folder, json, out),
        Command::Verify { run } => show::verify(&run, out),
        Command::Validate { json } => show::validate(json, out),
        Command::Trade(arguments) => trade::trade(&arguments, out),
        #[cfg(feature = "polars")]
        Command::Reproduce(arguments) => reproduce::reproduce(&arguments, out),
        Command::Explain { key, json } => explain::explain(&key, json, out),
        Command::Schema {
            table,
            markdown,
            json,
            json_schema,
        } => {
            let form = schema::Form::of(markdown, json, json_schema);
            schema::schema(table.as_deref(), form, out)
        }
        Command::Doctor { dir, json } => doctor::doctor(&dir, json, out),
        Command::Completions { shell } => Ok(completions(shell, out)),
        Command::Export(arguments) => export::export(&arguments, out),
        #[cfg(feature = "polars")]
        Command::Compare(arguments) => compare::compare(&arguments, out),
        #[cfg(feature = "polars")]
        Command::Report(arguments) => report_command::report(&arguments, out),
    }
}

/// How a command ends whose result could not be printed: what became of a run counts for more.
fn unprinted(error: &std::io::Error, exit: Exit) -> Exit {
    say(&format!("error: cannot write the result: {error}"));
    match exit {
        Exit::Done => Exit::Failure,
        other => other,
    }
}

/// Says what is wrong with the arguments, or what was asked of the command line itself: help, and the version.
fn answered(answer: &clap::Error) -> ExitCode {
    let exit = ExitCode::from(answer.exit_code() as u8);
    match answer.print() {
        // A result like any other.
        Err(error) if !answer.use_stderr() && error.kind() != ErrorKind::BrokenPipe => {
            unprinted(&error, Exit::Done).into()
        }
        _ => exit,
    }
}
