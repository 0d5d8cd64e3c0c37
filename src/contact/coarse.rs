//! The [`FarField`]'s correction of a preconditioner of one field, on the cells that are free in it.

use super::far_field::FarField;
use super::half_space::HalfSpace;
use super::kernel::CellIntegrals;

/// Part of the free cells that were not free when the springs were set, at which they are set anew. The neighbours of such a cell
/// have kept a spring to the ground where there is none left: with more of them M − S ceases to be positive.
const CAME: f64 = 0.003;

/// Springs of cells that are no longer free, over the free cells, at which springs are set anew: springs that are too soft cost iterations, no more.
const GONE: f64 = 0.1;

/// Pairs of a cell that came or went and a free one, over the cells of the grid, that are summed up one by one; of more of them a
/// transform is the quicker sum.
const ONE_BY_ONE: usize = 16;

/// The blocks, and the springs of the cells that were free when they were set.
pub(super) struct Coarse {
    far_field: FarField<1>,
    /// Block of each cell of the grid.
    block: Vec<u32>,
    /// What the preconditioner makes of a unit displacement of the free cells, on them.
    springs: Vec<f64>,
    /// The cells that were free then, in ascending order, and whether a cell is one of them.
    cells: Vec<usize>,
    is_free: Vec<bool>,
    /// The preconditioner's pressure on the cells of a quadrant under a unit displacement of the first; none until it is asked for.
    kernel: Vec<f64>,
    columns: usize,
    /// What of it is that of the mean over a period, for which no free cell stands: the far field has none.
    mean: f64,
    sums: Vec<f64>,
}

impl Coarse {
    /// `compliance` gives the displacement of a point under the field's traction on a rectangle at the given offset.
    pub(super) fn new(half_space: &HalfSpace, compliance: impl Fn(CellIntegrals) -> f64) -> Self {
        let far_field = FarField::new(half_space, |cell| [[compliance(cell)]]);
        let block = far_field.blocks();
        Coarse {
            springs: vec![0.0; block.len()],
            is_free: vec![false; block.len()],
            cells: Vec::new(),
            kernel: Vec::new(),
            columns: half_space.grid().ny,
            mean: half_space.mean_stiffness()[0],
            block,
            sums: vec![0.0; far_field.size()],
            far_field,
        }
    }

    /// False where the far field is that of nodes.
    pub(super) fn exists(&self) -> bool {
        self.far_field.exists()
    }

    /// True where the springs are those of other cells than the `free` ones.
    pub(super) fn is_stale(&self, free: &[usize]) -> bool {
        if !self.exists() {
            return false;
        }
        let (came, gone) = self.changes(free);
        let all = free.len() as f64;
        came as f64 > CAME * all || gone as f64 > GONE * all
    }

    /// How many of the `free` cells have no spring, and how many springs are no free cell's.
    fn changes(&self, free: &[usize]) -> (usize, usize) {
        let kept = free.iter().filter(|&&c| self.is_free[c]).count();
        (free.len() - kept, self.cells.len() - kept)
    }

    /// True where springs of the `free` cells are made of the present ones with less work than a transform. They want a kernel.
    pub(super) fn is_near(&self, free: &[usize]) -> bool {
        let (came, gone) = self.changes(free);
        !self.cells.is_empty() && (came + gone) * free.len() <= ONE_BY_ONE * self.block.len()
    }

    /// The preconditioner's pressure under a unit displacement of the first cell, where it is not known.
    pub(super) fn kernel(&mut self) -> Option<&mut Vec<f64>> {
        self.kernel.is_empty().then_some(&mut self.kernel)
    }

    /// Changes the springs to those of the `free` cells, cell by cell. `scaling` is that of the displacement and of the pressure.
    pub(super) fn follow(&mut self, free: &[usize], scaling: impl Fn(usize) -> f64) {
        let (columns, mean) = (self.columns, self.mean);
        let kernel = &self.kernel;
        let between = |a: usize, b: usize| {
            let rows = (a / columns).abs_diff(b / columns);
            kernel[rows * columns + (a % columns).abs_diff(b % columns)] - mean
        };
        let mut cells = std::mem::take(&mut self.cells);
        let mut stays = vec![false; self.block.len()];
        free.iter().for_each(|&c| stays[c] = true);
        let (kept, gone): (Vec<usize>, Vec<usize>) = cells.iter().partition(|&&c| stays[c]);
        for d in gone {
            for &c in &kept {
                self.springs[c] -= scaling(c) * between(c, d) * scaling(d);
            }
            (self.springs[d], self.is_free[d]) = (0.0, false);
        }
        for &d in free {
            if self.is_free[d] {
                continue;
            }
            self.is_free[d] = true;
            // All that are free by now: those of before that stay, and those that have come.
            for &c in free.iter().filter(|&&c| self.is_free[c]) {
                let spring = scaling(c) * between(c, d) * scaling(d);
                self.springs[c] += spring;
                self.springs[d] += if c == d { 0.0 } else { spring };
            }
        }
        cells.clear();
        cells.extend_from_slice(free);
        self.cells = cells;
        self.hold();
    }

    /// Sets the springs of the `free` cells to what the preconditioner makes of their unit displacement, both scaled.
    pub(super) fn prepare(
        &mut self,
        free: &[usize],
        spring: impl Fn(usize) -> f64,
        scaling: impl Fn(usize) -> f64,
    ) {
        let mean = self.mean * free.iter().map(|&c| scaling(c)).sum::<f64>();
        for &c in &self.cells {
            (self.springs[c], self.is_free[c]) = (0.0, false);
        }
        self.cells.clear();
        self.cells.extend_from_slice(free);
        for &c in free {
            (self.springs[c], self.is_free[c]) = (spring(c) - mean * scaling(c), true);
        }
        self.hold();
    }

    fn hold(&mut self) {
        let mut held = vec![[[0.0]]; self.far_field.size()];
        for &c in &self.cells {
            held[self.block[c] as usize][0][0] += self.springs[c];
        }
        self.far_field.prepare(&held);
    }

    /// `target` −= S (L⁻¹ + S)⁻¹ S `source`, values on the `free` cells.
    pub(super) fn correct(&mut self, free: &[usize], source: &[f64], target: &mut [f64]) {
        if self.cells.is_empty() {
            return;
        }
        self.sums.fill(0.0);
        for (&c, r) in free.iter().zip(source) {
            self.sums[self.block[c] as usize] += self.springs[c] * r;
        }
        let Some(moved) = self.far_field.moved(&self.sums) else {
            return;
        };
        for (&c, z) in free.iter().zip(target) {
            *z -= self.springs[c] * moved[self.block[c] as usize];
        }
    }
}
