//! `export`: the deck in a file, its frequencies on stdout.

use std::fs;

use crate::support::Bench;

#[test]
fn export_writes_the_bonded_resonator_and_prints_nothing() {
    let bench = Bench::new();
    let did = bench.done(&["export", "-o", "tied.inp"]);
    assert_eq!((did.stdout(), did.stderr()), (String::new(), String::new()));
    let deck = fs::read_to_string(bench.path("tied.inp")).expect("the deck");
    assert!(deck.starts_with("*HEADING\n") && deck.ends_with("*END STEP\n"));
    assert!(!deck.contains("*SPRING"));
}

#[test]
fn stiffnesses_make_springs() {
    let bench = Bench::new();
    let springs = ["--kt", "1e4 N/um", "--kn", "12 kN/um", "--modes", "1"];
    let more = ["-o", "sprung.inp", "--frequencies"];
    let found = bench
        .done(&[&["export"], &springs[..], &more].concat())
        .json();
    assert_eq!(found["rigid_modes"], 6);
    let lowest = found["elastic_frequencies"][0].as_f64().expect("a number");
    // The first of the frequencies with these springs that an independent program found.
    assert!((lowest - 456.3).abs() < 0.05, "{lowest}");
    let deck = fs::read_to_string(bench.path("sprung.inp")).expect("the deck");
    let stiffness = |axis: usize| {
        let spring = deck.split("*SPRING, ").nth(axis).expect("a spring");
        let mut lines = spring.lines().skip(1);
        assert_eq!(lines.next(), Some(axis.to_string().as_str()));
        let value: f64 = lines.next().expect("a line").parse().expect("a number");
        value * 340.0
    };
    for (axis, total) in [(1, 1e10), (2, 1e10), (3, 1.2e10)] {
        assert!((stiffness(axis) / total - 1.0).abs() < 1e-11);
    }
}

#[test]
fn what_cannot_be_exported() {
    let bench = Bench::new();
    let code = |arguments: &[&str]| bench.fretwear(&[&["export"], arguments].concat()).code();
    assert_eq!(code(&[]), 2, "no file");
    assert_eq!(
        code(&["-o", "a.inp", "--kt", "1e4 N/um"]),
        2,
        "half a joint"
    );
    let lengths = ["-o", "a.inp", "--kt", "1 um", "--kn", "1 N/um"];
    assert_eq!(code(&lengths), 2);
    assert_eq!(code(&["-o", "a.inp", "--modes", "0"]), 2);
    assert_eq!(code(&["-o", "no/such/folder.inp"]), 1);
    let both = ["--tied", "--kt", "1 N/um", "--kn", "1 N/um"];
    assert_eq!(code(&[&["-o", "a.inp"], &both[..]].concat()), 2);
    // The scene of the other tests has no structure.
    let did = bench.fretwear(&["export", "small.toml", "-o", "a.inp"]);
    assert_eq!(did.code(), 2);
    assert!(did.stderr().contains("resonator"), "{}", did.stderr());
    assert!(!bench.path("a.inp").exists());
}
