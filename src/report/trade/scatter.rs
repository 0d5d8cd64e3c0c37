//! Points over two logarithmic axes as SVG, with names of which none lies over another or over the edge.
//!
//! What a text takes is reckoned with a wide letter, so that it holds in any font without serifs.

use super::super::html::escaped;
use super::super::text::visible;

/// Size of the drawing, in its own units.
pub const SIZE: [f64; 2] = [960.0, 600.0];

/// Left, top, right and bottom of what is between the axes; to the right of it is the legend.
const FRAME: [f64; 4] = [84.0, 64.0, 724.0, 536.0];

/// Width of a letter, in parts of the size of a text: none in DejaVu Sans, the widest in use, is wider on the average of a name.
pub const LETTER: f64 = 0.64;

/// A line of text reaches so far above and below where it stands, in parts of its size: that of DejaVu Sans.
const ASCENT: f64 = 0.95;
/// See [`ASCENT`].
const DESCENT: f64 = 0.25;

/// Sizes of names and of all other text.
const NAME: f64 = 12.0;
/// See [`NAME`].
const TEXT: f64 = 12.5;

/// Radius of a mark, and of what is kept free around it.
const RADIUS: f64 = 4.5;
/// Marks that are closer than this lie over each other.
const APART: f64 = 2.0 * RADIUS + 2.0;
/// Room between a mark and its name.
const GAP: f64 = 8.0;

/// Distances from its mark at which a name is tried, and directions; farther than the first a line leads to it.
const DISTANCES: [f64; 8] = [GAP, 16.0, 28.0, 42.0, 58.0, 78.0, 102.0, 130.0];
/// See [`DISTANCES`].
const DIRECTIONS: usize = 16;

/// One colour a group, in their order; after the last it begins again.
const COLOURS: [&str; 10] = [
    "#1f77b4", "#d62728", "#2ca02c", "#ff7f0e", "#9467bd", "#8c564b", "#e377c2", "#17becf",
    "#a0a020", "#464646",
];

/// What a mark looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// A disc.
    Disc,
    /// A square.
    Square,
    /// A stroke at the lower edge, of what has a place along x only.
    Edge,
}

/// A point.
#[derive(Debug, Clone)]
pub struct Mark {
    /// Where it is; one whose y is not above the lower edge stands at it, hollow.
    pub at: [f64; 2],
    /// Number of its colour.
    pub colour: usize,
    /// Its form.
    pub shape: Shape,
    /// Half range of x, in parts of it; 0 for what is exact.
    pub noise: f64,
    /// Its name; left out where there is no room for it.
    pub name: Option<String>,
    /// Whether it is named beside another one that is: others are not told apart there.
    pub is_named_anyhow: bool,
}

/// What is drawn.
#[derive(Debug, Clone, Default)]
pub struct Scatter {
    /// Above it.
    pub title: String,
    /// What goes to the right, and upwards.
    pub axes: [String; 2],
    /// Lines at a height, with what they are.
    pub levels: Vec<(f64, String)>,
    /// The marks, of which those that come first are named first.
    pub marks: Vec<Mark>,
    /// A line through points.
    pub line: Vec<[f64; 2]>,
    /// What colours and shapes stand for.
    pub legend: Vec<(usize, Shape, bool, String)>,
    /// The lowest height that is drawn as it is.
    pub floor: f64,
}

/// Left, top, right and bottom.
type Place = [f64; 4];

fn meet(a: &Place, b: &Place) -> bool {
    a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3]
}

fn inside(a: &Place, frame: &Place) -> bool {
    a[0] >= frame[0] && a[1] >= frame[1] && a[2] <= frame[2] && a[3] <= frame[3]
}

/// True if the line between two points passes through a box: that of its pieces does whose length is below that of a letter.
fn crosses(from: [f64; 2], to: [f64; 2], a: &Place) -> bool {
    let length = (to[0] - from[0]).hypot(to[1] - from[1]);
    let pieces = (length / 2.0).ceil().max(1.0) as usize;
    (0..=pieces).any(|k| {
        let part = k as f64 / pieces as f64;
        let [x, y] = [0, 1].map(|d| from[d] + part * (to[d] - from[d]));
        x > a[0] && x < a[2] && y > a[1] && y < a[3]
    })
}

/// Logarithmic values along a side of the frame.
struct Axis {
    values: [f64; 2],
    places: [f64; 2],
}

impl Axis {
    /// With a margin, in parts of the side, on both ends.
    fn of(values: impl Iterator<Item = f64>, places: [f64; 2], margin: f64) -> Axis {
        let found = values.filter(|value| *value > 0.0 && value.is_finite());
        let (low, high) = found.fold((f64::INFINITY, 0.0f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        // Without points there is still a chart to look at.
        let (low, high) = if low < high {
            (low.ln(), high.ln())
        } else if low.is_finite() {
            (low.ln() - 1.0, low.ln() + 1.0)
        } else {
            (-2.0, 2.0)
        };
        let room = margin * (high - low);
        Axis {
            values: [low - room, high + room].map(f64::exp),
            places,
        }
    }

    fn place(&self, value: f64) -> f64 {
        let [low, high] = self.values.map(f64::ln);
        let part = ((value.ln() - low) / (high - low)).clamp(0.0, 1.0);
        self.places[0] + part * (self.places[1] - self.places[0])
    }

    /// Round values, as few as tell the scale.
    fn ticks(&self) -> Vec<f64> {
        const ENOUGH: usize = 4;
        const MOST: usize = 9;
        let [low, high] = self.values;
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let of = |digits: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|decade| {
                digits
                    .iter()
                    .map(move |digit| format!("{digit}e{decade}").parse().unwrap_or(0.0))
            });
            all.filter(|tick| (low..=high).contains(tick)).collect()
        };
        let finer: [&[f64]; 4] = [
            &[1.0],
            &[1.0, 3.0],
            &[1.0, 2.0, 5.0],
            &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0],
        ];
        let mut ticks = of(finer[0]);
        for digits in &finer[1..] {
            if ticks.len() < ENOUGH {
                ticks = of(digits);
            }
        }
        let every = ticks.len().div_ceil(MOST).max(1);
        ticks.into_iter().step_by(every).collect()
    }
}

/// A drawing that is being made: its text, and what the places of names are taken by.
struct Canvas {
    svg: String,
    names: Vec<Place>,
    /// Lines to names.
    leads: Vec<[[f64; 2]; 2]>,
    /// What a name should not lie over if there is another place: marks, and lines.
    marks: Vec<Place>,
    lines: Vec<[[f64; 2]; 2]>,
}

/// Width of a text, and more than that of most.
fn width_of(text: &str, size: f64) -> f64 {
    LETTER * size * text.chars().count() as f64
}

impl Canvas {
    fn text(&mut self, at: [f64; 2], anchor: &str, size: f64, colour: &str, text: &str) {
        self.svg += &format!(
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" font-size=\"{size}\" fill=\"{colour}\">{}</text>\n",
            at[0],
            at[1],
            escaped(text)
        );
    }

    fn line(&mut self, [from, to]: [[f64; 2]; 2], colour: &str, dashes: &str) {
        self.svg += &format!(
            "<line x1=\"{:.1}\" y1=\"{:.1}\" x2=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-dasharray=\"{dashes}\"/>\n",
            from[0], from[1], to[0], to[1]
        );
    }

    fn mark(&mut self, [x, y]: [f64; 2], colour: usize, shape: Shape, hollow: bool) {
        let colour = COLOURS[colour % COLOURS.len()];
        let fill = if hollow { "#ffffff" } else { colour };
        let style = format!("fill=\"{fill}\" stroke=\"{colour}\" stroke-width=\"1.5\"");
        self.svg += &match shape {
            Shape::Disc => {
                format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{RADIUS}\" {style}/>\n")
            }
            Shape::Square => {
                let (left, top, side) = (x - RADIUS, y - RADIUS, 2.0 * RADIUS);
                format!(
                    "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{side}\" height=\"{side}\" {style}/>\n"
                )
            }
            Shape::Edge => format!("<path d=\"M{x:.1} {y:.1}l-5 -12h10z\" {style}/>\n"),
        };
    }

    /// Puts a name beside its mark, where it lies over nothing; over a mark or a line if there is no such place, and nowhere if there is
    /// none without another name.
    fn name(&mut self, at: [f64; 2], colour: &str, text: &str) {
        const INSET: f64 = 3.0;
        let frame = [
            FRAME[0] + INSET,
            FRAME[1] + INSET,
            FRAME[2] - INSET,
            FRAME[3] - INSET,
        ];
        let width = width_of(text, NAME);
        let height = (ASCENT + DESCENT) * NAME;
        let places: Vec<(Place, [f64; 2])> = DISTANCES
            .iter()
            .flat_map(|distance| (0..DIRECTIONS).map(move |k| (*distance, k)))
            .map(|(distance, k)| {
                // To the right and above first, where a front of what is best has nothing.
                let turn = std::f64::consts::TAU * (k as f64 + 1.0) / DIRECTIONS as f64;
                let (dx, dy) = (turn.cos(), -turn.sin());
                let [x, y] = [at[0] + distance * dx, at[1] + distance * dy];
                // The nearest point of the box is the one on the ray.
                let left = x - width * (0.5 - 0.5 * dx.signum() * (2.0 * dx.abs()).min(1.0));
                let top = y - height * (0.5 - 0.5 * dy.signum() * (2.0 * dy.abs()).min(1.0));
                ([left, top, left + width, top + height], [x, y])
            })
            .collect();
        let allowed = |(place, end): &&(Place, [f64; 2])| {
            let lead = crosses_none(&self.names, at, *end);
            inside(place, &frame)
                && lead
                && !self.names.iter().any(|other| meet(place, other))
                && !(self.leads.iter()).any(|[from, to]| crosses(*from, *to, place))
        };
        let free = |(place, _): &&(Place, [f64; 2])| {
            !self.marks.iter().any(|other| meet(place, other))
                && !(self.lines.iter()).any(|[from, to]| crosses(*from, *to, place))
        };
        let mut found = places.iter().filter(allowed);
        let best = found.clone().find(free).or_else(|| found.next());
        let Some(&(place, end)) = best else {
            return;
        };
        if (end[0] - at[0]).hypot(end[1] - at[1]) > 1.5 * GAP {
            self.leads.push([at, end]);
            self.line([at, end], "#999999", "none");
        }
        self.names.push(place);
        let line = [place[0], place[1] + ASCENT * NAME];
        self.text(line, "start", NAME, colour, text);
    }
}

fn crosses_none(boxes: &[Place], from: [f64; 2], to: [f64; 2]) -> bool {
    !boxes.iter().any(|other| crosses(from, to, other))
}

impl Scatter {
    /// The drawing as an SVG of its own.
    pub fn svg(&self) -> String {
        let marks = || self.marks.iter();
        let x = Axis::of(marks().map(|m| m.at[0]), [FRAME[0], FRAME[2]], 0.08);
        let heights = marks()
            .filter(|mark| mark.shape != Shape::Edge)
            .map(|mark| mark.at[1]);
        let heights = heights.filter(|y| *y >= self.floor);
        let levels = self.levels.iter().map(|(level, _)| *level);
        let y = Axis::of(heights.chain(levels), [FRAME[3], FRAME[1]], 0.08);
        let mut canvas = Canvas {
            svg: format!(
                "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\" \
                 font-family=\"sans-serif\" role=\"img\">\n<title>{2}</title>\n<rect width=\"{0}\" height=\"{1}\" fill=\"#ffffff\"/>\n",
                SIZE[0],
                SIZE[1],
                escaped(&self.title)
            ),
            names: Vec::new(),
            leads: Vec::new(),
            marks: Vec::new(),
            lines: Vec::new(),
        };
        self.scales(&mut canvas, &x, &y);
        let place = |at: [f64; 2]| [x.place(at[0]), y.place(at[1])];
        for (level, _) in &self.levels {
            let height = y.place(*level);
            let ends = [[FRAME[0], height], [FRAME[2], height]];
            canvas.line(ends, "#787878", "none");
            canvas.lines.push(ends);
        }
        for pair in self.line.windows(2) {
            let ends = [place(pair[0]), place(pair[1])];
            canvas.line(ends, "#000000", "none");
            canvas.lines.push(ends);
        }
        let spot = |mark: &Mark| match mark.shape {
            Shape::Edge => [x.place(mark.at[0]), FRAME[3]],
            // Of what has no logarithm, or less than is drawn.
            _ if mark.at[1] < self.floor || mark.at[1] < y.values[0] => {
                [x.place(mark.at[0]), FRAME[3]]
            }
            _ => place(mark.at),
        };
        // Those that are named first lie above others.
        for mark in marks().rev() {
            let at = spot(mark);
            if mark.noise > 0.0 {
                let ends = [1.0 / (1.0 + mark.noise), 1.0 + mark.noise];
                let ends = ends.map(|part| [x.place(mark.at[0] * part), at[1]]);
                canvas.line(ends, COLOURS[mark.colour % COLOURS.len()], "none");
            }
            let hollow = mark.shape != Shape::Edge && at[1] == FRAME[3];
            canvas.mark(at, mark.colour, mark.shape, hollow);
            let room = RADIUS + 2.0;
            canvas.marks.push([
                at[0] - room,
                at[1]
                    - if mark.shape == Shape::Edge {
                        13.0
                    } else {
                        room
                    },
                at[0] + room,
                at[1] + room,
            ]);
        }
        for (level, name) in &self.levels {
            let at = [FRAME[2] - width_of(name, NAME) - 16.0, y.place(*level)];
            canvas.name(at, "#555555", name);
        }
        let mut named: Vec<[f64; 2]> = Vec::new();
        for mark in marks() {
            let at = spot(mark);
            let beside = |other: &[f64; 2]| (other[0] - at[0]).hypot(other[1] - at[1]) < APART;
            if let Some(name) = &mark.name
                && (mark.is_named_anyhow || !named.iter().any(beside))
            {
                canvas.name(at, "#000000", name);
                named.push(at);
            }
        }
        canvas.svg += "</svg>\n";
        // What XML does not allow at all is made visible.
        visible(&canvas.svg)
    }

    /// Frame, ticks, titles and legend.
    fn scales(&self, canvas: &mut Canvas, x: &Axis, y: &Axis) {
        let [left, top, right, bottom] = FRAME;
        let (ink, grid) = ("#222222", "#e4e4e4");
        let mut free = 0.0;
        for tick in x.ticks() {
            let (at, text) = (x.place(tick), short(tick));
            canvas.line([[at, top], [at, bottom]], grid, "none");
            let half = 0.5 * width_of(&text, TEXT);
            // Values of a decade stand the closer the larger they are.
            if at - half > free {
                canvas.text([at, bottom + 22.0], "middle", TEXT, ink, &text);
                free = at + half;
            }
        }
        let mut free = SIZE[1];
        for tick in y.ticks() {
            let at = y.place(tick);
            canvas.line([[left, at], [right, at]], grid, "none");
            let line = at + 0.35 * TEXT;
            if line + DESCENT * TEXT < free {
                let text = format!("{} %", short(100.0 * tick));
                canvas.text([left - 8.0, line], "end", TEXT, ink, &text);
                free = line - ASCENT * TEXT;
            }
        }
        canvas.svg += &format!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#808080\"/>\n",
            right - left,
            bottom - top
        );
        let fits = (SIZE[0] / (LETTER * 16.0)) as usize - 2;
        let title = visible(&self.title);
        let title = match title.chars().count() > fits {
            true => title.chars().take(fits - 1).chain(['…']).collect(),
            false => title,
        };
        canvas.text([16.0, 26.0], "start", 16.0, ink, &title);
        canvas.text([16.0, 50.0], "start", TEXT, ink, &self.axes[1]);
        let middle = [0.5 * (left + right), bottom + 48.0];
        canvas.text(middle, "middle", TEXT, ink, &self.axes[0]);
        let step = ((bottom - top) / self.legend.len().max(1) as f64).min(22.0);
        for (k, (colour, shape, hollow, text)) in self.legend.iter().enumerate() {
            let at = [right + 22.0, top + 10.0 + step * k as f64];
            let down = if *shape == Shape::Edge { 6.0 } else { 0.0 };
            canvas.mark([at[0], at[1] + down], *colour, *shape, *hollow);
            canvas.text(
                [at[0] + 14.0, at[1] + 0.35 * TEXT],
                "start",
                TEXT,
                ink,
                text,
            );
        }
    }
}

/// Three significant digits at most, without zeros at the end.
fn short(value: f64) -> String {
    let rounded: f64 = format!("{value:.2e}").parse().unwrap_or(value);
    if (1e-5..1e6).contains(&rounded) {
        rounded.to_string()
    } else {
        format!("{rounded:e}")
    }
}
