//! Contact elements of the structure, mapped to the fine grid.

use std::sync::Arc;

use super::ModelUpdateError;
use crate::contact::nodes::Interpolation;
use crate::grid::{Grid, Patch};

/// Contact elements of a structure over a fine grid. An array of equal rectangles covers the rectangle of the grid, and
/// the structure has some of its faces. The contact elements are either the faces of the structure or the nodes between
/// the faces.
///
/// *Faces* are numbered in the given order. The grid and the array of faces need not match. The elements at a border
/// share a fine cell in proportion to the area of the cell in each element. No element covers the bolt hole. A part of
/// a fine cell can lie in the bolt hole. The elements of this cell then share the part in proportion to the areas of
/// the elements in the cell. *Nodes* are numbered row by row: j along y varies fastest. The nodes around a fine cell
/// share the cell with the weights of the bilinear interpolation. For both kinds of elements, the sum of a field over
/// the elements equals the sum over the fine cells.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactElements {
    nodes: Option<Nodes>,
    centres: Vec<[f64; 2]>,
    areas: Vec<f64>,
    patch: Patch,
    /// Shares of fine cell c: `shares[offsets[c]..offsets[c + 1]]`; empty for a cell outside the joint.
    offsets: Vec<usize>,
    shares: Vec<Share>,
    /// Fine cells whose centre lies in face e, or is nearest to node e: `centred[first[e]..first[e + 1]]`.
    centred_offsets: Vec<usize>,
    centred: Vec<usize>,
}

/// Nodes that are contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Nodes {
    /// Interpolation from all nodes of the array, elements or not, to the fine cells.
    pub interpolation: Arc<Interpolation>,
    /// Node number of each element, ascending.
    pub numbers: Vec<usize>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Share {
    element: usize,
    /// Fraction of the fine cell, in (0, 1].
    part: f64,
}

/// Overlap of fine cells with the cells of the element array along one axis. The unit of length is the side of the
/// rectangle over the product of both counts. Positions are then integers, and no border depends on rounding.
struct Axis {
    cells: usize,
    elements: usize,
}

impl Axis {
    /// Returns the array cells under fine cell `i`, with the fraction of the fine cell in each.
    fn overlaps(&self, i: usize) -> impl Iterator<Item = (usize, f64)> + use<> {
        let (cells, elements) = (self.cells, self.elements);
        let (low, high) = (i * elements, (i + 1) * elements);
        (low / cells..=(high - 1) / cells).map(move |e| {
            let length = high.min((e + 1) * cells) - low.max(e * cells);
            (e, length as f64 / elements as f64)
        })
    }

    /// Returns the array cells that contain the centre of fine cell `i`: two cells if it lies on their border.
    fn of_centre(&self, i: usize) -> std::ops::RangeInclusive<usize> {
        let (twice, cell) = ((2 * i + 1) * self.elements, 2 * self.cells);
        (twice - 1) / cell..=(twice / cell).min(self.elements - 1)
    }
}

impl ContactElements {
    /// Creates one element at each face in `cells`. An array of `counts` faces along x and y covers the rectangle of
    /// `grid`. The indices (i, j) of a face count along x and y.
    ///
    /// # Errors
    /// Returns an error if `cells` is empty, contains a face twice, or contains a face outside the array. Returns an
    /// error if the grid is coarser than the array.
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
        let element_at = |ex: usize, ey: usize| number[ex * counts[1] + ey];
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
                is_in_joint: vec![false; grid.len()],
            },
            offsets: vec![0],
            shares: Vec::new(),
            centred_offsets: Vec::new(),
            centred: Vec::new(),
        };
        let mut centred = vec![Vec::new(); cells.len()];
        for c in 0..grid.len() {
            let (i, j) = grid.cell(c);
            for ex in axes[0].of_centre(i) {
                for element in axes[1].of_centre(j).filter_map(|ey| element_at(ex, ey)) {
                    elements.patch.is_in_joint[c] = true;
                    centred[element].push(c);
                }
            }
            if elements.patch.is_in_joint[c] {
                let start = elements.shares.len();
                for (ex, x) in axes[0].overlaps(i) {
                    for (ey, y) in axes[1].overlaps(j) {
                        if let Some(element) = element_at(ex, ey) {
                            let part = x * y;
                            elements.shares.push(Share { element, part });
                        }
                    }
                }
                let shares = &mut elements.shares[start..];
                let sum: f64 = shares.iter().map(|s| s.part).sum();
                for share in shares {
                    share.part /= sum;
                }
            }
            elements.offsets.push(elements.shares.len());
        }
        elements.store_centred(centred);
        Ok(elements)
    }

    /// Creates one element at each node around the faces in `cells`. An array of `counts` faces along x and y covers
    /// the rectangle of `grid`. The indices (i, j) of a face count along x and y.
    ///
    /// # Errors
    /// Returns the errors of [`ContactElements::new`].
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
        let element_nodes: Vec<usize> = (0..area.len()).filter(|&n| area[n] > 0.0).collect();
        let mut number = vec![None; area.len()];
        for (element, &node) in element_nodes.iter().enumerate() {
            number[node] = Some(element);
        }
        let position = |node: usize| {
            let (i, j) = ((node / width) as f64, (node % width) as f64);
            let along = |k: f64, count: usize, side: f64| (k - 0.5 * count as f64) * side;
            [along(i, counts[0], array.dx), along(j, counts[1], array.dy)]
        };
        let interpolation = Arc::new(lattice.without_missing_nodes(|node| area[node] > 0.0));
        let mut elements = ContactElements {
            nodes: Some(Nodes {
                interpolation: interpolation.clone(),
                numbers: element_nodes.clone(),
            }),
            centres: element_nodes.iter().map(|&node| position(node)).collect(),
            areas: element_nodes.iter().map(|&node| area[node]).collect(),
            patch: faces.patch,
            offsets: vec![0],
            shares: Vec::new(),
            centred_offsets: Vec::new(),
            centred: Vec::new(),
        };
        let mut centred = vec![Vec::new(); element_nodes.len()];
        for c in 0..grid.len() {
            if elements.patch.is_in_joint[c] {
                // The centre of a kept cell lies in a face of the structure or on the border of the face. At least one
                // node around the cell is therefore an element.
                let around: Vec<(usize, f64)> = interpolation.nodal_weights(c).collect();
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
        elements.store_centred(centred);
        Ok(elements)
    }

    fn store_centred(&mut self, centred: Vec<Vec<usize>>) {
        for list in centred {
            self.centred_offsets.push(self.centred.len());
            self.centred.extend(list);
        }
        self.centred_offsets.push(self.centred.len());
    }

    /// Creates one element over the whole grid.
    pub fn single(grid: Grid) -> Result<Self, ModelUpdateError> {
        Self::new(grid, [1, 1], &[[0, 0]])
    }

    /// Returns the number of elements.
    pub fn len(&self) -> usize {
        self.areas.len()
    }

    /// Returns false: there is at least one element.
    pub fn is_empty(&self) -> bool {
        self.areas.is_empty()
    }

    /// Returns the fine grid.
    pub fn grid(&self) -> Grid {
        self.patch.grid
    }

    /// Returns the fine grid, with the cells whose centre lies in a face or on the border of a face.
    pub fn patch(&self) -> &Patch {
        &self.patch
    }

    /// Returns the nodes of the elements; `None` if the elements are faces.
    pub fn nodes(&self) -> Option<&Nodes> {
        self.nodes.as_ref()
    }

    /// Returns the centre of each element, measured from the centre of the joint \[m\].
    pub fn centres(&self) -> &[[f64; 2]] {
        &self.centres
    }

    /// Returns the area of each element \[m²\]. The area of an element is the area of its face or node, not the area of
    /// its fine cells.
    pub fn areas(&self) -> &[f64] {
        &self.areas
    }

    /// Returns the gap g₀ ≥ 0 of each element in a static contact \[m\]. The gap is 0 for an element with a positive
    /// `normal_load`.
    ///
    /// # Panics
    /// Panics if the field does not have one value per cell of the grid.
    pub fn static_gaps(&self, gap: &[f64], normal_load: &[f64]) -> Vec<f64> {
        // The gap of a loaded cell is the residual of the solver, or negative at the cap. An element can carry load
        // even if all cells centred in the element are open. The load is then from a cell on the border of the element.
        let pairs = self.gaps(gap).into_iter().zip(normal_load);
        pairs
            .map(|(gap, &load)| if load > 0.0 { 0.0 } else { gap.max(0.0) })
            .collect()
    }

    /// Returns the sum of a fine field over each element, weighted by the shares. Cells outside the joint do not count.
    ///
    /// # Panics
    /// Panics if the field does not have one value per cell of the grid.
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

    /// Returns the integral of a fine field over each element: [`ContactElements::sums`] times the area of a fine cell.
    ///
    /// # Panics
    /// Panics if the field does not have one value per cell of the grid.
    pub fn integrals(&self, field: &[f64]) -> Vec<f64> {
        let area = self.patch.grid.cell_area();
        let mut sums = self.sums(field);
        sums.iter_mut().for_each(|sum| *sum *= area);
        sums
    }

    /// Returns the integral of a pressure or shear field \[Pa\] over each element \[N\]. The integral of the pressure
    /// is the normal load N₀ of the element. The integral of the shear along an axis is the tangential force of the
    /// element. The loads of the elements sum to the load of the joint [A §2e].
    ///
    /// # Panics
    /// Panics if the field does not have one value per cell of the grid.
    pub fn loads(&self, pressure: &[f64]) -> Vec<f64> {
        self.integrals(pressure)
    }

    /// Returns the smallest gap of each element \[m\] [A §2e]. For a face, the minimum is over the fine cells with
    /// their centres in the face or on the border of the face. For a node, the minimum is over the fine cells that are
    /// nearest to the node. The gap is negative where capped cells overlap.
    ///
    /// # Panics
    /// Panics if the field does not have one value per cell of the grid.
    pub fn gaps(&self, gap: &[f64]) -> Vec<f64> {
        assert_eq!(gap.len(), self.patch.grid.len(), "values of the field");
        self.centred_offsets
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

/// Returns the number of the element at each cell of the array.
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
        let slot = &mut number[cell[0] * counts[1] + cell[1]];
        if let Some(first) = slot.replace(element) {
            return Err(ModelUpdateError::DuplicateCell {
                first,
                second: element,
                cell,
            });
        }
    }
    Ok(number)
}
