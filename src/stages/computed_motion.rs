//! The motion that drives the joint: either the prescribed motion, or the motion of the response to its contact
//! elements. Between two model updates, the motion of a response is extrapolated from its last change.

use std::cell::RefCell;
use std::rc::Rc;

use super::RunError;
use super::contact_state::{axes, coefficients_of, contact_of, harmonics_of, parameters_of};
use super::solvers::{Solvers, element_layout, smooth_compliance};
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

/// Number of samples per cycle of a computed motion: reversals are found to 2e-5 of the amplitude.
const FINE_SAMPLES: usize = 512;

/// Response of a vibrating joint, with its contact elements.
pub struct ElementMotion {
    response: typed::Response,
    parameters: ElementParameters,
    /// Change since the previous response; `None` for a motion that is not extrapolated.
    trend: Option<Trend>,
    /// Energy of a stepped cycle over the energy of a reversal cycle. The ratio of both energies corrects the friction
    /// of the contact elements and of the fine contact.
    stepped_part: f64,
}

impl ElementMotion {
    /// Reads the motion of an iteration; `None` if no structure drives the joint.
    pub fn of(reads: &StageInputs) -> Result<Option<ElementMotion>, RunError> {
        let tables = (
            reads.optional_table()?,
            reads.optional_table()?,
            reads.optional_table()?,
        );
        Ok(Self::from(
            tables,
            reads.optional_table()?,
            reads.optional_table()?,
        ))
    }

    /// Reads the motion of the previous iteration.
    pub fn before(reads: &StageInputs) -> Result<Option<ElementMotion>, RunError> {
        let tables = (
            reads.optional_previous_table()?,
            reads.optional_previous_table()?,
            reads.optional_previous_table()?,
        );
        let (row, update) = (
            reads.optional_previous_table()?,
            reads.optional_previous_table()?,
        );
        Ok(Self::from(tables, row, update))
    }

    /// Returns the energy of a stepped cycle over the energy of a reversal cycle. The ratio of both energies corrects
    /// the friction of the contact elements and of the fine contact.
    pub fn stepped_part(&self) -> f64 {
        self.stepped_part
    }

    /// Returns the parameters of the contact elements.
    pub fn parameters(&self) -> &ElementParameters {
        &self.parameters
    }

    /// Returns the same motion with other element parameters and another energy ratio of stepped and reversal cycles.
    pub fn with_elements(self, parameters: ElementParameters, stepped_part: f64) -> ElementMotion {
        ElementMotion {
            parameters,
            stepped_part,
            ..self
        }
    }

    /// Returns the extrapolated change of the harmonic coefficients since the last response, in the order of
    /// [`harmonics_of`]. The extrapolation depends on the `compliance` of the fine contact. Returns `None` if the
    /// motion is not extrapolated.
    pub fn extrapolated_coefficients(&self, compliance: Option<f64>) -> Option<Vec<f64>> {
        let (trend, compliance) = self.trend.as_ref().zip(compliance)?;
        let times = trend.multiple(compliance);
        Some(trend.change.iter().map(|change| times * change).collect())
    }

    /// Returns true if each element has its own friction law.
    pub fn has_laws(&self) -> bool {
        self.parameters.sliders.is_some()
    }

    /// Creates the motion of a response that is not yet in a table. `stepped_part` is the energy of a stepped cycle
    /// over the energy of a reversal cycle.
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

/// Returns the change of the coefficients of a response since the previous response, in the order of [`harmonics_of`].
/// Returns `None` if the response has no columns of changes.
pub fn change_of(response: &typed::Response) -> Option<Vec<f64>> {
    let (cosine, sine) = (
        response.change_cosine.as_ref()?,
        response.change_sine.as_ref()?,
    );
    Some(coefficients_of(&response.harmonic, cosine, sine))
}

/// Motion of the fine contact under a response to contact elements, for any compliance of the fine contact.
pub struct ComputedMotion {
    elements: Vec<ContactElement>,
    centres: Vec<[f64; 2]>,
    nodes: Option<Rc<ContactElements>>,
    /// Number of axes of the fine contact.
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
    /// Cache of computed motions: pairs of a compliance of the fine contact and the motion at the compliance.
    cache: RefCell<Vec<(f64, MarchedMotion)>>,
}

/// Number of motions in the cache.
const CACHE_SIZE: usize = 4;

/// Displacement, force and energy of contact elements in a cycle, absolute or relative to another cycle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElementFigures {
    /// Half range of the mean displacement along x \[m\].
    pub displacement: f64,
    /// Combined half ranges of the resultants along x and y \[N\]; exact for a straight motion.
    pub total_force: f64,
    /// Force along the motion \[N\], and energy \[J\].
    pub cycle: CycleFigures,
}

impl ElementFigures {
    fn of(cycle: &JointCycle) -> ElementFigures {
        let along = |values: &[[f64; 3]], d: usize| half_range(values.iter().map(|v| v[d]));
        ElementFigures {
            displacement: along(&cycle.displacement, 0),
            total_force: along(&cycle.force, 0).hypot(along(&cycle.force, 1)),
            cycle: CycleFigures {
                force: half_range(cycle.force_along.iter().copied()),
                energy: cycle.dissipated_energy.iter().sum(),
            },
        }
    }

    /// Returns each value of the cycle `self` over the value of the cycle `other`. Returns 1 where the value of `other`
    /// is 0.
    fn over(self, other: ElementFigures) -> ElementFigures {
        let part = |value: f64, reference: f64| {
            if reference > 0.0 {
                value / reference
            } else {
                1.0
            }
        };
        ElementFigures {
            displacement: part(self.displacement, other.displacement),
            total_force: part(self.total_force, other.total_force),
            cycle: self.cycle.relative_to(other.cycle),
        }
    }
}

/// A motion, the way in which it is marched, and the response of the contact elements.
#[derive(Clone)]
struct MarchedMotion {
    motion: Motion,
    march: March,
    /// Relative error of the work of friction if the motion is marched between two reversals.
    left_out: f64,
    figures: ElementFigures,
}

impl ComputedMotion {
    /// Creates the motion of a response under a static `load`.
    fn of(
        reads: &StageInputs,
        solvers: &mut Solvers,
        load: f64,
        element_motion: &ElementMotion,
    ) -> Result<ComputedMotion, RunError> {
        let recipe = &reads.recipe;
        let Some(cycle) = recipe.cycle() else {
            unreachable!("a stage that moves the joint declares its cycle");
        };
        let samples = cycle.steps * FINE_SAMPLES.div_ceil(cycle.steps);
        let (harmonics, displacement) = harmonics_of(&element_motion.response)?;
        let layout = element_layout(reads);
        let elements = recipe.elements();
        let mut elements = elements
            .map(|elements| elements.with(&layout, &element_motion.parameters))
            .unwrap_or_default();
        let all = elements.iter_mut();
        all.for_each(|element| element.multiply_friction(element_motion.stepped_part));
        let has_laws = element_motion.parameters.sliders.is_some();
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
            trend: element_motion.trend.clone(),
            stepped_part: element_motion.stepped_part,
            smooth: smooth_compliance(reads)?,
            has_laws,
            cycle: cycle.clone(),
            load,
            threads: solvers.threads().clone(),
            cache: RefCell::default(),
        })
    }

    /// Returns the coefficients of the displacement at a `compliance` of the fine contact \[m\].
    fn displacement_at(&self, compliance: f64) -> Vec<f64> {
        match &self.trend {
            Some(trend) => trend.at(&self.displacement, compliance),
            None => self.displacement.clone(),
        }
    }

    /// Returns true if the motion at a `compliance` of the fine contact equals the motion of the response.
    fn equals_response(&self, compliance: f64) -> bool {
        let times = self.trend.as_ref().map(|trend| trend.multiple(compliance));
        times.unwrap_or(0.0) == 0.0
    }

    /// Returns the values of the elements at a `compliance` of the fine contact, relative to their values in the
    /// response. Without a compliance, all values are 1.
    pub fn figures_at(&self, compliance: Option<f64>) -> Result<ElementFigures, RunError> {
        let last = self.last_compliance();
        let response_figures = self.marched_at(last)?.figures;
        let now = self.marched_at(compliance.unwrap_or(last))?.figures;
        Ok(now.over(response_figures))
    }

    /// Returns the compliance of the fine contact in the response.
    fn last_compliance(&self) -> f64 {
        self.trend.as_ref().map_or(0.0, |trend| trend.compliance[1])
    }

    /// Returns the motion of the fine contact at many samples, from the harmonic `coefficients` of a response. The
    /// motion consists of the mean displacement of the elements, weighted by area, and of the variation of the load.
    /// The motion omits the mean of the load variation, since the bolt bears the mean load under prescribed
    /// displacement.
    fn fine_motion(
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
        let series = |values: &[[f64; 3]]| -> Vec<Vec<f64>> {
            let axis = |d: usize| values.iter().map(|v| v[d]).collect();
            (0..self.axes).map(axis).collect()
        };
        let mean = &cycle.displacement;
        let work = self
            .has_laws
            .then(|| WorkBetweenEnds::of(&self.elements, coefficients, sampling, &cycle));
        let nodes = self.nodes.as_ref().and_then(|elements| elements.nodes());
        let own = work.as_ref().zip(nodes).map(|(work, nodes)| NodalMotion {
            total_work_ratio: self.stepped_part * work.work_part,
            force_ratio: self.stepped_part * work.force_part,
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
            nodal_motion: own,
        };
        Ok((
            motion.with_mean_load(self.load),
            work,
            ElementFigures::of(&cycle),
        ))
    }

    fn marched(&self, coefficients: &[f64]) -> Result<MarchedMotion, RunError> {
        let (fine, work, figures) = self.fine_motion(coefficients)?;
        let (motion, march, left_out) = self.cycle.of_computed(&fine, work.as_ref())?;
        Ok(MarchedMotion {
            motion,
            march,
            left_out,
            figures,
        })
    }

    /// Returns the motion at a `compliance` of the fine contact. Returns the motion of the response if the extrapolated
    /// motion would open the joint or would require another marching method.
    fn marched_at(&self, compliance: f64) -> Result<MarchedMotion, RunError> {
        let compliance = match self.equals_response(compliance) {
            true => self.last_compliance(),
            false => compliance,
        };
        if let Some((_, cached)) = self
            .cache
            .borrow()
            .iter()
            .find(|(key, _)| *key == compliance)
        {
            return Ok(cached.clone());
        }
        let marched = if compliance == self.last_compliance() {
            self.marched(&self.displacement)?
        } else {
            let response_motion = self.marched_at(self.last_compliance())?;
            match self.marched(&self.displacement_at(compliance)) {
                Ok(marched) if marched.march == response_motion.march => {
                    marched.with_friction_of(response_motion)
                }
                Ok(_) | Err(RunError::Cycle(_)) => response_motion,
                Err(error) => return Err(error),
            }
        };
        let mut cache = self.cache.borrow_mut();
        // The first cache entry is the motion of the response. The other cache entries are motions of the current wear
        // step.
        if cache.len() == CACHE_SIZE {
            cache.remove(1);
        }
        cache.push((compliance, marched.clone()));
        Ok(marched)
    }
}

impl MarchedMotion {
    /// Replaces the friction ratios of the elements by the ratios in the response. Under the extrapolated motion, the
    /// ratios decrease with the laws of the last update. In the next converged response, the ratios do not decrease.
    fn with_friction_of(mut self, response_motion: MarchedMotion) -> MarchedMotion {
        if let (Some(own), Some(response_nodes)) = (
            &mut self.motion.nodal_motion,
            response_motion.motion.nodal_motion,
        ) {
            own.work_ratio = response_nodes.work_ratio;
            own.total_work_ratio = response_nodes.total_work_ratio;
            own.force_ratio = response_nodes.force_ratio;
        }
        self.left_out = response_motion.left_out;
        self
    }
}

/// Result of setting the motion of a joint.
pub struct DrivingMotion {
    /// Relative error of the work of friction if a computed motion is marched between its reversals.
    pub left_out: f64,
    /// The computed motion; `None` for a prescribed motion.
    pub computed: Option<Rc<ComputedMotion>>,
}

/// Sets the motion of the joint under a static `load`. The motion is the prescribed motion, or the motion of the
/// contact elements in a response. A response is taken at a tangential `compliance` of the fine contact \[m/N\] and
/// evolves from there with the wear. Without a compliance, the motion starts from the response itself.
pub fn set_motion(
    reads: &StageInputs,
    solvers: &mut Solvers,
    load: f64,
    element_motion: Option<&ElementMotion>,
    compliance: Option<f64>,
) -> Result<DrivingMotion, RunError> {
    let recipe = &reads.recipe;
    let Some(cycle) = recipe.cycle() else {
        unreachable!("a stage that moves the joint declares its cycle");
    };
    let Some(element_motion) = element_motion else {
        let mut motion = reads.motion().clone();
        // Always shifts the motion of the scene. If each call shifted the motion of the previous call, the mean load
        // would depend on the number of calls.
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
    let computed = Rc::new(ComputedMotion::of(reads, solvers, load, element_motion)?);
    let compliance = compliance.unwrap_or(computed.last_compliance());
    let MarchedMotion {
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
        let (course, initial_motion) = (computed.clone(), joint.motion.clone());
        let motion = move |compliance| match course.marched_at(compliance) {
            Ok(marched) => marched.motion,
            Err(_) => initial_motion.clone(),
        };
        let contact = contact_of(recipe);
        joint.evolving_motion = Some(EvolvingMotion {
            motion: Rc::new(motion),
            begin: compliance,
            shear: contact.shear,
            coupling: contact.coupling,
        });
    }
    Ok(DrivingMotion {
        left_out,
        computed: Some(computed),
    })
}

/// Sets a straight motion of the joint between the two ends of a response. The motion applies to a `compliance` of the
/// fine contact and to the loads at rest. The cycle keys of the recipe are ignored. For an orbit, the ends of the
/// motion are the ends of the longest line in the orbit. Returns the work of the elements in the straight motion.
/// Returns `None` if the elements have no individual friction laws.
pub fn set_motion_between_ends(
    reads: &StageInputs,
    solvers: &mut Solvers,
    load: f64,
    element_motion: &ElementMotion,
    compliance: Option<f64>,
) -> Result<Option<WorkBetweenEnds>, RunError> {
    let computed = ComputedMotion::of(reads, solvers, load, element_motion)?;
    let compliance = compliance.unwrap_or(computed.last_compliance());
    let (fine, work, _) = computed.fine_motion(&computed.displacement_at(compliance))?;
    if let Some(work) = &work {
        let joint = solvers.joint(reads)?;
        joint.motion = fine.between_ends(work.line.ends);
        joint
            .motion
            .nodal_motion
            .iter_mut()
            .for_each(NodalMotion::reset_ratios);
        joint.march = March::Reversal;
    }
    Ok(work)
}

/// Returns the motion of the nodes of the contact elements relative to the `mean` motion, sample by sample.
fn own_motion(
    nodes: &Nodes,
    axes: usize,
    displacement: &[f64],
    sampling: &Sampling,
    mean: &[[f64; 3]],
    work: &WorkBetweenEnds,
) -> NodalMotion {
    let count = nodes.interpolation.nodes();
    let mut relative_motion = vec![vec![0.0; axes * count]; mean.len()];
    let mut approach = vec![vec![0.0; count]; mean.len()];
    let mut part = vec![1.0; count];
    let mut direction = vec![0.0; axes * count];
    for (&node, along) in nodes.numbers.iter().zip(&work.line.direction) {
        for axis in 0..axes {
            direction[axis * count + node] = along[axis];
        }
    }
    let rows = displacement.chunks(3 * sampling.harmonics().coefficients());
    for ((&node, row), element_part) in nodes.numbers.iter().zip(rows).zip(&work.part) {
        part[node] = *element_part;
        let samples = relative_motion.iter_mut().zip(&mut approach);
        for (((relative_motion, approach), u), mean) in
            samples.zip(sampling.synthesise(row)).zip(mean)
        {
            for axis in 0..axes {
                relative_motion[axis * count + node] = u[axis] - mean[axis];
            }
            approach[node] = u[2];
        }
    }
    NodalMotion {
        interpolation: nodes.interpolation.clone(),
        displacement: relative_motion,
        approach,
        work_ratio: part,
        total_work_ratio: work.work_part,
        force_ratio: work.force_part,
        direction,
    }
}
