//! Resonance without a frequency response: the phase resonance (displacement 90° behind the drive) and the peak.

use std::f64::consts::PI;

use num_complex::Complex64;

use super::aft::InterfaceElement;
use super::closed_model::Precision;
use super::newton::{Condition, State, Term};
use super::{ContinuationSettings, DynamicsError, HarmonicBalance, Response, Start};

/// Points of the search for a start; a range is a few modes wide at most.
const SCAN: usize = 400;
/// Distances from a natural frequency at which a phase is looked at too, relative to it.
const BESIDE: [f64; 5] = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
/// Points of the search among nonlinear responses, when all else failed.
const NONLINEAR_SCAN: usize = 60;
/// Evaluations that the search over the range may take at least where raising the load found no resonance, and in parts of those that raising
/// it took.
const SCAN_LEAST: u64 = 2000;
const SCAN_SHARE: u64 = 4;
/// Halvings of an interval that has a resonance.
const BISECTIONS: usize = 40;
/// Width of that interval, relative to frequency, at which a phase that still leaps has no resonance between: half-power
/// bandwidths are above 1e-4.
const LEAP_WIDTH: f64 = 1e-7;
/// In-phase share of the displacement on both sides of a leap. Under friction alone at the largest force that it bounds it is 0.
const LEAP: f64 = 0.1;
/// Least factor between two loads on the way to the asked one.
const LEAST_FACTOR: f64 = 1.01;
/// Correction that is left to the responses to these loads, which are nothing but starts.
const ON_THE_WAY: f64 = 1e-3;
/// Relative change of frequency up to which the last two of them are taken to tell that of the next.
const AHEAD: f64 = 0.02;
/// Share of the elements that the first load may move out of their reference.
const FIRST_ACTIVE: f64 = 0.5;
/// Least load factor to start from; at smaller loads a preloaded joint is linear.
const LEAST_LOAD: f64 = 1e-9;
/// Relative change of frequency from which a phase resonance is looked at above it too, and how far above.
const FAR: f64 = 5e-3;
const ABOVE: f64 = 1e-3;
/// First step away from the phase resonance in search of the peak, relative to frequency.
const FIRST_STEP: f64 = 5e-4;
/// Width of the bracket of the peak, relative to frequency, that ends the search.
const PEAK_WIDTH: f64 = 1e-8;

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// The response whose displacement at the drive is 90° behind it, between the angular frequencies of `range`.
    ///
    /// From `guess` directly, if there is one: the response of a similar joint is a good one. Otherwise from the resonance of the
    /// linear structure, raising the load as far as needed in one go; where that fails, the strongest on the branch over the range.
    ///
    /// # Errors
    /// [`DynamicsError::NoResonance`] if there is none, also where nothing bounds it (no damping, and friction that slides), or
    /// that of the last attempt.
    pub fn phase_resonance(
        &self,
        range: (f64, f64),
        guess: Option<&Start>,
    ) -> Result<Response, DynamicsError> {
        let lag = self.phase_lag()?;
        if let Some(guess) = guess {
            // A guess of the wrong length is a mistake, and no reason to look elsewhere.
            let start = self.start_from(guess, guess.omega, 1.0)?;
            if let Ok(response) = self.resonance_from(start, [1.0, 0.0], &lag)
                && inside(range, &response)
            {
                return Ok(response);
            }
        }
        let before = self.effort.spent();
        let mut stopped = None;
        if let Some(omega) = self.linear_resonance(range)? {
            match self.raise_resonance(omega, &lag) {
                Ok(response) if inside(range, &response) => return Ok(response),
                Ok(_) => stopped = Some(no_resonance("phase resonance", range)),
                Err(error) => stopped = Some(error),
            }
        }
        // Where the joint slides as a whole, the branch over the range leads nowhere, and takes long to say so.
        let raised = self.effort.spent() - before;
        self.effort.allow(SCAN_LEAST.max(SCAN_SHARE * raised));
        let found = self.scan_resonance(range, &lag);
        let is_cut = self.effort.is_spent();
        self.effort.unbound();
        match (found, stopped) {
            (Err(error), Some(stopped)) if is_cut || error.is_not_converged() => Err(stopped),
            (found, _) => found,
        }
    }

    /// The response whose displacement at the drive is 90° behind it, from `guess` alone: the resonance that `guess` is near.
    ///
    /// # Errors
    /// That of Newton's method, or [`DynamicsError::NoResonance`] if it leads out of the range.
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

    /// The phase resonance that Newton's method leads to from a state at this load factor, to this tolerance. Far from where it began the phase may be
    /// that of an antiresonance, where the displacement passes from behind the drive to in phase with it.
    ///
    /// # Errors
    /// That of Newton's method, or [`DynamicsError::NoResonance`] at an antiresonance.
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

    /// Re(û F̂*), which is zero at a phase resonance.
    fn phase_lag(&self) -> Result<Term, DynamicsError> {
        let slot = self.harmonics().require(1, "phase resonance")?;
        let Some(load) = self.drive() else {
            return Err(DynamicsError::OutOfRange {
                name: "the amplitude of the drive",
                value: 0.0,
                expected: "different from zero: a phase resonance is a phase behind a load",
            });
        };
        let size = load.cosine.hypot(load.sine);
        Ok(Term {
            port: load.port,
            slot,
            weights: [load.cosine / size, load.sine / size],
        })
    }

    /// In-phase part and size of the displacement at the drive for the term of [`Self::phase_lag`].
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

    /// The strongest phase resonance of the reference state, looked for somewhat above the range too: friction lowers it.
    fn linear_resonance(&self, range: (f64, f64)) -> Result<Option<f64>, DynamicsError> {
        let found = self.linear_phase_resonances((range.0, range.1 + 0.5 * (range.1 - range.0)))?;
        let strongest = found
            .into_iter()
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        Ok(strongest.map(|(omega, _)| omega))
    }

    /// The phase resonances of the reference state between two angular frequencies \[rad/s\], ascending, and the displacement at the drive \[m\].
    pub(super) fn linear_phase_resonances(
        &self,
        range: (f64, f64),
    ) -> Result<Vec<(f64, f64)>, DynamicsError> {
        let Term {
            port,
            slot,
            weights,
        } = self.phase_lag()?;
        let among = self.model.among(&self.load_ports, Precision::Double);
        let n = self.harmonics().coefficients();
        let amplitude = |row: &[f64]| Complex64::new(row[slot], -row[slot + 1]);
        let drive = self.load_ports.iter().position(|p| *p == port);
        // In-phase part and size of the displacement at the drive.
        let at = |omega: f64| -> Result<(f64, f64), DynamicsError> {
            let loads = self.loads_at(omega, 1.0);
            let forces: Vec<Complex64> = loads.chunks(n).map(amplitude).collect();
            let receptance = among.receptance(&self.model.core.receptance(omega)?);
            let u = receptance.apply(&forces)[drive.unwrap_or(0)];
            Ok((weights[0] * u.re - weights[1] * u.im, u.norm()))
        };
        let places = self.places(range.0, range.1);
        let mut found = Vec::new();
        let mut before: Option<(f64, f64)> = None;
        for high in places {
            let now = match at(high) {
                Ok((now, _)) => now,
                // Without damping a resonance itself has no response.
                Err(error) if error.is_singular() => continue,
                Err(error) => return Err(error),
            };
            // From in phase to behind: a resonance; the other way round: an antiresonance.
            if let Some((low, part)) = before
                && part > 0.0
                && now <= 0.0
            {
                let (mut low, mut high) = (low, high);
                for _ in 0..60 {
                    let middle = 0.5 * (low + high);
                    if middle <= low || middle >= high {
                        break;
                    }
                    match at(middle) {
                        Ok((value, _)) if value > 0.0 => low = middle,
                        Ok(_) => high = middle,
                        Err(error) if error.is_singular() => break,
                        Err(error) => return Err(error),
                    }
                }
                found.push((low, at(low)?.1));
            }
            before = Some((high, now));
        }
        Ok(found)
    }

    /// Where a phase is looked at between two angular frequencies, ascending: all over, and close to every natural frequency, so that two
    /// near each other are told apart.
    fn places(&self, from: f64, to: f64) -> Vec<f64> {
        let step = (to - from) / SCAN as f64;
        let mut places: Vec<f64> = (0..=SCAN).map(|k| from + k as f64 * step).collect();
        for natural in self.model.core.natural_frequencies() {
            let beside = BESIDE.iter().flat_map(|d| [1.0 - d, 1.0 + d]);
            places.extend(beside.map(|ratio| ratio * natural));
        }
        places.retain(|omega| (from..=to).contains(omega));
        places.sort_by(f64::total_cmp);
        places
    }

    /// The load factor to begin from: at which the linear resonance would make some elements slip or open, not most of them. Newton's
    /// method leads from there; from a linear response far beyond it takes its time to fail.
    fn first_load(&self, omega: f64) -> Result<f64, DynamicsError> {
        let most = (FIRST_ACTIVE * self.elements.len() as f64).ceil();
        let mut factor = 1.0;
        while factor > LEAST_LOAD {
            let start = self.linear_start(omega, factor)?;
            let rows = start.contact.chunks(self.width());
            let elements = self.elements.iter().zip(rows).zip(&start.active);
            let moved = elements.filter(|(_, active)| **active);
            let moved = moved.map(|((element, row), _)| {
                1.0 - element.following_share(&self.sampling.synthesise(row))
            });
            if moved.sum::<f64>() <= most {
                break;
            }
            factor *= 0.5;
        }
        // The sliders of a bank yield one after the other: half of them is far already.
        let beyond = if self.is_costly { 1.0 } else { 2.0 };
        Ok(f64::min(beyond * factor, 1.0))
    }

    /// From the linear resonance at a load that is small enough, up to the whole load.
    ///
    /// # Errors
    /// [`DynamicsError::Overloaded`] with the largest load that has a resonance, or that of the first solve.
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
        // No load is none of a response.
        let mut before = Start {
            omega,
            load_factor: 0.0,
            displacement: vec![0.0; last.displacement.len()],
        };
        let mut growth = 2.0;
        while last.load_factor < 1.0 {
            let next = (last.load_factor * growth).min(1.0);
            let ahead = ahead(&before, last.start(), next);
            let start = self.start_from(&ahead, ahead.omega, next)?;
            match self.resonance_from(start, [next, tolerance(next)], lag) {
                Ok(response) => {
                    before = last.start();
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

    /// That the phase resonance `last` could not be followed to a larger load.
    fn overloaded(&self, last: &Response, why: DynamicsError) -> DynamicsError {
        let rows = last.displacement.chunks(self.width());
        let slips = self.elements.iter().zip(rows).map(|(element, row)| {
            let displacement = self.sampling.synthesise(row);
            match element.follows_reference(&displacement) {
                true => 0.0,
                false => 1.0 - element.following_share(&displacement),
            }
        });
        let slipping = slips.sum::<f64>() / self.elements.len().max(1) as f64;
        DynamicsError::Overloaded {
            frequency: last.frequency(),
            load_factor: last.load_factor,
            slipping,
            last: Box::new(why),
        }
    }

    /// The strongest phase resonance on the branch over the range, which may turn back, or among responses at frequencies of it
    /// where the branch cannot be followed.
    ///
    /// # Errors
    /// [`DynamicsError::NoResonance`] if there is none or nothing bounds its amplitude, or what kept from knowing.
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

    /// The strongest phase resonance between neighbours of `branch`.
    fn crossing(
        &self,
        branch: &[Option<Response>],
        range: (f64, f64),
        lag: &Term,
    ) -> Result<Option<Response>, DynamicsError> {
        let (found, failure) = self.crossings(branch, range, lag);
        let size = |response: &Response| self.in_phase(lag, &response.displacement).1;
        let strongest = found.into_iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        match (strongest, failure) {
            (Some(response), _) => Ok(Some(response)),
            (None, Some(error)) => Err(error),
            (None, None) => Ok(None),
        }
    }

    /// All phase resonances between neighbours of `branch`, and why one of them was not found.
    fn crossings(
        &self,
        branch: &[Option<Response>],
        range: (f64, f64),
        lag: &Term,
    ) -> (Vec<Response>, Option<DynamicsError>) {
        let (mut found, mut failure) = (Vec::new(), None);
        for pair in branch.windows(2) {
            let [Some(before), Some(after)] = pair else {
                continue;
            };
            let side = |response: &Response| self.in_phase(lag, &response.displacement).0;
            if !(side(before) > 0.0 && side(after) <= 0.0) {
                continue;
            }
            match self.resonance_between(before, after, range, lag) {
                Ok(response) if inside(range, &response) => found.push(response),
                Ok(_) => {}
                Err(error) => failure = Some(error),
            }
        }
        (found, failure)
    }

    /// The phase resonance between a response in phase with the drive and one behind it.
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
                match self.newton(start, 1.0, &Condition::zero(*lag)) {
                    Ok(response) => return Ok(response),
                    Err(error) => failure = Some(error),
                }
            }
            let share = |response: &Response| {
                let (part, size) = self.in_phase(lag, &response.displacement);
                part.abs() / size.max(f64::MIN_POSITIVE)
            };
            if (high.omega - low.omega).abs() <= LEAP_WIDTH * low.omega {
                // Friction bounds an amplitude by at most 4/π of its limit, and nothing does without it.
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

    /// The response with the largest first harmonic at `port`, between the angular frequencies of `range`, near `guess` (the
    /// phase resonance is a good one).
    ///
    /// A root of the derivative of the squared amplitude along the branch, so a plateau is no difficulty. The phase at the port leads
    /// along the branch, which changes steadily over a resonance also where the branch overhangs; where it does not, the frequency.
    ///
    /// # Errors
    /// [`DynamicsError::NoResonance`] if the amplitude still rises at the end of the range, or that of a solve.
    pub fn peak(
        &self,
        port: usize,
        range: (f64, f64),
        guess: &Start,
    ) -> Result<Response, DynamicsError> {
        let start = self.solve(guess.omega.clamp(range.0, range.1), Some(guess))?;
        self.peak_from(port, range, start)
    }

    /// The response with the largest first harmonic at `port`, between the angular frequencies of `range`, near the response `start`.
    ///
    /// # Errors
    /// As [`Self::peak`].
    pub(super) fn peak_from(
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
        // Uphill until the slope changes its sign.
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
        // Regula falsi with halved weights (Illinois), and bisection now and then: the slope may jump.
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

/// Where two states lead in a straight line, at the load `factor`.
fn ahead(before: &Start, last: Start, factor: f64) -> Start {
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

// The peak of a resonance along its branch, with the phase of the response as the coordinate: also where the branch overhangs.

/// First and largest step of phase \[rad\].
const FIRST_PHASE_STEP: f64 = 0.02;
const LARGEST_STEP: f64 = 0.2;
/// Least step of phase before the coordinate is given up \[rad\].
const LEAST_STEP: f64 = 1e-4;
/// A step that changes the amplitude by more than this factor has left the branch.
const LEFT: f64 = 1.5;
/// Phase from the start within which the peak is that of the same resonance \[rad\].
const FARTHEST: f64 = 0.5 * PI;
/// The angle to the peak of the resonance curve that ends the search where responses cost much, and where each is dear \[rad\]: the
/// amplitude is right to half its square.
const FLAT: f64 = 5e-3;
const DEAR: f64 = 1e-2;
/// Correction that is left to the responses that lead there: less than what the angle leaves.
const ROUGHLY: f64 = 1e-6;
/// Share of the amplitude that a peak which cost little may still rise by.
const RISE: f64 = 1e-6;
/// Steps to it.
const SLOPES: usize = 5;

/// A response on the branch and the derivative of its amplitude's logarithm by phase.
struct Place {
    response: Response,
    phase: f64,
    slope: f64,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// The local peak near `start`, along the branch.
    pub(super) fn peak_by_phase(
        &self,
        port: usize,
        range: (f64, f64),
        start: &Response,
    ) -> Result<Response, DynamicsError> {
        let slot = self.harmonics().require(1, "peak")?;
        let lost = || {
            let turn = 2.0 * PI;
            DynamicsError::NoResonance {
                what: "peak",
                from: range.0 / turn,
                to: range.1 / turn,
            }
        };
        let origin = self.first_harmonic(start, port, slot)[1];
        let mut near = self.place(start.clone(), port, slot, origin)?;
        let flat = self.flat();
        if near.slope == 0.0 || self.is_costly && near.slope.abs() <= flat {
            return Ok(near.response);
        }
        if let Some(peak) = self.peak_by_slopes(&near, port, slot)
            && (range.0..=range.1).contains(&peak.omega)
        {
            return Ok(peak);
        }
        let uphill = near.slope.signum();
        let mut step = FIRST_PHASE_STEP;
        let mut far = loop {
            let phase = near.phase + step * uphill;
            if (phase - origin).abs() > FARTHEST {
                return Err(lost());
            }
            match self.at_phase(&near, phase, port, slot) {
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
        // Regula falsi with halved weights (Illinois), and bisection now and then: the slope may jump.
        let (mut near_weight, mut far_weight) = (near.slope, far.slope);
        let narrow = flat;
        for iteration in 0..60 {
            let width = far.phase - near.phase;
            if width.abs() <= narrow || far.slope == 0.0 {
                break;
            }
            let share = if iteration % 4 == 3 {
                0.5
            } else {
                (near_weight / (near_weight - far_weight)).clamp(0.01, 0.99)
            };
            let next = self.at_phase(&near, near.phase + share * width, port, slot)?;
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
        let size = |place: &Place| self.first_harmonic(&place.response, port, slot)[0];
        let peak = if size(&far) > size(&near) { far } else { near }.response;
        if peak.omega < range.0 || peak.omega > range.1 {
            return Err(lost());
        }
        Ok(peak)
    }

    /// The peak in few steps: where the resonance curve is a circle, as that of a linear resonance is, its amplitude is the cosine of the
    /// angle to the peak, so that one slope tells that angle; from then on where the line through two slopes says. None unless they lead
    /// there.
    fn peak_by_slopes(&self, start: &Place, port: usize, slot: usize) -> Option<Response> {
        let mut angle = start.slope.atan();
        let mut near: Option<Place> = None;
        for _ in 0..SLOPES {
            let from = near.as_ref().unwrap_or(start);
            let phase = from.phase + angle.clamp(-LARGEST_STEP, LARGEST_STEP);
            if (phase - start.phase).abs() > FARTHEST {
                return None;
            }
            let next = self.at_phase(from, phase, port, slot).ok()?;
            if next.slope == 0.0 || self.is_costly && next.slope.abs() <= self.flat() {
                return Some(next.response);
            }
            angle = -next.slope * (next.phase - from.phase) / (next.slope - from.slope);
            // Friction may make a peak so flat that a small slope is far from it: what it still rises by decides.
            if (0.5 * angle * next.slope).abs() <= RISE {
                return Some(next.response);
            }
            // Away from a peak the slope rises along the phase: no line leads there.
            if !angle.is_finite() || angle * next.slope <= 0.0 {
                return None;
            }
            near = Some(next);
        }
        None
    }

    /// The angle to a peak that ends the search for it \[rad\].
    fn flat(&self) -> f64 {
        match self.is_costly {
            true => DEAR,
            false => FLAT,
        }
    }

    /// Amplitude and angle of (cosine, sine).
    fn first_harmonic(&self, response: &Response, port: usize, slot: usize) -> [f64; 2] {
        let row = &response.displacement[port * self.harmonics().coefficients()..];
        let (a, b) = (row[slot], row[slot + 1]);
        [a.hypot(b), b.atan2(a)]
    }

    /// `response` with its phase, the turn of it next to `near`.
    fn place(
        &self,
        response: Response,
        port: usize,
        slot: usize,
        near: f64,
    ) -> Result<Place, DynamicsError> {
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
                expected: "finite: the phase changes along the branch",
            });
        }
        Ok(Place {
            response,
            phase,
            slope,
        })
    }

    /// The response of the branch through `near` whose phase is `phase`.
    fn at_phase(
        &self,
        near: &Place,
        phase: f64,
        port: usize,
        slot: usize,
    ) -> Result<Place, DynamicsError> {
        let condition = Condition::zero(Term {
            port,
            slot,
            weights: [-phase.sin(), phase.cos()],
        });
        let start: Start = near.response.start();
        let start = self.start_from(&start, near.response.omega, 1.0)?;
        let response = self.newton_to(ROUGHLY, start, 1.0, &condition)?;
        let place = self.place(response, port, slot, phase)?;
        let size = |place: &Place| self.first_harmonic(&place.response, port, slot)[0];
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
