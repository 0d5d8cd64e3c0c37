//! Frequency, damping ratio and amplitude of the phase resonance over the level of the force.

use std::f64::consts::{PI, TAU};

use fretwear::dynamics::oscillator::mass_on_springs;
use fretwear::dynamics::{
    Backbone, BackboneEnd, ContactElement, DynamicsError, ForcedPoint, FrictionLaw, Harmonics,
    Load, LoadLevels, Oscillator, Vibration, resonance_over_parameter,
};
use fretwear::reference::{Jenkins, JenkinsOscillator};

use super::{changed, drive, oscillator};

/// Along x: µN = 54 N of friction on 2.5e7 N/m, beside 4e7 N/m of 1.5 kg.
const JENKINS: Jenkins = Jenkins {
    stiffness: 2.5e7,
    limit: 54.0,
};

fn vibration(oscillator: &Oscillator, loads: Vec<Load>, samples: usize) -> Vibration {
    Vibration {
        settings: super::samples(samples),
        // From below the sliding resonance along x to above the stuck one.
        ..super::vibration(oscillator, 1, loads, (4000.0, 7500.0))
    }
}

fn climb(vibration: &Vibration, element: &ContactElement, levels: LoadLevels) -> Backbone {
    let balance = vibration.balance(vec![element.clone()]).expect("right");
    let backbone = vibration.backbone(balance, levels);
    backbone.unwrap_or_else(|error| panic!("{error}"))
}

fn levels(from: f64, to: f64, count: Option<usize>) -> LoadLevels {
    LoadLevels { from, to, count }
}

/// An oscillator with another dashpot along x.
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

/// The largest relative errors of force, frequency and damping ratio at the amplitudes of the points.
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

/// What is left is that of the samples, which falls with their number squared; without sliding it is rounding.
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
            // c / 2mω, and not more than the last digits of it.
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

/// Lines between its points are the curve to 0.15 % of frequency and, but for the kink where sliding begins, 3 % of damping ratio.
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

/// Friction bounds a force of 4R/π at most.
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
    // What was found on the way to them is the same resonance.
    let free = climb(&vibration, &oscillator.element, levels(1.0, 1000.0, None));
    let ends = |all: &Backbone| *all.points.last().expect("a point");
    let (asked, free) = (ends(&all), ends(&free));
    assert!((asked.amplitude / free.amplitude - 1.0).abs() < 1e-8);
    assert!((asked.damping_ratio / free.damping_ratio - 1.0).abs() < 1e-8);
}

/// The top of a forced response lies √(1 − 2ζ²) below the phase resonance where the joint is linear, which is 0.1 % at a ζ of 3 %, and
/// its amplitude is higher by ζ²/2.
#[test]
#[ignore = "long: half a minute"]
fn peaks_of_forced_responses_lie_on_the_backbone() {
    let mut oscillator = oscillator(FrictionLaw::Cone);
    oscillator.damping[0] = 100.0;
    let mut vibration = vibration(&oscillator, drive(1.0), 1024);
    vibration.harmonics = Harmonics::new(&[0, 1, 3]).expect("right");
    let all = climb(&vibration, &oscillator.element, levels(5.0, 800.0, Some(7)));
    for point in &all.points {
        vibration.loads = drive(point.force);
        vibration.points = Some(4001);
        let balance = vibration.balance(vec![oscillator.element.clone()]);
        let balance = balance.expect("right");
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

/// The level moves the drive and leaves a constant force alone.
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
        // The share of the constant force that the contact takes beside the spring along n.
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

/// Of a structure of many modes the coordinates are those of all of them.
#[test]
fn a_linear_structure_has_the_damping_ratio_of_its_mode() {
    let model = mass_on_springs([2.0, 1.0, 1.0], [30.0; 3], [8e6, 1e8, 1e8], 0);
    let any = oscillator(FrictionLaw::Cone);
    let vibration = Vibration {
        model: model.expect("right"),
        ..super::vibration(&any, 2, drive(1.0), (1500.0, 2500.0))
    };
    let balance = vibration.balance(Vec::new()).expect("right");
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
        let refused = vibration.backbone(balance.expect("right"), wrong);
        let error = refused.expect_err("no range");
        assert!(
            matches!(error, DynamicsError::OutOfRange { name: found, .. } if found == name),
            "{error}"
        );
    }
}

/// Of a parameter, the points before a value whose structure cannot be made stand beside the error.
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
