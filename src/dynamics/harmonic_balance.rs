//! Multi-harmonic balance in contact displacements [A eq. 2.1–2.2], condensed about the stuck state.
//!
//! Every element is closed by springs of its reference stiffness. The structure then responds with `u = H (f_ext −
//! g(u))`, where g is the contact force *beyond* the reference. The force g of an element is zero if the element
//! follows its reference throughout the cycle. An element with g = 0 is *passive*, and only *active* elements have
//! unknowns. The solver computes the displacements of the passive elements from the active elements. The solver then
//! checks at every sample of the cycle that the passive elements follow their reference. The result equals the result
//! with all elements active, except for rounding.

use std::sync::Arc;

use num_complex::Complex64;

use super::aft::{InterfaceElement, Sampling};
use super::closed_model::ClosedModel;
use super::contact_element::{ContactElement, ElementCycle};
use super::continuation::{Continuation, ContinuationSettings};
use super::cycle::{JointSummary, element_cycles, half_range, weights};
use super::effort::EvaluationBudget;
use super::linear_model::LinearModel;
use super::newton::{Condition, State};
use super::predictor::{PREDICTOR_POINTS, extrapolated_start};
use super::response::{Response, Start};
use super::truncation::FAINT_DISSIPATION;
use super::{DynamicsError, Harmonics};
use crate::gauge::Gauge;
use crate::journal::Journal;
use crate::linalg::{RowMatrix as Matrix, add_scaled};
use crate::threads::Threads;

/// Smallest increment of the load, divided by the target load. The solver raises the load in increments to a state that
/// Newton's method does not reach directly.
const LEAST_INCREMENT: f64 = 1e-4;
/// Ratio of a sum of loads to the largest load up to which the sum is rounding.
const CANCELLED: f64 = 1e-14;

/// Harmonic load at a port: `cosine · cos kωt + sine · sin kωt`, with half-range amplitudes. Harmonic 0 is a constant
/// force `cosine`.
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

/// Settings of accuracy and effort.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BalanceSettings {
    /// Samples per cycle. If the load is steady, the error falls with the square of the number of samples. With 64
    /// samples, the error is about 1e-3 of the dissipation.
    pub samples: usize,
    /// Newton correction at convergence, relative to the contact displacements.
    pub tolerance: f64,
    /// Largest number of Newton iterations per attempt.
    pub max_iterations: usize,
    /// Number of unknowns up to which elimination solves a Newton step. With more unknowns, GMRES solves the Newton
    /// step if the model has few coordinates.
    pub dense_unknowns: usize,
    /// Makes every element active, to check the condensation.
    pub all_active: bool,
    /// First step of phase in the search for a peak \[rad\].
    pub first_phase_step: f64,
}

/// Adds up loads on the same port in the same harmonic. A sum that cancels becomes 0.
fn summed(loads: &[Load]) -> Vec<Load> {
    let mut sums: Vec<(Load, f64)> = Vec::new();
    for load in loads {
        let size = load.cosine.hypot(load.sine);
        let same_load = sums
            .iter_mut()
            .find(|(sum, _)| (sum.port, sum.harmonic) == (load.port, load.harmonic));
        match same_load {
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

impl Default for BalanceSettings {
    fn default() -> BalanceSettings {
        BalanceSettings {
            samples: 64,
            tolerance: 1e-10,
            max_iterations: 40,
            dense_unknowns: 300,
            all_active: false,
            first_phase_step: 0.02,
        }
    }
}

/// Harmonic balance of a structure with contact elements and loads.
#[derive(Clone)]
pub struct HarmonicBalance<E> {
    pub(super) model: Arc<ClosedModel>,
    pub(super) reference: Vec<[f64; 3]>,
    pub(super) elements: Vec<E>,
    pub(super) sampling: Sampling,
    pub(super) loads: Vec<Load>,
    /// Ports that have loads. `load_rows` contains the load coefficients of each port.
    pub(super) load_ports: Vec<usize>,
    pub(super) load_rows: Vec<f64>,
    /// Growth of the loads with ω², as rows of coefficients; empty without inertial loads.
    pub(super) inertial_rows: Vec<f64>,
    pub(super) settings: BalanceSettings,
    /// Whether a Jacobian costs more than the additional steps that an older Jacobian needs.
    pub(super) has_expensive_jacobian: bool,
    /// Counter and limit of evaluations.
    pub(super) effort: EvaluationBudget,
    /// Gauge that counts iterations and points for progress reports.
    pub gauge: Gauge,
    /// Journal of solutions: reads solutions of an interrupted run and stores new ones.
    pub journal: Journal,
    /// Threads for the computation.
    pub threads: Threads,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Combines a structure, three contact degrees of freedom per element, and loads. Loads on one port in one harmonic
    /// add up. The first load of harmonic 1 is the drive.
    ///
    /// # Errors
    /// [`DynamicsError`] if numbers do not match or are out of range, or the set lacks the harmonic of a load.
    pub fn new(
        model: &dyn LinearModel,
        elements: Vec<E>,
        harmonics: Harmonics,
        loads: Vec<Load>,
        settings: BalanceSettings,
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
        let closed = model.with_closed_contact(&springs.collect::<Vec<f64>>())?;
        Self::from_closed_model(Arc::new(closed), elements, harmonics, loads, settings)
    }

    /// Combines loads with a structure that the reference stiffness of its elements has already closed.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub(super) fn from_closed_model(
        model: Arc<ClosedModel>,
        elements: Vec<E>,
        harmonics: Harmonics,
        loads: Vec<Load>,
        settings: BalanceSettings,
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
            has_expensive_jacobian: elements.iter().any(E::is_costly),
            reference: elements.iter().map(E::reference_stiffness).collect(),
            elements,
            sampling: Sampling::new(harmonics, settings.samples)?,
            loads,
            load_ports,
            load_rows,
            inertial_rows: Vec::new(),
            settings,
            effort: EvaluationBudget::default(),
            gauge: Gauge::default(),
            journal: Journal::default(),
            threads: Threads::default(),
        })
    }

    /// Adds loads that are proportional to the square of their frequency. An example is the inertia force of a
    /// structure whose ground has a prescribed displacement.
    ///
    /// The amplitudes of `loads` \[N s²\] are factors of (kω)², for harmonic k at the angular frequency ω of the
    /// fundamental.
    ///
    /// # Errors
    /// Returns [`DynamicsError`] if a port does not exist, an amplitude is not finite, or a harmonic is not in the set
    /// of harmonics.
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

    /// Returns the loads of all loaded ports at the angular frequency `omega`, scaled by `factor`. The loads are rows
    /// of coefficients \[N\], one row per loaded port.
    pub(super) fn loads_at(&self, omega: f64, factor: f64) -> Vec<f64> {
        let mut rows: Vec<f64> = self.load_rows.iter().map(|f| factor * f).collect();
        add_scaled(&mut rows, factor * omega * omega, &self.inertial_rows);
        rows
    }

    /// Returns true if a load depends on frequency.
    pub(super) fn has_inertial_loads(&self) -> bool {
        !self.inertial_rows.is_empty()
    }

    /// Returns the harmonics.
    pub fn harmonics(&self) -> &Harmonics {
        self.sampling.harmonics()
    }

    /// Returns the sampling of a cycle.
    pub fn sampling(&self) -> &Sampling {
        &self.sampling
    }

    /// Returns the elements.
    pub fn elements(&self) -> &[E] {
        &self.elements
    }

    /// Computes the steady response at the angular frequency `omega`. If `guess` is `Some`, the solver starts from
    /// `guess`.
    ///
    /// If Newton's method fails from the guess, the solver restarts from the linear response. If Newton's method fails
    /// from the linear response, the solver raises the load in steps.
    ///
    /// # Errors
    /// [`DynamicsError`]. A response that did not converge is never returned.
    pub fn solve(&self, omega: f64, guess: Option<&Start>) -> Result<Response, DynamicsError> {
        self.solve_at(omega, 1.0, guess)
    }

    /// Computes the steady response at the angular frequency `omega` by Newton's method from `guess`, without other
    /// attempts.
    ///
    /// # Errors
    /// As [`Self::solve`].
    pub fn solve_near(&self, omega: f64, guess: &Start) -> Result<Response, DynamicsError> {
        let start = self.start_from(guess, omega, 1.0)?;
        self.solve_or_read(start, 1.0, &Condition::Frequency)
    }

    /// Computes the steady response as [`Self::solve`], with all loads scaled by `factor`.
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
            if let Ok(response) = self.solve_or_read(start, factor, &Condition::Frequency) {
                return Ok(response);
            }
        }
        let start = self.linear_start(omega, factor)?;
        match self.solve_or_read(start, factor, &Condition::Frequency) {
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
            match self.solve_or_read(start, factor, &Condition::Frequency) {
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

    /// Makes a load of harmonic 1 on `port` the drive, if `port` has such a load. With a drive on `port`, the phase
    /// resonance refers to a load that works on the response.
    pub(super) fn with_drive_at(mut self, port: usize) -> Self {
        self.loads.sort_by_key(|load| load.port != port);
        self
    }

    /// Returns the drive: the first load of harmonic 1, after loads on the same port are summed.
    pub fn drive(&self) -> Option<&Load> {
        self.loads
            .iter()
            .find(|load| load.harmonic == 1 && load.cosine.hypot(load.sine) > 0.0)
    }

    /// Creates the state of a response as a start at another frequency and load.
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

    /// Creates the linear response of the reference state as a start.
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

// Responses at given frequencies, each predicted from the previous ones.

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Computes the response at each of `omegas` from the previous responses, or returns the error of a point without
    /// response.
    ///
    /// If several responses exist, the sweep in the order of `omegas` stays on the branch of the previous response. If
    /// the branch turns back before the next frequency, the sweep follows the branch over its turning points to that
    /// frequency. The responses of the sweep then jump as in a slow experiment. If no branch leads to a frequency, the
    /// solver starts from the linear response. If the start from the linear response fails, the solver follows the
    /// branch from the other end of the sweep.
    pub fn sweep(&self, omegas: &[f64]) -> Vec<Result<Response, DynamicsError>> {
        let mut responses: Vec<Response> = Vec::with_capacity(omegas.len());
        let mut points = Vec::with_capacity(omegas.len());
        for &omega in omegas {
            let response = match self.next_of_sweep(omega, &responses) {
                Some(response) => Ok(response),
                None => {
                    let guess = responses.last().map(Response::start);
                    self.solve(omega, guess.as_ref())
                        .or_else(|error| self.backwards_to(omega, omegas).ok_or(error))
                }
            };
            if let Ok(response) = &response {
                self.gauge.add_point(response.omega);
                responses.push(response.clone());
            }
            points.push(response);
        }
        points
    }

    /// Computes the response at `omega` that is connected with the previous responses.
    fn next_of_sweep(&self, omega: f64, responses: &[Response]) -> Option<Response> {
        let last = responses.last()?;
        let before = responses.iter().rev().nth(1);
        let solve_from = |start: &Start| {
            let start = self.start_from(start, omega, 1.0).ok()?;
            self.solve_or_read(start, 1.0, &Condition::Frequency).ok()
        };
        let first = responses.len().saturating_sub(PREDICTOR_POINTS);
        let starts: Vec<Start> = responses[first..].iter().map(Response::start).collect();
        let omegas: Vec<f64> = starts.iter().map(|start| start.omega).collect();
        let extrapolated =
            extrapolated_start(&starts, &omegas, omega).and_then(|start| solve_from(&start));
        if extrapolated.is_some() {
            return extrapolated;
        }
        if let Some(response) = solve_from(&last.start()) {
            return Some(response);
        }
        let first = responses.first()?;
        self.follow(before, last, first.omega, omega)
    }

    /// Computes the response at `omega` on the branch through `last`, unless the branch returns beyond `from`.
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
        Continuation::response_at_end(self, settings, before, last, width).ok()
    }

    /// Computes the response at `omega` on the branch that begins at the last frequency of the sweep.
    fn backwards_to(&self, omega: f64, omegas: &[f64]) -> Option<Response> {
        let end = *omegas.last()?;
        let last = self.solve(end, None).ok()?;
        self.follow(None, &last, end, omega)
    }
}

// Results derived from a response of contact elements.

impl HarmonicBalance<ContactElement> {
    /// Computes the cycle of each contact element in a response, by [`element_cycles`].
    pub fn element_cycles(&self, response: &Response, sampling: &Sampling) -> Vec<ElementCycle> {
        element_cycles(self.elements(), &response.displacement, sampling)
    }

    /// Summarises motion, slip and load of the joint.
    pub fn joint_summary(&self, response: &Response) -> JointSummary {
        let width = 3 * self.harmonics().coefficients();
        let samples = self.sampling().samples();
        let mut mean = vec![[0.0; 3]; samples];
        let mut total = vec![0.0; samples];
        let mut summary = JointSummary {
            states: Vec::with_capacity(self.elements().len()),
            displacement: [0.0; 3],
            least_displacement: [f64::INFINITY; 3],
            largest_displacement: [0.0; 3],
            normal_load: 0.0,
            largest_normal_load: 0.0,
        };
        let rows = response.displacement.chunks(width);
        let elements = self.elements().iter().zip(weights(self.elements()));
        for ((element, weight), row) in elements.zip(rows) {
            let displacement = self.sampling().synthesise(row);
            let cycle = element.cycle(&displacement);
            summary.states.push(cycle.state);
            for d in 0..3 {
                let amplitude = half_range(displacement.iter().map(|u| u[d]));
                summary.least_displacement[d] = summary.least_displacement[d].min(amplitude);
                summary.largest_displacement[d] = summary.largest_displacement[d].max(amplitude);
            }
            for j in 0..samples {
                for d in 0..3 {
                    mean[j][d] += weight * displacement[j][d];
                }
                total[j] += cycle.force[j][2];
            }
            let load = element.normal_load();
            if load > 0.0 {
                let amplitude = half_range(cycle.force.iter().map(|f| f[2]));
                let share = amplitude / load;
                summary.largest_normal_load = summary.largest_normal_load.max(share);
            }
        }
        if summary.states.is_empty() {
            summary.least_displacement = [0.0; 3];
        } else {
            summary.displacement = [0, 1, 2].map(|d| half_range(mean.iter().map(|u| u[d])));
        }
        let preload: f64 = self
            .elements()
            .iter()
            .map(ContactElement::normal_load)
            .sum();
        if preload > 0.0 {
            summary.normal_load = half_range(total) / preload;
        }
        summary
    }

    /// Computes the contact forces of all elements at the displacements of a response, `contact_dofs × coefficients`
    /// \[N\].
    pub(super) fn contact_forces(&self, displacement: &[f64]) -> Vec<f64> {
        let width = 3 * self.harmonics().coefficients();
        let mut force = vec![0.0; self.elements().len() * width];
        let mut work = self.sampling().workspace();
        let rows = force.chunks_mut(width).zip(displacement.chunks(width));
        for (element, (force, row)) in self.elements().iter().zip(rows) {
            self.sampling()
                .evaluate(element, row, force, None, &mut work);
        }
        force
    }

    /// Computes the energy that the sliders of each element dissipate per cycle \[J\].
    pub(super) fn dissipated_energies(&self, response: &Response) -> Vec<f64> {
        let cycles = self.element_cycles(response, self.sampling());
        cycles.iter().map(|cycle| cycle.dissipated_energy).collect()
    }

    /// Returns the work of the contact forces minus the dissipation of the sliders, divided by that work. Sampling
    /// causes the difference. For a contact without friction, all of the work is error.
    pub(super) fn work_error(&self, response: &Response) -> f64 {
        let work = response.energy.friction;
        let dissipated: f64 = self.dissipated_energies(response).iter().sum();
        let size = work
            .abs()
            .max(FAINT_DISSIPATION * response.energy.load_work.abs());
        match (work - dissipated).abs() / size {
            error if error.is_finite() => error,
            _ => 0.0,
        }
    }

    /// Computes the peak kinetic energy of the first harmonic, ½ ω² q̂ᴴ M q̂. The vector q̂ contains the coordinates of
    /// the structure, and M is the mass matrix `mass`. The static residual of the omitted modes has no mass.
    pub(super) fn kinetic_energy(
        &self,
        mass: &Matrix,
        response: &Response,
    ) -> Result<f64, DynamicsError> {
        let harmonics = self.harmonics();
        let slot = harmonics.require(1, "kinetic energy of the first harmonic")?;
        let n = harmonics.coefficients();
        // All forces on the structure closed by its reference springs: loads, and contact forces beyond the reference.
        let mut ports = self.load_ports.clone();
        let mut rows = self.loads_at(response.omega, response.load_factor);
        let displacement = response.displacement.chunks(n);
        for (dof, (force, u)) in response.force.chunks(n).zip(displacement).enumerate() {
            if response.active[dof / 3] {
                let stiffness = self.reference[dof / 3][dof % 3];
                ports.push(dof);
                rows.extend(force.iter().zip(u).map(|(f, u)| stiffness * u - f));
            }
        }
        let generalised = self.model.generalised(harmonics, &ports, &rows);
        let index = harmonics.orders().iter().position(|order| *order == 1);
        let (core, index) = (
            self.model.core.receptance(response.omega)?,
            index.unwrap_or(1),
        );
        debug_assert_eq!(harmonics.slot(index), slot);
        let (q, _) = ClosedModel::amplitudes(harmonics, index, &core, &generalised);
        let inertia: f64 = (0..mass.rows())
            .map(|i| {
                let row = mass.row(i).iter().zip(&q);
                let momentum: Complex64 = row.map(|(m, q)| *q * *m).sum();
                (q[i].conj() * momentum).re
            })
            .sum();
        Ok(0.5 * response.omega.powi(2) * inertia)
    }
}
