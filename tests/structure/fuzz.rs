//! Matrix readers on damaged files: a result or an error, within bounds of time and memory, without a panic.

use std::path::Path;
use std::time::{Duration, Instant};

use fretwear::structure::readers::parse;

use super::readers::sample;
use crate::support::damage::{Noise, mutant};

/// One sample of each reader and variant.
const SAMPLES: [&str; 17] = [
    "coordinate_K.mtx",
    "array_M.mtx",
    "labels_MASS1.mtx",
    "coordinates_stiffness.mtx",
    "substructure.mtx",
    "truss.sti",
    "truss.dof",
    "truss.inp",
    "truss.full",
    "csr_K.npz",
    "both.npz",
    "solids/C3D10.inp",
    "solids/C3D20R.inp",
    "solids/C3D15.inp",
    "solids/C3D6.inp",
    "solids/tied.inp",
    "solids/tied_quadratic.inp",
];

/// Largest time for one file. A sample takes a millisecond, and a busy machine is less than a thousand times slower.
const LONGEST: Duration = Duration::from_secs(2);
/// Largest number of rows of a damaged file per byte. A megabyte of zeros compresses to a kilobyte.
const ROWS_OF_A_BYTE: usize = 1100;

fn fuzz(name: &str, bytes: &[u8], seed: usize, each: usize) {
    let mut noise = Noise(seed as u64);
    let (mut read, mut refused) = (0, 0);
    for round in 0..each {
        let mutant = mutant(bytes, &mut noise);
        let begun = Instant::now();
        match parse(Path::new(name), &mutant, None) {
            Ok(matrices) => {
                read += 1;
                let rows = matrices.size;
                assert!(
                    rows <= ROWS_OF_A_BYTE * mutant.len(),
                    "{name}, mutant {round}: {rows} rows"
                );
            }
            Err(error) => {
                refused += 1;
                assert!(
                    error.to_string().starts_with(name),
                    "{name}, mutant {round}: {error}"
                );
            }
        }
        assert!(
            begun.elapsed() < LONGEST,
            "{name}, mutant {round}: {:?}",
            begun.elapsed()
        );
    }
    assert!(
        refused > each / 100,
        "{name}: {read} of {each} mutants were read"
    );
}

fn fuzz_samples(each: usize) {
    for (k, name) in SAMPLES.iter().enumerate() {
        fuzz(name, &std::fs::read(sample(name)).expect(name), k, each);
    }
}

#[test]
fn damaged_files_are_read_or_refused() {
    fuzz_samples(1500);
}

/// Files of other programs, in the folder `matrices` of `FRETWEAR_REAL_DATA`.
const REAL: [&str; 3] = [
    "abaqus_mtx/model_STIF1.mtx",
    "abaqus_substructure/inner.mtx",
    "calculix/block_clamped.sti",
];

#[test]
#[ignore = "long: many minutes for 100 000 mutants of each sample and each real file"]
fn many_damaged_files_are_read_or_refused() {
    const EACH: usize = 100_000;
    fuzz_samples(EACH);
    let Some(folder) = std::env::var_os("FRETWEAR_REAL_DATA") else {
        println!("skipped: FRETWEAR_REAL_DATA does not name a folder with {REAL:?}");
        return;
    };
    for (k, name) in REAL.iter().enumerate() {
        let path = Path::new(&folder).join("matrices").join(name);
        fuzz(name, &std::fs::read(path).expect(name), k, EACH);
    }
}
