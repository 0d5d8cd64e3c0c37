//! Stage keys are equal for equal inputs and different for any other inputs.

use super::*;
use fretwear::store::Recompute;
use proptest::prelude::*;

fn key(parameters: &Value) -> StageKey {
    StageKey::new("wear", &[TableName::WearField], parameters, &[])
}

#[test]
fn a_key_depends_on_everything_that_goes_in() {
    let parameters = json!({ "coefficient": 2e-15, "nested": { "steps": [1, 2] } });
    let surface = StageKey::new("surface", &[TableName::Surface], &json!({}), &[]);
    let other_surface = StageKey::new("surface", &[TableName::Surface], &json!({ "seed": 2 }), &[]);
    let make = |stage, tables: &[TableName], parameters: &Value, upstream: &[&StageKey]| {
        StageKey::new(stage, tables, parameters, upstream)
            .hash()
            .to_owned()
    };
    let fields = [TableName::WearField];
    let mut more = parameters.clone();
    more["nested"]["steps"] = json!([1, 2.0]);
    let all = [
        make("wear", &fields, &parameters, &[]),
        make("wear 2", &fields, &parameters, &[]),
        make("wear", &[TableName::Summary], &parameters, &[]),
        make("wear", &[], &parameters, &[]),
        make("wear", &fields, &more, &[]),
        make("wear", &fields, &json!(null), &[]),
        make("wear", &fields, &parameters, &[&surface]),
        make("wear", &fields, &parameters, &[&other_surface]),
        make("wear", &fields, &parameters, &[&surface, &other_surface]),
        make("wear", &fields, &parameters, &[&other_surface, &surface]),
    ];
    let distinct: BTreeSet<&String> = all.iter().collect();
    assert_eq!(distinct.len(), all.len());
}

proptest! {
    #[test]
    fn the_order_of_keys_is_nothing_and_a_value_is_all(
        pairs in prop::collection::btree_map("[a-z]{1,6}", any::<f64>().prop_filter("JSON", |v| v.is_finite()), 1..8),
        at in any::<prop::sample::Index>(),
    ) {
        let forward: serde_json::Map<String, Value> = pairs.iter().map(|(k, v)| (k.clone(), json!(v))).collect();
        let backward: serde_json::Map<String, Value> = pairs.iter().rev().map(|(k, v)| (k.clone(), json!(v))).collect();
        let before = key(&json!({ "p": forward }));
        prop_assert_eq!(&before, &key(&json!({ "p": backward })));

        let (name, value) = pairs.iter().nth(at.index(pairs.len())).expect("in range");
        let mut changed = forward.clone();
        // Next floating-point number: the smallest possible change.
        changed[name] = json!(f64::from_bits(value.to_bits() ^ 1));
        let after = key(&json!({ "p": changed }));
        prop_assert_ne!(before.hash(), after.hash());
    }

    #[test]
    fn a_scene_is_the_same_after_it_was_written(values in prop::collection::vec(any::<f64>().prop_filter("JSON", |v| v.is_finite()), 1..12)) {
        let folder = tempfile::tempdir().expect("a folder");
        let root = folder.path().join("run");
        let mut scene = scene(1000, 5e-6);
        scene["table"] = json!(values);
        let identity = identity_of(scene);
        for _ in 0..3 {
            let (_, opening) = RunStore::create_or_open(quick(), &root, &identity).expect("the same scene");
            prop_assert!(opening.changed_keys.is_empty());
        }
    }
}

#[test]
fn why_a_table_is_computed_again_is_told() {
    let folder = tempfile::tempdir().expect("a folder");
    let (mut store, _) = open(quick(), &folder.path().join("run")).expect("a run");
    let name = TableName::Surface;
    let before = StageKey::new("surface", &[name], &json!({ "rq": 5e-6, "seed": 1 }), &[]);
    let after = StageKey::new("surface", &[name], &json!({ "rq": 5e-6, "seed": 2 }), &[]);
    assert_eq!(
        store.once(name, &before).expect("readable"),
        StoredResult::Stale(Recompute::Missing)
    );
    store.put_once(name, &before, &surface(5e-6)).expect("put");
    assert_eq!(
        store.once(name, &before).expect("readable"),
        StoredResult::Valid(surface(5e-6))
    );
    let StoredResult::Stale(why) = store.once(name, &after).expect("readable") else {
        panic!("the key has changed");
    };
    assert_eq!(
        why.to_string(),
        "computed from other inputs: `parameters.seed` was 1, is 2"
    );
    store.put_once(name, &after, &surface(1e-6)).expect("put");
    assert_eq!(
        store.once(name, &after).expect("readable"),
        StoredResult::Valid(surface(1e-6))
    );
    assert_eq!(
        store.reader().read_once(name).expect("readable"),
        Some(surface(1e-6))
    );
}
