//! `[dynamics]`

use super::Default::{Is, Required, Rule};
use super::keys;
use super::value::{
    ANY, Integer, Integers, List, NOT_NEGATIVE, POSITIVE, Quantity, RATIO, integer,
};
use super::word::{Choice, Point, Tables};
use crate::scene::{DampingBasis, FrictionLaw};
use crate::units::Dimension;

/// Largest number of modes. No swept frequency band has more modes, and the highest modes of a mesh are not modes of
/// the structure. The matrices of a reduced structure are dense.
const MOST_MODES: u64 = 1000;
/// Largest number of frequencies of a forced response. Each frequency needs a separate solve.
const MOST_POINTS: u64 = 100_000;
/// Highest harmonic that a response may have. A higher number is probably a typing error.
pub const LARGEST_HARMONIC: u64 = 1000;
/// Number of harmonics up to the highest one, including the constant part.
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
    ("x", 0, "along the lap; for matrices along x of the model"),
    (
        "y",
        1,
        "across the lap, in the plane of the contact; for matrices along y of the model",
    ),
    ("z", 2, "along the bolt; for matrices along z of the model"),
]);

keys! {
    section "dynamics": "The forces on the structure, and the wanted response.";
    section "dynamics.base": "Motion of the ground of an oscillator, with or without forces: amplitude cos(2 pi harmonic f t + phase). All displacements of the response and of the contact are displacements of the mass relative to the ground, which is the other face of the contact.";
    section "dynamics.rayleigh": "Rayleigh damping by a matrix alpha M + beta K, in addition to dampers and damping_ratio. The key dynamics.damping_basis selects the structure whose stiffness is K.";
    section "dynamics.response": "Point and direction whose displacement is the response; by default the point and direction of the drive.";

    /// Force on the structure, amplitude cos(2 pi harmonic f t + phase), or a list of forces. The drive is the first
    /// force of harmonic 1 at the point and in the direction of the response. If no such force exists, the drive is the
    /// first force of harmonic 1.
    FORCE: Tables = "dynamics.force", Rule("must be given, unless there is a dynamics.base"), Tables(r#"{ amplitude = "1000 N", at = "far_wall", direction = "x" }"#);
    /// Half range of the force. A force of harmonic 0 is constant, and its amplitude may be negative.
    FORCE_AMPLITUDE: Quantity = "dynamics.force.amplitude", Required, Quantity(Dimension::FORCE, ANY, "1000 N");
    /// Point where the force acts.
    FORCE_AT: Point = "dynamics.force.at", Rule("far_wall, or mass; must be given for matrices"), POINTS_OF_STRUCTURES;
    /// Axis along which the force acts.
    FORCE_DIRECTION: Choice<usize> = "dynamics.force.direction", Is("x"), DIRECTIONS;
    /// Phase lead of the force.
    FORCE_PHASE: Quantity = "dynamics.force.phase", Is("0 deg"), Quantity(Dimension::ANGLE, ANY, "90 deg");
    /// Number of oscillations of the force per period; 0 means a constant force.
    FORCE_HARMONIC: Integer = "dynamics.force.harmonic", Is("1"), integer(0, LARGEST_HARMONIC, "1");
    /// Half range of the acceleration of the ground, the same at all frequencies.
    BASE_ACCELERATION: Quantity = "dynamics.base.acceleration", Rule("must be given, or dynamics.base.displacement"),
        Quantity(Dimension::ACCELERATION, POSITIVE, "5 m/s^2");
    /// Half range of the displacement of the ground, the same at all frequencies.
    BASE_DISPLACEMENT: Quantity = "dynamics.base.displacement", Rule("must be given, or dynamics.base.acceleration"),
        Quantity(Dimension::LENGTH, POSITIVE, "1 um");
    /// Axis along which the ground moves.
    BASE_DIRECTION: Choice<usize> = "dynamics.base.direction", Is("x"), DIRECTIONS;
    /// Phase lead of the ground motion.
    BASE_PHASE: Quantity = "dynamics.base.phase", Is("0 deg"), Quantity(Dimension::ANGLE, ANY, "90 deg");
    /// Number of oscillations of the ground per period.
    BASE_HARMONIC: Integer = "dynamics.base.harmonic", Is("1"), integer(1, LARGEST_HARMONIC, "1");
    /// Point whose displacement is the response.
    RESPONSE_AT: Point = "dynamics.response.at", Rule("that of the drive"), POINTS_OF_STRUCTURES;
    /// Axis of the displacement that is the response.
    RESPONSE_DIRECTION: Choice<usize> = "dynamics.response.direction", Rule("that of the drive"), DIRECTIONS;
    /// Orders of the harmonics of the response [A eq. 2.2]. Without dynamics.harmonics, the solver adds harmonics until
    /// fidelity.harmonic_tolerance is met.
    HARMONICS: Integers = "dynamics.harmonics", Rule("[0, 1, 2, 3] and those of the forces"),
        Integers(MOST_HARMONICS, "a list of different integers of 0 to 1000, 0 and 1 among them, such as [0, 1, 2, 3]");
    /// Number of elastic modes of the reduced structure. The static residual of all other modes is added, and
    /// pseudo-modes represent its inertia [A §3]. An oscillator is not reduced to modes, and its scene has no
    /// dynamics.modes.
    MODES: Integer<usize> = "dynamics.modes", Is("30"), integer(1, MOST_MODES, "40");
    /// Damping ratio of every mode. The paper does not state the damping ratio of its structure.
    DAMPING_RATIO: Quantity = "dynamics.damping_ratio", Rule("0.002; 0 for an oscillator, and with dynamics.rayleigh, dynamics.loss_factor or damping in the files of the structure"), Quantity(Dimension::NONE, RATIO, "0.002");
    /// Loss factor of the structure without the contact. The hysteretic damping force is the loss factor times the
    /// elastic force of the structure. The hysteretic damping force leads the displacement by a quarter of a cycle at
    /// any frequency.
    LOSS_FACTOR: Quantity = "dynamics.loss_factor", Is("0"), Quantity(Dimension::NONE, NOT_NEGATIVE, "0.004");
    /// Rayleigh coefficient alpha of the mass matrix. The coefficient alpha adds alpha / (4 pi f) to the damping ratio
    /// of a mode with frequency f. The coefficient alpha also damps rigid-body motions.
    RAYLEIGH_MASS: Quantity = "dynamics.rayleigh.mass", Is("0 1/s"), Quantity(Dimension::FREQUENCY, NOT_NEGATIVE, "5 1/s");
    /// Rayleigh coefficient beta of the stiffness matrix. The coefficient beta adds pi f beta to the damping ratio of a
    /// mode of frequency f.
    RAYLEIGH_STIFFNESS: Quantity = "dynamics.rayleigh.stiffness", Is("0 s"), Quantity(Dimension::TIME, NOT_NEGATIVE, "1 us");
    /// Structure whose modes are damped: with or without the contact springs.
    DAMPING_BASIS: Choice<DampingBasis> = "dynamics.damping_basis", Is("stuck"), Choice(&[
        ("stuck", DampingBasis::Stuck, "with all springs of the unworn contact; an open gap has no springs"),
        ("free", DampingBasis::Free, "without contact springs"),
    ]);
    /// Law by which friction limits the tangential force T of a contact element with normal load N [A §2b].
    FRICTION_LAW: Choice<FrictionLaw> = "dynamics.friction_law", Is("cone"), Choice(&[
        ("cone", FrictionLaw::Cone, "|T| <= mu N, slip in the direction of the force"),
        ("box", FrictionLaw::Box, "|Tx| <= mu N and |Ty| <= mu N, independently"),
    ]);
    /// Frequency of the response that moves the joint, in place of the phase resonance. The given frequency may be far
    /// below the first resonance.
    AT: Quantity = "dynamics.at", Rule("none: the joint moves as at its phase resonance"), Quantity(Dimension::FREQUENCY, POSITIVE, r#""20 Hz""#);
    /// Frequency band of the search for the resonance and of the forced response. With dynamics.at, the frequency band
    /// applies only to the forced response.
    FREQUENCY: List<2> = "dynamics.frequency", Rule("must be given, unless there is a dynamics.at, without which there is no forced response; an oscillator has one from its resonances"),
        List("a list of the lowest and the highest frequency", Quantity(Dimension::FREQUENCY, POSITIVE, r#"["900 Hz", "1050 Hz"]"#), None);
    /// Number of points of the forced response, equally spaced in frequency.
    POINTS: Integer<usize> = "dynamics.points", Rule("as many as the curve needs"), integer(2, MOST_POINTS, "100");
}
