//! File system with injected faults.

use fretwear::store::{Entry, FileSystem, LockAttempt, LockGuard, Metadata, RealFileSystem};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// Fault at the chosen call.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The call fails, and later calls succeed.
    Error,
    /// The process ends: this call and all later calls fail. The call truncates the written file to half.
    EndTruncating,
    /// The process ends before the written file gets a name.
    EndBefore,
    /// The machine loses power. As in `EndTruncating`, all later calls fail. The file system also undoes every name without a later
    /// `sync_dir` and truncates every file without a later `sync_file`.
    PowerLoss,
}

enum Undo {
    Created(PathBuf),
    /// A file whose content is not yet on the disk.
    Written(PathBuf),
    Renamed {
        from: PathBuf,
        to: PathBuf,
        replaced: Option<Vec<u8>>,
    },
    Removed(PathBuf, Vec<u8>),
}

impl Undo {
    /// Path of the change. A sync of its folder makes the change durable.
    fn path(&self) -> &Path {
        match self {
            Undo::Created(path) | Undo::Written(path) | Undo::Removed(path, _) => path,
            Undo::Renamed { to, .. } => to,
        }
    }

    fn path_mut(&mut self) -> &mut PathBuf {
        match self {
            Undo::Created(path) | Undo::Written(path) | Undo::Removed(path, _) => path,
            Undo::Renamed { to, .. } => to,
        }
    }

    fn apply(self) {
        match self {
            Undo::Created(path) if path.is_dir() => drop(fs::remove_dir_all(path)),
            Undo::Created(path) => drop(fs::remove_file(path)),
            Undo::Written(path) => {
                if let Ok(bytes) = fs::read(&path) {
                    drop(fs::write(path, &bytes[..bytes.len() / 2]));
                }
            }
            Undo::Renamed { from, to, replaced } => {
                drop(fs::rename(&to, &from));
                if let Some(bytes) = replaced {
                    drop(fs::write(&to, bytes));
                }
            }
            Undo::Removed(path, bytes) => drop(fs::write(path, bytes)),
        }
    }
}

#[derive(Default)]
struct State {
    calls: usize,
    changes: usize,
    ended: bool,
    undo: Vec<Undo>,
}

/// Real file system with injected faults, without waiting for the disk.
///
/// An error may occur at every call. An end of the process differs only by the changes before it, so its position counts only the calls
/// with a change.
pub struct FaultyFileSystem {
    fault: Option<(usize, Fault)>,
    free_space: u64,
    state: Mutex<State>,
}

/// Whether the file system executes a call.
enum Verdict {
    Go,
    Stop { cut_file: bool },
}

impl FaultyFileSystem {
    /// File system without a fault.
    pub fn sound() -> Self {
        FaultyFileSystem {
            fault: None,
            free_space: u64::MAX,
            state: Mutex::default(),
        }
    }

    /// File system that fails at one call, counted from 1 among the calls that can have this fault.
    pub fn failing(call: usize, fault: Fault) -> Self {
        FaultyFileSystem {
            fault: Some((call, fault)),
            ..FaultyFileSystem::sound()
        }
    }

    /// File system with limited free space.
    pub fn with_free_space(free_space: u64) -> Self {
        FaultyFileSystem {
            free_space,
            ..FaultyFileSystem::sound()
        }
    }

    /// Number of calls so far that can have this fault.
    pub fn calls(&self, fault: Fault) -> usize {
        let state = self.state.lock().expect("no panic while held");
        match fault {
            Fault::Error => state.calls,
            _ => state.changes,
        }
    }

    /// After a power loss, undoes every change that is not durable.
    pub fn settle(&self) {
        let mut state = self.state.lock().expect("no panic while held");
        if state.ended && matches!(self.fault, Some((_, Fault::PowerLoss))) {
            while let Some(undo) = state.undo.pop() {
                undo.apply();
            }
        }
    }

    fn verdict(&self, changes: bool) -> Verdict {
        let mut state = self.state.lock().expect("no panic while held");
        state.calls += 1;
        state.changes += usize::from(changes);
        if state.ended {
            return Verdict::Stop { cut_file: false };
        }
        match self.fault {
            Some((call, Fault::Error)) if call == state.calls => Verdict::Stop { cut_file: false },
            Some((call, fault)) if fault != Fault::Error && changes && call == state.changes => {
                state.ended = true;
                Verdict::Stop {
                    cut_file: fault != Fault::EndBefore,
                }
            }
            _ => Verdict::Go,
        }
    }

    /// Check before a call with a change.
    fn check_change(&self) -> io::Result<()> {
        match self.verdict(true) {
            Verdict::Go => Ok(()),
            Verdict::Stop { .. } => Err(injected()),
        }
    }

    /// Check before a read-only call.
    fn check_look(&self) -> io::Result<()> {
        match self.verdict(false) {
            Verdict::Go => Ok(()),
            Verdict::Stop { .. } => Err(injected()),
        }
    }

    fn note(&self, undo: Undo) {
        self.state
            .lock()
            .expect("no panic while held")
            .undo
            .push(undo);
    }
}

fn injected() -> io::Error {
    io::Error::other("injected")
}

struct NoGuard;
impl LockGuard for NoGuard {}

impl FileSystem for FaultyFileSystem {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        self.check_change()?;
        let missing: Vec<&Path> = path
            .ancestors()
            .take_while(|level| !level.exists())
            .collect();
        fs::create_dir_all(path)?;
        for level in missing.into_iter().rev() {
            self.note(Undo::Created(level.to_owned()));
        }
        Ok(())
    }

    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        match self.verdict(true) {
            Verdict::Go => {
                if path.exists() {
                    return Err(io::Error::from(io::ErrorKind::AlreadyExists));
                }
                fs::write(path, bytes)?;
                self.note(Undo::Created(path.to_owned()));
                self.note(Undo::Written(path.to_owned()));
                Ok(())
            }
            Verdict::Stop { cut_file } => {
                if cut_file {
                    fs::write(path, &bytes[..bytes.len() / 2])?;
                }
                Err(injected())
            }
        }
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        self.check_change()?;
        let mut state = self.state.lock().expect("no panic while held");
        state
            .undo
            .retain(|undo| !matches!(undo, Undo::Written(written) if written == path));
        Ok(())
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        self.check_look()?;
        RealFileSystem.read(path, most)
    }

    fn hash(&self, path: &Path) -> io::Result<blake3::Hash> {
        self.check_look()?;
        RealFileSystem.hash(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        self.check_change()?;
        let replaced = fs::read(to).ok();
        fs::rename(from, to)?;
        // Unsynced changes inside a renamed folder get the new path.
        let mut state = self.state.lock().expect("no panic while held");
        for undo in &mut state.undo {
            let content = matches!(undo, Undo::Written(_));
            let path = undo.path_mut();
            if let Ok(inside) = path.strip_prefix(from) {
                if inside.components().next().is_some() {
                    *path = to.join(inside);
                } else if content {
                    *path = to.to_owned();
                }
            }
        }
        state.undo.push(Undo::Renamed {
            from: from.to_owned(),
            to: to.to_owned(),
            replaced,
        });
        Ok(())
    }

    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        self.check_change()?;
        let mut state = self.state.lock().expect("no panic while held");
        state
            .undo
            .retain(|undo| matches!(undo, Undo::Written(_)) || undo.path().parent() != Some(path));
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        self.check_change()?;
        let bytes = fs::read(path)?;
        fs::remove_file(path)?;
        self.note(Undo::Removed(path.to_owned(), bytes));
        Ok(())
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        match self.verdict(true) {
            Verdict::Go => fs::remove_dir_all(path),
            Verdict::Stop { .. } => {
                // The process ends when half of the folder is removed.
                if let Some(entry) = fs::read_dir(path)?.next() {
                    let inner = entry?.path();
                    if inner.is_file() {
                        fs::remove_file(inner)?;
                    }
                }
                Err(injected())
            }
        }
    }

    fn list(&self, path: &Path) -> io::Result<Vec<Entry>> {
        self.check_look()?;
        RealFileSystem.list(path)
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        self.check_look()?;
        RealFileSystem.metadata(path)
    }

    fn free_space(&self, _path: &Path) -> io::Result<u64> {
        self.check_look()?;
        Ok(self.free_space)
    }

    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt> {
        self.check_change()?;
        fs::write(path, "")?;
        Ok(LockAttempt::Taken(Box::new(NoGuard)))
    }
}
