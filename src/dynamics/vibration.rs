//! A driven structure whose contact elements change: what the response to them is made from, and its figures.

use super::contact_element::ContactElement;
use super::continuation::ContinuationSettings;
use super::{
    DynamicsError, Energy, HarmonicBalance, Harmonics, Load, Response, SecondOrder, Settings, Start,
};

/// Newton correction that a point of a forced response is left with at most; its energies are then in balance to 1e-10.
const FRF_TOLERANCE: f64 = 1e-7;
/// The same of banks of sliders, whose every Newton step is dear: far below the width of a line of a plot.
const DEAR_FRF_TOLERANCE: f64 = 1e-5;
/// The largest step of their continuation: lines between points of a linear resonance are within 0.2 % of its peak.
const DEAR_STEP: f64 = 1.0 / 12.0;

/// A structure, how it is driven and what of its response is wanted: all but the contact elements, which change as they wear.
#[derive(Debug, Clone)]
pub struct Vibration {
    /// The damped structure with its ports.
    pub model: SecondOrder,
    /// The loads; the first of harmonic 1 is the drive.
    pub loads: Vec<Load>,
    /// The port whose first harmonic is the response.
    pub response_port: usize,
    /// The harmonics.
    pub harmonics: Harmonics,
    /// Accuracy and effort.
    pub settings: Settings,
    /// Angular frequencies between which the resonance lies \[rad/s\].
    pub range: (f64, f64),
}

/// The resonance of a structure with its contact elements.
#[derive(Debug, Clone, PartialEq)]
pub struct Resonance {
    /// The response whose displacement at the drive is 90° behind it.
    pub phase: Response,
    /// Half range of the first harmonic at the response port there \[m\].
    pub amplitude: f64,
    /// Frequency of the largest first harmonic at the response port (see [`Vibration::resonance`]) \[Hz\].
    pub peak_frequency: f64,
    /// That harmonic \[m\].
    pub peak_amplitude: f64,
    /// Newton iterations of both.
    pub iterations: usize,
}

/// One point of a forced response.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForcedPoint {
    /// Frequency of the fundamental \[Hz\].
    pub frequency: f64,
    /// Half range of the first harmonic at the response port \[m\].
    pub amplitude: f64,
    /// Its lag behind the drive \[rad\].
    pub phase_lag: f64,
    /// Energy per cycle.
    pub energy: Energy,
    /// Elements that had unknowns.
    pub active_elements: usize,
}

impl Vibration {
    /// The structure with these contact elements.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn balance(
        &self,
        elements: Vec<ContactElement>,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        self.balance_of(elements, self.harmonics.clone())
    }

    /// The same in other harmonics, with the samples that more of them need.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::new`].
    pub fn balance_of(
        &self,
        elements: Vec<ContactElement>,
        harmonics: Harmonics,
    ) -> Result<HarmonicBalance<ContactElement>, DynamicsError> {
        let mut settings = self.settings;
        if harmonics.highest() > self.harmonics.highest() {
            settings.samples = settings.samples.max(4 * harmonics.highest() as usize + 2);
        }
        let loads = self.loads.clone();
        HarmonicBalance::new(&self.model, elements, harmonics, loads, settings)
    }

    /// Phase resonance and peak, from `start` if there is one. The peak is the highest in the range if the unknowns of all elements
    /// are few enough for elimination, so that a whole branch costs little; otherwise that of the phase resonance.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance`] and [`HarmonicBalance::peak`].
    pub fn resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Resonance, DynamicsError> {
        let phase = balance.phase_resonance(self.range, start)?;
        let port = self.response_port;
        let near = balance.peak(port, self.range, &phase.start());
        let peak = if balance.is_small() {
            let highest = balance.highest_peak(port, self.range, near.as_ref().ok().cloned())?;
            highest.map_or(near, Ok)?
        } else {
            near?
        };
        Ok(Resonance {
            amplitude: balance.amplitude(&phase, self.response_port)?.0,
            peak_frequency: peak.frequency(),
            peak_amplitude: balance.amplitude(&peak, self.response_port)?.0,
            iterations: phase.iterations + peak.iterations,
            phase,
        })
    }

    /// The response over the range: at `points` equidistant frequencies, on the branches on which a sweep upwards arrives
    /// ([`HarmonicBalance::forced_response`]), or as continuation places its points, overhanging parts of the branch included
    /// ([`HarmonicBalance::branch`]). Points of a large model are solved to 1e-7 of the displacements if not as exactly as the balance
    /// says: they are looked at, and nothing goes on from them.
    ///
    /// # Errors
    /// That of the first point that has none: an unconverged point is never a result.
    pub fn forced_response(
        &self,
        mut balance: HarmonicBalance<ContactElement>,
        points: Option<usize>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        if !balance.is_small() {
            let enough = match balance.is_costly {
                true => DEAR_FRF_TOLERANCE,
                false => FRF_TOLERANCE,
            };
            balance.settings.tolerance = balance.settings.tolerance.max(enough);
        }
        let (from, to) = self.range;
        let responses = match points {
            Some(points) => {
                let last = points.saturating_sub(1).max(1) as f64;
                let omegas: Vec<f64> = (0..points)
                    .map(|k| from + (to - from) * k as f64 / last)
                    .collect();
                balance.forced_response(&omegas)?
            }
            None => {
                let mut settings = ContinuationSettings::over(from, to, self.response_port);
                if balance.is_costly {
                    settings.largest_step = DEAR_STEP;
                }
                balance.branch(settings)?
            }
        };
        let point = |response: &Response| -> Result<ForcedPoint, DynamicsError> {
            let (amplitude, phase_lag) = balance.amplitude(response, self.response_port)?;
            Ok(ForcedPoint {
                frequency: response.frequency(),
                amplitude,
                phase_lag,
                energy: response.energy,
                active_elements: response.active_elements(),
            })
        };
        responses.iter().map(point).collect()
    }
}
