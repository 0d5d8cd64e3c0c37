//! Tests of the variants of a scene that a trade runs.

use std::path::Path;

use fretwear::recipe::MotionKind;
use fretwear::scene::Plan;
use fretwear::scene::variants::{self, Choice, Variants};
use fretwear::scene::{self, Preset, Scheme};

use crate::support::Bench;

fn variants_of(path: &Path, sets: &[&str], knobs: &[&str]) -> Variants {
    let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
    let written = scene::load(path, &sets).expect("a scene");
    let balanced = variants::load(path, &sets, &variants::balanced()).expect("a scene");
    let recipe = Plan::of(&balanced).expect("a plan").inputs.recipe;
    let choice = Choice {
        knobs: knobs.iter().map(|knob| (*knob).to_owned()).collect(),
        ..Choice::default()
    };
    variants::variants(&written, &balanced, &recipe, &choice).expect("known knobs")
}

fn names(variants: &Variants) -> Vec<&str> {
    variants.variants.iter().map(|v| v.name.as_str()).collect()
}

fn pipeline(name: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(name)
}

/// The presets ignore the accuracy keys of the scene. The variant `as_written` uses these keys.
#[test]
fn presets_are_without_the_accuracy_of_the_scene() {
    let bench = Bench::new();
    let path = bench.path("small.toml"); // The file contains wear.tolerance = 1e-3.
    let sets = [
        "wear.scheme=explicit",
        "wear.depth_step=0.05 um",
        "fidelity.normal_tolerance=1e-3",
        "fidelity.steps_per_cycle=48",
    ];
    let made = variants_of(&path, &sets, &["preset", "scheme"]);
    let expected = [
        "balanced",
        "reference",
        "fast",
        "as_written",
        "scheme-semi_implicit-5e-2-um",
        "scheme-semi_implicit-5e-1-um",
        "scheme-explicit-5e-2-um",
        "scheme-explicit-5e-1-um",
    ];
    assert_eq!(names(&made), expected);
    let sets = sets.map(str::to_owned);
    for (variant, (preset, tolerance, scheme, depth)) in made.variants.iter().zip([
        (Preset::Balanced, 1e-6, Scheme::Implicit, None),
        (Preset::Reference, 1e-8, Scheme::Implicit, None),
        (Preset::Fast, 1e-5, Scheme::Implicit, None),
        (Preset::Balanced, 1e-3, Scheme::Explicit, Some(0.05e-6)),
        (Preset::Balanced, 1e-6, Scheme::SemiImplicit, Some(0.05e-6)),
        (Preset::Balanced, 1e-6, Scheme::SemiImplicit, Some(0.5e-6)),
        (Preset::Balanced, 1e-6, Scheme::Explicit, Some(0.05e-6)),
        (Preset::Balanced, 1e-6, Scheme::Explicit, Some(0.5e-6)),
    ]) {
        let scene = variants::load(&path, &sets, variant).expect("a scene");
        let wear = scene.recipe.wear.expect("wear");
        assert_eq!(scene.fidelity.preset, preset, "{}", variant.name);
        assert_eq!(
            scene.fidelity.tolerances.normal, tolerance,
            "{}",
            variant.name
        );
        assert_eq!(wear.scheme, scheme, "{}", variant.name);
        let close = |(a, b): (f64, f64)| (a / b - 1.0).abs() < 1e-12;
        assert!(
            wear.depth_step.zip(depth).is_none_or(close),
            "{}",
            variant.name
        );
        assert_eq!(
            wear.depth_step.is_some(),
            depth.is_some(),
            "{}",
            variant.name
        );
        // All variants keep the time steps of the scene, as they keep its grid.
        assert_eq!(scene.fidelity.steps_per_cycle, 48, "{}", variant.name);
    }
}

#[test]
fn knobs_are_those_of_the_scene() {
    let fretting = variants_of(&pipeline("prescribed_fretting.toml"), &[], &[]);
    let left: Vec<&str> = fretting
        .skipped
        .iter()
        .map(|left| left.what.as_str())
        .collect();
    let absent = [
        "preset = paper",
        "cycle_tolerance",
        "steps_per_cycle",
        "load_steps",
        "aft_samples",
        "harmonic_tolerance",
        "harmonics",
        "modes",
        "elements",
        "stiffness",
    ];
    assert_eq!(left, absent);
    let of = |variants: &Variants, knob: &str| -> Vec<String> {
        let own = variants.variants.iter().filter(|v| v.knob == knob);
        own.map(|v| v.value.clone()).collect()
    };
    assert_eq!(
        of(&fretting, "grid"),
        ["[64, 64]", "[128, 128]", "[512, 512]"]
    );
    assert_eq!(of(&fretting, "cycle"), ["superposition", "stepped"]);
    assert_eq!(
        of(&fretting, "wear_tolerance"),
        ["1e-1", "3e-2", "3e-3", "1e-3"]
    );
    assert_eq!(of(&fretting, "tolerance"), ["5e-2", "1e-2", "2e-3"]);
    let orbit = [
        "motion.amplitude=[\"5 um\", \"5 um\"]",
        "motion.phase=[\"0 deg\", \"90 deg\"]",
    ];
    let orbit = variants_of(
        &pipeline("prescribed_fretting.toml"),
        &orbit,
        &["steps_per_cycle"],
    );
    assert_eq!(of(&orbit, "steps_per_cycle"), ["16", "32", "128"]);

    let joint = variants_of(&pipeline("lap_joint.toml"), &[], &[]);
    assert_eq!(
        of(&joint, "elements"),
        ["[15, 15]", "[17, 17]", "[21, 21]", "[23, 23]"]
    );
    assert_eq!(of(&joint, "modes"), ["10", "20", "45"]);
    assert_eq!(of(&joint, "stiffness"), ["total", "roughness", "tangent"]);
    assert_eq!(
        of(&joint, "harmonics"),
        [
            "[0, 1]",
            "[0, 1, 2]",
            "[0, 1, 2, 3, 4, 5]",
            "[0, 1, 2, 3, 4, 5, 6, 7]"
        ]
    );
    let resonator = Bench::new();
    let text = crate::support::RESONATOR.replace("harmonics = [0, 1]\n", "");
    assert!(!text.contains("harmonics"));
    resonator.write("grown.toml", text);
    let grown = variants_of(&resonator.path("grown.toml"), &[], &[]);
    assert_eq!(of(&grown, "harmonics"), [""; 0]);
    assert_eq!(
        of(&grown, "harmonic_tolerance"),
        ["1.5e-1", "4.5e-2", "4.5e-3"]
    );
    let oscillator = variants_of(&pipeline("oscillator.toml"), &[], &["harmonics", "preset"]);
    assert_eq!(of(&oscillator, "harmonics")[1], "[0, 1, 3]");
    // The scene contains its own aft_samples.
    assert_eq!(of(&oscillator, "scene"), ["as written"]);

    // Each variant is a valid scene, except for the hole. Each name is a valid name of a folder.
    for (name, made) in [
        ("prescribed_fretting.toml", &fretting),
        ("lap_joint.toml", &joint),
    ] {
        for variant in &made.variants {
            let scene = variants::load(&pipeline(name), &[], variant);
            // Only elements of nearly the scene's size represent the hole of 11 mm with 21 missing elements.
            let other_hole = ["[15, 15]", "[23, 23]"].contains(&variant.value.as_str());
            assert_eq!(scene.is_err(), other_hole, "{}: {scene:?}", variant.name);
            let fit = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
            assert!(variant.name.chars().all(fit), "{}", variant.name);
        }
    }
}

#[test]
fn harmonics_of_forces_stay() {
    let bench = Bench::new();
    let made = variants_of(&bench.path("resonator.toml"), &[], &["harmonics"]);
    assert_eq!(made.base, [("harmonics", "[0, 1]".to_owned(), 1.0)]);
    assert_eq!(
        names(&made)[2..],
        ["harmonics-0-1-2-3", "harmonics-0-1-2-3-4-5"]
    );
}

/// The number of steps changes the cycle only if it exceeds the number of rows of the history.
#[test]
fn steps_of_a_history_are_varied_where_they_matter() {
    let bench = Bench::new();
    let path = bench.path("small.toml");
    let made = |rows: u32| {
        let mut csv = String::from("time,displacement_x,displacement_y\n");
        for row in 0..rows {
            let t = f64::from(row) / f64::from(rows);
            let (y, x) = (std::f64::consts::TAU * t).sin_cos();
            csv += &format!("{t},{},{}\n", 1e-6 * x, 5e-7 * y);
        }
        bench.write("orbit.csv", csv);
        let history = format!("motion.history=\"{}\"", bench.path("orbit.csv").display());
        variants_of(&path, &[&history], &["steps_per_cycle"])
    };
    let few = made(12);
    assert!(few.skipped.is_empty(), "{:?}", few.skipped);
    assert!(
        names(&few)
            .iter()
            .any(|name| name.starts_with("steps_per_cycle"))
    );
    let many = made(200);
    let reason = &many.skipped[0].reason;
    assert!(reason.contains("more rows"), "{reason}");
}

/// The kind of a motion follows from the moving quantities. The notation of the motion does not matter.
#[test]
fn motions_are_of_a_kind() {
    let bench = Bench::new();
    let path = bench.path("small.toml");
    for (kind, sets) in [
        ("line", &[][..]),
        ("line", &["motion.amplitude=[\"1 um\", \"2 um\"]"]),
        (
            "line",
            &[
                "motion.amplitude=[\"1 um\", \"0 um\"]",
                "motion.phase=[\"0 deg\", \"90 deg\"]",
            ],
        ),
        (
            "orbit",
            &[
                "motion.amplitude=[\"1 um\", \"2 um\"]",
                "motion.phase=[\"0 deg\", \"90 deg\"]",
            ],
        ),
        ("varying load", &["motion.normal_load_amplitude=20 N"]),
        ("torsion", &["motion.rotation=1e-4 rad"]),
    ] {
        let sets: Vec<String> = sets.iter().map(|set| (*set).to_owned()).collect();
        let scene = scene::load(&path, &sets).expect("a scene");
        let recipe = Plan::of(&scene).expect("a plan").inputs.recipe;
        assert_eq!(MotionKind::of(&recipe).word(), kind, "{sets:?}");
    }
    for (kind, name) in [
        ("vibration", "lap_joint.toml"),
        ("vibration", "resonator_springs.toml"),
        ("line", "prescribed_fretting.toml"),
    ] {
        let scene = scene::load(&pipeline(name), &[]).expect("a scene");
        let recipe = Plan::of(&scene).expect("a plan").inputs.recipe;
        assert_eq!(MotionKind::of(&recipe).word(), kind, "{name}");
    }
}
