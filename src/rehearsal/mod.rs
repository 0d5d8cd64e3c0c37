//! What a run will cost, rehearsed where somebody asks for it.
//!
//! How many wear iterations a run takes, and how many transforms each of its solves, no theory says well: both hang on the contact
//! that is found and on the accuracy that is asked for. They change little with the grid, though, so that runs of the same recipe on
//! coarser grids say them. [`rehearse`] makes two such runs, in memory, and extrapolates:
//!
//! 1. **Grids.** The coarser one has two cells a correlation length (four a contact radius of a sphere), at least 24 cells a side
//!    and one a contact element; the finer one is as fine as the time allows, up to two thirds of the scene's cells a side. A seed
//!    is the same surface on every grid, and measured heights are averaged over larger cells, so that both see the very surface of
//!    the scene. Tolerances, motion, structure and elements are those of the scene. Where there is no room for a coarser grid the
//!    scene itself is rehearsed, as far as the time allows.
//! 2. **Time.** A rehearsal spends a counted number of operations, so that it comes to the same each time and anywhere. On one idle
//!    core of today they take some three seconds; a rehearsal that would take longer than it may is refused, with the reason. A course of
//!    wear that is not rehearsed to its end goes on as one does that is marched with few samples of the cycle or on the coarser grid,
//!    else as its last steps did.
//! 3. **Numbers.** Iterations, and transform pairs of each stage in the unworn iteration and in the mean of the others, go on in the
//!    logarithm of the cells a side. The range beside an expected number holds chance, and as much again as was extrapolated.
//! 4. **Seconds** are pairs by the time of a pair on the scene's own plane, measured, times what the rehearsal took for a pair of its own
//!    plane within a solve. What has no transforms takes as long as in the rehearsal, as structure and elements are those of the
//!    scene. No number but seconds depends on the machine.
//! 5. **Counted** are memory, from what is allocated; the size of the factor and the operations to reduce a structure, from its mesh; and the
//!    unknowns of a vibration.
//!
//! A structure that is too large to be reduced in the time, and is not in the cache, or a vibration of too many unknowns, is not
//! rehearsed: the cost says so, and its contact is rehearsed alone, under a straight motion as long as its stiffness bears up to
//! sliding.
//!
//! Nothing that is rehearsed enters a recipe, and a run rehearses nothing.

mod alone;
mod coarser;
mod cost;
mod estimate;
mod files;
mod memory;
mod rehearsed_run;
mod seconds;
mod stability;

use std::path::PathBuf;
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use crate::recipe::{Inputs, Recipe};

use cost::{Counted, counted_cost, told};
use estimate::Totals;
use rehearsed_run::{Bounds, RehearsedRun, course};

pub use cost::{Cost, Grid};
pub use estimate::Range;
pub use seconds::Seconds;

/// Operations of transforms that a rehearsal may spend: some three seconds of one core.
const OPERATIONS: f64 = 3e10;
/// Operations that an iteration takes beside its pairs, in the time of transforms: some ten milliseconds of tables and small loops.
const ITERATION: f64 = 1.5e8;
/// Pairs that an unworn contact takes at least, with its stiffness.
const LEAST_PAIRS: f64 = 50.0;
/// Parts of all operations for the coarser grid: of a course that can be marched with few samples too, of one that cannot, and for
/// that with few samples.
const COARSER: [f64; 2] = [0.4, 0.6];
const FEW_SAMPLES: f64 = 0.3;
/// The finer grid has at most so many of the scene's cells a side: a rehearsal is to cost less than the run.
const FINEST: f64 = 0.67;
/// And at least so many times those of the coarser one: less says nothing of how numbers change.
const APART: f64 = 1.2;
/// From this part of the scene's cells a side on the coarsest grid is the scene's own.
const NO_ROOM: f64 = 0.8;
/// Power of the cells a side by which the operations of a run grow: those of a transform, with a logarithm.
const GROWTH: f64 = 2.3;
/// By which factor the bytes of a table may be more or fewer than its rows say: they compress otherwise.
const TABLES: f64 = 1.2;
/// Part of the time that a rehearsal may take after which nothing is begun.
const WITHIN: f64 = 0.85;

/// What is said of a cycle that is too long for a rehearsal.
const TOO_MANY_SAMPLES: &str =
    "a cycle takes longer than a rehearsal, and was rehearsed with few of its samples";

/// What a rehearsal may use.
#[derive(Debug, Clone)]
pub struct Options {
    /// Where reduced structures are shared between runs; none: nowhere.
    pub cache: Option<PathBuf>,
    /// Time after which a rehearsal ends, whatever it has found.
    pub most: Duration,
}

impl Default for Options {
    /// No cache, five seconds.
    fn default() -> Options {
        Options {
            cache: None,
            most: Duration::from_secs(5),
        }
    }
}

/// What came of a rehearsal.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    /// What the run will cost, but for time.
    pub cost: Cost,
    /// Time that it will take on this machine, one thread; none if nothing can be said of it.
    pub seconds: Option<Seconds>,
    /// What the user should change before it runs.
    pub warnings: Vec<String>,
    /// Time that the rehearsal took \[s\].
    pub took: f64,
}

/// Memory of the whole program at its fullest moment, counted, and of a run that finds its structure reduced already, where there is
/// something to reduce \[B\].
pub fn memory(inputs: &Inputs) -> (u64, Option<u64>) {
    memory::peak(inputs, &Counted::of(&inputs.recipe))
}

/// Rehearses a run. It is over after `options.most`, though what is under way then, which cannot be interrupted, ends by itself at the
/// next stage.
pub fn rehearse(inputs: &Inputs, options: &Options) -> Rehearsal {
    let begin = Instant::now();
    let (sender, receiver) = mpsc::channel();
    let (own, own_options) = (inputs.clone(), options.clone());
    // Nobody listens any more to one that is late.
    thread::spawn(move || drop(sender.send(rehearsed(&own, &own_options))));
    receiver.recv_timeout(options.most).unwrap_or_else(|_| {
        let mut cost = counted_cost(inputs, &Counted::of(&inputs.recipe));
        cost.not_rehearsed.push(format!(
            "a single stage on the coarsest grid takes longer than {:.0} s, the time of a rehearsal",
            options.most.as_secs_f64()
        ));
        Rehearsal {
            cost,
            seconds: None,
            warnings: Vec::new(),
            took: begin.elapsed().as_secs_f64(),
        }
    })
}

fn rehearsed(inputs: &Inputs, options: &Options) -> Rehearsal {
    let begin = Instant::now();
    let counted = Counted::of(&inputs.recipe);
    let mut rehearsing = Rehearsing {
        options,
        // What is under way then still comes to the end of its stage.
        until: begin + options.most.mul_f64(WITHIN),
        half: begin + options.most.mul_f64(0.5 * WITHIN),
        no_reduction: counted.too_large(),
        left: OPERATIONS,
        rehearsed: Vec::new(),
        not_rehearsed: Vec::new(),
    };
    let mut alone = None;
    let mut found = match counted.too_many() {
        Some(why) => {
            rehearsing.not_rehearsed.push(why);
            None
        }
        None => rehearsing.grids(inputs),
    };
    if found.is_none() && counted.contact_elements > 0 && inputs.recipe.surface().is_some() {
        alone = rehearsing.contact_alone(inputs);
        found = alone.as_ref().and_then(|alone| rehearsing.grids(alone));
    }
    let rehearsed = alone.as_ref().unwrap_or(inputs);
    let mut cost = counted_cost(inputs, &counted);
    let mut warnings = Vec::new();
    if let Some(found) = &found {
        told(&mut cost, &rehearsed.recipe, found, alone.is_some());
        let of_motion = alone.as_ref().and_then(|_| cost::straight(&inputs.recipe));
        rehearsing.not_rehearsed.extend(of_motion);
        warnings.extend(stability::warning(&inputs.recipe, &found.course));
        let contact = inputs.recipe.contact();
        let peak = found
            .course
            .iterations
            .first()
            .map(|first| first.peak_pressure);
        warnings.extend(
            contact
                .zip(peak)
                .and_then(|(c, peak)| c.remark_on_peak(peak)),
        );
    }
    cost.rehearsed = rehearsing.rehearsed;
    cost.not_rehearsed = rehearsing.not_rehearsed;
    let seconds = found.map(|found| seconds::expected(inputs, &found, &cost));
    Rehearsal {
        cost,
        seconds,
        warnings,
        took: begin.elapsed().as_secs_f64(),
    }
}

/// What two grids say of a third.
struct Found {
    /// On the grid of the scene.
    totals: Totals,
    /// On the finest grid that was rehearsed.
    finest: Totals,
    /// The longest course, with its inputs.
    inputs: Inputs,
    course: RehearsedRun,
    /// Bytes of an iteration on the grid of the scene.
    bytes: Range,
    /// By which power of a doubt numbers may be off: 0 from the scene itself, 1 from two grids, 2 from one, 3 from few samples on it.
    doubts: i32,
}

struct Rehearsing<'a> {
    options: &'a Options,
    until: Instant,
    /// When a vibration that has not been found leaves the rest of the time to the contact alone.
    half: Instant,
    no_reduction: Option<String>,
    /// Operations that are left.
    left: f64,
    rehearsed: Vec<Grid>,
    not_rehearsed: Vec<String>,
}

/// Operations of a pair on the plane of a recipe: a forward and an inverse transform of real numbers.
fn operations_of_pair(recipe: &Recipe) -> f64 {
    let points = recipe.contact().map_or(0.0, |contact| {
        contact.plane.iter().map(|n| *n as f64).product()
    });
    5.0 * points * points.max(2.0).log2()
}

fn spent(recipe: &Recipe, course: &RehearsedRun) -> f64 {
    let pair = operations_of_pair(recipe);
    let of = |iteration: &rehearsed_run::Iteration| {
        ITERATION + pair * iteration.pairs.values().sum::<f64>()
    };
    course.iterations.iter().map(of).sum()
}

impl Rehearsing<'_> {
    /// A run of inputs within so many operations; none if it did not come to an iteration, and then it is told why.
    fn run(&mut self, inputs: &Inputs, operations: f64) -> Option<RehearsedRun> {
        let recipe = &inputs.recipe;
        let bounds = Bounds {
            operations: operations.min(self.left),
            pair: operations_of_pair(recipe),
            iteration: ITERATION,
            until: match recipe.structure.is_some() && self.rehearsed.is_empty() {
                true => self.half,
                false => self.until,
            },
            no_reduction: self.no_reduction.as_deref(),
            cache: self.options.cache.as_deref(),
        };
        let cells = recipe.surface().map_or([0; 2], |surface| surface.grid);
        let why = match LEAST_PAIRS * bounds.pair > self.left {
            true => Ok(None),
            false => course(inputs, &bounds).map(Some),
        };
        let why = match why {
            Ok(Some(course)) if !course.iterations.is_empty() => {
                let operations = spent(recipe, &course);
                self.left = (self.left - operations).max(0.0);
                self.rehearsed.push(Grid {
                    cells,
                    iterations: course.iterations.len() - 1,
                    whole: course.broken_off.is_none(),
                    operations,
                });
                return Some(course);
            }
            Ok(Some(course)) => course.broken_off.unwrap_or_default(),
            Ok(None) => format!(
                "on {} x {} cells a contact takes longer than what is left of a rehearsal",
                cells[0], cells[1]
            ),
            Err(error) => format!("on {} x {} cells: {error}", cells[0], cells[1]),
        };
        if !self.not_rehearsed.contains(&why) {
            self.not_rehearsed.push(why);
        }
        None
    }

    /// The whole of it on the grid of the scene, from two grids.
    fn grids(&mut self, inputs: &Inputs) -> Option<Found> {
        let recipe = &inputs.recipe;
        let wear = recipe.wear.as_ref();
        let mut coarsest = coarser::coarsest(inputs);
        if coarsest > NO_ROOM {
            coarsest = 1.0;
        }
        let coarse = coarser::on_grid(inputs, coarser::counts(recipe, coarsest))?;
        // A cycle of many samples takes long: one of few says how long, and how wear goes on.
        let mut few = None;
        if let Some((sampled, times)) = coarser::with_few_samples(&coarse)
            && let Some(course) = self.run(&sampled, FEW_SAMPLES * OPERATIONS)
        {
            let pair = operations_of_pair(&sampled.recipe);
            let unworn = pair * course.iterations[0].pairs.values().sum::<f64>();
            if 2.0 * times * unworn > self.left {
                self.not_rehearsed.push(TOO_MANY_SAMPLES.to_owned());
                let of_few = Totals::of(&course, wear, None)?;
                let totals = of_few.with_samples(times);
                let bytes = bytes([&course; 2], [coarsest; 2]);
                return Some(Found {
                    totals,
                    finest: totals,
                    inputs: sampled,
                    course,
                    bytes,
                    doubts: 3,
                });
            }
            few = Some(course);
        }
        let part = match coarsest < 1.0 {
            true => COARSER[usize::from(few.is_none())],
            false => 1.0,
        };
        let first = self.run(&coarse, part * OPERATIONS)?;
        // Steps go on as those with few samples, pairs do not.
        let whole = match few.as_ref().filter(|_| first.broken_off.is_some()) {
            Some(few) => Some((few, false)),
            None => Some((&first, true)),
        };
        let Some(of_first) = Totals::of(&first, wear, whole) else {
            self.not_rehearsed.extend(first.broken_off.clone());
            return None;
        };
        // As fine as what is left allows.
        let all = operations_of_pair(&coarse.recipe) * of_first.pairs(of_first.steps.expected)
            + ITERATION * of_first.steps.expected;
        let finer = coarsest * (self.left / all).powf(1.0 / GROWTH);
        let finer = finer.clamp(APART * coarsest, FINEST.max(APART * coarsest));
        let mut second = None;
        if coarsest < 1.0 {
            let fine = coarser::on_grid(inputs, coarser::counts(recipe, finer))?;
            second = self.run(&fine, self.left).map(|course| (fine, course));
        }
        let two = second
            .and_then(|(fine, second)| Some((Totals::of(&second, wear, whole)?, fine, second)));
        Some(match two {
            Some((finest, fine, second)) => {
                let bytes = bytes([&first, &second], [coarsest, finer]);
                let longer = second.iterations.len() >= first.iterations.len().div_ceil(2);
                let (inputs, course) = if longer {
                    (fine, second)
                } else {
                    (coarse, first)
                };
                Found {
                    // The scene's cells over the finer grid's, in steps of that from the coarser one.
                    totals: finest
                        .extrapolated(&of_first, (1.0 / finer).ln() / (finer / coarsest).ln()),
                    finest,
                    inputs,
                    course,
                    bytes,
                    doubts: 1,
                }
            }
            None => Found {
                totals: of_first,
                finest: of_first,
                bytes: bytes([&first; 2], [coarsest; 2]),
                inputs: coarse,
                doubts: match coarsest < 1.0 || first.broken_off.is_some() {
                    true => 2,
                    false => 0,
                },
                course: first,
            },
        })
    }
}

/// Bytes of an iteration on the grid of the scene, from courses on grids with these parts of its cells a side: some of the tables have a
/// row a cell, others do not. Of one grid alone it is not known how many.
fn bytes(courses: [&RehearsedRun; 2], parts: [f64; 2]) -> Range {
    let [unworn, finer] = courses.map(|course| course.iterations[0].bytes);
    let all = courses[0]
        .iterations
        .iter()
        .map(|iteration| iteration.bytes);
    let mean = all.sum::<f64>() / courses[0].iterations.len() as f64;
    let cells = -2.0 * parts[0].ln();
    let by_power = |power: f64| mean * (power * cells).exp();
    if parts[0] == parts[1] {
        return Range {
            expected: by_power(0.5),
            least: by_power(0.0),
            most: by_power(1.0),
        };
    }
    let power = (finer / unworn).ln() / (2.0 * (parts[1] / parts[0]).ln());
    Range::within(by_power(power.clamp(0.0, 1.0)), TABLES)
}
