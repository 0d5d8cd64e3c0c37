//! Checks of the processor and the numerics: their speed and their errors.

use std::hint::black_box;
use std::time::Instant;

use super::{Check, State};
use crate::contact::{Boundary, Elastic, HalfSpace, Pair};
use crate::fft::{Convolution, Workspace, fast_length};
use crate::grid::Grid;
use crate::linalg::{LinalgError, Matrix, RowMatrix};
use crate::store::Machine;

/// Number of repetitions of a time measurement. The lower quartile counts, because bursts of other processes may last
/// for half of the repetitions.
const REPEATS: usize = 25;
/// Order of the dense matrices whose product is measured.
const ORDER: usize = 256;
/// Order of the dense matrices that are factorized.
const FACTOR_ORDER: usize = 192;
/// Largest relative error that rounding can explain.
const ROUNDING: f64 = 1e-12;
/// Cells of the convolution that is compared with a direct sum; not powers of two.
const DIRECT: [usize; 2] = [23, 18];
/// Number of cells along each side of the timed grid; its padded plane has 512 x 512 points.
const CELLS: usize = 256;
/// Rate of a release build that one thread of a processor with vector instructions reaches \[operations/s\].
const SLOW: f64 = 2e9;

pub(super) const REBUILD: &str = "build the program again, with `cargo test --release`; if it fails again, memory or processor may be faulty";

pub(super) fn lower_quartile_time(mut work: impl FnMut()) -> f64 {
    let mut times: Vec<f64> = (0..REPEATS)
        .map(|_| {
            let begin = Instant::now();
            work();
            begin.elapsed().as_secs_f64()
        })
        .collect();
    times.sort_by(f64::total_cmp);
    times[REPEATS / 4]
}

/// Measures the time of a pair of transforms on the plane of a half space \[s\].
pub fn seconds_of_pair(half_space: &mut HalfSpace) -> f64 {
    let cells = half_space.grid().len();
    let (pressure, mut displacement) = (vec![1.0; cells], vec![0.0; cells]);
    lower_quartile_time(|| half_space.normal(&pressure, &mut displacement))
}

/// Measures the time per operation of a dense matrix product \[s\].
pub fn seconds_of_operation() -> f64 {
    let matrix = Matrix::from_fn(ORDER, ORDER, |i, j| 1.0 / (1.0 + i as f64 + j as f64));
    let product = lower_quartile_time(|| {
        black_box(matrix.times(&matrix));
    });
    product / (2.0 * (ORDER as f64).powi(3))
}

/// Checks processor, transforms and factorisations.
pub(super) fn numerics() -> Vec<Check> {
    vec![processor(), transforms(), factors()]
}

fn processor() -> Check {
    let machine = Machine::this();
    let (features, threads) = (machine.cpu_features, machine.processors);
    let rate = 1.0 / seconds_of_operation();
    let has = |feature: &str| features.iter().any(|available| available == feature);
    let features_text = if features.is_empty() {
        "vector instructions unknown".to_owned()
    } else {
        features.join(" ")
    };
    let check = Check::ok(
        "processor",
        format!(
            "{} {}, {features_text}; {threads} threads; dense products {:.1} GFlop/s on one",
            machine.architecture,
            machine.os,
            1e-9 * rate
        ),
    )
    .number("threads", threads as f64)
    .number("operations_per_second", rate);
    if machine.architecture == "x86_64" && !(has("avx2") && has("fma")) {
        return check.with_advice(
            State::Warning,
            "without avx2 and fma runs take several times as long; on a virtual machine, pass the host processor through",
        );
    }
    if rate < SLOW {
        return check.with_advice(
            State::Warning,
            "slow for a release build; was it built with --release, and is the machine busy?",
        );
    }
    check
}

fn transforms() -> Check {
    let error = convolution_error();
    let grid = Grid::over([0.04, 0.04], [CELLS, CELLS]);
    let steel = Elastic {
        youngs_modulus: 200e9,
        poisson_ratio: 0.3,
    };
    let mut half_space = HalfSpace::new(grid, Pair::same(steel), Boundary::Free);
    let seconds = seconds_of_pair(&mut half_space);
    let check = Check::ok(
        "transforms",
        format!(
            "convolution against the direct sum {error:.1e}; a pair on 512 x 512 points {:.2} ms",
            1e3 * seconds
        ),
    )
    .number("relative_error", error)
    .number("seconds_of_pair", seconds);
    with_tolerance(check, error, ROUNDING)
}

/// Returns the largest error of a convolution against its direct sum, relative to the largest value.
fn convolution_error() -> f64 {
    let [nx, ny] = DIRECT;
    let convolution = Convolution::new(nx, ny, fast_length(2 * nx - 1), fast_length(2 * ny - 1));
    let value = |i: isize, j: isize| 1.0 / (1.0 + (i * i + 2 * j * j) as f64).sqrt();
    let kernel = convolution.kernel(value);
    let input: Vec<f64> = (0..nx * ny).map(|c| (1.7 * c as f64).sin()).collect();
    let mut output = vec![0.0; nx * ny];
    convolution.apply(&mut Workspace::default(), &kernel, &input, &mut output);
    let (mut error, mut largest) = (0.0_f64, 0.0_f64);
    for i in 0..nx {
        for j in 0..ny {
            let mut sum = 0.0;
            for k in 0..nx {
                for l in 0..ny {
                    let offset = (i as isize - k as isize, j as isize - l as isize);
                    sum += value(offset.0, offset.1) * input[k * ny + l];
                }
            }
            largest = largest.max(sum.abs());
            // Keep NaN, which `f64::max` would drop.
            let difference = (output[i * ny + j] - sum).abs();
            error = if difference <= error {
                error
            } else {
                difference
            };
        }
    }
    error / largest
}

fn factors() -> Check {
    const NAME: &str = "linear algebra";
    let residuals = lu_residual().and_then(|lu| Ok((lu, cholesky_residual()?)));
    match residuals {
        Ok((lu, cholesky)) => {
            let check = Check::ok(
                NAME,
                format!("residuals of order {FACTOR_ORDER}: LU {lu:.1e}, Cholesky {cholesky:.1e}"),
            )
            .number("residual_lu", lu)
            .number("residual_cholesky", cholesky);
            with_tolerance(check, if lu >= cholesky { lu } else { cholesky }, ROUNDING)
        }
        Err(error) => Check::failed(NAME, error.to_string(), REBUILD),
    }
}

/// Fails the check unless the error is at most the tolerance. NaN fails.
pub(super) fn with_tolerance(check: Check, error: f64, tolerance: f64) -> Check {
    if error <= tolerance {
        check
    } else {
        check.with_advice(State::Failed, REBUILD)
    }
}

/// Entry of a dense matrix that is well conditioned and far from symmetric.
fn entry(i: usize, j: usize) -> f64 {
    let diagonal = if i == j { FACTOR_ORDER as f64 } else { 0.0 };
    diagonal + (0.37 * (i * (j + 3)) as f64).sin()
}

/// Returns ‖Ax − b‖ / (‖A‖ ‖x‖), with the largest entries as norms.
fn lu_residual() -> Result<f64, LinalgError> {
    let size = FACTOR_ORDER;
    let values = (0..size * size)
        .map(|k| entry(k / size, k % size))
        .collect();
    let matrix = RowMatrix::from_rows(size, size, values)?;
    let right: Vec<f64> = (0..size).map(|i| (0.9 * i as f64).cos()).collect();
    let mut solution = right.clone();
    matrix.clone().factorize()?.solve(&mut solution);
    let product = matrix.apply(&solution);
    let scale = largest(matrix.values()) * largest(&solution);
    let differences: Vec<f64> = product.iter().zip(&right).map(|(a, b)| a - b).collect();
    Ok(largest(&differences) / scale)
}

/// Returns ‖LLᵀ − A‖ / ‖A‖, with the largest entries as norms, for A = BᵀB + nI.
fn cholesky_residual() -> Result<f64, LinalgError> {
    let size = FACTOR_ORDER;
    let square = Matrix::from_fn(size, size, entry);
    let mut matrix = square.transpose_times(&square);
    matrix.add(
        1.0,
        &Matrix::from_fn(size, size, |i, j| if i == j { size as f64 } else { 0.0 }),
    );
    let lower = matrix.cholesky()?;
    let scale = largest(matrix.as_slice());
    matrix.add(-1.0, &lower.times_transpose(&lower));
    Ok(largest(matrix.as_slice()) / scale)
}

/// Returns the largest absolute value of the entries, or NaN if an entry is NaN.
fn largest(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |largest, value| {
        let size = value.abs();
        if size <= largest { largest } else { size }
    })
}
