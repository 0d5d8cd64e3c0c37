//! `[dynamics]`

use super::Default::{Is, Required, Rule};
use super::keys;
use super::value::{
    ANY, Integer, Integers, List, NOT_NEGATIVE, POSITIVE, Quantity, RATIO, integer,
};
use super::word::{Choice, Point, Tables};
use crate::scene::{DampingBasis, FrictionLaw};
use crate::units::Dimension;

/// More modes than any band that is swept has: the matrices of a reduced structure are dense, and the highest modes of a mesh are
/// not those of the structure.
const MOST_MODES: u64 = 1000;
/// More frequencies than a forced response can show; each is a solve of its own.
const MOST_POINTS: u64 = 100_000;
/// A higher harmonic than any response shows: a slip of the keyboard.
pub const LARGEST_HARMONIC: u64 = 1000;
/// That harmonic and all below it, and the constant part.
const MOST_HARMONICS: usize = LARGEST_HARMONIC as usize + 1;

const POINTS_OF_STRUCTURES: Point = Point(&[
    (
        "far_wall",
        "resonator: the middle of the outer face of the far wall",
    ),
    ("block", "resonator: the middle of the outer face of mass 1"),
    ("mass", "oscillator: its mass"),
]);
const DIRECTIONS: Choice<usize> = Choice(&[
    ("x", 0, "along the lap; of matrices along x of the model"),
    (
        "y",
        1,
        "across it, in the plane of the contact; of matrices along y of the model",
    ),
    ("z", 2, "along the bolt; of matrices along z of the model"),
]);

keys! {
    section "dynamics": "The forces on the structure, and what of its response is wanted.";
    section "dynamics.base": "How the ground of an oscillator moves, beside the forces or in their place: amplitude cos(2 pi harmonic f t + phase). All displacements of the response are those of the mass relative to the ground, and so are those of the contact, whose other face is the ground.";
    section "dynamics.rayleigh": "Damping by a matrix alpha M + beta K, beside dampers and damping_ratio. K is the stiffness of the structure that damping_basis names.";
    section "dynamics.response": "Whose displacement is the response; without it, that of the drive.";

    /// The force, amplitude cos(2 pi harmonic f t + phase), or a list of forces. The drive is the first of harmonic 1 at the response and along it, or the first of all where none is there.
    FORCE: Tables = "dynamics.force", Rule("must be given, unless there is a dynamics.base"), Tables(r#"{ amplitude = "1000 N", at = "far_wall", direction = "x" }"#);
    /// Half range of the force. That of harmonic 0 is constant, and may be negative.
    FORCE_AMPLITUDE: Quantity = "dynamics.force.amplitude", Required, Quantity(Dimension::FORCE, ANY, "1000 N");
    /// Where the force acts.
    FORCE_AT: Point = "dynamics.force.at", Rule("far_wall, or mass; of matrices it must be given"), POINTS_OF_STRUCTURES;
    /// Along which axis the force acts.
    FORCE_DIRECTION: Choice<usize> = "dynamics.force.direction", Is("x"), DIRECTIONS;
    /// Lead of the force.
    FORCE_PHASE: Quantity = "dynamics.force.phase", Is("0 deg"), Quantity(Dimension::ANGLE, ANY, "90 deg");
    /// How many times the force oscillates in a period; 0: it is constant.
    FORCE_HARMONIC: Integer = "dynamics.force.harmonic", Is("1"), integer(0, LARGEST_HARMONIC, "1");
    /// Half range of the acceleration of the ground, the same at all frequencies.
    BASE_ACCELERATION: Quantity = "dynamics.base.acceleration", Rule("must be given, or dynamics.base.displacement"),
        Quantity(Dimension::ACCELERATION, POSITIVE, "5 m/s^2");
    /// Half range of the displacement of the ground, the same at all frequencies.
    BASE_DISPLACEMENT: Quantity = "dynamics.base.displacement", Rule("must be given, or dynamics.base.acceleration"),
        Quantity(Dimension::LENGTH, POSITIVE, "1 um");
    /// Along which axis the ground moves.
    BASE_DIRECTION: Choice<usize> = "dynamics.base.direction", Is("x"), DIRECTIONS;
    /// Lead of that motion.
    BASE_PHASE: Quantity = "dynamics.base.phase", Is("0 deg"), Quantity(Dimension::ANGLE, ANY, "90 deg");
    /// How many times the ground oscillates in a period.
    BASE_HARMONIC: Integer = "dynamics.base.harmonic", Is("1"), integer(1, LARGEST_HARMONIC, "1");
    /// Where the displacement is read.
    RESPONSE_AT: Point = "dynamics.response.at", Rule("that of the drive"), POINTS_OF_STRUCTURES;
    /// Along which axis the displacement is read.
    RESPONSE_DIRECTION: Choice<usize> = "dynamics.response.direction", Rule("that of the drive"), DIRECTIONS;
    /// Orders of the harmonics of the response [A eq. 2.2]. Without this key more are added until fidelity.harmonic_tolerance is met.
    HARMONICS: Integers = "dynamics.harmonics", Rule("[0, 1, 2, 3] and those of the forces"),
        Integers(MOST_HARMONICS, "a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]");
    /// Elastic modes of the reduced structure, beside the residual of all others, its inertia by pseudo-modes [A §3]. Not of an oscillator.
    MODES: Integer<usize> = "dynamics.modes", Is("30"), integer(1, MOST_MODES, "40");
    /// Damping ratio of every mode. The paper does not state its own.
    DAMPING_RATIO: Quantity = "dynamics.damping_ratio", Rule("0.002; of an oscillator, and with dynamics.rayleigh, dynamics.loss_factor or damping in the files of the structure, 0"), Quantity(Dimension::NONE, RATIO, "0.002");
    /// Loss factor of the structure: hysteretic damping by this part of its stiffness. The contact has none of it. Its force is a quarter of a cycle ahead of the displacement at any frequency.
    LOSS_FACTOR: Quantity = "dynamics.loss_factor", Is("0"), Quantity(Dimension::NONE, NOT_NEGATIVE, "0.004");
    /// The coefficient alpha of the mass matrix: a mode of frequency f gets the damping ratio alpha / (4 pi f) more. Motions of the whole structure are braked too.
    RAYLEIGH_MASS: Quantity = "dynamics.rayleigh.mass", Is("0 1/s"), Quantity(Dimension::FREQUENCY, NOT_NEGATIVE, "5 1/s");
    /// The coefficient beta of the stiffness matrix: a mode of frequency f gets the damping ratio pi f beta more.
    RAYLEIGH_STIFFNESS: Quantity = "dynamics.rayleigh.stiffness", Is("0 s"), Quantity(Dimension::TIME, NOT_NEGATIVE, "1 us");
    /// Of which structure the damped modes are.
    DAMPING_BASIS: Choice<DampingBasis> = "dynamics.damping_basis", Is("stuck"), Choice(&[
        ("stuck", DampingBasis::Stuck, "with all springs of the unworn contact; a gap has none"),
        ("free", DampingBasis::Free, "without contact springs"),
    ]);
    /// How friction limits the tangential force T of a contact element under its normal load N [A §2b].
    FRICTION_LAW: Choice<FrictionLaw> = "dynamics.friction_law", Is("cone"), Choice(&[
        ("cone", FrictionLaw::Cone, "|T| <= mu N, slip along the force"),
        ("box", FrictionLaw::Box, "|Tx| <= mu N and |Ty| <= mu N, each for itself"),
    ]);
    /// Frequency of the response that moves the joint, in place of its phase resonance. It may be far below the first resonance.
    AT: Quantity = "dynamics.at", Rule("none: the joint moves as at its phase resonance"), Quantity(Dimension::FREQUENCY, POSITIVE, r#""20 Hz""#);
    /// Band in which the resonance is looked for and the forced response is computed. With dynamics.at, that of the forced response alone.
    FREQUENCY: List<2> = "dynamics.frequency", Rule("must be given, unless there is a dynamics.at, without which there is no forced response; an oscillator has one from its resonances"),
        List("a list of the lowest and the highest frequency", Quantity(Dimension::FREQUENCY, POSITIVE, r#"["900 Hz", "1050 Hz"]"#), None);
    /// Points of the forced response, at equal distances of frequency.
    POINTS: Integer<usize> = "dynamics.points", Rule("where the curve needs them"), integer(2, MOST_POINTS, "100");
}
