//! AL3D files: tags of 52 bytes, then depths.

use fretwear::surface::readers::{ReadOptions, ReadProblem, read};

use super::AS_STATED;
use super::malformed::{failure, says};
use super::writers::file;

/// Heights \[m\] of 3 points along x and 2 points along y, line by line.
const LINES: [[f32; 3]; 2] = [[0.07, 0.08, 0.09], [-0.01, 0.02, 0.03]];

/// Value of a point without a measurement, and its text in the tag.
const HOLE: f32 = 3.000_000_3e15;
const HOLE_PRINTED: &str = "3e+15";

const OFFSET: usize = 700;

fn tag(name: &str, value: &str) -> Vec<u8> {
    let mut bytes = vec![0u8; 52];
    bytes[..name.len()].copy_from_slice(name.as_bytes());
    bytes[20..20 + value.len()].copy_from_slice(value.as_bytes());
    bytes[50..].copy_from_slice(b"\r\n");
    bytes
}

fn good_tags() -> Vec<(&'static str, String)> {
    let texture = OFFSET + 4 * 8 * 2;
    [
        ("Cols", "3"),
        ("IconOffset", "0"),
        ("DepthImageOffset", "700"),
        ("InvalidPixelValue", HOLE_PRINTED),
        ("PixelSizeYMeter", "3e-06"),
        ("PixelSizeXMeter", "2e-06"),
        ("NumberOfPlanes", "4"),
        ("Rows", "2"),
    ]
    .map(|(name, value)| (name, value.to_owned()))
    .into_iter()
    .chain([("TextureImageOffset", texture.to_string())])
    .collect()
}

/// File with a texture of 6 bytes after the heights. With `filled`, the length of each line is a multiple of eight points.
fn al3d(tags: &[(&str, String)], filled: bool, point: impl Fn(usize, usize) -> f32) -> Vec<u8> {
    let mut bytes = b"AliconaImaging\0\r\n".to_vec();
    bytes.extend(tag("Version", "1"));
    bytes.extend(tag("TagCount", &tags.len().to_string()));
    for (name, value) in tags {
        bytes.extend(tag(name, value));
    }
    bytes.extend(vec![0u8; 10]);
    bytes.resize(OFFSET, 0);
    for j in 0..2 {
        let end = if filled { 8 } else { 3 };
        for i in 0..end {
            let depth = if i < 3 { point(i, j) } else { 99.0 };
            bytes.extend(depth.to_le_bytes());
        }
    }
    bytes.extend(b"colour");
    bytes
}

fn set(name: &str, value: &str) -> Vec<(&'static str, String)> {
    let mut tags = good_tags();
    let found = tags.iter_mut().find(|(key, _)| *key == name);
    found.expect("a tag of the file").1 = value.to_owned();
    tags
}

fn plain(i: usize, j: usize) -> f32 {
    LINES[j][i]
}

#[test]
fn depths_with_holes_and_filled_lines() {
    let point = |i, j| if (i, j) == (2, 1) { HOLE } else { plain(i, j) };
    let short = set("TextureImageOffset", &(OFFSET + 24).to_string());
    for (tags, filled) in [(good_tags(), true), (short, false)] {
        let found = read(
            &file("map.al3d", al3d(&tags, filled, point)).path,
            &AS_STATED,
        )
        .unwrap()
        .topography;
        assert_eq!((found.nx, found.ny, found.holes()), (3, 2, 1));
        assert_eq!(found.spacing, Some([2e-6, 3e-6]));
        assert!(found.heights[2 * 2 + 1].is_nan());
        for (i, j) in [(0, 0), (1, 0), (2, 0), (0, 1), (1, 1)] {
            assert_eq!(found.heights[i * 2 + j], f64::from(LINES[j][i]));
        }
    }
    // No texture and no value of a hole. NaN is also a hole.
    let mut tags = set("TextureImageOffset", "0");
    tags.retain(|(name, _)| *name != "InvalidPixelValue");
    let nan = |i, j| {
        if (i, j) == (0, 0) {
            f32::NAN
        } else {
            plain(i, j)
        }
    };
    let found = read(&file("map.AL3D", al3d(&tags, true, nan)).path, &AS_STATED)
        .unwrap()
        .topography;
    assert_eq!(found.holes(), 1);
    assert!(found.heights[0].is_nan());
}

#[test]
fn every_tag() {
    let with = |tags: &[(&str, String)]| failure("map.al3d", al3d(tags, true, plain), &AS_STATED).0;
    for name in [
        "Cols",
        "Rows",
        "PixelSizeXMeter",
        "PixelSizeYMeter",
        "DepthImageOffset",
    ] {
        let tags: Vec<_> = good_tags()
            .into_iter()
            .filter(|(n, _)| *n != name)
            .collect();
        says(&with(&tags), &["nothing", &format!("the tag {name}")]);
        says(
            &with(&set(name, "3;4")),
            &[&format!("the tag {name}"), "\"3;4\"", "number"],
        );
    }
    for name in ["Cols", "Rows", "DepthImageOffset"] {
        says(
            &with(&set(name, "0")),
            &[&format!("the tag {name}"), "\"0\"", "at least 1"],
        );
    }
    says(
        &with(&set("InvalidPixelValue", "none")),
        &["InvalidPixelValue", "\"none\"", "number"],
    );
    says(
        &with(&set("PixelSizeXMeter", "0")),
        &["spacing", "0e0 x 3e-6 m"],
    );
    // Two tags of the format and nine other tags follow 17 bytes.
    says(
        &with(&set("DepthImageOffset", "588")),
        &["DepthImageOffset", "588", "at least 589"],
    );
    says(
        &with(&set("TextureImageOffset", "720")),
        &["TextureImageOffset", "720", "at least 764", "3 x 2 points"],
    );
    says(
        &with(&set("TextureImageOffset", "-1")),
        &["TextureImageOffset", "\"-1\"", "whole number"],
    );
    let (message, problem) = failure(
        "map.al3d",
        al3d(&set("Rows", "20"), true, plain),
        &AS_STATED,
    );
    assert!(matches!(
        problem,
        ReadProblem::Size {
            found: 770,
            expected: 1340,
            ..
        }
    ));
    says(&message, &["20 lines of 8 points", "from byte 700"]);
    says(
        &with(&set("Cols", "18446744073709551615")),
        &["the file has 770 bytes"],
    );
}

#[test]
fn files_cut_short_or_of_another_kind() {
    let good = al3d(&good_tags(), true, plain);
    let with = |bytes: &[u8]| failure("map.al3d", bytes, &AS_STATED).0;
    says(&with(&good[..60]), &["60 bytes", "69", "Version"]);
    says(&with(&good[..300]), &["300 bytes", "TagCount"]);
    says(&with(&good[..763]), &["763 bytes", "764", "2 lines"]);
    let edit = |at: usize, value: &[u8]| {
        let mut bytes = good.clone();
        bytes[at..at + value.len()].copy_from_slice(value);
        with(&bytes)
    };
    says(&edit(37, b"2"), &["version \"2\"", "version 1"]);
    says(&edit(89, b"many"), &["TagCount", "\"many\""]);
    // One tag is one byte too long.
    says(&edit(119, b"x\r"), &["byte 119", "x\\r", "52 bytes"]);
    let (message, problem) = failure("map.al3d", b"AliconaImage", &AS_STATED);
    assert!(matches!(problem, ReadProblem::WrongMagic { .. }));
    says(&message, &["AliconaImaging"]);
    let micrometres = ReadOptions {
        height_unit: Some(1e-6),
        ..AS_STATED
    };
    let (_, problem) = failure("map.al3d", &good, &micrometres);
    assert!(matches!(problem, ReadProblem::UnitConflict { .. }));
    let endless = |i, j| {
        if (i, j) == (1, 1) {
            f32::INFINITY
        } else {
            plain(i, j)
        }
    };
    says(
        &with(&al3d(&good_tags(), true, endless)),
        &["point (1, 1) is inf"],
    );
}
