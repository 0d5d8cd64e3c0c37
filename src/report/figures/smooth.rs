//! Smooth lines through few computed points.

use super::super::plot::{Chart, Curve, Mark};

/// Replaces the curves of a chart by smooth lines, and adds dots at the computed points.
pub fn smooth_with_points(chart: &mut Chart) {
    let dots = chart.curves.iter().map(|curve| Curve {
        name: String::new(),
        mark: Mark::Points,
        ..curve.clone()
    });
    let dots: Vec<Curve> = dots.collect();
    for curve in &mut chart.curves {
        curve.points = smooth(&curve.points);
    }
    chart.curves.extend(dots);
}

/// Steps of a smooth line between two points.
const STEPS: usize = 12;

/// Interpolates points by monotone cubic pieces (Fritsch and Butland) between the reversals of the abscissa.
///
/// The line does not overshoot the points.
fn smooth(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut line: Vec<[f64; 2]> = Vec::new();
    let mut begin = 0;
    while begin + 1 < points.len() {
        let step = |k: usize| points[k + 1][0] - points[k][0];
        let mut end = begin + 1;
        while end + 1 < points.len() && step(end) * step(begin) > 0.0 {
            end += 1;
        }
        branch(&points[begin..=end], &mut line);
        begin = end;
    }
    line
}

/// Interpolates one branch, along which the abscissa is monotone.
fn branch(points: &[[f64; 2]], line: &mut Vec<[f64; 2]>) {
    let widths: Vec<f64> = points.windows(2).map(|p| p[1][0] - p[0][0]).collect();
    let slopes: Vec<f64> = points
        .windows(2)
        .zip(&widths)
        .map(|(p, width)| (p[1][1] - p[0][1]) / width)
        .collect();
    if points.len() < 3 || !slopes.iter().all(|slope| slope.is_finite()) {
        line.extend(points);
        return;
    }
    let last = slopes.len();
    // The slope at an end comes from the parabola through three points. The slope at an end is limited so that the
    // curve stays between its points.
    let at_end = |near: usize, far: usize| {
        let [h, next] = [widths[near], widths[far]];
        let slope = ((2.0 * h + next) * slopes[near] - h * slopes[far]) / (h + next);
        match slope * slopes[near] > 0.0 {
            true => slope.signum() * slope.abs().min(3.0 * slopes[near].abs()),
            false => 0.0,
        }
    };
    let tangent = |k: usize| match k {
        0 => at_end(0, 1),
        k if k == last => at_end(last - 1, last - 2),
        k if slopes[k - 1] * slopes[k] <= 0.0 => 0.0,
        k => {
            let [w, v] = [
                2.0 * widths[k] + widths[k - 1],
                widths[k] + 2.0 * widths[k - 1],
            ];
            (w + v) / (w / slopes[k - 1] + v / slopes[k])
        }
    };
    for k in 0..last {
        let ([x, y], h) = (points[k], widths[k]);
        for step in 0..STEPS {
            let t = step as f64 / STEPS as f64;
            let rest = 1.0 - t;
            let value = y * (1.0 + 2.0 * t) * rest * rest
                + points[k + 1][1] * t * t * (3.0 - 2.0 * t)
                + h * t * rest * (rest * tangent(k) - t * tangent(k + 1));
            line.push([x + t * h, value]);
        }
    }
    line.push(points[last]);
}
