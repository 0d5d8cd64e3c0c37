//! Tests of the static pressure in the joint of a structure. Runs are compared with plates that `plates.py` meshes down to the cells, and
//! with each other.

use std::fs::File;
use std::path::{Path, PathBuf};

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int32Type, Int64Type};
use fretwear::contact::nodes::Interpolation;
use fretwear::grid::Grid;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;

use crate::support::Bench;

const SIZE: [f64; 2] = [48e-3, 36e-3];
const CELLS: [usize; 2] = [96, 72];
const LOAD: f64 = 10e3;
/// Width of a ring around the axis of the pads \[m\].
const RING: f64 = 3e-3;

pub fn own(path: impl AsRef<Path>) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/coupling")
        .join(path)
}

pub fn batches(path: &Path) -> Vec<RecordBatch> {
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let reader = ParquetRecordBatchReaderBuilder::try_new(file)
        .and_then(|b| b.with_batch_size(1 << 20).build());
    reader
        .expect("Parquet")
        .map(|batch| batch.expect("a batch"))
        .collect()
}

pub fn numbers(batch: &RecordBatch, name: &str) -> Vec<f64> {
    let column = batch.column_by_name(name).expect("a column");
    if let Some(values) = column.as_primitive_opt::<Float64Type>() {
        return values.values().to_vec();
    }
    if let Some(values) = column.as_primitive_opt::<Int32Type>() {
        return values.values().iter().map(|v| f64::from(*v)).collect();
    }
    let values = column.as_primitive::<Int64Type>().values();
    values.iter().map(|v| *v as f64).collect()
}

/// Reads the pressures of cells from a table with the columns i, j and pressure \[Pa\].
fn pressure_of(batch: &RecordBatch, rows: impl Fn(usize) -> bool, pressure: &mut [f64]) {
    let [i, j, p] = ["i", "j", "pressure"].map(|name| numbers(batch, name));
    for row in (0..batch.num_rows()).filter(|row| rows(*row)) {
        pressure[i[row] as usize * CELLS[1] + j[row] as usize] = p[row];
    }
}

/// Pressure of `plates.py` on its finest mesh \[Pa\].
fn truth(pad: &str, surface: &str) -> Vec<f64> {
    let mut pressure = vec![0.0; CELLS[0] * CELLS[1]];
    let found = batches(&own("plates/cell.parquet"));
    let refinements = |batch: &RecordBatch| -> Vec<Option<f64>> {
        let text = |name: &str| batch.column_by_name(name).expect("a column").clone();
        let (pads, surfaces) = (text("pad"), text("surface"));
        let (pads, surfaces) = (pads.as_string::<i32>(), surfaces.as_string::<i32>());
        let all = numbers(batch, "refinement").into_iter().enumerate();
        let is_meant = |row: usize| pads.value(row) == pad && surfaces.value(row) == surface;
        all.map(|(row, refinement)| is_meant(row).then_some(refinement))
            .collect()
    };
    let finest = found
        .iter()
        .flat_map(refinements)
        .flatten()
        .fold(0.0, f64::max);
    for batch in &found {
        let of = refinements(batch);
        pressure_of(batch, |row| of[row] == Some(finest), &mut pressure);
    }
    assert!(pressure.iter().any(|p| *p > 0.0), "{pad} {surface}");
    pressure
}

/// Heights of the plates' rough surface at the centres of the cells \[m\], positive towards the other body.
fn heights() -> Vec<f64> {
    let text = std::fs::read_to_string(own("plates/plates.json")).expect("plates.json");
    let described: Value = serde_json::from_str(&text).expect("JSON");
    waves(&described["surfaces"]["rough"], Grid::over(SIZE, CELLS))
}

/// Sum of the waves of a surface at the centres of the cells \[m\].
pub fn waves(surface: &Value, grid: Grid) -> Vec<f64> {
    let number = |value: &Value| value.as_f64().expect("a number");
    let list = |name: &str| surface[name].as_array().expect("a list").iter();
    let waves: Vec<[f64; 3]> = list("wave_numbers")
        .zip(list("phases"))
        .map(|(k, phase)| [number(&k[0]), number(&k[1]), number(phase)])
        .collect();
    let amplitude = number(&surface["amplitude"]);
    let height = |cell: usize| {
        let (i, j) = grid.cell(cell);
        let (x, y) = grid.centre(i, j);
        let terms = waves
            .iter()
            .map(|[k, l, phase]| (k * x + l * y + phase).cos());
        amplitude * terms.sum::<f64>()
    };
    (0..grid.len()).map(height).collect()
}

/// Values of the cells as an NPY file.
pub fn npy(values: &[f64], cells: [usize; 2]) -> Vec<u8> {
    let header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}",
        cells[0], cells[1]
    );
    let length = (10 + header.len() + 1).next_multiple_of(64) - 10;
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((length as u16).to_le_bytes());
    bytes.extend(format!("{header:<width$}\n", width = length - 1).bytes());
    values.iter().for_each(|v| bytes.extend(v.to_le_bytes()));
    bytes
}

/// Two plates with a file of surface heights.
struct Plates {
    bench: Bench,
}

impl Plates {
    fn new(heights: &[f64]) -> Plates {
        let bench = Bench::new();
        bench.write("heights.npy", npy(heights, CELLS));
        Plates { bench }
    }

    /// Writes a deck with replaced texts.
    fn deck(&self, name: &str, changes: &[(&str, &str)]) {
        let mut text = std::fs::read_to_string(own(format!("decks/{name}"))).expect("a deck");
        for (from, to) in changes {
            assert!(text.contains(from), "{from} in {name}");
            text = text.replace(from, to);
        }
        self.bench.write("plates.inp", text);
    }

    /// Runs the scene with a key for the preload and further settings.
    fn run(&self, run: &str, presses: &str, sets: &[&str]) -> Result<Vec<f64>, String> {
        self.bench.write(
            "plates.toml",
            format!(
                r#"[joint]
size = ["48 mm", "36 mm"]
grid = [{}, {}]
[material]
youngs_modulus = "210 GPa"
poisson_ratio = 0.3
density = "7850 kg/m^3"
[surface]
kind = "file"
path = "heights.npy"
unit = "m"
detrend = "none"
[contact]
{presses}
friction_coefficient = 0.5
[structure]
kind = "mesh"
file = "plates.inp"
unit = {{ length = "mm", mass = "t", time = "s" }}
interface = {{ upper = "TOP", lower = "BOTTOM" }}
[dynamics]
force = {{ amplitude = "0.5 N", at = "TIP", direction = "z" }}
frequency = ["8 kHz", "30 kHz"]
[fidelity]
normal_tolerance = 1e-8
"#,
                CELLS[0], CELLS[1]
            ),
        );
        let mut arguments = vec![
            "run",
            "plates.toml",
            "--run",
            run,
            "--until",
            "static_contact",
            "--quiet",
        ];
        sets.iter().for_each(|set| arguments.extend(["--set", set]));
        let did = self.bench.fretwear(&arguments);
        if did.code() != 0 {
            return Err(did.stderr());
        }
        let mut pressure = vec![0.0; CELLS[0] * CELLS[1]];
        let table = self
            .bench
            .path(run)
            .join("staging/wear_iteration=0/static_contact.contact_field.parquet");
        for batch in batches(&table) {
            pressure_of(&batch, |_| true, &mut pressure);
        }
        Ok(pressure)
    }

    fn pressed(&self, run: &str, presses: &str, sets: &[&str]) -> Vec<f64> {
        self.run(run, presses, sets)
            .unwrap_or_else(|error| panic!("{error}"))
    }
}

const INNER: &str = r#"preload = { force = "10 kN", head = "HEAD", nut = "NUT" }"#;
const EDGE: &str = r#"preload = { force = "10 kN", head = "HEAD_EDGE", nut = "NUT_EDGE" }"#;

/// Loads of rings around the axis of a pad \[N\].
fn rings(pressure: &[f64], centre: [f64; 2]) -> Vec<f64> {
    let grid = Grid::over(SIZE, CELLS);
    let mut rings = vec![0.0; 20];
    for (cell, p) in pressure.iter().enumerate() {
        let (i, j) = grid.cell(cell);
        let (x, y) = grid.centre(i, j);
        // A cell on the border of two rings contributes to both rings.
        const PARTS: usize = 8;
        for part in 0..PARTS * PARTS {
            let within = |k: usize, side: f64| ((k as f64 + 0.5) / PARTS as f64 - 0.5) * side;
            let (a, b) = (within(part / PARTS, grid.dx), within(part % PARTS, grid.dy));
            let ring = (x + a - centre[0]).hypot(y + b - centre[1]) / RING;
            rings[ring as usize] += p * grid.cell_area() / (PARTS * PARTS) as f64;
        }
    }
    rings
}

/// Sum of the differences of the loads of contact elements over the load.
fn elements_off(found: &[f64], truth: &[f64], edge: f64) -> f64 {
    let counts = SIZE.map(|side| (side / edge).round() as usize);
    let interpolation = Interpolation::new(Grid::over(SIZE, CELLS), counts);
    let area = interpolation.grid().cell_area();
    let [a, b] = [found, truth].map(|pressure| interpolation.apply_transpose(pressure));
    let pairs = a.iter().zip(&b);
    pairs.map(|(a, b)| (a - b).abs() * area).sum::<f64>() / LOAD
}

/// Largest difference of two pressures over the largest pressure.
fn off(found: &[f64], expected: &[f64]) -> f64 {
    let peak = expected.iter().fold(0.0_f64, |m, p| m.max(*p));
    let pairs = found.iter().zip(expected);
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / peak
}

/// The joint consists of two free plates of 8 mm, with pads outside its centre. The load of each ring differs by at most 6 % of the total
/// load with elements half as long as the plate thickness, and by 2 % with a quarter. The loads of elements of 3 mm differ by at most 14 %.
#[test]
fn free_plates_are_pressed_where_their_pads_are() {
    let flat = vec![0.0; CELLS[0] * CELLS[1]];
    for (surface, heights) in [("smooth", flat), ("rough", heights())] {
        let plates = Plates::new(&heights);
        for (edge, of_ring, of_elements) in [
            (4e-3_f64, 0.06, 0.14),
            (3e-3, 0.06, 0.14),
            (2e-3, 0.02, 0.14),
        ] {
            plates.deck(&format!("plates_{}.inp", (edge * 1e3).round()), &[]);
            for (pad, presses, centre) in [
                ("inner", INNER, [-6e-3, 0.0]),
                ("edge", EDGE, [6e-3, 12e-3]),
            ] {
                let run = format!("{surface}{edge}{pad}");
                let found = plates.pressed(&run, presses, &[]);
                let truth = truth(pad, surface);
                let pairs = rings(&found, centre).into_iter().zip(rings(&truth, centre));
                let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max) / LOAD;
                let loads = elements_off(&found, &truth, edge);
                println!("{surface} {edge} {pad}: ring {worst:.4}, elements {loads:.4}");
                assert!(
                    worst < of_ring,
                    "{surface} {edge} {pad}: the load of a ring differs by {worst} of the total load"
                );
                assert!(
                    loads < of_elements,
                    "{surface} {edge} {pad}: the loads of elements differ by {loads} of the total load"
                );
            }
        }
    }
}

/// The static pressure does not depend on masses, on the number of modes or on statically determinate supports. The pressure does not
/// depend on the choice of the upper body or on a tilt of the heights, which free plates follow.
#[test]
fn pressures_are_those_of_statics_alone() {
    let heights = heights();
    let plates = Plates::new(&heights);
    plates.deck("plates_4.inp", &[]);
    let expected = plates.pressed("expected", INNER, &[]);
    for modes in [6, 60] {
        let found = plates.pressed(
            &format!("m{modes}"),
            INNER,
            &[&format!("dynamics.modes={modes}")],
        );
        let apart = off(&found, &expected);
        assert!(apart < 1e-4, "{modes} modes: {apart}");
    }
    for density in ["7.85e-10", "7.85e-08"] {
        plates.deck("plates_4.inp", &[("7.85e-09", density)]);
        let apart = off(&plates.pressed(density, INNER, &[]), &expected);
        assert!(apart < 1e-4, "{density}: {apart}");
    }
    // The lower plate has supports at three corners, in 3, 2 and 1 directions.
    let supported = "*BOUNDARY\n1, 1, 3\n28, 3, 3\n361, 2, 3\n*SOLID SECTION, ELSET=LOWER";
    plates.deck(
        "plates_4.inp",
        &[("*SOLID SECTION, ELSET=LOWER", supported)],
    );
    let apart = off(&plates.pressed("supported", INNER, &[]), &expected);
    assert!(apart < 1e-6, "supported: {apart}");
    plates.deck("plates_4.inp", &[]);
    let grid = Grid::over(SIZE, CELLS);
    // Seen from below, y is reversed.
    let turned = |values: &[f64]| -> Vec<f64> {
        let cells = (0..grid.len()).map(|cell| grid.cell(cell));
        cells
            .map(|(i, j)| values[i * grid.ny + grid.ny - 1 - j])
            .collect()
    };
    plates
        .bench
        .write("heights.npy", npy(&turned(&heights), CELLS));
    let exchange = "structure.interface={ upper = \"BOTTOM\", lower = \"TOP\" }";
    let found = plates.pressed("exchanged", INNER, &[exchange]);
    let apart = off(&turned(&found), &expected);
    assert!(apart < 1e-6, "exchanged: {apart}");
    let tilted = heights.iter().enumerate().map(|(cell, height)| {
        let (i, j) = grid.cell(cell);
        let (x, y) = grid.centre(i, j);
        height + 1e-6 + 1e-4 * x - 2e-4 * y
    });
    let tilted: Vec<f64> = tilted.collect();
    plates.bench.write("heights.npy", npy(&tilted, CELLS));
    let apart = off(&plates.pressed("tilted", INNER, &[]), &expected);
    assert!(apart < 1e-5, "tilted: {apart}");
}

/// A larger modulus with a proportionally larger load gives proportional pressures. The program rejects a structure that is stiffer than
/// [material].
#[test]
fn a_structure_is_of_the_material_of_its_joint() {
    let heights = heights();
    let plates = Plates::new(&heights);
    plates.deck("plates_4.inp", &[]);
    let expected = plates.pressed("expected", INNER, &[]);
    plates.deck("plates_4.inp", &[("210000, 0.3", "210000e6, 0.3")]);
    let strong = INNER.replace("10 kN", "1e10 N");
    let found = plates.pressed("strong", &strong, &["material.youngs_modulus='210e6 GPa'"]);
    let scaled: Vec<f64> = found.iter().map(|p| p * 1e-6).collect();
    let differ = off(&scaled, &expected);
    assert!(differ < 1e-6, "{differ}");
    plates.deck("plates_4.inp", &[("210000, 0.3", "420000, 0.3")]);
    let refused = plates
        .run("other", INNER, &[])
        .expect_err("the structure has another modulus");
    assert!(
        refused.contains("[material]") && refused.contains("0.5"),
        "{refused}"
    );
}

/// Constant forces press the joint like a preload, and the pressure balances the forces. The program rejects constant forces without
/// balance, and names their key.
#[test]
fn constant_forces_press_the_joint() {
    let plates = Plates::new(&vec![0.0; CELLS[0] * CELLS[1]]);
    plates.deck("plates_4.inp", &[]);
    let little = INNER.replace("10 kN", "1 N");
    let drive = "{ amplitude = '0.5 N', at = 'TIP', direction = 'z' }";
    let constant = |amplitude: &str, at: &str| {
        format!("{{ amplitude = '{amplitude}', at = '{at}', direction = 'z', harmonic = 0 }}")
    };
    let (down, up) = (constant("-5 kN", "HEAD"), constant("5 kN", "NUT"));
    let set = format!("dynamics.force=[{drive}, {down}, {up}]");
    let found = plates.pressed("constant", &little, &[&set]);
    let load = found.iter().sum::<f64>() * Grid::over(SIZE, CELLS).cell_area();
    assert!((load / 5001.0 - 1.0).abs() < 1e-6, "{load}");
    let set = format!("dynamics.force=[{drive}, {up}]");
    let error = plates
        .run("one", &little, &[&set])
        .expect_err("a force without balance");
    assert!(
        error.contains("the constant forces of dynamics.force"),
        "{error}"
    );
}

/// The error names the wrong key if the joint has no valid preload.
#[test]
fn what_cannot_press_is_refused() {
    let plates = Plates::new(&heights());
    plates.deck("plates_4.inp", &[]);
    let both = format!("{INNER}\nnormal_load = \"10 kN\"");
    let punch = format!("{INNER}\npressing = \"punch\"");
    let turns = format!("{INNER}\nrotation = \"fixed\"");
    let total = format!("{INNER}\nstiffness = \"total\"");
    let bolt = "normal_load = \"10 kN\"\nbolt_stiffness = \"500 N/um\"".to_owned();
    let one = INNER.replace("NUT", "HEAD");
    let nowhere = INNER.replace("NUT", "NOWHERE");
    for (presses, expected) in [
        (both, "contact.normal_load"),
        (punch, "contact.preload"),
        (turns, "contact.rotation"),
        (total, "contact.preload"),
        (bolt + "\n", "contact.preload"),
        (one, "coincide"),
        (nowhere, "NOWHERE"),
    ] {
        let error = plates.run(
            "refused",
            &presses,
            &["wear.coefficient='1e3 um^3/J'", "wear.cycles=10"],
        );
        let error = error.expect_err(&presses);
        assert!(error.contains(expected), "{presses}: {error}");
    }
}
