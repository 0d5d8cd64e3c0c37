//! Whole runs of the two blocks that `truth.py` has meshed down to their cells: the structure presses and moves its joint, and what a cycle then
//! dissipates is held against the truth at the same displacement of the head.

use fretwear::tables::{TableName, typed};

use super::truth::Truth;
use crate::support::{Bench, summary, table};

/// Runs in which the force is found that displaces the head as far, and how near is near enough.
const MOST_RUNS: usize = 5;
const NEAR: f64 = 3e-3;

/// A surface of the blocks at a part of what friction carries, with the errors in force, energy and the loads of elements that are allowed.
struct Case {
    surface: &'static str,
    part: f64,
    force: f64,
    energy: f64,
    loads: f64,
}

/// What a run of the blocks found at an amplitude.
struct Found {
    amplitude: f64,
    energy: f64,
    pressure: Vec<f64>,
}

fn run(bench: &Bench, truth: &Truth, surface: &str, force: f64, name: &str) -> Found {
    let grid = truth.grid();
    let load = truth.load(surface);
    bench.write(
        "heights.npy",
        super::pressing::npy(&truth.height(surface, grid), [grid.nx, grid.ny]),
    );
    let text = format!(
        r#"[joint]
size = ["12 mm", "10 mm"]
grid = [{}, {}]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[surface]
kind = "file"
path = "heights.npy"
unit = "m"
detrend = "none"
[contact]
normal_load = "{load} N"
friction_coefficient = {}
[structure]
kind = "mesh"
file = "{}"
unit = {{ length = "mm", mass = "t", time = "s" }}
interface = {{ upper = "TOP", lower = "BOTTOM" }}
[dynamics]
force = {{ amplitude = "{force} N", at = "HEADREF", direction = "x" }}
at = "20 Hz"
damping_ratio = 0
"#,
        grid.nx,
        grid.ny,
        truth.number("friction_coefficient"),
        super::pressing::own("decks/blocks_6x5.inp").display()
    );
    bench.write("blocks.toml", text);
    bench.done(&["run", "blocks.toml", "--run", name, "--quiet"]);
    let root = bench.path(name);
    let fields: typed::ContactField =
        fretwear::tables::TypedTable::of(&table(&root, 0, TableName::ContactField))
            .expect("fields");
    let mut pressure = vec![0.0; grid.len()];
    for (row, p) in fields.pressure.iter().enumerate() {
        pressure[fields.i[row] as usize * grid.ny + fields.j[row] as usize] = *p;
    }
    Found {
        amplitude: summary(&root, 0, "peak_amplitude"),
        energy: summary(&root, 0, "dissipated_energy"),
        pressure,
    }
}

/// The blocks on a mesh of 6 × 5 elements at equal amplitude: forces within 3 %, energy within 18 %, loads of elements within 8 %.
#[test]
fn blocks_press_and_slip_as_their_cells_do() {
    let truth = Truth::read();
    let grid = truth.grid();
    let cases = [
        Case {
            surface: "a",
            part: 0.5,
            force: 0.03,
            energy: 0.18,
            loads: 0.08,
        },
        Case {
            surface: "a",
            part: 0.8,
            force: 0.03,
            energy: 0.18,
            loads: 0.08,
        },
        Case {
            surface: "b",
            part: 0.8,
            force: 0.03,
            energy: 0.18,
            loads: 0.08,
        },
    ];
    let bench = Bench::new();
    for case in cases {
        let finest = truth
            .refinements(case.surface)
            .into_iter()
            .max()
            .expect("a mesh");
        let expected = truth.cycles(case.surface, finest);
        let expected = expected
            .iter()
            .find(|cycle| cycle.part == case.part)
            .expect("a cycle");
        let (mut force, mut before) = (expected.force, None::<(f64, f64)>);
        let mut found = None;
        for number in 0..MOST_RUNS {
            let name = format!("{}{}_{number}", case.surface, case.part);
            let at = run(&bench, &truth, case.surface, force, &name);
            let off = at.amplitude - expected.amplitude;
            let (here, amplitude) = (force, at.amplitude);
            found = Some(at);
            if off.abs() < NEAR * expected.amplitude {
                break;
            }
            force = match before {
                None => force * (1.0 - 0.8 * off / expected.amplitude),
                Some((f, a)) => here - off * (here - f) / (amplitude - a),
            };
            before = Some((here, amplitude));
        }
        let found = found.expect("a run");
        let differ = |found: f64, expected: f64| (found / expected - 1.0).abs();
        let [nx, ny] = truth.elements();
        let element = |cell: usize| {
            let (i, j) = grid.cell(cell);
            i * nx / grid.nx * ny + j * ny / grid.ny
        };
        let mut loads = vec![0.0; nx * ny];
        for (cell, p) in found.pressure.iter().enumerate() {
            loads[element(cell)] += p * grid.cell_area();
        }
        let (whole, load) = (
            loads.iter().sum::<f64>(),
            expected.element_load.iter().sum::<f64>(),
        );
        let pairs = loads.iter().zip(&expected.element_load);
        let loads: f64 = pairs.map(|(a, b)| (a / whole - b / load).abs()).sum();
        let (of_force, of_energy) = (
            differ(force, expected.force),
            differ(found.energy, expected.energy),
        );
        let told = format!(
            "{} {}: force {of_force:.4}, energy {of_energy:.4}, loads {loads:.4}, amplitude {:.4}",
            case.surface,
            case.part,
            found.amplitude / expected.amplitude
        );
        println!("{told}");
        assert!(
            differ(found.amplitude, expected.amplitude) < 2.0 * NEAR,
            "{told}"
        );
        assert!(
            of_force < case.force && of_energy < case.energy && loads < case.loads,
            "{told}"
        );
    }
}
