//! The bearing-area curve of normally distributed heights: what is in contact of a surface that is cut at a level, and the
//! volume that is gone then, in units of its standard deviation.

use std::f64::consts::{FRAC_1_SQRT_2, PI};

/// Levels between which there is something to cut.
const RANGE: (f64, f64) = (-60.0, 8.0);
const BISECTIONS: usize = 60;

/// The error function, to 1.5e-7 [Abramowitz and Stegun 7.1.26].
pub(super) fn erf(x: f64) -> f64 {
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let polynomial = [
        0.254_829_592,
        -0.284_496_736,
        1.421_413_741,
        -1.453_152_027,
        1.061_405_429,
    ]
    .iter()
    .rev()
    .fold(0.0, |sum, c| (sum + c) * t);
    (1.0 - polynomial * (-x * x).exp()).copysign(x)
}

/// Part of the heights above a level.
fn above(level: f64) -> f64 {
    0.5 * (1.0 - erf(level * FRAC_1_SQRT_2))
}

/// Volume above a level: ∫ (h − t) φ(h) dh = φ(t) − t Q(t).
fn volume(level: f64) -> f64 {
    let density = (-0.5 * level * level).exp() / (2.0 * PI).sqrt();
    density - level * above(level)
}

/// Where a falling function takes a value.
fn falls_to(value: f64, of: fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = RANGE;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if of(middle) > value {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Volume that is gone where this part is in contact.
pub(super) fn volume_at(area: f64) -> f64 {
    volume(falls_to(area.min(0.9999), above))
}

/// Level down to which the surface is gone with this volume.
pub(super) fn level(gone: f64) -> f64 {
    falls_to(gone, volume)
}

/// Part in contact where this volume is gone.
pub(super) fn area(gone: f64) -> f64 {
    above(level(gone))
}
