//! Data, construction and checks of a converged steady response.

use std::f64::consts::TAU;

use super::aft::InterfaceElement;
use super::closed_model::ClosedModel;
use super::newton::{Evaluation, State};
use super::{DynamicsError, HarmonicBalance, Harmonics};

/// Mean force on an unsupported motion, divided by the sum of the magnitudes of the single forces. Up to this ratio,
/// the mean force is a rounding error.
const UNSUPPORTED: f64 = 1e-7;
/// Largest change per cycle of a steady friction force, divided by the largest friction force of the joint.
const CLOSED: f64 = 1e-6;

/// Smallest amplitude of a port that moves, divided by the largest displacement. A smaller amplitude is the error of
/// Newton's method and rounding.
const STILL: f64 = 1e-9;

/// Energy per cycle \[J\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Work of the loads, π F |u| sin φ for one load.
    pub load_work: f64,
    /// Work of the contact forces, from the harmonics of force and displacement.
    pub friction: f64,
    /// Loss of the viscous damping.
    pub viscous: f64,
    /// Loss of the hysteretic damping.
    pub hysteretic: f64,
}

impl Energy {
    /// Returns the supplied energy minus all losses, divided by the largest of these energies. Returns 0 without
    /// motion.
    pub fn imbalance(&self) -> f64 {
        let scale = self
            .load_work
            .abs()
            .max(self.friction.abs())
            .max(self.viscous.abs())
            .max(self.hysteretic.abs());
        if scale == 0.0 {
            0.0
        } else {
            (self.load_work - self.friction - self.viscous - self.hysteretic).abs() / scale
        }
    }
}

/// Converged steady response.
#[derive(Debug, Clone, PartialEq)]
pub struct Response {
    /// Angular frequency of the fundamental \[rad/s\].
    pub omega: f64,
    /// Applied share of the loads.
    pub load_factor: f64,
    /// Displacement of every port \[m\], `ports × coefficients`; the contact degrees of freedom come first.
    pub displacement: Vec<f64>,
    /// Contact force on every contact degree of freedom \[N\], beyond the preload, `contact_dofs × coefficients`.
    pub force: Vec<f64>,
    /// Whether each element is active. Only active elements have unknowns.
    pub active: Vec<bool>,
    /// Number of Newton iterations of the solve that converged.
    pub iterations: usize,
    /// Relative correction of the last Newton iteration.
    pub correction: f64,
    /// Largest change of a friction force from one cycle to the next, relative to the largest friction force of the
    /// joint.
    pub closure: f64,
    /// Energy per cycle.
    pub energy: Energy,
}

/// Ratio of frequencies above which two resonances differ. A wear step changes the frequency of a resonance by at most
/// some per cent. The frequency changes by no more if a sliding joint sticks after the wear step.
const ANOTHER: f64 = 1.25;

/// Start for a solve: the part of a response that another solve needs, suitable for storage.
#[derive(Debug, Clone, PartialEq)]
pub struct Start {
    /// Angular frequency of the fundamental \[rad/s\].
    pub omega: f64,
    /// Applied share of the loads; displacements are scaled to the share of the new solve.
    pub load_factor: f64,
    /// Displacement of the ports \[m\], `ports × coefficients`, as in [`Response::displacement`]. The contact degrees
    /// of freedom, which come first, are sufficient; the rest is ignored.
    pub displacement: Vec<f64>,
}

impl Start {
    /// Converts the coefficients of a start from the harmonics `from` to the harmonics `to`.
    pub fn in_harmonics(&self, from: &Harmonics, to: &Harmonics) -> Start {
        Start {
            displacement: from.transfer(&self.displacement, to),
            ..self.clone()
        }
    }

    /// Returns the motion of the start, delayed by an angle of the fundamental \[rad\] and scaled by `size`. The means
    /// of the motion are unchanged.
    pub(super) fn delayed_and_scaled(&self, harmonics: &Harmonics, angle: f64, size: f64) -> Start {
        let turns = harmonics.orders()[1..].iter();
        let turns: Vec<(f64, f64)> = turns
            .map(|order| (f64::from(*order) * angle).sin_cos())
            .map(|(sine, cosine)| (size * sine, size * cosine))
            .collect();
        let mut out = self.clone();
        for row in out.displacement.chunks_exact_mut(harmonics.coefficients()) {
            for (pair, (sine, cosine)) in row[1..].chunks_exact_mut(2).zip(&turns) {
                let (a, b) = (pair[0], pair[1]);
                (pair[0], pair[1]) = (a * cosine - b * sine, a * sine + b * cosine);
            }
        }
        out
    }

    /// Compares the frequency of a response with the frequency of the start, to check that both belong to the same
    /// resonance.
    ///
    /// # Errors
    /// Returns [`DynamicsError::ResonanceLost`] if the response is another resonance.
    pub fn require_same_resonance(&self, response: &Response) -> Result<(), DynamicsError> {
        let ratio = response.omega / self.omega;
        if ratio.max(1.0 / ratio) > ANOTHER {
            return Err(DynamicsError::ResonanceLost {
                before: self.omega / TAU,
                found: response.frequency(),
            });
        }
        Ok(())
    }
}

impl Response {
    /// Returns the response as a start for another solve. Equal responses give equal starts, to the last bit.
    pub fn start(&self) -> Start {
        Start {
            omega: self.omega,
            load_factor: self.load_factor,
            displacement: self.displacement.clone(),
        }
    }

    /// Returns the frequency of the fundamental \[Hz\].
    pub fn frequency(&self) -> f64 {
        self.omega / (2.0 * std::f64::consts::PI)
    }

    /// Returns the number of active elements.
    pub fn active_elements(&self) -> usize {
        self.active.iter().filter(|a| **a).count()
    }
}

impl<E: InterfaceElement> HarmonicBalance<E> {
    /// Returns the half-range amplitude \[m\] and the phase lag \[rad\] of the first harmonic at `port`. The phase lag
    /// behind the drive lies in (−π, π\].
    ///
    /// # Errors
    /// Returns [`DynamicsError::HarmonicMissing`], or [`DynamicsError::OutOfRange`] if the port does not exist.
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
        Ok(self.lag(row[slot], row[slot + 1]))
    }

    /// Returns true if a response does not move at a port, except for rounding.
    pub(super) fn is_still(&self, response: &Response, port: usize) -> bool {
        let rows = &response.displacement;
        let largest = rows.iter().fold(0.0_f64, |most, u| most.max(u.abs()));
        self.amplitude(response, port)
            .is_ok_and(|(amplitude, _)| amplitude <= STILL * largest)
    }

    fn lag(&self, a: f64, b: f64) -> (f64, f64) {
        let lead = self
            .drive()
            .map_or(0.0, |load| (-load.sine).atan2(load.cosine));
        let lag = lead - (-b).atan2(a);
        let turn = 2.0 * std::f64::consts::PI;
        let lag = lag - turn * ((lag - std::f64::consts::PI) / turn).ceil();
        (a.hypot(b), lag)
    }

    /// Returns the contact forces of every element at the converged displacements. The second result is the largest
    /// change of a friction force between two cycles, divided by the largest friction force of the joint. Forces of
    /// active elements come from the evaluation.
    ///
    /// # Errors
    /// Returns [`DynamicsError::NotClosed`].
    fn converged_contact_forces(
        &self,
        contact: &[f64],
        evaluation: &Evaluation,
    ) -> Result<(Vec<f64>, f64), DynamicsError> {
        let n = self.harmonics().coefficients();
        let width = 3 * n;
        let mut force = vec![0.0; contact.len()];
        let mut active = evaluation
            .elements
            .iter()
            .zip(&evaluation.contact)
            .peekable();
        let (mut worst, mut largest) = ((0.0_f64, 0, 0), 0.0_f64);
        for index in 0..self.elements.len() {
            let u = &contact[index * width..][..width];
            let f = &mut force[index * width..][..width];
            if let Some((_, (evaluated, closure))) = active.next_if(|(e, _)| **e == index) {
                f.copy_from_slice(evaluated);
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

    /// Creates the response of a converged state from its evaluation.
    pub(super) fn response(
        &self,
        state: State,
        factor: f64,
        evaluation: Evaluation,
        iterations: usize,
        correction: f64,
    ) -> Result<Response, DynamicsError> {
        let harmonics = self.harmonics();
        let n = harmonics.coefficients();
        let (force, closure) = self.converged_contact_forces(&state.contact, &evaluation)?;
        let mut displacement = evaluation.displacement;
        // All forces on the closed structure: loads, and contact forces beyond the reference.
        let mut ports = self.load_ports.clone();
        let mut rows = self.loads_at(state.omega, factor);
        let load_rows = rows.clone();
        for (dof, (f, u)) in force.chunks(n).zip(state.contact.chunks(n)).enumerate() {
            if state.active[dof / 3] {
                ports.push(dof);
                let stiffness = self.reference[dof / 3][dof % 3];
                rows.extend(f.iter().zip(u).map(|(f, u)| stiffness * u - f));
            }
        }
        self.check_support(&ports, &rows, factor)?;
        let generalised = self.model.generalised(harmonics, &ports, &rows);
        let (mut viscous, mut hysteretic) = (0.0, 0.0);
        for (index, core) in evaluation.cores.iter().enumerate().skip(1) {
            let (amplitude, force) = ClosedModel::amplitudes(harmonics, index, core, &generalised);
            // One cycle of the fundamental contains `order` cycles of the harmonic number `index`.
            let order = f64::from(harmonics.orders()[index]);
            let core = &self.model.core;
            let loss = core.loss(order * state.omega, &amplitude, &force);
            viscous += order * loss.viscous;
            hysteretic += order * loss.hysteretic;
        }
        let load_displacements: Vec<f64> = self
            .load_ports
            .iter()
            .flat_map(|p| displacement[p * n..(p + 1) * n].to_vec())
            .collect();
        let energy = Energy {
            load_work: harmonics.work(&load_rows, &load_displacements),
            friction: harmonics.work(&force, &state.contact),
            viscous,
            hysteretic,
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

    /// Rejects a mean force on an unsupported motion. `rows` are forces at the share `factor` of the load; the error
    /// reports the force at the full load.
    fn check_support(
        &self,
        ports: &[usize],
        rows: &[f64],
        factor: f64,
    ) -> Result<(), DynamicsError> {
        let Some(motions) = &self.model.rigid_motions else {
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
                let force = sum / factor;
                return Err(DynamicsError::Unsupported { force });
            }
        }
        Ok(())
    }
}
