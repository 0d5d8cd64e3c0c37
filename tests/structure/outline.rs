//! Outline of a mesh, and the modes at the outline.

use fretwear::structure::assembly::System;
use fretwear::structure::element::Formulation;
use fretwear::structure::mesh::Mesh;
use fretwear::structure::modes::ModeOptions;
use fretwear::structure::reduction::{ContactPorts, Ports, reduce_with_shapes};
use fretwear::structure::resonator::Resonator;

/// Rounding of sums of a few terms, relative to the largest term.
const ROUNDING: f64 = 1e-12;

fn length(mesh: &Mesh, [from, to]: [usize; 2]) -> f64 {
    let (a, b) = (mesh.nodes[from], mesh.nodes[to]);
    (0..3).map(|k| (b[k] - a[k]).powi(2)).sum::<f64>().sqrt()
}

#[test]
fn a_block_has_twelve_edges() {
    let size = [0.3, 0.2, 0.1];
    let mesh = Mesh::block(size, [23, 3, 2], Resonator::default().material);
    let lines = mesh.outline();
    assert_eq!(lines.len(), 12);
    let lengths = lines
        .iter()
        .map(|line| length(&mesh, [line.nodes[0], line.nodes[line.nodes.len() - 1]]));
    let expected = 4.0 * size.iter().sum::<f64>();
    assert!((lengths.sum::<f64>() / expected - 1.0).abs() < ROUNDING);
    // An edge of 23 cells keeps eight parts. An edge of three cells keeps all three parts.
    let longest = lines.iter().map(|line| line.nodes.len()).max();
    let counts = |count: usize| {
        lines
            .iter()
            .filter(|line| line.nodes.len() == count)
            .count()
    };
    assert_eq!(
        (longest, counts(9), counts(4), counts(3)),
        (Some(9), 4, 4, 4)
    );
}

#[test]
fn the_outline_of_the_resonator_is_that_of_its_bodies_without_the_hole() {
    let resonator = Resonator {
        block_cells: 3,
        window_cells: 4,
        wall_cells: 2,
        half_depth_cells: 2,
        lap_cells: 9,
        head_cells: 1,
        inner_cells: 2,
        rim_cells: 2,
        ..Resonator::default()
    };
    let modes = 4;
    let (reduced, outline) = resonator
        .reduce(modes, ContactPorts::Nodes)
        .expect("reduced");
    let points: usize = outline.lines.iter().map(|(_, points)| points).sum();
    assert_eq!(points, outline.positions.len());
    assert_eq!(outline.shapes.rows(), 3 * points);
    assert_eq!(
        outline.shapes.columns(),
        reduced.rigid.columns() + reduced.omega.len()
    );
    for part in ["mass_1", "mass_2", "bolt"] {
        assert!(outline.lines.iter().any(|(of, _)| *of == part), "{part}");
    }
    let along = outline.positions.iter().map(|p| p[0]);
    let [low, high] = along.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| {
        [low.min(x), high.max(x)]
    });
    let own = high - low;
    // `length` excludes one stub and one gap on the far side.
    let whole = resonator.length() + resonator.stub_length + resonator.gap_length;
    assert!((own / whole - 1.0).abs() < ROUNDING, "{own} m of {whole} m");
}

/// The ports of a contact element are the displacements of the upper nodes minus the lower nodes.
#[test]
fn modes_at_nodes_are_those_of_the_ports() {
    let resonator = Resonator {
        lap_cells: 9,
        half_depth_cells: 2,
        block_cells: 3,
        window_cells: 4,
        ..Resonator::default()
    };
    let meshed = resonator.mesh().expect("a mesh");
    let system = System::assemble(&meshed.mesh, Formulation::IncompatibleModes, &[]);
    let system = system.expect("a system");
    let ports = Ports::new(&meshed.contacts, &meshed.points, ContactPorts::Faces);
    let element = 5;
    let pairs = meshed.contacts[element].pairs;
    let nodes: Vec<usize> = pairs
        .iter()
        .flat_map(|(lower, upper)| [*lower, *upper])
        .collect();
    let options = ModeOptions::new(5);
    let (reduced, shapes) = reduce_with_shapes(&system, ports, &nodes, &options).expect("reduced");
    let held = reduced.rigid.columns();
    let largest = shapes
        .as_slice()
        .iter()
        .fold(0.0f64, |most, v| most.max(v.abs()));
    for mode in 0..shapes.columns() {
        for axis in 0..3 {
            let pair = |k: usize| shapes[(6 * k + 3 + axis, mode)] - shapes[(6 * k + axis, mode)];
            let found = 0.25 * (0..4).map(pair).sum::<f64>();
            let port = 3 * element + axis;
            let expected = match mode.checked_sub(held) {
                None => reduced.rigid[(port, mode)],
                Some(elastic) => reduced.shapes[(port, elastic)],
            };
            assert!(
                (found - expected).abs() < ROUNDING * largest,
                "{mode} {axis}"
            );
        }
    }
}
