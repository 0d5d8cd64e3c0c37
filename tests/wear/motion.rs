use std::f64::consts::FRAC_PI_2;

use fretwear::wear::Motion;

#[test]
fn a_cosine_along_one_axis_is_straight_and_begins_at_its_end() {
    let motion = Motion::harmonic(&[(5e-6, 0.0)], 30e3, 0.0, 32);
    let straight = motion.straight().expect("straight");
    assert_eq!((straight.top, straight.bottom), (0, 16));
    assert_eq!(straight.end, vec![5e-6]);
}

#[test]
fn axes_in_phase_are_straight_and_axes_out_of_phase_are_not() {
    assert!(
        Motion::harmonic(&[(5e-6, 0.4), (2e-6, 0.4)], 30e3, 0.0, 32)
            .straight()
            .is_some()
    );
    assert!(
        Motion::harmonic(&[(5e-6, 0.0), (2e-6, FRAC_PI_2)], 30e3, 0.0, 32)
            .straight()
            .is_none()
    );
}

#[test]
fn a_changing_load_is_not_straight() {
    let motion = Motion::harmonic(&[(5e-6, 0.0)], 30e3, 1e3, 32);
    assert!(!motion.constant_load());
    assert!(motion.straight().is_none());
    assert!((motion.mean_load() - 30e3).abs() < 1e-9 * 30e3);
}

#[test]
fn a_motion_with_a_mean_or_with_inner_turns_is_not_straight() {
    let series = |values: &[f64]| Motion {
        time: (0..values.len())
            .map(|k| k as f64 / values.len() as f64)
            .collect(),
        displacement: vec![values.to_vec()],
        normal_load: vec![1.0; values.len()],
    };
    assert!(series(&[1.0, 0.0, -1.0, 0.0]).straight().is_some());
    assert!(series(&[2.0, 1.0, 0.0, 1.0]).straight().is_none());
    assert!(
        series(&[1.0, 0.0, 0.5, -1.0, 0.0, 0.2])
            .straight()
            .is_none()
    );
}
