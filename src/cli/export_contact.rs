//! `fretwear export RUN@K --contact csv -o FOLDER`: the contact elements of a run, and the structure to which they
//! belong.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::ValueEnum;
use fretwear::dynamics::ContactElement;
use fretwear::linalg::Matrix;
use fretwear::recipe::element_table::{COLUMNS, ElementTable};
use fretwear::recipe::{Recipe, StoredPlan};
use fretwear::scene::Plan;
use fretwear::scene::plan::element_table::ports_line;
use fretwear::stages::{ExportedContact, exported_contact};
use fretwear::store::{RealFileSystem, RunReader};
use fretwear::structure::matrix_files::{npz, symmetric_matrix_market};
use serde_json::json;

use super::arguments::ExportArguments;
use super::export::{make_folder, save};
use super::run::{parse_source, scene_of_run};
use super::{CliError, Exit};
use crate::progress::Watcher;
use crate::terminal::Results;

/// Format of the export: tables and matrices. `Pyharm` and `Nlvib` add a script that reads them.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ContactForm {
    Csv,
    Pyharm,
    Nlvib,
}

/// Module that reads the files into pyHarm.
const PYHARM: &str = include_str!("templates/pyharm_joint.py");

/// Function that reads the files into NLvib.
const NLVIB: &str = include_str!("templates/nlvib_joint.m");

/// Axes of the ports of an element.
const AXES: [&str; 3] = ["x", "y", "n"];

/// Writes the contact elements as `contact.csv`, and the matrices K, M, C and Ks. `rows.csv` describes the rows of the
/// matrices. `loads.csv` has the loads. `vibration.json` has the loads and the harmonics.
pub fn export_contact(
    run: &Path,
    folder: &Path,
    arguments: &ExportArguments,
    out: &mut Results,
) -> Result<Exit, CliError> {
    let (root, iteration) = run_and_iteration(run)?;
    let reader = RunReader::open(Arc::new(RealFileSystem), &root)?;
    let recipe = reader.plan(StoredPlan::of)?.recipe;
    if recipe.elements().is_none() || recipe.response.is_none() {
        return Err(CliError::NoElements { path: root });
    }
    let Some(wear_iteration) = iteration.or(reader.latest()) else {
        return Err(CliError::NothingToRun { path: root });
    };
    let Some(scene) = scene_of_run(&root, &[])? else {
        return Err(CliError::NothingToRun { path: root });
    };
    let inputs = Plan::of(&scene)?.inputs;
    let watcher = Watcher::new(&inputs.recipe, &root, true);
    let exported = exported_contact(&reader, &inputs, wear_iteration, &watcher);
    watcher.finish();
    let exported = exported?;
    let table = match arguments.one_slider {
        true => exported.with_one_slider(),
        false => exported.table.clone(),
    };
    make_folder(folder)?;
    let head = head(&recipe, &exported, arguments.one_slider);
    save(folder, "contact.csv", |to| {
        write_table(&table, &exported, &head, to)
    })?;
    let matrices: [(&str, &Matrix); 4] = [
        ("K", &exported.matrices[0]),
        ("M", &exported.matrices[1]),
        ("C", &exported.matrices[2]),
        ("Ks", &exported.matrices[3]),
    ];
    let is_nonzero = |matrix: &Matrix| matrix.as_slice().iter().any(|value| *value != 0.0);
    let written: Vec<(&str, &Matrix)> = matrices
        .into_iter()
        .filter(|(name, matrix)| ["K", "M"].contains(name) || is_nonzero(matrix))
        .collect();
    for (name, matrix) in &written {
        save(folder, &format!("{name}.mtx"), |to| {
            symmetric_matrix_market(matrix, to)
        })?;
    }
    save(folder, "matrices.npz", |to| npz(&written, to))?;
    save(folder, "rows.csv", |to| rows(&exported, to))?;
    let vibration = vibration(&exported);
    if arguments.contact == Some(ContactForm::Pyharm) {
        save(folder, "pyharm_joint.py", |to| {
            to.write_all(PYHARM.as_bytes())
        })?;
    }
    if arguments.contact == Some(ContactForm::Nlvib) {
        save(folder, "nlvib_joint.m", |to| to.write_all(NLVIB.as_bytes()))?;
    }
    save(folder, "loads.csv", |to| loads(&exported, to))?;
    save(folder, "vibration.json", |to| {
        to.write_all(vibration.as_bytes())
    })?;
    let (elements, sliders) = (table.count(), table.sliders.len());
    writeln!(
        out,
        "{}: {elements} contact elements with {sliders} sliders, matrices with {} rows; iteration {wear_iteration}",
        folder.display(),
        exported.matrices[0].rows()
    );
    let Moves { lift, close, vary } = count_moves(&exported);
    writeln!(
        out,
        "  over a cycle of the present response, {lift} sliders lift off, {close} sliders that are open at rest close, and the load of {vary} sliders varies by more than 10 %"
    );
    if arguments.one_slider {
        let changes = one_slider_changes(&exported, &table);
        save(folder, "one_slider.csv", |to| write_changes(&changes, to))?;
        print_total_changes(&changes, out);
    }
    Ok(Exit::Done)
}

/// Parses `RUN@N` into run and iteration. For `RUN`, the iteration is `None`: the last one.
fn run_and_iteration(run: &Path) -> Result<(PathBuf, Option<u64>), CliError> {
    let text = run.to_string_lossy();
    if !text.contains('@') || run.is_dir() {
        return Ok((run.to_owned(), None));
    }
    let source = parse_source(&text).map_err(CliError::NoIteration)?;
    Ok((source.run, Some(source.wear_iteration)))
}

/// Returns the comment lines at the head of the table.
fn head(recipe: &Recipe, exported: &ExportedContact, one_slider: bool) -> Vec<String> {
    let law = recipe
        .elements()
        .map_or("", |elements| elements.friction_law.formula());
    let mut head = vec![
        "# Contact elements of a fretwear run, one row per slider; SI units.".to_owned(),
        ports_line(exported.ports),
        "# The sliders of an element are parallel: all have its displacement, upper body less lower, relative to rest.".to_owned(),
        "# Normal displacement is positive where the joint opens. Load of a slider: max(0, normal_load - kn (u + gap)); the force on the structure is".to_owned(),
        "# this load less normal_load, the load at rest.".to_owned(),
        format!("# Friction: {law} with the instantaneous load; kt (u - w) with the slider at w. At rest w = 0; without load w = u."),
        "# The motion starts at rest, goes to the first sample in one step, and is marched to the steady cycle.".to_owned(),
        "# damping_kn, damping_kt: springs of the stuck joint whose modes define the damping; the matrix C already includes it.".to_owned(),
    ];
    if one_slider {
        head.push("# One slider per element: strength and energy stay the same at the amplitude of this response, the stuck stiffness does not.".to_owned());
    }
    head
}

fn write_table(
    table: &ElementTable,
    exported: &ExportedContact,
    head: &[String],
    to: &mut impl Write,
) -> io::Result<()> {
    for line in head {
        writeln!(to, "{line}")?;
    }
    writeln!(to, "{}", COLUMNS.join(","))?;
    for (&e, [load, gap, kn, kt]) in table.element.iter().zip(&table.sliders) {
        let ([x, y], area) = (table.centres[e], exported.areas[e]);
        let (mu, [damping_kn, damping_kt]) =
            (table.friction_coefficient[e], table.damping_springs[e]);
        writeln!(
            to,
            "{e},{x:e},{y:e},{area:e},{mu:e},{damping_kn:e},{damping_kt:e},{load:e},{gap:e},{kn:e},{kt:e}"
        )?;
    }
    Ok(())
}

/// Writes one line per row of the matrices, numbered from 1.
fn rows(exported: &ExportedContact, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "row,kind,element,point,axis,x,y")?;
    let mut row = 0;
    for (e, [x, y]) in exported.table.centres.iter().enumerate() {
        for axis in AXES {
            row += 1;
            writeln!(to, "{row},contact,{e},,{axis},{x:e},{y:e}")?;
        }
    }
    for (point, axis) in &exported.points {
        row += 1;
        writeln!(to, "{row},point,,{point},{},,", ["x", "y", "z"][*axis])?;
    }
    for row in row + 1..=exported.matrices[0].rows() {
        writeln!(to, "{row},mode,,,,,")?;
    }
    Ok(())
}

/// Writes one line per load. Each line has the row of the load, the harmonic, the cosine amplitude and the sine
/// amplitude. Rows are numbered from 1.
fn loads(exported: &ExportedContact, to: &mut impl Write) -> io::Result<()> {
    writeln!(to, "row,harmonic,cosine,sine")?;
    for (row, harmonic, cosine, sine) in &exported.loads {
        writeln!(to, "{},{harmonic},{cosine:e},{sine:e}", row + 1)?;
    }
    Ok(())
}

/// Returns loads, harmonics and frequency range as JSON.
fn vibration(exported: &ExportedContact) -> String {
    let loads = exported.loads.iter().map(|(row, harmonic, cosine, sine)| {
        json!({ "row": row + 1, "harmonic": harmonic, "cosine": cosine, "sine": sine })
    });
    let text = serde_json::to_string_pretty(&json!({
        "about": "rows from 1, as in rows.csv; a load is cosine cos(harmonic w t) + sine sin(harmonic w t), in N; frequencies in Hz. Ks acts as i Ks on each harmonic but the mean",
        "loads": loads.collect::<Vec<_>>(),
        "response_row": exported.response + 1,
        "harmonics": exported.orders,
        "samples": exported.samples,
        "frequency": exported.driven_at,
        "range": exported.range,
    }));
    text.unwrap_or_default() + "\n"
}

/// Numbers of sliders that lift, close, or have a varying load during a cycle.
struct Moves {
    lift: usize,
    close: usize,
    vary: usize,
}

/// Smallest change of a slider's load at which the load counts as varying, as a share of the load at rest.
const VARIES: f64 = 0.1;

fn count_moves(exported: &ExportedContact) -> Moves {
    let mut counts = Moves {
        lift: 0,
        close: 0,
        vary: 0,
    };
    for (e, element) in exported.elements.iter().enumerate() {
        let normal = exported.over_cycle(e).into_iter().map(|u| u[2]);
        let (least, most) = normal.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), u| {
            (a.min(u), b.max(u))
        });
        for slider in &element.sliders {
            let load = |u: f64| slider.normal_load + slider.normal_stiffness * (u - slider.gap);
            let (low, high) = (load(least), load(most));
            let rest = slider.normal_load;
            counts.lift += usize::from(rest > 0.0 && low <= 0.0);
            counts.close += usize::from(rest == 0.0 && high > 0.0);
            let deviation = (high - rest).max(rest - low);
            counts.vary += usize::from(rest > 0.0 && low > 0.0 && deviation > VARIES * rest);
        }
    }
    counts
}

/// Figures of a contact element: computed with all sliders of the element (`bank`), and with a single slider (`one`).
struct OneSliderChange {
    element: usize,
    /// Four figures: tangential stiffness, energy per cycle, first harmonic of the tangential force, and half range of
    /// the normal force.
    bank: [f64; 4],
    one: [f64; 4],
}

fn one_slider_changes(exported: &ExportedContact, table: &ElementTable) -> Vec<OneSliderChange> {
    let one_slider_element = |e: usize| ContactElement {
        sliders: vec![fretwear::dynamics::Slider {
            normal_load: table.sliders[e][0],
            gap: table.sliders[e][1],
            normal_stiffness: table.sliders[e][2],
            tangential_stiffness: table.sliders[e][3],
        }],
        ..exported.elements[e].clone()
    };
    let figures = |element: &ContactElement, displacement: &[[f64; 3]]| {
        let cycle = element.cycle(displacement);
        let samples = cycle.force.len() as f64;
        let first = |axis: usize| {
            let (mut cosine, mut sine) = (0.0, 0.0);
            for (k, force) in cycle.force.iter().enumerate() {
                let angle = std::f64::consts::TAU * k as f64 / samples;
                cosine += force[axis] * angle.cos();
                sine += force[axis] * angle.sin();
            }
            2.0 / samples * cosine.hypot(sine)
        };
        let normal = cycle.force.iter().map(|force| force[2]);
        let (least, most) = normal.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), n| {
            (a.min(n), b.max(n))
        });
        [
            element.tangential_stiffness(),
            cycle.dissipated_energy,
            first(0).hypot(first(1)),
            0.5 * (most - least),
        ]
    };
    let elements = exported.elements.iter().enumerate();
    elements
        .map(|(e, element)| {
            let displacement = exported.over_cycle(e);
            OneSliderChange {
                element: e,
                bank: figures(element, &displacement),
                one: figures(&one_slider_element(e), &displacement),
            }
        })
        .collect()
}

const LOST: [&str; 4] = ["kt", "energy", "first_harmonic", "normal_force"];

fn write_changes(changes: &[OneSliderChange], to: &mut impl Write) -> io::Result<()> {
    let columns = LOST.map(|name| format!("{name}_bank,{name}_one"));
    writeln!(to, "element,{}", columns.join(","))?;
    for row in changes {
        let pairs = row
            .bank
            .iter()
            .zip(&row.one)
            .map(|(bank, one)| format!("{bank:e},{one:e}"));
        writeln!(
            to,
            "{},{}",
            row.element,
            pairs.collect::<Vec<_>>().join(",")
        )?;
    }
    Ok(())
}

/// Prints the changes of the figures, summed over all elements.
fn print_total_changes(changes: &[OneSliderChange], out: &mut Results) {
    let sum = |figures: fn(&OneSliderChange) -> [f64; 4], column: usize| {
        changes.iter().map(|row| figures(row)[column]).sum::<f64>()
    };
    let change = |column: usize| {
        let (bank, one) = (sum(|row| row.bank, column), sum(|row| row.one, column));
        match bank != 0.0 {
            true => format!("{:+.2} %", 100.0 * (one / bank - 1.0)),
            false => "0 %".to_owned(),
        }
    };
    let text = format!(
        "kt {}, energy {}, first harmonic of the forces {}, normal force {}; one_slider.csv has them for each element",
        change(0),
        change(1),
        change(2),
        change(3)
    );
    out.item("with one slider each", &text);
}
