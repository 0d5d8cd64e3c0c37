//! Solid elements of imported meshes: hexahedra, wedges and tetrahedra, linear and quadratic. The nodes have the
//! order of Abaqus and CalculiX.

pub use crate::material::{Elastic, Material};
use crate::structure::StructureError;
use crate::structure::element::{self, CORNERS, Formulation, invert};

/// Type of a solid element.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solid {
    /// Eight nodes.
    Hexahedron8(Formulation),
    /// Hexahedron with twenty nodes. The corners come first, then the midpoints of the lower, upper and vertical edges.
    /// The stiffness has 27 integration points, or 8 if `reduced`.
    Hexahedron20 {
        /// True if the stiffness has 8 integration points.
        reduced: bool,
    },
    /// Six nodes: a triangle below, then the triangle above.
    Wedge6,
    /// Wedge with fifteen nodes. The corners come first, then the midpoints of the lower, upper and vertical edges.
    Wedge15,
    /// Four nodes.
    Tetrahedron4,
    /// Ten nodes: corners, then the midpoints of the edges.
    Tetrahedron10,
}

/// Names of the element types in Abaqus and CalculiX.
pub const NAMES: [(&str, Solid); 8] = [
    ("C3D8", Solid::Hexahedron8(Formulation::Plain)),
    ("C3D8I", Solid::Hexahedron8(Formulation::IncompatibleModes)),
    ("C3D20", Solid::Hexahedron20 { reduced: false }),
    ("C3D20R", Solid::Hexahedron20 { reduced: true }),
    ("C3D6", Solid::Wedge6),
    ("C3D15", Solid::Wedge15),
    ("C3D4", Solid::Tetrahedron4),
    ("C3D10", Solid::Tetrahedron10),
];

/// Edges of a hexahedron, as pairs of corners. The midpoints of the edges of a hexahedron are nodes 9 to 20.
const EDGES: [[usize; 2]; 12] = [
    [0, 1],
    [1, 2],
    [2, 3],
    [3, 0],
    [4, 5],
    [5, 6],
    [6, 7],
    [7, 4],
    [0, 4],
    [1, 5],
    [2, 6],
    [3, 7],
];
/// Edges of a wedge, as pairs of corners. The midpoints of the edges of a wedge are nodes 7 to 15.
const WEDGE_EDGES: [[usize; 2]; 9] = [
    [0, 1],
    [1, 2],
    [2, 0],
    [3, 4],
    [4, 5],
    [5, 3],
    [0, 3],
    [1, 4],
    [2, 5],
];
/// Edges of a tetrahedron, as pairs of corners. The midpoints of the edges of a tetrahedron are nodes 5 to 10.
const TETRAHEDRON_EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];
/// Corners of the faces S1 to S6 of a hexahedron.
pub const FACES: [[usize; 4]; 6] = [
    [0, 1, 2, 3],
    [4, 7, 6, 5],
    [0, 4, 5, 1],
    [1, 5, 6, 2],
    [2, 6, 7, 3],
    [3, 7, 4, 0],
];
/// Corners of the faces S1 to S4 of a tetrahedron.
const TETRAHEDRON_FACES: [[usize; 3]; 4] = [[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];

/// Corners of the faces S1 to S5 of a wedge.
const WEDGE_FACES: [&[usize]; 5] = [
    &[0, 1, 2],
    &[3, 5, 4],
    &[0, 3, 4, 1],
    &[1, 4, 5, 2],
    &[2, 5, 3, 0],
];

/// Integration point in natural coordinates, and its weight.
type Station = ([f64; 3], f64);

/// Stiffness and mass of a solid element.
#[derive(Debug, Clone, PartialEq)]
pub struct SolidMatrices {
    /// Force over displacement, row by row, symmetric. Degree of freedom 3·n + a is node n along axis a.
    pub stiffness: Vec<f64>,
    /// Consistent mass between nodes, equal along each axis, row by row.
    pub mass: Vec<f64>,
}

impl Solid {
    /// Returns the number of nodes.
    pub fn nodes(self) -> usize {
        match self {
            Solid::Hexahedron8(_) => 8,
            Solid::Hexahedron20 { .. } => 20,
            Solid::Wedge6 => 6,
            Solid::Wedge15 => 15,
            Solid::Tetrahedron4 => 4,
            Solid::Tetrahedron10 => 10,
        }
    }

    /// Returns the corners of all faces, in order around each face.
    pub fn corners_of_faces(self) -> Vec<Vec<usize>> {
        match self {
            Solid::Hexahedron8(_) | Solid::Hexahedron20 { .. } => {
                FACES.iter().map(|face| face.to_vec()).collect()
            }
            Solid::Wedge6 | Solid::Wedge15 => {
                WEDGE_FACES.iter().map(|face| face.to_vec()).collect()
            }
            Solid::Tetrahedron4 | Solid::Tetrahedron10 => {
                TETRAHEDRON_FACES.iter().map(|face| face.to_vec()).collect()
            }
        }
    }

    /// Returns the natural coordinates of the corners.
    pub(super) fn natural_corners(self) -> Vec<[f64; 3]> {
        match self {
            Solid::Hexahedron8(_) | Solid::Hexahedron20 { .. } => CORNERS.to_vec(),
            Solid::Wedge6 | Solid::Wedge15 => [-1.0, 1.0]
                .into_iter()
                .flat_map(|z| [[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z]])
                .collect(),
            Solid::Tetrahedron4 | Solid::Tetrahedron10 => {
                vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            }
        }
    }

    /// Returns the nodes of a face: its corners, then the midpoints of its edges. Face S1 has number 0.
    pub fn face(self, number: usize) -> Option<Vec<usize>> {
        let mut nodes = self.corners_of_faces().into_iter().nth(number)?;
        let (edges, first) = match self {
            Solid::Hexahedron8(_) | Solid::Hexahedron20 { .. } => (&EDGES[..], 8),
            Solid::Wedge6 | Solid::Wedge15 => (&WEDGE_EDGES[..], 6),
            Solid::Tetrahedron4 | Solid::Tetrahedron10 => (&TETRAHEDRON_EDGES[..], 4),
        };
        for (middle, edge) in (first..self.nodes()).zip(edges) {
            if edge.iter().all(|end| nodes.contains(end)) {
                nodes.push(middle);
            }
        }
        Some(nodes)
    }

    /// Computes the stiffness and the consistent mass of an element from the positions `nodes`, in the units of
    /// coordinates and material. The error reports the number `element`.
    ///
    /// # Errors
    /// [`StructureError::InvertedElement`] if the Jacobian is not positive at an integration point.
    ///
    /// # Panics
    /// If the number of nodes is wrong.
    pub fn matrices(
        self,
        nodes: &[[f64; 3]],
        material: &Material,
        element: usize,
    ) -> Result<SolidMatrices, StructureError> {
        if let Solid::Hexahedron8(formulation) = self {
            let nodes = nodes.try_into().expect("eight nodes");
            let plain = element::matrices(nodes, material, formulation, element)?;
            return Ok(SolidMatrices {
                stiffness: plain.stiffness.concat(),
                mass: plain.mass.concat(),
            });
        }
        let count = self.nodes();
        let ratio = material.elastic.poisson_ratio;
        let shear = material.elastic.shear_modulus();
        let lame = 2.0 * shear * ratio / (1.0 - 2.0 * ratio);
        let mut stiffness = vec![0.0; 9 * count * count];
        for (point, weight) in self.stations() {
            let (_, derivatives) = self.shape(point);
            let (determinant, inverse) = jacobian(nodes, &derivatives);
            positive(determinant, element)?;
            let gradients: Vec<[f64; 3]> = (derivatives.iter())
                .map(|d| [0, 1, 2].map(|a| (0..3).map(|m| inverse[m][a] * d[m]).sum()))
                .collect();
            let volume = determinant * weight;
            for (p, gp) in gradients.iter().enumerate() {
                for (q, gq) in gradients.iter().enumerate() {
                    let dot = gp[0] * gq[0] + gp[1] * gq[1] + gp[2] * gq[2];
                    for a in 0..3 {
                        for b in 0..3 {
                            let diagonal = if a == b { shear * dot } else { 0.0 };
                            stiffness[(3 * p + a) * 3 * count + 3 * q + b] +=
                                volume * (lame * gp[a] * gq[b] + shear * gp[b] * gq[a] + diagonal);
                        }
                    }
                }
            }
        }
        let mut mass = vec![0.0; count * count];
        for (point, weight) in self.mass_stations() {
            let (shape, derivatives) = self.shape(point);
            let (determinant, _) = jacobian(nodes, &derivatives);
            positive(determinant, element)?;
            let share = material.density * determinant * weight;
            for p in 0..count {
                for q in 0..count {
                    mass[p * count + q] += share * shape[p] * shape[q];
                }
            }
        }
        Ok(SolidMatrices { stiffness, mass })
    }

    /// Returns the shape functions at a natural point, and their derivatives with respect to the natural coordinates.
    pub(super) fn shape(self, point: [f64; 3]) -> (Vec<f64>, Vec<[f64; 3]>) {
        match self {
            Solid::Hexahedron8(_) => (
                element::shape(point).to_vec(),
                element::shape_derivatives(point).to_vec(),
            ),
            Solid::Hexahedron20 { .. } => serendipity(point),
            Solid::Wedge6 | Solid::Wedge15 => wedge(point, self == Solid::Wedge15),
            Solid::Tetrahedron4 => {
                let (volume, slopes) = barycentric(point);
                (volume.to_vec(), slopes.to_vec())
            }
            Solid::Tetrahedron10 => {
                let (l, slopes) = barycentric(point);
                let corners = (0..4).map(|n| {
                    let factor = 4.0 * l[n] - 1.0;
                    (l[n] * (2.0 * l[n] - 1.0), slopes[n].map(|s| factor * s))
                });
                let middles = TETRAHEDRON_EDGES.iter().map(|&[i, j]| {
                    let slope =
                        [0, 1, 2].map(|m| 4.0 * (l[i] * slopes[j][m] + l[j] * slopes[i][m]));
                    (4.0 * l[i] * l[j], slope)
                });
                corners.chain(middles).unzip()
            }
        }
    }

    /// Returns the integration points of the stiffness.
    fn stations(self) -> Vec<Station> {
        match self {
            Solid::Hexahedron8(_) | Solid::Hexahedron20 { reduced: true } => cube(&GAUSS_2),
            Solid::Hexahedron20 { reduced: false } => cube(&GAUSS_3),
            Solid::Wedge6 => prism(&[([1.0 / 3.0; 2], 0.5)], &GAUSS_2),
            Solid::Wedge15 => prism(&TRIANGLE_3, &GAUSS_3),
            Solid::Tetrahedron4 => vec![([0.25; 3], 1.0 / 6.0)],
            Solid::Tetrahedron10 => {
                // Four points, exact for quadratic polynomials.
                let near = (5.0 - 5.0_f64.sqrt()) / 20.0;
                let far = 1.0 - 3.0 * near;
                let mut points = vec![([near; 3], 1.0 / 24.0)];
                for axis in 0..3 {
                    let mut point = [near; 3];
                    point[axis] = far;
                    points.push((point, 1.0 / 24.0));
                }
                points
            }
        }
    }

    /// Returns the integration points of the mass, which are exact for elements with straight edges.
    fn mass_stations(self) -> Vec<Station> {
        match self {
            Solid::Hexahedron8(_) => cube(&GAUSS_2),
            Solid::Hexahedron20 { .. } => cube(&GAUSS_3),
            // Integration over a square collapsed to a triangle, exact for polynomials of the sixth degree.
            Solid::Wedge6 | Solid::Wedge15 => {
                let all = cube(&GAUSS_4).into_iter();
                all.map(|([u, v, z], weight)| {
                    let [u, v] = [u, v].map(|x| 0.5 * (1.0 + x));
                    ([u, v * (1.0 - u), z], 0.25 * weight * (1.0 - u))
                })
                .collect()
            }
            // Integration over a cube collapsed to a tetrahedron, exact for polynomials of the fifth degree.
            Solid::Tetrahedron4 | Solid::Tetrahedron10 => {
                let all = cube(&GAUSS_4).into_iter();
                all.map(|(point, weight)| {
                    let [u, v, w] = point.map(|x| 0.5 * (1.0 + x));
                    let at = [u, v * (1.0 - u), w * (1.0 - u) * (1.0 - v)];
                    (at, 0.125 * weight * (1.0 - u).powi(2) * (1.0 - v))
                })
                .collect()
            }
        }
    }
}

fn positive(determinant: f64, element: usize) -> Result<(), StructureError> {
    // The test `determinant > 0.0` rejects NaN, which the test `determinant <= 0.0` would accept.
    match determinant > 0.0 {
        true => Ok(()),
        false => Err(StructureError::InvertedElement {
            element,
            jacobian: determinant,
        }),
    }
}

/// Returns the determinant and the inverse of ∂x/∂ξ.
fn jacobian(nodes: &[[f64; 3]], derivatives: &[[f64; 3]]) -> (f64, [[f64; 3]; 3]) {
    let mut jacobian = [[0.0; 3]; 3];
    for (x, d) in nodes.iter().zip(derivatives) {
        for a in 0..3 {
            for m in 0..3 {
                jacobian[a][m] += x[a] * d[m];
            }
        }
    }
    invert(&jacobian)
}

/// Returns the barycentric coordinates of a point, and the derivatives of the coordinates. The tetrahedron has the
/// corners 0, x, y, z.
fn barycentric([x, y, z]: [f64; 3]) -> ([f64; 4], [[f64; 3]; 4]) {
    (
        [1.0 - x - y - z, x, y, z],
        [[-1.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
    )
}

/// Returns the shape functions and derivatives of the hexahedron with nodes at the corners and edge midpoints.
fn serendipity(point: [f64; 3]) -> (Vec<f64>, Vec<[f64; 3]>) {
    let corners = CORNERS.iter().map(|c| {
        let factor = [0, 1, 2].map(|m| 1.0 + c[m] * point[m]);
        let sum: f64 = (0..3).map(|m| c[m] * point[m]).sum::<f64>() - 2.0;
        let product = factor[0] * factor[1] * factor[2];
        let slope = [0, 1, 2].map(|m| {
            let others = product_of_others(factor, m);
            0.125 * c[m] * others * (sum + factor[m])
        });
        (0.125 * product * sum, slope)
    });
    let middles = EDGES.iter().map(|&[i, j]| {
        let along = (0..3)
            .find(|&m| CORNERS[i][m] != CORNERS[j][m])
            .expect("an edge");
        // The function is a bubble along its edge and linear across it.
        let factor = [0, 1, 2].map(|m| match m == along {
            true => 1.0 - point[m] * point[m],
            false => 1.0 + CORNERS[i][m] * point[m],
        });
        let slope = [0, 1, 2].map(|m| {
            let derivative = if m == along {
                -2.0 * point[m]
            } else {
                CORNERS[i][m]
            };
            0.25 * derivative * product_of_others(factor, m)
        });
        (0.25 * factor[0] * factor[1] * factor[2], slope)
    });
    corners.chain(middles).unzip()
}

/// Returns the shape functions of the wedge and their derivatives. The base of the wedge is the triangle 0, x, y, and z
/// is from −1 to 1. If `is_quadratic`, the wedge also has nodes at the midpoints of its edges.
fn wedge([x, y, z]: [f64; 3], is_quadratic: bool) -> (Vec<f64>, Vec<[f64; 3]>) {
    let l = [1.0 - x - y, x, y];
    const SLOPES: [[f64; 2]; 3] = [[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]];
    // Product of a function on the triangle and a function of z, with its derivatives.
    let product =
        |(f, [fx, fy]): (f64, [f64; 2]), (g, gz): (f64, f64)| (f * g, [fx * g, fy * g, f * gz]);
    let scaled_slope = |n: usize, factor: f64| SLOPES[n].map(|s| factor * s);
    let side = |sign: f64| (0.5 * (1.0 + sign * z), 0.5 * sign);
    let bubble = (1.0 - z * z, -2.0 * z);
    let corners = [-1.0, 1.0].into_iter().flat_map(|sign| {
        (0..3).map(move |n| {
            let linear = product((l[n], scaled_slope(n, 1.0)), side(sign));
            if !is_quadratic {
                return linear;
            }
            // The function must be zero at the midpoints of the three edges, so their share is subtracted.
            let square = (l[n] * (2.0 * l[n] - 1.0), scaled_slope(n, 4.0 * l[n] - 1.0));
            let (value, slope) = product(square, side(sign));
            let (midpoint_value, midpoint_slope) =
                product((0.5 * l[n], scaled_slope(n, 0.5)), bubble);
            (
                value - midpoint_value,
                [0, 1, 2].map(|m| slope[m] - midpoint_slope[m]),
            )
        })
    });
    let corners: Vec<(f64, [f64; 3])> = corners.collect();
    if !is_quadratic {
        return corners.into_iter().unzip();
    }
    let middles = WEDGE_EDGES.iter().map(|&[a, b]| {
        let (i, j) = (a % 3, b % 3);
        match i == j {
            true => product((l[i], scaled_slope(i, 1.0)), bubble),
            false => {
                let slope = [0, 1].map(|m| 4.0 * (l[i] * SLOPES[j][m] + l[j] * SLOPES[i][m]));
                product(
                    (4.0 * l[i] * l[j], slope),
                    side(if a < 3 { -1.0 } else { 1.0 }),
                )
            }
        }
    });
    let middles: Vec<(f64, [f64; 3])> = middles.collect();
    corners.into_iter().chain(middles).unzip()
}

fn product_of_others(factor: [f64; 3], m: usize) -> f64 {
    factor[(m + 1) % 3] * factor[(m + 2) % 3]
}

/// Gauss–Legendre points and weights on −1…1 (Abramowitz and Stegun, table 25.4).
const GAUSS_2: [(f64, f64); 2] = [
    (-0.577_350_269_189_625_8, 1.0),
    (0.577_350_269_189_625_8, 1.0),
];
const GAUSS_3: [(f64, f64); 3] = [
    (-0.774_596_669_241_483_4, 5.0 / 9.0),
    (0.0, 8.0 / 9.0),
    (0.774_596_669_241_483_4, 5.0 / 9.0),
];
const GAUSS_4: [(f64, f64); 4] = [
    (-0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
    (-0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.339_981_043_584_856_26, 0.652_145_154_862_546_1),
    (0.861_136_311_594_052_6, 0.347_854_845_137_453_85),
];

/// Integration points and weights on the triangle with the corners 0, x, y. The integration is exact for quadratic
/// polynomials.
const TRIANGLE_3: [([f64; 2], f64); 3] = [
    ([1.0 / 6.0, 1.0 / 6.0], 1.0 / 6.0),
    ([2.0 / 3.0, 1.0 / 6.0], 1.0 / 6.0),
    ([1.0 / 6.0, 2.0 / 3.0], 1.0 / 6.0),
];

/// Returns the product of a rule on the triangle and a rule along z.
fn prism(triangle: &[([f64; 2], f64)], along: &[(f64, f64)]) -> Vec<Station> {
    let at = |&([x, y], weight): &([f64; 2], f64)| {
        let stations = along.iter().map(move |&(z, w)| ([x, y, z], weight * w));
        stations.collect::<Vec<Station>>()
    };
    triangle.iter().flat_map(at).collect()
}

/// Returns the product rule along three axes.
fn cube(rule: &[(f64, f64)]) -> Vec<Station> {
    let mut points = Vec::with_capacity(rule.len().pow(3));
    for &(x, wx) in rule {
        for &(y, wy) in rule {
            for &(z, wz) in rule {
                points.push(([x, y, z], wx * wy * wz));
            }
        }
    }
    points
}
