//! The parametric single-lap-joint resonator: two masses joined by a bolted lap. Mass 2 is an 'o'-shaped frame with a
//! thin leaf.
//!
//! The x axis is along the length of the resonator, from mass 1 to mass 2. The y axis is along the height, and the z
//! axis is along the depth and the bolt. The origin is the centre of the lap, and the contact plane is z = 0. The
//! resonator is symmetric about y = 0. The parts along x are:
//!
//! - The block of mass 1 has the full depth and the full height.
//! - The arm of mass 1 has the height of the lap. Its first part has the full depth. Across the gap and the lap, the
//!   arm of mass 1 is only below the contact plane.
//! - The arm of mass 2 is only above the contact plane on the lap and across the gap. The last part of the arm of mass
//!   2 has the full depth.
//! - The leaf, the two rims of the window, and the far wall follow the arm of mass 2.
//!
//! The bolt hole is a staircase in the mesh of the lap. The shank of the bolt does not touch the hole. The heads of the
//! bolt share nodes with the outer faces of the lap. The two bodies touch on the lap only, where each body has its own
//! nodes.

mod mesh;

use crate::material::{Elastic, Material};
use crate::structure::StructureError;
use crate::structure::assembly::System;
use crate::structure::contact_array::ContactArray;
use crate::structure::element::{self, Formulation};
use crate::structure::mesh::Mesh;
use crate::structure::modes::ModeOptions;
use crate::structure::outline::{Line, Outline};
use crate::structure::reduction::{self, ContactPorts, Ports, ReducedStructure};
pub use mesh::{BOLT, BOLT_ABOVE, BOLT_BELOW, FacingFaces, MASS_1, MASS_2, ResonatorMesh};
use mesh::{HEAD_HALF_WIDTH, HOLE_HALF_WIDTHS, in_staircase};

/// Dimensions \[m\], numbers of cells and materials of the resonator. [`Resonator::default`] is the standard design.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Resonator {
    /// Length of the lap along x.
    pub lap_length: f64,
    /// Height of the arms and of the lap along y.
    pub arm_height: f64,
    /// Depth of all parts along z. The contact plane is in the middle.
    pub depth: f64,
    /// Length of the part of an arm that has full depth.
    pub stub_length: f64,
    /// Clearance between the end of an arm of one body and the full-depth part of the opposite body.
    pub gap_length: f64,
    /// Length of mass 1.
    pub block_length: f64,
    /// Height of mass 1.
    pub block_height: f64,
    /// Thickness of the leaf along x.
    pub leaf_thickness: f64,
    /// Length of the window along x.
    pub window_length: f64,
    /// Height of the window along y.
    pub window_height: f64,
    /// Height of the frame (leaf, rims, far wall).
    pub frame_height: f64,
    /// Thickness of the far wall along x.
    pub wall_thickness: f64,
    /// Thickness of a bolt head along z.
    pub head_thickness: f64,
    /// Young's modulus of the bolt divided by Young's modulus of the masses. The ratio of Young's moduli corrects the
    /// area of the staircase shank to the stress area of the bolt.
    pub bolt_modulus_factor: f64,
    /// Material of the masses. The material of the bolt differs by `bolt_modulus_factor`.
    pub material: Material,
    /// Cells of the lap along x and along y. An odd number, because the hole has a middle cell.
    pub lap_cells: usize,
    /// Cells through half the depth.
    pub half_depth_cells: usize,
    /// Cells along the block.
    pub block_cells: usize,
    /// Cells along a stub.
    pub stub_cells: usize,
    /// Cells along a gap.
    pub gap_cells: usize,
    /// Cells through the leaf.
    pub leaf_cells: usize,
    /// Cells along the window.
    pub window_cells: usize,
    /// Cells through the far wall.
    pub wall_cells: usize,
    /// Cells from the arm to the edge of the window along y, on each side.
    pub inner_cells: usize,
    /// Cells through a rim along y.
    pub rim_cells: usize,
    /// Cells through a bolt head.
    pub head_cells: usize,
    /// True if the two bodies share their contact nodes, for verification. The bonded joint has no contact elements.
    pub tied: bool,
}

impl Default for Resonator {
    fn default() -> Self {
        Resonator {
            lap_length: 40e-3,
            arm_height: 40e-3,
            depth: 60e-3,
            stub_length: 8e-3,
            gap_length: 6e-3,
            block_length: 70e-3,
            block_height: 190e-3,
            leaf_thickness: 10e-3,
            window_length: 85e-3,
            window_height: 120e-3,
            frame_height: 190e-3,
            wall_thickness: 40e-3,
            head_thickness: 8e-3,
            // 57.99 mm² of an M10 thread over the nine cells' 39.89 mm².
            bolt_modulus_factor: 1.453_634_085_213_032_7,
            material: Material {
                elastic: Elastic {
                    youngs_modulus: 198.4e9,
                    poisson_ratio: 0.3,
                },
                density: 7949.0,
            },
            lap_cells: 19,
            half_depth_cells: 5,
            block_cells: 12,
            stub_cells: 2,
            gap_cells: 2,
            leaf_cells: 4,
            window_cells: 16,
            wall_cells: 8,
            inner_cells: 8,
            rim_cells: 6,
            head_cells: 2,
            tied: false,
        }
    }
}

impl Resonator {
    /// Returns the approximate distance between the free end of mass 1 and the free end of mass 2 \[m\]. The distance
    /// has the lengths of one stub and one gap.
    pub fn length(&self) -> f64 {
        self.block_length
            + self.stub_length
            + self.gap_length
            + self.lap_length
            + self.leaf_thickness
            + self.window_length
            + self.wall_thickness
    }

    /// Returns the first axial frequency of a bar of the same length \[Hz\].
    pub fn bar_frequency(&self) -> f64 {
        let speed = (self.material.elastic.youngs_modulus / self.material.density).sqrt();
        speed / (2.0 * self.length())
    }

    /// Estimates the mass \[kg\] to some percent. The arms are one stub, one gap and the lap, at full depth.
    pub fn rough_mass(&self) -> f64 {
        let frame = (self.leaf_thickness + self.window_length + self.wall_thickness)
            * self.frame_height
            - self.window_length * self.window_height;
        let arms = (self.stub_length + self.gap_length + self.lap_length) * self.arm_height;
        let area = self.block_length * self.block_height + frame + arms;
        area * self.depth * self.material.density
    }
}

impl Resonator {
    /// Returns the array of contact elements.
    pub fn contact_array(&self) -> ContactArray {
        let middle = [self.lap_cells / 2; 2];
        let all = (0..self.lap_cells).flat_map(|i| (0..self.lap_cells).map(move |j| [i, j]));
        ContactArray {
            size: [self.lap_length, self.arm_height],
            counts: [self.lap_cells; 2],
            absent: all.filter(|&cell| in_staircase(cell, middle)).collect(),
        }
    }

    /// Returns the thicknesses of the layers of cells on either side of the contact plane, from the contact on \[m\].
    pub fn layers(&self) -> Vec<f64> {
        vec![0.5 * self.depth / self.half_depth_cells as f64; self.half_depth_cells]
    }

    /// Makes the mesh of the resonator and computes the reduced model. The reduced model has the lowest `modes` elastic
    /// modes and the residual of the higher modes.
    ///
    /// # Errors
    /// [`StructureError`] for invalid dimensions, and errors of the reduction.
    pub fn reduce(
        &self,
        modes: usize,
        at: ContactPorts,
    ) -> Result<(ReducedStructure, Outline), StructureError> {
        let ResonatorMesh {
            mesh,
            contacts,
            points,
        } = self.mesh()?;
        let system = System::assemble(&mesh, Formulation::IncompatibleModes, &[])?;
        let lines = self.outline(&mesh);
        let shown: Vec<usize> = lines.iter().flat_map(|line| line.nodes.clone()).collect();
        let positions = shown.iter().map(|&node| mesh.nodes[node]).collect();
        let ports = Ports::new(&contacts, &points, at);
        let options = ModeOptions::new(modes);
        let (reduced, shapes) = reduction::reduce_with_shapes(&system, ports, &shown, &options)?;
        let outline = Outline {
            lines: lines
                .iter()
                .map(|line| (name_of_part(line.part).to_owned(), line.nodes.len()))
                .collect(),
            positions,
            shapes,
        };
        Ok((reduced, outline))
    }

    /// Returns the outline of the mesh without the many small lines of the hole and the shank.
    fn outline(&self, mesh: &Mesh) -> Vec<Line> {
        let [x, y] = self.contact_array().sides();
        // Half the width of the hole in cells (2.5), plus half a cell for rounding.
        let reach = HOLE_HALF_WIDTHS[0] as f64 + 1.0;
        let in_hole = |&node: &usize| {
            let [at_x, at_y, _] = mesh.nodes[node];
            at_x.abs() < reach * x && at_y.abs() < reach * y
        };
        let mut lines = mesh.outline();
        lines.retain(|line| !line.nodes.iter().all(in_hole));
        lines
    }

    /// Checks whether the resonator can be meshed.
    ///
    /// # Errors
    /// [`StructureError`] with the name of the first invalid dimension or count.
    pub fn check(&self) -> Result<(), StructureError> {
        element::check(&self.material)?;
        for (name, value) in [
            ("lap_length", self.lap_length),
            ("arm_height", self.arm_height),
            ("depth", self.depth),
            ("stub_length", self.stub_length),
            ("gap_length", self.gap_length),
            ("block_length", self.block_length),
            ("leaf_thickness", self.leaf_thickness),
            ("window_length", self.window_length),
            ("wall_thickness", self.wall_thickness),
            ("head_thickness", self.head_thickness),
            ("bolt_modulus_factor", self.bolt_modulus_factor),
        ] {
            if !(value > 0.0 && value.is_finite()) {
                return Err(StructureError::OutOfRange {
                    name,
                    value,
                    expected: "positive",
                });
            }
        }
        let above = |name, value: f64, other, other_value: f64| {
            if value > other_value && value.is_finite() {
                return Ok(());
            }
            Err(StructureError::Contradiction {
                name,
                value,
                other,
                other_value,
                expected: "the first must be the larger",
            })
        };
        let (window, frame) = (self.window_height, self.frame_height);
        above("window_height", window, "arm_height", self.arm_height)?;
        above("frame_height", frame, "window_height", window)?;
        above("block_height", self.block_height, "window_height", window)?;
        for (name, count) in [
            ("half_depth_cells", self.half_depth_cells),
            ("block_cells", self.block_cells),
            ("stub_cells", self.stub_cells),
            ("gap_cells", self.gap_cells),
            ("leaf_cells", self.leaf_cells),
            ("window_cells", self.window_cells),
            ("wall_cells", self.wall_cells),
            ("inner_cells", self.inner_cells),
            ("rim_cells", self.rim_cells),
            ("head_cells", self.head_cells),
        ] {
            if count == 0 {
                return Err(StructureError::OutOfRange {
                    name,
                    value: 0.0,
                    expected: "at least 1",
                });
            }
        }
        if self.lap_cells.is_multiple_of(2) || self.lap_cells < 2 * HEAD_HALF_WIDTH + 1 {
            return Err(StructureError::OutOfRange {
                name: "lap_cells",
                value: self.lap_cells as f64,
                expected: "an odd number, at least the 9 cells of a bolt head",
            });
        }
        Ok(())
    }

    /// Returns the number of cells of the box around the mesh. The mesh has at most as many cells as the box.
    pub fn box_cells(&self) -> f64 {
        let along_x = self.block_cells
            + 2 * (self.stub_cells + self.gap_cells)
            + self.lap_cells
            + self.leaf_cells
            + self.window_cells
            + self.wall_cells;
        let along_y = 2 * (self.rim_cells + self.inner_cells) + self.lap_cells;
        let along_z = 2 * (self.head_cells + self.half_depth_cells);
        along_x as f64 * along_y as f64 * along_z as f64
    }
}

/// Returns the name of a part of the mesh.
fn name_of_part(part: usize) -> &'static str {
    match part {
        MASS_1 => "mass_1",
        BOLT => "bolt",
        _ => "mass_2",
    }
}
