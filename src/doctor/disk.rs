//! The folder where runs go, and the cache.

use std::io;
use std::path::{Path, PathBuf};

use super::machine::quartile;
use super::{Check, State};
use crate::store::{EntryKind, FileSystem, LockAttempt};
use crate::tables::{Provenance, TableName, TypedTable, from_parquet, to_parquet, typed};

/// A run of the published case takes some 20 MB, a study of it ten times that.
const LITTLE_SPACE: u64 = 1 << 30;
/// Below this not one run fits.
const NO_SPACE: u64 = 64 << 20;
/// A commit that takes longer is felt: an iteration of a small joint takes as long.
const SLOW_COMMIT: f64 = 0.25;
/// Bytes of the files that are committed, some of an iteration.
const COMMIT_BYTES: usize = 300_000;

const ELSEWHERE: &str = "name a folder on a local disk that you may write to: fretwear doctor DIR";

/// Space, commits, lock and tables in the folder where runs go.
pub(super) fn folder(fs: &dyn FileSystem, asked: &Path) -> Vec<Check> {
    let there = match nearest(fs, asked) {
        Ok(there) => there,
        Err(error) => {
            let found = format!("{}: {error}", asked.display());
            return vec![Check::failed("folder", found, ELSEWHERE)];
        }
    };
    let mut checks = vec![space(fs, asked, &there)];
    let work = there.join(format!(".fretwear-doctor-{}", std::process::id()));
    if let Err(error) = fs.create_dir_all(&work) {
        let found = format!("cannot create a folder in {}: {error}", there.display());
        checks.push(Check::failed("commit", found, ELSEWHERE));
        return checks;
    }
    checks.extend([commit(fs, &work), lock(fs, &work), tables(fs, &work)]);
    if let Err(error) = fs.remove_dir_all(&work) {
        let found = format!("cannot remove {}: {error}", work.display());
        checks.push(Check::failed("removal", found, ELSEWHERE));
    }
    checks
}

/// The folder, or the nearest above it that is there.
fn nearest(fs: &dyn FileSystem, folder: &Path) -> io::Result<PathBuf> {
    for level in folder.ancestors() {
        let level = if level.as_os_str().is_empty() {
            Path::new(".")
        } else {
            level
        };
        match fs.metadata(level)? {
            Some(found) if found.kind == EntryKind::Folder => return Ok(level.to_owned()),
            // Where runs go may itself be a link to another disk.
            Some(found) if found.kind == EntryKind::Link && fs.list(level).is_ok() => {
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

fn space(fs: &dyn FileSystem, asked: &Path, there: &Path) -> Check {
    const NAME: &str = "free space";
    let free = match fs.free_space(there) {
        Ok(free) => free,
        Err(error) => {
            let found = format!("unknown in {}: {error}", there.display());
            return Check::failed(NAME, found, ELSEWHERE);
        }
    };
    let place = if asked == there {
        asked.display().to_string()
    } else {
        format!("{} (not there yet)", asked.display())
    };
    let found = format!("{:.1} GB in {place}", free as f64 / 1e9);
    let check = Check::ok(NAME, found).number("bytes", free as f64);
    if free < NO_SPACE {
        check.but(State::Failed, "make room, or name another folder")
    } else if free < LITTLE_SPACE {
        check.but(
            State::Warning,
            "enough for some runs; `fretwear plan SCENE` says what one takes, and output.keep makes it less",
        )
    } else {
        check
    }
}

/// What the store does to commit: write, sync, rename a folder, sync its parent.
fn commit(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "commit";
    let bytes = vec![0x5a; COMMIT_BYTES];
    let mut count = 0;
    let mut one = || -> io::Result<()> {
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
            return Err(io::Error::other("a renamed folder is not whole"));
        }
        Ok(())
    };
    let mut result = Ok(());
    let seconds = quartile(|| {
        if result.is_ok() {
            result = one();
        }
    });
    match result {
        Err(error) => Check::failed(NAME, error.to_string(), ELSEWHERE),
        Ok(()) => {
            let found = format!("written, synced and renamed in {:.1} ms", 1e3 * seconds);
            let check = Check::ok(NAME, found).number("seconds", seconds);
            if seconds > SLOW_COMMIT {
                check.but(
                    State::Warning,
                    "every iteration waits for this; keep runs on a local disk",
                )
            } else {
                check
            }
        }
    }
}

/// One writer a run: a lock that is held is refused, and free again once it is let go.
fn lock(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "lock";
    const ADVICE: &str = "two processes could write into one run: keep runs on a local disk, or a network disk with locks";
    let path = work.join("lock");
    let taken = |attempt: &LockAttempt| matches!(attempt, LockAttempt::Taken(_));
    let tried = || -> io::Result<Result<(), &'static str>> {
        let first = fs.try_lock(&path)?;
        if !taken(&first) {
            return Ok(Err("a new lock cannot be taken"));
        }
        if taken(&fs.try_lock(&path)?) {
            return Ok(Err("taken twice"));
        }
        drop(first);
        Ok(if taken(&fs.try_lock(&path)?) {
            Ok(())
        } else {
            Err("not free after it was let go")
        })
    };
    match tried() {
        Ok(Ok(())) => Check::ok(NAME, "taken, refused to a second, and let go"),
        Ok(Err(found)) => Check::failed(NAME, found, ADVICE),
        Err(error) => Check::failed(NAME, error.to_string(), ADVICE),
    }
}

/// A table through Parquet and the disk, bit for bit.
fn tables(fs: &dyn FileSystem, work: &Path) -> Check {
    const NAME: &str = "Parquet";
    let path = work.join(TableName::Hysteresis.file_name());
    let around = || -> Result<bool, Box<dyn std::error::Error>> {
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
        let read = fs.read(&path, bytes.len() as u64)?;
        let read = typed::Hysteresis::of(&from_parquet(&read, TableName::Hysteresis.schema())?)?;
        let bits = |values: &[f64]| -> Vec<u64> { values.iter().map(|v| v.to_bits()).collect() };
        Ok(bits(&read.load) == bits(&curve.load)
            && bits(&read.displacement) == bits(&curve.displacement))
    };
    match around() {
        Ok(true) => Check::ok(NAME, "a table written and read back, bit for bit"),
        Ok(false) => Check::failed(NAME, "a table came back with other values", ELSEWHERE),
        Err(error) => Check::failed(NAME, error.to_string(), ELSEWHERE),
    }
}

/// Where reduced structures are shared between runs.
pub(super) fn cache(fs: &dyn FileSystem, root: Option<&Path>) -> Check {
    const NAME: &str = "cache";
    const ADVICE: &str = "every run reduces its structure anew (seconds); set FRETWEAR_CACHE to a folder that you may write to";
    let Some(root) = root else {
        return Check::ok(NAME, "switched off").but(State::Warning, ADVICE);
    };
    let place = root.display();
    let looked = || -> io::Result<(u64, usize)> {
        let there = nearest(fs, root)?;
        let probe = there.join(format!(".fretwear-doctor-{}", std::process::id()));
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
    match looked() {
        Ok((bytes, results)) => Check::ok(
            NAME,
            format!(
                "{place}: {results} structures, {:.1} MB",
                bytes as f64 / 1e6
            ),
        )
        .number("bytes", bytes as f64)
        .number("structures", results as f64),
        Err(error) => Check::ok(NAME, format!("{place}: {error}")).but(State::Warning, ADVICE),
    }
}
