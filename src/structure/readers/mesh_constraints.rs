//! Displacements of an input deck that follow from others: nodes tied to faces (`*TIE`), and linear equations (`*EQUATION`).

use std::collections::{BTreeMap, HashMap, HashSet};

use super::deck::option;
use super::error::ReadProblem;
use super::mesh_deck::{Deck, Element};
use super::text::{number, shown, whole};
use super::{MOST_ENTRIES, Parsed};
use crate::structure::face;
use crate::structure::matrices::Dof;

/// Two surfaces that move together: each node of the slave as the nearest point of the master's faces.
pub(super) struct Tie {
    pub(super) slave: String,
    pub(super) master: String,
    /// Nodes further off are not tied, in the deck's unit of length.
    pub(super) tolerance: Option<f64>,
    /// Tied nodes are moved onto the faces before there is any strain.
    pub(super) is_adjusted: bool,
    pub(super) line: usize,
}

/// A displacement as a weighted sum of others.
pub(super) struct Constraint {
    pub(super) dependent: Dof,
    pub(super) sum: Vec<(Dof, f64)>,
    /// The line that says it.
    pub(super) line: usize,
}

/// What the line of a `*TIE` says.
pub(super) struct TieOptions {
    tolerance: Option<f64>,
    is_adjusted: bool,
}

/// An equation Σ c u = 0 of which not all terms are read: the first displacement follows from the others.
#[derive(Default)]
pub(super) struct OpenEquation {
    line: usize,
    /// Terms that are to come; none between equations.
    left: usize,
    terms: Vec<(Dof, f64)>,
}

/// Displacements that follow from others, each as the weighted sum of those that are free.
pub(super) type Dependents = HashMap<Dof, Vec<(Dof, f64)>>;

/// Where a tie has no `POSITION TOLERANCE`: a share of the longest side of the face that is nearest.
const TOLERANCE: f64 = 0.05;
/// Weights of a tied node below this are rounding: it lies on an edge or a corner of its face.
const NO_WEIGHT: f64 = 1e-9;
/// Most pairs of a node and a face that a tie looks at: some seconds.
const MOST_PAIRS: usize = 4_000_000_000;

impl TieOptions {
    pub(super) fn of(line: &str, at: usize) -> Result<TieOptions, ReadProblem> {
        let place = || format!("line {at}");
        let wrong = |key: &str, value: &str, expected: &str| {
            Err(ReadProblem::malformed(
                place(),
                shown(&format!("{key}={value}")),
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
            return wrong(
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
            Some(other) => return wrong("ADJUST", other, "ADJUST=YES or ADJUST=NO"),
        };
        Ok(TieOptions {
            tolerance,
            is_adjusted,
        })
    }

    /// The tie of a line of data: the surface of the slave, and that of the master.
    pub(super) fn between(&self, fields: &[&str], line: usize) -> Result<Tie, ReadProblem> {
        let [slave, master] = match fields {
            [slave, master] | [slave, master, ""] if !slave.is_empty() && !master.is_empty() => {
                [slave, master].map(|name| name.trim_matches('"').to_ascii_uppercase())
            }
            _ => {
                return Err(ReadProblem::malformed(
                    format!("line {line}"),
                    shown(&fields.join(", ")),
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
    /// Reads a line of data; the equation, once it has all of its terms.
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
                    shown(&fields.join(", ")),
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
                    shown(count),
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
                return Err(ReadProblem::malformed(place(), shown(term[1]), expected));
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

    /// No term is missing where something else begins.
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

/// The constraints of a tie. Nodes that are tied are moved in `parsed`, unless the tie says no.
pub(super) fn tied(
    tie: &Tie,
    deck: &Deck,
    parsed: &mut Parsed,
) -> Result<Vec<Constraint>, ReadProblem> {
    let place = || format!("line {}", tie.line);
    let none = |name: &str, expected: &str| {
        let mut known: Vec<&str> = deck.surfaces.keys().map(String::as_str).collect();
        known.sort_unstable();
        let expected = match known.is_empty() {
            true => format!("{expected}; the deck has no surface"),
            false => format!("{expected}; the deck has {}", known.join(", ")),
        };
        ReadProblem::malformed(place(), format!("the surface {name}"), expected)
    };
    let surface = |name: &str| {
        let found = deck.surfaces.get(name);
        found.ok_or_else(|| none(name, "the surface of the slave, then that of the master"))
    };
    let (slave, master) = (surface(&tie.slave)?, surface(&tie.master)?);
    if master.faces.is_empty() {
        return Err(none(
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
        let at = at.ok_or_else(|| unknown(node, tie.line))?;
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
        // A node that both surfaces share is together with itself.
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

fn unknown(node: i64, line: usize) -> ReadProblem {
    ReadProblem::malformed(
        format!("line {line}"),
        format!("node {node}"),
        "nodes that the deck has",
    )
}

/// Every dependent displacement by those that are free: sums of sums are followed, and what is held adds nothing.
///
/// # Errors
/// A node that the deck does not have: what hangs on it would be free. A displacement that two lines make dependent, that is held as well, or
/// that depends on itself.
pub(super) fn resolved(
    constraints: Vec<Constraint>,
    held: &HashSet<Dof>,
    positions: &HashMap<i64, [f64; 3]>,
) -> Result<Dependents, ReadProblem> {
    let told = |dof: Dof| {
        format!(
            "the displacement of node {} in direction {}",
            dof.node, dof.direction
        )
    };
    let mut waiting = HashMap::new();
    let mut order = Vec::with_capacity(constraints.len());
    for constraint in constraints {
        let Constraint {
            dependent, line, ..
        } = constraint;
        let mut nodes = (constraint.sum.iter().map(|term| term.0.node)).chain([dependent.node]);
        if let Some(node) = nodes.find(|node| !positions.contains_key(node)) {
            return Err(unknown(node, line));
        }
        let wrong = |why: String, expected: &str| {
            Err(ReadProblem::malformed(
                format!("line {line}"),
                format!("{}, {why}", told(dependent)),
                expected,
            ))
        };
        if held.contains(&dependent) {
            return wrong(
                "which *BOUNDARY holds".to_owned(),
                "dependent nodes that nothing holds: leave them out of the slave, or hold them by the master alone",
            );
        }
        if let Some(other) = waiting.get(&dependent) {
            let Constraint { line: before, .. } = other;
            return wrong(
                format!("which follows by line {before} already"),
                "each displacement dependent once",
            );
        }
        order.push(dependent);
        waiting.insert(dependent, constraint);
    }
    let mut done: Dependents = HashMap::with_capacity(order.len());
    let mut entries = 0;
    for &first in &order {
        if done.contains_key(&first) {
            continue;
        }
        // A stack, not recursion: chains may be as long as a file. With each displacement the terms of it that are looked at.
        let mut stack = vec![(first, 0)];
        let mut open = HashSet::from([first]);
        while let Some((dof, seen)) = stack.last_mut() {
            let dof = *dof;
            let constraint = &waiting[&dof];
            let waits = |other: &Dof| waiting.contains_key(other) && !done.contains_key(other);
            while constraint
                .sum
                .get(*seen)
                .is_some_and(|term| !waits(&term.0))
            {
                *seen += 1;
            }
            if let Some(&(next, _)) = constraint.sum.get(*seen) {
                if !open.insert(next) {
                    return Err(ReadProblem::malformed(
                        format!("line {}", constraint.line),
                        format!("{}, which depends on itself", told(next)),
                        "masters that are no slaves of their own slaves",
                    ));
                }
                stack.push((next, 0));
                continue;
            }
            let mut sum: BTreeMap<Dof, f64> = BTreeMap::new();
            for &(other, weight) in &constraint.sum {
                match done.get(&other) {
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
            done.insert(dof, sum.into_iter().collect());
            open.remove(&dof);
            stack.pop();
        }
    }
    Ok(done)
}
