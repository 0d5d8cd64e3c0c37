//! Inputs of a run on a coarser grid.

use std::sync::Arc;

use super::{CELLS_PER_LENGTH, FEWEST_CELLS, GRID_RATIO, LARGEST_GRID_RATIO, MOST_CELLS};
use crate::contact::Boundary;
use crate::fft::fast_length;
use crate::recipe::{Inputs, Recipe};
use crate::surface::prepare::{self, Detrend, Fill, PrepareOptions};
use crate::surface::topography::Topography;

/// Returns the ratio of the coarse grid's cells along a side to the scene's; 1 if there is no coarser grid.
pub(super) fn grid_ratio(recipe: &Recipe) -> f64 {
    let Some(surface) = recipe.surface() else {
        return 1.0;
    };
    let longest = surface.grid[0].max(surface.grid[1]) as f64;
    let elements = surface.cells.element_counts();
    let length = surface.heights.correlation_length();
    let least = [0, 1].map(|axis| {
        let resolved = length.map_or(0.0, |length| {
            CELLS_PER_LENGTH * surface.size[axis] / length[axis]
        });
        let fewest = FEWEST_CELLS.max(elements[axis]) as f64;
        resolved.ceil().max(fewest) / surface.grid[axis] as f64
    });
    let ratio = GRID_RATIO.min(MOST_CELLS as f64 / longest);
    let ratio = ratio.max(least[0]).max(least[1]);
    if ratio > LARGEST_GRID_RATIO {
        1.0
    } else {
        ratio
    }
}

/// Returns the inputs on a grid with `ratio` times the cells along each side. Returns `None` if a measured
/// surface does not fit onto that grid.
pub(super) fn on_grid(inputs: &Inputs, ratio: f64) -> Option<Inputs> {
    let mut coarse = inputs.clone();
    let output = &mut coarse.recipe.output;
    let joint = coarse.recipe.joints.first_mut()?;
    let surface = joint.surface.as_mut()?;
    let contact = joint.contact.as_mut()?;
    let grid = surface
        .grid
        .map(|cells| (ratio * cells as f64).round() as usize);
    if let Some(fields) = &mut output.cycle_fields {
        fields.on_grid(surface.grid, grid);
    }
    surface.grid = grid;
    let patch = surface.patch().ok()?;
    surface.kept = patch.cells();
    contact.plane = match contact.conditions.boundary {
        Boundary::Free => grid.map(|cells| fast_length(2 * cells - 1)),
        Boundary::Periodic => grid,
    };
    if let Some(measured) = &inputs.measured {
        let on = &measured.patch;
        let heights = measured.heights.iter().zip(&on.is_in_joint);
        let topography = Topography {
            nx: on.grid.nx,
            ny: on.grid.ny,
            spacing: Some([on.grid.dx, on.grid.dy]),
            heights: heights
                .map(|(h, kept)| if *kept { *h } else { f64::NAN })
                .collect(),
        };
        let options = PrepareOptions {
            detrend: Detrend::None,
            fill: Fill::Mask,
            shift: [0.0; 2],
        };
        let prepared = prepare::onto_joint(&topography, &patch, options).ok()?;
        surface.kept = prepared.patch.cells();
        coarse.measured = Some(Arc::new(prepared));
    }
    Some(coarse)
}
