//! Malformed files: each error names the file, the fault and the correct content.

use fretwear::surface::readers::{ReadOptions, ReadProblem, read};

use super::foreign::sample;
use super::writers::{Sur, file, npy, sur, x3p_description, zip};
use super::{AS_STATED, MICROMETRES};

/// Error message of a malformed file. The message must name the file.
pub fn failure(
    name: &str,
    bytes: impl AsRef<[u8]>,
    options: &ReadOptions,
) -> (String, ReadProblem) {
    let written = file(name, bytes);
    let error = read(&written.path, options).expect_err("the file is malformed");
    let message = error.to_string();
    assert!(message.contains(name), "the file is not named: {message}");
    (message, error.problem)
}

pub fn says(message: &str, parts: &[&str]) {
    for part in parts {
        assert!(
            message.contains(part),
            "\"{part}\" is missing in: {message}"
        );
    }
}

#[test]
fn unknown_and_misnamed_files() {
    let (message, problem) = failure("map.opd", b"Directory", &AS_STATED);
    assert!(matches!(problem, ReadProblem::UnknownFormat { .. }));
    says(
        &message,
        &[
            "opd", ".al3d", ".sdf", ".npy", ".x3p", ".sur", ".csv", ".parquet",
        ],
    );

    let data = npy("<f8", false, "(1, 1)", &1f64.to_le_bytes());
    let (message, _) = failure("map.x3p", &data, &MICROMETRES);
    says(&message, &["X3P", "PK", "looks like NPY"]);
    let (message, problem) = failure("map.npy", b"1,2,3\n", &MICROMETRES);
    assert!(matches!(
        problem,
        ReadProblem::WrongMagic {
            looks_like: None,
            ..
        }
    ));
    says(&message, &["NUMPY", "1,2,3"]);
    let (message, _) = failure("map.csv", &data, &MICROMETRES);
    says(&message, &["looks like NPY"]);

    let missing = read(std::path::Path::new("nowhere/map.npy"), &MICROMETRES).unwrap_err();
    says(&missing.to_string(), &["nowhere/map.npy", "cannot be read"]);
}

#[test]
fn units_missing_and_contradicting() {
    let data = npy("<f8", false, "(1, 1)", &1f64.to_le_bytes());
    let (message, problem) = failure("map.npy", &data, &AS_STATED);
    assert!(matches!(
        problem,
        ReadProblem::UnitMissing { format: "NPY" }
    ));
    says(&message, &["surface.unit"]);
    assert!(matches!(
        failure("map.csv", "1,2\n", &AS_STATED).1,
        ReadProblem::UnitMissing { .. }
    ));
    let (message, _) = failure("map.sur", small_sur(4), &MICROMETRES);
    says(&message, &["1e-3 m", "1e-6 m", "remove surface.unit"]);
    let same = ReadOptions {
        height_unit: Some(1e-3),
        ..AS_STATED
    };
    assert!(read(&file("map.sur", small_sur(4)).path, &same).is_ok());
    let bad = ReadOptions {
        spacing: Some([1e-6, 0.0]),
        ..MICROMETRES
    };
    assert!(matches!(
        failure("map.npy", &data, &bad).1,
        ReadProblem::Spacing { .. }
    ));
}

#[test]
fn npy_of_wrong_shape_type_or_length() {
    let eight = [0u8; 64];
    let cases = [
        (npy("<f8", false, "(8,)", &eight), "two axes"),
        (npy("<f8", false, "(2, 2, 2)", &eight), "two axes"),
        (npy("<f8", false, "(0, 2)", &eight), "at least one point"),
        (npy("<c16", false, "(2, 2)", &eight), "f8"),
        (npy("|b1", false, "(8, 8)", &eight), "f8"),
        (npy("<f8", false, "(3, 3)", &eight), "72 are needed"),
        // The array would have 16 exabytes. The reader rejects the array before allocation.
        (
            npy("<f8", false, "(2000000000, 2000000000)", &eight),
            "are needed",
        ),
        (b"\x93NUMPY\x01\x00\xff\xff".to_vec(), "header"),
    ];
    for (bytes, part) in cases {
        says(&failure("map.npy", bytes, &MICROMETRES).0, &[part]);
    }
    let mut data = Vec::new();
    for h in [1.0, 2.0, 3.0, f64::NAN, f64::NEG_INFINITY, f64::INFINITY] {
        data.extend(h.to_le_bytes());
    }
    let (message, problem) = failure("map.npy", npy("<f8", false, "(2, 3)", &data), &MICROMETRES);
    assert!(
        matches!(problem, ReadProblem::Infinite { i: 1, j: 1, .. }),
        "{message}"
    );
    let nothing = npy(
        "<f8",
        false,
        "(1, 2)",
        &[f64::NAN.to_le_bytes(), f64::NAN.to_le_bytes()].concat(),
    );
    assert!(matches!(
        failure("map.npy", nothing, &MICROMETRES).1,
        ReadProblem::NothingMeasured { nx: 1, ny: 2 }
    ));
}

#[test]
fn text_that_is_no_matrix() {
    let cases = [
        (
            "1,2,3,4\n5,6,7\n",
            vec!["line 2", "3 values", "4, as in the first line"],
        ),
        // Comments and blank lines count as lines, with any line ending.
        (
            "# a\r\n1,2,3,4\r\n\r\n# b\r\n5,6,7\r\n",
            vec!["line 5", "3 values"],
        ),
        ("# a\n\n1;2;3;4\n# b\n5;6;7\n", vec!["line 5", "3 values"]),
        ("1 2 3 4\n5 6 x 8\n", vec!["line 2, value 3", "\"x\""]),
        (
            "1,5;2,5;3,5;4,5\n1,5;2.5;3;4\n",
            vec!["line 1: found a decimal comma, and a decimal point in line 2"],
        ),
        (
            "1.234,56;2,5;3,5;4,5\n",
            vec!["line 1, value 1", "\"1.234,56\"", "no mark of thousands"],
        ),
        (
            "1,234,567;2\n",
            vec!["\"1,234,567\"", "no mark of thousands"],
        ),
        (
            "1,2,3,4\n\"1,5\",2,3,4\n",
            vec!["line 2, value 1", "\"1,5\""],
        ),
        ("# nothing\n\n", vec!["no numbers"]),
        ("1,2,3,4\na,b,c,d\n", vec!["line 2, value 1"]),
        (
            "0 0 1\n0 1 2\n1 0 3\n1 1 4\n0 1 5\n",
            vec!["row 5", "twice"],
        ),
        (
            "0 0 1\n0 1 2\n1 0 3\n1.4 1 4\n2 0 5\n3 0 5\n4 0 5\n5 0 5\n",
            vec!["between the lines"],
        ),
        (
            "0 0 1\n1 7 2\n2 3 3\n3 11 4\n4 5 5\n5 2 6\n",
            vec!["6 rows, less than a quarter of the points, for a grid of"],
        ),
        ("0 nan 1\n", vec!["position"]),
    ];
    for (text, parts) in cases {
        says(&failure("map.txt", text, &MICROMETRES).0, &parts);
    }
}

#[test]
fn bytes_that_are_no_text() {
    let utf_16: Vec<u8> = "1,2\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, parts) in [
        (
            &b"1,2\n\xff\xfe,3\n"[..],
            ["line 2, value 1", "\"\u{ff}\u{fe}\""],
        ),
        (
            &utf_16[..],
            [
                "line 1: found the control character 0x00 in what is read as UTF-8",
                "save it as UTF-8",
            ],
        ),
        (
            b"1,2\n3,\x81\x90\n",
            ["line 2: found the control character 0x81", "windows-1252"],
        ),
        (
            b"\xff\xfe1\0,\0\x00\xd8",
            ["bytes that are not UTF-16LE", "save it as UTF-8"],
        ),
        (
            b"\xef\xbb\xbf1,\xff\n",
            ["bytes that are not UTF-8", "save it as UTF-8"],
        ),
    ] {
        says(&failure("map.csv", bytes, &MICROMETRES).0, &parts);
    }
}

/// Lines of 4 x 3 points from `first` on, each followed by `behind`.
fn points(first: usize, behind: &str) -> String {
    let point = |k: usize| format!("{} {} {}.5 {behind}\n", k / 3 * 10, k % 3 * 5, k);
    (first..12).map(point).collect()
}

#[test]
fn named_columns_that_are_no_points() {
    let order = "expected x, y and z, each once and in any order";
    for (names, found) in [
        ("x,y", "x, y"),
        ("a,b,c,d", "a, b, c, d"),
        ("x,y,height", "x, y, height"),
        ("x,y,z,Z", "x, y, z, Z"),
        (",c0,c1,c2", "c0, c1, c2"),
    ] {
        let columns = names.split(',').count();
        let row = vec!["1.5"; columns].join(",");
        let text = format!("# a comment\n{names}\n{row}\n{row}\n");
        let (message, _) = failure("map.csv", text, &MICROMETRES);
        says(
            &message,
            &[&format!("line 2: found columns named {found};"), order],
        );
    }
    let profile = failure("map.csv", "x,z\n0,1\n1,2\n", &MICROMETRES).0;
    says(&profile, &["a profile (line 1: columns x and z without y)"]);
    // Three names above a different number of columns.
    let text = format!("x y z\n{}", points(0, "0.9"));
    let (message, _) = failure("map.txt", text, &MICROMETRES);
    says(
        &message,
        &["line 2: found 4 values; expected 3, as in the first line of names"],
    );
}

#[test]
fn labels_of_a_data_frame() {
    let heights = "0.5,1.25,-0.5,1.5\n0.25,0.5,1,-1\n0.75,1,0.5,2\n";
    let rows: String = heights
        .lines()
        .zip(0..)
        .map(|(line, k)| format!("{k},{line}\n"))
        .collect();
    for (text, found) in [
        (format!("0,1,2,3\n{heights}"), "0, 1, 2"),
        (format!("1,2,3,4\n{heights}"), "1, 2, 3"),
        (format!("0.0,1.0,2.0,3.0\n{heights}"), "0, 1, 2"),
        (format!(",0,1,2,3\n{rows}"), "0, 1, 2"),
        (format!("nan,1,2,3,4\n{rows}"), "1, 2, 3"),
        (
            "0,1,2\n0,0,0.5\n0,1,0.25\n1,0,1\n1,1,2\n".to_owned(),
            "0, 1, 2",
        ),
    ] {
        let (message, _) = failure("map.csv", format!("# frame\n{text}"), &MICROMETRES);
        says(
            &message,
            &[
                &format!("line 2: found {found}, …, the labels of columns"),
                "without labels of columns and rows (pandas: header=False, index=False)",
            ],
        );
    }
}

#[test]
fn points_with_more_columns_than_three() {
    for (text, columns) in [
        (points(0, "0 0 1"), 6),
        (points(0, "0.9"), 4),
        // Some points have no measurement.
        (points(2, "0.9"), 4),
    ] {
        let (message, _) = failure("map.xyz", text, &MICROMETRES);
        says(
            &message,
            &[
                &format!(
                    "found {columns} values a row, the first two of which are the positions of 4 x 3 points"
                ),
                "a text of three columns x, y, z",
            ],
        );
    }
    // An array of points is not a map either.
    let values = (0..12).flat_map(|k| [(k / 3 * 10) as f64, (k % 3 * 5) as f64, 0.5]);
    let data: Vec<u8> = values.flat_map(f64::to_le_bytes).collect();
    let (message, _) = failure("map.npy", npy("<f8", false, "(12, 3)", &data), &MICROMETRES);
    says(&message, &["found 3 values a row", "4 x 3 points"]);
}

#[test]
fn units_in_names() {
    let rows = "0,0,1.5\n0,2,2.5\n3,0,0.5\n3,2,1.5\n6,0,2\n6,2,3\n";
    for (names, parts) in [
        (
            "x [um],y [um],z [nm]",
            [
                "states its heights in units of 1e-9 m",
                "surface.unit says 1e-6 m",
            ],
        ),
        ("x,y,z_nm", ["column z_nm: found another unit", "z [nm]"]),
        (
            "x_mm,y_um,z_um",
            ["column x_mm: found another unit", "1e-6 m"],
        ),
        (
            "x,y,z [V]",
            ["the unit of column z [V]: found V", "m, mm, um or nm"],
        ),
    ] {
        let (message, _) = failure("map.csv", format!("{names}\n{rows}"), &MICROMETRES);
        says(&message, &parts);
    }
    // A unit without brackets does not count.
    let (_, problem) = failure("map.csv", format!("x_um,y_um,z_um\n{rows}"), &AS_STATED);
    assert!(matches!(problem, ReadProblem::UnitMissing { .. }));
}

const HEIGHTS: &str = "0.5\t1.5\t2.5\t3.5\n1.5\t2.5\t3.5\t4.5\n0.5\t1.5\t0.5\t0.5\n";

#[test]
fn headers_that_contradict_their_matrix() {
    let gwyddion =
        "# Channel: Topography\n# Width: 100.0 µm\n# Height: 60.0 µm\n# Value units: nm\n";
    let spip = "# File Format = ASCII\n# x-pixels = 4\n# y-pixels = 3\n# x-length = 2000\n# y-length = 1500\n# z-unit = [nm]\n# Start of Data:\n";
    for (header, from, to, parts) in [
        (
            gwyddion,
            "units: nm",
            "units: V",
            [
                "the header's Value units: found \"V\"",
                "the channel of heights",
            ],
        ),
        (
            gwyddion,
            "100.0 µm",
            "100.0",
            ["the header's Width: found \"100.0\"", "with its unit"],
        ),
        (
            gwyddion,
            "# Height: 60.0 µm\n",
            "",
            ["the header's Height: found nothing", "with its unit"],
        ),
        (
            gwyddion,
            "60.0 µm",
            "0 µm",
            ["the spacing of the points", "both must be positive"],
        ),
        (
            spip,
            "x-pixels = 4",
            "x-pixels = 3",
            ["3 lines of 4 values", "3 lines of 3, as the header says"],
        ),
        (
            spip,
            "[nm]",
            "V",
            ["the header's z-unit: found \"V\"", "a unit of length"],
        ),
        (
            spip,
            "[nm]",
            "um\n# Bit2nm = 2",
            ["the header's Bit2nm: found \"2\"", "1 beside a z-unit"],
        ),
        (
            spip,
            "[nm]",
            "nm\n# voidpixels = 2",
            ["voidpixels", "no mark of them"],
        ),
        (
            spip,
            "y-length = 1500",
            "y-length =",
            ["the header's y-length", "a number"],
        ),
    ] {
        assert!(header.contains(from));
        let text = format!("{}{HEIGHTS}", header.replace(from, to));
        says(&failure("map.asc", text, &AS_STATED).0, &parts);
    }
    let mask = spip.replace("y-pixels = 3", "y-pixels = 3\n# voidpixels = 1");
    let (message, _) = failure("map.asc", format!("{mask}{HEIGHTS}{HEIGHTS}"), &AS_STATED);
    says(
        &message,
        &["the mask: found 0.5", "0 and 1 below the heights"],
    );
    let two = format!("{gwyddion}{HEIGHTS}\n{gwyddion}{HEIGHTS}");
    let (message, _) = failure("map.txt", two, &AS_STATED);
    says(&message, &["a text of 2 maps", "the map of heights alone"]);
}

#[test]
fn texts_of_interferometers() {
    let zygo = "Zygo XYZ Data File - Format 1\n0 3 0 0 \"today\"\n0 0 3 3 1 255\n#\n0 0 No Data\n0 1 2.5\n#\n";
    let wyko =
        "Wyko ASCII Data File Format 0\t0\t1\nX Size\t4\nY Size\t3\nRAW_DATA\t3\t48\t\n1\t2\tBad\n";
    for (name, text, found) in [
        ("map.xyz", zygo, "a Zygo XYZ file"),
        (
            "map.asc",
            &zygo.replace("XYZ", "ASCII"),
            "a Zygo ASCII file",
        ),
        ("map.asc", wyko, "a Wyko ASCII file"),
        (
            "map.csv",
            "\nX Size,4\nY Size,3\nPixel_size,7,4,0.002\n",
            "Wyko, Veeco or Bruker",
        ),
    ] {
        let (message, _) = failure(name, text, &MICROMETRES);
        says(
            &message,
            &[found, "export X3P or SDF, or points x y z without a header"],
        );
    }
}

#[test]
fn positions_in_the_first_line_or_column() {
    for (text, place) in [
        (
            "0,0.5,1,1.5\n0.3,0.1,0.2,0.4\n0.2,0.5,0.1,0.1\n",
            "line 1: found 0, 0.5, 1,",
        ),
        (
            ",2,4,6\n1,0.1,0.2,0.4\n2,0.5,0.1,0.1\n3,0.5,0.7,0.1\n",
            "line 1: found 2, 4, 6,",
        ),
        (
            "x\\y,2,4,6\n1,0.1,0.2,0.4\n2,0.5,0.1,0.1\n",
            "line 1: found \"x\\y\" before numbers",
        ),
        (
            "0;0,5;1,2;0,1\n1;0,7;0,2;0,1\n2;0,1;0,2;0,3\n",
            "column 1: found 0, 1, 2,",
        ),
    ] {
        let (message, _) = failure("map.csv", text, &MICROMETRES);
        says(
            &message,
            &[place, "the labels of", "header=False, index=False"],
        );
    }
}

#[test]
fn zip_archives_that_are_no_x3p() {
    for (name, members, parts) in [
        (
            "map.npz",
            &["arr_0.npy"][..],
            ["a NumPy archive (.npz)", "numpy.save"],
        ),
        (
            "map.csv",
            &["[Content_Types].xml", "xl/workbook.xml"],
            ["an Excel workbook", "as CSV"],
        ),
        (
            "map.txt",
            &["[Content_Types].xml", "word/document.xml"],
            ["a Word document", "plain text"],
        ),
        (
            "map.plux",
            &["index.xml", "LAYER_0.raw"],
            ["a Sensofar file (.plux)", "X3P or SUR"],
        ),
        (
            "map.x3p",
            &["mimetype", "content.xml"],
            ["an OpenDocument file", "as CSV"],
        ),
        (
            "map.x3p",
            &["a.txt", "b.txt"],
            ["members a.txt, b.txt", "main.xml"],
        ),
        (
            "map.x3p",
            &["a/main.xml", "b/main.xml"],
            ["2 members main.xml", "the folder of one map"],
        ),
        ("map.csv", &["main.xml"], ["looks like X3P", "rename it"]),
    ] {
        let members: Vec<(&str, &[u8])> = members.iter().map(|name| (*name, &b"x"[..])).collect();
        says(&failure(name, zip(&members), &AS_STATED).0, &parts);
    }
}

fn small_sur(points: usize) -> Vec<u8> {
    let about = Sur {
        bits: 32,
        nx: 2,
        ny: 2,
        lowest: 0,
        holes: false,
        spacing: [1.0, 1.0],
        step: 1.0,
        offset: 0.0,
        units: [b"mm", b"mm", b"mm"],
        comment: b"",
    };
    sur(&about, &vec![1; points])
}

#[test]
fn sur_cut_short_or_of_another_kind() {
    let (message, problem) = failure("map.sur", small_sur(3), &AS_STATED);
    assert!(
        matches!(
            problem,
            ReadProblem::Size {
                found: 524,
                expected: 528,
                ..
            }
        ),
        "{message}"
    );
    says(&message, &["2 x 2 points of 32 bits"]);
    says(
        &failure("map.sur", &small_sur(4)[..100], &AS_STATED).0,
        &["100 bytes", "512"],
    );
    says(
        &failure("map.sur", b"DSCOMPRESSED and so on", &AS_STATED).0,
        &["22 bytes", "512"],
    );
    let with = |at: usize, value: &[u8]| {
        let mut bytes = small_sur(4);
        bytes[at..at + value.len()].copy_from_slice(value);
        failure("map.sur", bytes, &AS_STATED).0
    };
    says(&with(18, &[1, 0]), &["type 1", "type 2"]);
    says(&with(98, &[8, 0]), &["bits of a point", "16 or 32"]);
    says(
        &with(108, &(-3i32).to_le_bytes()),
        &["points of a line", "-3"],
    );
    says(
        &with(108, &i32::MAX.to_le_bytes()),
        &["the file has 528 bytes"],
    );
    says(&with(212, b"furlong"), &["unit of z", "furlong", "mm"]);
    says(&with(128, &0f32.to_le_bytes()), &["height of one step"]);
    says(&with(334, &(-1i16).to_le_bytes()), &["comment", "-1"]);
}

#[test]
fn sur_whose_streams_are_damaged() {
    let good = std::fs::read(sample("foreign/compressed.sur")).unwrap();
    let with = |at: usize, value: u32| {
        let mut bytes = good.clone();
        bytes[at..at + 4].copy_from_slice(&value.to_le_bytes());
        failure("map.sur", bytes, &AS_STATED).0
    };
    // The number of streams, then the length of the single stream: 7 x 5 points of 4 bytes.
    says(
        &with(512, 0),
        &["the unpacked data has 0 bytes; 140 are needed"],
    );
    says(
        &with(512, u32::MAX),
        &["the file has 675 bytes", "stream 1"],
    );
    says(&with(516, 139), &["stream 1 has 140 bytes; 139 are needed"]);
    says(
        &with(516, u32::MAX),
        &["stream 1 has 140 bytes; 4294967295 are needed"],
    );
    says(&with(520, 1 << 20), &["the file has 675 bytes", "stream 1"]);
    says(&with(540, 0), &["stream 1", "intact data"]);
    says(
        &with(108, 6),
        &["stream 1 has 121 bytes; 140 are needed for 6 x 5 points"],
    );
    says(&with(108, 1 << 30), &["1073741824 x 5 points; at most"]);
    let cut = &good[..514];
    says(
        &failure("map.sur", cut, &AS_STATED).0,
        &["514 bytes", "the lengths of the streams"],
    );
}

#[test]
fn x3p_with_parts_missing_or_wrong() {
    let z = "<DataType>D</DataType>";
    let good = x3p_description(2, 2, [1e-6, 2e-6], z, false);
    let with = |description: &str, data: &[u8]| {
        let bytes = zip(&[
            ("main.xml", description.as_bytes()),
            ("bindata/data.bin", data),
        ]);
        failure("map.x3p", bytes, &AS_STATED).0
    };
    says(
        &with(&good, &[0; 24]),
        &[
            "bindata/data.bin has 24 bytes",
            "32 are needed",
            "2 x 2 points of type D",
        ],
    );
    let edit = |from: &str, to: &str| {
        assert!(good.contains(from));
        with(&good.replace(from, to), &[0; 32])
    };
    says(
        &edit("<SizeX>2</SizeX>", ""),
        &["Record3/MatrixDimension/SizeX"],
    );
    says(
        &edit("<SizeX>2</SizeX>", "<SizeX>two</SizeX>"),
        &["\"two\"", "count"],
    );
    says(&edit("<SizeZ>1", "<SizeZ>3"), &["3 layers"]);
    says(&edit(" SUR ", "PRF"), &["PRF", "SUR"]);
    says(
        &edit(
            "<DataLink>",
            "<DataList><Datum>1e-6</Datum></DataList><DataLink>",
        ),
        &["points are text in main.xml (DataList)", "PointDataLink"],
    );
    says(
        &edit("UTF-8", "klingon"),
        &["the encoding \"klingon\"", "ISO-8859-1"],
    );
    says(
        &edit("<CX><AxisType>I", "<CX><AxisType>A"),
        &["CX axis is of type A"],
    );
    says(
        &edit("<DataType>D</DataType></CZ>", "<DataType>Q</DataType></CZ>"),
        &["\"Q\"".trim_matches('"'), "I, L, F or D"],
    );
    says(
        &edit("<DataType>D</DataType></CZ>", "<DataType>L</DataType></CZ>"),
        &["CZ/Increment", "integers"],
    );
    says(
        &edit("bindata/data.bin", "elsewhere.bin"),
        &["elsewhere.bin"],
    );
    says(
        &edit("</Record1>", "</Record9>"),
        &["main.xml", "well-formed"],
    );
    let empty = zip(&[("other.xml", b"<a/>")]);
    says(&failure("map.x3p", empty, &AS_STATED).0, &["main.xml"]);
    let mut cut = zip(&[
        ("main.xml", good.as_bytes()),
        ("bindata/data.bin", &[0; 32]),
    ]);
    cut.truncate(cut.len() / 2);
    says(&failure("map.x3p", cut, &AS_STATED).0, &["zip archive"]);
    // One flipped bit in the points. The checksum of the archive detects the change.
    let mut flipped = zip(&[
        ("main.xml", good.as_bytes()),
        ("bindata/data.bin", &[0x11; 32]),
    ]);
    let at = flipped.windows(32).position(|w| w == [0x11; 32]).unwrap();
    flipped[at + 5] ^= 4;
    says(
        &failure("map.x3p", flipped, &AS_STATED).0,
        &["bindata/data.bin", "intact"],
    );
}

#[test]
fn parquet_that_is_no_surface() {
    says(
        &failure("s.parquet", b"PAR1 and then nothing", &AS_STATED).0,
        &["readable Parquet"],
    );
}
