//! Export of matrices in the formats of other programs: the resonator with its nodes and contact pairs, and dense
//! matrices.

use std::collections::BTreeMap;
use std::io::{self, Seek, Write};

use npyz::WriterBuilder;

use super::StructureError;
use super::assembly::System;
use super::contact_array::ContactArray;
use super::element::Formulation;
use super::resonator::ResonatorMesh;
use crate::linalg::{Matrix, SparseSymmetric};

/// Exported files of a resonator, in SI. Nodes are numbered as in the mesh, but from 1.
#[derive(Debug, Clone)]
pub struct MatrixFiles<'a> {
    resonator: &'a ResonatorMesh,
    array: ContactArray,
    system: System,
}

impl<'a> MatrixFiles<'a> {
    /// Assembles the matrices of a resonator whose contact elements are in `array`.
    ///
    /// # Errors
    /// [`StructureError::InvertedElement`] for an inverted element.
    pub fn new(
        resonator: &'a ResonatorMesh,
        array: ContactArray,
    ) -> Result<MatrixFiles<'a>, StructureError> {
        let system = System::assemble(&resonator.mesh, Formulation::IncompatibleModes, &[])?;
        Ok(MatrixFiles {
            resonator,
            array,
            system,
        })
    }

    /// Writes the stiffness \[N/m\] as Matrix Market, lower triangle.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn stiffness(&self, to: impl Write) -> io::Result<()> {
        matrix_market(&self.system.stiffness, to)
    }

    /// Writes the mass \[kg\] as Matrix Market, lower triangle.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn mass(&self, to: impl Write) -> io::Result<()> {
        matrix_market(&self.system.mass, to)
    }

    /// Writes the nodes of the mesh with their positions \[m\], in the order of the rows of the matrices. Each node has
    /// three rows in the matrices.
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn nodes(&self, mut to: impl Write) -> io::Result<()> {
        writeln!(to, "node,x,y,z")?;
        for (n, [x, y, z]) in self.resonator.mesh.nodes.iter().enumerate() {
            writeln!(to, "{},{x:e},{y:e},{z:e}", n + 1)?;
        }
        Ok(())
    }

    /// Writes the node pairs of the joint. The area of a pair is a quarter of each rectangle around it \[m²\].
    ///
    /// # Errors
    /// I/O errors of the writer.
    pub fn pairs(&self, mut to: impl Write) -> io::Result<()> {
        let pairs = (self.resonator.contacts.iter())
            .flat_map(|face| face.corners().into_iter().zip(face.pairs));
        let by_place: BTreeMap<[usize; 2], (usize, usize)> = pairs.collect();
        writeln!(to, "upper_node,lower_node,area")?;
        for ((lower, upper), (_, area)) in by_place.into_values().zip(self.array.nodes()) {
            writeln!(to, "{},{},{area:e}", upper + 1, lower + 1)?;
        }
        Ok(())
    }

    /// Returns the node numbers of a point in the form of a scene. The scene takes the mean displacement of these node
    /// numbers. If the point is in the middle between the nodes, the mean displacement is the displacement of the
    /// point.
    pub fn point(&self, name: &str) -> Option<String> {
        let point = self
            .resonator
            .points
            .iter()
            .find(|point| point.name == name)?;
        let nodes = point.weights.iter().filter(|weight| weight.1 > 1e-9);
        let nodes: Vec<String> = nodes.map(|weight| (weight.0 + 1).to_string()).collect();
        Some(nodes.join(", "))
    }
}

fn matrix_market(matrix: &SparseSymmetric, mut to: impl Write) -> io::Result<()> {
    let size = matrix.size();
    writeln!(to, "%%MatrixMarket matrix coordinate real symmetric")?;
    writeln!(to, "{size} {size} {}", matrix.values.len())?;
    for column in 0..size {
        for (row, value) in matrix.column(column) {
            writeln!(to, "{} {} {value:e}", row + 1, column + 1)?;
        }
    }
    Ok(())
}

/// Writes a dense symmetric matrix as Matrix Market, lower triangle without zeros.
///
/// # Errors
/// I/O errors of the writer.
pub fn symmetric_matrix_market(matrix: &Matrix, to: impl Write) -> io::Result<()> {
    let size = matrix.rows();
    let lower = (0..size).flat_map(|j| (j..size).map(move |i| (i, j)));
    let entries = lower.filter(|place| matrix[*place] != 0.0);
    let entries: Vec<(u32, u32, f64)> = entries
        .map(|(i, j)| (j as u32, i as u32, matrix[(i, j)]))
        .collect();
    matrix_market(&SparseSymmetric::from_sorted(size, &entries), to)
}

/// Writes named matrices as one NPZ file.
///
/// # Errors
/// I/O errors of the writer.
pub fn npz(matrices: &[(&str, &Matrix)], to: impl Write + Seek) -> io::Result<()> {
    let mut archive = zip::ZipWriter::new(to);
    let options = zip::write::SimpleFileOptions::default();
    for (name, matrix) in matrices {
        archive.start_file(format!("{name}.npy"), options)?;
        let mut array = npyz::WriteOptions::new()
            .default_dtype()
            .order(npyz::Order::Fortran)
            .shape(&[matrix.rows() as u64, matrix.columns() as u64])
            .writer(&mut archive)
            .begin_nd()?;
        array.extend(matrix.as_slice().iter().copied())?;
        array.finish()?;
    }
    archive.finish()?;
    Ok(())
}
