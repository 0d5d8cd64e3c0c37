//! Tests of the condensation to active elements: with unknowns for the active elements only, by elimination or by a Krylov method, the
//! response equals the response with all unknowns.

use std::f64::consts::PI;

use fretwear::dynamics::{
    BalanceSettings, ContactElement, FrictionLaw, HarmonicBalance, Oscillator, Response,
    SecondOrder,
};
use fretwear::linalg::RowMatrix as Matrix;

use super::{BOTH, balance_of, one_slider};

/// A 7 kg mass on a soft leaf, and a lap that only its joint supports: rigid body motions, bending patterns and a local flexibility of the
/// patch (a residual).
pub struct Joint {
    pub elements: Vec<ContactElement>,
    pub model: SecondOrder,
    pub drive: usize,
}

impl Joint {
    /// `nx × ny` elements on 40×34 mm without the elements in a hole, 30 kN.
    pub fn new(nx: usize, ny: usize, law: FrictionLaw, damping: f64) -> Joint {
        let (lx, ly) = (0.040, 0.034);
        let positions: Vec<[f64; 2]> = (0..nx * ny)
            .map(|k| {
                let (i, j) = (k / ny, k % ny);
                [
                    ((i as f64 + 0.5) / nx as f64 - 0.5) * lx,
                    ((j as f64 + 0.5) / ny as f64 - 0.5) * ly,
                ]
            })
            .filter(|[x, y]| x.hypot(*y) > 0.0055)
            .collect();
        let n = positions.len();
        let shares: Vec<f64> = positions
            .iter()
            .map(|[x, y]| 1.0 + 2.5 * (2.0 * x / lx).powi(2) + 1.7 * (2.0 * y / ly).powi(4))
            .collect();
        let total: f64 = shares.iter().sum();
        let elements: Vec<ContactElement> = shares
            .iter()
            .map(|share| {
                let stiffness = [1.0e10 / n as f64, 1.2e10 / n as f64];
                one_slider(law, 0.6, 3e4 * share / total, stiffness)
            })
            .collect();
        // Coordinates: the mass along x; the lap along x, y, n and its three rotations; eight bending patterns.
        let (rigid, patterns) = (7, 8);
        let m = rigid + patterns;
        let mut mass = vec![0.5; m];
        mass[0] = 7.0;
        (mass[4], mass[5], mass[6]) = (1.2e-4, 1.4e-4, 2e-4);
        let mut stiffness = Matrix::zeros(m, m);
        let leaf = 2.6e8;
        for (i, j, k) in [(0, 0, leaf), (0, 1, -leaf), (1, 0, -leaf), (1, 1, leaf)] {
            stiffness.set(i, j, k);
        }
        for (axis, k) in [(1, 3e8), (2, 2e8), (3, 6e8)] {
            let k = stiffness.at(axis, axis) + k;
            stiffness.set(axis, axis, k);
        }
        for p in 0..patterns {
            let omega = 2.0 * PI * (4000.0 + 1700.0 * p as f64);
            stiffness.set(rigid + p, rigid + p, 0.5 * omega * omega);
        }
        // Stiffness of the bolt.
        stiffness.set(4, 4, 1.2e5);
        stiffness.set(6, 6, 0.9e5);
        // The force acts off the plane of contact, so the lap tilts.
        stiffness.set(5, 5, 4e4);
        let lever = 0.004;
        for (i, j, k) in [(0, 5, -leaf * lever), (5, 0, -leaf * lever)] {
            stiffness.set(i, j, k);
        }
        for (i, j, k) in [
            (1, 5, leaf * lever),
            (5, 1, leaf * lever),
            (5, 5, leaf * lever * lever),
        ] {
            let k = stiffness.at(i, j) + k;
            stiffness.set(i, j, k);
        }
        let ports = 3 * n + 1;
        let mut basis = Matrix::zeros(ports, m);
        for (e, [x, y]) in positions.iter().enumerate() {
            let rows = [
                [0.0, 1.0, 0.0, 0.0, 0.0, 0.0, -y],
                [0.0, 0.0, 1.0, 0.0, 0.0, 0.0, *x],
                [0.0, 0.0, 0.0, 1.0, *y, -x, 0.0],
            ];
            for (d, row) in rows.iter().enumerate() {
                for (a, value) in row.iter().enumerate() {
                    basis.set(3 * e + d, a, *value);
                }
                for p in 0..patterns {
                    let wave = PI * (1 + p / 2) as f64;
                    let phase = 0.9 * d as f64 + 0.4 * p as f64;
                    let value = (wave * x / lx + phase).cos() * (0.6 * wave * y / ly - phase).cos();
                    basis.set(3 * e + d, rigid + p, 0.7 * value);
                }
            }
        }
        basis.set(3 * n, 0, 1.0);
        let mut residual = Matrix::zeros(ports, ports);
        let size = (lx * ly / (nx * ny) as f64).sqrt();
        for (a, p) in positions.iter().enumerate() {
            for (b, q) in positions.iter().enumerate() {
                let distance = (p[0] - q[0]).hypot(p[1] - q[1]);
                let value = 1.0 / (PI * 1.09e11 * (distance + 0.28 * size));
                for d in 0..3 {
                    residual.set(3 * a + d, 3 * b + d, value);
                }
            }
        }
        residual.set(3 * n, 3 * n, 1e-10);
        let springs: Vec<f64> = elements
            .iter()
            .flat_map(|e| {
                [
                    e.tangential_stiffness(),
                    e.tangential_stiffness(),
                    e.normal_stiffness(),
                ]
            })
            .collect();
        let model = SecondOrder {
            mass: Matrix::diagonal(&mass),
            damping: Matrix::zeros(m, m),
            hysteretic: Matrix::zeros(m, m),
            stiffness,
            basis,
            residual: Some(residual),
            contact_dofs: 3 * n,
            static_coordinates: 0,
        }
        .with_damping_ratio(damping, &springs)
        .expect("a valid structure");
        Joint {
            elements,
            model,
            drive: 3 * n,
        }
    }

    pub fn balance(
        &self,
        force: f64,
        settings: BalanceSettings,
    ) -> HarmonicBalance<ContactElement> {
        let load = Oscillator::load(self.drive, force, 0.0);
        balance_of(&self.model, &self.elements, 3, &[load], settings)
    }
}

fn hertz(frequency: f64) -> f64 {
    2.0 * PI * frequency
}

/// Compares the response with unknowns for the active elements only, by elimination and by a Krylov method, with the response with all
/// unknowns, at the resonance and near it.
pub fn active_elements_are_enough(joint: &Joint, forces: &[f64]) {
    let usual = BalanceSettings::default();
    let all = BalanceSettings {
        all_active: true,
        dense_unknowns: 10_000,
        ..usual
    };
    let krylov = BalanceSettings {
        dense_unknowns: 0,
        ..usual
    };
    for &force in forces {
        let balances = [all, usual, krylov].map(|settings| joint.balance(force, settings));
        let range = (hertz(750.0), hertz(1000.0));
        let resonance = balances[1]
            .phase_resonance(range, None)
            .unwrap_or_else(|e| panic!("{force} N: {e}"));
        for offset in [-0.01, -0.002, 0.0, 0.003] {
            let omega = resonance.omega * (1.0 + offset);
            let [all, others @ ..] = balances.each_ref().map(|balance| {
                let response = balance.solve(omega, None);
                response.unwrap_or_else(|e| panic!("{force} N: {e}"))
            });
            assert_eq!(all.active_elements(), joint.elements.len());
            let contact = all.force.len();
            fn largest(values: &[f64]) -> f64 {
                values.iter().fold(0.0, |m, v| m.max(v.abs()))
            }
            let sizes = [&all.displacement[..contact], &all.displacement].map(largest);
            for other in others {
                assert!(other.energy.imbalance() < 1e-6, "{:?}", other.energy);
                let pairs = all.displacement.iter().zip(&other.displacement);
                for (k, (a, b)) in pairs.enumerate() {
                    let size = sizes[usize::from(k >= contact)];
                    assert!((a - b).abs() < 1e-8 * size, "{force} N: {a:e} {b:e}");
                }
            }
        }
    }
}

#[test]
fn active_elements_alone_give_what_all_give() {
    for law in BOTH {
        let joint = Joint::new(7, 5, law, 0.003);
        active_elements_are_enough(&joint, &[40.0, 90.0, 400.0]);
    }
}

#[test]
fn modes_and_residual_are_the_structure_they_come_from() {
    let joint = Joint::new(4, 3, FrictionLaw::Cone, 0.0);
    let contact = joint.model.contact_dofs;
    let (frequencies, modes) = joint.model.modes(&vec![0.0; contact]).expect("modes");
    let shapes = joint.model.basis.times(&modes);
    let residual = joint.model.residual.clone();
    let normals: Vec<usize> = (0..contact / 3).map(|e| 3 * e + 2).collect();
    let modal = SecondOrder::from_modes(&frequencies, shapes, residual, contact)
        .expect("valid")
        .with_reversed_ports(&normals)
        .with_reversed_ports(&normals);
    let load = Oscillator::load(joint.drive, 400.0, 0.0);
    let [a, b] = [&joint.model, &modal].map(|model| {
        let balance = balance_of(
            model,
            &joint.elements,
            3,
            &[load],
            BalanceSettings::default(),
        );
        let response = balance.solve(hertz(915.0), None);
        response.unwrap_or_else(|e| panic!("{e}"))
    });
    assert!(a.active_elements() > 0);
    let contact = |r: &Response| r.displacement[..r.force.len()].to_vec();
    let scale = contact(&a).iter().fold(0.0_f64, |m, v| m.max(v.abs()));
    for (a, b) in contact(&a).iter().zip(&contact(&b)) {
        assert!((a - b).abs() < 1e-8 * scale, "{a} {b}");
    }
}
