//! Support for tests of whole runs: a folder with a scene, the real binary, and comparisons of run folders.

pub mod damage;
pub mod faulty;

use std::collections::BTreeMap;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::Arc;

use fretwear::scene::{self, Scene};
use fretwear::store::{RealFileSystem, RunReader, VerifyReport};
use fretwear::tables::{Table, TableName};
use serde_json::Value;
use tempfile::TempDir;

/// Rough joint of a few cells that wears in some iterations. The ratio of its cells to its padded plane (26·22 / 54·48) has no short binary
/// form, so sums of FFT pairs are not exact by chance.
pub const SMALL: &str = r#"title = "Small"
[joint]
size = ["4 mm", "3 mm"]
grid = [26, 22]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "200 N"
[motion]
amplitude = "1 um"
[wear]
coefficient = "2e3 um^3/J"
cycles = 600_000
tolerance = 1e-3
[output]
curves_every = 2
"#;

/// Resonator with few cells. Its vibration wears the joint in some iterations within a second, and some contact elements slip. This
/// `stiffness_change` causes several model updates, but not one per iteration. The contact elements have one slider each, as in the paper.
/// Tests with more sliders set the key.
pub const RESONATOR: &str = r#"title = "Small resonator"
[joint]
size = ["40 mm", "36 mm"]
grid = [45, 36]
elements = [9, 9]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[surface]
kind = "gaussian"
rq = "2 um"
correlation_length = ["5 mm", "4 mm"]
seed = 5
[contact]
friction_coefficient = 0.6
normal_load = "30 kN"
stiffness = "total"
[structure]
kind = "resonator"
half_depth_cells = 2
block_cells = 3
stub_cells = 1
gap_cells = 1
leaf_cells = 1
window_cells = 3
wall_cells = 2
inner_cells = 2
rim_cells = 1
head_cells = 1
[dynamics]
force = { amplitude = "300 N", at = "far_wall", direction = "x" }
harmonics = [0, 1]
modes = 10
damping_ratio = 0.01
frequency = ["900 Hz", "1100 Hz"]
points = 3
[wear]
coefficient = "2e5 um^3/J"
cycles = 500_000
tolerance = 0.05
[update]
stiffness_change = 0.01
volume_growth = "never"
extrapolate = false
[fidelity]
aft_samples = 32
harmonic_correction = false
[output]
curves_every = 0
"#;

/// A mass on a spring, without contact.
pub const OSCILLATOR: &str = r#"title = "Oscillator"
[structure]
kind = "oscillator"
mass = "1 kg"
damping = "20 N s/m"
stiffness = "4 N/um"
[dynamics]
force = { amplitude = "100 N", at = "mass", direction = "x" }
harmonics = [0, 1, 3]
frequency = ["160 Hz", "750 Hz"]
points = 23
"#;

/// Section that adds a friction contact to [`OSCILLATOR`].
pub const SLIDER: &str = r#"[contact]
kn = "8 N/um"
kt = "6 N/um"
friction_coefficient = 0.3
normal_load = "1000 N"
"#;

/// Folder with scenes and runs, and the optional cache of their structures.
pub struct Bench(TempDir, Option<PathBuf>);

impl Bench {
    /// Folder with [`SMALL`] as `small.toml` and [`RESONATOR`] as `resonator.toml`.
    pub fn new() -> Bench {
        let bench = Bench(tempfile::tempdir().expect("a folder"), None);
        bench.write("small.toml", SMALL);
        bench.write("resonator.toml", RESONATOR);
        bench
    }

    /// Shares reduced structures between the runs of this folder.
    pub fn sharing(mut self) -> Bench {
        self.1 = Some(self.path("cache"));
        self
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        fs::write(&path, text).expect("written");
        path
    }

    /// Scene of this folder, changed by `sets`.
    pub fn scene(&self, name: &str, sets: &[&str]) -> Scene {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        scene::load(&self.path(name), &sets).unwrap_or_else(|error| panic!("{error}"))
    }

    /// Command of the program in this folder, not yet started. The command does not use the user's cache.
    pub fn command(&self, arguments: &[impl AsRef<OsStr>]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_fretwear"));
        command
            .current_dir(self.0.path())
            .args(arguments)
            .env("FRETWEAR_CACHE", self.1.clone().unwrap_or_default())
            .env_remove("COLUMNS")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Runs the program and returns its output.
    pub fn fretwear(&self, arguments: &[impl AsRef<OsStr>]) -> Did {
        Did(self.command(arguments).output().expect("the program runs"))
    }

    /// As [`Bench::fretwear`], for a command that must succeed.
    pub fn done(&self, arguments: &[impl AsRef<OsStr>]) -> Did {
        let did = self.fretwear(arguments);
        assert_eq!(did.code(), 0, "{}", did.stderr());
        did
    }
}

/// Output and exit code of a command.
pub struct Did(pub Output);

impl Did {
    pub fn code(&self) -> i32 {
        self.0.status.code().expect("not ended by a signal")
    }

    pub fn stdout(&self) -> String {
        String::from_utf8(self.0.stdout.clone()).expect("text")
    }

    pub fn stderr(&self) -> String {
        String::from_utf8(self.0.stderr.clone()).expect("text")
    }

    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout())
            .unwrap_or_else(|error| panic!("{error} in {}", self.stdout()))
    }
}

/// Reader of a run.
pub fn reader(root: &Path) -> RunReader {
    RunReader::open(Arc::new(RealFileSystem), root).unwrap_or_else(|error| panic!("{error}"))
}

/// Table of an iteration.
pub fn table(root: &Path, wear_iteration: u64, name: TableName) -> Table {
    reader(root)
        .read(wear_iteration, name)
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Value of a summary column of an iteration.
pub fn summary(root: &Path, wear_iteration: u64, column: &str) -> f64 {
    let row = table(root, wear_iteration, TableName::Summary);
    match row.f64(column) {
        Ok(values) => values[0],
        Err(_) => row.i64(column).expect("a number")[0] as f64,
    }
}

/// Last iteration.
pub fn latest(root: &Path) -> u64 {
    reader(root).latest().expect("an iteration")
}

/// Checks every file of a run against its hash.
pub fn verified(root: &Path) -> VerifyReport {
    let report = reader(root).verify().expect("readable");
    assert!(
        report.is_sound(),
        "{:?}",
        report.damage().collect::<Vec<_>>()
    );
    report
}

/// Results of a run: the bytes of every table except the timings, and the hash chain of the verified commits.
///
/// Equal runs have identical Parquet files, so tests compare whole files.
#[derive(PartialEq)]
pub struct Content {
    pub files: BTreeMap<PathBuf, Vec<u8>>,
    pub chain: BTreeMap<u64, (Option<String>, String)>,
}

/// Reads the [`Content`] of the iterations from `first` on.
pub fn content_from(root: &Path, first: u64) -> Content {
    let reader = reader(root);
    let mut files = BTreeMap::new();
    let mut chain = BTreeMap::new();
    for entry in fs::read_dir(root.join("once")).expect("a folder") {
        let path = entry.expect("an entry").path();
        let name = path.strip_prefix(root).expect("below").to_owned();
        files.insert(name, fs::read(&path).expect("a file"));
    }
    for k in reader.iterations().filter(|k| *k >= first) {
        let commit = reader.commit_of(k).expect("listed");
        chain.insert(k, (commit.parent.clone(), commit.hash.clone()));
        let folder = root.join(format!("iterations/wear_iteration={k}"));
        for entry in fs::read_dir(&folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if !path.ends_with("timing.parquet") && !path.ends_with("commit.json") {
                let name = path.strip_prefix(root).expect("below").to_owned();
                files.insert(name, fs::read(&path).expect("a file"));
            }
        }
    }
    Content { files, chain }
}

/// Reads the [`Content`] of all iterations.
pub fn content(root: &Path) -> Content {
    content_from(root, 0)
}

/// Panics with the names of the files that differ.
pub fn assert_same(found: &Content, expected: &Content, at: &str) {
    if found == expected {
        return;
    }
    let names: std::collections::BTreeSet<_> =
        found.files.keys().chain(expected.files.keys()).collect();
    let differing: Vec<_> = names
        .into_iter()
        .filter(|name| found.files.get(*name) != expected.files.get(*name))
        .collect();
    panic!(
        "{at}: {differing:?} differ; iterations {:?} instead of {:?}",
        found.chain.keys().collect::<Vec<_>>(),
        expected.chain.keys().collect::<Vec<_>>()
    );
}

/// Copies a folder with its content.
pub fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder");
    for entry in fs::read_dir(from).expect("a folder to copy") {
        let entry = entry.expect("an entry");
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            fs::copy(entry.path(), target).expect("a copy");
        }
    }
}

/// All files below a folder with their content.
pub fn every_file(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut files = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        match path.is_dir() {
            true => files.extend(every_file(&path)),
            false => drop(files.insert(path.clone(), fs::read(&path).expect("a file"))),
        }
    }
    files
}

/// Object of a JSON file of a run, without the hash at its end.
pub fn unsealed(path: &Path) -> Value {
    let text = fs::read_to_string(path).expect("a file");
    let mut value: Value = serde_json::from_str(&text).expect("an object");
    value.as_object_mut().expect("an object").remove("seal");
    value
}

/// Text of a JSON file of a run, with the hash at its end.
pub fn sealed(value: &Value) -> String {
    let text = serde_json::to_string_pretty(value).expect("an object") + "\n";
    let seal = blake3::hash(text.as_bytes()).to_hex();
    let open = text.strip_suffix("\n}\n").expect("an object with a key");
    format!("{open},\n  \"seal\": \"{seal}\"\n}}\n")
}

/// Changes `run.json` and its copy, and updates their hashes.
pub fn forge_record(root: &Path, change: impl Fn(&mut Value)) {
    let mut record = unsealed(&root.join("run.json"));
    change(&mut record);
    for name in ["run.json", "run.copy.json"] {
        fs::write(root.join(name), sealed(&record)).expect("written");
    }
}

/// Flips one bit in the middle of a file.
pub fn flip(path: &Path) {
    let mut bytes = fs::read(path).expect("a file");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    fs::write(path, bytes).expect("written");
}

/// Reproducible sequence of numbers in 0..1.
pub struct Chance(u64);

impl Chance {
    pub fn new(seed: u64) -> Chance {
        Chance(seed)
    }

    /// Next number (splitmix64).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        (z ^ (z >> 31)) as f64 / u64::MAX as f64
    }
}
