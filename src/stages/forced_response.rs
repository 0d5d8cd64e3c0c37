//! The response over the frequency range, without feeding it back: of the worn joint, where it is asked for.

use super::RunError;
use super::contact_elements::parameters;
use super::contact_state::{harmonics_of, parameters_of};
use super::declaration::Declaration;
use super::dynamic_response::{
    contact_elements, failed, harmonic_tolerance, start_of, tell_missed,
};
use super::reads::{Outputs, Reads};
use super::reduced;
use super::solvers::{Solvers, given};
use super::stage::{Stage, When};
use crate::dynamics::vibration::ForcedPoint;
use crate::dynamics::{ContactElement, HarmonicBalance, Resonance, Vibration};
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
        Part::Elements,
        Part::Response,
    ],
    reads: &[
        reduced::TABLES[0],
        reduced::TABLES[1],
        reduced::TABLES[2],
        reduced::TABLES[3],
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
    ],
    before: &[],
    writes: &[TableName::Frf, TableName::WornResponse],
    is_due: |moment| moment.response_due,
    shared: false,
    compute,
};

fn compute(reads: &Reads, solvers: &mut Solvers) -> Result<Outputs, RunError> {
    let mut outputs = Outputs::default();
    let vibration = solvers.vibration(reads)?;
    let balance = match reads.maybe::<typed::ModelUpdate>()? {
        Some(update) => {
            let parameters = match update.updated {
                true => parameters_of(&reads.table()?, reads.maybe()?),
                false => parameters(reads, solvers, &reads.table()?, &reads.table()?)?.0,
            };
            let (balance, resonance) = worn(reads, &vibration, &parameters, &mut outputs)?;
            outputs.put(&row(&resonance))?;
            balance
        }
        None => {
            let elements = contact_elements(reads, &given(reads));
            let response = reads.maybe::<typed::Response>()?;
            let harmonics = match response {
                Some(response) => harmonics_of(&response)?.0,
                None => vibration.harmonics.clone(),
            };
            let balance = vibration.balance_of(elements, harmonics);
            balance.map_err(|source| failed(reads, source))?
        }
    };
    outputs.put(&forced_response(reads, &vibration, balance)?)?;
    Ok(outputs)
}

/// The worn joint with its resonance, from the response in force.
fn worn(
    reads: &Reads,
    vibration: &Vibration,
    parameters: &ElementParameters,
    outputs: &mut Outputs,
) -> Result<(HarmonicBalance<ContactElement>, Resonance), RunError> {
    let (harmonics, start) = start_of(&reads.table()?, &reads.table()?)?;
    let elements = contact_elements(reads, parameters);
    let tolerance = harmonic_tolerance(&reads.recipe);
    let found = match tolerance {
        Some(_) => vibration
            .resolve(elements, Some((&harmonics, &start)), tolerance)
            .map(|resolved| {
                tell_missed(outputs, tolerance, &resolved);
                (resolved.balance, resolved.resonance)
            }),
        // Their errors are in no table.
        None => vibration.balance(elements).and_then(|balance| {
            let resonance = vibration.resonance(&balance, Some(&start))?;
            Ok((balance, resonance))
        }),
    };
    found.map_err(|source| failed(reads, source))
}

fn row(resonance: &Resonance) -> typed::WornResponse {
    let energy = resonance.phase.energy;
    typed::WornResponse {
        resonance_frequency: resonance.phase.frequency(),
        resonance_amplitude: resonance.amplitude,
        peak_frequency: resonance.peak_frequency,
        peak_amplitude: resonance.peak_amplitude,
        input_energy: energy.input,
        friction_energy: energy.friction,
        viscous_energy: energy.viscous,
    }
}

/// The `frf` table.
fn forced_response(
    reads: &Reads,
    vibration: &Vibration,
    balance: HarmonicBalance<ContactElement>,
) -> Result<typed::Frf, RunError> {
    let response = reads.recipe.response.as_ref();
    let force = balance
        .drive()
        .map_or(0.0, |load| load.cosine.hypot(load.sine));
    let points = vibration
        .forced_response(balance, response.and_then(|response| response.points))
        .map_err(|source| failed(reads, source))?;
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
