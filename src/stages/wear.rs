//! The wear step from one committed iteration to the next.

use super::RunError;
use super::computed_motion::{ElementMotion, set_motion};
use super::contact_state::{
    Fields, contact_of, required_column, tangential_compliance, worn_state,
};
use super::declaration::{Declaration, joined};
use super::error::NumericsError;
use super::ledger::Drift;
use super::model_update::{NextUpdate, figures_of};
use super::reduced;
use super::solvers::{Solvers, patch_and_height};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::grid::Patch;
use crate::model_update::CycleFigures;
use crate::recipe::{Part, Wear};
use crate::tables::{TableName, typed};
use crate::wear::event_search::EventSearch;
use crate::wear::implicit::{self, Limits, Step};
use crate::wear::joint::WornState;
use crate::wear::{FrettingJoint, WearLaw, explicit};

/// For a joint without wear, the step control proposes `LONGEST_PROPOSAL` cycles, because a table cannot store
/// infinity.
const LONGEST_PROPOSAL: f64 = 1e18;

/// Safety factor on the step to the requested volume. The rate of wear may still grow during running-in, and the step
/// must not pass the volume.
const VOLUME_MARGIN: f64 = 0.98;

/// The initial wear rate gives the length of a step to the volume of the next update. The step is `GROWTH_MARGIN` times
/// as long, because the wear rate decreases slightly within the step.
const GROWTH_MARGIN: f64 = 1.08;

/// The state without wear.
pub const UNWORN: Declaration = Declaration {
    stage: Stage::Unworn,
    when: When::Unworn,
    recipe: &[Part::Surface, Part::Elements],
    reads: &[TableName::Surface],
    before: &[],
    writes: &[TableName::WearField, TableName::WearStep],
    is_due: |_| true,
    shared: false,
    compute: compute_unworn,
};

/// The wear after as many cycles as the step control allows, [A eq. 2.6–2.8], and the predicted contact.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::Wear,
    when: When::Worn,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::Elements,
        Part::Wear,
        Part::ResponseAt,
    ],
    reads: &joined::<7>(&[
        &reduced::TABLES,
        &[TableName::Surface, TableName::Reference],
    ]),
    before: &[
        TableName::WearField,
        TableName::WearStep,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::FrettingCycle,
        TableName::Summary,
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::ContactSlider,
        TableName::Response,
        TableName::DynamicResponse,
        TableName::Ledger,
    ],
    writes: &[
        TableName::WearField,
        TableName::WearStep,
        TableName::ContactField,
    ],
    is_due: |_| true,
    shared: false,
    compute,
};

fn compute_unworn(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let (patch, _) = patch_and_height(reads)?;
    let mut outputs = Outputs::default();
    let wear = vec![0.0; patch.grid.len()];
    // All iterations of a run have the same columns.
    let elements = reads.recipe.elements();
    let end_figure = elements
        .filter(|elements| elements.stiffness.is_sliders())
        .map(|_| 0.0);
    let step = typed::WearStep {
        end_energy: end_figure,
        end_force: end_figure,
        ..typed::WearStep::default()
    };
    put_step(&mut outputs, &patch, &wear, &step)?;
    Ok(outputs)
}

/// A worn state with the cycles, volume and proposal from which the next step starts.
struct PreviousState {
    state: WornState,
    cycles: u64,
    volume: f64,
    /// Cycles that the last step proposed; `None` before the first step.
    proposal: Option<f64>,
}

impl PreviousState {
    fn of(reads: &StageInputs, patch: &Patch) -> Result<PreviousState, RunError> {
        let fields: typed::ContactField = reads.before()?;
        let summary: typed::Summary = reads.before()?;
        let step: typed::WearStep = reads.before()?;
        let cycle: typed::FrettingCycle = reads.before()?;
        let summary_value = |value: Option<f64>, column| {
            let value = required_column(TableName::Summary, &value, column);
            Ok::<f64, RunError>(*value?)
        };
        let cycles = summary.cycles.map(|cycles| cycles as f64);
        Ok(PreviousState {
            cycles: summary_value(cycles, "cycles")? as u64,
            volume: summary_value(summary.wear_volume, "wear_volume")?,
            proposal: (reads.wear_iteration > 1).then_some(step.next_n_cycles),
            state: worn_state(
                &reads.recipe,
                patch,
                reads.optional_previous_table()?,
                &fields,
                &cycle,
            )?,
        })
    }
}

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let Some(wear) = &reads.recipe.wear else {
        unreachable!("a run with this stage wears");
    };
    let contact = contact_of(&reads.recipe);
    let patch = solvers.joint(reads)?.patch.clone();
    let before = PreviousState::of(reads, &patch)?;
    let static_contact: typed::StaticContact = reads.before()?;
    let element_motion = ElementMotion::before(reads)?;
    let compliance = tangential_compliance(&static_contact);
    let load = static_contact.normal_load;
    let computed = set_motion(reads, solvers, load, element_motion.as_ref(), compliance)?.computed;
    let motion_figures = |compliance: Option<f64>| {
        let computed = computed.as_ref();
        let figures = computed.and_then(|computed| computed.figures_at(compliance).ok());
        figures.map_or(CycleFigures::SAME, |figures| figures.cycle)
    };
    solvers.pressed_joint(reads, static_contact.preload.unwrap_or(0.0))?;
    let volume_left = wear
        .volume
        .map_or(f64::INFINITY, |volume| volume - before.volume);
    let law = wear.law();
    let rate = law.volume(before.state.cycle.dissipation);
    if wear.cycles.is_none() && rate <= 0.0 {
        let volume = wear.volume.unwrap_or(f64::INFINITY);
        return Err(RunError::WearsNoMore {
            volume,
            reached: before.volume,
        });
    }
    let remaining = cycle_limit(reads, wear, before.cycles) - before.cycles;
    let until_volume = (volume_left / rate * VOLUME_MARGIN).ceil().max(1.0);
    let limits = Limits {
        tolerance: wear.tolerance,
        depth_step: wear.depth_step,
        remaining,
        safety: Limits::SAFETY,
    };
    let next_update = NextUpdate::of(reads)?;
    let due_volume = next_update.as_ref().and_then(|next| next.due_volume);
    let until_growth = due_volume.map_or(f64::INFINITY, |due| {
        ((due - before.volume).max(0.0) / rate * GROWTH_MARGIN)
            .ceil()
            .max(1.0)
    });
    let state = &before.state;
    // An implicit step ends where an update of the contact elements is due.
    let implicit = |joint: &mut FrettingJoint| -> Result<Step, NumericsError> {
        let first = || implicit::first_proposal(joint, state, law);
        let proposal = before.proposal.unwrap_or_else(first);
        let proposal = proposal.min(until_volume).min(until_growth);
        let Some(next) = &next_update else {
            return Ok(implicit::advance(joint, state, law, proposal, limits)?);
        };
        let reached = |joint: &mut FrettingJoint, step: &Step| {
            let volume = joint.volume(&step.wear);
            next.progress(joint, contact, step, volume, &motion_figures)
        };
        let search = EventSearch::new(next.begin, wear.tolerance);
        search.advance(joint, state, law, proposal, limits, reached)
    };
    let (step, fft_pairs) = solvers.timed(reads, None, |joint| {
        wear.scheme.advance(joint, state, law, limits, implicit)
    })?;
    solvers.end = step.end;
    let mut outputs = Outputs::default();
    let joint = solvers.joint(reads)?;
    if wear.scheme.is_explicit() && reads.wear_iteration == 1 {
        outputs
            .notices
            .extend(instability(joint, law, state, step.cycles));
    }
    let drift = reads.optional_previous_table::<typed::Ledger>()?;
    let drift = drift.as_ref().and_then(Drift::of);
    let end = drift.map(|Drift { now, .. }| match step.middle {
        Some(middle) => now.at_end(figures_of(&middle, &motion_figures)),
        None => now,
    });
    let row = typed::WearStep {
        n_cycles: step.cycles as i64,
        volume: joint.volume(&step.wear) - joint.volume(&state.wear),
        error: step.error,
        // A step shortened for an update does not limit the next step.
        next_n_cycles: match before.proposal {
            Some(proposal) if until_growth < proposal => step.proposal.max(proposal),
            _ => step.proposal,
        }
        .min(LONGEST_PROPOSAL),
        rejected: step.rejected as i64,
        fft_pairs,
        end_energy: end.map(|end| end.energy),
        end_force: end.map(|end| end.force),
    };
    put_step(&mut outputs, &patch, &step.wear, &row)?;
    let predicted = Fields {
        gap: step.gap.unwrap_or_else(|| vec![0.0; step.wear.len()]),
        pressure: step.pressure,
        shear: step.shear,
    };
    outputs.add_table(&predicted.table(&patch))?;
    Ok(outputs)
}

/// Returns the largest number of cycles at the end of a step from `cycles`. The limit is the end of the run or the next
/// requested response.
fn cycle_limit(reads: &StageInputs, wear: &Wear, cycles: u64) -> u64 {
    let response_cycles = &reads.recipe.output.response_at;
    let next = response_cycles.iter().copied().find(|&at| at > cycles);
    wear.cycles
        .unwrap_or(u64::MAX)
        .min(next.unwrap_or(u64::MAX))
}

/// Returns a warning if the explicit step exceeds the stability limit.
fn instability(
    joint: &FrettingJoint,
    law: WearLaw,
    before: &WornState,
    cycles: u64,
) -> Option<String> {
    let beyond = explicit::stability_ratio(
        &before.cycle.slip_path,
        &before.pressure,
        joint.friction_coefficient,
        law,
        cycles,
        joint.half_space.self_compliance(),
    );
    (beyond > 1.0).then(|| {
        format!(
            "wear.depth_step: the first explicit step is {beyond:.1} times the stable step. The contact area will be \
             wrong, and so will the volume if the step is much too long. Reduce wear.depth_step or set wear.scheme = \"implicit\""
        )
    })
}

/// Adds the tables of the wear and of the step.
fn put_step(
    outputs: &mut Outputs,
    patch: &Patch,
    wear: &[f64],
    step: &typed::WearStep,
) -> Result<(), RunError> {
    let (i, j) = patch.indices();
    let wear_depth = patch.joint_values(wear);
    outputs.add_table(&typed::WearField { i, j, wear_depth })?;
    outputs.add_table(step)
}
