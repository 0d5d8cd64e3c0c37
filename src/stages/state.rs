//! The state that a run continues from: what is committed, read back.

use super::context::Context;
use super::static_contact::{StaticContact, borne, stiffnesses};
use super::vibrating::{Driven, Vibrating};
use super::{RunError, Stage, dynamic_response, model_update};
use crate::contact::Shear;
use crate::store::RunStore;
use crate::tables::{TableError, TableName, typed};
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
    pub summary: typed::Summary,
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
        let row: typed::StaticContact = store.typed(wear_iteration)?;
        context.bear(row.normal_load);
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
    let Some(cycle) = context.inputs.recipe.cycle() else {
        unreachable!("a structure moves its joint through a cycle");
    };
    let fine = vibrating.motion(context.inputs, driven, context.load)?;
    let (motion, march) = cycle.of_computed(&fine)?;
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
    let (shear_axes, coupling) = context.shear_and_coupling();
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
    let wear: typed::WearField = store.typed(wear_iteration)?;
    let fields: typed::ContactField = store.typed(wear_iteration)?;
    let summary: typed::Summary = store.typed(wear_iteration)?;
    let step: typed::WearStep = store.typed(wear_iteration)?;
    let field = |values: &Option<Vec<f64>>, column| -> Result<Vec<f64>, TableError> {
        Ok(context.field(there(TableName::ContactField, values, column)?))
    };
    let axes = match context.shear_and_coupling().0 {
        Shear::AlongX => 1,
        Shear::InPlane => 2,
    };
    // What was inherited may have another axis less, or more.
    let none = || vec![0.0; context.joint.patch.grid.len()];
    let shear = [&fields.shear_x, &fields.shear_y];
    let shear = shear[..axes].iter().map(|shear| match shear {
        Some(shear) => context.field(shear),
        None => none(),
    });
    let of_cycle = |value: Option<f64>, column| there(TableName::Summary, &value, column).copied();
    let dissipation = of_cycle(summary.dissipated_energy, "dissipated_energy")?;
    let cycle = CycleSolution {
        shear: shear.collect(),
        slip_path: field(&fields.slip_path, "slip_path")?,
        energy: field(&fields.dissipation, "dissipation")?,
        dissipation,
        instants: Vec::new(),
        steps: 0,
        error: of_cycle(summary.error_tangential, "error_tangential")?,
        dissipation_error: of_cycle(summary.error_cycle, "error_cycle")? * dissipation,
    };
    let volume = of_cycle(summary.wear_volume, "wear_volume")?;
    // A motion that is prescribed has neither.
    let harmonics = summary.error_harmonics.unwrap_or(0.0);
    let closure = summary.error_closure.unwrap_or(0.0);
    let whole = of_cycle(summary.error_wear_volume, "error_wear_volume")?;
    Ok(Committed {
        worn: WornState {
            wear: context.field(&wear.wear_depth),
            pressure: context.field(&fields.pressure),
            cycle,
        },
        driven: None,
        cycles: *there(TableName::Summary, &summary.cycles, "cycles")? as u64,
        volume,
        energy: of_cycle(summary.dissipated_energy_total, "dissipated_energy_total")?,
        error: of_cycle(summary.error_wear, "error_wear")? * volume,
        bar: VolumeError {
            steps: (whole - harmonics - closure) * volume,
            harmonics: harmonics * volume,
            closure: closure * volume,
        },
        proposal: (wear_iteration > 0).then_some(step.next_n_cycles),
        summary,
    })
}

/// A column that every state of wear has.
fn there<'a, T>(table: TableName, value: &'a Option<T>, column: &str) -> Result<&'a T, TableError> {
    value.as_ref().ok_or_else(|| TableError::MissingColumn {
        table: table.as_str().to_owned(),
        column: column.to_owned(),
    })
}
