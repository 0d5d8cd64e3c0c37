//! Unknowns, disk space and peak memory of a run, counted from its recipe.
//!
//! Memory is counted field by field from the allocations of [`crate::contact::HalfSpace`], the solvers, the cycle, the wear step and the
//! matrices of a structure. A test compares the sum with the memory that the operating system reports.

use serde::Serialize;

use super::{Inputs, Recipe};
use crate::contact::Shear;
use crate::dynamics::Harmonics;
use crate::wear::cycle::March;

/// A number \[B\].
const DOUBLE: f64 = 8.0;
/// The program before it computes: its code and tables, as measured of a run without contact \[B\].
const PROGRAM: f64 = 27.0 * 1024.0 * 1024.0;
/// Matrices of the contact's degrees of freedom at the fullest moment of a harmonic balance beside the Jacobians of its elements;
/// those of the structure and its closed model, which stay; and sets of the Jacobians at once.
const RESPONSE: f64 = 8.0;
const MODEL: f64 = 3.0;
const SETS: f64 = 3.5;
/// Tables of an iteration that have one row, or one per sample of the cycle \[B\].
const TABLES: f64 = 40e3;
/// Fields of one normal solve: the solver's own with its lists of cells, the worn heights, and the gap that it leaves.
const NORMAL_SOLVE: f64 = 12.0;
/// Part of the cells in contact, by which the arrays of a tangential solve count: more than a rough joint has.
const IN_CONTACT: f64 = 0.3;

/// The needs of a run that follow from its recipe.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Counted {
    /// Contact elements of the structure.
    pub contact_elements: usize,
    /// Unknowns of the harmonic balance if every contact element were active.
    pub unknowns: usize,
    /// Cells of the joint; 0 without a rough surface.
    pub cells: usize,
    /// Points of the plane on which fields are transformed.
    pub plane: [usize; 2],
    /// Peak of memory of the whole program \[B\].
    pub memory: u64,
    /// Peak of memory of a run whose structure is in the cache \[B\]; none if nothing is to be reduced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_cached: Option<u64>,
    /// Disk of an iteration that is kept \[B\]. How well its tables compress is known within a factor of two.
    pub disk_per_iteration: u64,
}

impl Counted {
    /// Counts what the inputs of a run need.
    pub fn of(inputs: &Inputs) -> Counted {
        let recipe = &inputs.recipe;
        let elements = contact_elements(recipe);
        let orders = recipe.response.as_ref().map_or(0, |r| r.harmonics.len());
        let least = Counted::least_memory(inputs);
        // The reduction is over, and its memory is freed, before a run allocates anything else.
        let reduction = reduction(inputs).map(|bytes| (PROGRAM + bytes) as u64);
        let mut counted = Counted {
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

    /// Least memory of a run: with the structure in the cache \[B\]. It does not count the reduction, which takes memory itself.
    pub fn least_memory(inputs: &Inputs) -> u64 {
        peak(inputs) as u64
    }
}

fn contact_elements(recipe: &Recipe) -> usize {
    recipe.elements().map_or(0, |elements| elements.count)
}

/// Bytes to reduce the structure; none if it is not to be reduced.
fn reduction(inputs: &Inputs) -> Option<f64> {
    let structure = inputs.recipe.structure.as_ref()?;
    structure.memory_to_reduce(inputs.imported.as_deref())
}

/// Bytes of the tables of one iteration, as they compress on a rough joint.
fn disk_per_iteration(inputs: &Inputs, counted: &Counted) -> f64 {
    let recipe = &inputs.recipe;
    let axes = recipe.contact().map_or(0.0, |contact| match contact.shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    });
    // A cell has a gap or a pressure; in contact its shear, path and energy over a cycle, and its wear.
    let cycle = recipe.cycle().map_or(0.0, |_| axes + 2.0);
    let wear = recipe.wear.as_ref().map_or(0.0, |_| 1.0);
    let contact = 1.0 + IN_CONTACT * (cycle + wear);
    // A run of a prescribed motion that wears has the same of its coarse trajectory.
    let times = match recipe.structure.is_none() && recipe.wear.is_some() {
        true => 2.0,
        false => 1.0,
    };
    let fields = counted.cells as f64 * (times * contact + cycle_fields(inputs, axes));
    DOUBLE * (fields + counted.unknowns as f64) + TABLES
}

/// Peak memory \[B\] of a run whose structure is already reduced.
fn peak(inputs: &Inputs) -> f64 {
    let [held, fullest] = doubles(inputs).map(|doubles| DOUBLE * doubles);
    let ports = 3.0 * contact_elements(&inputs.recipe) as f64;
    let orders = inputs.recipe.response.as_ref().map(|r| &r.harmonics[..]);
    let beyond = orders.and_then(|orders| Harmonics::new(orders).ok());
    // Those tried for the error of what is left out are among them.
    let coefficients = beyond.map_or(0, |own| own.beyond().coefficients()) as f64;
    // A vibration is computed while the contact's kernels and fields are kept, and the other way round.
    let jacobians = 3.0 * ports * coefficients.powi(2);
    let response = DOUBLE * (ports * ports * RESPONSE + SETS * jacobians);
    let model = DOUBLE * ports * ports * MODEL;
    let cached = (held + response).max(fullest + model);
    PROGRAM + cached
}

/// Numbers between the stages, and at the fullest moment of one.
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
    // A real kernel on half the plane and one of the preconditioner's; what fields pass through is padded along y alone.
    let kernels = |number: f64| number * (0.5 * padding + 0.5);
    let planes = |number: f64| number * (padding.sqrt() + 1.0);
    let half_space = kernels(1.0 + 3.0 * axes - 2.0) + planes(axes);
    // Heights, wear, pressure and gap of the static contact, and a byte each for the masks.
    let held = 4.25;
    let kept = half_space + held;
    let indentation = held + NORMAL_SOLVE;
    let fullest = limits(inputs).map_or(indentation, |limits| {
        // Shear, path, energy.
        let cycle_result = axes + 2.0;
        let step = 4.0 * axes + IN_CONTACT * (9.0 * axes + axes * axes + 3.5);
        let cycle = limits + cycle_result + 2.0 * axes + step + cycle_fields(inputs, axes);
        let wear = recipe.wear.as_ref();
        if wear.is_none_or(|wear| wear.scheme.needs_depth_step()) {
            let plain = held + cycle.max(NORMAL_SOLVE);
            return (plain + cycle_result).max(indentation);
        }
        // The state that the step begins from, the rates of wear there, and what is worn and yields at half of it.
        let begun = held + cycle_result + 2.0 + 3.0 + 2.0;
        // What its two stages add to that: bases, compliances, rates, pressures, gaps and wear.
        let stages = cycle_result + 2.0 + 1.0 + 2.0 + 3.0 + 1.0 + NORMAL_SOLVE;
        // The coarse trajectory makes such a step from a state of its own and from an earlier one of the run, beside the table that holds both and
        // that of the contact.
        let coarse = match recipe.structure {
            None => 5.0 * (cycle_result + 3.0),
            Some(_) => 0.0,
        };
        begun + stages.max(cycle) + coarse
    });
    [kept, half_space + fullest].map(|fields| cells * fields)
}

/// Fields of the samples that are written, and the rows that are made of them.
fn cycle_fields(inputs: &Inputs, axes: f64) -> f64 {
    let recipe = &inputs.recipe;
    let Some((fields, cycle)) = recipe.output.cycle_fields.as_ref().zip(recipe.cycle()) else {
        return 0.0;
    };
    let load = recipe
        .contact()
        .map_or(0.0, |contact| contact.conditions.normal_load);
    let samples = fields.samples_of(cycle, load) as f64;
    // Pressure and gap twice, shear and slip; of a row also where it is.
    let held = 4.0 + 2.0 * axes;
    samples * (held + IN_CONTACT * held)
}

/// Friction limits that a cycle holds at once; none without one.
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
