//! `[fidelity]`

use super::Default::{Absent, ByPreset, Is};
use super::keys;
use super::value::{EvenInteger, Integer, Quantity, TOLERANCE, integer};
use super::word::{Boolean, Choice};
use crate::scene::Preset;
use crate::units::Dimension;
use crate::wear::cycle::March;

/// Largest number of steps per cycle. A larger number is probably a typing error: the gain would be below the
/// tolerances.
const LARGEST_STEPS: u64 = 65_536;

/// Smallest number of steps per cycle. Fewer steps do not enclose a hysteresis loop, and an odd number misses the
/// reversal at half a cycle.
const SMALLEST_STEPS: u64 = 4;

const fn tolerance(example: &'static str) -> Quantity {
    Quantity(Dimension::NONE, TOLERANCE, example)
}

keys! {
    section "fidelity": "Accuracy against cost.";

    /// Preset that determines the defaults of all other keys of [fidelity].
    PRESET: Choice<Preset> = "fidelity.preset", Is("balanced"), Choice(&[
        ("paper", Preset::Paper, "the published algorithm"),
        ("fast", Preset::Fast, "about 5 % from reference"),
        ("balanced", Preset::Balanced, "about 1 % from reference"),
        ("reference", Preset::Reference, "as exact as is practical"),
    ]);
    /// Relative error of the worn volume for which wear steps and solves are chosen, in place of a preset. In a joint
    /// where single cells determine the worn volume, wear can amplify errors. fidelity.tolerance does not bound the
    /// amplified errors. The error bar of the worn volume contains the amplified errors.
    ASKED: Quantity = "fidelity.tolerance", Absent, tolerance("0.01");
    /// Method of marching through a cycle. Without fidelity.cycle the plan chooses the method.
    CYCLE: Choice<March> = "fidelity.cycle", ByPreset(["stepped", "none", "none", "none"]), Choice(&[
        ("superposition", March::Superposition, "a fast approximation for a straight motion, by Ciavarella and Jaeger"),
        ("reversal", March::Reversal, "one exact solve per branch between two load reversals"),
        ("stepped", March::Stepped, "one exact solve per time step"),
    ]);
    // For an orbit or a varying load, the error of the dissipation is about 1 % with 32 steps and extrapolation. With
    // 64 steps and extrapolation, the error of the dissipation is about 0.3 %. The published 32 steps without
    // extrapolation are less accurate.
    /// Time steps of a stepped cycle; a history has twice as many steps with preset balanced. If a history has fewer
    /// rows than steps, the program adds steps between the rows. If a history has more rows than steps, the program
    /// takes a step at every row.
    STEPS_PER_CYCLE: EvenInteger = "fidelity.steps_per_cycle", ByPreset(["32", "32", "64", "128"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "64");
    /// Relative tolerance of a normal contact solve.
    NORMAL_TOLERANCE: Quantity = "fidelity.normal_tolerance", ByPreset(["1e-6", "1e-5", "1e-6", "1e-8"]), tolerance("1e-4");
    /// Relative duality gap at which a tangential contact solve ends.
    TANGENTIAL_TOLERANCE: Quantity = "fidelity.tangential_tolerance", ByPreset(["1e-4", "1e-3", "1e-3", "1e-6"]), tolerance("1e-4");
    /// Relative difference between two successive cycles below which the cycle counts as steady.
    CYCLE_TOLERANCE: Quantity = "fidelity.cycle_tolerance", ByPreset(["1e-3", "1e-2", "1e-3", "1e-5"]), tolerance("1e-4");
    /// `fidelity.cycle_extrapolation = true` uses steps of second order and extrapolates a stepped cycle. The
    /// extrapolation needs a second cycle with half as many steps.
    CYCLE_EXTRAPOLATION: Boolean = "fidelity.cycle_extrapolation", ByPreset(["false", "true", "true", "true"]), Boolean;
    /// Number of load steps for bodies of different materials with friction, which slip while the load rises.
    // The error of the load steps is of first order. Against 64 load steps, 16 load steps change the approach by 2e-4
    // and the largest pressure by 5e-4 of their values.
    LOAD_STEPS: Integer<usize> = "fidelity.load_steps", ByPreset(["16", "8", "16", "64"]), integer(1, LARGEST_STEPS, "16");
    // The explicit scheme of the paper has no tolerance. The default of preset paper applies to a scene with the
    // implicit scheme.
    /// Relative error allowed per wear step; the same as wear.tolerance. In a vibrating joint, the default wear
    /// tolerance is 0.05 with preset fast and 0.015 with preset balanced. A smaller wear tolerance does not help in a
    /// vibrating joint, because the error of the response is larger.
    WEAR_TOLERANCE: Quantity = "fidelity.wear_tolerance", ByPreset(["0.01", "0.03", "0.01", "1e-3"]), tolerance("0.01");
    // The friction law is integrated exactly between samples, along straight lines. The error of the force falls with
    // the square of the number of samples. With 64 samples the error of the force is below a thousandth of the
    // amplitude.
    /// Samples per vibration cycle at which the contact elements are evaluated: more than twice the highest harmonic.
    /// The default number of samples is eight times as large for an oscillator, and larger with many harmonics.
    AFT_SAMPLES: EvenInteger = "fidelity.aft_samples", ByPreset(["32", "32", "64", "512"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "256"), with ["dynamics"];
    /// `fidelity.harmonic_correction = true` drives the wear by a response with about twice as many harmonics. With
    /// false, the response with more harmonics only estimates the truncation error.
    HARMONIC_CORRECTION: Boolean = "fidelity.harmonic_correction", ByPreset(["false", "true", "true", "true"]), Boolean, with ["dynamics", "wear"];
    /// Relative truncation error of the harmonics, down to which the solver adds harmonics. In a joint with wear, the
    /// default harmonic tolerance is 0.05 with preset fast and 0.015 with preset balanced. In a joint with wear, the
    /// other parts of the error bar are larger than the truncation error of the harmonics. A scene with a list of
    /// harmonics in dynamics.harmonics has no harmonic tolerance.
    HARMONIC_TOLERANCE: Quantity = "fidelity.harmonic_tolerance", ByPreset(["none", "0.025", "0.005", "2e-3"]), tolerance("0.005");
    // Half the grid has a fourth of the cells, at about a fourth of the cost of the contact.
    /// `fidelity.grid_check = true` first runs the scene on half of joint.grid. Three times the difference of the worn
    /// volumes on both grids counts in the error bar. The grid check requires even numbers of cells, 64 or more, and a
    /// run that begins with its scene.
    GRID_CHECK: Boolean = "fidelity.grid_check", Is("false"), Boolean, with ["surface", "wear"];
}

/// Default steps of a history, if they differ from the steps of an orbit. A history may reverse more often than an
/// orbit.
pub const fn steps_of_history(preset: Preset) -> Option<usize> {
    match preset {
        Preset::Balanced => Some(128),
        Preset::Paper | Preset::Fast | Preset::Reference => None,
    }
}

/// Default of [`HARMONIC_TOLERANCE`] where the joint wears, if wear changes the default. The cycle and the updates
/// contribute errors of the same size.
pub const fn harmonic_tolerance_with_wear(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}

/// Default of [`WEAR_TOLERANCE`] where the joint vibrates, if vibration changes the default. The response is known to a
/// few per cent, and computing the response at every step is expensive.
pub const fn wear_tolerance_with_response(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}
