//! Tests of the shipped scenes of the study: their settings, and their agreement with `pipelines/study`.

use std::path::{Path, PathBuf};

use fretwear::recipe::UpdateCriterion;
use fretwear::scene::{self, Plan};
use fretwear::study::{JOINT_SCENES, LAW_INDEPENDENT_SCENES, Law};

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("pipelines/study")
}

#[test]
fn they_are_all_that_is_in_the_folder() {
    let mut found: Vec<String> = std::fs::read_dir(folder())
        .expect("the folder")
        .map(|entry| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        })
        .collect();
    found.sort();
    let mut shipped: Vec<String> = JOINT_SCENES
        .iter()
        .chain(&LAW_INDEPENDENT_SCENES)
        .map(|(name, _)| format!("{name}.toml"))
        .collect();
    shipped.extend(["joint.toml", "joint_sliders.toml"].map(str::to_owned));
    shipped.sort();
    assert_eq!(found, shipped);
}

/// The paper's setting has no updates, except in the runs about updates. Both laws agree with their names.
#[test]
fn they_are_in_the_papers_setting() {
    for (law, joint, word) in [
        (Law::Paper, "joint", "total"),
        (Law::Sliders, "joint_sliders", "sliders"),
    ] {
        let text =
            std::fs::read_to_string(folder().join(format!("{joint}.toml"))).expect("a scene");
        assert_eq!(text, law.joint());
        assert!(
            text.contains(&format!("stiffness = \"{word}\""))
                && text.contains("update = \"never\"")
        );
    }
    for (name, _) in JOINT_SCENES {
        let scene = scene::load(&folder().join(format!("{name}.toml")), &[]).expect("a scene");
        let plan = Plan::of(&scene).expect("a plan");
        let elements = plan.inputs.recipe.elements().expect("contact elements");
        let updates = matches!(
            elements.update.criterion,
            UpdateCriterion::StiffnessChange { .. }
        );
        assert_eq!(updates, name.starts_with("update"), "{name}");
        let wear = plan.inputs.recipe.wear.as_ref().expect("wear");
        assert_eq!(wear.scheme.is_explicit(), name == "explicit", "{name}");
    }
    for (name, _) in LAW_INDEPENDENT_SCENES {
        let scene = scene::load(&folder().join(format!("{name}.toml")), &[]).expect("a scene");
        let plan = Plan::of(&scene).expect("a plan");
        let heights = &plan.inputs.recipe.surface().expect("a surface").heights;
        let is_sphere = heights.sphere_radius().is_some();
        assert_eq!(is_sphere, name.starts_with("sphere"), "{name}");
    }
}
