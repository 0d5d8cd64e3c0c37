//! Readers of matrices on damaged files: a result or an error, within bounds of time and memory, and no panic.

use std::path::Path;
use std::time::{Duration, Instant};

use fretwear::structure::readers::parse;

use super::readers::sample;

/// One of each reader and variant.
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

/// A sample is read in a millisecond; a machine that does other work, too, does not take a thousand times as long.
const LONGEST: Duration = Duration::from_secs(2);
/// Rows that a damaged file may have, over its bytes unpacked. A megabyte of zeros packs into a kilobyte.
const ROWS_OF_A_BYTE: usize = 1100;

/// Numbers that look random and are the same everywhere (splitmix64).
struct Noise(u64);

impl Noise {
    fn next(&mut self, below: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) % below.max(1) as u64) as usize
    }
}

fn mutant(bytes: &[u8], noise: &mut Noise) -> Vec<u8> {
    const WORDS: [&[u8]; 10] = [
        b"999999999999",
        b"-1",
        b"0",
        b"4294967296",
        b"1e400",
        b"nan",
        b"\xff\xff\xff\x7f",
        b"\xff\xff\xff\xff",
        b"\n",
        b"*",
    ];
    let mut bytes = bytes.to_vec();
    for _ in 0..1 + noise.next(4) {
        let at = noise.next(bytes.len());
        match noise.next(7) {
            0 if !bytes.is_empty() => bytes[at] ^= 1 << noise.next(8),
            1 if !bytes.is_empty() => bytes[at] = noise.next(256) as u8,
            2 => bytes.truncate(at),
            3 => {
                let end = (at + noise.next(64)).min(bytes.len());
                bytes.drain(at.min(end)..end);
            }
            4 => {
                // A number in place of another.
                let word = WORDS[noise.next(WORDS.len())];
                let digits = bytes[at.min(bytes.len())..]
                    .iter()
                    .position(u8::is_ascii_digit)
                    .map_or(at, |k| at + k);
                let length = bytes[digits.min(bytes.len())..]
                    .iter()
                    .take_while(|b| b.is_ascii_digit())
                    .count();
                bytes.splice(digits..digits + length, word.iter().copied());
            }
            5 => {
                let word = WORDS[noise.next(WORDS.len())];
                let end = (at + word.len()).min(bytes.len());
                bytes.splice(at..end, word.iter().copied());
            }
            _ => {
                let from = noise.next(bytes.len());
                let piece = bytes[from..(from + noise.next(200)).min(bytes.len())].to_vec();
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

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

/// What other programs wrote, below `matrices` of `FRETWEAR_REAL_DATA`.
const REAL: [&str; 3] = [
    "abaqus_mtx/model_STIF1.mtx",
    "abaqus_substructure/inner.mtx",
    "calculix/block_clamped.sti",
];

#[test]
#[ignore = "long: a hundred thousand mutants of each sample and real file take many minutes"]
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
