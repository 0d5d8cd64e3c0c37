//! The table of figures, in the order in which a user would ask for them.

use super::Bounds::{self, AtLeast, AtMost, Between, Of, ZeroOr};
use super::formulas::*;
use super::say::*;
use super::setup::Setup;
use super::{Row, row};
use crate::recipe::YIELD_PRESSURE;
use crate::surface::prepare::{PLAUSIBLE_HEIGHTS, PLAUSIBLE_SIDES};

/// Longest cells of a map over their width.
const SQUARE: Bounds = Between(0.5, 2.0);
/// Dimensions of a structure over the joint: from a gap to a long arm.
const DIMENSION: Bounds = Between(6e-3, 100.0);
/// Contact stiffness, divided by body stiffness: from hardly touching to glued.
const OVER_BODY: Bounds = Between(0.01, 1e3);
/// Applied motion, divided by the side length of a cell. Heights stay opposite to the same heights only up to one cell.
const CELL: Bounds = AtMost(1.0);
/// Applied motion, divided by the motion that makes the joint slide. A motion above the upper bound is not fretting.
const MOTION: Bounds = Of(|setup| Some([least_motion(setup), 1e3]));
/// Applied force, divided by the force that makes the joint slide.
const PULL: Bounds = Of(|setup| Some([least_motion(setup), f64::INFINITY]));
/// Smallest ratio of the harmonic force at resonance to the friction limit. Below a ratio of 0.1, contact elements of
/// equal stiffness and load slip at no frequency.
const NO_SLIP: f64 = 0.1;

/// Lower bound of the motion or force, relative to the motion or force that makes the joint slide. Below the lower
/// bound, no part of the joint slips. The energy of partial slip falls with the cube of the motion, so a joint with
/// wear needs a larger motion.
fn least_motion(setup: &Setup) -> f64 {
    match setup.recipe.wear {
        Some(_) => 8e-3,
        None => 1e-4,
    }
}

const fn youngs_modulus(keys: &'static str) -> Row {
    row("Young's modulus")
        .keys(keys)
        .unit(GPA)
        // From gels to diamond.
        .bounds(Between(1e4, 1.3e12))
        .hint("GPa, MPa or Pa?")
}

const fn poisson_ratio(keys: &'static str) -> Row {
    row("size of Poisson's ratio")
        .keys(keys)
        // Cork has a ratio of zero.
        .bounds(ZeroOr(0.01, 1.0))
        .hint("metals have about 0.3, and exactly 0 is allowed")
}

pub static TABLE: &[Row] = &[
    youngs_modulus("material.youngs_modulus").of(|setup| number(setup.both?.youngs_modulus)),
    poisson_ratio("material.poisson_ratio").of(|setup| poisson(setup.both?)),
    youngs_modulus("material.lower.youngs_modulus").of(|setup| number(setup.lower?.youngs_modulus)),
    poisson_ratio("material.lower.poisson_ratio").of(|setup| poisson(setup.lower?)),
    youngs_modulus("material.upper.youngs_modulus").of(|setup| number(setup.upper?.youngs_modulus)),
    poisson_ratio("material.upper.poisson_ratio").of(|setup| poisson(setup.upper?)),
    row("density")
        .of(|setup| number(setup.resonator?.material.density))
        .keys("material.density")
        .unit(KG_PER_M3)
        // From foam to osmium.
        .bounds(Between(20.0, 2.3e4))
        .hint("kg/m^3 or g/cm^3?"),
    row("speed of sound")
        .of(speed_of_sound)
        .keys("material.youngs_modulus, material.density")
        .unit(M_PER_S)
        // From rubber to diamond.
        .bounds(Between(20.0, 2e4))
        .hint("it is the root of E over density"),
    row("stiffness of nodes at the joint over Young's modulus and their distance")
        .of(node_stiffness)
        .keys("structure.unit, material.youngs_modulus")
        // Meshes of boxes have 0.3 to 3, meshes of flat boxes more, condensed models less. A wrong unit changes the
        // value by a thousand.
        .bounds(Between(0.04, 40.0))
        .hint("t with mm and s, kg with m and s?"),
    row("thinnest dimension of the structure over the side of the joint")
        .of(|setup| dimension(setup, 0))
        .bounds(DIMENSION)
        .hint("mm, um or m? or joint.size, with which it is compared"),
    row("longest dimension of the structure over the side of the joint")
        .of(|setup| dimension(setup, LENGTHS - 1))
        .bounds(DIMENSION)
        .hint("mm, um or m? or joint.size, with which it is compared"),
    row("number of points of the map along a side of the joint")
        .of(points)
        .keys("surface.spacing, joint.size")
        .bounds(AtLeast(16.0))
        .hint("so few points resolve hardly any roughness; um or mm? surface.correct.spacing overrides a file")
        .only_beyond(),
    row("autocorrelation of the map at a distance of two points")
        .of(correlation)
        .keys("surface.path, surface.spacing")
        // 1/e is the value at a correlation length.
        .bounds(AtLeast(0.36))
        .hint("the map has less than two points per correlation length: measure it more finely, and check whether its roughness is noise")
        .only_beyond(),
    row("spacing of the map's points along x over that along y")
        .of(aspect)
        .keys("surface.spacing, joint.size")
        .bounds(Of(aspect_bounds))
        .hint(
            "the map states no spacing and is taken to cover the joint; \
             are x and y exchanged (surface.transpose)? give surface.spacing",
        )
        .usual(SQUARE)
        .remark("few maps have such unequal spacings; surface.correct.spacing overrides the file")
        .only_beyond(),
    row("share of the joint that was not measured")
        .of(|setup| number(setup.map?.fit.unmeasured))
        .keys("surface.path, surface.fill")
        .bounds(AtMost(0.3))
        .hint("this part of the face is interpolated or excluded; measure it again, or make joint.size smaller")
        .usual(AtMost(0.05))
        .remark("this part of the face is interpolated or excluded, as surface.fill says")
        .only_beyond(),
    row("longer side of the map")
        .of(|setup| number(setup.map?.fit.side?))
        .keys("surface.spacing")
        .unit(MM)
        .bounds(Between(PLAUSIBLE_SIDES[0], PLAUSIBLE_SIDES[1]))
        .hint("um, mm or m? surface.correct.spacing overrides the file")
        .only_beyond(),
    row("range of the heights of the map")
        .of(|setup| number(setup.map?.fit.range))
        .keys("surface.unit")
        .unit(UM)
        .bounds(ZeroOr(PLAUSIBLE_HEIGHTS[0], PLAUSIBLE_HEIGHTS[1]))
        .hint("nm, um or mm? surface.correct.unit overrides the file")
        .only_beyond(),
    row("side of the joint")
        .of(side)
        .keys("joint.size")
        .unit(MM)
        .bounds(Between(1e-6, LONGEST_SIDE))
        .hint("mm, um or m?"),
    row("diameter of the hole over a cell")
        .of(hole)
        .keys("joint.hole.diameter")
        .bounds(AtLeast(1.0))
        .hint("it removes no cell; mm or um?"),
    row("Rq")
        .of(|setup| number(setup.face?.rq?))
        .keys("surface.rq")
        .keys_of_map("surface.unit")
        .unit(UM)
        .bounds(Of(rq_bounds))
        .hint("um, nm or mm?"),
    row("slope of the heights (root mean square)")
        .of(|setup| number(setup.face?.slope?))
        .keys("surface.rq, surface.correlation_length")
        .keys_of_map("surface.unit, surface.spacing")
        // The half-space model assumes small slopes. Machined faces have about 0.01 to 0.2.
        .bounds(AtMost(0.5))
        .hint("heights should be small compared with lengths: um and mm exchanged?")
        .usual(AtLeast(1e-4))
        .remark("a face as flat as a mirror; um or nm?"),
    row("highest cell above the others over their Rq")
        .of(|setup| number(setup.face?.spike?))
        .keys("surface.path")
        // A Gaussian face has about 1.5. An instrument spike may have any value.
        .bounds(AtMost(10.0))
        .hint(
            "a spike of the instrument, or dust? it would carry the load alone; \
             remove it from the map",
        ),
    row("cells of a correlation length")
        .of(|setup| number(asperities(setup)?[0]))
        .keys("surface.correlation_length, joint.grid")
        .bounds(AtLeast(2.0))
        .hint("asperities are not resolved; a finer grid, or um in place of mm?"),
    row("correlation lengths along a side")
        .of(|setup| number(asperities(setup)?[1]))
        .keys("surface.correlation_length")
        // Fewer lengths have no meaningful statistics.
        .bounds(AtLeast(3.0))
        .hint("the face has no more than a few asperities; m in place of mm?"),
    row("mean pressure over the contact modulus")
        .of(|setup| strain(setup.face?.mean_pressure()?, setup.face?.modulus()))
        .keys("contact.normal_load, joint.size, material.youngs_modulus")
        // A joint above the upper bound is not a bolted joint. The bodies of a joint below the lower bound hardly
        // touch.
        .bounds(Between(1e-10, 1e-2))
        .hint("kN or N, mm or m, GPa or MPa?")
        // On steel, the lowest usual ratio of 1e-6 is a pressure of 0.1 MPa. A pressure below 0.1 MPa suggests that a
        // weight presses the joint, not a bolt.
        .usual(AtLeast(1e-6))
        .remark("less than any bolt applies; kN or N, GPa or MPa?"),
    row("number of cells that touch")
        .of(touching)
        .keys("contact.normal_load, joint.grid")
        // Fewer cells do not resolve the contact, however small the load.
        .bounds(AtLeast(5.0))
        .hint("N or kN? a contact of so few cells is not resolved"),
    row("mean pressure over contact modulus and slope")
        .of(|setup| number(closure(setup)?))
        .keys("surface.rq, contact.normal_load")
        // From 1 on most of the face touches, and from the bound on all of it.
        .bounds(AtMost(5.0))
        .hint(
            "the load presses the faces flat, and the roughness has no effect: um or nm, N or kN?",
        )
        .usual(AtMost(2.0))
        .remark("most of the face touches; um or nm, N or kN?"),
    row("largest pressure of Hertz over the contact modulus")
        .of(hertz_pressure)
        .keys("contact.normal_load, surface.radius, material.youngs_modulus")
        .bounds(AtMost(2.0 * YIELD_PRESSURE))
        .hint("kN or N, mm or m, GPa or MPa?"),
    row("diameter of Hertz's contact over the shorter side of the joint")
        .of(|setup| over(2.0 * hertz_radius(setup)?, setup.face?.side(), MM))
        .keys("surface.radius, joint.size")
        .bounds(AtMost(1.0))
        .hint("the contact reaches beyond the joint; mm or m?"),
    row("cells of the radius of Hertz's contact")
        .of(hertz_cells)
        .keys("contact.normal_load, surface.radius, joint.size, joint.grid")
        // As for the number of cells in contact.
        .bounds(AtLeast(3.0))
        .hint("the contact is not resolved; N or mN, mm or um?"),
    row("approach over the shorter side of the joint")
        .of(|setup| {
            part(
                setup.face?.contact.conditions.approach?,
                setup.face?.side(),
                UM,
            )
        })
        .keys("contact.approach, joint.size")
        // The strain in the bodies.
        .bounds(AtMost(1e-2))
        .hint("um or mm?"),
    row("cap of the pressure over the contact modulus")
        .of(|setup| {
            strain(
                setup.face?.contact.conditions.pressure_cap?,
                setup.face?.modulus(),
            )
        })
        .keys("contact.pressure_cap")
        .bounds(Between(1e-10, 0.5))
        .hint("MPa or GPa? no pressure reaches it"),
    row("stiffness of the bolt over that of bodies as wide as the joint")
        .of(bolt)
        .keys("contact.bolt_stiffness, contact.bolt")
        .bounds(Between(1e-6, 10.0))
        .hint("N/um, N/nm or N/m?")
        // A spring that applies the load may be more compliant.
        .usual(AtLeast(1e-3))
        .remark("more like a spring than a bolt; N/um or N/mm?"),
    row("coefficient of friction")
        .of(friction)
        .keys("contact.friction_coefficient")
        // From ice to metals in vacuum.
        .bounds(ZeroOr(0.01, 2.0))
        .hint("a fraction or percent?"),
    row("pull over what friction holds")
        .of(pull)
        .keys("motion.force")
        .bounds(PULL)
        .hint("N, mN or kN?"),
    row("pull over what friction holds")
        .of(twist)
        .keys("motion.moment")
        .bounds(PULL)
        .hint("N m or N mm?"),
    row("mean load of the motion over that of the contact")
        .of(mean_load)
        .keys("motion.history, contact.normal_load")
        // The mean load of the motion and the load of the contact describe the same load.
        .bounds(Between(0.02, 50.0))
        .hint("N or kN?"),
    row("motion over a cell")
        .of(|setup| over(setup.displacement_half_range()?, setup.face?.cell(), UM))
        .keys("motion.amplitude, joint.grid")
        .bounds(CELL)
        .hint(
            "slip is taken to be small: cells do not travel with it, \
             and the points that face each other at rest wear each other; um or mm?",
        ),
    row("motion over what makes the joint slide")
        .of(|setup| over_estimate(setup.displacement_half_range()?, onset(setup)?, UM))
        .keys("motion.amplitude")
        .bounds(MOTION)
        .hint("much less causes no slip and no wear, much more is not fretting: um, mm or nm?"),
    row("motion over a cell")
        .of(|setup| over(setup.corner_half_range()?, setup.face?.cell(), UM))
        .keys("motion.rotation, joint.grid")
        .bounds(CELL)
        .hint(
            "slip is taken to be small: cells do not travel with it, \
             and the points that face each other at rest wear each other; rad, mrad or deg?",
        ),
    row("motion over what makes the joint slide")
        .of(|setup| over_estimate(setup.corner_half_range()?, onset(setup)?, UM))
        .keys("motion.rotation")
        .bounds(MOTION)
        .hint(
            "much less causes no slip and no wear, much more is not fretting: rad, mrad or urad?",
        ),
    row("damping ratio")
        .of(|setup| number(setup.response?.damping_ratio))
        .keys("dynamics.damping_ratio")
        // From the best resonators in vacuum, with a quality factor of 1e5, to strongly damped ones.
        .bounds(ZeroOr(5e-6, 0.2))
        .hint("a fraction or percent?"),
    row("damping ratio of the dashpots")
        .of(dashpots)
        .keys("structure.damping, structure.stiffness, structure.mass")
        // Dashpots may be dampers.
        .bounds(ZeroOr(5e-6, 0.7))
        .hint("N s/m or N s/mm?"),
    row("force over what friction holds")
        .of(|setup| over(forces(setup)?[0], forces(setup)?[1], N))
        .keys("dynamics.force, dynamics.base, contact.normal_load")
        // Below a ratio of 1e-6 no part of the joint slips, because no resonance multiplies a force by 1e6.
        .bounds(Between(1e-6, 10.0))
        .hint("N, kN or mN?"),
    row("force at resonance over what friction holds")
        .of(at_resonance)
        .keys("dynamics.force, dynamics.base, contact.normal_load")
        // On a rough face some asperities always slip.
        .bounds(Of(|setup| match setup.recipe.surface() {
            Some(_) => Some([1e-3, f64::INFINITY]),
            None => Some([NO_SLIP, f64::INFINITY]),
        }))
        .hint("the joint does not slip at any frequency: N, kN or mN?")
        .usual(AtLeast(NO_SLIP))
        .remark("the joint hardly slips and hardly wears; N, kN or mN?"),
    row("tangential over normal stiffness of the contact")
        .of(|setup| over(setup.springs()?[1], setup.springs()?[0], N_PER_UM))
        .keys("contact.kt, contact.kn")
        .bounds(Between(1e-2, 1e2))
        .hint("N/um, N/nm or N/m?"),
    row("stiffness of the contact over that of the springs")
        .of(over_springs)
        .keys("contact.kt, contact.kn, structure.stiffness")
        .bounds(Between(2e-3, 500.0))
        .hint("N/um, N/nm or N/m?"),
    row("normal stiffness of the contact over that of a body as wide")
        .of(|setup| over(setup.springs()?[0], body_stiffness(setup)?, N_PER_UM))
        .keys("contact.kn")
        .bounds(OVER_BODY)
        .hint("N/um, N/nm or N/m?"),
    row("tangential stiffness of the contact over that of a body as wide")
        .of(|setup| over(setup.springs()?[1], body_stiffness(setup)?, N_PER_UM))
        .keys("contact.kt")
        .bounds(OVER_BODY)
        .hint("N/um, N/nm or N/m?"),
    row("frequency over the resonances of the oscillator")
        .of(resonance_distance_oscillator)
        .keys("dynamics.frequency, structure.mass, structure.stiffness")
        .bounds(Between(0.125, 8.0))
        .hint("no resonance is near: Hz or kHz, kg or g, N/m or N/um?"),
    row("frequency over the first of a bar as long")
        .of(resonance_distance_bar)
        .keys("dynamics.frequency, structure, material")
        .bounds(Between(1e-3, 30.0))
        .hint("Hz or kHz, mm or m, kg or g?"),
    row("mass")
        .of(mass)
        .keys("structure, material.density")
        .unit(KG)
        .bounds(Between(1e-6, 1e6))
        .hint("kg or g, mm or m?"),
    row("wear coefficient")
        .of(|setup| number(setup.recipe.wear.as_ref()?.coefficient))
        .keys("wear.coefficient")
        .unit(UM3_PER_J)
        // From the hardest coatings to crumbling materials.
        .bounds(Between(5e-18, 1e-12))
        .hint(
            "um^3/J, mm^3/J or m^3/J? steels have about 1e3 to 1e5 um^3/J; \
             with wear.law = \"archard\" it is k/mu",
        ),
    row("number of cycles")
        .of(|setup| number(setup.recipe.wear.as_ref()?.cycles? as f64))
        .keys("wear.cycles")
        // A hundred years at 300 cycles per second.
        .bounds(AtMost(1e12))
        .hint("no machine makes so many cycles"),
    row("depth of a wear step over Rq")
        .of(wear_step)
        .keys("wear.depth_step")
        .bounds(Between(1e-4, 5.0))
        .hint("um, nm or mm?"),
    row("mean worn depth over Rq, if all of the joint slides")
        .of(worn)
        .keys("wear.coefficient, wear.cycles, motion.amplitude")
        // More is not the wear of a joint.
        .bounds(AtMost(1e4))
        .hint("um^3/J, mm^3/J or m^3/J?")
        .usual(AtLeast(2e-3))
        .remark("the wear will hardly be visible; more cycles, um or nm?"),
    row("depth of the volume asked for, over the side of the joint")
        .of(requested_depth)
        .keys("wear.volume, joint.size")
        // Wear changes faces, not bodies.
        .bounds(AtMost(1e-2))
        .hint("mm^3, um^3 or m^3?")
        .usual(Of(hundred_rq))
        .remark("this wears away far more than the roughness; mm^3 or um^3?"),
];
