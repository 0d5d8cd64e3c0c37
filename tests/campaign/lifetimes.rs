//! Tests of the number of cycles after which runs pass a milestone, with runs that end before it, against values worked by hand.

use std::fs;

use fretwear::campaign::survival::{Lifetime, Survival};

use super::planned;

const ROUNDING: f64 = 1e-12;

fn lives(passed: &[f64], left: &[f64]) -> Vec<Lifetime> {
    let of = |passed| {
        move |cycles: &f64| Lifetime {
            cycles: *cycles,
            passed,
        }
    };
    passed
        .iter()
        .map(of(true))
        .chain(left.iter().map(of(false)))
        .collect()
}

fn near(found: f64, worked: f64) {
    assert!(
        (found - worked).abs() < ROUNDING,
        "{found}, by hand {worked}"
    );
}

#[test]
fn the_product_limit_of_six_runs_is_the_one_by_hand() {
    let survival = Survival::estimate(&lives(&[1.0, 3.0, 5.0, 6.0], &[2.0, 4.0]));
    // 1/6; one of the 5 remaining runs ends at 2; 1 - 5/6 3/4; 1 - 5/8 1/2; no run remains.
    for (cycles, passed) in [
        (0.5, 0.0),
        (1.0, 1.0 / 6.0),
        (2.9, 1.0 / 6.0),
        (3.0, 0.375),
        (5.5, 0.6875),
        (6.0, 1.0),
    ] {
        near(survival.share_passed(cycles), passed);
    }
    assert_eq!(survival.quantile(0.5).cycles, Some(5.0));
    assert_eq!(survival.quantile(0.25).cycles, Some(3.0));
    // Without the runs that end before the milestone, the median would be different.
    let dropped = Survival::estimate(&lives(&[1.0, 3.0, 5.0, 6.0], &[]));
    assert_eq!(dropped.quantile(0.5).cycles, Some(3.0));
    // A run that ends at the cycle at which another run passes counts as at risk at this cycle.
    near(
        Survival::estimate(&lives(&[2.0], &[2.0])).share_passed(2.0),
        0.5,
    );
    // The share is unknown beyond the last run.
    let few = Survival::estimate(&lives(&[1.0], &[2.0, 2.0, 3.0]));
    near(few.share_passed(1e9), 0.25);
    assert_eq!((few.quantile(0.5).cycles, few.end), (None, 3.0));
    assert_eq!(Survival::estimate(&[]).quantile(0.5).cycles, None);
}

/// A hundred runs that pass after 1 to 100 cycles, one run per cycle.
#[test]
fn quantiles_have_the_bounds_of_order_statistics() {
    let all: Vec<f64> = (1..=100).map(f64::from).collect();
    let whole = Survival::estimate(&lives(&all, &[]));
    // From binomial tables: with 100 runs, the median of the population lies between the 40th and the 61st run, the 5 % quantile between
    // the 1st and the 11th run.
    let median = whole.quantile(0.5);
    assert_eq!(
        (median.low, median.cycles, median.high),
        (Some(40.0), Some(50.0), Some(61.0))
    );
    let early = whole.quantile(0.05);
    assert_eq!(
        (early.low, early.cycles, early.high),
        (Some(1.0), Some(5.0), Some(11.0))
    );
    let late = whole.quantile(0.95);
    assert_eq!(
        (late.low, late.cycles, late.high),
        (Some(90.0), Some(95.0), Some(100.0))
    );
    // Ten runs do not bound a tail.
    let ten = Survival::estimate(&lives(&all[..10], &[]));
    let tail = ten.quantile(0.05);
    assert_eq!((tail.low, tail.cycles), (Some(0.0), Some(1.0)));
    assert_eq!(ten.quantile(0.95).high, None);
}

/// 1 minus the product of 1 - 1/(runs at risk) over all runs that passed before.
fn by_definition(lives: &[(f64, bool)], cycles: f64) -> f64 {
    let there = |at: f64| lives.iter().filter(|life| life.0 >= at).count() as f64;
    let passed = lives.iter().filter(|life| life.1 && life.0 <= cycles);
    1.0 - passed
        .map(|life| 1.0 - 1.0 / there(life.0))
        .product::<f64>()
}

/// Runs of two friction coefficients, each with another last cycle, one of them failed: the estimate includes each run up to its end.
#[test]
fn a_campaign_follows_each_run_to_where_it_ended() {
    let bench = planned(
        "[grid]\ncontact.friction_coefficient = [0.5, 0.7]\n[random]\nn = 8\nseed = 2\nwear.coefficient = { distribution = \"log_uniform\", low = \"1e3 um^3/J\", high = \"4e3 um^3/J\" }\nwear.volume = { distribution = \"log_uniform\", low = \"1.5e-5 mm^3\", high = \"1e-4 mm^3\" }\n",
    );
    bench.done(&["campaign", "run", "--dir", "c", "--jobs", "2", "-q"]);
    fs::remove_file(bench.path("c/ended/000009.parquet")).expect("removed");
    fs::create_dir(bench.path("c/failed")).expect("a folder");
    let failure = "{\"when\":\"now\",\"message\":\"it broke\",\"again\":false,\"code\":1}";
    fs::write(bench.path("c/failed/000009.json"), failure).expect("written");
    bench.done(&["campaign", "collect", "--dir", "c"]);
    let milestone = "--volume=3e-5 mm^3";
    let found = bench.done(&["when", "c", milestone, "--json"]).json();
    assert_eq!(
        (&found["runs"], &found["failed"], &found["open"]),
        (&16.into(), &1.into(), &0.into())
    );
    let points = found["milestones"][0]["points"].as_array().expect("points");
    assert_eq!(points.len(), 2);
    let mut left = 0;
    for (at, point) in points.iter().enumerate() {
        let friction = ["0.5", "0.7"][at];
        assert_eq!(point["point"]["contact.friction_coefficient"], friction);
        for (name, nth) in [("earliest", 0), ("latest", 1)] {
            let lives: Vec<(f64, bool)> = (0..8)
                .map(|k| {
                    let run = format!("c/runs/{:06}", 8 * at + k);
                    let own = bench.done(&["when", &run, milestone, "--json"]).json();
                    let own = &own["milestones"][0];
                    let end = own["beyond"].as_f64().expect("cycles");
                    own[name]
                        .as_f64()
                        .map_or((end, false), |cycles| (cycles, true))
                })
                .collect();
            left += lives.iter().filter(|life| !life.1).count();
            let end = point["end"].as_f64().expect("cycles");
            let within = point["within"][name].as_f64().expect("a part");
            near(within, by_definition(&lives, end));
            for quantile in point[name].as_array().expect("quantiles") {
                let part = quantile["part"].as_f64().expect("a part");
                let mut passed: Vec<f64> = lives
                    .iter()
                    .filter(|life| life.1)
                    .map(|life| life.0)
                    .collect();
                passed.sort_by(f64::total_cmp);
                let by_hand = passed
                    .into_iter()
                    .find(|cycles| by_definition(&lives, *cycles) >= part - ROUNDING);
                assert_eq!(quantile["cycles"].as_f64(), by_hand, "{nth} {lives:?}");
            }
        }
    }
    assert!(
        left > 4 && left < 28,
        "{left} of 32 lifetimes end before the milestone"
    );
    let said = bench.done(&["when", "c", milestone]).stdout();
    assert!(
        said.contains("contact.friction_coefficient = 0.7"),
        "{said}"
    );
    assert!(said.contains(" pass within "), "{said}");
}
