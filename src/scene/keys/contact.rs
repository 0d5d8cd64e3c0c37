//! `[contact]`

use super::Default::{Absent, ByPreset, Is, Required, Rule};
use super::keys;
use super::value::{ANY, List, NOT_NEGATIVE, POSITIVE, Quantity, XY};
use super::word::{Boolean, Choice, FilePath, Text};
use crate::contact::normal::Rotation;
use crate::model_update::{BoltHead, Clamping};
use crate::scene::{Boundary, Distribution, Pressing, Stiffness, Transverse};
use crate::units::Dimension;

keys! {
    section "contact": "Load, friction and boundary conditions of the joint. Without [contact] a structure is bonded and linear.";
    section "contact.preload": "Preload of a bolt in a structure from files, in place of normal_load: two constant, opposing forces along the line between the centroids of head and nut, each distributed by area.";

    section "contact.bolt": "A bolt outside the structure, in place of bolt_stiffness: VDI 2230-1:2015, 5.1, gives the compliance of the bolt and of the clamped parts. A bolt requires [wear].";

    /// Coulomb's coefficient of friction [A §2c]. A joint with a coefficient of 0 transmits no shear and does not wear.
    FRICTION_COEFFICIENT: Quantity = "contact.friction_coefficient", Rule("must be given if the joint moves, else none: no friction"),
        Quantity(Dimension::NONE, NOT_NEGATIVE, "0.6");
    /// Static load that presses the bodies together: the preload of the bolt. The load may be 0 if contact.kn and
    /// contact.kt are given.
    NORMAL_LOAD: Quantity = "contact.normal_load", Rule("must be given, unless approach or gap is"),
        Quantity(Dimension::FORCE, POSITIVE, "30 kN");
    /// Force of the bolt. With contact.preload.in_mesh = true, the key is the normal load on the joint.
    PRELOAD_FORCE: Quantity = "contact.preload.force", Required, Quantity(Dimension::FORCE, POSITIVE, "10 kN"), with ["structure", "surface"];
    /// Nodes and sets of nodes on which the bolt head presses, separated by commas.
    PRELOAD_HEAD: Text = "contact.preload.head", Required, Text("HEAD"), with ["structure", "surface"];
    /// Nodes and sets of nodes on which the nut presses, separated by commas.
    PRELOAD_NUT: Text = "contact.preload.nut", Required, Text("NUT"), with ["structure", "surface"];
    /// `contact.preload.in_mesh = true` states that the bolt is part of the mesh. If the bolt is part of the mesh, the
    /// program chooses the bolt force such that contact.preload.force presses the joint.
    PRELOAD_IN_MESH: Boolean = "contact.preload.in_mesh", Is("false"), Boolean, with ["structure", "surface"];
    /// Approach of the bodies in place of normal_load, counted from height 0, positive when pressed together. A given
    /// approach requires a contact that does not move.
    APPROACH: Quantity = "contact.approach", Absent, Quantity(Dimension::LENGTH, ANY, "2 um"), of ["rough"];
    /// Normal stiffness of the whole joint, in place of a surface. A joint with given stiffness does not wear.
    KN: Quantity = "contact.kn", Rule("from the [surface]; must be given if kt is"), STIFF, of ["given"];
    /// Tangential stiffness of the whole joint, in place of a surface.
    KT: Quantity = "contact.kt", Rule("from the [surface]; must be given if kn is"), STIFF, of ["given"];
    /// A table (CSV) of the contact elements in place of a surface, with one row per slider. The command `fretwear
    /// export RUN@N --contact csv` writes a table of contact elements.
    ELEMENTS: FilePath = "contact.elements", Absent, FilePath("contact.csv"), of ["given"], with ["structure"];
    /// Gap of the contact at rest. A contact with a gap has no normal_load.
    GAP: Quantity = "contact.gap", Is("0 um"), Quantity(Dimension::LENGTH, NOT_NEGATIVE, "1 um"), of ["given"];
    /// Upper bound of the contact pressure at every point, such as the hardness of the material [A eq. 4.3].
    PRESSURE_CAP: Quantity = "contact.pressure_cap", Rule("none: elastic"), Quantity(Dimension::PRESSURE, POSITIVE, "600 MPa"), of ["rough"];
    /// Boundary condition at the edges of the joint.
    BOUNDARY: Choice<Boundary> = "contact.boundary", Is("free"), Choice(&[
        ("free", Boundary::Free, "a free surface without traction"),
        ("periodic", Boundary::Periodic, "the joint repeats periodically in both directions"),
    ]), of ["rough"];
    /// Treatment of the direction y, across a motion along x.
    TRANSVERSE: Choice<Transverse> = "contact.transverse", Is("fixed"), Choice(&[
        ("absent", Transverse::Absent, "no y direction: neither shear nor displacement; cheaper"),
        ("fixed", Transverse::Fixed, "the mean displacement along y is fixed, or follows a prescribed motion"),
        ("free", Transverse::Free, "no force along y, and the displacement is solved for; not with [dynamics]"),
    ]), of ["rough"];
    /// Rotations of the bodies about x and y: fixed or free.
    ROTATION: Choice<Rotation> = "contact.rotation", Is("fixed"), Choice(&[
        ("fixed", Rotation::FIXED, "the rotations are zero; the moments are reported"),
        ("free", Rotation::Free { moment: [0.0; 2] }, "the bodies tilt until the pressure has the given moments"),
    ]), of ["rough"];
    /// Moments about x and y, through the middle of the joint, that act on free rotations. Given moments require
    /// contact.rotation = "free".
    MOMENT: List<2> = "contact.moment", Rule("no moments"),
        List(XY, Quantity(Dimension::MOMENT, ANY, r#"["2 N m", "0 N m"]"#), None), of ["rough"];
    /// Model by which the bodies of a structure press each other. The default is "structure" if contact.stiffness =
    /// "sliders" and the mesh consists of equal boxes. Otherwise the default of contact.pressing is "punch".
    PRESSING: Choice<Pressing> = "contact.pressing", ByPreset(["punch", "structure", "structure", "structure"]), Choice(&[
        ("structure", Pressing::Structure, "the structure bends under its loads, which determines rotation, moment and approach"),
        ("punch", Pressing::Punch, "rigid punches on half spaces, so that most of the load is at the edges"),
    ]), of ["rough"], with ["structure", "surface"];
    /// Law that the contact elements of a structure get from the rough contact. With contact.boundary = "periodic" the
    /// default law is "total".
    STIFFNESS: Choice<Stiffness> = "contact.stiffness", ByPreset(["total", "sliders", "sliders", "sliders"]), Choice(&[
        ("sliders", Stiffness::Sliders, "a bank of sliders per contact element, fitted to its force-displacement curve in the rough contact, without the compliance that the finite elements already have"),
        ("total", Stiffness::Total, "one slider per contact element, with the stiffness of the whole patch, as published"),
        ("roughness", Stiffness::Roughness, "as with total, but without the compliance of the bodies, which the finite elements already have"),
        ("tangent", Stiffness::Tangent, "one slider per contact element, with the stiffness of its own cells"),
    ]), of ["rough"], with ["structure", "surface"];
    /// Distribution of the stiffness of the joint over the contact elements. A given distribution requires
    /// contact.stiffness = "total" or "roughness".
    DISTRIBUTION: Choice<Distribution> = "contact.distribution", Is("uniform"), Choice(&[
        ("uniform", Distribution::Uniform, "by area"),
        ("loaded", Distribution::Loaded, "by area, over the elements that bear load"),
        ("by_load", Distribution::ByLoad, "by static load"),
    ]), of ["rough"], with ["structure", "surface"];
    /// Stiffness of the bolt together with the clamped parts. The bolt load falls as wear brings the bodies closer. A
    /// given bolt stiffness requires [wear].
    BOLT_STIFFNESS: Quantity = "contact.bolt_stiffness", Rule("none: the load stays"), Quantity(Dimension::STIFFNESS, POSITIVE, "500 N/um"), of ["rough"];
    /// Metric thread of the bolt: M10, or M10x1.25 with a fine pitch.
    BOLT_SIZE: Text = "contact.bolt.size", Rule("must be given, unless diameter and core_diameter are"), Text("M10"), with ["surface"];
    /// Nominal diameter of a non-metric thread, in place of size.
    BOLT_DIAMETER: Quantity = "contact.bolt.diameter", Absent, Quantity(Dimension::LENGTH, POSITIVE, "10 mm"), with ["surface"];
    /// Core diameter of a non-metric thread.
    BOLT_CORE_DIAMETER: Quantity = "contact.bolt.core_diameter", Absent, Quantity(Dimension::LENGTH, POSITIVE, "8.16 mm"), with ["surface"];
    /// Clamped length, from head to nut or to the thread of the part.
    BOLT_CLAMP_LENGTH: Quantity = "contact.bolt.clamp_length", Required, Quantity(Dimension::LENGTH, POSITIVE, "40 mm"), with ["surface"];
    /// Length of the shank without thread.
    BOLT_SHANK_LENGTH: Quantity = "contact.bolt.shank_length", Is("0 mm"), Quantity(Dimension::LENGTH, NOT_NEGATIVE, "20 mm"), with ["surface"];
    /// Outer diameter of the face under head and nut: for a hexagon about its width across flats.
    BOLT_BEARING_DIAMETER: Quantity = "contact.bolt.bearing_diameter", Required, Quantity(Dimension::LENGTH, POSITIVE, "14.6 mm"), with ["surface"];
    /// Diameter of the hole in the clamped parts.
    BOLT_HOLE: Quantity = "contact.bolt.hole", Required, Quantity(Dimension::LENGTH, POSITIVE, "11 mm"), with ["surface"];
    /// Outer diameter of the clamped parts. If the clamped parts are not round, use the largest circle about the bolt
    /// that fits into the parts.
    BOLT_OUTER_DIAMETER: Quantity = "contact.bolt.outer_diameter", Required, Quantity(Dimension::LENGTH, POSITIVE, "40 mm"), with ["surface"];
    /// Young's modulus of bolt and nut. [material] gives the modulus of the clamped parts.
    BOLT_MODULUS: Quantity = "contact.bolt.modulus", Is("205 GPa"), Quantity(Dimension::PRESSURE, POSITIVE, "205 GPa"), with ["surface"];
    /// Shape of the bolt head.
    BOLT_HEAD: Choice<BoltHead> = "contact.bolt.head", Is("hexagon"), Choice(&[
        ("hexagon", BoltHead::Hexagon, "a hexagon"),
        ("cylinder", BoltHead::Cylinder, "a cylinder with a socket"),
    ]), with ["surface"];
    /// End of the bolt: a nut, or the thread of a part.
    BOLT_JOINT: Choice<Clamping> = "contact.bolt.joint", Is("through"), Choice(&[
        ("through", Clamping::Through, "in a nut"),
        ("tapped", Clamping::Tapped, "in the thread of a part"),
    ]), with ["surface"];
}

const STIFF: Quantity = Quantity(Dimension::STIFFNESS, NOT_NEGATIVE, "1e4 N/um");

/// [`NORMAL_LOAD`] of a contact with given stiffness. The load may be zero, because a contact of given stiffness may be
/// unloaded.
pub const LOAD_AT_REST: super::Key<Quantity> = super::Key {
    value: Quantity(Dimension::FORCE, NOT_NEGATIVE, "30 kN"),
    ..NORMAL_LOAD
};
