//! Exports a joint, and the structure that contains the joint, as unstructured grids of VTK for ParaView. Lengths are
//! in metres from the middle of the joint. The axes x and y are in the contact plane, and z points from the lower body
//! to the upper body.

use std::collections::BTreeMap;
use std::io::Write;

use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use vtkio::model::{
    Attribute, Attributes, ByteOrder, CellType, Cells, DataArray, DataSet, UnstructuredGridPiece,
    Version, VertexNumbers, Vtk,
};

use crate::grid::{Grid, Patch};
use crate::tables::{Column, Table, typed};

/// Errors of writing a file.
#[derive(Debug, thiserror::Error)]
pub enum VtuError {
    /// Error of the VTK library.
    #[error("{0}")]
    Vtk(#[from] vtkio::Error),
    /// Error of writing the bytes.
    #[error(transparent)]
    Io(#[from] std::io::Error),
}

/// Points, cells, and fields on both.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct UnstructuredGrid {
    /// Positions of the points \[m\].
    pub points: Vec<[f64; 3]>,
    /// Points of each cell: one makes a vertex, four a quadrangle in their order around it; see
    /// [`UnstructuredGrid::lines`].
    pub cells: Vec<Vec<usize>>,
    /// Whether each cell is a polyline, whatever its number of points.
    pub lines: bool,
    /// Scalars on points, by name.
    pub point_scalars: Vec<(String, Vec<f64>)>,
    /// Vectors on points, by name.
    pub point_vectors: Vec<(String, Vec<[f64; 3]>)>,
    /// Scalars on cells, by name.
    pub cell_scalars: Vec<(String, Vec<f64>)>,
}

impl UnstructuredGrid {
    /// Creates a grid with one rectangle in the contact plane per cell of a joint. Each rectangle has all per-cell
    /// values of `tables`. If a table has no row for a cell, the values of the cell are NaN.
    pub fn joint(patch: &Patch, tables: &[Table]) -> Self {
        let grid = patch.grid;
        let mut joint_grid = UnstructuredGrid {
            points: corners(grid),
            ..UnstructuredGrid::default()
        };
        let mut number = vec![None; grid.len()];
        for cell in (0..grid.len()).filter(|cell| patch.is_in_joint[*cell]) {
            number[cell] = Some(joint_grid.cells.len());
            let (i, j) = grid.cell(cell);
            let corner = |i: usize, j: usize| i * (grid.ny + 1) + j;
            let around = [[0, 0], [1, 0], [1, 1], [0, 1]];
            let around = around.map(|[a, b]| corner(i + a, j + b));
            joint_grid.cells.push(around.to_vec());
        }
        for table in tables {
            let (Ok(i), Ok(j)) = (table.i32("i"), table.i32("j")) else {
                continue;
            };
            for (column, values) in table.columns() {
                let Column::F64(values) = values else {
                    continue;
                };
                let mut field = vec![f64::NAN; joint_grid.cells.len()];
                for ((i, j), value) in i.iter().zip(j).zip(values) {
                    if let Some(cell) = number[grid.index(*i as usize, *j as usize)] {
                        field[cell] = *value;
                    }
                }
                joint_grid.cell_scalars.push((column.name.clone(), field));
            }
        }
        joint_grid
    }

    /// Creates contact elements as points in the contact plane, with their parameters and the harmonics of their
    /// response. `1_cosine` is the coefficient of the cosine of the first harmonic, and `1_sine` is the coefficient of
    /// the sine of the first harmonic. Both coefficients are displacements of the upper body relative to the lower body
    /// along x, y and z.
    pub fn contact_elements(
        elements: &typed::ContactElement,
        response: Option<&typed::Response>,
    ) -> Self {
        let places = elements.x.iter().zip(&elements.y);
        let count = elements.x.len();
        let scalars: [(&str, &[f64]); 5] = [
            ("area", &elements.area),
            ("normal_load", &elements.normal_load),
            ("gap", &elements.gap),
            ("kn", &elements.kn),
            ("kt", &elements.kt),
        ];
        let mut motions: BTreeMap<i32, [Vec<[f64; 3]>; 2]> = BTreeMap::new();
        for (row, element) in response.iter().flat_map(|r| r.element.iter().enumerate()) {
            let (Some(response), Ok(element)) = (response, usize::try_from(*element)) else {
                continue;
            };
            let axis = ["x", "y", "n"]
                .iter()
                .position(|a| *a == response.axis[row]);
            let (Some(axis), true) = (axis, element < count) else {
                continue;
            };
            let motion = motions.entry(response.harmonic[row]);
            let [cosine, sine] =
                motion.or_insert_with(|| [vec![[0.0; 3]; count], vec![[0.0; 3]; count]]);
            // Upper body relative to the lower: n is positive for approach, z for separation.
            let sign = if axis == 2 { -1.0 } else { 1.0 };
            cosine[element][axis] = sign * response.displacement_cosine[row];
            sine[element][axis] = sign * response.displacement_sine[row];
        }
        let named = |(order, [cosine, sine]): (i32, [Vec<[f64; 3]>; 2])| {
            [
                (format!("{order}_cosine"), cosine),
                (format!("{order}_sine"), sine),
            ]
        };
        UnstructuredGrid {
            points: places.map(|(x, y)| [*x, *y, 0.0]).collect(),
            cells: (0..count).map(|k| vec![k]).collect(),
            point_scalars: scalars
                .map(|(name, v)| (name.to_owned(), v.to_vec()))
                .into(),
            point_vectors: motions.into_iter().flat_map(named).collect(),
            ..UnstructuredGrid::default()
        }
    }

    /// Creates the edges of a structure's bodies as lines, with its modes. `mode_7` is mode number 7,
    /// normalised by mass \[kg^-1/2\].
    pub fn outline(outline: &typed::StructureOutline, modes: &typed::StructureOutlineMode) -> Self {
        let mut points: BTreeMap<i32, [f64; 3]> = BTreeMap::new();
        let mut lines: BTreeMap<i32, Vec<i32>> = BTreeMap::new();
        for row in 0..outline.point.len() {
            let at = [outline.x[row], outline.y[row], outline.z[row]];
            points.insert(outline.point[row], at);
            lines
                .entry(outline.line[row])
                .or_default()
                .push(outline.point[row]);
        }
        let number: BTreeMap<i32, usize> = points.keys().copied().zip(0..).collect();
        let mut shapes: BTreeMap<i32, Vec<[f64; 3]>> = BTreeMap::new();
        for row in 0..modes.mode.len() {
            let shape = [modes.shape_x[row], modes.shape_y[row], modes.shape_z[row]];
            let mode_shape = shapes.entry(modes.mode[row]);
            let mode_shape = mode_shape.or_insert_with(|| vec![[0.0; 3]; points.len()]);
            if let Some(point) = number.get(&modes.point[row]) {
                mode_shape[*point] = shape;
            }
        }
        let points_of_line = |line: Vec<i32>| line.iter().map(|point| number[point]).collect();
        UnstructuredGrid {
            cells: lines.into_values().map(points_of_line).collect(),
            points: points.values().copied().collect(),
            lines: true,
            point_vectors: shapes
                .into_iter()
                .map(|(mode, shape)| (format!("mode_{mode}"), shape))
                .collect(),
            ..UnstructuredGrid::default()
        }
    }

    /// Writes the grid as a file of VTK's XML format (`.vtu`).
    ///
    /// # Errors
    /// [`VtuError`].
    pub fn write(&self, title: &str, to: impl Write) -> Result<(), VtuError> {
        let mut offset = 0;
        let offsets = self.cells.iter().map(|cell| {
            offset += cell.len() as u64;
            offset
        });
        let types = self
            .cells
            .iter()
            .map(|cell| match (self.lines, cell.len()) {
                (true, _) => CellType::PolyLine,
                (false, 4) => CellType::Quad,
                (false, _) => CellType::Vertex,
            });
        let cells = Cells {
            cell_verts: VertexNumbers::XML {
                offsets: offsets.collect(),
                connectivity: self.cells.iter().flatten().map(|p| *p as u64).collect(),
            },
            types: types.collect(),
        };
        let scalar = |(name, values): &(String, Vec<f64>)| {
            Attribute::DataArray(DataArray::scalars(name, 1).with_data(values.clone()))
        };
        let vector = |(name, values): &(String, Vec<[f64; 3]>)| {
            Attribute::DataArray(DataArray::vectors(name).with_data(flat(values)))
        };
        let data = Attributes {
            point: self
                .point_scalars
                .iter()
                .map(scalar)
                .chain(self.point_vectors.iter().map(vector))
                .collect(),
            cell: self.cell_scalars.iter().map(scalar).collect(),
        };
        let piece = UnstructuredGridPiece {
            points: flat(&self.points).into(),
            cells,
            data,
        };
        let vtk = Vtk {
            version: Version::new_xml(1, 0),
            title: title.to_owned(),
            byte_order: ByteOrder::LittleEndian,
            data: DataSet::inline(piece),
            file_path: None,
        };
        Ok(vtk.write_xml(to)?)
    }
}

/// Writes a collection for ParaView (`.pvd`): file names and their times. The files must be in the same
/// folder as the collection.
///
/// # Errors
/// [`VtuError::Io`].
pub fn write_series(files: &[(f64, String)], to: impl Write) -> Result<(), VtuError> {
    let mut writer = Writer::new_with_indent(to, b' ', 1);
    writer.write_event(Event::Decl(BytesDecl::new("1.0", None, None)))?;
    let all = writer.create_element("VTKFile");
    let all = all.with_attributes([("type", "Collection"), ("version", "1.0")]);
    all.write_inner_content(|writer| {
        let collection = writer.create_element("Collection");
        collection.write_inner_content(|writer| {
            for (time, file) in files {
                let time = time.to_string();
                let data = writer.create_element("DataSet");
                data.with_attributes([("timestep", time.as_str()), ("file", file)])
                    .write_empty()?;
            }
            Ok(())
        })?;
        Ok(())
    })?;
    Ok(())
}

/// Returns the corners of a grid's cells about its middle. Corner (i, j) is number `i * (ny + 1) + j` \[m\].
fn corners(grid: Grid) -> Vec<[f64; 3]> {
    let [length_x, length_y] = grid.size();
    let corner = |n: usize| {
        let (i, j) = (n / (grid.ny + 1), n % (grid.ny + 1));
        let along = |k: usize, side: f64, length: f64| k as f64 * side - 0.5 * length;
        [
            along(i, grid.dx, length_x),
            along(j, grid.dy, length_y),
            0.0,
        ]
    };
    (0..(grid.nx + 1) * (grid.ny + 1)).map(corner).collect()
}

fn flat(vectors: &[[f64; 3]]) -> Vec<f64> {
    vectors.iter().flatten().copied().collect()
}
