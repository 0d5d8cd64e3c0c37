//! The steady response of the structure with the current contact elements.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::RunError;
use super::agreement::{self, AgreedResponse, agree, predicted_parameters};
use super::computed_motion::ElementMotion;
use super::contact_elements::{element_table, slider_table};
use super::contact_state::{coefficients_of, harmonics_of, parameters_of};
use super::declaration::{Declaration, joined};
use super::model_update::extrapolates;
use super::reduced;
use super::response_notices::{
    note_extensions, warn_jump, warn_missing_harmonics, warn_open, warn_reduction, warn_resonance,
};
use super::solvers::{Solvers, element_layout, given_parameters};
use super::stage::{Stage, When};
use super::stage_inputs::{Outputs, StageInputs};
use crate::dynamics::cycle::{JointCycle, JointSummary, joint_cycle};
use crate::dynamics::{
    ContactElement, Correction, CorrectionRequest, DynamicsError, ElementState, HarmonicBalance,
    Harmonics, RangeResponse, ResolvedResonance, Resonance, ResonanceKind, Response, Start,
    TruncationError, Vibration,
};
use crate::model_update::{ElementParameters, can_extrapolate};
use crate::recipe::Layout;
use crate::recipe::{Part, Recipe};
use crate::tables::{TableName, typed};

/// The steady vibration at resonance, [A eq. 2.1–2.2], or at a given frequency. The stage computes a new response after
/// an update of the contact elements. Without an update, the stage copies the response of the previous iteration.
pub const DECLARATION: Declaration = Declaration {
    stage: Stage::DynamicResponse,
    when: When::Always,
    recipe: &[
        Part::Structure,
        Part::Surface,
        Part::Contact,
        Part::Cycle,
        Part::Elements,
        Part::Response,
    ],
    reads: &joined::<14>(&[
        &agreement::TABLES,
        &reduced::TABLES,
        &[
            TableName::ReferenceElement,
            TableName::ModelUpdate,
            TableName::ContactElement,
            TableName::ContactSlider,
        ],
    ]),
    before: &joined::<8>(&[
        &IN_FORCE,
        &[TableName::ModelUpdate, TableName::FrettingCycle],
    ]),
    writes: &IN_FORCE,
    is_due: |_| true,
    shared: false,
    compute,
};

/// Largest relative correction of the friction energy of reversal cycles. If the error of the friction energy exceeds
/// `LARGEST_CORRECTION`, half the grid is too coarse to measure the error. The stage then adds the error to the error
/// bar and does not correct the friction energy.
const LARGEST_CORRECTION: f64 = 0.1;
/// Relative change of the resonance that marks an unknown change. With the mark, all iterations have the same columns.
pub(super) const UNKNOWN_CHANGE: f64 = 1.0;

/// Tables of the current response. An iteration without an update copies the tables of the previous response.
const IN_FORCE: [TableName; 6] = [
    TableName::Response,
    TableName::DynamicResponse,
    TableName::Resonance,
    TableName::JointCycle,
    TableName::ContactElement,
    TableName::ContactSlider,
];

fn compute(reads: &StageInputs, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let Some(update) = reads.optional_table::<typed::ModelUpdate>()? else {
        compute_without_rough_contact(reads, solvers, &mut outputs)?;
        return Ok(outputs);
    };
    let before = match reads.optional_previous_table::<typed::Response>()? {
        Some(response) => Some((response, reads.before::<typed::DynamicResponse>()?)),
        None => None,
    };
    if let Some((response, row)) = before.as_ref().filter(|_| !update.updated) {
        outputs.add_table(response)?;
        outputs.add_table(row)?;
        outputs.add_table(&reads.before::<typed::Resonance>()?)?;
        outputs.add_table(&reads.before::<typed::JointCycle>()?)?;
        outputs.add_table(&reads.before::<typed::ContactElement>()?)?;
        if let Some(sliders) = reads.optional_previous_table::<typed::ContactSlider>()? {
            outputs.add_table(&sliders)?;
        }
        return Ok(outputs);
    }
    let mut parameters = parameters_of(&reads.table()?, reads.optional_table()?);
    let cycle_before = reads.optional_previous_table::<typed::FrettingCycle>()?;
    let stepped_part = cycle_before.and_then(|cycle| cycle.stepped_part);
    let applied_part = stepped_part.filter(|part| (part - 1.0).abs() <= LARGEST_CORRECTION);
    let applied_part = applied_part.unwrap_or(1.0);
    let start = before.as_ref();
    let start = start.map(|(response, row)| initial_guess(response, row));
    let mut start = start.transpose()?;
    if let Some(motion) = ElementMotion::before(reads)?.filter(ElementMotion::has_laws) {
        let compliance = update.fine_compliance;
        if let (Some(change), Some((harmonics, start)), Some((response, _))) = (
            motion.extrapolated_coefficients(compliance),
            &mut start,
            &before,
        ) {
            let (response_harmonics, _) = harmonics_of(response)?;
            let change = response_harmonics.transfer(&change, harmonics);
            let pairs = start.displacement.iter_mut().zip(change);
            pairs.for_each(|(u, change)| *u += change);
        }
        parameters =
            predicted_parameters(reads, solvers, motion, compliance, parameters, applied_part)?;
    }
    let start = start.as_ref().map(|(harmonics, start)| (harmonics, start));
    let vibration = solvers.vibration(reads)?;
    let elements = contact_elements(reads, &parameters, applied_part);
    let tolerance = harmonic_tolerance(&reads.recipe);
    let resolved = resolved_in_force(&vibration, elements, start);
    let resolved = resolved.map_err(|source| dynamics_error(reads, source))?;
    let initial = AgreedResponse {
        resolved,
        parameters,
        stepped_part: applied_part,
    };
    let AgreedResponse {
        resolved,
        parameters,
        ..
    } = agree(reads, solvers, &vibration, initial)?;
    // Computes the peak and the error bars only for the final response. The peak and the error bars take as much time
    // as the response.
    let corrects = harmonic_correction(&reads.recipe);
    let correction_before = match before.as_ref() {
        Some((response, row)) => correction_of(response, row)?,
        None => None,
    };
    let near = correction_before.as_ref().map(|(_, correction)| correction);
    let resolved =
        resolved.with_peak_and_errors(tolerance, corrects.then_some(CorrectionRequest { near }));
    let resolved = resolved.map_err(|source| dynamics_error(reads, source))?;
    note_extensions(&mut outputs, &resolved.extensions);
    let solved = SolvedResponse::of(&resolved);
    let resolved = resolved.corrected();
    let resolved = resolved.map_err(|source| dynamics_error(reads, source))?;
    warn_missing_harmonics(&mut outputs, tolerance, &resolved);
    warn_resonance(&mut outputs, &vibration, &resolved.resonance);
    warn_reduction(reads, &mut outputs, &resolved)?;
    if let Some((_, row)) = &before {
        warn_jump(reads, &mut outputs, row, &resolved.resonance);
    }
    let before = before.as_ref().map(|(response, _)| response);
    put_in_force(
        reads,
        &resolved,
        &parameters,
        (solved, Some(applied_part)),
        before,
        &mut outputs,
    )?;
    if let Some(sliders) = slider_table(&parameters) {
        outputs.add_table(&sliders)?;
    }
    Ok(outputs)
}

/// Returns the response to other elements, at the resonance of `start` or at the given frequency.
pub fn resolved_in_force<'a>(
    vibration: &'a Vibration,
    elements: Vec<ContactElement>,
    start: Option<(&Harmonics, &Start)>,
) -> Result<ResolvedResonance<'a>, DynamicsError> {
    let resolved = vibration.resolve_governing_response(elements, start)?;
    if let (Some((_, start)), None) = (start, vibration.at_omega) {
        start.require_same_resonance(resolved.resonance.governing())?;
    }
    Ok(resolved)
}

/// Computes the response of a structure without a rough contact. The forced response is a by-product and is kept for
/// the stage that writes it. After a restart that stage computes it again, with identical results.
fn compute_without_rough_contact(
    reads: &StageInputs,
    solvers: &mut Solvers,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    let parameters = given_parameters(reads);
    let has_contact = reads.recipe.elements().is_some();
    if let Some(sliders) = slider_table(&parameters) {
        outputs.add_table(&sliders)?;
    }
    let vibration = solvers.vibration(reads)?;
    let elements = contact_elements(reads, &parameters, 1.0);
    let tolerance = harmonic_tolerance(&reads.recipe);
    match vibration.resolve_over_range(elements, tolerance) {
        Ok(RangeResponse { resolved, points }) => {
            let harmonics = resolved.balance.harmonics().clone();
            solvers.forced_response = points.map(|points| (harmonics, points));
            warn_missing_harmonics(outputs, tolerance, &resolved);
            warn_resonance(outputs, &vibration, &resolved.resonance);
            put_in_force(reads, &resolved, &parameters, (None, None), None, outputs)
        }
        // The stage of the forced response still runs, and gives a result or an error.
        Err(error) if error.is_not_converged() => {
            let key = match vibration.at_omega {
                Some(_) => "dynamics.at",
                None => "dynamics.frequency",
            };
            outputs.notice(format!("{key}: {error}"));
            match has_contact {
                true => {
                    outputs.add_table(&element_table(&element_layout(reads), &parameters, None))
                }
                false => Ok(()),
            }
        }
        Err(error) => Err(dynamics_error(reads, error)),
    }
}

/// Returns the contact elements with the given `parameters`, with the friction of the elements multiplied by
/// `stepped_part`. If the recipe has no contact elements, the list contains only the springs of the structure.
pub fn contact_elements(
    reads: &StageInputs,
    parameters: &ElementParameters,
    stepped_part: f64,
) -> Vec<ContactElement> {
    let elements = reads.recipe.elements();
    let mut elements = elements.map_or_else(Vec::new, |elements| {
        elements.with(&element_layout(reads), parameters)
    });
    let all = elements.iter_mut();
    all.for_each(|element| element.multiply_friction(stepped_part));
    if let Some(structure) = &reads.recipe.structure {
        structure.add_springs(&mut elements);
    }
    elements
}

/// Returns the relative truncation error up to which harmonics are added; `None` if they are fixed.
pub fn harmonic_tolerance(recipe: &Recipe) -> Option<f64> {
    let response = recipe.response.as_ref();
    response.and_then(|response| response.harmonic_tolerance)
}

/// Converts an error into the error of a run without a steady vibration.
pub fn dynamics_error(reads: &StageInputs, source: DynamicsError) -> RunError {
    RunError::Dynamics {
        wear_iteration: reads.wear_iteration,
        source,
    }
}

/// Returns a response as the initial guess for the next response.
pub fn initial_guess(
    response: &typed::Response,
    row: &typed::DynamicResponse,
) -> Result<(Harmonics, Start), RunError> {
    let (harmonics, displacement) = harmonics_of(response)?;
    let frequency = row.resonance_frequency.unwrap_or(row.peak_frequency);
    let start = |displacement| Start {
        omega: frequency / (1.0 + row.correction_frequency.unwrap_or(0.0)) * TAU,
        load_factor: 1.0,
        displacement,
    };
    let Some((highest, solved)) = row.solved_harmonic.zip(solved_of(response)) else {
        return Ok((harmonics, start(displacement)));
    };
    let orders = harmonics.orders().iter().copied();
    let orders: Vec<u32> = orders
        .filter(|order| i64::from(*order) <= highest)
        .collect();
    let solved_harmonics = Harmonics::new(&orders)?;
    let start = start(solved).in_harmonics(&harmonics, &solved_harmonics);
    Ok((solved_harmonics, start))
}

/// Writes the tables of the current response, and the tables of the contact if the scene has a contact. `before` is the
/// response that the current response replaces.
fn put_in_force(
    reads: &StageInputs,
    resolved: &ResolvedResonance,
    parameters: &ElementParameters,
    (solved, stepped_part): (Option<SolvedResponse>, Option<f64>),
    before: Option<&typed::Response>,
    outputs: &mut Outputs,
) -> Result<(), RunError> {
    let ResolvedResonance {
        balance, resonance, ..
    } = resolved;
    let has_contact = reads.recipe.elements().is_some();
    let layout = match has_contact {
        true => element_layout(reads),
        // If the scene has no contact, all elements of the balance are springs. The layout places the centre of every
        // spring at the origin.
        false => Layout {
            centres: vec![[0.0; 2]; balance.elements().len()],
            ..Layout::default()
        },
    };
    let cycle = joint_cycle(
        balance.elements(),
        &resonance.governing().displacement,
        balance.sampling(),
        &layout.centres,
    )?;
    if has_contact && reads.wear_iteration == 0 {
        warn_open(outputs, balance.elements(), &cycle);
    }
    let summary = balance.joint_summary(resonance.governing());
    let mut response = response_table(&reads.recipe, balance, resonance);
    if let Some(solved) = &solved {
        solved.add_to(&mut response);
    }
    let (response, is_steady) = match extrapolates(reads) {
        true => with_change(response, before),
        false => (response, None),
    };
    outputs.add_table(&response)?;
    outputs.add_table(&resonance_table(balance, resonance))?;
    let correction = resolved.correction.as_ref().filter(|_| solved.is_some());
    let corrected = |value: fn(&Correction) -> f64| correction.map(value);
    outputs.add_table(&typed::DynamicResponse {
        is_steady,
        stepped_part,
        solved_harmonic: solved.map(|solved| i64::from(solved.harmonics.highest())),
        correction_frequency: corrected(|c| c.frequency),
        correction_input_energy: corrected(|c| c.energy[0]),
        correction_friction_energy: corrected(|c| c.energy[1]),
        correction_viscous_energy: corrected(|c| c.energy[2]),
        correction_hysteretic_energy: corrected(|c| c.energy[3]),
        ..row(&layout, resolved, &cycle, &summary)
    })?;
    if has_contact {
        outputs.add_table(&cycle_table(&cycle))?;
        outputs.add_table(&element_table(&layout, parameters, Some(&summary.states)))?;
    }
    Ok(())
}

fn row(
    layout: &Layout,
    resolved: &ResolvedResonance,
    cycle: &JointCycle,
    summary: &JointSummary,
) -> typed::DynamicResponse {
    let ResolvedResonance {
        balance,
        resonance,
        truncation,
        ..
    } = resolved;
    let phase = resonance.governing();
    let count = |state| summary.count(state) as i64;
    let load: f64 = balance
        .elements()
        .iter()
        .map(ContactElement::normal_load)
        .sum();
    let [about_x, about_y, about_n] = cycle.moment_variation(load * layout.lever);
    let mean = summary.displacement[0];
    let away = (summary.largest_displacement[0] - mean).max(mean - summary.least_displacement[0]);
    let spread = if mean > 0.0 { away / mean } else { 0.0 };
    let energy = phase.energy;
    typed::DynamicResponse {
        resonance_frequency: resonance.phase.as_ref().map(Response::frequency),
        resonance_amplitude: resonance.phase.as_ref().map(|_| resonance.amplitude),
        peak_frequency: resonance.peak_frequency,
        peak_amplitude: resonance.peak_amplitude,
        peak_bound: resolved.peak_bound(),
        input_energy: energy.load_work,
        friction_energy: energy.friction,
        viscous_energy: energy.viscous,
        hysteretic_energy: energy.hysteretic,
        error_energy: energy.imbalance(),
        highest_harmonic: i64::from(balance.harmonics().highest()),
        error_resonance_frequency: (resonance.peak_kind != ResonanceKind::Forced)
            .then_some(truncation.frequency),
        expected_resonance_change: (resonance.peak_kind != ResonanceKind::Forced).then_some(
            truncation
                .expected_frequency_change
                .unwrap_or(UNKNOWN_CHANGE),
        ),
        error_peak_amplitude: truncation.amplitude,
        error_friction_energy: truncation.friction_energy,
        iterations: resonance.iterations as i64,
        active_elements: phase.active_elements() as i64,
        sticking_elements: count(ElementState::Stick),
        slipping_elements: count(ElementState::Partial) + count(ElementState::Slip),
        open_elements: count(ElementState::Open),
        displacement_amplitude: mean,
        displacement_spread: spread,
        load_variation: summary.normal_load,
        element_load_variation: summary.largest_normal_load,
        moment_variation: about_x.max(about_y),
        torsion_variation: about_n,
        ..typed::DynamicResponse::default()
    }
}

/// The response with the solved harmonics only. The stage keeps the solved response if the tables store the response
/// with added harmonics.
struct SolvedResponse {
    harmonics: Harmonics,
    /// Coefficients of the displacement \[m\]. Harmonics vary fastest, ports slowest.
    displacement: Vec<f64>,
}

impl SolvedResponse {
    fn of(resolved: &ResolvedResonance) -> Option<SolvedResponse> {
        resolved.correction.as_ref()?;
        Some(SolvedResponse {
            harmonics: resolved.balance.harmonics().clone(),
            displacement: resolved.resonance.governing().displacement.clone(),
        })
    }

    fn add_to(&self, response: &mut typed::Response) {
        let n = self.harmonics.coefficients();
        let mut port = None;
        let (mut cosines, mut sines) = (Vec::new(), Vec::new());
        for &order in &response.harmonic {
            // The orders of each port ascend from 0.
            if order == 0 {
                port = Some(port.map_or(0, |port| port + 1));
            }
            let row = &self.displacement[port.unwrap_or(0) * n..][..n];
            let slot = self.harmonics.slot_of(order as u32);
            cosines.push(slot.map_or(0.0, |slot| row[slot]));
            sines.push(slot.filter(|_| order > 0).map_or(0.0, |slot| row[slot + 1]));
        }
        response.solved_cosine = Some(cosines);
        response.solved_sine = Some(sines);
    }
}

/// Returns true if the response with added harmonics drives the wear.
pub fn harmonic_correction(recipe: &Recipe) -> bool {
    let response = recipe.response.as_ref();
    response.is_some_and(|response| response.harmonic_correction)
}

/// Reads the correction by the added harmonics and the remaining truncation errors from the tables.
pub fn correction_of(
    response: &typed::Response,
    row: &typed::DynamicResponse,
) -> Result<Option<(TruncationError, Correction)>, RunError> {
    let (Some(frequency), Some(solved)) = (row.correction_frequency, solved_of(response)) else {
        return Ok(None);
    };
    let (harmonics, displacement) = harmonics_of(response)?;
    let pairs = displacement.iter().zip(&solved);
    let energy = [
        row.correction_input_energy,
        row.correction_friction_energy,
        row.correction_viscous_energy,
        row.correction_hysteretic_energy,
    ];
    let truncation = TruncationError {
        frequency: row.error_resonance_frequency.unwrap_or(0.0),
        amplitude: row.error_peak_amplitude,
        friction_energy: row.error_friction_energy,
        expected_frequency_change: row
            .expected_resonance_change
            .filter(|change| *change != UNKNOWN_CHANGE),
    };
    let correction = Correction {
        harmonics,
        displacement: pairs.map(|(all, solved)| all - solved).collect(),
        frequency,
        energy: energy.map(|change| change.unwrap_or(0.0)),
    };
    Ok(Some((truncation, correction)))
}

/// Returns the coefficients of the solved harmonics, in the order of [`harmonics_of`]; `None` if the table has no
/// added harmonics.
fn solved_of(response: &typed::Response) -> Option<Vec<f64>> {
    coefficients_of(
        &response.harmonic,
        response.solved_cosine.as_ref()?,
        response.solved_sine.as_ref()?,
    )
    .into()
}

/// Returns the response `response` with the change since the response `before`. The second value is true if the change
/// is steady enough for extrapolation. Harmonics that the previous response lacks have no change.
fn with_change(
    mut response: typed::Response,
    before: Option<&typed::Response>,
) -> (typed::Response, Option<bool>) {
    type Place<'a> = (i32, &'a str, &'a str, i32);
    fn place(response: &typed::Response, row: usize) -> Place<'_> {
        let (point, axis) = (response.point[row].as_str(), response.axis[row].as_str());
        (response.element[row], point, axis, response.harmonic[row])
    }
    let rows = response.harmonic.len();
    let mut change = [vec![0.0; rows], vec![0.0; rows]];
    let mut contact_values = [Vec::new(), Vec::new(), Vec::new()];
    if let Some(before) = before {
        let places = (0..before.harmonic.len()).map(|row| (place(before, row), row));
        let places: BTreeMap<Place, usize> = places.collect();
        for row in 0..rows {
            let Some(&old) = places.get(&place(&response, row)) else {
                continue;
            };
            let pairs = [
                (
                    &response.displacement_cosine,
                    &before.displacement_cosine,
                    &before.change_cosine,
                ),
                (
                    &response.displacement_sine,
                    &before.displacement_sine,
                    &before.change_sine,
                ),
            ];
            for (change, (now, then, change_then)) in change.iter_mut().zip(pairs) {
                change[row] = now[row] - then[old];
                if response.element[row] >= 0 {
                    let then = change_then.as_ref().map_or(0.0, |change| change[old]);
                    let values = [now[row], change[row], then];
                    contact_values
                        .iter_mut()
                        .zip(values)
                        .for_each(|(list, value)| list.push(value));
                }
            }
        }
    }
    let [last, now, then] = &contact_values;
    let is_steady = before.is_some() && can_extrapolate(last, now, then);
    let [cosine, sine] = change;
    response.change_cosine = Some(cosine);
    response.change_sine = Some(sine);
    (response, Some(is_steady))
}

/// Returns the table of the peak and of the phase resonance, or of the response at the given frequency.
fn resonance_table(
    balance: &HarmonicBalance<ContactElement>,
    resonance: &Resonance,
) -> typed::Resonance {
    let phase = resonance.phase.iter();
    let phase = phase.map(|phase| {
        (
            ResonanceKind::PhaseResonance,
            phase,
            resonance.amplitude,
            None,
        )
    });
    let peak = (
        resonance.peak_kind,
        &resonance.peak,
        resonance.peak_amplitude,
        resonance.branch,
    );
    let mut table = typed::Resonance::default();
    for (kind, response, amplitude, branch) in [peak].into_iter().chain(phase) {
        table.kind.push(kind.name().to_owned());
        table.frequency.push(response.frequency());
        table.amplitude.push(amplitude);
        let lag = balance.amplitude(response, resonance.port);
        table.phase_lag.push(lag.map_or(0.0, |(_, lag)| lag));
        table.input_energy.push(response.energy.load_work);
        table.friction_energy.push(response.energy.friction);
        table.viscous_energy.push(response.energy.viscous);
        table.hysteretic_energy.push(response.energy.hysteretic);
        table.branch.push(branch.map_or(-1, |branch| branch as i64));
        table.chosen.push(true);
    }
    table
}

fn cycle_table(cycle: &JointCycle) -> typed::JointCycle {
    let samples = cycle.force.len();
    let column = |values: &[[f64; 3]], d: usize| values.iter().map(|v| v[d]).collect::<Vec<f64>>();
    typed::JointCycle {
        time: (0..samples).map(|k| k as f64 / samples as f64).collect(),
        displacement_x: column(&cycle.displacement, 0),
        displacement_y: column(&cycle.displacement, 1),
        displacement_n: column(&cycle.displacement, 2),
        force_x: column(&cycle.force, 0),
        force_y: column(&cycle.force, 1),
        normal_load: column(&cycle.force, 2),
        moment_x: column(&cycle.moment, 0),
        moment_y: column(&cycle.moment, 1),
        moment_z: column(&cycle.moment, 2),
        force_along: cycle.force_along.clone(),
    }
}

/// Returns the table of harmonic coefficients, with one row per port and harmonic. Harmonics vary fastest, in the
/// order that [`harmonics_of`] expects.
pub fn response_table(
    recipe: &Recipe,
    balance: &HarmonicBalance<ContactElement>,
    resonance: &Resonance,
) -> typed::Response {
    let phase = resonance.governing();
    let harmonics = balance.harmonics();
    let n = harmonics.coefficients();
    let contact = 3 * balance.elements().len();
    let points = recipe.points();
    let mut table = typed::Response::default();
    for port in 0..phase.displacement.len() / n {
        let displacement = &phase.displacement[port * n..][..n];
        let force = phase
            .force
            .get(port * n..(port + 1) * n)
            .filter(|_| port < contact);
        for (index, &order) in harmonics.orders().iter().enumerate() {
            let slot = harmonics.slot(index);
            let pair = |row: &[f64]| [row[slot], if order == 0 { 0.0 } else { row[slot + 1] }];
            if port < contact {
                table.element.push((port / 3) as i32);
                table.point.push(String::new());
                table.axis.push(["x", "y", "n"][port % 3].to_owned());
            } else {
                let point = &points[port - contact];
                table.element.push(-1);
                table.point.push(point.at.clone());
                table.axis.push(["x", "y", "z"][point.axis].to_owned());
            }
            table.harmonic.push(order as i32);
            let [cosine, sine] = pair(displacement);
            table.displacement_cosine.push(cosine);
            table.displacement_sine.push(sine);
            let [cosine, sine] = force.map_or([0.0; 2], pair);
            table.force_cosine.push(cosine);
            table.force_sine.push(sine);
        }
    }
    table
}
