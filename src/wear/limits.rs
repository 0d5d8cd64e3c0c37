//! Friction limits over a cycle, and which part of a step a cell is in contact where it closes or opens within it.

use super::joint::{FrettingJoint, WearError};
use super::motion::{Motion, SAME, Step};
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::Drive;

/// Part of a step before a change of contact where the gaps beside it do not say it: on average it is in the middle.
const MIDDLE: f64 = 0.5;

/// Part of what friction carries that forces leave, from which on a solve is the more exact, and how exact at most. Else an orbit that leaves
/// 3e-3 was 0.3 % off in the energy of a cycle, one that leaves 3e-4 1.4 to 10 %.
const RESERVE: f64 = 1.0 / 30.0;
const MOST_EXACT: f64 = 1e-3;

/// Friction limits of the samples of a cycle.
pub(super) struct FrictionLimits {
    /// µp on every cell \[Pa\], one field for each load that differs.
    fields: Vec<Vec<f64>>,
    /// Gap on every cell \[m\], likewise; none under constant load. Gaps only say when cells close, for which single precision is ample.
    gaps: Vec<Vec<f32>>,
    /// Pressure \[Pa\] and gap \[m\] of the same contacts, where fields of the cycle are wanted.
    contacts: Option<Vec<[Vec<f64>; 2]>>,
    /// The field of each sample.
    of_sample: Vec<usize>,
}

/// A cell that closes or opens within a step.
pub(super) struct Change {
    /// The cell.
    pub(super) cell: usize,
    /// Part of the step in which the cell is open.
    pub(super) open: f64,
    /// Whether the cell closes; it opens otherwise.
    pub(super) closes: bool,
}

impl FrictionLimits {
    fn constant(limit: Vec<f64>, samples: usize) -> Self {
        FrictionLimits {
            fields: vec![limit],
            gaps: Vec::new(),
            contacts: None,
            of_sample: vec![0; samples],
        }
    }

    fn add(&mut self, joint: &FrettingJoint, contact: &NormalSolution) {
        self.fields.push(joint.limit(&contact.pressure));
        self.gaps
            .push(contact.gap.iter().map(|g| *g as f32).collect());
        if let Some(contacts) = &mut self.contacts {
            contacts.push([contact.pressure.clone(), contact.gap.clone()]);
        }
    }

    /// Limits at a sample, counted on over the end of the cycle \[Pa\].
    pub(super) fn at(&self, sample: usize) -> &[f64] {
        &self.fields[self.of_sample[sample % self.of_sample.len()]]
    }

    /// Pressure and gap at a sample, where they are held and change over the cycle.
    pub(super) fn contact_at(&self, sample: usize) -> Option<(&[f64], &[f64])> {
        let [pressure, gap] = &self.contacts.as_ref()?[self.of_sample[sample]];
        Some((pressure, gap))
    }

    /// True if the limits are not the same throughout.
    pub(super) fn vary(&self) -> bool {
        self.fields.len() > 1
    }

    /// Cells that close or open between the samples `k` and `k + stride` of the `motion`. The gap of two samples beside the change,
    /// continued as a straight line, says when.
    pub(super) fn changes(&self, motion: &Motion, k: usize, stride: usize) -> Vec<Change> {
        if !self.vary() {
            return Vec::new();
        }
        let samples = self.of_sample.len();
        let gap = |sample: usize| &self.gaps[self.of_sample[sample % samples]];
        let [before, from, to] = [k + samples - stride, k, k + stride];
        let [earlier, step, later] =
            [before, from, to].map(|sample| motion.load_change(sample, stride));
        let [gap_before, gap_from, gap_to, gap_after] = [before, from, to, to + stride].map(gap);
        let (limit_from, limit_to) = (self.at(from), self.at(to));
        // Of a gap that is `near` beside the change and was, or will be, `far` a step of this length away.
        let open = |near: f32, far: f32, length: f64| {
            let (near, rate) = (f64::from(near), f64::from(far - near) / length);
            if rate > 0.0 {
                (near / rate / step).min(1.0)
            } else {
                MIDDLE
            }
        };
        let cells = limit_from.iter().zip(limit_to).enumerate();
        cells
            .filter_map(|(cell, (from, to))| match (*from > 0.0, *to > 0.0) {
                (false, true) => Some(Change {
                    cell,
                    open: open(gap_from[cell], gap_before[cell], earlier),
                    closes: true,
                }),
                (true, false) => Some(Change {
                    cell,
                    open: open(gap_to[cell], gap_after[cell], later),
                    closes: false,
                }),
                _ => None,
            })
            .collect()
    }
}

/// What the tolerance of a step is to be multiplied by, under friction limits at its end \[Pa\]: near what friction carries, a force leaves the
/// displacement to what little sticks, and an error of the solve is the larger in it. 1 where no force is given.
pub(super) fn exactness(driven: &Step, limit: &[f64], cell_area: f64) -> f64 {
    let forces = driven.drive.iter().map(|drive| match drive {
        Drive::Force(force) => force * force,
        Drive::Displacement(_) => 0.0,
    });
    let force = forces.sum::<f64>().sqrt();
    if force == 0.0 {
        return 1.0;
    }
    let reserve = 1.0 - force / (limit.iter().sum::<f64>() * cell_area);
    (reserve / RESERVE).clamp(MOST_EXACT, 1.0)
}

impl FrettingJoint {
    /// Friction limits over the cycle, on a surface of which `wear` is gone, with its static contact at the mean load. Loads that
    /// come back are solved once. With `hold` the pressures and gaps of a load that varies are held too.
    pub(super) fn limits_over_cycle(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        hold: bool,
    ) -> Result<FrictionLimits, WearError> {
        let samples = self.motion.samples();
        let mut limits = FrictionLimits {
            fields: Vec::new(),
            gaps: Vec::new(),
            contacts: hold.then(Vec::new),
            of_sample: (0..samples).collect(),
        };
        if self.contacts_by_place(contact, |joint, found| limits.add(joint, found))? {
            return Ok(limits);
        }
        if self.motion.constant_load() {
            let limit = self.limit(&contact.pressure);
            return Ok(FrictionLimits::constant(limit, samples));
        }
        let mut loads: Vec<f64> = Vec::new();
        let mut pressure = contact.pressure.clone();
        for (k, &load) in self.motion.normal_load.clone().iter().enumerate() {
            let same = |before: &f64| (before - load).abs() <= SAME * load.abs();
            limits.of_sample[k] = match loads.iter().position(same) {
                Some(field) => field,
                None => {
                    let found = self.contact(wear, None, load, Some(&pressure))?;
                    limits.add(self, &found);
                    pressure = found.pressure;
                    loads.push(load);
                    loads.len() - 1
                }
            };
        }
        Ok(limits)
    }
}
