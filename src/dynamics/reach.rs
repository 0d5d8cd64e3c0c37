//! How large motions are at most that could not be followed.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::bouncing::{NORMAL, alone_on_the_normal};
use super::bouncing_path::Bounce;
use super::contact_element::ContactElement;
use super::damped_bound::DampedBound;
use super::two_springs::TwoSprings;
use super::vibration::Vibration;
use super::{HarmonicBalance, Load};

/// Parts, in equal ratios, of a range in each of which motions are bounded by themselves.
const PARTS: usize = 200;

/// A part of a range of which nothing is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unseen {
    /// Where it begins and ends \[Hz\].
    pub ends: [f64; 2],
    /// Amplitude of the first harmonic at the response port that no motion exceeds there \[m\]; infinite where nothing bounds it.
    pub reach: f64,
}

impl Unseen {
    /// What no motion exceeds in any of some parts \[m\]; 0 without any.
    pub(super) fn reach(all: &[Unseen]) -> f64 {
        all.iter().fold(0.0, |most, part| most.max(part.reach))
    }
}

impl Vibration {
    /// Parts of the range \[Hz\] of which nothing is known but what bounds all motions.
    pub(super) fn unseen(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        parts: &[[f64; 2]],
    ) -> Vec<Unseen> {
        let of = |ends: &[f64; 2]| Unseen {
            ends: *ends,
            reach: self.reach_within(balance, (TAU * ends[0], TAU * ends[1])),
        };
        parts.iter().map(of).collect()
    }

    /// Amplitude of the first harmonic at the response port that no motion exceeds in a range of angular frequencies \[m\]; infinite where nothing
    /// bounds it.
    pub(super) fn reach_within(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        (from, to): (f64, f64),
    ) -> f64 {
        let damped = self.damped_bound();
        let Some(bouncer) = self.bouncer(balance).filter(|_| self.is_across()) else {
            return amplitude(&damped, (from, to));
        };
        let own = self.own_frequencies(balance);
        let at = |k: usize| from * (to / from).powf(k as f64 / PARTS as f64);
        let within = |k: usize| {
            let (low, high) = (at(k), at(k + 1));
            let by_damping = amplitude(&damped, (low, high));
            // The structure without contact may resonate there.
            if own.iter().any(|omega| (low..=high).contains(omega)) {
                return by_damping;
            }
            let load = bouncer
                .most_mean_load(low)
                .max(bouncer.most_mean_load(high));
            let ends = [low, high].map(|omega| self.reach_at(balance, &damped, omega, load));
            by_damping.min(ends[0].max(ends[1]))
        };
        (0..PARTS).map(within).fold(0.0, f64::max)
    }

    /// Whether nothing that the response port moves is along the normal of the first contact element, whose force moves that alone.
    fn is_across(&self) -> bool {
        let normal = alone_on_the_normal(&self.model);
        normal.is_some_and(|k| self.model.basis.at(self.response_port, k) == 0.0)
    }

    /// What a motion has at most at the response port whose normal part is known \[m\]; along the normal that is its own.
    pub(super) fn reach_of(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        bouncer: &TwoSprings,
        motion: &Bounce,
    ) -> f64 {
        match self.response_port {
            NORMAL => motion.shape.first_harmonic,
            _ => {
                let load = bouncer.mean_load(&motion.shape);
                self.reach_at(balance, &self.damped_bound(), motion.omega, load)
            }
        }
    }

    /// What no motion exceeds at a response port that is not along the normal \[m\] at an angular frequency: neither what damping allows
    /// (`damped`, [`Vibration::damped_bound`]) nor what the loads and friction move there, the normal load being known by its mean \[N\].
    ///
    /// The first harmonic of friction is at most twice the mean of its size, and that is at most µ times the mean normal load.
    pub(super) fn reach_at(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        damped: &Option<DampedBound>,
        omega: f64,
        mean_load: f64,
    ) -> f64 {
        let damped = amplitude(damped, (omega, omega));
        match balance.elements() {
            [element] if self.is_across() => {
                let friction = 2.0 * element.friction_coefficient * mean_load;
                damped.min(self.moved_at(omega, friction))
            }
            _ => damped,
        }
    }

    /// Amplitude of the first harmonic at the response port \[m\] that the loads have at most together with forces along both axes of the plane of the
    /// first contact element whose first harmonics are `tangential` \[N\] at most, each.
    fn moved_at(&self, omega: f64, tangential: f64) -> f64 {
        let model = &self.model;
        let system = model.dynamic_stiffness(&model.stiffness, omega);
        let Ok(factors) = system.factorize() else {
            return f64::INFINITY;
        };
        let row = model.basis.row(self.response_port).iter();
        let mut by_force: Vec<Complex64> = row.map(|share| (*share).into()).collect();
        factors.solve(&mut by_force);
        let receptance = |port: usize| -> Complex64 {
            let row = model.basis.row(port).iter().zip(&by_force);
            row.map(|(share, moved)| share * moved).sum()
        };
        let moved = |loads: &[Load]| -> Complex64 {
            let first = loads.iter().filter(|load| load.harmonic == 1);
            let each =
                first.map(|load| Complex64::new(load.cosine, -load.sine) * receptance(load.port));
            each.sum()
        };
        let by_loads = moved(&self.loads) + moved(&self.inertial_loads) * omega * omega;
        let by_friction = (receptance(0).norm() + receptance(1).norm()) * tangential;
        by_loads.norm() + by_friction
    }
}

/// What damping allows in a range of angular frequencies \[m\]; infinite where it bounds nothing.
fn amplitude(damped: &Option<DampedBound>, range: (f64, f64)) -> f64 {
    let bound = damped.as_ref();
    bound.map_or(f64::INFINITY, |bound| bound.amplitude(range))
}

#[cfg(test)]
mod tests {
    use super::super::periodic::Settled;
    use super::super::time_integration::TimeModel;
    use super::super::{Harmonics, Oscillator, Slider};
    use super::*;

    const RANGE: (f64, f64) = (200.0, 620.0);
    const LOADS: [f64; 2] = [8.0, 80.0];
    const PRELOAD: f64 = 30.0;
    const DAMPING: [f64; 3] = [2.0, 2.5, 6.0];
    const STIFFNESS: [f64; 3] = [1e5, 1.3e5, 4e4];

    fn bouncing() -> (Vibration, Oscillator) {
        let slider = Slider {
            normal_load: PRELOAD,
            gap: 0.0,
            tangential_stiffness: 1e5,
            normal_stiffness: 9e5,
        };
        let oscillator = Oscillator {
            mass: [1.0, 1.1, 0.7],
            damping: DAMPING,
            stiffness: STIFFNESS,
            element: ContactElement {
                springs: Vec::new(),
                area: 0.0,
                friction_coefficient: 0.4,
                law: Default::default(),
                sliders: vec![slider],
            },
        };
        let vibration = Vibration {
            model: oscillator.model().expect("an oscillator"),
            loads: vec![
                Oscillator::load(0, LOADS[0], 0.3),
                Oscillator::load(NORMAL, LOADS[1], 0.9),
            ],
            inertial_loads: Vec::new(),
            response_port: 0,
            harmonics: Harmonics::up_to(5),
            settings: Default::default(),
            range: RANGE,
            points: None,
            gauge: Default::default(),
            journal: Default::default(),
            surveyed: Default::default(),
        };
        (vibration, oscillator)
    }

    /// Motions in time of a mass that bounces and slides stay below all bounds; the load along the normal, ten times as large, supplies
    /// nothing of what moves in the plane.
    #[test]
    fn no_motion_in_time_exceeds_its_reach() {
        // Where the motion has not settled by more.
        const SETTLED: f64 = 1e-6;
        const EFFORT: usize = 100_000;
        let (vibration, oscillator) = bouncing();
        let balance = vibration
            .balance(vec![oscillator.element])
            .expect("a balance");
        let time = TimeModel::new(&vibration.model, balance.elements(), &vibration.loads);
        let time = time.expect("a model in time");
        let n = balance.harmonics().coefficients();
        let (mut seen, mut opens) = (0, 0);
        for k in 0..24 {
            let omega = RANGE.0 * (RANGE.1 / RANGE.0).powf(f64::from(k) / 23.0);
            let settled = time.settle(omega, &time.rest(), 1e-4, balance.harmonics(), EFFORT);
            let Ok(Settled::Periodic(motion)) = settled else {
                continue;
            };
            let size = vibration.size(&balance, &motion);
            let mean = motion.displacement[NORMAL * n];
            let load = PRELOAD - STIFFNESS[2] * mean;
            let known = vibration.reach_at(&balance, &vibration.damped_bound(), omega, load);
            let all = vibration.reach_within(&balance, (omega, omega));
            assert!(size <= known * (1.0 + SETTLED), "{omega}: {size} {known}");
            assert!(known <= all * (1.0 + SETTLED), "{omega}: {known} {all}");
            seen += 1;
            // A contact that stays closed keeps its mean load.
            opens += usize::from(mean.abs() > SETTLED * PRELOAD / STIFFNESS[2]);
        }
        assert!(
            seen >= 16 && opens >= 8,
            "{seen} motions, {opens} of them open"
        );
        let whole = vibration.reach_within(&balance, RANGE);
        assert!(whole <= LOADS[0] / (DAMPING[0] * RANGE.0) * (1.0 + SETTLED));
    }
}
