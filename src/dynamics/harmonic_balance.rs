//! Multi-harmonic balance in contact displacements [A eq. 2.1–2.2], condensed about the stuck state.
//!
//! With springs of the reference stiffness closed at every element, the structure answers `u = H (f_ext − g(u))`, where g is what
//! the contact forces are *beyond* their reference. Elements that follow their reference throughout the cycle have no g, so only
//! the others, the *active* ones, have unknowns; the displacement of the rest follows, and is checked over the whole cycle at
//! the same samples. The result is that of all elements active, to rounding.

use std::sync::Arc;

use super::aft::{InterfaceElement, Sampling};
use super::closed_model::ClosedModel;
use super::effort::Effort;
use super::linear_model::LinearModel;
use super::newton_step::{Condition, State};
use super::response::{Response, Start};
use super::{DynamicsError, Harmonics};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::linalg::add_scaled;
use crate::threads::Threads;

/// Least increment of the load on the way to a state that Newton's method does not reach at once.
const LEAST_INCREMENT: f64 = 1e-4;
/// Share of the largest of several loads that their sum leaves by rounding.
const CANCELLED: f64 = 1e-14;

/// A harmonic load at a port: `cosine · cos kωt + sine · sin kωt`, half-range; harmonic 0 is a constant force `cosine`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The port.
    pub port: usize,
    /// k.
    pub harmonic: u32,
    /// Amplitude of the cosine \[N\].
    pub cosine: f64,
    /// Amplitude of the sine \[N\].
    pub sine: f64,
}

/// Accuracy and effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Settings {
    /// Samples per cycle. Their error falls with the square of the number where the load is steady; 64 are good for about 1e-3 of
    /// the dissipation.
    pub samples: usize,
    /// Newton correction, relative to the contact displacements, at which a state has converged.
    pub tolerance: f64,
    /// Newton iterations before another way is tried.
    pub most_iterations: usize,
    /// Unknowns up to which a Newton step is solved by elimination; beyond, by GMRES if the model has few coordinates.
    pub dense_unknowns: usize,
    /// Gives every element unknowns, whether it needs them or not: to check the condensation.
    pub all_active: bool,
}

/// Loads on the same port in the same harmonic are one; what cancels is none.
fn summed(loads: &[Load]) -> Vec<Load> {
    let mut sums: Vec<(Load, f64)> = Vec::new();
    for load in loads {
        let size = load.cosine.hypot(load.sine);
        let known = sums
            .iter_mut()
            .find(|(sum, _)| (sum.port, sum.harmonic) == (load.port, load.harmonic));
        match known {
            Some((sum, largest)) => {
                sum.cosine += load.cosine;
                sum.sine += load.sine;
                *largest = largest.max(size);
            }
            None => sums.push((*load, size)),
        }
    }
    for (sum, largest) in &mut sums {
        for part in [&mut sum.cosine, &mut sum.sine] {
            if part.abs() <= CANCELLED * *largest {
                *part = 0.0;
            }
        }
    }
    sums.into_iter().map(|(sum, _)| sum).collect()
}

impl Default for Settings {
    fn default() -> Settings {
        Settings {
            samples: 64,
            tolerance: 1e-10,
            most_iterations: 40,
            dense_unknowns: 300,
            all_active: false,
        }
    }
}

/// A structure, its contact elements and its loads.
#[derive(Clone)]
pub struct HarmonicBalance<E> {
    pub(super) model: Arc<ClosedModel>,
    pub(super) reference: Vec<[f64; 3]>,
    pub(super) elements: Vec<E>,
    pub(super) sampling: Sampling,
    pub(super) loads: Vec<Load>,
    /// Ports with loads, and their rows of coefficients.
    pub(super) load_ports: Vec<usize>,
    pub(super) load_rows: Vec<f64>,
    /// What they have more of for each ω²; empty where no load grows.
    pub(super) inertial_rows: Vec<f64>,
    pub(super) settings: Settings,
    /// Whether a Jacobian costs more than the further steps that an older one needs.
    pub(super) is_costly: bool,
    /// What its evaluations count, and may.
    pub(super) effort: Effort,
    /// Where iterations and points are counted for who watches.
    pub gauge: Gauge,
    /// What an earlier start has solved, and a place for what this one solves.
    pub journal: Journal,
    /// The threads that share its work.
    pub threads: Threads,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Joins a structure, three contact degrees of freedom per element, and loads. Loads on one port in one harmonic add up; the first of harmonic 1 is the drive.
    ///
    /// # Errors
    /// [`DynamicsError`] if numbers do not fit together, are out of range, or a harmonic of a load is not in the set.
    pub fn new(
        model: &dyn LinearModel,
        elements: Vec<E>,
        harmonics: Harmonics,
        loads: Vec<Load>,
        settings: Settings,
    ) -> Result<HarmonicBalance<E>, DynamicsError> {
        if model.contact_dofs() != 3 * elements.len() {
            return Err(DynamicsError::Length {
                what: "list of contact degrees of freedom",
                found: model.contact_dofs(),
                expected: 3 * elements.len(),
            });
        }
        for (index, element) in elements.iter().enumerate() {
            element.check(index)?;
        }
        let springs = elements.iter().flat_map(E::reference_stiffness);
        let closed = model.close(&springs.collect::<Vec<f64>>())?;
        Self::of_closed(Arc::new(closed), elements, harmonics, loads, settings)
    }

    /// Joins a structure that is closed by the reference stiffness of its elements already.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn of_closed(
        model: Arc<ClosedModel>,
        elements: Vec<E>,
        harmonics: Harmonics,
        loads: Vec<Load>,
        settings: Settings,
    ) -> Result<HarmonicBalance<E>, DynamicsError> {
        if !(settings.tolerance > 0.0 && settings.tolerance < 1e-2) {
            return Err(DynamicsError::OutOfRange {
                name: "the tolerance of the harmonic balance",
                value: settings.tolerance,
                expected: "between 0 and 0.01",
            });
        }
        let n = harmonics.coefficients();
        let (mut load_ports, mut load_rows) = (Vec::new(), Vec::new());
        for load in &loads {
            if load.port >= model.ports() {
                return Err(DynamicsError::OutOfRange {
                    name: "the port of a load",
                    value: load.port as f64,
                    expected: "the index of a port of the structure",
                });
            }
            for value in [load.cosine, load.sine] {
                if !value.is_finite() {
                    return Err(DynamicsError::OutOfRange {
                        name: "the amplitude of a load",
                        value,
                        expected: "a finite number",
                    });
                }
            }
        }
        let loads = summed(&loads);
        for load in &loads {
            let slot = harmonics.require(load.harmonic, "load")?;
            let place = load_ports.iter().position(|p| *p == load.port);
            let place = place.unwrap_or_else(|| {
                load_ports.push(load.port);
                load_rows.extend(vec![0.0; n]);
                load_ports.len() - 1
            });
            load_rows[place * n + slot] = load.cosine;
            if load.harmonic > 0 {
                load_rows[place * n + slot + 1] = load.sine;
            }
        }
        Ok(HarmonicBalance {
            model,
            is_costly: elements.iter().any(E::is_costly),
            reference: elements.iter().map(E::reference_stiffness).collect(),
            elements,
            sampling: Sampling::new(harmonics, settings.samples)?,
            loads,
            load_ports,
            load_rows,
            inertial_rows: Vec::new(),
            settings,
            effort: Effort::default(),
            gauge: Gauge::default(),
            journal: Journal::default(),
            threads: Threads::default(),
        })
    }

    /// Adds loads that grow with the square of their frequency, as inertia seen from a ground that moves by a given displacement does.
    /// The amplitudes of `loads` \[N s²\] are factors of (kω)², for harmonic k at the angular frequency ω of the fundamental.
    ///
    /// # Errors
    /// [`DynamicsError`] for a port that does not exist, an amplitude that is not finite, or a harmonic that is not in the set.
    pub fn with_inertial_loads(mut self, loads: &[Load]) -> Result<Self, DynamicsError> {
        let n = self.harmonics().coefficients();
        for load in loads {
            self.check_load(load)?;
            let slot = self.harmonics().require(load.harmonic, "load")?;
            let place = self.load_ports.iter().position(|p| *p == load.port);
            let place = place.unwrap_or_else(|| {
                self.load_ports.push(load.port);
                self.load_rows.extend(vec![0.0; n]);
                self.load_ports.len() - 1
            });
            self.inertial_rows.resize(self.load_rows.len(), 0.0);
            if load.harmonic > 0 {
                let square = f64::from(load.harmonic).powi(2);
                self.inertial_rows[place * n + slot] += square * load.cosine;
                self.inertial_rows[place * n + slot + 1] += square * load.sine;
            }
            self.loads.push(*load);
        }
        Ok(self)
    }

    fn check_load(&self, load: &Load) -> Result<(), DynamicsError> {
        if load.port >= self.model.ports() {
            return Err(DynamicsError::OutOfRange {
                name: "the port of a load",
                value: load.port as f64,
                expected: "the index of a port of the structure",
            });
        }
        match [load.cosine, load.sine]
            .into_iter()
            .find(|v| !v.is_finite())
        {
            Some(value) => Err(DynamicsError::OutOfRange {
                name: "the amplitude of a load",
                value,
                expected: "a finite number",
            }),
            None => Ok(()),
        }
    }

    /// The loads at their ports at an angular frequency, scaled by `factor`: rows of coefficients \[N\].
    pub(super) fn loads_at(&self, omega: f64, factor: f64) -> Vec<f64> {
        let mut rows: Vec<f64> = self.load_rows.iter().map(|f| factor * f).collect();
        add_scaled(&mut rows, factor * omega * omega, &self.inertial_rows);
        rows
    }

    /// Whether a load depends on frequency.
    pub(super) fn has_inertial_loads(&self) -> bool {
        !self.inertial_rows.is_empty()
    }

    /// The harmonics.
    pub fn harmonics(&self) -> &Harmonics {
        self.sampling.harmonics()
    }

    /// The samples.
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// The elements.
    pub fn elements(&self) -> &[E] {
        &self.elements
    }

    /// The steady response at the angular frequency `omega`, from `guess` if there is one.
    ///
    /// Where Newton's method fails from the guess, it starts again from the linear response, then raises the load in steps.
    ///
    /// # Errors
    /// [`DynamicsError`]; a response that did not converge is never returned.
    pub fn solve(&self, omega: f64, guess: Option<&Start>) -> Result<Response, DynamicsError> {
        self.solve_at(omega, 1.0, guess)
    }

    /// The steady response at the angular frequency `omega` that Newton's method leads to from `guess`, and no other way.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn solve_near(&self, omega: f64, guess: &Start) -> Result<Response, DynamicsError> {
        let start = self.start_from(guess, omega, 1.0)?;
        self.newton(start, 1.0, &Condition::Frequency)
    }

    /// As [`Self::solve`] with all loads scaled by `factor`.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn solve_at(
        &self,
        omega: f64,
        factor: f64,
        guess: Option<&Start>,
    ) -> Result<Response, DynamicsError> {
        if !(omega > 0.0 && omega.is_finite()) {
            return Err(DynamicsError::OutOfRange {
                name: "the angular frequency",
                value: omega,
                expected: "a positive finite number",
            });
        }
        if let Some(guess) = guess {
            let start = self.start_from(guess, omega, factor)?;
            if let Ok(response) = self.newton(start, factor, &Condition::Frequency) {
                return Ok(response);
            }
        }
        let start = self.linear_start(omega, factor)?;
        match self.newton(start, factor, &Condition::Frequency) {
            Ok(response) => Ok(response),
            Err(_) => self.raise_load(omega, factor),
        }
    }

    fn raise_load(&self, omega: f64, target: f64) -> Result<Response, DynamicsError> {
        let (mut reached, mut increment) = (0.0, 0.125 * target);
        let mut last: Option<Response> = None;
        loop {
            let factor = if reached + increment >= target * (1.0 - 1e-12) {
                target
            } else {
                reached + increment
            };
            let start = match &last {
                Some(response) => self.start_from(&response.start(), omega, factor)?,
                None => self.linear_start(omega, factor)?,
            };
            match self.newton(start, factor, &Condition::Frequency) {
                Ok(response) if factor == target => return Ok(response),
                Ok(response) => {
                    reached = factor;
                    increment *= 2.0;
                    last = Some(response);
                }
                Err(error) => {
                    increment *= 0.5;
                    if increment < LEAST_INCREMENT * target {
                        return Err(error);
                    }
                }
            }
        }
    }

    /// Makes a load on `port` the drive, if there is one of harmonic 1: a phase resonance is that of what does work on the response.
    pub(super) fn driven_at(mut self, port: usize) -> Self {
        self.loads.sort_by_key(|load| load.port != port);
        self
    }

    /// The drive: the first load of harmonic 1, loads on the same port summed.
    pub fn drive(&self) -> Option<&Load> {
        self.loads
            .iter()
            .find(|load| load.harmonic == 1 && load.cosine.hypot(load.sine) > 0.0)
    }

    /// The state of a response as a start at another frequency and load.
    pub(super) fn start_from(
        &self,
        guess: &Start,
        omega: f64,
        factor: f64,
    ) -> Result<State, DynamicsError> {
        let n = self.harmonics().coefficients();
        let contact = 3 * n * self.elements.len();
        let all = self.model.ports() * n;
        if ![contact, all].contains(&guess.displacement.len()) {
            return Err(DynamicsError::Length {
                what: "displacement to start from",
                found: guess.displacement.len(),
                expected: all,
            });
        }
        let mut contact = guess.displacement[..contact].to_vec();
        if guess.load_factor > 0.0 && guess.load_factor != factor {
            let ratio = factor / guess.load_factor;
            contact.iter_mut().for_each(|u| *u *= ratio);
        }
        Ok(self.state(omega, contact))
    }

    /// The linear response of the reference state as a start.
    pub(super) fn linear_start(&self, omega: f64, factor: f64) -> Result<State, DynamicsError> {
        let cores = self.cores(omega)?;
        let rows = self.loads_at(omega, factor);
        let mut all = self
            .model
            .respond(self.harmonics(), &cores, &self.load_ports, &rows, true);
        all.truncate(3 * self.harmonics().coefficients() * self.elements.len());
        Ok(self.state(omega, all))
    }

    fn state(&self, omega: f64, contact: Vec<f64>) -> State {
        let width = 3 * self.harmonics().coefficients();
        let rows = self.elements.iter().zip(contact.chunks(width));
        let active = rows
            .map(|(element, row)| {
                self.settings.all_active || !self.sampling.follows_reference(element, row)
            })
            .collect();
        State {
            omega,
            contact,
            active,
        }
    }
}
