//! Forced response of the worn joint over the frequency range. The forced response does not drive the wear. If the
//! scene requests a forced response of the worn joint, the stage computes the forced response.

use super::RunError;
use super::agreement::predicted_parameters;
use super::computed_motion::{ElementMotion, set_motion};
use super::contact_elements::parameters;
use super::contact_state::{StaticState, harmonics_of, parameters_of, tangential_compliance};
use super::declaration::{Declaration, joined};
use super::dynamic_response::{
    contact_elements, correction_of, dynamics_error, harmonic_tolerance, initial_guess,
    response_table,
};
use super::reduced;
use super::response_notices::warn_missing_harmonics;
use super::solvers::{Solvers, given_parameters};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::forced_response::{ForcedPoint, PointResponse, SolutionMethod};
use crate::dynamics::{
    ContactElement, DynamicsError, HarmonicBalance, Harmonics, ResolvedResonance, Resonance,
    Response, Start, Vibration,
};
use crate::model_update::ElementParameters;
use crate::recipe::Part;
use crate::tables::{TableName, typed};

/// The forced response and the resonance of a worn joint, [A §4d]. The contact elements follow from the fine contact of
/// the same iteration.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::ForcedResponse,
    when: When::Always,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::Elements,
        Part::Response,
        Part::ForcedResponse,
        Part::WearLaw,
    ],
    reads: &joined::<16>(&[
        &reduced::TABLES,
        &[
            TableName::Surface,
            TableName::Reference,
            TableName::ReferenceElement,
            TableName::StaticContact,
            TableName::ContactField,
            TableName::ModelUpdate,
            TableName::ContactElement,
            TableName::ContactSlider,
            TableName::Response,
            TableName::DynamicResponse,
            TableName::WearField,
        ],
    ]),
    before: &[],
    writes: &[
        TableName::Frf,
        TableName::FrfHarmonic,
        TableName::WornResponse,
    ],
    is_due: |moment| moment.resonance_due,
    shared: false,
    compute,
};

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let vibration = solvers.vibration(reads)?;
    // `resonance` is the phase resonance of the contact elements in `balance`, or `None` without a known resonance.
    let (balance, resonance) = match reads.optional_table::<typed::ModelUpdate>()? {
        Some(update) => {
            let parameters = worn_elements(reads, solvers, &update)?;
            let is_in_force = update.updated;
            worn_joint(
                reads,
                solvers,
                &vibration,
                &parameters,
                is_in_force,
                &mut outputs,
            )?
        }
        None => {
            let elements = contact_elements(reads, &given_parameters(reads), 1.0);
            let response = reads.optional_table::<typed::Response>()?;
            let harmonics = match &response {
                Some(response) => harmonics_of(response)?.0,
                None => vibration.harmonics.clone(),
            };
            let balance = vibration.balance_of(elements, harmonics);
            let balance = balance.map_err(|source| dynamics_error(reads, source))?;
            let row = reads.optional_table::<typed::DynamicResponse>()?;
            let phase = response.zip(row.filter(|row| row.resonance_frequency.is_some()));
            let phase = phase.map(|(response, row)| initial_guess(&response, &row));
            (balance, phase.transpose()?.map(|(_, start)| start))
        }
    };
    let stored_points = solvers.forced_response.take();
    let response = reads.recipe.response.as_ref();
    let has_range = response.is_some_and(|response| response.frequency.is_some());
    if has_range && reads.forced_response_due {
        let resonance = resonance.as_ref();
        forced_response(
            reads,
            &vibration,
            balance,
            resonance,
            stored_points,
            &mut outputs,
        )?;
    }
    Ok(outputs)
}

/// Returns the contact elements of a worn joint. After an update, the worn joint has the current contact elements.
/// Without an update, the contact elements follow from the fine contact under the current motion.
pub fn worn_elements(
    reads: &StageInputs,
    solvers: &mut Solvers,
    update: &typed::ModelUpdate,
) -> Result<ElementParameters, RunError> {
    if update.updated {
        return Ok(parameters_of(&reads.table()?, reads.optional_table()?));
    }
    let contact: typed::StaticContact = reads.table()?;
    let (element_parameters, _) = parameters(reads, solvers, &contact, &reads.table()?)?;
    match ElementMotion::of(reads)?.filter(ElementMotion::has_laws) {
        Some(motion) => {
            let compliance = tangential_compliance(&contact);
            let compliance = compliance.filter(|_| update.fine_compliance.is_some());
            let stepped_part = motion.stepped_part();
            predicted_parameters(
                reads,
                solvers,
                motion,
                compliance,
                element_parameters,
                stepped_part,
            )
        }
        None => Ok(element_parameters),
    }
}

/// Solves the worn joint, starting from the current response, and writes the resonance of the worn joint as a table. A
/// lost resonance gives a notice and no table.
fn worn_joint(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &Vibration,
    parameters: &ElementParameters,
    is_in_force: bool,
    outputs: &mut Outputs,
) -> Result<(HarmonicBalance<ContactElement>, Option<Start>), RunError> {
    let failed = |source| dynamics_error(reads, source);
    let (response, in_force): (typed::Response, typed::DynamicResponse) =
        (reads.table()?, reads.table()?);
    let (harmonics, start) = initial_guess(&response, &in_force)?;
    let stepped_part = in_force.stepped_part.unwrap_or(1.0);
    let elements = contact_elements(reads, parameters, stepped_part);
    let wears = reads.recipe.wear.is_some();
    if is_in_force {
        outputs.add_table(&typed::WornResponse {
            fine_energy: wears.then_some(in_force.friction_energy),
            ..row_in_force(&in_force)
        })?;
        let balance = vibration.balance_of(elements, harmonics).map_err(failed)?;
        let is_phase = in_force.resonance_frequency.is_some();
        return Ok((balance, is_phase.then_some(start)));
    }
    let resolved = vibration.resolve_governing_response(elements, Some((&harmonics, &start)));
    let resolved = resolved.map_err(failed)?;
    let tolerance = harmonic_tolerance(&reads.recipe);
    let resolved = match (correction_of(&response, &in_force)?, tolerance) {
        (Some((truncation, correction)), _) => {
            resolved.with_peak_and_known_errors(truncation, correction)
        }
        (None, Some(_)) => resolved.with_peak_and_errors(tolerance, None),
        // The stage omits the errors of the peak, because no table stores the errors of the peak.
        (None, None) => resolved.with_peak(),
    };
    let resolved = resolved.map_err(failed)?;
    warn_missing_harmonics(outputs, tolerance, &resolved);
    let same_resonance = match vibration.at_omega {
        Some(_) => Ok(()),
        None => start.require_same_resonance(resolved.resonance.governing()),
    };
    match same_resonance {
        Err(lost) => outputs.notice(format!("the worn joint: {lost}")),
        Ok(()) => {
            let corrected = resolved.corrected().map_err(failed)?;
            let element_energy = corrected.resonance.governing().energy.friction;
            let fine_energy = match wears {
                true => {
                    let fine = fine_energy(reads, solvers, &corrected, parameters)?;
                    Some(fine.unwrap_or(element_energy))
                }
                false => None,
            };
            outputs.add_table(&typed::WornResponse {
                fine_energy,
                ..resonance_row(&corrected.resonance)
            })?;
        }
    }
    let phase = resolved.resonance.phase.as_ref().map(Response::start);
    Ok((resolved.balance, phase))
}

/// Returns the current response as a row of the table of worn responses.
fn row_in_force(row: &typed::DynamicResponse) -> typed::WornResponse {
    typed::WornResponse {
        resonance_frequency: row.resonance_frequency,
        resonance_amplitude: row.resonance_amplitude,
        peak_frequency: row.peak_frequency,
        peak_amplitude: row.peak_amplitude,
        input_energy: row.input_energy,
        friction_energy: row.friction_energy,
        viscous_energy: row.viscous_energy,
        hysteretic_energy: row.hysteretic_energy,
        fine_energy: None,
    }
}

/// Returns the energy per cycle that the fine contact dissipates under the response of a worn joint \[J\]. Returns
/// `None` if the response would open the joint.
fn fine_energy(
    reads: &StageInputs,
    solvers: &mut Solvers,
    resolved: &ResolvedResonance,
    parameters: &ElementParameters,
) -> Result<Option<f64>, RunError> {
    let at_rest = StaticState::of(reads, solvers)?;
    let response = response_table(&reads.recipe, &resolved.balance, &resolved.resonance);
    let in_force: typed::DynamicResponse = reads.table()?;
    let stepped_part = in_force.stepped_part.unwrap_or(1.0);
    let motion = ElementMotion::new(response, parameters.clone(), stepped_part);
    match set_motion(reads, solvers, at_rest.contact.load, Some(&motion), None) {
        Ok(_) => {
            let (cycle, _) = solvers.timed(reads, None, |joint| {
                Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
            })?;
            Ok(Some(cycle.dissipation))
        }
        Err(RunError::Cycle(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

fn resonance_row(resonance: &Resonance) -> typed::WornResponse {
    let phase = resonance.governing();
    let energy = phase.energy;
    typed::WornResponse {
        resonance_frequency: resonance.phase.as_ref().map(Response::frequency),
        resonance_amplitude: resonance.phase.as_ref().map(|_| resonance.amplitude),
        peak_frequency: resonance.peak_frequency,
        peak_amplitude: resonance.peak_amplitude,
        input_energy: energy.load_work,
        friction_energy: energy.friction,
        viscous_energy: energy.viscous,
        hysteretic_energy: energy.hysteretic,
        fine_energy: None,
    }
}

/// Writes the tables `frf` and `frf_harmonic`.
fn forced_response(
    reads: &StageInputs,
    vibration: &Vibration,
    balance: HarmonicBalance<ContactElement>,
    resonance: Option<&Start>,
    stored_points: Option<(Harmonics, Vec<ForcedPoint>)>,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    let mut harmonics = balance.harmonics().clone();
    let force = balance
        .drive()
        .map_or(0.0, |load| load.cosine.hypot(load.sine));
    let stored_points = stored_points.filter(|(stored, _)| *stored == harmonics);
    let mut points = match stored_points {
        Some((_, points)) => Ok(points),
        None => solve_points(reads, vibration, &balance, resonance),
    };
    let has_branch = match &points {
        Ok(points) => points.iter().any(|p| p.found_by == SolutionMethod::Balance),
        Err(error) => !error.is_not_converged(),
    };
    if !has_branch && harmonics != vibration.harmonics {
        // No branch starts with the extended harmonics of the resonance. The harmonics of the scene may give one.
        harmonics = vibration.harmonics.clone();
        outputs.notice(format!(
            "forced response: using harmonics up to {}, because no branch starts with the harmonics of the resonance",
            harmonics.highest()
        ));
        let scene_balance = vibration.balance_of(balance.elements().to_vec(), harmonics.clone());
        points = scene_balance.and_then(|balance| vibration.forced_response(&balance));
        // The resonance needs more harmonics than the scene has, so the errors of the points are unknown.
        for point in points.iter_mut().flatten() {
            if let Some(response) = &mut point.response {
                (response.error, response.friction_error) = (Some(1.0), Some(1.0));
            }
        }
    }
    let points = points.map_err(|source| dynamics_error(reads, source))?;
    warn_missing_points(&points, outputs);
    put_tables(&points, force, &harmonics, outputs)
}

/// Solves the points of the forced response. If the contact elements stay unchanged, estimates the errors of the
/// points.
fn solve_points(
    reads: &StageInputs,
    vibration: &Vibration,
    balance: &HarmonicBalance<ContactElement>,
    resonance: Option<&Start>,
) -> Result<Vec<ForcedPoint>, DynamicsError> {
    let mut points = vibration.forced_response_through(balance, resonance)?;
    if reads.recipe.surface().is_none() {
        vibration.estimate_errors(balance, &mut points);
    }
    Ok(points)
}

/// Writes the tables of the points.
fn put_tables(
    points: &[ForcedPoint],
    force: f64,
    harmonics: &Harmonics,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    outputs.add_table(&harmonic_table(points, harmonics))?;
    let rows = points.iter();
    let column = |value: fn(&PointResponse) -> f64| -> Vec<Option<f64>> {
        let each = points
            .iter()
            .map(|point| point.response.as_ref().map(value));
        each.collect()
    };
    let active = |point: &ForcedPoint| {
        let response = point.response.as_ref();
        response.map_or(0, |response| response.solution.active_elements())
    };
    outputs.add_table(&typed::Frf {
        force: vec![force; points.len()],
        frequency: rows.clone().map(|p| p.frequency).collect(),
        amplitude: column(|r| r.amplitude),
        phase_lag: column(|r| r.phase_lag),
        input_energy: column(|r| r.solution.energy.load_work),
        friction_energy: column(|r| r.solution.energy.friction),
        viscous_energy: column(|r| r.solution.energy.viscous),
        hysteretic_energy: column(|r| r.solution.energy.hysteretic),
        active_elements: rows.clone().map(|p| active(p) as i64).collect(),
        peak_to_peak: column(|r| r.peak_to_peak),
        converged: rows.clone().map(|p| p.response.is_some()).collect(),
        found_by: rows.clone().map(|p| p.found_by.name().to_owned()).collect(),
        residual: rows.clone().map(|p| p.residual).collect(),
        branch: rows
            .clone()
            .map(|p| p.branch.map_or(-1, |b| b as i64))
            .collect(),
        fold: rows.clone().map(|p| p.is_fold).collect(),
        error_amplitude: rows
            .clone()
            .map(|p| p.response.as_ref().and_then(|r| r.error))
            .collect(),
        error_friction_energy: rows
            .map(|p| p.response.as_ref().and_then(|r| r.friction_error))
            .collect(),
    })
}

/// Warns about points without a response.
fn warn_missing_points(points: &[ForcedPoint], outputs: &mut Outputs) {
    for (found_by, what) in [
        (
            SolutionMethod::Unphysical,
            "without a response: the harmonic balance has too few samples or harmonics there, and the contact would supply energy",
        ),
        (SolutionMethod::NotFound, "not found"),
    ] {
        let matching = points.iter().filter(|point| point.found_by == found_by);
        let frequencies: Vec<f64> = matching.map(|point| point.frequency).collect();
        let [first, ..] = frequencies[..] else {
            continue;
        };
        let last = frequencies.iter().copied().fold(first, f64::max);
        let first = frequencies.iter().copied().fold(first, f64::min);
        let places = match frequencies.len() {
            1 => format!("at {first:.6} Hz, is"),
            _ => format!("between {first:.6} and {last:.6} Hz, are"),
        };
        outputs.notice(format!(
            "forced response: {} of {} points, {places} {what}",
            frequencies.len(),
            points.len()
        ));
    }
}

/// Returns one row per harmonic and per row of `frf` with a response. Harmonics vary fastest.
fn harmonic_table(points: &[ForcedPoint], harmonics: &Harmonics) -> typed::FrfHarmonic {
    let mut table = typed::FrfHarmonic::default();
    for (row, point) in points.iter().enumerate() {
        let Some(response) = &point.response else {
            continue;
        };
        for (index, &order) in harmonics.orders().iter().enumerate() {
            let slot = harmonics.slot(index);
            table.row.push(row as i64);
            table.frequency.push(point.frequency);
            table.harmonic.push(order as i32);
            table.displacement_cosine.push(response.displacement[slot]);
            let sine = match order {
                0 => 0.0,
                _ => response.displacement[slot + 1],
            };
            table.displacement_sine.push(sine);
        }
    }
    table
}
