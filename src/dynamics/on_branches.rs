//! What the branches and motions of a survey have: the frequencies they leave out, the amplitudes at one, the largest.

use std::f64::consts::TAU;

use super::candidates::gives_energy;
use super::contact_element::ContactElement;
use super::survey::{SAME, Survey, USUAL, first_harmonic};
use super::truncation::OF_TIME;
use super::{HarmonicBalance, Response};

impl Survey {
    /// The parts of a range \[rad/s\] that no branch covers \[Hz\].
    pub(super) fn left_out(&self, (from, to): (f64, f64)) -> Vec<[f64; 2]> {
        let mut covered: Vec<[f64; 2]> = self
            .branches
            .iter()
            .map(|branch| {
                let omegas = branch.iter().map(|r| r.omega);
                let ends = (f64::INFINITY, f64::NEG_INFINITY);
                let (low, high) = omegas.fold(ends, |(a, b), w| (a.min(w), b.max(w)));
                [low, high]
            })
            .collect();
        covered.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let (mut gaps, mut reached) = (Vec::new(), from);
        for [low, high] in covered {
            if low > reached * (1.0 + SAME) {
                gaps.push([reached / TAU, low / TAU]);
            }
            reached = reached.max(high);
        }
        if reached < to * (1.0 - SAME) {
            gaps.push([reached / TAU, to / TAU]);
        }
        gaps
    }

    /// How far apart the first harmonics at a port are at both ends of a gap \[Hz\], and the larger of them \[m\]; none where no branch
    /// ends there.
    pub(super) fn flanks(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        port: usize,
        gap: [f64; 2],
    ) -> Option<[f64; 2]> {
        let harmonics = balance.harmonics();
        let slot = harmonics.slot_of(1)?;
        let [low, high] = gap.map(|frequency| {
            let at = |response: &&Response| (response.frequency() / frequency - 1.0).abs() <= SAME;
            let found = self.branches.iter().flatten().find(at)?;
            let row = &found.displacement[port * harmonics.coefficients()..];
            Some([row[slot], row[slot + 1]])
        });
        let ([a, b], [c, d]) = (low?, high?);
        Some([(a - c).hypot(b - d), a.hypot(b).max(c.hypot(d))])
    }

    /// Whether the branches do not move at a port, but for rounding.
    pub(super) fn is_still(&self, balance: &HarmonicBalance<ContactElement>, port: usize) -> bool {
        let all = || self.branches.iter().flatten();
        all().next().is_some() && all().all(|response| balance.is_still(response, port))
    }

    /// The largest amplitude at a port, of responses that may be motions \[m\]; 0 without any.
    pub(super) fn highest(&self, balance: &HarmonicBalance<ContactElement>, port: usize) -> f64 {
        let all = self.branches.iter().flatten();
        all.filter(|response| !gives_energy(response))
            .map(|r| first_harmonic(balance, &r.displacement, port))
            .fold(0.0, f64::max)
    }

    /// [`Self::highest`], or a usual size where that is 0.
    pub(super) fn largest(&self, balance: &HarmonicBalance<ContactElement>, port: usize) -> f64 {
        let highest = self.highest(balance, port);
        if highest > 0.0 { highest } else { USUAL }
    }

    /// The largest amplitude of a motion in time that no branch has, or that is the highest on its path \[m\]; 0 without one.
    pub(super) fn largest_in_time(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        port: usize,
    ) -> f64 {
        let all = self.motions.iter();
        all.map(|periodic| first_harmonic(balance, &periodic.displacement, port))
            .chain(self.tops.iter().map(|[_, amplitude]| *amplitude))
            .fold(0.0, f64::max)
    }

    /// Whether a motion in time is the highest on its path, which is known whole. Paths end at the same frequencies: those of the range.
    pub(super) fn is_top(&self, omega: f64, amplitude: f64) -> bool {
        let mut tops = self.tops.iter();
        tops.any(|top| top[0] == omega && (amplitude / top[1] - 1.0).abs() <= OF_TIME)
    }

    /// The amplitudes at a port that the branches have at `omega`, between their points \[m\].
    pub(super) fn amplitudes(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        port: usize,
        omega: f64,
    ) -> Vec<f64> {
        let of = |r: &Response| first_harmonic(balance, &r.displacement, port);
        let at = |pair: &[Response]| match solved_between(balance, pair, omega) {
            Some(response) => of(&response),
            None => {
                let share = (omega - pair[0].omega) / (pair[1].omega - pair[0].omega);
                of(&pair[0]) * (1.0 - share) + share * of(&pair[1])
            }
        };
        self.around(omega).map(at).collect()
    }

    /// The response at `omega` that the branches have with the largest amplitude at a port, if they have any that may be a motion.
    pub(super) fn highest_at(
        &self,
        balance: &HarmonicBalance<ContactElement>,
        port: usize,
        omega: f64,
    ) -> Option<Response> {
        let of = |r: &Response| first_harmonic(balance, &r.displacement, port);
        let all = self.around(omega);
        let all = all.filter_map(|pair| solved_between(balance, pair, omega));
        all.filter(|response| !gives_energy(response))
            .max_by(|a, b| of(a).total_cmp(&of(b)))
    }

    /// Pairs of neighbours on a branch between which a frequency lies.
    fn around(&self, omega: f64) -> impl Iterator<Item = &[Response]> {
        let pairs = self.branches.iter().flat_map(|branch| branch.windows(2));
        pairs.filter(move |pair| {
            let (a, b) = (pair[0].omega, pair[1].omega);
            (a - omega) * (b - omega) <= 0.0 && a != b
        })
    }
}

/// The response at a frequency between two of a branch, from the nearer one: the branch is curved between them.
fn solved_between(
    balance: &HarmonicBalance<ContactElement>,
    pair: &[Response],
    omega: f64,
) -> Option<Response> {
    let near = pair
        .iter()
        .min_by(|a, b| (a.omega - omega).abs().total_cmp(&(b.omega - omega).abs()));
    balance.solve(omega, Some(&near?.start())).ok()
}
