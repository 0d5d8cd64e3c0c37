//! The motion of the contact elements between two model updates: that of the last response, carried on by what it has changed by since the
//! one before.
//!
//! A response that stays as it is between two updates makes an error of first order in their distance, most of it wear at wrong places. The
//! change is carried on in proportion to the tangential compliance of the fine contact, by which responses of laps move at the most even pace, from the first
//! hundredth of the worn volume to the last; by the logarithm or a root of the volume they are missed by more, by cycles ruinously.

/// The change is carried on by this many times itself at most.
const FARTHEST: f64 = 2.0;
/// A change of the amplitude by more than this part of it is none to carry on: the joint begins to do something else.
const LARGEST_CHANGE: f64 = 0.25;

/// What the motion has changed by between the last two responses, and at which compliances of the fine contact these were found.
#[derive(Debug, Clone, PartialEq)]
pub struct Trend {
    /// Tangential compliance at the response before and at the last one \[m/N\].
    pub compliance: [f64; 2],
    /// Coefficients of the last response less those of the one before.
    pub change: Vec<f64>,
}

impl Trend {
    /// How many times the change is added at a `compliance`: none at that of the last response.
    pub fn times(&self, compliance: f64) -> f64 {
        let [before, last] = self.compliance;
        let times = (compliance - last) / (last - before);
        match times.is_finite() {
            true => times.clamp(0.0, FARTHEST),
            false => 0.0,
        }
    }

    /// The coefficients at a `compliance`, those of the last response being `last`.
    pub fn at(&self, last: &[f64], compliance: f64) -> Vec<f64> {
        let times = self.times(compliance);
        let pairs = last.iter().zip(&self.change);
        pairs.map(|(u, change)| u + times * change).collect()
    }
}

/// True if the change that leads to the coefficients `last` is one to carry on: no more than a quarter of them, and not against the change `before`
/// it.
pub fn is_steady(last: &[f64], change: &[f64], before: &[f64]) -> bool {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let largest = LARGEST_CHANGE * LARGEST_CHANGE * dot(last, last);
    dot(change, change) <= largest && dot(change, before) >= 0.0
}
