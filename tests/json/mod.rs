//! Tests of the canonical form of JSON, and of differences between two values.

use fretwear::json::{as_read, canonical, differences, flatten, hash, matches, user_changes};
use serde_json::{Value, json};

fn told(before: &Value, after: &Value) -> Vec<String> {
    let changes = differences(before, after);
    changes.iter().map(ToString::to_string).collect()
}

#[test]
fn the_order_of_keys_is_nothing_and_that_of_a_list_is_all() {
    let text = |text: &str| -> Value { serde_json::from_str(text).expect("JSON") };
    let one = text(r#"{"b": [{"d": 1, "c": 2}], "a": null}"#);
    let other = text(r#"{"a": null, "b": [{"c": 2, "d": 1}]}"#);
    assert_eq!(canonical(&one), r#"{"a":null,"b":[{"c":2,"d":1}]}"#);
    assert_eq!(hash(&one), hash(&other));
    assert_ne!(hash(&json!([1, 2])), hash(&json!([2, 1])));
    // The hash is the BLAKE3 hash of the canonical text, so other programs can compute the hash.
    let expected = blake3::hash(canonical(&one).as_bytes());
    assert_eq!(hash(&one), expected.to_hex().as_str());
}

#[test]
fn every_value_has_its_dotted_key() {
    let value = json!({ "a": { "b": 1, "c": { "d": [1, { "e": 2 }] } }, "f": {}, "g": null });
    let flat: Vec<String> = flatten(&value)
        .iter()
        .map(|(key, value)| format!("{key} = {value}"))
        .collect();
    assert_eq!(
        flat,
        ["a.b = 1", "a.c.d = [1,{\"e\":2}]", "f = {}", "g = null",]
    );
}

#[test]
fn what_is_not_given_is_absent() {
    let before = json!({ "a": null, "b": { "c": 1 }, "d": 0.5, "e": {} });
    let after = json!({ "b": null, "d": 0.5, "f": null, "g": "x" });
    assert_eq!(
        told(&before, &after),
        [
            "`b.c` was 1, is absent",
            "`e` was {}, is absent",
            "`g` was absent, is \"x\"",
        ]
    );
    assert_eq!(differences(&before, &before), []);
    let change = &differences(&json!({ "a": 1 }), &json!({ "a": 2 }))[0];
    let (one, two) = (Some(json!(1)), Some(json!(2)));
    assert_eq!((&change.before, &change.after), (&one, &two));
}

#[test]
fn a_value_that_was_written_is_the_same() {
    // The parser of a text may change the last digit of a float.
    for float in [0.1 + 0.2, 1.1754943508222875e-38, 5e-324, 1.0 / 3.0] {
        let value = json!({ "float": float });
        let kept: Value = serde_json::from_str(&canonical(&value)).expect("JSON");
        assert_eq!(differences(&kept, &as_read(&value)), [], "{float:e}");
    }
}

#[test]
fn patterns_name_keys_in_full_or_by_section() {
    let patterns = ["wear.cycles", "output.keep.*"].map(str::to_owned);
    for (key, expected) in [
        ("wear.cycles", true),
        ("wear.cycles.more", false),
        ("wear", false),
        ("output.keep", true),
        ("output.keep.last", true),
        ("output.keeper", false),
    ] {
        assert_eq!(matches(key, &patterns), expected, "{key}");
    }
}

#[test]
fn what_follows_from_another_key_is_no_change_of_its_own() {
    let following = ["structure.length".to_owned()];
    let keys = |before: Value, after: Value| -> Vec<String> {
        let changes = user_changes(differences(&before, &after), &following);
        changes.into_iter().map(|change| change.key).collect()
    };
    let scene = |size: u64, length: u64| json!({ "joint": { "size": size }, "structure": { "length": length } });
    assert_eq!(keys(scene(1, 1), scene(2, 2)), ["joint.size"]);
    // The program reports a change of a derived value if the other key did not change.
    assert_eq!(keys(scene(1, 1), scene(1, 2)), ["structure.length"]);
}
