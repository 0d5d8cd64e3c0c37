//! Preload of a bolted joint as its faces wear.
//!
//! ```
//! use fretwear::model_update::{Bolt, BoltContact, ModelUpdateError, preload};
//!
//! // A face wears by 1 µm under a bolt of 50 N/µm, on a contact of 200 N/µm.
//! let bolt = Bolt { stiffness: 50e6, load: 1000.0, approach: 5e-6 };
//! let worn = |load: f64| {
//!     Ok::<_, ModelUpdateError>(BoltContact { approach: 6e-6 + (load - 1000.0) / 200e6, kn: 200e6 })
//! };
//! let found = preload(bolt, None, worn)?;
//! // Both springs act in series: 1 / (1/50 + 1/200) N/µm.
//! assert!((found.load - (1000.0 - 40e6 * 1e-6)).abs() < 1e-3);
//! # Ok::<(), ModelUpdateError>(())
//! ```

use super::ModelUpdateError;

/// Error of the preload, relative to the unworn preload, at which the search ends. Contact solutions have the same
/// error.
pub const PRELOAD_TOLERANCE: f64 = 1e-6;

/// Bound on contact solutions. Newton steps need a handful; bisection alone reaches [`PRELOAD_TOLERANCE`] in 20.
const MOST_CALLS: usize = 40;

/// Bolt that clamps the joint, in the unworn state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bolt {
    /// Stiffness k_b of the bolt and of everything clamped with it, between the two faces and outside the fine contact
    /// \[N/m\].
    pub stiffness: f64,
    /// Preload N₀ of the unworn joint \[N\].
    pub load: f64,
    /// Approach δ₀ of the unworn faces under the preload N₀ \[m\].
    pub approach: f64,
}

/// Contact solution at one load of the bolt.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BoltContact {
    /// Approach δ under the load \[m\]; without load, the approach at first touch.
    pub approach: f64,
    /// Slope dN/dδ of the contact at the load N \[N/m\]. The slope only steers the search for the load. A slope of 0,
    /// for an unknown slope, costs contact solutions but no accuracy.
    pub kn: f64,
}

/// Preload, and the effort of the search.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Preload {
    /// Preload N \[N\], the load of the last contact solution.
    pub load: f64,
    /// Approach δ(N) \[m\].
    pub approach: f64,
    /// Size of the next correction, which was not applied \[N\].
    pub error: f64,
    /// Number of contact solutions.
    pub calls: usize,
}

/// Finds the preload N of the worn joint: N = N₀ − k_b (δ(N) − δ₀), to [`PRELOAD_TOLERANCE`] of N₀.
///
/// `worn` solves the contact of the worn faces under a load. The first call of `worn` has the load `start`, which is an
/// earlier preload or N₀. δ grows with N, so the equation has at most one solution N. The search for N takes Newton
/// steps with f′ = 1 + k_b/kn. The search brackets N: each step stays between a load that is too small and a load that
/// is too large.
///
/// # Errors
/// Returns [`ModelUpdateError::Loose`] if the bolt has lost all preload. Returns [`ModelUpdateError::NotConverged`] if
/// the search fails, and [`ModelUpdateError::OutOfRange`] for an invalid bolt. Returns the errors of `worn` unchanged.
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
    // Whether the joint is loose matters only if the search approaches zero load.
    let mut is_tight = false;
    let mut load = start
        .filter(|s| *s > 0.0 && s.is_finite())
        .unwrap_or(bolt.load);
    let mut error = f64::INFINITY;
    let mut calls = 0;
    while calls < MOST_CALLS {
        let contact = worn(load)?;
        calls += 1;
        let excess_load = excess(load, contact.approach);
        if !excess_load.is_finite() {
            return Err(ModelUpdateError::OutOfRange {
                name: "the approach of the worn contact",
                value: contact.approach,
                expected: "finite",
            }
            .into());
        }
        let compliance_ratio = if bolt.stiffness > 0.0 {
            bolt.stiffness / contact.kn
        } else {
            0.0
        };
        let correction = excess_load / (1.0 + compliance_ratio);
        // The bracket bounds the error without a slope.
        let (below, above) = if excess_load > 0.0 {
            (low, load)
        } else {
            (load, high)
        };
        // Without a slope the excess bounds the error, as f′ ≥ 1.
        error = if compliance_ratio.is_finite() {
            correction.abs()
        } else {
            excess_load.abs()
        };
        error = error.min(above - below);
        if error <= tolerance {
            return Ok(Preload {
                load,
                approach: contact.approach,
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
        if low == 0.0 && !is_tight {
            let first_touch = worn(0.0)?;
            calls += 1;
            if excess(0.0, first_touch.approach) >= 0.0 {
                return Err(ModelUpdateError::Loose {
                    load: bolt.load,
                    bolt_stiffness: bolt.stiffness,
                    settlement: first_touch.approach - bolt.approach,
                    stretch: bolt.load / bolt.stiffness,
                }
                .into());
            }
            is_tight = true;
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
