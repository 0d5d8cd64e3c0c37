//! Matrices of finite-element programs: one small truss in every format (`samples/make.py`), and malformed files.

use std::path::{Path, PathBuf};

use fretwear::linalg::Matrix;
use fretwear::structure::frequencies::lowest_frequencies;
use fretwear::structure::inspection::{
    mass_by_direction, modal_rows, parse_fixed_rows, units, zero_diagonals,
};
use fretwear::structure::matrices::{Matrices, Role, Triplets};
use fretwear::structure::readers::{Input, parse, read};
use serde_json::Value;

/// Relative error of frequencies. The scipy results have twelve digits, and the singular values of the condensation lose some digits.
const SAME: f64 = 1e-9;
/// Relative error of files with ten digits or in single precision.
const FEW_DIGITS: f64 = 1e-7;

pub fn sample(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("tests/structure/samples")
        .join(name)
}

fn expected() -> Value {
    let text = std::fs::read_to_string(sample("expected.json")).expect("expected.json");
    serde_json::from_str(&text).expect("JSON")
}

fn numbers(value: &Value) -> Vec<f64> {
    let numbers = value.as_array().expect("a list").iter();
    numbers.map(|n| n.as_f64().expect("a number")).collect()
}

pub fn given(names: &[&str]) -> Matrices {
    read(&inputs(names), None).unwrap_or_else(|error| panic!("{error}"))
}

fn inputs(names: &[&str]) -> Vec<Input> {
    let input = |name: &&str| Input {
        path: sample(name),
        role: None,
    };
    names.iter().map(input).collect()
}

fn dense(matrix: &Triplets) -> Matrix {
    let mut full = Matrix::zeros(matrix.size, matrix.size);
    for &(i, j, v) in &matrix.entries {
        full[(i as usize, j as usize)] += v;
        if matrix.is_triangle && i != j {
            full[(j as usize, i as usize)] += v;
        }
    }
    full
}

/// Positions of the rows of the sample in the file. Abaqus sorts its internal node, -1, to the front.
fn rows_of(matrices: &Matrices) -> Vec<usize> {
    let Some(dofs) = &matrices.dofs else {
        return (0..15).collect();
    };
    (0..15_i64)
        .map(|i| {
            let (node, direction) = (i / 3 + 1, (i % 3 + 1) as u32);
            let is = |d: &fretwear::structure::matrices::Dof| {
                (d.node == node || (node == 5 && d.node == -1)) && d.direction == direction
            };
            dofs.iter().position(is).expect("every freedom")
        })
        .collect()
}

fn assert_is_the_truss(matrices: &Matrices, tolerance: f64, name: &str) {
    let expected = expected();
    assert_eq!(matrices.size, 15, "{name}");
    let rows = rows_of(matrices);
    for (role, key) in [(Role::Stiffness, "stiffness"), (Role::Mass, "mass")] {
        let Some(matrix) = matrices.get(role) else {
            continue;
        };
        let full = dense(matrix);
        let lines: Vec<Vec<f64>> = expected[key]
            .as_array()
            .expect("rows")
            .iter()
            .map(numbers)
            .collect();
        let largest = lines.iter().flatten().fold(0.0_f64, |a, v| a.max(v.abs()));
        for i in 0..15 {
            for j in 0..15 {
                let (found, right) = (full[(rows[i], rows[j])], lines[i][j]);
                assert!(
                    (found - right).abs() <= tolerance * largest,
                    "{name}: {key} ({i}, {j}) {found} {right}"
                );
            }
        }
    }
    if matrices.stiffness.is_some() && matrices.mass.is_some() {
        let none = vec![false; 15];
        let found = lowest_frequencies(matrices, &none, 10)
            .expect("frequencies")
            .expect("both");
        assert_near(&found.elastic, &numbers(&expected["free"]), tolerance, name);
        assert_eq!(
            (found.rigid.len(), found.rows, found.is_singular),
            (6, 15, true),
            "{name}"
        );
        let mut held = none;
        for &row in &rows[..6] {
            held[row] = true;
        }
        let found = lowest_frequencies(matrices, &held, 10)
            .expect("frequencies")
            .expect("both");
        assert_near(
            &found.elastic,
            &numbers(&expected["clamped"]),
            tolerance,
            name,
        );
        // The truss turns about the line through two fixed nodes.
        assert_eq!(
            (found.rigid.len(), found.fixed, found.is_singular),
            (1, 6, true),
            "{name}"
        );
    }
}

fn assert_near(found: &[f64], right: &[f64], tolerance: f64, name: &str) {
    assert_eq!(found.len(), right.len(), "{name}: {found:?} {right:?}");
    for (a, b) in found.iter().zip(right) {
        assert!(
            (a / b - 1.0).abs() < tolerance,
            "{name}: {found:?} {right:?}"
        );
    }
}

#[test]
fn every_format_has_the_same_truss() {
    for (names, format) in [
        (
            &["coordinate_K.mtx", "coordinate_M.mtx"][..],
            "Matrix Market",
        ),
        (&["general_K.mtx", "array_M.mtx"], "Matrix Market"),
        (
            &["labels_STIF1.mtx", "labels_MASS1.mtx"],
            "Abaqus matrix by labels",
        ),
        (
            &["coordinates_stiffness.mtx"],
            "coordinates (CalculiX, Abaqus)",
        ),
        (&["truss.mas"], "coordinates (CalculiX, Abaqus)"),
        (&["truss.full"], "ANSYS .full"),
        (&["csr_K.npz", "csc_M.npz"], "NPZ"),
        (&["csr_K.npz", "coo_M.npz"], "NPZ"),
        (&["both.npz"], "NPZ"),
        (&["dense_K.npy", "array_M.mtx"], "NPY"),
    ] {
        let matrices = given(names);
        assert!(
            matrices.formats.contains(&format),
            "{names:?}: {:?}",
            matrices.formats
        );
        assert_is_the_truss(&matrices, SAME, names[0]);
    }
    let names = ["coordinate_K.mtx", "dense_M.npy"];
    assert_is_the_truss(&given(&names), FEW_DIGITS, names[0]);
}

#[test]
fn a_substructure_whose_nodes_have_different_freedoms() {
    let matrices = given(&["substructure.mtx"]);
    assert_eq!((matrices.size, matrices.nodes()), (14, 5));
    let last: Vec<String> = matrices
        .dofs
        .iter()
        .flatten()
        .skip(11)
        .map(ToString::to_string)
        .collect();
    assert_eq!(last, ["14.3", "15.1", "15.2"]);
    let found = lowest_frequencies(&matrices, &[false; 14], 10)
        .expect("frequencies")
        .expect("both");
    assert_near(
        &found.elastic,
        &numbers(&expected()["free"]),
        SAME,
        "substructure",
    );
    let mass = expected()["total_mass"].as_f64().expect("a number");
    for along in mass_by_direction(&matrices) {
        assert!((along.expect("a mass") / mass - 1.0).abs() < SAME);
    }
    assert_eq!(
        zero_diagonals(&matrices, matrices.mass.as_ref().expect("a mass")),
        [12, 13]
    );
}

#[test]
fn freedoms_of_the_mass_alone_are_joined_to_those_of_the_stiffness() {
    let mass = "30,1, 30,1, 0.9\n12,1, 12,1, 0.5\n";
    let found = read_files(&[LABELS[0], ("job_MASS1.mtx", mass)], 2).expect("both");
    let dofs: Vec<i64> = found.dofs.iter().flatten().map(|dof| dof.node).collect();
    assert_eq!(dofs, [11, 12, 21, 22, 30]);
    assert_eq!(found.mass.expect("M").diagonal(), [0.0, 0.5, 0.0, 0.0, 0.9]);
}

#[test]
fn rows_are_held_by_set_node_direction_and_number() {
    let matrices = given(&["truss.sti"]);
    let held = |text: &str| -> Vec<usize> {
        let (rows, _) = parse_fixed_rows(&matrices, text).unwrap_or_else(|error| panic!("{error}"));
        rows.iter()
            .enumerate()
            .filter(|r| *r.1)
            .map(|r| r.0)
            .collect()
    };
    assert_eq!(held("clamp"), [0, 1, 2, 3, 4, 5]);
    assert_eq!(held("1-2"), held("CLAMP"));
    assert_eq!(held("row:1-6"), held("CLAMP"));
    assert_eq!(held("Tip:13, 1.2"), [1, 9, 11]);
    for (text, part) in [
        ("NOSE", "ALL, CLAMP, TIP"),
        ("9", "node 9"),
        ("1.4", "node 1 has no freedom 4"),
        ("row:16", "rows 1 to 15"),
        ("row:0", "row:0"),
        ("7-", "7-"),
        ("boundary", "modal coordinates"),
    ] {
        let said = parse_fixed_rows(&matrices, text)
            .expect_err(text)
            .to_string();
        assert!(said.contains(part), "{said}");
    }
    let without = given(&["coordinate_K.mtx"]);
    assert!(
        parse_fixed_rows(&without, "1")
            .expect_err("no nodes")
            .to_string()
            .contains("row:1-6")
    );
    let found = lowest_frequencies(
        &matrices,
        &parse_fixed_rows(&matrices, "CLAMP").expect("rows").0,
        3,
    )
    .expect("modes")
    .expect("both");
    assert_near(
        &found.elastic,
        &numbers(&expected()["clamped"])[..3],
        SAME,
        "clamp",
    );
}

#[test]
fn an_unsymmetric_matrix_is_told_by_how_much() {
    let text =
        "%%MatrixMarket matrix coordinate real general\n2 2 4\n1 1 4\n2 2 5\n1 2 -1\n2 1 -1.5\n";
    let matrices = parse(Path::new("K.mtx"), text.as_bytes(), None).expect("a matrix");
    let off = matrices.stiffness.expect("K").asymmetry();
    assert_eq!((off.share, off.at, off.values), (0.1, (0, 1), (-1.0, -1.5)));
}

#[test]
fn modal_coordinates_and_penalties_are_known() {
    // Two boundary rows and three modes. A mass couples boundary and modes.
    let k = "%%MatrixMarket matrix coordinate real symmetric\n5 5 6\n1 1 7\n2 2 8\n2 1 -2\n3 3 10\n4 4 20\n5 5 30\n";
    let m = "%%MatrixMarket matrix coordinate real symmetric\n5 5 6\n1 1 2\n2 2 3\n3 1 0.2\n3 3 1\n4 4 1\n5 5 1\n";
    let mut matrices = parse(Path::new("K.mtx"), k.as_bytes(), None).expect("K");
    matrices.mass = parse(Path::new("M.mtx"), m.as_bytes(), None)
        .expect("M")
        .mass;
    assert_eq!(modal_rows(&matrices), [false, false, true, true, true]);
    let mut stiffness = matrices.stiffness.clone().expect("K");
    stiffness
        .entries
        .iter_mut()
        .filter(|e| e.0 < 2 && e.0 == e.1)
        .for_each(|e| e.2 = 1e36);
    matrices.stiffness = Some(stiffness);
    let found = lowest_frequencies(&matrices, &[false; 5], 3)
        .expect("modes")
        .expect("both");
    assert_eq!((found.penalty_fixed, found.rows), (2, 3));
    let right = [10.0_f64, 20.0, 30.0].map(|k| k.sqrt() / (2.0 * std::f64::consts::PI));
    assert_near(&found.elastic, &right, SAME, "penalty");
}

#[test]
fn likely_units_follow_from_the_speed_of_waves() {
    // A steel bar of five elements of 10 mm along x, in three unit systems.
    let bar = |length: f64, force: f64, mass: f64| {
        let (k, m) = (
            2e11 * 1e-4 / 0.01 * force / length,
            7900.0 * 1e-4 * 0.01 * mass,
        );
        let mut matrices = given(&["truss.sti"]);
        let chain = |diagonal: f64, off: f64| Triplets {
            entries: (0..5_u32)
                .flat_map(|n| (0..3).map(move |a| (3 * n + a, 3 * n + a, diagonal)))
                .chain((1..5_u32).map(|n| (3 * n, 3 * n - 3, off)))
                .collect(),
            is_triangle: true,
            ..Triplets::new(15)
        };
        matrices.stiffness = Some(chain(2.0 * k, -k));
        matrices.mass = Some(chain(2.0 / 3.0 * m, m / 6.0));
        for node in 1..=5_i64 {
            matrices
                .positions
                .insert(node, [0.01 * length * node as f64, 0.0, 0.0]);
        }
        units(&matrices).expect("a guess").likely
    };
    assert!(bar(1.0, 1.0, 1.0).starts_with("m, kg"));
    assert!(bar(1e3, 1.0, 1e-3).starts_with("mm, t"));
    // Newtons and millimetres with kilograms.
    assert!(bar(1e3, 1.0, 1.0).starts_with("none"));
}

/// Error message of a reader.
fn failure(name: &str, bytes: impl AsRef<[u8]>) -> String {
    parse(Path::new(name), bytes.as_ref(), None)
        .expect_err(name)
        .to_string()
}

fn changed(name: &str, old: &str, new: &str) -> Vec<u8> {
    let text = std::fs::read_to_string(sample(name)).expect(name);
    assert!(text.contains(old), "{name} has no {old}");
    text.replacen(old, new, 1).into_bytes()
}

#[test]
fn malformed_files_are_told_by_line_and_by_what_would_be_right() {
    let cut = |name: &str| {
        let bytes = std::fs::read(sample(name)).expect(name);
        bytes[..bytes.len() * 2 / 3].to_vec()
    };
    let cases: Vec<(&str, Vec<u8>, &[&str])> = vec![
        ("a.bin", b"what is this?".to_vec(), &["what is this?", "Matrix Market", "ANSYS", "NPZ"]),
        // The matrix would have terabytes. The reader rejects the matrix before allocation.
        (
            "K.mtx",
            b"%%MatrixMarket matrix coordinate real symmetric\n1000000000000 1000000000000 3\n1 1 1\n".to_vec(),
            &["line 2", "1000000000000 rows"],
        ),
        (
            "K.mtx",
            b"%%MatrixMarket matrix coordinate real symmetric\n3 3 1000000000000\n1 1 1\n".to_vec(),
            &["line 2", "1000000000000 entries"],
        ),
        ("K.mtx", changed("coordinate_K.mtx", "15 15 115", "15 15 116"), &["115 entries", "116"]),
        ("K.mtx", changed("coordinate_K.mtx", "15 15 115", "15 15 114"), &["the end: 114"]),
        ("K.mtx", changed("coordinate_K.mtx", "15 15 115", "15 14 115"), &["15 rows and 14 columns"]),
        ("K.mtx", changed("coordinate_K.mtx", "real", "complex"), &["complex", "line 1"]),
        ("K.mtx", changed("coordinate_M.mtx", "\n1 1 2", "\n1 1 nan"), &["line 4", "nan", "finite"]),
        ("K.mtx", changed("coordinate_M.mtx", "\n1 1 2", "\n16 1 2"), &["line 4", "row 16", "1 to 15"]),
        ("K.mtx", changed("coordinate_K.mtx", "\n2 1 ", "\n1 2 "), &["on or below the diagonal"]),
        ("M.mtx", changed("labels_MASS1.mtx", "1,2, 1,2,", "1,2, 1,"), &["line 3", "NODE, DIRECTION"]),
        ("Z.mtx", cut("substructure.mtx"), &["mass", "14 rows"]),
        ("Z.mtx", changed("substructure.mtx", "NODES=         5", "NODES=         6"), &["stiffness", "row 15"]),
        ("Z.mtx", changed("substructure.mtx", "5,          1", "9,          1"), &["node 9"]),
        ("t.sti", b"1 1 2.0\n0 2 1.0\n".to_vec(), &["line 2", "row 0"]),
        ("t.sti", b"1 1 2.0\n99999999999 2 1.0\n".to_vec(), &["line 2", "99999999999 rows"]),
        ("t.dof", b"1.1\n1.2\n1.1\n".to_vec(), &["line 3", "1.1", "line 1"]),
        ("K.npz", cut("csr_K.npz"), &["zip"]),
        ("K.npy", cut("dense_K.npy"), &["1800 for the shape [15, 15]"]),
    ];
    for (name, bytes, parts) in cases {
        let said = failure(name, bytes);
        assert!(said.starts_with(name), "{said}");
        for part in parts {
            assert!(said.contains(part), "no \"{part}\" in: {said}");
        }
    }
}

#[test]
fn files_that_do_not_belong_together_are_refused() {
    let said = |names: &[&str]| {
        let error = read(&inputs(names), None).expect_err("no structure");
        error.to_string()
    };
    let two = said(&["coordinate_K.mtx", "general_K.mtx"]);
    assert!(
        two.contains("general_K.mtx is a second stiffness, after coordinate_K.mtx"),
        "{two}"
    );
    let none = said(&["truss.inp"]);
    assert!(none.contains("no matrix"), "{none}");
    let folder = tempfile::tempdir().expect("a folder");
    let other = folder.path().join("small_M.mtx");
    std::fs::write(
        &other,
        "%%MatrixMarket matrix coordinate real general\n2 2 1\n1 1 1\n",
    )
    .expect("written");
    let inputs = [sample("coordinate_K.mtx"), other].map(|path| Input { path, role: None });
    let said = read(&inputs, None).expect_err("sizes").to_string();
    assert!(
        said.contains("small_M.mtx has 2 rows, but coordinate_K.mtx has 15"),
        "{said}"
    );
}

#[test]
fn what_a_matrix_is_may_be_said() {
    let inputs = [
        (Role::Mass, "coordinate_K.mtx"),
        (Role::Stiffness, "coordinate_M.mtx"),
    ]
    .map(|(role, name)| Input {
        path: sample(name),
        role: Some(role),
    });
    let matrices = read(&inputs, Some("matrix_market")).expect("matrices");
    assert!(
        matrices.mass.expect("K").trace() > 1e6 && matrices.stiffness.expect("M").trace() < 1e2
    );
    assert!(
        read(&inputs, Some("ansys"))
            .expect_err("not ANSYS")
            .to_string()
            .contains("ANSYS .full")
    );
}

/// Nodes in an unsorted order, and three fixed freedoms whose unit rows do not belong to the structure.
#[test]
fn held_freedoms_of_a_full_file_are_left_out() {
    let matrices = given(&["truss.full"]);
    let dofs: Vec<String> = matrices
        .dofs
        .iter()
        .flatten()
        .map(ToString::to_string)
        .collect();
    assert_eq!(dofs[..4], ["4.1", "4.2", "4.3", "2.1"]);
    assert!(
        matrices
            .notes
            .iter()
            .any(|note| note.contains("3 of 18 freedoms are fixed")),
        "{:?}",
        matrices.notes
    );
}

/// Unsupported variants of a full file: the changed word of the second header (from 1) or of a record, and a part of the error message.
#[test]
fn variants_of_a_full_file_are_refused_with_what_to_do() {
    let bytes = std::fs::read(sample("truss.full")).expect("a file");
    const SECOND: usize = 103 + 2;
    for (word, value, told) in [
        (SECOND, 4, "EQSLV"),
        (SECOND + 10, 1, "LUMPM"),
        (SECOND + 13, 1, "NROPT"),
        (SECOND + 20, 2, "constraint equations"),
        (SECOND + 1, 19, "18 kinds"),
        (SECOND + 35, 2, "double precision"),
        (SECOND + 18, 9999, "a record at word 9999"),
        (SECOND + 8, 7, "7, as the header has it"),
        (103 + 1, 1 << 27, "/FCOMP"),
    ] {
        let mut changed = bytes.clone();
        changed[4 * word..][..4].copy_from_slice(&i32::to_le_bytes(value));
        let error = parse(Path::new("file.full"), &changed, None).expect_err(told);
        assert!(error.to_string().contains(told), "{told}: {error}");
    }
    let swapped: Vec<u8> = bytes
        .chunks(4)
        .flat_map(|word| [word[3], word[2], word[1], word[0]])
        .collect();
    let error = parse(Path::new("file.full"), &swapped, None).expect_err("another byte order");
    assert!(error.to_string().contains("byte order"), "{error}");
}

/// Lower triangles of two bodies with two nodes each, by labels: one spring and two masses per body.
const LABELS: [(&str, &str); 2] = [
    (
        "job_STIF1.mtx",
        "11,1, 11,1, 3.0\n12,1, 11,1, -3.0\n12,1, 12,1, 3.0\n21,1, 21,1, 5.0\n22,1, 21,1, -5.0\n22,1, 22,1, 5.0\n",
    ),
    (
        "job_MASS1.mtx",
        "11,1, 11,1, 0.5\n12,1, 12,1, 0.5\n21,1, 21,1, 0.7\n22,1, 22,1, 0.7\n",
    ),
];

/// The same matrices as CalculiX writes them.
const MATRIX_STORAGE: [(&str, &str); 3] = [
    (
        "job.sti",
        "1 1 3.0\n2 1 -3.0\n2 2 3.0\n3 3 5.0\n4 3 -5.0\n4 4 5.0\n",
    ),
    ("job.mas", "1 1 0.5\n2 2 0.5\n3 3 0.7\n4 4 0.7\n"),
    ("job.dof", "11.1\n12.1\n21.1\n22.1\n"),
];

const NODES: &str = "*NODE\n11, 0., 0., 0.\n12, 4., 0., 0.\n21, 0., 7., 0.\n22, 4., 7., 0.\n*NSET, NSET=TOP\n21, 22\n";

/// Reads files in one folder. The command names only the first `given` files.
fn read_files(files: &[(&str, &str)], given: usize) -> Result<Matrices, String> {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    for (name, text) in files {
        std::fs::write(path(name), text).expect("written");
    }
    let inputs: Vec<Input> = (files[..given].iter())
        .map(|(name, _)| Input {
            path: path(name),
            role: None,
        })
        .collect();
    read(&inputs, None).map_err(|error| error.to_string())
}

/// Reads the matrices by labels with a deck in the same folder.
fn beside(deck: &str) -> Matrices {
    let [stiffness, mass] = LABELS;
    read_files(&[stiffness, mass, ("job.inp", deck)], 2).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn comments_of_matrices_may_be_indented() {
    let [stiffness, mass] = LABELS;
    let indented = stiffness
        .1
        .replace("12,1, 11,1", "  ** a comment\n  12,1, 11,1");
    let files = [(stiffness.0, indented.as_str()), mass];
    assert_eq!(read_files(&files, 2), read_files(&LABELS, 2));
    let [stiffness, mass, list] = MATRIX_STORAGE;
    let indented = format!("  ** a comment\n{}", stiffness.1);
    let files = [(stiffness.0, indented.as_str()), mass, list];
    assert_eq!(read_files(&files, 1), read_files(&MATRIX_STORAGE, 1));
    let substructure = std::fs::read_to_string(sample("substructure.mtx")).expect("a sample");
    let indented = substructure.replace("\n*", "\n  *");
    assert_ne!(indented, substructure);
    let parsed = |text: &str| parse(Path::new("Z.mtx"), text.as_bytes(), None).expect("matrices");
    assert_eq!(parsed(&indented), parsed(&substructure));
}

/// The axes of `*TRANSFORM` count if they differ from the global axes. CalculiX writes matrices along the global axes, so its matrices
/// ignore `*TRANSFORM`.
#[test]
fn transformed_nodes_are_known() {
    let turned = |card: &str| beside(&format!("{NODES}{card}\n")).local_axes;
    for card in [
        "*TRANSFORM, NSET=TOP\n0., 1., 0., -1., 0., 0.",
        "*Transform, nset=top, type=R\n1., 1e-3, 0., 0., 1., 0.",
        "*TRANSFORM, NSET=TOP\n-1., 0., 0., 0., 1., 0.",
        "*TRANSFORM, NSET=TOP\n1., 0., 0., 0., 0., 1.",
        "*TRANSFORM, NSET=TOP, TYPE=C\n0., 0., 0., 0., 0., 1.",
        "*TRANSFORM, NSET=TOP, TYPE=S\n0., 0., 0., 0., 0., 1.",
    ] {
        let found = turned(card);
        assert_eq!(found.len(), 1, "{card}");
        assert_eq!(found[0].1, [21, 22], "{card}");
        assert!(found[0].0.contains("*TRANSFORM (line 9)"), "{}", found[0].0);
    }
    // The first point gives a direction of any length. The second point may lie anywhere on the positive side.
    for card in [
        "*TRANSFORM, NSET=TOP, TYPE=R\n2., 0., 0., 0., 3., 0.",
        "*TRANSFORM, NSET=TOP\n1., 0., 0., -4., 2., 0.",
    ] {
        assert_eq!(turned(card), [], "{card}");
    }
    // A set that the reader does not know may contain any node.
    let mut any = turned("*TRANSFORM, NSET=LATER\n0., 1., 0., -1., 0., 0.");
    any[0].1.sort_unstable();
    assert_eq!(any[0].1, [11, 12, 21, 22]);
    let deck = format!("{NODES}*TRANSFORM, NSET=TOP\n0., 1., 0., -1., 0., 0.\n");
    let [stiffness, mass, list] = MATRIX_STORAGE;
    for files in [
        &[stiffness, mass, list, ("job.inp", &deck)][..],
        &[stiffness, mass, ("job.inp", &deck)],
    ] {
        let found = read_files(files, 1).expect("matrices");
        assert_eq!(found.sets["TOP"], [21, 22]);
        assert_eq!(found.local_axes, []);
    }
}

/// Positions in a part are positions of the model unless the instance moves or rotates the part.
#[test]
fn positions_in_parts_that_are_moved_are_not_read() {
    let deck = |lines: &str| {
        format!(
            "*PART, NAME=LOWER\n*NODE\n11, 0., 0., 0.\n12, 4., 0., 0.\n*END PART\n*PART, NAME=UPPER\n*NODE\n21, 0., 7., 0.\n22, 4., 7., 0.\n\
             *END PART\n*ASSEMBLY, NAME=A\n*INSTANCE, NAME=L-1, PART=LOWER\n*END INSTANCE\n*INSTANCE, NAME=U-1, PART=Upper\n{lines}*END INSTANCE\n*END ASSEMBLY\n"
        )
    };
    for lines in [
        "",
        "0., 0., 0.\n",
        "0., 0., 0.\n1., 2., 3., 1., 2., 4., 0.\n",
    ] {
        let found = beside(&deck(lines));
        assert_eq!(
            (found.positions.len(), found.unread.len()),
            (4, 0),
            "{lines}"
        );
    }
    for (lines, line) in [
        ("0., 0., 3.\n", 15),
        ("0., 0., 0.\n0., 0., 0., 1., 0., 0., 90.\n", 16),
    ] {
        let found = beside(&deck(lines));
        let mut left: Vec<i64> = found.positions.keys().copied().collect();
        left.sort_unstable();
        assert_eq!(left, [11, 12], "{lines}");
        let told = &found.unread[0];
        for part in ["UPPER", "*INSTANCE", &format!("line {line}")] {
            assert!(told.contains(part), "{told}");
        }
    }
}

/// A malformed deck in the same folder causes a note. The same deck as a named file causes an error.
#[test]
fn a_deck_beside_that_cannot_be_read_is_noted() {
    let twice = "*HEADING\n*PART, NAME=L\n*NODE\n11, 0., 0., 0.\n*END PART\n*PART, NAME=U\n*NODE\n11, 0., 7., 0.\n*END PART\n";
    let found = beside(twice);
    assert_eq!(found.size, 4);
    assert_eq!(found.unread.len(), 1);
    assert_eq!(found.unread, found.notes);
    for part in [
        "job.inp beside it is not read",
        "line 8",
        "node 11 again",
        "*PART",
    ] {
        assert!(found.unread[0].contains(part), "{}", found.unread[0]);
    }
    let [stiffness, mass] = LABELS;
    let named = read_files(&[("job.inp", twice), stiffness, mass], 3).expect_err("a fault");
    assert!(named.contains("node 11 again"), "{named}");
}

/// The reader ignores a node set from elements, and every set that contains such a set.
#[test]
fn sets_of_nodes_by_elements_are_not_empty() {
    let elements = "*NSET, NSET=ROOTN, ELSET=ROOT\n";
    let found = beside(&format!("{NODES}{elements}"));
    assert_eq!(found.sets.keys().collect::<Vec<_>>(), ["TOP"]);
    assert!(found.unread[0].contains("line 8"), "{}", found.unread[0]);
    assert!(
        found.unread[0].contains("ELSET=ROOT"),
        "{}",
        found.unread[0]
    );
    let within = beside(&format!("{NODES}{elements}*NSET, NSET=MORE\n11, ROOTN\n"));
    assert!(within.sets.is_empty());
    assert!(
        within.unread[0].contains("\"ROOTN\""),
        "{}",
        within.unread[0]
    );
    let included = beside(&format!("{NODES}*INCLUDE, INPUT=sets.inp\n"));
    assert!(
        included.unread[0].contains("beside it is not read")
            && included.unread[0].contains("sets.inp"),
        "{}",
        included.unread[0]
    );
}

/// One dashpot in a structure of many freedoms: on the diagonal, off the diagonal, and as an entry in both triangles.
#[test]
fn a_damping_matrix_may_have_one_entry() {
    const SIZE: u32 = 300;
    let diagonal: String = (1..=SIZE).map(|k| format!("{k} {k} {k}.5\n")).collect();
    let of = |symmetry: &str, count: u32, entries: &str| {
        format!(
            "%%MatrixMarket matrix coordinate real {symmetry}\n{SIZE} {SIZE} {count}\n{entries}"
        )
    };
    let stiffness = of("symmetric", SIZE, &diagonal);
    let mass = of("symmetric", SIZE, &diagonal.replace(".5", ".25"));
    for (symmetry, count, entries, expected) in [
        ("symmetric", 1, "1 1 20.0\n", vec![(0, 0, 20.0)]),
        ("symmetric", 1, "300 7 20.0\n", vec![(299, 6, 20.0)]),
        (
            "general",
            2,
            "300 7 20.0\n7 300 20.0\n",
            vec![(299, 6, 20.0), (6, 299, 20.0)],
        ),
        ("general", 1, "300 300 20.0\n", vec![(299, 299, 20.0)]),
    ] {
        let damping = of(symmetry, count, entries);
        let files = [
            ("K.mtx", &*stiffness),
            ("M.mtx", &*mass),
            ("C.mtx", &*damping),
        ];
        let found = read_files(&files, 3).expect("three matrices");
        assert_eq!(found.size, SIZE as usize);
        assert_eq!(found.damping.expect("damping").entries, expected);
    }
    // A stiffness matrix needs entries in its rows.
    let said =
        read_files(&[("K.mtx", &of("symmetric", 1, "1 1 20.0\n"))], 1).expect_err("one entry");
    let expected = "K.mtx announces 300 rows; 1 entries of all matrices are of at most 32 rows";
    assert!(said.contains(expected), "{said}");
}

/// Structural damping is hysteretic in every position and is never a viscous damping matrix.
#[test]
fn structural_damping_is_never_viscous() {
    let damping = "11,1, 11,1, 0.2\n12,1, 12,1, 0.2\n";
    let [stiffness, mass] = LABELS;
    let with = |name: &str| read_files(&[stiffness, mass, (name, damping)], 3).expect(name);
    for name in [
        "job_DMPS1.mtx",
        "job_dmps.mtx",
        "K4AA.mtx",
        "structural_damping.mtx",
    ] {
        let found = with(name);
        assert_eq!(found.damping, None, "{name}");
        assert_eq!(found.hysteretic.expect(name).entries.len(), 2, "{name}");
    }
    for name in ["job_DMPV1.mtx", "damping.mtx"] {
        let found = with(name);
        assert_eq!(found.hysteretic, None, "{name}");
        assert_eq!(found.damping.expect(name).entries.len(), 2, "{name}");
        assert_eq!(found.notes, [""; 0], "{name}");
    }
    let both = [
        stiffness,
        mass,
        ("job_DMPS1.mtx", damping),
        ("job_DMPV1.mtx", damping),
    ];
    let found = read_files(&both, 4).expect("four matrices");
    assert!(found.hysteretic.is_some() && found.damping.is_some());
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("job_DMPS1.mtx");
    std::fs::write(&path, damping).expect("written");
    let role = Some(Role::Damping);
    let said = read(&[Input { path, role }], None).expect_err("structural damping");
    assert!(said.to_string().contains("structural_damping="), "{said}");
}

/// The error message names the file kind and the `fretwear-import` command.
#[test]
fn files_for_the_importer_name_it() {
    let op4 = "       6      -6       6       2KAA     1P,5E16.9\n";
    let mut binary = vec![24, 0, 0, 0];
    binary.extend([0; 24]);
    binary.extend([24, 0, 0, 0]);
    for (bytes, kind) in [
        (op4.as_bytes(), "a Nastran OUTPUT4 file"),
        (&binary, "a Nastran OUTPUT4 file"),
        (b"$ a model\nDMIG*   KAAX ", "a Nastran bulk data file"),
        (b"SOL 103\nCEND\nBEGIN BULK\n", "a Nastran bulk data file"),
        (b"MATLAB 5.0 MAT-file", "a MATLAB MAT-file"),
        (b"MATLAB 7.3 MAT-file", "a MATLAB MAT-file"),
        (b"$MeshFormat\n4.1 0 8\n", "a mesh of Gmsh"),
        (b"/COM,ANSYS RELEASE\n", "an ANSYS archive"),
        (b"    -1\n   151\n", "a universal file"),
    ] {
        let said = parse(Path::new("a.file"), bytes, None).expect_err(kind);
        let said = said.to_string();
        assert!(
            said.contains(kind) && said.contains("fretwear-import"),
            "{said}"
        );
    }
}

/// A folder from the importer gives the structure of its parts, the units, and the omitted content.
#[test]
fn a_neutral_folder_is_read() {
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, bytes: &[u8]| {
        std::fs::write(folder.path().join(name), bytes).expect("written");
    };
    let described = |unit: &str| {
        format!(
            r#"{{"layout": "fretwear-structure", "version": 1, "kind": "matrices", "unit": {unit}, "left_out": ["2 lines"], "files": []}}"#
        )
    };
    let here = || {
        let path = folder.path().to_owned();
        read(&[Input { path, role: None }], None)
    };
    assert!(
        here()
            .expect_err("nothing")
            .to_string()
            .contains("structure.json")
    );
    write("structure.json", described("null").as_bytes());
    write("K.npz", &std::fs::read(sample("csr_K.npz")).expect("K"));
    write("M.npz", &std::fs::read(sample("coo_M.npz")).expect("M"));
    let rows: String = (0..15)
        .map(|row| format!("{},{}\n", row / 3 + 1, row % 3 + 1))
        .collect();
    write("rows.csv", format!("node,direction\n{rows}").as_bytes());
    for (wrong, part) in [("1,9", "\"9\""), ("1,2", "there already")] {
        write(
            "rows.csv",
            format!("node,direction\n{rows}")
                .replacen("1,1", wrong, 1)
                .as_bytes(),
        );
        let said = here().expect_err(wrong).to_string();
        assert!(said.contains("rows.csv") && said.contains(part), "{said}");
    }
    write("rows.csv", format!("node,direction\n{rows}").as_bytes());
    write("sets.csv", b"set,node\n");
    assert!(here().expect("no set").sets.is_empty());
    write("sets.csv", b"set,node\ntop,11\ntop,12\nall,11\n");
    let found = here().expect("a folder");
    assert_is_the_truss(&found, SAME, "folder");
    let last = found.dofs.as_ref().and_then(|dofs| dofs.last());
    assert_eq!(last.map(ToString::to_string).as_deref(), Some("5.3"));
    assert_eq!(found.unit, Some(None));
    assert_eq!(found.sets["TOP"], [11, 12]);
    assert_eq!(found.notes, ["2 lines"]);
    write(
        "structure.json",
        described(r#"{"length": "mm", "mass": "t", "time": "s"}"#).as_bytes(),
    );
    let unit = here().expect("a folder").unit.flatten().expect("units");
    assert_eq!([&*unit.length, &*unit.mass, &*unit.time], ["mm", "t", "s"]);
    // Hash by sha256sum of the sets above.
    let hash = "7b6dbf5b18fdcd4e003c084c91296f122975b41ea2e650fe7480140738df9c27";
    for (hash, told) in [(hash, 0), (&hash.replace('0', "1"), 1)] {
        let with = format!("\"contents\": {{\"sets.csv\": \"{hash}\"}}, \"files\"");
        write(
            "structure.json",
            described("null").replace("\"files\"", &with).as_bytes(),
        );
        let notes = here().expect("a folder").notes;
        let changed = notes
            .iter()
            .filter(|note| *note == "sets.csv is not as fretwear-import wrote it");
        assert_eq!(changed.count(), told, "{notes:?}");
    }
    let deck = std::fs::read(sample("solids/C3D8.inp")).expect("a deck");
    write("mesh.inp", &deck);
    let of_mesh = described("null").replace("\"matrices\"", "\"mesh\"");
    write("structure.json", of_mesh.as_bytes());
    let expected = parse(Path::new("deck.inp"), &deck, None).expect("a deck");
    assert_eq!(here().expect("a mesh").stiffness, expected.stiffness);
    write(
        "structure.json",
        described("null").replace(": 1", ": 7").as_bytes(),
    );
    let said = here().expect_err("a newer one").to_string();
    assert!(said.contains("version 1 at most"), "{said}");
}
