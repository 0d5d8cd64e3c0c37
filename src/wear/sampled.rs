//! The steady cycle of any motion, sample by sample.
//!
//! A cycle is marched twice, over every other sample until it closes and from there over all of them: the change between the two
//! estimates what the samples leave. A step takes the slip along the shear at its end. Where the motion stays on a line that is of
//! second order in the step, as is the mean of the limits where these vary. Where the motion turns it is of first order, and slip
//! path and energy of each cell are extrapolated to steps of no length, which makes it second.

use super::cycle::{CycleSolution, Instant, Tally, found};
use super::joint::{FrettingJoint, WearError};
use super::motion::Channel;
use crate::contact::normal::NormalSolution;
use crate::grid::ByAxis;

/// Cycles after which a motion that has not closed is given up.
const MAX_CYCLES: usize = 60;

/// Cycles without a halved change of shear, after which it is what the solves' own errors make of it, and the energy decides.
const PATIENCE: usize = 10;

/// What extrapolation leaves, of second order, in parts of what half of the samples change, of first order: this over the samples.
/// Measured on orbits with 16 to 128 samples, it is 4 to 8 over them.
const LEFT_EXTRAPOLATED: f64 = 10.0;
/// The least of that part where the load varies: cells come into contact and begin to slide between samples, at any number of them.
const LEAST: f64 = 0.25;
/// Along a line, in the same parts. Measured as 0.3 to 1.0.
const LEFT: f64 = 1.0;

/// Part of what a cell slips and dissipates that extrapolation leaves it at least: where half of the samples change it by more, it is
/// not yet of first order, and to take all of it would be to say that the cell sticks.
const LEAST_EXTRAPOLATED: f64 = 0.5;

/// Half of fewer samples has no inside.
const FEWEST: usize = 8;

/// A cycle that closed.
struct Closed {
    tally: Tally,
    shear: ByAxis<Vec<f64>>,
    instants: Vec<Instant>,
}

impl FrettingJoint {
    /// Marches sample by sample until the cycle closes. An odd number of samples, fewer than 8, and any without
    /// [`FrettingOptions::extrapolate`](super::joint::FrettingOptions::extrapolate) are marched once.
    pub(super) fn by_samples(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<CycleSolution, WearError> {
        let limits = self.limits_over_cycle(wear, contact)?;
        let cell_area = self.patch.grid.cell_area();
        let mut closed;
        let samples = self.motion.samples();
        if self.options.extrapolate && samples.is_multiple_of(2) && samples >= FEWEST {
            let coarse = self.closed(&limits, 2, start)?;
            closed = self.closed(&limits, 1, Some(&coarse.shear))?;
            let turns = self.motion.turns();
            let left = match LEFT_EXTRAPOLATED / samples as f64 {
                _ if !turns => LEFT,
                part if limits.len() == 1 => part,
                part => part.max(LEAST),
            };
            compare(&mut closed.tally, &coarse.tally, turns, left * cell_area);
        } else {
            closed = self.closed(&limits, 1, start)?;
        }
        self.about_their_middle(&mut closed.instants);
        Ok(closed
            .tally
            .finish(cell_area, closed.shear, closed.instants))
    }

    /// Marches every `stride`-th sample, cycle after cycle, until one closes: in its shear, or, where that does not get on any more, in
    /// the energy that the change of shear would dissipate.
    fn closed(
        &mut self,
        limits: &[Vec<f64>],
        stride: usize,
        start: Option<&ByAxis<Vec<f64>>>,
    ) -> Result<Closed, WearError> {
        let samples = self.motion.samples();
        let limit = |k: usize| &limits[k % limits.len()];
        let mut shear = match start {
            Some(shear) => within(shear, limit(0)),
            None => {
                let first = self.motion.at(0);
                let zero = vec![0.0; first.len()];
                self.step(limit(0), None, [&zero, &first], None)?.shear
            }
        };
        let largest = limits.iter().flatten().fold(0.0f64, |m, v| m.max(*v));
        let (mut best, mut since) = (f64::INFINITY, 0);
        for _ in 0..MAX_CYCLES {
            let mut tally = Tally::new(self.patch.grid.len());
            let begin = shear.clone();
            let mut instants = Vec::with_capacity(samples / stride + 1);
            // Where force or moment is given, the place is the sum of what was found.
            let mut place = self.motion.at(0);
            for (place, channel) in place.iter_mut().zip(self.motion.channels()) {
                if channel.is_force() {
                    *place = 0.0;
                }
            }
            for k in (0..samples).step_by(stride) {
                let next = k + stride;
                let (from, to) = (self.motion.at(k), self.motion.at(next));
                let step = self.step(limit(next), Some(&shear), [&from, &to], None)?;
                let varying = limits.len() > 1;
                let ends = varying.then(|| [limit(k), limit(next)].map(Vec::as_slice));
                tally.add(&step, 1.0, ends);
                let moves = to.iter().zip(found(&step)).zip(self.motion.channels());
                for (place, ((to, change), channel)) in place.iter_mut().zip(moves) {
                    *place = match channel {
                        Channel::Displacement(_) => *to,
                        Channel::Force(_) => *place + change,
                    };
                }
                let axes = step.force.len();
                instants.push(Instant {
                    time: self.motion.time_of(next),
                    displacement: place[..axes].to_vec(),
                    normal_load: self.motion.normal_load[next % samples],
                    force: step.force,
                    torsion: self
                        .motion
                        .rotation
                        .as_ref()
                        .map(|_| [place[axes], step.moment]),
                });
                shear = step.shear;
            }
            let moved = change(&shear, &begin);
            let most = moved.iter().fold(0.0, |m: f64, v| m.max(*v));
            since += 1;
            if most <= 0.5 * best {
                (best, since) = (most, 0);
            }
            // What slips in the cycle slips under a shear that is not yet steady.
            let unsteady = moved.iter().zip(&tally.slip_path).map(|(q, s)| q * s);
            let unsteady = unsteady.sum::<f64>();
            let tolerance = self.options.cycle_tolerance;
            let closed = most <= tolerance * largest;
            let settled = !closed
                && since >= PATIENCE
                && unsteady <= tolerance * tally.energy.iter().sum::<f64>();
            if closed || settled {
                let last = instants
                    .last()
                    .cloned()
                    .map(|last| Instant { time: 0.0, ..last });
                instants.splice(0..0, last);
                // A change that has not halved in so many cycles may go on for as many.
                let cycles = if settled { PATIENCE as f64 } else { 1.0 };
                tally.dissipation_error += cycles * unsteady * self.patch.grid.cell_area();
                return Ok(Closed {
                    tally,
                    shear,
                    instants,
                });
            }
        }
        Err(WearError::NotSteady {
            cycles: MAX_CYCLES,
            tolerance: self.options.cycle_tolerance,
        })
    }

    /// Shifts displacements that were found, and are known up to a constant, to the middle of their range.
    fn about_their_middle(&self, instants: &mut [Instant]) {
        let shift = |instants: &mut [Instant], value: fn(&mut Instant, usize) -> &mut f64, k| {
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            for instant in instants.iter_mut() {
                let value = *value(instant, k);
                (least, most) = (least.min(value), most.max(value));
            }
            for instant in instants.iter_mut() {
                *value(instant, k) -= 0.5 * (least + most);
            }
        };
        for (axis, channel) in self.motion.drive.iter().enumerate() {
            if channel.is_force() {
                shift(
                    instants,
                    |instant, axis| &mut instant.displacement[axis],
                    axis,
                );
            }
        }
        if self.motion.rotation.as_ref().is_some_and(Channel::is_force) {
            let rotation: fn(&mut Instant, usize) -> &mut f64 =
                |instant, _| &mut instant.torsion.as_mut().expect("a rotation is driven")[0];
            shift(instants, rotation, 0);
        }
    }

    /// Friction limits at every sample, or one for all where the load is constant.
    fn limits_over_cycle(
        &mut self,
        wear: &[f64],
        contact: &NormalSolution,
    ) -> Result<Vec<Vec<f64>>, WearError> {
        if let Some(limits) = self.limits_by_place(contact)? {
            return Ok(limits);
        }
        if self.motion.constant_load() {
            return Ok(vec![self.limit(&contact.pressure)]);
        }
        let mut limits = Vec::with_capacity(self.motion.samples());
        let mut pressure = contact.pressure.clone();
        for k in 0..self.motion.samples() {
            pressure = self
                .contact(wear, None, self.motion.normal_load[k], Some(&pressure))?
                .pressure;
            limits.push(self.limit(&pressure));
        }
        Ok(limits)
    }
}

/// Estimates what the samples leave as `left` of what half of them change \[m²\], and takes slip path and energy of a motion that
/// turns to steps of no length.
fn compare(tally: &mut Tally, coarse: &Tally, turns: bool, left: f64) {
    let changes = tally.energy.iter().zip(&coarse.energy);
    let change = changes.map(|(fine, coarse)| (fine - coarse).abs());
    let left = left * change.sum::<f64>();
    tally.steps += coarse.steps;
    tally.error = tally.error.max(coarse.error);
    if turns {
        // The errors of the solves are amplified as the energies are.
        tally.dissipation_error = 2.0 * tally.dissipation_error + coarse.dissipation_error;
        for (fine, coarse) in [
            (&mut tally.energy, &coarse.energy),
            (&mut tally.slip_path, &coarse.slip_path),
        ] {
            for (fine, coarse) in fine.iter_mut().zip(coarse) {
                *fine = (2.0 * *fine - coarse).max(LEAST_EXTRAPOLATED * *fine);
            }
        }
    }
    tally.dissipation_error += left;
}

/// Size of the change of shear on every cell \[Pa\].
fn change(shear: &ByAxis<Vec<f64>>, before: &ByAxis<Vec<f64>>) -> Vec<f64> {
    let cells = shear.first().map_or(0, Vec::len);
    (0..cells)
        .map(|c| {
            let axes = shear.iter().zip(before);
            axes.map(|(a, b)| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
        })
        .collect()
}

/// Shears cut back to their limits, direction kept.
fn within(shear: &ByAxis<Vec<f64>>, limit: &[f64]) -> ByAxis<Vec<f64>> {
    let mut cut = shear.clone();
    for (c, &limit) in limit.iter().enumerate() {
        let size = cut.iter().map(|q| q[c] * q[c]).sum::<f64>().sqrt();
        if size > limit {
            for q in &mut cut {
                q[c] *= limit / size;
            }
        }
    }
    cut
}
