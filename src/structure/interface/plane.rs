//! Plane of the joint, its normal direction, and the axes of the joint in the plane.

use super::lattice::Lattice;
use super::{InterfaceError, JointRequirements, LINE, MM, OFF, SIDES, Side};
use crate::linalg::Matrix;
use crate::linalg::vectors::{cross, dot, mean, minus, unit};

/// Largest distance of the faces along the normal, over the largest distance of a node from the middle of the joint.
/// Faces may be the mid-planes of plates.
const DISTANT: f64 = 0.5;

/// Plane of a joint.
pub(super) struct Plane {
    pub middle: [f64; 3],
    pub normal: [f64; 3],
    /// Distance between the middles of the upper and the lower nodes along the normal \[m\].
    pub distance: f64,
}

impl Plane {
    pub fn fit(sides: [&Side; 2], wanted: &JointRequirements) -> Result<Plane, InterfaceError> {
        let middles = sides.map(|side| mean(&side.positions));
        for (k, side) in sides.into_iter().enumerate() {
            let is_plane =
                side.nodes.len() >= 4 && principal(&side.positions, middles[k]).is_some();
            if !is_plane {
                return Err(InterfaceError::TooFew {
                    side: SIDES[k],
                    count: side.nodes.len(),
                });
            }
        }
        let [lower, upper] = sides;
        let middle = middles[1];
        let vectors = principal(&upper.positions, middle).expect("it is a plane");
        let mut normal = [0, 1, 2].map(|d| vectors[(d, 0)]);
        let across = (upper.positions.iter())
            .map(|p| minus(*p, middle))
            .map(|d| dot(d, d).sqrt())
            .fold(0.0, f64::max);
        // The upper side comes first, because it defines the plane.
        for (k, side) in sides.into_iter().enumerate().rev() {
            let offset = |p: &[f64; 3]| dot(minus(*p, middles[k]), normal).abs();
            let each = side.positions.iter().map(offset).zip(&side.nodes);
            let farthest = each.max_by(|a, b| a.0.total_cmp(&b.0)).expect("four nodes");
            if farthest.0 > OFF * across {
                return Err(InterfaceError::NotPlane {
                    node: *farthest.1,
                    off: farthest.0 / MM,
                    across: across / MM,
                });
            }
        }
        let between_middles = minus(middles[1], middles[0]);
        let distance = dot(between_middles, normal);
        if distance.abs() > DISTANT * across {
            return Err(InterfaceError::Distant {
                distance: distance.abs() / MM,
                across: across / MM,
            });
        }
        // The upper and the lower face may differ in size, but some lower node must be under the upper face.
        let distance_in_plane = |p: &[f64; 3]| {
            let d = minus(*p, middle);
            let out = dot(d, normal);
            let d = minus(d, normal.map(|v| v * out));
            dot(d, d).sqrt()
        };
        let offset = lower
            .positions
            .iter()
            .map(distance_in_plane)
            .fold(f64::INFINITY, f64::min);
        if offset > across {
            return Err(InterfaceError::NotFacing {
                off: offset / MM,
                across: across / MM,
            });
        }
        // A negative value means that the normal points from the upper body into the lower one.
        let by_positions = if distance.abs() > OFF * across {
            Some(distance)
        } else {
            let depth = |side: &Side| -> f64 {
                let each = side.neighbours.iter();
                each.map(|p| dot(minus(*p, middle), normal)).sum::<f64>()
                    / side.neighbours.len().max(1) as f64
            };
            let (above, below) = (depth(upper), depth(lower));
            let is_known = above.abs().max(below.abs()) >= OFF * across && above * below <= 0.0;
            is_known.then_some(above - below)
        };
        let direction = match wanted.normal.map(unit) {
            Some(given_normal) => {
                let cosine = dot(given_normal, normal);
                if cosine.abs() < 1.0 - OFF {
                    return Err(InterfaceError::NormalMismatch {
                        angle: cosine.abs().min(1.0).acos().to_degrees(),
                        found: normal,
                    });
                }
                if by_positions.is_some_and(|known_sign| known_sign * cosine < 0.0) {
                    return Err(InterfaceError::AgainstPositions);
                }
                cosine
            }
            None => by_positions.ok_or(InterfaceError::NoNormal)?,
        };
        if direction < 0.0 {
            normal = normal.map(|v| -v);
        }
        // A normal along an axis of the model is made exact, because the eigenvectors have rounding errors.
        let rounded = normal.map(|v: f64| if v.abs() > 1.0 - 1e-12 { v.signum() } else { v });
        if let Some(axis) = (0..3).find(|&d| rounded[d].abs() == 1.0) {
            normal = [0, 1, 2].map(|d| if d == axis { rounded[axis] } else { 0.0 });
        }
        Ok(Plane {
            middle,
            normal,
            distance: distance.abs(),
        })
    }

    /// Returns the unit vectors of x, y and z.
    ///
    /// The x axis of the joint is along the direction that the scene gives. If the scene gives no direction, the x axis
    /// of the joint is along an array of the nodes. If the nodes form no array, the x axis of the joint is the
    /// projection of the x axis of the model. If the x axis of the model is nearly normal to the joint, the y axis of
    /// the model is used.
    pub fn axes_along(
        &self,
        positions: &[[f64; 3]],
        wanted: &JointRequirements,
    ) -> Result<[[f64; 3]; 3], InterfaceError> {
        let in_plane = |a: [f64; 3]| {
            let out = dot(a, self.normal);
            minus(a, self.normal.map(|v| v * out))
        };
        let axes = |x: [f64; 3]| [x, cross(self.normal, x), self.normal];
        if let Some(along) = wanted.along.map(unit) {
            let x = in_plane(along);
            if dot(x, x) < 0.25 {
                return Err(InterfaceError::AlongNormal);
            }
            return Ok(axes(unit(x)));
        }
        let first = usize::from(self.normal[0].abs() > 0.9);
        let mut model = [0.0; 3];
        model[first] = 1.0;
        let usual = unit(in_plane(model));
        let is_array = |x: [f64; 3]| {
            let [x, y, _] = axes(x);
            let flat: Vec<[f64; 2]> = (positions.iter())
                .map(|p| minus(*p, self.middle))
                .map(|d| [dot(d, x), dot(d, y)])
                .collect();
            Lattice::detect(&flat).is_some()
        };
        if is_array(usual) {
            return Ok(axes(usual));
        }
        // Try the direction to the nearest node, turned by quarters until it is closest to the usual axis.
        let from = positions[0];
        let nearest = (positions[1..].iter().map(|p| minus(*p, from)))
            .min_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))
            .expect("four nodes");
        let towards_nearest = unit(in_plane(nearest));
        let quarter = cross(self.normal, towards_nearest);
        let turned = [
            towards_nearest,
            quarter,
            towards_nearest.map(|v| -v),
            quarter.map(|v| -v),
        ];
        let best = turned
            .into_iter()
            .max_by(|a, b| dot(*a, usual).total_cmp(&dot(*b, usual)));
        let best = best.expect("four directions");
        Ok(axes(if is_array(best) { best } else { usual }))
    }
}

/// Returns the principal directions of points, the one of least extent first. `None` for points on a line.
fn principal(points: &[[f64; 3]], middle: [f64; 3]) -> Option<Matrix> {
    let offsets: Vec<[f64; 3]> = points.iter().map(|p| minus(*p, middle)).collect();
    let moments = Matrix::from_fn(3, 3, |a, b| offsets.iter().map(|d| d[a] * d[b]).sum());
    let (values, vectors) = moments.symmetric_eigen().ok()?;
    (values[1] > LINE * LINE * values[2]).then_some(vectors)
}
