//! The shear of Ciavarella and Jäger: two pressures superposed, in place of a tangential solve.
//!
//! Under constant load and a motion along a line d from rest, q = µ (p − p*) d, where p* is a pressure of the same surfaces at a
//! reduced load, N* = N − T/µ, or a reduced approach, δ* = δ − u/(µκ), with κ the tangential over the normal compliance
//! (Ciavarella 1998; Jäger 1998). Cells with p* > 0 stick. Between half spaces of one material this is exact where shear displaces
//! as pressure does, κ times as far and along itself alone: for ν = 0. Otherwise it is an approximation: the stick cells
//! slip a little and the displacement is not the one asked for. Both count in [`TangentialSolution::error`], the relative duality
//! gap of this shear as the exact solve has it, for the true kernels.
//!
//! On the cells in contact p* is the pressure of heights K p against a flat, so that cells at the pressure's cap and bodies that
//! turned are taken as they are.

use super::joint::{FrettingJoint, WearError};
use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::tangential::{self, TangentialProblem, TangentialSolution};
use crate::grid::{ByAxis, Patch};

/// Tolerance of the reduced pressure. What it leaves is far below the error of the superposition itself.
const TOLERANCE: f64 = 1e-3;

impl FrettingJoint {
    /// The first loading from rest to `end`, a state of the motion's channels, under the static `contact`. `start` is a shear of
    /// an earlier one, used for speed alone.
    ///
    /// # Errors
    /// [`WearError::NotSuperposed`] unless what moves is displaced, or loaded, along all its axes, and does not turn.
    pub(super) fn superposed(
        &mut self,
        contact: &NormalSolution,
        end: &[f64],
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<TangentialSolution, WearError> {
        let axes = self.motion.drive.len();
        let (along, turned) = end.split_at(axes);
        let amount = along.iter().map(|e| e * e).sum::<f64>().sqrt();
        let moving = || {
            self.motion
                .drive
                .iter()
                .zip(along)
                .filter(|(_, e)| **e != 0.0)
        };
        let by_force = moving().any(|(channel, _)| channel.is_force());
        if turned.iter().any(|e| *e != 0.0) || moving().any(|(c, _)| c.is_force() != by_force) {
            return Err(WearError::NotSuperposed);
        }
        let limit = self.limit(&contact.pressure);
        let mut shear = vec![vec![0.0; limit.len()]; axes];
        if amount > 0.0 {
            let direction: Vec<f64> = along.iter().map(|e| e / amount).collect();
            let reduced = self.reduced(contact, &direction, amount, by_force, start)?;
            for (q, direction) in shear.iter_mut().zip(&direction) {
                let pressures = contact.pressure.iter().zip(&reduced);
                for (q, (p, reduced)) in q.iter_mut().zip(pressures) {
                    *q = self.friction_coefficient * (p - reduced.min(*p)) * direction;
                }
            }
        }
        let driven = self.motion.between(&vec![0.0; end.len()], end);
        let problem = TangentialProblem {
            patch: &self.patch,
            limit: &limit,
            previous: None,
            drive: &driven.drive,
            rotation: driven.rotation,
            offset: None,
        };
        Ok(tangential::evaluate(
            &mut self.half_space,
            &problem,
            &shear,
        )?)
    }

    /// The pressure p* on the cells in contact, 0 elsewhere.
    fn reduced(
        &mut self,
        contact: &NormalSolution,
        direction: &[f64],
        amount: f64,
        by_force: bool,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<Vec<f64>, WearError> {
        let pressure = &contact.pressure;
        let mut height = vec![0.0; pressure.len()];
        self.half_space.normal(pressure, &mut height);
        let control = if by_force {
            Control::Load((contact.load - amount / self.friction_coefficient).max(0.0))
        } else {
            let ratio = self.compliance_ratio(pressure, &height, direction);
            Control::Approach(-amount / (self.friction_coefficient * ratio))
        };
        let patch = Patch {
            grid: self.patch.grid,
            kept: pressure.iter().map(|p| *p > 0.0).collect(),
        };
        let first: Vec<f64> = match start {
            Some(shear) => (0..pressure.len())
                .map(|c| {
                    let q = shear.iter().map(|q| q[c] * q[c]).sum::<f64>().sqrt();
                    (pressure[c] - q / self.friction_coefficient).max(0.0)
                })
                .collect(),
            None => pressure.clone(),
        };
        let problem = NormalProblem {
            patch: &patch,
            height: &height,
            compliance: None,
            control,
            rotation: Rotation::FIXED,
            pressure_cap: None,
        };
        let options = NormalOptions {
            tolerance: self.options.normal.tolerance.max(TOLERANCE),
            ..self.options.normal
        };
        Ok(normal::solve(&mut self.half_space, &problem, Some(&first), options)?.pressure)
    }

    /// κ: the energy of shear in proportion to the pressure over that of the pressure.
    fn compliance_ratio(&mut self, pressure: &[f64], normal: &[f64], direction: &[f64]) -> f64 {
        let energy = |u: &[f64]| pressure.iter().zip(u).map(|(p, u)| p * u).sum::<f64>();
        let mut displacement = vec![0.0; pressure.len()];
        let tangential = match direction {
            [_] => {
                self.half_space.shear_x(pressure, &mut displacement);
                energy(&displacement)
            }
            _ => {
                let shear = [0, 1].map(|axis| {
                    let part = direction[axis];
                    pressure.iter().map(|p| part * p).collect::<Vec<f64>>()
                });
                let mut along_y = displacement.clone();
                self.half_space
                    .shear([&shear[0], &shear[1]], [&mut displacement, &mut along_y]);
                direction[0] * energy(&displacement) + direction[1] * energy(&along_y)
            }
        };
        tangential / energy(normal)
    }
}
