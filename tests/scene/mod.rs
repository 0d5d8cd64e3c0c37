//! Scenes as a user writes them: what is accepted, what is refused, and in which words.

mod canonical;
mod faults;
mod layers;
mod pipelines;
mod set_faults;
mod values;

use std::fs;
use std::path::{Path, PathBuf};

use fretwear::scene::{Scene, SceneError, load};
use tempfile::TempDir;

/// A scene that uses most sections, one key a line, so that a test can change one of them.
const CASE: &str = r#"title = "Case"
[joint]
size = ["40 mm", "30 mm"]
grid = [64, 40]
hole = { diameter = "11 mm" }
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.4 mm"]
seed = 3
[contact]
friction_coefficient = 0.6
normal_load = "30 kN"
[motion]
amplitude = ["5 um", "0 um"]
[wear]
coefficient = "2e3 um^3/J"
cycles = 10_000_000
[output]
keep = "all"
"#;

/// A folder with scene files.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    fn with(self, name: &str, text: &str) -> Self {
        let path = self.path(name);
        fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        fs::write(path, text).expect("a scene file");
        self
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn load(&self, name: &str, sets: &[&str]) -> Result<Scene, SceneError> {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        load(&self.path(name), &sets)
    }

    fn scene(&self, name: &str, sets: &[&str]) -> Scene {
        self.load(name, sets)
            .unwrap_or_else(|error| panic!("{name} {sets:?}: {error}"))
    }

    /// The message that `name` fails with, file names without the folder.
    fn message(&self, name: &str, sets: &[&str]) -> String {
        match self.load(name, sets) {
            Ok(_) => panic!("{name} {sets:?} was accepted"),
            Err(error) => error
                .to_string()
                .replace(&format!("{}/", self.0.path().display()), ""),
        }
    }
}

/// [`CASE`] in a folder, as `case.toml`.
fn case() -> Folder {
    Folder::new().with("case.toml", CASE)
}

/// [`CASE`] with `--set`.
fn case_with(sets: &[&str]) -> Scene {
    case().scene("case.toml", sets)
}

/// [`CASE`] with one text replaced by another.
fn edited(from: &str, to: &str) -> String {
    assert!(CASE.contains(from), "the case has no {from}");
    CASE.replacen(from, to, 1)
}

/// A relative file name as the program resolves it.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).expect("a working folder")
}
