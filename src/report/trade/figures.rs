//! Figures of merit of a run, its cost, and the deviation between two runs.

use std::path::Path;
use std::sync::Arc;

use crate::store::{Machine, RealFileSystem, RunReader, StoreError};
use crate::tables::typed::{self, Summary};

/// Number of figures of merit.
pub const COUNT: usize = 10;

/// Figure of merit.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    /// Name of the column of the summary, or of the field.
    pub name: &'static str,
    /// Title for readers.
    pub title: &'static str,
    /// True if the presets promise a bound of the error of the figure.
    pub promised: bool,
    /// Reads the figure from a summary. Returns `None` for the field.
    read: fn(&Summary) -> Option<f64>,
    /// Reads the error bar of the figure from a summary. Returns `None` for the field.
    bar: fn(&Summary) -> Option<f64>,
}

/// Index of the figure that is a field. A field has no single value, and the error of a field is an L1 distance.
pub const FIELD: usize = 1;

macro_rules! figure {
    ($name:ident, $title:literal, $promised:literal, $bar:ident) => {
        Figure {
            name: stringify!($name),
            title: $title,
            promised: $promised,
            read: |summary| summary.$name,
            bar: |summary| summary.$bar,
        }
    };
}

/// All figures of merit, in the order of the tables.
pub const FIGURES: [Figure; COUNT] = [
    figure!(wear_volume, "volume", true, error_wear_volume),
    Figure {
        name: "wear_field",
        title: "wear field",
        promised: false,
        read: |_| None,
        bar: |_| None,
    },
    figure!(
        loaded_area_fraction,
        "loaded area",
        false,
        error_loaded_area
    ),
    figure!(kn, "kn", true, error_kn),
    figure!(kt, "kt", false, error_kt),
    figure!(max_pressure, "largest pressure", false, error_max_pressure),
    figure!(
        resonance_frequency,
        "resonance",
        true,
        error_resonance_frequency
    ),
    figure!(peak_amplitude, "amplitude", true, error_peak_amplitude),
    figure!(
        dissipated_energy_total,
        "energy in all",
        true,
        error_wear_volume
    ),
    // If wear dies out, a small error of the volume is a large error of the remaining dissipation.
    figure!(
        dissipated_energy,
        "energy a cycle, in the end",
        false,
        error_dissipated_energy
    ),
];

/// One value per figure, `None` if the run lacks the figure.
pub type Values = [Option<f64>; COUNT];

/// Worn depth of each cell of the joint, constant over the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct WearField {
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Depth \[m\], x slowest.
    pub depth: Vec<f64>,
}

/// Cost and results of a run.
#[derive(Debug, Clone, Default)]
pub struct MeasuredVariant {
    /// Wall time \[s\].
    pub seconds: f64,
    /// CPU time \[s\]. `None` if a stage does not report it.
    pub cpu_seconds: Option<f64>,
    /// CPU time of each iteration, or its wall time if the CPU time is unknown \[s\].
    pub each: Vec<f64>,
    /// FFT pairs.
    pub fft_pairs: f64,
    /// Wear iterations.
    pub iterations: u64,
    /// Cells of the grid along x and y, or `None` without a grid.
    pub cells: Option<[usize; 2]>,
    /// True if a structure vibrates.
    pub vibrates: bool,
    /// Figures of the last iteration. `None` for the field.
    pub values: Values,
    /// Error bars from the run itself, relative to the figures.
    pub bars: Values,
    /// Part of the volume's error bar that comes from the closure: the rough contact dissipates more than its contact
    /// elements. `None` without vibration.
    pub closure: Option<f64>,
    /// Worn depths of the last iteration, if the run includes wear.
    pub field: Option<WearField>,
    /// Machine that computed the run.
    pub machine: Option<Machine>,
    /// Hash of the scene.
    pub scene_hash: String,
}

/// Stage whose time is not counted. All runs share the structure, and the first run computes it.
const SHARED: &str = "structure";

/// Section of the scene of a vibrating structure.
const DYNAMICS: &str = "dynamics";

/// Reads a run. A run that does not exist has no cost.
pub fn measure(root: &Path) -> Result<MeasuredVariant, StoreError> {
    let reader = match RunReader::open(Arc::new(RealFileSystem), root) {
        Ok(reader) => reader,
        Err(StoreError::NoRun { .. }) => return Ok(MeasuredVariant::default()),
        Err(error) => return Err(error),
    };
    let scene = &reader.record().scene;
    let grid = &scene["joint"]["grid"];
    let cells = [&grid[0], &grid[1]].map(|n| n.as_u64().map(|n| n as usize));
    let mut measured = MeasuredVariant {
        machine: Some(reader.record().machine.clone()),
        scene_hash: reader.record().scene_hash.clone(),
        vibrates: scene
            .get(DYNAMICS)
            .is_some_and(|section| !section.is_null()),
        cells: cells[0].zip(cells[1]).map(|(nx, ny)| [nx, ny]),
        cpu_seconds: Some(0.0),
        ..MeasuredVariant::default()
    };
    for (stage, cost) in reader.history()?.cost() {
        if stage != SHARED {
            measured.seconds += cost.seconds;
            let both = measured.cpu_seconds.zip(cost.cpu_seconds);
            measured.cpu_seconds = both.map(|(sum, cpu)| sum + cpu);
        }
        measured.fft_pairs += cost.fft_pairs;
    }
    for k in reader.iterations() {
        match reader.typed::<typed::Timing>(k) {
            Ok(timing) => measured.each.push(seconds_of(&timing)),
            // No result depends on the timing.
            Err(StoreError::Damaged(_) | StoreError::NoTable { .. }) => (),
            Err(error) => return Err(error),
        }
    }
    let Some(latest) = reader.latest() else {
        return Ok(measured);
    };
    measured.iterations = latest;
    let summary: Summary = reader.typed(latest)?;
    measured.values = FIGURES.map(|figure| (figure.read)(&summary));
    measured.bars = FIGURES.map(|figure| (figure.bar)(&summary));
    measured.closure = summary.error_closure;
    if let (true, Some(cells)) = (summary.wear_volume.is_some(), measured.cells) {
        measured.field = Some(wear_field(&reader.typed(latest)?, cells));
    }
    Ok(measured)
}

/// Returns the CPU time of an iteration, or its wall time if the CPU time is unknown \[s\].
fn seconds_of(timing: &typed::Timing) -> f64 {
    let is_counted = |k: &usize| timing.stage[*k] != SHARED;
    let rows = || (0..timing.stage.len()).filter(is_counted);
    let cpu: Option<f64> = rows().map(|k| timing.cpu_seconds[k]).sum();
    cpu.unwrap_or_else(|| rows().map(|k| timing.seconds[k]).sum())
}

/// Returns the relative noise of the seconds of two equal runs.
///
/// The noise is the sum of the absolute differences between the iterations, relative to the mean time of both runs.
/// Absolute differences do not cancel. Returns `None` if the runs cannot be compared.
pub fn noise(first: &[f64], second: &[f64]) -> Option<f64> {
    let pairs = || first.iter().zip(second);
    let difference: f64 = pairs().map(|(a, b)| (a - b).abs()).sum();
    let mean: f64 = pairs().map(|(a, b)| 0.5 * (a + b)).sum();
    (first.len() == second.len() && mean > 0.0).then(|| difference / mean)
}

/// Returns the relative work of an FFT pair on a grid: n log n, where n is the number of points of the padded grid. The
/// padded grid has twice as many cells along each side.
pub fn work_of_pair(cells: [usize; 2]) -> f64 {
    let points = 4.0 * cells[0] as f64 * cells[1] as f64;
    points * points.ln()
}

fn wear_field(table: &typed::WearField, cells: [usize; 2]) -> WearField {
    let mut depth = vec![0.0; cells[0] * cells[1]];
    for ((i, j), value) in table.i.iter().zip(&table.j).zip(&table.wear_depth) {
        if let Some(depth) = depth.get_mut(*i as usize * cells[1] + *j as usize) {
            *depth = *value;
        }
    }
    WearField { cells, depth }
}

/// Returns the deviations of a result from the reference. A deviation is `None` if the result or the reference lacks
/// the figure.
pub fn errors(result: &MeasuredVariant, reference: &MeasuredVariant) -> Values {
    let mut errors: Values = std::array::from_fn(|k| {
        let (value, reference) = (result.values[k]?, reference.values[k]?);
        deviation(value, reference)
    });
    if let (Some(field), Some(reference)) = (&result.field, &reference.field) {
        errors[FIELD] = field_error(field, reference);
    }
    errors
}

/// Returns `value / reference - 1`. Returns `None` if the reference or the result is not finite, for example if the
/// reference is zero.
pub fn deviation(value: f64, reference: f64) -> Option<f64> {
    if value == reference {
        return Some(0.0);
    }
    Some(value / reference - 1.0)
        .filter(|_| reference.is_finite() && reference != 0.0)
        .filter(|deviation| deviation.is_finite())
}

/// Returns ∫ |a - b| dA / ∫ b dA for two fields `a` and `b` over the same joint. Each field is constant within a cell.
/// Returns `None` if `b` is zero and `a` is not.
pub fn field_error(a: &WearField, b: &WearField) -> Option<f64> {
    let [x, y] = [0, 1].map(|d| overlaps(a.cells[d], b.cells[d]));
    let (mut difference, mut whole) = (0.0, 0.0);
    for &(ia, ib, dx) in &x {
        for &(ja, jb, dy) in &y {
            let (a, b) = (a.depth[ia * a.cells[1] + ja], b.depth[ib * b.cells[1] + jb]);
            difference += (a - b).abs() * dx * dy;
            whole += b.abs() * dx * dy;
        }
    }
    if difference == 0.0 {
        return Some(0.0);
    }
    Some(difference / whole).filter(|error| error.is_finite())
}

/// Splits the unit length at the edges of `a` equal cells and of `b` equal cells. Returns the pieces: cell of `a`, cell
/// of `b`, length.
fn overlaps(a: usize, b: usize) -> Vec<(usize, usize, f64)> {
    let mut pieces = Vec::with_capacity(a + b);
    let (mut i, mut j) = (0, 0);
    // In units of 1 / (a b), all edges are integers.
    let mut position = 0;
    while i < a && j < b {
        let (end_a, end_b) = ((i + 1) * b, (j + 1) * a);
        let end = end_a.min(end_b);
        pieces.push((i, j, (end - position) as f64 / (a * b) as f64));
        position = end;
        i += usize::from(end == end_a);
        j += usize::from(end == end_b);
    }
    pieces
}
