//! One map from the writers of other programs (`samples/foreign/make.py`), and the keys that apply to any file.

use std::path::PathBuf;

use fretwear::surface::readers::{Correction, ReadOptions, Reading, read};

use super::malformed::says;
use super::{AS_STATED, MICROMETRES};

const NX: usize = 7;
const NY: usize = 5;
const SPACING: [f64; 2] = [0.5e-6, 0.8e-6];

/// Tolerances, relative to the largest height.
const SAME: f64 = 1e-9;
/// Rounding of single precision.
const SINGLE: f64 = 6e-8;
/// Half a step of 16-bit numbers between the lowest and the highest point.
const SHORT: f64 = 0.5 / 65_000.0 * 1.8;

pub fn sample(name: &str) -> PathBuf {
    let samples = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/surface/samples");
    PathBuf::from(samples).join(name)
}

/// Heights \[m\] of the files, by the formula of `make.py`.
fn height(i: usize, j: usize) -> f64 {
    if (i, j) == (2, 1) {
        return f64::NAN;
    }
    let (i, j) = (i as f64, j as f64);
    1e-6 * (0.3 * (0.7 * i).sin() + 0.2 * (1.1 * j).cos() + 0.005 * i * j)
}

fn heights() -> Vec<f64> {
    (0..NX * NY).map(|k| height(k / NY, k % NY)).collect()
}

fn foreign(name: &str, options: &ReadOptions) -> Reading {
    read(&sample("foreign").join(name), options).unwrap()
}

fn assert_same(name: &str, found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{name}");
    let largest = expected.iter().fold(0.0f64, |m, h| m.max(h.abs()));
    for (k, (a, b)) in found.iter().zip(expected).enumerate() {
        let same = a.is_nan() && b.is_nan() || (a - b).abs() <= tolerance * largest;
        assert!(same, "{name}, point {k}: {a} {b}");
    }
}

/// Readable files: whether the file states its unit, whether the file states its size, and the tolerance of the heights.
const READ: [(&str, bool, bool, f64); 14] = [
    ("savetxt.txt", false, false, SAME),
    ("savetxt_tabs.txt", false, false, SAME),
    ("to_csv_bare.csv", false, false, SAME),
    ("to_csv_semicolon.csv", false, false, SAME),
    ("points.csv", true, true, SAME),
    ("points_index.csv", true, true, SAME),
    ("points_header.txt", false, true, SAME),
    ("to_matrix.txt", true, true, SAME),
    ("surfalize.x3p", true, true, SAME),
    ("surfalize.sdf", true, true, SAME),
    ("surfalize.al3d", true, true, SINGLE),
    ("to_x3p_D.x3p", true, true, SAME),
    ("to_x3p_L.x3p", true, true, SAME),
    ("to_x3p_F.x3p", true, true, SINGLE),
];

fn options(states_unit: bool) -> ReadOptions {
    if states_unit { AS_STATED } else { MICROMETRES }
}

#[test]
fn maps_that_other_programs_wrote() {
    let short = ("to_x3p_I.x3p", true, true, SHORT);
    for (name, states_unit, states_size, tolerance) in READ.into_iter().chain([short]) {
        let found = foreign(name, &options(states_unit));
        assert_eq!(found.stated_unit.is_some(), states_unit, "{name}");
        let map = found.topography;
        assert_eq!((map.nx, map.ny), (NX, NY), "{name}");
        assert_same(name, &map.heights, &heights(), tolerance);
        match map.spacing {
            Some(spacing) => assert_same(name, &spacing, &SPACING, 2.0 * SINGLE),
            None => assert!(!states_size, "{name}"),
        }
    }
    let stored = foreign("sur_heights.npy", &MICROMETRES).topography;
    for name in ["plain.sur", "compressed.sur"] {
        let map = foreign(name, &AS_STATED).topography;
        assert_eq!((map.nx, map.ny), (NX, NY), "{name}");
        assert_same(name, &map.heights, &stored.heights, SAME);
        // The step of the integers has single precision.
        assert_same(name, &map.heights, &heights(), 2.0 * SINGLE);
        assert_same(name, &map.spacing.unwrap(), &SPACING, SINGLE);
    }
}

#[test]
fn labels_that_pandas_writes() {
    for (name, parts) in [
        ("to_csv_header.csv", ["line 1: found 0, 1, 2", "columns"]),
        ("to_csv_both.csv", ["line 1: found 0, 1, 2", "columns"]),
        ("to_csv_index.csv", ["column 1: found 0, 1, 2", "rows"]),
        (
            "to_csv_names.csv",
            ["line 1: found columns named c0, c1", "header=False"],
        ),
    ] {
        let error = read(&sample("foreign").join(name), &MICROMETRES).unwrap_err();
        says(&error.to_string(), &parts);
    }
}

#[test]
fn remarks_on_what_is_decided() {
    for (name, parts) in [
        (
            "savetxt.txt",
            [
                "1 \"nan\"",
                "7 lines of 5 values: a line of the text is one x",
            ],
        ),
        (
            "to_csv_bare.csv",
            ["1 \"\"", "surface.transpose = true makes it one y"],
        ),
        (
            "to_csv_semicolon.csv",
            ["commas are read as decimal points", "7 lines"],
        ),
        (
            "points.csv",
            [
                "columns z [um], y [um], quality, x [um]",
                "not read \"quality\"",
            ],
        ),
        (
            "points_header.txt",
            ["columns y, x, z, by their names", "1 \"nan\""],
        ),
        (
            "to_matrix.txt",
            [
                "Gwyddion says 3.5 um x 4.0 um",
                "a line of the text is one y",
            ],
        ),
    ] {
        let states_unit = READ.iter().any(|(other, unit, ..)| *other == name && *unit);
        let remarks = foreign(name, &options(states_unit)).remarks;
        says(&remarks.join("\n"), &parts);
    }
    assert_eq!(foreign("to_x3p_D.x3p", &AS_STATED).remarks, [""; 0]);
}

#[test]
fn any_map_can_be_transposed() {
    let transposed =
        |map: &[f64]| -> Vec<f64> { (0..NX * NY).map(|k| map[k % NX * NY + k / NX]).collect() };
    for (name, states_unit, ..) in READ {
        let plain = foreign(name, &options(states_unit)).topography;
        let options = ReadOptions {
            transpose: true,
            ..options(states_unit)
        };
        let found = foreign(name, &options).topography;
        assert_eq!((found.nx, found.ny), (NY, NX), "{name}");
        assert_same(name, &found.heights, &transposed(&plain.heights), 0.0);
        assert_eq!(
            found.spacing,
            plain.spacing.map(|[dx, dy]| [dy, dx]),
            "{name}"
        );
        // The user gives the spacing along the axes of the joint.
        let given = ReadOptions {
            spacing: Some([1e-6, 2e-6]),
            ..options
        };
        assert_eq!(
            foreign(name, &given).topography.spacing,
            given.spacing,
            "{name}"
        );
    }
}

#[test]
fn a_correction_overrides_what_a_file_states() {
    let correct = Correction {
        unit: Some(2.5e-8),
        spacing: Some([3e-6, 4e-6]),
    };
    for (name, states_unit, ..) in READ {
        let plain = foreign(name, &options(states_unit));
        for transpose in [false, true] {
            let options = ReadOptions {
                correct,
                transpose,
                // The unit agrees with the file, or the correction replaces it.
                height_unit: Some(1e-6),
                ..AS_STATED
            };
            let found = foreign(name, &options);
            assert_eq!(found.stated_unit, plain.stated_unit, "{name}");
            let spacing = found.topography.spacing;
            assert_eq!(spacing, correct.spacing, "{name}");
            if !transpose {
                let factor = 2.5e-8 / plain.stated_unit.unwrap_or(1e-6);
                let scaled: Vec<f64> = plain
                    .topography
                    .heights
                    .iter()
                    .map(|h| h * factor)
                    .collect();
                assert_same(name, &found.topography.heights, &scaled, 1e-15);
            }
        }
    }
}

#[test]
fn a_correction_of_heights_moves_no_points() {
    let correct = Correction {
        unit: Some(1e-9),
        spacing: None,
    };
    for name in ["points.csv", "points_header.txt"] {
        let options = ReadOptions {
            correct,
            ..MICROMETRES
        };
        let found = foreign(name, &options).topography;
        assert_same(name, &found.spacing.unwrap(), &SPACING, SAME);
        let scaled: Vec<f64> = heights().iter().map(|h| 1e-3 * h).collect();
        assert_same(name, &found.heights, &scaled, SAME);
    }
    // Without another unit, the unit of the heights also applies to the positions.
    let alone = ReadOptions {
        correct,
        ..AS_STATED
    };
    let found = foreign("points_header.txt", &alone).topography;
    assert_same(
        "alone",
        &found.spacing.unwrap(),
        &SPACING.map(|s| 1e-3 * s),
        SAME,
    );
}
