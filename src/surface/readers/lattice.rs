//! Conversion of rows of x, y and z to a regular grid. The rows can be in any order, and points of the grid can be
//! missing.

use super::error::ReadProblem;
use super::points;
use crate::surface::topography::Topography;

/// Largest distance of a coordinate from its grid line, in spacings: tables round their coordinates.
const OFF_LINE: f64 = 0.1;

/// Largest distance between coordinates of one grid line, as a fraction of the range: the rounding of printed
/// digits.
const SAME_LINE: f64 = 1e-7;

/// Smallest gap between grid lines, as a fraction of the largest gap, if positions are not exact.
const JITTER: f64 = 0.02;

/// Smallest number of rows, as a fraction of the grid's points. With fewer rows the points are not a grid.
const FEWEST_ROWS_FRACTION: f64 = 0.25;

/// Builds the topography of points at (x, y) with height z, all in metres. Missing points are holes.
pub(super) fn from_points(rows: &[[f64; 3]]) -> Result<Topography, ReadProblem> {
    if rows.is_empty() {
        return Err(ReadProblem::Malformed {
            place: "the table".into(),
            found: "no rows".into(),
            expected: "rows of x, y, z".into(),
        });
    }
    for (row, [x, y, _]) in rows.iter().enumerate() {
        if !(x.is_finite() && y.is_finite()) {
            return Err(ReadProblem::NotRegular {
                row: row + 1,
                found: format!("the position is ({x}, {y})"),
            });
        }
    }
    let lines = |least| [0, 1].map(|axis| Lines::fit(rows.iter().map(|r| r[axis]), least));
    let is_filled = |[x, y]: &[Lines; 2]| {
        rows.len() as f64 >= FEWEST_ROWS_FRACTION * x.count as f64 * y.count as f64
    };
    let exact = lines(0.0);
    let [x, y] = match is_filled(&exact) {
        true => exact,
        // Positions reported by a stage are each a little off.
        false => lines(JITTER),
    };
    if !is_filled(&[x, y]) {
        return Err(ReadProblem::NotRegular {
            row: 1,
            found: format!(
                "{} rows, less than a quarter of the points, for a grid of {} x {} lines",
                rows.len(),
                x.count,
                y.count
            ),
        });
    }
    let mut heights = vec![f64::NAN; points(x.count, y.count)?];
    let mut seen = vec![false; heights.len()];
    for (row, &[px, py, z]) in rows.iter().enumerate() {
        let fail = |found: String| ReadProblem::NotRegular {
            row: row + 1,
            found,
        };
        let line = |lines: &Lines, at: f64, axis: char| {
            lines.position(at).ok_or_else(|| {
                fail(format!(
                    "{axis} = {at:e} m lies between the lines of a grid from {:e} m in steps of {:e} m",
                    lines.first, lines.step
                ))
            })
        };
        let index = line(&x, px, 'x')? * y.count + line(&y, py, 'y')?;
        if std::mem::replace(&mut seen[index], true) {
            return Err(fail(format!("the point ({px:e}, {py:e}) m occurs twice")));
        }
        heights[index] = z;
    }
    // An axis with a single grid line has no spacing of its own. The axis gets the spacing of the other axis.
    let [dx, dy] = match (x.count, y.count) {
        (1, _) => [y.step, y.step],
        (_, 1) => [x.step, x.step],
        _ => [x.step, y.step],
    };
    Ok(Topography {
        nx: x.count,
        ny: y.count,
        spacing: (dx > 0.0 && dy > 0.0).then_some([dx, dy]),
        heights,
    })
}

/// Fraction of the points of a grid whose positions are the first two columns of a matrix. If the matrix has rows for a
/// larger fraction of the points, each row is a point with further columns.
const POINTS_FILL_FRACTION: f64 = 0.75;

/// Rejects a matrix whose rows are points with further columns. The first two columns of such a matrix fill a grid, and
/// each pair of positions occurs once.
pub(super) fn reject_points(columns: usize, values: &[f64]) -> Result<(), ReadProblem> {
    let rows = values.chunks_exact(columns);
    let points: Vec<[f64; 3]> = rows.map(|row| [row[0], row[1], 0.0]).collect();
    let fills_grid = |grid: &Topography| {
        let [nx, ny] = [grid.nx, grid.ny].map(|count| count as f64);
        nx.min(ny) > 1.0 && points.len() as f64 > POINTS_FILL_FRACTION * nx * ny
    };
    match from_points(&points).ok().filter(fills_grid) {
        Some(Topography { nx, ny, .. }) => Err(ReadProblem::Malformed {
            place: "the columns".into(),
            found: format!(
                "{columns} values a row, the first two of which are the positions of {nx} x {ny} points"
            ),
            expected: "a matrix of heights, or points as a text of three columns x, y, z, or of more below a line of their names".into(),
        }),
        None => Ok(()),
    }
}

/// Equally spaced grid lines.
#[derive(Clone, Copy)]
struct Lines {
    first: f64,
    step: f64,
    count: usize,
}

impl Lines {
    /// Finds the lines. Gaps below the fraction `least` of the largest gap do not separate lines.
    fn fit(coordinates: impl Iterator<Item = f64>, least: f64) -> Lines {
        let mut sorted: Vec<f64> = coordinates.collect();
        sorted.sort_by(f64::total_cmp);
        let (first, last) = (sorted[0], sorted[sorted.len() - 1]);
        let range = last - first;
        sorted.dedup_by(|a, b| *a - *b <= SAME_LINE * range);
        if sorted.len() == 1 {
            return Lines {
                first,
                step: 0.0,
                count: 1,
            };
        }
        // Each gap is counted in units of the usual gap. Counting gaps prevents rounding errors of the coordinates from
        // adding up, and a missing line from shifting the others.
        let gaps: Vec<f64> = sorted.windows(2).map(|w| w[1] - w[0]).collect();
        let largest = gaps.iter().copied().fold(0.0, f64::max);
        let mut ordered: Vec<f64> = gaps
            .iter()
            .copied()
            .filter(|gap| *gap >= least * largest)
            .collect();
        ordered.sort_by(f64::total_cmp);
        let usual = ordered[ordered.len() / 2];
        // A gap of less than half a step rounds to 0: both coordinates belong to one line.
        let steps: f64 = gaps.iter().map(|gap| (gap / usual).round()).sum();
        Lines {
            first,
            step: range / steps,
            count: steps as usize + 1,
        }
    }

    fn position(&self, at: f64) -> Option<usize> {
        if self.count == 1 {
            return Some(0);
        }
        let exact = (at - self.first) / self.step;
        let line = exact.round();
        ((exact - line).abs() <= OFF_LINE).then_some(line as usize)
    }
}
