//! Meshes with dependent displacements: tied surfaces and linear equations, against CalculiX, against a mesh in one piece, and against
//! exact fields.

use std::fs;
use std::path::PathBuf;

use fretwear::structure::face::Face;
use fretwear::structure::frequencies::lowest_frequencies;
use fretwear::structure::inspection::mass_by_direction;
use fretwear::structure::matrices::{Matrices, Triplets};
use fretwear::structure::readers::{self, Input};
use fretwear::structure::solids::{NAMES, Solid};

/// Relative error against CalculiX, which prints twelve digits. Its coordinates and weights have fewer digits.
const SAME_PROGRAM: f64 = 1e-7;
/// Rounding of sums of some hundred entries.
const ROUNDING: f64 = 1e-11;

fn sample(name: &str) -> String {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/structure/samples/solids");
    fs::read_to_string(folder.join(name)).expect("a sample")
}

fn assembled(text: &str) -> Matrices {
    readers::parse("deck.inp".as_ref(), text.as_bytes(), None).expect("a deck")
}

fn refusal(text: &str) -> String {
    let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
    found.expect_err("a fault").to_string()
}

/// √(eigenvalue)/2π of the stiffness with unit mass.
fn roots(mut read: Matrices, count: usize) -> Vec<f64> {
    let mass = read.mass.as_mut().expect("a mass");
    mass.entries = (0..read.size as u32).map(|row| (row, row, 1.0)).collect();
    let free = vec![false; read.size];
    let found = lowest_frequencies(&read, &free, count).expect("frequencies");
    found.expect("both matrices").elastic
}

/// uᵀAu, and the sum of its absolute parts.
fn form(matrix: &Triplets, u: &[f64]) -> (f64, f64) {
    assert!(matrix.is_triangle);
    let (mut sum, mut parts) = (0.0, 0.0);
    for &(i, j, value) in &matrix.entries {
        let times = if i == j { 1.0 } else { 2.0 };
        let part = times * value * u[i as usize] * u[j as usize];
        sum += part;
        parts += part.abs();
    }
    (sum, parts)
}

/// Stiffness of CalculiX's matrices of the same decks (`samples/solids/make.py`), in mm and N.
#[test]
fn tied_decks_have_the_stiffness_of_calculix() {
    let expected = [
        (
            "tied.inp",
            [
                10.6318277436,
                11.7647989133,
                23.3850839911,
                40.2140208694,
                45.0388468634,
            ],
        ),
        (
            "tied_quadratic.inp",
            [
                4.91868850191,
                5.4933499784,
                11.1157785113,
                19.0334181552,
                21.9539515126,
            ],
        ),
    ];
    for (name, expected) in expected {
        let found = roots(assembled(&sample(name)), expected.len());
        for (a, b) in found.iter().zip(expected) {
            assert!(
                (a / b - 1.0).abs() < SAME_PROGRAM,
                "{name}: {found:?} {expected:?}"
            );
        }
    }
}

/// Mesh of a bar of 3 × 2 × 2 cells, in one piece or in two stacked parts with separate nodes.
fn bar(is_one_piece: bool, order: &str) -> String {
    let mut nodes = String::from("*NODE\n");
    let mut elements = [String::new(), String::new()];
    let node = |i: usize, j: usize, k: usize, part: usize| {
        let apart = if is_one_piece { 0 } else { 1000 * part };
        1 + i + 4 * (j + 3 * k) + apart
    };
    for part in 0..2 {
        for k in part..part + 2 {
            if is_one_piece && part == 1 && k == 1 {
                continue;
            }
            for (i, j) in (0..4).flat_map(|i| (0..3).map(move |j| (i, j))) {
                let [x, y, z] = [9.0 * i as f64, 7.0 * j as f64, 5.0 * k as f64];
                nodes += &format!(
                    "{},{},{},{}\n",
                    node(i, j, k, part),
                    x + 0.1 * y,
                    y + 0.02 * z,
                    z + 0.05 * x
                );
            }
        }
        for (e, (i, j)) in (0..3).flat_map(|i| (0..2).map(move |j| (i, j))).enumerate() {
            let base = [(0, 0), (1, 0), (1, 1), (0, 1)];
            let corners = (0..2)
                .flat_map(|up| base.map(|(a, b)| node(i + a, j + b, part + up, part).to_string()));
            let corners: Vec<String> = corners.collect();
            elements[part] += &format!("{},{}\n", 1 + e + 100 * part, corners.join(","));
        }
    }
    let tie = match is_one_piece {
        true => String::new(),
        false => format!(
            "*SURFACE, NAME=TOP\nLOW,S2\n*SURFACE, NAME=SOLE\nHIGH,S1\n*TIE, NAME=GLUE\n{order}\n"
        ),
    };
    format!(
        "{nodes}*ELEMENT, TYPE=C3D8I, ELSET=LOW\n{}*ELEMENT, TYPE=C3D8I, ELSET=HIGH\n{}{tie}*MATERIAL, NAME=STEEL\n*ELASTIC\n198400.,0.3\n*DENSITY\n\
         7.949E-9\n*SOLID SECTION, ELSET=LOW, MATERIAL=STEEL\n*SOLID SECTION, ELSET=HIGH, MATERIAL=STEEL\n",
        elements[0], elements[1]
    )
}

#[test]
fn tied_parts_that_match_are_one_piece() {
    let modes = |text: &str| {
        let read = assembled(text);
        let found = lowest_frequencies(&read, &vec![false; read.size], 8).expect("frequencies");
        let found = found.expect("both matrices");
        assert_eq!(found.rigid.len(), 6);
        (read.size, found.elastic)
    };
    let (size, whole) = modes(&bar(true, ""));
    for order in ["SOLE, TOP", "TOP, SOLE"] {
        let (tied_size, tied) = modes(&bar(false, order));
        assert_eq!(size, tied_size);
        for (a, b) in whole.iter().zip(&tied) {
            assert!((a / b - 1.0).abs() < 1e-9, "{order}: {a} {b}");
        }
    }
}

/// Ties between nonmatching faces reproduce a field that is linear over both blocks, and keep the mass and its moments.
#[test]
fn ties_pass_the_patch_test() {
    for name in ["tied.inp", "tied_quadratic.inp"] {
        let text = sample(name);
        let (before, rest) = text.split_once("*EQUATION").expect("an equation");
        let (_, rest) = rest.split_once("*MATERIAL").expect("a material");
        let text = format!(
            "{before}*MATERIAL{}",
            rest.replace("*BOUNDARY\nFOOT,1,3\n", "")
        );
        let read = assembled(&text);
        let dofs = read.dofs.as_ref().expect("freedoms");
        let field = |gradient: [[f64; 3]; 3]| -> Vec<f64> {
            let row = |dof: &fretwear::structure::matrices::Dof| {
                let at = read.positions[&dof.node];
                let g = gradient[dof.direction as usize - 1];
                (0..3).map(|d| g[d] * at[d]).sum::<f64>()
            };
            dofs.iter().map(row).collect()
        };
        let volume = 30.0 * 14.0 * 10.0 + 26.0 * 11.0 * 8.0;
        // The tie moves the sole of the upper block down by 0.05, so the lowest cells become higher.
        let volume = volume + 26.0 * 11.0 * 0.05;
        for mass in mass_by_direction(&read) {
            let mass = mass.expect("a direction");
            assert!(
                (mass / (7.949e-9 * volume) - 1.0).abs() < ROUNDING,
                "{name}: {mass:e} {volume}"
            );
        }
        let strain = [
            [1.2e-3, 0.4e-3, -0.3e-3],
            [0.4e-3, -0.8e-3, 0.5e-3],
            [-0.3e-3, 0.5e-3, 0.7e-3],
        ];
        let shear = 198400.0 / 2.6;
        let lame = 2.0 * shear * 0.3 / 0.4;
        let trace: f64 = (0..3).map(|k| strain[k][k]).sum();
        let squares: f64 = strain.iter().flatten().map(|e| e * e).sum();
        let stiffness = read.stiffness.as_ref().expect("a stiffness");
        let (twice, _) = form(stiffness, &field(strain));
        let expected = volume * (lame * trace * trace + 2.0 * shear * squares);
        assert!(
            (twice / expected - 1.0).abs() < ROUNDING,
            "{name}: {twice:e} {expected:e}"
        );
        let turn = [[0.0, -3e-3, 2e-3], [3e-3, 0.0, -1e-3], [-2e-3, 1e-3, 0.0]];
        let (twice, parts) = form(stiffness, &field(turn));
        assert!(
            twice.abs() < ROUNDING * parts,
            "{name}: {twice:e} of {parts:e}"
        );
        // Σ m x², the moment of the mass about the plane x = 0.
        let (moment, _) = form(
            read.mass.as_ref().expect("a mass"),
            &field([[1.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]),
        );
        let of = |length: f64, area: f64, from: f64| {
            area * ((from + length).powi(3) - from.powi(3)) / 3.0
        };
        let expected = 7.949e-9 * (of(30.0, 140.0, 0.0) + of(26.0, 11.0 * 8.05, 1.7));
        assert!(
            (moment / expected - 1.0).abs() < ROUNDING,
            "{name}: {moment:e} {expected:e}"
        );
    }
}

/// The equation u₄₃z = ¾ u₄₈z − ½ u₄₈x by products of dense matrices.
#[test]
fn equations_are_a_product_of_matrices() {
    let text = sample("tied.inp");
    let (before, rest) = text.split_once("*EQUATION").expect("an equation");
    let (_, rest) = rest.split_once("*MATERIAL").expect("a material");
    let (with, without) = (
        assembled(&text),
        assembled(&format!("{before}*MATERIAL{rest}")),
    );
    let dofs = |read: &Matrices| read.dofs.clone().expect("freedoms");
    let (kept, all) = (dofs(&with), dofs(&without));
    assert_eq!(all.len(), kept.len() + 1);
    let row_of = |node: i64, direction: u32| {
        kept.iter()
            .position(|dof| (dof.node, dof.direction) == (node, direction))
    };
    let whole = |u: &[f64]| -> Vec<f64> {
        let row = |dof: &fretwear::structure::matrices::Dof| match row_of(dof.node, dof.direction) {
            Some(row) => u[row],
            None => 0.75 * u[row_of(48, 3).expect("free")] - 0.5 * u[row_of(48, 1).expect("free")],
        };
        all.iter().map(row).collect()
    };
    for seed in 0..7 {
        let u: Vec<f64> = (0..kept.len())
            .map(|k| ((k * (2 * seed + 3)) as f64 * 0.7).sin())
            .collect();
        for (ours, expected) in [
            (&with.stiffness, &without.stiffness),
            (&with.mass, &without.mass),
        ] {
            let (a, parts) = form(ours.as_ref().expect("a matrix"), &u);
            let (b, _) = form(expected.as_ref().expect("a matrix"), &whole(&u));
            assert!((a - b).abs() < ROUNDING * parts, "{a:e} {b:e}");
        }
    }
}

/// Equations that depend on each other, and terms that are fixed.
#[test]
fn equations_are_followed_to_what_is_free() {
    let text = sample("tied.inp");
    let chained = text.replace(
        "43,3,1.0,48,3,-0.75,48,1,0.5\n",
        "43,3,1.0,48,3,-0.75,\n 48,1,0.5\n*EQUATION\n2\n48,3,2.0,46,3,-1.0\n2\n46,3,-4.0,1,3,5.0\n",
    );
    // Node 1 is fixed, so nodes 46 and 48 are fixed along z. Node 43 then depends only on node 48 along x.
    let direct = text.replace(
        "3\n43,3,1.0,48,3,-0.75,48,1,0.5\n",
        "2\n43,3,1.0,48,1,0.5\n",
    );
    let direct = direct.replace("FOOT,1,3\n", "FOOT,1,3\n46,3\n48,3\n");
    let (chained, direct) = (assembled(&chained), assembled(&direct));
    assert_eq!(chained.dofs, direct.dofs);
    assert_eq!(chained.stiffness, direct.stiffness);
}

/// The nearest point of a flat face by its plane, and of a curved face by a search over many points.
#[test]
fn nearest_points_of_faces_are_the_nearest() {
    const MANY: usize = 120;
    for (name, solid) in NAMES {
        let text = sample(&format!("{name}.inp"));
        let read = assembled(&text);
        let (_, elements) = text.split_once("*ELEMENT").expect("elements");
        let rows: Vec<&str> = elements
            .lines()
            .skip(1)
            .take_while(|line| !line.starts_with('*'))
            .collect();
        let numbers: Vec<i64> = rows
            .join(",")
            .replace(",,", ",")
            .split(',')
            .map(|n| n.trim().parse().expect("a node"))
            .collect();
        let mut nodes: Vec<[f64; 3]> = numbers[1..=solid.nodes()]
            .iter()
            .map(|n| read.positions[n])
            .collect();
        // Mid-edge nodes are off the straight edges, so quadratic faces are curved.
        for (k, node) in nodes
            .iter_mut()
            .enumerate()
            .skip(if solid.nodes() % 10 == 0 {
                solid.nodes() - 12
            } else {
                99
            })
        {
            node[k % 3] += 0.3 * (1.0 + k as f64).sin();
        }
        for number in 0..solid.corners_of_faces().len() {
            let face = Face::new(solid, number, &nodes).expect("a face");
            let corners = solid.face(number).expect("a face");
            let middle = [0, 1, 2]
                .map(|a| corners.iter().map(|c| nodes[*c][a]).sum::<f64>() / corners.len() as f64);
            for (k, off) in [[0.4, -0.2, 0.3], [-9.0, 4.0, 0.5], [0.0, 0.0, 0.0]]
                .into_iter()
                .enumerate()
            {
                let at = [0, 1, 2].map(|a| middle[a] + off[a]);
                let found = face.nearest(at);
                let sum: f64 = found.weights.iter().sum();
                assert!((sum - 1.0).abs() < 1e-12, "{name} {number}: {sum}");
                for a in 0..3 {
                    let by_weights: f64 = found
                        .weights
                        .iter()
                        .zip(&nodes)
                        .map(|(w, node)| w * node[a])
                        .sum();
                    assert!((by_weights - found.position[a]).abs() < 1e-10);
                }
                // No point of the face is nearer. A fine raster misses the nearest point by a share of its spacing.
                let mut nearest = f64::INFINITY;
                for (i, j) in (0..=MANY).flat_map(|i| (0..=MANY).map(move |j| (i, j))) {
                    let place = [i, j].map(|x| x as f64 / MANY as f64);
                    if let Some(position) = face.at(place) {
                        let apart: f64 = (0..3).map(|a| (position[a] - at[a]).powi(2)).sum();
                        nearest = nearest.min(apart.sqrt());
                    }
                }
                let raster = face.longest_side() / MANY as f64;
                assert!(
                    found.distance <= nearest + 1e-9,
                    "{name} {number} {k}: {} {nearest}",
                    found.distance
                );
                assert!(
                    found.distance >= nearest - raster,
                    "{name} {number} {k}: {} {nearest}",
                    found.distance
                );
            }
        }
    }
    assert!(Face::new(Solid::Tetrahedron4, 4, &[[0.0; 3]; 4]).is_none());
}

/// Each error names the line of the fault and the correction.
#[test]
fn faults_of_ties_and_equations_are_told() {
    let sound = sample("tied.inp");
    let cases: [(&str, &str, &[&str]); 18] = [
        // A dependent displacement on a missing node would be free.
        (
            "48,1,0.5\n",
            "4800,1,0.5\n",
            &["line", "node 4800", "the deck has"],
        ),
        (
            "43,3,1.0,48",
            "4300,3,1.0,48",
            &["line", "node 4300", "the deck has"],
        ),
        (
            "SOLE\n*SURFACE",
            "SOLE\n777\n*SURFACE",
            &["line", "node 777", "the deck has"],
        ),
        ("SLAVE,MASTER\n", "SLAVE\n", &["line", "two surfaces"]),
        (
            "SLAVE,MASTER\n",
            "SOLES,MASTER\n",
            &["SOLES", "MASTER", "SLAVE"],
        ),
        (
            "SLAVE,MASTER\n",
            "MASTER,SLAVE\n",
            &["SLAVE", "faces of elements"],
        ),
        (
            "POSITION TOLERANCE=0.1",
            "POSITION TOLERANCE=-0.1",
            &["POSITION TOLERANCE", "-0.1", "zero or more"],
        ),
        (
            "POSITION TOLERANCE=0.1",
            "POSITION TOLERANCE=0.01",
            &["SLAVE", "MASTER", "tolerance", "POSITION TOLERANCE"],
        ),
        (
            "POSITION TOLERANCE=0.1",
            "ADJUST=MAYBE",
            &["ADJUST", "MAYBE", "YES"],
        ),
        (
            "POSITION TOLERANCE=0.1",
            "CYCLIC SYMMETRY",
            &["CYCLIC SYMMETRY"],
        ),
        (
            "FOOT,1,3\n",
            "FOOT,1,3\nSOLE,3\n",
            &["node", "direction 3", "*BOUNDARY"],
        ),
        ("43,3,1.0,48", "43,3,0.0,48", &["first coefficient", "zero"]),
        ("43,3,1.0,48", "43,5,1.0,48", &["\"5\"", "1 to 3"]),
        ("43,3,1.0,48", "SOLE,3,1.0,48", &["SOLE", "sets"]),
        ("*EQUATION\n3\n", "*EQUATION\n4\n", &["lacks 1"]),
        ("*EQUATION\n3\n", "*EQUATION\n1\n", &["two terms"]),
        (
            "48,1,0.5\n",
            "48,1,0.5\n2\n48,3,1,43,3,1\n",
            &["depends on itself"],
        ),
        (
            "48,1,0.5\n",
            "48,1,0.5\n2\n43,3,1,47,3,1\n",
            &["node 43", "already"],
        ),
    ];
    for (from, to, parts) in cases {
        assert!(sound.contains(from), "{from}");
        let told = refusal(&sound.replace(from, to));
        for part in parts {
            assert!(told.contains(part), "{told}\nhas no \"{part}\"");
        }
    }
    // The reader reports nodes beyond the tolerance and does not tie these nodes.
    let far = sound
        .replace("*TIE", "*SURFACE, NAME=ALL, TYPE=NODE\nSOLE\n43\n*TIE")
        .replace("SLAVE,MASTER", "ALL,MASTER");
    let notes = assembled(&far).notes.join("\n");
    assert!(notes.contains("1 are further off"), "{notes}");
    assert!(notes.contains("moved by up to 5.000e-2"), "{notes}");
    let kept = assembled(&sound.replace(
        "POSITION TOLERANCE=0.1",
        "POSITION TOLERANCE=0.1, ADJUST=NO",
    ));
    assert!(!kept.notes.join("\n").contains("moved"));
    let read = Input {
        path: "nowhere.inp".into(),
        role: None,
    };
    assert!(readers::read(&[read], None).is_err());
}
