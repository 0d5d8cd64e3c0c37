//! Progress of a long computation, for an observer in another thread. No result of the computation depends on the
//! progress.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Counters of the work of a stage. Clones share the counters.
#[derive(Debug, Clone, Default)]
pub struct Gauge(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    /// Transforms of the contact solvers. Two transforms are a pair.
    transforms: AtomicU64,
    /// Points of a forced response.
    points: AtomicU64,
    /// Bits of the last point's angular frequency \[rad/s\].
    omega: AtomicU64,
    /// Newton iterations of the harmonic balance.
    iterations: AtomicU64,
    /// Highest harmonic order in the Newton iterations of the harmonic balance.
    highest: AtomicU64,
}

impl Gauge {
    /// Resets the counters at the beginning of a stage.
    pub fn begin(&self) {
        let counts = &self.0;
        for count in [
            &counts.transforms,
            &counts.points,
            &counts.iterations,
            &counts.highest,
        ] {
            count.store(0, Ordering::Relaxed);
        }
    }

    /// Counts completed transforms.
    pub fn add_transforms(&self, transforms: usize) {
        self.0
            .transforms
            .fetch_add(transforms as u64, Ordering::Relaxed);
    }

    /// Counts a Newton iteration of the harmonic balance, with harmonics up to `highest`.
    pub fn add_iteration(&self, highest: u32) {
        self.0.highest.fetch_max(highest.into(), Ordering::Relaxed);
        self.0.iterations.fetch_add(1, Ordering::Relaxed);
    }

    /// Counts a computed point of a forced response, at the angular frequency `omega` \[rad/s\].
    pub fn add_point(&self, omega: f64) {
        self.0.omega.store(omega.to_bits(), Ordering::Relaxed);
        self.0.points.fetch_add(1, Ordering::Relaxed);
    }

    /// Returns the number of FFT pairs so far.
    pub fn pairs(&self) -> u64 {
        self.0.transforms.load(Ordering::Relaxed) / 2
    }

    /// Returns the number of points of the forced response so far.
    pub fn points(&self) -> u64 {
        self.0.points.load(Ordering::Relaxed)
    }

    /// Describes the progress of the stage; empty if nothing is counted yet.
    pub fn describe(&self) -> String {
        let load = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let (points, iterations) = (self.points(), load(&self.0.iterations));
        if points > 0 {
            let omega = f64::from_bits(load(&self.0.omega));
            let hertz = omega / std::f64::consts::TAU;
            return format!("point {points}, {hertz:.1} Hz");
        }
        if iterations > 0 {
            let highest = load(&self.0.highest);
            return format!("harmonics up to {highest}, Newton iteration {iterations}");
        }
        match self.pairs() {
            0 => String::new(),
            pairs => format!("{pairs} FFT pairs"),
        }
    }
}
