//! What the manifest and the README promise of a build, held against the lock file and the packages themselves; pages that the program
//! makes, the links of all pages, and the names that no file may have any more.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};
use std::process::Command;

use regex::Regex;
use serde_json::Value;

use crate::support::Bench;

/// A file of the repository.
fn path(file: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(file)
}

fn read(file: &str) -> String {
    let path = path(file);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// The names of all packages in the lock file: those of every platform, and of the tests.
fn locked() -> BTreeSet<String> {
    let lock: toml::Table = read("Cargo.lock").parse().expect("a lock file");
    let packages = lock["package"].as_array().expect("packages");
    let name = |package: &toml::Value| package["name"].as_str().expect("a name").to_owned();
    packages.iter().map(name).collect()
}

/// Crates that speak to others over a network, or encrypt what they say.
const OF_NETWORKS: [&str; 41] = [
    "async-io",
    "async-std",
    "attohttpc",
    "aws-lc-rs",
    "aws-lc-sys",
    "curl",
    "curl-sys",
    "h2",
    "h3",
    "hickory-resolver",
    "http",
    "http-body",
    "httparse",
    "hyper",
    "hyper-rustls",
    "hyper-tls",
    "hyper-util",
    "isahc",
    "mio",
    "native-tls",
    "object_store",
    "openssl",
    "openssl-sys",
    "polars-async",
    "quinn",
    "reqwest",
    "ring",
    "rustls",
    "rustls-native-certs",
    "rustls-webpki",
    "schannel",
    "security-framework",
    "smol",
    "socket2",
    "tokio",
    "tokio-rustls",
    "tower-http",
    "tungstenite",
    "ureq",
    "url",
    "webpki-roots",
];

#[test]
fn nothing_in_a_build_can_speak_to_a_network() {
    let locked = locked();
    let found: Vec<&&str> = OF_NETWORKS
        .iter()
        .filter(|name| locked.contains(**name))
        .collect();
    assert!(found.is_empty(), "Cargo.lock has {found:?} for it");
    // The list is held against what is read of the lock file.
    assert!(locked.contains("fretwear") && locked.contains("parquet"));
}

/// What cargo prints; it stands beside the tests that it built.
fn cargo(arguments: &[&str]) -> String {
    let output = Command::new(env!("CARGO"))
        .args(arguments)
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{arguments:?}: {said}");
    String::from_utf8(output.stdout).expect("text")
}

/// The numbers of a version, of which the last may be left out.
fn version(text: &str) -> Vec<u64> {
    let numbers = text.split('.').map(|n| n.parse().expect("a number"));
    numbers.chain([0]).take(3).collect()
}

/// Locks of files are in the standard library since then; that the sources need nothing newer than stated is clippy's to say.
const OURS: &str = "1.89";

/// The minimum that is stated is the least that the packages of the lock file allow, this one among them.
#[test]
fn the_stated_rust_suffices() {
    let about = cargo(&["-vV"]);
    let mut lines = about.lines();
    let host = lines.find_map(|line| line.strip_prefix("host: "));
    let platform = format!("--filter-platform={}", host.expect("a platform"));
    // What a build has fetched; packages of other platforms and features are not among it.
    let mut arguments = vec!["metadata", "--format-version=1", "--locked", "--offline"];
    arguments.push(&platform);
    if !cfg!(feature = "polars") {
        arguments.push("--no-default-features");
    }
    let metadata: Value = serde_json::from_str(&cargo(&arguments)).expect("JSON");
    let packages = metadata["packages"].as_array().expect("packages");
    let wanted = packages
        .iter()
        .filter(|package| package["name"] != env!("CARGO_PKG_NAME"))
        .filter_map(|package| {
            let wants = package["rust_version"].as_str()?;
            Some((version(wants), format!("{} wants {wants}", package["name"])))
        })
        .chain([(version(OURS), "the sources want it".to_owned())])
        .max()
        .expect("at least one");
    assert!(packages.len() > 100, "{} packages", packages.len());

    let stated = env!("CARGO_PKG_RUST_VERSION");
    assert_eq!(version(stated), wanted.0, "{stated}, but {}", wanted.1);
    let readme = read("README.md");
    let sentence = format!("a Rust toolchain ({stated} or later)");
    assert!(readme.contains(&sentence), "no {sentence:?} in the README");
}

/// A dependency has the same features for the program and for its tests: else a test build compiles Polars, and this package, again.
#[test]
fn a_test_build_shares_the_dependencies_of_the_program() {
    let packages = |edges: &str| -> BTreeSet<String> {
        let mut arguments = vec!["tree", "--locked", "--offline", "--prefix=none"];
        arguments.extend(["--format={p} {f}", "--edges", edges]);
        let printed = cargo(&arguments);
        let lines = printed.lines().map(|line| line.trim_end_matches(" (*)"));
        lines.map(str::to_owned).collect()
    };
    let (program, tests) = (packages("normal,build"), packages("normal,build,dev"));
    let others: Vec<&String> = program.difference(&tests).collect();
    assert!(
        others.is_empty(),
        "of a test build these differ: {others:?}"
    );
    assert!(program.len() > 100 && tests.len() > program.len());
}

/// Some packages are written in C, and the README says so.
#[test]
fn a_c_compiler_is_named_if_needed() {
    assert_eq!(
        locked().contains("cc"),
        read("README.md").contains("a C compiler")
    );
}

#[test]
fn the_citation_has_the_version_of_the_manifest() {
    let version = format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"));
    assert!(read("CITATION.cff").contains(&version));
}

/// Below 90 MB, most of it Polars; what is not stripped, or not optimised, adds tens of them.
#[cfg(not(debug_assertions))]
#[test]
fn the_program_is_small() {
    const MOST: u64 = 95_000_000;
    let program = std::fs::metadata(env!("CARGO_BIN_EXE_fretwear")).expect("the program");
    assert!(program.len() < MOST, "{} bytes", program.len());
}

#[test]
fn the_python_module_reads_the_layout_that_the_program_writes() {
    let number = format!("\nLAYOUT = {}\n", fretwear::store::LAYOUT);
    assert!(read("src/python/fretwear/_folder.py").contains(&number));
}

/// Pages that the program makes: file, heading, what the page is for, and the arguments that print the rest.
const MADE: [(&str, &str, &str, &[&str]); 2] = [
    (
        "docs/keys.md",
        "# Keys of a scene",
        "This page lists every key of a scene with its type, default and meaning. `fretwear schema KEY` \
         says all about one of them.",
        &["schema", "scene", "--markdown"],
    ),
    (
        "docs/tables.md",
        "# Tables of a run",
        "With this page you can look up every table of a run: its file, when it is written, and the unit, type and meaning of each \
         column.",
        &["schema", "--markdown"],
    ),
];

#[test]
fn the_pages_that_the_program_makes_are_what_it_prints() {
    const REWRITE: &str = "FRETWEAR_REWRITE_PAGES";
    let rewrite = std::env::var_os(REWRITE).is_some();
    let bench = Bench::new();
    let section = Regex::new(r"(?m)^## `(.*)`$").expect("a pattern");
    for (file, heading, about, arguments) in MADE {
        let printed = bench.done(arguments).stdout();
        let printed = printed.trim_end();
        let links: Vec<String> = section
            .captures_iter(printed)
            .map(|found| format!("[`{}`](#{})", &found[1], anchor(&found[1])))
            .collect();
        let page = format!(
            "{heading}\n\n{about} The page is made by `fretwear {}`.\n\n{}\n\n{printed}\n",
            arguments.join(" "),
            links.join(" · ")
        );
        if rewrite {
            std::fs::write(path(file), &page).expect("written");
        }
        assert!(
            read(file) == page,
            "{file} is not what the program prints; write it anew: {REWRITE}=1 cargo test --release --test main -- manifest::the_pages"
        );
    }
}

/// The anchor that forges make of a heading.
fn anchor(heading: &str) -> String {
    let kept = heading.chars().filter_map(|c| match c {
        ' ' => Some('-'),
        '-' | '_' => Some(c),
        _ => c.is_alphanumeric().then_some(c),
    });
    kept.flat_map(char::to_lowercase).collect()
}

/// The files under a folder of the repository that end in `.md`, by their paths from its top.
fn pages_in(folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(path(folder)).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    let pages = names.filter_map(|name| name.into_string().ok());
    let mut pages: Vec<String> = pages
        .filter(|name| name.ends_with(".md"))
        .map(|name| match folder {
            "." => name,
            _ => format!("{folder}/{name}"),
        })
        .collect();
    pages.sort();
    pages
}

/// The README, the changelog, the book, and what stands beside data.
fn pages() -> Vec<String> {
    let folders = [".", "docs", "data"];
    folders.into_iter().flat_map(pages_in).collect()
}

/// A page without its blocks of code.
fn without_blocks(page: &str) -> String {
    let mut in_block = false;
    let kept = page.lines().filter(|line| {
        let is_fence = line.trim_start().starts_with("```");
        in_block ^= is_fence;
        !in_block && !is_fence
    });
    kept.collect::<Vec<_>>().join("\n")
}

/// The anchors of a page's headings; the second of one name has a number.
fn anchors(page: &str) -> BTreeSet<String> {
    let mut count: BTreeMap<String, usize> = BTreeMap::new();
    let text = without_blocks(page);
    let headings = text
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| line.trim_start_matches('#').trim());
    headings
        .map(|heading| {
            let anchor = anchor(heading);
            let before = count.entry(anchor.clone()).or_insert(0);
            *before += 1;
            match *before {
                1 => anchor,
                more => format!("{anchor}-{}", more - 1),
            }
        })
        .collect()
}

/// Where the links of a page lead, as they stand, but for those to other hosts.
fn links(page: &str) -> Vec<String> {
    let code = Regex::new(r"`[^`]*`").expect("a pattern");
    let link = Regex::new(r"\]\(([^)\s]+)\)").expect("a pattern");
    let text = without_blocks(page);
    let text = code.replace_all(&text, "");
    let targets = link.captures_iter(&text).map(|found| found[1].to_owned());
    targets.filter(|target| !target.contains("://")).collect()
}

/// A link of a page as a path from the top of the repository, and the heading that it names.
fn target(page: &str, link: &str) -> (String, Option<String>) {
    let (file, heading) = match link.split_once('#') {
        Some((file, heading)) => (file, Some(heading.to_owned())),
        None => (link, None),
    };
    if file.is_empty() {
        return (page.to_owned(), heading);
    }
    let folder = Path::new(page).parent().expect("a folder");
    let mut parts: Vec<String> = Vec::new();
    for part in folder.join(file).components() {
        match part {
            Component::ParentDir => {
                assert!(parts.pop().is_some(), "{page}: {link} leads out");
            }
            Component::Normal(name) => parts.push(name.to_string_lossy().into_owned()),
            _ => {}
        }
    }
    (parts.join("/"), heading)
}

#[test]
fn every_link_of_the_pages_leads_somewhere() {
    let mut broken = Vec::new();
    let mut followed = 0;
    for page in pages() {
        for link in links(&read(&page)) {
            let (file, heading) = target(&page, &link);
            let leads = path(&file).exists()
                && heading.is_none_or(|heading| anchors(&read(&file)).contains(&heading));
            if !leads {
                broken.push(format!("{page}: {link}"));
            }
            followed += 1;
        }
    }
    assert!(broken.is_empty(), "{broken:#?}");
    // The patterns are held against what they find.
    assert!(followed > 100, "{followed} links");
}

#[test]
fn the_index_of_the_book_names_every_page() {
    const INDEX: &str = "docs/README.md";
    let named: BTreeSet<String> = links(&read(INDEX))
        .iter()
        .map(|link| target(INDEX, link).0)
        .collect();
    let missing: Vec<String> = pages_in("docs")
        .into_iter()
        .filter(|page| page != INDEX && !named.contains(page))
        .collect();
    assert!(missing.is_empty(), "{INDEX} does not name {missing:?}");
}

/// Names that were removed, of commands, features and the like, and what users have in their place. A name counts as a whole word. Whoever
/// removes something with a name of its own adds a row.
const REMOVED: [(&str, &str); 8] = [
    ("object_store", "copy the folder (rsync, rclone)"),
    ("fretwear publish", "copy the folder (rsync, rclone)"),
    ("fretwear fetch", "copy the folder (rsync, rclone)"),
    ("fretwear validate", "fretwear doctor"),
    ("fretwear explain", "fretwear schema WORD"),
    ("fretwear ls", "fretwear status FOLDER"),
    ("old_runs", "nothing: runs of another layout are rejected"),
    ("fretwear::validate", "fretwear::doctor::closed_forms"),
];

/// This list.
const OF_REMOVED: &str = "tests/manifest.rs";
/// Files that may have such names; the other is the history.
const MAY_HAVE_REMOVED: [&str; 2] = ["CHANGELOG.md", OF_REMOVED];

/// The texts that Git tracks, by their paths; `None` outside of a checkout.
fn tracked_texts() -> Option<BTreeMap<String, String>> {
    let mut git = Command::new("git");
    git.args(["ls-files", "-z"])
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    let listed = git.output().ok().filter(|listed| listed.status.success())?;
    let names = String::from_utf8(listed.stdout).expect("names are texts");
    let text_of = |name: &str| Some((name.to_owned(), std::fs::read_to_string(path(name)).ok()?));
    Some(names.split_terminator('\0').filter_map(text_of).collect())
}

/// The lines of a text that have a removed name: number, name, and what is in its place.
fn removed_names(text: &str) -> Vec<(usize, &'static str, &'static str)> {
    let mut found = Vec::new();
    for (name, instead) in REMOVED {
        let pattern = format!(r"\b{{start-half}}{}\b{{end-half}}", regex::escape(name));
        for hit in Regex::new(&pattern).expect("a pattern").find_iter(text) {
            let line = text[..hit.start()].matches('\n').count() + 1;
            found.push((line, name, instead));
        }
    }
    found
}

#[test]
fn nothing_has_a_name_that_was_removed() {
    let Some(texts) = tracked_texts() else { return };
    assert!(texts.len() > 100, "{} texts", texts.len());
    let mut wrong = Vec::new();
    for (file, text) in &texts {
        if !MAY_HAVE_REMOVED.contains(&&**file) {
            let found = removed_names(text).into_iter();
            wrong.extend(found.map(|(line, name, instead)| {
                format!("{file}:{line}: {name} was removed; instead: {instead}")
            }));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
    // The patterns are held against the list itself.
    let own = removed_names(&texts[OF_REMOVED]);
    assert!(
        REMOVED
            .iter()
            .all(|row| own.iter().any(|hit| hit.1 == row.0))
    );
}
