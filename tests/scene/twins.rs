//! Each number has one source: no other type repeats the fields of a type of the recipe. Such fields would be copies by hand.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::Path;

/// Types of modules that do not use the recipe, and types for printing.
const WITHOUT_RECIPE: [&str; 18] = [
    "Duffing",
    "ElementParameters",
    "ImportedStructure",
    "InspectArguments",
    "JenkinsOscillator",
    "Matrices",
    "Options<'a>",
    "Oscillator",
    "ReadOptions",
    "Resonance",
    "RunIdentity",
    "RunRecord",
    "SecondOrder",
    "SecondOrderCore",
    "Setting",
    "Sliders",
    "Spectrum",
    "Superelement",
];

/// Field names of each type in a source text. The variants of an enumeration have names like `Type::Variant`.
fn fields(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let mut found: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    let (mut outer, mut name) = (None, String::new());
    for line in text.lines() {
        let word = line.trim_start();
        let indent = line.len() - word.len();
        let word = word.strip_prefix("pub(super) ").unwrap_or(word);
        let word = word.strip_prefix("pub ").unwrap_or(word);
        let of = |kind: &str| word.strip_prefix(kind)?.strip_suffix(" {");
        match (indent, of("struct "), of("enum "), &outer) {
            (0, Some(of), ..) | (0, _, Some(of), _) => {
                name = of.to_owned();
                outer = Some(name.clone());
            }
            (0, ..) => outer = None,
            (4, .., Some(outer)) if word.ends_with(" {") => {
                name = format!("{outer}::{}", word.trim_end_matches(" {"));
            }
            (.., Some(_)) => {
                let field = word.split_once(": ").map(|split| split.0);
                let is_name = |field: &&str| {
                    let mut letters = field.chars();
                    letters.all(|c| c.is_ascii_lowercase() || c == '_' || c.is_ascii_digit())
                };
                if let Some(field) = field.filter(is_name) {
                    found
                        .entry(name.clone())
                        .or_default()
                        .insert(field.to_owned());
                }
            }
            _ => {}
        }
    }
    found
}

/// All types in the source files below a folder.
fn types(folder: &Path) -> Vec<(String, BTreeSet<String>)> {
    let entries = fs::read_dir(folder).expect("a folder");
    let paths = entries.map(|entry| entry.expect("an entry").path());
    paths
        .flat_map(|path| match path.is_dir() {
            true => types(&path),
            false => {
                let text = fs::read_to_string(&path).expect("a source file");
                fields(&text).into_iter().collect()
            }
        })
        .collect()
}

#[test]
fn no_type_repeats_the_fields_of_one_of_the_recipe() {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let of_recipe = types(&source.join("recipe"));
    assert!(
        of_recipe
            .iter()
            .any(|(name, fields)| name == "Conditions" && fields.len() == 6)
    );
    let mut twins = Vec::new();
    for (name, fields) in types(&source) {
        let base = name.split(':').next().unwrap_or(&name);
        for (other, of_other) in &of_recipe {
            let same: Vec<&String> = fields.intersection(of_other).collect();
            let is_own = of_recipe.iter().any(|own| own.0 == name && own.1 == fields);
            if same.len() >= 3 && !is_own && !WITHOUT_RECIPE.contains(&base) {
                twins.push(format!("{name} and {other} of the recipe have {same:?}"));
            }
        }
    }
    assert!(twins.is_empty(), "{twins:#?}");
}
