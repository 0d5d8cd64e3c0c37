//! Inputs of a run on a coarser grid.

use std::sync::Arc;

use crate::contact::Boundary;
use crate::fft::fast_length;
use crate::recipe::{Inputs, Recipe, Surface};
use crate::surface::correlation::autocorrelation;
use crate::surface::prepare::{self, Detrend, Fill, PrepareOptions};
use crate::surface::topography::Topography;
use crate::wear::cycle::March;

/// Cells a correlation length, below which a grid has another surface.
const CELLS_PER_LENGTH: f64 = 2.0;
/// Cells a side, below which a contact is a handful of cells.
const FEWEST_CELLS: usize = 24;
/// Part of its wavelength over which a wave is correlated: cos(2πx) = 1/e.
const OF_WAVELENGTH: f64 = 0.19;
/// Cells across the contact radius of a sphere.
const CELLS_PER_RADIUS: f64 = 4.0;
/// Samples of a cycle that is to show no more than how wear goes on: its two ends and the middles between them, and as many again.
const FEW_SAMPLES: usize = 8;

/// The least part of the grid's counts, up to 1, that a rehearsal may have.
pub(super) fn coarsest(inputs: &Inputs) -> f64 {
    let Some(surface) = inputs.recipe.surface() else {
        return 1.0;
    };
    let lengths = cell_lengths(inputs, surface);
    let least = |axis: usize| {
        let resolved = lengths[axis].map_or(0.0, |cell| (surface.size[axis] / cell).ceil());
        let elements = surface.cells.element_counts()[axis];
        let cells = resolved.max(FEWEST_CELLS.max(elements) as f64);
        cells / surface.grid[axis] as f64
    };
    least(0).max(least(1)).min(1.0)
}

/// The longest cell along each axis that shows the surface \[m\]; none where any does.
fn cell_lengths(inputs: &Inputs, surface: &Surface) -> [Option<f64>; 2] {
    let correlated = |length: [Option<f64>; 2]| length.map(|l| l.map(|l| l / CELLS_PER_LENGTH));
    let heights = &surface.heights;
    if let Some(length) = heights.correlation_length() {
        return correlated(length.map(Some));
    }
    if let Some(wavelength) = heights.rolloff_wavelength() {
        return correlated([Some(OF_WAVELENGTH * wavelength); 2]);
    }
    if let Some(radius) = heights.sphere_radius() {
        let contact = inputs.recipe.contact();
        let of_contact = contact.map(|contact| match contact.approach {
            Some(approach) => (radius * approach).sqrt(),
            // Hertz: a³ = 3 N R / (4 E*).
            None => {
                let modulus = contact.bodies.effective_modulus();
                (0.75 * contact.normal_load * radius / modulus).cbrt()
            }
        });
        return [of_contact.map(|radius| radius / CELLS_PER_RADIUS); 2];
    }
    let measured = inputs.measured.as_deref();
    let correlation = measured.map(|on| autocorrelation(&on.patch, &on.heights));
    let correlation = correlation.and_then(Result::ok);
    correlated(correlation.map_or([None; 2], |found| found.correlation_length()))
}

/// The counts of a grid with this part of the scene's counts.
pub(super) fn counts(recipe: &Recipe, part: f64) -> [usize; 2] {
    let grid = recipe.surface().map_or([0; 2], |surface| surface.grid);
    grid.map(|cells| (part * cells as f64).round() as usize)
}

/// The inputs on a grid of these counts: the surface is the one of the scene as that grid shows it. None where a measured surface
/// cannot be brought onto it.
pub(super) fn on_grid(inputs: &Inputs, grid: [usize; 2]) -> Option<Inputs> {
    let mut coarse = inputs.clone();
    let output = &mut coarse.recipe.output;
    output.keep = crate::recipe::Keep::All;
    let Some(joint) = coarse.recipe.joints.first_mut() else {
        return Some(coarse);
    };
    let (Some(surface), Some(contact)) = (&mut joint.surface, &mut joint.contact) else {
        return Some(coarse);
    };
    if let Some(fields) = &mut output.cycle_fields {
        fields.on_grid(surface.grid, grid);
    }
    surface.grid = grid;
    let patch = surface.patch().ok()?;
    surface.kept = patch.cells();
    contact.plane = plane(grid, contact.boundary);
    if let Some(measured) = &inputs.measured {
        let on = &measured.patch;
        let heights = measured.heights.iter().zip(&on.kept);
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
        };
        let prepared = prepare::onto_joint(&topography, &patch, options).ok()?;
        surface.kept = prepared.patch.cells();
        coarse.measured = Some(Arc::new(prepared));
    }
    Some(coarse)
}

/// Points of the plane that fields on a grid are transformed on.
fn plane(grid: [usize; 2], boundary: Boundary) -> [usize; 2] {
    match boundary {
        Boundary::Free => grid.map(|cells| fast_length(2 * cells - 1)),
        Boundary::Periodic => grid,
    }
}

/// Inputs with few samples of their cycle, and none of them for an extrapolation, and how many times as many the given inputs have; none
/// where what is prescribed is not stepped.
pub(super) fn with_few_samples(inputs: &Inputs) -> Option<(Inputs, f64)> {
    let mut inputs = inputs.clone();
    let samples = inputs.motion.samples();
    let cycle = inputs.recipe.joints.first_mut()?.cycle.as_mut()?;
    let every = samples / FEW_SAMPLES;
    if cycle.march != Some(March::Stepped) || every < 2 {
        return None;
    }
    // Half of the samples are marched too where a cycle is extrapolated.
    let marched = if cycle.extrapolate { 1.5 } else { 1.0 };
    cycle.steps = cycle.steps.div_ceil(every);
    cycle.extrapolate = false;
    inputs.motion = inputs.motion.every(every);
    let times = marched * samples as f64 / inputs.motion.samples() as f64;
    Some((inputs, times))
}
