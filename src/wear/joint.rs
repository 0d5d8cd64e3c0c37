//! Rough joint under fretting: the contact and cycle solves that the wear steps use.

use std::rc::Rc;

use super::cycle::{CycleSolution, March};
use super::motion::Motion;
use super::pressing::PressedBodies;

use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::stiffness::{self, Direction};
use crate::contact::tangential::TangentialOptions;
use crate::contact::{ContactError, Coupling, HalfSpace, Shear};
use crate::grid::Patch;

/// Errors of a fretting cycle or a wear step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WearError {
    /// A contact solve failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// The motion turns elsewhere than at two opposite ends, or the load changes.
    #[error(
        "`reversal` needs a straight motion about zero under constant normal load; use `stepped` instead"
    )]
    NotStraight,
    /// The motion is not along a line in the plane.
    #[error(
        "`superposition` needs a prescribed displacement along every moving axis, or a prescribed force along every one, and no rotation about z; use `reversal` instead"
    )]
    NotSuperposed,
    /// The cycle does not become periodic.
    #[error(
        "the fretting cycle did not become periodic: after {cycles} cycles its energy may still change by more than the fraction {tolerance:.1e}; raise fidelity.cycle_tolerance"
    )]
    NotSteady {
        /// Cycles computed.
        cycles: usize,
        /// Required closure.
        tolerance: f64,
    },
    /// No force of the bolt gives the joint the required load.
    #[error(
        "no force of the bolt gives the joint a load of {load:e} N: with {preload:e} N in the bolt the joint bears {found:e} N; check the place of the bolt in contact.preload"
    )]
    NotTightened {
        /// Required load \[N\].
        load: f64,
        /// Last force tried \[N\].
        preload: f64,
        /// Load of the joint under that force \[N\].
        found: f64,
    },
    /// A single cycle wears far more than a step of its scheme may.
    #[error(
        "a single cycle wears {times:.2e} times as much as a wear step should, and no step is shorter than a cycle: lower wear.coefficient (check its unit) or the motion"
    )]
    CycleWearsTooMuch {
        /// Wear of a single cycle, relative to a step's.
        times: f64,
    },
    /// A wear step could not be made accurate enough.
    #[error(
        "a wear step of {cycles} cycle has an error of {error:.2e} of its volume, and the tolerance is {tolerance:.1e}: a single cycle wears too much; raise wear.tolerance, or lower wear.coefficient or the motion"
    )]
    StepTooSmall {
        /// Cycles of the smallest step tried.
        cycles: u64,
        /// Relative error of that step.
        error: f64,
        /// Required relative error.
        tolerance: f64,
    },
}

/// Tolerances of the solves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrettingOptions {
    /// Options of the normal contact.
    pub normal: NormalOptions,
    /// Options of each tangential step.
    pub tangential: TangentialOptions,
    /// Tolerance for the closure of a steady cycle. The closure is the energy that the remaining change of the shear
    /// would dissipate, divided by the energy per cycle.
    pub cycle_tolerance: f64,
    /// If true, a stepped cycle uses steps of second order. The cycle is then also computed over every other sample,
    /// and the program extrapolates both results to steps of zero length.
    pub extrapolate: bool,
    /// Smallest fraction of a cell's slip path and energy that extrapolation keeps. A larger change shows that
    /// the cell is not yet of second order, and a full extrapolation would make it stick.
    pub least_extrapolated: f64,
    /// Number of closure checks per span.
    pub checks_per_span: usize,
}

/// Tolerance of each step's duality gap, as a fraction of the cycle's closure. In gross slip a gap g lets the
/// shear lag behind the slip by √(2g). For a motion that turns, 1e-4 changes the energy by 0.2 %.
const GAP_OF_CLOSURE: f64 = 0.1;

impl FrettingOptions {
    /// Default of [`FrettingOptions::least_extrapolated`].
    pub const LEAST_EXTRAPOLATED: f64 = 0.5;
    /// Default of [`FrettingOptions::checks_per_span`].
    pub const CHECKS_PER_SPAN: usize = 4;

    /// Returns the options of tangential steps in a sequence, each of which starts from the shear of the last
    /// one.
    pub fn tangential_in_sequence(&self) -> TangentialOptions {
        let closure = GAP_OF_CLOSURE * self.cycle_tolerance;
        TangentialOptions {
            tolerance: self.tangential.tolerance.min(closure),
            ..self.tangential
        }
    }
}

/// Motion that changes as the joint wears, as a function of the tangential compliance of the fine contact
/// \[m/N\].
#[derive(Clone)]
pub struct EvolvingMotion {
    /// Motion at a given compliance.
    pub motion: Rc<dyn Fn(f64) -> Motion>,
    /// Compliance at the beginning of a step.
    pub begin: f64,
    /// Directions of shear in the solve for the compliance.
    pub shear: Shear,
    /// Coupling of normal and tangential displacements in that solve.
    pub coupling: Coupling,
}

/// Fretting joint: the bodies, the unworn surface, the loads and the motion of a joint.
pub struct FrettingJoint {
    /// Both half spaces.
    pub half_space: HalfSpace,
    /// Grid and kept cells.
    pub patch: Patch,
    /// Composite height of both unworn surfaces \[m\]. A positive height reduces the gap between the bodies.
    pub height: Vec<f64>,
    /// Bodies that press each other under loads of their own. `None`: a load or an approach presses half
    /// spaces together.
    pub pressing: Option<PressedBodies>,
    /// Rotation about x and y, or the moments under which the bodies rotate.
    pub rotation: Rotation,
    /// Pressure cap \[Pa\].
    pub pressure_cap: Option<f64>,
    /// Friction coefficient µ.
    pub friction_coefficient: f64,
    /// Motion.
    pub motion: Motion,
    /// Evolution of the motion as the joint wears; `None` if the motion does not change.
    pub evolving_motion: Option<EvolvingMotion>,
    /// Method that computes a cycle.
    pub march: March,
    /// Tolerances.
    pub options: FrettingOptions,
}

/// State of a worn joint, from which a wear step or a restart begins.
#[derive(Debug, Clone, PartialEq)]
pub struct WornState {
    /// Cumulative wear depth ≥ 0 \[m\].
    pub wear: Vec<f64>,
    /// Static pressure at the mean load \[Pa\].
    pub pressure: Vec<f64>,
    /// Steady cycle of the worn surface.
    pub cycle: CycleSolution,
}

impl FrettingJoint {
    /// Solves the normal contact of the surface worn by `wear` under `load`, with an optional diagonal
    /// compliance.
    pub fn contact(
        &mut self,
        wear: &[f64],
        compliance: Option<&[f64]>,
        load: f64,
        start: Option<&[f64]>,
    ) -> Result<NormalSolution, WearError> {
        self.solve_normal_contact(wear, compliance, Control::Load(load), start)
    }

    /// Solves the normal contact with a diagonal compliance. `tolerance` maps the joint's own tolerance to
    /// the one used.
    pub(super) fn contact_to(
        &mut self,
        tolerance: impl FnOnce(f64) -> f64,
        wear: &[f64],
        compliance: &[f64],
        load: f64,
        start: &[f64],
    ) -> Result<NormalSolution, WearError> {
        let own = self.options.normal.tolerance;
        self.options.normal.tolerance = tolerance(own);
        let solution = self.contact(wear, Some(compliance), load, Some(start));
        self.options.normal.tolerance = own;
        solution
    }

    /// Solves the normal contact of the surface worn by `wear`. `control` prescribes the load or the approach.
    /// `compliance` is an optional diagonal compliance. If a structure presses the joint, the loads of the structure
    /// replace `control`.
    pub fn solve_normal_contact(
        &mut self,
        wear: &[f64],
        compliance: Option<&[f64]>,
        control: Control,
        start: Option<&[f64]>,
    ) -> Result<NormalSolution, WearError> {
        let mut height: Vec<f64> = self.height.iter().zip(wear).map(|(h, w)| h - w).collect();
        if let Some(pressing) = &self.pressing {
            let opening = pressing.opening();
            height.iter_mut().zip(&opening).for_each(|(h, u)| *h -= u);
        }
        let problem = NormalProblem {
            patch: &self.patch,
            height: &height,
            compliance,
            control,
            rotation: self.rotation,
            pressure_cap: self.pressure_cap,
        };
        // Static loads bend the structure, so that the bodies respond with the half spaces and the structure.
        // The nodal kernel, half spaces less the mesh's own compliance, only serves for prescribed nodal
        // displacements.
        let options = self.options.normal;
        let Some(pressing) = &self.pressing else {
            let solve = |half_space: &mut _| normal::solve(half_space, &problem, start, options);
            return Ok(self.half_space.without_nodal(solve)?);
        };
        let mut solution = pressing.solve(&mut self.half_space, problem, start, options)?;
        let shortening = pressing.shortening(&self.patch, &solution);
        solution.approach = pressing.approach(&self.patch, &solution);
        self.pressing
            .iter_mut()
            .for_each(|pressing| pressing.shortening = shortening);
        Ok(solution)
    }

    /// Solves the static contact, at the mean load.
    pub fn static_contact(
        &mut self,
        wear: &[f64],
        start: Option<&[f64]>,
    ) -> Result<NormalSolution, WearError> {
        self.contact(wear, None, self.motion.mean_load, start)
    }

    /// Resets the motion to the beginning of a step.
    pub(super) fn reset_motion(&mut self) {
        if let Some(course) = &self.evolving_motion {
            self.motion = (course.motion)(course.begin);
        }
    }

    /// Updates the motion of the joint to the pressure field `pressure`, and returns the tangential compliance of the
    /// contact \[m/N\]. Returns `None` if the motion does not change.
    pub(super) fn update_motion(&mut self, pressure: &[f64]) -> Result<Option<f64>, WearError> {
        let Some(course) = self.evolving_motion.clone() else {
            return Ok(None);
        };
        let (_, kt) = self.stiffness(pressure, course.shear, course.coupling)?;
        let compliance = kt.recip();
        self.motion = (course.motion)(compliance);
        Ok(Some(compliance))
    }

    /// Returns the worn volume of a wear field \[m³\].
    pub fn volume(&self, wear: &[f64]) -> f64 {
        wear.iter().sum::<f64>() * self.patch.grid.cell_area()
    }
}

// Stiffness of a joint at a known contact.

impl FrettingJoint {
    /// Returns kn and kt \[N/m\] of the half spaces under `pressure` \[Pa\], with a relative accuracy of
    /// 1e-6. Capped cells count only in kt. If the rotation is free, kn is the stiffness of bodies that
    /// rotate. The stiffnesses of coupled bodies assume full stick, except for kn without friction.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve = self.stiffness_solve(pressure, shear, coupling, stiffness::FIGURE_TOLERANCE);
        Ok(self.half_space.without_nodal(solve)?)
    }

    /// Returns the stiffnesses kn and kt \[N/m\] like [`FrettingJoint::stiffness`], but on `half_space`. If the
    /// compliance of the structure's mesh is subtracted from `half_space`, kn and kt do not include the compliance of
    /// the mesh. The accuracy of kn and kt is about 1e-4, which suffices for a comparison with the contact elements.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness_beyond_mesh(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve =
            self.stiffness_solve(pressure, shear, coupling, stiffness::COMPARISON_TOLERANCE);
        Ok(solve(&mut self.half_space)?)
    }

    /// Returns a function that computes both stiffnesses on a half space.
    fn stiffness_solve<'a>(
        &self,
        pressure: &'a [f64],
        shear: Shear,
        coupling: Coupling,
        tolerance: f64,
    ) -> impl FnOnce(&mut HalfSpace) -> Result<(f64, f64), ContactError> + use<'a> {
        let (cap, rotation) = (self.pressure_cap, self.rotation);
        move |half_space| {
            linearised_stiffness(
                half_space, pressure, cap, rotation, shear, coupling, tolerance,
            )
        }
    }
}

fn linearised_stiffness(
    half_space: &mut HalfSpace,
    pressure: &[f64],
    cap: Option<f64>,
    rotation: Rotation,
    shear: Shear,
    coupling: Coupling,
    tolerance: f64,
) -> Result<(f64, f64), ContactError> {
    let elastic = stiffness::elastic_cells(pressure, cap);
    let contact: Vec<bool> = pressure.iter().map(|&p| p > 0.0).collect();
    let kn = match (coupling, rotation) {
        (Coupling::None | Coupling::Frictionless, Rotation::Given(_)) => {
            stiffness::normal_to(half_space, &elastic, tolerance)?
        }
        (Coupling::None | Coupling::Frictionless, Rotation::Free { .. }) => {
            stiffness::normal_with_rotation(half_space, &elastic)?
        }
        _ => stiffness::coupled(
            half_space,
            Direction::Normal,
            &elastic,
            &contact,
            shear,
            tolerance,
        )?,
    };
    let kt = match coupling {
        Coupling::None => {
            stiffness::tangential_from(half_space, &contact, shear, tolerance, Some(&kn))?
        }
        _ => stiffness::coupled(
            half_space,
            Direction::AlongX,
            &elastic,
            &contact,
            shear,
            tolerance,
        )?,
    };
    Ok((kn.total, kt.total))
}
