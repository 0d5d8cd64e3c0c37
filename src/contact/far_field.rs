//! What the surface between the spots of a contact does, for the preconditioners of the contact solvers.
//!
//! A preconditioner M holds each free cell by springs to all others. Those to cells that are not free lead to the ground, as if
//! the surface between the spots stood still; in truth it moves with them, and the far field is softer. With S = M 1 the
//! springs to the ground, M = (M − S) + S, and springs that stand on the far field with its compliance L in place of the ground
//! give (M − S) + (S⁻¹ + L)⁻¹ = M − S (L⁻¹ + S)⁻¹ S. This stays positive definite, as M − S is that of springs between free cells.
//! L is taken on some blocks of cells, as a small dense matrix.
//!
//! The solvers own the springs of each cell and sum them up over the blocks; here are the blocks.

use std::f64::consts::{PI, TAU};

use super::half_space::{Boundary, HalfSpace};
use super::kernel::{CellIntegrals, cell_integrals};
use super::sums::dot;
use crate::grid::Grid;

/// Most blocks: a factor of their matrix then costs no more than a pair of transforms of the grids that have so many.
const MOST_BLOCKS: f64 = 144.0;

/// Least cells along each side of a block.
const LEAST_CELLS: usize = 2;

/// Waves that the blocks of a periodic contact are told apart by, in each block along a side. The next ones are some parts in a thousand.
const WAVES: usize = 2;

/// The blocks, with `A` displacements each.
pub(super) struct FarField<const A: usize> {
    grid: Grid,
    /// Blocks along x and y.
    numbers: [usize; 2],
    /// Compliance between blocks, `size` × `size` with `size` = A · blocks; unknown `axis` + A · `block` \[m/Pa\].
    compliance: Vec<f64>,
    size: usize,
    /// G, the Cholesky factors of the springs of each block.
    roots: Vec<[[f64; A]; A]>,
    /// Unknowns that springs hold: of the others nothing is asked.
    held: Vec<usize>,
    /// Where among them an unknown is, or beyond the last.
    places: Vec<usize>,
    /// L between these, and the Cholesky factor of 1 + Gᵀ L G; empty where there is no correction.
    held_compliance: Vec<f64>,
    factor: Vec<f64>,
    moved: Vec<f64>,
    inner: Vec<f64>,
    outer: Vec<f64>,
}

impl<const A: usize> FarField<A> {
    /// `compliance` gives the displacements of a point under tractions along the axes on a rectangle at the given offset.
    pub(super) fn new(
        half_space: &HalfSpace,
        compliance: impl Fn(CellIntegrals) -> [[f64; A]; A],
    ) -> Self {
        let grid = half_space.grid();
        let [lx, ly] = grid.size();
        // Without the compliance that a mesh takes away, half spaces have hardly any far field. The compliance that bodies add is most of it.
        let added = half_space.nodal().filter(|nodal| nodal.shear.is_none());
        let [mx, my] = match (half_space.nodal(), added) {
            (None, _) | (_, Some(_)) => numbers(grid),
            (Some(_), None) => [0; 2],
        };
        let size = A * mx * my;
        let (dx, dy) = (lx / mx as f64, ly / my as f64);
        // Tractions summed over the cells of a block act on its whole area.
        let per_cell = grid.cell_area() / (dx * dy);
        let at = |k: usize| match half_space.boundary() {
            Boundary::Free => cell_integrals((k / my) as f64 * dx, (k % my) as f64 * dy, dx, dy),
            Boundary::Periodic => periodic_integrals([k / my, k % my], [mx, my], [lx, ly]),
        };
        let quadrant: Vec<CellIntegrals> = (0..mx * my).map(at).collect();
        let mut matrix = vec![0.0; size * size];
        for p in 0..mx * my {
            for q in 0..mx * my {
                let (i, j) = ((p / my).abs_diff(q / my), (p % my).abs_diff(q % my));
                let mut cell = quadrant[i * my + j];
                if (p / my < q / my) != (p % my < q % my) {
                    cell.xy = -cell.xy;
                }
                for (u, row) in compliance(cell).iter().enumerate() {
                    for (v, value) in row.iter().enumerate() {
                        matrix[(A * p + u) * size + A * q + v] = per_cell * value;
                    }
                }
            }
        }
        if let Some(nodal) = added {
            // It acts along the normal alone, and so does what springs hold of it.
            for (place, value) in nodal
                .between(&blocks_of(grid, [mx, my]))
                .into_iter()
                .enumerate()
            {
                let (p, q) = (place / (mx * my), place % (mx * my));
                matrix[A * p * size + A * q] += value;
            }
        }
        FarField {
            grid,
            numbers: [mx, my],
            compliance: matrix,
            size,
            roots: vec![[[0.0; A]; A]; mx * my],
            held: Vec::new(),
            places: vec![usize::MAX; size],
            held_compliance: Vec::new(),
            factor: Vec::new(),
            moved: vec![0.0; size],
            inner: Vec::new(),
            outer: Vec::new(),
        }
    }

    /// False where the far field is that of nodes.
    pub(super) fn exists(&self) -> bool {
        self.size > 0
    }

    /// Unknowns: `axis` + A · `block`.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// The block of every cell of the grid; none where there are no blocks.
    pub(super) fn blocks(&self) -> Vec<u32> {
        match self.exists() {
            true => blocks_of(self.grid, self.numbers),
            false => Vec::new(),
        }
    }

    /// Prepares the correction for the summed springs of the blocks.
    pub(super) fn prepare(&mut self, springs: &[[[f64; A]; A]]) {
        for (root, springs) in self.roots.iter_mut().zip(springs) {
            *root = root_of(*springs);
        }
        let (size, roots) = (self.size, &self.roots);
        self.held.clear();
        self.held
            .extend((0..size).filter(|k| roots[k / A][k % A][k % A] > 0.0));
        self.places.fill(usize::MAX);
        for (place, &k) in self.held.iter().enumerate() {
            self.places[k] = place;
        }
        let n = self.held.len();
        self.held_compliance.clear();
        let mut m = std::mem::take(&mut self.factor);
        m.clear();
        // 1 + Gᵀ L G, and its factor in place.
        for (i, &row) in self.held.iter().enumerate() {
            let (p, u) = (row / A, row % A);
            let of_row = &self.compliance[row * size..(row + 1) * size];
            self.held_compliance
                .extend(self.held.iter().map(|&k| of_row[k]));
            for &column in &self.held {
                let (q, v) = (column / A, column % A);
                let mut sum = 0.0;
                for w in u..A {
                    for z in v..A {
                        sum += roots[p][w][u]
                            * self.compliance[(A * p + w) * size + A * q + z]
                            * roots[q][z][v];
                    }
                }
                m.push(sum);
            }
            m[i * n + i] += 1.0;
        }
        for i in 0..n {
            let (above, own) = m.split_at_mut(i * n);
            for j in 0..i {
                let above = &above[j * n..j * n + j + 1];
                own[j] = (own[j] - dot(&own[..j], &above[..j])) / above[j];
            }
            let left = own[i] - dot(&own[..i], &own[..i]);
            if left <= 0.0 {
                return;
            }
            own[i] = left.sqrt();
        }
        self.factor = m;
    }

    /// (L⁻¹ + S)⁻¹ of `sums`, those of S times a source over the blocks; 0 where no springs hold a block, and `None` where there
    /// is no correction.
    pub(super) fn moved(&mut self, sums: &[f64]) -> Option<&[f64]> {
        let n = self.held.len();
        if self.factor.is_empty() {
            return None;
        }
        // (L⁻¹ + G Gᵀ)⁻¹ = L − L G (1 + Gᵀ L G)⁻¹ Gᵀ L.
        let product = |x: &[f64], out: &mut Vec<f64>, compliance: &[f64]| {
            out.clear();
            out.extend(compliance.chunks_exact(n).map(|row| dot(row, x)));
        };
        let (roots, held) = (&self.roots, &self.held);
        let FarField {
            inner,
            outer,
            places,
            ..
        } = self;
        let value = |of: &[f64], unknown: usize| of.get(places[unknown]).copied().unwrap_or(0.0);
        inner.clear();
        inner.extend(held.iter().map(|&k| sums[k]));
        product(inner, outer, &self.held_compliance);
        inner.clear();
        inner.extend(held.iter().map(|&k| {
            let (p, u) = (k / A, k % A);
            let terms = (u..A).map(|w| roots[p][w][u] * value(outer, A * p + w));
            terms.sum::<f64>()
        }));
        let m = &self.factor;
        for i in 0..n {
            let sum = dot(&m[i * n..i * n + i], &inner[..i]);
            inner[i] = (inner[i] - sum) / m[i * n + i];
        }
        for i in (0..n).rev() {
            inner[i] /= m[i * n + i];
            let v = inner[i];
            for (left, of_row) in inner[..i].iter_mut().zip(&m[i * n..]) {
                *left -= of_row * v;
            }
        }
        self.moved.fill(0.0);
        for (k, &at) in held.iter().enumerate() {
            self.moved[at] = outer[k];
        }
        outer.clear();
        outer.extend(held.iter().map(|&k| {
            let (p, u) = (k / A, k % A);
            let terms = (0..=u).map(|w| roots[p][u][w] * value(inner, A * p + w));
            terms.sum::<f64>()
        }));
        product(outer, inner, &self.held_compliance);
        for (less, &at) in inner.iter().zip(held) {
            self.moved[at] -= less;
        }
        Some(&self.moved)
    }
}

/// The block of every cell of a grid that is cut into so many along x and y.
fn blocks_of(grid: Grid, [mx, my]: [usize; 2]) -> Vec<u32> {
    let rows = (0..grid.nx).map(|i| i * mx / grid.nx * my);
    let columns: Vec<usize> = (0..grid.ny).map(|j| j * my / grid.ny).collect();
    let blocks = rows.flat_map(|row| columns.iter().map(move |column| (row + column) as u32));
    blocks.collect()
}

/// Blocks along x and y, about as long as wide: as many as half the cells have rows, up to the most.
fn numbers(grid: Grid) -> [usize; 2] {
    let [lx, ly] = grid.size();
    let all = (grid.len() as f64).sqrt().min(MOST_BLOCKS);
    let within = |wanted: f64, cells: usize| {
        let most = (cells / LEAST_CELLS).max(1);
        (wanted.round() as usize).clamp(1, most)
    };
    let x = within((all * lx / ly).sqrt(), grid.nx);
    let y = within(all / x as f64, grid.ny);
    [within(all / y as f64, grid.nx), y]
}

/// As [`cell_integrals`] of a traction that is periodic over `lengths`, on one of so many `blocks`, averaged over the block that is `offset`
/// blocks away. The mean displacement is zero.
fn periodic_integrals(offset: [usize; 2], blocks: [usize; 2], lengths: [f64; 2]) -> CellIntegrals {
    let mut sum = CellIntegrals::default();
    let area = 1.0 / (blocks[0] * blocks[1]) as f64;
    // A wave's number, its phase at the offset, and its means over both blocks.
    let along = |axis: usize, wave: usize| {
        let part = wave as f64 / blocks[axis] as f64;
        let half = PI * part;
        let mean = if wave == 0 { 1.0 } else { half.sin() / half };
        let number = TAU * wave as f64 / lengths[axis];
        (number, TAU * part * offset[axis] as f64, mean * mean)
    };
    for m in 0..=WAVES * blocks[0] {
        let (x, phase_x, mean_x) = along(0, m);
        for n in 0..=WAVES * blocks[1] {
            if m + n == 0 {
                continue;
            }
            let (y, phase_y, mean_y) = along(1, n);
            // Of the waves ±m and ±n, those that differ.
            let count = if m == 0 || n == 0 { 2.0 } else { 4.0 };
            let k = x.hypot(y);
            // 1/r, y²/r³ and xy/r³ transform to 2π/k, 2π k_x²/k³ and −2π k_x k_y/k³.
            let size = count * TAU / k * mean_x * mean_y * area;
            let even = size * phase_x.cos() * phase_y.cos();
            sum.inverse += even;
            sum.xx += even * (y / k).powi(2);
            sum.yy += even * (x / k).powi(2);
            sum.xy += size * phase_x.sin() * phase_y.sin() * x * y / (k * k);
        }
    }
    sum
}

/// Lower Cholesky factor; a direction without spring has none.
fn root_of<const A: usize>(held: [[f64; A]; A]) -> [[f64; A]; A] {
    let mut root = [[0.0; A]; A];
    for u in 0..A {
        for v in 0..=u {
            let sum: f64 = (0..v).map(|w| root[u][w] * root[v][w]).sum();
            let left = held[u][v] - sum;
            if u == v {
                root[u][u] = if left > 0.0 { left.sqrt() } else { 0.0 };
            } else if root[v][v] > 0.0 {
                root[u][v] = left / root[v][v];
            }
        }
    }
    root
}
