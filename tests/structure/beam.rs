//! A free bar against formulae for bars, and the mode solver against a dense solution.

use std::f64::consts::TAU;

use fretwear::structure::StructureError;
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::mesh::Mesh;
use fretwear::structure::modes::{ModeOptions, Modes, lowest, rigid_modes, shift};

use super::STEEL;

const SIZE: [f64; 3] = [0.4, 0.016, 0.022];

fn modes_of(system: &System, options: &ModeOptions) -> Result<Modes, StructureError> {
    let shift = shift(system);
    let factor = system.shifted_factor(shift, &system.elimination_order(&[]))?;
    let rigid = rigid_modes(system, shift).unwrap();
    lowest(system, &factor, shift, &rigid, options)
}

fn bar(cells: [usize; 3], formulation: Formulation) -> System {
    System::assemble(&Mesh::block(SIZE, cells, STEEL), formulation, &[]).unwrap()
}

/// First bending frequency of a free bar \[Hz\] that bends in the direction of `height`. Timoshenko's theory by ASTM E1876, eqs. 1 and 2,
/// accurate to 0.1 %.
fn flexural(length: f64, height: f64) -> f64 {
    let (ratio, nu) = ((height / length).powi(2), STEEL.elastic.poisson_ratio);
    let correction = 1.0 + 6.585 * (1.0 + 0.0752 * nu + 0.8109 * nu * nu) * ratio
        - 0.868 * ratio * ratio
        - 8.340 * (1.0 + 0.2023 * nu + 2.173 * nu * nu) * ratio * ratio
            / (1.0 + 6.338 * (1.0 + 0.1408 * nu + 1.536 * nu * nu) * ratio);
    // E = 0.9465 (m f²/b)(L³/h³) T with m = ρ L b h.
    (STEEL.elastic.youngs_modulus * height * height
        / (0.9465 * STEEL.density * length.powi(4) * correction))
        .sqrt()
}

#[test]
fn a_slender_bar_bends_and_stretches_as_bars_do() {
    let system = bar([40, 2, 3], Formulation::IncompatibleModes);
    let modes = modes_of(&system, &ModeOptions::new(16)).unwrap();
    let hz: Vec<f64> = modes.omega.iter().map(|w| w / TAU).collect();
    let nearest = |expected: f64| {
        let error = hz.iter().map(|f| f / expected - 1.0);
        error.fold(f64::INFINITY, |a, b| if b.abs() < a.abs() { b } else { a })
    };
    for (expected, tolerance) in [
        (flexural(SIZE[0], SIZE[1]), 2e-3),
        (flexural(SIZE[0], SIZE[2]), 2e-3),
        // Lateral inertia lowers the first longitudinal mode by 1e-4 (Rayleigh). The mesh raises the mode by less.
        ((198.4e9_f64 / 7949.0).sqrt() / (2.0 * SIZE[0]), 1e-3),
    ] {
        let error = nearest(expected);
        assert!(
            error.abs() < tolerance,
            "{expected} Hz: {error:e} of {hz:?}"
        );
    }
    // The first mode bends about the weak axis, and the plain element locks in bending.
    let plain = modes_of(&bar([40, 2, 3], Formulation::Plain), &ModeOptions::new(3)).unwrap();
    let locked = plain.omega[0] / modes.omega[0];
    assert!(locked > 1.03, "{locked}");
}

#[test]
fn bending_converges_with_the_mesh() {
    let fine = |cells| {
        let system = bar(cells, Formulation::IncompatibleModes);
        modes_of(&system, &ModeOptions::new(1)).unwrap().omega[0]
    };
    let [coarse, middle, best] = [[10, 1, 1], [20, 2, 2], [40, 4, 4]].map(fine);
    let order = ((coarse - middle) / (middle - best)).log2();
    // The elements are quadratic in bending: half the cell size removes at least three quarters of the error.
    assert!(order > 1.7, "{coarse} {middle} {best}: order {order}");
}

#[test]
fn lanczos_finds_what_a_dense_solution_finds() {
    // The section is square, so bending modes occur in pairs of equal frequency.
    let mesh = Mesh::block([0.3, 0.02, 0.02], [9, 2, 2], STEEL);
    let system = System::assemble(&mesh, Formulation::IncompatibleModes, &[]).unwrap();
    let options = ModeOptions::new(24);
    let modes = modes_of(&system, &options).unwrap();
    let dense = super::dense_frequencies(&system);
    for (r, omega) in modes.omega.iter().enumerate() {
        let expected = dense[6 + r];
        assert!(
            (omega / expected - 1.0).abs() < 1e-8,
            "{r}: {omega} {expected}"
        );
    }
    assert!((modes.omega[0] / modes.omega[1] - 1.0).abs() < 1e-8);
    let weighted = system.mass.times(&modes.shapes);
    let gram = modes.shapes.transpose_times(&weighted);
    for i in 0..24 {
        for j in 0..24 {
            let expected = if i == j { 1.0 } else { 0.0 };
            assert!((gram[(i, j)] - expected).abs() < 1e-12);
        }
    }
    assert!(modes.residuals.iter().all(|&r| r <= options.tolerance));
}

#[test]
fn all_modes_of_a_small_body() {
    let system = bar([2, 1, 1], Formulation::Plain);
    let modes = modes_of(&system, &ModeOptions::new(30)).unwrap();
    let dense = super::dense_frequencies(&system);
    assert_eq!(dense.len(), 36);
    for (omega, expected) in modes.omega.iter().zip(&dense[6..]) {
        assert!((omega / expected - 1.0).abs() < 1e-8, "{omega} {expected}");
    }
    let found = modes_of(&system, &ModeOptions::new(31)).err();
    let expected = StructureError::TooManyModes {
        wanted: 31,
        available: 30,
    };
    assert_eq!(found, Some(expected));
}

#[test]
fn a_body_has_as_many_rigid_modes_as_freedoms_left() {
    let mesh = Mesh::block(SIZE, [8, 2, 1], STEEL);
    let spring = |dof| Spring {
        on: vec![(dof, 1.0)],
        stiffness: 1e6,
    };
    let rigid = |springs: &[Spring]| {
        let system = System::assemble(&mesh, Formulation::Plain, springs).unwrap();
        let shift = shift(&system);
        let rigid = rigid_modes(&system, shift).unwrap();
        // Rounding stays three digits below the threshold of a spring.
        let forces = system.stiffness.times(&rigid);
        let energy = rigid.transpose_times(&forces);
        for r in 0..rigid.columns() {
            assert!(
                energy[(r, r)].abs() < 1e-7 * shift,
                "{}",
                energy[(r, r)] / shift
            );
        }
        rigid.columns()
    };
    assert_eq!(rigid(&[]), 6);
    // One node restrained in three directions leaves three rotations. A second node with two lateral restraints leaves one rotation about
    // the line between both nodes.
    assert_eq!(rigid(&[spring(0), spring(1), spring(2)]), 3);
    let last = 3 * 8;
    let line = [
        spring(0),
        spring(1),
        spring(2),
        spring(last + 1),
        spring(last + 2),
    ];
    assert_eq!(rigid(&line), 1);
}

#[test]
fn too_few_vectors_are_an_error() {
    let system = bar([20, 2, 2], Formulation::Plain);
    let options = ModeOptions {
        max_vectors: 14,
        ..ModeOptions::new(12)
    };
    let found = modes_of(&system, &options).err();
    assert!(
        matches!(
            found,
            Some(StructureError::NotConverged { wanted: 12, vectors: 14.., converged, residual, .. })
                if converged < 12 && residual > options.tolerance
        ),
        "{found:?}"
    );
}
