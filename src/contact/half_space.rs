//! Elastic half spaces: surface displacement under a traction field, and an approximate inverse of it.
//!
//! Displacements are relative (upper minus lower body), so the kernels add the compliance of both bodies. Fields have
//! one value per cell: tractions \[Pa\], displacements \[m\].

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Pair;
use super::coupling::Coupling;
use super::error::{ContactError, check_length};
use super::kernel::{CellIntegrals, cell_integrals};
use super::nodes::NodalCompliance;
use crate::fft::{Convolution, VectorKernel, Workspace, fast_length};
use crate::gauge::Gauge;
use crate::grid::{ByAxis, Grid};

/// Boundary condition at the edges of the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// Free surface without traction beyond the grid.
    Free,
    /// The field repeats in both directions. The mean displacement is defined as zero.
    Periodic,
}

/// Axes of the tangential tractions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shear {
    /// Along x only: no field q_y, no kernels yy and xy.
    AlongX,
    /// Along x and y.
    InPlane,
}

/// Compliance K of both half spaces on a grid, as convolutions, with the preconditioners of the contact solvers.
///
/// `HalfSpace` builds the tangential kernels on first use, so a normal contact stores no tangential kernels.
/// `HalfSpace` builds the coupling kernels on first use, and only for coupled bodies.
pub struct HalfSpace {
    grid: Grid,
    pair: Pair,
    boundary: Boundary,
    /// Convolution for K: zero-padded for a free boundary, unpadded for a periodic one.
    convolution: Convolution,
    /// Convolution for the preconditioner, periodic on a plane hardly larger than the grid. Costs a quarter of
    /// `convolution` for a free boundary.
    inverse: Convolution,
    /// Grid that covers the plane of the preconditioner.
    inverse_grid: Grid,
    workspace: Workspace,
    normal: Vec<f64>,
    normal_inverse: Vec<f64>,
    shear_x: Option<[Vec<f64>; 2]>,
    shear: Option<[VectorKernel; 2]>,
    coupling: Option<Coupling>,
    nodal: Option<Arc<NodalCompliance>>,
}

impl HalfSpace {
    /// Creates half spaces of the given materials under a grid.
    pub fn new(grid: Grid, pair: Pair, boundary: Boundary) -> Self {
        let (px, py) = match boundary {
            Boundary::Free => (fast_length(2 * grid.nx - 1), fast_length(2 * grid.ny - 1)),
            Boundary::Periodic => (grid.nx, grid.ny),
        };
        let convolution = Convolution::new(grid.nx, grid.ny, px, py);
        let [nx, ny] = inverse_plane(grid, boundary);
        let inverse_grid = Grid { nx, ny, ..grid };
        let weight = inverse_grid.len() as f64 / (px * py) as f64;
        let inverse = Convolution::new(grid.nx, grid.ny, nx, ny).with_pair_weight(weight);
        let symbols = Symbols { grid, pair };
        let inverse_symbols = Symbols {
            grid: inverse_grid,
            pair,
        };
        let normal = match boundary {
            Boundary::Free => {
                let integrals = Integrals::new(grid);
                let compliance = pair.compliance();
                convolution.kernel(|i, j| compliance * integrals.at(i, j).inverse)
            }
            Boundary::Periodic => convolution.symbol(|m, n| symbols.compliance(m, n)[0]),
        };
        let normal_inverse = inverse.symbol(|m, n| inverse_symbols.stiffness(m, n)[0]);
        HalfSpace {
            grid,
            pair,
            boundary,
            convolution,
            inverse,
            inverse_grid,
            workspace: Workspace::default(),
            normal,
            normal_inverse,
            shear_x: None,
            shear: None,
            coupling: None,
            nodal: None,
        }
    }

    /// Sets a compliance between nodes that is added to K, or removes it: see [`super::nodes`]. The preconditioners
    /// stay the same.
    ///
    /// # Errors
    /// Returns [`ContactError::Length`] if a matrix does not match the nodes, or if the nodes do not match the
    /// grid. Returns [`ContactError::OutOfRange`] if the nodes belong to cells of another size.
    pub fn set_nodal(&mut self, nodal: Option<Arc<NodalCompliance>>) -> Result<(), ContactError> {
        if let Some(nodal) = &nodal {
            nodal.check()?;
            let node_grid = nodal.interpolation.grid();
            check_length("half space along x", self.grid.nx, node_grid.nx)?;
            check_length("half space along y", self.grid.ny, node_grid.ny)?;
            for (own, other) in [(self.grid.dx, node_grid.dx), (self.grid.dy, node_grid.dy)] {
                if own != other {
                    return Err(ContactError::OutOfRange {
                        name: "cell size of the nodal interpolation",
                        value: other,
                        expected: "the cell size of the half space",
                    });
                }
            }
        }
        self.nodal = nodal;
        Ok(())
    }

    /// Runs `work` with another compliance between nodes, or with K alone for `None`. Restores the previous compliance
    /// afterwards.
    ///
    /// # Errors
    /// Returns the errors of [`HalfSpace::set_nodal`].
    pub fn with_nodal<T>(
        &mut self,
        nodal: Option<Arc<NodalCompliance>>,
        work: impl FnOnce(&mut HalfSpace) -> T,
    ) -> Result<T, ContactError> {
        let previous = self.nodal.take();
        let was_set = self.set_nodal(nodal);
        let result = was_set.map(|()| work(self));
        self.nodal = previous;
        result
    }

    /// Runs `work` with K alone, without the compliance between nodes. Restores it afterwards.
    pub fn without_nodal<T>(&mut self, work: impl FnOnce(&mut HalfSpace) -> T) -> T {
        let previous = self.nodal.take();
        let result = work(self);
        self.nodal = previous;
        result
    }

    /// Returns the compliance between nodes that is added to K.
    pub fn nodal(&self) -> Option<&Arc<NodalCompliance>> {
        self.nodal.as_ref()
    }

    /// Sets the number of threads of the transforms. The results do not depend on the number of threads.
    pub fn set_threads(&mut self, threads: usize) {
        self.workspace = Workspace::new(threads);
    }

    /// Returns the grid.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// Returns the materials.
    pub fn pair(&self) -> Pair {
        self.pair
    }

    /// Returns the boundary condition.
    pub fn boundary(&self) -> Boundary {
        self.boundary
    }

    /// Sets a gauge that counts transforms for progress reports.
    pub fn set_gauge(&mut self, gauge: Gauge) {
        self.workspace.progress_counter = gauge;
    }

    /// Returns the number of pairs of transforms since the last call, and resets the number to 0. The unit is one pair
    /// of transforms in a convolution with the compliance.
    pub fn take_pairs(&mut self) -> f64 {
        self.workspace.take_pair_count()
    }

    /// Adds a number of pairs that [`HalfSpace::take_pairs`] has returned. The next call of [`HalfSpace::take_pairs`]
    /// includes the added pairs.
    pub fn count_pairs(&mut self, pairs: f64) {
        self.workspace.add_pair_count(pairs);
    }

    /// Returns the displacement of a cell under unit pressure on the cell alone \[m/Pa\]. The displacement under unit
    /// pressure is the scale of the smallest eigenvalues of K.
    pub fn self_compliance(&self) -> f64 {
        self.pair.compliance() * cell_integrals(0.0, 0.0, self.grid.dx, self.grid.dy).inverse
    }

    /// Returns the displacement of a cell under unit shear on the cell alone \[m/Pa\], along the stiffer axis. The
    /// displacement under unit shear is the scale of the smallest eigenvalues of K for shear.
    pub fn self_shear_compliance(&self) -> f64 {
        let cell = cell_integrals(0.0, 0.0, self.grid.dx, self.grid.dy);
        self.pair.compliance() * cell.inverse
            + self.pair.lateral_compliance() * cell.xx.min(cell.yy)
    }

    /// Returns the stiffness of the preconditioners of a periodic contact against a mean displacement, divided by the
    /// number of cells \[Pa/m\]. The function returns the stiffness for the pressure first, then the stiffness for the
    /// shear. The mean stiffness couples all cells of a period equally. The mean stiffness is 0 for a free boundary,
    /// where the ground resists a mean displacement.
    pub(super) fn mean_stiffness(&self) -> [f64; 2] {
        match self.boundary {
            Boundary::Free => [0.0; 2],
            Boundary::Periodic => {
                let symbols = Symbols {
                    grid: self.inverse_grid,
                    pair: self.pair,
                };
                let [normal, shear, ..] = symbols.stiffness(0, 0);
                [normal, shear].map(|k| k / self.grid.len() as f64)
            }
        }
    }

    /// Computes the normal displacement under a pressure field: u = K_zz ⊗ p [A eq. 2.4].
    pub fn normal(&mut self, pressure: &[f64], displacement: &mut [f64]) {
        self.convolution
            .apply(&mut self.workspace, &self.normal, pressure, displacement);
        if let Some(nodal) = &self.nodal {
            nodal.add_normal(pressure, displacement);
        }
    }

    /// Applies the preconditioner: computes an approximate pressure for a normal displacement.
    pub fn normal_inverse(&mut self, displacement: &[f64], pressure: &mut [f64]) {
        self.inverse.apply(
            &mut self.workspace,
            &self.normal_inverse,
            displacement,
            pressure,
        );
    }

    /// Computes the tangential displacement under shear along x alone: u_x = K_xx ⊗ q_x.
    pub fn shear_x(&mut self, shear: &[f64], displacement: &mut [f64]) {
        self.build_shear_x();
        if let Some([kernel, _]) = &self.shear_x {
            self.convolution
                .apply(&mut self.workspace, kernel, shear, displacement);
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_shear_x(shear, displacement);
        }
    }

    /// Computes an approximate shear for a displacement along x.
    pub fn shear_x_inverse(&mut self, displacement: &[f64], shear: &mut [f64]) {
        self.build_shear_x();
        if let Some([_, kernel]) = &self.shear_x {
            self.inverse
                .apply(&mut self.workspace, kernel, displacement, shear);
        }
    }

    /// Computes the tangential displacement under shear in both directions: u_x = K_xx ⊗ q_x + K_xy ⊗ q_y, and so on.
    pub fn shear(&mut self, shear: [&[f64]; 2], displacement: [&mut [f64]; 2]) {
        self.build_shear();
        let [x, y] = displacement;
        if let Some([kernel, _]) = &self.shear {
            self.convolution
                .apply_vector(&mut self.workspace, kernel, shear, [&mut *x, &mut *y]);
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_shear(shear, [x, y]);
        }
    }

    /// Computes the tangential displacement under shear along x alone, along x or along both axes. `displacement` has
    /// one field per axis.
    pub(super) fn shear_of_x(&mut self, shear: &[f64], displacement: &mut ByAxis<Vec<f64>>) {
        let [x, y] = &mut displacement[..] else {
            return self.shear_x(shear, &mut displacement[0]);
        };
        self.build_shear();
        if let Some([kernel, _]) = &self.shear {
            let displacement = [&mut x[..], &mut y[..]];
            self.convolution
                .apply_column(&mut self.workspace, kernel, shear, displacement);
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_shear([shear, &vec![0.0; shear.len()]], [x, y]);
        }
    }

    /// Computes an approximate shear for a displacement in both directions.
    pub fn shear_inverse(&mut self, displacement: [&[f64]; 2], shear: [&mut [f64]; 2]) {
        self.build_shear();
        if let Some([_, kernel]) = &self.shear {
            self.inverse
                .apply_vector(&mut self.workspace, kernel, displacement, shear);
        }
    }

    /// Computes an approximate shear along one axis for a displacement along the same axis. The approximation ignores
    /// that a displacement along one axis causes shear along the other axis.
    pub(super) fn single_axis_shear_inverse(
        &mut self,
        axis: usize,
        displacement: &[f64],
        shear: &mut [f64],
    ) {
        self.build_shear();
        if let Some([_, kernel]) = &self.shear {
            let own_kernel = if axis == 0 { &kernel.xx } else { &kernel.yy };
            self.inverse
                .apply(&mut self.workspace, own_kernel, displacement, shear);
        }
    }

    /// Computes the normal displacement under shear, positive where it opens the gap: w = K_zx ⊗ q_x + K_zy ⊗ q_y. The
    /// displacement is zero for uncoupled bodies. See [`super::coupled`] for the signs.
    pub fn normal_of_shear(&mut self, shear: &ByAxis<Vec<f64>>, displacement: &mut [f64]) {
        match self.build_coupling(shear.len()) {
            Some((coupling, transforms)) => {
                coupling.normal_of_shear(transforms, shear, displacement)
            }
            None => displacement.fill(0.0),
        }
    }

    /// Computes the tangential displacement under pressure, one field per axis: w_x = K_xz ⊗ p, w_y = K_yz ⊗ p. The
    /// displacement is zero for uncoupled bodies. The operator is the transpose of [`HalfSpace::normal_of_shear`].
    pub fn shear_of_normal(&mut self, pressure: &[f64], displacement: &mut ByAxis<Vec<f64>>) {
        match self.build_coupling(displacement.len()) {
            Some((coupling, transforms)) => {
                coupling.shear_of_normal(transforms, pressure, displacement)
            }
            None => displacement.iter_mut().for_each(|w| w.fill(0.0)),
        }
    }

    fn build_coupling(
        &mut self,
        axes: usize,
    ) -> Option<(&Coupling, (&Convolution, &mut Workspace))> {
        if !self.pair.is_coupled() {
            return None;
        }
        if self.coupling.as_ref().is_none_or(|c| c.axes() < axes) {
            self.coupling = Some(Coupling::new(
                &self.convolution,
                self.grid,
                self.pair,
                self.boundary,
                axes,
            ));
        }
        let transforms = (&self.convolution, &mut self.workspace);
        Some((self.coupling.as_ref()?, transforms))
    }

    fn build_shear_x(&mut self) {
        if self.shear_x.is_some() {
            return;
        }
        let symbols = Symbols {
            grid: self.grid,
            pair: self.pair,
        };
        let inverse_symbols = Symbols {
            grid: self.inverse_grid,
            pair: self.pair,
        };
        let forward = match self.boundary {
            Boundary::Free => {
                let integrals = Integrals::new(self.grid);
                let (a, b) = (self.pair.compliance(), self.pair.lateral_compliance());
                self.convolution.kernel(|i, j| {
                    let cell = integrals.at(i, j);
                    a * cell.inverse + b * cell.xx
                })
            }
            Boundary::Periodic => self.convolution.symbol(|m, n| symbols.compliance(m, n)[1]),
        };
        self.shear_x = Some([
            forward,
            self.inverse
                .symbol(|m, n| inverse_symbols.stiffness(m, n)[1]),
        ]);
    }

    fn build_shear(&mut self) {
        if self.shear.is_some() {
            return;
        }
        let symbols = Symbols {
            grid: self.grid,
            pair: self.pair,
        };
        let inverse_symbols = Symbols {
            grid: self.inverse_grid,
            pair: self.pair,
        };
        let convolution = &self.convolution;
        let forward = match self.boundary {
            Boundary::Free => {
                let integrals = Integrals::new(self.grid);
                let (a, b) = (self.pair.compliance(), self.pair.lateral_compliance());
                VectorKernel {
                    xx: convolution
                        .kernel(|i, j| a * integrals.at(i, j).inverse + b * integrals.at(i, j).xx),
                    yy: convolution
                        .kernel(|i, j| a * integrals.at(i, j).inverse + b * integrals.at(i, j).yy),
                    xy: convolution.kernel(|i, j| b * integrals.at(i, j).xy),
                }
            }
            Boundary::Periodic => VectorKernel {
                xx: convolution.symbol(|m, n| symbols.compliance(m, n)[1]),
                yy: convolution.symbol(|m, n| symbols.compliance(m, n)[2]),
                xy: convolution.symbol(|m, n| symbols.compliance(m, n)[3]),
            },
        };
        let inverse = VectorKernel {
            xx: self
                .inverse
                .symbol(|m, n| inverse_symbols.stiffness(m, n)[1]),
            yy: self
                .inverse
                .symbol(|m, n| inverse_symbols.stiffness(m, n)[2]),
            xy: self
                .inverse
                .symbol(|m, n| inverse_symbols.stiffness(m, n)[3]),
        };
        self.shear = Some([forward, inverse]);
    }
}

/// The preconditioner's plane is longer than the grid by one part in `MARGIN_DIVISOR` along each side. Without a margin
/// between grid and plane, cells at opposite edges of a free contact would couple.
const MARGIN_DIVISOR: usize = 32;

/// Returns the number of points of the preconditioner's plane. The plane of a periodic contact is the grid itself, even
/// if a transform of that length is slow.
fn inverse_plane(grid: Grid, boundary: Boundary) -> [usize; 2] {
    let cells = [grid.nx, grid.ny];
    match boundary {
        Boundary::Free => cells.map(|n| fast_length(n + n.div_ceil(MARGIN_DIVISOR))),
        Boundary::Periodic => cells,
    }
}

/// Cell integrals at all non-negative offsets of a grid. Values at negative offsets follow by symmetry.
struct Integrals {
    ny: usize,
    quadrant: Vec<CellIntegrals>,
}

impl Integrals {
    fn new(grid: Grid) -> Self {
        let quadrant = (0..grid.len())
            .map(|index| {
                let (i, j) = grid.cell(index);
                cell_integrals(i as f64 * grid.dx, j as f64 * grid.dy, grid.dx, grid.dy)
            })
            .collect();
        Integrals {
            ny: grid.ny,
            quadrant,
        }
    }

    fn at(&self, i: isize, j: isize) -> CellIntegrals {
        let mut cell = self.quadrant[i.unsigned_abs() * self.ny + j.unsigned_abs()];
        if (i < 0) != (j < 0) {
            cell.xy = -cell.xy;
        }
        cell
    }
}

/// Half spaces in wave-number space, periodic over the grid. Components have the order zz, xx, yy, xy.
#[derive(Clone, Copy)]
struct Symbols {
    grid: Grid,
    pair: Pair,
}

impl Symbols {
    fn wave(&self, m: isize, n: usize) -> (f64, f64, f64) {
        let [lx, ly] = self.grid.size();
        let (x, y) = (TAU * m as f64 / lx, TAU * n as f64 / ly);
        (x, y, x.hypot(y))
    }

    /// Returns true at a Nyquist wave number. The sign of a Nyquist wave number is undefined. A product that is odd in
    /// a Nyquist wave number has no real value.
    fn nyquist(&self, m: isize, n: usize) -> bool {
        2 * m.unsigned_abs() == self.grid.nx || 2 * n == self.grid.ny
    }

    /// Returns the compliance: 2/(E*|k|) for zz; in plane 1/r and x²/r³ transform to 2π/k and 2π k_y²/k³.
    fn compliance(&self, m: isize, n: usize) -> [f64; 4] {
        let (x, y, k) = self.wave(m, n);
        if k == 0.0 {
            return [0.0; 4];
        }
        let (a, b) = (
            TAU * self.pair.compliance() / k,
            TAU * self.pair.lateral_compliance() / k,
        );
        let xy = if self.nyquist(m, n) {
            0.0
        } else {
            -b * x * y / (k * k)
        };
        [a, a + b * (y / k).powi(2), a + b * (x / k).powi(2), xy]
    }

    /// Returns the inverse of [`Symbols::compliance`]. The rigid mode has the stiffness 2E*√(A/π) divided by A. A is
    /// the area of a square with the longer side of the grid. 2E*√(A/π) is the stiffness of a round punch with the area
    /// A. The stiffness of the rigid mode is less than the stiffness of any other mode, for any shape of the grid.
    fn stiffness(&self, m: isize, n: usize) -> [f64; 4] {
        let (x, y, k) = self.wave(m, n);
        let (a, b) = (
            TAU * self.pair.compliance(),
            TAU * self.pair.lateral_compliance(),
        );
        if k == 0.0 {
            let [lx, ly] = self.grid.size();
            let rigid = 4.0 / (PI.sqrt() * lx.max(ly));
            return [rigid / a, rigid / (a + 0.5 * b), rigid / (a + 0.5 * b), 0.0];
        }
        // The compliance is a/k along k, and (a + b)/k across it.
        let (along, across) = (k / a, k / (a + b));
        let (cx, cy) = (x / k, y / k);
        let xy = if self.nyquist(m, n) {
            0.0
        } else {
            (along - across) * cx * cy
        };
        [
            along,
            across + (along - across) * cx * cx,
            across + (along - across) * cy * cy,
            xy,
        ]
    }
}
