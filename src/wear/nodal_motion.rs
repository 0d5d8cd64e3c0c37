//! What the contact elements of a structure move against their mean, in place of one rigid motion of all cells.

use std::sync::Arc;

use crate::contact::nodes::Interpolation;
use crate::grid::ByAxis;

/// Displacement of the nodes of a mesh against the mean motion, sample by sample of a cycle. Cells between nodes move as the
/// bilinear interpolation says.
#[derive(Debug, Clone, PartialEq)]
pub struct NodalMotion {
    /// From nodes to cells.
    pub interpolation: Arc<Interpolation>,
    /// For each sample the displacement of each node along x, then along y where the motion has that axis \[m\].
    pub displacement: Vec<Vec<f64>>,
    /// For each sample by how much the bodies come closer at each node than at rest \[m\]; none: the load of every place stays that of the
    /// static contact, or goes with the load of the joint.
    pub approach: Vec<Vec<f64>>,
    /// Part of the work of friction between the two ends of the motion, under the load of the static contact, that each node really has; none:
    /// all of it. What is between the ends, and the variation of the load, is in it.
    pub work: Vec<f64>,
    /// Part of the work of friction between the two ends of the motion, under the load of the static contact, that all nodes together really have.
    pub work_part: f64,
    /// Part of the force along the motion between its two ends, under the load of the static contact, that the nodes really have.
    pub force_part: f64,
    /// What each node is displaced by at the end of the line that the motion all but follows, along x, then along y where the motion has that
    /// axis, the mean motion included, over the root mean square over the area of the joint: the force along it has the work of all nodes.
    pub direction: Vec<f64>,
}

impl NodalMotion {
    /// Displacement of the cells between two samples' values, one field an axis \[m\].
    pub fn between(&self, from: &[f64], to: &[f64]) -> ByAxis<Vec<f64>> {
        let change: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        change
            .chunks_exact(self.interpolation.nodes())
            .map(|nodes| self.of_cells(nodes))
            .collect()
    }

    /// Every `step`-th sample.
    pub(super) fn every(&self, step: usize) -> NodalMotion {
        let thin = |series: &[Vec<f64>]| series.iter().step_by(step).cloned().collect();
        self.with(thin(&self.displacement), thin(&self.approach))
    }

    /// With a sample in the middle between any two, on the straight line between them.
    pub(super) fn halved(&self) -> NodalMotion {
        let halve = |series: &[Vec<f64>]| {
            let pairs = series.iter().zip(series.iter().cycle().skip(1));
            let halves = pairs.flat_map(|(a, b)| [a.clone(), combined(a, b, 0.5, 0.5)]);
            halves.collect()
        };
        self.with(halve(&self.displacement), halve(&self.approach))
    }

    /// Half of what lies between two samples, and its opposite, under the load of the static contact.
    pub(super) fn ends(&self, top: usize, bottom: usize) -> NodalMotion {
        let [d, e] = [top, bottom].map(|k| &self.displacement[k]);
        let opposite = vec![combined(d, e, 0.5, -0.5), combined(d, e, -0.5, 0.5)];
        self.with(opposite, Vec::new())
    }

    /// With the middle of the range of every node at zero.
    pub(super) fn about_its_middle(&self) -> NodalMotion {
        let nodes = self.displacement.first().map_or(0, Vec::len);
        let middle: Vec<f64> = (0..nodes)
            .map(|n| {
                let values = self.displacement.iter().map(|of_sample| of_sample[n]);
                let (least, most) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), v| {
                    (l.min(v), m.max(v))
                });
                0.5 * (least + most)
            })
            .collect();
        let samples = self.displacement.iter();
        let displacement = samples.map(|of| combined(of, &middle, 1.0, -1.0)).collect();
        self.with(displacement, self.approach.clone())
    }

    /// By how much the cells come closer at a sample than at rest \[m\].
    pub(super) fn approach_of_cells(&self, sample: usize) -> Vec<f64> {
        self.of_cells(&self.approach[sample])
    }

    /// [`NodalMotion::work`] of the cells; none where it is all of it.
    pub(super) fn work_of_cells(&self) -> Option<Vec<f64>> {
        (!self.work.is_empty()).then(|| self.of_cells(&self.work))
    }

    fn of_cells(&self, nodes: &[f64]) -> Vec<f64> {
        let mut field = vec![0.0; self.interpolation.grid().len()];
        self.interpolation.add(1.0, nodes, &mut field);
        field
    }

    /// Force of all cells along the [`direction`](OwnMotion::direction) under this `shear` \[Pa\], of cells of this area \[m²\], in newtons.
    pub(super) fn force_along(&self, shear: &ByAxis<Vec<f64>>, cell_area: f64) -> f64 {
        let axes = self.direction.chunks_exact(self.interpolation.nodes());
        let along = axes.zip(shear).map(|(nodes, shear)| {
            let sums = self.interpolation.sums(shear);
            nodes.iter().zip(sums).map(|(d, q)| d * q).sum::<f64>()
        });
        along.sum::<f64>() * cell_area
    }

    /// Lets the work and the force between the ends, under the load of the static contact, stand for themselves.
    pub fn under_loads_at_rest(&mut self) {
        self.work.clear();
        self.work_part = 1.0;
        self.force_part = 1.0;
    }

    /// True if every place keeps the load of the static contact.
    pub(super) fn has_constant_load(&self) -> bool {
        self.approach.is_empty()
    }

    /// True if it is between two ends alone, opposite to each other.
    pub(super) fn is_straight(&self) -> bool {
        let [top, bottom] = &self.displacement[..] else {
            return false;
        };
        top.iter().zip(bottom).all(|(a, b)| *a == -b)
    }

    fn with(&self, displacement: Vec<Vec<f64>>, approach: Vec<Vec<f64>>) -> NodalMotion {
        NodalMotion {
            interpolation: self.interpolation.clone(),
            displacement,
            approach,
            work: self.work.clone(),
            work_part: self.work_part,
            force_part: self.force_part,
            direction: self.direction.clone(),
        }
    }
}

/// a·x + b·y.
fn combined(x: &[f64], y: &[f64], a: f64, b: f64) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| a * x + b * y).collect()
}
