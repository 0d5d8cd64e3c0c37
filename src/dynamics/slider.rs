//! Slider of a contact element, and the force of the slider over one step. The step is exact for a straight
//! displacement and a linear change of the load.
//!
//! The code of the step is generic over the type [`Number`]. The same operations then compute the value and the
//! derivative.

use std::ops::{Add, Div, Mul, Neg, Sub};

/// Largest ratio of the square of the force to the square of the friction limit at which the slider sticks. After a
/// slip step, rounding can put the force slightly above the friction limit.
const ON_LIMIT: f64 = 1.0 + 4.0 * f64::EPSILON;

/// Friction limit of the two tangential forces of an element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrictionLaw {
    /// `|T| ≤ µN`: isotropic, slip along the force.
    #[default]
    Cone,
    /// `|T_x| ≤ µN` and `|T_y| ≤ µN`, independent of each other.
    Box,
}

impl FrictionLaw {
    /// Returns true if friction with the friction limit `limit` \[N\] can balance the tangential force `force` \[N\].
    pub(super) fn contains(self, force: [f64; 2], limit: f64) -> bool {
        match self {
            FrictionLaw::Cone => square(force) <= ON_LIMIT * limit * limit,
            FrictionLaw::Box => force.iter().all(|t| t.abs() <= limit),
        }
    }

    /// Returns the law in symbols, with T the tangential and N the normal force.
    pub fn formula(self) -> &'static str {
        match self {
            FrictionLaw::Cone => "|T| <= mu N",
            FrictionLaw::Box => "|Tx| and |Ty| <= mu N each",
        }
    }
}

/// Spring along the normal that bears only pressure, and a spring in the plane in series with Coulomb friction. All
/// numbers are finite and not negative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slider {
    /// Normal load N₀ at u = 0 \[N\].
    pub normal_load: f64,
    /// Gap g₀ at u = 0 \[m\]; only an unloaded slider has a gap.
    pub gap: f64,
    /// Tangential stiffness k_t \[N/m\].
    pub tangential_stiffness: f64,
    /// Normal stiffness k_n \[N/m\].
    pub normal_stiffness: f64,
}

impl Slider {
    /// Returns the normal load at the normal displacement `u`, negative where the slider is open \[N\].
    pub(super) fn bilateral_load(&self, u: f64) -> f64 {
        self.normal_load + self.normal_stiffness * (u - self.gap)
    }

    /// Returns true if the slider bears load at rest, or as soon as the bodies press the slider.
    pub(super) fn bears_load_at_rest(&self) -> bool {
        self.normal_load > 0.0 || (self.gap == 0.0 && self.normal_stiffness > 0.0)
    }

    /// Returns the tangential stiffness, or 0 without `friction` (µ).
    pub(super) fn effective_tangential_stiffness(&self, friction: f64) -> f64 {
        if friction > 0.0 {
            self.tangential_stiffness
        } else {
            0.0
        }
    }

    /// Returns true if the slider stays in its state at rest at every sample of `displacement`: stuck under load, or
    /// open.
    pub(super) fn follows_reference(
        &self,
        law: FrictionLaw,
        friction: f64,
        displacement: &[[f64; 3]],
    ) -> bool {
        let bears = self.bears_load_at_rest();
        let kt = self.effective_tangential_stiffness(friction);
        displacement.iter().all(|u| {
            let load = self.bilateral_load(u[2]);
            if !bears {
                return load <= 0.0;
            }
            let limit = friction * load;
            load >= 0.0 && law.contains([kt * u[0], kt * u[1]], limit)
        })
    }
}

/// Inputs of a step: force (2), displacement increment (2), normal load before and after.
pub(super) const INPUTS: usize = 6;
/// The first inputs, which are the force before the step.
pub(super) const MEMORY: usize = 2;
/// Largest relative change of the load over a step at which a series computes the logarithmic mean of the load.
const SMALL_CHANGE: f64 = 1e-2;

/// Real number, with or without derivatives.
pub(super) trait Number:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// Creates a constant.
    fn constant(value: f64) -> Self;
    /// Returns the value.
    fn value(self) -> f64;
    /// Returns the square root of a positive number.
    fn sqrt(self) -> Self;
    /// Returns the exponential.
    fn exp(self) -> Self;
    /// Returns the natural logarithm.
    fn ln(self) -> Self;
}

impl Number for f64 {
    fn constant(value: f64) -> f64 {
        value
    }
    fn value(self) -> f64 {
        self
    }
    fn sqrt(self) -> f64 {
        self.sqrt()
    }
    fn exp(self) -> f64 {
        self.exp()
    }
    fn ln(self) -> f64 {
        self.ln()
    }
}

/// Number that depends on a step of the slider. The type also stores the derivatives of the number with respect to the
/// first `K` inputs of the step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Dual<const K: usize> {
    pub(super) value: f64,
    pub(super) slope: [f64; K],
}

impl<const K: usize> Dual<K> {
    /// Creates the input number `index`.
    pub(super) fn input(value: f64, index: usize) -> Self {
        let mut slope = [0.0; K];
        if let Some(slope) = slope.get_mut(index) {
            *slope = 1.0;
        }
        Dual { value, slope }
    }

    #[inline(always)]
    fn chain(self, value: f64, derivative: f64) -> Self {
        Dual {
            value,
            slope: self.slope.map(|s| s * derivative),
        }
    }
}

impl<const K: usize> Add for Dual<K> {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Dual {
            value: self.value + other.value,
            slope: std::array::from_fn(|i| self.slope[i] + other.slope[i]),
        }
    }
}

impl<const K: usize> Sub for Dual<K> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Dual {
            value: self.value - other.value,
            slope: std::array::from_fn(|i| self.slope[i] - other.slope[i]),
        }
    }
}

// The rules of differentiation mix the operations.
#[allow(clippy::suspicious_arithmetic_impl)]
impl<const K: usize> Mul for Dual<K> {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        Dual {
            value: self.value * other.value,
            slope: std::array::from_fn(|i| {
                self.slope[i] * other.value + self.value * other.slope[i]
            }),
        }
    }
}

#[allow(clippy::suspicious_arithmetic_impl)]
impl<const K: usize> Div for Dual<K> {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let (value, share) = (self.value / other.value, other.value.recip());
        Dual {
            value,
            slope: std::array::from_fn(|i| (self.slope[i] - value * other.slope[i]) * share),
        }
    }
}

impl<const K: usize> Neg for Dual<K> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.chain(-self.value, -1.0)
    }
}

impl<const K: usize> Number for Dual<K> {
    fn constant(value: f64) -> Self {
        Dual {
            value,
            slope: [0.0; K],
        }
    }
    fn value(self) -> f64 {
        self.value
    }
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        self.chain(root, 0.5 / root)
    }
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value)
    }
    fn ln(self) -> Self {
        self.chain(self.value.ln(), 1.0 / self.value)
    }
}

/// State of a slider in a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Step {
    Stick,
    Slip,
    Open,
}

/// Computes the tangential force after a step.
///
/// `force` is the force before the step \[N\], `delta` the displacement increment \[m\], `before` and `after` are the
/// normal loads \[N\]. A negative load is the distance from closing times k_n.
#[inline(always)]
pub(super) fn step<T: Number>(
    law: FrictionLaw,
    stiffness: f64,
    friction: f64,
    force: [T; 2],
    delta: [T; 2],
    [before, after]: [T; 2],
) -> ([T; 2], Step) {
    let zero = T::constant(0.0);
    if after.value() <= 0.0 {
        return ([zero; 2], Step::Open);
    }
    // An element that closes within the step grips from the moment of closing.
    let closes = before.value() < 0.0;
    let grip = T::constant(stiffness);
    let (start, pull) = if closes {
        let share = after / (after - before);
        (
            [zero; 2],
            [grip * share * delta[0], grip * share * delta[1]],
        )
    } else {
        (force, [grip * delta[0], grip * delta[1]])
    };
    let trial = [start[0] + pull[0], start[1] + pull[1]];
    let limit = T::constant(friction) * after;
    match law {
        FrictionLaw::Box => {
            let mut step = Step::Stick;
            let clamped = trial.map(|t| {
                if t.value().abs() <= limit.value() {
                    t
                } else {
                    step = Step::Slip;
                    if t.value() > 0.0 { limit } else { -limit }
                }
            });
            (clamped, step)
        }
        FrictionLaw::Cone => {
            if law.contains(trial.map(T::value), limit.value()) {
                return (trial, Step::Stick);
            }
            let limit_before = if closes {
                zero
            } else {
                T::constant(friction) * before
            };
            (slip(start, pull, trial, [limit_before, limit]), Step::Slip)
        }
    }
}

/// Computes the tangential force after a step in which the slider stays closed and sticks. Returns `None` for any other
/// step. The function has the same inputs as [`step`].
pub(super) fn sticking_force(
    law: FrictionLaw,
    stiffness: f64,
    friction: f64,
    force: [f64; 2],
    delta: [f64; 2],
    [before, after]: [f64; 2],
) -> Option<[f64; 2]> {
    let trial = [0, 1].map(|d| force[d] + stiffness * delta[d]);
    (before >= 0.0 && after > 0.0 && law.contains(trial, friction * after)).then_some(trial)
}

/// Returns the length of a force vector. Forces are far from the extreme numbers for which `hypot` would be needed.
pub(super) fn magnitude(force: [f64; 2]) -> f64 {
    square(force).sqrt()
}

/// Returns the square of the length of a force vector. Comparisons use the square, because a square root would be most
/// of the cost of a sticking step.
pub(super) fn square([x, y]: [f64; 2]) -> f64 {
    x * x + y * y
}

/// Computes the force on the limit circle after a step that slips.
///
/// The slider begins to slip after the share s of the step. At this moment, |T| equals the friction limit. During slip,
/// the angle φ between force and motion obeys φ′ = −(k_t |u̇|/µN) sin φ. As a consequence of this equation, tan(φ/2)
/// decays exponentially.
#[inline(always)]
fn slip<T: Number>(start: [T; 2], pull: [T; 2], trial: [T; 2], [before, limit]: [T; 2]) -> [T; 2] {
    let radial = || {
        let size = (trial[0] * trial[0] + trial[1] * trial[1]).sqrt();
        [limit * trial[0] / size, limit * trial[1] / size]
    };
    let path_square = pull[0] * pull[0] + pull[1] * pull[1];
    // Without motion (only the limit shrinks) or without force before, the force has the direction of the trial force.
    let tiny = f64::EPSILON * limit.value();
    if path_square.value() <= tiny * tiny || before.value() <= tiny {
        return radial();
    }
    let growth = limit - before;
    let a = path_square - growth * growth;
    let b = start[0] * pull[0] + start[1] * pull[1] - before * growth;
    let c = start[0] * start[0] + start[1] * start[1] - before * before;
    let discriminant = b * b - a * c;
    if discriminant.value() <= 0.0 {
        return radial();
    }
    let root = discriminant.sqrt();
    // The outward crossing, in the form without cancellation.
    let share = if b.value() >= 0.0 {
        -c / (b + root)
    } else {
        (root - b) / a
    };
    let remaining = T::constant(1.0) - share;
    let leaving_force = [start[0] + share * pull[0], start[1] + share * pull[1]];
    let leaving_limit = before + share * growth;
    if leaving_limit.value() <= tiny || remaining.value() < 0.0 {
        return radial();
    }
    let path = path_square.sqrt();
    let per_path = T::constant(1.0) / path;
    let along = [pull[0] * per_path, pull[1] * per_path];
    let per_limit = T::constant(1.0) / leaving_limit;
    let cos = (leaving_force[0] * along[0] + leaving_force[1] * along[1]) * per_limit;
    let sin = (along[0] * leaving_force[1] - along[1] * leaving_force[0]) * per_limit;
    // ∫ k_t |du| / µN over the rest of the step, with a linear load.
    let per_sum = T::constant(1.0) / (limit + leaving_limit);
    let x = (limit - leaving_limit) * per_sum;
    let mean = if x.value().abs() < SMALL_CHANGE {
        let square = x * x;
        let series =
            T::constant(1.0 / 3.0) + square * (T::constant(0.2) + square * T::constant(1.0 / 7.0));
        T::constant(2.0) * (T::constant(1.0) + square * series) * per_sum
    } else {
        (limit * per_limit).ln() / (limit - leaving_limit)
    };
    let decay = (-(path * remaining * mean)).exp();
    let (p, q) = (T::constant(1.0) + cos, decay * sin);
    let norm = p * p + q * q;
    if norm.value() <= f64::EPSILON {
        return radial();
    }
    let per_norm = T::constant(1.0) / norm;
    let cos = (p * p - q * q) * per_norm;
    let sin = T::constant(2.0) * p * q * per_norm;
    [
        limit * (along[0] * cos - along[1] * sin),
        limit * (along[1] * cos + along[0] * sin),
    ]
}
