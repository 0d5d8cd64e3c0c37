//! A storage in memory that can be made to fail.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

use fretwear::published::{Found, ObjectError, Objects, Put, Version};

/// Never reached.
const NEVER: usize = usize::MAX;

pub struct Memory {
    objects: Mutex<BTreeMap<String, (Vec<u8>, u64)>>,
    /// Calls until the connection is gone for good.
    writes_left: AtomicUsize,
    reads_left: AtomicUsize,
    /// False: conditions are passed over, as by storages that do not know them.
    pub heeds: bool,
}

impl Default for Memory {
    fn default() -> Memory {
        Memory {
            objects: Mutex::default(),
            writes_left: AtomicUsize::new(NEVER),
            reads_left: AtomicUsize::new(NEVER),
            heeds: true,
        }
    }
}

impl Memory {
    pub fn all(&self) -> BTreeMap<String, Vec<u8>> {
        let objects = self.objects.lock().unwrap_or_else(PoisonError::into_inner);
        objects
            .iter()
            .map(|(name, (bytes, _))| (name.clone(), bytes.clone()))
            .collect()
    }

    pub fn set(&self, name: &str, bytes: Vec<u8>) {
        let mut objects = self.objects.lock().unwrap_or_else(PoisonError::into_inner);
        let version = objects.get(name).map_or(0, |(_, version)| version + 1);
        objects.insert(name.to_owned(), (bytes, version));
    }

    pub fn remove(&self, name: &str) {
        let mut objects = self.objects.lock().unwrap_or_else(PoisonError::into_inner);
        assert!(objects.remove(name).is_some(), "{name}");
    }

    /// After so many writes nothing is reached any more.
    pub fn dies_after_writes(&self, writes: usize) {
        self.writes_left.store(writes, Ordering::SeqCst);
    }

    pub fn dies_after_reads(&self, reads: usize) {
        self.reads_left.store(reads, Ordering::SeqCst);
    }

    pub fn lives(&self) {
        self.dies_after_writes(NEVER);
        self.dies_after_reads(NEVER);
    }

    fn count(&self, left: &AtomicUsize, name: &str) -> Result<(), ObjectError> {
        let less = |left: usize| match left {
            NEVER => Some(NEVER),
            left => left.checked_sub(1),
        };
        let counted = left.fetch_update(Ordering::SeqCst, Ordering::SeqCst, less);
        counted.map(|_| ()).map_err(|_| {
            self.dies_after_writes(0);
            self.dies_after_reads(0);
            ObjectError {
                action: "reach",
                name: name.to_owned(),
                reason: "the connection is gone".to_owned(),
            }
        })
    }

    fn put(
        &self,
        name: &str,
        bytes: Vec<u8>,
        allowed: impl Fn(Option<u64>) -> bool,
    ) -> Result<Put, ObjectError> {
        self.count(&self.writes_left, name)?;
        let mut objects = self.objects.lock().unwrap_or_else(PoisonError::into_inner);
        let before = objects.get(name).map(|(_, version)| *version);
        if self.heeds && !allowed(before) {
            return Ok(Put::Refused);
        }
        objects.insert(
            name.to_owned(),
            (bytes, before.map_or(0, |version| version + 1)),
        );
        Ok(Put::Done)
    }
}

impl Objects for Memory {
    fn place(&self) -> String {
        "s3://memory/joint".to_owned()
    }

    fn list(&self) -> Result<BTreeSet<String>, ObjectError> {
        self.count(&self.reads_left, "")?;
        Ok(self.all().into_keys().collect())
    }

    fn read(&self, name: &str, most: u64) -> Result<Found, ObjectError> {
        self.count(&self.reads_left, name)?;
        let objects = self.objects.lock().unwrap_or_else(PoisonError::into_inner);
        Ok(match objects.get(name) {
            None => Found::Nothing,
            Some((bytes, _)) if bytes.len() as u64 > most => Found::Longer(bytes.len() as u64),
            Some((bytes, version)) => Found::Object(bytes.clone(), Version(version.to_string())),
        })
    }

    fn create(&self, name: &str, bytes: Vec<u8>) -> Result<Put, ObjectError> {
        self.put(name, bytes, |before| before.is_none())
    }

    fn replace(&self, name: &str, bytes: Vec<u8>, version: &Version) -> Result<Put, ObjectError> {
        self.put(name, bytes, |before| {
            before.is_some_and(|before| before.to_string() == version.0)
        })
    }
}
