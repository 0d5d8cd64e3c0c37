//! Stiffness, mass and damping as a finite-element program writes them: sparse entries in any order, and the node and direction of
//! every row where the file says them. Units are those of the file.

use std::collections::HashMap;

use serde::Deserialize;

use super::element::Formulation;

/// What a row of the matrices stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dof {
    /// Number of the node as the program wrote it; below zero for one that the program made itself.
    pub node: i64,
    /// 1–3 displacements along x, y, z; 4–6 rotations about them; 0 a scalar (a modal coordinate); others as the program numbers them.
    pub direction: u32,
}

impl Dof {
    /// True for a displacement.
    pub fn is_translation(&self) -> bool {
        (1..=3).contains(&self.direction)
    }

    /// True for a rotation.
    pub fn is_rotation(&self) -> bool {
        (4..=6).contains(&self.direction)
    }
}

impl std::fmt::Display for Dof {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}.{}", self.node, self.direction)
    }
}

/// What a matrix is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// Force over displacement.
    Stiffness,
    /// Force over acceleration.
    Mass,
    /// Force over velocity.
    Damping,
    /// Force over displacement, a quarter of a cycle ahead of it at any frequency.
    Hysteretic,
}

impl Role {
    /// All of them.
    pub const ALL: [Role; 4] = [Role::Stiffness, Role::Mass, Role::Damping, Role::Hysteretic];

    /// What files without names are, in their order.
    pub const BY_PLACE: [Role; 3] = [Role::Stiffness, Role::Mass, Role::Damping];

    /// Its word.
    pub fn name(self) -> &'static str {
        match self {
            Role::Stiffness => "stiffness",
            Role::Mass => "mass",
            Role::Damping => "damping",
            Role::Hysteretic => "structural_damping",
        }
    }
}

/// A square sparse matrix, its entries in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Triplets {
    /// Rows, and columns.
    pub size: usize,
    /// Row, column (from 0) and value of each entry. Entries of one place are summed.
    pub entries: Vec<(u32, u32, f64)>,
    /// Each entry off the diagonal also stands for its mirror image: the file has one triangle.
    pub is_half: bool,
    /// Half a unit of the last digit that the file has of a number, over the number.
    pub precision: f64,
}

/// How far a matrix is from symmetric.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asymmetry {
    /// Largest |a_ij − a_ji| over the largest |a_ij|.
    pub share: f64,
    /// Where: row and column, from 0.
    pub at: (usize, usize),
    /// The two values there.
    pub values: (f64, f64),
}

impl Triplets {
    /// No entries.
    pub fn new(size: usize) -> Self {
        Triplets {
            size,
            entries: Vec::new(),
            is_half: false,
            precision: DOUBLE,
        }
    }

    /// Sum of the diagonal.
    pub fn trace(&self) -> f64 {
        let diagonal = self.entries.iter().filter(|e| e.0 == e.1);
        diagonal.map(|e| e.2).sum()
    }

    /// The diagonal; zero where no entry is stored.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.size];
        for &(i, j, v) in &self.entries {
            if i == j {
                diagonal[i as usize] += v;
            }
        }
        diagonal
    }

    /// Largest absolute value.
    pub fn largest(&self) -> f64 {
        self.entries.iter().fold(0.0, |a, e| a.max(e.2.abs()))
    }

    /// Entries that are not zero, places counted once: below the diagonal, on it, and above.
    fn sorted(&self) -> Vec<(u32, u32, f64)> {
        let mut sorted = self.entries.clone();
        sum_alike(&mut sorted);
        sorted
    }

    /// True where entries off the diagonal are on one side of it alone, and nothing says that they stand for both.
    pub fn has_one_triangle(&self) -> bool {
        let mut off = self.entries.iter().filter(|e| e.0 != e.1 && e.2 != 0.0);
        let Some(first) = off.next() else {
            return false;
        };
        let is_lower = first.0 > first.1;
        !self.is_half && off.all(|e| (e.0 > e.1) == is_lower)
    }

    /// How far the matrix is from symmetric; zero for one triangle.
    pub fn asymmetry(&self) -> Asymmetry {
        let mut worst = Asymmetry {
            share: 0.0,
            at: (0, 0),
            values: (0.0, 0.0),
        };
        let largest = self.largest();
        if self.is_half || largest == 0.0 {
            return worst;
        }
        let sorted = self.sorted();
        for &(i, j, v) in sorted.iter().filter(|e| e.0 != e.1) {
            let mirror = sorted.binary_search_by_key(&(j, i), |e| (e.0, e.1));
            let mirrored = mirror.map_or(0.0, |place| sorted[place].2);
            let share = (v - mirrored).abs() / largest;
            if share > worst.share {
                worst = Asymmetry {
                    share,
                    at: (i as usize, j as usize),
                    values: (v, mirrored),
                };
            }
        }
        worst
    }

    /// Takes one stored triangle for the whole if no place off the diagonal is stored together with its mirror image. For formats that
    /// leave it to the reader which of both they hold.
    pub fn find_half(&mut self) {
        let mut places: Vec<(u32, u32)> = (self.entries.iter())
            .filter(|e| e.0 != e.1)
            .map(|e| (e.0, e.1))
            .collect();
        places.sort_unstable();
        self.is_half = !places
            .iter()
            .any(|&(i, j)| i < j && places.binary_search(&(j, i)).is_ok());
    }

    /// Makes one entry of those of each place, in the order of rows.
    pub(super) fn sum_places(&mut self) {
        sum_alike(&mut self.entries);
    }

    /// Sum of the entries between rows and columns of `chosen`, both triangles.
    pub fn sum_between(&self, chosen: impl Fn(usize) -> bool) -> f64 {
        let mut sum = 0.0;
        for &(i, j, v) in &self.entries {
            if chosen(i as usize) && chosen(j as usize) {
                sum += if self.is_half && i != j { 2.0 * v } else { v };
            }
        }
        sum
    }

    /// Lower triangle of (A + Aᵀ)/2 on some rows: `place` says the new number of a row, or that it is left out.
    pub(super) fn lower(&self, place: &[Option<u32>]) -> Vec<(u32, u32, f64)> {
        let mut lower = Vec::with_capacity(self.entries.len());
        for &(i, j, v) in &self.entries {
            let (Some(a), Some(b)) = (place[i as usize], place[j as usize]) else {
                continue;
            };
            let mut share = if i == j || self.is_half { 1.0 } else { 0.5 };
            // Rows that became one.
            if i != j && a == b {
                share *= 2.0;
            }
            lower.push((a.min(b), a.max(b), share * v));
        }
        sum_alike(&mut lower);
        lower
    }

    /// The same matrix with other numbers of rows.
    pub(super) fn renumbered(mut self, size: usize, place: &[u32]) -> Triplets {
        for entry in &mut self.entries {
            *entry = (place[entry.0 as usize], place[entry.1 as usize], entry.2);
        }
        self.size = size;
        self
    }
}

/// Half a unit of the last place of a double.
pub const DOUBLE: f64 = f64::EPSILON / 2.0;

/// The units of a structure, as `structure.unit` of a scene has them.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Unit {
    /// Of length.
    pub length: String,
    /// Of mass.
    pub mass: String,
    /// Of time.
    pub time: String,
}

/// What was read of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// Rows of the matrices.
    pub size: usize,
    /// What each row stands for; absent where no file says it.
    pub dofs: Option<Vec<Dof>>,
    /// Stiffness.
    pub stiffness: Option<Triplets>,
    /// Mass.
    pub mass: Option<Triplets>,
    /// Viscous damping.
    pub damping: Option<Triplets>,
    /// Hysteretic damping.
    pub hysteretic: Option<Triplets>,
    /// Sets of nodes by name, in capitals.
    pub sets: HashMap<String, Vec<i64>>,
    /// Positions of nodes, where a deck says them.
    pub positions: HashMap<i64, [f64; 3]>,
    /// Nodes whose displacements are not along the global axes, after the axes that they have.
    pub local_axes: Vec<(String, Vec<i64>)>,
    /// The units, of a folder of `fretwear-import`, which may not say them.
    pub unit: Option<Option<Unit>>,
    /// Files and parts of files that were not read, each with the reason.
    pub unread: Vec<String>,
    /// Edges of the bodies by their nodes, as [`outline::lines`](super::outline::lines) finds them, where a deck has elements.
    pub outline: Vec<Vec<i64>>,
    /// Outer faces of the bodies by the nodes at their corners, in turn, where a deck has elements.
    pub faces: Vec<Vec<i64>>,
    /// The hexahedra of the elements, where a deck has such alone.
    pub hexahedra: Option<Formulation>,
    /// What the user should know of how the files were read.
    pub notes: Vec<String>,
    /// The formats, in the order of the files.
    pub formats: Vec<&'static str>,
}

impl Matrices {
    /// A matrix by its role.
    pub fn get(&self, role: Role) -> Option<&Triplets> {
        match role {
            Role::Stiffness => self.stiffness.as_ref(),
            Role::Mass => self.mass.as_ref(),
            Role::Damping => self.damping.as_ref(),
            Role::Hysteretic => self.hysteretic.as_ref(),
        }
    }

    /// Names of the sets, or `none`, and what was not read.
    pub(super) fn known_sets(&self, none: &str) -> String {
        let mut known: Vec<&str> = self.sets.keys().map(String::as_str).collect();
        known.sort_unstable();
        let known = match known.is_empty() {
            true => none.to_owned(),
            false => known.join(", "),
        };
        known + &self.told_unread()
    }

    /// The reasons of `unread`, to end a message on a missing set or position.
    pub(super) fn told_unread(&self) -> String {
        let each = self.unread.iter().map(|reason| format!("; {reason}"));
        each.collect()
    }

    /// Where each of the rows that `place` numbers is, in the unit of length of the files; none unless that is known of all.
    pub(super) fn places(&self, place: &[Option<u32>]) -> Option<Vec<[f64; 3]>> {
        let rows = place.iter().flatten().max();
        let mut at = vec![None; rows.map_or(0, |last| *last as usize + 1)];
        for (dof, place) in self.dofs.as_ref()?.iter().zip(place) {
            if let Some(place) = place {
                at[*place as usize] = Some(*self.positions.get(&dof.node)?);
            }
        }
        at.into_iter().collect()
    }

    /// Different nodes; 0 where no file says what the rows stand for.
    pub fn nodes(&self) -> usize {
        let mut nodes: Vec<i64> = (self.dofs.iter().flatten()).map(|dof| dof.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.len()
    }
}

/// Sorts entries by row and column, and makes one of those of the same place.
fn sum_alike(entries: &mut Vec<(u32, u32, f64)>) {
    entries.sort_by_key(|e| (e.0, e.1));
    entries.dedup_by(|later, kept| {
        let same = (later.0, later.1) == (kept.0, kept.1);
        if same {
            kept.2 += later.2;
        }
        same
    });
    // Entries of elements that come together are many times those that remain.
    entries.shrink_to_fit();
}
