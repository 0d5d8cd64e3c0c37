//! Error bars: how far a worn state's figures may be from those of exact wear steps and exact contact solves of the same model.
//!
//! The worn volume is in error by what the wear steps estimate of themselves, times a factor of safety, and by the duality gaps
//! of the cycles, which bound what friction dissipates. Every other figure follows the volume: its error is what the last step
//! changed it by, in proportion (a vibration in force: the last update). Where wear dies out the energy of a cycle falls by a large part while little volume is worn, so
//! that a small error of volume is a large one of the energy; the bar says so.

/// Of an error estimated from two results alone, as in [Roache 1994]: what a step does wrong goes on to change the later ones.
/// Measured, true errors are 0.3 to 2.8 times the estimate.
const SAFETY: f64 = 3.0;

/// Part of the volume's relative error that every figure has at least: one that happens not to change in a step is not right for
/// that.
const LEAST: f64 = 0.1;

/// Error of the volume worn in a step of `volume` \[m³\], the step's own estimate being `estimate` \[m³\] and `gap` the largest
/// relative duality gap of its cycle.
pub fn of_step(estimate: f64, volume: f64, gap: f64) -> f64 {
    SAFETY * estimate + gap * volume
}

/// Relative error of a figure that changed from `before` to `after` while `volume` was worn, under an `error` of the volume worn in
/// `all` steps (all three \[m³\]). 0 where nothing wears.
pub fn of_figure([before, after]: [f64; 2], error: f64, volume: f64, all: f64) -> f64 {
    if volume <= 0.0 || all <= 0.0 {
        return 0.0;
    }
    let least = LEAST * error / all;
    let change = ((after - before) / after).abs();
    if change.is_finite() {
        least.max(change * error / volume)
    } else {
        least
    }
}

/// What an explicit step of `cycles` makes wrong, as it takes the rate of its beginning for that of all its length: half the
/// change of the energy per area \[J/m²\] over it, summed over cells of `cell_area` \[m²\]. A volume \[m³\].
pub fn of_constant_rate(
    [begin, end]: [&[f64]; 2],
    coefficient: f64,
    cycles: u64,
    cell_area: f64,
) -> f64 {
    let changes = begin.iter().zip(end).map(|(a, b)| (a - b).abs());
    0.5 * cycles as f64 * coefficient * changes.sum::<f64>() * cell_area
}
