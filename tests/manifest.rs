//! Compares the build instructions of the manifest and the README with the lock file and the packages. Searches all files for removed
//! names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::process::Command;

use regex::Regex;
use serde_json::Value;

/// File of the repository.
fn path(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

fn read(file: &str) -> String {
    let path = path(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Names of all packages in the lock file, for every platform and for the tests.
fn locked() -> BTreeSet<String> {
    let lock: toml::Table = read("Cargo.lock").parse().expect("a lock file");
    let packages = lock["package"].as_array().expect("packages");
    let name = |package: &toml::Value| package["name"].as_str().expect("a name").to_owned();
    packages.iter().map(name).collect()
}

/// Crates for network connections or for encryption of connections.
const OF_NETWORKS: [&str; 41] = [
    "async-io",
    "async-std",
    "attohttpc",
    "aws-lc-rs",
    "aws-lc-sys",
    "curl",
    "curl-sys",
    "h2",
    "h3",
    "hickory-resolver",
    "http",
    "http-body",
    "httparse",
    "hyper",
    "hyper-rustls",
    "hyper-tls",
    "hyper-util",
    "isahc",
    "mio",
    "native-tls",
    "object_store",
    "openssl",
    "openssl-sys",
    "polars-async",
    "quinn",
    "reqwest",
    "ring",
    "rustls",
    "rustls-native-certs",
    "rustls-webpki",
    "schannel",
    "security-framework",
    "smol",
    "socket2",
    "tokio",
    "tokio-rustls",
    "tower-http",
    "tungstenite",
    "ureq",
    "url",
    "webpki-roots",
];

#[test]
fn nothing_in_a_build_can_speak_to_a_network() {
    let locked = locked();
    let found: Vec<&&str> = OF_NETWORKS
        .iter()
        .filter(|name| locked.contains(**name))
        .collect();
    assert!(found.is_empty(), "network crates in Cargo.lock: {found:?}");
    // The test also checks that the lock file was read.
    assert!(locked.contains("fretwear") && locked.contains("parquet"));
}

/// Output of the cargo that built the tests.
fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

/// Numbers of a version. The last number is optional.
fn version(text: &str) -> Vec<u64> {
    let numbers = text.split('.').map(|n| n.parse().expect("a number"));
    numbers.chain([0]).take(3).collect()
}

/// The sources need this version for file locks of the standard library. Clippy checks that the sources need no newer version.
const OURS: &str = "1.89";

/// The stated minimum version is the smallest version that all packages of the lock file allow, including this package.
#[test]
fn the_stated_rust_suffices() {
    let about = cargo(&["-vV"]);
    let mut lines = about.lines();
    let host = lines.find_map(|line| line.strip_prefix("host: "));
    let platform = format!("--filter-platform={}", host.expect("a platform"));
    // Packages that a build has fetched, without packages of other platforms and features.
    let mut arguments = vec!["metadata", "--format-version=1", "--locked", "--offline"];
    arguments.push(&platform);
    if !cfg!(feature = "polars") {
        arguments.push("--no-default-features");
    }
    let metadata: Value = serde_json::from_str(&cargo(&arguments)).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let wanted = packages
        .iter()
        .filter(|package| package["name"] != env!("CARGO_PKG_NAME"))
        .filter_map(|package| {
            let wants = package["rust_version"].as_str()?;
            Some((version(wants), format!("{} wants {wants}", package["name"])))
        })
        .chain([(version(OURS), "the sources need it".to_owned())])
        .max()
        .expect("at least one");
    assert!(packages.len() > 100, "{} packages", packages.len());

    let stated = env!("CARGO_PKG_RUST_VERSION");
    assert_eq!(version(stated), wanted.0, "{stated}, but {}", wanted.1);
    let readme = read("README.md");
    let sentence = format!("a Rust toolchain ({stated} or later)");
    assert!(readme.contains(&sentence), "no {sentence:?} in the README");
}

/// A dependency has the same features for the program and for its tests. Otherwise a test build compiles Polars and this package again.
#[test]
fn a_test_build_shares_the_dependencies_of_the_program() {
    let packages = |edges: &str| -> BTreeSet<String> {
        let mut arguments = vec!["tree", "--locked", "--offline", "--prefix=none"];
        arguments.extend(["--format={p} {f}", "--edges", edges]);
        let printed = cargo(&arguments);
        let lines = printed.lines().map(|line| line.trim_end_matches(" (*)"));
        lines.map(str::to_owned).collect()
    };
    let (program, tests) = (packages("normal,build"), packages("normal,build,dev"));
    let others: Vec<&String> = program.difference(&tests).collect();
    assert!(
        others.is_empty(),
        "of a test build these differ: {others:?}"
    );
    assert!(program.len() > 100 && tests.len() > program.len());
}

/// Some packages are written in C, and the README names the compiler.
#[test]
fn a_c_compiler_is_named_if_needed() {
    assert_eq!(
        locked().contains("cc"),
        read("README.md").contains("a C compiler")
    );
}

#[test]
fn the_citation_has_the_version_of_the_manifest() {
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(read("CITATION.cff").contains(&version));
}

/// The program has less than 90 MB, mostly Polars. A build with symbols or without optimization has tens of MB more.
#[cfg(not(debug_assertions))]
#[test]
fn the_program_is_small() {
    const MOST: u64 = 95_000_000;
    let program = std::fs::metadata(env!("CARGO_BIN_EXE_fretwear")).expect("the program");
    assert!(program.len() < MOST, "{} bytes", program.len());
}

#[test]
fn the_python_module_reads_the_layout_that_the_program_writes() {
    let number = format!("\nLAYOUT = {}\n", fretwear::store::LAYOUT);
    assert!(read("src/python/fretwear/_folder.py").contains(&number));
}

/// Removed names of commands, features and the like, with their replacements. A name counts as a whole word. Every removal of such a name
/// adds a row.
const REMOVED: [(&str, &str); 8] = [
    ("object_store", "copy the folder (rsync, rclone)"),
    ("fretwear publish", "copy the folder (rsync, rclone)"),
    ("fretwear fetch", "copy the folder (rsync, rclone)"),
    ("fretwear validate", "fretwear doctor"),
    ("fretwear explain", "fretwear schema WORD"),
    ("fretwear ls", "fretwear status FOLDER"),
    ("old_runs", "nothing: runs of another layout are rejected"),
    ("fretwear::validate", "fretwear::doctor::closed_forms"),
];

/// The file of this list.
const OF_REMOVED: &str = "tests/manifest.rs";
/// Files that may contain removed names: the history and this list.
const MAY_HAVE_REMOVED: [&str; 2] = ["CHANGELOG.md", OF_REMOVED];

/// Texts that Git tracks, by path. `None` outside of a checkout.
fn tracked_texts() -> Option<BTreeMap<String, String>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z"])
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    let listed = git.output().ok().filter(|listed| listed.status.success())?;
    let names = String::from_utf8(listed.stdout).expect("names are texts");
    let text_of = |name: &str| Some((name.to_owned(), std::fs::read_to_string(path(name)).ok()?));
    Some(names.split_terminator('\0').filter_map(text_of).collect())
}

/// Lines of a text with a removed name: line number, name and replacement.
fn removed_names(text: &str) -> Vec<(usize, &'static str, &'static str)> {
    let mut found = Vec::new();
    for (name, instead) in REMOVED {
        let pattern = format!(r"\b{{start-half}}{}\b{{end-half}}", regex::escape(name));
        for hit in Regex::new(&pattern).expect("a pattern").find_iter(text) {
            let line = text[..hit.start()].matches('\n').count() + 1;
            found.push((line, name, instead));
        }
    }
    found
}

#[test]
fn nothing_has_a_name_that_was_removed() {
    let Some(texts) = tracked_texts() else { return };
    assert!(texts.len() > 100, "{} texts", texts.len());
    let mut wrong = Vec::new();
    for (file, text) in &texts {
        if !MAY_HAVE_REMOVED.contains(&&**file) {
            let found = removed_names(text).into_iter();
            wrong.extend(found.map(|(line, name, instead)| {
                format!("{file}:{line}: {name} was removed; use instead: {instead}")
            }));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // The test also checks that the patterns find the names in this list.
    let own = removed_names(&texts[OF_REMOVED]);
    assert!(
        REMOVED
            .iter()
            .all(|row| own.iter().any(|hit| hit.1 == row.0))
    );
}
