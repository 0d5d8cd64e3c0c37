//! Tests of the backbone: frequency, damping ratio and amplitude of the phase resonance over the level of the force.

use std::f64::consts::{PI, TAU};

use fretwear::dynamics::oscillator::mass_on_springs;
use fretwear::dynamics::{
    Backbone, BackboneEnd, ContactElement, DynamicsError, ForcedPoint, FrictionLaw, Harmonics,
    Load, LoadLevels, Oscillator, Vibration, resonance_over_parameter,
};
use fretwear::reference::{Jenkins, JenkinsOscillator};

use super::{changed, drive, oscillator};

/// Friction along x: a limit µN of 54 N on a spring of 2.5e7 N/m, parallel to the 4e7 N/m of the 1.5 kg mass.
const JENKINS: Jenkins = Jenkins {
    stiffness: 2.5e7,
    limit: 54.0,
};

fn vibration(oscillator: &Oscillator, loads: Vec<Load>, samples: usize) -> Vibration {
    Vibration {
        settings: super::samples(samples),
        // The range begins below the sliding resonance along x and ends above the stuck one.
        ..super::vibration(oscillator, 1, loads, (4000.0, 7500.0))
    }
}

fn climb(vibration: &Vibration, element: &ContactElement, levels: LoadLevels) -> Backbone {
    let balance = vibration.balance(vec![element.clone()]).expect("valid");
    let backbone = vibration.backbone(balance, levels);
    backbone.unwrap_or_else(|error| panic!("{error}"))
}

fn levels(from: f64, to: f64, count: Option<usize>) -> LoadLevels {
    LoadLevels { from, to, count }
}

/// Oscillator with another dashpot along x.
fn damped(damping: f64) -> Oscillator {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping[0] = damping;
    oscillator
}

fn exact(damping: f64) -> JenkinsOscillator {
    JenkinsOscillator {
        mass: 1.5,
        damping,
        stiffness: 4.0e7,
        contact: JENKINS,
    }
}

/// Largest relative errors of force, frequency and damping ratio at the amplitudes of the points.
fn errors(backbone: &Backbone, exact: &JenkinsOscillator) -> [f64; 3] {
    let of = |found: f64, expected: f64| (found / expected - 1.0).abs();
    backbone.points.iter().fold([0.0; 3], |worst, point| {
        let amplitude = point.amplitude;
        let here = [
            of(point.force, exact.resonant_force(amplitude)),
            of(point.frequency * TAU, exact.backbone(amplitude)),
            of(point.damping_ratio, exact.damping_ratio(amplitude)),
        ];
        [0, 1, 2].map(|k| worst[k].max(here[k]))
    })
}

/// The errors come from the sampling and fall with the square of the number of samples; without sliding they are rounding.
#[test]
fn a_jenkins_oscillator_has_the_backbone_of_its_describing_function() {
    let exact = exact(300.0);
    let oscillator = damped(300.0);
    let mut before: Option<[f64; 3]> = None;
    for samples in [256, 1024, 4096] {
        let vibration = vibration(&oscillator, drive(150.0), samples);
        let all = climb(&vibration, &oscillator.element, levels(0.5, 2000.0, None));
        assert_eq!(all.end, BackboneEnd::Reached);
        let found = errors(&all, &exact);
        println!(
            "{samples}: {found:?}, {} points, {} solves, {} iterations",
            all.points.len(),
            all.solves,
            all.iterations
        );
        if let Some(before) = before {
            for k in 0..3 {
                assert!(
                    found[k] < before[k] / 8.0,
                    "{samples}: {found:?} {before:?}"
                );
            }
        }
        before = Some(found);
        let stuck = |amplitude: f64| !JENKINS.slips(amplitude);
        for point in all.points.iter().filter(|point| stuck(point.amplitude)) {
            // The damping ratio is c / 2mω except for its last digits.
            let ratio = 300.0 / (2.0 * 1.5 * point.frequency * TAU);
            assert!(
                (point.damping_ratio / ratio - 1.0).abs() < 1e-9,
                "{point:?}"
            );
            assert_eq!(point.sliding, 0, "{point:?}");
        }
        let sliding = all.points.last().expect("a point");
        assert_eq!(sliding.sliding, 1, "{sliding:?}");
        assert!(sliding.energy.friction > 0.0);
    }
    let last = before.expect("errors");
    assert!(last.iter().all(|error| *error < 3e-6), "{last:?}");
}

/// Between its points, linear interpolation of the backbone is accurate to 0.15 % of frequency and, except at the kink where sliding
/// begins, to 3 % of damping ratio.
#[test]
fn the_points_are_as_near_as_the_curve_bends_and_no_nearer() {
    let exact = exact(300.0);
    let oscillator = damped(300.0);
    let vibration = vibration(&oscillator, drive(150.0), 1024);
    let all = climb(&vibration, &oscillator.element, levels(0.5, 2000.0, None));
    assert!(all.points.len() <= 60, "{}", all.points.len());
    assert!(all.solves <= all.points.len() + 15, "{}", all.solves);
    for pair in all.points.windows(2) {
        let middle = (pair[0].amplitude * pair[1].amplitude).sqrt();
        let line = (pair[0].damping_ratio * pair[1].damping_ratio).sqrt();
        let off = (line / exact.damping_ratio(middle) - 1.0).abs();
        assert!(off < 0.03, "{off}: {pair:?}");
        let line = (pair[0].frequency * pair[1].frequency).sqrt() * TAU;
        let off = (line / exact.backbone(middle) - 1.0).abs();
        assert!(off < 1.5e-3, "{off}: {pair:?}");
    }
}

/// Friction bounds the resonance up to a force of 4R/π.
#[test]
fn without_another_damping_the_backbone_ends_where_friction_bounds_nothing() {
    let oscillator = damped(0.0);
    let vibration = vibration(&oscillator, drive(1.0), 1024);
    let all = climb(&vibration, &oscillator.element, levels(1.0, 500.0, None));
    let most = 4.0 / PI * JENKINS.limit;
    let BackboneEnd::Unbounded {
        level: force,
        growth,
    } = all.end
    else {
        panic!("{:?}", all.end);
    };
    assert!((force / most - 1.0).abs() < 1e-3, "{force} {most}");
    assert!(growth > 100.0, "{growth}");
    let last = all.points.last().expect("a point");
    assert!(last.force < force && last.force > 0.99 * most, "{last:?}");
    let found = errors(&all, &exact(0.0));
    assert!(found[1] < 1e-4 && found[2] < 1e-3, "{found:?}");
    assert!(all.solves < 90, "{}", all.solves);
}

#[test]
fn asked_levels_are_those_of_the_points() {
    let oscillator = damped(300.0);
    let vibration = vibration(&oscillator, drive(150.0), 256);
    let all = climb(
        &vibration,
        &oscillator.element,
        levels(1.0, 1000.0, Some(4)),
    );
    let forces: Vec<f64> = all.points.iter().map(|point| point.force).collect();
    assert_eq!(forces.len(), 4);
    for (found, expected) in forces.iter().zip([1.0, 10.0, 100.0, 1000.0]) {
        assert!((found / expected - 1.0).abs() < 1e-12, "{forces:?}");
    }
    // The points that lead to these levels belong to the same resonance.
    let free = climb(&vibration, &oscillator.element, levels(1.0, 1000.0, None));
    let ends = |all: &Backbone| *all.points.last().expect("a point");
    let (asked, free) = (ends(&all), ends(&free));
    assert!((asked.amplitude / free.amplitude - 1.0).abs() < 1e-8);
    assert!((asked.damping_ratio / free.damping_ratio - 1.0).abs() < 1e-8);
}

/// Where the joint is linear, the peak of the forced response lies at √(1 − 2ζ²) of the phase resonance, which is 0.1 % lower at a ζ of 3
/// %. Its amplitude is higher by ζ²/2.
#[test]
#[ignore = "long: half a minute"]
fn peaks_of_forced_responses_lie_on_the_backbone() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping[0] = 100.0;
    let mut vibration = vibration(&oscillator, drive(1.0), 1024);
    vibration.harmonics = Harmonics::new(&[0, 1, 3]).expect("valid");
    let all = climb(&vibration, &oscillator.element, levels(5.0, 800.0, Some(7)));
    for point in &all.points {
        vibration.loads = drive(point.force);
        vibration.points = Some(4001);
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        let balance = balance.expect("valid");
        let frf = vibration.forced_response(&balance).expect("a response");
        let size = |point: &ForcedPoint| point.response.as_ref().map_or(0.0, |r| r.amplitude);
        let top = frf.iter().max_by(|a, b| size(a).total_cmp(&size(b)));
        let top = top.expect("a point");
        let amplitude = (size(top) / point.amplitude - 1.0).abs();
        let frequency = (top.frequency / point.frequency - 1.0).abs();
        println!(
            "{:7.1} N: {amplitude:.1e} {frequency:.1e} {:.4}",
            point.force, point.damping_ratio
        );
        assert!(amplitude < 1e-3, "{amplitude}: {point:?}");
        let shift = 1.0 - (1.0 - 2.0 * point.damping_ratio.powi(2)).sqrt();
        assert!(frequency < 1e-3 + 1.5 * shift, "{frequency}: {point:?}");
    }
}

/// The level scales the drive but not a constant force.
#[test]
fn a_constant_force_is_not_scaled() {
    let oscillator = damped(300.0);
    let constant = Load {
        port: 2,
        harmonic: 0,
        cosine: 40.0,
        sine: 0.0,
    };
    let pressed = changed(&oscillator.element, |slider| {
        // Share of the constant force that the contact carries in parallel with the spring along n.
        slider.normal_load += 40.0 * 3.5e7 / (3.5e7 + 6.3e7);
    });
    let loads = [drive(150.0), vec![constant]].concat();
    let with_force = vibration(&oscillator, loads, 1024);
    let with_preload = vibration(&oscillator, drive(150.0), 1024);
    let levels = levels(2.0, 600.0, Some(5));
    let one = climb(&with_force, &oscillator.element, levels);
    let other = climb(&with_preload, &pressed, levels);
    for (a, b) in one.points.iter().zip(&other.points) {
        assert!(
            (a.amplitude / b.amplitude - 1.0).abs() < 1e-7,
            "{a:?} {b:?}"
        );
        assert!(
            (a.damping_ratio / b.damping_ratio - 1.0).abs() < 1e-7,
            "{a:?} {b:?}"
        );
    }
    assert_eq!(one.points.len(), 5);
}

/// With a structure of many modes, the coordinates of a point include all modes.
#[test]
fn a_linear_structure_has_the_damping_ratio_of_its_mode() {
    let model = mass_on_springs([2.0, 1.0, 1.0], [30.0; 3], [8e6, 1e8, 1e8], 0);
    let any = oscillator(FrictionLaw::Cone);
    let vibration = Vibration {
        model: model.expect("valid"),
        ..super::vibration(&any, 2, drive(1.0), (1500.0, 2500.0))
    };
    let balance = vibration.balance(Vec::new()).expect("valid");
    let all = vibration
        .backbone(balance, levels(1.0, 1e4, None))
        .expect("linear");
    assert!(all.points.len() < 20, "{}", all.points.len());
    for point in &all.points {
        let ratio = 30.0 / (2.0 * 2.0 * 2000.0);
        assert!(
            (point.damping_ratio / ratio - 1.0).abs() < 1e-10,
            "{point:?}"
        );
        assert!((point.frequency * TAU / 2000.0 - 1.0).abs() < 1e-10);
        assert_eq!(point.sliding_fraction(), 0.0);
    }
}

#[test]
fn levels_that_are_no_range_are_refused() {
    let oscillator = damped(300.0);
    let vibration = vibration(&oscillator, drive(1.0), 64);
    for (wrong, name) in [
        (levels(0.0, 1.0, None), "the least force of the backbone"),
        (levels(2.0, 1.0, None), "the largest force of the backbone"),
        (
            levels(1.0, f64::NAN, None),
            "the largest force of the backbone",
        ),
        (
            levels(1.0, 2.0, Some(1)),
            "the number of levels of the backbone",
        ),
    ] {
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        let refused = vibration.backbone(balance.expect("valid"), wrong);
        let error = refused.expect_err("no range");
        assert!(
            matches!(error, DynamicsError::OutOfRange { name: found, .. } if found == name),
            "{error}"
        );
    }
}

/// The structure cannot be built at a later value of the parameter: the backbone returns the points before this value together with the
/// error.
#[test]
fn an_error_at_a_later_value_leaves_the_points_before_it() {
    const BROKEN: f64 = 400.0;
    let element = super::element(FrictionLaw::Cone);
    let at = |damping: f64| -> Result<_, DynamicsError> {
        if damping > BROKEN {
            return Err(DynamicsError::OutOfRange {
                name: "the damping",
                value: damping,
                expected: "no more",
            });
        }
        let vibration = vibration(&damped(damping), drive(100.0), 256);
        let balance = vibration.balance(vec![element.clone()])?;
        Ok(vibration.driven_structure(balance))
    };
    let over = |count| resonance_over_parameter(levels(100.0, 800.0, count), at);
    for count in [Some(5), None] {
        let (backbone, error) = over(count).expect("a resonance at the first value");
        assert!(backbone.points.len() >= 3, "{:?}", backbone.points);
        assert!(backbone.points.iter().all(|point| point.level <= BROKEN));
        let (BackboneEnd::StructureError { level }, Some(DynamicsError::OutOfRange { value, .. })) =
            (&backbone.end, error)
        else {
            panic!("{:?}", backbone.end);
        };
        assert!(*level > BROKEN && *level == value, "{level}, {value}");
    }
}
