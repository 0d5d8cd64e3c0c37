//! What an enemy writes into a bucket is neither believed nor written outside of the folder.

use std::fs;

use fretwear::published::PublishError;
use serde_json::{Value, json};

use super::memory::Memory;
use super::{MANIFEST, fetch, files, histories, publish};

/// Longer than any `published.json` that is read.
const HUGE: usize = (64 << 20) + 1;

fn manifest(memory: &Memory) -> Value {
    serde_json::from_slice(&memory.all()[MANIFEST]).expect("JSON")
}

fn set(memory: &Memory, manifest: &Value) {
    memory.set(MANIFEST, manifest.to_string().into_bytes());
}

fn damaged(memory: &Memory, to: &std::path::Path, says: &str) {
    let error = fetch(memory, to).expect_err("not as published");
    assert!(matches!(error, PublishError::Damaged { .. }), "{error}");
    assert!(error.to_string().contains(says), "{error}");
    assert!(!to.join("campaign.parquet").exists());
}

#[test]
fn paths_lead_nowhere_else() {
    let bench = histories("0");
    let memory = Memory::default();
    publish(&memory, &bench.path("c")).expect("published");
    let sound = manifest(&memory);
    let content = sound["files"]["ended/000000.parquet"].clone();
    assert!(content.is_object());
    let outside = bench.path("outside.json");
    let absolute = outside.display().to_string();
    for path in [
        "../outside.json",
        "ended/../../outside.json",
        "runs/000000/../../../outside.json",
        absolute.as_str(),
        "./outside.json",
        "ended/000000.parquet/../../outside.json",
        "..\\outside.json",
        "lock",
        ".bashrc",
        "scene.toml",
        "ended/000000.parquet\n",
        "",
    ] {
        let mut hostile = sound.clone();
        hostile["files"][path] = content.clone();
        set(&memory, &hostile);
        // Under the name that it would have, too.
        memory.set(path, b"{}".to_vec());
        let d = bench.path("d");
        damaged(&memory, &d, "is no file of a campaign");
        assert!(!d.exists() && !outside.exists(), "{path}");
    }
}

#[test]
fn contents_are_held_against_what_was_published() {
    let bench = histories("0");
    let memory = Memory::default();
    publish(&memory, &bench.path("c")).expect("published");
    let objects = memory.all();
    let mut seen = 0;
    for name in objects
        .keys()
        .filter(|name| *name != MANIFEST && *name != "conditions")
    {
        let sound = &objects[name];
        let mut flipped = sound.clone();
        let middle = flipped.len() / 2;
        flipped[middle] ^= 4;
        let mut longer = sound.clone();
        longer.push(0);
        for (case, bytes) in [flipped, longer, Vec::new()].into_iter().enumerate() {
            memory.set(name, bytes);
            damaged(&memory, &bench.path(&format!("d{seen}-{case}")), name);
        }
        memory.remove(name);
        damaged(&memory, &bench.path(&format!("d{seen}-gone")), "it is gone");
        memory.set(name, sound.clone());
        seen += 1;
    }
    assert!(seen >= 5);
    let d = bench.path("d");
    fetch(&memory, &d).expect("all is as it was");
    assert!(files(&d) == files(&bench.path("c")));
}

#[test]
fn a_list_that_is_none_is_refused() {
    let bench = histories("0");
    let memory = Memory::default();
    publish(&memory, &bench.path("c")).expect("published");
    let sound = manifest(&memory);
    let d = bench.path("d");
    let changed = |at: &str, value: Value| {
        let mut hostile = sound.clone();
        *hostile.pointer_mut(at).expect("a place") = value;
        hostile
    };
    let parquet = "/files/campaign.parquet";
    for (hostile, says) in [
        (json!([]), "it is no list"),
        (json!({}), "it is no list"),
        (changed("/format", 9.into()), "it has the layout 9"),
        (changed("/kind", "secret".into()), "it is no list"),
        (changed("/kind", "run".into()), "is no file of a run"),
        (changed("/files", json!({})), "it names no campaign.parquet"),
        (
            changed(&format!("{parquet}/hash"), "..".into()),
            "the hash of",
        ),
        (
            changed(&format!("{parquet}/hash"), "G".repeat(64).into()),
            "the hash of",
        ),
        (
            changed(&format!("{parquet}/hash"), "0".repeat(64).into()),
            "it is gone",
        ),
        (
            changed(&format!("{parquet}/bytes"), u64::MAX.into()),
            "is to have",
        ),
        (
            changed(&format!("{parquet}/bytes"), 3.into()),
            "it is longer",
        ),
        (
            changed(&format!("{parquet}/bytes"), (-1).into()),
            "it is no list",
        ),
    ] {
        set(&memory, &hostile);
        damaged(&memory, &d, says);
        let _ = fs::remove_dir_all(&d);
    }
    for (bytes, says) in [
        (Vec::new(), "it is no list"),
        (vec![0xff, 0xfe], "it is no list"),
        (vec![b'['; HUGE], "no publication of this program has more"),
        (vec![b'['; 1 << 20], "it is no list"),
    ] {
        memory.set(MANIFEST, bytes);
        damaged(&memory, &d, says);
        // Nor is anything added to it.
        let error = publish(&memory, &bench.path("c")).expect_err("not ours");
        assert!(error.is_damage_or_mismatch(), "{error}");
    }
    // More than any disk has, in files that each may be.
    let mut hostile = sound.clone();
    for k in 0..20_000 {
        hostile["files"][format!("ended/{:06}.parquet", k + 10)] =
            json!({ "bytes": 4_u64 << 30, "hash": "0".repeat(64) });
    }
    set(&memory, &hostile);
    let error = fetch(&memory, &d).expect_err("no room");
    assert!(matches!(error, PublishError::NoSpace { .. }), "{error}");
    assert!(!d.join("campaign.parquet").exists());
}
