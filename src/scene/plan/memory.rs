//! The peak of memory of a run: what is allocated at its fullest moments, field by field.
//!
//! Every count here is one of the code that allocates: the transforms of [`crate::contact::HalfSpace`], the fields of the solvers,
//! of a cycle and of a wear step. A test holds the sum to what the operating system measures of a run.

use crate::contact::Shear;
use crate::scene::Structure;

/// A number \[B\].
const DOUBLE: f64 = 8.0;
/// The program before it computes: its code and tables, as measured of a run without contact \[B\].
const PROGRAM: f64 = 22.5 * 1024.0 * 1024.0;
/// The reduction of a resonator, fitted to runs of 930 to 17 740 elements and 60 to 604 of the contact: bytes by the power of
/// its elements by which a factor of nested dissection grows, by the square of its contact's degrees of freedom, and at least.
const FACTOR: f64 = 850.0;
const FILL: f64 = 4.0 / 3.0;
const AT_PORTS: f64 = 115.0;
const REDUCTION: f64 = 15e6;
/// Squares of the contact's degrees of freedom at the fullest moment of a harmonic balance beside the Jacobians of its elements,
/// the more the more slide; those of the structure and its closed model, which stay; and sets of the Jacobians at once.
const RESPONSE: f64 = 8.0;
const MODEL: f64 = 3.0;
const SETS: f64 = 3.5;
/// Fields of one normal solve: the solver's own with its lists of cells, the worn heights, and the gap that it leaves.
const NORMAL_SOLVE: f64 = 12.0;
/// Part of the cells in contact, by which the arrays of a tangential solve count.
const IN_CONTACT: f64 = 0.3;

/// What the memory of a run depends on.
pub(super) struct Sizes<'a> {
    /// Cells of the grid; 0 without a rough contact.
    pub cells: f64,
    /// Points of the transformed plane over cells of the grid: 4 if padded, 1 if not.
    pub padding: f64,
    pub shear: Shear,
    /// Friction limits that a stepped cycle holds at once; none without a cycle.
    pub limits: Option<usize>,
    /// Whether an implicit wear step is made.
    pub implicit: bool,
    pub structure: Option<&'a Structure>,
    pub contact_elements: usize,
    /// Harmonic coefficients of a displacement, those tried for the error of what is left out among them.
    pub coefficients: usize,
}

/// Bytes at the fullest moment, of a run that reduces its structure and of one that finds it reduced; the latter where there is
/// something to reduce.
pub(super) fn peak(sizes: &Sizes) -> (u64, Option<u64>) {
    let [held, fullest] = doubles_a_cell(sizes).map(|doubles| DOUBLE * sizes.cells * doubles);
    let ports = 3.0 * sizes.contact_elements as f64;
    let reduction = reduction(sizes.structure, ports);
    // A vibration is computed while the contact's kernels and fields are kept, and the other way round.
    // The Jacobians of the elements with the most harmonics that are tried.
    let jacobians = 3.0 * ports * (sizes.coefficients as f64).powi(2);
    let response = DOUBLE * (ports * ports * RESPONSE + SETS * jacobians);
    let model = DOUBLE * ports * ports * MODEL;
    let cached = (held + response).max(fullest + model);
    // The reduction is over, and its memory given back, before anything else is there.
    let bytes = |more: f64| (PROGRAM + more) as u64;
    (
        bytes(cached.max(reduction)),
        (reduction > 0.0).then(|| bytes(cached)),
    )
}

fn reduction(structure: Option<&Structure>, ports: f64) -> f64 {
    match structure {
        Some(Structure::Resonator { geometry }) => {
            let cells = geometry.mesh().map_or(0, |mesh| mesh.mesh.elements.len());
            FACTOR * (cells as f64).powf(FILL) + AT_PORTS * ports * ports + REDUCTION
        }
        _ => 0.0,
    }
}

/// Between the stages, and at the fullest moment of one.
fn doubles_a_cell(sizes: &Sizes) -> [f64; 2] {
    let axes = match sizes.shear {
        Shear::AlongX => 1.0,
        Shear::InPlane => 2.0,
    };
    // A real kernel on half the plane and one of the preconditioner's; what fields pass through is padded along y alone.
    let kernels = |number: f64| number * (0.5 * sizes.padding + 0.5);
    let planes = |number: f64| number * (sizes.padding.sqrt() + 1.0);
    let half_space = kernels(1.0 + 3.0 * axes - 2.0) + planes(axes);
    // Heights, wear, pressure and gap of the static contact, and a byte each for the masks.
    let held = 4.25;
    let kept = half_space + held;
    let indentation = held + NORMAL_SOLVE;
    let Some(limits) = sizes.limits else {
        return [kept, half_space + indentation];
    };
    // Shear, path, energy.
    let cycle_result = axes + 2.0;
    let step = 4.0 * axes + IN_CONTACT * (9.0 * axes + axes * axes + 3.5);
    let cycle = limits as f64 + cycle_result + 2.0 * axes + step;
    let plain = held + cycle.max(NORMAL_SOLVE);
    if !sizes.implicit {
        return [kept, half_space + (plain + cycle_result).max(indentation)];
    }
    // The state that the step begins from, the rates of wear there, and what is worn and yields at half of it.
    let begun = held + cycle_result + 2.0 + 3.0 + 2.0;
    // What its two stages add to that: bases, compliances, rates, pressures, gaps and wear.
    let stages = cycle_result + 2.0 + 1.0 + 2.0 + 3.0 + 1.0 + NORMAL_SOLVE;
    [kept, half_space + begun + stages.max(cycle)]
}
