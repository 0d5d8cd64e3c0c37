//! `[fidelity]`

use super::Default::{Absent, ByPreset, Is};
use super::keys;
use super::value::{EvenInteger, Integer, Quantity, TOLERANCE, integer};
use super::word::{Boolean, Choice};
use crate::scene::Preset;
use crate::units::Dimension;
use crate::wear::cycle::March;

/// A cycle finer than this has no meaning that the tolerances would not swallow; a larger number is a slip of the keyboard.
const LARGEST_STEPS: u64 = 65_536;

/// Fewer do not make a loop with an inside; an odd number misses the reversal at half a cycle.
const SMALLEST_STEPS: u64 = 4;

const fn tolerance(example: &'static str) -> Quantity {
    Quantity(Dimension::NONE, TOLERANCE, example)
}

keys! {
    section "fidelity": "Accuracy against cost.";

    /// The set of defaults that all other keys of this section come from.
    PRESET: Choice<Preset> = "fidelity.preset", Is("balanced"), Choice(&[
        ("paper", Preset::Paper, "the published algorithm"),
        ("fast", Preset::Fast, "within 5 % of reference"),
        ("balanced", Preset::Balanced, "within 1 % of reference"),
        ("reference", Preset::Reference, "as exact as is practical"),
    ]);
    /// Relative error of the worn volume that wear steps and solves are chosen for, in place of a preset. What wear makes of it where single cells decide is beyond it, and in the error bar.
    ASKED: Quantity = "fidelity.tolerance", Absent, tolerance("0.01");
    /// How a cycle is marched. Without it the plan decides.
    CYCLE: Choice<March> = "fidelity.cycle", ByPreset(["stepped", "none", "none", "none"]), Choice(&[
        ("superposition", March::Superposition, "a fast approximation of a straight motion, by Ciavarella and Jaeger"),
        ("reversal", March::Reversal, "one exact solve a branch between two load reversals"),
        ("stepped", March::Stepped, "one exact solve a time step"),
    ]);
    // An orbit and a load that varies are solved to within some 1 % of dissipation with 32 steps and 0.3 % with 64, when extrapolated;
    // the published 32 are not.
    /// Time steps of a stepped cycle; of a history twice as many in balanced. A history of fewer rows is stepped between them too, one of more at all of them.
    STEPS_PER_CYCLE: EvenInteger = "fidelity.steps_per_cycle", ByPreset(["32", "32", "64", "128"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "64");
    /// Relative error of a normal contact solve.
    NORMAL_TOLERANCE: Quantity = "fidelity.normal_tolerance", ByPreset(["1e-6", "1e-5", "1e-6", "1e-8"]), tolerance("1e-4");
    /// Relative duality gap of a tangential contact solve.
    TANGENTIAL_TOLERANCE: Quantity = "fidelity.tangential_tolerance", ByPreset(["1e-4", "1e-3", "1e-3", "1e-6"]), tolerance("1e-4");
    /// Relative difference between two cycles, below which the cycle is steady.
    CYCLE_TOLERANCE: Quantity = "fidelity.cycle_tolerance", ByPreset(["1e-3", "1e-2", "1e-3", "1e-5"]), tolerance("1e-4");
    /// Whether a stepped cycle has steps of second order, and is extrapolated from them and half as many.
    CYCLE_EXTRAPOLATION: Boolean = "fidelity.cycle_extrapolation", ByPreset(["false", "true", "true", "true"]), Boolean;
    /// Steps in which the load rises on bodies of different materials with friction, which slip under it.
    // An error of first order: 16 change the approach by 2e-4 of it and the largest pressure by 5e-4, against 64.
    LOAD_STEPS: Integer<usize> = "fidelity.load_steps", ByPreset(["16", "8", "16", "64"]), integer(1, LARGEST_STEPS, "16");
    // The explicit scheme of the paper has no tolerance; the value serves a scene that asks for the implicit one.
    /// Relative error that a wear step may make; the same as wear.tolerance. Where the joint vibrates fast has 0.05 and balanced 0.015: the response is known no better.
    WEAR_TOLERANCE: Quantity = "fidelity.wear_tolerance", ByPreset(["0.01", "0.03", "0.01", "1e-3"]), tolerance("0.01");
    // The friction law is integrated exactly between them, along straight lines: the error of the force falls with the square of
    // their number, and 64 leave less than a thousandth of amplitude.
    /// Samples of a vibration cycle at which the contact elements are evaluated: more than twice the highest harmonic. An oscillator
    /// has eight times the default, many harmonics have more.
    AFT_SAMPLES: EvenInteger = "fidelity.aft_samples", ByPreset(["32", "32", "64", "512"]), EvenInteger(SMALLEST_STEPS, LARGEST_STEPS, "256"), with ["dynamics"];
    /// Whether the response with about twice as many harmonics drives the wear. Else it only says the error.
    HARMONIC_CORRECTION: Boolean = "fidelity.harmonic_correction", ByPreset(["false", "true", "true", "true"]), Boolean, with ["dynamics", "wear"];
    /// Relative error by harmonics left out, up to which they are extended. Where the joint wears fast has 0.05 and balanced 0.015: other parts of its error
    /// bar decide. Not with dynamics.harmonics, which says which there are.
    HARMONIC_TOLERANCE: Quantity = "fidelity.harmonic_tolerance", ByPreset(["none", "0.025", "0.005", "2e-3"]), tolerance("0.005");
    // A fourth of the cells cost about a fourth of the contact.
    /// Whether half of joint.grid is run first, and three times what it changes counts in the error bar. It needs even numbers of cells, 64 or more, and a run that begins with its scene.
    GRID_CHECK: Boolean = "fidelity.grid_check", Is("false"), Boolean, with ["surface", "wear"];
}

/// Steps of a history where they are not those of an orbit: it turns more often.
pub const fn steps_of_history(preset: Preset) -> Option<usize> {
    match preset {
        Preset::Balanced => Some(128),
        Preset::Paper | Preset::Fast | Preset::Reference => None,
    }
}

/// [`HARMONIC_TOLERANCE`] where the joint wears, if it is another one: the parts of its error bar by its cycle and its updates are as large.
pub const fn harmonic_tolerance_with_wear(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}

/// [`WEAR_TOLERANCE`] where the joint vibrates, if it is another one: the response is known to some per cent, and dear at every step.
pub const fn wear_tolerance_with_response(preset: Preset) -> Option<f64> {
    match preset {
        Preset::Fast => Some(0.05),
        Preset::Balanced => Some(0.015),
        Preset::Paper | Preset::Reference => None,
    }
}
