//! The motion of a structure in time: its equations of motion with the sliders of its contact elements, each of which sticks, slips or
//! is open from one event to the next. Steps are made in `time_steps.rs`; events are found in `time_events.rs`.
//!
//! Nothing is assumed of the motion, which need not be periodic: it judges the harmonic balance of module `periodic`.

use std::cell::Cell;

use super::slider::{FrictionLaw, Slider, magnitude};
use super::time_steps::Run;
use super::{ContactElement, DynamicsError, Harmonics, Load, SecondOrder};
use crate::linalg::RowMatrix as Matrix;

/// Share of the scale of an event's function that is rounding of zero.
pub(super) const ROUNDING: f64 = 1e-12;

/// What a slider does; under [`FrictionLaw::Box`] along each axis apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Mode {
    Open,
    Stick,
    Slip,
}

/// A structure with contact elements under harmonic loads, in time.
pub struct TimeModel<'a> {
    pub(super) model: &'a SecondOrder,
    pub(super) inverse_mass: Matrix,
    pub(super) elements: &'a [ContactElement],
    pub(super) loads: &'a [Load],
    /// Loads that grow with the square of their frequency.
    pub(super) inertial_loads: &'a [Load],
    /// Sliders with their elements.
    pub(super) sliders: Vec<(usize, &'a Slider)>,
    /// How many times the steps are halved.
    pub(super) halvings: i32,
    /// Steps made so far, and how many may be made.
    pub(super) steps: Cell<usize>,
    pub(super) bound: Cell<usize>,
}

/// Where a motion is: coordinates \[m\], velocities \[m/s\], and the tangential forces x, y of all sliders \[N\], one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Motion {
    pub values: Vec<f64>,
}

/// What a period is measured by.
#[derive(Debug, Clone, PartialEq)]
pub struct Measured {
    /// Coefficients of the displacement of every port, `ports × coefficients` \[m\].
    pub displacement: Vec<f64>,
    /// Work of the loads, loss in friction, loss of the damping matrix \[J\].
    pub energy: [f64; 3],
}

impl<'a> TimeModel<'a> {
    /// A structure without a residual: whose ports follow its coordinates.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] of a structure with a residual, and for a mass matrix that is singular.
    pub fn new(
        model: &'a SecondOrder,
        elements: &'a [ContactElement],
        loads: &'a [Load],
    ) -> Result<TimeModel<'a>, DynamicsError> {
        if model.residual.is_some() {
            return Err(DynamicsError::OutOfRange {
                name: "the number of coordinates of a structure in time",
                value: model.mass.rows() as f64,
                expected: "that of all its degrees of freedom: forces on a reduced structure move its contact without delay",
            });
        }
        let factors = model.mass.clone().factorize();
        let factors = factors.map_err(DynamicsError::of_matrix("mass matrix"))?;
        let sliders = elements.iter().enumerate();
        Ok(TimeModel {
            model,
            inverse_mass: factors.inverse(),
            elements,
            loads,
            inertial_loads: &[],
            halvings: 0,
            steps: Cell::new(0),
            bound: Cell::new(usize::MAX),
            sliders: sliders
                .flat_map(|(e, element)| element.sliders.iter().map(move |slider| (e, slider)))
                .collect(),
        })
    }

    /// With loads that grow with the square of their frequency, as
    /// [`HarmonicBalance::with_inertial_loads`](super::HarmonicBalance::with_inertial_loads) has them.
    pub fn with_inertial_loads(mut self, loads: &'a [Load]) -> TimeModel<'a> {
        self.inertial_loads = loads;
        self
    }

    /// With steps of half the length, and an error of each as small as that makes it: what the length of steps does to a motion.
    pub fn halved(mut self) -> TimeModel<'a> {
        self.halvings += 1;
        self
    }

    /// Steps that were made so far: what has been spent.
    pub fn steps(&self) -> usize {
        self.steps.get()
    }

    /// What is found while no more than so many steps are made from here: a period that needs more ends as one that takes too many.
    pub(super) fn bounded<T>(&self, most: usize, find: impl FnOnce() -> T) -> T {
        let outer = self.bound.get();
        self.bound.set(outer.min(self.steps().saturating_add(most)));
        let found = find();
        self.bound.set(outer);
        found
    }

    pub(super) fn coordinates(&self) -> usize {
        self.model.mass.rows()
    }

    /// At rest, preloaded.
    pub fn rest(&self) -> Motion {
        Motion {
            values: vec![0.0; 2 * self.coordinates() + 2 * self.sliders.len()],
        }
    }

    /// Sizes that errors of a motion of an `amplitude` \[m\] are measured by, as a motion has them.
    pub fn scales(&self, omega: f64, amplitude: f64) -> Vec<f64> {
        self.scales_by(omega, &vec![amplitude; self.coordinates()])
    }

    /// As [`Self::scales`], of a motion with an amplitude along each coordinate.
    pub(super) fn scales_by(&self, omega: f64, amplitudes: &[f64]) -> Vec<f64> {
        let least = f64::MIN_POSITIVE.sqrt();
        let amplitudes: Vec<f64> = amplitudes.iter().map(|a| a.max(least)).collect();
        let mut scales = amplitudes.clone();
        scales.extend(amplitudes.iter().map(|a| omega * a));
        for (element, slider) in &self.sliders {
            let friction = self.elements[*element].friction_coefficient;
            let [across, normal] = self.contact_scales(*element, &amplitudes);
            let load = slider.normal_load + slider.normal_stiffness * normal;
            let force = (slider.tangential_stiffness * across).min(friction * load);
            scales.extend([force.max(least); 2]);
        }
        scales
    }

    /// Scales of an element in its plane and along its normal, of those of the coordinates: the largest of those that it follows.
    pub(super) fn contact_scales(&self, element: usize, scales: &[f64]) -> [f64; 2] {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.fold(0.0, f64::max);
        [0..2, 2..3].map(|directions| {
            let rows = directions.map(|d| self.model.basis.row(3 * element + d));
            let pairs = rows.flat_map(|row| row.iter().zip(scales));
            let followed = largest(&mut pairs.filter(|(b, _)| **b != 0.0).map(|(_, s)| *s));
            // What follows nothing does not move.
            match followed > 0.0 {
                true => followed,
                false => largest(&mut scales.iter().copied()),
            }
        })
    }

    /// Moves by one period from the phase 0 of the loads; with `harmonics` it is measured.
    ///
    /// # Errors
    /// [`DynamicsError::NotConverged`] where steps become too many or a motion runs away.
    pub fn period(
        &self,
        omega: f64,
        motion: &mut Motion,
        scales: &[f64],
        harmonics: Option<&Harmonics>,
    ) -> Result<Option<Measured>, DynamicsError> {
        let measured = harmonics.map_or(0, |h| 3 + self.model.basis.rows() * h.coefficients());
        let mut state = motion.values.clone();
        state.resize(motion.values.len() + measured, 0.0);
        let modes = self.modes(&mut state);
        Run::new(self, omega, scales, harmonics, modes, state.len()).march(&mut state)?;
        let rest = state.split_off(motion.values.len());
        motion.values = state;
        Ok(harmonics.map(|_| {
            let (energy, displacement) = rest.split_at(3);
            Measured {
                displacement: displacement.to_vec(),
                energy: [energy[0], energy[1], energy[2]],
            }
        }))
    }

    /// Displacements and velocities of the ports `from..from + 3`.
    pub(super) fn at(&self, port: usize, state: &[f64]) -> ([f64; 3], [f64; 3]) {
        let n = self.coordinates();
        let of = |values: &[f64]| {
            [0, 1, 2].map(|d| {
                let row = self.model.basis.row(port + d);
                row.iter().zip(values).map(|(b, q)| b * q).sum::<f64>()
            })
        };
        (of(&state[..n]), of(&state[n..2 * n]))
    }

    /// What the sliders do in a state; forces beyond their limits are brought back to them.
    fn modes(&self, state: &mut [f64]) -> Vec<[Mode; 2]> {
        let first = 2 * self.coordinates();
        let mut modes = Vec::with_capacity(self.sliders.len());
        for (k, (e, slider)) in self.sliders.iter().enumerate() {
            let (u, du) = self.at(3 * e, state);
            let element = &self.elements[*e];
            let force = [state[first + 2 * k], state[first + 2 * k + 1]];
            let load = slider.bilateral_load(u[2]);
            let rise = slider.normal_stiffness * du[2];
            let size = slider.normal_load.max(slider.normal_stiffness * u[2].abs());
            let is_open =
                load < -ROUNDING * size || load <= ROUNDING * size && rise <= 0.0 && size > 0.0;
            let (mode, force) = if is_open || size == 0.0 {
                ([Mode::Open; 2], [0.0; 2])
            } else {
                self.gripped(element, slider, force, load.max(0.0), du, rise)
            };
            state[first + 2 * k..][..2].copy_from_slice(&force);
            modes.push(mode);
        }
        modes
    }

    /// Mode and force of a closed slider.
    fn gripped(
        &self,
        element: &ContactElement,
        slider: &Slider,
        force: [f64; 2],
        load: f64,
        du: [f64; 3],
        rise: f64,
    ) -> ([Mode; 2], [f64; 2]) {
        let limit = element.friction_coefficient * load;
        let kt = slider.gripping_stiffness(element.friction_coefficient);
        if kt == 0.0 {
            return ([Mode::Stick; 2], [0.0; 2]);
        }
        let at_limit = |size: f64| size >= limit * (1.0 - 1e-9);
        match element.law {
            FrictionLaw::Box => {
                let axes = [0, 1].map(|d| {
                    if !at_limit(force[d].abs()) {
                        return (Mode::Stick, force[d]);
                    }
                    let sign = direction(force[d], du[d]);
                    let speed = kt * sign * du[d] - element.friction_coefficient * rise;
                    let mode = if speed > 0.0 { Mode::Slip } else { Mode::Stick };
                    (mode, sign * limit)
                });
                (axes.map(|a| a.0), axes.map(|a| a.1))
            }
            FrictionLaw::Cone => {
                let size = magnitude(force);
                if !at_limit(size) {
                    return ([Mode::Stick; 2], force);
                }
                let along = along(force, du);
                let speed = kt * (along[0] * du[0] + along[1] * du[1])
                    - element.friction_coefficient * rise;
                let mode = if speed > 0.0 { Mode::Slip } else { Mode::Stick };
                ([mode; 2], along.map(|a| a * limit))
            }
        }
    }
}

/// Sign of a force, or of the motion where there is none.
pub(super) fn direction(force: f64, speed: f64) -> f64 {
    if force != 0.0 {
        force.signum()
    } else {
        speed.signum()
    }
}

/// Direction of a force, or of the motion where there is none.
pub(super) fn along(force: [f64; 2], speed: [f64; 3]) -> [f64; 2] {
    let of = |v: [f64; 2]| {
        let size = magnitude(v);
        (size > f64::MIN_POSITIVE.sqrt()).then(|| v.map(|v| v / size))
    };
    of(force)
        .or_else(|| of([speed[0], speed[1]]))
        .unwrap_or([0.0; 2])
}
