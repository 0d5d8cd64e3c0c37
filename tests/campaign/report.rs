//! Tests of the report of a campaign.

use std::fs;

use fretwear::campaign::statistics::variance;
use fretwear::tables::{TableName, from_parquet};

use super::planned;

use crate::support::{Bench, latest, summary};

/// The worn volume is proportional to the wear coefficient, so the other key has almost no influence.
const DRAWS: &str = "[random]\nn = 24\nseed = 2\nwear.coefficient = { distribution = \"log_uniform\", low = \"1e3 um^3/J\", high = \"4e3 um^3/J\" }\nfidelity.normal_tolerance = { distribution = \"log_uniform\", low = 1e-7, high = 1e-6 }\n";

fn reported(bench: &Bench) -> serde_json::Value {
    bench.done(&["campaign", "collect", "--dir", "c"]);
    bench
        .done(&["campaign", "report", "--dir", "c", "--json"])
        .json()
}

#[test]
fn a_report_has_bands_sensitivities_and_failures() {
    let bench = planned(DRAWS);
    bench.done(&["campaign", "run", "--dir", "c", "--jobs", "2", "-q"]);
    // A failed row, as the program stores it.
    let ended = bench.path("c/ended/000009.parquet");
    fs::remove_file(ended).expect("removed");
    fs::create_dir(bench.path("c/failed")).expect("a folder");
    let failure = "{\"when\":\"now\",\"message\":\"it <b>broke\",\"again\":false,\"code\":1}";
    fs::write(bench.path("c/failed/000009.json"), failure).expect("written");
    let found = reported(&bench);
    assert_eq!(found["runs"], 23);

    let row = |table: &str, figure: &str, key: Option<&str>| {
        let rows = found[table].as_array().expect("rows").iter();
        let mut own =
            rows.filter(|row| row["figure"] == figure && key.is_none_or(|key| row["key"] == key));
        own.next()
            .cloned()
            .unwrap_or_else(|| panic!("no {figure} in {table}"))
    };
    let by = |key| row("sensitivities", "wear_volume", Some(key));
    let coefficient = by("wear.coefficient");
    assert!(
        coefficient["rank"].as_f64().expect("a number") > 0.99,
        "{coefficient}"
    );
    assert!(
        coefficient["share"].as_f64().expect("a number") > 0.9,
        "{coefficient}"
    );
    let tolerance = by("fidelity.normal_tolerance");
    assert!(
        tolerance["share"].as_f64().expect("a number") < 0.3,
        "{tolerance}"
    );

    // The figures equal the figures of the runs.
    let mut ends: Vec<f64> = (0..24)
        .filter(|k| *k != 9)
        .map(|k| {
            let root = bench.path(&format!("c/runs/{k:06}"));
            summary(&root, latest(&root), "wear_volume")
        })
        .collect();
    ends.sort_by(f64::total_cmp);
    let volume = row("figures", "wear_volume", None);
    assert_eq!(volume["q50"].as_f64(), Some(ends[11]));
    assert_eq!(
        (volume["least"].as_f64(), volume["most"].as_f64()),
        (Some(ends[0]), Some(ends[22]))
    );
    let mean = ends.iter().sum::<f64>() / 23.0;
    assert!((volume["mean"].as_f64().expect("a number") / mean - 1.0).abs() < 1e-12);

    // A band begins without wear and ends at the last cycle of the runs.
    let band: Vec<_> = found["bands"]
        .as_array()
        .expect("rows")
        .iter()
        .filter(|row| row["figure"] == "wear_volume")
        .collect();
    assert_eq!(
        (&band[0]["cycles"], &band[0]["q95"]),
        (&0.0.into(), &0.0.into())
    );
    let last = band[band.len() - 1];
    assert_eq!(
        (&last["cycles"], &last["q50"]),
        (&200_000.0.into(), &volume["q50"])
    );
    let medians: Vec<f64> = band
        .iter()
        .map(|row| row["q50"].as_f64().expect("a number"))
        .collect();
    assert!(medians.is_sorted());

    let page = fs::read_to_string(bench.path("c/report.html")).expect("a page");
    for part in [
        "Bands over the cycles",
        "wear.coefficient",
        "it &lt;b&gt;broke",
        "1 failed",
    ] {
        assert!(page.contains(part), "no {part:?}");
    }
    assert!(!page.contains("<b>broke"));
    // The page does not load other files.
    for loads in ["http://", "https://", " src=", "@import", "url("] {
        let outside = page.replace("data:,", "");
        assert!(!outside.contains(loads), "{loads}");
    }
    for name in [
        TableName::CampaignFigure,
        TableName::CampaignBand,
        TableName::CampaignSensitivity,
    ] {
        let schema = name.schema();
        let bytes = fs::read(bench.path(&format!("c/{}.parquet", schema.name))).expect("a table");
        assert!(from_parquet(&bytes, schema).expect("it reads").rows() > 0);
    }
}

/// Each draw is combined with three values that have no effect: a draw counts once, also if the other values have not run.
#[test]
fn repeated_draws_are_no_more_samples() {
    let draws = DRAWS.replace("n = 24", "n = 12");
    let bench = planned(&format!("[grid]\noutput.curves_every = [0, 7, 9]\n{draws}"));
    let shares = |found: &serde_json::Value| {
        let all = found["sensitivities"].as_array().expect("rows");
        let own = |key: &str| {
            let is_own =
                |row: &&serde_json::Value| row["figure"] == "wear_volume" && row["key"] == key;
            all.iter().find(is_own).expect("a row").clone()
        };
        (
            own("wear.coefficient"),
            own("fidelity.normal_tolerance"),
            own("output.curves_every"),
        )
    };
    for rows in ["0-11", "12-35"] {
        bench.done(&["campaign", "run", "--dir", "c", "--index", rows, "-q"]);
        let (coefficient, tolerance, inert) = shares(&reported(&bench));
        assert_eq!(coefficient["runs"], 12);
        assert!(
            coefficient["share"].as_f64().expect("a number") > 0.8,
            "{coefficient}"
        );
        assert!(
            tolerance["share"].as_f64().expect("a number") < 0.5,
            "{tolerance}"
        );
        // A single value has no share. With several values of equal figures, their mean may have a rounding error.
        let expected = (rows == "12-35").then_some(0.0);
        let share = inert["share"].as_f64();
        assert_eq!(
            share.map(|share| (share * 1e20).round()),
            expected,
            "{inert}"
        );
    }
}

/// Two keys of a grid, a list and draws, combined with each other: the shares follow from the means of the runs.
#[test]
fn keys_that_cross_have_the_shares_of_their_means() {
    let bench = planned(
        "[grid]\noutput.curves_every = [0, 9]\nwear.coefficient = [\"1e3 um^3/J\", \"2e3 um^3/J\", \"4e3 um^3/J\"]\n[list]\ncontact.normal_load = [\"180 N\", \"200 N\", \"230 N\"]\n\
         [random]\nn = 2\nseed = 5\nfidelity.normal_tolerance = { distribution = \"log_uniform\", low = 1e-7, high = 1e-6 }\n",
    );
    bench.done(&["campaign", "run", "--dir", "c", "--jobs", "2", "-q"]);
    let found = reported(&bench);
    let all = found["sensitivities"].as_array().expect("rows");
    let share = |figure: &str, key: &str| {
        let own = all
            .iter()
            .find(|row| row["figure"] == figure && row["key"] == key);
        own.unwrap_or_else(|| panic!("no {key} of {figure}"))["share"].as_f64()
    };
    // The last key varies fastest: curves, coefficient, load, draw.
    let ends: Vec<f64> = (0..36)
        .map(|k| {
            let root = bench.path(&format!("c/runs/{k:06}"));
            summary(&root, latest(&root), "wear_volume")
        })
        .collect();
    let of = |class: &dyn Fn(usize) -> usize| {
        let means = [0, 1, 2].map(|wanted| {
            let own: Vec<f64> = (0..36)
                .filter(|k| class(*k) == wanted)
                .map(|k| ends[k])
                .collect();
            own.iter().sum::<f64>() / own.len() as f64
        });
        variance(&means) / variance(&ends)
    };
    for (key, exact) in [
        ("wear.coefficient", of(&|k| k / 6 % 3)),
        ("contact.normal_load", of(&|k| k / 2 % 3)),
    ] {
        let share = share("wear_volume", key).expect("a share");
        assert!((share - exact).abs() < 0.01, "{key}: {share}, not {exact}");
    }
    assert_eq!(share("wear_volume", "output.curves_every"), Some(0.0));
    assert!(share("normal_load", "contact.normal_load").expect("a share") > 0.999);
    assert!(share("normal_load", "wear.coefficient").expect("a share") < 1e-6);
}

#[test]
fn there_is_no_report_of_nothing() {
    let bench = planned(super::GRID);
    let did = bench.fretwear(&["campaign", "report", "--dir", "c"]);
    assert_eq!(did.code(), 2);
    assert!(
        did.stderr().contains("campaign collect --dir c"),
        "{}",
        did.stderr()
    );
    // A single run has figures, but no sensitivities.
    bench.done(&["campaign", "run", "--dir", "c", "--index", "5", "-q"]);
    let found = reported(&bench);
    assert_eq!(found["runs"], 1);
    assert_eq!(found["sensitivities"].as_array().map(Vec::len), Some(0));
    assert!(!found["figures"].as_array().expect("rows").is_empty());
}
