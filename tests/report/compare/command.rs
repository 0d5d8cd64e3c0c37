use super::{STATIC, WORN, compute, damage, summary_file};
use fretwear::stages::Stage;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

fn fretwear(folder: &TempDir, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_fretwear"))
        .args(arguments)
        .current_dir(folder.path())
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

#[test]
fn prints_names_units_and_a_line_a_run() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "worn", WORN, None);
    compute(&folder, "pressed", STATIC, None);
    let output = fretwear(&folder, &["compare", "worn", "pressed"]);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "");

    let lines: Vec<&str> = text(&output.stdout).lines().collect();
    assert_eq!(lines.len(), 4, "{lines:#?}");
    let words = |line: &str| line.split_whitespace().count();
    assert!(lines[0].starts_with("run "));
    assert!(lines[1].contains("[m^3]") && lines[1].contains("[N/m]"));
    assert_eq!(words(lines[2]), words(lines[0]), "{lines:#?}");
    // A static contact has no cycles, wear volume, wear rate and dissipated energy.
    assert_eq!(words(lines[3]) + 4, words(lines[0]), "{lines:#?}");
    // Its figures stand under their names nevertheless.
    let end_of = |line: &str| line.chars().count();
    assert_eq!(end_of(lines[2]), end_of(lines[0]));
    assert_eq!(end_of(lines[3]), end_of(lines[0]));
}

#[test]
fn writes_the_table_too() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "worn", WORN, None);
    let output = fretwear(
        &folder,
        &[
            "compare",
            "--all",
            "worn",
            "--csv",
            "t.csv",
            "--parquet",
            "t.parquet",
        ],
    );
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let csv = std::fs::read_to_string(folder.path().join("t.csv")).unwrap();
    // The printed table has a line of units more.
    assert_eq!(
        csv.lines().count() + 1,
        text(&output.stdout).lines().count()
    );
    let parquet = std::fs::read(folder.path().join("t.parquet")).unwrap();
    assert!(parquet.starts_with(b"PAR1"));
}

#[test]
fn says_by_its_exit_code_what_is_wrong() {
    let folder = TempDir::new().unwrap();
    let absent = fretwear(&folder, &["compare", "absent"]);
    assert_eq!(absent.status.code(), Some(2));
    assert!(text(&absent.stderr).contains("absent"));

    assert_eq!(fretwear(&folder, &["compare"]).status.code(), Some(2));

    let worn = compute(&folder, "worn", WORN, None);
    damage(&summary_file(&worn, 2));
    let damaged = fretwear(&folder, &["compare", "worn"]);
    assert_eq!(damaged.status.code(), Some(4));
    let named = Path::new("worn/iterations/wear_iteration=2/summary.parquet");
    assert!(
        text(&damaged.stderr).contains(named.to_str().unwrap()),
        "{}",
        text(&damaged.stderr)
    );
    assert_eq!(text(&damaged.stdout).lines().count(), 3);
}

/// What `runs/*` may name beside runs: one only begun, an empty folder, a file, and what `reproduce` leaves.
fn foreign(folder: &TempDir) -> [&'static str; 4] {
    compute(folder, "begun", WORN, Some(Stage::Surface));
    std::fs::create_dir(folder.path().join("empty")).unwrap();
    std::fs::write(folder.path().join("letter.txt"), "hello").unwrap();
    std::fs::create_dir_all(folder.path().join("reproduce/scenes")).unwrap();
    ["begun", "empty", "letter.txt", "reproduce"]
}

const REASONS: [&str; 4] = [
    "it has no iteration yet",
    "it has no run.json",
    "it is no folder",
    "it has no run.json",
];

#[test]
fn what_is_no_run_is_passed_over() {
    let folder = TempDir::new().unwrap();
    let foreign = foreign(&folder);
    compute(&folder, "pressed", STATIC, None);
    let notes: String = foreign
        .iter()
        .zip(REASONS)
        .map(|(path, reason)| format!("note: {path} is passed over: {reason}\n"))
        .collect();
    for (command, lines) in [("compare", 3), ("report", 1)] {
        let output = fretwear(&folder, &[&[command][..], &foreign, &["pressed"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert_eq!(text(&output.stderr), notes);
        let said = text(&output.stdout);
        assert_eq!(said.lines().count(), lines, "{said}");
        assert_eq!(said.contains("\npressed "), command == "compare", "{said}");
    }
    // Several were asked for, so that the page is not in the folder of the one that is left.
    assert!(folder.path().join("report.html").is_file());
}

#[test]
fn nothing_left_is_an_error_that_says_why() {
    let folder = TempDir::new().unwrap();
    let foreign = foreign(&folder);
    for command in ["compare", "report"] {
        let output = fretwear(&folder, &[&[command][..], &foreign].concat());
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        assert!(said.starts_with("error: no run to read among 4 "), "{said}");
        for (path, reason) in foreign.iter().zip(REASONS) {
            assert!(said.contains(&format!("{path}: {reason}")), "{said}");
        }
        assert_eq!(text(&output.stdout), "");
    }
}

#[test]
fn a_path_that_is_not_there_is_no_folder_to_pass_over() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "pressed", STATIC, None);
    for command in ["compare", "report"] {
        let output = fretwear(&folder, &[command, "pressed", "presed"]);
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains("error: there is no run at presed"));
    }
}

#[test]
fn a_run_that_damage_closes_is_passed_over_but_not_forgotten() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "pressed", STATIC, None);
    let torn = compute(&folder, "torn", STATIC, None);
    for record in ["run.json", "run.copy.json"] {
        std::fs::write(torn.join(record), "{").unwrap();
    }
    let first = compute(&folder, "first", STATIC, None);
    damage(&summary_file(&first, 0));
    for command in ["compare", "report"] {
        let output = fretwear(&folder, &[command, "torn", "pressed", "first"]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(4), "{said}");
        for part in [
            "note: torn is passed over: damaged run: torn/run.json",
            "note: first is passed over: none of its iterations verifies: first/iterations/",
        ] {
            assert!(said.contains(part), "{said}");
        }
        assert_ne!(text(&output.stdout), "");

        // Alone or with nothing left beside it, it is an error.
        for runs in [&["torn"][..], &["first"], &["torn", "first"]] {
            let output = fretwear(&folder, &[&[command][..], runs].concat());
            assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
            assert!(text(&output.stderr).starts_with("error: "));
        }
    }
}
