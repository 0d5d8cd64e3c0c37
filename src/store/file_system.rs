//! File system calls of the run store.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

/// Kind of a directory entry. A link counts as a link, not as its target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntryKind {
    /// A regular file, which contains bytes.
    File,
    /// A folder.
    Folder,
    /// A symbolic link with any target.
    Link,
    /// A pipe, a socket or a device.
    Other,
}

impl From<fs::FileType> for EntryKind {
    fn from(file_type: fs::FileType) -> Self {
        if file_type.is_symlink() {
            EntryKind::Link
        } else if file_type.is_dir() {
            EntryKind::Folder
        } else if file_type.is_file() {
            EntryKind::File
        } else {
            EntryKind::Other
        }
    }
}

/// One entry of a folder.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub struct Entry {
    /// Name within the folder.
    pub name: String,
    /// Kind of the entry.
    pub kind: EntryKind,
}

/// Metadata of an existing path, as far as the store uses it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metadata {
    /// Length in bytes.
    pub len: u64,
    /// Kind of the entry.
    pub kind: EntryKind,
}

/// Guard of a file lock. Dropping the guard releases the lock.
pub trait LockGuard: Send + Sync {}
impl LockGuard for File {}

/// Result of trying to lock.
pub enum LockAttempt {
    /// The lock is ours until the guard is dropped or the process ends.
    Taken(Box<dyn LockGuard>),
    /// Another process has the lock, or another store in the current process has the lock.
    Held {
        /// Number of that process, if the lock file states it.
        pid: Option<u32>,
    },
}

/// File system interface of the store.
///
/// Every method returns the error of the system; the store adds the path.
pub trait FileSystem: Send + Sync {
    /// Creates a folder and all missing parents of the folder. An existing folder is not an error.
    fn create_dir_all(&self, path: &Path) -> io::Result<()>;
    /// Writes a file that must not exist yet, without syncing it.
    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()>;
    /// Syncs the content of a file to the disk.
    fn sync_file(&self, path: &Path) -> io::Result<()>;
    /// Reads a file of at most `most` bytes. Rejects longer files, links and anything that is not a file, before
    /// reading.
    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>>;
    /// Computes the blake3 hash of a file block by block. Rejects links and anything that is not a file.
    fn hash(&self, path: &Path) -> io::Result<blake3::Hash>;
    /// Renames a file, replacing an existing target, or a folder.
    fn rename(&self, from: &Path, to: &Path) -> io::Result<()>;
    /// Syncs the entries of a folder to the disk.
    fn sync_dir(&self, path: &Path) -> io::Result<()>;
    /// Removes a file.
    fn remove_file(&self, path: &Path) -> io::Result<()>;
    /// Removes a folder and all files and folders in the folder.
    fn remove_dir_all(&self, path: &Path) -> io::Result<()>;
    /// Lists the entries of a folder, sorted by name.
    fn list(&self, path: &Path) -> io::Result<Vec<Entry>>;
    /// Returns the metadata of a path, `None` if nothing exists there. Does not follow links.
    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>>;
    /// Returns the free space at the path for the current user, in bytes.
    fn free_space(&self, path: &Path) -> io::Result<u64>;
    /// Tries to take the exclusive lock of a file, which is created if needed, without waiting.
    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt>;

    /// Replaces a file or a link in one step: writes and syncs `draft`, then renames it. After an error the old file
    /// still exists. The caller syncs the folder.
    fn replace(&self, draft: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
        // A killed process may have left a draft.
        if self.metadata(draft)?.is_some() {
            self.remove_file(draft)?;
        }
        let outcome = self
            .write_new(draft, bytes)
            .and_then(|()| self.sync_file(draft))
            .and_then(|()| self.rename(draft, path));
        if outcome.is_err() {
            // The error of the removal would hide the first error.
            drop(self.remove_file(draft));
        }
        outcome
    }
}

/// The file system of the machine.
#[derive(Debug, Clone, Copy, Default)]
pub struct RealFileSystem;

/// Process that has a lock.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LockHolder {
    /// Number of the process, if the lock file states it.
    pub pid: Option<u32>,
}

/// Number of attempts and pause between them. A process that only asks for the holder has the lock for an instant.
const TRIES: usize = 5;
const BETWEEN_TRIES: Duration = Duration::from_millis(20);

/// Most bytes of a lock file. A lock file contains a process number. After a power cut, a lock file can contain up to
/// `LONGEST_HOLDER` zero bytes, because the program does not sync the lock file.
const LONGEST_HOLDER: u64 = 20;

impl RealFileSystem {
    /// Returns the holder of a file's lock without changing anything, `None` if the lock is free.
    ///
    /// # Errors
    /// Errors of the system. A missing file is not an error.
    pub fn lock_holder(&self, path: &Path) -> io::Result<Option<LockHolder>> {
        let mut file = match open_plain(OpenOptions::new().read(true), path) {
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
    let mut holder = Vec::new();
    file.take(LONGEST_HOLDER + 1).read_to_end(&mut holder)?;
    let holder = str::from_utf8(&holder).ok();
    Ok(holder.and_then(|holder| holder.trim().parse().ok()))
}

/// Checks that an open file is still the file at the path.
#[cfg(unix)]
fn is_at(opened: &fs::Metadata, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    match fs::symlink_metadata(path) {
        Ok(current) => Ok((current.dev(), current.ino()) == (opened.dev(), opened.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// On other systems an open file cannot be removed.
#[cfg(not(unix))]
fn is_at(_opened: &fs::Metadata, _path: &Path) -> io::Result<bool> {
    Ok(true)
}

/// Returns the number of names (hard links) of a file.
#[cfg(unix)]
fn names(metadata: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(metadata)
}

#[cfg(not(unix))]
fn names(_metadata: &fs::Metadata) -> u64 {
    1
}

/// Opens a regular file. Rejects a link, and a pipe, which would block.
fn open_plain(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
    }
    // The system's own error for the flags above is unclear.
    let refuse = |kind| {
        let what = match kind {
            EntryKind::File => return Ok(()),
            EntryKind::Folder => "it is a folder, not a file",
            EntryKind::Link => "it is a link, and links are not followed",
            EntryKind::Other => "it is a pipe, a socket or a device, not a file",
        };
        Err(io::Error::new(io::ErrorKind::InvalidInput, what))
    };
    if let Ok(metadata) = fs::symlink_metadata(path) {
        refuse(metadata.file_type().into())?;
    }
    let file = options.open(path)?;
    refuse(file.metadata()?.file_type().into())?;
    Ok(file)
}

impl FileSystem for RealFileSystem {
    fn create_dir_all(&self, path: &Path) -> io::Result<()> {
        fs::create_dir_all(path)
    }

    fn write_new(&self, path: &Path, bytes: &[u8]) -> io::Result<()> {
        File::create_new(path)?.write_all(bytes)
    }

    fn sync_file(&self, path: &Path) -> io::Result<()> {
        // Some systems require write access to sync.
        OpenOptions::new().write(true).open(path)?.sync_all()
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        let file = open_plain(OpenOptions::new().read(true), path)?;
        let length = file.metadata()?.len();
        let too_long = || {
            let text = format!("it is longer than {most} bytes, the limit for this file");
            io::Error::new(io::ErrorKind::FileTooLarge, text)
        };
        if length > most {
            return Err(too_long());
        }
        // Another process may extend the file during reading, so `take` limits the number of bytes.
        let mut bytes = Vec::with_capacity(length as usize);
        file.take(most + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > most {
            return Err(too_long());
        }
        Ok(bytes)
    }

    fn hash(&self, path: &Path) -> io::Result<blake3::Hash> {
        let file = open_plain(OpenOptions::new().read(true), path)?;
        let mut hasher = blake3::Hasher::new();
        hasher.update_reader(file)?;
        Ok(hasher.finalize())
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        fs::rename(from, to)
    }

    #[cfg(unix)]
    fn sync_dir(&self, path: &Path) -> io::Result<()> {
        File::open(path)?.sync_all()
    }

    // Systems other than Unix have no call that syncs a folder. The operating system decides when the entries of the
    // folder are durable.
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
                    kind: entry.file_type()?.into(),
                })
            })
            .collect::<io::Result<Vec<Entry>>>()?;
        entries.sort();
        Ok(entries)
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        match fs::symlink_metadata(path) {
            Ok(metadata) => Ok(Some(Metadata {
                len: metadata.len(),
                kind: metadata.file_type().into(),
            })),
            Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn free_space(&self, path: &Path) -> io::Result<u64> {
        fs4::available_space(path)
    }

    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt> {
        for _ in 1..TRIES {
            if let Some(attempt) = lock_once(path)? {
                return Ok(attempt);
            }
        }
        // A process that keeps removing the lock file is at work in the folder.
        Ok(lock_once(path)?.unwrap_or(LockAttempt::Held { pid: None }))
    }
}

/// Opens the lock file and tries to lock the file. Returns `None` if another process removed the file before the lock.
/// The lock of a removed file does not exclude other processes.
fn lock_once(path: &Path) -> io::Result<Option<LockAttempt>> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    let mut file = open_plain(&mut options, path)?;
    let opened = file.metadata()?;
    let mut content = Vec::new();
    (&mut file)
        .take(LONGEST_HOLDER + 1)
        .read_to_end(&mut content)?;
    let is_lock = |byte: &u8| byte.is_ascii_digit() || *byte == 0;
    if content.len() as u64 > LONGEST_HOLDER || !content.iter().all(is_lock) {
        let text = "it contains more than a process number, so it is no lock of a run; remove it";
        return Err(io::Error::new(io::ErrorKind::InvalidData, text));
    }
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
            if !is_at(&opened, path)? {
                return Ok(None);
            }
            // A file with several names may belong to someone else. The program locks a file with several names but
            // does not write the process number into the file.
            if names(&opened) == 1 {
                file.set_len(0)?;
                file.rewind()?;
                write!(file, "{}", std::process::id())?;
            }
            Ok(Some(LockAttempt::Taken(Box::new(file))))
        }
        Err(TryLockError::WouldBlock) => {
            file.rewind()?;
            Ok(Some(LockAttempt::Held {
                pid: holder_in(&mut file)?,
            }))
        }
        Err(TryLockError::Error(error)) => Err(error),
    }
}

/// True if the system could not read an existing file. A read failure is not damage, because the failure says nothing
/// about the content of the file.
pub fn is_read_failure(source: &io::Error) -> bool {
    source.raw_os_error().is_some() && source.kind() != io::ErrorKind::NotFound
}
