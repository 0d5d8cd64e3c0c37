//! Far field of a contact: the displacement of the surface between the spots, for the preconditioners of the solvers.
//!
//! A preconditioner M connects each free cell by springs to all other cells. A spring to a cell that is not free acts
//! as a spring to the ground. A spring to the ground assumes a fixed surface between the spots. The real surface
//! between the spots moves, so the real far field is softer. Let S = M 1 be the springs to the ground, and split M = (M
//! − S) + S. A far field of compliance L replaces the ground. The preconditioner becomes (M − S) + (S⁻¹ + L)⁻¹ = M − S
//! (L⁻¹ + S)⁻¹ S. The result stays positive definite, because M − S consists of springs between free cells. L is a
//! small dense matrix between blocks of cells.
//!
//! The module `far_field` stores the blocks of cells. The solvers store the springs of each cell, and sum the springs
//! over each block.

use std::f64::consts::{PI, TAU};

use super::half_space::{Boundary, HalfSpace};
use super::kernel::{CellIntegrals, cell_integrals};
use super::sums::dot;
use crate::grid::Grid;

/// Largest number of blocks. With 144 blocks, one factorisation of the matrix between blocks takes at most the time of
/// two transforms of the grid.
const MOST_BLOCKS: f64 = 144.0;

/// Smallest number of cells along each side of a block.
const LEAST_CELLS: usize = 2;

/// Waves per block and side that represent a periodic contact. The next waves contribute some parts in a thousand.
const WAVES: usize = 2;

/// Compliance of the far field between blocks, with `A` displacements per block.
pub(super) struct FarField<const A: usize> {
    grid: Grid,
    /// Number of blocks along x and y.
    numbers: [usize; 2],
    /// Compliance between blocks, `size` × `size` with `size` = A · blocks; unknown `axis` + A · `block` \[m/Pa\].
    compliance: Vec<f64>,
    size: usize,
    /// G, the Cholesky factor of the springs of each block.
    roots: Vec<[[f64; A]; A]>,
    /// Unknowns with springs. The correction needs no unknown without springs.
    sprung_unknowns: Vec<usize>,
    /// Position of each unknown in `sprung_unknowns`, or `usize::MAX` for an unknown without springs.
    positions: Vec<usize>,
    /// L between the unknowns of `sprung_unknowns`, and the Cholesky factor of 1 + Gᵀ L G. The factor is empty if there
    /// is no correction.
    sprung_compliance: Vec<f64>,
    factor: Vec<f64>,
    moved: Vec<f64>,
    inner: Vec<f64>,
    outer: Vec<f64>,
}

impl<const A: usize> FarField<A> {
    /// `compliance` returns the displacements of a point under tractions along each axis on a rectangle at the given
    /// offset.
    pub(super) fn new(
        half_space: &HalfSpace,
        compliance: impl Fn(CellIntegrals) -> [[f64; A]; A],
    ) -> Self {
        let grid = half_space.grid();
        let [lx, ly] = grid.size();
        // If a mesh takes compliance away from the half spaces, hardly any far field is left. If the bodies add
        // compliance, the added compliance is most of the far field.
        let added = half_space.nodal().filter(|nodal| nodal.shear.is_none());
        let [mx, my] = match (half_space.nodal(), added) {
            (None, _) | (_, Some(_)) => numbers(grid),
            (Some(_), None) => [0; 2],
        };
        let size = A * mx * my;
        let (dx, dy) = (lx / mx as f64, ly / my as f64);
        // The tractions of a block are summed over its cells, and act on its whole area.
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
            // The nodal compliance acts along the normal only. The springs act on that axis as well.
            for (place, value) in nodal
                .block_compliance(&blocks_of(grid, [mx, my]))
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
            sprung_unknowns: Vec::new(),
            positions: vec![usize::MAX; size],
            sprung_compliance: Vec::new(),
            factor: Vec::new(),
            moved: vec![0.0; size],
            inner: Vec::new(),
            outer: Vec::new(),
        }
    }

    /// Returns false if there is no correction because nodes provide the far field.
    pub(super) fn exists(&self) -> bool {
        self.size > 0
    }

    /// Returns the number of unknowns, A per block. The unknown of an axis is `axis` + A · `block`.
    pub(super) fn size(&self) -> usize {
        self.size
    }

    /// Returns the block of every cell of the grid; empty if there are no blocks.
    pub(super) fn blocks(&self) -> Vec<u32> {
        match self.exists() {
            true => blocks_of(self.grid, self.numbers),
            false => Vec::new(),
        }
    }

    /// Prepares the correction. `springs` are the springs of the cells, summed over each block.
    pub(super) fn prepare(&mut self, springs: &[[[f64; A]; A]]) {
        for (root, springs) in self.roots.iter_mut().zip(springs) {
            *root = root_of(*springs);
        }
        let (size, roots) = (self.size, &self.roots);
        self.sprung_unknowns.clear();
        self.sprung_unknowns
            .extend((0..size).filter(|k| roots[k / A][k % A][k % A] > 0.0));
        self.positions.fill(usize::MAX);
        for (place, &k) in self.sprung_unknowns.iter().enumerate() {
            self.positions[k] = place;
        }
        let n = self.sprung_unknowns.len();
        self.sprung_compliance.clear();
        let mut m = std::mem::take(&mut self.factor);
        m.clear();
        // Assemble 1 + Gᵀ L G, and factorise it in place.
        for (i, &row) in self.sprung_unknowns.iter().enumerate() {
            let (p, u) = (row / A, row % A);
            let compliance_row = &self.compliance[row * size..(row + 1) * size];
            self.sprung_compliance
                .extend(self.sprung_unknowns.iter().map(|&k| compliance_row[k]));
            for &column in &self.sprung_unknowns {
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
            let remainder = own[i] - dot(&own[..i], &own[..i]);
            if remainder <= 0.0 {
                return;
            }
            own[i] = remainder.sqrt();
        }
        self.factor = m;
    }

    /// Applies (L⁻¹ + S)⁻¹ to `sums`, the sums over each block of S times a source. Unknowns without springs get 0.
    /// Returns `None` if there is no correction.
    pub(super) fn moved(&mut self, sums: &[f64]) -> Option<&[f64]> {
        let n = self.sprung_unknowns.len();
        if self.factor.is_empty() {
            return None;
        }
        // (L⁻¹ + G Gᵀ)⁻¹ = L − L G (1 + Gᵀ L G)⁻¹ Gᵀ L.
        let product = |x: &[f64], out: &mut Vec<f64>, compliance: &[f64]| {
            out.clear();
            out.extend(compliance.chunks_exact(n).map(|row| dot(row, x)));
        };
        let (roots, held) = (&self.roots, &self.sprung_unknowns);
        let FarField {
            inner,
            outer,
            positions: places,
            ..
        } = self;
        let value =
            |values: &[f64], unknown: usize| values.get(places[unknown]).copied().unwrap_or(0.0);
        inner.clear();
        inner.extend(held.iter().map(|&k| sums[k]));
        product(inner, outer, &self.sprung_compliance);
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
            for (value, factor) in inner[..i].iter_mut().zip(&m[i * n..]) {
                *value -= factor * v;
            }
        }
        self.moved.fill(0.0);
        for (k, &unknown) in held.iter().enumerate() {
            self.moved[unknown] = outer[k];
        }
        outer.clear();
        outer.extend(held.iter().map(|&k| {
            let (p, u) = (k / A, k % A);
            let terms = (0..=u).map(|w| roots[p][u][w] * value(inner, A * p + w));
            terms.sum::<f64>()
        }));
        product(outer, inner, &self.sprung_compliance);
        for (reduction, &unknown) in inner.iter().zip(held) {
            self.moved[unknown] -= reduction;
        }
        Some(&self.moved)
    }
}

/// Returns the block of every cell of a grid that is divided into `mx` × `my` blocks.
fn blocks_of(grid: Grid, [mx, my]: [usize; 2]) -> Vec<u32> {
    let rows = (0..grid.nx).map(|i| i * mx / grid.nx * my);
    let columns: Vec<usize> = (0..grid.ny).map(|j| j * my / grid.ny).collect();
    let blocks = rows.flat_map(|row| columns.iter().map(move |column| (row + column) as u32));
    blocks.collect()
}

/// Chooses the number of blocks along x and y, so that blocks are about as long as wide. The total number of blocks is
/// about the root of the number of cells, up to [`MOST_BLOCKS`].
fn numbers(grid: Grid) -> [usize; 2] {
    let [lx, ly] = grid.size();
    let all = (grid.len() as f64).sqrt().min(MOST_BLOCKS);
    let clamped = |number: f64, cells: usize| {
        let most = (cells / LEAST_CELLS).max(1);
        (number.round() as usize).clamp(1, most)
    };
    let x = clamped((all * lx / ly).sqrt(), grid.nx);
    let y = clamped(all / x as f64, grid.ny);
    [clamped(all / y as f64, grid.nx), y]
}

/// Computes the [`cell_integrals`] of a traction on one block. The traction is periodic over `lengths`, and `blocks`
/// divides a period into blocks. The function averages the integrals over a block at a distance of `offset` blocks from
/// the loaded block. The mean displacement is zero.
fn periodic_integrals(offset: [usize; 2], blocks: [usize; 2], lengths: [f64; 2]) -> CellIntegrals {
    let mut sum = CellIntegrals::default();
    let area = 1.0 / (blocks[0] * blocks[1]) as f64;
    // Wave number, phase at the offset, and mean of the wave over both blocks.
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
            // Number of distinct waves among ±m and ±n.
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

/// Returns the lower Cholesky factor. A direction without springs gets a zero column.
fn root_of<const A: usize>(springs: [[f64; A]; A]) -> [[f64; A]; A] {
    let mut root = [[0.0; A]; A];
    for u in 0..A {
        for v in 0..=u {
            let sum: f64 = (0..v).map(|w| root[u][w] * root[v][w]).sum();
            let remainder = springs[u][v] - sum;
            if u == v {
                root[u][u] = if remainder > 0.0 {
                    remainder.sqrt()
                } else {
                    0.0
                };
            } else if root[v][v] > 0.0 {
                root[u][v] = remainder / root[v][v];
            }
        }
    }
    root
}
