//! Tests of scenes as users write them: accepted scenes, rejected scenes, and messages.

mod canonical;
mod dynamics_faults;
mod faults;
mod json_schema;
mod keys;
mod layers;
mod pipelines;
mod set_faults;
mod structure_faults;
mod twins;
mod values;
mod variants;
mod vibration;
mod wear_law;

use std::fs;
use std::path::{Path, PathBuf};

use fretwear::recipe::Conditions;
use fretwear::scene::{Bodies, Contact, Joint, Motion, Scene, SceneError, Surface, load};
use fretwear::wear::{Harmonic, HarmonicMotion};
use tempfile::TempDir;

/// Scene with most sections. Each key has its own line, so that a test can replace it.
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

/// Rough joint that wears in a resonator.
const ROUGH: &str = r#"[joint]
size = ["40 mm", "38 mm"]
grid = [76, 57]
elements = [19, 19]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[surface]
kind = "gaussian"
rq = "5 um"
correlation_length = ["0.5 mm", "0.4 mm"]
[contact]
friction_coefficient = 0.6
normal_load = "30 kN"
[structure]
kind = "resonator"
[dynamics]
force = { amplitude = "1000 N", at = "far_wall", direction = "x" }
frequency = ["900 Hz", "1050 Hz"]
[wear]
coefficient = "2e3 um^3/J"
cycles = 10_000_000
[update]
stiffness_change = 0.10
"#;

/// Resonator with contact elements of a given stiffness.
const SPRINGS: &str = r#"[joint]
size = ["40 mm", "38 mm"]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[contact]
kn = "1.2e4 N/um"
kt = "1e4 N/um"
friction_coefficient = 0.6
normal_load = "30 kN"
[structure]
kind = "resonator"
[dynamics]
force = { amplitude = "1000 N" }
frequency = ["900 Hz", "1050 Hz"]
"#;

/// Oscillator with one mass and one contact element.
const OSCILLATOR: &str = r#"[structure]
kind = "oscillator"
mass = "1 kg"
stiffness = "4 N/um"
[contact]
kn = "8 N/um"
kt = "6 N/um"
friction_coefficient = 0.3
normal_load = "1 kN"
[dynamics]
force = { amplitude = "100 N" }
"#;

/// Folder with scene files.
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

    /// Faults of the scene `name`, one text per fault. The texts contain file names without the folder.
    fn faults(&self, name: &str, sets: &[&str]) -> Vec<String> {
        let folder = format!("{}/", self.0.path().display());
        match self.load(name, sets) {
            Ok(_) => Vec::new(),
            Err(error) => error
                .into_each()
                .map(|fault| fault.to_string().replace(&folder, ""))
                .collect(),
        }
    }

    /// Message of the error for `name`, with file names without the folder.
    fn message(&self, name: &str, sets: &[&str]) -> String {
        match self.load(name, sets) {
            Ok(_) => panic!("{name} {sets:?} was accepted"),
            Err(error) => error
                .to_string()
                .replace(&format!("{}/", self.0.path().display()), ""),
        }
    }
}

/// Sections that a scene of a rough joint contains.
trait Sections {
    fn the_joint(&self) -> &Joint;
    fn the_material(&self) -> &Bodies;
    fn the_surface(&self) -> Surface;
    fn the_contact(&self) -> &Contact;
    fn the_conditions(&self) -> &Conditions;
}

impl Sections for Scene {
    fn the_joint(&self) -> &Joint {
        self.joint.as_ref().expect("a joint")
    }

    fn the_material(&self) -> &Bodies {
        self.material.as_ref().expect("a material")
    }

    fn the_surface(&self) -> Surface {
        self.surface.clone().expect("a surface")
    }

    fn the_contact(&self) -> &Contact {
        self.contact.as_ref().expect("a contact")
    }

    fn the_conditions(&self) -> &Conditions {
        let conditions = self.the_contact().conditions.as_ref();
        conditions.expect("a rough contact")
    }
}

/// Harmonic motion with half ranges \[m\] and phases \[rad\] along x and y, under a normal load with the given half range \[N\].
fn displaced(amplitude: [f64; 2], phase: [f64; 2], normal_load_amplitude: f64) -> Option<Motion> {
    let axis = |axis: usize| Harmonic {
        amplitude: amplitude[axis],
        phase: phase[axis],
        is_force: false,
    };
    Some(Motion::Harmonic(HarmonicMotion {
        axes: vec![axis(0), axis(1)],
        rotation: None,
        normal_load_amplitude,
    }))
}

/// Folder with [`CASE`] as `case.toml`.
fn case() -> Folder {
    Folder::new().with("case.toml", CASE)
}

/// [`CASE`] with arguments of `--set`.
fn case_with(sets: &[&str]) -> Scene {
    scene_of(CASE, sets)
}

/// Scene from a text, with arguments of `--set`.
fn scene_of(text: &str, sets: &[&str]) -> Scene {
    let folder = Folder::new().with("case.toml", text);
    folder.scene("case.toml", sets)
}

/// Faults of a scene from a text, one text per fault.
fn faults_of(text: &str, sets: &[&str]) -> Vec<String> {
    let folder = Folder::new().with("case.toml", text);
    folder.faults("case.toml", sets)
}

/// Message of the error for a scene from a text.
fn message_of(text: &str, sets: &[&str]) -> String {
    let folder = Folder::new().with("case.toml", text);
    folder.message("case.toml", sets)
}

/// Asserts the message for each row. A row contains the replaced text of a case, the new text, and the message.
fn assert_faults(case: &str, rows: &[(&str, &str, &str)]) {
    for (from, to, expected) in rows {
        let faults = faults_of(&replaced(case, from, to), &[]);
        assert!(
            faults.iter().any(|fault| fault == expected),
            "{from} => {to}: {faults:#?}"
        );
    }
}

/// Scene with one text replaced by another.
fn replaced(case: &str, from: &str, to: &str) -> String {
    assert!(case.contains(from), "{from} is missing in the case");
    case.replacen(from, to, 1)
}

/// [`CASE`] with one text replaced by another.
fn edited(from: &str, to: &str) -> String {
    replaced(CASE, from, to)
}

/// Absolute file name, as the program resolves it.
fn absolute(path: &Path) -> PathBuf {
    std::path::absolute(path).expect("a working folder")
}
