//! Mesh of the resonator, and its frequencies against an independent finite-element solution.

use std::collections::HashSet;
use std::f64::consts::TAU;

use fretwear::structure::StructureError;
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::modes::{ModeOptions, lowest, rigid_modes, shift};
use fretwear::structure::reduction::{ContactPorts, Ports};
use fretwear::structure::resonator::{BOLT, Resonator, ResonatorMesh};

/// Relative rounding of the independent solution, which prints five digits for the same elements on the same mesh.
const PRINTED: f64 = 2e-5;

fn published() -> ResonatorMesh {
    Resonator::default().mesh().unwrap()
}

/// Elastic frequencies \[Hz\], lowest first.
pub(super) fn frequencies(system: &System, count: usize) -> Vec<f64> {
    let shift = shift(system);
    let factor = system
        .shifted_factor(shift, &system.elimination_order(&[]))
        .unwrap();
    let rigid = rigid_modes(system, shift).unwrap();
    assert_eq!(rigid.columns(), 6);
    let modes = lowest(system, &factor, shift, &rigid, &ModeOptions::new(count)).unwrap();
    modes.omega.iter().map(|w| w / TAU).collect()
}

fn assert_within(found: &[f64], expected: &[f64], tolerance: f64) {
    println!("{found:.2?}");
    for (f, e) in found.iter().zip(expected) {
        assert!((f / e - 1.0).abs() < tolerance, "{f} {e}");
    }
}

#[test]
fn the_mesh_has_the_elements_of_the_published_case() {
    let ResonatorMesh {
        mesh,
        contacts,
        points,
    } = published();
    let bolt = mesh.elements.iter().filter(|e| e.part == BOLT).count();
    assert_eq!((mesh.elements.len() - bolt, bolt), (17_740, 414));
    assert_eq!(mesh.nodes.len(), 22_910);
    assert_eq!(contacts.len(), 340);
    let used: HashSet<usize> = mesh.elements.iter().flat_map(|e| e.nodes).collect();
    assert_eq!(
        used.len(),
        mesh.nodes.len(),
        "every node belongs to an element"
    );

    let area: f64 = contacts.iter().map(|c| c.area).sum();
    assert!((area / (0.04 * 0.04 * 340.0 / 361.0) - 1.0).abs() < 1e-12);
    for contact in &contacts {
        let mut centre = [0.0; 2];
        for &(lower, upper) in &contact.pairs {
            assert_ne!(lower, upper);
            assert_eq!(mesh.nodes[lower], mesh.nodes[upper]);
            assert_eq!(mesh.nodes[lower][2], 0.0);
            centre[0] += 0.25 * mesh.nodes[lower][0];
            centre[1] += 0.25 * mesh.nodes[lower][1];
        }
        assert!((centre[0] - contact.centre[0]).abs() < 1e-15);
        assert!((centre[1] - contact.centre[1]).abs() < 1e-15);
        let [i, j] = contact.cell;
        let (from_x, from_y) = (i.abs_diff(9), j.abs_diff(9));
        assert!(
            from_x.max(from_y) > 2 || (from_x == 2 && from_y == 2),
            "{i} {j}"
        );
    }
    // The lower nodes belong to the lower body.
    let lower: HashSet<usize> = contacts.iter().flat_map(|c| c.pairs.map(|p| p.0)).collect();
    for element in &mesh.elements {
        let top = element.nodes.map(|n| mesh.nodes[n][2]).into_iter();
        let touches = element.nodes.iter().any(|n| lower.contains(n));
        assert!(!touches || top.fold(f64::NEG_INFINITY, f64::max) < 1e-12);
    }
    assert_eq!(points[0].name, "far_wall");
    assert!((points[0].position[0] - 0.169).abs() < 1e-12);
    let weights: Vec<f64> = points[0].weights.iter().map(|w| w.1).collect();
    assert_eq!(weights.len(), 2);
    assert!(weights.iter().all(|w| (w - 0.5).abs() < 1e-9));
}

#[test]
fn the_bonded_resonator_has_the_frequencies_of_an_independent_solution() {
    let tied = Resonator {
        tied: true,
        ..Resonator::default()
    };
    let ResonatorMesh { mesh, contacts, .. } = tied.mesh().unwrap();
    assert!(contacts.is_empty());
    let system = System::assemble(&mesh, Formulation::IncompatibleModes, &[]).unwrap();
    assert!(
        (system.total_mass() - 14.92).abs() < 0.005,
        "{}",
        system.total_mass()
    );
    let expected = [
        471.03, 539.20, 685.15, 989.91, 1764.4, 2438.9, 2584.2, 2783.4,
    ];
    assert_within(&frequencies(&system, 8), &expected, PRINTED);
    let plain = System::assemble(&mesh, Formulation::Plain, &[]).unwrap();
    assert_within(&frequencies(&plain, 4)[3..], &[1021.13], PRINTED);
}

#[test]
fn the_sprung_resonator_has_the_frequencies_of_an_independent_solution() {
    let ResonatorMesh { mesh, contacts, .. } = published();
    let ports = Ports::new(&contacts, &[], ContactPorts::Faces);
    let springs: Vec<Spring> = ports
        .combinations
        .iter()
        .enumerate()
        .map(|(port, on)| Spring {
            on: on.clone(),
            stiffness: if port % 3 == 2 { 1.2e10 } else { 1e10 } / 340.0,
        })
        .collect();
    let system = System::assemble(&mesh, Formulation::IncompatibleModes, &springs).unwrap();
    let expected = [456.3, 524.1, 620.9, 979.2, 1713.7, 2284.6, 2535.3, 2759.5];
    assert_within(&frequencies(&system, 8), &expected, 1e-4);
}

#[test]
fn numbers_that_make_no_resonator_are_refused() {
    let refused = |change: fn(&mut Resonator)| {
        let mut resonator = Resonator::default();
        change(&mut resonator);
        match resonator.mesh().err() {
            Some(
                StructureError::OutOfRange { name, .. }
                | StructureError::Contradiction { name, .. },
            ) => name,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(refused(|r| r.gap_length = 0.0), "gap_length");
    assert_eq!(refused(|r| r.depth = f64::NAN), "depth");
    assert_eq!(
        refused(|r| r.wall_thickness = f64::INFINITY),
        "wall_thickness"
    );
    assert_eq!(refused(|r| r.lap_cells = 18), "lap_cells");
    assert_eq!(refused(|r| r.lap_cells = 7), "lap_cells");
    assert_eq!(refused(|r| r.head_cells = 0), "head_cells");
    assert_eq!(refused(|r| r.window_height = 0.03), "window_height");
    assert_eq!(refused(|r| r.frame_height = 0.12), "frame_height");
    assert_eq!(refused(|r| r.block_height = f64::NAN), "block_height");
    assert_eq!(refused(|r| r.material.density = -1.0), "density");
}

#[test]
fn another_block_height_changes_mass_1_alone() {
    let mut resonator = Resonator {
        lap_cells: 9,
        block_cells: 2,
        ..Resonator::default()
    };
    let mass = |r: &Resonator| {
        let mesh = r.mesh().unwrap().mesh;
        let system = System::assemble(&mesh, Formulation::Plain, &[]).unwrap();
        system.total_mass()
    };
    let before = mass(&resonator);
    resonator.block_height = 0.2;
    let added = 7949.0 * 0.07 * 0.06 * 0.01;
    assert!(((mass(&resonator) - before) / added - 1.0).abs() < 1e-9);
}
