//! Twisting joint: two lapped bars under a transverse drive. The lap turns about its normal, and its mean displacement is nearly zero.

use std::fs;
use std::sync::Arc;

use fretwear::store::{RealFileSystem, RunReader};
use fretwear::tables::TableName;

use super::decks::TwoBodies;
use crate::support::{Bench, summary, table};

/// Largest relative difference of friction energies and forces of fine contact and contact elements, with laws from the motion.
/// Nine such joints were within 4.3 %. With laws from an equal displacement of all cells, the energies were wrong by 40 to 90 %.
const AGREED: f64 = 0.05;
/// Largest relative difference of the friction energy between a cycle from its ends and a cycle from all samples.
const SAME_CYCLE: f64 = 0.05;

const SCENE: &str = r#"
[joint]
size = ["30 mm", "20 mm"]
grid = [24, 20]
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[surface]
kind = "gaussian"
rq = "2 um"
correlation_length = "4 mm"
[contact]
normal_load = "8 kN"
friction_coefficient = 0.5
[structure]
kind = "mesh"
file = "bars.inp"
unit = { length = "mm", mass = "t", time = "s" }
interface = { upper = "TOP", lower = "BOTTOM" }
[dynamics]
force = { amplitude = "40 N", at = "TIP", direction = "y" }
frequency = ["1200 Hz", "2200 Hz"]
damping_ratio = 0.01
harmonics = [0, 1, 3]
[wear]
coefficient = "1e4 um^3/J"
cycles = 1000
[fidelity]
preset = "fast"
"#;

/// Two bars of 60 x 20 x 10 mm that overlap by 30 mm. The lower bar is clamped at x = 0.
fn bars() -> String {
    let bodies = TwoBodies {
        edge: [10.0, 10.0, 5.0],
        counts: [6, 2, 2],
        shift: [30.0, 0.0, 10.0],
    };
    bodies.deck(&[
        ("CLAMP", |body, [x, ..]| body == 0 && x == 0.0),
        ("BOTTOM", |body, [x, _, z]| {
            body == 0 && z == 10.0 && x >= 30.0
        }),
        ("TOP", |body, [x, _, z]| body == 1 && z == 10.0 && x <= 60.0),
        ("TIP", |body, [x, ..]| body == 1 && x == 90.0),
    ])
}

#[test]
#[ignore = "long: a minute"]
fn both_scales_dissipate_alike_where_a_joint_twists() {
    let bench = Bench::new();
    fs::write(bench.path("bars.inp"), bars()).expect("a deck");
    fs::write(bench.path("twist.toml"), SCENE).expect("a scene");
    let mut energies = Vec::new();
    for (name, cycle) in [("ends", "reversal"), ("samples", "stepped")] {
        let cycle = format!("fidelity.cycle=\"{cycle}\"");
        bench.done(&[
            "run",
            "twist.toml",
            "--run",
            name,
            "--set",
            &cycle,
            "--quiet",
        ]);
        let root = bench.path(name);
        let ledger = table(&root, 0, TableName::Ledger);
        let quantity = ledger.text("quantity").expect("a column");
        let of = |name: &str| {
            let row = quantity.iter().position(|q| q == name).expect("a row");
            ["fine", "dynamic"].map(|side| ledger.f64(side).expect("a column")[row])
        };
        for name in ["force_along_motion [N]", "dissipated_energy [J]"] {
            let [fine, dynamic] = of(name);
            let off = (fine / dynamic - 1.0).abs();
            assert!(off < AGREED, "{cycle}, {name}: {fine:e} {dynamic:e}");
        }
        // The mean force of the joint is about a third of the force along the motion of its elements.
        let joint = table(&root, 0, TableName::JointCycle);
        let net = joint.f64("force_x").expect("a column");
        let along = joint.f64("force_along").expect("a column");
        let largest = |series: &[f64]| series.iter().fold(0.0, |m: f64, f| m.max(f.abs()));
        assert!(largest(net) < 0.5 * largest(along), "the joint must twist");
        energies.push(summary(&root, 0, "dissipated_energy"));
    }
    let [ends, samples] = energies[..] else {
        unreachable!("two runs")
    };
    assert!((ends / samples - 1.0).abs() < SAME_CYCLE, "{energies:?}");
}

/// Edges of both bars and their mode shapes. The clamp does not move, and the tip moves with its port.
#[test]
#[ignore = "long: half a minute"]
fn the_edges_of_a_mesh_are_drawn_in_its_modes() {
    let bench = Bench::new();
    fs::write(bench.path("bars.inp"), bars()).expect("a deck");
    fs::write(bench.path("twist.toml"), SCENE).expect("a scene");
    bench.done(&[
        "run",
        "twist.toml",
        "--run",
        "run",
        "--set",
        "wear.cycles=1",
        "--quiet",
    ]);
    bench.done(&["export", "run", "--vtu", "vtu"]);
    let root = bench.path("run");
    let reader = RunReader::open(Arc::new(RealFileSystem), &root).expect("a run");
    let once = |table| reader.read_once(table).expect("readable").expect("there");
    let outline = once(TableName::StructureOutline);
    let modes = once(TableName::StructureOutlineMode);
    let line = outline.i32("line").expect("a column");
    assert_eq!(line.iter().max(), Some(&23), "twelve edges per bar");
    let x = outline.f64("x").expect("a column");
    let z = outline.f64("z").expect("a column");
    let extreme = |values: &[f64]| {
        let largest = values.iter().fold(f64::MIN, |m, v| m.max(*v));
        [values.iter().fold(f64::MAX, |m, v| m.min(*v)), largest]
    };
    // Coordinates relative to the middle of the lap.
    for (found, expected) in [(extreme(x), [-45e-3, 45e-3]), (extreme(z), [-10e-3, 10e-3])] {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
    }
    let port = once(TableName::StructurePort);
    let points = port.text("point").expect("a column");
    let tip = points
        .iter()
        .position(|point| point == "TIP")
        .expect("the tip");
    let of_modes = once(TableName::StructureMode);
    let at_ports = of_modes.f64("shape").expect("a column");
    let mode = modes.i32("mode").expect("a column");
    let point = modes.i32("point").expect("a column");
    let shape_y = modes.f64("shape_y").expect("a column");
    let count = 1 + *mode.iter().max().expect("modes") as usize;
    assert!(count > 10);
    for number in 0..3 {
        let of_mode = || (0..mode.len()).filter(|row| mode[*row] == number);
        let (mut at_tip, mut corners) = (0.0, 0.0);
        let mut most = 0.0_f64;
        for row in of_mode() {
            let at = x[point[row] as usize];
            most = most.max(shape_y[row].abs());
            if at < -44.9e-3 {
                assert_eq!(shape_y[row], 0.0, "the clamp must not move");
            }
            if at > 44.9e-3 {
                at_tip += shape_y[row];
                corners += 1.0;
            }
        }
        let expected = at_ports[number as usize * points.len() + tip + 1];
        // The mean over the edges of a face approximates the mean over its nodes, since the face hardly bends.
        let off = (at_tip / corners - expected).abs();
        assert!(
            off < 0.05 * most,
            "mode {number}: {} {expected}",
            at_tip / corners
        );
    }
    let files = fs::read_dir(bench.path("vtu")).expect("a folder");
    let names = files.map(|file| file.expect("a file").file_name());
    let names: Vec<String> = names
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    for name in [
        "structure.vtu",
        "elements.pvd",
        "elements_00000.vtu",
        "joint.pvd",
    ] {
        assert!(names.iter().any(|n| n == name), "{name} of {names:?}");
    }
}

/// The reduced structure as matrices. Another program computes the same natural frequencies, and a file describes the rows.
#[test]
fn a_reduced_structure_is_written_as_matrices() {
    let bench = Bench::new();
    fs::write(bench.path("bars.inp"), bars()).expect("a deck");
    fs::write(bench.path("twist.toml"), SCENE).expect("a scene");
    bench.done(&[
        "run",
        "twist.toml",
        "--run",
        "run",
        "--until",
        "structure",
        "--quiet",
    ]);
    bench.done(&["export", "run", "--reduced", "small"]);
    let reader = RunReader::open(Arc::new(RealFileSystem), &bench.path("run")).expect("a run");
    let once = |table| reader.read_once(table).expect("readable").expect("there");
    let modes = once(TableName::StructureMode);
    let frequency = modes.f64("frequency").expect("a column");
    let ports = once(TableName::StructurePort).rows();
    let expected: Vec<f64> = frequency
        .iter()
        .copied()
        .step_by(ports)
        .filter(|f| *f > 0.0)
        .collect();
    let rows = fs::read_to_string(bench.path("small/rows.csv")).expect("rows");
    let lines: Vec<&str> = rows.lines().collect();
    assert_eq!(lines[0], "row,kind,element,point,axis,x,y,frequency");
    assert!(lines[1].starts_with("1,contact,0,,x,"), "{}", lines[1]);
    assert_eq!(lines.len() - 1, ports + frequency.len() / ports);
    for files in [&["small/K.mtx", "small/M.mtx"][..], &["small/reduced.npz"]] {
        let arguments = [&["inspect"], files, &["--json", "--modes", "12"]].concat();
        let found = bench.done(&arguments).json();
        let of_rows = found["dofs"].as_u64().expect("a number");
        assert_eq!(of_rows as usize, lines.len() - 1);
        let found = found["frequencies"].as_array().expect("a list");
        for (found, expected) in found.iter().zip(&expected).take(6) {
            let found = found.as_f64().expect("a number");
            assert!((found / expected - 1.0).abs() < 1e-6, "{found} {expected}");
        }
    }
    let on_a_file = bench.fretwear(&["export", "run", "--reduced", "bars.inp"]);
    assert!(
        on_a_file.stderr().contains("bars.inp is a file"),
        "{}",
        on_a_file.stderr()
    );
    let without = bench.fretwear(&["export", "nowhere", "--reduced", "x"]);
    assert!(without.stderr().contains("nowhere"), "{}", without.stderr());
}
