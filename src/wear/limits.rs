//! Friction limits over a cycle. A cell that closes or opens is in contact for only a fraction of a step; this module
//! also computes the fraction.

use super::joint::{FrettingJoint, WearError};
use super::motion::{EQUALITY_TOLERANCE, Motion, Step};
use crate::contact::normal::NormalSolution;
use crate::contact::tangential::Drive;

/// Assumed fraction of a step before a change of contact, if the neighbouring gaps give no fraction. On average the
/// contact changes in the middle.
const MIDDLE: f64 = 0.5;

/// The reserve of friction is the friction capacity minus the prescribed forces, as a fraction of the capacity. A solve
/// needs a tighter tolerance if the reserve is below `FULL_TOLERANCE_RESERVE`; `SMALLEST_TOLERANCE_FACTOR` is the
/// smallest factor on the tolerance. Tests without the tighter tolerance computed orbits with a small reserve. The
/// energy per cycle had an error of 0.3 % for a reserve of 3e-3. The energy per cycle had an error of 1.4 to 10 % for a
/// reserve of 3e-4.
const FULL_TOLERANCE_RESERVE: f64 = 1.0 / 30.0;
const SMALLEST_TOLERANCE_FACTOR: f64 = 1e-3;

/// Friction limits at the samples of a cycle.
pub(super) struct FrictionLimits {
    /// µp on every cell \[Pa\], one field for each distinct load.
    fields: Vec<Vec<f64>>,
    /// Gap on every cell \[m\], one field for each distinct load; empty under constant load. Gaps only give
    /// the time at which cells close, so single precision suffices.
    gaps: Vec<Vec<f32>>,
    /// Pressure \[Pa\] and gap \[m\] of the same contacts, if fields of the cycle are wanted.
    contacts: Option<Vec<[Vec<f64>; 2]>>,
    /// Index of the field of each sample.
    field_of_sample: Vec<usize>,
}

/// Cell that closes or opens within a step.
pub(super) struct Change {
    /// Number of the cell.
    pub(super) cell: usize,
    /// Fraction of the step in which the cell is open.
    pub(super) open: f64,
    /// True if the cell closes in the step, false if the cell opens.
    pub(super) closes: bool,
}

impl FrictionLimits {
    fn constant(limit: Vec<f64>, samples: usize) -> Self {
        FrictionLimits {
            fields: vec![limit],
            gaps: Vec::new(),
            contacts: None,
            field_of_sample: vec![0; samples],
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

    /// Returns the limits at a sample, counted periodically \[Pa\].
    pub(super) fn at(&self, sample: usize) -> &[f64] {
        &self.fields[self.field_of_sample[sample % self.field_of_sample.len()]]
    }

    /// Returns pressure and gap at a sample, if they are stored and change over the cycle.
    pub(super) fn contact_at(&self, sample: usize) -> Option<(&[f64], &[f64])> {
        let [pressure, gap] = &self.contacts.as_ref()?[self.field_of_sample[sample]];
        Some((pressure, gap))
    }

    /// Returns true if the limits vary over the cycle.
    pub(super) fn vary(&self) -> bool {
        self.fields.len() > 1
    }

    /// Returns the cells that close or open between the samples `k` and `k + stride` of the `motion`. The
    /// time of a change is extrapolated linearly from the gaps at the two samples on its open side.
    pub(super) fn changes(&self, motion: &Motion, k: usize, stride: usize) -> Vec<Change> {
        if !self.vary() {
            return Vec::new();
        }
        let samples = self.field_of_sample.len();
        let gap = |sample: usize| &self.gaps[self.field_of_sample[sample % samples]];
        let [before, from, to] = [k + samples - stride, k, k + stride];
        let [earlier, step, later] =
            [before, from, to].map(|sample| motion.load_change(sample, stride));
        let [gap_before, gap_from, gap_to, gap_after] = [before, from, to, to + stride].map(gap);
        let (limit_from, limit_to) = (self.at(from), self.at(to));
        // Returns the open fraction of the step. The gap is `near` at the sample next to the change, and
        // `far` one step further away.
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

/// Returns the factor on the tolerance of a step under the friction limits at its end \[Pa\]. Near the friction
/// capacity, only a few cells stick. Because these few cells determine the displacement under a prescribed force, small
/// errors of the solve cause large errors of the displacement. `tolerance_factor` returns 1 without a prescribed force.
pub(super) fn tolerance_factor(driven: &Step, limit: &[f64], cell_area: f64) -> f64 {
    let forces = driven.drive.iter().map(|drive| match drive {
        Drive::Force(force) => force * force,
        Drive::Displacement(_) => 0.0,
    });
    let force = forces.sum::<f64>().sqrt();
    if force == 0.0 {
        return 1.0;
    }
    let reserve = 1.0 - force / (limit.iter().sum::<f64>() * cell_area);
    (reserve / FULL_TOLERANCE_RESERVE).clamp(SMALLEST_TOLERANCE_FACTOR, 1.0)
}

impl FrettingJoint {
    /// Computes the friction limits over the cycle on a surface worn by `wear`. The static contact of the worn surface
    /// at the mean load is `contact`. Each distinct load is solved once. If `store_contacts` is true and the load
    /// varies, `limits_over_cycle` also stores the pressure and the gap under each load.
    pub(super) fn limits_over_cycle(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        store_contacts: bool,
    ) -> Result<FrictionLimits, WearError> {
        let samples = self.motion.samples();
        let mut limits = FrictionLimits {
            fields: Vec::new(),
            gaps: Vec::new(),
            contacts: store_contacts.then(Vec::new),
            field_of_sample: (0..samples).collect(),
        };
        if self.local_contacts(contact, |joint, solution| limits.add(joint, solution))? {
            return Ok(limits);
        }
        if self.motion.constant_load() {
            let limit = self.limit(&contact.pressure);
            return Ok(FrictionLimits::constant(limit, samples));
        }
        let mut loads: Vec<f64> = Vec::new();
        let mut pressure = contact.pressure.clone();
        for (k, &load) in self.motion.normal_load.clone().iter().enumerate() {
            let same = |before: &f64| (before - load).abs() <= EQUALITY_TOLERANCE * load.abs();
            limits.field_of_sample[k] = match loads.iter().position(same) {
                Some(field) => field,
                None => {
                    let solution = self.contact(wear, None, load, Some(&pressure))?;
                    limits.add(self, &solution);
                    pressure = solution.pressure;
                    loads.push(load);
                    loads.len() - 1
                }
            };
        }
        Ok(limits)
    }
}
