//! Files that commands write for their user: whole, or not at all.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
#[cfg(unix)]
use std::os::unix::{fs::FileTypeExt, net::UnixStream};
use std::path::{Path, PathBuf};

use crate::store::{FileSystem, RealFileSystem};

/// Writes a file that the user names. A regular file, new or not, is written as by [`replace`]. A link stays, and its target is written. A
/// device, a pipe or a socket is written directly. Returns the regular file, if it is one.
///
/// # Errors
/// Those of the system. A regular file then has its former content.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<Option<PathBuf>> {
    // Opening changes nothing yet. It refuses folders and files that are write-protected.
    let target = match File::options().write(true).open(path) {
        Ok(mut device) if !device.metadata()?.is_file() => {
            device.write_all(bytes)?;
            return Ok(None);
        }
        Ok(_) if path.is_symlink() => fs::canonicalize(path)?,
        Ok(_) => path.to_owned(),
        Err(error) if error.kind() == ErrorKind::NotFound => match fs::read_link(path) {
            Ok(target) => return write(&folder_of(path).join(target), bytes),
            Err(_) => path.to_owned(),
        },
        #[cfg(unix)]
        Err(_) if is_socket(path) => {
            UnixStream::connect(path)?.write_all(bytes)?;
            return Ok(None);
        }
        Err(error) => return Err(error),
    };
    replace(&target, bytes)?;
    Ok(Some(target))
}

/// Writes a file whose name the program chooses: beside it, synced, then renamed. A regular file keeps its permissions. A link is replaced,
/// since the folder may come from a stranger.
///
/// # Errors
/// Those of the system. What was there before is then still there.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let draft = folder_of(path).join(format!(".{name}.{}.new", std::process::id()));
    // A process of the same number may have left one.
    drop(fs::remove_file(&draft));
    let written = File::create_new(&draft).and_then(|mut file| {
        if let Ok(former) = fs::symlink_metadata(path)
            && former.is_file()
        {
            file.set_permissions(former.permissions())?;
        }
        file.write_all(bytes)?;
        file.sync_all()
    });
    if let Err(error) = written.and_then(|()| fs::rename(&draft, path)) {
        // The first error says more than one of the removal.
        drop(fs::remove_file(&draft));
        return Err(error);
    }
    // The file is there. A file system that cannot sync folders is no failure.
    drop(RealFileSystem.sync_dir(folder_of(path)));
    Ok(())
}

#[cfg(unix)]
fn is_socket(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|found| found.file_type().is_socket())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
