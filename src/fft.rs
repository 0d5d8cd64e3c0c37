//! Fast Fourier transforms of fields: the only place that names `realfft` and `rustfft`.
//!
//! [`Convolution`] applies real, inversion-symmetric kernels (K(−x, −y) = K(x, y)) to one or two fields at once. Their
//! transforms are real numbers, so a kernel costs half the memory of a general one. Odd kernels (K(−x, −y) = −K(x, y)) have
//! imaginary transforms and cost as little.
//!
//! The unit of cost is the *pair*: one field transformed forward and back at the size of the convolution.

use std::sync::Arc;

use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};
use rustfft::{Fft, FftPlanner};

pub use rustfft::FftDirection;
pub use rustfft::num_complex::Complex64;

/// Rows that are transposed together: eight complex numbers are two cache lines of writes to each column.
const ROWS_AT_ONCE: usize = 8;

/// The smallest even number of the form 2^a 3^b 5^c that is at least `least`.
pub fn fast_length(least: usize) -> usize {
    let rest = |mut n: usize| {
        for factor in [2, 3, 5] {
            while n.is_multiple_of(factor) {
                n /= factor;
            }
        }
        n
    };
    let mut n = least.max(2).next_multiple_of(2);
    while rest(n) != 1 {
        n += 2;
    }
    n
}

/// Transforms of a field of `nx * ny` cells on a (padded) plane of `px * py`, for products with kernels in transformed space.
///
/// The transformed plane is stored column by column: wave number k along y slow (`py / 2 + 1` of them), wave number along
/// x fast (`px`). Rows and columns that are known to be zero, or whose result is not asked for, are not transformed.
pub struct Convolution {
    nx: usize,
    ny: usize,
    px: usize,
    py: usize,
    row_forward: Arc<dyn RealToComplex<f64>>,
    row_inverse: Arc<dyn ComplexToReal<f64>>,
    column_forward: Arc<dyn Fft<f64>>,
    column_inverse: Arc<dyn Fft<f64>>,
    /// One plane of `(py/2 + 1) * nx` a field: the row transforms, transposed.
    planes: [Vec<Complex64>; 2],
    columns: [Vec<Complex64>; 2],
    row: Vec<f64>,
    rows: Vec<Complex64>,
    scratch: Vec<Complex64>,
    pairs: f64,
    pair_weight: f64,
}

/// A symmetric 2×2 block of kernels in transformed space, each in the layout and scale of [`Convolution::kernel`].
#[derive(Debug, Clone)]
pub struct VectorKernel {
    /// x from x.
    pub xx: Vec<f64>,
    /// y from y.
    pub yy: Vec<f64>,
    /// x from y, and y from x.
    pub xy: Vec<f64>,
}

impl Convolution {
    /// Fields of `nx * ny` cells on a plane of `px * py` (`px >= nx`, `py >= ny`).
    pub fn new(nx: usize, ny: usize, px: usize, py: usize) -> Self {
        assert!(
            nx >= 1 && ny >= 1 && px >= nx && py >= ny,
            "plane {px} x {py} does not hold {nx} x {ny} cells"
        );
        let mut complex = FftPlanner::new();
        let mut real = RealFftPlanner::new();
        let column_forward = complex.plan_fft_forward(px);
        let column_inverse = complex.plan_fft_inverse(px);
        let row_forward = real.plan_fft_forward(py);
        let row_inverse = real.plan_fft_inverse(py);
        let scratch = [
            column_forward.get_inplace_scratch_len(),
            column_inverse.get_inplace_scratch_len(),
            row_forward.get_scratch_len(),
            row_inverse.get_scratch_len(),
        ];
        let waves = py / 2 + 1;
        Convolution {
            nx,
            ny,
            px,
            py,
            row_forward,
            row_inverse,
            column_forward,
            column_inverse,
            planes: [Vec::new(), Vec::new()],
            columns: [vec![Complex64::ZERO; px], vec![Complex64::ZERO; px]],
            row: vec![0.0; py],
            rows: vec![Complex64::ZERO; waves * ROWS_AT_ONCE],
            scratch: vec![Complex64::ZERO; scratch.into_iter().max().unwrap_or(0)],
            pairs: 0.0,
            pair_weight: 1.0,
        }
    }

    /// Counts each pair of this plan as `weight` pairs, for a plane smaller than the one that sets the unit.
    pub fn with_pair_weight(mut self, weight: f64) -> Self {
        self.pair_weight = weight;
        self
    }

    /// Number of wave numbers stored: `(py / 2 + 1) * px`.
    pub fn spectrum_len(&self) -> usize {
        (self.py / 2 + 1) * self.px
    }

    /// Pairs of transforms done since the last call. Sums begin at zero each time, so that equal work gives equal sums whatever was
    /// done before it.
    pub fn take_pairs(&mut self) -> f64 {
        std::mem::take(&mut self.pairs)
    }

    /// A kernel in transformed space from its values at signed cell offsets, |i| < nx and |j| < ny.
    ///
    /// `value(-i, -j)` must equal `value(i, j)`. Offsets that the plane cannot tell from their opposite (half of its length)
    /// are taken as zero; on a padded plane none of them is in reach.
    pub fn kernel(&mut self, value: impl Fn(isize, isize) -> f64) -> Vec<f64> {
        let scale = 1.0 / (self.px * self.py) as f64;
        let plane = self.transformed(value);
        plane.iter().map(|c| c.re * scale).collect()
    }

    /// The same for an odd kernel, `value(-i, -j) = -value(i, j)`, whose transform is imaginary: that imaginary part.
    pub fn odd_kernel(&mut self, value: impl Fn(isize, isize) -> f64) -> Vec<f64> {
        let scale = 1.0 / (self.px * self.py) as f64;
        let plane = self.transformed(value);
        plane.iter().map(|c| c.im * scale).collect()
    }

    fn transformed(&mut self, value: impl Fn(isize, isize) -> f64) -> Vec<Complex64> {
        let waves = self.py / 2 + 1;
        let mut plane = vec![Complex64::ZERO; waves * self.px];
        let signed = |position: usize, length: usize, cells: usize| {
            let offset = if 2 * position < length {
                position as isize
            } else {
                position as isize - length as isize
            };
            (offset.unsigned_abs() < cells && 2 * position != length).then_some(offset)
        };
        for x in 0..self.px {
            let Some(i) = signed(x, self.px, self.nx) else {
                continue;
            };
            for y in 0..self.py {
                self.row[y] = signed(y, self.py, self.ny).map_or(0.0, |j| value(i, j));
            }
            self.forward_row(0);
            for k in 0..waves {
                plane[k * self.px + x] = self.rows[k];
            }
        }
        for column in plane.chunks_exact_mut(self.px) {
            self.column_forward
                .process_with_scratch(column, &mut self.scratch);
        }
        plane
    }

    /// A kernel given by its transform at wave numbers (m, n): m signed, 0 ≤ n ≤ py/2.
    pub fn symbol(&self, value: impl Fn(isize, usize) -> f64) -> Vec<f64> {
        let scale = 1.0 / (self.px * self.py) as f64;
        let mut symbol = Vec::with_capacity(self.spectrum_len());
        for n in 0..=self.py / 2 {
            for x in 0..self.px {
                let m = if 2 * x <= self.px {
                    x as isize
                } else {
                    x as isize - self.px as isize
                };
                symbol.push(value(m, n) * scale);
            }
        }
        symbol
    }

    /// Applies a scalar kernel: `output = kernel ⊗ input`, both fields of nx·ny cells. Costs one pair.
    pub fn apply(&mut self, kernel: &[f64], input: &[f64], output: &mut [f64]) {
        self.rows_to_columns(0, input);
        for k in 0..=self.py / 2 {
            self.load_column(0, k);
            self.column_forward
                .process_with_scratch(&mut self.columns[0], &mut self.scratch);
            let kernel = &kernel[k * self.px..(k + 1) * self.px];
            for (c, k) in self.columns[0].iter_mut().zip(kernel) {
                *c *= k;
            }
            self.column_inverse
                .process_with_scratch(&mut self.columns[0], &mut self.scratch);
            self.store_column(0, k);
        }
        self.columns_to_rows(0, output);
        self.pairs += self.pair_weight;
    }

    /// Applies a symmetric 2×2 block of kernels to the x and y fields, sharing their transforms. Costs two pairs.
    pub fn apply_vector(
        &mut self,
        kernels: &VectorKernel,
        input: [&[f64]; 2],
        output: [&mut [f64]; 2],
    ) {
        for (axis, field) in input.into_iter().enumerate() {
            self.rows_to_columns(axis, field);
        }
        for k in 0..=self.py / 2 {
            for axis in 0..2 {
                self.load_column(axis, k);
                self.column_forward
                    .process_with_scratch(&mut self.columns[axis], &mut self.scratch);
            }
            let range = k * self.px..(k + 1) * self.px;
            let kernels = kernels.xx[range.clone()]
                .iter()
                .zip(&kernels.yy[range.clone()])
                .zip(&kernels.xy[range]);
            let [x, y] = &mut self.columns;
            for ((x, y), ((xx, yy), xy)) in x.iter_mut().zip(y.iter_mut()).zip(kernels) {
                (*x, *y) = (*x * xx + *y * xy, *x * xy + *y * yy);
            }
            for axis in 0..2 {
                self.column_inverse
                    .process_with_scratch(&mut self.columns[axis], &mut self.scratch);
                self.store_column(axis, k);
            }
        }
        for (axis, field) in output.into_iter().enumerate() {
            self.columns_to_rows(axis, field);
        }
        self.pairs += 2.0 * self.pair_weight;
    }

    /// Sums odd kernels: `output = Σ kernel ⊗ input` over one or two pairs of kernel and field. Costs half a pair a transform.
    pub fn apply_odd_sum(&mut self, terms: &[(&[f64], &[f64])], output: &mut [f64]) {
        assert!((1..=2).contains(&terms.len()), "one or two terms");
        for (plane, (_, field)) in terms.iter().enumerate() {
            self.rows_to_columns(plane, field);
        }
        for k in 0..=self.py / 2 {
            for (plane, (kernel, _)) in terms.iter().enumerate() {
                self.load_column(plane, k);
                self.column_forward
                    .process_with_scratch(&mut self.columns[plane], &mut self.scratch);
                let kernel = &kernel[k * self.px..(k + 1) * self.px];
                for (c, k) in self.columns[plane].iter_mut().zip(kernel) {
                    *c = Complex64::new(-c.im * k, c.re * k);
                }
            }
            if terms.len() == 2 {
                let [sum, second] = &mut self.columns;
                for (s, c) in sum.iter_mut().zip(second) {
                    *s += *c;
                }
            }
            self.column_inverse
                .process_with_scratch(&mut self.columns[0], &mut self.scratch);
            self.store_column(0, k);
        }
        self.columns_to_rows(0, output);
        self.pairs += 0.5 * (terms.len() + 1) as f64 * self.pair_weight;
    }

    /// Applies one or two odd kernels to one field: `output = kernel ⊗ input` for each. Costs half a pair a transform.
    pub fn apply_odd_each(&mut self, input: &[f64], targets: &mut [(&[f64], &mut [f64])]) {
        assert!((1..=2).contains(&targets.len()), "one or two targets");
        self.rows_to_columns(0, input);
        if targets.len() == 2 && self.planes[1].is_empty() {
            self.planes[1] = vec![Complex64::ZERO; (self.py / 2 + 1) * self.nx];
        }
        for k in 0..=self.py / 2 {
            self.load_column(0, k);
            self.column_forward
                .process_with_scratch(&mut self.columns[0], &mut self.scratch);
            // The last target first: the first one overwrites what all are made of.
            for (plane, (kernel, _)) in targets.iter().enumerate().rev() {
                let kernel = &kernel[k * self.px..(k + 1) * self.px];
                for (x, k) in kernel.iter().enumerate() {
                    let c = self.columns[0][x];
                    self.columns[plane][x] = Complex64::new(-c.im * k, c.re * k);
                }
                self.column_inverse
                    .process_with_scratch(&mut self.columns[plane], &mut self.scratch);
                self.store_column(plane, k);
            }
        }
        for (plane, (_, output)) in targets.iter_mut().enumerate() {
            self.columns_to_rows(plane, output);
        }
        self.pairs += 0.5 * (targets.len() + 1) as f64 * self.pair_weight;
    }

    /// Transforms `self.row` into row `slot` of `self.rows`.
    fn forward_row(&mut self, slot: usize) {
        let waves = self.py / 2 + 1;
        let target = &mut self.rows[slot * waves..(slot + 1) * waves];
        self.row_forward
            .process_with_scratch(&mut self.row, target, &mut self.scratch)
            .expect("row buffers have the lengths of their plan");
    }

    fn rows_to_columns(&mut self, plane: usize, field: &[f64]) {
        assert_eq!(field.len(), self.nx * self.ny, "field length");
        let waves = self.py / 2 + 1;
        if self.planes[plane].is_empty() {
            self.planes[plane] = vec![Complex64::ZERO; waves * self.nx];
        }
        for first in (0..self.nx).step_by(ROWS_AT_ONCE) {
            let count = ROWS_AT_ONCE.min(self.nx - first);
            for slot in 0..count {
                let source = (first + slot) * self.ny;
                self.row[..self.ny].copy_from_slice(&field[source..source + self.ny]);
                self.row[self.ny..].fill(0.0);
                self.forward_row(slot);
            }
            for k in 0..waves {
                let target =
                    &mut self.planes[plane][k * self.nx + first..k * self.nx + first + count];
                for (slot, t) in target.iter_mut().enumerate() {
                    *t = self.rows[slot * waves + k];
                }
            }
        }
    }

    fn columns_to_rows(&mut self, plane: usize, field: &mut [f64]) {
        assert_eq!(field.len(), self.nx * self.ny, "field length");
        let waves = self.py / 2 + 1;
        for first in (0..self.nx).step_by(ROWS_AT_ONCE) {
            let count = ROWS_AT_ONCE.min(self.nx - first);
            for k in 0..waves {
                let source = &self.planes[plane][k * self.nx + first..k * self.nx + first + count];
                for (slot, s) in source.iter().enumerate() {
                    self.rows[slot * waves + k] = *s;
                }
            }
            for slot in 0..count {
                let spectrum = &mut self.rows[slot * waves..(slot + 1) * waves];
                // Rounding leaves tiny imaginary parts where a real signal has none; the inverse plan refuses them.
                spectrum[0].im = 0.0;
                if self.py.is_multiple_of(2) {
                    spectrum[waves - 1].im = 0.0;
                }
                self.row_inverse
                    .process_with_scratch(spectrum, &mut self.row, &mut self.scratch)
                    .expect("row buffers have the lengths of their plan");
                let target = (first + slot) * self.ny;
                field[target..target + self.ny].copy_from_slice(&self.row[..self.ny]);
            }
        }
    }

    fn load_column(&mut self, plane: usize, k: usize) {
        let source = &self.planes[plane][k * self.nx..(k + 1) * self.nx];
        self.columns[plane][..self.nx].copy_from_slice(source);
        self.columns[plane][self.nx..].fill(Complex64::ZERO);
    }

    fn store_column(&mut self, plane: usize, k: usize) {
        let target = &mut self.planes[plane][k * self.nx..(k + 1) * self.nx];
        target.copy_from_slice(&self.columns[plane][..self.nx]);
    }
}

/// Transforms a complex field of any shape in place, without normalisation: forward has the sign −i in the exponent, inverse +i.
///
/// For what is transformed a few times in a run, such as a surface; [`Convolution`] is for the rest.
pub fn transform(values: &mut Vec<Complex64>, nx: usize, ny: usize, direction: FftDirection) {
    let mut planner = FftPlanner::new();
    planner.plan_fft(ny, direction).process(values);
    let mut columns = transposed(values, nx, ny);
    planner.plan_fft(nx, direction).process(&mut columns);
    *values = transposed(&columns, ny, nx);
}

/// The `cols * rows` array whose entry (c, r) is the entry (r, c) of `values`.
fn transposed(values: &[Complex64], rows: usize, cols: usize) -> Vec<Complex64> {
    (0..rows * cols)
        .map(|k| values[(k % rows) * cols + k / rows])
        .collect()
}

/// The signed wave number of position `k` in a transform of length `n`; the Nyquist position of an even length is negative.
pub fn wave_number(k: usize, n: usize) -> i64 {
    if 2 * k < n {
        k as i64
    } else {
        k as i64 - n as i64
    }
}
