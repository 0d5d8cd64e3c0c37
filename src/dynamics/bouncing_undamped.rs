//! Bouncing without damping: under one harmonic of the loads such a motion may be the same forwards and backwards in time, so that the mass stands
//! still where that load is largest or least, and half a period later. All of these motions at a frequency are the zeros of one function of where it stands. Some of
//! them are left as damping and the other loads grow to their own sizes.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::bouncing_path::Bounce;
use super::two_springs::{Drive, State, TwoSprings};

/// How far from the edge the mass may stand: from this part of what the contact is pressed at rest, or of what the load moves it by if that is more,
/// to this multiple, and steps by this factor.
const STANDS: [f64; 2] = [1e-2, 1e4];
const NEXT: f64 = 1.06;
/// No motion reaches farther than the load lets damping have, times this: it bounces as fast as the drive or faster.
const REACH: f64 = 3.0;
/// Bisections between two places.
const BISECTIONS: usize = 20;
/// Least step of damping and the other loads, in parts of their own sizes.
const LEAST_SHARE: f64 = 1.0 / 32.0;

impl TwoSprings {
    /// Motions that bounce at an angular frequency, from those that do so without damping under its strongest load alone. And the
    /// evaluations that this took.
    pub(super) fn grown_from_undamped(&self, omega: f64) -> (Vec<Bounce>, usize) {
        let size = |order: &u32| self.force(*order, omega).norm();
        let orders = self.orders();
        let Some(order) = orders
            .into_iter()
            .max_by(|a, b| size(a).total_cmp(&size(b)))
        else {
            return (Vec::new(), 0);
        };
        // Half a period later an even order is as large again, and least in between.
        let ways: &[f64] = if order % 2 == 0 { &[1.0, -1.0] } else { &[1.0] };
        let (mut out, mut evaluations) = (Vec::new(), 0);
        for way in ways {
            let (states, needed) = self.undamped(omega, order, *way);
            evaluations += needed;
            for state in states {
                let (found, needed) = self.grown(omega, order, state);
                evaluations += needed;
                out.extend(found.filter(|bounce| bounce.shape.bounces()));
            }
        }
        (out, evaluations)
    }

    /// States at the phase 0 of the motions that are the same in both directions of time from where the load of an order is largest, or least as the sign
    /// of `way` says, without damping and under that load alone.
    fn undamped(&self, omega: f64, order: u32, way: f64) -> (Vec<State>, usize) {
        let force = self.force(order, omega);
        let alone = self.with_share(omega, order, 0.0);
        // That is its phase 0.
        let turned = TwoSprings {
            loads: vec![(order, (way * force.norm()).into())],
            ..alone.clone()
        };
        let drive = Drive::new(&turned, omega, 1.0);
        let period = TAU / omega;
        let speed_at_half = |stands: f64| {
            let half = drive.over(0.0, 0.5 * period, [stands, 0.0]);
            half.map_or(f64::NAN, |state| state[1])
        };
        let closed = self.stiffness[1];
        let pressed = (self.steady[1] / closed - self.edge).abs();
        let unit = pressed.max(force.norm() / closed);
        let reach = REACH * force.norm() / (self.damping * omega) / unit;
        let [least, most] = STANDS;
        let steps = (most.min(reach).max(1.0) / least).ln() / NEXT.ln();
        let apart = (0..=steps as i32).map(|k| unit * least * NEXT.powi(k));
        let below = apart.clone().rev().map(|apart| self.edge - apart);
        let stands: Vec<f64> = below.chain(apart.map(|apart| self.edge + apart)).collect();
        let speeds: Vec<f64> = stands.iter().map(|z| speed_at_half(*z)).collect();
        let places = stands.windows(2).zip(speeds.windows(2));
        let zeros = places.filter(|(_, speeds)| speeds[0] * speeds[1] < 0.0);
        let zeros = zeros.map(|(stands, speeds)| {
            let (mut low, mut high) = (stands[0], stands[1]);
            for _ in 0..BISECTIONS {
                let middle = 0.5 * (low + high);
                match speed_at_half(middle) * speeds[0] > 0.0 {
                    true => low = middle,
                    false => high = middle,
                }
            }
            0.5 * (low + high)
        });
        let zeros: Vec<f64> = zeros.collect();
        let own = Drive::new(&alone, omega, 1.0);
        let at = (-(way * force).arg()).rem_euclid(TAU) / (f64::from(order) * omega);
        let states = zeros
            .into_iter()
            .filter_map(|z| own.over(at, period - at, [z, 0.0]))
            .filter(|state| self.may_last(&own, order, *state))
            .collect();
        (states, drive.evaluations() + own.evaluations())
    }

    /// The periodic motion to which one without damping and under the load of one order leads, if it does.
    fn grown(&self, omega: f64, order: u32, mut state: State) -> (Option<Bounce>, usize) {
        let (mut share, mut step, mut evaluations) = (0.0, 1.0, 0);
        while step >= LEAST_SHARE {
            let next = f64::min(share + step, 1.0);
            if next == 1.0 {
                let (found, needed) = self.bounce(omega, state);
                evaluations += needed;
                if found.is_some() {
                    return (found, evaluations);
                }
            } else {
                let there = self.with_share(omega, order, next);
                let drive = Drive::new(&there, omega, 1.0);
                let found = drive.periodic(state);
                evaluations += drive.evaluations();
                if let Some(found) = found {
                    (share, state) = (next, found);
                    continue;
                }
            }
            step *= 0.5;
        }
        (None, evaluations)
    }

    /// The mass at an angular frequency, with a share of its damping and of its loads but for the order that is given.
    fn with_share(&self, omega: f64, whole: u32, share: f64) -> TwoSprings {
        let loads = self.orders().into_iter().map(|order| {
            let share = if order == whole { 1.0 } else { share };
            (order, share * self.force(order, omega))
        });
        TwoSprings {
            damping: share * self.damping,
            loads: loads
                .filter(|(_, force)| *force != Complex64::ZERO)
                .collect(),
            inertial_loads: Vec::new(),
            ..self.clone()
        }
    }
}
