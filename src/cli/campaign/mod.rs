//! `fretwear campaign`: many runs of one scene with varying keys.

mod jobs;
mod plan;
#[cfg(feature = "polars")]
mod report;
mod run;
mod status;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, Subcommand};
use fretwear::campaign::{CampaignFolder, StoredCampaign};
use fretwear::scene::{self, Plan, SceneError};
use fretwear::store::RealFileSystem;

use super::arguments::Execution;
#[cfg(not(feature = "polars"))]
use super::arguments::Lacking as ReportArguments;
use super::{CliError, Exit};
use crate::terminal::Results;

#[derive(Subcommand)]
pub enum CampaignCommand {
    /// Plan a campaign: one row per run, with its resolved keys and its expected cost
    ///
    /// `campaign plan` computes only the rehearsals. Planning again in the same folder may add rows after the last row.
    Plan(PlanArguments),
    /// Run or continue rows: one, a range, or all rows on this machine
    ///
    /// `campaign run` exits with 0 if all requested rows are done, and with 75 if a row was stopped. To continue a
    /// stopped row, run the same command again. Rows that are done take no time. If one row fails, `campaign run`
    /// computes the other rows.
    Run(RunArguments),
    /// Show the progress of a campaign
    Status(FolderArguments),
    /// Append the completed runs to tables of many runs
    ///
    /// `campaign collect` writes collected/shard-*.parquet: one row per iteration, with the index and the keys of its
    /// run. The command never changes an existing shard.
    Collect(FolderArguments),
    /// Write one HTML page on the collected runs, and the tables of the page
    ///
    /// The page shows the final figures of the runs, and bands of the figures over the cycles. The page shows the
    /// effect of each key on each figure, and the reasons of failed runs.
    Report(ReportArguments),
}

#[derive(Args)]
pub struct PlanArguments {
    /// The campaign (TOML)
    pub campaign: PathBuf,
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    pub dir: PathBuf,
    /// Skip the rehearsals and the expected time
    #[arg(long)]
    pub no_rehearsal: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct FolderArguments {
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    pub dir: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[cfg(feature = "polars")]
#[derive(Args)]
pub struct ReportArguments {
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    pub dir: PathBuf,
    /// File of the page; the tables go into the same folder, unless the file is a device or a pipe [default:
    /// report.html in the folder]
    #[arg(long, short, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// Print one JSON object: the rows of the tables
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct RunArguments {
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    pub dir: PathBuf,
    /// Row, or range of rows including both ends, as in `--index 17` or `--index 0-99` [default: all]
    #[arg(long, value_name = "N|A-B", value_parser = fretwear::campaign::indices)]
    pub index: Option<[usize; 2]>,
    /// Largest number of processes at once; memory may allow fewer
    #[arg(long, value_name = "J", value_parser = super::arguments::parse_threads)]
    pub jobs: Option<usize>,
    /// Compute in this folder, as on a disk of the node, and store only the history at the end; with keep = "history"
    ///
    /// With `--scratch`, a stopped row continues from the data in FOLDER. If the folder is gone, a stopped row starts
    /// again and gives the same results.
    #[arg(long, value_name = "FOLDER")]
    pub scratch: Option<PathBuf>,
    /// Retry rows that have failed
    #[arg(long)]
    pub retry: bool,
    /// Exit code if a row was stopped and can be continued, for workload managers with another convention
    #[arg(long, value_name = "CODE", default_value_t = 75, value_parser = clap::value_parser!(u8).range(1..))]
    pub resumable_exit: u8,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// Stop when the process that started this one ends
    #[arg(long, hide = true)]
    pub attached: bool,
}

/// Runs the command.
pub fn campaign(command: &CampaignCommand, out: &mut Results) -> Result<Exit, CliError> {
    match command {
        CampaignCommand::Plan(arguments) => plan::plan(arguments, out),
        CampaignCommand::Run(arguments) => run::run(arguments, out),
        CampaignCommand::Status(arguments) => status::status(&arguments.dir, arguments.json, out),
        CampaignCommand::Collect(arguments) => status::collect(&arguments.dir, arguments.json, out),
        #[cfg(feature = "polars")]
        CampaignCommand::Report(arguments) => report::report(arguments, out),
        #[cfg(not(feature = "polars"))]
        CampaignCommand::Report(_) => Err(CliError::NoPolars),
    }
}

fn folder(root: &Path) -> CampaignFolder {
    CampaignFolder::at(Arc::new(RealFileSystem), root)
}

/// Plans a row from the content of the campaign folder.
fn plan_of(
    folder: &CampaignFolder,
    about: &StoredCampaign,
    settings: &[String],
) -> Result<Plan, CliError> {
    let path = folder.root.join(&about.scene_name).with_extension("toml");
    let scene: Result<_, SceneError> = scene::load_kept(&path, &about.scene, settings);
    Ok(Plan::of(&scene?)?)
}

/// Returns the hash that identifies a row: its resolved scene with the content of its files.
fn content_key(plan: &Plan) -> String {
    fretwear::json::hash(&plan.inputs.identity.scene)
}
