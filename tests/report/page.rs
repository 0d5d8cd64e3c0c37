//! The report of runs: what figures it has, and that they and its words say what the tables say.

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
        // All columns that a figure names are columns of its table.
        for (table, columns) in report.figures().iter().flat_map(|figure| &figure.sources) {
            let schema = TableName::from_name(table).unwrap().schema();
            for column in columns {
                assert!(schema.column(column).is_some(), "{table}.{column}");
            }
        }
        drawings_are_sound(&report, &folder.path().join(format!("{name}_svg")));
    }
}

/// What modes that are left out may have of the response, in a coarse structure of few modes: 2.5 %. Of the published case it is 0.06 %.
const RESIDUAL: f64 = 0.05;

/// The modes at the outline, under the forces that are stored, move the response point as the run says.
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

/// Every file is well-formed XML with drawn things in it, whose coordinates are numbers.
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

/// The first and the last value of a column stand in the caption, in the unit that it is shown in.
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
    // Numbers of a text, and whether one of them is a value to the digits that are shown.
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
    // And in the table of results, with the error bar.
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

/// Curves of all runs in one chart, with a legend; a run takes part where it has the physics.
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
    // Two colours with their own dashes.
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
    // One script, its own; the page lets no other run, and lets nothing be fetched.
    assert_eq!(html.matches("<script").count(), 1);
    let policy = html.find("http-equiv=\"Content-Security-Policy\"").unwrap();
    assert!(policy < html.find("<style>").unwrap());
    assert!(html.contains(
        "default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-"
    ));
    // What the drawings refer to is in the page, once.
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
    // A study has another title, and begins with what it is about.
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
    // A page in the folder is no damage to the run.
    assert_eq!(code(&["verify", "worn"]).0, 0);
    assert_eq!(code(&["report", "worn", "pressed"]).1.trim(), "report.html");
    assert!(there("report.html"));
    assert_eq!(code(&["report", "pressed", "-o", "p.html"]).0, 0);
    assert!(there("p.html"));
    // The paper's claims stand where they are asked for.
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

    // The scene is the one that the run was computed with, whatever became of its file.
    std::fs::write(root.join("scene.toml"), "[joint").unwrap();
    let (exit, _, error) = code(&["report", "worn"]);
    assert!(exit == 4 && !error.contains("scene"), "{error}");
}

/// A title and a folder may be called anything: the page shows it, and does nothing else.
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
        // The page has one of its own.
        let own = usize::from(text.starts_with("<!DOCTYPE html>"));
        assert_eq!(text.matches("<script").count(), own, "{text}");
    }
    assert!(page.contains("&lt;script&gt;'\\u{1b}[2J\\u{202e}"));
    assert!(page.contains("&lt;script&gt;&quot; '|`\\u{1b}[2J\\u{202e}"));
}
