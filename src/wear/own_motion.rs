//! What the contact elements of a structure move against their mean, in place of one rigid motion of all cells.

use std::sync::Arc;

use crate::contact::nodes::Interpolation;
use crate::grid::ByAxis;

/// Displacement of the nodes of a mesh against the mean motion, sample by sample of a cycle. Cells between nodes move as the
/// bilinear interpolation says.
#[derive(Debug, Clone, PartialEq)]
pub struct OwnMotion {
    /// From nodes to cells.
    pub interpolation: Arc<Interpolation>,
    /// For each sample the displacement of each node along x, then along y where the motion has that axis \[m\].
    pub displacement: Vec<Vec<f64>>,
}

impl OwnMotion {
    /// Displacement of the cells between two samples' values, one field an axis \[m\].
    pub fn between(&self, from: &[f64], to: &[f64]) -> ByAxis<Vec<f64>> {
        let change: Vec<f64> = to.iter().zip(from).map(|(to, from)| to - from).collect();
        let cells = self.interpolation.grid().len();
        change
            .chunks_exact(self.interpolation.nodes())
            .map(|nodes| {
                let mut field = vec![0.0; cells];
                self.interpolation.add(1.0, nodes, &mut field);
                field
            })
            .collect()
    }

    /// Every `step`-th sample.
    pub(super) fn every(&self, step: usize) -> OwnMotion {
        self.with(self.displacement.iter().step_by(step).cloned().collect())
    }

    /// With a sample in the middle between any two, on the straight line between them.
    pub(super) fn halved(&self) -> OwnMotion {
        let after = self.displacement.iter().cycle().skip(1);
        let pairs = self.displacement.iter().zip(after);
        let halves = pairs.flat_map(|(a, b)| [a.clone(), combined(a, b, 0.5, 0.5)]);
        self.with(halves.collect())
    }

    /// Half of what lies between two samples, and its opposite.
    pub(super) fn ends(&self, top: usize, bottom: usize) -> OwnMotion {
        let [top, bottom] = [top, bottom].map(|k| &self.displacement[k]);
        self.with(vec![
            combined(top, bottom, 0.5, -0.5),
            combined(top, bottom, -0.5, 0.5),
        ])
    }

    /// With the middle of the range of every node at zero.
    pub(super) fn about_its_middle(&self) -> OwnMotion {
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
        self.with(samples.map(|of| combined(of, &middle, 1.0, -1.0)).collect())
    }

    /// True if it is between two ends alone, opposite to each other.
    pub(super) fn is_straight(&self) -> bool {
        let [top, bottom] = &self.displacement[..] else {
            return false;
        };
        top.iter().zip(bottom).all(|(a, b)| *a == -b)
    }

    fn with(&self, displacement: Vec<Vec<f64>>) -> OwnMotion {
        OwnMotion {
            interpolation: self.interpolation.clone(),
            displacement,
        }
    }
}

/// a·x + b·y.
fn combined(x: &[f64], y: &[f64], a: f64, b: f64) -> Vec<f64> {
    x.iter().zip(y).map(|(x, y)| a * x + b * y).collect()
}
