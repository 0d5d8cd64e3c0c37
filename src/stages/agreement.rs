//! Agreement of the fine contact and the contact elements on a response. The stage computes the laws of the fine
//! contact under the motion of the response, and assigns the laws to the contact elements. The stage repeats the
//! computation and the assignment until loads, force and energy agree. The comparison first uses a cycle between the
//! ends of the motion. If the scene steps the cycles, the comparison then uses the whole cycle.

use super::RunError;
use super::computed_motion::{ElementMotion, set_motion, set_motion_between_ends};
use super::contact_state::{StaticState, reach_of};
use super::dynamic_response::{
    contact_elements, dynamics_error, resolved_in_force, response_table,
};
use super::solvers::{Solvers, element_layout};
use super::stage_inputs::StageInputs;
use crate::contact::normal::NormalOptions;
use crate::dynamics::cycle::{element_cycles, half_range, joint_cycle};
use crate::dynamics::{ResolvedResonance, Sampling, Vibration};
use crate::model_update::{
    ContactElements, ElementParameters, EndLoads, Loading, match_dissipation,
};
use crate::tables::TableName;
use crate::wear::cycle::March;
use crate::wear::implicit::EndCycle;

/// Tolerance of force and energy, relative to the larger value. The stage does not change the laws of the elements if
/// the differences of force and energy are below `TOLERANCE`.
const TOLERANCE: f64 = 0.01;
/// Tolerance of the loads at the ends of the motion, per element, weighted by the work of friction. The tolerance of
/// the loads is looser than [`TOLERANCE`], because loads vary by only 10 to 20 %. The loads change only part of the
/// work of friction.
const AGREED_LOADS: f64 = 0.02;
/// A further round follows only if the last round reduces the difference to at most 0.7 of the previous difference.
const LEAST_REDUCTION: f64 = 0.7;
/// Options of the solves for the loads at the ends of a motion. The comparison needs an accuracy of about 1 %.
const LOAD_OPTIONS: NormalOptions = NormalOptions {
    tolerance: 1e-4,
    max_iterations: 4000,
};
/// Largest number of rounds, each with new laws.
const ROUNDS: usize = 3;
/// Tolerance of a whole cycle, as a fraction of the error bar of the time steps. The time steps limit the accuracy of
/// the cycle.
const CYCLE_TOLERANCE: f64 = 0.5;
/// Number of samples per cycle of the elements, for the comparison with a stepped cycle. [`INSTANTS`] is the number of
/// samples at which the stage compares loads.
const SAMPLES: usize = 128;
const INSTANTS: usize = 8;
/// The comparison omits a friction energy below 1e-3 of the energy of the exciter. If the joint almost sticks, the
/// friction energy consists of rounding errors.
const LEAST_FRICTION: f64 = 1e-3;

/// Tables of the fine contact that the stage of the response reads for the comparison.
pub const TABLES: [TableName; 5] = [
    TableName::Surface,
    TableName::Reference,
    TableName::WearField,
    TableName::StaticContact,
    TableName::ContactField,
];

/// Response of the joint, and the contact elements with which the solver computed the response.
pub struct AgreedResponse<'a> {
    /// The response.
    pub resolved: ResolvedResonance<'a>,
    /// Parameters of the contact elements.
    pub parameters: ElementParameters,
    /// Energy of a stepped cycle, divided by the energy of a reversal cycle. The ratio of both energies corrects the
    /// friction of the contact elements.
    pub stepped_part: f64,
}

/// Comparison of the fine contact with the elements, for a motion between the ends of a response. The comparison uses
/// the loads at rest, and compares the variation of the loads.
struct BetweenEnds {
    /// Largest difference of force, energy and loads between the fine contact and the elements, relative to the
    /// tolerance of each.
    gap: f64,
    /// Loads of the fine contact at the ends of the motion, if they exceed their tolerance.
    loads: Option<EndLoads>,
    /// Loading of the fine contact along the motion, if force or energy exceed their tolerance.
    loading: Option<Loading>,
}

/// Iterates the laws of the contact elements and the response of the joint until the elements agree with the fine
/// contact. The function does not change elements that share one law. The ledger reports the remaining difference.
///
/// # Errors
/// Errors of the contact solves and of the response.
pub fn agree<'a>(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &'a Vibration,
    initial: AgreedResponse<'a>,
) -> Result<AgreedResponse<'a>, RunError> {
    if initial.parameters.sliders.is_none() {
        return Ok(initial);
    }
    let (best, _) = iterate_laws::<BetweenEnds>(reads, solvers, vibration, initial)?;
    let (best, comparison) = iterate_laws::<SteppedComparison>(reads, solvers, vibration, best)?;
    // The stage of the fretting cycle needs the same cycle.
    if let Some(comparison) = comparison {
        solvers.end = Some(comparison.cycle);
    }
    Ok(best)
}

/// Returns the laws of the elements under the previous motion, extrapolated to a `compliance` of the fine contact. The
/// next response is close to the extrapolated motion, so the returned laws nearly agree with the fine contact. The
/// factor `stepped_part` corrects the friction of the elements. Returns `parameters` unchanged if the solver finds no
/// cycle of the fine contact under the extrapolated motion.
///
/// # Errors
/// Errors of the contact solves.
pub fn predicted_parameters(
    reads: &StageInputs,
    solvers: &mut Solvers,
    before: ElementMotion,
    compliance: Option<f64>,
    parameters: ElementParameters,
    stepped_part: f64,
) -> Result<ElementParameters, RunError> {
    let motion = before.with_elements(parameters.clone(), stepped_part);
    match compare_between_ends(reads, solvers, &motion, compliance, true) {
        Ok(Some(fine)) => fine.laws_from(reads, solvers, &parameters),
        Ok(None) | Err(RunError::Cycle(_)) => Ok(parameters),
        Err(error) if error.is_not_converged() => Ok(parameters),
        Err(error) => Err(error),
    }
}

/// Comparison of the fine contact with the contact elements under a response.
trait Comparison: Sized {
    /// Compares the fine contact with the elements of a response; `None` if the comparison does not apply.
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError>;

    /// Returns the largest difference between the fine contact and the elements, relative to the tolerance of the
    /// difference.
    fn gap(&self) -> f64;

    /// Corrects the laws of the response `current` such that the contact elements agree with the fine contact. Returns
    /// the corrected laws.
    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError>;
}

/// Alternates between new laws and new responses as long as the agreement improves. Returns the best response, and the
/// comparison of the best response with the fine contact.
fn iterate_laws<'a, C: Comparison>(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &'a Vibration,
    initial: AgreedResponse<'a>,
) -> Result<(AgreedResponse<'a>, Option<C>), RunError> {
    let mut best = initial;
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
        // Rejects laws under which the fine contact has no cycle. The previous laws have one.
        let next_fine = match C::of(reads, solvers, &next) {
            Ok(Some(next_fine)) if next_fine.gap() < fine.gap() => next_fine,
            Ok(_) | Err(RunError::Cycle(_)) => break,
            Err(error) if error.is_not_converged() => break,
            Err(error) => return Err(error),
        };
        let improves = next_fine.gap() <= LEAST_REDUCTION * fine.gap();
        (best, fine) = (next, next_fine);
        if !improves {
            break;
        }
    }
    Ok((best, Some(fine)))
}

/// Solves the response to elements with other `parameters`, starting from the response `last`. Returns `None` if the
/// solver does not converge.
fn resolved_again<'a>(
    reads: &StageInputs,
    vibration: &'a Vibration,
    last: &AgreedResponse<'a>,
    parameters: ElementParameters,
) -> Result<Option<AgreedResponse<'a>>, RunError> {
    let elements = contact_elements(reads, &parameters, last.stepped_part);
    let harmonics = last.resolved.balance.harmonics().clone();
    let start = last.resolved.resonance.governing().start();
    match resolved_in_force(vibration, elements, Some((&harmonics, &start))) {
        Ok(resolved) => Ok(Some(AgreedResponse {
            resolved,
            parameters,
            stepped_part: last.stepped_part,
        })),
        Err(error) if error.is_not_converged() => Ok(None),
        Err(error) => Err(dynamics_error(reads, error)),
    }
}

/// Comparison over a whole stepped cycle. The laws of a straight motion under the loads at rest are insufficient for an
/// orbit. The laws are also insufficient if the local loads vary strongly.
struct SteppedComparison {
    /// Largest difference from the elements in energy or force, relative to the tolerance.
    gap: f64,
    /// Energy that the fine contact dissipates at each element, scaled to the sampling of the elements' cycles \[J\].
    energy: Vec<f64>,
    /// Sampling of the elements' cycles.
    sampling: Sampling,
    /// The stepped cycle.
    cycle: EndCycle,
}

impl Comparison for SteppedComparison {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError> {
        compare_stepped(reads, solvers, current)
    }

    fn gap(&self) -> f64 {
        self.gap
    }

    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError> {
        let displacement = &current.resolved.resonance.governing().displacement;
        let element_energies = |parameters: &ElementParameters| -> Vec<f64> {
            let elements = contact_elements(reads, parameters, current.stepped_part);
            let cycles = element_cycles(&elements, displacement, &self.sampling);
            cycles.iter().map(|cycle| cycle.dissipated_energy).collect()
        };
        let loads = EndLoads {
            energy: element_energies(&current.parameters),
            ..extreme_loads(reads, solvers, displacement, &self.sampling)?
        };
        let laws = match loads.difference(&current.parameters) > AGREED_LOADS {
            true => loads.laws(&current.parameters),
            false => current.parameters.clone(),
        };
        Ok(match_dissipation(&self.energy, &laws, element_energies))
    }
}

/// Computes the cycle of the fine contact under a response with stepped cycles. Returns `None` for a motion that is
/// marched between its ends, or if the cells do not move with the elements.
fn compare_stepped(
    reads: &StageInputs,
    solvers: &mut Solvers,
    current: &AgreedResponse<'_>,
) -> Result<Option<SteppedComparison>, RunError> {
    let at_rest = StaticState::of(reads, solvers)?;
    let displacement = &current.resolved.resonance.governing().displacement;
    let elements = contact_elements(reads, &current.parameters, current.stepped_part);
    let harmonics = current.resolved.balance.harmonics().clone();
    let sampling = Sampling::new(
        harmonics,
        SAMPLES.max(current.resolved.balance.sampling().samples()),
    )
    .map_err(|error| dynamics_error(reads, error))?;
    let element_cycle = joint_cycle(
        &elements,
        displacement,
        &sampling,
        &element_layout(reads).centres,
    )
    .map_err(|error| dynamics_error(reads, error))?;
    let response = response_table(
        &reads.recipe,
        &current.resolved.balance,
        &current.resolved.resonance,
    );
    let element_motion =
        ElementMotion::new(response, current.parameters.clone(), current.stepped_part);
    set_motion(
        reads,
        solvers,
        at_rest.contact.load,
        Some(&element_motion),
        None,
    )?;
    let joint = solvers.joint(reads)?;
    if joint.march != March::Stepped || joint.motion.nodal_motion.is_none() {
        return Ok(None);
    }
    let motion = joint.motion.clone();
    let (cycle, fft_pairs) = solvers.timed(reads, None, |joint| {
        Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
    })?;
    let force = half_range(element_cycle.force_along.iter().copied());
    let mut gap = relative_gap(cycle.force_along(), force);
    // The balance computes the friction of its elements in closed form, and the samples miss a small part of it.
    let balance = current.resolved.resonance.governing().energy;
    let sampled: f64 = element_cycle.dissipated_energy.iter().sum();
    let mut energy = solvers.elements(reads)?.integrals(&cycle.energy);
    if balance.friction > LEAST_FRICTION * balance.load_work {
        gap = gap.max(relative_gap(cycle.dissipation, balance.friction));
        let sampling_ratio = sampled / balance.friction;
        energy
            .iter_mut()
            .for_each(|energy| *energy *= sampling_ratio);
    }
    Ok(Some(SteppedComparison {
        gap: gap / TOLERANCE.max(CYCLE_TOLERANCE * cycle.relative_error()),
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

/// Returns two loads of the fine contact at each element. The first load occurs at the largest approach of the element,
/// and the second load at the largest opening. The search for both loads covers only [`INSTANTS`] instants of the
/// `displacement`.
fn extreme_loads(
    reads: &StageInputs,
    solvers: &mut Solvers,
    displacement: &[f64],
    sampling: &Sampling,
) -> Result<EndLoads, RunError> {
    let at_rest = StaticState::of(reads, solvers)?;
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
    let fields = approach
        .iter()
        .map(|values| nodal_field(&elements, values))
        .collect();
    let (pressures, _) = solvers.timed(reads, None, |joint| {
        Ok(joint.local_pressures(&at_rest.contact, fields, LOAD_OPTIONS)?)
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

impl Comparison for BetweenEnds {
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<Option<Self>, RunError> {
        let AgreedResponse {
            resolved,
            parameters,
            stepped_part,
        } = current;
        let response = response_table(&reads.recipe, &resolved.balance, &resolved.resonance);
        let motion = ElementMotion::new(response, parameters.clone(), *stepped_part);
        let energy = resolved.resonance.governing().energy;
        let dissipates = energy.friction > LEAST_FRICTION * energy.load_work;
        compare_between_ends(reads, solvers, &motion, None, dissipates)
    }

    fn gap(&self) -> f64 {
        self.gap
    }

    fn laws(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        current: &AgreedResponse<'_>,
    ) -> Result<ElementParameters, RunError> {
        self.laws_from(reads, solvers, &current.parameters)
    }
}

impl BetweenEnds {
    /// Corrects the laws in `parameters` such that the contact elements agree with the fine contact under the compared
    /// motion. Returns the corrected laws.
    fn laws_from(
        &self,
        reads: &StageInputs,
        solvers: &mut Solvers,
        parameters: &ElementParameters,
    ) -> Result<ElementParameters, RunError> {
        let mu = solvers.joint(reads)?.friction_coefficient;
        let loading = self.loading.as_ref();
        let parameters = loading.map_or(parameters.clone(), |loading| loading.laws(parameters, mu));
        Ok(match &self.loads {
            Some(loads) => loads.laws(&parameters),
            None => parameters,
        })
    }
}

/// Compares the fine contact and the elements between the ends of a response, at a `compliance` of the fine contact.
/// Returns `None` if the elements have no friction laws of their own.
fn compare_between_ends(
    reads: &StageInputs,
    solvers: &mut Solvers,
    motion: &ElementMotion,
    compliance: Option<f64>,
    dissipates: bool,
) -> Result<Option<BetweenEnds>, RunError> {
    let at_rest = StaticState::of(reads, solvers)?;
    let load = at_rest.contact.load;
    let work = set_motion_between_ends(reads, solvers, load, motion, compliance)?;
    let Some(work) = work else {
        return Ok(None);
    };
    let parameters = motion.parameters();
    let (wear, contact, start) = (&at_rest.wear, &at_rest.contact, at_rest.start());
    let elements = solvers.elements(reads)?;
    let fields = work.approach.each_ref();
    let fields = fields.map(|of_elements| nodal_field(&elements, of_elements));
    // The cycles of the fine contact and of the elements both use the loads at rest. The effect of varying loads on
    // force and work does not belong to the laws along the joint.
    let (fine, _) = solvers.timed(reads, None, |joint| {
        let cycle = joint.cycle(wear, contact, start)?;
        let stepped_part = motion.stepped_part();
        let mut gap = relative_gap(stepped_part * cycle.force_along(), work.force_along);
        if dissipates {
            gap = gap.max(relative_gap(
                stepped_part * cycle.dissipation,
                work.energy.iter().sum(),
            ));
        }
        let loading = match gap > TOLERANCE {
            true => {
                let reach = reach_of(&elements, &joint.motion);
                let parts = Loading::parts(parameters, &reach, joint.friction_coefficient);
                let shear = joint.first_loading_shear(contact, &parts)?;
                Some(Loading::new(&elements, reach, parts, &shear))
            }
            false => None,
        };
        let pressures = joint.local_pressures(contact, fields.into(), LOAD_OPTIONS)?;
        let loads = EndLoads {
            approach: work.approach,
            load: [0, 1].map(|end| elements.loads(&pressures[end])),
            energy: work.energy,
        };
        let load_gap = loads.difference(parameters);
        Ok(BetweenEnds {
            gap: (gap / TOLERANCE).max(load_gap / AGREED_LOADS),
            loads: (load_gap > AGREED_LOADS).then_some(loads),
            loading,
        })
    })?;
    Ok(Some(fine))
}

/// Returns the difference between fine contact and elements, relative to the larger value.
fn relative_gap(fine: f64, elements: f64) -> f64 {
    (fine - elements).abs() / fine.max(elements).max(f64::MIN_POSITIVE)
}

/// Interpolates nodal values of the elements to the cells; zero if the elements are faces.
fn nodal_field(elements: &ContactElements, of_elements: &[f64]) -> Vec<f64> {
    let mut field = vec![0.0; elements.patch().grid.len()];
    if let Some(nodes) = elements.nodes() {
        let mut values = vec![0.0; nodes.interpolation.nodes()];
        for (&node, value) in nodes.numbers.iter().zip(of_elements) {
            values[node] = *value;
        }
        nodes
            .interpolation
            .add_interpolated(1.0, &values, &mut field);
    }
    field
}
