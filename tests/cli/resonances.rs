//! Tests of the resonances that `fretwear plan` computes, by the closed form for one mass on a spring and a slider.

use std::f64::consts::TAU;

use crate::support::{Bench, OSCILLATOR, SLIDER};

/// Friction limit \[N\], stiffness \[N/m\] and damping \[N s/m\] of the scene. The mass is 1 kg.
const HELD: f64 = 300.0;
const CONTACT: f64 = 6e6;
const SPRING: f64 = 4e6;
const DAMPING: f64 = 20.0;

const DATA: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/data");

fn bench() -> Bench {
    let bench = Bench::new();
    bench.write("slider.toml", [OSCILLATOR, SLIDER].concat());
    bench
}

fn is_near(found: f64, expected: f64) {
    assert!((found / expected - 1.0).abs() < 1e-4, "{found} {expected}");
}

#[test]
fn a_plan_has_the_resonances_and_what_the_drive_does_there() {
    let bench = bench();
    let json = bench.done(&["plan", "slider.toml", "--json"]).json();
    let found = &json["resonances"];
    let number = |path: &[&str]| {
        let at = path.iter().fold(found, |at, key| &at[*key]);
        at.as_f64().unwrap_or_else(|| panic!("{path:?}: {found}"))
    };
    let omega = (SPRING + CONTACT).sqrt();
    is_near(number(&["stuck", "frequency"]), omega / TAU);
    is_near(number(&["free", "frequency"]), SPRING.sqrt() / TAU);
    is_near(number(&["stuck", "damping_ratio"]), DAMPING / (2.0 * omega));
    // The mass has no frequency with tied joint, because the joint connects the mass to the ground.
    assert!(found["tied"].is_null(), "{found}");
    let amplitude = json["recipe"]["response"]["forces"][0]["amplitude"].as_f64();
    let amplitude = amplitude.expect("a force");
    let displacement = amplitude / (DAMPING * omega);
    is_near(number(&["stuck", "response", "displacement"]), displacement);
    let force = CONTACT * displacement;
    is_near(number(&["stuck", "response", "force"]), force);
    is_near(number(&["limits", "may_slip"]), HELD / force);
    is_near(number(&["limits", "sticks"]), 0.95 * HELD / force);
    assert!(found["limits"]["may_open"].is_null(), "{found}");

    let text = bench.done(&["plan", "slider.toml"]).stdout();
    let per_newton = CONTACT / (DAMPING * omega);
    for line in [
        "resonance of the unworn joint, linear, per newton of the drive",
        "    stuck         mode 1, 503.29 Hz, damping 0.316 %",
        "    band          from 318.31 Hz, because the joint fixes the structure to the ground",
        &format!("the whole joint from {:.2} N", HELD / per_newton),
    ] {
        assert!(text.contains(line), "{line:?} in {text}");
    }
}

#[test]
fn a_range_without_resonance_is_said_with_those_outside() {
    let bench = bench();
    let range = ["--set", "dynamics.frequency=[\"10 Hz\", \"20 Hz\"]"];
    let text = bench.done(&[&["plan", "slider.toml"], &range[..]].concat());
    let why = "dynamics.frequency: no resonance of the stuck joint lies in this range; resonances outside it are at 503.3 Hz";
    assert!(text.stdout().contains(why), "{}", text.stdout());
    let json = bench.done(&[&["plan", "slider.toml", "--json"], &range[..]].concat());
    assert_eq!(json.json()["resonances"]["not_known"], why);
    let without = bench.done(&["plan", "slider.toml", "--json", "--no-rehearsal"]);
    assert!(without.json()["resonances"].is_null());
}

/// Two bars; the upper bar can move freely along the joint. The range of frequencies does not contain the band of the resonances.
#[test]
fn a_mesh_has_all_three() {
    let bench = Bench::new();
    let scene = concat!(env!("CARGO_MANIFEST_DIR"), "/pipelines/lap_of_bars.toml");
    let json = bench
        .done(&["plan", scene, "--json", "--set", "joint.grid=[60, 36]"])
        .json();
    let found = &json["resonances"];
    let frequency = |name: &str| found[name]["frequency"].as_f64().expect("a frequency");
    let [free, stuck, tied] = ["free", "stuck", "tied"].map(frequency);
    assert!(free < 1.0 && free < stuck && stuck < tied, "{found}");
    // The bonded structure has the same mesh without contact; facing nodes are merged even where the surfaces do not touch at rest.
    let text = std::fs::read_to_string(scene).expect("the scene");
    let part = |from: &str, to: &str| {
        let begin = text.find(from).expect("a section");
        let end = text.find(to).expect("a section");
        text[begin..end].to_owned()
    };
    let structure = part("[structure]", "[dynamics]").replace("../data", DATA);
    let bonded = [structure, part("[dynamics]", "[wear]")].concat();
    bench.write("bonded.toml", bonded);
    let json = bench.done(&["plan", "bonded.toml", "--json"]).json();
    let linear = json["resonances"]["linear"]["frequency"].as_f64();
    let bonded = linear.expect("a frequency");
    assert!(
        stuck < bonded && (bonded / tied - 1.0).abs() < 1e-2,
        "{bonded} {found}"
    );
    let did = bench.done(&["run", "bonded.toml", "--json", "--run", "run"]);
    let resonance = did.json()["resonance_frequency"].as_f64().expect("one");
    is_near(resonance, bonded);
}
