//! `fretwear campaign`: many runs of one scene of which some keys vary.

mod jobs;
mod plan;
#[cfg(feature = "polars")]
mod report;
mod run;
mod status;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::{Args, Subcommand};
use fretwear::campaign::{About, Folder};
use fretwear::scene::{self, Plan, SceneError};
use fretwear::store::RealFileSystem;

use super::arguments::Execution;
#[cfg(not(feature = "polars"))]
use super::arguments::Lacking as ReportArguments;
use super::{CliError, Exit};
use crate::terminal::Results;

#[derive(Subcommand)]
pub enum CampaignCommand {
    /// Plan a campaign: a row a run, with its keys as resolved and what it will cost
    ///
    /// Nothing is computed but the rehearsals. Planning again in the same folder may add rows behind the last.
    Plan(PlanArguments),
    /// Run rows, or continue them: one, a range, or all of them on this machine
    ///
    /// Ends with 0 where all rows asked for are done, with 75 where one was stopped and run the same command again to continue. Rows that are done
    /// take no time. One that fails does not stop the others.
    Run(RunArguments),
    /// Say how far a campaign is
    Status(FolderArguments),
    /// Append the runs that have ended to tables of many runs
    ///
    /// Writes collected/shard-*.parquet: a row an iteration, with the index of its run and its keys. Shards are never changed.
    Collect(FolderArguments),
    /// Write one HTML page on the runs that are collected, and tables beside it
    ///
    /// What the runs end in, bands over the cycles, and how each figure depends on each key; which runs failed, and why.
    Report(ReportArguments),
}

#[derive(Args)]
pub struct PlanArguments {
    /// The campaign (TOML)
    pub campaign: PathBuf,
    /// Folder of the campaign
    #[arg(long, value_name = "DIR")]
    pub dir: PathBuf,
    /// Everything but the cost
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
    /// Where the page goes; the tables go beside it, unless it is a device or a pipe [default: report.html in the folder]
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
    /// The row, or a range of rows with both ends, as in `--index 17` or `--index 0-99` [default: all]
    #[arg(long, value_name = "N|A-B", value_parser = fretwear::campaign::indices)]
    pub index: Option<[usize; 2]>,
    /// Processes at once, as many as memory allows of them
    #[arg(long, value_name = "J", value_parser = super::arguments::parse_threads)]
    pub jobs: Option<usize>,
    /// Compute in this folder, as a disk of the node, and publish the history alone at the end; with keep = "history"
    ///
    /// What is stopped goes on from there where it finds it, and else begins anew, to the same results.
    #[arg(long, value_name = "FOLDER")]
    pub scratch: Option<PathBuf>,
    /// Try rows again that have failed
    #[arg(long)]
    pub retry: bool,
    /// Exit code where a row was stopped and can be continued, for engines with other habits
    #[arg(long, value_name = "CODE", default_value_t = 75, value_parser = clap::value_parser!(u8).range(1..))]
    pub resumable_exit: u8,
    #[command(flatten)]
    pub execution: Execution,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
    /// The process that started this one reaps it
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

fn folder(root: &Path) -> Folder {
    Folder::at(Arc::new(RealFileSystem), root)
}

/// The plan of a row, from what its folder keeps.
fn plan_of(folder: &Folder, about: &About, settings: &[String]) -> Result<Plan, CliError> {
    let path = folder.root.join(&about.scene_name).with_extension("toml");
    let scene: Result<_, SceneError> = scene::load_kept(&path, &about.scene, settings);
    Ok(Plan::of(&scene?)?)
}

/// What a row is known by: its scene as resolved, with what its files hold.
fn content_key(plan: &Plan) -> String {
    fretwear::json::hash(&plan.inputs.identity.scene)
}
