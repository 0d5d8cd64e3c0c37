//! A trade for a person: one table, one chart and what follows from them, in a terminal, as Markdown and as one HTML file.

use maud::{DOCTYPE, PreEscaped, html};

use super::super::quantity::digits;
use super::super::table::table;
use super::super::text;
use super::super::text::NONE;
use super::chart::{Chart, FLOOR, Point};
use super::findings::CONVERGED;
use super::scenes::{FigureCount, Miss, Tally, misses, tallies};
use super::{Cost, FIELD, FIGURES, Findings, KnobEffect, Row, Trade, findings};
use crate::recipe::MotionKind;
use crate::scene::variants::{BALANCED, FAST, KnobKind, REFERENCE, promise};

/// A table.
#[derive(Debug, Clone)]
struct Sheet {
    heading: &'static str,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// The first columns name a row, the last of them by words. A table that is wider than the terminal repeats them.
    names: usize,
}

/// Cells of a row under their heads.
type Cells = Vec<(&'static str, Option<String>)>;

impl Sheet {
    /// A table of rows with the same heads. A column without any value is left out.
    fn of(heading: &'static str, names: usize, rows: &[Cells]) -> Sheet {
        let heads = rows.first().map_or(0, Vec::len);
        let is_there = |k: &usize| rows.iter().any(|row| row[*k].1.is_some());
        let columns: Vec<usize> = (0..heads).filter(is_there).collect();
        let cell = |row: &Cells, k: usize| row[k].1.clone().unwrap_or(NONE.to_owned());
        let cells = |row| columns.iter().map(|k| cell(row, *k)).collect();
        Sheet {
            heading,
            head: columns.iter().map(|k| rows[0][*k].0.to_owned()).collect(),
            rows: rows.iter().map(cells).collect(),
            names,
        }
    }

    /// Blocks of columns that fit into a width, each column as wide as its widest cell.
    fn text(&self, escape: fn(&str) -> String, width: usize) -> String {
        let cells = |row: &Vec<String>| -> Vec<String> {
            row.iter().map(|cell| text::cell(&escape(cell))).collect()
        };
        let lines: Vec<Vec<String>> = [&self.head]
            .into_iter()
            .chain(&self.rows)
            .map(cells)
            .collect();
        let width_of = |k: usize| {
            let widths = lines.iter().map(|line| line[k].chars().count());
            widths.max().unwrap_or(0).max(3)
        };
        let widths: Vec<usize> = (0..self.head.len()).map(width_of).collect();
        let is_left = |k: usize| k + 1 == self.names;
        let mut text = String::new();
        let mut next = self.names;
        while next < self.head.len() {
            let mut columns: Vec<usize> = (0..self.names).collect();
            let mut taken: usize = 1 + columns.iter().map(|k| widths[*k] + 3).sum::<usize>();
            while next < self.head.len()
                && (columns.len() == self.names || taken + widths[next] + 3 <= width)
            {
                taken += widths[next] + 3;
                columns.push(next);
                next += 1;
            }
            let joined = |cell: &dyn Fn(usize) -> String| {
                let cells: Vec<String> = columns.iter().map(|k| cell(*k)).collect();
                format!("|{}|\n", cells.join("|"))
            };
            text.push('\n');
            for (k, line) in lines.iter().enumerate() {
                text += &joined(&|k| match is_left(k) {
                    true => format!(" {:<1$} ", line[k], widths[k]),
                    false => format!(" {:>1$} ", line[k], widths[k]),
                });
                if k == 0 {
                    text += &joined(&|k| match is_left(k) {
                        true => "-".repeat(widths[k] + 2),
                        false => "-".repeat(widths[k] + 1) + ":",
                    });
                }
            }
        }
        text
    }
}

/// A trade for a person. Its text is as it is given, and escaped where it is written.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    intro: String,
    chart: Chart,
    sheets: Vec<Sheet>,
    lists: Vec<(&'static str, Vec<String>)>,
}

impl Page {
    /// As Markdown.
    pub fn markdown(&self) -> String {
        self.text(text::markdown, None)
    }

    /// As a terminal shows it, in lines of at most `width` characters as far as a table allows.
    pub fn plain(&self, width: Option<usize>) -> String {
        self.text(text::one_line, width)
    }

    fn text(&self, escape: fn(&str) -> String, width: Option<usize>) -> String {
        /// Of the chart. Four spaces before a line keep it from being set as Markdown.
        const WIDTHS: [usize; 3] = [60, 100, 160];
        const INDENT: &str = "    ";
        let chart = width.unwrap_or(WIDTHS[1]).clamp(WIDTHS[0], WIDTHS[2]);
        let chart = self.chart.text(chart - INDENT.len());
        let chart = chart.lines().map(|line| format!("{INDENT}{line}\n"));
        let chart: String = chart.collect();
        let mut text = format!("{}\n\n{chart}", escape(&self.intro));
        for sheet in &self.sheets {
            if !sheet.heading.is_empty() {
                text += &format!("\n**{}**\n", sheet.heading);
            }
            text += &sheet.text(escape, width.unwrap_or(usize::MAX));
        }
        for (heading, items) in self.lists() {
            text += &format!("\n**{heading}**\n\n");
            for item in items {
                text += &format!("- {}\n", escape(item));
            }
        }
        text
    }

    fn lists(&self) -> impl Iterator<Item = &(&'static str, Vec<String>)> {
        self.lists.iter().filter(|(_, items)| !items.is_empty())
    }

    /// The chart as an SVG file.
    pub fn svg(&self) -> String {
        // XML does not allow control characters, not even escaped.
        text::visible(&self.chart.svg(true).into_string()) + "\n"
    }

    /// As one HTML file that needs no other.
    pub fn html(&self) -> String {
        let page = html! {
            (DOCTYPE)
            html lang="en" {
                head {
                    meta charset="utf-8";
                    meta name="viewport" content="width=device-width";
                    title { (self.title) }
                    style { (PreEscaped(STYLE)) }
                }
                body {
                    h1 { (self.title) }
                    p { (self.intro) }
                    div class="wide" { (self.chart.svg(false)) }
                    @for sheet in &self.sheets {
                        @if !sheet.heading.is_empty() { h2 { (sheet.heading) } }
                        div class={ "names" (sheet.names) } { (table(&sheet.head, &sheet.rows, true)) }
                    }
                    @for (heading, items) in self.lists() {
                        h2 { (heading) }
                        ul { @for item in items { li { (item) } } }
                    }
                }
            }
        };
        text::visible(&page.into_string()) + "\n"
    }
}

/// Heads break into lines, so that a table of all figures is as wide as its numbers. A narrower window scrolls the table in a box that
/// keeps number and name of a row in view, and shows by a shadow that there is more.
const STYLE: &str = ":root{color-scheme:light dark;--ink:#222;--paper:#fff;--rule:#ddd}\
@media(prefers-color-scheme:dark){:root{--ink:#ddd;--paper:#16181c;--rule:#3a3d42}}\
body{font:15px/1.5 sans-serif;color:var(--ink);background:var(--paper);max-width:84em;margin:1.5em auto;padding:0 1em}\
.wide{overflow-x:auto;background:linear-gradient(90deg,transparent,var(--paper) 70%) right/40px 100% no-repeat local,\
radial-gradient(farthest-side at 100% 50%,#8888,transparent) right/14px 100% no-repeat scroll}svg{max-width:100%;min-width:34em;height:auto}\
table{border-collapse:collapse;font-size:13px;line-height:1.35;font-variant-numeric:tabular-nums}\
th,td{padding:.3em .5em;text-align:right;border-bottom:1px solid var(--rule);white-space:nowrap}\
th{vertical-align:bottom;white-space:normal}\
.names1 :is(th,td):nth-child(1),.names2 :is(th,td):nth-child(-n+2){position:sticky;left:0;text-align:left;background:var(--paper)}\
.names2 :is(th,td):nth-child(1){text-align:right;min-width:2.6em}.names2 :is(th,td):nth-child(2){left:3.6em}\
h1{font-size:22px}h2{font-size:17px;margin:1.4em 0 .4em}\
@media(max-width:40em){.names2 :is(th,td):nth-child(2){position:static}}\
@page{size:landscape}@media print{.wide{overflow:visible}table{font-size:7pt}}";

/// A run as the chart and the table show it.
struct Entry<'a> {
    trade: &'a Trade,
    row: &'a Row,
    point: Point,
    /// False without a known error, but for the reference of a scene.
    has_point: bool,
}

/// All runs, numbered through. Marked are those on the front of a scene; of several scenes, those that break their promise.
fn entries(trades: &[Trade], of_scenes: bool) -> Vec<Entry<'_>> {
    let rows = trades.iter();
    let rows = rows.flat_map(|trade| trade.rows.iter().map(move |row| (trade, row)));
    let entry = |(k, (trade, row))| entry(k + 1, trade, row, of_scenes);
    rows.enumerate().map(entry).collect()
}

fn entry<'a>(number: usize, trade: &'a Trade, row: &'a Row, of_scenes: bool) -> Entry<'a> {
    let variant = &row.variant;
    let is_reference = variant.name == REFERENCE;
    let [is_marked, is_square] = match of_scenes {
        true => [is_kept(row) == Some(false), variant.name == FAST],
        false => [row.pareto, variant.kind == KnobKind::Preset],
    };
    let point = Point {
        label: format!("{number}{}", if is_marked { "*" } else { "" }),
        name: match variant.kind {
            _ if of_scenes => format!("{}, {}", trade.name, variant.name),
            KnobKind::Preset | KnobKind::Repeat => variant.value.clone(),
            _ => format!("{} = {}", variant.knob, variant.value),
        },
        cost: if of_scenes { row.fft_pairs } else { row.cost },
        error: row.worst.filter(|_| !is_reference),
        noise: match trade.by {
            Cost::Seconds if !of_scenes => trade.noise.unwrap_or(0.0),
            _ => 0.0,
        },
        is_square,
        is_marked,
    };
    Entry {
        trade,
        row,
        has_point: match is_reference {
            true => !of_scenes && row.failure.is_none(),
            false => row.is_compared() && row.worst.is_some() && !(of_scenes && point.cost <= 0.0),
        },
        point,
    }
}

/// Whether a preset keeps its promise; none if it makes none, or cannot be compared.
fn is_kept(row: &Row) -> Option<bool> {
    Some(row.worst? <= promise(&row.variant.name)?)
}

fn chart(title: String, cost: String, entries: &[Entry], of_scenes: bool) -> Chart {
    let mut shown: Vec<&Entry> = entries.iter().filter(|entry| entry.has_point).collect();
    shown.sort_by_key(|e| (e.row.variant.kind != KnobKind::Preset, !e.point.is_marked));
    let points: Vec<Point> = shown.into_iter().map(|entry| entry.point.clone()).collect();
    let keys = match of_scenes {
        true => ["*: breaks its promise.", "Discs: balanced. Squares: fast."],
        false => [
            "*: no other variant both costs less and is more exact (Pareto front).",
            "Squares: presets. Discs: one knob turned.",
        ],
    };
    let mut keys = keys.map(|key| vec![key.to_owned()]);
    keys[0].retain(|_| points.iter().any(|point| point.is_marked));
    if points.iter().any(|point| point.error.is_none()) {
        keys[0].push("reference is at the lower edge: its error is not known.".to_owned());
    }
    if points.iter().any(|p| p.error.is_some_and(|e| e < FLOOR)) {
        let floor = percent(FLOOR);
        keys[0].push(format!("Errors below {floor} are at the lower edge too."));
    }
    let bound = |name| {
        let bound = promise(name)?;
        Some((bound, format!("promise of {name}: {}", percent(bound))))
    };
    let error = "largest deviation from reference among the promised figures";
    Chart {
        title,
        axes: [cost, error.to_owned()],
        bounds: [FAST, BALANCED].into_iter().filter_map(bound).collect(),
        points,
        has_front: !of_scenes,
        keys,
    }
}

/// The table of all runs.
fn runs(entries: &[Entry], of_scenes: bool) -> Sheet {
    let has_cpu = entries.iter().all(|entry| entry.trade.has_cpu());
    let clock = ["wall seconds", "CPU seconds"][usize::from(has_cpu)];
    let cells = |entry: &Entry| {
        let Entry {
            trade, row, point, ..
        } = entry;
        let error = |error: Option<f64>| error.filter(|_| row.variant.name != REFERENCE);
        let motion = of_scenes.then(|| trade.motion.word().to_owned());
        let cpu = row.cpu_seconds.filter(|_| has_cpu);
        let weighed = !of_scenes && is_weighed(trade, row);
        let bound = promise(&row.variant.name).filter(|_| trade.reference().is_some());
        let verdict = match is_kept(row) {
            Some(true) => "pass",
            Some(false) => "FAIL",
            None => "not compared",
        };
        let mut cells = vec![
            ("#", Some(point.label.clone())),
            ("variant", Some(point.name.clone())),
            ("motion", motion),
            ("FFT pairs", Some(format!("{:.0}", row.fft_pairs))),
            ("by their work", weighed.then(|| format!("{:.0}", row.cost))),
            (clock, Some(seconds(cpu.unwrap_or(row.seconds)))),
            ("iterations", Some(row.iterations.to_string())),
            ("memory", Some(format!("{:.0} MB", row.memory as f64 / 1e6))),
            ("largest promised", point.error.map(percent)),
            (
                "promise",
                bound.map(|bound| format!("{}: {verdict}", percent(bound))),
            ),
        ];
        cells.extend(FIGURES.iter().enumerate().map(|(k, figure)| match k {
            FIELD => (figure.title, error(row.errors[k]).map(percent)),
            _ => (figure.title, error(row.errors[k]).map(signed)),
        }));
        cells.push(("own bar of volume", row.bars[0].map(percent)));
        cells.push(("of it closures", row.closure.map(percent)));
        cells
    };
    let rows: Vec<Cells> = entries.iter().map(cells).collect();
    Sheet::of("", 2, &rows)
}

/// True if the pairs of a run are on another grid than those of `balanced`.
fn is_weighed(trade: &Trade, row: &Row) -> bool {
    trade.by == Cost::FftPairs && row.cost != row.fft_pairs
}

/// The variants of a scene. `left_out` is what was not tried, and why.
pub fn page(trade: &Trade, left_out: &[(String, String)]) -> Page {
    let trades = std::slice::from_ref(trade);
    let (name, found, entries) = (&trade.name, findings(trade), entries(trades, false));
    let reasons = left_out.iter().map(|(what, why)| format!("{what}: {why}"));
    let mut lists = lists(trades, &entries);
    lists.push(("What buys most", buys(&found)));
    lists.push(("Convergence with the mesh", convergence(&found)));
    lists.push(("Not tried", reasons.collect()));
    let title = format!("{name}: error against cost");
    Page {
        title: format!("Speed against accuracy: {name}"),
        intro: intro(trade),
        chart: chart(title, cost_axis(trade), &entries, false),
        sheets: vec![runs(&entries, false)],
        lists,
    }
}

/// The presets over several scenes, which have a name together.
pub fn page_of_scenes(name: &str, trades: &[Trade]) -> Page {
    let entries = entries(trades, true);
    let first = trades.iter().find(|trade| trade.machine.is_some());
    let title = format!("{name}: error of the presets against cost");
    Page {
        title: format!("Speed against accuracy: {name}"),
        intro: format!(
            "{name}: the presets over {} scenes. Deviations are from the preset reference of the same scene, whose own error is not known; \
             costs are FFT pairs, which are exact.{}{}",
            trades.len(),
            promised(trades),
            first.map_or(String::new(), machine)
        ),
        chart: chart(title, "FFT pairs of a run".to_owned(), &entries, true),
        sheets: vec![runs(&entries, true), summary(&tallies(trades))],
        lists: lists(trades, &entries),
    }
}

/// The figures that the presets promise, as a sentence after a space.
fn promised(trades: &[Trade]) -> String {
    let is_there = |k: &usize| trades.iter().any(|trade| trade.has(*k));
    let figures = (0..FIGURES.len()).filter(|k| FIGURES[*k].promised);
    let figures = figures.filter(is_there);
    let figures: Vec<&str> = figures.map(|k| FIGURES[k].title).collect();
    match figures.is_empty() {
        true => String::new(),
        false => format!(" The presets promise: {}.", figures.join(", ")),
    }
}

/// What is off, and what is not compared.
fn lists(trades: &[Trade], entries: &[Entry]) -> Vec<(&'static str, Vec<String>)> {
    let line = |miss: &Miss| {
        let is_it = |e: &&Entry| e.trade.name == miss.scene && e.row.variant.name == miss.preset;
        let name = entries
            .iter()
            .find(is_it)
            .map_or("", |entry| &entry.point.name);
        let off = match miss.error {
            Some(error) => against(error, miss.limit),
            None => format!("is zero in reference, ±{}", percent(miss.limit)),
        };
        format!("{name}: {} {off}", miss.figure)
    };
    let [broken, outside] = misses(trades).map(|found| found.iter().map(line).collect());
    let not_compared = entries.iter().filter_map(|entry| {
        let is_lost = entry.point.error.is_none() && entry.row.is_compared();
        let lost = "a promised figure is zero or infinite in the reference";
        let lost = (is_lost && entry.trade.reference().is_some()).then_some(lost);
        let why = entry.row.failure.as_deref().or(lost)?;
        Some(format!("{}: {why}", entry.point.name))
    });
    vec![
        ("Promises broken", broken),
        ("Presets outside their own error bar", outside),
        ("Not compared", not_compared.collect()),
    ]
}

/// The presets by kind of motion.
fn summary(found: &[Tally]) -> Sheet {
    let or_none = |value: Option<f64>| value.map_or(NONE.to_owned(), percent);
    let of_figure = |f: &FigureCount| {
        let [median, worst] = [f.median, f.worst].map(or_none);
        format!("{median} / {worst}; {} of {}", f.within, f.scenes)
    };
    let cells = |tally: &Tally| {
        let Tally {
            preset,
            scenes,
            failed,
            ..
        } = tally;
        let motion = tally.motion.map_or("all", MotionKind::word);
        let compared = match failed {
            0 => scenes.to_string(),
            _ => format!("{scenes} of {}", scenes + failed),
        };
        let [median, worst] = [tally.median, tally.worst].map(or_none);
        let mut cells = vec![
            ("preset, motion", Some(format!("{preset}, {motion}"))),
            ("scenes", Some(compared)),
            (
                "of the FFT pairs of reference",
                tally.pairs_part.map(percent),
            ),
            (
                "keep the promise",
                Some(format!("{} of {scenes}", tally.kept)),
            ),
            ("median / largest", Some(format!("{median} / {worst}"))),
            ("in scene", tally.worst_scene.clone()),
        ];
        cells.extend(FIGURES.iter().map(|figure| {
            let found = tally.figures.iter().find(|f| f.figure == figure.title);
            (figure.title, found.map(of_figure))
        }));
        cells
    };
    let rows: Vec<Cells> = found.iter().map(cells).collect();
    let heading = "Presets by kind of motion: median / largest deviation; scenes in which a figure is within its own error bar";
    Sheet::of(heading, 1, &rows)
}

fn intro(trade: &Trade) -> String {
    let seconds = match (trade.noise, trade.has_cpu()) {
        (Some(noise), cpu) => format!(
            "{} seconds are of the stages of a run, and known to ±{}: by so much the iterations of balanced differ when it is run again.",
            if cpu { "CPU" } else { "Wall" },
            percent(noise)
        ),
        (None, _) => {
            "How noisy the seconds are is not known, since balanced was not run again.".to_owned()
        }
    };
    let by = match trade.by {
        Cost::FftPairs => "FFT pairs, which are exact, are what costs are compared by.",
        Cost::Seconds => "Costs are compared by seconds, since FFT pairs are not all of the work.",
    };
    format!(
        "{}: cost, and deviation from the variant reference, whose own error is not known. A knob is turned alone, from the preset \
         balanced. {by} {seconds}{}{}",
        trade.name,
        promised(std::slice::from_ref(trade)),
        machine(trade)
    )
}

/// Where a trade was computed, as a sentence after a space.
fn machine(trade: &Trade) -> String {
    trade.machine.as_ref().map_or(String::new(), |machine| {
        let features = machine.cpu_features.last();
        format!(
            " Computed on {} {}{}, {} processors.",
            machine.os,
            machine.architecture,
            features.map_or(String::new(), |name| format!(" with {name}")),
            machine.processors
        )
    })
}

fn cost_axis(trade: &Trade) -> String {
    let clock = if trade.has_cpu() { "CPU" } else { "wall" };
    match (trade.by, trade.noise) {
        (Cost::FftPairs, _) if trade.rows.iter().any(|row| is_weighed(trade, row)) => {
            "FFT pairs, on other grids by their work".to_owned()
        }
        (Cost::FftPairs, _) => "FFT pairs".to_owned(),
        (Cost::Seconds, Some(noise)) => format!("{clock} seconds, noise ±{}", percent(noise)),
        (Cost::Seconds, None) => format!("{clock} seconds, of unknown noise"),
    }
}

fn buys(found: &Findings) -> Vec<String> {
    let least = match (found.by, found.noise) {
        (Cost::FftPairs, _) => 0.0,
        (Cost::Seconds, Some(noise)) => noise,
        (Cost::Seconds, None) => {
            return vec!["Nothing is said of seconds whose noise is not known".to_owned()];
        }
    };
    let is_seconds = found.by == Cost::Seconds;
    let amount = |amount: f64| match is_seconds {
        true => format!("{} s", seconds(amount)),
        false => format!("{amount:.0} FFT pairs"),
    };
    let told = |KnobEffect {
                    knob,
                    value,
                    error,
                    error_before,
                    ..
                }: &KnobEffect,
                cost: String| {
        let [error, before] = [*error, *error_before].map(percent);
        format!("{knob} = {value} {cost}, for an error of {error} in place of {before}")
    };
    let saving = found.savings.iter().map(|saving| {
        let what = saving.buy.as_ref().map(|buy| {
            let (saved, part) = (amount(buy.saved), percent(buy.saved_part));
            told(buy, format!("saves {saved}, {part} of those of balanced"))
        });
        let what = what.unwrap_or_else(|| "no single knob saves anything worth it".to_owned());
        format!("Within {}: {what}", percent(saving.within))
    });
    let accuracy = found.accuracy.as_ref().map(|buy| {
        let cost = match -buy.saved_part {
            more if more > least => format!("costs {} more, {}", amount(-buy.saved), percent(more)),
            _ if is_seconds => "costs no more than noise tells".to_owned(),
            _ => "costs no FFT pair more".to_owned(),
        };
        format!("Most accuracy for its cost: {}", told(buy, cost))
    });
    let accuracy = accuracy
        .unwrap_or_else(|| "No single knob of a solver halves the error of balanced".to_owned());
    let idle = found.without_effect.join(", ");
    let idle = (!idle.is_empty()).then(|| format!("Without any effect: {idle}"));
    saving.chain([accuracy]).chain(idle).collect()
}

fn convergence(found: &Findings) -> Vec<String> {
    let knobs = found.convergence.iter();
    let steps = knobs.flat_map(|knob| knob.steps.iter().map(|step| (knob.knob, step)));
    let lines = steps.map(|(knob, step)| {
        let open = step.not_converged().into_iter();
        let open = open.map(|(title, change)| format!("{title} {}", percent(change.abs())));
        let open: Vec<String> = open.collect();
        let what = match open.is_empty() {
            true => format!("converged, all change by less than {}", percent(CONVERGED)),
            false => format!("not converged: {}", open.join(", ")),
        };
        format!("{knob} {}, against {}: {what}", step.from, step.to)
    });
    lines.collect()
}

/// Three significant digits, to the millisecond at most.
fn seconds(seconds: f64) -> String {
    let decimals = (2.0 - seconds.abs().log10().floor()).clamp(0.0, 3.0);
    format!("{seconds:.*}", decimals as usize)
}

/// A share of a hundred, to two significant digits, or to the whole percent.
fn percent(share: f64) -> String {
    percent_of(share, 2)
}

fn percent_of(share: f64, least: i32) -> String {
    let percent = 100.0 * share;
    if percent == 0.0 {
        return "0".to_owned();
    }
    let whole = percent.abs().log10().floor() as i32 + 1;
    format!("{} %", digits(percent, whole.max(least)))
}

/// The same with its sign.
fn signed(share: f64) -> String {
    format!("{}{}", if share > 0.0 { "+" } else { "" }, percent(share))
}

/// An error with its sign and what it is held against, to as many digits as tell them apart.
fn against(share: f64, limit: f64) -> String {
    const MOST: i32 = 6;
    let told = |digits| [share.abs(), limit].map(|share| percent_of(share, digits));
    let are_apart = |digits: &i32| told(*digits)[0] != told(*digits)[1];
    let [error, limit] = told((2..MOST).find(are_apart).unwrap_or(MOST));
    format!("{}{error}, of {limit}", if share > 0.0 { "+" } else { "−" })
}
