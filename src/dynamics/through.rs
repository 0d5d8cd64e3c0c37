//! The branch through a response, both ways as far as it goes; once around if it is closed.

use super::aft::InterfaceElement;
use super::continuation::{Continuation, ContinuationSettings};
use super::{DynamicsError, HarmonicBalance, Response};

/// Points before which a branch has not come around.
const FEWEST: usize = 4;
/// Distance from the first response at which a step passes through it, relative to the step: branches bend by less in one.
const PASSES: f64 = 0.2;
/// Cosine of the angle to the first step with which it does: where a branch folds near its first response, it comes back the other way.
const ALIKE: f64 = 0.5;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// The branch through `seed` in both directions, as far as it can be followed between the ends of `settings`, in their order. Of one that
    /// is closed each point once, but for the first, of the least amplitude, with which it ends too.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`], [`DynamicsError::HarmonicMissing`].
    pub fn through(
        &self,
        seed: &Response,
        settings: ContinuationSettings,
    ) -> Result<Vec<Response>, DynamicsError> {
        let back = ContinuationSettings {
            from: settings.to,
            to: settings.from,
            ..settings
        };
        let (mut points, is_closed) = self.onwards(seed, back)?;
        points.reverse();
        points.push(seed.clone());
        if !is_closed {
            points.extend(self.onwards(seed, settings)?.0);
            return Ok(points);
        }
        let slot = self.harmonics().require(1, "continuation")?;
        let size = |response: &Response| {
            let row = &response.displacement[settings.port * self.harmonics().coefficients()..];
            row[slot].hypot(row[slot + 1])
        };
        let sizes: Vec<f64> = points.iter().map(size).collect();
        let least = (0..points.len()).min_by(|a, b| sizes[*a].total_cmp(&sizes[*b]));
        points.rotate_left(least.unwrap_or(0));
        points.push(points[0].clone());
        Ok(points)
    }

    /// The points after `seed` on its branch, up to its end, to where it stops, or once around it, and whether that is so.
    fn onwards(
        &self,
        seed: &Response,
        settings: ContinuationSettings,
    ) -> Result<(Vec<Response>, bool), DynamicsError> {
        let mut points: Vec<Response> = Vec::new();
        let width = (settings.to - settings.from).abs();
        let norm = |row: &[f64]| row.iter().map(|u| u * u).sum::<f64>().sqrt();
        let mut largest = norm(&seed.displacement);
        // All coefficients tell: what a branch is followed by may cross itself.
        let way = |from: &Response, to: &Response, largest: f64| -> Vec<f64> {
            let rows = to.displacement.iter().zip(&from.displacement);
            let rows = rows.map(|(to, from)| (to - from) / largest);
            rows.chain([(to.omega - from.omega) / width]).collect()
        };
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for response in Continuation::onwards(self, settings, None, seed)? {
            let Ok(response) = response else {
                break;
            };
            largest = largest.max(norm(&response.displacement));
            if points.len() >= FEWEST
                && let (Some(last), Some(first)) = (points.last(), points.first())
            {
                let [step, back, begun] = [(last, &response), (last, seed), (seed, first)]
                    .map(|(from, to)| way(from, to, largest));
                let share = dot(&step, &back) / dot(&step, &step);
                let aside: Vec<f64> = back.iter().zip(&step).map(|(b, s)| b - share * s).collect();
                let is_alike = dot(&step, &begun) >= ALIKE * norm(&step) * norm(&begun);
                if (0.0..=1.0).contains(&share) && norm(&aside) <= PASSES * norm(&step) && is_alike
                {
                    return Ok((points, true));
                }
            }
            points.push(response);
        }
        Ok((points, false))
    }
}
