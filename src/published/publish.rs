//! From a folder into storage.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;

use super::error::PublishError;
use super::files::{CAMPAIGN, Kind, Naming, RUN, is_shard, iteration};
use super::manifest::{Content, LONGEST_FILE, LONGEST_MANIFEST, MANIFEST, Manifest};
use super::objects::{Found, Objects, Put, Version};
use crate::campaign::Campaign;
use crate::store::{FileSystem, LockAttempt, LockGuard};

/// By which a storage shows that it heeds conditions.
const CONDITIONS: &str = "conditions";
const WHY: &[u8] = b"Written twice under the condition that it is not there: fretwear publishes only where that is refused.\n";
/// A version that no object has.
const NO_VERSION: &str = "\"00000000000000000000000000000000\"";
/// Requests at a time: each waits for the network most of its time.
const AT_ONCE: usize = 8;
/// Others may publish this often while `published.json` is replaced.
const TRIES: usize = 16;

/// What a publication did.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Published {
    /// What is published.
    pub kind: Kind,
    /// Files that were uploaded now.
    pub uploaded: usize,
    /// Bytes of them.
    pub bytes: u64,
    /// Files of the folder that are published, with these.
    pub files: usize,
    /// True if what is published has changed.
    pub changed: bool,
}

/// Publishes the folder of a run or of a campaign, or adds to what is published of it.
///
/// # Errors
/// [`PublishError::Other`] if something else is published there, [`PublishError::Behind`] if more is; [`PublishError::NoConditions`];
/// those of the folder and of the storage.
pub fn publish(
    objects: &dyn Objects,
    files: &Arc<dyn FileSystem>,
    root: &Path,
) -> Result<Published, PublishError> {
    let kind = Kind::of(files.as_ref(), root)?;
    let _guard = lock(files.as_ref(), root)?;
    let own = contents(files, root, kind)?;
    if kind == Kind::Run && !own.keys().any(|path| iteration(path).is_some()) {
        return Err(PublishError::NotBegun {
            path: root.to_owned(),
        });
    }
    let mut there = objects.list()?;
    check_conditions(objects)?;
    let mut published = Published {
        kind,
        uploaded: 0,
        bytes: 0,
        files: own.len(),
        changed: false,
    };
    for _ in 0..TRIES {
        let before = Manifest::read(objects)?;
        let mut manifest = match &before {
            Some((found, _)) => {
                check_same(objects, found, files.as_ref(), root, kind, &own)?;
                found.clone()
            }
            None => Manifest::new(kind),
        };
        let missing: Vec<(&String, &Content)> = own
            .iter()
            .filter(|(path, content)| manifest.files.get(*path) != Some(content))
            .collect();
        upload(
            objects,
            files.as_ref(),
            root,
            &missing,
            &mut there,
            kind,
            &mut published,
        )?;
        if missing.is_empty() {
            return Ok(published);
        }
        let more = missing
            .into_iter()
            .map(|(path, content)| (path.clone(), content.clone()));
        manifest.files.extend(more);
        let bytes = manifest.to_bytes();
        if bytes.len() as u64 > LONGEST_MANIFEST {
            return Err(PublishError::TooMuch {
                path: root.to_owned(),
                reason: format!(
                    "{} files are too many for one publication; a campaign with keep = \"history\" has one a run",
                    manifest.files.len()
                ),
            });
        }
        let put = match &before {
            Some((_, version)) => objects.replace(MANIFEST, bytes, version)?,
            None => objects.create(MANIFEST, bytes)?,
        };
        if put == Put::Done {
            published.changed = true;
            return Ok(published);
        }
    }
    Err(PublishError::Contended {
        place: objects.place(),
        times: TRIES,
    })
}

/// Nobody computes, plans or collects as long as the guard is held.
pub(super) fn lock(
    files: &dyn FileSystem,
    root: &Path,
) -> Result<Box<dyn LockGuard>, PublishError> {
    let path = root.join("lock");
    let attempt = files.try_lock(&path);
    match attempt.map_err(PublishError::io("lock", &path))? {
        LockAttempt::Taken(guard) => Ok(guard),
        LockAttempt::Held { pid } => Err(PublishError::Locked {
            path: root.to_owned(),
            pid,
        }),
    }
}

/// What the folder has to publish.
fn contents(
    files: &Arc<dyn FileSystem>,
    root: &Path,
    kind: Kind,
) -> Result<BTreeMap<String, Content>, PublishError> {
    let mut contents = BTreeMap::new();
    for path in kind.paths(files, root)? {
        let full = root.join(&path);
        let found = files.metadata(&full);
        let Some(found) = found.map_err(PublishError::io("look at", &full))? else {
            return Err(PublishError::Changed { path: full });
        };
        if found.len > LONGEST_FILE {
            return Err(PublishError::TooMuch {
                path: full,
                reason: format!(
                    "it has {} bytes, and one request carries {LONGEST_FILE}",
                    found.len
                ),
            });
        }
        let hash = files.hash(&full).map_err(PublishError::io("read", &full))?;
        let content = Content {
            bytes: found.len,
            hash: hash.to_hex().to_string(),
        };
        contents.insert(path, content);
    }
    Ok(contents)
}

/// Refuses a storage that takes a condition and passes it over: it would overwrite.
fn check_conditions(objects: &dyn Objects) -> Result<(), PublishError> {
    let refused = |condition| PublishError::NoConditions {
        place: objects.place(),
        condition,
    };
    if objects.create(CONDITIONS, WHY.to_vec())? == Put::Done
        && objects.create(CONDITIONS, WHY.to_vec())? == Put::Done
    {
        return Err(refused("If-None-Match"));
    }
    let none = Version(NO_VERSION.to_owned());
    match objects.replace(CONDITIONS, WHY.to_vec(), &none)? {
        Put::Refused => Ok(()),
        Put::Done => Err(refused("If-Match")),
    }
}

/// Refuses what is another run or campaign than the one that is published, or an earlier state of it.
fn check_same(
    objects: &dyn Objects,
    published: &Manifest,
    files: &dyn FileSystem,
    root: &Path,
    kind: Kind,
    own: &BTreeMap<String, Content>,
) -> Result<(), PublishError> {
    let place = objects.place();
    if published.kind != kind {
        return Err(PublishError::of_another_kind(place, published.kind, kind));
    }
    let other = |what: String| PublishError::Other {
        place: place.clone(),
        found: format!("another {}", kind.name()),
        what,
    };
    let behind = |theirs: String, ours: String| PublishError::Behind {
        place: place.clone(),
        theirs,
        path: root.to_owned(),
        ours,
    };
    // First, since it says most.
    if let (Some(theirs), Some(ours), Kind::Campaign) =
        (published.files.get(CAMPAIGN), own.get(CAMPAIGN), kind)
        && theirs != ours
    {
        let path = root.join(CAMPAIGN);
        let bytes = files
            .read(&path, LONGEST_FILE)
            .map_err(PublishError::io("read", &path))?;
        let ours = Campaign::of_bytes(&bytes).map_err(|_| PublishError::Changed { path })?;
        let theirs = published.content(objects, CAMPAIGN, theirs)?;
        let theirs = Campaign::of_bytes(&theirs).map_err(|reason| PublishError::Damaged {
            place: place.clone(),
            name: CAMPAIGN.to_owned(),
            reason,
        })?;
        if let Some(row) = theirs.first_difference(&ours) {
            return Err(other(format!("its row {row} is another")));
        }
        let [theirs, ours] = [theirs.rows.len(), ours.rows.len()];
        if theirs > ours {
            return Err(behind(format!("{theirs} rows"), format!("has {ours}")));
        }
    }
    for (path, content) in own {
        let is_kept = kind.naming(path) == Some(Naming::Path);
        let differs = published
            .files
            .get(path)
            .is_some_and(|theirs| theirs != content);
        if is_kept && differs {
            return Err(other(format!("its {path} is another")));
        }
    }
    if kind == Kind::Run {
        let last =
            |paths: &BTreeMap<String, Content>| paths.keys().filter_map(|p| iteration(p)).max();
        let (theirs, ours) = (last(&published.files), last(own));
        if theirs > ours {
            let told = |last: Option<u64>| format!("iteration {}", last.unwrap_or_default());
            return Err(behind(told(theirs), format!("ends with {}", told(ours))));
        }
        let shared =
            |path: &String| own.contains_key(path) && kind.naming(path) == Some(Naming::Path);
        if !published.files.keys().any(shared) {
            return Err(other(format!(
                "no iteration is that of {}",
                root.join(RUN).display()
            )));
        }
    }
    Ok(())
}

/// Uploads what is not there yet. Shards come last and in their order, so that whoever reads them by name never misses an earlier one.
fn upload(
    objects: &dyn Objects,
    files: &dyn FileSystem,
    root: &Path,
    missing: &[(&String, &Content)],
    there: &mut BTreeSet<String>,
    kind: Kind,
    published: &mut Published,
) -> Result<(), PublishError> {
    let (shards, rest): (Vec<_>, Vec<_>) = missing.iter().partition(|(path, _)| is_shard(path));
    // Files of the same content have one object.
    let mut jobs: BTreeMap<String, (&String, &Content)> = BTreeMap::new();
    for (path, content) in rest {
        jobs.insert(object(kind, path, content), (path, content));
    }
    let jobs: Vec<(String, (&String, &Content))> = jobs.into_iter().collect();
    let done = each(&jobs, |(name, (path, content))| {
        put(
            objects,
            files,
            &root.join(path),
            name,
            content,
            there.contains(name),
        )
    })?;
    let mut count = |name: &str, content: &Content, uploaded: bool| {
        if uploaded {
            published.uploaded += 1;
            published.bytes += content.bytes;
        }
        there.insert(name.to_owned());
    };
    for ((name, (_, content)), uploaded) in jobs.iter().zip(done) {
        count(name, content, uploaded);
    }
    for (path, content) in shards {
        let name = object(kind, path, content);
        let was_there = there.contains(&name);
        let uploaded = put(objects, files, &root.join(path), &name, content, was_there)?;
        if uploaded {
            published.uploaded += 1;
            published.bytes += content.bytes;
        }
        there.insert(name);
    }
    Ok(())
}

fn object(kind: Kind, path: &str, content: &Content) -> String {
    content.object(kind.naming(path).unwrap_or(Naming::Hash), path)
}

/// Uploads a file; false if its object was there, with the same content.
fn put(
    objects: &dyn Objects,
    files: &dyn FileSystem,
    path: &Path,
    name: &str,
    content: &Content,
    was_there: bool,
) -> Result<bool, PublishError> {
    if !was_there {
        let bytes = files
            .read(path, content.bytes)
            .map_err(PublishError::io("read", path))?;
        if Content::of(&bytes) != *content {
            return Err(PublishError::Changed {
                path: path.to_owned(),
            });
        }
        if objects.create(name, bytes)? == Put::Done {
            return Ok(true);
        }
    }
    match objects.read(name, content.bytes)? {
        Found::Object(bytes, _) if Content::of(&bytes) == *content => Ok(false),
        _ => Err(PublishError::Other {
            place: objects.place(),
            found: "something else".to_owned(),
            what: format!("its {name} is another than {}", path.display()),
        }),
    }
}

/// Does something with each item, several at a time; the results in order, or the first error.
pub(super) fn each<T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&T) -> Result<R, PublishError> + Sync,
) -> Result<Vec<R>, PublishError> {
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    let next = AtomicUsize::new(0);
    let failed = AtomicBool::new(false);
    let one = || {
        let mut done = Vec::new();
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(k).filter(|_| !failed.load(Ordering::Relaxed)) else {
                return done;
            };
            let result = work(item);
            if result.is_err() {
                failed.store(true, Ordering::Relaxed);
            }
            done.push((k, result));
        }
    };
    let mut done: Vec<(usize, Result<R, PublishError>)> = std::thread::scope(|scope| {
        let threads: Vec<_> = (0..AT_ONCE.min(items.len()))
            .map(|_| scope.spawn(one))
            .collect();
        let parts = threads.into_iter().map(|thread| thread.join());
        parts
            .flat_map(|part| part.expect("neither a folder nor a storage panics"))
            .collect()
    });
    done.sort_by_key(|(k, _)| *k);
    done.into_iter().map(|(_, result)| result).collect()
}
