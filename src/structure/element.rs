//! The 8-node hexahedron, plain and with incompatible modes.
//!
//! The nodes have the order of the element `C3D8` of Abaqus and CalculiX. The first four nodes are the corners of one
//! face, counter-clockwise as seen from the opposite face. The last four nodes are the corners of the opposite face.
//! Degree of freedom 3·n + a is the displacement of node n along axis a.

use crate::material::Material;
use crate::structure::StructureError;

/// Formulation of the hexahedron.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Formulation {
    /// Trilinear displacements and 2×2×2 integration. The element locks in bending.
    Plain,
    /// The plain element with three quadratic bubbles per displacement component, condensed per element (Wilson et al.
    /// 1973). The gradients of the bubble functions use the Jacobian at the centre of the element. With this Jacobian,
    /// distorted elements pass the patch test (Taylor, Beresford, Wilson, Int. J. Numer. Methods Eng. 10, 1976).
    #[default]
    IncompatibleModes,
}

impl Formulation {
    /// Returns true for the formulation with incompatible modes.
    pub fn has_incompatible_modes(&self) -> bool {
        *self == Formulation::IncompatibleModes
    }
}

/// Rejects a material that is no elastic solid.
///
/// # Errors
/// [`StructureError::OutOfRange`] with the name of the constant.
pub fn check(material: &Material) -> Result<(), StructureError> {
    let Material { elastic, density } = *material;
    let require = |name, value: f64, is_valid: bool, expected| {
        if is_valid && value.is_finite() {
            return Ok(());
        }
        Err(StructureError::OutOfRange {
            name,
            value,
            expected,
        })
    };
    let (modulus, ratio) = (elastic.youngs_modulus, elastic.poisson_ratio);
    require(
        "youngs_modulus",
        modulus,
        modulus > 0.0,
        "a positive number of pascals",
    )?;
    require(
        "poisson_ratio",
        ratio,
        ratio > -1.0 && ratio < 0.5,
        "above -1 and below 0.5",
    )?;
    require(
        "density",
        density,
        density > 0.0,
        "a positive number of kg/m³",
    )
}

/// Number of degrees of freedom of the element.
pub const DOFS: usize = 24;

/// Stiffness and mass of one element.
#[derive(Debug, Clone)]
pub struct ElementMatrices {
    /// Stiffness \[N/m\], symmetric, row by row.
    pub stiffness: [[f64; DOFS]; DOFS],
    /// Consistent mass `mass[i][j]` between nodes i and j \[kg\], equal along each axis. The block of nodes i and j in
    /// the mass matrix is `mass[i][j]` times the 3×3 identity.
    pub mass: [[f64; 8]; 8],
    /// Volume \[m³\].
    pub volume: f64,
}

/// Natural coordinates of the nodes.
pub const CORNERS: [[f64; 3]; 8] = [
    [-1.0, -1.0, -1.0],
    [1.0, -1.0, -1.0],
    [1.0, 1.0, -1.0],
    [-1.0, 1.0, -1.0],
    [-1.0, -1.0, 1.0],
    [1.0, -1.0, 1.0],
    [1.0, 1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Returns the shape functions at a point in natural coordinates.
pub fn shape(point: [f64; 3]) -> [f64; 8] {
    CORNERS.map(|c| 0.125 * (0..3).map(|m| 1.0 + c[m] * point[m]).product::<f64>())
}

/// Returns the derivatives of the shape functions with respect to the natural coordinates, as `[node][m]`.
pub fn shape_derivatives(point: [f64; 3]) -> [[f64; 3]; 8] {
    CORNERS.map(|c| {
        let f = [0, 1, 2].map(|m| 1.0 + c[m] * point[m]);
        [
            0.125 * c[0] * f[1] * f[2],
            0.125 * c[1] * f[0] * f[2],
            0.125 * c[2] * f[0] * f[1],
        ]
    })
}

/// Returns the Jacobian at a point in natural coordinates: `jacobian[a][m]` = ∂x_a/∂ξ_m.
pub fn jacobian(nodes: &[[f64; 3]; 8], point: [f64; 3]) -> [[f64; 3]; 3] {
    let derivatives = shape_derivatives(point);
    let mut jacobian = [[0.0; 3]; 3];
    for (x, d) in nodes.iter().zip(&derivatives) {
        for a in 0..3 {
            for m in 0..3 {
                jacobian[a][m] += x[a] * d[m];
            }
        }
    }
    jacobian
}

/// Returns the determinant and the inverse of a 3×3 matrix. The inverse is meaningless if the determinant is zero.
pub fn invert(m: &[[f64; 3]; 3]) -> (f64, [[f64; 3]; 3]) {
    let cofactor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        m[a][c] * m[b][d] - m[a][d] * m[b][c]
    };
    let determinant = (0..3).map(|j| m[0][j] * cofactor(0, j)).sum::<f64>();
    let mut inverse = [[0.0; 3]; 3];
    for i in 0..3 {
        for j in 0..3 {
            inverse[j][i] = cofactor(i, j) / determinant;
        }
    }
    (determinant, inverse)
}

/// Number of shape gradients: eight nodes and three incompatible modes.
const GRADIENTS: usize = 11;
const FULL: usize = 3 * GRADIENTS;

/// Computes the stiffness and mass of the hexahedron with the given nodes \[m\]. The error reports the number
/// `element`.
///
/// # Errors
/// [`StructureError::InvertedElement`] if the Jacobian is not positive at an integration point.
pub fn matrices(
    nodes: &[[f64; 3]; 8],
    material: &Material,
    formulation: Formulation,
    element: usize,
) -> Result<ElementMatrices, StructureError> {
    let ratio = material.elastic.poisson_ratio;
    let shear = material.elastic.shear_modulus();
    let lame = 2.0 * shear * ratio / (1.0 - 2.0 * ratio);
    let (centre_determinant, centre_inverse) = invert(&jacobian(nodes, [0.0; 3]));
    let gradients = match formulation {
        Formulation::Plain => 8,
        Formulation::IncompatibleModes => GRADIENTS,
    };

    let mut full = [[0.0; FULL]; FULL];
    let mut mass = [[0.0; 8]; 8];
    let mut volume = 0.0;
    let station = 1.0 / 3.0_f64.sqrt();
    for corner in CORNERS {
        let point = corner.map(|c| c * station);
        let (determinant, inverse) = invert(&jacobian(nodes, point));
        // The condition `!(determinant > 0.0)` rejects NaN, but the condition `determinant <= 0.0` would accept NaN.
        if !(determinant > 0.0 && centre_determinant > 0.0) {
            return Err(StructureError::InvertedElement {
                element,
                jacobian: determinant.min(centre_determinant),
            });
        }
        let mut gradient = [[0.0; 3]; GRADIENTS];
        for (g, d) in gradient.iter_mut().zip(&shape_derivatives(point)) {
            for a in 0..3 {
                g[a] = (0..3).map(|m| inverse[m][a] * d[m]).sum();
            }
        }
        // Bubble function 1 − ξ_m² with the Jacobian at the centre. The gradient of the bubble function integrates to
        // zero over any distorted element.
        for m in 0..3 {
            let factor = -2.0 * point[m] * centre_determinant / determinant;
            gradient[8 + m] = [0, 1, 2].map(|a| factor * centre_inverse[m][a]);
        }
        for p in 0..gradients {
            for q in 0..=p {
                let (gp, gq) = (gradient[p], gradient[q]);
                let dot = gp[0] * gq[0] + gp[1] * gq[1] + gp[2] * gq[2];
                for a in 0..3 {
                    for b in 0..3 {
                        let diagonal = if a == b { shear * dot } else { 0.0 };
                        full[3 * p + a][3 * q + b] +=
                            determinant * (lame * gp[a] * gq[b] + shear * gp[b] * gq[a] + diagonal);
                    }
                }
            }
        }
        let n = shape(point);
        for p in 0..8 {
            for q in 0..8 {
                mass[p][q] += material.density * determinant * n[p] * n[q];
            }
        }
        volume += determinant;
    }
    if gradients == GRADIENTS {
        condense(&mut full);
    }
    let mut stiffness = [[0.0; DOFS]; DOFS];
    for i in 0..DOFS {
        for j in 0..=i {
            stiffness[i][j] = full[i][j];
            stiffness[j][i] = full[i][j];
        }
    }
    Ok(ElementMatrices {
        stiffness,
        mass,
        volume,
    })
}

/// Eliminates the rows after the first [`DOFS`] from a symmetric matrix. `condense` reads and updates only the lower
/// triangle of the matrix.
fn condense(full: &mut [[f64; FULL]; FULL]) {
    for pivot in (DOFS..FULL).rev() {
        let row = full[pivot];
        for i in 0..pivot {
            let factor = row[i] / row[pivot];
            for j in 0..=i {
                full[i][j] -= factor * row[j];
            }
        }
    }
}
