//! The table of a trade and what follows from it, for a person: as Markdown, and as one HTML file.

use super::super::html::{NONE, escaped, table};
use super::super::text;
use super::findings::CONVERGED;
use super::{Bars, Buy, Cost, FIGURES, Findings, Row, Trade};
use crate::scene::variants::KnobKind;

/// What both forms show: a table, then lists under headings.
struct Page {
    intro: String,
    head: Vec<String>,
    rows: Vec<Vec<String>>,
    lists: Vec<(&'static str, Vec<String>)>,
}

/// The trade as Markdown: its table, then what it says. `left_out` is what was not tried, and why.
pub fn markdown(trade: &Trade, found: &Findings, left_out: &[(String, String)]) -> String {
    let page = page(trade, found, left_out, text::markdown);
    let mut text = format!("{}\n\n", page.intro);
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| text::cell(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    text += &line(&page.head);
    text += &format!("|---|{}\n", "---:|".repeat(page.head.len() - 1));
    for row in &page.rows {
        text += &line(row);
    }
    for (heading, items) in &page.lists {
        text += &format!("\n**{heading}**\n\n");
        for item in items {
            text += &format!("- {item}\n");
        }
    }
    text
}

const STYLE: &str = "body{font:15px/1.5 sans-serif;color:#222;max-width:75em;margin:2em auto;padding:0 1em}\
table{border-collapse:collapse;font-variant-numeric:tabular-nums}\
th,td{padding:.25em .7em;text-align:right;border-bottom:1px solid #ddd;white-space:nowrap}\
th:first-child,td:first-child{text-align:left}div{overflow-x:auto}svg{max-width:100%;height:auto}";

/// The same as one HTML file that needs no other, with the chart `svg` in it.
pub fn html(trade: &Trade, found: &Findings, left_out: &[(String, String)], svg: &str) -> String {
    // The page escapes all of its text.
    let page = page(trade, found, left_out, str::to_owned);
    let name = escaped(&trade.name);
    let lists: String = page
        .lists
        .iter()
        .map(|(heading, items)| {
            let items = items
                .iter()
                .map(|item| format!("<li>{}</li>\n", escaped(item)));
            let items: String = items.collect();
            format!("<h2>{}</h2>\n<ul>\n{items}</ul>\n", escaped(heading))
        })
        .collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n<title>Speed against accuracy: {name}</title>\n\
         <style>{STYLE}</style>\n</head>\n<body>\n<h1>Speed against accuracy: {name}</h1>\n<p>{}</p>\n{svg}\n\
         {}{lists}</body>\n</html>\n",
        escaped(&page.intro),
        table(&page.head, &page.rows, true),
    )
}

/// Title of an error bar, and where it stands.
type Bar = (&'static str, fn(&Bars) -> Option<f64>);

/// What a run says of itself, after its errors.
const BARS: [Bar; 2] = [
    ("its own bar of the volume", |bars| bars.volume),
    ("of it by the contact elements", |bars| bars.closure),
];

/// `foreign` is how text stands that is not of this program.
fn page(
    trade: &Trade,
    found: &Findings,
    left_out: &[(String, String)],
    foreign: fn(&str) -> String,
) -> Page {
    let shown: Vec<usize> = (0..FIGURES.len()).filter(|k| trade.has(*k)).collect();
    let head = ["variant", "seconds", "FFT pairs", "iterations", "memory"].map(str::to_owned);
    let titles = shown.iter().map(|k| FIGURES[*k].title.to_owned());
    let bars: Vec<&Bar> = (BARS.iter())
        .filter(|(_, of)| trade.rows.iter().any(|row| of(&row.bars).is_some()))
        .collect();
    let titles = titles.chain(bars.iter().map(|(title, _)| (*title).to_owned()));
    let row = |row: &Row| {
        let cells = [
            called(row),
            seconds(row.seconds),
            format!("{:.0}", row.fft_pairs),
            row.iterations.to_string(),
            format!("{:.0} MB", row.memory as f64 / 1e6),
        ];
        let errors = shown.iter().map(|k| {
            row.errors[*k].map_or(NONE.to_owned(), |error| match FIGURES[*k].name {
                "wear_field" => percent(error),
                _ => signed(error),
            })
        });
        let own = bars
            .iter()
            .map(|(_, of)| of(&row.bars).map_or(NONE.to_owned(), percent));
        cells.into_iter().chain(errors).chain(own).collect()
    };
    let mut lists = vec![("Promises of the presets", promises(found))];
    lists.push(("What buys most", buys(found)));
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
    Page {
        intro: intro(trade, &foreign(&trade.name)),
        head: head.into_iter().chain(titles).collect(),
        rows: trade.rows.iter().map(row).collect(),
        lists,
    }
}

fn intro(trade: &Trade, name: &str) -> String {
    let machine = trade.machine.as_ref().map_or(String::new(), |machine| {
        let features = machine.cpu_features.last();
        format!(
            " Computed on {} {}{}, {} processors.",
            machine.os,
            machine.architecture,
            features.map_or(String::new(), |name| format!(" with {name}")),
            machine.processors
        )
    });
    format!(
        "{name}: cost, and deviation from the variant reference. A knob is turned alone, from the preset balanced.{machine}"
    )
}

fn called(row: &Row) -> String {
    match row.variant.kind {
        KnobKind::Preset => row.variant.value.clone(),
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

fn buys(found: &Findings) -> Vec<String> {
    let saving = found.savings.iter().map(|saving| {
        let within = percent(saving.within);
        let (unit, whole) = match saving.cost {
            Cost::Seconds => ("s", "time"),
            Cost::FftPairs => ("FFT pairs", "FFT pairs"),
        };
        match &saving.buy {
            Some(buy) => format!(
                "Within {within}: {} saves {} {unit}, {:.0} % of the {whole} of balanced, for an error of {} in place of {}",
                turned(buy),
                match saving.cost {
                    Cost::Seconds => seconds(buy.saved),
                    Cost::FftPairs => format!("{:.0}", buy.saved),
                },
                100.0 * buy.saved_part,
                percent(buy.error),
                percent(buy.error_before),
            ),
            None => format!("Within {within}: no single knob saves {whole}"),
        }
    });
    let accuracy = found.accuracy.as_ref().map(|buy| {
        let cost = if buy.saved < 0.0 {
            format!("costs {} s more", seconds(-buy.saved))
        } else {
            "costs nothing more".to_owned()
        };
        format!(
            "Most accuracy for a second: {} {cost}, for an error of {} in place of {}",
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
fn seconds(seconds: f64) -> String {
    match seconds {
        s if s >= 99.5 => format!("{s:.0}"),
        s if s >= 9.95 => format!("{s:.1}"),
        s if s >= 0.995 => format!("{s:.2}"),
        s => format!("{s:.3}"),
    }
}

/// Two significant digits, as a share of a hundred.
fn percent(share: f64) -> String {
    let percent = 100.0 * share;
    match percent.abs() {
        0.0 => "0".to_owned(),
        p if p < 0.001 => format!("{percent:.0e} %"),
        p if p >= 9.95 => format!("{percent:.0} %"),
        p => {
            let decimals = (1 - p.log10().floor() as i32).max(0) as usize;
            let text = format!("{percent:.decimals$}");
            // "1.0 %" of a promise reads better as "1 %".
            format!("{} %", text.strip_suffix(".0").unwrap_or(&text))
        }
    }
}

fn signed(share: f64) -> String {
    let sign = match share {
        s if s > 0.0 => "+",
        s if s < 0.0 => "−",
        _ => "",
    };
    format!("{sign}{}", percent(share.abs()))
}
