//! Far-field correction of the preconditioner of one field, on its free cells. See [`FarField`].

use super::far_field::FarField;
use super::half_space::HalfSpace;
use super::kernel::CellIntegrals;

/// Fraction of newly free cells, relative to all free cells, above which the springs are reset. The neighbours of a
/// newly free cell still have a spring to the ground that no longer exists. If more cells were newly free, M − S would
/// not be positive.
const MAX_ADDED_FRACTION: f64 = 0.003;

/// Largest ratio of the springs on cells that are no longer free to all free cells. Above `MAX_REMOVED_FRACTION`, the
/// solver resets the springs. The neighbours of a cell that is no longer free lack a spring to the ground. Springs to
/// the ground that are too soft only cost iterations.
const MAX_REMOVED_FRACTION: f64 = 0.1;

/// Limit of the pairwise update of the springs: changed cells times free cells, per cell of the grid. Beyond the limit,
/// a transform is faster than the pairwise update.
const MAX_PAIRS_PER_CELL: usize = 16;

/// Far field, and the springs of the cells that were free when the springs were set.
pub(super) struct FarFieldCorrection {
    far_field: FarField<1>,
    /// Block of each cell of the grid.
    block: Vec<u32>,
    /// Springs to the ground, one per cell: the preconditioner applied to a unit displacement of the free cells.
    springs: Vec<f64>,
    /// Cells that were free when the springs were set, in ascending order, and a flag for every cell of the grid.
    cells: Vec<usize>,
    is_free: Vec<bool>,
    /// Preconditioner applied to a unit displacement of the first cell, on a quadrant of cells. Empty until needed.
    kernel: Vec<f64>,
    columns: usize,
    /// Contribution of the mean over a period to each kernel value. The far field has no mean, so the springs exclude
    /// it.
    mean: f64,
    sums: Vec<f64>,
}

impl FarFieldCorrection {
    /// `compliance` returns the displacement of a point under the field's traction on a rectangle at the given offset.
    pub(super) fn new(half_space: &HalfSpace, compliance: impl Fn(CellIntegrals) -> f64) -> Self {
        let far_field = FarField::new(half_space, |cell| [[compliance(cell)]]);
        let block = far_field.blocks();
        FarFieldCorrection {
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

    /// Returns false if there is no correction because nodes provide the far field.
    pub(super) fn has_correction(&self) -> bool {
        self.far_field.exists()
    }

    /// Returns true if too many cells in `free` have no spring, or if too many cells outside `free` have a spring.
    pub(super) fn is_stale(&self, free: &[usize]) -> bool {
        if !self.has_correction() {
            return false;
        }
        let (added, removed) = self.changes(free);
        let all = free.len() as f64;
        added as f64 > MAX_ADDED_FRACTION * all || removed as f64 > MAX_REMOVED_FRACTION * all
    }

    /// Counts the `free` cells without a spring, and the springs on cells that are not free.
    fn changes(&self, free: &[usize]) -> (usize, usize) {
        let common = free.iter().filter(|&&c| self.is_free[c]).count();
        (free.len() - common, self.cells.len() - common)
    }

    /// Returns true if updating the springs to the `free` cells pair by pair is cheaper than a transform. The update
    /// needs the kernel.
    pub(super) fn can_update(&self, free: &[usize]) -> bool {
        let (added, removed) = self.changes(free);
        !self.cells.is_empty()
            && (added + removed) * free.len() <= MAX_PAIRS_PER_CELL * self.block.len()
    }

    /// Returns the kernel if the kernel is still empty. The caller fills the empty kernel with the preconditioner's
    /// tractions for a unit displacement of the first cell.
    pub(super) fn kernel(&mut self) -> Option<&mut Vec<f64>> {
        self.kernel.is_empty().then_some(&mut self.kernel)
    }

    /// Updates the springs to the `free` cells, pair by pair. `scaling` scales both the displacement and the pressure.
    pub(super) fn update_springs(&mut self, free: &[usize], scaling: impl Fn(usize) -> f64) {
        let (columns, mean) = (self.columns, self.mean);
        let kernel = &self.kernel;
        let between = |a: usize, b: usize| {
            let rows = (a / columns).abs_diff(b / columns);
            kernel[rows * columns + (a % columns).abs_diff(b % columns)] - mean
        };
        let mut cells = std::mem::take(&mut self.cells);
        let mut is_still_free = vec![false; self.block.len()];
        free.iter().for_each(|&c| is_still_free[c] = true);
        let (remaining, removed): (Vec<usize>, Vec<usize>) =
            cells.iter().partition(|&&c| is_still_free[c]);
        for d in removed {
            for &c in &remaining {
                self.springs[c] -= scaling(c) * between(c, d) * scaling(d);
            }
            (self.springs[d], self.is_free[d]) = (0.0, false);
        }
        for &d in free {
            if self.is_free[d] {
                continue;
            }
            self.is_free[d] = true;
            // Iterate over the cells that remain free, and over the cells that the loop over `d` has already added.
            for &c in free.iter().filter(|&&c| self.is_free[c]) {
                let spring = scaling(c) * between(c, d) * scaling(d);
                self.springs[c] += spring;
                self.springs[d] += if c == d { 0.0 } else { spring };
            }
        }
        cells.clear();
        cells.extend_from_slice(free);
        self.cells = cells;
        self.prepare_far_field();
    }

    /// Sets the springs of the `free` cells. `spring` is the preconditioner applied to their unit displacement, both
    /// scaled.
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
        self.prepare_far_field();
    }

    fn prepare_far_field(&mut self) {
        let mut block_springs = vec![[[0.0]]; self.far_field.size()];
        for &c in &self.cells {
            block_springs[self.block[c] as usize][0][0] += self.springs[c];
        }
        self.far_field.prepare(&block_springs);
    }

    /// `target` −= S (L⁻¹ + S)⁻¹ S `source`, with values on the `free` cells.
    pub(super) fn correct(&mut self, free: &[usize], source: &[f64], target: &mut [f64]) {
        if self.cells.is_empty() {
            return;
        }
        self.sums.fill(0.0);
        for (&c, r) in free.iter().zip(source) {
            self.sums[self.block[c] as usize] += self.springs[c] * r;
        }
        let Some(displacement) = self.far_field.moved(&self.sums) else {
            return;
        };
        for (&c, z) in free.iter().zip(target) {
            *z -= self.springs[c] * displacement[self.block[c] as usize];
        }
    }
}
