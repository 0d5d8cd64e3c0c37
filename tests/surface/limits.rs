//! Files with excessive sizes. The readers reject each file before allocation, in a time proportional to the file length.

use std::time::Instant;

use fretwear::surface::readers::{ReadOptions, ReadProblem, read};

use super::malformed::{failure, says};
use super::writers::{Sur, file, npy, sur, x3p_description, zip};
use super::{AS_STATED, MICROMETRES};

/// Largest time \[s\]: a few times the duration on a busy machine. A duration with the square of the file length would be about ten times
/// longer.
const SECONDS: f64 = 3.0;

fn in_time<T>(work: impl FnOnce() -> T) -> T {
    let begin = Instant::now();
    let found = work();
    let taken = begin.elapsed().as_secs_f64();
    assert!(taken < SECONDS, "{taken} s");
    found
}

#[test]
fn x3p_of_elements_within_elements() {
    for (text, close) in [("", "</b>"), ("x", "</b>")] {
        let description = format!(
            "<a>{}{}</a>",
            format!("<b>{text}").repeat(40_000),
            close.repeat(40_000)
        );
        let bytes = zip(&[("main.xml", description.as_bytes())]);
        let (message, _) = in_time(|| failure("map.x3p", &bytes, &AS_STATED));
        says(
            &message,
            &["main.xml, byte", "one more element", "at most 64"],
        );
    }
    // Sequential elements do not increase the depth, whatever their names.
    let name = "n".repeat(10_000);
    let description = format!("<a><{name}>{}</{name}></a>", "<b>x</b>".repeat(40_000));
    let bytes = zip(&[("main.xml", description.as_bytes())]);
    let (message, _) = in_time(|| failure("map.x3p", &bytes, &AS_STATED));
    says(&message, &["Record1/FeatureType"]);
}

#[test]
fn more_points_than_any_topography() {
    let too_many = |name: &str, bytes: &[u8], options: &ReadOptions, counts: &str| {
        let (message, problem) = failure(name, bytes, options);
        assert!(matches!(problem, ReadProblem::TooMany { .. }), "{message}");
        says(&message, &[counts, "at most 134217728 points are read"]);
    };
    let z = "<DataType>D</DataType>";
    for (nx, ny) in [(30_000, 20_000), (usize::MAX, 2)] {
        let description = x3p_description(nx, ny, [1e-6, 2e-6], z, false);
        let bytes = zip(&[
            ("main.xml", description.as_bytes()),
            ("bindata/data.bin", &[0; 32]),
        ]);
        let counts = format!("{nx} x {ny} points");
        too_many("map.x3p", &bytes, &AS_STATED, &counts);
    }
    let header = |nx: u32, ny: u32| {
        format!(
            "aISO-2.0\nNumPoints = {nx}\nNumProfiles = {ny}\nXscale = 1e-6\nYscale = 1e-6\nZscale = 1e-6\nDataType = 7\n*\n1 2 3\n*\n"
        )
    };
    let text = header(u32::MAX, u32::MAX);
    let counts = "4294967295 x 4294967295 points";
    too_many("map.sdf", text.as_bytes(), &AS_STATED, counts);
    // The sparse file has as many bytes as the header announces. The reader checks the counts before it copies data.
    let sparse = |name: &str, head: &[u8], length: u64| {
        let written = file(name, head);
        let opened = std::fs::OpenOptions::new().write(true).open(&written.path);
        opened.unwrap().set_len(length).unwrap();
        read(&written.path, &MICROMETRES).unwrap_err().to_string()
    };
    let bytes = npy("|u1", false, "(20000, 7000)", &[]);
    let message = sparse("map.npy", &bytes, bytes.len() as u64 + 140_000_000);
    says(&message, &["20000 x 7000 points; at most"]);
    let message = sparse("map.csv", b"1,2\n", (4 << 30) + 1);
    says(&message, &["4294967297 bytes", "at most 4294967296"]);
}

#[test]
fn headers_of_many_keys() {
    let keys: String = (0..60_000).map(|k| format!("k{k} = {k}\n")).collect();
    let text = format!(
        "aISO-1.0\nNumPoints = 3\nNumProfiles = 1\nXscale = 1e-6\nYscale = 1e-6\nZscale = 1e-6\nDataType = 7\n{keys}*\n1 2 3\n*\n"
    );
    let written = file("map.sdf", &text);
    let found = in_time(|| read(&written.path, &AS_STATED).unwrap().topography);
    assert_eq!((found.nx, found.ny), (3, 1));
    let twice = text.replace("k7 =", "k8 =");
    says(
        &failure("map.sdf", twice, &AS_STATED).0,
        &["line 16", "a second k8"],
    );
}

#[test]
fn npy_headers_that_are_none() {
    let header = |text: &str, length: u32| {
        let mut bytes = b"\x93NUMPY\x02\x00".to_vec();
        bytes.extend(length.to_le_bytes());
        bytes.extend(text.as_bytes());
        bytes
    };
    let deep = format!("{}{}", "(".repeat(60_000), ")".repeat(60_000));
    for (text, length, part) in [
        (&deep[..], deep.len() as u32, "120000 bytes"),
        ("x", u32::MAX, "4294967295 bytes"),
        ("(((((((((1)))))))))", 19, "at most 8 levels of brackets"),
        ("{{{{{{{{1}}}}}}}}", 17, "the header"),
    ] {
        let (message, _) = in_time(|| failure("map.npy", header(text, length), &MICROMETRES));
        says(&message, &["the header", part]);
    }
}

/// A read from a pipe would wait, and a read from a device would never end.
#[cfg(unix)]
#[test]
fn what_is_no_file() {
    use std::os::unix::fs::symlink;

    let about = Sur {
        bits: 16,
        nx: 3,
        ny: 1,
        lowest: 0,
        holes: false,
        spacing: [1.0, 1.0],
        step: 1.0,
        offset: 0.0,
        units: [b"mm", b"mm", b"mm"],
        comment: b"",
    };
    let written = file("map.sur", sur(&about, &[1, 2, 3]));
    let beside = |name: &str| written.path.with_file_name(name);
    let made = std::process::Command::new("mkfifo")
        .arg(beside("pipe.sur"))
        .status();
    assert!(made.unwrap().success());
    symlink("/dev/zero", beside("zero.sur")).unwrap();
    std::fs::create_dir(beside("folder.sur")).unwrap();
    for (name, what) in [
        ("pipe.sur", "a pipe or a device"),
        ("zero.sur", "a pipe or a device"),
        ("folder.sur", "a folder"),
    ] {
        let error = read(&beside(name), &AS_STATED).unwrap_err();
        let end = format!("{name}: cannot be read: it is {what}, not a regular file");
        assert!(error.to_string().ends_with(&end), "{error}");
    }
    // A link to a file counts as a file.
    symlink(&written.path, beside("link.sur")).unwrap();
    let linked = read(&beside("link.sur"), &AS_STATED).unwrap();
    assert_eq!(linked.topography.nx, 3);
}
