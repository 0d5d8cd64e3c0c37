//! The steady response of the structure to the contact elements in force, and of the worn state where it is asked for.

use super::context::{Clock, VibrationKeys, is_kept, kept, put};
use super::model_update::element_table;
use super::vibrating::{Driven, InForce, Model, Shaken, Vibrating};
use super::{Observer, RunError, Stage};
use crate::dynamics::closure::ClosureEnergy;
use crate::dynamics::cycle::{JointCycle, JointSummary, joint_cycle};
use crate::dynamics::vibration::ForcedPoint;
use crate::dynamics::{
    ContactElement, DynamicsError, ElementState, HarmonicBalance, Harmonics, Resolved, Resonance,
    Start, Truncation, Vibration,
};
use crate::model_update::ElementParameters;
use crate::recipe::Inputs;
use crate::recipe::build::Layout;
use crate::store::{Draft, StageKey};
use crate::tables::{TableName, typed};

/// What the stage writes.
pub const TABLES: [TableName; 6] = [
    TableName::ContactElement,
    TableName::Response,
    TableName::DynamicResponse,
    TableName::JointCycle,
    TableName::WornResponse,
    TableName::Frf,
];

/// The tables of the response in force, in the order in which they are written: with the last all are there.
pub const IN_FORCE: [TableName; 4] = [
    TableName::Response,
    TableName::DynamicResponse,
    TableName::JointCycle,
    TableName::ContactElement,
];

/// The response in force: computed where the contact elements are new, else that of the iteration before; or taken from the draft.
pub fn dynamic_response(
    inputs: &Inputs,
    vibrating: &Vibrating,
    clock: &mut Clock,
    draft: &mut Draft,
    keys: &VibrationKeys,
    model: Model,
    before: Option<&Driven>,
) -> Result<Driven, RunError> {
    if let Some(tables) = InForce::kept(draft, &keys.dynamic_response)? {
        return Driven::of(model, tables);
    }
    let driven = match before {
        Some(before) if !model.updated => Driven {
            model,
            shaken: before.shaken.clone(),
            tables: before.tables.clone(),
        },
        _ => {
            let start = before.map(|before| &before.shaken);
            shake(inputs, vibrating, clock, model, start)?
        }
    };
    driven.tables.put(draft, &keys.dynamic_response)?;
    Ok(driven)
}

impl InForce {
    /// As an earlier start left them, if all of them are there.
    fn kept(draft: &mut Draft, key: &StageKey) -> Result<Option<InForce>, RunError> {
        let (response, row) = (kept(draft, key)?, kept(draft, key)?);
        let (cycle, elements) = (kept(draft, key)?, kept(draft, key)?);
        let (Some(response), Some(row), Some(cycle), Some(elements)) =
            (response, row, cycle, elements)
        else {
            return Ok(None);
        };
        Ok(Some(InForce {
            response,
            row,
            cycle,
            elements,
        }))
    }

    fn put(&self, draft: &mut Draft, key: &StageKey) -> Result<(), RunError> {
        put(draft, key, &self.response)?;
        put(draft, key, &self.row)?;
        put(draft, key, &self.cycle)?;
        put(draft, key, &self.elements)
    }
}

/// Computes the resonance with these contact elements.
pub fn shake(
    inputs: &Inputs,
    vibrating: &Vibrating,
    clock: &mut Clock,
    model: Model,
    before: Option<&Shaken>,
) -> Result<Driven, RunError> {
    let (wear_iteration, observer) = (clock.wear_iteration, clock.observer);
    clock.timed(Stage::DynamicResponse, || {
        let elements = vibrating.contact_elements(&inputs.recipe, &model.parameters);
        let start = before.map(|before| (&before.harmonics, &before.start));
        let tolerance = inputs
            .recipe
            .response
            .as_ref()
            .and_then(|r| r.harmonic_tolerance);
        let resolved = vibrating
            .vibration
            .resolve(elements, start, tolerance)
            .map_err(fail(wear_iteration))?;
        tell_missed(observer, tolerance, &resolved);
        let tables = in_force(inputs, &vibrating.layout, &resolved, &model.parameters)?;
        // As a later start will find it in the tables, to the last bit.
        Driven::of(model, tables)
    })
}

/// Says so where harmonics could not be extended until they suffice.
pub fn tell_missed(observer: &dyn Observer, tolerance: Option<f64>, resolved: &Resolved) {
    let error = resolved.truncation.largest();
    if let Some(tolerance) = tolerance.filter(|tolerance| error > *tolerance) {
        observer.notice(&format!(
            "fidelity.harmonic_tolerance = {tolerance}: harmonics up to {} leave an error of {error:.1e}",
            resolved.balance.harmonics().highest()
        ));
    }
}

/// The tables of a resonance.
pub fn in_force(
    inputs: &Inputs,
    layout: &Layout,
    resolved: &Resolved,
    parameters: &ElementParameters,
) -> Result<InForce, RunError> {
    let Resolved {
        balance, resonance, ..
    } = resolved;
    let cycle = joint_cycle(
        balance.elements(),
        &resonance.phase.displacement,
        balance.sampling(),
        &layout.centres,
    )?;
    let summary = balance.joint_summary(&resonance.phase);
    Ok(InForce {
        response: response_table(inputs, balance, resonance),
        row: row(layout, resolved, &cycle, &summary),
        cycle: cycle_table(&cycle),
        elements: element_table(layout, parameters, Some(&summary.states)),
    })
}

fn fail(wear_iteration: u64) -> impl Fn(DynamicsError) -> RunError {
    move |source| RunError::Dynamics {
        wear_iteration,
        source,
    }
}

/// True if the response of the worn state belongs to this iteration: the first, those that `output.response_at` names, and the
/// last.
pub fn worn_is_due(inputs: &Inputs, before: Option<u64>, cycles: u64, is_last: bool) -> bool {
    let Some(before) = before else {
        return true;
    };
    let asked = &inputs.recipe.output.response_at;
    is_last || asked.iter().any(|&at| before < at && at <= cycles)
}

/// The response of this state of wear over the frequency range, and its resonance, without feeding them back.
pub fn worn_response(
    inputs: &Inputs,
    vibrating: &Vibrating,
    clock: &mut Clock,
    draft: &mut Draft,
    keys: &VibrationKeys,
    parameters: &ElementParameters,
    shaken: &Shaken,
) -> Result<(), RunError> {
    let key = &keys.dynamic_response;
    if is_kept(draft, TableName::WornResponse, key)? && is_kept(draft, TableName::Frf, key)? {
        return Ok(());
    }
    let (wear_iteration, observer) = (clock.wear_iteration, clock.observer);
    let (row, frf) = clock.timed(Stage::DynamicResponse, || {
        let vibration = &vibrating.vibration;
        let elements = vibrating.contact_elements(&inputs.recipe, parameters);
        let tolerance = inputs
            .recipe
            .response
            .as_ref()
            .and_then(|r| r.harmonic_tolerance);
        let (balance, resonance) = match tolerance {
            Some(_) => vibration
                .resolve(
                    elements,
                    Some((&shaken.harmonics, &shaken.start)),
                    tolerance,
                )
                .map(|resolved| {
                    tell_missed(observer, tolerance, &resolved);
                    (resolved.balance, resolved.resonance)
                }),
            // Their errors are in no table.
            None => vibration.balance(elements).and_then(|balance| {
                let resonance = vibration.resonance(&balance, Some(&shaken.start))?;
                Ok((balance, resonance))
            }),
        }
        .map_err(fail(wear_iteration))?;
        let energy = resonance.phase.energy;
        let row = typed::WornResponse {
            resonance_frequency: resonance.phase.frequency(),
            resonance_amplitude: resonance.amplitude,
            peak_frequency: resonance.peak_frequency,
            peak_amplitude: resonance.peak_amplitude,
            input_energy: energy.input,
            friction_energy: energy.friction,
            viscous_energy: energy.viscous,
        };
        let frf = forced_response(inputs, vibration, balance, wear_iteration)?;
        Ok((row, frf))
    })?;
    put(draft, key, &row)?;
    put(draft, key, &frf)
}

/// The `frf` table.
pub fn forced_response(
    inputs: &Inputs,
    vibration: &Vibration,
    balance: HarmonicBalance<ContactElement>,
    wear_iteration: u64,
) -> Result<typed::Frf, RunError> {
    let response = inputs.recipe.response.as_ref();
    let force = balance
        .drive()
        .map_or(0.0, |load| load.cosine.hypot(load.sine));
    let points = vibration
        .forced_response(balance, response.and_then(|response| response.points))
        .map_err(fail(wear_iteration))?;
    let series = |value: fn(&ForcedPoint) -> f64| points.iter().map(value).collect::<Vec<f64>>();
    Ok(typed::Frf {
        force: vec![force; points.len()],
        frequency: series(|p| p.frequency),
        amplitude: series(|p| p.amplitude),
        phase_lag: series(|p| p.phase_lag),
        input_energy: series(|p| p.energy.input),
        friction_energy: series(|p| p.energy.friction),
        viscous_energy: series(|p| p.energy.viscous),
        active_elements: points.iter().map(|p| p.active_elements as i64).collect(),
    })
}

fn row(
    layout: &Layout,
    resolved: &Resolved,
    cycle: &JointCycle,
    summary: &JointSummary,
) -> typed::DynamicResponse {
    let Resolved {
        balance,
        resonance,
        truncation,
        ..
    } = resolved;
    let phase = &resonance.phase;
    let closure = ClosureEnergy::new(
        balance.elements(),
        &phase.displacement,
        balance.sampling(),
        cycle,
    );
    let count = |state| summary.count(state) as i64;
    let load: f64 = balance.elements().iter().map(|e| e.normal_load).sum();
    let [about_x, about_y, about_n] = cycle.moment_variation(load * layout.lever);
    let mean = summary.displacement[0];
    let away = (summary.largest_displacement[0] - mean).max(mean - summary.least_displacement[0]);
    let spread = if mean > 0.0 { away / mean } else { 0.0 };
    let energy = phase.energy;
    typed::DynamicResponse {
        resonance_frequency: phase.frequency(),
        resonance_amplitude: resonance.amplitude,
        peak_frequency: resonance.peak_frequency,
        peak_amplitude: resonance.peak_amplitude,
        input_energy: energy.input,
        friction_energy: energy.friction,
        viscous_energy: energy.viscous,
        error_energy: energy.imbalance(),
        highest_harmonic: i64::from(balance.harmonics().highest()),
        error_resonance_frequency: truncation.frequency,
        error_peak_amplitude: truncation.amplitude,
        error_friction_energy: truncation.friction_energy,
        mean_motion_energy: closure.mean_motion,
        closure_energy: closure.error,
        iterations: resonance.iterations as i64,
        active_elements: phase.active_elements() as i64,
        sticking_elements: count(ElementState::Stick),
        slipping_elements: count(ElementState::Slip),
        open_elements: count(ElementState::Open),
        displacement_amplitude: mean,
        displacement_spread: spread,
        load_variation: summary.normal_load,
        element_load_variation: summary.largest_normal_load,
        moment_variation: about_x.max(about_y),
        torsion_variation: about_n,
    }
}

fn cycle_table(cycle: &JointCycle) -> typed::JointCycle {
    let samples = cycle.force.len();
    let of = |values: &[[f64; 3]], d: usize| values.iter().map(|v| v[d]).collect::<Vec<f64>>();
    typed::JointCycle {
        time: (0..samples).map(|k| k as f64 / samples as f64).collect(),
        displacement_x: of(&cycle.displacement, 0),
        displacement_y: of(&cycle.displacement, 1),
        displacement_n: of(&cycle.displacement, 2),
        force_x: of(&cycle.force, 0),
        force_y: of(&cycle.force, 1),
        normal_load: of(&cycle.force, 2),
        moment_x: of(&cycle.moment, 0),
        moment_y: of(&cycle.moment, 1),
        moment_z: of(&cycle.moment, 2),
    }
}

/// One row for each port and harmonic, ports slow: the harmonic coefficients are stored so that [`shaken_of`] finds them again.
fn response_table(
    inputs: &Inputs,
    balance: &HarmonicBalance<ContactElement>,
    resonance: &Resonance,
) -> typed::Response {
    let phase = &resonance.phase;
    let harmonics = balance.harmonics();
    let n = harmonics.coefficients();
    let contact = 3 * balance.elements().len();
    let points = inputs.recipe.points();
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

/// The response in force from its tables.
pub fn shaken_of(
    response: &typed::Response,
    row: &typed::DynamicResponse,
) -> Result<Shaken, RunError> {
    let orders = &response.harmonic;
    let mut displacement = Vec::with_capacity(2 * orders.len());
    let of_order = response
        .displacement_cosine
        .iter()
        .zip(&response.displacement_sine);
    for (order, (cosine, sine)) in orders.iter().zip(of_order) {
        displacement.push(*cosine);
        if *order > 0 {
            displacement.push(*sine);
        }
    }
    let mut of_a_port = orders
        .iter()
        .map(|order| *order as u32)
        .collect::<Vec<u32>>();
    of_a_port.sort_unstable();
    of_a_port.dedup();
    Ok(Shaken {
        harmonics: Harmonics::new(&of_a_port)?,
        start: Start {
            omega: row.resonance_frequency * std::f64::consts::TAU,
            load_factor: 1.0,
            displacement,
        },
        resonance_frequency: row.resonance_frequency,
        peak_frequency: row.peak_frequency,
        peak_amplitude: row.peak_amplitude,
        friction_energy: row.friction_energy,
        closure_energy: row.closure_energy,
        truncation: Truncation {
            frequency: row.error_resonance_frequency,
            amplitude: row.error_peak_amplitude,
            friction_energy: row.error_friction_energy,
        },
    })
}
