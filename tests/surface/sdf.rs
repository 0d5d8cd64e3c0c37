//! Text and binary SDF files, written by the description of the standard.

use fretwear::surface::readers::{ReadOptions, ReadProblem, read};

use super::AS_STATED;
use super::malformed::{failure, says};
use super::writers::file;

/// Rounding of one product of a unit and a number.
const ROUNDING: f64 = 1e-15;

/// Heights of 3 points along x and 2 points along y, in tenths of a micrometre, line by line.
const LINES: [[f64; 3]; 2] = [[1.0, 20.0, -3.0], [4.0, 5.0, 60.0]];

const HEADER: &str = "aISO-1.0\r\nManufacID = Tester\r\nCreateDate = 010120261200\r\nModDate = 010120261200\r\n\
    NumPoints = 3\r\nNumProfiles = 2\r\nXscale = 2.0E-6\r\nYscale = 3e-6\r\nZscale = 1e-7\r\nZresolution = -1\r\n\
    Compression = 0\r\nDataType = 7\r\nCheckType = 0\r\n*\r\n";

const HEIGHTS: &str = "1.0 20 -3\r\n4 5\r\n6e1\r\n*\r\n<Operator>T. \u{e9}</Operator>\r\n*";

fn assert_is_it(name: &str, bytes: impl AsRef<[u8]>, holes: &[(usize, usize)]) {
    let found = read(&file(name, bytes).path, &AS_STATED)
        .unwrap()
        .topography;
    assert_eq!((found.nx, found.ny), (3, 2));
    assert_eq!(found.spacing, Some([2e-6, 3e-6]));
    assert_eq!(found.holes(), holes.len(), "{:?}", found.heights);
    for (i, j) in (0..3).flat_map(|i| (0..2).map(move |j| (i, j))) {
        let h = found.heights[i * 2 + j];
        if holes.contains(&(i, j)) {
            assert!(h.is_nan(), "({i}, {j}): {h}");
        } else {
            assert!((h - 1e-7 * LINES[j][i]).abs() < ROUNDING, "({i}, {j}): {h}");
        }
    }
}

fn text() -> String {
    format!("{HEADER}{HEIGHTS}")
}

#[test]
fn text_of_every_version() {
    for version in ["aISO-1.0", "aISO-2.0", "aBCR-1.0", "aNIST-1.0"] {
        assert_is_it("map.sdf", text().replace("aISO-1.0", version), &[]);
    }
    // Unix line endings, no blanks around =, no trailer, no keys for compression and checksum.
    let bare = text()
        .replace("\r\n", "\n")
        .replace(" = ", "=")
        .replace("Compression=0\n", "")
        .replace("CheckType=0\n", "");
    let end = bare.rfind("*\n<").unwrap();
    assert_is_it("map.SDF", &bare[..end], &[]);
    // The reader recognizes the format from the first bytes.
    assert_is_it("map.backup", text(), &[]);
    // The remarks have a different encoding than the numbers.
    let mut bytes = text().into_bytes();
    bytes.extend(b"\xe9\xff");
    assert_is_it("map.sdf", bytes, &[]);
}

#[test]
fn text_with_points_that_were_not_measured() {
    assert_is_it("map.sdf", text().replace("-3", "BAD"), &[(2, 0)]);
    assert_is_it("map.sdf", text().replace("-3", "bad"), &[(2, 0)]);
    // The smallest number of a 16-bit type is a hole if the header states this type.
    let least = text().replace("DataType = 7", "DataType = 5");
    assert_is_it("map.sdf", least.replace("4 5\r", "4 -32768\r"), &[(1, 1)]);
    let all = HEADER.to_owned() + "BAD BAD BAD BAD BAD BAD\n*\n";
    says(
        &failure("map.sdf", all, &AS_STATED).0,
        &["none of the 3 x 2 points"],
    );
}

#[test]
fn every_key_of_the_text() {
    let with = |from: &str, to: &str| {
        assert!(text().contains(from), "{from}");
        failure("map.sdf", text().replace(from, to), &AS_STATED).0
    };
    for key in [
        "NumPoints",
        "NumProfiles",
        "Xscale",
        "Yscale",
        "Zscale",
        "DataType",
    ] {
        says(
            &with(&format!("{key} ="), "Other ="),
            &["the header", "nothing", &format!("the key {key}")],
        );
    }
    says(
        &with("NumPoints = 3", "NumPoints = three"),
        &["NumPoints", "\"three\"", "number"],
    );
    for (wrong, shown) in [("0", "0"), ("-3", "-3"), ("2.5", "2.5"), ("nan", "NaN")] {
        says(
            &with("NumProfiles = 2", &format!("NumProfiles = {wrong}")),
            &["NumProfiles", shown, "at least 1"],
        );
    }
    says(
        &with("Zscale = 1e-7", "Zscale = 0"),
        &["Zscale", "found 0", "positive"],
    );
    says(
        &with("Zscale = 1e-7", "Zscale = 1,5e-7"),
        &["Zscale", "\"1,5e-7\"", "decimal point"],
    );
    says(
        &with("Xscale = 2.0E-6", "Xscale = -2e-6"),
        &["spacing", "-2e-6 x 3e-6 m"],
    );
    says(
        &with("Compression = 0", "Compression = 1"),
        &["Compression = 1", "not supported", "X3P"],
    );
    says(
        &with("CheckType = 0", "CheckType = 2"),
        &["checksum", "CheckType = 2"],
    );
    says(
        &with("DataType = 7", "DataType = 8"),
        &["DataType", "found 8", "0 to 7"],
    );
    says(
        &with("ModDate", "CreateDate"),
        &["line 4", "a second CreateDate", "each key once"],
    );
    says(
        &with("Zresolution = -1", "Zresolution"),
        &["line 10", "\"Zresolution\"", "key = value"],
    );
}

#[test]
fn text_cut_short_or_with_wrong_values() {
    let with = |bytes: String| failure("map.sdf", bytes, &AS_STATED);
    says(
        &with(HEADER.trim_end_matches("*\r\n").to_owned()).0,
        &["end of the file", "a line with *"],
    );
    let (message, problem) = with(text().replace("6e1", ""));
    assert!(matches!(problem, ReadProblem::Malformed { .. }));
    says(
        &message,
        &[
            "the heights",
            "5 values",
            "6",
            "NumPoints = 3",
            "NumProfiles = 2",
        ],
    );
    says(&with(text().replace("6e1", "6e1 7")).0, &["7 values"]);
    says(
        &with(text().replace("20", "2,0")).0,
        &["line 15", "\"2,0\"", "BAD for a hole"],
    );
    says(
        &with(text().replace("20", "inf")).0,
        &["point (1, 0)", "inf"],
    );
    // The reader rejects the counts before allocation.
    let huge = text()
        .replace("Points = 3", "Points = 4000000000")
        .replace("Profiles = 2", "Profiles = 4000000000");
    let counts = "4000000000 x 4000000000 points; at most 134217728 points are read";
    says(&with(huge).0, &[counts]);
    let (message, problem) = failure("map.sdf", "aISO-3.0\r\n", &AS_STATED);
    assert!(matches!(problem, ReadProblem::WrongMagic { .. }));
    says(&message, &["SDF", "aISO-1.0", "bISO-2.0", "aISO-3.0"]);
    let micrometres = ReadOptions {
        height_unit: Some(1e-6),
        ..AS_STATED
    };
    let (_, problem) = failure("map.sdf", text(), &micrometres);
    assert!(matches!(
        problem,
        ReadProblem::UnitConflict { given, stated } if given == 1e-6 && stated == 1.0
    ));
}

/// Binary file with the given bytes of the points.
fn binary(version: &str, kind: u8, points: &[u8]) -> Vec<u8> {
    let mut bytes = version.as_bytes().to_vec();
    bytes.extend(b"Tester    010120261200010120261200");
    if version.contains("ISO-2") {
        bytes.extend(3u32.to_le_bytes());
        bytes.extend(2u32.to_le_bytes());
    } else {
        bytes.extend(3u16.to_le_bytes());
        bytes.extend(2u16.to_le_bytes());
    }
    for scale in [2e-6, 3e-6, 1e-7, -1.0f64] {
        bytes.extend(scale.to_le_bytes());
    }
    bytes.extend([0, kind, 0]);
    bytes.extend(points);
    bytes
}

fn points(number: impl Fn(f64) -> Vec<u8>) -> Vec<u8> {
    LINES
        .as_flattened()
        .iter()
        .flat_map(|&v| number(v))
        .collect()
}

fn doubles() -> Vec<u8> {
    points(|v| v.to_le_bytes().to_vec())
}

#[test]
fn binary_of_every_type_with_its_hole() {
    // In an unsigned file, the only negative height is the hole.
    let cases: [(u8, Vec<u8>, bool); 12] = [
        (0, points(|v| vec![v.abs() as u8]), false),
        (
            1,
            points(|v| {
                if v < 0.0 { u16::MAX } else { v as u16 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (
            2,
            points(|v| {
                if v < 0.0 { u32::MAX } else { v as u32 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (3, points(|v| (v as f32).to_le_bytes().to_vec()), false),
        (
            3,
            points(|v| {
                if v < 0.0 { f32::MIN } else { v as f32 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (
            4,
            points(|v| {
                if v < 0.0 { i8::MIN } else { v as i8 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (5, points(|v| (v as i16).to_le_bytes().to_vec()), false),
        (
            5,
            points(|v| {
                if v < 0.0 { i16::MIN } else { v as i16 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (
            6,
            points(|v| {
                if v < 0.0 { i32::MIN } else { v as i32 }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
        (7, doubles(), false),
        (
            7,
            points(|v| if v < 0.0 { f64::MIN } else { v }.to_le_bytes().to_vec()),
            true,
        ),
        (
            7,
            points(|v| {
                if v < 0.0 { f64::MIN_POSITIVE } else { v }
                    .to_le_bytes()
                    .to_vec()
            }),
            true,
        ),
    ];
    for (kind, data, hole) in cases {
        let holes: &[_] = if hole { &[(2, 0)] } else { &[] };
        for version in ["bISO-1.0", "bISO-2.0", "bBCR-1.0"] {
            if kind == 0 {
                // An unsigned type stores -3 as 3.
                let found = read(
                    &file("map.sdf", binary(version, kind, &data)).path,
                    &AS_STATED,
                );
                assert!((found.unwrap().topography.heights[4] - 3e-7).abs() < ROUNDING);
            } else {
                assert_is_it("map.sdf", binary(version, kind, &data), holes);
            }
        }
    }
    // The reader ignores bytes after the points.
    let mut followed = binary("bISO-1.0", 7, &doubles());
    followed.extend(b"<Operator>T</Operator>");
    assert_is_it("map.sdf", followed, &[]);
    // One manufacturer writes two additional numbers into the header. Eight bytes at the end are a trailer.
    let mut longer = [5u32.to_le_bytes(), 1u32.to_le_bytes()].concat();
    longer.extend(doubles());
    assert_is_it("map.sdf", binary("bISO-1.0", 7, &longer), &[]);
    let mut trailed = doubles();
    trailed.extend(b"trailer!");
    assert_is_it("map.sdf", binary("bISO-1.0", 7, &trailed), &[]);
}

#[test]
fn binary_cut_short_or_wrong() {
    let good = binary("bISO-1.0", 7, &doubles());
    let (message, problem) = failure("map.sdf", &good[..good.len() - 1], &AS_STATED);
    assert!(matches!(
        problem,
        ReadProblem::Size {
            found: 128,
            expected: 129,
            ..
        }
    ));
    says(
        &message,
        &["3 x 2 points of double precision", "from byte 81"],
    );
    says(
        &failure("map.sdf", &good[..60], &AS_STATED).0,
        &["60 bytes", "81", "the header"],
    );
    let with = |at: usize, value: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        failure("map.sdf", bytes, &AS_STATED).0
    };
    says(&with(42, &[0, 0]), &["NumPoints", "found 0", "at least 1"]);
    says(&with(44, &[0xff, 0xff]), &["129 bytes", "3 x 65535 points"]);
    says(&with(46, &0f64.to_le_bytes()), &["spacing", "0e0 x 3e-6"]);
    says(
        &with(62, &f64::NAN.to_le_bytes()),
        &["Zscale", "NaN", "positive"],
    );
    says(&with(78, &[1]), &["Compression = 1"]);
    says(&with(79, &[9]), &["DataType", "found 9"]);
    says(&with(80, &[1]), &["CheckType = 1"]);
    says(
        &with(81 + 8, &f64::INFINITY.to_le_bytes()),
        &["point (1, 0) is inf"],
    );
    let huge = {
        let mut bytes = binary("bISO-2.0", 7, &doubles());
        bytes[42..50].fill(0xff);
        failure("map.sdf", bytes, &AS_STATED)
    };
    assert!(matches!(huge.1, ReadProblem::Size { .. }), "{}", huge.0);
}
