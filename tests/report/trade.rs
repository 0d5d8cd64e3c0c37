//! Conclusions of a trade from handmade tables.

use fretwear::recipe::MotionKind;
use fretwear::report::trade::{
    Cost, FIELD, Row, Trade, Values, WearField, field_error, findings, misses, noise, page,
    page_of_scenes, pareto, table, tallies,
};
use fretwear::scene::variants::{KnobKind, Variant};

/// Row of a trade. The CPU time is 1e-3 s per FFT pair, and the elapsed time is twice the CPU time.
fn row(name: &str, kind: KnobKind, size: f64, pairs: f64, error: Option<f64>) -> Row {
    let (knob, value) = name.split_once('-').unwrap_or(("preset", name));
    let (mut values, mut errors, mut bars): (Values, Values, Values) = Default::default();
    (values[0], errors[0]) = (error.map(|error| 2.0 * (1.0 + error)), error);
    bars[0] = error.map(|error| 2.0 * error.abs());
    Row {
        variant: Variant {
            name: name.to_owned(),
            knob: match knob {
                "grid" => "grid",
                "wear_tolerance" => "wear_tolerance",
                "balanced_again" => "repeat",
                _ => "preset",
            },
            kind,
            value: value.to_owned(),
            size,
            sets: Vec::new(),
        },
        failure: error.is_none().then(|| "no <luck>".to_owned()),
        seconds: 2e-3 * pairs,
        cpu_seconds: Some(1e-3 * pairs),
        fft_pairs: pairs,
        cost: pairs,
        memory: 1_000_000,
        iterations: 3,
        pareto: error.is_some() && name != "reference",
        values,
        largest_promised_error: error.map(f64::abs),
        errors,
        bars,
        closure: error.filter(|_| knob == "grid").map(|_| 0.0123),
        field: None,
    }
}

fn example() -> Trade {
    let (preset, solver, mesh) = (KnobKind::Preset, KnobKind::Solver, KnobKind::Discretisation);
    Trade {
        name: "made & up".to_owned(),
        motion: MotionKind::Line,
        rows: vec![
            row("balanced", preset, 0.0, 1000.0, Some(0.005)),
            row("reference", preset, 0.0, 10000.0, Some(0.0)),
            row("fast", preset, 0.0, 400.0, Some(-0.06)),
            row("wear_tolerance-0.03", solver, 33.0, 800.0, Some(0.009)),
            row("wear_tolerance-0.1", solver, 10.0, 500.0, Some(0.04)),
            row("wear_tolerance-0.001", solver, 1000.0, 3000.0, Some(-0.001)),
            row("grid-32", mesh, 32.0, 200.0, Some(0.2)),
            row("grid-128", mesh, 128.0, 5000.0, Some(0.008)),
            row("grid-256", mesh, 256.0, 0.0, None),
            row("balanced_again", KnobKind::Repeat, 0.0, 1000.0, Some(0.005)),
        ],
        base: vec![
            ("wear_tolerance", "0.01".to_owned(), 100.0),
            ("grid", "64".to_owned(), 64.0),
        ],
        cost_measure: Cost::FftPairs,
        noise: Some(0.04),
        machine: None,
        scene_hash: String::new(),
    }
}

#[test]
fn the_front_is_what_nothing_beats() {
    let points = [
        Some((1.0, 0.5)),
        Some((2.0, 0.5)), // slower, not more accurate
        Some((2.0, 0.1)),
        Some((2.0, 0.1)), // equal rows: neither dominates
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
    // The cells along x are thirds. Half of the middle cell overlaps each cell of the other grid.
    let fine = WearField {
        cells: [3, 2],
        depth: vec![1.0, 1.0, 2.0, 2.0, 3.0, 6.0],
    };
    // |1 - 2| over a sixth, |3 - 2| over a sixth, and |3 - 6| over a sixth of the area, relative to a mean of 2.5.
    let expected = (1.0 / 6.0 + 1.0 / 6.0 + 3.0 / 6.0) / 2.5;
    let error = field_error(&coarse, &fine).expect("an error");
    assert!((error - expected).abs() < 1e-15, "{error} for {expected}");
    assert_eq!(field_error(&fine, &fine), Some(0.0));
    // The same depths on a finer grid are the same field.
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
    let savings: Vec<(f64, &str)> = found
        .savings
        .iter()
        .map(|saving| {
            let buy = saving.buy.as_ref().expect("a knob");
            (saving.within, buy.variant.as_str())
        })
        .collect();
    let expected = [(0.01, "wear_tolerance-0.03"), (0.05, "wear_tolerance-0.1")];
    assert_eq!(savings, expected);
    let first = found.savings[0].buy.as_ref().expect("a knob");
    assert_eq!((first.saved, first.saved_part), (200.0, 0.2));
    // The finer grid is not closer to the reference. The grid is therefore no gain in accuracy.
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
    // The step from 0.2 to 0.005 is a large change; the step from 0.005 to 0.008 is small. A failed row is not a step.
    assert_eq!(steps, [("32", "64", 1), ("64", "128", 0)]);
    assert_eq!(grid.steps[0].change[FIELD], None);
    assert!(found.without_effect.is_empty());
}

/// A cost in seconds counts as a difference only if it exceeds the noise. With unknown noise, no difference in seconds counts.
#[test]
fn noise_is_no_advice() {
    let mut trade = example();
    let pairs = findings(&trade);
    trade.cost_measure = Cost::Seconds;
    trade
        .rows
        .iter_mut()
        .for_each(|row| row.cost = 1e-3 * row.fft_pairs);
    let told = |trade: &Trade| {
        let found = findings(trade);
        let saved = |saving: usize| {
            let buy = found.savings[saving].buy.as_ref();
            buy.map(|buy| buy.variant.clone())
        };
        (saved(0), saved(1), found.accuracy.map(|buy| buy.variant))
    };
    let name = |name: &str| Some(name.to_owned());
    let (third, tenth) = (name("wear_tolerance-0.03"), name("wear_tolerance-0.1"));
    let finest = name("wear_tolerance-0.001");
    assert_eq!(told(&trade), (third, tenth.clone(), finest.clone()));
    // Equal runs differ by 25 %. A saving of 20 % of the seconds is then no saving.
    trade.noise = Some(0.25);
    assert_eq!(told(&trade), (None, tenth, finest));
    trade.noise = None;
    assert_eq!(told(&trade), (None, None, None));
    let text = page(&trade, &[]).markdown();
    assert!(text.contains("noise is not known"), "{text}");
    // A more accurate row costs 10 % more seconds, within the noise. FFT pairs have no noise, so their difference always counts.
    let dear = 3337.0 / 966.0;
    for (by, noise, words) in [
        (Cost::Seconds, 0.3, "costs no more within the noise"),
        (Cost::FftPairs, 0.3, "costs 2454 FFT pairs more, 245 %"),
    ] {
        (trade.cost_measure, trade.noise) = (by, Some(noise));
        trade.rows[5].cost = match by {
            Cost::Seconds => 1.1,
            Cost::FftPairs => 1000.0 * dear,
        };
        trade.rows[0].cost = if by == Cost::Seconds { 1.0 } else { 1000.0 };
        let text = page(&trade, &[]).markdown();
        assert!(text.contains(words), "{text}");
    }
    assert_eq!(pairs.noise, Some(0.04));
}

#[test]
fn noise_is_what_iterations_of_equal_runs_differ_by() {
    // The sums are equal, but the single values differ.
    assert_eq!(noise(&[1.0, 2.0, 3.0], &[1.5, 1.5, 3.0]), Some(1.0 / 6.0));
    assert_eq!(noise(&[1.0], &[1.0]), Some(0.0));
    assert_eq!(noise(&[1.0], &[1.0, 1.0]), None);
    assert_eq!(noise(&[], &[]), None);
}

/// Width of a letter relative to the font size: the average over names in DejaVu Sans, the widest font in use.
const WIDTH_OF_LETTER: f64 = 0.6;

/// Text of a drawing and its box: left, top, right, bottom.
#[derive(Debug)]
struct PlacedAxis {
    text: String,
    place: [f64; 4],
}

fn attribute<'a>(tag: &'a str, name: &str) -> &'a str {
    let begin = tag.find(&format!(" {name}=\"")).expect(name) + name.len() + 3;
    let end = tag[begin..].find('"').expect("a quote");
    &tag[begin..begin + end]
}

fn texts(svg: &str) -> Vec<PlacedAxis> {
    let parts = svg.split("<text").skip(1);
    parts
        .map(|part| {
            let (tag, rest) = part.split_once('>').expect("a tag");
            let text = rest.split_once("</text>").expect("its end").0;
            let text = ["&amp;", "&lt;", "&gt;"]
                .iter()
                .fold(text.to_owned(), |text, entity| text.replace(entity, "&"));
            let number = |name| -> f64 { attribute(tag, name).parse().expect("a number") };
            let [x, y, size] = ["x", "y", "font-size"].map(number);
            let width = WIDTH_OF_LETTER * size * text.chars().count() as f64;
            let left = match attribute(tag, "text-anchor") {
                "middle" => x - 0.5 * width,
                "end" => x - width,
                _ => x,
            };
            // Ascent and descent of a line of DejaVu Sans, relative to the font size.
            let place = [left, y - 0.93 * size, left + width, y + 0.24 * size];
            PlacedAxis { text, place }
        })
        .collect()
}

/// Asserts that texts do not overlap, that texts lie within the drawing, and that all numbers are finite.
fn assert_readable(svg: &str) {
    assert!(!svg.contains("NaN") && !svg.contains("inf"), "{svg}");
    let tag = svg.split_once('>').expect("a tag").0;
    let [width, height] =
        ["width", "height"].map(|name| -> f64 { attribute(tag, name).parse().expect("a number") });
    let texts = texts(svg);
    assert!(texts.len() > 8, "{texts:?}");
    for (k, one) in texts.iter().enumerate() {
        let [left, top, right, bottom] = one.place;
        let is_inside = left >= 0.0 && top >= 0.0 && right <= width && bottom <= height;
        assert!(is_inside, "{one:?} is outside {width} x {height}");
        for other in &texts[..k] {
            let [l, t, r, b] = other.place;
            let meet = left < r && l < right && top < b && t < bottom;
            assert!(!meet, "{one:?} overlaps {other:?}");
        }
    }
}

/// True if the drawing contains the text.
fn says(svg: &str, text: &str) -> bool {
    texts(svg).iter().any(|placed| placed.text == text)
}

/// Lines of the chart in a text for a terminal.
fn chart(text: &str) -> Vec<&str> {
    let lines = text.lines().filter_map(|line| line.strip_prefix("    "));
    lines.collect()
}

/// Words of the chart between its title and the scale: numbers of the marks, ticks and names of promises.
fn marks(text: &str) -> Vec<String> {
    let lines = chart(text);
    let end = lines.iter().position(|line| line.contains(" +"));
    let end = end.expect("an axis");
    let areas = lines[1..=end].iter();
    let areas = areas.filter_map(|line| line.split_once(['|', '+']));
    let words = areas.flat_map(|(_, area)| area.split([' ', '.', '-']));
    let is_number = |word: &&str| word.starts_with(|c: char| c.is_ascii_digit());
    words.filter(is_number).map(str::to_owned).collect()
}

#[test]
fn the_chart_carries_the_numbers_of_the_table() {
    let trade = example();
    let shown = page(&trade, &[]);
    let (svg, text) = (shown.svg(), shown.plain(Some(100)));
    assert_readable(&svg);
    // The chart shows the 7 rows with an error and the reference at the edge. Failed and repeated rows are missing.
    assert_eq!(svg.matches("class=\"mark\"").count(), 8);
    let expected = ["1*", "2", "3*", "4*", "5*", "6*", "7*", "8*"];
    for label in expected {
        assert!(says(&svg, label), "{label}");
    }
    assert!(!says(&svg, "9") && !says(&svg, "10*"));
    let mut found = marks(&text);
    found.retain(|word| !["5", "1"].contains(&word.as_str()));
    found.sort();
    assert_eq!(found, expected, "{text}");
    // Costs increase to the right and errors upwards. The reference is at the edge.
    let at = |label: &str| -> (usize, usize) {
        let lines = chart(&text);
        let of_line = |(k, line): (usize, &&str)| Some((k, line.find(label)?));
        lines.iter().enumerate().find_map(of_line).expect("a mark")
    };
    let [cheap, dear] = ["7*", "6*"].map(at);
    assert!(cheap.0 < dear.0 && cheap.1 < dear.1, "{text}");
    let axis = chart(&text).into_iter().find(|line| line.contains(" +"));
    assert!(axis.is_some_and(|axis| axis.contains("-2 -")), "{text}");
    // The title of each mark is the name of its row.
    let names = ["<title>1* balanced</title>", "<title>7* grid = 32</title>"];
    assert!(names.iter().all(|name| svg.contains(name)), "{svg}");
    assert!(text.contains("|  7* | grid = 32 "), "{text}");
    // Trades with only the reference, and without any row.
    let mut alone = trade;
    alone.rows.truncate(2);
    alone.rows.remove(0);
    assert_readable(&page(&alone, &[]).svg());
    alone.rows.clear();
    assert_readable(&page(&alone, &[]).svg());
    assert!(
        page(&alone, &[])
            .plain(Some(20))
            .contains("promise of fast")
    );
}

#[test]
fn a_terminal_has_lines_of_its_width() {
    let page = page(&example(), &[]);
    for width in [80, 120, 200] {
        let text = page.plain(Some(width));
        let lines = text.lines().filter(|line| line.starts_with(['|', ' ']));
        let longest = lines.map(|line| line.chars().count()).max();
        assert!(
            longest <= Some(width) && longest > Some(width / 2),
            "{width}: {text}"
        );
        // Each block of columns repeats the names of the rows.
        let heads = text.matches("|   # | variant ").count();
        assert_eq!(heads, text.matches("|  7* | grid = 32 ").count());
        assert!((width < 200) == (heads > 1), "{width}: {text}");
    }
}

/// Points may coincide, share one cost or one error, or span many decades. Foreign names may have any length.
#[test]
fn numbers_in_a_crowd_lie_side_by_side() {
    let mut trade = example();
    trade.name = "a name without end ".repeat(20);
    let spreads = [(0.0, 0.0), (1e-3, 1e-3), (0.3, 0.0), (0.0, 4.0), (6.0, 9.0)];
    for (along, up) in spreads {
        trade.rows.truncate(3);
        for k in 0..40 {
            let part = f64::from(k * 7 % 40) / 40.0 - 0.5;
            let (pairs, error) = (1000.0 * (along * part).exp(), 0.005 * (up * -part).exp());
            let name = format!("wear_tolerance-{k}e-7");
            trade
                .rows
                .push(row(&name, KnobKind::Solver, 1.0, pairs, Some(error)));
        }
        let shown = page(&trade, &[]);
        let (svg, text) = (shown.svg(), shown.plain(Some(120)));
        assert_readable(&svg);
        assert!(says(&svg, "promise of balanced: 1 %"));
        let marks = marks(&text);
        for number in 1..=43 {
            let label = format!("{number}{}", if number == 2 { "" } else { "*" });
            assert!(says(&svg, &label), "{label}, {along} {up}");
            assert!(marks.contains(&label), "{label}, {along} {up}: {text}");
        }
        // All costs lie within one decade and have many digits.
        let mut narrow = trade.clone();
        let costs = [110_000.0, 980_000.0, 300_000.0].into_iter().cycle();
        for (row, cost) in narrow.rows.iter_mut().zip(costs) {
            (row.cost, row.largest_promised_error) = (
                cost,
                row.largest_promised_error.map(|_| 0.012 + 1e-8 * cost),
            );
        }
        assert_readable(&page(&narrow, &[]).svg());
    }
}

/// Scene with the given errors of the presets and the given error bar of `fast`.
fn scene(name: &str, motion: MotionKind, errors: [f64; 2], bar: f64) -> Trade {
    let preset = KnobKind::Preset;
    let [balanced, fast] = errors;
    let mut trade = example();
    trade.name = name.to_owned();
    trade.motion = motion;
    trade.base = Vec::new();
    trade.rows = vec![
        row("fast", preset, 0.0, 100.0, Some(fast)),
        row("balanced", preset, 0.0, 300.0, Some(balanced)),
        row("reference", preset, 0.0, 1000.0, Some(0.0)),
    ];
    trade.rows[0].bars[0] = Some(bar);
    trade
}

fn scenes() -> Vec<Trade> {
    let (line, orbit) = (MotionKind::Line, MotionKind::Orbit);
    let mut failed = scene("lost | one", orbit, [0.001, 0.02], 0.1);
    failed.rows[2].failure = Some("no\nluck".to_owned());
    failed.rows[2].values = Values::default();
    failed
        .rows
        .iter_mut()
        .for_each(|row| row.largest_promised_error = None);
    vec![
        scene("a", line, [0.001, 0.02], 0.1),
        scene("b", line, [-0.03, 0.04], 0.01),
        scene("c", line, [0.002, -0.3], 0.25),
        scene("d", orbit, [0.004, 0.01], 0.1),
        failed,
    ]
}

#[test]
fn presets_are_counted_by_kind_of_motion() {
    let scenes = scenes();
    let found = tallies(&scenes);
    let told: Vec<_> = found
        .iter()
        .map(|t| {
            (
                t.preset,
                t.motion.map_or("all", MotionKind::word),
                t.scenes,
                t.failed,
                t.kept,
            )
        })
        .collect();
    let expected = [
        ("balanced", "all", 4, 1, 3),
        ("balanced", "line", 3, 0, 2),
        ("balanced", "orbit", 1, 1, 1),
        ("fast", "all", 4, 1, 3),
        ("fast", "line", 3, 0, 2),
        ("fast", "orbit", 1, 1, 1),
    ];
    assert_eq!(told, expected);
    let all = &found[0];
    // The median of an even number of scenes is the mean of the two middle values.
    assert_eq!((all.median, all.worst), (Some(0.003), Some(0.03)));
    assert_eq!(all.worst_scene.as_deref(), Some("b"));
    assert_eq!(all.pairs_part, Some(0.3));
    // The error 0.04 exceeds the bar 0.01. A bar is relative to its figure, 0.7 here: the error 0.3 exceeds 0.25 times 0.7.
    let [volume] = &found[4].figures[..] else {
        panic!("{:?}", found[4].figures);
    };
    assert_eq!(
        (volume.scenes, volume.within, volume.worst),
        (3, 1, Some(0.3))
    );
    // A reference of zero has no relative error. The error bar still decides.
    let mut zero = scenes.clone();
    zero[0].rows[2].values[0] = Some(0.0);
    zero[0].rows[0].errors[0] = None;
    for (bar, within) in [(1.01, 1), (0.99, 0)] {
        zero[0].rows[0].bars[0] = Some(bar);
        let volume = &tallies(&zero)[4].figures[0];
        assert_eq!((volume.scenes, volume.within), (3, within), "{bar}");
    }
    assert_eq!(misses(&zero)[1][0].error, Some(1.0));
    let [promised, barred] = misses(&scenes);
    let names = |misses: &[fretwear::report::trade::Miss]| -> Vec<String> {
        misses
            .iter()
            .map(|miss| format!("{} {}", miss.scene, miss.preset))
            .collect()
    };
    assert_eq!(names(&promised), ["b balanced", "c fast"]);
    assert_eq!(names(&barred), ["b fast", "c fast"]);
}

#[test]
fn scenes_are_a_chart_a_table_and_a_text() {
    let scenes = scenes();
    let shown = page_of_scenes("a set", &scenes);
    let svg = shown.svg();
    assert_readable(&svg);
    // The chart shows two presets of four scenes. A star marks a row that misses its promise.
    assert_eq!(svg.matches("class=\"mark\"").count(), 8);
    for (label, name) in [("5*", "b, balanced"), ("7*", "c, fast"), ("1", "a, fast")] {
        assert!(says(&svg, label), "{label}");
        assert!(
            svg.contains(&format!("<title>{label} {name}</title>")),
            "{name}"
        );
    }
    let text = shown.markdown();
    for part in [
        "| balanced, line ",
        " 3 of 4 |",
        "| 4 of 5 |",
        "| b, balanced ",
        " 1 %: FAIL |",
        "- b, balanced: volume −3 %, of 1 %\n",
        // The miss is relative to the row's value, as the error bar is.
        "- c, fast: volume −43 %, of 25 %\n",
        "- lost | one, reference: no luck\n",
    ] {
        assert!(text.contains(part), "{part:?} is missing in {text}");
    }
    // The columns of a table are aligned.
    let lines: Vec<&str> = text.lines().filter(|line| line.starts_with('|')).collect();
    let widths: Vec<usize> = lines.iter().map(|line| line.chars().count()).collect();
    assert!(
        widths[..17].iter().all(|width| *width == widths[0]),
        "{text}"
    );
    let page = page_of_scenes("a <set>", &scenes).html();
    assert!(page.contains("a &lt;set&gt;") && page.contains("<svg "));
    let table = table(&scenes).expect("a table");
    assert_eq!(table.rows(), 15);
    assert_eq!(table.text("scene").expect("names")[3], "b");
    assert_eq!(table.text("motion").expect("kinds")[14], "orbit");
    let many: Vec<Trade> = (0..60)
        .map(|k| {
            let kind = MotionKind::ALL[k % MotionKind::ALL.len()];
            scene(&format!("scene_of_some_name_{k}"), kind, [0.02, 0.2], 0.1)
        })
        .collect();
    let many = page_of_scenes("many", &many);
    assert_readable(&many.svg());
    let text = many.plain(Some(100));
    assert!(
        text.contains(" 180 | scene_of_some_name_59, reference "),
        "{text}"
    );
}

#[test]
fn a_failure_is_shown_and_escaped() {
    let trade = example();
    let left_out = [("cycle".to_owned(), "it stands still | there".to_owned())];
    let shown = page(&trade, &left_out);
    let text = shown.markdown();
    assert!(text.contains("- grid = 256: no \\<luck>\n"), "{text}");
    // The table is aligned in columns.
    let cells = |name: &str| -> Vec<String> {
        let has = |line: &&str| line.contains(&format!(" | {name} "));
        let cells = text.lines().find(has).expect(name);
        let cells = cells.trim_matches('|').split('|').skip(1);
        cells.map(|cell| cell.trim().to_owned()).collect()
    };
    let failed = [
        "grid = 256",
        "0",
        "0.000",
        "3",
        "1 MB",
        "–",
        "–",
        "–",
        "–",
        "–",
    ];
    assert_eq!(cells("grid = 256"), failed);
    let fast = [
        "fast",
        "400",
        "0.400",
        "3",
        "1 MB",
        "6 %",
        "5 %: FAIL",
        "−6 %",
        "12 %",
        "–",
    ];
    assert_eq!(cells("fast"), fast);
    // The reference has no error relative to the reference.
    assert_eq!(cells("reference")[5..8], ["–", "–", "–"]);
    let page = shown.html();
    assert!(page.contains("no &lt;luck&gt;") && page.contains("made &amp; up"));
    let table = table(&[trade]).expect("a table");
    assert_eq!(
        table.maybe_f64("error_wear_volume").expect("errors")[8],
        None
    );
}

/// A scene's file may have any name. A failure may quote any text of a file.
#[test]
fn foreign_text_is_only_text() {
    let mut trade = example();
    let hostile = "<script>|`![x](y)\u{1b}[2J\u{202e}";
    trade.name = hostile.to_owned();
    trade.rows[8].failure = Some(format!("{hostile}\n| not a row"));
    let left_out = [("cycle".to_owned(), hostile.to_owned())];
    let shown = page(&trade, &left_out);
    let many = page_of_scenes(hostile, &[trade.clone(), trade]);
    let text = shown.markdown();
    let visible = "\\<script>|\\`!\\[x](y)\\\\u{1b}\\[2J\\\\u{202e}";
    assert_eq!(text.matches(visible).count(), 3, "{text}");
    let plain = shown.plain(None);
    let visible = "<script>|`![x](y)\\u{1b}[2J\\u{202e}";
    assert_eq!(plain.matches(visible).count(), 3, "{plain}");
    for text in [&text, &plain, &many.markdown(), &many.plain(Some(80))] {
        assert!(!text.contains("\n| not a row"), "{text}");
    }
    for text in [
        text,
        shown.svg(),
        shown.html(),
        many.markdown(),
        many.svg(),
        many.html(),
    ] {
        assert!(!text.contains(['\u{1b}', '\u{202e}']), "{text}");
        assert!(!text.replace("\\<", "").contains("<script"), "{text}");
    }
}
