//! Runs with a structure from the files of another program.

use std::fs;
use std::path::Path;

use fretwear::linalg::Matrix;
use fretwear::structure::matrices::Triplets;
use fretwear::structure::matrix_files::npz;
use fretwear::structure::readers;
use fretwear::tables::TableName;

use super::decks::TwoBodies;
use crate::support::{Bench, assert_same, content, latest, summary, table, verified};

const SHORT: &str = "wear.cycles=200_000";

/// Two reductions with different orders of elimination differ by rounding. Vibration and wear differ by about 1e-6 through their
/// tolerances.
const SAME: f64 = 1e-5;

/// On so few cells, the bolt heads cover the whole lap. A search of layers by position then counts the heads as a layer of the lap.
/// The compliance of the half spaces, which the sliders subtract, differs by this amount.
const OTHER_LAYERS: f64 = 1e-2;

/// The search of laws ends when both scales agree within 1 %. Structures with small differences may need another number of rounds.
/// Their cycles then differ by twice this tolerance and by the effect of the layers. Stiffness and vibration do not differ.
const OTHER_ROUND: f64 = 3e-2;
const SAME_VIBRATION: f64 = 1e-3;

/// Force and response act at both points of the resonator. The pseudo-modes contain all ports of a structure, and a structure from files
/// has only these two.
const BOTH: &str = "dynamics.response.at=block";

/// Writes the files of the small resonator and the scene that reads them.
fn exported(bench: &Bench) {
    bench.done(&[
        "export",
        "resonator.toml",
        "--matrices",
        "files",
        "--set",
        BOTH,
    ]);
}

#[test]
fn resonator_read_from_its_matrices_wears_as_itself() {
    wears_as_itself("contact.stiffness=total", SAME);
}

#[test]
#[ignore = "long: vibrations of many sliders"]
fn resonator_of_many_sliders_read_from_its_matrices_wears_as_itself() {
    wears_as_itself("contact.stiffness=sliders", OTHER_LAYERS);
}

fn wears_as_itself(stiffness: &str, tolerance: f64) {
    let bench = Bench::new();
    exported(&bench);
    let sets = ["--set", SHORT, "--set", stiffness, "--quiet"];
    let run = |scene: &str, name: &str, both: &[&str]| {
        let _ = fs::remove_dir_all(bench.path(name));
        bench.done(&[&["run", scene, "--run", name], &sets[..], both].concat());
        bench.path(name)
    };
    let (own, read) = (
        run("resonator.toml", "own", &["--set", BOTH]),
        run("files/scene.toml", "read", &[]),
    );
    verified(&read);
    assert_eq!(latest(&own), latest(&read));
    assert!(latest(&own) >= 2, "iterations");
    for k in 0..=latest(&own) {
        for column in [
            "kn",
            "kt",
            "resonance_frequency",
            "peak_amplitude",
            "dissipated_energy",
            "wear_volume",
            "normal_load",
        ] {
            let [a, b] = [&own, &read].map(|root| summary(root, k, column));
            let tolerance = match column {
                _ if tolerance == SAME => SAME,
                "dissipated_energy" => OTHER_ROUND,
                "wear_volume" => OTHER_LAYERS,
                _ => SAME_VIBRATION,
            };
            assert!(
                (a - b).abs() <= tolerance * a.abs(),
                "{stiffness}, {column} of {k}: {a:e} {b:e}"
            );
        }
    }
    let elements = |root| table(root, 0, TableName::ContactElement);
    let columns =
        |name: &str| [&own, &read].map(|root| elements(root).f64(name).expect("a column").to_vec());
    for name in ["x", "y", "area", "normal_load"] {
        let [a, b] = columns(name);
        let size = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        for (a, b) in a.iter().zip(&b) {
            assert!((a - b).abs() <= tolerance * size, "{name}: {a:e} {b:e}");
        }
    }
}

#[test]
fn a_run_from_matrices_goes_on_and_knows_its_files() {
    let bench = Bench::new();
    exported(&bench);
    let run = ["run", "files/scene.toml", "--set", SHORT, "--quiet"];
    bench.done(&[&run[..], &["--run", "whole"]].concat());
    bench.done(&["run", "--from", "whole@1", "--run", "branch", "--quiet"]);
    assert_same(
        &content(&bench.path("branch")),
        &content(&bench.path("whole")),
        "a branch",
    );
    // The same numbers in another order are the same structure. Other numbers are another structure.
    let nodes = fs::read_to_string(bench.path("files/pairs.csv")).expect("pairs");
    let comment = format!("# pairs of the lap\n{nodes}");
    fs::write(bench.path("files/pairs.csv"), comment).expect("pairs");
    bench.done(&["run", "--run", "whole", "--quiet"]);
    let mass = fs::read_to_string(bench.path("files/mass.mtx")).expect("a mass");
    let (head, rest) = mass.split_once("\n").expect("a header");
    let mut lines: Vec<&str> = rest.lines().collect();
    let heavier = "1 1 1e-1";
    assert!(lines[1].starts_with("1 1 "));
    lines[1] = heavier;
    fs::write(
        bench.path("files/mass.mtx"),
        format!("{head}\n{}\n", lines.join("\n")),
    )
    .expect("a mass");
    let did = bench.fretwear(&[
        "run",
        "files/scene.toml",
        "--set",
        SHORT,
        "--run",
        "whole",
        "--quiet",
    ]);
    assert_ne!(did.code(), 0);
    assert!(did.stderr().contains("structure"), "{}", did.stderr());
}

#[test]
fn mistakes_in_the_files_of_a_structure_are_named() {
    let bench = Bench::new();
    exported(&bench);
    let told = |sets: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let did = bench.fretwear(&[&["check", "files/scene.toml"], &sets[..]].concat());
        assert_eq!(did.code(), 2, "{sets:?}: {}", did.stdout());
        did.stdout() + &did.stderr()
    };
    let has = |text: String, parts: &[&str]| {
        for part in parts {
            assert!(text.contains(part), "{text}\nlacks \"{part}\"");
        }
    };
    fs::write(bench.path("short.csv"), "upper_node,lower_node\n1,2\n3,x\n").expect("pairs");
    has(
        told(&["structure.interface=short.csv"]),
        &["short.csv", "line 3", "lower_node", "\"x\""],
    );
    fs::write(bench.path("other.csv"), "top,bottom\n1,2\n").expect("pairs");
    has(
        told(&["structure.interface=other.csv"]),
        &["other.csv", "upper_node", "top, bottom"],
    );
    has(
        told(&["structure.interface=none.csv"]),
        &["none.csv", "No such file"],
    );
    has(
        told(&["structure.unit.length=mm"]),
        &["joint.size", "structure.unit.length"],
    );
    has(
        told(&["structure.unit.mass=mm"]),
        &["structure.unit.mass", "\"mm\"", "a mass"],
    );
    has(told(&["dynamics.force.at=TIP"]), &["dynamics", "\"TIP\""]);
    has(
        told(&["structure.fixed=CLAMP"]),
        &["structure.fixed", "CLAMP"],
    );
    has(
        told(&["structure.stiffness=files/nodes.csv"]),
        &["nodes.csv"],
    );
    has(
        told(&["structure.depth=60 mm"]),
        &["structure.depth", "matrices"],
    );
    has(told(&["structure.file=files/mass.mtx"]), &["no stiffness"]);
    has(
        told(&["joint.hole.diameter=4 mm"]),
        &["joint.hole", "nodes"],
    );
    has(
        told(&["dynamics.base.acceleration=1 m/s^2"]),
        &["dynamics.base", "oscillator"],
    );
    has(told(&["structure.layer=0 mm"]), &["structure.layer"]);
}

/// Two blocks of 20 x 30 mm in contact, from matrices with files of nodes and pairs.
const BLOCKS: &str = r#"
[joint]
size = ["20 mm", "30 mm"]
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
[contact]
normal_load = "1 kN"
friction_coefficient = 0.4
kn = "400 N/um"
kt = "300 N/um"
[structure]
kind = "matrices"
file = "all.npz"
nodes = "nodes.csv"
unit = { length = "mm", mass = "t", time = "s" }
interface = "pairs.csv"
[dynamics]
force = { amplitude = "0.2 N", at = "1018", direction = "x" }
frequency = ["3 kHz", "20 kHz"]
harmonics = [0, 1, 3]
"#;

fn deck_of_blocks() -> String {
    let bodies = TwoBodies {
        edge: [10.0, 10.0, 5.0],
        counts: [2, 3, 1],
        shift: [0.0, 0.0, 5.0],
    };
    bodies.deck(&[("CLAMP", |body, [_, _, z]| body == 0 && z == 0.0)])
}

/// Writes the files of [`BLOCKS`]: all matrices in one file, and each matrix in a separate file.
fn blocks(bench: &Bench) {
    let deck = deck_of_blocks();
    let path = Path::new("blocks.inp");
    let read = readers::parse(path, deck.as_bytes(), None).expect("a deck");
    let dofs = read.dofs.as_ref().expect("freedoms");
    let dense = |matrix: &Triplets| {
        let mut full = Matrix::zeros(read.size, read.size);
        for &(i, j, value) in &matrix.entries {
            full[(i as usize, j as usize)] += value;
            if i != j {
                full[(j as usize, i as usize)] += value;
            }
        }
        full
    };
    let [stiffness, mass] = [&read.stiffness, &read.mass].map(|m| dense(m.as_ref().expect("both")));
    let scaled = |factor| Matrix::from_fn(read.size, read.size, |i, j| factor * mass[(i, j)]);
    let (damping, none) = (scaled(40.0), scaled(0.0));
    let write = |name: &str, matrices: &[(&str, &Matrix)]| {
        let file = fs::File::create(bench.path(name)).expect("a file");
        npz(matrices, file).expect("written");
    };
    write(
        "all.npz",
        &[("K", &stiffness), ("M", &mass), ("C", &damping)],
    );
    write("none.npz", &[("K", &stiffness), ("M", &mass), ("C", &none)]);
    let fed = scaled(-40.0);
    write("fed.npz", &[("K", &stiffness), ("M", &mass), ("C", &fed)]);
    let lower = |i: usize, j: usize| if i < j { 0.0 } else { stiffness[(i, j)] };
    let half = Matrix::from_fn(read.size, read.size, lower);
    write("half.npz", &[("K", &half), ("M", &mass)]);
    for (name, matrix) in [("K", &stiffness), ("M", &mass), ("C", &damping)] {
        write(&format!("{name}.npz"), &[(name, matrix)]);
    }
    let mut nodes = String::from("node,x,y,z\n");
    for dof in dofs.iter().filter(|dof| dof.direction == 1) {
        let [x, y, z] = read.positions[&dof.node];
        nodes += &format!("{},{x},{y},{z}\n", dof.node);
    }
    bench.write("nodes.csv", nodes);
    let pairs = (1..=12).map(|n| format!("{},{}\n", 1000 + n, 12 + n));
    bench.write(
        "pairs.csv",
        "upper_node,lower_node\n".to_owned() + &pairs.collect::<String>(),
    );
    bench.write("blocks.toml", BLOCKS);
}

/// A damping matrix from files is the only damping if the scene gives no damping ratio.
#[test]
fn with_damping_in_the_files_no_ratio_is_added() {
    let bench = Bench::new();
    blocks(&bench);
    let plan = |sets: &[&str]| {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let did = bench.fretwear(&[&["plan", "blocks.toml"], &sets[..]].concat());
        assert_eq!(did.code(), 0, "{sets:?}: {}", did.stderr());
        did.stdout()
    };
    for (sets, ratio) in [
        (&[][..], None),
        (&["dynamics.damping_ratio=0"], None),
        (
            &["dynamics.damping_ratio=0.003"],
            Some("ratio 0.003 in every mode"),
        ),
        (
            &["structure.file=none.npz"],
            Some("ratio 0.002 in every mode"),
        ),
    ] {
        let said = plan(sets);
        match ratio {
            Some(ratio) => assert!(said.contains(ratio), "{said}"),
            None => assert!(!said.contains("in every mode"), "{said}"),
        }
    }
    let own = BLOCKS.replace(
        "file = \"all.npz\"",
        "stiffness = \"K.npz\"\nmass = \"M.npz\"\ndamping = \"C.npz\"",
    );
    bench.write("blocks.toml", own);
    assert!(!plan(&[]).contains("in every mode"));
}

/// The program rejects damping with negative energy, one triangle of a matrix, and units that contradict the units of a folder.
#[test]
fn matrices_of_no_structure_are_rejected() {
    let bench = Bench::new();
    blocks(&bench);
    let told = |arguments: &[&str]| {
        let did = bench.fretwear(arguments);
        assert_ne!(did.code(), 0, "{arguments:?}");
        did.stdout() + &did.stderr()
    };
    let fed = told(&["run", "blocks.toml", "--set", "structure.file=fed.npz"]);
    assert!(
        fed.contains("the viscous damping feeds some motion"),
        "{fed}"
    );
    let half = told(&["inspect", "half.npz"]);
    assert!(half.contains("one triangle of a matrix"), "{half}");
    fs::create_dir(bench.path("folder")).expect("a folder");
    let deck = readers::parse("blocks.inp".as_ref(), deck_of_blocks().as_bytes(), None);
    let rows = deck.expect("a deck").dofs.expect("freedoms");
    let rows: String = rows
        .iter()
        .map(|dof| format!("{},{}\n", dof.node, dof.direction))
        .collect();
    bench.write("folder/rows.csv", format!("node,direction\n{rows}"));
    for name in ["K.npz", "M.npz"] {
        fs::copy(bench.path(name), bench.path(&format!("folder/{name}"))).expect("copied");
    }
    let about = |length: &str| {
        format!(
            "{{\"layout\": \"fretwear-structure\", \"version\": 1, \"kind\": \"matrices\", \"unit\": {{\"length\": \"{length}\", \"mass\": \"t\", \"time\": \"s\"}}}}"
        )
    };
    let check = ["check", "blocks.toml", "--set", "structure.file=folder"];
    bench.write("folder/structure.json", about("mm"));
    bench.done(&check);
    for (length, part) in [
        ("cm", "differs from the units of the folder"),
        ("mile", "mile"),
    ] {
        bench.write("folder/structure.json", about(length));
        let said = told(&check);
        assert!(said.contains(part), "{said}");
    }
}
