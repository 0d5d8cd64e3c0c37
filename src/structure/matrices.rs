//! Stiffness, mass and damping matrices from a finite-element program. The entries are sparse, in any order. The
//! matrices also have the node and the direction of every row, if the file contains the nodes and directions. All
//! numbers are in the units of the file.

use std::collections::HashMap;

use serde::Deserialize;

use super::element::Formulation;

/// Degree of freedom of a row of the matrices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct Dof {
    /// Number of the node in the file. Negative for an internal node of the program.
    pub node: i64,
    /// Number of the direction. 1, 2 and 3 are displacements along x, y and z. 4, 5 and 6 are rotations about x, y and
    /// z. 0 is a scalar, such as a modal coordinate. Other numbers are specific to the finite-element program.
    pub direction: u32,
}

impl Dof {
    /// Returns true for a displacement.
    pub fn is_translation(&self) -> bool {
        (1..=3).contains(&self.direction)
    }

    /// Returns true for a rotation.
    pub fn is_rotation(&self) -> bool {
        (4..=6).contains(&self.direction)
    }
}

impl std::fmt::Display for Dof {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}.{}", self.node, self.direction)
    }
}

/// Physical role of a matrix.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Role {
    /// Force divided by displacement.
    Stiffness,
    /// Force divided by acceleration.
    Mass,
    /// Force divided by velocity.
    Damping,
    /// Force divided by displacement. The force leads by a quarter of a cycle at any frequency.
    Hysteretic,
}

impl Role {
    /// All roles.
    pub const ALL: [Role; 4] = [Role::Stiffness, Role::Mass, Role::Damping, Role::Hysteretic];

    /// Roles of matrices without names, in the order of the files.
    pub const IN_FILE_ORDER: [Role; 3] = [Role::Stiffness, Role::Mass, Role::Damping];

    /// Returns the name of the role.
    pub fn name(self) -> &'static str {
        match self {
            Role::Stiffness => "stiffness",
            Role::Mass => "mass",
            Role::Damping => "damping",
            Role::Hysteretic => "structural_damping",
        }
    }
}

/// Square sparse matrix, with the matrix entries in the order of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Triplets {
    /// Number of rows, equal to the number of columns.
    pub size: usize,
    /// Row, column (from 0) and value of each entry. Entries at the same place are summed.
    pub entries: Vec<(u32, u32, f64)>,
    /// True if the file has only one triangle of the matrix. Each off-diagonal entry a_ij then also counts as a_ji.
    pub is_triangle: bool,
    /// Relative precision of the numbers in the file: half a unit of the last digit.
    pub precision: f64,
}

/// Deviation of a matrix from symmetry.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Asymmetry {
    /// Largest |a_ij − a_ji| over the largest |a_ij|.
    pub share: f64,
    /// Row and column of the largest |a_ij − a_ji|, from 0.
    pub at: (usize, usize),
    /// The two values a_ij and a_ji with the largest |a_ij − a_ji|.
    pub values: (f64, f64),
}

impl Triplets {
    /// Returns a matrix without entries.
    pub fn new(size: usize) -> Self {
        Triplets {
            size,
            entries: Vec::new(),
            is_triangle: false,
            precision: DOUBLE_PRECISION,
        }
    }

    /// Returns the sum of the diagonal.
    pub fn trace(&self) -> f64 {
        let diagonal = self.entries.iter().filter(|e| e.0 == e.1);
        diagonal.map(|e| e.2).sum()
    }

    /// Returns the diagonal, with zero where no entry is stored.
    pub fn diagonal(&self) -> Vec<f64> {
        let mut diagonal = vec![0.0; self.size];
        for &(i, j, v) in &self.entries {
            if i == j {
                diagonal[i as usize] += v;
            }
        }
        diagonal
    }

    /// Returns the largest absolute value of an entry.
    pub fn largest(&self) -> f64 {
        self.entries.iter().fold(0.0, |a, e| a.max(e.2.abs()))
    }

    /// Returns the entries sorted by row and column, with one entry per place.
    fn sorted(&self) -> Vec<(u32, u32, f64)> {
        let mut sorted = self.entries.clone();
        sum_duplicates(&mut sorted);
        sorted
    }

    /// Returns true if the matrix has entries on only one side of the diagonal and is not marked as one triangle.
    pub fn has_one_triangle(&self) -> bool {
        let mut off_diagonal = self.entries.iter().filter(|e| e.0 != e.1 && e.2 != 0.0);
        let Some(first) = off_diagonal.next() else {
            return false;
        };
        let is_lower = first.0 > first.1;
        !self.is_triangle && off_diagonal.all(|e| (e.0 > e.1) == is_lower)
    }

    /// Returns the deviation from symmetry. The deviation is zero for a matrix that is stored as one triangle.
    pub fn asymmetry(&self) -> Asymmetry {
        let mut worst = Asymmetry {
            share: 0.0,
            at: (0, 0),
            values: (0.0, 0.0),
        };
        let largest = self.largest();
        if self.is_triangle || largest == 0.0 {
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

    /// Marks the matrix as one triangle if no off-diagonal entry is stored together with its mirror image. Used for
    /// formats that do not say whether the file has one triangle or the whole matrix.
    pub fn detect_triangle(&mut self) {
        let mut places: Vec<(u32, u32)> = (self.entries.iter())
            .filter(|e| e.0 != e.1)
            .map(|e| (e.0, e.1))
            .collect();
        places.sort_unstable();
        self.is_triangle = !places
            .iter()
            .any(|&(i, j)| i < j && places.binary_search(&(j, i)).is_ok());
    }

    /// Sums entries at the same place into one, and sorts the entries by row.
    pub(super) fn sum_places(&mut self) {
        sum_duplicates(&mut self.entries);
    }

    /// Returns the sum of the entries of the full matrix whose rows and columns are both `chosen`.
    pub fn sum_between(&self, chosen: impl Fn(usize) -> bool) -> f64 {
        let mut sum = 0.0;
        for &(i, j, v) in &self.entries {
            if chosen(i as usize) && chosen(j as usize) {
                sum += if self.is_triangle && i != j {
                    2.0 * v
                } else {
                    v
                };
            }
        }
        sum
    }

    /// Returns the lower triangle of (A + Aᵀ)/2 on some rows. `place` is the new number of each row, or `None` to
    /// drop it.
    pub(super) fn lower(&self, place: &[Option<u32>]) -> Vec<(u32, u32, f64)> {
        let mut lower = Vec::with_capacity(self.entries.len());
        for &(i, j, v) in &self.entries {
            let (Some(a), Some(b)) = (place[i as usize], place[j as usize]) else {
                continue;
            };
            let mut share = if i == j || self.is_triangle { 1.0 } else { 0.5 };
            // Two rows may be merged into one.
            if i != j && a == b {
                share *= 2.0;
            }
            lower.push((a.min(b), a.max(b), share * v));
        }
        sum_duplicates(&mut lower);
        lower
    }

    /// Returns the same matrix with new row numbers.
    pub(super) fn renumbered(mut self, size: usize, place: &[u32]) -> Triplets {
        for entry in &mut self.entries {
            *entry = (place[entry.0 as usize], place[entry.1 as usize], entry.2);
        }
        self.size = size;
        self
    }
}

/// Half a unit of the last place of a double, relative.
pub const DOUBLE_PRECISION: f64 = f64::EPSILON / 2.0;

/// Units of a structure, as in `structure.unit` of a scene.
#[derive(Debug, Clone, PartialEq, Deserialize)]
pub struct Unit {
    /// Unit of length.
    pub length: String,
    /// Unit of mass.
    pub mass: String,
    /// Unit of time.
    pub time: String,
}

/// Contents of the files of a structure.
#[derive(Debug, Clone, PartialEq)]
pub struct Matrices {
    /// Number of rows of the matrices.
    pub size: usize,
    /// Degree of freedom of each row. `None` if no file has the degrees of freedom.
    pub dofs: Option<Vec<Dof>>,
    /// Stiffness.
    pub stiffness: Option<Triplets>,
    /// Mass.
    pub mass: Option<Triplets>,
    /// Viscous damping.
    pub damping: Option<Triplets>,
    /// Hysteretic damping.
    pub hysteretic: Option<Triplets>,
    /// Sets of nodes by name, in upper case.
    pub sets: HashMap<String, Vec<i64>>,
    /// Positions of the nodes, if a file has them.
    pub positions: HashMap<i64, [f64; 3]>,
    /// Nodes whose displacements are not along the global axes, with a description of their axes.
    pub local_axes: Vec<(String, Vec<i64>)>,
    /// Units of a folder of `fretwear-import`. The inner value is `None` if the folder does not specify them.
    pub unit: Option<Option<Unit>>,
    /// Files and parts of files that were not read, each with the reason.
    pub unread: Vec<String>,
    /// Edges of the bodies as lists of nodes, from [`outline::lines`](super::outline::lines). Empty without elements.
    pub outline: Vec<Vec<i64>>,
    /// Outer faces of the bodies as lists of corner nodes, in order around the face. Empty without elements.
    pub faces: Vec<Vec<i64>>,
    /// Formulation of the hexahedra, if all elements are 8-node hexahedra of one formulation.
    pub hexahedra: Option<Formulation>,
    /// Notes for the user about how the files were read.
    pub notes: Vec<String>,
    /// Names of the formats, in the order of the files.
    pub formats: Vec<&'static str>,
}

impl Matrices {
    /// Returns the matrix of a role.
    pub fn get(&self, role: Role) -> Option<&Triplets> {
        match role {
            Role::Stiffness => self.stiffness.as_ref(),
            Role::Mass => self.mass.as_ref(),
            Role::Damping => self.damping.as_ref(),
            Role::Hysteretic => self.hysteretic.as_ref(),
        }
    }

    /// Returns the names of the sets of nodes, or the text `none`, followed by the reasons why files were not read.
    pub(super) fn set_names(&self, none: &str) -> String {
        let mut names: Vec<&str> = self.sets.keys().map(String::as_str).collect();
        names.sort_unstable();
        let names = match names.is_empty() {
            true => none.to_owned(),
            false => names.join(", "),
        };
        names + &self.unread_reasons()
    }

    /// Returns the reasons of `unread`, for the end of a message about a missing set or position.
    pub(super) fn unread_reasons(&self) -> String {
        let each = self.unread.iter().map(|reason| format!("; {reason}"));
        each.collect()
    }

    /// Returns the positions of the rows that `place` numbers, in the unit of the files. `None` unless all are known.
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

    /// Returns the number of different nodes. Zero if no file describes the rows.
    pub fn nodes(&self) -> usize {
        let mut nodes: Vec<i64> = (self.dofs.iter().flatten()).map(|dof| dof.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.len()
    }
}

/// Sorts entries by row and column, and sums entries at the same place.
fn sum_duplicates(entries: &mut Vec<(u32, u32, f64)>) {
    entries.sort_by_key(|e| (e.0, e.1));
    entries.dedup_by(|later, first| {
        let is_same_place = (later.0, later.1) == (first.0, first.1);
        if is_same_place {
            first.2 += later.2;
        }
        is_same_place
    });
    // Entries of single elements are many times more than the sums that remain.
    entries.shrink_to_fit();
}
