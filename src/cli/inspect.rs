//! `fretwear inspect`: what files of matrices say of their structure, or the file of a map of its surface.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use clap::Args;
use fretwear::structure::StructureError;
use fretwear::structure::frequencies::{Frequencies, lowest_frequencies};
use fretwear::structure::inspection::{
    Units, bodies, fixed, inner_nodes_note, mass_by_direction, modal_rows, suspicions, units,
    zero_diagonals,
};
use fretwear::structure::matrices::{Asymmetry, Matrices, Role, Triplets};
use fretwear::structure::readers::{self, Input};
use fretwear::surface::readers::{ReadOptions, is_of_map};
use fretwear::units::{self, Dimension};
use serde_json::{Value, json};

use super::inspect_map::inspect_map;
use super::{CliError, Exit};
use crate::terminal::Results;

/// What is said to be unsymmetric: more than rounding and the digits of a text leave.
const UNSYMMETRIC: f64 = 1e-8;
/// Rows that are named one by one; of more their number is enough.
const NAMED: usize = 20;
/// Masses along the axes may differ by so much: more is said.
const SAME_MASS: f64 = 1e-6;

#[derive(Args)]
pub struct InspectArguments {
    /// Files of the matrices, as `stiffness.mtx mass.mtx`, a folder of fretwear-import, or the map of a surface; what neither a file nor its name says, as in `mass=b.mtx`
    #[arg(required = true, value_name = "FILE")]
    pub files: Vec<String>,
    /// Hold nodes or a set before the frequencies are computed, as in `--fixed CLAMP,12-20,31.123`, `row:1-6`, `boundary`
    #[arg(long, value_name = "SET|NODES", allow_hyphen_values = true)]
    pub fixed: Option<String>,
    /// Natural frequencies to compute; none with 0
    #[arg(long, value_name = "N", default_value_t = 10, value_parser = parse_modes)]
    pub modes: usize,
    /// The format, where the content of the files is not to decide
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

/// Each mode is a vector of all rows; more than this are no inspection.
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

/// All that is said.
struct Told {
    matrices: Matrices,
    /// How far the matrices are from symmetric.
    off: Vec<(Role, Asymmetry)>,
    frequencies: Option<Frequencies>,
    /// With everything held that is no modal coordinate.
    of_modal: Option<Frequencies>,
    modal: usize,
    units: Option<Units>,
    warnings: Vec<String>,
    failure: Option<StructureError>,
}

/// Reads the files and says what they are.
pub fn inspect(arguments: &InspectArguments, out: &mut Results) -> Result<Exit, CliError> {
    if let [file] = &arguments.files[..]
        && arguments.format.is_none()
        && is_of_map(Path::new(file))
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
        let (rows, notes) = fixed(&matrices, text)?;
        is_fixed = rows;
        matrices.notes.extend(notes);
    }
    let mut failure = None;
    let mut computed =
        |is_fixed: &[bool]| match lowest_frequencies(&matrices, is_fixed, arguments.modes) {
            Ok(found) => found,
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
    let told = Told {
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
        out.json(&told.json(&arguments.files));
    } else {
        told.write(out);
    }
    Ok(told
        .failure
        .map_or(Exit::Done, |error| CliError::from(error).exit()))
}

/// `FILE`, or `ROLE=FILE` unless a file has that very name.
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
            "there is no {}: nothing is said of frequencies",
            missing.name()
        ));
    }
    if let Some(found) = frequencies {
        if let Some(square) = found.unstable.first() {
            warnings.push(format!(
                "the stiffness drives {} modes away (omega^2 = {square:e}): stiffness and mass may be exchanged, or not of one structure",
                found.unstable.len()
            ));
        }
        if found.is_steadied {
            warnings.push("rows without mass have no stiffness either in some direction: a trace of stiffness was added there".to_owned());
        }
    }
    let masses: Vec<f64> = mass_by_direction(matrices).into_iter().flatten().collect();
    let (least, most) = (
        masses.iter().copied().fold(f64::INFINITY, f64::min),
        masses.iter().copied().fold(0.0, f64::max),
    );
    if !masses.is_empty() && most - least > SAME_MASS * most {
        warnings.push(
            "the masses along the axes differ: freedoms were removed or condensed, or nodes have axes of their own".to_owned(),
        );
    }
    warnings.extend(suspicions(matrices));
    if let Some(error) = failure {
        warnings.push(format!("no frequencies: {error}"));
    }
    warnings
}

/// Node and direction, or the number of the row from 1.
fn row_name(matrices: &Matrices, row: usize) -> String {
    match &matrices.dofs {
        Some(dofs) => dofs[row].to_string(),
        None => (row + 1).to_string(),
    }
}

impl Told {
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
        let of = |role: Role| -> Option<Value> {
            let (matrix, off) = self.matrix(role)?;
            Some(json!({
                "stored_entries": matrix.entries.len(),
                "is_triangle": matrix.is_half,
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
        let found = self.frequencies.as_ref();
        json!({
            "files": files,
            "formats": self.matrices.formats,
            "nodes": self.matrices.dofs.as_ref().map(|_| self.matrices.nodes()),
            "dofs": self.matrices.size,
            "stiffness": of(Role::Stiffness),
            "mass": of(Role::Mass),
            "damping": of(Role::Damping),
            "structural_damping": of(Role::Hysteretic),
            "mass_by_direction": { "x": x, "y": y, "z": z },
            "zero_mass_diagonals": zero_mass.len(),
            "zero_mass_rows": zero_mass.iter().take(NAMED).map(|&row| row_name(&self.matrices, row)).collect::<Vec<_>>(),
            "modal_coordinates": self.modal,
            "fixed": found.map(|f| f.fixed),
            "held_by_penalty": found.map(|f| f.held),
            "empty_rows": found.map(|f| f.empty),
            "rows_of_bodies_without_mass": found.map(|f| f.massless),
            "is_stiffness_singular": found.map(|f| f.is_singular),
            "rigid_modes": found.map(|f| f.rigid.len()),
            "rigid_frequencies": found.map(|f| &f.rigid),
            "frequencies": found.map(|f| &f.elastic),
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
                "{:<20}{}; no file says which node each belongs to",
                "freedoms", matrices.size
            ),
        }
        for role in Role::ALL {
            let Some((matrix, off)) = self.matrix(role) else {
                continue;
            };
            let form = if matrix.is_half {
                "one triangle"
            } else {
                "both triangles"
            };
            let symmetry = match off.share {
                _ if matrix.is_half => "symmetric".to_owned(),
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
            writeln!(out, "{:<20}{}", "mass in all", axes.join(", "));
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
        if let Some(found) = &self.frequencies {
            for (what, count) in [
                ("held by --fixed", found.fixed),
                ("held by a penalty", found.held),
                ("empty rows", found.empty),
                ("rows of no mass", found.massless),
            ] {
                if count > 0 {
                    writeln!(out, "{what:<20}{count}");
                }
            }
            if !found.rigid.is_empty() {
                let most = found.rigid.iter().copied().fold(0.0, f64::max);
                writeln!(
                    out,
                    "{:<20}{} (rounding leaves up to {most:.1e} Hz)",
                    "rigid modes",
                    found.rigid.len()
                );
            }
            let singular = if found.is_singular {
                "singular"
            } else {
                "regular"
            };
            writeln!(out, "{:<20}{singular}", "stiffness is");
            write_frequencies("frequencies", found, out);
        }
        if let Some(found) = &self.of_modal {
            write_frequencies("with boundary held", found, out);
        }
        if let Some(given) = &matrices.unit {
            let told = match given {
                Some(unit) => format!("{}, {}, {}", unit.length, unit.mass, unit.time),
                None => "not given: structure.unit of the scene must say them".to_owned(),
            };
            writeln!(out, "{:<20}{told}", "units, given");
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

/// In hertz, if the unit of time is the second.
fn write_frequencies(what: &str, found: &Frequencies, out: &mut Results) {
    for (mode, hertz) in found.elastic.iter().enumerate() {
        let what = if mode == 0 { what } else { "" };
        writeln!(out, "{what:<20}{:>3}  {hertz:.6} Hz", mode + 1);
    }
}
