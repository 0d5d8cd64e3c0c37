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

    /// The sum Σ q·r of each free motion.
    pub(super) fn sums(&self, shear: &[Vector<A>]) -> Motions {
        let mut sums = [0.0; MOTIONS];
        for (cell, q) in shear.iter().enumerate() {
            for &(motion, _) in &self.asked {
                sums[motion] += dot(*q, self.motion(motion, cell));
            }
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
    /// c is the minimum of a convex function whose gradient is what the sums exceed, found by Newton's method with steps
    /// halved until it falls.
    pub(super) fn balance(&self, target: &[Vector<A>], limit: &[f64]) -> Option<Motions> {
        let mut at = [0.0; MOTIONS];
        if self.asked.is_empty() {
            return Some(at);
        }
        let largest: f64 = limit.iter().sum();
        let reach = 4.0
            * target
                .iter()
                .zip(limit)
                .fold(0.0f64, |m, (t, l)| m.max(norm(*t)).max(*l));
        let mut now = self.evaluate(&at, target, limit);
        for _ in 0..BALANCE_STEPS {
            if now.off() <= BALANCED * largest {
                return Some(at);
            }
            let mut matrix = now.slope;
            let trace: f64 = (0..MOTIONS).map(|k| matrix[k][k]).sum();
            for (k, row) in matrix.iter_mut().enumerate() {
                row[k] += 1e-9 * trace + 1e-12 * limit.len() as f64;
            }
            let mut step = solve_small(&matrix, &now.lack);
            let size = step.iter().fold(0.0f64, |m, s| m.max(s.abs()));
            if size > reach {
                step = step.map(|s| s * reach / size);
            }
            let mut accepted = false;
            for _ in 0..40 {
                let mut trial = at;
                for k in 0..MOTIONS {
                    trial[k] += step[k];
                }
                let next = self.evaluate(&trial, target, limit);
                // Near the minimum the function is flat to rounding, what is lacking is not.
                if next.value < now.value || next.off() < 0.5 * now.off() {
                    (at, now, accepted) = (trial, next, true);
                    break;
                }
                step = step.map(|s| 0.5 * s);
            }
            if !accepted {
                break;
            }
        }
        (now.off() <= CARRIED * largest).then_some(at)
    }

    fn evaluate(&self, at: &Motions, target: &[Vector<A>], limit: &[f64]) -> Balance {
        let mut balance = Balance::default();
        for &(motion, asked) in &self.asked {
            balance.lack[motion] = asked;
            balance.value -= asked * at[motion];
        }
        for (cell, (target, &limit)) in target.iter().zip(limit).enumerate() {
            let shifted = plus(*target, 1.0, self.field(at, cell));
            let size = norm(shifted);
            let (inside, value) = (size <= limit, limit * (size - 0.5 * limit));
            balance.value += if inside { 0.5 * size * size } else { value };
            let factor = if inside { 1.0 } else { limit / size };
            for &(j, _) in &self.asked {
                let motion = self.motion(j, cell);
                balance.lack[j] -= factor * dot(shifted, motion);
                let mut change = motion;
                if !inside {
                    let out = scaled(1.0 / size, shifted);
                    change = plus(change, -dot(out, motion), out);
                }
                for &(k, _) in &self.asked {
                    balance.slope[j][k] += factor * dot(change, self.motion(k, cell));
                }
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

/// The function that [`Resultants::balance`] minimises, with its derivatives.
#[derive(Default)]
struct Balance {
    value: f64,
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
