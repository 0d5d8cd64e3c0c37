//! Block-diagonal matrices of many small square blocks.

use super::{RowMatrix, single, vectorised};

/// Number of blocks that one pass multiplies. The processor keeps the sums of one pass in registers.
const SIDE_BY_SIDE: usize = 32;

/// Block-diagonal matrix of square blocks of one size, for repeated products with vectors.
///
/// A product takes as long as reading the matrix, so the entries and the arithmetic are in single precision. The matrix
/// stores entry (i, j) of all blocks contiguously. The compiler can then vectorize the loop over the blocks, even for
/// small blocks.
#[derive(Debug, Clone, PartialEq)]
pub struct Blocks {
    /// Number of blocks, padded with zero blocks to a multiple of [`SIDE_BY_SIDE`].
    count: usize,
    width: usize,
    /// Entry (i, j) of block b is at `(i * width + j) * count + b`.
    values: Vec<f32>,
}

impl Blocks {
    /// Builds the matrix from blocks of `width` rows and columns each.
    pub fn new<'a>(width: usize, blocks: impl ExactSizeIterator<Item = &'a RowMatrix>) -> Blocks {
        let count = blocks.len().next_multiple_of(SIDE_BY_SIDE);
        let mut values = vec![0.0; width * width * count];
        for (b, block) in blocks.enumerate() {
            assert_eq!((block.rows(), block.columns()), (width, width));
            for (place, value) in single(block.values()).iter().enumerate() {
                values[place * count + b] = *value;
            }
        }
        Blocks {
            count,
            width,
            values,
        }
    }

    /// Returns the product with a vector that is ordered block by block.
    pub fn apply(&self, vector: &[f64]) -> Vec<f64> {
        vectorised(
            #[inline(always)]
            || self.product(vector),
        )
    }

    #[inline(always)]
    fn product(&self, vector: &[f64]) -> Vec<f64> {
        let (count, width) = (self.count, self.width);
        let mut interleaved = vec![0.0; width * count];
        for (b, part) in single(vector).chunks_exact(width).enumerate() {
            for (j, value) in part.iter().enumerate() {
                interleaved[j * count + b] = *value;
            }
        }
        let mut out = vec![0.0; vector.len()];
        for first in (0..count).step_by(SIDE_BY_SIDE) {
            let parts = out[(first * width).min(vector.len())..].chunks_exact_mut(width);
            let mut parts: Vec<&mut [f64]> = parts.take(SIDE_BY_SIDE).collect();
            for i in 0..width {
                let mut sums = [0.0_f32; SIDE_BY_SIDE];
                for j in 0..width {
                    let entries = &self.values[(i * width + j) * count + first..][..SIDE_BY_SIDE];
                    let interleaved = &interleaved[j * count + first..][..SIDE_BY_SIDE];
                    for b in 0..SIDE_BY_SIDE {
                        sums[b] += entries[b] * interleaved[b];
                    }
                }
                for (part, sum) in parts.iter_mut().zip(sums) {
                    part[i] = f64::from(sum);
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_product_is_that_of_each_block() {
        let (width, count) = (3, 5);
        let block = |b: usize| {
            let entries = (0..9).map(|k| (1 + k * (b + 2)) as f64);
            RowMatrix::from_rows(width, width, entries.collect()).expect("nine entries")
        };
        let blocks: Vec<RowMatrix> = (0..count).map(block).collect();
        let vector: Vec<f64> = (0..width * count).map(|i| (i * i) as f64 - 20.0).collect();
        let each = blocks.iter().zip(vector.chunks(width));
        let expected: Vec<f64> = each.flat_map(|(block, v)| block.apply(v)).collect();
        assert_eq!(Blocks::new(width, blocks.iter()).apply(&vector), expected);
    }
}
