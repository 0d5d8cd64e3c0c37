//! The steady fretting cycle of an iteration.

use super::context::{Context, Keys, gather, is_kept, put};
use super::curves::Curve;
use super::static_contact::{StaticContact, contact_field};
use super::{RunError, Stage, curves};
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;
use crate::recipe::Motion;
use crate::store::Draft;
use crate::tables::{TableName, typed};
use crate::wear::cycle::{CycleSolution, Instant, March};

/// The cycle of an iteration and what it cost.
pub struct Cycle {
    pub solution: CycleSolution,
    pub fft_pairs: f64,
}

/// Solves the steady cycle. Its fields, which replace those that it started from, are left to [`put_fields`].
pub fn fretting_cycle(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    wear: &[f64],
    contact: &StaticContact,
    start: &ByAxis<Vec<f64>>,
) -> Result<Cycle, RunError> {
    let start = (!start.is_empty()).then_some(start);
    let curve_due = context.hysteresis_due();
    let ((solution, curve), fft_pairs) = context.timed(Stage::FrettingCycle, |joint| {
        let solution = joint.cycle(wear, &contact.solution, start)?;
        let curve = curve_due
            .then(|| curves::hysteresis(joint, &contact.solution, &solution))
            .transpose()?;
        Ok((solution, curve))
    })?;
    let key = &keys.fretting_cycle;
    if let Some(Curve { load, displacement }) = curve {
        put(draft, key, &typed::Hysteresis { load, displacement })?;
    }
    put(
        draft,
        key,
        &instants(&recorded(context, &solution.instants)),
    )?;
    Ok(Cycle {
        solution,
        fft_pairs,
    })
}

/// Writes the fields of the cycle, the last table of an iteration: until then all that the cycle started from is in the draft.
pub fn put_fields(
    context: &Context,
    draft: &mut Draft,
    keys: &Keys,
    contact: &StaticContact,
    cycle: &Cycle,
) -> Result<(), RunError> {
    let (patch, solution) = (&context.joint.patch, &cycle.solution);
    let NormalSolution { gap, pressure, .. } = &contact.solution;
    let fields = typed::ContactField {
        slip_path: Some(gather(patch, &solution.slip_path)),
        dissipation: Some(gather(patch, &solution.energy)),
        ..contact_field(patch, gap, pressure, &solution.shear)
    };
    put(draft, &keys.fretting_cycle, &fields)
}

/// True if an earlier start completed the tables of the cycle and the summary.
pub fn is_complete(context: &Context, draft: &mut Draft, keys: &Keys) -> Result<bool, RunError> {
    let mut tables = vec![
        TableName::ContactField,
        TableName::Cycle,
        TableName::Summary,
    ];
    if context.hysteresis_due() {
        tables.push(TableName::Hysteresis);
    }
    if keys.vibration.is_some() {
        tables.push(TableName::Ledger);
    }
    for table in tables {
        if !is_kept(draft, table, &keys.fretting_cycle)? {
            return Ok(false);
        }
    }
    Ok(true)
}

/// The instants that are written: a history's own, not those between them at which it is marched too. So the cycle of a run with
/// a history is a history with the same result.
fn recorded<'a>(context: &Context, instants: &'a [Instant]) -> Vec<&'a Instant> {
    let motion = context.inputs.recipe.cycle().map(|cycle| &cycle.motion);
    let halved = matches!(motion, Some(Motion::History { halved: true, .. }));
    let middles = halved && context.joint.march == March::Stepped;
    let every = if middles { 2 } else { 1 };
    instants.iter().step_by(every).collect()
}

fn instants(instants: &[&Instant]) -> typed::Cycle {
    let series = |value: &dyn Fn(&Instant) -> f64| -> Vec<f64> {
        instants.iter().map(|i| value(i)).collect()
    };
    let in_plane = instants
        .first()
        .is_some_and(|instant| instant.displacement.len() > 1);
    let torsion = |k: usize| -> Option<Vec<f64>> {
        instants
            .iter()
            .map(|instant| instant.torsion.map(|pair| pair[k]))
            .collect()
    };
    typed::Cycle {
        time: series(&|i| i.time),
        displacement_x: series(&|i| i.displacement[0]),
        displacement_y: in_plane.then(|| series(&|i| i.displacement[1])),
        normal_load: series(&|i| i.normal_load),
        force_x: series(&|i| i.force[0]),
        force_y: in_plane.then(|| series(&|i| i.force[1])),
        rotation_z: torsion(0),
        moment_z: torsion(1),
    }
}
