//! Comparison of the estimated remaining time of a run with the actual time.

use fretwear::recipe::{Scheme, Wear};
use fretwear::stages::{Pace, Stage};

/// Part of a run after which the estimate appears.
const FIRST_PART: f64 = 0.2;

/// Iterations of a run: completed part, and seconds of other stages, of vibrations, and of the forced response.
type Course = &'static [[f64; 4]];
/// Rows of the `timing` tables of `pipelines/lap_joint.toml`.
const LAP_JOINT: Course = &[
    [0.0000, 1.05, 2.83, 9.89],
    [0.0027, 0.57, 0.00, 0.00],
    [0.0066, 1.33, 3.16, 0.00],
    [0.0119, 1.09, 0.00, 0.00],
    [0.0188, 1.01, 0.00, 0.00],
    [0.0279, 0.94, 2.74, 0.00],
    [0.0398, 0.48, 0.00, 0.00],
    [0.0567, 0.47, 0.00, 0.00],
    [0.0797, 0.51, 0.00, 0.00],
    [0.1111, 0.59, 0.00, 0.00],
    [0.1563, 0.84, 0.00, 0.00],
    [0.1744, 1.53, 4.04, 0.00],
    [0.2424, 0.52, 0.00, 0.00],
    [0.3644, 0.73, 0.00, 0.00],
    [0.5512, 1.84, 4.25, 0.00],
    [0.7756, 0.59, 0.00, 0.00],
    [1.0000, 1.06, 0.00, 15.87],
];
/// Rows for a prescribed motion on 512 x 512 cells. Every tenth iteration and the last one compute curves.
const CURVES: Course = &[
    [0.0, 2.23, 0.0, 0.0],
    [0.0058, 1.03, 0.0, 0.0],
    [0.0151, 0.68, 0.0, 0.0],
    [0.0269, 1.03, 0.0, 0.0],
    [0.0414, 0.95, 0.0, 0.0],
    [0.0596, 1.02, 0.0, 0.0],
    [0.0831, 1.19, 0.0, 0.0],
    [0.1145, 1.07, 0.0, 0.0],
    [0.1589, 1.17, 0.0, 0.0],
    [0.2248, 1.19, 0.0, 0.0],
    [0.3330, 2.42, 0.0, 0.0],
    [0.5359, 1.56, 0.0, 0.0],
    [0.7679, 1.49, 0.0, 0.0],
    [1.0, 2.51, 0.0, 0.0],
];
/// Rows for the same lap joint with `preset = "fast"`. Later vibrations take longer.
const UPDATES: Course = &[
    [0.0, 1.04, 8.1, 9.6],
    [0.0025, 0.69, 0.0, 0.0],
    [0.0066, 1.54, 4.0, 0.0],
    [0.0163, 0.78, 0.0, 0.0],
    [0.0184, 1.14, 7.6, 0.0],
    [0.0360, 0.78, 0.0, 0.0],
    [0.0632, 1.20, 8.5, 0.0],
    [0.1204, 0.78, 0.0, 0.0],
    [0.2510, 0.60, 0.0, 0.0],
    [0.3300, 1.25, 15.4, 0.0],
    [0.5533, 0.92, 0.0, 0.0],
    [0.8576, 1.56, 17.1, 0.0],
    [1.0, 0.77, 0.0, 22.2],
];

fn pace(course: &[[f64; 4]]) -> Pace {
    let wear = Wear {
        until_preload: None,
        coefficient: 1.0,
        cycles: Some(10_000),
        volume: None,
        scheme: Scheme::Implicit,
        depth_step: None,
        tolerance: 0.1,
    };
    let mut pace = Pace::new(Some(&wear));
    for [part, others, vibration, response] in course {
        pace.spend(Stage::Wear.name(), *others);
        pace.spend(Stage::DynamicResponse.name(), *vibration);
        pace.spend(Stage::ForcedResponse.name(), *response);
        pace.commit((1e4 * part) as u64, 0.0);
    }
    pace
}

#[test]
fn the_time_to_go_is_within_a_factor_of_two() {
    for course in [LAP_JOINT, CURVES, UPDATES] {
        for k in 1..course.len() - 1 {
            let left = pace(&course[..=k]).seconds_left();
            let rest: f64 = course[k + 1..].iter().flat_map(|i| &i[1..]).sum();
            let is_shown = course[k][0] >= FIRST_PART;
            assert_eq!(left.is_some(), is_shown, "iteration {k}");
            let ratio = left.unwrap_or(rest) / rest;
            assert!(
                (0.5..2.0).contains(&ratio),
                "{left:?} s of {rest} s after iteration {k}"
            );
        }
    }
}

/// Equal steps give an exact estimate. Repeated reports of a continued run do not count.
#[test]
fn equal_steps() {
    let equal: Vec<[f64; 4]> = (0..6)
        .map(|k| [0.1 * f64::from(k), 2.0, 0.0, 0.0])
        .collect();
    let mut pace = pace(&equal);
    // A start may first restore a table. Its time and the repeated commits must not count.
    pace.spend(Stage::Surface.name(), 7.0);
    pace.commit(5000, 0.0);
    pace.commit(5000, 0.0);
    let left = pace.seconds_left().expect("half of the run is done");
    assert!((left - 10.0).abs() < 1e-9, "{left}");
    let rate = pace.cycles_per_second().expect("steps");
    assert!((rate - 500.0).abs() < 1e-9, "{rate}");
}

/// An iteration with lost times counts for the completed part.
#[test]
fn lost_times() {
    let mut pace = pace(&[[0.0, 2.0, 0.0, 0.0], [0.1, 2.0, 0.0, 0.0]]);
    pace.commit(6000, 0.0);
    assert_eq!(pace.part(), 0.6);
}
