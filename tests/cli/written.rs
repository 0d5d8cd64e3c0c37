//! Tests of output files: commands write a file completely or not at all, on a full disk, and through links and pipes.
#![cfg(unix)]

use std::fs;
use std::io;
use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
use std::os::unix::net::UnixListener;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use fretwear::report::output::{replace, write};

use crate::support::{Bench, Did, OSCILLATOR, SLIDER};

/// Runs the program with a file size limit of 0, as on a full disk.
fn on_a_full_disk(bench: &Bench, arguments: &[&str]) -> Did {
    let mut command = Command::new("sh");
    command.args(["-c", "ulimit -f 0; trap '' XFSZ; exec \"$0\" \"$@\""]);
    command.arg(env!("CARGO_BIN_EXE_fretwear")).args(arguments);
    command
        .current_dir(bench.path(""))
        .env("FRETWEAR_CACHE", "");
    Did(command.stdin(Stdio::null()).output().expect("a shell"))
}

/// All files below a folder.
fn files_below(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => found.extend(files_below(&path)),
            false => found.push(path),
        }
    }
    found
}

fn pipe(path: &Path) {
    let made = Command::new("mkfifo").arg(path).status();
    assert!(made.expect("mkfifo").success());
}

const FORMER: &str = "the former file";

/// Arguments of a command, and the files that the command writes.
type Writes = (&'static [&'static str], &'static [&'static str]);

const WRITES: [Writes; 5] = [
    (
        &["backbone", "mass.toml", "-o", "o/b.parquet"],
        &["o/b.parquet"],
    ),
    (&["export", "-o", "o/deck.inp"], &["o/deck.inp"]),
    (
        &["export", "coarse.toml", "--matrices", "o"],
        &["o/stiffness.mtx"],
    ),
    (&["export", "vibrating", "--reduced", "o"], &["o/K.mtx"]),
    (&["export", "worn", "--vtu", "o"], &["o/joint_00000.vtu"]),
];

#[cfg(feature = "polars")]
const REPORTS: [Writes; 7] = [
    (&["report", "worn", "-o", "o/page.html"], &["o/page.html"]),
    (&["report", "worn"], &["worn/report.html"]),
    (&["compare", "worn", "--csv", "o/t.csv"], &["o/t.csv"]),
    (&["compare", "worn", "--parquet", "o/t"], &["o/t"]),
    (&["backbone", "mass.toml", "--svg", "o/b.svg"], &["o/b.svg"]),
    (&["campaign", "report", "--dir", "c"], &["c/report.html"]),
    (
        &["campaign", "report", "--dir", "c", "-o", "o/c.html"],
        &["o/c.html"],
    ),
];
#[cfg(not(feature = "polars"))]
const REPORTS: [Writes; 0] = [];

/// A folder with the input files of all commands.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("mass.toml", OSCILLATOR.to_owned() + SLIDER);
    let coarse = crate::support::RESONATOR;
    bench.write("coarse.toml", coarse);
    let short = ["--quiet", "--set", "wear.cycles=100_000"];
    bench.done(&[&["run", "small.toml", "--run", "worn"], &short[..]].concat());
    let until = ["--until", "structure", "--quiet"];
    bench.done(&[&["run", "coarse.toml", "--run", "vibrating"], &until[..]].concat());
    let few =
        "scene = \"small.toml\"\n[set]\nwear.cycles = 100_000\n[grid]\nsurface.seed = [1, 2]\n";
    bench.write("few.toml", few);
    let plan = ["campaign", "plan", "few.toml", "--dir", "c"];
    bench.done(&[&plan[..], &["--no-rehearsal"]].concat());
    bench.done(&["campaign", "run", "--dir", "c", "-q"]);
    bench.done(&["campaign", "collect", "--dir", "c"]);
    fs::create_dir(bench.path("o")).expect("a folder");
    bench
}

#[test]
fn on_a_full_disk_the_former_file_stays_and_the_reason_is_said() {
    let bench = bench();
    for (arguments, files) in WRITES.into_iter().chain(REPORTS) {
        for file in files {
            bench.write(file, FORMER);
        }
        let before = files_below(&bench.path(""));
        let did = on_a_full_disk(&bench, arguments);
        let said = did.stderr();
        assert_eq!(did.code(), 1, "{arguments:?}: {said}");
        for file in files {
            let text = fs::read_to_string(bench.path(file)).expect("a file");
            assert_eq!(text, FORMER, "{arguments:?}");
            let reason = format!("error: cannot write {file}: File too large (os error 27)");
            assert!(said.contains(&reason), "{arguments:?}: {said}");
        }
        let after = files_below(&bench.path(""));
        assert_eq!(after, before, "{arguments:?} wrote an incomplete file");
        // With free disk space, the same command replaces the file.
        bench.done(arguments);
        for file in files {
            let bytes = fs::read(bench.path(file)).expect("a file");
            assert_ne!(bytes, FORMER.as_bytes(), "{arguments:?}");
        }
    }
}

#[test]
fn a_file_is_replaced_with_its_permissions() {
    let bench = Bench::new();
    let path = bench.write("page", FORMER);
    let mode = |path: &Path| fs::metadata(path).expect("a file").permissions().mode() & 0o777;
    fs::set_permissions(&path, PermissionsExt::from_mode(0o640)).expect("set");
    let open = fs::File::open(&path).expect("opened");
    write(&path, b"new").expect("written");
    assert_eq!(fs::read_to_string(&path).expect("text"), "new");
    assert_eq!(mode(&path), 0o640);
    // A reader with an open file still reads the former content.
    assert_eq!(io::read_to_string(open).expect("text"), FORMER);
    write(&bench.path("other"), b"new").expect("written");
    assert_eq!(mode(&bench.path("other")), mode(&bench.path("small.toml")));
    let folder = write(&bench.path(""), b"new").expect_err("a folder");
    assert_eq!(folder.kind(), io::ErrorKind::IsADirectory);
}

#[test]
fn a_link_that_is_named_stays_and_one_that_the_program_names_is_replaced() {
    let bench = Bench::new();
    fs::create_dir_all(bench.path("deep/far")).expect("folders");
    bench.write("deep/target", FORMER);
    let is_link = |name: &str| bench.path(name).is_symlink();
    let text = |name: &str| fs::read_to_string(bench.path(name)).expect("text");
    // The path contains two links; the target of the second link is relative to the folder of the link.
    symlink("deep/far/link", bench.path("link")).expect("a link");
    symlink("../target", bench.path("deep/far/link")).expect("a link");
    write(&bench.path("link"), b"new").expect("written");
    assert!(is_link("link") && is_link("deep/far/link"));
    assert_eq!(text("deep/target"), "new");
    // `write` creates a missing target of a link, but no missing folder.
    fs::remove_file(bench.path("deep/target")).expect("removed");
    write(&bench.path("link"), b"anew").expect("written");
    assert!(is_link("link") && is_link("deep/far/link"));
    assert_eq!(text("deep/target"), "anew");
    symlink("nowhere/target", bench.path("dangling")).expect("a link");
    let error = write(&bench.path("dangling"), b"new").expect_err("no folder");
    assert_eq!(error.kind(), io::ErrorKind::NotFound);
    assert!(is_link("dangling") && !bench.path("nowhere").exists());

    replace(&bench.path("link"), b"own").expect("written");
    assert!(!is_link("link"));
    assert_eq!(
        (text("link"), text("deep/target")),
        ("own".into(), "anew".into())
    );
}

#[test]
fn a_pipe_or_a_socket_is_written_and_not_replaced() {
    let bench = Bench::new();
    let path = bench.path("pipe");
    pipe(&path);
    symlink("pipe", bench.path("link")).expect("a link");
    for name in ["pipe", "link"] {
        let reader = path.clone();
        let reader = thread::spawn(move || fs::read_to_string(reader).expect("text"));
        write(&bench.path(name), b"new").expect("written");
        assert_eq!(reader.join().expect("a thread"), "new");
    }
    assert!(fs::metadata(&path).expect("a pipe").file_type().is_fifo());
    let socket = bench.path("socket");
    let listener = UnixListener::bind(&socket).expect("a socket");
    let listener = thread::spawn(move || {
        let (heard, _) = listener.accept().expect("a connection");
        io::read_to_string(heard).expect("text")
    });
    write(&socket, b"new").expect("written");
    assert_eq!(listener.join().expect("a thread"), "new");
    assert!(
        fs::metadata(&socket)
            .expect("a socket")
            .file_type()
            .is_socket()
    );
}

/// A report of a campaign writes no tables beside a pipe. If the output path is a link, the report writes tables beside the target.
#[cfg(all(feature = "polars", target_os = "linux"))]
#[test]
fn the_page_on_a_campaign_may_be_a_pipe() {
    let bench = bench();
    for folder in ["piped", "linked", "kept"] {
        fs::create_dir(bench.path(folder)).expect("a folder");
    }
    let names = |folder: &str| files_below(&bench.path(folder)).len();
    let report = |page: &str| {
        bench.done(&["campaign", "report", "--dir", "c", "-o", page]);
    };
    let path = bench.path("piped/page");
    pipe(&path);
    let reader = thread::spawn(move || fs::read_to_string(path).expect("text"));
    report("piped/page");
    assert!(
        fs::metadata(bench.path("piped/page"))
            .expect("a pipe")
            .file_type()
            .is_fifo()
    );
    assert!(
        reader
            .join()
            .expect("a thread")
            .starts_with("<!DOCTYPE html>")
    );
    assert_eq!(names("piped"), 1);

    symlink("../kept/page", bench.path("linked/page")).expect("a link");
    report("linked/page");
    assert!(bench.path("linked/page").is_symlink());
    assert!(bench.path("kept/page").is_file());
    assert_eq!((names("linked"), names("kept")), (1, 4));
    // The link to stdout tests the case `-o /dev/stdout > page`.
    fs::create_dir(bench.path("redirected")).expect("a folder");
    symlink("/proc/self/fd/1", bench.path("linked/stdout")).expect("a link");
    let file = fs::File::create(bench.path("redirected/page")).expect("a file");
    let out = ["campaign", "report", "--dir", "c", "-o", "linked/stdout"];
    let status = bench.command(&out).stdout(file).status();
    assert!(status.expect("the program runs").success());
    assert_eq!((names("linked"), names("redirected")), (2, 4));
    // A report replaces a link with a reserved name in the campaign's folder, and does not write to its target.
    let precious = bench.write("precious", FORMER);
    symlink("../precious", bench.path("c/report.html")).expect("a link");
    bench.done(&["campaign", "report", "--dir", "c"]);
    assert!(!bench.path("c/report.html").is_symlink());
    assert_eq!(fs::read_to_string(precious).expect("text"), FORMER);
}
