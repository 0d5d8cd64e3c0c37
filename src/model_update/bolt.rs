//! Preload of a bolted joint as its faces wear.
//!
//! ```
//! use fretwear::model_update::{Bolt, BoltContact, ModelUpdateError, preload};
//!
//! // A face that wears by 1 µm under a bolt of 50 N/µm, on a contact of 200 N/µm.
//! let bolt = Bolt { stiffness: 50e6, load: 1000.0, approach: 5e-6 };
//! let worn = |load: f64| {
//!     Ok::<_, ModelUpdateError>(BoltContact { approach: 6e-6 + (load - 1000.0) / 200e6, kn: 200e6 })
//! };
//! let found = preload(bolt, None, worn)?;
//! // The springs in series: 1 / (1/50 + 1/200) N/µm.
//! assert!((found.load - (1000.0 - 40e6 * 1e-6)).abs() < 1e-3);
//! # Ok::<(), ModelUpdateError>(())
//! ```

use super::ModelUpdateError;

/// Error of the preload in parts of the unworn one, at which the search ends: that of the contact solutions it is made of.
pub const PRELOAD_TOLERANCE: f64 = 1e-6;

/// Contact solutions spent at most: Newton steps take a handful, and halving alone gets to [`PRELOAD_TOLERANCE`] in 20.
const MOST_CALLS: usize = 40;

/// What clamps the joint, at its unworn state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bolt {
    /// Stiffness k_b between the two faces of the bolt and of all that is clamped with it, outside the fine contact \[N/m\].
    pub stiffness: f64,
    /// Preload N₀ of the unworn joint \[N\].
    pub load: f64,
    /// Approach δ₀ of the unworn faces under it \[m\].
    pub approach: f64,
}

/// A contact solution as the bolt sees it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoltContact {
    /// Approach δ under the load \[m\]; at no load, that of the first touch.
    pub approach: f64,
    /// dN/dδ there \[N/m\]; steers the search only, so that 0 where it is not known costs contact solutions and no accuracy.
    pub kn: f64,
}

/// A preload, and how it was found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preload {
    /// Preload N \[N\]: the load of the last contact solution asked for.
    pub load: f64,
    /// Approach δ(N) \[m\].
    pub approach: f64,
    /// Size of the correction that was left \[N\].
    pub error: f64,
    /// Contact solutions.
    pub calls: usize,
}

/// Preload N of the worn joint: N = N₀ − k_b (δ(N) − δ₀), to [`PRELOAD_TOLERANCE`] of N₀.
///
/// `worn` solves the contact of the worn faces under a load; it is called with N₀ (or `start`, a preload found before) first.
/// δ grows with N, so that there is one N at most. Newton's steps with f′ = 1 + k_b/kn, kept between loads known to be too small
/// and too large.
///
/// # Errors
/// [`ModelUpdateError::Loose`] if none is left, [`ModelUpdateError::NotConverged`], a bolt that is none, and those of `worn`.
pub fn preload<E: From<ModelUpdateError>>(
    bolt: Bolt,
    start: Option<f64>,
    mut worn: impl FnMut(f64) -> Result<BoltContact, E>,
) -> Result<Preload, E> {
    check(bolt)?;
    let tolerance = PRELOAD_TOLERANCE * bolt.load;
    let excess =
        |load: f64, approach: f64| load - bolt.load + bolt.stiffness * (approach - bolt.approach);
    let (mut low, mut high) = (0.0, f64::INFINITY);
    // Whether the joint is loose is asked only when the search comes to that end.
    let mut held = false;
    let mut load = start
        .filter(|s| *s > 0.0 && s.is_finite())
        .unwrap_or(bolt.load);
    let mut error = f64::INFINITY;
    let mut calls = 0;
    while calls < MOST_CALLS {
        let found = worn(load)?;
        calls += 1;
        let too_much = excess(load, found.approach);
        if !too_much.is_finite() {
            return Err(ModelUpdateError::OutOfRange {
                name: "the approach of the worn contact",
                value: found.approach,
                expected: "finite",
            }
            .into());
        }
        let give = if bolt.stiffness > 0.0 {
            bolt.stiffness / found.kn
        } else {
            0.0
        };
        let correction = too_much / (1.0 + give);
        // A bracket is a bound on the error that needs no slope.
        let (below, above) = if too_much > 0.0 {
            (low, load)
        } else {
            (load, high)
        };
        // Without a slope the excess is a bound on the error, as f′ ≥ 1.
        error = if give.is_finite() {
            correction.abs()
        } else {
            too_much.abs()
        };
        error = error.min(above - below);
        if error <= tolerance {
            return Ok(Preload {
                load,
                approach: found.approach,
                error,
                calls,
            });
        }
        (low, high) = (below, above);
        let next = load - correction;
        if next > low && next < high && correction != 0.0 {
            load = next;
            continue;
        }
        if low == 0.0 && !held {
            let touch = worn(0.0)?;
            calls += 1;
            if excess(0.0, touch.approach) >= 0.0 {
                return Err(ModelUpdateError::Loose {
                    load: bolt.load,
                    bolt_stiffness: bolt.stiffness,
                    settlement: touch.approach - bolt.approach,
                    stretch: bolt.load / bolt.stiffness,
                }
                .into());
            }
            held = true;
        }
        load = if high.is_finite() {
            0.5 * (low + high)
        } else {
            2.0 * load
        };
    }
    Err(ModelUpdateError::NotConverged {
        load,
        error,
        tolerance,
        calls,
    }
    .into())
}

fn check(bolt: Bolt) -> Result<(), ModelUpdateError> {
    let out_of_range = |name, value, expected| {
        Err(ModelUpdateError::OutOfRange {
            name,
            value,
            expected,
        })
    };
    if !(bolt.stiffness >= 0.0 && bolt.stiffness.is_finite()) {
        return out_of_range(
            "contact.bolt_stiffness",
            bolt.stiffness,
            "a finite number of N/m, 0 or more",
        );
    }
    if !(bolt.load > 0.0 && bolt.load.is_finite()) {
        return out_of_range("contact.normal_load", bolt.load, "positive and finite");
    }
    if !bolt.approach.is_finite() {
        return out_of_range("the unworn approach", bolt.approach, "finite");
    }
    Ok(())
}
