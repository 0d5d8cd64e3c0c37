//! CSV tables of nodes: positions, degrees of freedom, sets and contact pairs. Columns are identified by name, or by
//! order if the first row is numbers. `#` begins a comment.

use std::collections::{HashMap, HashSet};

use super::matrices::Dof;

/// Error in a table of nodes.
#[derive(Debug, thiserror::Error)]
pub enum NodeTableError {
    /// The table cannot be read.
    #[error("{0}")]
    Io(#[from] std::io::Error),
    /// The text is no CSV table.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// A column is missing.
    #[error("there is no column `{column}` among {found}; the columns are {wanted}")]
    MissingColumn {
        /// Name of the missing column.
        column: &'static str,
        /// Names of the columns in the table.
        found: String,
        /// Names of the expected columns.
        wanted: String,
    },
    /// A value is invalid.
    #[error("line {line}, column `{column}`: \"{value}\" is not {wanted}")]
    Value {
        /// Line of the value, from 1.
        line: u64,
        /// Column of the value.
        column: &'static str,
        /// Text of the value.
        value: String,
        /// Description of a valid value.
        wanted: &'static str,
    },
    /// A node occurs twice.
    #[error("line {line}: node {node} has a position already")]
    Twice {
        /// Line of the second occurrence, from 1.
        line: u64,
        /// The node.
        node: i64,
    },
    /// The table has no rows.
    #[error("it has no rows")]
    Empty,
}

/// Row of a table, with its line number and its values. The values are in the order of the requested columns. An absent
/// optional column is `None`.
struct Row {
    line: u64,
    values: Vec<Option<String>>,
}

/// Reads the rows of a table. The first `required` columns must exist.
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
        let row_of = |places: &[Option<usize>]| Row {
            line,
            values: (places.iter())
                .map(|place| place.and_then(|place| record.get(place)).map(str::to_owned))
                .collect(),
        };
        if let Some(places) = &places {
            rows.push(row_of(places));
            continue;
        }
        let names: Vec<String> = record.iter().map(str::to_lowercase).collect();
        if names.iter().all(|name| name.parse::<f64>().is_ok()) {
            let column_places: Vec<Option<usize>> = (0..columns.len())
                .map(|k| (k < names.len()).then_some(k))
                .collect();
            rows.push(row_of(&column_places));
            places = Some(column_places);
            continue;
        }
        let column_places: Vec<Option<usize>> = (columns.iter())
            .map(|column| names.iter().position(|name| name == column))
            .collect();
        if let Some(k) = (0..required).find(|&k| column_places[k].is_none()) {
            return Err(NodeTableError::MissingColumn {
                column: columns[k],
                found: names.join(", "),
                wanted: columns.join(", "),
            });
        }
        places = Some(column_places);
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

/// Positions of nodes, and the order of the nodes in the table.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Positions {
    /// Position of each node, in the unit of the table.
    pub of_node: HashMap<i64, [f64; 3]>,
    /// Nodes in the order of the rows.
    pub order: Vec<i64>,
}

/// Reads positions of nodes from the columns node, x, y and z. The positions are in the unit of the table.
///
/// # Errors
/// [`NodeTableError`] with the line.
pub fn positions(bytes: &[u8]) -> Result<Positions, NodeTableError> {
    let mut table = Positions::default();
    for row in rows(bytes, &["node", "x", "y", "z"], 4)? {
        let node = row.node(0, "node")?;
        let at = [
            row.number(1, "x")?,
            row.number(2, "y")?,
            row.number(3, "z")?,
        ];
        table.order.push(node);
        if table.of_node.insert(node, at).is_some() {
            return Err(NodeTableError::Twice {
                line: row.line,
                node,
            });
        }
    }
    Ok(table)
}

/// Reads the degrees of freedom of matrix rows, in their order, from the columns node and direction.
///
/// # Errors
/// [`NodeTableError`] with the line.
pub fn dofs(bytes: &[u8]) -> Result<Vec<Dof>, NodeTableError> {
    let rows = rows(bytes, &["node", "direction"], 2)?;
    let mut seen = HashSet::new();
    let dof = |row: Row| {
        let (node, text) = (row.node(0, "node")?, row.values[1].clone());
        let text = text.unwrap_or_default();
        let direction: Option<u32> = text.parse().ok().filter(|d| *d <= 6);
        let invalid = |wanted| NodeTableError::Value {
            line: row.line,
            column: "direction",
            value: text.clone(),
            wanted,
        };
        let direction = direction
            .ok_or_else(|| invalid("a direction from 1 to 6, or 0 for a row of no direction"))?;
        let dof = Dof { node, direction };
        match direction == 0 || seen.insert(dof) {
            true => Ok(dof),
            false => Err(invalid(
                "another direction: the row of this node and direction is there already",
            )),
        }
    };
    rows.into_iter().map(dof).collect()
}

/// Reads sets of nodes from the columns set and node. The names are converted to upper case.
///
/// # Errors
/// [`NodeTableError`] with the line.
pub fn sets(bytes: &[u8]) -> Result<HashMap<String, Vec<i64>>, NodeTableError> {
    let mut sets: HashMap<String, Vec<i64>> = HashMap::new();
    let rows = match rows(bytes, &["set", "node"], 2) {
        // A structure without sets has an empty table.
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

/// Reads pairs of nodes from the columns upper_node, lower_node and optionally area, in the squared unit of the
/// table.
///
/// # Errors
/// [`NodeTableError`] with the line.
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
