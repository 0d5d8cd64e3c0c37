//! The rigid motions whose force or moment is given, and the nearest shear that carries them.

use super::vector::{Vector, dot, norm, plus, scaled};

/// Most rigid motions in a plane: x, y and the rotation.
pub(super) const MOTIONS: usize = 3;

/// Sums of shear within this part of the largest sum are equal: rounding of some ten thousand terms.
const BALANCED: f64 = 1e-13;

/// Sums this far from what is asked, as a part of the largest sum, are not carried.
const CARRIED: f64 = 1e-10;

/// Bound on the Newton steps of a balance; a dozen is much.
const BALANCE_STEPS: usize = 80;

/// Evaluations along a step of it: more halvings than a double has bits.
const LINE_SEARCH_STEPS: usize = 80;

/// The part of the first slope at which the function is flat enough along a step.
const FLAT: f64 = 0.5;

/// Ratio of the limits through which a balance that is hard is approached.
const LIMITS_APART: f64 = 3.0;

/// Reweightings in search of the limit.
const REWEIGHTINGS: usize = 200;

/// One number a motion; those of motions that are not free stay 0.
pub(super) type Motions = [f64; MOTIONS];

/// The motions of the cells in contact.
pub(super) struct Resultants<const A: usize> {
    /// The rotation at each contact cell, ẑ×r over `length`, where there is one.
    pub(super) rotation: Option<Vec<Vector<A>>>,
    /// What makes a rotation a displacement \[m\].
    pub(super) length: f64,
    /// Sum of the limits over the contact cells, and the largest \[Pa\].
    pub(super) limit_sum: f64,
    pub(super) limit_peak: f64,
    /// The free motions, with the sum Σ q·r that each must have \[Pa\].
    pub(super) asked: Vec<(usize, f64)>,
}

impl<const A: usize> Resultants<A> {
    /// The displacement field of a motion at a contact cell.
    pub(super) fn motion(&self, motion: usize, cell: usize) -> Vector<A> {
        let mut field = [0.0; A];
        match &self.rotation {
            Some(rotation) if motion == MOTIONS - 1 => field = rotation[cell],
            _ => field[motion] = 1.0,
        }
        field
    }

    /// Σ of the motions in the given amounts at a contact cell.
    pub(super) fn field(&self, amounts: &Motions, cell: usize) -> Vector<A> {
        let mut field = [0.0; A];
        field.copy_from_slice(&amounts[..A]);
        match &self.rotation {
            Some(rotation) => plus(field, amounts[MOTIONS - 1], rotation[cell]),
            None => field,
        }
    }

    /// Adds the motions in the given amounts to a field on the contact cells.
    pub(super) fn add(&self, amounts: &Motions, field: &mut [Vector<A>]) {
        let along = self.along_axes(amounts);
        match &self.rotation {
            None => {
                for value in field {
                    *value = plus(*value, 1.0, along);
                }
            }
            Some(rotation) => {
                for (value, turned) in field.iter_mut().zip(rotation) {
                    *value = plus(plus(*value, 1.0, along), amounts[MOTIONS - 1], *turned);
                }
            }
        }
    }

    fn along_axes(&self, amounts: &Motions) -> Vector<A> {
        std::array::from_fn(|axis| amounts[axis])
    }

    /// The sum Σ q·r of each free motion.
    pub(super) fn sums(&self, shear: &[Vector<A>]) -> Motions {
        let mut along = [0.0; A];
        for q in shear {
            along = plus(along, 1.0, *q);
        }
        let mut sums = [0.0; MOTIONS];
        for &(motion, _) in &self.asked {
            sums[motion] = match &self.rotation {
                Some(rotation) if motion == MOTIONS - 1 => {
                    shear.iter().zip(rotation).map(|(q, r)| dot(*q, *r)).sum()
                }
                _ => along[motion],
            };
        }
        sums
    }

    /// What the sums lack.
    pub(super) fn lack(&self, shear: &[Vector<A>]) -> Motions {
        let mut lack = self.sums(shear);
        for &(motion, asked) in &self.asked {
            lack[motion] = asked - lack[motion];
        }
        lack
    }

    /// Largest part of the limit that the sums lack.
    pub(super) fn error(&self, shear: &[Vector<A>], limit: &[f64]) -> f64 {
        if self.asked.is_empty() || limit.is_empty() {
            return 0.0;
        }
        let lack = self.lack(shear);
        let largest: f64 = limit.iter().sum();
        lack.iter().fold(0.0f64, |m, l| m.max(l.abs())) / largest
    }

    /// The amounts c such that the shears `target` + Σ c r, moved into their discs, have the sums asked for: what makes the
    /// projection into the discs one onto shears of those sums. None where friction does not carry them.
    ///
    /// c is the minimum of a convex function whose gradient is what the sums exceed, found by Newton's method with a
    /// search along each step. Where the targets are far beyond the limits, the function has edges in place of curves and the
    /// minimum is approached through larger limits, and sums as much larger.
    pub(super) fn balance(&self, target: &[Vector<A>], limit: &[f64]) -> Option<Motions> {
        if self.asked.is_empty() {
            return Some([0.0; MOTIONS]);
        }
        let (at, off) = self.minimise([0.0; MOTIONS], 1.0, target, limit);
        let largest = self.limit_sum;
        if off <= CARRIED * largest {
            return Some(at);
        }
        let peak = self.limit_peak;
        let reach = target.iter().fold(peak, |m, t| m.max(norm(*t)));
        let mut factor = reach / peak;
        let mut at = [0.0; MOTIONS];
        loop {
            let (next, off) = self.minimise(at, factor, target, limit);
            at = next;
            if factor == 1.0 {
                return (off <= CARRIED * largest).then_some(at);
            }
            factor = (factor / LIMITS_APART).max(1.0);
        }
    }

    /// The minimum for limits and sums times `factor`, from `at`, and by how much its sums are off.
    fn minimise(
        &self,
        mut at: Motions,
        factor: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> (Motions, f64) {
        let largest = factor * self.limit_sum;
        let mut reach = None;
        let mut now = self.evaluate(&at, factor, target, limit);
        for _ in 0..BALANCE_STEPS {
            if now.off() <= BALANCED * largest {
                break;
            }
            let mut matrix = now.slope;
            let trace: f64 = (0..MOTIONS).map(|k| matrix[k][k]).sum();
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] += 1e-9 * trace + 1e-12 * limit.len() as f64;
            }
            let mut step = solve_small(&matrix, &now.lack);
            let size = step.iter().fold(0.0f64, |m, s| m.max(s.abs()));
            // No farther than some times the farthest target; a short step need not look for it.
            if size > factor * self.limit_peak {
                let reach = *reach.get_or_insert_with(|| {
                    let peak = factor * self.limit_peak;
                    4.0 * target.iter().fold(peak, |m, t| m.max(norm(*t)))
                });
                if size > reach {
                    step = step.map(|s| s * reach / size);
                }
            }
            let Some((next, value)) = self.along(at, step, &now, factor, target, limit) else {
                break;
            };
            (at, now) = (next, value);
        }
        (at, now.off())
    }

    /// Where the function has all but stopped to fall along `step`. Its slope there is a staircase of narrow flights when the
    /// targets are far beyond the limits: it is bracketed, then halved. None where rounding ends the search.
    fn along(
        &self,
        at: Motions,
        step: Motions,
        now: &Balance,
        factor: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> Option<(Motions, Balance)> {
        let fall = |balance: &Balance| (0..MOTIONS).map(|k| balance.lack[k] * step[k]).sum::<f64>();
        let first = fall(now);
        let (mut low, mut high, mut part) = (0.0, f64::INFINITY, 1.0);
        for _ in 0..LINE_SEARCH_STEPS {
            let trial: Motions = std::array::from_fn(|k| at[k] + part * step[k]);
            let next = self.evaluate(&trial, factor, target, limit);
            let left = fall(&next);
            if left.abs() <= FLAT * first || next.off() <= FLAT * now.off() {
                return Some((trial, next));
            }
            if left > 0.0 {
                low = part;
            } else {
                high = part;
            }
            part = if high.is_finite() {
                0.5 * (low + high)
            } else {
                2.0 * part
            };
        }
        None
    }

    fn evaluate(
        &self,
        at: &Motions,
        enlarged: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> Balance {
        let along = self.along_axes(at);
        let mut sums = [0.0; MOTIONS];
        let mut slope = [[0.0; MOTIONS]; MOTIONS];
        // A shear in its disc moves with the target, one on its circle only along it: by `factor` times what is across `out`.
        let mut inside = 0.0;
        for (cell, (target, limit)) in target.iter().zip(limit).enumerate() {
            let limit = enlarged * limit;
            let mut shifted = plus(*target, 1.0, along);
            let rotation = self.rotation.as_ref().map(|rotation| rotation[cell]);
            if let Some(rotation) = rotation {
                shifted = plus(shifted, at[MOTIONS - 1], rotation);
            }
            let square = dot(shifted, shifted);
            let (mut factor, mut out) = (1.0, [0.0; A]);
            if square <= limit * limit {
                inside += 1.0;
            } else {
                let inverse = 1.0 / square.sqrt();
                factor = limit * inverse;
                out = scaled(inverse, shifted);
                for u in 0..A {
                    slope[u][u] += factor;
                    for v in 0..A {
                        slope[u][v] -= factor * out[u] * out[v];
                    }
                }
            }
            for u in 0..A {
                sums[u] += factor * shifted[u];
            }
            if let Some(rotation) = rotation {
                sums[MOTIONS - 1] += factor * dot(shifted, rotation);
                let across = plus(rotation, -dot(out, rotation), out);
                for u in 0..A {
                    slope[u][MOTIONS - 1] += factor * across[u];
                    slope[MOTIONS - 1][u] += factor * across[u];
                }
                slope[MOTIONS - 1][MOTIONS - 1] += factor * dot(across, rotation);
            }
        }
        let mut balance = Balance::default();
        for &(j, asked) in &self.asked {
            balance.lack[j] = enlarged * asked - sums[j];
            for &(k, _) in &self.asked {
                balance.slope[j][k] = slope[j][k];
            }
            if j < A {
                balance.slope[j][j] += inside;
            }
        }
        balance
    }

    /// The largest factor on the sums asked for that friction carries: the least of Σ µp |Σ u r| over Σ u·asked = 1, by
    /// reweighted least squares.
    pub(super) fn limit_factor(&self, limit: &[f64]) -> f64 {
        let mut asked = [0.0; MOTIONS];
        for &(motion, sum) in &self.asked {
            asked[motion] = sum;
        }
        let normal = |amounts: Motions| {
            let along: f64 = (0..MOTIONS).map(|k| amounts[k] * asked[k]).sum();
            amounts.map(|a| a / along)
        };
        let mut amounts = normal(asked);
        let mut least = f64::INFINITY;
        for _ in 0..REWEIGHTINGS {
            let mut matrix = [[0.0; MOTIONS]; MOTIONS];
            let mut value = 0.0;
            let largest = (0..limit.len())
                .map(|c| norm(self.field(&amounts, c)))
                .fold(0.0, f64::max);
            for (cell, limit) in limit.iter().enumerate() {
                let size = norm(self.field(&amounts, cell));
                value += limit * size;
                let weight = limit / size.max(1e-9 * largest);
                for &(j, _) in &self.asked {
                    for &(k, _) in &self.asked {
                        matrix[j][k] += weight * dot(self.motion(j, cell), self.motion(k, cell));
                    }
                }
            }
            if value >= least * (1.0 - 1e-12) {
                break;
            }
            least = value;
            amounts = normal(solve_small(&matrix, &asked));
        }
        least
    }
}

/// Derivatives of the function that [`Resultants::balance`] minimises.
#[derive(Default)]
struct Balance {
    /// What the sums lack: the negative gradient.
    lack: Motions,
    slope: [[f64; MOTIONS]; MOTIONS],
}

impl Balance {
    fn off(&self) -> f64 {
        self.lack.iter().fold(0.0f64, |m, l| m.max(l.abs()))
    }
}

/// Solves a symmetric positive semi-definite system; unknowns that it does not see are 0.
pub(super) fn solve_small(matrix: &[[f64; MOTIONS]; MOTIONS], right: &Motions) -> Motions {
    let (mut m, mut b) = (*matrix, *right);
    let mut kept = [false; MOTIONS];
    for k in 0..MOTIONS {
        // What is left of a diagonal entry whose motion is, to rounding, one of those before it.
        kept[k] = m[k][k] > 1e-13 * matrix[k][k] && m[k][k] > 0.0;
        if !kept[k] {
            continue;
        }
        let pivot = m[k];
        let value = b[k];
        for row in k + 1..MOTIONS {
            let factor = m[row][k] / pivot[k];
            for (entry, above) in m[row].iter_mut().zip(&pivot) {
                *entry -= factor * above;
            }
            b[row] -= factor * value;
        }
    }
    let mut x = [0.0; MOTIONS];
    for k in (0..MOTIONS).rev().filter(|&k| kept[k]) {
        let above: f64 = (k + 1..MOTIONS).map(|j| m[k][j] * x[j]).sum();
        x[k] = (b[k] - above) / m[k][k];
    }
    x
}
