//! Blocks of the compliance K that couple the pressure and the shear of bodies with different elastic constants.
//!
//! Take a half space with z pointing into it and its surface at z = 0. A point force at the origin displaces (x, y, 0)
//! by (Johnson, Contact Mechanics, eq. 3.18 f. and §3.6)
//!
//! - u_x = −(1 − 2ν)/(4πG) · P x/r² under P along z: a pressure draws the surface towards it,
//! - u_z = +(1 − 2ν)/(4πG) · Q x/r² under Q along x: the surface sinks ahead of a shear and rises behind it,
//!
//! and likewise along y. Each body sees the pressure p along its own z. The shear q is positive along the slip of the
//! upper body. The shear acts as +q on the lower body and as −q on the upper body. Let c = (1 − 2ν)/(4πG) of each body,
//! and r point from the traction to the point of displacement. Then the displacements are
//!
//! | | lower body | upper body |
//! |---|---|---|
//! | along x under p | −c_l p x/r² | −c_u p x/r² |
//! | normal, into the body, under q_x | +c_l q_x x/r² | −c_u q_x x/r² |
//!
//! The gap opens by w_z, the sum of both normal displacements. w_x is the tangential displacement of the lower surface
//! minus the tangential displacement of the upper surface. The slip of the upper body is the motion Δδ minus w_x. In
//! the uncoupled blocks, u = Kp opens the gap, and the slip is s = Δδ − Kq. w_z enters the gap with the sign of Kp, and
//! w_x enters the slip with the sign of Kq. Hence, with γ = c_l − c_u = β/(πE*),
//!
//! K_zx = γ x/r², K_xz = −γ x/r². K_xz is the transpose of K_zx, so the whole K is symmetric, as reciprocity requires.
//!
//! In wave-number space, x/r² = ∂ ln r/∂x becomes −2πi k_x/k², since ∇² ln r = 2πδ.

use std::f64::consts::TAU;

use super::Pair;
use super::half_space::Boundary;
use super::kernel::coupling_integrals;
use crate::fft::{Convolution, Workspace};
use crate::grid::{ByAxis, Grid};

/// Transforms of K_zx and, with shear along y, of K_zy: one odd kernel per axis. K_xz is −K_zx.
pub(super) struct Coupling {
    kernels: ByAxis<Vec<f64>>,
}

impl Coupling {
    /// Computes the kernels for shear along `axes` axes, in the layout of `convolution`.
    pub(super) fn new(
        convolution: &Convolution,
        grid: Grid,
        pair: Pair,
        boundary: Boundary,
        axes: usize,
    ) -> Self {
        let gamma = pair.coupling_compliance();
        let kernels = match boundary {
            Boundary::Free => {
                let integrals: Vec<[f64; 2]> = (0..grid.len())
                    .map(|index| {
                        let (i, j) = grid.cell(index);
                        coupling_integrals(i as f64 * grid.dx, j as f64 * grid.dy, grid.dx, grid.dy)
                    })
                    .collect();
                let at = |axis: usize, i: isize, j: isize| {
                    let along = if axis == 0 { i } else { j };
                    let cell = integrals[i.unsigned_abs() * grid.ny + j.unsigned_abs()];
                    gamma * along.signum() as f64 * cell[axis]
                };
                (0..axes)
                    .map(|axis| convolution.odd_kernel(|i, j| at(axis, i, j)))
                    .collect()
            }
            Boundary::Periodic => (0..axes)
                .map(|axis| convolution.symbol(|m, n| symbol(grid, gamma, axis, m, n)))
                .collect(),
        };
        Coupling { kernels }
    }

    /// Returns the number of axes of the shear.
    pub(super) fn axes(&self) -> usize {
        self.kernels.len()
    }

    /// Computes w_z = Σ K_za ⊗ q_a.
    pub(super) fn normal_of_shear(
        &self,
        (convolution, work): (&Convolution, &mut Workspace),
        shear: &ByAxis<Vec<f64>>,
        displacement: &mut [f64],
    ) {
        let terms: Vec<(&[f64], &[f64])> = self
            .kernels
            .iter()
            .zip(shear)
            .map(|(k, q)| (&k[..], &q[..]))
            .collect();
        convolution.apply_odd_sum(work, &terms, displacement);
    }

    /// Computes w_a = K_az ⊗ p.
    pub(super) fn shear_of_normal(
        &self,
        (convolution, work): (&Convolution, &mut Workspace),
        pressure: &[f64],
        displacement: &mut ByAxis<Vec<f64>>,
    ) {
        let kernels: Vec<&[f64]> = self.kernels.iter().map(|k| &k[..]).collect();
        let mut outputs: Vec<&mut [f64]> = displacement.iter_mut().map(|w| &mut w[..]).collect();
        convolution.apply_odd_each(work, &kernels, pressure, &mut outputs);
        for w in displacement {
            w.iter_mut().for_each(|w| *w = -*w);
        }
    }
}

/// Returns the imaginary part of the transform of K_za, −2πγ k_a/k². The imaginary part is zero at the Nyquist wave
/// number, which has no sign.
fn symbol(grid: Grid, gamma: f64, axis: usize, m: isize, n: usize) -> f64 {
    let [lx, ly] = grid.size();
    let (x, y) = (TAU * m as f64 / lx, TAU * n as f64 / ly);
    let unsigned = [2 * m.unsigned_abs() == grid.nx, 2 * n == grid.ny];
    if unsigned[axis] || (m == 0 && n == 0) {
        return 0.0;
    }
    -TAU * gamma * [x, y][axis] / (x * x + y * y)
}
