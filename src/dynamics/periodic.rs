//! Periodic motions of a [`TimeModel`] and their stability, by integration over periods and Newton's method on the map from one to the
//! next (shooting).

use std::f64::consts::TAU;

use super::time_integration::{Measured, Motion, TimeModel};
use super::{DynamicsError, Energy, Harmonics};
use crate::linalg::{RowMatrix as Matrix, add_scaled, eigenvalues};

/// Change of a motion over a period, relative to its size, at which it is periodic.
const PERIODIC: f64 = 1e-8;
/// Change of a motion over a period, relative to its size, at which it is periodic where its stability is asked for, and its amplitude to that.
const NEARLY: f64 = 1e-6;
/// Periods between attempts to find the periodic motion at once, and all at most.
const BETWEEN: usize = 24;
const MOST_PERIODS: usize = 1200;
/// Newton's steps of an attempt.
const STEPS: usize = 8;
/// Share of a change over a period that a step leaves after which its derivative is carried on.
const LEADS_ON: f64 = 0.3;
/// Derivatives of the map that most attempts need: where less than their begin is allowed, none is begun.
const DERIVATIVES: usize = 3;
/// Steps at which a search is ended within a period, relative to those that it may take: it looks at them between periods.
const OVER: usize = 2;
/// Differences of the map, relative to the size of a motion: above what the events leave, far below where the modes change.
const DIFFERENCE: f64 = 1e-5;
/// Regularisation of a step, relative to the largest square: a slider that sticks keeps any force.
const REGULARISATION: f64 = 1e-14;
/// A multiplier beyond this grows.
pub(super) const UNSTABLE: f64 = 1.0 + 1e-4;
/// Longest period of a motion, in periods of the loads, that is told from one that does not settle.
const MOST_TURNS: usize = 8;
/// A motion so much larger than the one it began as has run away.
const AWAY: f64 = 1e6;

/// A periodic motion.
#[derive(Debug, Clone, PartialEq)]
pub struct Periodic {
    /// Angular frequency of its fundamental \[rad/s\].
    pub omega: f64,
    /// Where it is at the phase 0 of the loads.
    pub motion: Motion,
    /// Coefficients of the displacement of every port, `ports × coefficients` \[m\].
    pub displacement: Vec<f64>,
    /// Energy per period.
    pub energy: Energy,
    /// Change over a period, relative to its size.
    pub change: f64,
    /// How far from the periodic motion it is, relative to its size, by a step of Newton's method; none where that was not made.
    pub distance: Option<f64>,
    /// Largest modulus of the multipliers by which small disturbances grow over a period, but for those of forces that stick; none where
    /// the motion was reached by waiting, and is stable by that, or where that was not asked for.
    pub multiplier: Option<f64>,
}

/// What is asked of Newton's method on the map over a period.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Asked {
    /// The motion, as cheaply as it can be had: derivatives are carried from one step to the next (Broyden 1965) while they lead on.
    Motion,
    /// And its stability.
    Stability,
}

/// What Newton's method on the map over a period has led to.
struct Shot {
    motion: Motion,
    /// Over a period, relative to its size.
    change: f64,
    /// Largest modulus of the multipliers, where stability was asked for.
    multiplier: Option<f64>,
    /// The step that Newton's method would make next, where stability was asked for.
    distance: Option<f64>,
}

/// What becomes of a motion.
#[derive(Debug, Clone, PartialEq)]
pub enum Settled {
    /// It repeats after every period of the loads.
    Periodic(Periodic),
    /// It repeats after so many periods.
    Turns(usize),
    /// It does not repeat within what was waited for; the change over the last period, relative to its size.
    Unsettled(f64),
}

impl TimeModel<'_> {
    /// What becomes of a motion at the angular frequency `omega` whose size is about `amplitude` \[m\], for about as many integration
    /// steps as `effort` says.
    ///
    /// # Errors
    /// [`DynamicsError::NotConverged`] of a motion that runs away.
    pub fn settle(
        &self,
        omega: f64,
        start: &Motion,
        amplitude: f64,
        harmonics: &Harmonics,
        effort: usize,
    ) -> Result<Settled, DynamicsError> {
        let begun = self.steps();
        let within = || self.settle_within(omega, start, amplitude, harmonics, effort);
        match self.bounded(OVER.saturating_mul(effort), within) {
            Err(_) if self.steps() - begun >= OVER.saturating_mul(effort) => {
                Ok(Settled::Unsettled(1.0))
            }
            settled => settled,
        }
    }

    fn settle_within(
        &self,
        omega: f64,
        start: &Motion,
        amplitude: f64,
        harmonics: &Harmonics,
        effort: usize,
    ) -> Result<Settled, DynamicsError> {
        let begun = self.steps();
        let mut scales = self.scales(omega, amplitude);
        let mut now = start.clone();
        let mut earlier: Vec<Motion> = Vec::new();
        let mut change = f64::INFINITY;
        for period in 1..=MOST_PERIODS {
            let before = now.clone();
            self.period(omega, &mut now, &scales, None)?;
            change = apart(&before, &now, &scales);
            let size = size(&now, &scales);
            if size.is_nan() || size > AWAY {
                break;
            }
            if self.steps() - begun > effort {
                break;
            }
            if size > 2.0 {
                // The motion is larger than it was thought to be.
                scales = self.scales(omega, size * scales[0]);
            }
            if change <= PERIODIC {
                return self.measured(omega, now, &scales, harmonics, change);
            }
            if period % BETWEEN == 0
                && let Some(shot) =
                    self.shoot(omega, &now, &scales, PERIODIC, Asked::Stability, effort)?
                && shot
                    .multiplier
                    .is_some_and(|multiplier| multiplier <= UNSTABLE)
            {
                return self.shot(omega, shot, &scales, harmonics);
            }
            earlier.push(before);
            if earlier.len() > MOST_TURNS {
                earlier.remove(0);
            }
        }
        for (turns, motion) in earlier.iter().rev().enumerate().skip(1) {
            if apart(motion, &now, &scales) <= 1e3 * PERIODIC {
                return Ok(Settled::Turns(turns + 1));
            }
        }
        Ok(Settled::Unsettled(change))
    }

    /// The periodic motion near `start`, stable or not; none where Newton's method finds none in about as many integration steps as
    /// `effort` says.
    ///
    /// # Errors
    /// As [`Self::settle`].
    pub fn near(
        &self,
        omega: f64,
        start: &Motion,
        amplitude: f64,
        harmonics: &Harmonics,
        effort: usize,
    ) -> Result<Option<Periodic>, DynamicsError> {
        let scales = self.scales(omega, amplitude);
        self.near_by(omega, start, &scales, harmonics, Asked::Stability, effort)
    }

    /// As [`Self::near`], with the sizes that errors are measured by.
    ///
    /// # Errors
    /// As [`Self::settle`].
    pub(super) fn near_by(
        &self,
        omega: f64,
        start: &Motion,
        scales: &[f64],
        harmonics: &Harmonics,
        asked: Asked,
        effort: usize,
    ) -> Result<Option<Periodic>, DynamicsError> {
        self.near_within(NEARLY, omega, start, scales, harmonics, asked, effort)
    }

    /// As [`Self::near`], to a change over a period as small as that of a motion that has settled.
    ///
    /// # Errors
    /// As [`Self::settle`].
    pub fn nearest(
        &self,
        omega: f64,
        start: &Motion,
        amplitude: f64,
        harmonics: &Harmonics,
        effort: usize,
    ) -> Result<Option<Periodic>, DynamicsError> {
        let scales = self.scales(omega, amplitude);
        let asked = Asked::Stability;
        self.near_within(PERIODIC, omega, start, &scales, harmonics, asked, effort)
    }

    #[allow(clippy::too_many_arguments)]
    fn near_within(
        &self,
        enough: f64,
        omega: f64,
        start: &Motion,
        scales: &[f64],
        harmonics: &Harmonics,
        asked: Asked,
        effort: usize,
    ) -> Result<Option<Periodic>, DynamicsError> {
        self.bounded(OVER.saturating_mul(effort), || {
            let Some(shot) = self.shoot(omega, start, scales, enough, asked, effort)? else {
                return Ok(None);
            };
            match self.shot(omega, shot, scales, harmonics)? {
                Settled::Periodic(periodic) => Ok(Some(periodic)),
                _ => Ok(None),
            }
        })
    }

    fn shot(
        &self,
        omega: f64,
        shot: Shot,
        scales: &[f64],
        harmonics: &Harmonics,
    ) -> Result<Settled, DynamicsError> {
        let Shot {
            motion,
            change,
            multiplier,
            distance,
        } = shot;
        let mut settled = self.measured(omega, motion, scales, harmonics, change)?;
        if let Settled::Periodic(periodic) = &mut settled {
            (periodic.multiplier, periodic.distance) = (multiplier, distance);
        }
        Ok(settled)
    }

    fn measured(
        &self,
        omega: f64,
        mut motion: Motion,
        scales: &[f64],
        harmonics: &Harmonics,
        change: f64,
    ) -> Result<Settled, DynamicsError> {
        let start = motion.clone();
        let measured = self.period(omega, &mut motion, scales, Some(harmonics))?;
        let Some(Measured {
            displacement,
            energy: [input, friction, viscous],
        }) = measured
        else {
            return Ok(Settled::Unsettled(change));
        };
        Ok(Settled::Periodic(Periodic {
            omega,
            motion: start,
            displacement,
            energy: Energy {
                input,
                friction,
                viscous,
            },
            change,
            distance: None,
            multiplier: None,
        }))
    }

    /// A fixed point of the map over a period by Newton's method with differences.
    fn shoot(
        &self,
        omega: f64,
        start: &Motion,
        scales: &[f64],
        enough: f64,
        asked: Asked,
        effort: usize,
    ) -> Result<Option<Shot>, DynamicsError> {
        let begun = self.steps();
        let order = start.values.len();
        let map = |motion: &Motion| -> Result<Motion, DynamicsError> {
            let mut next = motion.clone();
            self.period(omega, &mut next, scales, None)?;
            Ok(next)
        };
        // Of a motion and where it is after a period.
        let defect = |now: &Motion, image: &Motion| -> Vec<f64> {
            let each = |i: usize| (image.values[i] - now.values[i]) / scales[i];
            (0..order).map(each).collect()
        };
        let is_quick = asked == Asked::Motion;
        let mut now = start.clone();
        let Ok(mut image) = map(&now) else {
            return Ok(None);
        };
        let mut change = apart(&now, &image, scales);
        let each = self.steps() - begun;
        let derivatives = if is_quick { 1 } else { DERIVATIVES - 1 };
        if change > enough && each * (derivatives * (order + 1) + 1) > effort {
            return Ok(None);
        }
        // The derivative of the defect there; and where it was carried there.
        let mut slope: Option<Matrix> = None;
        let mut carried: Option<Matrix> = None;
        for _ in 0..STEPS {
            if self.steps() - begun > effort {
                return Ok(None);
            }
            if is_quick && change <= enough {
                break;
            }
            let is_carried = carried.is_some();
            let system = match carried.take() {
                Some(system) => system,
                None => self.defect_slope(omega, &now, &image, scales)?,
            };
            slope = Some(system.clone());
            if change <= enough {
                break;
            }
            let before = defect(&now, &image);
            let right: Vec<f64> = before.iter().map(|d| -d).collect();
            let Some(step) = least_squares(&system, &right) else {
                return Ok(None);
            };
            let mut taken = None;
            for length in [1.0, 0.5, 0.25, 0.125] {
                let mut trial = now.clone();
                for i in 0..order {
                    trial.values[i] += length * step[i] * scales[i];
                }
                let Ok(there) = map(&trial) else { continue };
                let left = apart(&trial, &there, scales);
                if left < (1.0 - 0.2 * length) * change {
                    taken = Some((length, left / change));
                    (now, image, change) = (trial, there, left);
                    break;
                }
                if is_carried {
                    break;
                }
            }
            match taken {
                Some((length, share)) if is_quick && share <= LEADS_ON => {
                    let step: Vec<f64> = step.iter().map(|s| length * s).collect();
                    let rise = defect(&now, &image);
                    let rise: Vec<f64> = rise.iter().zip(&before).map(|(a, b)| a - b).collect();
                    carried = Some(carried_on(system, &step, &rise));
                }
                // A fresh derivative may lead on from there.
                None if is_carried => {}
                None => return Ok(None),
                Some(_) => {}
            }
        }
        if change > enough {
            return Ok(None);
        }
        if is_quick {
            return Ok(Some(Shot {
                motion: now,
                change,
                multiplier: None,
                distance: None,
            }));
        }
        let Some(system) = slope else {
            return Ok(None);
        };
        let mut map = system.clone();
        for i in 0..order {
            map.set(i, i, map.at(i, i) + 1.0);
        }
        let multipliers = eigenvalues(&map).map_err(DynamicsError::of_matrix("monodromy"))?;
        let multiplier = multipliers.iter().map(|m| m.norm()).fold(0.0, f64::max);
        let left: Vec<f64> = defect(&now, &image).iter().map(|d| -d).collect();
        let step = least_squares(&system, &left);
        Ok(Some(Shot {
            motion: now,
            change,
            multiplier: Some(multiplier),
            distance: step.map(|step| largest(step.iter().map(|s| s.abs()))),
        }))
    }

    /// The derivative of the map over a period less that of no change, by differences, in parts of `scales`.
    fn defect_slope(
        &self,
        omega: f64,
        at: &Motion,
        image: &Motion,
        scales: &[f64],
    ) -> Result<Matrix, DynamicsError> {
        let order = at.values.len();
        let mut slope = Matrix::zeros(order, order);
        for column in 0..order {
            let mut shifted = at.clone();
            shifted.values[column] += DIFFERENCE * scales[column];
            self.period(omega, &mut shifted, scales, None)?;
            for row in 0..order {
                let change = (shifted.values[row] - image.values[row]) / scales[row];
                let unchanged = if row == column { 1.0 } else { 0.0 };
                slope.set(row, column, change / DIFFERENCE - unchanged);
            }
        }
        Ok(slope)
    }
}

/// A derivative after a step over which the function rises by `rise`: the nearest one that agrees with that.
fn carried_on(mut slope: Matrix, step: &[f64], rise: &[f64]) -> Matrix {
    let square: f64 = step.iter().map(|s| s * s).sum();
    let told = slope.apply(step);
    for (row, (rise, told)) in rise.iter().zip(told).enumerate() {
        add_scaled(slope.row_mut(row), (rise - told) / square, step);
    }
    slope
}

/// The least step that solves a system in the sense of least squares.
fn least_squares(system: &Matrix, right: &[f64]) -> Option<Vec<f64>> {
    let mut normal = Matrix::zeros(system.columns(), system.columns());
    normal.add_transposed_product(system, system);
    let largest = (0..normal.rows()).fold(0.0_f64, |m, i| m.max(normal.at(i, i)));
    for i in 0..normal.rows() {
        normal.set(i, i, normal.at(i, i) + REGULARISATION * largest);
    }
    let mut step = system.transposed().apply(right);
    normal.factorize().ok()?.solve(&mut step);
    step.iter().all(|s| s.is_finite()).then_some(step)
}

fn size(motion: &Motion, scales: &[f64]) -> f64 {
    let pairs = motion.values.iter().zip(scales);
    largest(pairs.map(|(v, s)| (v / s).abs()))
}

fn apart(a: &Motion, b: &Motion, scales: &[f64]) -> f64 {
    let pairs = a.values.iter().zip(&b.values).zip(scales);
    largest(pairs.map(|((a, b), s)| ((a - b) / s).abs()))
}

/// The largest of some values, or what is no number among them: that is never small.
fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.fold(0.0, |most: f64, value| {
        match value > most || value.is_nan() {
            true => value,
            false => most,
        }
    })
}

impl Periodic {
    /// Frequency of its fundamental \[Hz\].
    pub fn frequency(&self) -> f64 {
        self.omega / TAU
    }
}

#[cfg(test)]
mod tests {
    use super::super::{ContactElement, Harmonics, Load, Oscillator, Slider};
    use super::*;

    /// An orbit that slips, without a derivative at every step: the motion is the one that Newton's method leads to, in fewer steps. Errors are
    /// measured by each coordinate, of which one moves ten thousand times as far as another.
    #[test]
    fn a_motion_without_its_stability_is_the_same_and_costs_less() {
        const OMEGA: f64 = 200.0;
        const SIZES: [f64; 3] = [1e-2, 1e-3, 1e-6];
        // What Newton's method may leave of the change over a period, over what a period forgets of it.
        const SAME: f64 = 100.0 * NEARLY;
        let oscillator = Oscillator {
            mass: [1.0, 1.3, 0.5],
            damping: [4.0, 6.0, 3.0],
            stiffness: [4e4, 6e4, 4e4],
            element: ContactElement {
                springs: Vec::new(),
                area: 0.0,
                friction_coefficient: 0.4,
                law: Default::default(),
                sliders: vec![Slider {
                    normal_load: 10.0,
                    gap: 0.0,
                    tangential_stiffness: 3e4,
                    normal_stiffness: 9e5,
                }],
            },
        };
        let loads: Vec<Load> = vec![
            Oscillator::load(0, 20.0, 0.0),
            Oscillator::load(1, 4.0, 1.0),
            Oscillator::load(2, 1.0, 0.4),
        ];
        let model = oscillator.model().expect("an oscillator");
        let elements = [oscillator.element];
        let time = TimeModel::new(&model, &elements, &loads).expect("in time");
        let scales = time.scales_by(OMEGA, &SIZES);
        let harmonics = Harmonics::up_to(3);
        let [quick, whole] = [Asked::Motion, Asked::Stability].map(|asked| {
            let begun = time.steps();
            let found = time.near_by(OMEGA, &time.rest(), &scales, &harmonics, asked, 1_000_000);
            let found = found.expect("in time").expect("a periodic motion");
            (found, time.steps() - begun)
        });
        let off = apart(&quick.0.motion, &whole.0.motion, &scales);
        assert!(off < SAME, "{off}");
        assert!(quick.0.multiplier.is_none() && whole.0.multiplier.is_some());
        assert!(whole.0.energy.friction > 0.0);
        assert!(quick.1 < whole.1, "{} and {} steps", quick.1, whole.1);
    }
}
