use std::collections::HashMap;
use std::path::Path;
use std::sync::Arc;

use arrow_array::{
    ArrayRef, BooleanArray, Float64Array, Int32Array, RecordBatch, StringArray, UInt16Array,
};
use arrow_schema::{Field, Schema};
use fretwear::surface::readers::{ReadOptions, read};
use fretwear::surface::topography::Topography;
use parquet::arrow::ArrowWriter;
use parquet::basic::{Compression, CompressionCodec, GzipLevel, ZstdLevel};
use parquet::file::metadata::{ParquetMetaDataReader, ParquetMetaDataWriter};
use parquet::file::properties::WriterProperties;

use super::writers::{Sur, file, npy, sur, x3p_description, zip};
use super::{AS_STATED, MICROMETRES};
use crate::support::Chance;

/// Rounding of one product of a unit and a number.
const ROUNDING: f64 = 1e-15;

/// Every test file has 4 points along x and 3 points along y, with heights in micrometres. Point (2, 1) has no measurement.
const NX: usize = 4;
const NY: usize = 3;

fn height(i: usize, j: usize) -> f64 {
    if (i, j) == (2, 1) {
        f64::NAN
    } else {
        10.0 * i as f64 + j as f64 - 7.0
    }
}

fn in_our_order() -> Vec<f64> {
    (0..NX * NY).map(|k| height(k / NY, k % NY)).collect()
}

/// Heights line by line, with x fastest.
fn in_lines() -> Vec<f64> {
    (0..NX * NY).map(|k| height(k % NX, k / NX)).collect()
}

fn assert_is_it(found: &Topography, spacing: Option<[f64; 2]>, hole: bool) {
    assert_eq!((found.nx, found.ny), (NX, NY));
    match (found.spacing, spacing) {
        (Some(a), Some(b)) => {
            // SUR files use single precision.
            assert!(
                (0..2).all(|k| (a[k] / b[k] - 1.0).abs() < 1e-7),
                "{a:?} {b:?}"
            );
        }
        (a, b) => assert_eq!(a, b),
    }
    for (k, (h, expected)) in found.heights.iter().zip(in_our_order()).enumerate() {
        if expected.is_nan() {
            assert_eq!(h.is_nan(), hole, "point {k}: {h}");
        } else {
            assert!((h - expected * 1e-6).abs() < ROUNDING, "point {k}: {h}");
        }
    }
}

fn read_file(name: &str, bytes: impl AsRef<[u8]>, options: &ReadOptions) -> Topography {
    read(&file(name, bytes).path, options).unwrap().topography
}

#[test]
fn npy_of_every_type_and_order() {
    let ours = in_our_order();
    let columns: Vec<f64> = in_lines();
    let shape = format!("({NX}, {NY})");
    let bytes = |values: &[f64], number: &dyn Fn(f64) -> Vec<u8>| -> Vec<u8> {
        values.iter().flat_map(|&v| number(v)).collect()
    };
    let cases: [(&str, bool, Vec<u8>); 5] = [
        ("<f8", false, bytes(&ours, &|v| v.to_le_bytes().to_vec())),
        (">f8", false, bytes(&ours, &|v| v.to_be_bytes().to_vec())),
        // Fortran order of the file: axis 0 (x) is fastest.
        ("<f8", true, bytes(&columns, &|v| v.to_le_bytes().to_vec())),
        (
            "<f4",
            false,
            bytes(&ours, &|v| (v as f32).to_le_bytes().to_vec()),
        ),
        (
            ">f4",
            true,
            bytes(&columns, &|v| (v as f32).to_be_bytes().to_vec()),
        ),
    ];
    for (descr, fortran, data) in cases {
        let found = read_file("map.npy", npy(descr, fortran, &shape, &data), &MICROMETRES);
        assert_is_it(&found, None, true);
    }
    // Integers have no holes, so NaN became 0.
    let integers: [(&str, Vec<u8>); 6] = [
        ("|i1", bytes(&ours, &|v| (v as i8).to_le_bytes().to_vec())),
        ("<i2", bytes(&ours, &|v| (v as i16).to_le_bytes().to_vec())),
        (">i2", bytes(&ours, &|v| (v as i16).to_be_bytes().to_vec())),
        ("<i4", bytes(&ours, &|v| (v as i32).to_le_bytes().to_vec())),
        ("<i8", bytes(&ours, &|v| (v as i64).to_le_bytes().to_vec())),
        (">i8", bytes(&ours, &|v| (v as i64).to_be_bytes().to_vec())),
    ];
    for (descr, data) in integers {
        let found = read_file("map.npy", npy(descr, false, &shape, &data), &MICROMETRES);
        assert_is_it(&found, None, false);
    }
    let unsigned = npy("<u2", false, "(1, 2)", &[1, 0, 0xff, 0xff]);
    let found = read_file("map.npy", unsigned, &MICROMETRES);
    assert_eq!(found.heights, [1e-6, 65535.0 * 1e-6]);
}

#[test]
fn the_first_bytes_decide_under_a_foreign_extension() {
    let data: Vec<u8> = in_our_order()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let found = read_file(
        "map.backup",
        npy("<f8", false, "(4, 3)", &data),
        &MICROMETRES,
    );
    assert_is_it(&found, None, true);
}

#[test]
fn text_matrices_with_every_separator() {
    for (separator, name) in [
        (",", "a.csv"),
        (";", "b.CSV"),
        ("\t", "c.tsv"),
        ("  ", "d.txt"),
    ] {
        let lines = (0..NX).map(|i| {
            let values = (0..5).map(|j| {
                if (i, j) == (2, 1) {
                    "nan".into()
                } else {
                    format!("{}", i * 10 + j)
                }
            });
            values.collect::<Vec<_>>().join(separator)
        });
        let text = format!(
            "# made by hand\n{}\n\n# end\n",
            lines.collect::<Vec<_>>().join("\n")
        );
        let found = read_file(name, text, &MICROMETRES);
        assert_eq!((found.nx, found.ny, found.spacing), (NX, 5, None), "{name}");
        assert!(found.heights[11].is_nan() && found.holes() == 1);
        assert!(
            (found.heights[3 * 5 + 4] - 34e-6).abs() < ROUNDING,
            "lines run along x"
        );
    }
    // A separator after every value, an empty field for a hole, Windows line endings and a byte order mark.
    let found = read_file("e.csv", "\u{feff}1;2;;4;\r\n5;6;7;8;\r\n", &MICROMETRES);
    assert_eq!((found.nx, found.ny, found.holes()), (2, 4, 1));
    assert!(found.heights[2].is_nan() && (found.heights[7] - 8e-6).abs() < ROUNDING);
}

#[test]
fn xyz_tables_in_any_order_with_points_missing() {
    // Positions in millimetres, heights in micrometres, rounded coordinates, last row first.
    let mut rows: Vec<String> = (0..NX * NY)
        .filter(|&k| (k % NX, k / NX) != (2, 1))
        .map(|k| {
            let (i, j) = (k % NX, k / NX);
            format!(
                "{:.4} {:.4} {}",
                0.1 + 0.3333333 * i as f64,
                0.25 * j as f64,
                height(i, j)
            )
        })
        .collect();
    rows.reverse();
    let options = ReadOptions {
        lateral_unit: Some(1e-3),
        ..MICROMETRES
    };
    let found = read_file("map.xyz", format!("x y z\n{}\n", rows.join("\n")), &options);
    let spacing = found.spacing.unwrap();
    assert!(
        (spacing[0] / 0.3333333e-3 - 1.0).abs() < 1e-4
            && (spacing[1] / 0.25e-3 - 1.0).abs() < 1e-12
    );
    assert_is_it(
        &Topography {
            spacing: None,
            ..found
        },
        None,
        true,
    );

    // A missing line of x does not move the other lines.
    let gap: String = (0..6)
        .filter(|i| *i != 3)
        .flat_map(|i| (0..4).map(move |j| format!("{i},{},{}\n", 2 * j, i * 10 + j)))
        .collect();
    let found = read_file("map.csv", gap, &MICROMETRES);
    assert_eq!((found.nx, found.ny, found.holes()), (6, 4, 4));
    assert!((found.heights[5 * 4 + 3] - 53e-6).abs() < ROUNDING);
    // By default, the positions have the unit of the heights.
    let spacing = found.spacing.unwrap();
    assert!((spacing[0] - 1e-6).abs() < ROUNDING && (spacing[1] - 2e-6).abs() < ROUNDING);
}

/// Heights that resemble labels or positions, and comments and names that agree with the content.
#[test]
fn text_that_only_looks_like_another() {
    let whole = "0,1,2,3\n7,5,,6\n1,2,3,4\n";
    let found = read_file("map.csv", whole, &MICROMETRES);
    assert_eq!((found.nx, found.ny, found.holes()), (3, 4, 1));
    // Two numbers are not an increasing sequence.
    let found = read_file("map.csv", "0,1\n0.5,0.25\n", &MICROMETRES);
    assert_eq!((found.nx, found.ny), (2, 2));
    // The pairs do not form a complete grid, or a pair occurs twice.
    for text in [
        "0,0,1.5,2\n1,1,0.5,1\n2,2,2.5,3\n",
        "0,0,1.5,2\n0,1,0.5,1\n0,0,2.5,3\n1,1,1,1\n",
        "0.1,0.2,0.3,0.2\n0.2,0.2,0.4,0.3\n0.3,0.1,0.2,0.2\n0.5,0.4,0.3,0.1\n",
    ] {
        assert_eq!(read_file("map.txt", text, &MICROMETRES).ny, 4, "{text}");
    }
    let heights = "0.5 1.5 2.5 3.5\n1.5 2.5 3.5 4.5\n0.5 1.5 0.5 0.5\n";
    let comments = "# Channel: by hand\n# Width: 4 mm\n";
    let found = read_file("map.txt", format!("{comments}{heights}"), &MICROMETRES);
    assert_eq!((found.nx, found.ny), (3, 4));

    for names in [
        "x,y,z",
        "X,Y,Z",
        "x [um],y [um],z [um]",
        "x (mm), y (mm), z (um)",
        "\"x\",\"y\",\"z\"",
        "x_um,y_um,z_um",
    ] {
        let text = format!("{names}\n0,0,1\n0,2,3\n3,0,4\n3,2,5\n6,0,1\n6,2,2\n");
        let found = read_file("map.csv", text, &MICROMETRES);
        assert_eq!((found.nx, found.ny), (3, 2), "{names}");
    }
    let found = read_file(
        "map.xyz",
        "x [um] y [um] z [um]\n0 0 1\n0 2 3\n",
        &MICROMETRES,
    );
    assert_eq!((found.nx, found.ny), (1, 2));
}

/// Different encodings of the same 3 x 4 heights, and the remark of the reader for each encoding.
#[test]
fn text_in_every_encoding_and_with_decimal_commas() {
    let wide = |big: bool| -> Vec<u8> {
        let text = "\u{feff}1.5;2.5;3;4\n5;6;;8\n-1;2;3;1e-1\n".encode_utf16();
        let bytes = text.flat_map(|c| {
            if big {
                c.to_be_bytes()
            } else {
                c.to_le_bytes()
            }
        });
        bytes.collect()
    };
    for (bytes, remark) in [
        (
            &b"1,5;2,5;3;4\n5;6;;8\n-1;2;3;1e-1\n"[..],
            "commas are read as decimal points",
        ),
        (
            b"1,5\t2,5\t3\t4\n5\t6\t\t8\n-1\t2\t3\t1e-1\n",
            "commas are read as decimal points",
        ),
        (
            b"1,5 2,5 3,0 4\n5 6 Bad 8\n-1 2 3 1e-1\n",
            "commas are read as decimal points",
        ),
        (
            b"1.5, 2.5, 3, 4\n5, 6, , 8\n-1, 2, 3, 1e-1\n",
            "3 lines of 4 values",
        ),
        (
            b"\xef\xbb\xbf1.5,2.5,3,4\n5,6,n/a,8\n-1,2,3,1e-1\n",
            "1 \"N/A\"",
        ),
        (
            b"# heights in \xb5m\n1.5 2.5 3 4\n5 6 -- 8\n-1 2 3 1e-1\n",
            "the text is read as windows-1252",
        ),
        (&wide(false), "the text is read as UTF-16LE"),
        (&wide(true), "the text is read as UTF-16BE"),
    ] {
        let found = read(&file("map.txt", bytes).path, &MICROMETRES).unwrap();
        let map = found.topography;
        assert_eq!((map.nx, map.ny, map.holes()), (3, 4, 1), "{remark}");
        for (k, value) in [(0, 1.5), (1, 2.5), (3, 4.0), (8, -1.0), (11, 0.1)] {
            assert!((map.heights[k] - 1e-6 * value).abs() < ROUNDING, "{remark}");
        }
        let remarks = found.remarks.join("\n");
        assert!(remarks.contains(remark), "{remark}: {remarks}");
    }
}

/// Headers of programs that write one y per line: 4 points along x, 3 points along y.
#[test]
fn headers_above_a_matrix() {
    let lines = "1\t2\t3\t4\n5\t6\t7\t8\n9\t10\t11\t12\n";
    let mask = "1 1 1 1\n1 1 0 1\n1 1 1 1\n".replace(' ', "\t");
    let gwyddion = "# Channel: T\n# Width: 4.0 µm\n# Height: 1.5 µm\n# Value units: nm\n";
    let german = "# Kanal: T\n# Breite: 4,0 µm\n# Höhe: 1500 nm\n# Einheiten: nm\n";
    let spip = "# File Format = ASCII\n# Created by SPIP\n# x-pixels = 4\n# y-pixels = 3\n# x-length = 4000\n# y-length = 1500\n# z-unit = [nm]\n# voidpixels =0\n# Start of Data:\n";
    let bits = &spip.replace("# z-unit = [nm]", "# Bit2nm = 0.5");
    let voids = &spip.replace("voidpixels =0", "voidpixels =1");
    let attocube = &spip
        .replace(" =", ":")
        .replace("4000", "4")
        .replace("1500", "1.5\n# x-unit: um\n# y-unit: um");
    for (header, below, unit, holes) in [
        (gwyddion, "", 1e-9, 0),
        (german, "", 1e-9, 0),
        (spip, "", 1e-9, 0),
        (bits, "", 0.5e-9, 0),
        (voids, &mask[..], 1e-9, 1),
        (attocube, "", 1e-9, 0),
    ] {
        let text = format!("{header}{lines}{below}");
        let found = read(&file("map.asc", text).path, &AS_STATED).unwrap();
        assert_eq!(found.stated_unit, Some(unit), "{header}");
        let map = found.topography;
        assert_eq!((map.nx, map.ny, map.holes()), (4, 3, holes), "{header}");
        let [dx, dy] = map.spacing.unwrap();
        assert!(
            (dx - 1e-6).abs() < ROUNDING && (dy - 0.5e-6).abs() < ROUNDING,
            "{header}"
        );
        // The second value of the third line.
        let height = map.heights[3 + 2];
        assert!(
            (height - 10.0 * unit).abs() < ROUNDING,
            "{header}: {height}"
        );
        assert_eq!(map.heights[2 * 3 + 1].is_nan(), holes == 1);
    }
    // A table of points may also have units in its header.
    let points = "# Channel: T\n# Lateral units: mm\n# Value units: nm\n0 0 1\n0 2 2\n3 0 3\n3 2 4\n6 0 5\n6 2 6\n";
    let found = read(&file("map.xyz", points).path, &AS_STATED).unwrap();
    assert_eq!(found.stated_unit, Some(1e-9));
    let map = found.topography;
    assert_eq!((map.nx, map.ny), (3, 2));
    assert!((map.spacing.unwrap()[0] - 3e-3).abs() < ROUNDING);
    assert!((map.heights[5] - 6e-9).abs() < 1e-9 * ROUNDING);
}

#[test]
fn units_in_brackets_are_those_of_their_columns() {
    let rows = "0,0,1\n0,2,3\n3,0,4\n3,2,5\n6,0,1\n6,2,2\n";
    for (names, [x, y], z) in [
        ("x [mm],y (um),z [nm]", [1e-3, 1e-6], 1e-9),
        ("x [mm],y [mm],z (nm)", [1e-3, 1e-3], 1e-9),
        ("X Position [um],Y Position [um],Z [µm]", [1e-6, 1e-6], 1e-6),
        // The unit of z applies to the other columns.
        ("x,y,z [nm]", [1e-9, 1e-9], 1e-9),
    ] {
        let found = read(
            &file("map.csv", format!("{names}\n{rows}")).path,
            &AS_STATED,
        )
        .unwrap();
        assert_eq!(found.stated_unit, Some(z), "{names}");
        let assumed = found
            .remarks
            .iter()
            .any(|r| r == "x is read in the unit of z, 1e-9 m");
        assert_eq!(assumed, names.starts_with("x,"), "{:?}", found.remarks);
        let map = found.topography;
        let [dx, dy] = map.spacing.unwrap();
        assert!((dx / (3.0 * x) - 1.0).abs() < ROUNDING, "{names}: {dx}");
        assert!((dy / (2.0 * y) - 1.0).abs() < ROUNDING, "{names}: {dy}");
        assert!(
            (map.heights[3] / (5.0 * z) - 1.0).abs() < ROUNDING,
            "{names}"
        );
    }
}

#[test]
fn sur_of_both_widths() {
    // The step is 1/10 µm and the offset 3 µm. The lowest measured point has -77 - 30 steps.
    let raw = |v: f64| {
        if v.is_nan() {
            -102
        } else {
            (10.0 * v) as i32 - 30
        }
    };
    let points: Vec<i32> = in_lines().into_iter().map(raw).collect();
    for (bits, units, spacing, step, offset) in [
        (
            16,
            [&b"mm"[..], b"mm", b"\xb5m"],
            [0.5f32, 0.25],
            0.1f32,
            3.0f32,
        ),
        (
            32,
            [&b"um"[..], b"um", b"nm"],
            [500.0, 250.0],
            100.0,
            3000.0,
        ),
    ] {
        let about = Sur {
            bits,
            nx: NX as i32,
            ny: NY as i32,
            lowest: -100,
            holes: true,
            spacing,
            step,
            offset,
            units,
            comment: b"seven!!",
        };
        let found = read_file("map.sur", sur(&about, &points), &AS_STATED);
        // The step has single precision: seven digits of 32 µm.
        for (h, expected) in found.heights.iter().zip(in_our_order()) {
            assert!(h.is_nan() == expected.is_nan());
            assert!(
                h.is_nan() || (h - 1e-6 * expected).abs() < 1e-11,
                "{h} {expected}"
            );
        }
        assert_eq!(found.holes(), 1);
        assert!((found.spacing.unwrap()[0] - 0.5e-3).abs() < 1e-10);
        assert!((found.spacing.unwrap()[1] - 0.25e-3).abs() < 1e-10);

        let unflagged = Sur {
            holes: false,
            ..about
        };
        assert_eq!(
            read_file("map.sur", sur(&unflagged, &points), &AS_STATED).holes(),
            0
        );
    }
}

#[test]
fn sur_of_other_kinds_and_code_pages() {
    let about = |unit| Sur {
        bits: 16,
        nx: 3,
        ny: 2,
        lowest: 1,
        holes: false,
        spacing: [1.0, 2.0],
        step: 1.0,
        offset: 0.0,
        units: [b"mm", b"mm", unit],
        comment: b"",
    };
    let points = [1, 2, 3, 4, 5, 6];
    for unit in [&b"\xb5m"[..], "µm".as_bytes(), b"\xe6m", b"um\0garbage"] {
        let found = read_file("map.sur", sur(&about(unit), &points), &AS_STATED);
        assert!((found.heights[1] - 4e-6).abs() < ROUNDING, "{unit:?}");
    }
    let with = |changes: &[(usize, &[u8])]| {
        let mut bytes = sur(&about(b"um"), &points);
        for (at, value) in changes {
            bytes[*at..at + value.len()].copy_from_slice(value);
        }
        read(&file("map.sur", bytes).path, &AS_STATED).unwrap()
    };
    let plain = with(&[]);
    assert_eq!(plain.remarks, [""; 0]);
    for (changes, remark) in [
        (&[(18, &[1u8, 0][..]), (20, b"SCRATCH")][..], None),
        (
            &[(18, &[16, 0])],
            Some("the images of colours and intensity"),
        ),
        (&[(14, &[3, 0])], Some("the first of 3 objects")),
        (&[(290, &[1, 0])], Some("inverted")),
    ] {
        let found = with(changes);
        assert_eq!(found.topography, plain.topography);
        let remarks = found.remarks.join("\n");
        assert!(remarks.contains(remark.unwrap_or_default()), "{remarks}");
        assert_eq!(remarks.is_empty(), remark.is_none());
    }
}

#[test]
fn x3p_in_other_encodings_and_folders() {
    let float = "<DataType>D</DataType><Increment>1e-6</Increment>";
    let text = x3p_description(NX, NY, [0.5e-3, 0.25e-3], float, false);
    let text = text.replace("<Comment/>", "<Comment>in µm</Comment>");
    let data: Vec<u8> = in_lines()
        .iter()
        .flat_map(|v| (1e-6 * v).to_le_bytes())
        .collect();
    let wide = |mark: &str, name: &str, big: bool| -> Vec<u8> {
        let text = format!("{mark}{}", text.replace("UTF-8", name));
        let units = text.encode_utf16();
        units
            .flat_map(|c| {
                if big {
                    c.to_be_bytes()
                } else {
                    c.to_le_bytes()
                }
            })
            .collect()
    };
    let narrow = |name: &str| -> Vec<u8> {
        let text = text.replace("UTF-8", name);
        text.chars().map(|c| c as u8).collect()
    };
    for main in [
        text.clone().into_bytes(),
        format!("\u{feff}{text}").into_bytes(),
        text.replace(" encoding=\"UTF-8\"", "").into_bytes(),
        // The encoding is readable but differs from the declaration.
        text.replace("UTF-8", "UTF-16").into_bytes(),
        narrow("ISO-8859-1"),
        narrow("windows-1252"),
        wide("\u{feff}", "UTF-16", false),
        wide("\u{feff}", "UTF-16", true),
        wide("", "UTF-16LE", false),
        wide("", "UTF-16BE", true),
    ] {
        for folder in ["", "map/", "a/b/", "map\\"] {
            let names = ["main.xml", "bindata/data.bin"].map(|name| format!("{folder}{name}"));
            let members = [(&names[0][..], &main[..]), (&names[1], &data)];
            let found = read(&file("map.x3p", zip(&members)).path, &AS_STATED).unwrap();
            assert_is_it(&found.topography, Some([0.5e-3, 0.25e-3]), true);
            let remark = &found.remarks[0];
            assert!(
                remark.contains("CZ/Increment, 1e-6, does not scale"),
                "{remark}"
            );
        }
    }
    let broken = narrow("UTF-8");
    let error = read(
        &file("map.x3p", zip(&[("main.xml", &broken)])).path,
        &AS_STATED,
    );
    let message = error.unwrap_err().to_string();
    assert!(message.contains("bytes that are not UTF-8"), "{message}");
}

#[test]
fn x3p_of_every_type() {
    let lines = in_lines();
    let increments = [0.5e-3, 0.25e-3];
    // Floating-point heights are metres for any increment. Integers count increments above the offset.
    let float = "<DataType>D</DataType><Increment>5</Increment>";
    let single = "<DataType>F</DataType>";
    let short = "<DataType>I</DataType><Increment>1e-7</Increment><Offset>1e-5</Offset>";
    let long = "<DataType>L</DataType><Increment>1e-9</Increment>";
    let encode = |number: &dyn Fn(f64) -> Vec<u8>| -> Vec<u8> {
        lines.iter().flat_map(|&v| number(v)).collect()
    };
    // Lowest bit first. Point 6 of the lines is (2, 1). The spare bits at the end are set.
    let valid: &[u8] = &[0b1011_1111, 0b1111_1111];
    let cases = [
        (float, encode(&|v| (1e-6 * v).to_le_bytes().to_vec()), false),
        (
            single,
            encode(&|v| (1e-6 * v as f32).to_le_bytes().to_vec()),
            false,
        ),
        (
            short,
            encode(&|v| ((10.0 * v) as i16 - 100).to_le_bytes().to_vec()),
            true,
        ),
        (
            long,
            encode(&|v| ((1000.0 * v) as i32).to_le_bytes().to_vec()),
            true,
        ),
        (float, encode(&|v| (1e-6 * v).to_le_bytes().to_vec()), true),
    ];
    for (z, data, mask) in cases {
        let description = x3p_description(NX, NY, increments, z, mask);
        let mut members = vec![
            ("main.xml", description.as_bytes()),
            ("bindata/data.bin", &data[..]),
        ];
        if mask {
            members.push(("bindata/valid.bin", valid));
        }
        let found = read_file("map.x3p", zip(&members), &AS_STATED);
        assert_eq!((found.nx, found.ny, found.holes()), (NX, NY, 1), "{z}");
        for (h, expected) in found.heights.iter().zip(in_our_order()) {
            assert!(
                h.is_nan() || (h - 1e-6 * expected).abs() < 4e-12,
                "{z}: {h} {expected}"
            );
        }
        assert_eq!(found.spacing, Some(increments));
    }
}

fn write_table(columns: Vec<(&str, Option<&str>, ArrayRef)>) -> Vec<u8> {
    compressed(columns, Compression::UNCOMPRESSED)
}

fn compressed(columns: Vec<(&str, Option<&str>, ArrayRef)>, compression: Compression) -> Vec<u8> {
    let fields: Vec<Field> = columns
        .iter()
        .map(|(name, unit, array)| {
            let metadata: HashMap<_, _> = unit
                .iter()
                .map(|u| ("unit".to_owned(), (*u).to_owned()))
                .collect();
            Field::new(*name, array.data_type().clone(), true).with_metadata(metadata)
        })
        .collect();
    let schema = Arc::new(Schema::new(fields));
    let arrays = columns.into_iter().map(|(_, _, array)| array).collect();
    let batch = RecordBatch::try_new(schema.clone(), arrays).unwrap();
    let mut bytes = Vec::new();
    let properties = WriterProperties::builder()
        .set_compression(compression)
        .build();
    let mut writer = ArrowWriter::try_new(&mut bytes, schema, Some(properties)).unwrap();
    writer.write(&batch).unwrap();
    writer.close().unwrap();
    bytes
}

#[test]
fn parquet_by_indices_and_by_positions() {
    let cells: Vec<(usize, usize)> = (0..NX * NY)
        .map(|k| (k / NY, k % NY))
        .filter(|&c| c != (2, 1))
        .collect();
    let i: ArrayRef = Arc::new(UInt16Array::from_iter_values(
        cells.iter().map(|c| c.0 as u16),
    ));
    let j: ArrayRef = Arc::new(Int32Array::from_iter_values(
        cells.iter().map(|c| c.1 as i32),
    ));
    let heights = |unit: f64| -> ArrayRef {
        Arc::new(Float64Array::from_iter_values(
            cells.iter().map(|c| unit * height(c.0, c.1)),
        ))
    };
    let stated = write_table(vec![
        ("i", Some("1"), i.clone()),
        ("j", Some("1"), j.clone()),
        ("height", Some("m"), heights(1e-6)),
    ]);
    assert_is_it(
        &read_file("surface.parquet", stated, &AS_STATED),
        None,
        true,
    );
    let unstated = write_table(vec![
        ("i", None, i),
        ("j", None, j),
        ("height", None, heights(1.0)),
    ]);
    assert_is_it(
        &read_file("surface.parquet", unstated, &MICROMETRES),
        None,
        true,
    );

    let x: ArrayRef = Arc::new(Float64Array::from_iter_values(
        cells.iter().map(|c| 0.5 * c.0 as f64),
    ));
    let y: ArrayRef = Arc::new(Float64Array::from_iter_values(
        cells.iter().map(|c| 0.25 * c.1 as f64),
    ));
    let positions = write_table(vec![
        ("x", Some("mm"), x),
        ("y", Some("mm"), y),
        ("z", Some("µm"), heights(1.0)),
    ]);
    let found = read_file("points.parquet", positions, &AS_STATED);
    assert_is_it(&found, Some([0.5e-3, 0.25e-3]), true);
}

/// Default and common compressions of pandas, pyarrow and DuckDB.
#[test]
fn parquet_of_every_compression() {
    let column = |value: &dyn Fn(usize, usize) -> f64| -> ArrayRef {
        let values = (0..NX * NY).map(|k| value(k / NY, k % NY));
        Arc::new(Float64Array::from_iter_values(values))
    };
    for compression in [
        Compression::UNCOMPRESSED,
        Compression::SNAPPY,
        Compression::GZIP(GzipLevel::default()),
        Compression::LZ4,
        Compression::LZ4_RAW,
        Compression::ZSTD(ZstdLevel::default()),
    ] {
        let columns = vec![
            ("i", None, column(&|i, _| i as f64)),
            ("j", None, column(&|_, j| j as f64)),
            ("height", Some("um"), column(&height)),
        ];
        let bytes = compressed(columns, compression);
        assert_is_it(&read_file("map.parquet", bytes, &AS_STATED), None, true);
        let columns = vec![
            // The reader ignores additional columns.
            (
                "name",
                None,
                Arc::new(StringArray::from(vec!["a"; NX * NY])) as ArrayRef,
            ),
            ("z", Some("um"), column(&height)),
            ("y", Some("mm"), column(&|_, j| 0.25 * j as f64)),
            ("x", Some("mm"), column(&|i, _| 0.5 * i as f64)),
        ];
        let bytes = compressed(columns, compression);
        let found = read_file("map.parquet", bytes, &AS_STATED);
        assert_is_it(&found, Some([0.5e-3, 0.25e-3]), true);
    }
}

/// Parquet file whose metadata state a wrong number of rows or a wrong compression.
fn announcing(bytes: &[u8], rows: Option<i64>, codec: Option<CompressionCodec>) -> Vec<u8> {
    let source = bytes::Bytes::copy_from_slice(bytes);
    let metadata = ParquetMetaDataReader::new()
        .parse_and_finish(&source)
        .unwrap();
    let mut groups = Vec::new();
    for group in metadata.row_groups() {
        let columns = group.columns().iter().map(|column| {
            let codec = codec.unwrap_or(column.compression_codec());
            let builder = column.clone().into_builder();
            builder.set_compression_codec(codec).build().unwrap()
        });
        let columns: Vec<_> = columns.collect();
        let builder = group.clone().into_builder();
        let builder = builder
            .set_num_rows(rows.unwrap_or(group.num_rows()))
            .set_column_metadata(columns);
        groups.push(builder.build().unwrap());
    }
    let changed = metadata.into_builder().set_row_groups(groups).build();
    // The metadata precede the last eight bytes of the file: their length and the magic.
    let footer = &bytes[bytes.len() - 8..];
    let length = u32::from_le_bytes(footer[..4].try_into().unwrap()) as usize;
    let mut found = bytes[..bytes.len() - 8 - length].to_vec();
    ParquetMetaDataWriter::new(&mut found, &changed)
        .finish()
        .unwrap();
    found
}

#[test]
fn parquet_that_announces_what_is_not_read() {
    let one = || -> ArrayRef { Arc::new(Float64Array::from(vec![0.0])) };
    let bytes = write_table(vec![
        ("i", None, one()),
        ("j", None, one()),
        ("height", None, one()),
    ]);
    let refused = |bytes: &[u8]| {
        let written = file("map.parquet", bytes);
        read(&written.path, &MICROMETRES).unwrap_err().to_string()
    };
    assert!(
        read(
            &file("map.parquet", announcing(&bytes, None, None)).path,
            &MICROMETRES
        )
        .is_ok()
    );
    let message = refused(&announcing(&bytes, Some(1 << 40), None));
    assert!(
        message.contains("1099511627776 rows; at most 134217728 points"),
        "{message}"
    );
    let message = refused(&announcing(&bytes, None, Some(CompressionCodec::BROTLI)));
    assert!(
        message.contains(
            "compressed as BROTLI is not supported; read are UNCOMPRESSED, SNAPPY, GZIP, LZ4, LZ4_RAW, ZSTD"
        ),
        "{message}"
    );
}

#[test]
fn the_users_spacing_replaces_the_files() {
    let data: Vec<u8> = in_our_order()
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let options = ReadOptions {
        spacing: Some([2e-6, 3e-6]),
        ..MICROMETRES
    };
    let found = read_file("map.npy", npy("<f8", false, "(4, 3)", &data), &options);
    assert_is_it(&found, Some([2e-6, 3e-6]), true);
    let size = found.size().unwrap();
    assert!((size[0] - 8e-6).abs() < ROUNDING && (size[1] - 9e-6).abs() < ROUNDING);
}

#[test]
fn the_shipped_topography_is_as_its_readme_says() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ground_face.x3p");
    let found = read(&path, &AS_STATED).unwrap().topography;
    assert_eq!((found.nx, found.ny), (256, 192));
    let size = found.size().unwrap();
    assert!(
        (size[0] - 4.096e-3).abs() < 1e-9 && (size[1] - 2.304e-3).abs() < 1e-9,
        "{size:?}"
    );
    assert!(
        found.holes() > 50 && found.holes() < 1000,
        "{}",
        found.holes()
    );
    assert!(std::fs::metadata(&path).unwrap().len() < 300_000);
}

#[test]
fn the_shipped_topography_has_the_statistics_of_its_readme() {
    use fretwear::grid::{Grid, Patch};
    use fretwear::surface::prepare::{Detrend, Fill, PrepareOptions, onto_joint};
    use fretwear::surface::statistics::roughness;

    // The README prints three decimals.
    const PRINTED: f64 = 1e-3;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("data/ground_face.x3p");
    let map = read(&path, &AS_STATED).unwrap().topography;
    assert_eq!(map.holes(), 263);
    let patch = Patch::full(Grid::over(map.size().unwrap(), [map.nx, map.ny]));
    for (detrend, rq, sk, ku) in [
        (Detrend::Mean, 1.668266e-6, -0.837333, 2.957668),
        (Detrend::Plane, 0.921745e-6, -0.662211, 2.816817),
        (Detrend::Quadratic, 0.685324e-6, -0.865729, 3.580798),
    ] {
        let options = PrepareOptions {
            detrend,
            fill: Fill::Mask,
            shift: [0.0; 2],
        };
        let prepared = onto_joint(&map, &patch, options).unwrap();
        let found = roughness(&prepared.patch, &prepared.heights).unwrap();
        assert!(
            (found.rq / rq - 1.0).abs() < PRINTED,
            "{detrend:?} {found:?}"
        );
        assert!(
            (found.sk - sk).abs() < PRINTED && (found.ku - ku).abs() < PRINTED,
            "{detrend:?} {found:?}"
        );
    }
}

/// A cell that a run excludes from its joint has no height in another run. Indices begin at 0.
#[test]
fn parquet_of_cells_that_a_run_has_not_kept() {
    let cells: Vec<(usize, usize)> = (0..NX * NY).map(|k| (k / NY, k % NY)).collect();
    let of = |first: usize| {
        let i = UInt16Array::from_iter_values(cells.iter().map(|c| (c.0 + first) as u16));
        let j = UInt16Array::from_iter_values(cells.iter().map(|c| (c.1 + first) as u16));
        let there = |c: &(usize, usize)| match *c {
            (2, 1) => 0.0,
            (i, j) => 1e-6 * height(i, j),
        };
        let h = Float64Array::from_iter_values(cells.iter().map(there));
        let kept: Vec<bool> = cells.iter().map(|c| *c != (2, 1)).collect();
        write_table(vec![
            ("i", Some("1"), Arc::new(i) as ArrayRef),
            ("j", Some("1"), Arc::new(j)),
            ("height", Some("m"), Arc::new(h)),
            ("kept", None, Arc::new(BooleanArray::from(kept))),
        ])
    };
    let found = read_file("surface.parquet", of(0), &AS_STATED);
    assert_is_it(&found, None, true);
    let written = file("surface.parquet", of(1));
    let refused = read(&written.path, &AS_STATED).unwrap_err().to_string();
    assert!(refused.contains("indices from 0"), "{refused}");
}

/// Positions from a measuring stage deviate slightly from the grid lines, at all points or at one point.
#[test]
fn points_may_be_off_their_lines() {
    let mut chance = Chance::new(5);
    let mut lines = |jitter: f64, alone: f64| -> String {
        let mut text = String::new();
        for k in 0..40 * 28 {
            let mut off = || jitter * (chance.next() - 0.5);
            let (x, y) = ((k / 28) as f64 + off(), (k % 28) as f64 + off());
            let x = if k == 600 { x + alone } else { x };
            text += &format!(
                "{:.9},{:.9},{}\n",
                2.0 * x,
                3.0 * y,
                (k * k % 97) as f64 * 0.01
            );
        }
        text
    };
    for (jitter, alone) in [(0.0, 0.0), (0.0, 0.05), (1e-4, 0.0), (0.05, 0.0)] {
        let map = read_file("points.xyz", lines(jitter, alone), &MICROMETRES);
        assert_eq!(
            (map.nx, map.ny, map.holes()),
            (40, 28, 0),
            "{jitter} {alone}"
        );
        let [dx, dy] = map.spacing.unwrap();
        assert!((dx / 2e-6 - 1.0).abs() < 0.01 && (dy / 3e-6 - 1.0).abs() < 0.01);
    }
    let written = file("points.xyz", lines(0.0, 0.3));
    assert!(read(&written.path, &MICROMETRES).is_err());
}

/// The reader rejects positions above or beside heights, for any first value and either direction.
#[test]
fn positions_beside_heights_are_labels() {
    let heights = |i: usize, j: usize| ((7 * i + 3 * j) % 11) as f64 * 0.13 - 0.4;
    for at in [
        |k: usize| k as f64 * 2e-3 - 0.019,
        |k: usize| 0.001 + k as f64 * 2e-3,
        |k: usize| 20.5 - k as f64,
    ] {
        let beside: String = (0..20)
            .map(|i| {
                let row: Vec<String> = (0..9).map(|j| heights(i, j).to_string()).collect();
                format!("{:.6},{}\n", at(i), row.join(","))
            })
            .collect();
        let first: Vec<String> = (0..9).map(|j| format!("{:.6}", at(j))).collect();
        let rows = (0..20).map(|i| {
            let row: Vec<String> = (0..9).map(|j| heights(i, j).to_string()).collect();
            row.join(",") + "\n"
        });
        let above = first.join(",") + "\n" + &rows.collect::<String>();
        for text in [beside, above] {
            let written = file("labels.csv", text);
            let refused = read(&written.path, &MICROMETRES).unwrap_err().to_string();
            assert!(refused.contains("labels of"), "{refused}");
        }
    }
}
