//! Compliance of a meshed half space: against the half space at a distance, and against a block of elements nearby.

use fretwear::material::{Elastic, Material};
use fretwear::structure::StructureError;
use fretwear::structure::assembly::{Spring, System};
use fretwear::structure::element::Formulation;
use fretwear::structure::half_space::{FaceCompliance, FaceResolution};
use fretwear::structure::mesh::Mesh;
use fretwear::structure::reduction::{self, Ports};

const STEEL: Elastic = Elastic {
    youngs_modulus: 198.4e9,
    poisson_ratio: 0.3,
};

/// At a distance of some boxes, a mesh displaces as the half space by Boussinesq's and Cerruti's solutions for a point force (Johnson,
/// Contact Mechanics, eq. 3.19 and 3.75). The difference falls with the square of box size over distance.
#[test]
fn from_afar_a_mesh_is_a_half_space() {
    let (a, b) = (1.0e-3, 1.3e-3);
    /// Largest share of the displacement at the farthest node due to the faces beyond a period.
    const BEYOND: f64 = 0.01;
    let reach = [18, 14];
    let face = FaceCompliance::of_layered_half_space(
        STEEL,
        [a, b],
        &[1e-3; 4],
        reach,
        Formulation::IncompatibleModes,
        FaceResolution::default(),
    )
    .expect("a mesh");
    let (e, nu) = (STEEL.youngs_modulus, STEEL.poisson_ratio);
    let pi = std::f64::consts::PI;
    for (i, j) in [(12, 0), (0, 12), (9, 7), (18, 14), (16, 3)] {
        let (x, y) = (i as f64 * a, j as f64 * b);
        let r = x.hypot(y);
        let at = i * (reach[1] + 1) + j;
        let lateral = nu * (1.0 + nu) / (pi * e);
        let near = (1.0 - nu * nu) / (pi * e * r);
        let expected = [
            (face.zz[at], near),
            (face.xx[at], near + lateral * x * x / r.powi(3)),
            (face.yy[at], near + lateral * y * y / r.powi(3)),
        ];
        let square = 2.0 * (a.max(b) / r).powi(2) + BEYOND;
        for (k, (found, exact)) in expected.into_iter().enumerate() {
            assert!(
                (found / exact - 1.0).abs() < square,
                "{i}, {j}, {k}: {found:e}, {exact:e}"
            );
        }
        let exact = lateral * x * y / r.powi(3);
        assert!(
            (face.xy[at] - exact).abs() < square * near,
            "{i}, {j}: {:e}",
            face.xy[at]
        );
    }
}

#[test]
fn lengths_that_are_none_are_refused() {
    for (sides, layers) in [
        ([1e-3, 0.0], vec![1e-3]),
        ([1e-3, 1e-3], vec![1e-3, 0.0]),
        ([1e-3, 1e-3], vec![-1e-3]),
        ([f64::NAN, 1e-3], vec![]),
        ([1e-3, f64::INFINITY], vec![]),
    ] {
        let found = FaceCompliance::of_layered_half_space(
            STEEL,
            sides,
            &layers,
            [2, 2],
            Formulation::IncompatibleModes,
            FaceResolution::default(),
        );
        let refused = matches!(found, Err(StructureError::OutOfRange { .. }));
        assert!(refused, "{sides:?} {layers:?}: {found:?}");
    }
}

/// A mesh of boxes against a large block of the same boxes, with a small effect of its ends. The displacement of a loaded node minus the
/// displacement of its neighbours equals the half space's value.
#[test]
fn nearby_it_is_the_mesh() {
    const BOXES: [usize; 3] = [24, 22, 14];
    /// Largest share of the difference between two nodes due to the ends of the block.
    const ENDS: f64 = 0.01;
    let sides = [1.0e-3, 1.2e-3];
    let layer = 1.1e-3;
    let reach = [3, 3];
    let face = FaceCompliance::of_layered_half_space(
        STEEL,
        sides,
        &[layer; 14],
        reach,
        Formulation::IncompatibleModes,
        FaceResolution::default(),
    )
    .expect("a mesh");
    let material = Material {
        elastic: STEEL,
        density: 1.0,
    };
    let size = [0, 1, 2].map(|k| BOXES[k] as f64 * [sides[0], sides[1], layer][k]);
    let mesh = Mesh::block(size, BOXES, material);
    let layer_nodes = (BOXES[0] + 1) * (BOXES[1] + 1);
    let held = (0..3 * layer_nodes).map(|dof| Spring {
        on: vec![(dof, 1.0)],
        stiffness: 1e15,
    });
    let springs: Vec<Spring> = held.collect();
    let system =
        System::assemble(&mesh, Formulation::IncompatibleModes, &springs).expect("a block");
    let node = |i: usize, j: usize| {
        layer_nodes * BOXES[2] + (BOXES[0] / 2 + i) + (BOXES[0] + 1) * (BOXES[1] / 2 + j)
    };
    let places = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 1), (0, 3)];
    let ports = Ports {
        combinations: places
            .iter()
            .flat_map(|&(i, j)| (0..3).map(move |axis| vec![(3 * node(i, j) + axis, 1.0)]))
            .collect(),
        contacts: places.len(),
        points: Vec::new(),
    };
    let block = reduction::flexibility(&system, &ports).expect("a held block");
    let of = |values: &[f64], (i, j): (usize, usize)| values[i * (reach[1] + 1) + j];
    for (name, values, axis) in [
        ("zz", &face.zz, 2),
        ("xx", &face.xx, 0),
        ("yy", &face.yy, 1),
    ] {
        let own = block[(axis, axis)] - block[(3 * 5 + axis, axis)];
        for (k, place) in places.iter().enumerate() {
            let found = values[0] - of(values, *place);
            let expected = block[(axis, axis)] - block[(3 * k + axis, axis)];
            assert!(
                (found - expected).abs() < ENDS * own,
                "{name} {place:?}: {found:e}, {expected:e}"
            );
        }
    }
    for (k, place) in places.iter().enumerate() {
        let (found, expected) = (of(&face.xy, *place), block[(3 * k, 1)]);
        assert!(
            (found - expected).abs() < ENDS * block[(0, 0)],
            "xy {place:?}: {found:e}, {expected:e}"
        );
    }
}
