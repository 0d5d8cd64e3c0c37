//! What is said of the cost of a run.

use std::collections::BTreeMap;

use serde::Serialize;

use super::estimate::{digits, doubt};
use super::{Found, Range, memory};
use crate::recipe::{Inputs, Keep, Recipe};
use crate::structure::Work;
use crate::wear::cycle::March;

/// Operations to reduce a structure, and to solve its vibration, up to which they are rehearsed.
const REDUCTION: f64 = 1.5e10;
const VIBRATION: f64 = 1e11;
/// Dense solves of all unknowns that a vibration takes at least: some steps each of a search, of its peak and of a forced response.
const SOLVES: f64 = 20.0;
/// By which factor iterations may be off where the motion was not rehearsed: measured, up to 2.7.
const MOTION: f64 = 3.0;
/// Pairs of a sample of a stepped cycle over those of a whole cycle between two reversals: measured, up to 2.
const STEPPED_SAMPLE: f64 = 3.0;

/// What a run will cost, but for time. Numbers are rounded to three digits, more than there are right.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Contact elements of the structure.
    pub contact_elements: usize,
    /// Unknowns of the harmonic balance if every contact element were active.
    pub unknowns: usize,
    /// Cells of the joint; 0 without a rough surface.
    pub cells: usize,
    /// Points of the plane that fields are transformed on.
    pub plane: [usize; 2],
    /// Peak of memory of the whole program, counted \[B\]: what is allocated at its fullest moment.
    pub memory: u64,
    /// Peak of memory of a run that finds its structure reduced already, counted \[B\]; none where nothing is to be reduced.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub memory_cached: Option<u64>,
    /// Operations to reduce the structure, counted; 0 where nothing is to be reduced.
    pub structure_operations: f64,
    /// The grids that were rehearsed, the finest last.
    pub rehearsed: Vec<Grid>,
    /// What was not rehearsed, and why.
    pub not_rehearsed: Vec<String>,
    /// Wear iterations; 0 without wear, none if nothing can be said of them.
    pub iterations: Option<Range>,
    /// Transform pairs of the whole run.
    pub fft_pairs: Option<Range>,
    /// The expected pairs by stage, and by part of a stage that is told apart, as the `timing` table names them.
    pub fft_pairs_by_stage: BTreeMap<String, f64>,
    /// Disk of all iterations that are kept \[B\].
    pub disk: Option<Range>,
    /// Times that the structure is made to vibrate anew, forced responses not counted; none without a structure, or if it was not
    /// rehearsed.
    pub vibrations: Option<f64>,
}

/// A grid that was rehearsed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Grid {
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Wear iterations that were rehearsed on it.
    pub iterations: usize,
    /// Whether they are all.
    pub whole: bool,
    /// Operations that were spent on it.
    pub operations: f64,
}

/// What is counted of a recipe before anything is rehearsed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counted {
    pub contact_elements: usize,
    unknowns: usize,
    pub reduction: Option<Work>,
}

impl Counted {
    pub fn of(recipe: &Recipe) -> Counted {
        let contact_elements = recipe.elements().map_or(0, |elements| elements.count);
        let orders = recipe.response.as_ref().map_or(0, |r| r.harmonics.len());
        let structure = recipe.structure.as_ref();
        let reduction = structure.and_then(|structure| {
            let resonator = structure.source.resonator()?;
            resonator.work(structure.modes).ok()
        });
        Counted {
            contact_elements,
            unknowns: 3 * contact_elements * (2 * orders).saturating_sub(1),
            reduction,
        }
    }

    /// Why the structure is not to be reduced in a rehearsal.
    pub fn too_large(&self) -> Option<String> {
        let operations = self.reduction?.operations;
        (operations > REDUCTION).then(|| {
            format!("the structure is not in the cache, and its reduction takes {operations:.1e} operations")
        })
    }

    /// Why its vibration is not to be rehearsed.
    pub fn too_many(&self) -> Option<String> {
        let operations = SOLVES * 2.0 / 3.0 * (self.unknowns as f64).powi(3);
        (operations > VIBRATION).then(|| {
            format!(
                "the vibration of {} contact elements has {} unknowns, and takes longer than a rehearsal",
                self.contact_elements, self.unknowns
            )
        })
    }
}

pub(super) fn counted_cost(inputs: &Inputs, counted: &Counted) -> Cost {
    let recipe = &inputs.recipe;
    let (memory, memory_cached) = memory::peak(inputs, counted);
    Cost {
        contact_elements: counted.contact_elements,
        unknowns: counted.unknowns,
        cells: recipe.surface().map_or(0, |surface| surface.kept),
        plane: recipe.contact().map_or([0; 2], |contact| contact.plane),
        memory,
        memory_cached,
        structure_operations: digits(counted.reduction.map_or(0.0, |work| work.operations)),
        rehearsed: Vec::new(),
        not_rehearsed: Vec::new(),
        iterations: None,
        fft_pairs: None,
        fft_pairs_by_stage: BTreeMap::new(),
        disk: None,
        vibrations: None,
    }
}

/// What is to be known of a contact that was rehearsed without its vibration: its motion may be no line.
pub(super) fn straight(recipe: &Recipe) -> Option<String> {
    let cycle = recipe.cycle()?;
    let may_be_stepped = cycle.asked.is_none_or(|march| march == March::Stepped);
    let times = STEPPED_SAMPLE * cycle.steps as f64;
    may_be_stepped.then(|| {
        format!(
            "the motion that the vibration gives the joint: a straight one was rehearsed; a cycle that has to be stepped takes up to {times:.0} times as many pairs"
        )
    })
}

/// Writes what was found into a cost. `alone`: without the vibration.
pub(super) fn told(cost: &mut Cost, recipe: &Recipe, found: &Found, alone: bool) {
    let Found { totals, finest, .. } = found;
    let steps = totals.steps;
    let motion = if alone { MOTION } else { 1.0 };
    let factor = doubt(steps.expected, finest.steps.expected).powi(found.doubts) * motion;
    let iterations = Range {
        expected: steps.expected.round(),
        least: (steps.least / factor).floor().max(steps.expected.min(1.0)),
        most: (steps.most * factor).ceil(),
    };
    let exact = found.doubts == 0 && !alone;
    let iterations = if exact { steps } else { iterations };
    let factor = doubt(totals.pairs(1.0), finest.pairs(1.0)).powi(found.doubts);
    let fft_pairs = Range {
        expected: totals.pairs(steps.expected),
        least: totals.pairs(iterations.least) / factor,
        most: totals.pairs(iterations.most) * factor,
    };
    let bytes = if exact {
        found.bytes.map(|_| found.bytes.expected)
    } else {
        found.bytes
    };
    let disk = Range {
        expected: bytes.expected * kept(recipe, steps.expected),
        least: bytes.least * kept(recipe, iterations.least),
        most: bytes.most * kept(recipe, iterations.most),
    };
    // Each stage with its part of what was rehearsed.
    let rehearsed = &found.course.iterations;
    for (stage, pairs) in rehearsed.iter().flat_map(|iteration| &iteration.pairs) {
        *cost.fft_pairs_by_stage.entry(stage.clone()).or_default() += pairs;
    }
    let sum: f64 = cost.fft_pairs_by_stage.values().sum();
    for pairs in cost.fft_pairs_by_stage.values_mut() {
        *pairs = digits(*pairs * fft_pairs.expected / sum.max(1.0));
    }
    cost.iterations = Some(iterations);
    cost.fft_pairs = Some(fft_pairs.map(digits));
    cost.disk = Some(disk.map(digits));
    let responses = rehearsed.iter().filter(|i| i.is_response_new);
    cost.vibrations = Some(responses.count() as f64).filter(|count| *count > 0.0);
}

/// Iterations that are kept of a run with so many wear iterations.
fn kept(recipe: &Recipe, steps: f64) -> f64 {
    let states = 1.0 + steps;
    match recipe.output.keep {
        Keep::All => states,
        Keep::Some { every, last, .. } => {
            // The unworn state always.
            let regular = every.map_or(1.0, |every| (states / every as f64).ceil());
            (regular + last as f64).min(states)
        }
    }
}
