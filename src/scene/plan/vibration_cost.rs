//! What the structure and its vibration are expected to cost, in operations on dense matrices: both spend their time in those.

use super::before::{Before, reach_at_resonance};
use crate::scene::{Scene, Structure, Update};

/// The reduction of a resonator, fitted to meshes of 5900 to 18 000 elements: operations by the power of its elements by which
/// the work of a factor of nested dissection grows here, and by the square of its contact's degrees of freedom.
const FACTOR: f64 = 7.5e5;
const FILL: f64 = 4.0 / 3.0;
const AT_PORTS: f64 = 5.7e4;
/// Points that continuation places in a range of a resonance.
const POINTS: f64 = 97.0;
/// A resonance, in points of a forced response: its search, its peak, what the worn joint is stiffer, and the same with more
/// harmonics for the error of those left out.
const RESONANCE: f64 = 25.0;
/// What the first one takes more, which has no other to start from.
const FIRST: f64 = 60.0;
/// Operations of a point by the contact's degrees of freedom squared and the coefficients of each where all of them slide: Newton
/// steps, and Krylov ones in them.
const POINT: f64 = 1430.0;
/// And at least.
const LEAST: f64 = 5e7;
/// Reach of the motion at which nearly all elements slide, how their share falls below, and the least that is active.
const ALL_SLIDE: f64 = 1.6;
const SHARE: f64 = 3.5;
const LEAST_SHARE: f64 = 0.05;
/// Power of the part that does not bear yet, by which the compliance of roughness falls as it is worn.
const WORN_COMPLIANCE: i32 = 4;

/// What is expected of the vibrations of a run.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Vibrations {
    /// Updates of the model after the first.
    pub updates: f64,
    /// Forced responses, the unworn joint's among them.
    pub forced: f64,
    pub structure_operations: f64,
    pub response_operations: f64,
}

/// `area` is the part in contact at the end, after these wear iterations.
pub(super) fn vibrations(
    scene: &Scene,
    before: Option<&Before>,
    iterations: f64,
    area: f64,
    unknowns: usize,
    contact_elements: usize,
) -> Vibrations {
    let (Some(structure), Some(dynamics)) = (&scene.structure, &scene.dynamics) else {
        return Vibrations::default();
    };
    let updates = updates(scene, before, iterations, area);
    let worn = if scene.wear.is_some() { 1.0 } else { 0.0 };
    let forced = 1.0 + worn * (1.0 + scene.output.response_at.len() as f64);
    let points = dynamics.points.map_or(POINTS, |points| points as f64);
    let friction = scene.contact.as_ref().map_or(0.0, |contact| {
        contact.friction_coefficient.unwrap_or(0.0) * contact.normal_load
    });
    let share = (reach_at_resonance(scene, friction) / ALL_SLIDE).powf(SHARE);
    let point =
        POINT * 3.0 * contact_elements as f64 * unknowns as f64 * share.clamp(LEAST_SHARE, 1.0)
            + LEAST;
    let resonances = if scene.wear.is_some() {
        updates + forced
    } else {
        1.0
    };
    Vibrations {
        updates,
        forced,
        structure_operations: match structure {
            Structure::Oscillator { .. } => 0.0,
            Structure::Resonator { geometry } => {
                let cells = geometry.mesh().map_or(0, |mesh| mesh.mesh.elements.len());
                let ports = 3.0 * contact_elements as f64;
                FACTOR * (cells as f64).powf(FILL) + AT_PORTS * ports * ports
            }
        },
        response_operations: point * (forced * points + FIRST + resonances * RESONANCE),
    }
}

/// Updates of the model, after the first elements.
pub(super) fn updates(scene: &Scene, before: Option<&Before>, iterations: f64, area: f64) -> f64 {
    let (Some(update), Some(before)) = (scene.update, before) else {
        return 0.0;
    };
    let updates = match update {
        Update::Iterations(every) => (iterations / every as f64).floor(),
        Update::WearVolume(volume) => scene
            .wear
            .as_ref()
            .and_then(|wear| wear.volume)
            .map_or(iterations, |all| (all / volume).floor()),
        Update::StiffnessChange(change) => {
            let worn = before.bulk + before.roughness * (1.0 - area).powi(WORN_COMPLIANCE);
            let stiffer = (before.bulk + before.roughness) / worn.max(f64::MIN_POSITIVE);
            (stiffer.ln() / change.ln_1p()).floor()
        }
    };
    updates.min(iterations)
}
