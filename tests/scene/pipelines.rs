//! The scenes that are shipped.

use std::fs;
use std::path::Path;

use fretwear::scene::{Motion, Scene, Surface, Transverse, load};

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
            assert!(scene.title.is_some(), "{} has no title", path.display());
            count += 1;
        }
    }
    assert!(count >= 4, "{count} scenes");
}

#[test]
fn the_published_parameters() {
    let scene = shipped("prescribed_fretting.toml");
    assert_eq!(
        scene
            .material
            .as_ref()
            .expect("material")
            .upper
            .youngs_modulus,
        198.4e9
    );
    assert_eq!(
        scene.material.as_ref().expect("material").upper.density,
        Some(7949.0)
    );
    assert_eq!(scene.joint.as_ref().expect("joint").size, [0.04; 2]);
    assert_eq!(
        scene.joint.as_ref().expect("joint").grid.expect("grid"),
        [256; 2]
    );
    assert_eq!(scene.joint.as_ref().expect("joint").elements, Some([19; 2]));
    assert_eq!(
        scene.surface,
        Surface::Gaussian {
            rq: 5e-6,
            correlation_length: [0.5e-3; 2],
            seed: 1
        }
    );
    assert_eq!(
        scene
            .contact
            .as_ref()
            .expect("contact")
            .friction_coefficient,
        Some(0.6)
    );
    assert_eq!(scene.contact.as_ref().expect("contact").normal_load, 3e4);
    let wear = scene.wear.as_ref().expect("a [wear] section");
    assert_eq!((wear.coefficient, wear.cycles), (2e-15, Some(10_000_000)));

    let plastic = shipped("prescribed_fretting_plastic.toml");
    let found = fretwear::scene::differences(&scene.canonical(), &plastic.canonical());
    let keys: Vec<&str> = found.iter().map(|d| d.key.as_str()).collect();
    assert_eq!(keys, ["contact.pressure_cap"]);
    assert_eq!(plastic.contact.pressure_cap, Some(6e8));
}

#[test]
fn the_static_contact_does_not_move() {
    let scene = shipped("static_contact.toml");
    assert_eq!((scene.motion, scene.wear), (None, None));
    assert_eq!(scene.joint.as_ref().expect("joint").size, [0.04, 0.03]);
}

/// Shares that the scene of the sphere states for itself, to the two digits it states them with.
const STATED: f64 = 0.01;

#[test]
fn the_sphere_fits_its_patch_and_slips_partially() {
    let scene = shipped("hertz_fretting.toml");
    assert_eq!(
        scene.contact.as_ref().expect("contact").transverse,
        Transverse::Absent
    );
    let Surface::Sphere { radius } = scene.surface else {
        panic!("not a sphere");
    };
    let Some(Motion::Harmonic { amplitude, .. }) = scene.motion else {
        panic!("not a harmonic motion");
    };
    let solid = scene.material.as_ref().expect("material").lower;
    let (load, nu) = (
        scene.contact.as_ref().expect("contact").normal_load,
        solid.poisson_ratio,
    );
    let friction = scene
        .contact
        .as_ref()
        .expect("contact")
        .friction_coefficient
        .expect("friction");
    let contact_modulus = solid.youngs_modulus / (2.0 * (1.0 - nu * nu));
    let shear_modulus = solid.youngs_modulus / (2.0 * (1.0 + nu));
    let a = (0.75 * load * radius / contact_modulus).cbrt();
    let sliding = 3.0 * friction * load / (8.0 * a) * (2.0 - nu) / shear_modulus;
    assert!((a / (0.5 * scene.joint.as_ref().expect("joint").size[1]) - 0.33).abs() < STATED);
    assert!((amplitude[0] / sliding - 0.6).abs() < STATED);
}
