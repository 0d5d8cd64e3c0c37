//! The figures of merit of a run, what it cost, and how far two runs are apart in them.

use std::path::Path;
use std::sync::Arc;

use crate::store::{Machine, RealFileSystem, RunReader, StoreError};
use crate::tables::typed::{self, Summary};

/// Number of figures of merit.
pub const COUNT: usize = 10;

/// A figure of merit.
#[derive(Debug, Clone, Copy)]
pub struct Figure {
    /// Name: that of the column of the summary, but for the field.
    pub name: &'static str,
    /// What a person calls it.
    pub title: &'static str,
    /// True if the presets promise it.
    pub promised: bool,
    /// Where it stands in a summary; nowhere for the field.
    of: fn(&Summary) -> Option<f64>,
    /// Where its error bar stands; nowhere for the field.
    bar: fn(&Summary) -> Option<f64>,
}

/// The figure that is a field: its error is an L1 distance, and it is no single number.
pub const FIELD: usize = 1;

macro_rules! figure {
    ($name:ident, $title:literal, $promised:literal, $bar:ident) => {
        Figure {
            name: stringify!($name),
            title: $title,
            promised: $promised,
            of: |summary| summary.$name,
            bar: |summary| summary.$bar,
        }
    };
}

/// The figures of merit, in the order in which they are shown.
pub const FIGURES: [Figure; COUNT] = [
    figure!(wear_volume, "volume", true, error_wear_volume),
    Figure {
        name: "wear_field",
        title: "wear field",
        promised: false,
        of: |_| None,
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
    // Where wear dies out, a small error of the volume is a large one of what is left to dissipate.
    figure!(
        dissipated_energy,
        "energy a cycle, in the end",
        false,
        error_dissipated_energy
    ),
];

/// One value a figure; none where the run has no such figure.
pub type Values = [Option<f64>; COUNT];

/// Worn depth of every cell of the joint, which is worn by that depth all over the cell.
#[derive(Debug, Clone, PartialEq)]
pub struct WearField {
    /// Cells along x and y.
    pub cells: [usize; 2],
    /// Depth \[m\], x slowest.
    pub depth: Vec<f64>,
}

/// What a run cost, and what came out.
#[derive(Debug, Clone, Default)]
pub struct MeasuredVariant {
    /// Wall time \[s\].
    pub seconds: f64,
    /// CPU time \[s\]; none where a stage does not tell it.
    pub cpu_seconds: Option<f64>,
    /// CPU time of each iteration, or its wall time where the CPU time is not told \[s\].
    pub each: Vec<f64>,
    /// Transform pairs.
    pub fft_pairs: f64,
    /// Wear iterations.
    pub iterations: u64,
    /// Cells of its grid along x and y; none without one.
    pub cells: Option<[usize; 2]>,
    /// True if a structure vibrates.
    pub vibrates: bool,
    /// Figures of its last iteration; none for the field.
    pub values: Values,
    /// Its own error bars, relative to the figures.
    pub bars: Values,
    /// The part of the bar of the volume by what the fine contact dissipates beyond its contact elements; none without vibration.
    pub closure: Option<f64>,
    /// The worn depths of its last iteration, if it wore.
    pub field: Option<WearField>,
    /// Where it was computed.
    pub machine: Option<Machine>,
    /// Hash of its scene.
    pub scene_hash: String,
}

/// The stage whose cost is not counted: whoever comes first pays for the structure that all share.
const SHARED: &str = "structure";

/// The section of a scene by which it vibrates.
const DYNAMICS: &str = "dynamics";

/// Reads a run; one that does not exist has cost nothing.
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
            // No result depends on it.
            Err(StoreError::Damaged(_) | StoreError::NoTable { .. }) => (),
            Err(error) => return Err(error),
        }
    }
    let Some(latest) = reader.latest() else {
        return Ok(measured);
    };
    measured.iterations = latest;
    let summary: Summary = reader.typed(latest)?;
    measured.values = FIGURES.map(|figure| (figure.of)(&summary));
    measured.bars = FIGURES.map(|figure| (figure.bar)(&summary));
    measured.closure = summary.error_closure;
    if let (true, Some(cells)) = (summary.wear_volume.is_some(), measured.cells) {
        measured.field = Some(wear_field(&reader.typed(latest)?, cells));
    }
    Ok(measured)
}

/// What an iteration took, of the wall where the CPU time is not told \[s\].
fn seconds_of(timing: &typed::Timing) -> f64 {
    let own = |k: &usize| timing.stage[*k] != SHARED;
    let rows = || (0..timing.stage.len()).filter(own);
    let cpu: Option<f64> = rows().map(|k| timing.cpu_seconds[k]).sum();
    cpu.unwrap_or_else(|| rows().map(|k| timing.seconds[k]).sum())
}

/// How far the seconds of two equal runs are apart: the differences of their iterations, each counted as positive, so that one does not
/// hide another, in parts of what both took on average. None where nothing can be compared.
pub fn noise(one: &[f64], other: &[f64]) -> Option<f64> {
    let pairs = || one.iter().zip(other);
    let apart: f64 = pairs().map(|(a, b)| (a - b).abs()).sum();
    let mean: f64 = pairs().map(|(a, b)| 0.5 * (a + b)).sum();
    (one.len() == other.len() && mean > 0.0).then(|| apart / mean)
}

/// The work of a transform pair on a grid, up to a factor: n log n of the points of its plane, which has twice as many a side as cells.
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

/// Errors of `of` against `reference`; none where one of them lacks the figure.
pub fn errors(of: &MeasuredVariant, reference: &MeasuredVariant) -> Values {
    let mut errors: Values = std::array::from_fn(|k| {
        let (value, reference) = (of.values[k]?, reference.values[k]?);
        deviation(value, reference)
    });
    if let (Some(field), Some(reference)) = (&of.field, &reference.field) {
        errors[FIELD] = field_error(field, reference);
    }
    errors
}

/// `value / reference - 1`; none where there is nothing to be relative to: to zero, or to a stiffness without compliance.
pub fn deviation(value: f64, reference: f64) -> Option<f64> {
    if value == reference {
        return Some(0.0);
    }
    Some(value / reference - 1.0)
        .filter(|_| reference.is_finite() && reference != 0.0)
        .filter(|deviation| deviation.is_finite())
}

/// ∫ |a - b| dA / ∫ b dA of two fields over the same joint, each constant over its cells; none where `b` is zero and `a` is not.
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

/// The pieces into which the edges of `a` and of `b` equal cells cut the same length 1: cell of `a`, cell of `b`, length.
fn overlaps(a: usize, b: usize) -> Vec<(usize, usize, f64)> {
    let mut pieces = Vec::with_capacity(a + b);
    let (mut i, mut j) = (0, 0);
    // In units of 1 / (a b) all edges are integers.
    let mut at = 0;
    while i < a && j < b {
        let (end_a, end_b) = ((i + 1) * b, (j + 1) * a);
        let end = end_a.min(end_b);
        pieces.push((i, j, (end - at) as f64 / (a * b) as f64));
        at = end;
        i += usize::from(end == end_a);
        j += usize::from(end == end_b);
    }
    pieces
}
