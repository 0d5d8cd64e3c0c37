//! The small joints that `truth.py` has meshed down to their cells, as that script wrote them.

use std::fs::File;
use std::path::{Path, PathBuf};

use arrow_array::cast::AsArray;
use arrow_array::types::{Float64Type, Int64Type};
use fretwear::grid::Grid;
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use serde_json::Value;

/// The joints: all that is needed to set them up, and what came out.
pub struct Truth {
    folder: PathBuf,
    pub described: Value,
}

/// One cycle of one joint.
#[derive(Debug, Clone)]
pub struct Cycle {
    /// Amplitude of the head \[m\], and its force in parts of the friction limit.
    pub amplitude: f64,
    pub part: f64,
    /// Force at the amplitude \[N\], energy of a cycle \[J\].
    pub force: f64,
    pub energy: f64,
    /// Normal load of each contact element, 6 × 5 of them \[N\].
    pub element_load: Vec<f64>,
    /// Energy of a cycle of each cell over its area \[J/m²\].
    pub wear: Vec<f64>,
}

/// The columns of a table as numbers, by the names asked for, with the surface of each row.
fn columns(path: &Path, names: &[&str]) -> (Vec<String>, Vec<Vec<f64>>) {
    let file = File::open(path).expect("a table of the truth");
    let batches = ParquetRecordBatchReaderBuilder::try_new(file)
        .and_then(|builder| builder.build())
        .expect("Parquet");
    let mut surfaces = Vec::new();
    let mut columns = vec![Vec::new(); names.len()];
    for batch in batches {
        let batch = batch.expect("a batch");
        let column = |name: &str| batch.column_by_name(name).expect("a column").clone();
        let surface = column("surface");
        surfaces.extend(
            surface
                .as_string::<i32>()
                .iter()
                .flatten()
                .map(str::to_owned),
        );
        for (values, name) in columns.iter_mut().zip(names) {
            let column = column(name);
            match column.as_primitive_opt::<Float64Type>() {
                Some(numbers) => values.extend(numbers.values()),
                None => {
                    let numbers = column.as_primitive::<Int64Type>().values();
                    values.extend(numbers.iter().map(|n| *n as f64));
                }
            }
        }
    }
    (surfaces, columns)
}

impl Truth {
    /// That beside this source, or of the folder that `FRETWEAR_SMALL_JOINTS` names.
    pub fn read() -> Truth {
        let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/coupling/truth");
        let folder = std::env::var_os("FRETWEAR_SMALL_JOINTS").map_or(own, PathBuf::from);
        let text = std::fs::read_to_string(folder.join("surface.json")).expect("surface.json");
        Truth {
            described: serde_json::from_str(&text).expect("JSON"),
            folder,
        }
    }

    pub fn number(&self, name: &str) -> f64 {
        self.described[name].as_f64().expect("a number")
    }

    fn pair(&self, name: &str) -> [f64; 2] {
        [0, 1].map(|k| self.described[name][k].as_f64().expect("two numbers"))
    }

    /// The cells of the fine contact.
    pub fn grid(&self) -> Grid {
        Grid::over(self.pair("size"), self.pair("cells").map(|n| n as usize))
    }

    /// Contact elements along x and y.
    pub fn elements(&self) -> [usize; 2] {
        self.pair("elements").map(|n| n as usize)
    }

    /// Names of the surfaces.
    pub fn surfaces(&self) -> Vec<String> {
        let surfaces = self.described["surfaces"].as_object().expect("an object");
        surfaces.keys().cloned().collect()
    }

    fn of_surface(&self, surface: &str, name: &str) -> f64 {
        let number = self.described["surfaces"][surface][name].as_f64();
        number.expect("a number of a surface")
    }

    pub fn load(&self, surface: &str) -> f64 {
        self.of_surface(surface, "load")
    }

    /// Heights at the centres of cells, positive towards the other body \[m\].
    pub fn height(&self, surface: &str, grid: Grid) -> Vec<f64> {
        let described = &self.described["surfaces"][surface];
        let numbers = |value: &Value| -> Vec<f64> {
            let values = value.as_array().expect("a list");
            values
                .iter()
                .map(|v| v.as_f64().expect("a number"))
                .collect()
        };
        let waves: Vec<Vec<f64>> = described["wave_numbers"]
            .as_array()
            .expect("a list")
            .iter()
            .map(numbers)
            .collect();
        let phases = numbers(&described["phases"]);
        let amplitude = self.of_surface(surface, "amplitude");
        let cut = described["cut"].as_f64().unwrap_or(f64::INFINITY);
        (0..grid.len())
            .map(|cell| {
                let (i, j) = grid.cell(cell);
                let (x, y) = grid.centre(i, j);
                let waves = waves.iter().zip(&phases);
                let sum: f64 = waves
                    .map(|(k, phase)| (k[0] * x + k[1] * y + phase).cos())
                    .sum();
                (amplitude * sum).min(cut)
            })
            .collect()
    }

    /// Meshes that a surface was computed on, by how many of their elements a cell has along an axis, ascending.
    pub fn refinements(&self, surface: &str) -> Vec<usize> {
        let [refinements] = &self.read_of(surface, "joint", &["refinement"])[..] else {
            panic!("one column");
        };
        let mut found: Vec<usize> = refinements.iter().map(|r| *r as usize).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn read_of(&self, surface: &str, table: &str, names: &[&str]) -> Vec<Vec<f64>> {
        let path = self.folder.join(format!("{table}.parquet"));
        let (surfaces, columns) = columns(&path, names);
        let rows: Vec<usize> = (0..surfaces.len())
            .filter(|&r| surfaces[r] == surface)
            .collect();
        let of_surface = columns.iter();
        of_surface
            .map(|c| rows.iter().map(|&r| c[r]).collect())
            .collect()
    }

    /// The cycles of a surface on one of its meshes, by amplitude.
    pub fn cycles(&self, surface: &str, refinement: usize) -> Vec<Cycle> {
        let read = |table: &str, names: &[&str]| self.read_of(surface, table, names);
        let joint = read(
            "joint",
            &["refinement", "amplitude", "part", "force_x", "energy"],
        );
        let element = read("element", &["refinement", "amplitude", "normal_load"]);
        let cell = read("cell", &["refinement", "amplitude", "energy"]);
        let chosen = |table: &[Vec<f64>], amplitude: f64, column: usize| -> Vec<f64> {
            let rows = (0..table[0].len())
                .filter(|&r| table[0][r] == refinement as f64 && table[1][r] == amplitude);
            rows.map(|r| table[column][r]).collect()
        };
        let rows = (0..joint[0].len()).filter(|&r| joint[0][r] == refinement as f64);
        let of = |r: usize| Cycle {
            amplitude: joint[1][r],
            part: joint[2][r],
            force: joint[3][r],
            energy: joint[4][r],
            element_load: chosen(&element, joint[1][r], 2),
            wear: chosen(&cell, joint[1][r], 2),
        };
        rows.map(of).collect()
    }
}
