//! Frequencies of imported matrices against closed forms, by the dense and the sparse solver.

use std::f64::consts::PI;

use fretwear::structure::frequencies::{Frequencies, lowest_frequencies};
use fretwear::structure::matrices::{DOUBLE_PRECISION, Matrices, Triplets};

use super::only_matrices;

/// Springs of stiffness k connect masses m in a row: ω = 2 √(k/m) sin(…).
const K: f64 = 3e9;
const M: f64 = 0.02;
/// Relative error from the ratio 1e6 of the highest to the lowest ω² and from the shift.
const SAME: f64 = 1e-8;

fn matrices(size: usize, stiffness: Vec<(u32, u32, f64)>, mass: Vec<(u32, u32, f64)>) -> Matrices {
    let of = |entries| Triplets {
        size,
        entries,
        is_triangle: true,
        precision: DOUBLE_PRECISION,
    };
    only_matrices(of(stiffness), of(mass))
}

fn lowest(matrices: &Matrices, is_fixed: &[bool], count: usize) -> Frequencies {
    let found = lowest_frequencies(matrices, is_fixed, count).expect("modes");
    found.expect("both")
}

/// Chain of `count` masses, free at both ends, with `between` massless points in each spring.
fn chain(count: usize, between: usize) -> Matrices {
    let step = between + 1;
    let size = (count - 1) * step + 1;
    let k = K * step as f64;
    let mut stiffness = Vec::new();
    for n in 0..size as u32 - 1 {
        stiffness.extend([(n, n, k), (n + 1, n + 1, k), (n + 1, n, -k)]);
    }
    let mass = (0..count)
        .map(|n| ((n * step) as u32, (n * step) as u32, M))
        .collect();
    matrices(size, stiffness, mass)
}

fn free(count: usize, mode: usize) -> f64 {
    2.0 * (K / M).sqrt() * (mode as f64 * PI / (2 * count) as f64).sin() / (2.0 * PI)
}

fn held(count: usize, mode: usize) -> f64 {
    2.0 * (K / M).sqrt() * ((2 * mode - 1) as f64 * PI / (4 * count - 2) as f64).sin() / (2.0 * PI)
}

fn assert_near(found: &[f64], right: impl Fn(usize) -> f64) {
    for (k, found) in found.iter().enumerate() {
        let right = right(k + 1);
        assert!(
            (found / right - 1.0).abs() < SAME,
            "mode {}: {found} {right}",
            k + 1
        );
    }
}

#[test]
fn free_chains_with_and_without_massless_points() {
    // The solver is dense below 450 rows and sparse above.
    for (count, between) in [(40, 0), (40, 3), (700, 0), (300, 2)] {
        let matrices = chain(count, between);
        let found = lowest(&matrices, &vec![false; matrices.size], 7);
        assert_eq!(
            (found.rigid.len(), found.elastic.len(), found.is_singular),
            (1, 7, true),
            "{count} {between}"
        );
        assert_near(&found.elastic, |mode| free(count, mode));
    }
}

#[test]
fn chains_that_are_held_at_one_end() {
    for (count, between) in [(30, 1), (900, 0), (250, 2)] {
        let matrices = chain(count, between);
        let mut is_fixed = vec![false; matrices.size];
        is_fixed[0] = true;
        let found = lowest(&matrices, &is_fixed, 6);
        assert_eq!(
            (found.rigid.len(), found.fixed, found.is_singular),
            (0, 1, false),
            "{count} {between}"
        );
        assert_near(&found.elastic, |mode| held(count, mode));
    }
}

/// Several chains beside each other have more rigid modes than one body.
#[test]
fn many_loose_bodies() {
    for (bodies, count) in [(19, 5), (160, 4)] {
        let one = chain(count, 0);
        let (mut stiffness, mut mass) = (Vec::new(), Vec::new());
        for body in 0..bodies {
            let shift = (body * count) as u32;
            let moved = |e: &(u32, u32, f64)| (e.0 + shift, e.1 + shift, e.2);
            stiffness.extend(one.stiffness.iter().flat_map(|k| &k.entries).map(moved));
            mass.extend(one.mass.iter().flat_map(|m| &m.entries).map(moved));
        }
        let all = matrices(bodies * count, stiffness, mass);
        let none = vec![false; all.size];
        let found = lowest(&all, &none, 3);
        assert_eq!((found.rigid.len(), found.elastic.len()), (bodies, 3));
        assert_near(&found.elastic, |_| free(count, 1));
    }
}

/// A massless point without a restraint, and rows without entries.
#[test]
fn loose_rows_without_mass_are_left_out_or_steadied() {
    let mut matrices = chain(12, 0);
    matrices.size += 3;
    for matrix in [&mut matrices.stiffness, &mut matrices.mass] {
        matrix.as_mut().expect("both").size += 3;
    }
    let found = lowest(&matrices, &[false; 15], 4);
    assert_eq!(
        (found.empty, found.rows, found.is_stabilized),
        (3, 12, false)
    );
    // Two massless points are connected only to each other and form a body without mass.
    let stiffness = matrices.stiffness.as_mut().expect("K");
    let before = stiffness.entries.len();
    stiffness
        .entries
        .extend([(12, 12, K), (13, 13, K), (13, 12, -K)]);
    let found = lowest(&matrices, &[false; 15], 4);
    assert_eq!(
        (found.empty, found.rows, found.massless, found.is_stabilized),
        (1, 14, 2, false)
    );
    assert_near(&found.elastic, |mode| free(12, mode));
    // A spring resists the sum of both displacements against the end of the chain. Their difference has no resistance.
    let stiffness = matrices.stiffness.as_mut().expect("K");
    stiffness.entries.truncate(before);
    let pair = [
        (12, 12, K),
        (13, 13, K),
        (13, 12, K),
        (0, 0, K),
        (12, 0, -K),
        (13, 0, -K),
    ];
    stiffness.entries.extend(pair);
    let found = lowest(&matrices, &[false; 15], 4);
    assert_eq!((found.empty, found.rows, found.massless), (1, 14, 0));
    assert!(found.is_singular);
    assert_near(&found.elastic, |mode| free(12, mode));
}

#[test]
fn soft_springs_are_no_rigid_modes() {
    // The frequency on the mount is about a thousandth of the first elastic frequency.
    let count = 25;
    let mut matrices = chain(count, 0);
    let soft = 1e-7 * K;
    matrices
        .stiffness
        .as_mut()
        .expect("K")
        .entries
        .push((0, 0, soft));
    let found = lowest(&matrices, &[false; 25], 3);
    assert!(found.rigid.is_empty());
    let right = (soft / (M * count as f64)).sqrt() / (2.0 * PI);
    // The chain deforms slightly on its mount.
    assert!(
        (found.elastic[0] / right - 1.0).abs() < 1e-4,
        "{} {right}",
        found.elastic[0]
    );
}

#[test]
fn nothing_with_mass_and_exchanged_matrices_are_told() {
    let mut matrices = chain(8, 0);
    std::mem::swap(&mut matrices.stiffness, &mut matrices.mass);
    for entry in &mut matrices.stiffness.as_mut().expect("K").entries {
        entry.2 = -entry.2;
    }
    let found = lowest_frequencies(&matrices, &[false; 8], 2);
    assert!(!matches!(found, Ok(Some(f)) if f.elastic.len() == 2 && f.unstable.is_empty()));
    let mut without = chain(8, 0);
    without.mass.as_mut().expect("M").entries.clear();
    assert!(lowest_frequencies(&without, &[false; 8], 2).is_err());
    without.mass = None;
    assert_eq!(lowest_frequencies(&without, &[false; 8], 2), Ok(None));
}
