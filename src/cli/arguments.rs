//! Arguments of every command, with the help of the arguments and the checks that need no scene.

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
    /// Repeating `fretwear run` is safe: a run continues from its last commit, and a finished run prints its summary
    /// again.
    Run(RunArguments),
    /// Show what a scene will compute, why, and what it costs
    ///
    /// `plan` counts memory, unknowns and disk per iteration. `plan` computes a short run on a coarser grid, in a few
    /// seconds. From the short run, `plan` estimates the iterations, the FFT pairs, the time and the total disk space.
    /// The plan does not change the results of the run.
    Plan {
        #[command(flatten)]
        scene: SceneArguments,
        /// Skip the coarse run and its estimate of the whole cost
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
    /// Each error names the file, the line, the key, the wrong value and the permitted values. `check` computes
    /// nothing, and exits with 2 if a scene has an error.
    Check {
        /// The scenes (TOML)
        #[arg(required = true, value_name = "SCENE")]
        scenes: Vec<PathBuf>,
        /// Change a key in all scenes, as in `--set wear.cycles=1e6`
        #[arg(long = "set", value_name = "KEY=VALUE")]
        sets: Vec<String>,
        /// Print one JSON object per scene
        #[arg(long)]
        json: bool,
    },
    /// Compute a stage of a committed iteration again
    ///
    /// `stage` reads the tables of the run and the files that the scene names, and computes the stage. `stage` reports
    /// whether the computed tables are bit-identical to the stored tables. If a later stage overwrote a table, `stage`
    /// first recomputes that table. `stage` does not change the run.
    Stage(StageArguments),
    /// Compute frequency, damping ratio and amplitude of the resonance over the force level
    ///
    /// `backbone` computes the curve for the unworn joint of a scene, or for the worn joint at an iteration of a run.
    /// `backbone` does not change the run. Several joints share one table and one picture. The curve ends, with a
    /// message, where friction can no longer bound the amplitude.
    Backbone(backbone::BackboneArguments),
    /// Show the progress and the figures of a run, or list the runs of a folder
    ///
    /// For one run, `status` prints the state, the progress, the remaining time, the cost and the warnings. `status`
    /// prints the figures of the unworn joint and of the present joint, with error bars. `status` prints the command
    /// that continues the run. For a folder of several runs, `status` prints one line per run. With --json, `status`
    /// prints all columns of the last summary, in SI units.
    Status {
        /// Folder of one run, or of several runs
        #[arg(default_value = "runs")]
        folder: PathBuf,
        /// Print one JSON object per run
        #[arg(long)]
        json: bool,
    },
    /// Report after how many cycles a joint has lost preload, frequency or depth
    ///
    /// Each milestone has an earliest, a most likely and a latest number of cycles, by the error bars of the run. A
    /// percentage refers to the unworn joint; a sign means a change. `when` exits with 75 if the run is not done.
    When(when::WhenArguments),
    /// Write a commented scene of your own that runs
    ///
    /// At a terminal, without --like and --set, `new` asks for the values that differ from joint to joint.
    #[command(after_help = new::examples())]
    New {
        /// File to write, which must not exist yet
        #[arg(value_name = "FILE")]
        path: PathBuf,
        /// Scene to start from [default: prescribed_fretting]
        #[arg(long, value_name = "NAME")]
        like: Option<String>,
        /// Change a value, as in `--set contact.normal_load="20 kN"`; the comments of the scene stay
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
    /// Each variant is a run in the folder, and `trade` compares the variant with the preset `reference`. `trade`
    /// accepts several scenes or a folder of scenes. For several scenes, `trade` compares the presets `fast` and
    /// `balanced` with `reference`, for each kind of motion. If the command is stopped, the same command continues the
    /// work. `trade` writes trade.parquet, trade.md, trade.svg and trade.html, and prints the tables.
    Trade(TradeArguments),
    /// Run one scene many times with keys that vary, on one machine or on a cluster
    Campaign {
        #[command(subcommand)]
        command: campaign::CampaignCommand,
    },
    /// Run the paper's study and check the paper's claims
    ///
    /// `reproduce` computes 16 runs of the lap joint, with four roughnesses. Some runs have a hardness limit. Some runs
    /// update the dynamic model more often, less often or never. If the command is stopped, the same command continues
    /// the work. `reproduce` writes the scenes to `scenes` in the folder, writes claims.md and claims.parquet, and
    /// prints the claims with the measured values.
    Reproduce(ReproduceArguments),
    /// Explain a key of a scene or a table of a run, or search for a word
    ///
    /// `schema` explains a key (`contact.normal_load`), a section (`contact`) or a table (`summary`). For any other
    /// word, `schema` searches the names and descriptions of keys and columns. The word `scene` prints all keys;
    /// without a word, `schema` prints all tables.
    Schema {
        /// A key, a section, a table, or a word to search for
        #[arg(value_name = "WORD")]
        word: Option<String>,
        /// Print Markdown, for documentation
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
    /// `doctor` checks the folder (free space, commits, locks, tables), the processor, and the cache of structures.
    /// `doctor` tests transforms and factorisations. `doctor` compares the contact and vibration solvers with closed
    /// forms. `doctor` removes the files that `doctor` has written, and exits with 1 if a check fails.
    Doctor {
        /// Folder for runs
        #[arg(default_value = "runs")]
        dir: PathBuf,
        /// Print one JSON object
        #[arg(long)]
        json: bool,
    },
    /// Print the completions of the command line for a shell
    ///
    /// Redirect the completions to a file, as in `fretwear completions bash >
    /// ~/.local/share/bash-completion/completions/fretwear`.
    Completions {
        /// The shell
        shell: Shell,
    },
    /// Write the resonator as an input deck of CalculiX and Abaqus, or as matrices
    ///
    /// The input deck computes the free vibration of the resonator in SI units. The input deck contains nodes,
    /// hexahedra with incompatible modes, materials, sets, and a frequency step.
    Export(ExportArguments),
    /// Describe the matrices of a finite-element program
    ///
    /// `inspect` prints masses, symmetry, likely units and natural frequencies. `inspect` reads Matrix Market, Abaqus
    /// (matrix output, substructures, decks), ANSYS (.full), CalculiX, NPY, NPZ, and folders of fretwear-import.
    /// `inspect` recognises a format by the content of the file, and finds companion files in the same folder.
    /// Frequencies are in hertz if the file's unit of time is the second.
    Inspect(inspect::InspectArguments),
    /// Put the figures of several runs into one table
    ///
    /// `compare` prints the last iteration of each run with error bars and the FFT pairs of the whole run. The table is
    /// as wide as the terminal (or COLUMNS). The files of --csv and --parquet contain columns of the table `summary`,
    /// in SI units.
    Compare(CompareArguments),
    /// Write one HTML page on a run, or on several side by side
    ///
    /// The HTML page has plots with the plotted data, results with error bars, and the scene. The HTML page explains
    /// the decisions of the program and states the cost of the run. A browser shows the HTML page without any other
    /// file. The run may still be in progress.
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

/// Accepts any arguments, for a command that needs Polars in a build without it.
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

/// Time limit, threads and progress of runs.
#[derive(Args)]
pub struct Execution {
    /// Stop after this time, as in `--max-wall "8 h"`: at the end of the iteration if the iteration ends within 2 s,
    /// else within its stage
    #[arg(long, value_name = "TIME", value_parser = parse_time)]
    pub max_wall: Option<f64>,
    /// Threads per run, without effect on the results [default: as many as the machine has cores, or one if several
    /// runs compute at once]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Show no progress
    #[arg(long, short)]
    pub quiet: bool,
}

#[derive(Args)]
pub struct RunArguments {
    /// Scene (TOML) [default: the scene of the run given by --run or --from]
    #[arg(required_unless_present_any = ["run", "from"])]
    pub scene: Option<PathBuf>,
    /// Change a key, as in `--set wear.cycles=1e6` or `--set surface.rq="1 um"`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Folder of the run [default: runs/<name of the scene>]
    #[arg(long, value_name = "DIR")]
    pub run: Option<PathBuf>,
    /// Start from iteration N of another run; keys may be changed
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    pub from: Option<fretwear::stages::Source>,
    /// End after this stage, as in `--until static_contact`; a wrong name prints the list of stages
    #[arg(long, value_name = "STAGE")]
    pub until: Option<fretwear::stages::Stage>,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the last summary, and the seconds of each stage
    #[arg(long)]
    pub json: bool,
    /// Print all columns of the last summary at the end too, in SI units
    #[arg(long, short, conflicts_with = "json")]
    pub verbose: bool,
    /// Stop when the process that started this one ends
    #[arg(long, hide = true)]
    pub attached: bool,
}

#[derive(Args)]
pub struct StageArguments {
    /// Name of the stage; a wrong name prints the list of stages
    #[arg(value_name = "NAME")]
    pub name: fretwear::stages::Stage,
    /// Run and iteration
    #[arg(long, value_name = "RUN@N", value_parser = run::parse_source)]
    pub run: fretwear::stages::Source,
    /// Write the tables into this folder, outside of runs; existing files are not replaced
    #[arg(long, short, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Threads, without effect on the results [default: as many as the machine has cores]
    #[arg(long, value_name = "N", value_parser = parse_threads)]
    pub threads: Option<usize>,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct TradeArguments {
    /// Scene (TOML); give several scenes, or a folder of scenes, to run the presets `fast`, `balanced` and `reference`
    /// on each
    #[arg(required = true, value_name = "SCENE")]
    pub scenes: Vec<PathBuf>,
    /// Change a key, as in `--set wear.cycles=1e6`, in all scenes
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Folder of the runs and the results [default: trade/<name of the scene>; for several scenes, trade]
    #[arg(long, value_name = "DIR")]
    pub dir: Option<PathBuf>,
    /// Vary only this knob, as in `--knob wear_tolerance`; repeatable; `--knob preset` varies the preset [default: all]
    #[arg(long = "knob", value_name = "NAME")]
    pub knobs: Vec<String>,
    /// Run the preset `paper` too, which is slow
    #[arg(long)]
    pub paper: bool,
    /// Largest number of cells along the longer side of a grid, up to 1024 [default: twice as many as in the scene]
    #[arg(long, value_name = "N")]
    pub largest_grid: Option<usize>,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the rows of the table, and the conclusions
    #[arg(long)]
    pub json: bool,
}

/// Contact laws for the paper's study.
#[cfg(feature = "polars")]
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum StudyLaw {
    Paper,
    Sliders,
    Both,
}

#[cfg(feature = "polars")]
impl StudyLaw {
    /// Returns the laws, in the order of the runs.
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
    /// Folder of the runs and the results
    #[arg(long, value_name = "DIR", default_value = "runs/reproduce")]
    pub dir: PathBuf,
    /// Run every scene of this folder, instead of the paper's scenes
    #[arg(long, value_name = "FOLDER", conflicts_with = "law")]
    pub scenes: Option<PathBuf>,
    /// Law of the contact elements: the paper's law, the sliders of this program, or both in turn
    #[arg(long, value_name = "LAW", value_enum, default_value_t = StudyLaw::Paper)]
    pub law: StudyLaw,
    /// Change a key in all scenes of the joint, as in `--set dynamics.damping_ratio=0.01`
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub sets: Vec<String>,
    /// Number of runs at the same time
    #[arg(long, value_name = "N", default_value_t = 2, value_parser = parse_threads)]
    pub jobs: usize,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object: the claims and the measured values
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct ExportArguments {
    /// Scene (TOML); with --vtu or --reduced a run; with --vtu also RUN@N for its iteration N [default: the shipped
    /// resonator]
    #[arg(value_name = "SCENE|RUN")]
    pub scene: Option<PathBuf>,
    /// Change a key, as in `--set structure.leaf_thickness="12 mm"`
    #[arg(long = "set", value_name = "KEY=VALUE", requires = "scene")]
    pub sets: Vec<String>,
    /// File of the deck; with --contact, a folder
    #[arg(long, short, value_name = "FILE", required_unless_present_any = ["matrices", "reduced", "vtu"])]
    pub output: Option<PathBuf>,
    /// Write stiffness and mass (Matrix Market), nodes and pairs of the joint (CSV) in SI to a folder; with a scene,
    /// also a scene that reads them
    #[arg(long, value_name = "FOLDER", conflicts_with_all = ["output", "tied", "kt", "kn", "frequencies"])]
    pub matrices: Option<PathBuf>,
    /// Write cells, contact elements and structure edges of a run to a folder for ParaView (VTU, PVD), in SI
    #[arg(long, value_name = "FOLDER", requires = "scene", conflicts_with_all = ["output", "matrices", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub vtu: Option<PathBuf>,
    /// Write the reduced structure of a run to a folder: stiffness, mass and damping (Matrix Market, NPZ) and the list
    /// of their rows (CSV), in SI
    #[arg(long, value_name = "FOLDER", requires = "scene", conflicts_with_all = ["output", "matrices", "vtu", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub reduced: Option<PathBuf>,
    /// Write contact elements of RUN@N and structure to the folder of -o, as tables and matrices in SI; pyharm and
    /// nlvib also write a script that reads them
    #[arg(long, value_name = "FORM", requires = "scene", requires = "output", conflicts_with_all = ["matrices", "vtu", "reduced", "sets", "tied", "kt", "kn", "modes", "frequencies"])]
    pub contact: Option<export_contact::ContactForm>,
    /// Use one slider per element, not a bank: strength and energy stay the same at this amplitude, the stuck stiffness
    /// changes
    #[arg(long, requires = "contact")]
    pub one_slider: bool,
    /// Share the nodes of the contact between both bodies, as without a contact stiffness
    #[arg(long, conflicts_with = "kt")]
    pub tied: bool,
    /// Tangential stiffness of the whole joint, as in `--kt "1e4 N/um"`, instead of the stiffness in the scene
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kn")]
    pub kt: Option<f64>,
    /// Normal stiffness of the whole joint, instead of the stiffness in the scene
    #[arg(long, value_name = "STIFFNESS", value_parser = parse_stiffness, requires = "kt")]
    pub kn: Option<f64>,
    /// Number of elastic modes
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub modes: usize,
    /// Compute the same modes in fretwear too, and print one JSON object
    #[arg(long)]
    pub frequencies: bool,
}

#[cfg(feature = "polars")]
#[derive(Args)]
pub struct CompareArguments {
    /// Folders of the runs; among several, folders that are not runs are skipped
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// Print one row for every iteration of every run
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
    /// Folders of the runs; among several, folders that are not runs are skipped
    #[arg(required = true, value_name = "RUN")]
    pub runs: Vec<PathBuf>,
    /// File of the page [default: report.html in the run's folder; for several runs, in the present folder]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Check the paper's claims too, as `fretwear reproduce` does
    #[arg(long)]
    pub claims: bool,
    /// Write each figure to its own file in this folder too
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

/// Largest number of threads. Beyond a few hundred, a thread has nothing to do.
const MAX_THREADS: usize = 256;

/// Returns the requested number of threads, or else the number of cores, up to [`MAX_THREADS`].
pub fn threads_or_cores(requested: Option<usize>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, usize::from);
    requested.unwrap_or_else(|| cores().min(MAX_THREADS))
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
