//! Truncated Fourier series of a set of harmonics [A eq. 2.2].

use super::DynamicsError;

/// Order up to which [`Harmonics::beyond`] doubles the highest order. Above order 63, a response has many unknowns and
/// the omitted harmonics are small.
const MOST_BEYOND: u32 = 63;

/// Sorted set of harmonics that contains 0.
///
/// A periodic quantity is `a₀ + Σ (a_k cos kωt + b_k sin kωt)` with half-range amplitudes. The amplitude a_k is half
/// the range of the term a_k cos kωt, not the coefficient of an exponential. The *coefficients* of a periodic quantity
/// are the row `[a₀, a_k₁, b_k₁, a_k₂, b_k₂, …]`. Several quantities are stored row after row: coefficient c of
/// quantity d is at `d * coefficients() + c`. The complex amplitude of harmonic k is a_k − i b_k. The real part of (a_k
/// − i b_k) e^{ikωt} is a_k cos kωt + b_k sin kωt.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Harmonics {
    orders: Vec<u32>,
}

impl Harmonics {
    /// Creates the set of harmonics from a list of orders. The list can have any sequence.
    ///
    /// # Errors
    /// [`DynamicsError::Harmonics`] if 0 is missing or an order occurs twice.
    pub fn new(orders: &[u32]) -> Result<Harmonics, DynamicsError> {
        let mut sorted = orders.to_vec();
        sorted.sort_unstable();
        if sorted.first() != Some(&0) || sorted.windows(2).any(|pair| pair[0] == pair[1]) {
            return Err(DynamicsError::Harmonics {
                found: orders.to_vec(),
            });
        }
        Ok(Harmonics { orders: sorted })
    }

    /// Creates the set of all harmonics from 0 to `highest`.
    pub fn up_to(highest: u32) -> Harmonics {
        Harmonics {
            orders: (0..=highest).collect(),
        }
    }

    /// Returns the orders, 0 first.
    pub fn orders(&self) -> &[u32] {
        &self.orders
    }

    /// Returns the highest order.
    pub fn highest(&self) -> u32 {
        self.orders.last().copied().unwrap_or(0)
    }

    /// Returns the number of real coefficients per quantity: one for the mean, two for every other harmonic.
    pub fn coefficients(&self) -> usize {
        2 * self.orders.len() - 1
    }

    /// Returns the place of the cosine coefficient of the `index`-th harmonic. The sine coefficient of the harmonic
    /// follows at the next place, unless `index` is 0.
    pub fn slot(&self, index: usize) -> usize {
        (2 * index).saturating_sub(1)
    }

    /// Returns the place of the cosine coefficient of harmonic `order`, if the set contains the harmonic.
    pub fn slot_of(&self, order: u32) -> Option<usize> {
        self.orders.binary_search(&order).ok().map(|i| self.slot(i))
    }

    /// Returns the index of the cosine coefficient of harmonic `order`. If the harmonic is missing, the error names
    /// `by`, the computation that needs the harmonic.
    pub(crate) fn require(&self, order: u32, by: &'static str) -> Result<usize, DynamicsError> {
        self.slot_of(order)
            .ok_or_else(|| DynamicsError::HarmonicMissing {
                order,
                by,
                found: self.orders.clone(),
            })
    }

    /// Returns the set of harmonics, extended by all orders up to twice the highest order plus one. A set of few high
    /// orders, or of very many orders, is extended by the next orders only.
    pub fn beyond(&self) -> Harmonics {
        let count = self.orders.len() as u32;
        let top = (2 * self.highest() + 1)
            .min(4 * count)
            .min((self.highest() + 8).max(MOST_BEYOND));
        let mut orders: Vec<u32> = (0..=top).chain(self.orders.iter().copied()).collect();
        orders.sort_unstable();
        orders.dedup();
        Harmonics { orders }
    }

    /// Converts rows of coefficients from the harmonics of `self` to the harmonics of `other`. Orders that only `other`
    /// contains get zero coefficients. Orders that only `self` contains are dropped.
    pub fn transfer(&self, rows: &[f64], other: &Harmonics) -> Vec<f64> {
        let (from, to) = (self.coefficients(), other.coefficients());
        let mut out = vec![0.0; rows.len() / from * to];
        for (row, out) in rows.chunks(from).zip(out.chunks_mut(to)) {
            for (index, &order) in self.orders.iter().enumerate() {
                if let Some(place) = other.slot_of(order) {
                    let width = if order == 0 { 1 } else { 2 };
                    let slot = self.slot(index);
                    out[place..place + width].copy_from_slice(&row[slot..slot + width]);
                }
            }
        }
        out
    }

    /// Returns the ratio of a coefficient to the mean of the signal times its basis function.
    pub(super) fn weight(coefficient: usize) -> f64 {
        if coefficient == 0 { 1.0 } else { 2.0 }
    }

    /// Returns the basis functions `[1, cos k₁θ, sin k₁θ, …]` at the phase `theta` = ωt. The vector has the length
    /// [`Self::coefficients`].
    pub fn basis(&self, theta: f64) -> Vec<f64> {
        let mut row = vec![1.0];
        for &order in &self.orders[1..] {
            let (sin, cos) = (f64::from(order) * theta).sin_cos();
            row.extend([cos, sin]);
        }
        row
    }

    /// Computes the work ∮ f du = π Σ k (a_f b_u − b_f a_u) of `force` on `displacement` \[J\]. The integral covers one
    /// period of the fundamental.
    ///
    /// The arguments `force` and `displacement` are rows of the same length, one row per degree of freedom.
    pub fn work(&self, force: &[f64], displacement: &[f64]) -> f64 {
        let n = self.coefficients();
        let mut sum = 0.0;
        for (f, u) in force.chunks(n).zip(displacement.chunks(n)) {
            for (index, &order) in self.orders.iter().enumerate().skip(1) {
                let slot = self.slot(index);
                sum += f64::from(order) * (f[slot] * u[slot + 1] - f[slot + 1] * u[slot]);
            }
        }
        std::f64::consts::PI * sum
    }
}
