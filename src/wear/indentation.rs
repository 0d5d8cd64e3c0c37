//! Indentation of elastically different bodies with friction: they slip while the load rises.

use super::curves::Curve;
use super::{FrettingJoint, WearError};
use crate::contact::Shear;
use crate::contact::coupled::{self, CoupledOptions};
use crate::contact::normal::{Control, NormalProblem, NormalSolution};
use crate::grid::ByAxis;

/// Solver effort and error of the friction in a static contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Friction {
    /// Newton steps of all load steps.
    pub steps: usize,
    /// Largest relative duality gap of a load step.
    pub error: f64,
}

/// Contact after indentation.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedContact {
    /// Contact under the full load, with the iterations of all load steps.
    pub solution: NormalSolution,
    /// Shear traction on the upper body \[Pa\], row-major with x fastest.
    pub shear: ByAxis<Vec<f64>>,
    /// Solver effort and error of the friction.
    pub friction: Friction,
    /// Load over approach during the indentation.
    pub curve: Curve,
}

/// Presses a joint together in equal steps up to `load` \[N\].
///
/// # Errors
/// [`WearError::Contact`].
pub fn indent(
    joint: &mut FrettingJoint,
    shear: Shear,
    load: f64,
    load_steps: usize,
) -> Result<PressedContact, WearError> {
    let problem = NormalProblem {
        patch: &joint.patch,
        height: &joint.height,
        compliance: None,
        control: Control::Load(load),
        rotation: joint.rotation,
        pressure_cap: joint.pressure_cap,
    };
    let options = CoupledOptions {
        normal: joint.options.normal,
        tangential: joint.options.tangential_in_sequence(),
        ..CoupledOptions::default()
    };
    let loads: Vec<f64> = (1..=load_steps)
        .map(|step| load * step as f64 / load_steps as f64)
        .collect();
    let mut curve = Curve::default();
    let (mut iterations, mut steps, mut error) = (0, 0, 0.0f64);
    let friction = joint.friction_coefficient;
    let last = joint.half_space.without_nodal(|half_space| {
        coupled::indent(
            half_space,
            &problem,
            friction,
            shear,
            &loads,
            options,
            |step| {
                curve.push(step.normal.load, step.normal.approach);
                iterations += step.normal.iterations;
                steps += step.tangential.steps;
                error = error.max(step.tangential.error);
            },
        )
    })?;
    Ok(PressedContact {
        solution: NormalSolution {
            iterations,
            ..last.normal
        },
        shear: last.tangential.shear,
        friction: Friction { steps, error },
        curve,
    })
}
