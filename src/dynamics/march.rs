//! The march of a slider from the preload to its steady cycle, and the derivative of that cycle.
//!
//! Where the march closes slowly, the steady cycle is the fixed point of the force over one cycle, found by Newton's method; it is
//! that of the march as long as the slider slips in it.

use super::aft::{Closure, Derivative, Scratch};
use super::slider::{self, Dual, FrictionLaw, INPUTS, MEMORY, Number, Slider, Step};

/// Cycles marched one after the other. The memory of most motions is gone after one; a slider that slips by much less than it
/// stretches forgets a force across its motion over hundreds, and from here on its steady cycle is looked for.
const PLAIN_CYCLES: usize = 4;
/// Cycles at most until the steady one is found.
const MOST_CYCLES: usize = 2000;
/// A guess of the steady force is taken if it changes over a cycle by less than this share of the change before.
const BETTER: f64 = 0.8;
/// Change of the force over a cycle, relative to its largest value, at which the cycle is steady: rounding over its samples.
const STEADY: f64 = 1e-12;

/// Difference of two forces, relative to the largest, up to which they are one: rounding of a step.
const SAME: f64 = 1e-14;

/// Determinant of 1 − A below which a cycle forgets nothing; that of a force which decays over 1e5 cycles is larger.
const FORGETS: f64 = 1e-6;

/// A slider over the samples of a cycle.
pub(super) struct March<'a> {
    pub(super) slider: &'a Slider,
    pub(super) friction: f64,
    pub(super) law: FrictionLaw,
    pub(super) displacement: &'a [[f64; 3]],
    /// Whether it is one of several. Much is then saved by what differs from the march of one alone in rounding: where its
    /// cycles meet they are not followed on, and the derivative is that of the fixed point.
    pub(super) is_of_bank: bool,
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
    /// Largest force.
    largest: f64,
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
    /// From the preload to the steady cycle: the forces of its samples in `scratch`; their derivatives are added to those of others.
    pub(super) fn run(
        &self,
        derivative: Option<&mut Derivative<'_>>,
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
        steady.closure
    }

    /// The steady cycle of the displacements that end in `last`.
    fn steady(&self, last: [f64; 3], force: &mut [[f64; 2]]) -> Steady {
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        let mut before = None;
        for cycle in 1..=PLAIN_CYCLES {
            let lap = match before {
                Some(before) if self.is_of_bank => self.lap_after(before, from, force),
                _ => self.lap(start, from, force),
            };
            // Without slip the next cycle is this one; after the first, the start was the preload rather than a cycle.
            let closure = lap.closure(cycle, start);
            if closure.change == 0.0 || cycle > 1 && closure.change <= STEADY {
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
        }
        self.settle(start, last, force)
    }

    /// The steady cycle near the force `start` at its beginning.
    fn settle(&self, mut start: [f64; 2], last: [f64; 3], force: &mut [[f64; 2]]) -> Steady {
        let mut cycle = PLAIN_CYCLES;
        // After a guess that was none, so many cycles are marched before the next.
        let (mut wait, mut patience) = (0_usize, 1_usize);
        loop {
            let (lap, map) = if wait > 0 {
                (self.lap(start, last, force), None)
            } else {
                self.lap_with_memory(start, last, force)
            };
            cycle += 1;
            let closure = lap.closure(cycle, start);
            if closure.change <= STEADY || cycle >= MOST_CYCLES {
                return Steady {
                    start,
                    plain: PLAIN_CYCLES,
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
                // the one that the march leads to.
                [1.0, 0.5, 0.25].into_iter().find_map(|share| {
                    let guess = [before[0] + share * jump[0], before[1] + share * jump[1]];
                    let there = self.lap(guess, last, force);
                    cycle += 1;
                    let left = [there.end[0] - guess[0], there.end[1] - guess[1]];
                    let better = slider::magnitude(left) <= BETTER * slider::magnitude(change);
                    (!there.stuck && better).then_some(there.end)
                })
            });
            match guess {
                Some(end) => (start, patience) = (end, 1),
                None => (wait, patience) = (patience, 2 * patience),
            }
        }
    }

    /// Adds the derivatives of the forces of a steady cycle. That of a fixed point forgets how it was found. Where it remembers, that
    /// of the march is the best there is.
    fn differentiate(
        &self,
        steady: &Steady,
        last: [f64; 3],
        derivative: &mut Derivative<'_>,
        scratch: &mut Scratch,
    ) {
        scratch.tangent.clear();
        scratch.tangent.resize(6 * derivative.coefficients, 0.0);
        if !steady.stuck && (self.is_of_bank || !steady.is_plain) {
            self.lap_with_slopes(steady.start, last, scratch);
            if let Some(map) = unforgotten(memory(&scratch.slopes)) {
                self.propagate(scratch, true, derivative, false);
                let (first, second) = scratch.tangent.split_at_mut(3 * derivative.coefficients);
                for (a, b) in first.iter_mut().zip(second) {
                    let ends = [*a, *b];
                    [*a, *b] = map.map(|row| row[0] * ends[0] + row[1] * ends[1]);
                }
                return self.propagate(scratch, true, derivative, true);
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
        let same = SAME * before.largest;
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            let apart = [next[0] - force[0], next[1] - force[1]];
            if slider::magnitude(apart) <= same {
                return Lap {
                    end: before.end,
                    largest: before.largest,
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
        let mut memory = [[1.0, 0.0], [0.0, 1.0]];
        let lap = self.lap_with(start, from, force, |slope: Slope<MEMORY>| {
            memory = slope.after(memory);
        });
        (lap, unforgotten(memory))
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
        mut tell: impl FnMut(Slope<K>),
    ) -> Lap {
        let (law, kt, mu) = (self.law, self.slider.tangential_stiffness, self.friction);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (mut next, step) = slider::step(law, kt, mu, lap.end, delta, loads);
            // Most steps are sticking ones, whose derivatives are constants.
            tell(match step {
                Step::Open => Slope::Open,
                Step::Stick if loads[0] >= 0.0 => Slope::Stick,
                _ => {
                    let pair = |values: [f64; 2], index: usize| {
                        [
                            Dual::<K>::input(values[0], index),
                            Dual::input(values[1], index + 1),
                        ]
                    };
                    let (force, delta, loads) = (pair(lap.end, 0), pair(delta, 2), pair(loads, 4));
                    let (dual, _) = slider::step(law, kt, mu, force, delta, loads);
                    next = dual.map(Dual::value);
                    Slope::Other(dual.map(|n| n.slope))
                }
            });
            lap.advance(next, step);
            *force = next;
        }
        lap
    }

    /// Carries the tangent of `scratch` over a cycle, which `follows` another or begins at the preload; with `store` the
    /// derivative at every sample is added to `derivative`.
    fn propagate(
        &self,
        scratch: &mut Scratch,
        follows: bool,
        derivative: &mut Derivative<'_>,
        store: bool,
    ) {
        let n = derivative.coefficients;
        let width = 3 * n;
        let (kt, kn) = (
            self.slider.tangential_stiffness,
            self.slider.normal_stiffness,
        );
        let basis = derivative.basis;
        let (first, second) = scratch.tangent.split_at_mut(width);
        for (j, slope) in scratch.slopes.iter().enumerate() {
            let now = &basis[j * n..][..n];
            // Before the first sample there is the preload, on which no coefficient acts.
            let before = match j {
                0 if !follows => None,
                0 => Some(&basis[(scratch.slopes.len() - 1) * n..][..n]),
                _ => Some(&basis[(j - 1) * n..][..n]),
            };
            let before = |c: usize| before.map_or(0.0, |before| before[c]);
            match slope {
                Slope::Open => {
                    first.fill(0.0);
                    second.fill(0.0);
                }
                Slope::Stick => {
                    for c in 0..n {
                        let pull = kt * (now[c] - before(c));
                        first[c] += pull;
                        second[n + c] += pull;
                    }
                }
                Slope::Other([x, y]) => {
                    for (a, b) in first.iter_mut().zip(second.iter_mut()) {
                        (*a, *b) = (x[0] * *a + x[1] * *b, y[0] * *a + y[1] * *b);
                    }
                    for c in 0..n {
                        let (now, before) = (now[c], before(c));
                        let change = now - before;
                        for (row, slope) in [(&mut *first, x), (&mut *second, y)] {
                            row[c] += slope[2] * change;
                            row[n + c] += slope[3] * change;
                            row[2 * n + c] += kn * (slope[4] * before + slope[5] * now);
                        }
                    }
                }
            }
            if store {
                for (d, tangent) in [(0, &*first), (1, &*second)] {
                    let row = derivative.row_mut(j, d).iter_mut();
                    row.zip(tangent).for_each(|(sum, own)| *sum += own);
                }
            }
        }
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
    let none = [[1.0, 0.0], [0.0, 1.0]];
    slopes
        .iter()
        .fold(none, |before, slope| slope.after(before))
}

/// (1 − A)⁻¹ of the [`memory`] A of a cycle; none if it forgets nothing.
fn unforgotten(a: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let m = [[1.0 - a[0][0], -a[0][1]], [-a[1][0], 1.0 - a[1][1]]];
    let determinant = m[0][0] * m[1][1] - m[0][1] * m[1][0];
    (determinant.abs() > FORGETS).then(|| {
        [
            [m[1][1] / determinant, -m[0][1] / determinant],
            [-m[1][0] / determinant, m[0][0] / determinant],
        ]
    })
}

impl Lap {
    /// How well a lap from the force `start` closes.
    fn closure(&self, cycles: usize, start: [f64; 2]) -> Closure {
        let change = slider::magnitude([self.end[0] - start[0], self.end[1] - start[1]]);
        Closure {
            cycles,
            change: if self.stuck || self.largest == 0.0 {
                0.0
            } else {
                change / self.largest
            },
            largest: self.largest,
        }
    }

    fn new(start: [f64; 2]) -> Lap {
        Lap {
            end: start,
            largest: 0.0,
            stuck: true,
        }
    }

    fn advance(&mut self, next: [f64; 2], step: Step) {
        self.end = next;
        self.largest = self.largest.max(slider::magnitude(next));
        self.stuck &= step == Step::Stick;
    }
}
