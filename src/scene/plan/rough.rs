//! The rough contact of a scene: what is decided about it, and what is built.

use super::{Decisions, Plan, PlanError};
use crate::contact::normal::NormalOptions;
use crate::contact::tangential::TangentialOptions;
use crate::contact::{Elastic, HalfSpace, Pair, Shear};
use crate::fft::fast_length;
use crate::grid::{Grid, Patch};
use crate::scene::{
    Boundary, Contact, CycleMode, Fidelity, Material, RoughJoint, Scene, Scheme, Solid, Transverse,
};
use crate::wear::cycle::March;
use crate::wear::joint::FrettingOptions;
use crate::wear::{FrettingJoint, Motion};

/// |β| below which bodies count as elastically alike: rounding of equal constants.
const ALIKE: f64 = 1e-12;

/// A computed motion that varies the load by less than this share of it, and leaves its line by less than this share of its
/// reach, is marched between its two reversals: the error of wear is of second order in both.
pub(super) const STRAIGHT: f64 = 0.01;

/// Points of the plane that fields of a scene are transformed on.
pub(super) fn plane(grid: Grid, boundary: Boundary) -> [usize; 2] {
    match boundary {
        Boundary::Free => [fast_length(2 * grid.nx - 1), fast_length(2 * grid.ny - 1)],
        Boundary::Periodic => [grid.nx, grid.ny],
    }
}

pub(super) fn decide(
    scene: &Scene,
    rough: &RoughJoint,
    motion: Option<&Motion>,
    decisions: &mut Decisions,
) -> Result<(Shear, Option<March>), PlanError> {
    let contact = rough.contact;
    let patch = rough.patch();
    check(scene, rough, &patch, motion)?;
    let plane = plane(patch.grid, contact.boundary);
    decisions.add(
        "transforms",
        format!("real, {} x {}", plane[0], plane[1]),
        match contact.boundary {
            Boundary::Free => {
                "contact.boundary = \"free\": fields are padded with zeros to twice their length"
            }
            Boundary::Periodic => {
                "contact.boundary = \"periodic\": fields are transformed as they are"
            }
        },
    );
    let outside = patch.grid.len() - patch.cells();
    decisions.add(
        "cells",
        format!("{} of {}", patch.cells(), patch.grid.len()),
        if rough.resonator.is_some() {
            "the cells whose centre lies in a contact element of the structure"
        } else if outside > 0 {
            "cells in the hole and unmeasured ones carry nothing"
        } else {
            "no hole"
        },
    );
    let (cap, why) = match contact.pressure_cap {
        Some(cap) => (format!("at {cap:e} Pa"), "contact.pressure_cap is given"),
        None => ("none".to_owned(), "no contact.pressure_cap: elastic"),
    };
    decisions.add("pressure cap", cap, why);
    decisions.add(
        "kernels normal-tangential (zx, zy)",
        "none",
        "the bodies are elastically alike (Dundurs' beta = 0): pressure causes no slip",
    );
    let shear = match contact.transverse {
        Transverse::Absent => Shear::AlongX,
        Transverse::Fixed | Transverse::Free => Shear::InPlane,
    };
    match shear {
        Shear::AlongX => decisions.add(
            "shear",
            "along x; kernel xx",
            "contact.transverse = \"absent\": no field q_y, no kernels yy and xy",
        ),
        Shear::InPlane => decisions.add(
            "shear",
            "along x and y; kernels xx, yy, xy",
            "contact.transverse = \"fixed\": with Poisson's ratio a motion along x causes shear along y too",
        ),
    }
    let march = decide_cycle(scene, motion, decisions)?;
    decide_wear(scene, decisions);
    Ok((shear, march))
}

fn decide_cycle(
    scene: &Scene,
    motion: Option<&Motion>,
    decisions: &mut Decisions,
) -> Result<Option<March>, PlanError> {
    let mut decide = |choice: String, why: &str| decisions.add("fretting cycle", choice, why);
    if scene.dynamics.is_some() {
        match scene.fidelity.cycle {
            Some(CycleMode::Stepped) => decide(
                format!(
                    "stepped: {} exact solves a cycle, until it closes",
                    scene.fidelity.steps_per_cycle
                ),
                "fidelity.cycle or the preset asks for it",
            ),
            _ => decide(
                "after dynamic_response: reversal or stepped".to_owned(),
                &format!(
                    "reversal where the joint's load varies by less than {STRAIGHT} of it and its motion leaves its line by less than {STRAIGHT} of its reach; else stepped"
                ),
            ),
        }
        return Ok(None);
    }
    let Some(motion) = motion.filter(|_| scene.motion.is_some()) else {
        decide("none".to_owned(), "no [motion]: static contact");
        return Ok(None);
    };
    let march = march(scene.fidelity.cycle, motion)?;
    match march {
        March::Reversal => decide(
            "reversal: one exact solve a cycle".to_owned(),
            "straight motion about zero under constant load: the steady cycle is antisymmetric",
        ),
        March::Stepped => decide(
            format!(
                "stepped: {} exact solves a cycle, until it closes",
                motion.samples()
            ),
            match scene.fidelity.cycle {
                Some(_) => "fidelity.cycle or the preset asks for it",
                None => "the load varies, or the motion is not straight about zero",
            },
        ),
    }
    Ok(Some(march))
}

fn decide_wear(scene: &Scene, decisions: &mut Decisions) {
    let Some(wear) = &scene.wear else {
        decisions.add("wear", "none", "no [wear]: a single pass");
        return;
    };
    let (choice, why) = match wear.scheme {
        Scheme::Implicit => (
            format!(
                "implicit, second order, error {} of the volume of each step",
                wear.tolerance
            ),
            "wear.scheme = \"implicit\": stable at any step",
        ),
        Scheme::Explicit => (
            format!(
                "explicit, {:e} m a step",
                wear.depth_step.unwrap_or(f64::NAN)
            ),
            "wear.scheme = \"explicit\": the published step [A eq. 2.7-2.8]",
        ),
    };
    decisions.add("wear", choice, why);
}

impl Plan {
    /// The elastic bodies of a scene.
    pub fn pair(material: &Material) -> Pair {
        Pair {
            lower: solid(&material.lower),
            upper: solid(&material.upper),
        }
    }

    /// Builds what was decided, on the given unworn heights.
    pub fn build(
        &self,
        fidelity: &Fidelity,
        rough: &RoughJoint,
        patch: Patch,
        height: Vec<f64>,
        motion: Motion,
    ) -> FrettingJoint {
        let contact = rough.contact;
        FrettingJoint {
            half_space: HalfSpace::new(patch.grid, Plan::pair(rough.material), contact.boundary),
            patch,
            height,
            pressure_cap: contact.pressure_cap,
            friction_coefficient: contact.friction_coefficient.unwrap_or(0.0),
            motion,
            march: self.march.unwrap_or(March::Reversal),
            options: FrettingOptions {
                normal: NormalOptions {
                    tolerance: fidelity.normal_tolerance,
                    ..NormalOptions::default()
                },
                tangential: TangentialOptions {
                    tolerance: fidelity.tangential_tolerance,
                    ..TangentialOptions::default()
                },
                cycle_tolerance: fidelity.cycle_tolerance,
            },
        }
    }

    /// The motion that the fretting cycle marches for a computed one, and how: between its reversals where it is straight and
    /// steady enough, else at `fidelity.steps_per_cycle` of its samples.
    ///
    /// `fine` has many samples, a multiple of `fidelity.steps_per_cycle`.
    ///
    /// # Errors
    /// [`PlanError::NotStraight`] where `reversal` is asked for and not possible, [`PlanError::LiftsOff`].
    pub fn computed_motion(
        fidelity: &Fidelity,
        fine: &Motion,
    ) -> Result<(Motion, March), PlanError> {
        let least = fine
            .normal_load
            .iter()
            .copied()
            .fold(f64::INFINITY, f64::min);
        if least <= 0.0 {
            return Err(PlanError::LiftsOff { load: least });
        }
        let stepped = || {
            let every = fine.samples() / fidelity.steps_per_cycle;
            (fine.every(every.max(1)).about_its_middle(), March::Stepped)
        };
        if fidelity.cycle == Some(CycleMode::Stepped) {
            return Ok(stepped());
        }
        match (fine.reversals(STRAIGHT), fidelity.cycle) {
            (Some(motion), _) => Ok((motion, March::Reversal)),
            (None, Some(CycleMode::Reversal)) => Err(PlanError::NotStraight),
            (None, _) => Ok(stepped()),
        }
    }
}

/// The harmonic motion of a scene; none where there is no such motion.
pub fn motion_of(scene: &Scene, contact: &Contact) -> Motion {
    let load = contact.normal_load;
    let Some(crate::scene::Motion::Harmonic {
        amplitude,
        phase,
        normal_load_amplitude,
    }) = &scene.motion
    else {
        return Motion::none(load);
    };
    let mut axes = vec![(amplitude[0], phase[0])];
    if contact.transverse != Transverse::Absent {
        axes.push((amplitude[1], phase[1]));
    }
    Motion::harmonic(
        &axes,
        load,
        *normal_load_amplitude,
        scene.fidelity.steps_per_cycle,
    )
}

fn solid(solid: &Solid) -> Elastic {
    Elastic {
        youngs_modulus: solid.youngs_modulus,
        poisson_ratio: solid.poisson_ratio,
    }
}

fn check(
    scene: &Scene,
    rough: &RoughJoint,
    patch: &Patch,
    motion: Option<&Motion>,
) -> Result<(), PlanError> {
    if patch.cells() == 0 {
        return Err(PlanError::NoCells {
            cells: patch.grid.len(),
        });
    }
    let beta = Plan::pair(rough.material).dundurs_beta();
    if beta.abs() > ALIKE {
        return Err(PlanError::Dissimilar { beta });
    }
    if rough.contact.transverse == Transverse::Free {
        let (value, instead) = (
            "\"free\"",
            "\"fixed\" (no mean displacement along y) or \"absent\" (no y at all)",
        );
        return Err(PlanError::NotAvailable {
            key: "contact.transverse",
            value,
            instead,
        });
    }
    if scene.fidelity.cycle == Some(CycleMode::Superposition) {
        let (value, instead) = (
            "\"superposition\"",
            "\"reversal\" or \"stepped\", which are exact",
        );
        return Err(PlanError::NotAvailable {
            key: "fidelity.cycle",
            value,
            instead,
        });
    }
    if scene.output.cycle_fields {
        let (value, instead) = ("true", "false: the fields at t = 0 are in contact_field");
        return Err(PlanError::NotAvailable {
            key: "output.cycle_fields",
            value,
            instead,
        });
    }
    let loads = motion.map_or(&[][..], |motion| &motion.normal_load);
    let least = loads.iter().copied().fold(f64::INFINITY, f64::min);
    if least <= 0.0 && scene.motion.is_some() {
        return Err(PlanError::LiftsOff { load: least });
    }
    if let Some(cap) = rough.contact.pressure_cap {
        let area = patch.area();
        let load = loads
            .iter()
            .copied()
            .fold(rough.contact.normal_load, f64::max);
        if load > cap * area {
            return Err(PlanError::CapTooLow {
                cap,
                area,
                capacity: cap * area,
                load,
            });
        }
    }
    Ok(())
}

fn march(cycle: Option<CycleMode>, motion: &Motion) -> Result<March, PlanError> {
    let straight = motion.straight().is_some();
    match cycle {
        Some(CycleMode::Reversal) if !straight => Err(PlanError::NotStraight),
        Some(CycleMode::Stepped) => Ok(March::Stepped),
        _ if straight => Ok(March::Reversal),
        _ => Ok(March::Stepped),
    }
}
