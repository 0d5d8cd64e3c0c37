//! The march of an element's slider from the preload to its steady cycle, and the derivative of that cycle.
//!
//! Where the march closes slowly, the steady cycle is the fixed point of the force over one cycle, found by Newton's method; it is
//! that of the march as long as the element slips in it.

use super::aft::{Closure, Derivative};
use super::contact_element::ContactElement;
use super::slider::{self, Dual, INPUTS, Number, Step};

/// Cycles marched one after the other. The memory of most motions is gone after one; an element that slips by much less than it
/// stretches forgets a force across its motion over hundreds, and from here on its steady cycle is looked for.
const PLAIN_CYCLES: usize = 4;
/// Cycles at most until the steady one is found.
const MOST_CYCLES: usize = 2000;
/// A guess of the steady force is taken if it changes over a cycle by less than this share of the change before.
const BETTER: f64 = 0.8;
/// Change of the force over a cycle, relative to its largest value, at which the cycle is steady: rounding over its samples.
const STEADY: f64 = 1e-12;

/// Determinant of 1 − A below which a cycle forgets nothing; that of a force which decays over 1e5 cycles is larger.
const FORGETS: f64 = 1e-6;

/// The slider over the samples of a cycle.
pub(super) struct March<'a> {
    pub(super) element: &'a ContactElement,
    pub(super) displacement: &'a [[f64; 3]],
}

/// One cycle of the slider.
struct Lap {
    /// Force at its end.
    end: [f64; 2],
    /// Largest force.
    largest: f64,
    /// Whether it neither slipped nor opened.
    stuck: bool,
}

/// Derivatives of a step: of both forces with respect to its inputs.
type Slopes = [[f64; INPUTS]; 2];

impl March<'_> {
    /// From the preload to the steady cycle, with derivatives.
    pub(super) fn run(
        &self,
        force: &mut [[f64; 3]],
        mut derivative: Option<&mut Derivative<'_>>,
    ) -> Closure {
        let Some(&last) = self.displacement.last() else {
            return Closure::EXACT;
        };
        let mut tangent = vec![0.0; derivative.as_ref().map_or(0, |d| 6 * d.coefficients)];
        let mut slopes = Vec::new();
        let (mut start, mut from) = ([0.0; 2], [0.0; 3]);
        for cycle in 1..=PLAIN_CYCLES {
            let lap = match derivative.as_deref_mut() {
                None => self.lap(start, from, force),
                Some(derivative) => {
                    let lap = self.lap_with_slopes(start, from, force, &mut slopes);
                    self.propagate(&slopes, cycle > 1, &mut tangent, derivative);
                    lap
                }
            };
            // Without slip the next cycle is this one; after the first, the start was the preload rather than a cycle.
            let closure = lap.closure(cycle, start);
            if closure.change == 0.0 || cycle > 1 && closure.change <= STEADY {
                return closure;
            }
            (start, from) = (lap.end, last);
        }
        self.settle(start, last, force, &mut slopes, derivative, tangent)
    }

    /// The steady cycle near the force `start` at its beginning; `tangent` is the derivative of that force.
    fn settle(
        &self,
        mut start: [f64; 2],
        last: [f64; 3],
        force: &mut [[f64; 3]],
        slopes: &mut Vec<Slopes>,
        derivative: Option<&mut Derivative<'_>>,
        mut tangent: Vec<f64>,
    ) -> Closure {
        let mut cycle = PLAIN_CYCLES;
        // After a guess that was none, so many cycles are marched before the next.
        let (mut wait, mut patience) = (0_usize, 1_usize);
        let (lap, closure) = loop {
            let lap = if wait > 0 {
                self.lap(start, last, force)
            } else {
                self.lap_with_slopes(start, last, force, slopes)
            };
            cycle += 1;
            let closure = lap.closure(cycle, start);
            if closure.change <= STEADY || cycle >= MOST_CYCLES {
                break (lap, closure);
            }
            let change = [lap.end[0] - start[0], lap.end[1] - start[1]];
            start = lap.end;
            if wait > 0 {
                wait -= 1;
                continue;
            }
            let before = [lap.end[0] - change[0], lap.end[1] - change[1]];
            let guess = unforgotten(slopes).and_then(|map| {
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
        };
        if let Some(derivative) = derivative {
            self.lap_with_slopes(start, last, force, slopes);
            // The derivative of a fixed point forgets how it was found. Where it remembers, that of the march is the best there is.
            if !lap.stuck
                && let Some(map) = unforgotten(slopes)
            {
                tangent.fill(0.0);
                self.propagate(slopes, true, &mut tangent, derivative);
                let (first, second) = tangent.split_at_mut(3 * derivative.coefficients);
                for (a, b) in first.iter_mut().zip(second) {
                    let ends = [*a, *b];
                    [*a, *b] = map.map(|row| row[0] * ends[0] + row[1] * ends[1]);
                }
            }
            self.propagate(slopes, true, &mut tangent, derivative);
        }
        closure
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
            [before, now].map(|u| self.element.bilateral_load(u[2])),
        )
    }

    fn lap(&self, start: [f64; 2], from: [f64; 3], force: &mut [[f64; 3]]) -> Lap {
        let element = self.element;
        let (kt, mu) = (element.tangential_stiffness, element.friction_coefficient);
        let mut lap = Lap::new(start);
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (next, step) = slider::step(element.law, kt, mu, lap.end, delta, loads);
            lap.advance(next, step);
            (force[0], force[1]) = (next[0], next[1]);
        }
        lap
    }

    fn lap_with_slopes(
        &self,
        start: [f64; 2],
        from: [f64; 3],
        force: &mut [[f64; 3]],
        slopes: &mut Vec<Slopes>,
    ) -> Lap {
        let element = self.element;
        let (kt, mu) = (element.tangential_stiffness, element.friction_coefficient);
        let mut lap = Lap::new(start);
        slopes.clear();
        for (j, force) in force.iter_mut().enumerate() {
            let (delta, loads) = self.inputs(j, from);
            let (plain, step) = slider::step(element.law, kt, mu, lap.end, delta, loads);
            // Most steps are sticking ones, whose derivatives are constants.
            let (next, step) = match step {
                Step::Open => ([Dual::constant(0.0); 2], step),
                Step::Stick if loads[0] >= 0.0 => {
                    let stuck = |d: usize| {
                        let mut slope = [0.0; INPUTS];
                        (slope[d], slope[2 + d]) = (1.0, kt);
                        let value = plain[d];
                        Dual { value, slope }
                    };
                    ([stuck(0), stuck(1)], step)
                }
                _ => {
                    let pair = |values: [f64; 2], index: usize| {
                        [
                            Dual::input(values[0], index),
                            Dual::input(values[1], index + 1),
                        ]
                    };
                    let (force, delta, loads) = (pair(lap.end, 0), pair(delta, 2), pair(loads, 4));
                    slider::step(element.law, kt, mu, force, delta, loads)
                }
            };
            slopes.push(next.map(|n| n.slope));
            let next = next.map(|n| n.value);
            lap.advance(next, step);
            (force[0], force[1]) = (next[0], next[1]);
        }
        lap
    }

    /// Carries the derivative of the force over a cycle and stores it at every sample; `follows`: the cycle follows another.
    fn propagate(
        &self,
        slopes: &[Slopes],
        follows: bool,
        tangent: &mut [f64],
        derivative: &mut Derivative<'_>,
    ) {
        let n = derivative.coefficients;
        let width = 3 * n;
        let kn = self.element.normal_stiffness;
        let nothing = vec![0.0; n];
        for (j, [x, y]) in slopes.iter().enumerate() {
            let (first, second) = tangent.split_at_mut(width);
            for (a, b) in first.iter_mut().zip(second.iter_mut()) {
                (*a, *b) = (x[0] * *a + x[1] * *b, y[0] * *a + y[1] * *b);
            }
            let now = derivative.basis_at(j);
            let before = match j {
                0 if follows => derivative.basis_at(slopes.len() - 1),
                0 => &nothing,
                _ => derivative.basis_at(j - 1),
            };
            // Before the first sample there is the preload, on which no coefficient acts.
            for c in 0..n {
                let change = now[c] - before[c];
                for (row, slope) in [(&mut *first, x), (&mut *second, y)] {
                    row[c] += slope[2] * change;
                    row[n + c] += slope[3] * change;
                    row[2 * n + c] += kn * (slope[4] * before[c] + slope[5] * now[c]);
                }
            }
            derivative.row_mut(j, 0).copy_from_slice(&tangent[..width]);
            derivative.row_mut(j, 1).copy_from_slice(&tangent[width..]);
        }
    }
}

/// (1 − A)⁻¹, with A the derivative of the force at the end of a cycle with respect to that at its beginning; none if a cycle
/// forgets nothing of it.
fn unforgotten(slopes: &[Slopes]) -> Option<[[f64; 2]; 2]> {
    let mut a = [[1.0, 0.0], [0.0, 1.0]];
    for [x, y] in slopes {
        a = [x, y].map(|row| [0, 1].map(|c| row[0] * a[0][c] + row[1] * a[1][c]));
    }
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
