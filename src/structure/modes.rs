//! Rigid and elastic modes of K φ = ω² M φ, φᵀ M φ = 1.
//!
//! The elastic ones come from block Lanczos with (K + s·M)⁻¹ M, s > 0 small, in the inner product of M: full
//! reorthogonalisation, and the rigid modes (known from the coordinates) kept out of every block. Blocks find modes of equal
//! frequency, which single vectors miss.

use crate::linalg::{LinalgError, Matrix, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::assembly::System;

/// The shift is this share of the largest ratio of the diagonals of K and M, itself near the largest eigenvalue: K + s·M then
/// keeps nine digits in the worst direction, and s lies well below the highest modes wanted, where Lanczos has the work.
const SHIFT_SHARE: f64 = 1e-7;
/// A combination of rigid motions is taken for a rigid mode if its Rayleigh quotient is below this share of the shift. Rounding
/// leaves 1e-9 of the shift and less; a spring on which a structure whose shift is 300 Hz swings at a third of a hertz is elastic.
const RIGID_SHARE: f64 = 1e-6;
/// A block's direction that keeps less than this share of its length after orthogonalisation has nothing new.
const NOTHING_NEW: f64 = 1e-10;
/// A block whose Gram matrix has Cholesky pivots of a smaller ratio than this is orthonormalised column by column: two passes of
/// the whole block would leave it less than orthonormal to rounding.
const NEARLY_DEPENDENT: f64 = 1e-5;

/// How modes are computed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeOptions {
    /// Elastic modes wanted.
    pub count: usize,
    /// Vectors in a block; at least the largest number of modes of one frequency that is expected.
    pub block: usize,
    /// Accepted ‖(K + sM)⁻¹Mφ − θφ‖/θ in the norm of M, θ = 1/(ω² + s). Frequencies are good to its square.
    pub tolerance: f64,
    /// Lanczos vectors at which to give up.
    pub max_vectors: usize,
}

impl ModeOptions {
    /// Options for a number of elastic modes.
    pub fn new(count: usize) -> Self {
        ModeOptions {
            count,
            block: 4,
            tolerance: 1e-9,
            max_vectors: 12 * count + 120,
        }
    }
}

/// Elastic modes, in order of frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct Modes {
    /// Angular frequencies ω \[rad/s\].
    pub omega: Vec<f64>,
    /// Shapes \[kg^-1/2\], one column a mode, φᵀMφ = 1. The largest entry is positive.
    pub shapes: Matrix,
    /// Relative residual of each, in the measure of [`ModeOptions::tolerance`].
    pub residuals: Vec<f64>,
    /// Vectors the Lanczos process took.
    pub vectors: usize,
}

/// The shift s \[rad²/s²\] for a structure; see [`modes`](self).
pub fn shift(system: &System) -> f64 {
    shift_of(&system.stiffness.diagonal(), &system.mass.diagonal())
}

/// That shift \[rad²/s²\] from the diagonals of stiffness and mass.
pub(super) fn shift_of(stiffness: &[f64], mass: &[f64]) -> f64 {
    let ratios = stiffness.iter().zip(mass).filter(|r| *r.1 > 0.0);
    SHIFT_SHARE * ratios.map(|(k, m)| k / m).fold(0.0, f64::max)
}

/// Motions that no spring resists: columns φ \[kg^-1/2\] with Kφ = 0, φᵀMφ = 1, six for each body that is held by nothing.
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
            // Turning about axis a moves the next axis against, and the other along, the arms of each other.
            motions[(3 * n + next, 6 * b + 3 + a)] = -arm[other];
            motions[(3 * n + other, 6 * b + 3 + a)] = arm[next];
        }
    }
    // Columns of one body are independent of each other unless it is a line or a point; such a motion has no mass and goes.
    let mut basis = Matrix::zeros(system.size(), 0);
    append_orthonormal(&system.mass, motions, &mut basis);
    let energy = basis.transpose_times(&system.stiffness.times(&basis));
    let (values, vectors) = energy.symmetric_eigen()?;
    let free = values.iter().filter(|&&v| v < RIGID_SHARE * shift).count();
    Ok(basis.times(&vectors.columns_of(0..free)))
}

/// Makes the columns of `block` orthonormal in M, to the basis and each other, and appends those that have something new.
fn append_orthonormal(mass: &SparseSymmetric, mut block: Matrix, basis: &mut Matrix) {
    // Twice is enough: the second pass removes what rounding left of the first.
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

/// True if dividing by a Cholesky factor of a Gram matrix keeps most digits.
fn well_conditioned(factor: &Matrix) -> bool {
    let diagonal = || (0..factor.rows()).map(|i| factor[(i, i)]);
    let largest = diagonal().fold(0.0, f64::max);
    diagonal().fold(f64::INFINITY, f64::min) > NEARLY_DEPENDENT * largest
}

/// Makes the columns of `block` orthonormal in M, to the basis and each other, and appends them: a column at a time, leaving out what
/// depends on the others.
fn append_one_by_one(mass: &SparseSymmetric, block: &Matrix, basis: &mut Matrix) {
    for c in 0..block.columns() {
        let mut column = block.columns_of(c..c + 1);
        let first = norm(mass, &column);
        let mut length = first;
        for _ in 0..2 {
            let overlap = basis.transpose_times(&mass.times(&column));
            column.add_product(-1.0, basis, &overlap);
            length = norm(mass, &column);
        }
        if length > NOTHING_NEW * first {
            column.as_mut_slice().iter_mut().for_each(|v| *v /= length);
            basis.append(&column);
        }
    }
}

fn norm(mass: &SparseSymmetric, column: &Matrix) -> f64 {
    let weighted = mass.times(column);
    column.transpose_times(&weighted)[(0, 0)].max(0.0).sqrt()
}

/// Numbers in −1…1 that look random and are the same everywhere (splitmix64).
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

/// The lowest elastic modes. `factor` is that of K + shift·M; `rigid` has the modes of [`rigid_modes`].
///
/// # Errors
/// [`StructureError::NotConverged`] at `max_vectors`, [`StructureError::TooManyModes`] if the structure has fewer.
pub fn lowest(
    system: &System,
    factor: &SparseCholesky,
    shift: f64,
    rigid: &Matrix,
    options: &ModeOptions,
) -> Result<Modes, StructureError> {
    lowest_of(&system.mass, factor, shift, rigid, options, false)
}

/// The lowest elastic modes of matrices that belong to no mesh. Where the mass is singular (`purge`), the first vectors are taken
/// through (K + sM)⁻¹ M: what has no mass must not enter the basis.
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
    // The rigid modes stay in front of the basis, so that one product keeps new vectors orthogonal to both.
    let held = rigid.columns();
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
    // The projection Vᵀ M (K + sM)⁻¹ M V, and the part of the last block's image that left the basis.
    let mut projected = Matrix::zeros(0, 0);
    let mut done = held;
    loop {
        let current = basis.columns_of(done..basis.columns());
        let mut image = mass.times(&current);
        factor.solve(&mut image);
        let coefficients = basis.transpose_times(&mass.times(&image));
        image.add_product(-1.0, &basis, &coefficients);
        let total = basis.columns() - held;
        let old = done - held;
        let mut grown = Matrix::zeros(total, total);
        for j in 0..old {
            for i in 0..old {
                grown[(i, j)] = projected[(i, j)];
            }
        }
        for j in 0..current.columns() {
            for i in 0..total {
                grown[(i, old + j)] = coefficients[(held + i, j)];
                grown[(old + j, i)] = coefficients[(held + i, j)];
            }
        }
        projected = grown;
        done = basis.columns();

        // What a Ritz vector misses lies in the last block's remainder: ‖A x − θ x‖ = ‖remainder · (last rows of y)‖.
        let remainder = image.transpose_times(&mass.times(&image));
        let (theta, vectors) = projected.symmetric_eigen().map_err(fail)?;
        let residual = |mode: usize| {
            let column = total - 1 - mode;
            let last = Matrix::from_fn(current.columns(), 1, |i, _| vectors[(old + i, column)]);
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
            let mut shapes = basis.columns_of(held..done).times(&ritz);
            for mode in 0..options.count {
                face_positive(shapes.column_mut(mode));
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
        if basis.columns() == done {
            // The blocks so far span an invariant space: go on from somewhere else.
            let fresh = purged(Matrix::from_fn(size, block, |_, _| noise.next()));
            append_orthonormal(mass, fresh, &mut basis);
            if basis.columns() == done {
                return Err(not_converged);
            }
        }
    }
}

/// Turns a shape so that its largest entry is positive.
fn face_positive(shape: &mut [f64]) {
    let largest = shape
        .iter()
        .fold(0.0_f64, |a, &b| if b.abs() > a.abs() { b } else { a });
    if largest < 0.0 {
        shape.iter_mut().for_each(|v| *v = -*v);
    }
}
