//! Vibrations without a rough contact: oscillators with and without friction, and the resonator with given contact stiffness.

use std::f64::consts::{PI, TAU};
use std::path::{Path, PathBuf};

use fretwear::reference::Jenkins;
use fretwear::stages::{Ending, Stage};
use fretwear::tables::{Table, TableName};

use super::Start;
use crate::support::{Bench, OSCILLATOR, RESONATOR, SLIDER, reader, summary, table, verified};

/// Parameters of [`OSCILLATOR`] and [`SLIDER`] in SI units.
const MASS: f64 = 1.0;
const DAMPING: f64 = 20.0;
const STIFFNESS: f64 = 4e6;
const TANGENTIAL: f64 = 6e6;
const NORMAL: f64 = 8e6;
const LIMIT: f64 = 0.3 * 1000.0;
const FORCE: f64 = 100.0;

fn run(bench: &Bench, text: &str, sets: &[&str]) -> PathBuf {
    bench.write("alone.toml", text);
    let root = bench.path("run");
    if root.exists() {
        std::fs::remove_dir_all(&root).expect("removed");
    }
    let (outcome, _) = Start::new(bench.scene("alone.toml", sets), &root).done();
    assert_eq!(outcome.ending, Ending::Done);
    assert_eq!(outcome.wear_iteration, Some(0));
    verified(&root);
    root
}

fn slider() -> String {
    format!("{OSCILLATOR}{SLIDER}")
}

fn frf(root: &Path) -> Table {
    table(root, 0, TableName::Frf)
}

/// Column of a forced response with a value in each row.
pub fn found(frf: &Table, column: &str) -> Vec<f64> {
    let values = frf.maybe_f64(column).expect("a column").iter();
    values.map(|value| value.expect("a response")).collect()
}

/// Frequency, amplitude and phase lag of each row.
fn rows(frf: &Table) -> impl Iterator<Item = [f64; 3]> {
    let frequency = frf.f64("frequency").expect("a column");
    let (amplitude, lag) = (found(frf, "amplitude"), found(frf, "phase_lag"));
    (0..frf.rows()).map(move |row| [frequency[row], amplitude[row], lag[row]])
}

/// Asserts that each row is F / (k - m w^2 + i c w).
fn assert_linear(root: &Path, stiffness: f64, force: f64) {
    /// Residual of the linear equations, and rounding of the sum of springs.
    const EXACT: f64 = 1e-10;
    for [frequency, amplitude, lag] in rows(&frf(root)) {
        let omega = TAU * frequency;
        let (real, imaginary) = (stiffness - MASS * omega * omega, DAMPING * omega);
        let expected = force / real.hypot(imaginary);
        assert!(
            (amplitude / expected - 1.0).abs() < EXACT,
            "{amplitude:e} m instead of {expected:e} m at {frequency} Hz"
        );
        let expected = imaginary.atan2(real);
        assert!(
            (lag - expected).abs() < EXACT,
            "{lag} instead of {expected} at {frequency} Hz"
        );
    }
}

/// Names of the tables of iteration 0.
fn tables(root: &Path) -> Vec<String> {
    let reader = reader(root);
    let commit = reader.commit_of(0).expect("committed");
    let mut names: Vec<String> = commit.tables.keys().cloned().collect();
    names.sort();
    names
}

/// [`OSCILLATOR`] with the line `drive` in place of `[dynamics] force`.
fn driven_by(drive: &str) -> String {
    let lines = OSCILLATOR
        .lines()
        .map(|line| match line.starts_with("force") {
            true => drive,
            false => line,
        });
    lines.collect::<Vec<_>>().join("\n")
}

/// Relative to a ground with the acceleration a cos ωt, the force on the mass is -m a. For a displacement u cos ωt, the force is m w^2 u.
#[test]
fn a_ground_that_moves_is_a_force_on_the_mass() {
    const EXACT: f64 = 1e-10;
    let bench = Bench::new();
    let text = driven_by(r#"base = { acceleration = "100 m/s^2" }"#);
    assert_linear(&run(&bench, &text, &[]), STIFFNESS, MASS * FORCE);

    let ground = 2e-6;
    let text = driven_by(r#"base = { displacement = "2 um" }"#);
    let root = run(&bench, &text, &[]);
    for [frequency, amplitude, _] in rows(&frf(&root)) {
        let omega = TAU * frequency;
        let inertia = MASS * omega * omega;
        let expected = inertia * ground / (STIFFNESS - inertia).hypot(DAMPING * omega);
        assert!(
            (amplitude / expected - 1.0).abs() < EXACT,
            "{amplitude:e} m instead of {expected:e} m at {frequency} Hz"
        );
    }
    let natural = (STIFFNESS / MASS).sqrt() / TAU;
    assert!((summary(&root, 0, "resonance_frequency") / natural - 1.0).abs() < 1e-9);
}

/// The damping alpha m + beta k adds to the dashpot.
#[test]
fn rayleigh_damping_is_a_dashpot_of_an_oscillator() {
    let bench = Bench::new();
    let plain = run(&bench, OSCILLATOR, &["structure.damping=35 N s/m"]);
    let expected: Vec<[f64; 3]> = rows(&frf(&plain)).collect();
    let set = r#"dynamics.rayleigh={ mass = "7 1/s", stiffness = "2 us" }"#;
    let root = run(&bench, OSCILLATOR, &[set]);
    let found: Vec<[f64; 3]> = rows(&frf(&root)).collect();
    assert_eq!(found.len(), expected.len());
    for (found, expected) in found.iter().zip(&expected) {
        for (found, expected) in found.iter().zip(expected) {
            assert!((found / expected - 1.0).abs() < 1e-9, "{found} {expected}");
        }
    }
}

#[test]
fn a_linear_oscillator() {
    let bench = Bench::new();
    let root = run(&bench, OSCILLATOR, &[]);
    assert_eq!(frf(&root).rows(), 23);
    assert_linear(&root, STIFFNESS, FORCE);
    let expected = [
        "dynamic_response",
        "frf",
        "frf_harmonic",
        "resonance",
        "response",
        "summary",
    ];
    assert_eq!(tables(&root), expected);
    // The phase lag is 90° at the natural frequency. The amplitude has its maximum at w^2 = k/m - c^2/2m^2.
    let natural = (STIFFNESS / MASS).sqrt() / TAU;
    assert!((summary(&root, 0, "resonance_frequency") / natural - 1.0).abs() < 1e-9);
    let peak = (STIFFNESS / MASS - 0.5 * (DAMPING / MASS).powi(2)).sqrt() / TAU;
    assert!((summary(&root, 0, "peak_frequency") / peak - 1.0).abs() < 1e-7);
    assert_eq!(summary(&root, 0, "dissipated_energy"), 0.0);
    // A second start finds a finished run.
    let (outcome, seen) = Start::new(bench.scene("alone.toml", &[]), &root).done();
    assert_eq!((outcome.ending, seen.stages.take()), (Ending::Done, vec![]));
}

/// A softening spring has two branches. The branch from the upper end of the range reaches the lower end, at amplitudes beyond the maximum
/// of the spring force. The other branch begins with small amplitudes and turns back within the range.
#[test]
fn a_softening_oscillator_has_both_branches() {
    /// Largest relative effect of the third harmonic.
    const BEYOND_ONE_HARMONIC: f64 = 0.05;
    let (stiffness, cubic, from) = (1e7, -1e16, 160.0);
    let bench = Bench::new();
    let text = OSCILLATOR.replace("points = 23", "");
    let sets = [
        "structure.stiffness=\"10 N/um\"",
        "structure.cubic_stiffness=[\"-1e16 N/m^3\", \"0 N/m^3\", \"0 N/m^3\"]",
        "dynamics.harmonics=[0, 1, 3]",
    ];
    let root = run(&bench, &text, &sets);
    let omega = TAU * from;
    // Amplitude with one harmonic: F² = (k − m ω² + ¾ k₃ a²)² a² + (c ω a)².
    let force = |a: f64| {
        let elastic = stiffness - MASS * omega * omega + 0.75 * cubic * a * a;
        a * elastic.hypot(DAMPING * omega)
    };
    let (mut low, mut high) = (0.0, 1.5e-5);
    assert!(force(high) > FORCE, "the force must be below the maximum");
    while high - low > 1e-18 {
        let middle = 0.5 * (low + high);
        match force(middle) < FORCE {
            true => low = middle,
            false => high = middle,
        }
    }
    let frf = frf(&root);
    let at_rest = rows(&frf).find(|[frequency, amplitude, _]| {
        (frequency / from - 1.0).abs() < 1e-9 && (amplitude / low - 1.0).abs() < BEYOND_ONE_HARMONIC
    });
    assert!(at_rest.is_some(), "no row of {low:e} m at {from} Hz");
    assert!(
        rows(&frf).any(|[_, amplitude, _]| amplitude > 2.0 * low),
        "the other branch is missing"
    );
}

/// Friction dissipates at most 4 µN a per cycle, and the force supplies up to π F a. Without other damping, the resonance has no bound
/// above F = 4 µN/π.
#[test]
fn a_peak_without_a_top_is_not_known() {
    let bench = Bench::new();
    let most = 4.0 / PI * LIMIT;
    let bar = |part: f64| {
        let force = format!("dynamics.force.amplitude=\"{} N\"", part * most);
        let sets = ["structure.damping=\"0 N s/m\"", &force];
        let root = run(&bench, &slider(), &sets);
        summary(&root, 0, "error_peak_amplitude")
    };
    assert!(bar(0.9) < 0.5, "friction must bound the peak");
    assert!(bar(1.1) >= 1.0, "the peak must be unbounded");
}

#[test]
fn an_oscillator_that_sticks() {
    let bench = Bench::new();
    // At resonance, the force in the contact spring is 6e6 N/m · 1 N / (20 N s/m · 3162 rad/s) = 95 N. The friction limit is 300 N.
    let root = run(&bench, &slider(), &["dynamics.force.amplitude=\"1 N\""]);
    assert_linear(&root, STIFFNESS + TANGENTIAL, 1.0);
    let expected = [
        "contact_element",
        "dynamic_response",
        "frf",
        "frf_harmonic",
        "joint_cycle",
        "resonance",
        "response",
        "summary",
    ];
    assert_eq!(tables(&root), expected);
    let element = table(&root, 0, TableName::ContactElement);
    assert_eq!(element.text("state").expect("a state"), ["stick"]);
    assert_eq!(element.f64("normal_load").expect("a load"), [1000.0]);
    assert_eq!(summary(&root, 0, "kt"), TANGENTIAL);
    assert_eq!(summary(&root, 0, "kn"), NORMAL);
}

/// With one harmonic, each row satisfies the balance with the first harmonic of the Jenkins loop.
#[test]
fn an_oscillator_that_slips_by_one_harmonic() {
    /// Error of sampling a loop with corners, of second order in the step.
    const SAMPLED: f64 = 1e-4;
    let bench = Bench::new();
    let sets = ["dynamics.harmonics=[0, 1]", "fidelity.aft_samples=1024"];
    let root = run(&bench, &slider(), &sets);
    let jenkins = Jenkins {
        stiffness: TANGENTIAL,
        limit: LIMIT,
    };
    let frf = frf(&root);
    let friction = found(&frf, "friction_energy");
    let mut slipping = 0;
    for (row, [frequency, amplitude, lag]) in rows(&frf).enumerate() {
        let omega = TAU * frequency;
        let (cosine, sine) = jenkins.coefficients(amplitude, 1);
        let real = (STIFFNESS - MASS * omega * omega) * amplitude + cosine;
        let imaginary = DAMPING * omega * amplitude - sine;
        let off = (real - FORCE * lag.cos()).hypot(imaginary - FORCE * lag.sin());
        assert!(
            off < SAMPLED * FORCE,
            "{off} N of {FORCE} N at {frequency} Hz"
        );
        let expected = jenkins.dissipated_energy(amplitude);
        let scale = LIMIT * amplitude;
        assert!(
            (friction[row] - expected).abs() < 4.0 * SAMPLED * scale,
            "{frequency} Hz"
        );
        slipping += usize::from(jenkins.slips(amplitude));
    }
    assert!(slipping >= 3, "the joint slips at {slipping} frequencies");
    let amplitude = table(&root, 0, TableName::DynamicResponse);
    let amplitude = amplitude.f64("resonance_amplitude").expect("one")[0];
    let energy = summary(&root, 0, "dissipated_energy");
    let expected = jenkins.dissipated_energy(amplitude);
    assert!(
        (energy / expected - 1.0).abs() < 1e-3,
        "{energy:e} instead of {expected:e}"
    );
    let element = table(&root, 0, TableName::ContactElement);
    assert_eq!(element.text("state").expect("a state"), ["slip"]);
}

/// Amplitude of the first harmonic of the steady motion, by integration in time.
fn integrated(omega: f64) -> f64 {
    const STEPS: usize = 1500;
    // 20 time constants 2m/c of the free motion
    let periods = (20.0 * 2.0 * MASS / DAMPING * omega / TAU).ceil() as usize;
    let step = TAU / omega / STEPS as f64;
    let (mut x, mut v, mut friction) = (0.0f64, 0.0f64, 0.0f64);
    let (mut cosine, mut sine) = (0.0, 0.0);
    let mut a = FORCE / MASS;
    for k in 0..periods * STEPS {
        let phase = TAU * ((k + 1) % STEPS) as f64 / STEPS as f64;
        // Velocity Verlet method. The damping force uses the velocity at the middle of the step, implicitly.
        let half = v + 0.5 * step * a;
        let moved = step * half;
        x += moved;
        friction = (friction + TANGENTIAL * moved).clamp(-LIMIT, LIMIT);
        let pull = FORCE * phase.cos() - STIFFNESS * x - friction;
        v = (half + 0.5 * step * pull / MASS) / (1.0 + 0.5 * step * DAMPING / MASS);
        a = (pull - DAMPING * v) / MASS;
        if k >= (periods - 1) * STEPS {
            cosine += 2.0 / STEPS as f64 * x * phase.cos();
            sine += 2.0 / STEPS as f64 * x * phase.sin();
        }
    }
    cosine.hypot(sine)
}

#[test]
fn an_oscillator_that_slips_in_time() {
    /// Error of the omitted harmonics and of the time steps.
    const HARMONICS: f64 = 2e-3;
    let bench = Bench::new();
    let sets = [
        "dynamics.harmonics=[0, 1, 3, 5, 7, 9]",
        "dynamics.frequency=[\"330 Hz\", \"520 Hz\"]",
        "dynamics.points=6",
    ];
    let root = run(&bench, &slider(), &sets);
    for [frequency, amplitude, _] in rows(&frf(&root)) {
        let expected = integrated(TAU * frequency);
        assert!(
            (amplitude / expected - 1.0).abs() < HARMONICS,
            "{amplitude:e} m instead of {expected:e} m at {frequency} Hz"
        );
    }
}

#[test]
fn a_gap_that_never_closes() {
    let bench = Bench::new();
    let contact = SLIDER.replace("normal_load = \"1000 N\"", "gap = \"10 um\"");
    for direction in ["x", "z"] {
        let text = OSCILLATOR.replace("\"x\"", &format!("\"{direction}\""));
        // The amplitude at resonance is 2.5 um, and the gap is 10 um.
        let sets = ["dynamics.force.amplitude=\"0.1 N\""];
        let root = run(&bench, &format!("{text}{contact}"), &sets);
        assert_linear(&root, STIFFNESS, 0.1);
        let element = table(&root, 0, TableName::ContactElement);
        assert_eq!(element.text("state").expect("a state"), ["open"]);
        assert_eq!(summary(&root, 0, "dissipated_energy"), 0.0);
    }
}

/// Tables that only an oscillator with contact has.
const OF_CONTACT: [&str; 2] = ["contact_element", "joint_cycle"];

/// A mean force without any stiffness against it is a fault of the scene. The message gives the force and the remedy.
#[test]
fn a_mean_force_that_nothing_holds_is_a_fault_of_the_scene() {
    let free = r#"
[structure]
kind = "oscillator"
mass = "1 kg"
damping = "2 N s/m"
stiffness = ["0 N/m", "5e4 N/m", "1e4 N/m"]
[dynamics]
force = [{ amplitude = "1 N", direction = "x" }, { amplitude = "0.5 N", direction = "x", harmonic = 0 }]
response = { direction = "x" }
frequency = ["1 Hz", "3 Hz"]
"#;
    let bench = Bench::new();
    bench.write("free.toml", free);
    let did = bench.fretwear(&["run", "free.toml", "--run", "a"]);
    assert_eq!(did.code(), 2, "{}", did.stderr());
    let told = "the mean force of 5.000000e-1 N moves the structure as a rigid body";
    assert!(did.stderr().contains(told), "{}", did.stderr());
    assert!(!did.stderr().contains("dashpots"), "{}", did.stderr());
}

#[test]
fn no_resonance_in_the_range_is_no_failure() {
    let bench = Bench::new();
    bench.write("alone.toml", OSCILLATOR);
    let range = "dynamics.frequency=[\"400 Hz\", \"750 Hz\"]";
    let did = bench.done(&["run", "alone.toml", "--run", "a", "--set", range]);
    let said = "note: dynamics.frequency: no phase resonance between 400";
    assert!(did.stderr().contains(said), "{}", did.stderr());
    let root = bench.path("a");
    let all = [
        "contact_element",
        "dynamic_response",
        "frf",
        "frf_harmonic",
        "joint_cycle",
        "resonance",
        "response",
        "summary",
    ];
    let without_contact = all.iter().filter(|name| !OF_CONTACT.contains(name));
    assert!(tables(&root).iter().eq(without_contact));
    assert_linear(&root, STIFFNESS, FORCE);
    assert!(!table(&root, 0, TableName::Summary).has("resonance_frequency"));
    // The peak is the row with the largest amplitude, at the end of the range near the resonance.
    let response = frf(&root);
    let rows = rows(&response);
    let largest = rows.fold(0.0_f64, |most, row| most.max(row[1]));
    assert!((summary(&root, 0, "peak_amplitude") / largest - 1.0).abs() < 1e-9);
    // A scene with contact has the table of the contact element in any case.
    bench.write("alone.toml", slider());
    let range = "dynamics.frequency=[\"700 Hz\", \"750 Hz\"]";
    bench.done(&["run", "alone.toml", "--run", "b", "--set", range]);
    assert_eq!(tables(&bench.path("b")), all);
}

/// Small resonator without its rough surface.
fn without_surface(contact: &str) -> String {
    let (head, tail) = RESONATOR.split_once("[surface]").expect("a surface");
    let (_, tail) = tail.split_once("[structure]").expect("a structure");
    let (tail, _) = tail.split_once("[wear]").expect("wear");
    let head = head.replace("grid = [45, 36]\n", "");
    format!("{head}{contact}[structure]{tail}")
}

/// Force at which some elements slip.
const FORCED: &str = "dynamics.force.amplitude=\"600 N\"";

const SPRINGS: &str = r#"[contact]
kn = "4000 N/um"
kt = "3300 N/um"
friction_coefficient = 0.6
normal_load = "30 kN"
"#;

#[test]
fn a_resonator_on_given_springs() {
    let bench = Bench::new();
    let text = without_surface(SPRINGS);
    let root = run(&bench, &text, &[FORCED]);
    for (column, total) in [("kn", 4e9), ("kt", 3.3e9)] {
        assert!((summary(&root, 0, column) / total - 1.0).abs() < 1e-12);
        let element = table(&root, 0, TableName::ContactElement);
        assert_eq!(element.rows(), 60);
        let values = element.f64(column).expect("a column");
        assert!(
            values
                .iter()
                .all(|v| (v / (total / 60.0) - 1.0).abs() < 1e-12)
        );
    }
    let response = table(&root, 0, TableName::DynamicResponse);
    let energy = response.f64("friction_energy").expect("energy")[0];
    assert!(energy > 0.0, "nothing slips");
    assert_eq!(summary(&root, 0, "dissipated_energy"), energy);
    assert!(response.f64("error_energy").expect("an error")[0] < 1e-6);
    // A run in single stages gives the same result.
    let parts = bench.path("parts");
    let scene = bench.scene("alone.toml", &[FORCED]);
    for stage in [
        Stage::Structure,
        Stage::DynamicResponse,
        Stage::ForcedResponse,
        Stage::Summary,
    ] {
        let (outcome, _) = Start::new(scene.clone(), &parts).until(stage).done();
        assert_eq!(outcome.ending, Ending::Until(stage));
    }
    let expected = crate::support::content(&root);
    crate::support::assert_same(&crate::support::content(&parts), &expected, "stages");
}

#[test]
fn a_bonded_resonator() {
    let bench = Bench::new();
    let text = without_surface("");
    let root = run(&bench, &text, &[]);
    assert_eq!(
        tables(&root),
        [
            "dynamic_response",
            "frf",
            "frf_harmonic",
            "resonance",
            "response",
            "summary"
        ]
    );
    let (single, first) = (frf(&root), summary(&root, 0, "resonance_frequency"));
    let stiff = run(
        &bench,
        &without_surface(&SPRINGS.replace("00 N/um", "00e2 N/um")),
        &[],
    );
    let springs = summary(&stiff, 0, "resonance_frequency");
    assert!(
        (springs / first - 1.0).abs() < 5e-3,
        "{springs} Hz on stiff springs, {first} Hz bonded"
    );
    // The response is linear in the force.
    let twice = run(&bench, &text, &["dynamics.force.amplitude=\"600 N\""]);
    for (one, two) in rows(&single).zip(rows(&frf(&twice))) {
        assert!((two[1] / one[1] - 2.0).abs() < 1e-10, "{} Hz", one[0]);
    }
}
