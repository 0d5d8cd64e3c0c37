//! Linear resonances of the unworn joint of a scene, for planning.

use super::RunError;
use super::backbone::unworn;
use super::dynamic_response::{contact_elements, dynamics_error};
use super::forced_response;
use super::observer::Observer;
use super::solvers::{element_layout, given_parameters};
use crate::dynamics::LinearResonances;
use crate::recipe::Inputs;
use crate::store::Cache;
use crate::tables::typed;

/// Computes the linear resonances of the unworn joint of a scene in memory. If there is a cache, a reduced structure
/// is stored there. Nothing else is written. The inner `Err` reports that no mode lies in the range.
///
/// # Errors
/// Errors of the stages before the response.
///
/// # Panics
/// If the recipe lacks structure or response.
pub fn linear_resonances(
    inputs: &Inputs,
    cache: Option<&Cache>,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Result<LinearResonances, Vec<f64>>, RunError> {
    unworn(inputs, cache, threads, observer, false, |reads, solvers| {
        let vibration = solvers.vibration(reads)?;
        let parameters = match reads.optional_table::<typed::ModelUpdate>()? {
            Some(update) => forced_response::worn_elements(reads, solvers, &update)?,
            None => given_parameters(reads),
        };
        let elements = contact_elements(reads, &parameters, 1.0);
        let has_contact = reads.recipe.elements().is_some();
        let centres = match has_contact {
            true => element_layout(reads).centres,
            false => Vec::new(),
        };
        let resonances = vibration.linear_resonances(&elements, &centres);
        resonances.map_err(|source| dynamics_error(reads, source))
    })
}
