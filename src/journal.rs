//! Journal of the results of costly calls, in the order of the calls. An interrupted computation that repeats
//! the same calls reads the results from the journal, and continues bit by bit the same.
//!
//! A result is only reused for equal inputs. Each result is stored with a hash of its inputs, and the journal stops
//! reading at the first call with other inputs. The numerics do not know where results are stored.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Interval within which the journal collects results before it stores them together. A sudden end of a run may lose
/// the results of one interval.
pub const INTERVAL: Duration = Duration::from_millis(500);
/// Bytes of a hash.
const HASH: usize = 32;
/// Bytes before a result: the hash of its inputs, and the length of the result.
const HEAD: usize = HASH + 8;

/// Function that stores some results of the journal. The function returns false if it cannot store the results. After
/// the function returns false, the journal does not call the function again.
pub type Keep = Box<dyn FnMut(&[u8]) -> bool + Send>;

/// Store for the results of a run. A restart reads the results of the earlier start and adds new results. Clones share
/// the journal. A closed journal does nothing.
#[derive(Clone, Default)]
pub struct Journal(Arc<Mutex<JournalContent>>);

#[derive(Default)]
struct JournalContent {
    kept: VecDeque<(blake3::Hash, Vec<u8>)>,
    keep: Option<Keep>,
    /// Results that are not yet stored.
    unstored: Vec<u8>,
    interval: Duration,
    since: Option<Instant>,
}

impl fmt::Debug for Journal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Journal")
    }
}

impl Journal {
    /// Opens the journal. `kept` contains the bytes that an earlier start of the run stored. The function `keep` stores
    /// the results of the present start of the run. Reading stops at the first invalid bytes. Results within an
    /// `interval` are stored together. Returns the number of results in `kept`.
    pub fn open(&self, kept: &[u8], interval: Duration, keep: Keep) -> usize {
        let kept = results(kept);
        let count = kept.len();
        *self.pages() = JournalContent {
            kept,
            keep: Some(keep),
            unstored: Vec::new(),
            interval,
            since: Some(Instant::now()),
        };
        count
    }

    /// Closes the journal and drops the content of the journal.
    pub fn close(&self) {
        *self.pages() = JournalContent::default();
    }

    /// Returns the next stored result if an earlier start of the run computed the result from the same `inputs`. If the
    /// inputs differ, the stored results belong to another computation, and `reuse` closes the journal.
    pub fn reuse(&self, inputs: &Inputs) -> Option<Vec<u8>> {
        let mut pages = self.pages();
        let (hash, result) = pages.kept.pop_front()?;
        if hash == inputs.hash() {
            return Some(result);
        }
        // Further results follow the rejected result on the disk, so the journal must not append new results.
        *pages = JournalContent::default();
        None
    }

    /// Stores the result of a call.
    pub fn add(&self, inputs: &Inputs, result: &[u8]) {
        let mut pages = self.pages();
        if pages.keep.is_none() {
            return;
        }
        pages.unstored.extend(inputs.hash().as_bytes());
        pages.unstored.extend((result.len() as u64).to_le_bytes());
        pages.unstored.extend(result);
        if pages
            .since
            .is_some_and(|since| since.elapsed() < pages.interval)
        {
            return;
        }
        let unstored = std::mem::take(&mut pages.unstored);
        pages.since = Some(Instant::now());
        let is_stored = pages.keep.as_mut().is_some_and(|keep| keep(&unstored));
        if !is_stored {
            *pages = JournalContent::default();
        }
    }

    /// Returns true if the journal stores or reuses results. If the journal is closed, callers need not hash their
    /// inputs.
    pub fn is_open(&self) -> bool {
        self.pages().keep.is_some()
    }

    fn pages(&self) -> MutexGuard<'_, JournalContent> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn results(mut bytes: &[u8]) -> VecDeque<(blake3::Hash, Vec<u8>)> {
    let mut out = VecDeque::new();
    while let Some((head, rest)) = bytes.split_at_checked(HEAD) {
        let (hash, length) = head.split_at(HASH);
        let Ok(hash) = <[u8; HASH]>::try_from(hash) else {
            break;
        };
        let length = length
            .iter()
            .rev()
            .fold(0_u64, |n, b| n << 8 | u64::from(*b));
        let length = usize::try_from(length).unwrap_or(usize::MAX);
        let Some((result, rest)) = rest.split_at_checked(length) else {
            break;
        };
        out.push_back((hash.into(), result.to_vec()));
        bytes = rest;
    }
    out
}

/// Inputs of a call, as a hash.
#[derive(Default)]
pub struct Inputs(blake3::Hasher);

impl Inputs {
    /// Adds numbers, bit by bit.
    pub fn numbers<'a>(mut self, values: impl IntoIterator<Item = &'a f64>) -> Inputs {
        for value in values {
            self.0.update(&value.to_bits().to_le_bytes());
        }
        self
    }

    /// Adds flags.
    pub fn flags(mut self, values: &[bool]) -> Inputs {
        for value in values {
            self.0.update(&[u8::from(*value)]);
        }
        self
    }

    fn hash(&self) -> blake3::Hash {
        self.0.finalize()
    }
}

/// Writer of numbers as bytes.
#[derive(Default)]
pub struct Writer(pub Vec<u8>);

impl Writer {
    /// Adds a count.
    pub fn count(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    /// Adds a number, bit by bit.
    pub fn number(&mut self, value: f64) {
        self.count(value.to_bits());
    }

    /// Adds numbers. The reader must know how many there are.
    pub fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.number(*value));
    }
}

/// Reader of numbers from bytes. The reader returns `None` at the end of the bytes.
pub struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    /// Returns the next count.
    pub fn count(&mut self) -> Option<u64> {
        let (first, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*first))
    }

    /// Returns the next number.
    pub fn number(&mut self) -> Option<f64> {
        self.count().map(f64::from_bits)
    }

    /// Returns the next `count` numbers.
    pub fn numbers(&mut self, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.number()).collect()
    }
}
