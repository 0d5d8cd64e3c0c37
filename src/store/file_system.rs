//! The calls that the run store makes to the file system.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

/// One entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Name within the folder.
    pub name: String,
    /// True for a folder.
    pub is_dir: bool,
}

/// What the store asks of a path that exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metadata {
    /// Length in bytes.
    pub len: u64,
    /// True for a folder.
    pub is_dir: bool,
}

/// Held as long as the lock is.
pub trait LockGuard: Send + Sync {}
impl LockGuard for File {}

/// What came of asking for a lock.
pub enum LockAttempt {
    /// The lock is ours until the guard is dropped or the process ends.
    Taken(Box<dyn LockGuard>),
    /// Another process, or another store of this one, holds it.
    Held {
        /// Its process number, if the lock file tells.
        pid: Option<u32>,
    },
}

/// The file system as the store needs it.
///
/// Every method returns the error of the system; the store adds the path.
pub trait FileSystem: Send + Sync {
    /// Creates a folder and those above it; one that exists is no error.
    fn create_dir_all(&self, path: &Path) -> io::Result<()>;
    /// Writes a file that must not exist, without waiting for the disk.
    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()>;
    /// Returns when the content of a file is on the disk.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// The content of a file.
    fn read(&self, path: &Path) -> io::Result<Vec<u8>>;
    /// Renames a file, replacing one at the target, or a folder.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Returns when the names in a folder are on the disk.
    fn sync_dir(&self, path: &Path) -> io::Result<()>;
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Removes a folder and what is in it.
    fn remove_dir_all(&self, path: &Path) -> io::Result<()>;
    /// The entries of a folder, sorted by name.
    fn list(&self, path: &Path) -> io::Result<Vec<Entry>>;
    /// What there is at a path, `None` if nothing.
    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>>;
    /// Bytes that this user may still write where the path is.
    fn free_space(&self, path: &Path) -> io::Result<u64>;
    /// Takes the exclusive lock of a file, created if need be, without waiting.
    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt>;
}

/// The file system of the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct RealFileSystem;

/// Who holds a lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LockHolder {
    /// The process, if the lock file tells.
    pub pid: Option<u32>,
}

/// Times that a lock is tried, and the wait between: whoever only asks for the holder takes it for an instant.
const TRIES: usize = 5;
const BETWEEN_TRIES: Duration = Duration::from_millis(20);

impl RealFileSystem {
    /// Who holds the lock of a file, without changing anything; `None` if nobody does.
    ///
    /// # Errors
    /// Those of the system, but for a file that is not there.
    pub fn lock_holder(&self, path: &Path) -> io::Result<Option<LockHolder>> {
        let mut file = match File::open(path) {
            Ok(file) => file,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(error),
        };
        match file.try_lock_shared() {
            Ok(()) => Ok(None),
            Err(TryLockError::WouldBlock) => Ok(Some(LockHolder {
                pid: holder_in(&mut file)?,
            })),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }
}

fn holder_in(file: &mut File) -> io::Result<Option<u32>> {
    let mut holder = String::new();
    file.read_to_string(&mut holder)?;
    Ok(holder.trim().parse().ok())
}

impl FileSystem for RealFileSystem {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path)
    }

    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        File::create_new(path)?.write_all(bytes)
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        // Some systems want the right to write for it.
        OpenOptions::new().write(true).open(path)?.sync_all()
    }

    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        fs::read(path)
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    #[cfg(unix)]
    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    // Other systems have no such call: names are as durable there as the system makes them.
    #[cfg(not(unix))]
    fn sync_dir(&self, _path: &Path) -> io::Result<()> {
        Ok(())
    }

    fn remove_file(&self, path: &Path) -> io::Result<()> {
        fs::remove_file(path)
    }

    fn remove_dir_all(&self, path: &Path) -> io::Result<()> {
        fs::remove_dir_all(path)
    }

    fn list(&self, path: &Path) -> io::Result<Vec<Entry>> {
        let mut entries = fs::read_dir(path)?
            .map(|entry| {
                let entry = entry?;
                Ok(Entry {
                    name: entry.file_name().to_string_lossy().into_owned(),
                    is_dir: entry.file_type()?.is_dir(),
                })
            })
            .collect::<io::Result<Vec<Entry>>>()?;
        entries.sort();
        Ok(entries)
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        match fs::metadata(path) {
            Ok(found) => Ok(Some(Metadata {
                len: found.len(),
                is_dir: found.is_dir(),
            })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn free_space(&self, path: &Path) -> io::Result<u64> {
        fs4::available_space(path)
    }

    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt> {
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        let mut attempt = file.try_lock();
        for _ in 1..TRIES {
            if !matches!(attempt, Err(TryLockError::WouldBlock)) {
                break;
            }
            sleep(BETWEEN_TRIES);
            attempt = file.try_lock();
        }
        match attempt {
            Ok(()) => {
                file.set_len(0)?;
                file.rewind()?;
                write!(file, "{}", std::process::id())?;
                Ok(LockAttempt::Taken(Box::new(file)))
            }
            Err(TryLockError::WouldBlock) => Ok(LockAttempt::Held {
                pid: holder_in(&mut file)?,
            }),
            Err(TryLockError::Error(error)) => Err(error),
        }
    }
}
