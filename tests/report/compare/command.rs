use super::{STATIC, WORN, compute, damage, summary_file};
use fretwear::report::{RunTables, numeric_column, percent};
use fretwear::stages::Stage;
use fretwear::tables::TableName;
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Output};
use tempfile::TempDir;

use crate::support::{RESONATOR, copy};

fn fretwear(folder: &TempDir, arguments: &[&str]) -> Output {
    at_width(folder, None, arguments)
}

/// Runs the program in a terminal of the given width.
fn at_width(folder: &TempDir, width: Option<usize>, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_fretwear"));
    command.args(arguments).current_dir(folder.path());
    match width {
        Some(width) => command.env("COLUMNS", width.to_string()),
        None => command.env_remove("COLUMNS"),
    };
    command.output().unwrap()
}

fn text(bytes: &[u8]) -> &str {
    std::str::from_utf8(bytes).unwrap()
}

/// Cells of a table line: at least two spaces separate them.
fn cells(line: &str) -> Vec<&str> {
    let cells = line.split("  ").map(str::trim);
    cells.filter(|cell| !cell.is_empty()).collect()
}

/// Cells of the line of a figure, one per run.
fn figure<'a>(table: &'a str, title: &str) -> Vec<&'a str> {
    let line = table.lines().find(|line| line.starts_with(title));
    cells(line.unwrap_or_else(|| panic!("{title} is missing in {table}")))[1..].to_vec()
}

#[test]
fn few_runs_stand_beside_each_other_with_units_and_error_bars() {
    let folder = TempDir::new().unwrap();
    let vibrating = compute(&folder, "vibrating", RESONATOR, None);
    compute(&folder, "worn", WORN, None);
    compute(&folder, "pressed", STATIC, None);
    let runs = ["compare", "vibrating", "worn", "pressed"];
    let output = at_width(&folder, Some(120), &runs);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    assert_eq!(text(&output.stderr), "");
    let table = text(&output.stdout);
    assert_eq!(cells(table.lines().next().unwrap()), runs[1..]);

    // The table and the report quote the resonance with the contact elements of the worn joint, not the resonance that drives the wear.
    let run = RunTables::open(&vibrating).unwrap();
    let of = |table: TableName, column: &str| {
        let frame = run.iteration_table(run.latest(), table).unwrap().unwrap();
        numeric_column(&frame, column).unwrap()[0]
    };
    let own = format!("{:.1}", of(TableName::WornResponse, "resonance_frequency"));
    let driving = format!("{:.1}", of(TableName::Summary, "resonance_frequency"));
    assert_ne!(own, driving);
    let bar = percent(of(TableName::Summary, "error_resonance_frequency"));
    let expected = format!("{own} ± {bar}");
    assert_eq!(figure(table, "resonance [Hz]"), [&expected, "–", "–"]);
    let amplitude = 1e6 * of(TableName::WornResponse, "resonance_amplitude");
    let found = figure(table, "amplitude at resonance [µm]")[0];
    assert!(found.starts_with(&format!("{amplitude:.2} ± ")), "{found}");

    // Figures of wear have an error bar. A run with static contact has no such figures.
    for title in ["worn volume [mm³]", "friction of a cycle [mJ]"] {
        let found = figure(table, title);
        assert!(
            found[1].contains(" ± ") && found[1].ends_with('%'),
            "{table}"
        );
        assert_eq!(found[2], "–", "{table}");
    }
    for title in ["largest pressure [MPa]", "stiffness kn [N/µm]"] {
        assert!(!figure(table, title).contains(&"–"), "{table}");
    }
}

/// `compare` and `status` count the transforms of all stages.
#[test]
fn fft_pairs_are_those_that_the_run_reports() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "vibrating", RESONATOR, None);
    compute(&folder, "pressed", STATIC, None);
    let output = fretwear(
        &folder,
        &["compare", "vibrating", "pressed", "--csv", "t.csv"],
    );
    let found = figure(text(&output.stdout), "FFT pairs");
    for (run, found) in ["vibrating", "pressed"].iter().zip(&found) {
        let status = fretwear(&folder, &["status", run, "--json"]);
        let status: serde_json::Value = serde_json::from_slice(&status.stdout).unwrap();
        let pairs = status["cost"]["fft_pairs"].as_f64().unwrap();
        assert_eq!(*found, format!("{pairs:.0}"));
        let status = fretwear(&folder, &["status", run]);
        let told = format!("{found} FFT pairs, ");
        assert!(text(&status.stdout).contains(&told), "{told}");
    }
    // The files contain the sums of the summaries. A summary counts only the transforms of contact, cycle and wear step.
    let mut csv = csv::Reader::from_path(folder.path().join("t.csv")).unwrap();
    let row = csv.records().next().unwrap().unwrap();
    let of_summaries: f64 = row[row.len() - 1].parse().unwrap();
    assert!(of_summaries + 10.0 < found[0].parse().unwrap(), "{found:?}");

    // With `--all`, the table has one row per iteration, and the rows sum to the total.
    let output = at_width(&folder, Some(400), &["compare", "vibrating", "--all"]);
    let rows = text(&output.stdout).lines();
    let rows = rows.filter(|line| line.starts_with("vibrating@"));
    let pairs = rows.map(|line| cells(line).last().unwrap().parse::<f64>().unwrap());
    let (count, sum) = pairs.fold((0.0, 0.0), |(n, sum), pairs| (n + 1.0, sum + pairs));
    let whole: f64 = found[0].parse().unwrap();
    assert!(
        count > 2.0 && (sum - whole).abs() <= 0.5 * (count + 1.0),
        "{sum} of {whole}"
    );
}

/// Figures and row labels of a table, which do not depend on the width. Heads are words, and labels have another form.
fn numbers_in(table: &str) -> BTreeSet<&str> {
    let is_number =
        |cell: &&str| cell.starts_with(|c: char| c.is_ascii_digit() || "−–".contains(c));
    let is_limit = |cell: &&str| cell.starts_with("below ");
    let cells = table.lines().flat_map(cells);
    cells
        .filter(|cell| is_number(cell) || is_limit(cell))
        .collect()
}

#[test]
fn no_line_is_longer_than_the_terminal_and_no_number_is_cut() {
    let folder = TempDir::new().unwrap();
    let vibrating = compute(&folder, "a", RESONATOR, None);
    let worn = compute(&folder, "b", WORN, None);
    compute(&folder, "c", STATIC, None);
    for (k, name) in ["d", "e", "f", "g", "h", "i"].iter().enumerate() {
        copy([&vibrating, &worn][k % 2], &folder.path().join(name));
    }
    let nine = ["a", "b", "c", "d", "e", "f", "g", "h", "i"];
    for runs in [&nine[..1], &nine[..2], &nine] {
        for all in [&[][..], &["--all"]] {
            let arguments = [&["compare"][..], runs, all].concat();
            let whole = at_width(&folder, Some(1000), &arguments).stdout;
            let expected = numbers_in(text(&whole));
            assert!(expected.len() > 10, "{expected:?}");
            for width in [Some(50), Some(80), Some(120), Some(200), None] {
                let table = at_width(&folder, width, &arguments).stdout;
                let table = text(&table);
                let longest = table.lines().map(|line| line.chars().count()).max();
                assert!(longest <= Some(width.unwrap_or(80)), "{table}");
                assert_eq!(numbers_in(table), expected, "{table}");
            }
        }
    }
    // The runs are columns of one table if the width suffices.
    let beside = |width, runs: &[&str]| {
        let table = at_width(&folder, Some(width), &[&["compare"][..], runs].concat());
        cells(text(&table.stdout).lines().next().unwrap()) == runs
    };
    assert!(beside(80, &nine[..2]) && beside(400, &nine) && !beside(80, &nine));
}

/// The table wraps the name of a run without loss of letters.
#[test]
fn a_long_name_is_wrapped() {
    let folder = TempDir::new().unwrap();
    let long = "x".repeat(70);
    let path = format!("studies/{long}");
    compute(&folder, &path, STATIC, None);
    let table = at_width(&folder, Some(60), &["compare", &path, &path]).stdout;
    let table = text(&table);
    assert!(
        table.lines().all(|line| line.chars().count() <= 60),
        "{table}"
    );
    let heads = table
        .lines()
        .take_while(|line| !line.starts_with("iteration"));
    let heads: Vec<Vec<&str>> = heads.map(cells).collect();
    let name: String = heads.iter().map(|line| line[0]).collect();
    assert_eq!(name, path, "{table}");
}

#[test]
fn writes_the_table_too() {
    let folder = TempDir::new().unwrap();
    compute(&folder, "worn", WORN, None);
    let arguments = [
        "compare",
        "--all",
        "worn",
        "--csv",
        "t.csv",
        "--parquet",
        "t.parquet",
    ];
    let output = at_width(&folder, Some(400), &arguments);
    assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
    let csv = std::fs::read_to_string(folder.path().join("t.csv")).unwrap();
    let printed = text(&output.stdout).lines();
    let printed = printed.filter(|line| line.starts_with("worn@"));
    assert_eq!(csv.lines().count(), printed.count() + 1);
    // Other programs read the CSV file. The layout of the printed table does not change it.
    assert_eq!(
        csv.lines().next(),
        Some(
            "run,wear_iteration,cycles,wear_volume,largest_depth,wear_rate,dissipated_energy,normal_load,contact_area_fraction,\
             loaded_area_fraction,max_pressure,kn,kt,rq,sk,ku,fft_pairs"
        )
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
    assert_eq!(figure(text(&damaged.stdout), "iteration"), ["1"]);
}

/// Entries that `runs/*` may name besides runs: a run without iterations, an empty folder, a file, and a folder of `reproduce`.
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
    "it is not a folder",
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
        .map(|(path, reason)| format!("note: {path} is skipped: {reason}\n"))
        .collect();
    for command in ["compare", "report"] {
        let output = fretwear(&folder, &[&[command][..], &foreign, &["pressed"]].concat());
        assert_eq!(output.status.code(), Some(0), "{}", text(&output.stderr));
        assert_eq!(text(&output.stderr), notes);
        let said = text(&output.stdout);
        match command {
            "compare" => assert_eq!(said.lines().next().map(str::trim), Some("pressed")),
            _ => assert_eq!(said.lines().count(), 1, "{said}"),
        }
    }
    // The command named several runs. The page is therefore outside the folder of the only readable run.
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
        assert!(
            said.starts_with("error: no readable run among 4 "),
            "{said}"
        );
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
            "note: torn is skipped: damaged run: torn/run.json",
            "note: first is skipped: none of its iterations verifies: first/iterations/",
        ] {
            assert!(said.contains(part), "{said}");
        }
        assert_ne!(text(&output.stdout), "");

        // A command without any readable run fails.
        for runs in [&["torn"][..], &["first"], &["torn", "first"]] {
            let output = fretwear(&folder, &[&[command][..], runs].concat());
            assert_eq!(output.status.code(), Some(4), "{}", text(&output.stderr));
            assert!(text(&output.stderr).starts_with("error: "));
        }
    }
}
