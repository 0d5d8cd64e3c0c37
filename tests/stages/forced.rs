//! Wear of a joint by the response at a given frequency, far below the resonance of the structure.

use fretwear::tables::{TableName, typed};

use super::Start;
use super::vibrating::updates;
use crate::support::{Bench, RESONATOR, assert_same, content, latest, reader, table, verified};

/// Small resonator at 20 Hz, 1/50 of its resonance. Its contact elements are sliders, and the run has two updates within four iterations.
fn forced() -> String {
    let text = RESONATOR.replace(
        "frequency = [\"900 Hz\", \"1100 Hz\"]\npoints = 3\n",
        "at = \"20 Hz\"\n",
    );
    text.replace("\"300 N\"", "\"14 kN\"")
        .replace("\"total\"", "\"sliders\"")
        .replace("\"2e5 um^3/J\"", "\"1e4 um^3/J\"")
}

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("forced.toml", forced());
    bench
}

#[test]
fn it_wears_the_joint_without_a_resonance() {
    let bench = bench();
    let root = bench.path("a");
    Start::new(bench.scene("forced.toml", &[]), &root).done();
    verified(&root);
    let reader = reader(&root);
    let last = latest(&root);
    assert!(updates(&root).len() > 1 && last > 1);
    for k in 0..=last {
        let response: typed::DynamicResponse = reader.typed(k).expect("a table");
        assert_eq!(
            (response.resonance_frequency, response.resonance_amplitude),
            (None, None)
        );
        assert_eq!(
            (response.error_resonance_frequency, response.peak_frequency),
            (None, 20.0)
        );
        // The response with added harmonics has an error of the energy below 0.1 %.
        assert!(response.error_energy < 1e-3 && response.friction_energy > 0.0);
        let resonance: typed::Resonance = reader.typed(k).expect("a table");
        assert_eq!(
            (resonance.kind, resonance.frequency),
            (vec!["forced".to_owned()], vec![20.0])
        );
        let summary: typed::Summary = reader.typed(k).expect("a table");
        assert_eq!(
            (
                summary.resonance_frequency,
                summary.error_resonance_frequency
            ),
            (None, None)
        );
        assert!(summary.error_peak_amplitude.is_some());
        let ledger: typed::Ledger = reader.typed(k).expect("a table");
        for (quantity, (fine, dynamic)) in ledger
            .quantity
            .iter()
            .zip(ledger.fine.iter().zip(&ledger.dynamic))
        {
            let agreed = match quantity.as_str() {
                "force_along_motion [N]" | "dissipated_energy [J]" => 0.02,
                "total_force [N]" => 0.05,
                _ => continue,
            };
            let off = (fine / dynamic - 1.0).abs();
            assert!(off < agreed, "iteration {k}: {quantity}: {off:.1e} apart");
        }
        let commit = reader.commit_of(k).expect("committed");
        let has = |name: TableName| commit.tables.contains_key(name.as_str());
        assert_eq!(has(TableName::WornResponse), k == 0 || k == last);
        assert!(!has(TableName::Frf) && !has(TableName::FrfHarmonic));
    }
    let worn: typed::WornResponse = reader.typed(last).expect("a table");
    assert_eq!(
        (worn.resonance_frequency, worn.peak_frequency),
        (None, 20.0)
    );
}

#[test]
fn from_any_iteration_in_the_same_bits() {
    let bench = bench();
    let scene = bench.scene("forced.toml", &[]);
    let a = bench.path("a");
    Start::new(scene.clone(), &a).done();
    let expected = content(&a);
    for k in 0..latest(&a) {
        let root = bench.path(&format!("from-{k}"));
        Start::new(scene.clone(), &root).from(&a, k).done();
        assert_same(&content(&root), &expected, &format!("from {k}"));
    }
}

/// Commands that read runs print the frequency instead of a resonance. Commands that need a range of resonances report the missing range.
#[test]
fn a_run_is_read_without_a_resonance() {
    let bench = bench();
    let done = bench.done(&["run", "forced.toml", "--run", "a"]);
    assert!(
        done.stdout().contains("amplitude at dynamics.at"),
        "{}",
        done.stdout()
    );
    assert!(!done.stdout().contains("resonance "), "{}", done.stdout());
    assert_eq!(
        bench.done(&["status", "a", "--json"]).json()["peak_frequency"],
        20.0
    );
    let planned = bench.done(&["plan", "forced.toml"]);
    assert!(
        planned.stdout().contains("forced, at 20 Hz"),
        "{}",
        planned.stdout()
    );
    let refused = bench.fretwear(&["backbone", "a@0"]);
    assert_eq!(refused.code(), 2);
    assert!(
        refused.stderr().contains("also give dynamics.frequency"),
        "{}",
        refused.stderr()
    );
    // A given range applies to the forced response and to a backbone.
    let range = r#"dynamics.frequency=["900 Hz", "1100 Hz"]"#;
    let sets = [
        "--set",
        range,
        "--set",
        "dynamics.points=3",
        "--set",
        "wear.cycles=1000",
    ];
    let with_range = [&["run", "forced.toml", "--run", "b"][..], &sets].concat();
    bench.done(&with_range);
    assert_eq!(table(&bench.path("b"), 0, TableName::Frf).rows(), 3);
    let response = table(&bench.path("b"), 0, TableName::DynamicResponse);
    assert_eq!(response.f64("peak_frequency").expect("a column"), [20.0]);
    bench.done(&[
        "backbone", "b@0", "--levels", "2", "--from", "10 N", "--to", "100 N",
    ]);
}

#[test]
fn a_frequency_beyond_the_modes_is_refused() {
    let bench = bench();
    let did = bench.fretwear(&["run", "forced.toml", "--set", "dynamics.at=30 kHz"]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    let said = "dynamics.at reaches 30000.0 Hz, but the reduced structure omits a mode at";
    assert!(
        did.stderr().contains(said) && did.stderr().contains("raise dynamics.modes"),
        "{}",
        did.stderr()
    );
}
