//! All stages.

use super::declaration::Declaration;
use super::{
    coarse_trajectory, dynamic_response, forced_response, fretting_cycle, grid_twin, ledger,
    model_update, reference, static_contact, structure, summary, surface, wear,
};
use crate::recipe::Recipe;

/// All stages, in the order in which they run.
pub const STAGES: [&Declaration; 14] = [
    &structure::DECLARATION,
    &surface::DECLARATION,
    &reference::DECLARATION,
    &grid_twin::DECLARATION,
    &wear::UNWORN,
    &wear::DECLARATION,
    &static_contact::DECLARATION,
    &model_update::DECLARATION,
    &dynamic_response::DECLARATION,
    &forced_response::DECLARATION,
    &fretting_cycle::DECLARATION,
    &coarse_trajectory::DECLARATION,
    &ledger::DECLARATION,
    &summary::DECLARATION,
];

/// Returns the stages of a recipe, in their order.
pub fn stages_of(recipe: &Recipe) -> impl Iterator<Item = &'static Declaration> {
    STAGES.into_iter().filter(|stage| stage.is_in(recipe))
}
