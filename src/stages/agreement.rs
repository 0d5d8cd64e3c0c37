//! Agreement of both scales on a response: its contact elements get the laws that the fine contact has under the motion of the response,
//! until the fine contact says the same of loads, force and energy as the elements.

use super::RunError;
use super::contact_state::{
    ElementMotion, Fields, let_move_between_ends, on_axes, reach_of, solution_of, wear_of,
};
use super::dynamic_response::{contact_elements, failed, harmonic_tolerance, response_table};
use super::reads::Reads;
use super::solvers::Solvers;
use crate::contact::normal::NormalOptions;
use crate::dynamics::{Resolved, Vibration};
use crate::model_update::{ContactElements, ElementParameters, EndLoads, Loading};
use crate::tables::{TableName, typed};

/// What the fine contact may be off the contact elements in force and energy, relative to the larger: below this laws are left as they are.
const AGREED: f64 = 0.01;
/// The same of loads at the ends of the motion, element by element, by their parts in the work of friction. What loads vary by is a tenth of them
/// or two, and counts in the second place: it makes of the work of friction what varies, not all of it.
const AGREED_LOADS: f64 = 0.02;
/// Part of a difference that a round leaves at most, if another one is to follow.
const LEFT: f64 = 0.8;
/// Relative error of the loads at the ends of a motion, of which a hundredth is asked.
const LOADS: NormalOptions = NormalOptions {
    tolerance: 1e-4,
    max_iterations: 4000,
};
/// Laws that are taken from a response, at most.
const ROUNDS: usize = 3;
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
pub struct Agreed<'a> {
    /// The response.
    pub resolved: Resolved<'a>,
    /// Parameters of its elements.
    pub parameters: ElementParameters,
}

/// What the fine contact does under a response.
struct Fine {
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
    reads: &Reads,
    solvers: &mut Solvers,
    vibration: &'a Vibration,
    begin: Agreed<'a>,
) -> Result<Agreed<'a>, RunError> {
    let mut best = begin;
    let has_laws = best.parameters.sliders.is_some();
    let fine = has_laws
        .then(|| compared(reads, solvers, &best))
        .transpose()?;
    let Some(mut fine) = fine.flatten() else {
        return Ok(best);
    };
    for _ in 0..ROUNDS {
        if fine.gap <= 1.0 {
            return Ok(best);
        }
        let mut parameters = best.parameters.clone();
        if let Some(loading) = fine.loading.take() {
            let mu = solvers.joint(reads)?.friction_coefficient;
            parameters = loading.laws(&parameters, mu);
        }
        if let Some(loads) = fine.loads.take() {
            parameters = loads.laws(&parameters);
        }
        let elements = contact_elements(reads, &parameters);
        let harmonics = best.resolved.balance.harmonics().clone();
        let start = best.resolved.resonance.in_force().start();
        let tolerance = harmonic_tolerance(&reads.recipe);
        let start = Some((&harmonics, &start));
        let resolved = match vibration.resolve_in_force(elements, start, tolerance) {
            Ok(resolved) => resolved,
            Err(error) if error.is_not_converged() => break,
            Err(error) => return Err(failed(reads, error)),
        };
        let next = Agreed {
            resolved,
            parameters,
        };
        let found = match compared(reads, solvers, &next)? {
            Some(found) if found.gap < fine.gap => found,
            _ => break,
        };
        let goes_on = found.gap <= LEFT * fine.gap;
        (best, fine) = (next, found);
        if !goes_on {
            break;
        }
    }
    Ok(best)
}

/// The fine contact between the ends of the response; none where elements have no laws of their own.
fn compared(
    reads: &Reads,
    solvers: &mut Solvers,
    of: &Agreed<'_>,
) -> Result<Option<Fine>, RunError> {
    let Agreed {
        resolved,
        parameters,
    } = of;
    let row: typed::StaticContact = reads.table()?;
    let response = response_table(&reads.recipe, &resolved.balance, &resolved.resonance);
    let moved = ElementMotion::new(response, parameters.clone());
    let Some(work) = let_move_between_ends(reads, solvers, row.normal_load, &moved)? else {
        return Ok(None);
    };
    let patch = solvers.joint(reads)?.patch.clone();
    let wear = wear_of(&patch, reads.maybe()?);
    let mut fields = Fields::of(&patch, &reads.table()?);
    let start = on_axes(&reads.recipe, &patch, std::mem::take(&mut fields.shear));
    let start = (!start.is_empty()).then_some(&start);
    let contact = solution_of(&row, fields);
    let elements = solvers.elements(reads)?;
    let fields = work.approach.each_ref();
    let fields = fields.map(|of_elements| of_cells(&elements, of_elements));
    // Both under the loads at rest: what the variation of loads makes of force and work is no matter of the laws along the joint.
    let energy = resolved.resonance.in_force().energy;
    let (fine, _) = solvers.work(reads, None, |joint| {
        let cycle = joint.cycle(&wear, &contact, start)?;
        let off = |fine: f64, elements: f64| {
            (fine - elements).abs() / fine.max(elements).max(f64::MIN_POSITIVE)
        };
        let mut gap = off(cycle.force_along(), work.force_along);
        if energy.friction > LEAST_FRICTION * energy.input {
            gap = gap.max(off(cycle.dissipation, work.energy.iter().sum()));
        }
        let loading = match gap > AGREED {
            true => {
                let reach = reach_of(&elements, &joint.motion);
                let parts = Loading::parts(parameters, &reach, joint.friction_coefficient);
                let shear = joint.loading(&contact, &parts)?;
                Some(Loading::new(&elements, reach, parts, &shear))
            }
            false => None,
        };
        let pressures = joint.pressures_by_place(&contact, fields.into(), LOADS)?;
        let loads = EndLoads {
            approach: work.approach,
            load: [0, 1].map(|end| elements.loads(&pressures[end])),
            energy: work.energy,
        };
        let off_loads = loads.difference(parameters);
        Ok(Fine {
            gap: (gap / AGREED).max(off_loads / AGREED_LOADS),
            loads: (off_loads > AGREED_LOADS).then_some(loads),
            loading,
        })
    })?;
    Ok(Some(fine))
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
