//! Joint under an orbit: two blocks with a drive along x and, 90° later, a drive along y.

use std::fs;

use fretwear::tables::TableName;

use super::decks::TwoBodies;
use crate::support::{Bench, table};

/// Largest relative difference of the friction energies of fine contact and contact elements, with laws from the whole cycle.
/// Six such joints were within 3 %. With laws from the longest line, the difference was 6 to 17 %.
const AGREED: f64 = 0.035;
/// Largest relative difference of the forces of fine contact and contact elements, with laws from the whole cycle.
const FORCE: f64 = 0.05;

const SCENE: &str = r#"
[joint]
size = ["30 mm", "25 mm"]
grid = [24, 30]
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "2 um"
correlation_length = "4 mm"
[contact]
normal_load = "6.5 kN"
pressing = "punch"
friction_coefficient = 0.5
[structure]
kind = "mesh"
file = "blocks.inp"
unit = { length = "mm", mass = "t", time = "s" }
interface = { upper = "TOP", lower = "BOTTOM" }
[dynamics]
force = [
    { amplitude = "130 N", at = "UP", direction = "x" },
    { amplitude = "130 N", at = "UP", direction = "y", phase = "90 deg" },
]
frequency = ["6 kHz", "14 kHz"]
damping_ratio = 0.01
harmonics = [0, 1, 3]
[wear]
coefficient = "1e4 um^3/J"
cycles = 1000
[fidelity]
preset = "fast"
"#;

/// Two blocks of 30 x 25 x 20 mm, one on the other. The bottom of the lower block is fixed.
fn blocks() -> String {
    let bodies = TwoBodies {
        edge: [5.0, 5.0, 10.0],
        counts: [6, 5, 2],
        shift: [0.0, 0.0, 20.0],
    };
    bodies.deck(&[
        ("BASE", |body, [_, _, z]| body == 0 && z == 0.0),
        ("BOTTOM", |body, [_, _, z]| body == 0 && z == 20.0),
        ("TOP", |body, [_, _, z]| body == 1 && z == 20.0),
        ("UP", |body, [_, _, z]| body == 1 && z == 40.0),
    ])
}

#[test]
fn both_scales_dissipate_alike_where_a_joint_goes_round() {
    let bench = Bench::new();
    fs::write(bench.path("blocks.inp"), blocks()).expect("a deck");
    fs::write(bench.path("orbit.toml"), SCENE).expect("a scene");
    bench.done(&["run", "orbit.toml", "--run", "run", "--quiet"]);
    let root = bench.path("run");
    let ledger = table(&root, 0, TableName::Ledger);
    let quantity = ledger.text("quantity").expect("a column");
    for (name, agreed) in [
        ("dissipated_energy [J]", AGREED),
        ("force_along_motion [N]", FORCE),
    ] {
        let row = quantity.iter().position(|q| q == name).expect("a row");
        let [fine, dynamic] =
            ["fine", "dynamic"].map(|side| ledger.f64(side).expect("a column")[row]);
        assert!(
            (fine / dynamic - 1.0).abs() < agreed,
            "{name}: {fine:e} {dynamic:e}"
        );
    }
    // The motion is an orbit: both axes move with similar amplitudes and not in phase.
    let joint = table(&root, 0, TableName::JointCycle);
    let [x, y] = ["force_x", "force_y"].map(|name| joint.f64(name).expect("a column").to_vec());
    let size = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let together = size(&x, &y) / (size(&x, &x) * size(&y, &y)).sqrt();
    let even = (size(&x, &x) / size(&y, &y)).sqrt();
    assert!(
        together.abs() < 0.95 && (0.3..3.0).contains(&even),
        "{together} {even}"
    );
}

/// The force exceeds the friction of any joint with this load. The run ends within seconds and reports the largest possible force.
#[test]
#[ignore = "long: half a minute"]
fn a_force_beyond_what_friction_holds_is_told() {
    let bench = Bench::new();
    fs::write(bench.path("blocks.inp"), blocks()).expect("a deck");
    fs::write(bench.path("orbit.toml"), SCENE).expect("a scene");
    let load = "contact.normal_load=\"2 kN\"";
    let did = bench.fretwear(&[
        "run",
        "orbit.toml",
        "--run",
        "run",
        "--quiet",
        "--set",
        load,
    ]);
    assert_eq!(did.code(), 3, "{}", did.stderr());
    let told = did.stderr();
    for part in ["to the whole load", "dynamics.force", "contact.normal_load"] {
        assert!(told.contains(part), "{part}: {told}");
    }
}
