//! Unknowns, disk space and peak memory of a run, counted from its recipe.
//!
//! The memory is the sum of the allocated fields. The fields belong to [`crate::contact::HalfSpace`], the solvers, the
//! cycle, the wear step and the matrices of a structure. A test compares the sum with the memory that the operating
//! system reports.

use serde::Serialize;

use super::{Inputs, Recipe};
use crate::contact::Shear;
use crate::dynamics::Harmonics;
use crate::wear::cycle::March;

/// Size of a number \[B\].
const DOUBLE: f64 = 8.0;
/// Memory for the code and tables of the program before the program computes \[B\], measured in a run without contact.
const PROGRAM: f64 = 27.0 * 1024.0 * 1024.0;
/// Largest number of matrices during a harmonic balance, without the Jacobians of the contact elements. The size of
/// each matrix is the number of contact degrees of freedom.
const RESPONSE: f64 = 8.0;
/// Number of matrices of the contact's degrees of freedom that the structure and its closed model keep allocated.
const MODEL: f64 = 3.0;
/// Number of simultaneous sets of Jacobians in a harmonic balance.
const SETS: f64 = 3.5;
/// Size of the tables of an iteration with one row, or with one row per sample of the cycle \[B\].
const TABLES: f64 = 40e3;
/// Number of fields of one normal solve. The count includes the fields and cell lists of the solver, the worn heights,
/// and the gap.
const NORMAL_SOLVE: f64 = 12.0;
/// Part of the cells in contact, for the size of the arrays of a tangential solve. The assumed part is larger than the
/// part in contact in a rough joint.
const IN_CONTACT: f64 = 0.3;

/// Resources of a run that follow from its recipe.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct ResourceEstimate {
    /// Contact elements of the structure.
    pub contact_elements: usize,
    /// Unknowns of the harmonic balance with all contact elements active.
    pub unknowns: usize,
    /// Cells of the joint; 0 without a rough surface.
    pub cells: usize,
    /// Grid of the plane on which fields are transformed.
    pub plane: [usize; 2],
    /// Peak memory of the whole program \[B\].
    pub memory: u64,
    /// Peak memory of a run whose structure is in the cache \[B\]; `None` without a reduction.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_cached: Option<u64>,
    /// Disk space of a stored iteration \[B\]. The compression of the tables makes the disk space uncertain by a factor
    /// of two.
    pub disk_per_iteration: u64,
}

impl ResourceEstimate {
    /// Counts the resources of a run.
    pub fn of(inputs: &Inputs) -> ResourceEstimate {
        let recipe = &inputs.recipe;
        let elements = contact_elements(recipe);
        let orders = recipe.response.as_ref().map_or(0, |r| r.harmonics.len());
        let least = ResourceEstimate::least_memory(inputs);
        // The reduction of the structure ends before the run allocates other memory, and frees the memory of the
        // reduction.
        let reduction = reduction(inputs).map(|bytes| (PROGRAM + bytes) as u64);
        let mut counted = ResourceEstimate {
            contact_elements: elements,
            unknowns: 3 * elements * (2 * orders).saturating_sub(1),
            cells: recipe.surface().map_or(0, |surface| surface.kept),
            plane: recipe.contact().map_or([0; 2], |contact| contact.plane),
            memory: least.max(reduction.unwrap_or(0)),
            memory_cached: reduction.map(|_| least),
            disk_per_iteration: 0,
        };
        counted.disk_per_iteration = disk_per_iteration(inputs, &counted) as u64;
        counted
    }

    /// Returns the least memory of a run: with the structure in the cache, without the memory of the reduction \[B\].
    pub fn least_memory(inputs: &Inputs) -> u64 {
        peak(inputs) as u64
    }
}

fn contact_elements(recipe: &Recipe) -> usize {
    recipe.elements().map_or(0, |elements| elements.count)
}

/// Returns the bytes for the reduction of the structure; `None` without a reduction.
fn reduction(inputs: &Inputs) -> Option<f64> {
    let structure = inputs.recipe.structure.as_ref()?;
    structure.memory_to_reduce(inputs.imported.as_deref())
}

/// Returns the compressed bytes of the tables of one iteration on a rough joint.
fn disk_per_iteration(inputs: &Inputs, counted: &ResourceEstimate) -> f64 {
    let recipe = &inputs.recipe;
    let axes = recipe.contact().map_or(0.0, |contact| match contact.shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    });
    // The tables store a gap or a pressure for each cell. For each cell in contact, the tables in addition store shear,
    // slip path, energy per cycle and wear.
    let cycle = recipe.cycle().map_or(0.0, |_| axes + 2.0);
    let wear = recipe.wear.as_ref().map_or(0.0, |_| 1.0);
    let contact = 1.0 + IN_CONTACT * (cycle + wear);
    // A wear run with a prescribed motion stores the same fields for its coarse trajectory.
    let times = match recipe.structure.is_none() && recipe.wear.is_some() {
        true => 2.0,
        false => 1.0,
    };
    let fields = counted.cells as f64 * (times * contact + cycle_fields(inputs, axes));
    DOUBLE * (fields + counted.unknowns as f64) + TABLES
}

/// Returns the peak memory \[B\] of a run whose structure is already reduced.
fn peak(inputs: &Inputs) -> f64 {
    let [between_stages, fullest] = doubles(inputs).map(|doubles| DOUBLE * doubles);
    let ports = 3.0 * contact_elements(&inputs.recipe) as f64;
    let orders = inputs.recipe.response.as_ref().map(|r| &r.harmonics[..]);
    let beyond = orders.and_then(|orders| Harmonics::new(orders).ok());
    // The harmonics that the error estimate adds are included.
    let coefficients = beyond.map_or(0, |harmonics| harmonics.beyond().coefficients()) as f64;
    // Kernels and fields of the contact remain allocated while a vibration is computed, and vice versa.
    let jacobians = 3.0 * ports * coefficients.powi(2);
    let response = DOUBLE * (ports * ports * RESPONSE + SETS * jacobians);
    let model = DOUBLE * ports * ports * MODEL;
    let cached = (between_stages + response).max(fullest + model);
    PROGRAM + cached
}

/// Returns the number of doubles between the stages, and at the peak within a stage.
fn doubles(inputs: &Inputs) -> [f64; 2] {
    let recipe = &inputs.recipe;
    let (Some(surface), Some(contact)) = (recipe.surface(), recipe.contact()) else {
        return [0.0; 2];
    };
    let cells = surface.grid().len() as f64;
    let padding = (contact.plane[0] * contact.plane[1]) as f64 / cells;
    let axes = match contact.shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    };
    // A real kernel on half the plane, and a kernel of the preconditioner. The buffers of the fields are padded along
    // y only.
    let kernels = |number: f64| number * (0.5 * padding + 0.5);
    let planes = |number: f64| number * (padding.sqrt() + 1.0);
    let half_space = kernels(1.0 + 3.0 * axes - 2.0) + planes(axes);
    // Number of fields of the static contact: heights, wear, pressure and gap. Each mask has one byte per cell.
    let contact_fields = 4.25;
    let between_stages = half_space + contact_fields;
    let indentation = contact_fields + NORMAL_SOLVE;
    let fullest = limits(inputs).map_or(indentation, |limits| {
        // Shear, slip path and energy.
        let cycle_result = axes + 2.0;
        let step = 4.0 * axes + IN_CONTACT * (9.0 * axes + axes * axes + 3.5);
        let cycle = limits + cycle_result + 2.0 * axes + step + cycle_fields(inputs, axes);
        let wear = recipe.wear.as_ref();
        if wear.is_none_or(|wear| wear.scheme.needs_depth_step()) {
            let plain = contact_fields + cycle.max(NORMAL_SOLVE);
            return (plain + cycle_result).max(indentation);
        }
        // State at the start of the step, rates of wear there, and wear and yielding at half the step.
        let step_start = contact_fields + cycle_result + 2.0 + 3.0 + 2.0;
        // Additional fields of a wear step with two stages: bases, compliances, rates, pressures, gaps and wear.
        let stages = cycle_result + 2.0 + 1.0 + 2.0 + 3.0 + 1.0 + NORMAL_SOLVE;
        // The coarse trajectory computes two wear steps. The first step starts from the state of the trajectory. The
        // second step starts from an earlier state of the run. In addition, the memory contains the table with both
        // states and the table of the contact.
        let coarse = match recipe.structure {
            None => 5.0 * (cycle_result + 3.0),
            Some(_) => 0.0,
        };
        step_start + stages.max(cycle) + coarse
    });
    [between_stages, half_space + fullest].map(|fields| cells * fields)
}

/// Returns the fields of the written samples, and the rows that are built from them.
fn cycle_fields(inputs: &Inputs, axes: f64) -> f64 {
    let recipe = &inputs.recipe;
    let Some((fields, cycle)) = recipe.output.cycle_fields.as_ref().zip(recipe.cycle()) else {
        return 0.0;
    };
    let load = recipe
        .contact()
        .map_or(0.0, |contact| contact.conditions.normal_load);
    let samples = fields.samples_of(cycle, load) as f64;
    // Pressure and gap twice, shear and slip. Each row of the table stores in addition the position of the cell.
    let fields_per_sample = 4.0 + 2.0 * axes;
    samples * (fields_per_sample + IN_CONTACT * fields_per_sample)
}

/// Returns the number of friction limits that a cycle stores at once; `None` without a cycle.
fn limits(inputs: &Inputs) -> Option<f64> {
    let cycle = inputs.recipe.cycle()?;
    Some(match (cycle.march, cycle.asked) {
        (Some(March::Stepped), _) if !inputs.motion.constant_load() => {
            inputs.motion.samples() as f64
        }
        (None, Some(March::Stepped)) => cycle.steps as f64,
        _ => 1.0,
    })
}
