//! Pseudo-modes: a few coordinates that represent the inertia of all modes above the retained modes.
//!
//! The response of the omitted modes at the ports is the series R₀ + ω²R₁ + …. The series diverges at the frequency of
//! the first omitted mode. The pseudo-modes replace the series by the response R₀(R₀ − ω²R₁)⁻¹R₀ (Rubin, AIAA J. 13,
//! 1975). In this response, R₀ acts as the stiffness and R₁ as the mass. The response of the pseudo-modes has the same
//! first two terms as the series. The poles of the pseudo-modes lie above the retained modes. By Rayleigh and Ritz, the
//! poles of the pseudo-modes are upper bounds of the poles of the omitted modes. The mass and the stiffness of the
//! structure of pseudo-modes are positive at every frequency. The structure of pseudo-modes has one coordinate per
//! port. Only the coordinates with the lowest poles have notable inertia at the harmonics of a response. The model
//! keeps the coordinates with the lowest poles, and treats the other coordinates as static:
//!
//! R₀(R₀ − ω²R₁)⁻¹R₀ ≈ Σ_r ψ_rψ_rᵀ/(Λ_r − ω²) + (R₀ − Σ_r ψ_rψ_rᵀ/Λ_r).
//!
//! The static coordinates add a constant, positive flexibility. The model closes contact springs in series with the
//! static flexibility once for all harmonics.

use super::DynamicsError;
use super::linear_model::symmetrise;
use crate::linalg::{Factors, RowMatrix as Matrix, add_scaled, generalised_eigen};

/// Share of the largest residual mass below which another vector contains only rounding of R₁.
const NOTHING_LEFT: f64 = 1e-10;

/// Settings of the pseudo-modes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PseudoModeSettings {
    /// Number of pseudo-modes in addition to the modes of a reduced structure. With six or twelve pseudo-modes, the
    /// frequency of the 30-mode resonator at 979 Hz has an error of 0.001 Hz. The error of 0.001 Hz comes from the
    /// slope of the residual itself, not from the number of pseudo-modes. The solver spends as much work on a
    /// pseudo-mode as on a retained mode.
    pub count: usize,
    /// Number of vectors of the subspace in addition to `count`. With the additional vectors, the poles of the last
    /// pseudo-modes have errors of some percent.
    pub guards: usize,
}

impl Default for PseudoModeSettings {
    fn default() -> Self {
        PseudoModeSettings {
            count: 6,
            guards: 6,
        }
    }
}

impl PseudoModeSettings {
    /// Returns the default settings with another number of pseudo-modes.
    pub fn of_count(count: usize) -> Self {
        PseudoModeSettings {
            count,
            ..PseudoModeSettings::default()
        }
    }
}

/// Pseudo-modes of the residual of a reduction, and the remaining flexibility.
#[derive(Debug, Clone, PartialEq)]
pub struct PseudoModes {
    /// Angular frequencies √Λ \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Shapes ψ at the ports \[kg^-1/2\], `ports × modes`, of unit modal mass.
    pub shapes: Matrix,
    /// Remaining flexibility \[m/N\], `ports × ports`, symmetric. The sum of the remaining flexibility and the static
    /// share ψψᵀ/Λ of the pseudo-modes is R₀.
    pub residual: Matrix,
}

/// Computes the pseudo-modes of lowest frequency. The number of pseudo-modes comes from `settings`, and is smaller if
/// the residual mass has a lower rank.
///
/// The input `residual` is the residual flexibility R₀ \[m/N\]. The input `slope` is the derivative R₁ of the residual
/// flexibility with respect to ω² \[m s²/N\]. Both matrices are symmetric, `ports × ports`. A pivoted Cholesky
/// factorisation chooses columns of R₁ that span the first subspace. One inverse iteration improves the subspace.
///
/// # Errors
/// Returns [`DynamicsError::Length`] if the sizes of the matrices differ, [`DynamicsError::Matrix`] for a residual that
/// is not a flexibility.
pub fn pseudo_modes(
    residual: &Matrix,
    slope: &Matrix,
    settings: PseudoModeSettings,
) -> Result<PseudoModes, DynamicsError> {
    let ports = residual.rows();
    for (what, found) in [
        ("columns of the residual", residual.columns()),
        ("rows of the slope of the residual", slope.rows()),
        ("columns of the slope of the residual", slope.columns()),
    ] {
        if found != ports {
            return Err(DynamicsError::Length {
                what,
                found,
                expected: ports,
            });
        }
    }
    let PseudoModeSettings { count, guards } = settings;
    let subspace_size = match count {
        0 => 0,
        _ => count + guards,
    };
    let first = independent(slope, subspace_size);
    if first.is_empty() {
        return Ok(PseudoModes {
            omega: Vec::new(),
            shapes: Matrix::zeros(ports, 0),
            residual: residual.clone(),
        });
    }
    let flexibility = Inverse::of(residual)?;
    let vectors = flexibility.times(columns_of(slope, &first));
    let columns = independent(&gram(&vectors, &slope.times(&vectors)), subspace_size);
    let vectors = columns_of(&vectors, &columns);
    let inertia_vectors = slope.times(&vectors);
    let flexibility_vectors = flexibility.times(inertia_vectors.clone());
    // Within the span of R₁X the residual mass is R₁X(XᵀR₁X)⁻¹XᵀR₁, and its flexibility over mass is XᵀR₁R₀⁻¹R₁X.
    let (inverse_squares, rotation) = generalised_eigen(
        &gram(&inertia_vectors, &flexibility_vectors),
        &gram(&vectors, &inertia_vectors),
    )
    .map_err(DynamicsError::matrix_error("residual mass"))?;
    let inertia_vectors = inertia_vectors.times(&rotation);
    let lowest: Vec<usize> = (0..columns.len())
        .rev()
        .filter(|r| inverse_squares[*r] > 0.0)
        .take(count)
        .collect();
    let mut shapes = columns_of(&inertia_vectors, &lowest);
    let mut omega = Vec::with_capacity(lowest.len());
    for (place, &r) in lowest.iter().enumerate() {
        for port in 0..ports {
            shapes.set(port, place, shapes.at(port, place) / inverse_squares[r]);
        }
        omega.push(inverse_squares[r].recip().sqrt());
    }
    let mut remaining = residual.clone();
    let mut scaled_shapes = shapes.clone();
    for port in 0..ports {
        let row = scaled_shapes.row_mut(port).iter_mut();
        row.zip(&omega).for_each(|(t, w)| *t /= -w * w);
    }
    remaining.add_product_transposed(&scaled_shapes, &shapes);
    symmetrise(&mut remaining);
    Ok(PseudoModes {
        omega,
        shapes,
        residual: remaining,
    })
}

/// Inverse of a flexibility matrix, or pseudoinverse of a singular flexibility matrix. The flexibility matrix is
/// singular if the retained modes contain all motion of some ports.
enum Inverse {
    Whole(Factors),
    /// Directions, and the inverse of the flexibility along each; 0 along singular directions.
    Part(Matrix, Vec<f64>),
}

impl Inverse {
    fn of(flexibility: &Matrix) -> Result<Inverse, DynamicsError> {
        let of_matrix = DynamicsError::matrix_error("residual flexibility");
        match flexibility.clone().factorize().map_err(&of_matrix) {
            Ok(factors) => Ok(Inverse::Whole(factors)),
            Err(error) if error.is_singular() => {
                let unit = Matrix::identity(flexibility.rows());
                let (values, directions) =
                    generalised_eigen(flexibility, &unit).map_err(of_matrix)?;
                let least = NOTHING_LEFT * values.last().copied().unwrap_or(0.0);
                let inverse = values.iter().map(|value| match *value > least {
                    true => value.recip(),
                    false => 0.0,
                });
                Ok(Inverse::Part(directions, inverse.collect()))
            }
            Err(error) => Err(error),
        }
    }

    fn times(&self, mut columns: Matrix) -> Matrix {
        match self {
            Inverse::Whole(factors) => {
                factors.solve_columns(&mut columns);
                columns
            }
            Inverse::Part(directions, inverse) => {
                let mut along = Matrix::zeros(directions.columns(), columns.columns());
                along.add_transposed_product(directions, &columns);
                for (r, inverse) in inverse.iter().enumerate() {
                    along
                        .row_mut(r)
                        .iter_mut()
                        .for_each(|part| *part *= inverse);
                }
                directions.times(&along)
            }
        }
    }
}

/// Returns up to `most` column indices of a symmetric positive semidefinite matrix. The chosen columns span nearly all
/// columns. The indices are the pivots of the Cholesky factorisation, largest first.
fn independent(matrix: &Matrix, most: usize) -> Vec<usize> {
    let size = matrix.rows();
    let mut remaining_diagonal: Vec<f64> = (0..size).map(|i| matrix.at(i, i)).collect();
    let largest = remaining_diagonal.iter().copied().fold(0.0, f64::max);
    let mut factor: Vec<Vec<f64>> = Vec::new();
    let mut pivots = Vec::new();
    while pivots.len() < most.min(size) {
        let pivot_index = (0..size).fold(0, |p, i| {
            if remaining_diagonal[i] > remaining_diagonal[p] {
                i
            } else {
                p
            }
        });
        let pivot = remaining_diagonal[pivot_index];
        if pivot <= NOTHING_LEFT * largest || pivot <= 0.0 {
            break;
        }
        let mut column = matrix.row(pivot_index).to_vec();
        for before in &factor {
            let share = before[pivot_index];
            add_scaled(&mut column, -share, before);
        }
        let scale = pivot.sqrt().recip();
        for (value, diagonal) in column.iter_mut().zip(&mut remaining_diagonal) {
            *value *= scale;
            *diagonal -= *value * *value;
        }
        remaining_diagonal[pivot_index] = 0.0;
        pivots.push(pivot_index);
        factor.push(column);
    }
    pivots
}

fn columns_of(matrix: &Matrix, columns: &[usize]) -> Matrix {
    let mut out = Matrix::zeros(matrix.rows(), columns.len());
    for i in 0..matrix.rows() {
        for (value, &column) in out.row_mut(i).iter_mut().zip(columns) {
            *value = matrix.at(i, column);
        }
    }
    out
}

/// Computes aᵀb, which is symmetric in exact arithmetic, and removes the asymmetry by rounding.
fn gram(a: &Matrix, b: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(a.columns(), b.columns());
    out.add_transposed_product(a, b);
    symmetrise(&mut out);
    out
}
