//! The state that a run continues from: what is committed, read back.

use super::context::Context;
use super::static_contact::{SHEAR, StaticContact, borne, stiffnesses};
use super::vibrating::{Driven, Vibrating};
use super::{RunError, Stage, dynamic_response, model_update};
use crate::contact::Shear;
use crate::scene::Plan;
use crate::store::RunStore;
use crate::tables::{Table, TableName};
use crate::wear::cycle::CycleSolution;
use crate::wear::error_bar::VolumeError;
use crate::wear::joint::WornState;

/// A committed iteration, as far as the next one depends on it.
pub struct Committed {
    pub worn: WornState,
    /// What moves the joint there; none where its motion is prescribed.
    pub driven: Option<Driven>,
    /// Cycles behind it.
    pub cycles: u64,
    /// Volume worn away \[m³\].
    pub volume: f64,
    /// Energy dissipated \[J\].
    pub energy: f64,
    /// Sum of what all steps estimate of their errors \[m³\].
    pub error: f64,
    /// The error bar of the volume, by source.
    pub bar: VolumeError,
    /// Its summary: what the next step changes.
    pub summary: Table,
    /// Cycles proposed to the next step; `None` before the first.
    pub proposal: Option<f64>,
}

/// Reads an iteration of a run with wear, and lets the joint of `context` move as it did there. What a sibling inherited from a
/// run of another scene is brought into balance under its own: the same wear, but its own load, friction and motion.
pub fn read(
    context: &mut Context,
    vibrating: Option<&Vibrating>,
    store: &RunStore,
    wear_iteration: u64,
) -> Result<Committed, RunError> {
    let mut committed = as_committed(context, store, wear_iteration)?;
    let reader = store.reader();
    let inherited = reader
        .record()
        .origin
        .as_ref()
        .is_some_and(|origin| origin.wear_iteration == wear_iteration);
    if inherited && reader.scene_hash_of(wear_iteration)? != reader.record().scene_hash {
        balance(context, vibrating, &mut committed)?;
        return Ok(committed);
    }
    if context.unworn_approach.is_some() {
        let row = store.read(wear_iteration, TableName::StaticContact)?;
        context.bear(row.f64("normal_load")?[0]);
    }
    if let Some(vibrating) = vibrating {
        let driven = Driven::committed(store, wear_iteration)?;
        follow(context, vibrating, &driven)?;
        committed.driven = Some(driven);
    }
    Ok(committed)
}

/// Lets the joint move as the response says, under the load that it bears.
pub fn follow(
    context: &mut Context,
    vibrating: &Vibrating,
    driven: &Driven,
) -> Result<(), RunError> {
    let inputs = context.inputs;
    let fine = vibrating.motion(inputs, driven, context.load)?;
    let (motion, march) = Plan::computed_motion(&inputs.scene.fidelity, &fine)?;
    context.joint.motion = motion;
    context.joint.march = march;
    Ok(())
}

fn balance(
    context: &mut Context,
    vibrating: Option<&Vibrating>,
    committed: &mut Committed,
) -> Result<(), RunError> {
    let before = &committed.worn;
    let (shear_axes, coupling) = (context.inputs.plan.shear, context.inputs.plan.coupling);
    let (bolt, load) = (context.bolt(), context.load);
    let ((contact, load, kn, kt), fft_pairs) = context.timed(Stage::StaticContact, |joint| {
        let start = Some(&before.pressure[..]);
        let (load, contact) = borne(joint, bolt, load, &before.wear, start)?;
        let (kn, kt) = stiffnesses(joint, &contact.pressure, shear_axes, coupling)?;
        Ok((contact, load, kn, kt))
    })?;
    context.bear(load);
    let contact = StaticContact {
        friction: None,
        load,
        solution: contact,
        kn,
        kt,
        fft_pairs,
    };
    if let Some(vibrating) = vibrating {
        let model = model_update::renewed(context, vibrating, &contact, committed.volume, None)?;
        let inputs = context.inputs;
        let driven = dynamic_response::shake(inputs, vibrating, &mut context.clock, model, None)?;
        follow(context, vibrating, &driven)?;
        committed.driven = Some(driven);
    }
    let (cycle, _) = context.timed(Stage::FrettingCycle, |joint| {
        let shear = Some(&before.cycle.shear);
        Ok(joint.cycle(&before.wear, &contact.solution, shear)?)
    })?;
    committed.worn.pressure = contact.solution.pressure;
    committed.worn.cycle = cycle;
    Ok(())
}

fn as_committed(
    context: &Context,
    store: &RunStore,
    wear_iteration: u64,
) -> Result<Committed, RunError> {
    let wear = context.field(
        &store.read(wear_iteration, TableName::WearField)?,
        "wear_depth",
    )?;
    let fields = store.read(wear_iteration, TableName::ContactField)?;
    let summary = store.read(wear_iteration, TableName::Summary)?;
    let step = store.read(wear_iteration, TableName::WearStep)?;
    let axes = match context.inputs.plan.shear {
        Shear::AlongX => 1,
        Shear::InPlane => 2,
    };
    // What was inherited may have another axis less, or more.
    let shear = SHEAR[..axes].iter().map(|name| match fields.has(name) {
        true => context.field(&fields, name),
        false => Ok(vec![0.0; context.joint.patch.grid.len()]),
    });
    let dissipation = summary.f64("dissipated_energy")?[0];
    let cycle = CycleSolution {
        shear: shear.collect::<Result<_, _>>()?,
        slip_path: context.field(&fields, "slip_path")?,
        energy: context.field(&fields, "dissipation")?,
        dissipation,
        instants: Vec::new(),
        steps: 0,
        error: summary.f64("error_tangential")?[0],
        dissipation_error: summary.f64("error_cycle")?[0] * dissipation,
    };
    let volume = summary.f64("wear_volume")?[0];
    // A motion that is prescribed has neither.
    let of_vibration = ["error_harmonics", "error_closure"]
        .map(|column| summary.f64(column).map_or(0.0, |values| values[0]));
    Ok(Committed {
        worn: WornState {
            wear,
            pressure: context.field(&fields, "pressure")?,
            cycle,
        },
        driven: None,
        cycles: summary.i64("cycles")?[0] as u64,
        volume,
        energy: summary.f64("dissipated_energy_total")?[0],
        error: summary.f64("error_wear")?[0] * volume,
        bar: VolumeError {
            steps: (summary.f64("error_wear_volume")?[0] - of_vibration[0] - of_vibration[1])
                * volume,
            harmonics: of_vibration[0] * volume,
            closure: of_vibration[1] * volume,
        },
        proposal: (wear_iteration > 0)
            .then(|| step.f64("next_n_cycles").map(|v| v[0]))
            .transpose()?,
        summary,
    })
}
