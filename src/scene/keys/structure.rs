//! `[structure]`

use super::Default::{Absent, Is, Required, Rule};
use super::keys;
use super::value::{ANY, FOR_ALL, Integer, List, NOT_NEGATIVE, POSITIVE, Quantity, integer};
use super::word::{Choice, FilePath, ListOrPath, PathOrTable, Text, Unit};
use crate::units::Dimension;

/// Largest number of mesh cells along one part of the resonator. A larger number is probably a typing error.
const LARGEST_CELLS: u64 = 999;

const LENGTH: Quantity = Quantity(Dimension::LENGTH, POSITIVE, "40 mm");
const CELLS: Integer<usize> = integer(1, LARGEST_CELLS, "4");
const FILE_FORMATS: Choice<&str> = Choice(&[
    ("abaqus", "abaqus", "Abaqus: *MATRIX OUTPUT, substructures"),
    ("ansys", "ansys", "ANSYS: .full"),
    ("calculix", "calculix", "CalculiX: SOLVER=MATRIXSTORAGE"),
    ("matrix_market", "matrix_market", "Matrix Market"),
    ("numpy", "numpy", "NPY, NPZ"),
]);
const DIRECTION: &str = "a list of three";
const XYZ: &str = "one value, or a list of three for x, y and z";

keys! {
    section "structure": "The vibrating structure. A structure requires [dynamics].";
    section "structure.unit": "The units of the files with matrices, nodes and pairs.";

    /// Kind of structure.
    KIND: Choice<&'static str> = "structure.kind", Required, Choice(&[
        ("resonator", "resonator", "the single-lap-joint resonator of the paper, in finite elements"),
        ("matrices", "matrices", "stiffness and mass from a finite-element program"),
        ("mesh", "mesh", "solids of an input deck of Abaqus or CalculiX, assembled here"),
        ("oscillator", "oscillator", "one mass on springs, dashpots and one contact element; the contact closes at positive z"),
    ]);
    /// Depth of the resonator along z, the axis of the bolt. The contact is in the middle of the depth.
    DEPTH: Quantity = "structure.depth", Is("60 mm"), LENGTH, of ["resonator"];
    /// Length along x of the part of the arms that has the full depth.
    STUB_LENGTH: Quantity = "structure.stub_length", Is("8 mm"), LENGTH, of ["resonator"];
    /// Clearance along x between the end of the arm of one body and the opposite body.
    GAP_LENGTH: Quantity = "structure.gap_length", Is("6 mm"), LENGTH, of ["resonator"];
    /// Length of mass 1 along x.
    BLOCK_LENGTH: Quantity = "structure.block_length", Is("70 mm"), LENGTH, of ["resonator"];
    /// Height of mass 1 along y.
    BLOCK_HEIGHT: Quantity = "structure.block_height", Is("190 mm"), LENGTH, of ["resonator"];
    /// Thickness of the leaf along x. The leaf is the compliant side of the frame.
    LEAF_THICKNESS: Quantity = "structure.leaf_thickness", Is("10 mm"), LENGTH, of ["resonator"];
    /// Length of the window in the frame along x.
    WINDOW_LENGTH: Quantity = "structure.window_length", Is("85 mm"), LENGTH, of ["resonator"];
    /// Height of the window in the frame along y. The window must be higher than the arms.
    WINDOW_HEIGHT: Quantity = "structure.window_height", Is("120 mm"), LENGTH, of ["resonator"];
    /// Height of the frame along y. The frame must be higher than the window.
    FRAME_HEIGHT: Quantity = "structure.frame_height", Is("190 mm"), LENGTH, of ["resonator"];
    /// Thickness of the far wall along x, the end of mass 2.
    WALL_THICKNESS: Quantity = "structure.wall_thickness", Is("40 mm"), LENGTH, of ["resonator"];
    /// Thickness of a bolt head along z.
    HEAD_THICKNESS: Quantity = "structure.head_thickness", Is("8 mm"), LENGTH, of ["resonator"];
    /// Modulus of the bolt over the modulus of the masses. The default factor gives the bolt shank of nine cells the
    /// stress area of an M10 thread.
    BOLT_MODULUS_FACTOR: Quantity = "structure.bolt_modulus_factor", Is("1.4536340852130327"),
        Quantity(Dimension::NONE, POSITIVE, "1.45"), of ["resonator"];
    /// Mesh cells through half the depth.
    HALF_DEPTH_CELLS: Integer<usize> = "structure.half_depth_cells", Is("5"), CELLS, of ["resonator"];
    /// Mesh cells along the block.
    BLOCK_CELLS: Integer<usize> = "structure.block_cells", Is("12"), CELLS, of ["resonator"];
    /// Mesh cells along a stub.
    STUB_CELLS: Integer<usize> = "structure.stub_cells", Is("2"), CELLS, of ["resonator"];
    /// Mesh cells along a gap.
    GAP_CELLS: Integer<usize> = "structure.gap_cells", Is("2"), CELLS, of ["resonator"];
    /// Mesh cells through the leaf.
    LEAF_CELLS: Integer<usize> = "structure.leaf_cells", Is("4"), CELLS, of ["resonator"];
    /// Mesh cells along the window.
    WINDOW_CELLS: Integer<usize> = "structure.window_cells", Is("16"), CELLS, of ["resonator"];
    /// Mesh cells through the far wall.
    WALL_CELLS: Integer<usize> = "structure.wall_cells", Is("8"), CELLS, of ["resonator"];
    /// Mesh cells from the arm to the edge of the window, along y, on each side.
    INNER_CELLS: Integer<usize> = "structure.inner_cells", Is("8"), CELLS, of ["resonator"];
    /// Mesh cells through a rim of the window along y.
    RIM_CELLS: Integer<usize> = "structure.rim_cells", Is("6"), CELLS, of ["resonator"];
    /// Mesh cells through a bolt head.
    HEAD_CELLS: Integer<usize> = "structure.head_cells", Is("2"), CELLS, of ["resonator"];
    /// File with both stiffness and mass, in place of separate files, or the input deck of a mesh. One of the matrix
    /// files of CalculiX is enough.
    FILE: FilePath = "structure.file", Rule("must be given, or structure.stiffness and structure.mass"), FilePath("matrices.npz"), of ["matrices", "mesh"];
    /// Format of the matrix files.
    FORMAT: Choice<&'static str> = "structure.format", Rule("by their content"), FILE_FORMATS, of ["matrices"];
    /// Positions of the nodes: CSV with the columns node, x, y and z. The file of nodes is required if no other file
    /// contains the positions. The matrix files, or an input deck in the same folder, can contain the positions.
    NODES: FilePath = "structure.nodes", Absent, FilePath("nodes.csv"), of ["matrices"];
    /// Nodes of both bodies at the joint, as pairs or as two sets. A file of pairs is CSV with the columns upper_node,
    /// lower_node and optionally area.
    INTERFACE: PathOrTable = "structure.interface", Required, PathOrTable("pairs.csv", "{ upper = \"TOP\", lower = \"BOTTOM\" }"), of ["matrices", "mesh"];
    /// Set of nodes of the upper body at the joint.
    INTERFACE_UPPER: Text = "structure.interface.upper", Required, Text("TOP");
    /// Set of nodes of the lower body at the joint.
    INTERFACE_LOWER: Text = "structure.interface.lower", Required, Text("BOTTOM");
    /// Fixed degrees of freedom, as a list of sets, nodes, node numbers with directions, and rows. The list has the
    /// format of fretwear inspect.
    FIXED: Text = "structure.fixed", Rule("nothing"), Text("CLAMP, 12-20, 31.123"), of ["matrices", "mesh"];
    /// Normal of the joint, from the lower body into the upper body, in the axes of the model.
    NORMAL: List<3> = "structure.normal", Rule("from the positions of the nodes"), List(DIRECTION, Quantity(Dimension::NONE, ANY, "[0, 0, 1]"), None), of ["matrices", "mesh"];
    /// Direction of the joint's x axis, in the axes of the model.
    ALONG: List<3> = "structure.along", Rule("the direction of its node array that is nearest to the x axis of the model"), List(DIRECTION, Quantity(Dimension::NONE, ANY, "[1, 0, 0]"), None), of ["matrices", "mesh"];
    /// Thickness of the finite elements at the joint, on either side.
    LAYER: Quantity = "structure.layer", Rule("from the positions of the nodes"), LENGTH, of ["matrices", "mesh"];
    /// Unit of length of the files of the structure.
    UNIT_LENGTH: Unit = "structure.unit.length", Is("m"), Unit(Dimension::LENGTH, "mm"), of ["matrices", "mesh"];
    /// Unit of mass of the files of the structure: t for a model in mm, N and s.
    UNIT_MASS: Unit = "structure.unit.mass", Is("kg"), Unit(Dimension::MASS, "t"), of ["matrices", "mesh"];
    /// Unit of time of the files of the structure.
    UNIT_TIME: Unit = "structure.unit.time", Is("s"), Unit(Dimension::TIME, "s"), of ["matrices", "mesh"];
    /// Mass of an oscillator along x, y and z. With matrices, the key is the path of the mass matrix.
    MASS: ListOrPath<3> = "structure.mass", Rule("must be given; for matrices, or structure.file"),
        ListOrPath(List(XYZ, Quantity(Dimension::MASS, POSITIVE, "1 kg"), Some(FOR_ALL)), FilePath("model_MASS1.mtx")), of ["oscillator", "matrices"];
    /// Damping of an oscillator's dashpots along x, y and z. For a structure from matrices, structure.damping is the
    /// file with the viscous damping matrix.
    DAMPING: ListOrPath<3> = "structure.damping", Rule("none"),
        ListOrPath(List(XYZ, Quantity(Dimension::DAMPING, NOT_NEGATIVE, "5 N s/m"), Some(FOR_ALL)), FilePath("model_DMPV1.mtx")), of ["oscillator", "matrices"];
    /// File with the hysteretic (structural) damping matrix. The hysteretic damping force leads the displacement by a
    /// quarter of a cycle at any frequency.
    STRUCTURAL_DAMPING: FilePath = "structure.structural_damping", Rule("none"), FilePath("model_DMPS1.mtx"), of ["matrices"];
    /// Stiffness of an oscillator's springs to the ground along x, y and z, in parallel with the contact. For a
    /// structure from matrices, structure.stiffness is the file with the stiffness matrix.
    STIFFNESS: ListOrPath<3> = "structure.stiffness", Rule("must be given; for matrices, or structure.file"),
        ListOrPath(List(XYZ, Quantity(Dimension::STIFFNESS, NOT_NEGATIVE, "10 N/um"), Some(FOR_ALL)), FilePath("model_STIF1.mtx")), of ["oscillator", "matrices"];
    /// Cubic stiffness k3 of springs to the ground along x, y and z, in parallel with the linear springs. The force of
    /// a cubic spring is k3 u^3, which softens if k3 is negative.
    CUBIC_STIFFNESS: List<3> = "structure.cubic_stiffness", Is("0 N/m^3"),
        List(XYZ, Quantity(Dimension::CUBIC_STIFFNESS, ANY, "1e9 N/m^3"), Some(FOR_ALL)), of ["oscillator"];
    /// Stiffness of one-sided springs to the ground along x, y and z. A one-sided spring touches when the displacement
    /// exceeds structure.stop_gap.
    STOP_STIFFNESS: List<3> = "structure.stop_stiffness", Is("0 N/m"),
        List(XYZ, Quantity(Dimension::STIFFNESS, NOT_NEGATIVE, "10 N/um"), Some(FOR_ALL)), of ["oscillator"];
    /// Displacement along x, y and z at which the one-sided springs touch.
    STOP_GAP: List<3> = "structure.stop_gap", Is("0 m"),
        List(XYZ, Quantity(Dimension::LENGTH, NOT_NEGATIVE, "10 um"), Some(FOR_ALL)), of ["oscillator"];
}
