//! Stiffness of a joint at a contact that it has.

use super::{FrettingJoint, WearError};
use crate::contact::normal::Rotation;
use crate::contact::stiffness::{self, Direction};
use crate::contact::{Coupling, Shear};

impl FrettingJoint {
    /// kn and kt \[N/m\] under `pressure` \[Pa\]. Capped cells count in kt alone; kn is that of bodies that turn where the rotation is
    /// free. Those of coupled bodies are at full stick, but for kn without friction.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let elastic = stiffness::elastic_cells(pressure, self.pressure_cap);
        let contact: Vec<bool> = pressure.iter().map(|&p| p > 0.0).collect();
        let half_space = &mut self.half_space;
        let kt = match coupling {
            Coupling::None => stiffness::tangential(half_space, &contact, shear)?,
            _ => stiffness::coupled(half_space, Direction::AlongX, &elastic, &contact, shear)?,
        };
        let kn = match (coupling, self.rotation) {
            (Coupling::None | Coupling::Frictionless, Rotation::Given(_)) => {
                stiffness::normal(half_space, &elastic)?
            }
            (Coupling::None | Coupling::Frictionless, Rotation::Free { .. }) => {
                stiffness::turning(half_space, &elastic)?
            }
            _ => stiffness::coupled(half_space, Direction::Normal, &elastic, &contact, shear)?,
        };
        Ok((kn.total, kt.total))
    }
}
