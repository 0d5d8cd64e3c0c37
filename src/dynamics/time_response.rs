//! The forced response by integration in time alone ([`TimeModel`](super::time_integration::TimeModel)): at each frequency the motion is
//! followed until it repeats after every period of the drive, from where it was at the frequency before. Nothing of it is found by the
//! harmonic balance, which it judges.
//!
//! The error of an amplitude is what steps of half the length change of it, and how far both motions are from periodic ones by a step of
//! Newton's method: what had not settled is smaller by far over a period than on the whole where damping is small.

use std::f64::consts::TAU;

use super::contact_element::ContactElement;
use super::forced_response::{ForcedPoint, FoundBy, PointResponse};
use super::periodic::{Periodic, Settled};
use super::survey::first_harmonic;
use super::time_integration::Motion;
use super::vibration::Vibration;
use super::{DynamicsError, Energy, HarmonicBalance};
use crate::journal::{Inputs, Reader, Writer};

/// Frequencies where the vibration does not say how many.
pub const FREQUENCIES: usize = 100;
/// Integration steps at a frequency until the motion settles: some seconds.
const SETTLING: usize = 1_000_000;
/// Steps to the periodic motion beside one that has settled.
const POLISHING: usize = 200_000;
/// Size that a motion from rest is first thought to have \[m\].
const USUAL: f64 = 1e-6;

fn point_without_response(omega: f64) -> ForcedPoint {
    ForcedPoint {
        frequency: omega / TAU,
        found_by: FoundBy::Nothing,
        residual: 1.0,
        branch: None,
        is_fold: false,
        response: None,
    }
}

/// As [`Vibration::read`] reads it.
fn written((point, motion): &(ForcedPoint, Option<Motion>)) -> Vec<u8> {
    let mut out = Writer::default();
    out.count(match point.found_by {
        FoundBy::Time => 1,
        FoundBy::NotSettled => 2,
        FoundBy::NotPeriodic(turns) => turns as u64 + 2,
        _ => 0,
    });
    out.number(point.residual);
    if let (Some(motion), Some(response)) = (motion, &point.response) {
        out.numbers(&motion.values);
        for value in [response.error, response.multiplier] {
            out.count(u64::from(value.is_some()));
            out.number(value.unwrap_or(0.0));
        }
        out.numbers(&[
            response.amplitude,
            response.phase_lag,
            response.peak_to_peak,
            response.energy.input,
            response.energy.friction,
            response.energy.viscous,
        ]);
        out.numbers(&response.displacement);
    }
    out.0
}

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
            let start = last.as_ref().unwrap_or(&rest);
            let inputs = Inputs::default().numbers(&[omega]).numbers(&start.values);
            let kept = balance.journal.take(&inputs);
            let read = kept.as_ref();
            let read = read.and_then(|kept| self.read(balance, omega, &rest, kept));
            let found = match read {
                Some(read) => read,
                None => self.settled(balance, omega, last.as_ref())?,
            };
            if kept.is_none() {
                balance.journal.add(&inputs, &written(&found));
            }
            let (point, motion) = found;
            last = motion.or(last);
            balance.gauge.add_point(omega);
            points.push(point);
        }
        Ok(points)
    }

    /// What the motion at `omega` settles to from `last`, else from rest, and the periodic motion if it is one.
    fn settled(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        last: Option<&Motion>,
    ) -> Result<(ForcedPoint, Option<Motion>), DynamicsError> {
        let time = self.time_model(balance)?;
        let rest = time.rest();
        let mut point = point_without_response(omega);
        for start in last.into_iter().chain([&rest]) {
            match time.settle(omega, start, USUAL, balance.harmonics(), SETTLING) {
                Ok(Settled::Periodic(periodic)) => {
                    let (periodic, error) = self.polished(balance, periodic, POLISHING)?;
                    let mut response = self.of_motion(balance, &periodic);
                    response.error = error;
                    point.found_by = FoundBy::Time;
                    point.residual = periodic.change;
                    point.response = Some(response);
                    return Ok((point, Some(periodic.motion)));
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
        Ok((point, None))
    }

    /// A point that an earlier start has kept; none of what was not written for this balance.
    fn read(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        omega: f64,
        rest: &Motion,
        kept: &[u8],
    ) -> Option<(ForcedPoint, Option<Motion>)> {
        let mut reader = Reader(kept);
        let mut point = point_without_response(omega);
        point.found_by = match reader.count()? {
            0 => FoundBy::Nothing,
            1 => FoundBy::Time,
            2 => FoundBy::NotSettled,
            turns => FoundBy::NotPeriodic(usize::try_from(turns - 2).ok()?),
        };
        point.residual = reader.number()?;
        if point.found_by != FoundBy::Time {
            return reader.0.is_empty().then_some((point, None));
        }
        let values = reader.numbers(rest.values.len())?;
        let mut optional = || Some((reader.count()? == 1, reader.number()?));
        let [error, multiplier] = [optional()?, optional()?];
        let of = |(is_there, value): (bool, f64)| is_there.then_some(value);
        let [amplitude, phase_lag, peak_to_peak, input, friction, viscous] =
            <[f64; 6]>::try_from(reader.numbers(6)?).ok()?;
        let displacement = reader.numbers(balance.harmonics().coefficients())?;
        point.response = Some(PointResponse {
            amplitude,
            phase_lag,
            peak_to_peak,
            displacement,
            energy: Energy {
                input,
                friction,
                viscous,
            },
            error: of(error),
            friction_error: None,
            active_elements: 0,
            multiplier: of(multiplier),
        });
        reader
            .0
            .is_empty()
            .then_some((point, Some(Motion { values })))
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
