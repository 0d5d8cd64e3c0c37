//! The march of a slider from the preload to its steady cycle, and the derivative of that cycle.
//!
//! Where the march closes slowly, the steady cycle is the fixed point of the force over one cycle, found by Newton's method; it is
//! that of the march as long as the slider slips in it.

use super::aft::{Closure, ForceDerivatives, Scratch};
use super::slider::{self, Dual, FrictionLaw, INPUTS, MEMORY, Number, Slider, Step};
use crate::linalg::{add_scaled, vectorised};

/// Cycles marched one after the other, at most. The memory of most motions is gone after one; a slider that slips by much less than it
/// stretches forgets a force across its motion over hundreds, and from here on its steady cycle is looked for.
const PLAIN_CYCLES: usize = 4;
/// Change of the force over the second cycle, relative to its largest value, from which the steady cycle is looked for at once: what a
/// cycle leaves of it is about its square, and its cube, so that no plain cycle would be steady.
const SLOW: f64 = 1e-4;
/// Cycles at most until the steady one is found.
const MOST_CYCLES: usize = 2000;
/// A guess of the steady force is taken if it changes over a cycle by less than this share of the change before.
const BETTER: f64 = 0.8;
/// Change of the force over a cycle, relative to its largest value, at which the cycle is steady: rounding over its samples.
const STEADY: f64 = 1e-12;

/// Step to the steady force, relative to the largest, after which it may be without slip: it is where the march comes to rest.
const THERE: f64 = 1e-9;

/// Difference of two forces, relative to the largest, up to which they are one: rounding of a step.
const SAME: f64 = 1e-14;

/// Determinant of 1 − A below which a cycle forgets nothing; that of a force which decays over 1e5 cycles is larger.
const FORGETS: f64 = 1e-6;
/// Determinant of 1 − A below which no step to the steady force is tried: a little above rounding.
const HARDLY: f64 = 1e-11;

/// The memory of a slider that sticks.
const UNCHANGED: [[f64; 2]; 2] = [[1.0, 0.0], [0.0, 1.0]];

/// A slider over the samples of a cycle.
pub(super) struct March<'a> {
    pub(super) slider: &'a Slider,
    pub(super) friction: f64,
    pub(super) law: FrictionLaw,
    pub(super) displacement: &'a [[f64; 3]],
}

/// A steady cycle of the slider.
struct Steady {
    /// Force at its beginning.
    start: [f64; 2],
    /// Cycles marched one after the other before it, or to it if it is one of them.
    plain: usize,
    /// Whether it is the last of those.
    is_plain: bool,
    /// Whether it neither slips nor opens.
    stuck: bool,
    closure: Closure,
}

/// One cycle of the slider.
#[derive(Clone, Copy)]
struct Lap {
    /// Force at its end.
    end: [f64; 2],
    /// Square of the largest force.
    largest_square: f64,
    /// Whether it neither slipped nor opened.
    stuck: bool,
}

/// Derivatives of both forces after a step with respect to its first `K` inputs.
#[derive(Debug, Clone, Copy)]
pub(super) enum Slope<const K: usize = INPUTS> {
    /// None: there is no force.
    Open,
    /// The force before, and k_t times the displacement.
    Stick,
    /// All there are.
    Other([[f64; K]; 2]),
}

impl March<'_> {
    /// From the preload to the steady cycle: the forces of its samples in `scratch`; their derivatives are added to those of others in the
    /// form of [`Self::propagate`].
    pub(super) fn run(
        &self,
        derivative: Option<&mut ForceDerivatives<'_>>,
        scratch: &mut Scratch,
    ) -> Closure {
        scratch.force.resize(self.displacement.len(), [0.0; 2]);
        let Some(&last) = self.displacement.last() else {
            return Closure::EXACT;
        };
        let steady = self.steady(last, &mut scratch.force);
        if let Some(derivative) = derivative {
            self.differentiate(&steady, last, derivative, scratch);
        }
        Closure { ..steady.closure }
    }

    /// The steady cycle of the displacements that end in `last`.
    fn steady(&self, last: [f64; 3], force: &mut [[f64; 2]]) -> Steady {
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        let (mut before, mut cycle) = (None, 0);
        loop {
            cycle += 1;
            let lap = match before {
                Some(before) => self.lap_after(before, from, force),
                None => self.lap(start, from, force),
            };
            // Without slip the next cycle is this one. The first begins at the preload rather than where a cycle ends, even if it ends
            // without force as it began.
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

    /// The steady cycle near the force `start` at its beginning, `plain` cycles after the preload.
    fn settle(
        &self,
        mut plain: usize,
        mut start: [f64; 2],
        last: [f64; 3],
        force: &mut [[f64; 2]],
    ) -> Steady {
        let mut cycle = plain;
        // Whether all cycles so far were marched one after the other.
        let mut is_march = true;
        // After a guess that was none, so many cycles are marched before the next.
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
                // Where slip is about to end, the whole way leads to where there is none: any force is steady there, but it is not
                // the one that the march leads to, unless they are the same to rounding.
                let is_there = slider::magnitude(jump) <= THERE * lap.largest();
                [1.0, 0.5, 0.25].into_iter().find_map(|share| {
                    let guess = [before[0] + share * jump[0], before[1] + share * jump[1]];
                    // A cycle brings the force back to the curve along which it drifts: only then is its change that of the drift.
                    let back = self.lap(guess, last, force);
                    let there = self.lap(back.end, last, force);
                    cycle += 2;
                    let left = [there.end[0] - back.end[0], there.end[1] - back.end[1]];
                    let better = slider::magnitude(left) <= BETTER * slider::magnitude(change);
                    let slips = !there.stuck || is_there;
                    (slips && better).then_some((back.end, there))
                })
            });
            match guess {
                Some((guess, there)) => {
                    let closure = there.closure(cycle, guess);
                    if closure.change <= STEADY {
                        return Steady {
                            start: guess,
                            plain,
                            is_plain: false,
                            stuck: there.stuck,
                            closure,
                        };
                    }
                    (start, patience, is_march) = (there.end, 1, false);
                }
                None => (wait, patience) = (patience, 2 * patience),
            }
        }
    }

    /// Adds the derivatives of the forces of a steady cycle in the form of [`Self::propagate`]. That of a fixed point forgets how it was
    /// found. Where it remembers, that of the march is the best there is.
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
            if let Some(map) = unforgotten(memory(&scratch.slopes), FORGETS) {
                // From no offset; then what the offset at the start, which is the one at the end, adds to it.
                self.propagate(scratch, true, derivative, true);
                let (first, second) = scratch.offset.split_at_mut(width);
                for (a, b) in first.iter_mut().zip(second) {
                    let ends = [*a, *b];
                    [*a, *b] = map.map(|row| row[0] * ends[0] + row[1] * ends[1]);
                }
                return remember(&scratch.slopes, &scratch.offset, derivative);
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

    /// Displacement increment and normal loads of the step to sample `j` of a cycle that starts at the displacement `from`.
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

    /// The lap after another, whose forces are in `force`, up to where both are the same: friction never brings forces apart.
    fn lap_after(&self, before: Lap, from: [f64; 3], force: &mut [[f64; 2]]) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(before.end);
        let same = SAME * before.largest();
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            let apart = [next[0] - force[0], next[1] - force[1]];
            if slider::square(apart) <= same * same {
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

    /// A lap, and (1 − A)⁻¹ of it, see [`unforgotten`].
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
        (lap, unforgotten(memory, HARDLY))
    }

    fn lap_with_slopes(&self, start: [f64; 2], from: [f64; 3], scratch: &mut Scratch) -> Lap {
        let Scratch { force, slopes, .. } = scratch;
        slopes.clear();
        self.lap_with(start, from, force, |slope| slopes.push(slope))
    }

    /// A lap that tells the derivatives of each step with respect to its first `K` inputs.
    fn lap_with<const K: usize>(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 2]],
        tell: impl FnMut(Slope<K>),
    ) -> Lap {
        vectorised(
            #[inline(always)]
            || self.lap_telling(start, from, force, tell),
        )
    }

    #[inline(always)]
    fn lap_telling<const K: usize>(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 2]],
        mut tell: impl FnMut(Slope<K>),
    ) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            // Most steps are sticking ones, whose derivatives are constants.
            let (next, step, slope) = match slider::held(law, kt, mu, lap.end, delta, loads) {
                Some(next) => (next, Step::Stick, Slope::Stick),
                None => {
                    let pair = |values: [f64; 2], index: usize| {
                        [
                            Dual::<K>::input(values[0], index),
                            Dual::input(values[1], index + 1),
                        ]
                    };
                    let (force, delta, loads) = (pair(lap.end, 0), pair(delta, 2), pair(loads, 4));
                    let (dual, step) = slider::step(law, kt, mu, force, delta, loads);
                    let slope = match step {
                        Step::Open => Slope::Open,
                        _ => Slope::Other(dual.map(|force| force.slope)),
                    };
                    (dual.map(Dual::value), step, slope)
                }
            };
            tell(slope);
            lap.advance(next, step);
            *force = next;
        }
        lap
    }

    /// Carries the offset of `scratch` over a cycle, which `follows` another or begins at the preload.
    ///
    /// The offset is the derivative of the forces, x then y, less that of a slider that sticks from u = 0 on: k_t times the basis
    /// functions, which its element adds. It changes only where the slider slips or opens. With `store` its changes are added
    /// to `derivative` from the samples on where they happen, the first with the offset at the start.
    fn propagate(
        &self,
        scratch: &mut Scratch,
        follows: bool,
        derivative: &mut ForceDerivatives<'_>,
        store: bool,
    ) {
        vectorised(
            #[inline(always)]
            || self.carry(scratch, follows, derivative, store),
        );
    }

    #[inline(always)]
    fn carry(
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
            add_scaled(derivative.persistent_derivatives(0), 1.0, offset);
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
            // Before the first sample there is the preload, on which no coefficient acts.
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
                let sums = derivative.persistent_derivatives(j).iter_mut();
                for (sum, (next, offset)) in sums.zip(next.iter().zip(&*offset)) {
                    *sum += next - offset;
                }
            }
            std::mem::swap(offset, next);
        }
    }
}

/// Adds what an `offset` at the start of a steady cycle adds to its derivative, see [`March::propagate`].
fn remember(slopes: &[Slope], offset: &[f64], derivative: &mut ForceDerivatives<'_>) {
    add_scaled(derivative.persistent_derivatives(0), 1.0, offset);
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
        let rows = derivative
            .persistent_derivatives(j)
            .chunks_exact_mut(first.len());
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
    /// The derivative of the force with respect to an earlier one, from that of the force before the step.
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

/// The derivative of the force at the end of a cycle with respect to that at its beginning.
fn memory(slopes: &[Slope]) -> [[f64; 2]; 2] {
    slopes
        .iter()
        .fold(UNCHANGED, |before, slope| slope.after(before))
}

/// (1 − A)⁻¹ of the [`memory`] A of a cycle; none if its determinant is not above `least`, so that it forgets nothing.
fn unforgotten(a: [[f64; 2]; 2], least: f64) -> Option<[[f64; 2]; 2]> {
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
    /// How well a lap from the force `start` closes.
    fn closure(&self, cycles: usize, start: [f64; 2]) -> Closure {
        let largest = self.largest();
        let change = slider::magnitude([self.end[0] - start[0], self.end[1] - start[1]]);
        Closure {
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

    /// Largest force.
    fn largest(&self) -> f64 {
        self.largest_square.sqrt()
    }

    fn advance(&mut self, next: [f64; 2], step: Step) {
        self.end = next;
        self.largest_square = self.largest_square.max(slider::square(next));
        self.stuck &= step == Step::Stick;
    }
}
