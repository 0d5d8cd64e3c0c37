//! Structures from matrices of other programs: the joint and the reduced model, against direct solves of the whole structure.

use std::collections::HashMap;
use std::f64::consts::TAU;

use fretwear::linalg::{Matrix, SparseIndefinite, SparseSymmetric};
use fretwear::material::{Elastic, Material};
use fretwear::structure::assembly::System;
use fretwear::structure::element::Formulation;
use fretwear::structure::imported::{
    FacingNodes, ImportError, ImportedStructure, Options, UnitSystem,
};
use fretwear::structure::inspection::{
    inner_nodes_note, mass_by_direction, model_warnings, parse_fixed_rows,
};
use fretwear::structure::interface::{InterfaceError, JointRequirements};
use fretwear::structure::matrices::{Dof, Matrices, Triplets};
use fretwear::structure::mesh::Mesh;
use fretwear::structure::readers;
use fretwear::structure::reduction::{ContactPorts, ReducedStructure};
use fretwear::structure::resonator::Resonator;

use super::only_matrices;
use super::reduction::coarse_resonator;
use crate::support::Chance;

/// Relative error of the receptances of the reduced structure up to 0.12 of the highest kept frequency, from the truncated series of the
/// residual.
const REDUCED: f64 = 5e-4;
/// Share of [`REDUCED`] at low frequencies. The two shifts of the residual differ by a hundredth of the square of the highest frequency.
const LEFT_BY_SHIFTS: f64 = 0.1;
/// Relative difference of two reductions of one structure.
const SAME: f64 = 1e-8;
/// Rounding of the weights.
const ROUNDING: f64 = 1e-12;

const SIZE: [f64; 2] = [30e-3, 20e-3];
const HEIGHT: [f64; 2] = [8e-3, 6e-3];
const CELLS: [usize; 2] = [5, 4];

/// Two stacked blocks without a common node. The lower block is clamped at its foot. Node numbers begin with 1 in the lower block.
struct Blocks {
    systems: [System; 2],
    /// Positions of all nodes \[m\].
    positions: Vec<[f64; 3]>,
}

fn blocks() -> Blocks {
    let material = Material {
        elastic: Elastic {
            youngs_modulus: 198e9,
            poisson_ratio: 0.3,
        },
        density: 7900.0,
    };
    let block = |height, layers| {
        let size = [SIZE[0], SIZE[1], height];
        Mesh::block(size, [CELLS[0], CELLS[1], layers], material)
    };
    let mut lower = block(HEIGHT[0], 2);
    lower.nodes.iter_mut().for_each(|p| p[2] -= HEIGHT[0]);
    let upper = block(HEIGHT[1], 2);
    let positions = [&lower.nodes[..], &upper.nodes].concat();
    let of = |mesh| System::assemble(mesh, Formulation::IncompatibleModes, &[]).expect("a block");
    Blocks {
        systems: [of(&lower), of(&upper)],
        positions,
    }
}

fn entries(systems: &[&SparseSymmetric], worth: f64) -> Triplets {
    let size = systems.iter().map(|m| m.size()).sum();
    let mut triplets = Triplets::new(size);
    triplets.is_triangle = true;
    let mut first = 0;
    for matrix in systems {
        for column in 0..matrix.size() {
            for (row, value) in matrix.column(column) {
                let place = ((first + row) as u32, (first + column) as u32);
                triplets.entries.push((place.0, place.1, value * worth));
            }
        }
        first += matrix.size();
    }
    triplets
}

/// Matrices of the blocks in other units, with the model rotated by `turn`.
fn matrices(blocks: &Blocks, unit: UnitSystem, turn: [[f64; 3]; 3]) -> Matrices {
    let nodes = blocks.positions.len();
    let [lower, upper] = &blocks.systems;
    let per_time = unit.time * unit.time / unit.mass;
    let mut stiffness = entries(&[&lower.stiffness, &upper.stiffness], per_time);
    let mut mass = entries(&[&lower.mass, &upper.mass], 1.0 / unit.mass);
    for matrix in [&mut stiffness, &mut mass] {
        *matrix = turned(matrix, turn);
    }
    let dof = |row: usize| Dof {
        node: row as i64 / 3 + 1,
        direction: row as u32 % 3 + 1,
    };
    let at =
        |p: [f64; 3]| turn.map(|axis| (0..3).map(|d| axis[d] * p[d]).sum::<f64>() / unit.length);
    Matrices {
        dofs: Some((0..3 * nodes).map(dof).collect()),
        positions: (blocks.positions.iter().enumerate())
            .map(|(n, p)| (n as i64 + 1, at(*p)))
            .collect(),
        ..only_matrices(stiffness, mass)
    }
}

/// T A Tᵀ for the same rotation of every node, with both triangles.
fn turned(matrix: &Triplets, turn: [[f64; 3]; 3]) -> Triplets {
    let mut blocks: HashMap<(u32, u32), [[f64; 3]; 3]> = HashMap::new();
    for &(i, j, v) in &matrix.entries {
        let both = if i == j {
            vec![(i, j)]
        } else {
            vec![(i, j), (j, i)]
        };
        for (i, j) in both {
            blocks.entry((i / 3, j / 3)).or_default()[i as usize % 3][j as usize % 3] += v;
        }
    }
    let mut out = Triplets::new(matrix.size);
    for ((p, q), block) in blocks {
        for a in 0..3 {
            for b in 0..3 {
                let value: f64 = (0..9)
                    .map(|k| turn[a][k / 3] * block[k / 3][k % 3] * turn[b][k % 3])
                    .sum();
                out.entries
                    .push((3 * p + a as u32, 3 * q + b as u32, value));
            }
        }
    }
    out
}

const STRAIGHT: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// Nodes of the upper and the lower body, and their area.
type Pair = (i64, i64, Option<f64>);

/// Foot nodes of the lower block, and the node pairs at the joint (upper, lower).
fn foot_and_pairs(blocks: &Blocks) -> (Vec<i64>, Vec<Pair>) {
    let layer = (CELLS[0] + 1) * (CELLS[1] + 1);
    let lower = blocks.systems[0].coordinates.len();
    let foot = (1..=layer as i64).collect();
    let pairs = (0..layer).map(|n| ((lower + n) as i64 + 1, (lower - layer + n) as i64 + 1, None));
    (foot, pairs.collect())
}

/// Faces of both bodies as node sets. The scene names the sets in lowercase letters.
fn as_sets(read: &mut Matrices, pairs: &[Pair]) -> FacingNodes {
    let top = pairs.iter().map(|pair| pair.0).collect();
    let bottom = pairs.iter().map(|pair| pair.1).collect();
    read.sets.insert("TOP".to_owned(), top);
    read.sets.insert("BOTTOM".to_owned(), bottom);
    FacingNodes::Sets {
        upper: "top".to_owned(),
        lower: "bottom".to_owned(),
    }
}

/// Joint of the blocks, which are fixed at the foot.
fn on_foot(
    read: &Matrices,
    facing: &FacingNodes,
    size: [f64; 2],
    elements: Option<[usize; 2]>,
) -> Result<ImportedStructure, ImportError> {
    let options = Options {
        unit: UnitSystem::default(),
        fixed: Some("1-30"),
        facing,
        wanted: &JointRequirements::default(),
        size,
        elements,
        is_bonded: false,
        points: &[],
        preload: None,
    };
    ImportedStructure::new(read, &options)
}

fn import(
    matrices: &Matrices,
    unit: UnitSystem,
    pairs: &[Pair],
    points: &[&str],
    change: impl FnOnce(&mut JointRequirements, &mut [f64; 2], &mut Option<[usize; 2]>),
) -> Result<ImportedStructure, ImportError> {
    let layer = (CELLS[0] + 1) * (CELLS[1] + 1);
    let fixed = format!("1-{layer}");
    let facing = FacingNodes::Pairs(pairs.to_vec());
    let points: Vec<String> = points.iter().map(|p| (*p).to_owned()).collect();
    let (mut wanted, mut size, mut elements) = (JointRequirements::default(), SIZE, None);
    change(&mut wanted, &mut size, &mut elements);
    ImportedStructure::new(
        matrices,
        &Options {
            unit,
            fixed: Some(&fixed),
            facing: &facing,
            wanted: &wanted,
            size,
            elements,
            is_bonded: false,
            points: &points,
            preload: None,
        },
    )
}

/// Receptance of some ports \[m/N\] by a factorization of K − ω²M, for SI matrices without the foot.
fn direct(blocks: &Blocks, foot: usize, ports: &[Vec<(usize, f64)>], omega: f64) -> Matrix {
    let [lower, upper] = &blocks.systems;
    let cut = |matrices: [&SparseSymmetric; 2]| {
        let all = entries(&matrices, 1.0);
        let free = |i: u32| (i as usize).checked_sub(3 * foot).map(|i| i as u32);
        let mut kept: Vec<(u32, u32, f64)> = (all.entries.iter())
            .filter_map(|&(i, j, v)| Some((free(j)?, free(i)?, v)))
            .collect();
        kept.sort_by_key(|e| (e.0, e.1));
        SparseSymmetric::from_sorted(all.size - 3 * foot, &kept)
    };
    let (stiffness, mass) = (
        cut([&lower.stiffness, &upper.stiffness]),
        cut([&lower.mass, &upper.mass]),
    );
    let dynamic = stiffness.plus(-omega * omega, &mass);
    let order: Vec<usize> = (0..dynamic.size()).collect();
    let factor = SparseIndefinite::new(&dynamic, &order).expect("a factor");
    let mut columns = Matrix::zeros(dynamic.size(), ports.len());
    for (c, port) in ports.iter().enumerate() {
        for &(dof, weight) in port {
            columns[(dof - 3 * foot, c)] += weight;
        }
    }
    let forces = columns.clone();
    factor.solve(&mut columns);
    forces.transpose_times(&columns)
}

/// Relative displacements of node pairs along the axes (upper minus lower), by the rows of the whole model.
fn of_pairs(pairs: &[Pair]) -> Vec<Vec<(usize, f64)>> {
    let row = |node: i64, axis: usize| 3 * (node as usize - 1) + axis;
    let each = pairs.iter().flat_map(|&(upper, lower, _)| {
        (0..3).map(move |axis| vec![(row(upper, axis), 1.0), (row(lower, axis), -1.0)])
    });
    each.collect()
}

fn close(found: &Matrix, expected: &Matrix, tolerance: f64, what: &str) {
    let size = expected
        .as_slice()
        .iter()
        .fold(0.0, |a: f64, v| a.max(v.abs()));
    for (f, e) in found.as_slice().iter().zip(expected.as_slice()) {
        assert!(
            (f - e).abs() <= tolerance * size,
            "{what}: {f:e} {e:e} of {size:e}"
        );
    }
}

fn receptance(reduced: &ReducedStructure, omega: f64) -> Matrix {
    reduced.receptance(omega, 0.0).0
}

/// Contact elements at nodes are the pairs in the order of the array. One of the two bodies moves freely.
#[test]
fn small_model_of_two_blocks_is_that_of_the_whole() {
    let blocks = blocks();
    let (foot, pairs) = foot_and_pairs(&blocks);
    let read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let last = blocks.positions.len().to_string();
    let imported =
        import(&read, UnitSystem::default(), &pairs, &[&last], |_, _, _| ()).expect("blocks");
    let joint = imported.interface.as_ref().expect("a joint");
    assert!(joint.is_regular);
    assert_eq!((joint.array.counts, joint.array.absent.len()), (CELLS, 0));
    assert_eq!(joint.axes, STRAIGHT);
    assert_eq!(joint.layers.len(), 2);
    let reduced = imported
        .reduce(12, ContactPorts::Nodes)
        .expect("a small model")
        .0;
    assert_eq!(reduced.rigid.columns(), 6);
    // The program numbers nodes with x fastest, and the array numbers nodes with y fastest.
    let place = |i: usize, j: usize| i + (CELLS[0] + 1) * j;
    let in_order: Vec<_> = (0..=CELLS[0])
        .flat_map(|i| (0..=CELLS[1]).map(move |j| (i, j)))
        .map(|(i, j)| pairs[place(i, j)])
        .collect();
    let mut ports = of_pairs(&in_order);
    let corner = blocks.positions.len() - 1;
    ports.extend((0..3).map(|axis| vec![(3 * corner + axis, 1.0)]));
    let highest = reduced.omega[11] / TAU;
    for share in [0.02, 0.06, 0.12, 0.24] {
        let omega = share * highest * TAU;
        let expected = direct(&blocks, foot.len(), &ports, omega);
        // The error of the residual series grows with the fourth power of the frequency, above the error of the shifts.
        let tolerance = REDUCED * (share / 0.12_f64).powi(4).max(LEFT_BY_SHIFTS);
        close(
            &receptance(&reduced, omega),
            &expected,
            tolerance,
            &format!("nodes, {share}"),
        );
    }
    let faces = imported
        .reduce(12, ContactPorts::Faces)
        .expect("a small model")
        .0;
    assert_eq!(faces.ports.contacts, CELLS[0] * CELLS[1]);
    let mean: Vec<Vec<(usize, f64)>> = (0..CELLS[0])
        .flat_map(|i| (0..CELLS[1]).map(move |j| [i, j]))
        .flat_map(|[i, j]| {
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
            let pairs: Vec<_> = corners.iter().map(|(i, j)| pairs[place(*i, *j)]).collect();
            (0..3).map(move |axis| {
                let each = of_pairs(&pairs).into_iter().skip(axis).step_by(3);
                each.flatten().map(|(row, w)| (row, 0.25 * w)).collect()
            })
        })
        .collect();
    let omega = 0.12 * highest * TAU;
    let mut with_point = mean;
    with_point.extend((0..3).map(|axis| vec![(3 * corner + axis, 1.0)]));
    let expected = direct(&blocks, foot.len(), &with_point, omega);
    close(&receptance(&faces, omega), &expected, REDUCED, "faces");
}

/// Units of the files and the orientation of the model do not change the result in the axes of the joint.
#[test]
fn units_and_orientation_of_the_model_change_nothing() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let (c, s) = (0.8, 0.6);
    // Rotation about z, then about the new y.
    let turn = [[c * c, -s, c * s], [s * c, c, s * s], [-s, 0.0, c]];
    let mm = UnitSystem {
        length: 1e-3,
        mass: 1e3,
        time: 1.0,
    };
    let straight = import(
        &matrices(&blocks, UnitSystem::default(), STRAIGHT),
        UnitSystem::default(),
        &pairs,
        &[],
        |_, _, _| (),
    );
    let along = turn.map(|row| row[0]);
    let turned = import(
        &matrices(&blocks, mm, turn),
        mm,
        &pairs,
        &[],
        |wanted, _, _| {
            wanted.along = Some(along);
        },
    );
    let (straight, turned) = (straight.expect("blocks"), turned.expect("turned blocks"));
    for (axis, row) in turned
        .interface
        .as_ref()
        .expect("a joint")
        .axes
        .iter()
        .enumerate()
    {
        for d in 0..3 {
            assert!(
                (row[d] - turn[d][axis]).abs() < 1e-9,
                "axis {axis}: {row:?}"
            );
        }
    }
    assert!((turned.mass / straight.mass - 1.0).abs() < ROUNDING);
    let [one, other] =
        [&straight, &turned].map(|i| i.reduce(8, ContactPorts::Nodes).expect("a model").0);
    for (a, b) in one.omega.iter().zip(&other.omega) {
        assert!((a / b - 1.0).abs() < SAME, "{a} {b}");
    }
    let omega = 0.2 * one.omega[7];
    close(
        &receptance(&other, omega),
        &receptance(&one, omega),
        1e-6,
        "turned",
    );
}

/// Damping proportional to mass and stiffness is diagonal between modes: α + βω².
#[test]
fn damping_between_modes_is_that_of_its_matrix() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let mm = UnitSystem {
        length: 1e-3,
        mass: 1e3,
        time: 1.0,
    };
    let mut read = matrices(&blocks, mm, STRAIGHT);
    let (alpha, beta) = (40.0, 3e-7);
    let (stiffness, mass) = (
        read.stiffness.clone().expect("K"),
        read.mass.clone().expect("M"),
    );
    let mut damping = Triplets::new(read.size);
    let parts = [(beta, &stiffness), (alpha, &mass)];
    for (factor, matrix) in parts {
        damping
            .entries
            .extend(matrix.entries.iter().map(|&(i, j, v)| (i, j, factor * v)));
    }
    read.damping = Some(damping);
    let imported = import(&read, mm, &pairs, &[], |_, _, _| ()).expect("blocks");
    let reduced = imported.reduce(8, ContactPorts::Faces).expect("a model").0;
    let found = reduced.damping.as_ref().expect("damping");
    let rigid = reduced.rigid.columns();
    let largest = alpha + beta * reduced.omega[7].powi(2);
    for i in 0..rigid + 8 {
        for j in 0..rigid + 8 {
            let omega = i.checked_sub(rigid).map_or(0.0, |r| reduced.omega[r]);
            let expected = if i == j {
                alpha + beta * omega * omega
            } else {
                0.0
            };
            let miss = (found[(i, j)] - expected).abs();
            assert!(
                miss < 1e-6 * largest,
                "{i} {j}: {} {expected}",
                found[(i, j)]
            );
        }
    }
}

/// Rounded files resist rigid motions slightly. This stiffness does not enter the residual of the kept modes.
#[test]
fn digits_of_the_files_do_not_enter_the_residual() {
    let blocks = blocks();
    let (foot, pairs) = foot_and_pairs(&blocks);
    let exact = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let corner = blocks.positions.len() - 1;
    let port: Vec<Vec<(usize, f64)>> = (0..3).map(|axis| vec![(3 * corner + axis, 1.0)]).collect();
    for digits in [12, 10] {
        let mut read = exact.clone();
        for matrix in [&mut read.stiffness, &mut read.mass] {
            let matrix = matrix.as_mut().expect("a matrix");
            matrix.precision = 0.5 * 10f64.powi(1 - digits);
            for entry in &mut matrix.entries {
                entry.2 = format!("{:.*e}", digits as usize - 1, entry.2)
                    .parse()
                    .expect("a number");
            }
        }
        let last = blocks.positions.len().to_string();
        let imported =
            import(&read, UnitSystem::default(), &pairs, &[&last], |_, _, _| ()).expect("blocks");
        let reduced = imported
            .reduce(12, ContactPorts::Nodes)
            .expect("a small model")
            .0;
        assert_eq!(reduced.rigid.columns(), 6, "{digits}");
        let contact = reduced.ports.contact_ports();
        for share in [0.02, 0.06, 0.12] {
            let omega = share * reduced.omega[11];
            let found = receptance(&reduced, omega);
            let found = Matrix::from_fn(3, 3, |i, j| found[(contact + i, contact + j)]);
            let expected = direct(&blocks, foot.len(), &port, omega);
            close(
                &found,
                &expected,
                REDUCED,
                &format!("{digits} digits, {share}"),
            );
        }
    }
}

/// The resonator read from matrices equals the generated resonator.
#[test]
fn resonator_from_matrices_is_the_resonator() {
    let geometry = Resonator {
        lap_cells: 15,
        half_depth_cells: 3,
        ..coarse_resonator()
    };
    let model = geometry.mesh().expect("a mesh");
    let system =
        System::assemble(&model.mesh, Formulation::IncompatibleModes, &[]).expect("a system");
    let dof = |row: usize| Dof {
        node: row as i64 / 3 + 1,
        direction: row as u32 % 3 + 1,
    };
    let stiffness = entries(&[&system.stiffness], 1.0);
    let mass = entries(&[&system.mass], 1.0);
    let matrices = Matrices {
        dofs: Some((0..system.size()).map(dof).collect()),
        positions: (model.mesh.nodes.iter().enumerate())
            .map(|(n, p)| (n as i64 + 1, *p))
            .collect(),
        ..only_matrices(stiffness, mass)
    };
    let mut pairs: Vec<(i64, i64, Option<f64>)> = (model.contacts.iter())
        .flat_map(|face| face.pairs)
        .map(|(lower, upper)| (upper as i64 + 1, lower as i64 + 1, None))
        .collect();
    pairs.sort_by_key(|pair| pair.0);
    pairs.dedup_by_key(|pair| pair.0);
    let wall: Vec<String> = (model.points[0].weights.iter())
        .map(|weight| (weight.0 + 1).to_string())
        .collect();
    let mut matrices = matrices;
    let sets = as_sets(&mut matrices, &pairs);
    let facing = FacingNodes::Pairs(pairs);
    let options = Options {
        unit: UnitSystem::default(),
        fixed: None,
        facing: &facing,
        wanted: &JointRequirements::default(),
        size: [geometry.lap_length, geometry.arm_height],
        elements: None,
        is_bonded: false,
        points: &[wall.join(", ")],
        preload: None,
    };
    let imported = ImportedStructure::new(&matrices, &options).expect("a resonator");
    let interface = imported.interface.as_ref().expect("a joint");
    assert_eq!(interface.array, geometry.contact_array());
    let layers = geometry.layers();
    assert_eq!(interface.layers.len(), layers.len());
    for (found, layer) in interface.layers.iter().zip(&layers) {
        assert!((found / layer - 1.0).abs() < ROUNDING);
    }
    let found = imported.reduce(14, ContactPorts::Nodes).expect("a model").0;
    let (expected, _) = geometry.reduce(14, ContactPorts::Nodes).expect("a model");
    for (a, b) in found.omega.iter().zip(&expected.omega) {
        assert!((a / b - 1.0).abs() < SAME, "{a} {b}");
    }
    let contact = expected.ports.contact_ports() + 3;
    let part = |m: &Matrix| Matrix::from_fn(contact, contact, |i, j| m[(i, j)]);
    let omega = 0.3 * expected.omega[13];
    let [one, other] = [&found, &expected].map(|r| part(&receptance(r, omega)));
    close(&one, &other, SAME, "resonator");
    // The residual is small relative to the modes, so the test compares the residual separately.
    close(
        &part(&found.residual),
        &part(&expected.residual),
        1e-6,
        "residual",
    );
    bonded_as_its_own_mesh(&geometry, &matrices, [&facing, &sets], &options);
}

/// Merged facing nodes give the mesh of bodies with common nodes. The reader rejects a shifted face.
fn bonded_as_its_own_mesh(
    geometry: &Resonator,
    matrices: &Matrices,
    facings: [&FacingNodes; 2],
    options: &Options<'_>,
) {
    let tied = Resonator {
        tied: true,
        ..geometry.clone()
    };
    let (expected, _) = tied.reduce(14, ContactPorts::Nodes).expect("a model");
    let mut shifted = matrices.clone();
    for (node, at) in &mut shifted.positions {
        at[0] += if matrices.sets["TOP"].contains(node) {
            1e-4
        } else {
            0.0
        };
    }
    for facing in facings {
        let options = Options {
            is_bonded: true,
            facing,
            ..options.clone()
        };
        let imported = ImportedStructure::new(matrices, &options).expect("a resonator");
        assert!(imported.interface.is_none());
        let (found, _) = imported.reduce(14, ContactPorts::Nodes).expect("a model");
        assert_eq!(found.ports.contacts, 0);
        assert_eq!(found.omega.len(), expected.omega.len());
        for (a, b) in found.omega.iter().zip(&expected.omega) {
            assert!((a / b - 1.0).abs() < SAME, "{a} {b}");
        }
        assert!((found.mass / expected.mass - 1.0).abs() < ROUNDING);
        // A support of one node of a merged pair fixes both nodes.
        let held = matrices.sets["TOP"][0].to_string();
        let supported = Options {
            fixed: Some(&held),
            ..options.clone()
        };
        let supported = ImportedStructure::new(matrices, &supported).expect("a resonator");
        assert_eq!(supported.rows, imported.rows - 3);
        // The reader does not merge a pair if one node has no displacement.
        let mut lacking = matrices.clone();
        let dofs = lacking.dofs.as_mut().expect("freedoms");
        let upper = matrices.sets["TOP"][0];
        let row = dofs.iter_mut().find(|dof| dof.node == upper);
        row.expect("a row").node = 999_999;
        let refused = ImportedStructure::new(&lacking, &options);
        assert!(
            matches!(refused, Err(ImportError::NoRow { .. })),
            "{refused:?}"
        );
        let refused = ImportedStructure::new(&shifted, &options);
        match facing {
            FacingNodes::Sets { .. } => {
                assert!(matches!(refused, Err(ImportError::NotNodeForNode { .. })));
            }
            FacingNodes::Pairs(_) => assert!(refused.is_ok()),
        }
    }
}

/// Irregular nodes that differ between the bodies. Displacements that are linear over the joint are reproduced at the contact elements, so
/// forces keep their resultant and moments.
#[test]
fn weights_reproduce_what_is_linear_over_the_joint() {
    let mut chance = Chance::new(4);
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let side = [SIZE[0] / CELLS[0] as f64, SIZE[1] / CELLS[1] as f64];
    for &(upper, lower, _) in &pairs {
        for node in [upper, lower] {
            let at = read.positions.get_mut(&node).expect("a node");
            for d in 0..2 {
                let is_edge = at[d].abs() < 1e-9 || (at[d] - SIZE[d]).abs() < 1e-9;
                if !is_edge {
                    at[d] += 0.3 * (chance.next() - 0.5) * side[d];
                }
            }
        }
    }
    let facing = as_sets(&mut read, &pairs);
    let with = |elements: Option<[usize; 2]>| on_foot(&read, &facing, SIZE, elements);
    let refused = with(None);
    assert!(
        matches!(
            refused,
            Err(ImportError::Interface(InterfaceError::NoArray {
                nodes: 30,
                ..
            }))
        ),
        "{refused:?}"
    );
    let too_fine = with(Some([7, 3])).expect_err("32 places for 30 nodes");
    assert!(
        too_fine.to_string().contains("joint.elements"),
        "{too_fine}"
    );
    for counts in [[6, 3], [4, 3]] {
        let imported = with(Some(counts)).expect("a joint");
        let joint = imported.interface.as_ref().expect("a joint");
        assert!(!joint.is_regular && joint.array.absent.is_empty());
        for at in [ContactPorts::Nodes, ContactPorts::Faces] {
            let places = match at {
                ContactPorts::Nodes => joint.array.nodes(),
                ContactPorts::Faces => joint.array.faces(),
            };
            let ports = imported.ports(at).expect("ports");
            assert_eq!(ports.contacts, places.len());
            for (e, (place, _)) in places.iter().enumerate() {
                for (axis, is_x) in [(0, true), (1, false), (2, true)] {
                    // Rows of the upper body move by 1 + x or 1 + y. Rows of the lower body do not move.
                    let moved: f64 = ports.combinations[3 * e + axis]
                        .iter()
                        .filter(|(_, weight)| *weight != 0.0)
                        .map(|&(row, weight)| {
                            let node = row / 3 + CELLS_AT_FOOT + 1;
                            let at = read.positions[&(node as i64)];
                            let is_upper = node > blocks.systems[0].coordinates.len();
                            let along = if is_x { at[0] } else { at[1] };
                            if is_upper {
                                weight * (1.0 + along)
                            } else {
                                0.0
                            }
                        })
                        .sum();
                    let along = if is_x {
                        place[0] + 0.5 * SIZE[0]
                    } else {
                        place[1] + 0.5 * SIZE[1]
                    };
                    assert!(
                        (moved - 1.0 - along).abs() < 1e-9,
                        "{counts:?} {e}: {moved} {along}"
                    );
                }
            }
        }
    }
}

/// Number of fixed nodes at the beginning.
const CELLS_AT_FOOT: usize = (CELLS[0] + 1) * (CELLS[1] + 1);

/// A hole of nodes and a missing corner become absent rectangles.
#[test]
fn holes_and_outline_are_those_of_the_nodes() {
    let blocks = blocks();
    let (_, mut pairs) = foot_and_pairs(&blocks);
    // A node in the middle of a wider joint, and one corner of the joint.
    let width = CELLS[0] + 1;
    let gone = [2 + 2 * width, 0];
    let mut at = 0;
    pairs.retain(|_| {
        at += 1;
        !gone.contains(&(at - 1))
    });
    let read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let imported =
        import(&read, UnitSystem::default(), &pairs, &[], |_, _, _| ()).expect("a joint");
    let array = &imported.interface.as_ref().expect("a joint").array;
    assert_eq!(array.counts, CELLS);
    let mut absent = vec![[0, 0], [1, 1], [1, 2], [2, 1], [2, 2]];
    absent.sort_unstable();
    assert_eq!(array.absent, absent);
    assert_eq!(array.nodes().len(), pairs.len());
}

/// A node set covers a part of one face, and the other set covers the whole face. The contact is their overlap.
#[test]
fn one_face_may_be_larger_than_the_other() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let [x, y] = [
        3.0 * SIZE[0] / CELLS[0] as f64,
        2.0 * SIZE[1] / CELLS[1] as f64,
    ];
    let within = |node: i64| {
        let at = read.positions[&node];
        at[0] <= x + 1e-9 && at[1] <= y + 1e-9
    };
    let top: Vec<i64> = pairs
        .iter()
        .map(|p| p.0)
        .filter(|node| within(*node))
        .collect();
    let facing = as_sets(&mut read, &pairs);
    read.sets.insert("TOP".to_owned(), top.clone());
    let imported = on_foot(&read, &facing, [x, y], None).expect("a joint");
    assert_eq!(
        imported.interface.as_ref().expect("a joint").array.counts,
        [3, 2]
    );
    let ports = imported.ports(ContactPorts::Nodes).expect("ports");
    assert_eq!(ports.contacts, top.len());
    for port in &ports.combinations {
        let weights: Vec<f64> = port.iter().map(|term| term.1).collect();
        assert_eq!(weights, [-1.0, 1.0], "a node of each body");
    }
}

/// A lower face that covers only a part of the upper face, and faces that do not touch.
#[test]
fn faces_that_do_not_meet_are_told() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let above = pairs.iter().map(|pair| pair.0).min().expect("pairs");
    let found = |shift: [f64; 3]| {
        let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
        for (node, at) in &mut read.positions {
            if *node >= above {
                *at = [0, 1, 2].map(|d| at[d] + shift[d]);
            }
        }
        let facing = as_sets(&mut read, &pairs);
        on_foot(&read, &facing, SIZE, None)
    };
    let notes = |shift| found(shift).expect("a joint").doubts.join("\n");
    assert!(!notes([0.0; 3]).contains("apart"));
    // Pairs may also be misaligned by 1/20 of a contact element of 6 mm x 5 mm.
    assert!(!notes([0.2e-3, -0.2e-3, 0.0]).contains("apart"));
    assert!(notes([0.0, 0.0, 0.4e-3]).contains("0.4000 mm apart along its normal"));
    let told = |shift| found(shift).expect_err("a fault").to_string();
    let along_x = told([2e-3, 0.0, 0.0]);
    assert!(
        along_x.contains("2.0000 mm beyond") && along_x.contains("along x"),
        "{along_x}"
    );
    let along_y = told([0.0, -9e-3, 0.0]);
    assert!(
        along_y.contains("9.0000 mm beyond") && along_y.contains("along y"),
        "{along_y}"
    );
}

/// Suspicious matrices: truncated mass, two meshes, exchanged stiffness and mass, internal freedoms of solids.
#[test]
fn suspicions_are_told() {
    let sound = matrices(&blocks(), UnitSystem::default(), STRAIGHT);
    assert_eq!(model_warnings(&sound), Vec::<String>::new());
    let told = |change: &dyn Fn(&mut Matrices)| {
        let mut changed = sound.clone();
        change(&mut changed);
        model_warnings(&changed).join("\n")
    };
    let nodes = sound.positions.len();
    let rows = 3 * (nodes as u32 - 7);
    let cut = told(&|m: &mut Matrices| {
        let mass = m.mass.as_mut().expect("a mass");
        mass.entries.retain(|e| e.0 < rows && e.1 < rows);
    });
    assert!(
        cut.contains(&format!(
            "7 of {nodes} nodes have stiffness and no mass, the first {}",
            nodes - 6
        )),
        "{cut}"
    );
    let other = told(&|m: &mut Matrices| {
        let stiffness = m.stiffness.as_mut().expect("a stiffness");
        stiffness.entries.retain(|e| e.0 >= 30 && e.1 >= 30);
    });
    assert!(
        other.contains(&format!(
            "10 of {nodes} nodes have mass and no stiffness, the first 1:"
        )),
        "{other}"
    );
    let exchanged = told(&|m: &mut Matrices| std::mem::swap(&mut m.stiffness, &mut m.mass));
    assert!(exchanged.contains("may be exchanged"), "{exchanged}");
    // Internal nodes have numbers above the mesh nodes, have no position, and do not move with the body.
    let mut inner = sound.clone();
    inner.size += 3;
    let node = nodes as i64 + 1;
    inner
        .dofs
        .as_mut()
        .expect("freedoms")
        .extend((1..=3).map(|direction| Dof { node, direction }));
    inner.formats = vec![readers::CALCULIX_LIST, readers::DECK];
    let before = mass_by_direction(&sound);
    for matrix in [&mut inner.stiffness, &mut inner.mass] {
        let matrix = matrix.as_mut().expect("a matrix");
        matrix.size += 3;
        let last = matrix.size as u32;
        matrix.entries.extend((last - 3..last).map(|k| (k, k, 1.0)));
    }
    assert_eq!(mass_by_direction(&inner), before);
    assert!(model_warnings(&inner).is_empty());
    // A user may give positions for the nodes of the joint only. The other nodes still have mass.
    let mut partial = sound.clone();
    partial.positions.retain(|node, _| *node <= 42);
    assert_eq!(mass_by_direction(&partial), before);
    assert_eq!(inner_nodes_note(&partial), None);
    assert!(
        inner_nodes_note(&inner)
            .expect("a note")
            .contains("inner freedoms")
    );
}

/// The reader rejects local axes at every node that the scene uses, and only there.
#[test]
fn nodes_that_are_used_have_global_axes() {
    let blocks = blocks();
    let (foot, pairs) = foot_and_pairs(&blocks);
    let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let last = blocks.positions.len() as i64;
    let unused = last - 1;
    let mut with = |node: i64| {
        read.local_axes = vec![("axes of its own".to_owned(), vec![unused, node])];
        let point = last.to_string();
        import(
            &read,
            UnitSystem::default(),
            &pairs,
            &[&point],
            |_, _, _| (),
        )
    };
    for node in [pairs[3].0, pairs[3].1, foot[2], last] {
        let said = with(node).expect_err("a fault").to_string();
        let expected = format!(
            "node {node}, which the joint, a force, the response or structure.fixed uses, has axes of its own; write the matrices along the global axes"
        );
        assert_eq!(said, expected);
    }
    assert!(with(unused).is_ok());
}

/// An error about a missing set or position names the files that were not read.
#[test]
fn what_is_missing_is_told_with_what_was_not_read() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    read.unread = vec!["job.inp beside it is not read: line 3".to_owned()];
    let told = |read: &Matrices, points: &[&str]| {
        let found = import(read, UnitSystem::default(), &pairs, points, |_, _, _| ());
        found.expect_err("a fault").to_string()
    };
    let set = told(&read, &["TIP"]);
    assert!(
        set.ends_with("the files have none; job.inp beside it is not read: line 3"),
        "{set}"
    );
    let fixed = parse_fixed_rows(&read, "CLAMP")
        .expect_err("no set")
        .to_string();
    assert!(
        fixed.ends_with("there are none; job.inp beside it is not read: line 3"),
        "{fixed}"
    );
    read.positions.remove(&pairs[2].0);
    let position = told(&read, &[]);
    assert!(
        position.contains("no position")
            && position.ends_with("; job.inp beside it is not read: line 3"),
        "{position}"
    );
}

/// A massless node on springs to the ground is not connected to a mass.
#[test]
fn a_node_that_no_mass_is_joined_to_is_not_held() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let mut read = matrices(&blocks, UnitSystem::default(), STRAIGHT);
    let (node, first) = (blocks.positions.len() as i64 + 1, read.size as u32);
    read.size += 3;
    let dofs = read.dofs.as_mut().expect("freedoms");
    dofs.extend((1..=3).map(|direction| Dof { node, direction }));
    read.positions.insert(node, [0.0, 0.0, 0.05]);
    for matrix in [&mut read.stiffness, &mut read.mass] {
        matrix.as_mut().expect("a matrix").size += 3;
    }
    let stiffness = read.stiffness.as_mut().expect("a stiffness");
    stiffness
        .entries
        .extend((first..first + 3).map(|row| (row, row, 1e6)));
    let found = import(
        &read,
        UnitSystem::default(),
        &pairs,
        &[&node.to_string()],
        |_, _, _| (),
    );
    let said = found.expect_err("a fault").to_string();
    assert!(said.contains("no mass is connected to it"), "{said}");
}

/// Each error names the fault and the correction.
#[test]
fn joints_that_do_not_fit_are_refused() {
    let blocks = blocks();
    let (_, pairs) = foot_and_pairs(&blocks);
    let si = UnitSystem::default();
    let read = matrices(&blocks, si, STRAIGHT);
    let told =
        |found: Result<ImportedStructure, ImportError>| found.expect_err("a fault").to_string();
    let has = |text: String, parts: &[&str]| {
        for part in parts {
            assert!(text.contains(part), "{text}\nhas no \"{part}\"");
        }
    };
    let mm = UnitSystem { length: 1e-3, ..si };
    has(
        told(import(&read, mm, &pairs, &[], |_, _, _| ())),
        &["30", "20", "0.03", "structure.unit.length"],
    );
    let swapped = import(&read, si, &pairs, &[], |_, size, _| {
        *size = [SIZE[1], SIZE[0]]
    });
    has(
        told(swapped),
        &["x and y are the other way round", "structure.along"],
    );
    let other = import(&read, si, &pairs, &[], |_, _, elements| {
        *elements = Some([5, 3])
    });
    has(told(other), &["[5, 3]", "[5, 4]"]);
    let normal = import(&read, si, &pairs, &[], |wanted, _, _| {
        wanted.normal = Some([1.0, 0.0, 1.0])
    });
    has(
        told(normal),
        &["structure.normal", "45.0 degrees", "[0.0000, 0.0000"],
    );
    let mut above = read.clone();
    let upper: Vec<i64> = read.positions.keys().copied().filter(|n| *n > 90).collect();
    for node in upper {
        above.positions.get_mut(&node).expect("a node")[2] += 50e-3;
    }
    has(
        told(import(&above, si, &pairs, &[], |_, _, _| ())),
        &["50.0000 mm apart along the normal"],
    );
    let against = import(&read, si, &pairs, &[], |wanted, _, _| {
        wanted.normal = Some([0.0, 0.0, -1.0])
    });
    has(
        told(against),
        &["structure.normal", "exchange upper and lower"],
    );
    let mut crossed = pairs.clone();
    (crossed[0].1, crossed[1].1) = (crossed[1].1, crossed[0].1);
    has(
        told(import(&read, si, &crossed, &[], |_, _, _| ())),
        &["the pair", "6.0000 mm apart"],
    );
    let mut light = read.clone();
    let mass = light.mass.as_mut().expect("a mass");
    let place = mass
        .entries
        .iter()
        .position(|e| e.0 == 200 && e.1 == 200)
        .expect("an entry");
    mass.entries[place].2 = -1.0;
    has(
        told(import(&light, si, &pairs, &[], |_, _, _| ())),
        &["67.3", "zero or more"],
    );
    let mut twice = pairs.clone();
    twice[1].0 = twice[0].0;
    has(
        told(import(&read, si, &twice, &[], |_, _, _| ())),
        &["two pairs"],
    );
    let mut both = pairs.clone();
    both[1].1 = both[0].0;
    has(
        told(import(&read, si, &both, &[], |_, _, _| ())),
        &["both sides"],
    );
    let mut held = pairs.clone();
    held[0].1 = 1;
    has(
        told(import(&read, si, &held, &[], |_, _, _| ())),
        &["off the plane"],
    );
    has(
        told(import(&read, si, &pairs, &["TIP"], |_, _, _| ())),
        &["\"TIP\"", "none"],
    );
    has(
        told(import(&read, si, &pairs, &["3"], |_, _, _| ())),
        &["node 3", "along x", "structure.fixed"],
    );
    let wide: Vec<_> = pairs.iter().map(|p| (p.0, p.1, Some(1e-4))).collect();
    has(
        told(import(&read, si, &wide, &[], |_, _, _| ())),
        &["areas", "mm2"],
    );
    let mut bent = read.clone();
    bent.positions.get_mut(&pairs[7].0).expect("a node")[2] += 1e-3;
    has(
        told(import(&bent, si, &pairs, &[], |_, _, _| ())),
        &["off the plane", &pairs[7].0.to_string()],
    );
    let mut alone = read.clone();
    let joint: Vec<i64> = pairs.iter().flat_map(|p| [p.0, p.1]).collect();
    alone.positions.retain(|node, _| joint.contains(node));
    has(
        told(import(&alone, si, &pairs, &[], |_, _, _| ())),
        &["structure.normal"],
    );
    let given = import(&alone, si, &pairs, &[], |wanted, _, _| {
        wanted.normal = Some([0.0, 0.0, 2.0])
    });
    assert_eq!(
        given.expect("a joint").interface.expect("a joint").layers,
        Vec::<f64>::new()
    );
    let mut nowhere = read.clone();
    nowhere.positions.remove(&pairs[3].1);
    has(
        told(import(&nowhere, si, &pairs, &[], |_, _, _| ())),
        &["no position", "structure.nodes"],
    );
    let mut skew = read.clone();
    let stiffness = skew.stiffness.as_mut().expect("a stiffness");
    let place = stiffness
        .entries
        .iter()
        .position(|e| e.0 == 200 && e.1 == 201)
        .expect("an entry");
    stiffness.entries[place].2 *= 1.01;
    has(
        told(import(&skew, si, &pairs, &[], |_, _, _| ())),
        &["not symmetric", "67.3", "68.1"],
    );
    let mut no_rows = read.clone();
    no_rows.dofs = None;
    has(
        told(import(&no_rows, si, &pairs, &[], |_, _, _| ())),
        &["no file says", "structure.nodes"],
    );
}
