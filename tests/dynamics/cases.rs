//! Published oscillators and chains with friction, stops and springs (`cases/`), against closed forms, and balances and integrations in time by code of
//! its own (`cases.csv`): each value lies within the bar of its figure.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use fretwear::tables::{Table, TableName};

use crate::support::{Bench, table};

/// Digits of the values.
const OWN: f64 = 2e-4;
/// Of the frequency of a flat peak, and of a third harmonic, which have no bar.
const FREQUENCY: f64 = 3e-3;
const THIRD: f64 = 0.03;
/// Half width of the range about a frequency at which a row is wanted.
const BESIDE: f64 = 1e-3;

/// A line of `cases.csv`.
struct Known {
    case: String,
    settings: String,
    figure: String,
    /// Frequency of a row \[Hz\]; none of a figure of the resonance.
    at: Option<f64>,
    value: f64,
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/dynamics")
}

fn known() -> Vec<Known> {
    let mut reader = csv::Reader::from_path(folder().join("cases.csv")).expect("the table");
    let records = reader.records().map(|record| {
        let record = record.expect("a line");
        let at = record[3].parse().ok();
        Known {
            case: record[0].to_owned(),
            settings: record[1].to_owned(),
            figure: record[2].to_owned(),
            at,
            value: record[4].parse().expect("a number"),
        }
    });
    records.collect()
}

/// Runs a case, with rows at a frequency and beside it if one is given.
fn run(bench: &Bench, known: &Known, name: &str) -> PathBuf {
    let scene = folder().join("cases").join(&known.case).join("scene.toml");
    let mut arguments = vec![
        "run".to_owned(),
        scene.display().to_string(),
        "--run".to_owned(),
        name.to_owned(),
    ];
    let mut sets: Vec<String> = Vec::new();
    if !known.settings.is_empty() {
        sets.push(known.settings.clone());
    }
    if let Some(at) = known.at {
        let [low, high] = [1.0 - BESIDE, 1.0 + BESIDE].map(|side| side * at);
        sets.push(format!("dynamics.frequency=[\"{low} Hz\", \"{high} Hz\"]"));
        sets.push("dynamics.points=3".to_owned());
    }
    for set in sets {
        arguments.extend(["--set".to_owned(), set]);
    }
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    bench.done(&arguments);
    bench.path(name)
}

fn value(table: &Table, column: &str, row: usize) -> f64 {
    match table.maybe_f64(column) {
        Ok(values) => values[row].expect("a value"),
        Err(_) => table.f64(column).expect("a column")[row],
    }
}

/// A figure of a run and its relative bar.
fn figure(root: &Path, figure: &str) -> (f64, f64) {
    /// The row in the middle.
    const MIDDLE: usize = 1;
    let Some(of_row) = figure.strip_prefix("row_") else {
        let response = table(root, 0, TableName::DynamicResponse);
        let bar = match figure {
            "peak_frequency" | "resonance_frequency" => FREQUENCY,
            "friction_energy" => value(&response, "error_friction_energy", 0),
            _ => value(&response, "error_peak_amplitude", 0),
        };
        return (value(&response, figure, 0), bar);
    };
    let frf = table(root, 0, TableName::Frf);
    let error = |column: &str| value(&frf, column, MIDDLE);
    match of_row {
        "friction_energy" => (error(of_row), error("error_friction_energy")),
        "harmonic_3" => {
            let harmonics = table(root, 0, TableName::FrfHarmonic);
            let (rows, orders) = (harmonics.i64("row"), harmonics.i32("harmonic"));
            let mut places = rows.expect("rows").iter().zip(orders.expect("orders"));
            let place = places.position(|(row, order)| (*row, *order) == (MIDDLE as i64, 3));
            let place = place.expect("a third harmonic");
            let part = |column: &str| value(&harmonics, column, place);
            let size = part("displacement_cosine").hypot(part("displacement_sine"));
            (size, THIRD)
        }
        _ => (error(of_row), error("error_amplitude")),
    }
}

fn hold(is_wanted: impl Fn(&str) -> bool) {
    let bench = Bench::new();
    let mut runs: BTreeMap<(String, String, Option<u64>), PathBuf> = BTreeMap::new();
    for known in known().iter().filter(|known| is_wanted(&known.case)) {
        let key = (
            known.case.clone(),
            known.settings.clone(),
            known.at.map(f64::to_bits),
        );
        let name = format!("run{}", runs.len());
        let root = runs.entry(key).or_insert_with(|| run(&bench, known, &name));
        let (found, bar) = figure(root, &known.figure);
        let off = (found / known.value - 1.0).abs();
        assert!(
            off <= bar + OWN,
            "{} {} {} at {:?}: {found} for {}, bar {bar:e}",
            known.case,
            known.settings,
            known.figure,
            known.at,
            known.value
        );
    }
}

/// Two masses that one harmonic after the other is added to, up to 31.
const MANY_HARMONICS: &str = "two_mass_friction";

#[test]
fn published_values_lie_within_their_bars() {
    hold(|case| case != MANY_HARMONICS);
}

#[test]
#[ignore = "long: harmonics up to 31 of four elements, three times"]
fn published_values_of_many_harmonics_lie_within_their_bars() {
    hold(|case| case == MANY_HARMONICS);
}

/// A mode within the range of the drive that the reduction leaves out is told, with what to do.
#[test]
fn a_mode_that_is_cut_off_is_told() {
    let bench = Bench::new();
    let scene = folder().join("cases/lanchester/scene.toml");
    let scene = scene.display().to_string();
    let did = bench.fretwear(&["run", &scene, "--run", "a"]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    assert!(
        did.stderr().contains("raise dynamics.modes"),
        "{}",
        did.stderr()
    );
    let all = ["--set", "dynamics.modes=16"];
    bench.done(&[&["run", &scene, "--run", "b"], &all[..]].concat());
}
