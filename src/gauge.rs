//! How far a long computation is, for who watches it from another thread. Nothing is computed from it.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What a stage has done so far. Clones count together.
#[derive(Debug, Clone, Default)]
pub struct Gauge(Arc<Counts>);

#[derive(Debug, Default)]
struct Counts {
    /// Transforms of the contact solvers: two are a pair.
    transforms: AtomicU64,
    /// Points of a forced response.
    points: AtomicU64,
    /// Bits of the angular frequency of the last one \[rad/s\].
    omega: AtomicU64,
    /// Newton iterations of the harmonic balance.
    iterations: AtomicU64,
    /// The highest of its harmonics.
    highest: AtomicU64,
}

impl Gauge {
    /// A stage begins: nothing is done.
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

    /// Transforms are done.
    pub fn add_transforms(&self, transforms: usize) {
        self.0
            .transforms
            .fetch_add(transforms as u64, Ordering::Relaxed);
    }

    /// A Newton iteration of the harmonic balance with harmonics up to this one begins.
    pub fn add_iteration(&self, highest: u32) {
        self.0.highest.fetch_max(highest.into(), Ordering::Relaxed);
        self.0.iterations.fetch_add(1, Ordering::Relaxed);
    }

    /// A point of a forced response is found, at this angular frequency \[rad/s\].
    pub fn add_point(&self, omega: f64) {
        self.0.omega.store(omega.to_bits(), Ordering::Relaxed);
        self.0.points.fetch_add(1, Ordering::Relaxed);
    }

    /// FFT pairs so far.
    pub fn pairs(&self) -> u64 {
        self.0.transforms.load(Ordering::Relaxed) / 2
    }

    /// Points of the forced response so far.
    pub fn points(&self) -> u64 {
        self.0.points.load(Ordering::Relaxed)
    }

    /// What a stage has done so far, in words; empty where nothing of it is counted yet.
    pub fn words(&self) -> String {
        let of = |count: &AtomicU64| count.load(Ordering::Relaxed);
        let (points, iterations) = (self.points(), of(&self.0.iterations));
        if points > 0 {
            let omega = f64::from_bits(of(&self.0.omega));
            let hertz = omega / std::f64::consts::TAU;
            return format!("point {points}, {hertz:.1} Hz");
        }
        if iterations > 0 {
            let highest = of(&self.0.highest);
            return format!("harmonics up to {highest}, Newton iteration {iterations}");
        }
        match self.pairs() {
            0 => String::new(),
            pairs => format!("{pairs} FFT pairs"),
        }
    }
}
