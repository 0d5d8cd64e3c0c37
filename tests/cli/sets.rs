//! Tests of `--set` with the shipped scenes.

use std::path::Path;

use crate::support::{Bench, latest, summary, verified};

fn pipeline(name: &str) -> String {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(name);
    path.to_str().expect("a path of text").to_owned()
}

/// Surface heights as NPY (version 1.0): 64-bit floats, axis 0 is x.
fn npy(shape: [usize; 2], height: impl Fn(usize, usize) -> f64) -> Vec<u8> {
    let mut header = format!(
        "{{'descr': '<f8', 'fortran_order': False, 'shape': ({}, {}), }}",
        shape[0], shape[1]
    );
    while (10 + header.len() + 1) % 64 != 0 {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    for i in 0..shape[0] {
        for j in 0..shape[1] {
            bytes.extend(height(i, j).to_le_bytes());
        }
    }
    bytes
}

#[test]
fn a_file_in_place_of_a_generated_surface() {
    let bench = Bench::new();
    // The heights are in millimetres. Only a ridge along y is in contact.
    bench.write(
        "x.npy",
        npy([20, 14], |i, j| if i == 5 { 1e-2 } else { 1e-5 * j as f64 }),
    );
    let scene = pipeline("static_contact.toml");
    let mut arguments = vec!["run", &scene, "--run", "a", "--json"];
    for set in [
        "surface.kind=file",
        "surface.path=x.npy",
        "surface.unit=mm",
        "surface.detrend=none",
        "joint.grid=[20, 14]",
        "contact.normal_load=30 N",
    ] {
        arguments.extend(["--set", set]);
    }
    let found = bench.done(&arguments).json();
    let root = bench.path("a");
    verified(&root);
    let mean = (1e-5 + 19.0 * 6.5e-8) / 20.0;
    let height = summary(&root, 0, "mean_height");
    assert!(
        (height / mean - 1.0).abs() < 1e-9,
        "{height:e} instead of {mean:e}"
    );
    let area = found["contact_area_fraction"].as_f64().expect("a number");
    assert!(
        (area - 1.0 / 20.0).abs() < 1e-12,
        "contact area fraction: {area}"
    );
    // A run restarts without its scene file and from another working folder.
    let elsewhere = Bench::new();
    let run = root.to_str().expect("a path of text");
    assert_eq!(
        elsewhere.done(&["run", "--run", run, "--json"]).json()["rq"],
        found["rq"]
    );
}

#[test]
fn numbers_quantities_and_words() {
    let bench = Bench::new();
    let mut arguments = vec!["run", "small.toml", "--run", "a", "--json"];
    for set in [
        "wear.cycles=4e4",
        "surface.rq=0.5 um",
        "surface.correlation_length=[\"0.6 mm\", \"0.5 mm\"]",
        "contact.transverse=absent",
        "title=Another one",
        "output={ keep = \"all\", curves_every = 0 }",
    ] {
        arguments.extend(["--set", set]);
    }
    let found = bench.done(&arguments).json();
    assert_eq!(found["cycles"], 40_000);
    let root = bench.path("a");
    let rq = summary(&root, 0, "rq");
    assert!((rq / 0.5e-6 - 1.0).abs() < 1e-9, "{rq:e}");
    assert!(
        !root
            .join("iterations/wear_iteration=0/indentation.parquet")
            .exists()
    );
    assert!(
        bench
            .done(&["run", "--run", "a"])
            .stdout()
            .contains("Another one")
    );
}

#[test]
fn the_default_folder_is_that_of_the_scene() {
    let bench = Bench::new();
    let did = bench.done(&["run", "small.toml", "--set", "wear.cycles=10_000"]);
    assert!(
        did.stderr().starts_with("begins runs/small\n"),
        "{}",
        did.stderr()
    );
    let root = bench.path("runs/small");
    let last = latest(&root);
    let from = format!("runs/small@{last}");
    let did = bench.done(&["run", "--from", &from, "--set", "wear.cycles=20_000"]);
    let name = format!("begins runs/small-from-{last} from iteration {last}\n");
    assert!(did.stderr().starts_with(&name), "{}", did.stderr());
    assert_eq!(
        summary(
            &bench.path(&format!("runs/small-from-{last}")),
            last + 1,
            "cycles"
        ),
        2e4
    );
}
