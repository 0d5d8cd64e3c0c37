//! Tests of the finite-element resonator joined to contact elements: signs, frequencies, a tied joint.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use fretwear::dynamics::cycle::joint_cycle;
use fretwear::dynamics::{
    BalanceSettings, ContactElement, Damping, DynamicsError, ElementState, FrictionLaw,
    LinearModel, Load, Oscillator, Response, SecondOrder, reduced_model, reference_springs,
};
use fretwear::linalg::{Matrix, SparseIndefinite};
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::modes::ModeOptions;
use fretwear::structure::reduction::{ContactPorts, Ports, ReducedStructure, reduce};
use fretwear::structure::resonator::{Resonator, ResonatorMesh};

use super::{balance_of, one_slider, swept};

/// Meshed resonator and its reduction.
pub struct Whole {
    pub mesh: ResonatorMesh,
    pub reduced: ReducedStructure,
}

fn whole(resonator: &Resonator, modes: usize) -> Whole {
    let mesh = resonator.mesh().unwrap();
    let system = System::assemble(&mesh.mesh, Formulation::IncompatibleModes, &[]).unwrap();
    let ports = Ports::new(&mesh.contacts, &mesh.points, ContactPorts::Faces);
    let reduced = reduce(&system, ports, &ModeOptions::new(modes)).unwrap();
    Whole { mesh, reduced }
}

/// Published case: 340 contact elements, 30 modes.
pub fn published() -> &'static Whole {
    static CACHE: OnceLock<Whole> = OnceLock::new();
    CACHE.get_or_init(|| whole(&Resonator::default(), 30))
}

/// Resonator of the same proportions with few cells.
pub fn coarse() -> Resonator {
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

/// Joint with kt 1e4 N/µm, kn 1.2e4 N/µm and 30 kN in total, uniform by area.
pub fn elements(mesh: &ResonatorMesh) -> Vec<ContactElement> {
    let area: f64 = mesh.contacts.iter().map(|c| c.area).sum();
    let each = mesh.contacts.iter().map(|contact| {
        let share = contact.area / area;
        ContactElement {
            area: contact.area,
            ..one_slider(
                FrictionLaw::Cone,
                0.6,
                3e4 * share,
                [1e10 * share, 1.2e10 * share],
            )
        }
    });
    each.collect()
}

/// Force along x at the middle of the far wall; its port follows the ports of the contact.
pub fn far_wall(model: &SecondOrder, force: f64) -> Vec<Load> {
    vec![Oscillator::load(model.contact_dofs(), force, 0.0)]
}

/// Under a small load all elements stick: the displacements equal the displacements of the whole system with springs, in size and sign.
#[test]
fn a_stuck_joint_moves_as_the_whole_structure_with_springs() {
    let resonator = coarse();
    let whole = whole(&resonator, 30);
    let elements = elements(&whole.mesh);
    let stiffness = reference_springs(&elements);
    let ports = &whole.reduced.ports;
    let drive = ports.of_point("far_wall", 0).unwrap();
    let other = ports.of_point("block", 1).unwrap();
    let none = Damping {
        ratio: 0.0,
        springs: None,
    };
    let model = reduced_model(&whole.reduced, &[drive, other, drive], none).unwrap();
    assert_eq!(
        (model.contact_dofs(), model.ports()),
        (ports.contact_ports(), ports.contact_ports() + 3)
    );
    let load = far_wall(&model, 1.0);
    let balance = balance_of(&model, &elements, 1, &load, BalanceSettings::default());

    let springs: Vec<Spring> = ports.combinations[..ports.contact_ports()]
        .iter()
        .zip(&stiffness)
        .map(|(on, &stiffness)| Spring {
            on: on.clone(),
            stiffness,
        })
        .collect();
    let system =
        System::assemble(&whole.mesh.mesh, Formulation::IncompatibleModes, &springs).unwrap();
    for hz in [300.0, 930.0, 1100.0] {
        let omega = TAU * hz;
        let dynamic = system.stiffness.plus(-omega * omega, &system.mass);
        let factor = SparseIndefinite::new(&dynamic, &system.elimination_order(&[])).unwrap();
        let mut expected = Matrix::zeros(system.size(), 1);
        for &(dof, weight) in &ports.combinations[drive] {
            expected[(dof, 0)] += weight;
        }
        factor.solve(&mut expected);
        let at = |port: usize| -> f64 {
            let terms = ports.combinations[port].iter();
            terms.map(|&(dof, w)| w * expected[(dof, 0)]).sum()
        };

        let response = balance.solve(omega, None).unwrap();
        assert_eq!(response.active_elements(), 0, "stuck");
        let found = |port: usize| response.displacement[3 * port + 1];
        // Error of the pseudo-modes for the modes above the 30th, see `unreduced.rs`. A resonance is near 930 Hz.
        let tolerance = 2e-4;
        let contact = ports.contact_ports();
        let pairs = [(contact, drive), (contact + 1, other), (contact + 2, drive)];
        for (new, old) in pairs {
            let (found, expected) = (found(new), at(old));
            assert!(
                (found - expected).abs() < tolerance * at(drive).abs(),
                "{hz} Hz, port {old}: {found:e} {expected:e}"
            );
        }
        let largest = (0..contact).fold(0.0_f64, |m, p| m.max(at(p).abs()));
        for port in 0..contact {
            // Normal displacement is positive where the bodies approach.
            let sign = if port % 3 == 2 { -1.0 } else { 1.0 };
            let (found, expected) = (found(port), sign * at(port));
            assert!(
                (found - expected).abs() < tolerance * largest,
                "{hz} Hz, contact port {port}: {found:e} {expected:e}, largest {largest:e}"
            );
        }
    }
}

#[test]
#[ignore = "long: 10 seconds"]
fn the_joined_model_has_the_frequencies_of_an_independent_solution() {
    let whole = published();
    let none = Damping {
        ratio: 0.0,
        springs: None,
    };
    let model = reduced_model(&whole.reduced, &[], none).unwrap();
    for (kt, expected) in [(1e9, vec![928.7]), (1e10, vec![]), (1e11, vec![987.5])] {
        let expected = if expected.is_empty() {
            vec![456.3, 524.1, 620.9, 979.2, 1713.7, 2284.6, 2535.3, 2759.5]
        } else {
            expected
        };
        let springs: Vec<f64> = (0..1020)
            .map(|port| if port % 3 == 2 { 1.2 * kt } else { kt } / 340.0)
            .collect();
        let (omega, _) = model.modes(&springs).unwrap();
        let first = if expected.len() == 1 { 9 } else { 6 };
        for (found, expected) in omega[first..].iter().zip(expected) {
            let found = found / TAU;
            println!("kt {kt:e}: {found:.3} Hz, {expected} Hz");
            assert!((found / expected - 1.0).abs() < 3e-3, "{found} {expected}");
        }
    }
}

/// A bonded joint has no contact degree of freedom; its response follows from its modes.
#[test]
fn a_tied_joint_is_linear() {
    let resonator = Resonator {
        tied: true,
        ..coarse()
    };
    let whole = whole(&resonator, 20);
    let reduced = &whole.reduced;
    assert_eq!(reduced.ports.contact_ports(), 0);
    let ratio = 0.002;
    let ports = [
        reduced.ports.of_point("far_wall", 0).unwrap(),
        reduced.ports.of_point("block", 0).unwrap(),
    ];
    let damping = Damping {
        ratio,
        springs: Some(&[]),
    };
    let model = reduced_model(reduced, &ports, damping).unwrap();
    let load = far_wall(&model, 500.0);
    let balance = balance_of(&model, &[], 3, &load, BalanceSettings::default());
    // The frequencies include the breathing mode and its neighbours.
    let omegas: Vec<f64> = (0..25).map(|k| TAU * (900.0 + 10.0 * k as f64)).collect();
    for response in swept(&balance, &omegas) {
        assert!(response.energy.imbalance() < 1e-10);
        assert_eq!(response.energy.friction, 0.0);
        let (real, imaginary) = reduced.receptance(response.omega, ratio);
        for (k, &port) in ports.iter().enumerate() {
            let expected = [
                500.0 * real[(port, ports[0])],
                -500.0 * imaginary[(port, ports[0])],
            ];
            let row = &response.displacement[7 * k..7 * k + 7];
            let size = expected[0].hypot(expected[1]);
            let error = (row[1] - expected[0]).hypot(row[2] - expected[1]);
            // The series of the residual ends after its slope and is undamped. Pseudo-modes include all orders and are damped like all
            // modes.
            assert!(error < 1e-4 * size, "{row:?} {expected:?}");
        }
    }
    let range = (TAU * 900.0, TAU * 1150.0);
    let resonance = balance.phase_resonance(range, None).unwrap();
    let again = balance
        .phase_resonance(range, Some(&resonance.start()))
        .unwrap();
    assert!((again.omega / resonance.omega - 1.0).abs() < 1e-9);
    let (_, lag) = balance.amplitude(&resonance, 0).unwrap();
    assert!((lag - TAU / 4.0).abs() < 1e-9, "{lag}");
    let peak = balance.peak(0, range, &resonance.start()).unwrap();
    assert!((peak.omega / resonance.omega - 1.0).abs() < 1e-4);
    assert!(balance.amplitude(&peak, 0).unwrap().0 >= balance.amplitude(&resonance, 0).unwrap().0);
}

#[test]
fn ports_and_springs_that_do_not_fit_are_refused() {
    let resonator = Resonator {
        tied: true,
        ..coarse()
    };
    let whole = whole(&resonator, 4);
    let ratio = 0.01;
    let few = [1e6];
    for (ports, springs) in [(vec![99], None), (vec![0], Some(&few[..]))] {
        let error = reduced_model(&whole.reduced, &ports, Damping { ratio, springs }).unwrap_err();
        assert!(
            matches!(
                error,
                DynamicsError::OutOfRange { .. } | DynamicsError::Length { .. }
            ),
            "{error}"
        );
    }
}

/// Joints in extreme states on a coarse resonator: every point converges and satisfies the energy balance, and linear states equal a linear
/// structure.
#[test]
fn joints_at_their_ends() {
    let whole = whole(&coarse(), 20);
    let reduced = &whole.reduced;
    let base = elements(&whole.mesh);
    let springs = reference_springs(&base);
    let drive = reduced.ports.of_point("far_wall", 0).unwrap();
    let damping = Damping {
        ratio: 0.003,
        springs: Some(&springs),
    };
    let model = reduced_model(reduced, &[drive], damping).unwrap();
    let port = model.contact_dofs();
    let positions: Vec<[f64; 2]> = whole.mesh.contacts.iter().map(|c| c.centre).collect();
    let usual = BalanceSettings::default();
    let linear = balance_of(&model, &base, 1, &far_wall(&model, 1e-3), usual)
        .phase_resonance((TAU * 850.0, TAU * 1100.0), None)
        .unwrap();
    let omegas: Vec<f64> = (0..16)
        .map(|k| linear.omega * (0.985 + 0.0015 * f64::from(k)))
        .collect();
    let attempt = |what: &str, force: f64, change: &dyn Fn(&mut ContactElement)| {
        let mut elements = base.clone();
        elements.iter_mut().for_each(change);
        let balance = balance_of(&model, &elements, 3, &far_wall(&model, force), usual);
        let responses: Vec<Response> = balance
            .sweep(&omegas)
            .into_iter()
            .collect::<Result<_, _>>()?;
        let mut worst = ElementState::Stick;
        for response in &responses {
            assert!(
                response.energy.imbalance() < 1e-6,
                "{what}: {:?}",
                response.energy
            );
            assert!(response.closure < 1e-6, "{what}: {}", response.closure);
            let summary = balance.joint_summary(response);
            let joint = joint_cycle(
                balance.elements(),
                &response.displacement,
                balance.sampling(),
                &positions,
            )
            .unwrap();
            for (j, [tx, ty, n]) in joint.force.iter().enumerate() {
                let limit = base.len() as f64 * 1e-9
                    + balance.elements()[0].friction_coefficient * n * (1.0 + 1e-9);
                assert!(tx.hypot(*ty) <= limit, "{what}, sample {j}");
            }
            assert!(summary.least_displacement[0] <= summary.displacement[0]);
            assert!(summary.displacement[0] <= summary.largest_displacement[0]);
            assert!(summary.normal_load <= summary.largest_normal_load);
            worst = worst.max(summary.states.into_iter().max().unwrap());
        }
        let sizes: Vec<f64> = responses
            .iter()
            .map(|r| balance.amplitude(r, port).unwrap().0 / force)
            .collect();
        Ok((sizes, worst))
    };
    let sweep = |what: &str, force: f64, change: &dyn Fn(&mut ContactElement)| {
        attempt(what, force, change).unwrap_or_else(|e: DynamicsError| panic!("{what}: {e}"))
    };
    let free = |e: &mut ContactElement| {
        (e.sliders[0].normal_load, e.sliders[0].gap) = (0.0, 1.0);
    };
    let (open, state) = sweep("gaps everywhere", 500.0, &free);
    assert_eq!(state, ElementState::Open);
    // With open elements everywhere, the response is the response of the structure without springs.
    let structure = SecondOrder {
        contact_dofs: 0,
        ..model.clone()
    };
    let bare = balance_of(&structure, &[], 1, &far_wall(&model, 1.0), usual);
    for (size, response) in open.iter().zip(swept(&bare, &omegas)) {
        let expected = bare.amplitude(&response, port).unwrap().0;
        assert!((size / expected - 1.0).abs() < 1e-9, "{size} {expected}");
    }
    let same = |a: &[f64], b: &[f64]| {
        let pairs = a.iter().zip(b);
        pairs.fold(0.0_f64, |m, (a, b)| m.max((a / b - 1.0).abs()))
    };
    let (stuck, state) = sweep("a millinewton", 1e-3, &|_| ());
    assert_eq!(state, ElementState::Stick);
    let (grips, state) = sweep("µ 10", 10.0, &|e| e.friction_coefficient = 10.0);
    assert_eq!(state, ElementState::Stick);
    assert!(same(&stuck, &grips) < 1e-9, "a stuck joint is not linear");
    let (slides, state) = sweep("1 kN", 1e3, &|_| ());
    assert_eq!(state, ElementState::Slip);
    assert!(same(&stuck, &slides) > 0.1, "a sliding joint is linear");
    sweep("µ 0", 300.0, &|e| e.friction_coefficient = 0.0);
    // A joint that touches everywhere without preload rattles: the solver returns a steady state or an error, never a wrong response.
    if let Err(error) = attempt("no preload", 100.0, &|e| e.sliders[0].normal_load = 0.0) {
        assert!(
            matches!(error, DynamicsError::NotConverged { .. }),
            "{error}"
        );
    }
    sweep("soft normal", 300.0, &|e| {
        e.sliders[0].normal_stiffness *= 1e-4;
    });
    sweep("hard normal", 300.0, &|e| {
        e.sliders[0].normal_stiffness *= 1e3;
    });
    let error = {
        let balance = balance_of(&model, &base, 1, &far_wall(&model, 1.0), usual);
        let response = balance.solve(omegas[0], None).unwrap();
        joint_cycle(
            balance.elements(),
            &response.displacement,
            balance.sampling(),
            &positions[1..],
        )
        .unwrap_err()
    };
    assert!(matches!(error, DynamicsError::Length { .. }), "{error}");
}
