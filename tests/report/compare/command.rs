use super::{STATIC, WORN, compute, damage, summary_file};
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
