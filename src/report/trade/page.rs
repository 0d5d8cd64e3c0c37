//! Page of a trade with one table, one chart and the findings. The program prints the page as terminal text, and writes
//! the page as Markdown and as HTML.

use maud::{DOCTYPE, PreEscaped, html};

use super::super::quantity::significant_digits;
use super::super::table::table;
use super::super::text;
use super::super::text::NONE;
use super::chart::{Chart, FLOOR, Point};
use super::findings::CONVERGED;
use super::scenes::{FigureCount, Miss, PresetStatistics, misses, tallies};
use super::{Cost, FIELD, FIGURES, Findings, KnobEffect, Row, Trade, findings};
use crate::recipe::MotionKind;
use crate::scene::variants::{BALANCED, FAST, KnobKind, REFERENCE, promise};

/// Table of a page.
#[derive(Debug, Clone)]
struct Sheet {
    heading: &'static str,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    /// Number of columns that name a row. Only the last name column contains text. A table that is wider than the
    /// terminal repeats the name columns.
    names: usize,
}

/// Cells of a row, each with its head.
type Cells = Vec<(&'static str, Option<String>)>;

impl Sheet {
    /// Creates a table of rows with the same heads. Columns without any value are omitted.
    fn new(heading: &'static str, names: usize, rows: &[Cells]) -> Sheet {
        let heads = rows.first().map_or(0, Vec::len);
        let has_value = |k: &usize| rows.iter().any(|row| row[*k].1.is_some());
        let columns: Vec<usize> = (0..heads).filter(has_value).collect();
        let cell = |row: &Cells, k: usize| row[k].1.clone().unwrap_or(NONE.to_owned());
        let cells = |row| columns.iter().map(|k| cell(row, *k)).collect();
        Sheet {
            heading,
            head: columns.iter().map(|k| rows[0][*k].0.to_owned()).collect(),
            rows: rows.iter().map(cells).collect(),
            names,
        }
    }

    /// Returns the table as blocks of columns that fit a width. A column is as wide as its widest cell.
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
            let mut used: usize = 1 + columns.iter().map(|k| widths[*k] + 3).sum::<usize>();
            while next < self.head.len()
                && (columns.len() == self.names || used + widths[next] + 3 <= width)
            {
                used += widths[next] + 3;
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

/// Page of a trade. The page stores raw text and escapes the text on output.
#[derive(Debug, Clone)]
pub struct Page {
    title: String,
    intro: String,
    chart: Chart,
    sheets: Vec<Sheet>,
    lists: Vec<(&'static str, Vec<String>)>,
}

impl Page {
    /// Returns the page as Markdown.
    pub fn markdown(&self) -> String {
        self.text(text::markdown, None)
    }

    /// Returns the page as text for a terminal, in lines of at most `width` characters if the tables allow it.
    pub fn plain(&self, width: Option<usize>) -> String {
        self.text(text::one_line, width)
    }

    fn text(&self, escape: fn(&str) -> String, width: Option<usize>) -> String {
        /// Widths of the chart. The indent of four spaces makes it a code block in Markdown.
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

    /// Returns the chart as an SVG file.
    pub fn svg(&self) -> String {
        // XML does not allow control characters, not even escaped ones.
        text::escape_controls(&self.chart.svg(true).into_string()) + "\n"
    }

    /// Returns the page as one self-contained HTML file.
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
        text::escape_controls(&page.into_string()) + "\n"
    }
}

/// Style sheet of the HTML page. Heads wrap, so that a table of all figures is as wide as its numbers. In a narrower
/// window the table scrolls in a box, which keeps the number and name of a row visible. A shadow indicates further
/// columns.
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

/// Run in the chart and the table.
struct Entry<'a> {
    trade: &'a Trade,
    row: &'a Row,
    point: Point,
    /// False if the error is unknown, except for the reference of a scene.
    has_point: bool,
}

/// Returns all runs, numbered consecutively.
///
/// For one scene the runs on the Pareto front are marked. For several scenes the runs that break their promise are
/// marked.
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
        error: row.largest_promised_error.filter(|_| !is_reference),
        noise: match trade.cost_measure {
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
            false => {
                row.is_compared()
                    && row.largest_promised_error.is_some()
                    && !(of_scenes && point.cost <= 0.0)
            }
        },
        point,
    }
}

/// Returns true if the error of a preset is within the promise of the preset. Returns `None` if the preset has no
/// promise, or if the error is unknown.
fn is_kept(row: &Row) -> Option<bool> {
    Some(row.largest_promised_error? <= promise(&row.variant.name)?)
}

fn chart(title: String, cost: String, entries: &[Entry], of_scenes: bool) -> Chart {
    let mut shown: Vec<&Entry> = entries.iter().filter(|entry| entry.has_point).collect();
    shown.sort_by_key(|e| (e.row.variant.kind != KnobKind::Preset, !e.point.is_marked));
    let points: Vec<Point> = shown.into_iter().map(|entry| entry.point.clone()).collect();
    let keys = match of_scenes {
        true => ["*: breaks its promise.", "Discs: balanced. Squares: fast."],
        false => [
            "*: no other variant both costs less and is more exact (Pareto front).",
            "Squares: presets. Discs: one knob changed.",
        ],
    };
    let mut keys = keys.map(|key| vec![key.to_owned()]);
    keys[0].retain(|_| points.iter().any(|point| point.is_marked));
    if points.iter().any(|point| point.error.is_none()) {
        keys[0].push("reference is at the lower edge: its error is unknown.".to_owned());
    }
    if points.iter().any(|p| p.error.is_some_and(|e| e < FLOOR)) {
        let floor = percent(FLOOR);
        keys[0].push(format!("Errors below {floor} are also at the lower edge."));
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

/// Builds the table of all runs.
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
            _ => (figure.title, error(row.errors[k]).map(signed_percent)),
        }));
        cells.push(("own bar of volume", row.bars[0].map(percent)));
        cells.push(("closure part", row.closure.map(percent)));
        cells
    };
    let rows: Vec<Cells> = entries.iter().map(cells).collect();
    Sheet::new("", 2, &rows)
}

/// Returns true if a run computes FFT pairs on another grid than the run with preset `balanced`.
fn is_weighed(trade: &Trade, row: &Row) -> bool {
    trade.cost_measure == Cost::FftPairs && row.cost != row.fft_pairs
}

/// Builds the page on the variants of a scene. `left_out` lists the variants that were not tried, with reasons.
pub fn page(trade: &Trade, left_out: &[(String, String)]) -> Page {
    let trades = std::slice::from_ref(trade);
    let (name, found, entries) = (&trade.name, findings(trade), entries(trades, false));
    let reasons = left_out.iter().map(|(what, why)| format!("{what}: {why}"));
    let mut lists = lists(trades, &entries);
    lists.push(("Most effective knobs", knob_findings(&found)));
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

/// Builds the page on the presets over several scenes, under a common name.
pub fn page_of_scenes(name: &str, trades: &[Trade]) -> Page {
    let entries = entries(trades, true);
    let first = trades.iter().find(|trade| trade.machine.is_some());
    let title = format!("{name}: error of the presets against cost");
    Page {
        title: format!("Speed against accuracy: {name}"),
        intro: format!(
            "{name}: the presets over {} scenes. Deviations are from the preset reference of the same scene, whose own error is unknown. \
             Costs are FFT pairs, which are exact.{}{}",
            trades.len(),
            promised_figures(trades),
            first.map_or(String::new(), machine)
        ),
        chart: chart(title, "FFT pairs of a run".to_owned(), &entries, true),
        sheets: vec![runs(&entries, true), summary(&tallies(trades))],
        lists: lists(trades, &entries),
    }
}

/// Lists the promised figures, as a sentence after a space.
fn promised_figures(trades: &[Trade]) -> String {
    let is_used = |k: &usize| trades.iter().any(|trade| trade.has(*k));
    let figures = (0..FIGURES.len()).filter(|k| FIGURES[*k].promised);
    let figures = figures.filter(is_used);
    let figures: Vec<&str> = figures.map(|k| FIGURES[k].title).collect();
    match figures.is_empty() {
        true => String::new(),
        false => format!(" The presets promise: {}.", figures.join(", ")),
    }
}

/// Lists the broken promises, the figures outside their error bars, and the runs that are not compared.
fn lists(trades: &[Trade], entries: &[Entry]) -> Vec<(&'static str, Vec<String>)> {
    let line = |miss: &Miss| {
        let is_missed =
            |e: &&Entry| e.trade.name == miss.scene && e.row.variant.name == miss.preset;
        let name = entries
            .iter()
            .find(is_missed)
            .map_or("", |entry| &entry.point.name);
        let deviation = match miss.error {
            Some(error) => error_and_limit(error, miss.limit),
            None => format!("is zero in reference, ±{}", percent(miss.limit)),
        };
        format!("{name}: {} {deviation}", miss.figure)
    };
    let [broken, outside] = misses(trades).map(|figures| figures.iter().map(line).collect());
    let not_compared = entries.iter().filter_map(|entry| {
        let has_no_error = entry.point.error.is_none() && entry.row.is_compared();
        let reason = "a promised figure is zero or infinite in the reference";
        let reason = (has_no_error && entry.trade.reference().is_some()).then_some(reason);
        let why = entry.row.failure.as_deref().or(reason)?;
        Some(format!("{}: {why}", entry.point.name))
    });
    vec![
        ("Promises broken", broken),
        ("Presets outside their own error bar", outside),
        ("Not compared", not_compared.collect()),
    ]
}

/// Builds the table of the presets by kind of motion.
fn summary(tallies: &[PresetStatistics]) -> Sheet {
    let or_none = |value: Option<f64>| value.map_or(NONE.to_owned(), percent);
    let figure_text = |f: &FigureCount| {
        let [median, worst] = [f.median, f.worst].map(or_none);
        format!("{median} / {worst}; {} of {}", f.within, f.scenes)
    };
    let cells = |tally: &PresetStatistics| {
        let PresetStatistics {
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
            let count = tally.figures.iter().find(|f| f.figure == figure.title);
            (figure.title, count.map(figure_text))
        }));
        cells
    };
    let rows: Vec<Cells> = tallies.iter().map(cells).collect();
    let heading = "Presets by kind of motion: median / largest deviation; scenes in which a figure is within its own error bar";
    Sheet::new(heading, 1, &rows)
}

fn intro(trade: &Trade) -> String {
    let seconds = match (trade.noise, trade.has_cpu()) {
        (Some(noise), cpu) => format!(
            "{} seconds are the time of the stages of a run. They are reproducible to ±{}, the difference between two runs of balanced.",
            if cpu { "CPU" } else { "Wall" },
            percent(noise)
        ),
        (None, _) => {
            "The noise of the seconds is unknown, because balanced was not run twice.".to_owned()
        }
    };
    let by = match trade.cost_measure {
        Cost::FftPairs => "Costs are compared by FFT pairs, which are exact.",
        Cost::Seconds => {
            "Costs are compared by seconds, because FFT pairs are only a part of the work."
        }
    };
    format!(
        "{}: cost, and deviation from the variant reference, whose own error is unknown. Each variant changes one knob of the preset \
         balanced. {by} {seconds}{}{}",
        trade.name,
        promised_figures(std::slice::from_ref(trade)),
        machine(trade)
    )
}

/// Describes the machine of a trade, as a sentence after a space.
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
    match (trade.cost_measure, trade.noise) {
        (Cost::FftPairs, _) if trade.rows.iter().any(|row| is_weighed(trade, row)) => {
            "FFT pairs, on other grids by their work".to_owned()
        }
        (Cost::FftPairs, _) => "FFT pairs".to_owned(),
        (Cost::Seconds, Some(noise)) => format!("{clock} seconds, noise ±{}", percent(noise)),
        (Cost::Seconds, None) => format!("{clock} seconds, of unknown noise"),
    }
}

fn knob_findings(findings: &Findings) -> Vec<String> {
    let least = match (findings.by, findings.noise) {
        (Cost::FftPairs, _) => 0.0,
        (Cost::Seconds, Some(noise)) => noise,
        (Cost::Seconds, None) => {
            return vec!["No finding: costs are seconds, and their noise is not known".to_owned()];
        }
    };
    let is_seconds = findings.by == Cost::Seconds;
    let amount = |amount: f64| match is_seconds {
        true => format!("{} s", seconds(amount)),
        false => format!("{amount:.0} FFT pairs"),
    };
    let effect_text = |KnobEffect {
                           knob,
                           value,
                           error,
                           error_before,
                           ..
                       }: &KnobEffect,
                       cost: String| {
        let [error, before] = [*error, *error_before].map(percent);
        format!("{knob} = {value} {cost}, for an error of {error} instead of {before}")
    };
    let saving = findings.savings.iter().map(|saving| {
        let effect_or_none = saving.buy.as_ref().map(|effect| {
            let (saved, part) = (amount(effect.saved), percent(effect.saved_part));
            effect_text(
                effect,
                format!("saves {saved}, {part} of the cost of balanced"),
            )
        });
        let effect_or_none = effect_or_none
            .unwrap_or_else(|| "no single knob saves a significant part of the cost".to_owned());
        format!("Within {}: {effect_or_none}", percent(saving.within))
    });
    let accuracy = findings.accuracy.as_ref().map(|effect| {
        let cost = match -effect.saved_part {
            extra if extra > least => {
                format!("costs {} more, {}", amount(-effect.saved), percent(extra))
            }
            _ if is_seconds => "costs no more within the noise".to_owned(),
            _ => "costs no FFT pair more".to_owned(),
        };
        format!(
            "Best gain of accuracy for its cost: {}",
            effect_text(effect, cost)
        )
    });
    let accuracy = accuracy
        .unwrap_or_else(|| "No single knob of a solver halves the error of balanced".to_owned());
    let ineffective = findings.without_effect.join(", ");
    let ineffective =
        (!ineffective.is_empty()).then(|| format!("Knobs without any effect: {ineffective}"));
    saving.chain([accuracy]).chain(ineffective).collect()
}

fn convergence(findings: &Findings) -> Vec<String> {
    let knobs = findings.convergence.iter();
    let steps = knobs.flat_map(|knob| knob.steps.iter().map(|step| (knob.knob, step)));
    let lines = steps.map(|(knob, step)| {
        let not_converged = step.not_converged().into_iter();
        let not_converged =
            not_converged.map(|(title, change)| format!("{title} {}", percent(change.abs())));
        let not_converged: Vec<String> = not_converged.collect();
        let what = match not_converged.is_empty() {
            true => format!(
                "converged, all figures change by less than {}",
                percent(CONVERGED)
            ),
            false => format!("not converged: {}", not_converged.join(", ")),
        };
        format!("{knob} {}, against {}: {what}", step.from, step.to)
    });
    lines.collect()
}

/// Formats seconds with three significant digits, but at most milliseconds.
fn seconds(seconds: f64) -> String {
    let decimals = (2.0 - seconds.abs().log10().floor()).clamp(0.0, 3.0);
    format!("{seconds:.*}", decimals as usize)
}

/// Formats a share in percent, with two significant digits, or as a whole percent.
fn percent(share: f64) -> String {
    percent_of(share, 2)
}

fn percent_of(share: f64, least: i32) -> String {
    let percent = 100.0 * share;
    if percent == 0.0 {
        return "0".to_owned();
    }
    let whole = percent.abs().log10().floor() as i32 + 1;
    format!("{} %", significant_digits(percent, whole.max(least)))
}

/// Formats a share in percent with its sign.
fn signed_percent(share: f64) -> String {
    format!("{}{}", if share > 0.0 { "+" } else { "" }, percent(share))
}

/// Formats an error with sign, and the limit of the error. Both numbers have enough digits to differ.
fn error_and_limit(share: f64, limit: f64) -> String {
    const MOST: i32 = 6;
    let percent_texts = |digits| [share.abs(), limit].map(|share| percent_of(share, digits));
    let are_apart = |digits: &i32| percent_texts(*digits)[0] != percent_texts(*digits)[1];
    let [error, limit] = percent_texts((2..MOST).find(are_apart).unwrap_or(MOST));
    format!("{}{error}, of {limit}", if share > 0.0 { "+" } else { "−" })
}
