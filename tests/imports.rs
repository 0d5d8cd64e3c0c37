//! Checks the order of the imports: numerics import no scene, store, table or file, and each library is named in one place.
//!
//! The test reads the sources as text. Every path in a `use` and every full path in the code counts. Comments do not count.

use std::fs;
use std::path::{Path, PathBuf};

use fretwear::tables::{TableLocation, TableName};
use regex::Regex;

/// File of `src/`: its path with `/`, its text, and its code without comments and strings.
struct Source {
    path: String,
    text: String,
    code: String,
}

fn sources() -> Vec<Source> {
    fn walk(folder: &Path, into: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, into);
            } else if path.extension().is_some_and(|e| e == "rs") {
                into.push(path);
            }
        }
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut paths = Vec::new();
    walk(&root, &mut paths);
    paths.sort();
    paths
        .into_iter()
        .map(|path| {
            let text = fs::read_to_string(&path).expect("a source");
            Source {
                path: path
                    .strip_prefix(&root)
                    .expect("below")
                    .to_string_lossy()
                    .replace('\\', "/"),
                code: code(&text),
                text,
            }
        })
        .collect()
}

/// Lines without `//` comments and without quoted text.
fn code(text: &str) -> String {
    let mut code = String::new();
    for line in text.lines() {
        let mut quoted = false;
        let mut bare = String::new();
        let mut characters = line.chars().peekable();
        while let Some(c) = characters.next() {
            match c {
                '\\' if quoted => drop(characters.next()),
                '"' => quoted = !quoted,
                '/' if !quoted && characters.peek() == Some(&'/') => break,
                c if !quoted => bare.push(c),
                _ => (),
            }
        }
        code += &bare;
        code.push('\n');
    }
    code
}

/// True if the code contains the path as whole words.
fn names(code: &str, path: &str) -> bool {
    let word = |c: char| c.is_alphanumeric() || c == '_';
    code.match_indices(path).any(|(at, _)| {
        let before = code[..at].chars().next_back();
        let after = code[at + path.len()..].chars().next();
        !before.is_some_and(|c| word(c) || c == ':') && !after.is_some_and(word)
    })
}

/// Modules of the crate that a file names, from `crate::x`, `fretwear::x`, `use crate::{x, y}` and enough `super::`.
fn modules(source: &Source) -> Vec<String> {
    const MODULES: [&str; 32] = [
        "campaign",
        "cli",
        "contact",
        "doctor",
        "fft",
        "files",
        "gauge",
        "grid",
        "journal",
        "json",
        "linalg",
        "material",
        "milestones",
        "model_update",
        "progress",
        "recipe",
        "reference",
        "rehearsal",
        "report",
        "scene",
        "stages",
        "store",
        "structure",
        "study",
        "dynamics",
        "surface",
        "tables",
        "terminal",
        "threads",
        "units",
        "vtu",
        "wear",
    ];
    let depth = source.path.matches('/').count();
    let depth = if source.path.ends_with("mod.rs") {
        depth
    } else {
        depth + 1
    };
    let roots = [
        "crate".to_owned(),
        "fretwear".to_owned(),
        vec!["super"; depth].join("::"),
    ];
    let mut found = Vec::new();
    for root in roots {
        for module in MODULES {
            if names(&source.code, &format!("{root}::{module}")) {
                found.push(module.to_owned());
            }
        }
        // In a list, each item begins with a module, up to the closing brace.
        for (at, opening) in source.code.match_indices(&format!("{root}::{{")) {
            let list = &source.code[at + opening.len()..];
            let mut level = 0;
            let mut item = String::new();
            for c in list.chars() {
                match c {
                    '{' => level += 1,
                    '}' if level == 0 => break,
                    '}' => level -= 1,
                    ',' if level == 0 => {
                        found.push(std::mem::take(&mut item));
                    }
                    c if level == 0 => item.push(c),
                    _ => (),
                }
            }
            found.push(item);
        }
    }
    found
        .iter()
        .map(|item| {
            item.trim()
                .split("::")
                .next()
                .unwrap_or_default()
                .to_owned()
        })
        .filter(|item| MODULES.contains(&item.as_str()))
        .collect()
}

/// Allowed imports of each part of the crate, by the first matching prefix of the path.
const MAY_IMPORT: &[(&str, &[&str])] = &[
    ("files.rs", &[]),
    ("gauge.rs", &[]),
    ("grid.rs", &[]),
    ("journal.rs", &[]),
    ("json.rs", &[]),
    ("material.rs", &[]),
    ("threads.rs", &[]),
    ("units.rs", &[]),
    ("units/", &[]),
    ("fft/", &["gauge", "fft"]),
    ("linalg/", &["linalg"]),
    ("contact/", &["gauge", "grid", "fft", "material", "contact"]),
    ("structure/readers/", &["files", "structure"]),
    ("structure/", &["linalg", "material", "structure"]),
    (
        "dynamics/",
        &[
            "gauge",
            "journal",
            "linalg",
            "structure",
            "threads",
            "dynamics",
        ],
    ),
    ("milestones/", &["store", "tables", "units", "milestones"]),
    ("model_update/", &["grid", "contact", "model_update"]),
    (
        "surface/readers/",
        &["files", "grid", "surface", "tables", "units"],
    ),
    ("surface/", &["grid", "fft", "surface"]),
    ("reference/", &["grid", "contact", "reference"]),
    ("wear/", &["grid", "contact", "linalg", "wear"]),
    (
        "campaign/",
        &[
            "campaign",
            "files",
            "json",
            "milestones",
            "store",
            "tables",
            "units",
        ],
    ),
    ("tables/", &["tables"]),
    ("store/", &["json", "tables", "store"]),
    (
        "recipe/",
        &[
            "contact",
            "dynamics",
            "gauge",
            "grid",
            "journal",
            "model_update",
            "recipe",
            "structure",
            "surface",
            "threads",
            "wear",
        ],
    ),
    (
        "scene/",
        &[
            "files",
            "recipe",
            "tables",
            "grid",
            "json",
            "material",
            "units",
            "fft",
            "contact",
            "surface",
            "wear",
            "structure",
            "dynamics",
            "model_update",
            "scene",
        ],
    ),
    (
        "rehearsal/",
        &[
            "contact",
            "fft",
            "gauge",
            "recipe",
            "rehearsal",
            "scene",
            "stages",
            "store",
            "surface",
            "tables",
        ],
    ),
    (
        "report/",
        &[
            "campaign",
            "json",
            "milestones",
            "recipe",
            "scene",
            "stages",
            "tables",
            "store",
            "report",
        ],
    ),
    ("study/", &["recipe", "tables", "report", "study"]),
    ("vtu.rs", &["grid", "tables"]),
    (
        "doctor/",
        &[
            "grid",
            "contact",
            "dynamics",
            "fft",
            "linalg",
            "reference",
            "tables",
            "store",
            "doctor",
        ],
    ),
    (
        "stages/",
        &[
            "gauge",
            "grid",
            "threads",
            "journal",
            "linalg",
            "recipe",
            "contact",
            "surface",
            "wear",
            "structure",
            "dynamics",
            "model_update",
            "tables",
            "store",
            "stages",
        ],
    ),
];

#[test]
fn imports_run_one_way() {
    let mut parts = std::collections::BTreeSet::new();
    for source in sources() {
        let Some((part, allowed)) = MAY_IMPORT
            .iter()
            .find(|(part, _)| source.path.starts_with(part))
        else {
            let edge = ["cli/", "lib.rs", "main.rs", "progress/", "terminal.rs"];
            assert!(
                edge.iter().any(|edge| source.path.starts_with(edge)),
                "{} has no place in the order of imports",
                source.path
            );
            continue;
        };
        parts.insert(*part);
        for module in modules(&source) {
            assert!(
                allowed.contains(&module.as_str()),
                "src/{} imports {module}; it may import {allowed:?}",
                source.path
            );
        }
    }
    for part in [
        "contact/", "surface/", "wear/", "scene/", "store/", "stages/",
    ] {
        assert!(parts.contains(part), "{part} was not read");
    }
}

/// A run is computed from its recipe. The user writes the scene, and the program converts the scene once.
#[test]
fn outside_of_its_room_and_the_command_line_nothing_reads_a_scene() {
    let sources = sources();
    let readers: Vec<&str> = sources
        .iter()
        .filter(|source| {
            !["scene/", "cli/"]
                .iter()
                .any(|room| source.path.starts_with(room))
        })
        .filter(|source| names(&source.code, "Scene"))
        .map(|source| source.path.as_str())
        .collect();
    assert_eq!(readers, Vec::<&str>::new());
}

/// Files that may name a library or a part of the standard library.
const NAMED_IN: &[(&[&str], &[&str])] = &[
    (&["rayon"], &["fft/", "threads.rs"]),
    (&["rustfft"], &["fft/"]),
    (&["faer", "pulp"], &["linalg/"]),
    // A foreign table of heights has no schema of this program, so `tables` cannot read the table.
    (
        &[
            "arrow_array",
            "arrow_schema",
            "parquet::arrow",
            "parquet::file",
            "parquet::basic",
        ],
        &["tables/", "surface/readers/parquet.rs"],
    ),
    (&["polars"], &["report/", "study/"]),
    (&["shlex"], &["report/text.rs", "cli/commands.rs"]),
    (&["colorous"], &["report/plot/"]),
    (&["maud"], &["report/", "study/claims/write.rs"]),
    (&["png"], &["report/plot/"]),
    (&["base64"], &["report/plot/", "report/script.rs"]),
    (
        &["sha2"],
        &["report/script.rs", "structure/readers/neutral.rs"],
    ),
    (&["clap", "clap_complete"], &["cli/"]),
    (&["signal_hook"], &["progress/"]),
    (&["indicatif"], &["progress/"]),
    (
        &["blake3"],
        &[
            "campaign/table.rs",
            "journal.rs",
            "json.rs",
            "store/",
            "scene/plan/files.rs",
        ],
    ),
    (&["fs4"], &["store/file_system.rs"]),
    (
        &["rustix"],
        &[
            "stages/clock.rs",
            "cli/campaign/",
            "progress/stopping.rs",
            "terminal.rs",
        ],
    ),
    (
        &["toml"],
        &["scene/", "tables/", "campaign/", "cli/edit.rs"],
    ),
    (&["sobol_burley", "statrs"], &["campaign/"]),
    (&["quick_xml"], &["surface/readers/", "vtu.rs"]),
    (&["vtkio"], &["vtu.rs"]),
    (
        &["npyz", "zip::"],
        &[
            "structure/matrix_files.rs",
            "structure/readers/",
            "surface/readers/",
        ],
    ),
    (
        &["flate2"],
        &["structure/readers/", "surface/readers/sur.rs"],
    ),
    (&["encoding_rs"], &["surface/readers/"]),
    (
        &[
            "std::fs",
            "fs::read",
            "fs::write",
            "File::open",
            "File::create_new",
        ],
        &[
            "files.rs",
            "store/file_system.rs",
            "scene/document.rs",
            "report/",
            "cli/cost.rs",
            "cli/export.rs",
            "cli/export_reduced.rs",
            "cli/export_vtu.rs",
            "cli/new.rs",
            "cli/backbone.rs",
            "cli/stage.rs",
            "terminal.rs",
        ],
    ),
    // These macros panic if the output fails. Text for a terminal must not contain control sequences.
    (
        &[
            "println!",
            "print!",
            "eprintln!",
            "eprint!",
            "dbg!",
            "std::io::stdout",
            "std::io::stderr",
            "io::stdout",
            "io::stderr",
            "stdout",
            "stderr",
        ],
        // The second file prints the output of the processes that a campaign starts.
        &["terminal.rs", "cli/campaign/jobs.rs"],
    ),
    // Only the outer modules read the environment of the program.
    (
        &["std::env", "std::process"],
        &[
            "cli/",
            "main.rs",
            "progress/",
            // The program starts a viewer without the terminal.
            "terminal.rs",
            "store/record.rs",
            "store/file_system.rs",
            // Two processes must not write into one draft.
            "store/cache.rs",
            "campaign/folder.rs",
            "doctor/disk.rs",
            "report/output.rs",
        ],
    ),
    // The clock does not influence any result.
    (
        &["std::time"],
        &[
            // The journal stores results at time intervals that do not influence any result.
            "journal.rs",
            "cli/",
            "progress/",
            "stages/clock.rs",
            "store/date.rs",
            "store/file_system.rs",
            "doctor/machine.rs",
            "rehearsal/mod.rs",
        ],
    ),
];

#[test]
fn each_library_has_its_place() {
    let sources = sources();
    for (libraries, places) in NAMED_IN {
        for library in *libraries {
            for source in &sources {
                assert!(
                    !names(&source.code, library)
                        || places.iter().any(|place| source.path.starts_with(place)),
                    "src/{} names {library}, which belongs to {places:?}",
                    source.path
                );
            }
        }
    }
}

/// Path components of a run folder in the strings of a source: file names, and folders that are joined or next to a slash.
fn parts_of_runs(text: &str) -> Vec<String> {
    let tables = TableName::ALL.iter();
    let tables = tables.filter(|table| table.schema().place != TableLocation::Beside);
    let tables: Vec<String> = tables.map(|table| table.file_name()).collect();
    let files = tables.join("|").replace('.', r"\.");
    let parts = [
        r#"join\(\s*"(once|iterations|staging|damaged|scene\.toml|log\.txt)""#.to_owned(),
        r#"["}](once|iterations|staging)/[^"\s]*""#.to_owned(),
        r#"/(once|iterations|staging)/|wear_iteration="#.to_owned(),
        r#"["/](run|run\.copy|plan|commit|schemas|failure|copying)\.json""#.to_owned(),
        r#"["/](scene\.original\.toml|history\.parquet)""#.to_owned(),
        format!(r#"(/|join\(\s*")({files})""#),
    ];
    let parts = Regex::new(&parts.join("|"));
    let lines = text
        .lines()
        .filter(|line| !line.trim_start().starts_with("//"));
    let code = lines.collect::<Vec<_>>().join("\n");
    let parts = parts.expect("a pattern");
    parts
        .find_iter(&code)
        .map(|part| part.as_str().to_owned())
        .collect()
}

#[test]
fn the_store_alone_knows_where_a_run_keeps_its_files() {
    for source in sources() {
        let knows = ["store/", "python/"];
        if !knows.iter().any(|room| source.path.starts_with(room)) {
            let found = parts_of_runs(&source.text);
            assert!(found.is_empty(), "src/{} spells {found:?}", source.path);
        }
    }
    for text in [
        "run.join(\"once\")",
        "[\"run.json\"]",
        "\"iterations/wear_iteration=3\"",
        "\"{}/once/{table}.parquet\"",
        "run.join(\"summary.parquet\")",
    ] {
        assert!(!parts_of_runs(text).is_empty(), "{text}");
    }
    let words = "// \"run.json\"\n(\"once\", \"once/{}: ok\", \"it has no run.json\")";
    assert!(parts_of_runs(words).is_empty());
}

/// The test recognizes imports correctly.
#[test]
fn what_counts_as_an_import() {
    let source = |path: &str, text: &str| Source {
        path: path.to_owned(),
        text: text.to_owned(),
        code: code(text),
    };
    let at = |path, text| modules(&source(path, text));
    assert_eq!(
        at("wear/joint.rs", "use crate::contact::normal;"),
        ["contact"]
    );
    assert_eq!(
        at("wear/joint.rs", "use super::super::store::Draft;"),
        ["store"]
    );
    assert_eq!(at("wear/mod.rs", "use super::scene::Scene;"), ["scene"]);
    assert!(at("wear/joint.rs", "use super::scene::Scene;").is_empty());
    assert_eq!(
        at("wear/joint.rs", "use crate::{grid::{Grid, Patch}, tables};"),
        ["grid", "tables"]
    );
    assert!(
        at(
            "wear/joint.rs",
            "// crate::store\nlet a = \"crate::store\";"
        )
        .is_empty()
    );
    assert!(at("wear/joint.rs", "use crate::storehouse;").is_empty());
    assert!(names("use rustfft::Fft;", "rustfft") && !names("my_rustfft()", "rustfft"));
}

/// One file distinguishes the kinds of something, so a new kind is added in one place. The same file contains their names in a scene.
#[test]
fn each_kind_is_matched_in_one_file() {
    const KINDS: [(&[&str], &[&str]); 7] = [
        (
            &["StructureSource::", "Structure::"],
            &["recipe/structure.rs"],
        ),
        (
            &["Heights::", "Surface::"],
            &["recipe/surface.rs", "scene/resolve/surface.rs"],
        ),
        (&["Scheme::"], &["wear/scheme.rs", "scene/keys/cycles.rs"]),
        (
            &["Preset::"],
            &[
                "scene/keys/fidelity.rs",
                "scene/reader.rs",
                "scene/resolve/cycles.rs",
            ],
        ),
        (
            &["Coupling::"],
            &[
                "contact/pair.rs",
                "recipe/contact.rs",
                "scene/plan/rough.rs",
                "wear/joint.rs",
            ],
        ),
        (&["Cells::"], &["recipe/surface.rs", "scene/plan/rough.rs"]),
        (
            &["FrictionLaw::"],
            &["dynamics/slider.rs", "scene/keys/dynamics.rs"],
        ),
    ];
    for (kinds, places) in KINDS {
        for source in sources() {
            for kind in kinds {
                let found = source.code.match_indices(kind).any(|(at, _)| {
                    let before = source.code[..at].chars().next_back();
                    let after = source.code[at + kind.len()..].chars().next();
                    let whole = !before.is_some_and(|c| c.is_alphanumeric() || c == ':');
                    // An uppercase first letter marks a kind. A lowercase first letter marks a function.
                    whole && after.is_some_and(char::is_uppercase)
                });
                assert!(
                    !found || places.contains(&source.path.as_str()),
                    "src/{} distinguishes kinds of {kind}, which belongs to {places:?}",
                    source.path
                );
            }
        }
    }
}
