//! `fretwear inspect`: describes a structure from its matrix files, or a surface from its map file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use fretwear::structure::StructureError;
use fretwear::structure::frequencies::{Frequencies, lowest_frequencies};
use fretwear::structure::inspection::{
    Units, bodies, inner_nodes_note, mass_by_direction, modal_rows, model_warnings,
    parse_fixed_rows, units, zero_diagonals,
};
use fretwear::structure::matrices::{Asymmetry, Matrices, Role, Triplets};
use fretwear::structure::readers::{self, Input};
use fretwear::surface::readers::{ReadOptions, is_height_map};
use fretwear::units::{self, Dimension};
use serde_json::{Value, json};

use super::inspect_map::inspect_map;
use super::{CliError, Exit};
use crate::terminal::Results;

/// Smallest asymmetry that is reported: more than rounding and the digits of a text file cause.
const UNSYMMETRIC: f64 = 1e-8;
/// Largest number of rows that are listed; otherwise only their number is printed.
const NAMED: usize = 20;
/// Relative difference between the masses along the axes above which a warning is printed.
const SAME_MASS: f64 = 1e-6;

#[derive(Args)]
pub struct InspectArguments {
    /// Matrix files, as `stiffness.mtx mass.mtx`, a folder of fretwear-import, or the map of a surface; give the role
    /// of a file that does not state its role, as in `mass=b.mtx`
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<String>,
    /// Fix nodes or a set before the frequencies are computed, as in `--fixed CLAMP,12-20,31.123`, `row:1-6`,
    /// `boundary`
    #[arg(long, value_name = "SET|NODES", allow_hyphen_values = true)]
    pub fixed: Option<String>,
    /// Number of natural frequencies; 0 computes no frequency
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = parse_modes)]
    pub modes: usize,
    /// Format of the files, instead of the format found from their content
    #[arg(long, value_name = "FORMAT", value_parser = clap::builder::PossibleValuesParser::new(readers::words()))]
    pub format: Option<String>,
    /// Unit of the heights of a map whose file states none, as in `--unit um`
    #[arg(long, value_name = "UNIT", value_parser = parse_length_unit)]
    pub unit: Option<f64>,
    /// Exchange x and y of a map
    #[arg(long)]
    pub transpose: bool,
    /// Print one JSON object
    #[arg(long)]
    pub json: bool,
}

fn parse_length_unit(text: &str) -> Result<f64, String> {
    units::parse_unit(text, Dimension::LENGTH).map_err(|error| error.to_string())
}

/// Largest number of modes. Each mode is a vector with one number per row of the matrices. More than 500 modes would
/// take too much memory.
const MOST_MODES: usize = 500;

fn parse_modes(text: &str) -> Result<usize, String> {
    let modes: usize = text
        .parse()
        .map_err(|_| "it must be a whole number".to_owned())?;
    if modes > MOST_MODES {
        return Err(format!("at most {MOST_MODES} are computed"));
    }
    Ok(modes)
}

/// Results of the inspection of a structure.
struct Inspection {
    matrices: Matrices,
    /// Asymmetry of each matrix.
    off: Vec<(Role, Asymmetry)>,
    frequencies: Option<Frequencies>,
    /// Frequencies with all rows fixed except the modal coordinates.
    of_modal: Option<Frequencies>,
    modal: usize,
    units: Option<Units>,
    warnings: Vec<String>,
    failure: Option<StructureError>,
}

/// Reads the given files and prints a description of the files.
pub fn inspect(arguments: &InspectArguments, out: &mut Results) -> Result<Exit, CliError> {
    if let [file] = &arguments.files[..]
        && arguments.format.is_none()
        && is_height_map(Path::new(file))
    {
        let options = ReadOptions {
            height_unit: arguments.unit,
            transpose: arguments.transpose,
            ..ReadOptions::default()
        };
        return inspect_map(Path::new(file), &options, arguments.json, out);
    }
    let inputs: Vec<Input> = arguments.files.iter().map(|text| input(text)).collect();
    let mut matrices = readers::read(&inputs, arguments.format.as_deref())?;
    matrices.notes.extend(inner_nodes_note(&matrices));
    let mut is_fixed = vec![false; matrices.size];
    if let Some(text) = &arguments.fixed {
        let (rows, notes) = parse_fixed_rows(&matrices, text)?;
        is_fixed = rows;
        matrices.notes.extend(notes);
    }
    let mut failure = None;
    let mut computed =
        |is_fixed: &[bool]| match lowest_frequencies(&matrices, is_fixed, arguments.modes) {
            Ok(frequencies) => frequencies,
            Err(error) => {
                failure.get_or_insert(error);
                None
            }
        };
    let frequencies = computed(&is_fixed);
    let modal = modal_rows(&matrices);
    let count = modal.iter().filter(|m| **m).count();
    let boundary: Vec<bool> = modal.iter().map(|m| !m).collect();
    let of_modal = if count > 0 && boundary != is_fixed {
        computed(&boundary)
    } else {
        None
    };
    let off: Vec<(Role, Asymmetry)> = (Role::ALL.into_iter())
        .filter_map(|role| Some((role, matrices.get(role)?.asymmetry())))
        .collect();
    let inspection = Inspection {
        warnings: warnings(&matrices, &off, frequencies.as_ref(), failure.as_ref()),
        off,
        units: units(&matrices),
        modal: count,
        matrices,
        frequencies,
        of_modal,
        failure,
    };
    if arguments.json {
        out.json(&inspection.json(&arguments.files));
    } else {
        inspection.write(out);
    }
    Ok(inspection
        .failure
        .map_or(Exit::Done, |error| CliError::from(error).exit()))
}

/// Parses `FILE`, or `ROLE=FILE` unless a file has that very name.
fn input(text: &str) -> Input {
    let named = text.split_once('=').and_then(|(word, path)| {
        let role = Role::ALL.into_iter().find(|role| role.name() == word)?;
        Some((role, path))
    });
    match named {
        Some((role, path)) => Input {
            path: PathBuf::from(path),
            role: Some(role),
        },
        None => Input {
            path: PathBuf::from(text),
            role: None,
        },
    }
}

fn warnings(
    matrices: &Matrices,
    off: &[(Role, Asymmetry)],
    frequencies: Option<&Frequencies>,
    failure: Option<&StructureError>,
) -> Vec<String> {
    let mut warnings = Vec::new();
    for (role, off) in off {
        let Some(matrix) = matrices.get(*role) else {
            continue;
        };
        if off.share > UNSYMMETRIC {
            let (i, j) = off.at;
            warnings.push(format!(
                "the {} is not symmetric: {:e} in row {}, column {}, but {:e} in row {}, column {}; the frequencies use its symmetric part",
                role.name(),
                off.values.0,
                row_name(matrices, i),
                row_name(matrices, j),
                off.values.1,
                row_name(matrices, j),
                row_name(matrices, i),
            ));
        }
        let diagonal = matrix.diagonal();
        let negative: Vec<usize> = (0..matrix.size).filter(|&k| diagonal[k] < 0.0).collect();
        if let Some(&first) = negative.first() {
            warnings.push(format!(
                "the {} has {} negative numbers on its diagonal, the first {:e} in row {}",
                role.name(),
                negative.len(),
                diagonal[first],
                row_name(matrices, first)
            ));
        }
    }
    if let Some(missing) = [Role::Stiffness, Role::Mass]
        .into_iter()
        .find(|role| matrices.get(*role).is_none())
    {
        warnings.push(format!(
            "there is no {}: frequencies cannot be computed",
            missing.name()
        ));
    }
    if let Some(frequencies) = frequencies {
        if let Some(square) = frequencies.unstable.first() {
            warnings.push(format!(
                "the stiffness makes {} modes unstable (omega^2 = {square:e}): stiffness and mass may be exchanged, or belong to different structures",
                frequencies.unstable.len()
            ));
        }
        if frequencies.is_stabilized {
            warnings.push("rows without mass also lack stiffness in some direction: a very small stiffness was added there".to_owned());
        }
    }
    let masses: Vec<f64> = mass_by_direction(matrices).into_iter().flatten().collect();
    let (least, most) = (
        masses.iter().copied().fold(f64::INFINITY, f64::min),
        masses.iter().copied().fold(0.0, f64::max),
    );
    if !masses.is_empty() && most - least > SAME_MASS * most {
        warnings.push(
            "the masses along the axes differ: degrees of freedom were removed or condensed, or nodes have local axes".to_owned(),
        );
    }
    warnings.extend(model_warnings(matrices));
    if let Some(error) = failure {
        warnings.push(format!("no frequencies: {error}"));
    }
    warnings
}

/// Returns node and direction of a row, or its number from 1.
fn row_name(matrices: &Matrices, row: usize) -> String {
    match &matrices.dofs {
        Some(dofs) => dofs[row].to_string(),
        None => (row + 1).to_string(),
    }
}

impl Inspection {
    fn matrix(&self, role: Role) -> Option<(&Triplets, Asymmetry)> {
        let off = self.off.iter().find(|off| off.0 == role)?;
        Some((self.matrices.get(role)?, off.1))
    }

    fn zero_mass(&self) -> Vec<usize> {
        self.matrices
            .mass
            .as_ref()
            .map_or(Vec::new(), |mass| zero_diagonals(&self.matrices, mass))
    }

    fn json(&self, files: &[String]) -> Value {
        let matrix_json = |role: Role| -> Option<Value> {
            let (matrix, off) = self.matrix(role)?;
            Some(json!({
                "stored_entries": matrix.entries.len(),
                "is_triangle": matrix.is_triangle,
                "trace": matrix.trace(),
                "largest": matrix.largest(),
                "is_symmetric": off.share <= UNSYMMETRIC,
                "asymmetry": off.share,
                "asymmetry_at": (off.share > 0.0).then(|| [row_name(&self.matrices, off.at.0), row_name(&self.matrices, off.at.1)]),
                "zero_diagonals": zero_diagonals(&self.matrices, matrix).len(),
            }))
        };
        let [x, y, z] = mass_by_direction(&self.matrices);
        let zero_mass = self.zero_mass();
        let frequencies = self.frequencies.as_ref();
        json!({
            "files": files,
            "formats": self.matrices.formats,
            "nodes": self.matrices.dofs.as_ref().map(|_| self.matrices.nodes()),
            "dofs": self.matrices.size,
            "stiffness": matrix_json(Role::Stiffness),
            "mass": matrix_json(Role::Mass),
            "damping": matrix_json(Role::Damping),
            "structural_damping": matrix_json(Role::Hysteretic),
            "mass_by_direction": { "x": x, "y": y, "z": z },
            "zero_mass_diagonals": zero_mass.len(),
            "zero_mass_rows": zero_mass.iter().take(NAMED).map(|&row| row_name(&self.matrices, row)).collect::<Vec<_>>(),
            "modal_coordinates": self.modal,
            "fixed": frequencies.map(|f| f.fixed),
            "held_by_penalty": frequencies.map(|f| f.penalty_fixed),
            "empty_rows": frequencies.map(|f| f.empty),
            "rows_of_bodies_without_mass": frequencies.map(|f| f.massless),
            "is_stiffness_singular": frequencies.map(|f| f.is_singular),
            "rigid_modes": frequencies.map(|f| f.rigid.len()),
            "rigid_frequencies": frequencies.map(|f| &f.rigid),
            "frequencies": frequencies.map(|f| &f.elastic),
            "boundary_held_frequencies": self.of_modal.as_ref().map(|f| &f.elastic),
            "units": self.units.as_ref().map(|u| json!({ "likely": u.likely, "why": u.why })),
            "bodies": bodies(&self.matrices).iter().map(|body| json!({
                "nodes": body.nodes, "mass": body.mass, "centre": body.centre,
            })).collect::<Vec<_>>(),
            "sets": self.sets(),
            "set_sizes": self.sets().iter().map(|name| (name.as_str(), self.matrices.sets[*name].len())).collect::<BTreeMap<_, _>>(),
            "units_given": self.matrices.unit.as_ref().map(|unit| unit.as_ref().map(|unit| {
                json!({ "length": unit.length, "mass": unit.mass, "time": unit.time })
            })),
            "left_out": self.matrices.unread,
            "notes": self.matrices.notes,
            "warnings": self.warnings,
        })
    }

    fn sets(&self) -> Vec<&String> {
        let mut sets: Vec<&String> = self.matrices.sets.keys().collect();
        sets.sort();
        sets
    }

    fn write(&self, out: &mut Results) {
        let matrices = &self.matrices;
        writeln!(out, "{:<20}{}", "format", matrices.formats.join("; "));
        match &matrices.dofs {
            Some(_) => writeln!(
                out,
                "{:<20}{} of {} nodes",
                "freedoms",
                matrices.size,
                matrices.nodes()
            ),
            None => writeln!(
                out,
                "{:<20}{}; no file assigns them to nodes",
                "freedoms", matrices.size
            ),
        }
        for role in Role::ALL {
            let Some((matrix, off)) = self.matrix(role) else {
                continue;
            };
            let form = if matrix.is_triangle {
                "one triangle"
            } else {
                "both triangles"
            };
            let symmetry = match off.share {
                _ if matrix.is_triangle => "symmetric".to_owned(),
                0.0 => "symmetric to the last bit".to_owned(),
                share if share <= UNSYMMETRIC => {
                    format!("symmetric to {share:.1e} of its largest number")
                }
                share => format!("NOT symmetric: by {share:.1e} of its largest number"),
            };
            writeln!(
                out,
                "{:<20}trace {:.10e}, {} entries stored ({form}), {symmetry}",
                role.name(),
                matrix.trace(),
                matrix.entries.len()
            );
        }
        let axes: Vec<String> = (["x", "y", "z"].iter().zip(mass_by_direction(matrices)))
            .filter_map(|(axis, mass)| Some(format!("{:.10e} along {axis}", mass?)))
            .collect();
        if !axes.is_empty() {
            writeln!(out, "{:<20}{}", "total mass", axes.join(", "));
        }
        let bodies = bodies(matrices);
        for body in bodies.iter().take(NAMED) {
            let mass = body
                .mass
                .map_or(String::new(), |m| format!(", mass {m:.10e}"));
            let centre = body.centre.map_or(String::new(), |[x, y, z]| {
                format!(", centre at {x:.6}, {y:.6}, {z:.6}")
            });
            writeln!(out, "{:<20}{} nodes{mass}{centre}", "body", body.nodes);
        }
        if bodies.len() > NAMED {
            writeln!(out, "{:<20}{} more", "", bodies.len() - NAMED);
        }
        let zero_mass = self.zero_mass();
        if !zero_mass.is_empty() {
            let mut names: Vec<String> = zero_mass
                .iter()
                .take(NAMED)
                .map(|&row| row_name(matrices, row))
                .collect();
            if zero_mass.len() > NAMED {
                names.push("…".to_owned());
            }
            writeln!(
                out,
                "{:<20}{} rows: {}",
                "no mass on diagonal",
                zero_mass.len(),
                names.join(" ")
            );
        }
        if self.modal > 0 {
            writeln!(out, "{:<20}{}", "modal coordinates", self.modal);
        }
        if let Some(frequencies) = &self.frequencies {
            for (what, count) in [
                ("fixed by --fixed", frequencies.fixed),
                ("fixed by a penalty", frequencies.penalty_fixed),
                ("empty rows", frequencies.empty),
                ("rows without mass", frequencies.massless),
            ] {
                if count > 0 {
                    writeln!(out, "{what:<20}{count}");
                }
            }
            if !frequencies.rigid.is_empty() {
                let most = frequencies.rigid.iter().copied().fold(0.0, f64::max);
                writeln!(
                    out,
                    "{:<20}{} (up to {most:.1e} Hz by rounding)",
                    "rigid modes",
                    frequencies.rigid.len()
                );
            }
            let singular = if frequencies.is_singular {
                "singular"
            } else {
                "regular"
            };
            writeln!(out, "{:<20}{singular}", "stiffness is");
            write_frequencies("frequencies", frequencies, out);
        }
        if let Some(frequencies) = &self.of_modal {
            write_frequencies("with fixed boundary", frequencies, out);
        }
        if let Some(unit) = &matrices.unit {
            let units_text = match unit {
                Some(unit) => format!("{}, {}, {}", unit.length, unit.mass, unit.time),
                None => "not given: give structure.unit in the scene".to_owned(),
            };
            writeln!(out, "{:<20}{units_text}", "units, given");
        }
        if let Some(units) = &self.units {
            writeln!(
                out,
                "{:<20}{}: {}",
                "units, likely", units.likely, units.why
            );
        }
        if !matrices.sets.is_empty() {
            let sizes = self.sets().into_iter();
            let sizes = sizes.map(|name| format!("{name} ({})", matrices.sets[name].len()));
            writeln!(
                out,
                "{:<20}{}",
                "sets of nodes",
                sizes.collect::<Vec<_>>().join(", ")
            );
        }
        for note in &matrices.notes {
            writeln!(out, "note: {note}");
        }
        for warning in &self.warnings {
            writeln!(out, "warning: {warning}");
        }
    }
}

/// Prints elastic frequencies, in hertz if the unit of time is the second.
fn write_frequencies(what: &str, frequencies: &Frequencies, out: &mut Results) {
    for (mode, hertz) in frequencies.elastic.iter().enumerate() {
        let what = if mode == 0 { what } else { "" };
        writeln!(out, "{what:<20}{:>3}  {hertz:.6} Hz", mode + 1);
    }
}
