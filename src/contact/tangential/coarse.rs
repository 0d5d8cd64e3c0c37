//! Far-field correction of the preconditioner, for the free cells and directions. See [`FarField`].

use super::vector::{Vector, dot, plus};
use crate::contact::far_field::FarField;
use crate::contact::half_space::HalfSpace;

/// Far field, and the springs of the free cells.
pub(super) struct Coarse<const A: usize> {
    far_field: FarField<A>,
    /// Block of each contact cell.
    block: Vec<u32>,
    /// Preconditioner applied to a unit displacement along each axis, in the free directions.
    pub(super) springs: [Vec<Vector<A>>; A],
    sums: Vec<f64>,
}

impl<const A: usize> Coarse<A> {
    pub(super) fn new(half_space: &HalfSpace, cells: &[usize]) -> Self {
        let (a, b) = (
            half_space.pair().compliance(),
            half_space.pair().lateral_compliance(),
        );
        let far_field = FarField::new(half_space, |cell| {
            let block = [[cell.xx, cell.xy], [cell.xy, cell.yy]];
            std::array::from_fn(|u| {
                std::array::from_fn(|v| {
                    let along = if u == v { a * cell.inverse } else { 0.0 };
                    along + b * block[u][v]
                })
            })
        });
        let blocks = far_field.blocks();
        Coarse {
            block: cells
                .iter()
                .filter_map(|&c| blocks.get(c).copied())
                .collect(),
            springs: std::array::from_fn(|_| vec![[0.0; A]; cells.len()]),
            sums: vec![0.0; far_field.size()],
            far_field,
        }
    }

    pub(super) fn exists(&self) -> bool {
        self.far_field.exists()
    }

    /// Prepares the correction from the springs. `unit` returns the displacement, along an axis on a cell, that made
    /// them.
    pub(super) fn prepare(&mut self, unit: impl Fn(usize, usize) -> Vector<A>) {
        let mut block_springs = vec![[[0.0; A]; A]; self.far_field.size() / A];
        for (cell, &block) in self.block.iter().enumerate() {
            for (u, row) in block_springs[block as usize].iter_mut().enumerate() {
                for (v, entry) in row.iter_mut().enumerate() {
                    *entry += dot(unit(u, cell), self.springs[v][cell]);
                }
            }
        }
        self.far_field.prepare(&block_springs);
    }

    /// Sums S `source` over the blocks.
    pub(super) fn sum_source(&mut self, source: &[Vector<A>]) {
        self.sums.fill(0.0);
        for (cell, (&block, r)) in self.block.iter().zip(source).enumerate() {
            for u in 0..A {
                self.sums[A * block as usize + u] += dot(self.springs[u][cell], *r);
            }
        }
    }

    /// `target` −= S (L⁻¹ + S)⁻¹ of the sums that [`Coarse::sum_source`] stored.
    pub(super) fn correct(&mut self, target: &mut [Vector<A>]) {
        let Some(displacement) = self.far_field.moved(&self.sums) else {
            return;
        };
        for (cell, (&block, z)) in self.block.iter().zip(target).enumerate() {
            for u in 0..A {
                *z = plus(
                    *z,
                    -displacement[A * block as usize + u],
                    self.springs[u][cell],
                );
            }
        }
    }
}
