//! March of a slider from the preload to its steady cycle, and the derivative of that cycle.
//!
//! If the march converges slowly, Newton's method computes the steady cycle as the fixed point of the force over one
//! cycle. The fixed point equals the steady cycle of the march if the slider slips during the steady cycle.

use super::aft::{ForceDerivatives, PeriodicityError, Scratch};
use super::slider::{self, Dual, FrictionLaw, INPUTS, MEMORY, Number, Slider, Step};
use crate::linalg::{add_scaled, vectorised};

/// Largest number of plain cycles, which the slider marches one after the other. Most sliders forget their initial
/// force after one cycle. Some sliders slip by much less than they stretch. Such a slider keeps a force perpendicular
/// to its motion for hundreds of cycles, so Newton's method computes the steady cycle.
const PLAIN_CYCLES: usize = 4;
/// Largest change of the force over the second cycle, divided by the largest force, at which plain cycles continue.
/// Above this limit, Newton's method starts at once. If the second cycle changes the force by the share c, the third
/// cycle changes the force by about c². The fourth cycle changes the force by about c³. For c above the limit, the
/// third and fourth cycles are not steady.
const SLOW: f64 = 1e-4;
/// Largest number of cycles in the search for the steady cycle.
const MOST_CYCLES: usize = 2000;
/// Largest ratio of two changes of the force over a cycle, after and before a guess of the steady force. The march
/// accepts the guess up to this ratio.
const BETTER: f64 = 0.8;
/// Largest change of the force over a steady cycle, divided by the largest force. The limit is the rounding error over
/// the samples of the cycle.
const STEADY: f64 = 1e-12;

/// Largest step to the steady force, divided by the largest force, at which the steady cycle can be without slip. At a
/// smaller step, the march has reached the steady force.
const THERE: f64 = 1e-9;

/// Largest difference of two equal forces, divided by the largest force. The limit is the rounding error of a step.
const SAME: f64 = 1e-14;

/// Smallest determinant of 1 − A for a cycle that forgets its initial force. A force that decays over 1e5 cycles has a
/// larger determinant.
const FORGETS: f64 = 1e-6;
/// Determinant of 1 − A below which Newton's method tries no step to the steady force. The limit is slightly above the
/// rounding of the determinant.
const HARDLY: f64 = 1e-11;

/// Memory of a slider that sticks.
const UNCHANGED: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

/// Slider with the samples of a cycle.
pub(super) struct March<'a> {
    pub(super) slider: &'a Slider,
    pub(super) friction: f64,
    pub(super) law: FrictionLaw,
    pub(super) displacement: &'a [[f64; 3]],
}

/// Steady cycle of the slider.
struct Steady {
    /// Force at the beginning of the steady cycle.
    start: [f64; 2],
    /// Number of plain cycles before the steady cycle. If the steady cycle is a plain cycle, the number includes the
    /// steady cycle.
    plain: usize,
    /// Whether the steady cycle is the last plain cycle.
    is_plain: bool,
    /// Whether the slider neither slips nor opens during the steady cycle.
    stuck: bool,
    closure: PeriodicityError,
}

/// One cycle of the slider.
#[derive(Clone, Copy)]
struct Lap {
    /// Force at the end of the cycle.
    end: [f64; 2],
    /// Square of the largest force.
    largest_square: f64,
    /// Whether the slider neither slipped nor opened during the cycle.
    stuck: bool,
}

/// Derivatives of both forces after a step with respect to its first `K` inputs.
#[derive(Debug, Clone, Copy)]
pub(super) enum Slope<const K: usize = INPUTS> {
    /// The slider is open: all derivatives are zero.
    Open,
    /// The slider sticks: the derivative is 1 for the force before, and k_t for the displacement.
    Stick,
    /// General case.
    Other([[f64; K]; 2]),
}

impl March<'_> {
    /// Computes the steady cycle from the preload, with the forces at the samples of the steady cycle in `scratch`.
    /// Adds the derivatives of the forces to `derivative`, in the form of [`Self::propagate`].
    pub(super) fn run(
        &self,
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> PeriodicityError {
        scratch.force.resize(self.displacement.len(), [0.0; 2]);
        let Some(&last) = self.displacement.last() else {
            return PeriodicityError::EXACT;
        };
        let steady = self.steady(last, &mut scratch.force);
        if let Some(derivative) = derivative {
            self.differentiate(&steady, last, derivative, scratch);
        }
        PeriodicityError { ..steady.closure }
    }

    /// Computes the steady cycle of the displacements that end in `last`.
    fn steady(&self, last: [f64; 3], force: &mut [[f64; 2]]) -> Steady {
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        let (mut before, mut cycle) = (None, 0);
        loop {
            cycle += 1;
            let lap = match before {
                Some(before) => self.lap_after(before, from, force),
                None => self.lap(start, from, force),
            };
            // If the slider does not slip, the next cycle equals the current cycle. The march ignores the change of the
            // first cycle. The first cycle begins at the preload, not at the end of another cycle, even if the forces
            // at both instants are zero.
            let closure = lap.closure(cycle, start);
            if lap.stuck || cycle > 1 && closure.change <= STEADY {
                return Steady {
                    start,
                    plain: cycle,
                    is_plain: true,
                    stuck: lap.stuck,
                    closure,
                };
            }
            (start, from) = (lap.end, last);
            before = Some(lap);
            if cycle == PLAIN_CYCLES || cycle > 1 && closure.change > SLOW {
                return self.settle(cycle, start, last, force);
            }
        }
    }

    /// Computes the steady cycle near the force `start` at its beginning, `plain` cycles after the preload.
    fn settle(
        &self,
        mut plain: usize,
        mut start: [f64; 2],
        last: [f64; 3],
        force: &mut [[f64; 2]],
    ) -> Steady {
        let mut cycle = plain;
        // Whether all cycles so far are plain.
        let mut is_march = true;
        // After a rejected guess, `wait` cycles are marched before the next guess.
        let (mut wait, mut patience) = (0_usize, 1_usize);
        loop {
            let (lap, map) = if wait > 0 {
                (self.lap(start, last, force), None)
            } else {
                self.lap_with_memory(start, last, force)
            };
            if is_march {
                plain = cycle.min(PLAIN_CYCLES);
            }
            cycle += 1;
            let closure = lap.closure(cycle, start);
            if closure.change <= STEADY || cycle >= MOST_CYCLES {
                return Steady {
                    start,
                    plain,
                    is_plain: false,
                    stuck: lap.stuck,
                    closure,
                };
            }
            let change = [lap.end[0] - start[0], lap.end[1] - start[1]];
            start = lap.end;
            if wait > 0 {
                wait -= 1;
                continue;
            }
            let before = [lap.end[0] - change[0], lap.end[1] - change[1]];
            let guess = map.and_then(|map| {
                let jump = map.map(|row| row[0] * change[0] + row[1] * change[1]);
                // If slip is about to end, the full step leads to a cycle without slip. Any force is steady there, but
                // the march leads to another force, unless the two agree to rounding.
                let is_there = slider::magnitude(jump) <= THERE * lap.largest();
                [1.0, 0.5, 0.25].into_iter().find_map(|share| {
                    let guess = [before[0] + share * jump[0], before[1] + share * jump[1]];
                    // A first cycle brings the force back to the curve along which the force drifts. The change of the
                    // force over the second cycle is the drift.
                    let first_lap = self.lap(guess, last, force);
                    let second_lap = self.lap(first_lap.end, last, force);
                    cycle += 2;
                    let drift = [
                        second_lap.end[0] - first_lap.end[0],
                        second_lap.end[1] - first_lap.end[1],
                    ];
                    let better = slider::magnitude(drift) <= BETTER * slider::magnitude(change);
                    let slips = !second_lap.stuck || is_there;
                    (slips && better).then_some((first_lap.end, second_lap))
                })
            });
            match guess {
                Some((guess, second_lap)) => {
                    let closure = second_lap.closure(cycle, guess);
                    if closure.change <= STEADY {
                        return Steady {
                            start: guess,
                            plain,
                            is_plain: false,
                            stuck: second_lap.stuck,
                            closure,
                        };
                    }
                    (start, patience, is_march) = (second_lap.end, 1, false);
                }
                None => (wait, patience) = (patience, 2 * patience),
            }
        }
    }

    /// Adds the derivatives of the forces of a steady cycle in the form of [`Self::propagate`].
    ///
    /// The derivative of a fixed point does not depend on the method that found the fixed point. For a cycle that never
    /// forgets its initial force, the derivative of the march is the best available derivative.
    fn differentiate(
        &self,
        steady: &Steady,
        last: [f64; 3],
        derivative: &mut ForceDerivatives<'_>,
        scratch: &mut Scratch,
    ) {
        let width = 3 * derivative.coefficients;
        scratch.offset.clear();
        scratch.offset.resize(2 * width, 0.0);
        if !steady.stuck {
            self.lap_with_slopes(steady.start, last, scratch);
            if let Some(map) = memory_inverse(memory(&scratch.slopes), FORGETS) {
                // First from zero offset; then adds the effect of the offset at the start, which equals the offset at
                // the end.
                self.propagate(scratch, true, derivative, true);
                let (first, second) = scratch.offset.split_at_mut(width);
                for (a, b) in first.iter_mut().zip(second) {
                    let ends = [*a, *b];
                    [*a, *b] = map.map(|row| row[0] * ends[0] + row[1] * ends[1]);
                }
                return add_start_offset(&scratch.slopes, &scratch.offset, derivative);
            }
        }
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        for cycle in 1..=steady.plain {
            start = self.lap_with_slopes(start, from, scratch).end;
            from = last;
            let is_last = steady.is_plain && cycle == steady.plain;
            self.propagate(scratch, cycle > 1, derivative, is_last);
        }
        if !steady.is_plain {
            self.lap_with_slopes(steady.start, last, scratch);
            self.propagate(scratch, true, derivative, true);
        }
    }

    /// Returns the displacement increment and the normal loads of the step to sample `j`. The cycle starts at the
    /// displacement `from`.
    fn inputs(&self, j: usize, from: [f64; 3]) -> ([f64; 2], [f64; 2]) {
        let before = if j == 0 {
            from
        } else {
            self.displacement[j - 1]
        };
        let now = self.displacement[j];
        (
            [now[0] - before[0], now[1] - before[1]],
            [before, now].map(|u| self.slider.bilateral_load(u[2])),
        )
    }

    fn lap(&self, start: [f64; 2], from: [f64; 3], force: &mut [[f64; 2]]) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            *force = next;
        }
        lap
    }

    /// Computes the lap that follows the lap `before`, up to the sample where both laps have the same force. The slice
    /// `force` contains the forces of the lap `before`. Equal forces stay equal under friction.
    fn lap_after(&self, before: Lap, from: [f64; 3], force: &mut [[f64; 2]]) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(before.end);
        let tolerance = SAME * before.largest();
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            let difference = [next[0] - force[0], next[1] - force[1]];
            if slider::square(difference) <= tolerance * tolerance {
                return Lap {
                    end: before.end,
                    largest_square: before.largest_square,
                    stuck: lap.stuck && before.stuck,
                };
            }
            *force = next;
        }
        lap
    }

    /// Computes one cycle of the slider and the matrix (1 − A)⁻¹ of the cycle, see [`memory_inverse`]. A is the
    /// derivative of the force at the end of the cycle with respect to the force at the start.
    fn lap_with_memory(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 2]],
    ) -> (Lap, Option<[[f64; 2]; 2]>) {
        let mut memory = UNCHANGED;
        let lap = self.lap_with(start, from, force, |slope: Slope<MEMORY>| {
            memory = slope.after(memory);
        });
        (lap, memory_inverse(memory, HARDLY))
    }

    fn lap_with_slopes(&self, start: [f64; 2], from: [f64; 3], scratch: &mut Scratch) -> Lap {
        let Scratch { force, slopes, .. } = scratch;
        slopes.clear();
        self.lap_with(start, from, force, |slope| slopes.push(slope))
    }

    /// Computes a lap and passes the derivatives of each step with respect to its first `K` inputs to `record`.
    fn lap_with<const K: usize>(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 2]],
        record: impl FnMut(Slope<K>),
    ) -> Lap {
        vectorised(
            #[inline(always)]
            || self.lap_recording(start, from, force, record),
        )
    }

    #[inline(always)]
    fn lap_recording<const K: usize>(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 2]],
        mut record: impl FnMut(Slope<K>),
    ) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            // The slider sticks in most steps, and the derivatives of a sticking step are constants.
            let (next, step, slope) =
                match slider::sticking_force(law, kt, mu, lap.end, delta, loads) {
                    Some(next) => (next, Step::Stick, Slope::Stick),
                    None => {
                        let pair = |values: [f64; 2], index: usize| {
                            [
                                Dual::<K>::input(values[0], index),
                                Dual::input(values[1], index + 1),
                            ]
                        };
                        let (force, delta, loads) =
                            (pair(lap.end, 0), pair(delta, 2), pair(loads, 4));
                        let (dual, step) = slider::step(law, kt, mu, force, delta, loads);
                        let slope = match step {
                            Step::Open => Slope::Open,
                            _ => Slope::Other(dual.map(|force| force.slope)),
                        };
                        (dual.map(Dual::value), step, slope)
                    }
                };
            record(slope);
            lap.advance(next, step);
            *force = next;
        }
        lap
    }

    /// Propagates the offset of `scratch` over a cycle. If `follows` is true, the cycle follows another cycle;
    /// otherwise the cycle begins at the preload.
    ///
    /// The offset is the derivative of the forces (x, then y) minus the derivative of a reference slider. The reference
    /// slider sticks from u = 0. The derivative of the reference slider is k_t times the basis functions, and the
    /// contact element adds this derivative. The offset changes only where the slider slips or opens. With `store`, the
    /// function adds each change of the offset to `derivative`, from the sample of the change on. The first change
    /// includes the offset at the start of the cycle.
    fn propagate(
        &self,
        scratch: &mut Scratch,
        follows: bool,
        derivative: &mut ForceDerivatives<'_>,
        store: bool,
    ) {
        vectorised(
            #[inline(always)]
            || self.propagate_offset(scratch, follows, derivative, store),
        );
    }

    #[inline(always)]
    fn propagate_offset(
        &self,
        scratch: &mut Scratch,
        follows: bool,
        derivative: &mut ForceDerivatives<'_>,
        store: bool,
    ) {
        let n = derivative.coefficients;
        let (width, basis) = (3 * n, derivative.basis);
        let (kt, kn) = (
            self.slider.tangential_stiffness,
            self.slider.normal_stiffness,
        );
        let Scratch {
            slopes,
            offset,
            next,
            ..
        } = scratch;
        if store && offset.iter().any(|value| *value != 0.0) {
            add_scaled(derivative.lasting_change(0), 1.0, offset);
        }
        next.clear();
        next.resize(2 * width, 0.0);
        for (j, slope) in slopes.iter().enumerate() {
            let rows = match slope {
                Slope::Stick => continue,
                Slope::Open => &[[0.0; INPUTS]; 2],
                Slope::Other(rows) => rows,
            };
            let now = &basis[j * n..][..n];
            let before = &basis[if j == 0 { slopes.len() - 1 } else { j - 1 } * n..][..n];
            // Before the first sample the slider is at the preload, which no coefficient changes.
            let acts = if j > 0 || follows { 1.0 } else { 0.0 };
            let (first, second) = offset.split_at(width);
            for (d, (row, next)) in rows.iter().zip(next.chunks_exact_mut(width)).enumerate() {
                for e in 0..3 {
                    let (of_before, of_now) = match e {
                        2 => (kn * row[4], kn * row[5]),
                        _ => (
                            kt * row[e] - row[2 + e],
                            row[2 + e] - if d == e { kt } else { 0.0 },
                        ),
                    };
                    let of_before = acts * of_before;
                    let own = first[e * n..][..n].iter().zip(&second[e * n..][..n]);
                    let moving = before.iter().zip(now);
                    let values = next[e * n..][..n].iter_mut().zip(own).zip(moving);
                    for ((next, (a, b)), (before, now)) in values {
                        *next = row[0] * a + row[1] * b + of_before * before + of_now * now;
                    }
                }
            }
            if store {
                let sums = derivative.lasting_change(j).iter_mut();
                for (sum, (next, offset)) in sums.zip(next.iter().zip(&*offset)) {
                    *sum += next - offset;
                }
            }
            std::mem::swap(offset, next);
        }
    }
}

/// Adds the effect of an `offset` at the start of a steady cycle on its derivative, see [`March::propagate`].
fn add_start_offset(slopes: &[Slope], offset: &[f64], derivative: &mut ForceDerivatives<'_>) {
    add_scaled(derivative.lasting_change(0), 1.0, offset);
    let (first, second) = offset.split_at(3 * derivative.coefficients);
    let mut before = UNCHANGED;
    for (j, slope) in slopes.iter().enumerate() {
        if matches!(slope, Slope::Stick) {
            continue;
        }
        let mut after = slope.after(before);
        let is_forgotten = after.as_flattened().iter().all(|m| m.abs() <= f64::EPSILON);
        if is_forgotten {
            after = [[0.0; 2]; 2];
        }
        let rows = derivative.lasting_change(j).chunks_exact_mut(first.len());
        for (sums, (after, before)) in rows.zip(after.iter().zip(before)) {
            let change = [after[0] - before[0], after[1] - before[1]];
            for (sum, (a, b)) in sums.iter_mut().zip(first.iter().zip(second)) {
                *sum += change[0] * a + change[1] * b;
            }
        }
        if is_forgotten {
            return;
        }
        before = after;
    }
}

impl<const K: usize> Slope<K> {
    /// Returns the derivative of the force after the step with respect to an earlier force. The argument `before` is
    /// the derivative of the force before the step.
    fn after(&self, before: [[f64; 2]; 2]) -> [[f64; 2]; 2] {
        match self {
            Slope::Open => [[0.0; 2]; 2],
            Slope::Stick => before,
            Slope::Other([x, y]) => {
                [x, y].map(|row| [0, 1].map(|c| row[0] * before[0][c] + row[1] * before[1][c]))
            }
        }
    }
}

/// Returns the derivative of the force at the end of a cycle with respect to the force at its beginning.
fn memory(slopes: &[Slope]) -> [[f64; 2]; 2] {
    slopes
        .iter()
        .fold(UNCHANGED, |before, slope| slope.after(before))
}

/// Returns (1 − A)⁻¹ for the [`memory`] A of a cycle. Returns `None` if the determinant of 1 − A is at most `least`,
/// because such a cycle never forgets its initial force.
fn memory_inverse(a: [[f64; 2]; 2], least: f64) -> Option<[[f64; 2]; 2]> {
    let m = [[1.0 - a[0][0], -a[0][1]], [-a[1][0], 1.0 - a[1][1]]];
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (determinant.abs() > least).then(|| {
        [
            [m[1][1] / determinant, -m[0][1] / determinant],
            [-m[1][0] / determinant, m[0][0] / determinant],
        ]
    })
}

impl Lap {
    /// Returns the closure of a lap from the force `start`.
    fn closure(&self, cycles: usize, start: [f64; 2]) -> PeriodicityError {
        let largest = self.largest();
        let change = slider::magnitude([self.end[0] - start[0], self.end[1] - start[1]]);
        PeriodicityError {
            cycles,
            change: if self.stuck || largest == 0.0 {
                0.0
            } else {
                change / largest
            },
            largest,
        }
    }

    fn new(start: [f64; 2]) -> Lap {
        Lap {
            end: start,
            largest_square: 0.0,
            stuck: true,
        }
    }

    /// Returns the largest force.
    fn largest(&self) -> f64 {
        self.largest_square.sqrt()
    }

    fn advance(&mut self, next: [f64; 2], step: Step) {
        self.end = next;
        self.largest_square = self.largest_square.max(slider::square(next));
        self.stuck &= step == Step::Stick;
    }
}
