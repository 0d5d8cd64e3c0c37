//! The state that a run continues from: what is committed, read back.

use super::RunError;
use super::context::Context;
use super::static_contact::SHEAR;
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
    /// Sum of the errors of all steps \[m³\].
    pub error: f64,
    /// Cycles proposed to the next step; `None` before the first.
    pub proposal: Option<f64>,
}

/// Reads an iteration of a run with wear.
pub fn read(
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
    let shear = SHEAR
        .iter()
        .filter(|name| fields.has(name))
        .map(|name| context.field(&fields, name));
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
        error: summary.f64("error_wear")?[0] * volume,
        proposal: (wear_iteration > 0)
            .then(|| step.f64("next_n_cycles").map(|v| v[0]))
            .transpose()?,
    })
}
