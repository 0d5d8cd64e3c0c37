//! `[fidelity]`

use super::Default::{Absent, ByPreset, Is};
use super::keys;
use super::value::{EvenInteger, Integer, Quantity, TOLERANCE, integer};
use super::word::{Boolean, Choice};
use crate::scene::Preset;
use crate::units::Dimension;
use crate::wear::cycle::March;

/// Most steps per cycle. A larger number is probably a typing error: the gain would be below the tolerances.
const LARGEST_STEPS: u64 = 65_536;

/// Fewest steps per cycle. Fewer steps do not enclose a loop, and an odd number misses the reversal at half a cycle.
const SMALLEST_STEPS: u64 = 4;

const fn tolerance(example: &'static str) -> Quantity {
    Quantity(Dimension::NONE, TOLERANCE, example)
}

keys! {
    section "fidelity": "Accuracy against cost.";

    /// Preset from which all other keys of this section take their defaults.
    PRESET: Choice<Preset> = "fidelity.preset", Is("balanced"), Choice(&[
        ("paper", Preset::Paper, "the published algorithm"),
        ("fast", Preset::Fast, "within 5 % of reference"),
        ("balanced", Preset::Balanced, "within 1 % of reference"),
        ("reference", Preset::Reference, "as exact as is practical"),
    ]);
    /// Relative error of the worn volume for which wear steps and solves are chosen, in place of a preset. The error
    /// bar also contains a part that the tolerance does not bound: wear may amplify errors where single cells decide.
    ASKED: Quantity = "fidelity.tolerance", Absent, tolerance("0.01");
    /// How a cycle is marched. Without this key the plan decides.
    CYCLE: Choice<March> = "fidelity.cycle", ByPreset(["stepped", "none", "none", "none"]), Choice(&[
        ("superposition", March::Superposition, "a fast approximation for a straight motion, by Ciavarella and Jaeger"),
        ("reversal", March::Reversal, "one exact solve per branch between two load reversals"),
        ("stepped", March::Stepped, "one exact solve per time step"),
    ]);
    // With extrapolation, an orbit and a varying load are solved to about 1 % of the dissipation with 32 steps and 0.3
    // % with 64. The published 32 steps without extrapolation are less accurate.
    /// Time steps of a stepped cycle; a history has twice as many with preset balanced. A history with fewer rows is
    /// also stepped between its rows; one with more rows is stepped at all of them.
    STEPS_PER_CYCLE: EvenInteger = "fidelity.steps_per_cycle", ByPreset(["32", "32", "64", "128"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "64");
    /// Relative tolerance of a normal contact solve.
    NORMAL_TOLERANCE: Quantity = "fidelity.normal_tolerance", ByPreset(["1e-6", "1e-5", "1e-6", "1e-8"]), tolerance("1e-4");
    /// Relative duality gap at which a tangential contact solve ends.
    TANGENTIAL_TOLERANCE: Quantity = "fidelity.tangential_tolerance", ByPreset(["1e-4", "1e-3", "1e-3", "1e-6"]), tolerance("1e-4");
    /// Relative difference between two successive cycles below which the cycle counts as steady.
    CYCLE_TOLERANCE: Quantity = "fidelity.cycle_tolerance", ByPreset(["1e-3", "1e-2", "1e-3", "1e-5"]), tolerance("1e-4");
    /// Whether a stepped cycle uses steps of second order and is extrapolated. A second cycle has half as many steps.
    CYCLE_EXTRAPOLATION: Boolean = "fidelity.cycle_extrapolation", ByPreset(["false", "true", "true", "true"]), Boolean;
    /// Number of load steps for bodies of different materials with friction, which slip while the load rises.
    // The error is of first order. Against 64 load steps, 16 change the approach by 2e-4 and the largest pressure by
    // 5e-4 of their values.
    LOAD_STEPS: Integer<usize> = "fidelity.load_steps", ByPreset(["16", "8", "16", "64"]), integer(1, LARGEST_STEPS, "16");
    // The explicit scheme of the paper has no tolerance. The value applies to a scene with preset paper and the
    // implicit scheme.
    /// Relative error allowed per wear step; the same as wear.tolerance. Where the joint vibrates, the default is 0.05
    /// with fast and 0.015 with balanced, because the response is not known more accurately.
    WEAR_TOLERANCE: Quantity = "fidelity.wear_tolerance", ByPreset(["0.01", "0.03", "0.01", "1e-3"]), tolerance("0.01");
    // The friction law is integrated exactly between samples, along straight lines. The error of the force falls with
    // the square of the number of samples. With 64 samples it is below a thousandth of the amplitude.
    /// Samples per vibration cycle at which the contact elements are evaluated: more than twice the highest harmonic.
    /// The default is eight times as large for an oscillator, and larger with many harmonics.
    AFT_SAMPLES: EvenInteger = "fidelity.aft_samples", ByPreset(["32", "32", "64", "512"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "256"), with ["dynamics"];
    /// Whether the response with about twice as many harmonics drives the wear. Otherwise it only estimates the error.
    HARMONIC_CORRECTION: Boolean = "fidelity.harmonic_correction", ByPreset(["false", "true", "true", "true"]), Boolean, with ["dynamics", "wear"];
    /// Relative error by truncating the harmonics, up to which harmonics are added. Where the joint wears, the default
    /// is 0.05 with fast and 0.015 with balanced, because other parts of the error bar dominate. Not with
    /// dynamics.harmonics, which lists the harmonics.
    HARMONIC_TOLERANCE: Quantity = "fidelity.harmonic_tolerance", ByPreset(["none", "0.025", "0.005", "2e-3"]), tolerance("0.005");
    // Half the grid has a fourth of the cells, at about a fourth of the cost of the contact.
    /// Whether the scene is first run on half of joint.grid. Three times the difference counts in the error bar.
    /// Requires even numbers of cells, 64 or more, and a run that begins with its scene.
    GRID_CHECK: Boolean = "fidelity.grid_check", Is("false"), Boolean, with ["surface", "wear"];
}

/// Steps of a history, if they differ from those of an orbit. A history may reverse more often.
pub const fn steps_of_history(preset: Preset) -> Option<usize> {
    match preset {
        Preset::Balanced => Some(128),
        Preset::Paper | Preset::Fast | Preset::Reference => None,
    }
}

/// [`HARMONIC_TOLERANCE`] where the joint wears, if it differs. The cycle and the updates contribute errors of the same
/// size.
pub const fn harmonic_tolerance_with_wear(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}

/// [`WEAR_TOLERANCE`] where the joint vibrates, if it differs. The response is known to a few per cent, and computing
/// it at every step is expensive.
pub const fn wear_tolerance_with_response(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}
