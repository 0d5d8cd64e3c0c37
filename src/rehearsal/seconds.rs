//! Time that a run will take on this machine. No other number depends on it.

use serde::Serialize;

use super::{Cost, Found};
use crate::contact::HalfSpace;
use crate::doctor;
use crate::grid::Grid;
use crate::recipe::{Inputs, Recipe};
use crate::stages::Stage;

/// Seconds that a run will take, one thread, without what the disk takes to commit its iterations.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Seconds {
    /// Reducing the structure, unless it is in the cache; as long as its counted operations take in dense matrices, so at least.
    pub structure: f64,
    /// Contact, cycles and wear.
    pub contact: f64,
    /// Vibrations; none where they were not rehearsed.
    pub response: Option<f64>,
}

impl Seconds {
    /// All that is known.
    pub fn total(&self) -> f64 {
        self.structure + self.contact + self.response.unwrap_or(0.0)
    }
}

/// Cells along a side of the largest plane that is measured: the scene may be more than the machine holds.
const LARGEST_MEASURED: usize = 512;

/// A pair of transforms on the plane of a recipe \[s\]. That of a larger plane than is measured follows as n log n.
fn seconds_of_pair(recipe: &Recipe) -> f64 {
    let (Some(surface), Some(contact)) = (recipe.surface(), recipe.contact()) else {
        return 1.0;
    };
    let asked = surface.grid();
    let measured = Grid::over(surface.size, surface.grid.map(|n| n.min(LARGEST_MEASURED)));
    let mut half_space = HalfSpace::new(measured, contact.bodies, contact.boundary);
    let operations = |grid: Grid| grid.len() as f64 * (grid.len() as f64).log2();
    doctor::seconds_of_pair(&mut half_space) * operations(asked) / operations(measured)
}

/// What a run will take, from what the rehearsal on the finest grid took.
pub(super) fn expected(inputs: &Inputs, found: &Found, cost: &Cost) -> Seconds {
    let steps = found.totals.steps.expected;
    let (mut contact, mut pairs, mut response) = (0.0, 0.0, None);
    for (k, iteration) in found.course.iterations.iter().enumerate() {
        // A course that was broken off stands for the whole.
        let weight = match k {
            0 => 1.0,
            _ => steps / (found.course.iterations.len() - 1) as f64,
        };
        pairs += weight * iteration.pairs.values().sum::<f64>();
        for (stage, seconds) in &iteration.seconds {
            let dynamics = [Stage::DynamicResponse, Stage::ForcedResponse];
            if dynamics.iter().any(|s| stage.starts_with(s.name())) {
                *response.get_or_insert(0.0) += weight * seconds;
            } else if !stage.starts_with(Stage::Structure.name()) {
                contact += weight * seconds;
            }
        }
    }
    if pairs > 0.0 {
        contact *= found.totals.pairs(steps) / pairs * seconds_of_pair(&inputs.recipe)
            / seconds_of_pair(&found.inputs.recipe);
    }
    let structure = match cost.structure_operations {
        0.0 => 0.0,
        operations => operations * doctor::seconds_of_operation(),
    };
    Seconds {
        structure,
        contact,
        response,
    }
}
