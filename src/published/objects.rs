//! The calls that publishing makes to a storage of objects.

use std::collections::BTreeSet;

/// What tells one content of an object from the next: its entity tag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Version(pub String);

/// What there is under a name.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Found {
    /// Nothing.
    Nothing,
    /// More bytes than were asked for; nothing has been read.
    Longer(u64),
    /// An object.
    Object(Vec<u8>, Version),
}

/// What came of a conditional put.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Put {
    /// The object is there now.
    Done,
    /// The condition was not met, and nothing was written.
    Refused,
}

/// A storage that failed.
#[derive(Debug, thiserror::Error)]
#[error("cannot {action} {name}: {reason}")]
pub struct ObjectError {
    /// What was asked of it.
    pub action: &'static str,
    /// The object, as a user names it.
    pub name: String,
    /// Its answer, and what may help.
    pub reason: String,
}

/// The objects below one prefix, by their names without it. Calls come from several threads at once.
pub trait Objects: Send + Sync {
    /// The prefix, as a user names it.
    fn place(&self) -> String;
    /// The names of all objects.
    ///
    /// # Errors
    /// Those of the storage; a bucket that there is not is one.
    fn list(&self) -> Result<BTreeSet<String>, ObjectError>;
    /// An object of at most `most` bytes.
    ///
    /// # Errors
    /// Those of the storage.
    fn read(&self, name: &str, most: u64) -> Result<Found, ObjectError>;
    /// Writes an object if there is none of its name: whole or not at all.
    ///
    /// # Errors
    /// Those of the storage.
    fn create(&self, name: &str, bytes: Vec<u8>) -> Result<Put, ObjectError>;
    /// Replaces an object if it is still of that version: whole or not at all.
    ///
    /// # Errors
    /// Those of the storage.
    fn replace(&self, name: &str, bytes: Vec<u8>, version: &Version) -> Result<Put, ObjectError>;
}
