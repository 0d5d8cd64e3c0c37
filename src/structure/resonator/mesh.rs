//! Mesh of the resonator: cells of one grid of lines, which belong to two bodies and a bolt.

use std::collections::HashMap;

use super::Resonator;
use crate::structure::StructureError;
use crate::structure::contact_array::corners_of;
use crate::structure::mesh::{Hexahedron, Mesh, Point, corners};

/// Part number of mass 1, the body below the contact plane.
pub const MASS_1: usize = 0;
/// Part number of mass 2, the body above the contact plane.
pub const MASS_2: usize = 1;
/// Part number of the bolt.
pub const BOLT: usize = 2;

/// Names of the points at the ends of the bolt's shank.
pub const BOLT_ABOVE: &str = "bolt_above";
pub const BOLT_BELOW: &str = "bolt_below";

/// Half widths of the staircase hole in cells, from the middle row of cells outwards. The rows of the hole have widths
/// of 5, 5 and 3 cells.
pub(super) const HOLE_HALF_WIDTHS: [usize; 3] = [2, 2, 1];
/// Half width of the shank in cells. The shank has 3×3 cells.
const SHANK_HALF_WIDTH: usize = 1;
/// Half width of a bolt head in cells. The head has 9×9 cells.
pub(super) const HEAD_HALF_WIDTH: usize = 4;

/// Contact element: a pair of facing quadrilaterals.
#[derive(Debug, Clone, PartialEq)]
pub struct FacingFaces {
    /// Cell of the lap, (i, j) along x and y.
    pub cell: [usize; 2],
    /// Centre on the contact plane \[m\].
    pub centre: [f64; 2],
    /// Area \[m²\].
    pub area: f64,
    /// The four pairs of nodes, (lower, upper).
    pub pairs: [(usize, usize); 4],
}

impl FacingFaces {
    /// Returns the grid points of the four pairs of nodes in the lap, (i, j) along x and y.
    pub fn corners(&self) -> [[usize; 2]; 4] {
        corners_of(self.cell)
    }
}

/// Mesh of the resonator, with the contact elements and the points of the resonator.
#[derive(Debug, Clone, PartialEq)]
pub struct ResonatorMesh {
    /// Nodes and elements; parts are [`MASS_1`], [`MASS_2`] and [`BOLT`].
    pub mesh: Mesh,
    /// Contact elements, i along x slow and j along y fast. Empty if the joint is tied.
    pub contacts: Vec<FacingFaces>,
    /// Named points. `far_wall` is the centre of the outer face of the far wall of mass 2. `block` is the centre of the
    /// outer face of mass 1. `bolt_above` and `bolt_below` are the ends of the bolt's shank, unless the joint is tied.
    pub points: Vec<Point>,
}

/// Positions of the grid lines along one axis \[m\], built segment by segment.
struct Lines(Vec<f64>);

impl Lines {
    fn from(start: f64) -> Self {
        Lines(vec![start])
    }

    /// Adds `cells` equal cells up to `end`.
    fn to(mut self, end: f64, cells: usize) -> Self {
        let start = self.0[self.0.len() - 1];
        for c in 1..=cells {
            // The last line is exactly at `end`, so that planes of symmetry are exact.
            self.0.push(if c == cells {
                end
            } else {
                start + (end - start) * c as f64 / cells as f64
            });
        }
        self
    }
}

impl Resonator {
    /// Makes the mesh of the resonator.
    ///
    /// # Errors
    /// [`StructureError`] with the name of an invalid dimension or count.
    pub fn mesh(&self) -> Result<ResonatorMesh, StructureError> {
        self.check()?;
        let half_lap = 0.5 * self.lap_length;
        let arm_start = half_lap + self.gap_length + self.stub_length;
        let leaf_end = arm_start + self.leaf_thickness;
        let window_end = leaf_end + self.window_length;
        let half_depth = 0.5 * self.depth;
        let x = Lines::from(-arm_start - self.block_length)
            .to(-arm_start, self.block_cells)
            .to(-half_lap - self.gap_length, self.stub_cells)
            .to(-half_lap, self.gap_cells)
            .to(half_lap, self.lap_cells)
            .to(half_lap + self.gap_length, self.gap_cells)
            .to(arm_start, self.stub_cells)
            .to(leaf_end, self.leaf_cells)
            .to(window_end, self.window_cells)
            .to(window_end + self.wall_thickness, self.wall_cells);
        let heights = |full: f64| {
            let (arm, window) = (0.5 * self.arm_height, 0.5 * self.window_height);
            Lines::from(-0.5 * full)
                .to(-window, self.rim_cells)
                .to(-arm, self.inner_cells)
                .to(arm, self.lap_cells)
                .to(window, self.inner_cells)
                .to(0.5 * full, self.rim_cells)
        };
        let z = Lines::from(-half_depth - self.head_thickness)
            .to(-half_depth, self.head_cells)
            .to(0.0, self.half_depth_cells)
            .to(half_depth, self.half_depth_cells)
            .to(half_depth + self.head_thickness, self.head_cells);
        let mut bolt = self.material;
        bolt.elastic.youngs_modulus *= self.bolt_modulus_factor;
        let mut builder = Builder {
            tied: self.tied,
            x: x.0,
            // The rims of block and frame have different heights. Block and frame are connected at the arms only.
            y: [heights(self.block_height).0, heights(self.frame_height).0],
            z: z.0,
            outer: [self.head_cells, self.head_cells + 2 * self.half_depth_cells],
            contact: self.head_cells + self.half_depth_cells,
            numbers: HashMap::new(),
            mesh: Mesh {
                nodes: Vec::new(),
                elements: Vec::new(),
                materials: vec![self.material, bolt],
            },
        };

        // Ranges of cells along each axis, from the counts.
        let block = 0..self.block_cells;
        let stub_1 = block.end..block.end + self.stub_cells;
        let gap_1 = stub_1.end..stub_1.end + self.gap_cells;
        let lap = gap_1.end..gap_1.end + self.lap_cells;
        let gap_2 = lap.end..lap.end + self.gap_cells;
        let stub_2 = gap_2.end..gap_2.end + self.stub_cells;
        let leaf = stub_2.end..stub_2.end + self.leaf_cells;
        let window = leaf.end..leaf.end + self.window_cells;
        let wall = window.end..window.end + self.wall_cells;
        let inner = self.rim_cells + self.inner_cells;
        let arm = inner..inner + self.lap_cells;
        let height = 0..2 * inner + self.lap_cells;
        let below = builder.outer[0]..builder.contact;
        let above = builder.contact..builder.outer[1];
        let depth = below.start..above.end;

        let middle = [
            lap.start + self.lap_cells / 2,
            arm.start + self.lap_cells / 2,
        ];
        let in_hole = |i: usize, j: usize| in_staircase([i, j], middle);
        let within = |i: usize, j: usize, half_width: usize| {
            i.abs_diff(middle[0]) <= half_width && j.abs_diff(middle[1]) <= half_width
        };

        for i in 0..wall.end {
            for j in height.clone() {
                let in_arm = arm.contains(&j);
                let in_rim = j < self.rim_cells || j >= height.end - self.rim_cells;
                for k in 0..builder.z.len() - 1 {
                    let inside = depth.contains(&k);
                    let solid_1 = inside && block.contains(&i)
                        || inside && in_arm && stub_1.contains(&i)
                        || below.contains(&k) && in_arm && gap_1.contains(&i)
                        || below.contains(&k) && in_arm && lap.contains(&i) && !in_hole(i, j);
                    let solid_2 =
                        above.contains(&k) && in_arm && lap.contains(&i) && !in_hole(i, j)
                            || above.contains(&k) && in_arm && gap_2.contains(&i)
                            || inside && in_arm && stub_2.contains(&i)
                            || inside && leaf.contains(&i)
                            || inside && in_rim && window.contains(&i)
                            || inside && wall.contains(&i);
                    let bolt = within(
                        i,
                        j,
                        if inside {
                            SHANK_HALF_WIDTH
                        } else {
                            HEAD_HALF_WIDTH
                        },
                    );
                    if solid_1 {
                        builder.add([i, j, k], MASS_1);
                    } else if solid_2 {
                        builder.add([i, j, k], MASS_2);
                    } else if bolt {
                        builder.add([i, j, k], BOLT);
                    }
                }
            }
        }

        let mut contacts = Vec::new();
        if !self.tied {
            for i in lap.clone() {
                for j in arm.clone() {
                    if !in_hole(i, j) {
                        contacts.push(builder.facing([i, j], [lap.start, arm.start]));
                    }
                }
            }
        }
        let mut ends = Vec::new();
        if !self.tied {
            for (name, k) in [BOLT_ABOVE, BOLT_BELOW]
                .into_iter()
                .zip([builder.outer[1], builder.outer[0]])
            {
                ends.push(builder.shank_end(name, middle, k));
            }
        }
        let mesh = builder.mesh;
        let end = window_end + self.wall_thickness;
        let mut points = vec![
            mesh.point("far_wall", [end, 0.0, 0.0])?,
            mesh.point("block", [-arm_start - self.block_length, 0.0, 0.0])?,
        ];
        points.extend(ends);
        Ok(ResonatorMesh {
            mesh,
            contacts,
            points,
        })
    }
}

/// Returns true for the cells of the staircase hole around the cell `middle`.
pub(super) fn in_staircase(cell: [usize; 2], middle: [usize; 2]) -> bool {
    let widths = HOLE_HALF_WIDTHS.get(cell[1].abs_diff(middle[1]));
    widths.is_some_and(|&w| cell[0].abs_diff(middle[0]) <= w)
}

/// Builder of a mesh on a grid of lines.
struct Builder {
    tied: bool,
    x: Vec<f64>,
    /// Positions of the lines along y, for mass 1 and for mass 2.
    y: [Vec<f64>; 2],
    z: Vec<f64>,
    /// Indices of the lines along z at the two outer faces.
    outer: [usize; 2],
    /// Index of the line along z at the contact plane.
    contact: usize,
    /// Number of the node at a grid point, by the part that owns the node.
    numbers: HashMap<([usize; 3], usize), usize>,
    mesh: Mesh,
}

impl Builder {
    /// Returns the part that owns the node of `part` at a grid point. Two separate parts have two nodes at the same
    /// place.
    fn owner(&self, at: [usize; 3], part: usize) -> usize {
        match part {
            // The heads and the shank share the nodes of the masses' outer faces.
            BOLT if at[2] == self.outer[0] => MASS_1,
            BOLT if at[2] == self.outer[1] => MASS_2,
            MASS_2 if self.tied && at[2] == self.contact => MASS_1,
            own => own,
        }
    }

    fn node(&mut self, at: [usize; 3], part: usize) -> usize {
        let owner = self.owner(at, part);
        let heights = &self.y[if owner == MASS_1 { 0 } else { 1 }];
        let position = [self.x[at[0]], heights[at[1]], self.z[at[2]]];
        let nodes = &mut self.mesh.nodes;
        *self.numbers.entry((at, owner)).or_insert_with(|| {
            nodes.push(position);
            nodes.len() - 1
        })
    }

    fn add(&mut self, cell: [usize; 3], part: usize) {
        let nodes = corners(cell[0], cell[1], cell[2]).map(|at| self.node(at, part));
        self.mesh.elements.push(Hexahedron {
            nodes,
            material: usize::from(part == BOLT),
            part,
        });
    }

    /// Returns the end of the shank around the cell `middle`, at line `k` along z. The weight of each node of the end
    /// is proportional to the area of the node.
    fn shank_end(&mut self, name: &str, middle: [usize; 2], k: usize) -> Point {
        let width = 2 * SHANK_HALF_WIDTH + 1;
        let part = |n: usize| if n == 0 || n == width { 0.5 } else { 1.0 } / width as f64;
        let places = (0..=width).flat_map(|a| (0..=width).map(move |b| [a, b]));
        let weights = places
            .map(|[a, b]| {
                let at = [
                    middle[0] + a - SHANK_HALF_WIDTH,
                    middle[1] + b - SHANK_HALF_WIDTH,
                    k,
                ];
                (self.node(at, BOLT), part(a) * part(b))
            })
            .collect();
        Point {
            name: name.to_owned(),
            position: [0.0, 0.0, self.z[k]],
            weights,
        }
    }

    /// Returns the contact element at a cell of the contact plane. `first` is the first cell of the lap.
    fn facing(&mut self, cell: [usize; 2], first: [usize; 2]) -> FacingFaces {
        let [i, j] = cell;
        let (x, y) = ([self.x[i], self.x[i + 1]], [self.y[0][j], self.y[0][j + 1]]);
        FacingFaces {
            cell: [i - first[0], j - first[1]],
            centre: [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1])],
            area: (x[1] - x[0]) * (y[1] - y[0]),
            pairs: corners_of(cell).map(|[i, j]| {
                let at = [i, j, self.contact];
                (self.node(at, MASS_1), self.node(at, MASS_2))
            }),
        }
    }
}
