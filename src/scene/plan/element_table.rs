//! Reading of the table of contact elements that a scene names.

use std::path::PathBuf;

use super::files::hash_of;
use crate::files;
use crate::recipe::element_table::{COLUMNS, ElementTable};
use crate::recipe::{ElementStiffness, Layout};
use crate::scene::{Contact, Scene};
use crate::structure::reduction::ContactPorts;

/// Most bytes of a table: 10 000 elements with a hundred sliders each.
const LONGEST: u64 = 1 << 28;

/// Beginning of the header line that states the kind of contact ports.
const PORTS: &str = "# contact ports:";

/// Tolerance of a centre, relative to the size of the joint.
const SAME: f64 = 1e-6;

/// Error in a table of contact elements.
#[derive(Debug, thiserror::Error)]
#[error("contact.elements {}: {problem}", path.display())]
pub struct ElementTableError {
    /// The file.
    path: PathBuf,
    /// The problem.
    problem: Box<ElementTableProblem>,
}

#[derive(Debug, thiserror::Error)]
enum ElementTableProblem {
    #[error("{0}")]
    Io(#[from] std::io::Error),
    #[error("{0}")]
    Csv(#[from] csv::Error),
    #[error("there is no column `{column}`; the table has the columns {}", COLUMNS.join(", "))]
    MissingColumn { column: &'static str },
    #[error("row {row}, column `{column}`: \"{value}\" {expected}")]
    Value {
        row: usize,
        column: &'static str,
        value: String,
        expected: &'static str,
    },
    #[error(
        "row {row}: element {element} follows element {before}; the rows must ascend by element, from 0 without a gap"
    )]
    Order {
        row: usize,
        element: usize,
        before: usize,
    },
    #[error(
        "row {row}: x, y, mu and the damping springs must be the same for all sliders of element {element}"
    )]
    NotAlike { row: usize, element: usize },
    #[error("the table has no row")]
    Empty,
    #[error(
        "the table has {found} contact elements, but the structure of the scene has {expected}"
    )]
    Count { found: usize, expected: usize },
    #[error("element {element} is at ({:e}, {:e}) m, but in the structure it is at ({:e}, {:e}) m", .found[0], .found[1], .expected[0], .expected[1])]
    Place {
        element: usize,
        found: [f64; 2],
        expected: [f64; 2],
    },
}

/// Reads the table of contact elements, if the scene names one, and updates contact and structure of the scene from it.
/// Returns the hash of the file.
pub(super) fn read(scene: &mut Scene) -> Result<Option<String>, ElementTableError> {
    let Scene {
        contact: Some(contact),
        ..
    } = scene
    else {
        return Ok(None);
    };
    let Some(file) = &mut contact.table else {
        return Ok(None);
    };
    let path = file.path.clone();
    let wrong = |problem: ElementTableProblem| ElementTableError {
        path: path.clone(),
        problem: Box::new(problem),
    };
    let bytes = files::read(&path, LONGEST).map_err(|error| wrong(error.into()))?;
    let mut table = of_csv(&bytes).map_err(wrong)?;
    let content = hash_of(|add| add(&bytes));
    table.content.clone_from(&content);
    let ports = ports_of(&bytes);
    set_contact(contact, table);
    if let Some(structure) = &mut scene.recipe.structure {
        structure.contact_ports = ports;
    }
    Ok(Some(content))
}

/// Sets the contact keys of the whole joint from the table.
fn set_contact(contact: &mut Contact, table: ElementTable) {
    contact.friction_coefficient = Some(table.mean_friction());
    contact.elements = ElementStiffness::Given {
        kn: table.total(2),
        kt: table.total(3),
        gap: 0.0,
        normal_load: table.total(0),
    };
    if let Some(file) = &mut contact.table {
        file.table = Some(table);
    }
}

/// Checks the table of a scene against the contact elements of its structure.
pub(super) fn check(scene: &Scene, layout: &Layout) -> Result<(), ElementTableError> {
    let file = scene
        .contact
        .as_ref()
        .and_then(|contact| contact.table.as_ref());
    let Some((file, table)) = file.and_then(|file| Some((file, file.table.as_ref()?))) else {
        return Ok(());
    };
    let wrong = |problem| ElementTableError {
        path: file.path.clone(),
        problem: Box::new(problem),
    };
    let (found, expected) = (table.count(), layout.centres.len());
    if found != expected {
        return Err(wrong(ElementTableProblem::Count { found, expected }));
    }
    let size = layout
        .centres
        .iter()
        .flatten()
        .fold(layout.lever, |most, c| most.max(c.abs()));
    for (element, (found, expected)) in table.centres.iter().zip(&layout.centres).enumerate() {
        let distance = (found[0] - expected[0]).hypot(found[1] - expected[1]);
        if distance > SAME * size {
            return Err(wrong(ElementTableProblem::Place {
                element,
                found: *found,
                expected: *expected,
            }));
        }
    }
    Ok(())
}

/// Reads the kind of contact ports from the header of a table: nodes, unless it says faces.
fn ports_of(bytes: &[u8]) -> ContactPorts {
    let text = String::from_utf8_lossy(bytes);
    let mut head = text.lines().take_while(|line| line.starts_with('#'));
    match head.find_map(|line| line.strip_prefix(PORTS)) {
        Some(kind) if kind.trim() == "faces" => ContactPorts::Faces,
        _ => ContactPorts::Nodes,
    }
}

fn of_csv(bytes: &[u8]) -> Result<ElementTable, ElementTableProblem> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .from_reader(bytes);
    let headers = reader.headers()?.clone();
    let mut places = [0; COLUMNS.len()];
    for (place, column) in places.iter_mut().zip(COLUMNS) {
        let found = headers.iter().position(|name| name == column);
        *place = found.ok_or(ElementTableProblem::MissingColumn { column })?;
    }
    let mut table = ElementTable::default();
    for (row, record) in reader.records().enumerate() {
        let (row, record) = (row + 1, record?);
        let text = |k: usize| record.get(places[k]).unwrap_or_default();
        let value = |k: usize, expected: &'static str, fits: fn(f64) -> bool| {
            let number = text(k)
                .parse()
                .ok()
                .filter(|value: &f64| value.is_finite() && fits(*value));
            number.ok_or_else(|| ElementTableProblem::Value {
                row,
                column: COLUMNS[k],
                value: text(k).to_owned(),
                expected,
            })
        };
        let any = |k| value(k, "is not a finite number", |_| true);
        let positive = |k| {
            value(k, "is not a finite number, zero or greater", |value| {
                value >= 0.0
            })
        };
        let element = text(0)
            .parse::<usize>()
            .map_err(|_| ElementTableProblem::Value {
                row,
                column: COLUMNS[0],
                value: text(0).to_owned(),
                expected: "is not an element number, which counts from 0",
            })?;
        let centre = [any(1)?, any(2)?];
        let (mu, springs) = (positive(4)?, [positive(5)?, positive(6)?]);
        positive(3)?;
        let element_count = table.count();
        if element == element_count {
            table.centres.push(centre);
            table.friction_coefficient.push(mu);
            table.damping_springs.push(springs);
        } else if element + 1 != element_count {
            let before = element_count.saturating_sub(1);
            return Err(ElementTableProblem::Order {
                row,
                element,
                before,
            });
        } else if table.centres[element] != centre
            || table.friction_coefficient[element] != mu
            || table.damping_springs[element] != springs
        {
            return Err(ElementTableProblem::NotAlike { row, element });
        }
        table.element.push(element);
        table
            .sliders
            .push([positive(7)?, positive(8)?, positive(9)?, positive(10)?]);
    }
    match table.count() {
        0 => Err(ElementTableProblem::Empty),
        _ => Ok(table),
    }
}

/// Returns the header line that states the kind of contact ports.
pub fn ports_line(ports: ContactPorts) -> String {
    let kind = if ports.are_faces() { "faces" } else { "nodes" };
    format!("{PORTS} {kind}")
}
