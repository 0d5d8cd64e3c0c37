//! What the surface between the spots of a contact does, for the preconditioners of the contact solvers.
//!
//! A preconditioner M holds each free cell by springs to all others. Those to cells that are not free lead to the ground, as if
//! the surface between the spots stood still; in truth it moves with them, and the far field is softer. With S = M 1 the
//! springs to the ground, M = (M − S) + S, and springs that stand on the far field with its compliance L in place of the ground
//! give (M − S) + (S⁻¹ + L)⁻¹ = M − S (L⁻¹ + S)⁻¹ S. This stays positive definite, as M − S is that of springs between free cells.
//! L is taken on some blocks of cells, as a small dense matrix. A periodic contact goes without.
//!
//! The solvers own the springs of each cell and sum them up over the blocks; here are the blocks.

use super::half_space::{Boundary, HalfSpace};
use super::kernel::{CellIntegrals, cell_integrals};
use crate::grid::Grid;

/// Blocks along each side.
const BLOCKS: usize = 8;

/// Least cells along each side of a block.
const LEAST_CELLS: usize = 4;

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
    /// Cholesky factor of 1 + Gᵀ L G; empty where there is no correction.
    factor: Vec<f64>,
    moved: Vec<f64>,
    inner: Vec<f64>,
}

impl<const A: usize> FarField<A> {
    /// `compliance` gives the displacements of a point under tractions along the axes on a rectangle at the given offset.
    pub(super) fn new(
        half_space: &HalfSpace,
        compliance: impl Fn(CellIntegrals) -> [[f64; A]; A],
    ) -> Self {
        let grid = half_space.grid();
        let blocks = |n: usize| (n / LEAST_CELLS).clamp(1, BLOCKS);
        // With a compliance between nodes the far field is mostly theirs.
        let [mx, my] = match half_space.boundary() {
            Boundary::Free if half_space.nodal().is_none() => [blocks(grid.nx), blocks(grid.ny)],
            Boundary::Free | Boundary::Periodic => [0; 2],
        };
        let size = A * mx * my;
        let [lx, ly] = grid.size();
        let (dx, dy) = (lx / mx as f64, ly / my as f64);
        // Tractions summed over the cells of a block act on its whole area.
        let per_cell = grid.cell_area() / (dx * dy);
        let quadrant: Vec<CellIntegrals> = (0..mx * my)
            .map(|k| cell_integrals((k / my) as f64 * dx, (k % my) as f64 * dy, dx, dy))
            .collect();
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
        FarField {
            grid,
            numbers: [mx, my],
            compliance: matrix,
            size,
            roots: vec![[[0.0; A]; A]; mx * my],
            factor: Vec::new(),
            moved: vec![0.0; size],
            inner: vec![0.0; size],
        }
    }

    /// False for a periodic contact.
    pub(super) fn exists(&self) -> bool {
        self.size > 0
    }

    /// Unknowns: `axis` + A · `block`.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// The block of every cell of the grid; none where there are no blocks.
    pub(super) fn blocks(&self) -> Vec<u32> {
        let [mx, my] = self.numbers;
        let rows = (0..self.grid.nx).map(|i| i * mx / self.grid.nx * my);
        let columns: Vec<usize> = (0..self.grid.ny).map(|j| j * my / self.grid.ny).collect();
        let blocks = rows.flat_map(|row| columns.iter().map(move |column| (row + column) as u32));
        if self.exists() {
            blocks.collect()
        } else {
            Vec::new()
        }
    }

    /// Prepares the correction for the summed springs of the blocks.
    pub(super) fn prepare(&mut self, springs: &[[[f64; A]; A]]) {
        let n = self.size;
        for (root, springs) in self.roots.iter_mut().zip(springs) {
            *root = root_of(*springs);
        }
        // 1 + Gᵀ L G, and its factor in place.
        let mut m = std::mem::take(&mut self.factor);
        m.clear();
        m.resize(n * n, 0.0);
        for p in 0..n / A {
            for q in 0..=p {
                for u in 0..A {
                    for v in 0..A {
                        let mut sum = 0.0;
                        for w in u..A {
                            for z in v..A {
                                sum += self.roots[p][w][u]
                                    * self.compliance[(A * p + w) * n + A * q + z]
                                    * self.roots[q][z][v];
                            }
                        }
                        m[(A * p + u) * n + A * q + v] = sum;
                    }
                }
            }
        }
        for k in 0..n {
            m[k * n + k] += 1.0;
        }
        for i in 0..n {
            for j in 0..=i {
                let (a, b) = (&m[i * n..i * n + j], &m[j * n..j * n + j]);
                let sum: f64 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                let left = m[i * n + j] - sum;
                if i == j {
                    if left <= 0.0 {
                        return;
                    }
                    m[i * n + i] = left.sqrt();
                } else {
                    m[i * n + j] = left / m[j * n + j];
                }
            }
        }
        self.factor = m;
    }

    /// (L⁻¹ + S)⁻¹ of `sums`, those of S times a source over the blocks; 0 where no springs hold a block, and `None` where there
    /// is no correction.
    pub(super) fn moved(&mut self, sums: &mut [f64]) -> Option<&[f64]> {
        let n = self.size;
        if self.factor.is_empty() {
            return None;
        }
        let roots = &self.roots;
        let held = |k: usize| roots[k / A][k % A][k % A] > 0.0;
        for (k, sum) in sums.iter_mut().enumerate() {
            *sum = if held(k) { *sum } else { 0.0 };
        }
        // (L⁻¹ + G Gᵀ)⁻¹ = L − L G (1 + Gᵀ L G)⁻¹ Gᵀ L.
        let product = |x: &[f64], out: &mut [f64], compliance: &[f64]| {
            for (out, row) in out.iter_mut().zip(compliance.chunks_exact(n)) {
                *out = row.iter().zip(x).map(|(a, b)| a * b).sum();
            }
        };
        product(sums, &mut self.moved, &self.compliance);
        let inner = &mut self.inner;
        for p in 0..n / A {
            for u in 0..A {
                inner[A * p + u] = (u..A)
                    .map(|w| self.roots[p][w][u] * self.moved[A * p + w])
                    .sum();
            }
        }
        let m = &self.factor;
        for i in 0..n {
            let row = m[i * n..i * n + i].iter().zip(inner.iter());
            let sum: f64 = row.map(|(a, b)| a * b).sum();
            inner[i] = (inner[i] - sum) / m[i * n + i];
        }
        for i in (0..n).rev() {
            inner[i] /= m[i * n + i];
            let v = inner[i];
            for j in 0..i {
                inner[j] -= m[i * n + j] * v;
            }
        }
        for p in 0..n / A {
            for u in 0..A {
                sums[A * p + u] = (0..=u)
                    .map(|w| self.roots[p][u][w] * inner[A * p + w])
                    .sum();
            }
        }
        product(sums, inner, &self.compliance);
        for (k, (moved, less)) in self.moved.iter_mut().zip(inner.iter()).enumerate() {
            *moved = if held(k) { *moved - less } else { 0.0 };
        }
        Some(&self.moved)
    }
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
