use fretwear::dynamics::{DynamicsError, Harmonics, Sampling};

#[test]
fn transforms_invert_each_other() {
    let harmonics = Harmonics::new(&[5, 0, 2, 3]).expect("a valid set");
    let sampling = Sampling::new(harmonics, 23).expect("enough samples");
    let coefficients: Vec<f64> = (0..21).map(|k| (k as f64 * 1.7).sin()).collect();
    let back = sampling.analyse(&sampling.synthesise(&coefficients));
    for (a, b) in back.iter().zip(&coefficients) {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}

#[test]
fn coefficients_are_half_range_and_rows_by_quantity() {
    let harmonics = Harmonics::new(&[0, 1, 3]).expect("a valid set");
    let sampling = Sampling::new(harmonics, 16).expect("enough samples");
    let wave = |j: usize| 2.0 * std::f64::consts::PI * j as f64 / 16.0;
    let samples: Vec<[f64; 3]> = (0..16)
        .map(|j| {
            [
                7.0,
                2.0 * wave(j).cos() - 3.0 * (3.0 * wave(j)).sin(),
                wave(j).sin(),
            ]
        })
        .collect();
    let expected = [
        [7.0, 0.0, 0.0, 0.0, 0.0],
        [0.0, 2.0, 0.0, 0.0, -3.0],
        [0.0, 0.0, 1.0, 0.0, 0.0],
    ];
    for (a, b) in sampling
        .analyse(&samples)
        .iter()
        .zip(expected.as_flattened())
    {
        assert!((a - b).abs() < 1e-14, "{a} {b}");
    }
}

#[test]
fn work_is_the_area_of_the_loop() {
    let harmonics = Harmonics::up_to(3);
    let (force, displacement) = (
        [0.4, 1.0, 2.0, -0.3, 0.2, 0.6, -0.7],
        [0.1, -0.5, 0.8, 0.9, 0.4, -0.2, 0.3],
    );
    let value = |row: &[f64], theta: f64| -> f64 {
        let pairs = harmonics.basis(theta).into_iter().zip(row);
        pairs.map(|(a, b)| a * b).sum()
    };
    // (a, b) of order k becomes k (b, −a).
    let [_, a, b, a2, b2, a3, b3] = displacement;
    let rate = [0.0, b, -a, 2.0 * b2, -2.0 * a2, 3.0 * b3, -3.0 * a3];
    let n = 24;
    let step = 2.0 * std::f64::consts::PI / n as f64;
    let area: f64 = (0..n)
        .map(|j| value(&force, j as f64 * step) * value(&rate, j as f64 * step) * step)
        .sum();
    assert!((harmonics.work(&force, &displacement) - area).abs() < 1e-12);
}

#[test]
fn wrong_sets_and_sample_counts_are_refused() {
    for orders in [&[1, 2][..], &[0, 1, 1], &[]] {
        assert_eq!(
            Harmonics::new(orders),
            Err(DynamicsError::Harmonics {
                found: orders.to_vec()
            })
        );
    }
    let error = Sampling::new(Harmonics::up_to(4), 8).expect_err("aliases");
    assert!(matches!(
        error,
        DynamicsError::Samples {
            samples: 8,
            highest: 4,
            least: 8
        }
    ));
}
