//! Solid elements of imported meshes: rigid motions, constant strain, mass, and stiffness matrices from CalculiX.

use std::fs;
use std::path::PathBuf;

use fretwear::material::{Elastic, Material};
use fretwear::structure::frequencies::lowest_frequencies;
use fretwear::structure::inspection::model_warnings;
use fretwear::structure::matrices::Matrices;
use fretwear::structure::readers::{self, Input};
use fretwear::structure::solids::{NAMES, Solid};

/// Rounding, relative to the sum of the absolute parts.
const ROUNDING: f64 = 1e-12;
/// Relative error against CalculiX, which prints twelve digits. The lowest hourglass modes lose some digits.
const SAME_PROGRAM: f64 = 1e-8;

const MATERIAL: Material = Material {
    elastic: Elastic {
        youngs_modulus: 198.4e9,
        poisson_ratio: 0.3,
    },
    density: 7949.0,
};

fn folder() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/structure/samples/solids")
}

/// Nodes of the first element in the sample of an element type.
fn first(name: &str) -> Vec<[f64; 3]> {
    let text = fs::read_to_string(folder().join(format!("{name}.inp"))).expect("a sample");
    let (nodes, rest) = text.split_once("*ELEMENT").expect("elements");
    let nodes: Vec<[f64; 3]> = (nodes.lines().skip(1))
        .map(|line| {
            let mut fields = line
                .split(',')
                .skip(1)
                .map(|f| f.parse::<f64>().expect("a number"));
            [0; 3].map(|_| 1e-3 * fields.next().expect("three"))
        })
        .collect();
    let joined: String = rest
        .lines()
        .skip(1)
        .collect::<Vec<_>>()
        .join("\n")
        .replace(",\n", ",");
    let line = joined.lines().next().expect("an element");
    let labels = line
        .split(',')
        .skip(1)
        .map(|f| f.parse::<usize>().expect("a node"));
    labels.map(|n| nodes[n - 1]).collect()
}

/// Energy ½uᵀKu of a motion, and the sum of the absolute parts.
fn energy(stiffness: &[f64], motion: &[f64]) -> (f64, f64) {
    let (mut energy, mut parts) = (0.0, 0.0);
    for (i, u) in motion.iter().enumerate() {
        for (j, v) in motion.iter().enumerate() {
            let part = 0.5 * stiffness[i * motion.len() + j] * u * v;
            energy += part;
            parts += part.abs();
        }
    }
    (energy, parts)
}

#[test]
fn solids_resist_strain_and_no_rigid_motion() {
    let strain = [
        [1.2e-3, 0.4e-3, -0.3e-3],
        [0.4e-3, -0.8e-3, 0.5e-3],
        [-0.3e-3, 0.5e-3, 0.7e-3],
    ];
    let shear = MATERIAL.elastic.shear_modulus();
    let ratio = MATERIAL.elastic.poisson_ratio;
    let lame = 2.0 * shear * ratio / (1.0 - 2.0 * ratio);
    let trace = strain[0][0] + strain[1][1] + strain[2][2];
    let squares: f64 = strain.iter().flatten().map(|e| e * e).sum();
    let density = 0.5 * lame * trace * trace + shear * squares;
    for (name, solid) in NAMES {
        let nodes = first(name);
        let found = solid.matrices(&nodes, &MATERIAL, 1).expect("a solid");
        let moved = |gradient: [[f64; 3]; 3]| -> Vec<f64> {
            let each = nodes
                .iter()
                .flat_map(|x| gradient.map(|row| (0..3).map(|d| row[d] * x[d]).sum()));
            each.collect()
        };
        for axis in 0..3 {
            let along: Vec<f64> = (0..3 * nodes.len())
                .map(|k| f64::from(k % 3 == axis))
                .collect();
            let (energy_found, parts) = energy(&found.stiffness, &along);
            assert!(energy_found.abs() < ROUNDING * parts, "{name} along {axis}");
            let mut turn = [[0.0; 3]; 3];
            (
                turn[(axis + 1) % 3][(axis + 2) % 3],
                turn[(axis + 2) % 3][(axis + 1) % 3],
            ) = (-1.0, 1.0);
            let (energy_found, parts) = energy(&found.stiffness, &moved(turn));
            assert!(energy_found.abs() < ROUNDING * parts, "{name} about {axis}");
        }
        let count = nodes.len();
        let mass: f64 = found.mass.iter().sum();
        let volume = mass / MATERIAL.density;
        if solid == Solid::Tetrahedron4 {
            // ρV/20 (1 + δ), with V from the edges.
            let edge = [1, 2, 3].map(|k| [0, 1, 2].map(|d| nodes[k][d] - nodes[0][d]));
            let triple: f64 = (0..3)
                .map(|d| {
                    let (e, f) = ((d + 1) % 3, (d + 2) % 3);
                    edge[0][d] * (edge[1][e] * edge[2][f] - edge[1][f] * edge[2][e])
                })
                .sum();
            for (k, found) in found.mass.iter().enumerate() {
                let same = if k / 4 == k % 4 { 2.0 } else { 1.0 };
                let exact = MATERIAL.density * triple / 6.0 / 20.0 * same;
                assert!((found / exact - 1.0).abs() < 1e-12, "{k}: {found} {exact}");
            }
        }
        let (strained, _) = energy(&found.stiffness, &moved(strain));
        // The two integration points of a wedge do not integrate the volume of a skewed wedge exactly.
        let tolerance = if solid == Solid::Wedge6 { 1e-2 } else { 1e-10 };
        assert!(
            (strained / (density * volume) - 1.0).abs() < tolerance,
            "{name}: {strained:e}"
        );
        for i in 0..3 * count {
            for j in 0..i {
                let (a, b) = (
                    found.stiffness[i * 3 * count + j],
                    found.stiffness[j * 3 * count + i],
                );
                assert!(
                    (a - b).abs() <= ROUNDING * found.stiffness[0].abs(),
                    "{name}: {i} {j}"
                );
            }
        }
        // The mirrored element is inverted.
        let mirrored: Vec<[f64; 3]> = nodes.iter().map(|[x, y, z]| [-x, *y, *z]).collect();
        let refused = solid
            .matrices(&mirrored, &MATERIAL, 17)
            .expect_err("inside out");
        assert!(refused.to_string().contains("17"), "{refused}");
    }
}

/// The faces contain every surface node. The corners and mid-edge nodes of each face lie in one plane if the edges are straight.
#[test]
fn faces_are_those_of_the_format() {
    for (name, solid) in NAMES {
        let nodes = first(name);
        let faces: Vec<Vec<usize>> = (0..).map_while(|k| solid.face(k)).collect();
        let is_tetrahedron = matches!(solid, Solid::Tetrahedron4 | Solid::Tetrahedron10);
        let expected = match solid {
            Solid::Tetrahedron4 | Solid::Tetrahedron10 => 4,
            Solid::Wedge6 | Solid::Wedge15 => 5,
            _ => 6,
        };
        assert_eq!(faces.len(), expected, "{name}");
        let mut seen: Vec<usize> = faces.concat();
        seen.sort_unstable();
        seen.dedup();
        assert_eq!(seen.len(), nodes.len(), "{name}");
        if is_tetrahedron {
            for face in faces {
                let at = |k: usize| nodes[face[k]];
                let [a, b] = [1, 2].map(|k| [0, 1, 2].map(|d| at(k)[d] - at(0)[d]));
                for node in &face[3..] {
                    let c = [0, 1, 2].map(|d| nodes[*node][d] - at(0)[d]);
                    let volume: f64 = (0..3)
                        .map(|d| {
                            c[d] * (a[(d + 1) % 3] * b[(d + 2) % 3]
                                - a[(d + 2) % 3] * b[(d + 1) % 3])
                        })
                        .sum();
                    // Products of coordinates skew the block. The edges stay straight within 10 %.
                    assert!(volume.abs() < 0.1 * 1e-3_f64.powi(2), "{name}: {volume:e}");
                }
            }
        }
    }
}

/// √(eigenvalue)/2π of the stiffness with unit mass, from CalculiX's matrices of the same decks (`samples/solids/make.py`) in mm and N. The
/// rows of CalculiX's incompatible modes are condensed.
const OF_STIFFNESS: [(&str, f64, [f64; 5]); 8] = [
    (
        "C3D8",
        SAME_PROGRAM,
        [
            16.3337884498,
            18.8824093923,
            23.1131905876,
            59.9178052079,
            68.2545999661,
        ],
    ),
    // Both programs take the gradients of the incompatible modes at the centre but scale them differently on skewed cells.
    (
        "C3D8I",
        5e-3,
        [
            11.7818743597,
            15.4636269478,
            22.9387170676,
            59.1788573286,
            61.359383236,
        ],
    ),
    (
        "C3D20",
        SAME_PROGRAM,
        [
            7.68844887421,
            10.0204636785,
            15.8425712,
            33.8955055705,
            37.9883731524,
        ],
    ),
    (
        "C3D20R",
        SAME_PROGRAM,
        [
            0.17596608162,
            1.23025196579,
            7.61450962722,
            9.93895346996,
            15.8699500187,
        ],
    ),
    (
        "C3D6",
        SAME_PROGRAM,
        [
            13.2576878001,
            28.1132468182,
            42.3470957641,
            63.3306216455,
            68.4541261724,
        ],
    ),
    (
        "C3D15",
        SAME_PROGRAM,
        [
            7.35908149194,
            9.69223746486,
            15.4703341469,
            32.3608575659,
            37.3976916733,
        ],
    ),
    (
        "C3D4",
        SAME_PROGRAM,
        [
            21.8960711327,
            27.8705860123,
            55.7395478015,
            68.9418866861,
            81.8953378383,
        ],
    ),
    (
        "C3D10",
        SAME_PROGRAM,
        [
            6.72554484616,
            8.82239102876,
            14.9516528125,
            30.9647582026,
            34.610315034,
        ],
    ),
];

#[test]
fn stiffness_of_assembled_decks_is_that_of_calculix() {
    for (name, tolerance, expected) in OF_STIFFNESS {
        let deck = Input {
            path: folder().join(format!("{name}.inp")),
            role: None,
        };
        let mut read = readers::read(&[deck], None).expect("a deck");
        let mass = read.mass.as_mut().expect("a mass");
        mass.entries = (0..read.size as u32).map(|row| (row, row, 1.0)).collect();
        let free = vec![false; read.size];
        let found = lowest_frequencies(&read, &free, 5)
            .expect("frequencies")
            .expect("both matrices");
        assert_eq!(found.rigid.len(), 0, "{name}: the deck fixes the foot");
        for (a, b) in found.elastic.iter().zip(expected) {
            assert!((a / b - 1.0).abs() < tolerance, "{name}: {a} {b}");
        }
    }
}

/// The error names the unsupported content and the correction.
#[test]
fn decks_that_are_not_assembled_are_refused() {
    let sound = fs::read_to_string(folder().join("C3D10.inp")).expect("a sample");
    let told = |text: String| {
        let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
        found.expect_err("a fault").to_string()
    };
    let has = |text: String, parts: &[&str]| {
        for part in parts {
            assert!(text.contains(part), "{text}\nhas no \"{part}\"");
        }
    };
    has(
        told(sound.replace("*NSET", "*COUPLING\n*NSET")),
        &["*COUPLING", "structure.kind"],
    );
    has(
        told(format!("{sound}\n*ELEMENT, TYPE=SPRINGA\n99,1,2\n")),
        &["SPRINGA", "C3D10", "line"],
    );
    has(
        told(sound.replace("TYPE=C3D10", "TYPE=C3D8R")),
        &["C3D8R", "C3D8I", "hourglass"],
    );
    has(
        told(format!(
            "{sound}\n*ELEMENT, TYPE=B31, ELSET=BAR\n99,1,2\n*ELSET, ELSET=ALL\nEALL,BAR\n*SOLID SECTION, ELSET=ALL, MATERIAL=STEEL\n"
        )),
        &["the set ALL", "B31", "solids"],
    );
    has(
        told(sound.replace("*DENSITY\n7.949E-9\n", "")),
        &["STEEL", "*DENSITY"],
    );
    has(
        told(sound.replace("0.3\n", "0.5\n")),
        &["poisson_ratio", "below 0.5"],
    );
    has(
        told(sound.replace("ELSET=EALL, MATERIAL", "ELSET=OTHER, MATERIAL")),
        &["OTHER"],
    );
    has(
        told(sound.replace("*SOLID SECTION", "** SOLID SECTION")),
        &["element 1", "*SOLID SECTION"],
    );
    has(told(sound.replace("FOOT,1,3", "FEET,1,3")), &["FEET"]);
    has(
        told(sound.replace("FOOT,1,3", "FOOT,1,3,0.5")),
        &["0.5", "zero"],
    );
    has(
        told(sound.replace("*NODE\n1,", "*NODE\n1001,")),
        &["node 1", "that the deck has"],
    );
    has(
        told(sound.replace("*NSET", "*INSTANCE, NAME=A\n*NSET")),
        &["*INSTANCE", "flat"],
    );
    has(
        told(sound.replace("198400.,0.3", "198400.,x")),
        &["\"x\"", "a finite number"],
    );
    has(
        told("*include, input=two.msh\n*MATERIAL, NAME=STEEL\n".to_owned()),
        &["*INCLUDE of line 1", "give the deck as a file"],
    );
    // The reader rejects every keyword that may change the structure and that it does not know.
    for (card, parts) in [
        (
            "*ELGEN, ELSET=MORE\n1,2,1,1",
            &["*ELGEN", "remove the keyword"][..],
        ),
        (
            "*NCOPY, CHANGE NUMBER=1000, OLD SET=FOOT, SHIFT\n0.,0.,9.",
            &["*NCOPY"],
        ),
        ("*SYSTEM\n0.,0.,5.", &["*SYSTEM", "rectangular"]),
        (
            "*NODE, SYSTEM=C\n9001,1.,20.,3.",
            &["SYSTEM=C", "rectangular"],
        ),
        ("*NODE, INPUT=nodes.txt", &["INPUT", "into the deck"]),
        (
            "*NONSTRUCTURAL MASS, ELSET=EALL\n1.",
            &["*NONSTRUCTURAL MASS"],
        ),
        ("*DAMPING, ALPHA=3.", &["*DAMPING"]),
        ("*FOOBAR", &["*FOOBAR", "line"]),
        ("*STEP, NLGEOM\n*STATIC", &["NLGEOM", "loaded"]),
        (
            "*STEP\n*END STEP\n*STEP\n*BOUNDARY\nFOOT,1",
            &["second step"],
        ),
        ("*BOUNDARY\n99999,1,3", &["99999", "that the deck has"]),
        ("*NODE\n1,7.,7.,7.", &["node 1 again"]),
    ] {
        has(told(format!("{sound}{card}\n")), parts);
    }
}

/// The first nonblank character of a keyword line is its star.
#[test]
fn keywords_and_comments_may_be_indented() {
    let sound = fs::read_to_string(folder().join("tied.inp")).expect("a sample");
    let read = |text: &str| {
        let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
        found.unwrap_or_else(|error| panic!("{error}"))
    };
    let indented = sound.replace("\n*", "\n  ** a comment\n\t *");
    assert_ne!(indented, sound);
    assert_eq!(read(&indented), read(&sound));
    let held = sound.replace("*BOUNDARY", "  *BOUNDARY");
    assert_eq!(read(&held).size, read(&sound).size);
}

/// Supports of a step add to the supports of the model. `OP=NEW` replaces the supports of the model.
#[test]
fn a_step_may_hold_something_else() {
    let sound = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let (model, _) = sound.split_once("*STEP").expect("a step");
    let size = |more: &str| {
        let text = format!("{model}{more}");
        let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
        found.unwrap_or_else(|error| panic!("{error}")).size
    };
    let held = size("");
    let all = 3 * sound
        .split("*ELEMENT")
        .next()
        .expect("nodes")
        .lines()
        .filter(|l| l.starts_with(|c: char| c.is_ascii_digit()))
        .count();
    assert!(held < all, "{held} of {all}");
    let step = "*STEP, NLGEOM=NO\n*FREQUENCY\n3\n";
    assert_eq!(size(&format!("{step}*END STEP\n")), held);
    assert_eq!(
        size(&format!(
            "{step}*BOUNDARY, OP=NEW\n1,1,3\n*BOUNDARY, OP=NEW\n2,1\n*END STEP\n"
        )),
        all - 4
    );
    let more = size(&format!(
        "{step}*BOUNDARY\n1,1,3\n2,1,3\n3,1,3\n4,1,3\n5,1,3\n6,1,3\n7,1,3\n8,1,3\n*END STEP\n"
    ));
    assert!(more <= held, "{more} {held}");
}

/// Surface and line elements from Gmsh do not change the structure and cause a note. A node set may come from an element set, directly or
/// within another set.
#[test]
fn faces_and_lines_without_a_section_are_left_out() {
    let plain = fs::read_to_string(folder().join("C3D10.inp")).expect("a sample");
    let expected = readers::parse("deck.inp".as_ref(), plain.as_bytes(), None).expect("a deck");
    let more = "*ELEMENT, TYPE=CPS6, ELSET=SKIN\n901,1,2,3,4,5,6\n*ELEMENT, TYPE=T3D2\n902,1,2\n*ELSET, ELSET=FIRST, GENERATE\n1,2\n\
                *ELSET, ELSET=TWO\nFIRST, 2\n*NSET, NSET=OF_SKIN, ELSET=SKIN\n*NSET, NSET=OF_TWO, ELSET=TWO\n*NSET, NSET=BOTH\nOF_SKIN, OF_TWO\n*MATERIAL";
    let text = plain.replacen("*MATERIAL", more, 1);
    let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None).expect("a deck");
    assert_eq!(found.stiffness, expected.stiffness);
    assert_eq!(found.sets["OF_SKIN"], [1, 2, 3, 4, 5, 6]);
    assert_eq!(found.sets["OF_TWO"].len(), 14, "two tetrahedra share six");
    assert_eq!(found.sets["BOTH"].len(), 20);
    let told = "2 elements of surfaces or lines (CPS6, T3D2), which no section names, are left out";
    assert!(
        found.notes.iter().any(|note| note == told),
        "{:?}",
        found.notes
    );
}

/// A loss factor of a material is hysteretic damping proportional to its stiffness.
#[test]
fn structural_damping_of_a_material_is_part_of_its_stiffness() {
    let plain = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let text = plain.replace("*DENSITY", "*DAMPING, STRUCTURAL=0.03\n*DENSITY");
    let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None).expect("a deck");
    let (stiffness, damping) = (found.stiffness.expect("K"), found.hysteretic.expect("H"));
    assert_eq!(found.damping, None);
    for (k, h) in stiffness.entries.iter().zip(&damping.entries) {
        assert_eq!((k.0, k.1), (h.0, h.1));
        assert!((h.2 - 0.03 * k.2).abs() <= 1e-12 * stiffness.largest());
    }
    let text = plain.replace("*DENSITY", "*DAMPING, ALPHA=3.\n*DENSITY");
    let refused = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
    let refused = refused.expect_err("ALPHA").to_string();
    assert!(
        refused.contains("ALPHA=3.") && refused.contains("dynamics.rayleigh"),
        "{refused}"
    );
}

/// The reader joins included files into one text and finds them in the folder of the deck. An error names the lines of the files.
#[test]
fn included_files_are_read_in_their_place() {
    let plain = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    let read = |name: &str| {
        let path = folder.path().join(name);
        readers::read(&[Input { path, role: None }], None)
    };
    let (nodes, rest) = plain.split_once("*ELEMENT").expect("elements");
    write("mesh/nodes.inp", nodes);
    write("mesh/all.inp", "*INCLUDE, INPUT=nodes.inp");
    write("plain.inp", &plain);
    write(
        "deck.inp",
        &format!("  *include, input = mesh/all.inp\n*ELEMENT{rest}"),
    );
    let (found, expected) = (
        read("deck.inp").expect("a deck"),
        read("plain.inp").expect("a deck"),
    );
    assert_eq!(found.stiffness, expected.stiffness);
    write("mesh/nodes.inp", &nodes.replacen(',', ";", 1));
    let told = read("deck.inp").expect_err("a fault").to_string();
    assert!(told.contains("nodes.inp as lines 1 to"), "{told}");
    write("mesh/nodes.inp", "*INCLUDE, INPUT=../deck.inp\n");
    let told = read("deck.inp").expect_err("a circle").to_string();
    assert!(told.contains("includes this file"), "{told}");
    fs::remove_file(folder.path().join("mesh/nodes.inp")).expect("a file");
    let told = read("deck.inp").expect_err("no file").to_string();
    assert!(told.contains("nodes.inp"), "{told}");
}

/// A keyword line that ends with a comma continues on the next line. Blanks may follow a star. Lines of numbers are data.
#[test]
fn a_keyword_may_go_on_below() {
    let plain = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let folder = tempfile::tempdir().expect("a folder");
    let read = |text: &str| {
        let path = folder.path().join("deck.inp");
        fs::write(&path, text).expect("a file");
        readers::read(&[Input { path, role: None }], None)
    };
    let expected = read(&plain).expect("a deck");
    let (head, tail) = plain.split_once("*ELEMENT,").expect("elements");
    let on = format!("{head}* ELEMENT,\r\n   {}", tail.trim_start());
    let found = read(&on).expect("a deck");
    assert_eq!(found.stiffness, expected.stiffness);
    let dense = plain.replacen("*DENSITY\n", "*DENSITY,\n", 1);
    assert_eq!(read(&dense).expect("a deck").mass, expected.mass);
    // The name of a set is data.
    let held = read(&plain.replacen("*BOUNDARY\n", "*BOUNDARY,\n", 1)).expect("a deck");
    assert_eq!(held.size, expected.size);
    // Line numbers count the lines of the file.
    let (sound, _) = on.split_once("*MATERIAL").expect("a material");
    let line = sound.lines().count() + 1;
    let told = read(&format!("{sound}*NO SUCH KEYWORD\n")).expect_err("a keyword");
    assert!(told.to_string().contains(&format!("line {line}")), "{told}");
}

/// Material constants must follow a *MATERIAL, once each.
#[test]
fn constants_of_no_material_and_twice_are_rejected() {
    let sound = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let told = |text: String| {
        let found = readers::parse("deck.inp".as_ref(), text.as_bytes(), None);
        found.expect_err("a fault").to_string()
    };
    let twice = sound.replacen("*DENSITY", "*DENSITY\n1e-9\n*DENSITY", 1);
    assert!(told(twice).contains("one line of *DENSITY"));
    let before = format!("*DAMPING, STRUCTURAL=0.1\n{sound}");
    assert!(told(before).contains("below the *MATERIAL"));
    let (model, step) = sound.split_once("*STEP").expect("a step");
    let in_step = format!("{model}*STEP\n*DAMPING, STRUCTURAL=0.1{step}");
    assert!(told(in_step).contains("below the *MATERIAL"));
    let global = format!("{model}*STEP\n*GLOBAL DAMPING, STRUCTURAL=0.1{step}");
    assert!(told(global).contains("*GLOBAL DAMPING"));
}

/// The reader rejects an included name that exists in two folders.
#[test]
fn an_included_name_is_one_file() {
    let plain = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let folder = tempfile::tempdir().expect("a folder");
    let write = |name: &str, text: &str| {
        let path = folder.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    let read = || {
        let path = folder.path().join("deck.inp");
        readers::read(&[Input { path, role: None }], None)
    };
    write("deck.inp", "*INCLUDE, INPUT=sub/all.inp\n");
    write("sub/all.inp", "*INCLUDE, INPUT=mesh.inp\n");
    let missing = read().expect_err("no file").to_string();
    assert!(
        missing.contains("all.inp") && missing.contains("line 1") && missing.contains("mesh.inp"),
        "{missing}"
    );
    write("sub/mesh.inp", &plain);
    read().expect("a deck");
    write("mesh.inp", &plain);
    let both = read().expect_err("two files").to_string();
    assert!(both.contains("a name that is one file"), "{both}");
}

/// If node positions are exchanged, the body translates freely but resists rotation.
#[test]
fn a_body_that_does_not_turn_is_doubted() {
    let deck = fs::read_to_string(folder().join("C3D8.inp")).expect("a sample");
    let (model, _) = deck.split_once("*STEP").expect("a step");
    let free: Vec<&str> = model.split("*BOUNDARY").collect();
    let free = free[0].to_owned();
    let sound = readers::parse("deck.inp".as_ref(), free.as_bytes(), None).expect("a deck");
    let doubts = |matrices: &Matrices| {
        let all = model_warnings(matrices);
        all.iter()
            .filter(|text| text.contains("resists a rotation"))
            .count()
    };
    assert_eq!(doubts(&sound), 0);
    let mut other = sound.clone();
    let [a, b] = [1, 5].map(|node| sound.positions[&node]);
    other.positions.insert(1, b);
    other.positions.insert(5, a);
    assert_eq!(doubts(&other), 1);
    let mut turned = sound;
    let dofs = turned.dofs.as_mut().expect("freedoms");
    for dof in dofs {
        dof.direction = [0, 3, 2, 1][dof.direction as usize];
    }
    assert_eq!(doubts(&turned), 1);
}
