//! What the decided things cost: estimates from runs of the shipped pipelines, that say what kind of cost to expect, not its digits.

use super::{Cost, rough};
use crate::contact::Shear;
use crate::scene::{Scene, Scheme};
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Pairs of a normal solve from a similar state, of a tangential solve an axis, of a stiffness solve an axis.
const NORMAL: f64 = 25.0;
const TANGENTIAL: f64 = 25.0;
const STIFFNESS: f64 = 20.0;
/// Cycles until a stepped march closes.
const CYCLES: f64 = 2.0;
/// Peak memory while the shipped resonator is reduced \[B\], measured: the factor of its stiffness and the solves at its ports.
const STRUCTURE: f64 = 525e6;

pub(super) fn cost(
    scene: &Scene,
    motion: Option<&Motion>,
    shear: Shear,
    march: Option<March>,
) -> Cost {
    let contact_elements = super::vibration::contact_elements(scene);
    let unknowns = scene.dynamics.as_ref().map_or(0, |dynamics| {
        3 * contact_elements * (2 * dynamics.harmonics.len() - 1)
    });
    let structure = match &scene.structure {
        Some(crate::scene::Structure::Resonator { .. }) => STRUCTURE,
        _ => 0.0,
    };
    // Response, force and parameters of every element.
    let vibration = (unknowns * 16 + contact_elements * 56) as f64;
    let Some(rough) = scene.rough() else {
        return Cost {
            contact_elements,
            unknowns,
            cells: 0,
            plane: [0; 2],
            memory: structure as u64,
            disk_per_iteration: vibration as u64,
            pairs_per_iteration: 0.0,
            iterations: 0.0,
        };
    };
    let patch = rough.patch();
    let plane = rough::plane(patch.grid, rough.contact.boundary);
    let axes = match shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    };
    let (kernels, fields) = (3.0 * axes - 2.0, 24.0 + 8.0 * axes);
    let spectrum = (plane[0] * (plane[1] / 2 + 1)) as f64;
    let cells = patch.grid.len() as f64;
    let doubles = spectrum * (1.0 + kernels)
        + cells * (1.0 + kernels) * 0.5
        + cells * (2.0 + 2.0 * axes)
        + cells * fields;
    let stepped = |samples: usize, constant: bool| {
        let loads = if constant { 0.0 } else { NORMAL };
        samples as f64 * (loads + CYCLES * TANGENTIAL * axes)
    };
    let cycle = match (march, &scene.dynamics) {
        (Some(March::Stepped), _) => motion.map_or(0.0, |motion| {
            stepped(motion.samples(), motion.constant_load())
        }),
        (None, Some(_)) if scene.fidelity.cycle == Some(crate::scene::CycleMode::Stepped) => {
            stepped(scene.fidelity.steps_per_cycle, false)
        }
        (Some(March::Reversal), _) | (None, Some(_)) => TANGENTIAL * axes,
        (None, None) => 0.0,
    };
    let stiffness = STIFFNESS * (1.0 + axes);
    let (step, iterations) = match scene.wear.as_ref().map(|wear| wear.scheme) {
        None => (0.0, 0.0),
        // Two-stage step: three normal contacts and a cycle in its middle.
        Some(Scheme::Implicit) => (3.0 * NORMAL + cycle, 20.0),
        Some(Scheme::Explicit) => (0.0, 230.0),
    };
    let kept = patch.cells() as f64;
    Cost {
        contact_elements,
        unknowns,
        cells: patch.cells(),
        plane,
        memory: (8.0 * doubles + structure) as u64,
        disk_per_iteration: (kept * (8.0 + 0.5 * axes) + vibration) as u64,
        pairs_per_iteration: NORMAL + stiffness + cycle + step,
        iterations,
    }
}
