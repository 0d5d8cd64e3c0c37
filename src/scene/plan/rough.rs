//! Planning of the rough contact.

use super::PlanError;
use crate::contact::normal::Rotation;
use crate::contact::{Coupling, HalfSpace, Shear, stiffness};
use crate::fft::fast_length;
use crate::grid::{Grid, Patch};
use crate::model_update::BoltedJoint;
use crate::recipe::{self, CycleError, MotionSource, Reasons, why_computed};
use crate::scene::keys::contact::{APPROACH, MOMENT, PRESSING, ROTATION};
use crate::scene::{
    Boundary, Contact, Motion as SceneMotion, Pressing, RoughJoint, Scene, Transverse,
};
use crate::structure::reduction::ContactPorts;
use crate::structure::resonator::{BOLT_ABOVE, BOLT_BELOW};
use crate::wear::cycle::March;
use crate::wear::{Channel, Motion};

/// Points of the plane on which the fields of a scene are transformed.
pub(super) fn plane(grid: Grid, boundary: Boundary) -> [usize; 2] {
    match boundary {
        Boundary::Free => [fast_length(2 * grid.nx - 1), fast_length(2 * grid.ny - 1)],
        Boundary::Periodic => [grid.nx, grid.ny],
    }
}

/// Decides the parts of a recipe that belong to a rough joint: cells and heights, contact, and cycle. `motion` is the
/// motion of `[motion]`. `contents` are the hashes of the surface and motion files.
pub(super) fn decide(
    scene: &Scene,
    rough: &RoughJoint,
    motion: &Motion,
    contents: &Contents,
) -> Result<(recipe::Surface, recipe::Contact, Option<recipe::Cycle>), PlanError> {
    let patch = rough.patch();
    check(scene, rough, &patch, motion)?;
    let surface = surface(rough, &patch, contact_ports(scene), contents);
    let mut contact = contact(scene, rough)?;
    if let Some(bolt) = rough.contact.bolt {
        let compliance = bolt_compliance(bolt, &contact, &patch)?;
        contact.conditions.bolt_stiffness = Some(compliance.stiffness());
        contact.bolt_compliance = Some(compliance);
    }
    let cycle = cycle(scene, motion, contents)?;
    if let (Some(fields), Some(cycle)) = (&scene.recipe.output.cycle_fields, &cycle) {
        check_cycle_fields(fields, rough.grid, cycle, motion)?;
    }
    if cycle.is_none() {
        contact.why.add("cycle", "no [motion]: static contact");
    }
    Ok((surface, contact, cycle))
}

/// Hashes of the files that a scene names, if they were read.
#[derive(Debug, Clone, Default)]
pub struct Contents {
    /// Hash of the surface file.
    pub surface: Option<String>,
    /// Hash of the motion history, and whether every other sample is a midpoint between samples of the file.
    pub history: Option<(String, bool)>,
}

/// Kind of the contact elements. Contact elements with individual friction laws are pairs of nodes, and the cells
/// between the nodes move with the finite-element mesh.
fn contact_ports(scene: &Scene) -> ContactPorts {
    let structure = scene.recipe.structure.as_ref();
    structure.map_or(ContactPorts::Faces, |structure| structure.contact_ports)
}

/// Returns the compliances of a bolt and of its clamped parts, without the contact.
fn bolt_compliance(
    bolt: BoltedJoint,
    contact: &recipe::Contact,
    patch: &Patch,
) -> Result<recipe::BoltCompliance, PlanError> {
    let wrong = |reason: String| PlanError::Bolt { reason };
    let (lower, upper) = (contact.bodies.lower, contact.bodies.upper);
    if lower.youngs_modulus != upper.youngs_modulus {
        return Err(wrong(
            "its clamped parts must have one modulus, but [material] has two; give contact.bolt_stiffness instead".to_owned(),
        ));
    }
    if contact.conditions.approach.is_some() {
        return Err(wrong(
            "contact.approach prescribes the position of the bodies, so a bolt has no effect; give contact.normal_load"
                .to_owned(),
        ));
    }
    let bolt = BoltedJoint {
        plate_modulus: lower.youngs_modulus,
        ..bolt
    };
    let plates = bolt.plates().map_err(|error| wrong(error.to_string()))?;
    let bolt_alone = bolt.bolt();
    if contact.pressing.is_some() {
        // The structure itself represents the compliance under the bolt.
        return Ok(recipe::BoltCompliance {
            bolt: bolt_alone,
            plates,
            patch: None,
        });
    }
    if contact.conditions.boundary == Boundary::Periodic {
        return Err(wrong("with contact.boundary = \"periodic\" the joint has no edge, so no parts can be clamped; use \"free\"".to_owned()));
    }
    let mut half_space = HalfSpace::new(patch.grid, contact.bodies, Boundary::Free);
    let stiffnesses = stiffness::normal(&mut half_space, &patch.is_in_joint);
    let patch = 1.0 / stiffnesses.map_err(|error| wrong(error.to_string()))?.total;
    let compliance = recipe::BoltCompliance {
        bolt: bolt_alone,
        plates,
        patch: Some(patch),
    };
    if compliance.stiffness() > 0.0 && compliance.stiffness().is_finite() {
        return Ok(compliance);
    }
    Err(wrong(format!(
        "bolt and clamped parts have a compliance of {:.3e} m/N together, but the half spaces under the joint alone have {patch:.3e} m/N: the parts are too short for half spaces; give contact.bolt_stiffness instead",
        bolt_alone + plates
    )))
}

/// Returns the mesh at the joint, if the contact elements at its nodes have laws of their own.
fn structure_mesh(scene: &Scene, rough: &RoughJoint) -> Option<recipe::StructureMesh> {
    let structure = rough
        .structure
        .filter(|_| !contact_ports(scene).are_faces())?;
    let array = structure.contact_array()?;
    Some(recipe::StructureMesh {
        counts: array.counts,
        sides: array.sides(),
        layers: structure.layers(),
        formulation: structure.formulation(),
    })
}

/// Decides whether the bodies are pressed by the structure or as punches, and returns the reason.
fn pressing(
    scene: &Scene,
    rough: &RoughJoint,
) -> Result<(Option<recipe::StructurePressing>, &'static str), PlanError> {
    let Some(structure) = rough.structure else {
        return Ok((None, "no [structure]"));
    };
    let given_pressing = scene.given_value(PRESSING.name);
    let preload = rough.contact.preload.as_ref();
    if rough.contact.pressed_by == Pressing::Punch {
        if preload.is_some() {
            return Err(PlanError::PreloadOfPunch {
                reason: "contact.pressing is \"punch\"",
            });
        }
        return Ok((
            None,
            "contact.pressing = \"punch\", or fidelity.preset = \"paper\"",
        ));
    }
    let joint = structure.import().and_then(|import| import.joint.as_ref());
    let hinders = if contact_ports(scene).are_faces() {
        Some(
            "contact.stiffness is not \"sliders\", so that contact elements are faces and no pairs of nodes",
        )
    } else if joint.is_some_and(|joint| !joint.is_regular) {
        Some(
            "the nodes of the joint are not the corners of equal rectangles, so that what their mesh has of half spaces is not known",
        )
    } else {
        None
    };
    if let Some(reason) = hinders {
        return match given_pressing {
            Some(_) => Err(PlanError::StructureCannotPress { reason }),
            None if preload.is_some() => Err(PlanError::PreloadOfPunch { reason }),
            None => Ok((None, reason)),
        };
    }
    let determined_keys = [ROTATION.name, MOMENT.name, APPROACH.name];
    if let Some(key) = determined_keys
        .into_iter()
        .find(|key| scene.given_value(key).is_some())
    {
        return Err(PlanError::DeterminedByStructure { key });
    }
    let is_bolt_outside = preload.is_some_and(|preload| !preload.in_mesh);
    let has_bolt = rough.conditions.bolt_stiffness.is_some() || rough.contact.bolt.is_some();
    if has_bolt && !is_bolt_outside {
        return Err(PlanError::BoltOfStructure);
    }
    let ends = structure.import().and_then(|import| import.preload.clone());
    let preload = match structure.resonator() {
        None if let (Some(preload), Some(ends)) = (preload, ends) => recipe::Preload::Bolt {
            points: ends.points,
            direction: ends.direction,
            in_mesh: preload.in_mesh,
        },
        Some(_) => recipe::Preload::Bolt {
            points: [BOLT_ABOVE, BOLT_BELOW].map(str::to_owned),
            direction: [0.0, 0.0, -1.0],
            in_mesh: true,
        },
        None => recipe::Preload::Faces,
    };
    let loads = scene.recipe.response.iter().flat_map(|of| &of.forces);
    let loads = loads.filter(|force| force.harmonic == 0).cloned().collect();
    let why = "the structure bends as its loads press the joint";
    Ok((Some(recipe::StructurePressing { preload, loads }), why))
}

fn surface(
    rough: &RoughJoint,
    patch: &Patch,
    ports: ContactPorts,
    contents: &Contents,
) -> recipe::Surface {
    let mut why = Reasons::default();
    why.add(
        "cells",
        if rough.structure.is_some() {
            "the cells whose centre lies in a contact element of the structure"
        } else if patch.cells() < patch.grid.len() {
            "cells in the hole and unmeasured ones carry nothing"
        } else {
            "no hole"
        },
    );
    let array = rough
        .structure
        .and_then(|structure| structure.contact_array());
    let cells = match (array, rough.joint.hole) {
        (Some(array), _) => recipe::Cells::Elements {
            counts: array.counts,
            absent: array.absent,
            ports,
        },
        (None, Some(diameter)) => recipe::Cells::Hole { diameter },
        (None, None) => recipe::Cells::All,
    };
    recipe::Surface {
        size: rough.joint.size,
        grid: [rough.grid.nx, rough.grid.ny],
        cells,
        kept: patch.cells(),
        heights: rough.surface.clone(),
        content: contents.surface.clone(),
        why,
    }
}

fn contact(scene: &Scene, rough: &RoughJoint) -> Result<recipe::Contact, PlanError> {
    let (contact, conditions) = (rough.contact, *rough.conditions);
    let (coupling, of_coupling) = coupling(scene, rough)?;
    let mut why = Reasons::default();
    why.add(
        "boundary",
        match conditions.boundary {
            Boundary::Free => {
                "contact.boundary = \"free\": fields are padded with zeros to twice their length"
            }
            Boundary::Periodic => {
                "contact.boundary = \"periodic\": fields are transformed as they are"
            }
        },
    );
    why.add(
        "pressure_cap",
        match conditions.pressure_cap {
            Some(_) => "contact.pressure_cap is given",
            None => "no contact.pressure_cap: elastic",
        },
    );
    why.add("coupling", of_coupling);
    let (pressing, of_pressing) = pressing(scene, rough)?;
    if rough.structure.is_some() {
        why.add("pressing", of_pressing);
    }
    why.add(
        "shear",
        match contact.transverse {
            Transverse::Absent => "contact.transverse = \"absent\": no field q_y, no kernels yy and xy",
            Transverse::Fixed => "contact.transverse = \"fixed\": with Poisson's ratio a motion along x causes shear along y too",
            Transverse::Free => "contact.transverse = \"free\": the mean displacement along y is found and reported; kt is with it held",
        },
    );
    let of_rotation = match (conditions.rotation, scene.given_value(MOMENT.name)) {
        _ if pressing.is_some() => "the structure holds the bodies, or leaves them free",
        (Rotation::Given(_), _) => "contact.rotation = \"fixed\"",
        (Rotation::Free { .. }, None) => {
            "contact.rotation = \"free\"; kn is that of bodies that turn"
        }
        (Rotation::Free { .. }, Some(_)) => {
            "contact.rotation = \"free\" with contact.moment; kn is that of bodies that turn"
        }
    };
    why.add("rotation", of_rotation);
    if contact.friction_coefficient == Some(0.0) {
        why.add(
            "friction_coefficient",
            "contact.friction_coefficient = 0: no shear, nothing is dissipated and nothing wears",
        );
    }
    // The stiffness is needed to build the contact elements and to compare with them.
    let stiffness = scene.recipe.output.stiffness || scene.recipe.structure.is_some();
    if !stiffness {
        why.add("stiffness", "output.stiffness = false");
    }
    Ok(recipe::Contact {
        bodies: rough.material.elastic,
        bolt_compliance: None,
        conditions,
        stiffness,
        plane: plane(rough.grid, conditions.boundary),
        friction_coefficient: contact.friction_coefficient,
        structure_mesh: structure_mesh(scene, rough),
        pressing,
        shear: match contact.transverse {
            Transverse::Absent => Shear::AlongX,
            Transverse::Fixed | Transverse::Free => Shear::InPlane,
        },
        transverse_free: contact.transverse == Transverse::Free,
        coupling,
        tolerances: scene.fidelity.tolerances,
        why,
    })
}

/// Decides how elastically different bodies are treated, and returns the reason. Rejects cycles and wear of elastically
/// different bodies. The cycle and the wear step assume constant pressure, but the pressure between elastically
/// different bodies changes with the shear.
fn coupling(scene: &Scene, rough: &RoughJoint) -> Result<(Coupling, String), PlanError> {
    let pair = rough.material.elastic;
    if !pair.is_coupled() {
        let why = "the bodies are elastically alike (Dundurs' beta = 0): pressure causes no slip";
        return Ok((Coupling::None, why.to_owned()));
    }
    let beta = pair.dundurs_beta();
    if scene.motion.is_some() || scene.recipe.response.is_some() {
        return Err(PlanError::Dissimilar { beta });
    }
    let contact = rough.contact;
    if contact.friction_coefficient.unwrap_or(0.0) == 0.0 {
        let why = format!(
            "Dundurs' beta = {beta:.4}, and no contact.friction_coefficient: without shear the pressure is that of alike bodies of the same E*"
        );
        return Ok((Coupling::Frictionless, why));
    }
    let unsupported = [
        (
            rough.conditions.approach.is_some(),
            "contact.approach",
            "given",
            "contact.normal_load",
        ),
        (
            scene.given_value(MOMENT.name).is_some(),
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
    match unsupported.into_iter().find(|(given, ..)| *given) {
        Some((_, key, value, instead)) => Err(PlanError::IndentedWithout {
            key,
            value,
            instead,
            beta,
        }),
        None => {
            let load_steps = scene.fidelity.load_steps;
            let why = format!(
                "Dundurs' beta = {beta:.4}: pressing the bodies together makes them slip; kn and kt are of full stick"
            );
            Ok((Coupling::Indented { load_steps }, why))
        }
    }
}

fn cycle(
    scene: &Scene,
    motion: &Motion,
    contents: &Contents,
) -> Result<Option<recipe::Cycle>, PlanError> {
    let fidelity = &scene.fidelity;
    let mut why = Reasons::default();
    let (motion, march, asked) = if scene.recipe.response.is_some() {
        let asked = fidelity.cycle;
        if asked == Some(March::Superposition) && !contact_ports(scene).are_faces() {
            return Err(PlanError::SuperposedElements);
        }
        why.add("march", why_computed(asked));
        (MotionSource::Computed, None, asked)
    } else {
        let source = match (&scene.motion, &contents.history) {
            (None, _) => return Ok(None),
            (Some(SceneMotion::Harmonic(motion)), _) => MotionSource::Harmonic(motion.clone()),
            (Some(SceneMotion::History { .. }), history) => {
                let (content, halved) = history.clone().unwrap_or_default();
                MotionSource::History {
                    content,
                    samples: motion.samples(),
                    halved,
                }
            }
        };
        let march = march(fidelity.cycle, motion)?;
        why.add(
            "march",
            match (march, fidelity.cycle) {
                (March::Reversal, _) => "straight motion about zero under constant load: the steady cycle is antisymmetric",
                (March::Superposition, _) => "fidelity.cycle asks for it",
                (March::Stepped, Some(_)) => "fidelity.cycle or the preset asks for it",
                (March::Stepped, None) => "the load varies, or the motion is not straight about zero",
            },
        );
        (source, Some(march), None)
    };
    Ok(Some(recipe::Cycle {
        motion,
        march,
        asked,
        steps: fidelity.steps_per_cycle,
        extrapolate: fidelity.cycle_extrapolation,
        why,
    }))
}

/// Returns the motion of a scene. If the scene has no harmonic motion, the returned motion is at rest under a constant
/// load.
pub(super) fn motion_of(scene: &Scene, contact: &Contact) -> Motion {
    let load = contact.normal_load();
    match &scene.motion {
        Some(SceneMotion::Harmonic(motion)) => motion.sampled(load, scene.fidelity.steps_per_cycle),
        _ => Motion::at_rest(load),
    }
}

fn check(
    scene: &Scene,
    rough: &RoughJoint,
    patch: &Patch,
    motion: &Motion,
) -> Result<(), PlanError> {
    if structure_mesh(scene, rough).is_some_and(|mesh| mesh.layers.is_empty()) {
        return Err(PlanError::NoLayer);
    }
    if let Some(Err(source)) = rough.elements() {
        return Err(PlanError::Elements(source));
    }
    if patch.cells() == 0 {
        return Err(PlanError::NoCells {
            cells: patch.grid.len(),
        });
    }
    check_waves(rough)?;
    let loads = &motion.normal_load;
    check_pressure(rough, patch, loads)?;
    let least = loads.iter().copied().fold(f64::INFINITY, f64::min);
    if least <= 0.0 && scene.motion.is_some() {
        return Err(CycleError::LiftsOff { load: least }.into());
    }
    check_moment(rough, patch, least.min(rough.conditions.normal_load))?;
    if let Some(friction) = rough.contact.friction_coefficient {
        check_force(motion, friction)?;
        check_torsion(motion, patch, friction)?;
    }
    if let Some(cap) = rough.conditions.pressure_cap {
        let area = patch.area();
        let load = loads
            .iter()
            .copied()
            .fold(rough.conditions.normal_load, f64::max);
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

/// Rejects output of samples outside the cycle and of cells outside the grid.
fn check_cycle_fields(
    fields: &recipe::CycleFields,
    grid: Grid,
    cycle: &recipe::Cycle,
    motion: &Motion,
) -> Result<(), PlanError> {
    let axes = ["i", "j"].into_iter().zip([grid.nx, grid.ny]);
    for (range, (key, cells)) in fields.cells.iter().zip(axes) {
        if let Some(range) = range.filter(|range| range[1] >= cells as u64) {
            let last = cells - 1;
            return Err(PlanError::NoSuchCells { key, range, last });
        }
    }
    let Some(&sample) = fields.samples.as_ref().and_then(|samples| samples.last()) else {
        return Ok(());
    };
    let Some(instants) = cycle.instants(motion) else {
        return Err(PlanError::SamplesNotKnown);
    };
    if sample >= instants as u64 {
        let march = cycle.march.or(cycle.asked);
        return Err(PlanError::NoSuchSample {
            sample,
            last: instants - 1,
            instead: match march {
                Some(March::Stepped) => {
                    "the last is t = T; give fewer, or raise fidelity.steps_per_cycle"
                }
                _ => {
                    "a cycle by reversal has its ends alone; give these, or fidelity.cycle = \"stepped\" for those between"
                }
            },
        });
    }
    Ok(())
}

/// Rejects a surface whose waves the grid cannot represent.
fn check_waves(rough: &RoughJoint) -> Result<(), PlanError> {
    let (key, lengths) = match rough.surface.correlation_length() {
        Some(lengths) => ("surface.correlation_length", lengths.to_vec()),
        None => {
            let rolloff = rough.surface.rolloff_wavelength();
            ("surface.rolloff_wavelength", rolloff.into_iter().collect())
        }
    };
    let checked = rough.surface.check_on(&rough.grid);
    checked.map_err(|source| PlanError::Surface {
        key,
        lengths,
        source,
    })
}

/// Largest mean pressure over the contact modulus. Contact solves converge up to about ten. Beyond that, a warning
/// points to a mistaken unit.
const MOST_STRAIN: f64 = 1e3;

/// Rejects a load that no solid can bear.
fn check_pressure(rough: &RoughJoint, patch: &Patch, loads: &[f64]) -> Result<(), PlanError> {
    let largest = loads
        .iter()
        .copied()
        .fold(rough.conditions.normal_load, f64::max);
    let area = patch.area();
    let modulus = rough.material.elastic.effective_modulus();
    if largest / area > MOST_STRAIN * modulus {
        return Err(PlanError::Overloaded {
            load: largest,
            pressure: largest / area,
            area,
            modulus,
        });
    }
    Ok(())
}

/// Checks that the resultant of the pressure can lie within the joint. Pressures only push, whatever the moments.
fn check_moment(rough: &RoughJoint, patch: &Patch, load: f64) -> Result<(), PlanError> {
    // With a given approach the load is not known yet.
    let conditions = rough.conditions;
    let (Rotation::Free { moment }, None) = (conditions.rotation, conditions.approach) else {
        return Ok(());
    };
    if moment == [0.0; 2] {
        return Ok(());
    }
    let [about_x, about_y] = moment;
    let reach = centres(patch).fold([0.0f64; 2], |[x, y], centre| {
        [x.max(centre.0.abs()), y.max(centre.1.abs())]
    });
    let arm = [-about_y / load, about_x / load];
    match arm.iter().zip(reach).all(|(arm, reach)| arm.abs() < reach) {
        true => Ok(()),
        false => Err(PlanError::MomentNotCarried {
            moment: [about_x, about_y],
            load,
            arm: arm.map(|arm| 1e3 * arm),
            reach: reach.map(|reach| 1e3 * reach),
        }),
    }
}

/// Checks that tangential forces stay below the friction limit at every instant.
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

/// Checks that a moment about z stays below the friction limit at every instant. The friction limit assumes that the
/// outermost cell bears the whole load.
fn check_torsion(
    motion: &Motion,
    patch: &Patch,
    friction_coefficient: f64,
) -> Result<(), PlanError> {
    let moment_channel = motion.rotation.as_ref().filter(|turn| turn.is_force());
    let Some(moments) = moment_channel.map(Channel::values) else {
        return Ok(());
    };
    let reach = centres(patch).fold(0.0, |reach: f64, (x, y)| reach.max(x.hypot(y)));
    for (&moment, &load) in moments.iter().zip(&motion.normal_load) {
        let limit = friction_coefficient * load * reach;
        if moment.abs() >= limit && moment != 0.0 {
            return Err(PlanError::BeyondFrictionMoment {
                moment: moment.abs(),
                load,
                reach: 1e3 * reach,
                limit,
            });
        }
    }
    Ok(())
}

/// Centres of the cells of a joint \[m\].
fn centres(patch: &Patch) -> impl Iterator<Item = (f64, f64)> {
    let grid = patch.grid;
    let kept = (0..grid.len()).filter(|&cell| patch.is_in_joint[cell]);
    kept.map(move |cell| {
        let (i, j) = grid.cell(cell);
        grid.centre(i, j)
    })
}

fn march(cycle: Option<March>, motion: &Motion) -> Result<March, PlanError> {
    let straight = motion.straight().is_some();
    match cycle {
        Some(March::Stepped) => Ok(March::Stepped),
        Some(mode) if !straight => Err(CycleError::NotStraight { mode: mode.word() }.into()),
        Some(March::Superposition) => {
            let moving = || motion.channels().filter(|channel| channel.moves());
            let forces = moving().filter(|channel| channel.is_force()).count();
            let turns = motion.rotation.as_ref().is_some_and(Channel::moves);
            if turns || (forces > 0 && forces < moving().count()) {
                return Err(PlanError::NotSuperposed);
            }
            Ok(March::Superposition)
        }
        Some(March::Reversal) | None if straight => Ok(March::Reversal),
        _ => Ok(March::Stepped),
    }
}
