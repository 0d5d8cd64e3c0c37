//! The way from a vibration that is easily found to the one that is asked for: more damping and more preload, taken away step by step.
//!
//! Raising the load alone leads nowhere without a preload: the problem is then homogeneous in the load, and as hard at the smallest.

use super::contact_element::ContactElement;
use super::vibration::Vibration;
use super::{HarmonicBalance, Response};

/// Damping ratio that the easiest vibration has more, in its mass.
const DAMPING: f64 = 0.5;
/// Preload that it has more, over the largest force.
const PRELOAD: f64 = 4.0;
/// First and least part of the way that a step takes.
const FIRST: f64 = 0.25;
const LEAST: f64 = 1.0 / 256.0;

impl Vibration {
    /// The response at `omega` by way of easier ones; none where that does not lead there.
    pub(super) fn by_easing(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
    ) -> Option<Response> {
        let mut last = self.eased(balance, omega, 1.0)?.solve(omega, None).ok()?;
        let (mut left, mut step) = (1.0, FIRST);
        while left > 0.0 {
            let next = (left - step).max(0.0);
            let there = match next {
                0.0 => balance.solve_near(omega, &last.start()),
                _ => self
                    .eased(balance, omega, next)?
                    .solve_near(omega, &last.start()),
            };
            match there {
                Ok(response) => {
                    (last, left) = (response, next);
                    step *= 1.5;
                }
                Err(_) => {
                    step *= 0.5;
                    if step < LEAST {
                        return None;
                    }
                }
            }
        }
        Some(last)
    }

    /// The vibration with a share of all that eases it.
    fn eased(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        share: f64,
    ) -> Option<HarmonicBalance<ContactElement>> {
        let mut easier = self.clone();
        let rate = 2.0 * DAMPING * share * omega;
        for (c, m) in easier
            .model
            .damping
            .values_mut()
            .iter_mut()
            .zip(self.model.mass.values())
        {
            *c += rate * m;
        }
        let loads = balance.loads_at(omega, 1.0);
        let force = loads.iter().fold(0.0_f64, |most, f| most.max(f.abs()));
        let mut elements = balance.elements().to_vec();
        let count = elements.iter().map(|e| e.sliders.len()).sum::<usize>() as f64;
        for slider in elements.iter_mut().flat_map(|e| &mut e.sliders) {
            // An open slider has none.
            if slider.gap == 0.0 {
                slider.normal_load += share * PRELOAD * force / count;
            }
        }
        easier
            .balance_of(elements, balance.harmonics().clone())
            .ok()
    }
}
