//! The coarse trajectory beside the run's own.

use super::RunError;
use super::computed_motion::let_move;
use super::contact_state::{contact_of, worn_state};
use super::declaration::Declaration;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use super::summary::LOADED;
use crate::grid::Patch;
use crate::recipe::Part;
use crate::tables::{TableName, typed};
use crate::wear::coarse::{self, RunTrajectory, SPREAD, TrajectoryDifference};
use crate::wear::joint::WornState;

/// The wear of the run once more by coarser steps, and what that differs by: one step for two of the run, and one at its end. In between the
/// last difference stays.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::CoarseTrajectory,
    when: When::Always,
    recipe: &[
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::WearLaw,
        Part::End,
    ],
    reads: &[
        TableName::Surface,
        TableName::WearField,
        TableName::WearStep,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::FrettingCycle,
    ],
    before: &[TableName::CoarseField, TableName::CoarseStep],
    writes: &[TableName::CoarseField, TableName::CoarseStep],
    is_due: |_| true,
    shared: false,
    compute,
};

/// Part of the worn volume from which on an error of the worn depths is told.
const REMARKABLE: f64 = 0.1;

/// Steps of the run that the coarse trajectory takes at once.
const STEPS: u64 = 2;

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let patch = solvers.joint(reads)?.patch.clone();
    let Some(field) = reads.optional_before::<typed::CoarseField>()? else {
        // Both begin alike; so does what goes on from a run without a coarse trajectory.
        let own = own(reads, &patch)?;
        outputs.put(&field_of(&patch, &own, &own))?;
        let none = contact_of(&reads.recipe).stiffness.then_some(0.0);
        let alike = typed::CoarseStep {
            difference_kn: none,
            difference_kt: none,
            ..typed::CoarseStep::default()
        };
        outputs.put(&begun(&own, alike))?;
        return Ok(outputs);
    };
    let last: typed::CoarseStep = reads.before()?;
    let step: typed::WearStep = reads.table()?;
    let pending = last.pending_n_cycles + step.n_cycles;
    if !reads.wear_iteration.is_multiple_of(STEPS) && !reads.ends {
        outputs.put(&field)?;
        outputs.put(&typed::CoarseStep {
            n_cycles: 0,
            pending_n_cycles: pending,
            fft_pairs: 0.0,
            ..last
        })?;
        return Ok(outputs);
    }
    let [from, begin] = states_of(reads, &patch, field, &last)?;
    let own = own(reads, &patch)?;
    let contact: typed::StaticContact = reads.table()?;
    let_move(reads, solvers, contact.normal_load, None, None)?;
    let Some(wear) = &reads.recipe.wear else {
        unreachable!("a run with a coarse trajectory wears");
    };
    let law = wear.law();
    let along = RunTrajectory {
        begin: &begin,
        end: &own.wear,
    };
    let (worn, fft_pairs) = solvers.work(reads, None, |joint| {
        Ok(coarse::advance(joint, &from, along, law, pending as u64))
    })?;
    drop([from, begin]);
    let worn = match worn {
        Ok(worn) => worn,
        Err(error) => {
            // The run itself goes on: what it knows of its errors are those of single steps.
            outputs.notice(format!(
                "the coarse trajectory begins anew, and error bars know nothing of what wear has made of earlier errors: {error}"
            ));
            outputs.put(&field_of(&patch, &own, &own))?;
            outputs.put(&begun(&own, typed::CoarseStep { fft_pairs, ..last }))?;
            return Ok(outputs);
        }
    };
    let recipe = contact_of(&reads.recipe);
    let relative = |own: f64, coarse: f64| match own > 0.0 && own.is_finite() {
        true => (own - coarse).abs() / own,
        false => 0.0,
    };
    let mut of_stiffness = [None; 2];
    let mut stiffness_pairs = 0.0;
    if let (Some(own_kn), Some(own_kt)) = (contact.kn, contact.kt) {
        let ((kn, kt), pairs) = solvers.work(reads, Some("stiffness"), |joint| {
            Ok(joint.stiffness(&worn.pressure, recipe.shear, recipe.coupling)?)
        })?;
        of_stiffness = [Some(relative(own_kn, kn)), Some(relative(own_kt, kt))];
        stiffness_pairs = pairs;
    }
    let of = TrajectoryDifference::of(&own, &worn, &patch, LOADED);
    let volume = solvers.joint(reads)?.volume(&own.wear);
    if reads.ends && SPREAD * of.field > REMARKABLE * volume {
        let cells = match of.undecided {
            0 => String::new(),
            cells => {
                format!(" {cells} of them wear less than half or more than twice as deep, and")
            }
        };
        outputs.notice(format!(
            "single cells decide how the joint wears: held against steps twice as long, with half of the samples of a stepped cycle,{cells} \
             the worn depths are known to ±{:.0} % only; fidelity.preset = \"reference\" or a smaller fidelity.wear_tolerance decides",
            100.0 * SPREAD * of.field / volume
        ));
    }
    outputs.put(&field_of(&patch, &worn, &own))?;
    outputs.put(&typed::CoarseStep {
        n_cycles: pending,
        pending_n_cycles: 0,
        difference_wear_volume: of.volume,
        difference_wear_field: of.field,
        difference_loaded_area: of.loaded_area,
        difference_kn: of_stiffness[0],
        difference_kt: of_stiffness[1],
        difference_max_pressure: of.max_pressure,
        difference_largest_depth: of.largest_depth,
        difference_depth_99: of.depth_99,
        difference_dissipated_energy: of.dissipation,
        undecided_cells: of.undecided as i64,
        error_tangential: worn.cycle.error,
        dissipated_energy: worn.cycle.dissipation,
        fft_pairs: fft_pairs + stiffness_pairs,
    })?;
    Ok(outputs)
}

/// A coarse trajectory that begins at the run's `own` state, with the differences of an earlier one.
fn begun(own: &WornState, earlier: typed::CoarseStep) -> typed::CoarseStep {
    typed::CoarseStep {
        n_cycles: 0,
        pending_n_cycles: 0,
        error_tangential: own.cycle.error,
        dissipated_energy: own.cycle.dissipation,
        ..earlier
    }
}

/// The run's own state in this iteration.
fn own(reads: &StageInputs, patch: &Patch) -> Result<WornState, RunError> {
    let (fields, cycle) = (reads.table()?, reads.table()?);
    Ok(worn_state(
        &reads.recipe,
        patch,
        reads.maybe()?,
        &fields,
        &cycle,
    )?)
}

/// The state that the coarse trajectory is in, and that of the run's own at the same cycles.
fn states_of(
    reads: &StageInputs,
    patch: &Patch,
    field: typed::CoarseField,
    step: &typed::CoarseStep,
) -> Result<[WornState; 2], RunError> {
    let typed::CoarseField {
        i,
        j,
        shear_x,
        shear_y,
        ..
    } = field;
    let cycle = typed::FrettingCycle {
        dissipated_energy: step.dissipated_energy,
        error_tangential: step.error_tangential,
        ..typed::FrettingCycle::default()
    };
    let state = |wear_depth: Vec<f64>, pressure: Vec<f64>, slip_path, dissipation| {
        let wear = typed::WearField {
            i: i.clone(),
            j: j.clone(),
            wear_depth,
        };
        let fields = typed::ContactField {
            i: i.clone(),
            j: j.clone(),
            // No step asks for it.
            gap: vec![0.0; pressure.len()],
            pressure,
            // The cycles of both are marched from there.
            shear_x: Some(shear_x.clone()),
            shear_y: shear_y.clone(),
            slip_path: Some(slip_path),
            dissipation: Some(dissipation),
        };
        worn_state(&reads.recipe, patch, Some(wear), &fields, &cycle)
    };
    Ok([
        state(
            field.wear_depth,
            field.pressure,
            field.slip_path,
            field.dissipation,
        )?,
        state(
            field.own_wear_depth,
            field.own_pressure,
            field.own_slip_path,
            field.own_dissipation,
        )?,
    ])
}

fn field_of(patch: &Patch, state: &WornState, own: &WornState) -> typed::CoarseField {
    let (i, j) = patch.indices();
    let cycle = &state.cycle;
    let mut shear = cycle.shear.iter().map(|shear| patch.gather(shear));
    typed::CoarseField {
        i,
        j,
        wear_depth: patch.gather(&state.wear),
        pressure: patch.gather(&state.pressure),
        shear_x: shear.next().expect("a cycle has an axis"),
        shear_y: shear.next(),
        slip_path: patch.gather(&cycle.slip_path),
        dissipation: patch.gather(&cycle.energy),
        own_wear_depth: patch.gather(&own.wear),
        own_pressure: patch.gather(&own.pressure),
        own_slip_path: patch.gather(&own.cycle.slip_path),
        own_dissipation: patch.gather(&own.cycle.energy),
    }
}
