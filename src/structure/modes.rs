//! Rigid and elastic modes of K φ = ω² M φ, φᵀ M φ = 1.
//!
//! The block Lanczos method computes the elastic modes. The operator is (K + s·M)⁻¹ M with a small shift s > 0. The
//! method uses the inner product of M and full reorthogonalisation. Every block is orthogonal to the rigid modes, which
//! follow from the coordinates. A block of vectors finds several modes of equal frequency. A single vector finds only
//! one of the modes.

use crate::linalg::{LinalgError, Matrix, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::assembly::System;

/// A combination of rigid motions is a rigid mode if its Rayleigh quotient is below `RIGID_SHARE` times the shift.
///
/// Due to rounding, a rigid mode has a Rayleigh quotient of up to 1e-9 of the shift. If the shift is 300 Hz, a mode on
/// a soft spring at 0.33 Hz is elastic.
const RIGID_SHARE: f64 = 1e-6;
/// A vector is linearly dependent if orthogonalisation reduces its length to less than `NOTHING_NEW` times the length
/// before.
const NOTHING_NEW: f64 = 1e-10;
/// The solver orthonormalises a block column by column if its Gram matrix is nearly singular. The limit of the ratio of
/// its Cholesky pivots is `NEARLY_DEPENDENT`. Two passes over all columns at once would not make a nearly singular
/// block orthonormal to rounding.
const NEARLY_DEPENDENT: f64 = 1e-5;

/// Shifts at which a reduction factorises the stiffness.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ShiftSettings {
    /// The shift s is `shift_share` times the largest ratio of the diagonals of K and M. The largest ratio is close to
    /// the largest eigenvalue. With the shift s, the matrix K + s·M keeps nine digits in the worst direction. The shift
    /// s is well below ω² of the highest requested modes.
    pub shift_share: f64,
    /// Difference between two shifts, divided by the highest kept ω². The slope of the residual is computed from the
    /// residuals at the two shifts. The next term of the series is then below a percent of the slope, and the
    /// difference still keeps its digits.
    pub slope_share: f64,
}

impl ShiftSettings {
    /// The settings of every reduction. Other settings would give other cached structures.
    pub const DEFAULT: ShiftSettings = ShiftSettings {
        shift_share: 1e-7,
        slope_share: 0.01,
    };
}

/// Options of the computation of modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeOptions {
    /// Number of requested elastic modes.
    pub count: usize,
    /// Number of vectors in a block, at least the largest expected number of modes of equal frequency.
    pub block: usize,
    /// Accepted relative residual ‖(K + sM)⁻¹Mφ − θφ‖/θ in the norm of M, with θ = 1/(ω² + s). The relative error of a
    /// frequency is the square of the relative residual.
    pub tolerance: f64,
    /// Number of Lanczos vectors at which the iteration stops with an error.
    pub max_vectors: usize,
}

impl ModeOptions {
    /// Returns the default options for a number of elastic modes.
    pub fn new(count: usize) -> Self {
        ModeOptions {
            count,
            block: 4,
            tolerance: 1e-9,
            max_vectors: 12 * count + 120,
        }
    }
}

/// Elastic modes in ascending order of frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Angular frequencies ω \[rad/s\].
    pub omega: Vec<f64>,
    /// Shapes \[kg^-1/2\], one column per mode, with φᵀMφ = 1 and a positive largest entry.
    pub shapes: Matrix,
    /// Relative residual of each mode, as defined in [`ModeOptions::tolerance`].
    pub residuals: Vec<f64>,
    /// Number of Lanczos vectors used.
    pub vectors: usize,
}

/// Returns the shift s \[rad²/s²\] for a structure; see [`modes`](self).
pub fn shift(system: &System) -> f64 {
    shift_of(&system.stiffness.diagonal(), &system.mass.diagonal())
}

/// Returns the shift \[rad²/s²\] from the diagonals of stiffness and mass.
pub(super) fn shift_of(stiffness: &[f64], mass: &[f64]) -> f64 {
    let ratios = stiffness.iter().zip(mass).filter(|r| *r.1 > 0.0);
    ShiftSettings::DEFAULT.shift_share * ratios.map(|(k, m)| k / m).fold(0.0, f64::max)
}

/// Computes the rigid modes: columns φ \[kg^-1/2\] with Kφ = 0 and φᵀMφ = 1. An unsupported body has six.
pub fn rigid_modes(system: &System, shift: f64) -> Result<Matrix, LinalgError> {
    let (body, bodies) = system.bodies();
    let mut motions = Matrix::zeros(system.size(), 6 * bodies);
    let mut centres = vec![[0.0; 4]; bodies];
    for (x, &b) in system.coordinates.iter().zip(&body) {
        for a in 0..3 {
            centres[b][a] += x[a];
        }
        centres[b][3] += 1.0;
    }
    for (n, (x, &b)) in system.coordinates.iter().zip(&body).enumerate() {
        let arm = [0, 1, 2].map(|a| x[a] - centres[b][a] / centres[b][3]);
        for a in 0..3 {
            let (next, other) = ((a + 1) % 3, (a + 2) % 3);
            motions[(3 * n + a, 6 * b + a)] = 1.0;
            // A rotation about axis a displaces `next` by −arm of `other`, and `other` by the arm of `next`.
            motions[(3 * n + next, 6 * b + 3 + a)] = -arm[other];
            motions[(3 * n + other, 6 * b + 3 + a)] = arm[next];
        }
    }
    // The six columns of a body are independent unless the body is a line or a point. A motion without mass is
    // dropped.
    let mut basis = Matrix::zeros(system.size(), 0);
    append_orthonormal(&system.mass, motions, &mut basis);
    let energy = basis.transpose_times(&system.stiffness.times(&basis));
    let (values, vectors) = energy.symmetric_eigen()?;
    let free = values.iter().filter(|&&v| v < RIGID_SHARE * shift).count();
    Ok(basis.times(&vectors.column_range(0..free)))
}

/// Makes the columns of `block` orthonormal in M to the basis and to each other. Appends the independent columns to the
/// basis.
fn append_orthonormal(mass: &SparseSymmetric, mut block: Matrix, basis: &mut Matrix) {
    // The second pass removes the rounding errors of the first. Two passes are enough.
    for pass in 0..2 {
        let overlap = basis.transpose_times(&mass.times(&block));
        block.add_product(-1.0, basis, &overlap);
        let gram = block.transpose_times(&mass.times(&block));
        match gram.cholesky() {
            Ok(factor) if well_conditioned(&factor) => factor.solve_upper_right(&mut block),
            _ => return append_one_by_one(mass, &block, basis),
        }
        if pass == 1 {
            basis.append(&block);
        }
    }
}

/// Returns true if a division by the Cholesky `factor` of a Gram matrix keeps most digits.
fn well_conditioned(factor: &Matrix) -> bool {
    let diagonal = || (0..factor.rows()).map(|i| factor[(i, i)]);
    let largest = diagonal().fold(0.0, f64::max);
    diagonal().fold(f64::INFINITY, f64::min) > NEARLY_DEPENDENT * largest
}

/// Makes the columns of `block` orthonormal in M to the basis and to each other, one at a time. Appends the independent
/// columns to the basis.
fn append_one_by_one(mass: &SparseSymmetric, block: &Matrix, basis: &mut Matrix) {
    for c in 0..block.columns() {
        let mut column = block.column_range(c..c + 1);
        let initial_length = norm(mass, &column);
        let mut length = initial_length;
        for _ in 0..2 {
            let overlap = basis.transpose_times(&mass.times(&column));
            column.add_product(-1.0, basis, &overlap);
            length = norm(mass, &column);
        }
        if length > NOTHING_NEW * initial_length {
            column.as_mut_slice().iter_mut().for_each(|v| *v /= length);
            basis.append(&column);
        }
    }
}

fn norm(mass: &SparseSymmetric, column: &Matrix) -> f64 {
    let weighted = mass.times(column);
    column.transpose_times(&weighted)[(0, 0)].max(0.0).sqrt()
}

/// Pseudorandom numbers in −1…1 that are equal on every machine (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Computes the lowest elastic modes. `factor` is the factor of K + shift·M; `rigid` are the modes of
/// [`rigid_modes`].
///
/// # Errors
/// [`StructureError::NotConverged`] at `max_vectors` vectors; [`StructureError::TooManyModes`] if the structure has
/// fewer modes.
pub fn lowest(
    system: &System,
    factor: &SparseCholesky,
    shift: f64,
    rigid: &Matrix,
    options: &ModeOptions,
) -> Result<Modes, StructureError> {
    lowest_of(&system.mass, factor, shift, rigid, options, false)
}

/// Computes the lowest elastic modes from matrices without a mesh.
///
/// `purge` is true if the mass is singular. The start vectors are then multiplied by (K + sM)⁻¹ M, which removes
/// massless motions from the basis.
///
/// # Errors
/// As [`lowest`].
pub fn lowest_of(
    mass: &SparseSymmetric,
    factor: &SparseCholesky,
    shift: f64,
    rigid: &Matrix,
    options: &ModeOptions,
    purge: bool,
) -> Result<Modes, StructureError> {
    let size = mass.size();
    let available = size - rigid.columns();
    if options.count == 0 || options.count > available {
        return Err(StructureError::TooManyModes {
            wanted: options.count,
            available,
        });
    }
    let fail = |source| StructureError::Factorization {
        matrix: "the projected stiffness",
        source,
    };
    let capacity = options.max_vectors.min(available);
    let block = options.block.clamp(1, capacity);
    let mut noise = Noise(1);
    // The rigid modes are the first columns of the basis, so one product keeps new vectors orthogonal to both.
    let rigid_count = rigid.columns();
    let mut basis = rigid.clone();
    let purged = |mut vectors: Matrix| {
        if purge {
            vectors = mass.times(&vectors);
            factor.solve(&mut vectors);
        }
        vectors
    };
    let start = purged(Matrix::from_fn(size, block, |_, _| noise.next()));
    append_orthonormal(mass, start, &mut basis);
    // Projection Vᵀ M (K + sM)⁻¹ M V.
    let mut projected = Matrix::zeros(0, 0);
    let mut expanded = rigid_count;
    loop {
        let current = basis.column_range(expanded..basis.columns());
        let mut image = mass.times(&current);
        factor.solve(&mut image);
        let coefficients = basis.transpose_times(&mass.times(&image));
        image.add_product(-1.0, &basis, &coefficients);
        let total = basis.columns() - rigid_count;
        let expanded_total = expanded - rigid_count;
        let mut grown = Matrix::zeros(total, total);
        for j in 0..expanded_total {
            for i in 0..expanded_total {
                grown[(i, j)] = projected[(i, j)];
            }
        }
        for j in 0..current.columns() {
            for i in 0..total {
                grown[(i, expanded_total + j)] = coefficients[(rigid_count + i, j)];
                grown[(expanded_total + j, i)] = coefficients[(rigid_count + i, j)];
            }
        }
        projected = grown;
        expanded = basis.columns();

        // The error of a Ritz vector x with the coefficients y follows from the remainder of the last block: ‖A x − θ
        // x‖ = ‖remainder · (last rows of y)‖.
        let remainder = image.transpose_times(&mass.times(&image));
        let (theta, vectors) = projected.symmetric_eigen().map_err(fail)?;
        let residual = |mode: usize| {
            let column = total - 1 - mode;
            let last = Matrix::from_fn(current.columns(), 1, |i, _| {
                vectors[(expanded_total + i, column)]
            });
            let squared = last.transpose_times(&remainder.times(&last))[(0, 0)];
            squared.max(0.0).sqrt() / theta[column].abs()
        };
        let wanted = options.count.min(total);
        let residuals: Vec<f64> = (0..wanted).map(residual).collect();
        let converged = residuals
            .iter()
            .filter(|&&r| r <= options.tolerance)
            .count();
        let exhausted = total == available;
        if total >= options.count && (converged == options.count || exhausted) {
            let ritz = Matrix::from_fn(total, options.count, |i, mode| {
                vectors[(i, total - 1 - mode)]
            });
            let mut shapes = basis.column_range(rigid_count..expanded).times(&ritz);
            for mode in 0..options.count {
                make_largest_positive(shapes.column_mut(mode));
            }
            return Ok(Modes {
                omega: (0..options.count)
                    .map(|mode| (1.0 / theta[total - 1 - mode] - shift).max(0.0).sqrt())
                    .collect(),
                shapes,
                residuals,
                vectors: total,
            });
        }
        let not_converged = StructureError::NotConverged {
            converged,
            wanted: options.count,
            vectors: total,
            residual: residuals.iter().copied().fold(0.0, f64::max),
            tolerance: options.tolerance,
        };
        if total >= capacity {
            return Err(not_converged);
        }
        append_orthonormal(mass, image, &mut basis);
        if basis.columns() == expanded {
            // The basis spans an invariant subspace. Restart from new random vectors.
            let fresh = purged(Matrix::from_fn(size, block, |_, _| noise.next()));
            append_orthonormal(mass, fresh, &mut basis);
            if basis.columns() == expanded {
                return Err(not_converged);
            }
        }
    }
}

/// Reverses the sign of a mode shape if its largest entry is negative.
fn make_largest_positive(shape: &mut [f64]) {
    let largest = shape
        .iter()
        .fold(0.0_f64, |a, &b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 {
        shape.iter_mut().for_each(|v| *v = -*v);
    }
}
