//! A coarse correction of the preconditioner, for contacts with gaps between their spots.
//!
//! The preconditioner M holds each free cell by springs to all others. Those to cells that are not free lead to the ground, as if
//! the surface between the spots stood still; in truth it moves with them, and the far field is softer. With S = M 1 the
//! springs to the ground, M = (M − S) + S, and springs that stand on the far field with its compliance L in place of the ground
//! give (M − S) + (S⁻¹ + L)⁻¹ = M − S (L⁻¹ + S)⁻¹ S. This stays positive definite, as M − S is that of springs between free cells.
//! L is taken on some blocks of cells, as a small dense matrix. A periodic contact goes without.

use super::vector::{Vector, dot, plus};
use crate::contact::half_space::{Boundary, HalfSpace};
use crate::contact::kernel::cell_integrals;

/// Blocks along each side.
const BLOCKS: usize = 8;

/// Least cells along each side of a block.
const LEAST_CELLS: usize = 4;

/// The blocks, and what the correction needs of the free cells.
pub(super) struct Coarse<const A: usize> {
    /// Block of each contact cell.
    block: Vec<u32>,
    /// Compliance of the far field between blocks, `size` × `size`; unknown axis + A · block.
    compliance: Vec<f64>,
    size: usize,
    /// What the preconditioner makes of a unit displacement along each axis, in the free directions.
    pub(super) springs: [Vec<Vector<A>>; A],
    /// Cholesky factors of the springs of each block.
    roots: Vec<[[f64; A]; A]>,
    /// Cholesky factor of 1 + Gᵀ L G, G the roots; empty where there is no correction.
    factor: Vec<f64>,
    sums: Vec<f64>,
    moved: Vec<f64>,
    inner: Vec<f64>,
}

impl<const A: usize> Coarse<A> {
    pub(super) fn new(half_space: &HalfSpace, cells: &[usize]) -> Self {
        let grid = half_space.grid();
        let blocks = |n: usize| (n / LEAST_CELLS).clamp(1, BLOCKS);
        let (mx, my) = match half_space.boundary() {
            Boundary::Free => (blocks(grid.nx), blocks(grid.ny)),
            Boundary::Periodic => (0, 0),
        };
        let block = cells.iter().map(|&c| {
            let (i, j) = grid.cell(c);
            ((i * mx / grid.nx) * my + j * my / grid.ny) as u32
        });
        let size = A * mx * my;
        let [lx, ly] = grid.size();
        let (dx, dy) = (lx / mx as f64, ly / my as f64);
        let (a, b) = (
            half_space.pair().compliance(),
            half_space.pair().lateral_compliance(),
        );
        // Sums of shear over the cells of a block act on its whole area.
        let per_cell = grid.cell_area() / (dx * dy);
        let table: Vec<[f64; 3]> = (0..mx * my)
            .map(|k| {
                let cell = cell_integrals((k / my) as f64 * dx, (k % my) as f64 * dy, dx, dy);
                [
                    a * cell.inverse + b * cell.xx,
                    a * cell.inverse + b * cell.yy,
                    b * cell.xy,
                ]
                .map(|v| v * per_cell)
            })
            .collect();
        let mut compliance = vec![0.0; size * size];
        for p in 0..mx * my {
            for q in 0..mx * my {
                let (i, j) = ((p / my).abs_diff(q / my), (p % my).abs_diff(q % my));
                let [xx, yy, xy] = table[i * my + j];
                let mirrored = (p / my < q / my) != (p % my < q % my);
                let xy = if mirrored { -xy } else { xy };
                for u in 0..A {
                    for v in 0..A {
                        compliance[(A * p + u) * size + A * q + v] = match (u, v) {
                            (0, 0) => xx,
                            (1, 1) => yy,
                            _ => xy,
                        };
                    }
                }
            }
        }
        Coarse {
            block: block.collect(),
            compliance,
            size,
            springs: std::array::from_fn(|_| vec![[0.0; A]; cells.len()]),
            roots: vec![[[0.0; A]; A]; mx * my],
            factor: Vec::new(),
            sums: vec![0.0; size],
            moved: vec![0.0; size],
            inner: vec![0.0; size],
        }
    }

    pub(super) fn exists(&self) -> bool {
        self.size > 0
    }

    /// Prepares the correction for the springs that are set; `unit` is what they were made of, along an axis on a cell.
    pub(super) fn prepare(&mut self, unit: impl Fn(usize, usize) -> Vector<A>) {
        let n = self.size;
        self.factor.clear();
        self.roots.fill([[0.0; A]; A]);
        for (cell, &block) in self.block.iter().enumerate() {
            let held = &mut self.roots[block as usize];
            for u in 0..A {
                for v in 0..A {
                    held[u][v] += dot(unit(u, cell), self.springs[v][cell]);
                }
            }
        }
        for root in &mut self.roots {
            *root = root_of(*root);
        }
        for (cell, &block) in self.block.iter().enumerate() {
            let root = &self.roots[block as usize];
            for u in 0..A {
                if root[u][u] == 0.0 {
                    self.springs[u][cell] = [0.0; A];
                }
            }
        }
        // 1 + Gᵀ L G, and its factor in place.
        let mut m = std::mem::take(&mut self.factor);
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

    /// Sums S `source` over the blocks.
    pub(super) fn look(&mut self, source: &[Vector<A>]) {
        if self.factor.is_empty() {
            return;
        }
        self.sums.fill(0.0);
        for (cell, (&block, r)) in self.block.iter().zip(source).enumerate() {
            for u in 0..A {
                self.sums[A * block as usize + u] += dot(self.springs[u][cell], *r);
            }
        }
    }

    /// `target` −= S (L⁻¹ + S)⁻¹ of the sums that were looked at.
    pub(super) fn correct(&mut self, target: &mut [Vector<A>]) {
        let n = self.size;
        if self.factor.is_empty() {
            return;
        }
        // (L⁻¹ + G Gᵀ)⁻¹ = L − L G (1 + Gᵀ L G)⁻¹ Gᵀ L.
        let product = |x: &[f64], out: &mut [f64], compliance: &[f64]| {
            for (out, row) in out.iter_mut().zip(compliance.chunks_exact(n)) {
                *out = row.iter().zip(x).map(|(a, b)| a * b).sum();
            }
        };
        product(&self.sums, &mut self.moved, &self.compliance);
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
            let sum: f64 = m[i * n..i * n + i]
                .iter()
                .zip(inner.iter())
                .map(|(a, b)| a * b)
                .sum();
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
                self.sums[A * p + u] = (0..=u)
                    .map(|w| self.roots[p][u][w] * inner[A * p + w])
                    .sum();
            }
        }
        product(&self.sums, inner, &self.compliance);
        for (moved, less) in self.moved.iter_mut().zip(inner.iter()) {
            *moved -= less;
        }
        for (cell, (&block, z)) in self.block.iter().zip(target).enumerate() {
            for u in 0..A {
                *z = plus(
                    *z,
                    -self.moved[A * block as usize + u],
                    self.springs[u][cell],
                );
            }
        }
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
