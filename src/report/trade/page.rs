//! The tables of a trade and what follows from them, for a person: as Markdown, and as one HTML file.

use super::super::html::{NONE, escaped, table};
use super::super::text;
use super::findings::CONVERGED;
use super::{Buy, Cost, FIELD, FIGURES, Findings, Row, Trade};
use crate::scene::variants::{KnobKind, REFERENCE};

/// A table under its heading, which the first may lack.
#[derive(Clone)]
pub(super) struct Sheet {
    pub heading: String,
    pub head: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// What both forms show: tables, then lists under headings.
pub(super) struct Page {
    pub title: String,
    pub intro: String,
    pub sheets: Vec<Sheet>,
    pub lists: Vec<(&'static str, Vec<String>)>,
}

impl Page {
    /// As Markdown, whose tables are set in columns for who reads it as text.
    pub fn markdown(&self) -> String {
        let mut text = format!("{}\n", self.intro);
        for sheet in &self.sheets {
            if !sheet.heading.is_empty() {
                text += &format!("\n**{}**\n", sheet.heading);
            }
            text += &format!("\n{}", columns(&sheet.head, &sheet.rows));
        }
        for (heading, items) in &self.lists {
            text += &format!("\n**{heading}**\n\n");
            for item in items {
                text += &format!("- {item}\n");
            }
        }
        text
    }

    /// As one HTML file that needs no other, with the chart `svg` in it.
    pub fn html(&self, svg: &str) -> String {
        let sheets = self.sheets.iter().map(|sheet| {
            let heading = match sheet.heading.is_empty() {
                true => String::new(),
                false => format!("<h2>{}</h2>\n", escaped(&sheet.heading)),
            };
            heading + &table(&sheet.head, &sheet.rows, true)
        });
        let sheets: String = sheets.collect();
        let lists = self.lists.iter().map(|(heading, items)| {
            let items = items.iter();
            let items = items.map(|item| format!("<li>{}</li>\n", escaped(item)));
            let items: String = items.collect();
            format!("<h2>{}</h2>\n<ul>\n{items}</ul>\n", escaped(heading))
        });
        let lists: String = lists.collect();
        let title = escaped(&self.title);
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width\">\n<title>{title}</title>\n\
             <style>{STYLE}</style>\n</head>\n<body>\n<h1>{title}</h1>\n<p>{}</p>\n{svg}\n{sheets}{lists}</body>\n</html>\n",
            escaped(&self.intro),
        )
    }
}

/// A table of Markdown whose columns are as wide as their widest cell; numbers stand to the right.
fn columns(head: &[String], rows: &[Vec<String>]) -> String {
    let cells = |row: &[String]| -> Vec<String> { row.iter().map(|c| text::cell(c)).collect() };
    let lines: Vec<Vec<String>> = [cells(head)]
        .into_iter()
        .chain(rows.iter().map(|row| cells(row)))
        .collect();
    let width = |k: usize| {
        let widths = lines.iter().map(|line| line[k].chars().count());
        widths.max().unwrap_or(0).max(3)
    };
    let widths: Vec<usize> = (0..head.len()).map(width).collect();
    let told = |line: &Vec<String>| {
        let cells = line.iter().zip(&widths).enumerate();
        let cells = cells.map(|(k, (cell, width))| match k {
            0 => format!("{cell:<width$}"),
            _ => format!("{cell:>width$}"),
        });
        format!("| {} |\n", cells.collect::<Vec<_>>().join(" | "))
    };
    let rule = widths.iter().enumerate().map(|(k, width)| match k {
        0 => "-".repeat(width + 2),
        _ => "-".repeat(width + 1) + ":",
    });
    let rule = rule.collect::<Vec<_>>().join("|");
    let body: String = lines[1..].iter().map(told).collect();
    format!("{}|{rule}|\n{body}", told(&lines[0]))
}

/// Heads break into lines, so that a table of all figures is as wide as its numbers; a narrower window scrolls it in a box of its own,
/// which shows by its shadow that there is more, and keeps the first column.
const STYLE: &str = "body{font:15px/1.5 sans-serif;color:#222;max-width:84em;margin:1.5em auto;padding:0 1em}\
.wide{overflow-x:auto;background:linear-gradient(90deg,#fff0,#fff 70%) right/40px 100% no-repeat local,\
radial-gradient(farthest-side at 100% 50%,#0003,#0000) right/14px 100% no-repeat scroll}\
table{border-collapse:collapse;font-size:13px;line-height:1.35;font-variant-numeric:tabular-nums}\
th,td{padding:.3em .5em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th{vertical-align:bottom;white-space:normal}\
th:first-child,td:first-child{text-align:left;position:sticky;left:0;background:#fff}\
svg{max-width:100%;height:auto}h1{font-size:22px}h2{font-size:17px;margin:1.4em 0 .4em}";

/// The trade as Markdown: its table, then what it says. `left_out` is what was not tried, and why.
pub fn markdown(trade: &Trade, found: &Findings, left_out: &[(String, String)]) -> String {
    page(trade, found, left_out, text::markdown).markdown()
}

/// The trade as a terminal shows it: set as by [`markdown`], with all names as they are.
pub fn plain(trade: &Trade, found: &Findings, left_out: &[(String, String)]) -> String {
    page(trade, found, left_out, text::one_line).markdown()
}

/// The trade as one HTML file that needs no other, with the chart `svg` in it. `left_out` is what was not tried, and why.
pub fn html(trade: &Trade, found: &Findings, left_out: &[(String, String)], svg: &str) -> String {
    // The page escapes all of its text.
    page(trade, found, left_out, str::to_owned).html(svg)
}

/// Title of an error bar, and where it stands.
type Bar = (&'static str, fn(&Row) -> Option<f64>);

/// What a run says of its own worn volume, after its errors.
const BARS: [Bar; 2] = [
    ("own bar of volume", |row| row.bars[0]),
    ("of it closures", |row| row.closure),
];

/// `foreign` is how text stands that is not of this program.
fn page(
    trade: &Trade,
    found: &Findings,
    left_out: &[(String, String)],
    foreign: fn(&str) -> String,
) -> Page {
    let shown: Vec<usize> = (0..FIGURES.len()).filter(|k| trade.has(*k)).collect();
    let clock = if trade.has_cpu() {
        "CPU seconds"
    } else {
        "wall seconds"
    };
    let head = ["variant", "FFT pairs", clock, "iterations", "memory"].map(str::to_owned);
    let titles = shown.iter().map(|k| FIGURES[*k].title.to_owned());
    let bars: Vec<&Bar> = (BARS.iter())
        .filter(|(_, of)| trade.rows.iter().any(|row| of(row).is_some()))
        .collect();
    let titles = titles.chain(bars.iter().map(|(title, _)| (*title).to_owned()));
    let row = |row: &Row| {
        let cells = [
            called(row),
            format!("{:.0}", row.fft_pairs),
            seconds(trade.seconds(row)),
            row.iterations.to_string(),
            format!("{:.0} MB", row.memory as f64 / 1e6),
        ];
        // Held against itself the reference says nothing.
        let is_known = row.variant.name != REFERENCE;
        let errors = shown.iter().map(|k| {
            let error = row.errors[*k].filter(|_| is_known);
            error.map_or(NONE.to_owned(), |error| match *k {
                FIELD => percent(error),
                _ => signed(error),
            })
        });
        let own = bars
            .iter()
            .map(|(_, of)| of(row).map_or(NONE.to_owned(), percent));
        cells.into_iter().chain(errors).chain(own).collect()
    };
    let mut lists = vec![("Promises of the presets", promises(found))];
    lists.push(("What buys most", buys(trade, found)));
    lists.push(("Convergence with the mesh", convergence(found)));
    let failed = |row: &Row| {
        Some(format!(
            "{}: {}",
            called(row),
            foreign(row.failure.as_ref()?)
        ))
    };
    lists.push(("Failed", trade.rows.iter().filter_map(failed).collect()));
    let reasons = left_out
        .iter()
        .map(|(what, why)| format!("{what}: {}", foreign(why)));
    lists.push(("Not tried", reasons.collect()));
    lists.retain(|(_, items)| !items.is_empty());
    let sheet = Sheet {
        heading: String::new(),
        head: head.into_iter().chain(titles).collect(),
        rows: trade.rows.iter().map(row).collect(),
    };
    Page {
        title: format!("Speed against accuracy: {}", foreign(&trade.name)),
        intro: intro(trade, &foreign(&trade.name)),
        sheets: vec![sheet],
        lists,
    }
}

fn intro(trade: &Trade, name: &str) -> String {
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
        "{name}: cost, and deviation from the variant reference, whose own error is not known. A knob is turned alone, from the preset \
         balanced. {by} {seconds}{}",
        machine(trade)
    )
}

/// Where a trade was computed, as a sentence after a space.
pub(super) fn machine(trade: &Trade) -> String {
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

/// What a person calls a row.
pub(super) fn called(row: &Row) -> String {
    match row.variant.kind {
        KnobKind::Preset | KnobKind::Repeat => row.variant.value.clone(),
        _ => format!("{} = {}", row.variant.knob, row.variant.value),
    }
}

fn promises(found: &Findings) -> Vec<String> {
    let kept = found.promises.iter().map(|kept| {
        format!(
            "{}, {}: {} of {} promised: {}",
            kept.preset,
            kept.figure,
            kept.error
                .map_or(NONE.to_owned(), |error| percent(error.abs())),
            percent(kept.promise),
            if kept.passed { "pass" } else { "FAIL" }
        )
    });
    kept.collect()
}

fn buys(trade: &Trade, found: &Findings) -> Vec<String> {
    let amount = |amount: f64| match found.by {
        Cost::Seconds => format!("{} s", seconds(amount)),
        Cost::FftPairs => format!("{amount:.0} FFT pairs"),
    };
    if found.by == Cost::Seconds && found.noise.is_none() {
        return vec!["Nothing is said of seconds whose noise is not known".to_owned()];
    }
    let saving = found.savings.iter().map(|saving| {
        let within = percent(saving.within);
        match &saving.buy {
            Some(buy) => format!(
                "Within {within}: {} saves {}{}, {} of those of balanced, for an error of {} in place of {}",
                turned(buy),
                amount(buy.saved),
                of_work(trade, buy),
                percent(buy.saved_part),
                percent(buy.error),
                percent(buy.error_before),
            ),
            None => format!("Within {within}: no single knob saves anything worth it"),
        }
    });
    let accuracy = found.accuracy.as_ref().map(|buy| {
        let least = match found.by {
            Cost::Seconds => found.noise.unwrap_or(0.0),
            Cost::FftPairs => 0.0,
        };
        let cost = match -buy.saved_part {
            more if more > least => format!("costs {} more, {}", amount(-buy.saved), percent(more)),
            _ if found.by == Cost::Seconds => "costs no more than noise tells".to_owned(),
            _ => "costs no FFT pair more".to_owned(),
        };
        format!(
            "Most accuracy for its cost: {} {cost}, for an error of {} in place of {}",
            turned(buy),
            percent(buy.error),
            percent(buy.error_before),
        )
    });
    let idle = &found.without_effect;
    let idle = (!idle.is_empty()).then(|| format!("Without any effect: {}", idle.join(", ")));
    let accuracy = accuracy
        .unwrap_or_else(|| "No single knob of a solver halves the error of balanced".to_owned());
    saving.chain([accuracy]).chain(idle).collect()
}

/// How pairs are counted where those of a variant are on another grid.
fn of_work(trade: &Trade, buy: &Buy) -> &'static str {
    let row = trade.row(&buy.variant);
    match row.is_some_and(|row| trade.by == Cost::FftPairs && row.cost != row.fft_pairs) {
        true => " by their work",
        false => "",
    }
}

fn turned(buy: &Buy) -> String {
    format!("{} = {}", buy.knob, buy.value)
}

fn convergence(found: &Findings) -> Vec<String> {
    let steps = found
        .convergence
        .iter()
        .flat_map(|knob| knob.steps.iter().map(move |step| (knob.knob, step)));
    let lines = steps.map(|(knob, step)| {
        let open = step.not_converged();
        let what = if open.is_empty() {
            format!("converged, all change by less than {}", percent(CONVERGED))
        } else {
            let open: Vec<String> = open
                .into_iter()
                .map(|(title, change)| format!("{title} {}", percent(change.abs())))
                .collect();
            format!("not converged: {}", open.join(", "))
        };
        format!("{knob} {}, against {}: {what}", step.from, step.to)
    });
    lines.collect()
}

/// Three significant digits.
pub(super) fn seconds(seconds: f64) -> String {
    match seconds {
        s if s >= 99.5 => format!("{s:.0}"),
        s if s >= 9.95 => format!("{s:.1}"),
        s if s >= 0.995 => format!("{s:.2}"),
        s => format!("{s:.3}"),
    }
}

/// Two significant digits, as a share of a hundred.
pub(super) fn percent(share: f64) -> String {
    percent_of(share, 2)
}

fn percent_of(share: f64, digits: i32) -> String {
    let percent = 100.0 * share;
    match percent.abs() {
        0.0 => "0".to_owned(),
        p if p < 0.001 => format!("{percent:.0e} %"),
        p => {
            let decimals = (digits - 1 - p.log10().floor() as i32).max(0) as usize;
            let text = format!("{percent:.decimals$}");
            // "1.0 %" of a promise reads better as "1 %".
            let whole = text
                .split_once('.')
                .filter(|(_, part)| part.chars().all(|c| c == '0'));
            format!("{} %", whole.map_or(text.as_str(), |(whole, _)| whole))
        }
    }
}

/// Two significant digits with their sign, as a share of a hundred.
fn signed(share: f64) -> String {
    format!("{}{}", sign(share), percent(share.abs()))
}

/// An error with its sign and what it is held against, to as many digits as tell them apart.
pub(super) fn against(share: f64, limit: f64) -> String {
    const MOST: i32 = 6;
    let told = |digits| [share.abs(), limit].map(|share| percent_of(share, digits));
    let mut digits = 2..MOST;
    let digits = digits.find(|digits| told(*digits)[0] != told(*digits)[1]);
    let [error, limit] = told(digits.unwrap_or(MOST));
    format!("{}{error}, of {limit}", sign(share))
}

fn sign(share: f64) -> &'static str {
    match share {
        s if s > 0.0 => "+",
        s if s < 0.0 => "−",
        _ => "",
    }
}
