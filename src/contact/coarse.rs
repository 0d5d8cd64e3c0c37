//! The [`FarField`]'s correction of a preconditioner of one field, on the cells that are free in it.

use super::far_field::FarField;
use super::half_space::HalfSpace;
use super::kernel::CellIntegrals;

/// Part of the free cells that were not free when the springs were set, at which they are set anew. The neighbours of such a cell
/// have kept a spring to the ground where there is none left: with more of them M − S ceases to be positive.
const CAME: f64 = 0.003;

/// The same for cells that are no longer free: springs that are then too soft cost iterations, no more.
const GONE: f64 = 0.1;

/// The blocks, and the springs of the cells that were free when they were set.
pub(super) struct Coarse {
    far_field: FarField<1>,
    /// Block of each cell of the grid.
    block: Vec<u32>,
    /// What the preconditioner makes of a unit displacement of the free cells; 0 on all others.
    springs: Vec<f64>,
    /// Cells with a spring.
    count: usize,
    sums: Vec<f64>,
}

impl Coarse {
    /// `compliance` gives the displacement of a point under the field's traction on a rectangle at the given offset.
    pub(super) fn new(half_space: &HalfSpace, compliance: impl Fn(CellIntegrals) -> f64) -> Self {
        let far_field = FarField::new(half_space, |cell| [[compliance(cell)]]);
        let block = far_field.blocks();
        Coarse {
            springs: vec![0.0; block.len()],
            block,
            count: 0,
            sums: vec![0.0; far_field.size()],
            far_field,
        }
    }

    /// False for a periodic contact, which goes without.
    pub(super) fn exists(&self) -> bool {
        self.far_field.exists()
    }

    /// True where the springs are those of other cells than the `free` ones.
    pub(super) fn is_stale(&self, free: &[usize]) -> bool {
        if !self.exists() {
            return false;
        }
        let kept = free.iter().filter(|&&c| self.springs[c] != 0.0).count();
        let (came, gone) = (free.len() - kept, self.count.saturating_sub(kept));
        let all = free.len() as f64;
        came as f64 > CAME * all || gone as f64 > GONE * all
    }

    /// Sets the springs of the `free` cells.
    pub(super) fn prepare(&mut self, free: &[usize], spring: impl Fn(usize) -> f64) {
        let mut held = vec![[[0.0]]; self.far_field.size()];
        self.springs.fill(0.0);
        self.count = free.len();
        for &c in free {
            self.springs[c] = spring(c);
            held[self.block[c] as usize][0][0] += self.springs[c];
        }
        self.far_field.prepare(&held);
    }

    /// `target` −= S (L⁻¹ + S)⁻¹ S `source`, values on the `free` cells.
    pub(super) fn correct(&mut self, free: &[usize], source: &[f64], target: &mut [f64]) {
        if self.count == 0 {
            return;
        }
        self.sums.fill(0.0);
        for (&c, r) in free.iter().zip(source) {
            self.sums[self.block[c] as usize] += self.springs[c] * r;
        }
        let Some(moved) = self.far_field.moved(&mut self.sums) else {
            return;
        };
        for (&c, z) in free.iter().zip(target) {
            *z -= self.springs[c] * moved[self.block[c] as usize];
        }
    }
}
