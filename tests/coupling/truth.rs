//! Rough blocks that `truth.py` and `unequal.py` mesh down to the cells: tables of these scripts.

use arrow_array::RecordBatch;
use arrow_array::cast::AsArray;
use fretwear::grid::Grid;
use serde_json::Value;

use super::blocks::only;
use super::pressing::{numbers, own, waves};

/// Inputs and results of the joints in a folder.
pub struct Truth {
    folder: &'static str,
    described: Value,
}

/// One cycle of one joint on the finest mesh.
pub struct Cycle {
    /// Amplitude of the head \[m\].
    pub amplitude: f64,
    /// Force at the amplitude \[N\], and energy per cycle \[J\].
    pub force: f64,
    pub energy: f64,
    /// Pressure of each cell before the motion \[Pa\], and energy per cycle and area \[J/m²\].
    pub pressure: Vec<f64>,
    pub wear: Vec<f64>,
}

impl Truth {
    /// Reads a folder beside this source file.
    pub fn read(folder: &'static str) -> Truth {
        let path = own(format!("{folder}/surface.json"));
        let text = std::fs::read_to_string(path).expect("surface.json");
        let described = serde_json::from_str(&text).expect("JSON");
        Truth { folder, described }
    }

    pub fn number(&self, name: &str) -> f64 {
        self.described[name].as_f64().expect("a number")
    }

    /// Grid of the fine contact.
    pub fn grid(&self) -> Grid {
        let pair = |name: &str| [0, 1].map(|k| self.described[name][k].as_f64().expect("a pair"));
        Grid::over(pair("size"), pair("cells").map(|n| n as usize))
    }

    /// Normal load \[N\].
    pub fn load(&self, surface: &str) -> f64 {
        let load = &self.described["surfaces"][surface]["load"];
        load.as_f64().expect("a load")
    }

    /// Heights at the centres of cells, positive towards the other body \[m\].
    pub fn height(&self, surface: &str) -> Vec<f64> {
        let described = &self.described["surfaces"][surface];
        let cut = described["cut"].as_f64().unwrap_or(f64::INFINITY);
        let heights = waves(described, self.grid());
        heights.into_iter().map(|height| height.min(cut)).collect()
    }

    /// Rows of a table for a surface and a share of the friction limit, on the finest mesh. Only rows with pressures of each instant count.
    fn rows(&self, batch: &RecordBatch, surface: &str, part: f64) -> Vec<usize> {
        let text = |name: &str| {
            let column = batch.column_by_name(name)?;
            column.as_string_opt::<i32>()
        };
        let surfaces = text("surface").expect("surfaces");
        let pressures = text("pressure");
        let [parts, meshes] = ["part", "refinement"].map(|name| numbers(batch, name));
        let rows = (0..batch.num_rows()).filter(|&row| {
            let is_solved = pressures.is_none_or(|of| of.value(row) == "solved");
            surfaces.value(row) == surface && parts[row] == part && is_solved
        });
        let rows: Vec<usize> = rows.collect();
        let finest = rows.iter().map(|row| meshes[*row]).fold(0.0, f64::max);
        let rows = rows.into_iter();
        rows.filter(|row| meshes[*row] == finest).collect()
    }

    /// Cycle of a surface at a share of the friction limit.
    pub fn cycle(&self, surface: &str, part: f64) -> Cycle {
        let table = |name: &str| only(&format!("{}/{name}.parquet", self.folder));
        let of = |batch: &RecordBatch, names: &[&str]| {
            let name = names.iter().find(|n| batch.column_by_name(n).is_some());
            numbers(batch, name.expect("a column"))
        };
        let joint = table("joint");
        let [row] = self.rows(&joint, surface, part)[..] else {
            panic!("{surface} at {part}");
        };
        let at = |names: &[&str]| of(&joint, names)[row];
        let force = match joint.column_by_name("force_minus") {
            Some(_) => 0.5 * (at(&["force_plus"]) - at(&["force_minus"])),
            None => at(&["force_x"]),
        };
        let cell = table("cell");
        let grid = self.grid();
        let [i, j] = ["i", "j"].map(|name| numbers(&cell, name));
        let rows = self.rows(&cell, surface, part);
        let field = |names: &[&str]| {
            let values = of(&cell, names);
            let mut field = vec![0.0; grid.len()];
            for &row in &rows {
                field[i[row] as usize * grid.ny + j[row] as usize] = values[row];
            }
            field
        };
        Cycle {
            amplitude: at(&["amplitude"]),
            force,
            energy: at(&["energy"]),
            pressure: field(&["pressure_pressed", "pressure"]),
            wear: field(&["energy"]),
        }
    }
}
