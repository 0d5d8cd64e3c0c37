//! Tables of nodes beside matrices: their positions, and the pairs of a joint. CSV, by the names of the columns, or in their order where
//! there are no names; `#` begins a comment.

use std::collections::{HashMap, HashSet};

use super::matrices::Dof;

/// What is wrong with a table of nodes.
#[derive(Debug, thiserror::Error)]
pub enum NodeTableError {
    /// It cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// It is no table.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A column is missing.
    #[error("there is no column `{column}` among {found}; the columns are {wanted}")]
    MissingColumn {
        /// The column.
        column: &'static str,
        /// Those there are.
        found: String,
        /// Those that are known.
        wanted: String,
    },
    /// A value is none.
    #[error("line {line}, column `{column}`: \"{value}\" is not {wanted}")]
    Value {
        /// The line, from 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// The text.
        value: String,
        /// What would be right.
        wanted: &'static str,
    },
    /// A node twice.
    #[error("line {line}: node {node} has a position already")]
    Twice {
        /// The line, from 1.
        line: u64,
        /// The node.
        node: i64,
    },
    /// No row.
    #[error("it has no rows")]
    Empty,
}

/// A row: its line, and its values by the columns asked for; none where an optional column is not there.
struct Row {
    line: u64,
    values: Vec<Option<String>>,
}

/// The rows of a table with these columns, the first `required` of which must be there.
fn rows(
    bytes: &[u8],
    columns: &[&'static str],
    required: usize,
) -> Result<Vec<Row>, NodeTableError> {
    let mut reader = csv::ReaderBuilder::new()
        .comment(Some(b'#'))
        .trim(csv::Trim::All)
        .has_headers(false)
        .flexible(true)
        .from_reader(bytes);
    let mut places: Option<Vec<Option<usize>>> = None;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record?;
        let line = record.position().map_or(0, csv::Position::line);
        let of = |places: &[Option<usize>]| Row {
            line,
            values: (places.iter())
                .map(|place| place.and_then(|place| record.get(place)).map(str::to_owned))
                .collect(),
        };
        if let Some(places) = &places {
            rows.push(of(places));
            continue;
        }
        let names: Vec<String> = record.iter().map(str::to_lowercase).collect();
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            let found: Vec<Option<usize>> = (0..columns.len())
                .map(|k| (k < names.len()).then_some(k))
                .collect();
            rows.push(of(&found));
            places = Some(found);
            continue;
        }
        let found: Vec<Option<usize>> = (columns.iter())
            .map(|column| names.iter().position(|name| name == column))
            .collect();
        if let Some(k) = (0..required).find(|&k| found[k].is_none()) {
            return Err(NodeTableError::MissingColumn {
                column: columns[k],
                found: names.join(", "),
                wanted: columns.join(", "),
            });
        }
        places = Some(found);
    }
    match rows.is_empty() {
        true => Err(NodeTableError::Empty),
        false => Ok(rows),
    }
}

impl Row {
    fn node(&self, k: usize, column: &'static str) -> Result<i64, NodeTableError> {
        let text = self.values[k].clone().unwrap_or_default();
        text.parse().map_err(|_| NodeTableError::Value {
            line: self.line,
            column,
            value: text,
            wanted: "the number of a node",
        })
    }

    fn number(&self, k: usize, column: &'static str) -> Result<f64, NodeTableError> {
        let text = self.values[k].clone().unwrap_or_default();
        let number = text.parse().ok().filter(|v: &f64| v.is_finite());
        number.ok_or(NodeTableError::Value {
            line: self.line,
            column,
            value: text,
            wanted: "a finite number",
        })
    }
}

/// Where nodes are, and their order in the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Positions {
    /// By node.
    pub of_node: HashMap<i64, [f64; 3]>,
    /// The nodes, row by row.
    pub order: Vec<i64>,
}

/// Positions of nodes from the columns node, x, y and z, in the unit of the table.
///
/// # Errors
/// [`NodeTableError`] names the line.
pub fn positions(bytes: &[u8]) -> Result<Positions, NodeTableError> {
    let mut found = Positions::default();
    for row in rows(bytes, &["node", "x", "y", "z"], 4)? {
        let node = row.node(0, "node")?;
        let at = [
            row.number(1, "x")?,
            row.number(2, "y")?,
            row.number(3, "z")?,
        ];
        found.order.push(node);
        if found.of_node.insert(node, at).is_some() {
            return Err(NodeTableError::Twice {
                line: row.line,
                node,
            });
        }
    }
    Ok(found)
}

/// What the rows of matrices stand for, in their order, from the columns node and direction.
///
/// # Errors
/// [`NodeTableError`] names the line.
pub fn dofs(bytes: &[u8]) -> Result<Vec<Dof>, NodeTableError> {
    let rows = rows(bytes, &["node", "direction"], 2)?;
    let mut seen = HashSet::new();
    let dof = |row: Row| {
        let (node, text) = (row.node(0, "node")?, row.values[1].clone());
        let text = text.unwrap_or_default();
        let direction: Option<u32> = text.parse().ok().filter(|d| *d <= 6);
        let wrong = |wanted| NodeTableError::Value {
            line: row.line,
            column: "direction",
            value: text.clone(),
            wanted,
        };
        let direction = direction
            .ok_or_else(|| wrong("a direction from 1 to 6, or 0 for a row of no direction"))?;
        let dof = Dof { node, direction };
        match direction == 0 || seen.insert(dof) {
            true => Ok(dof),
            false => Err(wrong(
                "another direction: this row of the node is there already",
            )),
        }
    };
    rows.into_iter().map(dof).collect()
}

/// Sets of nodes by their names in capitals, from the columns set and node.
///
/// # Errors
/// [`NodeTableError`] names the line.
pub fn sets(bytes: &[u8]) -> Result<HashMap<String, Vec<i64>>, NodeTableError> {
    let mut sets: HashMap<String, Vec<i64>> = HashMap::new();
    let rows = match rows(bytes, &["set", "node"], 2) {
        // A structure may have no set.
        Err(NodeTableError::Empty) => Vec::new(),
        rows => rows?,
    };
    for row in rows {
        let node = row.node(1, "node")?;
        let name = row.values[0].clone().unwrap_or_default();
        sets.entry(name.to_uppercase()).or_default().push(node);
    }
    Ok(sets)
}

/// Pairs of nodes from the columns upper_node, lower_node and, if it is there, area, in the unit of the table squared.
///
/// # Errors
/// [`NodeTableError`] names the line.
pub fn pairs(bytes: &[u8]) -> Result<Vec<(i64, i64, Option<f64>)>, NodeTableError> {
    let rows = rows(bytes, &["upper_node", "lower_node", "area"], 2)?;
    let has_area = rows[0].values[2].is_some();
    let pair = |row: Row| {
        let (upper, lower) = (row.node(0, "upper_node")?, row.node(1, "lower_node")?);
        let area = has_area.then(|| row.number(2, "area")).transpose()?;
        if let Some(area) = area.filter(|area| *area <= 0.0) {
            return Err(NodeTableError::Value {
                line: row.line,
                column: "area",
                value: area.to_string(),
                wanted: "an area greater than zero",
            });
        }
        Ok((upper, lower, area))
    };
    rows.into_iter().map(pair).collect()
}
