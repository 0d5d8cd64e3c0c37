//! A rough joint that frets: what the wear steps ask for contact and cycle.

use std::rc::Rc;

use super::cycle::{CycleSolution, March};
use super::motion::Motion;
use super::pressing::Pressing;

use crate::contact::normal::{
    self, Control, NormalOptions, NormalProblem, NormalSolution, Rotation,
};
use crate::contact::stiffness::{self, Direction};
use crate::contact::tangential::TangentialOptions;
use crate::contact::{ContactError, Coupling, HalfSpace, Shear};
use crate::grid::Patch;

/// What can go wrong in a fretting cycle or a wear step.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum WearError {
    /// A contact solve failed.
    #[error(transparent)]
    Contact(#[from] ContactError),
    /// The motion turns elsewhere than at two opposite ends, or the load changes.
    #[error(
        "`reversal` needs a straight motion about zero under constant normal load; march it `stepped`"
    )]
    NotStraight,
    /// The motion is not one along a line in the plane.
    #[error(
        "`superposition` needs displacements given along all axes that move, or forces along all of them, and no rotation about z; march it by `reversal`"
    )]
    NotSuperposed,
    /// The cycle does not repeat itself.
    #[error(
        "the fretting cycle did not become steady: after {cycles} cycles its energy may still change by more than {tolerance:.1e} of itself"
    )]
    NotSteady {
        /// Cycles marched.
        cycles: usize,
        /// The closure asked for.
        tolerance: f64,
    },
    /// No force of a bolt presses the joint as is wanted.
    #[error(
        "no force of the bolt presses the joint by {load:e} N: with {preload:e} N in the bolt it bears {found:e} N; is contact.preload where the bolt is?"
    )]
    NotTightened {
        /// The load wanted \[N\].
        load: f64,
        /// The last force tried \[N\].
        preload: f64,
        /// What the joint bore under it \[N\].
        found: f64,
    },
    /// A single cycle wears far more than a step of its scheme may.
    #[error(
        "a single cycle wears {times:.2e} times what a wear step can, and no step is shorter: lower wear.coefficient (is its unit right?) or the motion"
    )]
    CycleWearsTooMuch {
        /// How many times.
        times: f64,
    },
    /// A wear step that could not be made accurate enough.
    #[error(
        "a wear step of {cycles} cycle has an error of {error:.2e} of its volume, {tolerance:.1e} asked: a single cycle wears too much; raise wear.tolerance, or lower wear.coefficient or the motion"
    )]
    StepTooSmall {
        /// Cycles of the smallest step tried.
        cycles: u64,
        /// Its error.
        error: f64,
        /// The error asked for.
        tolerance: f64,
    },
}

/// Tolerances of the solves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrettingOptions {
    /// Of the normal contact.
    pub normal: NormalOptions,
    /// Of each tangential step.
    pub tangential: TangentialOptions,
    /// Closure of the steady cycle: what its shear still changes by would dissipate, in parts of what it dissipates.
    pub cycle_tolerance: f64,
    /// Whether a cycle of samples is marched by steps of second order, over every other sample too, and extrapolated to steps of no length.
    pub extrapolate: bool,
}

/// Part of the closure of a cycle that the gap of each of its steps may have. Where all slides, a gap of g lets the shear lag behind the slip by
/// √(2g), and that changes the energy of a motion that turns: by 0.2 % for 1e-4.
const GAP_OF_CLOSURE: f64 = 0.1;

impl FrettingOptions {
    /// Those of tangential steps that follow one another, each from the shear that the last has left.
    pub fn tangential_in_sequence(&self) -> TangentialOptions {
        let closure = GAP_OF_CLOSURE * self.cycle_tolerance;
        TangentialOptions {
            tolerance: self.tangential.tolerance.min(closure),
            ..self.tangential
        }
    }
}

/// A motion that changes as the joint wears: by the tangential compliance of the fine contact \[m/N\].
#[derive(Clone)]
pub struct EvolvingMotion {
    /// The motion at a compliance.
    pub motion: Rc<dyn Fn(f64) -> Motion>,
    /// The compliance at the beginning of a step.
    pub begin: f64,
    /// How the compliance is found.
    pub shear: Shear,
    /// Whether normal and tangential displacements are coupled in it.
    pub coupling: Coupling,
}

/// A joint, its unworn surface and its motion.
pub struct FrettingJoint {
    /// The two half spaces.
    pub half_space: HalfSpace,
    /// Grid and kept cells.
    pub patch: Patch,
    /// Unworn composite height, positive towards the other body \[m\].
    pub height: Vec<f64>,
    /// The bodies that press each other under loads of their own; none: a load or an approach presses half spaces together.
    pub pressing: Option<Pressing>,
    /// Rotation about x and y, or the moments under which the bodies turn.
    pub rotation: Rotation,
    /// Pressure cap \[Pa\].
    pub pressure_cap: Option<f64>,
    /// Friction coefficient µ.
    pub friction_coefficient: f64,
    /// The motion.
    pub motion: Motion,
    /// What the motion goes on to as the joint wears; none: it stays as it is.
    pub course: Option<EvolvingMotion>,
    /// How a cycle is marched.
    pub march: March,
    /// Tolerances.
    pub options: FrettingOptions,
}

/// A joint at some point of its wear: all that a step needs, and all that a restart needs.
#[derive(Debug, Clone, PartialEq)]
pub struct WornState {
    /// Cumulative wear depth ≥ 0 \[m\].
    pub wear: Vec<f64>,
    /// Static pressure at the mean load \[Pa\].
    pub pressure: Vec<f64>,
    /// The steady cycle there.
    pub cycle: CycleSolution,
}

impl FrettingJoint {
    /// Normal contact of the surface worn by `wear` under `load`, with an optional diagonal compliance.
    pub fn contact(
        &mut self,
        wear: &[f64],
        compliance: Option<&[f64]>,
        load: f64,
        start: Option<&[f64]>,
    ) -> Result<NormalSolution, WearError> {
        self.pressed(wear, compliance, Control::Load(load), start)
    }

    /// Normal contact with a diagonal compliance, to the tolerance that `tolerance` makes of the joint's own.
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

    /// Normal contact of the surface worn by `wear` under a load or at an approach, with an optional diagonal compliance. Bodies of a structure
    /// have loads of their own, and `control` is not asked.
    pub fn pressed(
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
        // How bodies press each other is the half spaces' doing and the structure's, as it bends under loads that stay. What its mesh has of half
        // spaces matters to what displaces it.
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
            .for_each(|of| of.shortening = shortening);
        Ok(solution)
    }

    /// The static contact, at the mean load.
    pub fn static_contact(
        &mut self,
        wear: &[f64],
        start: Option<&[f64]>,
    ) -> Result<NormalSolution, WearError> {
        self.contact(wear, None, self.motion.mean_load, start)
    }

    /// Moves as at the beginning of a step.
    pub(super) fn follow_from_begin(&mut self) {
        if let Some(course) = &self.course {
            self.motion = (course.motion)(course.begin);
        }
    }

    /// Moves as the joint does under these pressures, and says its tangential compliance \[m/N\]; none where its motion stays.
    pub(super) fn follow(&mut self, pressure: &[f64]) -> Result<Option<f64>, WearError> {
        let Some(course) = self.course.clone() else {
            return Ok(None);
        };
        let (_, kt) = self.stiffness(pressure, course.shear, course.coupling)?;
        let compliance = kt.recip();
        self.motion = (course.motion)(compliance);
        Ok(Some(compliance))
    }

    /// Worn volume of a wear field \[m³\].
    pub fn volume(&self, wear: &[f64]) -> f64 {
        wear.iter().sum::<f64>() * self.patch.grid.cell_area()
    }
}

// Stiffness of a joint at a contact that it has.

impl FrettingJoint {
    /// kn and kt \[N/m\] under `pressure` \[Pa\], of half spaces. Capped cells count in kt alone; kn is that of bodies that turn where the
    /// rotation is free. Those of coupled bodies are at full stick, but for kn without friction.
    /// They are right to 1e-6.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve = self.linearised(pressure, shear, coupling, stiffness::FIGURE_TOLERANCE);
        Ok(self.half_space.without_nodal(solve)?)
    }

    /// kn and kt \[N/m\] as [`FrettingJoint::stiffness`], without the compliance of a structure's own mesh where that is taken from the
    /// half spaces; right to some 1e-4, enough to hold them against the contact elements'.
    ///
    /// # Errors
    /// [`WearError::Contact`].
    pub fn stiffness_beyond_mesh(
        &mut self,
        pressure: &[f64],
        shear: Shear,
        coupling: Coupling,
    ) -> Result<(f64, f64), WearError> {
        let solve = self.linearised(pressure, shear, coupling, stiffness::COMPARED_TOLERANCE);
        Ok(solve(&mut self.half_space)?)
    }

    /// What finds both stiffnesses on a half space.
    fn linearised<'a>(
        &self,
        pressure: &'a [f64],
        shear: Shear,
        coupling: Coupling,
        tolerance: f64,
    ) -> impl FnOnce(&mut HalfSpace) -> Result<(f64, f64), ContactError> + use<'a> {
        let (cap, rotation) = (self.pressure_cap, self.rotation);
        move |half_space| {
            of(
                half_space, pressure, cap, rotation, shear, coupling, tolerance,
            )
        }
    }
}

fn of(
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
            stiffness::turning(half_space, &elastic)?
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
