//! What a mesh of hexahedra has of the compliance of a half space.
//!
//! A structure's mesh of finite length under the contact plane gives less between the nodes there than the body itself: a patch of
//! one element has some half of the compliance that it has on a half space. Where a half space stands for what the mesh cannot
//! resolve, that of the mesh itself must be taken from it. Here it is that of a half space cut into layers of equal boxes, with one
//! node after the other along x and y: under waves exp(i(k_x x + k_y y)) a layer is a matrix between the three displacements
//! above it and the three below, and the compliance of the face follows by eliminating layer after layer from the ground up.

use std::f64::consts::TAU;

use super::StructureError;
use super::element::{CORNERS, Formulation, invert, matrices};
use crate::material::{Elastic, Material};

/// Waves along each axis of the smaller of the two periodic faces, in parts of the nodes asked for: what extrapolation leaves of the faces
/// beyond is then below a hundredth of the displacement at the farthest node.
const WAVES_PER_NODE: usize = 8;
/// The least of them.
const LEAST_WAVES: usize = 64;
/// Depth of the ground below the face in periods of the larger one: the longest wave has died down to exp(−2π · this).
const DEPTH: f64 = 1.5;
/// Growth of the layers below those that are given.
const GROWTH: f64 = 1.3;

/// Displacement of nodes on the face of a half space under a force on one of them, by the whole number of nodes between the two
/// along x and y: `[i * (reach[1] + 1) + j]`, both from 0 \[m/N\]. Where i or j is negative, `xy` has the sign of i·j.
#[derive(Debug, Clone, PartialEq)]
pub struct FaceCompliance {
    /// Largest numbers of nodes between.
    pub reach: [usize; 2],
    /// Normal under normal.
    pub zz: Vec<f64>,
    /// Along x under x.
    pub xx: Vec<f64>,
    /// Along y under y.
    pub yy: Vec<f64>,
    /// Along x under y, and along y under x.
    pub xy: Vec<f64>,
}

impl FaceCompliance {
    /// Of a half space of boxes of this `formulation` with `sides` along x and y \[m\] and the thickness `layers` from the face on \[m\]; below them layers
    /// grow, down to where nothing moves any more.
    ///
    /// # Errors
    /// [`StructureError::OutOfRange`] for a length that is none, and a material that is none.
    pub fn new(
        elastic: Elastic,
        sides: [f64; 2],
        layers: &[f64],
        reach: [usize; 2],
        formulation: Formulation,
    ) -> Result<FaceCompliance, StructureError> {
        for (name, lengths) in [
            ("a side of the mesh", &sides[..]),
            ("a layer of the mesh", layers),
        ] {
            let wrong = lengths.iter().find(|l| !(**l > 0.0 && l.is_finite()));
            if let Some(&value) = wrong {
                return Err(StructureError::OutOfRange {
                    name,
                    value,
                    expected: "positive",
                });
            }
        }
        let waves = LEAST_WAVES.max(WAVES_PER_NODE * (reach[0].max(reach[1]) + 1));
        let depth = DEPTH * 2.0 * waves as f64 * sides[0].max(sides[1]);
        let layers = Layers::new(elastic, sides, layers, depth, formulation)?;
        let near = layers.periodic(waves, reach);
        let far = layers.periodic(2 * waves, reach);
        // The faces beyond the first period, and the mean that is taken as zero, displace the first one by a constant over the
        // period; what is left falls with its cube.
        let extrapolated = |near: &[f64], far: &[f64]| -> Vec<f64> {
            far.iter().zip(near).map(|(f, n)| 2.0 * f - n).collect()
        };
        let [zz, xx, yy, xy] = std::array::from_fn(|k| extrapolated(&near[k], &far[k]));
        Ok(FaceCompliance {
            reach,
            zz,
            xx,
            yy,
            xy,
        })
    }

    /// Adds that of another body, whose nodes are the same.
    ///
    /// # Panics
    /// For another reach.
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

    /// The matrices zz, xx, yy, xy between all nodes of a mesh of `reach` boxes, `nodes × nodes` row by row; node (i, j) is number
    /// `i * (reach[1] + 1) + j`.
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

/// Steps between two corners of a box along x and y.
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

/// The stiffness of a layer between its sides 0 (lower) and 1 (upper), summed over the pairs of corners a step apart:
/// `[side][other side][step]`.
type Layer = [[[Block; 9]; 2]; 2];

/// The layers, from the face down.
struct Layers {
    layers: Vec<Layer>,
}

impl Layers {
    fn new(
        elastic: Elastic,
        sides: [f64; 2],
        given: &[f64],
        depth: f64,
        formulation: Formulation,
    ) -> Result<Layers, StructureError> {
        let mut layers = given.to_vec();
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
        let of_layer = |(number, &thickness): (usize, &f64)| {
            let size = [sides[0], sides[1], thickness];
            let nodes = CORNERS.map(|c| [0, 1, 2].map(|a| 0.5 * c[a] * size[a]));
            let found = matrices(&nodes, &material, formulation, number)?;
            Ok(layer(&found.stiffness))
        };
        let layers = layers.iter().enumerate().map(of_layer);
        Ok(Layers {
            layers: layers.collect::<Result<_, StructureError>>()?,
        })
    }

    /// The compliances zz, xx, yy, xy of a face that repeats itself after `waves` nodes along both axes, its mean taken as zero.
    fn periodic(&self, waves: usize, reach: [usize; 2]) -> [Vec<f64>; 4] {
        let half = waves / 2;
        let size = (reach[0] + 1) * (reach[1] + 1);
        let mut found: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; size]);
        let turn = TAU / waves as f64;
        // Waves that run the other way along an axis are mirror images: even in zz, xx and yy, odd in xy.
        let weight = |m: usize| if m == 0 || m == half { 1.0 } else { 2.0 };
        let norm = ((waves * waves) as f64).recip();
        for m in 0..=half {
            // Sums along y first: one row of offsets for each wave along x.
            let mut of_wave: [Vec<f64>; 4] = std::array::from_fn(|_| vec![0.0; reach[1] + 1]);
            for n in 0..=half {
                if m == 0 && n == 0 {
                    continue;
                }
                let face = self.face(turn * m as f64, turn * n as f64);
                let values = [face[2][2], face[0][0], face[1][1], face[0][1]];
                for j in 0..=reach[1] {
                    let (sine, cosine) = (turn * (n * j) as f64).sin_cos();
                    for (k, sums) in of_wave.iter_mut().enumerate() {
                        let along = if k == 3 { sine } else { cosine };
                        sums[j] += weight(n) * values[k] * along;
                    }
                }
            }
            for i in 0..=reach[0] {
                let (sine, cosine) = (turn * (m * i) as f64).sin_cos();
                for (k, sums) in of_wave.iter().enumerate() {
                    // exp(i k·r) of two odd factors is −sin sin.
                    let along = if k == 3 { -sine } else { cosine };
                    let row = &mut found[k][i * (reach[1] + 1)..][..reach[1] + 1];
                    for (value, sum) in row.iter_mut().zip(sums) {
                        *value += norm * weight(m) * along * sum;
                    }
                }
            }
        }
        found
    }

    /// The compliance of the face per node under waves that turn by `x` and `y` from node to node. Displacements in the plane are
    /// counted a quarter wave ahead, which makes all numbers real.
    fn face(&self, x: f64, y: f64) -> Block {
        let phases = STEPS.map(|step| (step[0] * x + step[1] * y).sin_cos());
        let of_waves = |blocks: &[Block; 9]| {
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
            let mut top = of_waves(&layer[1][1]);
            if let Some(below) = stiffness {
                let mut bottom = of_waves(&layer[0][0]);
                add(&mut bottom, 1.0, &below);
                let (_, inverse) = invert(&bottom);
                let [up, down] = [&layer[0][1], &layer[1][0]].map(of_waves);
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
