//! Stiffness of a joint at a contact that it has.

use super::{FrettingJoint, WearError};
use crate::contact::normal::Rotation;
use crate::contact::stiffness::{self, Direction};
use crate::contact::{ContactError, Coupling, HalfSpace, Shear};

impl FrettingJoint {
    /// kn and kt \[N/m\] under `pressure` \[Pa\], of half spaces. Capped cells count in kt alone; kn is that of bodies that turn where the
    /// rotation is free. Those of coupled bodies are at full stick, but for kn without friction.
    /// They are right to 1e-6.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve = self.linearised(pressure, shear, coupling, stiffness::FIGURE_TOLERANCE);
        Ok(self.half_space.without_nodal(solve)?)
    }

    /// kn and kt \[N/m\] as [`FrettingJoint::stiffness`], without the compliance of a structure's own mesh where that is taken from the
    /// half spaces; right to some 1e-4, enough to hold them against the contact elements'.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness_beyond_mesh(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve = self.linearised(pressure, shear, coupling, stiffness::COMPARED_TOLERANCE);
        Ok(solve(&mut self.half_space)?)
    }

    /// What finds both stiffnesses on a half space.
    fn linearised<'a>(
        &self,
        pressure: &'a [f64],
        shear: Shear,
        coupling: Coupling,
        tolerance: f64,
    ) -> impl FnOnce(&mut HalfSpace) -> Result<(f64, f64), ContactError> + use<'a> {
        let (cap, rotation) = (self.pressure_cap, self.rotation);
        move |half_space| {
            of(
                half_space, pressure, cap, rotation, shear, coupling, tolerance,
            )
        }
    }
}

fn of(
    half_space: &mut HalfSpace,
    pressure: &[f64],
    cap: Option<f64>,
    rotation: Rotation,
    shear: Shear,
    coupling: Coupling,
    tolerance: f64,
) -> Result<(f64, f64), ContactError> {
    let elastic = stiffness::elastic_cells(pressure, cap);
    let contact: Vec<bool> = pressure.iter().map(|&p| p > 0.0).collect();
    let kn = match (coupling, rotation) {
        (Coupling::None | Coupling::Frictionless, Rotation::Given(_)) => {
            stiffness::normal_to(half_space, &elastic, tolerance)?
        }
        (Coupling::None | Coupling::Frictionless, Rotation::Free { .. }) => {
            stiffness::turning(half_space, &elastic)?
        }
        _ => stiffness::coupled(
            half_space,
            Direction::Normal,
            &elastic,
            &contact,
            shear,
            tolerance,
        )?,
    };
    let kt = match coupling {
        Coupling::None => {
            stiffness::tangential_from(half_space, &contact, shear, tolerance, Some(&kn))?
        }
        _ => stiffness::coupled(
            half_space,
            Direction::AlongX,
            &elastic,
            &contact,
            shear,
            tolerance,
        )?,
    };
    Ok((kn.total, kt.total))
}
