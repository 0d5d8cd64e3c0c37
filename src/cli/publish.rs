//! `fretwear publish` and `fretwear fetch`.

use std::path::PathBuf;

use clap::Args;

use super::{CliError, Exit};
use crate::terminal::Results;

#[derive(Args)]
pub struct PublishArguments {
    /// Folder of a run or of a campaign
    pub folder: PathBuf,
    /// Where to, as s3://BUCKET/PREFIX
    #[arg(long, value_name = "PLACE")]
    pub to: String,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[derive(Args)]
pub struct FetchArguments {
    /// Where it is published, as s3://BUCKET/PREFIX
    #[arg(value_name = "PLACE")]
    pub from: String,
    /// Folder to put it into; one that has the same campaign gets what it lacks
    #[arg(long, value_name = "FOLDER")]
    pub to: PathBuf,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

#[cfg(not(feature = "object_store"))]
pub fn publish(_: &PublishArguments, _: &mut Results) -> Result<Exit, CliError> {
    Err(CliError::NoObjectStorage)
}

#[cfg(not(feature = "object_store"))]
pub fn fetch(_: &FetchArguments, _: &mut Results) -> Result<Exit, CliError> {
    Err(CliError::NoObjectStorage)
}

#[cfg(feature = "object_store")]
pub use with::{fetch, publish};

#[cfg(feature = "object_store")]
mod with {
    use std::sync::Arc;

    use fretwear::published::{self, Bucket, Objects};
    use fretwear::store::{FileSystem, RealFileSystem};
    use serde_json::json;

    use super::{CliError, Exit, FetchArguments, PublishArguments, Results};

    pub fn publish(arguments: &PublishArguments, out: &mut Results) -> Result<Exit, CliError> {
        let bucket = Bucket::at(&arguments.to)?;
        let files: Arc<dyn FileSystem> = Arc::new(RealFileSystem);
        let done = published::publish(&bucket, &files, &arguments.folder)?;
        if arguments.json {
            out.json(&json!({
                "kind": done.kind,
                "place": bucket.place(),
                "files": done.files,
                "uploaded": done.uploaded,
                "bytes": done.bytes,
                "changed": done.changed,
            }));
        } else {
            writeln!(
                out,
                "{}: {} {} of {} files uploaded ({:.1} MB){}",
                bucket.place(),
                done.kind.name(),
                done.uploaded,
                done.files,
                done.bytes as f64 / 1e6,
                if done.changed {
                    ", published"
                } else {
                    ", nothing new to publish"
                }
            );
        }
        Ok(Exit::Done)
    }

    pub fn fetch(arguments: &FetchArguments, out: &mut Results) -> Result<Exit, CliError> {
        let bucket = Bucket::at(&arguments.from)?;
        let files: Arc<dyn FileSystem> = Arc::new(RealFileSystem);
        let done = published::fetch(&bucket, &files, &arguments.to)?;
        if arguments.json {
            out.json(&json!({
                "kind": done.kind,
                "place": bucket.place(),
                "files": done.published,
                "fetched": done.files,
                "bytes": done.bytes,
            }));
        } else {
            writeln!(
                out,
                "{}: {}, {} of {} files fetched ({:.1} MB)",
                arguments.to.display(),
                done.kind.name(),
                done.files,
                done.published,
                done.bytes as f64 / 1e6
            );
        }
        Ok(Exit::Done)
    }
}
