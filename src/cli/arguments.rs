//! The arguments of every command: what `--help` says, and the limits that are known without a scene.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use clap_complete::Shell;
use fretwear::units::{self, Dimension};

use super::{backbone, campaign, export_contact, inspect, new, run, when};

/// Fretting wear of rough bolted joints over millions of vibration cycles.
#[derive(Parser)]
#[command(version, long_version = fretwear::VERSION, after_help = EXIT_CODES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes:
  0 done; 1 failure; 2 wrong usage or scene; 3 not converged (the last commit is kept);
  4 damaged or mismatched run; 75 stopped, can be continued";

#[derive(Subcommand)]
pub enum Command {
    /// Run a scene, or continue its run
    ///
    /// The same command twice is right: a run continues from its last commit, and a finished one prints its summary again.
    Run(RunArguments),
    /// Show what a scene will compute, why, and what it costs
    ///
    /// Counts memory, unknowns and disk per iteration. Estimates iterations, FFT pairs, time and total disk from a run of a few seconds on a
    /// coarser grid. The plan does not change the results of the run.
    Plan {
        #[command(flatten)]
        scene: SceneArguments,
        /// Skip the coarse run and the whole cost
        #[arg(long)]
        no_rehearsal: bool,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
        /// Print the stages and the tables between them, as a Mermaid flowchart
        #[arg(long, conflicts_with = "json")]
        graph: bool,
    },
    /// Check scenes for errors and warnings
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
    /// Compute a stage of a committed iteration again
    ///
    /// Reads the run's tables and the files that its scene names, computes the stage, and reports whether its tables are bit-identical to the
    /// stored ones. If a later stage overwrote a table, `stage` first recomputes that table. The run is not changed.
    Stage(StageArguments),
    /// Frequency, damping ratio and amplitude of the resonance over the level of the force
    ///
    /// Of the unworn joint of a scene, which is computed in memory, or of the joint as it is worn at an iteration of a run, which is not
    /// changed; of several in one table and one picture. Where friction cannot bound the amplitude any more, the curve ends and says so.
    Backbone(backbone::BackboneArguments),
    /// Show the progress and the figures of a run, or list the runs of a folder
    ///
    /// For a run it prints state, progress, remaining time, its figures with error bars (unworn and now), cost, warnings and the command that
    /// continues it. For a folder of runs it prints one line per run. --json has all columns of the last summary, in SI units.
    Status {
        /// Folder of one run, or of several runs
        #[arg(default_value = "runs")]
        folder: PathBuf,
        /// Print one JSON object per run
        #[arg(long)]
        json: bool,
    },
    /// Tell after how many cycles a joint has lost preload, frequency or depth
    ///
    /// Each milestone has an earliest, a most likely and a latest number of cycles, by the error bars of the run. A percentage is of the unworn
    /// joint, a sign says a change. Ends with 75 where the run is not done.
    When(when::WhenArguments),
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
    /// Check every file of a run against its hash
    Verify {
        /// Folder of the run
        run: PathBuf,
    },
    /// Measure the cost of accuracy: run a scene's presets and single knobs
    ///
    /// Every variant is a run of its own under the folder, against the preset `reference`. Of several scenes, or a folder of them, the
    /// presets `fast` and `balanced` are held against `reference` by kind of motion. The same command goes on where it was stopped. Writes
    /// trade.parquet, trade.md, trade.svg and trade.html, and prints the tables.
    Trade(TradeArguments),
    /// Run one scene many times with keys that vary, on one machine or on a cluster
    Campaign {
        #[command(subcommand)]
        command: campaign::CampaignCommand,
    },
    /// Run the paper's study and check the paper's claims
    ///
    /// The lap joint at four roughnesses, with a hardness limit, and with the dynamic model updated more often, less often, never:
    /// 16 runs in the folder, their scenes in its `scenes`. The same command goes on where it was stopped. Writes claims.md and
    /// claims.parquet, and prints the claims with what was measured.
    Reproduce(ReproduceArguments),
    /// Explain a key of a scene or a table of a run, or search for a word
    ///
    /// Explains a key (`contact.normal_load`), a section (`contact`) or a table (`summary`). Searches for any other word in the names and
    /// descriptions of keys and columns. The word `scene` prints all keys; without a word, `schema` prints all tables.
    Schema {
        /// A key, a section, a table, or a word to search for
        #[arg(value_name = "WORD")]
        word: Option<String>,
        /// As Markdown, for a documentation
        #[arg(long)]
        markdown: bool,
        /// Print one JSON object
        #[arg(long, conflicts_with = "markdown")]
        json: bool,
        /// Print the JSON Schema of scenes, for an editor
        #[arg(long, conflicts_with_all = ["markdown", "json"])]
        json_schema: bool,
    },
    /// Check whether this machine can compute runs and keep them
    ///
    /// Checks the folder (free space, commits, locks, tables), the processor, transforms and factorisations, the contact and vibration solvers
    /// against closed forms, and the cache of structures. Removes its own files. Ends with 1 if a check fails.
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
    /// Write the resonator as an input deck of CalculiX and Abaqus, or as matrices
    ///
    /// Its free vibration, in SI units: nodes, hexahedra with incompatible modes, materials, sets, and a frequency step.
    Export(ExportArguments),
    /// Describe the matrices of a finite-element program
    ///
    /// Prints masses, symmetry, likely units and natural frequencies. Reads Matrix Market, Abaqus (matrix output, substructures, decks), ANSYS (.full), CalculiX, NPY and NPZ, and folders of fretwear-import, by
    /// content. What belongs to a file and lies beside it is found. Frequencies are in hertz where the file's unit of time is the second.
    Inspect(inspect::InspectArguments),
    /// Put the figures of several runs into one table
    ///
    /// Prints the last iteration of each run with error bars and the FFT pairs of the whole run, as wide as the terminal (or COLUMNS). The
    /// files of --csv and --parquet hold columns of `summary` in SI units.
    Compare(CompareArguments),
    /// Write one HTML page on a run, or on several side by side
    ///
    /// Figures with their numbers, results with error bars, what was computed and why, cost, and the scene: one file that needs no
    /// other. Also of a run that goes on.
    Report(ReportArguments),
}

#[derive(Args)]
pub struct SceneArguments {
    /// The scene (TOML)
    pub scene: PathBuf,
    /// Change a key, as in `--set wear.cycles=1e6` or `--set surface.rq="1 um"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
}

/// Accepts any arguments, of a command that needs Polars.
#[cfg(not(feature = "polars"))]
#[derive(Args)]
pub struct Lacking {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    pub given: Vec<std::ffi::OsString>,
}

#[cfg(not(feature = "polars"))]
pub type ReproduceArguments = Lacking;
#[cfg(not(feature = "polars"))]
pub type CompareArguments = Lacking;
#[cfg(not(feature = "polars"))]
pub type ReportArguments = Lacking;

/// How runs are made.
#[derive(Args)]
pub struct Execution {
    /// Stop after this time, as in `--max-wall "8 h"`: at the end of the iteration if it comes within 2 s, else within its stage
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub max_wall: Option<f64>,
    /// Threads of a run; results do not depend on it [default: as many as the machine has cores, one for each of several runs at once]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// No progress
    #[arg(long, short)]
    pub quiet: bool,
}

#[derive(Args)]
pub struct RunArguments {
    /// The scene (TOML); without it, that of the run given by --run or --from
    #[arg(required_unless_present_any = ["run", "from"])]
    pub scene: Option<PathBuf>,
    /// Change a key, as in `--set wear.cycles=1e6` or `--set surface.rq="1 um"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Folder of the run [default: runs/<name of the scene>]
    #[arg(long, value_name = "DIR")]
    pub run: Option<PathBuf>,
    /// Begin from iteration N of another run, also with changed keys
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    pub from: Option<fretwear::stages::Source>,
    /// End after this stage, as in `--until static_contact`; a wrong one is refused with their list
    #[arg(long, value_name = "STAGE")]
    pub until: Option<fretwear::stages::Stage>,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the last summary, and the seconds of each stage
    #[arg(long)]
    pub json: bool,
    /// Print all columns of the last summary at the end, in SI units, too
    #[arg(long, short, conflicts_with = "json")]
    pub verbose: bool,
    /// Stop when the process that started this one ends
    #[arg(long, hide = true)]
    pub attached: bool,
}

#[derive(Args)]
pub struct StageArguments {
    /// Name of the stage; a wrong one is refused with their list
    #[arg(value_name = "NAME")]
    pub name: fretwear::stages::Stage,
    /// The run and the iteration
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    pub run: fretwear::stages::Source,
    /// Write the tables into this folder, outside of runs; no file is replaced
    #[arg(long, short, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Threads; results do not depend on it [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct TradeArguments {
    /// The scene (TOML); several, or a folder of them, to run the presets `fast`, `balanced` and `reference` on each
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Change a key, as in `--set wear.cycles=1e6`, in all scenes
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Folder of the runs and of what is written [default: trade/<name of the scene>; of several, trade]
    #[arg(long, value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// Turn this knob only, as in `--knob wear_tolerance`; may be repeated, and `--knob preset` is the presets [default: all]
    #[arg(long = "knob", value_name = "NAME")]
    pub knobs: Vec<String>,
    /// The preset `paper` too, which is slow
    #[arg(long)]
    pub paper: bool,
    /// Most cells along the longer side of a grid, up to 1024 [default: twice those of the scene]
    #[arg(long, value_name = "N")]
    pub largest_grid: Option<usize>,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the rows of the table, and what follows from them
    #[arg(long)]
    pub json: bool,
}

/// Laws of contact elements that the paper's study is computed with.
#[cfg(feature = "polars")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StudyLaw {
    Paper,
    Sliders,
    Both,
}

#[cfg(feature = "polars")]
impl StudyLaw {
    /// One after the other.
    pub fn laws(self) -> &'static [fretwear::study::Law] {
        use fretwear::study::Law;
        match self {
            StudyLaw::Paper => &[Law::Paper],
            StudyLaw::Sliders => &[Law::Sliders],
            StudyLaw::Both => &[Law::Paper, Law::Sliders],
        }
    }
}

#[cfg(feature = "polars")]
#[derive(Args)]
pub struct ReproduceArguments {
    /// Folder of the runs and of what is written
    #[arg(long, value_name = "DIR", default_value = "runs/reproduce")]
    pub dir: PathBuf,
    /// Every scene of this folder, in place of the paper's
    #[arg(long, value_name = "FOLDER", conflicts_with = "law")]
    pub scenes: Option<PathBuf>,
    /// Law of the contact elements: that of the paper, the sliders of this program, or one after the other
    #[arg(long, value_name = "LAW", value_enum, default_value_t = StudyLaw::Paper)]
    pub law: StudyLaw,
    /// Change a key in all scenes of the joint, as in `--set dynamics.damping_ratio=0.01`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Runs computed at a time
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = parse_threads)]
    pub jobs: usize,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the claims, and what was found
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct ExportArguments {
    /// The scene (TOML), with --vtu or --reduced a run, with --vtu also RUN@N for its iteration N; without it, the shipped resonator
    #[arg(value_name = "SCENE|RUN")]
    pub scene: Option<PathBuf>,
    /// Change a key, as in `--set structure.leaf_thickness="12 mm"`
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    pub sets: Vec<String>,
    /// Where the deck goes; with --contact a folder
    #[arg(long, short, value_name = "FILE", required_unless_present_any = ["matrices", "reduced", "vtu"])]
    pub output: Option<PathBuf>,
    /// Write stiffness and mass (Matrix Market), nodes and pairs of the joint (CSV) in SI to a folder, and with a scene the one that reads them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["output", "tied", "kt", "kn", "frequencies"])]
    pub matrices: Option<PathBuf>,
    /// Write cells, contact elements and the edges of the structure of a run to a folder, as ParaView reads them (VTU, PVD), in SI
    #[arg(long, value_name = "FOLDER", requires = "scene", conflicts_with_all = ["output", "matrices", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub vtu: Option<PathBuf>,
    /// Write the reduced structure of a run to a folder: stiffness, mass and damping (Matrix Market, NPZ) and what their rows are (CSV), in SI
    #[arg(long, value_name = "FOLDER", requires = "scene", conflicts_with_all = ["output", "matrices", "vtu", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub reduced: Option<PathBuf>,
    /// Write contact elements of RUN@N and structure to the folder of -o, as tables and matrices in SI; pyharm and nlvib add what reads them there
    #[arg(long, value_name = "FORM", requires = "scene", requires = "output", conflicts_with_all = ["matrices", "vtu", "reduced", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub contact: Option<export_contact::ContactForm>,
    /// One slider an element in place of a bank: strength and energy stay at this amplitude, the stuck stiffness does not
    #[arg(long, requires = "contact")]
    pub one_slider: bool,
    /// Both bodies share the nodes of the contact, as they do where there is no contact stiffness
    #[arg(long, conflicts_with = "kt")]
    pub tied: bool,
    /// Tangential stiffness of the whole joint, as in `--kt "1e4 N/um"`, in place of the scene's
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kn")]
    pub kt: Option<f64>,
    /// Normal stiffness of the whole joint, in place of the scene's
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kt")]
    pub kn: Option<f64>,
    /// Elastic modes to ask for
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub modes: usize,
    /// Compute the same modes here too, and print one JSON object
    #[arg(long)]
    pub frequencies: bool,
}

#[cfg(feature = "polars")]
#[derive(Args)]
pub struct CompareArguments {
    /// Folders of the runs; among several, what is no run is passed over
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// One row for every iteration of every run
    #[arg(long)]
    pub all: bool,
    /// Write the table to a Parquet file too
    #[arg(long, value_name = "FILE")]
    pub parquet: Option<PathBuf>,
    /// Write the table to a CSV file too
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
}

#[cfg(feature = "polars")]
#[derive(Args)]
pub struct ReportArguments {
    /// Folders of the runs; among several, what is no run is passed over
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// Where the page goes [default: report.html in the run's folder; of several runs, here]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Hold the paper's claims against the runs too, as `fretwear reproduce` does
    #[arg(long)]
    pub claims: bool,
    /// Write each figure to a file of its own in this folder too
    #[arg(long, value_name = "DIR")]
    pub svg: Option<PathBuf>,
}

fn parse_time(text: &str) -> Result<f64, String> {
    match units::parse(text, Dimension::TIME) {
        Ok(seconds) if seconds > 0.0 => Ok(seconds),
        Ok(_) => Err("must be longer than 0 s".to_owned()),
        Err(error) => Err(error.to_string()),
    }
}

/// Most threads; beyond a few hundred each has nothing to do.
const MAX_THREADS: usize = 256;

/// The threads that were asked for, else as many as the machine has cores for this program.
pub fn threads_or_cores(asked: Option<usize>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    asked.unwrap_or_else(|| cores().min(MAX_THREADS))
}

pub fn parse_threads(text: &str) -> Result<usize, String> {
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
