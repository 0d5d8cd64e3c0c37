//! Tests of the canonical form and of the document: equal scenes, different scenes, and scenes that the program writes and reads again.

use std::fs;

use fretwear::json::differences;

use super::{CASE, case, case_with, scene_of};

/// [`CASE`] in other units, in another order, and with its defaults written out.
const SAME: &str = r#"title = "Another title"
[contact]
normal_load = "0.03 MN"
friction_coefficient = "60 %"
boundary = "free"
[wear]
cycles = 1e7
coefficient = "2e-15 m^3/(N m)"
law = "energy"
tolerance = 10e-3
[motion]
amplitude = "0.005 mm"
phase = ["-0 deg", "0 rad"]
[surface]
correlation_length = ["500 µm", "4e-4 m"]
kind = "gaussian"
seed = 3
rq = "5000 nm"
[joint]
hole.diameter = "1.1 cm"
size = ["4 cm", "0.03 m"]
grid = [64.0, 40]
[material]
youngs_modulus = "500 GPa"
poisson_ratio = "3e-1"
lower.youngs_modulus = "198400 MPa"
upper.youngs_modulus = "1.984e5 N/mm^2"
[fidelity]
preset = "balanced"
"#;

#[test]
fn equal_scenes_in_other_units_are_equal() {
    let other = scene_of(SAME, &[]);
    let case = case_with(&[]);
    assert_eq!(differences(&case.canonical(), &other.canonical()), []);
    assert_eq!(
        case.canonical().to_string(),
        other.canonical().to_string(),
        "the bytes must be equal"
    );
}

#[test]
fn keys_are_sorted_and_no_path_title_or_name_is_in() {
    let scene = case_with(&["surface.kind=file", "surface.path=somewhere/heights.npy"]);
    let text = scene.canonical().to_string();
    assert!(
        !text.contains("somewhere") && !text.contains("Case"),
        "{text}"
    );
    let canonical = scene.canonical();
    let sections = canonical.as_object().expect("an object");
    let keys: Vec<&String> = sections.keys().collect();
    assert!(keys.is_sorted(), "{keys:?}");
    for absent in ["title", "name", "document"] {
        assert!(!sections.contains_key(absent), "{absent}");
    }
    assert_eq!(sections["surface"]["kind"], "file");
}

#[test]
fn a_moved_file_makes_no_difference() {
    let here = case_with(&["motion.history=a/cycle.parquet"]);
    let there = case_with(&["motion.history=b/cycle.parquet"]);
    assert_ne!(here, there);
    assert_eq!(here.canonical(), there.canonical());
}

#[test]
fn differences_are_named_with_both_values() {
    let before = case_with(&[]);
    let after = case_with(&[
        "wear.cycles=20",
        "contact.pressure_cap=600 MPa",
        "surface.kind=flat",
        "title=x",
    ]);
    let found: Vec<String> = differences(&before.canonical(), &after.canonical())
        .iter()
        .map(ToString::to_string)
        .collect();
    let expected = [
        "`contact.pressure_cap` was absent, is 600000000.0",
        "`surface.correlation_length` was [0.0005,0.0004], is absent",
        "`surface.kind` was \"gaussian\", is \"flat\"",
        "`surface.rq` was 5e-6, is absent",
        "`surface.seed` was 3, is absent",
        "`wear.cycles` was 10000000, is 20",
    ];
    assert_eq!(found, expected);
}

#[test]
fn every_single_change_is_seen() {
    let case = case_with(&[]).canonical();
    for set in [
        "joint.grid=[64, 41]",
        "joint.elements=[7, 5]",
        "joint.hole.diameter=10 mm",
        "material.lower.density=7949 kg/m^3",
        "material.upper.poisson_ratio=0.31",
        "surface.seed=4",
        "contact.friction_coefficient=0.61",
        "contact.normal_load=30.0000001 kN",
        "contact.transverse=absent",
        "motion.phase=1 deg",
        "motion.normal_load_amplitude=1 N",
        "wear.volume=1 mm^3",
        "wear.depth_step=1 um",
        "wear.tolerance=0.02",
        "fidelity.cycle=stepped",
        "fidelity.steps_per_cycle=34",
        "fidelity.cycle_tolerance=2e-3",
        "fidelity.cycle_extrapolation=false",
        "fidelity.load_steps=3",
        "output.keep.last=2",
        "output.curves_every=0",
    ] {
        let found = differences(&case, &case_with(&[set]).canonical());
        let key = set.split('=').next().expect("a key");
        assert!(
            found.iter().any(|d| d.key.starts_with(key)),
            "{set}: {found:?}"
        );
    }
}

#[test]
fn the_document_loads_again_as_the_same_scene() {
    let folder = case()
        .with(
            "sub/measured.toml",
            "base = \"../case.toml\"\n[surface]\nkind = \"file\"\npath = \"heights.npy\"\nunit = \"um\"\n",
        )
        .with("again/keep.txt", "");
    let changes: [(&str, &[&str]); 4] = [
        ("case.toml", &[]),
        (
            "case.toml",
            &["output.keep={ last = 3 }", "wear.cycles=1e6"],
        ),
        ("sub/measured.toml", &["material.upper.density=2.7 g/cm^3"]),
        ("sub/measured.toml", &["motion.history=cycle.parquet"]),
    ];
    for (name, sets) in changes {
        let scene = folder.scene(name, sets);
        // The copy has another folder. Relative paths of the document would be wrong there.
        let copy = folder.path("again").join(format!("{}.toml", scene.name));
        fs::write(&copy, scene.to_toml()).expect("a copy");
        let again = fretwear::scene::load(&copy, &[]).expect("a scene");
        assert_eq!(scene, again, "{name} {sets:?}");
    }
}

#[test]
fn the_document_keeps_the_units_of_the_user() {
    let text = case_with(&["contact.normal_load=20 kN"]).to_toml();
    assert!(text.contains("normal_load = \"20 kN\""), "{text}");
    assert!(CASE.contains("normal_load = \"30 kN\""));
}

/// A key is relevant if the scene has its subject. The default of the key does not matter.
#[test]
fn keys_of_contact_elements_mean_something_with_a_structure_alone() {
    let pipelines = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    for (name, expected) in [
        ("prescribed_fretting", [false, false, false, true]),
        ("oscillator", [false, false, true, true]),
        ("lap_joint", [true, true, true, true]),
    ] {
        let scene = fretwear::scene::load(&pipelines.join(format!("{name}.toml")), &[]);
        let canonical = scene.expect(name).canonical();
        let found = [
            "contact.stiffness",
            "contact.distribution",
            "fidelity.aft_samples",
            "contact.normal_load",
        ]
        .map(|key| fretwear::scene::is_relevant(&canonical, key));
        assert_eq!(found, expected, "{name}");
    }
}
