//! Tests of the shipped scenes.

use std::f64::consts::{PI, TAU};
use std::fs;
use std::path::Path;

use fretwear::recipe::ElementStiffness;
use fretwear::scene::{
    Contact, Motion, Pressing, Resonator, Scene, Stiffness, Structure, Surface, Transverse, Update,
    Updates, Wear, load,
};

use super::Sections;

fn shipped(name: &str) -> Scene {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("pipelines")
        .join(name);
    load(&path, &[]).unwrap_or_else(|error| panic!("{error}"))
}

#[test]
fn every_shipped_scene_loads_and_has_a_title() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines");
    let mut count = 0;
    for entry in fs::read_dir(folder).expect("the pipelines") {
        let path = entry.expect("an entry").path();
        if path
            .extension()
            .is_some_and(|extension| extension == "toml")
        {
            let scene = load(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(
                scene.recipe.title.is_some(),
                "{} has no title",
                path.display()
            );
            count += 1;
        }
    }
    assert!(count >= 16, "{count} scenes");
}

#[test]
fn the_published_parameters() {
    let scene = shipped("prescribed_fretting.toml");
    let material = scene.the_material();
    assert_eq!(material.elastic.upper.youngs_modulus, 198.4e9);
    assert_eq!(material.density[1], Some(7949.0));
    assert_eq!(scene.the_joint().size, [0.04; 2]);
    assert_eq!(scene.the_joint().grid.expect("grid"), [256; 2]);
    assert_eq!(scene.the_joint().elements, Some([19; 2]));
    assert_eq!(
        scene.the_surface(),
        Surface::Gaussian {
            rq: 5e-6,
            correlation_length: [0.5e-3; 2],
            seed: 1
        }
    );
    assert_eq!(scene.the_contact().friction_coefficient, Some(0.6));
    assert_eq!(scene.the_contact().normal_load(), 3e4);
    let wear = scene.recipe.wear.as_ref().expect("a [wear] section");
    assert_eq!((wear.coefficient, wear.cycles), (2e-15, Some(10_000_000)));

    let plastic = shipped("prescribed_fretting_plastic.toml");
    let found = fretwear::json::differences(&scene.canonical(), &plastic.canonical());
    let keys: Vec<&str> = found.iter().map(|d| d.key.as_str()).collect();
    assert_eq!(keys, ["contact.pressure_cap"]);
    assert_eq!(plastic.the_conditions().pressure_cap, Some(6e8));
}

/// The scene agrees with Table 1 and with sections 3 and 4 of the paper, and with the assumptions in the scene's comments.
#[test]
fn the_published_case() {
    let scene = shipped("lap_joint.toml");
    let prescribed = shipped("prescribed_fretting.toml");
    assert_eq!(scene.surface, prescribed.surface);
    assert_eq!(scene.material, prescribed.material);
    // The wear steps limit the accuracy of the response. The tolerance of both scenes therefore differs.
    let of_response = |wear: Wear| Wear {
        tolerance: 0.015,
        ..wear
    };
    assert_eq!(scene.recipe.wear, prescribed.recipe.wear.map(of_response));
    let ElementStiffness::Contact { distribution, .. } = scene.the_contact().elements else {
        panic!("{:?}", scene.the_contact().elements);
    };
    let of_no_structure = Contact {
        pressed_by: Pressing::Punch,
        elements: ElementStiffness::Contact {
            stiffness: Stiffness::Total,
            distribution,
        },
        ..scene.the_contact().clone()
    };
    assert_eq!(Some(of_no_structure), prescribed.contact);
    let joint = scene.the_joint();
    assert_eq!((joint.size, joint.grid), ([0.04; 2], Some([256; 2])));
    let Some(Structure::Resonator { geometry }) = scene.structure() else {
        panic!("{:?}", scene.structure());
    };
    assert_eq!(**geometry, Resonator::default(), "the shipped set");
    assert_eq!(geometry.contact_array().cells().len(), 340);
    let dynamics = scene.recipe.response.as_ref().expect("dynamics");
    assert_eq!(dynamics.forces.len(), 1);
    assert_eq!(dynamics.forces[0].amplitude, 1000.0);
    assert_eq!(dynamics.forces[0].port, dynamics.at);
    assert_eq!(dynamics.harmonics, [0, 1, 2, 3]);
    let structure = scene.recipe.structure.as_ref().expect("a structure");
    assert_eq!(structure.modes, 30);
    let updates = Updates {
        criterion: Update::StiffnessChange {
            change: 0.1,
            volume_growth: Some(0.5),
        },
        extrapolates: true,
    };
    assert_eq!(scene.update, updates);
}

#[test]
fn variants_differ_in_what_they_say() {
    let variants: [(&str, &[&str]); 8] = [
        ("lap_joint_rq05.toml", &["surface.rq"]),
        ("lap_joint_rq1.toml", &["surface.rq"]),
        ("lap_joint_rq10.toml", &["surface.rq"]),
        ("lap_joint_plastic.toml", &["contact.pressure_cap"]),
        ("lap_joint_update05.toml", &["update.stiffness_change"]),
        ("lap_joint_update20.toml", &["update.stiffness_change"]),
        (
            "lap_joint_no_update.toml",
            &[
                "update.extrapolate",
                "update.stiffness_change",
                "update.volume_growth",
            ],
        ),
        ("lap_joint.toml", &[]),
    ];
    let case = shipped("lap_joint.toml").canonical();
    for (name, expected) in variants {
        let scene = shipped(name);
        let found = fretwear::json::differences(&case, &scene.canonical());
        let keys: Vec<&str> = found.iter().map(|d| d.key.as_str()).collect();
        assert_eq!(keys, expected, "{name}");
    }
    let rq = |name| match shipped(name).the_surface() {
        Surface::Gaussian { rq, .. } => rq,
        other => panic!("{other:?}"),
    };
    let found = [
        "lap_joint_rq05.toml",
        "lap_joint_rq1.toml",
        "lap_joint_rq10.toml",
    ]
    .map(rq);
    assert_eq!(found, [0.5e-6, 1e-6, 10e-6]);
    assert_eq!(
        shipped("lap_joint_no_update.toml").update.criterion,
        Update::Never
    );
    let plastic = shipped("lap_joint_plastic.toml");
    assert_eq!(plastic.the_conditions().pressure_cap, Some(6e8));
}

#[test]
fn given_springs_are_those_of_the_independent_run() {
    let scene = shipped("resonator_springs.toml");
    let ElementStiffness::Given { kn, kt, gap, .. } = scene.the_contact().elements else {
        panic!("{:?}", scene.the_contact().elements);
    };
    assert_eq!((kn, kt, gap), (1.2e10, 1e10, 0.0));
    let lap_joint = shipped("lap_joint.toml");
    assert_eq!(scene.structure(), lap_joint.structure());
    let [here, there] =
        [&scene, &lap_joint].map(|scene| scene.recipe.response.as_ref().expect("dynamics"));
    assert_eq!(here.forces, there.forces);
    assert!(scene.surface.is_none() && scene.recipe.wear.is_none());
}

/// The comment of the scene quotes both resonances and the friction limit.
#[test]
fn the_oscillator_slips_between_its_two_resonances() {
    let scene = shipped("oscillator.toml");
    let Some(Structure::Oscillator {
        mass, stiffness, ..
    }) = scene.structure()
    else {
        panic!("{:?}", scene.structure());
    };
    let contact = scene.the_contact();
    let [_, kt, _] = contact.elements.given().expect("given");
    let hertz = |stiffness: f64| (stiffness / mass[0]).sqrt() / TAU;
    assert_eq!(hertz(stiffness[0]).round(), 318.0);
    assert_eq!(hertz(stiffness[0] + kt).round(), 503.0);
    let limit = contact.friction_coefficient.expect("friction") * contact.normal_load();
    assert_eq!(limit, 300.0);
    let dynamics = scene.recipe.response.as_ref().expect("dynamics");
    assert!(dynamics.forces[0].amplitude < 4.0 / PI * limit);
    let [low, high] = dynamics.frequency.expect("a range");
    assert!(low < hertz(stiffness[0]) && hertz(stiffness[0] + kt) < high);
}

#[test]
fn the_static_contact_does_not_move() {
    let scene = shipped("static_contact.toml");
    assert_eq!(scene.the_joint().size, [0.04, 0.03]);
    assert_eq!((scene.motion, scene.recipe.wear), (None, None));
}

/// Tolerance of the ratios that the comments of the sphere scene quote with two digits.
const STATED: f64 = 0.01;

#[test]
fn the_sphere_fits_its_patch_and_slips_partially() {
    let scene = shipped("hertz_fretting.toml");
    assert_eq!(scene.the_contact().transverse, Transverse::Absent);
    let Surface::Sphere { radius } = scene.the_surface() else {
        panic!("not a sphere");
    };
    let Some(Motion::Harmonic(motion)) = &scene.motion else {
        panic!("not a harmonic motion");
    };
    let elastic = scene.the_material().elastic.lower;
    let (load, nu) = (scene.the_contact().normal_load(), elastic.poisson_ratio);
    let friction = scene.the_contact().friction_coefficient.expect("friction");
    let contact_modulus = elastic.youngs_modulus / (2.0 * (1.0 - nu * nu));
    let shear_modulus = elastic.youngs_modulus / (2.0 * (1.0 + nu));
    let a = (0.75 * load * radius / contact_modulus).cbrt();
    let sliding = 3.0 * friction * load / (8.0 * a) * (2.0 - nu) / shear_modulus;
    assert!((a / (0.5 * scene.the_joint().size[1]) - 0.33).abs() < STATED);
    assert!((motion.axes[0].amplitude / sliding - 0.6).abs() < STATED);
}
