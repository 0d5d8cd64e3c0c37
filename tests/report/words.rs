//! Tests of the words of a page: headline, differences of runs, warnings; and of scales and axes of its drawings.

use fretwear::report::{Report, RunTables, numeric_column, percent};
use fretwear::tables::TableName;
use tempfile::TempDir;

use super::small_runs::{STATIC, WORN, begin, compute};
use crate::support::RESONATOR;

fn open(folder: &TempDir, name: &str, scene: &str) -> RunTables {
    RunTables::open(&compute(folder, name, scene, None)).unwrap()
}

/// Text between the first occurrence of `begin` and the next occurrence of `end`.
pub fn between<'a>(text: &'a str, begin: &str, end: &str) -> &'a str {
    let (_, rest) = text
        .split_once(begin)
        .unwrap_or_else(|| panic!("{begin} is missing"));
    rest.split_once(end)
        .unwrap_or_else(|| panic!("{end} is missing"))
        .0
}

/// Values of an attribute in a figure of a page.
pub fn attributes<'a>(html: &'a str, figure: &str, name: &str) -> Vec<&'a str> {
    let figure = between(html, &format!("<figure id=\"fig-{figure}\">"), "</figure>");
    let begin = format!(" {name}=\"");
    let parts = figure.split(&begin).skip(1);
    parts.map(|part| part.split('"').next().unwrap()).collect()
}

/// Value with three digits.
fn three(value: f64) -> String {
    let decimals = 2 - value.abs().log10().floor() as i32;
    let step = 10f64.powi(-decimals);
    format!(
        "{:.*}",
        decimals.max(0) as usize,
        (value / step).round() * step
    )
}

/// Warnings of a page: the anchor of the figure or section with the warning, if any, and the text.
fn warnings(html: &str) -> Vec<(Option<&str>, &str)> {
    let mut place = None;
    let mut found = Vec::new();
    for part in html.split('<').skip(1) {
        let anchor = part
            .strip_prefix("figure id=\"")
            .or_else(|| part.strip_prefix("section id=\""));
        if let Some(anchor) = anchor {
            place = anchor.split('"').next();
        } else if let Some(text) = part.strip_prefix("p class=\"banner\">") {
            found.push((place, text));
        }
    }
    found
}

/// Anchors that the table of contents marks with a warning.
fn marked(html: &str) -> Vec<&str> {
    let contents = between(html, "<nav", "</nav>");
    let lines = contents.lines().filter(|line| line.contains("warning"));
    lines.map(|line| between(line, "href=\"#", "\"")).collect()
}

/// A page shows each warning once: in the figure with the problem, or at the top if several or no figures show the problem.
#[test]
fn a_warning_stands_beside_what_it_concerns() {
    let folder = TempDir::new().unwrap();
    let doubtful = WORN.replace("friction_coefficient = 0.6", "friction_coefficient = 60");
    let stopped = begin(&folder, "doubtful", &doubtful, 2);
    let html = Report::new(&[RunTables::open(&stopped).unwrap()])
        .unwrap()
        .html();
    let found = warnings(&html);
    let [progress, friction] = &found[..] else {
        panic!("{found:?}");
    };
    assert!(
        progress.0.is_none() && progress.1.starts_with("In progress: doubtful "),
        "{progress:?}"
    );
    assert_eq!(friction.0, Some("fig-hysteresis-loops"));
    assert!(
        friction.1.starts_with("contact.friction_coefficient: "),
        "{friction:?}"
    );
    assert_eq!(marked(&html), ["fig-hysteresis-loops"]);

    // The few highest asperities yield. A run without motion has no figure of friction.
    let sharp = doubtful
        .replace("\"2 um\"", "\"20 um\"")
        .replace("\"300 N\"", "\"3 kN\"");
    let (begin, end) = sharp.split_once("[motion]").unwrap();
    assert!(end.contains("[wear]"));
    let runs = [
        open(&folder, "sharp", begin),
        open(&folder, "pressed", STATIC),
    ];
    let html = Report::new(&runs).unwrap().html();
    let found = warnings(&html);
    let at = |place: Option<&str>, begin: &str| {
        let fits = |(own, text): &&(Option<&str>, &str)| *own == place && text.starts_with(begin);
        found.iter().filter(fits).count()
    };
    let peak = "sharp: without wear: the largest pressure of ";
    assert_eq!(at(Some("fig-pressure"), peak), 1, "{found:?}");
    assert_eq!(
        at(Some("results"), "sharp: contact.friction_coefficient: "),
        1,
        "{found:?}"
    );
    assert_eq!(html.matches("the largest pressure of").count(), 1);
    assert!(marked(&html).contains(&"fig-pressure") && marked(&html).contains(&"results"));
}

#[test]
fn a_page_begins_with_what_became_of_the_joint() {
    let folder = TempDir::new().unwrap();
    let run = open(&folder, "worn", WORN);
    let summary = run.series(TableName::Summary).unwrap().unwrap();
    let last = |column: &str| *numeric_column(&summary, column).unwrap().last().unwrap();
    let html = Report::new(std::slice::from_ref(&run)).unwrap().html();
    let headline = between(&html, "<p class=\"headline\">", "</p>");
    assert!(html.find("class=\"headline\"") < html.find("<nav"));
    // The headline quotes the volume with its error bar, and the stiffness before and after wear.
    let volume = last("wear_volume");
    let bar = percent(last("error_wear_volume"));
    let lost = format!(
        "After 400\u{202f}000 cycles the joint has lost {}·10⁻⁴\u{a0}mm³ ± {bar}.",
        three(volume / 1e-13)
    );
    assert!(
        headline.starts_with(&lost),
        "{headline} does not begin with {lost}"
    );
    let kn = numeric_column(&summary, "kn").unwrap();
    let [before, after] = [kn[0], last("kn")].map(|kn| three(kn / 1e6));
    let verb = if last("kn") > kn[0] { "rose" } else { "fell" };
    let stiffness = format!("ormal stiffness {verb} from {before} to {after}\u{a0}N/µm");
    assert!(
        headline.contains(&stiffness),
        "{headline} lacks {stiffness}"
    );
    // The table of all results is the last section.
    let at = |id: &str| html.find(&format!("<section id=\"{id}\">")).unwrap();
    assert!(at("figures") < at("scene") && at("scene") < at("results"));

    let pressed = Report::new(&[open(&folder, "pressed", STATIC)])
        .unwrap()
        .html();
    let headline = between(&pressed, "<p class=\"headline\">", "</p>");
    assert!(headline.starts_with("Under 300\u{a0}N "), "{headline}");
}

/// The headline quotes the resonance with the contact elements of the worn joint. The wear steps before used older contact elements.
#[test]
fn the_headline_of_a_vibration_is_that_of_the_worn_state() {
    let folder = TempDir::new().unwrap();
    let run = open(&folder, "resonator", RESONATOR);
    let of = |k: u64, column: &str| {
        let frame = run
            .iteration_table(k, TableName::WornResponse)
            .unwrap()
            .unwrap();
        numeric_column(&frame, column).unwrap()[0]
    };
    let report = Report::new(std::slice::from_ref(&run)).unwrap();
    let html = report.html();
    let headline = between(&html, "<p class=\"headline\">", "</p>");
    for k in [0, run.latest()] {
        let frequency = format!("{:.1}", of(k, "resonance_frequency"));
        assert!(
            headline.contains(&frequency),
            "{headline} lacks {frequency}"
        );
        let amplitude = three(of(k, "resonance_amplitude") / 1e-6);
        assert!(
            headline.contains(&amplitude),
            "{headline} lacks {amplitude}"
        );
    }
    // The page begins with the most important figures.
    let ids: Vec<&str> = report.figures().iter().map(|figure| figure.id).collect();
    assert_eq!(
        ids[..4],
        ["forced-response", "wear-map", "wear-rate", "resonance"]
    );
}

/// A joint that sticks does not wear, and the headline reports this. Rounding errors of dissipation and heights are not figures.
#[test]
fn a_joint_in_which_nothing_wore_says_so() {
    let folder = TempDir::new().unwrap();
    let still = WORN.replace("[\"3 um\", \"0 um\"]", "[\"0.1 nm\", \"0 um\"]");
    let still = still.replace("= 0.6", "= 1e6");
    let run = open(&folder, "still", &still);
    let summary = run.series(TableName::Summary).unwrap().unwrap();
    assert_eq!(
        *numeric_column(&summary, "wear_volume")
            .unwrap()
            .last()
            .unwrap(),
        0.0
    );
    let report = Report::new(std::slice::from_ref(&run)).unwrap();
    let html = report.html();
    let headline = between(&html, "<p class=\"headline\">", "</p>");
    let first = "After 400\u{202f}000 cycles nothing has worn. Under 300\u{a0}N ";
    assert!(headline.starts_with(first), "{headline}");
    let caption = |id: &str| {
        let mut figures = report.figures().iter();
        figures
            .find(|figure| figure.id == id)
            .unwrap()
            .caption
            .clone()
    };
    let rate = caption("wear-rate");
    assert!(
        rate.starts_with("Worn volume stays at 0\u{a0}mm³. Wear rate stays at 0"),
        "{rate}"
    );
    // The mean height may contain a rounding error.
    let roughness = caption("roughness");
    let left = ["Mean height stays at 0\u{a0}", "Mean height stays below "];
    assert!(
        left.iter().any(|left| roughness.starts_with(left)),
        "{roughness}"
    );
    let loops = caption("hysteresis-loops");
    assert!(loops.contains(" below "), "{loops}");
}

/// Each quantity has one unit on the whole page. The largest run decides the unit.
#[test]
fn runs_side_by_side_have_one_unit() {
    let folder = TempDir::new().unwrap();
    let gentle = WORN.replace("\"2e3 um^3/J\"", "\"2 um^3/J\"");
    let far = gentle.replace("[\"3 um\", \"0 um\"]", "[\"20 um\", \"0 um\"]");
    let runs = [("far", far.as_str()), ("gentle", gentle.as_str())]
        .map(|(name, scene)| open(&folder, name, scene));
    let last = |run: &RunTables, column: &str| {
        let summary = run.series(TableName::Summary).unwrap().unwrap();
        *numeric_column(&summary, column).unwrap().last().unwrap()
    };
    // In separate reports, the two runs would have different units.
    let [most, least] = [0, 1].map(|k| last(&runs[k], "dissipated_energy"));
    assert!(most >= 1e-3 && least < 1e-3, "{most} {least}");
    let html = Report::new(&runs).unwrap().html();
    let headlines: Vec<&str> = html.split("<p class=\"headline\">").skip(1).collect();
    for headline in &headlines {
        let volume = between(headline, "has lost ", "±");
        assert!(volume.contains("mm³"), "{volume}");
    }
    let results = between(&html, "<section id=\"results\">", "</section>");
    let row = between(results, "<td>dissipated energy</td>", "</tr>");
    assert_eq!(row.matches("\u{a0}mJ").count(), 2, "{row}");
    let caption = between(&html, "<figure id=\"fig-dissipation\">", "</figure>");
    let energies = between(caption, "Energy per cycle: ", ". ");
    assert_eq!(energies.matches("\u{a0}mJ").count(), 2, "{energies}");
}

/// A moment of the size of rounding errors is quoted as an upper bound only.
#[test]
fn noise_is_said_as_what_it_is_below() {
    let folder = TempDir::new().unwrap();
    let surface = between(STATIC, "[surface]", "[contact]");
    let round = STATIC.replace(surface, "\nkind = \"sphere\"\nradius = \"1 m\"\n");
    let run = open(&folder, "round", &round);
    let summary = run.series(TableName::Summary).unwrap().unwrap();
    let moment = numeric_column(&summary, "moment_x").unwrap()[0];
    assert!(
        moment != 0.0 && moment.abs() < 1e-9 * 300.0 * 4e-3,
        "{moment}"
    );
    let row = |run: RunTables| {
        let html = Report::new(&[run]).unwrap().html();
        between(&html, "<td>moment x</td>", "</tr>").to_owned()
    };
    let round = row(run);
    assert!(round.contains("below 1.2·10⁻⁹\u{a0}N m"), "{round}");
    let rough = row(open(&folder, "rough", STATIC));
    assert!(!rough.contains("below"), "{rough}");
}

#[test]
fn several_runs_say_in_what_they_differ() {
    let folder = TempDir::new().unwrap();
    let rougher = WORN.replace("\"2 um\"", "\"3 um\"");
    let runs = [
        ("smooth", WORN),
        ("rough", rougher.as_str()),
        ("pressed", STATIC),
    ]
    .map(|(name, scene)| open(&folder, name, scene));
    let page = |runs: &[RunTables]| Report::new(runs).unwrap().html();
    let html = page(&runs);
    let section = between(&html, "<section id=\"differences\">", "</section>");
    assert!(html.find("id=\"differences\"") < html.find("id=\"figures\""));
    let row = |key: &str| {
        let mut lines = section.lines();
        lines
            .find(|line| line.contains(&format!("<td>{key}</td>")))
            .map(str::to_owned)
    };
    let cells = |texts: [&str; 3]| texts.map(|text| format!("<td>{text}</td>")).concat();
    assert!(
        row("surface.rq")
            .unwrap()
            .contains(&cells(["2 um", "3 um", "1 um"])),
        "{section}"
    );
    assert!(
        row("contact.friction_coefficient")
            .unwrap()
            .contains(&cells(["0.6", "0.6", "–"])),
        "{section}"
    );
    // Keys with equal values are missing in the table.
    for key in ["surface.seed", "joint.grid", "contact.normal_load"] {
        assert!(row(key).is_none(), "{key}");
    }
    let twice = ["once", "again"].map(|name| open(&folder, name, STATIC));
    assert!(
        between(&page(&twice), "<section id=\"differences\">", "</section>")
            .contains("are the same")
    );
    assert!(!page(&twice[..1]).contains("id=\"differences\""));
    // The maps of all runs have one scale. The charts of all runs have the same axes.
    for (figure, attribute, count) in [
        ("surface", "data-scale", 5),
        ("pressure", "data-scale", 5),
        ("wear-map", "data-scale", 2),
    ] {
        let mut scales = attributes(&html, figure, attribute);
        assert_eq!(scales.len(), count, "{figure}");
        scales.dedup();
        assert_eq!(scales.len(), 1, "{figure}: {scales:?}");
    }
    let range = |axis: &&str| {
        axis.split(' ')
            .skip(2)
            .take(2)
            .collect::<Vec<_>>()
            .join(" ")
    };
    let profiles: Vec<String> = attributes(&html, "section", "data-y")
        .iter()
        .map(range)
        .collect();
    assert!(
        profiles.len() == 4 && profiles[0] == profiles[2] && profiles[1] == profiles[3],
        "{profiles:?}"
    );
}

/// Error bars end within their axes. Profiles belong to cycles between the first and the last.
#[test]
fn drawings_are_whole() {
    let folder = TempDir::new().unwrap();
    let run = open(&folder, "worn", WORN);
    let states = run.iterations().len();
    let html = Report::new(&[run]).unwrap().html();
    let vibrating = Report::new(&[open(&folder, "resonator", RESONATOR)]).unwrap();
    let vibrating = vibrating.html();
    let mut bars = 0;
    for figure in ["wear-rate", "dissipation", "contact-area", "resonance"] {
        let part = between(
            &vibrating,
            &format!("<figure id=\"fig-{figure}\">"),
            "</figure>",
        );
        for drawing in part.split("<svg class=\"plot\"").skip(1) {
            let axis: Vec<f64> = between(drawing, "data-y=\"", "\"")
                .split(' ')
                .take(2)
                .map(|end| end.parse().unwrap())
                .collect();
            for bar in drawing.split("class=\"bar ").skip(1) {
                bars += 1;
                // Each bar goes from its lower end to its upper end. Its caps are horizontal.
                let ends = between(bar, " d=\"", "\"").split('V').skip(1);
                for high in ends.map(|end| end.split('M').next().unwrap()) {
                    let y: f64 = high.parse().unwrap();
                    assert!(y < axis[0] && y > axis[1], "{figure}: {y} beyond {axis:?}");
                }
            }
        }
    }
    assert!(bars > 0);
    assert!(states > 5);
    let section = between(&html, "<figure id=\"fig-section\">", "</figure>");
    for plot in section.split("<svg class=\"plot\"").skip(1) {
        let curves = plot.split("</svg>").next().unwrap();
        let names = curves.split("data-name=\"").skip(1);
        let names: Vec<&str> = names.filter_map(|name| name.split('"').next()).collect();
        assert!((4..=5).contains(&names.len()), "{names:?}");
        assert_eq!(names[0], "unworn");
        assert!(curves.contains("class=\"s0\"") && curves.contains("class=\"s1\""));
    }
}
