//! Multi-harmonic balance in contact displacements [A eq. 2.1–2.2], condensed about the stuck state.
//!
//! With springs of the reference stiffness closed at every element, the structure answers `u = H (f_ext − g(u))`, where g is what
//! the contact forces are *beyond* their reference. Elements that follow their reference throughout the cycle have no g, so only
//! the others, the *active* ones, have unknowns; the displacement of the rest follows, and is checked over the whole cycle at
//! the same samples. The result is that of all elements active, to rounding.

use super::aft::{InterfaceElement, Sampling, Workspace};
use super::closed_model::ClosedModel;
use super::linear_model::LinearModel;
use super::newton_step::{Condition, State};
use super::{DynamicsError, Harmonics};

/// Mean force on an unsupported motion, relative to the forces it is the balance of, that is rounding.
const UNSUPPORTED: f64 = 1e-7;
/// Change of a friction force over a cycle, relative to the largest of the joint, up to which it is a steady one.
const CLOSED: f64 = 1e-6;
/// Least increment of the load on the way to a state that Newton's method does not reach at once.
const LEAST_INCREMENT: f64 = 1e-4;

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

/// What a cycle does with energy \[J\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Work of the loads, π F |u| sin φ for one load.
    pub input: f64,
    /// Work of the contact forces, from the harmonics of force and displacement.
    pub friction: f64,
    /// Loss of the damping matrix.
    pub viscous: f64,
}

impl Energy {
    /// |input − friction − viscous| over the largest of them; 0 if nothing moves.
    pub fn imbalance(&self) -> f64 {
        let scale = self
            .input
            .abs()
            .max(self.friction.abs())
            .max(self.viscous.abs());
        if scale == 0.0 {
            0.0
        } else {
            (self.input - self.friction - self.viscous).abs() / scale
        }
    }
}

/// A converged steady response.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Angular frequency of the fundamental \[rad/s\].
    pub omega: f64,
    /// Share of the loads applied.
    pub load_factor: f64,
    /// Displacement of every port \[m\], `ports × coefficients`; the contact degrees of freedom come first.
    pub displacement: Vec<f64>,
    /// Contact force on every contact degree of freedom \[N\], beyond the preload, `contact_dofs × coefficients`.
    pub force: Vec<f64>,
    /// Elements that had unknowns.
    pub active: Vec<bool>,
    /// Newton iterations, over all attempts.
    pub iterations: usize,
    /// Relative Newton correction left.
    pub correction: f64,
    /// Largest change of a friction force from one cycle to the next, relative to the largest friction force of the joint.
    pub closure: f64,
    /// Energy per cycle.
    pub energy: Energy,
}

/// Where to start from: a response as far as another one needs it, to be kept and made again from stored numbers.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Angular frequency of the fundamental \[rad/s\].
    pub omega: f64,
    /// Share of the loads that was applied; displacements are scaled to the share that is asked for.
    pub load_factor: f64,
    /// Displacement of the ports \[m\], `ports × coefficients`, as in [`Response::displacement`]. Those of the contact degrees of
    /// freedom, which come first, are enough: the rest is not read.
    pub displacement: Vec<f64>,
}

impl Response {
    /// This response as a start. The same numbers give the same start to the last bit.
    pub fn start(&self) -> Start {
        Start {
            omega: self.omega,
            load_factor: self.load_factor,
            displacement: self.displacement.clone(),
        }
    }

    /// Frequency of the fundamental \[Hz\].
    pub fn frequency(&self) -> f64 {
        self.omega / (2.0 * std::f64::consts::PI)
    }

    /// Number of active elements.
    pub fn active_elements(&self) -> usize {
        self.active.iter().filter(|a| **a).count()
    }
}

/// A structure, its contact elements and its loads.
pub struct HarmonicBalance<E> {
    pub(super) model: ClosedModel,
    pub(super) reference: Vec<[f64; 3]>,
    pub(super) elements: Vec<E>,
    pub(super) sampling: Sampling,
    pub(super) loads: Vec<Load>,
    /// Ports with loads, and their rows of coefficients.
    pub(super) load_ports: Vec<usize>,
    pub(super) load_rows: Vec<f64>,
    pub(super) settings: Settings,
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Joins a structure, three contact degrees of freedom per element, and loads. The first load of harmonic 1 is the drive.
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
        if !(settings.tolerance > 0.0 && settings.tolerance < 1e-2) {
            return Err(DynamicsError::OutOfRange {
                name: "the tolerance of the harmonic balance",
                value: settings.tolerance,
                expected: "between 0 and 0.01",
            });
        }
        for (index, element) in elements.iter().enumerate() {
            element.check(index)?;
        }
        let reference: Vec<[f64; 3]> = elements.iter().map(E::reference_stiffness).collect();
        let springs: Vec<f64> = reference.iter().flatten().copied().collect();
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
            let slot = harmonics.require(load.harmonic, "load")?;
            let place = load_ports.iter().position(|p| *p == load.port);
            let place = place.unwrap_or_else(|| {
                load_ports.push(load.port);
                load_rows.extend(vec![0.0; n]);
                load_ports.len() - 1
            });
            load_rows[place * n + slot] += load.cosine;
            if load.harmonic > 0 {
                load_rows[place * n + slot + 1] += load.sine;
            }
        }
        Ok(HarmonicBalance {
            model: model.close(&springs)?,
            reference,
            elements,
            sampling: Sampling::new(harmonics, settings.samples)?,
            loads,
            load_ports,
            load_rows,
            settings,
        })
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

    /// Responses at each of `omegas`, each from those before.
    ///
    /// # Errors
    /// That of the first point that has none.
    pub fn forced_response(&self, omegas: &[f64]) -> Result<Vec<Response>, DynamicsError> {
        let mut responses: Vec<Response> = Vec::with_capacity(omegas.len());
        for &omega in omegas {
            let ahead = match responses.as_slice() {
                [.., before, last] if last.omega != before.omega => {
                    let share = (omega - last.omega) / (last.omega - before.omega);
                    let mut ahead = last.start();
                    for (u, old) in ahead.displacement.iter_mut().zip(&before.displacement) {
                        *u += share * (*u - old);
                    }
                    self.newton(
                        self.start_from(&ahead, omega, 1.0)?,
                        1.0,
                        &Condition::Frequency,
                    )
                    .ok()
                }
                _ => None,
            };
            let response = match ahead {
                Some(response) => response,
                None => self.solve(omega, responses.last().map(Response::start).as_ref())?,
            };
            responses.push(response);
        }
        Ok(responses)
    }

    /// Half-range amplitude \[m\] and phase lag behind the drive \[rad, in (−π, π\]\] of the first harmonic at `port`.
    ///
    /// # Errors
    /// [`DynamicsError::HarmonicMissing`], or [`DynamicsError::OutOfRange`] without such a port.
    pub fn amplitude(&self, response: &Response, port: usize) -> Result<(f64, f64), DynamicsError> {
        let slot = self
            .harmonics()
            .require(1, "amplitude of the first harmonic")?;
        let n = self.harmonics().coefficients();
        let Some(row) = response.displacement.get(port * n..(port + 1) * n) else {
            return Err(DynamicsError::OutOfRange {
                name: "the port",
                value: port as f64,
                expected: "the index of a port of the structure",
            });
        };
        let (a, b) = (row[slot], row[slot + 1]);
        let lead = self
            .drive()
            .map_or(0.0, |load| (-load.sine).atan2(load.cosine));
        let lag = lead - (-b).atan2(a);
        let turn = 2.0 * std::f64::consts::PI;
        let lag = lag - turn * ((lag - std::f64::consts::PI) / turn).ceil();
        Ok((a.hypot(b), lag))
    }

    /// The first load of harmonic 1.
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
        let cores = self.model.cores(self.harmonics(), omega)?;
        let rows: Vec<f64> = self.load_rows.iter().map(|f| factor * f).collect();
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
                self.settings.all_active
                    || !element.follows_reference(&self.sampling.synthesise(row))
            })
            .collect();
        State {
            omega,
            contact,
            active,
        }
    }

    /// Contact forces of every element from the converged displacements, and the worst change from one cycle to the next, relative to
    /// the largest friction force of the joint.
    ///
    /// # Errors
    /// [`DynamicsError::NotClosed`].
    fn contact_forces(
        &self,
        contact: &[f64],
        active: &[bool],
    ) -> Result<(Vec<f64>, f64), DynamicsError> {
        let n = self.harmonics().coefficients();
        let width = 3 * n;
        let mut force = vec![0.0; contact.len()];
        let mut work: Workspace = self.sampling.workspace();
        let (mut worst, mut largest) = ((0.0_f64, 0, 0), 0.0_f64);
        for (index, element) in self.elements.iter().enumerate() {
            let u = &contact[index * width..][..width];
            let f = &mut force[index * width..][..width];
            if active[index] {
                let closure = self.sampling.evaluate(element, u, f, None, &mut work);
                let change = closure.change * closure.largest;
                largest = largest.max(closure.largest);
                if change > worst.0 {
                    worst = (change, index, closure.cycles);
                }
            } else {
                for d in 0..3 {
                    for c in 0..n {
                        f[d * n + c] = self.reference[index][d] * u[d * n + c];
                    }
                }
            }
        }
        let (change, element, cycles) = worst;
        let change = if change > 0.0 { change / largest } else { 0.0 };
        if change > CLOSED {
            return Err(DynamicsError::NotClosed {
                element,
                change,
                cycles,
                tolerance: CLOSED,
            });
        }
        Ok((force, change))
    }

    /// The response of a converged state; `displacement` is that of all ports.
    pub(super) fn response(
        &self,
        state: State,
        factor: f64,
        mut displacement: Vec<f64>,
        iterations: usize,
        correction: f64,
    ) -> Result<Response, DynamicsError> {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let (force, closure) = self.contact_forces(&state.contact, &state.active)?;
        // All forces on the closed structure: loads, and contact forces beyond the reference.
        let mut ports = self.load_ports.clone();
        let mut rows: Vec<f64> = self.load_rows.iter().map(|f| factor * f).collect();
        let load_rows = rows.clone();
        for (dof, (f, u)) in force.chunks(n).zip(state.contact.chunks(n)).enumerate() {
            if state.active[dof / 3] {
                ports.push(dof);
                let stiffness = self.reference[dof / 3][dof % 3];
                rows.extend(f.iter().zip(u).map(|(f, u)| stiffness * u - f));
            }
        }
        self.check_support(&ports, &rows)?;
        let cores = self.model.cores(harmonics, state.omega)?;
        let generalised = self.model.generalised(harmonics, &ports, &rows);
        let mut viscous = 0.0;
        for (index, core) in cores.iter().enumerate().skip(1) {
            let (amplitude, force) = ClosedModel::amplitudes(harmonics, index, core, &generalised);
            let order = f64::from(harmonics.orders()[index]);
            viscous += order
                * self
                    .model
                    .core
                    .loss(order * state.omega, &amplitude, &force);
        }
        let loaded: Vec<f64> = self
            .load_ports
            .iter()
            .flat_map(|p| displacement[p * n..(p + 1) * n].to_vec())
            .collect();
        let energy = Energy {
            input: harmonics.work(&load_rows, &loaded),
            friction: harmonics.work(&force, &state.contact),
            viscous,
        };
        displacement[..state.contact.len()].copy_from_slice(&state.contact);
        Ok(Response {
            omega: state.omega,
            load_factor: factor,
            displacement,
            force,
            active: state.active,
            iterations,
            correction,
            closure,
            energy,
        })
    }

    fn check_support(&self, ports: &[usize], rows: &[f64]) -> Result<(), DynamicsError> {
        let Some(motions) = &self.model.floating else {
            return Ok(());
        };
        let n = self.harmonics().coefficients();
        for motion in 0..motions.columns() {
            let (mut sum, mut size) = (0.0, 0.0);
            for (&port, row) in ports.iter().zip(rows.chunks(n)) {
                let share = motions.at(port, motion) * row[0];
                sum += share;
                size += share
                    .abs()
                    .max(motions.at(port, motion).abs() * super::krylov::norm(row));
            }
            if sum.abs() > UNSUPPORTED * size {
                return Err(DynamicsError::Unsupported { force: sum });
            }
        }
        Ok(())
    }
}
