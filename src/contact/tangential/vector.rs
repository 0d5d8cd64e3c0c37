//! Vectors of one or two components in the contact plane.

/// Shear, slip or displacement of a cell: along x, or along x and y.
pub(super) type Vector<const A: usize> = [f64; A];

pub(super) fn dot<const A: usize>(a: Vector<A>, b: Vector<A>) -> f64 {
    let mut sum = 0.0;
    for axis in 0..A {
        sum += a[axis] * b[axis];
    }
    sum
}

/// Returns the length of a vector. Contact tractions and displacements are far from overflow or underflow of a square.
pub(super) fn norm<const A: usize>(a: Vector<A>) -> f64 {
    if A == 1 { a[0].abs() } else { dot(a, a).sqrt() }
}

pub(super) fn scaled<const A: usize>(factor: f64, a: Vector<A>) -> Vector<A> {
    a.map(|v| factor * v)
}

/// Returns `a + factor * b`.
pub(super) fn plus<const A: usize>(a: Vector<A>, factor: f64, b: Vector<A>) -> Vector<A> {
    let mut sum = a;
    for axis in 0..A {
        sum[axis] += factor * b[axis];
    }
    sum
}

/// Returns the vector rotated by a quarter turn, or zero if there is only one axis.
pub(super) fn quarter_turn<const A: usize>(a: Vector<A>) -> Vector<A> {
    let mut rotated = [0.0; A];
    if A == 2 {
        (rotated[0], rotated[1]) = (-a[1], a[0]);
    }
    rotated
}

/// Returns the nearest point of the disc |q| ≤ `limit`.
pub(super) fn into_disc<const A: usize>(a: Vector<A>, limit: f64) -> Vector<A> {
    let size = norm(a);
    if size <= limit {
        a
    } else {
        scaled(limit / size, a)
    }
}

/// Returns the change of a vector that rotates by 2 arctan(`angle`/2). The angle 2 arctan(`angle`/2) equals `angle` up
/// to third order, and a rotation by 2 arctan(`angle`/2) needs no sine or cosine.
pub(super) fn nearly_turn<const A: usize>(a: Vector<A>, angle: f64) -> Vector<A> {
    if A == 1 {
        return [0.0; A];
    }
    let half = 0.5 * angle;
    let part = 2.0 * half / (1.0 + half * half);
    plus(scaled(-half * part, a), part, quarter_turn(a))
}

/// Returns the change of a vector that rotates by `angle`. The formula avoids differences of nearly equal numbers. With
/// differences of nearly equal numbers, the rounding of sliding cells' shear would exceed the last, small steps of
/// sticking cells.
pub(super) fn turn<const A: usize>(a: Vector<A>, angle: f64) -> Vector<A> {
    let (sin, half) = (angle.sin(), (0.5 * angle).sin());
    plus(scaled(-2.0 * half * half, a), sin, quarter_turn(a))
}

/// Returns the difference between two points of a circle about the origin: the point in the direction `to` minus the
/// point `from`.
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
