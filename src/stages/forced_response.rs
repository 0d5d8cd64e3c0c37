//! The response over the frequency range, without feeding it back: of the worn joint, where it is asked for.

use super::RunError;
use super::agreement::predicted_parameters;
use super::computed_motion::{ElementMotion, let_move};
use super::contact_elements::parameters;
use super::contact_state::{AtRest, harmonics_of, parameters_of, tangential_compliance};
use super::declaration::{Declaration, joined};
use super::dynamic_response::{
    contact_elements, correction_of, failed, harmonic_tolerance, response_table, start_of,
};
use super::reduced;
use super::response_notices::warn_missing_harmonics;
use super::solvers::{Solvers, given};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::forced_response::{ForcedPoint, PointResponse, SolutionMethod};
use crate::dynamics::{
    ContactElement, DynamicsError, HarmonicBalance, Harmonics, Resolved, Resonance, Response,
    Start, Vibration,
};
use crate::model_update::ElementParameters;
use crate::recipe::Part;
use crate::tables::{TableName, typed};

/// The forced response, [A §4d]: of a worn joint with the contact elements that its own fine contact gives, and with their resonance.
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
    // The phase resonance of these elements, if it is known.
    let (balance, resonance) = match reads.maybe::<typed::ModelUpdate>()? {
        Some(update) => {
            let parameters = worn_elements(reads, solvers, &update)?;
            let is_in_force = update.updated;
            worn(
                reads,
                solvers,
                &vibration,
                &parameters,
                is_in_force,
                &mut outputs,
            )?
        }
        None => {
            let elements = contact_elements(reads, &given(reads), 1.0);
            let response = reads.maybe::<typed::Response>()?;
            let harmonics = match &response {
                Some(response) => harmonics_of(response)?.0,
                None => vibration.harmonics.clone(),
            };
            let balance = vibration.balance_of(elements, harmonics);
            let balance = balance.map_err(|source| failed(reads, source))?;
            let row = reads.maybe::<typed::DynamicResponse>()?;
            let phase = response.zip(row.filter(|row| row.resonance_frequency.is_some()));
            let phase = phase.map(|(response, row)| start_of(&response, &row));
            (balance, phase.transpose()?.map(|(_, start)| start))
        }
    };
    let kept = solvers.forced_response.take();
    let response = reads.recipe.response.as_ref();
    let has_range = response.is_some_and(|response| response.frequency.is_some());
    if has_range && reads.forced_response_due {
        let resonance = resonance.as_ref();
        forced_response(reads, &vibration, balance, resonance, kept, &mut outputs)?;
    }
    Ok(outputs)
}

/// The contact elements of a worn joint: those in force where it has been updated, else those that its fine contact asks for under the motion in force.
pub fn worn_elements(
    reads: &StageInputs,
    solvers: &mut Solvers,
    update: &typed::ModelUpdate,
) -> Result<ElementParameters, RunError> {
    if update.updated {
        return Ok(parameters_of(&reads.table()?, reads.maybe()?));
    }
    let contact: typed::StaticContact = reads.table()?;
    let (found, _) = parameters(reads, solvers, &contact, &reads.table()?)?;
    match ElementMotion::of(reads)?.filter(ElementMotion::has_laws) {
        Some(motion) => {
            let compliance = tangential_compliance(&contact);
            let compliance = compliance.filter(|_| update.fine_compliance.is_some());
            let part = motion.stepped_part();
            predicted_parameters(reads, solvers, motion, compliance, found, part)
        }
        None => Ok(found),
    }
}

/// The worn joint, and its resonance, from the response in force, as a table: of a resonance that is lost there is none.
fn worn(
    reads: &StageInputs,
    solvers: &mut Solvers,
    vibration: &Vibration,
    parameters: &ElementParameters,
    is_in_force: bool,
    outputs: &mut Outputs,
) -> Result<(HarmonicBalance<ContactElement>, Option<Start>), RunError> {
    let failed = |source| failed(reads, source);
    let (response, in_force): (typed::Response, typed::DynamicResponse) =
        (reads.table()?, reads.table()?);
    let (harmonics, start) = start_of(&response, &in_force)?;
    let stepped_part = in_force.stepped_part.unwrap_or(1.0);
    let elements = contact_elements(reads, parameters, stepped_part);
    let wears = reads.recipe.wear.is_some();
    if is_in_force {
        outputs.put(&typed::WornResponse {
            fine_energy: wears.then_some(in_force.friction_energy),
            ..of_response(&in_force)
        })?;
        let balance = vibration.balance_of(elements, harmonics).map_err(failed)?;
        let is_phase = in_force.resonance_frequency.is_some();
        return Ok((balance, is_phase.then_some(start)));
    }
    let resolved = vibration.resolve_in_force(elements, Some((&harmonics, &start)));
    let resolved = resolved.map_err(failed)?;
    let tolerance = harmonic_tolerance(&reads.recipe);
    let resolved = match (correction_of(&response, &in_force)?, tolerance) {
        (Some((truncation, correction)), _) => resolved.completed_as(truncation, correction),
        (None, Some(_)) => resolved.completed(tolerance, None),
        // Its errors are in no table.
        (None, None) => resolved.with_peak(),
    };
    let resolved = resolved.map_err(failed)?;
    warn_missing_harmonics(outputs, tolerance, &resolved);
    let same = match vibration.at_omega {
        Some(_) => Ok(()),
        None => start.require_same_resonance(resolved.resonance.in_force()),
    };
    match same {
        Err(lost) => outputs.notice(format!("the worn joint: {lost}")),
        Ok(()) => {
            let corrected = resolved.corrected().map_err(failed)?;
            let of_elements = corrected.resonance.in_force().energy.friction;
            let fine_energy = match wears {
                true => {
                    let fine = fine_energy(reads, solvers, &corrected, parameters)?;
                    Some(fine.unwrap_or(of_elements))
                }
                false => None,
            };
            outputs.put(&typed::WornResponse {
                fine_energy,
                ..row(&corrected.resonance)
            })?;
        }
    }
    let phase = resolved.resonance.phase.as_ref().map(Response::start);
    Ok((resolved.balance, phase))
}

/// The row of a response that is in force.
fn of_response(row: &typed::DynamicResponse) -> typed::WornResponse {
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

/// What the fine contact dissipates in a cycle under the response of a worn joint \[J\]; none where that would open the joint.
fn fine_energy(
    reads: &StageInputs,
    solvers: &mut Solvers,
    resolved: &Resolved,
    parameters: &ElementParameters,
) -> Result<Option<f64>, RunError> {
    let at_rest = AtRest::of(reads, solvers)?;
    let response = response_table(&reads.recipe, &resolved.balance, &resolved.resonance);
    let in_force: typed::DynamicResponse = reads.table()?;
    let stepped_part = in_force.stepped_part.unwrap_or(1.0);
    let moved = ElementMotion::new(response, parameters.clone(), stepped_part);
    match let_move(reads, solvers, at_rest.contact.load, Some(&moved), None) {
        Ok(_) => {
            let (cycle, _) = solvers.work(reads, None, |joint| {
                Ok(joint.cycle(&at_rest.wear, &at_rest.contact, at_rest.start())?)
            })?;
            Ok(Some(cycle.dissipation))
        }
        Err(RunError::Cycle(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

fn row(resonance: &Resonance) -> typed::WornResponse {
    let phase = resonance.in_force();
    let energy = phase.energy;
    typed::WornResponse {
        resonance_frequency: resonance.phase.as_ref().map(Response::frequency),
        resonance_amplitude: resonance.phase.as_ref().map(|_| resonance.amplitude),
        peak_frequency: resonance.peak_frequency,
        peak_amplitude: resonance.peak_amplitude,
        input_energy: energy.input,
        friction_energy: energy.friction,
        viscous_energy: energy.viscous,
        hysteretic_energy: energy.hysteretic,
        fine_energy: None,
    }
}

/// The tables `frf` and `frf_harmonic`.
fn forced_response(
    reads: &StageInputs,
    vibration: &Vibration,
    balance: HarmonicBalance<ContactElement>,
    resonance: Option<&Start>,
    kept: Option<(Harmonics, Vec<ForcedPoint>)>,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    let mut harmonics = balance.harmonics().clone();
    let force = balance
        .drive()
        .map_or(0.0, |load| load.cosine.hypot(load.sine));
    let kept = kept.filter(|(of, _)| *of == harmonics);
    let mut points = match kept {
        Some((_, points)) => Ok(points),
        None => points_of(reads, vibration, &balance, resonance),
    };
    let has_branch = match &points {
        Ok(points) => points.iter().any(|p| p.found_by == SolutionMethod::Balance),
        Err(error) => !error.is_not_converged(),
    };
    if !has_branch && harmonics != vibration.harmonics {
        // With the harmonics that the resonance was extended to no branch begins: those of the scene may have one.
        harmonics = vibration.harmonics.clone();
        outputs.notice(format!(
            "forced response: of harmonics up to {}, because no branch starts with the harmonics of the resonance",
            harmonics.highest()
        ));
        let fewer = vibration.balance_of(balance.elements().to_vec(), harmonics.clone());
        points = fewer.and_then(|balance| vibration.forced_response(&balance));
        // What these lack is what the resonance was extended for.
        for point in points.iter_mut().flatten() {
            if let Some(response) = &mut point.response {
                (response.error, response.friction_error) = (Some(1.0), Some(1.0));
            }
        }
    }
    let points = points.map_err(|source| failed(reads, source))?;
    tell_left_out(&points, outputs);
    put(&points, force, &harmonics, outputs)
}

/// The points, with their errors where the contact elements stay as they are.
fn points_of(
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

/// Adds the tables of the points.
fn put(
    points: &[ForcedPoint],
    force: f64,
    harmonics: &Harmonics,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    outputs.put(&harmonic_table(points, harmonics))?;
    let all = points.iter();
    let of = |value: fn(&PointResponse) -> f64| -> Vec<Option<f64>> {
        let each = points
            .iter()
            .map(|point| point.response.as_ref().map(value));
        each.collect()
    };
    let active = |point: &ForcedPoint| {
        let response = point.response.as_ref();
        response.map_or(0, |found| found.solution.active_elements())
    };
    outputs.put(&typed::Frf {
        force: vec![force; points.len()],
        frequency: all.clone().map(|p| p.frequency).collect(),
        amplitude: of(|r| r.amplitude),
        phase_lag: of(|r| r.phase_lag),
        input_energy: of(|r| r.solution.energy.input),
        friction_energy: of(|r| r.solution.energy.friction),
        viscous_energy: of(|r| r.solution.energy.viscous),
        hysteretic_energy: of(|r| r.solution.energy.hysteretic),
        active_elements: all.clone().map(|p| active(p) as i64).collect(),
        peak_to_peak: of(|r| r.peak_to_peak),
        converged: all.clone().map(|p| p.response.is_some()).collect(),
        found_by: all.clone().map(|p| p.found_by.name().to_owned()).collect(),
        residual: all.clone().map(|p| p.residual).collect(),
        branch: all
            .clone()
            .map(|p| p.branch.map_or(-1, |b| b as i64))
            .collect(),
        fold: all.clone().map(|p| p.is_fold).collect(),
        error_amplitude: all
            .clone()
            .map(|p| p.response.as_ref().and_then(|r| r.error))
            .collect(),
        error_friction_energy: all
            .map(|p| p.response.as_ref().and_then(|r| r.friction_error))
            .collect(),
    })
}

/// Says where the forced response has no point.
fn tell_left_out(points: &[ForcedPoint], outputs: &mut Outputs) {
    for (found_by, what) in [
        (
            SolutionMethod::Unphysical,
            "without a response: the contact would give energy in that of the harmonic balance, whose samples or harmonics are too few there",
        ),
        (SolutionMethod::Nothing, "not found"),
    ] {
        let some = points.iter().filter(|point| point.found_by == found_by);
        let frequencies: Vec<f64> = some.map(|point| point.frequency).collect();
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

/// One row for each row of `frf` that has a response, and harmonic, rows slow.
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
