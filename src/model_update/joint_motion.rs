//! The law of contact elements from the motion that they make.
//!
//! A push that displaces all cells alike ([`super::sliders`]) tells an element what it carries if its neighbours go with it. In a vibration
//! they may go farther or less far, and drag it along or hold it back. So, once a response is found, the fine contact is moved as that
//! response moves it: what an element carries on the way to the end of the motion is its backbone up to there, and that of the push stays
//! beyond. With the new laws the response is another one, and so on until both scales say the same of it.

use super::sliders::{LEAST_LEVEL, Sliders, bank_of, concave_slopes, levels};
use super::{ContactElements, ElementParameters};
use crate::grid::ByAxis;

/// Longest step on the way, in parts of it: chords of a tenth leave a hundredth of the energy of a joint that slips little, most of which
/// lifted corners make good.
const LONGEST: f64 = 0.125;
/// Part of the way where the loading ends: laws are asked beyond the end of the motion while a response is looked for.
const BEYOND: f64 = 1.25;
/// Elements that go less far than this part of the way of the farthest keep the law of the push: what they bear is their neighbours' doing
/// and no function of what they do themselves.
const LEAST_REACH: f64 = 0.02;
/// Slope beyond all corners of a backbone that has not come to its strength there, over the slope before; and the least of such slopes, over
/// the mean one.
const LAST_SLOPE: f64 = 0.5;
const LEAST_SLOPE: f64 = 1e-3;

/// What each element does and carries on the way from the middle of a motion to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Loading {
    /// Displacement of each element at the end, along x and y \[m\].
    pub reach: Vec<[f64; 2]>,
    /// Parts of the way, ascending; 1 is the end.
    pub parts: Vec<f64>,
    /// For each part the force of each element along x and y \[N\].
    pub force: Vec<Vec<[f64; 2]>>,
}

impl Loading {
    /// Parts of the way at which elements of these laws are to be looked at: from where they stick to a little beyond the end.
    pub fn parts(laws: &ElementParameters, reach: &[[f64; 2]], mu: f64) -> Vec<f64> {
        let strength: f64 = mu * laws.normal_load.iter().sum::<f64>();
        let stuck = laws.kt.iter().zip(reach).map(|(kt, u)| kt * length(u));
        let first = LEAST_LEVEL * strength / stuck.sum::<f64>().max(f64::MIN_POSITIVE);
        let below = levels(first.min(LONGEST), LONGEST);
        let steps = (1..(1.0 / LONGEST).round() as usize).map(|k| (k + 1) as f64 * LONGEST);
        below.into_iter().chain(steps).chain([BEYOND]).collect()
    }

    /// That of cells with this `shear` at each part \[Pa\].
    pub fn new(
        elements: &ContactElements,
        reach: Vec<[f64; 2]>,
        parts: Vec<f64>,
        shear: &[ByAxis<Vec<f64>>],
    ) -> Self {
        let of = |shear: &ByAxis<Vec<f64>>| {
            let mut force = vec![[0.0; 2]; elements.len()];
            for (axis, shear) in shear.iter().enumerate() {
                let sums = elements.integrals(shear);
                force.iter_mut().zip(sums).for_each(|(f, q)| f[axis] = q);
            }
            force
        };
        Loading {
            reach,
            parts,
            force: shear.iter().map(of).collect(),
        }
    }

    /// Elements whose backbone is that of this loading, as far as it goes, and that of their `laws` beyond. Loads, gaps and normal
    /// stiffness remain.
    pub fn laws(&self, laws: &ElementParameters, mu: f64) -> ElementParameters {
        let Some(before) = &laws.sliders else {
            return laws.clone();
        };
        let farthest = self.reach.iter().map(length).fold(0.0, f64::max);
        let mut sliders = Sliders::default();
        let mut kt = laws.kt.clone();
        for element in 0..laws.normal_load.len() {
            let own: Vec<usize> = (0..before.element.len())
                .filter(|&s| before.element[s] == element)
                .collect();
            let moves = length(&self.reach[element]) > LEAST_REACH * farthest;
            let slips = laws.normal_load[element] > 0.0 && mu > 0.0 && kt[element] > 0.0;
            if !(moves && slips) {
                for s in own {
                    let slider = [
                        before.normal_load[s],
                        before.gap[s],
                        before.kn[s],
                        before.kt[s],
                    ];
                    sliders.push(element, slider);
                }
                continue;
            }
            let loaded = own.iter().filter(|&&s| before.normal_load[s] > 0.0);
            let corners: Vec<[f64; 2]> = loaded
                .map(|&s| [mu * before.normal_load[s], before.kt[s]])
                .collect();
            let strength = mu * laws.normal_load[element];
            let (levels, force, turn) = self.backbone(element, &corners, strength);
            let slopes = concave_slopes(&levels, &force, strength, Some(turn));
            kt[element] = slopes[0];
            for slider in bank_of(&levels, &slopes, laws.kn[element], mu) {
                sliders.push(element, slider);
            }
        }
        ElementParameters {
            kt,
            sliders: Some(sliders),
            ..laws.clone()
        }
    }

    /// Levels of the displacement of an element along its way \[m\], what it carries there \[N\], and the number of the level where the
    /// motion turns. `sliders` are strength and stiffness of those of its law.
    fn backbone(
        &self,
        element: usize,
        sliders: &[[f64; 2]],
        strength: f64,
    ) -> (Vec<f64>, Vec<f64>, usize) {
        let reach = &self.reach[element];
        let way = length(reach);
        let mut levels: Vec<f64> = self.parts.iter().map(|part| part * way).collect();
        let along = |force: &Vec<[f64; 2]>| {
            let [x, y] = force[element];
            (x * reach[0] + y * reach[1]) / way
        };
        let mut force: Vec<f64> = self.force.iter().map(along).collect();
        let turn = self.parts.iter().position(|part| *part >= 1.0);
        let turn = turn.unwrap_or(levels.len() - 1);
        // Beyond, the slopes of the push, as far as they fall, until the strength is reached.
        let last = levels.len() - 1;
        let (mut u, mut carried) = (levels[last], force[last]);
        let before = last
            .checked_sub(1)
            .map_or([0.0; 2], |j| [levels[j], force[j]]);
        let mut slope = ((carried - before[1]) / (u - before[0])).max(0.0);
        let mut corners: Vec<f64> = sliders
            .iter()
            .filter(|[_, k]| *k > 0.0)
            .map(|[limit, k]| limit / k)
            .filter(|corner| *corner > u)
            .collect();
        corners.sort_by(f64::total_cmp);
        for corner in corners {
            let gripping = sliders.iter().filter(|[limit, k]| k * u < *limit);
            slope = slope.min(gripping.map(|[_, k]| k).sum());
            carried += slope * (corner - u);
            u = corner;
            levels.push(u);
            force.push(carried);
        }
        if carried < strength {
            let least = LEAST_SLOPE * strength / u;
            levels.push(u + (strength - carried) / (LAST_SLOPE * slope).max(least));
            force.push(strength);
        }
        (levels, force, turn)
    }
}

fn length(u: &[f64; 2]) -> f64 {
    u[0].hypot(u[1])
}
