//! What a run is expected to take on a machine whose speed is known. No result and no plan depends on it.

use super::Cost;

/// How fast a machine is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rates {
    /// A pair of transforms on the scene's plane, by itself \[s\].
    pub pair: f64,
    /// An operation of a product of dense matrices \[s\].
    pub operation: f64,
}

/// Seconds that a run is expected to take.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Seconds {
    /// Reducing the structure; nothing if it is found in the cache.
    pub structure: f64,
    /// Contact, cycles and wear.
    pub contact: f64,
    /// Vibrations.
    pub response: f64,
    /// Writing and committing iterations.
    pub writing: f64,
}

/// A pair within a solve over one by itself: the loops around it, and fields that have left the cache meanwhile.
const IN_A_SOLVE: f64 = 1.6;
/// Kernels, and a surface, of a point of the plane that is transformed on \[s\].
const POINT: f64 = 4e-7;
/// An iteration beside its pairs, by the cells that its stages pass over \[s\].
const CELL: f64 = 2e-7;
/// Files of an iteration, each written and synchronised, and a byte of them \[s\].
const COMMIT: f64 = 0.015;
const BYTE: f64 = 8e-9;

impl Cost {
    /// Seconds on a machine, one thread.
    pub fn seconds(&self, rates: Rates) -> Seconds {
        let states = 1.0 + self.iterations;
        Seconds {
            structure: self.structure_operations * rates.operation,
            contact: IN_A_SOLVE * self.fft_pairs * rates.pair
                + POINT * (self.plane[0] * self.plane[1]) as f64
                + CELL * states * self.cells as f64,
            response: self.response_operations * rates.operation,
            writing: COMMIT * states + BYTE * self.disk as f64,
        }
    }
}

impl Seconds {
    /// All of it.
    pub fn total(&self) -> f64 {
        self.structure + self.contact + self.response + self.writing
    }

    /// What the stages compute: without writing, and without the structure where it was found in the cache.
    pub fn computing(&self, reduced: bool) -> f64 {
        let structure = if reduced { self.structure } else { 0.0 };
        structure + self.contact + self.response
    }
}
