//! What a scene needs: the one place that decides what will exist.
//!
//! A [`Plan`] is data: what is built and why, what is not and why, and what it costs. Its cost is in cells, transform pairs and
//! bytes, never in seconds, so that equal scenes give equal plans on every machine.

use serde::Serialize;

use super::{Boundary, CycleMode, Scene, Scheme, Solid, Transverse};
use crate::contact::normal::NormalOptions;
use crate::contact::tangential::TangentialOptions;
use crate::contact::{Elastic, HalfSpace, Pair, Shear};
use crate::fft::fast_length;
use crate::grid::Patch;
use crate::wear::cycle::March;
use crate::wear::joint::FrettingOptions;
use crate::wear::{FrettingJoint, Motion};

/// |β| below which bodies count as elastically alike: rounding of equal constants.
const ALIKE: f64 = 1e-12;

/// A scene that is well written and cannot be run.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// Normal and tangential contact would be coupled.
    #[error(
        "`material.lower` and `material.upper` differ so that pressure causes slip (Dundurs' beta = {beta:.4}); this version computes bodies with beta = 0 only: give both the same constants, or both poisson_ratio = 0.5"
    )]
    Dissimilar {
        /// Dundurs' β.
        beta: f64,
    },
    /// A value that this version does not compute.
    #[error("`{key}` is {value}, which this version does not compute; use {instead}")]
    NotAvailable {
        /// The key.
        key: &'static str,
        /// Its value.
        value: &'static str,
        /// What would be right.
        instead: &'static str,
    },
    /// `reversal` for another motion than it can march.
    #[error(
        "`fidelity.cycle` is \"reversal\", which needs a straight motion about zero that turns at its ends only, under constant normal load; use \"stepped\""
    )]
    NotStraight,
    /// The cap is too low for the load.
    #[error(
        "`contact.pressure_cap` = {cap:.6e} Pa on the joint's {area:.6e} m² carries {capacity:.6e} N; `contact.normal_load` is {load:.6e} N: lower the load or raise the cap"
    )]
    CapTooLow {
        /// The cap \[Pa\].
        cap: f64,
        /// Nominal area of the joint \[m²\].
        area: f64,
        /// Their product \[N\].
        capacity: f64,
        /// The largest load of the cycle \[N\].
        load: f64,
    },
    /// The load lifts off within the cycle.
    #[error(
        "the normal load falls to {load:.6e} N within the cycle; it must stay above zero: make `motion.normal_load_amplitude` smaller than `contact.normal_load`"
    )]
    LiftsOff {
        /// The least load \[N\].
        load: f64,
    },
    /// No cell is left.
    #[error(
        "the joint has no cell: `joint.hole.diameter` takes all of {cells} cells; make it smaller"
    )]
    NoCells {
        /// Cells of the grid.
        cells: usize,
    },
}

/// One decision: what, whether it will exist, and why.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Decision {
    /// What it is about.
    pub what: String,
    /// What was decided.
    pub choice: String,
    /// Why.
    pub why: String,
}

/// What the decided things cost.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Cost {
    /// Cells of the joint.
    pub cells: usize,
    /// Points of the plane that fields are transformed on.
    pub plane: [usize; 2],
    /// Memory of kernels and fields \[B\], estimated.
    pub memory: u64,
    /// Disk of one iteration \[B\], estimated: the dense gap and the sparse rest.
    pub disk_per_iteration: u64,
    /// Transform pairs of one iteration, estimated.
    pub pairs_per_iteration: f64,
    /// Wear iterations, estimated; 0 without wear.
    pub iterations: f64,
}

/// What exists in a run of a scene.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Plan {
    /// Tangential tractions.
    #[serde(skip)]
    pub shear: Shear,
    /// How cycles are marched; none without motion.
    pub march: Option<March>,
    /// What was decided from the scene alone.
    pub decisions: Vec<Decision>,
    /// What it costs.
    pub cost: Cost,
}

impl Plan {
    /// Decides what a scene needs. `motion` is its motion over a cycle (see [`motion_of`]), `patch` its kept cells.
    pub fn decide(scene: &Scene, patch: &Patch, motion: &Motion) -> Result<Plan, PlanError> {
        check(scene, patch, motion)?;
        let mut decisions = Vec::new();
        let mut decide = |what: &str, choice: String, why: &str| {
            decisions.push(Decision {
                what: what.to_owned(),
                choice,
                why: why.to_owned(),
            });
        };
        let grid = patch.grid;
        let plane = match scene.contact.boundary {
            Boundary::Free => [fast_length(2 * grid.nx - 1), fast_length(2 * grid.ny - 1)],
            Boundary::Periodic => [grid.nx, grid.ny],
        };
        let padding = match scene.contact.boundary {
            Boundary::Free => {
                "contact.boundary = \"free\": fields are padded with zeros to twice their length"
            }
            Boundary::Periodic => {
                "contact.boundary = \"periodic\": fields are transformed as they are"
            }
        };
        decide(
            "transforms",
            format!("real, {} x {}", plane[0], plane[1]),
            padding,
        );
        let outside = grid.len() - patch.cells();
        decide(
            "cells",
            format!("{} of {}", patch.cells(), grid.len()),
            if outside > 0 {
                "cells in the hole and unmeasured ones carry nothing"
            } else {
                "no hole"
            },
        );
        let (cap, why) = match scene.contact.pressure_cap {
            Some(cap) => (format!("at {cap:e} Pa"), "contact.pressure_cap is given"),
            None => ("none".to_owned(), "no contact.pressure_cap: elastic"),
        };
        decide("pressure cap", cap, why);
        decide(
            "kernels normal-tangential (zx, zy)",
            "none".to_owned(),
            "the bodies are elastically alike (Dundurs' beta = 0): pressure causes no slip",
        );

        let shear = match scene.contact.transverse {
            Transverse::Absent => Shear::AlongX,
            Transverse::Fixed | Transverse::Free => Shear::InPlane,
        };
        match shear {
            Shear::AlongX => decide(
                "shear",
                "along x; kernel xx".to_owned(),
                "contact.transverse = \"absent\": no field q_y, no kernels yy and xy",
            ),
            Shear::InPlane => decide(
                "shear",
                "along x and y; kernels xx, yy, xy".to_owned(),
                "contact.transverse = \"fixed\": with Poisson's ratio a motion along x causes shear along y too",
            ),
        }
        let march = decide_march(scene, motion)?;
        match march {
            Some(March::Reversal) => decide(
                "fretting cycle",
                "reversal: one exact solve a cycle".to_owned(),
                "straight motion about zero under constant load: the steady cycle is antisymmetric",
            ),
            Some(March::Stepped) => decide(
                "fretting cycle",
                format!(
                    "stepped: {} exact solves a cycle, until it closes",
                    motion.samples()
                ),
                match scene.fidelity.cycle {
                    Some(_) => "fidelity.cycle or the preset asks for it",
                    None => "the load varies, or the motion is not straight about zero",
                },
            ),
            None => decide(
                "fretting cycle",
                "none".to_owned(),
                "no [motion]: static contact",
            ),
        }
        match &scene.wear {
            Some(wear) => {
                let (choice, why) = match wear.scheme {
                    Scheme::Implicit => (
                        format!(
                            "implicit, second order, error {} of the volume of each step",
                            wear.tolerance
                        ),
                        "wear.scheme = \"implicit\": stable at any step",
                    ),
                    Scheme::Explicit => (
                        format!(
                            "explicit, {:e} m a step",
                            wear.depth_step.unwrap_or(f64::NAN)
                        ),
                        "wear.scheme = \"explicit\": the published step [A eq. 2.7-2.8]",
                    ),
                };
                decide("wear", choice, why);
            }
            None => decide("wear", "none".to_owned(), "no [wear]: a single pass"),
        }
        decide(
            "structure, dynamic response, model update",
            "none".to_owned(),
            "the motion is prescribed",
        );
        let cost = cost(scene, patch, motion, shear, march, plane);
        Ok(Plan {
            shear,
            march,
            decisions,
            cost,
        })
    }

    /// The elastic bodies of a scene.
    pub fn pair(scene: &Scene) -> Pair {
        Pair {
            lower: solid(&scene.material.lower),
            upper: solid(&scene.material.upper),
        }
    }

    /// Builds what was decided, on the given unworn heights.
    pub fn build(
        &self,
        scene: &Scene,
        patch: Patch,
        height: Vec<f64>,
        motion: Motion,
    ) -> FrettingJoint {
        let fidelity = &scene.fidelity;
        FrettingJoint {
            half_space: HalfSpace::new(patch.grid, Plan::pair(scene), scene.contact.boundary),
            patch,
            height,
            pressure_cap: scene.contact.pressure_cap,
            friction_coefficient: scene.contact.friction_coefficient.unwrap_or(0.0),
            motion,
            march: self.march.unwrap_or(March::Reversal),
            options: FrettingOptions {
                normal: NormalOptions {
                    tolerance: fidelity.normal_tolerance,
                    ..NormalOptions::default()
                },
                tangential: TangentialOptions {
                    tolerance: fidelity.tangential_tolerance,
                    ..TangentialOptions::default()
                },
                cycle_tolerance: fidelity.cycle_tolerance,
            },
        }
    }
}

/// The harmonic motion of a scene, or none; `None` for a history, which has to be read from its file.
pub fn motion_of(scene: &Scene) -> Option<Motion> {
    let load = scene.contact.normal_load;
    match &scene.motion {
        None => Some(Motion::none(load)),
        Some(super::Motion::History { .. }) => None,
        Some(super::Motion::Harmonic {
            amplitude,
            phase,
            normal_load_amplitude,
        }) => {
            let mut axes = vec![(amplitude[0], phase[0])];
            if scene.contact.transverse != Transverse::Absent {
                axes.push((amplitude[1], phase[1]));
            }
            Some(Motion::harmonic(
                &axes,
                load,
                *normal_load_amplitude,
                scene.fidelity.steps_per_cycle,
            ))
        }
    }
}

fn solid(solid: &Solid) -> Elastic {
    Elastic {
        youngs_modulus: solid.youngs_modulus,
        poisson_ratio: solid.poisson_ratio,
    }
}

fn check(scene: &Scene, patch: &Patch, motion: &Motion) -> Result<(), PlanError> {
    if patch.cells() == 0 {
        return Err(PlanError::NoCells {
            cells: patch.grid.len(),
        });
    }
    let beta = Plan::pair(scene).dundurs_beta();
    if beta.abs() > ALIKE {
        return Err(PlanError::Dissimilar { beta });
    }
    if scene.contact.transverse == Transverse::Free {
        let (value, instead) = (
            "\"free\"",
            "\"fixed\" (no mean displacement along y) or \"absent\" (no y at all)",
        );
        return Err(PlanError::NotAvailable {
            key: "contact.transverse",
            value,
            instead,
        });
    }
    if scene.fidelity.cycle == Some(CycleMode::Superposition) {
        let (value, instead) = (
            "\"superposition\"",
            "\"reversal\" or \"stepped\", which are exact",
        );
        return Err(PlanError::NotAvailable {
            key: "fidelity.cycle",
            value,
            instead,
        });
    }
    if scene.output.cycle_fields {
        let (value, instead) = ("true", "false: the fields at t = 0 are in contact_field");
        return Err(PlanError::NotAvailable {
            key: "output.cycle_fields",
            value,
            instead,
        });
    }
    let least = motion
        .normal_load
        .iter()
        .fold(f64::INFINITY, |m, n| m.min(*n));
    if least <= 0.0 && scene.motion.is_some() {
        return Err(PlanError::LiftsOff { load: least });
    }
    if let Some(cap) = scene.contact.pressure_cap {
        let (area, load) = (
            patch.area(),
            motion.normal_load.iter().fold(0.0f64, |m, n| m.max(*n)),
        );
        if load > cap * area {
            return Err(PlanError::CapTooLow {
                cap,
                area,
                capacity: cap * area,
                load,
            });
        }
    }
    Ok(())
}

fn decide_march(scene: &Scene, motion: &Motion) -> Result<Option<March>, PlanError> {
    if scene.motion.is_none() {
        return Ok(None);
    }
    let straight = motion.straight().is_some();
    match scene.fidelity.cycle {
        Some(CycleMode::Reversal) if !straight => Err(PlanError::NotStraight),
        Some(CycleMode::Stepped) => Ok(Some(March::Stepped)),
        _ if straight => Ok(Some(March::Reversal)),
        _ => Ok(Some(March::Stepped)),
    }
}

/// Estimates from runs of the shipped pipelines: they say what kind of cost to expect, not its digits.
fn cost(
    scene: &Scene,
    patch: &Patch,
    motion: &Motion,
    shear: Shear,
    march: Option<March>,
    plane: [usize; 2],
) -> Cost {
    /// Pairs of a normal solve from a similar state, of a tangential solve an axis, of a stiffness solve an axis.
    const NORMAL: f64 = 25.0;
    const TANGENTIAL: f64 = 25.0;
    const STIFFNESS: f64 = 20.0;
    /// Cycles until a stepped march closes.
    const CYCLES: f64 = 2.0;
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
    let cycle = match march {
        None => 0.0,
        Some(March::Reversal) => TANGENTIAL * axes,
        Some(March::Stepped) => {
            let loads = if motion.constant_load() { 0.0 } else { NORMAL };
            motion.samples() as f64 * (loads + CYCLES * TANGENTIAL * axes)
        }
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
        cells: patch.cells(),
        plane,
        memory: (8.0 * doubles) as u64,
        disk_per_iteration: (kept * (8.0 + 0.5 * axes)) as u64,
        pairs_per_iteration: NORMAL + stiffness + cycle + step,
        iterations,
    }
}
