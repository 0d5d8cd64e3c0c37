//! Tests of the extrapolation of the motion from one update to the next.

use fretwear::model_update::{Trend, can_extrapolate};

/// A motion that is linear in the compliance is extrapolated exactly. The extrapolation ends at twice the last change.
#[test]
fn what_is_linear_in_the_compliance_is_met() {
    let at = |c: f64| [1.0 - 2.0 * c, 0.3 + c, 5.0];
    let [before, last] = [0.5, 0.4];
    let pairs = at(last).into_iter().zip(at(before));
    let trend = Trend {
        compliance: [before, last],
        change: pairs.map(|(now, then)| now - then).collect(),
    };
    for c in [0.4, 0.37, 0.33, 0.25, 0.2] {
        let found = trend.at(&at(last), c);
        for (found, expected) in found.iter().zip(at(c)) {
            assert!((found - expected).abs() < 1e-14, "{c}: {found} {expected}");
        }
    }
    assert_eq!(trend.multiple(0.4), 0.0);
    assert_eq!(trend.at(&at(last), 0.1), trend.at(&at(last), 0.2));
    // The trend does not extrapolate backwards.
    assert_eq!(trend.multiple(0.45), 0.0);
}

/// The trend extrapolates nothing without a change of compliance, or for a rigid or open joint.
#[test]
fn a_joint_that_has_not_changed_stays() {
    for compliance in [[0.4, 0.4], [f64::INFINITY, f64::INFINITY], [0.0, 0.0]] {
        let trend = Trend {
            compliance,
            change: vec![1.0],
        };
        assert_eq!(trend.multiple(0.3), 0.0, "{compliance:?}");
    }
}

#[test]
fn a_large_change_or_one_that_turns_back_is_none_to_carry_on() {
    let last = [3.0, 4.0];
    assert!(can_extrapolate(&last, &[0.7, 1.0], &[0.0, 0.0]));
    assert!(!can_extrapolate(&last, &[0.8, 1.0], &[0.0, 0.0]));
    assert!(can_extrapolate(&last, &[0.3, 0.4], &[0.4, -0.3]));
    assert!(!can_extrapolate(&last, &[0.3, 0.4], &[0.4, -0.31]));
}
