//! The contact of a joint as the tables hold it: fields on its kept cells, and what moves it.

use super::RunError;
use super::reads::Reads;
use super::solvers::{Solvers, layout, smooth};
use crate::contact::Shear;
use crate::contact::normal::NormalSolution;
use crate::dynamics::cycle::{WorkBetweenEnds, joint_cycle};
use crate::dynamics::{Harmonics, Sampling};
use crate::grid::{ByAxis, Patch};
use crate::model_update::{
    Compliance, ContactElements, ElementParameters, Nodes, Sliders, fine_displacement,
};
use crate::recipe::{Contact, Recipe};
use crate::tables::{TableError, TableName, typed};
use crate::wear::cycle::{CycleSolution, March};
use crate::wear::joint::WornState;
use crate::wear::{Channel, Motion, OwnMotion, mean_of};

/// Samples of a cycle at which a computed motion is looked at: reversals are found to 2e-5 of the reach.
const FINE_SAMPLES: usize = 512;

/// The fields of a contact on all cells of the grid.
pub struct Fields {
    pub gap: Vec<f64>,
    pub pressure: Vec<f64>,
    /// One field an axis; of none where the contact has no shear yet.
    pub shear: ByAxis<Vec<f64>>,
}

impl Fields {
    /// From a table.
    pub fn of(patch: &Patch, table: &typed::ContactField) -> Fields {
        let shear = [&table.shear_x, &table.shear_y].into_iter().flatten();
        Fields {
            gap: patch.spread(&table.gap),
            pressure: patch.spread(&table.pressure),
            shear: shear.map(|shear| patch.spread(shear)).collect(),
        }
    }

    /// As a table, without the fields of a cycle.
    pub fn table(&self, patch: &Patch) -> typed::ContactField {
        let (i, j) = patch.indices();
        let mut shear = self.shear.iter().map(|shear| patch.gather(shear));
        typed::ContactField {
            i,
            j,
            gap: patch.gather(&self.gap),
            pressure: patch.gather(&self.pressure),
            shear_x: shear.next(),
            shear_y: shear.next(),
            slip_path: None,
            dissipation: None,
        }
    }
}

/// A worn state as its tables hold it.
pub fn worn_state(
    recipe: &Recipe,
    patch: &Patch,
    wear: Option<typed::WearField>,
    fields: &typed::ContactField,
    cycle: &typed::FrettingCycle,
) -> Result<WornState, TableError> {
    let Fields {
        pressure, shear, ..
    } = Fields::of(patch, fields);
    let field = |values: &Option<Vec<f64>>, column| -> Result<Vec<f64>, TableError> {
        Ok(patch.spread(there(TableName::ContactField, values, column)?))
    };
    Ok(WornState {
        wear: wear_of(patch, wear),
        pressure,
        cycle: CycleSolution {
            shear: on_axes(recipe, patch, shear),
            slip_path: field(&fields.slip_path, "slip_path")?,
            energy: field(&fields.dissipation, "dissipation")?,
            dissipation: cycle.dissipated_energy,
            instants: Vec::new(),
            steps: 0,
            error: cycle.error_tangential,
            dissipation_error: cycle.error_cycle * cycle.dissipated_energy,
        },
    })
}

/// The static contact of both its tables.
pub fn solution_of(row: &typed::StaticContact, fields: Fields) -> NormalSolution {
    let or_zero = |pair: [Option<f64>; 2]| pair.map(|value| value.unwrap_or(0.0));
    NormalSolution {
        pressure: fields.pressure,
        gap: fields.gap,
        approach: row.approach,
        iterations: row.iterations as usize,
        rotation: or_zero([row.rotation_x, row.rotation_y]),
        load: row.normal_load,
        moment: [row.moment_x, row.moment_y],
        error: row.error,
    }
}

/// Compliance of the fine contact, in runs whose contact elements are made of it.
pub fn compliance_of(row: &typed::StaticContact) -> Result<Compliance, TableError> {
    let kn = there(TableName::StaticContact, &row.kn, "kn")?;
    let kt = there(TableName::StaticContact, &row.kt, "kt")?;
    Ok(Compliance::of(*kn, *kt))
}

/// A column that every state of wear has.
pub fn there<'a, T>(
    table: TableName,
    value: &'a Option<T>,
    column: &str,
) -> Result<&'a T, TableError> {
    value.as_ref().ok_or_else(|| TableError::MissingColumn {
        table: table.as_str().to_owned(),
        column: column.to_owned(),
    })
}

/// The wear of an iteration on all cells; none of the unworn state and in a scene without wear.
pub fn wear_of(patch: &Patch, field: Option<typed::WearField>) -> Vec<f64> {
    match field {
        Some(field) => patch.spread(&field.wear_depth),
        None => vec![0.0; patch.grid.len()],
    }
}

/// The rough contact of a stage that declares it.
pub fn contact_of(recipe: &Recipe) -> &Contact {
    recipe
        .contact()
        .expect("a stage that solves a contact declares it")
}

/// Shear along the axes that a recipe has: what was inherited may have another one less, or more. No shear at all stays none.
pub fn on_axes(recipe: &Recipe, patch: &Patch, mut shear: ByAxis<Vec<f64>>) -> ByAxis<Vec<f64>> {
    if !shear.is_empty() {
        shear.resize_with(axes(recipe), || vec![0.0; patch.grid.len()]);
    }
    shear
}

fn axes(recipe: &Recipe) -> usize {
    match contact_of(recipe).shear {
        Shear::AlongX => 1,
        Shear::InPlane => 2,
    }
}

/// Parameters of contact elements as their tables have them.
pub fn parameters_of(
    elements: &typed::ContactElement,
    sliders: Option<typed::ContactSlider>,
) -> ElementParameters {
    ElementParameters {
        normal_load: elements.normal_load.clone(),
        gap: elements.gap.clone(),
        kn: elements.kn.clone(),
        kt: elements.kt.clone(),
        sliders: sliders.map(|table| Sliders {
            element: table.element.iter().map(|&e| e as usize).collect(),
            normal_load: table.normal_load,
            gap: table.gap,
            kn: table.kn,
            kt: table.kt,
        }),
    }
}

/// The response of a vibrating joint, with the contact elements that it is of.
pub struct ElementMotion {
    response: typed::Response,
    parameters: ElementParameters,
}

impl ElementMotion {
    /// That of an iteration; none where no structure moves the joint.
    pub fn of(reads: &Reads) -> Result<Option<ElementMotion>, RunError> {
        let tables = (reads.maybe()?, reads.maybe()?, reads.maybe()?);
        Ok(Self::from(tables))
    }

    /// That of the iteration before.
    pub fn before(reads: &Reads) -> Result<Option<ElementMotion>, RunError> {
        let tables = (
            reads.maybe_before()?,
            reads.maybe_before()?,
            reads.maybe_before()?,
        );
        Ok(Self::from(tables))
    }

    /// That of a response that is in no table yet.
    pub fn new(response: typed::Response, parameters: ElementParameters) -> ElementMotion {
        ElementMotion {
            response,
            parameters,
        }
    }

    fn from(
        (response, elements, sliders): (
            Option<typed::Response>,
            Option<typed::ContactElement>,
            Option<typed::ContactSlider>,
        ),
    ) -> Option<ElementMotion> {
        Some(ElementMotion {
            response: response?,
            parameters: parameters_of(&elements?, sliders),
        })
    }
}

/// Harmonics of a response, and its coefficients, ports slow.
pub fn harmonics_of(response: &typed::Response) -> Result<(Harmonics, Vec<f64>), RunError> {
    let orders = &response.harmonic;
    let mut displacement = Vec::with_capacity(2 * orders.len());
    let of_order = response
        .displacement_cosine
        .iter()
        .zip(&response.displacement_sine);
    for (order, (cosine, sine)) in orders.iter().zip(of_order) {
        displacement.push(*cosine);
        if *order > 0 {
            displacement.push(*sine);
        }
    }
    let mut of_a_port: Vec<u32> = orders.iter().map(|order| *order as u32).collect();
    of_a_port.sort_unstable();
    of_a_port.dedup();
    Ok((Harmonics::new(&of_a_port)?, displacement))
}

/// Lets the joint move under a static `load`: as is prescribed, or as a response to its contact elements says. What is left out of the
/// work of friction by marching a computed motion between its reversals, relative to it.
pub fn let_move(
    reads: &Reads,
    solvers: &mut Solvers,
    load: f64,
    moved: Option<&ElementMotion>,
) -> Result<f64, RunError> {
    let recipe = &reads.recipe;
    let Some(cycle) = recipe.cycle() else {
        unreachable!("a stage that moves the joint declares its cycle");
    };
    let mut left_out = 0.0;
    let (motion, march) = match moved {
        Some(moved) => {
            let (fine, work) = computed(reads, solvers, load, moved)?;
            let (motion, march, without) = cycle.of_computed(&fine, work.as_ref())?;
            left_out = without;
            (motion, march)
        }
        None => {
            let mut motion = reads.motion().clone();
            // Always from the motion of the scene: shifted again and again it would hang on how often that was.
            if contact_of(recipe).conditions.bolt_stiffness.is_some() {
                motion = motion.with_mean_load(load);
            }
            let march = cycle.march.unwrap_or(March::Reversal);
            (motion, march)
        }
    };
    let joint = solvers.joint(reads)?;
    joint.motion = motion;
    joint.march = march;
    joint.options.extrapolate = cycle.extrapolate;
    Ok(left_out)
}

/// Lets the joint move to and fro between the ends of a response to its elements under the loads at rest, whatever the recipe says of cycles, and
/// says what these do there; none if elements have no laws of their own. Of an orbit the ends are those of its longest line.
pub fn let_move_between_ends(
    reads: &Reads,
    solvers: &mut Solvers,
    load: f64,
    moved: &ElementMotion,
) -> Result<Option<WorkBetweenEnds>, RunError> {
    let (fine, work) = computed(reads, solvers, load, moved)?;
    if let Some(work) = &work {
        let joint = solvers.joint(reads)?;
        joint.motion = fine.between_ends(work.line.ends);
        joint
            .motion
            .own
            .iter_mut()
            .for_each(OwnMotion::under_loads_at_rest);
        joint.march = March::Reversal;
    }
    Ok(work)
}

/// The motion that a response gives the fine contact, at many samples: the mean of the elements' displacement over the area, and what
/// the load of the joint varies by. The mean of that variation is left out: under prescribed displacement it is the bolt that bears
/// the load.
fn computed(
    reads: &Reads,
    solvers: &mut Solvers,
    load: f64,
    moved: &ElementMotion,
) -> Result<(Motion, Option<WorkBetweenEnds>), RunError> {
    let recipe = &reads.recipe;
    let steps = recipe.cycle().map_or(1, |cycle| cycle.steps);
    let samples = steps * FINE_SAMPLES.div_ceil(steps);
    let (harmonics, displacement) = harmonics_of(&moved.response)?;
    let sampling = Sampling::new(harmonics, samples)?;
    let layout = layout(reads);
    let elements = recipe.elements();
    let elements = elements.map(|elements| elements.with(&layout, &moved.parameters));
    let elements = elements.unwrap_or_default();
    let cycle = joint_cycle(&elements, &displacement, &sampling, &layout.centres)?;
    let axes = axes(recipe);
    let series = |of: &[[f64; 3]]| -> Vec<Vec<f64>> {
        let axis = |d: usize| of.iter().map(|v| v[d]).collect();
        (0..axes).map(axis).collect()
    };
    let mean = &cycle.displacement;
    let has_laws = moved.parameters.sliders.is_some();
    let work = has_laws.then(|| WorkBetweenEnds::of(&elements, &displacement, &sampling, &cycle));
    let mut own = None;
    if let Some(work) = &work {
        let elements = solvers.elements(reads)?;
        let nodes = elements.nodes();
        own = nodes.map(|nodes| own_motion(nodes, axes, &displacement, &sampling, mean, work));
    }
    let mut displacement = series(&cycle.displacement);
    if let Some(smooth) = smooth(reads)? {
        displacement = fine_displacement(&displacement, &series(&cycle.force), smooth.tangential);
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
    Ok((motion.with_mean_load(load), work))
}

/// What the nodes of contact elements move against the `mean` of all, sample by sample.
fn own_motion(
    nodes: &Nodes,
    axes: usize,
    displacement: &[f64],
    sampling: &Sampling,
    mean: &[[f64; 3]],
    work: &WorkBetweenEnds,
) -> OwnMotion {
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
    OwnMotion {
        interpolation: nodes.interpolation.clone(),
        displacement: own,
        approach,
        work: part,
        work_part: work.work_part,
        force_part: work.force_part,
        direction,
    }
}

/// Displacement of each element at the end of a straight motion, along x and y \[m\].
pub fn reach_of(elements: &ContactElements, motion: &Motion) -> Vec<[f64; 2]> {
    let mut reach = vec![[0.0; 2]; elements.len()];
    let Some(straight) = motion.straight() else {
        return reach;
    };
    let (all, own) = straight.end.split_at(motion.channels().count());
    let own = elements.nodes().filter(|_| !own.is_empty()).map(|of| {
        let axes = own.chunks_exact(of.interpolation.nodes());
        (axes, &of.numbers)
    });
    for axis in 0..motion.drive.len() {
        reach.iter_mut().for_each(|reach| reach[axis] = all[axis]);
    }
    if let Some((axes, numbers)) = own {
        for (axis, nodes) in axes.enumerate() {
            for (reach, &node) in reach.iter_mut().zip(numbers) {
                reach[axis] += nodes[node];
            }
        }
    }
    reach
}
