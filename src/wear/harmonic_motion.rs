//! Motions with a single harmonic.

use std::f64::consts::TAU;

use super::motion::{Channel, EQUALITY_TOLERANCE, Motion, with_middles};

/// Harmonic channel, `amplitude · cos(2πt/T + phase)`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Harmonic {
    /// Half range of a displacement \[m\] or force \[N\], a rotation \[rad\] or moment \[N m\].
    pub amplitude: f64,
    /// Phase lead \[rad\].
    pub phase: f64,
    /// Whether the force or moment is prescribed.
    pub is_force: bool,
}

/// Harmonic drive of a joint, under the normal load `load + normal_load_amplitude · cos(2πt/T)`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct HarmonicMotion {
    /// Drive along x, and along y if there is shear in that direction.
    pub axes: Vec<Harmonic>,
    /// Drive about z.
    pub rotation: Option<Harmonic>,
    /// Half range of the normal load \[N\].
    pub normal_load_amplitude: f64,
}

impl HarmonicMotion {
    /// Returns the common phase of all moving channels, in turns, if all of them turn at the same time. The
    /// motion is then along a line.
    fn turns_together(&self) -> Option<f64> {
        let mut moving = self
            .axes
            .iter()
            .chain(&self.rotation)
            .filter(|channel| channel.amplitude != 0.0)
            .map(|channel| channel.phase / TAU);
        let first = moving.next()?;
        moving
            .all(|phase| (2.0 * (phase - first)).rem_euclid(1.0) <= EQUALITY_TOLERANCE)
            .then_some(first)
    }

    /// Returns true if the motion is along a line.
    pub fn is_straight(&self) -> bool {
        self.turns_together().is_some()
    }

    /// Samples one cycle about the mean `load`. The samples with even numbers are equally spaced in time. If all axes
    /// turn at the same time, the two ends of the motion are additional samples with even numbers. Each sample with an
    /// odd number lies midway in time between two samples with even numbers. The samples with even numbers alone are
    /// also a complete motion.
    pub fn sampled(&self, load: f64, samples: usize) -> Motion {
        let half = samples.div_ceil(2);
        let mut time: Vec<f64> = (0..half).map(|k| k as f64 / half as f64).collect();
        if let Some(first) = self.turns_together() {
            for end in [-first, 0.5 - first] {
                let end = end.rem_euclid(1.0);
                if end < 1.0 - EQUALITY_TOLERANCE
                    && time.iter().all(|t| (t - end).abs() > EQUALITY_TOLERANCE)
                {
                    time.push(end);
                }
            }
            time.sort_by(f64::total_cmp);
        }
        let time = with_middles(&time, 1.0);
        let channel = |harmonic: &Harmonic| {
            let values = time
                .iter()
                .map(|t| harmonic.amplitude * (TAU * t + harmonic.phase).cos())
                .collect();
            if harmonic.is_force {
                Channel::Force(values)
            } else {
                Channel::Displacement(values)
            }
        };
        Motion {
            drive: self.axes.iter().map(channel).collect(),
            rotation: self.rotation.as_ref().map(channel),
            normal_load: time
                .iter()
                .map(|t| load + self.normal_load_amplitude * (TAU * t).cos())
                .collect(),
            mean_load: load,
            nodal_motion: None,
            time,
            by_order: false,
        }
    }
}

impl Motion {
    /// Returns a harmonic motion with the samples of [`HarmonicMotion::sampled`]. The displacement along each axis is
    /// `amplitude · cos(2πt/T + phase)`. The normal load is `load + load_amplitude · cos(2πt/T)`.
    pub fn harmonic(axes: &[(f64, f64)], load: f64, load_amplitude: f64, samples: usize) -> Self {
        let axes: Vec<Harmonic> = axes
            .iter()
            .map(|&(amplitude, phase)| Harmonic {
                amplitude,
                phase,
                is_force: false,
            })
            .collect();
        let motion = HarmonicMotion {
            axes,
            rotation: None,
            normal_load_amplitude: load_amplitude,
        };
        motion.sampled(load, samples)
    }
}
