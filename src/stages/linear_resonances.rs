//! The linear resonances of the unworn joint of a scene, for who plans it.

use super::RunError;
use super::backbone::unworn;
use super::dynamic_response::{contact_elements, failed};
use super::forced_response;
use super::observer::Observer;
use super::solvers::{given, layout};
use crate::dynamics::LinearResonances;
use crate::recipe::Inputs;
use crate::store::Cache;
use crate::tables::typed;

/// The linear resonances of the unworn joint of a scene, which is computed in memory; nothing is written but, where there is a cache, a reduced
/// structure. None without a mode in the range.
///
/// # Errors
/// Those of the stages before the response.
///
/// # Panics
/// On a recipe without structure and response.
pub fn linear_resonances(
    inputs: &Inputs,
    cache: Option<&Cache>,
    threads: usize,
    observer: &dyn Observer,
) -> Result<Result<LinearResonances, Vec<f64>>, RunError> {
    unworn(inputs, cache, threads, observer, false, |reads, solvers| {
        let vibration = solvers.vibration(reads)?;
        let parameters = match reads.maybe::<typed::ModelUpdate>()? {
            Some(update) => forced_response::worn_elements(reads, solvers, &update)?,
            None => given(reads),
        };
        let elements = contact_elements(reads, &parameters, 1.0);
        let has_contact = reads.recipe.elements().is_some();
        let centres = match has_contact {
            true => layout(reads).centres,
            false => Vec::new(),
        };
        let found = vibration.linear_resonances(&elements, &centres);
        found.map_err(|source| failed(reads, source))
    })
}
