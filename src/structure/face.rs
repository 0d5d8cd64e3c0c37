//! Points on the faces of solids.

use super::solids::Solid;
use crate::linalg::vectors::{dot, minus};

/// Face of a solid in space. `Face` finds the point of the face that is nearest to a position.
///
/// The face is x(s, t) = Σ Nₙ(c + s·e + t·f) xₙ with the shape functions Nₙ of the solid. The natural coordinates c are
/// a corner of the face, and the vectors e and f are two sides of the face. The coordinates s and t are at least 0. On a
/// quadrilateral face, s ≤ 1 and t ≤ 1. On a triangular face, s + t ≤ 1.
pub struct Face {
    solid: Solid,
    nodes: Vec<[f64; 3]>,
    corner: [f64; 3],
    sides: [[f64; 3]; 2],
    is_triangle: bool,
    low: [f64; 3],
    high: [f64; 3],
    longest: f64,
}

/// Point of a face that is nearest to a given position.
pub struct NearestPoint {
    /// Position of the point, in the unit of the nodes.
    pub position: [f64; 3],
    /// Distance from the given position. Infinite if the search for the point did not converge.
    pub distance: f64,
    /// Weight of each node of the solid. The weights sum to one.
    pub weights: Vec<f64>,
}

/// Largest number of Gauss–Newton steps. A flat parallelogram takes one, a curved face a few.
const STEPS: usize = 40;
/// The search for the nearest point of a face stops at a step below `NO_STEP`, in units of s and t. Rounding causes a
/// step of this size.
const NO_STEP: f64 = 1e-13;
/// The search for the nearest point of a face has converged if its last step is shorter than `AT_REST`. The unit of
/// `AT_REST` is the side of the face. `AT_REST` allows for the rounding of coordinates far from the origin.
const AT_REST: f64 = 1e-8;
/// A point is on a face if the distance of the point from the face is at most `ON_FACE`, in units of s and t.
const ON_FACE: f64 = 1e-9;
/// Edges in terms of (s, t), each as a start point and a direction.
const EDGES_OF_SQUARE: [[[f64; 2]; 2]; 4] = [
    [[0.0, 0.0], [1.0, 0.0]],
    [[0.0, 0.0], [0.0, 1.0]],
    [[1.0, 0.0], [0.0, 1.0]],
    [[0.0, 1.0], [1.0, 0.0]],
];
const EDGES_OF_TRIANGLE: [[[f64; 2]; 2]; 3] = [
    [[0.0, 0.0], [1.0, 0.0]],
    [[0.0, 0.0], [0.0, 1.0]],
    [[1.0, 0.0], [-1.0, 1.0]],
];

/// End point of a search for the nearest point, and whether the search converged.
struct Foot {
    place: [f64; 2],
    is_found: bool,
}

impl Face {
    /// Returns face `number` of the solid at `nodes`, or `None` if the solid has no such face. Number 0 is face S1.
    pub fn new(solid: Solid, number: usize, nodes: &[[f64; 3]]) -> Option<Face> {
        let corners = solid.corners_of_faces().into_iter().nth(number)?;
        let natural = solid.natural_corners();
        let is_triangle = corners.len() == 3;
        let along = |k: usize| minus(natural[corners[k]], natural[corners[0]]);
        let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
        for node in solid.face(number)? {
            for a in 0..3 {
                low[a] = low[a].min(nodes[node][a]);
                high[a] = high[a].max(nodes[node][a]);
            }
        }
        let longest = (0..corners.len()).map(|k| {
            let side = minus(nodes[corners[(k + 1) % corners.len()]], nodes[corners[k]]);
            dot(side, side).sqrt()
        });
        Some(Face {
            solid,
            nodes: nodes.to_vec(),
            corner: natural[corners[0]],
            sides: [along(1), along(corners.len() - 1)],
            is_triangle,
            low,
            high,
            longest: longest.fold(0.0, f64::max),
        })
    }

    /// Returns the length of the longest side.
    pub fn longest_side(&self) -> f64 {
        self.longest
    }

    /// Returns the point at (s, t), or `None` outside the face.
    pub fn at(&self, place: [f64; 2]) -> Option<[f64; 3]> {
        self.contains(place).then(|| self.point(place).0)
    }

    fn contains(&self, place: [f64; 2]) -> bool {
        let sum_at_most = if self.is_triangle { 1.0 } else { 2.0 };
        place.iter().all(|x| (-ON_FACE..=1.0 + ON_FACE).contains(x))
            && place[0] + place[1] <= sum_at_most + ON_FACE
    }

    /// Returns true only if every point of the face is farther from `at` than `reach`. A curved face may bulge beyond
    /// the box around its nodes by an eighth of its longest side.
    pub fn is_farther_than(&self, at: [f64; 3], reach: f64) -> bool {
        let reach = reach + 0.125 * self.longest;
        (0..3).any(|a| at[a] < self.low[a] - reach || at[a] > self.high[a] + reach)
    }

    /// Returns the nearest point to `at`.
    pub fn nearest(&self, at: [f64; 3]) -> NearestPoint {
        let interior_point = self.foot(at).map(|foot| self.nearest_point(at, foot));
        interior_point.unwrap_or_else(|| {
            let edges = match self.is_triangle {
                true => &EDGES_OF_TRIANGLE[..],
                false => &EDGES_OF_SQUARE[..],
            };
            let edge_points = edges
                .iter()
                .map(|edge| self.nearest_point(at, self.foot_on_edge(*edge, at)));
            let nearest = edge_points.min_by(|a, b| a.distance.total_cmp(&b.distance));
            nearest.expect("a face has edges")
        })
    }

    /// Finds the foot of the perpendicular from `at`. Returns `None` if the foot is not on the face.
    fn foot(&self, at: [f64; 3]) -> Option<Foot> {
        let mut is_found = false;
        let mut place = match self.is_triangle {
            true => [1.0 / 3.0; 2],
            false => [0.5; 2],
        };
        for _ in 0..STEPS {
            let (position, tangents, _) = self.point(place);
            let offset = minus(at, position);
            let [a, b] = tangents.map(|t| dot(t, offset));
            let [[p, q], [_, r]] = tangents.map(|t| tangents.map(|u| dot(t, u)));
            let determinant = p * r - q * q;
            let step = [(r * a - q * b) / determinant, (p * b - q * a) / determinant];
            place = [0, 1].map(|k| (place[k] + step[k]).clamp(-1.0, 2.0));
            is_found = step.iter().all(|s| s.abs() < AT_REST);
            if step.iter().all(|s| s.abs() < NO_STEP) {
                break;
            }
        }
        self.contains(place).then_some(Foot { place, is_found })
    }

    /// Finds the nearest point of an edge, which is a start point and a direction in (s, t).
    fn foot_on_edge(&self, [start, along]: [[f64; 2]; 2], at: [f64; 3]) -> Foot {
        let place = |x: f64| [0, 1].map(|k| start[k] + x * along[k]);
        let (mut x, mut is_found) = (0.5, false);
        for _ in 0..STEPS {
            let (position, tangents, _) = self.point(place(x));
            let tangent = [0, 1, 2].map(|a| along[0] * tangents[0][a] + along[1] * tangents[1][a]);
            let step = dot(tangent, minus(at, position)) / dot(tangent, tangent);
            let next = (x + step).clamp(0.0, 1.0);
            let moved = (next - x).abs();
            is_found = moved < AT_REST;
            x = next;
            if moved < NO_STEP {
                break;
            }
        }
        Foot {
            place: place(x),
            is_found,
        }
    }

    /// Returns the position x, the tangents ∂x/∂s and ∂x/∂t, and the weights of the nodes at the point (s, t) of the
    /// face.
    fn point(&self, place: [f64; 2]) -> ([f64; 3], [[f64; 3]; 2], Vec<f64>) {
        let natural = [0, 1, 2]
            .map(|a| self.corner[a] + place[0] * self.sides[0][a] + place[1] * self.sides[1][a]);
        let (weights, slopes) = self.solid.shape(natural);
        let mut position = [0.0; 3];
        let mut tangents = [[0.0; 3]; 2];
        for ((node, weight), slope) in self.nodes.iter().zip(&weights).zip(&slopes) {
            for a in 0..3 {
                position[a] += weight * node[a];
                for (tangent, side) in tangents.iter_mut().zip(&self.sides) {
                    tangent[a] += dot(*slope, *side) * node[a];
                }
            }
        }
        (position, tangents, weights)
    }

    fn nearest_point(&self, at: [f64; 3], foot: Foot) -> NearestPoint {
        let (position, _, weights) = self.point(foot.place);
        let offset = minus(at, position);
        let distance = dot(offset, offset).sqrt();
        NearestPoint {
            position,
            // The search does not converge on a degenerate or strongly curved face. A face on which the search does not
            // converge has infinite distance.
            distance: match foot.is_found && !distance.is_nan() {
                true => distance,
                false => f64::INFINITY,
            },
            weights,
        }
    }
}
