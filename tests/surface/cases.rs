//! Typical files of users (`samples/cases`), each with its correct value.

use fretwear::surface::readers::{Correction, ReadOptions, Reading, read};

use super::foreign::sample;
use super::malformed::says;
use super::{AS_STATED, MICROMETRES};

/// Rq of the map of 12 x 8 points, as printed beside the cases.
const RQ: f64 = 0.4688e-6;
const PRINTED: f64 = 0.5e-10;
/// Rounding of heights by the five digits of the texts.
const DIGITS: f64 = 0.501e-11;

fn case(name: &str, options: &ReadOptions) -> Reading {
    read(&sample("cases").join(name), options).unwrap()
}

fn refused(name: &str, options: &ReadOptions) -> String {
    let error = read(&sample("cases").join(name), options).unwrap_err();
    error.to_string()
}

/// Heights \[m\] of the map of 12 x 8 points, from a text below a line of labels.
fn heights() -> Vec<f64> {
    let text = std::fs::read_to_string(sample("cases/csv_numeric_header/header.csv")).unwrap();
    let rows = text.lines().skip(1).flat_map(|line| line.split(','));
    rows.map(|value| value.parse::<f64>().unwrap() * 1e-6)
        .collect()
}

fn assert_is_the_map(found: &Reading, [dx, dy]: [f64; 2], rounding: f64) {
    let map = &found.topography;
    assert_eq!((map.nx, map.ny, map.holes()), (12, 8, 0));
    let rq = map.roughness().unwrap().rq;
    assert!((rq - RQ).abs() < PRINTED, "{rq}");
    let spacing = map.spacing.unwrap();
    assert!((spacing[0] / dx - 1.0).abs() < 1e-6 && (spacing[1] / dy - 1.0).abs() < 1e-6);
    for (a, b) in map.heights.iter().zip(heights()) {
        assert!((a - b).abs() < rounding, "{a} {b}");
    }
}

/// Standard deviation along x of the means over y, and along y of the means over x.
fn along_axes(found: &Reading) -> [f64; 2] {
    let map = &found.topography;
    let deviation = |means: Vec<f64>| {
        let mean = means.iter().sum::<f64>() / means.len() as f64;
        let squares: f64 = means.iter().map(|m| (m - mean).powi(2)).sum();
        (squares / means.len() as f64).sqrt()
    };
    let height = |i: usize, j: usize| map.heights[i * map.ny + j];
    let along_x =
        (0..map.nx).map(|i| (0..map.ny).map(|j| height(i, j)).sum::<f64>() / map.ny as f64);
    let along_y =
        (0..map.ny).map(|j| (0..map.nx).map(|i| height(i, j)).sum::<f64>() / map.nx as f64);
    [deviation(along_x.collect()), deviation(along_y.collect())]
}

#[test]
fn columns_in_another_order() {
    let found = case("csv_column_order/yxz.csv", &MICROMETRES);
    let [x, y] = along_axes(&found);
    assert!((x - 0.35e-6).abs() < 5e-12 && y < 1e-15, "{x} {y}");
    says(&found.remarks[0], &["columns y, x, z, by their names"]);
}

#[test]
fn a_fourth_column() {
    let found = case("csv_extra_column/named.csv", &MICROMETRES);
    assert_is_the_map(&found, [10e-6, 10e-6], 1e-15);
    says(
        &found.remarks[0],
        &["x, y, z, quality", "not read \"quality\""],
    );
    says(
        &refused("csv_extra_column/normals.xyz", &MICROMETRES),
        &["6 values a row", "12 x 8 points", "a line of their names"],
    );
}

#[test]
fn labels_of_columns_and_rows() {
    for name in ["header.csv", "both.csv"] {
        let message = refused(&format!("csv_numeric_header/{name}"), &MICROMETRES);
        says(&message, &["line 1", "0, 1, 2", "labels"]);
    }
}

#[test]
fn the_header_of_gwyddion() {
    let nanometres = ReadOptions {
        height_unit: Some(1e-9),
        ..AS_STATED
    };
    for options in [AS_STATED, nanometres] {
        let found = case("gwyddion_text/map.txt", &options);
        let [x, y] = along_axes(&found);
        assert!(x < 1e-15 && (y - 33.47e-9).abs() < 5e-12, "{x} {y}");
        let rq = found.topography.roughness().unwrap().rq;
        assert!((rq - 33.47e-9).abs() < 5e-12, "{rq}");
        let size = found.topography.size().unwrap();
        assert!((size[0] - 1e-4).abs() < 1e-12 && (size[1] - 1e-4).abs() < 1e-12);
        assert_eq!(found.stated_unit, Some(1e-9));
        says(
            &found.remarks[0],
            &["Gwyddion says 100.0 µm x 100.0 µm", "one y"],
        );
    }
    let transposed = ReadOptions {
        transpose: true,
        ..AS_STATED
    };
    let [x, y] = along_axes(&case("gwyddion_text/map.txt", &transposed));
    assert!((x - 33.47e-9).abs() < 5e-12 && y < 1e-15, "{x} {y}");
    let message = refused("gwyddion_text/map.txt", &MICROMETRES);
    says(&message, &["units of 1e-9 m", "surface.unit says 1e-6 m"]);
}

#[test]
fn marks_of_points_that_were_not_measured() {
    for (name, word) in [
        ("bad.txt", "Bad"),
        ("dashes.txt", "---"),
        ("e38.txt", "1e30 or more"),
        ("na.txt", "NA"),
        ("stars.txt", "***"),
        ("nodata.xyz", "No Data"),
    ] {
        let found = case(&format!("text_holes/{name}"), &MICROMETRES);
        let map = &found.topography;
        assert_eq!((map.nx, map.ny, map.holes()), (12, 8, 1), "{name}");
        for (k, (a, b)) in map.heights.iter().zip(heights()).enumerate() {
            let same = if k == 3 * 8 + 4 {
                a.is_nan()
            } else {
                (a - b).abs() < 1e-15
            };
            assert!(same, "{name}, point {k}: {a} {b}");
        }
        let remark = format!("values read as holes: 1 \"{word}\"");
        assert_eq!(found.remarks[0], remark, "{name}");
    }
}

#[test]
fn files_of_other_programs() {
    let spacing = [10e-6, 10e-6];
    for name in ["sur_compressed/map.sur", "sur_utf8_unit/map.sur"] {
        // The integers count nanometres.
        assert_is_the_map(&case(name, &AS_STATED), spacing, 0.501e-9);
    }
    assert_is_the_map(&case("x3p_in_folder/map.x3p", &AS_STATED), spacing, DIGITS);
    let message = refused("zip_that_is_no_x3p/map.npz", &MICROMETRES);
    says(
        &message,
        &[
            "a NumPy archive (.npz) is not supported",
            "save one array with numpy.save",
        ],
    );
    // An X3P file with numbers in micrometres instead of metres.
    let correct = Correction {
        unit: Some(1e-6),
        spacing: Some(spacing),
    };
    let options = ReadOptions {
        correct,
        ..AS_STATED
    };
    assert_is_the_map(
        &case("joint_within_few_points/micrometres.x3p", &options),
        spacing,
        DIGITS,
    );
}
