//! Reduction of an imported structure.

use super::{ImportError, ImportedStructure, Lower};
use crate::linalg::{Matrix, SparseCholesky, SparseSymmetric};
use crate::structure::StructureError;
use crate::structure::assembly::Combination;
use crate::structure::frequencies::{DENSE, UnsplitPencil, dense_modes};
use crate::structure::modes::{ModeOptions, lowest_of, shift_of};
use crate::structure::order::elimination_order;
use crate::structure::outline::Outline;
use crate::structure::reduction::{
    ContactPorts, ModesAtPorts, ReducedStructure, reduce_with_modes,
};

/// Block size of the Lanczos process, equal to the number of rigid modes of a free body.
const BODY: usize = 6;
/// Range of the usual shift of a mesh, as multiples of the lowest elastic ω². The usual shift is used only in the range
/// `USUAL`.
const USUAL: [f64; 2] = [1e-4, 100.0];
/// The check of a damping matrix ignores a negative eigenvalue below `NEGATIVE` times the largest eigenvalue, because
/// of rounding.
const NEGATIVE: f64 = 1e-9;
/// Number of elastic modes that are computed to find the lowest.
const LOWEST: usize = 1;
const AXES_OF_MODEL: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

impl ImportedStructure {
    /// Reduces the structure to its ports, with the lowest `count` elastic modes and the residual of the higher modes.
    /// A structure with fewer elastic modes keeps all modes. `reduce` returns the edges of the bodies in the modes if
    /// the files have elements.
    ///
    /// # Errors
    /// [`ImportError`] if the matrices do not define a valid structure, or if the modes do not converge.
    pub fn reduce(
        &self,
        count: usize,
        at: ContactPorts,
    ) -> Result<(ReducedStructure, Option<Outline>), ImportError> {
        let ports = self.ports(at)?;
        let rows = self.rows;
        let stiffness = SparseSymmetric::from_sorted(rows, &self.stiffness);
        let mass = SparseSymmetric::from_sorted(rows, &self.inertia);
        let pencil = UnsplitPencil {
            rows,
            k: &self.stiffness,
            m: &self.inertia,
            precision: self.precision,
            places: self.places.as_deref(),
        };
        let lowest = pencil.lowest_modes(LOWEST)?;
        if lowest.massless > 0 {
            return Err(ImportError::Massless {
                rows: lowest.massless,
                all: rows,
            });
        }
        if lowest.is_stabilized {
            return Err(ImportError::NoStiffness);
        }
        if let Some(square) = lowest.elastic().find(|square| *square < 0.0) {
            return Err(ImportError::Unstable(square));
        }
        let rigid = lowest.rigid();
        let Some(first) = lowest.elastic().next() else {
            return Err(StructureError::TooManyModes {
                wanted: count,
                available: 0,
            }
            .into());
        };
        let shift = shift_near(first, &stiffness, &mass);
        let (order, last) = self.elimination(&stiffness.plus(shift, &mass), &ports.combinations)?;
        let factorize = |shift: f64| {
            SparseCholesky::new(&stiffness.plus(shift, &mass), &order).map_err(|source| {
                StructureError::Factorization {
                    matrix: "the shifted stiffness",
                    source,
                }
            })
        };
        let factor = factorize(shift)?;
        let rows_with_mass = mass.diagonal().iter().filter(|v| **v > 0.0).count();
        let wanted = (rigid + count).min(rows_with_mass);
        let (squares, shapes, residual) = if rows <= DENSE {
            let (squares, mut shapes) =
                dense_modes(&mass, &stiffness.plus(shift, &mass), shift, wanted)?;
            for (mode, square) in squares.iter().enumerate() {
                // The dense solver scales to φᵀ(K + sM)φ = 1.
                let scale = (square + shift).sqrt();
                shapes.column_mut(mode).iter_mut().for_each(|v| *v *= scale);
            }
            (squares, shapes, 0.0)
        } else {
            let mut options = ModeOptions::new(wanted);
            options.block = BODY;
            let no_rigid_modes = Matrix::zeros(rows, 0);
            let modes = lowest_of(&mass, &factor, shift, &no_rigid_modes, &options, true)?;
            let squares = modes.omega.iter().map(|omega| omega * omega).collect();
            let residual = modes.residuals.iter().copied().fold(0.0, f64::max);
            (squares, modes.shapes, residual)
        };
        let elastic = squares.len().saturating_sub(rigid);
        if elastic == 0 {
            return Err(StructureError::TooManyModes {
                wanted: count,
                available: 0,
            }
            .into());
        }
        let kept_shapes = shapes.column_range(0..rigid + elastic);
        let outline = self.outline_in(&kept_shapes);
        let in_modes = |matrix: &Option<Lower>| {
            matrix.as_ref().map(|matrix| {
                let matrix = SparseSymmetric::from_sorted(rows, matrix);
                kept_shapes.transpose_times(&matrix.times(&kept_shapes))
            })
        };
        let (damping, hysteretic) = (in_modes(&self.damping), in_modes(&self.hysteretic));
        for (kind, modal_damping) in [("viscous", &damping), ("structural", &hysteretic)] {
            let Some(modal_damping) = modal_damping else {
                continue;
            };
            let (values, _) = modal_damping.symmetric_eigen().map_err(|source| {
                StructureError::Factorization {
                    matrix: "the damping between modes",
                    source,
                }
            })?;
            let largest = values.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            let least = values.iter().fold(0.0_f64, |m, v| m.min(*v));
            if least < -NEGATIVE * largest {
                return Err(ImportError::NegativeDamping {
                    kind,
                    share: -least / largest,
                });
            }
        }
        let modes = ModesAtPorts {
            rigid_squares: rayleigh(&stiffness, &shapes.column_range(0..rigid)),
            rigid: ports.displacements(&shapes.column_range(0..rigid)),
            omega: squares[rigid..]
                .iter()
                .map(|square| square.max(0.0).sqrt())
                .collect(),
            shapes: ports.displacements(&shapes.column_range(rigid..rigid + elastic)),
            residual,
        };
        let reduced = reduce_with_modes(ports, modes, self.mass, (factor, shift, last), factorize)?;
        let reduced = ReducedStructure {
            damping,
            hysteretic,
            ..reduced
        };
        Ok((reduced, outline))
    }

    /// Computes an elimination order of the rows that ends with the rows of the ports. `elimination` returns the order
    /// and the number of rows of the ports.
    ///
    /// # Errors
    /// As [`elimination_order`].
    fn elimination(
        &self,
        matrix: &SparseSymmetric,
        ports: &[Combination],
    ) -> Result<(Vec<usize>, usize), StructureError> {
        let mut last: Vec<usize> = ports.iter().flatten().map(|c| c.0).collect();
        last.sort_unstable();
        last.dedup();
        let order = elimination_order(matrix, self.places.as_deref(), &last)?;
        Ok((order, last.len()))
    }

    /// Returns the numbers of entries of stiffness, mass and factor, and the number of rows that the ports use.
    ///
    /// # Errors
    /// [`StructureError`] if the memory does not suffice for the pattern of the factor.
    pub(in crate::structure) fn entries_to_reduce(
        &self,
        ports: &[Combination],
    ) -> Result<[usize; 4], StructureError> {
        let [stiffness, mass] = [&self.stiffness, &self.inertia];
        let matrix = |entries| SparseSymmetric::from_sorted(self.rows, entries);
        let shifted = matrix(stiffness).plus(1.0, &matrix(mass));
        let (order, port_rows) = self.elimination(&shifted, ports)?;
        let factor = SparseCholesky::count_entries(&shifted, &order).map_err(|source| {
            StructureError::Factorization {
                matrix: "the shifted stiffness",
                source,
            }
        })?;
        Ok([stiffness.len(), mass.len(), factor, port_rows])
    }

    /// Returns the displaced edges of the bodies in `modes`, along the axes of the joint. `None` without elements.
    fn outline_in(&self, modes: &Matrix) -> Option<Outline> {
        let points: Vec<&(i64, [f64; 3])> = self.outline.iter().flatten().collect();
        let joint = self.interface.as_ref();
        let axes = joint.map_or(AXES_OF_MODEL, |joint| joint.axes);
        let mut shapes = Matrix::zeros(3 * points.len(), modes.columns());
        for mode in 0..modes.columns() {
            let displacements = modes.column(mode);
            for (point, along) in points
                .iter()
                .zip(shapes.column_mut(mode).chunks_exact_mut(3))
            {
                // A fixed row does not move.
                let at = |d: u32| {
                    self.row_of
                        .get(&(point.0, d))
                        .map_or(0.0, |row| displacements[*row])
                };
                let displacement = [at(1), at(2), at(3)];
                for (along, axis) in along.iter_mut().zip(&axes) {
                    *along = (0..3).map(|d| axis[d] * displacement[d]).sum();
                }
            }
        }
        let lines = self
            .outline
            .iter()
            .map(|line| ("body".to_owned(), line.len()));
        (!points.is_empty()).then(|| Outline {
            lines: lines.collect(),
            positions: points.iter().map(|(_, at)| *at).collect(),
            shapes,
        })
    }
}

/// Returns φᵀKφ of the columns φ, which have unit modal mass.
fn rayleigh(stiffness: &SparseSymmetric, shapes: &Matrix) -> Vec<f64> {
    let energies = shapes.transpose_times(&stiffness.times(shapes));
    (0..shapes.columns()).map(|r| energies[(r, r)]).collect()
}

/// Returns the shift for the modes. The shift is the usual shift of a mesh, if the ratio of the usual shift to the
/// lowest elastic ω² is in the range [`USUAL`]. Otherwise the shift is the lowest elastic ω².
///
/// The usual shift makes the results of a structure independent of the way it is imported.
fn shift_near(first: f64, stiffness: &SparseSymmetric, mass: &SparseSymmetric) -> f64 {
    let usual = shift_of(&stiffness.diagonal(), &mass.diagonal());
    match usual >= USUAL[0] * first && usual <= USUAL[1] * first {
        true => usual,
        false => first,
    }
}
