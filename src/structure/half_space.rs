//! Compliance of a half space that is meshed with hexahedra.
//!
//! A finite-element mesh under the contact plane is less compliant between neighbouring nodes than the body itself. A
//! patch of one element has about half of its compliance on a half space. Where a half space replaces the local part
//! of the mesh, the compliance of the mesh must be subtracted.
//!
//! This module computes the compliance of a half space that consists of layers of equal boxes. The nodes form a regular
//! grid along x and y. For a wave exp(i(k_x x + k_y y)), the stiffness of a layer is a small matrix. The matrix couples
//! the three displacements above the layer to the three displacements below the layer. The compliance of the face
//! follows by eliminating the layers from the bottom up.

use std::f64::consts::TAU;

use super::StructureError;
use super::element::{CORNERS, Formulation, invert, matrices};
use crate::material::{Elastic, Material};

/// Depth below the face in periods of the larger periodic face. The longest wave has decayed to exp(−2π · DEPTH).
const DEPTH: f64 = 1.5;
/// Growth factor of the layers below the given ones.
const GROWTH: f64 = 1.3;

/// Resolution of the periodic faces that a half space is computed from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct FaceResolution {
    /// Waves along each axis of the smaller of the two periodic faces, per requested node. The error of the extrapolation
    /// to an infinite period is then below a hundredth of the displacement at the farthest node.
    pub waves_per_node: usize,
    /// Smallest number of waves.
    pub least_waves: usize,
}

impl Default for FaceResolution {
    fn default() -> Self {
        FaceResolution {
            waves_per_node: 8,
            least_waves: 64,
        }
    }
}

/// Displacements of nodes on the face of a half space under a unit force on one node \[m/N\].
///
/// The entry `[i * (reach[1] + 1) + j]` is for two nodes that are i boxes apart along x and j boxes apart along y. If i
/// or j is negative, `xy` is multiplied by the sign of i·j.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceCompliance {
    /// Largest distances between nodes along x and y, in nodes.
    pub reach: [usize; 2],
    /// Normal displacement under a normal force.
    pub zz: Vec<f64>,
    /// Displacement along x under a force along x.
    pub xx: Vec<f64>,
    /// Displacement along y under a force along y.
    pub yy: Vec<f64>,
    /// Displacement along x under a force along y, and vice versa.
    pub xy: Vec<f64>,
}

impl FaceCompliance {
    /// Computes the compliance of a half space of boxes.
    ///
    /// `sides` are the sides of a box along x and y \[m\]. `layers` are the thicknesses of the layers from the face
    /// down \[m\]. Below `layers`, the function adds thicker layers, down to a depth where the displacements have
    /// decayed.
    ///
    /// # Errors
    /// [`StructureError::OutOfRange`] if a length is not positive and finite.
    pub fn of_layered_half_space(
        elastic: Elastic,
        sides: [f64; 2],
        layers: &[f64],
        reach: [usize; 2],
        formulation: Formulation,
        resolution: FaceResolution,
    ) -> Result<FaceCompliance, StructureError> {
        for (name, lengths) in [
            ("a side of the mesh", &sides[..]),
            ("a layer of the mesh", layers),
        ] {
            let invalid = lengths.iter().find(|l| !(**l > 0.0 && l.is_finite()));
            if let Some(&value) = invalid {
                return Err(StructureError::OutOfRange {
                    name,
                    value,
                    expected: "positive",
                });
            }
        }
        let waves = resolution
            .least_waves
            .max(resolution.waves_per_node * (reach[0].max(reach[1]) + 1));
        let depth = DEPTH * 2.0 * waves as f64 * sides[0].max(sides[1]);
        let layers = Layers::new(elastic, sides, layers, depth, formulation)?;
        let short_period = layers.periodic(waves, reach);
        let long_period = layers.periodic(2 * waves, reach);
        // The force has periodic images, and the mean displacement is set to zero. Both add to the displacements a
        // constant that is inversely proportional to the period. The other error of the displacements is inversely
        // proportional to the cube of the period.
        let extrapolate = |short_period: &[f64], long_period: &[f64]| -> Vec<f64> {
            long_period
                .iter()
                .zip(short_period)
                .map(|(f, n)| 2.0 * f - n)
                .collect()
        };
        let [zz, xx, yy, xy] =
            std::array::from_fn(|k| extrapolate(&short_period[k], &long_period[k]));
        Ok(FaceCompliance {
            reach,
            zz,
            xx,
            yy,
            xy,
        })
    }

    /// Adds the compliance of another body with the same nodes.
    ///
    /// # Panics
    /// If `reach` differs.
    pub fn add(&mut self, other: &FaceCompliance) {
        assert_eq!(self.reach, other.reach, "nodes of both bodies");
        let pairs = [
            (&mut self.zz, &other.zz),
            (&mut self.xx, &other.xx),
            (&mut self.yy, &other.yy),
            (&mut self.xy, &other.xy),
        ];
        for (own, other) in pairs {
            own.iter_mut().zip(other).for_each(|(a, b)| *a += b);
        }
    }

    /// Returns the compliance matrices zz, xx, yy and xy between all nodes of a mesh of `reach` boxes. Each matrix has
    /// `nodes × nodes` entries, row by row. Node (i, j) has the number `i * (reach[1] + 1) + j`.
    pub fn matrices(&self) -> [Vec<f64>; 4] {
        let width = self.reach[1] + 1;
        let nodes = (self.reach[0] + 1) * width;
        let at = |values: &[f64], odd: bool| -> Vec<f64> {
            let pairs = (0..nodes).flat_map(|a| (0..nodes).map(move |b| (a, b)));
            pairs
                .map(|(a, b)| {
                    let ((i, j), (m, n)) = ((a / width, a % width), (b / width, b % width));
                    let value = values[i.abs_diff(m) * width + j.abs_diff(n)];
                    match odd && (i < m) != (j < n) {
                        true => -value,
                        false => value,
                    }
                })
                .collect()
        };
        [
            at(&self.zz, false),
            at(&self.xx, false),
            at(&self.yy, false),
            at(&self.xy, true),
        ]
    }
}

type Block = [[f64; 3]; 3];

/// Steps from one corner of a box to another along x and y.
const STEPS: [[f64; 2]; 9] = [
    [-1.0, -1.0],
    [-1.0, 0.0],
    [-1.0, 1.0],
    [0.0, -1.0],
    [0.0, 0.0],
    [0.0, 1.0],
    [1.0, -1.0],
    [1.0, 0.0],
    [1.0, 1.0],
];

/// Stiffness between the lower side (0) and the upper side (1) of a layer, as `[side][other side][step]`. Entries of
/// all pairs of corners with the same step are summed.
type Layer = [[[Block; 9]; 2]; 2];

/// Layers of boxes, from the face down.
struct Layers {
    layers: Vec<Layer>,
}

impl Layers {
    fn new(
        elastic: Elastic,
        sides: [f64; 2],
        first_layers: &[f64],
        depth: f64,
        formulation: Formulation,
    ) -> Result<Layers, StructureError> {
        let mut layers = first_layers.to_vec();
        let mut below: f64 = layers.iter().sum();
        while below < depth {
            let next = GROWTH * layers.last().copied().unwrap_or(sides[0].max(sides[1]));
            below += next;
            layers.push(next);
        }
        let material = Material {
            elastic,
            density: 0.0,
        };
        let layer_stiffness = |(number, &thickness): (usize, &f64)| {
            let size = [sides[0], sides[1], thickness];
            let nodes = CORNERS.map(|c| [0, 1, 2].map(|a| 0.5 * c[a] * size[a]));
            let element_matrices = matrices(&nodes, &material, formulation, number)?;
            Ok(layer(&element_matrices.stiffness))
        };
        let layers = layers.iter().enumerate().map(layer_stiffness);
        Ok(Layers {
            layers: layers.collect::<Result<_, StructureError>>()?,
        })
    }

    /// Computes the compliances zz, xx, yy and xy of a face with a period of `waves` nodes along both axes. The mean
    /// displacement is set to zero.
    fn periodic(&self, waves: usize, reach: [usize; 2]) -> [Vec<f64>; 4] {
        let half = waves / 2;
        let size = (reach[0] + 1) * (reach[1] + 1);
        let mut compliances: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; size]);
        let turn = TAU / waves as f64;
        // Waves in the opposite direction along an axis are mirror images: even in zz, xx and yy, and odd in xy.
        let weight = |m: usize| if m == 0 || m == half { 1.0 } else { 2.0 };
        let norm = ((waves * waves) as f64).recip();
        for m in 0..=half {
            // Sums along y for one wave along x, by the distance j.
            let mut wave_sums: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; reach[1] + 1]);
            for n in 0..=half {
                if m == 0 && n == 0 {
                    continue;
                }
                let face = self.face(turn * m as f64, turn * n as f64);
                let values = [face[2][2], face[0][0], face[1][1], face[0][1]];
                for j in 0..=reach[1] {
                    let (sine, cosine) = (turn * (n * j) as f64).sin_cos();
                    for (k, sums) in wave_sums.iter_mut().enumerate() {
                        let along = if k == 3 { sine } else { cosine };
                        sums[j] += weight(n) * values[k] * along;
                    }
                }
            }
            for i in 0..=reach[0] {
                let (sine, cosine) = (turn * (m * i) as f64).sin_cos();
                for (k, sums) in wave_sums.iter().enumerate() {
                    // For xy both factors of exp(i k·r) are odd, and their product is −sin·sin.
                    let along = if k == 3 { -sine } else { cosine };
                    let row = &mut compliances[k][i * (reach[1] + 1)..][..reach[1] + 1];
                    for (value, sum) in row.iter_mut().zip(sums) {
                        *value += norm * weight(m) * along * sum;
                    }
                }
            }
        }
        compliances
    }

    /// Computes the compliance per node of the face for waves whose phase changes by `x` and `y` from node to node. A
    /// phase shift of a quarter wave for the displacements in the plane makes all numbers real.
    fn face(&self, x: f64, y: f64) -> Block {
        let phases = STEPS.map(|step| (step[0] * x + step[1] * y).sin_cos());
        let at_waves = |blocks: &[Block; 9]| {
            let mut sum = Block::default();
            for (block, (sine, cosine)) in blocks.iter().zip(phases) {
                for a in 0..3 {
                    for b in 0..3 {
                        let phase = match (a < 2, b < 2) {
                            (true, false) => sine,
                            (false, true) => -sine,
                            _ => cosine,
                        };
                        sum[a][b] += phase * block[a][b];
                    }
                }
            }
            sum
        };
        let mut stiffness: Option<Block> = None;
        for layer in self.layers.iter().rev() {
            let mut top = at_waves(&layer[1][1]);
            if let Some(below) = stiffness {
                let mut bottom = at_waves(&layer[0][0]);
                add(&mut bottom, 1.0, &below);
                let (_, inverse) = invert(&bottom);
                let [up, down] = [&layer[0][1], &layer[1][0]].map(at_waves);
                add(&mut top, -1.0, &times(&down, &times(&inverse, &up)));
            }
            stiffness = Some(top);
        }
        invert(&stiffness.unwrap_or_default()).1
    }
}

/// Sums the stiffness of a box over its pairs of corners.
fn layer(of_box: &[[f64; 24]; 24]) -> Layer {
    let mut layer = Layer::default();
    let side = |corner: [f64; 3]| usize::from(corner[2] > 0.0);
    for (p, from) in CORNERS.into_iter().enumerate() {
        for (q, to) in CORNERS.into_iter().enumerate() {
            let step = [0, 1].map(|a| 0.5 * (to[a] - from[a]));
            let number = (3.0 * step[0] + step[1] + 4.0) as usize;
            let block = &mut layer[side(from)][side(to)][number];
            for a in 0..3 {
                for b in 0..3 {
                    block[a][b] += of_box[3 * p + a][3 * q + b];
                }
            }
        }
    }
    layer
}

fn add(to: &mut Block, factor: f64, block: &Block) {
    for (row, other) in to.iter_mut().zip(block) {
        for (value, other) in row.iter_mut().zip(other) {
            *value += factor * other;
        }
    }
}

fn times(a: &Block, b: &Block) -> Block {
    a.map(|row| [0, 1, 2].map(|c| (0..3).map(|k| row[k] * b[k][c]).sum()))
}
