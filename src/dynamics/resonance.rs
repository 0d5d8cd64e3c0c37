//! Resonance without a frequency response: the phase resonance (displacement 90° behind the drive) and the peak.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::aft::InterfaceElement;
use super::closed_model::Precision;
use super::newton::{Condition, State, Term};
use super::{ContinuationSettings, DynamicsError, HarmonicBalance, Response, Start};

/// Number of points in the search for a start; a range contains a few modes at most.
const SCAN: usize = 400;
/// Relative distances from each natural frequency at which the search evaluates the phase.
const BESIDE: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
/// Number of points in the search among nonlinear responses. The search among nonlinear responses begins if all other
/// searches fail.
const NONLINEAR_SCAN: usize = 60;
/// Minimum budget of evaluations of the search over the range, after raising the load found no resonance.
const SCAN_LEAST: u64 = 2000;
/// Budget of evaluations of the search over the range, divided by the number of evaluations of raising the load.
const SCAN_SHARE: u64 = 4;
/// Number of bisections of an interval with a resonance.
const BISECTIONS: usize = 40;
/// Relative width at which bisection of an interval with a phase leap ends. If the phase still leaps, the interval
/// contains no resonance, because half-power bandwidths are above 1e-4.
const LEAP_WIDTH: f64 = 1e-7;
/// In-phase share of the displacement on both sides above which the phase leaps. With friction only, the share is 0 at
/// the largest force that friction bounds.
const LEAP: f64 = 0.1;
/// Smallest factor between two loads when the load is raised.
const LEAST_FACTOR: f64 = 1.01;
/// Tolerance of the responses at intermediate loads, which serve only as starts.
const ON_THE_WAY: f64 = 1e-3;
/// Largest relative change of frequency that is extrapolated from the last two loads to the next.
const AHEAD: f64 = 0.02;
/// Largest permitted share of the elements that do not follow their reference at the first load.
const FIRST_ACTIVE: f64 = 0.5;
/// Smallest load factor of the start; at smaller loads a preloaded joint is linear.
const LEAST_LOAD: f64 = 1e-9;
/// Relative change of frequency above which a phase resonance is checked against an antiresonance.
const FAR: f64 = 5e-3;
/// Relative distance above the resonance of that check.
const ABOVE: f64 = 1e-3;
/// First relative step of frequency from the phase resonance in the search for the peak.
const FIRST_STEP: f64 = 5e-4;
/// Relative width of the bracket of the peak that ends the search.
const PEAK_WIDTH: f64 = 1e-8;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Computes the phase resonance between the two angular frequencies of `range`. In a phase resonance, the
    /// displacement at the drive lags the load by 90°.
    ///
    /// The search tries `guess` first, if it is `Some`. The response of a similar joint is a good guess. Without a
    /// useful guess, the search starts from the resonance of the linear structure. The search then raises the load in
    /// the largest steps that converge. If raising the load fails, the search takes the strongest phase resonance on
    /// the branch over the range.
    ///
    /// # Errors
    /// Returns [`DynamicsError::NoResonance`] if the range contains no phase resonance. Without damping, a structure
    /// with sliding friction has no phase resonance, because nothing bounds the amplitude. Returns the error of the
    /// last attempt if the solver fails.
    pub fn phase_resonance(
        &self,
        range: (f64, f64),
        guess: Option<&Start>,
    ) -> Result<Response, DynamicsError> {
        let lag = self.phase_lag()?;
        if let Some(guess) = guess {
            // A guess of the wrong length is an error, not a reason for another attempt.
            let start = self.start_from(guess, guess.omega, 1.0)?;
            if let Ok(response) = self.resonance_from(start, [1.0, 0.0], &lag)
                && inside(range, &response)
            {
                return Ok(response);
            }
        }
        let before = self.effort.spent();
        let mut raise_error = None;
        if let Some(omega) = self.linear_resonance(range)? {
            match self.raise_resonance(omega, &lag) {
                Ok(response) if inside(range, &response) => return Ok(response),
                Ok(_) => raise_error = Some(no_resonance("phase resonance", range)),
                Err(error) => raise_error = Some(error),
            }
        }
        // If the joint slides as a whole, the branch over the range leads nowhere, at a high cost. A budget limits the
        // search.
        let raise_evaluations = self.effort.spent() - before;
        self.effort
            .allow(SCAN_LEAST.max(SCAN_SHARE * raise_evaluations));
        let scan_result = self.scan_resonance(range, &lag);
        let is_budget_spent = self.effort.is_spent();
        self.effort.unbound();
        match (scan_result, raise_error) {
            (Err(error), Some(raise_error)) if is_budget_spent || error.is_not_converged() => {
                Err(raise_error)
            }
            (scan_result, _) => scan_result,
        }
    }

    /// Computes the phase resonance near `guess`. In a phase resonance, the displacement at the drive lags the load by
    /// 90°. Newton's method starts from `guess`, and the function makes no other attempt.
    ///
    /// # Errors
    /// Returns the error of Newton's method, or [`DynamicsError::NoResonance`] if the method leaves the range.
    pub fn phase_resonance_near(
        &self,
        range: (f64, f64),
        guess: &Start,
    ) -> Result<Response, DynamicsError> {
        let start = self.start_from(guess, guess.omega, 1.0)?;
        let response = self.resonance_from(start, [1.0, 0.0], &self.phase_lag()?)?;
        if inside(range, &response) {
            Ok(response)
        } else {
            Err(no_resonance("phase resonance", range))
        }
    }

    /// Solves for the phase resonance with Newton's method, from the state `start`. The second argument contains the
    /// load factor and the tolerance.
    ///
    /// A solution far from the start can be an antiresonance. At an antiresonance, the phase of the displacement
    /// changes from a lag behind the drive to in phase with the drive.
    ///
    /// # Errors
    /// Returns the error of Newton's method, or [`DynamicsError::NoResonance`] at an antiresonance.
    fn resonance_from(
        &self,
        start: State,
        [factor, tolerance]: [f64; 2],
        lag: &Term,
    ) -> Result<Response, DynamicsError> {
        let from = start.omega;
        let response = self.newton_to(tolerance, start, factor, &Condition::zero(*lag))?;
        if (response.omega / from - 1.0).abs() > FAR {
            let omega = response.omega * (1.0 + ABOVE);
            let above = self.start_from(&response.start(), omega, factor)?;
            let above = self.newton_to(tolerance, above, factor, &Condition::Frequency)?;
            if self.in_phase(lag, &above.displacement).0 > 0.0 {
                return Err(no_resonance("phase resonance", (from, response.omega)));
            }
        }
        Ok(response)
    }

    /// Returns the term Re(û F̂*), which is zero at a phase resonance.
    fn phase_lag(&self) -> Result<Term, DynamicsError> {
        let slot = self.harmonics().require(1, "phase resonance")?;
        let Some(load) = self.drive() else {
            return Err(DynamicsError::OutOfRange {
                name: "the amplitude of the drive",
                value: 0.0,
                expected: "different from zero: a phase resonance is defined by the lag behind a load",
            });
        };
        let size = load.cosine.hypot(load.sine);
        Ok(Term {
            port: load.port,
            slot,
            weights: [load.cosine / size, load.sine / size],
        })
    }

    /// Returns the in-phase part and the size of the displacement at the drive, for the term of [`Self::phase_lag`].
    fn in_phase(&self, term: &Term, displacement: &[f64]) -> (f64, f64) {
        let &Term {
            port,
            slot,
            weights,
        } = term;
        let row = &displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        (weights[0] * a + weights[1] * b, a.hypot(b))
    }

    /// Returns the strongest phase resonance of the reference state. The search extends above the range, as friction
    /// lowers the resonance.
    fn linear_resonance(&self, range: (f64, f64)) -> Result<Option<f64>, DynamicsError> {
        let resonances =
            self.reference_phase_resonances((range.0, range.1 + 0.5 * (range.1 - range.0)))?;
        let strongest = resonances
            .into_iter()
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        Ok(strongest.map(|(omega, _)| omega))
    }

    /// Returns the phase resonances of the reference state between two angular frequencies \[rad/s\], ascending, with
    /// the displacement at the drive \[m\].
    pub(super) fn reference_phase_resonances(
        &self,
        range: (f64, f64),
    ) -> Result<Vec<(f64, f64)>, DynamicsError> {
        let Term {
            port,
            slot,
            weights,
        } = self.phase_lag()?;
        let among = self
            .model
            .restricted_to(&self.load_ports, Precision::Double);
        let n = self.harmonics().coefficients();
        let amplitude = |row: &[f64]| Complex64::new(row[slot], -row[slot + 1]);
        let drive = self.load_ports.iter().position(|p| *p == port);
        // In-phase part and size of the displacement at the drive.
        let in_phase_at = |omega: f64| -> Result<(f64, f64), DynamicsError> {
            let loads = self.loads_at(omega, 1.0);
            let forces: Vec<Complex64> = loads.chunks(n).map(amplitude).collect();
            let receptance = among.receptance(&self.model.core.receptance(omega)?);
            let u = receptance.apply(&forces)[drive.unwrap_or(0)];
            Ok((weights[0] * u.re - weights[1] * u.im, u.norm()))
        };
        let places = self.search_frequencies(range.0, range.1);
        let mut resonances = Vec::new();
        let mut previous: Option<(f64, f64)> = None;
        for high in places {
            let in_phase = match in_phase_at(high) {
                Ok((in_phase, _)) => in_phase,
                // Without damping there is no response exactly at a resonance.
                Err(error) if error.is_singular() => continue,
                Err(error) => return Err(error),
            };
            // A change from in phase to behind the drive is a resonance; the reverse is an antiresonance.
            if let Some((low, part)) = previous
                && part > 0.0
                && in_phase <= 0.0
            {
                let (mut low, mut high) = (low, high);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    match in_phase_at(middle) {
                        Ok((value, _)) if value > 0.0 => low = middle,
                        Ok(_) => high = middle,
                        Err(error) if error.is_singular() => break,
                        Err(error) => return Err(error),
                    }
                }
                resonances.push((low, in_phase_at(low)?.1));
            }
            previous = Some((high, in_phase));
        }
        Ok(resonances)
    }

    /// Returns the angular frequencies at which the search evaluates the phase, ascending. The frequencies cover the
    /// interval, and some frequencies lie close to every natural frequency to separate close resonances.
    fn search_frequencies(&self, from: f64, to: f64) -> Vec<f64> {
        let step = (to - from) / SCAN as f64;
        let mut places: Vec<f64> = (0..=SCAN).map(|k| from + k as f64 * step).collect();
        for natural in self.model.core.natural_frequencies() {
            let near_natural = BESIDE.iter().flat_map(|d| [1.0 - d, 1.0 + d]);
            places.extend(near_natural.map(|ratio| ratio * natural));
        }
        places.retain(|omega| (from..=to).contains(omega));
        places.sort_by(f64::total_cmp);
        places
    }

    /// Returns the load factor at which the search begins. At the first load, some elements slip or open in the linear
    /// response, but not most elements. Newton's method converges from such a linear response. From a linear response
    /// at a much larger load, Newton's method fails only after many iterations.
    fn first_load(&self, omega: f64) -> Result<f64, DynamicsError> {
        let most_moved = (FIRST_ACTIVE * self.elements.len() as f64).ceil();
        let mut factor = 1.0;
        while factor > LEAST_LOAD {
            let start = self.linear_start(omega, factor)?;
            let rows = start.contact.chunks(self.width());
            let elements = self.elements.iter().zip(rows).zip(&start.active);
            let moved_elements = elements.filter(|(_, active)| **active);
            let moved_elements = moved_elements.map(|((element, row), _)| {
                1.0 - element.reference_share(&self.sampling.synthesise(row))
            });
            if moved_elements.sum::<f64>() <= most_moved {
                break;
            }
            factor *= 0.5;
        }
        // For elements with one slider, the search begins at twice the load found. The sliders of a bank begin to slip
        // one after the other. A load at which half of the sliders slip is already large.
        let margin = if self.has_expensive_jacobian {
            1.0
        } else {
            2.0
        };
        Ok(f64::min(margin * factor, 1.0))
    }

    /// Tracks the phase resonance from the linear resonance at a sufficiently small load up to the full load.
    ///
    /// # Errors
    /// Returns [`DynamicsError::ResonanceNotTracked`] with the largest load that has a resonance, or the error of the
    /// first solve.
    fn raise_resonance(&self, omega: f64, lag: &Term) -> Result<Response, DynamicsError> {
        let tolerance = |factor: f64| if factor < 1.0 { ON_THE_WAY } else { 0.0 };
        let mut factor = self.first_load(omega)?;
        let mut last = loop {
            let start = self.linear_start(omega, factor)?;
            match self.resonance_from(start, [factor, tolerance(factor)], lag) {
                Ok(response) => break response,
                Err(error) if factor < LEAST_LOAD => return Err(error),
                Err(_) => factor *= 0.25,
            }
        };
        // The response to zero load is zero.
        let mut previous = Start {
            omega,
            load_factor: 0.0,
            displacement: vec![0.0; last.displacement.len()],
        };
        let mut growth = 2.0;
        while last.load_factor < 1.0 {
            let next = (last.load_factor * growth).min(1.0);
            let predicted = extrapolate(&previous, last.start(), next);
            let start = self.start_from(&predicted, predicted.omega, next)?;
            match self.resonance_from(start, [next, tolerance(next)], lag) {
                Ok(response) => {
                    previous = last.start();
                    last = response;
                    growth = f64::min(growth * growth, 4.0);
                }
                Err(error) => {
                    growth = f64::sqrt(growth);
                    if growth < LEAST_FACTOR {
                        return Err(self.overloaded(&last, error));
                    }
                }
            }
        }
        Ok(last)
    }

    /// Creates the error that the phase resonance `last` could not be tracked to a larger load.
    fn overloaded(&self, last: &Response, error: DynamicsError) -> DynamicsError {
        let rows = last.displacement.chunks(self.width());
        let slip_shares = self.elements.iter().zip(rows).map(|(element, row)| {
            let displacement = self.sampling.synthesise(row);
            match element.follows_reference(&displacement) {
                true => 0.0,
                false => 1.0 - element.reference_share(&displacement),
            }
        });
        let slipping = slip_shares.sum::<f64>() / self.elements.len().max(1) as f64;
        DynamicsError::ResonanceNotTracked {
            frequency: last.frequency(),
            load_factor: last.load_factor,
            slipping,
            last: Box::new(error),
        }
    }

    /// Computes the strongest phase resonance on the branch over the range. The branch can have turning points. If the
    /// continuation of the branch fails, the function searches among responses at fixed frequencies in the range.
    ///
    /// # Errors
    /// Returns [`DynamicsError::NoResonance`] if the range contains no phase resonance or nothing bounds the amplitude.
    /// Returns the error that stopped the search if the solver fails.
    fn scan_resonance(&self, range: (f64, f64), lag: &Term) -> Result<Response, DynamicsError> {
        let port = self.drive().map_or(0, |load| load.port);
        let settings = ContinuationSettings::over(range.0, range.1, port);
        let (mut branch, mut failure) = match self.branch(settings) {
            Ok(branch) => (branch.into_iter().map(Some).collect(), None),
            Err(error) => (Vec::new(), Some(error)),
        };
        let mut best = self.crossing(&branch, range, lag);
        if !matches!(best, Ok(Some(_))) && failure.is_some() {
            (branch, failure) = (Vec::new(), None);
            for k in 0..=NONLINEAR_SCAN {
                let omega = range.0 + (range.1 - range.0) * k as f64 / NONLINEAR_SCAN as f64;
                let guess = branch.last().and_then(Option::as_ref).map(Response::start);
                branch.push(match self.solve(omega, guess.as_ref()) {
                    Ok(response) => Some(response),
                    Err(error) => {
                        failure = Some(error);
                        None
                    }
                });
            }
            best = self.crossing(&branch, range, lag);
        }
        match best? {
            Some(response) => Ok(response),
            None => Err(failure.unwrap_or(no_resonance("phase resonance", range))),
        }
    }

    /// Computes the strongest phase resonance between neighbouring responses of `branch`.
    fn crossing(
        &self,
        branch: &[Option<Response>],
        range: (f64, f64),
        lag: &Term,
    ) -> Result<Option<Response>, DynamicsError> {
        let (resonances, failure) = self.crossings(branch, range, lag);
        let size = |response: &Response| self.in_phase(lag, &response.displacement).1;
        let strongest = resonances
            .into_iter()
            .max_by(|a, b| size(a).total_cmp(&size(b)));
        match (strongest, failure) {
            (Some(response), _) => Ok(Some(response)),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(None),
        }
    }

    /// Computes all phase resonances between neighbouring responses of `branch`, and the error of a failed one.
    fn crossings(
        &self,
        branch: &[Option<Response>],
        range: (f64, f64),
        lag: &Term,
    ) -> (Vec<Response>, Option<DynamicsError>) {
        let (mut resonances, mut failure) = (Vec::new(), None);
        for pair in branch.windows(2) {
            let [Some(before), Some(after)] = pair else {
                continue;
            };
            let in_phase_part = |response: &Response| self.in_phase(lag, &response.displacement).0;
            if !(in_phase_part(before) > 0.0 && in_phase_part(after) <= 0.0) {
                continue;
            }
            match self.resonance_between(before, after, range, lag) {
                Ok(response) if inside(range, &response) => resonances.push(response),
                Ok(_) => {}
                Err(error) => failure = Some(error),
            }
        }
        (resonances, failure)
    }

    /// Computes the phase resonance between a response in phase with the drive and a response behind the drive.
    fn resonance_between(
        &self,
        before: &Response,
        after: &Response,
        range: (f64, f64),
        lag: &Term,
    ) -> Result<Response, DynamicsError> {
        let (mut low, mut high) = (before.clone(), after.clone());
        let mut failure = None;
        for _ in 0..BISECTIONS {
            for near in [&low, &high] {
                let start = self.start_from(&near.start(), near.omega, 1.0)?;
                match self.solve_or_read(start, 1.0, &Condition::zero(*lag)) {
                    Ok(response) => return Ok(response),
                    Err(error) => failure = Some(error),
                }
            }
            let share = |response: &Response| {
                let (part, size) = self.in_phase(lag, &response.displacement);
                part.abs() / size.max(f64::MIN_POSITIVE)
            };
            if (high.omega - low.omega).abs() <= LEAP_WIDTH * low.omega {
                // The first harmonic of the friction force is at most 4/π of the friction limit. Without friction
                // nothing bounds the amplitude.
                if share(&low) > LEAP && share(&high) > LEAP {
                    return Err(no_resonance("bounded phase resonance", range));
                }
                break;
            }
            let middle = 0.5 * (low.omega + high.omega);
            let there = match self.solve(middle, Some(&low.start())) {
                Err(error) if error.is_singular() => {
                    return Err(no_resonance("bounded phase resonance", range));
                }
                there => there?,
            };
            if self.in_phase(lag, &there.displacement).0 > 0.0 {
                low = there;
            } else {
                high = there;
            }
        }
        Err(failure.unwrap_or(no_resonance("phase resonance", range)))
    }

    /// Computes the peak near `guess`: the response with the largest first harmonic at `port`. The peak lies between
    /// the two angular frequencies of `range`. The phase resonance is a good guess.
    ///
    /// The peak is a root of the derivative of the squared amplitude along the branch. The search for this root also
    /// works on a plateau. The parameter of the branch is the phase at the port. The phase changes steadily over a
    /// resonance, even if the branch overhangs. If the search with the phase fails, the parameter is the frequency.
    ///
    /// # Errors
    /// Returns [`DynamicsError::NoResonance`] if the amplitude still rises at the end of the range, or the error of a
    /// solve.
    pub fn peak(
        &self,
        port: usize,
        range: (f64, f64),
        guess: &Start,
    ) -> Result<Response, DynamicsError> {
        let start = self.solve(guess.omega.clamp(range.0, range.1), Some(guess))?;
        self.peak_near(port, range, start)
    }

    /// Computes the peak at `port`, between the angular frequencies of `range`, near the response `start`.
    ///
    /// # Errors
    /// Returns the errors of [`Self::peak`].
    pub(super) fn peak_near(
        &self,
        port: usize,
        range: (f64, f64),
        start: Response,
    ) -> Result<Response, DynamicsError> {
        match self.peak_by_phase(port, range, &start) {
            Ok(peak) => Ok(peak),
            Err(_) => self.peak_by_frequency(port, range, start),
        }
    }

    fn peak_by_frequency(
        &self,
        port: usize,
        range: (f64, f64),
        start: Response,
    ) -> Result<Response, DynamicsError> {
        let slot = self.harmonics().require(1, "peak")?;
        let n = self.harmonics().coefficients();
        let slope = |response: &Response| -> Result<f64, DynamicsError> {
            let row = &response.displacement[port * n..];
            let change = self.port_slope(response, port, slot)?;
            Ok(row[slot] * change[0] + row[slot + 1] * change[1])
        };
        let first = slope(&start)?;
        if first == 0.0 {
            return Ok(start);
        }
        // Steps uphill until the slope changes its sign.
        let mut step = FIRST_STEP * start.omega * first.signum();
        let (mut near, mut near_slope) = (start, first);
        let (mut far, mut far_slope) = loop {
            let omega = (near.omega + step).clamp(range.0, range.1);
            if omega == near.omega {
                return Err(no_resonance("peak", range));
            }
            let next = self.solve(omega, Some(&near.start()))?;
            let next_slope = slope(&next)?;
            if next_slope * first <= 0.0 {
                break (next, next_slope);
            }
            (near, near_slope) = (next, next_slope);
            step *= 1.6;
        };
        // Regula falsi with halved weights (Illinois), with bisection at every fourth iteration, as the slope may jump.
        let (mut near_weight, mut far_weight) = (near_slope, far_slope);
        for iteration in 0..60 {
            let width = far.omega - near.omega;
            if width.abs() <= PEAK_WIDTH * near.omega || far_slope == 0.0 {
                break;
            }
            let share = if iteration % 4 == 3 {
                0.5
            } else {
                (near_weight / (near_weight - far_weight)).clamp(0.01, 0.99)
            };
            let next = self.solve(near.omega + share * width, Some(&near.start()))?;
            let next_slope = slope(&next)?;
            if next_slope * first > 0.0 {
                (near, near_slope) = (next, next_slope);
                near_weight = near_slope;
                far_weight *= 0.5;
            } else {
                (far, far_slope) = (next, next_slope);
                far_weight = far_slope;
                near_weight *= 0.5;
            }
        }
        let higher = self.amplitude(&far, port)?.0 > self.amplitude(&near, port)?.0;
        Ok(if higher { far } else { near })
    }
}

/// Extrapolates two starts linearly to the load `factor`.
fn extrapolate(before: &Start, last: Start, factor: f64) -> Start {
    let share = (factor - last.load_factor) / (last.load_factor - before.load_factor);
    let along = |before: f64, last: f64| last + share * (last - before);
    let omega = along(before.omega, last.omega);
    let pairs = before.displacement.iter().zip(&last.displacement);
    Start {
        omega: match (omega / last.omega - 1.0).abs() <= AHEAD {
            true => omega,
            false => last.omega,
        },
        load_factor: factor,
        displacement: pairs.map(|(before, last)| along(*before, *last)).collect(),
    }
}

fn inside(range: (f64, f64), response: &Response) -> bool {
    range.0 <= response.omega && response.omega <= range.1
}

fn no_resonance(what: &'static str, range: (f64, f64)) -> DynamicsError {
    let turn = 2.0 * std::f64::consts::PI;
    DynamicsError::NoResonance {
        what,
        from: range.0 / turn,
        to: range.1 / turn,
    }
}

// Search for the peak of a resonance along its branch. The coordinate is the phase of the response, so the branch can
// overhang in frequency.

/// Largest step of phase \[rad\].
const LARGEST_STEP: f64 = 0.2;
/// Smallest step of phase in the search for the peak \[rad\]. The search fails if a step must be smaller.
const LEAST_STEP: f64 = 1e-4;
/// Largest factor of the amplitude over a step; a step with a larger factor has left the branch.
const LEFT: f64 = 1.5;
/// Largest distance of phase between the start and the peak of the same resonance \[rad\].
const FARTHEST: f64 = 0.5 * PI;
/// Angle to the peak of the resonance curve that ends the search \[rad\]. The relative error of the peak amplitude is
/// half the square of the angle to the peak.
const FLAT: f64 = 5e-3;
/// Angle to the peak of the resonance curve that ends the search if responses are expensive \[rad\].
const DEAR: f64 = 1e-2;
/// Tolerance of the responses during the search, smaller than the error due to the angle that ends the search.
const ROUGHLY: f64 = 1e-6;
/// Largest relative rise of the amplitude that remains to the peak.
const RISE: f64 = 1e-6;
/// Largest number of steps of the search by slopes.
const SLOPES: usize = 5;

/// Response on the branch, with the derivative of the logarithm of the amplitude with respect to the phase.
struct PhasePoint {
    response: Response,
    phase: f64,
    slope: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Computes the local peak near `start`, along the branch.
    pub(super) fn peak_by_phase(
        &self,
        port: usize,
        range: (f64, f64),
        start: &Response,
    ) -> Result<Response, DynamicsError> {
        let slot = self.harmonics().require(1, "peak")?;
        let no_peak = || {
            let turn = 2.0 * PI;
            DynamicsError::NoResonance {
                what: "peak",
                from: range.0 / turn,
                to: range.1 / turn,
            }
        };
        let origin = self.first_harmonic(start, port, slot)[1];
        let mut near = self.phase_point(start.clone(), port, slot, origin)?;
        let flat = self.flat_angle();
        if near.slope == 0.0 || self.has_expensive_jacobian && near.slope.abs() <= flat {
            return Ok(near.response);
        }
        if let Some(peak) = self.peak_by_slopes(&near, port, slot)
            && (range.0..=range.1).contains(&peak.omega)
        {
            return Ok(peak);
        }
        let uphill = near.slope.signum();
        let mut step = self.settings.first_phase_step;
        let mut far = loop {
            let phase = near.phase + step * uphill;
            if (phase - origin).abs() > FARTHEST {
                return Err(no_peak());
            }
            match self.solve_at_phase(&near, phase, port, slot) {
                Ok(next) if next.slope * uphill <= 0.0 => break next,
                Ok(next) => {
                    near = next;
                    step = (1.6 * step).min(LARGEST_STEP);
                }
                Err(error) => {
                    step *= 0.25;
                    if step < LEAST_STEP {
                        return Err(error);
                    }
                }
            }
        };
        // Regula falsi with halved weights (Illinois), with bisection at every fourth iteration, as the slope may jump.
        let (mut near_weight, mut far_weight) = (near.slope, far.slope);
        let final_width = flat;
        for iteration in 0..60 {
            let width = far.phase - near.phase;
            if width.abs() <= final_width || far.slope == 0.0 {
                break;
            }
            let share = if iteration % 4 == 3 {
                0.5
            } else {
                (near_weight / (near_weight - far_weight)).clamp(0.01, 0.99)
            };
            let next = self.solve_at_phase(&near, near.phase + share * width, port, slot)?;
            if next.slope * uphill > 0.0 {
                near = next;
                near_weight = near.slope;
                far_weight *= 0.5;
            } else {
                far = next;
                far_weight = far.slope;
                near_weight *= 0.5;
            }
        }
        let size = |place: &PhasePoint| self.first_harmonic(&place.response, port, slot)[0];
        let peak = if size(&far) > size(&near) { far } else { near }.response;
        if peak.omega < range.0 || peak.omega > range.1 {
            return Err(no_peak());
        }
        Ok(peak)
    }

    /// Computes the peak in few steps from slopes of the amplitude. Returns `None` if the slopes do not lead to the
    /// peak.
    ///
    /// The resonance curve of a linear resonance is a circle. On the circle, the amplitude is proportional to the
    /// cosine of the angle to the peak. On the circle, the first slope of the amplitude determines the angle to the
    /// peak. Later steps use the line through two slopes.
    fn peak_by_slopes(&self, start: &PhasePoint, port: usize, slot: usize) -> Option<Response> {
        let mut angle = start.slope.atan();
        let mut near: Option<PhasePoint> = None;
        for _ in 0..SLOPES {
            let from = near.as_ref().unwrap_or(start);
            let phase = from.phase + angle.clamp(-LARGEST_STEP, LARGEST_STEP);
            if (phase - start.phase).abs() > FARTHEST {
                return None;
            }
            let next = self.solve_at_phase(from, phase, port, slot).ok()?;
            if next.slope == 0.0
                || self.has_expensive_jacobian && next.slope.abs() <= self.flat_angle()
            {
                return Some(next.response);
            }
            angle = -next.slope * (next.phase - from.phase) / (next.slope - from.slope);
            // The search ends when the remaining rise of the amplitude is small. A small slope is not sufficient to end
            // the search. Friction can make the peak so flat that a point with a small slope is far from the peak.
            if (0.5 * angle * next.slope).abs() <= RISE {
                return Some(next.response);
            }
            // Away from a peak the slope increases with the phase, and the line does not lead to the peak.
            if !angle.is_finite() || angle * next.slope <= 0.0 {
                return None;
            }
            near = Some(next);
        }
        None
    }

    /// Returns the angle to a peak that ends the search \[rad\].
    fn flat_angle(&self) -> f64 {
        match self.has_expensive_jacobian {
            true => DEAR,
            false => FLAT,
        }
    }

    /// Returns amplitude and angle of (cosine, sine).
    fn first_harmonic(&self, response: &Response, port: usize, slot: usize) -> [f64; 2] {
        let row = &response.displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        [a.hypot(b), b.atan2(a)]
    }

    /// Adds phase and slope to `response`. The phase is unwrapped to the turn nearest to `near`.
    fn phase_point(
        &self,
        response: Response,
        port: usize,
        slot: usize,
        near: f64,
    ) -> Result<PhasePoint, DynamicsError> {
        let row = &response.displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        let change = self.port_slope(&response, port, slot)?;
        let angle = b.atan2(a);
        let phase = angle + 2.0 * PI * ((near - angle) / (2.0 * PI)).round();
        let slope = (a * change[0] + b * change[1]) / (a * change[1] - b * change[0]);
        if !slope.is_finite() {
            return Err(DynamicsError::OutOfRange {
                name: "the change of amplitude with phase",
                value: slope,
                expected: "finite: the phase must change along the branch",
            });
        }
        Ok(PhasePoint {
            response,
            phase,
            slope,
        })
    }

    /// Computes the response with the phase `phase` on the branch through `near`.
    fn solve_at_phase(
        &self,
        near: &PhasePoint,
        phase: f64,
        port: usize,
        slot: usize,
    ) -> Result<PhasePoint, DynamicsError> {
        let condition = Condition::zero(Term {
            port,
            slot,
            weights: [-phase.sin(), phase.cos()],
        });
        let start: Start = near.response.start();
        let start = self.start_from(&start, near.response.omega, 1.0)?;
        let response = self.newton_to(ROUGHLY, start, 1.0, &condition)?;
        let place = self.phase_point(response, port, slot, phase)?;
        let size = |place: &PhasePoint| self.first_harmonic(&place.response, port, slot)[0];
        let ratio = size(&place) / size(near);
        if (place.phase - phase).abs() > 0.1 || !(1.0 / LEFT..LEFT).contains(&ratio) {
            return Err(DynamicsError::NoResonance {
                what: "continuous branch",
                from: near.response.frequency(),
                to: place.response.frequency(),
            });
        }
        Ok(place)
    }
}
