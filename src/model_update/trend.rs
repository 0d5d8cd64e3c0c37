//! Extrapolation of the motion of the contact elements between two model updates.
//!
//! If the response were constant between updates, the error would be proportional to the distance between updates. Most
//! of the error would be wear at wrong places. The extrapolation continues the last change of the response in
//! proportion to the tangential compliance of the fine contact. Over the life of lap joints, the response is most
//! nearly linear in this tangential compliance. Extrapolation in the logarithm or a root of the worn volume has larger
//! errors, and extrapolation in cycles fails.

use super::UpdateSettings;

/// Data for the extrapolation of the element motion: the change of the motion between the last two responses, and the
/// tangential compliance of the fine contact at each response.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// Tangential compliance at the response before the last, and at the last one \[m/N\].
    pub compliance: [f64; 2],
    /// Coefficients of the last response less the coefficients of the one before.
    pub change: Vec<f64>,
}

impl Trend {
    /// Returns the multiple of the change to add at a `compliance`; 0 at the compliance of the last response.
    pub fn multiple(&self, compliance: f64) -> f64 {
        let [before, last] = self.compliance;
        let times = (compliance - last) / (last - before);
        match times.is_finite() {
            true => times.clamp(0.0, UpdateSettings::DEFAULT.max_multiple),
            false => 0.0,
        }
    }

    /// Returns the coefficients at a `compliance`. `last` are the coefficients of the last response.
    pub fn at(&self, last: &[f64], compliance: f64) -> Vec<f64> {
        let times = self.multiple(compliance);
        let pairs = last.iter().zip(&self.change);
        pairs.map(|(u, change)| u + times * change).collect()
    }
}

/// Returns true if the change to the coefficients `last` may be extrapolated. The change must be at most a quarter of
/// the coefficients, and must not oppose the previous change `before`.
pub fn can_extrapolate(last: &[f64], change: &[f64], before: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let largest = UpdateSettings::DEFAULT.largest_change
        * UpdateSettings::DEFAULT.largest_change
        * dot(last, last);
    dot(change, change) <= largest && dot(change, before) >= 0.0
}
