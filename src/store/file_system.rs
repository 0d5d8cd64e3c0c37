//! The calls that the run store makes to the file system.

use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, Write};
use std::path::Path;
use std::thread::sleep;
use std::time::Duration;

/// What stands at a path: itself, not what a link leads to.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum EntryKind {
    /// A file that holds bytes.
    File,
    /// A folder.
    Folder,
    /// A symbolic link, whatever it leads to.
    Link,
    /// A pipe, a socket or a device.
    Other,
}

impl From<fs::FileType> for EntryKind {
    fn from(found: fs::FileType) -> Self {
        if found.is_symlink() {
            EntryKind::Link
        } else if found.is_dir() {
            EntryKind::Folder
        } else if found.is_file() {
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
    /// What it is.
    pub kind: EntryKind,
}

/// What the store asks of a path that exists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Metadata {
    /// Length in bytes.
    pub len: u64,
    /// What it is.
    pub kind: EntryKind,
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
    /// The content of a file of at most `most` bytes; a longer one, a link and what is no file are refused before anything is read.
    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>>;
    /// The blake3 hash of a file's content, in the memory of one block; a link and what is no file are refused.
    fn hash(&self, path: &Path) -> io::Result<blake3::Hash>;
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
    /// What there is at a path, `None` if nothing. A link is a link, and not what it leads to.
    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>>;
    /// Bytes that this user may still write where the path is.
    fn free_space(&self, path: &Path) -> io::Result<u64>;
    /// Takes the exclusive lock of a file, created if need be, without waiting.
    fn try_lock(&self, path: &Path) -> io::Result<LockAttempt>;

    /// Replaces a file, or a link, in one step: writes and syncs `draft`, then renames it. After an error the former file is still there. The
    /// caller syncs the folder.
    fn replace(&self, draft: &Path, path: &Path, bytes: &[u8]) -> io::Result<()> {
        // A process that was killed may have left one.
        if self.metadata(draft)?.is_some() {
            self.remove_file(draft)?;
        }
        let written = self
            .write_new(draft, bytes)
            .and_then(|()| self.sync_file(draft))
            .and_then(|()| self.rename(draft, path));
        if written.is_err() {
            // The first error says more than one of the removal.
            drop(self.remove_file(draft));
        }
        written
    }
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

/// A lock file holds the number of a process, or as many zero bytes after a power cut, since it is not synced.
const LONGEST_HOLDER: u64 = 20;

impl RealFileSystem {
    /// Who holds the lock of a file, without changing anything; `None` if nobody does.
    ///
    /// # Errors
    /// Those of the system, but for a file that is not there.
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

/// Whether a file is still the one of a path.
#[cfg(unix)]
fn is_at(found: &fs::Metadata, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    match fs::symlink_metadata(path) {
        Ok(now) => Ok((now.dev(), now.ino()) == (found.dev(), found.ino())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(false),
        Err(error) => Err(error),
    }
}

/// An open file cannot be removed there.
#[cfg(not(unix))]
fn is_at(_found: &fs::Metadata, _path: &Path) -> io::Result<bool> {
    Ok(true)
}

/// Names that a file has, all but one of them hard links.
#[cfg(unix)]
fn names(found: &fs::Metadata) -> u64 {
    std::os::unix::fs::MetadataExt::nlink(found)
}

#[cfg(not(unix))]
fn names(_found: &fs::Metadata) -> u64 {
    1
}

/// Opens a file that holds bytes. Neither a link at the path nor a pipe, which would keep the opening waiting, is followed.
fn open_plain(options: &mut OpenOptions, path: &Path) -> io::Result<File> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::OpenOptionsExt;
        options.custom_flags(libc::O_NOFOLLOW | libc::O_NONBLOCK);
    }
    // What the flags refuse has an error of the system that says little of it.
    let refuse = |kind| {
        let what = match kind {
            EntryKind::File => return Ok(()),
            EntryKind::Folder => "it is a folder, not a file",
            EntryKind::Link => "it is a link, and none is followed",
            EntryKind::Other => "it is a pipe, a socket or a device, not a file",
        };
        Err(io::Error::new(io::ErrorKind::InvalidInput, what))
    };
    if let Ok(found) = fs::symlink_metadata(path) {
        refuse(found.file_type().into())?;
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
        // Some systems want the right to write for it.
        OpenOptions::new().write(true).open(path)?.sync_all()
    }

    fn read(&self, path: &Path, most: u64) -> io::Result<Vec<u8>> {
        let file = open_plain(OpenOptions::new().read(true), path)?;
        let length = file.metadata()?.len();
        let too_long = || {
            let text = format!("it is longer than {most} bytes, the most that is read of it");
            io::Error::new(io::ErrorKind::FileTooLarge, text)
        };
        if length > most {
            return Err(too_long());
        }
        // It may grow meanwhile.
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
                    kind: entry.file_type()?.into(),
                })
            })
            .collect::<io::Result<Vec<Entry>>>()?;
        entries.sort();
        Ok(entries)
    }

    fn metadata(&self, path: &Path) -> io::Result<Option<Metadata>> {
        match fs::symlink_metadata(path) {
            Ok(found) => Ok(Some(Metadata {
                len: found.len(),
                kind: found.file_type().into(),
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
        // Whoever removes it again and again is at work.
        Ok(lock_once(path)?.unwrap_or(LockAttempt::Held { pid: None }))
    }
}

/// One attempt; none where the file was removed before it was locked, so that the lock keeps nobody out.
fn lock_once(path: &Path) -> io::Result<Option<LockAttempt>> {
    let mut options = OpenOptions::new();
    options.read(true).write(true).create(true).truncate(false);
    let mut file = open_plain(&mut options, path)?;
    let found = file.metadata()?;
    let mut content = Vec::new();
    (&mut file)
        .take(LONGEST_HOLDER + 1)
        .read_to_end(&mut content)?;
    let is_lock = |byte: &u8| byte.is_ascii_digit() || *byte == 0;
    if content.len() as u64 > LONGEST_HOLDER || !content.iter().all(is_lock) {
        let text =
            "it holds more than the number of a process, so that it is no lock of a run; remove it";
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
            if !is_at(&found, path)? {
                return Ok(None);
            }
            // Under another name the file may be somebody else's: it locks as well, and only does not tell by whom.
            if names(&found) == 1 {
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

/// True where the system could not read a file that is there. That says nothing of its content, so it is not damage.
pub fn is_unread(source: &io::Error) -> bool {
    source.raw_os_error().is_some() && source.kind() != io::ErrorKind::NotFound
}
