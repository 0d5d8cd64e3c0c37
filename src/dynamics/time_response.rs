//! The forced response by integration in time alone ([`TimeModel`]): at each frequency the motion is followed until it repeats after every
//! period of the drive, from where it was at the frequency before. Nothing of it is found by the harmonic balance, which it judges.
//!
//! The error of an amplitude is what steps of half the length change of it, and how far both motions are from periodic ones by a step of
//! Newton's method: what had not settled is smaller by far over a period than on the whole where damping is small.

use std::f64::consts::TAU;

use super::contact_element::ContactElement;
use super::forced_response::{ForcedPoint, FoundBy};
use super::periodic::{Periodic, Settled};
use super::survey::first_harmonic;
use super::time_integration::Motion;
use super::vibration::Vibration;
use super::{DynamicsError, HarmonicBalance};

/// Frequencies where the vibration does not say how many.
pub const FREQUENCIES: usize = 100;
/// Integration steps at a frequency until the motion settles: some seconds.
const SETTLING: usize = 1_000_000;
/// Steps to the periodic motion beside one that has settled.
const POLISHING: usize = 200_000;
/// Size that a motion from rest is first thought to have \[m\].
const USUAL: f64 = 1e-6;

impl Vibration {
    /// The response at the points of the range, [`FREQUENCIES`] where none are given, upwards from rest. `balance` says how displacements
    /// are told: harmonics and drive. Where the motion does not settle from that of the frequency before, it begins at rest again.
    ///
    /// # Errors
    /// [`DynamicsError::OutOfRange`] of a structure that cannot be integrated.
    pub fn forced_response_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
    ) -> Result<Vec<ForcedPoint>, DynamicsError> {
        let time = self.time_model(balance)?;
        let rest = time.rest();
        let mut last: Option<Motion> = None;
        let mut points = Vec::new();
        for omega in self.omegas_or(FREQUENCIES) {
            let before = last.take();
            let starts = before.iter().chain([&rest]);
            let mut point = ForcedPoint {
                frequency: omega / TAU,
                found_by: FoundBy::Nothing,
                residual: 1.0,
                branch: None,
                is_fold: false,
                response: None,
            };
            for start in starts {
                let begun = time.steps();
                let effort = |most: usize| most.saturating_sub(time.steps() - begun);
                let settled = time.settle(omega, start, USUAL, balance.harmonics(), SETTLING);
                match settled {
                    Ok(Settled::Periodic(periodic)) => {
                        let effort = effort(SETTLING).max(POLISHING);
                        let periodic = self.polished(balance, periodic, effort)?;
                        last = Some(periodic.0.motion.clone());
                        let mut response = self.of_motion(balance, &periodic.0);
                        response.error = periodic.1;
                        point.found_by = FoundBy::Time;
                        point.residual = periodic.0.change;
                        point.response = Some(response);
                        break;
                    }
                    Ok(Settled::Turns(turns)) => point.found_by = FoundBy::NotPeriodic(turns),
                    Ok(Settled::Unsettled(change)) if point.found_by == FoundBy::Nothing => {
                        point.found_by = FoundBy::NotSettled;
                        point.residual = change;
                    }
                    // Or it runs away: nothing damps it, or the steps become too short.
                    Ok(Settled::Unsettled(_)) | Err(_) => {}
                }
            }
            last = last.or(before);
            balance.gauge.add_point(omega);
            points.push(point);
        }
        Ok(points)
    }

    /// A motion that has settled, by Newton's method nearer to the periodic one, and the relative error of its amplitude.
    fn polished(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        settled: Periodic,
        effort: usize,
    ) -> Result<(Periodic, Option<f64>), DynamicsError> {
        let size = |periodic: &Periodic| {
            first_harmonic(balance, &periodic.displacement, self.response_port)
        };
        let (omega, amplitude) = (settled.omega, size(&settled));
        let (time, finer) = (
            self.time_model(balance)?,
            self.time_model(balance)?.halved(),
        );
        let harmonics = balance.harmonics();
        let near = time.nearest(omega, &settled.motion, amplitude, harmonics, effort);
        let periodic = near.ok().flatten().unwrap_or(settled);
        let near = finer.nearest(omega, &periodic.motion, amplitude, harmonics, effort);
        let error = match near.ok().flatten() {
            Some(fine) => periodic
                .distance
                .zip(fine.distance)
                .map(|(ours, theirs)| (size(&periodic) / size(&fine) - 1.0).abs() + ours + theirs),
            None => None,
        };
        Ok((periodic, error))
    }
}
