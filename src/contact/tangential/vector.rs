//! Vectors in the plane of the contact, of one component or two.

/// A shear, slip or displacement of a cell: along x, or x and y.
pub(super) type Vector<const A: usize> = [f64; A];

pub(super) fn dot<const A: usize>(a: Vector<A>, b: Vector<A>) -> f64 {
    let mut sum = 0.0;
    for axis in 0..A {
        sum += a[axis] * b[axis];
    }
    sum
}

/// Length of a vector. Contact tractions and displacements are far from where a square would overflow or vanish.
pub(super) fn norm<const A: usize>(a: Vector<A>) -> f64 {
    if A == 1 { a[0].abs() } else { dot(a, a).sqrt() }
}

pub(super) fn scaled<const A: usize>(factor: f64, a: Vector<A>) -> Vector<A> {
    a.map(|v| factor * v)
}

/// `a + factor * b`.
pub(super) fn plus<const A: usize>(a: Vector<A>, factor: f64, b: Vector<A>) -> Vector<A> {
    let mut sum = a;
    for axis in 0..A {
        sum[axis] += factor * b[axis];
    }
    sum
}

/// The vector a quarter turn ahead; nothing where there is but one axis.
pub(super) fn quarter_turn<const A: usize>(a: Vector<A>) -> Vector<A> {
    let mut turned = [0.0; A];
    if A == 2 {
        (turned[0], turned[1]) = (-a[1], a[0]);
    }
    turned
}

/// The nearest point of the disc |q| ≤ `limit`.
pub(super) fn into_disc<const A: usize>(a: Vector<A>, limit: f64) -> Vector<A> {
    let size = norm(a);
    if size <= limit {
        a
    } else {
        scaled(limit / size, a)
    }
}

/// The change of a vector that turns by 2 arctan(`angle`/2), which is `angle` but for its cube, without sine or cosine.
pub(super) fn nearly_turn<const A: usize>(a: Vector<A>, angle: f64) -> Vector<A> {
    if A == 1 {
        return [0.0; A];
    }
    let half = 0.5 * angle;
    let part = 2.0 * half / (1.0 + half * half);
    plus(scaled(-half * part, a), part, quarter_turn(a))
}

/// The change of a vector that turns by an angle. Written without a difference of nearly equal numbers: beside the slip of
/// sliding cells, rounding of their shear would drown the last steps of the sticking ones.
pub(super) fn turn<const A: usize>(a: Vector<A>, angle: f64) -> Vector<A> {
    let (sin, half) = (angle.sin(), (0.5 * angle).sin());
    plus(scaled(-2.0 * half * half, a), sin, quarter_turn(a))
}

/// The change that brings `from` to the circle |q| = `limit` in the direction of `to`, `from` being on that circle.
pub(super) fn turn_towards<const A: usize>(from: Vector<A>, to: Vector<A>) -> Vector<A> {
    let along = dot(from, to);
    if A == 1 {
        return if along < 0.0 {
            scaled(-2.0, from)
        } else {
            [0.0; A]
        };
    }
    turn(from, dot(quarter_turn(from), to).atan2(along))
}
