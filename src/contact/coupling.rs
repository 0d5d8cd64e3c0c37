//! The blocks of K that couple pressure and shear, of bodies that differ elastically.
//!
//! A half space with z into it and its surface at z = 0, under a point force at the origin, is displaced at (x, y, 0) by
//! (Johnson, Contact Mechanics, eq. 3.18 f. and §3.6)
//!
//! - u_x = −(1 − 2ν)/(4πG) · P x/r² under P along z: the surface is drawn towards a pressure,
//! - u_z = +(1 − 2ν)/(4πG) · Q x/r² under Q along x: the surface sinks ahead of a shear and rises behind it,
//!
//! and alike along y. Both bodies see the pressure p along their own z. The shear q, positive along the slip of the upper
//! body, acts on the lower body as +q and on the upper one as −q. With c = (1 − 2ν)/(4πG) of either body this gives, r from the
//! traction to the point of displacement,
//!
//! | | lower body | upper body |
//! |---|---|---|
//! | along x under p | −c_l p x/r² | −c_u p x/r² |
//! | into itself under q_x | +c_l q_x x/r² | −c_u q_x x/r² |
//!
//! The gap opens by what both sink into themselves, w_z; the slip of the upper body falls behind the motion Δδ by what the lower
//! surface moves along more than the upper, w_x (both are the signs of the uncoupled blocks, where u = Kp opens the gap and
//! s = Δδ − Kq). Hence, with γ = c_l − c_u = β/(πE*),
//!
//! K_zx = γ x/r², K_xz = −γ x/r²: K_xz is the transpose of K_zx, and the whole K is symmetric, as reciprocity has it.
//!
//! Under waves exp(ik·x), x/r² = ∂ ln r/∂x has the transform −2πi k_x/k², since ∇² ln r = 2πδ.

use std::f64::consts::TAU;

use super::Pair;
use super::half_space::Boundary;
use super::kernel::coupling_integrals;
use crate::fft::{Convolution, Workspace};
use crate::grid::{ByAxis, Grid};

/// The transforms of K_zx and, where there is shear along y, of K_zy: one odd kernel an axis. K_xz is −K_zx.
pub(super) struct Coupling {
    kernels: ByAxis<Vec<f64>>,
}

impl Coupling {
    /// Kernels for shear along one axis or two, in the layout of `convolution`.
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

    /// Axes of the shear.
    pub(super) fn axes(&self) -> usize {
        self.kernels.len()
    }

    /// w_z = Σ K_za ⊗ q_a.
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

    /// w_a = K_az ⊗ p.
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

/// Imaginary part of the transform of K_za, −2πγ k_a/k²; zero at the highest wave number of an even length, which has no sign.
fn symbol(grid: Grid, gamma: f64, axis: usize, m: isize, n: usize) -> f64 {
    let [lx, ly] = grid.size();
    let (x, y) = (TAU * m as f64 / lx, TAU * n as f64 / ly);
    let unsigned = [2 * m.unsigned_abs() == grid.nx, 2 * n == grid.ny];
    if unsigned[axis] || (m == 0 && n == 0) {
        return 0.0;
    }
    -TAU * gamma * [x, y][axis] / (x * x + y * y)
}
