//! Output files of commands. Each is written completely or not at all.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
#[cfg(unix)]
use std::os::unix::{fs::FileTypeExt, net::UnixStream};
use std::path::{Path, PathBuf};

use crate::store::{FileSystem, RealFileSystem};

/// Writes a file that the user names. Returns the path of the written file, or `None` for a device, a pipe or a socket.
///
/// A regular file, new or existing, is written by [`replace`]. If the path is a symbolic link, the function keeps the
/// link and writes the target of the link. A device, a pipe or a socket is written directly.
///
/// # Errors
/// Returns errors of the operating system. After an error, a regular file keeps its former content.
pub fn write(path: &Path, bytes: &[u8]) -> io::Result<Option<PathBuf>> {
    // Opening the file for writing changes nothing yet. Opening fails for folders and for write-protected files.
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

/// Writes a file whose name the program chooses: a draft in the same folder, synced, then renamed.
///
/// If a regular file exists, the new file gets the permissions of the existing file. A symbolic link is replaced,
/// because the folder may come from a stranger.
///
/// # Errors
/// Returns errors of the operating system. After an error, the former file still exists.
pub fn replace(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let draft = folder_of(path).join(format!(".{name}.{}.new", std::process::id()));
    // An earlier process with the same id may have left a draft.
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
        // The first error is more informative than an error of the removal.
        drop(fs::remove_file(&draft));
        return Err(error);
    }
    // The file is written. Some file systems cannot sync folders, which is not an error.
    drop(RealFileSystem.sync_dir(folder_of(path)));
    Ok(())
}

#[cfg(unix)]
fn is_socket(path: &Path) -> bool {
    fs::metadata(path).is_ok_and(|metadata| metadata.file_type().is_socket())
}

fn folder_of(path: &Path) -> &Path {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    }
}
