//! The course of wear before it is computed: how deep, in how many steps, and what is in contact by then.

use super::before::Before;
use crate::scene::{Contact, Scheme, Wear};

/// A run of wear as it is expected.
#[derive(Debug, Clone, Copy)]
pub(super) struct Course {
    /// Wear iterations.
    pub iterations: f64,
    /// By which factor they may be more or fewer.
    pub within: f64,
    /// Part of the joint in contact at the end.
    pub area: f64,
}

/// Steps of the implicit scheme at the usual tolerance: a step of second order may be longer in proportion to the cycles behind
/// it, once wear compliance is as large as the half space's own; before, it is the whole.
const RUNNING_IN: f64 = 13.4;
const HALFWAY: f64 = 6.35;
const PER_AGE: f64 = 0.91;
const USUAL: f64 = 0.01;
const ORDER: f64 = -0.556;
/// Fewer cells in contact take shorter steps, a joint that slides all over takes longer ones.
const AREA_POWER: f64 = -0.134;
const USUAL_AREA: f64 = 0.05;
const REACH_POWER: f64 = -0.144;
/// A cap evens out, the more the lower it is; so does a contact that is one smooth piece.
const CAPPED: f64 = 0.25;
const SMOOTH: f64 = 0.55;
/// The step that ends short, at the end or where a response is asked for.
const STUB: f64 = 0.9;
/// Pressure of the cell that wears fastest over the mean one in contact, and what it grows by with the area.
const FASTEST: [f64; 2] = [2.0, 5.0];
/// How much faster than that it wears where the joint does not slide all over.
const FEW: f64 = 2.2;
/// A load that varies leaves wear that the step takes explicitly.
const VARYING: f64 = 1.5;

impl Course {
    pub fn of(
        before: &Before,
        contact: &Contact,
        wear: &Wear,
        whole: f64,
        landings: usize,
        varies: bool,
    ) -> Self {
        let friction = contact.friction_coefficient.unwrap_or(0.0);
        let rate = wear.coefficient * friction * before.nominal;
        // Mean depth of a cycle, unworn.
        let depth_per_cycle = rate * 4.0 * before.onset * before.slides();
        let cycles = wear.cycles.map_or(f64::INFINITY, |cycles| cycles as f64);
        let by_volume = wear.volume.map_or(f64::INFINITY, |volume| {
            volume / (whole * depth_per_cycle).max(f64::MIN_POSITIVE)
        });
        let cycles = cycles.min(by_volume).clamp(1.0, 1e18);
        let limit = before.shakedown();
        let depth = match depth_per_cycle * cycles {
            plain if limit.is_finite() => limit * (1.0 - (-plain / limit.max(1e-300)).exp()),
            plain => plain,
        };
        let area = before.area_worn(depth);
        let by_depth = wear.depth_step.map(|depth_step| {
            let mean = FASTEST[0] * (1.0 + FASTEST[1] * before.area);
            // In partial slip the cells that wear are few.
            let few = (FEW + (1.0 - FEW) * (before.reach - 1.2) / 0.4).clamp(1.0, FEW);
            mean * few * before.cut(depth) / depth_step
        });
        let at_least = |steps: f64| steps.clamp(1.0, cycles);
        let landings = STUB * landings as f64;
        let (iterations, within) = match (wear.scheme, by_depth) {
            (Scheme::Explicit | Scheme::SemiImplicit, by_depth) => (by_depth.unwrap_or(1.0), 2.0),
            (Scheme::Implicit, by_depth) => {
                let age = wear.coefficient * friction * before.slip_path() * cycles
                    / before.self_compliance;
                let course = RUNNING_IN * age / (age + HALFWAY) + PER_AGE * age.ln_1p();
                let steps = course
                    * (wear.tolerance / USUAL).powf(ORDER)
                    * (before.area / USUAL_AREA).powf(AREA_POWER)
                    * (before.reach.max(1.2) / 1.2).powf(REACH_POWER)
                    * (1.0 - CAPPED * before.capped)
                    * if before.one_piece() { SMOOTH } else { 1.0 }
                    * if varies { VARYING } else { 1.0 };
                let by_error = STUB + steps;
                (by_error.max(by_depth.unwrap_or(0.0)), 1.4)
            }
        };
        Course {
            iterations: at_least(iterations).round() + landings.round(),
            within,
            area,
        }
    }
}
