//! Tests of `fretwear backbone` with scenes and with iterations of runs: text, JSON, Parquet table and picture.

use std::f64::consts::TAU;
use std::fs;

use fretwear::reference::{Jenkins, JenkinsOscillator};
use fretwear::tables::{TableName, TypedTable, from_parquet, typed};
use serde_json::Value;

use crate::support::{Bench, OSCILLATOR, SLIDER, content, latest, table, verified};

/// Scene of one mass on a spring and a friction contact.
fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("slider.toml", [OSCILLATOR, SLIDER].concat());
    bench
}

fn numbers(state: &Value, name: &str) -> Vec<f64> {
    let points = state["points"].as_array().expect("points");
    let number = |point: &Value| point[name].as_f64().expect("a number");
    points.iter().map(number).collect()
}

fn written(bench: &Bench, name: &str) -> typed::Backbone {
    let bytes = fs::read(bench.path(name)).expect("a table");
    let table = from_parquet(&bytes, TableName::Backbone.schema()).expect("the table");
    typed::Backbone::of(&table).expect("its columns")
}

/// With one harmonic and a steady normal load, the backbone has a closed form; 256 samples per cycle limit the accuracy.
#[test]
fn a_scene_has_the_backbone_of_its_unworn_joint() {
    let bench = bench();
    let sets = [
        "--set",
        "dynamics.harmonics=[0, 1]",
        "--set",
        "fidelity.aft_samples=256",
    ];
    let range = ["--from", "1 N", "--to", "0.5 kN"];
    let arguments = [
        &["backbone", "slider.toml"],
        &sets[..],
        &range[..],
        &["--json", "-o", "b.parquet"],
    ]
    .concat();
    let did = bench.done(&arguments);
    assert_eq!(did.stderr(), "");
    let json = did.json();
    let state = &json["states"][0];
    let exact = JenkinsOscillator {
        mass: 1.0,
        damping: 20.0,
        stiffness: 4e6,
        contact: Jenkins {
            stiffness: 6e6,
            limit: 300.0,
        },
    };
    let names = ["force", "frequency", "damping_ratio", "amplitude"];
    let [force, frequency, damping, amplitude] = names.map(|name| numbers(state, name));
    assert_eq!((force[0], force[force.len() - 1]), (1.0, 500.0));
    assert_eq!(state["end"], Value::Null);
    for k in 0..force.len() {
        let at = amplitude[k];
        let off = [
            force[k] / exact.resonant_force(at),
            frequency[k] * TAU / exact.backbone(at),
            damping[k] / exact.damping_ratio(at),
        ];
        assert!(
            off.iter().all(|ratio| (ratio - 1.0).abs() < 2e-3),
            "{off:?} at {} N",
            force[k]
        );
    }
    // The JSON object and the table contain the same numbers from stick to full slip.
    let table = written(&bench, "b.parquet");
    assert_eq!((&table.force, &table.damping_ratio), (&force, &damping));
    assert_eq!(
        (&table.frequency, &table.amplitude),
        (&frequency, &amplitude)
    );
    assert!(table.state.iter().all(|state| state == "slider.toml"));
    assert_eq!(table.sliding_fraction[0], 0.0);
    assert_eq!(table.sliding_fraction.last(), Some(&1.0));
    let text = bench
        .done(&["backbone", "slider.toml", "--levels", "3"])
        .stdout();
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[0], "slider.toml, unworn");
    assert_eq!(lines.len(), 6, "{text}");
    // The command accepts a force without a space before the unit.
    let close = ["backbone", "slider.toml", "--from", "0.1N", "--levels", "3"];
    assert_eq!(bench.done(&close).stdout(), text);
    // The default range of forces is 0.001 to 2 times the scene's force.
    assert!(lines[3].trim_start().starts_with("1.00000e-1 "), "{text}");
    assert!(lines[5].trim_start().starts_with("2.00000e2 "), "{text}");
}

/// With `--over structure.damping`, each resonance equals the closed form in both directions of the sweep. With `--over
/// contact.normal_load` from N to kN, the resonance of the sticking joint is the natural frequency of the mass on both springs.
#[test]
fn any_key_may_vary_in_place_of_the_force() {
    let bench = bench();
    let sets = [
        "--set",
        "dynamics.harmonics=[0, 1]",
        "--set",
        "fidelity.aft_samples=256",
    ];
    let over = |key: &str, from: &str, to: &str, more: &[&str]| {
        let own = ["--over", key, "--from", from, "--to", to, "--json"];
        let arguments = [&["backbone", "slider.toml"], &sets[..], &own[..], more].concat();
        bench.done(&arguments).json()["states"][0].clone()
    };
    let ends = ["20 N s/m", "300 N s/m"];
    let up = over("structure.damping", ends[0], ends[1], &["-o", "up.parquet"]);
    let down = over("structure.damping", ends[1], ends[0], &[]);
    for state in [&up, &down] {
        let names = ["value", "force", "frequency", "amplitude"];
        let [damping, force, frequency, amplitude] = names.map(|name| numbers(state, name));
        assert!(damping.len() >= 5, "{damping:?}");
        for k in 0..damping.len() {
            let exact = JenkinsOscillator {
                mass: 1.0,
                damping: damping[k],
                stiffness: 4e6,
                contact: Jenkins {
                    stiffness: 6e6,
                    limit: 300.0,
                },
            };
            let off = [
                force[k] / exact.resonant_force(amplitude[k]),
                frequency[k] * TAU / exact.backbone(amplitude[k]),
            ];
            let is_right = off.iter().all(|ratio| (ratio - 1.0).abs() < 2e-3);
            assert!(is_right, "{off:?} at {} N s/m", damping[k]);
        }
    }
    let [damping, back] = [&up, &down].map(|state| numbers(state, "value"));
    assert_eq!((damping[0], back[0]), (20.0, 300.0));
    assert_eq!((damping.last(), back.last()), (Some(&300.0), Some(&20.0)));
    let [amplitude, again] = [&up, &down].map(|state| numbers(state, "amplitude"));
    assert!((amplitude[0] / again[again.len() - 1] - 1.0).abs() < 1e-8);
    let table = written(&bench, "up.parquet");
    assert_eq!(table.value.as_deref(), Some(&damping[..]));
    assert!(
        table
            .key
            .expect("a key")
            .iter()
            .all(|key| key == "structure.damping")
    );
    // `--over` accepts keys of nested sections, with a different unit at each end of the range.
    let force = over(
        "dynamics.force.amplitude",
        "10 N",
        "0.1 kN",
        &["--levels", "2"],
    );
    let names = ["value", "force"].map(|name| numbers(&force, name));
    assert_eq!(names, [[10.0, 100.0]; 2]);
    let load = over(
        "contact.normal_load",
        "2000 N",
        "200 kN",
        &["--levels", "3"],
    );
    let [value, frequency] = ["value", "frequency"].map(|name| numbers(&load, name));
    assert!(
        (value[1] / (2000.0 * 200_000f64).sqrt() - 1.0).abs() < 1e-6,
        "{value:?}"
    );
    // The natural frequency is √(10 N/µm / 1 kg); the dashpot does not shift the phase resonance.
    assert!(
        (frequency[2] * TAU / 1e7f64.sqrt() - 1.0).abs() < 1e-6,
        "{frequency:?}"
    );
    let drawn = [
        "--over",
        "structure.damping",
        "--from",
        ends[0],
        "--to",
        ends[1],
        "--svg",
        "up.svg",
    ];
    let text = bench
        .done(&[&["backbone", "slider.toml"], &drawn[..]].concat())
        .stdout();
    assert!(
        text.starts_with("slider.toml, unworn\nover structure.damping in N s/m\n"),
        "{text}"
    );
    let picture = fs::read_to_string(bench.path("up.svg")).expect("the picture up.svg");
    assert!(picture.contains("structure.damping, SI"));
}

/// The error message names the key that `--over` cannot vary.
#[test]
fn a_key_that_cannot_vary_is_refused() {
    let bench = bench();
    for (arguments, expected) in [
        (
            [
                "slider.toml",
                "--over",
                "structure.damping",
                "20 N s/m",
                "20 N s/m",
            ],
            "two different values",
        ),
        (
            [
                "slider.toml",
                "--over",
                "structure.damping",
                "20 N s/m",
                "20 kN",
            ],
            "structure.damping",
        ),
        (
            ["slider.toml", "--over", "structure.damp", "1", "2"],
            "there is no such key",
        ),
        (["slider.toml", "--over", "title", "1", "2"], "title"),
        (
            ["slider.toml", "--over", "structure.damp", "1", "2"],
            "--over structure.damp, at 1",
        ),
        (
            ["slider.toml", "--over", "fidelity.aft_samples", "64", "256"],
            "must be an integer",
        ),
        (
            ["runs/slider@0", "--over", "structure.damping", "1", "2"],
            "is a run, whose keys are fixed",
        ),
    ] {
        let [state, over, key, from, to] = arguments;
        let did = bench.fretwear(&["backbone", state, over, key, "--from", from, "--to", to]);
        assert_eq!(did.code(), 2, "{}", did.stderr());
        assert!(did.stderr().contains(expected), "{}", did.stderr());
    }
}

/// An unreadable second scene does not discard the result of the first scene.
#[test]
fn a_second_scene_that_is_not_there_leaves_the_first() {
    let bench = bench();
    let both = ["backbone", "slider.toml", "missing.toml", "-o", "b.parquet"];
    let did = bench.fretwear(&both);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    assert!(did.stderr().contains("missing.toml"), "{}", did.stderr());
    assert!(did.stdout().contains("slider.toml"), "{}", did.stdout());
    assert!(!written(&bench, "b.parquet").force.is_empty());
}

/// The command checks that the output folder exists before the computation.
#[test]
fn a_table_in_no_folder_is_refused_at_once() {
    let bench = bench();
    let did = bench.fretwear(&["backbone", "slider.toml", "-o", "nowhere/b.parquet"]);
    assert_eq!(did.code(), 1, "{}", did.stderr());
    assert!(did.stderr().contains("no such folder"), "{}", did.stderr());
    assert_eq!(did.stdout(), "");
}

#[test]
fn a_folder_without_an_iteration_is_told_to_name_one() {
    let did = bench().fretwear(&["backbone", "."]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    assert!(did.stderr().contains(".@0"), "{}", did.stderr());
}

#[test]
fn friction_that_bounds_nothing_ends_the_curve_and_is_named() {
    let bench = bench();
    let undamped = ["--set", "structure.damping=0 N s/m", "--to", "1 kN"];
    let did = bench.done(&[&["backbone", "slider.toml"], &undamped[..]].concat());
    let text = did.stdout();
    let last = text.lines().last().expect("a line");
    // The upper limit of the force is 4 / π of the friction limit of 300 N.
    assert!(last.starts_with("it ends below 38"), "{text}");
    assert!(last.contains("friction is at its limit"), "{text}");
}

/// At the scene's force, the point of the backbone equals the resonance that the run has stored.
#[test]
fn an_iteration_has_the_backbone_of_the_worn_joint() {
    let bench = bench();
    bench.done(&["run", "resonator.toml"]);
    let root = bench.path("runs/resonator");
    let before = content(&root);
    let last = latest(&root);
    let worn = format!("runs/resonator@{last}");
    let states = ["resonator.toml", "runs/resonator@0", &worn];
    let levels = ["--from", "30 N", "--to", "300 N", "--levels", "2", "--json"];
    let json = bench
        .done(
            &[
                &["backbone"],
                &states[..],
                &levels[..],
                &["-o", "b.parquet"],
            ]
            .concat(),
        )
        .json();
    let at_scene = |state: usize, name: &str| numbers(&json["states"][state], name)[1];
    let resonance = |k: u64, name: &str| {
        let row = table(&root, k, TableName::WornResponse);
        row.f64(name).expect("a number")[0]
    };
    for (place, k) in [(0, 0), (1, 0), (2, last)] {
        let frequency = at_scene(place, "frequency") / resonance(k, "resonance_frequency") - 1.0;
        assert!(frequency.abs() < 1e-7, "{place}: {frequency}");
        let amplitude = at_scene(place, "amplitude") / resonance(k, "resonance_amplitude") - 1.0;
        assert!(amplitude.abs() < 1e-6, "{place}: {amplitude}");
        let friction = at_scene(place, "friction_energy") / resonance(k, "friction_energy") - 1.0;
        assert!(friction.abs() < 1e-5, "{place}: {friction}");
        // The backbone also agrees with the peak of the forced response, which the run computes without a phase condition.
        let top = at_scene(place, "amplitude") / resonance(k, "peak_amplitude") - 1.0;
        assert!(top.abs() < 1e-3, "{place}: {top}");
        let top = at_scene(place, "frequency") / resonance(k, "peak_frequency") - 1.0;
        assert!(top.abs() < 1e-3, "{place}: {top}");
    }
    let [unworn, worn] = [1, 2].map(|state| at_scene(state, "frequency"));
    assert!(
        (unworn / worn - 1.0).abs() > 1e-5,
        "wear did not change the resonance frequency: {unworn} Hz"
    );
    let written = written(&bench, "b.parquet");
    assert_eq!(written.iteration, [0, 0, 0, 0, last as i64, last as i64]);
    assert_eq!(written.cycles[0], 0);
    assert_eq!(written.cycles[5], 500_000);
    assert!(
        before == content(&root),
        "`backbone` changed the files of the run"
    );
    verified(&root);
}

#[cfg(feature = "polars")]
#[test]
fn several_states_are_in_one_picture() {
    let bench = bench();
    bench.write(
        "other.toml",
        [OSCILLATOR, &SLIDER.replace("1000 N", "500 N")].concat(),
    );
    let both = ["backbone", "slider.toml", "other.toml", "--levels", "9"];
    bench.done(&[&both[..], &["--svg", "both.svg"]].concat());
    let svg = fs::read_to_string(bench.path("both.svg")).expect("a picture");
    for text in [
        "slider.toml",
        "other.toml",
        "Damping ratio",
        "amplitude / µm",
        "frequency / Hz",
        "force / N",
    ] {
        assert!(svg.contains(text), "no {text}");
    }
}

#[test]
fn what_has_no_backbone_is_refused_with_a_reason() {
    let bench = bench();
    for (arguments, reason) in [
        (
            vec!["small.toml"],
            "small.toml has no harmonic force in [dynamics]",
        ),
        (
            vec!["slider.toml", "--from", "2 N", "--to", "1 N"],
            "go from 2 N to 1 N",
        ),
        (
            vec!["slider.toml", "--from", "300 N"],
            "go from 300 N to 200 N",
        ),
        (
            vec!["slider.toml", "--from", "0 N"],
            "must be more than 0 N",
        ),
        (
            vec!["slider.toml", "--levels", "1"],
            "1 is not in 2..=10000",
        ),
        (vec!["runs/none@3"], "runs/none"),
        (
            vec!["runs/none@3", "--set", "contact.kn=1"],
            "give a scene too",
        ),
        (vec!["none.toml"], "none.toml"),
    ] {
        let did = bench.fretwear(&[&["backbone"], &arguments[..]].concat());
        assert_eq!(did.code(), 2, "{arguments:?}: {}", did.stderr());
        assert!(
            did.stderr().contains(reason),
            "{arguments:?}: {}",
            did.stderr()
        );
    }
}
