//! Tests of bases and `--set`: order of the layers, start of relative paths, and keys that a new kind removes.

use std::path::Path;

use fretwear::scene::{Motion, Surface};

use super::{CASE, Folder, Sections, absolute, case, case_with, displaced};

#[test]
fn a_derived_file_gives_only_what_differs() {
    let folder = case()
        .with(
            "sub/cap.toml",
            "base = \"../case.toml\"\n[contact]\npressure_cap = \"600 MPa\"\n",
        )
        .with(
            "sub/deep/both.toml",
            "base = \"../cap.toml\"\ntitle = \"Both\"\nsurface.rq = \"1 um\"\n[contact]\nnormal_load = \"20 kN\"\n",
        );
    let scene = folder.scene("sub/deep/both.toml", &[]);
    assert_eq!(scene.name, "both");
    assert_eq!(scene.recipe.title.as_deref(), Some("Both"));
    assert_eq!(scene.the_conditions().pressure_cap, Some(6e8));
    assert_eq!(scene.the_contact().normal_load(), 2e4);
    assert_eq!(
        scene.the_surface(),
        Surface::Gaussian {
            rq: 1e-6,
            correlation_length: [0.5e-3, 0.4e-3],
            seed: 3
        }
    );
    assert!(scene.document().get("base").is_none());
}

#[test]
fn a_fault_is_reported_where_it_was_written() {
    let folder = Folder::new()
        .with("bad.toml", &CASE.replace("\"30 kN\"", "\"30 mm\""))
        .with("top.toml", "base = \"bad.toml\"\n\nwear.cycles = 5\n");
    let expected = "bad.toml, line 16: contact.normal_load: \"30 mm\" is a length; a force is wanted, such as \"30 N\" or \"30 kN\"";
    assert_eq!(folder.message("top.toml", &[]), expected);
    // A value of a higher layer replaces the faulty value. The program reports a faulty value in the layer that contains it.
    folder.scene("top.toml", &["contact.normal_load=30 kN"]);
    let folder = folder.with(
        "over.toml",
        "base = \"top.toml\"\n[contact]\nnormal_load = 1\n",
    );
    assert!(
        folder
            .message("over.toml", &[])
            .starts_with("over.toml, line 3: contact.normal_load: \"1\" has no unit")
    );
}

#[test]
fn what_is_missing_is_missing_from_the_file_asked_for() {
    let folder = Folder::new()
        .with("part.toml", "[joint]\nsize = [\"4 mm\", \"3 mm\"]\n")
        .with("top.toml", "base = \"part.toml\"\n[wear]\ncycles = 5\n");
    let expected = "top.toml: joint.grid is missing; add to [joint]: grid = [256, 192]";
    let faults = folder.faults("top.toml", &[]);
    assert!(faults.iter().any(|fault| fault == expected), "{faults:#?}");
}

#[test]
fn bases_in_a_circle_are_refused() {
    let folder = Folder::new()
        .with("start.toml", "base = \"a.toml\"\n")
        .with("a.toml", "title = \"a\"\nbase = \"b.toml\"\n")
        .with("b.toml", "base = \"./a.toml\"\n")
        .with("self.toml", "base = \"self.toml\"\n");
    assert_eq!(
        folder.message("start.toml", &[]),
        "b.toml, line 1: the base files form a cycle: a.toml -> b.toml -> ./a.toml"
    );
    assert_eq!(
        folder.message("self.toml", &[]),
        "self.toml, line 1: the base files form a cycle: self.toml -> self.toml"
    );
}

#[test]
fn two_files_may_share_a_base() {
    let folder = case()
        .with("left.toml", "base = \"case.toml\"\n")
        .with("right.toml", "base = \"case.toml\"\n");
    assert_eq!(
        folder.scene("left.toml", &[]).canonical(),
        folder.scene("right.toml", &[]).canonical()
    );
}

#[test]
fn a_base_must_be_a_readable_file() {
    let folder = Folder::new()
        .with("gone.toml", "\nbase = \"nowhere.toml\"\n")
        .with("number.toml", "base = 3\n");
    let message = folder.message("gone.toml", &[]);
    assert!(
        message.starts_with(
            "gone.toml, line 2: base = \"nowhere.toml\": nowhere.toml cannot be read: "
        ),
        "{message}"
    );
    assert_eq!(
        folder.message("number.toml", &[]),
        "number.toml, line 1: base = 3: must be the path of a scene file, such as \"other.toml\""
    );
}

#[test]
fn a_set_value_is_toml_else_a_string() {
    let scene = case_with(&[
        "wear.cycles=1e6",
        "contact.normal_load=20 kN",
        "surface.rq=\"2 um\"",
        "joint.grid=[32, 24]",
        "output.cycle_fields=true",
        "joint.hole={ diameter = \"9 mm\" }",
        " output.curves_every = 0 ",
        "title=a = b",
    ]);
    assert_eq!(
        scene.recipe.wear.as_ref().and_then(|wear| wear.cycles),
        Some(1_000_000)
    );
    assert_eq!(scene.the_contact().normal_load(), 2e4);
    assert!(matches!(
        scene.the_surface(),
        Surface::Gaussian { rq: 2e-6, .. }
    ));
    assert_eq!(scene.the_joint().grid.expect("grid"), [32, 24]);
    assert!(scene.recipe.output.cycle_fields.is_some());
    assert_eq!(scene.the_joint().hole, Some(0.009));
    assert_eq!(scene.recipe.output.curves_every, 0);
    assert_eq!(scene.recipe.title.as_deref(), Some("a = b"));
}

#[test]
fn the_last_set_of_a_key_holds() {
    let scene = case_with(&["wear.cycles=5", "wear.cycles=7"]);
    assert_eq!(scene.recipe.wear.and_then(|wear| wear.cycles), Some(7));
}

#[test]
fn a_set_may_add_a_section() {
    let text = &CASE[..CASE.find("[wear]").expect("a wear section")];
    let scene = Folder::new().with("still.toml", text).scene(
        "still.toml",
        &["wear.cycles=5", "wear.coefficient=2e3 um^3/J"],
    );
    assert_eq!(scene.recipe.wear.and_then(|wear| wear.cycles), Some(5));
}

#[test]
fn a_set_kind_drops_the_keys_of_other_kinds_in_any_order() {
    for sets in [
        ["surface.kind=sphere", "surface.radius=1 mm"],
        ["surface.radius=1 mm", "surface.kind=sphere"],
    ] {
        let scene = case_with(&sets);
        assert_eq!(scene.the_surface(), Surface::Sphere { radius: 1e-3 });
        let surface = scene.document()["surface"].as_table().expect("a section");
        assert_eq!(surface.keys().collect::<Vec<_>>(), ["kind", "radius"]);
    }
}

#[test]
fn a_kind_keeps_the_keys_it_shares() {
    let scene = case_with(&["surface.kind=self_affine", "surface.hurst=0.7"]);
    assert!(matches!(
        scene.the_surface(),
        Surface::SelfAffine {
            rq: 5e-6,
            seed: 3,
            ..
        }
    ));
}

#[test]
fn a_derived_kind_drops_the_keys_of_its_base() {
    let folder = case().with(
        "ball.toml",
        "base = \"case.toml\"\nsurface = { kind = \"sphere\", radius = \"2 mm\" }\n",
    );
    assert_eq!(
        folder.scene("ball.toml", &[]).the_surface(),
        Surface::Sphere { radius: 2e-3 }
    );
}

#[test]
fn a_kind_that_does_not_change_hides_no_fault() {
    let folder = Folder::new().with("case.toml", &CASE.replace("seed = 3", "radius = \"1 mm\""));
    let message = folder.message("case.toml", &["surface.kind=gaussian"]);
    assert!(
        message.starts_with("case.toml, line 13: surface.radius = \"1 mm\" does not belong"),
        "{message}"
    );
}

#[test]
fn a_misspelt_key_survives_a_new_kind() {
    let folder = Folder::new().with("case.toml", &CASE.replace("seed = 3", "raduis = \"1 mm\""));
    assert_eq!(
        folder.message("case.toml", &["surface.kind=flat"]),
        "case.toml, line 13: surface.raduis = \"1 mm\": there is no such key; did you mean surface.radius?"
    );
}

#[test]
fn a_history_replaces_an_amplitude_and_the_other_way_round() {
    let folder = case().with(
        "history.toml",
        "base = \"case.toml\"\n[motion]\nhistory = \"cycle.parquet\"\n",
    );
    assert_eq!(
        folder.scene("history.toml", &[]).motion,
        Some(Motion::History {
            path: folder.path("cycle.parquet")
        })
    );
    assert_eq!(
        folder
            .scene("history.toml", &["motion.amplitude=2 um"])
            .motion,
        displaced([2e-6, 0.0], [0.0; 2], 0.0)
    );
}

#[test]
fn paths_start_at_their_file_and_in_a_set_at_the_working_folder() {
    let folder = case()
        .with(
            "sub/measured.toml",
            "base = \"../case.toml\"\n[surface]\nkind = \"file\"\npath = \"maps/heights.npy\"\n",
        )
        .with("top.toml", "base = \"sub/measured.toml\"\n");
    let path = |name: &str, sets: &[&str]| match folder.scene(name, sets).the_surface() {
        Surface::File(file) => file.path,
        other => panic!("{other:?}"),
    };
    assert_eq!(path("top.toml", &[]), folder.path("sub/maps/heights.npy"));
    assert_eq!(
        path("top.toml", &["surface.path=maps/other.npy"]),
        absolute(Path::new("maps/other.npy"))
    );
}
