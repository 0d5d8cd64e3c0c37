//! Figures of the structure: the shape of the structure at the resonance, and the mesh of the contact faces.

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::TAU;

use polars::prelude::DataFrame;

use super::super::ReportError;
use super::super::plot::{Axis, Chart, Curve, Mark, style_of_run};
use super::super::quantity::{FORCE, FREQUENCY, LENGTH, four_digits, with_best_unit};
use super::super::run_tables::{numeric_column, text_column};
use super::surface::heading;
use super::{Figure, ReportedRun, ReportedRuns};
use crate::recipe::ContactArray;
use crate::recipe::Port;
use crate::tables::TableName;

/// One millimetre \[m\].
const MM: f64 = 1e-3;
/// Largest drawn displacement, relative to the length of the structure.
const DRAWN: f64 = 0.08;
/// Margin of a drawing on each side, relative to its range.
const MARGIN: f64 = 0.04;
/// Styles of runs: solid ink, dashed, and another one.
const INK: usize = 0;
const DASHED: usize = 1;
const OTHER: usize = 2;

/// Draws the shape of the resonance, and the contact mesh.
pub fn figures(study: &ReportedRuns) -> Result<Vec<Figure>, ReportError> {
    let both = [resonance_shape(study)?, contact_mesh(study)?];
    Ok(both.into_iter().flatten().collect())
}

/// Outline of a structure at rest, and displaced by its first harmonic at the resonance.
struct Shape {
    /// Indices of the points of each line.
    lines: Vec<Vec<usize>>,
    /// Points at rest \[m\].
    positions: Vec<[f64; 3]>,
    /// Displacements when the response point is furthest along its axis \[m\].
    displacement: Vec<[f64; 3]>,
    frequency: f64,
    /// Amplitude at the response point, from the sum of modes and from the run \[m\].
    response: [f64; 2],
}

/// Computes the generalised forces φᵀf of contact and loads on the modes at the resonance.
///
/// Returns the coefficients of the cosine and the sine of the first harmonic \[N kg^-1/2\].
fn modal_forces(run: &ReportedRun, response: &DataFrame, shapes: &Ports) -> Option<Vec<[f64; 2]>> {
    let harmonic = numeric_column(response, "harmonic")?;
    let element = numeric_column(response, "element")?;
    let axis = text_column(response, "axis")?;
    let cosine = numeric_column(response, "force_cosine")?;
    let sine = numeric_column(response, "force_sine")?;
    let mut forces = vec![[0.0; 2]; shapes.modes];
    let mut act = |port: usize, force: [f64; 2]| {
        for (mode, sum) in forces.iter_mut().enumerate() {
            let shape = shapes.at(mode, port);
            *sum = [0, 1].map(|k| sum[k] + shape * force[k]);
        }
    };
    for row in 0..harmonic.len() {
        if harmonic[row] != 1.0 || element[row] < 0.0 {
            continue;
        }
        // Contact forces act against the motion. n is positive if the bodies approach, the port z if they separate.
        let (place, sign) = match axis[row].as_str() {
            "x" => (0, -1.0),
            "y" => (1, -1.0),
            _ => (2, 1.0),
        };
        let port = 3 * element[row] as usize + place;
        act(port, [sign * cosine[row], sign * sine[row]]);
    }
    let loads = &run.tables.recipe().response.as_ref()?.forces;
    for load in loads.iter().filter(|load| load.harmonic == 1) {
        let port = shapes.port_of(&load.port.at, load.port.axis)?;
        let (sine, cosine) = load.phase.sin_cos();
        act(port, [load.amplitude * cosine, -load.amplitude * sine]);
    }
    Some(forces)
}

/// Returns the half range of the first harmonic at a point of the structure \[m\].
fn amplitude_at(response: &DataFrame, at: &Port) -> Option<f64> {
    let (point, axis) = (
        text_column(response, "point")?,
        text_column(response, "axis")?,
    );
    let harmonic = numeric_column(response, "harmonic")?;
    let cosine = numeric_column(response, "displacement_cosine")?;
    let sine = numeric_column(response, "displacement_sine")?;
    let name = ["x", "y", "z"][at.axis];
    let row = (0..point.len())
        .find(|row| point[*row] == at.at && axis[*row] == name && harmonic[*row] == 1.0)?;
    Some(cosine[row].hypot(sine[row]))
}

/// Mode shapes at the ports of a structure.
struct Ports {
    modes: usize,
    count: usize,
    /// Shapes at the ports, mode by mode \[kg^-1/2\].
    shape: Vec<f64>,
    /// Natural frequency of each mode \[Hz\].
    frequency: Vec<f64>,
    points: Vec<String>,
}

impl Ports {
    fn read(run: &ReportedRun) -> Result<Option<Ports>, ReportError> {
        let port = run.tables.run_table(TableName::StructurePort)?;
        let mode = run.tables.run_table(TableName::StructureMode)?;
        Ok(port.zip(mode).and_then(|(port, mode)| {
            let points = text_column(&port, "point")?;
            let (count, shape) = (points.len(), numeric_column(&mode, "shape")?);
            let frequency = numeric_column(&mode, "frequency")?;
            Some(Ports {
                modes: shape.len() / count,
                count,
                shape,
                frequency: frequency.into_iter().step_by(count).collect(),
                points,
            })
        }))
    }

    fn at(&self, mode: usize, port: usize) -> f64 {
        self.shape[mode * self.count + port]
    }

    fn port_of(&self, name: &str, axis: usize) -> Option<usize> {
        let first = self.points.iter().position(|point| point == name)?;
        Some(first + axis)
    }
}

impl Shape {
    /// Computes the shape as a sum of modes under the stored forces. The shape excludes the residual of the truncated
    /// modes.
    fn read(run: &ReportedRun) -> Result<Option<Shape>, ReportError> {
        let last = run.tables.latest();
        let tables = (
            run.tables.run_table(TableName::StructureOutline)?,
            run.tables.run_table(TableName::StructureOutlineMode)?,
            run.tables.iteration_table(last, TableName::Response)?,
            Ports::read(run)?,
        );
        let (Some(outline), Some(modes), Some(response), Some(ports)) = tables else {
            return Ok(None);
        };
        Ok(Shape::compute(run, &outline, &modes, &response, &ports))
    }

    fn compute(
        run: &ReportedRun,
        outline: &DataFrame,
        modes: &DataFrame,
        response: &DataFrame,
        ports: &Ports,
    ) -> Option<Shape> {
        let last = |name: &str| run.column(name)?.last().copied().filter(|f| f.is_finite());
        let frequency = last("resonance_frequency").or_else(|| last("peak_frequency"))?;
        let vibration = run.tables.recipe().response.as_ref()?;
        let omega = TAU * frequency;
        let forces = modal_forces(run, response, ports)?;
        // With e^{iωt}, coefficients c and s correspond to c − is.
        let amplitudes = forces
            .iter()
            .zip(&ports.frequency)
            .map(|([c, s], natural)| {
                let natural = TAU * natural;
                let stiff = natural * natural - omega * omega;
                let damped = 2.0 * vibration.damping_ratio * natural * omega
                    + vibration.loss_factor * natural * natural;
                let size = stiff * stiff + damped * damped;
                [
                    (c * stiff - s * damped) / size,
                    (-s * stiff - c * damped) / size,
                ]
            });
        let amplitudes: Vec<[f64; 2]> = amplitudes.collect();
        let response_port = &vibration.at;
        let port = ports.port_of(&response_port.at, response_port.axis)?;
        let sum = |shape: &dyn Fn(usize) -> f64| {
            let each = amplitudes.iter().enumerate();
            each.fold([0.0; 2], |sum, (mode, q)| {
                [0, 1].map(|k| sum[k] + shape(mode) * q[k])
            })
        };
        let at_response_point = sum(&|mode| ports.at(mode, port));
        let size = at_response_point[0].hypot(at_response_point[1]);
        let phase = at_response_point.map(|part| part / size);
        let columns = |names: [&str; 3], frame: &DataFrame| -> Option<[Vec<f64>; 3]> {
            let [x, y, z] = names.map(|name| numeric_column(frame, name));
            Some([x?, y?, z?])
        };
        let shapes = columns(["shape_x", "shape_y", "shape_z"], modes)?;
        let places = columns(["x", "y", "z"], outline)?;
        let line = numeric_column(outline, "line")?;
        let mut lines: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for (point, line) in line.iter().enumerate() {
            lines.entry(*line as u64).or_default().push(point);
        }
        let count = line.len();
        let displacement = (0..count).map(|point| {
            [0, 1, 2].map(|axis| {
                let [real, imaginary] = sum(&|mode| shapes[axis][mode * count + point]);
                real * phase[0] + imaginary * phase[1]
            })
        });
        Some(Shape {
            displacement: displacement.collect(),
            positions: (0..count)
                .map(|p| [0, 1, 2].map(|k| places[k][p]))
                .collect(),
            lines: lines.into_values().collect(),
            frequency,
            response: [size, amplitude_at(response, response_port)?],
        })
        .filter(|_| size > 0.0)
    }

    /// Returns the largest displacement of the outline \[m\].
    fn largest(&self) -> f64 {
        let sizes = self
            .displacement
            .iter()
            .map(|u| u.iter().map(|x| x * x).sum::<f64>());
        sizes.fold(0.0, f64::max).sqrt()
    }

    /// Returns the magnification of drawn displacements: 1, 2 or 5 times a power of ten.
    fn scale(&self) -> f64 {
        let along = |p: &[f64; 3]| p[0];
        let [low, high] = super::range_of(&self.positions.iter().map(along).collect::<Vec<_>>())
            .unwrap_or([0.0, 1.0]);
        let most = DRAWN * (high - low) / self.largest();
        let power = 10f64.powf(most.log10().floor());
        let steps = [5.0, 2.0, 1.0];
        let step = steps.iter().find(|step| **step * power <= most);
        step.unwrap_or(&1.0) * power
    }

    /// Draws the outline in the plane of two axes, given with their names.
    fn view(&self, title: String, axes: [(usize, &str); 2], scale: f64) -> Chart {
        let curve = |name: &str, style: usize, mark: Mark, scale: f64, line: &Vec<usize>| Curve {
            mark,
            ..Curve::line(
                name,
                style_of_run(style),
                line.iter()
                    .map(|&point| {
                        axes.map(|(axis, _)| {
                            let moved = scale * self.displacement[point][axis];
                            (self.positions[point][axis] + moved) / MM
                        })
                    })
                    .collect(),
            )
        };
        let larger = format!("displaced, magnified {} times", four_digits(scale));
        let mut curves = Vec::new();
        for (k, line) in self.lines.iter().enumerate() {
            // To draw a straight line, the chart only needs the two ends of the line.
            let ends = vec![line[0], line[line.len() - 1]];
            let name = if k == 0 { "at rest" } else { "" };
            curves.push(curve(name, DASHED, Mark::Thin, 0.0, &ends));
        }
        for (k, line) in self.lines.iter().enumerate() {
            let name = if k == 0 { larger.as_str() } else { "" };
            curves.push(curve(name, INK, Mark::Thin, scale, line));
        }
        equal_scale_chart(title, axes.map(|(_, name)| name), curves)
    }
}

/// Creates a chart of positions \[mm\] with the same scale along both axes.
fn equal_scale_chart(title: String, names: [&str; 2], curves: Vec<Curve>) -> Chart {
    let axis = |d: usize| {
        let places = curves.iter().flat_map(|curve| &curve.points);
        let places: Vec<f64> = places.map(|point| point[d]).collect();
        let range = super::range_of(&places).map(|[low, high]| {
            let reach = MARGIN * (high - low);
            [low - reach, high + reach]
        });
        Axis {
            label: format!("{} / mm", names[d]),
            range,
            ..Axis::default()
        }
    };
    Chart {
        x: axis(0),
        y: axis(1),
        title,
        curves,
        equal_scale: true,
        ..Chart::default()
    }
}

fn resonance_shape(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    const ID: &str = "resonance-shape";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for run in &study.runs {
        let Some(shape) = Shape::read(run)? else {
            continue;
        };
        let scale = shape.scale();
        let views = [
            ("seen along the normal of the joint", [(0, "x"), (1, "y")]),
            ("seen from the side", [(0, "x"), (2, "z")]),
        ];
        for (view, axes) in views {
            let chart = shape.view(heading(study, run, view), axes, scale);
            drawings.push(chart.draw());
        }
        let name = if study.is_single() {
            String::new()
        } else {
            format!("{}: ", run.label)
        };
        each.push(format!(
            "{name}{}, largest displacement {}, magnified {} times. At the response point the sum of these modes is {}, and the run has {}",
            with_best_unit(shape.frequency, FREQUENCY),
            with_best_unit(shape.largest(), LENGTH),
            four_digits(scale),
            with_best_unit(shape.response[0], LENGTH),
            with_best_unit(shape.response[1], LENGTH)
        ));
    }
    if drawings.is_empty() {
        return Ok(None);
    }
    Ok(Some(Figure {
        id: ID,
        title: "Shape of the vibration".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "Edges of the bodies at rest, and displaced by the first harmonic when the response point is furthest. The displacement is the \
             sum of the modes of the structure under the loads and the contact forces, from the response used in the last iteration. {}.",
            each.join(". ")
        ),
        query: study.query_once("structure_outline"),
        sources: vec![
            ("structure_outline", vec!["line", "x", "y", "z"]),
            (
                "structure_outline_mode",
                vec!["shape_x", "shape_y", "shape_z"],
            ),
            ("response", vec!["force_cosine", "force_sine"]),
        ],
    }))
}

/// Returns the straight lines of the mesh around the cells of the contact.
fn mesh_lines(array: &ContactArray) -> Vec<Vec<[f64; 2]>> {
    let cells: BTreeSet<[usize; 2]> = array.cells().into_iter().collect();
    let place =
        |line: usize, d: usize| (line as f64 / array.counts[d] as f64 - 0.5) * array.size[d] / MM;
    let mut lines = Vec::new();
    for along in 0..2 {
        let across = 1 - along;
        let (count, rows) = (array.counts[along], array.counts[across]);
        for line in 0..=rows {
            // A mesh line includes the edge if one of the adjacent cells exists.
            let is_edge = |k: usize| {
                let adjacent = [line.checked_sub(1), Some(line).filter(|line| *line < rows)];
                adjacent.into_iter().flatten().any(|adjacent| {
                    let mut cell = [0; 2];
                    (cell[along], cell[across]) = (k, adjacent);
                    cells.contains(&cell)
                })
            };
            let mut begin = None;
            for k in 0..=count {
                let is_present = k < count && is_edge(k);
                match (begin, is_present) {
                    (None, true) => begin = Some(k),
                    (Some(from), false) => {
                        let end = |k: usize| {
                            let mut point = [0.0; 2];
                            (point[along], point[across]) = (place(k, along), place(line, across));
                            point
                        };
                        lines.push(vec![end(from), end(k)]);
                        begin = None;
                    }
                    _ => (),
                }
            }
        }
    }
    lines
}

fn contact_mesh(study: &ReportedRuns) -> Result<Option<Figure>, ReportError> {
    const ID: &str = "contact-mesh";
    let (mut drawings, mut each) = (Vec::new(), Vec::new());
    for run in &study.runs {
        let structure = run.tables.recipe().structure.as_ref();
        let frame = run
            .tables
            .iteration_table(run.tables.latest(), TableName::ContactElement)?;
        let array = structure.and_then(|structure| structure.source.contact_array());
        let (Some(structure), Some(array), Some(frame)) = (structure, array, frame) else {
            continue;
        };
        let columns = ["x", "y", "normal_load"].map(|name| numeric_column(&frame, name));
        let [Some(x), Some(y), Some(load)] = columns else {
            continue;
        };
        let mesh = mesh_lines(&array).into_iter();
        let mut curves: Vec<Curve> = mesh
            .map(|points| Curve {
                mark: Mark::Thin,
                ..Curve::line("", style_of_run(INK), points)
            })
            .collect();
        if let Some(first) = curves.first_mut() {
            first.name = "mesh".to_owned();
        }
        let loaded_count = load.iter().filter(|load| **load > 0.0).count();
        for (name, style, mark, is_loaded) in [
            ("carries load", DASHED, Mark::Points, true),
            ("carries none", OTHER, Mark::Hollow, false),
        ] {
            let elements = (0..load.len()).filter(|e| (load[*e] > 0.0) == is_loaded);
            let points: Vec<[f64; 2]> = elements.map(|e| [x[e] / MM, y[e] / MM]).collect();
            if !points.is_empty() {
                curves.push(Curve {
                    mark,
                    ..Curve::line(name, style_of_run(style), points)
                });
            }
        }
        let title = heading(study, run, "contact elements on the interface");
        let chart = equal_scale_chart(title, ["x", "y"], curves);
        drawings.push(chart.draw());
        let name = if study.is_single() {
            String::new()
        } else {
            format!("{}: ", run.label)
        };
        let place = if structure.contact_ports.are_faces() {
            "faces"
        } else {
            "nodes"
        };
        each.push(format!(
            "{name}{} elements at the {place} of the mesh, {loaded_count} of which carry load; the total load is {}",
            load.len(),
            with_best_unit(load.iter().sum(), FORCE)
        ));
    }
    if drawings.is_empty() {
        return Ok(None);
    }
    let columns = vec!["x", "y", "normal_load"];
    Ok(Some(Figure {
        id: ID,
        title: "Contact mesh".to_owned(),
        drawings,
        states: Vec::new(),
        caption: format!(
            "The finite elements on the contact plane, and the contact elements between the bodies. Loads are static loads at the last \
             iteration. {}.",
            each.join(". ")
        ),
        query: study.query_last("contact_element", &columns),
        sources: vec![("contact_element", columns)],
    }))
}
