//! Solvers that stages share. `Solvers` builds each solver at the first use of the solver, from the recipe and the
//! tables of the run. Solvers store no state of a run. A stage sets the motion of the joint. The solvers reset the
//! joint at the beginning of each stage.

use std::rc::Rc;

use super::RunError;
use super::clock::{Clock, WorkCost};
use super::error::NumericsError;
use super::reduced::reduced_of;
use super::stage_inputs::StageInputs;
use crate::dynamics::{ForcedPoint, Harmonics, Vibration};
use crate::gauge::Gauge;
use crate::grid::Patch;
use crate::journal::Journal;
use crate::model_update::{Compliance, ContactElements, ElementParameters};
use crate::recipe::{Elements, Layout};
use crate::tables::typed;
use crate::threads::Threads;
use crate::wear::cycle::March;
use crate::wear::implicit::EndCycle;
use crate::wear::{FrettingJoint, Motion};

/// Cost of a stage, or of a named part of a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartCost {
    /// Name of the part; `None` for the stage itself.
    pub part: Option<&'static str>,
    /// Time spent.
    pub spent: WorkCost,
    /// Forward and inverse transform pairs.
    pub fft_pairs: f64,
}

/// The solvers of a run.
pub struct Solvers {
    threads: Threads,
    joint: Option<FrettingJoint>,
    elements: Option<Rc<ContactElements>>,
    vibration: Option<Rc<Vibration>>,
    costs: Vec<PartCost>,
    gauge: Gauge,
    /// The cycle at the end of the last wear step. A stage that needs the end cycle takes the cycle from `end` and does
    /// not compute the cycle again. After a restart `end` is `None`, and the stage computes the cycle with identical
    /// results.
    pub end: Option<EndCycle>,
    /// Forced response with unchanged contact elements, and its harmonics, for the stage that writes it.
    pub forced_response: Option<(Harmonics, Vec<ForcedPoint>)>,
    /// Solutions of a stage that an earlier start computed. The runner opens the journal.
    pub journal: Journal,
}

impl Solvers {
    /// Creates solvers that compute the Fourier transforms with `threads` threads. Results do not depend on the number
    /// of threads. The `gauge` counts the work for observers.
    pub fn new(threads: usize, gauge: Gauge) -> Solvers {
        Solvers {
            threads: Threads::new(threads),
            joint: None,
            elements: None,
            vibration: None,
            costs: Vec::new(),
            gauge,
            end: None,
            forced_response: None,
            journal: Journal::default(),
        }
    }

    /// Returns the threads that share work.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Begins a stage: resets the joint and all costs.
    pub fn begin(&mut self) {
        self.costs.clear();
        self.gauge.begin();
        if let Some(joint) = &mut self.joint {
            joint.half_space.take_pairs();
            joint.motion = Motion::at_rest(0.0);
            joint.evolving_motion = None;
            joint.march = March::Reversal;
            joint.options.extrapolate = false;
        }
    }

    /// Returns the costs of a stage that took the time `spent`: first the stage itself, then its named parts.
    pub fn end(&mut self, spent: WorkCost) -> Vec<PartCost> {
        let joint = self.joint.as_mut();
        let mut own = PartCost {
            part: None,
            spent,
            fft_pairs: joint.map_or(0.0, |joint| joint.half_space.take_pairs()),
        };
        let mut parts = Vec::new();
        for cost in std::mem::take(&mut self.costs) {
            match cost.part {
                None => own.fft_pairs += cost.fft_pairs,
                Some(_) => {
                    own.spent = own.spent.less(cost.spent);
                    parts.push(cost);
                }
            }
        }
        let mut costs = vec![own];
        costs.extend(parts);
        costs
    }

    /// Returns the rough joint. The rough joint is at rest unless the stage has set a motion.
    pub fn joint(&mut self, reads: &StageInputs) -> Result<&mut FrettingJoint, RunError> {
        if self.joint.is_none() {
            let Some(contact) = reads.recipe.contact() else {
                unreachable!("a stage that solves a contact declares it");
            };
            let elements = match contact.structure_mesh {
                Some(_) => Some(self.elements(reads)?),
                None => None,
            };
            let (patch, height) = patch_and_height(reads)?;
            let mut joint = contact.joint(patch, height, elements.as_deref())?;
            joint.half_space.set_threads(self.threads.count());
            joint.half_space.set_gauge(self.gauge.clone());
            self.joint = Some(joint);
        }
        Ok(self.joint.as_mut().expect("it was built"))
    }

    /// Returns the rough joint, pressed by its structure under a `preload` \[N\]. For stages that press the bodies
    /// together.
    pub fn pressed_joint(
        &mut self,
        reads: &StageInputs,
        preload: f64,
    ) -> Result<&mut FrettingJoint, RunError> {
        let contact = reads.recipe.contact();
        let parts = contact.and_then(|contact| {
            Some((
                contact,
                contact.pressing.as_ref()?,
                contact.structure_mesh.as_ref()?,
            ))
        });
        if let Some((contact, pressing, mesh)) = parts
            && self.joint(reads)?.pressing.is_none()
        {
            let elements = self.elements(reads)?;
            let reduced = reduced_of(reads)?;
            let reduced = reduced.expect("a structure that presses is reduced");
            let joint = self.joint(reads)?;
            let kept_cells = (0..joint.height.len()).filter(|&c| joint.patch.is_in_joint[c]);
            let top = kept_cells
                .map(|c| joint.height[c])
                .fold(f64::NEG_INFINITY, f64::max);
            let pressing = contact.pressing(pressing, mesh, &elements, &reduced, top)?;
            joint.pressing = Some(pressing);
        }
        let joint = self.joint(reads)?;
        joint
            .pressing
            .iter_mut()
            .for_each(|pressing| pressing.preload = preload);
        Ok(joint)
    }

    /// Runs `work` on the joint and returns its result with the number of transform pairs. A named `part` is reported
    /// separately in the costs.
    pub fn timed<T>(
        &mut self,
        reads: &StageInputs,
        part: Option<&'static str>,
        work: impl FnOnce(&mut FrettingJoint) -> Result<T, NumericsError>,
    ) -> Result<(T, f64), RunError> {
        let clock = Clock::begin();
        let joint = self.joint(reads)?;
        joint.half_space.take_pairs();
        let result = work(joint).map_err(|error| reads.run_error(error))?;
        let fft_pairs = joint.half_space.take_pairs();
        self.costs.push(PartCost {
            part,
            spent: clock.spent(),
            fft_pairs,
        });
        Ok((result, fft_pairs))
    }

    /// Returns the contact elements that match the cells of the joint.
    pub fn elements(&mut self, reads: &StageInputs) -> Result<Rc<ContactElements>, RunError> {
        if self.elements.is_none() {
            let surface = reads.recipe.surface();
            let elements = surface.map(|surface| surface.contact_elements());
            let Some(elements) = elements.transpose()?.flatten() else {
                unreachable!("a joint with a structure has the cells of its contact elements");
            };
            self.elements = Some(Rc::new(elements));
        }
        Ok(self.elements.clone().expect("it was built"))
    }

    /// Returns the model of the structure with its contact elements. Modal damping of the stuck joint uses the unworn
    /// elements.
    pub fn vibration(&mut self, reads: &StageInputs) -> Result<Rc<Vibration>, RunError> {
        if self.vibration.is_none() {
            let recipe = &reads.recipe;
            let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
                unreachable!("a stage that vibrates declares structure and response");
            };
            let unworn = match reads.optional_table::<typed::ReferenceElement>()? {
                Some(rows) => ElementParameters {
                    normal_load: rows.normal_load,
                    gap: rows.gap,
                    kn: rows.kn,
                    kt: rows.kt,
                    sliders: None,
                },
                None => {
                    let parameters = recipe.elements().and_then(Elements::damping_parameters);
                    parameters.unwrap_or_default()
                }
            };
            let elements = recipe.elements();
            let unworn = elements.map(|elements| elements.with(&structure.layout(), &unworn));
            let reduced = match (reduced_of(reads)?, recipe.contact()) {
                (Some(reduced), Some(contact)) => Some(contact.with_bolt(reduced)?),
                (reduced, _) => reduced,
            };
            let has_contact = elements.is_some();
            let mut unworn = unworn.unwrap_or_default();
            structure.add_springs(&mut unworn);
            let mut vibration =
                structure.vibration(response, has_contact, reduced.as_ref(), &unworn)?;
            vibration.gauge = self.gauge.clone();
            vibration.journal = self.journal.clone();
            vibration.threads = self.threads.clone();
            self.vibration = Some(Rc::new(vibration));
        }
        Ok(self.vibration.clone().expect("it was built"))
    }
}

/// Returns the cells of the joint and their unworn heights.
pub fn patch_and_height(reads: &StageInputs) -> Result<(Patch, Vec<f64>), RunError> {
    let Some(surface) = reads.recipe.surface() else {
        unreachable!("a stage that reads the surface declares its grid");
    };
    let typed::Surface { height, kept, .. } = reads.table()?;
    let grid = surface.grid();
    Ok((
        Patch {
            grid,
            is_in_joint: kept,
        },
        height,
    ))
}

/// Returns the parameters of contact elements whose stiffness the scene prescribes; empty for other scenes.
pub fn given_parameters(reads: &StageInputs) -> ElementParameters {
    let elements = reads.recipe.elements();
    let parameters = elements.and_then(Elements::prescribed_parameters);
    parameters.unwrap_or_default()
}

/// Returns the layout of the contact elements; empty without a structure.
pub fn element_layout(reads: &StageInputs) -> Layout {
    let structure = reads.recipe.structure.as_ref();
    structure.map_or_else(Layout::default, |structure| structure.layout())
}

/// Returns the compliance of the smooth patch, or `None` where neither stiffness nor motion needs it.
pub fn smooth_compliance(reads: &StageInputs) -> Result<Option<Compliance>, RunError> {
    let Some(reference) = reads.optional_table::<typed::Reference>()? else {
        return Ok(None);
    };
    let normal = reference.smooth_compliance_normal;
    let pair = normal.zip(reference.smooth_compliance_tangential);
    Ok(pair.map(|(normal, tangential)| Compliance { normal, tangential }))
}
