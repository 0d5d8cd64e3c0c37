//! Fields at chosen instants of a steady cycle: pressure, shear, slip and, where the load varies, gap.
//!
//! A march keeps the shear of these instants alone. Slip follows from it and from where the bodies are, as v = δ − K q on every cell, less
//! what it is at t = 0: so it is zero on stick cells to the tolerance of the solves, and goes on beside the contact.

use super::cycle::{CycleSolution, Instant};
use super::joint::FrettingJoint;
use super::limits::FrictionLimits;
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// The fields at an instant of a cycle, on all cells.
#[derive(Debug, Clone, PartialEq)]
pub struct InstantFields {
    /// Number of the instant in [`CycleSolution::instants`].
    pub instant: usize,
    /// Pressure \[Pa\].
    pub pressure: Vec<f64>,
    /// Gap \[m\]; none where the load of no cell changes over the cycle.
    pub gap: Option<Vec<f64>>,
    /// Shear on the lower body, along the displacement of the upper one that causes it \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Slip of the upper body on the lower one since t = 0 \[m\].
    pub slip: ByAxis<Vec<f64>>,
}

/// The shear at an instant of a cycle, and at which sample of the motion that is.
pub(super) struct InstantShear {
    pub(super) instant: usize,
    pub(super) sample: usize,
    pub(super) shear: ByAxis<Vec<f64>>,
}

impl FrettingJoint {
    /// The fields of the instants `kept`, in their order. `limits` are those of a cycle whose load may vary; without them the contact is the
    /// static one throughout.
    pub(super) fn fields(
        &mut self,
        contact: &NormalSolution,
        limits: Option<&FrictionLimits>,
        solution: &CycleSolution,
        kept: Vec<InstantShear>,
    ) -> Vec<InstantFields> {
        if kept.is_empty() {
            return Vec::new();
        }
        let begin = self.unslipped(&solution.instants[0], 0, &solution.shear);
        let fields = kept.into_iter().map(|kept| {
            let mut slip =
                self.unslipped(&solution.instants[kept.instant], kept.sample, &kept.shear);
            for (slip, begin) in slip.iter_mut().zip(&begin) {
                slip.iter_mut().zip(begin).for_each(|(v, v0)| *v -= v0);
            }
            let of_sample = limits.and_then(|limits| limits.contact_at(kept.sample));
            let (pressure, gap) = match of_sample {
                Some((pressure, gap)) => (pressure.to_vec(), Some(gap.to_vec())),
                None => (contact.pressure.clone(), None),
            };
            InstantFields {
                instant: kept.instant,
                pressure,
                gap,
                shear: kept.shear,
                slip,
            }
        });
        fields.collect()
    }

    /// δ − K q: what the bodies are displaced by at each cell less what the shear lets the surfaces follow \[m\]. Zero on cells that are not kept.
    fn unslipped(
        &mut self,
        instant: &Instant,
        sample: usize,
        shear: &ByAxis<Vec<f64>>,
    ) -> ByAxis<Vec<f64>> {
        let grid = self.patch.grid;
        let mut elastic = vec![vec![0.0; grid.len()]; shear.len()];
        match (&shear[..], &mut elastic[..]) {
            ([x], [ux]) => self.half_space.shear_x(x, ux),
            ([x, y], [ux, uy]) => self.half_space.shear([x, y], [ux, uy]),
            _ => unreachable!("a cycle has one axis or two"),
        }
        let own = self.motion.own.as_ref().map(|own| {
            let place = &own.displacement[sample];
            own.between(&vec![0.0; place.len()], place)
        });
        let rotation = instant.torsion.map_or(0.0, |[rotation, _]| rotation);
        let mut unslipped = elastic;
        for c in 0..grid.len() {
            let (i, j) = grid.cell(c);
            let (x, y) = grid.centre(i, j);
            let turned = [-rotation * y, rotation * x];
            for (axis, field) in unslipped.iter_mut().enumerate() {
                let own = own.as_ref().map_or(0.0, |own| own[axis][c]);
                let bodies = instant.displacement[axis] + turned[axis] + own;
                field[c] = match self.patch.kept[c] {
                    true => bodies - field[c],
                    false => 0.0,
                };
            }
        }
        unslipped
    }
}
