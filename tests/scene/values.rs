//! Values of a loaded scene: SI values, defaults and presets.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;

use fretwear::recipe::HeightsFile;
use fretwear::scene::{
    Boundary, Detrend, Fill, Keep, Motion, Preset, Scheme, Surface, Transverse, load,
};
use fretwear::surface::readers::Correction;
use fretwear::wear::cycle::March;

use super::{Sections, absolute, case, case_with, displaced, edited, scene_of};

#[test]
fn a_case_with_its_defaults() {
    let scene = case_with(&[]);
    assert_eq!(scene.recipe.title.as_deref(), Some("Case"));
    assert_eq!(scene.name, "case");
    assert_eq!(scene.the_joint().size, [0.04, 0.03]);
    assert_eq!(scene.the_joint().grid.expect("grid"), [64, 40]);
    assert_eq!(scene.the_joint().elements, None);
    assert_eq!(scene.the_joint().hole, Some(0.011));
    let material = scene.the_material();
    for elastic in [material.elastic.lower, material.elastic.upper] {
        assert_eq!(elastic.youngs_modulus, 198.4e9);
        assert_eq!(elastic.poisson_ratio, 0.3);
    }
    assert_eq!(material.density, [None; 2]);
    assert_eq!(
        scene.the_surface(),
        Surface::Gaussian {
            rq: 5e-6,
            correlation_length: [0.5e-3, 0.4e-3],
            seed: 3
        }
    );
    let contact = scene.the_contact();
    assert_eq!(contact.friction_coefficient, Some(0.6));
    assert_eq!(contact.normal_load(), 3e4);
    assert_eq!(contact.transverse, Transverse::Fixed);
    let conditions = scene.the_conditions();
    assert_eq!(conditions.pressure_cap, None);
    assert_eq!(conditions.boundary, Boundary::Free);
    assert_eq!(scene.motion, displaced([5e-6, 0.0], [0.0; 2], 0.0));
    let wear = scene.recipe.wear.expect("a [wear] section");
    assert_eq!(wear.coefficient, 2e-15);
    assert_eq!((wear.cycles, wear.volume), (Some(10_000_000), None));
    assert_eq!((wear.scheme, wear.depth_step), (Scheme::Implicit, None));
    assert_eq!(wear.tolerance, 0.01);
    assert_eq!(scene.fidelity.preset, Preset::Balanced);
    assert_eq!(scene.fidelity.cycle, None);
    assert_eq!(scene.fidelity.steps_per_cycle, 64);
    assert!(scene.fidelity.cycle_extrapolation);
    assert_eq!(scene.recipe.output.keep, Keep::All);
    assert_eq!(scene.recipe.output.cycle_fields, None);
    assert_eq!(scene.recipe.output.curves_every, 10);
}

#[test]
fn grid_and_patch_follow_the_joint() {
    let scene = case_with(&[]);
    let (grid, patch) = (
        scene.rough().expect("rough").grid,
        scene.rough().expect("rough").patch(),
    );
    assert_eq!((grid.nx, grid.ny), (64, 40));
    assert_eq!((grid.dx, grid.dy), (0.04 / 64.0, 0.03 / 40.0));
    assert!(
        !patch.is_in_joint[grid.index(32, 20)],
        "the middle must be in the hole"
    );
    assert!(
        patch.is_in_joint[grid.index(0, 0)],
        "the corner must not be in the hole"
    );
    // The area of a staircase circle differs from the area of the hole by less than one ring of cells.
    let hole = 0.04 * 0.03 - patch.area();
    let circle = std::f64::consts::PI * 0.0055f64.powi(2);
    let ring = std::f64::consts::PI * 0.011 * grid.dx.max(grid.dy);
    assert!((hole - circle).abs() < ring, "{hole} against {circle}");
}

#[test]
fn one_body_may_differ() {
    let text = edited(
        "[surface]",
        "density = \"7949 kg/m^3\"\n[material.upper]\nyoungs_modulus = \"70 GPa\"\ndensity = \"2.7 g/cm^3\"\n[surface]",
    );
    let scene = scene_of(&text, &[]);
    let material = scene.the_material();
    let (lower, upper) = (material.elastic.lower, material.elastic.upper);
    assert_eq!(
        (lower.youngs_modulus, upper.youngs_modulus),
        (198.4e9, 70e9)
    );
    assert_eq!(material.density, [Some(7949.0), Some(2700.0)]);
    assert_eq!(upper.poisson_ratio, 0.3);
}

#[test]
fn surfaces_of_every_kind() {
    let kind = |sets: &[&str]| case_with(sets).the_surface();
    assert_eq!(
        kind(&["surface.kind=exponential"]),
        Surface::Exponential {
            rq: 5e-6,
            correlation_length: [0.5e-3, 0.4e-3],
            seed: 3
        }
    );
    assert_eq!(
        kind(&["surface.kind=self_affine", "surface.hurst=0.8"]),
        Surface::SelfAffine {
            rq: 5e-6,
            hurst: 0.8,
            rolloff_wavelength: 0.04,
            cutoff_wavelength: None,
            seed: 3
        }
    );
    assert_eq!(kind(&["surface.kind=flat"]), Surface::Flat);
    assert_eq!(
        kind(&["surface.kind=sphere", "surface.radius=25 mm"]),
        Surface::Sphere { radius: 0.025 }
    );
    assert_eq!(
        kind(&["surface.kind=file", "surface.path=heights.npy"]),
        Surface::File(HeightsFile {
            path: absolute(Path::new("heights.npy")),
            unit: None,
            detrend: Detrend::Plane,
            fill: Fill::Interpolate,
            spacing: None,
            transpose: false,
            correct: Correction::default(),
            second: None,
        })
    );
    assert_eq!(
        kind(&[
            "surface.kind=file",
            "surface.path=/data/heights.csv",
            "surface.unit=µm",
            "surface.detrend=quadratic",
            "surface.fill=mask",
            "surface.spacing=[\"2 um\", \"3 um\"]",
        ]),
        Surface::File(HeightsFile {
            path: "/data/heights.csv".into(),
            unit: Some(1e-6),
            detrend: Detrend::Quadratic,
            fill: Fill::Mask,
            spacing: Some([2e-6, 3e-6]),
            transpose: false,
            correct: Correction::default(),
            second: None,
        })
    );
    let Surface::Gaussian {
        correlation_length, ..
    } = kind(&["surface.correlation_length=0.2 mm"])
    else {
        panic!("the kind has changed");
    };
    assert_eq!(correlation_length, [0.2e-3; 2]);
}

#[test]
fn motions() {
    let motion = |sets: &[&str]| case_with(sets).motion;
    assert_eq!(
        motion(&[
            "motion.amplitude=[\"3 um\", \"2 um\"]",
            "motion.phase=[\"0 deg\", \"90 deg\"]",
            "motion.normal_load_amplitude=1 kN",
        ]),
        displaced([3e-6, 2e-6], [0.0, FRAC_PI_2], 1e3)
    );
    assert_eq!(
        motion(&["motion.amplitude=4 um"]),
        displaced([4e-6, 0.0], [0.0; 2], 0.0)
    );
    assert_eq!(
        motion(&["motion.history=cycle.parquet"]),
        Some(Motion::History {
            path: absolute(Path::new("cycle.parquet"))
        })
    );
}

#[test]
fn presets_set_the_tolerances() {
    let expected = [
        ("fast", [1e-5, 1e-3, 1e-2, 0.03], 32),
        ("balanced", [1e-6, 1e-3, 1e-3, 0.01], 64),
        ("reference", [1e-8, 1e-6, 1e-5, 1e-3], 128),
    ];
    for (preset, tolerances, steps) in expected {
        let scene = case_with(&[&format!("fidelity.preset={preset}")]);
        let fidelity = scene.fidelity;
        let wear = scene.recipe.wear.expect("a [wear] section");
        assert_eq!(
            [
                fidelity.tolerances.normal,
                fidelity.tolerances.tangential,
                fidelity.tolerances.cycle,
                wear.tolerance
            ],
            tolerances,
            "{preset}"
        );
        assert_eq!((fidelity.cycle, wear.scheme), (None, Scheme::Implicit));
        assert_eq!(fidelity.steps_per_cycle, steps, "{preset}");
        assert!(fidelity.cycle_extrapolation);
    }
}

#[test]
fn balanced_steps_a_history_more_finely_than_an_orbit() {
    let steps = |preset: &str| {
        let preset = format!("fidelity.preset={preset}");
        let scene = case_with(&[&preset, "motion={history=\"cycle.parquet\"}"]);
        scene.fidelity.steps_per_cycle
    };
    assert_eq!(["fast", "balanced", "reference"].map(steps), [32, 128, 128]);
}

#[test]
fn wear_steps_are_as_exact_as_the_vibration_that_drives_them() {
    let lap_joint = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/lap_joint.toml");
    let tolerance = |preset: &str| {
        let preset = format!("fidelity.preset={preset}");
        let scene = load(&lap_joint, &[preset]).expect("a scene");
        scene.recipe.wear.expect("a [wear] section").tolerance
    };
    assert_eq!(
        ["fast", "balanced", "reference"].map(tolerance),
        [0.05, 0.015, 1e-3]
    );
}

#[test]
fn a_tolerance_sets_the_knobs_by_what_each_adds_to_the_error() {
    let scene = case_with(&["fidelity.tolerance=0.05"]);
    let wear = scene.recipe.wear.expect("a [wear] section");
    let fidelity = scene.fidelity;
    assert_eq!(fidelity.tolerance, Some(0.05));
    assert!((fidelity.tolerances.normal - 5e-6).abs() < 1e-18);
    assert!((fidelity.tolerances.tangential - 5e-3).abs() < 1e-15);
    assert!((wear.tolerance - 0.0125).abs() < 1e-15);
    // A single tolerance has priority over `fidelity.tolerance`.
    let scene = case_with(&[
        "fidelity.tolerance=0.05",
        "fidelity.tangential_tolerance=1e-5",
    ]);
    assert_eq!(scene.fidelity.tolerances.tangential, 1e-5);
}

#[test]
fn the_paper_preset_is_explicit_and_stepped_unless_told_otherwise() {
    let paper = case_with(&["fidelity.preset=paper"]);
    let wear = paper.recipe.wear.expect("a [wear] section");
    assert_eq!(paper.fidelity.cycle, Some(March::Stepped));
    assert_eq!(paper.fidelity.steps_per_cycle, 32);
    assert!(!paper.fidelity.cycle_extrapolation);
    assert_eq!(
        (wear.scheme, wear.depth_step),
        (Scheme::Explicit, Some(1e-7))
    );

    let other = case_with(&[
        "fidelity.preset=paper",
        "fidelity.cycle=reversal",
        "wear.depth_step=0.01 um",
    ]);
    let wear = other.recipe.wear.expect("a [wear] section");
    assert_eq!(other.fidelity.cycle, Some(March::Reversal));
    assert_eq!(
        (wear.scheme, wear.depth_step),
        (Scheme::Explicit, Some(1e-8))
    );

    let implicit = case_with(&["fidelity.preset=paper", "wear.scheme=implicit"]);
    let wear = implicit.recipe.wear.expect("a [wear] section");
    assert_eq!((wear.scheme, wear.depth_step), (Scheme::Implicit, None));
}

#[test]
fn single_overrides_beat_the_preset() {
    let scene = case_with(&[
        "fidelity.preset=fast",
        "fidelity.normal_tolerance=1e-7",
        "fidelity.wear_tolerance=0.02",
        "fidelity.steps_per_cycle=64",
    ]);
    assert_eq!(scene.fidelity.tolerances.normal, 1e-7);
    assert_eq!(scene.fidelity.tolerances.tangential, 1e-3);
    assert_eq!(scene.fidelity.steps_per_cycle, 64);
    assert_eq!(scene.recipe.wear.map(|wear| wear.tolerance), Some(0.02));
}

#[test]
fn a_run_may_stop_by_volume_alone() {
    let text = edited("cycles = 10_000_000", "volume = \"1 mm^3\"");
    let scene = scene_of(&text, &[]);
    let wear = scene.recipe.wear.expect("a [wear] section");
    assert_eq!((wear.cycles, wear.volume), (None, Some(1e-9)));
}

#[test]
fn iterations_to_keep() {
    let keep = |set: &str| case_with(&[set]).recipe.output.keep;
    assert_eq!(
        keep("output.keep={ every = 50, last = 3, updates = false }"),
        Keep::Some {
            every: Some(50),
            last: 3,
            updates: false
        }
    );
    assert_eq!(
        keep("output.keep.every=20"),
        Keep::Some {
            every: Some(20),
            last: 1,
            updates: true
        }
    );
}

#[test]
fn what_the_whole_program_writes_is_accepted_where_it_means_the_same() {
    let plain = case_with(&[]);
    let full = case_with(&[
        "contact.rotation=fixed",
        "contact.stiffness=total",
        "contact.distribution=uniform",
        "contact.boundary=free",
        "output.response_at=[]",
    ]);
    assert_eq!(plain.canonical(), full.canonical());
}

#[test]
fn a_periodic_joint_may_have_a_hole() {
    let scene = case_with(&["contact.boundary=periodic"]);
    assert_eq!(scene.the_conditions().boundary, Boundary::Periodic);
    assert!(scene.the_joint().hole.is_some());
}

#[test]
fn a_static_contact_needs_no_friction() {
    let text = edited("friction_coefficient = 0.6\n", "");
    let start = text.find("[motion]").expect("a motion");
    let scene = scene_of(&text[..start], &[]);
    assert_eq!(scene.the_contact().friction_coefficient, None);
    assert_eq!((scene.motion, scene.recipe.wear), (None, None));
    // The case remains valid: only its copy was changed.
    assert!(case().load("case.toml", &[]).is_ok());
}
