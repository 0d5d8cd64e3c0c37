//! The steady response of the structure to the contact elements in force, and of the worn state where it is asked for.

use super::context::{Clock, VibrationKeys, kept};
use super::model_update::element_table;
use super::vibrating::{Driven, Model, Shaken, Vibrating};
use super::{Inputs, Observer, RunError, Stage};
use crate::dynamics::closure::ClosureEnergy;
use crate::dynamics::cycle::{JointCycle, JointSummary, joint_cycle};
use crate::dynamics::vibration::ForcedPoint;
use crate::dynamics::{
    ContactElement, DynamicsError, ElementState, HarmonicBalance, Harmonics, Resolved, Resonance,
    Start, Truncation, Vibration,
};
use crate::model_update::ElementParameters;
use crate::scene::Plan;
use crate::scene::plan::Layout;
use crate::store::Draft;
use crate::tables::{Table, TableBuilder, TableName};

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
    if let Some(tables) = all_kept(draft, keys)? {
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
    for (name, table) in IN_FORCE.iter().zip(&driven.tables) {
        draft.put(*name, &keys.dynamic_response, table)?;
    }
    Ok(driven)
}

fn all_kept(draft: &mut Draft, keys: &VibrationKeys) -> Result<Option<[Table; 4]>, RunError> {
    let mut tables = Vec::with_capacity(IN_FORCE.len());
    for name in IN_FORCE {
        match kept(draft, name, &keys.dynamic_response)? {
            Some(table) => tables.push(table),
            None => return Ok(None),
        }
    }
    Ok(tables.try_into().ok())
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
        let elements = vibrating.contact_elements(inputs, &model.parameters);
        let start = before.map(|before| (&before.harmonics, &before.start));
        let tolerance = inputs.scene.fidelity.harmonic_tolerance;
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

/// The tables of a resonance, in the order of [`IN_FORCE`].
pub fn in_force(
    inputs: &Inputs,
    layout: &Layout,
    resolved: &Resolved,
    parameters: &ElementParameters,
) -> Result<[Table; 4], RunError> {
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
    Ok([
        response_table(inputs, balance, resonance)?,
        row(layout, resolved, &cycle, &summary)?,
        cycle_table(&cycle)?,
        element_table(layout, parameters, Some(&summary.states))?,
    ])
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
    let asked = &inputs.scene.output.response_at;
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
    if kept(draft, TableName::WornResponse, key)?.is_some()
        && kept(draft, TableName::Frf, key)?.is_some()
    {
        return Ok(());
    }
    let (wear_iteration, observer) = (clock.wear_iteration, clock.observer);
    let (row, frf) = clock.timed(Stage::DynamicResponse, || {
        let vibration = &vibrating.vibration;
        let elements = vibrating.contact_elements(inputs, parameters);
        let tolerance = inputs.scene.fidelity.harmonic_tolerance;
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
        let row = figures(Table::builder(TableName::WornResponse), &resonance).build()?;
        let frf = forced_response(inputs, vibration, balance, wear_iteration)?;
        Ok((row, frf))
    })?;
    draft.put(TableName::WornResponse, key, &row)?;
    draft.put(TableName::Frf, key, &frf)?;
    Ok(())
}

/// The `frf` table.
pub fn forced_response(
    inputs: &Inputs,
    vibration: &Vibration,
    balance: HarmonicBalance<ContactElement>,
    wear_iteration: u64,
) -> Result<Table, RunError> {
    let dynamics = inputs.scene.dynamics.as_ref();
    let force = balance
        .drive()
        .map_or(0.0, |load| load.cosine.hypot(load.sine));
    let points = vibration
        .forced_response(balance, dynamics.and_then(|d| d.points))
        .map_err(fail(wear_iteration))?;
    let series = |value: fn(&ForcedPoint) -> f64| points.iter().map(value).collect::<Vec<f64>>();
    Ok(Table::builder(TableName::Frf)
        .column("force", vec![force; points.len()])
        .column("frequency", series(|p| p.frequency))
        .column("amplitude", series(|p| p.amplitude))
        .column("phase_lag", series(|p| p.phase_lag))
        .column("input_energy", series(|p| p.energy.input))
        .column("friction_energy", series(|p| p.energy.friction))
        .column("viscous_energy", series(|p| p.energy.viscous))
        .column(
            "active_elements",
            points
                .iter()
                .map(|p| p.active_elements as i64)
                .collect::<Vec<_>>(),
        )
        .build()?)
}

fn figures(table: TableBuilder, resonance: &Resonance) -> TableBuilder {
    let energy = resonance.phase.energy;
    table
        .column("resonance_frequency", vec![resonance.phase.frequency()])
        .column("resonance_amplitude", vec![resonance.amplitude])
        .column("peak_frequency", vec![resonance.peak_frequency])
        .column("peak_amplitude", vec![resonance.peak_amplitude])
        .column("input_energy", vec![energy.input])
        .column("friction_energy", vec![energy.friction])
        .column("viscous_energy", vec![energy.viscous])
}

fn row(
    layout: &Layout,
    resolved: &Resolved,
    cycle: &JointCycle,
    summary: &JointSummary,
) -> Result<Table, RunError> {
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
    let count = |state| vec![summary.count(state) as i64];
    let load: f64 = balance.elements().iter().map(|e| e.normal_load).sum();
    let [about_x, about_y, about_n] = cycle.moment_variation(load * layout.lever);
    let mean = summary.displacement[0];
    let away = (summary.largest_displacement[0] - mean).max(mean - summary.least_displacement[0]);
    let spread = if mean > 0.0 { away / mean } else { 0.0 };
    Ok(
        figures(Table::builder(TableName::DynamicResponse), resonance)
            .column("error_energy", vec![phase.energy.imbalance()])
            .column(
                "highest_harmonic",
                vec![i64::from(balance.harmonics().highest())],
            )
            .column("error_resonance_frequency", vec![truncation.frequency])
            .column("error_peak_amplitude", vec![truncation.amplitude])
            .column("error_friction_energy", vec![truncation.friction_energy])
            .column("mean_motion_energy", vec![closure.mean_motion])
            .column("closure_energy", vec![closure.error])
            .column("iterations", vec![resonance.iterations as i64])
            .column("active_elements", vec![phase.active_elements() as i64])
            .column("sticking_elements", count(ElementState::Stick))
            .column("slipping_elements", count(ElementState::Slip))
            .column("open_elements", count(ElementState::Open))
            .column("displacement_amplitude", vec![mean])
            .column("displacement_spread", vec![spread])
            .column("load_variation", vec![summary.normal_load])
            .column("element_load_variation", vec![summary.largest_normal_load])
            .column("moment_variation", vec![about_x.max(about_y)])
            .column("torsion_variation", vec![about_n])
            .build()?,
    )
}

fn cycle_table(cycle: &JointCycle) -> Result<Table, RunError> {
    let samples = cycle.force.len();
    let of = |values: &[[f64; 3]], d: usize| values.iter().map(|v| v[d]).collect::<Vec<f64>>();
    Ok(Table::builder(TableName::JointCycle)
        .column(
            "time",
            (0..samples)
                .map(|k| k as f64 / samples as f64)
                .collect::<Vec<_>>(),
        )
        .column("displacement_x", of(&cycle.displacement, 0))
        .column("displacement_y", of(&cycle.displacement, 1))
        .column("displacement_n", of(&cycle.displacement, 2))
        .column("force_x", of(&cycle.force, 0))
        .column("force_y", of(&cycle.force, 1))
        .column("normal_load", of(&cycle.force, 2))
        .column("moment_x", of(&cycle.moment, 0))
        .column("moment_y", of(&cycle.moment, 1))
        .column("moment_z", of(&cycle.moment, 2))
        .build()?)
}

/// One row for each port and harmonic, ports slow: the harmonic coefficients are stored so that [`shaken_of`] finds them again.
fn response_table(
    inputs: &Inputs,
    balance: &HarmonicBalance<ContactElement>,
    resonance: &Resonance,
) -> Result<Table, RunError> {
    let phase = &resonance.phase;
    let harmonics = balance.harmonics();
    let n = harmonics.coefficients();
    let contact = 3 * balance.elements().len();
    let points = Plan::points(&inputs.scene);
    let mut table = Columns::default();
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
            table.displacement.push(pair(displacement));
            table.force.push(force.map_or([0.0; 2], pair));
        }
    }
    let of = |values: &[[f64; 2]], d: usize| values.iter().map(|v| v[d]).collect::<Vec<f64>>();
    Ok(Table::builder(TableName::Response)
        .column("displacement_cosine", of(&table.displacement, 0))
        .column("displacement_sine", of(&table.displacement, 1))
        .column("force_cosine", of(&table.force, 0))
        .column("force_sine", of(&table.force, 1))
        .column("element", table.element)
        .column("point", table.point)
        .column("axis", table.axis)
        .column("harmonic", table.harmonic)
        .build()?)
}

#[derive(Default)]
struct Columns {
    element: Vec<i32>,
    point: Vec<String>,
    axis: Vec<String>,
    harmonic: Vec<i32>,
    displacement: Vec<[f64; 2]>,
    force: Vec<[f64; 2]>,
}

/// The response in force from its tables.
pub fn shaken_of(response: &Table, row: &Table) -> Result<Shaken, RunError> {
    let (cosine, sine) = (
        response.f64("displacement_cosine")?,
        response.f64("displacement_sine")?,
    );
    let orders = response.i32("harmonic")?;
    let mut displacement = Vec::with_capacity(2 * orders.len());
    for ((order, cosine), sine) in orders.iter().zip(cosine).zip(sine) {
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
    let number = |column: &str| row.f64(column).map(|values| values[0]);
    let resonance_frequency = number("resonance_frequency")?;
    Ok(Shaken {
        harmonics: Harmonics::new(&of_a_port)?,
        start: Start {
            omega: resonance_frequency * std::f64::consts::TAU,
            load_factor: 1.0,
            displacement,
        },
        resonance_frequency,
        peak_frequency: number("peak_frequency")?,
        peak_amplitude: number("peak_amplitude")?,
        friction_energy: number("friction_energy")?,
        closure_energy: number("closure_energy")?,
        truncation: Truncation {
            frequency: number("error_resonance_frequency")?,
            amplitude: number("error_peak_amplitude")?,
            friction_energy: number("error_friction_energy")?,
        },
    })
}
