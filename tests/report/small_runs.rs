//! Small runs for tests of readers.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use fretwear::scene::{Plan, load};
use fretwear::stages::{Observer, Progress, RunOptions, Stage, run};
use fretwear::store::{Opening, RealFileSystem};
use tempfile::TempDir;

/// Joint that wears within the time of a test. Steps of a fixed depth give several wear iterations.
pub const WORN: &str = r#"
[joint]
size = ["4 mm", "3 mm"]
grid = [24, 20]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "2 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 7
[contact]
friction_coefficient = 0.6
normal_load = "300 N"
[motion]
amplitude = ["3 um", "0 um"]
[wear]
coefficient = "2e3 um^3/J"
cycles = 400_000
depth_step = "0.2 um"
"#;

/// Joint of a size for tests, pressed together once.
pub const STATIC: &str = r#"
[joint]
size = ["4 mm", "3 mm"]
grid = [24, 20]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "1 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 7
[contact]
normal_load = "300 N"
"#;

struct Silent;

impl Observer for Silent {
    fn opened(&self, _: &Opening) {}
    fn notice(&self, _: &str) {}
    fn stage(&self, _: Stage, _: u64) {}
    fn committed(&self, _: &Progress) {}
}

/// Runs a scene in `folder/name`.
pub fn compute(folder: &TempDir, name: &str, scene: &str, until: Option<Stage>) -> PathBuf {
    computed(folder, name, scene, until, u64::MAX)
}

/// Runs a scene in `folder/name` and stops after the given number of commits.
pub fn begin(folder: &TempDir, name: &str, scene: &str, commits: u64) -> PathBuf {
    computed(folder, name, scene, None, commits)
}

fn computed(folder: &TempDir, name: &str, scene: &str, until: Option<Stage>, most: u64) -> PathBuf {
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, scene).unwrap();
    let inputs = Plan::of(&load(&path, &[]).unwrap()).unwrap().inputs;
    let root = folder.path().join(name);
    let options = RunOptions {
        inputs: &inputs,
        root: root.clone(),
        source: None,
        until,
        threads: 1,
        cache: None,
        file_system: Arc::new(RealFileSystem),
        stop: &|commits| commits >= most,
    };
    run(&options, &Silent).unwrap();
    root
}

pub fn summary_file(run: &Path, wear_iteration: u64) -> PathBuf {
    run.join(format!(
        "iterations/wear_iteration={wear_iteration}/summary.parquet"
    ))
}

/// Changes one byte in the middle of a file.
pub fn damage(path: &Path) {
    let mut bytes = std::fs::read(path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(path, bytes).unwrap();
}
