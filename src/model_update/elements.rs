//! The structure's contact elements over the fine grid.

use std::sync::Arc;

use super::ModelUpdateError;
use crate::contact::nodes::Interpolation;
use crate::grid::{Grid, Patch};

/// Contact elements of a structure over a fine grid, on the faces of an array of equal rectangles over the grid's rectangle, of
/// which the structure has some. Either each face is an element, or each node between them.
///
/// *Faces* are numbered in the order in which they were given. The two arrays need not fit: a fine cell on a border between
/// elements is shared by the area it has in each, and what it has in rectangles that are no elements (the bolt hole) goes to its
/// real elements in proportion. *Nodes* are numbered with i along x slow and j along y fast; a fine cell is shared by the four
/// around it as the bilinear interpolation between them says. Either way the sum over the elements is the sum over the fine cells.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactElements {
    nodes: Option<Nodes>,
    centres: Vec<[f64; 2]>,
    areas: Vec<f64>,
    patch: Patch,
    /// Shares of fine cell c: `shares[offsets[c]..offsets[c + 1]]`; none for a cell outside the joint.
    offsets: Vec<usize>,
    shares: Vec<Share>,
    /// Fine cells whose centre lies in face e, or nearest to node e: `centred[first[e]..first[e + 1]]`.
    first: Vec<usize>,
    centred: Vec<usize>,
}

/// Nodes that are contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Nodes {
    /// Between all nodes of the array, whether they are elements or not, and the fine cells.
    pub interpolation: Arc<Interpolation>,
    /// Number of each element's node among them, ascending.
    pub numbers: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Share {
    element: usize,
    /// Part of the fine cell, in (0, 1].
    part: f64,
}

/// How the fine cells of one axis lie on the elements' cells. Lengths are counted in parts of the rectangle's side over the
/// product of both counts, so that the positions are whole numbers and no border depends on rounding.
struct Axis {
    cells: usize,
    elements: usize,
}

impl Axis {
    /// The elements' cells under fine cell `i`, with the part of it that lies in each.
    fn overlaps(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (cells, elements) = (self.cells, self.elements);
        let (low, high) = (i * elements, (i + 1) * elements);
        (low / cells..=(high - 1) / cells).map(move |e| {
            let length = high.min((e + 1) * cells) - low.max(e * cells);
            (e, length as f64 / elements as f64)
        })
    }

    /// The elements' cells in which the centre of fine cell `i` lies: both, if it lies on their border.
    fn of_centre(&self, i: usize) -> std::ops::RangeInclusive<usize> {
        let (twice, cell) = ((2 * i + 1) * self.elements, 2 * self.cells);
        (twice - 1) / cell..=(twice / cell).min(self.elements - 1)
    }
}

impl ContactElements {
    /// The elements `cells`, (i, j) along x and y in an array of `counts` over the rectangle of `grid`.
    ///
    /// # Errors
    /// No element, one outside the array or given twice, or a grid coarser than the array.
    pub fn new(
        grid: Grid,
        counts: [usize; 2],
        cells: &[[usize; 2]],
    ) -> Result<Self, ModelUpdateError> {
        if cells.is_empty() {
            return Err(ModelUpdateError::NoElements);
        }
        for (axis, cells, elements) in [("x", grid.nx, counts[0]), ("y", grid.ny, counts[1])] {
            if cells < elements {
                return Err(ModelUpdateError::GridTooCoarse {
                    axis,
                    cells,
                    elements,
                });
            }
        }
        let number = numbers(counts, cells)?;
        let at = |ex: usize, ey: usize| number[ex * counts[1] + ey];
        let axes = [
            Axis {
                cells: grid.nx,
                elements: counts[0],
            },
            Axis {
                cells: grid.ny,
                elements: counts[1],
            },
        ];
        let array = Grid::over(grid.size(), counts);
        let mut elements = ContactElements {
            nodes: None,
            centres: cells
                .iter()
                .map(|&[i, j]| array.centre(i, j).into())
                .collect(),
            areas: vec![array.cell_area(); cells.len()],
            patch: Patch {
                grid,
                kept: vec![false; grid.len()],
            },
            offsets: vec![0],
            shares: Vec::new(),
            first: Vec::new(),
            centred: Vec::new(),
        };
        let mut centred = vec![Vec::new(); cells.len()];
        for c in 0..grid.len() {
            let (i, j) = grid.cell(c);
            for ex in axes[0].of_centre(i) {
                for element in axes[1].of_centre(j).filter_map(|ey| at(ex, ey)) {
                    elements.patch.kept[c] = true;
                    centred[element].push(c);
                }
            }
            if elements.patch.kept[c] {
                let start = elements.shares.len();
                for (ex, x) in axes[0].overlaps(i) {
                    for (ey, y) in axes[1].overlaps(j) {
                        if let Some(element) = at(ex, ey) {
                            let part = x * y;
                            elements.shares.push(Share { element, part });
                        }
                    }
                }
                let shares = &mut elements.shares[start..];
                let whole: f64 = shares.iter().map(|s| s.part).sum();
                for share in shares {
                    share.part /= whole;
                }
            }
            elements.offsets.push(elements.shares.len());
        }
        elements.list(centred);
        Ok(elements)
    }

    /// The elements at the nodes around the faces `cells`, (i, j) along x and y in an array of `counts` over the rectangle of `grid`.
    ///
    /// # Errors
    /// As [`ContactElements::new`].
    pub fn at_nodes(
        grid: Grid,
        counts: [usize; 2],
        cells: &[[usize; 2]],
    ) -> Result<Self, ModelUpdateError> {
        let faces = ContactElements::new(grid, counts, cells)?;
        let lattice = Interpolation::new(grid, counts);
        let width = counts[1] + 1;
        let array = Grid::over(grid.size(), counts);
        let mut area = vec![0.0; lattice.nodes()];
        for &[i, j] in cells {
            for node in [[i, j], [i, j + 1], [i + 1, j], [i + 1, j + 1]] {
                area[node[0] * width + node[1]] += 0.25 * array.cell_area();
            }
        }
        let there: Vec<usize> = (0..area.len()).filter(|&n| area[n] > 0.0).collect();
        let mut number = vec![None; area.len()];
        for (element, &node) in there.iter().enumerate() {
            number[node] = Some(element);
        }
        let place = |node: usize| {
            let (i, j) = ((node / width) as f64, (node % width) as f64);
            let along = |k: f64, count: usize, side: f64| (k - 0.5 * count as f64) * side;
            [along(i, counts[0], array.dx), along(j, counts[1], array.dy)]
        };
        let interpolation = Arc::new(lattice.without(|node| area[node] > 0.0));
        let mut elements = ContactElements {
            nodes: Some(Nodes {
                interpolation: interpolation.clone(),
                numbers: there.clone(),
            }),
            centres: there.iter().map(|&node| place(node)).collect(),
            areas: there.iter().map(|&node| area[node]).collect(),
            patch: faces.patch,
            offsets: vec![0],
            shares: Vec::new(),
            first: Vec::new(),
            centred: Vec::new(),
        };
        let mut centred = vec![Vec::new(); there.len()];
        for c in 0..grid.len() {
            if elements.patch.kept[c] {
                // The centre of a kept cell lies in a face, or on its border: it has a part in a node that is there.
                let around: Vec<(usize, f64)> = interpolation.around(c).collect();
                let nearest = around.iter().map(|(_, part)| *part).fold(0.0, f64::max);
                for (node, part) in around {
                    let Some(element) = number[node] else {
                        continue;
                    };
                    elements.shares.push(Share { element, part });
                    if part == nearest {
                        centred[element].push(c);
                    }
                }
            }
            elements.offsets.push(elements.shares.len());
        }
        elements.list(centred);
        Ok(elements)
    }

    fn list(&mut self, centred: Vec<Vec<usize>>) {
        for list in centred {
            self.first.push(self.centred.len());
            self.centred.extend(list);
        }
        self.first.push(self.centred.len());
    }

    /// One element over the whole grid.
    pub fn single(grid: Grid) -> Result<Self, ModelUpdateError> {
        Self::new(grid, [1, 1], &[[0, 0]])
    }

    /// Number of elements.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Never: there is at least one element.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// The fine grid.
    pub fn grid(&self) -> Grid {
        self.patch.grid
    }

    /// The fine grid and its cells whose centre lies in a face, or on the border of one.
    pub fn patch(&self) -> &Patch {
        &self.patch
    }

    /// The nodes that are the elements; none where faces are.
    pub fn nodes(&self) -> Option<&Nodes> {
        self.nodes.as_ref()
    }

    /// Centre of each element, from the centre of the joint \[m\].
    pub fn centres(&self) -> &[[f64; 2]] {
        &self.centres
    }

    /// Area of each element \[m²\]: its own, not that of the fine cells kept for it.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Gap g₀ ≥ 0 of each element in a static contact with these loads: 0 where there is load \[m\].
    ///
    /// # Panics
    /// As [`ContactElements::gaps`].
    pub fn static_gaps(&self, gap: &[f64], normal_load: &[f64]) -> Vec<f64> {
        // A loaded cell has a gap of the solver's residual, or overlaps at the cap; and an element may bear a share of a cell on its
        // border while all cells that have their centre in it are open.
        let pairs = self.gaps(gap).into_iter().zip(normal_load);
        pairs
            .map(|(gap, &load)| if load > 0.0 { 0.0 } else { gap.max(0.0) })
            .collect()
    }

    /// Sum of a fine field over each element, each fine cell with its share. Cells outside the joint do not count.
    ///
    /// # Panics
    /// If the field has not one value for each cell of the grid.
    pub fn sums(&self, field: &[f64]) -> Vec<f64> {
        assert_eq!(field.len(), self.patch.grid.len(), "values of the field");
        let mut sums = vec![0.0; self.len()];
        for (c, value) in field.iter().enumerate() {
            for share in &self.shares[self.offsets[c]..self.offsets[c + 1]] {
                sums[share.element] += share.part * value;
            }
        }
        sums
    }

    /// Integral of a fine field over each element: [`ContactElements::sums`] times the area of a fine cell.
    ///
    /// # Panics
    /// As [`ContactElements::sums`].
    pub fn integrals(&self, field: &[f64]) -> Vec<f64> {
        let area = self.patch.grid.cell_area();
        let mut sums = self.sums(field);
        sums.iter_mut().for_each(|sum| *sum *= area);
        sums
    }

    /// Normal load N₀ of each element under a pressure field \[Pa\], or its force along an axis under shear \[N\]; they sum to
    /// the load of the joint [A §2e].
    ///
    /// # Panics
    /// As [`ContactElements::sums`].
    pub fn loads(&self, pressure: &[f64]) -> Vec<f64> {
        self.integrals(pressure)
    }

    /// Smallest gap on the fine cells whose centre lies in each face, or on its border, or is nearest to each node \[m\] [A §2e]. Below zero where
    /// capped cells overlap.
    ///
    /// # Panics
    /// As [`ContactElements::sums`].
    pub fn gaps(&self, gap: &[f64]) -> Vec<f64> {
        assert_eq!(gap.len(), self.patch.grid.len(), "values of the field");
        self.first
            .windows(2)
            .map(|range| {
                let cells = &self.centred[range[0]..range[1]];
                cells
                    .iter()
                    .fold(f64::INFINITY, |least, &c| least.min(gap[c]))
            })
            .collect()
    }
}

/// Number of the element at each cell of the array.
fn numbers(
    counts: [usize; 2],
    cells: &[[usize; 2]],
) -> Result<Vec<Option<usize>>, ModelUpdateError> {
    let mut number = vec![None; counts[0] * counts[1]];
    for (element, &cell) in cells.iter().enumerate() {
        if cell[0] >= counts[0] || cell[1] >= counts[1] {
            return Err(ModelUpdateError::Outside {
                element,
                cell,
                counts,
            });
        }
        let place = &mut number[cell[0] * counts[1] + cell[1]];
        if let Some(first) = place.replace(element) {
            return Err(ModelUpdateError::Twice {
                first,
                second: element,
                cell,
            });
        }
    }
    Ok(number)
}
