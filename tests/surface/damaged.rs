//! Map readers on damaged files: a map or an error, within bounds of time and memory, without a panic.

use std::path::Path;
use std::time::{Duration, Instant};

use fretwear::surface::readers::parse;

use super::foreign::sample;
use super::writers::{x3p_description, zip};
use super::{AS_STATED, MICROMETRES};
use crate::support::damage::{Noise, mutant};

/// Largest time for one file. A sample takes less than a millisecond, and a busy machine is less than a thousand times slower.
const LONGEST: Duration = Duration::from_secs(2);
/// Largest number of points of a damaged file per byte. A megabyte of zeros compresses to a kilobyte.
const POINTS_OF_A_BYTE: usize = 1100;

/// Reads many mutants from `damage`.
fn fuzz(name: &str, each: usize, damage: impl Fn(&mut Noise) -> Vec<u8>) {
    let mut noise = Noise(each as u64);
    let (mut maps, mut refused) = (0, 0);
    for round in 0..each {
        let bytes = damage(&mut noise);
        let begun = Instant::now();
        let options = if round % 2 == 0 {
            AS_STATED
        } else {
            MICROMETRES
        };
        match parse(Path::new(name), &bytes, &options) {
            Ok(found) => {
                maps += 1;
                let map = found.topography;
                let place = format!("{name}, mutant {round}");
                assert_eq!(map.heights.len(), map.nx * map.ny, "{place}");
                let most = POINTS_OF_A_BYTE * bytes.len();
                assert!(map.heights.len() <= most, "{place}");
                let is_distance = |d: f64| d.is_finite() && d > 0.0;
                let spacing = map.spacing.unwrap_or([1.0; 2]);
                assert!(spacing.into_iter().all(is_distance), "{place}: {spacing:?}");
                assert!(!map.heights.iter().any(|h| h.is_infinite()), "{place}");
                assert!(map.holes() < map.heights.len(), "{place}");
            }
            Err(error) => {
                refused += 1;
                let message = error.to_string();
                assert!(
                    message.starts_with(name),
                    "{name}, mutant {round}: {message}"
                );
            }
        }
        let taken = begun.elapsed();
        assert!(taken < LONGEST, "{name}, mutant {round}: {taken:?}");
    }
    assert!(refused > each / 100, "{name}: {maps} of {each} were read");
}

fn fuzz_all(each: usize) {
    let read = |name: &str| std::fs::read(sample(name)).expect(name);
    let matrix = "1 2.5 Bad 4\n5 6.5 *** 8\n9 -1e-3 1e38 0\n";
    let spip = format!(
        "# File Format = ASCII\n# x-pixels = 4\n# y-pixels = 3\n# x-length = 400\n# y-length = 600\n# Bit2nm = 0.5\n# voidpixels = 2\n# Start of Data:\n{matrix}1 1 1 1\n1 1 0 1\n1 1 0 1\n"
    );
    let wide: Vec<u8> = "\u{feff}1,5;2,5;3;4\r\n5;6;;8\r\n"
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    let texts = [
        matrix.as_bytes().to_vec(),
        spip.into_bytes(),
        wide,
        read("foreign/points.csv"),
        read("foreign/to_matrix.txt"),
        read("cases/text_holes/nodata.xyz"),
        read("cases/gwyddion_text/map.txt"),
    ];
    for text in &texts {
        fuzz("map.txt", each.div_ceil(texts.len()), |noise| {
            mutant(text, noise)
        });
    }
    for name in ["plain.sur", "compressed.sur"] {
        let bytes = read(&format!("foreign/{name}"));
        fuzz(name, each.div_ceil(2), |noise| mutant(&bytes, noise));
    }
    // The archive, and its members in an archive with correct checksums.
    let archive = read("foreign/surfalize.x3p");
    fuzz("map.x3p", each.div_ceil(4), |noise| mutant(&archive, noise));
    let z = "<DataType>I</DataType><Increment>1e-7</Increment><Offset>1e-5</Offset>";
    let good = x3p_description(7, 5, [0.5e-6, 0.8e-6], z, true);
    let points: Vec<u8> = (0..35i16).flat_map(i16::to_le_bytes).collect();
    fuzz("map.x3p", each.div_ceil(2), |noise| {
        zip(&[
            ("map/main.xml", &mutant(good.as_bytes(), noise)),
            ("map/bindata/data.bin", &points),
            ("map/bindata/valid.bin", &[0xfe; 5]),
        ])
    });
    fuzz("map.x3p", each.div_ceil(4), |noise| {
        zip(&[
            ("main.xml", good.as_bytes()),
            ("bindata/data.bin", &mutant(&points, noise)),
            ("bindata/valid.bin", &mutant(&[0xfe; 5], noise)),
        ])
    });
}

#[test]
fn damaged_maps_are_read_or_refused() {
    fuzz_all(500);
}

#[test]
#[ignore = "long: a minute for 100 000 mutants of each format"]
fn many_damaged_maps_are_read_or_refused() {
    fuzz_all(100_000);
}
