//! Assembly of the stiffness and mass of the solids of an input deck.

use std::collections::HashMap;

use super::deck;
use super::error::ReadProblem;
use super::mesh_constraints;
use super::mesh_deck::{self, Element};
use super::{NamedMatrix, ParsedFile};
use crate::structure::StructureError;
use crate::structure::element::Formulation;
use crate::structure::matrices::{DOUBLE_PRECISION, Dof, Role, Triplets};
use crate::structure::outline;
use crate::structure::solids::{Material, Solid, SolidMatrices};

/// Assembles the solids of a deck. Fixed displacements and displacements that depend on others have no rows.
pub(super) fn assemble(bytes: &[u8]) -> Result<ParsedFile, ReadProblem> {
    let mut parsed = deck::parse(bytes)?;
    let mut deck = mesh_deck::read(bytes, &parsed)?;
    for (name, surface) in &deck.surfaces {
        let set = parsed.sets.entry(name.clone());
        set.or_insert_with(|| surface.nodes.clone());
    }
    let materials = deck.materials_of_elements()?;
    // Ties come before the elements, because they move nodes.
    let mut constraints = std::mem::take(&mut deck.equations);
    for tie in &deck.ties {
        constraints.extend(mesh_constraints::tie_constraints(tie, &deck, &mut parsed)?);
    }
    let dependents =
        mesh_constraints::resolve_constraints(constraints, &deck.held, &parsed.positions)?;
    let mut nodes: Vec<i64> = (deck.elements.iter())
        .flat_map(|e| e.nodes.iter().copied())
        .collect();
    nodes.sort_unstable();
    nodes.dedup();
    let mut dofs: Vec<Dof> = (nodes.iter())
        .flat_map(|&node| (1..=3).map(move |direction| Dof { node, direction }))
        .chain(dependents.values().flatten().map(|term| term.0))
        .filter(|dof| !deck.held.contains(dof) && !dependents.contains_key(dof))
        .collect();
    dofs.sort_unstable();
    dofs.dedup();
    let row_of: HashMap<Dof, u32> = dofs.iter().copied().zip(0..).collect();
    // Each displacement of an element as a weighted sum of rows.
    let rows_of = |dof: Dof| -> Vec<(u32, f64)> {
        match (dependents.get(&dof), row_of.get(&dof)) {
            (Some(sum), _) => sum.iter().map(|term| (row_of[&term.0], term.1)).collect(),
            (None, Some(row)) => vec![(*row, 1.0)],
            (None, None) => Vec::new(),
        }
    };
    let new_triangle = || Triplets {
        is_triangle: true,
        ..Triplets::new(dofs.len())
    };
    let (mut stiffness, mut mass, mut hysteretic) =
        (new_triangle(), new_triangle(), new_triangle());
    let is_damped = materials.iter().any(|material| material.1 > 0.0);
    for (k, element) in deck.elements.iter().enumerate() {
        let (material, structural) = &materials[k];
        let element_matrices = matrices_of(element, material, &parsed)?;
        let count = element.nodes.len();
        let rows: Vec<Vec<(u32, f64)>> = (element.nodes.iter())
            .flat_map(|&node| (1..=3).map(move |direction| Dof { node, direction }))
            .map(rows_of)
            .collect();
        for i in 0..3 * count {
            for j in 0..=i {
                let stiffness_here = element_matrices.stiffness[i * 3 * count + j];
                add(&mut stiffness, [&rows[i], &rows[j]], stiffness_here, i == j);
                if is_damped {
                    let damped = structural * stiffness_here;
                    add(&mut hysteretic, [&rows[i], &rows[j]], damped, i == j);
                }
                if i % 3 == j % 3 {
                    let mass_here = element_matrices.mass[i / 3 * count + j / 3];
                    add(&mut mass, [&rows[i], &rows[j]], mass_here, i == j);
                }
            }
        }
    }
    if dofs.is_empty() {
        return Err(ReadProblem::malformed(
            "the deck",
            "no free node",
            "a solid with a free node",
        ));
    }
    for matrix in [&mut stiffness, &mut mass, &mut hysteretic] {
        matrix.sum_places();
        matrix.precision = DOUBLE_PRECISION;
    }
    parsed.hexahedra = hexahedra_of(&deck.elements);
    let faces = faces_of(&deck.elements, &nodes);
    parsed.outline = outline_of(faces.clone(), &nodes, &parsed.positions);
    let named = |(corners, _): outline::Face| corners.into_iter().map(|n| nodes[n]).collect();
    parsed.faces = outline::outer_faces(faces).into_iter().map(named).collect();
    // A node with dependent displacements has no rows, so the outline omits it.
    let is_dependent =
        |&node: &i64| (1..=3).any(|direction| dependents.contains_key(&Dof { node, direction }));
    for line in &mut parsed.outline {
        line.retain(|node| !is_dependent(node));
    }
    parsed.outline.retain(|line| line.len() > 1);
    parsed.notes.extend(deck.left_out());
    parsed.notes.push(format!(
        "{} solids of {} nodes are assembled{}{}",
        deck.elements.len(),
        nodes.len(),
        match deck.held.len() {
            0 => String::new(),
            held => format!("; {held} displacements are fixed by the deck"),
        },
        match dependents.len() {
            0 => String::new(),
            count => format!("; {count} depend on others"),
        }
    ));
    let named = |name: &str, role, matrix| NamedMatrix {
        name: name.to_owned(),
        role: Some(role),
        matrix,
        dofs: Some(dofs.clone()),
        has_unknown_size: false,
    };
    parsed.matrices = vec![
        named("stiffness", Role::Stiffness, stiffness),
        named("mass", Role::Mass, mass),
    ];
    if is_damped {
        let hysteretic = named("structural damping", Role::Hysteretic, hysteretic);
        parsed.matrices.push(hysteretic);
    }
    Ok(parsed)
}

/// Adds an entry of an element matrix and its mirror image. Both displacements of the entry are weighted sums of rows.
fn add(matrix: &mut Triplets, [first, second]: [&[(u32, f64)]; 2], value: f64, is_diagonal: bool) {
    for (p, &(row, share)) in first.iter().enumerate() {
        // For a diagonal entry both sums are the same, and each pair of terms would occur twice.
        let others = if is_diagonal { &second[..=p] } else { second };
        for &(column, other) in others {
            // The matrix stores only one triangle. If an off-diagonal entry and its mirror image both fall on the
            // diagonal, the sum counts the entry twice.
            let multiplicity = if row == column && !is_diagonal {
                2.0
            } else {
                1.0
            };
            let place = (row.max(column), row.min(column));
            matrix
                .entries
                .push((place.0, place.1, multiplicity * share * other * value));
        }
    }
}

fn matrices_of(
    element: &Element,
    material: &Material,
    parsed: &ParsedFile,
) -> Result<SolidMatrices, ReadProblem> {
    let place = || format!("element {} of line {}", element.label, element.line);
    let nodes = element.nodes.iter();
    let positions = nodes.map(|node| parsed.positions.get(node).copied().ok_or(*node));
    let positions: Vec<[f64; 3]> = positions.collect::<Result<_, _>>().map_err(|node| {
        ReadProblem::malformed(place(), format!("node {node}"), "nodes that the deck has")
    })?;
    let found = element
        .solid
        .matrices(&positions, material, element.label as usize);
    found.map_err(|error| {
        let found = match error {
            StructureError::InvertedElement { jacobian, .. } => {
                format!("a Jacobian of {jacobian:e}")
            }
            other => other.to_string(),
        };
        ReadProblem::malformed(
            place(),
            found,
            "a positive one: nodes in the order of its type",
        )
    })
}

/// Returns the formulation if all elements are 8-node hexahedra of the same formulation.
fn hexahedra_of(elements: &[Element]) -> Option<Formulation> {
    let mut kinds = elements.iter().map(|element| match element.solid {
        Solid::Hexahedron8(formulation) => Some(formulation),
        _ => None,
    });
    let first = kinds.next()??;
    kinds.all(|kind| kind == Some(first)).then_some(first)
}

/// Returns the faces of the elements. Corners are indices into the sorted `nodes`.
fn faces_of(elements: &[Element], nodes: &[i64]) -> Vec<outline::Face> {
    let faces = elements.iter().flat_map(|element| {
        let corners = element.solid.corners_of_faces().into_iter();
        corners.map(|face| {
            let at = |k: usize| nodes.partition_point(|node| *node < element.nodes[k]);
            (face.into_iter().map(at).collect(), 0)
        })
    });
    faces.collect()
}

/// Returns the edges of the bodies that have `faces` as faces of their elements.
fn outline_of(
    faces: Vec<outline::Face>,
    nodes: &[i64],
    positions: &HashMap<i64, [f64; 3]>,
) -> Vec<Vec<i64>> {
    let places: Vec<[f64; 3]> = nodes.iter().map(|node| positions[node]).collect();
    let lines = outline::lines(faces, &places).into_iter();
    let named = |line: outline::Line| line.nodes.into_iter().map(|n| nodes[n]).collect();
    lines.map(named).collect()
}
