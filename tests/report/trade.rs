//! What a trade concludes, on tables made by hand.

use fretwear::report::trade::{
    Bars, COUNT, Cost, FIELD, Row, Trade, Values, WearField, chart, field_error, findings, html,
    markdown, pareto,
};
use fretwear::scene::variants::{KnobKind, Variant};

fn row(name: &str, kind: KnobKind, size: f64, seconds: f64, error: Option<f64>) -> Row {
    let (knob, value) = name.split_once('-').unwrap_or(("preset", name));
    let mut values: Values = [None; COUNT];
    let mut errors: Values = [None; COUNT];
    (values[0], errors[0]) = (error.map(|error| 2.0 * (1.0 + error)), error);
    Row {
        variant: Variant {
            name: name.to_owned(),
            knob: match knob {
                "grid" => "grid",
                "wear_tolerance" => "wear_tolerance",
                _ => "preset",
            },
            kind,
            value: value.to_owned(),
            size,
            sets: Vec::new(),
        },
        failure: error.is_none().then(|| "no <luck>".to_owned()),
        seconds,
        fft_pairs: 10.0 * seconds,
        memory: 1_000_000,
        iterations: 3,
        pareto: error.is_some(),
        values,
        worst: error.map(f64::abs),
        errors,
        bars: Bars {
            volume: error.map(|error| 2.0 * error.abs()),
            closure: error.filter(|_| knob == "grid").map(|_| 0.0123),
        },
        field: None,
    }
}

fn example() -> Trade {
    let (preset, solver, mesh) = (KnobKind::Preset, KnobKind::Solver, KnobKind::Discretisation);
    Trade {
        name: "made & up".to_owned(),
        rows: vec![
            row("balanced", preset, 0.0, 10.0, Some(0.005)),
            row("reference", preset, 0.0, 100.0, Some(0.0)),
            row("fast", preset, 0.0, 4.0, Some(-0.06)),
            row("wear_tolerance-0.03", solver, 33.0, 8.0, Some(0.009)),
            row("wear_tolerance-0.1", solver, 10.0, 5.0, Some(0.04)),
            row("wear_tolerance-0.001", solver, 1000.0, 30.0, Some(-0.001)),
            row("grid-32", mesh, 32.0, 2.0, Some(0.2)),
            row("grid-128", mesh, 128.0, 50.0, Some(0.008)),
            row("grid-256", mesh, 256.0, 0.0, None),
        ],
        base: vec![
            ("wear_tolerance", "0.01".to_owned(), 100.0),
            ("grid", "64".to_owned(), 64.0),
        ],
        machine: None,
        scene_hash: String::new(),
    }
}

#[test]
fn the_front_is_what_nothing_beats() {
    let points = [
        Some((1.0, 0.5)),
        Some((2.0, 0.5)), // slower, no better
        Some((2.0, 0.1)),
        Some((2.0, 0.1)), // its twin: neither beats the other
        None,             // failed
        Some((1.5, 0.6)),
        Some((9.0, 0.0)),
        Some((0.5, 3.0)),
    ];
    let expected = [true, false, true, true, false, false, true, true];
    assert_eq!(pareto(&points), expected);
    assert_eq!(pareto(&[]), Vec::<bool>::new());
}

#[test]
fn a_field_on_another_grid_is_compared_piece_by_piece() {
    let coarse = WearField {
        cells: [2, 1],
        depth: vec![1.0, 3.0],
    };
    // Along x in thirds: the middle one lies half in either cell of the other.
    let fine = WearField {
        cells: [3, 2],
        depth: vec![1.0, 1.0, 2.0, 2.0, 3.0, 6.0],
    };
    // |1 - 2| over a sixth, |3 - 2| over a sixth, |3 - 6| over a sixth, of a mean of 2.5.
    let expected = (1.0 / 6.0 + 1.0 / 6.0 + 3.0 / 6.0) / 2.5;
    let error = field_error(&coarse, &fine).expect("an error");
    assert!((error - expected).abs() < 1e-15, "{error} for {expected}");
    assert_eq!(field_error(&fine, &fine), Some(0.0));
    // The same heights on twice the cells are the same field.
    let doubled = WearField {
        cells: [4, 3],
        depth: [1.0, 1.0, 3.0, 3.0].iter().flat_map(|d| [*d; 3]).collect(),
    };
    assert_eq!(field_error(&doubled, &coarse), Some(0.0));
    let none = WearField {
        cells: [1, 1],
        depth: vec![0.0],
    };
    assert_eq!(field_error(&fine, &none), None);
    assert_eq!(field_error(&none, &none), Some(0.0));
}

#[test]
fn it_says_what_buys_most_and_what_is_not_converged() {
    let found = findings(&example());
    let kept: Vec<(&str, bool)> = found
        .promises
        .iter()
        .map(|kept| (kept.preset.as_str(), kept.passed))
        .collect();
    assert_eq!(kept, [("balanced", true), ("fast", false)]);
    let savings: Vec<(f64, Cost, &str)> = found
        .savings
        .iter()
        .map(|saving| {
            let buy = saving.buy.as_ref().expect("a knob");
            (saving.within, saving.cost, buy.variant.as_str())
        })
        .collect();
    let expected = [
        (0.01, Cost::Seconds, "wear_tolerance-0.03"),
        (0.01, Cost::FftPairs, "wear_tolerance-0.03"),
        (0.05, Cost::Seconds, "wear_tolerance-0.1"),
        (0.05, Cost::FftPairs, "wear_tolerance-0.1"),
    ];
    assert_eq!(savings, expected);
    let first = found.savings[0].buy.as_ref().expect("a knob");
    assert_eq!((first.saved, first.saved_part), (2.0, 0.2));
    // The finer grid does not come closer to the reference's, and is no gain in accuracy.
    let accuracy = found.accuracy.as_ref().expect("a knob");
    assert_eq!(accuracy.variant, "wear_tolerance-0.001");
    let [grid] = &found.convergence[..] else {
        panic!("{:?}", found.convergence);
    };
    let steps: Vec<(&str, &str, usize)> = grid
        .steps
        .iter()
        .map(|step| (&step.from[..], &step.to[..], step.not_converged().len()))
        .collect();
    // 0.2 against 0.005 changes much, 0.005 against 0.008 little; what failed is no step.
    assert_eq!(steps, [("32", "64", 1), ("64", "128", 0)]);
    assert_eq!(grid.steps[0].change[FIELD], None);
    assert!(found.without_effect.is_empty());
}

/// The numbers of all attributes that place something.
fn coordinates(svg: &str) -> Vec<f64> {
    let names = [
        "x", "y", "x1", "x2", "y1", "y2", "cx", "cy", "r", "width", "height",
    ];
    let mut found = Vec::new();
    for part in svg.split_whitespace() {
        if let Some((name, value)) = part.split_once("=\"")
            && (names.contains(&name) || name == "points")
        {
            let end = value.find('"').unwrap_or(value.len());
            for number in value[..end].split(',').filter(|number| !number.is_empty()) {
                found.push(
                    number
                        .parse()
                        .unwrap_or_else(|_| panic!("{part} is no number")),
                );
            }
        }
    }
    found
}

#[test]
fn the_chart_has_finite_coordinates_and_every_variant() {
    let trade = example();
    let svg = chart(&trade).expect("a chart");
    let numbers = coordinates(&svg);
    assert!(numbers.len() > 50);
    for number in numbers {
        assert!((-1e4..1e4).contains(&number), "{number}");
    }
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
    // A mark for each of the 8 that came to their end, and one a knob in the legend.
    assert_eq!(svg.matches("<circle").count(), 8 + 3);
    for name in ["reference", "wear_tolerance", "made &amp; up"] {
        assert!(svg.contains(name), "{name}");
    }
    // Nothing but the reference: no error has a logarithm.
    let mut alone = trade;
    alone.rows.truncate(2);
    alone.rows.remove(0);
    coordinates(&chart(&alone).expect("a chart"));
    alone.rows.clear();
    coordinates(&chart(&alone).expect("a chart"));
}

#[test]
fn a_failure_is_shown_and_escaped() {
    let trade = example();
    let found = findings(&trade);
    let left_out = [("cycle".to_owned(), "it stands still | there".to_owned())];
    let text = markdown(&trade, &found, &left_out);
    assert!(text.contains("- grid = 256: no \\<luck>\n"), "{text}");
    assert!(
        text.contains("| grid = 256 | 0.000 | 0 | 3 | 1 MB | – | – | – |\n"),
        "{text}"
    );
    assert!(
        text.contains("| fast | 4.00 | 40 | 3 | 1 MB | −6 % | 12 % | – |\n"),
        "{text}"
    );
    let svg = chart(&trade).expect("a chart");
    let page = html(&trade, &found, &left_out, &svg);
    assert!(page.contains("no &lt;luck&gt;") && page.contains("made &amp; up"));
    let table = trade.table().expect("a table");
    assert_eq!(
        table.maybe_f64("error_wear_volume").expect("errors")[8],
        None
    );
}

/// A scene's file may have any name, and a failure quotes whatever a file says.
#[test]
fn foreign_text_is_only_text() {
    let mut trade = example();
    let hostile = "<script>|`![x](y)\u{1b}[2J\u{202e}";
    trade.name = hostile.to_owned();
    trade.rows[8].failure = Some(format!("{hostile}\n| not a row"));
    let left_out = [("cycle".to_owned(), hostile.to_owned())];
    let found = findings(&trade);
    let text = markdown(&trade, &found, &left_out);
    let shown = "\\<script>|\\`!\\[x](y)\\\\u{1b}\\[2J\\\\u{202e}";
    assert_eq!(text.matches(shown).count(), 3, "{text}");
    assert!(!text.contains("\n| not a row"), "{text}");
    let svg = chart(&trade).expect("a chart");
    let page = html(&trade, &found, &left_out, &svg);
    for text in [&text, &svg, &page] {
        assert!(!text.contains(['\u{1b}', '\u{202e}']), "{text}");
        assert!(!text.replace("\\<", "").contains("<script"), "{text}");
    }
}
