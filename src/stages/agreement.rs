//! Agreement of both scales on a response: its contact elements get the laws that the fine contact has under the motion of the response,
//! until the fine contact says the same of loads, force and energy as the elements. First between the ends of the motion, and then, where its
//! cycles are stepped, over the whole of it.

use super::RunError;
use super::computed_motion::{ElementMotion, let_move, let_move_between_ends};
use super::contact_state::{AtRest, reach_of};
use super::dynamic_response::{contact_elements, failed, resolved_in_force, response_table};
use super::solvers::{Solvers, layout};
use super::stage_inputs::StageInputs;
use crate::contact::normal::NormalOptions;
use crate::dynamics::cycle::{element_cycles, half_range, joint_cycle};
use crate::dynamics::{Resolved, Sampling, Vibration};
use crate::model_update::{ContactElements, ElementParameters, EndLoads, Loading, with_energy_of};
use crate::tables::TableName;
use crate::wear::cycle::March;
use crate::wear::implicit::EndCycle;

/// What the fine contact may be off the contact elements in force and energy, relative to the larger: below this laws are left as they are.
const AGREED: f64 = 0.01;
/// What the fine contact may be off the contact elements in the loads at the ends of the motion, element by element, by their parts in the work of
/// friction. What loads vary by is a tenth of them or two, and counts in the second place: it makes of the work of friction what varies, not all.
const AGREED_LOADS: f64 = 0.02;
/// Part of a difference that a round leaves at most, if another one is to follow.
const LEFT: f64 = 0.7;
/// Relative error of the loads at the ends of a motion, of which a hundredth is asked.
const LOADS: NormalOptions = NormalOptions {
    tolerance: 1e-4,
    max_iterations: 4000,
};
/// Laws that are taken from a response, at most.
const ROUNDS: usize = 3;
/// What the fine contact may be off the contact elements in a whole cycle, in parts of the error bar of its steps: the cycle is known no better.
const OF_BAR: f64 = 0.5;
/// Samples of the cycles of elements that are held against a stepped one, and how many of them loads are compared at.
const SAMPLES: usize = 128;
const INSTANTS: usize = 8;
/// Part of what the exciter supplies that friction must take for its energy to be looked at: of a joint that all but sticks it is rounding.
const LEAST_FRICTION: f64 = 1e-3;

/// Tables of the fine contact that the stage of the response reads to compare it with its elements.
pub const TABLES: [TableName; 5] = [
    TableName::Surface,
    TableName::Reference,
    TableName::WearField,
    TableName::StaticContact,
    TableName::ContactField,
];

/// A response with its elements.
pub struct AgreedResponse<'a> {
    /// The response.
    pub resolved: Resolved<'a>,
    /// Parameters of its elements.
    pub parameters: ElementParameters,
    /// Energy of stepped cycles over that between two ends, which its elements are to have.
    pub stepped_part: f64,
}

/// What the fine contact does between the ends of a response, under the loads at rest, and what these vary by.
struct BetweenEnds {
    /// Largest of the differences to the elements in force, energy and loads, each in parts of what is agreement.
    gap: f64,
    /// Its loads at the ends of the motion, where they are off.
    loads: Option<EndLoads>,
    /// Its loading along the motion, where force or energy are off.
    loading: Option<Loading>,
}

/// The response `resolved` to elements of these `parameters`, and both again as often as it takes until the fine contact agrees. Where
/// elements have one law for all, they are what they are. What is left stands in the ledger, which tells it.
///
/// # Errors
/// Those of the contact solves, and of a response.
pub fn agreed<'a>(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &'a Vibration,
    begin: AgreedResponse<'a>,
) -> Result<AgreedResponse<'a>, RunError> {
    if begin.parameters.sliders.is_none() {
        return Ok(begin);
    }
    let (best, _) = rounds::<BetweenEnds>(reads, solvers, vibration, begin)?;
    let (best, over_the_cycle) = rounds::<Stepped>(reads, solvers, vibration, best)?;
    // The stage of the cycle asks for the same.
    if let Some(stepped) = over_the_cycle {
        solvers.end = Some(stepped.cycle);
    }
    Ok(best)
}

/// The laws of elements of these `parameters` under the motion that the response before had, carried on to a `compliance` of the fine contact: the next one
/// is near it, and finds them all but in agreement. Stepped cycles are to have this part of the energy of one between two ends. As they are where the fine contact
/// has no cycle of that motion.
///
/// # Errors
/// Those of the contact solves.
pub fn predicted_parameters(
    reads: &StageInputs,
    solvers: &mut Solvers,
    before: ElementMotion,
    compliance: Option<f64>,
    parameters: ElementParameters,
    stepped_part: f64,
) -> Result<ElementParameters, RunError> {
    let moved = before.of_elements(parameters.clone(), stepped_part);
    match between_ends(reads, solvers, &moved, compliance, true) {
        Ok(Some(fine)) => fine.laws_from(reads, solvers, &parameters),
        Ok(None) | Err(RunError::Cycle(_)) => Ok(parameters),
        Err(error) if error.is_not_converged() => Ok(parameters),
        Err(error) => Err(error),
    }
}

/// What the fine contact does under a response, held against its elements.
trait Compared: Sized {
    /// That of a response; none where it is not to be compared.
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError>;

    /// The largest difference to the elements, in parts of what is agreement.
    fn gap(&self) -> f64;

    /// The laws by which the elements of that response would agree.
    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError>;
}

/// Responses, each to the laws that the fine contact asks for under the one before, as long as each comes nearer; and what the fine contact does under the
/// last.
fn rounds<'a, C: Compared>(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &'a Vibration,
    begin: AgreedResponse<'a>,
) -> Result<(AgreedResponse<'a>, Option<C>), RunError> {
    let mut best = begin;
    let Some(mut fine) = C::of(reads, solvers, &best)? else {
        return Ok((best, None));
    };
    for _ in 0..ROUNDS {
        if fine.gap() <= 1.0 {
            break;
        }
        let parameters = fine.laws(reads, solvers, &best)?;
        let Some(next) = resolved_again(reads, vibration, &best, parameters)? else {
            break;
        };
        // Laws under which the fine contact has no cycle are none to take; without them it has one.
        let found = match C::of(reads, solvers, &next) {
            Ok(Some(found)) if found.gap() < fine.gap() => found,
            Ok(_) | Err(RunError::Cycle(_)) => break,
            Err(error) if error.is_not_converged() => break,
            Err(error) => return Err(error),
        };
        let goes_on = found.gap() <= LEFT * fine.gap();
        (best, fine) = (next, found);
        if !goes_on {
            break;
        }
    }
    Ok((best, Some(fine)))
}

/// The response to elements with other `parameters`, from the one at hand; none where it is not found.
fn resolved_again<'a>(
    reads: &StageInputs,
    vibration: &'a Vibration,
    last: &AgreedResponse<'a>,
    parameters: ElementParameters,
) -> Result<Option<AgreedResponse<'a>>, RunError> {
    let elements = contact_elements(reads, &parameters, last.stepped_part);
    let harmonics = last.resolved.balance.harmonics().clone();
    let start = last.resolved.resonance.in_force().start();
    match resolved_in_force(vibration, elements, Some((&harmonics, &start))) {
        Ok(resolved) => Ok(Some(AgreedResponse {
            resolved,
            parameters,
            stepped_part: last.stepped_part,
        })),
        Err(error) if error.is_not_converged() => Ok(None),
        Err(error) => Err(failed(reads, error)),
    }
}

/// What the fine contact does over a whole cycle of a response, step by step: on an orbit, and where places gain and lose much of their load,
/// laws of a line under the loads at rest do not tell it.
struct Stepped {
    /// Difference to the elements in energy or force, the larger, in parts of what may be the error of the steps.
    gap: f64,
    /// What it dissipates at each element, as samples of the elements' own cycles would tell it \[J\].
    energy: Vec<f64>,
    /// Samples of the elements' own cycles.
    sampling: Sampling,
    /// The cycle.
    cycle: EndCycle,
}

impl Compared for Stepped {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError> {
        stepped(reads, solvers, of)
    }

    fn gap(&self) -> f64 {
        self.gap
    }

    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError> {
        let displacement = &of.resolved.resonance.in_force().displacement;
        let dissipated = |parameters: &ElementParameters| -> Vec<f64> {
            let elements = contact_elements(reads, parameters, of.stepped_part);
            let cycles = element_cycles(&elements, displacement, &self.sampling);
            cycles.iter().map(|cycle| cycle.dissipated_energy).collect()
        };
        let loads = EndLoads {
            energy: dissipated(&of.parameters),
            ..extreme_loads(reads, solvers, displacement, &self.sampling)?
        };
        let laws = match loads.difference(&of.parameters) > AGREED_LOADS {
            true => loads.laws(&of.parameters),
            false => of.parameters.clone(),
        };
        Ok(with_energy_of(&self.energy, &laws, dissipated))
    }
}

/// The cycle of the fine contact under a response whose cycles are stepped; none of one that goes to and fro between two ends, or where the
/// cells do not move with the elements.
fn stepped(
    reads: &StageInputs,
    solvers: &mut Solvers,
    of: &AgreedResponse<'_>,
) -> Result<Option<Stepped>, RunError> {
    let at_rest = AtRest::of(reads, solvers)?;
    let displacement = &of.resolved.resonance.in_force().displacement;
    let elements = contact_elements(reads, &of.parameters, of.stepped_part);
    let harmonics = of.resolved.balance.harmonics().clone();
    let sampling = Sampling::new(
        harmonics,
        SAMPLES.max(of.resolved.balance.sampling().samples()),
    )
    .map_err(|error| failed(reads, error))?;
    let own = joint_cycle(&elements, displacement, &sampling, &layout(reads).centres)
        .map_err(|error| failed(reads, error))?;
    let response = response_table(&reads.recipe, &of.resolved.balance, &of.resolved.resonance);
    let moved = ElementMotion::new(response, of.parameters.clone(), of.stepped_part);
    let_move(reads, solvers, at_rest.contact.load, Some(&moved), None)?;
    let joint = solvers.joint(reads)?;
    if joint.march != March::Stepped || joint.motion.own.is_none() {
        return Ok(None);
    }
    let motion = joint.motion.clone();
    let (cycle, fft_pairs) = solvers.work(reads, None, |joint| {
        Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
    })?;
    let force = half_range(own.force_along.iter().copied());
    let mut gap = off(cycle.force_along(), force);
    // The balance has its elements' friction in closed form, which samples miss a little of.
    let balance = of.resolved.resonance.in_force().energy;
    let sampled: f64 = own.dissipated_energy.iter().sum();
    let mut energy = solvers.elements(reads)?.integrals(&cycle.energy);
    if balance.friction > LEAST_FRICTION * balance.input {
        gap = gap.max(off(cycle.dissipation, balance.friction));
        let in_samples = sampled / balance.friction;
        energy.iter_mut().for_each(|energy| *energy *= in_samples);
    }
    Ok(Some(Stepped {
        gap: gap / AGREED.max(OF_BAR * cycle.relative_error()),
        energy,
        sampling,
        cycle: EndCycle {
            motion,
            wear: at_rest.wear,
            pressure: at_rest.contact.pressure,
            start: at_rest.start,
            cycle,
            fft_pairs,
        },
    }))
}

/// What the fine contact bears at each element where the element comes closest in a cycle, and where it opens most, among some instants of the
/// `displacement`.
fn extreme_loads(
    reads: &StageInputs,
    solvers: &mut Solvers,
    displacement: &[f64],
    sampling: &Sampling,
) -> Result<EndLoads, RunError> {
    let at_rest = AtRest::of(reads, solvers)?;
    let elements = solvers.elements(reads)?;
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    let rows = rows.take(elements.len());
    let along_normal: Vec<Vec<f64>> = rows
        .map(|row| sampling.synthesise(row).iter().map(|u| u[2]).collect())
        .collect();
    let instants = (0..INSTANTS).map(|k| k * sampling.samples() / INSTANTS);
    let approach: Vec<Vec<f64>> = instants
        .map(|k| {
            along_normal
                .iter()
                .map(|of_element| of_element[k])
                .collect()
        })
        .collect();
    let fields = approach.iter().map(|of| of_cells(&elements, of)).collect();
    let (pressures, _) = solvers.work(reads, None, |joint| {
        Ok(joint.pressures_by_place(&at_rest.contact, fields, LOADS)?)
    })?;
    let load: Vec<Vec<f64>> = pressures.iter().map(|p| elements.loads(p)).collect();
    let mut ends = EndLoads {
        approach: [Vec::new(), Vec::new()],
        load: [Vec::new(), Vec::new()],
        energy: Vec::new(),
    };
    for element in 0..elements.len() {
        let by_approach =
            |a: &usize, b: &usize| approach[*a][element].total_cmp(&approach[*b][element]);
        let extremes = [
            (0..INSTANTS).max_by(by_approach),
            (0..INSTANTS).min_by(by_approach),
        ];
        for (end, instant) in extremes.into_iter().flatten().enumerate() {
            ends.approach[end].push(approach[instant][element]);
            ends.load[end].push(load[instant][element]);
        }
    }
    Ok(ends)
}

impl Compared for BetweenEnds {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError> {
        let AgreedResponse {
            resolved,
            parameters,
            stepped_part,
        } = of;
        let response = response_table(&reads.recipe, &resolved.balance, &resolved.resonance);
        let moved = ElementMotion::new(response, parameters.clone(), *stepped_part);
        let energy = resolved.resonance.in_force().energy;
        let dissipates = energy.friction > LEAST_FRICTION * energy.input;
        between_ends(reads, solvers, &moved, None, dissipates)
    }

    fn gap(&self) -> f64 {
        self.gap
    }

    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        of: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError> {
        self.laws_from(reads, solvers, &of.parameters)
    }
}

impl BetweenEnds {
    /// The laws by which elements of these `parameters` would agree under the same motion.
    fn laws_from(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        parameters: &ElementParameters,
    ) -> Result<ElementParameters, RunError> {
        let mu = solvers.joint(reads)?.friction_coefficient;
        let loading = self.loading.as_ref();
        let parameters = loading.map_or(parameters.clone(), |of| of.laws(parameters, mu));
        Ok(match &self.loads {
            Some(loads) => loads.laws(&parameters),
            None => parameters,
        })
    }
}

/// The fine contact between the ends of a response, as it is at a `compliance` of the fine contact; none where elements have no laws of their own.
fn between_ends(
    reads: &StageInputs,
    solvers: &mut Solvers,
    moved: &ElementMotion,
    compliance: Option<f64>,
    dissipates: bool,
) -> Result<Option<BetweenEnds>, RunError> {
    let at_rest = AtRest::of(reads, solvers)?;
    let load = at_rest.contact.load;
    let work = let_move_between_ends(reads, solvers, load, moved, compliance)?;
    let Some(work) = work else {
        return Ok(None);
    };
    let parameters = moved.parameters();
    let (wear, contact, start) = (&at_rest.wear, &at_rest.contact, at_rest.start());
    let elements = solvers.elements(reads)?;
    let fields = work.approach.each_ref();
    let fields = fields.map(|of_elements| of_cells(&elements, of_elements));
    // Both under the loads at rest: what the variation of loads makes of force and work is no matter of the laws along the joint.
    let (fine, _) = solvers.work(reads, None, |joint| {
        let cycle = joint.cycle(wear, contact, start)?;
        let part = moved.stepped_part();
        let mut gap = off(part * cycle.force_along(), work.force_along);
        if dissipates {
            gap = gap.max(off(part * cycle.dissipation, work.energy.iter().sum()));
        }
        let loading = match gap > AGREED {
            true => {
                let reach = reach_of(&elements, &joint.motion);
                let parts = Loading::parts(parameters, &reach, joint.friction_coefficient);
                let shear = joint.loading(contact, &parts)?;
                Some(Loading::new(&elements, reach, parts, &shear))
            }
            false => None,
        };
        let pressures = joint.pressures_by_place(contact, fields.into(), LOADS)?;
        let loads = EndLoads {
            approach: work.approach,
            load: [0, 1].map(|end| elements.loads(&pressures[end])),
            energy: work.energy,
        };
        let off_loads = loads.difference(parameters);
        Ok(BetweenEnds {
            gap: (gap / AGREED).max(off_loads / AGREED_LOADS),
            loads: (off_loads > AGREED_LOADS).then_some(loads),
            loading,
        })
    })?;
    Ok(Some(fine))
}

/// What a figure of the fine contact is off that of the elements, in parts of the larger.
fn off(fine: f64, elements: f64) -> f64 {
    (fine - elements).abs() / fine.max(elements).max(f64::MIN_POSITIVE)
}

/// What the elements do on the cells between their nodes; nothing where elements are faces.
fn of_cells(elements: &ContactElements, of_elements: &[f64]) -> Vec<f64> {
    let mut field = vec![0.0; elements.patch().grid.len()];
    if let Some(nodes) = elements.nodes() {
        let mut values = vec![0.0; nodes.interpolation.nodes()];
        for (&node, value) in nodes.numbers.iter().zip(of_elements) {
            values[node] = *value;
        }
        nodes.interpolation.add(1.0, &values, &mut field);
    }
    field
}
