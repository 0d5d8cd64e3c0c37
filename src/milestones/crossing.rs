//! Crossing of a level by a history with error bars: the earliest, the nominal and the latest cycles.
//!
//! A monotone cubic interpolates a history between its rows [Fritsch & Butland 1984]. The error bar includes the
//! difference between the cubic and a straight line.

/// History of a figure over cycles. The error bars bound the error of the figure's change since the first row.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct History {
    /// Cycles, ascending.
    pub cycles: Vec<f64>,
    /// Values of the figure, in the unit of the figure.
    pub values: Vec<f64>,
    /// Error bars of the values, in the unit of the figure.
    pub bars: Vec<f64>,
    /// Largest additional deviation of the history from the cubic, midway between the first two rows. The deviation is
    /// divided by the change between the two rows. The rows do not determine the initial slope.
    pub bend: f64,
}

/// Cycles at which a history passes a level; `None` if it does not within its last row.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Crossing {
    /// Cycles at which the bar first reaches the level.
    pub earliest: Option<f64>,
    /// Cycles at which the value reaches the level.
    pub nominal: Option<f64>,
    /// Cycles at which the whole bar has passed the level.
    pub latest: Option<f64>,
    /// Cycles, after the nominal ones, at which the whole bar is back before the level.
    pub returns: Option<f64>,
    /// Whether the bar is informative: smaller than the change where the level is passed, or at the end.
    pub is_known: bool,
}

/// Number of pieces per interval between rows in the search for a crossing.
const PIECES: usize = 64;
/// Number of bisections of the piece with a crossing.
const HALVINGS: usize = 40;

/// History to follow: the near side of the bar, the value, or the far side of the bar.
#[derive(Clone, Copy, PartialEq)]
enum Side {
    Near,
    Middle,
    Far,
}

impl History {
    /// Returns the last cycles; 0 without a row.
    pub fn end(&self) -> f64 {
        self.cycles.last().copied().unwrap_or(0.0)
    }

    /// Returns the crossing of a level that was passed before the history begins.
    pub fn crossed_before_start(&self) -> Crossing {
        let begin = self.cycles.first().copied();
        Crossing {
            earliest: begin,
            nominal: begin,
            latest: begin,
            returns: None,
            is_known: true,
        }
    }

    /// Returns the first crossing of a level, from the side on which the history begins. Returns `None` if
    /// the history begins at the level or has no rows.
    pub fn crossing(&self, level: f64) -> Option<Crossing> {
        let (first, last) = (*self.values.first()?, *self.values.last()?);
        let change = level - first;
        if change == 0.0 || !change.is_finite() {
            return None;
        }
        let slopes = slopes(&self.cycles, &self.values);
        let sign = change.signum();
        let goal = change.abs();
        // Positive once the level is passed.
        let ahead = |row: usize, part: f64, side: Side| {
            let (value, bar) = self.at(&slopes, row, part);
            let progress = sign * (value - first);
            let progress = match side {
                Side::Near => progress + bar,
                Side::Middle => progress,
                Side::Far => progress - bar,
            };
            progress - goal
        };
        let after = |begin: f64, reached: &dyn Fn(usize, f64) -> bool| self.first(begin, reached);
        let reached = |side: Side| after(0.0, &|row, part| ahead(row, part, side) >= 0.0);
        let [earliest, nominal, latest] = [Side::Near, Side::Middle, Side::Far].map(reached);
        let returns =
            nominal.and_then(|at| after(at, &|row, part| ahead(row, part, Side::Near) < 0.0));
        let is_known = match nominal {
            Some(at) => self.bar_at(&slopes, at) < goal,
            None => self.bars.last().copied().unwrap_or(0.0) < (last - first).abs(),
        };
        Some(Crossing {
            earliest,
            nominal,
            latest,
            returns,
            is_known,
        })
    }

    /// Returns value and bar at a fraction of the way from a row to the next.
    fn at(&self, slopes: &[f64], row: usize, part: f64) -> (f64, f64) {
        let length = self.cycles[row + 1] - self.cycles[row];
        let [a, b] = [self.values[row], self.values[row + 1]];
        let line = a + (b - a) * part;
        let rest = 1.0 - part;
        // Difference between Hermite's cubic and the line.
        let [from, to] = [slopes[row], slopes[row + 1]].map(|slope| slope * length - (b - a));
        let bent = part * rest * (from * rest - to * part);
        let bar = self.bars[row] + (self.bars[row + 1] - self.bars[row]) * part;
        let begins = match row {
            0 => 4.0 * part * rest * self.bend * (b - a).abs(),
            _ => 0.0,
        };
        (line + bent, bar + bent.abs() + begins)
    }

    fn bar_at(&self, slopes: &[f64], cycles: f64) -> f64 {
        let rows = self.cycles.windows(2);
        let row = rows.take_while(|pair| pair[1] < cycles).count();
        let part = (cycles - self.cycles[row]) / (self.cycles[row + 1] - self.cycles[row]);
        self.at(slopes, row, part).1
    }

    /// Returns the first number of cycles, from `begin` on, at which the condition `holds` is true. The arguments of
    /// `holds` are a row and a fraction of the way to the next row.
    fn first(&self, begin: f64, holds: &dyn Fn(usize, f64) -> bool) -> Option<f64> {
        for (row, pair) in self.cycles.windows(2).enumerate() {
            let length = pair[1] - pair[0];
            let from = ((begin - pair[0]) / length).max(0.0);
            if from > 1.0 {
                continue;
            }
            let place = |piece: usize| from + (1.0 - from) * piece as f64 / PIECES as f64;
            let Some(piece) = (0..=PIECES).find(|piece| holds(row, place(*piece))) else {
                continue;
            };
            let (mut below, mut above) = (place(piece.saturating_sub(1)), place(piece));
            for _ in 0..HALVINGS {
                let middle = 0.5 * (below + above);
                match holds(row, middle) {
                    true => above = middle,
                    false => below = middle,
                }
            }
            return Some(pair[0] + length * above);
        }
        None
    }
}

/// Returns the slope of the monotone cubic at each row. The slope is the harmonic mean of the chord slopes before and
/// after the row, weighted by the lengths of the intervals. The slope is 0 if the signs of the two chord slopes differ.
fn slopes(x: &[f64], y: &[f64]) -> Vec<f64> {
    let lengths: Vec<f64> = x.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let pairs = y.windows(2).zip(&lengths);
    let secants: Vec<f64> = pairs
        .map(|(pair, length)| (pair[1] - pair[0]) / length)
        .collect();
    let rows = x.len();
    if rows < 3 {
        return vec![secants.first().copied().unwrap_or(0.0); rows];
    }
    let inner = |row: usize| {
        let ([a, b], [l, r]) = (
            [secants[row - 1], secants[row]],
            [lengths[row - 1], lengths[row]],
        );
        if a * b <= 0.0 {
            return 0.0;
        }
        let (weight_a, weight_b) = (2.0 * r + l, r + 2.0 * l);
        (weight_a + weight_b) / (weight_a / a + weight_b / b)
    };
    // One-sided slope of second order, bounded so that the cubic stays monotone.
    let end = |[near, far]: [usize; 2]| {
        let ([a, b], [l, r]) = ([secants[near], secants[far]], [lengths[near], lengths[far]]);
        let slope = ((2.0 * l + r) * a - l * b) / (l + r);
        if slope * a <= 0.0 {
            0.0
        } else if a * b <= 0.0 && slope.abs() > 3.0 * a.abs() {
            3.0 * a
        } else {
            slope
        }
    };
    let mut slopes = vec![end([0, 1])];
    slopes.extend((1..rows - 1).map(inner));
    slopes.push(end([rows - 2, rows - 3]));
    slopes
}
