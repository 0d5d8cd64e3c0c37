//! Mesh of an input deck of Abaqus or CalculiX. The mesh has elements, sets, surfaces, isotropic materials, sections
//! and supports. The reader supports only flat decks, without parts, instances and included files.

use std::collections::{HashMap, HashSet};

use super::ParsedFile;
use super::deck::{expand_range, keyword, option};
use super::error::ReadProblem;
use super::mesh_constraints::{Constraint, OpenEquation, Tie, TieOptions};
use super::mesh_keywords::Steps;
use super::text::{number, quoted, text_of, whole};
use crate::structure::matrices::Dof;
use crate::structure::solids::{Elastic, Material, NAMES, Solid};

/// Words for supports, each with the last fixed direction. All directions from 1 are fixed.
const HELD: [(&str, u32); 2] = [("ENCASTRE", 6), ("PINNED", 3)];

pub(super) struct Element {
    pub(super) label: i64,
    pub(super) solid: Solid,
    pub(super) nodes: Vec<i64>,
    pub(super) line: usize,
}

#[derive(Default)]
pub(super) struct Surface {
    /// Nodes in ascending order, each once.
    pub(super) nodes: Vec<i64>,
    /// Indices of elements, and numbers of their faces, where S1 is 0. Empty for a surface of nodes.
    pub(super) faces: Vec<(usize, usize)>,
}

#[derive(Default)]
pub(super) struct Deck {
    pub(super) elements: Vec<Element>,
    /// Indices of the elements of each set.
    sets: HashMap<String, Vec<usize>>,
    place_of: HashMap<i64, usize>,
    /// Type of each element that is no solid. The field `sets_of_skipped` has the sets with an element that is no
    /// solid.
    skipped: HashMap<i64, String>,
    sets_of_skipped: HashMap<String, String>,
    materials: HashMap<String, MaterialLines>,
    /// Sections: the set of elements, the material, and the line in the deck.
    sections: Vec<(String, String, usize)>,
    pub(super) held: HashSet<Dof>,
    pub(super) surfaces: HashMap<String, Surface>,
    pub(super) ties: Vec<Tie>,
    pub(super) equations: Vec<Constraint>,
}

#[derive(Default, Clone, Copy)]
struct MaterialLines {
    elastic: Option<[f64; 2]>,
    density: Option<f64>,
    /// Loss factor: the imaginary part of the stiffness over the real part.
    structural: Option<f64>,
}

/// Returns true if the deck has elements, or may have them in an included file.
pub(super) fn has_mesh(bytes: &[u8]) -> bool {
    text_of(bytes)
        .lines()
        .any(|line| matches!(keyword(line).as_str(), "*ELEMENT" | "*INCLUDE"))
}

fn solid_of(line: &str) -> Option<Solid> {
    let kind = option(line, "TYPE")?.to_ascii_uppercase();
    NAMES.iter().find(|name| name.0 == kind).map(|name| name.1)
}

/// Prefixes of the types of surface and line elements. Meshes of solids often have surface and line elements that name
/// faces and edges.
const FACES_AND_LINES: [&str; 14] = [
    "CPS", "CPE", "CAX", "SFM3D", "STRI", "S3", "S4", "S6", "S8", "M3D", "T2D", "T3D", "B2", "B3",
];

fn is_of_face_or_line(kind: &str) -> bool {
    FACES_AND_LINES
        .iter()
        .any(|prefix| kind.starts_with(prefix))
}

enum In {
    Elements(Solid, Option<String>),
    /// Type of surface or line elements, and their set.
    Skipped(String, Option<String>),
    ElementSet {
        name: String,
        generate: bool,
    },
    Surface {
        name: String,
        of_nodes: bool,
    },
    Elastic(String),
    Density(String),
    Boundary,
    Tie(TieOptions),
    Equation,
    Other,
}

pub(super) fn read(bytes: &[u8], parsed: &ParsedFile) -> Result<Deck, ReadProblem> {
    let text = text_of(bytes);
    let mut deck = Deck::default();
    let mut section = In::Other;
    let mut steps = Steps::default();
    let mut material = String::new();
    let mut room = super::MOST_ENTRIES.min(64 * bytes.len());
    // Numbers of an element whose nodes continue on the next line.
    let mut open_element: Vec<i64> = Vec::new();
    let mut open_equation = OpenEquation::default();
    for (k, line) in text.lines().map(str::trim_start).enumerate() {
        if line.trim().is_empty() || line.starts_with("**") {
            continue;
        }
        let place = || format!("line {}", k + 1);
        if line.starts_with('*') {
            if !open_element.is_empty() {
                return Err(ReadProblem::malformed(
                    place(),
                    quoted(line),
                    "the rest of an element's nodes",
                ));
            }
            open_equation.check_closed()?;
            if steps.check_keyword(line, k + 1)? {
                deck.held.clear();
            }
            section = begin_section(line, &mut material, &mut deck, k + 1)?;
            continue;
        }
        let fields: Vec<&str> = line.split(',').map(str::trim).collect();
        match &section {
            In::Elements(solid, set) => {
                for field in fields.iter().filter(|f| !f.is_empty()) {
                    open_element.push(whole(
                        field,
                        "the numbers of an element and its nodes",
                        place,
                    )?);
                }
                if open_element.len() <= solid.nodes() {
                    continue;
                }
                if open_element.len() > solid.nodes() + 1 {
                    return Err(ReadProblem::malformed(
                        place(),
                        format!("{} nodes", open_element.len() - 1),
                        format!("{} nodes of an element", solid.nodes()),
                    ));
                }
                let element = Element {
                    label: open_element[0],
                    solid: *solid,
                    nodes: open_element[1..].to_vec(),
                    line: k + 1,
                };
                open_element.clear();
                if deck
                    .place_of
                    .insert(element.label, deck.elements.len())
                    .is_some()
                {
                    return Err(ReadProblem::malformed(
                        place(),
                        format!("element {} again", element.label),
                        "each number once",
                    ));
                }
                let at = deck.elements.len();
                if let Some(set) = set {
                    deck.sets.entry(set.clone()).or_default().push(at);
                }
                deck.elements.push(element);
            }
            In::Skipped(kind, set) => {
                // Surface and line elements have too few nodes for a continuation line, so each line is one element.
                let label = whole(fields[0], "the number of an element", place)?;
                deck.skipped.insert(label, kind.clone());
                if let Some(set) = set {
                    deck.mark_skipped(set, label);
                }
            }
            In::ElementSet { name, generate } => {
                let mut found = Vec::new();
                if *generate {
                    let labels = expand_range(&fields, &mut room, &place)?;
                    for label in labels {
                        found.extend(deck.place_of.get(&label));
                        deck.mark_skipped(name, label);
                    }
                } else {
                    for field in fields.iter().filter(|f| !f.is_empty()) {
                        found.extend(deck.places(field));
                        deck.mark_skipped_of(name, field);
                        room = room.checked_sub(found.len()).ok_or_else(|| {
                            ReadProblem::malformed(
                                place(),
                                quoted(line),
                                "fewer elements in all sets",
                            )
                        })?;
                    }
                }
                deck.sets.entry(name.clone()).or_default().extend(found);
            }
            In::Surface { name, of_nodes } => {
                let mut nodes = Vec::new();
                let mut faces = Vec::new();
                if *of_nodes {
                    nodes = nodes_of(fields[0], parsed);
                } else {
                    let face = fields.get(1).copied().unwrap_or("");
                    let face = face.trim_start_matches(['S', 's']);
                    let face: usize = whole(face, "a set of elements and a face, S1 to S6", place)?;
                    for at in deck.places(fields[0]) {
                        let element = &deck.elements[at];
                        let number = face.wrapping_sub(1);
                        let corners = element.solid.face(number).ok_or_else(|| {
                            ReadProblem::malformed(
                                place(),
                                format!("face S{face}"),
                                "a face that the element has",
                            )
                        })?;
                        nodes.extend(corners.into_iter().map(|corner| element.nodes[corner]));
                        faces.push((at, number));
                    }
                }
                room = room.checked_sub(nodes.len()).ok_or_else(|| {
                    ReadProblem::malformed(place(), quoted(line), "fewer nodes in all surfaces")
                })?;
                let surface = deck.surfaces.entry(name.clone()).or_default();
                surface.nodes.extend(nodes);
                surface.faces.extend(faces);
            }
            In::Elastic(name) => {
                let constants = deck.materials.entry(name.clone()).or_default();
                let modulus = number(fields[0], place)?;
                let Some(ratio) = fields.get(1).filter(|field| !field.is_empty()) else {
                    let expected = "Young's modulus and Poisson's ratio";
                    return Err(ReadProblem::malformed(place(), quoted(line), expected));
                };
                let ratio = number(ratio, place)?;
                if constants.elastic.replace([modulus, ratio]).is_some() {
                    return Err(ReadProblem::malformed(
                        place(),
                        quoted(line),
                        "one line of *ELASTIC for each material: it does not depend on temperature here",
                    ));
                }
            }
            In::Density(name) => {
                let density = number(fields[0], place)?;
                let constants = deck.materials.entry(name.clone()).or_default();
                if constants.density.replace(density).is_some() {
                    return Err(ReadProblem::malformed(
                        place(),
                        quoted(line),
                        "one line of *DENSITY for each material: it does not depend on temperature here",
                    ));
                }
            }
            In::Boundary => read_boundary(&fields, parsed, &mut deck.held, &place)?,
            In::Tie(options) => deck.ties.push(options.between(&fields, k + 1)?),
            In::Equation => {
                if let Some(equation) = open_equation.add(&fields, k + 1)? {
                    deck.equations.push(equation);
                }
            }
            In::Other => {}
        }
    }
    open_equation.check_closed()?;
    for surface in deck.surfaces.values_mut() {
        surface.nodes.sort_unstable();
        surface.nodes.dedup();
        surface.faces.sort_unstable();
        surface.faces.dedup();
    }
    Ok(deck)
}

/// Keywords that define properties of a material.
const OF_MATERIAL: [&str; 3] = ["*DAMPING", "*DENSITY", "*ELASTIC"];
/// Keywords that may be between the properties of one material.
const IN_MATERIAL: [&str; 9] = [
    "*CONDUCTIVITY",
    "*CYCLIC HARDENING",
    "*EXPANSION",
    "*INELASTIC HEAT FRACTION",
    "*LATENT HEAT",
    "*MATERIAL",
    "*PLASTIC",
    "*RATE DEPENDENT",
    "*SPECIFIC HEAT",
];

/// Returns the section that a keyword line begins, and stores the options of the line.
fn begin_section(
    line: &str,
    material: &mut String,
    deck: &mut Deck,
    at: usize,
) -> Result<In, ReadProblem> {
    let place = || format!("line {at}");
    let word = keyword(line);
    let unsupported = |advice: &str| {
        Err(ReadProblem::Unsupported {
            found: format!("{word} of line {at}"),
            advice: advice.to_owned(),
        })
    };
    let name =
        |key: &str| option(line, key).map(|name| name.trim_matches('"').to_ascii_uppercase());
    let required_option = |key: &str| {
        name(key).ok_or_else(|| ReadProblem::malformed(place(), quoted(line), format!("{key}=…")))
    };
    if OF_MATERIAL.contains(&word.as_str()) {
        if material.is_empty() {
            return unsupported("it belongs below the *MATERIAL that it is a part of");
        }
    } else if !IN_MATERIAL.contains(&word.as_str()) {
        material.clear();
    }
    Ok(match word.as_str() {
        "*ELEMENT" => {
            let kind = name("TYPE").unwrap_or_default();
            let Some(solid) = solid_of(line) else {
                if !is_of_face_or_line(&kind) {
                    let type_names: Vec<&str> = NAMES.iter().map(|name| name.0).collect();
                    let expected = match kind.as_str() {
                        "C3D8R" => "C3D8I: the stiffness of C3D8R against hourglass modes differs from program to program".to_owned(),
                        _ => format!("solids of the types {}", type_names.join(", ")),
                    };
                    let found = option(line, "TYPE").unwrap_or("no TYPE");
                    return Err(ReadProblem::malformed(place(), quoted(found), expected));
                }
                return Ok(In::Skipped(kind, name("ELSET")));
            };
            In::Elements(solid, name("ELSET"))
        }
        "*ELSET" => In::ElementSet {
            name: required_option("ELSET")?,
            generate: option(line, "GENERATE").is_some(),
        },
        "*SURFACE" => In::Surface {
            name: required_option("NAME")?,
            of_nodes: name("TYPE").is_some_and(|kind| kind == "NODE"),
        },
        "*MATERIAL" => {
            *material = required_option("NAME")?;
            In::Other
        }
        "*ELASTIC" => match name("TYPE").as_deref() {
            None | Some("ISO" | "ISOTROPIC") => In::Elastic(material.clone()),
            Some(_) => return unsupported("materials are isotropic: leave TYPE out"),
        },
        "*DENSITY" => In::Density(material.clone()),
        "*DAMPING" => {
            if let Some(other) = line.split(',').skip(1).map(str::trim).find(|part| {
                let key = part.split('=').next().unwrap_or("").trim();
                !key.eq_ignore_ascii_case("STRUCTURAL") && !key.is_empty()
            }) {
                return Err(ReadProblem::Unsupported {
                    found: format!("{other} of the *DAMPING of line {at}"),
                    advice: "STRUCTURAL=… of a material is read; leave it out, and give dynamics.rayleigh in the scene for damping by mass and stiffness".to_owned(),
                });
            }
            let factor = number(&required_option("STRUCTURAL")?, place)?;
            if factor < 0.0 {
                return Err(ReadProblem::malformed(
                    place(),
                    factor,
                    "a factor of zero or more",
                ));
            }
            let lines = deck.materials.entry(material.clone()).or_default();
            lines.structural = Some(factor);
            In::Other
        }
        "*SOLID SECTION" => {
            deck.sections
                .push((required_option("ELSET")?, required_option("MATERIAL")?, at));
            In::Other
        }
        "*BOUNDARY" => In::Boundary,
        "*TIE" => In::Tie(TieOptions::parse(line, at)?),
        "*EQUATION" => In::Equation,
        _ => In::Other,
    })
}

impl Deck {
    /// Marks the set `set` if the element with number `label` is no solid.
    fn mark_skipped(&mut self, set: &str, label: i64) {
        if let Some(kind) = self.skipped.get(&label) {
            self.sets_of_skipped.insert(set.to_owned(), kind.clone());
        }
    }

    /// Marks the set `set` if the set `name`, or the element with number `name`, has an element that is no solid.
    fn mark_skipped_of(&mut self, set: &str, name: &str) {
        match name.parse::<i64>() {
            Ok(label) => self.mark_skipped(set, label),
            Err(_) => {
                let name = name.trim_matches('"').to_ascii_uppercase();
                if let Some(kind) = self.sets_of_skipped.get(&name).cloned() {
                    self.sets_of_skipped.insert(set.to_owned(), kind);
                }
            }
        }
    }

    /// Returns a note for the user about elements that were left out.
    pub(super) fn left_out(&self) -> Option<String> {
        let mut kinds: Vec<&str> = self.skipped.values().map(String::as_str).collect();
        kinds.sort_unstable();
        kinds.dedup();
        (!kinds.is_empty()).then(|| {
            let count = self.skipped.len();
            format!(
                "{count} elements of surfaces or lines ({}), which no section names, are left out",
                kinds.join(", ")
            )
        })
    }

    /// Returns the indices of the elements of the set `name`, or of the element with number `name`.
    fn places(&self, name: &str) -> Vec<usize> {
        match name.parse::<i64>() {
            Ok(label) => self.place_of.get(&label).copied().into_iter().collect(),
            Err(_) => {
                let name = name.trim_matches('"').to_ascii_uppercase();
                self.sets.get(&name).cloned().unwrap_or_default()
            }
        }
    }

    /// Returns the material of each element, and its factor of structural damping.
    pub(super) fn materials_of_elements(&self) -> Result<Vec<(Material, f64)>, ReadProblem> {
        let mut assigned: Vec<Option<(Material, f64)>> = vec![None; self.elements.len()];
        for (set, name, line) in &self.sections {
            let place = || format!("line {line}");
            let material_names = || {
                let mut names: Vec<&str> = self.materials.keys().map(String::as_str).collect();
                names.sort_unstable();
                names.join(", ")
            };
            let lines = self.materials.get(name);
            let constants = lines.and_then(|lines| lines.elastic.zip(lines.density));
            let structural = lines.and_then(|lines| lines.structural).unwrap_or(0.0);
            let Some(([modulus, ratio], density)) = constants else {
                return Err(ReadProblem::malformed(
                    place(),
                    format!("the material {name}"),
                    format!(
                        "one with *ELASTIC and *DENSITY; the deck has {}",
                        material_names()
                    ),
                ));
            };
            let material = Material {
                elastic: Elastic {
                    youngs_modulus: modulus,
                    poisson_ratio: ratio,
                },
                density,
            };
            let checked = crate::structure::element::check(&material);
            checked.map_err(|error| {
                ReadProblem::malformed(place(), error, "constants of an elastic solid")
            })?;
            if let Some(kind) = self.sets_of_skipped.get(set) {
                return Err(ReadProblem::malformed(
                    place(),
                    format!("the set {set}, which has elements of the type {kind}"),
                    "a set of solids: only these have a section here",
                ));
            }
            let places = self.places(set);
            if places.is_empty() {
                return Err(ReadProblem::malformed(
                    place(),
                    format!("the set {set}"),
                    "a set of elements that the deck has",
                ));
            }
            for at in places {
                assigned[at] = Some((material, structural));
            }
        }
        let materials = assigned
            .into_iter()
            .zip(&self.elements)
            .map(|(material, element)| {
                material.ok_or_else(|| {
                    ReadProblem::malformed(
                        format!("element {} of line {}", element.label, element.line),
                        "no *SOLID SECTION for it",
                        "a section and a material for every element",
                    )
                })
            });
        materials.collect()
    }
}

/// Returns the nodes of the set `name`, or the node with number `name`.
fn nodes_of(name: &str, parsed: &ParsedFile) -> Vec<i64> {
    match name.parse::<i64>() {
        Ok(node) => vec![node],
        Err(_) => {
            let name = name.trim_matches('"').to_ascii_uppercase();
            parsed.sets.get(&name).cloned().unwrap_or_default()
        }
    }
}

/// Reads a line of `*BOUNDARY`. The line has a set or a node, the first direction, the last direction and a
/// displacement. The displacement must be zero.
fn read_boundary(
    fields: &[&str],
    parsed: &ParsedFile,
    held: &mut HashSet<Dof>,
    place: &dyn Fn() -> String,
) -> Result<(), ReadProblem> {
    let nodes = nodes_of(fields[0], parsed);
    let missing_node = nodes
        .iter()
        .find(|node| !parsed.positions.contains_key(node));
    if nodes.is_empty() || missing_node.is_some() {
        let unknown = missing_node.map_or(String::new(), |node| format!(" with the node {node}"));
        return Err(ReadProblem::malformed(
            place(),
            format!("{}{unknown}", quoted(fields[0])),
            "a node, or a set of nodes, that the deck has",
        ));
    }
    let field = |k: usize| fields.get(k).copied().filter(|f| !f.is_empty());
    let word = field(1).unwrap_or("");
    let directions = match HELD.iter().find(|held| held.0.eq_ignore_ascii_case(word)) {
        Some((_, last)) => 1..=*last,
        None => {
            let expected = "a direction from 1 to 6, ENCASTRE or PINNED";
            let first: u32 = whole(word, expected, place)?;
            let last = field(2)
                .map(|f| whole(f, expected, place))
                .transpose()?
                .unwrap_or(first);
            if !(1..=6).contains(&first) || !(first..=6).contains(&last) {
                return Err(ReadProblem::malformed(place(), quoted(word), expected));
            }
            if let Some(value) = field(3)
                && number(value, place)? != 0.0
            {
                return Err(ReadProblem::malformed(
                    place(),
                    quoted(value),
                    "a displacement of zero: supports with other displacements are not read",
                ));
            }
            first..=last
        }
    };
    for node in nodes {
        let displacements = directions.clone().filter(|d| *d <= 3);
        held.extend(displacements.map(|direction| Dof { node, direction }));
    }
    Ok(())
}
