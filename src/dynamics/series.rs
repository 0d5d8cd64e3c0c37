//! Trigonometric polynomials over a cycle: where they fall below zero, and integrals of products of their terms between two instants.

use std::f64::consts::{PI, TAU};

use super::Harmonics;

/// Step off an instant where a function starts from zero \[rad\]: its sign shows there, and what is missed is below rounding.
const BEYOND: f64 = 1e-7;
/// Width below which an interval is not divided any further \[rad\].
const NARROWEST: f64 = 1e-9;
/// Share of the largest value of a function that is rounding of zero.
pub(super) const ROUNDING: f64 = 1e-13;

/// A trigonometric polynomial a₀ + Σ (a_k cos kθ + b_k sin kθ).
#[derive(Clone)]
pub(super) struct Series<'a> {
    harmonics: &'a Harmonics,
    pub(super) row: Vec<f64>,
    /// Bounds of its values and of its second derivative.
    pub(super) size: f64,
    curvature: f64,
}

impl<'a> Series<'a> {
    pub(super) fn new(harmonics: &'a Harmonics, row: Vec<f64>) -> Series<'a> {
        let (mut size, mut curvature) = (row[0].abs(), 0.0);
        for (index, &order) in harmonics.orders().iter().enumerate().skip(1) {
            let slot = harmonics.slot(index);
            let amplitude = row[slot].hypot(row[slot + 1]);
            size += amplitude;
            curvature += f64::from(order).powi(2) * amplitude;
        }
        Series {
            harmonics,
            row,
            size,
            curvature,
        }
    }

    pub(super) fn times(&self, factor: f64) -> Series<'a> {
        Series::new(
            self.harmonics,
            self.row.iter().map(|a| factor * a).collect(),
        )
    }

    /// `own` times this, `share` times another, and a constant.
    pub(super) fn combined(
        &self,
        own: f64,
        other: &Series<'_>,
        share: f64,
        constant: f64,
    ) -> Series<'a> {
        let pairs = self.row.iter().zip(&other.row);
        let mut row: Vec<f64> = pairs.map(|(a, b)| own * a + share * b).collect();
        row[0] += constant;
        let mut sum = Series::new(self.harmonics, row);
        // What cancels leaves its rounding.
        sum.size = own.abs() * self.size + share.abs() * other.size + constant.abs();
        sum
    }

    pub(super) fn derivative(&self) -> Series<'a> {
        Series::new(self.harmonics, self.harmonics.derivative(&self.row, 1.0))
    }

    pub(super) fn value(&self, theta: f64) -> f64 {
        let mut turns = Turns::of(theta);
        let mut sum = self.row[0];
        for (index, &order) in self.harmonics.orders().iter().enumerate().skip(1) {
            let slot = self.harmonics.slot(index);
            let [cos, sin] = turns.to(order as usize);
            sum += self.row[slot] * cos + self.row[slot + 1] * sin;
        }
        sum
    }

    /// The sign just after an instant.
    pub(super) fn is_positive_after(&self, theta: f64) -> bool {
        let rounding = ROUNDING * self.size;
        let here = self.value(theta);
        if here.abs() > rounding {
            return here > 0.0;
        }
        let slope = self.derivative().value(theta + BEYOND);
        slope > 0.0
    }

    /// The first instant after `from`, within the cycle, at which it falls below zero; `from` itself if it does so at once. It starts
    /// from zero or above.
    pub(super) fn first_below_zero(&self, from: f64) -> Option<f64> {
        let (here, rounding) = (self.value(from), ROUNDING * self.size);
        if here > rounding {
            return self.first_root(from);
        }
        if here < -rounding {
            return Some(from);
        }
        let derivative = self.derivative();
        let off = (from + BEYOND).min(TAU);
        if derivative.value(off) <= 0.0 {
            return (self.size > 0.0).then_some(from);
        }
        // It rises from zero: before it can fall below, its derivative does.
        let top = derivative.first_root(off)?;
        if self.value(top) <= 0.0 {
            return Some(top);
        }
        self.first_root(top)
    }

    /// The first root after `from`, where it is positive.
    fn first_root(&self, from: f64) -> Option<f64> {
        let pieces = 4 * self.harmonics.highest() as usize + 4;
        let width = TAU / pieces as f64;
        let (mut low, mut at_low) = (from, self.value(from));
        while low < TAU {
            let high = (low + width).min(TAU);
            let at_high = self.value(high);
            if let Some(root) = self.root_between([low, high], [at_low, at_high]) {
                return Some(root);
            }
            (low, at_low) = (high, at_high);
        }
        None
    }

    /// The first root between two instants, positive at the first.
    fn root_between(&self, [a, b]: [f64; 2], [fa, fb]: [f64; 2]) -> Option<f64> {
        let width = b - a;
        // The chord, and what the curvature may take from it.
        let sag = 0.125 * self.curvature * width * width;
        if fa > sag && fb > sag {
            return None;
        }
        if width <= NARROWEST {
            return (fb <= 0.0).then_some(b);
        }
        let chord = (fb - fa) / width;
        if fb <= 0.0 && chord.abs() > 0.5 * self.curvature * width {
            // It falls throughout: one root.
            return Some(self.bisect([a, b], [fa, fb]));
        }
        let middle = 0.5 * (a + b);
        let fm = self.value(middle);
        if let Some(root) = self.root_between([a, middle], [fa, fm]) {
            return Some(root);
        }
        self.root_between([middle, b], [fm, fb])
    }

    /// The root of a falling piece, by regula falsi with halved weights (Illinois).
    fn bisect(&self, [mut a, mut b]: [f64; 2], [mut fa, mut fb]: [f64; 2]) -> f64 {
        let mut last = 0;
        for _ in 0..100 {
            if b - a <= 4.0 * f64::EPSILON * b || fb == 0.0 {
                break;
            }
            let middle = (a + (b - a) * fa / (fa - fb)).clamp(a, b);
            let value = self.value(middle);
            if value > 0.0 {
                if last == 1 {
                    fb *= 0.5;
                }
                (a, fa, last) = (middle, value, 1);
            } else {
                if last == -1 {
                    fa *= 0.5;
                }
                if value == 0.0 {
                    return middle;
                }
                (b, fb, last) = (middle, value, -1);
            }
            if a >= b {
                break;
            }
        }
        b
    }
}

/// Cosine and sine of ascending multiples of an angle, each from those before: the library's functions would take most of the time.
struct Turns {
    one: [f64; 2],
    now: [f64; 2],
    multiple: usize,
}

impl Turns {
    fn of(angle: f64) -> Turns {
        let (sin, cos) = angle.sin_cos();
        Turns {
            one: [cos, sin],
            now: [1.0, 0.0],
            multiple: 0,
        }
    }

    /// Those of a multiple that is not below the one before.
    fn to(&mut self, multiple: usize) -> [f64; 2] {
        while self.multiple < multiple {
            let ([c, s], [cos, sin]) = (self.now, self.one);
            self.now = [c * cos - s * sin, s * cos + c * sin];
            self.multiple += 1;
        }
        self.now
    }
}

/// ∫ b_c b_e dθ between two instants, in the weights that make coefficients of it.
pub(super) struct Products {
    values: Vec<f64>,
    means: Vec<f64>,
    n: usize,
}

impl Products {
    pub(super) fn over(harmonics: &Harmonics, from: f64, to: f64) -> Products {
        let n = harmonics.coefficients();
        let most = 2 * harmonics.highest() as usize;
        // ∫ cos mθ and ∫ sin mθ, by products that do not cancel over short pieces.
        let (half, middle) = (0.5 * (to - from), 0.5 * (to + from));
        let (mut halves, mut middles) = (Turns::of(half), Turns::of(middle));
        let mut waves = vec![[to - from, 0.0]];
        waves.extend((1..=most).map(|m| {
            let width = 2.0 * halves.to(m)[1] / m as f64;
            let [cos, sin] = middles.to(m);
            [width * cos, width * sin]
        }));
        let orders = harmonics.orders();
        // Of every coefficient its order, and whether it is that of a sine.
        let kinds: Vec<(i64, bool)> = orders
            .iter()
            .flat_map(|&order| [(i64::from(order), false), (i64::from(order), true)])
            .filter(|kind| *kind != (0, true))
            .collect();
        let cos = |m: i64| waves[m.unsigned_abs() as usize][0];
        let sin = |m: i64| m.signum() as f64 * waves[m.unsigned_abs() as usize][1];
        let mut values = Vec::with_capacity(n * n);
        let mut means = Vec::with_capacity(n);
        for &(k, is_sine) in &kinds {
            let weight = if k == 0 { 0.5 / PI } else { 1.0 / PI };
            means.push(weight * if is_sine { sin(k) } else { cos(k) });
            for &(l, other) in &kinds {
                let product = match (is_sine, other) {
                    (false, false) => cos(k - l) + cos(k + l),
                    (true, true) => cos(k - l) - cos(k + l),
                    (true, false) => sin(k + l) + sin(k - l),
                    (false, true) => sin(k + l) - sin(k - l),
                };
                values.push(0.5 * weight * product);
            }
        }
        Products { values, means, n }
    }

    pub(super) fn row(&self, c: usize) -> &[f64] {
        &self.values[c * self.n..][..self.n]
    }

    /// ∫ b_c dθ, weighted.
    pub(super) fn mean(&self, c: usize) -> f64 {
        self.means[c]
    }
}
