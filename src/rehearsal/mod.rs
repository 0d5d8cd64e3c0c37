//! Cost of a run, for a user who plans the run.
//!
//! The recipe gives memory, disk per iteration and unknowns. No formula predicts the number of wear iterations and the
//! number of FFT pairs. [`rehearse`] runs the same recipe on a coarser grid and scales the counts of the coarse run:
//!
//! - The coarse grid has half the scene's cells along each side, between bounds. If the bounds permit no coarser grid,
//!   the rehearsal runs the scene itself. The counts are exact if the run of the scene reaches its end.
//! - The coarse run ends after a fixed number of operations, or after [`TIME_LIMIT`]. A plan prints the same numbers on
//!   every machine that finishes the operations within [`TIME_LIMIT`]. Wear steps lengthen as wear proceeds. The plan
//!   bounds the number of remaining steps by the remaining cycles divided by the cycles of the last step. For a run
//!   that ends at a volume, the plan uses the worn volume instead of the cycles.
//! - The time of the contact scales with the operations of the contact's transforms. All other time scales with the
//!   number of iterations.
//!
//! The rehearsal does not cover a structure from a mesh. The FFT pairs and the time of a run with a mesh are unknown
//! before the run. No number of a rehearsal enters a recipe.

mod coarser;

use std::cell::Cell;
use std::collections::BTreeMap;
use std::error::Error;
use std::sync::Arc;
use std::time::{Duration, Instant};

use serde::Serialize;

use crate::gauge::Gauge;
use crate::recipe::{Inputs, Keep, Recipe, ResourceEstimate, StructureSource, Wear};
use crate::scene::plan::unstable_explicit_step;
use crate::stages::{self, Ending, Observer, Progress, RunCost, RunOptions, Stage};
use crate::store::{Opening, RealFileSystem, RunReader, UnsyncedFileSystem};
use crate::tables::typed::Summary;

/// Ratio of the coarse grid's cells along a side to the scene's.
const GRID_RATIO: f64 = 0.5;
/// Bounds of the cells along a side. Correlation lengths and contact elements may require more than the upper
/// one.
const FEWEST_CELLS: usize = 24;
const MOST_CELLS: usize = 150;
/// Smallest number of cells per correlation length; with fewer the surface is a different one.
const CELLS_PER_LENGTH: f64 = 2.0;
/// Largest ratio of a coarser grid; above it the scene itself is run.
const LARGEST_GRID_RATIO: f64 = 0.8;
/// Exponent in the power law for the number of FFT pairs over the number of cells along a side.
/// `tests/plan/rehearsed.py` measured the exponent on random scenes with every kind of motion.
const PAIRS_EXPONENT: f64 = 1.0 / 3.0;
/// Largest ratio between actual and scaled counts of iterations and pairs, measured on the same scenes.
const COUNT_UNCERTAINTY: f64 = 2.0;
/// Largest ratio between actual and counted disk, since tables compress differently.
const DISK_UNCERTAINTY: f64 = 2.0;
/// Largest ratio between the times of equal runs.
const TIME_UNCERTAINTY: f64 = 1.3;
/// Limit of the transform operations of the coarse run, about three seconds on one core. Beyond the limit, the coarse
/// run ends at its next iteration. `OPERATIONS_PER_ITERATION` is the number of other operations per iteration.
const OPERATION_LIMIT: f64 = 3e10;
const OPERATIONS_PER_ITERATION: f64 = 1.5e8;
/// Largest number of unknowns of a structure that is rehearsed.
const MOST_UNKNOWNS: usize = 2000;

/// Time after which the coarse run starts no further stage.
pub const TIME_LIMIT: Duration = Duration::from_secs(5);

/// Expected number, and the bounds that should contain it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Range {
    /// Expected number.
    pub expected: f64,
    /// Lower bound.
    pub least: f64,
    /// Upper bound.
    pub most: f64,
}

impl Range {
    fn map(self, change: impl Fn(f64) -> f64) -> Range {
        Range {
            expected: change(self.expected),
            least: change(self.least),
            most: change(self.most),
        }
    }

    fn widened(self, factor: f64) -> Range {
        Range {
            least: self.least / factor,
            most: self.most * factor,
            ..self
        }
    }
}

/// Rounds an estimate to three digits, so that all machines print the same number. The error of the estimate is larger
/// than the rounding error.
fn digits(value: f64) -> f64 {
    format!("{value:.2e}").parse().unwrap_or(value)
}

/// Coarse run.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct CoarseRun {
    /// Cells along x and y; 0 without a rough surface.
    pub cells: [usize; 2],
    /// Wear iterations computed.
    pub iterations: u64,
    /// Whether the run reached the end of the scene.
    pub whole: bool,
}

/// Cost of a run. The numbers of the cost are the same on every machine, unless the coarse run reaches its time limit.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Cost {
    /// Numbers counted from the recipe.
    #[serde(flatten)]
    pub counted: ResourceEstimate,
    /// Run on a coarser grid; `None` if the rehearsal did not run a coarser grid.
    pub coarse_run: Option<CoarseRun>,
    /// Reason why the estimates below are missing; `None` if they exist.
    pub not_known: Option<String>,
    /// Wear iterations; 0 without wear.
    pub iterations: Option<Range>,
    /// FFT pairs of the whole run.
    pub fft_pairs: Option<Range>,
    /// Expected pairs by stage, and by part of a stage, named as in the `timing` table.
    pub fft_pairs_by_stage: BTreeMap<String, f64>,
    /// Disk of all stored iterations \[B\].
    pub disk: Option<Range>,
}

/// Cost, and the numbers that depend on the machine.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// Cost of the run.
    pub cost: Cost,
    /// Estimated time of the run with one thread on this machine \[s\]. `None` if the time is unknown.
    pub seconds: Option<Range>,
    /// Warnings about the scene from the coarse run.
    pub warnings: Vec<String>,
    /// Time of the rehearsal \[s\].
    pub seconds_taken: f64,
}

/// Estimates the cost of a run from one run on a coarser grid. The coarse run starts no further stage after
/// the time `longest`.
pub fn rehearse(inputs: &Inputs, longest: Duration) -> Rehearsal {
    let begin = Instant::now();
    let mut rehearsal = Rehearsal {
        cost: Cost {
            counted: ResourceEstimate::of(inputs),
            coarse_run: None,
            not_known: None,
            iterations: None,
            fft_pairs: None,
            fft_pairs_by_stage: BTreeMap::new(),
            disk: None,
        },
        seconds: None,
        warnings: Vec::new(),
        seconds_taken: 0.0,
    };
    if let Err(why) = estimate(inputs, longest, &mut rehearsal) {
        rehearsal.cost.not_known = Some(why);
    }
    rehearsal.seconds_taken = begin.elapsed().as_secs_f64();
    rehearsal
}

/// Completes the rehearsal with the results of the coarse run.
///
/// # Errors
/// The reason why a number is unknown.
fn estimate(inputs: &Inputs, longest: Duration, rehearsal: &mut Rehearsal) -> Result<(), String> {
    let recipe = &inputs.recipe;
    let source = recipe.structure.as_ref().map(|structure| &structure.source);
    let has_mesh = |source: &StructureSource| {
        source.resonator().is_some() || source.import().is_some_and(|import| import.has_outline)
    };
    if source.is_some_and(has_mesh) {
        return Err(
            "the structure comes from a mesh, which is not reduced in a rehearsal".to_owned(),
        );
    }
    let rows = inputs.imported.as_ref().map_or(0, |imported| imported.rows);
    let unknowns = rehearsal.cost.counted.unknowns.max(rows);
    if unknowns > MOST_UNKNOWNS {
        return Err(format!(
            "the structure has {unknowns} unknowns, and a rehearsal solves at most {MOST_UNKNOWNS}"
        ));
    }
    let ratio = coarser::grid_ratio(recipe);
    let mut coarse = match ratio < 1.0 {
        true => {
            coarser::on_grid(inputs, ratio).ok_or("the surface cannot be put on a coarser grid")?
        }
        false => inputs.clone(),
    };
    coarse.recipe.output.keep = Keep::All;
    let cells = coarse.recipe.surface().map_or([0; 2], |s| s.grid);
    let run = run(&coarse, longest).map_err(|error| match cells {
        [0, 0] => format!("the rehearsal failed: {error}"),
        [x, y] => format!("the rehearsal on {x} x {y} cells failed: {error}"),
    })?;
    let run = run.ok_or_else(|| {
        let seconds = longest.as_secs_f64();
        format!("the first iteration of the rehearsal takes more than {seconds:.0} s")
    })?;
    rehearsal.cost.coarse_run = Some(CoarseRun {
        cells,
        iterations: run.cost.wear_iterations,
        whole: run.is_whole,
    });
    let number = |value: Option<f64>| value.unwrap_or(0.0);
    let peak = number(run.unworn.max_pressure);
    let mean = (number(run.worn.normal_load) / number(run.worn.contact_area)).min(peak);
    let remark = recipe
        .contact()
        .and_then(|contact| contact.peak_pressure_note(peak));
    let step = unstable_explicit_step(recipe, peak, mean);
    rehearsal.warnings.extend(step.into_iter().chain(remark));

    let steps = run.steps(recipe.wear.as_ref());
    let steps = steps.ok_or("the rehearsal ended before its first wear step")?;
    let factor = if ratio < 1.0 { COUNT_UNCERTAINTY } else { 1.0 };
    let total = run.cost.total_pairs();
    // Passes through the stages. The unworn state is one pass.
    let passes = |steps: f64| (1.0 + steps) / (1.0 + run.cost.wear_iterations as f64);
    let growth = ratio.powf(-PAIRS_EXPONENT);
    let pairs = steps
        .map(|steps| growth * total * passes(steps))
        .widened(factor);
    let steps = steps.widened(factor);
    let iterations = Range {
        expected: steps.expected.round(),
        least: steps.least.floor().max(steps.expected.min(1.0)),
        most: steps.most.ceil(),
    };
    let share = pairs.expected / total.max(1.0);
    let by_stage = run.cost.fft_pairs.iter();
    let by_stage = by_stage.map(|(stage, pairs)| (stage.clone(), digits(share * pairs)));
    // The vibration has the same unknowns on every grid. The contact takes the time of its transforms.
    let dynamics = [
        Stage::Structure,
        Stage::DynamicResponse,
        Stage::ForcedResponse,
    ];
    let is_dynamics = |stage: &str| dynamics.iter().any(|own| stage.starts_with(own.name()));
    let stages = run.cost.seconds.iter();
    let vibration = stages
        .filter(|(stage, _)| is_dynamics(stage))
        .map(|(_, s)| s);
    let vibration: f64 = vibration.sum();
    let per_pair = operations_of_pair(recipe) / operations_of_pair(&coarse.recipe);
    let contact = (run.cost.total_seconds() - vibration) * per_pair;
    // Between the stages, tables are written and hashed.
    let others = (run.seconds - run.cost.total_seconds()).max(0.0);
    let seconds = |steps: f64, pairs: f64| {
        let contact = contact * if total > 0.0 { pairs / total } else { 1.0 };
        (vibration + others) * passes(steps) + contact
    };
    let seconds = Range {
        expected: seconds(iterations.expected, pairs.expected),
        least: seconds(iterations.least, pairs.least),
        most: seconds(iterations.most, pairs.most),
    };
    rehearsal.seconds = Some(seconds.widened(TIME_UNCERTAINTY));
    let per_iteration = rehearsal.cost.counted.disk_per_iteration as f64;
    let disk = iterations.map(|steps| recipe.output.keep.count(1.0 + steps) * per_iteration);
    rehearsal.cost.disk = Some(disk.widened(DISK_UNCERTAINTY).map(digits));
    rehearsal.cost.iterations = Some(iterations);
    rehearsal.cost.fft_pairs = Some(if ratio < 1.0 {
        pairs.map(digits)
    } else {
        pairs
    });
    rehearsal.cost.fft_pairs_by_stage = by_stage.collect();
    Ok(())
}

/// Results of the coarse run.
struct CoarseResult {
    cost: RunCost,
    /// Time of the run \[s\].
    seconds: f64,
    is_whole: bool,
    unworn: Summary,
    worn: Summary,
    /// Cycles and worn volume \[m³\] after the iteration before the last.
    before: [f64; 2],
}

impl CoarseResult {
    /// Returns the wear iterations of the whole run; `None` if an interrupted run made no step.
    fn steps(&self, wear: Option<&Wear>) -> Option<Range> {
        let done = self.cost.wear_iterations as f64;
        let range = |least: f64, most: f64| Range {
            expected: (least * most).sqrt(),
            least,
            most,
        };
        let Some(wear) = wear.filter(|_| !self.is_whole) else {
            return Some(range(done, done));
        };
        let rest = |end: f64, last: f64, before: f64| (end - last) / (last - before);
        let [cycles, volume] = self.before;
        let worn = [
            self.worn.cycles.unwrap_or(0) as f64,
            self.worn.wear_volume.unwrap_or(0.0),
        ];
        let by_cycles = wear.cycles.map(|end| rest(end as f64, worn[0], cycles));
        let by_volume = wear.volume.map(|end| rest(end, worn[1], volume));
        let rest = [by_cycles, by_volume]
            .into_iter()
            .flatten()
            .reduce(f64::min)?;
        (done > 0.0 && rest.is_finite()).then(|| range(done, done + rest.max(0.0)))
    }
}

/// Returns the number of operations of one FFT pair on the plane of the `recipe`. A pair is a forward and an inverse
/// transform of real numbers.
fn operations_of_pair(recipe: &Recipe) -> f64 {
    let points = recipe.contact().map_or(2.0, |contact| {
        contact.plane.iter().map(|n| *n as f64).product()
    });
    5.0 * points * points.max(2.0).log2()
}

/// Observer that ends a run after a number of operations.
struct Budget {
    gauge: Gauge,
    pairs: Cell<u64>,
    until: Instant,
}

impl Observer for Budget {
    fn opened(&self, _opening: &Opening) {}

    fn notice(&self, _text: &str) {}

    fn stage(&self, _stage: Stage, _wear_iteration: u64) {}

    fn ends_before(&self, _stage: Stage) -> bool {
        self.pairs.set(self.pairs.get() + self.gauge.pairs());
        Instant::now() >= self.until
    }

    fn gauge(&self) -> Gauge {
        self.gauge.clone()
    }

    fn committed(&self, _progress: &Progress) {}
}

/// Runs inputs in a temporary folder. Returns `None` if the run commits no iteration in its time.
fn run(inputs: &Inputs, longest: Duration) -> Result<Option<CoarseResult>, Box<dyn Error>> {
    let folder = tempfile::tempdir()?;
    let root = folder.path().join("run");
    let budget = Budget {
        gauge: Gauge::default(),
        pairs: Cell::default(),
        until: Instant::now() + longest,
    };
    let pair = operations_of_pair(&inputs.recipe);
    let options = RunOptions {
        inputs,
        root: root.clone(),
        source: None,
        until: None,
        threads: 1,
        cache: None,
        file_system: Arc::new(UnsyncedFileSystem(Arc::new(RealFileSystem))),
        stop: &|commits| {
            let spent =
                pair * budget.pairs.get() as f64 + OPERATIONS_PER_ITERATION * commits as f64;
            spent >= OPERATION_LIMIT
        },
    };
    let begin = Instant::now();
    let is_whole = stages::run(&options, &budget)?.ending == Ending::Done;
    let seconds = begin.elapsed().as_secs_f64();
    let reader = RunReader::open(Arc::new(RealFileSystem), &root)?;
    let Some(last) = reader.latest() else {
        return Ok(None);
    };
    let before: Summary = reader.typed(last.saturating_sub(1))?;
    Ok(Some(CoarseResult {
        cost: RunCost::of(&reader)?,
        seconds,
        is_whole,
        unworn: reader.typed(0)?,
        worn: reader.typed(last)?,
        before: [
            before.cycles.unwrap_or(0) as f64,
            before.wear_volume.unwrap_or(0.0),
        ],
    }))
}
