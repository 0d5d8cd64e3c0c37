//! The wear step from one committed iteration to the next.

use super::RunError;
use super::contact_state::{Fields, contact_of, let_move, on_axes, wear_of};
use super::declaration::{Declaration, Stage, When};
use super::model_update::NextUpdate;
use super::reads::{Outputs, Reads};
use super::solvers::{Solvers, patch_and_height};
use crate::grid::{ByAxis, Patch};
use crate::recipe::{Part, Wear};
use crate::tables::{TableError, TableName, typed};
use crate::wear::cycle::CycleSolution;
use crate::wear::implicit::{self, Limits, Step};
use crate::wear::joint::{Scheme, WornState};
use crate::wear::landing::Landing;
use crate::wear::{FrettingJoint, explicit, semi_implicit};

/// Proposals are written to a table, which holds no infinity: a joint that does not wear proposes this.
const LONGEST_PROPOSAL: f64 = 1e18;

/// A step shorter than what is left of the volume by this factor does not pass the volume asked for, since the rate of
/// wear may still grow in running-in.
const VOLUME_MARGIN: f64 = 0.98;

/// No wear yet.
pub const UNWORN: Declaration = Declaration {
    stage: Stage::Unworn,
    when: When::Unworn,
    recipe: &[Part::Surface],
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
    reads: &[TableName::Surface, TableName::Reference],
    before: &[
        TableName::WearField,
        TableName::WearStep,
        TableName::StaticContact,
        TableName::ContactField,
        TableName::FrettingCycle,
        TableName::Summary,
        TableName::ModelUpdate,
        TableName::ContactElement,
        TableName::Response,
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

fn unworn(reads: &Reads, _: &mut Solvers) -> Result<Outputs, RunError> {
    let (patch, _) = patch_and_height(reads)?;
    let mut outputs = Outputs::default();
    let wear = vec![0.0; patch.grid.len()];
    put_step(&mut outputs, &patch, &wear, &typed::WearStep::default())?;
    Ok(outputs)
}

/// A worn state with what the step from it goes on from.
struct Before {
    state: WornState,
    cycles: u64,
    volume: f64,
    /// Cycles proposed to the step; none before the first.
    proposal: Option<f64>,
}

impl Before {
    fn of(reads: &Reads, patch: &Patch) -> Result<Before, RunError> {
        let fields: typed::ContactField = reads.before()?;
        let summary: typed::Summary = reads.before()?;
        let step: typed::WearStep = reads.before()?;
        let cycle: typed::FrettingCycle = reads.before()?;
        let Fields {
            pressure, shear, ..
        } = Fields::of(patch, &fields);
        let shear = on_axes(&reads.recipe, patch, shear);
        let field = |values: &Option<Vec<f64>>, column| -> Result<Vec<f64>, RunError> {
            Ok(patch.spread(there(TableName::ContactField, values, column)?))
        };
        let of_run = |value: Option<f64>, column| {
            let value = there(TableName::Summary, &value, column);
            Ok::<f64, RunError>(*value?)
        };
        let cycles = summary.cycles.map(|cycles| cycles as f64);
        Ok(Before {
            cycles: of_run(cycles, "cycles")? as u64,
            volume: of_run(summary.wear_volume, "wear_volume")?,
            proposal: (reads.wear_iteration > 1).then_some(step.next_n_cycles),
            state: WornState {
                wear: wear_of(patch, reads.maybe_before()?),
                pressure,
                cycle: CycleSolution {
                    shear,
                    slip_path: field(&fields.slip_path, "slip_path")?,
                    energy: field(&fields.dissipation, "dissipation")?,
                    dissipation: cycle.dissipated_energy,
                    instants: Vec::new(),
                    steps: 0,
                    error: cycle.error_tangential,
                    dissipation_error: cycle.error_cycle * cycle.dissipated_energy,
                },
            },
        })
    }
}

/// A column that every state of wear has.
pub fn there<'a, T>(
    table: TableName,
    value: &'a Option<T>,
    column: &str,
) -> Result<&'a T, TableError> {
    value.as_ref().ok_or_else(|| TableError::MissingColumn {
        table: table.as_str().to_owned(),
        column: column.to_owned(),
    })
}

fn compute(reads: &Reads, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let Some(wear) = &reads.recipe.wear else {
        unreachable!("a run with this stage wears");
    };
    let contact = contact_of(&reads.recipe);
    let patch = solvers.joint(reads)?.patch.clone();
    let before = Before::of(reads, &patch)?;
    let of_contact: typed::StaticContact = reads.before()?;
    let response = reads.maybe_before::<typed::Response>()?;
    let elements = reads.maybe_before::<typed::ContactElement>()?;
    let response = response.as_ref().zip(elements.as_ref());
    let_move(reads, solvers, of_contact.normal_load, response)?;
    let volume_left = wear
        .volume
        .map_or(f64::INFINITY, |volume| volume - before.volume);
    let rate = wear.coefficient * before.state.cycle.dissipation;
    if wear.cycles.is_none() && rate <= 0.0 {
        let volume = wear.volume.unwrap_or(f64::INFINITY);
        return Err(RunError::WearsNoMore {
            volume,
            reached: before.volume,
        });
    }
    let remaining = landing(reads, wear, before.cycles) - before.cycles;
    let until_volume = (volume_left / rate * VOLUME_MARGIN).ceil().max(1.0);
    let coefficient = wear.coefficient;
    let next_update = NextUpdate::of(reads)?;
    let (step, fft_pairs) = solvers.work(reads, None, |joint| match wear.scheme {
        Scheme::Implicit => {
            let first = || implicit::first_proposal(joint, &before.state, coefficient);
            let proposal = before.proposal.unwrap_or_else(first).min(until_volume);
            let limits = Limits {
                tolerance: wear.tolerance,
                depth_step: wear.depth_step,
                remaining,
            };
            let step = match &next_update {
                None => implicit::advance(joint, &before.state, coefficient, proposal, limits)?,
                Some(next) => {
                    let landing = Landing::new(next.begin, wear.tolerance);
                    let reached = |joint: &mut FrettingJoint, step: &Step| {
                        let volume = joint.volume(&step.wear);
                        next.reached(joint, contact, &step.contact.pressure, volume)
                    };
                    let state = &before.state;
                    landing.advance(joint, state, coefficient, proposal, limits, reached)?
                }
            };
            Ok(Outcome {
                wear: step.wear,
                cycles: step.cycles,
                error: step.error,
                proposal: step.proposal,
                rejected: step.rejected,
                gap: Some(step.contact.gap),
                pressure: step.contact.pressure,
                shear: step.shear,
            })
        }
        Scheme::SemiImplicit => {
            let cycles = by_depth(&before.state, wear, remaining).min(remaining);
            let (worn, contact) =
                semi_implicit::advance(joint, &before.state, coefficient, cycles)?;
            Ok(Outcome {
                wear: worn,
                cycles,
                error: 0.0,
                proposal: cycles as f64,
                rejected: 0,
                gap: Some(contact.gap),
                pressure: contact.pressure,
                shear: before.state.cycle.shear.clone(),
            })
        }
        Scheme::Explicit => Ok(explicit_step(&before.state, wear, remaining)),
    })?;
    let mut outputs = Outputs::default();
    let joint = solvers.joint(reads)?;
    if wear.scheme == Scheme::Explicit && reads.wear_iteration == 1 {
        outputs
            .notices
            .extend(instability(joint, wear, &before.state, step.cycles));
    }
    let row = typed::WearStep {
        n_cycles: step.cycles as i64,
        volume: joint.volume(&step.wear) - joint.volume(&before.state.wear),
        error: step.error,
        next_n_cycles: step.proposal.min(LONGEST_PROPOSAL),
        rejected: step.rejected as i64,
        fft_pairs,
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
fn landing(reads: &Reads, wear: &Wear, cycles: u64) -> u64 {
    let asked = &reads.recipe.output.response_at;
    let next = asked.iter().copied().find(|&at| at > cycles);
    wear.cycles
        .unwrap_or(u64::MAX)
        .min(next.unwrap_or(u64::MAX))
}

struct Outcome {
    wear: Vec<f64>,
    cycles: u64,
    error: f64,
    proposal: f64,
    rejected: usize,
    gap: Option<Vec<f64>>,
    pressure: Vec<f64>,
    shear: ByAxis<Vec<f64>>,
}

/// Cycles that wear the depth of a step at the rate of its beginning.
fn by_depth(before: &WornState, wear: &Wear, remaining: u64) -> u64 {
    let deepest = wear.coefficient * before.cycle.energy.iter().fold(0.0f64, |m, e| m.max(*e));
    let depth_step = wear.depth_step.unwrap_or(f64::INFINITY);
    // A joint that does not wear would make a step without end.
    if deepest > 0.0 {
        explicit::cycles(depth_step, deepest)
    } else {
        remaining
    }
}

fn explicit_step(before: &WornState, wear: &Wear, remaining: u64) -> Outcome {
    let cycles = by_depth(before, wear, remaining);
    Outcome {
        wear: explicit::advance(&before.wear, &before.cycle.energy, wear.coefficient, cycles),
        cycles,
        error: 0.0,
        proposal: cycles as f64,
        rejected: 0,
        gap: None,
        pressure: before.pressure.clone(),
        shear: before.cycle.shear.clone(),
    }
}

/// What there is to say if the explicit step is too long to be stable.
fn instability(
    joint: &FrettingJoint,
    wear: &Wear,
    before: &WornState,
    cycles: u64,
) -> Option<String> {
    let beyond = explicit::beyond_stability(
        &before.cycle.slip_path,
        &before.pressure,
        joint.friction_coefficient,
        wear.coefficient,
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
