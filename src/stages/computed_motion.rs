//! What moves the joint: the motion that is prescribed, or that of a response to its contact elements, which goes on to change between two
//! model updates as the one before has it.

use std::cell::RefCell;
use std::rc::Rc;

use super::RunError;
use super::contact_state::{axes, coefficients_of, contact_of, harmonics_of, parameters_of};
use super::solvers::{Solvers, layout, smooth};
use super::stage_inputs::StageInputs;
use crate::dynamics::cycle::{JointCycle, WorkBetweenEnds, half_range, joint_cycle_on};
use crate::dynamics::{ContactElement, DynamicsError, Sampling};
use crate::model_update::{
    Compliance, ContactElements, CycleFigures, ElementParameters, Nodes, Trend, fine_displacement,
};
use crate::recipe::Cycle;
use crate::tables::typed;
use crate::threads::Threads;
use crate::wear::cycle::March;
use crate::wear::joint::EvolvingMotion;
use crate::wear::{Channel, Motion, NodalMotion, mean_of};

/// Samples of a cycle at which a computed motion is looked at: reversals are found to 2e-5 of the reach.
const FINE_SAMPLES: usize = 512;

/// The response of a vibrating joint, with the contact elements that it is of.
pub struct ElementMotion {
    response: typed::Response,
    parameters: ElementParameters,
    /// What it has changed by since the one before; none where it stays as it is.
    trend: Option<Trend>,
    /// Energy of stepped cycles over that between two ends, which its elements and the fine contact are taken to have.
    stepped_part: f64,
}

impl ElementMotion {
    /// That of an iteration; none where no structure moves the joint.
    pub fn of(reads: &StageInputs) -> Result<Option<ElementMotion>, RunError> {
        let tables = (reads.maybe()?, reads.maybe()?, reads.maybe()?);
        Ok(Self::from(tables, reads.maybe()?, reads.maybe()?))
    }

    /// That of the iteration before.
    pub fn before(reads: &StageInputs) -> Result<Option<ElementMotion>, RunError> {
        let tables = (
            reads.optional_before()?,
            reads.optional_before()?,
            reads.optional_before()?,
        );
        let (row, update) = (reads.optional_before()?, reads.optional_before()?);
        Ok(Self::from(tables, row, update))
    }

    /// Energy of stepped cycles over that between two ends, which its elements and the fine contact are taken to have.
    pub fn stepped_part(&self) -> f64 {
        self.stepped_part
    }

    /// Parameters of its elements.
    pub fn parameters(&self) -> &ElementParameters {
        &self.parameters
    }

    /// The same motion of elements with other parameters, and with another part of the energy between two ends.
    pub fn of_elements(self, parameters: ElementParameters, stepped_part: f64) -> ElementMotion {
        ElementMotion {
            parameters,
            stepped_part,
            ..self
        }
    }

    /// What the coefficients change by from the last response to a `compliance` of the fine contact, in the order of [`harmonics_of`]; none where they stay.
    pub fn extrapolated_coefficients(&self, compliance: Option<f64>) -> Option<Vec<f64>> {
        let (trend, compliance) = self.trend.as_ref().zip(compliance)?;
        let times = trend.times(compliance);
        Some(trend.change.iter().map(|change| times * change).collect())
    }

    /// Whether elements have laws of their own.
    pub fn has_laws(&self) -> bool {
        self.parameters.sliders.is_some()
    }

    /// That of a response that is in no table yet, with this energy of stepped cycles over that between two ends.
    pub fn new(
        response: typed::Response,
        parameters: ElementParameters,
        stepped_part: f64,
    ) -> ElementMotion {
        ElementMotion {
            response,
            parameters,
            trend: None,
            stepped_part,
        }
    }

    fn from(
        (response, elements, sliders): (
            Option<typed::Response>,
            Option<typed::ContactElement>,
            Option<typed::ContactSlider>,
        ),
        row: Option<typed::DynamicResponse>,
        update: Option<typed::ModelUpdate>,
    ) -> Option<ElementMotion> {
        let response = response?;
        let stepped_part = row.as_ref().and_then(|row| row.stepped_part);
        let trend = row.zip(update).and_then(|(row, update)| {
            let change = change_of(&response).filter(|_| row.is_steady == Some(true))?;
            let compliance = [update.previous_fine_compliance?, update.fine_compliance?];
            Some(Trend { compliance, change })
        });
        Some(ElementMotion {
            response,
            parameters: parameters_of(&elements?, sliders),
            trend,
            stepped_part: stepped_part.unwrap_or(1.0),
        })
    }
}

/// What the coefficients of a response have changed by since the one before, in the order of [`harmonics_of`]; none where no column says it.
pub fn change_of(response: &typed::Response) -> Option<Vec<f64>> {
    let (cosine, sine) = (
        response.change_cosine.as_ref()?,
        response.change_sine.as_ref()?,
    );
    Some(coefficients_of(&response.harmonic, cosine, sine))
}

/// What moves the fine contact under a response to contact elements, at every compliance of it.
pub struct ComputedMotion {
    elements: Vec<ContactElement>,
    centres: Vec<[f64; 2]>,
    nodes: Option<Rc<ContactElements>>,
    /// Axes that the fine contact has.
    axes: usize,
    sampling: Sampling,
    displacement: Vec<f64>,
    trend: Option<Trend>,
    stepped_part: f64,
    smooth: Option<Compliance>,
    has_laws: bool,
    cycle: Cycle,
    load: f64,
    threads: Threads,
    /// Motions that were asked for, with their compliances.
    known: RefCell<Vec<(f64, Marched)>>,
}

/// Motions that are kept at a time.
const KNOWN: usize = 4;

/// What contact elements do in a cycle, or parts of that.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementFigures {
    /// Half range of the mean displacement along x \[m\].
    pub displacement: f64,
    /// Half ranges of the resultants along x and y together: exact along a line \[N\].
    pub total_force: f64,
    /// Force along the motion \[N\], and energy \[J\].
    pub cycle: CycleFigures,
}

impl ElementFigures {
    fn of(cycle: &JointCycle) -> ElementFigures {
        let along = |of: &[[f64; 3]], d: usize| half_range(of.iter().map(|v| v[d]));
        ElementFigures {
            displacement: along(&cycle.displacement, 0),
            total_force: along(&cycle.force, 0).hypot(along(&cycle.force, 1)),
            cycle: CycleFigures {
                force: half_range(cycle.force_along.iter().copied()),
                energy: cycle.dissipated_energy.iter().sum(),
            },
        }
    }

    /// In parts of those of another cycle; 1 of what that has nothing of.
    fn over(self, other: ElementFigures) -> ElementFigures {
        let part = |value: f64, of: f64| if of > 0.0 { value / of } else { 1.0 };
        ElementFigures {
            displacement: part(self.displacement, other.displacement),
            total_force: part(self.total_force, other.total_force),
            cycle: self.cycle.over(other.cycle),
        }
    }
}

/// A motion, how it is marched, and what its elements do.
#[derive(Clone)]
struct Marched {
    motion: Motion,
    march: March,
    /// What a march between two reversals leaves out of the work of friction, relative to it.
    left_out: f64,
    figures: ElementFigures,
}

impl ComputedMotion {
    /// That of a response, under a static `load`.
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        load: f64,
        moved: &ElementMotion,
    ) -> Result<ComputedMotion, RunError> {
        let recipe = &reads.recipe;
        let Some(cycle) = recipe.cycle() else {
            unreachable!("a stage that moves the joint declares its cycle");
        };
        let samples = cycle.steps * FINE_SAMPLES.div_ceil(cycle.steps);
        let (harmonics, displacement) = harmonics_of(&moved.response)?;
        let layout = layout(reads);
        let elements = recipe.elements();
        let mut elements = elements
            .map(|elements| elements.with(&layout, &moved.parameters))
            .unwrap_or_default();
        let all = elements.iter_mut();
        all.for_each(|element| element.multiply_friction(moved.stepped_part));
        let has_laws = moved.parameters.sliders.is_some();
        Ok(ComputedMotion {
            elements,
            nodes: match has_laws {
                true => Some(solvers.elements(reads)?),
                false => None,
            },
            centres: layout.centres,
            axes: axes(recipe),
            sampling: Sampling::new(harmonics, samples)?,
            displacement,
            trend: moved.trend.clone(),
            stepped_part: moved.stepped_part,
            smooth: smooth(reads)?,
            has_laws,
            cycle: cycle.clone(),
            load,
            threads: solvers.threads().clone(),
            known: RefCell::default(),
        })
    }

    /// The coefficients of the displacement at a `compliance` of the fine contact \[m\].
    fn displacement_at(&self, compliance: f64) -> Vec<f64> {
        match &self.trend {
            Some(trend) => trend.at(&self.displacement, compliance),
            None => self.displacement.clone(),
        }
    }

    /// Whether the motion at a `compliance` of the fine contact is that of the response itself.
    fn stays(&self, compliance: f64) -> bool {
        let times = self.trend.as_ref().map(|trend| trend.times(compliance));
        times.unwrap_or(0.0) == 0.0
    }

    /// What the elements do at a `compliance` of the fine contact, in parts of what they do in the response itself; without one, that.
    pub fn figures_at(&self, compliance: Option<f64>) -> Result<ElementFigures, RunError> {
        let last = self.last_compliance();
        let of_response = self.marched_at(last)?.figures;
        let now = self.marched_at(compliance.unwrap_or(last))?.figures;
        Ok(now.over(of_response))
    }

    /// The compliance at the response itself.
    fn last_compliance(&self) -> f64 {
        self.trend.as_ref().map_or(0.0, |trend| trend.compliance[1])
    }

    /// The motion of the fine contact by these coefficients, at many samples: the mean of the elements' displacement over the area, and what
    /// the load of the joint varies by. The mean of that variation is left out: under prescribed displacement it is the bolt that bears
    /// the load.
    fn fine(
        &self,
        coefficients: &[f64],
    ) -> Result<(Motion, Option<WorkBetweenEnds>, ElementFigures), DynamicsError> {
        let sampling = &self.sampling;
        let samples = sampling.samples();
        let cycle = joint_cycle_on(
            &self.threads,
            &self.elements,
            coefficients,
            sampling,
            &self.centres,
        )?;
        let series = |of: &[[f64; 3]]| -> Vec<Vec<f64>> {
            let axis = |d: usize| of.iter().map(|v| v[d]).collect();
            (0..self.axes).map(axis).collect()
        };
        let mean = &cycle.displacement;
        let work = self
            .has_laws
            .then(|| WorkBetweenEnds::of(&self.elements, coefficients, sampling, &cycle));
        let nodes = self.nodes.as_ref().and_then(|elements| elements.nodes());
        let own = work.as_ref().zip(nodes).map(|(work, nodes)| NodalMotion {
            work_part: self.stepped_part * work.work_part,
            force_part: self.stepped_part * work.force_part,
            ..own_motion(nodes, self.axes, coefficients, sampling, mean, work)
        });
        let mut displacement = series(&cycle.displacement);
        if let Some(smooth) = self.smooth {
            displacement =
                fine_displacement(&displacement, &series(&cycle.force), smooth.tangential);
        }
        let normal_load: Vec<f64> = cycle.force.iter().map(|f| f[2]).collect();
        let motion = Motion {
            time: (0..samples).map(|k| k as f64 / samples as f64).collect(),
            by_order: false,
            drive: displacement
                .into_iter()
                .map(Channel::Displacement)
                .collect(),
            rotation: None,
            mean_load: mean_of(&normal_load),
            normal_load,
            own,
        };
        Ok((
            motion.with_mean_load(self.load),
            work,
            ElementFigures::of(&cycle),
        ))
    }

    fn marched(&self, coefficients: &[f64]) -> Result<Marched, RunError> {
        let (fine, work, figures) = self.fine(coefficients)?;
        let (motion, march, left_out) = self.cycle.of_computed(&fine, work.as_ref())?;
        Ok(Marched {
            motion,
            march,
            left_out,
            figures,
        })
    }

    /// The motion at a `compliance` of the fine contact. One that would be marched otherwise than the response itself, or opens the joint, is no motion to carry on to:
    /// the response then stays as it is.
    fn marched_at(&self, compliance: f64) -> Result<Marched, RunError> {
        let compliance = match self.stays(compliance) {
            true => self.last_compliance(),
            false => compliance,
        };
        if let Some((_, known)) = self.known.borrow().iter().find(|(of, _)| *of == compliance) {
            return Ok(known.clone());
        }
        let found = if compliance == self.last_compliance() {
            self.marched(&self.displacement)?
        } else {
            let of_response = self.marched_at(self.last_compliance())?;
            match self.marched(&self.displacement_at(compliance)) {
                Ok(found) if found.march == of_response.march => found.with_parts_of(of_response),
                Ok(_) | Err(RunError::Cycle(_)) => of_response,
                Err(error) => return Err(error),
            }
        };
        let mut known = self.known.borrow_mut();
        // Asked for are that of the response, and those of the step at hand.
        if known.len() == KNOWN {
            known.remove(1);
        }
        known.push((compliance, found.clone()));
        Ok(found)
    }
}

impl Marched {
    /// With the parts of the work of friction that elements have in the response itself: under laws of the last update and the motion that is carried on
    /// they fall, and do not in the response that is found.
    fn with_parts_of(mut self, of_response: Marched) -> Marched {
        if let (Some(own), Some(of)) = (&mut self.motion.own, of_response.motion.own) {
            own.work = of.work;
            own.work_part = of.work_part;
            own.force_part = of.force_part;
        }
        self.left_out = of_response.left_out;
        self
    }
}

/// What a joint is let move by.
pub struct DrivingMotion {
    /// What marching a computed motion between its reversals leaves out of the work of friction, relative to it.
    pub left_out: f64,
    /// The motion, where it is computed.
    pub computed: Option<Rc<ComputedMotion>>,
}

/// Lets the joint move under a static `load`: as is prescribed, or as a response to its contact elements says at a tangential `compliance` of the fine contact
/// \[m/N\], and on from there as it wears; without one, as the response itself.
pub fn let_move(
    reads: &StageInputs,
    solvers: &mut Solvers,
    load: f64,
    moved: Option<&ElementMotion>,
    compliance: Option<f64>,
) -> Result<DrivingMotion, RunError> {
    let recipe = &reads.recipe;
    let Some(cycle) = recipe.cycle() else {
        unreachable!("a stage that moves the joint declares its cycle");
    };
    let Some(moved) = moved else {
        let mut motion = reads.motion().clone();
        // Always from the motion of the scene: shifted again and again it would hang on how often that was.
        if contact_of(recipe).conditions.bolt_stiffness.is_some() {
            motion = motion.with_mean_load(load);
        }
        let joint = solvers.joint(reads)?;
        joint.motion = motion;
        joint.march = cycle.march.unwrap_or(March::Reversal);
        joint.options.extrapolate = cycle.extrapolate;
        return Ok(DrivingMotion {
            left_out: 0.0,
            computed: None,
        });
    };
    let computed = Rc::new(ComputedMotion::of(reads, solvers, load, moved)?);
    let compliance = compliance.unwrap_or(computed.last_compliance());
    let Marched {
        motion,
        march,
        left_out,
        ..
    } = computed.marched_at(compliance)?;
    let joint = solvers.joint(reads)?;
    joint.motion = motion;
    joint.march = march;
    joint.options.extrapolate = cycle.extrapolate;
    if computed.trend.is_some() {
        let (course, stays) = (computed.clone(), joint.motion.clone());
        let motion = move |compliance| match course.marched_at(compliance) {
            Ok(marched) => marched.motion,
            Err(_) => stays.clone(),
        };
        let of_contact = contact_of(recipe);
        joint.course = Some(EvolvingMotion {
            motion: Rc::new(motion),
            begin: compliance,
            shear: of_contact.shear,
            coupling: of_contact.coupling,
        });
    }
    Ok(DrivingMotion {
        left_out,
        computed: Some(computed),
    })
}

/// Lets the joint move to and fro between the ends of a response to its elements, as it is at a `compliance` of the fine contact, under the loads at rest,
/// whatever the recipe says of cycles, and says what these do there; none if elements have no laws of their own. Of an orbit the ends are those of its longest line.
pub fn let_move_between_ends(
    reads: &StageInputs,
    solvers: &mut Solvers,
    load: f64,
    moved: &ElementMotion,
    compliance: Option<f64>,
) -> Result<Option<WorkBetweenEnds>, RunError> {
    let computed = ComputedMotion::of(reads, solvers, load, moved)?;
    let compliance = compliance.unwrap_or(computed.last_compliance());
    let (fine, work, _) = computed.fine(&computed.displacement_at(compliance))?;
    if let Some(work) = &work {
        let joint = solvers.joint(reads)?;
        joint.motion = fine.between_ends(work.line.ends);
        joint
            .motion
            .own
            .iter_mut()
            .for_each(NodalMotion::under_loads_at_rest);
        joint.march = March::Reversal;
    }
    Ok(work)
}

/// What the nodes of contact elements move against the `mean` of all, sample by sample.
fn own_motion(
    nodes: &Nodes,
    axes: usize,
    displacement: &[f64],
    sampling: &Sampling,
    mean: &[[f64; 3]],
    work: &WorkBetweenEnds,
) -> NodalMotion {
    let count = nodes.interpolation.nodes();
    let mut own = vec![vec![0.0; axes * count]; mean.len()];
    let mut approach = vec![vec![0.0; count]; mean.len()];
    let mut part = vec![1.0; count];
    let mut direction = vec![0.0; axes * count];
    for (&node, along) in nodes.numbers.iter().zip(&work.line.direction) {
        for axis in 0..axes {
            direction[axis * count + node] = along[axis];
        }
    }
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    for ((&node, row), of_element) in nodes.numbers.iter().zip(rows).zip(&work.part) {
        part[node] = *of_element;
        let samples = own.iter_mut().zip(&mut approach);
        for (((own, approach), u), mean) in samples.zip(sampling.synthesise(row)).zip(mean) {
            for axis in 0..axes {
                own[axis * count + node] = u[axis] - mean[axis];
            }
            approach[node] = u[2];
        }
    }
    NodalMotion {
        interpolation: nodes.interpolation.clone(),
        displacement: own,
        approach,
        work: part,
        work_part: work.work_part,
        force_part: work.force_part,
        direction,
    }
}
