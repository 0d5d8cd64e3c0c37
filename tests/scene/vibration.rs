//! Values of a loaded scene with a vibrating structure.

use std::f64::consts::{PI, TAU};

use fretwear::json::differences;
use fretwear::recipe::{ElementStiffness, Reasons, Response};
use fretwear::scene::{
    Base, BaseMotion, DampingBasis, Distribution, Force, FrictionLaw, Port, Rayleigh, Resonator,
    Scene, Stiffness, Structure, Update, Updates,
};

use super::{CASE, Folder, OSCILLATOR, ROUGH, SPRINGS, Sections, case_with, message_of, scene_of};

/// Rounding error of a natural frequency after a few operations.
const ROUNDING: f64 = 1e-14;

/// Resonator without a contact.
const BONDED: &str = r#"[joint]
size = ["40 mm", "38 mm"]
[material]
youngs_modulus = "198.4 GPa"
poisson_ratio = 0.3
density = "7949 kg/m^3"
[structure]
kind = "resonator"
[dynamics]
force = { amplitude = "1000 N" }
frequency = ["900 Hz", "1050 Hz"]
"#;

fn resonator(scene: &Scene) -> Resonator {
    match scene.structure() {
        Some(Structure::Resonator { geometry }) => (**geometry).clone(),
        other => panic!("{other:?}"),
    }
}

fn dynamics(scene: &Scene) -> &Response {
    scene
        .recipe
        .response
        .as_ref()
        .expect("a [dynamics] section")
}

fn modes(scene: &Scene) -> Option<usize> {
    Some(scene.recipe.structure.as_ref()?.modes)
}

/// Stiffness of the rough contact, distributed by area.
fn uniform(stiffness: Stiffness) -> ElementStiffness {
    ElementStiffness::Contact {
        stiffness,
        distribution: Distribution::Uniform,
    }
}

fn port(at: &str, axis: usize) -> Port {
    Port {
        at: at.to_owned(),
        axis,
    }
}

#[test]
fn a_rough_joint_in_a_structure_with_its_defaults() {
    let scene = scene_of(ROUGH, &[]);
    let expected = Resonator {
        lap_length: 0.04,
        arm_height: 0.038,
        ..Resonator::default()
    };
    assert_eq!(resonator(&scene), expected);
    assert_eq!(scene.the_joint().elements, Some([19; 2]));
    assert_eq!(scene.the_contact().elements, uniform(Stiffness::Sliders));
    for (sets, expected) in [
        (["fidelity.preset=paper"], Stiffness::Total),
        (["contact.boundary=periodic"], Stiffness::Total),
        (["fidelity.preset=reference"], Stiffness::Sliders),
    ] {
        assert_eq!(
            scene_of(ROUGH, &sets).the_contact().elements,
            uniform(expected),
            "{sets:?}"
        );
    }
    assert_eq!(scene.the_conditions().bolt_stiffness, None);
    let expected = Response {
        forces: vec![Force {
            amplitude: 1e3,
            port: port("far_wall", 0),
            phase: 0.0,
            harmonic: 1,
        }],
        base: None,
        at: port("far_wall", 0),
        harmonics: vec![0, 1, 2, 3],
        harmonic_tolerance: Some(0.015),
        harmonic_correction: true,
        samples: 64,
        damping_ratio: 0.002,
        loss_factor: 0.0,
        rayleigh: None,
        damping_basis: DampingBasis::Stuck,
        at_frequency: None,
        frequency: Some([900.0, 1050.0]),
        points: None,
        why: Reasons::default(),
    };
    assert_eq!(dynamics(&scene), &expected);
    assert_eq!(
        (modes(&scene), scene.friction_law),
        (Some(30), FrictionLaw::Cone)
    );
    let updates = Updates {
        criterion: Update::StiffnessChange {
            change: 0.1,
            volume_growth: Some(0.5),
        },
        extrapolates: true,
    };
    assert_eq!(scene.update, updates);
    assert_eq!(scene.recipe.output.response_at, [0_u64; 0]);
    assert!(scene.motion.is_none() && scene.recipe.wear.is_some());
}

#[test]
fn every_dimension_of_the_resonator_is_a_key() {
    let scene = scene_of(
        ROUGH,
        &[
            "joint.elements=[21, 21]",
            "structure.depth=61 mm",
            "structure.stub_length=9 mm",
            "structure.gap_length=7 mm",
            "structure.block_length=71 mm",
            "structure.block_height=191 mm",
            "structure.leaf_thickness=11 mm",
            "structure.window_length=86 mm",
            "structure.window_height=121 mm",
            "structure.frame_height=192 mm",
            "structure.wall_thickness=41 mm",
            "structure.head_thickness=8.5 mm",
            "structure.bolt_modulus_factor=1.5",
            "structure.half_depth_cells=6",
            "structure.block_cells=13",
            "structure.stub_cells=3",
            "structure.gap_cells=4",
            "structure.leaf_cells=5",
            "structure.window_cells=17",
            "structure.wall_cells=9",
            "structure.inner_cells=10",
            "structure.rim_cells=7",
            "structure.head_cells=1",
            "material.youngs_modulus=200 GPa",
        ],
    );
    let mut material = Resonator::default().material;
    material.elastic.youngs_modulus = 200e9;
    let expected = Resonator {
        lap_length: 0.04,
        arm_height: 0.038,
        depth: 0.061,
        stub_length: 0.009,
        gap_length: 0.007,
        block_length: 0.071,
        block_height: 0.191,
        leaf_thickness: 0.011,
        window_length: 0.086,
        window_height: 0.121,
        frame_height: 0.192,
        wall_thickness: 0.041,
        head_thickness: 0.0085,
        bolt_modulus_factor: 1.5,
        material,
        lap_cells: 21,
        half_depth_cells: 6,
        block_cells: 13,
        stub_cells: 3,
        gap_cells: 4,
        leaf_cells: 5,
        window_cells: 17,
        wall_cells: 9,
        inner_cells: 10,
        rim_cells: 7,
        head_cells: 1,
        tied: false,
    };
    assert_eq!(resonator(&scene), expected);
}

/// A resonator has the hole and the cells of its mesh. The key of the hole does not change them.
#[test]
fn the_hole_of_a_resonator_is_a_staircase() {
    let (plain, named) = (
        scene_of(ROUGH, &[]),
        scene_of(ROUGH, &["joint.hole.diameter=11 mm"]),
    );
    assert_eq!(plain.canonical(), named.canonical());
    let rough = plain.rough().expect("a rough joint");
    let element = 0.04 * 0.038 / 361.0;
    // Each element contains 4 by 3 cells of the grid.
    assert_eq!(rough.patch().cells(), 340 * 4 * 3);
    assert!((rough.patch().area() / (340.0 * element) - 1.0).abs() < ROUNDING);
    for set in ["joint.hole.diameter=8.6 mm", "joint.hole.diameter=12.6 mm"] {
        scene_of(ROUGH, &[set]);
    }
}

#[test]
fn given_stiffness_needs_no_surface_and_no_grid() {
    let scene = scene_of(SPRINGS, &[]);
    assert_eq!((&scene.surface, scene.the_joint().grid), (&None, None));
    assert_eq!(scene.the_joint().elements, Some([19; 2]));
    let contact = scene.the_contact();
    let given = ElementStiffness::Given {
        kn: 1.2e10,
        kt: 1e10,
        gap: 0.0,
        normal_load: 3e4,
    };
    assert_eq!(contact.elements, given);
    assert_eq!(
        (contact.normal_load(), contact.friction_coefficient),
        (3e4, Some(0.6))
    );
    assert!(scene.rough().is_none());
    assert!(!resonator(&scene).tied);
}

#[test]
fn a_contact_may_be_open_at_rest_and_without_friction() {
    let open = SPRINGS.replace("normal_load = \"30 kN\"", "gap = \"2 um\"");
    let contact = scene_of(&open, &[]).contact.expect("a contact");
    assert_eq!(contact.normal_load(), 0.0);
    assert!(matches!(
        contact.elements,
        ElementStiffness::Given { gap: 2e-6, .. }
    ));
    let smooth = SPRINGS.replace("friction_coefficient = 0.6\n", "");
    let contact = scene_of(&smooth, &["contact.kt=0 N/um"])
        .contact
        .expect("a contact");
    assert_eq!(contact.friction_coefficient, None);
    for sets in [
        ["contact.friction_coefficient=0", "contact.normal_load=0 N"],
        ["contact.kn=0 N/um", "contact.normal_load=1 N"],
    ] {
        scene_of(SPRINGS, &sets);
    }
}

/// A wear section is necessary for a bolt load that falls. A structure is not necessary.
#[test]
fn a_bolt_loosens_only_with_wear() {
    let set = "contact.bolt_stiffness=500 N/um";
    assert_eq!(case_with(&[set]).the_conditions().bolt_stiffness, Some(5e8));
    let end = CASE.find("[motion]").expect("a motion");
    assert_eq!(
        message_of(&CASE[..end], &[set]),
        "--set contact.bolt_stiffness=500 N/um: contact.bolt_stiffness = \"500 N/um\": it makes the load fall as the joint wears, but there is no [wear]; remove it"
    );
}

#[test]
fn without_contact_the_joint_is_bonded() {
    let scene = scene_of(BONDED, &[]);
    assert!(scene.contact.is_none() && resonator(&scene).tied);
}

#[test]
fn an_oscillator_with_its_defaults() {
    let scene = scene_of(OSCILLATOR, &[]);
    let expected = Structure::Oscillator {
        springs: Vec::new(),
        mass: [1.0; 3],
        damping: [0.0; 3],
        stiffness: [4e6; 3],
    };
    assert_eq!(scene.structure(), Some(&expected));
    assert!(scene.joint.is_none() && scene.material.is_none() && scene.surface.is_none());
    let dynamics = dynamics(&scene);
    assert_eq!(dynamics.at, port("mass", 0));
    assert_eq!(dynamics.damping_ratio, 0.0);
    let three = scene_of(
        OSCILLATOR,
        &[
            r#"structure.mass=["1 kg", "2000 g", "0.003 t"]"#,
            r#"structure.damping=["5 N s/m", "6 kg/s", "0 N s/m"]"#,
            r#"structure.stiffness=["4 N/um", "5 kN/mm", "6e6 N/m"]"#,
        ],
    );
    let expected = Structure::Oscillator {
        springs: Vec::new(),
        mass: [1.0, 2.0, 3.0],
        damping: [5.0, 6.0, 0.0],
        stiffness: [4e6, 5e6, 6e6],
    };
    assert_eq!(three.structure(), Some(&expected));
}

/// Rayleigh damping adds to a given damping ratio. Without a given ratio, the default of the ratio is 0.
#[test]
fn rayleigh_damping() {
    let set = r#"dynamics.rayleigh={ mass = "5 1/s", stiffness = "2 us" }"#;
    let expected = Rayleigh {
        mass: 5.0,
        stiffness: 2e-6,
    };
    for text in [OSCILLATOR, SPRINGS, ROUGH] {
        let scene = scene_of(text, &[set]);
        assert_eq!(dynamics(&scene).rayleigh, Some(expected));
        assert_eq!(dynamics(&scene).damping_ratio, 0.0);
        let both = scene_of(text, &[set, "dynamics.damping_ratio=0.003"]);
        assert_eq!(dynamics(&both).rayleigh, Some(expected));
        assert_eq!(dynamics(&both).damping_ratio, 0.003);
        // Rayleigh damping of zero counts as absent.
        let nothing = scene_of(text, &["dynamics.rayleigh.mass=0 1/s"]);
        assert_eq!(dynamics(&nothing).rayleigh, None);
    }
    for (set, message) in [
        (
            "dynamics.rayleigh.mass=-1 1/s",
            r#"dynamics.rayleigh.mass = "-1 1/s": must be zero or greater"#,
        ),
        (
            "dynamics.rayleigh.stiffness=2",
            r#"dynamics.rayleigh.stiffness: "2" has no unit; a time is wanted, such as "2 us" or "2 s" or "2 h""#,
        ),
    ] {
        let found = message_of(SPRINGS, &[set]);
        assert!(found.ends_with(message), "{found}");
    }
}

const UNDRIVEN: &str = r#"[structure]
kind = "oscillator"
mass = ["1 kg", "2 kg", "3 kg"]
stiffness = "4 N/um"
[dynamics]
"#;

#[test]
fn a_ground_that_moves() {
    let base = r#"dynamics.base={ acceleration = "5 m/s^2", direction = "y", phase = "90 deg" }"#;
    let scene = scene_of(UNDRIVEN, &[base]);
    let expected = Base {
        motion: BaseMotion::Acceleration(5.0),
        axis: 1,
        phase: PI / 2.0,
        harmonic: 1,
    };
    let found = dynamics(&scene);
    assert_eq!((found.base, found.forces.len()), (Some(expected), 0));
    // The motion of the ground is the drive. Its axis is the axis of the response and of the frequency range.
    assert_eq!(found.at, port("mass", 1));
    let natural = 2e6_f64.sqrt() / TAU;
    let [from, _] = found.frequency.expect("a range");
    assert!((from / (0.5 * natural) - 1.0).abs() < ROUNDING);

    // The ground moves by a displacement or an acceleration, also together with forces. A force of harmonic 1 is then the drive.
    let base = r#"base = { acceleration = "5 m/s^2", direction = "z", harmonic = 4 }"#;
    let text = format!("{OSCILLATOR}{base}\n");
    let scene = scene_of(&text, &["dynamics.base.displacement=2 um"]);
    let found = dynamics(&scene);
    assert_eq!(
        found
            .base
            .map(|base| (base.motion, base.axis, base.harmonic)),
        Some((BaseMotion::Displacement(2e-6), 2, 4))
    );
    assert_eq!(found.at, port("mass", 0));
    assert_eq!(found.harmonics, [0, 1, 2, 3, 4]);
}

#[test]
fn grounds_that_cannot_move_so() {
    let folder = Folder::new()
        .with("springs.toml", SPRINGS)
        .with("undriven.toml", UNDRIVEN);
    for (file, sets, message) in [
        (
            "springs.toml",
            vec![r#"dynamics.base={ displacement = "1 um" }"#],
            "only an oscillator can have a ground motion; drive a reduced structure with dynamics.force",
        ),
        (
            "undriven.toml",
            vec!["dynamics.base.direction=y"],
            r#"dynamics.base.acceleration is missing; add to [dynamics.base]: acceleration = "5 m/s^2"   (or displacement)"#,
        ),
        (
            "undriven.toml",
            vec![r#"dynamics.base={ acceleration = "1 m/s^2", displacement = "1 um" }"#],
            "the ground has an acceleration already; give one or the other",
        ),
        (
            "undriven.toml",
            vec![r#"dynamics.base={ acceleration = "1 m/s^2", harmonic = 2 }"#],
            "no force of harmonic 1 drives the structure; give one",
        ),
        (
            "undriven.toml",
            vec![
                r#"dynamics.base={ acceleration = "1 m/s^2", harmonic = 4 }"#,
                r#"dynamics.force={ amplitude = "1 N" }"#,
                "dynamics.harmonics=[0, 1]",
            ],
            "it is not in dynamics.harmonics = [0, 1]; add it there",
        ),
        (
            "undriven.toml",
            vec![
                r#"dynamics.force=[{ amplitude = "4 N" }, { amplitude = "4 N", phase = "180 deg" }]"#,
            ],
            "the forces of harmonic 1 cancel each other, so that nothing drives the structure; change an amplitude or a phase",
        ),
        (
            "undriven.toml",
            vec!["dynamics.base.acceleration=5 m/s"],
            r#"an acceleration is wanted, such as "5 m/s^2""#,
        ),
    ] {
        let found = folder.message(file, &sets);
        assert!(found.ends_with(message), "{found}");
    }
}

/// The range extends from 0.5 times the frequency without contact to 1.5 times the frequency with the stuck contact.
#[test]
fn the_frequencies_of_an_oscillator() {
    let linear = OSCILLATOR.replace("kt = \"6 N/um\"", "kt = \"0 N/um\"");
    let free_only = |stiffness: f64| stiffness.sqrt() / TAU;
    let cases = [
        (
            OSCILLATOR,
            vec![],
            [0.5 * free_only(4e6), 1.5 * free_only(1e7)],
        ),
        (
            OSCILLATOR,
            vec!["structure.stiffness=0 N/m"],
            [0.3 * free_only(6e6), 1.5 * free_only(6e6)],
        ),
        (
            OSCILLATOR,
            vec!["dynamics.force.direction=z"],
            [0.5 * free_only(4e6), 1.5 * free_only(1.2e7)],
        ),
        (
            linear.as_str(),
            vec![],
            [0.5 * free_only(4e6), 1.5 * free_only(4e6)],
        ),
        (
            OSCILLATOR,
            vec![r#"dynamics.frequency=["0.1 kHz", "200 Hz"]"#],
            [100.0, 200.0],
        ),
    ];
    for (text, sets, expected) in cases {
        let scene = scene_of(text, &sets);
        let range = dynamics(&scene).frequency.expect("a range");
        for (found, expected) in range.into_iter().zip(expected) {
            assert!(
                (found / expected - 1.0).abs() < ROUNDING,
                "{sets:?}: {found}"
            );
        }
    }
}

/// A given frequency needs no range. A given range applies to the forced response.
#[test]
fn a_response_at_a_given_frequency() {
    let alone = ROUGH.replace(r#"frequency = ["900 Hz", "1050 Hz"]"#, r#"at = "20 Hz""#);
    let cases = [
        (alone.as_str(), vec![], None),
        (ROUGH, vec!["dynamics.at=20 Hz"], Some([900.0, 1050.0])),
        (
            OSCILLATOR,
            vec![
                "dynamics.at=20 Hz",
                r#"dynamics.frequency=["100 Hz", "200 Hz"]"#,
            ],
            Some([100.0, 200.0]),
        ),
    ];
    for (text, sets, range) in cases {
        let scene = scene_of(text, &sets);
        let found = dynamics(&scene);
        assert_eq!(
            (found.at_frequency, found.frequency),
            (Some(20.0), range),
            "{sets:?}"
        );
        assert_eq!(found.frequencies_in_force(), Some([20.0, 20.0]));
    }
    // An oscillator derives a range from its resonances in any case.
    let scene = scene_of(OSCILLATOR, &["dynamics.at=20 Hz"]);
    assert!(dynamics(&scene).frequency.is_some());
}

#[test]
fn forces_as_a_list() {
    let list = r#"dynamics.force=[{ amplitude = "5 N" }, { amplitude = "4 N", direction = "y", phase = "90 deg" }, { amplitude = "-3 N", direction = "z", harmonic = 0 }, { amplitude = "2 N", harmonic = 3 }]"#;
    let scene = scene_of(OSCILLATOR, &[list, "dynamics.harmonics=[3, 1, 0]"]);
    let found = dynamics(&scene);
    let force = |amplitude, axis, phase, harmonic| Force {
        amplitude,
        port: port("mass", axis),
        phase,
        harmonic,
    };
    assert_eq!(
        found.forces,
        [
            force(5.0, 0, 0.0, 1),
            force(4.0, 1, 0.5 * PI, 1),
            force(-3.0, 2, 0.0, 0),
            force(2.0, 0, 0.0, 3)
        ]
    );
    assert_eq!(found.harmonics, [0, 1, 3]);

    let text = OSCILLATOR.replace(
        "[dynamics]\nforce = { amplitude = \"100 N\" }\n",
        "[[dynamics.force]]\namplitude = \"1 N\"\nharmonic = 2\n[[dynamics.force]]\namplitude = \"2 N\"\ndirection = \"z\"\n",
    );
    let scene = scene_of(&text, &[]);
    assert_eq!(dynamics(&scene).at, port("mass", 2));
}

#[test]
fn what_else_a_response_may_be() {
    let scene = scene_of(
        ROUGH,
        &[
            "dynamics.response={ at = \"block\", direction = \"y\" }",
            "dynamics.modes=12",
            "dynamics.damping_ratio=1 %",
            "dynamics.damping_basis=free",
            "dynamics.friction_law=box",
            "dynamics.points=61",
            "contact.bolt_stiffness=500 N/um",
            "contact.distribution=by_load",
            "contact.stiffness=roughness",
            "output.response_at=[0, 1e6, 1e7]",
        ],
    );
    let dynamics = dynamics(&scene);
    assert_eq!(dynamics.at, port("block", 1));
    assert_eq!((modes(&scene), dynamics.points), (Some(12), Some(61)));
    assert_eq!(dynamics.damping_ratio, 0.01);
    assert_eq!(
        (dynamics.damping_basis, scene.friction_law),
        (DampingBasis::Free, FrictionLaw::Box)
    );
    assert_eq!(scene.the_conditions().bolt_stiffness, Some(5e8));
    assert_eq!(
        scene.the_contact().elements,
        ElementStiffness::Contact {
            stiffness: Stiffness::Roughness,
            distribution: Distribution::ByLoad
        }
    );
    assert_eq!(scene.recipe.output.response_at, [0, 1_000_000, 10_000_000]);
}

#[test]
fn updates_and_their_alternatives() {
    let update = |sets: &[&str]| scene_of(ROUGH, sets).update.criterion;
    assert_eq!(update(&["update.iterations=5"]), Update::Iterations(5));
    assert_eq!(
        update(&["update.wear_volume=0.5 mm^3"]),
        Update::WearVolume(5e-10)
    );
    assert_eq!(update(&["update=never"]), Update::Never);
    let growth = |set: &str| match update(&[set]) {
        Update::StiffnessChange { volume_growth, .. } => volume_growth,
        other => panic!("{other:?}"),
    };
    assert_eq!(growth("update.volume_growth=0.7"), Some(0.7));
    assert_eq!(growth("update.volume_growth=never"), None);
    assert_eq!(growth("fidelity.preset=paper"), None);
    let carries_on = |sets: &[&str]| scene_of(ROUGH, sets).update.extrapolates;
    assert!(carries_on(&["update.iterations=5"]));
    assert!(!carries_on(&["update=never"]));
    assert!(!carries_on(&["update.extrapolate=false"]));
    assert!(!carries_on(&["fidelity.preset=paper"]));
    let folder = Folder::new()
        .with("case.toml", ROUGH)
        .with("never.toml", "base = \"case.toml\"\nupdate = \"never\"\n")
        .with(
            "again.toml",
            "base = \"never.toml\"\n[update]\niterations = 3\n",
        );
    assert_eq!(
        folder.scene("never.toml", &[]).update.criterion,
        Update::Never
    );
    assert_eq!(
        folder.scene("again.toml", &[]).update.criterion,
        Update::Iterations(3)
    );
}

#[test]
fn samples_of_a_cycle_follow_the_preset_and_the_harmonics() {
    let samples = |sets: &[&str]| dynamics(&scene_of(ROUGH, sets)).samples;
    for (preset, expected) in [
        ("paper", 32),
        ("fast", 32),
        ("balanced", 64),
        ("reference", 512),
    ] {
        let set = format!("fidelity.preset={preset}");
        assert_eq!(samples(&[&set]), expected);
        let oscillator = dynamics(&scene_of(OSCILLATOR, &[&set])).samples;
        assert_eq!(oscillator, 8 * expected);
    }
    assert_eq!(samples(&["dynamics.harmonics=[0, 1, 50]"]), 500);
    assert_eq!(samples(&["fidelity.aft_samples=8"]), 8);
}

#[test]
fn harmonics_that_are_not_given_are_extended() {
    let tolerance = |sets: &[&str]| dynamics(&scene_of(ROUGH, sets)).harmonic_tolerance;
    for (preset, expected) in [
        ("paper", None),
        ("fast", Some(0.05)),
        ("balanced", Some(0.015)),
        ("reference", Some(0.002)),
    ] {
        let set = format!("fidelity.preset={preset}");
        assert_eq!(tolerance(&[&set]), expected);
        assert_eq!(tolerance(&[&set, "dynamics.harmonics=[0, 1]"]), None);
        let own = [&set[..], "fidelity.harmonic_tolerance=0.01"];
        assert_eq!(tolerance(&own), Some(0.01));
    }
    assert_eq!(tolerance(&["fidelity.tolerance=0.01"]), Some(0.005));
    // A linear vibration has no further harmonics.
    assert_eq!(
        message_of(
            crate::support::OSCILLATOR,
            &["fidelity.harmonic_tolerance=0.01"]
        ),
        "--set fidelity.harmonic_tolerance=0.01: fidelity.harmonic_tolerance = 0.01: without a [contact] the vibration is linear and has no further harmonics; remove it"
    );
    // The initial harmonics include all driven harmonics.
    let forces = r#"dynamics.force=[{ amplitude = "9 N" }, { amplitude = "5 N", harmonic = 5 }]"#;
    let scene = scene_of(OSCILLATOR, &[forces]);
    assert_eq!(dynamics(&scene).harmonics, [0, 1, 2, 3, 5]);
}

#[test]
fn a_set_kind_drops_the_keys_of_other_structures() {
    let text = ROUGH.replace(
        "kind = \"resonator\"",
        "kind = \"resonator\"\nblock_length = \"71 mm\"",
    );
    let folder = Folder::new().with("case.toml", &text);
    // The section [joint] remains, but an oscillator has no joint.
    let faults = folder.faults("case.toml", &["structure.kind=oscillator"]);
    assert_eq!(
        faults[0],
        "case.toml, line 1: section [joint]: an oscillator has one contact element and no joint; remove it"
    );
    // The keys of the old structure are removed without a fault.
    assert!(
        !faults.iter().any(|fault| fault.contains("structure.")),
        "{faults:#?}"
    );
    let folder = Folder::new().with("case.toml", OSCILLATOR);
    assert_eq!(
        folder.faults("case.toml", &["structure.kind=resonator"])[0],
        "case.toml: section [joint] is missing (the size of the joint); add for example:\n[joint]\nsize = [\"40 mm\", \"40 mm\"]\ngrid = [256, 256]\nelements = [19, 19]"
    );
}

#[test]
fn a_tangent_stiffness_drops_the_distribution() {
    let text = ROUGH.replace(
        "normal_load = \"30 kN\"",
        "normal_load = \"30 kN\"\nstiffness = \"total\"\ndistribution = \"uniform\"",
    );
    let scene = scene_of(&text, &["contact.stiffness=tangent"]);
    assert_eq!(scene.the_contact().elements, uniform(Stiffness::Tangent));
}

#[test]
fn one_key_of_a_list_of_forces_cannot_be_changed() {
    let text = OSCILLATOR.replace(
        "force = { amplitude = \"100 N\" }",
        "force = [{ amplitude = \"1 N\" }, { amplitude = \"2 N\", direction = \"y\" }]",
    );
    let folder = Folder::new().with("case.toml", &text);
    assert_eq!(
        folder.message("case.toml", &["dynamics.force.amplitude=5 N"]),
        "--set dynamics.force.amplitude=5 N: dynamics.force = { amplitude = \"5 N\" }: dynamics.force is a list of 2 tables, which only a complete list can replace; give the complete list"
    );
    let scene = scene_of(&text, &["dynamics.force=[{ amplitude = \"5 N\" }]"]);
    assert_eq!(dynamics(&scene).forces.len(), 1);
    let one = OSCILLATOR.replace(
        "force = { amplitude = \"100 N\" }",
        "force = [{ amplitude = \"100 N\", direction = \"y\" }]",
    );
    let forces = dynamics(&scene_of(&one, &["dynamics.force.amplitude=5 N"]))
        .forces
        .clone();
    assert_eq!(
        (forces.len(), forces[0].amplitude, forces[0].port.axis),
        (1, 5.0, 1)
    );
    let single = scene_of(OSCILLATOR, &["dynamics.force.amplitude=5 N"]);
    assert_eq!(dynamics(&single).forces[0].amplitude, 5.0);
}

#[test]
fn differences_have_the_names_of_keys() {
    let changed = |text: &str, sets: &[&str]| -> Vec<String> {
        let found = differences(
            &scene_of(text, &[]).canonical(),
            &scene_of(text, sets).canonical(),
        );
        found.into_iter().map(|d| d.key).collect()
    };
    for set in [
        "joint.size=[\"40 mm\", \"39 mm\"]",
        "joint.elements=[21, 21]",
        "material.density=7950 kg/m^3",
        "contact.stiffness=tangent",
        "contact.bolt_stiffness=1 N/um",
        "structure.depth=61 mm",
        "structure.rim_cells=7",
        "dynamics.force.amplitude=900 N",
        "dynamics.force.direction=y",
        "dynamics.force.phase=1 deg",
        "dynamics.harmonics=[0, 1]",
        "dynamics.modes=29",
        "dynamics.damping_ratio=0.001",
        "dynamics.damping_basis=free",
        "dynamics.friction_law=box",
        "dynamics.frequency=[\"900 Hz\", \"1051 Hz\"]",
        "dynamics.points=5",
        "update.stiffness_change=0.2",
        "fidelity.aft_samples=256",
        "output.response_at=[5]",
    ] {
        let key = set.split('=').next().expect("a key");
        let found = changed(ROUGH, &[set]);
        // Differences report a force as a whole, and a material per body.
        let told = match key {
            "material.density" => "material.lower.density",
            key if key.starts_with("dynamics.force") => "dynamics.force",
            key => key,
        };
        assert!(found.iter().any(|key| key == told), "{set}: {found:?}");
    }
    assert_eq!(
        changed(ROUGH, &["dynamics.response.direction=z"]),
        ["dynamics.response.direction"]
    );
    assert_eq!(changed(SPRINGS, &["contact.kn=1 N/um"]), ["contact.kn"]);
    assert_eq!(
        changed(
            OSCILLATOR,
            &[
                "structure.mass=2 kg",
                "dynamics.frequency=[\"1 Hz\", \"9 Hz\"]"
            ]
        ),
        ["dynamics.frequency", "structure.mass"]
    );
}

/// The section `structure` of the canonical form contains all inputs of the structure. The key of stored results uses this section.
#[test]
fn the_canonical_structure_is_complete() {
    let structure =
        |text: &str, sets: &[&str]| scene_of(text, sets).canonical()["structure"].clone();
    let plain = structure(ROUGH, &[]);
    for set in [
        "joint.size=[\"41 mm\", \"38 mm\"]",
        "joint.size=[\"40 mm\", \"39 mm\"]",
        "joint.elements=[21, 21]",
        "material.youngs_modulus=200 GPa",
        "material.poisson_ratio=0.29",
        "material.density=7950 kg/m^3",
        "structure.head_cells=3",
    ] {
        assert_ne!(structure(ROUGH, &[set]), plain, "{set}");
    }
    assert_eq!(structure(ROUGH, &["surface.rq=1 um"]), plain);
    assert_ne!(structure(SPRINGS, &[]), structure(BONDED, &[]));
}

#[test]
fn the_document_of_a_vibrating_scene_loads_again() {
    for text in [ROUGH, SPRINGS, OSCILLATOR] {
        let list =
            "dynamics.force=[{ amplitude = \"5 N\" }, { amplitude = \"4 N\", harmonic = 2 }]";
        let scene = scene_of(text, &[list]);
        assert_eq!(scene_of(&scene.to_toml(), &[]), scene);
    }
}
