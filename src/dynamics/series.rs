//! Trigonometric polynomials over a cycle: where they fall below zero, and integrals of products of their terms between two instants.

use std::f64::consts::{PI, TAU};

use super::Harmonics;

/// Step off an instant where a function starts from zero \[rad\]: its sign shows there, and what is missed is below rounding.
const BEYOND: f64 = 1e-7;
/// Width below which an interval is not divided any further \[rad\].
const NARROWEST: f64 = 1e-9;
/// Share of the largest value of a function that is rounding of zero.
pub(super) const ROUNDING: f64 = 1e-13;
/// Nodes for each wave of the highest harmonic: between two of them a cubic is off by 1.6 % of its amplitude.
const NODES_PER_WAVE: usize = 4;
/// Derivatives whose roots are looked for, the function itself among them, and one more.
const ORDERS: usize = 4;

/// Instants of a cycle at equal distances, at which polynomials of a set of harmonics are tabled: the library's sines would take most
/// of the time.
pub(super) struct Nodes<'a> {
    pub(super) harmonics: &'a Harmonics,
    /// Cosine and sine at every node.
    circle: Vec<[f64; 2]>,
}

impl<'a> Nodes<'a> {
    pub(super) fn of(harmonics: &'a Harmonics) -> Nodes<'a> {
        let count = NODES_PER_WAVE * (harmonics.highest() as usize + 1);
        let mut circle = Vec::with_capacity(count);
        // A quarter, and the others turned: there is a multiple of four.
        circle.extend((0..count / 4).map(|j| {
            let (sin, cos) = (j as f64 * (TAU / count as f64)).sin_cos();
            [cos, sin]
        }));
        for j in count / 4..count {
            let [cos, sin] = circle[j - count / 4];
            circle.push([-sin, cos]);
        }
        Nodes { harmonics, circle }
    }

    /// Basis functions at an instant, as [`Harmonics::basis`] has them.
    pub(super) fn basis(&self, theta: f64) -> Vec<f64> {
        basis(self.harmonics, Turns::of(theta))
    }
}

/// Basis functions at an instant, as [`Harmonics::basis`] has them but for rounding.
pub(super) fn basis(harmonics: &Harmonics, mut turns: Turns) -> Vec<f64> {
    let mut row = Vec::with_capacity(harmonics.coefficients());
    row.push(1.0);
    for &order in &harmonics.orders()[1..] {
        row.extend(turns.to(order as usize));
    }
    row
}

/// A trigonometric polynomial a₀ + Σ (a_k cos kθ + b_k sin kθ).
#[derive(Clone)]
pub(super) struct Series<'a> {
    nodes: &'a Nodes<'a>,
    pub(super) row: Vec<f64>,
    /// Its values and derivatives at the nodes.
    at_nodes: Vec<[f64; ORDERS]>,
    /// What its values and derivatives are rounded by is a share of these.
    sizes: [f64; ORDERS],
}

impl<'a> Series<'a> {
    pub(super) fn new(nodes: &'a Nodes<'a>, row: Vec<f64>) -> Series<'a> {
        let count = nodes.circle.len();
        let mut at_nodes = vec![[row[0], 0.0, 0.0, 0.0]; count];
        let mut sizes = [row[0].abs(), 0.0, 0.0, 0.0];
        for (k, a, b) in waves(nodes.harmonics, &row) {
            let amplitude = a.hypot(b);
            if amplitude == 0.0 {
                continue;
            }
            let rates = [1.0, k, k * k, k * k * k];
            for (size, rate) in sizes.iter_mut().zip(rates) {
                *size += rate * amplitude;
            }
            let (step, mut place) = (k as usize, 0);
            for node in &mut at_nodes {
                let [cos, sin] = nodes.circle[place];
                let (along, across) = (a * cos + b * sin, b * cos - a * sin);
                node[0] += along;
                node[1] += rates[1] * across;
                node[2] -= rates[2] * along;
                node[3] -= rates[3] * across;
                place += step;
                if place >= count {
                    place -= count;
                }
            }
        }
        Series {
            nodes,
            row,
            at_nodes,
            sizes,
        }
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
        let nodes = self.at_nodes.iter().zip(&other.at_nodes).map(|(a, b)| {
            let mut node: [f64; ORDERS] = std::array::from_fn(|d| own * a[d] + share * b[d]);
            node[0] += constant;
            node
        });
        let mut sizes: [f64; ORDERS] =
            std::array::from_fn(|d| own.abs() * self.sizes[d] + share.abs() * other.sizes[d]);
        sizes[0] += constant.abs();
        Series {
            nodes: self.nodes,
            at_nodes: nodes.collect(),
            row,
            sizes,
        }
    }

    /// With the opposite sign.
    pub(super) fn opposite(&self) -> Series<'a> {
        let negative = |node: &[f64; ORDERS]| node.map(|value| -value);
        Series {
            nodes: self.nodes,
            row: self.row.iter().map(|a| -a).collect(),
            at_nodes: self.at_nodes.iter().map(negative).collect(),
            sizes: self.sizes,
        }
    }

    /// Whether it is zero throughout.
    pub(super) fn is_zero(&self) -> bool {
        self.sizes[0] == 0.0
    }

    pub(super) fn value(&self, theta: f64) -> f64 {
        self.at(0, theta)[0]
    }

    pub(super) fn slope(&self, theta: f64) -> f64 {
        self.at(1, theta)[0]
    }

    /// The derivative of an order, and the next one.
    fn at(&self, order: usize, theta: f64) -> [f64; 2] {
        let mut turns = Turns::of(theta);
        let mut sums = [if order == 0 { self.row[0] } else { 0.0 }, 0.0];
        for (k, a, b) in waves(self.nodes.harmonics, &self.row) {
            let [cos, sin] = turns.to(k as usize);
            let (along, across) = (a * cos + b * sin, b * cos - a * sin);
            let terms = match order {
                0 => [along, k * across],
                1 => [k * across, -k * k * along],
                _ => [-k * k * along, -k * k * k * across],
            };
            sums[0] += terms[0];
            sums[1] += terms[1];
        }
        sums
    }

    /// The sign just after an instant.
    pub(super) fn is_positive_after(&self, theta: f64) -> bool {
        let here = self.value(theta);
        if here.abs() > ROUNDING * self.sizes[0] {
            return here > 0.0;
        }
        self.slope(theta + BEYOND) > 0.0
    }

    /// The first instant after `from`, within the cycle, at which it falls below zero; `from` itself if it does so at once. It starts
    /// from zero or above.
    pub(super) fn first_below_zero(&self, from: f64) -> Option<f64> {
        self.first_fall(0, from)
    }

    /// As [`Self::first_below_zero`], of its derivative.
    pub(super) fn first_slope_below_zero(&self, from: f64) -> Option<f64> {
        self.first_fall(1, from)
    }

    fn first_fall(&self, order: usize, from: f64) -> Option<f64> {
        let rounding = ROUNDING * self.sizes[order];
        let here = self.at(order, from)[0];
        if here > rounding {
            return self.first_root(order, from);
        }
        if here < -rounding {
            return Some(from);
        }
        let off = (from + BEYOND).min(TAU);
        if self.at(order + 1, off)[0] <= 0.0 {
            return (self.sizes[order] > 0.0).then_some(from);
        }
        // It rises from zero: before it can fall below, its derivative does.
        let top = self.first_root(order + 1, off)?;
        if self.at(order, top)[0] <= 0.0 {
            return Some(top);
        }
        self.first_root(order, top)
    }

    /// The first root of a derivative after `from`, where it is positive.
    fn first_root(&self, order: usize, from: f64) -> Option<f64> {
        let count = self.at_nodes.len();
        let width = TAU / count as f64;
        // Bound of the fourth derivative, by which a cubic between two instants may be off.
        let quartic = waves(self.nodes.harmonics, &self.row)
            .map(|(k, a, b)| k.powi(4 + order as i32) * a.hypot(b))
            .sum();
        let piece = Piece {
            of: self,
            order,
            quartic,
        };
        let (mut low, mut at_low) = (from, self.at(order, from));
        for next in (from / width) as usize + 1..=count {
            let high = if next == count {
                TAU
            } else {
                next as f64 * width
            };
            let node = &self.at_nodes[next % count];
            let at_high = [node[order], node[order + 1]];
            if high > low {
                let root = piece.root_between([low, high], [at_low, at_high]);
                if root.is_some() {
                    return root;
                }
            }
            (low, at_low) = (high, at_high);
        }
        None
    }
}

/// Order, cosine and sine coefficient of every harmonic of a row but the mean.
fn waves<'b>(
    harmonics: &'b Harmonics,
    row: &'b [f64],
) -> impl Iterator<Item = (f64, f64, f64)> + 'b {
    let pairs = row[1..].chunks_exact(2);
    let orders = harmonics.orders()[1..].iter();
    orders
        .zip(pairs)
        .map(|(&order, pair)| (f64::from(order), pair[0], pair[1]))
}

/// A derivative of a polynomial, between two instants a cubic of its values and slopes there but for a remainder.
struct Piece<'a> {
    of: &'a Series<'a>,
    order: usize,
    /// Bound of the fourth derivative.
    quartic: f64,
}

impl Piece<'_> {
    /// The first root between two instants, positive at the first; ends are values and slopes.
    fn root_between(&self, [a, b]: [f64; 2], [fa, fb]: [[f64; 2]; 2]) -> Option<f64> {
        let width = b - a;
        // The remainder of the cubic, then √3/216 for its slope, in the third of the width that makes differences of slopes.
        let remainder = self.quartic * width.powi(4) / 384.0;
        // The cubic lies among its Bernstein coefficients, its derivative among their differences.
        let third = width / 3.0;
        let middles = [fa[0] + fa[1] * third, fb[0] - fb[1] * third];
        let least = middles[0].min(middles[1]).min(fa[0]).min(fb[0]);
        if least > remainder {
            return None;
        }
        if width <= NARROWEST {
            return (fb[0] <= 0.0).then_some(b);
        }
        let of_slope = self.quartic * width.powi(4) / 374.0;
        let falls = fa[1].max(fb[1]) * third < -of_slope && middles[1] - middles[0] < -of_slope;
        if falls {
            return (fb[0] <= 0.0).then(|| self.solve([a, b], [fa[0], fb[0]]));
        }
        let middle = 0.5 * (a + b);
        let fm = self.of.at(self.order, middle);
        self.root_between([a, middle], [fa, fm])
            .or_else(|| self.root_between([middle, b], [fm, fb]))
    }

    /// The root of a falling piece: Newton's steps between bounds.
    fn solve(&self, [mut a, mut b]: [f64; 2], [fa, fb]: [f64; 2]) -> f64 {
        let rounding = f64::EPSILON * self.of.sizes[self.order];
        let mut theta = (a + (b - a) * fa / (fa - fb)).clamp(a, b);
        for _ in 0..100 {
            let [value, slope] = self.of.at(self.order, theta);
            if value > 0.0 {
                a = theta;
            } else {
                b = theta;
            }
            let next = theta - value / slope;
            let is_bracketed = next >= a && next <= b;
            let next = if is_bracketed { next } else { 0.5 * (a + b) };
            if value.abs() <= rounding || (next - theta).abs() <= 4.0 * f64::EPSILON * b {
                return next;
            }
            theta = next;
        }
        theta
    }
}

/// Cosine and sine of ascending multiples of an angle, each from those before: the library's functions would take most of the time.
#[derive(Clone, Copy)]
pub(super) struct Turns {
    one: [f64; 2],
    now: [f64; 2],
    multiple: usize,
}

impl Turns {
    pub(super) fn of(angle: f64) -> Turns {
        let (sin, cos) = angle.sin_cos();
        Turns {
            one: [cos, sin],
            now: [1.0, 0.0],
            multiple: 0,
        }
    }

    /// Those of a multiple that is not below the one before.
    pub(super) fn to(&mut self, multiple: usize) -> [f64; 2] {
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
