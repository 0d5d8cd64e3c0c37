//! The harmonics that are left out, and samples that are too few: what more would change, and as many harmonics as leave little.

use super::contact_element::ContactElement;
use super::newton::FREQUENCY_WEIGHT;
use super::response::Energy;
use super::vibration::{Resonance, ResonanceKind, Vibration};
use super::{DynamicsError, HarmonicBalance, Harmonics, Response, Start};
use crate::journal::Journal;
use crate::linalg::add_scaled;

/// The change from the harmonics of a balance to about twice as many, times this, is taken for their error: these leave out at least a third of it
/// too, as what friction leaves out falls about like the square of the first missing order.
pub(super) const TAIL: f64 = 2.0;
/// The same where the response with about twice as many harmonics is what is taken: what that leaves out itself. By a tail like the inverse square of
/// the order it is a quarter.
const LEFT_OUT: f64 = 1.0 / 3.0;
/// The correction that is left to a response that is taken.
const TAKEN: f64 = 1e-3;
/// Part of the error that more harmonics have to leave at most to be worth another doubling.
const GAIN: f64 = 0.7;
/// Where a response is dear, the correction that is left to that with more harmonics, and counts as an error: few harmonics leave out several times
/// as much. Banks that lift off and land again may leave Newton's method no less.
const ESTIMATED: f64 = 1e-2;
/// The correction that is left where a response has many unknowns but is not dear; it is small against what harmonics leave out.
const ROUGHLY: f64 = 1e-5;
/// Error where no response was found with more harmonics: nothing is known.
pub(super) const UNKNOWN: f64 = 1.0;
/// The highest order to which harmonics are extended: 340 elements have 64 000 unknowns then.
const HIGHEST: u32 = 31;
/// Share of the input below which a dissipation is faint: what is rounding of the input is no error of it.
pub(super) const FAINT_DISSIPATION: f64 = 1e-6;
/// Highest order of the harmonics with which a response of many is looked for first.
const FEW: u32 = 3;

/// Estimated errors of a resonance by harmonics that are left out, and by samples that are too few, relative.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truncation {
    /// Of the frequency of the phase resonance.
    pub frequency: f64,
    /// Of the amplitude there, and of the peak.
    pub amplitude: f64,
    /// Of the energy that friction dissipates in a cycle.
    pub friction_energy: f64,
    /// What the frequency is expected to be more with all of them, by the estimate alone; none where it is not known.
    pub expected: Option<f64>,
}

impl Truncation {
    /// Where no response was found with more harmonics.
    const UNKNOWN: Truncation = Truncation {
        frequency: UNKNOWN,
        amplitude: UNKNOWN,
        friction_energy: UNKNOWN,
        expected: None,
    };

    /// Where nothing is left out.
    pub const NONE: Truncation = Truncation {
        frequency: 0.0,
        amplitude: 0.0,
        friction_energy: 0.0,
        expected: Some(0.0),
    };

    fn and(self, other: Truncation) -> Truncation {
        Truncation {
            frequency: self.frequency + other.frequency,
            amplitude: self.amplitude + other.amplitude,
            friction_energy: self.friction_energy + other.friction_energy,
            expected: self.expected.zip(other.expected).map(|(a, b)| a + b),
        }
    }

    /// Adds what Newton's method has left of a resonance beyond its `tolerance`. A figure of which nothing is known, or that is rounding, is in error
    /// as a whole.
    fn bounded(self, resonance: &Resonance, tolerance: f64) -> Truncation {
        let left = resonance
            .in_force()
            .correction
            .max(resonance.peak.correction);
        let left = if left > tolerance { left } else { 0.0 };
        let amplitude = match resonance.is_still {
            true => UNKNOWN,
            false => self.amplitude,
        };
        Truncation {
            frequency: self.frequency.min(UNKNOWN) + left,
            amplitude: amplitude.min(UNKNOWN) + left,
            friction_energy: self.friction_energy.min(UNKNOWN) + left,
            ..self
        }
    }

    fn scaled(self, factor: f64) -> Truncation {
        Truncation {
            frequency: factor * self.frequency,
            amplitude: factor * self.amplitude,
            friction_energy: factor * self.friction_energy,
            expected: self.expected,
        }
    }

    /// The larger of the errors of amplitude and dissipation, to which harmonics are extended.
    pub fn largest(&self) -> f64 {
        self.amplitude.max(self.friction_energy)
    }
}

/// A resonance, the balance that it solves, and what that leaves out.
pub struct Resolved<'a> {
    pub balance: HarmonicBalance<ContactElement>,
    pub resonance: Resonance,
    pub truncation: Truncation,
    pub(super) vibration: &'a Vibration,
    /// Whether its peak and its errors are still to be found.
    is_open: bool,
    /// What the response with more harmonics has otherwise, where that was wanted.
    pub correction: Option<Correction>,
    /// The responses with more harmonics that were solved, one after the other.
    pub extensions: Vec<Extension>,
}

/// That the response with more harmonics is taken for a response.
#[derive(Debug, Clone, Copy)]
pub struct HarmonicCorrection<'a> {
    /// What it had otherwise in a response near it, where that is known: it begins from there.
    pub near: Option<&'a Correction>,
}

/// A response with more harmonics, and what it took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extension {
    /// The highest order.
    pub highest: u32,
    /// The larger of the errors of amplitude and dissipation that are known with it.
    pub error: f64,
    /// Newton iterations to it.
    pub iterations: usize,
    /// Coefficients of the contact displacements.
    pub unknowns: usize,
}

/// What a response with about twice as many harmonics has otherwise. It changes little from one response to a next one near it.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Change of the displacement of the ports, `ports × coefficients` \[m\].
    pub displacement: Vec<f64>,
    /// Relative change of the frequency.
    pub frequency: f64,
    /// Relative change of the energies: input, friction, viscous and hysteretic damping.
    pub energy: [f64; 4],
}

impl Correction {
    /// That of a response which is taken as it is.
    fn none(of: &HarmonicBalance<ContactElement>, response: &Response) -> Correction {
        Correction {
            harmonics: of.harmonics().clone(),
            displacement: vec![0.0; response.displacement.len()],
            frequency: 0.0,
            energy: [0.0; 4],
        }
    }

    /// From the response of a balance to that of a finer one.
    fn between(
        of: &HarmonicBalance<ContactElement>,
        response: &Response,
        finer: &HarmonicBalance<ContactElement>,
        fine: &Response,
    ) -> Correction {
        let from = of
            .harmonics()
            .transfer(&response.displacement, finer.harmonics());
        let change = |from: f64, to: f64| if from == 0.0 { 0.0 } else { to / from - 1.0 };
        let pairs = energies(response).into_iter().zip(energies(fine));
        let mut energy = [0.0; 4];
        energy
            .iter_mut()
            .zip(pairs)
            .for_each(|(e, (from, to))| *e = change(from, to));
        Correction {
            harmonics: finer.harmonics().clone(),
            displacement: fine
                .displacement
                .iter()
                .zip(&from)
                .map(|(to, from)| to - from)
                .collect(),
            frequency: change(response.omega, fine.omega),
            energy,
        }
    }

    /// A response of a balance as `finer`, which has the harmonics of the correction, would have it.
    fn applied(
        &self,
        of: &HarmonicBalance<ContactElement>,
        response: &Response,
        finer: &HarmonicBalance<ContactElement>,
    ) -> Response {
        let mut displacement = of
            .harmonics()
            .transfer(&response.displacement, &self.harmonics);
        add_scaled(&mut displacement, 1.0, &self.displacement);
        let [input, friction, viscous, hysteretic] = {
            let mut energies = energies(response);
            energies
                .iter_mut()
                .zip(self.energy)
                .for_each(|(e, change)| *e *= 1.0 + change);
            energies
        };
        Response {
            omega: response.omega * (1.0 + self.frequency),
            force: finer.forces(&displacement),
            displacement,
            energy: Energy {
                input,
                friction,
                viscous,
                hysteretic,
            },
            ..response.clone()
        }
    }
}

fn energies(response: &Response) -> [f64; 4] {
    let energy = response.energy;
    [
        energy.input,
        energy.friction,
        energy.viscous,
        energy.hysteretic,
    ]
}

impl Vibration {
    /// The resonance with these contact elements, or the response at the given frequency, from a response in some harmonics if there is one; with the harmonics of the
    /// vibration, or those of the start if they are more. With a `tolerance` they are extended until the estimated errors of
    /// amplitude and dissipation are within it, up to order 31.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn resolve(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
        tolerance: Option<f64>,
    ) -> Result<Resolved<'_>, DynamicsError> {
        self.resolve_in_force(elements, start)?
            .completed(tolerance, None)
    }

    /// The resonance of [`Vibration::resolve`], but for the peak, the errors and the harmonics that these ask for: for whoever may look for another
    /// response with other elements before [`Resolved::completed`].
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn resolve_in_force(
        &self,
        elements: Vec<ContactElement>,
        start: Option<(&Harmonics, &Start)>,
    ) -> Result<Resolved<'_>, DynamicsError> {
        let harmonics = match start {
            Some((of_start, _)) if of_start.highest() > self.harmonics.highest() => of_start,
            _ => &self.harmonics,
        };
        let balance = self.balance_of(elements, harmonics.clone())?;
        let start = match start {
            Some((of_start, start)) => Some(start.transferred(of_start, harmonics)),
            None => self.start_in_few(&balance),
        };
        let response = self.response_in_force(&balance, start.as_ref())?;
        Ok(Resolved {
            resonance: self.without_peak(&balance, response)?,
            balance,
            truncation: Truncation::UNKNOWN,
            vibration: self,
            is_open: true,
            correction: None,
            extensions: Vec::new(),
        })
    }

    /// A resonance with its errors. With a `tolerance` its harmonics are extended until these are within it. Where the response with more harmonics is
    /// `taken`, from what it had otherwise before if that is known, the errors are those of that one, and they are extended only as long as they gain by it.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub(super) fn extended(
        &self,
        balance: HarmonicBalance<ContactElement>,
        resonance: Resonance,
        tolerance: Option<f64>,
        taken: Option<HarmonicCorrection>,
    ) -> Result<Resolved<'_>, DynamicsError> {
        let mut resolved = Resolved {
            resonance,
            balance,
            truncation: Truncation::UNKNOWN,
            vibration: self,
            is_open: false,
            correction: None,
            extensions: Vec::new(),
        };
        let mut before = f64::INFINITY;
        // Without a tolerance both errors are of this resonance, and are found at the same time.
        let mut of_samples = None;
        let mut estimate = match tolerance {
            Some(_) => resolved.estimate(taken),
            None => {
                let threads = &resolved.balance.threads;
                let (estimate, errors) =
                    threads.both(|| resolved.estimate(taken), || resolved.errors_of_samples());
                of_samples = Some(errors);
                estimate
            }
        };
        while let Some((truncation, found)) = estimate {
            resolved.truncation = truncation;
            let Some((finer, resonance)) = found else {
                break;
            };
            let left = resolved.truncation.largest();
            let gains = taken.is_none() || left <= GAIN * before;
            let enough = tolerance.is_none_or(|tolerance| left <= tolerance);
            let coefficients = finer.harmonics().coefficients();
            resolved.extensions.push(Extension {
                highest: finer.harmonics().highest(),
                error: left,
                iterations: resonance.in_force().iterations,
                unknowns: 3 * finer.elements().len() * coefficients,
            });
            if taken.is_some() {
                resolved.correction = Some(Correction::between(
                    &resolved.balance,
                    resolved.resonance.in_force(),
                    &finer,
                    resonance.in_force(),
                ));
            }
            let finer = finer.harmonics().clone();
            if enough || !gains || finer.highest() > HIGHEST {
                break;
            }
            before = left;
            let balance = self.balance_of(resolved.balance.elements().to_vec(), finer)?;
            // A peak that more harmonics move out of the range leaves what there is.
            let phase = resonance.phase.as_ref().map(Response::start);
            let peak = resonance.peak.start();
            let Ok(resonance) = self.resonance_near(&balance, phase.as_ref(), &peak) else {
                break;
            };
            let before = &resolved.resonance;
            let is_end = before.peak_kind == ResonanceKind::End;
            resolved.resonance = Resonance {
                is_beside: before.is_beside,
                peak_kind: match is_end {
                    true => ResonanceKind::End,
                    false => resonance.peak_kind,
                },
                ..resonance
            };
            resolved.balance = balance;
            resolved.correction = None;
            estimate = resolved.estimate(taken);
        }
        let tolerance = resolved.balance.settings.tolerance;
        let of_samples = of_samples.unwrap_or_else(|| resolved.errors_of_samples());
        let all = resolved.truncation.and(of_samples);
        resolved.truncation = all.bounded(&resolved.resonance, tolerance);
        Ok(resolved)
    }

    /// A start for many harmonics: the response in force in the lowest, which is found at a small part of the cost.
    fn start_in_few(&self, balance: &HarmonicBalance<ContactElement>) -> Option<Start> {
        let orders = balance.harmonics().orders();
        let loads = || self.loads.iter().chain(&self.inertial_loads);
        let driven = |order: &u32| loads().any(|load| load.harmonic == *order);
        let few = orders.iter().filter(|o| **o <= FEW || driven(o)).copied();
        let few = Harmonics::new(&few.collect::<Vec<u32>>()).ok()?;
        if few.orders() == orders {
            return None;
        }
        let first = self.balance_of(balance.elements().to_vec(), few).ok()?;
        let response = self.response_in_force(&first, None).ok()?;
        Some(
            response
                .start()
                .transferred(first.harmonics(), balance.harmonics()),
        )
    }
}

impl Resolved<'_> {
    /// Amplitude \[m\] that the peak does not exceed, whatever the contact does; none where damping does not limit it, and of a structure with a
    /// residual flexibility.
    pub fn peak_bound(&self) -> Option<f64> {
        self.vibration.peak_bound()
    }

    /// With the peak and the errors, where they have not been found yet.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn completed(
        mut self,
        tolerance: Option<f64>,
        taken: Option<HarmonicCorrection>,
    ) -> Result<Self, DynamicsError> {
        self = self.with_peak()?;
        let mut extended =
            self.vibration
                .extended(self.balance, self.resonance, tolerance, taken)?;
        if taken.is_some() && extended.correction.is_none() {
            let (balance, response) = (&extended.balance, extended.resonance.in_force());
            extended.correction = Some(Correction::none(balance, response));
        }
        Ok(extended)
    }

    /// With the peak, and errors and a correction that are those of a response near it.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn completed_as(
        self,
        truncation: Truncation,
        correction: Correction,
    ) -> Result<Self, DynamicsError> {
        Ok(Resolved {
            truncation,
            correction: Some(correction),
            is_open: false,
            ..self.with_peak()?
        })
    }

    /// With the peak.
    ///
    /// # Errors
    /// Those of [`Vibration::resonance`].
    pub fn with_peak(mut self) -> Result<Self, DynamicsError> {
        if let Some(phase) = self.resonance.phase.take_if(|_| self.is_open) {
            self.resonance = self.vibration.beside(&self.balance, phase)?;
        }
        Ok(self)
    }

    /// As its correction makes it, where it has one: the response with more harmonics.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn corrected(&self) -> Result<Self, DynamicsError> {
        let as_it_is = Resolved {
            balance: self.balance.clone(),
            resonance: self.resonance.clone(),
            correction: self.correction.clone(),
            extensions: self.extensions.clone(),
            ..*self
        };
        let Some(correction) = &self.correction else {
            return Ok(as_it_is);
        };
        let vibration = self.vibration;
        let finer = vibration.finer(&self.balance, correction.harmonics.clone(), 1)?;
        let of = |response: &Response| correction.applied(&self.balance, response, &finer);
        let before = &self.resonance;
        let phase = before.phase.as_ref().map(of);
        let resonance =
            vibration.resonance_of(&finer, phase, of(&before.peak), before.iterations)?;
        let resonance = Resonance {
            peak_kind: before.peak_kind,
            is_beside: before.is_beside,
            branch: before.branch,
            ..resonance
        };
        Ok(Resolved {
            balance: finer,
            resonance,
            ..as_it_is
        })
    }

    /// The errors by harmonics left out, from the resonance with the harmonics [`Harmonics::beyond`], which may be `taken` for it; its balance and that
    /// resonance, but where the response is linear, as harmonics other than those of the loads stay 0. None where no resonance is found; the errors are then
    /// those known before.
    #[allow(clippy::type_complexity)]
    fn estimate(
        &self,
        taken: Option<HarmonicCorrection>,
    ) -> Option<(
        Truncation,
        Option<(HarmonicBalance<ContactElement>, Resonance)>,
    )> {
        if self.is_linear() {
            return Some((Truncation::NONE, None));
        }
        let harmonics = self.balance.harmonics().beyond();
        let finer = self.vibration.finer(&self.balance, harmonics, 1).ok()?;
        let (truncation, resonance) = self.errors_by(&finer, taken)?;
        let truncation = match taken {
            Some(_) => Truncation {
                expected: truncation.expected.map(|change| LEFT_OUT * change),
                ..truncation.scaled(LEFT_OUT / TAIL)
            },
            None => truncation,
        };
        Some((truncation, Some((finer, resonance))))
    }

    /// Errors by samples that are too few, from the resonance with twice as many. They are apart from those by harmonics, which may cancel them.
    fn errors_of_samples(&self) -> Truncation {
        if self.is_linear() {
            return Truncation::NONE;
        }
        let harmonics = self.balance.harmonics().clone();
        let twice = self.vibration.finer(&self.balance, harmonics, 2);
        // It may go on beside another solve, so that its own are not kept in an order.
        let twice = twice.map(|twice| HarmonicBalance {
            journal: Journal::default(),
            ..twice
        });
        let found = twice.ok().and_then(|twice| self.errors_by(&twice, None));
        let mut errors = found.map_or(Truncation::UNKNOWN, |(errors, _)| errors);
        let in_work = self.balance.work_error(self.resonance.in_force());
        errors.friction_energy = errors.friction_energy.max(in_work);
        errors
    }

    fn is_linear(&self) -> bool {
        let Resonance { peak, .. } = &self.resonance;
        let both = [self.resonance.in_force(), peak];
        both.iter().all(|response| response.active_elements() == 0)
    }

    /// The errors by what the resonance differs from that of another balance, which is solved from it, and that; none where it is not found.
    ///
    /// One figure may change by little only because two larger changes of it cancel. That of the amplitude is therefore taken to be at
    /// least what the coefficients of the contact displacements change by on the whole, and that of the dissipation is the sum of the
    /// changes of all elements.
    fn errors_by(
        &self,
        finer: &HarmonicBalance<ContactElement>,
        taken: Option<HarmonicCorrection>,
    ) -> Option<(Truncation, Resonance)> {
        let coarse = self.resonance.in_force();
        let harmonics = self.balance.harmonics();
        let Resonance {
            phase, is_beside, ..
        } = &self.resonance;
        let mut finer = finer.clone();
        let enough = match finer.is_costly {
            true if taken.is_some() => TAKEN,
            true => ESTIMATED,
            false => ROUGHLY,
        };
        finer.settings.tolerance = finer.settings.tolerance.max(enough);
        let solve = || -> Result<_, DynamicsError> {
            let to_finer = |response: &Response| {
                let start = response.start();
                start.transferred(harmonics, finer.harmonics())
            };
            let start = to_finer(coarse);
            let near = taken.and_then(|taken| taken.near);
            let near = near.filter(|near| near.harmonics == *finer.harmonics());
            let nearer = |start: &Start| {
                let mut start = start.clone();
                if let Some(near) = near {
                    add_scaled(&mut start.displacement, 1.0, &near.displacement);
                    start.omega *= 1.0 + near.frequency;
                }
                start
            };
            let fine = match is_beside {
                // That peak follows the phase resonance, and is not looked for again.
                true => {
                    let range = self.vibration.range;
                    let phase = finer.phase_resonance_near(range, &nearer(&start))?;
                    self.vibration
                        .resonance_of(&finer, Some(phase.clone()), phase, 0)?
                }
                false => {
                    let peak = nearer(&to_finer(&self.resonance.peak));
                    let phase = phase.as_ref().map(|_| nearer(&start));
                    self.vibration
                        .resonance_near(&finer, phase.as_ref(), &peak)?
                }
            };
            Ok((start, fine))
        };
        let (start, fine) = solve().ok()?;
        let contact = 3 * finer.elements().len() * finer.harmonics().coefficients();
        let left = fine.in_force().correction.max(fine.peak.correction);
        let whole = distance(
            &start.displacement[..contact],
            &fine.in_force().displacement[..contact],
            harmonics,
            finer.harmonics(),
        ) + left;
        // Of a figure that is 0 there nothing is known, and nothing where both are.
        let change = |coarse: f64, fine: f64| match (coarse / fine - 1.0).abs() {
            change if change <= UNKNOWN => change,
            _ if coarse == fine => 0.0,
            _ => UNKNOWN,
        };
        // What one element dissipates more and another less adds up: it wears elsewhere.
        let [before, after] = [
            self.balance.dissipated_energies(coarse),
            finer.dissipated_energies(fine.in_force()),
        ];
        let moved: f64 = before.iter().zip(&after).map(|(b, a)| (b - a).abs()).sum();
        let all: f64 = after.iter().map(|energy| energy.abs()).sum();
        let all = all.max(FAINT_DISSIPATION * fine.in_force().energy.input.abs());
        let energy = match moved / all + left {
            change if change <= UNKNOWN => change,
            _ if moved == 0.0 => 0.0,
            _ => UNKNOWN,
        };
        // Of an amplitude that is rounding there is no error but that of what moves elsewhere.
        let is_still = self.resonance.is_still;
        let peak = match is_beside {
            _ if is_still => 0.0,
            false => change(self.resonance.peak_amplitude, fine.peak_amplitude),
            true => 0.0,
        };
        let amplitude = match is_still {
            true => 0.0,
            false => change(self.resonance.amplitude, fine.amplitude),
        };
        let truncation = Truncation {
            frequency: TAIL
                * (change(coarse.omega, fine.in_force().omega) + left / FREQUENCY_WEIGHT),
            amplitude: TAIL * amplitude.max(whole).max(peak),
            friction_energy: TAIL * energy,
            expected: Some(fine.in_force().omega / coarse.omega - 1.0),
        };
        Some((truncation, fine))
    }
}

/// Euclidean distance of two rows of coefficients in the orders of `kept` but the mean, relative to the second; rows of those of
/// `all`.
fn distance(a: &[f64], b: &[f64], kept: &Harmonics, all: &Harmonics) -> f64 {
    let n = all.coefficients();
    let slots: Vec<usize> = kept.orders()[1..]
        .iter()
        .filter_map(|order| all.slot_of(*order))
        .flat_map(|slot| [slot, slot + 1])
        .collect();
    let (mut change, mut size) = (0.0, 0.0);
    for (a, b) in a.chunks(n).zip(b.chunks(n)) {
        for &slot in &slots {
            change += (a[slot] - b[slot]).powi(2);
            size += b[slot].powi(2);
        }
    }
    if size > 0.0 {
        (change / size).sqrt()
    } else {
        0.0
    }
}
