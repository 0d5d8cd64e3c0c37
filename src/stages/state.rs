//! The state that a run continues from: what is committed, read back.

use super::context::Context;
use super::static_contact::SHEAR;
use super::{RunError, Stage};
use crate::contact::Shear;
use crate::store::RunStore;
use crate::tables::TableName;
use crate::wear::cycle::CycleSolution;
use crate::wear::joint::WornState;

/// A committed iteration, as far as the next one depends on it.
pub struct Committed {
    pub worn: WornState,
    /// Cycles behind it.
    pub cycles: u64,
    /// Volume worn away \[m³\].
    pub volume: f64,
    /// Energy dissipated \[J\].
    pub energy: f64,
    /// Sum of the errors of all steps \[m³\].
    pub error: f64,
    /// Cycles proposed to the next step; `None` before the first.
    pub proposal: Option<f64>,
}

/// Reads an iteration of a run with wear. What a sibling inherited from a run of another scene is brought into balance under
/// its own: the same wear, but its own load, friction and motion.
pub fn read(
    context: &mut Context,
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
        let before = committed.worn;
        let (contact, _) = context.timed(Stage::StaticContact, |joint| {
            joint.static_contact(&before.wear, Some(&before.pressure))
        })?;
        let (cycle, _) = context.timed(Stage::FrettingCycle, |joint| {
            joint.cycle(&before.wear, &contact, Some(&before.cycle.shear))
        })?;
        committed.worn = WornState {
            wear: before.wear,
            pressure: contact.pressure,
            cycle,
        };
    }
    Ok(committed)
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
    let cycle = CycleSolution {
        shear: shear.collect::<Result<_, _>>()?,
        slip_path: context.field(&fields, "slip_path")?,
        energy: context.field(&fields, "dissipation")?,
        dissipation: summary.f64("dissipated_energy")?[0],
        instants: Vec::new(),
        steps: 0,
        error: summary.f64("error_tangential")?[0],
    };
    let volume = summary.f64("wear_volume")?[0];
    Ok(Committed {
        worn: WornState {
            wear,
            pressure: context.field(&fields, "pressure")?,
            cycle,
        },
        cycles: summary.i64("cycles")?[0] as u64,
        volume,
        energy: summary.f64("dissipated_energy_total")?[0],
        error: summary.f64("error_wear")?[0] * volume,
        proposal: (wear_iteration > 0)
            .then(|| step.f64("next_n_cycles").map(|v| v[0]))
            .transpose()?,
    })
}
