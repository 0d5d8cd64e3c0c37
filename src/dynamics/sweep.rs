//! Responses at given frequencies, one after the other, each from those before.

use super::aft::InterfaceElement;
use super::continuation::{Continuation, ContinuationSettings};
use super::newton_step::Condition;
use super::predictor::{REMEMBERED, foretold};
use super::{DynamicsError, HarmonicBalance, Response, Start};

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Responses at each of `omegas`, each from those before, or the error of a point that has none.
    ///
    /// Where there are several, it is that of the branch on which a sweep in the order of `omegas` arrives: where the branch turns
    /// back before the next frequency, it is followed over its turning points to there, so that the sweep jumps where a slow
    /// experiment does. Only what no branch leads to is looked for from the other end of the sweep and from the linear response.
    pub fn sweep(&self, omegas: &[f64]) -> Vec<Result<Response, DynamicsError>> {
        let mut found: Vec<Response> = Vec::with_capacity(omegas.len());
        let mut points = Vec::with_capacity(omegas.len());
        for &omega in omegas {
            let response = match self.next_of_sweep(omega, &found) {
                Some(response) => Ok(response),
                None => {
                    let guess = found.last().map(Response::start);
                    self.solve(omega, guess.as_ref())
                        .or_else(|error| self.backwards_to(omega, omegas).ok_or(error))
                }
            };
            if let Ok(response) = &response {
                self.gauge.add_point(response.omega);
                found.push(response.clone());
            }
            points.push(response);
        }
        points
    }

    /// The response at `omega` that is connected with those before.
    fn next_of_sweep(&self, omega: f64, responses: &[Response]) -> Option<Response> {
        let last = responses.last()?;
        let before = responses.iter().rev().nth(1);
        let at = |start: &Start| {
            let start = self.start_from(start, omega, 1.0).ok()?;
            self.newton(start, 1.0, &Condition::Frequency).ok()
        };
        let first = responses.len().saturating_sub(REMEMBERED);
        let known: Vec<Start> = responses[first..].iter().map(Response::start).collect();
        let omegas: Vec<f64> = known.iter().map(|start| start.omega).collect();
        let ahead = foretold(&known, &omegas, omega).and_then(|start| at(&start));
        if ahead.is_some() {
            return ahead;
        }
        if let Some(response) = at(&last.start()) {
            return Some(response);
        }
        let first = responses.first()?;
        self.follow(before, last, first.omega, omega)
    }

    /// The response at `omega` on the branch through `last`, unless that leads back beyond `from`.
    fn follow(
        &self,
        before: Option<&Response>,
        last: &Response,
        from: f64,
        omega: f64,
    ) -> Option<Response> {
        let port = self.drive()?.port;
        let settings = ContinuationSettings::over(from, omega, port);
        let width = (omega - from).abs();
        Continuation::reach(self, settings, before, last, width).ok()
    }

    /// The response at `omega` on the branch from the other end of a sweep.
    fn backwards_to(&self, omega: f64, omegas: &[f64]) -> Option<Response> {
        let end = *omegas.last()?;
        let last = self.solve(end, None).ok()?;
        self.follow(None, &last, end, omega)
    }
}
