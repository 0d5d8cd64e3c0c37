//! Pressure and gap under the mean load, and the stiffness of the contact.

use super::context::{Context, Keys, gather, is_kept, kept, kept_cells, put};
use super::curves::Curve;
use super::error::NumericsError;
use super::indentation::{Friction, indent};
use super::{RunError, Stage, curves, fretting_cycle};
use crate::contact::normal::{Control, NormalSolution, Rotation};
use crate::contact::stiffness::Direction;
use crate::contact::{Shear, stiffness};
use crate::grid::{ByAxis, Patch};
use crate::model_update::{Approach, Bolt, preload};
use crate::recipe::Coupling;
use crate::store::Draft;
use crate::tables::{TableName, typed};
use crate::wear::FrettingJoint;

/// The static contact of an iteration.
pub struct StaticContact {
    /// Static normal load \[N\].
    pub load: f64,
    pub solution: NormalSolution,
    pub kn: f64,
    pub kt: f64,
    pub fft_pairs: f64,
    /// What friction did while the bodies were pressed together; none where it does not matter.
    pub friction: Option<Friction>,
}

/// A static contact, with the shear traction that the cycle starts from.
pub type WithShear = (StaticContact, ByAxis<Vec<f64>>);

/// A contact near the one to be found: what a wear step predicts.
pub struct Predicted {
    pub gap: Vec<f64>,
    pub pressure: Vec<f64>,
    pub shear: ByAxis<Vec<f64>>,
}

impl Predicted {
    /// As a `contact_field` that is not complete yet.
    pub fn table(&self, patch: &Patch) -> typed::ContactField {
        contact_field(patch, &self.gap, &self.pressure, &self.shear)
    }

    /// From such a table.
    pub fn of(context: &Context, table: &typed::ContactField) -> Predicted {
        let shear = [&table.shear_x, &table.shear_y].into_iter().flatten();
        Predicted {
            gap: context.field(&table.gap),
            pressure: context.field(&table.pressure),
            shear: shear.map(|shear| context.field(shear)).collect(),
        }
    }
}

/// The fields of a contact on the kept cells, without those of its cycle.
pub fn contact_field(
    patch: &Patch,
    gap: &[f64],
    pressure: &[f64],
    shear: &ByAxis<Vec<f64>>,
) -> typed::ContactField {
    let (i, j) = kept_cells(patch);
    let mut shear = shear.iter().map(|shear| gather(patch, shear));
    typed::ContactField {
        i,
        j,
        gap: gather(patch, gap),
        pressure: gather(patch, pressure),
        shear_x: shear.next(),
        shear_y: shear.next(),
        slip_path: None,
        dissipation: None,
    }
}

/// Solves the static contact of the surface of which `wear` is gone, or takes it from the draft. The result holds the
/// predicted shear too, for the cycle to start from.
pub fn static_contact(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    wear: &[f64],
    predicted: Option<Predicted>,
) -> Result<WithShear, RunError> {
    if let Some(done) = resume(context, draft, keys)? {
        return Ok(done);
    }
    let (shear_axes, coupling) = context.shear_and_coupling();
    let curve_due = context.curves_due();
    let start = predicted.as_ref().map(|p| &p.pressure[..]);
    let (bolt, load) = (context.bolt(), context.load);
    let approach = context
        .inputs
        .recipe
        .contact()
        .and_then(|contact| contact.approach);
    let ((load, solution, indented), solve_pairs) =
        context.timed(Stage::StaticContact, |joint| match (coupling, approach) {
            (Coupling::Indented { load_steps }, _) => {
                let found = indent(joint, shear_axes, load, load_steps)?;
                let with_friction = (found.shear, found.friction, found.curve);
                Ok((load, found.solution, Some(with_friction)))
            }
            (_, None) => {
                let (load, solution) = borne(joint, bolt, load, wear, start)?;
                Ok((load, solution, None))
            }
            (_, Some(approach)) => {
                let solution = joint.pressed(wear, None, Control::Approach(approach), start)?;
                Ok((solution.load, solution, None))
            }
        })?;
    let (indented, friction, on_the_way) = match indented {
        Some((shear, friction, curve)) => (Some(shear), Some(friction), Some(curve)),
        None => (None, None, None),
    };
    let ((kn, kt), stiffness_pairs) =
        context.timed_part(Stage::StaticContact, Some("stiffness"), |joint| {
            stiffnesses(joint, &solution.pressure, shear_axes, coupling)
        })?;
    let (curve, curve_pairs) = match (curve_due, on_the_way) {
        (false, _) => (None, 0.0),
        (true, Some(curve)) => (Some(curve), 0.0),
        (true, None) => {
            let (curve, pairs) =
                context.timed_part(Stage::StaticContact, Some("indentation"), |joint| {
                    Ok(curves::indentation(joint, wear, load, &solution)?)
                })?;
            (Some(curve), pairs)
        }
    };
    let fft_pairs = solve_pairs + stiffness_pairs + curve_pairs;
    if let Some(Curve { load, displacement }) = curve {
        let curve = typed::Indentation { load, displacement };
        put(draft, &keys.static_contact, &curve)?;
    }
    context.bear(load);
    let rotation = context.rotation(&solution);
    let row = typed::StaticContact {
        normal_load: load,
        approach: solution.approach,
        rotation_x: rotation.map(|r| r[0]),
        rotation_y: rotation.map(|r| r[1]),
        moment_x: Some(solution.moment[0]),
        moment_y: Some(solution.moment[1]),
        kn,
        kt,
        error: solution.error,
        iterations: solution.iterations as i64,
        fft_pairs,
        tangential_iterations: friction.as_ref().map(|f| f.steps as i64),
        error_tangential: friction.as_ref().map(|f| f.error),
    };
    put(draft, &keys.static_contact, &row)?;
    let predicted = predicted.map(|p| p.shear);
    let shear = indented.or(predicted).unwrap_or_default();
    let fields = Predicted {
        gap: solution.gap.clone(),
        pressure: solution.pressure.clone(),
        shear,
    };
    put(
        draft,
        &keys.static_contact,
        &fields.table(&context.joint.patch),
    )?;
    Ok((
        StaticContact {
            load,
            solution,
            kn,
            kt,
            fft_pairs,
            friction,
        },
        fields.shear,
    ))
}

/// Static load \[N\] and contact of a worn joint, under `load` or what its bolt has left of it, which is looked for from there.
pub fn borne(
    joint: &mut FrettingJoint,
    bolt: Option<Bolt>,
    load: f64,
    wear: &[f64],
    start: Option<&[f64]>,
) -> Result<(f64, NormalSolution), NumericsError> {
    match bolt {
        Some(bolt) => clamped(joint, bolt, load, wear, start),
        None => Ok((load, joint.contact(wear, None, load, start)?)),
    }
}

/// kn and kt \[N/m\]: capped cells count in kt alone; kn is that of bodies that turn where the rotation is free. Those of coupled
/// bodies are at full stick, but for kn without friction.
pub fn stiffnesses(
    joint: &mut FrettingJoint,
    pressure: &[f64],
    shear: Shear,
    coupling: Coupling,
) -> Result<(f64, f64), NumericsError> {
    let limit = joint.pressure_cap.unwrap_or(f64::INFINITY);
    let elastic: Vec<bool> = pressure.iter().map(|&p| p > 0.0 && p < limit).collect();
    let contact: Vec<bool> = pressure.iter().map(|&p| p > 0.0).collect();
    let half_space = &mut joint.half_space;
    let kt = match coupling {
        Coupling::None => stiffness::tangential(half_space, &contact, shear)?,
        _ => stiffness::coupled(half_space, Direction::AlongX, &elastic, &contact, shear)?,
    };
    let kn = match (coupling, joint.rotation) {
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

/// The contact of a worn joint under what its bolt has left of the load.
fn clamped(
    joint: &mut FrettingJoint,
    bolt: Bolt,
    first: f64,
    wear: &[f64],
    start: Option<&[f64]>,
) -> Result<(f64, NormalSolution), NumericsError> {
    let mut last: Option<NormalSolution> = None;
    let found = preload(
        bolt,
        Some(first),
        |load| -> Result<Approach, NumericsError> {
            let from = last.as_ref().map(|l| &l.pressure[..]).or(start);
            let solution = joint.contact(wear, None, load, from)?;
            let cap = joint.pressure_cap.unwrap_or(f64::INFINITY);
            let elastic: Vec<bool> = solution
                .pressure
                .iter()
                .map(|&p| p > 0.0 && p < cap)
                .collect();
            let kn = stiffness::normal(&mut joint.half_space, &elastic)?;
            let approach = Approach {
                approach: solution.approach,
                kn: kn.total,
            };
            last = Some(solution);
            Ok(approach)
        },
    )?;
    let solution = match last {
        Some(solution) => solution,
        None => joint.contact(wear, None, found.load, start)?,
    };
    Ok((found.load, solution))
}

/// The static contact as an earlier start left it, if all of it is there; with the shear for the cycle to start from.
pub fn resume(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
) -> Result<Option<WithShear>, RunError> {
    let mut fields = kept::<typed::ContactField>(draft, &keys.static_contact)?;
    // The cycle replaces the fields by its own, with the same gap and pressure, but another shear than the one that it started
    // from: they serve only where it will not be computed again.
    if fields.is_none() && fretting_cycle::is_complete(context, draft, keys)? {
        fields = kept(draft, &keys.fretting_cycle)?;
    }
    let row = kept::<typed::StaticContact>(draft, &keys.static_contact)?;
    let curve_done =
        !context.curves_due() || is_kept(draft, TableName::Indentation, &keys.static_contact)?;
    let (Some(fields), Some(row), true) = (fields, row, curve_done) else {
        return Ok(None);
    };
    let Predicted {
        gap,
        pressure,
        shear,
    } = Predicted::of(context, &fields);
    let load = row.normal_load;
    context.bear(load);
    let or_zero = |pair: [Option<f64>; 2]| pair.map(|value| value.unwrap_or(0.0));
    let contact = StaticContact {
        load,
        solution: NormalSolution {
            pressure,
            gap,
            approach: row.approach,
            iterations: row.iterations as usize,
            rotation: or_zero([row.rotation_x, row.rotation_y]),
            load,
            moment: or_zero([row.moment_x, row.moment_y]),
            error: row.error,
        },
        kn: row.kn,
        kt: row.kt,
        fft_pairs: row.fft_pairs,
        friction: row
            .tangential_iterations
            .zip(row.error_tangential)
            .map(|(steps, error)| Friction {
                steps: steps as usize,
                error,
            }),
    };
    Ok(Some((contact, shear)))
}
