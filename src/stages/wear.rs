//! The wear step from one committed iteration to the next.

use super::context::{Context, Keys, gather, kept, kept_cells, put};
use super::model_update::Coming;
use super::state::Committed;
use super::static_contact::Predicted;
use super::vibrating::Vibrating;
use super::{RunError, Stage, static_contact};
use crate::grid::ByAxis;
use crate::recipe::Wear;
use crate::store::{Draft, StageKey};
use crate::tables::typed;
use crate::wear::implicit::{self, Limits, Step};
use crate::wear::joint::Scheme;
use crate::wear::joint::WornState;
use crate::wear::landing::Landing;
use crate::wear::{FrettingJoint, explicit, semi_implicit};

/// Proposals are written to a table, which holds no infinity: a joint that does not wear proposes this.
const LONGEST_PROPOSAL: f64 = 1e18;

/// A step shorter than what is left of the volume by this factor does not pass the volume asked for, since the rate of
/// wear may still grow in running-in.
const VOLUME_MARGIN: f64 = 0.98;

/// The step that led to an iteration.
pub struct Worn {
    pub wear: Vec<f64>,
    pub n_cycles: u64,
    pub volume: f64,
    pub error: f64,
    pub fft_pairs: f64,
    /// The contact it predicts; none where later stages have replaced it already.
    pub predicted: Option<Predicted>,
}

/// No wear yet.
pub fn unworn(context: &Context, draft: &mut Draft, keys: &Keys) -> Result<Worn, RunError> {
    let wear = vec![0.0; context.joint.patch.grid.len()];
    if context.inputs.recipe.wear.is_some() {
        let none = typed::WearStep::default();
        put_step(context, draft, &keys.static_contact, &wear, &none)?;
    }
    Ok(Worn {
        wear,
        n_cycles: 0,
        volume: 0.0,
        error: 0.0,
        fft_pairs: 0.0,
        predicted: None,
    })
}

/// Makes the step, or takes it from the draft.
pub fn wear(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    key: &StageKey,
    wear: &Wear,
    vibrating: Option<&Vibrating>,
    before: &Committed,
) -> Result<Worn, RunError> {
    if let Some(worn) = resume(context, draft, keys, key, before)? {
        return Ok(worn);
    }
    let volume_left = wear
        .volume
        .map_or(f64::INFINITY, |volume| volume - before.volume);
    let rate = wear.coefficient * before.worn.cycle.dissipation;
    if wear.cycles.is_none() && rate <= 0.0 {
        let volume = wear.volume.unwrap_or(f64::INFINITY);
        return Err(RunError::WearsNoMore {
            volume,
            reached: before.volume,
        });
    }
    let remaining = landing(context, wear, before.cycles) - before.cycles;
    let until_volume = (volume_left / rate * VOLUME_MARGIN).ceil().max(1.0);
    let coefficient = wear.coefficient;
    let coming = Coming::of(&context.inputs.recipe, vibrating, before)?;
    let contact = context.inputs.recipe.contact();
    let (step, fft_pairs) = context.timed(Stage::Wear, |joint| match wear.scheme {
        Scheme::Implicit => {
            let first = || implicit::first_proposal(joint, &before.worn, coefficient);
            let proposal = before.proposal.unwrap_or_else(first).min(until_volume);
            let limits = Limits {
                tolerance: wear.tolerance,
                depth_step: wear.depth_step,
                remaining,
            };
            let step = match &coming {
                None => implicit::advance(joint, &before.worn, coefficient, proposal, limits)?,
                Some(coming) => {
                    let landing = Landing::new(coming.begin, wear.tolerance);
                    let reached = |joint: &mut FrettingJoint, step: &Step| {
                        let volume = joint.volume(&step.wear);
                        coming.reached(joint, contact, &step.contact.pressure, volume)
                    };
                    let state = &before.worn;
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
            let cycles = by_depth(&before.worn, wear, remaining).min(remaining);
            let (worn, contact) = semi_implicit::advance(joint, &before.worn, coefficient, cycles)?;
            Ok(Outcome {
                wear: worn,
                cycles,
                error: 0.0,
                proposal: cycles as f64,
                rejected: 0,
                gap: Some(contact.gap),
                pressure: contact.pressure,
                shear: before.worn.cycle.shear.clone(),
            })
        }
        Scheme::Explicit => Ok(explicit_step(&before.worn, wear, remaining)),
    })?;
    if wear.scheme == Scheme::Explicit && context.clock.wear_iteration == 1 {
        warn_of_instability(context, wear, before, step.cycles);
    }
    let volume = context.joint.volume(&step.wear) - context.joint.volume(&before.worn.wear);
    let gap = step.gap.unwrap_or_else(|| vec![0.0; step.wear.len()]);
    let predicted = Predicted {
        gap,
        pressure: step.pressure,
        shear: step.shear,
    };
    // The prediction goes first: with the wear field in the draft, the later stages have what they start from.
    put(draft, key, &predicted.table(&context.joint.patch))?;
    let row = typed::WearStep {
        n_cycles: step.cycles as i64,
        volume,
        error: step.error,
        next_n_cycles: step.proposal.min(LONGEST_PROPOSAL),
        rejected: step.rejected as i64,
        fft_pairs,
    };
    put_step(context, draft, key, &step.wear, &row)?;
    Ok(Worn {
        wear: step.wear,
        n_cycles: step.cycles,
        volume,
        error: step.error,
        fft_pairs,
        predicted: Some(predicted),
    })
}

/// The cycles that a step from `cycles` must not pass: the end, or where a response is asked for.
fn landing(context: &Context, wear: &Wear, cycles: u64) -> u64 {
    let asked = &context.inputs.recipe.output.response_at;
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

/// Says once a run if the explicit step is too long to be stable.
fn warn_of_instability(context: &Context, wear: &Wear, before: &Committed, cycles: u64) {
    let beyond = explicit::beyond_stability(
        &before.worn.cycle.slip_path,
        &before.worn.pressure,
        context.joint.friction_coefficient,
        wear.coefficient,
        cycles,
        context.joint.half_space.self_compliance(),
    );
    if beyond > 1.0 {
        context.clock.observer.notice(&format!(
            "wear.depth_step: the first explicit step is {beyond:.1} times as long as is stable; contact area will be \
             wrong, and with a much too long step volume too; make wear.depth_step smaller or wear.scheme \"implicit\""
        ));
    }
}

/// Writes the wear and the step that led to it.
fn put_step(
    context: &Context,
    draft: &mut Draft,
    key: &StageKey,
    wear: &[f64],
    step: &typed::WearStep,
) -> Result<(), RunError> {
    let patch = &context.joint.patch;
    let (i, j) = kept_cells(patch);
    let wear_depth = gather(patch, wear);
    put(draft, key, &typed::WearField { i, j, wear_depth })?;
    put(draft, key, step)
}

/// The step as an earlier start left it, if the contact that it predicts, or what replaced it, is there too.
fn resume(
    context: &mut Context,
    draft: &mut Draft,
    keys: &Keys,
    key: &StageKey,
    before: &Committed,
) -> Result<Option<Worn>, RunError> {
    let field = kept::<typed::WearField>(draft, key)?;
    let step = kept::<typed::WearStep>(draft, key)?;
    let (Some(field), Some(step)) = (field, step) else {
        return Ok(None);
    };
    let n_cycles = step.n_cycles as u64;
    context.reach(before.cycles + n_cycles, before.volume + step.volume);
    let predicted = match kept(draft, key)? {
        Some(table) => Some(Predicted::of(context, &table)),
        // Anything less than the whole static contact would have to be computed from the prediction again.
        None if static_contact::resume(context, draft, keys)?.is_none() => return Ok(None),
        None => None,
    };
    Ok(Some(Worn {
        wear: context.field(&field.wear_depth),
        n_cycles,
        volume: step.volume,
        error: step.error,
        fft_pairs: step.fft_pairs,
        predicted,
    }))
}
