//! A driven structure whose contact elements change: what the response to them is made from, and its figures.

use super::contact_element::ContactElement;
use super::continuation::{Continuation, ContinuationSettings};
use super::cycle::JointCycle;
use super::harmonic_balance::Start;
use super::{
    DynamicsError, ElementState, Energy, HarmonicBalance, Harmonics, Load, Response, SecondOrder,
    Settings,
};

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
    /// Frequency of the largest first harmonic at the response port \[Hz\].
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

/// How evenly a joint moves and is loaded over a cycle. Shares are of half ranges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spread {
    /// Elements that stick, slip, and open.
    pub states: [usize; 3],
    /// Half range of the joint's displacement along x \[m\].
    pub displacement: f64,
    /// Largest difference between that of an element and the joint's, in parts of the joint's.
    pub displacement_spread: f64,
    /// Of the joint's normal load, in parts of the static one.
    pub load: f64,
    /// Largest of an element's normal load, in parts of its static one, among elements that have one.
    pub element_load: f64,
    /// Larger of the moments about x and y, in parts of the static load times the lever.
    pub moment: f64,
    /// Of the moment about the normal, in the same parts.
    pub torsion: f64,
}

/// Half the range of a series; 0 of an empty one.
pub fn half_range(series: impl IntoIterator<Item = f64>) -> f64 {
    let (least, most) = series.into_iter().fold(
        (f64::INFINITY, f64::NEG_INFINITY),
        |(least, most), value| (least.min(value), most.max(value)),
    );
    0.5 * (most - least).max(0.0)
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
        HarmonicBalance::new(
            &self.model,
            elements,
            self.harmonics.clone(),
            self.loads.clone(),
            self.settings,
        )
    }

    /// Phase resonance and peak, from `start` if there is one.
    ///
    /// # Errors
    /// Those of [`HarmonicBalance::phase_resonance`] and [`HarmonicBalance::peak`].
    pub fn resonance(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        start: Option<&Start>,
    ) -> Result<Resonance, DynamicsError> {
        let phase = balance.phase_resonance(self.range, start)?;
        let peak = balance.peak(self.response_port, self.range, &phase.start())?;
        Ok(Resonance {
            amplitude: balance.amplitude(&phase, self.response_port)?.0,
            peak_frequency: peak.frequency(),
            peak_amplitude: balance.amplitude(&peak, self.response_port)?.0,
            iterations: phase.iterations + peak.iterations,
            phase,
        })
    }

    /// The response over the range: at `points` equidistant frequencies, or as continuation places its points.
    ///
    /// # Errors
    /// That of the first point that has none: an unconverged point is never a result.
    pub fn forced_response(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        points: Option<usize>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
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
                let settings = ContinuationSettings::over(from, to, self.response_port);
                Continuation::new(balance, settings)?.collect::<Result<_, _>>()?
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

impl HarmonicBalance<ContactElement> {
    /// The worst state of every element over a cycle.
    pub fn states(&self, response: &Response) -> Vec<ElementState> {
        let cycles = self.element_cycles(response, self.sampling());
        cycles.iter().map(|cycle| cycle.state).collect()
    }

    /// How evenly the joint moves; `joint` is its [`joint_cycle`](super::cycle::joint_cycle), `lever` half its length \[m\].
    pub fn spread(&self, response: &Response, joint: &JointCycle, lever: f64) -> Spread {
        let cycles = self.element_cycles(response, self.sampling());
        let along_x = |series: &[[f64; 3]]| half_range(series.iter().map(|u| u[0]));
        let displacement = along_x(&joint.displacement);
        let width = 3 * self.harmonics().coefficients();
        let mut spread = Spread {
            states: [0; 3],
            displacement,
            displacement_spread: 0.0,
            load: 0.0,
            element_load: 0.0,
            moment: 0.0,
            torsion: 0.0,
        };
        let part = |value: f64, of: f64| if of > 0.0 { value / of } else { 0.0 };
        let rows = response.displacement.chunks(width);
        for ((element, cycle), row) in self.elements().iter().zip(&cycles).zip(rows) {
            spread.states[cycle.state as usize] += 1;
            let own = along_x(&self.sampling().synthesise(row));
            let difference = part((own - displacement).abs(), displacement);
            spread.displacement_spread = spread.displacement_spread.max(difference);
            let varies = half_range(cycle.force.iter().map(|f| f[2]));
            spread.element_load = spread.element_load.max(part(varies, element.normal_load));
        }
        let load: f64 = self.elements().iter().map(|e| e.normal_load).sum();
        let of = |d: usize| half_range(joint.moment.iter().map(|m| m[d]));
        spread.load = part(half_range(joint.force.iter().map(|f| f[2])), load);
        spread.moment = part(of(0).max(of(1)), load * lever);
        spread.torsion = part(of(2), load * lever);
        spread
    }
}
