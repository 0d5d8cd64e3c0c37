//! The solvers that stages share, each built when it is first asked for from the recipe and the tables of the run. They hold no state
//! of a run: a stage sets what moves the joint, and it rests again for the next one.

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

/// What a part of a stage that is told apart cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartCost {
    /// Name of the part; none of the stage itself.
    pub part: Option<&'static str>,
    /// Its time.
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
    /// The cycle at the end of the last wear step. The stage that marches the same one takes it from here; another start of the program finds
    /// none and marches it, to the same bits.
    pub end: Option<EndCycle>,
    /// The forced response of contact elements that stay as they are, and its harmonics, for the stage that writes it.
    pub forced_response: Option<(Harmonics, Vec<ForcedPoint>)>,
    /// What an earlier start has solved of a stage; the runner opens it.
    pub journal: Journal,
}

impl Solvers {
    /// Solvers whose transforms are made on as many threads; results do not depend on their number. What they do is counted by the
    /// gauge, for who watches.
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

    /// Threads that share work.
    pub fn threads(&self) -> &Threads {
        &self.threads
    }

    /// Begins a stage: the joint rests, and nothing has cost anything.
    pub fn begin(&mut self) {
        self.costs.clear();
        self.gauge.begin();
        if let Some(joint) = &mut self.joint {
            joint.half_space.take_pairs();
            joint.motion = Motion::none(0.0);
            joint.course = None;
            joint.march = March::Reversal;
            joint.options.extrapolate = false;
        }
    }

    /// What the stage has cost in the time it took: of itself, and of the parts that it tells apart.
    pub fn end(&mut self, spent: WorkCost) -> Vec<PartCost> {
        let left = self.joint.as_mut();
        let mut own = PartCost {
            part: None,
            spent,
            fft_pairs: left.map_or(0.0, |joint| joint.half_space.take_pairs()),
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

    /// The rough joint, at rest unless the stage has set what moves it.
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

    /// The rough joint whose bodies press each other under a `preload` \[N\], as their structure has it, for stages that press them.
    pub fn pressed_joint(
        &mut self,
        reads: &StageInputs,
        preload: f64,
    ) -> Result<&mut FrettingJoint, RunError> {
        let contact = reads.recipe.contact();
        let of =
            contact.and_then(|of| Some((of, of.pressing.as_ref()?, of.structure_mesh.as_ref()?)));
        if let Some((contact, pressing, mesh)) = of
            && self.joint(reads)?.pressing.is_none()
        {
            let elements = self.elements(reads)?;
            let reduced = reduced_of(reads)?;
            let reduced = reduced.expect("a structure that presses is reduced");
            let joint = self.joint(reads)?;
            let kept = (0..joint.height.len()).filter(|&c| joint.patch.kept[c]);
            let top = kept
                .map(|c| joint.height[c])
                .fold(f64::NEG_INFINITY, f64::max);
            let found = contact.pressing(pressing, mesh, &elements, &reduced, top)?;
            joint.pressing = Some(found);
        }
        let joint = self.joint(reads)?;
        joint
            .pressing
            .iter_mut()
            .for_each(|of| of.preload = preload);
        Ok(joint)
    }

    /// Does work on the joint; what it cost is told apart if the part has a name. The result with the transform pairs of the work.
    pub fn work<T>(
        &mut self,
        reads: &StageInputs,
        part: Option<&'static str>,
        work: impl FnOnce(&mut FrettingJoint) -> Result<T, NumericsError>,
    ) -> Result<(T, f64), RunError> {
        let clock = Clock::begin();
        let joint = self.joint(reads)?;
        joint.half_space.take_pairs();
        let result = work(joint).map_err(|error| reads.failed(error))?;
        let fft_pairs = joint.half_space.take_pairs();
        self.costs.push(PartCost {
            part,
            spent: clock.spent(),
            fft_pairs,
        });
        Ok((result, fft_pairs))
    }

    /// The contact elements whose cells are those of the joint.
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

    /// The structure with a place for contact elements. Damping in modes of the stuck joint is that of the unworn elements.
    pub fn vibration(&mut self, reads: &StageInputs) -> Result<Rc<Vibration>, RunError> {
        if self.vibration.is_none() {
            let recipe = &reads.recipe;
            let (Some(structure), Some(response)) = (&recipe.structure, &recipe.response) else {
                unreachable!("a stage that vibrates declares structure and response");
            };
            let unworn = match reads.maybe::<typed::ReferenceElement>()? {
                Some(rows) => ElementParameters {
                    normal_load: rows.normal_load,
                    gap: rows.gap,
                    kn: rows.kn,
                    kt: rows.kt,
                    sliders: None,
                },
                None => {
                    let given = recipe.elements().and_then(Elements::given_for_damping);
                    given.unwrap_or_default()
                }
            };
            let elements = recipe.elements();
            let unworn = elements.map(|elements| elements.with(&structure.layout(), &unworn));
            let reduced = match (reduced_of(reads)?, recipe.contact()) {
                (Some(found), Some(contact)) => Some(contact.with_bolt(found)?),
                (found, _) => found,
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

/// The cells of the joint and their unworn heights.
pub fn patch_and_height(reads: &StageInputs) -> Result<(Patch, Vec<f64>), RunError> {
    let Some(surface) = reads.recipe.surface() else {
        unreachable!("a stage that reads the surface declares its grid");
    };
    let typed::Surface { height, kept, .. } = reads.table()?;
    let grid = surface.grid();
    Ok((Patch { grid, kept }, height))
}

/// Parameters of contact elements whose stiffness is given; of none where there are none.
pub fn given(reads: &StageInputs) -> ElementParameters {
    let elements = reads.recipe.elements();
    let given = elements.and_then(Elements::given);
    given.unwrap_or_default()
}

/// Where the contact elements are; nowhere without a structure.
pub fn layout(reads: &StageInputs) -> Layout {
    let structure = reads.recipe.structure.as_ref();
    structure.map_or_else(Layout::default, |structure| structure.layout())
}

/// Compliance of the smooth patch, where the stiffness or the motion needs it.
pub fn smooth(reads: &StageInputs) -> Result<Option<Compliance>, RunError> {
    let Some(reference) = reads.maybe::<typed::Reference>()? else {
        return Ok(None);
    };
    let normal = reference.smooth_compliance_normal;
    let pair = normal.zip(reference.smooth_compliance_tangential);
    Ok(pair.map(|(normal, tangential)| Compliance { normal, tangential }))
}
