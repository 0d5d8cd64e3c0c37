//! Individual motion of a structure's contact elements relative to their mean, in place of one rigid motion
//! of all cells.

use std::sync::Arc;

use crate::contact::nodes::Interpolation;
use crate::grid::ByAxis;

/// Displacement of the nodes of a mesh relative to the mean motion, for every sample of a cycle. Cells
/// between nodes follow the bilinear interpolation.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalMotion {
    /// Interpolation from nodes to cells.
    pub interpolation: Arc<Interpolation>,
    /// Displacement of each node per sample, along x, then along y if the motion has that axis \[m\].
    pub displacement: Vec<Vec<f64>>,
    /// Approach of the bodies at each node relative to rest, per sample \[m\]. Empty: every place keeps the
    /// load of the static contact, or its load follows the load of the joint.
    pub approach: Vec<Vec<f64>>,
    /// Ratio of two works of friction at each node. The first work is the work in the cycle. The second work is the
    /// work of a motion between the two ends under the load of the static contact. The ratio accounts for the path
    /// between the ends and for the variation of the load. If `work_ratio` is empty, the ratio is 1.
    pub work_ratio: Vec<f64>,
    /// Ratio as in `work_ratio`, for the work of friction of all nodes together.
    pub total_work_ratio: f64,
    /// Ratio of two forces along the motion. The first force is the force in the cycle. The second force is the force
    /// of a motion between the two ends under the load of the static contact.
    pub force_ratio: f64,
    /// Displacement of each node at one end of the line that approximates the motion. The list contains the
    /// displacements along x, and then the displacements along y if the motion has the axis y. The displacement
    /// includes the mean motion. The displacement is divided by its root mean square over the area of the joint. The
    /// force along `direction` does the same work as the forces of all nodes.
    pub direction: Vec<f64>,
}

impl NodalMotion {
    /// Returns the displacement of the cells between the values of two samples, one field per axis \[m\].
    pub fn between(&self, from: &[f64], to: &[f64]) -> ByAxis<Vec<f64>> {
        let change: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        change
            .chunks_exact(self.interpolation.nodes())
            .map(|nodes| self.interpolate(nodes))
            .collect()
    }

    /// Returns every `step`-th sample.
    pub(super) fn every(&self, step: usize) -> NodalMotion {
        let thin = |series: &[Vec<f64>]| series.iter().step_by(step).cloned().collect();
        self.with_series(thin(&self.displacement), thin(&self.approach))
    }

    /// Returns the motion with additional samples: a linearly interpolated sample midway between any two neighbouring
    /// samples.
    pub(super) fn halved(&self) -> NodalMotion {
        let halve = |series: &[Vec<f64>]| {
            let pairs = series.iter().zip(series.iter().cycle().skip(1));
            let halves = pairs.flat_map(|(a, b)| [a.clone(), combined(a, b, 0.5, 0.5)]);
            halves.collect()
        };
        self.with_series(halve(&self.displacement), halve(&self.approach))
    }

    /// Returns half the difference between two samples and its negative, under the load of the static
    /// contact.
    pub(super) fn ends(&self, top: usize, bottom: usize) -> NodalMotion {
        let [d, e] = [top, bottom].map(|k| &self.displacement[k]);
        let opposite = vec![combined(d, e, 0.5, -0.5), combined(d, e, -0.5, 0.5)];
        self.with_series(opposite, Vec::new())
    }

    /// Shifts the middle of every node's range to zero.
    pub(super) fn about_its_middle(&self) -> NodalMotion {
        let nodes = self.displacement.first().map_or(0, Vec::len);
        let middle: Vec<f64> = (0..nodes)
            .map(|n| {
                let values = self.displacement.iter().map(|sample| sample[n]);
                let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| {
                    (l.min(v), m.max(v))
                });
                0.5 * (least + most)
            })
            .collect();
        let samples = self.displacement.iter();
        let displacement = samples
            .map(|sample| combined(sample, &middle, 1.0, -1.0))
            .collect();
        self.with_series(displacement, self.approach.clone())
    }

    /// Returns by how much the cells are closer at a sample than at rest \[m\].
    pub(super) fn approach_of_cells(&self, sample: usize) -> Vec<f64> {
        self.interpolate(&self.approach[sample])
    }

    /// Interpolates [`NodalMotion::work_ratio`] to the cells. Returns `None` if the ratio is 1.
    pub(super) fn work_of_cells(&self) -> Option<Vec<f64>> {
        (!self.work_ratio.is_empty()).then(|| self.interpolate(&self.work_ratio))
    }

    fn interpolate(&self, nodes: &[f64]) -> Vec<f64> {
        let mut field = vec![0.0; self.interpolation.grid().len()];
        self.interpolation.add_interpolated(1.0, nodes, &mut field);
        field
    }

    /// Returns the force of all cells along the [`direction`](NodalMotion::direction) under `shear` \[Pa\],
    /// for cells of area `cell_area` \[m²\], in newtons.
    pub(super) fn force_along(&self, shear: &ByAxis<Vec<f64>>, cell_area: f64) -> f64 {
        let axes = self.direction.chunks_exact(self.interpolation.nodes());
        let along = axes.zip(shear).map(|(nodes, shear)| {
            let sums = self.interpolation.apply_transpose(shear);
            nodes.iter().zip(sums).map(|(d, q)| d * q).sum::<f64>()
        });
        along.sum::<f64>() * cell_area
    }

    /// Resets all ratios of work and force to 1, for a motion under the load of the static contact.
    pub fn reset_ratios(&mut self) {
        self.work_ratio.clear();
        self.total_work_ratio = 1.0;
        self.force_ratio = 1.0;
    }

    /// Returns true if every place keeps the load of the static contact.
    pub(super) fn has_constant_load(&self) -> bool {
        self.approach.is_empty()
    }

    /// Returns true if the motion has only two samples, opposite to each other.
    pub(super) fn is_straight(&self) -> bool {
        let [top, bottom] = &self.displacement[..] else {
            return false;
        };
        top.iter().zip(bottom).all(|(a, b)| *a == -b)
    }

    fn with_series(&self, displacement: Vec<Vec<f64>>, approach: Vec<Vec<f64>>) -> NodalMotion {
        NodalMotion {
            interpolation: self.interpolation.clone(),
            displacement,
            approach,
            work_ratio: self.work_ratio.clone(),
            total_work_ratio: self.total_work_ratio,
            force_ratio: self.force_ratio,
            direction: self.direction.clone(),
        }
    }
}

/// Returns a·x + b·y.
fn combined(x: &[f64], y: &[f64], a: f64, b: f64) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| a * x + b * y).collect()
}
