//! Convolutions of fields with kernels that are even or odd under inversion.

use crate::gauge::Gauge;
use std::ops::Range;
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::Complex64;
use super::axis::Axis;

/// Pairs of rows that are transposed together. Four pairs write eight complex numbers, two cache lines, to each column.
const PAIRS_AT_ONCE: usize = 4;

/// Convolution of a field of `nx * ny` cells with kernels. The kernels are in transformed space, and the padded plane
/// has `px * py` cells.
///
/// The transformed plane is stored column by column. In memory, the wave number along x varies fastest (`px` values).
/// The wave number along y varies slowest (`py / 2 + 1` values). The wave numbers along x and y keep the order in which
/// the transforms return the waves. Two real rows are transformed as one complex row. The transforms skip rows and
/// columns that are known to be zero. The transforms also skip rows and columns whose result is not needed.
pub struct Convolution {
    along_x: Axis,
    along_y: Axis,
    /// Wave numbers along y, 0 ≤ k ≤ py/2, with the positions of k and of −k in a transformed row.
    waves: Vec<Wave>,
    pair_weight: f64,
}

#[derive(Clone, Copy)]
struct Wave {
    number: usize,
    position: usize,
    opposite_position: usize,
}

/// Symmetric 2×2 block of kernels in transformed space, each in the layout and scale of [`Convolution::kernel`].
pub struct VectorKernel {
    /// Response along x to a source along x.
    pub xx: Vec<f64>,
    /// Response along y to a source along y.
    pub yy: Vec<f64>,
    /// Response along x to a source along y, and along y to a source along x.
    pub xy: Vec<f64>,
}

/// Buffers and threads of the transforms. All convolutions of a grid share one workspace, so that it stays in the
/// cache. The workspace counts the pairs of transforms of all convolutions.
pub struct Workspace {
    /// Columns of each of two fields, in one block per thread. A thread owns the columns of its block. For the
    /// transforms along rows, each thread owns some rows. The thread reads and writes its rows in all blocks, one block
    /// at a time.
    planes: [Vec<Mutex<Vec<Complex64>>>; 2],
    threads: Vec<Thread>,
    pool: Option<rayon::ThreadPool>,
    pairs: f64,
    /// Counter of transforms for progress reports.
    pub progress_counter: Gauge,
}

/// Buffers of one thread.
#[derive(Default)]
struct Thread {
    rows: Vec<Complex64>,
    columns: [Vec<Complex64>; 2],
    scratch: Vec<Complex64>,
}

impl Default for Workspace {
    fn default() -> Self {
        Workspace::new(1)
    }
}

impl Workspace {
    /// Creates buffers for transforms on `threads` threads. The results of the transforms do not depend on the number
    /// of threads.
    pub fn new(threads: usize) -> Self {
        let threads = threads.max(1);
        let pool = (threads > 1).then(|| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
            pool.build().expect("threads can be started")
        });
        let blocks = || (0..threads).map(|_| Mutex::default()).collect();
        Workspace {
            planes: [blocks(), blocks()],
            threads: (0..threads).map(|_| Thread::default()).collect(),
            pool,
            pairs: 0.0,
            progress_counter: Gauge::default(),
        }
    }

    /// Adds pairs of transforms that [`Workspace::take_pair_count`] returned before.
    pub fn add_pair_count(&mut self, pairs: f64) {
        self.pairs += pairs;
    }

    /// Returns the pairs of transforms since the last call and resets the count. Each sum begins at zero, so equal work
    /// gives equal sums after any earlier work.
    pub fn take_pair_count(&mut self) -> f64 {
        std::mem::take(&mut self.pairs)
    }

    /// Runs `work` on one item per thread.
    fn for_each_thread<T: Send>(
        &mut self,
        items: impl Iterator<Item = T>,
        work: impl Fn(&mut Thread, &[Vec<Mutex<Vec<Complex64>>>; 2], T) + Sync,
    ) {
        let (planes, work) = (&self.planes, &work);
        let items = self.threads.iter_mut().zip(items);
        match &self.pool {
            None => items.for_each(|(thread, item)| work(thread, planes, item)),
            Some(pool) => pool.in_place_scope(|scope| {
                for (thread, item) in items {
                    scope.spawn(move |_| work(thread, planes, item));
                }
            }),
        }
    }
}

/// Locks a block of columns. A block in which a thread has panicked is safe to use, because a thread writes every block
/// before a thread reads the block.
fn columns_of(block: &Mutex<Vec<Complex64>>) -> MutexGuard<'_, Vec<Complex64>> {
    block.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Convolution {
    /// Plans the convolution of fields of `nx * ny` cells. The padded plane has `px * py` cells, with `px >= nx` and
    /// `py >= ny`.
    pub fn new(nx: usize, ny: usize, px: usize, py: usize) -> Self {
        assert!(
            nx >= 1 && ny >= 1 && px >= nx && py >= ny,
            "plane {px} x {py} does not hold {nx} x {ny} cells"
        );
        let along_y = Axis::new(ny, py);
        let wave = |number: usize| Wave {
            number,
            position: along_y.position(number),
            opposite_position: along_y.position((py - number) % py),
        };
        let mut waves: Vec<Wave> = (0..=py / 2).map(wave).collect();
        waves.sort_by_key(|wave| wave.position);
        Convolution {
            along_x: Axis::new(nx, px),
            along_y,
            waves,
            pair_weight: 1.0,
        }
    }

    /// Counts each pair of transforms as `weight` pairs, for a plane smaller than the one that defines the unit.
    pub fn with_pair_weight(mut self, weight: f64) -> Self {
        self.pair_weight = weight;
        self
    }

    /// Returns the length of a kernel in transformed space, `(py / 2 + 1) * px`.
    pub fn spectrum_len(&self) -> usize {
        self.waves.len() * self.along_x.points
    }

    /// Transforms an even kernel. The input is the values of the kernel at signed cell offsets, |i| < nx and |j| < ny.
    ///
    /// `value(-i, -j)` must equal `value(i, j)`. An offset of half the plane equals the opposite offset, and the
    /// function sets the value of such an offset to zero. In a padded plane, no two cells have an offset of half the
    /// plane.
    pub fn kernel(&self, value: impl Fn(isize, isize) -> f64) -> Vec<f64> {
        self.transformed(value, |c| c.re)
    }

    /// Transforms an odd kernel. The input is the values of the kernel at signed cell offsets, |i| < nx and |j| < ny.
    ///
    /// `value(-i, -j)` must equal `-value(i, j)`. Returns the imaginary part of the transform; its real part is zero.
    pub fn odd_kernel(&self, value: impl Fn(isize, isize) -> f64) -> Vec<f64> {
        self.transformed(value, |c| c.im)
    }

    fn transformed(
        &self,
        value: impl Fn(isize, isize) -> f64,
        part: impl Fn(Complex64) -> f64,
    ) -> Vec<f64> {
        let (px, py) = (self.along_x.points, self.along_y.points);
        let signed = |position: usize, axis: &Axis| {
            let length = axis.points;
            let offset = if 2 * position < length {
                position as isize
            } else {
                position as isize - length as isize
            };
            (offset.unsigned_abs() < axis.cells && 2 * position != length).then_some(offset)
        };
        // A kernel fills the whole plane, so the function transforms every row and column, without the shortcuts of
        // `convolve` for zeros.
        let mut planner = rustfft::FftPlanner::new();
        let row_transform = planner.plan_fft_forward(py);
        let mut row = vec![Complex64::ZERO; py];
        let mut plane = vec![Complex64::ZERO; self.spectrum_len()];
        for x in 0..px {
            let Some(i) = signed(x, &self.along_x) else {
                continue;
            };
            for (y, value_here) in row.iter_mut().enumerate() {
                let j = signed(y, &self.along_y);
                *value_here = j.map_or(0.0, |j| value(i, j)).into();
            }
            row_transform.process(&mut row);
            for (k, wave) in self.waves.iter().enumerate() {
                plane[k * px + x] = row[wave.number];
            }
        }
        planner.plan_fft_forward(px).process(&mut plane);
        let mut kernel = vec![0.0; self.spectrum_len()];
        let columns = kernel.chunks_exact_mut(px).zip(plane.chunks_exact(px));
        for (kernel, column) in columns {
            for (wave, c) in column.iter().enumerate() {
                kernel[self.along_x.position(wave)] = self.scale() * part(*c);
            }
        }
        kernel
    }

    /// Tabulates a kernel from its transform at the wave numbers (m, n). The wave number m is signed, and 0 ≤ n ≤ py/2.
    pub fn symbol(&self, value: impl Fn(isize, usize) -> f64) -> Vec<f64> {
        let px = self.along_x.points;
        let mut symbol = vec![0.0; self.spectrum_len()];
        for (column, wave) in symbol.chunks_exact_mut(px).zip(&self.waves) {
            for x in 0..px {
                let m = if 2 * x <= px {
                    x as isize
                } else {
                    x as isize - px as isize
                };
                column[self.along_x.position(x)] = self.scale() * value(m, wave.number);
            }
        }
        symbol
    }

    /// Normalises forward and inverse transform, and the separation of two real rows from one complex row.
    fn scale(&self) -> f64 {
        0.5 / (self.along_x.points * self.along_y.points) as f64
    }

    /// Applies a scalar kernel: `output = kernel ⊗ input`, both fields of nx·ny cells. Costs one pair of transforms.
    pub fn apply(&self, work: &mut Workspace, kernel: &[f64], input: &[f64], output: &mut [f64]) {
        self.convolve(work, &[input], &mut [output], |column, [field, _]| {
            for (c, k) in field.iter_mut().zip(&kernel[column]) {
                *c *= k;
            }
        });
    }

    /// Applies a symmetric 2×2 block of kernels to an x and a y field. Costs two pairs of transforms.
    pub fn apply_vector(
        &self,
        work: &mut Workspace,
        kernels: &VectorKernel,
        input: [&[f64]; 2],
        mut output: [&mut [f64]; 2],
    ) {
        self.convolve(work, &input, &mut output, |column, [x, y]| {
            let kernels = kernels.xx[column.clone()]
                .iter()
                .zip(&kernels.yy[column.clone()])
                .zip(&kernels.xy[column]);
            for ((x, y), ((xx, yy), xy)) in x.iter_mut().zip(y).zip(kernels) {
                (*x, *y) = (*x * xx + *y * xy, *x * xy + *y * yy);
            }
        });
    }

    /// Applies [`Convolution::apply_vector`] to an x field with a zero y field. Costs one and a half pairs of
    /// transforms.
    pub fn apply_column(
        &self,
        work: &mut Workspace,
        kernels: &VectorKernel,
        input: &[f64],
        mut output: [&mut [f64]; 2],
    ) {
        self.convolve(work, &[input], &mut output, |column, [x, y]| {
            let kernels = kernels.xx[column.clone()].iter().zip(&kernels.xy[column]);
            for ((x, y), (xx, xy)) in x.iter_mut().zip(y).zip(kernels) {
                (*x, *y) = (*x * xx, *x * xy);
            }
        });
    }

    /// Sums odd kernels: `output = Σ kernel ⊗ input` over one or two pairs of kernel and field. Costs half a pair per
    /// transform.
    pub fn apply_odd_sum(
        &self,
        work: &mut Workspace,
        terms: &[(&[f64], &[f64])],
        output: &mut [f64],
    ) {
        let inputs: Vec<&[f64]> = terms.iter().map(|(_, field)| *field).collect();
        self.convolve(work, &inputs, &mut [output], |column, [sum, second]| {
            times_imaginary(sum, &terms[0].0[column.clone()]);
            if let Some((kernel, _)) = terms.get(1) {
                times_imaginary(second, &kernel[column]);
                for (s, c) in sum.iter_mut().zip(second) {
                    *s += *c;
                }
            }
        });
    }

    /// Applies one or two odd kernels to one field: `output = kernel ⊗ input` for each. Costs half a pair per
    /// transform.
    pub fn apply_odd_each(
        &self,
        work: &mut Workspace,
        kernels: &[&[f64]],
        input: &[f64],
        outputs: &mut [&mut [f64]],
    ) {
        assert_eq!(kernels.len(), outputs.len(), "one kernel per output");
        self.convolve(work, &[input], outputs, |column, [first, second]| {
            if let Some(kernel) = kernels.get(1) {
                second.copy_from_slice(first);
                times_imaginary(second, &kernel[column.clone()]);
            }
            times_imaginary(first, &kernels[0][column]);
        });
    }

    /// Transforms one or two fields, mixes their columns, and transforms one or two fields back.
    ///
    /// The function calls `mix` for each column. The arguments of `mix` are the range of the column within a kernel,
    /// and the values of the column in each field. `mix` replaces the columns of the fields by the columns of the
    /// outputs.
    fn convolve(
        &self,
        work: &mut Workspace,
        inputs: &[&[f64]],
        outputs: &mut [&mut [f64]],
        mix: impl Fn(Range<usize>, [&mut [Complex64]; 2]) + Sync,
    ) {
        let (nx, ny, px) = (self.along_x.cells, self.along_y.cells, self.along_x.points);
        let (inward, outward) = (inputs.len(), outputs.len());
        assert!(
            (1..=2).contains(&inward) && (1..=2).contains(&outward),
            "one or two fields"
        );
        let lengths = inputs.iter().map(|field| field.len());
        for length in lengths.chain(outputs.iter().map(|field| field.len())) {
            assert_eq!(length, nx * ny, "field length");
        }
        let threads = work.threads.len();
        // Rows are transformed in pairs. An even number per thread keeps the pairs the same for any number of threads.
        let rows = nx.div_ceil(2 * threads) * 2;
        let block = self.waves.len().div_ceil(threads);
        self.prepare(work, inward.max(outward), block);
        for (field, input) in inputs.iter().enumerate() {
            work.for_each_thread(
                input.chunks(rows * ny).enumerate(),
                |thread, planes, (part, input)| {
                    self.rows_to_columns(thread, &planes[field], block, part * rows, input);
                },
            );
        }
        let blocks = (0..self.waves.len()).step_by(block).enumerate();
        work.for_each_thread(blocks, |thread, planes, (part, first)| {
            let mut blocks = [columns_of(&planes[0][part]), columns_of(&planes[1][part])];
            let Thread {
                columns, scratch, ..
            } = thread;
            for k in first..(first + block).min(self.waves.len()) {
                let stored = (k - first) * nx..(k - first + 1) * nx;
                for (column, block) in columns.iter_mut().zip(&blocks).take(inward) {
                    let (column, stored) = (&mut column[..px], &block[stored.clone()]);
                    self.along_x.fill_line(column, stored.iter().copied());
                    self.along_x.forward(column, scratch);
                }
                let [x, y] = columns;
                let second = if inward.max(outward) == 2 { px } else { 0 };
                mix(k * px..(k + 1) * px, [&mut x[..px], &mut y[..second]]);
                for (column, block) in columns.iter_mut().zip(&mut blocks).take(outward) {
                    let (column, stored) = (&mut column[..px], &mut block[stored.clone()]);
                    self.along_x.inverse(column, scratch);
                    self.along_x
                        .read_line(column, stored.iter_mut(), |to, value| *to = value);
                }
            }
        });
        for (field, output) in outputs.iter_mut().enumerate() {
            work.for_each_thread(
                output.chunks_mut(rows * ny).enumerate(),
                |thread, planes, (part, output)| {
                    self.columns_to_rows(thread, &planes[field], block, part * rows, output);
                },
            );
        }
        work.pairs += 0.5 * (inward + outward) as f64 * self.pair_weight;
        work.progress_counter.add_transforms(inward + outward);
    }

    /// Grows the buffers of `work` to the lengths that the convolution needs. Keeps longer buffers.
    fn prepare(&self, work: &mut Workspace, fields: usize, block: usize) {
        let grow = |buffer: &mut Vec<Complex64>, length: usize| {
            if buffer.len() < length {
                buffer.resize(length, Complex64::ZERO);
            }
        };
        for columns in work.planes[..fields].iter().flatten() {
            grow(&mut columns_of(columns), block * self.along_x.cells);
        }
        for thread in &mut work.threads {
            grow(&mut thread.rows, PAIRS_AT_ONCE * self.along_y.points);
            let scratch = self.along_x.scratch().max(self.along_y.scratch());
            grow(&mut thread.scratch, scratch);
            for column in &mut thread.columns[..fields] {
                grow(column, self.along_x.points);
            }
        }
    }

    /// Transforms rows into columns. Row `first` of the whole field is the first row of `field`.
    fn rows_to_columns(
        &self,
        thread: &mut Thread,
        plane: &[Mutex<Vec<Complex64>>],
        block: usize,
        first: usize,
        field: &[f64],
    ) {
        let (nx, ny, py) = (self.along_x.cells, self.along_y.cells, self.along_y.points);
        for (batch, field) in field.chunks(2 * PAIRS_AT_ONCE * ny).enumerate() {
            let first = first + batch * 2 * PAIRS_AT_ONCE;
            let count = field.len() / ny;
            let rows = &mut thread.rows[..count.div_ceil(2) * py];
            for (row, pair) in rows.chunks_exact_mut(py).zip(field.chunks(2 * ny)) {
                let (a, b) = pair.split_at(ny);
                if b.is_empty() {
                    self.along_y
                        .fill_line(row, a.iter().map(|a| Complex64::new(*a, 0.0)));
                } else {
                    let both = a.iter().zip(b);
                    self.along_y
                        .fill_line(row, both.map(|(a, b)| Complex64::new(*a, *b)));
                }
            }
            self.along_y.forward(rows, &mut thread.scratch);
            // The transform of a + ib is z at the wave number k and w at −k. The transforms of a and b follow from
            // 2a = z + w* and 2b = −i(z − w*).
            for (columns, waves) in plane.iter().zip(self.waves.chunks(block)) {
                let mut columns = columns_of(columns);
                for (column, wave) in columns.chunks_exact_mut(nx).zip(waves) {
                    let column = &mut column[first..first + count];
                    for (pair, row) in column.chunks_mut(2).zip(rows.chunks_exact(py)) {
                        let (z, w) = (row[wave.position], row[wave.opposite_position]);
                        pair[0] = Complex64::new(z.re + w.re, z.im - w.im);
                        if let Some(b) = pair.get_mut(1) {
                            *b = Complex64::new(z.im + w.im, w.re - z.re);
                        }
                    }
                }
            }
        }
    }

    /// Transforms columns back into rows, the inverse of [`Convolution::rows_to_columns`].
    fn columns_to_rows(
        &self,
        thread: &mut Thread,
        plane: &[Mutex<Vec<Complex64>>],
        block: usize,
        first: usize,
        field: &mut [f64],
    ) {
        let (nx, ny, py) = (self.along_x.cells, self.along_y.cells, self.along_y.points);
        for (batch, field) in field.chunks_mut(2 * PAIRS_AT_ONCE * ny).enumerate() {
            let first = first + batch * 2 * PAIRS_AT_ONCE;
            let count = field.len() / ny;
            let rows = &mut thread.rows[..count.div_ceil(2) * py];
            // The complex row is a + ib at k, and a* + ib* at −k.
            for (columns, waves) in plane.iter().zip(self.waves.chunks(block)) {
                let columns = columns_of(columns);
                for (column, wave) in columns.chunks_exact(nx).zip(waves) {
                    let column = &column[first..first + count];
                    for (pair, row) in column.chunks(2).zip(rows.chunks_exact_mut(py)) {
                        let a = pair[0];
                        let b = pair.get(1).copied().unwrap_or_default();
                        row[wave.opposite_position] = Complex64::new(a.re + b.im, b.re - a.im);
                        row[wave.position] = Complex64::new(a.re - b.im, a.im + b.re);
                    }
                }
            }
            self.along_y.inverse(rows, &mut thread.scratch);
            for (row, pair) in rows.chunks_exact(py).zip(field.chunks_mut(2 * ny)) {
                let (a, b) = pair.split_at_mut(ny);
                if b.is_empty() {
                    self.along_y.read_line(row, a.iter_mut(), |a, z| *a = z.re);
                } else {
                    let both = a.iter_mut().zip(b);
                    self.along_y
                        .read_line(row, both, |(a, b), z| (*a, *b) = (z.re, z.im));
                }
            }
        }
    }
}

/// Multiplies a column by iκ, with κ the real `kernel`.
#[inline(always)]
fn times_imaginary(column: &mut [Complex64], kernel: &[f64]) {
    for (c, k) in column.iter_mut().zip(kernel) {
        *c = Complex64::new(-c.im * k, c.re * k);
    }
}
