//! Pressure, shear and slip at selected instants of a steady cycle. If the load varies, the fields also include the
//! gap.
//!
//! The cycle stores only the shear at the selected instants. The program computes the slip v of every cell from the
//! shear q and the displacement δ of the bodies. The slip v is δ − K q minus the value of δ − K q at t = 0. The
//! computed slip is zero on stick cells within the tolerance of the solves. The slip is continuous across the edge of
//! the contact.

use super::cycle::{CycleSolution, Instant};
use super::joint::FrettingJoint;
use super::limits::FrictionLimits;
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// Fields at one instant of a cycle, on all cells.
#[derive(Debug, Clone, PartialEq)]
pub struct InstantFields {
    /// Number of the instant in [`CycleSolution::instants`].
    pub instant: usize,
    /// Pressure \[Pa\].
    pub pressure: Vec<f64>,
    /// Gap \[m\]; `None` if no cell's load changes over the cycle.
    pub gap: Option<Vec<f64>>,
    /// Shear on the lower body, along the displacement of the upper one that causes it \[Pa\].
    pub shear: ByAxis<Vec<f64>>,
    /// Slip of the upper body on the lower one since t = 0 \[m\].
    pub slip: ByAxis<Vec<f64>>,
}

/// Shear at an instant of a cycle, and the sample of the motion at that instant.
pub(super) struct InstantShear {
    pub(super) instant: usize,
    pub(super) sample: usize,
    pub(super) shear: ByAxis<Vec<f64>>,
}

impl FrettingJoint {
    /// Computes the fields of the instants in `shears`, in their order. `limits` belong to a cycle whose load
    /// may vary; without them the static contact applies throughout.
    pub(super) fn fields(
        &mut self,
        contact: &NormalSolution,
        limits: Option<&FrictionLimits>,
        solution: &CycleSolution,
        shears: Vec<InstantShear>,
    ) -> Vec<InstantFields> {
        if shears.is_empty() {
            return Vec::new();
        }
        let begin = self.unslipped(&solution.instants[0], 0, &solution.shear);
        let fields = shears.into_iter().map(|instant_shear| {
            let mut slip = self.unslipped(
                &solution.instants[instant_shear.instant],
                instant_shear.sample,
                &instant_shear.shear,
            );
            for (slip, begin) in slip.iter_mut().zip(&begin) {
                slip.iter_mut().zip(begin).for_each(|(v, v0)| *v -= v0);
            }
            let contact_at_sample =
                limits.and_then(|limits| limits.contact_at(instant_shear.sample));
            let (pressure, gap) = match contact_at_sample {
                Some((pressure, gap)) => (pressure.to_vec(), Some(gap.to_vec())),
                None => (contact.pressure.clone(), None),
            };
            InstantFields {
                instant: instant_shear.instant,
                pressure,
                gap,
                shear: instant_shear.shear,
                slip,
            }
        });
        fields.collect()
    }

    /// Returns δ − K q at each cell: the displacement of the bodies minus the elastic displacement due to
    /// shear \[m\]. The value is zero on cells that are not kept.
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
        let own = self.motion.nodal_motion.as_ref().map(|own| {
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
                field[c] = match self.patch.is_in_joint[c] {
                    true => bodies - field[c],
                    false => 0.0,
                };
            }
        }
        unslipped
    }
}
