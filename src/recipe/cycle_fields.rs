//! Fields of the steady cycle that a run writes.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::cycle::MotionSource;
use super::decision::Decisions;
use super::{Cycle, Recipe};
use crate::contact::Shear;
use crate::grid::Patch;
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Bytes per number, and per index, in a row of the table.
const NUMBER: usize = 8;
const INDEX: usize = 4;
/// Rows at the reversals of a motion: t = 0, the two ends and t = T. The first row may be an end.
const OF_REVERSALS: usize = 4;

/// Samples, cells and iterations for which the fields of the steady cycle are written.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CycleFields {
    /// Row numbers in the table `cycle` of the samples to write; `None` for all samples.
    pub samples: Option<Vec<u64>>,
    /// First and last cell to write along x, and along y; `None` for all cells.
    pub cells: [Option<[u64; 2]>; 2],
    /// Interval in iterations. The last iteration is always included.
    pub every: u64,
}

impl CycleFields {
    /// Returns true if the fields include a sample.
    pub fn has_sample(&self, sample: usize) -> bool {
        let samples = self.samples.as_ref();
        samples.is_none_or(|samples| samples.contains(&(sample as u64)))
    }

    /// Returns true if the fields include a cell.
    pub fn has_cell(&self, cell: (usize, usize)) -> bool {
        let within = |at: usize, range: Option<[u64; 2]>| {
            range.is_none_or(|[first, last]| (first..=last).contains(&(at as u64)))
        };
        within(cell.0, self.cells[0]) && within(cell.1, self.cells[1])
    }

    /// Maps the ranges of cells from a grid with `from` cells to a grid with `to` cells.
    pub(crate) fn on_grid(&mut self, from: [usize; 2], to: [usize; 2]) {
        for (range, (from, to)) in self.cells.iter_mut().zip(from.into_iter().zip(to)) {
            for end in range.iter_mut().flatten() {
                *end = *end * to as u64 / from as u64;
            }
        }
    }

    /// Returns the largest number of samples per cycle.
    pub(crate) fn samples_of(&self, cycle: &Cycle, normal_load: f64) -> usize {
        match &self.samples {
            Some(samples) => samples.len(),
            None => cycle.most_instants(normal_load),
        }
    }

    /// Returns the number of selected cells of a joint.
    pub(crate) fn count(&self, patch: &Patch) -> usize {
        let kept_cells = (0..patch.grid.len()).filter(|&cell| patch.is_in_joint[cell]);
        kept_cells
            .filter(|&cell| self.has_cell(patch.grid.cell(cell)))
            .count()
    }

    /// Explains which fields are written, and their maximum size.
    pub(super) fn explain(&self, recipe: &Recipe, decisions: &mut Decisions) {
        let (Some(surface), Some(contact), Some(cycle)) =
            (recipe.surface(), recipe.contact(), recipe.cycle())
        else {
            return;
        };
        let samples = self.samples_of(cycle, contact.conditions.normal_load);
        let cells = surface.patch().map_or(surface.kept, |p| self.count(&p));
        let axes = match contact.shear {
            Shear::AlongX => 1,
            Shear::InPlane => 2,
        };
        // The indices are sample, i and j. The numbers are time, pressure and gap, then shear and slip for each axis.
        let row = 3 * INDEX + (3 + 2 * axes) * NUMBER;
        let bytes = samples * cells * row;
        let often = match self.every {
            1 => "of every iteration".to_owned(),
            every => format!("every {every} iterations, and of the last"),
        };
        decisions.add(
            "fields of the cycle",
            format!(
                "{samples} samples of up to {cells} cells, those of them in contact, {often}: at most {:.3} MB each before compression",
                bytes as f64 / 1e6
            ),
            "output.cycle_fields",
        );
    }
}

impl Cycle {
    /// Returns the number of rows of the table `cycle` under a prescribed `motion`. Returns `None` if the plan has not
    /// yet chosen the scheme of the cycle.
    pub(crate) fn instants(&self, motion: &Motion) -> Option<usize> {
        let is_computed = self.motion == MotionSource::Computed;
        Some(match self.march.or(self.asked)? {
            March::Stepped if is_computed => self.steps + 1,
            March::Stepped => motion.samples() / self.samples_per_instant() + 1,
            March::Reversal | March::Superposition => match motion.straight() {
                Some(straight) if !is_computed && straight.top > 0 => OF_REVERSALS,
                _ => OF_REVERSALS - 1,
            },
        })
    }

    /// Returns an upper bound of the number of rows.
    fn most_instants(&self, normal_load: f64) -> usize {
        let samples = match &self.motion {
            MotionSource::History { samples, .. } => *samples / self.samples_per_instant(),
            MotionSource::Harmonic(_) => self
                .harmonic_motion(normal_load)
                .map_or(self.steps, |motion| motion.samples()),
            MotionSource::Computed => self.steps,
        };
        match self.march.or(self.asked) {
            Some(March::Reversal | March::Superposition) => OF_REVERSALS,
            Some(March::Stepped) | None => (samples + 1).max(OF_REVERSALS),
        }
    }

    /// Returns the number of samples of a stepped motion per written row. Samples in between serve only to
    /// extrapolate a history.
    pub fn samples_per_instant(&self) -> usize {
        match self.motion {
            MotionSource::History { halved: true, .. } => 2,
            _ => 1,
        }
    }
}

/// Writes `false` if the recipe has no fields of the cycle, as in the recipes of older runs.
pub(super) fn serialize<S: Serializer>(
    fields: &Option<CycleFields>,
    to: S,
) -> Result<S::Ok, S::Error> {
    match fields {
        Some(fields) => fields.serialize(to),
        None => false.serialize(to),
    }
}

/// Reads the form that [`serialize`] writes.
pub(super) fn deserialize<'de, D: Deserializer<'de>>(
    from: D,
) -> Result<Option<CycleFields>, D::Error> {
    #[derive(Deserialize)]
    #[serde(untagged)]
    enum Written {
        Fields(CycleFields),
        #[allow(dead_code)]
        Flag(bool),
    }
    Ok(match Written::deserialize(from)? {
        Written::Fields(fields) => Some(fields),
        Written::Flag(_) => None,
    })
}
