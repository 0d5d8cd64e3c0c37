use fretwear::reference::WinklerWear;

const BED: WinklerWear = WinklerWear {
    stiffness: 3.0e13,
    coefficient: 2.0e-15,
    friction_coefficient: 0.6,
    slip: 2.5e-6,
};

#[test]
fn pressure_and_depth_obey_the_wear_law_and_the_spring() {
    let (initial, mean, cycles) = (2.4e8, 1.1e8, 0.8 * BED.decay_cycles());
    let rate = 4.0 * BED.coefficient * BED.friction_coefficient * BED.slip;
    let step = 1e-4 * BED.decay_cycles();
    let slope =
        |depth: &dyn Fn(f64) -> f64| (depth(cycles + step) - depth(cycles - step)) / (2.0 * step);

    let fixed_approach = slope(&|n| BED.depth_at_fixed_approach(initial, n));
    let pressure = BED.pressure_at_fixed_approach(initial, cycles);
    // A central difference of the relative step h = 1e-4 has a relative error of h²/6.
    assert!((fixed_approach / (rate * pressure) - 1.0).abs() < 1e-8);
    let worn = BED.depth_at_fixed_approach(initial, cycles);
    assert!((pressure / (initial - BED.stiffness * worn) - 1.0).abs() < 1e-13);

    let fixed_load = slope(&|n| BED.depth_at_fixed_load(initial, mean, n));
    let pressure = BED.pressure_at_fixed_load(initial, mean, cycles);
    assert!((fixed_load / (rate * pressure) - 1.0).abs() < 1e-8);
}

#[test]
fn limits_are_unworn_and_worn_in() {
    let (initial, mean) = (2.4e8, 1.1e8);
    assert_eq!(BED.depth_at_fixed_approach(initial, 0.0), 0.0);
    assert_eq!(BED.depth_at_fixed_load(initial, mean, 0.0), 0.0);
    let late = 40.0 * BED.decay_cycles();
    assert!(
        (BED.depth_at_fixed_approach(initial, late) * BED.stiffness / initial - 1.0).abs() < 1e-13
    );
    assert!((BED.pressure_at_fixed_load(initial, mean, late) / mean - 1.0).abs() < 1e-13);
}
