use fretwear::model_update::{
    Compliance, CycleFigures, ModelUpdateError, UpdateCause, UpdateCriterion, UpdateState,
};

fn of_stiffness(change: f64) -> UpdateCriterion {
    UpdateCriterion::StiffnessChange {
        change,
        volume_growth: None,
    }
}

fn state(iteration: u64, kn: f64, kt: f64, wear_volume: f64) -> UpdateState {
    UpdateState {
        iteration,
        compliance: Compliance::from_stiffness(kn, kt),
        wear_volume,
        running_in: 0.0,
        cycle: None,
    }
}

#[test]
fn what_makes_an_update_due() {
    const RIGID: f64 = f64::INFINITY;
    // State at the last update: iteration 7, kn 4e9 and kt 3e9 N/m, 2e-12 m³.
    let reference = state(7, 4e9, 3e9, 2e-12);
    let change = of_stiffness;
    let cases = [
        (UpdateCriterion::Never, state(999, RIGID, RIGID, 1.0), None),
        (change(0.1), state(8, 4.39e9, 3.29e9, 1.0), None),
        (
            change(0.1),
            state(8, 4.41e9, 3.2e9, 0.0),
            Some((UpdateCause::Kn, 0.1025)),
        ),
        (
            change(0.1),
            state(8, 4.1e9, 3.31e9, 0.0),
            Some((UpdateCause::Kt, 0.31 / 3.0)),
        ),
        // The stiffness may fall as well as rise, and the larger change is the cause.
        (
            change(0.1),
            state(8, 3.5e9, 3.31e9, 0.0),
            Some((UpdateCause::Kn, -0.125)),
        ),
        (change(0.1), state(8, 3.61e9, 2.71e9, 0.0), None),
        (
            change(0.2),
            state(8, RIGID, 3e9, 0.0),
            Some((UpdateCause::Kn, RIGID)),
        ),
        (
            change(0.2),
            state(8, 4e9, RIGID, 0.0),
            Some((UpdateCause::Kt, RIGID)),
        ),
        (
            change(0.2),
            state(8, 0.0, 3e9, 0.0),
            Some((UpdateCause::Kn, -1.0)),
        ),
        (
            UpdateCriterion::Iterations(5),
            state(11, 9e9, 9e9, 1.0),
            None,
        ),
        (
            UpdateCriterion::Iterations(5),
            state(12, 4e9, 3e9, 0.0),
            Some((UpdateCause::Iterations, 5.0)),
        ),
        (
            UpdateCriterion::WearVolume(1e-12),
            state(99, 9e9, 9e9, 2.9e-12),
            None,
        ),
        (
            UpdateCriterion::WearVolume(1e-12),
            state(8, 4e9, 3e9, 3.5e-12),
            Some((UpdateCause::WearVolume, 1.5e-12)),
        ),
    ];
    for (criterion, now, expected) in cases {
        let due = criterion.due(&reference, &now);
        assert_eq!(criterion.is_due(&reference, &now), expected.is_some());
        match (due, expected) {
            (None, None) => (),
            (Some(due), Some((to, value))) => {
                assert_eq!(due.to, to, "{criterion:?} at {now:?}");
                let equal = due.value == value || (due.value - value).abs() < 1e-12 * value.abs();
                assert!(equal, "{criterion:?}: {} for {value}", due.value);
            }
            (due, expected) => panic!("{criterion:?} at {now:?}: {due:?}, expected {expected:?}"),
        }
    }
}

#[test]
fn a_rigid_joint_that_stays_rigid_has_not_changed() {
    let criterion = of_stiffness(0.05);
    let rigid = state(0, f64::INFINITY, f64::INFINITY, 0.0);
    assert!(!criterion.is_due(&rigid, &rigid));
    assert!(criterion.is_due(&rigid, &state(1, 4e9, f64::INFINITY, 0.0)));
    let open = state(0, 0.0, 0.0, 0.0);
    assert!(!criterion.is_due(&open, &open));
    assert!(criterion.is_due(&open, &rigid));
}

#[test]
fn limits_that_are_none_are_refused() {
    for right in [
        UpdateCriterion::Never,
        of_stiffness(0.05),
        UpdateCriterion::Iterations(1),
        UpdateCriterion::WearVolume(1e-15),
    ] {
        assert_eq!(right.check(), Ok(()));
    }
    for (wrong, key) in [
        (of_stiffness(0.0), "update.stiffness_change"),
        (of_stiffness(f64::NAN), "update.stiffness_change"),
        (UpdateCriterion::Iterations(0), "update.iterations"),
        (UpdateCriterion::WearVolume(-1e-12), "update.wear_volume"),
    ] {
        let found = wrong.check();
        assert!(
            matches!(found, Err(ModelUpdateError::OutOfRange { name, .. }) if name == key),
            "{found:?}"
        );
    }
}

/// Force and energy of a cycle count if both states have a cycle; the cause is the quantity with the largest change, up or down.
#[test]
fn a_cycle_of_less_force_or_more_energy_makes_an_update_due() {
    let with = |force, energy| UpdateState {
        cycle: Some(CycleFigures { force, energy }),
        ..state(0, 2.0, 1.0, 0.0)
    };
    let criterion = of_stiffness(0.1);
    let before = with(100.0, 0.2);
    for (now, to) in [
        (with(89.0, 0.21), Some(UpdateCause::Force)),
        (with(95.0, 0.23), Some(UpdateCause::Energy)),
        (with(105.0, 0.19), None),
        // Without a cycle for comparison, only the stiffness decides.
        (state(0, 2.0, 1.05, 0.0), None),
        (state(0, 2.3, 1.0, 0.0), Some(UpdateCause::Kn)),
    ] {
        assert_eq!(
            criterion.due(&before, &now).map(|due| due.to),
            to,
            "{now:?}"
        );
    }
    // Half of the change in the middle of a step becomes the whole change at its end.
    let middle = CycleFigures {
        force: 95.0,
        energy: 0.2,
    };
    let [begin, end] = [before.cycle, with(90.0, 0.2).cycle];
    assert_eq!(begin.map(|begin| begin.at_end(middle)), end);
}

/// The growth counts from the last update, or from the volume at the end of running-in. A growth slightly above its limit counts as the
/// limit.
#[test]
fn a_grown_volume_makes_an_update_due() {
    let criterion = UpdateCriterion::StiffnessChange {
        change: 0.1,
        volume_growth: Some(0.5),
    };
    let reference = state(3, 4e9, 3e9, 2e-12);
    let grown = |wear_volume, running_in| UpdateState {
        running_in,
        ..state(9, 4e9, 3e9, wear_volume)
    };
    assert!(!criterion.is_due(&reference, &grown(2.99e-12, 0.0)));
    let due = criterion
        .due(&reference, &grown(3.2e-12, 0.0))
        .expect("due");
    assert_eq!((due.to, due.limit), (UpdateCause::VolumeGrowth, 0.5));
    assert!((due.value - 0.6).abs() < 1e-12, "{due:?}");
    // Running-in ends at 5e-12 m³, so the next update is due at 7.5e-12 m³.
    assert!(!criterion.is_due(&reference, &grown(7.4e-12, 5e-12)));
    assert!(criterion.is_due(&reference, &grown(7.6e-12, 5e-12)));
    assert_eq!(criterion.due_volume(&reference, 5e-12), Some(7.5e-12));
    assert_eq!(of_stiffness(0.1).due_volume(&reference, 0.0), None);
    // The cause is the quantity with the largest change relative to its limit, in this case the stiffness.
    let stiffer = UpdateState {
        wear_volume: 3.2e-12,
        ..state(9, 4.8e9, 3e9, 0.0)
    };
    assert_eq!(
        criterion.due(&reference, &stiffer).map(|due| due.to),
        Some(UpdateCause::Kn)
    );
    assert_eq!(criterion.progress(&reference, &grown(3.05e-12, 0.0)), 1.0);
    assert!(criterion.progress(&reference, &grown(3.5e-12, 0.0)) > 1.2);
    let wrong = UpdateCriterion::StiffnessChange {
        change: 0.1,
        volume_growth: Some(0.0),
    };
    let found = wrong.check();
    assert!(
        matches!(
            found,
            Err(ModelUpdateError::OutOfRange {
                name: "update.volume_growth",
                ..
            })
        ),
        "{found:?}"
    );
}
