//! The path of what bounces: its periodic motions over frequency, by arc length in the state at the phase 0 and the logarithm of frequency.
//! Under light damping they turn back within a thousandth of a frequency, or close, so that no step of frequency leads along them.

use super::two_springs::{Drive, Shape, State, TwoSprings};
use crate::linalg::vectors::{cross, dot, minus, unit};

/// First, least and largest step along a path.
const STEPS: [f64; 3] = [0.02, 1e-5, 0.2];
/// A relative change of frequency that counts as much along a path as one of the state by all of its motion's half range.
const FREQUENCY: f64 = 0.3;
/// How far a point may be from its prediction, in steps, and the least cosine between the directions of two points.
const BESIDE: f64 = 0.5;
const STRAIGHT: f64 = 0.9;
/// Newton's steps to a point, how many of them let the next step along the path be longer, and by how much; and the size of the last one.
const NEWTON: usize = 8;
const FEW: usize = 3;
const LONGER: f64 = 1.5;
const SOLVED: f64 = 1e-9;
/// Difference by which the map over a period is derived.
const DIFFERENCE: f64 = 1e-6;
/// A half range that differs by more than this factor from the one in whose parts a path is measured takes its place.
const RESCALED: f64 = 1.4;
/// Most points of a path in each direction.
const MOST: usize = 400;
/// Points after which a path may have closed, and how near it passes its start then, in steps.
const BEGUN: usize = 3;
const CLOSED: f64 = 0.1;
/// A motion that goes less far beyond the edge, in parts of its half range, is where the path ends that cannot be followed farther.
const GRAZES: f64 = 0.02;
/// Halvings of the path beside its top.
const HALVINGS: usize = 8;
/// Half ranges at one frequency that differ by less may be those of one motion, and the way around over it between two points of its path, in
/// the straight way.
const SAME: f64 = 0.02;
const AROUND: f64 = 1.5;

/// A periodic motion that bounces.
#[derive(Debug, Clone)]
pub(super) struct Bounce {
    /// Angular frequency of the drive \[rad/s\], and the state at the phase 0.
    pub(super) omega: f64,
    pub(super) state: State,
    pub(super) shape: Shape,
}

impl Bounce {
    /// The motion from a periodic state at the phase 0; none where its events do not come to an end.
    fn of(drive: &Drive<'_>, state: State) -> Option<Bounce> {
        Some(Bounce {
            omega: drive.omega(),
            state,
            shape: drive.shape(state)?,
        })
    }

    fn size(&self) -> f64 {
        self.shape.first_harmonic
    }
}

/// Periodic motions along a path.
#[derive(Debug)]
pub(super) struct Path {
    /// In its order.
    motions: Vec<Bounce>,
    /// Whether it closes or leaves the frequencies within which it was followed, or the contact stays closed or open from its ends on.
    pub(super) is_whole: bool,
}

impl Path {
    /// Whether it passes a motion. Under a load of a higher order others of the same size may be a part of a period later.
    pub(super) fn has(&self, motion: &Bounce) -> bool {
        let is_between = |value: f64, a: f64, b: f64, share: f64| {
            a.min(b) <= value * (1.0 + share) && value <= a.max(b) * (1.0 + share)
        };
        let distance = |a: &Bounce, b: &Bounce| {
            let [z, v] = [0, 1].map(|i| a.state[i] - b.state[i]);
            z.hypot(v / motion.omega)
        };
        let extent = |bounce: &Bounce| bounce.shape.half_range;
        self.motions.windows(2).any(|ends| {
            let [a, b] = [&ends[0], &ends[1]];
            is_between(motion.omega, a.omega, b.omega, 0.0)
                && is_between(extent(motion), extent(a), extent(b), SAME)
                && distance(a, motion) + distance(motion, b) < AROUND * distance(a, b)
        })
    }

    /// The motions in a range of angular frequencies, in the order of the path.
    pub(super) fn inside(&self, (from, to): (f64, f64)) -> Vec<&Bounce> {
        let all = self.motions.iter();
        all.filter(|motion| (from..=to).contains(&motion.omega))
            .collect()
    }

    /// The motion of the largest first harmonic in a range of angular frequencies; none where the path is elsewhere.
    pub(super) fn top(&self, range: (f64, f64)) -> Option<&Bounce> {
        self.top_at(range).map(|k| &self.motions[k])
    }

    fn top_at(&self, (from, to): (f64, f64)) -> Option<usize> {
        let inside =
            (0..self.motions.len()).filter(|k| (from..=to).contains(&self.motions[*k].omega));
        inside.max_by(|a, b| self.motions[*a].size().total_cmp(&self.motions[*b].size()))
    }
}

impl TwoSprings {
    /// The periodic motion near a state at an angular frequency, if there is one; and the evaluations that it took.
    pub(super) fn bounce(&self, omega: f64, near: State) -> (Option<Bounce>, usize) {
        let drive = Drive::new(self, omega, 1.0);
        let state = drive.periodic(near);
        let found = state.and_then(|state| Bounce::of(&drive, state));
        (found, drive.evaluations())
    }

    /// The path through a motion as far as it lies within angular frequencies, with its motions at the ends of a `range` among these and its highest in
    /// that. And the evaluations that it took: it ends early, soon after `most`.
    pub(super) fn path(
        &self,
        through: &Bounce,
        within: (f64, f64),
        range: (f64, f64),
        most: usize,
    ) -> (Path, usize) {
        let mut follower = Follower {
            model: self,
            within,
            most,
            evaluations: 0,
        };
        // Towards the range first, where it begins below.
        let way = if through.omega < range.0 { 1.0 } else { -1.0 };
        let (mut motions, end) = follower.along(through, way);
        motions.reverse();
        motions.push(through.clone());
        let mut is_whole = end.is_some();
        if end != Some(End::Closed) {
            let (onwards, end) = follower.along(through, -way);
            motions.extend(onwards);
            is_whole &= end.is_some();
        }
        let mut path = Path { motions, is_whole };
        let last = path.motions.len() - 1;
        if end == Some(End::Closed) && [Some(0), Some(last)].contains(&path.top_at(range)) {
            // So that there are others on both sides of its top.
            path.motions.pop();
            path.motions.rotate_left(last / 2);
            path.motions.extend(path.motions.first().cloned());
        }
        follower.add_ends(&mut path, range);
        follower.refine(&mut path, range);
        (path, follower.evaluations)
    }
}

/// How a path ends.
#[derive(Clone, Copy, PartialEq, Eq)]
enum End {
    Closed,
    /// Beyond the frequencies, or where nothing bounces.
    Left,
}

/// Displacement and velocity at the phase 0 and logarithm of the angular frequency, in [`Units`].
type Point = [f64; 3];

/// In what points of a path are measured.
#[derive(Clone, Copy)]
struct Units(Point);

impl Units {
    fn point(self, bounce: &Bounce) -> Point {
        let [z, v] = bounce.state;
        let Units(units) = self;
        [z / units[0], v / units[1], bounce.omega.ln() / units[2]]
    }

    fn state(self, point: Point) -> (f64, State) {
        let [z, v, frequency] = std::array::from_fn(|i| point[i] * self.0[i]);
        (frequency.exp(), [z, v])
    }
}

/// A point of a path, the unit vector along it there, and Newton's steps to it.
struct Solved {
    point: Point,
    along: Point,
    steps: usize,
}

struct Follower<'a> {
    model: &'a TwoSprings,
    within: (f64, f64),
    most: usize,
    evaluations: usize,
}

impl Follower<'_> {
    fn units(&self, of: &Bounce) -> Units {
        let open = (self.model.stiffness[0] / self.model.mass).sqrt();
        let size = of.shape.half_range;
        Units([size, size * open.max(of.omega), FREQUENCY])
    }

    /// The path from a motion, without it, first towards lower or higher frequencies as the sign of `way` says; and how it ends, if it could be followed so far.
    fn along(&mut self, from: &Bounce, way: f64) -> (Vec<Bounce>, Option<End>) {
        let mut out: Vec<Bounce> = Vec::new();
        let mut units = self.units(from);
        let mut here = from.clone();
        let Some(direction) = self.direction(units, units.point(from)) else {
            return (out, None);
        };
        let mut direction = scaled(direction, way * direction[2].signum());
        let [mut step, least, largest] = STEPS;
        while out.len() < MOST && step >= least && self.evaluations < self.most {
            let at = units.point(&here);
            let guess = moved(at, step, direction);
            let next = self.corrected(units, guess, direction);
            let next = next.filter(|next| {
                norm(minus(next.point, guess)) < BESIDE * step
                    && dot(next.along, direction).abs() > STRAIGHT
            });
            let next = next.and_then(|next| Some((self.bounce(units, next.point)?, next)));
            let Some((next, solved)) = next else {
                step *= 0.5;
                continue;
            };
            let start = units.point(from);
            let passed = dot(direction, minus(start, at)) / step;
            if out.len() >= BEGUN
                && (0.0..=1.0).contains(&passed)
                && norm(minus(start, moved(at, passed * step, direction))) < CLOSED * step
            {
                out.push(from.clone());
                return (out, Some(End::Closed));
            }
            let turn = dot(solved.along, direction).signum();
            (here, direction) = (next.clone(), scaled(solved.along, turn));
            out.push(next);
            let is_within = (self.within.0..=self.within.1).contains(&here.omega);
            if !(is_within && here.shape.bounces()) {
                return (out, Some(End::Left));
            }
            if solved.steps <= FEW {
                step = (step * LONGER).min(largest);
            }
            let own = self.units(&here);
            let factor = own.0[0] / units.0[0];
            if factor.max(1.0 / factor) > RESCALED {
                let turned: Point = std::array::from_fn(|i| direction[i] * units.0[i] / own.0[i]);
                direction = unit(turned);
                units = own;
            }
        }
        // Where the contact no longer opens or closes, the path goes on around a corner.
        let is_left = step < least && here.shape.beyond < GRAZES;
        (out, is_left.then_some(End::Left))
    }

    /// Adds to a path its motions at the ends of a range.
    fn add_ends(&mut self, path: &mut Path, (from, to): (f64, f64)) {
        for end in [from, to] {
            let mut k = 0;
            while k + 1 < path.motions.len() {
                let [a, b] = [&path.motions[k], &path.motions[k + 1]];
                k += 1;
                let share = (end / a.omega).ln() / (b.omega / a.omega).ln();
                if !(share > 0.0 && share < 1.0) {
                    continue;
                }
                let near = std::array::from_fn(|i| a.state[i] + share * (b.state[i] - a.state[i]));
                let (found, evaluations) = self.model.bounce(end, near);
                self.evaluations += evaluations;
                if let Some(found) = found {
                    path.motions.insert(k, found);
                    k += 1;
                }
            }
        }
    }

    /// Moves the highest motion of a path in a range to where the first harmonic is largest, between those beside it.
    fn refine(&mut self, path: &mut Path, range: (f64, f64)) {
        let Some(k) = path.top_at(range) else {
            return;
        };
        if k == 0 || k + 1 == path.motions.len() {
            return;
        }
        let is_inside = |bounce: &Bounce| (range.0..=range.1).contains(&bounce.omega);
        let mut three = [k - 1, k, k + 1].map(|k| path.motions[k].clone());
        for _ in 0..HALVINGS {
            let units = self.units(&three[1]);
            for side in [0, 2] {
                let [outer, top] = [side, 1].map(|i| units.point(&three[i]));
                let apart = minus(outer, top);
                let direction = unit(apart);
                let middle = moved(top, 0.5, apart);
                let found = self.corrected(units, middle, direction);
                let found = found.and_then(|found| self.bounce(units, found.point));
                let Some(found) = found else {
                    continue;
                };
                if is_inside(&found) && found.size() > three[1].size() {
                    three[2 - side] = three[1].clone();
                    three[1] = found;
                    break;
                }
                three[side] = found;
            }
        }
        path.motions[k] = three[1].clone();
    }

    fn bounce(&mut self, units: Units, point: Point) -> Option<Bounce> {
        let (omega, state) = units.state(point);
        let drive = Drive::new(self.model, omega, 1.0);
        let found = Bounce::of(&drive, state);
        self.evaluations += drive.evaluations();
        found
    }

    /// How far the state is after a period from where it was.
    fn defect(&mut self, units: Units, point: Point) -> Option<[f64; 2]> {
        let (omega, state) = units.state(point);
        let drive = Drive::new(self.model, omega, 1.0);
        let image = drive.period(state);
        self.evaluations += drive.evaluations();
        let image = image?;
        Some([0, 1].map(|i| (image[i] - state[i]) / units.0[i]))
    }

    /// Derivatives of the defect.
    fn slopes(&mut self, units: Units, point: Point, defect: [f64; 2]) -> Option<[Point; 2]> {
        let mut slopes = [[0.0; 3]; 2];
        for column in 0..3 {
            let mut shifted = point;
            shifted[column] += DIFFERENCE;
            let there = self.defect(units, shifted)?;
            for row in 0..2 {
                slopes[row][column] = (there[row] - defect[row]) / DIFFERENCE;
            }
        }
        Some(slopes)
    }

    /// The unit vector along the path at a point of it.
    fn direction(&mut self, units: Units, point: Point) -> Option<Point> {
        let defect = self.defect(units, point)?;
        let [a, b] = self.slopes(units, point, defect)?;
        Some(unit(cross(a, b)))
    }

    /// The point of a path in the plane through `guess` across a direction.
    fn corrected(&mut self, units: Units, guess: Point, across: Point) -> Option<Solved> {
        let mut point = guess;
        let mut defect = self.defect(units, point)?;
        for steps in 1..=NEWTON {
            let [a, b] = self.slopes(units, point, defect)?;
            let along = cross(a, b);
            let determinant = dot(along, across);
            // Both steps to the planes of no defect, within that across the direction.
            let first = scaled(cross(b, across), -defect[0] / determinant);
            let step = moved(first, -defect[1] / determinant, cross(across, a));
            let size = norm(step);
            // Where nothing is near, it goes far.
            if size.is_nan() || size >= 1.0 {
                return None;
            }
            point = moved(point, 1.0, step);
            defect = self.defect(units, point)?;
            if size < SOLVED {
                return Some(Solved {
                    point,
                    along: unit(along),
                    steps,
                });
            }
        }
        None
    }
}

fn norm(a: Point) -> f64 {
    dot(a, a).sqrt()
}

fn scaled(a: Point, factor: f64) -> Point {
    a.map(|value| factor * value)
}

fn moved(from: Point, by: f64, along: Point) -> Point {
    std::array::from_fn(|i| from[i] + by * along[i])
}
