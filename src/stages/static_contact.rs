//! Pressure and gap under the mean load, and the stiffness of the contact.

use super::RunError;
use super::contact_state::{Fields, contact_of, wear_of};
use super::declaration::{Declaration, joined};
use super::error::NumericsError;
use super::reduced;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::contact::normal::{Control, NormalSolution, Rotation};
use crate::contact::stiffness;
use crate::model_update::{Bolt, BoltContact, preload};
use crate::recipe::Part;
use crate::tables::{TableName, typed};
use crate::wear::FrettingJoint;
use crate::wear::curves::{self, Curve};
use crate::wear::indentation::{Friction, indent};

/// The static contact of the worn surface, [A eq. 2.3–2.4], starting from the pressure that a wear step predicts. The
/// fields of the static contact include the predicted shear, from which the computation of the cycle starts.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::StaticContact,
    when: When::Always,
    recipe: &[Part::Surface, Part::Contact, Part::Cycle, Part::Curves],
    reads: &joined::<9>(&[
        &reduced::TABLES,
        &[
            TableName::Surface,
            TableName::Reference,
            TableName::WearField,
            TableName::ContactField,
        ],
    ]),
    before: &[TableName::StaticContact],
    writes: &[
        TableName::StaticContact,
        TableName::ContactField,
        TableName::Indentation,
    ],
    is_due: |_| true,
    shared: false,
    compute,
};

/// A contact solution with the friction and shear of its load steps.
struct PressedContact {
    load: f64,
    solution: NormalSolution,
    friction: Option<Friction>,
    shear: Option<crate::grid::ByAxis<Vec<f64>>>,
    curve: Option<Curve>,
}

impl PressedContact {
    fn without_friction(load: f64, solution: NormalSolution) -> PressedContact {
        PressedContact {
            load,
            solution,
            friction: None,
            shear: None,
            curve: None,
        }
    }
}

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let contact = contact_of(&reads.recipe);
    let (shear, coupling) = (contact.shear, contact.coupling);
    let patch = solvers.joint(reads)?.patch.clone();
    let wear = wear_of(&patch, reads.optional_table()?);
    let predicted = reads.optional_table::<typed::ContactField>()?;
    let predicted = predicted.map(|table| Fields::of(&patch, &table));
    let start = predicted.as_ref().map(|fields| &fields.pressure[..]);
    let bolt = bolt(reads)?;
    let load = load(reads)?;
    let preload = match contact.pressing {
        Some(_) => reads.table::<typed::Reference>()?.preload,
        None => None,
    };
    solvers.pressed_joint(reads, preload.unwrap_or(0.0))?;
    let (pressed_contact, solve_pairs) = solvers.timed(reads, None, |joint| {
        match (coupling.load_steps(), contact.conditions.approach) {
            (Some(load_steps), _) => {
                let indentation = indent(joint, shear, load, load_steps)?;
                Ok(PressedContact {
                    load,
                    solution: indentation.solution,
                    friction: Some(indentation.friction),
                    shear: Some(indentation.shear),
                    curve: Some(indentation.curve),
                })
            }
            (None, None) => {
                let (load, solution) = contact_under_load(joint, bolt, load, &wear, start)?;
                Ok(PressedContact::without_friction(load, solution))
            }
            (None, Some(approach)) => {
                let solution =
                    joint.solve_normal_contact(&wear, None, Control::Approach(approach), start)?;
                Ok(PressedContact::without_friction(solution.load, solution))
            }
        }
    })?;
    let PressedContact {
        load,
        solution,
        friction,
        ..
    } = pressed_contact;
    let (stiffness, stiffness_pairs) = match contact.stiffness {
        false => (None, 0.0),
        true => {
            let (stiffness, pairs) = solvers.timed(reads, Some("stiffness"), |joint| {
                Ok(joint.stiffness(&solution.pressure, shear, coupling)?)
            })?;
            (Some(stiffness), pairs)
        }
    };
    let (curve, curve_pairs) = match (reads.curves_due, pressed_contact.curve) {
        (false, _) => (None, 0.0),
        (true, Some(curve)) => (Some(curve), 0.0),
        (true, None) => {
            let (curve, pairs) = solvers.timed(reads, Some("indentation"), |joint| {
                Ok(curves::indentation(joint, &wear, load, &solution)?)
            })?;
            (Some(curve), pairs)
        }
    };
    let mut outputs = Outputs::default();
    if let Some(Curve { load, displacement }) = curve {
        outputs.add_table(&typed::Indentation { load, displacement })?;
    }
    let turns = matches!(contact.conditions.rotation, Rotation::Free { .. });
    let rotation = turns.then_some(solution.rotation);
    let joint = solvers.joint(reads)?;
    let compliance = joint.half_space.self_compliance();
    let undecided = solution.undecided_count(&patch, compliance, joint.options.normal.tolerance);
    outputs.add_table(&typed::StaticContact {
        normal_load: load,
        preload: joint.pressing.as_ref().map(|pressing| pressing.preload),
        approach: solution.approach,
        rotation_x: rotation.map(|r| r[0]),
        rotation_y: rotation.map(|r| r[1]),
        moment_x: solution.moment[0],
        moment_y: solution.moment[1],
        kn: stiffness.map(|(kn, _)| kn),
        kt: stiffness.map(|(_, kt)| kt),
        error: solution.error,
        iterations: solution.iterations as i64,
        fft_pairs: solve_pairs + stiffness_pairs + curve_pairs,
        tangential_iterations: friction.as_ref().map(|f| f.steps as i64),
        error_tangential: friction.as_ref().map(|f| f.error),
        undecided_cells: undecided as i64,
    })?;
    let predicted = predicted.map(|fields| fields.shear);
    if reads.wear_iteration == 0 {
        let peak = solution.pressure.iter().copied().fold(0.0, f64::max);
        if let Some(remark) = contact.peak_pressure_note(peak) {
            outputs.notice(remark);
        }
    }
    let fields = Fields {
        gap: solution.gap,
        pressure: solution.pressure,
        shear: pressed_contact.shear.or(predicted).unwrap_or_default(),
    };
    outputs.add_table(&fields.table(&patch))?;
    Ok(outputs)
}

/// Returns the bolt that clamps the joint, if the load decreases with wear.
fn bolt(reads: &StageInputs) -> Result<Option<Bolt>, RunError> {
    let contact = contact_of(&reads.recipe);
    let Some(stiffness) = contact.conditions.bolt_stiffness else {
        return Ok(None);
    };
    let reference: typed::Reference = reads.table()?;
    Ok(Some(Bolt {
        stiffness,
        load: contact.conditions.normal_load,
        approach: reference.shortening.unwrap_or(reference.approach),
    }))
}

/// Returns the static load \[N\]: the start of the search for a bolt's load, otherwise the load of the joint.
fn load(reads: &StageInputs) -> Result<f64, RunError> {
    let conditions = contact_of(&reads.recipe).conditions;
    let before = match conditions.bolt_stiffness {
        Some(_) => reads.optional_previous_table::<typed::StaticContact>()?,
        None => None,
    };
    let load_before = before.map(|row| row.preload.unwrap_or(row.normal_load));
    Ok(load_before.unwrap_or(conditions.normal_load))
}

/// Returns the static load \[N\] and the contact of a worn joint. The load is `load`, or the remaining load of the
/// bolt, searched from `load`.
fn contact_under_load(
    joint: &mut FrettingJoint,
    bolt: Option<Bolt>,
    load: f64,
    wear: &[f64],
    start: Option<&[f64]>,
) -> Result<(f64, NormalSolution), NumericsError> {
    match bolt {
        Some(bolt) if joint.pressing.is_some() => {
            contact_under_outer_bolt(joint, bolt, load, wear, start)
        }
        Some(bolt) => contact_under_bolt(joint, bolt, load, wear, start),
        None if joint.pressing.is_some() => {
            let solution = joint.contact(wear, None, load, start)?;
            Ok((solution.load, solution))
        }
        None => Ok((load, joint.contact(wear, None, load, start)?)),
    }
}

/// Returns the load \[N\] that the pressure carries and the contact of a worn joint. A bolt outside of the reduced
/// structure presses it with its remaining force.
fn contact_under_outer_bolt(
    joint: &mut FrettingJoint,
    bolt: Bolt,
    first: f64,
    wear: &[f64],
    start: Option<&[f64]>,
) -> Result<(f64, NormalSolution), NumericsError> {
    let mut last: Option<NormalSolution> = None;
    preload(
        bolt,
        Some(first),
        |force| -> Result<BoltContact, NumericsError> {
            if force == 0.0 {
                // Without a force nothing bends: the faces touch at their highest point.
                let worn = joint.height.iter().zip(wear).zip(&joint.patch.is_in_joint);
                let heights = worn
                    .filter(|(_, is_kept)| **is_kept)
                    .map(|((h, w), _)| h - w);
                let approach = -heights.fold(f64::NEG_INFINITY, f64::max);
                return Ok(BoltContact { approach, kn: 0.0 });
            }
            joint
                .pressing
                .iter_mut()
                .for_each(|pressing| pressing.preload = force);
            let initial_pressure = last.as_ref().map(|l| &l.pressure[..]).or(start);
            last = Some(joint.contact(wear, None, force, initial_pressure)?);
            let approach = joint
                .pressing
                .as_ref()
                .map_or(0.0, |pressing| pressing.shortening);
            let kn = (force / approach).max(0.0);
            Ok(BoltContact { approach, kn })
        },
    )?;
    let solution = last.expect("a bolt that is not loose presses");
    Ok((solution.load, solution))
}

/// Returns the remaining load of the bolt \[N\] and the contact of a worn joint under the remaining load.
fn contact_under_bolt(
    joint: &mut FrettingJoint,
    bolt: Bolt,
    first: f64,
    wear: &[f64],
    start: Option<&[f64]>,
) -> Result<(f64, NormalSolution), NumericsError> {
    let mut last: Option<NormalSolution> = None;
    let equilibrium = preload(
        bolt,
        Some(first),
        |load| -> Result<BoltContact, NumericsError> {
            let initial_pressure = last.as_ref().map(|l| &l.pressure[..]).or(start);
            let solution = joint.contact(wear, None, load, initial_pressure)?;
            let elastic = stiffness::elastic_cells(&solution.pressure, joint.pressure_cap);
            let normal = |half_space: &mut _| stiffness::normal(half_space, &elastic);
            let kn = joint.half_space.without_nodal(normal)?;
            let bolt_contact = BoltContact {
                approach: solution.approach,
                kn: kn.total,
            };
            last = Some(solution);
            Ok(bolt_contact)
        },
    )?;
    let solution = match last {
        Some(solution) => solution,
        None => joint.contact(wear, None, equilibrium.load, start)?,
    };
    Ok((equilibrium.load, solution))
}
