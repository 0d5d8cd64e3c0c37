//! The figures of merit of a run, and how far two runs are apart in them.

use std::path::Path;
use std::sync::Arc;

use crate::store::{Machine, RealFileSystem, RunReader, StoreError};
use crate::tables::typed::{self, Summary};

/// Number of figures of merit.
pub const COUNT: usize = 9;

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
}

const fn figure(
    name: &'static str,
    title: &'static str,
    promised: bool,
    of: fn(&Summary) -> Option<f64>,
) -> Figure {
    Figure {
        name,
        title,
        promised,
        of,
    }
}

/// The figure that is a field: its error is an L1 distance, and it is no single number.
pub const FIELD: usize = 1;

/// The figures of merit, in the order in which they are shown.
pub const FIGURES: [Figure; COUNT] = [
    figure("wear_volume", "wear volume", true, |s| s.wear_volume),
    figure("wear_field", "wear field", false, |_| None),
    figure("loaded_area_fraction", "loaded area", false, |s| {
        s.loaded_area_fraction
    }),
    figure("kn", "kn", true, |s| s.kn),
    figure("kt", "kt", false, |s| s.kt),
    figure("resonance_frequency", "resonance", true, |s| {
        s.resonance_frequency
    }),
    figure("peak_amplitude", "amplitude", true, |s| s.peak_amplitude),
    figure("dissipated_energy_total", "dissipation", true, |s| {
        s.dissipated_energy_total
    }),
    // Where wear dies out, a small error of the volume is a large one of what is left to dissipate.
    figure("dissipated_energy", "a cycle's in the end", false, |s| {
        s.dissipated_energy
    }),
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

/// What a run says of its own worn volume: error bars relative to it.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Bars {
    /// From all sources together; none without wear.
    pub volume: Option<f64>,
    /// From what the fine contact dissipates beyond its contact elements; none without vibration.
    pub closure: Option<f64>,
}

/// What a run cost, and what came out.
#[derive(Debug, Clone, Default)]
pub struct Measured {
    /// Wall time \[s\].
    pub seconds: f64,
    /// Transform pairs.
    pub fft_pairs: f64,
    /// Wear iterations.
    pub iterations: u64,
    /// Figures of its last iteration; none for the field.
    pub values: Values,
    /// Its own error bars.
    pub bars: Bars,
    /// The worn depths of its last iteration, if it wore.
    pub field: Option<WearField>,
    /// Where it was computed.
    pub machine: Option<Machine>,
    /// Hash of its scene.
    pub scene_hash: String,
}

/// Reads a run; one that does not exist has cost nothing.
pub fn measure(root: &Path) -> Result<Measured, StoreError> {
    let reader = match RunReader::open(Arc::new(RealFileSystem), root) {
        Ok(reader) => reader,
        Err(StoreError::NoRun { .. }) => return Ok(Measured::default()),
        Err(error) => return Err(error),
    };
    let mut measured = Measured {
        machine: Some(reader.record().machine.clone()),
        scene_hash: reader.record().scene_hash.clone(),
        ..Measured::default()
    };
    for (stage, cost) in reader.history()?.cost() {
        // Whoever comes first pays for the structure that all share.
        if stage != "structure" {
            measured.seconds += cost.seconds;
        }
        measured.fft_pairs += cost.fft_pairs;
    }
    let Some(latest) = reader.latest() else {
        return Ok(measured);
    };
    measured.iterations = latest;
    let summary: Summary = reader.typed(latest)?;
    measured.values = FIGURES.map(|figure| (figure.of)(&summary));
    measured.bars = Bars {
        volume: summary.error_wear_volume,
        closure: summary.error_closure,
    };
    let grid = &reader.record().scene["joint"]["grid"];
    let cells = [&grid[0], &grid[1]].map(|n| n.as_u64().map(|n| n as usize));
    if let (true, [Some(nx), Some(ny)]) = (summary.wear_volume.is_some(), cells) {
        measured.field = Some(wear_field(&reader.typed(latest)?, [nx, ny]));
    }
    Ok(measured)
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
pub fn errors(of: &Measured, reference: &Measured) -> Values {
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
