//! What the decided things cost: estimates from runs of the shipped pipelines, that say what kind of cost to expect, not its digits.

use super::memory::{self, Sizes};
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
    // Response, force and parameters of every element.
    let vibration = (unknowns * 16 + contact_elements * 56) as f64;
    let mut sizes = Sizes {
        cells: 0.0,
        padding: 1.0,
        shear,
        limits: None,
        implicit: false,
        structure: scene.structure.as_ref(),
        contact_elements,
    };
    let Some(rough) = scene.rough() else {
        let (memory, memory_cached) = memory::peak(&sizes);
        return Cost {
            contact_elements,
            unknowns,
            cells: 0,
            plane: [0; 2],
            memory,
            memory_cached,
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
        (Some(March::Reversal | March::Superposition), _) | (None, Some(_)) => TANGENTIAL * axes,
        (None, None) => 0.0,
    };
    sizes.cells = patch.grid.len() as f64;
    sizes.padding = (plane[0] * plane[1]) as f64 / sizes.cells;
    sizes.implicit = scene
        .wear
        .as_ref()
        .is_some_and(|wear| wear.scheme == Scheme::Implicit);
    let asks_stepped = scene.fidelity.cycle == Some(crate::scene::CycleMode::Stepped);
    sizes.limits = match (march, &scene.dynamics) {
        (Some(March::Stepped), _) => motion
            .filter(|motion| !motion.constant_load())
            .map(Motion::samples)
            .or(Some(1)),
        (None, Some(_)) if asks_stepped => Some(scene.fidelity.steps_per_cycle),
        (None, None) => None,
        _ => Some(1),
    };
    let stiffness = STIFFNESS * (1.0 + axes);
    let (step, iterations) = match scene.wear.as_ref().map(|wear| wear.scheme) {
        None => (0.0, 0.0),
        // Two-stage step: three normal contacts and a cycle in its middle.
        Some(Scheme::Implicit) => (3.0 * NORMAL + cycle, 20.0),
        Some(Scheme::SemiImplicit) => (NORMAL, 230.0),
        Some(Scheme::Explicit) => (0.0, 230.0),
    };
    let kept = patch.cells() as f64;
    let (memory, memory_cached) = memory::peak(&sizes);
    Cost {
        contact_elements,
        unknowns,
        cells: patch.cells(),
        plane,
        memory,
        memory_cached,
        disk_per_iteration: (kept * (8.0 + 0.5 * axes) + vibration) as u64,
        pairs_per_iteration: NORMAL + stiffness + cycle + step,
        iterations,
    }
}
