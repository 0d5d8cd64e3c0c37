//! Results of costly calls, kept in their order as they are made: an interrupted computation that makes the same calls again has them
//! from here, and goes on to the same bits.
//!
//! Nothing is taken that was not made from the same inputs: each result stands beside a hash of them, and the first call that has others
//! ends the reading. Where results are kept, numerics do not know.

use std::collections::VecDeque;
use std::fmt;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// What a sudden end of a run may lose: results are given away together that are made within it.
pub const INTERVAL: Duration = Duration::from_millis(500);
/// Bytes of a hash.
const HASH: usize = 32;
/// Bytes before a result: the hash of its inputs, and its length.
const HEAD: usize = HASH + 8;

/// Takes some results, to keep them; false where that is not possible, after which it is asked no more.
pub type Keep = Box<dyn FnMut(&[u8]) -> bool + Send>;

/// Results of an earlier start, and a place for those of this one. Clones are the same journal; closed, it does nothing.
#[derive(Clone, Default)]
pub struct Journal(Arc<Mutex<Pages>>);

#[derive(Default)]
struct Pages {
    kept: VecDeque<(blake3::Hash, Vec<u8>)>,
    keep: Option<Keep>,
    /// Results that are not given away yet.
    fresh: Vec<u8>,
    interval: Duration,
    since: Option<Instant>,
}

impl fmt::Debug for Journal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Journal")
    }
}

impl Journal {
    /// Opens it with what an earlier start kept, which ends where it makes no sense, and a place for more, to which results go that are
    /// made within an `interval`. How many results there are.
    pub fn open(&self, kept: &[u8], interval: Duration, keep: Keep) -> usize {
        let kept = results(kept);
        let count = kept.len();
        *self.pages() = Pages {
            kept,
            keep: Some(keep),
            fresh: Vec::new(),
            interval,
            since: Some(Instant::now()),
        };
        count
    }

    /// Ends it: what it has is of no more use.
    pub fn close(&self) {
        *self.pages() = Pages::default();
    }

    /// The result of the next call, if it was made from these inputs; else whatever is kept is of another computation.
    pub fn take(&self, inputs: &Inputs) -> Option<Vec<u8>> {
        let mut pages = self.pages();
        let (hash, result) = pages.kept.pop_front()?;
        if hash == inputs.hash() {
            return Some(result);
        }
        // Others follow it on the disk, so that nothing may be put behind them.
        *pages = Pages::default();
        None
    }

    /// Keeps the result of a call.
    pub fn add(&self, inputs: &Inputs, result: &[u8]) {
        let mut pages = self.pages();
        if pages.keep.is_none() {
            return;
        }
        pages.fresh.extend(inputs.hash().as_bytes());
        pages.fresh.extend((result.len() as u64).to_le_bytes());
        pages.fresh.extend(result);
        if pages
            .since
            .is_some_and(|since| since.elapsed() < pages.interval)
        {
            return;
        }
        let fresh = std::mem::take(&mut pages.fresh);
        pages.since = Some(Instant::now());
        let goes_on = pages.keep.as_mut().is_some_and(|keep| keep(&fresh));
        if !goes_on {
            *pages = Pages::default();
        }
    }

    /// Whether results are kept or taken at all: else their inputs need not be hashed.
    pub fn is_open(&self) -> bool {
        self.pages().keep.is_some()
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
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

/// The inputs of a call.
#[derive(Default)]
pub struct Inputs(blake3::Hasher);

impl Inputs {
    /// Adds numbers, to the bit.
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

/// Numbers as bytes.
#[derive(Default)]
pub struct Writer(pub Vec<u8>);

impl Writer {
    /// Adds a count.
    pub fn count(&mut self, value: u64) {
        self.0.extend(value.to_le_bytes());
    }

    /// Adds a number, to the bit.
    pub fn number(&mut self, value: f64) {
        self.count(value.to_bits());
    }

    /// Adds numbers, whose length the reader knows.
    pub fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.number(*value));
    }
}

/// Bytes as numbers: none of what is not there.
pub struct Reader<'a>(pub &'a [u8]);

impl Reader<'_> {
    /// The next count.
    pub fn count(&mut self) -> Option<u64> {
        let (first, rest) = self.0.split_first_chunk::<8>()?;
        self.0 = rest;
        Some(u64::from_le_bytes(*first))
    }

    /// The next number.
    pub fn number(&mut self) -> Option<f64> {
        self.count().map(f64::from_bits)
    }

    /// So many numbers.
    pub fn numbers(&mut self, count: usize) -> Option<Vec<f64>> {
        (0..count).map(|_| self.number()).collect()
    }
}
