//! Pseudo-modes: a few coordinates that stand for the inertia of all modes above the kept ones.
//!
//! What a reduction leaves out answers with R₀ + ω²R₁ + … at the ports, a series that diverges at the first mode left out. With the
//! flexibility R₀ as stiffness and the residual mass R₁ (Rubin, AIAA J. 13, 1975) it is R₀(R₀ − ω²R₁)⁻¹R₀ instead: the same two
//! terms, but a structure with poles of its own above the kept modes (upper bounds of the modes left out, by Rayleigh and Ritz),
//! with a positive mass and stiffness at every frequency. It has as many coordinates as there are ports. Only those with the lowest
//! poles feel their inertia at the harmonics of a response, so that these become coordinates and the rest is static:
//!
//! R₀(R₀ − ω²R₁)⁻¹R₀ ≈ Σ_r ψ_rψ_rᵀ/(Λ_r − ω²) + (R₀ − Σ_r ψ_rψ_rᵀ/Λ_r).
//!
//! The rest stays a constant, positive flexibility, behind which contact springs can be closed once for all harmonics.

use super::DynamicsError;
use super::linear_model::symmetrise;
use crate::linalg::{Factors, RowMatrix as Matrix, add_scaled, generalised_eigen};

/// Vectors of the subspace beyond the pseudo-modes wanted: they bring the poles of the last ones within some percent.
const GUARDS: usize = 6;
/// Share of the largest residual mass below which a further vector has nothing of it but the rounding of R₁.
const NOTHING_LEFT: f64 = 1e-10;

/// The residual of a reduction as pseudo-modes and what is left of its flexibility.
#[derive(Debug, Clone, PartialEq)]
pub struct PseudoModes {
    /// Angular frequencies √Λ \[rad/s\], ascending.
    pub omega: Vec<f64>,
    /// Shapes ψ at the ports \[kg^-1/2\], `ports × modes`, of unit modal mass.
    pub shapes: Matrix,
    /// Flexibility of what is left \[m/N\], `ports × ports`, symmetric. With the static share ψψᵀ/Λ of the pseudo-modes it is R₀.
    pub residual: Matrix,
}

/// The `count` pseudo-modes of lowest frequency, or fewer where the residual mass has no more, of the residual flexibility `residual`
/// R₀ \[m/N\] and its slope over ω², `slope` R₁ \[m s²/N\], both `ports × ports` and symmetric.
///
/// The subspace begins with the columns of R₁ that a pivoted Cholesky factorisation takes, and is improved by one inverse iteration.
///
/// # Errors
/// [`DynamicsError::Length`] if the two do not have one size, [`DynamicsError::Matrix`] for a flexibility that is none.
pub fn pseudo_modes(
    residual: &Matrix,
    slope: &Matrix,
    count: usize,
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
    let wanted = match count {
        0 => 0,
        _ => count + GUARDS,
    };
    let first = independent(slope, wanted);
    if first.is_empty() {
        return Ok(PseudoModes {
            omega: Vec::new(),
            shapes: Matrix::zeros(ports, 0),
            residual: residual.clone(),
        });
    }
    let flexibility = Inverse::of(residual)?;
    let vectors = flexibility.times(columns_of(slope, &first));
    let kept = independent(&gram(&vectors, &slope.times(&vectors)), wanted);
    let vectors = columns_of(&vectors, &kept);
    let moved = slope.times(&vectors);
    let bent = flexibility.times(moved.clone());
    // Within the span of R₁X the residual mass is R₁X(XᵀR₁X)⁻¹XᵀR₁, and its flexibility over mass XᵀR₁R₀⁻¹R₁X.
    let (inverse_squares, turn) = generalised_eigen(&gram(&moved, &bent), &gram(&vectors, &moved))
        .map_err(DynamicsError::of_matrix("residual mass"))?;
    let moved = moved.times(&turn);
    let lowest: Vec<usize> = (0..kept.len())
        .rev()
        .filter(|r| inverse_squares[*r] > 0.0)
        .take(count)
        .collect();
    let mut shapes = columns_of(&moved, &lowest);
    let mut omega = Vec::with_capacity(lowest.len());
    for (place, &r) in lowest.iter().enumerate() {
        for port in 0..ports {
            shapes.set(port, place, shapes.at(port, place) / inverse_squares[r]);
        }
        omega.push(inverse_squares[r].recip().sqrt());
    }
    let mut left = residual.clone();
    let mut taken = shapes.clone();
    for port in 0..ports {
        let row = taken.row_mut(port).iter_mut();
        row.zip(&omega).for_each(|(t, w)| *t /= -w * w);
    }
    left.add_product_transposed(&taken, &shapes);
    symmetrise(&mut left);
    Ok(PseudoModes {
        omega,
        shapes,
        residual: left,
    })
}

/// The inverse of a flexibility; of one that is singular, as the kept modes have all that moves some ports, the inverse of what it has.
enum Inverse {
    Whole(Factors),
    /// Directions, and the inverse of the flexibility along each.
    Part(Matrix, Vec<f64>),
}

impl Inverse {
    fn of(flexibility: &Matrix) -> Result<Inverse, DynamicsError> {
        let of_matrix = DynamicsError::of_matrix("residual flexibility");
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

/// Up to `most` columns of a symmetric positive semidefinite matrix that span nearly what all do: the pivots of its Cholesky
/// factorisation, the largest first.
fn independent(matrix: &Matrix, most: usize) -> Vec<usize> {
    let size = matrix.rows();
    let mut left: Vec<f64> = (0..size).map(|i| matrix.at(i, i)).collect();
    let largest = left.iter().copied().fold(0.0, f64::max);
    let mut factor: Vec<Vec<f64>> = Vec::new();
    let mut pivots = Vec::new();
    while pivots.len() < most.min(size) {
        let largest_left = (0..size).fold(0, |p, i| if left[i] > left[p] { i } else { p });
        let pivot = left[largest_left];
        if pivot <= NOTHING_LEFT * largest || pivot <= 0.0 {
            break;
        }
        let mut column = matrix.row(largest_left).to_vec();
        for before in &factor {
            let share = before[largest_left];
            add_scaled(&mut column, -share, before);
        }
        let scale = pivot.sqrt().recip();
        for (value, left) in column.iter_mut().zip(&mut left) {
            *value *= scale;
            *left -= *value * *value;
        }
        left[largest_left] = 0.0;
        pivots.push(largest_left);
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

/// aᵀb, symmetric but for rounding.
fn gram(a: &Matrix, b: &Matrix) -> Matrix {
    let mut out = Matrix::zeros(a.columns(), b.columns());
    out.add_transposed_product(a, b);
    symmetrise(&mut out);
    out
}
