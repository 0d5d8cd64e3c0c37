//! Laws of contact elements from the motion of each element in the vibration.
//!
//! The laws of [`super::sliders`] come from a push that displaces all cells equally. In a vibration, neighbouring
//! elements can move by different amounts. If an element moves farther than its neighbours, the force of the element
//! differs from the force under the uniform push. After each computed response, the model update displaces the fine
//! contact with the motion of the elements in the response. The force of an element in this loading becomes the
//! backbone of the element, up to the end of the motion. Beyond the end of the motion, the element keeps the backbone
//! of the push. The new laws change the response, so the update repeats both computations until the response and the
//! fine contact agree.

use super::sliders::{Sliders, concave_slopes, levels, slider_bank};
use super::{ContactElements, ElementParameters, UpdateSettings};
use crate::grid::ByAxis;

/// Smallest last slope of a backbone, relative to its mean slope.
const LEAST_SLOPE: f64 = 1e-3;

/// Motion and force of each element from the middle of a motion to its end.
#[derive(Debug, Clone, PartialEq)]
pub struct Loading {
    /// Displacement of each element at the end, along x and y \[m\].
    pub amplitude: Vec<[f64; 2]>,
    /// Fractions of the motion, ascending; 1 is the end.
    pub parts: Vec<f64>,
    /// For each fraction, the force of each element along x and y \[N\].
    pub force: Vec<Vec<[f64; 2]>>,
}

impl Loading {
    /// Returns the fractions of the motion at which to evaluate elements with the given `laws`. The first fraction is
    /// where the elements stick, and the last lies beyond the end of the motion.
    pub fn parts(laws: &ElementParameters, reach: &[[f64; 2]], mu: f64) -> Vec<f64> {
        let strength: f64 = mu * laws.normal_load.iter().sum::<f64>();
        let stuck = laws.kt.iter().zip(reach).map(|(kt, u)| kt * length(u));
        let UpdateSettings {
            least_level,
            longest_step,
            loading_end,
            ..
        } = UpdateSettings::DEFAULT;
        let first = least_level * strength / stuck.sum::<f64>().max(f64::MIN_POSITIVE);
        let below = levels(first.min(longest_step), longest_step);
        let steps =
            (1..(1.0 / longest_step).round() as usize).map(|k| (k + 1) as f64 * longest_step);
        below
            .into_iter()
            .chain(steps)
            .chain([loading_end])
            .collect()
    }

    /// Creates the loading from the `shear` of the cells at each fraction of the motion \[Pa\].
    pub fn new(
        elements: &ContactElements,
        reach: Vec<[f64; 2]>,
        parts: Vec<f64>,
        shear: &[ByAxis<Vec<f64>>],
    ) -> Self {
        let element_forces = |shear: &ByAxis<Vec<f64>>| {
            let mut force = vec![[0.0; 2]; elements.len()];
            for (axis, shear) in shear.iter().enumerate() {
                let sums = elements.integrals(shear);
                force.iter_mut().zip(sums).for_each(|(f, q)| f[axis] = q);
            }
            force
        };
        Loading {
            amplitude: reach,
            parts,
            force: shear.iter().map(element_forces).collect(),
        }
    }

    /// Returns elements with new backbones. Up to the end of the loading, the new backbone is the force of this
    /// loading. Beyond the end, the new backbone continues the backbone in `laws`. Loads, gaps and normal stiffness
    /// stay the same.
    pub fn laws(&self, laws: &ElementParameters, mu: f64) -> ElementParameters {
        let Some(previous) = &laws.sliders else {
            return laws.clone();
        };
        let farthest = self.amplitude.iter().map(length).fold(0.0, f64::max);
        let mut sliders = Sliders::default();
        let mut kt = laws.kt.clone();
        for element in 0..laws.normal_load.len() {
            let own_sliders: Vec<usize> = (0..previous.element.len())
                .filter(|&s| previous.element[s] == element)
                .collect();
            let moves =
                length(&self.amplitude[element]) > UpdateSettings::DEFAULT.least_reach * farthest;
            let slips = laws.normal_load[element] > 0.0 && mu > 0.0 && kt[element] > 0.0;
            if !(moves && slips) {
                for s in own_sliders {
                    let slider = [
                        previous.normal_load[s],
                        previous.gap[s],
                        previous.kn[s],
                        previous.kt[s],
                    ];
                    sliders.push(element, slider);
                }
                continue;
            }
            let loaded = own_sliders
                .iter()
                .filter(|&&s| previous.normal_load[s] > 0.0);
            let corners: Vec<[f64; 2]> = loaded
                .map(|&s| [mu * previous.normal_load[s], previous.kt[s]])
                .collect();
            let strength = mu * laws.normal_load[element];
            let (levels, force, turn) = self.backbone(element, &corners, strength);
            let slopes = concave_slopes(&levels, &force, strength, Some(turn));
            kt[element] = slopes[0];
            for slider in slider_bank(&levels, &slopes, laws.kn[element], mu) {
                sliders.push(element, slider);
            }
        }
        ElementParameters {
            kt,
            sliders: Some(sliders),
            ..laws.clone()
        }
    }

    /// Returns the backbone of an element. The backbone lists the levels of the displacement of the element \[m\] and
    /// the force at each level \[N\]. The third value is the index of the level at which the motion turns. `sliders`
    /// contains the strength and the stiffness of each slider of the element.
    fn backbone(
        &self,
        element: usize,
        sliders: &[[f64; 2]],
        strength: f64,
    ) -> (Vec<f64>, Vec<f64>, usize) {
        let reach = &self.amplitude[element];
        let distance = length(reach);
        let mut levels: Vec<f64> = self.parts.iter().map(|part| part * distance).collect();
        let along = |force: &Vec<[f64; 2]>| {
            let [x, y] = force[element];
            (x * reach[0] + y * reach[1]) / distance
        };
        let mut force: Vec<f64> = self.force.iter().map(along).collect();
        let turn = self.parts.iter().position(|part| *part >= 1.0);
        let turn = turn.unwrap_or(levels.len() - 1);
        // Beyond the loading, follow the slopes of the push as long as they fall, until the strength is reached.
        let last = levels.len() - 1;
        let (mut u, mut carried_force) = (levels[last], force[last]);
        let previous_point = last
            .checked_sub(1)
            .map_or([0.0; 2], |j| [levels[j], force[j]]);
        let mut slope = ((carried_force - previous_point[1]) / (u - previous_point[0])).max(0.0);
        let mut corners: Vec<f64> = sliders
            .iter()
            .filter(|[_, k]| *k > 0.0)
            .map(|[limit, k]| limit / k)
            .filter(|corner| *corner > u)
            .collect();
        corners.sort_by(f64::total_cmp);
        for corner in corners {
            let sticking = sliders.iter().filter(|[limit, k]| k * u < *limit);
            slope = slope.min(sticking.map(|[_, k]| k).sum());
            carried_force += slope * (corner - u);
            u = corner;
            levels.push(u);
            force.push(carried_force);
        }
        if carried_force < strength {
            let least = LEAST_SLOPE * strength / u;
            levels.push(
                u + (strength - carried_force)
                    / (UpdateSettings::DEFAULT.last_slope * slope).max(least),
            );
            force.push(strength);
        }
        (levels, force, turn)
    }
}

fn length(u: &[f64; 2]) -> f64 {
    u[0].hypot(u[1])
}
