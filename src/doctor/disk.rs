//! Checks of the folder for runs and of the cache.

use std::io;
use std::path::{Path, PathBuf};

use super::machine::lower_quartile_time;
use super::{Check, State};
use crate::store::{EntryKind, FileSystem, LockAttempt};
use crate::tables::{Provenance, TableName, TypedTable, from_parquet, to_parquet, typed};

/// Free space below which the doctor warns \[B\]. A run of the published case takes about 20 MB of disk space. A study
/// of the published case takes ten times as much space.
const LITTLE_SPACE: u64 = 1 << 30;
/// Free disk space below which a single run does not fit on the disk \[B\].
const NO_SPACE: u64 = 64 << 20;
/// Duration above which a commit delays runs noticeably \[s\]: an iteration of a small joint takes about this duration.
const SLOW_COMMIT: f64 = 0.25;
/// Size of the committed test file \[B\].
const COMMIT_BYTES: usize = 300_000;

const FOLDER_ADVICE: &str = "give a writable folder on a local disk: fretwear doctor DIR";

/// Checks space, commits, lock and tables in the folder for runs.
pub(super) fn folder(fs: &dyn FileSystem, requested: &Path) -> Vec<Check> {
    let existing = match nearest(fs, requested) {
        Ok(existing) => existing,
        Err(error) => {
            let description = format!("{}: {error}", requested.display());
            return vec![Check::failed("folder", description, FOLDER_ADVICE)];
        }
    };
    let mut checks = vec![space(fs, requested, &existing)];
    let work = existing.join(format!(".fretwear-doctor-{}", std::process::id()));
    if let Err(error) = fs.create_dir_all(&work) {
        let description = format!("cannot create a folder in {}: {error}", existing.display());
        checks.push(Check::failed("commit", description, FOLDER_ADVICE));
        return checks;
    }
    checks.extend([commit(fs, &work), lock(fs, &work), tables(fs, &work)]);
    if let Err(error) = fs.remove_dir_all(&work) {
        let description = format!("cannot remove {}: {error}", work.display());
        checks.push(Check::failed("removal", description, FOLDER_ADVICE));
    }
    checks
}

/// Returns `folder` if the folder exists, or the nearest parent of `folder` that exists.
fn nearest(fs: &dyn FileSystem, folder: &Path) -> io::Result<PathBuf> {
    for level in folder.ancestors() {
        let level = if level.as_os_str().is_empty() {
            Path::new(".")
        } else {
            level
        };
        match fs.metadata(level)? {
            Some(entry) if entry.kind == EntryKind::Folder => return Ok(level.to_owned()),
            // The folder for runs may be a link to another disk.
            Some(entry) if entry.kind == EntryKind::Link && fs.list(level).is_ok() => {
                return Ok(level.to_owned());
            }
            Some(_) => {
                let message = format!("{} is a file, not a folder", level.display());
                return Err(io::Error::other(message));
            }
            None => (),
        }
    }
    Ok(PathBuf::from("."))
}

fn space(fs: &dyn FileSystem, requested: &Path, existing: &Path) -> Check {
    const NAME: &str = "free space";
    let free = match fs.free_space(existing) {
        Ok(free) => free,
        Err(error) => {
            let description = format!("unknown in {}: {error}", existing.display());
            return Check::failed(NAME, description, FOLDER_ADVICE);
        }
    };
    let place = if requested == existing {
        requested.display().to_string()
    } else {
        format!("{} (does not exist yet)", requested.display())
    };
    let description = format!("{:.1} GB in {place}", free as f64 / 1e9);
    let check = Check::ok(NAME, description).number("bytes", free as f64);
    if free < NO_SPACE {
        check.with_advice(State::Failed, "free some space, or give another folder")
    } else if free < LITTLE_SPACE {
        check.with_advice(
            State::Warning,
            "enough for some runs; `fretwear plan SCENE` shows the disk space of a run, and output.keep reduces it",
        )
    } else {
        check
    }
}

/// Checks the steps of a commit: write a file, sync the file, rename a folder, sync the parent of the folder.
fn commit(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "commit";
    let bytes = vec![0x5a; COMMIT_BYTES];
    let mut count = 0;
    let mut commit_once = || -> io::Result<()> {
        count += 1;
        let (draft, done) = (
            work.join(format!("draft-{count}")),
            work.join(format!("done-{count}")),
        );
        fs.create_dir_all(&draft)?;
        fs.write_new(&draft.join("table"), &bytes)?;
        fs.sync_file(&draft.join("table"))?;
        fs.sync_dir(&draft)?;
        fs.rename(&draft, &done)?;
        fs.sync_dir(work)?;
        if fs.metadata(&draft)?.is_some()
            || fs.read(&done.join("table"), bytes.len() as u64)? != bytes
        {
            return Err(io::Error::other("a renamed folder is incomplete"));
        }
        Ok(())
    };
    let mut result = Ok(());
    let seconds = lower_quartile_time(|| {
        if result.is_ok() {
            result = commit_once();
        }
    });
    match result {
        Err(error) => Check::failed(NAME, error.to_string(), FOLDER_ADVICE),
        Ok(()) => {
            let description = format!("written, synced and renamed in {:.1} ms", 1e3 * seconds);
            let check = Check::ok(NAME, description).number("seconds", seconds);
            if seconds > SLOW_COMMIT {
                check.with_advice(
                    State::Warning,
                    "every iteration waits for this; keep runs on a local disk",
                )
            } else {
                check
            }
        }
    }
}

/// Checks that a lock is exclusive, and free again after its release.
fn lock(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "lock";
    const ADVICE: &str = "two processes could write into one run: keep runs on a local disk, or a network disk with locks";
    let path = work.join("lock");
    let is_taken = |attempt: &LockAttempt| matches!(attempt, LockAttempt::Taken(_));
    let try_twice = || -> io::Result<Result<(), &'static str>> {
        let first = fs.try_lock(&path)?;
        if !is_taken(&first) {
            return Ok(Err("a new lock cannot be taken"));
        }
        if is_taken(&fs.try_lock(&path)?) {
            return Ok(Err("taken twice"));
        }
        drop(first);
        Ok(if is_taken(&fs.try_lock(&path)?) {
            Ok(())
        } else {
            Err("still locked after its release")
        })
    };
    match try_twice() {
        Ok(Ok(())) => Check::ok(NAME, "taken, refused to a second attempt, and released"),
        Ok(Err(reason)) => Check::failed(NAME, reason, ADVICE),
        Err(error) => Check::failed(NAME, error.to_string(), ADVICE),
    }
}

/// Checks that a table written to Parquet and read back is identical, bit for bit.
fn tables(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "Parquet";
    let path = work.join(TableName::Hysteresis.file_name());
    let round_trip = || -> Result<bool, Box<dyn std::error::Error>> {
        let load: Vec<f64> = (0..1000).map(|k| (0.1 * k as f64).sin() * 1e4).collect();
        let displacement = vec![-0.0; load.len()];
        let curve = typed::Hysteresis { load, displacement };
        let provenance = Provenance {
            scene_hash: String::new(),
            program_version: env!("CARGO_PKG_VERSION").to_owned(),
        };
        let bytes = to_parquet(&curve.to_table()?, &provenance)?;
        fs.write_new(&path, &bytes)?;
        fs.sync_file(&path)?;
        let restored = fs.read(&path, bytes.len() as u64)?;
        let restored =
            typed::Hysteresis::of(&from_parquet(&restored, TableName::Hysteresis.schema())?)?;
        let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
        Ok(bits(&restored.load) == bits(&curve.load)
            && bits(&restored.displacement) == bits(&curve.displacement))
    };
    match round_trip() {
        Ok(true) => Check::ok(NAME, "a table written and read back, bit for bit"),
        Ok(false) => Check::failed(
            NAME,
            "a table has other values after reading it back",
            FOLDER_ADVICE,
        ),
        Err(error) => Check::failed(NAME, error.to_string(), FOLDER_ADVICE),
    }
}

/// Checks the cache, in which runs share reduced structures.
pub(super) fn cache(fs: &dyn FileSystem, root: Option<&Path>) -> Check {
    const NAME: &str = "cache";
    const ADVICE: &str =
        "every run reduces its structure again (seconds); set FRETWEAR_CACHE to a writable folder";
    let Some(root) = root else {
        return Check::ok(NAME, "switched off").with_advice(State::Warning, ADVICE);
    };
    let place = root.display();
    let inspect_cache = || -> io::Result<(u64, usize)> {
        let existing = nearest(fs, root)?;
        let probe = existing.join(format!(".fretwear-doctor-{}", std::process::id()));
        fs.write_new(&probe, b"doctor")?;
        fs.remove_file(&probe)?;
        if fs.metadata(root)?.is_none() {
            return Ok((0, 0));
        }
        let mut results = 0;
        let mut bytes = 0;
        let entries = fs.list(root)?;
        let folders = entries.iter().filter(|e| e.kind == EntryKind::Folder);
        for entry in folders {
            results += 1;
            let folder = root.join(&entry.name);
            for file in fs.list(&folder)? {
                bytes += fs.metadata(&folder.join(file.name))?.map_or(0, |m| m.len);
            }
        }
        Ok((bytes, results))
    };
    match inspect_cache() {
        Ok((bytes, results)) => Check::ok(
            NAME,
            format!(
                "{place}: {results} structures, {:.1} MB",
                bytes as f64 / 1e6
            ),
        )
        .number("bytes", bytes as f64)
        .number("structures", results as f64),
        Err(error) => {
            Check::ok(NAME, format!("{place}: {error}")).with_advice(State::Warning, ADVICE)
        }
    }
}
