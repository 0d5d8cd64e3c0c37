//! The rough contact of a scene: what is decided about it, and what is built.

use super::{Coupling, Decisions, Plan, PlanError};
use crate::contact::normal::{self, NormalOptions};
use crate::contact::tangential::TangentialOptions;
use crate::contact::{Elastic, HalfSpace, Pair, Shear};
use crate::fft::fast_length;
use crate::grid::{Grid, Patch};
use crate::scene::{
    Boundary, Contact, CycleMode, Fidelity, Material, Preset, Rotation, RoughJoint, Scene, Scheme,
    Solid, Torsion, Transverse,
};
use crate::wear::cycle::March;
use crate::wear::joint::FrettingOptions;
use crate::wear::{Channel, FrettingJoint, Harmonic, Motion};

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
) -> Result<(Shear, Option<March>, Coupling), PlanError> {
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
    let coupling = coupling(scene, rough)?;
    let (choice, why) = match coupling {
        Coupling::None => (
            "none".to_owned(),
            "the bodies are elastically alike (Dundurs' beta = 0): pressure causes no slip"
                .to_owned(),
        ),
        Coupling::Frictionless => (
            "in kt alone".to_owned(),
            format!(
                "Dundurs' beta = {:.4}, and no contact.friction_coefficient: without shear the pressure is that of alike bodies of the same E*",
                Plan::pair(rough.material).dundurs_beta()
            ),
        ),
        Coupling::Indented { load_steps } => (
            format!("pressure and shear together, in {load_steps} load steps"),
            format!(
                "Dundurs' beta = {:.4}: pressing the bodies together makes them slip; kn and kt are of full stick",
                Plan::pair(rough.material).dundurs_beta()
            ),
        ),
    };
    decisions.add("kernels normal-tangential (zx, zy)", choice, why);
    let shear = match contact.transverse {
        Transverse::Absent => Shear::AlongX,
        Transverse::Fixed | Transverse::Free => Shear::InPlane,
    };
    let (choice, why) = match contact.transverse {
        Transverse::Absent => (
            "along x; kernel xx",
            "contact.transverse = \"absent\": no field q_y, no kernels yy and xy",
        ),
        Transverse::Fixed => (
            "along x and y; kernels xx, yy, xy",
            "contact.transverse = \"fixed\": with Poisson's ratio a motion along x causes shear along y too",
        ),
        Transverse::Free => (
            "along x and y, without force along y; kernels xx, yy, xy",
            "contact.transverse = \"free\": the mean displacement along y is found and reported; kt is with it held",
        ),
    };
    decisions.add("shear", choice, why);
    decide_rotation(contact, decisions);
    if contact.friction_coefficient == Some(0.0) {
        decisions.add(
            "friction",
            "none",
            "contact.friction_coefficient = 0: no shear, nothing is dissipated and nothing wears",
        );
    }
    let march = decide_cycle(scene, motion, decisions)?;
    decide_wear(scene, decisions);
    Ok((shear, march, coupling))
}

/// What elastically different bodies make of a scene. Cycles and wear of such bodies are refused: their pressure changes with
/// the shear of every instant, which the cycle and the wear step take to be constant.
fn coupling(scene: &Scene, rough: &RoughJoint) -> Result<Coupling, PlanError> {
    let pair = Plan::pair(rough.material);
    if !pair.is_coupled() {
        return Ok(Coupling::None);
    }
    let beta = pair.dundurs_beta();
    if scene.motion.is_some() || scene.dynamics.is_some() {
        return Err(PlanError::Dissimilar { beta });
    }
    let contact = rough.contact;
    if contact.friction_coefficient.unwrap_or(0.0) == 0.0 {
        return Ok(Coupling::Frictionless);
    }
    let refused = [
        (
            contact.approach.is_some(),
            "contact.approach",
            "given",
            "contact.normal_load",
        ),
        (
            contact.moment.is_some(),
            "contact.moment",
            "given",
            "no moment",
        ),
        (
            contact.transverse == Transverse::Free,
            "contact.transverse",
            "\"free\"",
            "\"fixed\" or \"absent\"",
        ),
    ];
    match refused.into_iter().find(|(given, ..)| *given) {
        Some((_, key, value, instead)) => Err(PlanError::IndentedWithout {
            key,
            value,
            instead,
            beta,
        }),
        None => Ok(Coupling::Indented {
            load_steps: load_steps(&scene.fidelity),
        }),
    }
}

/// Their number is an error of first order: 16 change the approach by 2e-4 of it and the largest pressure by 5e-4, against 64.
fn load_steps(fidelity: &Fidelity) -> usize {
    fidelity.load_steps.unwrap_or(match fidelity.preset {
        Preset::Fast => 8,
        Preset::Paper | Preset::Balanced => 16,
        Preset::Reference => 64,
    })
}

fn decide_rotation(contact: &Contact, decisions: &mut Decisions) {
    let (choice, why) = match (contact.rotation, contact.moment) {
        (Rotation::Fixed, _) => (
            "held; the moments of the pressure are reported".to_owned(),
            "contact.rotation = \"fixed\"",
        ),
        (Rotation::Free, None) => (
            "found such that the pressure has no moments, and reported".to_owned(),
            "contact.rotation = \"free\"; kn is that of bodies that turn",
        ),
        (Rotation::Free, Some([x, y])) => (
            format!(
                "found such that the pressure has moments of {x:e} and {y:e} N m, and reported"
            ),
            "contact.rotation = \"free\" with contact.moment; kn is that of bodies that turn",
        ),
    };
    decisions.add("rotations about x and y", choice, why);
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
                stepped(&scene.fidelity, scene.fidelity.steps_per_cycle),
                "fidelity.cycle or the preset asks for it",
            ),
            Some(mode @ (CycleMode::Reversal | CycleMode::Superposition)) => decide(
                format!(
                    "{}, if the motion that dynamic_response finds allows it",
                    word(mode)
                ),
                &format!(
                    "fidelity.cycle asks for it; the joint's load may vary by {STRAIGHT} of it and its motion leave its line by {STRAIGHT} of its reach"
                ),
            ),
            None => decide(
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
    if motion
        .drive
        .iter()
        .any(|axis| axis.is_force() && axis.moves())
    {
        decisions.add(
            "force in the plane",
            "given; the displacement is found and reported",
            "motion.force",
        );
    }
    match &motion.rotation {
        Some(Channel::Displacement(_)) => decisions.add(
            "rotation about z",
            "given; its moment is reported",
            "motion.rotation",
        ),
        Some(Channel::Force(_)) => decisions.add(
            "rotation about z",
            "found from the moment given, and reported",
            "motion.moment",
        ),
        None => {}
    }
    let mut decide = |choice: String, why: &str| decisions.add("fretting cycle", choice, why);
    match march {
        March::Reversal => decide(
            "reversal: one exact solve a cycle".to_owned(),
            "straight motion about zero under constant load: the steady cycle is antisymmetric",
        ),
        March::Superposition => decide(
            "superposition: two pressures in place of a tangential solve, an approximation"
                .to_owned(),
            "fidelity.cycle asks for it",
        ),
        March::Stepped => decide(
            stepped(&scene.fidelity, motion.samples()),
            match scene.fidelity.cycle {
                Some(_) => "fidelity.cycle or the preset asks for it",
                None => "the load varies, or the motion is not straight about zero",
            },
        ),
    }
    Ok(Some(march))
}

fn stepped(fidelity: &Fidelity, samples: usize) -> String {
    let extrapolated = if fidelity.cycle_extrapolation {
        "; with half of them too, for its error and, where the motion turns, to extrapolate"
    } else {
        ""
    };
    format!("stepped: {samples} exact solves a cycle, until it closes{extrapolated}")
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
        Scheme::SemiImplicit => (
            format!(
                "implicit in the pressure, first order, {:e} m a step at the rate of its beginning",
                wear.depth_step.unwrap_or(f64::NAN)
            ),
            "wear.scheme = \"semi_implicit\": the slip of a step's beginning, without an error to set the step",
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
            rotation: match contact.rotation {
                Rotation::Fixed => normal::Rotation::FIXED,
                Rotation::Free => normal::Rotation::Free {
                    moment: contact.moment.unwrap_or([0.0; 2]),
                },
            },
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
                extrapolate: fidelity.cycle_extrapolation,
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
            (Some(motion), Some(CycleMode::Superposition)) => Ok((motion, March::Superposition)),
            (Some(motion), _) => Ok((motion, March::Reversal)),
            (None, Some(mode)) => Err(PlanError::NotStraight { mode: word(mode) }),
            (None, None) => Ok(stepped()),
        }
    }
}

/// The harmonic motion of a scene; none where there is no such motion.
pub fn motion_of(scene: &Scene, contact: &Contact) -> Motion {
    let load = contact.normal_load;
    let Some(crate::scene::Motion::Harmonic {
        amplitude,
        force,
        torsion,
        phase,
        normal_load_amplitude,
    }) = &scene.motion
    else {
        return Motion::none(load);
    };
    let of_force = |axis: usize| force.map(|force| force[axis]);
    let axis = |axis: usize, force: Option<f64>| Harmonic {
        amplitude: force.unwrap_or(amplitude[axis]),
        phase: phase[axis],
        is_force: force.is_some(),
    };
    let mut axes = vec![axis(0, of_force(0))];
    // Without a force of its own y is held or free, as the scene says.
    let along_y = of_force(1).filter(|force| *force > 0.0);
    match contact.transverse {
        Transverse::Absent => {}
        Transverse::Fixed => axes.push(axis(1, along_y)),
        Transverse::Free => axes.push(axis(1, Some(along_y.unwrap_or(0.0)))),
    }
    let rotation = torsion.map(|torsion| {
        let (amplitude, is_force) = match torsion {
            Torsion::Rotation(rotation) => (rotation, false),
            Torsion::Moment(moment) => (moment, true),
        };
        Harmonic {
            amplitude,
            phase: 0.0,
            is_force,
        }
    });
    Motion::driven(
        &axes,
        rotation,
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
    if let (Some(motion), Some(friction)) = (motion, rough.contact.friction_coefficient) {
        check_force(motion, friction)?;
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

/// Forces stay below what friction carries, at every instant.
fn check_force(motion: &Motion, friction_coefficient: f64) -> Result<(), PlanError> {
    for (sample, &load) in motion.normal_load.iter().enumerate() {
        let forces = motion.drive.iter().filter(|axis| axis.is_force());
        let force = forces
            .map(|axis| axis.values()[sample].powi(2))
            .sum::<f64>()
            .sqrt();
        let limit = friction_coefficient * load;
        if force > 0.0 && force >= limit {
            return Err(PlanError::BeyondFriction { force, load, limit });
        }
    }
    Ok(())
}

fn march(cycle: Option<CycleMode>, motion: &Motion) -> Result<March, PlanError> {
    let straight = motion.straight().is_some();
    match cycle {
        Some(CycleMode::Stepped) => Ok(March::Stepped),
        Some(mode) if !straight => Err(PlanError::NotStraight { mode: word(mode) }),
        Some(CycleMode::Superposition) => {
            let moving = || motion.channels().filter(|channel| channel.moves());
            let forces = moving().filter(|channel| channel.is_force()).count();
            let turns = motion.rotation.as_ref().is_some_and(Channel::moves);
            if turns || (forces > 0 && forces < moving().count()) {
                return Err(PlanError::NotSuperposed);
            }
            Ok(March::Superposition)
        }
        Some(CycleMode::Reversal) | None if straight => Ok(March::Reversal),
        _ => Ok(March::Stepped),
    }
}

fn word(mode: CycleMode) -> &'static str {
    match mode {
        CycleMode::Superposition => "superposition",
        CycleMode::Reversal => "reversal",
        CycleMode::Stepped => "stepped",
    }
}
