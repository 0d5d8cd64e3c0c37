//! Tests of the report page: the set of figures, and the agreement of figures, captions and tables.

use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Output};

use fretwear::report::{Report, RunTables, Section, numeric_column};
use fretwear::tables::TableName;
use maud::html;
use quick_xml::Reader;
use quick_xml::events::Event;
use tempfile::TempDir;

use super::small_runs::{STATIC, WORN, begin, compute, damage, summary_file};
use crate::support::{OSCILLATOR, RESONATOR, SLIDER};

fn open(root: &Path) -> RunTables {
    RunTables::open(root).unwrap()
}

fn ids(report: &Report) -> Vec<&'static str> {
    report.figures().iter().map(|figure| figure.id).collect()
}

fn caption<'a>(report: &'a Report, id: &str) -> &'a str {
    let mut figures = report.figures().iter();
    &figures.find(|figure| figure.id == id).unwrap().caption
}

const OF_WEAR: [&str; 7] = [
    "states",
    "roughness",
    "contact-area",
    "stiffness",
    "wear-rate",
    "depth",
    "dissipation",
];

#[test]
fn each_run_has_the_figures_of_its_physics() {
    let folder = TempDir::new().unwrap();
    let slider = format!("{OSCILLATOR}{SLIDER}");
    let resonator = RESONATOR.replace(
        "curves_every = 0",
        "curves_every = 2\nresponse_at = [100_000]",
    );
    let of_contact = ["pressure", "pressure-histogram", "indentation"];
    let of_vibration = ["forced-response", "joint-cycle"];
    let cases: [(&str, &str, Vec<&str>); 5] = [
        ("pressed", STATIC, [&["surface"][..], &of_contact].concat()),
        (
            "worn",
            WORN,
            [
                &["surface", "wear-map", "section", "hysteresis-loops"][..],
                &OF_WEAR,
                &of_contact,
            ]
            .concat(),
        ),
        (
            "resonator",
            &resonator,
            [
                &["surface", "wear-map", "section", "hysteresis-loops"][..],
                &["resonance", "contact-elements", "responses-over-wear"],
                &["resonance-shape", "contact-mesh"],
                &OF_WEAR,
                &of_contact,
                &of_vibration,
            ]
            .concat(),
        ),
        (
            "slider",
            &slider,
            [&of_vibration[..], &["hysteresis-loops"]].concat(),
        ),
        ("linear", OSCILLATOR, vec!["forced-response"]),
    ];
    for (name, scene, mut expected) in cases {
        let report = Report::new(&[open(&compute(&folder, name, scene, None))]).unwrap();
        let mut found = ids(&report);
        found.sort_unstable();
        expected.sort_unstable();
        assert_eq!(found, expected, "{name}");
        let html = report.html();
        for figure in report.figures() {
            assert!(html.contains(&format!("<figure id=\"fig-{}\">", figure.id)));
            assert!(html.contains(&format!("href=\"#fig-{}\"", figure.id)));
            assert!(!figure.caption.contains("NaN"), "{}", figure.caption);
        }
        // Each column that a figure names exists in its table.
        for (table, columns) in report.figures().iter().flat_map(|figure| &figure.sources) {
            let schema = TableName::from_name(table).unwrap().schema();
            for column in columns {
                assert!(schema.column(column).is_some(), "{table}.{column}");
            }
        }
        drawings_are_sound(&report, &folder.path().join(format!("{name}_svg")));
    }
}

/// Largest share of the omitted modes in the response. A coarse structure with few modes has 2.5 %; the published case has 0.06 %.
const RESIDUAL: f64 = 0.05;

/// The modes at the outline give the displacement of the response point under the stored forces. The run stores the same displacement.
#[test]
fn the_shape_of_a_resonance_is_that_of_the_run() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "resonator", RESONATOR, None);
    let report = Report::new(&[open(&root)]).unwrap();
    let caption = caption(&report, "resonance-shape");
    let (_, told) = caption.split_once("these modes is ").expect(caption);
    let (own, run) = told.split_once(", and the run has ").expect(caption);
    let [own, run] =
        [own, run].map(|text| text.trim_end_matches('.').split_once('\u{a0}').unwrap());
    assert_eq!(own.1, run.1, "{caption}");
    let [own, run] = [own, run].map(|(number, _)| number.parse::<f64>().unwrap());
    assert!((own / run - 1.0).abs() < RESIDUAL, "{caption}");
    assert!(own != 0.0, "{caption}");
}

/// Each SVG file is well-formed XML with at least one mark and finite coordinates.
fn drawings_are_sound(report: &Report, folder: &Path) {
    const COORDINATES: [&str; 12] = [
        "x", "y", "x1", "y1", "x2", "y2", "cx", "cy", "r", "width", "height", "points",
    ];
    report.write_svgs(folder).unwrap();
    for figure in report.figures() {
        let text = std::fs::read_to_string(folder.join(format!("{}.svg", figure.id))).unwrap();
        let mut reader = Reader::from_str(&text);
        let mut marks = 0;
        loop {
            let event = reader.read_event().unwrap();
            let (Event::Start(element) | Event::Empty(element)) = &event else {
                if event == Event::Eof {
                    break;
                }
                continue;
            };
            marks +=
                usize::from(["polyline", "image", "circle"].contains(&element.name().as_ref()));
            for attribute in element.attributes() {
                let attribute = attribute.unwrap();
                let name = attribute.key.as_ref().to_owned();
                let value = attribute.value.to_string();
                if COORDINATES.contains(&name.as_str()) && value != "100%" {
                    for number in value.split([' ', ',']).filter(|part| !part.is_empty()) {
                        let number: f64 = number.parse().unwrap_or_else(|_| {
                            panic!("{}: {name}=\"{number}\"", figure.id);
                        });
                        assert!(number.is_finite(), "{}: {name}", figure.id);
                    }
                }
            }
        }
        assert!(marks > 0, "{} is empty", figure.id);
    }
}

/// A caption quotes the first and the last value of a column in the unit of the figure.
#[test]
fn captions_say_what_the_tables_say() {
    let folder = TempDir::new().unwrap();
    let run = open(&compute(&folder, "worn", WORN, None));
    let report = Report::new(std::slice::from_ref(&run)).unwrap();
    let summary = run.series(TableName::Summary).unwrap().unwrap();
    let ends = |column: &str| {
        let values = numeric_column(&summary, column).unwrap();
        [values[0], values[values.len() - 1]]
    };
    // True if the text contains the value, to the digits that the report prints.
    let has = |caption: &str, value: f64| {
        let text = caption.replace('−', "-");
        let words = text.split(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-'));
        let words = words.map(|word| word.trim_end_matches('.'));
        let mut found = words.filter_map(|word| word.parse::<f64>().ok());
        found.any(|number| (number - value).abs() <= 5.1e-4 * value.abs())
    };
    for (figure, column, unit) in [
        ("stiffness", "kn", 1e6),
        ("stiffness", "kt", 1e6),
        ("roughness", "rq", 1e-6),
        ("contact-area", "contact_area_fraction", 0.01),
        ("contact-area", "max_pressure", 1e6),
    ] {
        for value in ends(column) {
            let caption = caption(&report, figure);
            assert!(has(caption, value / unit), "{column} {value}: {caption}");
        }
    }
    let field = run
        .iteration_table(run.latest(), TableName::WearField)
        .unwrap()
        .unwrap();
    let depth = numeric_column(&field, "wear_depth").unwrap();
    let deepest = depth.iter().copied().fold(0.0, f64::max);
    let text = caption(&report, "wear-map");
    assert!(
        has(text, deepest / 1e-6) || has(text, deepest / 1e-9),
        "{text}"
    );
    // The table of results shows the value with its error bar.
    let bar = ends("error_kn")[1];
    assert!(bar > 0.0);
    let html = report.html();
    let row = html
        .lines()
        .find(|line| line.contains("<td>kn</td>"))
        .unwrap();
    assert!(
        row.contains(&format!("± {}", fretwear::report::percent(bar))),
        "{row}"
    );
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "worn", WORN, None);
    let html = || Report::new(&[open(&root)]).unwrap().html();
    assert_eq!(html(), html());
}

#[test]
fn a_run_that_is_not_at_its_end_says_so_on_top() {
    let folder = TempDir::new().unwrap();
    let stopped = Report::new(&[open(&begin(&folder, "begun", WORN, 2))]).unwrap();
    let html = stopped.html();
    let banner = html
        .find("In progress: begun stopped before its end")
        .unwrap();
    assert!(banner < html.find("<nav").unwrap());
    assert!(html.contains("of 400·10³ cycles"));
    let million = WORN.replace("cycles = 400_000", "cycles = 1_000_000");
    let million = Report::new(&[open(&begin(&folder, "million", &million, 2))]).unwrap();
    assert!(million.html().contains("of 10⁶\u{a0}cycles"));
    let done = Report::new(&[open(&compute(&folder, "done", WORN, None))]).unwrap();
    assert!(!done.html().contains("In progress"));
}

/// One chart shows the curves of all runs with a legend. A run without the physics of a chart is missing there.
#[test]
fn several_runs_share_their_charts() {
    let folder = TempDir::new().unwrap();
    let rougher = WORN.replace("\"2 um\"", "\"3 um\"");
    let runs = [
        ("smooth", WORN),
        ("rough & ready", rougher.as_str()),
        ("pressed", STATIC),
    ]
    .map(|(name, scene)| open(&compute(&folder, name, scene, None)));
    let report = Report::new(&runs).unwrap();
    let svg = folder.path().join("svg");
    drawings_are_sound(&report, &svg);
    let stiffness = std::fs::read_to_string(svg.join("stiffness.svg")).unwrap();
    for name in ["smooth", "rough &amp; ready"] {
        assert!(stiffness.contains(&format!(">{name}</text>")), "{name}");
    }
    assert!(!stiffness.contains(">pressed</text>"));
    let pressure = std::fs::read_to_string(svg.join("pressure.svg")).unwrap();
    assert!(pressure.contains(">pressed: pressure, without wear</text>"));
    // The two colours have different dashes.
    assert!(stiffness.contains("class=\"s6\"") && stiffness.contains("class=\"s7\""));
    let html = report.html();
    assert!(html.contains("Comparison of 3 runs") && html.contains("rough &amp; ready"));
    assert!(!html.contains("rough & ready"));
}

#[test]
fn the_page_needs_no_other() {
    let folder = TempDir::new().unwrap();
    let mut report = Report::new(&[open(&compute(&folder, "worn", WORN, None))]).unwrap();
    let section = Section {
        id: "claims",
        title: "Claims".to_owned(),
        html: html! { p { "judged" } },
    };
    report.add_section(section);
    let html = report.html();
    for fetched in ["http:", "https:", "<script ", "url(", "@import", "src=\""] {
        let found = html.match_indices(fetched);
        assert_eq!(found.count(), 0, "{fetched}");
    }
    // The page contains exactly one script. Its policy forbids other scripts and all downloads.
    assert_eq!(html.matches("<script").count(), 1);
    let policy = html.find("http-equiv=\"Content-Security-Policy\"").unwrap();
    assert!(policy < html.find("<style>").unwrap());
    assert!(html.contains(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-"
    ));
    // Each anchor of the drawings exists exactly once in the page.
    let mut anchors: BTreeMap<&str, usize> = BTreeMap::new();
    for part in html.split(" id=\"").skip(1) {
        *anchors.entry(part.split('"').next().unwrap()).or_default() += 1;
    }
    assert!(anchors.values().all(|count| *count == 1), "{anchors:?}");
    for part in html.split("aria-labelledby=\"").skip(1) {
        assert!(anchors.contains_key(part.split('"').next().unwrap()));
    }
    for part in html.split("href=\"#").skip(1) {
        assert!(anchors.contains_key(part.split('"').next().unwrap()));
    }
    let stands = |html: &str, text: &str| html.find(text).unwrap_or_else(|| panic!("no {text}"));
    let figure = "id=\"fig-stiffness\"";
    assert!(stands(&html, "<p>judged</p>") > stands(&html, figure));
    // The page of a study has another title and begins with its first section.
    let first = Section {
        id: "first",
        title: "First".to_owned(),
        html: html! { p { "begun" } },
    };
    report.set_title_and_first_section("A study", first);
    let html = report.html();
    assert!(stands(&html, "<p>begun</p>") < stands(&html, figure));
    assert!(html.contains("<h1>A study</h1>") && html.contains("<summary>The runs</summary>"));
}

fn fretwear(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fretwear"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .unwrap()
}

#[test]
fn the_command_writes_where_it_says() {
    let folder = TempDir::new().unwrap();
    let root = compute(&folder, "worn", WORN, None);
    compute(&folder, "pressed", STATIC, None);
    let code = |arguments: &[&str]| {
        let output = fretwear(&folder, arguments);
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).unwrap();
        (
            output.status.code().unwrap(),
            text(&output.stdout),
            text(&output.stderr),
        )
    };
    let there = |name: &str| folder.path().join(name).is_file();
    let (exit, out, error) = code(&["report", "worn", "--svg", "figures"]);
    assert_eq!(
        (exit, out.trim(), error.as_str()),
        (0, "worn/report.html", "")
    );
    assert!(there("worn/report.html") && there("figures/stiffness.svg"));
    // `verify` accepts a page in the folder of the run.
    assert_eq!(code(&["verify", "worn"]).0, 0);
    assert_eq!(code(&["report", "worn", "pressed"]).1.trim(), "report.html");
    assert!(there("report.html"));
    assert_eq!(code(&["report", "pressed", "-o", "p.html"]).0, 0);
    assert!(there("p.html"));
    // The page contains the claims of the paper only with `--claims`.
    let claims = |name: &str| {
        let page = std::fs::read_to_string(folder.path().join(name)).unwrap();
        page.contains("<section id=\"claims\">")
    };
    assert!(!claims("p.html") && !claims("report.html"));
    assert_eq!(code(&["report", "worn", "--claims", "-o", "c.html"]).0, 0);
    assert!(claims("c.html"));

    let (exit, _, error) = code(&["report", "absent"]);
    assert!(exit == 2 && error.contains("absent"), "{error}");
    assert_eq!(code(&["report"]).0, 2);
    let (exit, _, error) = code(&["report", "worn", "-o", "no/such/folder/r.html"]);
    assert!(
        exit == 1 && error.contains("no/such/folder/r.html"),
        "{error}"
    );

    damage(&summary_file(&root, 2));
    let (exit, _, error) = code(&["report", "worn"]);
    assert!(exit == 4 && error.contains("wear_iteration=2"), "{error}");
    let html = std::fs::read_to_string(root.join("report.html")).unwrap();
    assert!(html.contains("Damaged: ") && html.contains("In progress: worn"));

    // The report reads the scene from the run's record. A damaged scene file does not matter.
    std::fs::write(root.join("scene.toml"), "[joint").unwrap();
    let (exit, _, error) = code(&["report", "worn"]);
    assert!(exit == 4 && !error.contains("scene"), "{error}");
}

/// A title and a folder may have any name. The page shows the name as text.
#[cfg(unix)]
#[test]
fn foreign_text_is_only_text() {
    let folder = TempDir::new().unwrap();
    let scene = format!("title = \"<script>'\\u001b[2J\\u202e\"\n{STATIC}");
    let name = "<script>\" '|`\u{1b}[2J\u{202e}";
    let runs = [name, "b"].map(|name| open(&compute(&folder, name, &scene, None)));
    let report = Report::new(&runs).unwrap();
    let page = report.html();
    let svgs = folder.path().join("svgs");
    drawings_are_sound(&report, &svgs);
    let files = std::fs::read_dir(svgs).unwrap();
    let svgs = files.map(|file| std::fs::read_to_string(file.unwrap().path()).unwrap());
    for text in svgs.chain([page.clone()]) {
        assert!(!text.contains(['\u{1b}', '\u{202e}']), "{text}");
        // The page contains one script of the program.
        let own = usize::from(text.starts_with("<!DOCTYPE html>"));
        assert_eq!(text.matches("<script").count(), own, "{text}");
    }
    assert!(page.contains("&lt;script&gt;'\\u{1b}[2J\\u{202e}"));
    assert!(page.contains("&lt;script&gt;&quot; '|`\\u{1b}[2J\\u{202e}"));
}
