//! The published wear step: explicit, with the cycles that wear a given depth [A eq. 2.7–2.8].

/// N = floor(Δh_max / max Δh), at least one cycle [A eq. 2.7]. `deepest` is the largest wear depth of one cycle \[m\].
pub fn cycles(depth_step: f64, deepest: f64) -> u64 {
    // The conversion saturates, so that a joint that hardly wears makes one very long step.
    ((depth_step / deepest).floor() as u64).max(1)
}

/// h ← h + N Δh [A eq. 2.8], with Δh = α · `energy`, written for the wear depth \[m\].
pub fn advance(wear: &[f64], energy: &[f64], coefficient: f64, cycles: u64) -> Vec<f64> {
    wear.iter()
        .zip(energy)
        .map(|(w, e)| w + cycles as f64 * coefficient * e)
        .collect()
}
