//! The elastic half spaces: surface displacement under a traction field, and an approximate inverse of it.
//!
//! Displacements are relative (upper minus lower body), so the kernels add the compliance of both bodies. Fields have one
//! value a cell: tractions \[Pa\], displacements \[m\].

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

/// What lies beyond the grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Boundary {
    /// A free surface without traction.
    Free,
    /// The field on the grid again, in both directions. The mean displacement is taken as zero.
    Periodic,
}

/// Which tangential tractions exist.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Shear {
    /// Along x only: no field q_y, no kernels yy and xy.
    AlongX,
    /// Along x and y.
    InPlane,
}

/// The compliance K of both half spaces on a grid, as convolutions, with the preconditioners of the contact solvers.
///
/// The tangential kernels are built when first asked for, so a normal contact has no storage for them. So are those of the
/// coupling, and only for bodies that are coupled.
pub struct HalfSpace {
    grid: Grid,
    pair: Pair,
    boundary: Boundary,
    /// Zero-padded (free) or as it is (periodic).
    convolution: Convolution,
    /// For a preconditioner, at a quarter of the cost: periodic on a plane that is hardly larger than the grid.
    inverse: Convolution,
    /// The grid over all of that plane.
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
    /// Half spaces of the given pair under a grid.
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
        let of_inverse = Symbols {
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
        let normal_inverse = inverse.symbol(|m, n| of_inverse.stiffness(m, n)[0]);
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

    /// With a compliance between nodes added to K, or without it again: see [`super::nodes`]. Preconditioners stay those of K.
    ///
    /// # Errors
    /// [`ContactError::Length`] for matrices of another size than the nodes, that or [`ContactError::OutOfRange`] for nodes over another
    /// grid.
    pub fn set_nodal(&mut self, nodal: Option<Arc<NodalCompliance>>) -> Result<(), ContactError> {
        if let Some(nodal) = &nodal {
            nodal.check()?;
            let over = nodal.interpolation.grid();
            check_length("half space along x", self.grid.nx, over.nx)?;
            check_length("half space along y", self.grid.ny, over.ny)?;
            for (own, other) in [(self.grid.dx, over.dx), (self.grid.dy, over.dy)] {
                if own != other {
                    return Err(ContactError::OutOfRange {
                        name: "a side of the cells under the nodes",
                        value: other,
                        expected: "that of the half space's cells",
                    });
                }
            }
        }
        self.nodal = nodal;
        Ok(())
    }

    /// Work with another compliance between nodes, or with K alone.
    ///
    /// # Errors
    /// As [`HalfSpace::set_nodal`].
    pub fn with_nodal<T>(
        &mut self,
        nodal: Option<Arc<NodalCompliance>>,
        work: impl FnOnce(&mut HalfSpace) -> T,
    ) -> Result<T, ContactError> {
        let own = self.nodal.take();
        let set = self.set_nodal(nodal);
        let done = set.map(|()| work(self));
        self.nodal = own;
        done
    }

    /// Work with K alone, without what is added to it between nodes.
    pub fn without_nodal<T>(&mut self, work: impl FnOnce(&mut HalfSpace) -> T) -> T {
        let own = self.nodal.take();
        let done = work(self);
        self.nodal = own;
        done
    }

    /// The compliance between nodes that is added to K.
    pub fn nodal(&self) -> Option<&Arc<NodalCompliance>> {
        self.nodal.as_ref()
    }

    /// Has the transforms made on as many threads. Results do not depend on their number.
    pub fn set_threads(&mut self, threads: usize) {
        self.workspace = Workspace::new(threads);
    }

    /// The grid.
    pub fn grid(&self) -> Grid {
        self.grid
    }

    /// The materials.
    pub fn pair(&self) -> Pair {
        self.pair
    }

    /// What lies beyond the grid.
    pub fn boundary(&self) -> Boundary {
        self.boundary
    }

    /// Counts transforms there too, for who watches.
    pub fn set_gauge(&mut self, gauge: Gauge) {
        self.workspace.gauge = gauge;
    }

    /// Pairs of transforms done since the last call, in units of a pair at the size of the compliance's convolution.
    pub fn take_pairs(&mut self) -> f64 {
        self.workspace.take_pairs()
    }

    /// Counts pairs that were taken away and belong to what comes next.
    pub fn count_pairs(&mut self, pairs: f64) {
        self.workspace.count_pairs(pairs);
    }

    /// Displacement of a cell under unit pressure on itself alone \[m/Pa\]: the scale of the smallest eigenvalues of K.
    pub fn self_compliance(&self) -> f64 {
        self.pair.compliance() * cell_integrals(0.0, 0.0, self.grid.dx, self.grid.dy).inverse
    }

    /// Displacement of a cell under unit shear on itself alone \[m/Pa\], along the axis on which it yields less: the scale of the smallest
    /// eigenvalues of K for shear.
    pub fn self_shear_compliance(&self) -> f64 {
        let cell = cell_integrals(0.0, 0.0, self.grid.dx, self.grid.dy);
        self.pair.compliance() * cell.inverse
            + self.pair.lateral_compliance() * cell.xx.min(cell.yy)
    }

    /// What the preconditioners of a periodic contact have of a mean displacement, by which the cells of a period hold each other alike: of
    /// the pressure and of shear, over the cells \[Pa/m\]. None of a free one, which is held by the ground.
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

    /// Normal displacement under a pressure field: u = K_zz ⊗ p [A eq. 2.4].
    pub fn normal(&mut self, pressure: &[f64], displacement: &mut [f64]) {
        self.convolution
            .apply(&mut self.workspace, &self.normal, pressure, displacement);
        if let Some(nodal) = &self.nodal {
            nodal.add_normal(pressure, displacement);
        }
    }

    /// An approximate pressure for a normal displacement: the preconditioner.
    pub fn normal_inverse(&mut self, displacement: &[f64], pressure: &mut [f64]) {
        self.inverse.apply(
            &mut self.workspace,
            &self.normal_inverse,
            displacement,
            pressure,
        );
    }

    /// Tangential displacement under shear along x alone: u_x = K_xx ⊗ q_x.
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

    /// An approximate shear for a displacement along x.
    pub fn shear_x_inverse(&mut self, displacement: &[f64], shear: &mut [f64]) {
        self.build_shear_x();
        if let Some([_, kernel]) = &self.shear_x {
            self.inverse
                .apply(&mut self.workspace, kernel, displacement, shear);
        }
    }

    /// Tangential displacement under shear in both directions: u_x = K_xx ⊗ q_x + K_xy ⊗ q_y, and so on.
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

    /// Tangential displacement along as many axes as there are fields for it, under shear along x alone.
    pub(super) fn shear_of_x(&mut self, shear: &[f64], displacement: &mut ByAxis<Vec<f64>>) {
        let [x, y] = &mut displacement[..] else {
            return self.shear_x(shear, &mut displacement[0]);
        };
        self.build_shear();
        if let Some([kernel, _]) = &self.shear {
            let both = [&mut x[..], &mut y[..]];
            self.convolution
                .apply_column(&mut self.workspace, kernel, shear, both);
        }
        if let Some(nodal) = &self.nodal {
            nodal.add_shear([shear, &vec![0.0; shear.len()]], [x, y]);
        }
    }

    /// An approximate shear for a displacement in both directions.
    pub fn shear_inverse(&mut self, displacement: [&[f64]; 2], shear: [&mut [f64]; 2]) {
        self.build_shear();
        if let Some([_, kernel]) = &self.shear {
            self.inverse
                .apply_vector(&mut self.workspace, kernel, displacement, shear);
        }
    }

    /// An approximate shear along one axis for a displacement along it, without what that shears along the other.
    pub(super) fn own_shear_inverse(
        &mut self,
        axis: usize,
        displacement: &[f64],
        shear: &mut [f64],
    ) {
        self.build_shear();
        if let Some([_, kernel]) = &self.shear {
            let own = if axis == 0 { &kernel.xx } else { &kernel.yy };
            self.inverse
                .apply(&mut self.workspace, own, displacement, shear);
        }
    }

    /// Normal displacement under shear, positive where it opens the gap: w = K_zx ⊗ q_x + K_zy ⊗ q_y; zero for bodies that
    /// are not coupled. See [`super::coupled`] for the signs.
    pub fn normal_of_shear(&mut self, shear: &ByAxis<Vec<f64>>, displacement: &mut [f64]) {
        match self.build_coupling(shear.len()) {
            Some((coupling, transforms)) => {
                coupling.normal_of_shear(transforms, shear, displacement)
            }
            None => displacement.fill(0.0),
        }
    }

    /// Tangential displacement under pressure, one field an axis: w_x = K_xz ⊗ p, w_y = K_yz ⊗ p; zero for bodies that are
    /// not coupled. The transpose of [`HalfSpace::normal_of_shear`].
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
        let of_inverse = Symbols {
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
            self.inverse.symbol(|m, n| of_inverse.stiffness(m, n)[1]),
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
        let of_inverse = Symbols {
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
            xx: self.inverse.symbol(|m, n| of_inverse.stiffness(m, n)[1]),
            yy: self.inverse.symbol(|m, n| of_inverse.stiffness(m, n)[2]),
            xy: self.inverse.symbol(|m, n| of_inverse.stiffness(m, n)[3]),
        };
        self.shear = Some([forward, inverse]);
    }
}

/// One cell in so many is added along each side to the plane of the preconditioner: without it cells at opposite edges of a free contact
/// hold each other.
const MARGIN: usize = 32;

/// Points of the plane of the preconditioner. That of a periodic contact is the contact's own, whatever a transform of that length costs.
fn inverse_plane(grid: Grid, boundary: Boundary) -> [usize; 2] {
    let cells = [grid.nx, grid.ny];
    match boundary {
        Boundary::Free => cells.map(|n| fast_length(n + n.div_ceil(MARGIN))),
        Boundary::Periodic => cells,
    }
}

/// The cell integrals at all offsets of a grid; those with a negative offset follow by symmetry.
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

/// The half spaces in wave-number space, periodic over the grid: order zz, xx, yy, xy.
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

    /// True where the sign of a wave number is not defined, so that an odd product has no real value.
    fn nyquist(&self, m: isize, n: usize) -> bool {
        2 * m.unsigned_abs() == self.grid.nx || 2 * n == self.grid.ny
    }

    /// 2/(E*|k|) for zz; in plane 1/r and x²/r³ transform to 2π/k and 2π k_y²/k³.
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

    /// The inverse of [`Symbols::compliance`]. The rigid mode gets the stiffness of a patch as long as wide as a punch, 2E*√(A/π) over A:
    /// less than any other mode's, whatever the shape.
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
        // Along k the compliance is a/k, across it (a + b)/k.
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
