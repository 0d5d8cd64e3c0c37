//! Comparison of several runs: keys with different values in the units of their scenes, and sections along one line.

use fretwear::report::{Report, RunTables};
use tempfile::TempDir;

use super::small_runs::{WORN, begin, compute};
use super::words::{attributes, between};
use crate::support::{Bench, RESONATOR};

/// Prescribed motion of a joint with the size of the joint of [`RESONATOR`].
fn prescribed() -> String {
    WORN.replace(r#"["4 mm", "3 mm"]"#, r#"["40 mm", "36 mm"]"#)
        .replace(r#"["0.5 mm", "0.4 mm"]"#, r#"["5 mm", "4 mm"]"#)
}

#[test]
fn differences_are_those_that_users_made_and_have_units() {
    let folder = TempDir::new().unwrap();
    let with_hole =
        |scene: &str| scene.replace("[material]", "hole = { diameter = \"22 mm\" }\n[material]");
    let resonator = RESONATOR.replace("stiffness = \"total\"\n", "");
    let roots = [
        begin(&folder, "vibrating", &with_hole(&resonator), 1),
        begin(&folder, "moved", &with_hole(&prescribed()), 1),
    ];
    let runs = roots.map(|root| RunTables::open(&root).unwrap());
    let html = Report::new(&runs).unwrap().html();
    let section = between(&html, "<section id=\"differences\">", "</section>");
    let row = |key: &str| {
        section
            .lines()
            .find(|line| line.contains(&format!("<td>{key}</td>")))
    };
    assert!(
        row("dynamics.force")
            .unwrap()
            .contains("<td>amplitude 300 N, at far_wall, direction x</td><td>–</td>"),
        "{section}"
    );
    // The table omits keys with the same text in both runs, and defaults of a feature that the other run lacks.
    for key in [
        "joint.hole.diameter",
        "contact.stiffness",
        "contact.distribution",
        "structure.tied",
    ] {
        assert!(row(key).is_none(), "{:?}", row(key));
    }
    assert!(
        row("contact.normal_load")
            .unwrap()
            .contains("<td>30 kN</td><td>300 N</td>")
    );
}

#[test]
fn sections_of_all_runs_are_along_one_line() {
    let folder = TempDir::new().unwrap();
    let other = WORN.replace("seed = 7", "seed = 8");
    let roots = [
        compute(&folder, "a", WORN, None),
        compute(&folder, "b", &other, None),
    ];
    let runs = roots.map(|root| RunTables::open(&root).unwrap());
    let html = Report::new(&runs).unwrap().html();
    assert_eq!(attributes(&html, "section", "data-x").len(), 4);
    let caption = between(&html, "the deepest point of wear of all runs, x ", ": ");
    assert!(caption.contains(" and y "), "{caption}");
    // The report of a single run cuts the joint at its own deepest point.
    let alone = runs.map(|run| {
        let html = Report::new(&[run]).unwrap().html();
        between(&html, "the deepest point of wear, x ", ": ").to_owned()
    });
    assert_ne!(alone[0], alone[1]);
    assert!(alone.contains(&caption.to_owned()), "{alone:?}: {caption}");
}

/// Comments describe the purpose of a scene. A report shows these comments.
#[test]
fn a_report_shows_the_scene_as_it_was_written() {
    let bench = Bench::new();
    let small = std::fs::read_to_string(bench.path("small.toml")).unwrap();
    bench.write("small.toml", format!("# of the rig in hall 2\n{small}"));
    bench.done(&["run", "small.toml", "--run", "a", "--quiet"]);
    let run = RunTables::open(&bench.path("a")).unwrap();
    let html = Report::new(&[run]).unwrap().html();
    let scene = between(&html, "<section id=\"scene\">", "</section>");
    assert!(scene.contains("# of the rig in hall 2"), "{scene}");
    assert!(!scene.contains("Damaged"), "{scene}");
    // A replaced scene file is not the scene of the computation.
    let file = bench.path("a/scene.original.toml");
    std::fs::write(&file, "# another joint\n").unwrap();
    let run = RunTables::open(&bench.path("a")).unwrap();
    let html = Report::new(&[run]).unwrap().html();
    let scene = between(&html, "<section id=\"scene\">", "</section>");
    assert!(!scene.contains("# another joint"), "{scene}");
    for kept in ["Damaged: ", "# of the rig in hall 2"] {
        assert!(scene.contains(kept), "{scene} lacks {kept}");
    }
}

/// The report of a run without a user's scene file shows the stored scene. The report ignores a file that another program added.
#[test]
fn a_run_of_a_scene_that_no_user_wrote_shows_the_one_it_keeps() {
    let folder = TempDir::new().unwrap();
    let root = begin(&folder, "made", WORN, 1);
    std::fs::write(root.join("scene.original.toml"), "# of a stranger\n").unwrap();
    let run = RunTables::open(&root).unwrap();
    let html = Report::new(&[run]).unwrap().html();
    let scene = between(&html, "<section id=\"scene\">", "</section>");
    assert!(scene.contains("scene.toml as kept in the run"), "{scene}");
    assert!(!scene.contains("of a stranger"), "{scene}");
}

/// Equal numbers are different wear coefficients under different wear laws.
#[test]
fn a_wear_law_is_told_with_its_coefficient() {
    let folder = TempDir::new().unwrap();
    let given = "coefficient = \"2e3 um^3/J\"\n";
    assert!(WORN.contains(given));
    let roots = ["energy", "archard"].map(|law| {
        let scene = WORN.replace(given, &format!("{given}law = \"{law}\"\n"));
        begin(&folder, law, &scene, 1)
    });
    let runs = roots.map(|root| RunTables::open(&root).unwrap());
    let html = Report::new(&runs).unwrap().html();
    let section = between(&html, "<section id=\"differences\">", "</section>");
    let row =
        "<td>wear.coefficient</td><td>2e3 um^3/J, law energy</td><td>2e3 um^3/J, law archard</td>";
    assert!(section.contains(row), "{section}");
}
