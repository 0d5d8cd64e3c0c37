//! Static contacts at a load or at an approach, of bodies with different elastic constants, with and without friction.

use std::path::{Path, PathBuf};

use fretwear::contact::Coupling;
use fretwear::scene::Plan;
use fretwear::stages::Stage;
use fretwear::tables::TableName;

use super::Start;
use crate::support::{Bench, SMALL, assert_same, content, latest, summary, table, verified};

/// Tolerance between two methods for one contact. Each method has the scene's tolerance of 1e-6 of a displacement.
const SAME: f64 = 1e-4;
/// Rounding: bodies with the same E* have the same normal contact.
const ROUNDING: f64 = 1e-9;
/// Poisson's ratio of all bodies.
const NU: f64 = 0.3;

/// Small joint, pressed together once.
fn bench() -> Bench {
    let bench = Bench::new();
    let (joint, rest) = SMALL.split_once("[motion]").expect("a motion");
    let output = rest.split_once("[output]").expect("an output").1;
    let joint = joint.replace("friction_coefficient = 0.6\n", "");
    bench.write("static.toml", format!("{joint}[output]{output}"));
    bench
}

fn run(bench: &Bench, name: &str, sets: &[&str]) -> PathBuf {
    let root = bench.path(name);
    Start::new(bench.scene("static.toml", sets), &root).done();
    verified(&root);
    assert_eq!(latest(&root), 0);
    root
}

fn field(root: &Path, column: &str) -> Vec<f64> {
    let table = table(root, 0, TableName::ContactField);
    table.f64(column).expect("a field").to_vec()
}

fn assert_close(found: f64, expected: f64, tolerance: f64, what: &str) {
    assert!(
        (found / expected - 1.0).abs() <= tolerance,
        "{what}: {found:e} for {expected:e}"
    );
}

#[test]
fn the_approach_that_a_load_gives_gives_the_load() {
    let bench = bench();
    for more in [
        &[][..],
        &["contact.boundary=periodic"],
        &["contact.pressure_cap=600 MPa"],
        &[
            "contact.rotation=free",
            r#"contact.moment=["0.04 N m", "-0.02 N m"]"#,
        ],
    ] {
        let loaded = run(&bench, "loaded", more);
        let approach = summary(&loaded, 0, "approach");
        let set = format!("contact.approach={approach:e} m");
        let sets = [&[set.as_str()], more].concat();
        let approached = run(&bench, "approached", &sets);
        for name in ["normal_load", "kn", "kt", "contact_area", "moment_x"] {
            let (found, expected) = (summary(&approached, 0, name), summary(&loaded, 0, name));
            assert_close(found, expected, SAME, &format!("{name} with {more:?}"));
        }
        assert_eq!(summary(&approached, 0, "approach"), approach);
        for root in [loaded, approached] {
            std::fs::remove_dir_all(root).expect("removed");
        }
    }
}

#[test]
fn bodies_that_do_not_touch() {
    let bench = bench();
    let root = run(&bench, "run", &["contact.approach=-1 mm"]);
    for name in ["normal_load", "max_pressure", "contact_area", "kn", "kt"] {
        assert_eq!(summary(&root, 0, name), 0.0, "{name}");
    }
}

#[test]
fn an_approach_and_something_that_moves_or_presses() {
    let bench = Bench::new();
    let message = |sets: &[&str]| {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let path = bench.path("small.toml");
        let error = fretwear::scene::load(&path, &sets).expect_err("refused");
        error.to_string()
    };
    let said = message(&["contact.approach=1 um"]);
    assert!(
        said.contains("with [motion] or [dynamics] give contact.normal_load"),
        "{said}"
    );
    bench.write(
        "small.toml",
        SMALL.replace("[motion]", "approach = \"1 um\"\n[motion]"),
    );
    let said = message(&[]);
    assert!(
        said.contains("contact.normal_load presses the bodies together already"),
        "{said}"
    );
}

/// Without friction, pressure and gap depend only on E*. Two equal bodies with the same E* give the same contact.
#[test]
fn different_bodies_without_friction_are_alike_bodies_of_their_modulus() {
    let bench = bench();
    let soft = 50e9;
    let different = run(
        &bench,
        "different",
        &[&format!("material.upper.youngs_modulus={soft} Pa")],
    );
    let alike = 2.0 / (1.0 / 198.4e9 + 1.0 / soft);
    let alike = run(
        &bench,
        "alike",
        &[&format!("material.youngs_modulus={alike:e} Pa")],
    );
    for name in ["approach", "kn", "max_pressure", "contact_area"] {
        let (found, expected) = (summary(&different, 0, name), summary(&alike, 0, name));
        assert_close(found, expected, ROUNDING, name);
    }
    // At full stick, the coupling increases kt by a fraction of the order beta squared.
    let beta = 0.5 * (1.0 - 2.0 * NU) / (1.0 - NU) * (soft - 198.4e9) / (soft + 198.4e9);
    let stiffer = summary(&different, 0, "kt") / summary(&alike, 0, "kt") - 1.0;
    assert!(stiffer > 0.0 && stiffer < 2.0 * beta * beta, "{stiffer:e}");
}

/// Friction resists the tangential displacement by pressure, so the joint is stiffer. The shear obeys Coulomb's law.
#[test]
fn different_bodies_pressed_together_with_friction() {
    const FRICTION: f64 = 0.2;
    let bench = bench();
    let soft = "material.upper.youngs_modulus=50 GPa";
    let smooth = run(&bench, "smooth", &[soft]);
    let sets = [soft, "contact.friction_coefficient=0.2"];
    let rough = run(&bench, "rough", &sets);
    assert!(summary(&rough, 0, "approach") < summary(&smooth, 0, "approach"));
    assert!(summary(&rough, 0, "kn") > summary(&smooth, 0, "kn"));
    assert!(summary(&rough, 0, "error_tangential") < 1e-4);
    let (p, x, y) = (
        field(&rough, "pressure"),
        field(&rough, "shear_x"),
        field(&rough, "shear_y"),
    );
    let at_limit = |c: usize| x[c].hypot(y[c]) / (FRICTION * p[c]);
    let touching: Vec<usize> = (0..p.len()).filter(|&c| p[c] > 0.0).collect();
    assert!(touching.iter().all(|&c| at_limit(c) <= 1.0 + ROUNDING));
    assert!(
        touching.iter().any(|&c| at_limit(c) > 0.99),
        "no cell slips"
    );
    assert!(
        touching.iter().any(|&c| at_limit(c) < 0.9),
        "no cell sticks"
    );
    // The indentation curve is the load path, and its last point is the contact.
    let curve = table(&rough, 0, TableName::Indentation);
    assert_eq!(curve.rows(), 16);
    let last = |column: &str| *curve.f64(column).expect("a column").last().expect("a row");
    assert_close(last("load"), 200.0, SAME, "load");
    assert_eq!(last("displacement"), summary(&rough, 0, "approach"));
    // A contact along x only has no field along y.
    let along_x = run(
        &bench,
        "along_x",
        &[&sets[..], &["contact.transverse=absent"]].concat(),
    );
    assert!(!table(&along_x, 0, TableName::ContactField).has("shear_y"));
    // Restarts give the same bits.
    let root = bench.path("again");
    let start = || Start::new(bench.scene("static.toml", &sets), &root);
    start().until(Stage::Surface).done();
    start().done();
    start().done();
    assert_same(&content(&root), &content(&rough), "taken up again");
}

/// The load steps have an error of first order: twice as many steps halve the error.
#[test]
fn load_steps_converge() {
    let bench = bench();
    let approach = |steps: u32| {
        let steps = format!("fidelity.load_steps={steps}");
        let root = run(
            &bench,
            &steps,
            &[
                "material.upper.youngs_modulus=50 GPa",
                "contact.friction_coefficient=0.2",
                "fidelity.preset=reference",
                &steps,
            ],
        );
        summary(&root, 0, "approach")
    };
    let [four, eight, finest] = [4, 8, 64].map(approach);
    let ratio = (four - finest) / (eight - finest);
    assert!((1.5..4.5).contains(&ratio), "{ratio}");
    assert!((eight / finest - 1.0).abs() < 1e-2);
}

#[test]
fn what_different_bodies_are_refused() {
    let bench = bench();
    let soft = "material.upper.youngs_modulus=50 GPa";
    let coupling = |sets: &[&str]| {
        Plan::of(&bench.scene("static.toml", sets))
            .map(|plan| plan.inputs.recipe.contact().expect("rough").coupling)
    };
    assert_eq!(coupling(&[]).expect("alike"), Coupling::None);
    assert_eq!(coupling(&[soft]).expect("smooth"), Coupling::Frictionless);
    let friction = "contact.friction_coefficient=0.2";
    assert_eq!(
        coupling(&[soft, friction, "fidelity.load_steps=3"]).expect("steps"),
        Coupling::Indented { load_steps: 3 }
    );
    for (set, said) in [
        ("contact.approach=1 um", "give contact.normal_load"),
        ("contact.transverse=free", "give \"fixed\" or \"absent\""),
    ] {
        let error = coupling(&[soft, friction, set])
            .expect_err("refused")
            .to_string();
        assert!(error.contains(said) && error.contains("beta = "), "{error}");
        coupling(&[soft, set]).expect("without friction it is computed");
    }
    let error = Plan::of(&bench.scene("small.toml", &[soft])).expect_err("refused");
    assert!(error.to_string().contains("remove [motion]"), "{error}");
}
