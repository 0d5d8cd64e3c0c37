//! Tests of `fretwear new`, and of the list of runs by `fretwear status`.

use crate::support::{Bench, Did, copy};

/// `plan` accepts every scene that `new` writes. The new scene has the comments of the shipped scene.
#[test]
fn a_new_scene_is_a_shipped_one_that_runs() {
    let bench = Bench::new();
    let help = bench.done(&["new", "--help"]).stdout();
    let listed = help.split("Scenes to start from:").nth(1).expect("a list");
    let names: Vec<&str> = listed
        .lines()
        .filter_map(|line| line.split_whitespace().next())
        .collect();
    assert!(names.len() >= 6, "{names:?}");
    for name in names {
        let path = format!("mine/{name}");
        let said = bench.done(&["new", &path, "--like", name]).stdout();
        assert!(
            said.contains(&format!("fretwear run mine/{name}.toml")),
            "{said}"
        );
        let shipped = format!("{}/pipelines/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let text = |path: &str| std::fs::read_to_string(path).expect("a scene");
        let written = bench.path(&format!("{path}.toml"));
        // The new file consists of a header with the source, the shipped text, and the command with the path of the new file.
        let command = |path: &str| format!("fretwear run {path}.toml");
        let own = text(&shipped).replacen(
            &command(&format!("pipelines/{name}")),
            &command(&format!("mine/{name}")),
            1,
        );
        let text = text(written.to_str().expect("a path"));
        let head = format!("# The scene {name} that is shipped with fretwear.");
        assert!(text.starts_with(&head) && text.ends_with(&own), "{text}");
        bench.done(&["plan", &format!("{path}.toml"), "--no-rehearsal"]);
    }
}

#[test]
fn values_are_changed_where_they_stand_and_comments_stay() {
    let bench = Bench::new();
    let sets = [
        "--set",
        "contact.normal_load=20 kN",
        "--set",
        "wear.cycles=1e6",
    ];
    bench.done(&[&["new", "mine"][..], &sets].concat());
    let text = std::fs::read_to_string(bench.path("mine.toml")).expect("a scene");
    let shipped = include_str!("../../pipelines/prescribed_fretting.toml");
    let head = "# A new joint, based on the scene prescribed_fretting that is shipped with fretwear.\n#\n#     fretwear run mine.toml\n#\n# Changed keys: contact.normal_load, wear.cycles.";
    assert!(text.starts_with(head) && !text.contains("Armand"), "{text}");
    // The function returns the lines below the header.
    let below = |text: &str| {
        let lines = text.lines().skip_while(|line| line.starts_with('#'));
        lines.map(str::to_owned).collect::<Vec<String>>()
    };
    let pairs: Vec<(String, String)> = below(shipped).into_iter().zip(below(&text)).collect();
    assert_eq!(below(shipped).len(), below(&text).len());
    let changed: Vec<(&str, &str)> = pairs
        .iter()
        .filter(|(from, to)| from != to)
        .map(|(from, to)| (from.as_str(), to.as_str()))
        .collect();
    assert_eq!(
        changed,
        [
            (
                "title = \"Lap joint under prescribed fretting, Rq 5 um\"",
                "title = \"mine\""
            ),
            (
                "normal_load = \"30 kN\"           # the bolt load",
                "normal_load = \"20 kN\"           # the bolt load"
            ),
            (
                "cycles = 10_000_000             # where to stop; `volume = \"1 mm^3\"` stops at a worn volume",
                "cycles = 1e6             # where to stop; `volume = \"1 mm^3\"` stops at a worn volume"
            ),
        ]
    );
    bench.done(&["check", "mine.toml"]);
    // `new` does not write a scene with a wrong key.
    for (set, named) in [
        ("contact.normal_load=20 km", "length"),
        ("joint.hole.diameter=9 mm", "no line of its own"),
    ] {
        let did = bench.fretwear(&["new", "other", "--set", set]);
        assert_eq!(did.code(), 2, "{}", did.stderr());
        assert!(did.stderr().contains(named), "{}", did.stderr());
        assert!(!bench.path("other.toml").exists());
    }
}

/// `new` accepts phrases such as `no hole` and `20 x 30 mm`, and keeps the cell size of the shipped scene.
#[test]
fn a_joint_is_described_as_one_says_it() {
    let bench = Bench::new();
    let sets = [
        "--set",
        "joint.hole=no hole",
        "--set",
        "joint.size=20 x 30 mm",
    ];
    bench.done(&[&["new", "mine"][..], &sets].concat());
    let text = std::fs::read_to_string(bench.path("mine.toml")).expect("a scene");
    assert!(!text.contains("\nhole = "), "{text}");
    assert!(text.contains("size = [\"20 mm\", \"30 mm\"]"), "{text}");
    assert!(text.contains("grid = [128, 192]"), "{text}");
    bench.done(&["check", "mine.toml"]);
}

#[test]
fn a_scene_that_is_there_is_not_replaced() {
    let bench = Bench::new();
    bench.write("mine.toml", "# my own");
    let refused = bench.fretwear(&["new", "mine.toml"]);
    assert_eq!(refused.code(), 1);
    let said = refused.stderr();
    assert!(
        said.contains("mine.toml exists already") && !said.contains("os error"),
        "{said}"
    );
    let kept = std::fs::read_to_string(bench.path("mine.toml")).expect("a file");
    assert_eq!(kept, "# my own");
    let unknown = bench.fretwear(&["new", "other.toml", "--like", "lap"]);
    assert_eq!(unknown.code(), 2);
    assert!(
        unknown.stderr().contains("lap_joint"),
        "{}",
        unknown.stderr()
    );
}

/// `status` lists a run in one line, even if the name of the run contains line breaks.
#[cfg(unix)]
#[test]
fn a_name_of_a_run_stays_on_its_line() {
    let bench = Bench::new();
    let short = ["--quiet", "--set", "wear.cycles=100_000"];
    bench.done(&[&["run", "small.toml", "--run", "runs/a"], &short[..]].concat());
    let names = ["b\nc   done   #9  all is well", "d\te"];
    for name in names {
        copy(&bench.path("runs/a"), &bench.path("runs").join(name));
    }
    let damaged = bench.path("runs/d\te");
    for record in ["run.json", "run.copy.json"] {
        std::fs::write(damaged.join(record), "{").expect("written");
    }
    let listed = bench.done(&["status"]).stdout();
    assert_eq!(listed.lines().count(), 3, "{listed}");
    for name in ["b\\nc   done   #9  all is well", "d\\te"] {
        assert!(listed.contains(name), "{listed}");
    }
    assert!(!listed.contains('\t'), "{listed}");
    if cfg!(feature = "polars") {
        let [b, d] = names.map(|name| format!("runs/{name}"));
        let mut command = bench.command(&["compare", "runs/a", &b, &d]);
        let did = Did(command.env("COLUMNS", "200").output().expect("it runs"));
        let (table, notes) = (did.stdout(), did.stderr());
        let names = table.lines().next().map(str::trim);
        let expected = "runs/a  runs/b\\nc   done   #9  all is well";
        assert_eq!(names, Some(expected), "{table}");
        assert_eq!(notes.lines().count(), 1, "{notes}");
        assert!(notes.contains("runs/d\\te is skipped"), "{notes}");
    }
}

#[test]
fn runs_are_listed_with_their_state() {
    let bench = Bench::new();
    bench.done(&["run", "small.toml", "--run", "runs/a", "--quiet"]);
    bench.fretwear(&[
        "run",
        "small.toml",
        "--run",
        "runs/b",
        "--max-wall",
        "1 us",
        "--quiet",
    ]);
    std::fs::create_dir_all(bench.path("runs/no_run")).expect("a folder");
    let listed = bench.done(&["status"]).stdout();
    let lines: Vec<&str> = listed.lines().collect();
    assert_eq!(lines.len(), 2, "{listed}");
    assert!(
        lines[0].contains("runs/a") && lines[0].contains("done"),
        "{listed}"
    );
    assert!(
        lines[1].contains("runs/b") && lines[1].contains("stopped"),
        "{listed}"
    );
    assert!(
        lines[0].contains("worn") && lines[0].contains('±'),
        "{listed}"
    );
    let nowhere = bench.fretwear(&["status", "nowhere"]);
    assert_eq!(nowhere.code(), 2);
    assert!(nowhere.stderr().contains(
        "there is no run at nowhere, and no folder of runs: `fretwear run SCENE` writes"
    ));
}
