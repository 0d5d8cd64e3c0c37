//! What the manifest and the README promise of a build, held against the lock file and the packages themselves.

use std::collections::BTreeSet;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

fn read(file: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The packages of the lock file: of all features and platforms, so that no build has another.
fn locked() -> BTreeSet<String> {
    let lock: toml::Table = read("Cargo.lock").parse().expect("a lock file");
    let packages = lock["package"].as_array().expect("packages");
    packages
        .iter()
        .map(|package| package["name"].as_str().expect("a name").to_owned())
        .collect()
}

/// Crates that speak to others over a network, or encrypt what they say.
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
fn nothing_in_the_build_can_speak_to_a_network() {
    let locked = locked();
    let found: Vec<&&str> = OF_NETWORKS
        .iter()
        .filter(|name| locked.contains(**name))
        .collect();
    assert!(found.is_empty(), "Cargo.lock has {found:?}");
    // The list is held against what is read of the lock file.
    assert!(locked.contains("fretwear") && locked.contains("parquet"));
}

/// What cargo prints; it stands beside the tests that it built.
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

/// The numbers of a version, of which the last may be left out.
fn version(text: &str) -> Vec<u64> {
    let numbers = text.split('.').map(|n| n.parse().expect("a number"));
    numbers.chain([0]).take(3).collect()
}

/// Locks of files are in the standard library since then; that the sources need nothing newer than stated is clippy's to say.
const OURS: &str = "1.89";

/// The minimum that is stated is the least that the packages of the lock file allow, this one among them.
#[test]
fn the_stated_rust_suffices() {
    let about = cargo(&["-vV"]);
    let mut lines = about.lines();
    let host = lines.find_map(|line| line.strip_prefix("host: "));
    let platform = format!("--filter-platform={}", host.expect("a platform"));
    // What a build has fetched; packages of other platforms and features are not among it.
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
        .chain([(version(OURS), "the sources want it".to_owned())])
        .max()
        .expect("at least one");
    assert!(packages.len() > 100, "{} packages", packages.len());

    let stated = env!("CARGO_PKG_RUST_VERSION");
    assert_eq!(version(stated), wanted.0, "{stated}, but {}", wanted.1);
    let readme = read("README.md");
    let sentence = format!("a Rust toolchain ({stated} or later)");
    assert!(readme.contains(&sentence), "no {sentence:?} in the README");
}

/// Some packages are written in C, and the README says so.
#[test]
fn a_c_compiler_is_named_if_needed() {
    assert_eq!(
        locked().contains("cc"),
        read("README.md").contains("a C compiler")
    );
}

/// 76 MB, most of it Polars; what is not stripped, or not optimised, adds tens of them.
#[cfg(not(debug_assertions))]
#[test]
fn the_program_is_small() {
    const MOST: u64 = 90_000_000;
    let program = std::fs::metadata(env!("CARGO_BIN_EXE_fretwear")).expect("the program");
    assert!(program.len() < MOST, "{} bytes", program.len());
}
