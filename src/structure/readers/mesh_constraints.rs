//! Dependent displacements of an input deck: nodes tied to faces (`*TIE`), and linear equations (`*EQUATION`).

use std::collections::{BTreeMap, HashMap, HashSet};

use super::deck::option;
use super::error::ReadProblem;
use super::mesh_deck::{Deck, Element};
use super::text::{number, quoted, whole};
use super::{MOST_ENTRIES, ParsedFile};
use crate::structure::face;
use crate::structure::matrices::Dof;

/// Tie of two surfaces. Each slave node moves with the nearest point of the master's faces.
pub(super) struct Tie {
    pub(super) slave: String,
    pub(super) master: String,
    /// Largest distance of a tied node from a face, in the deck's unit of length.
    pub(super) tolerance: Option<f64>,
    /// True if tied nodes are moved onto the faces without strain.
    pub(super) is_adjusted: bool,
    pub(super) line: usize,
}

/// Displacement that is a weighted sum of others.
pub(super) struct Constraint {
    pub(super) dependent: Dof,
    pub(super) sum: Vec<(Dof, f64)>,
    /// Line of the tie or equation in the deck.
    pub(super) line: usize,
}

/// Options on the line of a `*TIE`.
pub(super) struct TieOptions {
    tolerance: Option<f64>,
    is_adjusted: bool,
}

/// Equation Σ c u = 0 during reading. The first displacement depends on the others.
#[derive(Default)]
pub(super) struct OpenEquation {
    line: usize,
    /// Number of terms still to be read. Zero between equations.
    left: usize,
    terms: Vec<(Dof, f64)>,
}

/// Dependent displacements, each as a weighted sum of free ones.
pub(super) type Dependents = HashMap<Dof, Vec<(Dof, f64)>>;

/// Tolerance of a tie without `POSITION TOLERANCE`, as a share of the longest side of the face.
const TOLERANCE: f64 = 0.05;
/// A weight of a tied node below `NO_WEIGHT` is a rounding error. A tied node with a weight below `NO_WEIGHT` is on an
/// edge or a corner of the face.
const NO_WEIGHT: f64 = 1e-9;
/// Largest number of pairs of a node and a face in a tie. The search for the faces of tied nodes takes some seconds for
/// `MOST_PAIRS` pairs of a node and a face.
const MOST_PAIRS: usize = 4_000_000_000;

impl TieOptions {
    pub(super) fn parse(line: &str, at: usize) -> Result<TieOptions, ReadProblem> {
        let place = || format!("line {at}");
        let invalid_option = |key: &str, value: &str, expected: &str| {
            Err(ReadProblem::malformed(
                place(),
                quoted(&format!("{key}={value}")),
                expected,
            ))
        };
        for key in [
            "CYCLIC SYMMETRY",
            "MULTISTAGE",
            "FLUID PERIODIC",
            "FLUID CYCLIC",
        ] {
            if option(line, key).is_some() {
                return Err(ReadProblem::Unsupported {
                    found: format!("{key} of the *TIE of line {at}"),
                    advice: "surfaces that lie on each other are tied".to_owned(),
                });
            }
        }
        let tolerance = option(line, "POSITION TOLERANCE")
            .map(|text| number(text, place))
            .transpose()?;
        if let Some(value) = tolerance.filter(|value| *value < 0.0) {
            return invalid_option(
                "POSITION TOLERANCE",
                &value.to_string(),
                "a length, zero or more",
            );
        }
        let is_adjusted = match option(line, "ADJUST")
            .map(str::to_ascii_uppercase)
            .as_deref()
        {
            None | Some("YES") => true,
            Some("NO") => false,
            Some(other) => return invalid_option("ADJUST", other, "ADJUST=YES or ADJUST=NO"),
        };
        Ok(TieOptions {
            tolerance,
            is_adjusted,
        })
    }

    /// Returns the tie of a data line with the slave surface and the master surface.
    pub(super) fn between(&self, fields: &[&str], line: usize) -> Result<Tie, ReadProblem> {
        let [slave, master] = match fields {
            [slave, master] | [slave, master, ""] if !slave.is_empty() && !master.is_empty() => {
                [slave, master].map(|name| name.trim_matches('"').to_ascii_uppercase())
            }
            _ => {
                return Err(ReadProblem::malformed(
                    format!("line {line}"),
                    quoted(&fields.join(", ")),
                    "two surfaces: the slave, and the master",
                ));
            }
        };
        Ok(Tie {
            slave,
            master,
            tolerance: self.tolerance,
            is_adjusted: self.is_adjusted,
            line,
        })
    }
}

impl OpenEquation {
    /// Reads a data line. Returns the equation when all of its terms are read.
    pub(super) fn add(
        &mut self,
        fields: &[&str],
        line: usize,
    ) -> Result<Option<Constraint>, ReadProblem> {
        let place = || format!("line {line}");
        let fields: Vec<&str> = fields
            .iter()
            .copied()
            .filter(|field| !field.is_empty())
            .collect();
        if self.left == 0 {
            let [count] = fields[..] else {
                return Err(ReadProblem::malformed(
                    place(),
                    quoted(&fields.join(", ")),
                    "the number of terms of an equation",
                ));
            };
            self.left = whole(
                count,
                "the number of terms of an equation, two or more",
                place,
            )?;
            self.line = line;
            self.terms.clear();
            return match self.left {
                0 | 1 => Err(ReadProblem::malformed(
                    place(),
                    quoted(count),
                    "an equation of two terms or more",
                )),
                _ => Ok(None),
            };
        }
        let expected = "node, direction from 1 to 3, and coefficient of each term";
        if !fields.len().is_multiple_of(3) || fields.len() / 3 > self.left {
            return Err(ReadProblem::malformed(
                place(),
                format!("{} numbers", fields.len()),
                format!("{expected}; {} terms are to come", self.left),
            ));
        }
        for term in fields.chunks_exact(3) {
            let node = whole(
                term[0],
                "the number of a node; sets are not taken here",
                place,
            )?;
            let direction: u32 = whole(term[1], expected, place)?;
            if !(1..=3).contains(&direction) {
                return Err(ReadProblem::malformed(place(), quoted(term[1]), expected));
            }
            self.terms
                .push((Dof { node, direction }, number(term[2], place)?));
        }
        self.left -= fields.len() / 3;
        if self.left > 0 {
            return Ok(None);
        }
        let (dependent, first) = self.terms[0];
        if first == 0.0 {
            return Err(ReadProblem::malformed(
                format!("line {}", self.line),
                "a first coefficient of zero",
                "another: the first displacement follows from the others",
            ));
        }
        let sum = self.terms[1..]
            .iter()
            .map(|&(dof, factor)| (dof, -factor / first));
        Ok(Some(Constraint {
            dependent,
            sum: sum.collect(),
            line: self.line,
        }))
    }

    /// Checks that the last equation has all of its terms.
    pub(super) fn check_closed(&self) -> Result<(), ReadProblem> {
        match self.left {
            0 => Ok(()),
            left => Err(ReadProblem::malformed(
                format!("line {}", self.line),
                format!("an equation that lacks {left} of its terms"),
                "node, direction and coefficient of each",
            )),
        }
    }
}

/// Computes the constraints of a tie. Moves tied nodes in `parsed` unless the tie has `ADJUST=NO`.
pub(super) fn tie_constraints(
    tie: &Tie,
    deck: &Deck,
    parsed: &mut ParsedFile,
) -> Result<Vec<Constraint>, ReadProblem> {
    let place = || format!("line {}", tie.line);
    let invalid_surface = |name: &str, expected: &str| {
        let mut surface_names: Vec<&str> = deck.surfaces.keys().map(String::as_str).collect();
        surface_names.sort_unstable();
        let expected = match surface_names.is_empty() {
            true => format!("{expected}; the deck has no surface"),
            false => format!("{expected}; the deck has {}", surface_names.join(", ")),
        };
        ReadProblem::malformed(place(), format!("the surface {name}"), expected)
    };
    let surface = |name: &str| {
        let found = deck.surfaces.get(name);
        found.ok_or_else(|| {
            invalid_surface(name, "the surface of the slave, then that of the master")
        })
    };
    let (slave, master) = (surface(&tie.slave)?, surface(&tie.master)?);
    if master.faces.is_empty() {
        return Err(invalid_surface(
            &tie.master,
            "faces of elements for the master, which comes second",
        ));
    }
    if slave.nodes.len().saturating_mul(master.faces.len()) > MOST_PAIRS {
        return Err(ReadProblem::TooMany {
            found: format!(
                "{} nodes of {} and {} faces of {}",
                slave.nodes.len(),
                tie.slave,
                master.faces.len(),
                tie.master
            ),
            limit: format!("at most {MOST_PAIRS} pairs of them are looked at"),
        });
    }
    let faces: Vec<_> = (master.faces.iter())
        .filter_map(|&(at, number)| {
            let Element { solid, nodes, .. } = &deck.elements[at];
            let corners: Option<Vec<_>> = nodes
                .iter()
                .map(|n| parsed.positions.get(n).copied())
                .collect();
            Some((face::Face::new(*solid, number, &corners?)?, nodes))
        })
        .collect();
    let mut constraints = Vec::new();
    let (mut tied, mut apart, mut moved) = (0, 0, 0.0_f64);
    for &node in &slave.nodes {
        let at = parsed.positions.get(&node).copied();
        let at = at.ok_or_else(|| unknown_node(node, tie.line))?;
        let mut nearest: Option<(face::NearestPoint, &Vec<i64>)> = None;
        for (face, nodes) in &faces {
            let reach = tie.tolerance.unwrap_or(TOLERANCE * face.longest_side());
            let reach = nearest
                .as_ref()
                .map_or(reach, |found| reach.min(found.0.distance));
            if face.is_farther_than(at, reach) {
                continue;
            }
            let found = face.nearest(at);
            if found.distance <= reach {
                nearest = Some((found, nodes));
            }
        }
        let Some((nearest, nodes)) = nearest else {
            apart += 1;
            continue;
        };
        let weights: Vec<(i64, f64)> = (nodes.iter().copied().zip(nearest.weights))
            .filter(|weight| weight.1.abs() > NO_WEIGHT)
            .collect();
        // A node that both surfaces share needs no constraint.
        if weights.iter().any(|weight| weight.0 == node) {
            continue;
        }
        tied += 1;
        moved = moved.max(nearest.distance);
        if tie.is_adjusted {
            parsed.positions.insert(node, nearest.position);
        }
        constraints.extend((1..=3).map(|direction| {
            Constraint {
                dependent: Dof { node, direction },
                sum: weights
                    .iter()
                    .map(|&(node, weight)| (Dof { node, direction }, weight))
                    .collect(),
                line: tie.line,
            }
        }));
    }
    if tied == 0 && apart > 0 {
        return Err(ReadProblem::malformed(
            place(),
            format!(
                "no node of {} within the tolerance of a face of {}",
                tie.slave, tie.master
            ),
            "surfaces that lie on each other, or POSITION TOLERANCE=… as far as they are apart",
        ));
    }
    let what_moved = match tie.is_adjusted {
        true if moved > 0.0 => format!(", moved by up to {moved:.3e}"),
        _ => String::new(),
    };
    let what_is_not = match apart {
        0 => String::new(),
        _ => format!("; {apart} are further off and are not tied"),
    };
    parsed.notes.push(format!(
        "{tied} nodes of {} are tied to {}{what_moved}{what_is_not}",
        tie.slave, tie.master
    ));
    Ok(constraints)
}

fn unknown_node(node: i64, line: usize) -> ReadProblem {
    ReadProblem::malformed(
        format!("line {line}"),
        format!("node {node}"),
        "nodes that the deck has",
    )
}

/// Expresses every dependent displacement by free ones. Chains of dependences are resolved, and fixed displacements
/// are zero.
///
/// # Errors
/// Returns [`ReadProblem`] if a constraint names a node that the deck does not define. Returns [`ReadProblem`] if two
/// constraints make a displacement dependent, or if a displacement is both fixed and dependent. Returns [`ReadProblem`]
/// if a displacement depends on itself.
pub(super) fn resolve_constraints(
    constraints: Vec<Constraint>,
    held: &HashSet<Dof>,
    positions: &HashMap<i64, [f64; 3]>,
) -> Result<Dependents, ReadProblem> {
    let displacement_name = |dof: Dof| {
        format!(
            "the displacement of node {} in direction {}",
            dof.node, dof.direction
        )
    };
    let mut pending = HashMap::new();
    let mut order = Vec::with_capacity(constraints.len());
    for constraint in constraints {
        let Constraint {
            dependent, line, ..
        } = constraint;
        let mut nodes = (constraint.sum.iter().map(|term| term.0.node)).chain([dependent.node]);
        if let Some(node) = nodes.find(|node| !positions.contains_key(node)) {
            return Err(unknown_node(node, line));
        }
        let invalid_dependent = |why: String, expected: &str| {
            Err(ReadProblem::malformed(
                format!("line {line}"),
                format!("{}, {why}", displacement_name(dependent)),
                expected,
            ))
        };
        if held.contains(&dependent) {
            return invalid_dependent(
                "which *BOUNDARY holds".to_owned(),
                "dependent nodes without a support: leave them out of the slave, or support the master only",
            );
        }
        if let Some(other) = pending.get(&dependent) {
            let Constraint { line: before, .. } = other;
            return invalid_dependent(
                format!("which line {before} already makes dependent"),
                "each displacement dependent once",
            );
        }
        order.push(dependent);
        pending.insert(dependent, constraint);
    }
    let mut resolved_sums: Dependents = HashMap::with_capacity(order.len());
    let mut entries = 0;
    for &first in &order {
        if resolved_sums.contains_key(&first) {
            continue;
        }
        // A stack replaces recursion, because a chain may be as long as the file. Each entry has the number of
        // checked terms.
        let mut stack = vec![(first, 0)];
        let mut open_dofs = HashSet::from([first]);
        while let Some((dof, checked_terms)) = stack.last_mut() {
            let dof = *dof;
            let constraint = &pending[&dof];
            let is_pending =
                |other: &Dof| pending.contains_key(other) && !resolved_sums.contains_key(other);
            while constraint
                .sum
                .get(*checked_terms)
                .is_some_and(|term| !is_pending(&term.0))
            {
                *checked_terms += 1;
            }
            if let Some(&(next, _)) = constraint.sum.get(*checked_terms) {
                if !open_dofs.insert(next) {
                    return Err(ReadProblem::malformed(
                        format!("line {}", constraint.line),
                        format!("{}, which depends on itself", displacement_name(next)),
                        "masters that are no slaves of their own slaves",
                    ));
                }
                stack.push((next, 0));
                continue;
            }
            let mut sum: BTreeMap<Dof, f64> = BTreeMap::new();
            for &(other, weight) in &constraint.sum {
                match resolved_sums.get(&other) {
                    Some(terms) => terms
                        .iter()
                        .for_each(|&(free, share)| *sum.entry(free).or_default() += weight * share),
                    None if held.contains(&other) => (),
                    None => *sum.entry(other).or_default() += weight,
                }
            }
            entries += sum.len();
            if entries > MOST_ENTRIES {
                return Err(ReadProblem::TooMany {
                    found: "constraints that depend on each other".to_owned(),
                    limit: format!("at most {MOST_ENTRIES} terms once they are resolved"),
                });
            }
            resolved_sums.insert(dof, sum.into_iter().collect());
            open_dofs.remove(&dof);
            stack.pop();
        }
    }
    Ok(resolved_sums)
}
