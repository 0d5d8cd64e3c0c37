//! Matrices from Abaqus and CalculiX. The environment variable names the folder of the files.

use std::path::PathBuf;

use fretwear::structure::frequencies::{Frequencies, lowest_frequencies};
use fretwear::structure::inspection::{mass_by_direction, parse_fixed_rows, units};
use fretwear::structure::matrices::Matrices;
use fretwear::structure::readers::{Input, read};

const FOLDER: &str = "FRETWEAR_REAL_DATA";

fn real(names: &[&str]) -> Option<Matrices> {
    let Some(folder) = std::env::var_os(FOLDER).map(PathBuf::from) else {
        println!("skipped: {FOLDER} does not name a folder with {names:?}");
        return None;
    };
    let inputs: Vec<Input> = names
        .iter()
        .map(|name| Input {
            path: folder.join("matrices").join(name),
            role: None,
        })
        .collect();
    Some(read(&inputs, None).unwrap_or_else(|error| panic!("{error}")))
}

fn modes(matrices: &Matrices, held: &str, count: usize) -> Frequencies {
    let is_fixed = if held.is_empty() {
        vec![false; matrices.size]
    } else {
        parse_fixed_rows(matrices, held).expect(held).0
    };
    lowest_frequencies(matrices, &is_fixed, count)
        .expect("modes")
        .expect("stiffness and mass")
}

/// Compares with a published value to half of its last digit.
fn assert_near(found: f64, published: f64, half_a_digit: f64) {
    assert!(
        (found - published).abs() <= half_a_digit,
        "{found} {published}"
    );
}

#[test]
fn abaqus_matrices_with_internal_nodes() {
    let Some(beam) = real(&["abaqus_mtx/model_STIF1.mtx", "abaqus_mtx/model_MASS1.mtx"]) else {
        return;
    };
    assert_eq!((beam.size, beam.nodes()), (14, 3));
    assert_eq!(
        beam.dofs
            .as_ref()
            .expect("labels")
            .iter()
            .filter(|d| d.node < 0)
            .count(),
        2
    );
    // Density 100, section 0.25, length 3. The internal freedoms along the axis are relative, so only the lateral sum gives the mass.
    let [_, _, across] = mass_by_direction(&beam);
    assert_near(across.expect("a mass"), 75.0, 1e-9);
    let found = modes(&beam, "", 8);
    // Three combinations have no mass. The other frequencies are numpy results.
    assert_eq!((found.rigid.len(), found.elastic.len()), (6, 5));
    let others = [11.6230337, 11.6230337, 164.374518, 167.764040, 410.936296];
    for (found, other) in found.elastic.iter().zip(others) {
        assert_near(found / other, 1.0, 1e-8);
    }
}

#[test]
fn abaqus_substructures() {
    let (Some(outer), Some(inner)) = (
        real(&["abaqus_substructure/outer.mtx"]),
        real(&["abaqus_substructure/inner.mtx"]),
    ) else {
        return;
    };
    assert_eq!(
        (outer.size, outer.nodes(), inner.size, inner.nodes()),
        (72, 12, 36, 6)
    );
    let trace = |m: &Matrices| {
        (
            m.stiffness.as_ref().expect("K").trace(),
            m.mass.as_ref().expect("M").trace(),
        )
    };
    assert_near(trace(&outer).0 / 1e5, 6.7948502076, 5e-11);
    assert_near(trace(&outer).1 / 1e-7, 4.9481763083, 5e-11);
    assert_near(trace(&inner).0 / 1e6, 9.5258939996, 5e-11);
    let nodes: Vec<i64> = inner
        .dofs
        .iter()
        .flatten()
        .step_by(6)
        .map(|d| d.node)
        .collect();
    assert_eq!(nodes, [2, 3, 4, 5, 6, 7]);
    assert_eq!(modes(&inner, "", 3).rigid.len(), 6);
}

#[test]
fn calculix_blocks() {
    let (Some(clamped), Some(free), Some(incompatible)) = (
        real(&["calculix/block_clamped.mas"]),
        real(&["calculix/block_free.sti"]),
        real(&["calculix/block_clamped_c3d8i.dof"]),
    ) else {
        return;
    };
    assert_eq!((clamped.size, free.size), (81, 108));
    assert_near(modes(&clamped, "", 4).elastic[0], 15579.46, 5e-3);
    let found = modes(&free, "", 4);
    assert_eq!(found.rigid.len(), 6);
    assert_near(found.elastic[0], 54018.0, 0.5);
    // 30 x 20 x 20 mm of 7.949e-9 t/mm³.
    for along in mass_by_direction(&free) {
        assert_near(along.expect("a mass") / (12e3 * 7.949e-9), 1.0, 1e-12);
    }
    // Nodes of the clamped deck, for which the free deck has no set.
    let held = modes(&free, "1,5,9,13,17,21,25,29,33", 4);
    assert_near(held.elastic[0], 15579.46, 5e-3);
    assert!(units(&free).expect("a guess").likely.starts_with("mm, t"));
    // Kilograms instead of tonnes.
    let mut heavy = free.clone();
    heavy
        .mass
        .iter_mut()
        .flat_map(|m| &mut m.entries)
        .for_each(|e| e.2 *= 1e3);
    assert!(units(&heavy).expect("a guess").likely.starts_with("none"));
    // CalculiX removed the rows of the set, so no row remains to fix.
    let (rows, notes) = parse_fixed_rows(&clamped, "FIX").expect("a set");
    assert!(!rows.contains(&true) && notes.len() == 1);
    assert_eq!((incompatible.size, incompatible.nodes()), (189, 63));
}
