//! Pressure and gap under the mean load, and the stiffness of the contact.

use super::context::{Context, Keys, gather, kept, kept_cells};
use super::error::NumericsError;
use super::indentation::{Friction, indent};
use super::{RunError, Stage, curves, fretting_cycle};
use crate::contact::normal::{Control, NormalSolution, Rotation};
use crate::contact::stiffness::Direction;
use crate::contact::{Shear, stiffness};
use crate::grid::ByAxis;
use crate::model_update::{Approach, Bolt, preload};
use crate::scene::plan::Coupling;
use crate::store::Draft;
use crate::tables::{Table, TableBuilder, TableError, TableName};
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

/// The names of the shear columns, by axis.
pub const SHEAR: [&str; 2] = ["shear_x", "shear_y"];

impl Predicted {
    /// As a `contact_field` that is not complete yet.
    pub fn table(&self, context: &Context) -> Result<Table, TableError> {
        self.columns(context).build()
    }

    fn columns(&self, context: &Context) -> TableBuilder {
        let patch = &context.joint.patch;
        let (i, j) = kept_cells(patch);
        let mut table = Table::builder(TableName::ContactField)
            .column("i", i)
            .column("j", j)
            .column("gap", gather(patch, &self.gap))
            .column("pressure", gather(patch, &self.pressure));
        for (name, shear) in SHEAR.iter().zip(&self.shear) {
            table = table.column(name, gather(patch, shear));
        }
        table
    }

    /// From such a table.
    pub fn of(context: &Context, table: &Table) -> Result<Predicted, RunError> {
        let shear = SHEAR
            .iter()
            .filter(|name| table.has(name))
            .map(|name| context.field(table, name));
        Ok(Predicted {
            gap: context.field(table, "gap")?,
            pressure: context.field(table, "pressure")?,
            shear: shear.collect::<Result<_, _>>()?,
        })
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
    let (shear_axes, coupling) = (context.inputs.plan.shear, context.inputs.plan.coupling);
    let curve_due = context.curves_due();
    let start = predicted.as_ref().map(|p| &p.pressure[..]);
    let (bolt, load) = (context.bolt(), context.load);
    let contact = context.inputs.scene.contact.as_ref();
    let approach = contact.and_then(|contact| contact.approach);
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
    if let Some(curve) = curve {
        draft.put(
            TableName::Indentation,
            &keys.static_contact,
            &curve.table(TableName::Indentation)?,
        )?;
    }
    context.bear(load);
    let rotation = context.rotation(&solution);
    let row = Table::builder(TableName::StaticContact)
        .column("normal_load", vec![load])
        .column("approach", vec![solution.approach])
        .maybe("rotation_x", rotation.map(|r| vec![r[0]]))
        .maybe("rotation_y", rotation.map(|r| vec![r[1]]))
        .column("moment_x", vec![solution.moment[0]])
        .column("moment_y", vec![solution.moment[1]])
        .column("kn", vec![kn])
        .column("kt", vec![kt])
        .column("error", vec![solution.error])
        .column("iterations", vec![solution.iterations as i64])
        .column("fft_pairs", vec![fft_pairs])
        .maybe(
            "tangential_iterations",
            friction.as_ref().map(|f| vec![f.steps as i64]),
        )
        .maybe("error_tangential", friction.as_ref().map(|f| vec![f.error]))
        .build()?;
    draft.put(TableName::StaticContact, &keys.static_contact, &row)?;
    let predicted = predicted.map(|p| p.shear);
    let shear = indented.or(predicted).unwrap_or_default();
    let fields = Predicted {
        gap: solution.gap.clone(),
        pressure: solution.pressure.clone(),
        shear,
    };
    draft.put(
        TableName::ContactField,
        &keys.static_contact,
        &fields.table(context)?,
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
    let mut fields = kept(draft, TableName::ContactField, &keys.static_contact)?;
    // The cycle replaces the fields by its own, with the same gap and pressure, but another shear than the one that it started
    // from: they serve only where it will not be computed again.
    if fields.is_none() && fretting_cycle::is_complete(context, draft, keys)? {
        fields = kept(draft, TableName::ContactField, &keys.fretting_cycle)?;
    }
    let row = kept(draft, TableName::StaticContact, &keys.static_contact)?;
    let curve_done = !context.curves_due()
        || kept(draft, TableName::Indentation, &keys.static_contact)?.is_some();
    let (Some(fields), Some(row), true) = (fields, row, curve_done) else {
        return Ok(None);
    };
    let Predicted {
        gap,
        pressure,
        shear,
    } = Predicted::of(context, &fields)?;
    let load = row.f64("normal_load")?[0];
    context.bear(load);
    let contact = StaticContact {
        load,
        solution: NormalSolution {
            pressure,
            gap,
            approach: row.f64("approach")?[0],
            iterations: row.i64("iterations")?[0] as usize,
            rotation: pair(&row, ["rotation_x", "rotation_y"])?,
            load,
            moment: pair(&row, ["moment_x", "moment_y"])?,
            error: row.f64("error")?[0],
        },
        kn: row.f64("kn")?[0],
        kt: row.f64("kt")?[0],
        fft_pairs: row.f64("fft_pairs")?[0],
        friction: row
            .has("tangential_iterations")
            .then(|| -> Result<Friction, TableError> {
                Ok(Friction {
                    steps: row.i64("tangential_iterations")?[0] as usize,
                    error: row.f64("error_tangential")?[0],
                })
            })
            .transpose()?,
    };
    Ok(Some((contact, shear)))
}

/// Two columns of a row, zero where they are absent.
fn pair(row: &Table, names: [&str; 2]) -> Result<[f64; 2], TableError> {
    let mut pair = [0.0; 2];
    for (value, name) in pair.iter_mut().zip(names) {
        if row.has(name) {
            *value = row.f64(name)?[0];
        }
    }
    Ok(pair)
}
