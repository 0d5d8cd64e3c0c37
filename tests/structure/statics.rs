//! Static loads at a joint of structures with given rigid motions and flexibility.

use fretwear::linalg::Matrix;
use fretwear::structure::StructureError;
use fretwear::structure::reduction::{Ports, ReducedStructure};
use fretwear::structure::statics::PortForce;

const COUNTS: [usize; 2] = [5, 4];
const SIDES: [f64; 2] = [2e-3, 3e-3];
const MASS: f64 = 0.4;
const LOAD: f64 = 700.0;
/// Position of the load \[m\].
const AT: [f64; 2] = [1.5e-3, -2e-3];

fn centres() -> Vec<[f64; 2]> {
    let at = |k: usize, count: usize, side: f64| (k as f64 - 0.5 * (count - 1) as f64) * side;
    let places = (0..COUNTS[0]).flat_map(|i| (0..COUNTS[1]).map(move |j| [i, j]));
    places
        .map(|[i, j]| [at(i, COUNTS[0], SIDES[0]), at(j, COUNTS[1], SIDES[1])])
        .collect()
}

/// Rigid motion of the upper body: displacements along x, y, z at a place.
type Motion = fn([f64; 2]) -> [f64; 3];

/// Structure with these rigid motions of the upper body and a fixed lower body. Its only point is on the upper body at [`AT`]. The
/// flexibility along the normal decays with the distance and adds a plane scaled by `soft`.
fn structure(motions: &[Motion], soft: f64) -> ReducedStructure {
    let centres = centres();
    let ports = 3 * centres.len() + 3;
    let place = |port: usize| centres.get(port / 3).copied().unwrap_or(AT);
    let rigid = Matrix::from_fn(ports, motions.len(), |port, r| {
        motions[r](place(port))[port % 3] / MASS.sqrt()
    });
    let residual = Matrix::from_fn(ports, ports, |a, b| {
        if a % 3 != 2 || b % 3 != 2 {
            return if a == b { 1e-9 } else { 0.0 };
        }
        let (p, q) = (place(a), place(b));
        let near = 1e-9 * (-((p[0] - q[0]) / 2e-3).powi(2) - ((p[1] - q[1]) / 3e-3).powi(2)).exp();
        near + soft * (1.0 + 4e4 * p[0] * q[0] + 9e4 * p[1] * q[1] + 50.0 * (p[0] + q[0]))
    });
    ReducedStructure {
        ports: Ports {
            combinations: vec![Vec::new(); ports],
            contacts: centres.len(),
            points: vec!["top".to_owned()],
        },
        rigid,
        omega: Vec::new(),
        shapes: Matrix::zeros(ports, 0),
        residual_slope: Matrix::zeros(ports, ports),
        residual,
        damping: None,
        hysteretic: None,
        mass: MASS,
        mode_residual: 0.0,
        factor_entries: 0,
        reference: None,
    }
}

const DOWN: Motion = |_| [0.0, 0.0, 1.0];
const ABOUT_X: Motion = |[_, y]| [0.0, 0.0, 80.0 * y];
const ABOUT_Y: Motion = |[x, _]| [0.0, 0.0, -110.0 * x];
const ALONG_X: Motion = |_| [1.0, 0.0, 0.0];
const ABOUT_Z: Motion = |[x, y]| [-60.0 * y, 60.0 * x, 0.0];
/// Rotation about an axis along y at x = −20 mm.
const HINGED: Motion = |[x, _]| [0.0, 0.0, 90.0 * (x + 20e-3)];

/// Force on the point that presses the upper body down.
fn pressing(reduced: &ReducedStructure) -> Vec<PortForce> {
    vec![(reduced.ports.of_point("top", 2).expect("a point"), -LOAD)]
}

/// Opposing forces on all faces that increase along x.
fn on_faces() -> Vec<PortForce> {
    let centres = centres();
    let count = centres.len() as f64;
    let each = centres.iter().enumerate();
    each.map(|(e, [x, _])| (3 * e + 2, -LOAD * (1.0 + 30.0 * x) / count))
        .collect()
}

#[test]
fn a_free_body_leaves_its_load_and_moments_to_the_pressure() {
    let reduced = structure(&[ALONG_X, DOWN, ABOUT_X, ABOUT_Y, ABOUT_Z], 0.0);
    let found = reduced.statics(&centres(), &[pressing(&reduced), on_faces()], false);
    let found = found.expect("statics");
    assert_eq!(
        found.free_motions,
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    );
    assert!(found.supported_motions.is_empty());
    // Load, Σ p y and −Σ p x.
    let expected = [LOAD, LOAD * AT[1], -LOAD * AT[0]];
    for (r, e) in found.loads[0].resultants.iter().zip(expected) {
        assert!((r - e).abs() < 1e-9 * LOAD, "{r} {e}");
    }
    let centres = centres();
    let sums = on_faces().iter().fold([0.0; 3], |sums, (port, f)| {
        let [x, y] = centres[port / 3];
        [sums[0] - f, sums[1] - f * y, sums[2] + f * x]
    });
    for (r, e) in found.loads[1].resultants.iter().zip(sums) {
        assert!((r - e).abs() < 1e-9 * LOAD, "{r} {e}");
    }
}

#[test]
fn a_hinged_body_is_free_about_its_hinge_alone() {
    // A stiff hinge belongs to the flexibility. The program separates only a soft hinge.
    let [stiff, reduced] = [0.0, 1e-3].map(|soft| structure(&[HINGED], soft));
    let of = |reduced: &ReducedStructure| {
        let loads = [pressing(reduced)];
        reduced.statics(&centres(), &loads, false).expect("statics")
    };
    let found = of(&stiff);
    assert_eq!(
        (found.free_motions.len(), found.supported_motions.len()),
        (1, 0)
    );
    assert_eq!(found.remaining_flexibility, found.flexibility);
    let found = of(&reduced);
    assert_eq!(
        (found.free_motions.len(), found.supported_motions.len()),
        (1, 2)
    );
    let [approach, x, y] = found.free_motions[0];
    assert!((approach / -y - 20e-3).abs() < 1e-9 && x.abs() < 1e-9);
    // Moment about the hinge, in the normalization of the motion.
    let moment = LOAD * (AT[0] + 20e-3) * -y;
    assert!((found.loads[0].resultants[0] - moment).abs() < 1e-9 * LOAD);
    // If the pressure carries the load, the body may also approach. The resultant of the load does not change.
    let loads = [on_faces()];
    let found = reduced.statics(&centres(), &loads, true).expect("statics");
    assert_eq!(
        (found.free_motions.len(), found.supported_motions.len()),
        (2, 1)
    );
    let all: f64 = on_faces().iter().map(|(_, f)| -f).sum();
    let centres = centres();
    for (motion, resultant) in found.free_motions.iter().zip(&found.loads[0].resultants) {
        let moved = |[x, y]: [f64; 2]| motion[0] + motion[1] * y - motion[2] * x;
        let expected: f64 = on_faces()
            .iter()
            .map(|(port, f)| -f * moved(centres[port / 3]))
            .sum();
        assert!(
            (resultant - expected).abs() < 1e-9 * all,
            "{resultant} {expected}"
        );
    }
}

/// For any softness of the supports, the program separates the support motions. The remaining flexibility is positive and does not depend
/// on the softness.
#[test]
fn softness_of_held_bodies_is_told_apart() {
    let mut stiff: Option<Matrix> = None;
    for soft in [1e-9, 1e-6, 1e-3] {
        let reduced = structure(&[], soft);
        let found = reduced
            .statics(&centres(), &[pressing(&reduced)], false)
            .expect("statics");
        assert_eq!(
            (found.free_motions.len(), found.supported_motions.len()),
            (0, 3)
        );
        let centres = centres();
        let field = |e: usize, k: usize| [1.0, centres[e][1], -centres[e][0]][k];
        for e in 0..centres.len() {
            for f in 0..centres.len() {
                let pairs = (0..9).map(|n| (n / 3, n % 3));
                let held: f64 = pairs
                    .map(|(k, m)| field(e, k) * found.supported_compliance[3 * k + m] * field(f, m))
                    .sum();
                let whole = found.remaining_flexibility[(e, f)] + held;
                let expected = found.flexibility[(e, f)];
                assert!((whole - expected).abs() < 1e-12 * (soft + 1e-9), "{e} {f}");
            }
        }
        let (values, _) = found
            .remaining_flexibility
            .symmetric_eigen()
            .expect("eigenvalues");
        let largest = values.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
        assert!(largest < 2e-8, "{soft}: {largest}");
        assert!(
            values.iter().all(|v| *v > -1e-9 * (soft + 1e-9)),
            "{soft}: {values:?}"
        );
        if let Some(before) = &stiff {
            let pairs = before
                .as_slice()
                .iter()
                .zip(found.remaining_flexibility.as_slice());
            let off = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(off < 1e-3 * 1e-9 + 1e-9 * soft, "{soft}: {off}");
        }
        stiff = Some(found.remaining_flexibility);
    }
}

#[test]
fn loads_that_nothing_bears_and_faces_of_three_bodies_are_refused() {
    let reduced = structure(&[ALONG_X, DOWN, ABOUT_X, ABOUT_Y], 0.0);
    let sideways = vec![(reduced.ports.of_point("top", 0).expect("a point"), 5.0)];
    let found = reduced.statics(&centres(), &[pressing(&reduced), sideways], false);
    assert!(
        matches!(found, Err(StructureError::UnbalancedLoad { load: 1, .. })),
        "{found:?}"
    );
    // Half of a face moves separately.
    let torn: Motion = |[x, _]| [0.0, 0.0, if x > 0.0 { 1.0 } else { 0.0 }];
    let reduced = structure(&[torn], 0.0);
    let found = reduced.statics(&centres(), &[], false);
    assert!(
        matches!(found, Err(StructureError::NotTwoBodies { .. })),
        "{found:?}"
    );
}

/// A spring between two points of a structure adds a flexibility of 1/k in series and removes one rigid motion.
#[test]
fn a_spring_holds_what_it_pulls_at() {
    let reduced = structure(&[DOWN, ABOUT_X], 0.0);
    let port = reduced.ports.of_point("top", 2).expect("a point");
    let stiffness = 3e7;
    let held = reduced
        .with_spring(&[(port, 1.0)], stiffness)
        .expect("modes");
    assert_eq!((held.rigid.columns(), held.omega.len()), (1, 1));
    // A unit force at the point strains only the spring. The body still turns freely about the point.
    let own = held.flexibility(port, port);
    let free_part = held.rigid[(port, 0)];
    assert!(
        free_part.abs() < 1e-9,
        "the spring's point does not move freely: {free_part}"
    );
    assert!((own * stiffness - 1.0).abs() < 1e-6, "{own}");
}

/// Rigid modes of connected bodies move the faces apart only by rounding, so opposing forces on the faces need no balance.
#[test]
fn opposing_forces_on_connected_bodies_need_no_balance() {
    const ROUNDING: Motion = |[x, _]| [0.0, 0.0, 1e-14 * (1.0 + 1e3 * x)];
    let reduced = structure(&[ALONG_X, ROUNDING], 0.0);
    let found = reduced.statics(&centres(), &[on_faces()], false);
    let found = found.expect("statics");
    assert!(found.free_motions.is_empty());
    assert_eq!(found.supported_motions.len(), 3);
}
