//! The reduced model against direct solves of the whole structure.

use std::f64::consts::TAU;

use fretwear::linalg::{Matrix, SparseIndefinite};
use fretwear::structure::StructureError;
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::mesh::Mesh;
use fretwear::structure::modes::ModeOptions;
use fretwear::structure::reduction::{ContactPorts, Ports, ReducedStructure, reduce};
use fretwear::structure::resonator::{FacingFaces, Resonator};

/// Resonator of the same proportions with few cells.
pub fn coarse_resonator() -> Resonator {
    Resonator {
        lap_cells: 9,
        half_depth_cells: 2,
        block_cells: 3,
        stub_cells: 1,
        gap_cells: 1,
        leaf_cells: 2,
        window_cells: 4,
        wall_cells: 2,
        inner_cells: 2,
        rim_cells: 2,
        head_cells: 1,
        ..Resonator::default()
    }
}

pub fn coarse() -> (System, Ports) {
    parts(&coarse_resonator())
}

fn parts(resonator: &Resonator) -> (System, Ports) {
    let model = resonator.mesh().unwrap();
    let system = System::assemble(&model.mesh, Formulation::IncompatibleModes, &[]).unwrap();
    let ports = Ports::new(&model.contacts, &model.points, ContactPorts::Faces);
    (system, ports)
}

/// Columns of the receptance of all ports \[m/N\] by a factorization of K − ω²M.
pub fn direct(system: &System, ports: &Ports, omega: f64, columns: &[usize]) -> Matrix {
    let dynamic = system.stiffness.plus(-omega * omega, &system.mass);
    let factor = SparseIndefinite::new(&dynamic, &system.elimination_order(&[])).unwrap();
    let mut force = Matrix::zeros(system.size(), columns.len());
    for (c, &port) in columns.iter().enumerate() {
        for &(dof, weight) in &ports.combinations[port] {
            force[(dof, c)] += weight;
        }
    }
    let mut displacement = force.clone();
    factor.solve(&mut displacement);
    let mut missed = dynamic.times(&displacement);
    missed.add(-1.0, &force);
    let size = |m: &Matrix| m.as_slice().iter().map(|v| v * v).sum::<f64>().sqrt();
    assert!(
        size(&missed) < 1e-8 * size(&force),
        "the direct solve is exact"
    );
    Matrix::from_fn(ports.len(), columns.len(), |port, c| {
        let terms = ports.combinations[port].iter();
        terms.map(|&(dof, w)| w * displacement[(dof, c)]).sum()
    })
}

/// Relative error ‖found − expected‖ in the Frobenius norm, over some rows and some of the named columns. `found` has all columns, and
/// `expected` has the named columns.
fn error(
    found: &Matrix,
    expected: &Matrix,
    columns: &[usize],
    of: std::ops::Range<usize>,
    rows: std::ops::Range<usize>,
) -> f64 {
    let (mut off, mut size) = (0.0, 0.0);
    for c in of {
        for row in rows.clone() {
            off += (found[(row, columns[c])] - expected[(row, c)]).powi(2);
            size += expected[(row, c)].powi(2);
        }
    }
    (off / size).sqrt()
}

/// Receptance without the residual or its slope.
fn partly(reduced: &ReducedStructure, omega: f64, residual: bool, slope: bool) -> Matrix {
    let mut receptance = reduced.receptance(omega, 0.0).0;
    if !residual {
        receptance.add(-1.0, &reduced.residual);
    }
    if !slope {
        receptance.add(-omega * omega, &reduced.residual_slope);
    }
    receptance
}

#[test]
#[ignore = "long: 15 seconds"]
fn thirty_modes_and_the_residual_of_the_published_case() {
    let (system, ports) = parts(&Resonator::default());
    let start = std::time::Instant::now();
    let reduced = reduce(&system, ports.clone(), &ModeOptions::new(30)).unwrap();
    println!(
        "reduced in {:.1} s, {:.0} MB of factor",
        start.elapsed().as_secs_f64(),
        8e-6 * reduced.factor_entries as f64
    );
    assert_eq!((reduced.rigid.columns(), reduced.omega.len()), (6, 30));
    assert!((reduced.mass - 14.915).abs() < 1e-3);
    let drive = ports.of_point("far_wall", 0).unwrap();
    assert_eq!(drive, 1020);
    // Elements at the corner of the lap, beside the hole and in between, and the drive point.
    let columns = [0, 1, 2, 500, 501, 502, 760, 761, 762, drive];
    let contact = 0..ports.contact_ports();
    for hz in [400.0, 985.0, 3000.0] {
        let expected = direct(&system, &ports, TAU * hz, &columns);
        let found = reduced.receptance(TAU * hz, 0.0).0;
        let at_contact = error(&found, &expected, &columns, 0..9, contact.clone());
        let from_drive = error(&found, &expected, &columns, 9..10, contact.clone());
        let at_drive = error(&found, &expected, &columns, 9..10, drive..drive + 1);
        let without = partly(&reduced, TAU * hz, false, false);
        let modes_alone = error(&without, &expected, &columns, 0..9, contact.clone());
        println!(
            "{hz} Hz: {at_contact:.1e} {from_drive:.1e} {at_drive:.1e}; modes alone {modes_alone:.1e}"
        );
        assert!(at_contact.max(from_drive).max(at_drive) < 1e-4);
        assert!(modes_alone > 1e-2);
    }

    // Stuck joint in the reduced model against the independent solution, with kn = 1.2 kt.
    for (kt, expected) in [(1e9, 928.7), (1e10, 979.2), (1e11, 987.5)] {
        let stiffness: Vec<f64> = (0..1020)
            .map(|port| if port % 3 == 2 { 1.2 * kt } else { kt } / 340.0)
            .collect();
        let sprung = reduced.with_springs(&stiffness, TAU * 1000.0).unwrap();
        let breathing = sprung.omega[9] / TAU;
        println!("kt {kt:e} N/m: {breathing:.2} Hz");
        assert!(
            (breathing / expected - 1.0).abs() < 3e-4,
            "{breathing} {expected}"
        );
    }
}

/// Error of the contact's receptance at 1000 Hz over the number of modes: without residual, with the static residual, and with its slope.
#[test]
fn the_residual_is_what_makes_few_modes_enough() {
    let (system, ports) = coarse();
    let columns = [0, 1, 2, 90, 91, 92];
    let omega = TAU * 1000.0;
    let expected = direct(&system, &ports, omega, &columns);
    let rows = 0..ports.contact_ports();
    let mut table = Vec::new();
    println!("modes  alone    residual slope");
    for count in [10, 20, 30, 60] {
        let reduced = reduce(&system, ports.clone(), &ModeOptions::new(count)).unwrap();
        let errors = [(false, false), (true, false), (true, true)].map(|(residual, slope)| {
            let found = partly(&reduced, omega, residual, slope);
            error(&found, &expected, &columns, 0..6, rows.clone())
        });
        println!(
            "{count:5}  {:.1e}  {:.1e}  {:.1e}",
            errors[0], errors[1], errors[2]
        );
        assert!(errors[2] < errors[1] && errors[1] < errors[0]);
        table.push(errors);
    }
    let thirty = table[2];
    assert!(thirty[0] > 1e-2 && thirty[2] < 1e-4, "{thirty:?}");
}

#[test]
fn the_residual_is_a_flexibility() {
    let (system, ports) = coarse();
    let reduced = reduce(&system, ports.clone(), &ModeOptions::new(30)).unwrap();
    for matrix in [&reduced.residual, &reduced.residual_slope] {
        let scale = (0..ports.len()).map(|p| matrix[(p, p)]).fold(0.0, f64::max);
        let (values, _) = matrix.symmetric_eigen().unwrap();
        // The residual is positive except for rounding from the rigid modes.
        assert!(values[0] > -1e-6 * scale, "{} {scale}", values[0]);
        for i in 0..ports.len() {
            for j in 0..i {
                assert!((matrix[(i, j)] - matrix[(j, i)]).abs() < 1e-9 * scale);
            }
        }
    }
    let stiffest = reduced.rigid.as_slice();
    let contact = ports.contact_ports();
    for r in 0..6 {
        let moved = &stiffest[r * ports.len()..r * ports.len() + contact];
        assert!(
            moved.iter().all(|v| v.abs() < 1e-9),
            "connected bodies have equal rigid motions at both sides of the contact"
        );
    }
}

#[test]
fn springs_in_the_reduced_model_are_springs_in_the_whole() {
    let (system, ports) = coarse();
    let reduced = reduce(&system, ports.clone(), &ModeOptions::new(30)).unwrap();
    // Every seventh element is open. The other elements have different stiffnesses.
    let stiffness: Vec<f64> = (0..ports.contact_ports())
        .map(|port| {
            if (port / 3) % 7 == 0 {
                0.0
            } else {
                2e7 + 1e6 * (port % 13) as f64
            }
        })
        .collect();
    let sprung = reduced.with_springs(&stiffness, TAU * 1000.0).unwrap();
    let springs: Vec<Spring> = stiffness
        .iter()
        .zip(&ports.combinations)
        .map(|(&stiffness, on)| Spring {
            on: on.clone(),
            stiffness,
        })
        .collect();
    let mesh = coarse_resonator().mesh().unwrap().mesh;
    let whole = System::assemble(&mesh, Formulation::IncompatibleModes, &springs).unwrap();
    let plain = reduce(
        &whole,
        Ports::new(&[], &[], ContactPorts::Faces),
        &ModeOptions::new(8),
    )
    .unwrap();
    for r in 0..6 {
        assert!(sprung.omega[r] < 1e-2 * sprung.omega[6]);
    }
    for (r, expected) in plain.omega.iter().enumerate() {
        let found = sprung.omega[6 + r];
        assert!(
            (found / expected - 1.0).abs() < 1e-3,
            "{r}: {found} {expected}"
        );
    }
    let gram = sprung.vectors.transpose_times(&sprung.vectors);
    assert!((gram[(3, 3)] - 1.0).abs() < 1e-12 && gram[(3, 17)].abs() < 1e-12);
    assert!(reduced.with_springs(&stiffness[1..], 0.0).is_err());
    let mut negative = stiffness.clone();
    negative[5] = -1.0;
    assert!(matches!(
        reduced.with_springs(&negative, 0.0),
        Err(StructureError::OutOfRange { value, .. }) if value == -1.0
    ));
}

/// Two facing blocks without supports have twelve rigid modes, including six relative modes.
#[test]
fn bodies_apart_keep_their_relative_rigid_modes() {
    let steel = Resonator::default().material;
    let lower = Mesh::block([0.05, 0.03, 0.02], [5, 4, 2], steel);
    let mut mesh = lower.clone();
    let count = lower.nodes.len();
    mesh.nodes
        .extend(lower.nodes.iter().map(|x| [x[0], x[1], x[2] + 0.02]));
    mesh.elements.extend(lower.elements.iter().map(|e| {
        let mut above = *e;
        above.nodes = e.nodes.map(|n| n + count);
        above
    }));
    let node = |i: usize, j: usize, k: usize| i + 6 * (j + 5 * k);
    let facing = |i: usize, j: usize| FacingFaces {
        cell: [i, j],
        centre: [0.01 * (i as f64 + 0.5), 0.0075 * (j as f64 + 0.5)],
        area: 7.5e-5,
        pairs: [(0, 0), (1, 0), (1, 1), (0, 1)]
            .map(|(a, b)| (node(i + a, j + b, 2), count + node(i + a, j + b, 0))),
    };
    let contacts = [facing(0, 0), facing(2, 1), facing(4, 3)];
    let points = [mesh.point("top", [0.025, 0.01, 0.04]).unwrap()];
    let system = System::assemble(&mesh, Formulation::IncompatibleModes, &[]).unwrap();
    assert_eq!(system.bodies().1, 2);
    let ports = Ports::new(&contacts, &points, ContactPorts::Faces);
    let reduced = reduce(&system, ports.clone(), &ModeOptions::new(20)).unwrap();
    assert_eq!(reduced.rigid.columns(), 12);
    let columns: Vec<usize> = (0..ports.len()).collect();
    for hz in [200.0, 3000.0] {
        let expected = direct(&system, &ports, TAU * hz, &columns);
        let found = reduced.receptance(TAU * hz, 0.0).0;
        let off = error(&found, &expected, &columns, 0..ports.len(), 0..ports.len());
        // The modes above the kept modes cause the error, with the third power of (ω/ω_n)².
        assert!(off < 1e-5, "{hz} Hz: {off:e}");
    }
}

#[test]
fn damping_lags_and_peaks_as_one_mode_does() {
    let (system, ports) = coarse();
    let reduced = reduce(&system, ports.clone(), &ModeOptions::new(12)).unwrap();
    let (drive, zeta) = (ports.of_point("far_wall", 0).unwrap(), 1e-4);
    let mode = (0..12)
        .max_by(|&a, &b| {
            let strength = |r: usize| reduced.shapes[(drive, r)].abs() / reduced.omega[r];
            strength(a).total_cmp(&strength(b))
        })
        .unwrap();
    let omega = reduced.omega[mode];
    let (_, imaginary) = reduced.receptance(omega, zeta);
    let alone = -reduced.shapes[(drive, mode)].powi(2) / (2.0 * zeta * omega * omega);
    assert!((imaginary[(drive, drive)] / alone - 1.0).abs() < 1e-2);
}

#[test]
fn a_port_beyond_the_mesh_is_refused() {
    let (system, _) = coarse();
    let ports = Ports {
        combinations: vec![vec![(system.size() + 2, 1.0)]],
        contacts: 0,
        points: vec!["nowhere".to_owned()],
    };
    let found = reduce(&system, ports, &ModeOptions::new(3)).err();
    assert!(
        matches!(
            found,
            Some(StructureError::DoesNotExist { what: "node", .. })
        ),
        "{found:?}"
    );
}
