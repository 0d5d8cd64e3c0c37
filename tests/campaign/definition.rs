//! Tests of a campaign file: its rows, and its errors.

use std::path::Path;

use fretwear::campaign::{Definition, Setting};

use super::{GRID, bench};
use crate::support::Bench;

fn read(bench: &Bench) -> Definition {
    let path = bench.path("case.toml");
    Definition::read(&path, &|key| key == "surface.path").unwrap_or_else(|error| panic!("{error}"))
}

fn rows(campaign: &str) -> Vec<Vec<String>> {
    let texts = |row: &Vec<Setting>| row.iter().map(Setting::text).collect();
    read(&bench(campaign)).rows().iter().map(texts).collect()
}

/// Number to which a row sets a key.
fn number(row: &[Setting], key: &str) -> f64 {
    let setting = row.iter().find(|setting| setting.key == key).expect("set");
    match setting.as_written() {
        fretwear::campaign::ResolvedValue::Text(text) => {
            let number = text.split(' ').next().expect("a number");
            number.parse().expect("a number")
        }
        given => given.number().expect("a number"),
    }
}

#[test]
fn a_grid_has_every_value_with_every_other_and_the_last_key_varies_fastest() {
    let found = rows(GRID);
    let expected: Vec<Vec<String>> = [0.5, 0.7]
        .into_iter()
        .flat_map(|mu| {
            (1..=3).map(move |seed| {
                vec![
                    format!("contact.friction_coefficient={mu}"),
                    format!("surface.seed={seed}"),
                ]
            })
        })
        .collect();
    assert_eq!(found, expected);
}

#[test]
fn a_list_is_read_row_by_row_and_is_repeated_at_every_point_of_the_grid() {
    let list = "[grid]\nsurface.seed = [7, 8]\n[list]\nmotion.amplitude = [\"1 um\", \"2 um\", \"3 um\"]\nwear.coefficient = [\"1e3 um^3/J\", \"2e3 um^3/J\", \"4e3 um^3/J\"]\n";
    let found = rows(list);
    assert_eq!(found.len(), 6);
    let row = |seed, amplitude, coefficient| {
        vec![
            format!("surface.seed={seed}"),
            format!("motion.amplitude=\"{amplitude} um\""),
            format!("wear.coefficient=\"{coefficient} um^3/J\""),
        ]
    };
    assert_eq!(found[1], row(7, 2, "2e3"));
    assert_eq!(found[5], row(8, 3, "4e3"));
}

const DRAWS: &str = "[random]\nn = 256\nseed = 4\ncontact.friction_coefficient = { distribution = \"uniform\", low = 0.4, high = 0.8 }\nmotion.amplitude = { distribution = \"uniform\", low = \"1 um\", high = \"3 um\" }\n";

/// 256 points of a scrambled Sobol sequence in two dimensions: one point in each of 16 x 16 cells, and one in each of 4 x 64 cells.
#[test]
fn draws_of_the_sobol_sequence_are_evenly_spread() {
    let rows = read(&bench(DRAWS)).rows();
    assert_eq!(rows.len(), 256);
    for [nx, ny] in [[16, 16], [4, 64], [128, 2]] {
        let mut cells = std::collections::BTreeSet::new();
        for row in &rows {
            let x = (number(row, "contact.friction_coefficient") - 0.4) / 0.4;
            let y = (number(row, "motion.amplitude") - 1.0) / 2.0;
            cells.insert([(x * nx as f64) as usize, (y * ny as f64) as usize]);
        }
        assert_eq!(cells.len(), 256, "{nx} x {ny}");
    }
    // A draw has the unit that the campaign file gives.
    assert!(
        rows[0][1].text().ends_with(" um\""),
        "{}",
        rows[0][1].text()
    );
}

#[test]
fn more_draws_begin_with_the_same_and_another_seed_has_others() {
    for sequence in ["sobol", "random"] {
        let draws = DRAWS.replace("seed = 4", &format!("seed = 4\nsequence = \"{sequence}\""));
        let few = rows(&draws.replace("n = 256", "n = 40"));
        assert_eq!(few[..], rows(&draws)[..40], "{sequence}");
        assert_ne!(
            few[0],
            rows(&draws.replace("seed = 4", "seed = 5"))[0],
            "{sequence}"
        );
    }
}

/// All points of a grid have the same draws, so the difference between two points has no random part.
#[test]
fn draws_are_common_to_the_points_of_a_grid() {
    let draws = DRAWS.replace("n = 256", "n = 5");
    let found = rows(&format!("[grid]\nsurface.seed = [1, 2]\n{draws}"));
    assert_eq!(found.len(), 10);
    for k in 0..5 {
        assert_eq!(found[k][1..], found[k + 5][1..]);
        assert_ne!(found[k][0], found[k + 5][0]);
    }
}

/// Shares of draws below some values, against the distribution functions.
#[test]
fn distributions() {
    // With this number of points, the share from the Sobol sequence is accurate to a few points.
    const DRAWN: usize = 4096;
    const OFF: f64 = 4.0 / DRAWN as f64;
    // Normal distribution function at one and at two standard deviations.
    const ONE: f64 = 0.841_344_746;
    const TWO: f64 = 0.977_249_868;
    let cases: [(&str, &[(f64, f64)]); 8] = [
        (
            "distribution = \"uniform\", low = -2, high = 6.0",
            &[(0.0, 0.25), (-2.0, 0.0), (6.0, 1.0)],
        ),
        (
            "distribution = \"log_uniform\", low = 1e-3, high = 10",
            &[(0.1, 0.5), (1.0, 0.75)],
        ),
        (
            "distribution = \"normal\", mean = 3, sd = 0.5",
            &[(3.0, 0.5), (3.5, ONE), (2.0, 1.0 - TWO)],
        ),
        // Truncated from one standard deviation below the mean to two above it.
        (
            "distribution = \"normal\", mean = 3, sd = 0.5, low = 2.5, high = 4",
            &[
                (2.5, 0.0),
                (4.0, 1.0),
                (3.0, (ONE - 0.5) / (ONE + TWO - 1.0)),
            ],
        ),
        (
            "distribution = \"log_normal\", median = 8, factor = 2",
            &[(8.0, 0.5), (16.0, ONE), (4.0, 1.0 - ONE)],
        ),
        (
            "distribution = \"log_normal\", median = 8, factor = 2, low = 8",
            &[(8.0, 0.0), (16.0, 2.0 * ONE - 1.0)],
        ),
        (
            "distribution = \"triangular\", low = 1, mode = 2, high = 5",
            &[(2.0, 0.25), (3.5, 1.0 - 1.5 * 1.5 / 12.0)],
        ),
        (
            "distribution = \"integers\", low = -1, high = 2",
            &[(-0.5, 0.25), (1.5, 0.75), (-1.5, 0.0), (2.5, 1.0)],
        ),
    ];
    for (text, parts) in cases {
        let draws = format!("[random]\nn = {DRAWN}\nseed = 1\nwear.tolerance = {{ {text} }}\n");
        let rows = read(&bench(&draws)).rows();
        for (value, part) in parts {
            let below = rows
                .iter()
                .filter(|row| number(row, "wear.tolerance") < *value)
                .count();
            let found = below as f64 / DRAWN as f64;
            assert!(
                (found - part).abs() <= OFF,
                "{text}: {found} below {value}, not {part}"
            );
        }
    }
    let words = rows(
        "[random]\nn = 64\nseed = 1\nmotion.kind = { distribution = \"choice\", values = [\"a\", 2] }\n",
    );
    let first = words
        .iter()
        .filter(|row| row[0] == "motion.kind=\"a\"")
        .count();
    assert_eq!((first, words.len()), (32, 64));
}

#[test]
fn paths_of_files_are_relative_to_the_campaign() {
    let bench = Bench::new();
    std::fs::create_dir(bench.path("below")).expect("a folder");
    let campaign = "scene = \"../small.toml\"\n[grid]\nsurface.path = [\"a.npy\", \"/b.npy\"]\n";
    let path = bench.write("below/case.toml", campaign);
    let definition = Definition::read(&path, &|key| key == "surface.path").expect("read");
    assert_eq!(definition.scene, bench.path("below/../small.toml"));
    let of = |k: usize| definition.rows()[k][0].text();
    let expected = bench.path("below/a.npy");
    assert_eq!(of(0), format!("surface.path=\"{}\"", expected.display()));
    assert_eq!(of(1), "surface.path=\"/b.npy\"");
    assert!(Path::new("/b.npy").is_absolute());
}

/// Errors of a campaign file, and the words of each message in addition to the file name.
#[test]
fn faults_of_a_campaign_name_the_key_its_value_and_what_would_be_right() {
    let random = |line: &str| format!("[random]\nn = 4\nseed = 1\n{line}\n");
    let drawn = |text: &str| random(&format!("wear.tolerance = {{ {text} }}"));
    let cases: Vec<(String, &[&str])> = vec![
        (String::new(), &["nothing varies", "[grid], [list] or [random]"]),
        ("[gird]\nsurface.seed = [1]\n".into(), &["gird", "a campaign file has no such key", "grid"]),
        ("[grid]\n".into(), &["[grid] names no key"]),
        ("[grid]\nsurface.seed = []\n".into(), &["[grid] surface.seed = []", "at least one value"]),
        ("[grid]\nsurface.seed = 3\n".into(), &["[grid] surface.seed = 3", "[set]"]),
        ("[grid]\nsurface.seed = { from = 3, to = 1 }\n".into(), &["surface.seed", "not be below `from`"]),
        ("[grid]\nsurface.seed = { from = 3 }\n".into(), &["surface.seed", "{ from = 1, to = 16 }"]),
        ("[grid]\nsurface.seed = { from = 0, to = 9_999_999 }\n".into(), &["surface.seed", "1000000"]),
        (
            "[grid]\nsurface.seed = { from = 1, to = 2000 }\nmotion.phase = { from = 1, to = 2000 }\n".into(),
            &["more than 1000000 rows"],
        ),
        (
            "[list]\nsurface.seed = [1, 2]\nsurface.rq = [\"1 um\"]\n".into(),
            &["[list] surface.seed has 2 values", "surface.rq has 1", "[grid]"],
        ),
        (
            "[grid]\nsurface.seed = [1]\n[list]\nsurface.seed = [2]\n".into(),
            &["surface.seed appears in two"],
        ),
        ("[grid]\nwear.cycles = [1]\n".into(), &["wear.cycles appears in two"]),
        ("[random]\nseed = 1\n".into(), &["[random] n is missing"]),
        ("[random]\nn = 3\n".into(), &["[random] seed is missing"]),
        ("[random]\nn = 0\nseed = 1\n".into(), &["[random] n = 0"]),
        ("[random]\nn = -3\nseed = 1\n".into(), &["[random] n = -3", "from 0 to 1000000"]),
        ("[random]\nn = 3\nseed = 5_000_000_000\n".into(), &["[random] seed = 5000000000"]),
        (random(""), &["[random] draws no key"]),
        (random("sequence = \"halton\""), &["sequence = \"halton\"", "\"sobol\""]),
        (random("wear.tolerance = [1, 2]"), &["[random] wear.tolerance", "a distribution"]),
        (
            "[random]\nn = 70_000\nseed = 1\nwear.tolerance = { distribution = \"uniform\", low = 1, high = 2 }\n".into(),
            &["[random] n = 70000", "65536", "sequence = \"random\""],
        ),
        (drawn("distribution = \"gamma\""), &["must be one of uniform", "triangular"]),
        (drawn("distribution = \"uniform\", low = 1"), &["`high` is missing"]),
        (drawn("distribution = \"uniform\", low = 1, high = 2, sd = 3"), &["no `sd`"]),
        (drawn("distribution = \"uniform\", low = 2, high = 1"), &["low = 2 must be below high = 1"]),
        (drawn("distribution = \"uniform\", low = 1, high = nan"), &["high must be a finite number"]),
        (drawn("distribution = \"uniform\", low = \"1 um\", high = \"2 mm\""), &["the same unit"]),
        (drawn("distribution = \"log_uniform\", low = 0, high = 1"), &["low = 0 must be above zero"]),
        (drawn("distribution = \"normal\", mean = 1, sd = 0"), &["sd = 0 must be above zero"]),
        (drawn("distribution = \"normal\", mean = 1, sd = -1"), &["sd = -1 must be above zero"]),
        (drawn("distribution = \"normal\", mean = 0, sd = 1, low = 30"), &["of the distribution"]),
        (drawn("distribution = \"log_normal\", median = -1, factor = 2"), &["median = -1"]),
        (drawn("distribution = \"log_normal\", median = 1, factor = 1"), &["factor = 1 must be above 1"]),
        (drawn("distribution = \"triangular\", low = 1, mode = 9, high = 2"), &["mode = 9"]),
        (drawn("distribution = \"integers\", low = 1.5, high = 2"), &["low must be a whole number"]),
        (drawn("distribution = \"integers\", low = 3, high = 2"), &["low = 3 must not be above"]),
        (drawn("distribution = \"choice\", values = []"), &["values must be a list"]),
    ];
    for (campaign, parts) in cases {
        let bench = bench(&campaign);
        let error = Definition::read(&bench.path("case.toml"), &|_| false).expect_err(&campaign);
        assert!(error.is_usage(), "{error}");
        let said = error.to_string();
        for part in parts.iter().chain(&["case.toml: "]) {
            assert!(said.contains(part), "{campaign}: no {part:?} in {said}");
        }
    }
    let bench = Bench::new();
    bench.write("case.toml", "[grid]\nsurface.seed = [1]\n");
    let error = Definition::read(&bench.path("case.toml"), &|_| false).expect_err("no scene");
    assert!(error.to_string().contains("scene is missing"), "{error}");
    bench.write("case.toml", "scene = \n");
    let error = Definition::read(&bench.path("case.toml"), &|_| false).expect_err("no TOML");
    assert!(error.to_string().contains("not valid TOML"), "{error}");
}
