//! Chart of a trade: error over cost, both logarithmic. The labels of the points are the numbers of the rows of the
//! table.

use maud::{Markup, html};

use super::super::quantity::significant_digits;
use super::super::text::escape_controls;

/// Smallest error of the chart. Smaller errors are drawn at the lower edge.
pub const FLOOR: f64 = 1e-7;

/// Point of a run in the chart.
#[derive(Debug, Clone)]
pub struct Point {
    /// Number of the row in the table, with a star if the point is marked.
    pub label: String,
    /// Name in the table.
    pub name: String,
    /// Cost, in the unit of the axis.
    pub cost: f64,
    /// Largest deviation of the promised figures. `None` for a reference, which is drawn at the lower edge.
    pub error: Option<f64>,
    /// Uncertainty of the cost, relative; 0 if the cost is exact.
    pub noise: f64,
    /// True for a square, false for a disc.
    pub is_square: bool,
    /// True for a filled mark.
    pub is_marked: bool,
}

impl Point {
    /// Returns the error at which the point is drawn, or `None` at the lower edge.
    fn height(&self) -> Option<f64> {
        self.error.filter(|error| *error >= FLOOR)
    }
}

/// Chart of error over cost.
#[derive(Debug, Clone)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Titles of the axes, cost first.
    pub axes: [String; 2],
    /// Promised errors, each with the name of the promise.
    pub bounds: Vec<(f64, String)>,
    /// Points. The chart places the labels of the first points first, closest to the points.
    pub points: Vec<Point>,
    /// True if a line connects the marked points.
    pub has_front: bool,
    /// Legend: lines for the terminal and the drawing, and lines for the drawing only.
    pub keys: [Vec<String>; 2],
}

/// Returns the `k`-th round value: 1, 2 or 5 times a power of ten. Number 0 is 1.
fn round_value(k: i32) -> f64 {
    let digit = [1, 2, 5][k.rem_euclid(3) as usize];
    let value = format!("{digit}e{}", k.div_euclid(3)).parse();
    value.unwrap_or(f64::NAN)
}

/// Logarithmic axis between two round values.
struct Axis {
    ends: [i32; 2],
}

impl Axis {
    /// Creates an axis that includes all positive finite values.
    fn new(values: impl Iterator<Item = f64>) -> Axis {
        const MARGIN: f64 = 1.02;
        let values = values.filter(|value| *value > 0.0 && value.is_finite());
        let range = values.fold(None, |range: Option<[f64; 2]>, value| {
            let [low, high] = range.unwrap_or([value; 2]);
            Some([low.min(value), high.max(value)])
        });
        // Without points the chart still needs an axis.
        let [low, high] = range.unwrap_or([1.0, 10.0]);
        let near = |value: f64| (3.0 * value.log10()).floor() as i32;
        let (mut first, mut last) = (near(low) + 2, near(high) - 2);
        while round_value(first) * MARGIN > low {
            first -= 1;
        }
        while round_value(last) < high * MARGIN {
            last += 1;
        }
        Axis {
            ends: [first, last],
        }
    }

    /// Returns the position of a value, from 0 at the lower end to 1 at the upper end.
    fn part(&self, value: f64) -> f64 {
        let [low, high] = self.ends.map(|k| round_value(k).log10());
        ((value.log10() - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Returns at most `most` round values: all of them, powers of ten, or multiples of several decades.
    fn ticks(&self, most: usize) -> Vec<f64> {
        let [first, last] = self.ends;
        let multiples = |step: i32| (first..=last).filter(move |k| k.rem_euclid(step) == 0);
        let mut steps = [1].into_iter().chain((1..).map(|decades| 3 * decades));
        let step = steps.find(|step| multiples(*step).count() <= most.max(2));
        step.map_or(Vec::new(), |step| {
            multiples(step).map(round_value).collect()
        })
    }
}

/// Box: left, top, right and bottom.
type Place = [f64; 4];

/// Finds free boxes for texts that do not overlap.
struct Free {
    taken: Vec<Place>,
    /// Index of the first box of a text. A line from a mark to the text of the mark avoids the boxes of texts, from
    /// index `first_text` on.
    first_text: usize,
    /// Offsets in the order of the search: the nearest first, horizontal ones before vertical ones.
    offsets: Vec<[f64; 2]>,
}

impl Free {
    fn new(step: f64, taken: Vec<Place>, first_text: usize) -> Free {
        const MOST: i32 = 40;
        let all = (-MOST..=MOST).flat_map(|j| (-MOST..=MOST).map(move |i| [i, j]));
        let mut all: Vec<[i32; 2]> = all.collect();
        all.sort_by_key(|[i, j]| (i * i + 4 * j * j, *j > 0, *i < 0));
        let offsets = all.iter().map(|offset| offset.map(|k| step * f64::from(k)));
        Free {
            taken,
            first_text,
            offsets: offsets.collect(),
        }
    }

    /// Reserves the free box of a size that is nearest to `at`, its centre. Returns `None` if there is no room.
    fn take(&mut self, at: [f64; 2], size: [f64; 2], frame: &Place) -> Option<Place> {
        let place = |offset: &[f64; 2]| -> Place {
            let [left, top] = [0, 1].map(|d| at[d] + offset[d] - 0.5 * size[d]);
            [left, top, left + size[0], top + size[1]]
        };
        let is_inside = |p: &Place| (0..2).all(|d| p[d] >= frame[d] && p[d + 2] <= frame[d + 2]);
        let meet = |a: &Place, b: &Place| (0..2).all(|d| a[d] < b[d + 2] && b[d] < a[d + 2]);
        let is_free = |p: &Place| is_inside(p) && !self.taken.iter().any(|other| meet(p, other));
        let is_clear = |p: &Place| {
            const PIECES: usize = 16;
            let texts = || self.taken.iter().skip(self.first_text);
            (1..PIECES).map(|k| k as f64 / PIECES as f64).all(|part| {
                let [x, y] = [0, 1].map(|d| at[d] + part * (0.5 * (p[d] + p[d + 2]) - at[d]));
                !texts().any(|text| meet(&[x, y, x, y], text))
            })
        };
        let places = || self.offsets.iter().map(place).filter(is_free);
        let place = places().find(is_clear).or_else(|| places().next())?;
        self.taken.push(place);
        Some(place)
    }
}

impl Chart {
    fn axes(&self) -> [Axis; 2] {
        let errors = self.points.iter().filter_map(Point::height);
        let bounds = self.bounds.iter().map(|(bound, _)| *bound);
        let costs = self.points.iter().map(|point| point.cost);
        [Axis::new(costs), Axis::new(errors.chain(bounds))]
    }

    /// Returns the chart as text, with `width` characters per line. Labels without room are listed below the chart.
    pub fn text(&self, width: usize) -> String {
        let [x, y] = self.axes();
        let rows = (16 + self.points.len() / 4).min(40);
        let row = |value: f64| ((1.0 - y.part(value)) * (rows - 1) as f64).round();
        let mut ticks = vec![String::new(); rows + 1];
        for tick in y.ticks(rows / 2) {
            ticks[row(tick) as usize] = format!("{} %", significant_digits(100.0 * tick, 1));
        }
        let margin = ticks.iter().map(|tick| tick.chars().count());
        let margin = margin.max().unwrap_or(0);
        let columns = width.saturating_sub(margin + 2).max(40);
        let column = |value: f64| (x.part(value) * (columns - 1) as f64).round();
        // The last line of the chart contains the axis and the labels at the lower edge.
        let mut cells = vec![vec![' '; columns]; rows];
        cells.push(vec!['-'; columns]);
        for (bound, _) in &self.bounds {
            cells[row(*bound) as usize] = vec!['.'; columns];
        }
        let mut free = Free::new(1.0, Vec::new(), usize::MAX);
        let mut put = |text: &str, middle: f64, value: Option<f64>| {
            let size = text.chars().count() as f64 + 1.0;
            let left = middle - (0.5 * size - 1.0).floor();
            let left = left.clamp(0.0, columns as f64 - size);
            let top = value.map_or(rows as f64, row);
            let ends = if value.is_some() {
                [0.0, rows as f64]
            } else {
                [top, top + 1.0]
            };
            let frame = [0.0, ends[0], columns as f64, ends[1]];
            let place = free.take([left + 0.5 * size, top + 0.5], [size, 1.0], &frame)?;
            for (k, letter) in text.chars().chain([' ']).enumerate() {
                cells[place[1] as usize][place[0] as usize + k] = letter;
            }
            Some(())
        };
        for (bound, name) in &self.bounds {
            put(&format!(" {name}"), columns as f64, Some(*bound));
        }
        let points = self.points.iter();
        let is_crowded = |p: &&Point| put(&p.label, column(p.cost), p.height()).is_none();
        let crowded: Vec<&str> = points.filter(is_crowded).map(|p| &p.label[..]).collect();
        let mut text = format!("{}\n", self.axes[1]);
        for (k, (tick, line)) in ticks.iter().zip(&cells).enumerate() {
            let line: String = line.iter().collect();
            let bar = if k == rows { '+' } else { '|' };
            text += &format!("{}\n", format!("{tick:>margin$} {bar}{line}").trim_end());
        }
        let mut scale = vec![' '; margin + 2 + columns];
        for tick in x.ticks(columns / 8) {
            let tick_text = significant_digits(tick, 1);
            let start = margin + 2 + column(tick) as usize - tick_text.chars().count() / 2;
            let start = start.min(scale.len() - tick_text.chars().count());
            for (k, letter) in tick_text.chars().enumerate() {
                scale[start + k] = letter;
            }
        }
        let scale: String = scale.iter().collect();
        text += &format!("{scale}\n{:>1$}\n", self.axes[0], margin + 2 + columns);
        text.extend(self.keys[0].iter().map(|line| format!("{line}\n")));
        if !crowded.is_empty() {
            text += &format!("No room for {}\n", crowded.join(" "));
        }
        text
    }

    /// Returns the chart as an SVG. The SVG inherits light or dark colours from its page, but the SVG of a `file` has
    /// its own style sheet.
    pub fn svg(&self, file: bool) -> Markup {
        const SIZE: [f64; 2] = [800.0, 580.0];
        const FRAME: Place = [76.0, 58.0, 768.0, 452.0];
        const TEXT: f64 = 12.5;
        let [left, top, right, bottom] = FRAME;
        let [x, y] = self.axes();
        let x_of = |value: f64| left + x.part(value) * (right - left);
        let y_of = |value: f64| bottom - y.part(value) * (bottom - top);
        let place = |point: &Point| [x_of(point.cost), point.height().map_or(bottom, y_of)];
        let points = || self.points.iter();
        let mut front: Vec<_> = points().filter(|p| p.is_marked && self.has_front).collect();
        front.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        let front: Vec<[f64; 2]> = front.into_iter().map(place).collect();
        let bounds: Vec<f64> = self.bounds.iter().map(|(bound, _)| y_of(*bound)).collect();
        // Texts avoid marks and lines.
        let lines = bounds.iter().map(|height| [left, *height, right, *height]);
        let front_pieces = front.windows(2).flat_map(|pair| {
            const PIECES: i32 = 40;
            let part = move |k: i32, d: usize| {
                pair[0][d] + f64::from(k) / f64::from(PIECES) * (pair[1][d] - pair[0][d])
            };
            (0..PIECES).map(move |k| [part(k, 0), part(k, 1), part(k, 0), part(k, 1)])
        });
        let marks = points().map(|point| mark_box(point, place(point)));
        let taken: Vec<Place> = marks.chain(lines).chain(front_pieces).collect();
        let first_text = taken.len();
        let mut free = Free::new(4.0, taken, first_text);
        let mut put = |text, at: [f64; 2], from| {
            let size = [width_of(text, TEXT), 1.2 * TEXT];
            Some((text, free.take(at, size, &FRAME)?, from))
        };
        let names = self.bounds.iter().zip(&bounds);
        let names = names.map(|((_, name), height)| {
            (
                &name[..],
                [right - 0.5 * width_of(name, TEXT) - 8.0, height - TEXT],
                None,
            )
        });
        let labels = points().map(|point| (&point.label[..], place(point), Some(place(point))));
        let texts = names
            .chain(labels)
            .filter_map(|(text, at, from)| put(text, at, from));
        let texts: Vec<(&str, Place, Option<[f64; 2]>)> = texts.collect();
        let front = front.iter().map(|[x, y]| format!("{x:.1},{y:.1}"));
        let front: Vec<String> = front.collect();
        html! {
            svg xmlns="http://www.w3.org/2000/svg" width=(SIZE[0]) height=(SIZE[1]) viewBox={ "0 0 " (SIZE[0]) " " (SIZE[1]) }
                font-family="sans-serif" fill="currentColor" role="img" {
                title { (self.title) }
                @if file { style { (FILE_STYLE) } }
                (text([16.0, 24.0], "start", 16.0, &shortened(&self.title, SIZE[0] - 32.0, 16.0)))
                (text([16.0, 46.0], "start", TEXT, &self.axes[1]))
                @for tick in x.ticks(10) {
                    (line([[x_of(tick), top], [x_of(tick), bottom]], 0.15, ""))
                    (text([x_of(tick), bottom + 20.0], "middle", TEXT, &significant_digits(tick, 1)))
                }
                @for tick in y.ticks(12) {
                    (line([[left, y_of(tick)], [right, y_of(tick)]], 0.15, ""))
                    (text([left - 8.0, y_of(tick) + 0.35 * TEXT], "end", TEXT, &format!("{} %", significant_digits(100.0 * tick, 1))))
                }
                (line([[left, top], [left, bottom]], 0.6, ""))
                (line([[left, bottom], [right, bottom]], 0.6, ""))
                (text([right, bottom + 38.0], "end", TEXT, &self.axes[0]))
                @for (k, key) in self.keys.iter().flatten().enumerate() {
                    (text([16.0, bottom + 60.0 + 17.0 * k as f64], "start", TEXT, key))
                }
                @for height in bounds { (line([[left, height], [right, height]], 0.7, "6 4")) }
                @if !front.is_empty() { polyline points=(front.join(" ")) fill="none" stroke=(ACCENT) stroke-width="1.5" {} }
                @for point in points().rev() { (mark(point, place(point), &x_of)) }
                @for (label, label_box, from) in &texts {
                    @if let Some(from) = from { (leader_line(*from, label_box)) }
                    (text([0.5 * (label_box[0] + label_box[2]), label_box[1] + 0.95 * TEXT], "middle", TEXT, label))
                }
            }
        }
    }
}

/// Colour of marked points, legible on white and on black.
const ACCENT: &str = "#2f81d0";

const FILE_STYLE: &str = "svg{color:#222;background:#fff}@media(prefers-color-scheme:dark){svg{color:#ddd;background:#16181c}}";

/// Radius of a mark.
const RADIUS: f64 = 4.5;

/// Returns the box of the mark of a point: around a disc or a square, above a triangle.
fn mark_box(point: &Point, [x, y]: [f64; 2]) -> Place {
    const ROOM: f64 = RADIUS + 2.0;
    let above = ROOM * if point.error.is_some() { 1.0 } else { 2.0 };
    [x - ROOM, y - above, x + ROOM, y + ROOM]
}

/// Estimates the width of a text in DejaVu Sans, the widest common font.
fn width_of(text: &str, size: f64) -> f64 {
    0.64 * size * text.chars().count() as f64
}

/// Shortens a text to a width.
fn shortened(text: &str, width: f64, size: f64) -> String {
    let text = escape_controls(text);
    let fits = (width / width_of("m", size)) as usize;
    match text.chars().count() > fits {
        true => text.chars().take(fits - 1).chain(['…']).collect(),
        false => text,
    }
}

fn text([x, y]: [f64; 2], anchor: &str, size: f64, text: &str) -> Markup {
    html! {
        text x=(format_args!("{x:.1}")) y=(format_args!("{y:.1}")) text-anchor=(anchor) font-size=(size) { (text) }
    }
}

fn line([from, to]: [[f64; 2]; 2], opacity: f64, dashes: &str) -> Markup {
    let path = format!("M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1]);
    html! { path d=(path) stroke="currentColor" stroke-opacity=(opacity) stroke-dasharray=[(!dashes.is_empty()).then_some(dashes)] {} }
}

/// Draws a line from a mark to its label, if the label is not adjacent.
fn leader_line(from: [f64; 2], label: &Place) -> Markup {
    let to = [
        from[0].clamp(label[0], label[2]),
        from[1].clamp(label[1], label[3]),
    ];
    let is_far = (to[0] - from[0]).hypot(to[1] - from[1]) > 2.5 * RADIUS;
    html! { @if is_far { (line([from, to], 0.4, "")) } }
}

fn mark(point: &Point, [x, y]: [f64; 2], x_of: &dyn Fn(f64) -> f64) -> Markup {
    let colour = if point.is_marked {
        ACCENT
    } else {
        "currentColor"
    };
    let fill = if point.is_marked { ACCENT } else { "none" };
    let shape = match (point.error, point.is_square) {
        (None, _) => "m0 0l-5 -11h10z".to_owned(),
        (_, true) => format!("m{0} {0}h-{1}v-{1}h{1}z", RADIUS, 2.0 * RADIUS),
        (_, false) => format!(
            "m-{0} 0a{0} {0} 0 1 0 {1} 0a{0} {0} 0 1 0 -{1} 0z",
            RADIUS,
            2.0 * RADIUS
        ),
    };
    let ends = [1.0 / (1.0 + point.noise), 1.0 + point.noise];
    html! {
        @if point.noise > 0.0 { (line(ends.map(|part| [x_of(part * point.cost), y]), 0.5, "")) }
        path class="mark" d=(format_args!("M{x:.1} {y:.1}{shape}")) fill=(fill) stroke=(colour) stroke-width="1.5" {
            title { (point.label) " " (point.name) }
        }
    }
}
