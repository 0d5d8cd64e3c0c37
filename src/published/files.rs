//! Which files of a folder are published, and under which names.

use std::path::Path;

use serde::{Deserialize, Serialize};

use super::error::PublishError;
use crate::campaign::{Campaign, Folder, State};
use crate::store::{Entry, EntryKind, FileSystem};

/// Files of a run that change while it goes on.
const OF_RUN: [&str; 9] = [
    "failure.json",
    "history.parquet",
    "log.txt",
    "plan.json",
    RUN_COPY,
    RUN,
    "scene.original.toml",
    "scene.toml",
    "schemas.json",
];
/// What a run folder is known by; its copy is taken where it is lost.
pub(super) const RUN: &str = "run.json";
const RUN_COPY: &str = "run.copy.json";
const ONCE: &str = "once";
const ITERATIONS: &str = "iterations";
const ITERATION: &str = "wear_iteration=";

/// Files of a campaign that change when it becomes longer.
pub(super) const OF_CAMPAIGN: [&str; 3] = ["campaign.json", "campaign.toml", CAMPAIGN];
/// What the folder of a campaign is known by.
pub(super) const CAMPAIGN: &str = "campaign.parquet";
const RUNS: &str = "runs";
const ENDED: &str = "ended";
const FAILED: &str = "failed";
const COLLECTED: &str = "collected";

/// Digits of an index: at least six, and of a number that the program can count to.
const DIGITS: std::ops::RangeInclusive<usize> = 6..=12;
/// Digits of an iteration at most.
const ITERATION_DIGITS: usize = 18;
/// Bytes of a name at most: those of the program have fewer.
const LONGEST_NAME: usize = 80;

/// What is published.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// The folder of a run.
    Run,
    /// The folder of a campaign.
    Campaign,
}

/// What an object is named by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Naming {
    /// Its path: it is never changed, so that others may read it by its name.
    Path,
    /// Its content.
    Hash,
}

impl Kind {
    /// The word for it.
    pub fn name(self) -> &'static str {
        match self {
            Kind::Run => "run",
            Kind::Campaign => "campaign",
        }
    }

    /// The kind of a folder.
    pub(super) fn of(files: &dyn FileSystem, root: &Path) -> Result<Kind, PublishError> {
        for (name, kind) in [(CAMPAIGN, Kind::Campaign), (RUN, Kind::Run)] {
            let path = root.join(name);
            let found = files.metadata(&path);
            if found.map_err(PublishError::io("look at", &path))?.is_some() {
                return Ok(kind);
            }
        }
        Err(PublishError::NothingToPublish {
            path: root.to_owned(),
        })
    }

    /// The file that is written last, without which a folder is none of this kind.
    pub(super) fn defining(self) -> &'static str {
        match self {
            Kind::Run => RUN,
            Kind::Campaign => CAMPAIGN,
        }
    }

    /// How a file is named there; none for what is not published. The forms are all there are: no link, no `..`, nothing of another folder.
    pub(super) fn naming(self, path: &str) -> Option<Naming> {
        let parts: Vec<&str> = path.split('/').collect();
        match self {
            Kind::Run => in_run(&parts),
            Kind::Campaign => in_campaign(&parts),
        }
    }

    /// True for names that a folder of this kind may have at its top, drafts among them.
    pub(super) fn is_own(self, name: &str) -> bool {
        let own: &[&str] = match self {
            Kind::Run => &[ONCE, ITERATIONS, "lock", "staging"],
            Kind::Campaign => &[
                RUNS, ENDED, FAILED, COLLECTED, "lock", "locks", "cache", "report",
            ],
        };
        let plain: &[&str] = match self {
            Kind::Run => &OF_RUN,
            Kind::Campaign => &OF_CAMPAIGN,
        };
        own.contains(&name) || plain.iter().any(|own| name.starts_with(own))
    }

    /// The paths that are published of a folder, in order. Of a campaign only the rows that have ended.
    pub(super) fn paths(
        self,
        files: &std::sync::Arc<dyn FileSystem>,
        root: &Path,
    ) -> Result<Vec<String>, PublishError> {
        let mut paths = Vec::new();
        match self {
            Kind::Run => of_run(files.as_ref(), root, "", &mut paths)?,
            Kind::Campaign => {
                let (_, campaign) = Folder::at(files.clone(), root).open()?;
                of_campaign(files, root, &campaign, &mut paths)?;
            }
        }
        paths.retain(|path| self.naming(path).is_some());
        paths.sort();
        Ok(paths)
    }
}

/// True for `commit.json`, `wear_field.parquet` and the like.
fn is_table(name: &str) -> bool {
    let stem = name
        .strip_suffix(".parquet")
        .or_else(|| name.strip_suffix(".json"));
    let plain = |c: u8| c.is_ascii_lowercase() || c.is_ascii_digit() || c == b'_';
    stem.is_some_and(|stem| {
        !stem.is_empty() && stem.len() <= LONGEST_NAME && stem.bytes().all(plain)
    })
}

fn is_number(digits: &str) -> bool {
    digits.bytes().all(|b| b.is_ascii_digit())
}

/// True for the six or more digits of a row between `before` and `after`.
fn is_index(name: &str, before: &str, after: &str) -> bool {
    let digits = name
        .strip_prefix(before)
        .and_then(|rest| rest.strip_suffix(after));
    digits.is_some_and(|digits| DIGITS.contains(&digits.len()) && is_number(digits))
}

/// The iteration of the name of its folder.
pub(super) fn iteration_of(name: &str) -> Option<u64> {
    let digits = name.strip_prefix(ITERATION)?;
    let is_plain = digits.len() <= ITERATION_DIGITS && is_number(digits);
    digits.parse().ok().filter(|_| is_plain)
}

fn in_run(parts: &[&str]) -> Option<Naming> {
    match parts {
        [name] if OF_RUN.contains(name) => Some(Naming::Hash),
        [folder, name] if *folder == ONCE && is_table(name) => Some(Naming::Path),
        [folder, iteration, name] if *folder == ITERATIONS && is_table(name) => {
            iteration_of(iteration).map(|_| Naming::Path)
        }
        _ => None,
    }
}

fn in_campaign(parts: &[&str]) -> Option<Naming> {
    let is = |yes: bool, naming| yes.then_some(naming);
    match parts {
        [name] => is(OF_CAMPAIGN.contains(name), Naming::Hash),
        [FAILED, name] => is(is_index(name, "", ".json"), Naming::Hash),
        [ENDED, name] => is(is_index(name, "", ".parquet"), Naming::Path),
        // A shard has five digits, and more where there are more.
        [COLLECTED, name] => {
            let digits = name
                .strip_prefix("shard-")
                .and_then(|rest| rest.strip_suffix(".parquet"));
            let is_shard = |digits: &str| (5..=12).contains(&digits.len()) && is_number(digits);
            is(digits.is_some_and(is_shard), Naming::Path)
        }
        [RUNS, index, rest @ ..] if is_index(index, "", "") => in_run(rest),
        _ => None,
    }
}

/// True for a shard of a campaign: what others read without asking what is published.
pub(super) fn is_shard(path: &str) -> bool {
    path.split('/').next() == Some(COLLECTED)
}

/// The iteration that a file of a run belongs to.
pub(super) fn iteration(path: &str) -> Option<u64> {
    let mut parts = path.split('/');
    let folder = parts.next()?;
    iteration_of(parts.next()?).filter(|_| folder == ITERATIONS)
}

fn entries(files: &dyn FileSystem, folder: &Path) -> Result<Vec<Entry>, PublishError> {
    match files.list(folder) {
        Ok(entries) => Ok(entries),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(PublishError::io("list", folder)(error)),
    }
}

/// The files in a folder, by their paths below the root.
fn plain(
    files: &dyn FileSystem,
    root: &Path,
    folder: &str,
    into: &mut Vec<String>,
) -> Result<(), PublishError> {
    let found = entries(files, &root.join(folder))?;
    let found = found
        .into_iter()
        .filter(|entry| entry.kind == EntryKind::File);
    into.extend(found.map(|entry| join(folder, &entry.name)));
    Ok(())
}

fn join(folder: &str, name: &str) -> String {
    match folder {
        "" => name.to_owned(),
        folder => format!("{folder}/{name}"),
    }
}

fn of_run(
    files: &dyn FileSystem,
    root: &Path,
    run: &str,
    into: &mut Vec<String>,
) -> Result<(), PublishError> {
    plain(files, root, run, into)?;
    plain(files, root, &join(run, ONCE), into)?;
    let iterations = join(run, ITERATIONS);
    for entry in entries(files, &root.join(&iterations))? {
        if entry.kind == EntryKind::Folder && iteration_of(&entry.name).is_some() {
            plain(files, root, &join(&iterations, &entry.name), into)?;
        }
    }
    Ok(())
}

fn of_campaign(
    files: &std::sync::Arc<dyn FileSystem>,
    root: &Path,
    campaign: &Campaign,
    into: &mut Vec<String>,
) -> Result<(), PublishError> {
    for folder in ["", ENDED, FAILED, COLLECTED] {
        plain(files.as_ref(), root, folder, into)?;
    }
    let states = Folder::at(files.clone(), root).states(campaign.rows.len())?;
    for (index, state) in states.iter().enumerate() {
        if *state == State::Done {
            of_run(files.as_ref(), root, &format!("{RUNS}/{index:06}"), into)?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_published_has_one_of_few_forms() {
        let naming = |kind: Kind, path: &str| kind.naming(path);
        let run = |path| naming(Kind::Run, path);
        let campaign = |path| naming(Kind::Campaign, path);
        assert_eq!(run("run.json"), Some(Naming::Hash));
        assert_eq!(run("once/surface.parquet"), Some(Naming::Path));
        let field = "iterations/wear_iteration=12/wear_field.parquet";
        assert_eq!(run(field), Some(Naming::Path));
        assert_eq!(campaign("campaign.parquet"), Some(Naming::Hash));
        assert_eq!(campaign("failed/000003.json"), Some(Naming::Hash));
        assert_eq!(campaign("ended/000017.parquet"), Some(Naming::Path));
        assert_eq!(
            campaign("collected/shard-00000.parquet"),
            Some(Naming::Path)
        );
        let of_row = format!("runs/000017/{field}");
        assert_eq!(campaign(&of_row), Some(Naming::Path));
        assert_eq!(campaign("runs/000017/run.json"), Some(Naming::Hash));
        for path in [
            "",
            ".",
            "..",
            "/run.json",
            "../run.json",
            "./run.json",
            "once/../run.json",
            "once/..",
            "once/.parquet",
            "once/a b.parquet",
            "once/A.parquet",
            "once/..\\run.json",
            "once//surface.parquet",
            "iterations/wear_iteration=/commit.json",
            "iterations/wear_iteration=+1/commit.json",
            "iterations/wear_iteration=1/../commit.json",
            "iterations/../commit.json",
            "lock",
            "staging/summary.parquet",
            "run.json\0",
            "ended/000017.parquet",
        ] {
            assert_eq!(run(path), None, "{path:?}");
        }
        for path in [
            "ended/17.parquet",
            "ended/../x.parquet",
            "ended/0000017000000000.parquet",
            "ended/00001x.parquet",
            "collected/shard-x.parquet",
            "collected/../../shard-00000.parquet",
            "runs/../run.json",
            "runs/000017/../../run.json",
            "runs/000017",
            "runs/000017/lock",
            "lock",
            "run.json",
        ] {
            assert_eq!(campaign(path), None, "{path:?}");
        }
    }
}
