//! Tests of `export`: the deck as a file, its natural frequencies on stdout.

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
    // An independent program computed 456.3 Hz as the lowest elastic frequency with these springs.
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
fn a_scene_says_what_is_exported() {
    const SCENE: &str = r#"
        [joint]
        size = ["40 mm", "40 mm"]
        elements = [19, 19]
        [material]
        youngs_modulus = "198.4 GPa"
        poisson_ratio = 0.3
        density = "7949 kg/m^3"
        [contact]
        kn = "1.2e4 N/um"
        kt = "1e4 N/um"
        normal_load = "30 kN"
        friction_coefficient = 0.6
        [structure]
        kind = "resonator"
        [dynamics]
        force = { amplitude = "1000 N", at = "far_wall", direction = "x" }
        frequency = ["900 Hz", "1050 Hz"]
    "#;
    let bench = Bench::new();
    bench.write("springs.toml", SCENE);
    let export = |more: &[&str]| {
        bench.done(&[&["export", "-o", "found.inp"], more].concat());
        fs::read_to_string(bench.path("found.inp")).expect("the deck")
    };
    // The scene has the shipped dimensions and springs for the whole joint, so the options give the same deck.
    let expected = export(&["--kt", "1e4 N/um", "--kn", "1.2e4 N/um"]);
    assert_eq!(export(&["springs.toml"]), expected);
    assert_eq!(export(&["springs.toml", "--tied"]), export(&[]));
    let stiffer = ["--kt", "2e4 N/um", "--kn", "1.2e4 N/um"];
    assert_eq!(
        export(&[&["springs.toml"], &stiffer[..]].concat()),
        export(&stiffer)
    );
    let longer = export(&["springs.toml", "--set", "structure.window_length=90 mm"]);
    assert!(longer.contains(", 1.74") && !expected.contains(", 1.74"));
    // A joint with a gap has no contact stiffness, so the deck has no springs and no nodes for springs.
    bench.write(
        "gap.toml",
        SCENE.replace(r#"normal_load = "30 kN""#, r#"gap = "1 um""#),
    );
    let gap = export(&["gap.toml"]);
    assert!(gap.contains("CONTACT_UPPER_FACES") && !gap.contains("SPRING"));
}

#[test]
fn what_cannot_be_exported() {
    let bench = Bench::new();
    let code = |arguments: &[&str]| bench.fretwear(&[&["export"], arguments].concat()).code();
    assert_eq!(code(&[]), 2, "no file");
    assert_eq!(
        code(&["-o", "a.inp", "--kt", "1e4 N/um"]),
        2,
        "--kt without --kn"
    );
    let lengths = ["-o", "a.inp", "--kt", "1 um", "--kn", "1 N/um"];
    assert_eq!(code(&lengths), 2);
    assert_eq!(code(&["-o", "a.inp", "--modes", "0"]), 2);
    assert_eq!(code(&["-o", "no/such/folder.inp"]), 1);
    let both = ["--tied", "--kt", "1 N/um", "--kn", "1 N/um"];
    assert_eq!(code(&[&["-o", "a.inp"], &both[..]].concat()), 2);
    // The scene `small.toml` has no structure.
    let did = bench.fretwear(&["export", "small.toml", "-o", "a.inp"]);
    assert_eq!(did.code(), 2);
    assert!(did.stderr().contains("resonator"), "{}", did.stderr());
    assert!(!bench.path("a.inp").exists());
}
