//! Cycles in which each place of a joint has a load of its own: its nodes come closer to each other at one end of the motion than at the
//! other, although the load of the joint hardly varies.
//!
//! The static contact is found under the load of the joint, by the half spaces alone. From there on the nodes are displaced as the
//! structure says, and what the cells between them answer with is the half spaces less what the mesh has of them
//! ([`crate::contact::nodes`]), as it is in the plane.

use super::joint::{FrettingJoint, WearError};
use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};

impl FrettingJoint {
    /// The contacts at every sample, one after the other; none where every place has the load of the static contact.
    pub(super) fn contacts_by_place(
        &mut self,
        contact: &NormalSolution,
        mut each: impl FnMut(&Self, &NormalSolution),
    ) -> Result<bool, WearError> {
        let own = self.motion.own.as_ref();
        let Some(own) = own.filter(|own| !own.approach.is_empty()) else {
            return Ok(false);
        };
        let approaches = (0..self.motion.samples()).map(|k| own.approach_of_cells(k));
        let approaches: Vec<Vec<f64>> = approaches.collect();
        self.closer(contact, approaches, self.options.normal, &mut each)?;
        Ok(true)
    }

    /// Pressures where cells come closer than in a static contact by each of these \[m\], one field after the other \[Pa\].
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn pressures_by_place(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
    ) -> Result<Vec<Vec<f64>>, WearError> {
        let mut pressures = Vec::with_capacity(approaches.len());
        self.closer(contact, approaches, options, &mut |_, found| {
            pressures.push(found.pressure.clone());
        })?;
        Ok(pressures)
    }

    fn closer(
        &mut self,
        contact: &NormalSolution,
        approaches: Vec<Vec<f64>>,
        options: NormalOptions,
        each: &mut impl FnMut(&Self, &NormalSolution),
    ) -> Result<(), WearError> {
        // The height under which the static contact is one of the kernel that answers the nodes.
        let mut rest = vec![0.0; self.patch.grid.len()];
        self.half_space.normal(&contact.pressure, &mut rest);
        rest.iter_mut().zip(&contact.gap).for_each(|(u, g)| *u -= g);
        let mut start = contact.pressure.clone();
        for mut height in approaches {
            height.iter_mut().zip(&rest).for_each(|(h, u)| *h += u);
            let problem = NormalProblem {
                patch: &self.patch,
                height: &height,
                compliance: None,
                control: Control::Approach(0.0),
                rotation: Rotation::Given([0.0; 2]),
                pressure_cap: self.pressure_cap,
            };
            let found = normal::solve(&mut self.half_space, &problem, Some(&start), options)?;
            each(self, &found);
            start = found.pressure;
        }
        Ok(())
    }
}
