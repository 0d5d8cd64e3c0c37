//! Which fields of the steady cycle a run writes.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::cycle::MotionSource;
use super::decision::Decisions;
use super::{Cycle, Recipe};
use crate::contact::Shear;
use crate::grid::Patch;
use crate::wear::Motion;
use crate::wear::cycle::March;

/// Bytes of a number, and of an index, in a row of the table.
const NUMBER: usize = 8;
const INDEX: usize = 4;
/// Rows at the reversals of a motion: t = 0, the two ends and t = T, of which the first may be an end.
const OF_REVERSALS: usize = 4;

/// The fields of the steady cycle that are written: samples of it, cells, and iterations.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct CycleFields {
    /// The samples, by their rows in the table `cycle`; none: all.
    pub samples: Option<Vec<u64>>,
    /// The first and the last cell along x, and along y; none: all.
    pub cells: [Option<[u64; 2]>; 2],
    /// Every so many iterations, and the last.
    pub every: u64,
}

impl CycleFields {
    /// Whether they have a sample.
    pub fn has_sample(&self, sample: usize) -> bool {
        let samples = self.samples.as_ref();
        samples.is_none_or(|samples| samples.contains(&(sample as u64)))
    }

    /// Whether they have a cell.
    pub fn has_cell(&self, cell: (usize, usize)) -> bool {
        let within = |at: usize, range: Option<[u64; 2]>| {
            range.is_none_or(|[first, last]| (first..=last).contains(&(at as u64)))
        };
        within(cell.0, self.cells[0]) && within(cell.1, self.cells[1])
    }

    /// Moves the range of cells to a grid of other counts: `from` those of its own grid, `to` those of the other.
    pub(crate) fn on_grid(&mut self, from: [usize; 2], to: [usize; 2]) {
        for (range, (from, to)) in self.cells.iter_mut().zip(from.into_iter().zip(to)) {
            for end in range.iter_mut().flatten() {
                *end = *end * to as u64 / from as u64;
            }
        }
    }

    /// Samples of a cycle that they have, at most.
    pub(crate) fn samples_of(&self, cycle: &Cycle, normal_load: f64) -> usize {
        match &self.samples {
            Some(samples) => samples.len(),
            None => cycle.most_instants(normal_load),
        }
    }

    /// Cells of a joint that they have.
    pub(crate) fn count(&self, patch: &Patch) -> usize {
        let kept = (0..patch.grid.len()).filter(|&cell| patch.kept[cell]);
        kept.filter(|&cell| self.has_cell(patch.grid.cell(cell)))
            .count()
    }

    /// Says what is written, and how large that is at most.
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
        // sample, i and j; time, pressure and gap, shear and slip.
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
    /// Instants of the table `cycle` under a `motion`, if it is prescribed; none as long as it is not known how the cycle is marched.
    pub(crate) fn instants(&self, motion: &Motion) -> Option<usize> {
        let is_computed = self.motion == MotionSource::Computed;
        Some(match self.march.or(self.asked)? {
            March::Stepped if is_computed => self.steps + 1,
            March::Stepped => motion.samples() / self.samples_an_instant() + 1,
            March::Reversal | March::Superposition => match motion.straight() {
                Some(straight) if !is_computed && straight.top > 0 => OF_REVERSALS,
                _ => OF_REVERSALS - 1,
            },
        })
    }

    /// The most that there may be.
    fn most_instants(&self, normal_load: f64) -> usize {
        let samples = match &self.motion {
            MotionSource::History { samples, .. } => *samples / self.samples_an_instant(),
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

    /// Samples of a stepped motion from one instant that is written to the next: those between are there to extrapolate a history.
    pub fn samples_an_instant(&self) -> usize {
        match self.motion {
            MotionSource::History { halved: true, .. } => 2,
            _ => 1,
        }
    }
}

/// `false` where there are none, as runs have it that could not write any.
pub(super) fn serialize<S: Serializer>(
    fields: &Option<CycleFields>,
    to: S,
) -> Result<S::Ok, S::Error> {
    match fields {
        Some(fields) => fields.serialize(to),
        None => false.serialize(to),
    }
}

/// See [`serialize`].
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
