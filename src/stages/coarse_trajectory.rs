//! The coarse trajectory, for error estimates.

use super::RunError;
use super::computed_motion::set_motion;
use super::contact_state::{contact_of, worn_state};
use super::declaration::Declaration;
use super::solvers::Solvers;
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use super::summary::LOADED_PRESSURE;
use crate::grid::Patch;
use crate::recipe::Part;
use crate::tables::{TableName, typed};
use crate::wear::coarse::{self, ERROR_PER_DIFFERENCE, RunTrajectory, TrajectoryDifference};
use crate::wear::joint::WornState;

/// The wear of the run, computed again with coarser steps, and its difference from the run. One coarse step covers
/// two steps of the run, and there is one at the end of the run. In the iterations between, the last difference is
/// copied.
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

/// The run warns if the error of the worn depths exceeds 0.1 of the worn volume.
const WARNING_THRESHOLD: f64 = 0.1;

/// Number of steps of the run per coarse step.
const STEPS: u64 = 2;

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let patch = solvers.joint(reads)?.patch.clone();
    let Some(field) = reads.optional_previous_table::<typed::CoarseField>()? else {
        // The fine and the coarse trajectory start from the same state, even if the source run has no coarse
        // trajectory.
        let run_state = run_state(reads, &patch)?;
        outputs.add_table(&field_of(&patch, &run_state, &run_state))?;
        let zero = contact_of(&reads.recipe).stiffness.then_some(0.0);
        let initial = typed::CoarseStep {
            difference_kn: zero,
            difference_kt: zero,
            ..typed::CoarseStep::default()
        };
        outputs.add_table(&restarted(&run_state, initial))?;
        return Ok(outputs);
    };
    let last: typed::CoarseStep = reads.before()?;
    let step: typed::WearStep = reads.table()?;
    let pending = last.pending_n_cycles + step.n_cycles;
    if !reads.wear_iteration.is_multiple_of(STEPS) && !reads.is_last {
        outputs.add_table(&field)?;
        outputs.add_table(&typed::CoarseStep {
            n_cycles: 0,
            pending_n_cycles: pending,
            fft_pairs: 0.0,
            ..last
        })?;
        return Ok(outputs);
    }
    let [from, begin] = states_of(reads, &patch, field, &last)?;
    let run_state = run_state(reads, &patch)?;
    let contact: typed::StaticContact = reads.table()?;
    set_motion(reads, solvers, contact.normal_load, None, None)?;
    let Some(wear) = &reads.recipe.wear else {
        unreachable!("a run with a coarse trajectory wears");
    };
    let law = wear.law();
    let along = RunTrajectory {
        begin: &begin,
        end: &run_state.wear,
    };
    let (worn, fft_pairs) = solvers.timed(reads, None, |joint| {
        Ok(coarse::advance(joint, &from, along, law, pending as u64))
    })?;
    drop([from, begin]);
    let worn = match worn {
        Ok(worn) => worn,
        Err(error) => {
            // The run continues after a failed coarse step. The error estimates of the run then contain only the errors
            // of single steps.
            outputs.notice(format!(
                "the coarse trajectory restarts here, so that the error bars omit the growth of earlier errors: {error}"
            ));
            outputs.add_table(&field_of(&patch, &run_state, &run_state))?;
            outputs.add_table(&restarted(
                &run_state,
                typed::CoarseStep { fft_pairs, ..last },
            ))?;
            return Ok(outputs);
        }
    };
    let recipe = contact_of(&reads.recipe);
    let relative = |own: f64, coarse: f64| match own > 0.0 && own.is_finite() {
        true => (own - coarse).abs() / own,
        false => 0.0,
    };
    let mut stiffness_differences = [None; 2];
    let mut stiffness_pairs = 0.0;
    if let (Some(own_kn), Some(own_kt)) = (contact.kn, contact.kt) {
        let ((kn, kt), pairs) = solvers.timed(reads, Some("stiffness"), |joint| {
            Ok(joint.stiffness(&worn.pressure, recipe.shear, recipe.coupling)?)
        })?;
        stiffness_differences = [Some(relative(own_kn, kn)), Some(relative(own_kt, kt))];
        stiffness_pairs = pairs;
    }
    let difference = TrajectoryDifference::between(&run_state, &worn, &patch, LOADED_PRESSURE);
    let volume = solvers.joint(reads)?.volume(&run_state.wear);
    if reads.is_last && ERROR_PER_DIFFERENCE * difference.field > WARNING_THRESHOLD * volume {
        let cells = match difference.undecided {
            0 => String::new(),
            cells => {
                format!(" {cells} of them differ in depth by more than a factor of two, and")
            }
        };
        outputs.notice(format!(
            "single cells decide how the joint wears: compared with steps twice as long and half the samples per stepped cycle,{cells} \
             the worn depths are known to ±{:.0} % only; fidelity.preset = \"reference\" or a smaller fidelity.wear_tolerance reduces this error",
            100.0 * ERROR_PER_DIFFERENCE * difference.field / volume
        ));
    }
    outputs.add_table(&field_of(&patch, &worn, &run_state))?;
    outputs.add_table(&typed::CoarseStep {
        n_cycles: pending,
        pending_n_cycles: 0,
        difference_wear_volume: difference.volume,
        difference_wear_field: difference.field,
        difference_loaded_area: difference.loaded_area,
        difference_kn: stiffness_differences[0],
        difference_kt: stiffness_differences[1],
        difference_max_pressure: difference.max_pressure,
        difference_largest_depth: difference.largest_depth,
        difference_depth_99: difference.depth_99,
        difference_dissipated_energy: difference.dissipation,
        undecided_cells: difference.undecided as i64,
        error_tangential: worn.cycle.error,
        dissipated_energy: worn.cycle.dissipation,
        fft_pairs: fft_pairs + stiffness_pairs,
    })?;
    Ok(outputs)
}

/// Returns a row of a coarse trajectory that restarts from the state `own` of the run. The row keeps the differences of
/// the row `earlier`.
fn restarted(own: &WornState, earlier: typed::CoarseStep) -> typed::CoarseStep {
    typed::CoarseStep {
        n_cycles: 0,
        pending_n_cycles: 0,
        error_tangential: own.cycle.error,
        dissipated_energy: own.cycle.dissipation,
        ..earlier
    }
}

/// Returns the worn state of the run in the current iteration.
fn run_state(reads: &StageInputs, patch: &Patch) -> Result<WornState, RunError> {
    let (fields, cycle) = (reads.table()?, reads.table()?);
    Ok(worn_state(
        &reads.recipe,
        patch,
        reads.optional_table()?,
        &fields,
        &cycle,
    )?)
}

/// Returns the state of the coarse trajectory, and the state of the run at the same cycles.
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
            // No step uses the gap.
            gap: vec![0.0; pressure.len()],
            pressure,
            // The cycles of both states start from the shear of the coarse trajectory.
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
    let mut shear = cycle.shear.iter().map(|shear| patch.joint_values(shear));
    typed::CoarseField {
        i,
        j,
        wear_depth: patch.joint_values(&state.wear),
        pressure: patch.joint_values(&state.pressure),
        shear_x: shear.next().expect("a cycle has an axis"),
        shear_y: shear.next(),
        slip_path: patch.joint_values(&cycle.slip_path),
        dissipation: patch.joint_values(&cycle.energy),
        own_wear_depth: patch.joint_values(&own.wear),
        own_pressure: patch.joint_values(&own.pressure),
        own_slip_path: patch.joint_values(&own.cycle.slip_path),
        own_dissipation: patch.joint_values(&own.cycle.energy),
    }
}
