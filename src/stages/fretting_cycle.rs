//! The steady fretting cycle of an iteration.

use super::RunError;
use super::contact_state::{ElementMotion, Fields, let_move, on_axes, solution_of, wear_of};
use super::declaration::Declaration;
use super::reads::{Outputs, Reads};
use super::solvers::Solvers;
use super::stage::{Stage, When};
use crate::recipe::{MotionSource, Part};
use crate::tables::{TableName, typed};
use crate::wear::curves::{self, Curve};
use crate::wear::cycle::{Instant, March};
use crate::wear::implicit::EndCycle;

/// Shear, slip and dissipation over the steady cycle, [A §2e, eq. 2.6], from the shear of the static contact on.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::FrettingCycle,
    when: When::Always,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::Elements,
        Part::Curves,
    ],
    reads: &[
        TableName::Surface,
        TableName::Reference,
        TableName::WearField,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::ContactElement,
        TableName::ContactSlider,
        TableName::Response,
    ],
    before: &[],
    writes: &[
        TableName::FrettingCycle,
        TableName::ContactField,
        TableName::Cycle,
        TableName::Hysteresis,
    ],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute(reads: &Reads, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let patch = solvers.joint(reads)?.patch.clone();
    let wear = wear_of(&patch, reads.maybe()?);
    let static_contact: typed::StaticContact = reads.table()?;
    let mut fields = Fields::of(&patch, &reads.table()?);
    let start = on_axes(&reads.recipe, &patch, std::mem::take(&mut fields.shear));
    let start = (!start.is_empty()).then_some(&start);
    let contact = solution_of(&static_contact, fields);
    let moved = ElementMotion::of(reads)?;
    let left_out = let_move(reads, solvers, static_contact.normal_load, moved.as_ref())?;
    // The loop is that of force over displacement along x, if anything drives the joint there.
    let drive = match moved {
        Some(_) => None,
        None => reads.motion().drive.first(),
    };
    let curve_due = reads.curves_due && drive.is_none_or(|x| x.moves());
    let known = solvers.end.take();
    let ((solution, curve), fft_pairs) = solvers.work(reads, None, |joint| {
        let is_same = |end: &EndCycle| {
            end.motion == joint.motion
                && end.wear == wear
                && end.pressure == contact.pressure
                && Some(&end.start) == start
        };
        let solution = match known.filter(is_same) {
            Some(known) => {
                joint.half_space.count_pairs(known.fft_pairs);
                known.cycle
            }
            None => joint.cycle(&wear, &contact, start)?,
        };
        let curve = curve_due
            .then(|| curves::hysteresis(joint, &contact, &solution))
            .transpose()?;
        Ok((solution, curve))
    })?;
    let mut outputs = Outputs::default();
    if let Some(Curve { load, displacement }) = curve {
        outputs.put(&typed::Hysteresis { load, displacement })?;
    }
    let march = solvers.joint(reads)?.march;
    outputs.put(&instants(&recorded(reads, march, &solution.instants)))?;
    outputs.put(&typed::FrettingCycle {
        dissipated_energy: solution.dissipation,
        iterations: solution.steps as i64,
        error_tangential: solution.error,
        error_cycle: (solution.relative_error() + left_out).min(1.0),
        fft_pairs,
    })?;
    let fields = Fields {
        gap: contact.gap,
        pressure: contact.pressure,
        shear: solution.shear,
    };
    outputs.put(&typed::ContactField {
        slip_path: Some(patch.gather(&solution.slip_path)),
        dissipation: Some(patch.gather(&solution.energy)),
        ..fields.table(&patch)
    })?;
    Ok(outputs)
}

/// The instants that are written: not those between them at which a history is marched too, to extrapolate it. So the cycle of a run
/// with a history is a history with the same result.
fn recorded<'a>(reads: &Reads, march: March, instants: &'a [Instant]) -> Vec<&'a Instant> {
    let motion = reads.recipe.cycle().map(|cycle| &cycle.motion);
    let halved = matches!(motion, Some(MotionSource::History { halved: true, .. }));
    let every = match halved && march == March::Stepped {
        true => 2,
        false => 1,
    };
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
