//! Rigid motions with a given force or moment, and the projection of a shear onto shears with the given resultants.

use super::vector::{Vector, dot, norm, plus, scaled};

/// Number of rigid motions in a plane: x, y and the rotation.
pub(super) const MOTIONS: usize = 3;

/// Largest difference between two sums of shear that count as equal, divided by the largest sum. `BALANCED` is the
/// rounding error of a sum of about ten thousand terms.
const BALANCED: f64 = 1e-13;

/// Error of the sums, relative to the largest sum, above which friction does not carry the prescribed resultants.
const BALANCE_TOLERANCE: f64 = 1e-10;

/// Bound on the Newton steps of a balance. A dozen is already many.
const BALANCE_STEPS: usize = 80;

/// Bound on the evaluations along one Newton step: more halvings than a double has bits.
const LINE_SEARCH_STEPS: usize = 80;

/// Fraction of the first slope at which a line search stops.
const SLOPE_REDUCTION: f64 = 0.5;

/// Ratio between successive limits if a difficult balance is approached through larger limits.
const LIMITS_APART: f64 = 3.0;

/// Bound on the reweightings in [`Resultants::limit_factor`].
const REWEIGHTINGS: usize = 200;

/// One number per motion; 0 for motions that are not free.
pub(super) type Motions = [f64; MOTIONS];

/// Rigid motions of the cells in contact.
pub(super) struct Resultants<const A: usize> {
    /// Displacement by the rotation at each contact cell, ẑ×r over `length`, if there is a rotation.
    pub(super) rotation: Option<Vec<Vector<A>>>,
    /// Length that converts a rotation into a displacement \[m\].
    pub(super) length: f64,
    /// Sum of the limits over the contact cells, and the largest limit \[Pa\].
    pub(super) limit_sum: f64,
    pub(super) limit_peak: f64,
    /// Free motions, with the sum Σ q·r that each must reach \[Pa\].
    pub(super) required: Vec<(usize, f64)>,
}

impl<const A: usize> Resultants<A> {
    /// Returns the displacement of a contact cell by a unit motion.
    pub(super) fn motion(&self, motion: usize, cell: usize) -> Vector<A> {
        let mut field = [0.0; A];
        match &self.rotation {
            Some(rotation) if motion == MOTIONS - 1 => field = rotation[cell],
            _ => field[motion] = 1.0,
        }
        field
    }

    /// Returns the displacement of a contact cell by the motions in the given amounts.
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

    /// Returns the sum Σ q·r of each free motion.
    pub(super) fn sums(&self, shear: &[Vector<A>]) -> Motions {
        let mut along = [0.0; A];
        for q in shear {
            along = plus(along, 1.0, *q);
        }
        let mut sums = [0.0; MOTIONS];
        for &(motion, _) in &self.required {
            sums[motion] = match &self.rotation {
                Some(rotation) if motion == MOTIONS - 1 => {
                    shear.iter().zip(rotation).map(|(q, r)| dot(*q, *r)).sum()
                }
                _ => along[motion],
            };
        }
        sums
    }

    /// Returns the required sums less the actual ones.
    pub(super) fn deficit(&self, shear: &[Vector<A>]) -> Motions {
        let mut lack = self.sums(shear);
        for &(motion, required) in &self.required {
            lack[motion] = required - lack[motion];
        }
        lack
    }

    /// Returns the largest error of a sum, as a fraction of the sum of the limits.
    pub(super) fn error(&self, shear: &[Vector<A>], limit: &[f64]) -> f64 {
        if self.required.is_empty() || limit.is_empty() {
            return 0.0;
        }
        let lack = self.deficit(shear);
        let largest: f64 = limit.iter().sum();
        lack.iter().fold(0.0f64, |m, l| m.max(l.abs())) / largest
    }

    /// Finds the amounts c of the rigid motions r. The shears `target` + Σ c r, clipped to the discs, must have the
    /// required sums. The amounts c turn the projection into the discs into a projection onto shears with the required
    /// sums. Returns `None` if friction does not carry the sums.
    ///
    /// c minimises a convex function whose gradient is the excess of the sums. Newton's method with a line search finds
    /// the minimum. If the targets are far beyond the limits, the slope of the convex function changes in jumps. For
    /// such targets, the search approaches the minimum through larger limits, with equally enlarged sums.
    pub(super) fn balance(&self, target: &[Vector<A>], limit: &[f64]) -> Option<Motions> {
        if self.required.is_empty() {
            return Some([0.0; MOTIONS]);
        }
        let (amounts, error) = self.minimise([0.0; MOTIONS], 1.0, target, limit);
        let largest = self.limit_sum;
        if error <= BALANCE_TOLERANCE * largest {
            return Some(amounts);
        }
        let peak = self.limit_peak;
        let reach = target.iter().fold(peak, |m, t| m.max(norm(*t)));
        let mut factor = reach / peak;
        let mut amounts = [0.0; MOTIONS];
        loop {
            let (next, error) = self.minimise(amounts, factor, target, limit);
            amounts = next;
            if factor == 1.0 {
                return (error <= BALANCE_TOLERANCE * largest).then_some(amounts);
            }
            factor = (factor / LIMITS_APART).max(1.0);
        }
    }

    /// Finds the minimum for limits and sums times `factor`, starting from `amounts`. Returns the minimum and the error
    /// of the sums at the minimum.
    fn minimise(
        &self,
        mut amounts: Motions,
        factor: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> (Motions, f64) {
        let largest = factor * self.limit_sum;
        let mut reach = None;
        let mut current = self.evaluate(&amounts, factor, target, limit);
        for _ in 0..BALANCE_STEPS {
            if current.largest_error() <= BALANCED * largest {
                break;
            }
            let mut matrix = current.slope;
            let trace: f64 = (0..MOTIONS).map(|k| matrix[k][k]).sum();
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] += 1e-9 * trace + 1e-12 * limit.len() as f64;
            }
            let mut step = solve_small(&matrix, &current.lack);
            let size = step.iter().fold(0.0f64, |m, s| m.max(s.abs()));
            // Limit the step to a few times the farthest target. A short step needs no search for that target.
            if size > factor * self.limit_peak {
                let reach = *reach.get_or_insert_with(|| {
                    let peak = factor * self.limit_peak;
                    4.0 * target.iter().fold(peak, |m, t| m.max(norm(*t)))
                });
                if size > reach {
                    step = step.map(|s| s * reach / size);
                }
            }
            let Some((next, value)) =
                self.line_search(amounts, step, &current, factor, target, limit)
            else {
                break;
            };
            (amounts, current) = (next, value);
        }
        (amounts, current.largest_error())
    }

    /// Follows `step` until the convex function of [`Self::balance`] hardly decreases. If the targets are far beyond
    /// the limits, the slope of the function changes in jumps. Because of the jumps, the search first brackets the
    /// minimum, and then bisects the bracket. Returns `None` if rounding ends the search.
    fn line_search(
        &self,
        start: Motions,
        step: Motions,
        current: &Balance,
        factor: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> Option<(Motions, Balance)> {
        let descent =
            |balance: &Balance| (0..MOTIONS).map(|k| balance.lack[k] * step[k]).sum::<f64>();
        let first = descent(current);
        let (mut low, mut high, mut part) = (0.0, f64::INFINITY, 1.0);
        for _ in 0..LINE_SEARCH_STEPS {
            let trial: Motions = std::array::from_fn(|k| start[k] + part * step[k]);
            let next = self.evaluate(&trial, factor, target, limit);
            let remaining = descent(&next);
            if remaining.abs() <= SLOPE_REDUCTION * first
                || next.largest_error() <= SLOPE_REDUCTION * current.largest_error()
            {
                return Some((trial, next));
            }
            if remaining > 0.0 {
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
        amounts: &Motions,
        limit_scale: f64,
        target: &[Vector<A>],
        limit: &[f64],
    ) -> Balance {
        let along = self.along_axes(amounts);
        let mut sums = [0.0; MOTIONS];
        let mut slope = [[0.0; MOTIONS]; MOTIONS];
        // If a target is inside the disc, the shear changes like the target. If a target is outside the disc, the
        // clipped shear changes only along the circle. The change of the clipped shear is `factor` times the change of
        // the target orthogonal to `out`.
        let mut inside = 0.0;
        for (cell, (target, limit)) in target.iter().zip(limit).enumerate() {
            let limit = limit_scale * limit;
            let mut shifted = plus(*target, 1.0, along);
            let rotation = self.rotation.as_ref().map(|rotation| rotation[cell]);
            if let Some(rotation) = rotation {
                shifted = plus(shifted, amounts[MOTIONS - 1], rotation);
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
        for &(j, required) in &self.required {
            balance.lack[j] = limit_scale * required - sums[j];
            for &(k, _) in &self.required {
                balance.slope[j][k] = slope[j][k];
            }
            if j < A {
                balance.slope[j][j] += inside;
            }
        }
        balance
    }

    /// Returns the largest factor on the required sums at which friction still carries the sums. The factor is the
    /// minimum of Σ µp |Σ u r| under the condition Σ u·required = 1. Reweighted least squares compute the minimum.
    pub(super) fn limit_factor(&self, limit: &[f64]) -> f64 {
        let mut required = [0.0; MOTIONS];
        for &(motion, sum) in &self.required {
            required[motion] = sum;
        }
        let normal = |amounts: Motions| {
            let along: f64 = (0..MOTIONS).map(|k| amounts[k] * required[k]).sum();
            amounts.map(|a| a / along)
        };
        let mut amounts = normal(required);
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
                for &(j, _) in &self.required {
                    for &(k, _) in &self.required {
                        matrix[j][k] += weight * dot(self.motion(j, cell), self.motion(k, cell));
                    }
                }
            }
            if value >= least * (1.0 - 1e-12) {
                break;
            }
            least = value;
            amounts = normal(solve_small(&matrix, &required));
        }
        least
    }
}

/// Negative gradient and second derivatives of the function that [`Resultants::balance`] minimises.
#[derive(Default)]
struct Balance {
    /// Required sums less the actual ones: the negative gradient.
    lack: Motions,
    slope: [[f64; MOTIONS]; MOTIONS],
}

impl Balance {
    fn largest_error(&self) -> f64 {
        self.lack.iter().fold(0.0f64, |m, l| m.max(l.abs()))
    }
}

/// Solves a symmetric positive semi-definite system. Unknowns that the matrix does not determine become 0.
pub(super) fn solve_small(matrix: &[[f64; MOTIONS]; MOTIONS], right: &Motions) -> Motions {
    let (mut m, mut b) = (*matrix, *right);
    let mut is_determined = [false; MOTIONS];
    for k in 0..MOTIONS {
        // The remaining diagonal is zero, up to rounding, if the motion depends on the motions before it.
        is_determined[k] = m[k][k] > 1e-13 * matrix[k][k] && m[k][k] > 0.0;
        if !is_determined[k] {
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
    for k in (0..MOTIONS).rev().filter(|&k| is_determined[k]) {
        let above: f64 = (k + 1..MOTIONS).map(|j| m[k][j] * x[j]).sum();
        x[k] = (b[k] - above) / m[k][k];
    }
    x
}
