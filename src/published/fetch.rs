//! From storage into a folder.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;

use super::error::PublishError;
use super::files::{CAMPAIGN, Kind, Naming, OF_CAMPAIGN, RUN};
use super::manifest::{Content, LONGEST_FILE, Manifest};
use super::objects::Objects;
use super::publish::{each, lock};
use crate::campaign::Campaign;
use crate::store::{EntryKind, FileSystem};

/// Ending of a file that is being written.
const DRAFT: &str = ".new";

/// What was fetched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fetched {
    /// What it is.
    pub kind: Kind,
    /// Files that were written now.
    pub files: usize,
    /// Bytes of them.
    pub bytes: u64,
    /// Files that are published.
    pub published: usize,
}

/// Fetches what is published into a folder, which is made if it is not there. What was fetched before is not fetched again; of a campaign
/// that is in the folder, what others have published is added. Nothing in the folder is given other content, but the table of a campaign
/// that has become longer.
///
/// # Errors
/// [`PublishError::NothingPublished`]; [`PublishError::Damaged`] for what is not as it was published; [`PublishError::Occupied`] if the
/// folder holds something else; those of the folder and of the storage.
pub fn fetch(
    objects: &dyn Objects,
    files: &Arc<dyn FileSystem>,
    root: &Path,
) -> Result<Fetched, PublishError> {
    let Some((manifest, _)) = Manifest::read(objects)? else {
        // A bucket that there is not says so.
        objects.list()?;
        return Err(PublishError::NothingPublished {
            place: objects.place(),
        });
    };
    let kind = manifest.kind;
    let files = files.as_ref();
    check_own(files, root, kind)?;
    files
        .create_dir_all(root)
        .map_err(PublishError::io("make the folder", root))?;
    let _guard = lock(files, root)?;
    let is_newer = check_same(objects, &manifest, files, root)?;
    // What makes the folder a run or a campaign comes last.
    let is_last = |path: &str| match kind {
        Kind::Run => path.starts_with("run."),
        Kind::Campaign => path == CAMPAIGN,
    };
    let mut wanted = Vec::new();
    for (path, content) in &manifest.files {
        if is_wanted(files, root, kind, path, content, is_newer)? {
            wanted.push((path, content));
        }
    }
    let bytes = wanted.iter().map(|(_, content)| content.bytes).sum();
    let free = files
        .free_space(root)
        .map_err(PublishError::io("look at", root))?;
    if bytes > free {
        return Err(PublishError::NoSpace {
            path: root.to_owned(),
            bytes,
            free,
        });
    }
    let (last, first): (Vec<_>, Vec<_>) = wanted.iter().partition(|(path, _)| is_last(path));
    each(&first, |(path, content)| {
        let bytes = manifest.content(objects, path, content)?;
        write(files, &root.join(path), &bytes)
    })?;
    sync_folders(files, root, &first)?;
    // The copy of a run's record before the record.
    for (path, content) in &last {
        let bytes = manifest.content(objects, path, content)?;
        write(files, &root.join(path), &bytes)?;
    }
    files
        .sync_dir(root)
        .map_err(PublishError::io("sync the folder", root))?;
    Ok(Fetched {
        kind,
        files: wanted.len(),
        bytes,
        published: manifest.files.len(),
    })
}

/// Refuses a folder that holds something else.
fn check_own(files: &dyn FileSystem, root: &Path, kind: Kind) -> Result<(), PublishError> {
    let entries = match files.list(root) {
        Ok(entries) => entries,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Err(error) => return Err(PublishError::io("list", root)(error)),
    };
    match entries.into_iter().find(|entry| !kind.is_own(&entry.name)) {
        None => Ok(()),
        Some(entry) => Err(PublishError::Occupied {
            path: root.to_owned(),
            what: format!("`{}`, which is no part of a {}", entry.name, kind.name()),
        }),
    }
}

/// Refuses a folder of another run or campaign. True if the published campaign is longer than that of the folder, or there is none in it.
fn check_same(
    objects: &dyn Objects,
    manifest: &Manifest,
    files: &dyn FileSystem,
    root: &Path,
) -> Result<bool, PublishError> {
    let kind = manifest.kind;
    let path = root.join(kind.defining());
    let found = files
        .metadata(&path)
        .map_err(PublishError::io("look at", &path))?;
    // That it names one has been checked.
    let (Some(_), Some(content)) = (found, manifest.files.get(kind.defining())) else {
        return Ok(true);
    };
    let ours = files
        .read(&path, LONGEST_FILE)
        .map_err(PublishError::io("read", &path))?;
    if Content::of(&ours) == *content {
        return Ok(false);
    }
    let occupied = |what: String| PublishError::Occupied {
        path: root.to_owned(),
        what,
    };
    if kind == Kind::Run {
        return Err(occupied(format!(
            "another run, or another state of this one ({RUN} differs)"
        )));
    }
    let ours = Campaign::of_bytes(&ours)
        .map_err(|reason| occupied(format!("a {CAMPAIGN} that cannot be read ({reason})")))?;
    let theirs = manifest.content(objects, CAMPAIGN, content)?;
    let theirs = Campaign::of_bytes(&theirs).map_err(|reason| PublishError::Damaged {
        place: objects.place(),
        name: CAMPAIGN.to_owned(),
        reason,
    })?;
    match ours.first_difference(&theirs) {
        Some(row) => Err(occupied(format!(
            "another campaign: its row {row} is another"
        ))),
        None => Ok(theirs.rows.len() > ours.rows.len()),
    }
}

/// True for a file that the folder lacks, or whose published content is the newer one.
fn is_wanted(
    files: &dyn FileSystem,
    root: &Path,
    kind: Kind,
    path: &str,
    content: &Content,
    is_newer: bool,
) -> Result<bool, PublishError> {
    let full = root.join(path);
    let found = files
        .metadata(&full)
        .map_err(PublishError::io("look at", &full))?;
    let Some(found) = found else {
        return Ok(true);
    };
    let is_plain = found.kind == EntryKind::File && found.len == content.bytes;
    if is_plain {
        let hash = files.hash(&full).map_err(PublishError::io("read", &full))?;
        if hash.to_hex().as_str() == content.hash {
            return Ok(false);
        }
    }
    if kind.naming(path) == Some(Naming::Path) || kind == Kind::Run || found.kind != EntryKind::File
    {
        return Err(PublishError::Occupied {
            path: root.to_owned(),
            what: format!("another {path} than is published"),
        });
    }
    Ok(is_newer && OF_CAMPAIGN.contains(&path))
}

/// Gives a file its content in one step.
fn write(files: &dyn FileSystem, path: &Path, bytes: &[u8]) -> Result<(), PublishError> {
    let mut draft = path.as_os_str().to_owned();
    draft.push(DRAFT);
    let draft = std::path::PathBuf::from(draft);
    if let Some(folder) = path.parent() {
        files
            .create_dir_all(folder)
            .map_err(PublishError::io("make the folder", folder))?;
    }
    files
        .replace(&draft, path, bytes)
        .map_err(PublishError::io("write", path))
}

/// The names of what was written are on the disk, before the file that says they are there.
fn sync_folders(
    files: &dyn FileSystem,
    root: &Path,
    written: &[(&String, &Content)],
) -> Result<(), PublishError> {
    let mut folders = BTreeSet::new();
    for (path, _) in written {
        let above = Path::new(path.as_str()).ancestors().skip(1);
        folders.extend(above.map(|folder| root.join(folder)));
    }
    for folder in folders {
        files
            .sync_dir(&folder)
            .map_err(PublishError::io("sync the folder", &folder))?;
    }
    Ok(())
}
