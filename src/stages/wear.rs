//! The wear step from one committed iteration to the next.

use super::RunError;
use super::computed_motion::{ElementMotion, let_move};
use super::contact_state::{Fields, contact_of, tangential_compliance, there, worn_state};
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

/// Proposals are written to a table, which holds no infinity: a joint that does not wear proposes this.
const LONGEST_PROPOSAL: f64 = 1e18;

/// A step shorter than what is left of the volume by this factor does not pass the volume asked for, since the rate of
/// wear may still grow in running-in.
const VOLUME_MARGIN: f64 = 0.98;

/// A step up to an update by the growth of the volume is longer by this than its rate says, which falls by a little in it.
const GROWTH_MARGIN: f64 = 1.08;

/// No wear yet.
pub const UNWORN: Declaration = Declaration {
    stage: Stage::Unworn,
    when: When::Unworn,
    recipe: &[Part::Surface, Part::Elements],
    reads: &[TableName::Surface],
    before: &[],
    writes: &[TableName::WearField, TableName::WearStep],
    is_due: |_| true,
    shared: false,
    compute: unworn,
};

/// The wear after as many cycles as the step control allows, [A eq. 2.6–2.8], and the contact that it predicts.
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

fn unworn(reads: &StageInputs, _: &mut Solvers) -> Result<Outputs, RunError> {
    let (patch, _) = patch_and_height(reads)?;
    let mut outputs = Outputs::default();
    let wear = vec![0.0; patch.grid.len()];
    // A run has the same columns in all its iterations.
    let elements = reads.recipe.elements();
    let none = elements
        .filter(|elements| elements.stiffness.is_sliders())
        .map(|_| 0.0);
    let step = typed::WearStep {
        end_energy: none,
        end_force: none,
        ..typed::WearStep::default()
    };
    put_step(&mut outputs, &patch, &wear, &step)?;
    Ok(outputs)
}

/// A worn state with what the step from it goes on from.
struct PreviousState {
    state: WornState,
    cycles: u64,
    volume: f64,
    /// Cycles proposed to the step; none before the first.
    proposal: Option<f64>,
}

impl PreviousState {
    fn of(reads: &StageInputs, patch: &Patch) -> Result<PreviousState, RunError> {
        let fields: typed::ContactField = reads.before()?;
        let summary: typed::Summary = reads.before()?;
        let step: typed::WearStep = reads.before()?;
        let cycle: typed::FrettingCycle = reads.before()?;
        let of_run = |value: Option<f64>, column| {
            let value = there(TableName::Summary, &value, column);
            Ok::<f64, RunError>(*value?)
        };
        let cycles = summary.cycles.map(|cycles| cycles as f64);
        Ok(PreviousState {
            cycles: of_run(cycles, "cycles")? as u64,
            volume: of_run(summary.wear_volume, "wear_volume")?,
            proposal: (reads.wear_iteration > 1).then_some(step.next_n_cycles),
            state: worn_state(
                &reads.recipe,
                patch,
                reads.optional_before()?,
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
    let of_contact: typed::StaticContact = reads.before()?;
    let moved = ElementMotion::before(reads)?;
    let compliance = tangential_compliance(&of_contact);
    let load = of_contact.normal_load;
    let computed = let_move(reads, solvers, load, moved.as_ref(), compliance)?.computed;
    let moved = |compliance: Option<f64>| {
        let computed = computed.as_ref();
        let figures = computed.and_then(|computed| computed.figures_at(compliance).ok());
        figures.map_or(CycleFigures::SAME, |figures| figures.cycle)
    };
    solvers.pressed_joint(reads, of_contact.preload.unwrap_or(0.0))?;
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
    let remaining = landing(reads, wear, before.cycles) - before.cycles;
    let until_volume = (volume_left / rate * VOLUME_MARGIN).ceil().max(1.0);
    let limits = Limits {
        tolerance: wear.tolerance,
        depth_step: wear.depth_step,
        remaining,
    };
    let next_update = NextUpdate::of(reads)?;
    let due_volume = next_update.as_ref().and_then(|next| next.due_volume);
    let until_growth = due_volume.map_or(f64::INFINITY, |due| {
        ((due - before.volume).max(0.0) / rate * GROWTH_MARGIN)
            .ceil()
            .max(1.0)
    });
    let state = &before.state;
    // An implicit step ends where the contact elements fall due.
    let implicit = |joint: &mut FrettingJoint| -> Result<Step, NumericsError> {
        let first = || implicit::first_proposal(joint, state, law);
        let proposal = before.proposal.unwrap_or_else(first);
        let proposal = proposal.min(until_volume).min(until_growth);
        let Some(next) = &next_update else {
            return Ok(implicit::advance(joint, state, law, proposal, limits)?);
        };
        let reached = |joint: &mut FrettingJoint, step: &Step| {
            let volume = joint.volume(&step.wear);
            next.reached(joint, contact, step, volume, &moved)
        };
        let landing = EventSearch::new(next.begin, wear.tolerance);
        landing.advance(joint, state, law, proposal, limits, reached)
    };
    let (step, fft_pairs) = solvers.work(reads, None, |joint| {
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
    let drift = reads.optional_before::<typed::Ledger>()?;
    let drift = drift.as_ref().and_then(Drift::of);
    let end = drift.map(|Drift { now, .. }| match step.middle {
        Some(middle) => now.at_end(figures_of(&middle, &moved)),
        None => now,
    });
    let row = typed::WearStep {
        n_cycles: step.cycles as i64,
        volume: joint.volume(&step.wear) - joint.volume(&state.wear),
        error: step.error,
        // A step that was cut for an update says nothing of the next one.
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
    outputs.put(&predicted.table(&patch))?;
    Ok(outputs)
}

/// The cycles that a step from `cycles` must not pass: the end, or where a response is asked for.
fn landing(reads: &StageInputs, wear: &Wear, cycles: u64) -> u64 {
    let asked = &reads.recipe.output.response_at;
    let next = asked.iter().copied().find(|&at| at > cycles);
    wear.cycles
        .unwrap_or(u64::MAX)
        .min(next.unwrap_or(u64::MAX))
}

/// What there is to say if the explicit step is too long to be stable.
fn instability(
    joint: &FrettingJoint,
    law: WearLaw,
    before: &WornState,
    cycles: u64,
) -> Option<String> {
    let beyond = explicit::beyond_stability(
        &before.cycle.slip_path,
        &before.pressure,
        joint.friction_coefficient,
        law,
        cycles,
        joint.half_space.self_compliance(),
    );
    (beyond > 1.0).then(|| {
        format!(
            "wear.depth_step: the first explicit step is {beyond:.1} times as long as is stable; contact area will be \
             wrong, and with a much too long step volume too; make wear.depth_step smaller or wear.scheme \"implicit\""
        )
    })
}

/// Adds the wear and the step that led to it.
fn put_step(
    outputs: &mut Outputs,
    patch: &Patch,
    wear: &[f64],
    step: &typed::WearStep,
) -> Result<(), RunError> {
    let (i, j) = patch.indices();
    let wear_depth = patch.gather(wear);
    outputs.put(&typed::WearField { i, j, wear_depth })?;
    outputs.put(step)
}
