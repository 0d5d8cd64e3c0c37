//! One rehearsal: a run of coarser inputs in memory, and what each of its iterations took.

use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use super::files::FilesInMemory;
use crate::recipe::Inputs;
use crate::stages::{self, Ending, Observer, Progress, RunError, RunOptions, Stage};
use crate::store::{Cache, FileSystem, Opening, RealFileSystem};
use crate::tables::{TableName, TypedTable, from_parquet, typed};

/// An iteration of a rehearsal.
#[derive(Debug, Clone, Default)]
pub(super) struct Iteration {
    /// Cycles behind it, and worn volume \[m³\].
    pub cycles: f64,
    pub volume: f64,
    /// Largest pressure, and mean of what is in contact \[Pa\].
    pub peak_pressure: f64,
    pub mean_pressure: f64,
    /// Tangential stiffness \[N/m\]; none where it is infinite.
    pub kt: Option<f64>,
    /// Transform pairs and seconds by stage.
    pub pairs: BTreeMap<String, f64>,
    pub seconds: BTreeMap<String, f64>,
    /// Whether its response was computed, and not that of the iteration before.
    pub is_response_new: bool,
    /// Bytes of its tables.
    pub bytes: f64,
}

/// What was rehearsed of a course of wear.
#[derive(Debug, Clone)]
pub(super) struct RehearsedRun {
    pub iterations: Vec<Iteration>,
    /// Why it is not the whole; none if it is.
    pub broken_off: Option<String>,
}

/// How far a rehearsal may go.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bounds<'a> {
    /// Operations of transforms that it may spend before the iteration in which it ends, and those of one pair.
    pub operations: f64,
    pub pair: f64,
    /// Operations of an iteration beside its pairs.
    pub iteration: f64,
    /// When it has to end in any case.
    pub until: Instant,
    /// Why the structure must not be reduced; none if it may.
    pub no_reduction: Option<&'a str>,
    /// Where reduced structures may be.
    pub cache: Option<&'a Path>,
}

/// Where a rehearsal has its files, which no path leads to.
const ROOT: &str = "/rehearsal";

/// Runs inputs in memory.
///
/// # Errors
/// Those of the run but for one that was broken off; the solvers may fail on a coarser grid too.
pub(super) fn course(inputs: &Inputs, bounds: &Bounds) -> Result<RehearsedRun, RunError> {
    let files = Arc::new(FilesInMemory::default());
    let watch = Watch {
        files: files.clone(),
        bounds: *bounds,
        iterations: RefCell::default(),
        spent: Cell::default(),
        broken_off: RefCell::default(),
    };
    let cache = bounds
        .cache
        .map(|folder| Cache::new(Arc::new(RealFileSystem), folder));
    let options = RunOptions {
        inputs,
        root: PathBuf::from(ROOT),
        source: None,
        until: None,
        threads: 1,
        cache,
        file_system: files,
        stop: &|_| watch.spent.get() >= bounds.operations || Instant::now() >= bounds.until,
    };
    let ending = stages::run(&options, &watch)?.ending;
    let broken_off = (ending == Ending::Stopped).then(|| {
        let longer = || "the course of wear is longer than the time of a rehearsal".to_owned();
        watch.broken_off.take().unwrap_or_else(longer)
    });
    Ok(RehearsedRun {
        iterations: watch.iterations.take(),
        broken_off,
    })
}

struct Watch<'a> {
    files: Arc<FilesInMemory>,
    bounds: Bounds<'a>,
    iterations: RefCell<Vec<Iteration>>,
    /// Operations of transforms.
    spent: Cell<f64>,
    /// Why the run has ended before a stage.
    broken_off: RefCell<Option<String>>,
}

impl Watch<'_> {
    fn table<T: TypedTable>(&self, folder: &Path) -> Option<T> {
        let path = folder.join(T::TABLE.file_name());
        let bytes = self.files.read(&path, u64::MAX).ok()?;
        let table = from_parquet(&bytes, T::TABLE.schema()).ok()?;
        T::of(&table).ok()
    }

    /// What the committed iteration says of itself.
    fn iteration(&self, progress: &Progress) -> Iteration {
        let name = format!("wear_iteration={}", progress.wear_iteration);
        let folder = Path::new(ROOT).join("iterations").join(name);
        let mut iteration = Iteration {
            cycles: progress.cycles as f64,
            volume: progress.volume,
            ..Iteration::default()
        };
        if let Some(timing) = self.table::<typed::Timing>(&folder) {
            let rows = timing.stage.iter().zip(&timing.seconds);
            for ((stage, seconds), pairs) in rows.zip(&timing.fft_pairs) {
                *iteration.pairs.entry(stage.clone()).or_default() += pairs;
                *iteration.seconds.entry(stage.clone()).or_default() += seconds;
            }
        }
        if let Some(summary) = self.table::<typed::Summary>(&folder) {
            let number = |value: Option<f64>| value.unwrap_or(0.0);
            iteration.peak_pressure = number(summary.max_pressure);
            iteration.mean_pressure = number(summary.normal_load) / number(summary.contact_area);
            iteration.kt = summary.kt;
            // A vibration without a rough contact updates nothing.
            let vibrates = summary.peak_frequency.is_some();
            iteration.is_response_new = summary.updated.unwrap_or(vibrates);
        }
        let tables = TableName::ALL.iter().map(|table| table.file_name());
        let lengths = tables.filter_map(|name| self.files.metadata(&folder.join(name)).ok()?);
        iteration.bytes = lengths.map(|found| found.len as f64).sum();
        iteration
    }
}

impl Observer for Watch<'_> {
    fn opened(&self, _opening: &Opening) {}

    fn notice(&self, _text: &str) {}

    fn stage(&self, _stage: Stage, _wear_iteration: u64) {}

    fn ends_before(&self, stage: Stage) -> bool {
        let reduces = stage == Stage::Structure;
        let why = match self.bounds.no_reduction.filter(|_| reduces) {
            Some(why) => Some(why.to_owned()),
            None => (Instant::now() >= self.bounds.until)
                .then(|| format!("the time of a rehearsal was over before {stage}")),
        };
        let ends = why.is_some();
        *self.broken_off.borrow_mut() = why;
        ends
    }

    fn committed(&self, progress: &Progress) {
        let iteration = self.iteration(progress);
        let pairs: f64 = iteration.pairs.values().sum();
        let spent = self.spent.get() + pairs * self.bounds.pair + self.bounds.iteration;
        self.spent.set(spent);
        self.iterations.borrow_mut().push(iteration);
    }
}
