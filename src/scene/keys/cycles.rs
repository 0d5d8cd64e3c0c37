//! `[motion]`, `[wear]` and `[update]`

use super::Default::{Absent, ByPreset, Is, Required, Rule};
use super::keys;
use super::value::{
    ANY, CHANGE, FOR_BOTH, FOR_X, Integer, List, NOT_NEGATIVE, POSITIVE, Quantity, TOLERANCE, XY,
    integer,
};
use super::word::{Boolean, Choice, FilePath, PartOrNever, WordOrTable};
use crate::scene::Scheme;
use crate::units::Dimension;

/// Largest number of cycles, 2^53. The program counts cycles in floating-point numbers, which represent every integer
/// up to 2^53.
pub const MOST_CYCLES: u64 = 1 << 53;

/// Upper bound of the wear iterations of a run. Each wear iteration writes files.
pub const MOST_ITERATIONS: u64 = 1_000_000_000;

keys! {
    section "motion": "Motion of a joint that no structure moves, in every cycle of period T.";
    section "wear": "Wear over many cycles. A scene without [wear] computes one cycle.";
    section "wear.until": "Criteria that end a run before wear.cycles. The run does one more wear step after a criterion is met with certainty, judged by its error bar.";

    /// Half ranges of the displacement of the upper body along x and y: u(t) = amplitude cos(2 pi t/T + phase).
    MOTION_AMPLITUDE: List<2> = "motion.amplitude", Rule("none, if force, rotation or moment is given"),
        List(XY, Quantity(Dimension::LENGTH, NOT_NEGATIVE, r#"["5 um", "0 um"]"#), Some(FOR_X)), of ["harmonic"];
    /// Half ranges of the force along x and y, in place of amplitude. With a force of zero along y, contact.transverse
    /// determines the motion along y.
    MOTION_FORCE: List<2> = "motion.force", Absent,
        List(XY, Quantity(Dimension::FORCE, NOT_NEGATIVE, r#"["5 kN", "0 N"]"#), Some(FOR_X)), of ["harmonic"];
    /// Half range of the rotation of the upper body about z, through the middle of the joint.
    MOTION_ROTATION: Quantity = "motion.rotation", Absent, Quantity(Dimension::ANGLE, POSITIVE, "0.1 mrad"), of ["harmonic"];
    /// Half range of the moment about z, in place of rotation.
    MOTION_MOMENT: Quantity = "motion.moment", Absent, Quantity(Dimension::MOMENT, POSITIVE, "20 N m"), of ["harmonic"];
    /// Phases of the motion along x and y. Two amplitudes a quarter of a period apart make an orbit.
    MOTION_PHASE: List<2> = "motion.phase", Is("0 deg"),
        List(XY, Quantity(Dimension::ANGLE, ANY, r#"["0 deg", "90 deg"]"#), Some(FOR_BOTH)), of ["harmonic"];
    /// Half range of the normal load: N(t) = normal_load + normal_load_amplitude cos(2 pi t/T). The half range must be
    /// less than contact.normal_load.
    NORMAL_LOAD_AMPLITUDE: Quantity = "motion.normal_load_amplitude", Is("0 N"), Quantity(Dimension::FORCE, NOT_NEGATIVE, "100 N"), of ["harmonic"];
    /// One cycle as a table (CSV or Parquet), in place of all other keys of the motion. The table has the columns time
    /// (in periods) and displacement_x. The columns displacement_y and normal_load are optional. All columns except
    /// time are in SI units.
    HISTORY: FilePath = "motion.history", Absent, FilePath("cycle.parquet");
    /// Wear coefficient: worn volume per dissipated energy alpha [A eq. 2.5], or Archard's k. The key wear.law selects
    /// alpha or k.
    COEFFICIENT: Quantity = "wear.coefficient", Required, Quantity(Dimension::WEAR_COEFFICIENT, POSITIVE, "2e3 um^3/J");
    /// Wear law of the coefficient. With both laws, the coefficient counts the volume that both bodies lose together.
    LAW: Choice<&'static str> = "wear.law", Rule("energy; must be given if the unit of coefficient contains N, Pa or bar"), Choice(&[
        ("energy", "energy", "alpha, worn volume per energy dissipated by friction"),
        ("archard", "archard", "Archard's k, worn volume per load and local slip (not stroke): alpha = k/mu with contact.friction_coefficient"),
    ]);
    /// Number of cycles after which the run ends.
    CYCLES: Integer = "wear.cycles", Rule("none, if volume is given"), integer(1, MOST_CYCLES, "10_000_000");
    /// Worn volume at which the run ends. If a scene gives wear.cycles and wear.volume, the run ends at the limit that
    /// the run reaches first.
    VOLUME: Quantity = "wear.volume", Rule("none, if cycles is given"), Quantity(Dimension::VOLUME, POSITIVE, "1 mm^3");
    /// Remaining part of the bolt load at which the run ends. The end by preload requires a bolt that loses load.
    UNTIL_PRELOAD: Quantity = "wear.until.preload", Rule("none"), Quantity(Dimension::NONE, CHANGE, "90 %");
    /// Time integration scheme of the wear steps.
    SCHEME: Choice<Scheme> = "wear.scheme", ByPreset(["explicit", "implicit", "implicit", "implicit"]), Choice(&[
        ("implicit", Scheme::Implicit, "stable, second order: steps as long as tolerance allows"),
        ("semi_implicit", Scheme::SemiImplicit, "stable, first order: pressure at the end of a step, slip at its beginning; needs depth_step"),
        ("explicit", Scheme::Explicit, "the published scheme; needs depth_step, unstable if depth_step is too large"),
    ]);
    /// Largest wear depth per step [A eq. 2.7]. An implicit step wears the joint by at most wear.depth_step. The
    /// schemes semi_implicit and explicit choose each step to wear the joint by wear.depth_step.
    DEPTH_STEP: Quantity = "wear.depth_step", Rule("none; 0.1 um with preset paper if the scheme needs one"),
        Quantity(Dimension::LENGTH, POSITIVE, "0.1 um");
    /// Relative error allowed per wear step; the same as fidelity.wear_tolerance.
    WEAR_STEP_TOLERANCE: Quantity = "wear.tolerance", Rule("fidelity.wear_tolerance"), Quantity(Dimension::NONE, TOLERANCE, "0.01");
    /// Criterion by which the worn contact updates the contact elements of the structure [A §2e]. The criterion is
    /// update.stiffness_change, update.iterations or update.wear_volume.
    UPDATE: WordOrTable = "update", Is("never"), WordOrTable("never", "{ stiffness_change = 0.10 }");
    /// Relative change of kn or kt of the contact since the last update that triggers the next update. With
    /// contact.stiffness = "sliders", a relative change of the force or energy per cycle triggers an update as well.
    STIFFNESS_CHANGE: Quantity = "update.stiffness_change", Absent, Quantity(Dimension::NONE, CHANGE, "0.10");
    /// Growth of the worn volume since the last update that triggers the next update. The growth counts once 3 % of the
    /// expected final volume is worn. A given volume growth requires update.stiffness_change.
    VOLUME_GROWTH: PartOrNever = "update.volume_growth", ByPreset(["never", "0.5", "0.5", "0.25"]), PartOrNever("0.5");
    /// `update.extrapolate = true` extrapolates the motion of the contact elements between updates. Between updates,
    /// the extrapolated motion changes at the rate since the previous update.
    EXTRAPOLATE: Boolean = "update.extrapolate", ByPreset(["false", "true", "true", "true"]), Boolean;
    /// Wear iterations between two updates.
    UPDATE_ITERATIONS: Integer = "update.iterations", Absent, integer(1, MOST_ITERATIONS, "5");
    /// Worn volume between two updates.
    UPDATE_WEAR_VOLUME: Quantity = "update.wear_volume", Absent, Quantity(Dimension::VOLUME, POSITIVE, "0.1 mm^3");
}
